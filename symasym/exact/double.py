"""float64 values of the exact integrals, for many scenes at once.

With s = exp(lam V) and S(x) = int_{-r}^x s, a sweep from the left carries
sigma = S/s, whose inverse is the rate of the scale function, and w, the time
per unit of that rate. From the left (L) and, mirrored, from the right (R),

    T = (w_L + w_R)/(1/sigma_L + 1/sigma_R),    C = 1/(1 + sigma_L/sigma_R),

which is eq:Ttilde with eq:C, every term positive (derived as positive-form).
Panels are sampled where lam V varies by a few units and replaced by their
layers where it varies by hundreds, so the cost does not grow with lam.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from symasym.discs import tame
from symasym.exact import panels
from symasym.exact.fields import Field, IntArray
from symasym.exact.panels import REACH, SLOWNESS, Moments
from symasym.generated import numpy_formulas as formulas
from symasym.inputs import FloatArray

_SAMPLES_PER_BLOCK = 32  # panels merged before the log domain is entered: e^(32 REACH) < 1e112
_PANELS_AT_ONCE = 1024  # stays in cache, and below the size at which BLAS starts threads
_DEEPEST = 90  # bisections
_MILD = 5e3  # lam |A| up to which positions are measured from u = 0
_ULP = 3e-16  # of a logarithm, its sum included


class Sweep(NamedTuple):
    """End of sweeps from the left: log sigma and log w, with their absolute errors.

    Scenes that were given up have an infinite error.
    """

    log_sigma: FloatArray
    log_w: FloatArray
    sigma_error: FloatArray
    w_error: FloatArray


class _Blocks(NamedTuple):
    """Intervals [t0, t1] about `anchor` (index of a Taylor expansion; -1: t is u itself)."""

    scene: IntArray
    part: IntArray
    anchor: IntArray
    t0: FloatArray
    t1: FloatArray

    def take(self, index: Any) -> _Blocks:
        fields: list[Any] = [field[index] for field in self]
        return _Blocks(*fields)


class _Anchors(NamedTuple):
    centre: FloatArray
    scene: IntArray
    coefficients: FloatArray
    radius: FloatArray


def sweep(
    field: Field,
    lam: FloatArray,
    start: FloatArray,
    end: FloatArray,
    free: bool,
    from_nothing: bool = False,
) -> Sweep:
    """Sweep every scene of `field` from `start` to `end`.

    Parameters
    ----------
    field : Field
    lam, start, end : arrays of shape (scenes,)
        `start` is -r, where the process is absorbed, or -inf with `free`.
    free : bool
        No absorption: w alone, as for a stationary density (needs a- > 0).
    from_nothing : bool
        With `free`, leave out what lies left of u = -1.
    """
    outside = _outer_left(field, lam, start, end, free)
    blocks, anchors = _partition(field, lam, np.maximum(start, -1.0), np.minimum(end, 1.0))
    noise = np.zeros(len(lam))
    records, failed = _records(field, lam, blocks, anchors, noise)
    right = np.flatnonzero(end > 1.0)
    beyond = panels.constant(
        lam[right] * field.a_plus[right], end[right] - np.maximum(1.0, start[right])
    )
    scene = np.concatenate((outside[0], records[0], right))
    part = np.concatenate(
        (np.full(len(outside[0]), -1), records[1], np.full(len(right), np.iinfo(np.intp).max))
    )
    position = np.concatenate((np.zeros(len(outside[0])), records[2], np.zeros(len(right))))
    moments = Moments(
        *(np.concatenate(m) for m in zip(outside[1], records[3], beyond, strict=True))
    )
    slow = np.concatenate(
        (np.zeros(len(outside[0]), dtype=bool), records[4], np.zeros(len(right), dtype=bool))
    )
    order = np.lexsort((position, part, scene))
    scene, moments = panels.merge_slow(
        scene[order], Moments(*(m[order] for m in moments)), slow[order]
    )
    log_sigma = np.full(len(lam), np.inf if free else -np.inf)
    log_w = np.full(len(lam), -np.inf)
    if free and not from_nothing:
        # Left of u = -1, w is 1/a- everywhere.
        log_w = formulas.log_tail_left(field.a_minus)
    found = _compose(scene, moments, lam, field, log_sigma, log_w)
    bad = failed | np.isnan(found.log_w) | np.isnan(found.log_sigma)
    return found._replace(
        sigma_error=np.where(bad, np.inf, found.sigma_error + noise),
        w_error=np.where(bad, np.inf, found.w_error + noise),
    )


def _outer_left(
    field: Field, lam: FloatArray, start: FloatArray, end: FloatArray, free: bool
) -> tuple[IntArray, Moments]:
    if free:
        return np.empty(0, dtype=np.intp), panels.constant(np.empty(0), np.empty(0))
    chosen = np.flatnonzero(start < -1.0)
    width = np.minimum(end[chosen], -1.0) - start[chosen]
    return chosen, panels.constant(lam[chosen] * field.a_minus[chosen], width)


def _partition(
    field: Field, lam: FloatArray, lo: FloatArray, hi: FloatArray
) -> tuple[_Blocks, _Anchors]:
    """First blocks of each scene's part of [-1, 1], and the expansions they are taken about."""
    inside = np.flatnonzero(hi > lo)
    grid = np.linspace(0.0, 1.0, 17)
    points = lo[inside, None] + (hi - lo)[inside, None] * grid
    variation = lam[inside] * np.abs(field.phi(inside, points)).mean(axis=1) * (hi - lo)[inside]
    # Rounding of phi enters the exponent as lam * size * 1e-16.
    mild = (variation < 150 * REACH) & (lam[inside] * field.size()[inside] < _MILD)
    easy, hard = inside[mild], inside[~mild]
    first = _even_blocks(field, easy, lo, hi)
    if not hard.size:
        empty = np.empty(0, dtype=np.intp)
        return first, _Anchors(np.empty(0), empty, np.empty((0, 1)), np.empty(0))
    graded, anchors = _graded_blocks(field, lam, hard, lo, hi)
    return _Blocks(*(np.concatenate(f) for f in zip(first, graded, strict=True))), anchors


