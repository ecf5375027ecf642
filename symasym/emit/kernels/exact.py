"""The exact escape time in double precision, to be emitted.

Helpers of the emitted files: those in Python hold them as they stand, C and JavaScript as
`symasym.emit.kernels.transcribe` writes them.

From each end to the start, the layer is cut at the zeros of the drift. On a stretch where phi
keeps its sign, M' = 1 - lam |phi| M from M = 0 ends with the integrals of e^{lam V} and, backwards,
of e^{-lam V} in units of their maxima, and its own integral is the double integral of the falling
exponent. A stretch is crossed in panels of 16 Gauss-Lobatto points: where lam V changes by no more
than 8 the exponential is sampled, where it changes by much more M is its slow series with a layer
at each end (as in `symasym.exact.float_panels`), so that the cost grows with log(lam). Panels are
joined by the differential equation, stretches by panel-step and both sides by positive-form, every
term positive. Where log sigma is above 45 at both ends of a stretch, the scale function grows there
by less than any digit, and w takes the integral of one exponential, up to where that is e^-45.
"""

from __future__ import annotations

import math

from symasym.emit.kernels.elementary import Curve, _exprel, _exprel2, _logaddexp

# Put in when a file is written (`symasym.emit.kernels.tables`); matrices column by column.
_LOBATTO: list[float] = []
_LOBATTO_WITHIN: list[float] = []
_LOBATTO_SLOPE: list[float] = []
_LOBATTO_LAST: list[float] = []


def _times(columns: list[float], x: list[float], product: list[float]) -> None:
    """A matrix of 16 times another vector."""
    # As many sums as stay in registers.
    for i in range(0, 16, 4):
        a, b, c, d = 0.0, 0.0, 0.0, 0.0
        for j in range(16):
            k, y = 16 * j + i, x[j]
            a += columns[k] * y
            b += columns[k + 1] * y
            c += columns[k + 2] * y
            d += columns[k + 3] * y
        product[i], product[i + 1], product[i + 2], product[i + 3] = a, b, c, d


def _last_terms(values: list[float]) -> float:
    """The size of the last two Legendre coefficients."""
    before, last = 0.0, 0.0
    # One of them is even, the other odd.
    for j in range(8):
        before += _LOBATTO_LAST[j] * (values[j] + values[15 - j])
        last += _LOBATTO_LAST[8 + j] * (values[j] - values[15 - j])
    return abs(before) + abs(last)


def _sampled(sizes: list[float], panel: list[float]) -> float:
    """A panel's fall of lam V, M at its end and backwards at its start, and the integral of M.

    The relative error by what 16 points miss (see `symasym.exact.float_panels.sampled`).
    """
    way, rising, inner = [0.0] * 16, [0.0] * 16, [0.0] * 16
    falling = [0.0] * 16
    _times(_LOBATTO_WITHIN, sizes, way)
    for j in range(16):
        falling[j] = math.exp(-way[j])
        rising[j] = 1.0 / falling[j]
    _times(_LOBATTO_WITHIN, rising, inner)
    back, area = 0.0, 0.0
    for j in range(16):
        back += _LOBATTO_WITHIN[16 * j + 15] * falling[j]
        area += _LOBATTO_WITHIN[16 * j + 15] * falling[j] * inner[j]
    panel[0], panel[1], panel[2], panel[3] = way[15], inner[15] * falling[15], back, area
    of_falling, of_rising = _last_terms(falling), _last_terms(rising)
    single = max(of_falling / back, of_rising / inner[15])
    return 1e-3 * of_falling * of_rising / area + 3e-3 * single * single


