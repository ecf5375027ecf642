"""Places, pairs of places and the outer part at a given lam, added up, with what is left out.

With S_R, D_R and their mirror images (`symasym.asymptotics.weak_noise.answer`); in an mpmath
context or, for arrays of lam, in float64.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.critical_points import BEYOND, Groups, Half, Place
from symasym.base.contexts import mpf_of
from symasym.base.inputs import FloatArray
from symasym.numbers.log_scaled import LogScaled

# Ratio of two neighbouring terms beyond which a series is taken to have stopped falling.
_MOST_FALL = Fraction(3, 4)
#: Terms before the next two from whose ratios one tells how these fall.
LOOK_BACK = 3


class Pair(NamedTuple):
    """A value and the size of what its series leaves out."""

    value: Any
    error: Any

    def __add__(self, other: Pair) -> Pair:  # type: ignore[override]
        return Pair(self.value + other.value, self.error + other.error)

    def __mul__(self, other: Pair) -> Pair:  # type: ignore[override]
        cross = self.error * (abs(other.value) + other.error) + abs(self.value) * other.error
        return Pair(self.value * other.value, cross)


class Side(NamedTuple):
    """One side of the start at a given lam: S and D without the start's own share, and that.

    `rising` and `falling` are the start's shares of int e^{lam V} and int e^{-lam V}.
    """

    scale: Pair
    nested: Pair
    rising: Pair
    falling: Pair


class Sides(NamedTuple):
    """Both sides, and the start's shares of both together, which all but cancel."""

    left: Side
    right: Side
    rising: Pair
    falling: Pair
    corner: bool

    def total(self) -> Any:
        """int e^{lam V} over both sides."""
        return self.left.scale.value + self.right.scale.value + self.rising.value

    def sure(self) -> Any:
        """Whether that is known to half of itself."""
        error = self.left.scale.error + self.right.scale.error + self.rising.error
        return error < self.total() * 0.5


def time_of(sides: Sides, lam: Any) -> Pair:
    """lam (L D_R + R D_L)/(L + R), the start's own share of each taken out.

    With l, m the start's shares of int e^{lam V} and int e^{-lam V} to the right, those to the
    left are -l and -m, so that m drops out, and l from L + R: written so, errors of the two
    series, which are large beside a zero of A, do not count where they cancel.
    """
    left, right = sides.left, sides.right
    behind = left.scale.value + left.rising.value
    ahead = right.scale.value + right.rising.value
    total = sides.total()
    if sides.corner:
        product = behind * ahead
        extra = Pair(product * sides.falling.value, abs(product) * sides.falling.error)
        slope = behind * sides.falling.value, ahead * sides.falling.value
    else:
        one = right.falling * right.scale
        two = left.falling * left.scale
        wrong = abs(behind) * one.error + abs(ahead) * two.error
        extra = Pair(behind * one.value + ahead * two.value, wrong)
        slope = two.value, one.value
    value = behind * right.nested.value + ahead * left.nested.value + extra.value
    # Beside a zero of A a side's share is as good as unknown, and may well be negative.
    error = abs(behind) * right.nested.error + abs(ahead) * left.nested.error + extra.error
    gap = right.nested.value - left.nested.value
    # How the value changes with what is left, right, and at the start of e^{lam V}.
    error = error + left.scale.error * abs(ahead * (gap + slope[1])) / total
    error = error + right.scale.error * abs(behind * (gap - slope[0])) / total
    error = error + right.rising.error * abs(gap + slope[1] - slope[0])
    error = error + sides.rising.error * (abs(gap) + abs(slope[0]) + abs(slope[1]))
    return Pair(lam * value / total, lam * error / total)


class Exponentials:
    """e^{lam height} in an mpmath context."""

    def __init__(self, context: Any) -> None:
        self._context = context
        # Places are known to a few units, and sums of theirs may cancel.
        self.unit = 64 * context.eps
        self._fall = self.number(_MOST_FALL)

    def exp(self, x: Any) -> Any:
        return self._context.exp(x)

    def log(self, x: Any) -> Any:
        return self._context.log(x)

    def log1p(self, x: Any) -> Any:
        return self._context.log1p(x)

    def left_out(self, last: list[Any], later: Iterable[Any]) -> Any:
        """What follows: the `last` two over 1 - q, q the largest ratio of neighbours in `last`."""
        total, ratio = sum(last[-BEYOND:], self._context.zero), self._context.zero
        small = self.unit * max(last)
        if total <= small:
            # These vanish: the first that does not tells.
            for size in later:
                total += size
                if size > small:
                    break
        for before, after in pairwise(last):
            if before:
                ratio = max(ratio, after / before)
            elif after:
                ratio = self._fall
        return total / (1 - min(ratio, self._fall))

    def number(self, x: Any) -> Any:
        if isinstance(x, Fraction):
            return mpf_of(x, self._context)
        return x


