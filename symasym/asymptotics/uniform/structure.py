"""Zeros of one polynomial drift in doubles: simple ones, and pairs that may coalesce as factors.

What is alone and what is taken together is decided here for one drift: the library runs these
functions as they stand (`symasym.asymptotics.uniform.order_zero`), and `symasym.emit` writes them
into a file, as they are or, through `symasym.emit.kernels.transcribe`, in another language. So they
hold floats, whole numbers and lists of fixed length only, and what stands under `_PAIRS` (the drift
may have a pair of zeros) or `_MANY` (two pairs of complex ones) is left out where a drift does not
need it. `.pairing_arrays` decides the same for the columns of an array.

A drift is c[0] + c[1] u + ... + c[n - 1] u^(n - 1). A pair's middle and its distance squared are
analytic in the coefficients, so that both are as exact at a fold as anywhere. A row about a pair
has 16 numbers: middle, square, sign, zeta, slope, level (`symasym.series.quadratic_factor.Pair`),
point, side, the lower of two real zeros or -1, 1 where it is taken together (else -1), and the sums
of the even and the odd terms of what is left of the drift.
"""

from __future__ import annotations

import math

# Put in when a file is written.
_PAIRS = _MANY = True


def _horner(c: list[float], at: int, n: int, u: float) -> float:
    """The polynomial of n coefficients from c[at] on."""
    total = 0.0
    for k in range(n - 1, -1, -1):
        total = total * u + c[at + k]
    return total


def _zeros(c: list[float], n: int, low: float, high: float, found: list[float]) -> int:
    """Zeros in (low, high) at which the sign changes, ascending: one between two of the slope."""
    slope, marks = [0.0] * 128, [0.0] * 128
    while n > 1 and c[n - 1] == 0.0:
        n -= 1
    if n < 2:
        return 0
    for k in range(1, n):
        slope[k - 1] = k * c[k]
    turns, count, a = _zeros(slope, n - 1, low, high, marks), 0, low
    for k in range(turns + 1):
        b = marks[k] if k < turns else high
        next_a = b
        before, after, kept = _horner(c, 0, n, a), _horner(c, 0, n, b), 0
        below: int = before > 0
        above: int = after > 0
        if below != above:
            for step in range(2000):
                # The secant by the Illinois method, halved now and then.
                m = b - after * ((b - a) / (after - before))
                if step % 8 == 7 or not a < m < b:
                    m = (a + b) / 2
                value = _horner(c, 0, n, m)
                if value == 0.0:
                    a = m
                    b = m
                if not a < m < b:
                    break
                now: int = value > 0
                if now == below:
                    a = m
                    before = value
                    after = after / 2 if kept == 1 else after
                    kept = 1
                else:
                    b = m
                    after = value
                    before = before / 2 if kept == 2 else before
                    kept = 2
            found[count] = (a + b) / 2
            count += 1
        a = next_a
    return count


def _added(terms: list[float], n: int) -> float:
    """The sum with what each addition has rounded off."""
    total, rest = 0.0, 0.0
    for k in range(n):
        after = total + terms[k]
        if abs(total) >= abs(terms[k]):
            rest += total - after + terms[k]
        else:
            rest += terms[k] - after + total
        total = after
    return total + rest


def _slope(c: list[float], n: int, u: float) -> float:
    """Its derivative."""
    total = 0.0
    for k in range(n - 1, 0, -1):
        total = total * u + k * c[k]
    return total


def _potential(c: list[float], n: int, u: float) -> float:
    """V, from the start on."""
    total = 0.0
    for k in range(n - 1, -1, -1):
        total = total * u - c[k] / (k + 1)
    return total * u


def _shift(c: list[float], n: int, by: float) -> None:
    """Make u + by of u."""
    for start in range(n - 1):
        for j in range(n - 2, start - 1, -1):
            c[j] += by * c[j + 1]


def _real_zeros(c: list[float], n: int, found: list[float]) -> int:
    """All real zeros at which the sign changes, ascending."""
    bound = 0.0
    while n > 1 and c[n - 1] == 0.0:
        n -= 1
    for k in range(1, n):
        bound = max(bound, abs(c[k - 1] / c[n - 1]))
    return _zeros(c, n, -1.0 - bound, 1.0 + bound, found)


