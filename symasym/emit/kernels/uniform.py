"""The uniform formula of order 0 for one polynomial drift, written to be emitted.

One start at 0, in doubles. The zeros, and which of them are taken together, are those of
`symasym.asymptotics.uniform.structure`, and the closed forms those of `EMITTED` in
`symasym.asymptotics.uniform.order_zero_forms`: the library runs both texts. Here they are put
together: a side is gone through from the start on, with S = int e^{lam V}, W = int e^{-lam V} and
the double integral D so far, of which each well, barrier, pair and end changes what it must.
`symasym.emit.targets.language` writes all these functions, and those of `airy`, into a file, as
they are or, through `symasym.emit.kernels.transcribe`, in another language. So they hold floats,
whole numbers and lists of fixed length only, and what stands under `_PAIRS` is left out where a
drift has no pair of zeros. A drift is c[0] + c[1] u + ... + c[n - 1] u^(n - 1).

Behind them stand scaled Airy products, Dawson's integral and erfcx one by one, which an emitted
expression calls (`symasym.emit.forms`).
"""

from __future__ import annotations

import math
from typing import Any

from symasym.asymptotics.uniform.structure import (
    _added,
    _clear,
    _horner,
    _potential,
    _shift,
    _slope,
    _structure,
)
from symasym.emit.kernels.airy import _airy
from symasym.emit.kernels.elementary import _GAUSS_W, _GAUSS_X, _exprel, _exprel2

# Put in when a file is written.
_PAIRS = True
_DAWSON_NEAR: list[float] = []
_DAWSON_BEYOND: list[float] = []
# The library's formulas, in doubles (`symasym.emit.kernels.kernel.in_doubles`).
_FORM: Any = None
pair_norm = canonical = over_pair = over_pair_twice = pair_share = over_end = _FORM
even_share = even_share_on_line = odd_share = _past_pair = _past_barrier = _FORM
blended = _before_end = gaussians = _FORM


def _dawson(x: float, result: list[float]) -> None:
    """e^{x^2} erfc(x), Dawson's integral, and twice the integral of that, x >= 0."""
    if x <= 6:
        piece: int = min(int(4 * x), 23)
        t = 2 * (4 * x - piece) - 1
        for k in range(3):
            result[k] = _horner(_DAWSON_NEAR, 13 * (piece + 24 * k), 13, t)
        return
    t = 72 / (x * x) - 1
    result[0] = _horner(_DAWSON_BEYOND, 0, 14, t) / x
    result[1] = _horner(_DAWSON_BEYOND, 14, 14, t) / x
    result[2] = _horner(_DAWSON_BEYOND, 28, 14, t) + math.log(2 * x) + 0.5772156649015329 / 2


def _edge(
    c: list[float], n: int, sign: float, reach: float, roots: list[float], real: int,
    owner: list[int], rows: list[float], edge: list[float], at: int,
) -> None:  # fmt: skip
    """A barrier next to the end: t, peak, rest, their distance, and which zero it is.

    The last of these is -1 where there is no barrier next to the end.
    """
    psi, kept, form = [0.0] * 13, [0.0] * 3, [0.0] * 3
    last, before = -1, -1
    edge[at + 4] = -1
    for j in range(real):
        nth: int = j if sign > 0 else real - 1 - j
        if 0 < sign * roots[nth] < reach:
            before = last
            last = nth
    if last < 0:
        return
    place, drop = sign * roots[last], -1.0
    if before >= 0:
        drop = _potential(c, n, roots[last]) - _potential(c, n, roots[before])
    falls: int = _slope(c, n, roots[last]) < 0
    if _PAIRS:
        to = 16 * owner[last]
        if to >= 0:
            square, zeta = max(rows[to + 1], 0.0), max(rows[to + 3], 0.0)
            place = sign * rows[to + 6] + rows[to] + math.sqrt(square)
            drop = 4 * zeta * math.sqrt(zeta) / 3
            falls = rows[to + 2] < 0
    if falls == 1:
        return
    for k in range(n):
        psi[k] = c[k] if k % 2 == 1 else sign * c[k]
    _shift(psi, n, place)
    gap, area, first, second, power = reach - place, 0.0, 0.0, 0.0, 1.0
    for k in range(1, n):
        area += psi[k] / (k + 1) * power
        if k + 1 < n:
            first += 2 * psi[k + 1] / (k + 2) * power
            second += psi[k + 1] * power
        power *= gap
    value = psi[1] + gap * second
    if not (area > 0 and gap > 0 and value > 0):
        edge[at + 4] = -2
        return
    if drop >= 0:
        blended(drop, gap, area, kept)
    _before_end(max(psi[1], 1e-94), gap, area, first, second, value, kept[1], form)
    for k in range(3):
        edge[at + k] = form[k]
    edge[at + 3] = gap
    edge[at + 4] = last


