"""A formula A(u) of a drift, and its evaluation in ball arithmetic and on float64 arrays.

A formula is a SymPy expression in u and in parameters; SymPy's lambdify turns it into a function.
In ball arithmetic this function is infinite or nan on every box that meets a branch cut or a pole,
so that a finite enclosure over a box proves that A is analytic there. Arb's own square root,
logarithm and inverse functions are finite across their cuts; they are therefore replaced here, and
an expression with any function other than `FUNCTIONS` is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from typing import Any

import numpy as np
import sympy
from flint import acb, acb_series, arb, arb_series, fmpq
from sympy.printing.lambdarepr import LambdaPrinter

from symasym.base.balls import precision, rational
from symasym.base.errors import InputError

Values = Mapping[str, Any]
_END_BITS = 4096  # enough digits remain if numbers between 1e-300 and 1e300 cancel


@dataclass(frozen=True)
class Formula:
    """A SymPy expression A in the symbol `u`; its other symbols are parameters.

    The methods take `values` by the parameters' names, and ignore other names.
    """

    expression: Any
    u: Any

    @cached_property
    def symbols(self) -> dict[str, Any]:
        """The symbols of the parameters by their names."""
        free = self.expression.free_symbols - {self.u}
        return {s.name: s for s in sorted(free, key=lambda s: s.name)}

    @cached_property
    def powers(self) -> Any:
        """Coefficients of A in ascending powers of u as a Tuple; None if A is not a polynomial."""
        poly = self.expression.as_poly(self.u)
        return None if poly is None else sympy.Tuple(*poly.all_coeffs()[::-1])

    @cached_property
    def steady(self) -> bool:
        """True if float64 gives a polynomial's coefficients to a few units in the last place,
        since they contain no functions, and only sums of two parameters or float64 numbers."""

        def exact(x: Any) -> Any:
            return (
                x.is_Symbol or (-x).is_Symbol or (x.is_Rational and sympy.Rational(float(x)) == x)
            )

        sums = self.powers.atoms(sympy.Add)
        odd = self.powers.atoms(sympy.Function, sympy.NumberSymbol)
        return not odd and all(len(x.args) == 2 and all(map(exact, x.args)) for x in sums)

    @cached_property
    def _ends(self) -> dict[int, Any]:
        """A(-1) and A(1) with SymPy's automatic simplification: sin(pi) is 0 there, not 1e-16.

        Exact zeros matter, since the radius multiplies these errors and the signs set the region.
        """
        return {side: self.expression.subs(self.u, side) for side in (-1, 1)}

    def _call(self, what: Any, values: Values, balls: bool, *u: Any) -> Any:
        symbols = *([self.u] if u else []), *self.symbols.values()
        return compiled(what, symbols, balls)(*u, *(values[name] for name in self.symbols))

    def value(self, u: Any, values: Values, balls: bool) -> Any:
        """A(u) in ball arithmetic or in float64."""
        return self._call(self.expression, values, balls, u) + 0 * u

    def coefficients(self, values: Values, balls: bool) -> list[Any] | None:
        """Values of `powers`: balls, or fmpq where rational; else floats of the values' dtype."""
        return None if self.powers is None else list(self._call(self.powers, values, balls))

    def end(self, side: int, values: Values, balls: bool) -> Any:
        """A(side) for side = -1 or 1, of the same type as `coefficients`."""
        return self._call(self._ends[side], values, balls)

    def exact_coefficients(self, values: Values) -> list[Fraction] | None:
        """The coefficients of A in ascending powers; None unless all are known to be rational."""
        with precision(_END_BITS):
            try:
                found = self.coefficients({k: rational(x) for k, x in values.items()}, balls=True)
            except ZeroDivisionError:
                return None
            known = [x for c in found or [] if (x := exactly(c)) is not None]
        return known if found and len(known) == len(found) else None

    def ends(self, values: Values) -> tuple[Any, Any]:
        """A(-1) and A(1): Fractions if they are known to be rational, else floats."""
        found, numbers = [], {k: rational(x) for k, x in values.items()}
        with precision(_END_BITS):
            for side in (-1, 1):
                ball = self.end(side, numbers, balls=True)
                if (known := exactly(ball)) is None and ball.contains(0):
                    own = tuple((name, values[name]) for name in self.symbols)
                    known = Fraction(0) if vanishes(self, own, Fraction(side), 0) else None
                found.append(float(ball.mid()) if known is None else known)
        return found[0], found[1]

    def with_values(self, values: Values) -> Any:
        """A(u) in the real symbol u; parameters without an exact value become real symbols."""
        known = {name: x for name, x in values.items() if isinstance(x, Fraction)}
        put = {
            s: sympy.Rational(*known[name].as_integer_ratio())
            if name in known
            else sympy.Symbol(name, real=True)
            for name, s in self.symbols.items()
        }
        return self.expression.subs(put).subs(self.u, sympy.Symbol("u", real=True))


#: Equal formulas are the same object, so that its cached properties are computed once.
interned = lru_cache(maxsize=512)(Formula)


@lru_cache(maxsize=128)
def vanishes(
    formula: Formula, values: tuple[tuple[str, Fraction], ...], u: Fraction, order: int
) -> bool:
    """True if SymPy simplifies the derivative of A of this order at u to 0."""
    A, x = formula.with_values(dict(values)), sympy.Symbol("u", real=True)
    at = sympy.Rational(u.numerator, u.denominator)
    return bool(sympy.simplify(sympy.diff(A, x, order).subs(x, at)) == 0)


