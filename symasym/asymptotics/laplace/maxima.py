"""The maxima of f on an interval: interior ones, ends and kinks.

An interior maximum is a zero of f' at which its sign changes from + to -: of a polynomial or
rational f' all are isolated exactly; of others those between sign changes on a grid are bisected,
and recognised where they are a rational, its multiple of pi, its square root or its logarithm. An
end or a kink is a maximum where f falls on every side that it has. At infinite ends f has to fall,
and g not to grow faster than e^(lam f) falls.
"""

from __future__ import annotations

import itertools
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy

from symasym.asymptotics.laplace.kinks import WORK, Piece, at, number
from symasym.base.call_context import expect, mpf_of, own_context, step
from symasym.base.errors import InputError
from symasym.base.inputs import exact
from symasym.drift.expressions import expect_algebra, quotient_of
from symasym.numbers.polynomials import poly
from symasym.numbers.trees import MpmathOps, NotRational, NumpyOps, evaluate_tree
from symasym.series.coefficient_fields import vanishes

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.base.inputs import FloatArray

# Values of f closer than this (relatively) are one maximum's height.
_EQUAL = Fraction(1, 10**35)
_SAME_POINT = Fraction(1, 10**20)
_GRID = 801
# Parameters without a sign up to which the signs are tried.
_MOST_SIGNS = 3
# Symbols of an f' whose zeros SymPy finds in a short time, if at all.
_MOST_SYMBOLS = 6
# Degree up to which zeros are given exactly; seconds that isolating others takes, for each bit of
# their coefficients and square of their degree.
_RADICALS, _SECONDS = 40, 1e-7
# Distances at which the fall towards an infinite end is looked at, and those between the last two.
_FAR, _BETWEEN = (10**2, 10**4, 10**6), (2 * 10**4, 5 * 10**4, 10**5, 3 * 10**5)


@dataclass(frozen=True)
class Maximum:
    """A local maximum of f on the closed interval.

    Attributes
    ----------
    point : Expr or mpf
        Exact where it was recognised.
    height : mpf
        f there.
    left, right : Piece or None
        What f and g are on either side, None where the interval or the maximum ends.
    """

    point: Real
    height: mpf
    left: Piece | None
    right: Piece | None

    @property
    def smooth(self) -> bool:
        """True if one pair of expressions f, g holds on both sides."""
        return self.left is not None and self.left is self.right


def local_maxima(pieces: list[Piece], x: Symbol) -> list[Maximum]:
    """All local maxima of f (numbers only, no free parameters), the highest first."""
    maxima: list[Maximum] = []
    for index, piece in enumerate(pieces):
        slope = sympy.diff(piece.f, x)
        if vanishes_identically(slope, x):
            continue
        for point in interior_maxima(piece, slope, x):
            maxima.append(Maximum(point, at(piece.f, x, point), piece, piece))
        neighbour = pieces[index + 1] if index + 1 < len(pieces) else None
        if index == 0 and not piece.lo.is_infinite:
            maxima += _at_end(piece.lo, None, piece, x)
        if not piece.hi.is_infinite:
            maxima += _at_end(piece.hi, piece, neighbour, x)
    _require_decay(pieces, x, max((p.height for p in maxima), default=None))
    return sorted(maxima, key=lambda maximum: -maximum.height)


def vanishes_identically(slope: Expr, x: Symbol) -> bool:
    """True if the slope is the zero function."""
    return bool(slope == 0) or (not slope.has(x) and vanishes(slope))


def agree(first: mpf, second: mpf, tolerance: Fraction = _EQUAL) -> bool:
    """True if two mpf are equal to a relative tolerance (absolute below 1).

    Two heights are, if they agree to all but the last of the digits they were computed with.
    """
    with own_context(WORK) as context:
        a, b = context.make_mpf(first._mpf_), context.make_mpf(second._mpf_)
        return bool(abs(a - b) <= mpf_of(tolerance, context) * max(1, abs(a)))


