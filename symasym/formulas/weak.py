"""Weak noise over SymPy: `symasym.expansions.weak` run on a drift in one case, and where it holds."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, S, Symbol

from symasym.drift.drift import Drift
from symasym.expansions import weak as theorem
from symasym.formulas.cases import Case
from symasym.formulas.letters import IN_KAPPA, KAPPA, LAM, Field, Letters, R, Terms, U
from symasym.formulas.products import contributions

_Y = Symbol("y", real=True)


def weak(drift: Drift, quantity: str, order: int, start: Fraction, case: Case) -> dict[str, Any]:
    """The formula, what its symbols are, and where it holds."""
    of, at = Field(drift, case, start), Terms(start)
    found: dict[str, Any] = {"case": case, "conditions": list(conditions(of, quantity))}
    if not of.A.has(U) and quantity[-1] in "TC" and not start:
        return found | {"formula": _of_constant(of.A, quantity)}
    points = theorem.points_of(of, order + 1, Letters)
    if quantity == "T":
        regular = of.regular(order + 1)
        found["formula"] = theorem.escape_time(points, regular, at)
        found["terms"] = tuple(contributions(points, regular, at, order))
        if of.general:
            pairs = [t for t in found["terms"] if t.pair[0][:4] + t.pair[1][:7] == "wellbarrier"]
            return found | {"formula": pairs[0].expression, "terms": tuple(pairs)}
    elif quantity[-1] == "C":
        found["formula"] = theorem.exit_probability(points, at, quantity != "C")
    elif quantity == "density":
        whole = at.named("S", theorem.Sums(points[1:-1], -1, at).total())
        found["formula"] = sympy.exp(-LAM * of.height(_Y)) / whole
    else:
        formula = theorem.outside_layer(points[1:-1], (of.slopes[-1], of.slopes[1]), at)
        # The drift points to the layer.
        formula = formula.xreplace({abs(a): -side * a for side, a in of.slopes.items()})
        found["formula"] = 1 - formula if quantity == "P" else formula
    known = {**at.known, **of.values, **IN_KAPPA}
    return found | {"definitions": known, "equations": of.equations, "integrals": of.integrals}


def _of_constant(a: Expr, quantity: str) -> Expr:
    """T = (r/a) tanh(a r/kappa^2), C = 1/(1 + e^{2 a r/kappa^2}), in the mirror -a."""
    half = a * R / KAPPA**2
    if quantity == "T":
        return R / a * sympy.tanh(half)
    return 1 / (1 + sympy.exp(2 * half if quantity == "C" else -2 * half))


def ends(of: Field, quantity: str) -> Iterator[Any]:
    """The conditions on the radius and the ends."""
    low, high = of.at(-S.One), of.at(S.One)
    if quantity[-1] in "TC":
        yield from (R > max(S.One, abs(of.start)), sympy.Ne(low, 0), sympy.Ne(high, 0))
    else:
        yield from (sympy.Gt(low, 0), sympy.Lt(high, 0))


def conditions(of: Field, quantity: str) -> Iterator[Any]:
    """Where the formula holds, as predicates."""
    inside = [u for u, _ in of.places if u in of.zeros or u == of.start and abs(u) < 1]
    yield from (a < b for a, b in itertools.pairwise([-S.One, *inside, S.One]))
    yield from (sympy.Eq(of.A.subs(U, u), 0) for u in of.zeros)
    if of.general:
        well, barrier = sorted(of.zeros, key=lambda u: of.kind(u) == "barrier")
        yield of.height(barrier) > of.height(well)
        return
    yield from ends(of, quantity)
    if of.poly is not None and of.poly.degree():
        yield sympy.Ne(of.poly.LC(), 0)
    if kind := of.case.at_start:
        slope = sympy.diff(of.A, U).subs(U, of.start)
        yield sympy.Gt(slope, 0) if kind == "barrier" else sympy.Lt(slope, 0)
    elif abs(of.start) < 1:
        yield sympy.Ne(of.A.subs(U, of.start), 0)
