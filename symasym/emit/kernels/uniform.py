"""The uniform formula of order 0 for one polynomial drift, written to be emitted.

The canonical Airy form of two coalescing zeros of the drift (Chester, Friedman, Ursell), the
truncated Gaussian of a barrier before an end (Bleistein) and the leading terms of Laplace's method
elsewhere, for one start at 0: the closed forms of `symasym.asymptotics.uniform`. Nothing of this is
called here: `symasym.emit.uniform_time` writes the functions of this module, of `uniform_pairs`,
`uniform_roots`, `elementary` and `airy` into a file, as they are or, through
`symasym.emit.kernels.transcribe`, in another language. So they hold floats, whole numbers and
lists of fixed length only, and what stands under `_PAIRS` (the drift may have a pair of zeros) or
`_MANY` (two pairs of complex ones) is left out where a drift does not need it.

A drift is c[0] + c[1] u + ... + c[n - 1] u^(n - 1).
"""

from __future__ import annotations

import math

from symasym.emit.kernels.elementary import _horner
from symasym.emit.kernels.uniform_pairs import _choose, _pairs, _past, _together
from symasym.emit.kernels.uniform_roots import (
    _added,
    _clear,
    _complex,
    _lines,
    _potential,
    _rough,
    _shift,
    _slope,
)

# Put in when a file is written.
_PAIRS = True
_DAWSON_NEAR: list[float] = []
_DAWSON_BEYOND: list[float] = []


def _dawson(x: float, found: list[float]) -> None:
    """e^{x^2} erfc(x), Dawson's integral, and twice the integral of that, x >= 0."""
    if x <= 6:
        piece: int = min(int(4 * x), 23)
        t = 2 * (4 * x - piece) - 1
        for k in range(3):
            found[k] = _horner(_DAWSON_NEAR, 13 * (piece + 24 * k), 13, t)
        return
    t = 72 / (x * x) - 1
    found[0] = _horner(_DAWSON_BEYOND, 0, 14, t) / x
    found[1] = _horner(_DAWSON_BEYOND, 14, 14, t) / x
    found[2] = _horner(_DAWSON_BEYOND, 28, 14, t) + math.log(2 * x) + 0.5772156649015329 / 2


def _edge(
    c: list[float], n: int, sign: float, reach: float, lines: list[float], real: int,
    owner: list[int], rows: list[float], edge: list[float], at: int,
) -> None:  # fmt: skip
    """A barrier next to the end: t, peak, rest (`local_double.Edge`), their distance, which zero.

    The last of these is -1 where there is no barrier next to the end.
    """
    psi = [0.0] * 13
    last, before = -1, -1
    edge[at + 4] = -1
    for k in range(real):
        place = sign * lines[k]
        if 0 < place < reach:
            if last < 0 or place > sign * lines[last]:
                before = last
                last = k
            elif before < 0 or place > sign * lines[before]:
                before = k
    if last < 0:
        return
    place, drop = sign * lines[last], -1.0
    if before >= 0:
        drop = _potential(c, n, lines[last]) - _potential(c, n, lines[before])
    falls: int = _slope(c, n, lines[last]) < 0
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
    for k in range(n - 1):
        psi[k] = psi[k + 1]
    n -= 1
    gap = reach - place
    area, first, second, power = 0.0, 0.0, 0.0, 1.0
    for k in range(n):
        area += psi[k] / (k + 2) * power
        if k + 1 < n:
            first += 2 * psi[k + 1] / (k + 3) * power
            second += psi[k + 1] * power
        power *= gap
    end, bottom = psi[0] + gap * second, max(psi[0], 1e-100)
    if not (area > 0 and gap > 0 and end > 0):
        edge[at + 4] = -2
        return
    keep = 0.0
    if drop >= 0:
        # As the well comes near the barrier, its own series breaks down, and is faded out.
        rho = 8 * drop / (gap * gap * area)
        keep = (1 + rho) * math.exp(-rho)
    whole, t, mean = 1 / math.sqrt(bottom), gap * math.sqrt(2 * area), math.sqrt(2 * area * bottom)
    # 1/phi(end) less what is singular of it.
    rest = first * bottom - 2 * bottom * second - gap * second * second
    rest = rest / (end * mean * (end + mean)) + whole / t * keep
    if keep > 0.5:
        rest = 1 / (gap * end) - whole * (1 - keep) / t
    edge[at] = t
    edge[at + 1] = whole * (1 - keep)
    edge[at + 2] = rest
    edge[at + 3] = gap
    edge[at + 4] = last


