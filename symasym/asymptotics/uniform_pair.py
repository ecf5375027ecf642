"""Two coalescing saddles: Airy functions, with coefficients from the cubic map.

With f = level + s³/3 - zeta s and g dx = G ds, G = a_0 + b_0 s + (s² - zeta) H_0, one integration
by parts turns (s² - zeta) H_0 into -H_0'/lam: a_n and b_n are those of G_n, G_(n+1) = H_n'
(Chester, Friedman and Ursell; DLMF 2.4(v)). From G = sum (p_k + q_k s)(s² - zeta)^k this takes no
division, so nothing is lost at the coalescence.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import sympy

from symasym.asymptotics.airy_products import by_parts
from symasym.asymptotics.cubic_map import map_coefficients
from symasym.asymptotics.cubic_pair import Pair, split_pair
from symasym.asymptotics.local_expansion import refined
from symasym.asymptotics.pieces import Piece
from symasym.asymptotics.rings import NumberRing
from symasym.asymptotics.uniform_ends import Term, kept, series_of
from symasym.errors import AccuracyError

_MOST_TERMS = 800


@dataclass(frozen=True)
class PairPart:
    """The pair of `phase`'s stationary points next to `point`, a zero of its second derivative.

    oscillating: the integral of weight e^(i lam phase) along the real axis. Otherwise that of
    weight e^(lam phase) from the valley in the lower half plane to the one in the upper, over i.
    """

    piece: Piece
    x: Any
    point: Any
    oscillating: bool

    def terms(self, lam: Any, count: int, context: Any) -> list[Term]:
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

    def coefficients(self, count: int, context: Any) -> tuple[Any, ...]:
        """zeta, level and sign of the map, and a_n, b_n without their powers of i or -1."""
        pair, weight, start = self._pair(2 * count - 1, context)
        pq = map_coefficients(pair, 2 * count - 1, context, weight)
        return (pair.zeta, start + pair.level, pair.sign, *by_parts(pair.zeta, pq, count))

    def _pair(self, count: int, context: Any) -> tuple[Pair, list[Any], Any]:
        """The pair from as many Taylor coefficients as the digits ask for."""
        ring = NumberRing(context)
        slope = sympy.diff(self.piece.f, self.x)
        # refined finds zeros of a derivative: here of f''.
        curved = Piece(self.piece.lo, self.piece.hi, slope, self.piece.g)
        point = ring.expression(refined(curved, self.x, self.point, ring))
        n = 2 * count + 30
        while True:
            f = series_of("f", self.piece.f, self.x, point, 1, n + 1, ring)
            g = series_of("g", self.piece.g, self.x, point, 1, n, ring)
            c = [(k + 1) * y for k, y in enumerate(f[1:])]
            try:
                pair = split_pair(without_zeros(c, 3), context)
            except AccuracyError:
                raise self._too_far(context, point) from None
            reach = self._reach(pair, c, g, context)
            needed = 2 * count + 6
            if reach > 0:
                needed += int(context.dps / max(-context.log10(reach), context.mpf("0.001")))
            if reach >= 1 or needed > _MOST_TERMS:
                raise self._too_far(context, point)
            if needed <= n:
                return pair, without_zeros(g), f[0]
            n = needed + needed // 10

    @staticmethod
    def _reach(pair: Pair, c: list[Any], g: list[Any], context: Any) -> Any:
        """Half the pair's distance over the radius of convergence, by the root test."""
        distance = context.sqrt(abs(pair.square)) + abs(pair.middle)
        found = context.mpf(0)
        for row in (c[2:], g):
            top = max(abs(y) for y in row[:3])
            if without_zeros(row) != row:
                # A polynomial, known as a whole.
                continue
            for k in range(len(row) // 2, len(row)):
                if top and row[k]:
                    found = max(found, distance * context.root(abs(row[k]) / top, k))
        return found

    def _too_far(self, context: Any, point: Any) -> AccuracyError:
        return AccuracyError(
            f"no pair of saddles next to {self.x} = {context.nstr(point, 8)} is alone within the "
            "radius of convergence, so they're too far apart, or a third is near; give near=… for "
            "another pair, or expand each saddle by itself with laplace_integral."
        )


def without_zeros(c: list[Any], least: int = 1) -> list[Any]:
    """Polynomials without the zeros behind them, which only cost time."""
    n = len(c)
    while n > least and c[n - 1] == 0:
        n -= 1
    return c[:n]