def _even_blocks(field: Field, scene: IntArray, lo: FloatArray, hi: FloatArray) -> _Blocks:
    # A polynomial is bisected where it must be; another drift is looked at more closely.
    pieces = 8 if field.series(scene[:1]) is None else 1
    edges = np.linspace(0.0, 1.0, pieces + 1)
    t = lo[scene, None] + (hi - lo)[scene, None] * edges
    t[:, -1] = hi[scene]
    n = len(scene)
    return _Blocks(
        np.repeat(scene, pieces),
        np.zeros(n * pieces, dtype=np.intp),
        np.full(n * pieces, -1, dtype=np.intp),
        t[:, :-1].ravel(),
        t[:, 1:].ravel(),
    )


def _graded_blocks(
    field: Field, lam: FloatArray, scene: IntArray, lo: FloatArray, hi: FloatArray
) -> tuple[_Blocks, _Anchors]:
    """Blocks that shrink by halves towards the ends and the zeros of A.

    Their widths are measured from the nearest of these points, not from u = 0,
    so that a layer of width 1e-9 is resolved to full relative precision.
    """
    low, high = lo[scene, None], hi[scene, None]
    zeros = field.zeros(scene)
    zeros = np.where((zeros > low) & (zeros < high), zeros, np.nan)
    marks = np.sort(np.concatenate((low, zeros, high), axis=1), axis=1)  # nan last
    marks[:, 1:][marks[:, 1:] == marks[:, :-1]] = np.nan
    marks = np.sort(marks, axis=1)
    known = np.isfinite(marks)
    index = np.full(marks.shape, -1, dtype=np.intp)
    index[known] = np.arange(known.sum())
    owner = np.broadcast_to(scene[:, None], marks.shape)[known]
    coefficients, radius = field.taylor(owner, marks[known])
    anchors = _Anchors(marks[known], owner, coefficients, radius)

    row, column = np.nonzero(known[:, :-1] & known[:, 1:])
    left, right = index[row, column], index[row, column + 1]
    half = (anchors.centre[right] - anchors.centre[left]) / 2
    halves = [(left, half, 2 * column, False), (right, half, 2 * column + 1, True)]
    # Down to where even the steepest drift moves lam V by less than a panel.
    steepest = lam[scene[row]] * np.maximum(field.size()[scene[row]], 1e-300)
    levels = np.clip(np.ceil(np.log2(np.maximum(half * steepest / REACH, 1.0))), 1, 120) + 1
    chosen = []
    for anchor, length, part, from_right in halves:
        count = _levels_needed(anchors, anchor, lam[scene[row]], length, levels, from_right)
        which = np.repeat(np.arange(len(anchor)), count)
        k = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count)
        outer = np.ldexp(length[which], -k.astype(np.int64))
        inner = np.where(k == count[which] - 1, 0.0, outer / 2)
        t0, t1 = (-outer, -inner) if from_right else (inner, outer)
        chosen.append(_Blocks(scene[row][which], part[which], anchor[which], t0, t1))
    return _Blocks(*(np.concatenate(f) for f in zip(*chosen, strict=True))), anchors


