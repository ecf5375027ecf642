"""T by the uniform formula of order 0, polynomial A: many drifts in float64, or one to any digits.

Wells, barriers and pairs of both sides of the start (`symasym.asymptotics.weak_noise.compose`),
with the canonical Airy form of pairs that may coalesce (Chester, Friedman and Ursell) and the
truncated Gaussian of a barrier next to an end (Bleistein; both
`symasym.asymptotics.uniform.order_zero_forms`), for zeros of A however close to each
other or to the layer's end. Which zeros go together is decided in float64 (`.pairing_arrays` for
many drifts, `.structure` for one); `OrderZero` is what follows from it, once for both: with
digits, zeros, differences of the potential, Airy functions and Dawson's integral have all of them.
The error of order 0 is that of the next terms (sizes from `order_zero_forms`) times `SAFETY`, and
what the start or an end cuts off a pair (`with_left_out`).

To any number of digits (`closed_form`) Newton's steps take a zero, and a pair as a factor, to all
of them; the error is the size of order 1 of each part, found in float64.
"""

from __future__ import annotations

import math
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
from symasym.asymptotics.uniform.structure import _structure
from symasym.asymptotics.weak_noise import compose
from symasym.asymptotics.weak_noise.compose import Composed
from symasym.asymptotics.weak_noise.one_sided import (
    Builder,
    CriticalPoint,
    OneSided,
    PairContribution,
    first,
)
from symasym.asymptotics.weak_noise.series import BEYOND, Point, Series
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Digits
from symasym.numbers.polynomials import divided, poly, refined, shifted
from symasym.series.quadratic_factor import Pair, mirrored, split_pair

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
        Whether the well is nearer to the start than the barrier.
    members : tuple
        Their numbers among the real zeros; empty for a complex pair.
    height : number
        Mean of V over both.
    drop : number
        V from the barrier down to the well; 0 for a complex pair.
    """

    form: AiryForm
    pair: Pair
    point: Any
    side: int
    onward: bool
    members: tuple[int, ...]
    height: Any
    drop: Any


class _BeforeEnd(NamedTuple):
    """A barrier next to an end: its number among the real zeros, and their distance."""

    gaussian: Truncated
    barrier: int
    gap: Any


class OrderZero(Builder):
    """Scenes of one structure to order 0, or one with any digits, and the size of order 1.

    `together` and `apart` are the pairs of zeros, these complex and each with its rounding bound;
    e^{-lam exponential_gap} is what leaving complex ones out costs.
    """

    together: list[Together]
    apart: list[tuple[Pair, Any]]
    exponential_gap: Any
    #: Where numbers have any digits: the same in float64, for the sizes of order 1.
    in_float: Builder | None = None

    def prepared(self) -> OrderZero:
        """Itself, with what the pairs leave: single zeros, and barriers before the ends."""
        members = {k for pair in self.together for k in pair.members}
        self.members = members
        self.single = [k for k in range(len(self.zeros)) if k not in members]
        self.known: dict[int, Series] = {}
        self.order: dict[int, list[int]] = {}
        self.before_end = {sign: self.barrier_before(sign) for sign in (-1, 1)}
        return self

    def beside_a_barrier(self) -> bool:
        """True if a zero of A lies uphill from a start in the layer: the nearest is a barrier.

        The start truncates its Gaussian, and a well behind the start has no canonical Airy form
        with it. Both are in the series of `.truncated_gaussian` alone.
        """
        start = first(self.start)
        if abs(start) > 1:
            return False
        return bool(self.inside(-1 if first(poly(self.c, self.edges[1])) > 0 else 1))

    def sure(self) -> Any:
        """True for the drifts whose rounding is small."""
        worst = np.zeros_like(self.start)
        for rounding in [
            *(self.zero_rounding[k] for k in self.single),
            *(rounding for _, rounding in self.apart),
        ]:
            worst = np.maximum(worst, rounding)
        return worst < _ROUGHEST

    def inside(self, sign: int) -> list[int]:
        if sign not in self.order:
            self.order[sign] = super().inside(sign)
        return self.order[sign]

    def saddle(self, k: int) -> Series:
        """Laplace's series at a single zero; one of a pair has none."""
        if k in self.members:
            return Series([])
        if k not in self.known:
            series, c = self.next_orders(k), self.arithmetic
            if self.in_float is not None:
                slope = abs(self.slope(self.zeros[k]))
                series = _with_first(series, c.sqrt(2 * c.pi / slope))
            self.known[k] = series
        return self.known[k]

    def next_orders(self, k: int) -> Series:
        """Laplace's series at a zero, also at one of a pair, in float64."""
        return super().saddle(k) if self.in_float is None else self.in_float.saddle(k)

    def smooth(self, u: Any, value: Any = None) -> Series:
        if self.in_float is None:
            return super().smooth(u, value)
        value = poly(self.c, u) if value is None else value
        return _with_first(self.in_float.smooth(float(u)), 1 / value)

    # -- pairs --------------------------------------------------------------------------------

    def of_pair(
        self,
        key: int,
        pair: Pair,
        point: Any,
        side: int,
        members: tuple[int, ...],
    ) -> Together:
        """A pair that is taken together, from its factor about `point`."""
        exact = self.in_float is not None
        rounding = self.arithmetic.zero if exact else _EPS * poly(self.c_size, abs(point))
        form = airy_form(key, pair, rounding, self.arithmetic)
        height = self.potential(point) - pair.level
        onward, c = bool(first(pair.sign) > 0), self.arithmetic
        zeta = c.maximum(form.zeta, c.zero)
        drop = 4 * zeta * c.sqrt(zeta) / 3
        return Together(form, pair, side * point, side, onward, members, height, drop)

    def between(
        self, sign: int, scale_points: list[CriticalPoint], speed_points: list[CriticalPoint]
    ) -> int:
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            if k in self.single:
                z = self.zeros[k]
                height = self.potential(z) - self.base
                barrier = bool(first(self.slope(z)) > 0)
                points = scale_points if barrier else speed_points
                points.append(
                    CriticalPoint(rank, height if barrier else -height, self.saddle(k), None)
                )
        for pair in self.together:
            if pair.side == sign:
                self.add(pair, inside, scale_points, speed_points)
        scale_points.sort(key=lambda point: point.rank)
        speed_points.sort(key=lambda point: point.rank)
        return len(inside) + 1

    def add(
        self,
        pair: Together,
        inside: list[int],
        scale_points: list[CriticalPoint],
        speed_points: list[CriticalPoint],
    ) -> None:
        """Both integrals over a pair, and the double one in place of their product."""
        low, high = self.ranks(pair, inside)
        rise = pair.drop / 2
        height = pair.height - self.base
        well, barrier = (low, high) if pair.onward else (high, low)
        both = AiryIntegral(pair.form, "both") if pair.onward else None
        self.coalescing.append(PairContribution(well, barrier, 2 * rise, both))
        scale_points.append(
            CriticalPoint(barrier, height + rise, AiryIntegral(pair.form, "scale"), None)
        )
        speed_points.append(
            CriticalPoint(well, rise - height, AiryIntegral(pair.form, "speed"), None)
        )

    def ranks(self, pair: Together, inside: list[int]) -> tuple[Any, Any]:
        """Ranks of its two zeros from the start on; between two ranks for a complex pair."""
        if pair.members:
            low, high = sorted(inside.index(k) + 1 for k in pair.members)
            return low, high
        at = first(pair.point)
        before = sum(1 for k in inside if pair.side * first(self.zeros[k]) < at)
        others = [p for p in self.together if not p.members and p.side == pair.side]
        place = Fraction(sum(1 for p in others if first(p.point) <= at), len(others) + 1)
        return before + place, before + place

    def side(self, sign: int) -> OneSided:
        self.coalescing: list[PairContribution] = []
        one_sided = super().side(sign)
        return one_sided._replace(coalescing=self.coalescing, exponential_gap=self.exponential_gap)

    # -- the end ------------------------------------------------------------------------------

    def end(
        self,
        sign: int,
        rank: int,
        scale_points: list[CriticalPoint],
        speed_points: list[CriticalPoint],
    ) -> tuple[Any, Any, Any] | None:
        before = self.before_end[sign]
        if before is None:
            return super().end(sign, rank, scale_points, speed_points)
        # A complex pair may be between them.
        last = self.inside(sign).index(before.barrier) + 1
        barrier = next(point for point in scale_points if point.rank == last)
        gaussian = before.gaussian
        height = barrier.height - gaussian.t**2 / 2
        onward = TruncatedIntegral(gaussian, "onward")
        self.coalescing.append(PairContribution(-1, -1, 0.0, TruncatedIntegral(gaussian, "both")))
        scale_points.append(
            CriticalPoint(rank, height, TruncatedIntegral(gaussian, "scale"), onward)
        )
        speed_points.append(
            CriticalPoint(rank, -height, TruncatedIntegral(gaussian, "speed"), None)
        )
        return None

    def barrier_before(self, sign: int) -> _BeforeEnd | None:
        """The barrier next to the end, if there is one."""
        c, start = self.arithmetic, first(self.start)
        inside = self.inside(sign) if abs(start) < 1 or sign * start < 0 else []
        if not inside:
            return None
        last = inside[-1]
        pair = next((p for p in self.together if last in p.members), None)
        if not (pair.onward if pair else first(self.slope(self.zeros[last])) > 0):
            return None
        place, drop = sign * self.zeros[last], None
        if pair is not None:
            place = pair.point + pair.pair.middle + c.sqrt(c.maximum(pair.pair.square, c.zero))
            drop = pair.drop
        elif len(inside) > 1:
            drop = self.potential(self.zeros[last]) - self.potential(self.zeros[inside[-2]])
        slope = None
        if self.beyond:
            slope = self.a_plus if sign > 0 else -self.a_minus
        # All that is singular in the gap is a function of this one number, and cancels as such.
        gap = abs(self.edges[1 + sign]) - place
        psi = shifted(mirrored(self.c, sign), place)[1:]
        ratio = c.zero
        if pair is None or c.any(pair.drop > _NO_DROP):
            row = self.next_orders(last).parts[0].coefficients
            # A parabola has no further orders.
            ratio = abs(row[1] / row[0]) if len(row) > 1 else ratio
        gaussian = truncated_gaussian(sign, psi, gap, drop, ratio, slope, c)
        return _BeforeEnd(gaussian, last, gap)

    # -- the regular part ---------------------------------------------------------------------

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Primitives of 1/phi on a path past all pairs, and of order 1, at the three edges."""
        if self.degree == 0:
            return super().primitives()
        c, edges = self.arithmetic, range(3)
        total = [0 * u for u in self.edges]
        size = list(total)

        def add(at: int, rounding: Any, *parts: Any) -> None:
            for part in parts:
                total[at] = total[at] + part
                if self.in_float is None:
                    size[at] = size[at] + abs(part) * rounding

        gaps = {(1 + s, b.barrier): b.gap for s, b in self.before_end.items() if b is not None}
        for k in self.single:
            slope = self.slope(self.zeros[k])
            for at in edges:
                distance = gaps.get((at, k), self.edges[at] - self.zeros[k])
                add(at, 6 * self.zero_rounding[k], c.log(abs(distance)) / slope)
        for pair, rounding in self.apart:
            share = regular_share(pair, False, c)
            for at in edges:
                add(at, 6 * rounding, *share(self.edges[at] - pair.middle, None))
        for one in self.together:
            share = regular_share(one.pair, True, c)
            for at in edges:
                gap = next((gaps[at, k] for k in one.members if (at, k) in gaps), None)
                y = one.side * self.edges[at] - one.point - one.pair.middle
                gap = gap if at == 1 + one.side else None
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
    return Series(parts)


def factor_pair(c: Sequence[Any], z: Any) -> Pair:
    """The complex pair of A's zero z as a factor, and what is left of A about its middle."""
    middle, square = z.real, -(z.imag**2)
    psi = shifted(divided(list(c), -2 * middle, middle * middle - square)[0], middle)
    zero = 0 * square
    return Pair(middle, square, psi, 1, square, zero, zero)


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
    log, error = compose.float_log(compose.escape_time, composed, point)
    if error is not None:
        error = with_left_out(error, np.exp(-point.lam * composed.exponential_gap))
        error = np.where(error < 1, -np.log1p(-np.minimum(error, 0.999)), np.inf)
    return log, error


