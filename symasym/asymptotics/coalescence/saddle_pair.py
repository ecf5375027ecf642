"""Two coalescing saddles: Airy functions, with coefficients from the cubic map.

With f = level + s³/3 - zeta s and g dx = G ds, G = a_0 + b_0 s + (s² - zeta) H_0, one integration
by parts turns (s² - zeta) H_0 into -H_0'/lam: a_n and b_n are those of G_n, G_(n+1) = H_n'
(Chester, Friedman and Ursell; DLMF 2.4(v)). From G = sum (p_k + q_k s)(s² - zeta)^k this takes no
division, so nothing is lost at the coalescence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.asymptotics.coalescence.endpoints import Term, kept, series_of
from symasym.asymptotics.laplace.expansion import refined
from symasym.asymptotics.laplace.kinks import Piece
from symasym.base.errors import AccuracyError
from symasym.series.coefficient_fields import RealField
from symasym.series.quadratic_factor import Pair, split_pair
from symasym.special.airy import by_parts

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real

_MOST_TERMS = 800


@dataclass(frozen=True)
class PairPart:
    """The pair of `phase`'s stationary points next to `point`, a zero of its second derivative.

    oscillating: the integral of weight e^(i lam phase) along the real axis. Otherwise that of
    weight e^(lam phase) from the valley in the lower half plane to the one in the upper, over i.
    """

    piece: Piece
    x: Symbol
    point: Real
    oscillating: bool

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """2 pi e^(lam level) (-lam)^-n (a_n Ai lam^(-1/3) - b_n Ai' lam^(-2/3)), of lam^(2/3) zeta.

        Of an oscillating integral the same with lam/i; the sizes have the modulus functions for Ai.
        """
        zeta, level, sign, a_, b_ = kept(self, count, context, self.coefficients)
        cube = context.cbrt(lam)
        argument = (-1 if self.oscillating else 1) * cube**2 * zeta
        ai, slope = context.airyai(argument), context.airyai(argument, derivative=1)
        # Ai and Ai' have zeros on the oscillating side; the modulus functions don't.
        size, size_slope = abs(ai), abs(slope)
        if argument < 0:
            size = context.hypot(ai, context.airybi(argument))
            size_slope = context.hypot(slope, context.airybi(argument, derivative=1))
        unit = context.j if self.oscillating else context.mpf(1)
        step = context.j / lam if self.oscillating else -1 / lam
        front = 2 * context.pi * sign * context.exp(unit * lam * level)
        turn = -context.j if self.oscillating else -1
        terms = []
        for n in range(count):
            a, b = a_[n], b_[n]
            value = front * step**n * (a * ai / cube + turn * b * slope / cube**2)
            spread = abs(a) * size / cube + abs(b) * size_slope / cube**2
            terms.append((value, abs(front) * spread / lam**n))
        return terms

    def coefficients(self, count: int, context: MPContext) -> tuple[Any, ...]:
        """zeta, level and sign of the map, and a_n, b_n without their powers of i or -1."""
        f, weights = self.piece.f, (self.piece.g,)
        _, pair, (weight,), start = nearby_pair(
            f, weights, self.x, self.point, 2 * count - 1, context
        )
        pq = map_coefficients(pair, 2 * count - 1, context, weight)
        return (pair.zeta, start + pair.level, pair.sign, *by_parts(pair.zeta, pq, count))


class Nearby(NamedTuple):
    """A pair of saddles, about `point`, where f is `start` and the weights have these series."""

    point: Real
    pair: Pair
    weights: list[list[Any]]
    start: Any


def nearby_pair(
    f: Expr, weights: tuple[Expr, ...], x: Symbol, point: Real, count: int, context: MPContext
) -> Nearby:
    """The pair of f' about `point`, a zero of its slope.

    From as many coefficients as `count` pairs of the cubic map and the digits ask for.
    """
    field = RealField(context)
    # refined finds zeros of a derivative: here of f''.
    curved = Piece(-sympy.oo, sympy.oo, sympy.diff(f, x), sympy.Integer(1))
    point = field.expression(refined(curved, x, point, field))
    n = 2 * count + 30
    while True:
        steep = series_of("f", f, x, point, 1, n + 1, field)
        rows = [series_of("g", g, x, point, 1, n, field) for g in weights]
        c = [(k + 1) * y for k, y in enumerate(steep[1:])]
        try:
            pair = split_pair(without_zeros(c, 3), context)
        except AccuracyError:
            raise _too_far(x, point, context) from None
        distance = context.sqrt(abs(pair.square)) + abs(pair.middle)
        # Polynomials are known as a whole. (A last coefficient of 0 does not make one.)
        series = [
            row
            for e, row in zip((f, *weights), (c[2:], *rows), strict=True)
            if not e.is_polynomial(x)
        ]
        reach = max((distance * root_test(row, context) for row in series), default=context.zero)
        needed = 2 * count + 6
        if reach > 0:
            needed += int(context.dps / max(-context.log10(reach), context.mpf("0.001")))
        if reach >= 1 or needed > _MOST_TERMS:
            raise _too_far(x, point, context)
        if needed <= n:
            return Nearby(point, pair, [without_zeros(row) for row in rows], steep[0])
        n = needed + needed // 10


def root_test(row: list[mpf], context: MPContext) -> mpf:
    """One over the radius of convergence, roughly."""
    top = max(abs(y) for y in row[:3])
    later = [(k, y) for k, y in enumerate(row) if k >= max(1, len(row) // 2) and y and top]
    return max((context.root(abs(y) / top, k) for k, y in later), default=context.zero)


def _too_far(x: Symbol, point: Real, context: MPContext) -> AccuracyError:
    """The error that the pair is not alone."""
    return AccuracyError(
        f"no pair of saddles next to {x} = {context.nstr(point, 8)} is alone within the "
        "radius of convergence, so they're too far apart, or a third is near; give near=… for "
        "another pair, or take each saddle by itself, as laplace_integral does."
    )


def without_zeros(c: list[Any], least: int = 1) -> list[Any]:
    """Polynomials without the zeros behind them, which only cost time."""
    n = len(c)
    while n > least and c[n - 1] == 0:
        n -= 1
    return c[:n]
