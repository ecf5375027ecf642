"""One formula, many number types.

A model writes its drift once, as `evaluate(u, p, ops)`; `ops` brings what the
number type of `u` needs for it: `rational(value)`, `pi()`, `power(base, exponent)`
and the elementary functions by the names in `FUNCTIONS`. This module holds the
types that the layers above share: rationals, NumPy, SymPy, and mpmath contexts.
The truncated Taylor series and the balls bring their own, beside their engines.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symasym.base.call_context import mpf_of
from symasym.base.errors import InputError
from symasym.base.inputs import to_float

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr


FUNCTIONS = [
    *("exp", "log", "sqrt", "erf"),
    *("sin", "cos", "tan", "asin", "acos", "atan"),
    *("sinh", "cosh", "tanh", "asinh", "acosh", "atanh"),
]


# Functions that need pi or log 2 to as many bits as their argument has, and how many are quick.
_REDUCED = ("exp", "sin", "cos", "tan", "sinh", "cosh")
_LARGEST = 20_000


class Operations(Protocol):
    """The arithmetic of one number type beside + - * /; with it go the `FUNCTIONS` (see `call`).

    An object made for one value of the variable may have `known`, a dict of the values of nodes.
    """

    def rational(self, value: Fraction, /) -> Any: ...
    def pi(self) -> Any: ...
    def power(self, base: Any, exponent: Fraction, /) -> Any: ...


class Operand(Protocol):
    """A number of any type with + - * /, such as u in a drift's formula."""

    def __add__(self, other: Any, /) -> Any: ...
    def __radd__(self, other: Any, /) -> Any: ...
    def __sub__(self, other: Any, /) -> Any: ...
    def __rsub__(self, other: Any, /) -> Any: ...
    def __mul__(self, other: Any, /) -> Any: ...
    def __rmul__(self, other: Any, /) -> Any: ...
    def __truediv__(self, other: Any, /) -> Any: ...


class NotRational(Exception):
    """A formula left the rationals."""


class FractionOps:
    """Exact rationals; anything transcendental leaves them."""

    def rational(self, value: Fraction) -> Fraction:
        return value

    def pi(self) -> Any:
        raise NotRational

    def power(self, base: Fraction, exponent: Fraction) -> Any:
        """A whole power; any other leaves the rationals."""
        if exponent.denominator == 1:
            power = integer_power(base, abs(exponent.numerator))
            return power if exponent > 0 else 1 / power
        raise NotRational

    def __getattr__(self, name: str) -> Any:
        def leave(*_: Any) -> Any:
            raise NotRational

        return leave


class NumpyOps:
    """float64 arrays."""

    _names = {"asin": "arcsin", "acos": "arccos", "atan": "arctan"}
    _names |= {"asinh": "arcsinh", "acosh": "arccosh", "atanh": "arctanh"}

    def rational(self, value: Fraction) -> float:
        return to_float("A number of the drift", value)

    def pi(self) -> float:
        return float(np.pi)

    def power(self, base: Any, exponent: Fraction) -> Any:
        return np.power(base, float(exponent))

    def erf(self, x: Any) -> Any:
        """The error function, elementwise; to first order in an imaginary part."""
        # NumPy has no erf and SciPy is no requirement; the C library's is exact to an ulp.
        import math

        value = np.vectorize(math.erf, otypes=[float])(np.real(x))
        if np.iscomplexobj(x):
            value = value + 2j / math.sqrt(math.pi) * np.exp(-(x.real**2)) * x.imag
        return value

    def __getattr__(self, name: str) -> Any:
        if name not in FUNCTIONS:
            raise AttributeError(name)
        return getattr(np, self._names.get(name, name))


class MpmathOps:
    """Real numbers of one mpmath context."""

    def __init__(self, context: MPContext) -> None:
        self.context = context

    def rational(self, value: Fraction) -> Any:
        """The rational, rounded as the context rounds."""
        return mpf_of(value, self.context)

    def pi(self) -> Any:
        return +self.context.pi

    def power(self, base: mpf, exponent: Fraction) -> Any:
        return base ** self.rational(exponent)

    def __getattr__(self, name: str) -> Any:
        """The context's function; OverflowError where reducing its argument would take for ever."""
        if name not in FUNCTIONS:
            raise AttributeError(name)
        function = getattr(self.context, name)
        return (lambda x: function(_reducible(x))) if name in _REDUCED else function


def _reducible(x: Any) -> Any:
    """A number whose multiples of pi or log 2 are quickly taken off; else OverflowError."""
    if hasattr(x, "_mpf_") and x._mpf_[2] + x._mpf_[3] > _LARGEST:
        raise OverflowError(f"a function of a number above 2^{_LARGEST}")
    return x