def with_left_out(error: Any, left_out: Any) -> Any:
    """The relative error, with what the start or an end cuts off a complex pair."""
    return SAFETY * error + 20 * left_out


# -- one drift, to any number of digits ------------------------------------------------------------


_MOST_DEGREE = 12
# Coefficients beyond these are left to the general path, so that float64 has their powers.
_LARGEST = 1e20
# |A| at an edge beside its largest term, below which float64 doesn't tell on which side a zero is.
_NEAREST, _NEAREST_END = 1e-7, 1e-11
_MOST_STEPS = 12
# A relative error beyond which nothing is said.
_MOST = 0.4


class ClosedForm(NamedTuple):
    """T of a drift, start and radius, ready for any lam."""

    arithmetic: Digits
    composed: Composed
    names: list[str]

    def time(self, lam: Any) -> tuple[Any, Any] | None:
        """T and its error at this lam; None where these forms do not serve."""
        c, composed = self.arithmetic, self.composed
        at = UniformPoint(Point(lam, 0, True, None, c), composed.r)
        # Sizes of order 1 may be infinite; then they claim nothing.
        with np.errstate(all="ignore"):
            known = compose.with_digits(compose.escape_time, composed, at)
        relative = known.error / known.value if known.sure else c.inf
        if not relative < _MOST:
            return None
        left_out = (
            c.exp(-lam * composed.exponential_gap)
            if composed.exponential_gap < math.inf
            else c.zero
        )
        error = with_left_out(relative / (1 - relative), left_out)
        return (known.value, error * known.value) if error < 1 else None


