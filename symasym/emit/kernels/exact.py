"""The exact escape time in double precision, to be emitted.

Helpers of the emitted files: those in Python hold them as they stand, C and JavaScript as
`symasym.emit.kernels.transcribe` writes them.

From each end to the start, the layer is cut at the zeros of the drift. On a stretch where phi
keeps its sign, M' = 1 - lam |phi| M from M = 0 is solved forwards and backwards: its last values
are the integrals of e^{lam V} and of e^{-lam V} in units of their maxima, and its own integral,
which is the same both ways, is the double integral of the falling exponent. So nothing is an
exponential, and nothing grows. Radau's collocation is stable at any step: where lam |phi| is
large, M is smooth, and a step may be as long as that lasts; the cost grows with log(lam).
Stretches are put together by panel-step, and both sides by positive-form, every term positive.
"""

from __future__ import annotations

import math

from symasym.emit.kernels.elementary import Curve, _exprel, _exprel2, _logaddexp

# Put in when a file is written (`symasym.emit.kernels.tables`).
_RADAU: list[float] = []
_RADAU_WITHIN: list[float] = []
_RADAU_LAST: list[float] = []


def _solved(rows: list[float], values: list[float]) -> None:
    """A linear system of 16 by elimination; each row of 17 ends with its right-hand side."""
    for k in range(16):
        top, best = 17 * k, 17 * k
        for at in range(top + 17, 272, 17):
            if abs(rows[at + k]) > abs(rows[best + k]):
                best = at
        if best != top:
            for j in range(k, 17):
                x = rows[top + j]
                rows[top + j] = rows[best + j]
                rows[best + j] = x
        for at in range(top + 17, 272, 17):
            factor = rows[at + k] / rows[top + k]
            for j in range(k + 1, 17):
                rows[at + j] -= factor * rows[top + j]
    for k in range(15, -1, -1):
        rest = rows[17 * k + 16]
        for j in range(k + 1, 16):
            rest -= rows[17 * k + j] * values[j]
        values[k] = rest / rows[18 * k]


def _collocated(
    drift: Curve, scale: float, h: float, end: float, u: float, step: float, result: list[float]
) -> None:
    """M after a step, its integral, the slope's; the sizes of M, its last terms, the slope."""
    rows, slopes, values = [0.0] * 272, [0.0] * 16, [0.0] * 16
    for j in range(16):
        slopes[j] = scale * drift(u + _RADAU[j] * step)
        size = abs(slopes[j])
        for i in range(16):
            rows[17 * i + j] = _RADAU_WITHIN[16 * i + j] * size
    for i in range(16):
        rows[18 * i] += 1.0
        rows[17 * i + 16] = end + _RADAU[i] * h
    _solved(rows, values)
    area, drop, before, last, top, least = 0.0, 0.0, 0.0, 0.0, 0.0, math.inf
    for j in range(16):
        area += _RADAU_WITHIN[240 + j] * values[j]
        drop += _RADAU_WITHIN[240 + j] * slopes[j]
        before += _RADAU_LAST[j] * values[j]
        last += _RADAU_LAST[16 + j] * values[j]
        top = max(top, abs(values[j]))
        least = min(least, abs(slopes[j]))
    result[0], result[1], result[2] = values[15], h * area, drop
    result[3], result[4], result[5] = top, max(abs(before), abs(last)), least


def _relaxed(
    drift: Curve, rough: float, lam: float, a: float, b: float, result: list[float]
) -> float:
    """M' = 1 - lam |drift| M from a, M = 0, to b: M there; its integral, lam times the drift's."""
    here = [0.0] * 6
    end, u, step, growth = 0.0, a, b - a, 2.0
    result[0], result[1] = 0.0, 0.0
    for _ in range(100000):
        last: int = abs(step) >= abs(b - u) * (1 - 1e-12)
        if last == 1:
            step = b - u
        h = abs(step)
        _collocated(drift, lam * h, h, end, u, step, here)
        # What the drift's rounding makes of M: no halving gets below it.
        noise = lam * h * rough / (1 + here[5])
        # Of a step that is not stiff, the end and the integral have twice the order of the rest.
        allowed = 1e-10 if abs(here[2]) < 7 else 1e-13
        if here[4] > max(allowed, min(noise, 1e-6)) * here[3]:
            step /= 2
            growth = 1.0
            if u + step == u:
                break
            continue
        end = here[0]
        result[0] += here[1]
        result[1] += here[2]
        if last == 1:
            return end
        u += step
        step *= growth
        growth = 2.0
    raise ArithmeticError(
        f"lam = 2/kappa^2 is {lam}, for which M changes beside u = {u} over less than doubles tell "
        "apart; give a larger kappa, or emit the target mpmath"
    )


