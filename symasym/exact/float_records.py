"""Records of the blocks of [-1, 1] in float64 (`symasym.exact.float_blocks`).

A block is sampled, replaced by the layers at its ends (`symasym.exact.float_panels`), or bisected
until one of both holds; what bisecting doesn't resolve is bounded. Slopes by the drift go along
where the field has directions.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symasym.base.call_context import step
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_blocks import (
    FAINT,
    MIDDLE,
    Anchors,
    Blocks,
    Plan,
    at_nodes,
    counting,
    panel_counts,
    phi_at,
    planned,
    positions,
    series_of,
    tail_of,
)
from symasym.exact.float_panels import REACH, RESOLUTION, Moments
from symasym.numbers.float_arrays import DualArray

_PLANNED_AT_ONCE = 2048
_SCENES_AT_ONCE = 128
#: So few panels, with slopes twice as many, cost less than another group of blocks, or bisecting:
#: all have one step more.
_FEW = 64
_ULP = 2e-16  # of an exponent, its sum included
_DEEPEST = 90  # bisections
_OPEN = 1e-9  # of log T, roughly: what unresolved blocks may leave open
#: Blocks of one scene waiting for bisection: more of them means that bisecting does not help.
_MOST_BLOCKS = 1 << 13


class Records(NamedTuple):
    """Records of panels in any order, and what rounding of the drift does to them.

    `shift` is the absolute error of `rise`, `local` a relative one of the other moments; of dual
    ones, the slopes are the errors of the slopes, of the moments' logarithms in `local`.
    """

    scene: IntArray
    part: IntArray
    position: FloatArray
    moments: Moments
    slow: np.ndarray
    shift: FloatArray
    local: FloatArray

    @classmethod
    def exactly(cls, scene: IntArray, part: int, moments: Moments) -> Records:
        """One record a scene, of a drift that is known to rounding."""
        n = len(scene)
        zero = np.zeros(n)
        return cls(
            scene, np.full(n, part, np.intp), zero, moments, np.zeros(n, dtype=bool), zero, zero
        )

    @classmethod
    def joined(cls, parts: Sequence[Records]) -> Records:
        """All records of several groups, one after the other."""
        rest = zip(*(p[:3] + p[4:] for p in parts), strict=True)
        scene, part, position, *others = (np.concatenate(x) for x in rest)
        moments = (np.concatenate(m) for m in zip(*(p.moments for p in parts), strict=True))
        return cls(scene, part, position, Moments(*moments), *others)

    def sorted(self) -> Records:
        """The records by scene, part and position."""
        order = np.lexsort((self.position, self.part, self.scene))
        scene, part, position, _, *others = self
        moments = Moments(*(m[order] for m in self.moments))
        return Records(
            scene[order], part[order], position[order], moments, *(x[order] for x in others)
        )


def merged(records: Records) -> Records:
    """Sorted records, slow neighbours joined."""
    if not records.slow.any():
        return records
    first, moments = float_panels.merge_slow(records.scene, records.moments, records.slow)
    scene, part, position, _, slow, shift, local = records
    return Records(
        scene[first],
        part[first],
        position[first],
        moments,
        slow[first],
        np.add.reduceat(shift, first),
        np.maximum.reduceat(local, first),
    )


def records_of(
    field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors, ahead: FloatArray
) -> Records:
    """Moments of all blocks, bisecting those that are neither slow nor few panels.

    `ahead` is the logarithm of the integral of e^{lam V} before the first block of each scene,
    with V = 0 there.
    """
    nothing = np.empty(0)
    done = [Records.exactly(np.empty(0, dtype=np.intp), 0, Moments(*(nothing,) * 4))]
    depth, most = 0, panel_counts(field)[-1] * REACH
    while blocks.scene.size:
        first, plans = depth == 0, []
        while blocks.scene.size:
            step()
            waiting = np.bincount(blocks.scene, minlength=len(lam))
            hopeless = waiting > (2 * _MOST_BLOCKS if depth <= _DEEPEST else 0)
            if depth and hopeless.any():
                done.append(_unresolved(field, lam, blocks.take(hopeless[blocks.scene]), anchors))
                blocks = blocks.take(~hopeless[blocks.scene])
                if not blocks.scene.size:
                    break
            parts = []
            for low in range(0, len(blocks.scene), _PLANNED_AT_ONCE):
                chunk = blocks.take(slice(low, low + _PLANNED_AT_ONCE))
                ready, plan = planned(field, lam, chunk, anchors)
                plans.append((chunk.take(ready), plan.take(ready)))
                parts.append(_pieces(chunk.take(~ready), np.abs(plan.rise[~ready]) / most))
            blocks, depth = _joined(parts), depth + 1
        if not plans:
            break
        ready, plan = _joined([b for b, _ in plans]), _joined([p for _, p in plans])
        steep = np.bincount(ready.scene, plan.steep).max(initial=0.0)
        if first and steep > 8 * FAINT and not field.directions:
            order = np.lexsort((ready.t0, ready.part, ready.scene))
            ready, plan = ready.take(order), plan.take(order)
            ends = np.searchsorted(ready.scene, np.r_[: len(lam) : _SCENES_AT_ONCE, len(lam)])
            some = [slice(*pair) for pair in pairwise(np.unique(ends).tolist())]
            counts = np.concatenate([counting(ready.take(x), plan.take(x), ahead) for x in some])
            done.append(_coarse(ready, plan, ~counts))
            ready, plan = ready.take(counts), plan.take(counts)
        moments, plan, missed = _moments(field, lam, ready, plan, anchors)
        resolved = missed <= RESOLUTION
        blocks = _pieces(ready.take(~resolved), np.zeros(np.count_nonzero(~resolved)))
        if blocks.scene.size:
            ready, plan, missed = ready.take(resolved), plan.take(resolved), missed[resolved]
            moments = Moments(*(m[resolved] for m in moments))
        # The exponents of a block move by `steep` at most, and as much is rounded, also where they
        # fall as far as they have risen.
        rounded = _ULP * np.where(plan.panels > 0, plan.steep, 0.0)
        done.append(
            Records(
                ready.scene,
                ready.part,
                ready.t0,
                moments,
                plan.panels == 0,
                plan.shift + rounded,
                plan.local + (missed + rounded),
            )
        )
    return Records.joined(done)


def _joined(parts: Sequence[Any]) -> Any:
    """Named tuples of arrays, one after the other."""
    if len(parts) == 1:
        return parts[0]
    return type(parts[0])(*(np.concatenate(f) for f in zip(*parts, strict=True)))


def _pieces(blocks: Blocks, wanted: FloatArray) -> Blocks:
    """Equal pieces of the blocks: of each a power of 2 from 2 to 16, at most the number wanted."""
    number = 2 ** np.log2(np.fmin(np.fmax(wanted, 2.0), 16.0)).astype(np.intp)
    owner = np.repeat(np.arange(len(number)), number)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(number) - number, number)
    whole, number = blocks.take(owner), number[owner]
    h = (whole.t1 - whole.t0) / number
    right = np.where(k + 1 < number, whole.t0 + (k + 1) * h, whole.t1)
    return whole._replace(t0=whole.t0 + k * h, t1=right)


def _coarse(blocks: Blocks, plan: Plan, left_out: np.ndarray) -> Records:
    """One record for neighbours that do not count: the middles of bounds, half their distances.

    On a stretch of width h without a zero of phi, the integrals of e and 1/e are at most h times
    their largest values, the nested one h^2; at least as much as where they change by a factor e.
    """
    index = np.flatnonzero(left_out)
    blocks, plan = blocks.take(index), plan.take(index)
    apart = np.diff(index, prepend=-2) != 1
    for x in (blocks.scene, plan.rise > 0):
        apart[1:] |= x[1:] != x[:-1]
    first = np.flatnonzero(apart)
    if not first.size:
        return Records.exactly(first, 0, Moments(*(np.empty(0),) * 4))
    width = blocks.t1 - blocks.t0
    h, steepest = np.add.reduceat(width, first), np.maximum.reduceat(plan.steep / width, first)
    # The error is that of the nested one, so that none reaches above its upper bound.
    half = 1.0 + np.log1p(h * steepest)
    middle = np.exp(-half)
    moments = Moments(np.add.reduceat(plan.rise, first), h * middle, h * middle, h * h * middle)
    shift = np.add.reduceat(plan.shift, first)
    local = half + shift
    blocks = blocks.take(first)
    return Records(*blocks[:2], blocks.t0, moments, np.zeros(len(h), dtype=bool), shift, local)


def _moments(
    field: Field, lam: FloatArray, blocks: Blocks, plan: Plan, anchors: Anchors
) -> tuple[Moments, Plan, FloatArray]:
    """Moments of the blocks as they are planned; the plan, whose errors are dual where slopes are
    asked for; and the truncation errors of the blocks that are sampled."""
    n = len(blocks.scene)
    moments, missed = Moments(*np.empty((4, n))), np.zeros(n)
    shift: Any = plan.shift
    local: Any = plan.local
    if field.directions:
        slopes = np.zeros((6, len(field.directions.names), n))
        arrays: Any = map(DualArray, (shift, local, *moments), slopes)
        shift, local, *arrays = arrays
        moments = Moments(*arrays)
    counts = np.append(0, panel_counts(field))
    panels, place = plan.panels, np.searchsorted(counts, plan.panels.max(initial=0))
    more = counts[min(place + 1, len(counts) - 1)]
    if n * more <= (2 * _FEW if field.directions else _FEW):
        panels = np.where(panels > 0, more, 0)
    order = np.argsort(panels, kind="stable")
    ends = np.searchsorted(panels[order], counts, side="right")
    place, memory = float_panels.memory()
    low = 0
    for count, end in zip(counts.tolist(), ends.tolist(), strict=True):
        at_once = min(float_panels.AT_ONCE // max(count, 1), float_panels.COLUMNS)
        for begin in range(low, end, at_once):
            index = order[begin : min(end, begin + at_once)]
            part = blocks.take(index)
            h: Any = part.t1 - part.t0
            lam_h = lam[part.scene] * h
            series = series_of(field, lam_h, part, anchors)
            if field.directions:
                h = field.directions.stretched(h, part.scene)
            if count == 0:
                x: Any = np.ascontiguousarray(at_nodes(field, part, anchors, series, lam_h).T)
                if field.directions:
                    x, *off = _slow_slopes(field, lam_h, part, anchors, x, plan.shift[index])
                some = float_panels.slow(x, h)
            else:
                sampled: Any = _exponents(field, lam_h, part, anchors, series, count, place)
                if field.directions:
                    *sampled, reach, gap = _sampled_slopes(field, lam_h, part, anchors, *sampled)
                some, missed[index] = float_panels.sampled(
                    sampled[0], sampled[1], h, None if field.directions else memory
                )
                if field.directions:
                    rounded = plan.shift[index] / np.maximum(plan.steep[index], 1e-300)
                    gap += (SLOPE_ROUNDING + 4 * rounded) * reach
                    off = [gap, gap + SLOPE_TRUNCATION * missed[index] * reach]
            for whole, found in zip(moments, some, strict=True):
                whole[index] = found
            if field.directions:
                shift.slopes[:, index], local.slopes[:, index] = off
        low = end
    return moments, plan._replace(shift=shift, local=local), missed


def _exponents(
    field: Field,
    lam_h: FloatArray,
    blocks: Blocks,
    anchors: Anchors,
    series: FloatArray | None,
    count: int,
    work: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Exponents and rises of `count` panels of each block (`float_panels.exponents_of_series`)."""
    nodes = float_panels.NODES
    if series is not None:
        (place,) = float_panels.arrays_in(work, (nodes,), (count, len(lam_h)))
        return float_panels.exponents_of_series(series, count, place)
    phi = phi_at(field, blocks, anchors, _gauss_nodes(count)) * (lam_h / count)[:, None]
    values = np.ascontiguousarray(phi.reshape(len(lam_h), count, nodes).transpose(1, 2, 0))
    return float_panels.exponents_of_values(values)


