"""Positive numbers by their logarithms: a value, bounds on both sides of it, and its rounding.

The arithmetic of `sweep` for arrays in float64. Sums and products increase in each operand, so that
the ends of a result come from the ends of its operands; a quotient takes those of the divisor the
other way round.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.base.inputs import FloatArray

# Rounding of one operation: that of a logarithm, an exponential and a sum, and of the result.
_UNIT = 5e-16
# Of a logarithm to begin with: that of lam, of a few products, of the function itself.
_FIRST = 1e-15


class LogBounds:
    """Logarithms in `rows`: the number, a lower and an upper bound of it; the rows' rounding."""

    __slots__ = ("rounding", "rows")
    # An array times this is one of these, not an array of them.
    __array_ufunc__ = None

    def __init__(self, rows: FloatArray, rounding: FloatArray) -> None:
        self.rows, self.rounding = rows, rounding

    @classmethod
    def of_log(cls, log: FloatArray) -> LogBounds:
        """The number whose logarithm this is."""
        return cls(np.tile(log, (3, 1)), _FIRST * _size(log))

    def _of(self, other: LogBounds | FloatArray | float) -> LogBounds:
        """Numbers as logarithms with bounds."""
        if isinstance(other, LogBounds):
            return other
        return LogBounds.of_log(np.log(other) + 0 * self.rounding)

    def _made(self, rows: FloatArray, rounding: FloatArray) -> LogBounds:
        """The result of one operation, with its rounding."""
        return LogBounds(rows, rounding + _UNIT * _size(rows[0]))

    def __add__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        rows = np.logaddexp(self.rows, y.rows)
        mine, total = self.rows[0], rows[0]
        share = np.where(np.isfinite(total), np.exp(mine - total), mine > 0)
        return self._made(rows, share * self.rounding + (1 - share) * y.rounding)

    __radd__ = __add__

    def __mul__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        return self._made(self.rows + y.rows, self.rounding + y.rounding)

    __rmul__ = __mul__

    def __truediv__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        y = self._of(other)
        return self._made(self.rows - y.rows[[0, 2, 1]], self.rounding + y.rounding)

    def __rtruediv__(self, other: LogBounds | FloatArray | float) -> LogBounds:
        quotient: LogBounds = self._of(other) / self
        return quotient

    def where(self, test: np.ndarray[Any, np.dtype[np.bool_]], other: LogBounds) -> LogBounds:
        """This where `test` holds, else the other."""
        return LogBounds(
            np.where(test, self.rows, other.rows), np.where(test, self.rounding, other.rounding)
        )


def _size(log: FloatArray) -> FloatArray:
    """1 + |log|; 1 where that is infinite, whose rounding is none."""
    size: FloatArray = 1 + np.where(np.isfinite(log), np.abs(log), 0.0)
    return size
