"""Products of Airy functions and Dawson's integral to any number of digits.

Power series in integers of fixed point, as long as they converge faster than the asymptotic ones
are good; what cancels in them is known beforehand, and added to the bits.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from mpmath import libmp

from symasym.special.airy_tables import AiryProducts, Dawson

__all__ = ["airy_products", "dawson"]

_BITS = 1.4426950408889634
_GUARD = 24


def airy_products(z: Any, context: Any) -> AiryProducts:
    """The products at the mpf Z, nothing taken out of them."""
    xi = 2 * abs(z) * context.sqrt(abs(z)) / 3
    # The asymptotic series are good to e^{-2 xi}.
    if 2 * xi * _BITS > context.prec + _GUARD:
        return _far(z, xi, context)
    f, f1, g, g1 = _two_series(z, int(xi * _BITS) if z < 0 else 0, context)
    root, one, two = _at_zero(context)
    f, f1, g, g1 = one * f, one * f1, two * g, two * g1
    return AiryProducts(
        4 * (f * f + f * g + g * g),
        4 * (f * f1 + g * g1) + 2 * (f * g1 + f1 * g),
        4 * (f1 * f1 + f1 * g1 + g1 * g1),
        root * (f + g),
        root * (f1 + g1),
    )


def _two_series(z: Any, cancelling: int, context: Any) -> tuple[Any, Any, Any, Any]:
    """f, f', g, g' of DLMF 9.4.1, all of positive terms for Z > 0."""
    bits = context.prec + cancelling + _GUARD
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
    f, f1, g, g1 = (_number(x, bits, context) for x in (f, f1, g, g1))
    return f, z * z * f1, z * g, g1


def _number(x: Any, bits: int, context: Any) -> Any:
    return context.make_mpf(libmp.from_man_exp(x, -bits, context.prec, "n"))


def _at_zero(context: Any) -> tuple[Any, Any, Any]:
    """sqrt(3), Ai(0) and -Ai'(0)."""
    prec = -64 * (-context.prec // 64)
    root, one, two = (context.make_mpf(x) for x in _at_zero_to(prec))
    return root, one, two


@lru_cache(maxsize=8)
def _at_zero_to(prec: int) -> tuple[Any, ...]:
    from symasym.base.contexts import own_context

    with own_context(15) as c:
        c.prec = prec + 16
        gamma, root = c.gamma(c.mpf(1) / 3), c.sqrt(3)
        one = root * gamma / (2 * c.pi * c.cbrt(9))
        return tuple(x._mpf_ for x in (root, one, 1 / (2 * c.pi * root * one)))


def _far(z: Any, xi: Any, context: Any) -> AiryProducts:
    """DLMF 9.7(ii); for Z > 0 what Ai adds is below the last digit."""
    c, size = context, abs(z)
    sums = _sums(xi, 1 if z > 0 else -1, context)
    root = c.sqrt(size)
    half = c.sqrt(root)
    if z > 0:
        front = c.exp(xi) / c.sqrt(c.pi)
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


def _sums(xi: Any, sign: int, context: Any) -> tuple[Any, ...]:
    """Even and odd terms of sum u_k/xi^k and of sum v_k/xi^k, each with powers of `sign`."""
    bits = context.prec + _GUARD
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
    return tuple(_number(x, bits, context) for x in sums)


def dawson(x: Any, context: Any) -> Dawson:
    """The three functions at the mpf x > 0."""
    square = x * x
    if square * _BITS > context.prec + _GUARD:
        return _dawson_far(x, square, context)
    bits = context.prec + int(square * _BITS) + _GUARD
    with context.workprec(bits):
        double = libmp.to_fixed((2 * x * x)._mpf_, bits)
    term = libmp.MPZ(1) << bits
    # Of (-2 x²)^k/(2k + 1)!!, even and odd k, and of the same over k + 1.
    even, odd, area, k = term, 0 * term, term, 0
    while term:
        term = (term * double >> bits) // (2 * k + 3)
        odd += term
        area -= term // (k + 2)
        term = (term * double >> bits) // (2 * k + 5)
        even += term
        k += 2
        area += term // (k + 1)
    value = x * _number(even - odd, bits, context)
    with context.workprec(bits):
        # Both are e^{x²}, nearly, and a small difference.
        whole = 2 * x * _number(even + odd, bits, context) / context.sqrt(context.pi)
        shade = context.exp(x * x) - whole
    return Dawson(+shade, value, square * _number(area, bits, context))


def _dawson_far(x: Any, square: Any, context: Any) -> Dawson:
    bits = context.prec + _GUARD
    step = libmp.to_fixed((1 / (2 * square))._mpf_, bits)
    term = libmp.MPZ(1) << bits
    shade, value, area, k = term, term, 0 * term, 0
    while term:
        k += 1
        term = (term * step >> bits) * (2 * k - 1)
        value += term
        shade += -term if k % 2 else term
        area -= term // (2 * k)
    c = context
    return Dawson(
        _number(shade, bits, c) / (x * c.sqrt(c.pi)),
        _number(value, bits, c) / (2 * x),
        _number(area, bits, c) + c.log(2 * x) + c.euler / 2,
    )