def _gauss_nodes(count: int) -> FloatArray:
    """The Gauss nodes of `count` equal panels of [0, 1], one after the other."""
    nodes: FloatArray = (np.arange(count)[:, None] + float_panels.gauss().nodes).ravel() / count
    return nodes


def _unresolved(field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors) -> Records:
    """Records of blocks that bisecting doesn't resolve, with all that is open as their error.

    Where phi is known to be within d of its value m in the middle of a block of width h, e^{lam V}
    is that of the drift m times a number between e^-x and e^x, x = lam d h, and so are the moments,
    with 2 x. That is all that is needed where log T is far larger than x, as beside a zero of A
    whose layer is thinner than its rounding.
    """
    h = blocks.t1 - blocks.t0
    phi = phi_at(field, blocks, anchors, np.array([0.5]))[:, 0]
    series = field.series(blocks.scene)
    if series is None:
        middle = positions(blocks, anchors, MIDDLE)[:, 0]
        around = field.spread(blocks.scene, middle, 0.51 * h + 1e-15)
        assert around is not None
        known = field.rounding(blocks.scene, middle[:, None])[:, 0]
        off = np.abs(around.centre - phi) + around.radius + known
    else:
        slope = (np.arange(len(series))[:, None] * np.abs(series)).sum(axis=0)
        off = 0.51 * h * slope + 1e-15 * field.size()[blocks.scene]
    lam_here = lam[blocks.scene]
    change: Any = lam_here * h * np.where(np.isnan(off), np.inf, off + 1e-15 * np.abs(phi))
    # What is open in a scene as a whole, beside the most that log T can be: too much for any digit
    # makes one record of it, since sweeping thousands would take seconds.
    whole = np.bincount(blocks.scene, change, len(lam))
    hopeless = ~(whole <= _OPEN * (1.0 + lam * field.size()[: len(lam)]))[blocks.scene]
    change[hopeless] = np.inf
    first = np.unique(blocks.scene, return_index=True)[1]
    kept = ~hopeless
    kept[first] = True
    blocks, lam_here, phi, h, change = (
        blocks.take(kept), lam_here[kept], phi[kept], h[kept], change[kept]
    )  # fmt: skip
    moments = float_panels.constant(lam_here * phi, h)
    if field.directions:
        # Nothing is known of the slopes.
        change = DualArray(change, np.full((len(field.directions.names), len(h)), np.inf))
    return Records(*blocks[:2], blocks.t0, moments, np.zeros(len(h), bool), change, 2 * change)


