"""The two arithmetics of the expansions: balls at one lam, arrays of floats at many.

Each has a `lam`, the `order` to which its series are summed, and functions of exponents in units of
lam. Floats are kept with their exponents, as sums of exponentials leave the range of float64.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from flint import arb

from symasym.base.inputs import FloatArray

_LOST = -745.0  # e^x is 0 in float64 below it


class Scaled:
    """m e^(lam h) with an array m and a ball h; a sum takes the largest h of its terms."""

    __array_ufunc__ = None  # so that array * Scaled calls __rmul__

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
        """The logarithm; nan if the value is not positive."""
        found: FloatArray = np.log(self.m) + self.lam * float(self.h)
        return found


class InBalls:
    """Balls at one lam; every series is summed to the order."""

    number: Any = staticmethod(lambda x: x)
    named = staticmethod(lambda name, value: value)

    def __init__(self, lam: Any, order: int) -> None:
        self.lam, self.order, self.log_lam = lam, order, lam.log()
        self.fronts = {1: 1 / lam.sqrt(), 2: 1 / lam}

    def exp(self, height: Any) -> Any:
        """e^(lam height)."""
        return (self.lam * height).exp()

    def exprel(self, height: Any, n: int) -> Any:
        """(e^y - 1)/y for n = 1, (e^y - 1 - y)/y^2 for n = 2, y = lam height (DLMF 13.6.2)."""
        return (self.lam * height).hypgeom_1f1(1, n + 1) / n

    def _horner(self, row: list[Any], x: Any) -> Any:
        total: Any = 0
        for c in row[self.order :: -1]:
            total = total * x + self.number(c)
        return total

    def total(self, row: list[Any]) -> Any:
        """sum row_k lam^k."""
        return self._horner(row, self.lam) * self.exp(arb(0))

    def term(self, letter: str, point: Any, height: Any, halves: int, row: list[Any]) -> Any:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        return self._horner(row, self.fronts[2]) * self.fronts[halves] * self.exp(height)


class InFloats(InBalls):
    """Arrays of floats at many lam."""

    number = staticmethod(float)

    def __init__(self, lam: FloatArray, order: int) -> None:
        self.lam, self.order, self.log_lam = lam, order, np.log(lam)
        self.fronts = {1: 1 / np.sqrt(lam), 2: 1 / lam}

    def exp(self, height: Any) -> Scaled:
        """e^(lam height)."""
        return Scaled(np.ones_like(self.lam), height, self.lam)

    def exprel(self, height: Any, n: int) -> Scaled:
        """The function of `InBalls.exprel`, transformed for height > 0 (DLMF 13.2.39)."""
        from scipy.special import hyp1f1

        up, fall = float(height) > 0, -self.lam * abs(float(height))
        m = hyp1f1(n if up else 1, n + 1, fall) / n
        return Scaled(m, height if up else arb(0), self.lam)
