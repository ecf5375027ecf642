"""Numbers that arrays of float64 carry: double-doubles, derivatives, and logarithms with errors.

`DoubleDouble`: 32 digits where 16 are not enough. Near a critical point the drift is a small
difference of large terms, and a stiff problem multiplies it by 2/kappa^2; its coefficients are
formed, and shifted to the critical point, by Dekker's and Knuth's error-free transformations.

`DualArray`: x and dx/dp for several parameters p, in front of whose axes stands that of the
parameters. Operators, the ufuncs of `_RULES` and the functions of `_FUNCTIONS` take it in an
array's place (NumPy's protocols ``__array_ufunc__`` and ``__array_function__``), so that a formula
written for arrays gives its derivatives as well (A. Griewank, A. Walther, Evaluating Derivatives,
SIAM 2008, chapter 3). Comparisons compare the values.

`LogPositive`: positive numbers of any size as their logarithms, and bounds on the errors of these
by running analysis. A sum of logarithms is right to half an ulp, and an addition of numbers forgets
the error of the smaller term, unless it could be the larger one. `LogSlopes` carry the derivatives
of their logarithms as well, in which an addition forgets the smaller term, too:

    d log(x + y) = s d log x + (1 - s) d log y,    s = x/(x + y).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of
from symasym.base.inputs import FloatArray, Floats, IntArray, to_float
from symasym.numbers.polynomials import shifted

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


# -- double-doubles --------------------------------------------------------------------------------


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
        """The double-double of a Fraction, an int, a float or a float array."""
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
    from symasym.base.call_context import own_context

    number = DoubleDouble.of(x)
    shape = np.shape(number.hi)
    hi, lo = np.empty(shape), np.empty(shape)
    with own_context(40) as context:
        for index in np.ndindex(shape):
            value = function(
                context, context.mpf(float(number.hi[index])) + float(number.lo[index])
            )
            # Real, or nan.
            near = float(value) if isinstance(value, context.mpf) else np.nan
            hi[index], lo[index] = near, float(value - near) if np.isfinite(near) else near
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


# -- derivatives -----------------------------------------------------------------------------------


class DualArray:
    """Values of shape s, and their derivatives of shape (parameters, *s)."""

    __slots__ = ("slopes", "value")

    def __init__(self, value: FloatArray, slopes: FloatArray) -> None:
        self.value, self.slopes = value, slopes

    @property
    def shape(self) -> tuple[int, ...]:
        """The shape of the values."""
        shape: tuple[int, ...] = self.value.shape
        return shape

    def __getitem__(self, index: Any) -> DualArray:
        inner = index if isinstance(index, tuple) else (index,)
        return DualArray(self.value[index], self.slopes[(slice(None), *inner)])

    def __setitem__(self, index: Any, x: Any) -> None:
        inner = index if isinstance(index, tuple) else (index,)
        self.value[index] = value_of(x)
        self.slopes[(slice(None), *inner)] = slopes_of(x)

    @property
    def T(self) -> DualArray:
        """A matrix, transposed."""
        return DualArray(self.value.T, self.slopes.swapaxes(1, 2))

    def reshape(self, *shape: Any) -> DualArray:
        """The same numbers in another shape."""
        value = self.value.reshape(*shape)
        return DualArray(value, self.slopes.reshape(len(self.slopes), *value.shape))

    def sum(self, axis: int) -> DualArray:
        """Sums along an axis, counted from the first of the values."""
        return DualArray(self.value.sum(axis=axis), self.slopes.sum(axis=axis + 1))

    def __neg__(self) -> DualArray:
        return DualArray(-self.value, -self.slopes)

    def __abs__(self) -> DualArray:
        sign = np.where(self.value < 0, -1.0, 1.0)
        return DualArray(sign * self.value, sign * self.slopes)

    def __add__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            return DualArray(self.value + other.value, self.slopes + other.slopes)
        total = self.value + other
        if total.shape == self.value.shape:
            return DualArray(total, self.slopes)
        return DualArray(total, self.slopes + np.zeros(np.shape(other)))

    __radd__ = __add__

    def __sub__(self, other: Any) -> DualArray:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> DualArray:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            slopes = self.slopes * other.value + self.value * other.slopes
            return DualArray(self.value * other.value, slopes)
        return DualArray(self.value * other, self.slopes * other)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> DualArray:
        if isinstance(other, DualArray):
            ratio = self.value / other.value
            return DualArray(ratio, (self.slopes - ratio * other.slopes) / other.value)
        return DualArray(self.value / other, self.slopes / other)

    def __rtruediv__(self, other: Any) -> DualArray:
        # Slopes over a value, not 1 over its square, which may be below the range of float64.
        ratio = other / self.value
        return DualArray(ratio, -ratio * (self.slopes / self.value))

    def __iadd__(self, other: Any) -> DualArray:
        self.value += value_of(other)
        self.slopes += slopes_of(other)
        return self

    def __imul__(self, other: Any) -> DualArray:
        self.slopes *= value_of(other)
        if isinstance(other, DualArray):
            self.slopes += self.value * other.slopes
        self.value *= value_of(other)
        return self

    def __itruediv__(self, other: Any) -> DualArray:
        self.value /= value_of(other)
        if isinstance(other, DualArray):
            self.slopes -= self.value * other.slopes
        self.slopes /= value_of(other)
        return self

    def __matmul__(self, matrix: FloatArray) -> DualArray:
        return DualArray(self.value @ matrix, self.slopes @ matrix)

    def __lt__(self, other: Any) -> Any:
        return self.value < value_of(other)

    def __gt__(self, other: Any) -> Any:
        return self.value > value_of(other)

    def __eq__(self, other: object) -> Any:
        return self.value == value_of(other)

    __hash__ = None  # type: ignore[assignment]

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **kwargs: Any) -> Any:
        """A ufunc of `_RULES`, ``reduceat`` or ``accumulate``; all options are refused."""
        if method == "reduceat" and ufunc in (np.add, np.maximum):
            x, first = inputs
            return DualArray(ufunc.reduceat(x.value, first), ufunc.reduceat(x.slopes, first, -1))
        if method == "accumulate" and ufunc in (np.add, np.multiply):
            (x,) = inputs
            value = ufunc.accumulate(x.value)
            if ufunc is np.add:
                return DualArray(value, np.add.accumulate(x.slopes, axis=1))
            return DualArray(value, value * np.add.accumulate(x.slopes / x.value, axis=1))
        rule = _RULES.get(ufunc)
        return rule(*inputs) if rule and method == "__call__" and not kwargs else NotImplemented

    def __array_function__(
        self, function: Any, types: Sequence[type], args: Any, kwargs: Any
    ) -> Any:
        """A function of `_FUNCTIONS`."""
        return _FUNCTIONS[function](*args, **kwargs) if function in _FUNCTIONS else NotImplemented


def value_of(x: Any) -> Any:
    """The value of a dual array; any other number itself."""
    return x.value if isinstance(x, DualArray) else x


def slopes_of(x: Any) -> Any:
    """The derivatives of a dual array; those of any other number are 0."""
    return x.slopes if isinstance(x, DualArray) else 0.0


def empty(shape: tuple[int, ...], like: Any) -> Any:
    """An array of this shape, dual in as many parameters as another is."""
    values = np.empty(shape)
    return (
        DualArray(values, np.empty((len(like.slopes), *shape)))
        if isinstance(like, DualArray)
        else values
    )


def _exp(x: DualArray) -> DualArray:
    value = np.exp(x.value)
    return DualArray(value, x.slopes * value)


def _log(x: DualArray) -> DualArray:
    return DualArray(np.log(x.value), x.slopes / x.value)


def _expm1(x: DualArray) -> DualArray:
    return DualArray(np.expm1(x.value), x.slopes * np.exp(x.value))


def _product(x: FloatArray, y: DualArray) -> DualArray:
    """A plain matrix times a dual one."""
    slopes = y.slopes
    if x.ndim > y.value.ndim:
        slopes = slopes.reshape(len(slopes), *(1,) * (x.ndim - y.value.ndim), *y.value.shape)
    return DualArray(x @ y.value, x @ slopes)


def _where(test: Any, x: Any, y: Any) -> DualArray:
    """Chosen elements of two, of which one is dual."""
    return DualArray(
        np.where(test, value_of(x), value_of(y)), np.where(test, slopes_of(x), slopes_of(y))
    )


def _concatenate(parts: Sequence[Any]) -> DualArray:
    """One array of several along their first axis, plain ones among them."""
    parts = list(parts)
    count = next(len(x.slopes) for x in parts if isinstance(x, DualArray))
    slopes = [
        x.slopes if isinstance(x, DualArray) else np.zeros((count, *np.shape(x))) for x in parts
    ]
    return DualArray(np.concatenate([value_of(x) for x in parts]), np.concatenate(slopes, axis=1))


_RULES: dict[Any, Callable[..., Any]] = {
    np.add: lambda x, y: y + x if isinstance(y, DualArray) else x + y,
    np.subtract: lambda x, y: -y + x if isinstance(y, DualArray) else x - y,
    np.multiply: lambda x, y: y * x if isinstance(y, DualArray) else x * y,
    np.true_divide: lambda x, y: y.__rtruediv__(x) if not isinstance(x, DualArray) else x / y,
    np.matmul: lambda x, y: x @ y if isinstance(x, DualArray) else _product(x, y),
    np.negative: lambda x: -x,
    np.absolute: abs,
    np.exp: _exp,
    np.log: _log,
    np.expm1: _expm1,
}
_FUNCTIONS: dict[Any, Callable[..., Any]] = {np.where: _where, np.concatenate: _concatenate}


# -- logarithms ------------------------------------------------------------------------------------


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
        """Logarithms of float64 numbers that are not negative; `LogSlopes` of dual ones."""
        with np.errstate(divide="ignore"):
            log = np.maximum(np.log(value_of(value)), _NONE)
        if isinstance(value, DualArray):
            slopes = np.where(value.value == 0, 0.0, value.slopes / value.value)
            return with_log(DualArray(log, slopes), error)
        return with_log(log, error)

    def __getitem__(self, index: slice | IntArray) -> LogPositive:
        return LogPositive(self.log[index], self.error[index])

    def __setitem__(self, index: IntArray, other: LogPositive) -> None:
        self.log[index], self.error[index] = other.log, other.error

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
        return LogPositive(-self.log, self.error) if other == 1 else _positive(other) / self

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
        # Exponential and logarithm are vectorised in NumPy, its logaddexp is not.
        log = np.maximum(self.log, term.log)
        ratio = np.exp(np.minimum(self.log, term.log) - log)
        whole = 1.0 + ratio
        behind = np.log(whole)
        log += behind
        # The shares are 1/whole of the larger one and ratio/whole: one may be 0 beside an error of
        # 1e284, so neither is found as a difference.
        known = self.error + term.error
        larger = np.where(self.log > term.log, self.error, term.error)
        error = known - larger
        error *= ratio
        error += larger
        error /= whole
        if np.fmax.reduce(known, axis=None) > _LINEAR:
            # log of the sum of both shares, each times e to its error: convex, so no less below.
            ahead = (x.log - log + behind + x.error for x in (self, term))
            most = np.logaddexp(*ahead) - behind
            error = np.where(known > _LINEAR, most, error)
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

    def __setitem__(self, index: IntArray, other: LogPositive) -> None:
        super().__setitem__(index, other)
        self.slopes[:, index], self.slope_error[:, index] = _slopes(other)

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
        smaller, rest = self.log < term.log, 1.0 - share
        mine, others = np.where(smaller, share, rest), np.where(smaller, rest, share)
        first, second = mine * self.slopes, others * slopes
        slope_error = (
            mine * self.slope_error
            + others * error
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
