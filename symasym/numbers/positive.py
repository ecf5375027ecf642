"""Positive float64 numbers with bounds on their relative errors, to first order.

For numbers that stay within the range of float64; those of any size are
`symasym.numbers.float_arrays`. A sum has the mean of the errors, by shares. The rounding of the
operations themselves is left to the caller, who knows how many there are.
"""

from __future__ import annotations

from typing import Any

from symasym.base.inputs import FloatArray


class Positive:
    """Positive numbers, elementwise; plain ones among the operands are exact."""

    __slots__ = ("error", "value")
    # An array times this is one of these, not an array of them.
    __array_ufunc__ = None

    def __init__(self, value: FloatArray, error: FloatArray | float) -> None:
        self.value, self.error = value, error

    def __mul__(self, other: Any) -> Positive:
        if isinstance(other, Positive):
            return Positive(self.value * other.value, self.error + other.error)
        return Positive(self.value * other, self.error)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Positive:
        if isinstance(other, Positive):
            return Positive(self.value / other.value, self.error + other.error)
        return Positive(self.value / other, self.error)

    def __add__(self, other: Positive) -> Positive:
        total = self.value + other.value
        error = (self.value * self.error + other.value * other.error) / total
        return Positive(total, error)
