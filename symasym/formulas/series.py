"""Weak and strong noise over SymPy: the texts of `symasym.expansions` on a drift in one case.

Weak noise (`symasym.expansions.weak`): T is a quotient of two sums of exponentials c e^{lam h}, the
products of a critical point of e^{-lam V} with one of e^{lam V}.

Strong noise (`symasym.expansions.strong_noise`): the moments of V are symbols for polynomials in
the drift's parameters. Outside the layer all is closed form, of (e^x - 1)/x and (e^x - 1 - x)/x^2,
which stand as functions.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from functools import reduce
from operator import mul
from typing import Any, NamedTuple

import sympy
from sympy import Expr, Poly, S

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.expansions import weak as theorem
from symasym.expansions.sides import Stretch, quantity, straight
from symasym.expansions.strong_noise import Moments, layer
from symasym.formulas.cases import Case, U
from symasym.formulas.letters import (
    IN_KAPPA,
    KAPPA,
    LAM,
    Field,
    Letters,
    Pair,
    R,
    Terms,
    exponentials,
    put_in,
)  # fmt: skip
from symasym.series.power_series import Series


class Contribution(NamedTuple):
    """One product of a critical point of e^{-lam V} with one of e^{lam V}.

    It adds weight * front * e^{exponent} (c_0 + c_1 kappa^2 + c_2 kappa^4 + ...) to T. `pair` are
    the points, as ``("well u1", "barrier u2")``, `coefficients` c_0 = 1, c_1, ..., `weight` is
    ``"1 - C"`` right of the start, ``"C"`` left of it, ``"C (1 - C)"`` of a start on a well.
    """

    pair: tuple[str, ...]
    exponent: Expr
    front: Expr
    coefficients: tuple[Expr, ...]
    weight: str

    @property
    def expression(self) -> Expr:
        """The contribution without its weight."""
        series = sympy.Add(*(c * KAPPA ** (2 * n) for n, c in enumerate(self.coefficients)))
        return self.front * sympy.exp(self.exponent) * series


def weak(drift: Drift, quantity: str, order: int, start: Fraction, case: Case) -> dict[str, Any]:
    """The formula, what its symbols are, and where it holds."""
    of = (Field if drift.model.plain and drift != Drift.general() else Pair)(drift, case, start)
    terms, at, where = list[Contribution](), Terms(of.start), [*conditions(of, quantity)]
    if not of.A.has(U) and quantity[-1] != "P" and not start:
        # In the mirror both ends change places.
        half = (-of.A if quantity == "1 - C" else of.A) * R / KAPPA**2
        value = R * sympy.tanh(half) / of.A if quantity == "T" else 1 / (1 + sympy.exp(2 * half))
        return {"case": case, "conditions": where, "formula": value}
    points = theorem.points_of(of, order + 1, Letters)
    if of.pair:
        row = [theorem.Sums([p], 1 if p.tops(1) else -1, at).whole[0] for p in points]
        points.sort(key=lambda p: p.tops(1))
        weight = "C" if case.kinds[0] == "barrier" else "1 - C"
        terms = [*_contributions([(weight, tuple(points), mul(*row))], at, order)]
        formula = terms[0].expression
        if of.values.keys() >= {*of.zeros}:
            height, value = (put_in(e, of.values) for e in (terms[0].exponent, formula))
            front = sympy.simplify(value / sympy.exp(height))
            formula = sympy.exp(sympy.factor_terms(sympy.expand(height))) * front
            where = [sympy.simplify(put_in(c, of.values)) for c in where]
    elif quantity == "T":
        regular = of.regular(order + 1)
        formula = theorem.escape_time(points, regular, at)
        terms = [*_contributions(_products(points, regular, at), at, order)]
    elif quantity[-1] == "C":
        formula = theorem.exit_probability(points, at, quantity != "C")
    else:
        formula = theorem.outside_layer(points[1:-1], (of.slopes[-1], of.slopes[1]), at)
        formula = formula.xreplace({abs(a): -side * a for side, a in of.slopes.items()})  # sliding
        formula = 1 - formula if quantity == "P" else formula
    known = {**at.known, **of.values, **IN_KAPPA}
    return {"case": case, "conditions": where, "formula": formula, "terms": tuple(terms),
            "definitions": known, "equations": of.equations}  # fmt: skip


_Product = tuple[str, tuple[theorem.Point, ...], Any]


def _products(points: list[theorem.Point], regular: Any, at: Terms) -> list[_Product]:
    """Those of T's critical points, a start on a well with all others."""
    of, start = theorem.shares(points, regular, at), points[theorem.start_of(points)]
    sides = zip(("C", "1 - C"), of.sides, strict=True)
    found = [(weight, *part) for weight, side in sides for part in side if part[0]]
    if of.own != 0:
        whole = zip(points, theorem.Sums(points, 1, at).whole, strict=True)
        found += [("C (1 - C)", (start, p), of.own * s) for p, s in whole if s != 0]
    return found


