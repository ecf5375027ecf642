"""Where f is largest on [a, b]: pieces between kinks, zeros of f', ends, and which is highest.

At a kink (a zero of what stands in Abs or sign, a crossing of the arguments of Max and Min, an end
of a Piecewise's condition) each side is an end of its own (DLMF 2.3(iii)). With parameters free the
answer must be the same at all values tried that their assumptions allow.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from flint import arb, fmpq
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import InputError
from symasym.integrals.enclosure import Y, Stretch, Zero, compiled, number
from symasym.integrals.terms import Balls, NotAnalytic, Point, samples, values, vanishes

_KINKED = (sympy.Abs, sympy.sign, sympy.Heaviside, sympy.Max, sympy.Min, sympy.Piecewise)
_GRID = 801
#: Distances at which the fall towards an infinite end is looked at.
_FAR = (10**2, 10**4, 2 * 10**4, 5 * 10**4, 10**5, 3 * 10**5, 10**6)
# Parameters without a sign up to which the signs are tried.
_MOST_SIGNS = 3


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
        value = self.at(end)
        if value.is_finite():
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
            return arb("nan")

    @cached_property
    def stretches(self) -> list[Stretch]:
        """Both halves, with y for x such that f and g are analytic to the end, or it is at oo."""
        found = []
        for end, side in ((self.lo, 1), (self.hi, -1)):
            distance, far = abs(self.middle - end), self.ends[side] is None
            q = 1 if far else self._steps(end, side)
            of_y, lo, hi = end + side * Y**q, S.Zero, distance ** Rational(1, q)
            if far:
                of_y, hi = self.middle - side * Y, S.Infinity
            if far and end.is_finite:
                of_y, lo = end + side / Y, 1 / distance
            factor = abs(of_y.diff(Y))
            f, g = self.f.xreplace({self.x: of_y}), self.g.xreplace({self.x: of_y})
            g = sympy.Add(*(factor * sympy.powdenest(e, force=True) for e in sympy.Add.make_args(g)))
            found.append(Stretch(f, g, lo, hi, far))
        return found

    def _steps(self, end: Expr, side: int) -> int:
        """The q for which f and g are analytic in y at the end, |x - end| = y^q."""
        fronts: list[Any] = []
        for e in (self.f, self.g):
            try:
                fronts += [p for p, _ in Point(self.x, end, side, 4, Balls()).terms(e)]
            except (InputError, ValueError, ZeroDivisionError):
                return 1
        rational = all(p.is_Rational and p.q < 64 for p in fronts)
        return math.lcm(*(int(p.q) for p in fronts)) if rational and fronts else 1

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


def cut(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Piece]:
    """[a, b] cut at the kinks of f and g, with the branches that hold between."""
    kinks = sorted({z for e in (f, g) for z in _kinks(e, x)}, key=str)
    rows = samples(set().union(*(e.free_symbols for e in (a, b, *kinks))))
    orders = set()
    for row in rows:
        lo, hi = (number(e.xreplace(row)) for e in (a, b))
        placed = [(number(z.xreplace(row)), z) for z in kinks]
        inside = [(v, z) for v, z in placed if v > lo and v < hi]
        orders.add(tuple(z for _, z in sorted(inside, key=lambda pair: float(pair[0]))))
    if len(orders) > 1:
        raise InputError(
            f"where the kinks {', '.join(map(str, kinks))} lie in ({a}, {b}) depends on the "
            "parameters; give symbols with assumptions, or numbers."
        )
    ends = [a, *dict.fromkeys(orders.pop()), b]
    raw = [Piece(x, lo, hi, f, g) for lo, hi in itertools.pairwise(ends)]
    return [
        Piece(x, p.lo, p.hi, *(_smooth(e, x, p.middle) for e in (p.f, p.g))) for p in raw
    ]


def _kinks(e: Expr, x: Symbol) -> set[Expr]:
    """Zeros and crossings of the arguments of what has kinks, and ends of conditions."""
    found: set[Expr] = set()
    for node in e.atoms(*_KINKED):
        if isinstance(node, (sympy.Max, sympy.Min)):
            inner = [p - q for p, q in itertools.combinations(node.args, 2)]
        elif isinstance(node, sympy.Piecewise):
            relations = (c.atoms(sympy.core.relational.Relational) for _, c in node.args)
            inner = [r.lhs - r.rhs for r in set().union(*relations)]
        else:
            inner = [node.args[0]]
        for part in inner:
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
    while nodes := [n for n in e.atoms(*_KINKED) if n.has(x)]:
        node = min(nodes, key=lambda n: (sympy.count_ops(n), str(n)))
        e = e.xreplace({node: _branch(node, x, middle)})
    return e


def _branch(node: Any, x: Symbol, middle: Expr) -> Expr:
    def positive(part: Expr) -> bool:
        signs = {bool(v > 0) for v in values(part.xreplace({x: middle}))}
        if len(signs) > 1:
            raise InputError(
                f"the sign of {part} depends on the parameters; give symbols with assumptions."
            )
        return signs.pop()

    if isinstance(node, (sympy.Max, sympy.Min)):
        best = node.args[0]
        for other in node.args[1:]:
            if positive(other - best) is isinstance(node, sympy.Max):
                best = other
        return best
    if isinstance(node, sympy.Piecewise):
        for value, condition in node.args:
            holds = condition.replace(
                lambda c: isinstance(c, sympy.core.relational.Relational),
                lambda c: S.true if positive(c.gts - c.lts) else S.false,
            )
            if holds == True:  # noqa: E712
                return value
        raise InputError(f"{node} has no branch at {x} = {middle}; make the last condition True.")
    up = positive(node.args[0])
    if isinstance(node, sympy.Heaviside):
        return S(up)
    return (S.One if up else S.NegativeOne) * (node.args[0] if isinstance(node, sympy.Abs) else 1)


def highest(pieces: list[Piece]) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others; parameters have numbers."""
    maxima = []
    for left, right in itertools.pairwise([None, *pieces, None]):
        if right is not None:
            maxima += [Maximum(z, right.at(z), right, right) for z in _inside(right)]
        maxima += _at_end(left, right)
    top = max((m.height for m in maxima), key=lambda h: h.mid(), default=None)
    _require_decay(pieces, top)
    if top is None:
        raise InputError(
            f"f = {pieces[0].f} has no isolated maximum for {pieces[0].x} in [{pieces[0].lo}, "
            f"{pieces[-1].hi}]; give an f that is not constant, and an interval on which it is "
            "largest somewhere."
        )
    maxima.sort(key=lambda m: -m.height.mid())
    tops = [m for m in maxima if m.height.overlaps(top)]
    return tops, [m for m in maxima if m not in tops]


