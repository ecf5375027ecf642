"""Many lam of one drift: coefficients once, in balls, their sums in float64 arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb

from symasym.base.inputs import FloatArray

_LOST = -745.0  # below it e^x is 0 in float64


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
