"""Zeros that may meet, to be emitted (see `symasym.emit.kernels.uniform`).

A row about a pair has 16 numbers: middle, square, sign, zeta, slope, level (`cubic_pair.Pair`),
point, side, the lower of two real zeros or -1, 1 where it is taken together (else -1), and the sums
of the even and the odd terms of what is left of the drift.
"""

from __future__ import annotations

import math

from symasym.emit.kernels.airy import _airy
from symasym.emit.kernels.uniform_roots import _lines, _potential, _shift


def _split(c: list[float], n: int, psi: list[float], at: int, row: list[float], to: int) -> int:
    """The two zeros about a turning point as a factor; 0 if they are not by themselves."""
    own, here = [0.0] * 13, [0.0] * 13
    sign = 1.0 if c[2] > 0 else -1.0
    if c[2] == 0.0:
        return 0
    for k in range(n):
        own[k] = sign * c[k]
        here[k] = own[k]
    middle, square = 0.0, -own[0] / own[2]
    done: int = 0
    for _ in range(40):
        if done == 1:
            break
        value, odd_value, down, odd_down, along, odd_along = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        power, before = 1.0, 0.0
        for j in range((n + 1) // 2):
            value += here[2 * j] * power
            down += j * here[2 * j] * before
            odd_along += 2 * j * here[2 * j] * before
            if 2 * j + 1 < n:
                odd_value += here[2 * j + 1] * power
                odd_down += j * here[2 * j + 1] * before
                along += (2 * j + 1) * here[2 * j + 1] * power
            before = power
            power *= square
        det = along * odd_down - down * odd_along
        if det == 0.0 or not abs(square) < 1e100:
            return 0
        step = (odd_down * value - down * odd_value) / det
        # The new middle's own share of the distance is in the other equation.
        wide = (along * odd_value - odd_along * value) / det
        middle -= step
        square -= wide
        for k in range(n):
            here[k] = own[k]
        _shift(here, n, middle)
        known = abs(square) + (own[1] / own[2]) * (own[1] / own[2])
        if abs(wide) <= 1e-14 * known and step * step <= 1e-28 * known:
            done = 1
    if done == 0:
        return 0
    for k in range(n - 2):
        psi[at + k] = here[k + 2]
    for k in range(n - 5, -1, -1):
        psi[at + k] += square * psi[at + k + 2]
    mean, even, odd, tilt, power = 0.0, 0.0, 0.0, 0.0, 1.0
    for j in range((n - 1) // 2):
        i = 2 * j
        even += psi[at + i] * power
        mean += 3 * psi[at + i] / ((i + 1) * (i + 3)) * power
        if i + 1 < n - 2:
            odd += psi[at + i + 1] * power
            tilt -= 2 * psi[at + i + 1] / ((i + 2) * (i + 4)) * power
        power *= square
    if not (mean > 0 and even > 0 and even * even > odd * odd * square):
        return 0
    if square > 0 and middle * middle > square * 1.0001 and own[1] == 0.0:
        return 0
    root = math.cbrt(mean)
    row[to] = middle
    row[to + 1] = square
    row[to + 2] = sign
    row[to + 3] = square * root * root
    row[to + 4] = 1 / root
    row[to + 5] = sign * (-_potential(own, n, middle) + square * square * tilt)
    row[to + 10] = even
    row[to + 11] = odd
    return 1


def _pairs(
    c: list[float], n: int, r: float, lines: list[float], real: int, rows: list[float],
    psi: list[float],
) -> int:  # fmt: skip
    """Pairs of zeros about the turning points on one side of the start each: how many rows."""
    slope, turning, here = [0.0] * 13, [0.0] * 13, [0.0] * 13
    for k in range(1, n):
        slope[k - 1] = k * c[k]
    turns = _lines(slope, n - 1, turning)
    reach, count = min(r, 1.0), 0
    for t in range(turns):
        point = turning[t]
        if abs(point) >= reach or point == 0.0:
            continue
        # Seen in the mirror, phi(u) becomes -phi(-u).
        side = -1.0 if point < 0 else 1.0
        for k in range(n):
            here[k] = c[k]
        _shift(here, n, point)
        if side < 0:
            for k in range(0, n, 2):
                here[k] = -here[k]
        to = 16 * count
        if _split(here, n, psi, 13 * count, rows, to) == 0:
            continue
        middle, square = point + side * rows[to], rows[to + 1]
        first, seen = -1, 0
        for k in range(real - 1):
            low, high = lines[k], lines[k + 1]
            wide = (high - low) * (high - low)
            if abs(low + high - 2 * middle) + abs(wide - 4 * square) < 1e-6:
                seen = 1
                right: int = low > 0 and high < 1
                left: int = low > -1 and high < 0
                if (right == 1 or left == 1) and abs(low) < r and abs(high) < r:
                    first = k
        if first < 0:
            nearest = abs(point - middle)
            own: int = 1
            for k in range(turns):
                # A complex pair may be found from several turning points.
                if abs(turning[k] - middle) * (1 + 1e-6) < nearest:
                    own = 0
            if own == 0 or seen == 1 or square > 1e-6:
                continue
            if side * middle <= 0 or side * middle >= reach:
                continue
            # Airy functions take the integrals over all of the line: not where that is cut.
            height = _potential(c, n, point) - rows[to + 5]
            room = abs(height)
            if r < 1:
                room = min(room, abs(_potential(c, n, side * reach) - height))
            fall = max(-rows[to + 3], 0.0)
            if 4 * fall * math.sqrt(fall) / 3 > room:
                continue
        rows[to + 6] = point
        rows[to + 7] = side
        rows[to + 8] = first
        rows[to + 9] = 1.0 if first < 0 else 0.0
        count += 1
    return count


def _choose(rows: list[float], count: int) -> None:
    """Each real zero goes with the neighbour that it meets first."""
    for _ in range(count):
        best = -1
        for k in range(count):
            open_: int = rows[16 * k + 9] == 0.0
            if open_ == 1 and (best < 0 or abs(rows[16 * k + 3]) < abs(rows[16 * best + 3])):
                best = k
        if best < 0:
            break
        for k in range(count):
            if rows[16 * k + 9] == 0.0 and abs(rows[16 * k + 8] - rows[16 * best + 8]) <= 1:
                rows[16 * k + 9] = 1.0 if k == best else -1.0


def _together(rows: list[float], at: int, lam: float, found: list[float]) -> None:
    """int e^{lam V}, int e^{-lam V} and the double integral over a pair, heights left out."""
    airy = [0.0] * 4
    square, even, odd = rows[at + 1], rows[at + 10], rows[at + 11]
    # u' = a + b s at both zeros.
    norm = even * even - odd * odd * square
    a = math.sqrt((even + math.sqrt(norm)) / (2 * rows[at + 4] * norm))
    b = -rows[at + 2] * odd / (2 * a * norm)
    third = math.cbrt(lam)
    small = 1 / third
    _airy(third * third * rows[at + 3], 4, airy)
    even = a * airy[2] * math.pi * small
    odd = b * airy[3] * math.pi * small * small
    found[0] = even + odd
    found[1] = even - odd
    unit = math.pi * small * math.pi * small
    found[2] = unit * (a * a * airy[0] - b * b * airy[1] * small * small)


def _turn(square: float, y: float) -> float:
    """artanh(root/y)/root, root^2 = square, and atan for square < 0."""
    q, root = square / (y * y), math.sqrt(abs(square))
    if abs(q) < 1e-4:
        return (1 + q * (1 / 3 + q * (1 / 5 + q * (1 / 7 + q * (1 / 9 + q / 11))))) / y
    if square > 0:
        return math.log(abs((y + root) / (y - root))) / 2 / root
    return math.atan2(root, y) / root


def _past(rows: list[float], at: int, y: float, beyond: int, gap: float) -> float:
    """A primitive of a pair's share of 1/phi past both zeros; `gap` from the barrier, if > 0."""
    square, sign, even, odd = rows[at + 1], rows[at + 2], rows[at + 10], rows[at + 11]
    norm = even * even - odd * odd * square
    alpha, beta = sign * even / norm, -sign * odd / norm
    if gap > 0:
        twice = max(2 * math.sqrt(max(square, 0.0)), 1e-290)
        fall = -alpha * math.log1p(twice / gap) / twice
        return fall + beta / 2 * (math.log(gap) + math.log(gap + twice))
    way = 1.0 if beyond == 1 else -1.0
    found = beta / 2 * math.log(abs(y * y - square))
    return found - way * alpha * _turn(square, way * y)