def _at_end(left: Piece | None, right: Piece | None) -> list[Maximum]:
    """The maximum at a finite end of the interval or at a kink, if it is one."""
    sides = [(p, s) for p, s in ((left, -1), (right, 1)) if p is not None and p.ends[s] is not None]
    top = max((p.ends[s] for p, s in sides), key=lambda h: h.mid(), default=None)
    sides = [(p, s) for p, s in sides if p.ends[s].overlaps(top)]
    end: Any = None
    for piece, side in sides:
        end = piece.lo if side > 0 else piece.hi
        near = side * number(abs(piece.middle - end))
        falls = [piece.at(number(end) + near / 2**k) - piece.ends[side] for k in (20, 12)]
        if not next((r for r in falls if not r.contains(0)), arb(1)) < 0:
            return []
    both = {side: piece for piece, side in sides}
    return [Maximum(end, top, both.get(-1), both.get(1))] if both else []


def _inside(piece: Piece) -> list[Any]:
    """The interior points at which f' changes its sign from + to -."""
    x, slope = piece.x, piece.f.diff(piece.x)
    if not slope.has(x):
        return []
    above, below = sympy.fraction(sympy.together(slope))
    if above.is_polynomial(x) and below.is_polynomial(x):
        zeros = _roots(above, x)
        poles = [(number(z), None) for z, _ in _roots(below, x)] if below.has(x) else []
        marks = sorted([*((number(z), z) for z, _ in zeros), *poles], key=lambda m: m[0].mid())
        return [z for z in _falling(piece, slope, marks) if z is not None]
    grid = _grid(piece)
    code = sympy.lambdify(x, slope, "scipy" if slope.has(sympy.erf) else "numpy")
    with np.errstate(all="ignore"):
        rise = np.asarray(code(grid) + 0 * grid)
    kept = np.flatnonzero(np.isfinite(rise) & (rise != 0))
    pairs = [(grid[i], grid[j]) for i, j in itertools.pairwise(kept) if rise[i] > 0 > rise[j]]
    return [z for low, high in pairs if (z := _between(slope, x, low, high)) is not None]


