"""Floats with an exponent of their own: sums of exponentials that no float64 holds."""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.base.inputs import FloatArray


class LogScaled:
    """mantissa * e^exponent, elementwise; signed, with 0 as mantissa 0."""

    __slots__ = ("exponent", "mantissa")
    # An array times this is one of these, not an array of them.
    __array_ufunc__ = None

    def __init__(self, mantissa: Any, exponent: Any) -> None:
        self.mantissa, self.exponent = mantissa, exponent

    def __add__(self, other: Any) -> LogScaled:
        term = other if isinstance(other, LogScaled) else LogScaled(other, 0.0)
        # An exact 0 must not lift the exponent above that of what it is added to.
        mine = np.where(self.mantissa == 0, -np.inf, self.exponent)
        theirs = np.where(term.mantissa == 0, -np.inf, term.exponent)
        top = np.maximum(mine, theirs)
        top = np.where(np.isfinite(top), top, 0.0)
        total = self.mantissa * np.exp(mine - top) + term.mantissa * np.exp(theirs - top)
        return LogScaled(total, top)

    __radd__ = __add__

    def __neg__(self) -> LogScaled:
        return LogScaled(-self.mantissa, self.exponent)

    def __sub__(self, other: LogScaled) -> LogScaled:
        return self + (-other)

    def __mul__(self, other: Any) -> LogScaled:
        if isinstance(other, LogScaled):
            return LogScaled(self.mantissa * other.mantissa, self.exponent + other.exponent)
        return LogScaled(self.mantissa * other, self.exponent)

    __rmul__ = __mul__

    def __truediv__(self, other: LogScaled) -> LogScaled:
        return LogScaled(self.mantissa / other.mantissa, self.exponent - other.exponent)

    def __abs__(self) -> LogScaled:
        return LogScaled(np.abs(self.mantissa), self.exponent)

    def __lt__(self, other: LogScaled) -> Any:
        return (other - self).mantissa > 0

    def log(self) -> FloatArray:
        """The logarithm; nan where the value is negative."""
        found: FloatArray = np.log(self.mantissa) + self.exponent
        return found
