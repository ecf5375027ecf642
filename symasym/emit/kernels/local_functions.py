"""Scaled Airy products, Dawson's integral and erfcx one by one, in doubles, to be emitted.

What an emitted expression calls (`symasym.emit.forms`); the values are those of
`symasym.emit.kernels.airy` and `symasym.emit.kernels.uniform`.
"""

from __future__ import annotations

import math

from symasym.emit.kernels.airy import _airy
from symasym.emit.kernels.elementary import _GAUSS_W, _GAUSS_X
from symasym.emit.kernels.uniform import _dawson


def _airy_part(z: float, k: int) -> float:
    products = [0.0] * 4
    _airy(z, 4, products)
    return products[k]


def _airy_squares_of(z: float) -> float:
    return _airy_part(z, 0)


def _airy_slopes_of(z: float) -> float:
    return _airy_part(z, 1)


def _airy_bi_of(z: float) -> float:
    return _airy_part(z, 2)


def _airy_bi_slope_of(z: float) -> float:
    return _airy_part(z, 3)


def _airy_cross_of(z: float) -> float:
    """Ai Ai' + Bi Bi' by the Wronskian 1/pi, DLMF 9.2.7; it is positive."""
    fall = math.exp(-8 * z * math.sqrt(z) / 3) if z > 0 else 1.0
    square = _airy_part(z, 0) * _airy_part(z, 1) - fall / (math.pi * math.pi)
    return math.sqrt(max(square, 0.0))


def _dawson_part(x: float, k: int) -> float:
    values = [0.0] * 3
    _dawson(x, values)
    return values[k]


def _erfcx_of(x: float) -> float:
    return _dawson_part(x, 0)


def _dawson_of(x: float) -> float:
    return _dawson_part(x, 1)


def _dawson_area_of(x: float) -> float:
    return _dawson_part(x, 2)


def _erfcx_area_of(x: float) -> float:
    """sqrt(pi) times the integral of e^{y^2} erfc(y) from 0 to x."""
    if x > 6:
        total, term = math.log(2 * x) + 0.5772156649015329 / 2, 1.0
        for m in range(1, 20):
            term *= -(2 * m - 1) / (2 * x * x)
            total -= term / (2 * m)
        return total
    count: int = int(x) + 1
    half, total = x / count / 2, 0.0
    for j in range(count):
        middle = (2 * j + 1) * half
        for k in range(8):
            left = _erfcx_of(middle - half * _GAUSS_X[k])
            total += _GAUSS_W[k] * (left + _erfcx_of(middle + half * _GAUSS_X[k]))
    return total * half * math.sqrt(math.pi)
