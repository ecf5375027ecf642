"""Blocks of [-1, 1] in float64, about Taylor expansions of the drift, and the drift on them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.drift.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_panels import REACH, SLOWNESS
from symasym.numbers.complex_balls import tame
from symasym.numbers.polynomials import poly

#: lam |A| up to which positions are measured from u = 0.
MILD = 5e3


class Blocks(NamedTuple):
    """Intervals [t0, t1] about `anchor` (index of a Taylor expansion; -1: t is u itself)."""

    scene: IntArray
    part: IntArray
    anchor: IntArray
    t0: FloatArray
    t1: FloatArray

    def take(self, index: Any) -> Blocks:
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
    anchors = Anchors(marks[known], owner, coefficients, radius)

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
        chosen.append(Blocks(scene[row][which], part[which], anchor[which], t0, t1))
    return Blocks(*(np.concatenate(f) for f in zip(*chosen, strict=True))), anchors


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
        result[near] = poly(list(c.T[:, :, None]), t[near])
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
    middle = (blocks.t0 + blocks.t1) / 2
    taken_about = blocks.anchor >= 0
    if taken_about.any():
        middle = middle + np.where(taken_about, anchors.centre[blocks.anchor], 0.0)
    around = field.spread(blocks.scene, middle, blocks.t1 - blocks.t0)
    if around is None:
        return np.zeros(len(size), dtype=bool)  # a polynomial has none
    # Beyond a step or a needle the Taylor expansion about an anchor would be another function.
    straying = np.abs(around.centre - phi[:, float_panels.NODES // 2])
    close = straying <= 1e-6 * size + 1e-10 * field.size()[blocks.scene]
    # What 17 nodes miss of a function on that disc is 4e-10 of its bound, at most.
    negligible = lam_h * around.radius < 1e-5
    seen: np.ndarray = (tame(around.radius, size) | negligible) & (close | ~taken_about)
    return ~seen
