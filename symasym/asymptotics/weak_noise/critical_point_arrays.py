"""The expansions of `symasym.asymptotics.weak_noise.critical_points` for many polynomial drifts
at once, in float64.

Drifts are taken together where their zeros of A, the start and the radius come in the same
order. Everything is found once for both sides, since seen in the mirror h_k(u) becomes
-h_k(-u), and a well or barrier stays what it is. Drifts for which float64 is not enough, for
zeros of A close to each other or to the start or an end, are left out: `Found.rows` tells.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.majorants import majorants
from symasym.asymptotics.weak_noise.one_sided import (
    CriticalPoint,
    OneSided,
    add_edge,
    formal_series,
)
from symasym.asymptotics.weak_noise.regular_part import pole_primitive
from symasym.asymptotics.weak_noise.series import (
    BEYOND,
    ROUNDING,
    Numbers,
    Part,
    Series,
    higher,
    lower,
    trimmed,
)
from symasym.base.inputs import FloatArray
from symasym.drift.float_field import IntArray
from symasym.drift.polynomial_scenes import Scenes
from symasym.numbers.arithmetic import FLOATS, Arithmetic
from symasym.numbers.polynomial_roots import Zeros, zeros_of
from symasym.numbers.power_series import laurent

# Drifts at once: with a quarter of them NumPy's cost per call doubles the time; twice as many
# are no quicker and take twice the memory.
_AT_ONCE = 4096
_EPS = 2.3e-16
# Zeros of A whose rounding, relative to their distances, is more than this are not used.
_ROUGHEST = 1e-10
# |A| at the start, at an end or at a kink beside its largest term, for the same reason.
_NEAREST = 1e-7
# A's first derivatives beside the later ones, below which they are taken to vanish.
_FLAT = 1e-8


class Found(NamedTuple):
    """The two sides of these scenes, left and right."""

    rows: IntArray
    sides: tuple[OneSided, OneSided]


def _single(x: Numbers) -> Any:
    """The number in an array of one, which Python is quicker with."""
    return x[..., 0].tolist() if isinstance(x, np.ndarray) else x


def unchanged(x: Numbers) -> Any:
    """`x` itself."""
    return x


def found_of(scenes: Scenes, order: int) -> Iterator[Found]:
    """The expansions of all scenes that float64 is enough for, chunk by chunk."""
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
                built = _built(rows[chosen], some, zeros.take(chosen), order)
                if built is not None:
                    yield built


def _built(rows: IntArray, scenes: Scenes, zeros: Zeros, order: int) -> Found | None:
    """Those of one structure that float64 is enough for."""
    if len(rows) == 1:
        try:
            builder = Builder(scenes, zeros, order, _single)
            sure = builder.roughest() < _ROUGHEST and builder.estimated()
            return Found(rows, builder.both_sides()) if sure else None
        except (ArithmeticError, ValueError):
            # Python refuses what NumPy makes infinite.
            pass
    builder = Builder(scenes, zeros, order, unchanged)
    sure = np.broadcast_to((builder.roughest() < _ROUGHEST) & builder.estimated(), rows.shape)
    if not sure.any():
        return None
    if not sure.all():
        chosen = np.flatnonzero(sure)
        builder = Builder(scenes.take(chosen), zeros.take(chosen), order, unchanged)
    return Found(rows[sure], builder.both_sides())


def _edges(scenes: Scenes) -> FloatArray:
    """(-r, start, r), each moved to the nearest point of the layer [-1, 1]."""
    reach = np.minimum(scenes.r, 1.0)
    return np.array([-reach, np.clip(scenes.start, -reach, reach), reach])


def _value(c: Sequence[Numbers] | FloatArray, u: Numbers) -> Any:
    """The polynomial sum c_k u^k, by Horner."""
    total = c[-1]
    for row in c[-2::-1]:
        total = total * u + row
    return total


def clear_of_zero(scenes: Scenes, ends: bool = True) -> Any:
    """True where A is not too small at the start and at r, and at the layer's `ends`."""
    good = (scenes.a_minus != 0) & (scenes.a_plus != 0)
    for u in _edges(scenes):
        size = _value(np.abs(scenes.c), np.abs(u))
        clear = np.abs(_value(scenes.c, u)) > _NEAREST * size
        good &= clear if ends else clear | (np.abs(u) == 1)
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
    key_of_order: IntArray = (key * 8 + outside) * 2 + (scenes.c[-1] > 0)
    return key_of_order


