"""Values of V in float64 (eq:V2)."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
from flint import arb

from symasym.base.balls import precision
from symasym.base.errors import AccuracyError, RangeError, RegionError
from symasym.base.inputs import FloatArray, common_shape
from symasym.drift.evaluate import profile, rational
from symasym.drift.parametrized import Parametrized
from symasym.drift.sampled import Sampled, flat_values, values_at

_END_BITS = 4096  # numbers within 1e±300 that cancel leave digits


def potential_at(drift: Parametrized, u: FloatArray) -> FloatArray:
    """V in float64 with V(-1) = 0, by Gauss and Legendre's rule on the panels that hold A."""
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
        if len(cuts) == len({*marks}):  # polynomials, of any parameters
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


def end(drift: Parametrized, side: int) -> Any:
    """A(side), side = -1 or 1: a Fraction where it is rational, else a float, or an array."""
    if drift.shape:
        known = drift.model.end(drift.values, side)
        value = values_at(drift, np.array(float(side))) if known is None else known
        return np.broadcast_to(np.asarray(value, dtype=np.float64), drift.shape)
    if (exactly := drift.end(side)) is not None:
        return exactly
    with precision(_END_BITS):
        numbers = {name: rational(x) for name, x in drift.values.items()}
        return float(profile(drift.model.pieces[0], numbers)(arb(side)).mid())


def region(a_minus: Any, a_plus: Any) -> Any:
    """The words of section 4 for the signs of a- and a+; RegionError at a tangency."""
    left, right = np.sign(np.array([a_minus, a_plus]))
    for name, signs in (("a-", left), ("a+", right)):
        if not np.all(signs):
            raise RegionError(
                f"{name} is 0, a tangency, which the paper's table of regions leaves out; "
                "change a parameter, or ask for a quantity that needs no region."
            )
    sliding = np.where(left > 0, "sliding", "repelling sliding")
    found = np.where(left == right, "crossing", sliding)
    return found if found.ndim else str(found)
