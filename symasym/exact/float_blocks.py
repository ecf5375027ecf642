"""Blocks of [-1, 1] in float64 and their records (`symasym.exact.float_panels`).

The drift on a block is taken as it stands or by its Taylor polynomial about a nearby zero of A. A
block is sampled, replaced by the layers at its ends, or bisected until one of both holds.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.base.patience import step
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_panels import REACH, SLOWNESS, Moments
from symasym.numbers.complex_balls import tame
from symasym.numbers.dual_arrays import DualArray
from symasym.numbers.polynomials import poly, shifted

#: lam |A| up to which positions are measured from u = 0.
MILD = 5e3
_SAMPLES_PER_BLOCK = 32  # panels merged before the log domain is entered: e^(32 REACH) < 1e112
_PANELS_AT_ONCE = 1024  # stays in cache, and below the size at which BLAS starts threads
_DEEPEST = 90  # bisections
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
    grid = np.linspace(0.0, 1.0, 17)
    points = lo[inside, None] + (hi - lo)[inside, None] * grid
    variation = lam[inside] * np.abs(field.phi(inside, points)).mean(axis=1) * (hi - lo)[inside]
    # Rounding of phi enters the exponent as lam * size * 1e-16.
    mild = (variation < 150 * REACH) & (lam[inside] * field.size()[inside] < MILD)
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
    """Blocks with a feature too narrow for their nodes to see (see `numbers.complex_balls`)."""
    taken_about, middle = blocks.anchor >= 0, _middle(blocks, anchors)
    around = field.spread(blocks.scene, middle, blocks.t1 - blocks.t0)
    if around is None:
        return np.zeros(len(size), dtype=bool)  # a polynomial has none
    # Beyond a step or a needle the Taylor expansion about an anchor would be another function.
    straying = np.abs(around.centre - phi[:, float_panels.NODES // 2])
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


def _slope_nodes(blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """The nodes of the blocks in u; a slope has nothing to lose by their rounding."""
    u = blocks.t0[:, None] + (blocks.t1 - blocks.t0)[:, None] * nodes
    about = blocks.anchor >= 0
    if about.any():
        u = u + np.where(about, anchors.centre[blocks.anchor], 0.0)[:, None]
    return np.clip(u, -1.0, 1.0)


def _slow_slopes(
    field: Field,
    lam: FloatArray,
    blocks: Blocks,
    anchors: Anchors,
    lam_phi: FloatArray,
    shift: FloatArray,
    local: FloatArray,
) -> tuple[DualArray, DualArray, DualArray]:
    """lam phi at the Lobatto nodes of slow blocks and the errors of their records, with slopes."""
    assert field.directions
    u = _slope_nodes(blocks, anchors, float_panels.lobatto().nodes)
    of_drift = lam[blocks.scene][:, None] * field.directions.of_drift(blocks.scene, u)
    slopes = field.directions.rows(of_drift, blocks.scene, lam_phi)
    h = blocks.t1 - blocks.t0
    least = np.abs(lam_phi).min(axis=1)
    most = np.abs(slopes).max(axis=2)
    missed = np.abs(slopes @ _tail_of()).max(axis=2)
    rounded = (_SLOPE_ROUNDING + 4 * shift / (least * h)) * most
    # Differentiating for the series multiplies what is wrong at an end by 2 NODES^2 a width.
    growth = 1.0 + 2 * float_panels.NODES**2 / (least * h)
    return (
        DualArray(lam_phi, slopes),
        DualArray(shift, h * (rounded + missed)),
        DualArray(local, (rounded + missed) * growth / least),
    )


def _sampled_slopes(
    field: Field, lam: FloatArray, pieces: Blocks, anchors: Anchors, exponents: FloatArray
) -> tuple[DualArray, FloatArray, FloatArray]:
    """Exponents with their slopes; how large these are on the way, and what the nodes miss."""
    assert field.directions
    u = _slope_nodes(pieces, anchors, float_panels.gauss().nodes)
    rate = (lam[pieces.scene] * (pieces.t1 - pieces.t0))[:, None]
    of_drift = rate * field.directions.of_drift(pieces.scene, u)
    flat, rows = of_drift.reshape(-1, float_panels.NODES), field.directions.rows
    integrals = float_panels.exponents_of_values(flat).reshape(len(of_drift), *exponents.shape)
    slopes = rows(integrals, pieces.scene, exponents)
    slopes[-1] += field.directions.stretch[pieces.scene][:, None] * exponents
    nothing = np.zeros(len(exponents))
    reach, missed = (
        rows(x.reshape(of_drift.shape[:2]), pieces.scene, nothing)
        for x in (np.abs(flat).max(axis=1, initial=0.0), float_panels.tail(flat))
    )
    reach = np.maximum(reach, np.abs(slopes).max(axis=2))
    return DualArray(exponents, slopes), reach, missed


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


def records_of(field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors) -> Records:
    """Moments of all blocks, bisecting those that are neither slow nor few panels."""
    nothing = np.empty(0)
    done = [Records.exactly(np.empty(0, dtype=np.intp), 0, Moments(*(nothing,) * 4))]
    for depth in range(_DEEPEST + 1):
        kept = [blocks.take(np.arange(0))]
        step()
        for low in range(0, len(blocks.scene), _PANELS_AT_ONCE):
            chunk = blocks.take(slice(low, low + _PANELS_AT_ONCE))
            kept.append(_digest(field, lam, chunk, anchors, done))
        blocks = Blocks(*(np.concatenate(f) for f in zip(*kept, strict=True)))
        if not blocks.scene.size:
            break
        waiting = np.bincount(blocks.scene, minlength=len(lam))
        hopeless = waiting > (_MOST_BLOCKS if depth < _DEEPEST else 0)
        if hopeless.any():
            done.append(_unresolved(field, lam, blocks.take(hopeless[blocks.scene]), anchors))
            blocks = blocks.take(~hopeless[blocks.scene])
        middle = (blocks.t0 + blocks.t1) / 2
        blocks = Blocks(
            np.tile(blocks.scene, 2),
            np.tile(blocks.part, 2),
            np.tile(blocks.anchor, 2),
            np.concatenate((blocks.t0, middle)),
            np.concatenate((middle, blocks.t1)),
        )
    return Records.joined(done)


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


def _digest(
    field: Field,
    lam: FloatArray,
    blocks: Blocks,
    anchors: Anchors,
    done: list[Records],
) -> Blocks:
    """Append the records of the blocks that are ready to `done`; return the others."""
    rule = float_panels.lobatto()
    h = blocks.t1 - blocks.t0
    phi = phi_at(field, blocks, anchors, rule.nodes)
    lam_phi = lam[blocks.scene][:, None] * phi
    # NumPy reduces a long last axis fast and a short one slowly: nodes go first.
    by_node = np.ascontiguousarray(phi.T)
    low, high = by_node.min(axis=0), by_node.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    lam_h = lam[blocks.scene] * h
    slowly = is_slow(low, high, lam_phi, lam_h, h)
    count = np.maximum(np.ceil(lam_h * size / REACH), 1.0)
    # The n-th Chebyshev coefficient shrinks by count^n when the block is cut into panels.
    truncation = _tail(phi) / count**8
    field.reaches(blocks.scene, size)
    unresolved = hidden(field, blocks, anchors, phi, size, lam_h)
    slowly &= ~unresolved
    smooth = lam_h * truncation <= 4e-14 * count
    few = ~slowly & ~unresolved & (count <= _SAMPLES_PER_BLOCK) & smooth
    rounding = _rounding(field, blocks, anchors, slowly | few) * lam_h
    if slowly.any():
        chosen = blocks.take(slowly)
        shift: Any = rounding[slowly]
        # Layers see the drift at the ends only.
        local = shift / (lam_h * np.maximum(low, -high))[slowly]
        chosen_phi, width = lam_phi[slowly], h[slowly]
        if field.directions:
            chosen_phi, shift, local = _slow_slopes(
                field, lam, chosen, anchors, chosen_phi, shift, local
            )
            width = field.directions.stretched(width, chosen.scene)
        layers = float_panels.slow(chosen_phi, width)
        done.append(Records(*chosen[:2], chosen.t0, layers, slowly[slowly], shift, local))
    if few.any():
        chosen = blocks.take(few)
        moments, good, reach = _sampled_blocks(
            field, lam, chosen, anchors, count[few].astype(np.intp)
        )
        few[few] = good
        chosen, moments = chosen.take(good), Moments(*(m[good] for m in moments))
        shift = rounding[few]
        if reach is not None:
            relative = _SLOPE_ROUNDING + 4 * shift / np.maximum(lam_h * size, 1e-300)[few]
            shift = DualArray(shift, relative * reach[0][:, good] + reach[1][:, good])
        done.append(
            Records(*chosen[:2], chosen.t0, moments, np.zeros_like(slowly[few]), shift, shift)
        )
    return blocks.take(~(slowly | few))


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


def is_slow(
    low: FloatArray, high: FloatArray, lam_phi: FloatArray, lam_h: FloatArray, h: FloatArray
) -> np.ndarray:
    """Blocks on which the slow series holds to rounding; low <= phi <= high."""
    smallest = np.maximum(low, -high)
    candidate = lam_h * smallest > 40.0
    if not candidate.any():
        return candidate
    chosen = lam_phi[candidate]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        slope = chosen @ float_panels.lobatto().differentiate.T
        # lam phi^2/|phi'| in terms of lam phi, kept from overflowing
        ratio = np.ascontiguousarray((slope / chosen / chosen).T)
        steepness = np.abs(ratio).max(axis=0) / h[candidate]
        scale = (smallest * lam_h / h)[candidate, None]
        tail = _tail(scale / chosen)
        # A term of the slow series is a derivative of the one before, and differentiating at
        # an end multiplies what the nodes miss of 1/phi by up to 2 NODES^2 a width.
        growth = 2 * float_panels.NODES**2 / (smallest * lam_h)[candidate]
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


def _sampled_blocks(
    field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors, count: IntArray
) -> tuple[Moments, np.ndarray, FloatArray | None]:
    """Blocks cut into `count` panels each, whose records are merged pairwise; which are resolved;
    and where slopes are asked for, the reach of theirs and what the nodes miss."""
    owner = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    width = (blocks.t1 - blocks.t0) / count
    t0 = blocks.t0[owner] + k * width[owner]
    pieces = Blocks(
        blocks.scene[owner], blocks.part[owner], blocks.anchor[owner], t0, t0 + width[owner]
    )
    chunks, reaches = [], []
    for low in range(0, len(owner), _PANELS_AT_ONCE):
        chunk = pieces.take(slice(low, low + _PANELS_AT_ONCE))
        h: Any = width[owner[low : low + _PANELS_AT_ONCE]]
        exponents: Any = _exponents(field, lam, chunk, h, anchors)
        if field.directions:
            exponents, *reach = _sampled_slopes(field, lam, chunk, anchors, exponents)
            reaches.append(np.array(reach))
            h = field.directions.stretched(h, chunk.scene)
        chunks.append(float_panels.sampled(exponents, h))
    moments = Moments(*(np.concatenate(m) for m in zip(*(f[0] for f in chunks), strict=True)))
    first = np.flatnonzero(k == 0)
    resolved = np.logical_and.reduceat(np.concatenate([f[1] for f in chunks]), first)
    summed = np.add.reduceat(np.concatenate(reaches, axis=2), first, axis=2) if reaches else None
    return float_panels.merge(moments, k, count[owner]), resolved, summed


def _exponents(
    field: Field, lam: FloatArray, pieces: Blocks, h: FloatArray, anchors: Anchors
) -> FloatArray:
    """lam int phi from the left end of each piece to its nodes and its right end."""
    scale = lam[pieces.scene] * h
    direct = pieces.anchor < 0
    series = field.series(pieces.scene) if direct.all() else None
    if series is None and not direct.any():
        reach = np.maximum(np.abs(pieces.t0), np.abs(pieces.t1))
        if (reach <= anchors.radius[pieces.anchor]).all():
            series = anchors.coefficients[pieces.anchor].T
    if series is None:
        phi = phi_at(field, pieces, anchors, float_panels.gauss().nodes)
        return float_panels.exponents_of_values(scale[:, None] * phi)
    c = shifted(list(series), pieces.t0)
    for k in range(len(c)):
        c[k] = c[k] * scale
        scale = scale * h
    return float_panels.exponents_of_series(np.array(c).T)
