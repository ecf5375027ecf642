"""Scenes whose A is a polynomial, its coefficients in float64 to the last digit.

Scenes are taken together where their zeros of A, the start and the radius come in the same order
(`structure`).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray, IntArray
from symasym.drift.drift import Drift
from symasym.numbers.double_double import DoubleDouble, DoubleDoubleOps, shift
from symasym.numbers.polynomials import Zeros, poly

_MOST_DEGREE = 12
# |A| at the start, at an end or at a kink beside its largest term, below which it is not known.
_NEAREST = 1e-7


class Scenes(NamedTuple):
    """Polynomial drifts with starts and radii; coefficients of A in ascending rows."""

    c: FloatArray
    a_minus: FloatArray
    a_plus: FloatArray
    start: FloatArray
    r: FloatArray

    def take(self, rows: slice | IntArray) -> Scenes:
        """Some of the scenes."""
        return Scenes(self.c[:, rows], *(x[rows] for x in self[1:]))


def scenes_of(
    drift: Drift, values: dict[str, Any], start: FloatArray, r: FloatArray
) -> Scenes | None:
    """None where A is not a polynomial of modest degree."""
    count = len(start)
    if count == 1 and not drift.shape:
        exact = _exact_scene(drift, start, r)
        if exact is not None:
            return exact
    pairs = {name: DoubleDouble.of(x).broadcast_to((count,)) for name, x in values.items()}
    known = drift.coefficients(pairs, DoubleDoubleOps())
    if known is None or not 0 < len(known) <= _MOST_DEGREE + 1:
        return None
    shaped = [DoubleDouble.of(c).broadcast_to((count,)) for c in known]
    ends = [shift(shaped, np.full(count, side))[0] for side in (-1.0, 1.0)]
    return Scenes(np.array([c.hi + c.lo for c in shaped]), ends[0], ends[1], start, r)


def _exact_scene(drift: Drift, start: FloatArray, r: FloatArray) -> Scenes | None:
    """The scene of a drift with rational coefficients, each rounded once; None of any other."""
    known = drift.exact_coefficients()
    if known is None or len(known) > _MOST_DEGREE + 1:
        return None
    alternating = (c if k % 2 == 0 else -c for k, c in enumerate(known))
    try:
        numbers = [float(c) for c in (*known, sum(alternating), sum(known))]
    except OverflowError:
        return None
    *c, a_minus, a_plus = np.array(numbers)[:, None]
    return Scenes(np.array(c), a_minus, a_plus, start, r)


def edges_of(scenes: Scenes) -> FloatArray:
    """(-r, start, r), each moved to the nearest point of the layer [-1, 1]."""
    reach = np.minimum(scenes.r, 1.0)
    return np.array([-reach, np.clip(scenes.start, -reach, reach), reach])


def clear_of_zero(scenes: Scenes, ends: bool = True) -> Any:
    """True where A is not too small at the start and at r, and at the layer's `ends`."""
    good = (scenes.a_minus != 0) & (scenes.a_plus != 0)
    c, sizes = list(scenes.c), list(np.abs(scenes.c))
    for u in edges_of(scenes):
        clear = np.abs(poly(c, u)) > _NEAREST * poly(sizes, np.abs(u))
        good &= clear if ends else clear | (np.abs(u) == 1)
    return good


def structure(scenes: Scenes, zeros: Zeros) -> IntArray:
    """One number for each way in which zeros, start and radius may be ordered."""
    low, middle, high = edges_of(scenes)
    key = zeros.real * 2 + (scenes.r > 1)
    for edge in (low, middle, high):
        # Beyond the real zeros a row goes on with infinities.
        key = key * 16 + (zeros.values.real < edge).sum(axis=0)
    start = scenes.start
    outside = (start < -1) + 2 * (start == -1) + 3 * (start == 1) + 4 * (start > 1)
    key_of_order: IntArray = (key * 8 + outside) * 2 + (scenes.c[-1] > 0)
    return key_of_order
