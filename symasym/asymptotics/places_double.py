"""The places of `symasym.asymptotics.places` for many polynomial drifts at once, in float64.

Drifts are taken together where their zeros of A, the start and the radius come in the same
order. Everything is found once for both sides, since seen in the mirror h_k(u) becomes
-h_k(-u), and a well or barrier stays what it is. Drifts for which float64 is not enough, for
zeros of A close to each other or to the start or an end, are left out: `Found.rows` tells.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.places import BEYOND
from symasym.asymptotics.polynomial_zeros import Zeros, zeros_of
from symasym.asymptotics.sights import Part, Series, Sight, Spot, trimmed
from symasym.drift import Drift
from symasym.exact.double_double import DoubleDouble, DoubleDoubleOps, shift
from symasym.exact.fields import IntArray
from symasym.inputs import FloatArray

# Work arrays of one chunk stay in the second-level cache.
_AT_ONCE = 1024
_EPS = 2.3e-16
# Zeros of A whose rounding, relative to their distances, is more than this are not used.
_ROUGHEST = 1e-10
# |A| at the start, at an end or at a kink beside its largest term, for the same reason.
_NEAREST = 1e-7
_MOST_DEGREE = 12


class Scenes(NamedTuple):
    """Polynomial drifts with starts and radii; coefficients of A in ascending rows."""

    c: FloatArray
    a_minus: FloatArray
    a_plus: FloatArray
    start: FloatArray
    r: FloatArray

    def take(self, rows: Any) -> Scenes:
        return Scenes(self.c[:, rows], *(x[rows] for x in self[1:]))


class Found(NamedTuple):
    """The two sides of these scenes, left and right."""

    rows: IntArray
    sights: tuple[Sight, Sight]


def scenes_of(
    drift: Drift, values: dict[str, Any], start: FloatArray, r: FloatArray
) -> Scenes | None:
    """None where A is not a polynomial of modest degree."""
    count = len(start)
    pairs = {name: DoubleDouble.of(x).broadcast_to((count,)) for name, x in values.items()}
    known = drift.coefficients(pairs, DoubleDoubleOps())
    if known is None or not 0 < len(known) <= _MOST_DEGREE + 1:
        return None
    shaped = [DoubleDouble.of(c).broadcast_to((count,)) for c in known]
    ends = [shift(shaped, np.full(count, side))[0] for side in (-1.0, 1.0)]
    return Scenes(np.array([c.hi + c.lo for c in shaped]), ends[0], ends[1], start, r)


def found_of(scenes: Scenes, order: int) -> Iterator[Found]:
    """The places of all scenes that float64 is enough for, chunk by chunk."""
    degree = np.where(scenes.c != 0, np.arange(len(scenes.c))[:, None], 0).max(axis=0)
    for d in np.unique(degree):
        rows = np.flatnonzero(degree == d)
        zeros = zeros_of(scenes.c[: d + 1, rows])
        good = zeros.apart & clear_of_zero(scenes.take(rows))
        keys = structure(scenes.take(rows), zeros)
        for key in np.unique(keys[good]):
            members = np.flatnonzero(good & (keys == key))
            for low in range(0, len(members), _AT_ONCE):
                chosen = members[low : low + _AT_ONCE]
                some = scenes.take(rows[chosen])
                some = some._replace(c=some.c[: d + 1])
                builder = Builder(some, zeros.take(chosen), order)
                rough = builder.roughest()
                sure = rough < _ROUGHEST
                if sure.all():
                    yield Found(rows[chosen], builder.sights())
                elif sure.any():
                    chosen = chosen[sure]
                    builder = Builder(some.take(sure), zeros.take(chosen), order)
                    yield Found(rows[chosen], builder.sights())


def _edges(scenes: Scenes) -> FloatArray:
    """What the layer shows of (-r, start, r)."""
    reach = np.minimum(scenes.r, 1.0)
    return np.array([-reach, np.clip(scenes.start, -reach, reach), reach])


def _value(c: FloatArray, u: Any) -> Any:
    total = c[-1]
    for row in c[-2::-1]:
        total = total * u + row
    return total


def clear_of_zero(scenes: Scenes) -> Any:
    good = (scenes.a_minus != 0) & (scenes.a_plus != 0)
    for u in _edges(scenes):
        size = _value(np.abs(scenes.c), np.abs(u))
        good &= np.abs(_value(scenes.c, u)) > _NEAREST * size
    return good


def structure(scenes: Scenes, zeros: Zeros) -> IntArray:
    """One number for each way in which zeros, start and radius may be ordered."""
    low, middle, high = _edges(scenes)
    key = zeros.real * 2 + (scenes.r > 1)
    for edge in (low, middle, high):
        # Beyond the real zeros a row goes on with infinities.
        key = key * 16 + (zeros.values.real < edge).sum(axis=0)
    start = scenes.start
    outside = (start < -1) + 2 * (start == -1) + 3 * (start == 1) + 4 * (start > 1)
    found: IntArray = (key * 8 + outside) * 2 + (scenes.c[-1] > 0)
    return found


class Builder:
    """Scenes of one structure."""

    def __init__(self, scenes: Scenes, zeros: Zeros, order: int) -> None:
        self.scenes, self.count = scenes, order + 1 + BEYOND
        self.c, self.degree = scenes.c, len(scenes.c) - 1
        self.edges = _edges(scenes)
        self.real = int(zeros.real[0]) if len(zeros.real) else 0
        roots = zeros.values
        self.lines = [roots[k].real for k in range(self.real)]
        self.pairs = zeros.pairs
        k = np.arange(1, self.degree + 2)[:, None]
        self.v = -self.c / k
        self.height_size = _value(np.abs(self.v), 1.0)
        self.rough = [self.roughness(z) for z in self.lines]
        self.rough_pairs = [self.roughness(z) for z in self.pairs]

    # -- rounding ---------------------------------------------------------------------------

    def others(self, z: Any) -> Iterator[Any]:
        for w in self.lines:
            if w is not z:
                yield w
        for w in self.pairs:
            if w is not z:
                yield w
            yield np.conj(w)

    def roughness(self, z: Any) -> FloatArray:
        """What rounding A does to this zero, in units of its distance to the next."""
        moved = _value(np.abs(self.c), np.abs(z)) / np.abs(self.slope(z))
        near = np.full(moved.shape, np.inf)
        for w in self.others(z):
            near = np.minimum(near, np.abs(z - w))
        near = np.minimum(near, 1 + np.abs(z))
        found: FloatArray = _EPS * (1 + moved / near)
        return found

    def roughest(self) -> FloatArray:
        worst = np.zeros(self.c.shape[1])
        for rough in self.rough + self.rough_pairs:
            worst = np.maximum(worst, rough)
        return np.where(np.isfinite(worst), worst, np.inf)

    # -- series -----------------------------------------------------------------------------

    def slope(self, z: Any) -> Any:
        total = self.degree * self.c[-1]
        for k in range(self.degree - 1, 0, -1):
            total = total * z + k * self.c[k]
        return total

    def taylor(self, u: Any) -> list[Any]:
        work = list(self.c)
        for lowest in range(self.degree):
            for k in range(self.degree - 1, lowest - 1, -1):
                work[k] = work[k] + work[k + 1] * u
        return work

    def smooth(self, u: FloatArray) -> Series:
        """h_k(u), k = 1, 2, ..."""
        psi = self.taylor(u)
        inverse = 1 / psi[0]
        series = _quotient([np.ones_like(psi[0])], psi, inverse, self.count)
        found = [series[0]]
        for _ in range(1, self.count):
            slope = [-j * series[j] for j in range(1, len(series))]
            series = _quotient(slope, psi, inverse, len(slope))
            found.append(series[0])
        size = _value(np.abs(self.c), np.abs(u)) * np.abs(inverse)
        return Series([Part(1.0, 0, trimmed(found))], _EPS * 4 * self.count * (1 + size))

    def flat(self, a: FloatArray) -> Series:
        return Series([Part(1.0, 0, [1 / a])], _EPS)

    def peak(self, k: int) -> Series:
        """Laplace's series at the k-th real zero."""
        t = self.taylor(self.lines[k])
        a = np.abs(t[1]) / 2
        alpha = [t[j + 1] / ((j + 2) * t[1]) * 2 for j in range(1, self.degree)]
        found = []
        for n in range(self.count):
            p, power = 2 * n + 1, [np.ones_like(a)]
            for m in range(1, 2 * n + 1):
                total: Any = 0.0
                for j, x in enumerate(alpha[:m], start=1):
                    total = total + (p * j + 2 * (m - j)) * x * power[m - j]
                power.append(total * (-0.5 / m))
            found.append(power[-1] * (math.gamma(n + 0.5) * a ** -(n + 0.5)))
        # Higher coefficients depend on the zeros' distances by higher powers.
        rounding = 8 * (self.count + self.degree) * self.rough[k]
        return Series([Part(0.5, 0, found)], rounding)

    # -- the outer part ---------------------------------------------------------------------

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Primitives of h_1, h_2, ... at the three edges, and what is rounded in them."""
        zero = np.zeros_like(self.edges)
        totals = [zero for _ in range(self.count)]
        sizes = [zero for _ in range(self.count)]
        if self.degree == 0:
            totals[0] = self.edges / self.c[0]
            sizes[0] = np.abs(totals[0]) * _EPS
            return totals, sizes
        for z, rough in zip(self.lines + self.pairs, self.rough + self.rough_pairs, strict=True):
            single = not np.iscomplexobj(z)
            t = self.edges - z
            inverse = 1 / t
            first = np.log(np.abs(t)) if single else np.log(t)
            for k, residues in enumerate(self.residues(z)):
                total: Any = 0.0
                for j in range(2 * k + 1, 1, -1):
                    total = (total + residues[j] * (1 / (1 - j))) * inverse
                total = total + residues[1] * first
                totals[k] = totals[k] + (total if single else 2 * total.real)
                sizes[k] = sizes[k] + np.abs(total) * (rough * (6 + 4 * k))
        return totals, sizes

    def residues(self, z: Any) -> Iterator[list[Any]]:
        """Coefficients of (u - z)^-j in h_1, h_2, ...; the entry 0 is not used."""
        psi = self.taylor(z)[1:]
        inverse = 1 / psi[0]
        length = 2 * self.count - 1
        series = _quotient([np.ones_like(psi[0])], psi, inverse, length)
        for k in range(self.count):
            yield [None, *series[2 * k :: -1]]
            slope = [(2 * k + 1 - j) * x for j, x in enumerate(series)]
            if k + 1 < self.count:
                series = _quotient(slope, psi, inverse, length)

    # -- the two sides ----------------------------------------------------------------------

    def potential(self, u: Any) -> Any:
        return _value(self.v, u) * u

    def sights(self) -> tuple[Sight, Sight]:
        totals, sizes = self.primitives()
        middle = self.edges[1]
        outside = np.zeros_like(middle)
        start = self.scenes.start
        before, after = bool(start[0] < -1), bool(start[0] > 1)
        if before:
            outside = (start + 1) * self.scenes.a_minus
        if after:
            outside = (start - 1) * self.scenes.a_plus
        # V from the start on.
        self.base = self.potential(middle) - outside
        # Horner's rounding at both places; products with lam are rounded elsewhere.
        self.height_rough = _EPS * ((self.degree + 3) * self.height_size + 2 * np.abs(outside))
        self.at_edge = [self.smooth(u) for u in self.edges]
        peaks = {}
        low, _, high = self.edges
        for k, z in enumerate(self.lines):
            if low[0] < z[0] < high[0]:
                peaks[k] = self.peak(k)
        left = self.side(-1, totals, sizes, peaks)
        right = self.side(1, totals, sizes, peaks)
        return left, right

    def side(
        self, sign: int, totals: list[Any], sizes: list[Any], peaks: dict[int, Series]
    ) -> Sight:
        """What lies right of the start, or, in the mirror, left of it."""
        scenes = self.scenes
        a_near, a_far = scenes.a_minus, scenes.a_plus
        if sign < 0:
            a_near, a_far = -a_far, -a_near
        start = sign * scenes.start
        inside_of = 2 if sign > 0 else 0
        nothing = Series([])
        if start[0] >= 1:
            h = self.flat(a_far)
            return Sight(
                *_ends(h), True, [], [], nothing, (start, 0 * start, a_far), self.height_rough
            )
        rising: list[Spot] = []
        falling: list[Spot] = []
        extra: Any = 0.0
        if start[0] < -1:
            h = self.flat(a_near)
            extra = (-1 - start) / a_near
            height = (1 + start) * a_near
            # The height there is -(length) phi, the layer's near edge.
            inner = _signed(self.at_edge[1], sign)
            _edge(rising, falling, 0, height, h, inner)
        else:
            h = _signed(self.at_edge[1], sign)
        shares = [totals[k][inside_of] - totals[k][1] for k in range(self.count)]
        wrong = [sizes[k][inside_of] + sizes[k][1] for k in range(self.count)]
        shares[0] = shares[0] + extra
        wrong[0] = wrong[0] + np.abs(extra) * _EPS * 4
        outer = Series([Part(1.0, 0, trimmed(shares))], 1.0, wrong)
        rank = self.between(sign, rising, falling, peaks)
        beyond = self.end(sign, rank, rising, falling)
        return Sight(*_ends(h), True, rising, falling, outer, beyond, self.height_rough)

    def end(
        self, sign: int, rank: int, rising: list[Spot], falling: list[Spot]
    ) -> tuple[Any, Any, Any] | None:
        """Add the end of the layer, or r before it; returns what lies beyond."""
        at = 2 if sign > 0 else 0
        height = self.potential(self.edges[at]) - self.base
        inner = _signed(self.at_edge[at], sign)
        if self.scenes.r[0] <= 1:
            _edge(rising, falling, rank, height, inner, None)
            return None
        slope = self.scenes.a_plus if sign > 0 else -self.scenes.a_minus
        _edge(rising, falling, rank, height, inner, self.flat(slope))
        return np.ones_like(height), height, slope

    def inside(self, sign: int) -> list[int]:
        """Which real zeros lie between the start and the layer's end, from the start on."""
        low, high = sorted((self.edges[1][0], self.edges[2 if sign > 0 else 0][0]))
        order = range(len(self.lines)) if sign > 0 else reversed(range(len(self.lines)))
        return [k for k in order if low < self.lines[k][0] < high]

    def between(
        self, sign: int, rising: list[Spot], falling: list[Spot], peaks: dict[int, Series]
    ) -> int:
        """Add wells and barriers; returns the rank of what comes next."""
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            z = self.lines[k]
            height = self.potential(z) - self.base
            barrier = bool(self.slope(z)[0] > 0)
            spots = rising if barrier else falling
            spots.append(Spot(rank, height if barrier else -height, peaks[k], None))
        return len(inside) + 1


