"""Intervals of float64 arrays that enclose reals, and sums whose large parts cancel exactly.

IEEE 754 rounds + - * / and the square root to the nearest float, so that the next float on either
side of the result is a bound of it. NumPy's exp, expm1, log and log1p are taken to be right to
`_ULPS` units in the last place, which is twice what its accuracy tests allow, and results below
the range of normal floats to `_TINY`; that is the one assumption, tested against Arb. What comes
out as nan (oo - oo, 0 oo) is the whole line.

A sum x + e of a float and an interval (`Compensated`) keeps what a float64 loses: heights of a
potential are subtracted in it before lam multiplies them. TwoSum and TwoProduct are exact but for
underflow (T. J. Dekker, Numer. Math. 18 (1971) 224; D. E. Knuth, The Art of Computer Programming
2, section 4.2.2), which `_UNDERFLOW` covers.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.numbers.float_arrays import two_product, two_sum

if TYPE_CHECKING:
    from flint import arb

_ULPS = 8
_RELATIVE = _ULPS * 2.0**-52
_TINY, _UNDERFLOW = 1e-306, 1e-290
_MOST = float(np.finfo(float).max)


class Intervals:
    """Reals between `low` and `high`, elementwise; the ends may be infinite."""

    __slots__ = ("high", "low")
    __array_ufunc__ = None  # an ndarray on the left must defer to our operators

    def __init__(self, low: Any, high: Any) -> None:
        if not np.all((low <= high) & (low < np.inf)):
            unknown = np.isnan(low) | np.isnan(high)
            # What overflowed is a real all the same, beyond the largest float.
            low = np.where(unknown, -np.inf, np.minimum(low, _MOST))
            high = np.where(unknown, np.inf, high)
        self.low: FloatArray = low
        self.high: FloatArray = high

    @classmethod
    def of(cls, value: Intervals | Fraction | arb | FloatArray | float) -> Intervals:
        """An interval as it is; the smallest around floats, rationals or a ball."""
        if isinstance(value, Intervals):
            return value
        if isinstance(value, Fraction):
            near = _nearest(value)
            return cls(near, near) if Fraction(near) == value else _outward(near, near)
        if isinstance(value, (np.ndarray, float, int)):
            return cls(value, value)
        low, high = (float(end) for end in (value.lower(), value.upper()))
        return _outward(low, high)

    @classmethod
    def column(cls, values: list[Any]) -> Intervals:
        """A column of enclosures of each value, against which rows broadcast."""
        each = [cls.of(value) for value in values]
        low, high = (
            np.array([float(end) for end in ends])
            for ends in zip(*((x.low, x.high) for x in each), strict=True)
        )
        return cls(low[:, None], high[:, None])

    def __neg__(self) -> Intervals:
        return Intervals(-self.high, -self.low)

    def __add__(self, other: Any) -> Intervals:
        y = Intervals.of(other)
        return _outward(self.low + y.low, self.high + y.high)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Intervals:
        return self + -Intervals.of(other)

    def __rsub__(self, other: Any) -> Intervals:
        return Intervals.of(other) + -self

    def __mul__(self, other: Any) -> Intervals:
        y = Intervals.of(other)
        if np.min(self.low) >= 0:
            # The sign of the other's ends decides which of ours goes with them.
            if np.min(y.low) >= 0:
                return _outward(self.low * y.low, self.high * y.high)
            low = np.where(np.less(y.low, 0), self.high, self.low)
            high = np.where(np.less(y.high, 0), self.low, self.high)
            return _outward(low * y.low, high * y.high)
        return _hull([a * b for a in (self.low, self.high) for b in (y.low, y.high)])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Intervals:
        y = Intervals.of(other)
        quotient = _hull([a / b for a in (self.low, self.high) for b in (y.low, y.high)])
        through = (y.low <= 0) & (y.high >= 0)
        return Intervals(
            np.where(through, -np.inf, quotient.low), np.where(through, np.inf, quotient.high)
        )

    def __rtruediv__(self, other: Any) -> Intervals:
        return Intervals.of(other) / self

    def __pow__(self, exponent: int) -> Intervals:
        """A product of so many equal factors."""
        result = self
        for _ in range(exponent - 1):
            result = result * self
        return result

    def sqrt(self) -> Intervals:
        """The square root of what is not negative."""
        return _outward(*(np.sqrt(np.maximum(x, 0.0)) for x in (self.low, self.high)))

    def exp(self) -> Intervals:
        """e^x."""
        image = self._image(np.exp)
        return Intervals(np.maximum(image.low, 0.0), image.high)

    def expm1(self) -> Intervals:
        """e^x - 1."""
        return self._image(np.expm1)

    def log(self) -> Intervals:
        """log x; -oo where x may be 0 or less."""
        positive = Intervals(np.maximum(self.low, 0.0), np.maximum(self.high, 0.0))
        return positive._image(np.log)

    def log1p(self) -> Intervals:
        """log(1 + x) for x >= 0."""
        return self._image(np.log1p)

    def _image(self, increasing: Callable[[FloatArray], FloatArray]) -> Intervals:
        """The values of an increasing function, its own rounding included."""
        ends = increasing(self.low), increasing(self.high)
        pads = [np.where(np.isfinite(x), _RELATIVE * np.abs(x) + _TINY, 0.0) for x in ends]
        return Intervals(ends[0] - pads[0], ends[1] + pads[1])

    def log_mean_decay(self) -> Intervals:
        """log of the mean of e^(-x t) over 0 < t < 1, which is (1 - e^-x)/x and falls with x.

        Of an x that is below 0 by its uncertainty only: there the mean is at most e^-x.
        """
        ends = []
        for x in (self.high, self.low):
            # Below, the quotient is 1 to all digits.
            y = Intervals.of(np.maximum(x, 1e-250))
            ends.append((-(-y).expm1() / y).log())
        above = np.where(self.low > 0, np.minimum(ends[1].high, 0.0), np.maximum(-self.low, 0.0))
        return Intervals(ends[0].low, above)

    def log1p_exp(self) -> Intervals:
        """log(1 + e^x)."""
        ends = [Intervals.of(x) for x in (self.low, self.high)]
        below, above = (x.maximum(_ZERO) + x.minimum(-x).exp().log1p() for x in ends)
        return Intervals(below.low, above.high)

    def magnitude(self) -> FloatArray:
        """The largest absolute value."""
        size: FloatArray = np.maximum(np.abs(self.low), np.abs(self.high))
        return size

    def minimum(self, other: Intervals) -> Intervals:
        """The smaller of two numbers."""
        return Intervals(np.minimum(self.low, other.low), np.minimum(self.high, other.high))

    def maximum(self, other: Intervals) -> Intervals:
        """The larger of two numbers."""
        return Intervals(np.maximum(self.low, other.low), np.maximum(self.high, other.high))


_ZERO = Intervals(np.asarray(0.0), np.asarray(0.0))


def log_sum(terms: Intervals) -> Intervals:
    """Logarithms of the sums down the columns of e^terms."""
    top = terms.high.max(axis=0)
    top = np.where(np.isfinite(top), top, 0.0)
    parts = (terms - top).exp()
    # n - 1 additions of what is positive, in any order, change each term by n units at most.
    rounding = 2.0**-52 * len(terms.low)
    low, high = (x.sum(axis=0) for x in (parts.low, parts.high))
    return Intervals(low * (1 - rounding), high * (1 + rounding)).log() + top


def stacked(rows: list[Intervals]) -> Intervals:
    """One array of these rows."""
    ends = ([getattr(x, end) for x in rows] for end in ("low", "high"))
    return Intervals(*(np.stack(np.broadcast_arrays(*x)) for x in ends))


class Compensated:
    """head + tail: floats, and an interval of what they lack."""

    __slots__ = ("head", "tail")

    def __init__(self, head: FloatArray, tail: Intervals) -> None:
        middle = (tail.low + tail.high) / 2
        middle = np.where(np.isfinite(middle), middle, 0.0)
        self.head, moved = two_sum(head, middle)
        # Dekker's and Knuth's errors are nan where a sum overflows: the whole line.
        self.tail = tail - middle + moved

    @classmethod
    def of(cls, value: Compensated | Fraction | arb | FloatArray | float) -> Compensated:
        """Floats and rationals as they are; a ball by its middle."""
        if isinstance(value, Compensated):
            return value
        if isinstance(value, Fraction):
            head = _nearest(value)
            return cls(np.asarray(head), Intervals.of(value - Fraction(head)))
        if isinstance(value, (np.ndarray, float, int)):
            return cls(np.asarray(value, dtype=float), Intervals.of(0.0))
        near = float(value.mid())
        return cls(np.asarray(near), Intervals.of(value - near))

    def __neg__(self) -> Compensated:
        return Compensated(-self.head, -self.tail)

    def __add__(self, other: Any) -> Compensated:
        y = Compensated.of(other)
        head, error = two_sum(self.head, y.head)
        return Compensated(head, self.tail + y.tail + error)

    def __sub__(self, other: Any) -> Compensated:
        return self + -Compensated.of(other)

    def __mul__(self, other: Any) -> Compensated:
        y = Compensated.of(other)
        head, error = two_product(self.head, y.head)
        lacking = Intervals(error - _UNDERFLOW, error + _UNDERFLOW)
        crossed = self.tail * Intervals.of(y.head) + y.tail * Intervals.of(self.head)
        return Compensated(head, lacking + crossed + self.tail * y.tail)

    def interval(self) -> Intervals:
        """The sum in one interval."""
        return self.tail + self.head

    def where(self, test: Any, other: Compensated) -> Compensated:
        """This where `test` holds, else the other."""
        tail = Intervals(
            np.where(test, self.tail.low, other.tail.low),
            np.where(test, self.tail.high, other.tail.high),
        )
        return Compensated(np.where(test, self.head, other.head), tail)


def _nearest(value: Fraction) -> float:
    """The float nearest to a rational; the largest where it has none."""
    try:
        return float(value)
    except OverflowError:
        return math.copysign(_MOST, value.numerator)


def _outward(low: Any, high: Any) -> Intervals:
    """Intervals that enclose those whose ends were rounded to the nearest float."""
    return Intervals(np.nextafter(low, -np.inf), np.nextafter(high, np.inf))


def _hull(values: list[FloatArray]) -> Intervals:
    """All of the values, each rounded to the nearest float."""
    low, high = values[0], values[0]
    for value in values[1:]:
        low, high = np.minimum(low, value), np.maximum(high, value)
    return _outward(low, high)
