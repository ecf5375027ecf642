"""The drift and its potential as curves, wells and barriers named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symasym.base import inputs
from symasym.base.errors import RangeError
from symasym.base.inputs import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 400
_MOST_POINTS = 50_000
_REACH = 1.5
_MOST_NAMES = 16
# Matplotlib's transformations leave float64 beyond it.
_LARGEST = 1e300
# Of phi's range, between its curve and a straight line.
_FLAT = 0.005


class Drawn(Protocol):
    """What is drawn of a drift."""

    def __call__(self, u: Any) -> Any: ...

    def potential_at(self, u: Any) -> Any: ...

    def scalars(self) -> Any: ...

    def wells(self) -> Any: ...

    def barriers(self) -> Any: ...


def _curve(drift: Drawn, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """u and phi(u), with points between the given ones until straight lines follow phi."""
    phi = drift(u)
    while u.size < _MOST_POINTS:
        between = (u[1:] + u[:-1]) / 2
        new = drift(between)
        with np.errstate(over="ignore"):
            off = np.abs(new - (phi[1:] / 2 + phi[:-1] / 2)).max()
            if off <= _FLAT * np.ptp(phi):
                break
        # The drift may jump at the layer's ends, which stay points.
        order = np.argsort(np.concatenate([u, between]), kind="stable")
        u, phi = (np.concatenate(pair)[order] for pair in ((u, between), (phi, new)))
    return u, phi


def plot(drift: Drawn, axes: Sequence[Axes] | None) -> Any:
    """phi above V; see `symasym.drift.drift.Drift.plot`."""
    drift.scalars()
    u = np.union1d(np.linspace(-_REACH, _REACH, _POINTS), [-1.0, 1.0])
    height = drift.potential_at(u)
    dense, phi = _curve(drift, u)
    if max(np.abs(phi).max(), np.abs(height).max()) > _LARGEST:
        raise RangeError(
            f"phi or V is above {_LARGEST:g}, the largest that is drawn; rescale the drift."
        )
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots(2, sharex=True, layout="constrained")[1]
    above, below = inputs.axes("axes", axes, 2)
    above.plot(dense, phi)
    above.axhline(0, color="0.6", linewidth=0.8)
    above.set_ylabel(r"$\phi(u)$")
    below.plot(u, height)
    below.set_ylabel("V(u)")
    below.set_xlabel("u")
    for ax in (above, below):
        # The layer's ends, outside of which the drift is constant.
        for end in (-1, 1):
            ax.axvline(end, color="0.6", linewidth=0.8, linestyle=":")
    named = [("well", -1, float(p.u)) for p in drift.wells()]
    named += [("barrier", 1, float(p.u)) for p in drift.barriers()]
    places = np.array([place for _, _, place in named])
    heights = drift.potential_at(places) if named else places
    for ax, y in ((above, 0 * places), (below, heights)):
        ax.plot(places, y, "o", color="0.3", markersize=4)
    for (kind, side, place), height in zip(named, heights, strict=True):
        # More names than that hide each other.
        if len(named) <= _MOST_NAMES:
            below.annotate(
                f"{kind} at {round(place, 9) + 0.0:.4g}",
                (place, height),
                xytext=(0, 9 * side),
                textcoords="offset points",
                ha="center",
                va="bottom" if side > 0 else "top",
                fontsize="small",
            )
    below.margins(y=0.2)
    return axes