def _primitive(
    c: list[float], n: int, at: int, u: float, roots: list[float], real: int, owner: list[int],
    rows: list[float], count: int, x: list[float], y: list[float], above: int, edge: list[float],
) -> float:  # fmt: skip
    """A primitive of 1/phi on a path past all pairs, at the start (at = 1) or an end (0, 2)."""
    if n == 1:
        return u / c[0]
    total = 0.0
    cut: int = -1
    if at == 0:
        cut = int(edge[4])
    if at == 2:
        cut = int(edge[9])
    gap = 0.0
    if cut >= 0:
        gap = edge[3] if at == 0 else edge[8]
    for k in range(real):
        if owner[k] < 0:
            distance = gap if cut == k else abs(u - roots[k])
            if distance == 0.0:
                return math.nan
            total += math.log(distance) / _slope(c, n, roots[k])
    if _PAIRS:
        share, parts = [0.0] * 2, [0.0] * 2
        for k in range(above):
            # 2 Re(log(u - z)/phi'(z)).
            re, im = 0.0, 0.0
            for j in range(n - 1, 0, -1):
                turned = re * x[k] - im * y[k] + j * c[j]
                im = re * y[k] + im * x[k]
                re = turned
            along, angle = math.log(math.hypot(u - x[k], y[k])), math.atan2(-y[k], u - x[k])
            total += 2 * (along * re + angle * im) / (re * re + im * im)
        for k in range(count):
            to = 16 * k
            if rows[to + 9] > 0:
                side = rows[to + 7]
                own: int = rows[to + 8] >= 0 and (cut == rows[to + 8] or cut == rows[to + 8] + 1)
                beyond: int = (at == 2 and side > 0) or (at == 0 and side < 0)
                norm = pair_norm(rows[to + 10], rows[to + 11], rows[to + 1])
                pair_share(rows[to + 2], rows[to + 10], rows[to + 11], norm, share)
                if own == 1 and beyond == 1:
                    _past_barrier(share[0], share[1], rows[to + 1], gap, parts)
                else:
                    far = side * u - side * rows[to + 6] - rows[to]
                    _past_pair(share[0], share[1], rows[to + 1], far, parts)
                total += parts[0] + parts[1]
    return total


def _plus(sums: list[float], at: int, height: float, value: float, lam: float) -> None:
    """Add e^(lam height) value to a sum of such, its height and its value in units of that."""
    if value == 0.0:
        return
    if height > sums[at]:
        sums[at + 1] *= math.exp(lam * (sums[at] - height))
        sums[at] = height
    sums[at + 1] += value * math.exp(lam * (height - sums[at]))


def _passed(sums: list[float], height: float, rise: float, lam: float) -> None:
    """Add what is e^(lam height) rise in S, and its product with all of W before it in D."""
    _plus(sums, 0, height, rise, lam)
    _plus(sums, 2, height + sums[4], rise * sums[5], lam)


def _side(
    c: list[float], n: int, sign: float, r: float, slope: float, lam: float, roots: list[float],
    real: int, owner: list[int], rows: list[float], count: int, edge: list[float], at: int,
    regular: float, sums: list[float],
) -> None:  # fmt: skip
    """S, D and W of one side without the start's own share, each a height and a value.

    Kinks, where the drift goes on without a jump, add nothing to order 0.
    """
    reach, straight, done = min(r, 1.0), 0.0, 0.0
    height, drop, value = 0.0, 0.0, 0.0
    for k in range(6):
        sums[k] = 0.0
    sums[4] = -math.inf
    for _ in range(13):
        next_, place = -1, reach
        for k in range(real):
            if owner[k] < 0 and done < sign * roots[k] < place:
                next_ = k
                place = sign * roots[k]
        if _PAIRS:
            pair, form, here, airy = -1, [0.0] * 2, [0.0] * 2, [0.0] * 4
            for k in range(count):
                if rows[16 * k + 9] > 0 and done < sign * rows[16 * k + 6] < place:
                    pair = 16 * k
                    place = sign * rows[16 * k + 6]
            if pair >= 0:
                rise, third = max(rows[pair + 3], 0.0), math.cbrt(lam)
                rise = 2 * rise * math.sqrt(rise) / 3
                level = _potential(c, n, rows[pair + 6]) - rows[pair + 5]
                _airy(third * third * rows[pair + 3], 4, airy)
                odd = rows[pair + 2] * rows[pair + 11]
                value = pair_norm(rows[pair + 10], odd, rows[pair + 1])
                canonical(rows[pair + 4], rows[pair + 10], odd, value, form)
                over_pair(form[0], 1 / third, form[1], airy[2], airy[3], here)
                _passed(sums, level + rise, here[0], lam)
                if rows[pair + 2] > 0:
                    value = over_pair_twice(form[0], 1 / third, form[1], airy[0], airy[1])
                    _plus(sums, 2, 2 * rise, value, lam)
                _plus(sums, 4, rise - level, here[1], lam)
                if rows[pair + 8] >= 0:
                    height = level + rise
                done = place
                continue
        if next_ < 0:
            break
        done = place
        drop = _slope(c, n, roots[next_])
        value = math.sqrt(2 * math.pi / (lam * abs(drop)))
        if drop > 0:
            height = _potential(c, n, roots[next_])
            _passed(sums, height, value, lam)
        else:
            _plus(sums, 4, -_potential(c, n, roots[next_]), value, lam)
    if edge[at + 4] >= 0:
        # From the barrier, the last of the real zeros, down to the end.
        height -= edge[at] * edge[at] / 2
        near, shared, over = [0.0] * 3, [0.0] * 3, [0.0] * 3
        _dawson(edge[at] * math.sqrt(lam / 2), near)
        gaussians(lam, near[0], near[1], near[2], shared)
        over_end(lam, edge[at], edge[at + 1], edge[at + 2], shared[0], shared[1], shared[2], over)
        length = max(r - 1, 0.0)
        value = length * _exprel(-lam * slope * length)
        _passed(sums, height, over[0] + value, lam)
        drop = length * length * _exprel2(-lam * slope * length)
        _plus(sums, 2, 0.0, over[2] + drop + over[1] * value, lam)
    elif r > 1:
        straight = (r - 1) / slope
        _passed(sums, _potential(c, n, sign) - slope * (r - 1), -1 / (slope * lam), lam)
    else:
        value = sign / _horner(c, 0, n, sign * reach) / lam
        _passed(sums, _potential(c, n, sign * reach), -value, lam)
    _plus(sums, 2, 0.0, (regular + straight) / lam, lam)


