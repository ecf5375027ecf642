"""Reading a drift given as a SymPy expression, and writing phi and V as SymPy ones."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from itertools import count
from typing import Any

import numpy as np
import sympy
from flint import fmpq

from symasym.base.call_context import SIMPLER, expect, limited, own_context, step, watched
from symasym.base.errors import InputError
from symasym.base.inputs import Number, exact, is_name, shown
from symasym.drift import evaluate, grammar, models
from symasym.numbers.balls import precision
from symasym.numbers.trees import FractionOps, MpmathOps, NotRational, evaluate_tree
from symasym.series.coefficient_fields import sampled_parameters

# Halvings of [-1, 1], and boxes, of which a smooth drift takes a few hundred at most.
_DEEPEST, _MOST_BOXES = 120, 5_000
# Seconds that SymPy takes for a squared operation at least, of those far from a sum of powers; and
# functions in each other, each of which more makes it take three times as long.
_SECONDS, _INSIDE = 2e-5, 2
# Fractions in each other that SymPy brings over one denominator in a second; one more takes thrice.
_FRACTIONS = 12
# Digits with which ends are compared, so that 160 may cancel.
_COMPARED = 200
_OVERLAP = fmpq(9, 16)  # half would let neighbouring balls touch only


def read(
    A: sympy.Expr | str,
    u: sympy.Symbol | str | None,
    a_minus: sympy.Expr | Number | None,
    a_plus: sympy.Expr | Number | None,
) -> models.Expression:
    """The model of the drift A(u), its ends checked against a- and a+ (eq:cont)."""
    given = (A, u, a_minus, a_plus)
    try:
        hash(given)
    except TypeError:  # which is refused below
        return _read.__wrapped__(*given)
    return _read(*given)


@lru_cache(maxsize=128, typed=True)
def _read(A: Any, u: Any, a_minus: Any, a_plus: Any) -> models.Expression:
    """The model; the last ones that were read are kept."""
    with limited(way_out=SIMPLER), watched():
        return _checked(A, u, a_minus, a_plus)


def _checked(A: Any, u: Any, a_minus: Any, a_plus: Any) -> models.Expression:
    """The model, read and checked."""
    formula = parse("A", A)
    symbol = _symbol(formula, u)
    for s in formula.free_symbols:
        if not is_name(s.name):
            raise InputError(
                f"A has the symbol {shown(s.name)}; give symbols names of letters, digits and _."
            )
    evaluate.require_admitted(formula)
    for name, given, end in (("a-", a_minus, -1), ("a+", a_plus, 1)):
        if given is None:
            continue
        outside, inside = parse(name, given), formula.subs(symbol, end)
        evaluate.require_admitted(outside)
        if not _equal(inside, outside):
            raise InputError(
                f"A jumps at u = {end}: A({end}) is {shown(inside)} but {name} is "
                f"{shown(outside)}; make them equal (give decimals as strings to keep them exact)."
            )
    # Symbols are known by their names, whatever was assumed of them.
    plain = {s: sympy.Symbol(s.name) for s in formula.free_symbols}
    return models.Expression(formula.xreplace(plain), sympy.Symbol(symbol.name))


def _equal(a: Any, b: Any) -> bool:
    """Whether two expressions are the same: exactly if rational, else to 40 digits."""
    if (a - b).is_Rational:
        return bool(a == b)
    with own_context(_COMPARED) as context:
        ops = MpmathOps(context)
        for values in sampled_parameters(a.free_symbols | b.free_symbols, 3):
            numbers = {s: ops.rational(Fraction(int(x.p), int(x.q))) for s, x in values.items()}
            try:
                one, other = (evaluate_tree(e, dict(numbers), ops) for e in (a, b))
            except (ArithmeticError, ValueError):
                return False
            if not abs(one - other) <= max(abs(one), abs(other)) * context.mpf(10) ** -40:
                return False
    return True


def parse(name: str, given: sympy.Expr | Number, names: dict[str, Any] | None = None) -> Any:
    """A SymPy expression from what a caller wrote, floats and decimals exact.

    Parameters
    ----------
    name : str
        How messages call the argument.
    given : SymPy expression, number or str
    names : dict
        What these names mean in a string.
    """
    if isinstance(given, str):
        expression = grammar.read(name, given, names)
    elif isinstance(given, Fraction):
        expression = _rational(given)
    else:
        try:
            expression = sympified(given)
        except (sympy.SympifyError, TypeError):
            expression = None
    # Lists, truth values and relations are read by SymPy, too.
    if not isinstance(expression, sympy.Expr):
        raise InputError(
            f"{name} is {shown(given)}; give a SymPy expression, a number or a string."
        )
    return exactly(expression, name)


def expect_algebra(*expressions: sympy.Expr, searched: bool = False) -> None:
    """Raise TimeLimitError where SymPy would surely take longer than is left: for the operations of
    the expressions or, where a limit or zeros are `searched`, for functions in each other."""
    operations = sum(map(sympy.count_ops, expressions))
    expect(operations**2 * _SECONDS, f"SymPy's work on {operations:,} operations")
    inside = max(map(grammar.functions_inside, expressions))
    if searched and inside > _INSIDE:
        expect(3.0 ** (inside - _INSIDE), f"SymPy's work on {inside} functions in each other")


def polynomial_of(expression: sympy.Expr, x: sympy.Symbol) -> Any:
    """The expression as a polynomial in x over its coefficients; PolynomialError where it is none.

    Products and powers are those of polynomials: SymPy would multiply out term by term.
    """
    if expression.is_Mul or expression.is_Add:
        parts = [polynomial_of(e, x) for e in expression.args]
        total = parts[0]
        for part in parts[1:]:
            total = total * part if expression.is_Mul else total + part
        return total
    if expression.is_Pow and expression.exp.is_Integer and expression.exp > 0:
        return polynomial_of(expression.base, x) ** int(expression.exp)
    return sympy.Poly(expression, x)


def quotient_parts(expression: sympy.Expr, x: sympy.Symbol) -> tuple[Any, Any]:
    """Numerator and denominator of an expression in x, in lowest terms where it is rational."""
    try:
        quotient = quotient_of(expression, x)
        return quotient.numer.as_expr(), quotient.denom.as_expr()
    except (NotRational, InputError, ZeroDivisionError):
        pass
    inside = grammar.fractions_inside(expression)
    expect(3.0 ** (inside - _FRACTIONS), f"SymPy's work on {inside} fractions in each other")
    parts: tuple[Any, Any] = sympy.fraction(sympy.together(expression))
    return parts


class _QuotientOps(FractionOps):
    """Quotients of polynomials in x over the rationals, in lowest terms."""

    def __init__(self, field: Any) -> None:
        self.field = field

    def rational(self, value: Fraction) -> Any:
        return self.field.ground_new(sympy.QQ(value.numerator, value.denominator))


def quotient_of(expression: sympy.Expr, x: sympy.Symbol) -> Any:
    """The element of QQ(x) that the expression is; NotRational or InputError where it is none."""
    step()
    if expression.free_symbols - {x}:
        raise NotRational
    field = sympy.QQ.frac_field(x).field
    return evaluate_tree(expression, {x: field.gens[0]}, _QuotientOps(field))


def sympified(given: Any) -> Any:
    """What SymPy makes of a number or an object of its own; SympifyError for anything else.

    SymPy runs the texts in a list or tuple, also where it is told to be strict.
    """
    if isinstance(given, np.ndarray) and not given.shape:
        given = given[()]
    own = isinstance(given, (sympy.Basic, sympy.MatrixBase))
    if not own and (isinstance(given, (str, bytes)) or hasattr(type(given), "__iter__")):
        raise sympy.SympifyError(type(given))
    return sympy.sympify(given, strict=True)


def exactly(expression: sympy.Expr, name: str = "A") -> Any:
    """Every float replaced by its exact binary value; numbers beyond the domain are refused."""
    for x in expression.atoms(sympy.Rational):
        exact(f"a number of {name}", x)
    floats = {f: _rational(exact(name, f)) for f in expression.atoms(sympy.Float)}
    return expression.xreplace(floats)


def _rational(value: Fraction) -> Any:
    """A Fraction as SymPy's."""
    return sympy.Rational(value.numerator, value.denominator)


