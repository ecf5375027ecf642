"""A pair of zeros, or a barrier before an end, in numbers without cancellation, in float64.

To order 0, with the size of order 1; phi = (y² - D) psi(y) about a pair (`cubic_pair`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.asymptotics.uniform.local_arrays import Edge, Fold
from symasym.asymptotics.weak_noise.series import Numbers
from symasym.base.inputs import FloatArray
from symasym.numbers.quadratic_factor import Pair, poly, shifted

__all__ = ["edge_of", "fold_of", "past"]

# As in `symasym.asymptotics.uniform.pairing`.
_FADE = 8
# For the size of order 1, zeros closer than this (by the layer's width) are taken to be so far
# apart: it hardly depends on the distance there, and is not lost to rounding.
_APART = 0.03


def fold_of(key: int, pair: Pair, rough: FloatArray) -> Fold:
    """u' = a + b s at the pair, and what comes next; `rough` is the rounding of A there."""
    (a, b), *_ = map_coefficients(pair, 1, None, None)
    # s runs against u where phi is negative outside: du = u' ds with it.
    a, b = np.where(pair.sign > 0, (a, b), (-a, -b))
    moved = rough / (pair.psi[0] * pair.slope**2)
    return Fold(key, pair.zeta, a, b, *_next_terms(pair), moved)


def past(
    pair: Pair, y: FloatArray, beyond: bool, gap: FloatArray | None
) -> tuple[FloatArray, FloatArray]:
    """A primitive of the pair's share of 1/phi, real part past both zeros, without a jump.

    `beyond`: at the end of the path that passes them, `gap` from the barrier if that is given.
    """
    even, odd = poly(pair.psi[0::2], pair.square), poly(pair.psi[1::2], pair.square)
    norm = even**2 - odd**2 * pair.square
    alpha, beta = pair.sign * even / norm, -pair.sign * odd / norm
    if gap is not None:
        # From the barrier, at y = root + gap.
        root = np.sqrt(np.maximum(pair.square, 0.0))
        twice = np.maximum(2 * root, 1e-290)
        log = np.log(gap) + np.log(gap + twice)
        return -alpha * np.log1p(twice / gap) / twice, beta / 2 * log
    log = np.log(np.abs(y * y - pair.square))
    sign = 1.0 if beyond else -1.0
    return -sign * alpha * _turn(pair.square, sign * y), beta / 2 * log


def _turn(square: FloatArray, y: FloatArray) -> FloatArray:
    """artanh(root/y)/root, root² = square, and atan for square < 0; y > 0."""
    q = square / (y * y)
    root = np.sqrt(np.abs(square))
    small = np.abs(q) < 1e-4
    series = (1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q / 11))))) / y
    safe = np.where(small, 1.0, root)
    real = np.log(np.abs((y + safe) / (y - safe))) / 2
    found: FloatArray = np.where(
        small, series, np.where(square > 0, real, np.arctan2(safe, y)) / safe
    )
    return found


def _next_terms(pair: Pair) -> tuple[FloatArray, FloatArray]:
    """a_1 and b_1, from the series at both zeros; only their size counts."""
    least = _APART**2
    square = np.where(np.abs(pair.square) < least, least, pair.square)
    mean = poly([3 * x / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(pair.psi[0::2])], square)
    zeta = square * np.cbrt(mean) ** 2
    half, root = np.sqrt(square + 0j), np.sqrt(zeta + 0j)
    found = []
    slopes = [_series_at(pair.psi, sign * half, sign * root) for sign in (1, -1)]
    b = (slopes[0][0] - slopes[1][0]) / (2 * root)
    for sign, (_, w2, w3) in zip((1, -1), slopes, strict=True):
        sigma = sign * root
        found.append(3 * w3 / (2 * sigma) - (2 * w2 - b) / (4 * sigma**2))
    return (found[0] + found[1]).real / 2, ((found[0] - found[1]) / (2 * root)).real


def _series_at(psi: list[FloatArray], y: Any, s: Any) -> tuple[Any, Any, Any]:
    """u(s) about a zero: the first three coefficients."""
    c = shifted([row + 0 * y for row in psi], y)
    c += [0 * y] * (3 - len(c))
    f1, f2, f3 = 2 * y * c[0], c[0] + 2 * y * c[1], c[1] + 2 * y * c[2]
    w1 = np.sqrt(2 * s / f1)
    # The branch that is positive where both zeros meet.
    w1 = np.where(w1.real < 0, -w1, w1)
    w2 = (1 / 3 - f2 * w1**3 / 3) / (f1 * w1)
    w3 = -(f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4) / (f1 * w1)
    return w1, w2, w3


def edge_of(
    sign: int,
    psi: list[FloatArray],
    gap: FloatArray,
    drop: FloatArray | None,
    ratio: Numbers,
    slope: FloatArray | None,
) -> Edge:
    """phi = x psi(x) from the barrier on, with its end at x = gap; `drop` to the well before it."""
    keep: Any = 0.0
    keep_next: Any = 0.0
    if drop is not None:
        # As the well comes near the barrier, its own series breaks down, and is faded out.
        rho = _FADE * drop / (gap**2 * _area(psi, gap))
        keep = (1 + rho) * np.exp(-rho)
        keep_next = keep + rho**2 / 2 * np.exp(-rho)
        ratio = np.where(rho > 1e-6, ratio, 0.0)
    bottom = np.maximum(psi[0], 1e-100)
    whole = 1 / np.sqrt(bottom)
    t = gap * np.sqrt(2 * _area(psi, gap))
    rest = _rest(bottom, psi, gap) + whole / t * keep
    if drop is not None:
        rest = np.where(keep > 0.5, 1 / (gap * poly(psi, gap)) - whole * (1 - keep) / t, rest)
    peak = whole * (1 - keep)
    # Order 1 hardly depends on where the end is, close to the barrier.
    far = np.maximum(gap, _APART)
    t_far = far * np.sqrt(2 * _area(psi, far))
    value = far * poly(psi, far)
    bend = poly([(k + 1) * x for k, x in enumerate(psi)], far)
    next_rest = -bend / value**3 - whole * ratio * (1 - keep_next) / t_far + peak / t_far**3
    return Edge(sign, t, peak, rest, ratio * (1 - keep_next), np.abs(next_rest), slope)


def _area(psi: list[FloatArray], x: FloatArray) -> FloatArray:
    """int_0^1 y psi(x y) dy: V falls by x² times that."""
    found: FloatArray = poly([c / (k + 2) for k, c in enumerate(psi)], x)
    return found


def _rest(bottom: FloatArray, psi: list[FloatArray], gap: FloatArray) -> FloatArray:
    """1/(gap psi(gap)) - 1/sqrt(psi(0) 2 area)/gap."""
    if len(psi) == 1:
        return np.zeros_like(gap)
    end = poly(psi, gap)
    mean = np.sqrt(2 * _area(psi, gap) * bottom)
    first = poly([2 * c / (k + 3) for k, c in enumerate(psi[1:])], gap)
    second = poly(psi[1:], gap)
    found: FloatArray = (first * bottom - 2 * bottom * second - gap * second**2) / (
        end * mean * (end + mean)
    )
    return found
