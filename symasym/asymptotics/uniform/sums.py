"""The uniform sums at one lam: critical points, coalescing pairs, truncations, regular part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.asymptotics.uniform.coalescing_pair import (
    Airy,
    CanonicalPair,
    OneSide,
    airy,
    place_at,
    zeros_of,
)
from symasym.asymptotics.uniform.truncated_gaussian import (
    Corrections,
    Truncation,
    Truncations,
    corrections,
)
from symasym.asymptotics.weak_noise.compose import (
    Leaf,
    Nodes,
    Side,
    Sides,
    mean_time,
    regular_part,
    rising_of,
)
from symasym.asymptotics.weak_noise.evaluation import plain
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint
from symasym.asymptotics.weak_noise.series import Point, terms
from symasym.base.contexts import mpf_of
from symasym.numbers.arithmetic import Digits

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["Member", "corrected", "sides_at", "time_at", "whole_at"]


@dataclass
class _Contribution:
    """A contribution at one lam; `u` is None for the end at r, `point` for what has no series."""

    u: Any
    value: Any
    onward: Any
    point: CriticalPoint | None


class _SideSum:
    """One side of the start at one lam: its contributions, and what is known of their pairs."""

    def __init__(self, side: OneSide, r: mpf, at: Point) -> None:
        self.half, none = side.half, 0 * at.lam

        def value(height: mpf, series: Any) -> Any:
            return plain(Leaf(height, series), at)[0] + none if terms(series) else none

        rising = [p for p, _ in rising_of(side.half, r, Nodes())]
        self.rising = [
            _Contribution(p.u, value(p.height, p.series), value(p.height, p.onward), p)
            for p in rising
        ]
        self.falling = [
            _Contribution(p.u, value(p.height, p.series), none, p) for p in side.half.falling
        ]
        self.nested = plain(regular_part(side.half, r, Nodes()), at)[0] + none
        starts = side.half.rising_start, side.half.falling_start
        self.starts = [value(0.0, series) for series in starts]

    def all(self) -> list[_Contribution]:
        """The contributions to both integrals."""
        return self.rising + self.falling

    def ends(self) -> list[Any]:
        """Those of the layer that are seen."""
        kinks = [x.u for x in self.rising if x.point and x.point.kind in ("end", "kink")]
        return sorted(u for u in kinks if u is not None)

    def nearest(self) -> _Contribution | None:
        """The well or barrier next to the start."""
        zeros = [x for x in self.all() if x.point and x.point.kind in ("well", "barrier")]
        return min(zeros, key=lambda x: x.u, default=None)

    def correct(self, near: Corrections, start: Corrections, far: Corrections, sign: int) -> None:
        """Corrections at the start and at the ends of the layer; `sign` is -1 in the mirror."""
        ends = self.ends()
        if not ends:
            return
        self.starts[0] += sign * start.rising
        self.starts[1] -= sign * start.falling
        # From a start beyond the layer both of its ends are seen.
        at_ends = [(ends[0], near, 1), (ends[-1], far, -1)][-len(ends) :]
        self.nested += far.regular - (start.regular if len(ends) == 1 else near.regular)
        for u, change, after in at_ends:
            for up in self.rising:
                if up.u == u and up.point is not None:
                    up.value += sign * after * change.rising
                    if after > 0:
                        up.onward += sign * change.rising
            for down in self.falling:
                if down.u == u:
                    down.value -= sign * after * change.falling

    def side(self) -> Side:
        """S and D of this side, the products of pairs added up."""
        for down in self.falling:
            for up in self.rising:
                if up.u is None or up.u > down.u:
                    self.nested += down.value * up.value
                elif up.u == down.u:
                    self.nested += down.value * up.onward
        scale = sum((up.value for up in self.rising), 0 * self.nested)
        return Side(scale, self.nested, *self.starts)


def time_at(
    sides: list[OneSide], truncations: Truncations, r: mpf, lam: mpf, order: int, context: MPContext
) -> Any:
    """T at one lam; `r` as a number of the context."""
    return lam * mean_time(sides_at(sides, truncations, r, lam, order, context))


def sides_at(
    sides: list[OneSide],
    truncations: Truncations,
    r: mpf,
    lam: mpf,
    order: int,
    context: MPContext,
    local: Callable[..., Airy] | None = None,
    correction: Callable[..., Corrections] | None = None,
) -> Sides:
    """Both sides of the start at one lam.

    `local` and `correction` are what stands for `airy` and `corrected` where lam is a symbol
    (`symasym.expansions`).
    """
    at = Point(lam, order, False, None, Digits(context))
    sums = [_SideSum(one, r, at) for one in sides]
    members: list[Member] = []
    for k, one in enumerate(sides):
        for canonical in one.pairs:
            parts = (local or airy)(canonical, lam, order, context)
            members += _meet(canonical, parts, k, sums, lam, order, context)
    beside = truncations.start
    if not beside:
        beside = truncations.left if sums[1].ends() else truncations.right
    members = [m for one in members for m in _weighed(one, beside, context)]
    left, start, right = (
        (correction or corrected)(rows, members, lam, order, context) for rows in truncations
    )
    sums[0].correct(right, start, left, -1)
    sums[1].correct(left, start, right, 1)
    low, high = (part.side() for part in sums)
    rising, falling = low.rising + high.rising, low.falling + high.falling
    return Sides(low, high, rising, falling, sides[0].half.corner)


class Member(NamedTuple):
    """A well or barrier of a pair, the share that the sums take for it, and what of that counts.

    The share changes sides as the start passes, and then its truncation is to be of the same size,
    also that of a kink which the start reaches. Any other is of the point's own series, which is
    better where a pair comes to the end.
    """

    u: Any
    value: Any
    weight: Any


def _weighed(member: Member, beside: list[Truncation], context: MPContext) -> list[Member]:
    """With its weight where it is next to the start."""
    return [
        member._replace(weight=truncation.keep)
        for truncation in beside
        if _same(member, truncation, context)
    ]


def _same(member: Member, truncation: Truncation, context: MPContext) -> bool:
    """True where the member is the zero of the truncation."""
    return bool(abs(member.u - truncation.zero) <= context.eps**0.75)


def _meet(
    canonical: CanonicalPair,
    local: Airy,
    k: int,
    sums: list[_SideSum],
    lam: mpf,
    order: int,
    context: MPContext,
) -> list[Member]:
    """Take the pair, seen from side k, together; returns its members."""
    height, own = context.exp(lam * canonical.height), sums[k]
    for n, share in enumerate(canonical.share[: order + 1]):
        own.nested -= share * lam ** -(n + 1)
    if canonical.pair.zeta < 0:
        middle = mpf_of(canonical.point, context)
        own.rising.append(_Contribution(middle, local.rising * height, context.zero, None))
        own.falling.append(_Contribution(middle, local.falling / height, context.zero, None))
        own.nested += local.both if canonical.onward else context.zero
        return []
    low, high = (_found(u, k, sums) for u in zeros_of(canonical, context))
    (well_side, well), (barrier_side, barrier) = (low, high) if canonical.onward else (high, low)
    barrier.value, well.value = local.rising * height, local.falling / height
    gain = local.both - barrier.value * well.value
    if well_side != barrier_side:
        sums[barrier_side].nested += gain * _beyond(well, barrier, lam, context)
    elif barrier.u > well.u:
        behind, part = sums[1 - well_side].nearest(), context.one
        if sums[well_side].nearest() is well:
            part -= _beyond(well, behind, lam, context)
        sums[well_side].nested += gain * part
    members = ((well_side, well), (barrier_side, barrier))
    return [Member(x.u if side else -x.u, x.value, 0) for side, x in members]


def _found(u: mpf, k: int, sums: list[_SideSum]) -> tuple[int, _Contribution]:
    """The share of the well or barrier at `u` seen from side k, and the side where it is."""
    for side, at in ((k, u), (1 - k, -u)):
        point = place_at(at, [x.point for x in sums[side].all() if x.point is not None])
        if point is not None:
            return side, next(x for x in sums[side].all() if x.point is point)
    raise AssertionError


def _beyond(well: _Contribution, top: _Contribution | None, lam: mpf, context: MPContext) -> Any:
    """The part of a well's Gaussian at the other side of the start, next to it.

    What a pair has beyond the product of its members is lost as the start passes the well, and
    all of it when the start reaches the barrier behind, `top`.
    """
    assert well.point is not None
    depth = max(well.point.height, context.zero)
    if top is not None and top.point is not None:
        way = abs(top.point.height)
        depth *= (way + depth) / way
    return context.erfc(context.sqrt(lam * depth)) / 2


def corrected(
    truncations: list[Truncation], members: list[Member], lam: mpf, order: int, context: MPContext
) -> Corrections:
    """The corrections of all zeros whose Gaussians one point truncates."""
    shares = [Corrections(*[context.zero] * 3)]
    for truncation in truncations:
        share = None
        for one in members:
            if _same(one, truncation, context):
                sign = -1 if truncation.barrier else 1
                # V is 0 at the start.
                weight = one.weight * context.exp(-((lam * truncation.height) ** 2))
                share = one.value * context.exp(sign * lam * truncation.rise), weight
        shares.append(corrections(truncation, share, lam, order, context))
    return Corrections(*(sum(parts, context.zero) for parts in zip(*shares, strict=True)))


def whole_at(
    points: list[CriticalPoint],
    canonical_pairs: list[CanonicalPair],
    lam: mpf,
    order: int,
    context: MPContext,
    local: Callable[..., Airy] | None = None,
) -> Any:
    """int e^{-lam V} over all u, with Laplace's series at the kinks; `local` as in `sides_at`."""
    at, left_out = Point(lam, order, False, None, Digits(context)), []
    total = context.zero
    for canonical in canonical_pairs:
        parts = (local or airy)(canonical, lam, order, context)
        total += parts.falling * context.exp(-lam * canonical.height)
        if canonical.pair.zeta > 0:
            left_out += [p for u in zeros_of(canonical, context) if (p := place_at(u, points))]
    for point in points:
        if not any(point is p for p in left_out):
            total += plain(Leaf(point.height, point.series), at)[0]
    return total
