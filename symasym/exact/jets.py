"""Truncated Taylor series with mpmath coefficients, for drifts that are not polynomials."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

from symasym.arithmetic import integer_power
from symasym.errors import InputError


def _pairs(a: Sequence[Any], b: Sequence[Any]) -> Iterator[tuple[Any, Any]]:
    """Pairs as far as the shorter reaches, which is what a convolution wants."""
    return zip(a, b, strict=False)


class Jet:
    """c[0] + c[1] s + ... + c[n-1] s^(n-1), one arithmetic context for all coefficients."""

    __slots__ = ("c", "ops")

    def __init__(self, c: list[Any], ops: JetOps) -> None:
        self.c, self.ops = c, ops

    def __neg__(self) -> Jet:
        return Jet([-x for x in self.c], self.ops)

    def __add__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet([self.c[0] + other, *self.c[1:]], self.ops)
        return Jet([x + y for x, y in zip(self.c, other.c, strict=True)], self.ops)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Jet:
        return self.__add__(-other)

    def __rsub__(self, other: Any) -> Jet:
        return (-self).__add__(other)

    def __mul__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet([x * other for x in self.c], self.ops)
        dot, a, b = self.ops.context.fdot, self.c, other.c
        b_reversed = b[::-1]
        n = len(a)
        return Jet([dot(_pairs(a[: k + 1], b_reversed[n - 1 - k :])) for k in range(n)], self.ops)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Jet:
        if not isinstance(other, Jet):
            return Jet([x / other for x in self.c], self.ops)
        dot, b = self.ops.context.fdot, other.c
        result: list[Any] = []
        for k, x in enumerate(self.c):
            result.append((x - dot(_pairs(b[1 : k + 1], result[::-1]))) / b[0])
        return Jet(result, self.ops)

    def __rtruediv__(self, other: Any) -> Jet:
        return self.ops.constant(other) / self

    def __pow__(self, exponent: int) -> Jet:
        if exponent == 0:
            return self.ops.constant(1)
        power: Jet = integer_power(self, abs(exponent))
        return power if exponent > 0 else 1 / power

    def derivative(self) -> Jet:
        """The derivative, its last coefficient unknown and set to zero."""
        shifted = [k * x for k, x in enumerate(self.c)][1:]
        return Jet([*shifted, self.ops.context.zero], self.ops)

    @staticmethod
    def coefficients_of(value: Any, ops: JetOps) -> list[Any]:
        """Coefficients of a Jet, or of a number that turned out constant."""
        jet = value if isinstance(value, Jet) else ops.constant(value)
        return list(jet.c)


class JetOps:
    """Elementary functions of jets, by the differential equation each satisfies.

    Parameters
    ----------
    order : int
        Number of coefficients.
    context : mpmath context
        Its precision is used as it stands.
    """

    def __init__(self, order: int, context: Any) -> None:
        self.order, self.context = order, context

    def constant(self, value: Any) -> Jet:
        zero = self.context.zero
        return Jet([self.context.mpf(value)] + [zero] * (self.order - 1), self)

    def variable(self, centre: Fraction, scale: Fraction = Fraction(1)) -> Jet:
        """The jet of u = centre + scale s."""
        jet = self.constant(self.rational(centre))
        if self.order > 1:
            jet.c[1] = self.rational(scale)
        return jet

    def rational(self, value: Fraction) -> Any:
        return self.context.mpf(value.numerator) / value.denominator

    def pi(self) -> Any:
        return +self.context.pi

    def __getattr__(self, name: str) -> Callable[[Any], Any]:
        rule = _RULES.get(name)
        if rule is None:
            raise AttributeError(name)

        def apply(x: Any) -> Any:
            if not isinstance(x, Jet):
                return getattr(self.context, name)(x)
            return rule(x, self)

        return apply

    def power(self, x: Any, exponent: Fraction) -> Any:
        a = self.rational(exponent)
        if not isinstance(x, Jet):
            return x**a
        c, dot = x.c, self.context.fdot
        result = [_real(c[0] ** a, "power")]
        for n in range(1, self.order):
            weights = [(a * k - (n - k)) * c[k] for k in range(1, n + 1)]
            result.append(dot(_pairs(weights, result[::-1])) / (n * c[0]))
        return Jet(result, self)


def _real(value: Any, what: str) -> Any:
    if hasattr(value, "_mpc_"):
        raise InputError(f"A is complex on [-1, 1] (in {what}); give an A that is real there.")
    return value


def _from_derivative(first: Any, derivative: Jet) -> Jet:
    """The jet with constant term `first` and this derivative."""
    rest = [x / (k + 1) for k, x in enumerate(derivative.c[:-1])]
    return Jet([_real(first, "a function"), *rest], derivative.ops)


def _exp(x: Jet, ops: JetOps) -> Jet:
    dot, slopes = ops.context.fdot, [k * c for k, c in enumerate(x.c)]
    y = [ops.context.exp(x.c[0])]
    for n in range(1, ops.order):
        y.append(dot(_pairs(slopes[1 : n + 1], y[::-1])) / n)
    return Jet(y, ops)


def _circular(x: Jet, ops: JetOps, sign: int) -> tuple[Jet, Jet]:
    """(sin, cos) for sign -1, (sinh, cosh) for sign +1."""
    dot, context = ops.context.fdot, ops.context
    slopes = [k * c for k, c in enumerate(x.c)]
    names = ("sin", "cos") if sign < 0 else ("sinh", "cosh")
    s, c = ([getattr(context, name)(x.c[0])] for name in names)
    for n in range(1, ops.order):
        part = slopes[1 : n + 1]
        s_next, c_next = dot(_pairs(part, c[::-1])) / n, sign * dot(_pairs(part, s[::-1])) / n
        s.append(s_next)
        c.append(c_next)
    return Jet(s, ops), Jet(c, ops)


def _log(x: Jet, ops: JetOps) -> Jet:
    return _from_derivative(ops.context.log(x.c[0]), x.derivative() / x)


def _quotient(pair: tuple[Jet, Jet]) -> Jet:
    return pair[0] / pair[1]


def _tanh(x: Jet, ops: JetOps) -> Jet:
    # sinh/cosh would lose the saturated tail; y' = (1 - y^2) x' keeps it.
    dot, slopes = ops.context.fdot, [k * c for k, c in enumerate(x.c)]
    y = [ops.context.tanh(x.c[0])]
    complement = [ops.context.sech(x.c[0]) ** 2]
    for n in range(1, ops.order):
        y.append(dot(_pairs(slopes[1 : n + 1], complement[::-1])) / n)
        complement.append(-dot(_pairs(y, y[::-1])))
    return Jet(y, ops)


def _inverse(name: str, inside: Callable[[Jet], Jet], root: bool) -> Callable[[Jet, JetOps], Jet]:
    """The inverse function whose derivative is x'/inside or x'/sqrt(inside)."""

    def rule(x: Jet, ops: JetOps) -> Jet:
        below = inside(x)
        if root:
            below = ops.power(below, Fraction(1, 2))
        return _from_derivative(getattr(ops.context, name)(x.c[0]), x.derivative() / below)

    return rule


def _erf(x: Jet, ops: JetOps) -> Jet:
    scale = 2 / ops.context.sqrt(ops.context.pi)
    return _from_derivative(ops.context.erf(x.c[0]), _exp(-(x * x), ops) * x.derivative() * scale)


_asin = _inverse("asin", lambda x: 1 - x * x, True)

_RULES: dict[str, Callable[[Jet, JetOps], Any]] = {
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