def _layered(sizes: list[float], noise: float, of_sum: float, panel: list[float]) -> float:
    """The same where M follows its slow series; infinite where that does not hold.

    `noise` is what rounding of the drift makes of each size, `of_sum` what it makes of their sum.
    """
    low, high = math.inf, 0.0
    for j in range(16):
        if sizes[j] < low:
            low = sizes[j]
        if sizes[j] > high:
            high = sizes[j]
    # Nine terms leave (2 k - 1)!! 400^-k < 1e-16, where lam phi^2/|phi'| is above 400.
    if not (low > 40 and (1 - low / high) * 400 < low):
        return math.inf
    term, slope, fore, aft = [0.0] * 16, [0.0] * 16, [0.0] * 16, [0.0] * 16
    _times(_LOBATTO_SLOPE, sizes, slope)
    for j in range(16):
        if abs(slope[j]) * 400 > sizes[j] * sizes[j]:
            return math.inf
        term[j] = 1.0 / sizes[j]
        fore[j] = term[j]
        aft[j] = term[j]
    # Differentiating at an end multiplies what the points miss of 1/phi.
    growth = 1 + 512 / low
    missed = (_last_terms(term) * low - 4 * noise / low) * growth * growth
    if missed > 6e-14:
        return math.inf
    sign = -1.0
    for _ in range(8):
        _times(_LOBATTO_SLOPE, term, slope)
        for j in range(16):
            term[j] = slope[j] / sizes[j]
            fore[j] += sign * term[j]
            aft[j] += term[j]
        sign = -sign
    drop, area = 0.0, 0.0
    for j in range(16):
        drop += _LOBATTO_WITHIN[16 * j + 15] * sizes[j]
        area += _LOBATTO_WITHIN[16 * j + 15] * fore[j]
    decay = math.exp(-drop)
    back = aft[0] - aft[15] * decay
    panel[0], panel[1], panel[2] = drop, fore[15] - fore[0] * decay, back
    panel[3] = area - fore[0] * back
    return max(0.0, missed) + of_sum / low


def _sizes(drift: Curve, lam: float, u: float, step: float, sizes: list[float]) -> float:
    """The largest of the moduli of lam times the drift, in panels, at the points of one."""
    high = 0.0
    for j in range(16):
        sizes[j] = lam * abs(step) * abs(drift(u + _LOBATTO[j] * step))
        if sizes[j] > high:
            high = sizes[j]
    return high


def _faded(
    drift: Curve, rounding: float, lam: float, a: float, b: float, result: list[float]
) -> float:
    """The integral from a to b of e^{-lam |V - V(a)|}. Then lam |V(b) - V(a)|, and the errors of
    that and, relative, of the integral."""
    sizes, way, falling = [0.0] * 16, [0.0] * 16, [0.0] * 16
    total, loose, drop, of_drop, u, step = 0.0, 0.0, 0.0, 0.0, a, b - a
    for _ in range(100000):
        last: int = abs(step) >= abs(b - u) * (1 - 1e-12)
        if last == 1:
            step = b - u
        h, high, back = abs(step), _sizes(drift, lam, u, step, sizes), 0.0
        noise, ending = lam * h * rounding, _last_terms(sizes)
        of_sum, missed = min(noise / 16, 8 * ending + 4e-16 * high), math.inf
        if drop > 45:
            # What is left changes no digit of the integral.
            missed = 0.0 if ending <= max(1e-14 * high, 4 * noise) else math.inf
        elif high <= 10:
            _times(_LOBATTO_WITHIN, sizes, way)
            for j in range(16):
                falling[j] = math.exp(-way[j])
                back += _LOBATTO_WITHIN[16 * j + 15] * falling[j]
            missed = _last_terms(falling) / back
            missed = 3e-3 * missed * missed + max(0.0, ending / 16 - noise)
        if missed > 1e-13:
            step *= 0.5 if high <= 10 or drop > 45 else 9.5 / high
            if u + step == u:
                return math.inf
            continue
        share = math.exp(-drop) * h * back
        total += share
        loose += share * (missed + of_sum + of_drop)
        fall = 0.0
        for j in range(16):
            fall += _LOBATTO_WITHIN[16 * j + 15] * sizes[j]
        faint: int = drop > 45
        drop += fall
        of_drop += of_sum + 2e-16 * fall
        if last == 1:
            result[3], result[4], result[5] = drop, of_drop, 1e-14 + loose / total
            return total
        u += step
        if drop > 45:
            step = 2 * step if faint == 1 else b - u
        else:
            step *= min(2.0, 9.5 / max(sizes[15], 1e-300))
    return math.inf