class SympyOps:
    """SymPy expressions."""

    def rational(self, value: Fraction) -> Any:
        import sympy

        return sympy.Rational(value.numerator, value.denominator)

    def pi(self) -> Any:
        import sympy

        return sympy.pi

    def power(self, base: Expr, exponent: Fraction) -> Any:
        return base ** self.rational(exponent)

    def __getattr__(self, name: str) -> Any:
        if name not in FUNCTIONS:
            raise AttributeError(name)
        import sympy

        return getattr(sympy, name)


def call(ops: Operations, name: str, x: Operand) -> Any:
    """The elementary function `name`, one of `FUNCTIONS`, of `x`."""
    return getattr(ops, name)(x)


def evaluate_tree(expression: Expr, values: dict[Any, Any], ops: Operations) -> Any:
    """A SymPy expression in the arithmetic of `ops`, symbols replaced by `values`.

    `sympy.lambdify` would turn 1/3 into a float before the precision is known;
    walking the tree keeps every rational exact until `ops` rounds it.
    """
    import sympy

    # Values of parameters differ from drift to drift.
    shared = vars(ops).get("known") if len(values) == 1 else None
    known: dict[Any, Any] = {} if shared is None else shared
    known.update(values)

    def walk(node: Expr) -> Any:
        """The value of a node, worked out once."""
        if node not in known:
            known[node] = value_of(node)
        return known[node]

    def value_of(node: Expr) -> Any:
        """The value of a node from those of its arguments."""
        if node.is_Rational:
            return ops.rational(Fraction(int(node.p), int(node.q)))
        if node is sympy.pi:
            return ops.pi()
        if node is sympy.E:
            return call(ops, "exp", ops.rational(Fraction(1)))
        if node.is_Add:
            return _accumulate(map(walk, node.args), lambda a, b: a + b)
        if node.is_Mul:
            factor, rest = node.as_coeff_Mul()
            if shared is not None and factor != 1:
                return ops.rational(Fraction(int(factor.p), int(factor.q))) * walk(rest)
            if shared is None and (parts := _quotient(node)):
                return walk(parts[0]) / walk(parts[1])
            return _accumulate(map(walk, node.args), lambda a, b: a * b)
        if node.is_Pow:
            return power_of(node)
        name = type(node).__name__
        if name in FUNCTIONS and len(node.args) == 1:
            return call(ops, name, walk(node.args[0]))
        raise InputError(
            f"A contains {node}, which is not among the analytic functions symasym evaluates; "
            f"write A with {', '.join(FUNCTIONS)}, powers and rationals."
        )

    def power_of(node: Expr) -> Any:
        """The value of a power: a product, a root, a rational power or an exponential."""
        base, exponent = node.as_base_exp()
        if base is sympy.E:
            return call(ops, "exp", walk(exponent))
        if exponent.is_Integer:
            if shared is not None and exponent < -1:
                # Of a box without 0 the square may hold it.
                return integer_power(walk(1 / base), -int(exponent))
            positive = integer_power(walk(base), abs(int(exponent)))
            return positive if exponent > 0 else ops.rational(Fraction(1)) / positive
        if exponent == sympy.Rational(1, 2):
            return call(ops, "sqrt", walk(base))
        if exponent.is_Rational:
            return ops.power(walk(base), Fraction(int(exponent.p), int(exponent.q)))
        return call(ops, "exp", walk(exponent) * call(ops, "log", walk(base)))

    return walk(sympy.sympify(expression))


@lru_cache(maxsize=1024)
def _quotient(product: Expr) -> tuple[Expr, Expr] | None:
    """A product's numerator and divisor, or None where it has but one of them."""
    import sympy

    # exp(-x) stays a factor: as a divisor exp(x) it would overflow.
    below = [f for f in product.args if f.is_Pow and f.exp.is_Integer and f.exp < 0]
    above = [f for f in product.args if f not in below]
    return (sympy.Mul(*above), sympy.Mul(*(1 / f for f in below))) if below and above else None


def integer_power(base: Operand, exponent: int) -> Any:
    """``base**exponent`` for `exponent` >= 1 by squaring, for types without ``**``."""
    result: Any = None
    while exponent:
        if exponent & 1:
            result = base if result is None else result * base
        exponent >>= 1
        if exponent:
            base = base * base
    return result


def _accumulate(terms: Iterable[Any], combine: Callable[[Any, Any], Any]) -> Any:
    """The terms combined from left to right."""
    iterator = iter(terms)
    total = next(iterator)
    for term in iterator:
        total = combine(total, term)
    return total
