"""Sums of exponentials over arrays of lam, beyond the range of float64."""

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