def _crossed(
    drift: Curve, rounding: float, lam: float, p: float, q: float, result: list[float]
) -> float:
    """M' = 1 - lam |drift| M from p, M = 0, to q: M there. Also, of the stretch, M at p backwards
    from q, its integral, lam times the drift's, and the errors of that and, relative, of M's."""
    panel, sizes, loose = [0.0] * 4, [0.0] * 16, [0.0] * 3
    ahead, u, step, fallen = 0.0, p, q - p, 1.0
    for k in range(6):
        result[k] = 0.0
    for _ in range(100000):
        last: int = abs(step) >= abs(q - u) * (1 - 1e-12)
        if last == 1:
            step = q - u
        h, high = abs(step), _sizes(drift, lam, u, step, sizes)
        # What the drift's rounding makes of the sizes: no halving gets below it.
        noise = lam * h * rounding
        ending = _last_terms(sizes)
        # What it makes of their sum; where phi is resolved, the last terms are rounding.
        of_sum = min(noise / 16, 8 * ending + 4e-16 * high)
        if high <= 8:
            missed = _sampled(sizes, panel) + max(0.0, ending / 16 - noise)
            missed = missed + of_sum if missed <= 1e-13 else math.inf
        else:
            known: int = ending <= max(1e-14 * high, 4 * noise)
            missed = _layered(sizes, noise, of_sum, panel) if known == 1 else math.inf
        if missed == math.inf:
            step *= 0.5 if high > 80 or high <= 8 else 7.5 / high
            if u + step == u:
                break
            continue
        decay = math.exp(-panel[0])
        of_sum += 2e-16 * panel[0]
        share = h * h * panel[3] + ahead * h * panel[2]
        loose[2] += share * missed + loose[0] * h * panel[2]
        result[2] += share
        share = fallen * h * panel[2]
        loose[1] += share * (missed + result[4])
        result[1] += share
        loose[0] = h * panel[1] * missed + decay * (loose[0] + ahead * of_sum)
        ahead = h * panel[1] + decay * ahead
        fallen *= decay
        result[3] += panel[0]
        result[4] += of_sum
        if last == 1:
            result[0] = ahead
            result[5] = 1e-14 + max(loose[0] / ahead, loose[1] / result[1], loose[2] / result[2])
            return ahead
        u += step
        slope = 0.0
        for j in range(16):
            slope += _LOBATTO_SLOPE[16 * j + 15] * sizes[j]
        # Further where the slow series may hold, else by one more panel of samples.
        if abs(slope) * 400 < sizes[15] * sizes[15]:
            step *= 2.0 if high > 8 else 8.0
        else:
            step *= min(2.0, 7.5 / max(sizes[15], 1e-300))
    raise ArithmeticError(
        f"lam = 2/kappa^2 is {lam}, for which M changes beside u = {u} over less than doubles tell "
        "apart; give a larger kappa, or emit the target mpmath"
    )


