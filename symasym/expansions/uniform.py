"""T, C and P for weak noise, uniform as wells, barriers, the start and the ends of the layer meet.

The layer on each side of the start (`symasym.expansions.sides`) is a row of panels in canonical
form, whose records are expansions in powers of kappa^2 (`symasym.expansions.canonical`). Each
partial sum is compared with the exact value in a ball, which costs less than the expansion.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache, partial
from typing import Any

from flint import ctx, fmpq

from symasym.base.balls import exact_ball
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.expansions import answer
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.canonical import ways
from symasym.expansions.coalescence import SHARE, CanonicalForm, Phi
from symasym.expansions.sides import Sides, Stretch, StretchAt, sides_of


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
    return phi.panels(exact_ball(low), exact_ball(high), order)


class Uniform(answer.PartialSums):
    """The expansion in powers of kappa^2, with coalescing critical points taken together."""

    reason = "where the noise is too strong for the uniform expansion"
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
        return [partial(_record, panel) for panel in panels]

    def quantity(self, known: Sides, arithmetic: Any) -> Any:
        """The sum over both sides."""
        return known.sum(self.name, arithmetic).mid()


def _record(panel: CanonicalForm, at: InBalls) -> Stretch:
    return ways(panel, at.lam, _nats(ctx.prec))[at.order]


def _nats(bits: int) -> float:
    return (bits - 40) / 1.5


of_scene = partial(answer.of_scene, Uniform)
