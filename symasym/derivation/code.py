"""Readable code from SymPy expressions: Python in several arithmetics, C and JavaScript."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from itertools import count
from typing import TYPE_CHECKING, Any

import sympy
from sympy import Symbol
from sympy.printing.str import StrPrinter

from symasym.base.call_context import step
from symasym.derivation.results import parts

if TYPE_CHECKING:
    from sympy import Expr


# The type of an argument of `function`, which the head of an emitted module imports or defines.
# "plain" has no functions at all: + - * / and whole powers, for any arithmetic. "arithmetic" has
# those of `symasym.numbers.arithmetic`, the first argument, and finds shared parts once.
_NUMBERS = {"mpmath": "mpf", "plain": "Ratios", "arithmetic": "Number"}
_FIRST = {"mpmath": "ctx: MPContext", "arithmetic": "c: Arithmetic"}
# SymPy's name of a function -> the name it goes by here (and in C).
_KNOWN = {
    **{name: name for name in ("exp", "log", "tanh", "sin", "cos", "asin", "acos", "atan")},
    **{
        name: name
        for name in ("sinh", "cosh", "expm1", "log1p", "logaddexp", "larger", "log_modulus")
    },
    "height_exp": "height_exp",
    # Quotients with a removable singularity at 0; each file that needs one holds it.
    **{name: name for name in ("exprel", "exprel2", "tanhc", "sinc")},
    "Abs": "abs",
    "atan2": "atan2",
    "_Root": "sqrt",
}


@dataclass(frozen=True)
class Dialect:
    """The syntax of a call: the names of a language's own functions, and of a file's helpers."""

    prefix: str
    names: Mapping[str, str] = field(default_factory=dict)
    helpers: Mapping[str, str] = field(default_factory=dict)
    first: str = ""  # an argument that helpers take before the others
    power: str = ""  # the function for powers, where there is no operator
    whole: str = ""  # what makes a whole number a double

    def call(self, name: str, arguments: list[str]) -> str:
        """The call of a function on arguments that are written already."""
        if name in self.helpers:
            return f"{self.helpers[name]}({', '.join([self.first, *arguments][not self.first :])})"
        return f"{self.prefix}{self.names.get(name, name)}({', '.join(arguments)})"


_REMOVABLE = ("exprel", "exprel2", "tanhc", "sinc")
_OWN = {name: f"_{name}" for name in _REMOVABLE}
DIALECTS = {
    "numpy": Dialect(
        "np.",
        {"larger": "maximum", **{a: f"arc{a[1:]}" for a in ("asin", "acos", "atan", "atan2")}},
        {
            **_OWN,
            **{name: f"_{name}" for name in ("log_modulus", "height_exp")},
        },
    ),
    "mpmath": Dialect(
        "ctx.",
        {"abs": "fabs"},
        {**_OWN, **{n: f"_{n}" for n in ("logaddexp", "larger", "log_modulus")}},
        first="ctx",
    ),
    "plain": Dialect(""),
    "arithmetic": Dialect("c."),
    # math.exp raises where C gives infinity.
    "python": Dialect(
        "math.",
        {"abs": "fabs"},
        {
            **_OWN,
            **{n: f"_{n}" for n in ("exp", "expm1", "sinh", "cosh", "logaddexp", "log_modulus")},
            "larger": "max",
        },
    ),
    "c": Dialect(
        "",
        {"abs": "fabs", "larger": "fmax"},
        {
            **{name: f"{name}_" for name in (*_REMOVABLE, "logaddexp", "log_modulus")},
        },
        power="pow",
        whole=".0",
    ),
    # -x**2 is an error in JavaScript.
    "javascript": Dialect(
        "Math.",
        {"larger": "max"},
        {
            **{name: name for name in (*_REMOVABLE, "logaddexp")},
            "log_modulus": "logModulus",
        },
        power="Math.pow",
    ),
}


class NotEmittable(ValueError):
    """The expression holds something that has no elementary value."""


class Printer(StrPrinter):  # type: ignore[misc]
    """SymPy's string printer with the functions of one library.

    Where a formula would lose digits as it stands, its stable form is printed:
    ``expm1`` and ``log1p`` beside 1, ``logaddexp`` for the logarithm of a sum of
    exponentials. Square roots are taken of a quotient, once.
    """

    def __init__(self, target: str, names: dict[Any, str]) -> None:
        super().__init__({"order": "none"})
        self.dialect = DIALECTS[target]
        self.target, self.names = target, dict(names)

    def _call(self, name: str, *arguments: Expr) -> str:
        """The call of a function of the target; `NotEmittable` where it has none."""
        if self.target == "plain":
            raise NotEmittable(f"{name} is no operation of every arithmetic.")
        return self.dialect.call(name, [self._print(a) for a in arguments])

    def _placeholder(self, text: str) -> Any:
        """A symbol that is printed as `text`, to stand in a product or a sum."""
        symbol = sympy.Symbol(f"_{len(self.names)}")
        self.names[symbol] = text
        return symbol

    def _print_Symbol(self, expr: Expr) -> str:
        """The name given to a symbol, else its own without the mark before an index."""
        if expr in self.names:
            return str(self.names[expr])
        name = str(expr.name)
        return name.replace("_", "") if "_" in name and name[-1].isdigit() else name

    def _print_Pi(self, expr: Expr) -> str:
        """The target's pi."""
        if self.target == "plain":
            raise NotEmittable("pi is no number of every arithmetic.")
        return f"{self.dialect.prefix}pi"

    def _print_Integer(self, expr: Expr) -> str:
        """A whole number, as a double in languages that would divide it as one."""
        return f"{expr.p}{self.dialect.whole}"

    def _print_Rational(self, expr: Expr) -> str:
        """A quotient, divided by the arithmetic in which the formula is evaluated."""
        if expr.q == 1:
            return self._print_Integer(expr)
        # A quotient of Python ints would be a float64: let the context divide.
        if self.target == "plain":
            raise NotEmittable(f"{expr} alone is no number of every arithmetic.")
        if self.target == "mpmath":
            return f"ctx.mpf({expr.p})/{expr.q}"
        if self.target == "arithmetic":
            return f"c.rational({expr.p}, {expr.q})"
        return f"{expr.p}{self.dialect.whole}/{expr.q}{self.dialect.whole}"

    def _print_Function(self, expr: Expr) -> str:
        """The call of one of the functions in `_KNOWN`."""
        name = _KNOWN.get(type(expr).__name__)
        if name is None:
            raise NotEmittable(f"{expr} has no closed form to emit.")
        if name == "height_exp" and name not in self.dialect.helpers:
            return self._call("exp", sympy.Mul(*expr.args))
        return self._call(name, *expr.args)

    _print_Abs = _print_Function

    def _print_log(self, expr: Expr) -> str:
        """log(1 + x) as log1p(x), and the logarithm of a sum of exponentials by logaddexp."""
        (argument,) = expr.args
        if argument.is_Add and len(argument.args) == 2:
            terms = [a for a in argument.args if a != 1]
            if all(isinstance(a, sympy.exp) for a in terms) and self.target == "numpy":
                # Where the exponentials overflow, the logarithm of their sum does not.
                exponents = [sympy.S.Zero, *(a.args[0] for a in terms)][-2:]
                return self._call("logaddexp", *exponents)
            if len(terms) == 1:
                return self._call("log1p", *terms)
        return self._call("log", argument)

    def _print_Mul(self, expr: Expr) -> str:
        """A product, its square roots joined into one."""
        step()
        below = [a for a in expr.args if a.is_Pow and a.exp.is_Rational and a.exp < 0]
        if expr.args[0].is_Rational and not expr.args[0].is_Integer:
            below.append(expr.args[0])
        # SymPy has no brackets about a lone denominator, which x**(5/2) would be printed as two of.
        lone = len(below) == 1 and _root_of_positive(below[0]) and below[0].exp < -1
        if not lone and sum(_root_of_positive(a) for a in expr.args) < 2:
            return str(super()._print_Mul(expr))
        return self._with_one_root(expr.args)

    def _with_one_root(self, factors: Iterable[Expr]) -> str:
        """The product with its half-integer powers as one square root."""
        under, rest = sympy.S.One, []
        for factor in factors:
            if _root_of_positive(factor):
                whole = sympy.Integer(int(factor.exp))  # 3/2 = 1 + 1/2, -1/2 = 0 - 1/2
                under *= factor.base ** (2 * (factor.exp - whole))
                factor = factor.base**whole
            rest.append(factor)
        root = self._placeholder(self._call("sqrt", under))
        return str(self._print(sympy.Mul(*rest, root)))

    def _print_Add(self, expr: Expr, order: str | None = None) -> str:
        """A sum, with c e^x - c written as c expm1(x)."""
        constant = sum((a for a in expr.args if a.is_Rational), sympy.S.Zero)
        for term in expr.args:
            factor, power = term.as_coeff_Mul()
            if isinstance(power, sympy.exp) and constant != 0 and factor == -constant:
                # exp(x) - 1 loses the digits of a small x.
                close = self._placeholder(self._call("expm1", power.args[0]))
                rest = [a for a in expr.args if a is not term and not a.is_Rational]
                return str(self._print(sympy.Add(*rest, factor * close)))
        return str(super()._print_Add(expr, order=order))

    def _print_Pow(self, expr: Expr, rational: bool = False) -> str:
        """A power by the operator, a square root or a function of the target."""
        base, exponent = expr.base, expr.exp
        if exponent == sympy.Rational(1, 2):
            return self._call("sqrt", base)
        if exponent == sympy.Rational(-1, 2):
            return f"1/{self._call('sqrt', base)}"
        if exponent.is_Integer and not self.dialect.power:
            return str(super()._print_Pow(expr, rational=False))
        if _root_of_positive(expr):
            return self._with_one_root([expr])
        if self.dialect.power and exponent == -1:
            return f"1{self.dialect.whole}/{self.parenthesize(base, 60)}"
        if self.dialect.power:
            return f"{self.dialect.power}({self._print(base)}, {self._print(exponent)})"
        if self.target == "plain":
            raise NotEmittable(f"{expr} is no operation of every arithmetic.")
        return f"{self.parenthesize(base, 60)}**({self._print(exponent)})"

    def _print_ExpBase(self, expr: Expr) -> str:
        return self._call("exp", expr.args[0])

    _print_exp = _print_ExpBase


