"""Where f is largest on [a, b]: pieces between kinks, and f beside their ends and the zeros of f'.

At a kink (a zero of what stands in Abs or sign, a crossing of the arguments of Max and Min, an end
of a Piecewise's condition) each side is an end of its own (DLMF 2.3(iii)). With parameters free the
answer must be the same at all values tried that their assumptions allow.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import lru_cache, reduce
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
_SIDES = {-1: "left", 0: "both", 1: "right"}
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
    exact: bool = False

    @property
    def free(self) -> set[Symbol]:
        """The parameters."""
        return set(sympy.Tuple(self.lo, self.hi, self.f, self.g).free_symbols) - {self.x}

    @property
    def middle(self) -> Expr:
        """A point inside, not where a Piecewise's own special values like to be."""
        lo, hi = (Rational(str(e)) if isinstance(e, Zero) else e for e in (self.lo, self.hi))
        if lo.is_infinite:
            return Rational(1, 7) if hi.is_infinite else hi - 1
        return lo + (1 if hi.is_infinite else (hi - lo) * Rational(4, 9))

    @property
    def critical(self) -> list[Any]:
        """The zeros of f'."""
        return zeros(self.f.diff(self.x), self.x, self.lo, self.hi)

    def marks(self) -> list[Any]:
        """Where to split the integral, in balls: the ends, zeros of f' and poles of g."""
        poles = [n.base for n in self.g.atoms(sympy.Pow) if n.exp.is_negative]
        inside = [z for e in poles for z in zeros(e, self.x, self.lo, self.hi)]
        inside = sorted(map(number, (*self.critical, *inside)), key=float)
        return [number(self.lo), *inside, number(self.hi)]

    def beside(self, point: Any, side: int) -> list[Any]:
        """f's Taylor coefficients in the distance from a point, to one side or, 0, to both.

        Where it has none, its limit by numbers, which also show divergence; nothing for -oo.
        """
        far = point.is_infinite
        with suppress(NotAnalytic):
            if not far:
                return Point(self.x, point, side or 1, FLAT + 1, Balls()).taylor(self.f).c
        start, way = number(self.middle if far else point), -side if far else side or 1
        at = [start + way * arb(2) ** k for k in (_FAR if far else _NEAR)]
        f, g = ([code(e, self.x)(y) for y in at] for e in (self.f, self.g))
        gap = abs(f[-1] - f[-2])
        if not far and gap < 1e-9 * (1 + abs(f[-1])):
            return [f[-1] + arb(0, gap)]
        rows = zip(at, f, g, strict=True)
        sizes = [(_LARGE * h + (abs(w) * abs(y - start)).log()).mid() for y, h, w in rows]
        if not all(later < earlier for earlier, later in pairwise(sizes)):
            raise InputError(
                f"f = {self.f} does not fall as {self.x} tends to {point}, or g = {self.g} grows, "
                "so that the integral diverges or has no maximum to expand at; give others, or "
                "ends."
            )
        return []

    def smooth(self, at: dict[Symbol, Expr]) -> Piece:
        """With the branches of Piecewise that hold there."""

        def branch(*of: Any) -> Any:
            return next((v for v, holds in of if holds.xreplace(at) is S.true), S.NaN)

        try:
            f, g = (e.replace(Piecewise, branch) for e in (self.f, self.g))
        except TypeError:  # SymPy's, of a comparison
            raise InputError(
                f"f = {self.f} or g = {self.g} compares what is complex; give real conditions."
            ) from None
        return replace(self, f=f, g=g)


class Maximum(NamedTuple):
    """A local maximum of f on the closed interval, and the pieces in which it is expanded."""

    point: Any
    height: Any
    sides: list[tuple[Piece, str]]


def located(whole: Piece) -> tuple[list[Piece], list[Maximum], list[Maximum]]:
    """The pieces of an interval, the maxima that share the largest height, and the others.

    Of free parameters all samples must give the same.
    """
    for kind, rule in _PIECEWISE.items():
        whole = replace(whole, f=whole.f.replace(kind, rule), g=whole.g.replace(kind, rule))
    if not whole.free:
        pieces = _cut(whole)
        return pieces, *_highest(pieces)
    found = list[Any]()
    for k, row in enumerate(samples(whole.free)):
        with suppress(InputError):
            found.append(_in_symbols(whole, row))
        if len(found) == k or found[-1] != found[0]:
            first, *_ = names = sorted(map(str, whole.free))
            raise InputError(
                f"where f = {whole.f} is largest, if anywhere, or f or g = {whole.g} has kinks, "
                f"depends on {', '.join(names)}; give numbers, or symbols with assumptions that "
                f"decide, such as Symbol('{first}', positive=True)."
            )
    return *found[0], []