def _cut(
    edge: list[float], at: int, lam: float, slope: float, length: float, found: list[float]
) -> None:
    """int e^{lam V}, int e^{-lam V}, the first beyond the end, and the double one, at a cut."""
    near = [0.0] * 3
    t, peak, root = edge[at], edge[at + 1], math.sqrt(lam)
    _dawson(t * root * math.sqrt(0.5), near)
    tail = peak * near[0] * math.sqrt(math.pi / 2) / root
    slow = peak * near[1] * math.sqrt(2.0) / root
    rest = edge[at + 2] / lam
    y = lam * slope * length
    first, second = 0.0, 0.0
    if length > 0:
        if abs(y) < 0.1:
            for k in range(9, -1, -1):
                first = (1 - y * first) / (k + 1)
                second = (1 - y * second) / (k + 2)
        else:
            first = -math.expm1(-y) / y
            second = (y + math.expm1(-y)) / (y * y)
    found[0] = length * first - tail - rest
    found[1] = slow + rest
    found[2] = length * first
    # The integral of Dawson's less its own logarithm, which the outer part has.
    area = near[2] - (0.5772156649015329 + math.log(2 * lam)) / 2 - math.log(t)
    found[3] = peak * peak * area / lam - slow * rest + length * length * second


def _primitive(
    c: list[float], n: int, at: int, u: float, lines: list[float], real: int, owner: list[int],
    rows: list[float], count: int, x: list[float], y: list[float], above: int, edge: list[float],
) -> float:  # fmt: skip
    """Of 1/phi on a path past all pairs, at the start (at = 1) or an end (0 or 2)."""
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
            distance = gap if cut == k else abs(u - lines[k])
            if distance == 0.0:
                return math.nan
            total += math.log(distance) / _slope(c, n, lines[k])
    if _PAIRS:
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
                far = side * u - side * rows[to + 6] - rows[to]
                total += _past(rows, to, far, beyond, gap if own == 1 else 0.0)
    return total


def _side(
    c: list[float], n: int, sign: float, r: float, slope: float, lam: float, lines: list[float],
    real: int, owner: list[int], rows: list[float], count: int, edge: list[float], at: int,
    outer: float, found: list[float],
) -> None:  # fmt: skip
    """int e^{lam V} and the double integral of one side, each with the height that is left out.

    Kinks, where the drift goes on without a jump, add nothing to order 0.
    """
    high_rank, high_height, high_value, onward = [0.0] * 32, [0.0] * 32, [0.0] * 32, [0.0] * 32
    low_rank, low_height, low_value = [0.0] * 32, [0.0] * 32, [0.0] * 32
    joint_height, joint_value, met, met_high = [0.0] * 16, [0.0] * 16, [0.0] * 16, [0.0] * 16
    values = [0.0] * 4
    highs, lows, joints, mets = 0, 0, 0, 0
    reach, straight = min(r, 1.0), 0.0
    for k in range(real):
        place = sign * lines[k]
        if owner[k] >= 0 or place <= 0 or place >= reach:
            continue
        rank = 1.0
        for j in range(real):
            if 0 < sign * lines[j] < place:
                rank += 1
        height, steep = _potential(c, n, lines[k]), _slope(c, n, lines[k])
        value = math.sqrt(2 * math.pi / (lam * abs(steep)))
        if steep > 0:
            high_rank[highs] = rank
            high_height[highs] = height
            high_value[highs] = value
            highs += 1
        else:
            low_rank[lows] = rank
            low_height[lows] = -height
            low_value[lows] = value
            lows += 1
    if _PAIRS:
        for m in range(count):
            to = 16 * m
            if rows[to + 9] < 0 or rows[to + 7] != sign:
                continue
            # Its two zeros' ranks; between two others for a complex pair.
            place = sign * rows[to + 6] + rows[to]
            near, far = 0.5, 0.5
            if rows[to + 8] >= 0:
                first: int = int(rows[to + 8])
                place = min(sign * lines[first], sign * lines[first + 1])
                near, far = 1.0, 2.0
            elif rows[to + 8] < 0:
                place = sign * rows[to + 6]
            for j in range(real):
                if 0 < sign * lines[j] < place:
                    near += 1
                    far += 1
            if rows[to + 2] < 0:
                place = near
                near = far
                far = place
            rise = max(rows[to + 3], 0.0)
            rise = 2 * rise * math.sqrt(rise) / 3
            height = _potential(c, n, rows[to + 6]) - rows[to + 5]
            _together(rows, to, lam, values)
            high_rank[highs] = far
            high_height[highs] = height + rise
            high_value[highs] = values[0]
            highs += 1
            low_rank[lows] = near
            low_height[lows] = rise - height
            low_value[lows] = values[1]
            lows += 1
            met[mets] = near
            met_high[mets] = far
            mets += 1
            if rows[to + 2] > 0:
                joint_height[joints] = 2 * rise
                joint_value[joints] = values[2]
                joints += 1
    if edge[at + 4] >= 0:
        best = 0
        for k in range(highs):
            if high_rank[k] > high_rank[best]:
                best = k
        height = high_height[best] - edge[at] * edge[at] / 2
        _cut(edge, at, lam, slope, max(r - 1, 0.0), values)
        high_rank[highs] = 100
        high_height[highs] = height
        high_value[highs] = values[0]
        onward[highs] = values[2]
        highs += 1
        low_rank[lows] = 100
        low_height[lows] = -height
        low_value[lows] = values[1]
        lows += 1
        joint_height[joints] = 0
        joint_value[joints] = values[3]
        joints += 1
    elif r > 1:
        straight = (r - 1) / slope
        high_rank[highs] = 200
        high_height[highs] = _potential(c, n, sign) - slope * (r - 1)
        high_value[highs] = -1 / (slope * lam)
        highs += 1
    else:
        height, value = _potential(c, n, sign * reach), sign / _horner(c, 0, n, sign * reach) / lam
        high_rank[highs] = 100
        high_height[highs] = height
        high_value[highs] = -value
        highs += 1
        low_rank[lows] = 100
        low_height[lows] = -height
        low_value[lows] = value
        lows += 1
    top, total = 0.0, 0.0
    for k in range(highs):
        top = max(top, high_height[k])
    for k in range(highs):
        total += high_value[k] * math.exp(lam * (high_height[k] - top))
    found[0] = top
    found[1] = total
    found[2] = total + sign / _horner(c, 0, n, 0.0) / lam * math.exp(-lam * top)
    # In a second pass all that counts is added, in units of the highest.
    top, total = 0.0, 0.0
    for turn in range(2):
        if turn == 1:
            total = (outer + straight) / lam * math.exp(-lam * top)
        for k in range(joints):
            if turn == 0:
                top = max(top, joint_height[k])
            else:
                total += joint_value[k] * math.exp(lam * (joint_height[k] - top))
        for k in range(lows):
            for j in range(highs):
                apart: int = low_rank[k] <= high_rank[j]
                for m in range(mets):
                    if met[m] == low_rank[k] and met_high[m] == high_rank[j]:
                        apart = 0
                value, height = high_value[j], low_height[k] + high_height[j]
                if low_rank[k] == high_rank[j]:
                    value, height = onward[j], 0.0
                if apart == 1 and value != 0.0:
                    if turn == 0:
                        top = max(top, height)
                    else:
                        total += low_value[k] * value * math.exp(lam * (height - top))
    found[3] = top
    found[4] = total


