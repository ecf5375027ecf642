"""Gauss-Legendre's quadrature, quotients that are 0/0, and what `math` raises for, to be emitted.

Helpers of the emitted files: those in Python hold them as they stand, C and JavaScript as
`symasym.emit.kernels.transcribe` writes them. For what C and JavaScript have of their own
(`symasym.emit.kernels.transcribe`) only the target "python" takes the first four.
"""

from __future__ import annotations

import math
from collections.abc import Callable


def _exp(x: float) -> float:
    # math.exp raises where this is infinite.
    return math.exp(x) if x < 709.78 else math.exp(x - 9) * math.exp(9) if x < 718 else math.inf


def _expm1(x: float) -> float:
    return math.expm1(x) if x < 709 else _exp(x)


def _sinh(x: float) -> float:
    return math.copysign(_exp(abs(x)) / 2, x) if abs(x) > 700 else math.sinh(x)


def _cosh(x: float) -> float:
    return _exp(abs(x)) / 2 if abs(x) > 700 else math.cosh(x)


Curve = Callable[[float], float]

# Put in when a file is written (`symasym.emit.kernels.tables`).
_GAUSS_X: list[float] = []
_GAUSS_W: list[float] = []


def _panel(g: Curve, a: float, b: float, top: float) -> float:
    """The integral of e^(g - top) by Gauss-Legendre, 16 points."""
    m, h, total = (a + b) / 2, (b - a) / 2, 0.0
    for k in range(8):
        left, right = g(m - h * _GAUSS_X[k]), g(m + h * _GAUSS_X[k])
        total += _GAUSS_W[k] * (math.exp(left - top) + math.exp(right - top))
    return h * total


def _halved(g: Curve, a: float, b: float, top: float, depth: int, before: float) -> float:
    """The same, halved until it is known; `before` is how much the last halving changed."""
    # The exponent's own rounding: no halving gets below it.
    noise = 4e-16 * abs(top)
    ga, gb, m = g(a), g(b), (a + b) / 2
    if max(ga, gb) < top - 100:
        return 0.0
    if abs(ga - gb) > 4 and depth < 100:
        return _halved(g, a, m, top, depth + 1, before) + _halved(g, m, b, top, depth + 1, before)
    halves = _panel(g, a, m, top) + _panel(g, m, b, top)
    error = abs(halves - _panel(g, a, b, top))
    # Where halving hardly helps, rounding is all there is.
    rounding: int = error <= max(1e-9, 1e3 * noise) * halves and error > before / 16
    if not error > (4e-15 + noise) * halves or rounding == 1 or depth > 100:
        return halves
    return _halved(g, a, m, top, depth + 1, error) + _halved(g, m, b, top, depth + 1, error)


def _log_integral(g: Curve, marks: list[float], count: int, lower: float, upper: float) -> float:
    """Logarithm of the integral of e^g; g is monotone between -1, the marks and 1."""
    points, number = [0.0] * 1032, 1
    points[0] = lower
    for k in range(-1, count + 1):
        m = -1.0 if k < 0 else 1.0
        if 0 <= k < count:
            m = marks[k]
        if lower < m < upper:
            points[number] = m
            number += 1
    points[number] = upper
    top, total = g(lower), 0.0
    for k in range(number):
        top = max(top, g(points[k + 1]))
    for k in range(number):
        total += _halved(g, points[k], points[k + 1], top, 0, math.inf)
    return top + math.log(total)


def _logaddexp(x: float, y: float) -> float:
    high = max(x, y)
    return high if abs(high) == math.inf else high + math.log1p(math.exp(-abs(x - y)))


def _exprel(x: float) -> float:
    return 1.0 if x == 0 else _expm1(x) / x


def _exprel2(x: float) -> float:
    if abs(x) > 0.5:
        return (_expm1(x) - x) / x / x
    total = 0.0
    for n in range(15, 1, -1):
        total = (1 + x * total) / n
    return total


def _tanhc(x: float) -> float:
    return 1.0 if x == 0 else math.tanh(x) / x


def _sinc(x: float) -> float:
    return 1.0 if x == 0 else math.sin(x) / x


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
