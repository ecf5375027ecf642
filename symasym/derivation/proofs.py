"""Deciding: a point where two expressions differ, an exact zero, a sign."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from typing import Any

import sympy

from symasym.base.call_context import own_context
from symasym.derivation.numerical import evaluate

_DIGITS = 30
_TRIES = 3
# Two values that agree to this are not taken as equal, only as not distinguished.
_TOLERANCE = sympy.Float(10) ** -18


def random_value(
    symbol: sympy.Symbol, rng: random.Random, inside: Sequence[sympy.Expr] | None = None
) -> Any:
    """A random rational that the assumptions of `symbol` allow, inside a range if one is given."""
    if symbol.is_integer:
        return sympy.Integer(rng.randint(2, 7))
    size = sympy.Rational(rng.randint(150, 2900), 997)
    if inside is not None:
        low, high = sympy.sympify(inside[0]), sympy.sympify(inside[1])
        return low + (high - low) * sympy.Rational(rng.randint(1, 996), 997)
    if symbol.is_positive:
        return size
    if symbol.is_negative:
        return -size
    return size * rng.choice((-1, 1))


def concrete(expressions: list[Any], rng: random.Random) -> list[Any]:
    """The expressions with every undefined function replaced by one random polynomial."""
    functions = sorted(
        {f.func for e in expressions for f in e.atoms(sympy.core.function.AppliedUndef)}, key=str
    )
    for function in functions:
        numbers = [sympy.Rational(rng.randint(-40, 40), 37) for _ in range(9)]

        def polynomial(*arguments: sympy.Expr, numbers: list[Any] = numbers) -> Any:
            """A polynomial of degree 3 in each argument, with a product of all."""
            total = numbers[0]
            for index, argument in enumerate(arguments):
                total += sum(numbers[(index * 4 + k) % 8 + 1] * argument**k for k in range(1, 4))
            if len(arguments) > 1:
                total += numbers[8] * sympy.prod(arguments)
            return total

        expressions = [e.replace(function, polynomial) for e in expressions]
    if functions:
        expressions = [e.doit(deep=True, integrals=False) for e in expressions]
    return expressions


def difference_at(
    left: sympy.Expr, right: sympy.Expr, rng: random.Random, inside: dict[Any, Any]
) -> tuple[str, str, str] | None:
    """Both sides and a point where they differ, as texts; None if `_TRIES` points show none."""
    if _nested(left) or _nested(right):
        return None
    for _ in range(_TRIES):
        a, b = concrete([sympy.sympify(left), sympy.sympify(right)], rng)
        point = {
            s: random_value(s, rng, inside.get(s))
            for s in sorted(a.free_symbols | b.free_symbols, key=str)
        }
        values = [_number(side, point) for side in (a, b)]
        if any(value is None for value in values):
            continue
        size = max(abs(values[0]), abs(values[1]), sympy.Float("1e-3"))
        # Quadrature on fixed nodes: only a gross difference counts.
        rough = any(side.has(sympy.Integral) for side in (a, b))
        if abs(values[0] - values[1]) > (sympy.Float("1e-3") if rough else _TOLERANCE) * size:
            shown = ", ".join(f"{s} = {value}" for s, value in point.items()) or "everywhere"
            return str(sympy.N(values[0], 12)), str(sympy.N(values[1], 12)), shown
    return None


def _nested(expression: sympy.Expr) -> bool:
    """True for integrals of integrals, whose evaluation by SymPy takes minutes."""
    return any(
        len(node.limits) > 1 or node.function.has(sympy.Integral)
        for node in sympy.sympify(expression).atoms(sympy.Integral)
    )


def _number(expression: sympy.Expr, point: dict[Any, Any]) -> Any:
    """The value at a point to 30 digits; None where there is no finite one."""
    try:
        if expression.has(sympy.Integral):
            return _by_quadrature(expression, point)
        value = sympy.N(expression.subs(point), _DIGITS)
    except (ValueError, TypeError, ZeroDivisionError, NotImplementedError):
        return None
    return value if value.is_number and value.is_finite else None


def _together(e: sympy.Expr) -> Any:
    """The numerator over a common denominator, expanded."""
    return sympy.expand(sympy.numer(sympy.together(e)))


def _by_quadrature(expression: sympy.Expr, point: dict[Any, Any]) -> Any:
    """The value at a point of an expression with integrals, to 20 digits."""
    with own_context(20) as ctx:
        values = {s: ctx.mpf(int(v.p)) / int(v.q) for s, v in point.items()}
        return sympy.Float(evaluate(expression, values, ctx), 20)


_WAYS: list[tuple[str, Callable[[Any], Any]]] = [
    ("as it stands", lambda e: e),
    ("expand", sympy.expand),
    ("derivatives taken, expand", lambda e: sympy.expand(e.doit(integrals=False))),
    ("common denominator", _together),
    ("powsimp", lambda e: sympy.powsimp(sympy.expand(e.doit(integrals=False)))),
    ("powers, common denominator", lambda e: sympy.powsimp(_together(sympy.powsimp(e)))),
    ("simplify", sympy.simplify),
    ("exponentials, simplify", lambda e: sympy.simplify(e.rewrite(sympy.exp))),
]


def quick_zero(expression: sympy.Expr) -> str | None:
    """As `zero_by`, with the ways that cost next to nothing."""
    for name, way in _WAYS[:3]:
        if way(sympy.sympify(expression)) == 0:
            return name
    return None


def zero_by(expression: sympy.Expr) -> str | None:
    """The name of the way by which `expression` was brought to an exact 0, or None."""
    # Simplifying an integral of integrals takes minutes and finds nothing that expanding misses.
    for name, way in _WAYS[:3] if _nested(expression) else _WAYS:
        if way(sympy.sympify(expression)) == 0:
            return name
    return None


def sign_by(expression: sympy.Expr, strict: bool) -> str | None:
    """The reason for which `expression` is >= 0 (> 0 if `strict`) by its form, or None."""
    forms = (
        ("as it stands", lambda e: e),
        ("factored", sympy.factor),
        ("expanded", sympy.expand),
        ("common denominator", lambda e: sympy.factor(sympy.together(e))),
    )
    for name, way in forms:
        form = way(expression)
        if form.is_positive if strict else form.is_nonnegative:
            return f"{'positive' if strict else 'not negative'} by its form ({name})"
        if _manifest(form, strict):
            return f"{'positive' if strict else 'not negative'} by its form ({name})"
    return None


def _manifest(form: sympy.Expr, strict: bool) -> bool:
    """exp(x) - 1, 1 - exp(-x) for x > 0, which SymPy leaves undecided; products, sums of such."""
    if form.is_Mul:
        return all(_manifest(x, True) or (x.is_nonnegative and not strict) for x in form.args)
    if form.is_Add:
        for term in form.args:
            rest = form - term
            if isinstance(term, sympy.exp) and rest == -1:
                return bool(term.args[0].is_positive)
            if isinstance(-term, sympy.exp) and rest == 1:
                return bool((-term).args[0].is_negative)
        return all(_manifest(term, strict) for term in form.args)
    return bool(form.is_positive)