def _levels_needed(
    anchors: _Anchors,
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


def _phi(field: Field, blocks: _Blocks, anchors: _Anchors, nodes: FloatArray) -> FloatArray:
    """Drift at the nodes (fractions of the width) of each block."""
    t = blocks.t0[:, None] + (blocks.t1 - blocks.t0)[:, None] * nodes
    direct = blocks.anchor < 0
    if direct.all():
        return field.phi(blocks.scene, t)
    result = np.empty_like(t)
    far = np.maximum(np.abs(blocks.t0), np.abs(blocks.t1)) > np.where(
        direct, np.inf, anchors.radius[blocks.anchor]
    )
    near = ~direct & ~far
    if direct.any():
        result[direct] = field.phi(blocks.scene[direct], t[direct])
    if far.any():
        u = anchors.centre[blocks.anchor[far], None] + t[far]
        result[far] = field.phi(blocks.scene[far], u)
    if near.any():
        c = anchors.coefficients[blocks.anchor[near]]
        x = t[near]
        total = np.broadcast_to(c[:, -1:], x.shape)
        for k in range(c.shape[1] - 2, -1, -1):
            total = total * x + c[:, k : k + 1]
        result[near] = total
    return result


_Records = tuple[IntArray, IntArray, FloatArray, Moments, np.ndarray]


def _records(
    field: Field, lam: FloatArray, blocks: _Blocks, anchors: _Anchors, noise: FloatArray
) -> tuple[_Records, np.ndarray]:
    """Moments of all blocks, bisecting those that are neither slow nor few panels."""
    failed = np.zeros(len(lam), dtype=bool)
    done: list[_Records] = []
    for depth in range(_DEEPEST + 1):
        kept = [blocks.take(np.arange(0))]
        for low in range(0, len(blocks.scene), _PANELS_AT_ONCE):
            chunk = blocks.take(slice(low, low + _PANELS_AT_ONCE))
            kept.append(_digest(field, lam, chunk, anchors, done, noise))
        blocks = _Blocks(*(np.concatenate(f) for f in zip(*kept, strict=True)))
        if not blocks.scene.size:
            break
        if depth == _DEEPEST:
            failed[blocks.scene] = True
            break
        middle = (blocks.t0 + blocks.t1) / 2
        blocks = _Blocks(
            np.tile(blocks.scene, 2),
            np.tile(blocks.part, 2),
            np.tile(blocks.anchor, 2),
            np.concatenate((blocks.t0, middle)),
            np.concatenate((middle, blocks.t1)),
        )
    if not done:
        empty = np.empty(0, dtype=np.intp)
        nothing = Moments(*(np.empty(0),) * 4)
        return (empty, empty, np.empty(0), nothing, np.empty(0, dtype=bool)), failed
    scene, part, position, moments, slow = zip(*done, strict=True)
    joined: _Records = (
        np.concatenate(scene),
        np.concatenate(part),
        np.concatenate(position),
        Moments(*(np.concatenate(m) for m in zip(*moments, strict=True))),
        np.concatenate(slow),
    )
    return joined, failed


def _digest(
    field: Field,
    lam: FloatArray,
    blocks: _Blocks,
    anchors: _Anchors,
    done: list[_Records],
    noise: FloatArray,
) -> _Blocks:
    """Append the moments of the blocks that are ready to `done`; return the others.

    What rounding of the drift may change in their exponents is added to `noise`, by scene.
    """
    rule = panels.lobatto()
    h = blocks.t1 - blocks.t0
    phi = _phi(field, blocks, anchors, rule.nodes)
    lam_phi = lam[blocks.scene][:, None] * phi
    # NumPy reduces a long last axis fast and a short one slowly: nodes go first.
    by_node = np.ascontiguousarray(phi.T)
    low, high = by_node.min(axis=0), by_node.max(axis=0)
    size = np.maximum(np.abs(low), np.abs(high))
    lam_h = lam[blocks.scene] * h
    slowly = _is_slow(low, high, lam_phi, lam_h, h)
    count = np.maximum(np.ceil(lam_h * size / REACH), 1.0)
    # The n-th Chebyshev coefficient shrinks by count^n when the block is cut into panels.
    rough = _tail(phi) / count**8
    field.saw(blocks.scene, size)
    hidden = _hidden(field, blocks, anchors, phi, size, lam_h)
    slowly &= ~hidden
    few = ~slowly & ~hidden & (count <= _SAMPLES_PER_BLOCK) & (lam_h * rough <= 4e-14 * count)
    if slowly.any():
        chosen = blocks.take(slowly)
        done.append(
            (
                chosen.scene,
                chosen.part,
                chosen.t0,
                panels.slow(lam_phi[slowly], h[slowly]),
                np.ones(len(chosen.scene), dtype=bool),
            )
        )
    if few.any():
        chosen = blocks.take(few)
        moments, good = _sampled_blocks(field, lam, chosen, anchors, count[few].astype(np.intp))
        few[few] = good
        chosen, moments = chosen.take(good), Moments(*(m[good] for m in moments))
        if field.series(chosen.scene[:1]) is None:
            # Away from its anchors a drift that is no polynomial is right to an ulp of its
            # largest values only, which counts where it is small on a wide panel.
            rounding = 2e-16 * field.size()[chosen.scene] * lam_h[few]
            np.add.at(noise, chosen.scene, np.where(_is_direct(chosen, anchors), rounding, 0.0))
        sampled = np.zeros(len(chosen.scene), dtype=bool)
        done.append((chosen.scene, chosen.part, chosen.t0, moments, sampled))
    return blocks.take(~(slowly | few))


def _is_direct(blocks: _Blocks, anchors: _Anchors) -> np.ndarray:
    """Blocks on which the drift is evaluated as it stands, not by its series about an anchor."""
    direct: np.ndarray = blocks.anchor < 0
    if not direct.all():
        reach = np.maximum(np.abs(blocks.t0), np.abs(blocks.t1))
        direct = direct | (reach > anchors.radius[blocks.anchor])
    return direct


def _is_slow(
    low: FloatArray, high: FloatArray, lam_phi: FloatArray, lam_h: FloatArray, h: FloatArray
) -> np.ndarray:
    """Where the slow series of `panels.slow` holds to rounding; low <= phi <= high."""
    smallest = np.maximum(low, -high)
    candidate = lam_h * smallest > 40.0
    if not candidate.any():
        return candidate
    chosen = lam_phi[candidate]
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        slope = chosen @ panels.lobatto().differentiate.T
        # lam phi^2/|phi'| in terms of lam phi, kept from overflowing
        ratio = np.ascontiguousarray((slope / chosen / chosen).T)
        steepness = np.abs(ratio).max(axis=0) / h[candidate]
        scale = (smallest * lam_h / h)[candidate, None]
        tail = _tail(scale / chosen)
        # A term of the slow series is a derivative of the one before, and differentiating at
        # an end multiplies what the nodes miss of 1/phi by up to 2 NODES^2 a width.
        growth = 2 * panels.NODES**2 / (smallest * lam_h)[candidate]
        # `rise` integrates phi itself, which may have poles where 1/phi is smooth.
        resolved = _tail(chosen) <= 1e-14 * np.abs(chosen) @ np.ones(chosen.shape[1])
        resolved &= (tail < 1e-10) & (tail * growth * (1 + growth) < 6e-14)
        candidate[candidate] = (steepness * SLOWNESS < 1) & resolved
    return candidate


def _hidden(
    field: Field,
    blocks: _Blocks,
    anchors: _Anchors,
    phi: FloatArray,
    size: FloatArray,
    lam_h: FloatArray,
) -> np.ndarray:
    """Blocks with a feature too narrow for their nodes to see (see `symasym.discs`)."""
    middle = (blocks.t0 + blocks.t1) / 2
    taken_about = blocks.anchor >= 0
    if taken_about.any():
        middle = middle + np.where(taken_about, anchors.centre[blocks.anchor], 0.0)
    around = field.spread(blocks.scene, middle, blocks.t1 - blocks.t0)
    if around is None:
        return np.zeros(len(size), dtype=bool)  # a polynomial has none
    # Beyond a step or a needle the Taylor expansion about an anchor would be another function.
    straying = np.abs(around.centre - phi[:, panels.NODES // 2])
    close = straying <= 1e-6 * size + 1e-10 * field.size()[blocks.scene]
    # What 17 nodes miss of a function on that disc is 4e-10 of its bound, at most.
    negligible = lam_h * around.radius < 1e-5
    seen: np.ndarray = (tame(around.radius, size) | negligible) & (close | ~taken_about)
    return ~seen


@cache
def _tail_of() -> FloatArray:
    """Matrix from values at the Lobatto nodes to the last two Chebyshev coefficients."""
    n = panels.NODES
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
    field: Field, lam: FloatArray, blocks: _Blocks, anchors: _Anchors, count: IntArray
) -> tuple[Moments, np.ndarray]:
    """Blocks cut into `count` panels each, whose records are merged pairwise; and which are
    resolved."""
    owner = np.repeat(np.arange(len(count)), count)
    k = np.arange(len(owner)) - np.repeat(np.cumsum(count) - count, count)
    width = (blocks.t1 - blocks.t0) / count
    t0 = blocks.t0[owner] + k * width[owner]
    pieces = _Blocks(
        blocks.scene[owner], blocks.part[owner], blocks.anchor[owner], t0, t0 + width[owner]
    )
    found = []
    for low in range(0, len(owner), _PANELS_AT_ONCE):
        chunk = pieces.take(slice(low, low + _PANELS_AT_ONCE))
        h = width[owner[low : low + _PANELS_AT_ONCE]]
        found.append(panels.sampled(_exponents(field, lam, chunk, h, anchors), h))
    moments = Moments(*(np.concatenate(m) for m in zip(*(f[0] for f in found), strict=True)))
    resolved = np.logical_and.reduceat(
        np.concatenate([f[1] for f in found]), np.flatnonzero(k == 0)
    )
    return panels.merge(moments, k, count[owner]), resolved


def _exponents(
    field: Field, lam: FloatArray, pieces: _Blocks, h: FloatArray, anchors: _Anchors
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
        phi = _phi(field, pieces, anchors, panels.gauss().nodes)
        return panels.exponents_of_values(scale[:, None] * phi)
    c = list(series)
    for lowest in range(len(c) - 1):
        for k in range(len(c) - 2, lowest - 1, -1):
            c[k] = c[k] + c[k + 1] * pieces.t0
    for k in range(len(c)):
        c[k] = c[k] * scale
        scale = scale * h
    return panels.exponents_of_series(np.array(c).T)


def _compose(
    scene: IntArray,
    moments: Moments,
    lam: FloatArray,
    field: Field,
    log_sigma: FloatArray,
    log_w: FloatArray,
) -> Sweep:
    """Carry sigma and w through each scene's records, in order, in the log domain.

    A running error analysis goes along: the logarithms may pass through values
    far larger than the result, and each addition of logarithms forgets the
    error of the smaller term.
    """
    total = len(lam)
    count = np.bincount(scene, minlength=total)
    by_count = np.argsort(-count, kind="stable")
    first = np.cumsum(count) - count
    log_lam = np.log(lam[by_count])
    # A record is good to about 20 ulp, and to the rounding of phi in its exponent where phi
    # is not taken about a nearby centre.
    rounding = lam * field.size()
    local = 5e-15 + 8e-18 * np.where(rounding < _MILD, rounding, 1e3)[by_count]
    log_sigma, log_w = log_sigma[by_count], log_w[by_count]
    with np.errstate(divide="ignore"):
        log_near, log_far, log_both = (np.log(m) for m in moments[1:])
    sigma_error, w_error = np.zeros(total), np.zeros(total)
    still = np.searchsorted(-count[by_count], -np.arange(count.max(initial=0)), side="left")
    for k in range(count.max(initial=0)):
        n = still[k]
        at = first[by_count[:n]] + k
        rise, near = moments.rise[at], log_near[at]
        far, both = log_far[at] + log_lam[:n], log_both[at] + log_lam[:n]
        sigma, w = log_sigma[:n], log_w[:n]
        up = rise > 0
        # Down: sigma' e = near + sigma; up: sigma' = near + sigma/e (see panels).
        entering = np.where(up, sigma - rise, sigma)
        grown = np.logaddexp(near, entering)
        before = np.where(up, w, w + rise)
        carried = np.logaddexp(before, far)
        # Upwards the share is sigma/sigma': adding `rise` to `entering - grown` would
        # cancel where sigma is forgotten, so that case takes the quotient as it is.
        share = entering - grown
        kept = ~up | (entering > near)
        share = np.where(kept, np.where(up, share + rise, share), sigma - grown)
        share = np.where(sigma == np.inf, np.where(up, rise, 0.0), share)
        log_w[:n] = np.logaddexp(share + carried, both - grown)
        log_sigma[:n] = np.where(up, grown, grown - rise)

        step = _ULP * np.abs(rise)
        old = sigma_error[:n]
        e_in = old + step + _ULP * _finite(sigma)
        p = _weight(entering, grown)
        e_grown = p * e_in + (1 - p) * local[:n]
        e_before = w_error[:n] + np.where(up, 0.0, step) + _ULP * _finite(w)
        e_carried = _weight(before, carried) * e_before + local[:n]
        e_share = np.where(kept, (1 - p) * e_in + np.where(up, step, 0.0), old + e_grown)
        q = _weight(share + carried, log_w[:n])
        w_error[:n] = q * (e_share + e_carried) + (1 - q) * (local[:n] + e_grown)
        sigma_error[:n] = e_grown + np.where(up, 0.0, step)
    result = np.empty((4, total))
    result[:, by_count] = log_sigma, log_w, sigma_error, w_error
    return Sweep(*result)


def _finite(x: FloatArray) -> FloatArray:
    return np.where(np.isfinite(x), np.abs(x), 0.0)


def _weight(part: FloatArray, whole: FloatArray) -> FloatArray:
    """exp(part - whole), with 1 for infinities."""
    difference = part - whole
    return np.exp(np.minimum(np.where(np.isnan(difference), 0.0, difference), 0.0))


class Logs(NamedTuple):
    """Natural logarithms of a quantity, and a bound on their absolute error by running analysis."""

    value: FloatArray
    error: FloatArray


def escape_time(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> Logs:
    """log T (eq:Ttilde) of each scene.

    Parameters
    ----------
    field : Field
        Each scene and, after all of them, each mirror image.
    lam, r, start : arrays of shape (scenes,)
    """
    left, right = _both(field, lam, r, start)
    w, rate = formulas.log_escape_parts(left.log_w, right.log_w, left.log_sigma, right.log_sigma)
    share, part = _weight(left.log_w, w), _weight(-left.log_sigma, rate)
    error = (
        share * left.w_error
        + (1 - share) * right.w_error
        + part * left.sigma_error
        + (1 - part) * right.sigma_error
        + _ULP * (np.abs(w) + np.abs(rate))
    )
    return Logs(w - rate, error)


def exit_probability(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray, complement: bool
) -> Logs:
    """log C (eq:C), or log(1 - C); parameters as in `escape_time`."""
    left, right = _both(field, lam, r, start)
    if complement:
        left, right = right, left
    error = (
        left.sigma_error
        + right.sigma_error
        + _ULP * (np.abs(left.log_sigma) + np.abs(right.log_sigma))
    )
    value = formulas.log_exit_share_of_logs(left.log_sigma, right.log_sigma)
    # log C = -log(1 + e^odds), whose derivative is C - 1.
    return Logs(value, error * -np.expm1(value))


def stationary_density(field: Field, lam: FloatArray, y: FloatArray) -> Logs:
    """log p_ss(y) (eq:pss) of each scene, which must slide."""
    left, right = _halves(_swept(field, lam, y, free=True))
    w = np.logaddexp(left.log_w, right.log_w)
    share = _weight(left.log_w, w)
    error = share * left.w_error + (1 - share) * right.w_error + _ULP * np.abs(w)
    return Logs(np.log(lam) - w, error)


def occupation(field: Field, lam: FloatArray, complement: bool) -> Logs:
    """log P (eq:P), or log(1 - P), of each scene, which must slide."""
    n = len(lam)
    doubled = np.tile(lam, 2)
    end = np.ones(2 * n)
    whole = sweep(field, doubled, -np.inf * end, end, free=True)
    tail = formulas.log_tail_right(field.a_plus)
    everything = np.logaddexp(whole.log_w, tail)
    share = _weight(whole.log_w, everything)
    error = share * whole.w_error + _ULP * np.abs(everything)
    near_tail, far_tail = (tail - everything)[:n], (tail - everything)[n:]
    outside = np.logaddexp(near_tail, far_tail)
    part = _weight(near_tail, outside)
    outside_error = part * error[:n] + (1 - part) * error[n:]
    layer = sweep(field, doubled, -np.inf * end, end, free=True, from_nothing=True)
    inside = layer.log_w[:n] - everything[:n]
    inside_error = layer.w_error[:n] + error[:n] + _ULP * np.abs(layer.log_w[:n])
    wanted, rest = (outside, inside) if complement else (inside, outside)
    # As log(1/(1 + odds)) the value keeps its relative precision where it is close to 1.
    value = formulas.log_occupation_share_of_logs(wanted, rest)
    return Logs(value, (inside_error + outside_error) * -np.expm1(value))


def _both(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> tuple[Sweep, Sweep]:
    doubled = np.tile(lam, 2)
    return _halves(
        sweep(field, doubled, -np.tile(r, 2), np.concatenate((start, -start)), free=False)
    )


def _swept(field: Field, lam: FloatArray, y: FloatArray, free: bool) -> Sweep:
    doubled = np.tile(lam, 2)
    return sweep(field, doubled, np.full(2 * len(lam), -np.inf), np.concatenate((y, -y)), free=free)


def _halves(both: Sweep) -> tuple[Sweep, Sweep]:
    n = len(both.log_w) // 2
    return Sweep(*(x[:n] for x in both)), Sweep(*(x[n:] for x in both))
