"""A coalescing pair, and a barrier before an end, at order 0 without cancellation.

**The pair** (Chester, Friedman, Ursell). phi = (y² - D) psi(y) about two neighbouring zeros; with
phi du = (s² - zeta) ds and u'(s) = a + b s, Z = lam^(2/3) zeta, the integrals over both zeros are,
up to their heights,

    int e^{±lam V} = pi (a Bi(Z) lam^(-1/3) ± b Bi'(Z) lam^(-2/3)),
    int int e^{lam (V(v) - V(u))}
        = pi² (a² (Ai² + Bi²)(Z) lam^(-2/3) - b² (Ai'² + Bi'²)(Z) lam^(-4/3))

(`symasym.special.airy`; DLMF 9.11.4), and the regular part is a finite part past both.

**The truncated Gaussian** (Bleistein). phi = x psi(x) from a barrier on, with an end at x = g. With
t²/2 = V(0) - V(g), peak = psi(0)^(-1/2), rest = 1/phi(g) - peak/t, the integrals from the end on
are

    int e^{lam V} = -(peak sigma + rest/lam),   int e^{-lam V} = peak D + rest/lam,

sigma and D the complementary error function and Dawson's integral, scaled (DLMF 7.2), each in
units of e^{±lam V(g)}. Near a well the peak is blended out, so that nothing is singular when pair
and end come together.

All is derived (`airy-form`, `pair-primitives`, `truncated-gaussian`), and what is imported here is
what the derivations emitted. What is singular at a coalescence is combined beforehand, so nothing
is subtracted there and one text serves float64 arrays and any number of digits. Each value comes
with the size of order 1. The functions of `EMITTED` are also what `symasym.emit` writes, in doubles
and in other languages: they hold numbers alone.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from symasym.generated.formulas import (
    canonical,
    end_distance,
    end_mean,
    end_peak,
    end_rest,
    even_share,
    even_share_on_line,
    odd_share,
    over_end,
    over_pair,
    over_pair_twice,
    pair_norm,
    pair_share,
)
from symasym.numbers.arithmetic import FLOATS, Arithmetic
from symasym.numbers.polynomials import poly, shifted
from symasym.series.quadratic_factor import Pair, mean_of_psi
from symasym.special.airy import AiryProducts, airy_products
from symasym.special.dawson import dawson, gaussians
from symasym.special.exponentials import quotients

__all__ = [
    "BLENDING", "EMITTED", "AiryForm", "AiryIntegral", "Truncated", "TruncatedIntegral",
    "airy_form", "regular_share", "truncated_gaussian",
]  # fmt: skip

#: An array over the scenes, or the number of one.
Number = Any

# Sizes of order 1 are found in float64.
_SIZES: Arithmetic = FLOATS
#: How fast the peak's share is blended out as a well comes near: any number would do for every
#: order; this is about the best for friction with mu = 3.
BLENDING = 8
# For the size of order 1, zeros closer than this (by the layer's width) are taken to be so far
# apart: it hardly depends on the distance there, and is not lost to rounding.
_APART = 0.03


# -- the closed forms ------------------------------------------------------------------------------


def _past_pair(
    c: Arithmetic, alpha: Number, beta: Number, square: Number, y: Number
) -> tuple[Number, Number]:
    """Both parts of a primitive of a pair's share past both zeros, y from the pair's middle."""
    alpha = c.where(y < 0, -alpha, alpha)
    far, root = abs(y), c.maximum(c.sqrt(abs(square)), c.tiny)
    gap = c.where(square > 0, far - root, far + root)
    real = even_share(c, alpha, root, far, gap)
    even = c.where(square > 0, real, even_share_on_line(c, alpha, root, far))
    return even, odd_share(c, beta, abs(y * y - square))


def _past_barrier(
    c: Arithmetic, alpha: Number, beta: Number, square: Number, gap: Number
) -> tuple[Number, Number]:
    """The same at y = root + gap, from the barrier on."""
    root = c.maximum(c.sqrt(c.maximum(square, c.zero)), c.tiny)
    y = root + gap
    return even_share(c, alpha, root, y, gap), odd_share(c, beta, gap * (y + root))


def blended(
    c: Arithmetic, drop: Number, gap: Number, area: Number
) -> tuple[Number, Number, Number]:
    """rho, and the shares of the barrier's order 0 and 1 that are blended out as a well comes near.

    `drop` is V from the barrier down to the well: as they meet, its own series breaks down.
    """
    rho = BLENDING * drop / (gap * gap * area)
    decay = c.exp(-rho)
    return rho, (1 + rho) * decay, (1 + rho + rho * rho / 2) * decay


def _before_end(
    c: Arithmetic,
    bottom: Number,
    gap: Number,
    area: Number,
    first: Number,
    second: Number,
    value: Number,
    weight: Number,
) -> tuple[Number, Number, Number]:
    """t, peak and rest of a barrier before an end: t^2/2 = gap^2 area, phi(end) = gap value."""
    whole = end_peak(c, bottom)
    t = end_distance(c, gap, area)
    mean = end_mean(c, bottom, area)
    rest = end_rest(c, bottom, gap, first, second, value, mean) + whole / t * weight
    apart = 1 / (gap * value) - whole * (1 - weight) / t
    return t, whole * (1 - weight), c.where(weight > 0.5, apart, rest)


#: The functions that are emitted as well.
EMITTED = (
    pair_norm, canonical, over_pair, over_pair_twice, pair_share, even_share, even_share_on_line,
    odd_share, _past_pair, _past_barrier, blended, end_peak, end_distance, end_mean, end_rest,
    _before_end, gaussians, over_end,
)  # fmt: skip


# -- from phi's coefficients -----------------------------------------------------------------------


class AiryForm(NamedTuple):
    """A well and a barrier, u' = a + b s + ..., with the sizes of order 1 of a and b.

    `rounding` is the rounding of `zeta`, which is as large beside the coalescence as anywhere.
    """

    key: int
    zeta: Number
    a: Number
    b: Number
    next_a: Number
    next_b: Number
    rounding: Number


class Truncated(NamedTuple):
    """A barrier near an end, u = 0 at the barrier and the end to its right.

    Attributes
    ----------
    t : sqrt(2 (V(barrier) - V(end)))
    peak : the barrier's leading coefficient
    rest : 1/phi(end) - peak/t, without its cancellation
    next_peak : order 1 of the barrier, relative to `peak`
    next_rest : order 1 of `rest`
    slope : phi beyond the end, or None where nothing is beyond
    """

    key: int
    t: Number
    peak: Number
    rest: Number
    next_peak: Number
    next_rest: Number
    slope: Number | None


def airy_form(key: int, pair: Pair, rounding: Number, arithmetic: Arithmetic) -> AiryForm:
    """The canonical form of a pair; `rounding` is the rounding of A there."""
    even, odd = _sums(pair)
    norm = pair_norm(arithmetic, even, odd, pair.square)
    a, b = canonical(arithmetic, pair.slope, even, pair.sign * odd, norm)
    moved = rounding / (pair.psi[0] * pair.slope**2)
    return AiryForm(key, pair.zeta, a, b, *_next_terms(arithmetic, pair), moved)


def regular_share(
    pair: Pair, taken: bool, arithmetic: Arithmetic
) -> Callable[[Number, Number | None], tuple[Number, Number]]:
    """The two parts of a primitive of the pair's share of 1/phi, a function of y and `gap`.

    Of a pair that is `taken` together the real part past both zeros, which has no jump; of another
    complex one along the real line. y counts from its middle, `gap` from the barrier, if known.
    """
    c, square, (even, odd) = arithmetic, pair.square, _sums(pair)
    alpha, beta = pair_share(c, pair.sign, even, odd, pair_norm(c, even, odd, square))

    def parts(y: Number, gap: Number | None) -> tuple[Number, Number]:
        if gap is not None:
            return _past_barrier(c, alpha, beta, square, gap)
        if taken:
            return _past_pair(c, alpha, beta, square, y)
        root = c.sqrt(-square)
        return even_share_on_line(c, alpha, root, y), odd_share(c, beta, y * y - square)

    return parts


def _sums(pair: Pair) -> tuple[Number, Number]:
    """The even and the odd terms of what is left of phi at a pair."""
    return poly(pair.psi[0::2], pair.square), poly(pair.psi[1::2], pair.square)


def _next_terms(c: Arithmetic, pair: Pair) -> tuple[Number, Number]:
    """a_1 and b_1 in float64, from the series at both zeros; only their size counts."""
    least, square, psi = _APART**2, c.size(pair.square), [c.size(x) for x in pair.psi]
    square = np.where(np.abs(square) < least, least, square)
    zeta = square * np.cbrt(mean_of_psi(psi, square)) ** 2
    half, root = np.sqrt(square + 0j), np.sqrt(zeta + 0j)
    slopes = [_series_at(psi, sign * half, sign * root) for sign in (1, -1)]
    b = (slopes[0][0] - slopes[1][0]) / (2 * root)
    one, two = (
        3 * w3 / (2 * sign * root) - (2 * w2 - b) / (4 * zeta)
        for sign, (_, w2, w3) in zip((1, -1), slopes, strict=True)
    )
    return (one + two).real / 2, ((one - two) / (2 * root)).real


def _series_at(psi: list[Any], y: Any, s: Any) -> tuple[Any, Any, Any]:
    """u(s) about a zero: the first three coefficients."""
    c = shifted([row + 0 * y for row in psi], y)
    c += [0 * y] * (3 - len(c))
    f1, f2, f3 = 2 * y * c[0], c[0] + 2 * y * c[1], c[1] + 2 * y * c[2]
    w1 = np.sqrt(2 * s / f1)
    # The branch that is positive where both zeros coalesce.
    w1 = np.where(w1.real < 0, -w1, w1)
    w2 = (1 / 3 - f2 * w1**3 / 3) / (f1 * w1)
    w3 = -(f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4) / (f1 * w1)
    return w1, w2, w3


def truncated_gaussian(
    key: int,
    psi: list[Number],
    gap: Number,
    drop: Number | None,
    ratio: Number,
    slope: Number | None,
    arithmetic: Arithmetic,
) -> Truncated:
    """The barrier's truncated Gaussian for phi = x psi(x), with the end at x = gap.

    `drop` is V from the barrier down to the well before it, `ratio` the next term of the barrier's
    own series.
    """
    c = arithmetic
    weight: Any = c.zero
    weight_next: Any = c.zero
    area = _area(psi, gap)
    if drop is not None:
        rho, weight, weight_next = blended(c, drop, gap, area)
        ratio = c.where(rho > 1e-6, ratio, c.zero)
    bottom = c.maximum(psi[0], c.eps**6)
    value = poly(psi, gap)
    first = poly([2 * a / (k + 3) for k, a in enumerate(psi[1:])], gap)
    second = poly(psi[1:], gap)
    t, peak, rest = _before_end(c, bottom, gap, area, first, second, value, weight)
    # Order 1 hardly depends on where the end is, close to the barrier.
    near, psi = _SIZES, [c.size(a) for a in psi]
    far = near.maximum(c.size(gap), _APART)
    t_far = far * near.sqrt(2 * _area(psi, far))
    value = far * poly(psi, far)
    bend = poly([(k + 1) * x for k, x in enumerate(psi)], far)
    next_peak = c.size(ratio) * (1 - c.size(weight_next))
    next_rest = -bend / value**3 - next_peak / near.sqrt(c.size(bottom)) / t_far
    next_rest = next_rest + c.size(peak) / t_far**3
    return Truncated(key, t, peak, rest, next_peak, abs(next_rest), slope)


def _area(psi: list[Number], x: Number) -> Number:
    """int_0^1 y psi(x y) dy: V falls by x² times that."""
    return poly([a / (k + 2) for k, a in enumerate(psi)], x)


# -- at one lam, or many ---------------------------------------------------------------------------


class AiryIntegral(NamedTuple):
    """One of 'scale', 'speed' and 'both'; heights are left out."""

    form: AiryForm
    part: str

    def at(self, point: Any) -> tuple[Number, Number]:
        """The value and the size of order 1 at the point's lam (None without its errors)."""
        both = self.part == "both"
        key = self.form.key, both
        if key not in point.known:
            point.known[key] = _double(self.form, point) if both else _single(self.form, point)
        value: tuple[Number, Number] = point.known[key][self.part]
        return value