def _sweep(
    drift: Curve, ends: list[float], rough: float, lam: float, points: list[float], count: int,
    result: list[float], most: list[float],
) -> None:  # fmt: skip
    """log sigma and log w at the last of the points, from the end at the first; their errors.

    Also the most that both directions differ by in a drop of lam V, and in a double integral.
    """
    fore, aft = [0.0] * 2, [0.0] * 2
    sigma, w, loose_sigma, loose, log_lam = -math.inf, -math.inf, 0.0, 0.0, math.log(lam)
    for k in range(count - 1):
        p, q = points[k], points[k + 1]
        if max(abs(p), abs(q)) > 1:
            h = abs(q - p)
            drop = lam * ends[1 if p > 0 else 0] * h
            x = abs(drop)
            ahead = h * _exprel(-x)
            back, area, slip, wrong = ahead, h * h * _exprel2(-x), 0.0, 0.0
        else:
            ahead = _relaxed(drift, rough, lam, p, q, fore)
            back = _relaxed(drift, rough, lam, q, p, aft)
            area, drop, x = fore[0], fore[1], abs(fore[1])
            slip, wrong = abs(drop - aft[1]), abs(area / aft[0] - 1)
            most[0] = max(most[0], slip)
            most[1] = max(most[1], wrong)
        back = math.log(back)
        area = log_lam + math.log(area)
        if (drop > 0) == (q > p):
            # V falls.
            ahead = log_lam + math.log(ahead)
            total = _logaddexp(sigma, back)
            part = math.exp(area - x - total - ahead)
            first = w - _logaddexp(0.0, back - sigma) - x
            w = _logaddexp(first, ahead + math.log1p(-part))
            known = math.exp(sigma - total) * loose_sigma + wrong
            loose = math.exp(first - w) * (loose + loose_sigma + slip) + 2 * part * known + wrong
            loose_sigma = known + slip
            sigma = total + x
        else:
            # V rises.
            ahead = math.log(ahead)
            total = _logaddexp(sigma - x, ahead)
            kept = math.exp(sigma - x - total)
            first = _logaddexp(w, log_lam + back) - _logaddexp(-x, ahead - sigma)
            w = _logaddexp(first, area - total)
            loose = math.exp(first - w) * (loose + kept * slip + (1 - kept) * loose_sigma) + wrong
            loose_sigma = kept * (loose_sigma + slip) + wrong
            loose += loose_sigma
            sigma = total
    result[0], result[1], result[2], result[3] = sigma, w, loose_sigma, loose


def _stretches(end: float, marks: list[float], count: int, points: list[float]) -> int:
    """The end, what of -1, 1 and the marks lies between that and 0, from outside, and 0."""
    sign, number = 1.0 if end > 0 else -1.0, 1
    points[0] = end
    if abs(end) > 1:
        points[number] = sign
        number += 1
    for k in range(count):
        u = marks[count - 1 - k if end > 0 else k]
        if 0 < sign * u < abs(points[number - 1]):
            points[number] = u
            number += 1
    points[number] = 0.0
    return number + 1


def _log_time(
    drift: Curve, ends: list[float], rough: float, marks: list[float], count: int, kappa: float,
    r: float,
) -> float:  # fmt: skip
    """log T from 0, where `drift` is that of the layer and `ends` are those beyond it."""
    points, left, right, most = [0.0] * 1032, [0.0] * 4, [0.0] * 4, [0.0] * 2
    size = rough / 4e-16
    if not (1e-8 <= kappa <= 1e8 and 1e-100 <= r <= 1e12):
        raise ValueError(
            f"kappa is {kappa}, r is {r}; give kappa in 1e-8..1e8 and r in 1e-100..1e12"
        )
    if not (abs(ends[0]) < 1e100 and abs(ends[1]) < 1e100 and size < 1e100):
        raise ValueError(
            f"the drift is {ends[0]} and {ends[1]} at the layer's ends, {size} in size; give "
            "parameters for which it is below 1e100"
        )
    lam = 2 / (kappa * kappa)
    number = _stretches(-r, marks, count, points)
    _sweep(drift, ends, rough, lam, points, number, left, most)
    number = _stretches(r, marks, count, points)
    _sweep(drift, ends, rough, lam, points, number, right, most)
    time, rate = _logaddexp(left[1], right[1]), _logaddexp(-left[0], -right[0])
    value = time - rate
    loose = math.exp(-left[0] - rate) * left[2] + math.exp(left[1] - time) * left[3]
    loose += math.exp(-right[0] - rate) * right[2] + math.exp(right[1] - time) * right[3]
    if not loose <= 1e-12 * max(1.0, abs(value)):
        raise ArithmeticError(
            f"log T is {value} with an error of {loose:.1e}, and 1e-12 is allowed: rounding moves "
            f"the exponent 2 V/kappa^2 by {most[0]:.1e}, and two computations of a double integral "
            f"differ by {most[1]:.1e}; give a larger kappa, or emit the target mpmath"
        )
    return value