def closed_form(drift: Drift, r: Fraction, x: Fraction, context: Any) -> ClosedForm | None:
    """None where A is no polynomial, or float64 doesn't tell in which order its zeros are.

    None as well for a start beside a barrier.
    """
    exact = drift.exact_coefficients()
    if exact is None or len(exact) > _MOST_DEGREE + 1:
        return None
    try:
        near, start = [float(a) for a in exact], float(x)
        if not 1 / _LARGEST < max(map(abs, near)) < _LARGEST or abs(start) > _LARGEST:
            return None
        arithmetic = Digits(context)
        # Sizes of order 1 may be infinite; then they claim nothing.
        with np.errstate(all="ignore"):
            one = _of_drift(near, start, exact, x, r, arithmetic)
            if one is None or one.beside_a_barrier():
                return None
            composed = Composed(one.both_sides(), arithmetic.number(r), 0.0)
            return ClosedForm(arithmetic, composed, _names(one))
    except (ArithmeticError, ValueError, AccuracyError):
        # Multiple zeros, and what overflows.
        return None


def _of_drift(
    near: list[float],
    start: float,
    exact: list[Fraction],
    x: Fraction,
    r: Fraction,
    arithmetic: Digits,
) -> OrderZero | None:
    """The structure of one drift, all its numbers with the context's digits.

    `near` and `start` are the coefficients and x in float64.
    """
    radius = float(r) if r < 2 else 2.0
    size, reach = [abs(a) for a in near], min(radius, 1.0)
    start = min(max(start, -reach), reach)
    for u in (-reach, start, reach):
        nearest = _NEAREST_END if abs(u) == 1 else _NEAREST
        if not abs(poly(near, u)) > nearest * poly(size, abs(u)):
            return None
    if not near[-1]:
        return None
    n = len(near)
    zeros, rows, psi, x_above, y_above, exponential_gap = (
        [0.0] * k for k in (13, 208, 169, 13, 13, 1)
    )
    owner, counts = [0] * 13, [0, 0]
    count = _structure(
        near, n, start, radius, zeros, owner, rows, psi, x_above, y_above, counts, exponential_gap
    )
    if count < 0:
        return None
    context, zero = arithmetic.context, arithmetic.zero
    one = _without_zeros([arithmetic.number(a) for a in exact], x, r, arithmetic)
    one.exponential_gap = exponential_gap[0]
    real = [
        (refined(one.c, arithmetic.number(z), context), -1)
        for z, own in zip(zeros[:count], owner, strict=False)
        if own < 0
    ]
    pairs: list[tuple[int, Pair, Any, int]] = []
    for k in range(counts[0]):
        row = rows[16 * k : 16 * k + 16]
        if row[9] > 0:
            # About its middle in float64, from where two steps have all digits.
            point, side = arithmetic.number(row[6] + row[7] * row[0]), int(row[7])
            taylor = mirrored(shifted(one.c, point), side)
            pair = split_pair(taylor, context, square=row[1])
            pairs.append((k, pair, point, side))
            if row[8] >= 0:
                half = arithmetic.sqrt(max(pair.square, zero))
                middle = point + side * pair.middle
                real += [(middle - half, k), (middle + half, k)]
    above = [
        refined(one.c, context.mpc(re, im), context)
        for re, im in list(zip(x_above, y_above, strict=True))[: counts[1]]
    ]
    if any(u is None for u, _ in real) or None in above:
        return None
    real.sort(key=lambda zero: zero[0])
    one.zeros, one.zero_rounding = [u for u, _ in real], [0.0] * len(real)
    one.in_float = _in_float(one)
    one.apart = [(factor_pair(one.c, z), zero) for z in above]
    one.together = []
    for key, (k, pair, point, side) in enumerate(pairs, start=2):
        members = tuple(j for j, (_, own) in enumerate(real) if own == k)
        one.together.append(one.of_pair(key, pair, point, side, members))
    return one.prepared()