def _airy(f: AiryForm, point: Any, single: bool) -> tuple[Number, AiryProducts]:
    """Airy's argument and the products that the single or the double integrals need."""
    key = f.key, "airy"
    if key not in point.known:
        z = point.third * point.third * f.zeta
        products = airy_products(
            z, point.arithmetic, single or point.errors, point.errors or not single
        )
        if not point.errors:
            return z, products
        point.known[key] = z, products
    known: tuple[Number, AiryProducts] = point.known[key]
    return known


def _single(f: AiryForm, point: Any) -> dict[str, tuple[Number, Number]]:
    """int e^{lam V} and int e^{-lam V}."""
    c, third = point.arithmetic, point.third
    z, airy = _airy(f, point, True)
    up, down = over_pair(c, f.a, 1 / third, f.b, airy.bi, airy.bi_slope)
    if not point.errors:
        return {"scale": (up, None), "speed": (down, None)}
    f, airy, (z, third, x) = _sizes(f, airy, z, point)
    c, small = _SIZES, 1 / third
    bi, slope = airy.bi * (c.pi * small), airy.bi_slope * (c.pi * small * small)
    wrong = abs(f.next_a) * x * abs(bi) + abs(f.next_b) * x * abs(slope)
    # Off the real line a pair leaves both integrals to the start and the ends, the further the
    # more; but those have it in no order of their series.
    size = abs(f.a) * c.sqrt(airy.squares) + abs(f.b) * small * c.sqrt(airy.slopes)
    lost = third * third * f.rounding * (1 + c.sqrt(abs(z)))
    wrong = wrong + c.pi * small * size * (lost - c.expm1(c.minimum(z, c.zero)))
    return {"scale": (up, wrong), "speed": (down, wrong)}


