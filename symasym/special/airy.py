"""Products of Airy functions, and two coalescing critical points in closed form.

Ai² + Bi², Ai Ai' + Bi Bi', Ai'² + Bi'², Bi and Bi' (DLMF 9.2, 9.8), each with its exponential
taken out where Z > 0. Arrays take them from tables (`symasym.special.tables`) in Z, and in
1/|Z|^(3/2) beyond those; an mpf takes the power series of DLMF 9.4 in integers of fixed point, as
long as they converge faster than the asymptotic ones (DLMF 9.7(ii)) are good: what cancels in them
is known beforehand, and added to the bits.

With phi du = (s² - zeta) ds, V = level - (s³/3 - zeta s) and Z = lam^(2/3) zeta, an integration by
parts turns (s² - zeta) G into ∓ G'/lam, so that each weight is lowered to a series of a + b s:

    int g e^{-lam V}           = pi e^{-lam level} (a Bi(Z) lam^(-1/3) - b Bi'(Z) lam^(-2/3)),
    int h e^{lam V}            = pi e^{lam level} (a' Bi(Z) lam^(-1/3) + b' Bi'(Z) lam^(-2/3)),
    int int_{u < v} g(u) h(v) e^{lam (V(v) - V(u))}
        = pi² (a a' (Ai² + Bi²) lam^(-2/3) + (a b' - b a') (Ai Ai' + Bi Bi') lam^(-1)
               - b b' (Ai'² + Bi'²) lam^(-4/3)),

a, b with (-1/lam)^n, a', b' with lam^-n. The first line of the last is DLMF 9.11.4, the others are
its derivatives in zeta; the critical point that comes first is the minimum of V. What the
integrations by parts leave behind has no exponential, and is the regular part.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from mpmath import libmp

from symasym.base.inputs import FloatArray
from symasym.generated.formulas import next_weight, over_pair, pair_factors, pair_units
from symasym.numbers.arithmetic import BITS, GUARD, Arithmetic, Digits, Number, from_fixed
from symasym.numbers.polynomials import Truncated
from symasym.special.tables import Exact, Table, table_of

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


# Airy's oscillation and growth over a piece of 1/2 need 13 coefficients up to here.
_AIRY_END = 8.0
_AIRY_PIECES = 32
_TERMS = 13
# From here on e^{(4/3) Z^(3/2)} is taken out of the table and not of its value.
_AIRY_SCALED = 1.0
# sqrt(2/3): where the expansion parameter 1/Z^(3/2) is largest.
_FAR_TERMS = 14


class AiryProducts(NamedTuple):
    """Times e^{-(4/3) Z^(3/2)} where Z > 0, the last two times its root.

    Attributes
    ----------
    squares : Ai² + Bi²
    cross : Ai Ai' + Bi Bi'
    slopes : Ai'² + Bi'²
    bi, bi_slope : Bi and Bi'
    """

    squares: FloatArray
    cross: FloatArray
    slopes: FloatArray
    bi: FloatArray
    bi_slope: FloatArray


def airy_products(
    z: Number, arithmetic: Arithmetic, single: bool = True, double: bool = True
) -> AiryProducts:
    """The products at every Z; relative errors are a few units of rounding.

    `single`: Bi and Bi'; `double`: the others. What is not wanted is left empty in arrays.
    """
    if isinstance(arithmetic, Digits):
        return _of_digits(z, arithmetic.context)
    return _of_arrays(np.asarray(z), single, double)


# -- arrays --------------------------------------------------------------------------------------


def _products(z: mpf, c: MPContext) -> tuple[Any, ...]:
    """The five products at an mpf, exponentials taken out from `_AIRY_SCALED` on."""
    ai, bi, ai1, bi1 = c.airyai(z), c.airybi(z), c.airyai(z, 1), c.airybi(z, 1)
    fall = c.exp(-2 * z ** c.mpf(1.5) / 3) if z > _AIRY_SCALED else c.one
    products = ai * ai + bi * bi, ai * ai1 + bi * bi1, ai1 * ai1 + bi1 * bi1
    return (*(x * fall**2 for x in products), bi * fall, bi1 * fall)


def _beyond(sign: int) -> Exact:
    """Airy products without their powers of |Z|, in (8/|Z|)^(3/2) from 0 to 1."""

    def scaled_products(t: mpf, c: MPContext) -> tuple[Any, ...]:
        """The products at Z = sign 8 t^(-2/3), without powers of |Z| and without their turning."""
        size = _AIRY_END / c.cbrt(t) ** 2
        z, root = sign * size, c.sqrt(size)
        ai, bi, ai1, bi1 = c.airyai(z), c.airybi(z), c.airyai(z, 1), c.airybi(z, 1)
        xi = 2 * size * root / 3
        fall = c.exp(-xi) if sign > 0 else c.one
        powers = root, c.one if sign > 0 else size * root, 1 / root
        squares = ai * ai + bi * bi, ai * ai1 + bi * bi1, ai1 * ai1 + bi1 * bi1
        scaled = [x * fall**2 * y for x, y in zip(squares, powers, strict=True)]
        half = c.sqrt(root)
        if sign > 0:
            return (*scaled, bi * fall * half, bi1 * fall / half)
        # Bi + i Ai and its slope, without their turning.
        turn = c.expj(xi + c.pi / 4)
        whole, slope = (bi + 1j * ai) * half * turn**-1, (bi1 + 1j * ai1) / half * turn**-1
        return (*scaled, whole.real, whole.imag, slope.real, slope.imag)

    return scaled_products


@lru_cache(maxsize=1)
def airy_parts() -> tuple[Table, Table, Table]:
    """Near 0, in (8/|Z|)^(3/2) below, and above; also what `symasym.emit.kernels.tables` writes."""
    near = table_of(_products, -_AIRY_END, _AIRY_END, _AIRY_PIECES, _TERMS)
    below, above = (table_of(_beyond(s), 0.0, 1.0, 1, _FAR_TERMS) for s in (-1, 1))
    return near, below, above


def _of_arrays(z: FloatArray, single: bool, double: bool) -> AiryProducts:
    """The products from the tables."""
    near, below, above = airy_parts()
    chosen = [k for k in range(5) if (single if k > 2 else double)]
    low, high = float(z.min(initial=np.inf)), float(z.max(initial=-np.inf))
    products = [np.empty(0)] * 5
    if low >= -_AIRY_END and high <= _AIRY_END:
        for k, x in zip(chosen, _near(near, z, low, high, chosen), strict=True):
            products[k] = x
        return AiryProducts(*products)
    for k in chosen:
        products[k] = np.empty_like(z)
    middle = np.abs(z) <= _AIRY_END
    if middle.any():
        part = _near(near, z[middle], -_AIRY_END, _AIRY_END, chosen)
        for k, x in zip(chosen, part, strict=True):
            products[k][middle] = x
    for sign, table in ((-1, below), (1, above)):
        rows = sign * z > _AIRY_END
        if rows.any():
            part = _beyond_table(table, sign, np.abs(z[rows]), chosen)
            for k, x in zip(chosen, part, strict=True):
                products[k][rows] = x
    return AiryProducts(*products)


def _near(
    table: Table, z: FloatArray, low: float, high: float, chosen: list[int]
) -> list[FloatArray]:
    """The products `chosen` from the table about 0."""
    products = table(z, chosen)
    if high > 0 and low < _AIRY_SCALED:
        # Where the table has the exponential, it is taken out here.
        part = np.where(z < _AIRY_SCALED, np.maximum(z, 0.0), 0.0)
        fall = np.exp(part * np.sqrt(part) * (-2 / 3))
        twice = fall * fall
        products = [x * (fall if k > 2 else twice) for k, x in zip(chosen, products, strict=True)]
    return products


def _beyond_table(table: Table, sign: int, size: FloatArray, chosen: list[int]) -> list[FloatArray]:
    """The products `chosen` for |Z| = `size` beyond it, by moduli and phases (DLMF 9.8)."""
    root = np.sqrt(size)
    cube = size * root
    t, half = _AIRY_END**1.5 / cube, np.sqrt(root)
    products: list[FloatArray] = []
    if 0 in chosen:
        squares, cross, slopes = table(t, range(3))
        products += [squares / root, cross if sign > 0 else cross / cube, slopes * root]
    if 3 not in chosen:
        return products
    if sign > 0:
        bi, slope = table(t, (3, 4))
    else:
        turn = cube * (2 / 3) + np.pi / 4
        cosine, sine = np.cos(turn), np.sin(turn)
        real, imaginary, slope_real, slope_imaginary = table(t, range(3, 7))
        bi = real * cosine - imaginary * sine
        slope = slope_real * cosine - slope_imaginary * sine
    return [*products, bi / half, slope * half]


# -- digits --------------------------------------------------------------------------------------


def _of_digits(z: mpf, context: MPContext) -> AiryProducts:
    """Airy products at one mpf; relative errors are a few units of rounding."""
    xi = 2 * abs(z) * context.sqrt(abs(z)) / 3
    # The asymptotic series are good to e^{-2 xi}.
    if 2 * xi * BITS > context.prec + GUARD:
        return _far(z, xi, context)
    f, f1, g, g1 = _two_series(z, int(xi * BITS) if z < 0 else 0, context)
    root, one, two = _at_zero(context)
    if z > 0:
        fall = context.exp(-xi)
        one, two = one * fall, two * fall
    f, f1, g, g1 = one * f, one * f1, two * g, two * g1
    return AiryProducts(
        4 * (f * f + f * g + g * g),
        4 * (f * f1 + g * g1) + 2 * (f * g1 + f1 * g),
        4 * (f1 * f1 + f1 * g1 + g1 * g1),
        root * (f + g),
        root * (f1 + g1),
    )


def _two_series(z: mpf, cancelling: int, context: MPContext) -> tuple[Any, Any, Any, Any]:
    """f, f', g, g' of DLMF 9.4.1, all of positive terms for Z > 0."""
    bits = context.prec + cancelling + GUARD
    with context.workprec(bits):
        cube = libmp.to_fixed((z * z * z)._mpf_, bits)
    one = libmp.MPZ(1) << bits
    a = b = f = g = g1 = one
    f1, k = 0 * one, 0
    while a or b:
        k += 3
        f1 += a // (k - 1)
        a = (a * cube >> bits) // (k * (k - 1))
        b = (b * cube >> bits) // (k * (k + 1))
        f += a
        g += b
        g1 += (k + 1) * b
        # Shifted to the right, what is negative ends at -1.
        if -2 < a < 2 and -2 < b < 2:
            break
    f, f1, g, g1 = (from_fixed(x, bits, context) for x in (f, f1, g, g1))
    return f, z * z * f1, z * g, g1


def _at_zero(context: MPContext) -> tuple[Any, Any, Any]:
    """sqrt(3), Ai(0) and -Ai'(0)."""
    prec = -64 * (-context.prec // 64)
    root, one, two = (context.make_mpf(x) for x in _at_zero_to(prec))
    return root, one, two


@lru_cache(maxsize=8)
def _at_zero_to(prec: int) -> tuple[Any, ...]:
    """sqrt(3), Ai(0) and -Ai'(0) to `prec` bits (DLMF 9.2.3, 9.2.4)."""
    from symasym.base.call_context import own_context

    with own_context(15) as c:
        c.prec = prec + 16
        gamma, root = c.gamma(c.mpf(1) / 3), c.sqrt(3)
        one = root * gamma / (2 * c.pi * c.cbrt(9))
        return tuple(x._mpf_ for x in (root, one, 1 / (2 * c.pi * root * one)))


def _far(z: mpf, xi: mpf, context: MPContext) -> AiryProducts:
    """DLMF 9.7(ii); for Z > 0 what Ai adds is below the last digit."""
    c, size = context, abs(z)
    sums = _sums(xi, 1 if z > 0 else -1, context)
    root = c.sqrt(size)
    half = c.sqrt(root)
    if z > 0:
        front = 1 / c.sqrt(c.pi)
        bi = front * (sums[0] + sums[1]) / half
        slope = front * (sums[2] + sums[3]) * half
        return AiryProducts(bi * bi, bi * slope, slope * slope, bi, slope)
    p, q, r, s = sums
    cosine, sine = c.cos_sin(xi - c.pi / 4)
    return AiryProducts(
        (p * p + q * q) / (c.pi * root),
        (q * r - p * s) / c.pi,
        (r * r + s * s) * root / c.pi,
        (cosine * q - sine * p) / (half * c.sqrt(c.pi)),
        (cosine * r + sine * s) * half / c.sqrt(c.pi),
    )


def _sums(xi: mpf, sign: int, context: MPContext) -> tuple[Any, ...]:
    """Even and odd terms of sum u_k/xi^k and of sum v_k/xi^k, each with powers of `sign`."""
    bits = context.prec + GUARD
    step = libmp.to_fixed((1 / (216 * xi))._mpf_, bits)
    u = libmp.MPZ(1) << bits
    sums = [u, 0 * u, u, 0 * u]
    k = 0
    while u:
        k += 1
        u = (u * step >> bits) * ((6 * k - 5) * (6 * k - 3) * (6 * k - 1)) // (k * (2 * k - 1))
        v = (6 * k + 1) * u // (1 - 6 * k)
        turned = sign ** (k // 2)
        sums[k % 2] += turned * u
        sums[2 + k % 2] += turned * v
    return tuple(from_fixed(x, bits, context) for x in sums)


# -- two coalescing critical points ----------------------------------------------------------------


#: A value, and a size that has no zeros by chance.
Term = tuple[Any, Any]
#: (a_n, b_n), without their powers of 1/lam.
Rows = list[tuple[Any, Any]]


def by_parts(zeta: Number, pq: Rows, count: int) -> tuple[list[Any], list[Any]]:
    """a_n and b_n for n < count from p_k, q_k for k < 2 count - 1; G_(n+1) = H_n'."""
    p, q = ([pair[j] for pair in pq] for j in (0, 1))
    a, b = [], []
    for _ in range(count):
        a.append(p[0])
        b.append(q[0])
        rest = range(len(p) - 2)
        rows = [next_weight(k, zeta, p[k + 2], q[k + 1], q[k + 2]) for k in rest]
        p, q = ([row[j] for row in rows] for j in (0, 1))
    return a, b


class PairTerms(NamedTuple):
    """The terms of int g e^{-lam V}, int h e^{lam V} and the double integral, heights left out."""

    speed: list[Term]
    scale: list[Term]
    both: list[Term]


def product_rows(speed: Rows, scale: Rows) -> list[tuple[Any, Any, Any]]:
    """Factors of Ai² + Bi², Ai Ai' + Bi Bi' and Ai'² + Bi'² in the terms lam^-n, over pi²."""
    count = min(len(speed), len(scale))
    signed = [((-1) ** n * a, (-1) ** n * b) for n, (a, b) in enumerate(speed)]
    weights: list[Any] = [
        Truncated([row[j] for row in rows[:count]], count)
        for rows in (signed, scale)
        for j in (0, 1)
    ]
    return list(zip(*(factor.c for factor in pair_factors(*weights)), strict=True))


def pair_terms(
    zeta: Number,
    speed: Rows,
    scale: Rows,
    lam: mpf,
    context: MPContext,
    known: AiryProducts | None = None,
) -> PairTerms:
    """All terms that the rows determine; `known` are the products at Z, if they are."""
    arithmetic, third = Digits(context), context.cbrt(lam)
    z, small = third**2 * zeta, 1 / third
    airy = airy_products(z, arithmetic) if known is None else known
    growth = context.exp(2 * z * context.sqrt(z) / 3) if z > 0 else context.one
    squares, cross, slopes = (growth * growth * y for y in airy[:3])
    bi, bi1 = growth * airy.bi, growth * airy.bi_slope
    # The modulus functions have no zeros.
    modulus = context.sqrt(squares), context.sqrt(slopes)

    def single(rows: Rows, step: int) -> list[Term]:
        """The terms of a single integral, of Bi and Bi'."""
        terms, which = [], (1 - step) // 2
        for n, (a, b) in enumerate(rows):
            value = over_pair(arithmetic, a, small, b, bi, bi1)[which]
            size = over_pair(arithmetic, abs(a), small, abs(b), *modulus)[0]
            terms.append((step**n * lam**-n * value, lam**-n * size))
        return terms

    functions = pair_units(arithmetic, small, squares, cross, slopes)
    both = []
    for n, row in enumerate(product_rows(speed, scale)):
        values = [lam**-n * c * y for c, y in zip(row, functions, strict=True)]
        both.append((sum(values, 0 * z), sum((abs(y) for y in values), 0 * z)))
    return PairTerms(single(speed, -1), single(scale, 1), both)
