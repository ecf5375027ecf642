"""Where f is largest on [a, b]: pieces between kinks, zeros of f', ends, and which is highest.

At a kink (a zero of what stands in Abs or sign, a crossing of the arguments of Max and Min, an end
of a Piecewise's condition) each side is an end of its own (DLMF 2.3(iii)). With parameters free the
answer must be the same at all values tried that their assumptions allow.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import combinations, pairwise, product
from typing import Any

import numpy as np
import sympy
from flint import arb, fmpz_poly
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import InputError
from symasym.integrals.enclosure import Stretch, Y, Zero, compiled, number
from symasym.integrals.terms import Balls, NotAnalytic, Point, samples, sign_of, vanishes

_KINKED = (sympy.Abs, sympy.sign, sympy.Heaviside, sympy.Max, sympy.Min, sympy.Piecewise)
_RELATION = sympy.core.relational.Relational
#: Terms with which f is compared with a constant.
FLAT = 24
# Distances, and lam, at which the fall towards an infinite end is looked at.
_FAR, _LARGE = (10**4, 30_011, 10**5, 10**6), 10**4
# Parameters without a sign up to which the signs are tried.
_MOST_SIGNS = 3
# Degree up to which zeros of f' may have a closed form.
_CLOSED = 4
# Operations of a zero of f' in parameters, beyond which no formula is worth having.
_SHORT = 40


@dataclass(frozen=True)
class Piece:
    """f and g on (lo, hi), where both are smooth."""

    x: Symbol
    lo: Expr
    hi: Expr
    f: Expr
    g: Expr

    @cached_property
    def middle(self) -> Expr:
        """A point inside, not where a Piecewise's own special values like to be."""
        if self.lo.is_infinite:
            return Rational(1, 7) if self.hi.is_infinite else self.hi - 1
        return self.lo + (1 if self.hi.is_infinite else (self.hi - self.lo) * Rational(4, 9))

    @cached_property
    def ends(self) -> dict[int, Any]:
        """f's limits at the lower end (side 1) and the upper one (side -1); None for -oo."""
        return {1: self._limit(self.lo, "+"), -1: self._limit(self.hi, "-")}

    def _limit(self, end: Expr, side: str) -> Any:
        if end.is_infinite:
            return None
        if (value := self.at(end)).is_finite():
            return value
        try:
            limit = sympy.limit(self.f, self.x, end, side)
        except NotImplementedError:
            limit = S.NaN
        if limit == -sympy.oo:
            return None
        if not (limit.is_finite and limit.is_real) or isinstance(limit, sympy.AccumBounds):
            raise InputError(
                f"f = {self.f} tends to {limit} at {self.x} = {end}, so the integral diverges or "
                "is complex; give an f that is bounded above on [a, b]."
            )
        return number(limit)

    def at(self, point: Any) -> Any:
        """f at a point, a ball that is not finite where f is singular or complex."""
        try:
            return compiled(self.f, self.x)(number(point), False)
        except ZeroDivisionError:
            return arb.nan()

    def falls(self, point: Any, side: int) -> bool:
        """True if f falls from a point to one side; also where it has no Taylor series there."""
        try:
            c = Point(self.x, point, side, FLAT + 1, Balls()).taylor(self.f).c[1:]
        except NotAnalytic:
            return True
        signs = (Balls().sign(y)[0] for y in c)
        return next((s for s in signs if s != 0), 1) == -1

    @cached_property
    def stretches(self) -> list[Stretch]:
        """Both halves, with y for x such that f and g are analytic to the end, or it is at oo."""
        found = []
        for end, side in ((self.lo, 1), (self.hi, -1)):
            distance, far = abs(self.middle - end), self.ends[side] is None
            q = 1 if far else self._steps(end, side)
            of_y, lo, hi = end + side * Y**q, S.Zero, distance ** Rational(1, q)
            if far and end.is_infinite:
                of_y, hi = self.middle - side * Y, S.Infinity
            elif far:
                of_y, lo, hi = end + side / Y, 1 / distance, S.Infinity
            f, g = (e.xreplace({self.x: of_y}) for e in (self.f, self.g))
            parts = (sympy.powdenest(e, force=True) for e in sympy.Add.make_args(g))
            g = sympy.Add(*(abs(of_y.diff(Y)) * e for e in parts))
            found.append(Stretch(f, g, lo, hi, far))
        return found

    def _steps(self, end: Expr, side: int) -> int:
        """The q for which f and g are analytic in y at the end, |x - end| = y^q."""
        here = Point(self.x, end, side, 4, Balls())
        try:
            fronts = [p for e in (self.f, self.g) for p, _ in here.terms(e)]
        except (InputError, ValueError, ZeroDivisionError):
            return 1
        rational = all(p.is_Rational and p.q < 64 for p in fronts)
        return math.lcm(*(int(p.q) for p in fronts)) if rational else 1

    def bound(self, row: dict[Symbol, Expr]) -> Piece:
        """With numbers, or other symbols, for parameters."""
        return Piece(self.x, *(e.xreplace(row) for e in (self.lo, self.hi, self.f, self.g)))


