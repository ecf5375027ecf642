"""Dawson's integral, its integral, and the complementary error function, scaled.

F(x) = e^{-x²} int_0^x e^{y²} dy (DLMF 7.2(ii)), 2 int_0^x F, and e^{x²} erfc(x), for x >= 0.
Arrays take them from tables (`symasym.special.tables`), in 1/x² beyond those; an mpf takes the
power series of DLMF 7.6 in integers of fixed point, or the asymptotic ones (DLMF 7.12) where these
are good.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from mpmath import libmp

from symasym.base.inputs import FloatArray
from symasym.numbers.arithmetic import BITS, GUARD, Arithmetic, Digits, Number, from_fixed
from symasym.special.tables import DIGITS, Table, table_of

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["Dawson", "dawson", "dawson_parts", "erfcx_area"]

_DAWSON_END = 6.0
_DAWSON_PIECES = 24
_TERMS, _FAR_TERMS = 13, 14


class Dawson(NamedTuple):
    """For x >= 0.

    Attributes
    ----------
    erfcx : e^{x²} erfc(x)
    value : Dawson's integral F(x)
    area : twice the integral of F from 0 to x
    """

    erfcx: FloatArray
    value: FloatArray
    area: FloatArray


def dawson(x: Number, arithmetic: Arithmetic) -> Dawson:
    """The three functions at every x >= 0."""
    if isinstance(arithmetic, Digits):
        return _of_digits(x, arithmetic.context)
    return _of_arrays(np.asarray(x))


def gaussians(
    c: Arithmetic, lam: Number, erfcx: Number, value: Number, area: Number
) -> tuple[Number, Number, Number]:
    """sigma, D and lam int D without its constant, from the functions of x = t (lam/2)^(1/2).

    sigma = e^{lam t^2/2} int_t^inf e^{-lam s^2/2} ds, D = e^{-lam t^2/2} int_0^t e^{lam s^2/2} ds.
    """
    root = c.sqrt(lam)
    sigma = erfcx * c.sqrt(c.pi / 2) / root
    d = value * c.sqrt(c.rational(2)) / root
    return sigma, d, area - (c.euler + c.log(2 * lam)) / 2


def _dawsons(x: mpf, c: MPContext) -> tuple[Any, ...]:
    """The three functions at an mpf, by mpmath."""
    scaled = c.exp(x * x) * c.erfc(x)
    value = c.sqrt(c.pi) / 2 * c.exp(-x * x) * c.erfi(x)
    return scaled, value, x * x * c.hyp2f2(1, 1, c.mpf(3) / 2, 2, -x * x)


def _dawsons_beyond(t: mpf, c: MPContext) -> tuple[Any, ...]:
    """The functions without powers of x, the area without its logarithm, in (6/x)² to 1."""
    x = _DAWSON_END / c.sqrt(t)
    with c.workdps(2 * DIGITS):
        scaled, value, area = _dawsons(x, c)
        return scaled * x, value * x, area - c.log(x) - (c.euler + c.log(4)) / 2


@lru_cache(maxsize=1)
def dawson_parts() -> tuple[Table, Table]:
    """Near 0, and in (6/x)^2 beyond; also what `symasym.emit.kernels.tables` writes."""
    near = table_of(_dawsons, 0.0, _DAWSON_END, _DAWSON_PIECES, _TERMS)
    return near, table_of(_dawsons_beyond, 0.0, 1.0, 1, _FAR_TERMS)


def _of_arrays(x: FloatArray) -> Dawson:
    """The three functions from the tables."""
    near, beyond = dawson_parts()
    values = np.empty((3, *x.shape))
    rows = x <= _DAWSON_END
    if rows.any():
        values[:, rows] = near(x[rows])
    if not rows.all():
        far = x[~rows]
        scaled, value, area = beyond((_DAWSON_END / far) ** 2)
        area = area + np.log(far) + (np.euler_gamma + np.log(4.0)) / 2
        values[:, ~rows] = scaled / far, value / far, area
    return Dawson(*values)


def _of_digits(x: mpf, context: MPContext) -> Dawson:
    """The three functions at an mpf: the series of DLMF 7.6.1 and 7.6.2, or beyond them `_far`."""
    square = x * x
    if square * BITS > context.prec + GUARD:
        return _far(x, square, context)
    bits = context.prec + int(square * BITS) + GUARD
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
    value = x * from_fixed(even - odd, bits, context)
    with context.workprec(bits):
        # Both are e^{x²}, nearly, and a small difference.
        whole = 2 * x * from_fixed(even + odd, bits, context) / context.sqrt(context.pi)
        scaled = context.exp(x * x) - whole
    return Dawson(+scaled, value, square * from_fixed(area, bits, context))


def _far(x: mpf, square: mpf, context: MPContext) -> Dawson:
    """The three functions by their asymptotic series (DLMF 7.12.1)."""
    bits = context.prec + GUARD
    step = libmp.to_fixed((1 / (2 * square))._mpf_, bits)
    term = libmp.MPZ(1) << bits
    scaled, value, area, k = term, term, 0 * term, 0
    while term:
        k += 1
        term = (term * step >> bits) * (2 * k - 1)
        value += term
        scaled += -term if k % 2 else term
        area -= term // (2 * k)
    c = context
    return Dawson(
        from_fixed(scaled, bits, c) / (x * c.sqrt(c.pi)),
        from_fixed(value, bits, c) / (2 * x),
        from_fixed(area, bits, c) + c.log(2 * x) + c.euler / 2,
    )


def erfcx_area(x: mpf, arithmetic: Digits) -> Any:
    """sqrt(pi) times the integral of e^{y²} erfc(y) from 0 to x."""
    c = arithmetic.context
    square = x * x
    if square > c.prec:
        # The asymptotic series: its least term is about e^{-x²}.
        total, term, m = c.log(x) + c.euler / 2 + c.ln2, c.one, 1
        while True:
            term *= -(2 * m - 1) / (2 * square)
            if abs(term) < c.eps:
                return total
            total -= term / (2 * m)
            m += 1
    # The difference of two numbers of about e^{x²}.
    with c.workdps(c.dps + int(square * 0.9) + 5):
        square = x * x
        return c.pi / 2 * c.erfi(x) - square * c.hyp2f2(1, 1, c.mpf(3) / 2, 2, square)