def _contributions(found: list[_Product], at: Terms, order: int) -> Iterator[Contribution]:
    """Products as exponentials with exact coefficients."""
    for weight, pair, value in found:
        ((height, c),) = exponentials(value).items()
        series = [at.rows.get(f, (f, [S.One])) for f in sympy.Mul.make_args(c)]
        front = sympy.Mul(LAM, *(first * row[0] for first, row in series))
        rows = ([sympy.expand(a / row[0]) for a in row] for _, row in series)
        whole = reduce(mul, (Series([*row, *[S.Zero] * order][: order + 1]) for row in rows))
        yield Contribution(
            tuple(f"{p.name} {'' if str(p.u)[0] == 'u' else 'u = '}{p.u}" for p in pair),
            (LAM * height).xreplace(IN_KAPPA),
            sympy.powdenest(front.xreplace(IN_KAPPA), force=True),
            tuple(sympy.expand(a / 2**n) for n, a in enumerate(whole.c)), weight,
        )  # fmt: skip


def ends(of: Field, quantity: str) -> list[Any]:
    """The conditions on the radius and the ends."""
    low, high = of.at(-S.One), of.at(S.One)
    if quantity[-1] == "P":
        return [sympy.Gt(low, 0), sympy.Lt(high, 0)]
    return [sympy.Gt(R, 1), sympy.Ne(low, 0), sympy.Ne(high, 0)]


def conditions(of: Field, quantity: str) -> Iterator[Any]:
    """Where the formula holds, as predicates."""
    inside = [u for u, _ in of.places if u in of.zeros or u == of.start and abs(u) < 1]
    edges = ([-S.One], [S.One]) if of.layered else ([], [])
    yield from (a < b for a, b in itertools.pairwise([*edges[0], *inside, *edges[1]]))
    yield from (sympy.Eq(of.A.subs(U, u), 0) for u in of.zeros if not (of.pair and u in of.values))
    if of.pair:
        well, barrier = sorted(of.zeros, key=lambda u: of.kinds[u] == "barrier")
        yield of.height(barrier) > of.height(well)
        return
    yield from ends(of, quantity)
    if of.poly is not None and of.poly.degree():
        yield sympy.Ne(of.poly.LC(), 0)
    if kind := of.case.at_start:
        slope = of.slope.subs(U, of.start)
        yield sympy.Gt(slope, 0) if kind == "barrier" else sympy.Lt(slope, 0)
    elif abs(of.start) < 1:
        yield sympy.Ne(of.at(of.start), 0)


class exprel(sympy.Function):  # type: ignore[misc]
    """(e^x - 1)/x."""

    at_zero, is_positive = S.One, True

    @classmethod
    def eval(cls, x: Expr) -> Expr | None:
        return cls.at_zero if x.is_zero else None


class exprel2(exprel):
    """(e^x - 1 - x)/x^2."""

    at_zero = S.Half


def written_out(e: Expr) -> Expr:
    """The expression without these functions."""
    e = e.replace(exprel2, lambda x: (sympy.exp(x) - 1 - x) / x**2)
    return e.replace(exprel, lambda x: (sympy.exp(x) - 1) / x)


class _Ring:
    """Expressions at lam."""

    number = staticmethod(sympy.sympify)
    exp = staticmethod(lambda growth: sympy.exp(growth * LAM))
    exprel = staticmethod(lambda growth, n: (exprel, exprel2)[n - 1](growth * LAM))
    total = staticmethod(lambda row: sympy.Add(*(c * LAM**k for k, c in enumerate(row))))


def _layer(of: Field, order: int, side: int, b: Any, mark: str) -> Stretch:
    """The layer from -1 to b, in the mirror for side -1: f_0 = 1 or u + 1, f_k = int A f_(k-1)."""

    def primitive(f: Any) -> Any:
        whole = f.integrate(U)
        return whole - whole.eval(-1)

    A, rows = Poly(side * of.A.subs(U, side * U), U).to_field(), []
    for f in (A * 0 + 1, Poly(U + 1, U)):
        row = [f]
        for _ in range(max(order, 1)):
            row.append(primitive(A * row[-1]))
        rows += [[S(f.eval(b)) for f in row], [S(primitive(f).eval(b)) for f in row]]
    known = (
        [of.named(f"{letter}{k}{mark}", c) for k, c in enumerate(rows[n][: order + 1])]
        for n, letter in ((2, "n"), (1, "f"), (3, "m"))
    )
    return layer(Moments(of.named(f"d{mark}", rows[0][1]), *known), _Ring())


def strong(drift: Drift, name: str, order: int, start: Fraction) -> dict[str, Any]:
    """The formula in lam, r and the moments, what these are, and where it holds."""
    case, ring, sides = Case(("start",)), _Ring(), list[Stretch]()
    of = Field(drift, case, start)
    if of.poly is None:
        raise InputError(
            f"A = {of.A} is no polynomial in u, so that the moments of V have no closed form; "
            "sa.escape_time(method='strong_noise') and its like take numbers."
        )
    for side, letter, mark in ((1, "L", "-"), (-1, "R", "+")) if name[-1] != "P" else ():
        x, whole = side * of.start, straight(side * of.slopes[-side], R - 1, ring)
        whole = _layer(of, order, side, x, mark).then(whole) if x > -1 else whole
        scale, nested = of.named(letter, whole.scale), of.named(f"w{mark}", whole.nested)
        sides.append(Stretch(scale, S.Zero, nested, S.One))
    slopes = of.slopes[-1], of.slopes[1]
    formula = quantity(name, sides or [_layer(of, order, 1, S.One, "")], slopes, LAM)
    known = {**of.values, **IN_KAPPA}
    return {"case": case, "formula": formula, "definitions": known, "conditions": ends(of, name)}
