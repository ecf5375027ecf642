"""Places of polynomial drifts in float64, with those that may meet taken together, to order 0.

As `symasym.asymptotics.weak_noise.critical_point_arrays`, for zeros of A however close to each
other or to the layer's end. A pair is split off as a quadratic factor, so that its middle and its
distance, real or not, are as exact as A's coefficients are.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.uniform.local_arrays import Edge, EdgePart, Fold, FoldPart
from symasym.asymptotics.uniform.local_numbers import edge_of, fold_of, past
from symasym.asymptotics.uniform.pair_arrays import Pairs, key_of, pairs_beside
from symasym.asymptotics.weak_noise.critical_point_arrays import (
    Builder,
    Found,
    clear_of_zero,
    structure,
    unchanged,
)
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, Joint, OneSided, mapped
from symasym.asymptotics.weak_noise.series import Series
from symasym.base.inputs import FloatArray
from symasym.drift.float_field import IntArray
from symasym.drift.polynomial_scenes import Scenes
from symasym.numbers.polynomial_roots import Zeros, zeros_of
from symasym.numbers.quadratic_factor import Pair, poly, shifted

__all__ = ["found_of"]

_AT_ONCE = 4096
_EPS = 2.3e-16
_LARGEST_KEY = 2.0**62
# Zeros of A whose rounding, relative to their distances, is more than this are not used.
_ROUGHEST = 1e-10


def found_of(scenes: Scenes, order: int) -> Iterator[Found]:
    """The places of all scenes that float64 is enough for, chunk by chunk; order 0 only."""
    if order:
        return
    degree = np.where(scenes.c != 0, np.arange(len(scenes.c))[:, None], 0).max(axis=0)
    for d in np.unique(degree):
        chosen = np.flatnonzero(degree == d)
        for low in range(0, len(chosen), 2 * _AT_ONCE):
            rows = chosen[low : low + 2 * _AT_ONCE]
            some = scenes.take(rows)
            some = some._replace(c=some.c[: d + 1])
            for found in _found(some):
                yield Found(rows[found.rows], found.sights)


def _found(scenes: Scenes) -> Iterator[Found]:
    zeros = zeros_of(scenes.c)
    pairs, slack = pairs_beside(scenes, zeros)
    keys = [structure(scenes, zeros), *(key_of(scenes, zeros, p) for p in pairs)]
    # a± may be as small as they like.
    good = zeros.complete & clear_of_zero(scenes, ends=False)
    rows = np.flatnonzero(good)
    group = _numbered([key[rows] for key in keys])
    for k in range(int(group.max(initial=-1)) + 1):
        members = rows[group == k]
        for low in range(0, len(members), _AT_ONCE):
            part = members[low : low + _AT_ONCE]
            builder = _Builder(
                scenes.take(part),
                zeros.take(part),
                mapped(pairs, itemgetter(part)),
                slack[part],
            )
            sights = builder.sights()
            sure = builder.sure()
            if sure.all():
                yield Found(part, sights)
            elif sure.any():
                yield Found(part[sure], mapped(sights, itemgetter(sure)))


def _numbered(keys: list[IntArray]) -> IntArray:
    """From 0 on, one number for each combination."""
    found = np.zeros_like(keys[0])
    for key in keys:
        if float(found.max(initial=0) + 1) * float(key.max(initial=0) + 1) > _LARGEST_KEY:
            found = np.unique(found, return_inverse=True)[1].ravel()
        found = found * (key.max(initial=0) + 1) + key
    group: IntArray = np.unique(found, return_inverse=True)[1].ravel()
    return group


# -- one structure ---------------------------------------------------------------------------------


class _Meeting(NamedTuple):
    """A pair of this structure; the members' places in `lines` where they are real."""

    fold: Fold
    pair: Pair
    point: FloatArray
    side: int
    onward: bool
    members: tuple[int, ...]
    height: FloatArray


class _Cut(NamedTuple):
    """A barrier next to the end: its place in `lines`, and their distance."""

    edge: Edge
    barrier: int
    gap: FloatArray