def interior_maxima(piece: Piece, slope: Expr, x: Symbol) -> list[Real]:
    """The interior points at which f' changes its sign from + to -."""
    isolated = _polynomial_roots(piece, slope, x)
    if isolated is not None:
        return isolated
    expect_algebra(slope)
    grid = grid_of(piece)
    values = on_grid(slope, x, grid)
    brackets, last = [], None
    for k in np.flatnonzero(np.isfinite(values) & (values != 0)):
        if last is not None and values[last] > 0 > values[k]:
            brackets.append((grid[last], grid[k]))
        last = k
    return [point for low, high in brackets if (point := _root(slope, x, low, high)) is not None]


def _polynomial_roots(piece: Piece, slope: Expr, x: Symbol) -> list[Real] | None:
    """The interior maxima where f' is a polynomial or a quotient of two; None where it is not."""
    rises = _numerator(piece.f, slope, x)
    if rises is None:
        return None
    lo, hi = number(piece.lo), number(piece.hi)
    roots = [(root, value) for root, value in _odd_roots(rises, x) if lo < value < hi]
    if not roots:
        return []
    values = [value for _, value in roots]
    marks = [_step(values[0], lo, -1), *_middles(values), _step(values[-1], hi, 1)]
    signs = [at(slope, x, mark) for mark in marks]
    return [
        root
        for (root, _), before, after in zip(roots, signs, signs[1:], strict=False)
        if before > 0 > after
    ]


def _numerator(f: Expr, slope: Expr, x: Symbol) -> Any:
    """The numerator of f' in QQ[x], from f where that is rational, too, and shorter; or None."""
    for expression in (f, slope):
        try:
            quotient = quotient_of(expression, x)
        except (NotRational, InputError, ZeroDivisionError):
            continue
        return (quotient.diff(quotient.field.gens[0]) if expression is f else quotient).numer
    return None


def _odd_roots(polynomial: Any, x: Symbol) -> list[tuple[Real, mpf]]:
    """The real zeros of odd order of an element of QQ[x], ascending, with their numbers."""
    whole = sympy.Poly.from_dict(dict(polynomial), x, domain=sympy.QQ)
    odd = sympy.Poly(1, x, domain=sympy.QQ)
    for factor, order in whole.sqf_list()[1]:
        if order % 2:
            odd *= factor
    odd = odd.clear_denoms(convert=True)[1]
    if odd.degree() <= _RADICALS:
        exact_roots = sorted(sympy.real_roots(odd), key=number_of_root)
        # A root of higher degree stays a number: its radicals, if it has any, are no use.
        values = [number_of_root(r) for r in exact_roots]
        return [(r if _short(r) else v, v) for r, v in zip(exact_roots, values, strict=True)]
    bits = max(int(abs(c)).bit_length() for c in odd.all_coeffs())
    expect(odd.degree() ** 2 * bits * _SECONDS, f"isolating zeros of degree {odd.degree():,}")
    coefficients = [int(c) for c in odd.all_coeffs()[::-1]]
    isolated = sorted(interval for interval, _ in odd.intervals())
    numbers = [
        _between(coefficients, *(Fraction(int(y.p), int(y.q)) for y in interval))
        for interval in isolated
    ]
    return [(value, value) for value in numbers]


def _between(coefficients: list[int], low: Fraction, high: Fraction) -> mpf:
    """The one zero in [low, high], by halving."""
    with own_context(WORK) as context:
        context.prec += max(abs(c) for c in coefficients).bit_length() + len(coefficients)
        a, b = (mpf_of(end, context) for end in (low, high))
        ends = [poly(coefficients, y) for y in (a, b)]
        if not all(ends):
            return b if ends[0] else a
        for _ in range(4 * WORK):
            step()
            middle = (a + b) / 2
            a, b = (middle, b) if (poly(coefficients, middle) > 0) == (ends[0] > 0) else (a, middle)
        return (a + b) / 2


@lru_cache(maxsize=256)
def number_of_root(root: Expr) -> mpf:
    """A real root, isolated exactly, as an mpf."""
    if isinstance(root, sympy.CRootOf):
        value = root.eval_rational(dx=sympy.Rational(1, 10 ** (2 * WORK)))
        return number(value)
    return number(root)


