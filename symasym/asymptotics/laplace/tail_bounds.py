"""Bounds of int |g| e^{lam (f - f(p))} away from the maxima p, in interval arithmetic.

On a box where f <= f(p) - drop and int |g| <= weight, it is at most weight e^{-lam drop}. From X to
infinity, with (log |g|)' + lam f' <= gamma - c lam there, it is at most
|g(X)| e^{-lam drop}/(c lam - gamma), drop = f(p) - f(X); with x times the derivative in place of
it, X times that (algebraic decay).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import sympy

from symasym.asymptotics.laplace.cauchy_disk import without_power
from symasym.asymptotics.laplace.kinks import Piece, number
from symasym.base.patience import step
from symasym.numbers.balls import NotProved
from symasym.numbers.extended_intervals import enclosure

if TYPE_CHECKING:
    from sympy import Expr, Symbol

_MOST_BOXES = 3000
_DEEPEST = 40
# What a few roundings can do.
_MORE = 1 + 1e-12

#: weight, drop, c, gamma: the integral is at most weight e^(-lam drop) / (c lam - gamma),
#: where a box has c = 0 and gamma = -1.
Part = tuple[float, float, float, float]


def boxes(piece: Piece, x: Symbol, lo: float, hi: float, top: float, gap: float) -> list[Part]:
    """Parts for [lo, hi], possibly infinite, where f should stay `gap` below `top`.

    `top` is a float not above f's maximum.
    """
    parts: list[Part] = []
    if math.isinf(hi):
        hi, part = _tail(piece.f, piece.g, x, lo, top)
        parts.append(part)
    if math.isinf(lo):
        mirror = {x: -x}
        start, part = _tail(piece.f.xreplace(mirror), piece.g.xreplace(mirror), x, -hi, top)
        parts.append(part)
        lo = -start
    waiting = [(lo, hi, 0)]
    while waiting:
        step()
        a, b, depth = waiting.pop()
        if not a < b:
            continue
        heights = enclosure(piece.f, x, a, b)
        # Far enough below, or as flat as it is low (a smaller maximum).
        if heights is not None and top - heights[1] > min(
            0.95 * gap, 3 * (heights[1] - heights[0])
        ):
            weight = _weight(piece, x, a, b)
            if weight is not None:
                parts.append((weight, _drop(top, heights[1]), 0.0, -1.0))
                continue
        if depth == _DEEPEST or len(parts) + len(waiting) > _MOST_BOXES:
            raise NotProved
        middle = (a + b) / 2
        waiting += [(a, middle, depth + 1), (middle, b, depth + 1)]
    return parts


def _drop(top: float, height: float) -> float:
    """top - height, rounded down; what is beyond 1e100 is nobody's concern."""
    return math.nextafter(min(top - height, 1e100), 0.0)


def _weight(piece: Piece, x: Symbol, a: float, b: float) -> float | None:
    """A bound of the integral of |g| over [a, b]."""
    width = math.nextafter(b - a, math.inf)
    size = _largest(piece.g, x, a, b)
    if size is not None:
        return size * width * _MORE
    for end, edge, sign in ((piece.lo, a, 1), (piece.hi, b, -1)):
        if end.is_infinite or abs(float(number(end)) - edge) > 1e-12 * max(1, abs(edge)):
            continue
        rest, front = without_power(piece.g, x, end, sign)
        size = _largest(rest, x, a, b)
        if size is not None and -1 < front < 0:
            power = float(front) + 1
            return float(size * (width * _MORE) ** power / power * _MORE)
    return None


def _largest(expression: Expr, x: Symbol, a: float, b: float) -> float | None:
    """A bound of the absolute value on [a, b]."""
    sizes = enclosure(expression, x, a, b)
    if sizes is None or math.isinf(sizes[0]) or math.isinf(sizes[1]):
        return None
    return max(abs(sizes[0]), abs(sizes[1]))


def _tail(f: Expr, g: Expr, x: Symbol, start: float, top: float) -> tuple[float, Part]:
    """(X, its part): the point where the interval to infinity is cut off, and the bound beyond.

    From there on either (log |g|)' + lam f' <= gamma - c lam, or the same times x: exponential
    or algebraic decay.
    """
    slope, growth = sympy.diff(f, x), None
    if g.has(x):
        growth = sympy.simplify(sympy.diff(g, x) / g)
    begin = max(start, 0.0) + 1
    for _ in range(40):
        begin *= 2
        here = enclosure(f, x, begin, begin)
        size = _largest(g, x, begin, begin)
        if here is None or size is None or not here[1] < top:
            continue
        for factor in (sympy.Integer(1), x):
            fall = enclosure(_factored(slope * factor, x), x, begin, math.inf)
            # fall[1] is rounded up from what may be 0.
            if fall is None or not fall[1] < 1e-300:
                continue
            gain = 0.0
            if growth is not None:
                everywhere = _largest(g, x, begin, math.inf)
                growths = enclosure(_factored(growth * factor, x), x, begin, math.inf)
                if growths is not None and not math.isinf(growths[1]):
                    gain = growths[1]
                elif everywhere is not None:
                    size = everywhere
                else:
                    continue
            # The integral of (y/X)^(-1 - s) over y > X is X/s.
            extra, shift = (begin, 1.0) if factor is x else (1.0, 0.0)
            steepness = max(min(-fall[1], 1e100), 0.0)
            if not steepness and gain + shift >= 0:
                continue
            return begin, (size * extra * _MORE, _drop(top, here[1]), steepness, gain + shift)
    raise NotProved


def _factored(expression: Expr, x: Symbol) -> Expr:
    """A form whose intervals reach to infinity without oo - oo or oo/oo."""
    top, bottom = sympy.fraction(sympy.together(expression))
    if not (top.is_polynomial(x) and bottom.is_polynomial(x)):
        return sympy.expand(expression)
    degree, parts = 0, []
    for part, sign in ((top, 1), (bottom, -1)):
        polynomial = sympy.Poly(part, x)
        degree += sign * polynomial.degree()
        parts.append(sum(c * x ** (m[0] - polynomial.degree()) for m, c in polynomial.terms()))
    return sympy.Mul(x**degree, parts[0], 1 / parts[1], evaluate=False)
