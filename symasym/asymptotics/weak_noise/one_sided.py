"""The one-sided expansions of the integrals of e^{±lam V} from a start on, over an arithmetic.

Each is a sum over critical points: the maxima of the exponent, with Laplace's series by Watson's
lemma (`inverse_coefficients` of du/ds, moments by `gaussian`); the start and the end, with
the formal series of an endpoint, whatever the sign of the slope there; and the kinks u = -1 and 1,
with the difference of that series' two sides, since A's derivatives jump. Where the exponent has a
minimum nothing is added: the exponentials that the two sides of the formal series differ by there
are those of the maxima.

Both sides of the start are made at once, the left one as it is seen in the mirror, where h_k(u)
(`symasym.asymptotics.weak_noise.regular_part`) becomes -h_k(-u), and a well or a barrier stays what
it is. Numbers are an array over polynomial drifts whose zeros, starts and radii come in the same
order, or the float of one of them (`Builder`), or mpf, and then of any drift
(`symasym.asymptotics.weak_noise.critical_points`).
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Iterator
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.regular_part import Pole, pole_sums
from symasym.asymptotics.weak_noise.series import (
    BEYOND,
    FURTHER,
    ROUNDING,
    Local,
    Majorants,
    Numbers,
    Part,
    Series,
    higher,
    lower,
    plus,
    times,
    trimmed,
)
from symasym.base.inputs import FloatArray, IntArray
from symasym.generated.formulas import (
    bend_of_saddle,
    endpoint_shares,
    first_moment,
    kink_change,
    next_moment,
)
from symasym.numbers.arithmetic import FLOATS, Arithmetic, Number
from symasym.numbers.polynomials import Zeros, laurent, poly, poly_slope, power, shifted

_EPS = 2.3e-16
# A's first derivatives beside the later ones, below which they are taken to vanish.
_FLAT = 1e-8


class CriticalPoint(NamedTuple):
    """e^{lam height} times a series; `rank` tells the order from the start on.

    `onward` is, at a kink of e^{lam V}, the endpoint series of the integral to its right alone.
    """

    rank: Any
    height: Numbers
    series: Any  # Series | Local
    onward: Any  # Series | Local | None
    kind: str = ""
    u: Any = None


class PairContribution(NamedTuple):
    """Replaces the product of the contributions at two ranks, `speed` and `scale`."""

    speed: Any
    scale: Any
    height: Numbers
    local: Local | None


class OneSided(NamedTuple):
    """Series of one side of the start, in the direction away from it; without the end if r > 1.

    Attributes
    ----------
    scale_start, speed_start : Series
        Of e^{lam V} and of e^{-lam V} to the right of the start, V measured from it.
    endpoint_product : bool
        Whether their product is part of the double integral, which at a barrier the regular part
        has already.
    scale_points, speed_points : list of CriticalPoint
        Beyond the start, of e^{lam V} and of e^{-lam V}; heights are those of the exponent.
    regular_part : Series
        The regular part (`symasym.asymptotics.weak_noise.regular_part`), in the layer.
    beyond : tuple or None
        (u, V(u), phi) where the straight part beyond the layer begins, which ends at r.
    height_rounding : rounding of every height, 0 where digits are to spare
    coalescing : contributions of pairs of critical points that may coalesce
    exponential_gap : what that costs, e^{-lam exponential_gap} of the value
    """

    scale_start: Series
    speed_start: Series
    endpoint_product: bool
    scale_points: list[CriticalPoint]
    speed_points: list[CriticalPoint]
    regular_part: Series
    beyond: tuple[Any, Any, Any] | None
    height_rounding: Numbers = 0.0
    coalescing: list[PairContribution] = []
    exponential_gap: Numbers = np.inf

    def all_series(self) -> list[Series]:
        """Every power series of this side."""
        points = self.scale_points + self.speed_points
        every = [self.scale_start, self.speed_start, self.regular_part]
        every += [x for p in points for x in (p.series, p.onward) if isinstance(x, Series)]
        if self.beyond is not None:
            every.append(Series([Part(1.0, 0, [1 / self.beyond[2]])]))
        return every


def formal_series(h: Series) -> tuple[Series, Series]:
    """The formal series of int e^{lam V} and int e^{-lam V} to the right of a point.

    From h_k there (`symasym.asymptotics.weak_noise.regular_part`), by repeated integration by
    parts: sigma_{k+1} = sigma_k'/phi for the one, so that its coefficients are (-1)^(k+1) h_k,
    and -h_k for the other.
    """
    shares = [endpoint_shares(1 if k % 2 else -1, c) for k, c in enumerate(_row(h))]
    scale, speed = (
        Series([Part(1.0, 0, list(row), h.majorants)] if row else [], h.rounding)
        for row in (zip(*shares, strict=True) if shares else ((), ()))
    )
    return scale, speed


def _row(series: Series) -> list[Numbers]:
    """The coefficients of h_1, h_2, ... in a series of one part."""
    return series.parts[0].coefficients if series.parts else []


def add_edge(
    scale_points: list[CriticalPoint],
    speed_points: list[CriticalPoint],
    rank: int,
    height: Numbers,
    left: Series,
    right: Series | None,
    kind: str = "",
    u: Number = None,
) -> None:
    """Add the contributions of a kink, or of the end where nothing is to the `right`.

    They are the difference of the formal series of its two sides, from h_k on either.
    """
    first, second = _row(left), [] if right is None else _row(right)
    width = max(len(first), len(second))
    first, second = (row + [0.0] * (width - len(row)) for row in (first, second))
    change = trimmed([kink_change(x, y) for x, y in zip(first, second, strict=True)])
    # phi goes on without a jump, so that the first terms of both sides cancel, exactly.
    if right is not None and change:
        change[0] = 0.0
    rounding, known = left.rounding, left.majorants
    if right is not None:
        # One side of a kink is straight, where no term follows.
        rounding, known = higher(rounding, right.rounding), known or right.majorants
    changed = Series([Part(1.0, 0, change, known)] if change else [], rounding)
    changes = formal_series(changed)
    onward = None if right is None else formal_series(right)[0]
    scale_points.append(CriticalPoint(rank, height, changes[0], onward, kind, u))
    speed_points.append(CriticalPoint(rank, -height, changes[1], None, kind, u))


def mirrored(series: Series, sign: int) -> Series:
    """The series times `sign`, as h_k(u) becomes -h_k(-u) in the mirror."""
    if sign > 0:
        return series
    parts = [p._replace(coefficients=[-c for c in p.coefficients]) for p in series.parts]
    return series._replace(parts=parts)


def endpoint_coefficients(taylor: list[Any], count: int) -> list[Any]:
    """h_1, ..., h_count at a point where phi has these Taylor coefficients."""
    taylor = (taylor + [0.0] * count)[:count]
    return [row[0] for row in laurent(taylor, False, count)]


def inverse_coefficients(taylor: list[Any], count: int, step: int, one: Number) -> list[Any]:
    """a_0, a_step, ... below a_count of du = (a_0 + a_1 s + ...) ds, V - V(z) = ±s²/2 inverted.

    z is a simple zero of phi with these Taylor coefficients; a_i is the i-th coefficient of
    (1 + alpha_1 t + ...)^(-(i + 1)/2) over |phi'(z)|^((i + 1)/2), Perron's formula
    (`symasym.asymptotics.laplace.watson`), with V - V(z) = -phi'(z) t²/2 (1 + alpha_1 t + ...).
    """
    slope = taylor[1]
    bends = enumerate(taylor[2 : count + 1], start=1)
    alpha = [1, *(bend_of_saddle(j, c, slope) for j, c in bends)]
    front = abs(slope) ** -0.5
    square, inverse = front**2, []
    for i in range(0, count, step):
        inverse.append(power(alpha, -(i + 1), 2, i + 1, one)[i] * front)
        front = front * (square if step == 2 else abs(slope) ** -0.5)
    return inverse


def endpoint_majorants(taylor: list[Numbers], count: int) -> Majorants:
    """M_n for n <= `count` and L_n of the h_{n+1} where phi has these Taylor coefficients.

    With |phi_0| and -|phi_j| for phi_0 and phi_j all products in h_{n+1} have the same sign: M_n.
    With d_j = phi_j/phi_0 the terms of first and second order in the d_j of h_{n+1} =
    (-1/phi d/du)^n (1/phi) are no larger than

        L_n = n! |phi_0|^-(n + 1) (|d_n| + (n + 1) sum |d_i d_j|/(i + 1)),   i + j = n.
    """
    sizes = [abs(c) for c in taylor]
    straight = [sizes[0], *(-c for c in sizes[1:])]
    full = [abs(h) for h in endpoint_coefficients(straight, count + 1)]
    front = 1 / sizes[0]
    d, later = [c * front for c in sizes], [front]
    for n in range(1, count + FURTHER + 1):
        felt: Numbers = d[n] if n < len(d) else 0.0
        for i in range(max(1, n + 1 - len(d)), (n + 1) // 2):
            felt = felt + d[i] * d[n - i] * ((n + 1) / (i + 1) + (n + 1) / (n - i + 1))
        if n % 2 == 0 and n // 2 < len(d):
            felt = felt + d[n // 2] ** 2 * ((n + 1) / (n // 2 + 1))
        front = front * (n / sizes[0])
        later.append(times(front, felt))
    return Majorants(full, later)


def regular_majorants(ends: list[Majorants | None], length: Numbers) -> Majorants | None:
    """M_n and L_n of the finite part of int h_{n+1}, from those of h_{n+1} at both ends.

    Since h_{n+1} = (d/dV)^n h_1 and dV = -du/h_1, integration by parts leaves at each end products
    h_{i+1} h_{j+1}, i + j = n - 1, each pair once, and for an even n an integral of the square of
    the one in the middle. On a short way both ends' cancel: it is no more than its `length` allows.
    """
    known = [end for end in ends if end is not None]
    rows = []
    for of_ends in zip(*known, strict=True):
        row = [reduce(plus, x) for x in zip(*map(_squared, of_ends), strict=True)]
        if len(known) == 2:
            row = [lower(x, length * (a + b)) for x, a, b in zip(row, *of_ends, strict=True)]
        rows.append(row)
    return Majorants(*rows) if rows else None


def _squared(row: list[Numbers]) -> list[Numbers]:
    """0 and half the coefficients of the square of a power series."""
    half: list[Numbers] = [0.0]
    for n in range(len(row) - 1):
        total = row[n // 2] ** 2 / 2 if n % 2 == 0 else 0.0
        for i in range((n + 1) // 2):
            total = plus(total, times(row[i], row[n - i]))
        half.append(total)
    return half


def majorants(taylor: list[Numbers], count: int, arithmetic: Arithmetic, odd: int = 0) -> Majorants:
    """M_n for n <= `count` and L_n of a zero of A with the Taylor coefficients `taylor` of A.

    With V - V(u) = +-a t^2 (1 + alpha_1 t + alpha_2 t^2 + ...), the coefficient of lam^-(n + 1/2)
    is Gamma(n + 1/2) a^-(n + 1/2) [t^2n] (1 + sum alpha_j t^j)^-(n + 1/2) (Perron's formula). With
    -|alpha_j| for alpha_j all its products are positive: M_n, which bounds its size (Cauchy's
    method of majorants) and vanishes only where each product does. Where the next two terms behind
    the N-th, which are known, nearly vanish, M_{N+3} tells what may follow.

    An alpha_j that is first felt in a later term is felt there by

        L_n = a^-(n + 1/2) (Gamma(n + 3/2) |alpha_2n| + Gamma(n + 5/2)/2 sum |alpha_i alpha_j|),

    i + j = 2n: the terms of first and second order in the alpha_j.

    With `odd` = 1 those of what half of the Gaussian has besides half of that, 2n + 1 in place of
    2n: half of Gamma(n + 1) a^-(n + 1) [t^(2n + 1)] (1 + sum alpha_j t^j)^-(n + 1), and so on.
    """
    slope = abs(taylor[1])
    a = slope / 2
    alpha = [bend_of_saddle(j, abs(c), slope) for j, c in enumerate(taylor[2:], start=1)]
    negative = [1, *(-x for x in alpha)]
    full, later, inverse = [], [], 1 / a
    front = a / 2 / a if odd else a**-0.5 * a
    for n in range(max(count, len(alpha)) + 1):
        top, front = 2 * n + odd, front * inverse
        if n <= count:
            positive = power(negative, -(top + 1), 2, top + 1, arithmetic.one)[top]
            full.append(front * arithmetic.gamma(top + 1, 2) * positive)
        pairs: Numbers = 0 * a
        for i in range(max(1, top - len(alpha)), min(len(alpha), top - 1) + 1):
            pairs = pairs + alpha[i - 1] * alpha[top - i - 1]
        felt = arithmetic.gamma(top + 5, 2) / 2 * pairs
        if 0 < top <= len(alpha):
            felt = felt + arithmetic.gamma(top + 3, 2) * alpha[top - 1]
        later.append(front * felt)
    return Majorants(full, later)


def _log(x: Numbers) -> Any:
    """The principal logarithm, of real or complex numbers."""
    if isinstance(x, np.ndarray):
        return np.log(x)
    return cmath.log(x) if isinstance(x, complex) else math.log(x)


def first(x: Numbers) -> Any:
    """The first entry of an array, or the number itself."""
    return x[0] if isinstance(x, np.ndarray) else x


class PolynomialScenes(NamedTuple):
    """Polynomial drifts with starts and radii, float64; coefficients of A in ascending rows."""

    c: FloatArray
    a_minus: FloatArray
    a_plus: FloatArray
    start: FloatArray
    r: FloatArray

    def take(self, rows: slice | IntArray) -> PolynomialScenes:
        """Some of the scenes."""
        return PolynomialScenes(self.c[:, rows], *(x[rows] for x in self[1:]))


def edges_of(scenes: PolynomialScenes) -> FloatArray:
    """(-r, start, r), each moved to the nearest point of the layer [-1, 1]."""
    reach = np.minimum(scenes.r, 1.0)
    return np.array([-reach, np.clip(scenes.start, -reach, reach), reach])


class Builder:
    """Both one-sided expansions, to order `count` - 1 in 1/lam with those that tell the error.

    What is asked of the drift is `taylor`, `barrier`, `potential` and `regular_part`; here A is a
    polynomial whose zeros are known, in float64, with a bound of the rounding of each number.

    Attributes
    ----------
    edges : list
        -r, the start and r, each moved to the nearest point of the layer [-1, 1].
    zeros : list
        The real zeros of A, ascending; `pairs` are the others above the real axis.
    beyond : bool
        Whether r > 1, so that a straight part of the potential follows the layer.
    """

    arithmetic: Arithmetic = FLOATS
    #: The rounding of one operation; 0 where digits are to spare.
    eps = _EPS
    #: The rounding of h_1 beside a straight potential.
    least: Numbers = ROUNDING

    def __init__(
        self, scenes: PolynomialScenes, zeros: Zeros, order: int, plain: bool = False
    ) -> None:
        def only(x: Numbers) -> Any:
            """The array, or where `plain` the number in one of one: Python is quicker with it."""
            return x[..., 0].tolist() if plain else x

        self.count = order + 1 + BEYOND
        self.c = [only(c) for c in scenes.c]
        self.degree = len(self.c) - 1
        self.edges: Any = [only(u) for u in edges_of(scenes)]
        self.a_minus, self.a_plus = only(scenes.a_minus), only(scenes.a_plus)
        self.start, self.beyond = only(scenes.start), bool(scenes.r[0] > 1)
        real = int(zeros.real[0]) if len(zeros.real) else 0
        self.zeros = [only(zeros.values[k]) for k in range(real)]
        self.pairs = [only(z) for z in zeros.pairs]
        self.v = [-c / k for k, c in enumerate(self.c, start=1)]
        self.c_size = [abs(c) for c in self.c]
        self.height_size = sum(abs(v) for v in self.v)
        self.zero_rounding = [self.rounding_of(z) for z in self.zeros]
        self.pair_rounding = [self.rounding_of(z) for z in self.pairs]

    # -- rounding ---------------------------------------------------------------------------

    def rounding_of(self, z: Numbers) -> Any:
        """The relative rounding bound of the zero z, in units of its distance to the next."""
        moved = poly(self.c_size, abs(z)) / abs(self.slope(z))
        near = 1 + abs(z)
        for w in self.others(z):
            near = lower(near, abs(z - w))
        return _EPS * (1 + moved / near)

    def others(self, z: Numbers) -> Iterator[Any]:
        """All zeros of A but z: real ones, and both of each complex pair."""
        for w in self.zeros:
            if w is not z:
                yield w
        for w in self.pairs:
            if w is not z:
                yield w
            yield w.conjugate()

    def largest_rounding(self) -> Any:
        """The largest of these, infinite where one is undefined."""
        worst: Any = 0.0
        for rounding in self.zero_rounding + self.pair_rounding:
            worst = higher(worst, rounding)
        return np.where(np.isfinite(worst), worst, np.inf)

    def estimated(self) -> Any:
        """True where the next two terms of every series tell its error: A not straight or flat."""
        order, good = self.count - 1 - BEYOND, True
        at = [(z, 2, 2 * order + 5) for z in self.zeros] + [(u, 1, order + 2) for u in self.edges]
        for u, low, high in at:
            if self.degree > high:
                row = self.taylor(u)
                near = sum(abs(c) for c in row[low : high + 1])
                good = good & (near > _FLAT * sum(abs(c) for c in row[high + 1 :]))
        return good

    # -- the drift --------------------------------------------------------------------------

    def slope(self, z: Numbers) -> Any:
        """A'(z)."""
        return poly_slope(self.c, z)

    def taylor(self, u: Numbers) -> list[Any]:
        """Taylor coefficients of A at u."""
        return shifted(self.c, u)

    def potential(self, u: Numbers) -> Any:
        """V(u) in the layer, up to a constant."""
        return poly(self.v, u) * u

    def barrier(self, k: int) -> bool:
        """True if the k-th real zero is a barrier, False for a well."""
        return bool(first(self.slope(self.zeros[k])) > 0)

    def inside(self, sign: int) -> list[int]:
        """Numbers of the real zeros between the start and the layer's end, from the start on."""
        low, high = sorted((first(self.edges[1]), first(self.edges[1 + sign])))
        order = range(len(self.zeros)) if sign > 0 else reversed(range(len(self.zeros)))
        return [k for k in order if low < first(self.zeros[k]) < high]

    # -- series -----------------------------------------------------------------------------

    def smooth(self, u: Numbers, value: Numbers = None) -> Series:
        """h_k(u), k = 1, 2, ..., where A(u) may be known better than from float64."""
        psi = self.taylor(u)
        if value is not None:
            psi[0] = value
        h = endpoint_coefficients(psi, self.count)
        size = poly(self.c_size, abs(u)) * abs(h[0])
        known = endpoint_majorants(psi, self.count)
        return Series([Part(1.0, 0, trimmed(h), known)], _EPS * 4 * self.count * (1 + size))

    def flat(self, a: Numbers) -> Series:
        """h_1 = 1/phi beside a straight potential."""
        return Series([Part(1.0, 0, [1 / a])], self.least)

    def saddle(self, k: int) -> Series:
        """Laplace's series at the k-th real zero."""
        taylor = self.taylor(self.zeros[k])
        inverse = inverse_coefficients(taylor, 2 * self.count, 2, self.arithmetic.one)
        # Higher coefficients depend on the zeros' distances by higher powers.
        return self.gaussian(
            inverse, taylor, 8 * (self.count + self.degree) * self.zero_rounding[k]
        )

    def gaussian(self, inverse: list[Any], taylor: list[Any], rounding: Numbers) -> Series:
        """int e^{-lam |V - V(z)|} du, terms a_2n (2n - 1)!! (2 pi)^(1/2) lam^-(n + 1/2).

        (Watson's lemma for the even coefficients, DLMF 2.4(iv).)
        """
        terms, moment = [], first_moment(self.arithmetic)
        for n, a in enumerate(inverse):
            terms.append(a * moment)
            moment = next_moment(n, moment)
        known = majorants(taylor, self.count, self.arithmetic)
        return Series([Part(0.5, 0, trimmed(terms), known)], rounding)

    def poles(self) -> Iterator[Pole]:
        """The zeros of A, of a complex pair one."""
        for z, rounding in zip(self.zeros, self.zero_rounding, strict=True):
            yield Pole(z, self.taylor(z), 1, rounding)
        for z, rounding in zip(self.pairs, self.pair_rounding, strict=True):
            yield Pole(z, self.taylor(z), 2, rounding)

    def primitives(self) -> tuple[list[Any], list[Any]]:
        """Primitives of h_1, h_2, ... at each of the edges, and what is rounded in them."""
        if self.degree:
            return pole_sums(self.poles(), self.edges, self.count, _log)
        totals, sizes = ([[0.0] * 3 for _ in range(self.count)] for _ in range(2))
        totals[0] = [u / self.c[0] for u in self.edges]
        sizes[0] = [abs(total) * self.eps for total in totals[0]]
        return totals, sizes

    def regular_part(self, sign: int, extra: Numbers) -> Series:
        """The regular part of one side, with what is `extra` before the layer."""
        totals, sizes = self.regular
        shares = [row[1 + sign] - row[1] for row in totals]
        wrong = [row[1 + sign] + row[1] for row in sizes]
        shares[0] = shares[0] + extra
        wrong[0] = wrong[0] + abs(extra) * self.eps * 4
        return Series([Part(1.0, 0, trimmed(shares), self.behind_regular(sign))], 1.0, wrong)

    def behind_regular(self, sign: int) -> Majorants | None:
        """Majorants of the regular part of one side."""
        length = self.arithmetic.number(abs(self.edges[1 + sign] - self.edges[1]))
        return regular_majorants([self.at_edge[k].majorants for k in (1, 1 + sign)], length)

    # -- the two sides ----------------------------------------------------------------------

    def both_sides(self) -> tuple[OneSided, OneSided]:
        """The one-sided expansions to the left, mirrored, and to the right of the start."""
        self.regular = self.primitives()
        start = self.start
        outside = 0.0 * start
        if first(start) < -1:
            outside = (start + 1) * self.a_minus
        if first(start) > 1:
            outside = (start - 1) * self.a_plus
        self.base = self.origin(outside)
        # Horner's rounding at both points; products with lam are rounded elsewhere.
        rounding = (self.degree + 3) * self.height_size + 2 * abs(outside)
        self.height_rounding = _EPS * rounding if self.arithmetic.context is None else 0.0
        # The same numbers on both sides of a kink, whose first terms cancel.
        known = [self.a_minus if self.beyond else None, None, self.a_plus if self.beyond else None]
        if abs(first(start)) >= 1:
            known[1] = self.a_minus if first(start) < 0 else self.a_plus
        self.at_edge = [self.smooth(u, a) for u, a in zip(self.edges, known, strict=True)]
        return self.side(-1), self.side(1)

    def origin(self, outside: Numbers) -> Any:
        """V at the start, `outside` less than where the layer begins."""
        return self.potential(self.edges[1]) - outside

    def side(self, sign: int) -> OneSided:
        """The one-sided expansion right of the start, or, in the mirror, left of it."""
        near, far = self.a_minus, self.a_plus
        if sign < 0:
            near, far = -far, -near
        start = sign * self.start
        if first(start) >= 1:
            own, line = formal_series(self.flat(far)), (start, 0 * start, far)
            return OneSided(*own, True, [], [], Series([]), line, self.height_rounding)
        scale_points: list[CriticalPoint] = []
        speed_points: list[CriticalPoint] = []
        extra: Any = 0.0
        if first(start) < -1:
            h, inner = self.flat(near), mirrored(self.at_edge[1], sign)
            extra = (-1 - start) / near
            # V at the layer's near edge.
            height = (1 + start) * near
            add_edge(scale_points, speed_points, 0, height, h, inner, "kink", -1 + 0 * start)
            begin = *formal_series(h), True
        else:
            begin = self.beginning(sign)
        regular_part = self.regular_part(sign, extra)
        rank = self.between(sign, scale_points, speed_points)
        beyond = self.end(sign, rank, scale_points, speed_points)
        return OneSided(
            *begin, scale_points, speed_points, regular_part, beyond, self.height_rounding
        )

    def beginning(self, sign: int) -> tuple[Series, Series, bool]:
        """The series of a start in the layer, and whether their product is part of D."""
        return *formal_series(mirrored(self.at_edge[1], sign)), True

    def between(
        self, sign: int, scale_points: list[CriticalPoint], speed_points: list[CriticalPoint]
    ) -> int:
        """Add wells and barriers; returns the rank of what comes next."""
        inside = self.inside(sign)
        for rank, k in enumerate(inside, start=1):
            height = self.potential(self.zeros[k]) - self.base
            barrier, u = self.barrier(k), sign * self.zeros[k]
            points, kind = (scale_points, "barrier") if barrier else (speed_points, "well")
            height = height if barrier else -height
            points.append(CriticalPoint(rank, height, self.saddle(k), None, kind, u))
        return len(inside) + 1

    def end(
        self,
        sign: int,
        rank: int,
        scale_points: list[CriticalPoint],
        speed_points: list[CriticalPoint],
    ) -> tuple[Any, Any, Any] | None:
        """Add the end of the layer, or r before it; returns what lies beyond."""
        edge = self.edges[1 + sign]
        height, inner = self.potential(edge) - self.base, mirrored(self.at_edge[1 + sign], sign)
        u = sign * self.arithmetic.number(edge)
        if not self.beyond:
            add_edge(scale_points, speed_points, rank, height, inner, None, "end", u)
            return None
        slope = self.a_plus if sign > 0 else -self.a_minus
        add_edge(scale_points, speed_points, rank, height, inner, self.flat(slope), "kink", u)
        return 1.0 + 0 * height, height, slope