#: More than the rounding of a slope, relative to the largest on its way.
SLOPE_ROUNDING = 4e-15
#: How much more of a slope than of the moment the nodes of a panel miss, in units of its reach.
SLOPE_TRUNCATION = 100.0


def _slope_nodes(blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """The nodes of the blocks in u; a slope has nothing to lose by their rounding."""
    return np.clip(positions(blocks, anchors, nodes), -1.0, 1.0)


def _dual(field: Field, of_drift: FloatArray, scene: IntArray, y: FloatArray) -> DualArray:
    """Numbers linear in lam phi h, those of `scene` along the last axis, from their slopes by the
    drift."""
    assert field.directions
    slopes = field.directions.rows(of_drift, y)
    slopes[-1] += field.directions.stretch[scene] * y
    return DualArray(y, slopes)


def _slow_slopes(
    field: Field,
    lam_h: FloatArray,
    blocks: Blocks,
    anchors: Anchors,
    x: FloatArray,
    shift: FloatArray,
) -> tuple[DualArray, FloatArray, FloatArray]:
    """lam phi h at the Lobatto nodes of slow blocks; how far the slopes of their records are off,
    those of `rise` and those of the other moments' logarithms."""
    assert field.directions
    u = _slope_nodes(blocks, anchors, float_panels.lobatto().nodes)
    of_drift = lam_h[:, None] * field.directions.of_drift(blocks.scene, u)
    dual = _dual(field, of_drift.swapaxes(1, 2), blocks.scene, x.T).T
    least = np.abs(x).min(axis=1)
    off = (SLOPE_ROUNDING + 4 * shift / least) * np.abs(dual.slopes).max(axis=2)
    off += np.abs(dual.slopes @ tail_of()).max(axis=2)
    # Differentiating for the series multiplies what is wrong at an end by 2 NODES^2 a width.
    growth = 1.0 + 2 * float_panels.NODES**2 / least
    return dual, off, off * growth / least


def _sampled_slopes(
    field: Field,
    lam_h: FloatArray,
    blocks: Blocks,
    anchors: Anchors,
    exponents: FloatArray,
    rise: FloatArray,
) -> tuple[DualArray, DualArray, FloatArray, FloatArray]:
    """Exponents and rises with their slopes; how large these are on the way to the end of each
    block, and what the nodes miss of them."""
    assert field.directions
    count, nodes = len(rise), float_panels.NODES
    u = _slope_nodes(blocks, anchors, _gauss_nodes(count))
    of_drift = (lam_h / count)[:, None] * field.directions.of_drift(blocks.scene, u)
    values = of_drift.reshape(-1, len(lam_h), count, nodes).transpose(0, 2, 3, 1)
    both = [
        _dual(field, integral, blocks.scene, y)
        for integral, y in zip(
            float_panels.exponents_of_values(values), (exponents, rise), strict=True
        )
    ]
    nothing = np.zeros_like(rise)
    # What the last coefficients leave to those beyond is less than four times as much.
    last = np.abs(float_panels.last_coefficients()[1:] @ values).sum(axis=2)
    reach, missed = (
        field.directions.rows(x, nothing)
        for x in (np.abs(values).max(axis=2, initial=0.0), 4 * last)
    )
    reach = np.maximum(reach, np.abs(both[0].slopes).max(axis=2))
    return both[0], both[1], reach.sum(axis=1), missed.sum(axis=1)
