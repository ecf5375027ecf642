"""Positive float64 numbers of any size: their logarithms, and bounds on those by running analysis.

A sum of logarithms is right to half an ulp, and an addition of numbers forgets the error of the
smaller term, unless it could be the larger one. `LogSlopes` carry the derivatives of their
logarithms as well, in which an addition forgets the smaller term, too:

    d log(x + y) = s d log x + (1 - s) d log y,    s = x/(x + y).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.base.inputs import FloatArray, IntArray
from symasym.numbers.dual_arrays import DualArray, slopes_of, value_of

#: More than the relative error of a sum of two float64 numbers.
_ROUNDING = 1.5e-16
#: Errors of two logarithms up to which that of a sum is linear in them, to 0.5 %.
_LINEAR = 0.01
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
    def of(cls, value: FloatArray | DualArray, error: FloatArray | float = 0.0) -> LogPositive:
        """From float64 numbers that are not negative; `LogSlopes` from dual ones."""
        with np.errstate(divide="ignore"):
            log = np.maximum(np.log(value_of(value)), _NONE)
        if isinstance(value, DualArray):
            slopes = np.where(value.value == 0, 0.0, value.slopes / value.value)
            return with_log(DualArray(log, slopes), error)
        return with_log(log, error)

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
        if not isinstance(other, LogPositive):
            # Of 1 + x with x far below 1 the logarithm is x.
            log = np.logaddexp(self.log, term.log)
            share = np.exp(np.minimum(self.log - log, 0.0))
            error = share * self.error
            if np.fmax.reduce(self.error, axis=None) > _LINEAR:
                most = np.logaddexp(self.log + self.error, term.log) - log
                error = np.where(self.error > _LINEAR, most, error)
            return LogPositive(log, error + _ROUNDING * np.abs(log))
        apart = self.log - term.log
        # Exponential and logarithm are vectorised in NumPy, its logaddexp is not.
        ratio = np.exp(-np.abs(apart))
        whole = 1.0 + ratio
        behind = np.log(whole)
        log = np.maximum(self.log, term.log) + behind
        # A share may be 0 and its error 1e284: neither is found as a difference.
        larger, smaller = 1.0 / whole, ratio / whole
        first = apart > 0
        error = np.where(first, larger, smaller) * self.error
        error += np.where(first, smaller, larger) * term.error
        if np.fmax.reduce(self.error + term.error, axis=None) > _LINEAR:
            # log of the sum of both shares, each times e to its error: convex, so no less below.
            ahead = np.minimum(apart, 0.0) + self.error, np.minimum(-apart, 0.0) + term.error
            most = np.logaddexp(*ahead) - behind
            error = np.where(self.error + term.error > _LINEAR, most, error)
        return LogPositive(log, error + _ROUNDING * (np.abs(log) + 2.0))

    __radd__ = __add__


class LogSlopes(LogPositive):
    """Positive numbers with the derivatives of their logarithms, and estimates of the errors of
    these; the parameters of the derivatives come before all axes."""

    __slots__ = ("slope_error", "slopes")

    def __init__(self, plain: LogPositive, slopes: FloatArray, slope_error: FloatArray) -> None:
        super().__init__(plain.log, plain.error)
        self.slopes, self.slope_error = slopes, slope_error

    def __getitem__(self, index: slice | IntArray) -> LogSlopes:
        plain = super().__getitem__(index)
        return LogSlopes(plain, self.slopes[:, index], self.slope_error[:, index])

    def followed_by(self, other: LogPositive) -> LogSlopes:
        if not other.log.size:
            return self
        slopes, error = (
            np.concatenate((x, np.broadcast_to(y, (len(x), len(other.log)))), axis=1)
            for x, y in zip((self.slopes, self.slope_error), _slopes(other), strict=True)
        )
        return LogSlopes(super().followed_by(other), slopes, error)

    def __mul__(self, other: LogPositive | int) -> LogSlopes:
        slopes, error = _slopes(other)
        total = self.slopes + slopes
        error = self.slope_error + error + _ROUNDING * np.abs(total)
        return LogSlopes(super().__mul__(other), total, error)

    __rmul__ = __mul__

    def __truediv__(self, other: LogPositive | int) -> LogSlopes:
        slopes, error = _slopes(other)
        total = self.slopes - slopes
        error = self.slope_error + error + _ROUNDING * np.abs(total)
        return LogSlopes(super().__truediv__(other), total, error)

    def __rtruediv__(self, other: LogPositive | int) -> LogSlopes:
        slopes, error = _slopes(other)
        total = slopes - self.slopes
        error = self.slope_error + error + _ROUNDING * np.abs(total)
        return LogSlopes(_positive(other) / LogPositive(self.log, self.error), total, error)

    def __add__(self, other: LogPositive | int) -> LogSlopes:
        plain, term = super().__add__(other), _positive(other)
        slopes, error = _slopes(other)
        # The smaller share, to full relative precision, and how far it is off: 1/(1 + e^x) for
        # some x within `apart` +- `known`.
        share = np.exp(np.minimum(self.log, term.log) - plain.log)
        apart = np.abs(self.log - term.log)
        known = self.error + term.error + _ROUNDING * np.abs(plain.log)
        off = np.where(
            known < 1.0,
            np.expm1(np.minimum(known, 1.0)) * share,
            np.exp(np.minimum(known - apart, 0.0)),
        )
        smaller = self.log < term.log
        first = np.where(smaller, share, 1.0 - share) * self.slopes
        second = np.where(smaller, 1.0 - share, share) * slopes
        slope_error = (
            np.where(smaller, share, 1.0 - share) * self.slope_error
            + np.where(smaller, 1.0 - share, share) * error
            + off * np.abs(self.slopes - slopes)
            + _ROUNDING * (np.abs(first) + np.abs(second))
        )
        return LogSlopes(plain, first + second, slope_error)

    __radd__ = __add__


def _slopes(x: LogPositive | int) -> tuple[Any, Any]:
    """The derivatives of log x and their errors, 0 of what carries none."""
    return (x.slopes, x.slope_error) if isinstance(x, LogSlopes) else (0.0, 0.0)


def with_log(log: FloatArray | DualArray, error: FloatArray | DualArray | float) -> LogPositive:
    """The numbers of these logarithms; of a dual `error`, the slopes are the errors of slopes."""
    value, known = value_of(log), value_of(error)
    if np.shape(known) != value.shape:
        known = np.full(value.shape, known)
    plain = LogPositive(value, known)
    if not isinstance(log, DualArray):
        return plain
    return LogSlopes(plain, log.slopes, slopes_of(error) + np.zeros_like(log.slopes))


def _positive(x: LogPositive | int) -> LogPositive:
    """The number itself; 1 or 0 for these whole numbers."""
    if isinstance(x, LogPositive):
        return x
    return LogPositive(np.asarray(0.0 if x else _NONE), np.asarray(0.0))
