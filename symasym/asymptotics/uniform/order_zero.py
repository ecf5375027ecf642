"""T by the uniform formula of order 0, polynomial A: many drifts in float64, or one to any digits.

Wells, barriers and pairs of both sides of the start (`symasym.asymptotics.weak_noise.compose`),
with the canonical Airy form of pairs that may coalesce and the truncated Gaussian of a barrier next
to an end (`symasym.asymptotics.uniform.order_zero_forms`), for zeros of A however close to each
other or to the layer's end. Which zeros go together is decided in float64 (`.pairing_arrays` for
many drifts, `.structure` for one); `OrderZero` is what follows from it, once for both: with
digits, zeros, differences of the potential, Airy functions and Dawson's integral have all of them.
The error of order 0 is that of the next terms (sizes from `order_zero_forms`) times `SAFETY`, and
what the start or an end cuts off a pair (`with_left_out`).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.uniform.order_zero_forms import (
    AiryForm,
    AiryIntegral,
    Truncated,
    TruncatedIntegral,
    airy_form,
    regular_share,
    truncated_gaussian,
)
from symasym.asymptotics.weak_noise import evaluation
from symasym.asymptotics.weak_noise.compose import Composed
from symasym.asymptotics.weak_noise.one_sided import (
    Builder,
    CriticalPoint,
    Joint,
    OneSided,
    first,
)
from symasym.asymptotics.weak_noise.series import Point, Series
from symasym.base.inputs import FloatArray
from symasym.numbers.polynomials import divided, poly, shifted
from symasym.series.quadratic_factor import Pair as Local
from symasym.series.quadratic_factor import seen_from

_EPS = 2.3e-16
# The error of the composite where pair and end come together is in no next term.
SAFETY = 5
# Zeros of A whose rounding, relative to their distances, is more than this are not used.
_ROUGHEST = 1e-10
# V from a barrier to the well before it, below which the barrier has no series of its own.
_NO_DROP = 1e-20


# -- one structure ---------------------------------------------------------------------------------


class Together(NamedTuple):
    """A pair that is taken together, in the orientation of its side.

    Attributes
    ----------
    form : AiryForm
    pair : Pair
    point : number
        Where phi was expanded, in the orientation of the side.
    side : int
    onward : bool
        Whether the well comes first, seen from the start.
    members : tuple
        Their numbers among the real zeros; empty for a complex pair.
    height : number
        Mean of V over both.
    drop : number
        V from the barrier down to the well; 0 for a complex pair.
    """

    form: AiryForm
    pair: Local
    point: Any
    side: int
    onward: bool
    members: tuple[int, ...]
    height: Any
    drop: Any


class Apart(NamedTuple):
    """A complex pair that is not taken together: its factor and middle, and its rounding."""

    pair: Local
    middle: Any
    rough: Any


class _BeforeEnd(NamedTuple):
    """A barrier next to an end: its number among the real zeros, and their distance."""

    gaussian: Truncated
    barrier: int
    gap: Any


class OrderZero(Builder):
    """Scenes of one structure to order 0, or one with any digits, and the size of order 1.

    `together` and `apart` are the pairs of zeros; e^{-lam slack} is what leaving complex ones out
    costs.
    """

    together: list[Together]
    apart: list[Apart]
    slack: Any
    #: Where numbers have any digits: the same in float64, for the sizes of order 1.
    in_float: Builder | None = None

    def prepared(self) -> OrderZero:
        """Itself, with what the pairs leave: single zeros, and barriers before the ends."""
        members = {k for pair in self.together for k in pair.members}
        self.members = members
        self.single = [k for k in range(len(self.lines)) if k not in members]
        self.known: dict[int, Series] = {}
        self.order: dict[int, list[int]] = {}
        self.before_end = {sign: self.barrier_before(sign) for sign in (-1, 1)}
        return self

    def beside_a_barrier(self) -> bool:
        """True if a zero of A lies uphill from a start in the layer: the nearest is a barrier.

        The start truncates its Gaussian, and a well behind the start has no canonical Airy form
        with it. Both are in the series of `.truncated_gaussian` and `.sums` alone.
        """
        start = first(self.start)
        if abs(start) > 1:
            return False
        return bool(self.inside(-1 if first(poly(self.c, self.edges[1])) > 0 else 1))

    def sure(self) -> Any:
        """True for the drifts whose rounding is small."""
        worst = np.zeros_like(self.start)
        for rough in [
            *(self.zero_rounding[k] for k in self.single),
            *(pair.rough for pair in self.apart),
        ]:
            worst = np.maximum(worst, rough)
        return worst < _ROUGHEST

    def inside(self, sign: int) -> list[int]:
        if sign not in self.order:
            self.order[sign] = super().inside(sign)
        return self.order[sign]

    def peak(self, k: int) -> Series:
        """Laplace's series at a single zero; one of a pair has none."""
        if k in self.members:
            return Series([])
        if k not in self.known:
            series, c = self.next_orders(k), self.arithmetic
            if self.in_float is not None:
                slope = abs(self.slope(self.lines[k]))
                series = _with_first(series, c.sqrt(2 * c.pi / slope))
            self.known[k] = series
        return self.known[k]

    def next_orders(self, k: int) -> Series:
        """Laplace's series at a zero, also at one of a pair, in float64."""
        return super().peak(k) if self.in_float is None else self.in_float.peak(k)

    def smooth(self, u: Any, value: Any = None) -> Series:
        if self.in_float is None:
            return super().smooth(u, value)
        value = poly(self.c, u) if value is None else value
        return _with_first(self.in_float.smooth(float(u)), 1 / value)

    # -- pairs --------------------------------------------------------------------------------

    def of_pair(
        self,
        key: int,
        pair: Local,
        point: Any,
        side: int,
        members: tuple[int, ...],
    ) -> Together:
        """A pair that is taken together, from its factor about `point`."""
        exact = self.in_float is not None
        rough = self.arithmetic.zero if exact else _EPS * poly(self.c_size, abs(point))
        form = airy_form(key, pair, rough, self.arithmetic)
        height = self.potential(point) - pair.level
        onward, c = bool(first(pair.sign) > 0), self.arithmetic
        zeta = c.maximum(form.zeta, c.zero)
        drop = 4 * zeta * c.sqrt(zeta) / 3
        return Together(form, pair, side * point, side, onward, members, height, drop)

    def between(self, sign: int, rising: list[CriticalPoint], falling: list[CriticalPoint]) -> int:
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            if k in self.single:
                z = self.lines[k]
                height = self.potential(z) - self.base
                barrier = bool(first(self.slope(z)) > 0)
                points = rising if barrier else falling
                points.append(
                    CriticalPoint(rank, height if barrier else -height, self.peak(k), None)
                )
        for pair in self.together:
            if pair.side == sign:
                self.add(pair, inside, rising, falling)
        rising.sort(key=lambda point: point.rank)
        falling.sort(key=lambda point: point.rank)
        return len(inside) + 1

    def add(
        self,
        pair: Together,
        inside: list[int],
        rising: list[CriticalPoint],
        falling: list[CriticalPoint],
    ) -> None:
        """Both integrals over a pair, and the double one in place of their product."""
        low, high = self.ranks(pair, inside)
        rise = pair.drop / 2
        height = pair.height - self.base
        well, barrier = (low, high) if pair.onward else (high, low)
        both = AiryIntegral(pair.form, "both") if pair.onward else None
        self.joint.append(Joint(well, barrier, 2 * rise, both))
        rising.append(
            CriticalPoint(barrier, height + rise, AiryIntegral(pair.form, "rising"), None)
        )
        falling.append(CriticalPoint(well, rise - height, AiryIntegral(pair.form, "falling"), None))

    def ranks(self, pair: Together, inside: list[int]) -> tuple[Any, Any]:
        """Of its two zeros, from the start on; between two ranks for a complex pair."""
        if pair.members:
            low, high = sorted(inside.index(k) + 1 for k in pair.members)
            return low, high
        at = first(pair.point)
        before = sum(1 for k in inside if pair.side * first(self.lines[k]) < at)
        others = [p for p in self.together if not p.members and p.side == pair.side]
        place = Fraction(sum(1 for p in others if first(p.point) <= at), len(others) + 1)
        return before + place, before + place

    def side(self, sign: int) -> OneSided:
        self.joint: list[Joint] = []
        one_sided = super().side(sign)
        return one_sided._replace(joint=self.joint, slack=self.slack)

    # -- the end ------------------------------------------------------------------------------

    def end(
        self, sign: int, rank: int, rising: list[CriticalPoint], falling: list[CriticalPoint]
    ) -> tuple[Any, Any, Any] | None:
        before = self.before_end[sign]
        if before is None:
            return super().end(sign, rank, rising, falling)
        # A complex pair may be between them.
        last = self.inside(sign).index(before.barrier) + 1
        barrier = next(spot for spot in rising if spot.rank == last)
        gaussian = before.gaussian
        height = barrier.height - gaussian.t**2 / 2
        onward = TruncatedIntegral(gaussian, "onward")
        self.joint.append(Joint(-1, -1, 0.0, TruncatedIntegral(gaussian, "both")))
        rising.append(CriticalPoint(rank, height, TruncatedIntegral(gaussian, "rising"), onward))
        falling.append(CriticalPoint(rank, -height, TruncatedIntegral(gaussian, "falling"), None))
        return None

    def barrier_before(self, sign: int) -> _BeforeEnd | None:
        """The barrier next to the end, if there is one."""
        c, start = self.arithmetic, first(self.start)
        inside = self.inside(sign) if abs(start) < 1 or sign * start < 0 else []
        if not inside:
            return None
        last = inside[-1]
        pair = next((p for p in self.together if last in p.members), None)
        if not (pair.onward if pair else first(self.slope(self.lines[last])) > 0):
            return None
        place, drop = sign * self.lines[last], None
        if pair is not None:
            place = pair.point + pair.pair.middle + c.sqrt(c.maximum(pair.pair.square, c.zero))
            drop = pair.drop
        elif len(inside) > 1:
            drop = self.potential(self.lines[last]) - self.potential(self.lines[inside[-2]])
        slope = None
        if self.beyond:
            slope = self.a_plus if sign > 0 else -self.a_minus
        # All that is singular in the gap is a function of this one number, and cancels as such.
        gap = abs(self.edges[1 + sign]) - place
        psi = shifted(seen_from(self.c, sign), place)[1:]
        ratio = c.zero
        if pair is None or c.any(pair.drop > _NO_DROP):
            row = self.next_orders(last).parts[0].coefficients
            # A parabola has no further orders.
            ratio = abs(row[1] / row[0]) if len(row) > 1 else ratio
        gaussian = truncated_gaussian(sign, psi, gap, drop, ratio, slope, c)
        return _BeforeEnd(gaussian, last, gap)

    # -- the regular part ---------------------------------------------------------------------

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Of 1/phi on a path past all pairs, and of order 1, at the three edges."""
        if self.degree == 0:
            return super().primitives()
        c, edges = self.arithmetic, range(3)
        total = [0 * u for u in self.edges]
        size = list(total)

        def add(at: int, rough: Any, *parts: Any) -> None:
            for part in parts:
                total[at] = total[at] + part
                if self.in_float is None:
                    size[at] = size[at] + abs(part) * rough

        gaps = {(1 + s, b.barrier): b.gap for s, b in self.before_end.items() if b is not None}
        for k in self.single:
            slope = self.slope(self.lines[k])
            for at in edges:
                distance = gaps.get((at, k), self.edges[at] - self.lines[k])
                add(at, 6 * self.zero_rounding[k], c.log(abs(distance)) / slope)
        for one in self.apart:
            share = regular_share(one.pair, False, c)
            for at in edges:
                add(at, 6 * one.rough, *share(self.edges[at] - one.middle, None))
        for pair in self.together:
            share = regular_share(pair.pair, True, c)
            for at in edges:
                gap = next((gaps[at, k] for k in pair.members if (at, k) in gaps), None)
                y = pair.side * self.edges[at] - pair.point - pair.pair.middle
                gap = gap if at == 1 + pair.side else None
                add(at, 64 * _EPS, *share(y, gap))
        # Order 1 is the derivative of -1/(2 phi²), of which start and end may cancel by chance.
        sizes = self if self.in_float is None else self.in_float
        order_one = [0.5 / poly(sizes.c, u) ** 2 for u in sizes.edges]
        order_one[1] = -order_one[1]
        for at, _ in gaps:
            # At a barrier's end it goes with the truncated Gaussian.
            order_one[at] = 0 * order_one[at]
        none = [0 * u for u in total]
        return [total, order_one, none], [size, [abs(y) * 1e-10 for y in order_one], none]


def _with_first(series: Series, first_one: Any) -> Series:
    """The series with its first coefficient known to more digits."""
    (part,) = series.parts
    parts = [part._replace(coefficients=[first_one, *part.coefficients[1:]])]
    return Series(parts, majorants=series.majorants)


def factor_pair(c: Sequence[Any], middle: Any, square: Any) -> Local:
    """(u - middle)² - square as a factor of A, with what is left of A about the middle."""
    psi = shifted(divided(list(c), -2 * middle, middle * middle - square)[0], middle)
    zero = 0 * square
    return Local(zero, square, psi, 1, square, zero, zero)


# -- many scenes in float64 ------------------------------------------------------------------------


class UniformPoint(Point):
    """With r, and the local integrals that have been found at this lam."""

    def __init__(self, at: Point, r: Any) -> None:
        vars(self).update(vars(at))
        self.r = r
        self.known: dict[Any, Any] = {}

    @cached_property
    def third(self) -> Any:
        """lam^(1/3), which takes as long as ten multiplications."""
        return self.arithmetic.cbrt(self.lam)


def escape_time(composed: Composed, at: Point) -> tuple[FloatArray, Any]:
    """log T, and its relative error (None without `at.errors`)."""
    point = UniformPoint(at, composed.r)
    log, error = evaluation.float_log(evaluation.escape_time, composed, point)
    if error is not None:
        error = with_left_out(error, np.exp(-point.lam * composed.slack))
        error = np.where(error < 1, -np.log1p(-np.minimum(error, 0.999)), np.inf)
    return log, error


def with_left_out(error: Any, left_out: Any) -> Any:
    """The relative error, with what the start or an end cuts off a complex pair."""
    return SAFETY * error + 20 * left_out
