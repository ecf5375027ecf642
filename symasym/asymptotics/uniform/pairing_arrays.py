"""Pairs of zeros of many polynomial drifts that may coalesce, and the drifts by their structure.

In float64, for order 0 (`symasym.asymptotics.uniform.order_zero`). A pair is split off as a
quadratic factor, so that its middle and its distance, real or not, are as exact as A's coefficients
are.
"""

from __future__ import annotations

from collections.abc import Iterator
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.uniform.order_zero import OrderZero, factor_pair
from symasym.asymptotics.weak_noise.arrays import (
    ExpandedScenes,
    clear_of_zero,
    mapped,
    structure,
)
from symasym.asymptotics.weak_noise.one_sided import PolynomialScenes as Scenes
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import IntArray
from symasym.numbers.polynomials import Zeros, poly, shifted, zeros_of
from symasym.series.quadratic_factor import Pair, pairs_of

__all__ = ["paired_of"]

_AT_ONCE = 4096
_LARGEST_KEY = 2.0**62
# Zeros that were found in two ways, at a double one.
_SAME = 1e-6


def paired_of(scenes: Scenes, order: int) -> Iterator[ExpandedScenes]:
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
                yield ExpandedScenes(rows[found.rows], found.sides)


def _found(scenes: Scenes) -> Iterator[ExpandedScenes]:
    zeros = zeros_of(scenes.c)
    pairs, exponential_gap = pairs_beside(scenes, zeros)
    keys = [structure(scenes, zeros), *(key_of(scenes, zeros, p) for p in pairs)]
    # a± may be as small as they like.
    good = zeros.complete & clear_of_zero(scenes, ends=False)
    rows = np.flatnonzero(good)
    group = _numbered([key[rows] for key in keys])
    for k in range(int(group.max(initial=-1)) + 1):
        members = rows[group == k]
        for low in range(0, len(members), _AT_ONCE):
            part = members[low : low + _AT_ONCE]
            some = mapped(pairs, itemgetter(part))
            builder = _of_columns(scenes.take(part), zeros.take(part), some, exponential_gap[part])
            if builder.beside_a_barrier():
                break
            both_sides = builder.both_sides()
            sure = builder.sure()
            if sure.all():
                yield ExpandedScenes(part, both_sides)
            elif sure.any():
                yield ExpandedScenes(part[sure], mapped(both_sides, itemgetter(sure)))


def _numbered(keys: list[IntArray]) -> IntArray:
    """A number for each combination of keys, from 0 on."""
    found = np.zeros_like(keys[0])
    for key in keys:
        if float(found.max(initial=0) + 1) * float(key.max(initial=0) + 1) > _LARGEST_KEY:
            found = np.unique(found, return_inverse=True)[1].ravel()
        found = found * (key.max(initial=0) + 1) + key
    group: IntArray = np.unique(found, return_inverse=True)[1].ravel()
    return group


def _of_columns(
    scenes: Scenes, zeros: Zeros, pairs: list[PairColumns], exponential_gap: FloatArray
) -> OrderZero:
    """The columns of one structure."""
    one = OrderZero(scenes, zeros, 0)
    one.edges, one.exponential_gap = np.array(one.edges), exponential_gap
    good = [p for p in pairs if p.good[0]]
    one.together = []
    for key, p in enumerate(good, start=2):
        side = -1 if p.point[0] < one.edges[1][0] else 1
        low = int(p.first[0])
        members = (low, low + 1) if low >= 0 else ()
        one.together.append(one.of_pair(key, p.pair, p.point, side, members))
    taken = {int(p.above[0]) for p in good}
    one.apart = [
        (factor_pair(one.c, z), rounding)
        for j, (z, rounding) in enumerate(zip(one.pairs, one.pair_rounding, strict=True))
        if j not in taken
    ]
    return one.prepared()


# -- pairs -----------------------------------------------------------------------------------------


class PairColumns(NamedTuple):
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


