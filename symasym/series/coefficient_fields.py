"""The fields of Taylor coefficients: rationals, rational functions of parameters, or mpf.

A field brings its constants to `symasym.series.taylor_series`: exp(c), sin(c), c^e of a constant
term c. In exact work every irrational constant (sqrt(2), exp(p), sin(c)) becomes a generator of a
field of rational functions, in which arithmetic is canonical and fast, and which is turned back
into SymPy's expressions at the end. Relations between generators are then forgotten, so zero is
decided on the expression.
"""

from __future__ import annotations

import random
from collections.abc import Collection, Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Protocol

import sympy

from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.numbers.trees import MpmathOps, evaluate_tree

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext


_SAMPLES = 12


#: An element of a field: an expression, a rational function of the generators, an mpf.
Element = Any


class CoefficientField(Protocol):
    """The constants of Taylor series: rationals, symbols, and functions of constants."""

    def rational(self, value: Fraction, /) -> Element: ...
    def symbol(self, symbol: sympy.Symbol, /) -> Element: ...
    def expression(self, value: sympy.Expr, /) -> Element: ...
    def call(self, name: str, element: Element, /) -> Element: ...
    def power(self, element: Element, exponent: Element, /) -> Element: ...
    def to_expression(self, element: Element, /) -> Any: ...
    def is_zero(self, element: Element, /) -> bool: ...
    def negligible(self, element: Element, others: list[Element], /) -> bool: ...


class ExpressionField:
    """SymPy expressions, remembering each constant that was asked for."""

    def __init__(self) -> None:
        self.constants: list[Any] = []

    def rational(self, value: Fraction) -> Any:
        return sympy.Rational(value.numerator, value.denominator)

    def symbol(self, symbol: sympy.Symbol) -> Any:
        return self.expression(symbol)

    def expression(self, value: sympy.Expr) -> Any:
        """The expression itself, remembered as a constant."""
        self.constants.append(value)
        return value

    def call(self, name: str, element: Element) -> Any:
        """A function of a constant, remembered."""
        return self.expression(getattr(sympy, name)(sympy.expand(element)))

    def power(self, element: Element, exponent: Element) -> Any:
        """A power of a constant, remembered."""
        return self.expression(sympy.expand(element) ** self.to_expression(exponent))

    def to_expression(self, element: Element) -> Any:
        return sympy.sympify(element)

    def is_zero(self, element: Element) -> bool:
        """True if the expression is zero (see `vanishes`)."""
        return vanishes(sympy.sympify(element))

    def negligible(self, element: Element, others: list[Any]) -> bool:
        """True if it is zero, in numbers beside the other coefficients of its series."""
        return self.is_zero(element)