def _log_uniform(
    c: list[float], n: int, left_terms: list[float], left_count: int, right_terms: list[float],
    right_count: int, kappa: float, r: float,
) -> float:  # fmt: skip
    """log T from 0, to order 0; not a number where the formula does not tell it."""
    # The drift beyond the layer may be small, a sum of what is not.
    a_minus, a_plus = _added(left_terms, left_count), _added(right_terms, right_count)
    roots, rows, psi, x, y = [0.0] * 13, [0.0] * 208, [0.0] * 169, [0.0] * 13, [0.0] * 13
    owner, counts, exponential_gap, edge = [0] * 13, [0] * 2, [0.0] * 1, [0.0] * 10
    left, right, ends = [0.0] * 6, [0.0] * 6, [0.0] * 3
    while n > 1 and c[n - 1] == 0.0:
        n -= 1
    if not (1e-8 <= kappa <= 1e8 and 0 < r <= 1e12 and a_minus != 0.0 and a_plus != 0.0):
        return math.nan
    reach, lam = min(r, 1.0), 2 / (kappa * kappa)
    if _clear(c, n, 0.0) == 0:
        return math.nan
    if r <= 1 and (_clear(c, n, reach) == 0 or _clear(c, n, -reach) == 0):
        return math.nan
    real: int = _structure(c, n, 0.0, r, roots, owner, rows, psi, x, y, counts, exponential_gap)
    if real < 0:
        return math.nan
    for k in range(real):
        # A barrier uphill: the start truncates its Gaussian, which is in no closed form here.
        if c[0] * roots[k] < 0 and abs(roots[k]) < reach:
            return math.nan
    _edge(c, n, -1.0, reach, roots, real, owner, rows, edge, 0)
    _edge(c, n, 1.0, reach, roots, real, owner, rows, edge, 5)
    if edge[4] < -1 or edge[9] < -1:
        return math.nan
    for k in range(3):
        ends[k] = _primitive(
            c, n, k, (k - 1) * reach, roots, real, owner, rows, counts[0], x, y, counts[1], edge
        )
    _side(
        c, n, -1.0, r, -a_minus, lam, roots, real, owner, rows, counts[0], edge, 0,
        ends[0] - ends[1], left,
    )  # fmt: skip
    _side(
        c, n, 1.0, r, a_plus, lam, roots, real, owner, rows, counts[0], edge, 5,
        ends[2] - ends[1], right,
    )  # fmt: skip
    # The shares of the start cancel in S of both sides, not in either.
    top = max(left[0], right[0])
    total = left[1] * math.exp(lam * (left[0] - top)) + right[1] * math.exp(lam * (right[0] - top))
    behind, ahead = left[0] - top + right[2], right[0] - top + left[2]
    high = max(behind, ahead, min(left[0], right[0]))
    here = 1 / _horner(c, 0, n, 0.0) / lam
    before = left[1] - here * math.exp(-lam * left[0])
    after = right[1] + here * math.exp(-lam * right[0])
    mean = right[3] * before / total * math.exp(lam * (behind - high))
    mean += left[3] * after / total * math.exp(lam * (ahead - high))
    if not 0 < mean < 1e300:
        return math.nan
    return math.log(mean * lam) + lam * high


# -- functions that expressions call ---------------------------------------------------------------


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
