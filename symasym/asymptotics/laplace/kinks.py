"""The integral cut at its kinks, where f or g is only piecewise smooth.

Kinks are the zeros of what stands in Abs, sign and Heaviside, the crossings of the arguments of Max
and Min, and the ends of a Piecewise's conditions. Between two of them every such function is one of
its branches, and Laplace's method takes each kink as an endpoint on either side (DLMF 2.3(iii)).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import sympy

from symasym.base.call_context import own_context, step
from symasym.base.errors import InputError
from symasym.drift.expressions import expect_algebra
from symasym.numbers.trees import MpmathOps, evaluate_tree
from symasym.series.coefficient_fields import sampled_parameters

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol

    #: An exact number, or a rounded one.
    Real: TypeAlias = Expr | mpf

#: Digits at which f is compared with itself at another point.
WORK = 60


@dataclass(frozen=True)
class Piece:
    """f and g on (lo, hi), where both are smooth."""

    lo: Expr
    hi: Expr
    f: Expr
    g: Expr


def number(
    expression: Real | int, values: dict[Symbol, Expr] | None = None, dps: int = WORK
) -> mpf:
    """An expression without free symbols as a real mpf (±inf allowed), nan if it isn't real."""
    with own_context(dps) as context:
        if hasattr(expression, "_mpf_") and not isinstance(expression, sympy.Basic):
            return context.make_mpf(expression._mpf_)
        expression = sympy.sympify(expression)
        if values:
            expression = expression.xreplace(values)
        if expression in (sympy.oo, -sympy.oo):
            return context.inf if expression == sympy.oo else -context.inf
        try:
            value = evaluate_tree(expression, {}, MpmathOps(context))
        except ZeroDivisionError:
            return context.nan
        except InputError:
            # Abs, Piecewise and the like are SymPy's.
            value = sympy.N(expression, dps)
            if not (value.is_real and value.is_finite):
                return context.nan
            return context.make_mpf(value._to_mpmath(context.prec)._mpf_)
        return value if hasattr(value, "_mpf_") else context.nan


def difference(first: mpf, second: mpf) -> mpf:
    """first - second of two mpf, at `WORK` digits whatever contexts they come from."""
    with own_context(WORK) as context:
        return context.make_mpf(first._mpf_) - context.make_mpf(second._mpf_)


def at(expression: Expr, x: Symbol, point: Real) -> mpf:
    """The expression at a number, an mpf; nan where it's singular or complex."""
    with own_context(WORK) as context:
        try:
            value = evaluate_tree(expression, {x: number(point)}, MpmathOps(context))
        except (ZeroDivisionError, OverflowError, ValueError):
            return context.nan
        return value if hasattr(value, "_mpf_") else context.nan


def cut(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Piece]:
    """[a, b] cut at the zeros of every Abs and Heaviside, and at the conditions of Piecewise."""
    kinks = sorted(_kinks(f, x) | _kinks(g, x), key=str)
    free = set().union(*(e.free_symbols for e in (a, b, *kinks)))
    samples = sampled_parameters(free)
    kept = []
    for kink in kinks:
        sides = {bool(number(a, v) < number(kink, v) < number(b, v)) for v in samples}
        if len(sides) > 1:
            raise InputError(
                f"whether the kink at {x} = {kink} lies inside ({a}, {b}) depends on the "
                "parameters; give symbols with assumptions, or numbers."
            )
        if sides == {True}:
            kept.append(kink)
    orders = {tuple(sorted(kept, key=lambda kink: number(kink, v))) for v in samples}
    if len(orders) > 1:
        raise InputError(
            f"the order of the kinks {', '.join(map(str, kept))} depends on the parameters; give "
            "numbers."
        )
    ends = [a, *orders.pop(), b]
    pieces = []
    for lo, hi in zip(ends, ends[1:], strict=False):
        middle = _between(lo, hi)
        pieces.append(Piece(lo, hi, *(_smooth(e, x, middle, samples) for e in (f, g))))
    return pieces


