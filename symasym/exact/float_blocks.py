"""Blocks of [-1, 1] in float64 and their records (`symasym.exact.float_panels`).

The drift on a block is taken as it stands or by its Taylor polynomial about a nearby zero of A. A
block is sampled, replaced by the layers at its ends, or bisected until one of both holds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.base.patience import step
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_panels import REACH, REACH_DOWN, RESOLUTION, SLOWNESS, Moments
from symasym.numbers.complex_balls import tame
from symasym.numbers.dual_arrays import DualArray
from symasym.numbers.polynomials import poly, shifted

#: lam |A| up to which positions are measured from u = 0.
MILD = 5e3
#: Panels of a sampled block, joined before the log domain is entered: e^(8 REACH_DOWN) < 1e39.
_COUNTS = np.array([1, 2, 3, 4, 5, 6, 8])
#: The same where slopes are carried and a sweep takes longer than samples: e^(32 REACH) < 1e112.
_COUNTS_OF_SLOPES = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])
_PANELS_AT_ONCE = 1024  # stays in cache, and below the size at which BLAS starts threads
_PLANNED_AT_ONCE = 4096
_SCENES_AT_ONCE = 128
_DEEPEST = 90  # bisections
_FAINT = 45.0  # what is e^-45 of a sum changes none of its digits
_OPEN = 1e-9  # of log T, roughly: what unresolved blocks may leave open
_THIN = 1e24  # lam |A| from which on a zero's layer, lam^-1/2 wide, is thinner than 1e-12
#: Blocks of one scene waiting for bisection: more of them means that bisecting does not help.
_MOST_BLOCKS = 1 << 13


class Blocks(NamedTuple):
    """Intervals [t0, t1] about `anchor` (index of a Taylor expansion; -1: t is u itself)."""

    scene: IntArray
    part: IntArray
    anchor: IntArray
    t0: FloatArray
    t1: FloatArray

    def take(self, index: slice | np.ndarray) -> Blocks:
        """Some of the blocks."""
        fields: list[Any] = [field[index] for field in self]
        return Blocks(*fields)


class Anchors(NamedTuple):
    centre: FloatArray
    scene: IntArray
    coefficients: FloatArray
    radius: FloatArray


def partition(
    field: Field, lam: FloatArray, lo: FloatArray, hi: FloatArray
) -> tuple[Blocks, Anchors]:
    """First blocks of each scene's part of [-1, 1], and the expansions they are taken about."""
    inside = np.flatnonzero(hi > lo)
    # Rounding of phi enters the exponent as lam * size * 1e-16.
    mild = lam[inside] * field.size()[inside] < MILD
    easy, hard = inside[mild], inside[~mild]
    first = _even_blocks(field, easy, lo, hi)
    if not hard.size:
        empty = np.empty(0, dtype=np.intp)
        return first, Anchors(np.empty(0), empty, np.empty((0, 1)), np.empty(0))
    graded, anchors = _graded_blocks(field, lam, hard, lo, hi)
    return Blocks(*(np.concatenate(f) for f in zip(first, graded, strict=True))), anchors


def _even_blocks(field: Field, scene: IntArray, lo: FloatArray, hi: FloatArray) -> Blocks:
    """Blocks of equal width: one for a polynomial, eight for another drift."""
    # A polynomial is bisected where it must be; another drift is looked at more closely.
    pieces = 8 if field.series(scene[:1]) is None else 1
    edges = np.linspace(0.0, 1.0, pieces + 1)
    t = lo[scene, None] + (hi - lo)[scene, None] * edges
    t[:, -1] = hi[scene]
    n = len(scene)
    return Blocks(
        np.repeat(scene, pieces),
        np.zeros(n * pieces, dtype=np.intp),
        np.full(n * pieces, -1, dtype=np.intp),
        t[:, :-1].ravel(),
        t[:, 1:].ravel(),
    )