class FunctionField:
    """Rational functions over the rationals, generators for parameters and irrational constants."""

    def __init__(self, constants: Iterable[Any]) -> None:
        """Set up the field of everything that these constants are made of."""
        names: dict[Any, Any] = {}
        for constant in constants:
            _generators(sympy.sympify(constant), names)
        self._names = names
        self._back = {dummy: original for original, dummy in names.items()}
        if names:
            self._field = sympy.QQ.frac_field(*names.values())
        else:
            self._field = sympy.QQ

    @property
    def generators(self) -> tuple[Any, ...]:
        """The parameters and irrational constants that generate the field."""
        return tuple(self._names)

    def rational(self, value: Fraction) -> Any:
        """The element that a rational is."""
        ground = sympy.QQ(value.numerator, value.denominator)
        return self._field.convert_from(ground, sympy.QQ) if self._names else ground

    def symbol(self, symbol: sympy.Symbol) -> Any:
        return self.expression(symbol)

    def expression(self, value: sympy.Expr) -> Any:
        """The element that an expression of the generators is."""
        return self._field.from_sympy(_replaced(sympy.sympify(value), self._names))

    def call(self, name: str, element: Element) -> Any:
        """A function of an element, if the field holds it; else `MissingConstant`."""
        return self._constant(getattr(sympy, name)(sympy.expand(self.to_expression(element))))

    def power(self, element: Element, exponent: Element) -> Any:
        """A power of an element, if the field holds it; else `MissingConstant`."""
        base = sympy.expand(self.to_expression(element))
        return self._constant(base ** self.to_expression(exponent))

    def _constant(self, value: sympy.Expr) -> Any:
        """The element that a constant is; `MissingConstant` for one outside."""
        try:
            return self.expression(value)
        except (KeyError, sympy.CoercionFailed):
            raise MissingConstant(value) from None

    def to_expression(self, element: Element) -> Any:
        """The element as a SymPy expression of the original constants."""
        if isinstance(element, (int, Fraction)):
            return sympy.Rational(element)
        expression = self._field.to_sympy(element)
        return expression.xreplace(self._back) if self._names else expression

    def is_zero(self, element: Element) -> bool:
        """True for zero, decided on the expression (generators may be related)."""
        if element == 0:
            return True
        return bool(self._names) and vanishes(self.to_expression(element))

    def negligible(self, element: Element, others: list[Any]) -> bool:
        return self.is_zero(element)


class MissingConstant(Exception):
    """A constant outside the field that was set up; the field must be made again with it."""

    def __init__(self, value: sympy.Expr) -> None:
        super().__init__(str(value))
        self.value = value