@dataclass(frozen=True)
class Maximum:
    """A local maximum of f on the closed interval, and the pieces on its sides, if any."""

    point: Any
    height: Any
    left: Piece | None
    right: Piece | None

    @cached_property
    def sides(self) -> list[tuple[Piece, Any, str]]:
        """The pieces in which it is expanded, each with its side."""
        if self.left is self.right and self.left is not None:
            return [(self.left, self.point, "both")]
        both = (self.left, "left"), (self.right, "right")
        return [(piece, self.point, side) for piece, side in both if piece is not None]


def cut(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Piece]:
    """[a, b] cut at the kinks of f and g, with the branches that hold between."""
    kinks = sorted({z for e in (f, g) for z in _kinks(e, x)}, key=str)
    orders = set()
    for row in samples(set().union(*(e.free_symbols for e in (a, b, *kinks)))):
        lo, hi = (number(e.xreplace(row)) for e in (a, b))
        placed = {z: v for z in kinks if lo < (v := number(z.xreplace(row))) < hi}
        orders.add(tuple(sorted(placed, key=lambda z: placed[z].mid())))
    if len(orders) > 1:
        raise InputError(
            f"where the kinks {', '.join(map(str, kinks))} lie in ({a}, {b}) depends on the "
            "parameters; give symbols with assumptions, or numbers."
        )
    raw = [Piece(x, lo, hi, f, g) for lo, hi in pairwise([a, *orders.pop(), b])]
    return [Piece(x, p.lo, p.hi, *(_smooth(e, x, p.middle) for e in (f, g))) for p in raw]


def _kinks(e: Expr, x: Symbol) -> set[Expr]:
    """Zeros and crossings of the arguments of what has kinks, and ends of conditions."""
    found: set[Expr] = set()
    for node in e.atoms(*_KINKED):
        parts = list(node.args[:1])
        if isinstance(node, (sympy.Max, sympy.Min)):
            parts = [p - q for p, q in combinations(node.args, 2)]
        elif isinstance(node, sympy.Piecewise):
            parts = [r.lhs - r.rhs for _, c in node.args for r in c.atoms(_RELATION)]
        for part in parts:
            try:
                zeros = sympy.solve(part, x) if part.has(x) else []
            except NotImplementedError:
                raise InputError(
                    f"the zeros of {part}, where the integrand has a kink, were not found; split "
                    "the integral there yourself."
                ) from None
            found |= {z for z in zeros if z.is_real is not False}
    return found


def _smooth(e: Expr, x: Symbol, middle: Expr) -> Expr:
    """The branch of every kinked function that holds at `middle`, innermost first."""

    def positive(part: Expr) -> bool:
        sign = sign_of(part.xreplace({x: middle}))[0]
        if sign is None:
            raise InputError(
                f"the sign of {part} depends on the parameters; give symbols with assumptions."
            )
        return sign > 0

    while nodes := [n for n in e.atoms(*_KINKED) if n.has(x)]:
        node = min(nodes, key=lambda n: (sympy.count_ops(n), str(n)))
        branch, *others = node.args
        if isinstance(node, (sympy.Max, sympy.Min)):
            for other in others:
                up = positive(other - branch)
                branch = other if up is isinstance(node, sympy.Max) else branch
        elif isinstance(node, sympy.Piecewise):
            holds = [
                c.replace(lambda r: isinstance(r, _RELATION), lambda r: S(positive(r.gts - r.lts)))
                for _, c in node.args
            ]
            branch = next((v for (v, _), c in zip(node.args, holds, strict=True) if c), None)
            if branch is None:
                raise InputError(
                    f"{node} has no branch at {x} = {middle}; make the last condition True."
                )
        elif isinstance(node, sympy.Heaviside):
            branch = S.One if positive(branch) else S.Zero
        else:
            sign = 1 if positive(branch) else -1
            branch = sign * (branch if isinstance(node, sympy.Abs) else S.One)
        e = e.xreplace({node: branch})
    return e