def _roots(p: Expr, x: Symbol) -> list[tuple[Any, int]]:
    """The real zeros of a polynomial with numbers, in closed form where that is short."""
    polynomial = sympy.Poly(p, x)
    found: list[tuple[Any, int]] = []
    for factor, order in polynomial.sqf_list()[1]:
        for root in factor.real_roots() if factor.domain.is_Exact else factor.nroots():
            short = not root.has(sympy.CRootOf) and sympy.count_ops(root) < 8
            near = Fraction(str(root.n(40)))
            found.append((root if short else Zero(factor.as_expr(), x, near), order))
    return found


def _falling(piece: Piece, slope: Expr, marks: list[tuple[Any, Any]]) -> list[Any]:
    """Those of the marks inside the piece at which f' changes from + to -."""
    lo, hi = number(piece.lo), number(piece.hi)
    marks = [(v, z) for v, z in marks if v > lo and v < hi]
    if not marks:
        return []
    first, last = marks[0][0], marks[-1][0]
    between = [(a + b) / 2 for (a, _), (b, _) in itertools.pairwise(marks)]
    before = (first + lo) / 2 if piece.lo.is_finite else first - 1 - abs(first)
    after = (last + hi) / 2 if piece.hi.is_finite else last + 1 + abs(last)
    code = compiled(slope, piece.x)
    signs = [code(v, False) for v in (before, *between, after)]
    steps = zip(marks, itertools.pairwise(signs), strict=True)
    return [z for (_, z), (a, b) in steps if a > 0 and b < 0]


def _grid(piece: Piece) -> Any:
    """Floats spread over the piece, Chebyshev points where it is finite."""
    lo, hi = float(number(piece.lo)), float(number(piece.hi))
    if np.isfinite(hi - lo):
        share = (1 - np.cos(np.pi * np.linspace(0, 1, _GRID)[1:-1])) / 2
        return lo * (1 - share) + hi * share
    parts = np.geomspace(1e-8, 1e-2, 61), np.linspace(0.015, 30, 1201), np.geomspace(31, 1e8, 201)
    reach = np.concatenate(parts)
    if np.isfinite(lo):
        return lo + reach
    return (hi - reach)[::-1] if np.isfinite(hi) else np.concatenate([-reach[::-1], [0.0], reach])


def _between(slope: Expr, x: Symbol, low: float, high: float) -> Any:
    """The zero of f' between two floats, recognised if it's a plain number; None at a pole."""
    code, a, b = compiled(slope, x), arb(float(low)), arb(float(high))
    steepest = max(abs(code(v, False)).mid() for v in (a, b))
    for _ in range(200):
        middle = ((a + b) / 2).mid()
        value = code(middle, False)
        if value.contains(0):
            a = b = middle
            break
        a, b = (middle, b) if value > 0 else (a, middle)
    if not abs(code(a, False)) <= steepest:
        return None
    sign = 1 if a > 0 else -1
    guesses = [(a, lambda r: r), (a / arb.pi(), lambda r: r * sympy.pi), (a * a, lambda r: sign * sympy.sqrt(r)), (a.exp(), sympy.log)]  # fmt: skip
    for v, form in guesses:
        exactly = Fraction(str(v.str(50, radius=False)))
        near = exactly.limit_denominator(10**6)
        if abs(near - exactly) < Fraction(1, 10**30):
            guess = form(Rational(near.numerator, near.denominator))
            if vanishes(slope.xreplace({x: guess})):
                return guess
    return Zero(slope, x, Fraction(str(a.str(50, radius=False))))


def _require_decay(pieces: list[Piece], top: Any) -> None:
    """Refuse an infinite end at which f doesn't stay below its maximum, or g grows too fast."""
    for end, piece, sign in ((pieces[0].lo, pieces[0], -1), (pieces[-1].hi, pieces[-1], 1)):
        heights = [piece.at(arb(sign * y)) for y in _FAR] if end.is_infinite else [arb("nan")]
        if any(h.is_nan() for h in heights):
            continue
        weight = compiled(piece.g, piece.x)
        logs = [
            (abs(weight(arb(sign * y), False)).log() + 2 * arb(y).log()).upper()
            for y in (_FAR[0], _FAR[-1])
        ]
        near, far = heights[0], heights[-1]
        flat = bool(abs(far - heights[1]) < 0.01)
        rising = top is None or bool(far >= top)
        rising |= any(bool(b > a) for a, b in itertools.pairwise(heights[1:]))
        if rising or (flat and logs[1] > arb(_FAR[-1]).log()):
            raise InputError(
                f"f = {piece.f} does not fall as {piece.x} tends to {end}, so the integral "
                "diverges or has no maximum to expand at; give an interval on which f has a "
                "maximum and decays."
            )
        growth = (logs[0] / (top - near).max(arb(1))).max(arb(1))
        if not flat and logs[1] / (top - far) > 100 * growth:
            raise InputError(
                f"g = {piece.g} grows faster than e^(lam f) decays as {piece.x} tends to {end}, so "
                "the integral diverges for every lam; give a g of slower growth."
            )


