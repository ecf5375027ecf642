"""The exact escape time in double precision, as helpers of the emitted files.

From each end to the start, the layer is cut at the zeros of the drift. On a stretch where phi
keeps its sign, M' = 1 - lam |phi| M from M = 0 is solved forwards and backwards: its last values
are the integrals of e^{lam V} and of e^{-lam V} in units of their maxima, and its own integral,
which is the same both ways, is the double integral of the falling exponent. So nothing is an
exponential, and nothing grows. Radau's collocation is stable at any step: where lam |phi| is
large, M is smooth, and a step may be as long as that lasts; the cost grows with log(lam).
Stretches are put together by panel-step, and both sides by positive-form, every term positive.
"""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np

#: Points of Radau's rule.
POINTS = 16
#: What the files say of their error.
ERROR = (
    "log T is right to 1e-12, or to 1e-12 of itself where that is larger, for the drift with its "
    "numbers as doubles; kappa from 1e-8 to 1e8, r from 1e-100 to 1e12, else refused, and also "
    "where both directions of the computation differ by more"
)


@cache
def radau() -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Points in (0, 1], the last of which is 1, and weights: zeros of P_n - P_{n-1}."""
    n, context = POINTS, mpmath.mp.clone()
    context.dps = 40

    def zero_at(t: mpmath.mpf) -> mpmath.mpf:
        return context.legendre(n, t) - context.legendre(n - 1, t)

    near = np.polynomial.legendre.legroots([0.0] * (n - 1) + [-1.0, 1.0])
    found = [context.findroot(zero_at, context.mpf(float(t))) for t in sorted(near.real)[:-1]]
    weights = [(1 + t) / (n * context.legendre(n - 1, t)) ** 2 / 2 for t in found]
    points = [(1 + t) / 2 for t in found]
    return (*map(float, points), 1.0), (*map(float, weights), float(context.one / n**2))


def _numbers(values: tuple[float, ...], indent: str) -> str:
    rows = [values[k : k + 4] for k in range(0, len(values), 4)]
    return "\n".join(indent + ", ".join(map(repr, row)) + "," for row in rows)


def tables(opening: tuple[str, str], closing: str, indent: str = "    ") -> str:
    """Points and weights as two constants of a language."""
    lines = []
    for start, values in zip(opening, radau(), strict=True):
        lines += [start, _numbers(values, indent), closing]
    # C has no comma behind the last.
    return "\n".join(lines)


_PYTHON = '''# Radau's points in (0, 1], and their weights.
TABLES


def _tables():
    """Integrals up to each point of the polynomial through values there, and its last terms."""
    n, rows = len(_T), []
    for t in _T:
        p = [1.0, 2 * t - 1]
        for k in range(1, n):
            p.append(((2 * k + 1) * p[1] * p[k] - k * p[k - 1]) / (k + 1))
        rows.append(p)
    sums = [[p[1] + 1, *(p[k + 1] - p[k - 1] for k in range(1, n))] for p in rows]
    within = [
        [w * sum(s * x for s, x in zip(upto, p)) / 2 for w, p in zip(_W, rows)] for upto in sums
    ]
    return within, [[(2 * k + 1) * w * p[k] for w, p in zip(_W, rows)] for k in (n - 2, n - 1)]


_WITHIN, _LAST = _tables()


SOLVE


def _relaxed(drift, rough, lam, a, b):
    """M' = 1 - lam |drift| M from a, M = 0, to b: M there, its integral; lam times the drift's."""
    end = area = drop = 0.0
    u, step, fresh = a, b - a, True
    for _ in range(100000):
        last = abs(step) >= abs(b - u) * (1 - 1e-12)
        if last:
            step = b - u
        h = abs(step)
        slopes, values, top, tail, least = _panel(drift, lam * h, h, end, u, step)
        # What the drift's rounding makes of M: no halving gets below it.
        noise = lam * h * rough / (1 + least)
        if tail > max(1e-13, min(noise, 1e-6)) * top:
            step, fresh = step / 2, False
            if u + step == u:
                break
            continue
        area += h * sum(w * m for w, m in zip(_W, values))
        drop += sum(w * s for w, s in zip(_W, slopes))
        end = values[-1]
        if last:
            return end, area, drop
        u, step, fresh = u + step, step * (1 + fresh), True
    raise ArithmeticError(
        f"lam = 2/kappa^2 is {lam}, for which M changes beside u = {u} over less than doubles tell "
        "apart; give a larger kappa, or emit the target mpmath"
    )


def _sweep(drift, ends, rough, lam, points):
    """log sigma and log w at the last point, swept from the end at the first; their errors.

    Also the most that both directions differ by in a drop of lam V, and in a double integral.
    """
    sigma = w = -MATH.inf
    loose_sigma = loose = most_slip = most_wrong = 0.0
    log = MATH.log(lam)
    for p, q in zip(points, points[1:]):
        if max(abs(p), abs(q)) > 1:
            h, a = abs(q - p), ends[p > 0]
            drop = lam * a * h
            x = abs(drop)
            ahead = back = h * _exprel(-x)
            area = h * h * _exprel2(-x)
            slip = wrong = 0.0
        else:
            ahead, area, drop = _relaxed(drift, rough, lam, p, q)
            back, again, other = _relaxed(drift, rough, lam, q, p)
            x = abs(drop)
            slip, wrong = abs(drop - other), abs(area / again - 1)
            most_slip, most_wrong = max(most_slip, slip), max(most_wrong, wrong)
        back, area = MATH.log(back), log + MATH.log(area)
        if (drop > 0) == (q > p):
            # V falls.
            ahead = log + MATH.log(ahead)
            total = _logaddexp(sigma, back)
            part = MATH.exp(area - x - total - ahead)
            first = w - _logaddexp(0.0, back - sigma) - x
            w = _logaddexp(first, ahead + MATH.log1p(-part))
            known = MATH.exp(sigma - total) * loose_sigma + wrong
            loose = MATH.exp(first - w) * (loose + loose_sigma + slip) + 2 * part * known + wrong
            sigma, loose_sigma = total + x, known + slip
        else:
            # V rises.
            ahead = MATH.log(ahead)
            total = _logaddexp(sigma - x, ahead)
            kept = MATH.exp(sigma - x - total)
            first = _logaddexp(w, log + back) - _logaddexp(-x, ahead - sigma)
            w = _logaddexp(first, area - total)
            loose = MATH.exp(first - w) * (loose + kept * slip + (1 - kept) * loose_sigma) + wrong
            loose_sigma = kept * (loose_sigma + slip) + wrong
            loose, sigma = loose + loose_sigma, total
    return sigma, w, loose_sigma, loose, most_slip, most_wrong


def _log_time(drift, ends, rough, zeros, count, kappa, r):
    """log T from 0, where `drift` is that of the layer and `ends` are those beyond it."""
    if not (1e-8 <= kappa <= 1e8 and 1e-100 <= r <= 1e12):
        told = f"kappa is {kappa}, r is {r}"
        raise ValueError(f"{told}; give kappa in 1e-8..1e8 and r in 1e-100..1e12")
    if not all(abs(x) < 1e100 for x in (*ends, rough / 4e-16)):
        told = f"the drift is {ends[0]} and {ends[1]} at the layer's ends, {rough / 4e-16} in size"
        raise ValueError(f"{told}; give parameters for which it is below 1e100")
    lam = 2 / kappa**2
    marks = sorted({0.0, *(float(m) for m in (-1, *zeros[:count], 1) if abs(m) < r)})
    left = _sweep(drift, ends, rough, lam, [-r, *(m for m in marks if m <= 0)])
    right = _sweep(drift, ends, rough, lam, [r, *(m for m in reversed(marks) if m >= 0)])
    time, rate = _logaddexp(left[1], right[1]), _logaddexp(-left[0], -right[0])
    found = time - rate
    loose = sum(
        MATH.exp(-side[0] - rate) * side[2] + MATH.exp(side[1] - time) * side[3]
        for side in (left, right)
    )
    if not loose <= 1e-12 * max(1.0, abs(found)):
        slip, wrong = (max(left[k], right[k]) for k in (4, 5))
        why = f"rounding moves the exponent 2 V/kappa^2 by {slip:.1e}, so that kappa is too small"
        if not slip > wrong:
            why = f"two computations of a double integral differ by {wrong:.1e}"
        raise ArithmeticError(
            f"log T is {found} with an error of {loose:.1e}, and 1e-12 is allowed: {why} for "
            "doubles; give a larger kappa, or emit the target mpmath"
        )
    return found
'''

_SOLVED = '''def _panel(drift, scale, h, end, u, step):
    """Slopes and M at the points of a step, the size of M and of its last terms."""
    slopes = [scale * drift(u + t * step) for t in _T]
    rows = [
        [*(x * abs(s) for x, s in zip(row, slopes)), end + t * h] for row, t in zip(_WITHIN, _T)
    ]
    for i, row in enumerate(rows):
        row[i] += 1.0
    values = _solved(rows)
    tail = max(abs(sum(c * m for c, m in zip(last, values))) for last in _LAST)
    return slopes, values, max(map(abs, values)), tail, min(map(abs, slopes))


def _solved(rows):
    """A linear system by elimination; its right-hand side is the last column."""
    n = len(rows)
    for k in range(n):
        best = max(range(k, n), key=lambda i: abs(rows[i][k]))
        rows[k], rows[best] = rows[best], rows[k]
        top = rows[k]
        for row in rows[k + 1 :]:
            factor = row[k] / top[k]
            if factor:
                row[k + 1 :] = [x - factor * y for x, y in zip(row[k + 1 :], top[k + 1 :])]
    found = [0.0] * n
    for k in reversed(range(n)):
        rest = sum(x * m for x, m in zip(rows[k][k + 1 : n], found[k + 1 :]))
        found[k] = (rows[k][n] - rest) / rows[k][k]
    return found'''
_ARRAYS = '''def _panel(drift, scale, h, end, u, step):
    """Slopes and M at the points of a step, the size of M and of its last terms."""
    slopes = scale * (drift(u + step * _T) + 0 * _T)
    sizes = np.abs(slopes)
    values = np.linalg.solve(_ONE + _WITHIN * sizes, end + h * _T)
    return slopes, values, np.abs(values).max(), np.abs(_LAST @ values).max(), sizes.min()'''


def in_python() -> str:
    """The helper of the target "python"."""
    text = _PYTHON.replace("TABLES", tables(("_T = (", "_W = ("), ")"))
    return text.replace("SOLVE", _SOLVED).replace("MATH", "math")


def in_numpy() -> str:
    """The same with arrays within a step."""
    opening = "_T = np.array([", "_W = np.array(["
    text = _PYTHON.replace("TABLES", tables(opening, "])"))
    arrays = "_WITHIN, _LAST = map(np.array, _tables())\n_ONE = np.eye(len(_T))"
    text = text.replace("_WITHIN, _LAST = _tables()", arrays)
    text = text.replace("sum(w * m for w, m in zip(_W, values))", "np.dot(_W, values)")
    text = text.replace("sum(w * s for w, s in zip(_W, slopes))", "np.dot(_W, slopes)")
    text = text.replace("_logaddexp", "np.logaddexp")
    return text.replace("SOLVE", _ARRAYS).replace("MATH", "np")