def _graded_blocks(
    field: Field, lam: FloatArray, scene: IntArray, lo: FloatArray, hi: FloatArray
) -> tuple[Blocks, Anchors]:
    """Blocks that shrink by halves towards the ends and the zeros of A.

    Their widths are measured from the nearest of these points, not from u = 0,
    so that a layer of width 1e-9 is resolved to full relative precision.
    """
    low, high = lo[scene, None], hi[scene, None]
    zeros = _polished(field, scene, field.zeros(scene), lam[scene] * field.size()[scene])
    zeros = np.where((zeros > low) & (zeros < high), zeros, np.nan)
    marks = np.sort(np.concatenate((low, zeros, high), axis=1), axis=1)  # nan last
    marks[:, 1:][marks[:, 1:] == marks[:, :-1]] = np.nan
    marks = np.sort(marks, axis=1)
    known = np.isfinite(marks)
    index = np.full(marks.shape, -1, dtype=np.intp)
    index[known] = np.arange(known.sum())
    owner = np.broadcast_to(scene[:, None], marks.shape)[known]
    coefficients, radius = field.taylor(owner, marks[known])
    anchors = Anchors(marks[known], owner, coefficients, radius)

    row, column = np.nonzero(known[:, :-1] & known[:, 1:])
    left, right = index[row, column], index[row, column + 1]
    half = (anchors.centre[right] - anchors.centre[left]) / 2
    halves = [(left, half, 2 * column, False), (right, half, 2 * column + 1, True)]
    # Down to where even the steepest drift moves lam V by less than a panel.
    steepest = lam[scene[row]] * np.maximum(field.size()[scene[row]], 1e-300)
    # What is beyond float64 is not a number here, and unresolved later on.
    levels = np.clip(np.ceil(np.log2(np.fmax(half * steepest / REACH, 1.0))), 1, 120) + 1
    chosen = []
    for anchor, length, part, from_right in halves:
        count = _levels_needed(anchors, anchor, lam[scene[row]], length, levels, from_right)
        which = np.repeat(np.arange(len(anchor)), count)
        k = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        outer = np.ldexp(length[which], -k.astype(np.int64))
        inner = np.where(k == count[which] - 1, 0.0, outer / 2)
        t0, t1 = (-outer, -inner) if from_right else (inner, outer)
        chosen.append(Blocks(scene[row][which], part[which], anchor[which], t0, t1))
    return Blocks(*(np.concatenate(f) for f in zip(*chosen, strict=True))), anchors


def _polished(field: Field, scene: IntArray, zeros: FloatArray, rate: FloatArray) -> FloatArray:
    """The zeros, by Newton's method where their layers are thinner than their rounding."""
    row, column = np.nonzero(np.isfinite(zeros) & (rate > _THIN)[:, None])
    if not row.size:
        return zeros
    polished = zeros.copy()
    for _ in range(2):
        at = polished[row, column]
        taylor = field.taylor(scene[row], at)[0]
        with np.errstate(all="ignore"):
            move = taylor[:, 0] / taylor[:, 1]
        # Extremes of A are among the zeros, and stay where they are.
        polished[row, column] = np.where(np.abs(move) < 1e-12, at - move, at)
    return polished


def _levels_needed(
    anchors: Anchors,
    anchor: IntArray,
    lam: FloatArray,
    length: FloatArray,
    most: FloatArray,
    from_right: bool,
) -> IntArray:
    """Halvings until the innermost block is one sampled panel, or one slow one."""
    c = np.abs(anchors.coefficients[anchor])
    count = np.ones(len(anchor), dtype=np.intp)
    t = length.copy()
    active = np.ones(len(anchor), dtype=bool)
    for _ in range(int(most.max())):
        bound, slope = np.zeros_like(t), np.zeros_like(t)
        for k in range(c.shape[1] - 1, -1, -1):
            slope = slope * t + bound
            bound = bound * t + c[:, k]
        first = c[:, 0]
        even = (bound - first < first / 2) & (lam * first * first > 8 * SLOWNESS * slope)
        active = active & (lam * bound * t > REACH) & ~even & (count < most)
        if not active.any():
            break
        count[active] += 1
        t = np.where(active, t / 2, t)
    return count