class _Root(sympy.Function):  # type: ignore[misc]
    """A square root that SymPy does not take apart."""


def _joined(product: Expr) -> Any:
    """A product with its half-integer powers as one square root."""
    roots = [f for f in product.args if _root_of_positive(f)]
    if len(roots) < 2:
        return product
    rest = [f for f in product.args if f not in roots]
    whole = [f.base ** int(f.exp) for f in roots]
    under = sympy.Mul(*(f.base ** (2 * (f.exp - int(f.exp))) for f in roots))
    return sympy.Mul(*rest, *whole, _Root(under))


def _root_of_positive(e: Expr) -> bool:
    """A half-integer power of something positive, so that roots may be joined."""
    return bool(e.is_Pow and e.exp.is_Rational and e.exp.q == 2 and e.base.is_positive)


def code(
    expression: Expr | tuple[Expr, ...], target: str, names: dict[Any, str] | None = None
) -> str:
    """One expression, or a tuple of them, as Python source.

    Raises
    ------
    NotEmittable
        If it holds an undefined function, an integral or the like.
    """
    pieces = parts(expression)
    for piece in pieces:
        if piece.atoms(sympy.Integral, sympy.Derivative, sympy.core.function.AppliedUndef):
            raise NotEmittable(f"{piece} has no closed form to emit.")
    printer = Printer(target, names or {})
    return ", ".join(str(printer.doprint(piece)) for piece in pieces)