def exactly(x: Any) -> Fraction | None:
    """A rational or a ball of radius 0 as a Fraction; None for any other ball."""
    if isinstance(x, arb):
        if not (x.is_exact() and x.is_finite()):
            return None
        x = x.fmpq()
    return Fraction(int(x.numerator), int(x.denominator))


# -- functions -------------------------------------------------------------------------------------


def _cosh(x: Any) -> Any:
    return (x.exp() + (-x).exp()) / 2


def _sech2(x: Any) -> Any:
    """1/cosh(x)^2 without overflow."""
    e = (2 * x if x[0].real.mid() < 0 else -2 * x).exp()
    return 4 * e / (1 + e) ** 2


# Derivatives of the functions that flint's power series do not provide.
_SLOPES: dict[str, Callable[[Any], Any]] = {
    "sinh": _cosh,
    "tanh": _sech2,
    "asin": lambda x: (1 - x * x).rsqrt(),
    "acos": lambda x: -(1 - x * x).rsqrt(),
    "asinh": lambda x: (1 + x * x).rsqrt(),
    "acosh": lambda x: (x - 1).rsqrt() * (x + 1).rsqrt(),
    "atanh": lambda x: 1 / (1 - x * x),
}
# True if a box may meet the branch cuts of an inverse function (DLMF 4.23, 4.37).
_CUTS: dict[str, Callable[[Any], bool]] = {
    **dict.fromkeys(
        ("asin", "acos", "atanh"), lambda z: z.imag.contains(0) and not abs(z.real) < 1
    ),
    **dict.fromkeys(("atan", "asinh"), lambda z: z.real.contains(0) and not abs(z.imag) < 1),
    "acosh": lambda z: z.imag.contains(0) and not z.real > 1,
}
#: The functions admitted in A: entire functions, quotients of them, and functions with cuts.
FUNCTIONS = ("exp", "sin", "cos", "tan", "sinh", "cosh", "tanh", "erf", "log", "sqrt", *_CUTS)


def _of_balls(name: str, x: Any) -> Any:
    """A function of a rational, a ball or a power series; nan on a box that meets its cuts."""
    if isinstance(x, (int, fmpq)):
        x = arb(x)
    if isinstance(x, (arb_series, acb_series)):
        if name == "cosh":
            return _cosh(x)
        if name in _SLOPES:
            return (x.derivative() * _SLOPES[name](x)).integral() + _of_balls(name, x[0])
    elif isinstance(x, acb):
        if name == "sqrt" and not x.contains(0):
            # For a wide box Arb's own square root is several times wider.
            return (x.log(analytic=True) / 2).exp()
        if name in ("log", "sqrt"):
            return getattr(x, name)(analytic=True)
        if name in _CUTS and _CUTS[name](x):
            return acb(arb.nan())
    return getattr(x, name)()


def _erf(x: Any) -> Any:
    from scipy.special import erf

    return erf(x)


def _power(x: Any, n: int) -> Any:
    """x^n; for a real ball with the midpoint 0 flint itself gives nan."""
    return (acb(x) ** n).real if isinstance(x, arb) and x.mid() == 0 else x**n


_BALLS: dict[str, Any] = {f: partial(_of_balls, f) for f in FUNCTIONS}
_BALLS |= {"fmpq": fmpq, "pi": arb.pi, "power": _power}


def require_admitted(formula: Any) -> None:
    """Raise InputError unless A consists of + - * /, powers, rationals, pi, E and `FUNCTIONS`."""
    for node in sympy.preorder_traversal(formula):
        if not (
            node.is_Rational
            or isinstance(node, (sympy.Symbol, sympy.Add, sympy.Mul, sympy.Pow, sympy.Tuple))
            or node in (sympy.pi, sympy.E)
            or (type(node).__name__ in FUNCTIONS and len(node.args) == 1)
        ):
            raise InputError(
                f"A contains {node}, which is not among the analytic functions symasym evaluates; "
                f"write A with {', '.join(FUNCTIONS)}, powers and rationals."
            )


class _Balls(LambdaPrinter):  # type: ignore[misc]
    """Prints exact rational constants, and powers by functions that are infinite at their cuts."""

    def _print_Rational(self, x: Any) -> str:
        return f"fmpq({x.p}, {x.q})"

    _print_Half = _print_Rational

    def _print_Pi(self, x: Any) -> str:
        return "pi()"

    def _print_Exp1(self, x: Any) -> str:
        return "exp(1)"

    def _print_Pow(self, x: Any, rational: bool = False) -> str:
        base, exponent = self._print(x.base), self._print(x.exp)
        if not (x.exp.is_Rational and x.exp.q <= 2):
            return f"exp(({exponent})*log({base}))"
        root = f"({base})" if x.exp.q == 1 else f"sqrt({base})"
        return f"power({root if x.exp > 0 else f'1/{root}'}, {abs(x.exp.p)})"


@lru_cache(maxsize=256)
def compiled(formula: Any, symbols: tuple[Any, ...], balls: bool) -> Callable[..., Any]:
    """A formula, or a Tuple of formulas, as a function of balls or of float64 arrays."""
    require_admitted(formula)
    taken = {*_BALLS, *vars(np)}
    other = {s: sympy.Dummy() for s in symbols if s.name in taken}
    formula, names = formula.xreplace(other), [other.get(s, s) for s in symbols]
    formula = [*formula] if isinstance(formula, sympy.Tuple) else formula
    modules: list[Any] = [{"erf": _erf}, "numpy"]
    options = {}
    if balls:
        modules = [_BALLS]
        options["printer"] = _Balls({"fully_qualified_modules": False, "inline": True})
    of: Callable[..., Any] = sympy.lambdify(names, formula, modules, cse=True, **options)
    return of
