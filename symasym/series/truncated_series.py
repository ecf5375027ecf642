"""Truncated Taylor series at any precision, for drifts that are not polynomials."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from operator import mul
from typing import TYPE_CHECKING, Any

from symasym.base.call_context import mpf_of, step
from symasym.base.errors import AccuracyError, InputError
from symasym.numbers.trees import integer_power

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

# Products of sums longer than this look at the time they take.
_LONG = 64


class TruncatedSeries:
    """(c[0] + c[1] s + ... + c[n-1] s^(n-1)) 2^e with integers c.

    One exponent for all coefficients makes a product of series a product of
    integers, several times faster than one of floating-point numbers. What is
    lost is relative to the largest coefficient, which for |s| <= 1 is what counts.
    """

    __slots__ = ("c", "e", "ops")

    def __init__(self, c: list[int], e: int, ops: SeriesOps) -> None:
        excess = max(map(abs, c)).bit_length() - ops.bits - 16
        if excess > 0:
            c, e = [x >> excess for x in c], e + excess
        self.c, self.e, self.ops = c, e, ops

    def __neg__(self) -> TruncatedSeries:
        return TruncatedSeries([-x for x in self.c], self.e, self.ops)

    def __add__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        term: TruncatedSeries = (
            other if isinstance(other, TruncatedSeries) else self.ops.constant(other)
        )
        fine, coarse = sorted((self, term), key=lambda series: series.e)
        if not any(coarse.c):
            return fine
        # Up to `bits` places are kept below the coarser unit, so that a small term beside a
        # large one that later cancels is not lost more than in floating point.
        shift = coarse.e - fine.e
        drop = max(0, shift - self.ops.bits)
        rise = shift - drop
        c = [(x >> drop) + (y << rise) for x, y in zip(fine.c, coarse.c, strict=True)]
        return TruncatedSeries(c, fine.e + drop, self.ops)

    __radd__ = __add__

    def __sub__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        return self.__add__(-other)

    def __rsub__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        return (-self).__add__(other)

    def __mul__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        if not isinstance(other, TruncatedSeries):
            mantissa, exponent = _parts(self.ops.context.mpf(other))
            return TruncatedSeries([x * mantissa for x in self.c], self.e + exponent, self.ops)
        order = range(len(self.c))
        if other is self:
            c = [_square_at(self.c, k) for k in order]
        else:
            short, long = sorted((_short(self.c), _short(other.c)), key=len)
            backwards, end = short[::-1], len(short) - 1
            c = [_dot(backwards[max(end - k, 0) :], long[max(k - end, 0) :]) for k in order]
        return TruncatedSeries(c, self.e + other.e, self.ops)

    __rmul__ = __mul__

    def __truediv__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        if not isinstance(other, TruncatedSeries):
            return self.__mul__(1 / self.ops.context.mpf(other))
        b, lead = _short(other.c[1:]), other.c[0]
        if not lead:
            raise InputError("A divides by 0 on [-1, 1]; give an A that is smooth there.")
        largest = max(map(abs, self.c)).bit_length()
        shift = max(0, self.ops.bits + 16 + lead.bit_length() - largest)
        recent: list[int] = []
        for x in self.c:
            recent.insert(0, ((x << shift) - _dot(b, recent)) // lead)
        return TruncatedSeries(recent[::-1], self.e - other.e - shift, self.ops)

    def __rtruediv__(self, other: TruncatedSeries | mpf | int) -> TruncatedSeries:
        return self.ops.constant(other) / self

    def __pow__(self, exponent: int) -> TruncatedSeries:
        if exponent == 0:
            return self.ops.constant(1)
        power: TruncatedSeries = integer_power(self, abs(exponent))
        return power if exponent > 0 else 1 / power

    def head(self) -> mpf:
        """The constant term, an mpf."""
        return self.ops.context.ldexp(self.ops.context.mpf(self.c[0]), self.e)

    def slopes(self) -> list[int]:
        """k c[k], k from 1."""
        return [k * x for k, x in enumerate(self.c)][1:]

    def derivative(self) -> TruncatedSeries:
        """The derivative, its last coefficient unknown and set to zero."""
        return TruncatedSeries([*self.slopes(), 0], self.e, self.ops)

    @staticmethod
    def fractions(value: TruncatedSeries | mpf | int, ops: SeriesOps) -> list[Fraction]:
        """Coefficients of a TruncatedSeries, or of a number that turned out constant."""
        series = value if isinstance(value, TruncatedSeries) else ops.constant(value)
        if series.e >= 0:
            return [Fraction(x << series.e) for x in series.c]
        return [Fraction(x, 1 << -series.e) for x in series.c]

    @staticmethod
    def coefficients_of(value: TruncatedSeries | mpf | int, ops: SeriesOps) -> list[Any]:
        """The same as mpf."""
        series = value if isinstance(value, TruncatedSeries) else ops.constant(value)
        return [ops.context.ldexp(ops.context.mpf(x), series.e) for x in series.c]


def _dot(a: Sequence[int], b: Sequence[int]) -> int:
    """Sum of products as far as the shorter reaches, which is what a convolution wants."""
    if len(b) > _LONG:
        step()
    return sum(map(mul, a, b))


def _square_at(c: list[int], k: int) -> int:
    """The coefficient k of a square, whose products are equal in pairs."""
    half, odd = divmod(k + 1, 2)
    return 2 * _dot(c[:half], c[k : k - half : -1]) + odd * c[half] ** 2


def _short(c: list[int]) -> list[int]:
    """The coefficients without the zeros at their end, so that products end where they do."""
    end = len(c)
    while end and not c[end - 1]:
        end -= 1
    return c[:end]


def _parts(x: mpf) -> tuple[int, int]:
    """x = mantissa 2^exponent of an mpf."""
    if hasattr(x, "_mpc_"):
        raise InputError("A is complex on [-1, 1]; give an A that is real there.")
    sign, mantissa, exponent, _ = x._mpf_
    if not mantissa and exponent:
        raise AccuracyError("A is not finite on [-1, 1]; give an A that is smooth there.")
    return (-int(mantissa) if sign else int(mantissa)), int(exponent)


class SeriesOps:
    """Elementary functions of truncated Taylor series, by the differential equation each satisfies.

    Parameters
    ----------
    order : int
        Number of coefficients.
    context : mpmath context
        Its precision is used as it stands.
    known : dict, optional
        See `symasym.numbers.trees.Operations`.
    """

    def __init__(self, order: int, context: MPContext, known: dict[Any, Any] | None = None) -> None:
        self.order, self.context, self.known = order, context, known
        self.bits = context.prec + 32

    def constant(self, value: mpf | int) -> TruncatedSeries:
        """The series of a number."""
        if hasattr(value, "_mpc_"):
            raise InputError("A is complex on [-1, 1]; give an A that is real there.")
        mantissa, exponent = _parts(self.context.mpf(value))
        room = max(0, self.bits - mantissa.bit_length())
        return TruncatedSeries([mantissa << room] + [0] * (self.order - 1), exponent - room, self)

    def variable(self, centre: Fraction | mpf, scale: Fraction = Fraction(1)) -> TruncatedSeries:
        """The series of u = centre + scale s; `centre` a Fraction or an mpf."""
        first = self.rational(centre) if hasattr(centre, "denominator") else centre
        if self.order == 1:
            return self.constant(first)
        slope = self.constant(self.rational(scale))
        return TruncatedSeries([0, slope.c[0], *[0] * (self.order - 2)], slope.e, self).__add__(
            first
        )

    def rational(self, value: Fraction) -> mpf:
        """A rational rounded to the precision of the context."""
        return mpf_of(value, self.context)

    def pi(self) -> mpf:
        """pi to the precision of the context."""
        return +self.context.pi

    def fixed(self, value: mpf | int, e: int) -> int:
        """An mpf in units of 2^e."""
        mantissa, exponent = _parts(value)
        shift = exponent - e
        return mantissa << shift if shift >= 0 else mantissa >> -shift

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        rule = _RULES.get(name)
        if rule is None:
            raise AttributeError(name)

        def apply(x: TruncatedSeries | mpf) -> TruncatedSeries | mpf:
            """The function of a series, or of a number."""
            if not isinstance(x, TruncatedSeries):
                return getattr(self.context, name)(x)
            return rule(x, self)

        return apply

    def power(self, x: TruncatedSeries | mpf, exponent: Fraction) -> TruncatedSeries | mpf:
        """y = x^(p/q) from q x y' = p x' y; a number's power for a number."""
        if not isinstance(x, TruncatedSeries):
            return x ** self.rational(exponent)
        p, q, n_terms = exponent.numerator, exponent.denominator, self.order
        lead, first = x.c[0], x.head() ** self.rational(exponent)
        if not lead:
            raise InputError("A takes a root of 0 on [-1, 1]; give an A that is smooth there.")
        recent = [self.constant(first).c[0]]
        e = self.constant(first).e
        for n in range(1, n_terms):
            weights = [(p * k - q * (n - k)) * x.c[k] for k in range(1, n + 1)]
            recent.insert(0, _dot(weights, recent) // (n * q * lead))
        return TruncatedSeries(recent[::-1], e, self)


def _scaled(value: int, e: int) -> int:
    """value 2^e, rounded down."""
    return value << e if e >= 0 else value >> -e


def _from_derivative(first: mpf, derivative: TruncatedSeries) -> TruncatedSeries:
    """The series with constant term `first` and this derivative."""
    ops = derivative.ops
    rest = [x // (k + 1) for k, x in enumerate(derivative.c[:-1])]
    return TruncatedSeries([0, *rest], derivative.e, ops).__add__(first)


def _exp(x: TruncatedSeries, ops: SeriesOps) -> TruncatedSeries:
    """y = e^x from y' = x' y."""
    slopes, start = _short(x.slopes()), ops.constant(ops.context.exp(x.head()))
    recent = [start.c[0]]
    for n in range(1, ops.order):
        recent.insert(0, _scaled(_dot(slopes, recent), x.e) // n)
    return TruncatedSeries(recent[::-1], start.e, ops)


def _circular(
    x: TruncatedSeries, ops: SeriesOps, sign: int
) -> tuple[TruncatedSeries, TruncatedSeries]:
    """(sin, cos) for sign -1, (sinh, cosh) for sign +1."""
    slopes, context = _short(x.slopes()), ops.context
    names = ("sin", "cos") if sign < 0 else ("sinh", "cosh")
    values = [getattr(context, name)(x.head()) for name in names]
    e = max(context.mag(v) for v in values if v) - ops.bits
    s, c = ([ops.fixed(v, e)] for v in values)
    for n in range(1, ops.order):
        s_next = _scaled(_dot(slopes, c), x.e) // n
        c_next = sign * _scaled(_dot(slopes, s), x.e) // n
        s.insert(0, s_next)
        c.insert(0, c_next)
    return TruncatedSeries(s[::-1], e, ops), TruncatedSeries(c[::-1], e, ops)


def _log(x: TruncatedSeries, ops: SeriesOps) -> TruncatedSeries:
    """y = log x from y' = x'/x."""
    return _from_derivative(ops.context.log(x.head()), x.derivative() / x)


def _quotient(pair: tuple[TruncatedSeries, TruncatedSeries]) -> TruncatedSeries:
    """The first series over the second."""
    return pair[0] / pair[1]


def _tanh(x: TruncatedSeries, ops: SeriesOps) -> TruncatedSeries:
    """y = tanh x from y' = (1 - y^2) x'."""
    # sinh/cosh would lose the saturated tail; y' = (1 - y^2) x' keeps it.
    slopes, context = _short(x.slopes()), ops.context
    # A small x needs places behind those of 1 - y^2.
    size = max(map(abs, x.c)).bit_length() + x.e
    e = min(size, 0) - ops.bits
    y = [ops.fixed(context.tanh(x.head()), e)]
    # Further out it is below one unit, and mpmath's exponential would fill the memory.
    inside = abs(x.head()) < ops.bits
    complement = [ops.fixed(context.sech(x.head()) ** 2, e) if inside else 0]
    for n in range(1, ops.order):
        y.insert(0, _scaled(_dot(slopes, complement), x.e) // n)
        complement.insert(0, -_scaled(_square_at(y, n), e))
    return TruncatedSeries(y[::-1], e, ops)


def _inverse(
    name: str, inside: Callable[[TruncatedSeries], TruncatedSeries], root: bool
) -> Callable[[TruncatedSeries, SeriesOps], TruncatedSeries]:
    """The inverse function whose derivative is x'/inside or x'/sqrt(inside)."""

    def rule(x: TruncatedSeries, ops: SeriesOps) -> TruncatedSeries:
        """The series of the inverse function at `x`."""
        below = inside(x)
        if root:
            below = ops.power(below, Fraction(1, 2))
        return _from_derivative(getattr(ops.context, name)(x.head()), x.derivative() / below)

    return rule


def _erf(x: TruncatedSeries, ops: SeriesOps) -> TruncatedSeries:
    """y = erf x from y' = 2/sqrt(pi) e^(-x^2) x'."""
    scale = 2 / ops.context.sqrt(ops.context.pi)
    slope = _exp(-(x * x), ops) * x.derivative() * scale
    return _from_derivative(ops.context.erf(x.head()), slope)


_asin = _inverse("asin", lambda x: 1 - x * x, True)

_RULES: dict[str, Callable[[TruncatedSeries, SeriesOps], Any]] = {
    "exp": _exp,
    "log": _log,
    "sqrt": lambda x, ops: ops.power(x, Fraction(1, 2)),
    "sin": lambda x, ops: _circular(x, ops, -1)[0],
    "cos": lambda x, ops: _circular(x, ops, -1)[1],
    "tan": lambda x, ops: _quotient(_circular(x, ops, -1)),
    "sinh": lambda x, ops: _circular(x, ops, 1)[0],
    "cosh": lambda x, ops: _circular(x, ops, 1)[1],
    "tanh": _tanh,
    "asin": _asin,
    "acos": lambda x, ops: ops.context.pi / 2 - _asin(x, ops),
    "atan": _inverse("atan", lambda x: 1 + x * x, False),
    "asinh": _inverse("asinh", lambda x: 1 + x * x, True),
    "acosh": _inverse("acosh", lambda x: x * x - 1, True),
    "atanh": _inverse("atanh", lambda x: 1 - x * x, False),
    "erf": _erf,
}