def _short(root: Expr) -> bool:
    """True if the root has a short closed form."""
    return not root.has(sympy.CRootOf) and sympy.count_ops(root) < 8


def _middles(values: list[mpf]) -> list[mpf]:
    """The points half-way between neighbours."""
    with own_context(WORK) as context:
        points = [context.make_mpf(value._mpf_) for value in values]
        return [(first + second) / 2 for first, second in zip(points, points[1:], strict=False)]


def _step(value: mpf, end: mpf, sign: int) -> mpf:
    """A point between a root and the end of the piece on its `sign` side."""
    with own_context(WORK) as context:
        value, end = context.make_mpf(value._mpf_), context.make_mpf(end._mpf_)
        if context.isinf(end):
            return value + sign * (1 + abs(value))
        return (value + end) / 2


def grid_of(piece: Piece) -> FloatArray:
    """Floats spread over the piece, Chebyshev points where it is finite."""
    lo, hi = float(number(piece.lo)), float(number(piece.hi))
    if np.isfinite(lo) and np.isfinite(hi):
        share = (1 - np.cos(np.pi * np.linspace(0, 1, _GRID)[1:-1])) / 2
        return lo * (1 - share) + hi * share
    reach = np.concatenate([np.geomspace(1e-8, 1e-2, 61), np.linspace(0.015, 30, 1201)])
    reach = np.concatenate([reach, np.geomspace(31, 1e8, 201)])
    if np.isfinite(lo):
        return lo + reach
    if np.isfinite(hi):
        return (hi - reach)[::-1]
    return np.concatenate([-reach[::-1], [0.0], reach])


def on_grid(expression: Expr, x: Symbol, grid: FloatArray) -> FloatArray:
    """The expression on the grid, in float64; nan where it is singular."""
    with np.errstate(all="ignore"):
        return np.asarray(evaluate_tree(expression, {x: grid}, NumpyOps()) + 0 * grid)


def _root(slope: Expr, x: Symbol, low: float, high: float) -> Real | None:
    """The zero of f' between two floats, recognised if it's a plain number; None at a pole."""
    with own_context(WORK + 20) as context:
        ops = MpmathOps(context)
        a, b = context.mpf(float(low)), context.mpf(float(high))
        start = max(abs(evaluate_tree(slope, {x: y}, ops)) for y in (a, b))
        for _ in range(context.prec + 60):
            middle = (a + b) / 2
            value = evaluate_tree(slope, {x: middle}, ops)
            if value == 0:
                a = b = middle
                break
            a, b = (middle, b) if value > 0 else (a, middle)
        middle = (a + b) / 2
        if abs(evaluate_tree(slope, {x: a}, ops)) > start:
            return None
        candidates = [(_nearest(middle, context), sympy.Integer(1), "mul")]
        candidates.append((_nearest(middle / context.pi, context), sympy.pi, "mul"))
        candidates.append((_nearest(middle * middle, context), sympy.sign(float(low)), "sqrt"))
        candidates.append((_nearest(context.exp(middle), context), sympy.Integer(1), "log"))
    for value, factor, kind in candidates:
        if value is None:
            continue
        rational = sympy.Rational(value.numerator, value.denominator)
        guess = {
            "mul": lambda r, c: r * c,
            "sqrt": lambda r, c: c * sympy.sqrt(r),
            "log": lambda r, c: sympy.log(r),
        }[kind](rational, factor)
        if vanishes(slope.xreplace({x: guess})):
            return guess
    return middle


def _nearest(value: mpf, context: MPContext) -> Fraction | None:
    """The rational of small denominator that agrees with a number to thirty digits, or None."""
    exponent = value._mpf_[2]
    if abs(exponent + value.bc if hasattr(value, "bc") else exponent) > 4 * context.prec:
        return Fraction(0) if exponent < 0 else None
    rational = exact("point", value)
    near = rational.limit_denominator(10**6)
    return near if abs(near - rational) < Fraction(1, 10**30) else None