def with_parameters(pieces: list[Piece], given: list[Expr] | None) -> list[Maximum]:
    """The points where f is largest while parameters are free: ends, kinks and zeros of f'.

    Raises
    ------
    InputError
        Where that depends on the parameters; it asks for a sign where one decides.
    """
    try:
        return _the_same(pieces, given)
    except InputError as refusal:
        raise InputError(_sign_needed(pieces, given) or str(refusal)) from None


def _the_same(pieces: list[Piece], given: list[Expr] | None) -> list[Maximum]:
    """The same, at all samples; an error where they differ."""
    points = [e for p in pieces for e in (p.lo, p.hi) if not e.is_infinite]
    x = pieces[0].x
    for piece in [] if given is not None else pieces:
        try:
            points += [z for z in sympy.solve(piece.f.diff(x), x) if z.is_real is not False]
        except NotImplementedError:
            continue
    points = list(dict.fromkeys(points if given is None else given))
    parts = [e for p in pieces for e in (p.lo, p.hi, p.f, p.g)]
    free = set().union(*(e.free_symbols for e in (*parts, *points))) - {x}
    chosen: list[Any] | None = None
    for row in samples(free):
        tops, _ = highest([p.bound(row) for p in pieces])
        heights = [number(m.point) for m in tops]
        at = [(z, number(z.xreplace(row))) for z in points]
        found = [z for z, v in at if v.is_finite() and any(v.overlaps(h) for h in heights)]
        if len(found) < len(tops) or chosen not in (None, found):
            shown = ", ".join(f"{s} = {v}" for s, v in row.items())
            raise InputError(
                f"where f = {pieces[0].f} is largest could not be decided for all parameters "
                f"(tried {shown}); give maxima=[…], symbols with assumptions, or numbers."
            )
        chosen = found
    maxima = []
    for z in chosen or []:
        left = next((p for p in pieces if z == p.hi), None)
        right = next((p for p in pieces if z == p.lo), None)
        if left is None and right is None:
            row = samples(free, 1)[0]
            value = number(z.xreplace(row))
            bounds = [(p, *(number(e.xreplace(row)) for e in (p.lo, p.hi))) for p in pieces]
            left = right = next(p for p, lo, hi in bounds if value > lo and value < hi)
        maxima.append(Maximum(z, None, left, right))
    return maxima


def _sign_needed(pieces: list[Piece], given: list[Expr] | None) -> str | None:
    """The request for the signs of parameters with which the maximum is decided, None for none."""
    parts = {e for p in pieces for e in (p.lo, p.hi, p.f, p.g)}
    free = set().union(*(e.free_symbols for e in parts)) - {pieces[0].x}
    unknown = sorted((s for s in free if s.is_positive is s.is_negative is None), key=str)
    calls, rules = [], []
    if len(unknown) <= _MOST_SIGNS:
        for signs in itertools.product(("positive", "negative"), repeat=len(unknown)):
            pairs = list(zip(unknown, signs, strict=True))
            row = {s: Symbol(s.name, **{sign: True}) for s, sign in pairs}
            try:
                _the_same([p.bound(row) for p in pieces], given and [z.xreplace(row) for z in given])
            except InputError:
                continue
            calls.append(", ".join(f"Symbol('{s}', {sign}=True)" for s, sign in pairs))
            rules.append(" and ".join(f"{s} must be {sign}" for s, sign in pairs))
    if not unknown or not calls:
        return None
    if len(calls) == 1:
        return (
            f"f = {pieces[0].f} has no maximum for some values of its parameters; {rules[0]}: pass "
            f"{calls[0]}."
        )
    return (
        f"where f = {pieces[0].f} is largest depends on the sign of "
        f"{', '.join(map(str, unknown))}; pass {' or '.join(calls)}."
    )