def _newton(c: list[float], n: int, x: list[float], y: list[float], k: int) -> None:
    """A few of Newton's steps at a complex zero."""
    for _ in range(4):
        re, im, down, down_im = 0.0, 0.0, 0.0, 0.0
        for j in range(n - 1, -1, -1):
            turned = down * x[k] - down_im * y[k] + re
            down_im = down * y[k] + down_im * x[k] + im
            down = turned
            turned = re * x[k] - im * y[k] + c[j]
            im = re * y[k] + im * x[k]
            re = turned
        size = down * down + down_im * down_im
        if size > 0:
            x[k] -= (re * down + im * down_im) / size
            y[k] -= (im * down - re * down_im) / size


def _circle(c: list[float], n: int, x: list[float], y: list[float]) -> None:
    """All zeros at once, by the method of Weierstrass."""
    size = math.exp(math.log(abs(c[0] / c[n - 1])) / (n - 1))
    for k in range(n - 1):
        x[k] = size * math.cos(0.4 + 2 * math.pi * k / (n - 1))
        y[k] = size * math.sin(0.4 + 2 * math.pi * k / (n - 1))
    for _ in range(500):
        moved = 0.0
        for k in range(n - 1):
            re, im = c[n - 1], 0.0
            for j in range(n - 2, -1, -1):
                turned = re * x[k] - im * y[k] + c[j]
                im = re * y[k] + im * x[k]
                re = turned
            down, down_im = c[n - 1], 0.0
            for j in range(n - 1):
                if j != k:
                    turned = down * (x[k] - x[j]) - down_im * (y[k] - y[j])
                    down_im = down * (y[k] - y[j]) + down_im * (x[k] - x[j])
                    down = turned
            wide = down * down + down_im * down_im
            if wide > 0:
                step = (re * down + im * down_im) / wide
                step_im = (im * down - re * down_im) / wide
                x[k] -= step
                y[k] -= step_im
                moved = max(moved, abs(step) + abs(step_im))
        if moved < 1e-13 * size:
            break


def _without(c: list[float], n: int, middle: float, square: float, width: int) -> None:
    """Divide by u - middle, or by (u - middle)^2 - square; what is left over is 0."""
    one, two = middle, 0.0
    if width == 2:
        one, two = 2 * middle, square - middle * middle
    for k in range(n - 2, -1, -1):
        c[k] += one * c[k + 1]
        if width == 2 and k + 2 < n:
            c[k] += two * c[k + 2]
    for k in range(n - width):
        c[k] = c[k + width]


def _complex(
    c: list[float], n: int, roots: list[float], real: int, owner: list[int], rows: list[float],
    count: int, x: list[float], y: list[float],
) -> int:  # fmt: skip
    """Zeros above the real line that are in no pair; -1 if they are not found."""
    rest, left = [0.0] * 13, n
    for k in range(n):
        rest[k] = c[k]
    for k in range(real):
        if owner[k] < 0:
            _without(rest, left, roots[k], 0.0, 1)
            left -= 1
    for k in range(count):
        if rows[16 * k + 9] > 0:
            middle = rows[16 * k + 6] + rows[16 * k + 7] * rows[16 * k]
            _without(rest, left, middle, rows[16 * k + 1], 2)
            left -= 2
    if left == 1:
        return 0
    if left == 3:
        x[0] = -rest[1] / (2 * rest[2])
        wide = rest[0] / rest[2] - x[0] * x[0]
        if not wide > 0:
            return -1
        y[0] = math.sqrt(wide)
        _newton(c, n, x, y, 0)
        return 1
    found = 0
    if _MANY:
        if left % 2 == 0 or rest[0] == 0.0:
            return -1
        _circle(rest, left, x, y)
        for k in range(left - 1):
            _newton(c, n, x, y, k)
            if y[k] > 0:
                x[found] = x[k]
                y[found] = y[k]
                found += 1
    return found if 2 * found == left - 1 else -1


def _zero_rounding(
    c: list[float], n: int, roots: list[float], real: int, owner: list[int], rows: list[float],
    count: int, x: list[float], y: list[float], above: int,
) -> float:  # fmt: skip
    """The rounding error of the zeros that are in no pair, in units of their distances."""
    worst = 0.0
    for k in range(real + above):
        re, im = roots[k] if k < real else 0.0, 0.0
        if k >= real:
            re, im = x[k - real], y[k - real]
        elif owner[k] >= 0:
            continue
        near, size = 1 + math.hypot(re, im), 0.0
        for j in range(n - 1, -1, -1):
            size = size * math.hypot(re, im) + abs(c[j])
        for j in range(real):
            if j != k:
                near = min(near, math.hypot(re - roots[j], im))
        steep, steep_im = 0.0, 0.0
        for j in range(n - 1, 0, -1):
            turned = steep * re - steep_im * im + j * c[j]
            steep_im = steep * im + steep_im * re
            steep = turned
        if _PAIRS:
            for j in range(above):
                near = min(near, math.hypot(re - x[j], im + y[j]))
                if j + real != k:
                    near = min(near, math.hypot(re - x[j], im - y[j]))
            for j in range(count):
                if rows[16 * j + 9] > 0:
                    middle = rows[16 * j + 6] + rows[16 * j + 7] * rows[16 * j]
                    near = min(near, math.hypot(re - middle, im))
        worst = max(worst, size / max(near * math.hypot(steep, steep_im), 1e-300))
    return 2.3e-16 * (1 + worst)