def _in_symbols(whole: Piece, row: dict[Symbol, Expr]) -> tuple[list[Piece], list[Maximum]]:
    """Pieces and maxima in the parameters, as they are at a row of numbers."""

    def named(point: Any, known: list[Any]) -> Any:
        for z in known:
            if isinstance(z, Expr) and z.count_ops() <= _SHORT:
                here = number(z.xreplace(row))
                if here.is_finite() and here.overlaps(number(point)):
                    return z
        raise InputError(f"{point} has no closed form.")

    ends = ("lo", "hi", "f", "g")
    numbers = _cut(replace(whole, **{e: getattr(whole, e).xreplace(row) for e in ends}))
    tops = sorted(_highest(numbers)[0], key=lambda m: number(m.point).mid())
    kinks, _ = _kinks(whole)
    marks = [whole.lo, *(named(p.hi, kinks) for p in numbers[:-1]), whole.hi]
    pieces = [
        replace(whole, lo=lo, hi=hi).smooth({whole.x: p.middle, **row})
        for (lo, hi), p in zip(pairwise(marks), numbers, strict=True)
    ]
    known = [z for p in pieces for z in (p.lo, p.hi, *p.critical)]
    return pieces, [
        Maximum(named(z, [*known, z]), None, [(pieces[numbers.index(p)], s) for p, s in sides])
        for z, _, sides in tops
    ]


def _kinks(p: Piece) -> tuple[list[Any], bool]:
    """Those of f and g, and whether they are surely all."""
    gaps = {r.lhs - r.rhs for r in sympy.Tuple(p.f, p.g).atoms(_RELATION)}
    # A sign also changes at poles.
    tests = {sympy.prod(sympy.fraction(sympy.together(e))) for e in gaps if e.has(p.x)}
    found = {z for e in tests for z in zeros(e, p.x, p.lo, p.hi, turns=True)}
    rational = all(_rational(e, p.x) is not None for e in tests)
    return list(found), rational and all(isinstance(z, Expr) for z in found)


def _cut(whole: Piece) -> list[Piece]:
    """An interval cut at the kinks, with the branches that hold between."""
    kinks, exact = _kinks(whole)
    marks = [whole.lo, *sorted(kinks, key=lambda z: number(z).mid()), whole.hi]
    pieces = [replace(whole, lo=lo, hi=hi, exact=exact) for lo, hi in pairwise(marks)]
    return [p.smooth({p.x: p.middle}) for p in pieces]


def _highest(pieces: list[Piece]) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others."""
    places, maxima = dict[Any, list[tuple[Piece, int]]](), []
    for p in pieces:
        for z, side in ((p.lo, 1), (p.hi, -1), *((z, 0) for z in p.critical)):
            places.setdefault(z, []).append((p, side))
    for z, around in places.items():
        sides = [(p, s, c) for p, s in around if (c := p.beside(z, s))]
        top = max((c[0] for _, _, c in sides), key=lambda h: h.mid(), default=None)
        sides = [(p, s, c) for p, s, c in sides if c[0].overlaps(top)]
        if sides and all(_falls(c, s) for _, s, c in sides):
            maxima.append(Maximum(z, top, [(p, _SIDES[s]) for p, s, _ in sides]))
    if not maxima:
        p = pieces[0]
        raise InputError(
            f"f = {p.f} has no isolated maximum for {p.x} in [{p.lo}, {pieces[-1].hi}]; give an f "
            "that is not constant, and an interval on which it is largest somewhere."
        )
    maxima.sort(key=lambda m: -m.height.mid())
    tops = [m for m in maxima if m.height.overlaps(maxima[0].height)]
    return tops, maxima[len(tops) :]


def _falls(c: list[Any], side: int) -> bool:
    """True if f of these Taylor coefficients falls; also where it has no more than a limit."""
    signs = ((k, s) for k, y in enumerate(c) if k and (s := Balls().sign(y)) != 0)
    contact, sign = next(signs, (2, -1 if len(c) == 1 else 0))
    return sign == -1 and (side != 0 or contact % 2 == 0)


# -- zeros -------------------------------------------------------------------------------------


@lru_cache(maxsize=512)
def zeros(e: Expr, x: Symbol, lo: Expr, hi: Expr, turns: bool = False) -> list[Any]:
    """Real zeros in (lo, hi): all of a rational function, others where the sign changes on a grid.

    With parameters those of linear and quadratic factors, or that SymPy solves for; with `turns`
    also where the sign changes at a pole or a jump, as tan's does.
    """
    if not e.has(x):
        return []
    if any(y.free_symbols - {x} for y in (e, lo, hi)):
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