def _log_uniform(
    c: list[float], n: int, left_terms: list[float], left_count: int, right_terms: list[float],
    right_count: int, kappa: float, r: float,
) -> float:  # fmt: skip
    """log T from 0, to order 0; not a number where the formula does not tell it."""
    # The drift beyond the layer may be small, a sum of what is not.
    a_minus, a_plus = _added(left_terms, left_count), _added(right_terms, right_count)
    lines, rows, x, y = [0.0] * 13, [0.0] * 208, [0.0] * 13, [0.0] * 13
    owner, edge, left, right, ends = [0] * 13, [0.0] * 10, [0.0] * 5, [0.0] * 5, [0.0] * 3
    while n > 1 and c[n - 1] == 0.0:
        n -= 1
    if not (1e-8 <= kappa <= 1e8 and 0 < r <= 1e12 and a_minus != 0.0 and a_plus != 0.0):
        return math.nan
    reach, lam = min(r, 1.0), 2 / (kappa * kappa)
    if _clear(c, n, 0.0) == 0:
        return math.nan
    if r <= 1 and (_clear(c, n, reach) == 0 or _clear(c, n, -reach) == 0):
        return math.nan
    real, count, above = _lines(c, n, lines), 0, 0
    for k in range(13):
        owner[k] = -1
    if _PAIRS:
        psi = [0.0] * 169
        if n > 2:
            count = _pairs(c, n, r, lines, real, rows, psi)
            _choose(rows, count)
        for k in range(count):
            first: int = int(rows[16 * k + 8])
            if rows[16 * k + 9] > 0 and first >= 0:
                owner[first] = k
                owner[first + 1] = k
        above = _complex(c, n, lines, real, owner, rows, count, x, y)
        if above < 0:
            return math.nan
    if not _rough(c, n, lines, real, owner, rows, count, x, y, above) < 1e-10:
        return math.nan
    _edge(c, n, -1.0, reach, lines, real, owner, rows, edge, 0)
    _edge(c, n, 1.0, reach, lines, real, owner, rows, edge, 5)
    if edge[4] < -1 or edge[9] < -1:
        return math.nan
    for k in range(3):
        ends[k] = _primitive(
            c, n, k, (k - 1) * reach, lines, real, owner, rows, count, x, y, above, edge
        )
    _side(
        c, n, -1.0, r, -a_minus, lam, lines, real, owner, rows, count, edge, 0,
        ends[0] - ends[1], left,
    )  # fmt: skip
    _side(
        c, n, 1.0, r, a_plus, lam, lines, real, owner, rows, count, edge, 5,
        ends[2] - ends[1], right,
    )  # fmt: skip
    top = max(left[0], right[0])
    total = left[1] * math.exp(lam * (left[0] - top)) + right[1] * math.exp(lam * (right[0] - top))
    behind, ahead = left[0] - top + right[3], right[0] - top + left[3]
    high = max(behind, ahead, min(left[0], right[0]))
    found = right[4] * left[2] / total * math.exp(lam * (behind - high))
    found += left[4] * right[2] / total * math.exp(lam * (ahead - high))
    if not 0 < found < 1e300:
        return math.nan
    return math.log(found * lam) + lam * high