def _quotient(numerator: list[Any], psi: list[Any], inverse: Any, length: int) -> list[Any]:
    """Power series by the short `psi`, of which `inverse` is 1/psi[0]."""
    found: list[Any] = []
    for n in range(length):
        total: Any = numerator[n] if n < len(numerator) else 0.0
        for j in range(1, min(n, len(psi) - 1) + 1):
            total = total - psi[j] * found[n - j]
        found.append(total * inverse)
    return found


def _signed(series: Series, sign: int) -> Series:
    if sign > 0:
        return series
    parts = [Part(p.offset, p.logs, [-c for c in p.coefficients]) for p in series.parts]
    return Series(parts, series.rounding, series.size)


def _row(series: Series) -> list[Any]:
    return series.parts[0].coefficients if series.parts else []


def _ends(h: Series) -> tuple[Series, Series]:
    """The formal series of int e^{lam V} and int e^{-lam V} to the right, from h_k there."""
    row = _row(h)
    rising = [c if k % 2 == 0 else -c for k, c in enumerate(row)]
    return (
        Series([Part(1.0, 0, rising)] if row else [], h.rounding),
        Series([Part(1.0, 0, [-c for c in row])] if row else [], h.rounding),
    )


def _edge(
    rising: list[Spot],
    falling: list[Spot],
    rank: int,
    height: Any,
    left: Series,
    right: Series | None,
) -> None:
    """Both integrals where the drift changes, or ends."""
    first, second = _row(left), [] if right is None else _row(right)
    width = max(len(first), len(second))
    first, second = (row + [0.0] * (width - len(row)) for row in (first, second))
    change = trimmed([y - x for x, y in zip(first, second, strict=True)])
    # phi goes on without a jump, so that the first terms of both sides cancel, exactly.
    if right is not None and change:
        change[0] = 0.0
    rough = left.rounding if right is None else np.maximum(left.rounding, right.rounding)
    changes = _ends(Series([Part(1.0, 0, change)] if change else [], rough))
    onward = Series([]) if right is None else _ends(right)[0]
    rising.append(Spot(rank, height, changes[0], onward))
    falling.append(Spot(rank, -height, changes[1], None))


__all__ = ["Builder", "Found", "Scenes", "clear_of_zero", "found_of", "scenes_of", "structure"]
