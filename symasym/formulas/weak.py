"""Weak noise over SymPy: `symasym.expansions.weak` on a drift in one case, and what leads in T.

T is a quotient of two sums of exponentials c e^{lam h}, the products of a critical point of
e^{-lam V} with one of e^{lam V}. As kappa -> 0 its leading term is the quotient of those with the
largest h, which depends on the parameters and on r.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from fractions import Fraction
from typing import Any, NamedTuple

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.expansions import expanded
from symasym.expansions import weak as theorem
from symasym.formulas import letters
from symasym.formulas.cases import Case, U, found_cases
from symasym.formulas.letters import BEYOND, IN_KAPPA, KAPPA, LAM, Field, Letters, Pair, R, Terms, X
from symasym.formulas.numbers import numbers_of

_LOG = Symbol("log(lam)", positive=True)
# Heights as near to each other as this are equal.
_SAME = 1e-10


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


class Leading(NamedTuple):
    """The term of T that is exponentially larger than the others, and where it is."""

    expression: Expr
    conditions: tuple[Any, ...]


def weak(drift: Drift, quantity: str, order: int, start: Fraction, case: Case) -> dict[str, Any]:
    """The formula, what its symbols are, and where it holds."""
    of = (Field if drift.model.plain else Pair)(drift, case, start)
    terms = tuple[Contribution, ...]()
    at = Terms(of.start)
    found: dict[str, Any] = {"case": case, "conditions": [*conditions(of, quantity)]}
    if not of.pair and not of.A.has(U) and quantity[-1] != "P" and not start:
        # In the mirror both ends change places.
        half = (-of.A if quantity == "1 - C" else of.A) * R / KAPPA**2
        value = R * sympy.tanh(half) / of.A if quantity == "T" else 1 / (1 + sympy.exp(2 * half))
        return found | {"formula": value}
    points = theorem.points_of(of, order + 1, Letters)
    if of.pair:
        sums = (theorem.Sums(points, sign, at).whole for sign in (-1, 1))
        places = [next(p for p in points if p.name == name) for name in ("well", "barrier")]
        m, s = (whole[points.index(p)] for whole, p in zip(sums, places, strict=True))
        weight = "C" if case.kinds[0] == "barrier" else "1 - C"
        terms = tuple(_contributions([(weight, tuple(places), m * s)], at, order))
        formula = terms[0].expression
        if of.values.keys() >= {*of.zeros}:
            rise = sympy.factor_terms(sympy.expand(_put(terms[0].exponent, of.values)))
            formula = sympy.exp(rise) * sympy.simplify(
                _put(formula / sympy.exp(terms[0].exponent), of.values)
            )
            found["conditions"] = [sympy.simplify(_put(c, of.values)) for c in found["conditions"]]
    elif quantity == "T":
        regular = of.regular(order + 1)
        formula = theorem.escape_time(points, regular, at)
        terms = tuple(_contributions(_products(points, regular, at), at, order))
    elif quantity[-1] == "C":
        formula = theorem.exit_probability(points, at, quantity != "C")
    else:
        formula = theorem.outside_layer(points[1:-1], (of.slopes[-1], of.slopes[1]), at)
        formula = formula.xreplace({abs(a): -side * a for side, a in of.slopes.items()})  # sliding
        formula = 1 - formula if quantity == "P" else formula
    known = {**at.known, **of.values, **IN_KAPPA}
    return {**found, "formula": formula, "definitions": known, "terms": terms,
            "equations": of.equations, "integrals": of.integrals}  # fmt: skip


def _put(e: Any, known: dict[Symbol, Expr]) -> Any:
    """What an expression is in that of which its symbols are made."""
    while e.free_symbols & known.keys():
        e = e.xreplace(known)
    return e


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
        ((height, c),) = letters.exponentials(value).items()
        front, product = LAM, [S.One, *[S.Zero] * order]
        for factor in sympy.Mul.make_args(c):
            first, row = at.rows.get(factor, (factor, [S.One]))
            front, row = front * first * row[0], [sympy.expand(a / row[0]) for a in row]
            product = [
                sympy.expand(sum(product[n - i] * a for i, a in enumerate(row[: n + 1])))
                for n in range(order + 1)
            ]
        yield Contribution(
            tuple(f"{p.name} {'' if str(p.u)[0] == 'u' else 'u = '}{p.u}" for p in pair),
            (LAM * height).xreplace(IN_KAPPA),
            sympy.powdenest(front.xreplace(IN_KAPPA), force=True),
            tuple(sympy.expand(a / 2**n) for n, a in enumerate(product)), weight,
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
        yield sympy.Ne(of.at(of.start), 0)


def leading(drift: Drift, case: Case, start: Fraction) -> Leading:
    """The leading term of T, and where it is that: of free parameters, as at the case's example."""
    bound, of = drift, Field(drift, case, start)
    if drift.free:
        examples = [c.example for c in found_cases(drift, start) if c == case]
        if not examples:
            raise InputError(f"no parameters of {drift!r} in this case are known; bind them.")
        bound = drift.bind(**examples[0])
    points, regular = theorem.points_of(of, 3, Letters), of.regular(3)
    numbers = numbers_of({s for p in points for s in p.height.free_symbols}, bound, start)
    numbers |= {Symbol(n, real=True): sympy.Rational(str(x)) for n, x in bound.values.items()}
    at = _Tops(of.start, numbers)
    value = at.named("T", theorem.escape_time(points, regular, at))
    value = value.xreplace({_LOG: sympy.log(LAM), X: 1 / LAM}).xreplace(IN_KAPPA)
    where = dict[Any, None]()
    for equal, higher in at.apart:
        if not drift.free:
            higher = S.Zero if equal else higher.xreplace(numbers).n(15)
        higher = sympy.expand(higher.xreplace({R: 1 + BEYOND}))
        where[(sympy.Eq if equal else sympy.Gt)(higher, 0).xreplace({BEYOND: R - 1})] = None
    where.pop(sympy.true, None)
    return Leading(sympy.powdenest(sympy.powsimp(value), force=True), tuple(where))