def pairs_beside(scenes: Scenes, zeros: Zeros) -> tuple[list[PairColumns], FloatArray]:
    """Pairs to be taken together; leaving others out costs e^{-lam exponential_gap}."""
    with np.errstate(all="ignore"):
        exponential_gap = np.full(len(scenes.r), np.inf)
        pairs = list(_candidates(scenes, zeros))
        for found in pairs:
            exponential_gap = np.minimum(exponential_gap, _beside(scenes, found))
        _choose(pairs)
    return pairs, exponential_gap


def _candidates(scenes: Scenes, zeros: Zeros) -> Iterator[PairColumns]:
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


def _barrier(
    scenes: Scenes, height: FloatArray, start: FloatArray, end: FloatArray, middle: FloatArray
) -> FloatArray:
    """The distance of V from this height where the line is cut off; 0 for a pair beyond."""
    v = [-row / (k + 1) for k, row in enumerate(scenes.c)]
    barrier = np.full(len(start), np.inf)
    for cut, there in ((start, np.abs(scenes.start) < 1), (end, scenes.r < 1)):
        barrier = np.where(there, np.minimum(barrier, np.abs(poly(v, cut) * cut - height)), barrier)
    # Beyond the layer phi is another function, and the pair none of its own.
    within = (np.minimum(start, end) < middle) & (middle < np.maximum(start, end))
    return np.where(within, barrier, 0.0)


def _pairs(
    scenes: Scenes, zeros: Zeros, point: FloatArray, inside: Any, start: FloatArray
) -> PairColumns:
    """The pairs that split off at `point`, if their zeros are among the known ones."""
    count = len(point)
    rows = np.flatnonzero(inside)
    one, two, *rest = (np.zeros(count) for _ in range(6))
    psi = [np.zeros(count) for _ in range(len(scenes.c) - 2)]
    pair = Pair(one, two, psi, *rest)
    good = np.zeros(count, dtype=bool)
    # Seen in the mirror, phi(u) becomes -phi(-u).
    side = np.where(point[rows] < start[rows], -1.0, 1.0)
    taylor = shifted(list(scenes.c[:, rows]), point[rows])
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
    return PairColumns(pair, point, good & ((first >= 0) | (above >= 0)), first, above)


def _choose(pairs: list[PairColumns]) -> None:
    """Each real zero goes with the neighbour with which it coalesces first."""
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


def _beside(scenes: Scenes, found: PairColumns) -> FloatArray:
    """Leave out complex pairs that are cut through; either way costs e^{-lam exponential_gap}.

    Airy functions take the integrals over all of the line. Where the start or an end cuts through
    the pair and it is far from the real line, the regular part alone has all that counts.
    """
    reach = np.minimum(scenes.r, 1.0)
    start = np.clip(scenes.start, -reach, reach)
    side = np.where(found.point < start, -1.0, 1.0)
    v = [-row / (k + 1) for k, row in enumerate(scenes.c)]
    height = poly(v, found.point) * found.point - found.pair.level
    middle = found.point + side * found.pair.middle
    barrier = _barrier(scenes, height, start, side * reach, middle)
    fall = 4 / 3 * np.maximum(-found.pair.zeta, 0.0) ** 1.5
    cuts = found.good & (found.pair.zeta < 0)
    found.good[:] &= ~cuts | (fall <= barrier)
    exponential_gap: FloatArray = np.where(cuts, np.maximum(barrier, fall), np.inf)
    return exponential_gap


def key_of(scenes: Scenes, zeros: Zeros, found: PairColumns) -> IntArray:
    """One number for each way in which the pair may lie."""
    right = found.point > np.clip(scenes.start, -1, 1)
    below = (zeros.values < found.point).sum(axis=0)
    key = (found.first + 1) * 16 + found.above + 1
    key = ((key * 16 + np.where(found.above >= 0, below, 0)) * 2 + right) * 2
    return np.where(found.good, key + (found.pair.sign > 0) + 1, 0)
