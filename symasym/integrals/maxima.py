"""Where f is largest on [a, b]: pieces between kinks, zeros of f', ends, and which is highest.

At a kink (a zero of what stands in Abs or sign, a crossing of the arguments of Max and Min, an end
of a Piecewise's condition) each side is an end of its own (DLMF 2.3(iii)). With parameters free the
answer must be the same at all values tried that their assumptions allow.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from itertools import pairwise
from math import cos, pi
from typing import Any, NamedTuple

import sympy
from flint import arb, fmpz_poly
from sympy import Expr, Piecewise, Rational, S, Symbol

from symasym.base.errors import InputError
from symasym.integrals.enclosure import Zero, code, number
from symasym.integrals.local import Balls, NotAnalytic, Point, samples

#: Terms with which f is compared with a constant.
FLAT = 24
# Kinks, or critical points; operations of a point in parameters.
_MOST, _SHORT = 60, 40
# Powers of 2 near an end, and far out, at which a limit shows; and lam there.
_NEAR, _FAR, _LARGE = range(-25, -201, -25), range(14, 21), 10**4
_RELATION = sympy.core.relational.Relational
# What has kinks, as a Piecewise.
_PIECEWISE: dict[Any, Any] = {
    sympy.Abs: lambda u: Piecewise((u, u > 0), (-u, True)),
    sympy.sign: lambda u: Piecewise((1, u > 0), (-1, True)),
    sympy.Heaviside: lambda u, _: Piecewise((1, u > 0), (0, True)),
    sympy.Max: lambda *of: reduce(lambda u, v: Piecewise((u, u > v), (v, True)), of),
    sympy.Min: lambda *of: reduce(lambda u, v: Piecewise((u, u < v), (v, True)), of),
}


@dataclass(frozen=True)
class Piece:
    """f and g on (lo, hi), where both are smooth; `exact` if all kinks are surely known."""

    x: Symbol
    lo: Expr
    hi: Expr
    f: Expr
    g: Expr
    exact: bool

    @property
    def middle(self) -> Expr:
        """A point inside, not where a Piecewise's own special values like to be."""
        lo, hi = (Rational(str(e)) if isinstance(e, Zero) else e for e in (self.lo, self.hi))
        if lo.is_infinite:
            return Rational(1, 7) if hi.is_infinite else hi - 1
        return lo + (1 if hi.is_infinite else (hi - lo) * Rational(4, 9))

    @cached_property
    def ends(self) -> dict[int, Any]:
        """f's limits at the lower end (side 1) and the upper one (side -1); None for -oo."""
        return {1: self._limit(self.lo, 1), -1: self._limit(self.hi, -1)}

    def _limit(self, end: Expr, side: int) -> Any:
        """By f's Taylor series, else by numbers, which show if the integral diverges."""
        far = end.is_infinite
        with suppress(NotAnalytic):
            if not far:
                return Point(self.x, end, side, 2, Balls()).taylor(self.f)[0]
        start, way = number(self.middle if far else end), -side if far else side
        at = [start + way * arb(2) ** k for k in (_FAR if far else _NEAR)]
        f, g = ([code(e, self.x)(y) for y in at] for e in (self.f, self.g))
        gap = abs(f[-1] - f[-2])
        if not far and gap < 1e-9 * (1 + abs(f[-1])):
            return f[-1] + arb(0, gap)
        rows = zip(at, f, g, strict=True)
        sizes = [(_LARGE * h + (abs(w) * abs(y - start)).log()).mid() for y, h, w in rows]
        if not all(later < earlier for earlier, later in pairwise(sizes)):
            raise InputError(
                f"f = {self.f} does not fall as {self.x} tends to {end}, or g = {self.g} grows, so "
                "that the integral diverges or has no maximum to expand at; give others, or ends."
            )
        return None

    def falls(self, point: Any, side: int) -> bool:
        """True if f falls from a point to one side; also where it has no Taylor series there."""
        try:
            c = Point(self.x, point, side, FLAT + 1, Balls()).taylor(self.f).c[1:]
        except NotAnalytic:
            return True
        return next((s for y in c if (s := Balls().sign(y)) != 0), 1) == -1

    def bound(self, row: dict[Symbol, Expr]) -> Piece:
        """With numbers, or other symbols, for parameters."""
        return replace(self, **{e: getattr(self, e).xreplace(row) for e in ("lo", "hi", "f", "g")})


class Maximum(NamedTuple):
    """A local maximum of f on the closed interval, and the pieces in which it is expanded."""

    point: Any
    height: Any
    sides: list[tuple[Piece, str]]


def free_symbols(x: Symbol, *parts: Any) -> set[Symbol]:
    """The parameters."""
    return set().union(*(e.free_symbols for e in parts)) - {x}


