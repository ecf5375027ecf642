"""Positive float64 numbers of any size: their logarithms, and bounds on those by running analysis.

A sum of logarithms is right to half an ulp, and an addition of numbers forgets the error of the
smaller term.
"""

from __future__ import annotations

import numpy as np

from symasym.base.inputs import FloatArray, IntArray

#: More than the relative error of a sum of two float64 numbers.
_ROUNDING = 1.5e-16
#: The logarithm that stands for 0; sums of it with others stay finite.
_NONE = -1e300


class LogPositive:
    """Positive numbers, elementwise; `error` bounds that of `log`.

    Arithmetic takes 0 and 1 as well, for which whole numbers stand.
    """

    __slots__ = ("error", "log")
    # An array times this is one of these, not an array of them.
    __array_ufunc__ = None

    def __init__(self, log: FloatArray, error: FloatArray) -> None:
        self.log, self.error = log, error

    @classmethod
    def of(cls, value: FloatArray, error: FloatArray | float = 0.0) -> LogPositive:
        """From float64 numbers that are not negative."""
        with np.errstate(divide="ignore"):
            log = np.maximum(np.log(value), _NONE)
        return cls(log, np.broadcast_to(error, log.shape))

    def __getitem__(self, index: slice | IntArray) -> LogPositive:
        return LogPositive(self.log[index], self.error[index])

    def followed_by(self, other: LogPositive) -> LogPositive:
        """One array of these numbers and those of another."""
        if not other.log.size:
            return self
        return LogPositive(
            np.concatenate((self.log, other.log)), np.concatenate((self.error, other.error))
        )

    def __mul__(self, other: LogPositive | int) -> LogPositive:
        term = _positive(other)
        log = self.log + term.log
        return LogPositive(log, self.error + term.error + _ROUNDING * np.abs(log))

    __rmul__ = __mul__

    def __truediv__(self, other: LogPositive | int) -> LogPositive:
        term = _positive(other)
        log = self.log - term.log
        return LogPositive(log, self.error + term.error + _ROUNDING * np.abs(log))

    def __rtruediv__(self, other: int) -> LogPositive:
        return _positive(other) / self

    def __add__(self, other: LogPositive | int) -> LogPositive:
        term = _positive(other)
        apart = self.log - term.log
        # Exponential and logarithm are vectorised in NumPy, its logaddexp is not.
        ratio = np.exp(-np.abs(apart))
        whole = 1.0 + ratio
        log = np.maximum(self.log, term.log) + np.log(whole)
        # A share may be 0 and its error 1e284: neither is found as a difference.
        larger, smaller = 1.0 / whole, ratio / whole
        first = apart > 0
        error = np.where(first, larger, smaller) * self.error
        error += np.where(first, smaller, larger) * term.error
        return LogPositive(log, error + _ROUNDING * (np.abs(log) + 2.0))

    __radd__ = __add__


def _positive(x: LogPositive | int) -> LogPositive:
    """The number itself; 1 or 0 for these whole numbers."""
    if isinstance(x, LogPositive):
        return x
    return LogPositive(np.asarray(0.0 if x else _NONE), np.asarray(0.0))