def highest(pieces: list[Piece]) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others; parameters have numbers."""
    maxima = [Maximum(z, p.at(z), p, p) for p in pieces for z in _inside(p)]
    for left, right in pairwise([None, *pieces, None]):
        sides = {s: p for s, p in ((-1, left), (1, right)) if p and p.ends[s] is not None}
        top = max((p.ends[s] for s, p in sides.items()), key=lambda h: h.mid(), default=None)
        sides = {s: p for s, p in sides.items() if p.ends[s].overlaps(top)}
        end: Any = right.lo if right else left.hi  # type: ignore[union-attr]
        if sides and all(p.falls(end, s) for s, p in sides.items()):
            maxima.append(Maximum(end, top, sides.get(-1), sides.get(1)))
    _require_decay(pieces)
    f, x = pieces[0].f, pieces[0].x
    if not maxima:
        raise InputError(
            f"f = {f} has no isolated maximum for {x} in [{pieces[0].lo}, {pieces[-1].hi}]; give "
            "an f that is not constant, and an interval on which it is largest somewhere."
        )
    maxima.sort(key=lambda m: -m.height.mid())
    tops = [m for m in maxima if m.height.overlaps(maxima[0].height)]
    return tops, maxima[len(tops) :]


def _inside(piece: Piece) -> list[Any]:
    """The interior maxima, those of a rational f' all of them, others between points of a grid."""
    x, slope = piece.x, piece.f.diff(piece.x)
    above = sympy.fraction(sympy.together(slope))[0]
    if not slope.has(x):
        return []
    if sympy.fraction(sympy.together(slope))[1].is_polynomial(x) and above.is_polynomial(x):
        zeros: list[Any] = []
        for factor, _ in sympy.Poly(above, x).factor_list()[1]:
            if factor.degree() <= _CLOSED:
                roots = factor.real_roots()
                near = [Fraction(str(z.n(40))) for z in roots]
            else:
                whole = factor.clear_denoms(convert=True)[1].all_coeffs()[::-1]
                found: Any = fmpz_poly([int(c) for c in whole]).complex_roots()
                roots = [z for z, _ in found if z.imag == 0]
                near = [Fraction(str(z.real.str(40, radius=False))) for z in roots]
            for root, value in zip(roots, near, strict=True):
                short = isinstance(root, Expr) and root.count_ops() < 8
                closed = short and not root.has(sympy.CRootOf)
                zeros.append(root if closed else Zero(factor.as_expr(), x, value))
    else:
        zeros = _on_grid(piece, slope)
    lo, hi = number(piece.lo), number(piece.hi)
    zeros = [z for z in zeros if lo < number(z) < hi]
    return [z for z in zeros if piece.falls(z, 1) and piece.falls(z, -1)]


def _on_grid(piece: Piece, slope: Expr) -> list[Any]:
    """Zeros of f' where its sign changes from + to - on a grid, by bisection.

    A rational, its multiple of pi, square root or logarithm is recognised.
    """
    x, lo, hi = piece.x, float(number(piece.lo)), float(number(piece.hi))
    parts = np.geomspace(1e-8, 1e-2, 61), np.linspace(0.015, 30, 1201), np.geomspace(31, 1e8, 201)
    reach = np.concatenate(parts)
    if np.isfinite(hi - lo):
        share = (1 - np.cos(np.pi * np.linspace(0, 1, 801)[1:-1])) / 2
        grid = lo * (1 - share) + hi * share
    elif np.isfinite(lo):
        grid = lo + reach
    elif np.isfinite(hi):
        grid = (hi - reach)[::-1]
    else:
        grid = np.concatenate([-reach[::-1], [0.0], reach])
    code = sympy.lambdify(x, slope, "scipy" if slope.has(sympy.erf) else "numpy")
    with np.errstate(all="ignore"):
        rise = np.asarray(code(grid) + 0 * grid)
    kept = np.flatnonzero(np.isfinite(rise) & (rise != 0))
    exact, found = compiled(slope, x), []
    for i, j in pairwise(kept):
        if not rise[i] > 0 > rise[j]:
            continue
        a, b = arb(float(grid[i])), arb(float(grid[j]))
        for _ in range(200):
            m = ((a + b) / 2).mid()
            value = exact(m, False)
            a, b = (m, m) if value.contains(0) else (m, b) if value > 0 else (a, m)
        if abs(exact(a, False)) < max(abs(float(rise[i])), abs(float(rise[j]))):  # else a pole
            found.append(_recognised(a, slope, x))
    return found


