"""Arrays of double-double numbers: 32 digits where 16 are not enough.

Near a critical point the drift is a small difference of large terms, and a
stiff problem multiplies it by 2/kappa^2. Forming the drift's coefficients and
shifting them to the critical point with these numbers keeps the difference.
The algorithms are Dekker's and Knuth's error-free transformations.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.contexts import mpf_of
from symasym.base.inputs import FloatArray, Floats, IntArray, to_float
from symasym.numbers.polynomials import shifted

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


_SPLITTER = 134217729.0  # 2^27 + 1


class DoubleDouble:
    """hi + lo with \\|lo\\| <= ulp(hi)/2, elementwise."""

    __slots__ = ("hi", "lo")
    __array_ufunc__ = None  # an ndarray on the left must defer to our operators

    def __init__(self, hi: FloatArray, lo: FloatArray | float = 0.0) -> None:
        self.hi = hi
        low: Any = lo
        self.lo = low if np.shape(lo) == np.shape(hi) else np.full(np.shape(hi), low)

    @classmethod
    def of(cls, value: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        """From a Fraction, an int, a float or a float array."""
        if isinstance(value, DoubleDouble):
            return value
        if isinstance(value, (int, Fraction)):
            hi = to_float("A number of the drift", value)
            lo = float(value - Fraction(hi)) if np.isfinite(hi) else 0.0
            return cls(np.asarray(hi), np.asarray(lo))
        return cls(np.asarray(value, dtype=np.float64))

    def __neg__(self) -> DoubleDouble:
        return DoubleDouble(-self.hi, -self.lo)

    def __add__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        y = DoubleDouble.of(other)
        s, e = two_sum(self.hi, y.hi)
        t, f = two_sum(self.lo, y.lo)
        s, e = _fast_two_sum(s, e + t)
        return DoubleDouble(*_fast_two_sum(s, e + f))

    __radd__ = __add__

    def __sub__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        return self + (-DoubleDouble.of(other))

    def __rsub__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        return DoubleDouble.of(other) + (-self)

    def __mul__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        y = DoubleDouble.of(other)
        p, e = two_product(self.hi, y.hi)
        return DoubleDouble(*_fast_two_sum(p, e + (self.hi * y.lo + self.lo * y.hi)))

    __rmul__ = __mul__

    def __truediv__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        y = DoubleDouble.of(other)
        first = self.hi / y.hi
        rest = self - y * first
        return DoubleDouble(*_fast_two_sum(first, rest.hi / y.hi))

    def __rtruediv__(self, other: DoubleDouble | Fraction | Floats) -> DoubleDouble:
        return DoubleDouble.of(other) / self

    def __getitem__(self, index: int | slice | IntArray) -> DoubleDouble:
        return DoubleDouble(self.hi[index], self.lo[index])

    def broadcast_to(self, shape: tuple[int, ...]) -> DoubleDouble:
        """The same numbers, repeated to a shape."""
        return DoubleDouble(np.broadcast_to(self.hi, shape), np.broadcast_to(self.lo, shape))


class DoubleDoubleOps:
    """Elementary functions of double-double numbers, one at a time through mpmath."""

    def rational(self, value: Fraction) -> DoubleDouble:
        return DoubleDouble.of(value)

    def pi(self) -> DoubleDouble:
        """pi to 32 digits."""
        return DoubleDouble(np.asarray(np.pi), np.asarray(1.2246467991473532e-16))

    def power(self, base: DoubleDouble | Floats, exponent: Fraction) -> DoubleDouble:
        """A rational power."""
        return _through_mpmath(lambda c, x: x ** mpf_of(exponent, c), base)

    def __getattr__(self, name: str) -> Any:
        return lambda x: _through_mpmath(lambda c, value: getattr(c, name)(value), x)


def _through_mpmath(
    function: Callable[[MPContext, mpf], mpf], x: DoubleDouble | Fraction | Floats
) -> DoubleDouble:
    """A function of each number, worked out with 40 digits."""
    from symasym.base.contexts import own_context

    number = DoubleDouble.of(x)
    shape = np.shape(number.hi)
    hi, lo = np.empty(shape), np.empty(shape)
    with own_context(40) as context:
        for index in np.ndindex(shape):
            value = function(
                context, context.mpf(float(number.hi[index])) + float(number.lo[index])
            )
            hi[index] = float(value)
            lo[index] = float(value - context.mpf(hi[index]))
    return DoubleDouble(hi, lo)


def shift(coefficients: list[DoubleDouble], centre: FloatArray) -> list[FloatArray]:
    """Taylor coefficients at `centre` of the polynomial with these ascending coefficients.

    Each is rounded to float64 only at the end, so a coefficient that vanishes
    at the centre keeps its full relative precision down to 1e-32.
    """
    about = shifted(coefficients, DoubleDouble.of(centre))
    return [np.broadcast_to(c.hi + c.lo, np.shape(centre)) for c in about]


def ends_of(coefficients: list[DoubleDouble], count: int) -> FloatArray:
    """Values at -1 and at 1 of `count` polynomials with these ascending coefficients, rounded."""
    whole, rest = np.zeros((2, 2, count))
    for k, c in enumerate(coefficients):
        sign = np.array([[-1.0 if k % 2 else 1.0], [1.0]])
        whole, error = two_sum(whole, sign * c.hi)
        rest += error + sign * c.lo
    return whole + rest


def two_sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """a + b rounded, and the exact error of it (Knuth)."""
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


def _fast_two_sum(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The same for |a| >= |b| (Dekker)."""
    s = a + b
    return s, b - (s - a)


def two_product(a: FloatArray, b: FloatArray) -> tuple[FloatArray, FloatArray]:
    """a b rounded, and the exact error of it (Dekker, Veltkamp's splitting)."""
    p = a * b
    t = _SPLITTER * a
    ah = t - (t - a)
    al = a - ah
    t = _SPLITTER * b
    bh = t - (t - b)
    bl = b - bh
    return p, ((ah * bh - p) + ah * bl + al * bh) + al * bl