def function(
    name: str,
    arguments: list[Any],
    expression: Expr | tuple[Expr, ...],
    target: str,
    doc: str,
    names: dict[Any, str] | None = None,
) -> str:
    """A function of `arguments` that returns `expression`, with a docstring."""
    names = names or {}
    shown = [names.get(a, code(a, target)) for a in arguments]
    missing = {s for e in parts(expression) for s in e.free_symbols} - set(arguments)
    if missing:
        raise NotEmittable(f"{name} needs {', '.join(sorted(map(str, missing)))} as arguments.")
    shared, lines = [], []
    if target == "arithmetic":
        # Names of shared parts that no argument has.
        free = (Symbol(f"x{k}") for k in count() if f"x{k}" not in shown)
        joined = [e.replace(lambda x: x.is_Mul, _joined) for e in parts(expression)]
        shared, pieces = sympy.cse(joined, free, order="none", list=False)
        expression = tuple(pieces) if len(pieces) > 1 else pieces[0]
        lines = [f"{part} = {code(e, target, names)}" for part, e in shared]
    body = code(expression, target, names)
    number = returned = _NUMBERS[target]
    if target == "plain" and re.search(r"-(?!\d)|\*\*", body):
        number = "Field"
    if target != "mpmath":
        returned = "Any"
    elif len(parts(expression)) > 1:
        returned = f"tuple[{number}, ...]"
    first = [_FIRST[target]] if target in _FIRST else []
    signature = ", ".join([*first, *(f"{a}: {number}" for a in shown)])
    head = f"def {name}({signature}) -> {returned}:"
    if len(head) > 100:
        if len(signature) > 96:
            signature = signature.replace(", ", ",\n    ") + ","
        head = f"def {name}(\n    {signature}\n) -> {returned}:"
    if len(body) > 88:
        # Lines are broken at spaces; a long product has none of its own.
        spaced = body if len(max(body.split(), key=len)) < 80 else body.replace(")*", ") * ")
        wrapped = textwrap.fill(spaced, 88, break_long_words=False, break_on_hyphens=False)
        body = f"(\n{textwrap.indent(wrapped, ' ' * 8)}\n    )"
    before = "".join(f"    {line}\n" for line in lines)
    return f'{head}\n    """{doc}"""\n{before}    return {body}\n'