def _at_end(end: Expr, left: Piece | None, right: Piece | None, x: Symbol) -> list[Maximum]:
    """The maximum at a finite end of the interval or at a kink, if it is one."""
    heights = {}
    for name, piece, sign in (("left", left, -1), ("right", right, 1)):
        if piece is None:
            continue
        height = _limit(piece, x, end, sign)
        if height is not None:
            heights[name] = height
    if not heights:
        return []
    top = max(heights.values())
    sides: dict[str, Piece | None] = {"left": None, "right": None}
    for name, piece, sign in (("left", left, -1), ("right", right, 1)):
        if piece is None or name not in heights or not agree(heights[name], top):
            continue
        if not _falls(piece, x, end, sign):
            return []
        sides[name] = piece
    return [Maximum(end, top, sides["left"], sides["right"])]


def _limit(piece: Piece, x: Symbol, end: Expr, side: int) -> mpf | None:
    """f at an end, from inside; None if it is -oo there."""
    value = at(piece.f, x, end)
    with own_context(WORK) as context:
        if not context.isnan(value) and not context.isinf(value):
            return value
        with suppress(ZeroDivisionError, ValueError):
            # OverflowError where SymPy would take digits without end.
            evaluate_tree(piece.f, {x: number(end)}, MpmathOps(context))
    expect_algebra(piece.f, searched=True)
    try:
        limit = sympy.limit(piece.f, x, end, "+" if side > 0 else "-")
    except NotImplementedError:
        limit = sympy.nan
    if limit == -sympy.oo:
        return None
    between = isinstance(limit, sympy.AccumBounds)
    if limit in (sympy.oo, sympy.zoo, sympy.nan) or between or not limit.is_real:
        raise InputError(
            f"f = {piece.f} tends to {limit} at {x} = {end}, so the integral diverges or is "
            "complex; give an f that is bounded above on [a, b]."
        )
    return number(limit)


def _falls(piece: Piece, x: Symbol, end: Expr, side: int) -> bool:
    """True if f decreases away from the end into the piece."""
    here = _limit(piece, x, end, side)
    lo, hi = number(piece.lo), number(piece.hi)
    with own_context(WORK) as context:
        width = context.mpf(1) if context.isinf(hi - lo) else hi - lo
        start = number(end)
        for k in (20, 12):
            there = at(piece.f, x, start + side * width * context.mpf(2) ** -k)
            if there != here:
                return bool(there < here)
    return False


def _require_decay(pieces: list[Piece], x: Symbol, top: mpf | None) -> None:
    """Refuse an infinite end at which f doesn't stay below its maximum, or g grows too fast."""
    for end, piece, sign in ((pieces[0].lo, pieces[0], -1), (pieces[-1].hi, pieces[-1], 1)):
        if not end.is_infinite:
            continue
        shift = {x: sign * x}
        f, g = piece.f.xreplace(shift), piece.g.xreplace(shift)
        values = [at(f, x, sympy.Integer(y)) for y in _FAR]
        weights = [at(g, x, sympy.Integer(y)) for y in _FAR]
        with own_context(WORK) as context:
            logs = [
                context.log(abs(w)) + 2 * context.log(y) if w else -context.inf
                for w, y in zip(weights, _FAR, strict=True)
            ]
            if any(context.isnan(v) for v in values):
                continue
            far = [values[1], *(at(f, x, sympy.Integer(y)) for y in _BETWEEN), values[2]]
            rising = top is None or values[2] >= top
            rising |= any(later > earlier for earlier, later in itertools.pairwise(far))
            flat = abs(values[2] - values[1]) < context.mpf(10) ** -2
            if rising or (flat and logs[2] > context.log(_FAR[2])):
                raise InputError(
                    f"f = {piece.f} does not fall as {x} tends to {end}, so the integral diverges "
                    "or has no maximum to expand at; give an interval on which f has a maximum "
                    "and decays."
                )
            if not flat and logs[2] / -(values[2] - top) > 100 * max(
                1, logs[0] / max(1, -(values[0] - top))
            ):
                raise InputError(
                    f"g = {piece.g} grows faster than e^(lam f) decays as {x} tends to {end}, so "
                    "the integral diverges for every lam; give a g of slower growth."
                )