def cut(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Piece]:
    """[a, b] cut at the kinks of f and g, with the branches that hold between."""
    for kind, rule in _PIECEWISE.items():
        f, g = (e.replace(kind, rule) for e in (f, g))
    gaps = {r.lhs - r.rhs for e in (f, g) for p in e.atoms(Piecewise) for r in p.atoms(_RELATION)}
    # A sign also changes at poles.
    tests = {sympy.prod(sympy.fraction(sympy.together(e))) for e in gaps if e.has(x)}
    kinks, orders = {z for e in tests for z in zeros(e, x, a, b, turns=True)}, set()
    closed = all(isinstance(z, Expr) for z in kinks)
    exact = closed and all(_rational(e, x) is not None for e in tests)
    free = free_symbols(x, a, b, *tests)
    for row in samples(free):
        lo, hi = (e.xreplace(row) for e in (a, b))
        placed = {z: v for z in kinks if number(lo) < (v := number(z.xreplace(row))) < number(hi)}
        orders.add(tuple(sorted(placed, key=lambda z: placed[z].mid())))
        for z in (z for e in tests if row for z in zeros(e.xreplace(row), x, lo, hi, turns=True)):
            if not any(number(z).overlaps(v) for v in placed.values()):
                orders.add((z,))
    if len(orders) > 1:
        raise _undecided(f"where the kinks of f = {f} and g = {g} lie", free)
    whole = [Piece(x, lo, hi, f, g, exact) for lo, hi in pairwise([a, *orders.pop(), b])]
    return [replace(p, **{e: _smooth(getattr(p, e), x, p.middle) for e in "fg"}) for p in whole]


def _undecided(what: str, free: set[Symbol]) -> InputError:
    signs = sorted(f"Symbol('{s}', positive=True)" for s in free if s.is_extended_nonzero is None)
    hint = f", or symbols with assumptions that decide, such as {signs[0]}" if signs else ""
    return InputError(f"{what} depends on {', '.join(sorted(map(str, free)))}; give numbers{hint}.")


def _smooth(e: Expr, x: Symbol, middle: Any) -> Expr:
    """The branch of every Piecewise that holds at `middle`, innermost first."""

    def holds(condition: Any) -> bool:
        at = condition.xreplace({x: middle})
        found = {at.xreplace(row) for row in samples(at.free_symbols)}
        if len(found) > 1 or not found <= {S.true, S.false}:
            raise _undecided(f"whether {condition} holds", at.free_symbols)
        return bool(found.pop())

    while nodes := e.atoms(Piecewise):
        node = min(nodes, key=lambda n: (sympy.count_ops(n), str(n)))
        e = e.xreplace({node: next((v for v, c in node.args if holds(c)), S.NaN)})
    return e


# -- zeros -------------------------------------------------------------------------------------


def zeros(e: Expr, x: Symbol, lo: Expr, hi: Expr, turns: bool = False) -> list[Any]:
    """Real zeros in (lo, hi): all of a rational function, others where the sign changes on a grid.

    With parameters those of linear and quadratic factors, or that SymPy solves for; with `turns`
    also where the sign changes at a pole or a jump, as tan's does.
    """
    if not e.has(x):
        return []
    if free_symbols(x, e, lo, hi):
        parts = [e]
        if e.is_rational_function(x):
            above = sympy.fraction(sympy.together(e))[0]
            parts = [y for y, _ in sympy.factor_list(above)[1] if 0 < sympy.degree(y, x) <= 2]
        elif len([n for n in e.atoms(sympy.Function, sympy.Pow) if n.has(x)]) > 1:
            return []  # which might take for ever
        with suppress(NotImplementedError):
            return [z for y in parts for z in sympy.solve(y, x) if z.is_real is not False]
        return []
    poly, a, b = _rational(e, x), number(lo), number(hi)
    found = _algebraic(poly, x) if poly else _on_grid(e, x, a, b, turns)
    found = [z for z in found if a < number(z) < b]
    if len(found) > _MOST:
        raise InputError(
            f"{e} has more than {_MOST} zeros for {x} in ({lo}, {hi}); give an integral with "
            "fewer kinks and critical points."
        )
    return [_recognised(z) if isinstance(z, Zero) and not poly else z for z in found]


def _rational(e: Expr, x: Symbol) -> Any:
    """The polynomial whose zeros are those of e, if it is one with rational coefficients."""
    poly = e.is_rational_function(x) and sympy.fraction(sympy.together(e))[0].as_poly(x)
    return poly if poly and poly.domain in (sympy.ZZ, sympy.QQ) else None


def _algebraic(poly: Any, x: Symbol) -> list[Any]:
    """The real zeros of a polynomial with rational coefficients."""
    found: list[Any] = []
    whole: Any = fmpz_poly([int(c) for c in poly.clear_denoms(convert=True)[1].all_coeffs()[::-1]])
    for factor, _ in whole.factor()[1]:
        e = sympy.Poly([int(c) for c in factor.coeffs()[::-1]], x)
        if factor.degree() <= 2:
            found += e.real_roots()
        else:
            near = (z.real for z, _ in factor.complex_roots() if z.imag == 0)
            found += [Zero(e.as_expr(), x, z.lower(), z.upper()) for z in near]
    return found


