"""What meets in weak noise, at many lam at once in float64: order 0, and the size of order 1.

The closed forms of `symasym.asymptotics.uniform.coalescing_pair` to leading order. The singular
terms that cancel there, for which digits are added, are here combined beforehand: nothing is
subtracted as a barrier reaches the layer's end or a well.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise import compose
from symasym.asymptotics.weak_noise.series import Numbers, Point
from symasym.base.inputs import FloatArray
from symasym.special.airy_tables import airy_products, dawson

__all__ = ["Edge", "EdgePart", "Fold", "FoldPart", "escape_time"]

# The error of the composite where fold and end meet is in no next term.
_FACTOR = 5.0
# lam phi (r - 1) below which its own series is exact in float64, and its terms.
_SMALL, _TERMS = 0.1, 9


class Fold(NamedTuple):
    """A well and a barrier, u' = a + b s + ... with the next such pair (a_1, b_1).

    `rough` is the rounding of `zeta`, which is as large beside the fold as anywhere.
    """

    key: int
    zeta: Numbers
    a: Numbers
    b: Numbers
    next_a: Numbers
    next_b: Numbers
    rough: Numbers


class Edge(NamedTuple):
    """A barrier before an end, seen from it.

    Attributes
    ----------
    t : sqrt(2 (V(barrier) - V(end)))
    peak : the barrier's leading coefficient
    rest : 1/phi(end) - peak/t, without its cancellation
    next_peak : order 1 of the barrier, relative to `peak`
    next_rest : order 1 of `rest`
    slope : phi beyond the end, or None where nothing is beyond
    """

    key: int
    t: Numbers
    peak: Numbers
    rest: Numbers
    next_peak: Numbers
    next_rest: Numbers
    slope: Numbers | None


class _Point(Point):
    """With r, and the local functions that have been found at this lam."""

    def __init__(self, at: Point, r: Numbers) -> None:
        vars(self).update(vars(at))
        self.r = r
        self.known: dict[Any, dict[str, tuple[Any, Any]]] = {}

    @cached_property
    def third(self) -> Any:
        """lam^(1/3), which takes as long as ten multiplications."""
        return np.cbrt(self.lam)


class FoldPart(NamedTuple):
    """One of 'rising', 'falling' and 'both'; heights are left out."""

    fold: Fold
    part: str

    def at(self, point: Any) -> tuple[Any, Any]:
        both = self.part == "both"
        key = self.fold.key, both
        if key not in point.known:
            point.known[key] = _double(self.fold, point) if both else _single(self.fold, point)
        found: tuple[Any, Any] = point.known[key][self.part]
        return found


def _single(f: Fold, point: _Point) -> dict[str, tuple[Any, Any]]:
    """int e^{lam V} and int e^{-lam V}."""
    third = point.third
    small = 1 / third
    z = np.asarray(third * third * f.zeta)
    found = airy_products(z, double=point.errors)
    bi, slope = found.bi * (np.pi * small), found.bi_slope * (np.pi * small * small)
    up, down = f.a * bi + f.b * slope, f.a * bi - f.b * slope
    if not point.errors:
        return {"rising": (up, None), "falling": (down, None)}
    wrong = np.abs(f.next_a) * point.x * np.abs(bi) + np.abs(f.next_b) * point.x * np.abs(slope)
    # Off the real line a pair leaves both integrals to the start and the ends, the further the
    # more; but those have it in no order of their series.
    size = np.abs(f.a) * np.sqrt(found.squares) + np.abs(f.b) * small * np.sqrt(found.slopes)
    lost = third * third * f.rough * (1 + np.sqrt(np.abs(z)))
    wrong = wrong + np.pi * small * size * (lost - np.expm1(np.minimum(z, 0.0)))
    return {"rising": (up, wrong), "falling": (down, wrong)}


def _double(f: Fold, point: _Point) -> dict[str, tuple[Any, Any]]:
    """The double integral over both."""
    third = point.third
    small = 1 / third
    z = np.asarray(third * third * f.zeta)
    found = airy_products(z, single=False)
    squares, slopes = found.squares, found.slopes * (small * small)
    unit = (np.pi * small) ** 2
    both = unit * (f.a * f.a * squares - f.b * f.b * slopes)
    if not point.errors:
        return {"both": (both, None)}
    next_a, next_b = np.abs(f.next_a) * point.x, np.abs(f.next_b) * point.x
    # Order 1 has the cross term alone, which may vanish; its parts do not.
    cross = np.abs(found.cross) * small
    missed = 2 * (np.abs(f.a) * next_b + next_a * np.abs(f.b)) * cross
    missed = missed + next_a * next_a * squares + next_b * next_b * slopes
    # log(Ai² + Bi²) has a slope of 2 sqrt(Z) above, and of 1/(2 Z) below.
    slope = np.where(z > 0, 2 * np.sqrt(np.maximum(z, 0.0)) + 1, 1 / (1 + np.abs(z)))
    lost = third * third * f.rough * slope
    return {"both": (both, unit * missed + lost * both)}


class EdgePart(NamedTuple):
    """One of 'rising', 'falling', 'onward' and 'both' at the end; heights are left out."""

    edge: Edge
    part: str

    def at(self, point: Any) -> tuple[Any, Any]:
        if self.edge.key not in point.known:
            point.known[self.edge.key] = _cut(self.edge, point)
        found: tuple[Any, Any] = point.known[self.edge.key][self.part]
        return found


def _cut(e: Edge, point: _Point) -> dict[str, tuple[Any, Any]]:
    """See `symasym.asymptotics.uniform.gaussian_cut`; what lies beyond the end is included."""
    lam, x = point.lam, point.x
    root = np.sqrt(lam)
    near = dawson(np.asarray(e.t * root * np.sqrt(0.5)))
    tail = e.peak * near.shade * np.sqrt(np.pi / 2) / root
    slow = e.peak * near.value * np.sqrt(2.0) / root
    rest = e.rest * x
    shelf, beyond = _shelf(e.slope, point)
    rising = shelf - tail - rest
    falling = slow + rest
    # int F less its own logarithm, which the outer part has.
    area = near.area - (np.euler_gamma + np.log(2 * lam)) / 2 - np.log(e.t)
    both = e.peak * e.peak * area * x - slow * rest + beyond
    values = {"rising": rising, "falling": falling, "onward": shelf, "both": both}
    if not point.errors:
        return {part: (value, None) for part, value in values.items()}
    wrong, miss = np.abs(e.next_peak) * x, np.abs(e.next_rest) * x * x
    errors = {
        "rising": tail * wrong + miss,
        "falling": slow * wrong + miss,
        "onward": 0.0,
        "both": rest * rest / 2 + slow * (wrong * np.abs(rest) + miss),
    }
    return {part: (value, errors[part]) for part, value in values.items()}


def _shelf(slope: Numbers | None, point: _Point) -> tuple[Any, Any]:
    """int_1^r e^{-lam slope (u - 1)} du, and the double integral beyond the end."""
    if slope is None:
        return 0.0, 0.0
    length = point.r - 1.0
    y = point.lam * slope * length
    small = np.abs(y) < _SMALL
    safe = np.where(small, 1.0, y)
    first: Any = 0.0
    second: Any = 0.0
    for k in range(_TERMS, -1, -1):
        first, second = (1 - y * first) / (k + 1), (1 - y * second) / (k + 2)
    first = np.where(small, first, -np.expm1(-safe) / safe)
    second = np.where(small, second, (safe + np.expm1(-safe)) / (safe * safe))
    return length * first, length * length * second


def escape_time(composed: compose.Composed, at: Point) -> tuple[FloatArray, Any]:
    """log T, and its relative error (None without `at.errors`)."""
    point = _Point(at, composed.r)
    log, error = compose.escape_time(composed, point)
    if error is not None:
        # What the start or an end cuts off a complex pair.
        error = _FACTOR * error + 20 * np.exp(-point.lam * composed.slack)
        error = np.where(error < 1, -np.log1p(-np.minimum(error, 0.999)), np.inf)
    return log, error