def first(x: Numbers) -> Any:
    """The first entry of an array, or the number itself."""
    return x[0] if isinstance(x, np.ndarray) else x


def _log(x: Numbers) -> Any:
    """The principal logarithm, of real or complex numbers."""
    if isinstance(x, np.ndarray):
        return np.log(x)
    return cmath.log(x) if isinstance(x, complex) else math.log(x)


class Builder:
    """Scenes of one structure: every number is an array, or that of one scene alone."""

    arithmetic: Arithmetic = FLOATS

    def __init__(
        self, scenes: Scenes, zeros: Zeros, order: int, only: Callable[[Any], Any]
    ) -> None:
        self.count = order + 1 + BEYOND
        self.c = [only(c) for c in scenes.c]
        self.degree = len(self.c) - 1
        self.edges: Any = [only(u) for u in _edges(scenes)]
        self.a_minus, self.a_plus = only(scenes.a_minus), only(scenes.a_plus)
        self.start, self.beyond = only(scenes.start), bool(scenes.r[0] > 1)
        real = int(zeros.real[0]) if len(zeros.real) else 0
        self.lines = [only(zeros.values[k]) for k in range(real)]
        self.pairs = [only(z) for z in zeros.pairs]
        self.v = [-c / k for k, c in enumerate(self.c, start=1)]
        self.c_size = [abs(c) for c in self.c]
        self.height_size = _value([abs(v) for v in self.v], 1.0)
        self.rough = [self.roughness(z) for z in self.lines]
        self.rough_pairs = [self.roughness(z) for z in self.pairs]

    # -- rounding ---------------------------------------------------------------------------

    def others(self, z: Numbers) -> Iterator[Any]:
        """All zeros of A but z: real ones, and both of each complex pair."""
        for w in self.lines:
            if w is not z:
                yield w
        for w in self.pairs:
            if w is not z:
                yield w
            yield w.conjugate()

    def roughness(self, z: Numbers) -> Any:
        """The relative rounding bound of the zero z, in units of its distance to the next."""
        moved = _value(self.c_size, abs(z)) / abs(self.slope(z))
        near = 1 + abs(z)
        for w in self.others(z):
            near = lower(near, abs(z - w))
        return _EPS * (1 + moved / near)

    def roughest(self) -> Any:
        """The largest of these, infinite where one is undefined."""
        worst: Any = 0.0
        for rough in self.rough + self.rough_pairs:
            worst = higher(worst, rough)
        return np.where(np.isfinite(worst), worst, np.inf)

    def estimated(self) -> Any:
        """True where the next two terms of every series tell its error: A not straight or flat
        there.
        """
        order, good = self.count - 1 - BEYOND, True
        at = [(self.taylor(z), 2, 2 * order + 5) for z in self.lines]
        at += [(self.taylor(u), 1, order + 2) for u in self.edges]
        for row, low, high in at:
            if self.degree > high:
                near = sum(abs(c) for c in row[low : high + 1])
                good = good & (near > _FLAT * sum(abs(c) for c in row[high + 1 :]))
        return good

    # -- series -----------------------------------------------------------------------------

    def slope(self, z: Numbers) -> Any:
        """A'(z), by Horner."""
        total = self.degree * self.c[-1]
        for k in range(self.degree - 1, 0, -1):
            total = total * z + k * self.c[k]
        return total

    def taylor(self, u: Numbers) -> list[Any]:
        """Taylor coefficients of A at u, by synthetic division (Horner's shift)."""
        work = list(self.c)
        for lowest in range(self.degree):
            for k in range(self.degree - 1, lowest - 1, -1):
                work[k] = work[k] + work[k + 1] * u
        return work

    def smooth(self, u: Numbers, value: Numbers = None) -> Series:
        """h_k(u), k = 1, 2, ..., where A(u) may be known better than from float64."""
        psi = self.taylor(u)
        if value is not None:
            psi[0] = value
        psi = (psi + [0.0] * self.count)[: self.count]
        h = [row[0] for row in laurent(psi, False, self.count)]
        size = _value(self.c_size, abs(u)) * abs(h[0])
        return Series([Part(1.0, 0, trimmed(h))], _EPS * 4 * self.count * (1 + size))

    def flat(self, a: Numbers) -> Series:
        """h_1 = 1/phi beside a straight potential."""
        return Series([Part(1.0, 0, [1 / a])], ROUNDING)

    def peak(self, k: int) -> Series:
        """Laplace's series at the k-th real zero."""
        t = self.taylor(self.lines[k])
        a = abs(t[1]) / 2
        alpha = [t[j + 1] / ((j + 2) * t[1]) * 2 for j in range(1, self.degree)]
        terms = []
        for n in range(self.count):
            p, power = 2 * n + 1, [1.0 + 0 * a]
            for m in range(1, 2 * n + 1):
                total: Any = 0.0
                for j, x in enumerate(alpha[:m], start=1):
                    total = total + (p * j + 2 * (m - j)) * (x * power[m - j])
                power.append(total / (-2 * m))
            terms.append(power[-1] * (self.arithmetic.gamma(2 * n + 1, 2) * a ** -(n + 0.5)))
        # Higher coefficients depend on the zeros' distances by higher powers.
        rounding = 8 * (self.count + self.degree) * self.rough[k]
        known = majorants(t, self.count, self.arithmetic)
        return Series([Part(0.5, 0, terms)], rounding, majorants=known)

    # -- the regular part ---------------------------------------------------------------------

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Primitives of h_1, h_2, ... at each of the edges, and what is rounded in them."""
        totals, sizes = ([[0.0] * 3 for _ in range(self.count)] for _ in range(2))
        if self.degree == 0:
            totals[0] = [u / self.c[0] for u in self.edges]
            sizes[0] = [abs(total) * _EPS for total in totals[0]]
            return totals, sizes
        for z, rough in zip(self.lines + self.pairs, self.rough + self.rough_pairs, strict=True):
            single = not np.iscomplexobj(z)
            psi = (self.taylor(z) + [0.0] * 2 * self.count)[: 2 * self.count]
            known = list(laurent(psi, True, self.count))
            rounding = [rough * (6 + 4 * k) for k in range(self.count)]
            for side, u in enumerate(self.edges):
                t = u - z
                first = _log(abs(t) if single else t)
                for k, series in enumerate(known):
                    total = pole_primitive(series, k, t, first)
                    here = total if single else 2 * total.real
                    totals[k][side] = totals[k][side] + here
                    sizes[k][side] = sizes[k][side] + abs(total) * rounding[k]
        return totals, sizes

    # -- the two sides ----------------------------------------------------------------------

    def potential(self, u: Numbers) -> Any:
        """V(u), with V(0) = 0."""
        return _value(self.v, u) * u

    def both_sides(self) -> tuple[OneSided, OneSided]:
        """The one-sided expansions to the left, mirrored, and to the right of the start."""
        totals, sizes = self.primitives()
        middle = self.edges[1]
        outside = 0.0 * middle
        start = self.start
        if first(start) < -1:
            outside = (start + 1) * self.a_minus
        if first(start) > 1:
            outside = (start - 1) * self.a_plus
        # V from the start on.
        self.base = self.potential(middle) - outside
        # Horner's rounding at both points; products with lam are rounded elsewhere.
        self.height_rough = _EPS * ((self.degree + 3) * self.height_size + 2 * abs(outside))
        # The same numbers on both sides of a kink, whose first terms cancel.
        known = [self.a_minus if self.beyond else None, None, self.a_plus if self.beyond else None]
        if abs(first(start)) >= 1:
            known[1] = self.a_minus if first(start) < 0 else self.a_plus
        self.at_edge = [self.smooth(u, a) for u, a in zip(self.edges, known, strict=True)]
        peaks = {}
        low, _, high = self.edges
        for k, z in enumerate(self.lines):
            if first(low) < first(z) < first(high):
                peaks[k] = self.peak(k)
        left = self.side(-1, totals, sizes, peaks)
        right = self.side(1, totals, sizes, peaks)
        return left, right

    def side(
        self, sign: int, totals: list[Any], sizes: list[Any], peaks: dict[int, Series]
    ) -> OneSided:
        """The one-sided expansion right of the start, or, in the mirror, left of it."""
        a_near, a_far = self.a_minus, self.a_plus
        if sign < 0:
            a_near, a_far = -a_far, -a_near
        start = sign * self.start
        inside_of = 2 if sign > 0 else 0
        nothing = Series([])
        if first(start) >= 1:
            h = self.flat(a_far)
            return OneSided(
                *formal_series(h),
                True,
                [],
                [],
                nothing,
                (start, 0 * start, a_far),
                self.height_rough,
            )
        rising: list[CriticalPoint] = []
        falling: list[CriticalPoint] = []
        extra: Any = 0.0
        if first(start) < -1:
            h = self.flat(a_near)
            extra = (-1 - start) / a_near
            height = (1 + start) * a_near
            # The height there is -(length) phi, the layer's near edge.
            inner = _signed(self.at_edge[1], sign)
            add_edge(rising, falling, 0, height, h, inner)
        else:
            h = _signed(self.at_edge[1], sign)
        shares = [totals[k][inside_of] - totals[k][1] for k in range(self.count)]
        wrong = [sizes[k][inside_of] + sizes[k][1] for k in range(self.count)]
        shares[0] = shares[0] + extra
        wrong[0] = wrong[0] + abs(extra) * _EPS * 4
        outer = Series([Part(1.0, 0, trimmed(shares))], 1.0, wrong)
        rank = self.between(sign, rising, falling, peaks)
        beyond = self.end(sign, rank, rising, falling)
        return OneSided(*formal_series(h), True, rising, falling, outer, beyond, self.height_rough)

    def inside(self, sign: int) -> list[int]:
        """Numbers of the real zeros between the start and the layer's end, from the start on."""
        low, high = sorted((first(self.edges[1]), first(self.edges[1 + sign])))
        order = range(len(self.lines)) if sign > 0 else reversed(range(len(self.lines)))
        return [k for k in order if low < first(self.lines[k]) < high]

    def between(
        self,
        sign: int,
        rising: list[CriticalPoint],
        falling: list[CriticalPoint],
        peaks: dict[int, Series],
    ) -> int:
        """Add wells and barriers; returns the rank of what comes next."""
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            z = self.lines[k]
            height = self.potential(z) - self.base
            barrier = first(self.slope(z)) > 0
            points = rising if barrier else falling
            points.append(CriticalPoint(rank, height if barrier else -height, peaks[k], None))
        return len(inside) + 1

    def end(
        self, sign: int, rank: int, rising: list[CriticalPoint], falling: list[CriticalPoint]
    ) -> tuple[Any, Any, Any] | None:
        """Add the end of the layer, or r before it; returns what lies beyond."""
        height = self.potential(self.edges[1 + sign]) - self.base
        inner = _signed(self.at_edge[1 + sign], sign)
        if not self.beyond:
            add_edge(rising, falling, rank, height, inner, None)
            return None
        slope = self.a_plus if sign > 0 else -self.a_minus
        add_edge(rising, falling, rank, height, inner, self.flat(slope))
        return 1.0 + 0 * height, height, slope


def _signed(series: Series, sign: int) -> Series:
    """The series times `sign`, as h_k(u) becomes -h_k(-u) in the mirror."""
    if sign > 0:
        return series
    parts = [Part(p.offset, p.logs, [-c for c in p.coefficients]) for p in series.parts]
    return Series(parts, series.rounding, series.size)


__all__ = ["Builder", "Found", "clear_of_zero", "first", "found_of", "structure", "unchanged"]
