"""Zeros of one polynomial in doubles, written to be emitted (see `kernels.uniform`)."""

from __future__ import annotations

import math

from symasym.emit.kernels.elementary import _horner, _zeros

# Put in when a file is written.
_PAIRS = _MANY = True


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


def _lines(c: list[float], n: int, found: list[float]) -> int:
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
    c: list[float], n: int, lines: list[float], real: int, owner: list[int], rows: list[float],
    count: int, x: list[float], y: list[float],
) -> int:  # fmt: skip
    """Zeros above the real line that are in no pair; -1 if they are not found."""
    rest, left = [0.0] * 13, n
    for k in range(n):
        rest[k] = c[k]
    for k in range(real):
        if owner[k] < 0:
            _without(rest, left, lines[k], 0.0, 1)
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


def _rough(
    c: list[float], n: int, lines: list[float], real: int, owner: list[int], rows: list[float],
    count: int, x: list[float], y: list[float], above: int,
) -> float:  # fmt: skip
    """The rounding error of the zeros that are in no pair, in units of their distances."""
    worst = 0.0
    for k in range(real + above):
        re, im = lines[k] if k < real else 0.0, 0.0
        if k >= real:
            re, im = x[k - real], y[k - real]
        elif owner[k] >= 0:
            continue
        near, size = 1 + math.hypot(re, im), 0.0
        for j in range(n - 1, -1, -1):
            size = size * math.hypot(re, im) + abs(c[j])
        for j in range(real):
            if j != k:
                near = min(near, math.hypot(re - lines[j], im))
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
