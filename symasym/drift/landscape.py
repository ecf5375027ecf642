"""V in float64 (eq:V2), and the plot of phi and V with wells and barriers labelled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base import inputs
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray, common_shape
from symasym.drift.critical_points import critical_points
from symasym.drift.model import Parametrized
from symasym.drift.sampled import Sampled, flat_values, values_at

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_REACH, _POINTS = 1.5, 3_001
_MOST_NAMES = 16  # more labels would overlap


def potential_at(drift: Parametrized, u: FloatArray) -> FloatArray:
    """V in float64 with V(-1) = 0, by Gauss-Legendre quadrature on the panels of `Sampled`."""
    drift.require_bound()
    model = drift.model
    position = np.broadcast_to(u, common_shape({"drift": drift.shape, "u": u.shape}))
    low, high = (-1.0, 1.0) if model.layered else (min(u.min(), -1.0), max(u.max(), -1.0))
    inside = np.clip(position, low, high)
    marks = [low, *np.clip([float(x) for x in model.cuts], low, high).tolist(), high]
    parameters, cuts, terms = flat_values(drift, drift.shape), {*marks}, 0
    for row in range(math.prod(drift.shape)):
        arrays = {k: x[row : row + 1] for k, x in parameters.items() if isinstance(x, np.ndarray)}
        for piece, span in zip(model.pieces, pairwise(marks), strict=False):
            held = Sampled(piece, {**drift.values, **arrays}, 1, span=span)
            if held.cuts is None:
                raise AccuracyError(f"V of {drift!r} takes too many panels; take a less steep A.")
            cuts.update(held.cuts.tolist())
            terms = max(terms, held.terms)
        if len(cuts) == len({*marks}):  # A is a polynomial, for all parameters
            break
    rule = np.polynomial.legendre.leggauss(terms // 2 + 1)
    with np.errstate(over="ignore", invalid="ignore"):
        total: FloatArray = -values_at(drift, position) * (position - inside)
        for left, right in pairwise(sorted(cuts)):
            start = min(max(-1.0, left), right)
            half = (np.clip(inside, left, right) - start) / 2
            for node, weight in zip(*rule, strict=True):
                total = total - weight * half * values_at(drift, start + half * (1 + node))
    if not np.isfinite(total).all():
        raise RangeError(
            f"V of {drift!r} leaves the range of float64; rescale the drift, or give u nearer to 0."
        )
    return np.asarray(total)


def plot(drift: Parametrized, axes: Sequence[Axes] | None) -> Any:
    """Plot phi above V; see `symasym.drift.drift.Drift.plot`."""
    drift.scalars()
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots(2, sharex=True, layout="constrained")[1]
    above, below = inputs.axes("axes", axes, 2)
    model = drift.model
    cuts = [float(x) for x in model.cuts]
    reach = max(_REACH, *(1.5 * abs(x) for x in cuts)) if cuts else _REACH
    u = np.linspace(-reach, reach, _POINTS)
    jumps = np.searchsorted(u, cuts)  # at jumps the curve is interrupted
    above.plot(np.insert(u, jumps, np.nan), np.insert(values_at(drift, u), jumps, np.nan))
    above.axhline(0, color="0.6", linewidth=0.8)
    above.set_ylabel(r"$\phi(u)$")
    below.plot(u, potential_at(drift, u))
    below.set(xlabel="u", ylabel="V(u)")
    for ax in (above, below):
        # The ends of the layer, or of the pieces.
        for end in (-1, 1) if model.layered else cuts:
            ax.axvline(end, color="0.6", linewidth=0.8, linestyle=":")
    points = critical_points(drift) if model.layered else []
    named = [p for p in points if p.kind != "inflection"]
    places = np.array([float(p.u) for p in named])
    heights = potential_at(drift, places) if named else places
    for ax, y in ((above, 0 * places), (below, heights)):
        ax.plot(places, y, "o", color="0.3", markersize=4)
    for p, place, height in zip(named[:_MOST_NAMES], places, heights, strict=False):
        side, edge = (1, "bottom") if p.kind == "barrier" else (-1, "top")
        below.annotate(
            f"{p.kind} at {place:.4g}", (place, height), xytext=(0, 9 * side),
            textcoords="offset points", ha="center", va=edge, fontsize="small",
        )  # fmt: skip
    below.margins(y=0.2)
    return axes