class _Tops(Terms):
    """Of each sum the highest exponential alone, as r -> oo, and where it is that."""

    def __init__(self, start: Expr, numbers: dict[Symbol, Expr]) -> None:
        super().__init__(start)
        self.lam, self.log_lam, self.numbers = 1 / X, _LOG, numbers
        self.apart = list[tuple[bool, Expr]]()

    def term(self, letter: str, point: Any, height: Any, halves: int, row: Any) -> Any:
        """The first term of a series."""
        n, c = next(((n, S(c)) for n, c in enumerate(row) if S(c) != 0), (0, 0))
        return c and X ** (sympy.Rational(halves, 2) + n) * c * sympy.exp(LAM * height)

    def named(self, name: str, value: Any) -> Expr:
        """The largest term; of those as high all that have the least power of x."""
        value = self.known["L"] + self.known["R"] if name == "S" else value
        terms = letters.exponentials(sympy.expand(value))
        sizes = {}
        for h in terms:
            size = sympy.expand(h.xreplace(self.numbers))
            sizes[h] = float(size.coeff(R, 1)), float(size.coeff(R, 0))
        top, powers = max(sizes, key=sizes.__getitem__), dict[Expr, Expr]()
        for h, size in sizes.items():
            equal = max(abs(a - b) for a, b in zip(sizes[top], size, strict=True)) < _SAME
            for a in sympy.Add.make_args(sympy.expand(terms[h])) if equal else ():
                factor, power = sympy.powsimp(a).as_coeff_exponent(X)
                powers[power] = powers.get(power, S.Zero) + factor
            self.apart.append((equal, top - h))
        kept = [power for power, a in powers.items() if sympy.expand(a) != 0]
        if not kept:
            raise InputError("the leading terms of T cancel, and none leads; use `terms`.")
        c = sympy.factor_terms(expanded(powers[min(kept)]))
        self.known[name] = c * X ** min(kept) * sympy.exp(LAM * top)
        return self.known[name]