def _double(f: AiryForm, point: Any) -> dict[str, tuple[Number, Number]]:
    """The double integral over both."""
    c, third = point.arithmetic, point.third
    z, airy = _airy(f, point, False)
    both = over_pair_twice(c, f.a, 1 / third, f.b, airy.squares, airy.slopes)
    if not point.errors:
        return {"both": (both, None)}
    size = c.size(both)
    f, airy, (z, third, x) = _sizes(f, airy, z, point)
    c, small = _SIZES, 1 / third
    squares, slopes, unit = airy.squares, airy.slopes * (small * small), (c.pi * small) ** 2
    next_a, next_b = abs(f.next_a) * x, abs(f.next_b) * x
    # Order 1 has the cross term alone, which may vanish; its parts do not.
    cross = abs(airy.cross) * small
    missed = 2 * (abs(f.a) * next_b + next_a * abs(f.b)) * cross
    missed = missed + next_a * next_a * squares + next_b * next_b * slopes
    # log(Ai² + Bi²) has a slope of 2 sqrt(Z) above, and of 1/(2 Z) below.
    slope = c.where(z > 0, 2 * c.sqrt(c.maximum(z, c.zero)) + 1, 1 / (1 + abs(z)))
    lost = third * third * f.rounding * slope
    return {"both": (both, unit * missed + lost * size)}