def _clear(c: list[float], n: int, u: float) -> int:
    """1 where the drift is not beside a zero, else 0."""
    size = 0.0
    for k in range(n - 1, -1, -1):
        size = size * abs(u) + abs(c[k])
    return 1 if abs(_horner(c, 0, n, u)) > 1e-7 * size else 0


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
    c: list[float], n: int, start: float, r: float, roots: list[float], real: int,
    rows: list[float], psi: list[float], exponential_gap: list[float],
) -> int:  # fmt: skip
    """Pairs of zeros about the turning points on one side of the start each: how many rows.

    `start` is in the layer or at its end. Leaving complex pairs out, or taking them where they are
    cut through, costs e^(-lam exponential_gap[0]).
    """
    slope, turning, here = [0.0] * 13, [0.0] * 13, [0.0] * 13
    for k in range(1, n):
        slope[k - 1] = k * c[k]
    turns = _real_zeros(slope, n - 1, turning)
    reach, count = min(r, 1.0), 0
    for t in range(turns):
        point = turning[t]
        if abs(point) >= reach or point == start:
            continue
        # Seen in the mirror, phi(u) becomes -phi(-u).
        side = -1.0 if point < start else 1.0
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
            low, high = roots[k], roots[k + 1]
            wide = (high - low) * (high - low)
            if abs(low + high - 2 * middle) + abs(wide - 4 * square) < 1e-6:
                seen = 1
                right: int = low > start and high < 1
                left: int = low > -1 and high < start
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
            # Airy functions take the integrals over all of the line: not where that is cut.
            height, barrier = _potential(c, n, point) - rows[to + 5], math.inf
            if abs(start) < 1:
                barrier = abs(_potential(c, n, start) - height)
            if r < 1:
                barrier = min(barrier, abs(_potential(c, n, side * reach) - height))
            # Beyond the layer the drift is another function, and the pair none of its own.
            if side * middle <= side * start or side * middle >= reach:
                barrier = 0.0
            fall = max(-rows[to + 3], 0.0)
            fall = 4 * fall * math.sqrt(fall) / 3
            if square < 0:
                exponential_gap[0] = min(exponential_gap[0], max(barrier, fall))
            if fall > barrier:
                continue
        rows[to + 6] = point
        rows[to + 7] = side
        rows[to + 8] = first
        rows[to + 9] = 1.0 if first < 0 else 0.0
        count += 1
    return count


def _choose(rows: list[float], count: int) -> None:
    """Each real zero goes with the neighbour with which it coalesces first."""
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


def _structure(
    c: list[float], n: int, start: float, r: float, roots: list[float], owner: list[int],
    rows: list[float], psi: list[float], x: list[float], y: list[float], counts: list[int],
    exponential_gap: list[float],
) -> int:  # fmt: skip
    """The number of real zeros: `roots`, each with the row of its pair, or -1.

    Also rows of pairs with what is left of the drift, and zeros above the real line that are in no
    pair; `counts` are how many of both. -1 where doubles do not tell.
    """
    real: int = _real_zeros(c, n, roots)
    count: int = 0
    above: int = 0
    exponential_gap[0] = math.inf
    for k in range(13):
        owner[k] = -1
    if _PAIRS:
        if n > 2:
            count = _pairs(c, n, start, r, roots, real, rows, psi, exponential_gap)
            _choose(rows, count)
        for k in range(count):
            first: int = int(rows[16 * k + 8])
            if rows[16 * k + 9] > 0 and first >= 0:
                owner[first] = k
                owner[first + 1] = k
        above = _complex(c, n, roots, real, owner, rows, count, x, y)
        if above < 0:
            return -1
    counts[0] = count
    counts[1] = above
    rounding = _zero_rounding(c, n, roots, real, owner, rows, count, x, y, above)
    return real if rounding < 1e-10 else -1