class FloatExponentials:
    """The same for arrays of floats."""

    unit = 1e-15

    def exp(self, x: FloatArray) -> LogScaled:
        return LogScaled(np.ones_like(x), x)

    def log(self, x: FloatArray) -> FloatArray:
        return np.log(x)

    def left_out(self, last: list[FloatArray], later: Iterable[FloatArray]) -> FloatArray:
        total, ratio = sum(last[-BEYOND:], np.zeros_like(last[-1])), np.zeros_like(last[-1])
        small = self.unit * np.max(last, axis=0)
        if (total <= small).all():
            for size in later:
                total = total + size
                if (size > small).any():
                    break
        for before, after in pairwise(last):
            known = before > 0
            here = np.where(known, after / np.where(known, before, 1.0), after > 0)
            ratio = np.maximum(ratio, here)
        found: FloatArray = total / (1 - np.minimum(ratio, float(_MOST_FALL)))
        return found

    def number(self, x: Any) -> Any:
        return x if isinstance(x, np.ndarray) else float(x)


def sides_of(halves: tuple[Half, Half], lam: Any, r: Any, order: int, ops: Any) -> Sides:
    left, right = (side_of(one, lam, r, order, ops) for one in halves)
    starts = [one.start for one in halves]
    both = (
        [a + b for a, b in zip(*pair, strict=True)]
        for pair in ([s.rising for s in starts], [s.falling for s in starts])
    )
    unit = ops.exp(0 * lam)
    rising, falling = (_times(series_of(gathered(g), lam, order, ops), unit) for g in both)
    return Sides(left, right, rising, falling, starts[0].corner)


def gathered(groups: Groups) -> Groups:
    """Terms of one power added up, before any is evaluated."""
    found: Groups = []
    for group in groups:
        sums: dict[Any, Any] = {}
        for c, p, q in group:
            sums[p, q] = sums.get((p, q), 0) + c
        found.append([(c, *key) for key, c in sums.items()])
    return found


def _times(series: Pair, factor: Any) -> Pair:
    return Pair(series.value * factor, series.error * factor)


def side_of(one: Half, lam: Any, r: Any, order: int, ops: Any) -> Side:
    """One side at `lam`, with the end at `r` where that is beyond the layer."""
    rising, falling = weights_of(one, lam, r, order, ops)
    unit = ops.exp(0 * lam)
    scale = rising.pop()[1] if one.beyond is not None else Pair(0 * unit, 0 * unit)
    nested = _times(outer_part(one, lam, r, order, ops), unit)
    # From right to left: what e^{lam V} has to the right of each place of e^{-lam V}.
    for place, share, onward in reversed(rising):
        while falling and falling[-1][0].u > place.u:
            nested = nested + falling.pop()[1] * scale
        if falling and falling[-1][0].u == place.u:
            nested = nested + falling.pop()[1] * (scale + onward)
        scale = scale + share
    for _, share, _ in falling:
        nested = nested + share * scale
    starts = (_times(series_of(g, lam, order, ops), unit) for g in one.start[:2])
    return Side(scale, nested, *starts)


def outer_part(one: Half, lam: Any, r: Any, order: int, ops: Any) -> Pair:
    """What lies between the places, in the layer and beyond it."""
    found = series_of(one.outer, lam, order, ops, ops.number(one.unit))
    if one.beyond is None:
        return found
    u, _, slope = (ops.number(x) for x in one.beyond)
    return Pair(found.value + (ops.number(r) - u) / (slope * lam), found.error)


def weights_of(
    one: Half, lam: Any, r: Any, order: int, ops: Any
) -> tuple[list[tuple[Place, Pair, Pair]], list[tuple[Place, Pair, Pair]]]:
    """The places of e^{lam V} and of e^{-lam V} with their shares and onward ones."""
    rising = list(one.rising)
    if one.beyond is not None:
        u, height, slope = (ops.number(x) for x in one.beyond)
        height = height - slope * (ops.number(r) - u)
        rising.append(Place("end", None, height, [[(-1 / slope, 1, 0)]], []))
    first, second = (
        [(p, *weight_of(p, lam, order, ops)) for p in places] for places in (rising, one.falling)
    )
    return first, second


def weight_of(place: Place, lam: Any, order: int, ops: Any) -> tuple[Pair, Pair]:
    """The place's share of its own integral, and its `onward`."""
    factor = ops.exp(lam * ops.number(place.height))
    share, onward = (
        _times(series_of(g, lam, order, ops), factor) for g in (place.groups, place.onward)
    )
    return share, onward


def series_of(groups: Groups, lam: Any, order: int, ops: Any, unit: Any = 0) -> Pair:
    """The first order + 1 groups, and the size of what follows, judged by the next two."""
    sums, size = [], 0 * lam

    def added(group: Any) -> tuple[Any, Any]:
        total, largest = 0 * lam, 0 * lam
        for c, p, q in group:
            term = ops.number(c) * lam ** -ops.number(p)
            term = term * ops.log(lam) if q else term
            total, largest = total + term, largest + abs(term)
        return total, largest

    known = order + 1 + BEYOND
    for group in groups[:known]:
        total, largest = added(group)
        sums.append(total)
        size = size + largest
    # A straight stretch has one term, and a place with nothing to its right has none.
    sums += [0 * lam] * (known - len(sums))
    value = sum(sums[: order + 1], 0 * lam)
    first = next((n for n, group in enumerate(groups) if any(c for c, _, _ in group)), 0)
    # Where the terms hardly fall any more, as many more are as large before they rise. One of the
    # next two may be small by chance: then those before them tell how they fall.
    last = [abs(s) for s in sums[max(min(first, order + 1), order + 1 - LOOK_BACK) :]]
    left_out = ops.left_out(last, (abs(added(group)[0]) for group in groups[known:]))
    return Pair(value, left_out + max(unit, ops.unit) * size)
