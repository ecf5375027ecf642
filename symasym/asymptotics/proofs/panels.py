"""Panels on which V lies between two parallel lines, and the integral of e^{+-lam V} over them.

With |V - (h + s t)| <= b for 0 <= t <= w, the integral of e^{lam V} is within a factor e^{lam b} of
w phi_1(lam s w) e^{lam h}, phi_1(x) = (e^x - 1)/x; and where V is monotone it is at most the width,
or 1/(lam |V'|), times the larger of the two ends' values.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.numbers.balls import exact_ball, flint_module
from symasym.special.exponentials import ball_quotient


class Bounds(NamedTuple):
    """A positive number lies between these two."""

    low: Any
    high: Any

    def __add__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        return Bounds((self.low + other.low).lower(), (self.high + other.high).upper())


class LinePanel(NamedTuple):
    """V within `bend` of the line from `height` with `slope`, on a stretch of this width.

    `ends` are V there; `steep` is a lower bound of |V'|, at least 0.
    """

    width: Any
    height: Any
    slope: Any
    bend: Any
    ends: tuple[Any, Any]
    steep: Any

    def span(self) -> tuple[Any, Any]:
        """V's lower and upper bound."""
        if self.steep > 0:
            return self.ends[0].min(self.ends[1]), self.ends[0].max(self.ends[1])
        far = self.height + self.slope * self.width
        return self.height.min(far) - self.bend, self.height.max(far) + self.bend


def between_lines(panels: Sequence[LinePanel], lam: Fraction, sign: int) -> Bounds:
    """Bounds of int e^{sign lam V} over the panels; a ratio of e^{2 lam bend} on each."""
    number, size = exact_ball(sign * lam), exact_ball(lam)
    low = high = flint_module().arb(0)
    for p in panels:
        line = p.width * ball_quotient(number * p.slope * p.width, 1) * (number * p.height).exp()
        bend = (size * p.bend).exp()
        least, most = line / bend, line * bend
        if p.steep > 0 and not size * p.bend < 1:
            # Monotone: between the values at its ends.
            first, last = (number * v for v in p.ends)
            least = least.max(p.width * first.min(last).exp())
            most = most.min(p.width.min(1 / (size * p.steep)) * first.max(last).exp())
        low, high = low + least, high + most
    return Bounds(low.lower().max(flint_module().arb(0)), high.upper())