def phi_at(field: Field, blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """Drift at the nodes (fractions of the width) of each block."""
    t = blocks.t0[:, None] + (blocks.t1 - blocks.t0)[:, None] * nodes
    direct = blocks.anchor < 0
    if direct.all():
        return field.phi(blocks.scene, t)
    result = np.empty_like(t)
    beyond = np.maximum(np.abs(blocks.t0), np.abs(blocks.t1)) > np.where(
        direct, np.inf, anchors.radius[blocks.anchor]
    )
    within = ~direct & ~beyond
    if direct.any():
        result[direct] = field.phi(blocks.scene[direct], t[direct])
    if beyond.any():
        u = anchors.centre[blocks.anchor[beyond], None] + t[beyond]
        result[beyond] = field.phi(blocks.scene[beyond], u)
    if within.any():
        c = anchors.coefficients[blocks.anchor[within]]
        result[within] = poly(list(c.T[:, :, None]), t[within])
    return result


def is_direct(blocks: Blocks, anchors: Anchors) -> np.ndarray:
    """Blocks on which the drift is evaluated as it stands, not by its series about an anchor."""
    direct: np.ndarray = blocks.anchor < 0
    if not direct.all():
        reach = np.maximum(np.abs(blocks.t0), np.abs(blocks.t1))
        direct = direct | (reach > anchors.radius[blocks.anchor])
    return direct


def hidden(
    field: Field,
    blocks: Blocks,
    anchors: Anchors,
    phi: FloatArray,
    size: FloatArray,
    lam_h: FloatArray,
) -> np.ndarray:
    """Blocks with a feature too narrow for their nodes to see (see `numbers.complex_balls`).

    `phi` is the drift in their middles.
    """
    taken_about, middle = blocks.anchor >= 0, _middle(blocks, anchors)
    around = field.spread(blocks.scene, middle, blocks.t1 - blocks.t0)
    if around is None:
        return np.zeros(len(size), dtype=bool)  # a polynomial has none
    # Beyond a step or a needle the Taylor expansion about an anchor would be another function.
    straying = np.abs(around.centre - phi)
    close = straying <= 1e-6 * size + 1e-10 * field.size()[blocks.scene]
    # What 17 nodes miss of a function on that disk is 4e-10 of its bound, at most.
    negligible = lam_h * around.radius < 1e-5
    seen: np.ndarray = (tame(around.radius, size) | negligible) & (close | ~taken_about)
    return ~seen


def _middle(blocks: Blocks, anchors: Anchors) -> FloatArray:
    """The middles of the blocks, in u."""
    middle: FloatArray = (blocks.t0 + blocks.t1) / 2
    taken_about = blocks.anchor >= 0
    if taken_about.any():
        middle = middle + np.where(taken_about, anchors.centre[blocks.anchor], 0.0)
    return middle


# -- derivatives of exponents ---------------------------------------------------------------------

#: More than the rounding of a slope, relative to the largest on its way.
_SLOPE_ROUNDING = 4e-15
#: How much more of a slope than of the moment the nodes of a panel miss, in units of its reach.
_SLOPE_TRUNCATION = 100.0


def _slope_nodes(blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """The nodes of the blocks in u; a slope has nothing to lose by their rounding."""
    u = blocks.t0[:, None] + (blocks.t1 - blocks.t0)[:, None] * nodes
    about = blocks.anchor >= 0
    if about.any():
        u = u + np.where(about, anchors.centre[blocks.anchor], 0.0)[:, None]
    return np.clip(u, -1.0, 1.0)


def _dual(field: Field, of_drift: FloatArray, scene: IntArray, y: FloatArray) -> DualArray:
    """Numbers linear in lam phi h, one row for each of `scene`, from their slopes by the drift."""
    assert field.directions
    slopes = field.directions.rows(of_drift, y)
    slopes[-1] += (field.directions.stretch[scene] * y.T).T
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
    dual = _dual(
        field, lam_h[:, None] * field.directions.of_drift(blocks.scene, u), blocks.scene, x
    )
    least = np.abs(x).min(axis=1)
    off = (_SLOPE_ROUNDING + 4 * shift / least) * np.abs(dual.slopes).max(axis=2)
    off += np.abs(dual.slopes @ _tail_of()).max(axis=2)
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
    flat = of_drift.reshape(-1, len(lam_h), count, nodes).swapaxes(1, 2).reshape(-1, nodes)
    scene, shape = np.tile(blocks.scene, count), (len(of_drift), rise.size)
    both = [
        _dual(field, integral.reshape(*shape, *y.shape[1:]), scene, y)
        for integral, y in zip(
            float_panels.exponents_of_values(flat),
            (exponents.reshape(-1, nodes), rise.ravel()),
            strict=True,
        )
    ]
    nothing = np.zeros(rise.size)
    # What the last coefficients leave to those beyond is less than four times as much.
    reach, missed = (
        field.directions.rows(x.reshape(shape), nothing)
        for x in (np.abs(flat).max(axis=1, initial=0.0), 4 * float_panels.sums(flat)[1])
    )
    reach = np.maximum(reach, np.abs(both[0].slopes).max(axis=2))
    reach, missed = (x.reshape(len(x), *rise.shape).sum(axis=1) for x in (reach, missed))
    return both[0].reshape(exponents.shape), both[1].reshape(rise.shape), reach, missed


# -- records of blocks ----------------------------------------------------------------------------


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
    first, moments = float_panels.merge_slow(records.scene, records.moments, records.slow)
    if not first.size:
        return records
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


class Plan(NamedTuple):
    """What is to be done with blocks: `panels` are sampled, none where they are slow.

    `steep` is lam h times the largest |phi|; `turns` is True where phi may have a zero. The errors
    `shift` and `local` are those of `Records`.
    """

    panels: IntArray
    rise: FloatArray
    steep: FloatArray
    turns: np.ndarray
    shift: FloatArray
    local: FloatArray

    def take(self, index: slice | np.ndarray) -> Plan:
        """The plan of some of the blocks."""
        fields: list[Any] = [field[index] for field in self]
        return Plan(*fields)


def records_of(
    field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors, ahead: FloatArray
) -> Records:
    """Moments of all blocks, bisecting those that are neither slow nor few panels.

    `ahead` is the logarithm of the integral of e^{lam V} before the first block of each scene,
    with V = 0 there.
    """
    nothing = np.empty(0)
    done = [Records.exactly(np.empty(0, dtype=np.intp), 0, Moments(*(nothing,) * 4))]
    depth, most = 0, _counts(field)[-1] * REACH
    while blocks.scene.size:
        first, planned = depth == 0, []
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
                ready, plan = _planned(field, lam, chunk, anchors)
                planned.append((chunk.take(ready), plan.take(ready)))
                parts.append(_pieces(chunk.take(~ready), np.abs(plan.rise[~ready]) / most))
            blocks, depth = _joined(parts), depth + 1
        if not planned:
            break
        ready, plan = _joined([b for b, _ in planned]), _joined([p for _, p in planned])
        steep = np.bincount(ready.scene, plan.steep).max(initial=0.0)
        if first and steep > 4 * _FAINT and not field.directions:
            order = np.lexsort((ready.t0, ready.part, ready.scene))
            ready, plan = ready.take(order), plan.take(order)
            ends = np.searchsorted(ready.scene, np.r_[: len(lam) : _SCENES_AT_ONCE, len(lam)])
            some = [slice(*pair) for pair in pairwise(np.unique(ends).tolist())]
            counts = np.concatenate([_counting(ready.take(x), plan.take(x), ahead) for x in some])
            done.append(_coarse(ready, plan, ~counts))
            ready, plan = ready.take(counts), plan.take(counts)
        moments, plan, missed = _moments(field, lam, ready, plan, anchors)
        resolved = missed <= RESOLUTION
        blocks = _pieces(ready.take(~resolved), np.zeros(np.count_nonzero(~resolved)))
        if blocks.scene.size:
            ready, plan, missed = ready.take(resolved), plan.take(resolved), missed[resolved]
            moments = Moments(*(m[resolved] for m in moments))
        done.append(
            Records(
                ready.scene,
                ready.part,
                ready.t0,
                moments,
                plan.panels == 0,
                plan.shift,
                plan.local + missed,
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


def _series(field: Field, lam_h: FloatArray, blocks: Blocks, anchors: Anchors) -> FloatArray | None:
    """Taylor coefficients of lam phi h about the middles, in half widths; None without a series."""
    known = field.series(blocks.scene)
    taken_about = blocks.anchor >= 0
    if taken_about.any():
        reach = np.maximum(np.abs(blocks.t0), np.abs(blocks.t1))
        within = taken_about & (reach <= anchors.radius[blocks.anchor])
        about = anchors.coefficients[blocks.anchor].T
        if known is not None:
            known = np.where(taken_about, about, known)
        elif within.all():
            known = about
    if known is None:
        return None
    c = np.array(shifted(list(known), (blocks.t0 + blocks.t1) / 2))
    half, scale = (blocks.t1 - blocks.t0) / 2, lam_h
    for k in range(len(c)):
        c[k] *= scale
        scale = scale * half
    return c.T


def _planned(
    field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors
) -> tuple[np.ndarray, Plan]:
    """True for the blocks that need no bisection, and the plan of all."""
    h = blocks.t1 - blocks.t0
    lam_h = lam[blocks.scene] * h
    series = _series(field, lam_h, blocks, anchors)
    # lam phi h; NumPy reduces a long last axis fast and a short one slowly: nodes go first.
    if series is None:
        x = lam_h * phi_at(field, blocks, anchors, float_panels.lobatto().nodes).T
        x = np.ascontiguousarray(x)
    else:
        x = float_panels.lobatto_powers(series.shape[1]) @ series.T
    low, high = x.min(axis=0), x.max(axis=0)
    steep = np.maximum(np.abs(low), np.abs(high))
    # Slopes are sampled with more to spare: the errors of both are held against one number.
    reach = np.where(low > 0, REACH if field.directions else REACH_DOWN, REACH)
    counts = _counts(field)
    place = np.searchsorted(counts, steep / reach)
    count = counts[np.minimum(place, len(counts) - 1)]
    few = place < len(counts)
    slowly = is_slow(low, high, x.T)
    if series is None:
        # The n-th Chebyshev coefficient shrinks by count^n when the block is cut into panels.
        few &= _tail(x.T) / count**8 <= 4e-14 * count
    size = steep / lam_h
    field.reaches(blocks.scene, size)
    phi = x[float_panels.NODES // 2] / lam_h
    ready = (slowly | few) & ~hidden(field, blocks, anchors, phi, size, lam_h)
    shift = _rounding(field, blocks, anchors, ready) * lam_h
    # Layers see the drift at the ends only.
    local = np.where(slowly, shift / np.maximum(low, -high), shift)
    rise = -(float_panels.lobatto().weights @ x)
    return ready, Plan(
        np.where(slowly, 0, count), rise, steep, (low <= 0) & (high >= 0), shift, local
    )


def _counting(blocks: Blocks, plan: Plan, ahead: FloatArray) -> np.ndarray:
    """Sorted blocks that count in what a sweep over them makes, by bounds on their moments.

    With a_j the integral of e = e^{lam V} over block j, b_j that of 1/e and n_j the nested one, a
    sweep needs the sums of a_j up to each block, of b_j, and of a_i b_j (i < j) and n_j. Blocks on
    which phi has a zero always count. What does not is recorded roughly, with an error that says
    so: no error rests on these bounds.
    """
    owner = np.flatnonzero(np.diff(blocks.scene, prepend=-1))
    row = np.cumsum(np.diff(blocks.scene, prepend=-1) != 0) - 1
    at = row, np.arange(len(row)) - owner[row]
    shape = len(owner), int(at[1].max()) + 1

    def placed(values: FloatArray, otherwise: float) -> FloatArray:
        """The values of blocks, one row a scene."""
        result = np.full(shape, otherwise)
        result[at] = values
        return result

    rise = placed(plan.rise, 0.0)
    height = np.add.accumulate(rise, axis=1)
    top, bottom = np.maximum(height - rise, height), np.minimum(height - rise, height)
    h = blocks.t1 - blocks.t0
    width, least = placed(np.log(h), -np.inf), placed(np.log(h / (1.0 + plan.steep)), -np.inf)
    beside = placed(np.where(plan.turns, plan.steep, 0.0), 0.0)
    before = ahead[blocks.scene[owner], None]

    def up_to(values: FloatArray) -> FloatArray:
        """Largest value of the blocks before each."""
        return np.maximum.accumulate(np.concatenate((before, values[:, :-1]), axis=1), axis=1)

    a, b, nested = top + beside + width, -bottom + beside + width, 2 * (beside + width)
    a_least, b_least = top + least, least - bottom
    fall = np.maximum(-rise, 0.0)
    double = np.maximum(up_to(a_least) + b_least, 2 * least + fall).max(axis=1, keepdims=True)
    after = np.maximum.accumulate(b[:, ::-1], axis=1)[:, ::-1]
    after = np.concatenate((after[:, 1:], np.full((len(owner), 1), -np.inf)), axis=1)
    # The time is carried in units of the sum of a_j so far, which must be known at each block.
    counts = a >= np.maximum(up_to(a_least), a_least) - _FAINT
    counts |= b >= b_least.max(axis=1, keepdims=True) - _FAINT
    share = np.maximum(np.maximum(up_to(a) + b, a + after), nested + fall)
    counts |= share >= double - _FAINT
    result: np.ndarray = counts[at] | plan.turns
    return result


def _coarse(blocks: Blocks, plan: Plan, left_out: np.ndarray) -> Records:
    """One record for neighbours that do not count, of bounds, whose errors are as wide.

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
    moments = Moments(np.add.reduceat(plan.rise, first), h, h, h * h)
    shift = np.add.reduceat(plan.shift, first)
    local = 2.0 + 2.0 * np.log1p(h * steepest) + shift
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
    order = np.argsort(plan.panels, kind="stable")
    counts = np.append(0, _counts(field))
    ends = np.searchsorted(plan.panels[order], counts, side="right")
    work = np.empty((3, _PANELS_AT_ONCE * float_panels.NODES))
    low = 0
    for count, end in zip(counts.tolist(), ends.tolist(), strict=True):
        for begin in range(low, end, _PANELS_AT_ONCE // max(count, 1)):
            index = order[begin : min(end, begin + _PANELS_AT_ONCE // max(count, 1))]
            part = blocks.take(index)
            h: Any = part.t1 - part.t0
            lam_h = lam[part.scene] * h
            series = _series(field, lam_h, part, anchors)
            if field.directions:
                h = field.directions.stretched(h, part.scene)
            if count == 0:
                x: Any = _at_nodes(field, part, anchors, series, lam_h)
                if field.directions:
                    x, *off = _slow_slopes(field, lam_h, part, anchors, x, plan.shift[index])
                some = float_panels.slow(x, h)
            else:
                sampled: Any = _exponents(field, lam_h, part, anchors, series, count, work[0])
                if field.directions:
                    *sampled, reach, gap = _sampled_slopes(field, lam_h, part, anchors, *sampled)
                memory = None if field.directions else work[1:]
                some, missed[index] = float_panels.sampled(sampled[0], sampled[1], h, memory)
                if field.directions:
                    rounded = plan.shift[index] / np.maximum(plan.steep[index], 1e-300)
                    gap += (_SLOPE_ROUNDING + 4 * rounded) * reach
                    off = [gap, gap + _SLOPE_TRUNCATION * missed[index] * reach]
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
    shape = count, len(lam_h), float_panels.NODES
    if series is not None:
        place = work[: math.prod(shape)].reshape(shape)
        return float_panels.exponents_of_series(series, count, place)
    phi = phi_at(field, blocks, anchors, _gauss_nodes(count)) * (lam_h / count)[:, None]
    values = np.ascontiguousarray(phi.reshape(len(lam_h), *shape[::2]).swapaxes(0, 1))
    return float_panels.exponents_of_values(values)


def _counts(field: Field) -> IntArray:
    """The numbers of panels that a sampled block may have."""
    return _COUNTS_OF_SLOPES if field.directions else _COUNTS


def _gauss_nodes(count: int) -> FloatArray:
    """The Gauss nodes of `count` equal panels of [0, 1], one after the other."""
    nodes: FloatArray = (np.arange(count)[:, None] + float_panels.gauss().nodes).ravel() / count
    return nodes


def _at_nodes(
    field: Field, blocks: Blocks, anchors: Anchors, series: FloatArray | None, lam_h: FloatArray
) -> FloatArray:
    """lam phi h at the Lobatto nodes of each block."""
    if series is None:
        return lam_h[:, None] * phi_at(field, blocks, anchors, float_panels.lobatto().nodes)
    x: FloatArray = series @ float_panels.lobatto_powers(series.shape[1]).T
    return x


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
        middle = _middle(blocks, anchors)
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


def _rounding(field: Field, blocks: Blocks, anchors: Anchors, ready: np.ndarray) -> FloatArray:
    """Error of the drift on the blocks that are `ready`, where it is not taken by its series."""
    result = np.zeros(len(ready))
    if not ready.any() or field.series(blocks.scene[:1]) is not None:
        return result
    chosen = np.flatnonzero(ready & is_direct(blocks, anchors))
    block = blocks.take(chosen)
    t = block.t0[:, None] + (block.t1 - block.t0)[:, None] * float_panels.lobatto().nodes[::4]
    about = block.anchor >= 0
    if about.any():
        t = t + np.where(about, anchors.centre[block.anchor], 0.0)[:, None]
    result[chosen] = field.rounding(block.scene, t).max(axis=1, initial=0.0)
    return result


def is_slow(low: FloatArray, high: FloatArray, x: FloatArray) -> np.ndarray:
    """Blocks on which the slow series holds to rounding; low <= x = lam phi h <= high at nodes."""
    smallest = np.maximum(low, -high)
    # The mean of phi'/(lam phi^2) is at most its largest value.
    spread = 1.0 - smallest / np.maximum(high, -low)
    candidate = (smallest > 40.0) & (spread * SLOWNESS < smallest)
    if not candidate.any():
        return candidate
    chosen, smallest = x[candidate], smallest[candidate]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # lam phi^2/|phi'|, kept from overflowing
        slope = chosen @ float_panels.lobatto().differentiate.T
        steepness = np.abs(np.ascontiguousarray((slope / chosen / chosen).T)).max(axis=0)
        tail = _tail(smallest[:, None] / chosen)
        # A term of the slow series is a derivative of the one before, and differentiating at
        # an end multiplies what the nodes miss of 1/phi by up to 2 NODES^2 a width.
        growth = 2 * float_panels.NODES**2 / smallest
        # `rise` integrates phi itself, which may have poles where 1/phi is smooth. It is as
        # large as lam, so what the nodes miss is held against an ulp of the largest value, to
        # which phi is known; not against the sum of all, which lets 17 times more pass.
        resolved = _tail(chosen) <= 1e-14 * np.abs(chosen).max(axis=1)
        resolved &= (tail < 1e-10) & (tail * growth * (1 + growth) < 6e-14)
        candidate[candidate] = (steepness * SLOWNESS < 1) & resolved
    return candidate


@cache
def _tail_of() -> FloatArray:
    """Matrix from values at the Lobatto nodes to the last two Chebyshev coefficients."""
    n = float_panels.NODES
    j = np.arange(n + 1)
    weights = np.ones(n + 1)
    weights[0] = weights[-1] = 0.5
    rows = [2 / n * weights * np.cos(np.pi * k * (n - j) / n) for k in (n - 1, n)]
    return np.array(rows).T.copy()


def _tail(values: FloatArray) -> FloatArray:
    """Size of the last two Chebyshev coefficients of each row."""
    last = np.abs(values @ _tail_of())
    return np.maximum(last[:, 0], last[:, 1])