def _without_zeros(c: list[Any], x: Fraction, r: Fraction, arithmetic: Digits) -> OrderZero:
    """The scene with these coefficients of A, its zeros left open."""
    one, self = arithmetic.one, OrderZero.__new__(OrderZero)
    self.eps = self.least = 0.0
    self.arithmetic, self.count, self.c, self.degree = arithmetic, 1 + BEYOND, c, len(c) - 1
    self.a_minus, self.a_plus = poly(c, -one), poly(c, one)
    self.start, self.beyond = arithmetic.number(x), r > 1
    reach = min(arithmetic.number(r), one)
    self.edges = [-reach, min(max(self.start, -reach), reach), reach]
    self.v, self.height_size = [-a / k for k, a in enumerate(c, start=1)], arithmetic.zero
    return self


def _in_float(one: OrderZero) -> Builder:
    """The float64 series from which the sizes of order 1 are taken."""
    self = Builder.__new__(Builder)
    self.count, self.degree, self.zero_rounding = one.count, one.degree, one.zero_rounding
    self.c, self.zeros, self.edges = (
        [float(x) for x in row] for row in (one.c, one.zeros, one.edges)
    )
    self.c_size = [abs(x) for x in self.c]
    return self


def _names(one: OrderZero) -> list[str]:
    """The names of the pairs and ends that are taken together."""
    names = [f"well and barrier about u = {float(p.side * p.point):.6g}" for p in one.together]
    ends = [sign for sign, barrier in one.before_end.items() if barrier is not None]
    return names + [f"barrier before u = {sign}" for sign in ends]
