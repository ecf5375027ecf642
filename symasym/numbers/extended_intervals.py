"""Intervals of the extended real line, their ends in Arb: enclosures on half-lines as well.

A ball has a middle, which [2, oo) and log((0, 1]) = (-oo, 0] have not; where a bound is wanted
there, both ends are kept apart. Every operation on (low, high) rounds its ends outwards, at Arb's
precision of the moment; an infinite end is never attained, so that 0 times it counts as 0.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import flint

from symasym.base.errors import InputError
from symasym.numbers.balls import exact_ball, precision
from symasym.numbers.trees import evaluate_tree

if TYPE_CHECKING:
    from flint import arb
    from sympy import Expr, Symbol

_BITS = 80


class Undefined(ArithmeticError):
    """An interval that leaves a function's domain."""


class ExtendedInterval:
    """All reals between `low` and `high`, exact arb of which each may be infinite."""

    __slots__ = ("high", "low")

    def __init__(self, low: arb, high: arb) -> None:
        if low.is_nan() or high.is_nan():
            raise Undefined
        self.low, self.high = low.lower(), high.upper()

    @classmethod
    def of(cls, value: ExtendedInterval | arb | int) -> ExtendedInterval:
        """An interval as it is; the smallest around a ball or a whole number."""
        if isinstance(value, ExtendedInterval):
            return value
        ball = flint.arb(value)
        return cls(ball, ball)

    def image(self, increasing: Callable[[Any], Any]) -> Any:
        """A ball of an increasing function's values."""
        return increasing(self.low).union(increasing(self.high))

    def __add__(self, other: ExtendedInterval | arb | int) -> ExtendedInterval:
        other = self.of(other)
        return ExtendedInterval(self.low + other.low, self.high + other.high)

    __radd__ = __add__

    def __neg__(self) -> ExtendedInterval:
        return ExtendedInterval(-self.high, -self.low)

    def __sub__(self, other: ExtendedInterval) -> ExtendedInterval:
        return self + -other

    def __mul__(self, other: ExtendedInterval | arb | int) -> ExtendedInterval:
        if other is self:
            size = abs(self)
            return ExtendedInterval(_product(size.low, size.low), _product(size.high, size.high))
        other = self.of(other)
        ends = [_product(a, b) for a in (self.low, self.high) for b in (other.low, other.high)]
        low, high = ends[0], ends[0]
        for end in ends[1:]:
            low, high = low.min(end), high.max(end)
        return ExtendedInterval(low, high)

    __rmul__ = __mul__

    def __rtruediv__(self, other: ExtendedInterval | arb | int) -> ExtendedInterval:
        quotient: ExtendedInterval = self.of(other) / self
        return quotient

    def __truediv__(self, other: ExtendedInterval | arb | int) -> ExtendedInterval:
        low, high = (divisor := self.of(other)).low, divisor.high
        if high <= 0:
            return (-self).__truediv__(-divisor)
        if not (low >= 0 and high > 0):
            raise Undefined
        inverse = flint.arb("inf") if low.is_zero() else 1 / low
        return self * ExtendedInterval(1 / high, inverse)

    def __abs__(self) -> ExtendedInterval:
        if self.low >= 0:
            return self
        return ExtendedInterval((-self.high).max(flint.arb(0)), (-self.low).max(self.high))


def _product(a: arb, b: arb) -> arb:
    """a b, with 0 for 0 times an infinite end."""
    return flint.arb(0) if a.is_zero() or b.is_zero() else a * b


class _Functions:
    """The elementary functions, for `evaluate_tree`: by their ends where they are monotone."""

    # Where each increases; the least argument, the largest.
    _increasing = {
        **dict.fromkeys(("exp", "sinh", "tanh", "asinh", "atan", "erf"), (-math.inf, math.inf)),
        **dict.fromkeys(("log", "sqrt"), (0, math.inf)),
        **dict.fromkeys(("asin", "atanh"), (-1, 1)),
        "acosh": (1, math.inf),
    }

    def rational(self, value: Fraction) -> ExtendedInterval:
        ball = exact_ball(value)
        return ExtendedInterval(ball, ball)

    def pi(self) -> ExtendedInterval:
        ball = flint.arb.pi()
        return ExtendedInterval(ball, ball)

    def power(self, base: ExtendedInterval, exponent: Fraction) -> ExtendedInterval:
        """base^exponent = e^(exponent log base), base positive."""
        result: ExtendedInterval = self.exp(self.rational(exponent) * self.log(base))
        return result

    def cosh(self, x: ExtendedInterval) -> ExtendedInterval:
        """cosh of the modulus, where it increases."""
        size = abs(x)
        return ExtendedInterval(size.low.cosh(), size.high.cosh())

    def acos(self, x: ExtendedInterval) -> ExtendedInterval:
        asin: ExtendedInterval = self.asin(x)
        return self.pi() / 2 - asin

    def sin(self, x: ExtendedInterval) -> ExtendedInterval:
        return self._wave(x, "sin")

    def cos(self, x: ExtendedInterval) -> ExtendedInterval:
        return self._wave(x, "cos")

    def tan(self, x: ExtendedInterval) -> ExtendedInterval:
        return self.sin(x) / self.cos(x)

    def _wave(self, x: ExtendedInterval, name: str) -> ExtendedInterval:
        """Sine or cosine: the range of the ball within [-1, 1]."""
        one = flint.arb(1)
        ball = x.low.union(x.high)
        if not ball.is_finite():
            return ExtendedInterval(-one, one)
        value = getattr(ball, name)()
        return ExtendedInterval(value.lower().max(-one), value.upper().min(one))

    def __getattr__(self, name: str) -> Any:
        if name not in self._increasing:
            raise AttributeError(name)
        least, most = self._increasing[name]

        def by_ends(x: ExtendedInterval) -> ExtendedInterval:
            """The interval between the values at both ends; Undefined outside the domain."""
            if not (x.low >= least and x.high <= most):
                raise Undefined
            return ExtendedInterval(_at_end(name, x.low), _at_end(name, x.high))

        return by_ends


def _at_end(name: str, x: arb) -> Any:
    """The function's value or limit at one end, where Arb has no value."""
    if name == "log" and x.is_zero():
        return flint.arb("-inf")
    if name == "atanh" and abs(x) == 1:
        return flint.arb("inf") * x
    if name == "erf" and not x.is_finite():
        return flint.arb(1) if x > 0 else flint.arb(-1)
    return getattr(x, name)()


def enclosure(expression: Expr, x: Symbol, lo: float, hi: float) -> tuple[float, float] | None:
    """Floats between which the expression lies for lo <= x <= hi, None where none are shown."""
    with precision(_BITS):
        domain = ExtendedInterval(flint.arb(lo), flint.arb(hi))
        try:
            values = evaluate_tree(expression, {x: domain}, _Functions())
        except (Undefined, InputError):
            return None
        low, high = float(values.low), float(values.high)
    return math.nextafter(low, -math.inf), math.nextafter(high, math.inf)