def _recognised(z: Any, slope: Expr, x: Symbol) -> Any:
    """The zero of f' at a number, in closed form where it has a plain one."""
    sign = 1 if z > 0 else -1
    forms = (z, S), (z / arb.pi(), lambda r: r * sympy.pi), (z.exp(), sympy.log)
    for value, form in (*forms, (z * z, lambda r: sign * sympy.sqrt(r))):
        whole = Fraction(str(value.str(50, radius=False)))
        near = whole.limit_denominator(10**6)
        if abs(near - whole) < Fraction(1, 10**30):
            guess = form(Rational(near.numerator, near.denominator))
            if vanishes(slope.xreplace({x: guess})):
                return guess
    return Zero(slope, x, Fraction(str(z.str(50, radius=False))))


def _require_decay(pieces: list[Piece]) -> None:
    """Refuse an infinite end towards which g e^(lam f) does not fall faster than 1/x, lam = 1e4."""
    for piece, end, sign in ((pieces[0], pieces[0].lo, -1), (pieces[-1], pieces[-1].hi, 1)):
        if not end.is_infinite:
            continue
        f, g = compiled(piece.f, piece.x), compiled(piece.g, piece.x)
        logs = [
            _LARGE * f(arb(sign * y), False) + (y * abs(g(arb(sign * y), False))).log()
            for y in _FAR
        ]
        if any(later > earlier for earlier, later in pairwise(logs)):
            raise InputError(
                f"f = {piece.f} does not fall as {piece.x} tends to {end}, or g = {piece.g} grows "
                "faster, so the integral diverges or has no maximum to expand at; give an interval "
                "on which f has a maximum and decays."
            )


def with_parameters(pieces: list[Piece], given: list[Expr] | None) -> list[Maximum]:
    """Where f is largest while parameters are free; a sign that decides is asked for."""
    try:
        return _the_same(pieces, given)
    except InputError as refusal:
        error = refusal
    x, f = pieces[0].x, pieces[0].f
    free = {s for p in pieces for e in (p.lo, p.hi, p.f, p.g) for s in e.free_symbols} - {x}
    unknown = sorted((s for s in free if s.is_positive is s.is_negative is None), key=str)
    calls, rules = [], []
    for signs in product(("positive", "negative"), repeat=len(unknown)):
        if len(unknown) > _MOST_SIGNS:
            break
        pairs = list(zip(unknown, signs, strict=True))
        row = {s: Symbol(s.name, **{sign: True}) for s, sign in pairs}
        try:
            _the_same([p.bound(row) for p in pieces], given and [z.xreplace(row) for z in given])
        except InputError:
            continue
        calls.append(", ".join(f"Symbol('{s}', {sign}=True)" for s, sign in pairs))
        rules.append(" and ".join(f"{s} must be {sign}" for s, sign in pairs))
    if not unknown or not calls:
        raise error
    rule = f"where f = {f} is largest depends on the sign of {', '.join(map(str, unknown))}; pass"
    if len(calls) == 1:
        rule = f"f = {f} has no maximum for some values of its parameters; {rules[0]}: pass"
    raise InputError(f"{rule} {' or '.join(calls)}.")


def _the_same(pieces: list[Piece], given: list[Expr] | None) -> list[Maximum]:
    """The highest of the ends, kinks and zeros of f', or of those given, at all samples."""
    x, points = pieces[0].x, [e for p in pieces for e in (p.lo, p.hi) if not e.is_infinite]
    for piece in pieces if given is None else []:
        try:
            zeros = sympy.solve(piece.f.diff(x), x)
        except NotImplementedError:
            continue
        points += [z for z in zeros if z.is_real is not False and z.count_ops() <= _SHORT]
    points = list(dict.fromkeys(points if given is None else given))
    parts = [e for p in pieces for e in (p.lo, p.hi, p.f, p.g)]
    free = set().union(*(e.free_symbols for e in (*parts, *points))) - {x}
    rows, chosen = samples(free), set()
    for row in rows:
        tops = [number(m.point) for m in highest([p.bound(row) for p in pieces])[0]]
        at = {z: v for z in points if (v := number(z.xreplace(row))).is_finite()}
        found = tuple(z for z, v in at.items() if any(v.overlaps(top) for top in tops))
        chosen.add(found)
        if len(found) < len(tops) or len(chosen) > 1:
            raise InputError(
                f"where f = {pieces[0].f} is largest could not be decided for all parameters "
                f"(tried {', '.join(f'{s} = {v}' for s, v in row.items())}); give maxima=[…], "
                "symbols with assumptions, or numbers."
            )
    maxima = []
    for z in chosen.pop():
        left = next((p for p in pieces if z == p.hi), None)
        right = next((p for p in pieces if z == p.lo), None)
        if not (left or right):
            row = rows[0]
            for p in pieces:
                lo, at_z, hi = (number(e.xreplace(row)) for e in (p.lo, z, p.hi))
                left = right = p if lo < at_z < hi else left
        maxima.append(Maximum(z, None, left, right))
    return maxima
