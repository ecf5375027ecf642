"""Blocks of [-1, 1] in float64 and their records (`symasym.exact.float_panels`).

The drift on a block is taken as it stands or by its Taylor polynomial about a nearby zero of A. A
block is sampled, replaced by the layers at its ends, or bisected until one of both holds.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_panels import REACH, REACH_DOWN, SLOWNESS
from symasym.numbers.complex_balls import resolved
from symasym.numbers.polynomials import poly

#: lam |A| up to which positions are measured from u = 0.
MODERATE = 5e3
#: Panels of a sampled block, joined before the log domain is entered: e^(8 REACH_DOWN) < 1e39.
_COUNTS = np.array([1, 2, 3, 4, 5, 6, 8])
#: The same where slopes are carried and a sweep takes longer than samples: e^(32 REACH) < 1e112.
_COUNTS_OF_SLOPES = np.array([1, 2, 3, 4, 6, 8, 12, 16, 24, 32])
FAINT = 45.0  # what is e^-45 of a sum changes none of its digits
#: The middle of a block, as a node.
MIDDLE = np.array([0.5])
_THIN = 1e24  # lam |A| from which on a zero's layer, lam^-1/2 wide, is thinner than 1e-12


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
    moderate = lam[inside] * field.size()[inside] < MODERATE
    easy, hard = inside[moderate], inside[~moderate]
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


def positions(blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """The nodes (fractions of the width) of each block, in u."""
    u: FloatArray = blocks.t0[:, None] + (blocks.t1 - blocks.t0)[:, None] * nodes
    about = blocks.anchor >= 0
    if about.any():
        u = u + np.where(about, anchors.centre[blocks.anchor], 0.0)[:, None]
    return u


def phi_at(field: Field, blocks: Blocks, anchors: Anchors, nodes: FloatArray) -> FloatArray:
    """Drift at the nodes (fractions of the width) of each block."""
    direct = is_direct(blocks, anchors)
    if direct.all():
        return field.phi(blocks.scene, positions(blocks, anchors, nodes))
    result = np.empty((len(direct), len(nodes)))
    if direct.any():
        some = blocks.take(direct)
        result[direct] = field.phi(some.scene, positions(some, anchors, nodes))
    within = blocks.take(~direct)
    c = anchors.coefficients[within.anchor]
    t = within.t0[:, None] + (within.t1 - within.t0)[:, None] * nodes
    result[~direct] = poly(list(c.T[:, :, None]), t)
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
    middle = positions(blocks, anchors, MIDDLE)[:, 0]
    around = field.spread(blocks.scene, middle, blocks.t1 - blocks.t0)
    if around is None:
        return np.zeros(len(size), dtype=bool)  # a polynomial has none
    # Beyond a step or a needle the Taylor expansion about an anchor would be another function.
    straying = np.abs(around.centre - phi)
    close = straying <= 1e-6 * size + 1e-10 * field.size()[blocks.scene]
    # What 17 nodes miss of a function on that disk is 4e-10 of its bound, at most.
    negligible = lam_h * around.radius < 1e-5
    seen: np.ndarray = (resolved(around.radius, size) | negligible) & (close | (blocks.anchor < 0))
    return ~seen


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


def series_of(
    field: Field, lam_h: FloatArray, blocks: Blocks, anchors: Anchors
) -> FloatArray | None:
    """Taylor coefficients of lam phi h about the middles, in half widths, a column for each block;
    None without a series."""
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
    return centred(known, (blocks.t0 + blocks.t1) / 2, (blocks.t1 - blocks.t0) / 2, lam_h)


def centred(
    coefficients: FloatArray,
    middle: FloatArray | float,
    half: FloatArray | float,
    scale: FloatArray,
) -> FloatArray:
    """The polynomials of these ascending coefficients, a column each, times `scale`, about the
    middles of intervals in half widths; put in their place."""
    c = coefficients
    # `symasym.numbers.polynomials.shifted`, without new arrays.
    for lowest in range(len(c) - 1):
        for k in range(len(c) - 2, lowest - 1, -1):
            c[k] += c[k + 1] * middle
    c[0] *= scale
    for row in c[1:]:
        scale = scale * half
        row *= scale
    return c


def at_nodes(
    field: Field, blocks: Blocks, anchors: Anchors, series: FloatArray | None, lam_h: FloatArray
) -> FloatArray:
    """lam phi h at the Lobatto nodes, a column for each block."""
    if series is None:
        phi = phi_at(field, blocks, anchors, float_panels.lobatto().nodes)
        return np.ascontiguousarray(phi.T) * lam_h
    return float_panels.by_columns(float_panels.lobatto_powers(len(series)), series)


def planned(
    field: Field, lam: FloatArray, blocks: Blocks, anchors: Anchors
) -> tuple[np.ndarray, Plan]:
    """True for the blocks that need no bisection, and the plan of all."""
    h = blocks.t1 - blocks.t0
    lam_h = lam[blocks.scene] * h
    series = series_of(field, lam_h, blocks, anchors)
    # NumPy reduces a long last axis fast and a short one slowly: nodes go first.
    x = at_nodes(field, blocks, anchors, series, lam_h)
    low, high = x.min(axis=0), x.max(axis=0)
    steep = np.maximum(np.abs(low), np.abs(high))
    # Slopes are sampled with more to spare: the errors of both are held against one number.
    reach = np.where(low > 0, REACH if field.directions else REACH_DOWN, REACH)
    counts = panel_counts(field)
    place = np.searchsorted(counts, steep / reach)
    count = counts[np.minimum(place, len(counts) - 1)]
    few = place < len(counts)
    slowly = is_slow(low, high, x)
    if series is None:
        # The n-th Chebyshev coefficient shrinks by count^n when the block is cut into panels.
        few &= _tail(x) / count**8 <= 4e-14 * count
    elif len(series) > float_panels.PLAIN:
        few &= _unbent(series, count)
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


def counting(blocks: Blocks, plan: Plan, ahead: FloatArray) -> np.ndarray:
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
    counts = a >= np.maximum(up_to(a_least), a_least) - FAINT
    counts |= b >= b_least.max(axis=1, keepdims=True) - FAINT
    share = np.maximum(np.maximum(up_to(a) + b, a + after), nested + fall)
    counts |= share >= double - FAINT
    result: np.ndarray = counts[at] | plan.turns
    return result


def panel_counts(field: Field) -> IntArray:
    """The numbers of panels that a sampled block may have."""
    return _COUNTS_OF_SLOPES if field.directions else _COUNTS


def _rounding(field: Field, blocks: Blocks, anchors: Anchors, ready: np.ndarray) -> FloatArray:
    """Error of the drift on the blocks that are `ready`, where it is not taken by its series."""
    result = np.zeros(len(ready))
    if not ready.any() or field.series(blocks.scene[:1]) is not None:
        return result
    chosen = np.flatnonzero(ready & is_direct(blocks, anchors))
    block = blocks.take(chosen)
    t = positions(block, anchors, float_panels.lobatto().nodes[::4])
    result[chosen] = field.rounding(block.scene, t).max(axis=1, initial=0.0)
    return result


def _unbent(series: FloatArray, count: IntArray) -> np.ndarray:
    """Blocks whose panels have no Taylor coefficient of q above `float_panels.bends`."""
    terms = len(series)
    most = float_panels.binomials(terms) @ np.abs(series)
    allowed = float_panels.bends(terms)[:, None] * count ** np.arange(3.0, terms + 1)[:, None]
    unbent: np.ndarray = np.all(most <= allowed, axis=0)
    return unbent


def is_slow(low: FloatArray, high: FloatArray, x: FloatArray) -> np.ndarray:
    """Blocks on which the slow series holds to rounding; low <= x = lam phi h <= high at nodes, a
    column each."""
    smallest = np.maximum(low, -high)
    # The mean of phi'/(lam phi^2) is at most its largest value.
    spread = 1.0 - smallest / np.maximum(high, -low)
    candidate = (smallest > 40.0) & (spread * SLOWNESS < smallest)
    if not candidate.any():
        return candidate
    chosen, smallest = x[:, candidate], smallest[candidate]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        # lam phi^2/|phi'|, kept from overflowing
        slope = float_panels.by_columns(float_panels.lobatto().differentiate, chosen)
        steepness = np.abs(slope / chosen / chosen).max(axis=0)
        tail = _tail(smallest / chosen)
        # A term of the slow series is a derivative of the one before, and differentiating at
        # an end multiplies what the nodes miss of 1/phi by up to 2 NODES^2 a width.
        growth = 2 * float_panels.NODES**2 / smallest
        # `rise` integrates phi itself, which may have poles where 1/phi is smooth. It is as
        # large as lam, so what the nodes miss is held against an ulp of the largest value, to
        # which phi is known; not against the sum of all, which lets 17 times more pass.
        resolved = _tail(chosen) <= 1e-14 * np.abs(chosen).max(axis=0)
        resolved &= (tail < 1e-10) & (tail * growth * (1 + growth) < 6e-14)
        candidate[candidate] = (steepness * SLOWNESS < 1) & resolved
    return candidate


@cache
def tail_of() -> FloatArray:
    """Matrix from values at the Lobatto nodes to the last two Chebyshev coefficients."""
    n = float_panels.NODES
    j = np.arange(n + 1)
    weights = np.ones(n + 1)
    weights[0] = weights[-1] = 0.5
    rows = [2 / n * weights * np.cos(np.pi * k * (n - j) / n) for k in (n - 1, n)]
    return np.array(rows).T.copy()


def _tail(values: FloatArray) -> FloatArray:
    """Size of the last two Chebyshev coefficients of each column."""
    last = np.abs(float_panels.by_columns(tail_of().T, values))
    larger: FloatArray = np.maximum(last[0], last[1])
    return larger
