"""T, C and P of the points of a bound drift (`symasym.expansions.field`) over two rings.

One lam: balls. Many lam of one drift: coefficients once, in balls, their sums in float64 arrays.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from symasym.base.balls import precision
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.expansions.field import RING, Between, Field, Unresolved

_STEPS = 6  # times that bits are doubled, at most
_LOST = -745.0  # below it e^x is 0 in float64


class Local(NamedTuple):
    """A drift's points with their series, its finite parts, phi at both ends."""

    points: list[weak.Point]
    regular: list[list[Any]]
    slopes: tuple[Any, Any]


@lru_cache(maxsize=16)
def local(drift: Drift, at: Between, name: str, count: int, bits: int) -> Local:
    """What the quantity `name` takes, each series to `count` terms, at flint's `bits`."""
    field = Field(drift, at, name == "T")
    points = weak.points_of(field, count, RING)
    regular = field.regular(count) if name == "T" else []
    if name[-1] == "P":
        points = [p for p in points if p.kind != "end"]
    return Local(points, regular, (field.ends[-1], field.ends[1]))


class AtLam:
    """The points' terms at one lam, to an order."""

    def __init__(self, lam: Any, order: int) -> None:
        self.lam, self.order, self.log_lam = lam, order, lam.log()

    number = staticmethod(lambda x: x)
    named = staticmethod(lambda name, value: value)

    def term(self, letter: str, point: weak.Point, height: Any, halves: int, row: list[Any]) -> Any:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        total = arb(0)
        for c in row[self.order :: -1]:
            total = total / self.lam + c
        return total * RING.root(self.lam, -halves) * (self.lam * height).exp()


def quantity(known: Local, name: str, at: Any) -> Any:
    """T, C, 1 - C, P or 1 - P to the order of `at`."""
    if name == "T":
        return weak.escape_time(known.points, known.regular, at)
    if name[-1] == "C":
        return weak.exit_probability(known.points, at, name != "C")
    outside = weak.outside_layer(known.points, known.slopes, at)
    return 1 - outside if name == "P" else outside


def doubled(find: Callable[[int], Any], bits: int, digits: int = 0) -> Any:
    """What `find` gives at flint's precision of so many bits, which it takes: these are doubled
    until zeros and edges are apart, and the balls that it gives have so many digits."""
    for more in (bits << k for k in range(_STEPS)):
        with suppress(Unresolved), precision(more):
            found = find(more)
            if not digits or all(y.rel_accuracy_bits() > 3.33 * digits + 1 for y in found):
                return found
    raise AccuracyError(
        f"A varies too fast, or its zeros are too close to each other or to an end, for many times "
        f"{bits:,} bits; use method='exact'."
    )


# -- many lam --------------------------------------------------------------------------------------


class Scaled:
    """m e^(lam h), m an array and h one ball; a sum has the height of its highest term."""

    __array_ufunc__ = None  # an array times this is this class's product

    def __init__(self, m: Any, h: Any, lam: FloatArray) -> None:
        self.m, self.h, self.lam = m, h, lam

    def _of(self, other: Any) -> Scaled:
        return other if isinstance(other, Scaled) else Scaled(other, arb(0), self.lam)

    def __add__(self, other: Any) -> Scaled:
        if other.__class__ is int and not other:
            return self
        other = self._of(other)
        low, high = (self, other) if float(self.h) < float(other.h) else (other, self)
        gap = float(low.h - high.h)
        if gap * self.lam.min() < _LOST:
            return high
        return Scaled(high.m + low.m * (np.exp(self.lam * gap) if gap else 1.0), high.h, self.lam)

    __radd__ = __add__

    def __neg__(self) -> Scaled:
        return Scaled(-self.m, self.h, self.lam)

    def __sub__(self, other: Any) -> Scaled:
        return self.__add__(-1 * other)

    def __rsub__(self, other: Any) -> Scaled:
        return self.__neg__().__add__(other)

    def __mul__(self, other: Any) -> Scaled:
        other = self._of(other)
        return Scaled(self.m * other.m, self.h + other.h, self.lam)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Scaled:
        other = self._of(other)
        return Scaled(self.m / other.m, self.h - other.h, self.lam)

    def log(self) -> FloatArray:
        """The logarithm; nan where the value is not positive."""
        found: FloatArray = np.log(self.m) + self.lam * float(self.h)
        return found


class AtLams:
    """The points' terms at many lam, to an order."""

    def __init__(self, lam: FloatArray, order: int) -> None:
        self.lam, self.order, self.x, self.log_lam = lam, order, 1 / lam, np.log(lam)
        self.fronts = {1: np.sqrt(self.x), 2: self.x}

    number = staticmethod(float)
    named = staticmethod(lambda name, value: value)

    def term(self, letter: str, point: Any, height: Any, halves: int, row: list[Any]) -> Scaled:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        total: Any = 0.0
        for c in row[self.order :: -1]:
            total = total * self.x + float(c)
        return Scaled(total * self.fronts[halves], height, self.lam)
