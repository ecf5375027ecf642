"""Many values of lam by interpolation: what a drift has for log T is smooth in lam.

It is a polynomial to the last digits on short pieces of an octave, and, less a multiple of lam, one
polynomial of modest degree in log(lam) over some powers of ten. The error of interpolation at
Chebyshev nodes is largest beside the ends of a piece; there it is looked at, and nothing is
interpolated where it is more than rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev

from symasym.base.inputs import FloatArray

__all__ = ["columns", "of_one"]

#: Logarithms and errors of them at some lam.
Values = Callable[[FloatArray], tuple[FloatArray, FloatArray]]

_TERMS = 8
# Bits of a float64's mantissa; the first few of them tell a piece, the others where in it.
_MANTISSA = 52
_FEWEST_BITS, _MOST_BITS = 4, 7
_ONE = 0x3FF << _MANTISSA
# Terms over the whole range: so many, and for each factor e.
_LEAST_DEGREE, _DEGREE = 20, 9
_NOISE = 4
# Of a logarithm, where it is larger than 1.
_ROUNDING = 6e-15
_AT_ONCE = 8192
# OpenBLAS wakes its threads for larger products, which waits for them where cores are busy.
_PRODUCT = 250_000


def of_one(f: Values, lam: FloatArray, most: float) -> tuple[FloatArray, FloatArray] | None:
    """f of one drift at every lam, and its largest error; None unless that is below `most`.

    None as well where interpolation takes as many values as there are.
    """
    ends = np.array([lam.min(), lam.max()]).view(np.int64)
    for bits in range(_FEWEST_BITS, _MOST_BITS + 1):
        low, high = (ends >> (_MANTISSA - bits)).tolist()
        if 4 * (high + 1 - low) * _TERMS > len(lam):
            return None
        powers, error, good = _fit(f, low, high, bits)
        if not error.max() < most:
            return None
        if good:
            return _evaluated(powers, low, bits, lam), error.max(keepdims=True)
    return None


def _fit(f: Values, low: int, high: int, bits: int) -> tuple[FloatArray, FloatArray, bool]:
    """Powers of the distance from each piece's middle, in half lengths; errors at all nodes."""
    edges = (np.arange(low, high + 2) << (_MANTISSA - bits)).view(np.float64)
    start, width = edges[:-1], np.diff(edges)
    nodes = (1 + chebyshev.chebpts1(_TERMS)) / 2
    inside = start[:, None] + width[:, None] * nodes
    at = np.concatenate((inside.ravel(), edges))
    parts = [f(at[k : k + _AT_ONCE]) for k in range(0, len(at), _AT_ONCE)]
    values, errors = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    # What changes on a piece is less than what it changes from, and so is its rounding.
    rows = values[: inside.size].reshape(inside.shape).T
    powers = _to_powers(_TERMS) @ (rows - rows[:1])
    powers[0] += rows[0]
    ends = values[inside.size :]
    size = _ROUNDING * (1 + np.abs(ends))
    signs = (-1.0) ** np.arange(_TERMS)
    left, right = np.abs(signs @ powers - ends[:-1]), np.abs(powers.sum(axis=0) - ends[1:])
    return powers, errors, bool((left <= size[:-1]).all() and (right <= size[1:]).all())


def _evaluated(powers: FloatArray, low: int, bits: int, lam: FloatArray) -> FloatArray:
    """The pieces' polynomials at every lam, whose bits give the piece and the offset in it."""
    shift = _MANTISSA - bits
    rest = (1 << shift) - 1
    values = np.empty_like(lam)
    for start in range(0, len(lam), _AT_ONCE):
        word = lam[start : start + _AT_ONCE].view(np.int64)
        # The bits behind the piece's, as the mantissa of a number from 1 to 2.
        fraction = word & rest
        fraction <<= bits
        fraction |= _ONE
        t = fraction.view(np.float64)
        t *= 2
        t -= 3
        piece = word >> shift
        piece -= low
        total = powers[-1].take(piece)
        for row in powers[-2::-1]:
            total *= t
            total += row.take(piece)
        values[start : start + _AT_ONCE] = total
    return values


@lru_cache(maxsize=8)
def _to_powers(count: int) -> FloatArray:
    """The matrix from values at the nodes to coefficients of powers."""
    matrix = np.zeros((count, count))
    for k, row in enumerate(_to_chebyshev(count)):
        power = chebyshev.cheb2poly(np.eye(count)[k])
        matrix[: len(power)] += power[:, None] * row
    return matrix


@lru_cache(maxsize=32)
def _to_chebyshev(count: int) -> FloatArray:
    # By angles: a recurrence in the nodes would lose digits with the square of the degree.
    """The matrix from values at Chebyshev nodes to Chebyshev coefficients (discrete cosines)."""
    degree, node = np.arange(count)[:, None], 2 * np.arange(count)[::-1] + 1
    matrix: FloatArray = np.cos(degree * node % (4 * count) * (np.pi / (2 * count))) * (2 / count)
    matrix[0] /= 2
    return matrix


def columns(
    f: Callable[[FloatArray, bool], tuple[FloatArray, Any]], lam: FloatArray
) -> tuple[FloatArray, FloatArray, Any] | None:
    """f, of many drifts at once in columns, at every lam; largest errors; where that is good.

    f(lam, True) has errors as well. None where there are too few of lam for it to pay.
    """
    low, high = float(np.log(lam.min())), float(np.log(lam.max()))
    count = _LEAST_DEGREE + int(_DEGREE * (high - low))
    if 3 * count > len(lam) or not high > low:
        return None
    nodes = np.concatenate((chebyshev.chebpts1(count), [-1.0, 1.0]))
    at = np.exp(low + (high - low) / 2 * (1 + nodes))
    # Errors at every fourth node, and at the ends.
    some = np.arange(len(at)) % 4 == 0
    some[count:] = True
    logs, errors = f(at[some], True)
    values = np.empty((len(at), logs.shape[1]))
    values[some] = logs
    values[~some] = f(at[~some], False)[0]
    # Mostly, log T grows with lam; what is left is small where log T is.
    slope = (values[count - 1] - values[count - 2]) / (at[count - 1] - at[count - 2])
    rest = values - slope * at[:, None]
    c = _product(_to_chebyshev(count), rest[:count])
    # The last terms are rounding alone.
    noise = np.abs(c[-_NOISE:]).max(axis=0)
    kept = np.maximum.accumulate((np.abs(c) > 3 * noise)[::-1])[::-1]
    c *= kept
    ends = np.abs(_product(chebyshev.chebvander(nodes[count:], count - 1), c) - rest[count:])
    size = _ROUNDING * (1 + np.abs(values[count:]))
    good = (ends <= size).all(axis=0)
    # The error may be largest elsewhere in so long a piece, where the last terms show it.
    good &= 3 * noise <= size.min(axis=0)
    x = np.clip(2 * (np.log(lam) - low) / (high - low) - 1, -1.0, 1.0)
    logs = _product(chebyshev.chebvander(x, count - 1), c)
    logs += slope * lam[:, None]
    return logs, errors.max(axis=0), good


def _product(a: np.ndarray[Any, Any], b: FloatArray) -> FloatArray:
    """The matrix product, in blocks of columns."""
    product = np.empty((len(a), b.shape[1]))
    step = max(1, _PRODUCT // a.size)
    for k in range(0, b.shape[1], step):
        product[:, k : k + step] = a @ b[:, k : k + step]
    return product