def _sweep(
    drift: Curve, ends: list[float], rounding: float, lam: float, points: list[float], count: int,
    result: list[float], most: list[float],
) -> None:  # fmt: skip
    """log sigma and log w at the last of the points, from the end at the first; their errors.

    Also the largest errors of a drop of lam V, and of an integral of M.
    """
    here = [0.0] * 6
    sigma, w, loose_sigma, loose, log_lam = -math.inf, -math.inf, 0.0, 0.0, math.log(lam)
    for k in range(count - 1):
        p, q = points[k], points[k + 1]
        outside: int = max(abs(p), abs(q)) > 1
        rate = ends[1 if p > 0 else 0] if outside == 1 else drift((p + q) / 2)
        falls: int = (rate > 0) == (q > p)
        if outside == 1:
            h = abs(q - p)
            x = lam * abs(rate) * h
            ahead = h * _exprel(-x)
            back, area, of_sum, wrong = ahead, h * h * _exprel2(-x), 2e-16 * x, 1e-15
        else:
            if sigma > 45:
                # Where sigma stays as large, S hardly grows, and w takes a single integral.
                alone = _faded(
                    drift, rounding, lam, q if falls == 1 else p, p if falls == 1 else q, here
                )
                x, of_sum, wrong = here[3], here[4], here[5]
                if alone < math.inf and (falls == 1 or sigma - x > 45):
                    most[0] = max(most[0], of_sum)
                    most[1] = max(most[1], wrong)
                    ahead = log_lam + math.log(alone)
                    before = w - x if falls == 1 else w
                    w = _logaddexp(before, ahead)
                    loose = math.exp(before - w) * loose + of_sum + wrong
                    w += 0.0 if falls == 1 else x
                    sigma += x if falls == 1 else -x
                    loose_sigma += of_sum
                    continue
            ahead = _crossed(drift, rounding, lam, p, q, here)
            back, area, x = here[1], here[2], here[3]
            of_sum, wrong = here[4], here[5]
            most[0] = max(most[0], of_sum)
            most[1] = max(most[1], wrong)
        back = math.log(back)
        area = log_lam + math.log(area)
        if falls == 1:
            ahead = log_lam + math.log(ahead)
            total = _logaddexp(sigma, back)
            part = math.exp(area - x - total - ahead)
            first = w - _logaddexp(0.0, back - sigma) - x
            w = _logaddexp(first, ahead + math.log1p(-part))
            kept, share = math.exp(sigma - total), math.exp(first - w)
            known = kept * loose_sigma + (1 - kept) * wrong
            loose = share * (loose + loose_sigma + of_sum - kept * wrong) + 2 * part * known + wrong
            loose_sigma = known + of_sum
            sigma = total + x
        else:
            # V rises.
            ahead = math.log(ahead)
            total = _logaddexp(sigma - x, ahead)
            kept = math.exp(sigma - x - total)
            before = _logaddexp(w, log_lam + back)
            first = before - _logaddexp(-x, ahead - sigma)
            loose = math.exp(w - before) * (loose - wrong) + wrong
            loose += kept * of_sum + (1 - kept) * (loose_sigma + wrong)
            loose_sigma = kept * (loose_sigma + of_sum) + (1 - kept) * wrong
            w = _logaddexp(first, area - total)
            share = math.exp(first - w)
            loose = share * loose + (1 - share) * (wrong + loose_sigma)
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
    drift: Curve, ends: list[float], rounding: float, marks: list[float], count: int, kappa: float,
    r: float,
) -> float:  # fmt: skip
    """log T from 0, where `drift` is that of the layer and `ends` are those beyond it."""
    points, left, right, most = [0.0] * 1032, [0.0] * 4, [0.0] * 4, [0.0] * 2
    size = rounding / 4e-16
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
    _sweep(drift, ends, rounding, lam, points, number, left, most)
    number = _stretches(r, marks, count, points)
    _sweep(drift, ends, rounding, lam, points, number, right, most)
    time, rate = _logaddexp(left[1], right[1]), _logaddexp(-left[0], -right[0])
    value = time - rate
    loose = math.exp(-left[0] - rate) * left[2] + math.exp(left[1] - time) * left[3]
    loose += math.exp(-right[0] - rate) * right[2] + math.exp(right[1] - time) * right[3]
    if not loose <= 1e-12 * max(1.0, abs(value)):
        raise ArithmeticError(
            f"log T is {value} with an error of {loose:.1e}, and 1e-12 is allowed: rounding moves "
            f"the exponent 2 V/kappa^2 by {most[0]:.1e}, and integrals "
            f"are known to {most[1]:.1e}; give a larger kappa, or emit the target mpmath"
        )
    return value