def _symbol(formula: sympy.Expr, u: sympy.Symbol | str | None) -> Any:
    """The variable of A: as named by the caller, else u, else the only symbol there is."""
    if u is not None:
        symbol = sympy.Symbol(u) if is_name(u) else u
        if not isinstance(symbol, sympy.Symbol):
            raise InputError(f"u is {shown(u)}; give the SymPy Symbol or the name of A's variable.")
        return symbol
    named = [s for s in formula.free_symbols if s.name == "u"]
    if named:
        return named[0]
    if len(formula.free_symbols) == 1:
        raise InputError(
            f"A = {formula} has no symbol u; name its variable, as in "
            f"sa.Drift({shown(str(formula))}, '{next(iter(formula.free_symbols))}')."
        )
    return sympy.Symbol("u")


def check_regular(model: models.Expression, values: dict[str, Fraction]) -> None:
    """Refuse an A that is singular or complex on [-1, 1], by its range over complex boxes.

    A box on which the range stays unbounded however small it is made holds a singularity (or one
    that cancels, which the formula should be freed of).
    """
    with precision(4 * _DEEPEST):
        phi = evaluate.profile(model, {k: evaluate.rational(x) for k, x in values.items()})
        pending = [] if isinstance(phi, evaluate.Polynomial) else [(fmpq(-1), fmpq(1), 0)]
        for looked_at in count():
            if not pending:
                break
            low, high, depth = pending.pop()
            middle = (low + high) / 2
            # Boxes overlap, so that together they cover a neighbourhood of [-1, 1].
            size = (high - low) * _OVERLAP
            if phi(evaluate.box(middle, size, size)).is_finite():
                continue
            if depth == _DEEPEST or looked_at > _MOST_BOXES:
                raise InputError(
                    f"A = {model.formula} is singular, complex or too steep to tell near u = "
                    f"{float(low):.6g}; give an A that is real and smooth on [-1, 1]."
                )
            pending += [(middle, high, depth + 1), (low, middle, depth + 1)]


