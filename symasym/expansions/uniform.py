"""T, C and P for weak noise, uniform as wells, barriers, the start and the ends of the layer meet.

The layer on each side of the start (`symasym.expansions.sides`) is a row of panels in canonical
form (`symasym.expansions.coalescence`), whose records are expansions in powers of kappa^2. With
L = eps lam, p_- = sum (-L)^-k p_k and p_+ = sum L^-k p_k, a panel's integrals with e^{lam V} and
e^{-lam V} reduce to those of p_+ and p_- with e and 1/e, e' = -L psi e: Airy functions over all s,
erfc and Dawson's integral over half of it, otherwise incomplete Airy functions. For any ends they
are those of the exact engine for the drift psi, -L in place of lam, so that its e is 1/e here, and
the weights p_- and p_+. The numbers are midpoints of balls: rounding is not enclosed, but each
partial sum is compared with the exact value in a ball, which costs less than the expansion.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache, partial, reduce
from typing import Any

import numpy as np
from flint import arb, ctx, fmpq

from symasym.base.balls import precision, rational
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Piece, Polynomial, pieces
from symasym.exact import balls, first_order
from symasym.exact.panels import panel_of, panels
from symasym.expansions import answer
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.coalescence import SHARE, CanonicalForm, Phi
from symasym.expansions.sides import Sides, Stretch, StretchAt, sides_of


def record(one: CanonicalForm, at: InBalls, nats: float) -> Stretch:
    """The record of a panel at one lam, to the order in `at`, up to N, and to e^-nats."""
    lam, order = at.lam, at.order
    L, p, c = one.eps * lam, np.array(one.p), np.array(one.c)
    minus = plus = slow = ends = np.zeros(2, object)
    regular: Any = 0
    for k in range(order + 1):
        sign, power = (-1) ** k, 1 / L ** (k + 1)
        minus, plus = minus + sign * power * L * p[k], plus + power * L * p[k]
        slow, ends = slow + sign * power * c[k], ends + power * c[k]
        mixed = sum((-1) ** (k - i) * row[k - i] for i, row in enumerate(one.mixed[: k + 1]))
        regular += power * (one.own[k] + mixed)
    digits, psi = math.ceil(nats / math.log(10)), ([1], [0, 1], [-one.zeta, 0, 1])[one.degree]
    with precision(balls.bits(digits)):
        low, high = (s.mid().fmpq() for s in one.ends)
        rows = psi, minus[: one.degree], plus[: one.degree]
        piece = Piece(low, high, *(Polynomial([arb(x).mid() for x in row]) for row in rows))
        row = panels([piece], -L.mid(), low, high, digits, panel_of)
        parts = [first_order.record(panel, 1) for panel in row]
        known = reduce(
            Stretch.then, (Stretch(x.z1, x.y2 * x.inverse, x.z2, x.inverse) for x in parts)
        )
    speed = known.speed + slow[1] - slow[0] * known.climb
    nested = known.nested - slow[0] * known.scale + regular - speed * ends[1]
    return Stretch(known.scale + ends[0] - known.climb * ends[1], speed, nested, known.climb)


@lru_cache(maxsize=16)
def _phi(drift: Drift, bits: int) -> Phi:
    return Phi(pieces(drift, fmpq(-1), fmpq(1))[0].phi)


@lru_cache(maxsize=32)
def _panels(
    drift: Drift, order: int, bits: int, mirrored: bool, low: Fraction, high: Fraction
) -> list[CanonicalForm]:
    """The panels of [low, high], of the drift or its mirror image."""
    phi = _phi(drift, bits)
    phi = phi.mirrored() if mirrored else phi
    return phi.panels(arb(rational(low)), arb(rational(high)), order)


class Uniform(answer.PartialSums):
    """The expansion in powers of kappa^2, with coalescing critical points taken together."""

    reason = "the noise is too strong for the uniform expansion"
    enclosed, float_digits = False, 10

    def bits(self, lam: Fraction, digits: int) -> int:
        """1.5 bits for each nat needed, in steps, so that similar noises share their panels."""
        return 12 * math.ceil((math.log(10) * digits + math.log(2 + lam)) / 8) + 40

    def known(self, bits: int) -> Sides:
        """The panels of the layer on both sides of the start."""
        ctx.cap = math.ceil(-_nats(bits) / math.log(SHARE))
        return sides_of(self.drift, self.between, self.name, self._layer)

    def _layer(self, *interval: Any) -> list[StretchAt]:
        panels = _panels(self.drift, self.length - 1, ctx.prec, *interval)
        return [partial(record, panel, nats=_nats(ctx.prec)) for panel in panels]

    def quantity(self, known: Sides, arithmetic: Any) -> Any:
        """The sum over both sides."""
        return known.sum(self.name, arithmetic).mid()


def _nats(bits: int) -> float:
    return (bits - 40) / 1.5


of_scene = partial(answer.of_scene, Uniform)