def _between(lo: Expr, hi: Expr) -> Expr:
    """A point inside (lo, hi)."""
    if lo.is_infinite and hi.is_infinite:
        return sympy.Rational(1, 7)
    if lo.is_infinite:
        return hi - 1
    if hi.is_infinite:
        return lo + 1
    # Off the middle, where a Piecewise's own special values like to be.
    return lo + (hi - lo) * sympy.Rational(4, 9)


def _kinks(expression: Expr, x: Symbol) -> set[Expr]:
    """The kinks of an expression: zeros and crossings of arguments, ends of conditions."""
    kinks: set[Expr] = set()

    def nodes(within: Expr, *kinds: Any) -> list[Any]:
        """Its parts of these kinds, always in the same order."""
        return sorted(within.atoms(*kinds), key=str)

    for node in nodes(expression, sympy.Abs, sympy.sign, sympy.Heaviside):
        kinks |= _zeros(node.args[0], x)
    for node in nodes(expression, sympy.Max, sympy.Min):
        for i, first in enumerate(node.args):
            for second in node.args[i + 1 :]:
                kinks |= _zeros(first - second, x)
    for node in nodes(expression, sympy.Piecewise):
        for _, condition in node.args:
            for relation in nodes(sympy.sympify(condition), sympy.core.relational.Relational):
                kinks |= _zeros(relation.lhs - relation.rhs, x)
    return kinks


def _zeros(expression: Expr, x: Symbol) -> set[Expr]:
    """The zeros of an argument that are not known to be complex."""
    if not expression.has(x):
        return set()
    expect_algebra(expression, searched=True)
    try:
        roots = sympy.solve(expression, x)
    except NotImplementedError:
        raise InputError(
            f"the zeros of {expression}, where the integrand has a kink, were not found; split "
            "the integral there yourself."
        ) from None
    return {root for root in roots if root.is_real is not False}


def _smooth(expression: Expr, x: Symbol, middle: Expr, samples: list[dict[Symbol, Expr]]) -> Expr:
    """The branch of every kinked function that holds around `middle`."""

    def sign(node: Expr) -> int:
        """The sign of an argument at `middle`, which must be that of all samples."""
        signs = set()
        for values in samples:
            value = number(node.xreplace({x: middle}), values | _missing(node, values, x))
            signs.add(int(value > 0) - int(value < 0))
        if len(signs) != 1:
            raise InputError(
                f"the sign of {node} depends on the parameters; give symbols with assumptions."
            )
        return signs.pop()

    while True:
        step()
        nodes = expression.atoms(
            sympy.Abs, sympy.sign, sympy.Heaviside, sympy.Max, sympy.Min, sympy.Piecewise
        )
        nodes = {node for node in nodes if node.has(x)}
        if not nodes:
            return expression
        inner = min(nodes, key=lambda node: (sympy.count_ops(node), str(node)))
        expression = expression.xreplace({inner: _branch(inner, x, middle, sign)})


def _missing(node: Expr, values: dict[Symbol, Expr], x: Symbol) -> dict[Symbol, Expr]:
    """Values of the parameters of a node that a sample leaves open."""
    rest = node.free_symbols - set(values) - {x}
    return sampled_parameters(rest, 1)[0] if rest else {}


def _branch(node: Expr, x: Symbol, middle: Expr, sign: Callable[[Expr], int]) -> Expr:
    """The branch of one kinked function that holds at `middle`."""
    if isinstance(node, sympy.Abs):
        return sign(node.args[0]) * node.args[0]
    if isinstance(node, sympy.sign):
        return sympy.Integer(sign(node.args[0]))
    if isinstance(node, sympy.Heaviside):
        return sympy.Integer(sign(node.args[0]) > 0)
    if isinstance(node, (sympy.Max, sympy.Min)):
        best, flip = node.args[0], 1 if isinstance(node, sympy.Max) else -1
        for other in node.args[1:]:
            if flip * sign(other - best) > 0:
                best = other
        return best
    for value, condition in node.args:
        holds = sympy.sympify(condition).xreplace({x: middle})
        if holds.free_symbols:
            holds = holds.xreplace(sampled_parameters(holds.free_symbols, 1)[0])
        if bool(holds):
            return value
    raise InputError(f"{node} has no branch at {x} = {middle}; make the last condition True.")