def phi(A: sympy.Expr) -> Any:
    """phi as a Piecewise in the real symbol u (eq:phi)."""
    u = sympy.Symbol("u", real=True)
    return sympy.Piecewise((A.subs(u, -1), u <= -1), (A, u < 1), (A.subs(u, 1), True))


def potential(A: sympy.Expr) -> Any:
    """V as a Piecewise in the real symbol u (eq:V2)."""
    u = sympy.Symbol("u", real=True)
    taken = {s.name for s in A.free_symbols}
    # No parameter's name.
    name = next(name for name in (k * "v" for k in count(1)) if name not in taken)
    v = sympy.Symbol(name, real=True)
    inside = _integral(A.subs(u, v), v, u)
    top = _integral(A.subs(u, v), v, sympy.Integer(1))
    return sympy.Piecewise(
        (-A.subs(u, -1) * (u + 1), u <= -1),
        (-inside, u < 1),
        (-top - A.subs(u, 1) * (u - 1), True),
    )


def _integral(A: sympy.Expr, v: sympy.Symbol, upper: sympy.Expr) -> Any:
    """The integral of A over (v, upper), in closed form where SymPy has one."""
    antiderivative = sympy.integrate(A, v)
    if antiderivative.has(sympy.Integral, sympy.Piecewise):
        return sympy.Integral(A, (v, -1, upper))
    return sympy.expand(antiderivative.subs(v, upper) - antiderivative.subs(v, -1))