def _sizes(
    f: AiryForm, airy: AiryProducts, z: Number, point: Any
) -> tuple[AiryForm, AiryProducts, tuple[Number, ...]]:
    """The factors of the errors, in float64: with Airy's argument, lam^(1/3) and 1/lam."""
    size = point.arithmetic.size
    form = AiryForm(f.key, *map(size, f[1:]))
    return form, AiryProducts(*map(size, airy)), tuple(map(size, (z, point.third, point.x)))


class TruncatedIntegral(NamedTuple):
    """One of 'scale', 'speed', 'onward' and 'both' at the end; heights are left out."""

    gaussian: Truncated
    part: str

    def at(self, point: Any) -> tuple[Number, Number]:
        """The value and the size of order 1 at the point's lam (None without its errors)."""
        key = self.gaussian.key
        if key not in point.known:
            point.known[key] = _truncated(self.gaussian, point)
        value: tuple[Number, Number] = point.known[key][self.part]
        return value


def _truncated(e: Truncated, point: Any) -> dict[str, tuple[Number, Number]]:
    """All four; what lies beyond the end is included."""
    c, lam, x = point.arithmetic, point.lam, point.x
    near = dawson(e.t * c.sqrt(lam / 2), c)
    sigma, d, area = gaussians(c, lam, *near)
    tail, slow = e.peak * sigma, e.peak * d
    scale, speed, both = over_end(c, lam, e.t, e.peak, e.rest, sigma, d, area)
    straight = beyond = c.zero
    if e.slope is not None:
        # int_1^r e^{-lam slope (u - 1)} du, and the double integral beyond the end.
        length = point.r - 1
        straight, beyond = quotients(-lam * e.slope * length, c)
        straight, beyond = length * straight, length * length * beyond
    scale, both = scale + straight, both + beyond
    rest = e.rest * x
    values = {"scale": scale, "speed": speed, "onward": straight, "both": both}
    if not point.errors:
        return {part: (value, None) for part, value in values.items()}
    x, tail, slow, rest = (c.size(y) for y in (x, tail, slow, rest))
    wrong, miss = abs(e.next_peak) * x, abs(e.next_rest) * x * x
    errors = {
        "scale": tail * wrong + miss,
        "speed": slow * wrong + miss,
        "onward": 0.0,
        "both": rest * rest / 2 + slow * (wrong * abs(rest) + miss),
    }
    return {part: (value, errors[part]) for part, value in values.items()}