class _Builder(Builder):
    """Scenes of one structure, to order 0, with what tells the size of order 1."""

    def __init__(self, scenes: Scenes, zeros: Zeros, pairs: list[Pairs], slack: FloatArray) -> None:
        super().__init__(scenes, zeros, 0, unchanged)
        self.edges = np.array(self.edges)
        self.slack = slack
        self.known: dict[int, Series] = {}
        good = [found for found in pairs if found.good[0]]
        self.meetings = [self.meeting(key, found) for key, found in enumerate(good, start=2)]
        self.complex = [int(found.above[0]) for found in good if found.above[0] >= 0]
        self.single = [
            k for k in range(len(self.lines)) if not any(k in m.members for m in self.meetings)
        ]
        self.cuts = {sign: self.cut(sign) for sign in (-1, 1)}

    def sure(self) -> Any:
        """Where rounding is small."""
        worst = np.zeros_like(self.start)
        for k in self.single:
            worst = np.maximum(worst, self.rough[k])
        for j, rough in enumerate(self.rough_pairs):
            if j not in self.complex:
                worst = np.maximum(worst, rough)
        return worst < _ROUGHEST

    def peak(self, k: int) -> Series:
        if k not in self.known:
            self.known[k] = super().peak(k)
        return self.known[k]

    # -- pairs --------------------------------------------------------------------------------

    def meeting(self, key: int, found: Pairs) -> _Meeting:
        side = -1 if found.point[0] < self.edges[1][0] else 1
        pair = found.pair
        onward = bool(pair.sign[0] > 0)
        rough = _EPS * poly(self.c_size, np.abs(found.point))
        fold = fold_of(key, pair, rough)
        height = self.potential(found.point) - pair.level
        first = int(found.first[0])
        members = (first, first + 1) if first >= 0 else ()
        return _Meeting(fold, pair, side * found.point, side, onward, members, height)

    def between(
        self,
        sign: int,
        rising: list[CriticalPoint],
        falling: list[CriticalPoint],
        peaks: dict[int, Series],
    ) -> int:
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            if k in self.single:
                z = self.lines[k]
                height = self.potential(z) - self.base
                barrier = bool(self.slope(z)[0] > 0)
                spots = rising if barrier else falling
                spots.append(
                    CriticalPoint(rank, height if barrier else -height, self.peak(k), None)
                )
        for m in self.meetings:
            if m.side == sign:
                self.together(m, inside, rising, falling)
        rising.sort(key=lambda spot: spot.rank)
        falling.sort(key=lambda spot: spot.rank)
        return len(inside) + 1

    def together(
        self,
        m: _Meeting,
        inside: list[int],
        rising: list[CriticalPoint],
        falling: list[CriticalPoint],
    ) -> None:
        low, high = self.ranks(m, inside)
        rise = 2 / 3 * np.maximum(m.fold.zeta, 0.0) ** 1.5
        height = m.height - self.base
        well, barrier = (low, high) if m.onward else (high, low)
        both = FoldPart(m.fold, "both") if m.onward else None
        self.joint.append(Joint(well, barrier, 2 * rise, both))
        rising.append(CriticalPoint(barrier, height + rise, FoldPart(m.fold, "rising"), None))
        falling.append(CriticalPoint(well, rise - height, FoldPart(m.fold, "falling"), None))

    def ranks(self, m: _Meeting, inside: list[int]) -> tuple[Any, Any]:
        """Of its two zeros, from the start on; between two ranks for a complex pair."""
        if m.members:
            low, high = sorted(inside.index(k) + 1 for k in m.members)
            return low, high
        before = sum(1 for k in inside if m.side * self.lines[k][0] < m.point[0])
        pairs = [other for other in self.meetings if not other.members and other.side == m.side]
        place = sum(1 for other in pairs if other.point[0] <= m.point[0]) / (len(pairs) + 1)
        return before + place, before + place

    def side(
        self, sign: int, totals: list[Any], sizes: list[Any], peaks: dict[int, Series]
    ) -> OneSided:
        self.joint: list[Joint] = []
        sight = super().side(sign, totals, sizes, peaks)
        return sight._replace(joint=self.joint, slack=self.slack)

    # -- the end ------------------------------------------------------------------------------

    def end(
        self, sign: int, rank: int, rising: list[CriticalPoint], falling: list[CriticalPoint]
    ) -> tuple[Any, Any, Any] | None:
        cut = self.cuts[sign]
        if cut is None:
            return super().end(sign, rank, rising, falling)
        # A complex pair may be between them.
        last = self.inside(sign).index(cut.barrier) + 1
        barrier = next(spot for spot in rising if spot.rank == last)
        height = barrier.height - cut.edge.t**2 / 2
        onward = EdgePart(cut.edge, "onward")
        self.joint.append(Joint(-1, -1, 0.0, EdgePart(cut.edge, "both")))
        rising.append(CriticalPoint(rank, height, EdgePart(cut.edge, "rising"), onward))
        falling.append(CriticalPoint(rank, -height, EdgePart(cut.edge, "falling"), None))
        return None

    def cut(self, sign: int) -> _Cut | None:
        """The barrier next to the end, if there is one."""
        inside = self.inside(sign) if abs(self.start[0]) < 1 or (sign * self.start[0] < 0) else []
        if not inside:
            return None
        last = inside[-1]
        m = next((m for m in self.meetings if last in m.members), None)
        barrier = m.onward if m else bool(self.slope(self.lines[last])[0] > 0)
        if not barrier:
            return None
        place, drop = sign * self.lines[last], None
        if m is not None:
            place = m.point + m.pair.middle + np.sqrt(np.maximum(m.pair.square, 0.0))
            drop = 4 / 3 * np.maximum(m.fold.zeta, 0.0) ** 1.5
        elif len(inside) > 1:
            drop = self.potential(self.lines[last]) - self.potential(self.lines[inside[-2]])
        reach = np.abs(self.edges[1 + sign])
        slope = None
        if self.beyond:
            slope = self.a_plus if sign > 0 else -self.a_minus
        coefficients = [row * (sign if j % 2 == 0 else 1.0) for j, row in enumerate(self.c)]
        # All that is singular in the gap is a function of this one number, and cancels as such.
        psi, gap = shifted(coefficients, place)[1:], reach - place
        row = self.peak(last).parts[0].coefficients
        ratio = np.abs(row[1] / row[0]) if len(row) > 1 else 0.0
        edge = edge_of(sign, psi, gap, drop, ratio, slope)
        return _Cut(edge, last, gap)

    # -- the outer part -----------------------------------------------------------------------

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Of 1/phi on a path past all pairs, and of order 1, at the three edges."""
        if self.degree == 0:
            return super().primitives()
        total = np.zeros_like(self.edges)
        size = np.zeros_like(self.edges)
        gaps: dict[tuple[int, int], FloatArray] = {}
        for sign, cut in self.cuts.items():
            if cut is not None:
                gaps[1 + sign, cut.barrier] = cut.gap
        for k in self.single:
            for at, u in enumerate(self.edges):
                distance = gaps.get((at, k), u - self.lines[k])
                part = np.log(np.abs(distance)) / self.slope(self.lines[k])
                total[at] += part
                size[at] += np.abs(part) * (6 * self.rough[k])
        for j, z in enumerate(self.pairs):
            if j in self.complex:
                continue
            part = 2 * (np.log(self.edges - z) / self.slope(z)).real
            total += part
            size += np.abs(part) * (6 * self.rough_pairs[j])
        for m in self.meetings:
            for at, u in enumerate(self.edges):
                gap = next((gaps[at, k] for k in m.members if (at, k) in gaps), None)
                beyond = at == 1 + m.side
                first, second = past(m.pair, m.side * u - m.point - m.pair.middle, beyond, gap)
                total[at] += first + second
                size[at] += (np.abs(first) + np.abs(second)) * (64 * _EPS)
        # Order 1 is the derivative of -1/(2 phi²), of which start and end may cancel by chance.
        order_one = 0.5 / poly(list(self.c), self.edges) ** 2
        order_one[1] = -order_one[1]
        for sign, cut in self.cuts.items():
            if cut is not None:
                # At a barrier's end it goes with the edge.
                order_one[1 + sign] = 0.0
        none = np.zeros_like(total)
        return [total, order_one, none], [size, np.abs(order_one) * 1e-10, none]
