"""Quotients of exponentials that are regular at 0: the phi functions, and what is made of them.

    phi_1(x) = (e^x - 1)/x = int_0^1 e^(x t) dt,
    phi_2(x) = (e^x - 1 - x)/x² = int_0^1 (1 - t) e^(x t) dt,
    phi_(k+1)(x) = (phi_k(x) - 1/k!)/x = sum over j of x^j/(j + k + 1)!

(M. Hochbruck, A. Ostermann, Acta Numerica 19 (2010) 209). Over a straight piece of the potential
the integrals of e^{±lam V} are phi_1 of its rise, and the nested one is phi_2. The closed forms
cancel near 0, where the series stands.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.numbers.arithmetic import FLOATS, Arithmetic, Number
from symasym.numbers.polynomials import poly

if TYPE_CHECKING:
    from flint import arb

__all__ = ["ball_quotient", "log_quotient", "mean_place", "quotients", "spread_of_place"]


#: Coefficients of phi_2, for floats of at most 1/2.
_SECOND = [1 / math.factorial(k) for k in range(2, 16)]


def quotients(x: Number, numbers: Arithmetic) -> tuple[Any, Any]:
    """phi_1(x) and phi_2(x), to a few units of rounding."""
    # Below 1/2 in size, half a unit of rounding is left out of the series.
    small = abs(x) < 0.5
    everywhere = numbers.all(small)
    first = second = numbers.zero * x
    if everywhere or numbers.any(small):
        y = x if everywhere else numbers.where(small, x, numbers.zero)
        if numbers is FLOATS:
            second = poly(_SECOND, y)
        else:
            for k in range(_terms(numbers.eps), 0, -1):
                second = (1 + y * second) / (k + 1)
        first = 1 + y * second
    if not everywhere:
        z = numbers.where(small, numbers.one, x)
        rise = numbers.expm1(z)
        first = numbers.where(small, first, rise / z)
        second = numbers.where(small, second, (rise - z) / z / z)
    return first, second


def _terms(eps: Number) -> int:
    """The number of terms of the series of phi_1 that are above eps/4 at x = 1/2."""
    # An mpf's eps may be below every float.
    bits = 52 if isinstance(eps, float) else -eps._mpf_[2]
    size, count = 0.0, 0
    while size > -bits - 2:
        count += 1
        size -= math.log2(2 * (count + 1))
    return count


def log_quotient(x: FloatArray, factor: FloatArray | float = 1.0) -> FloatArray:
    """The logarithm of `factor` times phi_1(x), also where e^x has no float64."""
    below = -np.maximum(np.abs(x), 1e-300)
    log: FloatArray = np.log(np.expm1(below) / below * factor) + np.maximum(x, 0.0)
    return log


#: B_2k/(2 k)! of the Bernoulli numbers, k from 1: below 1/2 in size, the rest is left out.
_BERNOULLI = [1 / 12, -1 / 720, 1 / 30240, -1 / 1209600, 1 / 47900160, -691 / 1307674368000,
              1 / 74724249600]  # fmt: skip


_SPREAD = [(2 * k + 1) * b for k, b in enumerate(_BERNOULLI)]


def mean_place(x: FloatArray) -> FloatArray:
    """phi_2(x)/phi_1(x) = 1/x - 1/(e^x - 1): the mean of 1 - t with the weight e^(x t)."""
    small = np.abs(x) < 0.5
    z = np.where(small, 1.0, x)
    share: FloatArray = 1.0 / z - 1.0 / np.expm1(np.minimum(z, 700.0))
    if small.any():
        y = x[small]
        share[small] = 0.5 - y * poly(_BERNOULLI, y * y)
    return share


def spread_of_place(x: FloatArray) -> FloatArray:
    """-d/dx `mean_place`: the variance of t with the weight e^(x t)."""
    small = np.abs(x) < 0.5
    z = np.where(small, 1.0, np.abs(x))
    spread: FloatArray = 1.0 / z / z - np.exp(-z) / np.expm1(-z) ** 2
    if small.any():
        spread[small] = poly(_SPREAD, x[small] ** 2)
    return spread


def ball_quotient(x: arb, order: int) -> Any:
    """A ball of phi_order(x), also where x is or contains 0."""
    import flint

    if not abs(x) < 2:
        if order == 1:
            return x.expm1() / x
        return (ball_quotient(x, order - 1) - 1 / flint.arb(order - 1).fac()) / x
    # Sum of x^k/(k + order)!; what is left out is below |x|^n/(n + order)! e^|x|.
    terms = flint.ctx.prec // 2 + 8
    term = 1 / flint.arb(order).fac()
    total = flint.arb(0)
    for k in range(terms):
        total += term
        term *= x / (k + 1 + order)
        if abs(term) < flint.arb(2) ** (-flint.ctx.prec - 10):
            break
    return total + flint.arb(0, abs(term) * abs(x).exp())