class RealField:
    """mpf of one context. What is below most of the digits is zero: points are roots, rounded."""

    def __init__(self, context: MPContext) -> None:
        self.context = context
        self.ops = MpmathOps(context)

    def rational(self, value: Fraction) -> Any:
        return self.ops.rational(value)

    def symbol(self, symbol: sympy.Symbol) -> Any:
        raise InputError(f"{symbol} has no value; give one, or leave dps out for a formula.")

    def expression(self, value: sympy.Expr) -> Any:
        """The number that an mpf, an mpc or an expression without symbols stands for."""
        if hasattr(value, "_mpf_") and not isinstance(value, sympy.Basic):
            return self.context.make_mpf(value._mpf_)
        if hasattr(value, "_mpc_"):
            return self.context.make_mpc(value._mpc_)
        return evaluate_tree(value, {}, self.ops)

    def call(self, name: str, element: Element) -> Any:
        """A function of a number."""
        if name == "Abs":
            return abs(element)
        return getattr(self.context, name)(element)

    def power(self, element: Element, exponent: Element) -> Any:
        """A power whose exponent is a rational or a number."""
        if isinstance(exponent, Fraction):
            exponent = self.rational(exponent)
        return element**exponent

    def to_expression(self, element: Element) -> Any:
        return element

    def is_zero(self, element: Element) -> bool:
        """True for a number below four fifths of the digits."""
        return bool(abs(element) < self._least())

    def negligible(self, element: Element, others: list[Any]) -> bool:
        """True for a number that small beside the largest of `others`."""
        return bool(abs(element) <= self._least() * max(abs(other) for other in others))

    def _least(self) -> Any:
        """10 to minus four fifths of the digits."""
        return self.context.mpf(10) ** (-self.context.dps * 4 // 5)


def vanishes(expression: sympy.Expr) -> bool:
    """True if an expression is zero: by numbers where it is not, by SymPy where it is."""
    return seems_zero(expression) and bool(sympy.simplify(expression) == 0)


def seems_zero(expression: sympy.Expr) -> bool:
    """False if some numbers show that an expression is not zero."""
    expression = sympy.sympify(expression)
    if expression.is_Rational:
        return bool(expression == 0)
    for values in sampled_parameters(expression.free_symbols, 2):
        if _is_apart(expression, values):
            return False
        value = sympy.N(expression.xreplace(values), 30, maxn=200)
        if value.is_number and value.is_finite and abs(value) > sympy.Float("1e-20"):
            return False
    return True


def _is_apart(expression: sympy.Expr, values: dict[Any, Any]) -> bool:
    """True if mpmath shows that it is not zero at these values, with 40 and with 60 digits.

    OverflowError where no digits would be enough, since SymPy would go on taking more.
    """
    found = []
    for digits in (40, 60):
        with own_context(digits) as context:
            try:
                ops = MpmathOps(context)
                known = {x: ops.rational(Fraction(int(y.p), int(y.q))) for x, y in values.items()}
                value = evaluate_tree(expression, known, ops)
            except OverflowError:
                raise
            except (InputError, ArithmeticError, ValueError):  # what SymPy knows alone, or a pole
                return False
            found.append(complex(value) if abs(value) < 1e300 else complex(1e300))
    return abs(found[1]) > 1e-20 and abs(found[0] - found[1]) < 1e-10 * abs(found[1])


def sampled_parameters(
    symbols: Collection[sympy.Symbol], count: int = _SAMPLES
) -> list[dict[Any, Any]]:
    """Rational values of `symbols` that their assumptions allow, the same ones each time."""
    rng = random.Random(7)
    samples = []
    for _ in range(count if symbols else 1):
        values = {}
        for symbol in sorted(symbols, key=str):
            size = sympy.Rational(rng.randint(11, 5000), 1000)
            if symbol.is_integer:
                size = sympy.Integer(rng.randint(1, 6))
            negative = symbol.is_negative or (
                not symbol.is_nonnegative and not symbol.is_positive and rng.random() < 0.5
            )
            values[symbol] = -size if negative else size
        samples.append(values)
    return samples


def sign_of(expression: sympy.Expr) -> tuple[int | None, bool]:
    """The sign of an expression, and True if the assumptions alone decide it.

    Undecided by assumptions, it is the sign at sampled parameters; None if those differ.
    """
    expression = sympy.sympify(expression)
    if expression.is_positive:
        return 1, True
    if expression.is_negative:
        return -1, True
    if expression.is_zero:
        return 0, True
    signs = set()
    for values in sampled_parameters(expression.free_symbols):
        value = sympy.N(expression.xreplace(values), 30, maxn=200)
        if value.is_real is False or not value.is_finite:
            return None, False
        signs.add(0 if abs(value) < sympy.Float("1e-20") else int(sympy.sign(value)))
    if signs == {0}:
        return (0 if vanishes(expression) else None), True
    return (signs.pop() if len(signs) == 1 else None), not expression.free_symbols


def _generators(node: sympy.Expr, names: dict[Any, Any]) -> None:
    """Add to `names` a generator for each parameter and irrational constant of `node`."""
    if node.is_Rational:
        return
    if node.is_Add or node.is_Mul:
        for part in node.args:
            _generators(part, names)
    elif node.is_Pow and node.exp.is_Integer:
        _generators(node.base, names)
    else:
        key, _ = _canonical(node)
        names.setdefault(key, sympy.Dummy(f"c{len(names)}"))


def _replaced(node: sympy.Expr, names: dict[Any, Any]) -> Any:
    """The same expression in the generators."""
    if node.is_Rational:
        return node
    if node.is_Add or node.is_Mul:
        return node.func(*(_replaced(part, names) for part in node.args))
    if node.is_Pow and node.exp.is_Integer:
        return _replaced(node.base, names) ** node.exp
    key, power = _canonical(node)
    return names[key] ** power


def _canonical(node: sympy.Expr) -> tuple[Any, int]:
    """node = key^power, so that x^(3/2) and x^(1/2), e^(-c) and e^c share a generator."""
    if isinstance(node, sympy.exp) and node.exp.could_extract_minus_sign():
        return sympy.exp(-node.exp), -1
    if node.is_Pow and node.exp.is_Rational:
        return node.base ** sympy.Rational(1, node.exp.q), int(node.exp.p)
    return node, 1