def _on_grid(e: Expr, x: Symbol, a: Any, b: Any, turns: bool) -> list[Any]:
    """Zeros where the sign changes between points of a grid."""
    of, found = code(e, x), []
    reach = [arb(2) ** (arb(k) / 30 - 27) for k in range(1600)]
    base = a if a.is_finite() else b if b.is_finite() else arb(0)
    if (b - a).is_finite():
        grid = [a + (b - a) * arb((1 - cos(pi * k / 800)) / 2) for k in range(1, 800)]
    else:
        left = [] if a.is_finite() else [base - y for y in reach[::-1]]
        grid = [*left, base, *([] if b.is_finite() else [base + y for y in reach])]
    known = [(y.mid(), v) for y in grid if (v := of(y)).is_finite() and not v.contains(0)]
    for (p, u), (q, v) in pairwise(known):
        zero = Zero(e, x, p, q)
        if u * v < 0 and (turns or abs(of(zero.ball())) < max(abs(u), abs(v))):  # else a pole
            found.append(zero)
        if len(found) > _MOST:
            break
    return found


def _recognised(zero: Zero) -> Any:
    """As a rational, its multiple of pi, logarithm or root, if it is one."""
    z = zero.ball().mid()
    forms = (z, S), (z / arb.pi(), lambda r: r * sympy.pi), (z.exp(), sympy.log)
    for value, form in (*forms, (z * z, lambda r: (1 if z > 0 else -1) * sympy.sqrt(r))):
        if abs(value) < 10**6:
            whole = Rational(str(value.str(50, radius=False)))
            near = whole.limit_denominator(10**6)
            if abs(near - whole) < Rational(1, 10**30):
                closed = form(near)
                if sympy.simplify(zero.equation.xreplace({zero.x: closed})) == 0:
                    return closed
    return zero


# -- maxima ------------------------------------------------------------------------------------


def highest(pieces: list[Piece]) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others; parameters have numbers."""
    maxima = []
    for left, right in pairwise([None, *pieces, None]):
        sides = [(p, s) for p, s in ((left, -1), (right, 1)) if p and p.ends[s] is not None]
        top = max((p.ends[s] for p, s in sides), key=lambda h: h.mid(), default=None)
        sides = [(p, s) for p, s in sides if p.ends[s].overlaps(top)]
        end: Any = right.lo if right else left.hi  # type: ignore[union-attr]
        if sides and all(p.falls(end, s) for p, s in sides):
            named = [(p, "left" if s < 0 else "right") for p, s in sides]
            maxima.append(Maximum(end, top, named))
    maxima += [
        Maximum(z, code(p.f, p.x)(number(z)), [(p, "both")])
        for p in pieces
        for z in zeros(p.f.diff(p.x), p.x, p.lo, p.hi)
        if p.falls(z, 1) and p.falls(z, -1)
    ]
    if not maxima:
        p = pieces[0]
        raise InputError(
            f"f = {p.f} has no isolated maximum for {p.x} in [{p.lo}, {pieces[-1].hi}]; give an f "
            "that is not constant, and an interval on which it is largest somewhere."
        )
    maxima.sort(key=lambda m: -m.height.mid())
    tops = [m for m in maxima if m.height.overlaps(maxima[0].height)]
    return tops, maxima[len(tops) :]


def with_parameters(pieces: list[Piece]) -> list[Maximum]:
    """The highest of the ends, kinks and zeros of f' while parameters are free, at all samples."""
    x, points = pieces[0].x, [e for p in pieces for e in (p.lo, p.hi) if e.is_infinite is False]
    points += [z for p in pieces for z in zeros(p.f.diff(x), x, p.lo, p.hi)]
    free = free_symbols(x, *(e for p in pieces for e in (p.lo, p.hi, p.f, p.g)))
    placed, chosen = dict[Expr, Any](), set[Any]()
    for row in samples(free):
        bound = [p.bound(row) for p in pieces]
        try:
            tops = [m.point for m in highest(bound)[0]]
        except InputError:
            if all(s.is_extended_nonzero for s in free):
                raise
            raise _undecided(f"whether f = {pieces[0].f} has a maximum", free) from None
        for z in () if chosen else [*points, *tops]:
            here = number(z.xreplace(row))
            known = any(here.overlaps(y) for y in placed.values())
            if here.is_finite() and not known and isinstance(z, Expr) and z.count_ops() <= _SHORT:
                placed[z], first = here, bound
        at, there = {z: number(z.xreplace(row)) for z in placed}, list(map(number, tops))
        found = [z for z, v in at.items() if any(v.is_finite() and v.overlaps(y) for y in there)]
        chosen.add(tuple(found))
        if len(found) < len(tops) or len(chosen) > 1:
            raise _undecided(f"where f = {pieces[0].f} is largest", free)
    maxima = []
    for z in chosen.pop():
        sides = [(p, "left" if z == p.hi else "right") for p in pieces if z in (p.lo, p.hi)]
        inside = (number(p.lo) < placed[z] < number(p.hi) for p in first)
        sides = sides or [(p, "both") for p, here in zip(pieces, inside, strict=True) if here]
        maxima.append(Maximum(z, None, sides))
    return maxima
