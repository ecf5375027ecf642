"""Places of polynomial drifts in float64, with those that may meet taken together, to order 0.

As `symasym.asymptotics.places_double`, for zeros of A however close to each other or to the
layer's end. A pair is split off as a quadratic factor, so that its middle and its distance,
real or not, are as exact as A's coefficients are.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.cubic_map import map_coefficients
from symasym.asymptotics.cubic_pair import Pair, pairs_of, poly
from symasym.asymptotics.local_double import Edge, EdgePart, Fold, FoldPart
from symasym.asymptotics.places_double import Builder, Found, Scenes, structure
from symasym.asymptotics.polynomial_zeros import Zeros, zeros_of
from symasym.asymptotics.sights import Joint, Numbers, Series, Sight, Spot
from symasym.exact.fields import IntArray
from symasym.inputs import FloatArray

__all__ = ["found_of"]

_AT_ONCE = 1024
# As in `symasym.asymptotics.meetings`.
_FADE = 8
# For the size of order 1, zeros closer than this (by the layer's width) are taken to be so far
# apart: it hardly depends on the distance there, and is not lost to rounding.
_APART = 0.03
_EPS = 2.3e-16
# Zeros of A whose rounding, relative to their distances, is more than this are not used.
_ROUGHEST = 1e-10
# |A| at the start or at r beside its largest term, for the same reason.
_NEAREST = 1e-7
# Zeros that were found in two ways, at a double one.
_SAME = 1e-6


def _clear(scenes: Scenes) -> Any:
    """Of a zero at the start, or at r within the layer; a± may be as small as they like."""
    good = (scenes.a_minus != 0) & (scenes.a_plus != 0)
    for u in (scenes.start, scenes.r, -scenes.r):
        value, size = poly(list(scenes.c), u), poly(list(np.abs(scenes.c)), np.abs(u))
        good &= (np.abs(u) >= 1) | (np.abs(value) > _NEAREST * size)
    return good


class _Pairs(NamedTuple):
    """About one turning point of many drifts, in the orientation of the side where it lies.

    Attributes
    ----------
    pair : Pair
    point : array
        Where phi was expanded.
    good : array
        Whether there is a pair by itself that Airy functions are to take.
    first, above : array of int
        Which real zero is the first of the two, or which complex one it is; else -1.
    """

    pair: Pair
    point: FloatArray
    good: Any
    first: IntArray
    above: IntArray


def found_of(scenes: Scenes, order: int) -> Iterator[Found]:
    """The places of all scenes that float64 is enough for, chunk by chunk; order 0 only."""
    if order:
        return
    degree = np.where(scenes.c != 0, np.arange(len(scenes.c))[:, None], 0).max(axis=0)
    for d in np.unique(degree):
        chosen = np.flatnonzero(degree == d)
        for low in range(0, len(chosen), 8 * _AT_ONCE):
            rows = chosen[low : low + 8 * _AT_ONCE]
            some = scenes.take(rows)
            some = some._replace(c=some.c[: d + 1])
            for found in _found(some):
                yield Found(rows[found.rows], found.sights)


def _found(scenes: Scenes) -> Iterator[Found]:
    zeros = zeros_of(scenes.c)
    with np.errstate(all="ignore"):
        pairs = list(_candidates(scenes, zeros))
        slack = np.full(len(scenes.r), np.inf)
        for p in pairs:
            slack = np.minimum(slack, _beside(scenes, p))
        _choose(pairs)
    table = np.stack([structure(scenes, zeros), *(_key(scenes, zeros, p) for p in pairs)])
    good = zeros.complete & _clear(scenes)
    unique, group = np.unique(table[:, good], axis=1, return_inverse=True)
    rows = np.flatnonzero(good)
    for k in range(unique.shape[1]):
        members = rows[group.ravel() == k]
        for low in range(0, len(members), _AT_ONCE):
            part = members[low : low + _AT_ONCE]
            builder = _Builder(
                scenes.take(part),
                zeros.take(part),
                [_taken(p, part) for p in pairs],
                slack[part],
            )
            sights = builder.sights()
            sure = builder.sure()
            if sure.all():
                yield Found(part, sights)
            elif sure.any():
                yield Found(part[sure], _picked(sights, sure, len(part)))


def _taken(found: Any, rows: Any) -> Any:
    """Some rows of arrays within tuples and lists."""
    return _picked(found, rows, None)


def _picked(found: Any, rows: Any, count: int | None) -> Any:
    if isinstance(found, np.ndarray):
        return found[rows] if found.ndim and (count is None or len(found) == count) else found
    if isinstance(found, list):
        return [_picked(x, rows, count) for x in found]
    if isinstance(found, Pair):
        kept = {n: _picked(x, rows, count) for n, x in vars(found).items()}
        return Pair(**kept)
    if isinstance(found, tuple):
        parts = [_picked(x, rows, count) for x in found]
        return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
    return found


# -- which zeros meet ------------------------------------------------------------------------------


def _candidates(scenes: Scenes, zeros: Zeros) -> Iterator[_Pairs]:
    """The two zeros about each turning point of A on one side of the start."""
    degree = len(scenes.c) - 1
    reach = np.minimum(scenes.r, 1.0)
    start = np.clip(scenes.start, -reach, reach)
    if degree < 2:
        return
    turning = zeros_of(scenes.c[1:] * np.arange(1, degree + 1)[:, None])
    for k, point in enumerate(turning.values):
        inside = (k < turning.real) & (np.abs(point) < reach) & (point != start)
        if inside.any():
            found = _pairs(scenes, zeros, np.where(inside, point, 0.0), inside, start)
            # A complex pair may be found from several turning points, and is the nearest one's.
            middle = found.point + np.where(point < start, -1.0, 1.0) * found.pair.middle
            nearest = np.abs(turning.values - middle).min(axis=0)
            own = np.abs(point - middle) <= nearest * (1 + _SAME)
            found.good[:] &= own | (found.first >= 0)
            yield found


def _pairs(
    scenes: Scenes, zeros: Zeros, point: FloatArray, inside: Any, start: FloatArray
) -> _Pairs:
    """What splits off at `point`, if its zeros are among the known ones."""
    count = len(point)
    rows = np.flatnonzero(inside)
    one, two, *rest = (np.zeros(count) for _ in range(6))
    psi = [np.zeros(count) for _ in range(len(scenes.c) - 2)]
    pair = Pair(one, two, psi, *rest)
    good = np.zeros(count, dtype=bool)
    # Seen in the mirror, phi(u) becomes -phi(-u).
    side = np.where(point[rows] < start[rows], -1.0, 1.0)
    taylor = _shifted(scenes.c[:, rows], point[rows])
    taylor = [row * (side if j % 2 == 0 else 1.0) for j, row in enumerate(taylor)]
    found, alone = pairs_of(taylor)
    good[rows] = alone
    for name in ("middle", "square", "sign", "zeta", "slope", "level"):
        getattr(pair, name)[rows] = getattr(found, name)
    for mine, row in zip(psi, found.psi, strict=True):
        mine[rows] = row
    middle = point.copy()
    middle[rows] += side * found.middle
    first, above = np.full(count, -1), np.full(count, -1)
    for k in range(len(zeros.values) - 1):
        low, high = zeros.values[k], zeros.values[k + 1]
        same = np.abs(low + high - 2 * middle) + np.abs((high - low) ** 2 - 4 * pair.square)
        known = ((low > start) & (high < 1)) | ((low > -1) & (high < start))
        known &= (np.abs(low) < scenes.r) & (np.abs(high) < scenes.r)
        first = np.where(known & (same < _SAME), k, first)
    for k, z in enumerate(zeros.pairs):
        same = np.abs(z.real - middle) + np.abs(z.imag**2 + pair.square)
        known = 2 * k < len(zeros.values) - zeros.real
        above = np.where(known & (same < _SAME), k, above)
    above = np.where(first >= 0, -1, above)
    return _Pairs(pair, point, good & ((first >= 0) | (above >= 0)), first, above)


def _shifted(c: FloatArray, u: FloatArray) -> list[FloatArray]:
    work = list(c)
    for lowest in range(len(work) - 1):
        for k in range(len(work) - 2, lowest - 1, -1):
            work[k] = work[k] + work[k + 1] * u
    return work


def _choose(pairs: list[_Pairs]) -> None:
    """Each real zero goes with the neighbour that it meets first."""
    if len(pairs) < 2:
        return
    gaps = np.array([np.where(p.good & (p.first >= 0), np.abs(p.pair.zeta), np.inf) for p in pairs])
    firsts = np.array([p.first for p in pairs])
    chosen = np.zeros(gaps.shape, dtype=bool)
    columns = np.arange(gaps.shape[1])
    for _ in pairs:
        best = gaps.argmin(axis=0)
        some = gaps[best, columns] < np.inf
        chosen[best[some], columns[some]] = True
        near = np.abs(firsts - firsts[best, columns]) <= 1
        gaps[near & some] = np.inf
    for p, mine in zip(pairs, chosen, strict=True):
        p.good[:] &= mine | (p.first < 0)


def _beside(scenes: Scenes, found: _Pairs) -> FloatArray:
    """Leave out complex pairs that are cut through; e^{-lam slack} is what either way costs.

    Airy functions take the integrals over all of the line. Where the start or an end cuts through
    the pair and it is far from the real line, the outer part alone has all that counts.
    """
    reach = np.minimum(scenes.r, 1.0)
    start = np.clip(scenes.start, -reach, reach)
    side = np.where(found.point < start, -1.0, 1.0)
    v = [-row / (k + 1) for k, row in enumerate(scenes.c)]
    height = poly(v, found.point) * found.point - found.pair.level
    room = np.full(len(start), np.inf)
    for cut, there in ((start, np.abs(scenes.start) < 1), (side * reach, scenes.r < 1)):
        room = np.where(there, np.minimum(room, np.abs(poly(v, cut) * cut - height)), room)
    # Beyond the layer phi is another function, and the pair none of its own.
    middle = found.point + side * found.pair.middle
    within = ((middle > start) & (middle < reach)) | ((middle > -reach) & (middle < start))
    room = np.where(within, room, 0.0)
    fall = 4 / 3 * np.maximum(-found.pair.zeta, 0.0) ** 1.5
    cuts = found.good & (found.pair.zeta < 0)
    found.good[:] &= ~cuts | (fall <= room)
    slack: FloatArray = np.where(cuts, np.maximum(room, fall), np.inf)
    return slack


def _key(scenes: Scenes, zeros: Zeros, found: _Pairs) -> IntArray:
    """One number for each way in which the pair may lie."""
    right = found.point > np.clip(scenes.start, -1, 1)
    below = (zeros.values < found.point).sum(axis=0)
    key = (found.first + 1) * 16 + found.above + 1
    key = ((key * 16 + np.where(found.above >= 0, below, 0)) * 2 + right) * 2
    return np.where(found.good, key + (found.pair.sign > 0) + 1, 0)


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

    def __init__(
        self, scenes: Scenes, zeros: Zeros, pairs: list[_Pairs], slack: FloatArray
    ) -> None:
        super().__init__(scenes, zeros, 0)
        self.slack = slack
        self.known: dict[int, Series] = {}
        good = [found for found in pairs if found.good[0]]
        self.meetings = [self.meeting(key, found) for key, found in enumerate(good, start=2)]
        self.complex = [int(found.above[0]) for found in good if found.above[0] >= 0]
        self.single = [
            k for k in range(self.real) if not any(k in m.members for m in self.meetings)
        ]
        self.cuts = {sign: self.cut(sign) for sign in (-1, 1)}

    def sure(self) -> Any:
        """Where rounding is small."""
        worst = np.zeros(self.c.shape[1])
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

    def meeting(self, key: int, found: _Pairs) -> _Meeting:
        side = -1 if found.point[0] < self.edges[1][0] else 1
        pair = found.pair
        onward = bool(pair.sign[0] > 0)
        (a, b), *_ = map_coefficients(pair, 1, None, None)
        # s runs against u where phi is negative outside: du = u' ds with it.
        a, b = (a, b) if onward else (-a, -b)
        fold = Fold(key, pair.zeta, a, b, *_next_terms(pair))
        height = self.potential(found.point) - pair.level
        first = int(found.first[0])
        members = (first, first + 1) if first >= 0 else ()
        return _Meeting(fold, pair, side * found.point, side, onward, members, height)

    def between(
        self, sign: int, rising: list[Spot], falling: list[Spot], peaks: dict[int, Series]
    ) -> int:
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            if k in self.single:
                z = self.lines[k]
                height = self.potential(z) - self.base
                barrier = bool(self.slope(z)[0] > 0)
                spots = rising if barrier else falling
                spots.append(Spot(rank, height if barrier else -height, self.peak(k), None))
        for m in self.meetings:
            if m.side == sign:
                self.together(m, inside, rising, falling)
        rising.sort(key=lambda spot: spot.rank)
        falling.sort(key=lambda spot: spot.rank)
        return len(inside) + 1

    def together(
        self, m: _Meeting, inside: list[int], rising: list[Spot], falling: list[Spot]
    ) -> None:
        low, high = self.ranks(m, inside)
        rise = 2 / 3 * np.maximum(m.fold.zeta, 0.0) ** 1.5
        height = m.height - self.base
        well, barrier = (low, high) if m.onward else (high, low)
        rising.append(Spot(barrier, height + rise, FoldPart(m.fold, "rising"), None))
        falling.append(Spot(well, rise - height, FoldPart(m.fold, "falling"), None))

    def ranks(self, m: _Meeting, inside: list[int]) -> tuple[Any, Any]:
        """Of its two zeros, from the start on; between two ranks for a complex pair."""
        if m.members:
            low, high = sorted(inside.index(k) + 1 for k in m.members)
            return low, high
        before = sum(1 for k in inside if m.side * self.lines[k][0] < m.point[0])
        return before + 0.5, before + 0.5

    def side(
        self, sign: int, totals: list[Any], sizes: list[Any], peaks: dict[int, Series]
    ) -> Sight:
        sight = super().side(sign, totals, sizes, peaks)
        if sign * self.scenes.start[0] >= 1:
            return sight
        joint = list(self.joints(sign))
        return sight._replace(joint=joint, slack=self.slack)

    def joints(self, sign: int) -> Iterator[Joint]:
        inside = self.inside(sign)
        for m in self.meetings:
            if m.side == sign:
                low, high = self.ranks(m, inside)
                rise = 4 / 3 * np.maximum(m.fold.zeta, 0.0) ** 1.5
                well, barrier = (low, high) if m.onward else (high, low)
                yield Joint(well, barrier, rise, FoldPart(m.fold, "both") if m.onward else None)
        cut = self.cuts[sign]
        if cut is not None:
            yield Joint(-1, -1, 0.0, EdgePart(cut.edge, "both"))

    # -- the end ------------------------------------------------------------------------------

    def end(
        self, sign: int, rank: int, rising: list[Spot], falling: list[Spot]
    ) -> tuple[Any, Any, Any] | None:
        cut = self.cuts[sign]
        if cut is None:
            return super().end(sign, rank, rising, falling)
        barrier = max(rising, key=lambda spot: spot.rank)
        height = barrier.height - cut.edge.t**2 / 2
        onward = EdgePart(cut.edge, "onward")
        rising.append(Spot(rank, height, EdgePart(cut.edge, "rising"), onward))
        falling.append(Spot(rank, -height, EdgePart(cut.edge, "falling"), None))
        return None

    def cut(self, sign: int) -> _Cut | None:
        """The barrier next to the end, if there is one."""
        inside = (
            self.inside(sign)
            if abs(self.scenes.start[0]) < 1 or (sign * self.scenes.start[0] < 0)
            else []
        )
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
        reach = np.abs(self.edges[2 if sign > 0 else 0])
        slope = None
        if self.scenes.r[0] > 1:
            slope = self.scenes.a_plus if sign > 0 else -self.scenes.a_minus
        coefficients = [row * (sign if j % 2 == 0 else 1.0) for j, row in enumerate(self.c)]
        end_slope = poly(coefficients, reach) if slope is None else slope
        c = _shifted(np.array(coefficients), place)
        psi = c[1:]
        # The distance from phi at the end, which is known better than both places.
        gap = reach - place
        for _ in range(2):
            gap = end_slope / poly(psi, gap)
        row = self.peak(last).parts[0].coefficients
        ratio = np.abs(row[1] / row[0]) if len(row) > 1 else 0.0
        edge = _edge_of(sign, psi, gap, drop, ratio, slope)
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
                gaps[2 if sign > 0 else 0, cut.barrier] = cut.gap
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
                first, second = _past(m.pair, m.side * u - m.point - m.pair.middle, beyond, gap)
                total[at] += first + second
                size[at] += (np.abs(first) + np.abs(second)) * (64 * _EPS)
        # Order 1 is the derivative of -1/(2 phi²), of which start and end may cancel by chance.
        order_one = 0.5 / poly(list(self.c), self.edges) ** 2
        order_one[1] = -order_one[1]
        for sign, cut in self.cuts.items():
            if cut is not None:
                # At a barrier's end it goes with the edge.
                order_one[2 if sign > 0 else 0] = 0.0
        none = np.zeros_like(total)
        return [total, order_one, none], [size, np.abs(order_one) * 1e-10, none]


def _past(
    pair: Pair, y: FloatArray, beyond: bool, gap: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """A primitive of the pair's share of 1/phi, real part past both zeros, without a jump.

    `beyond`: at the end of the path that passes them, `gap` from the barrier if that is given.
    """
    even, odd = poly(pair.psi[0::2], pair.square), poly(pair.psi[1::2], pair.square)
    norm = even**2 - odd**2 * pair.square
    alpha, beta = pair.sign * even / norm, -pair.sign * odd / norm
    if gap is not None:
        # From the barrier, at y = root + gap.
        root = np.sqrt(np.maximum(pair.square, 0.0))
        twice = np.maximum(2 * root, 1e-290)
        log = np.log(gap) + np.log(gap + twice)
        return -alpha * np.log1p(twice / gap) / twice, beta / 2 * log
    log = np.log(np.abs(y * y - pair.square))
    sign = 1.0 if beyond else -1.0
    return -sign * alpha * _turn(pair.square, sign * y), beta / 2 * log


def _turn(square: FloatArray, y: FloatArray) -> FloatArray:
    """artanh(root/y)/root, root² = square, and atan for square < 0; y > 0."""
    q = square / (y * y)
    root = np.sqrt(np.abs(square))
    small = np.abs(q) < 1e-4
    series = (1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q / 11))))) / y
    safe = np.where(small, 1.0, root)
    real = np.log(np.abs((y + safe) / (y - safe))) / 2
    found: FloatArray = np.where(
        small, series, np.where(square > 0, real, np.arctan2(safe, y)) / safe
    )
    return found


def _next_terms(pair: Pair) -> tuple[FloatArray, FloatArray]:
    """a_1 and b_1, from the series at both zeros; only their size counts."""
    least = _APART**2
    square = np.where(np.abs(pair.square) < least, least, pair.square)
    mean = poly([3 * x / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(pair.psi[0::2])], square)
    zeta = square * np.cbrt(mean) ** 2
    half, root = np.sqrt(square + 0j), np.sqrt(zeta + 0j)
    found = []
    slopes = [_series_at(pair.psi, sign * half, sign * root) for sign in (1, -1)]
    b = (slopes[0][0] - slopes[1][0]) / (2 * root)
    for sign, (_, w2, w3) in zip((1, -1), slopes, strict=True):
        sigma = sign * root
        found.append(3 * w3 / (2 * sigma) - (2 * w2 - b) / (4 * sigma**2))
    return (found[0] + found[1]).real / 2, ((found[0] - found[1]) / (2 * root)).real


def _series_at(psi: list[FloatArray], y: Any, s: Any) -> tuple[Any, Any, Any]:
    """u(s) about a zero: the first three coefficients."""
    c = _shifted(np.array([row + 0 * y for row in psi]), y)
    c += [0 * y] * (3 - len(c))
    f1, f2, f3 = 2 * y * c[0], c[0] + 2 * y * c[1], c[1] + 2 * y * c[2]
    w1 = np.sqrt(2 * s / f1)
    # The branch that is positive where both zeros meet.
    w1 = np.where(w1.real < 0, -w1, w1)
    w2 = (1 / 3 - f2 * w1**3 / 3) / (f1 * w1)
    w3 = -(f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4) / (f1 * w1)
    return w1, w2, w3


def _edge_of(
    sign: int,
    psi: list[FloatArray],
    gap: FloatArray,
    drop: FloatArray | None,
    ratio: Numbers,
    slope: FloatArray | None,
) -> Edge:
    """phi = x psi(x) from the barrier on, with its end at x = gap; `drop` to the well before it."""
    keep: Any = 0.0
    keep_next: Any = 0.0
    if drop is not None:
        # As the well comes near the barrier, its own series breaks down, and is faded out.
        rho = _FADE * drop / (gap**2 * _area(psi, gap))
        keep = (1 + rho) * np.exp(-rho)
        keep_next = keep + rho**2 / 2 * np.exp(-rho)
        ratio = np.where(rho > 1e-6, ratio, 0.0)
    bottom = np.maximum(psi[0], 1e-100)
    whole = 1 / np.sqrt(bottom)
    t = gap * np.sqrt(2 * _area(psi, gap))
    rest = _rest(bottom, psi, gap) + whole / t * keep
    if drop is not None:
        rest = np.where(keep > 0.5, 1 / (gap * poly(psi, gap)) - whole * (1 - keep) / t, rest)
    peak = whole * (1 - keep)
    # Order 1 hardly depends on where the end is, close to the barrier.
    far = np.maximum(gap, _APART)
    t_far = far * np.sqrt(2 * _area(psi, far))
    value = far * poly(psi, far)
    bend = poly([(k + 1) * x for k, x in enumerate(psi)], far)
    next_rest = -bend / value**3 - whole * ratio * (1 - keep_next) / t_far + peak / t_far**3
    return Edge(sign, t, peak, rest, ratio * (1 - keep_next), np.abs(next_rest), slope)


def _area(psi: list[FloatArray], x: FloatArray) -> FloatArray:
    """int_0^1 y psi(x y) dy: V falls by x² times that."""
    found: FloatArray = poly([c / (k + 2) for k, c in enumerate(psi)], x)
    return found


def _rest(bottom: FloatArray, psi: list[FloatArray], gap: FloatArray) -> FloatArray:
    """1/(gap psi(gap)) - 1/sqrt(psi(0) 2 area)/gap."""
    if len(psi) == 1:
        return np.zeros_like(gap)
    end = poly(psi, gap)
    mean = np.sqrt(2 * _area(psi, gap) * bottom)
    first = poly([2 * c / (k + 3) for k, c in enumerate(psi[1:])], gap)
    second = poly(psi[1:], gap)
    found: FloatArray = (first * bottom - 2 * bottom * second - gap * second**2) / (
        end * mean * (end + mean)
    )
    return found
