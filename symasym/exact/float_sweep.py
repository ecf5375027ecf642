"""What is carried through panels in float64, for many rows at once, in logarithms.

From an end, with eta and zeta of `symasym.exact.balls` and A = (zeta - zeta(0))/(s eta),

    y = 1/sigma = zeta/eta,  w = A(0),  p = (zeta/eta)'(0),  c = -A'(0):

lam times the integrals over the speed density of h, h^2 and h tau, where h is the harmonic function
that is 1 at the panel's end and 0 at an absorbing end, and tau the mean time until one of both is
reached. All terms are positive. At an absorbing end y is infinite, at a reflecting one 0.
"""

from __future__ import annotations

from functools import reduce
from typing import Any

import numpy as np

from symasym.exact.float_integrals import Logs, constant, rounding
from symasym.exact.float_panels import Side, panels

# Powers of a and b in I, J, N, K, M, X, C0, C1.
_WEIGHTS = np.array([[1, 0], [0, 1], [1, 1], [2, 1], [1, 1], [2, 1], [1, 2], [2, 2]])


def absorbing(lam: Any, order: int = 1, reflecting: Any = False) -> Logs:
    """y, w, e, and for order 2 p and c, where a sweep begins."""
    log = np.full((3 if order == 1 else 5, len(lam)), -np.inf, lam.dtype)
    log[0], log[2] = np.where(reflecting, -np.inf, np.inf), 0.0
    return Logs(log, np.zeros(log.shape))


def swept(sides: list[Side], lam: Any, begin: Any, end: Any, state: Logs) -> Logs:
    """The state at `end` from that at `begin`, where e is 1."""
    order, last = 1 if len(state.log) == 3 else 2, len(sides) - 1
    layered, ahead = sides[0].field.layered, sides[0].mirror > 0
    if layered:
        _outside(sides[0], -1, lam, np.minimum(end, -1.0) - begin, state, order)
    for step in range(last + 1):
        # Mirror images come from the other side.
        for k in sorted({step, last - step}):
            a, b = sides[k].of.span
            low, high = np.where(ahead, a, -b), np.where(ahead, b, -a)
            low, high = np.clip(begin, low, high), np.clip(end, low, high)
            now = np.where(ahead, step, last - step) == k
            _inside(sides[k], lam, low, high, np.flatnonzero(now & (high > low)), state, order)
    if layered:
        _outside(sides[-1], 1, lam, end - np.maximum(begin, 1.0), state, order)
    return state


def _inside(phi: Side, lam: Any, low: Any, high: Any, some: Any, state: Logs, order: int) -> None:
    """Across a formula's interval."""
    if some.size:
        of, rank, widths = panels(phi, some, lam[some], low[some], high[some], order)
        rank = some[rank]
        now, at = state.of(rank), 0
        for n in widths:
            first, panel = Logs(*(x[:, :n] for x in now)), Logs(*(x[:, at : at + n] for x in of))
            now.put(slice(n), carried(first, panel, lam[rank[:n]]))
            at += n
        state.put(rank, now)


def _outside(phi: Side, side: int, lam: Any, width: Any, state: Logs, order: int) -> None:
    """Across an interval beside the layer, whose width may be 0."""
    if (some := np.flatnonzero(width > 0)).size:
        (a, off, log), lam, width = (x[some] for x in phi.end(side)), lam[some], width[some]
        moved = np.abs(lam) * width * off
        panel = constant(lam * a, width, moved, order)
        if powers := phi.powers:
            panel.log[2:] += (_WEIGHTS[: len(panel.log) - 2] @ powers)[:, None] * log
            panel.error[2:] += phi.loose
        state.put(some, carried(state.of(some), panel, lam))


def carried(before: Logs, panel: Logs, lam: Any) -> Logs:
    """The state after a panel; errors by shares.

    With d = c + I y:  y' = f y/d,  w' = (f w + lam J + lam N y)/d,  e' = e f/c, and `_second`.
    """
    (y, w, e, *more), (of_y, of_w, of_e, *_) = before
    (fall, climb, i, j, n, *_), (of_fall, of_climb, of_i, of_j, of_n, *_) = panel
    # Whatever of c and I y is larger is divided out: neither may lose the other's digits.
    x = climb - y - i
    less = x.real < 0
    sigma, one = np.where(less, -y - i, -climb), np.where(less, -i, y - climb)
    tail, log_lam = np.exp(-np.maximum(x, -x)), np.log(lam)
    kept = np.where(less, tail, 1.0).real / (1.0 + tail.real)
    old, new, nested, log_n = shares(fall + w + sigma, log_lam + j + sigma, log_lam + n + one)
    log_d, lost = np.log1p(tail), 1.0 - kept
    common = kept * of_climb + lost * of_i
    of_rate = of_fall + kept * of_y + common
    of_time = old * (of_fall + of_w) + new * of_j + nested * of_n + common
    of_time += np.abs(nested - lost) * of_y
    log = np.stack((fall + one - log_d, log_n - log_d, e + fall - climb))
    error = np.stack((of_rate, of_time, of_e + of_fall + of_climb))
    if more:
        others = _second(before, panel, log_lam, sigma - log_d, one - log_d, common, lost)
        log, error = (np.concatenate(x) for x in zip((log, error), others, strict=True))
    return Logs(log, error + rounding(log))


def _second(
    before: Logs, panel: Logs, lam: Any, sigma: Any, one: Any, common: Any, lost: Any
) -> tuple[Any, Any]:
    """p and c after a panel, `sigma` being log 1/d, `one` log y/d, `lost` I y/d:

    p' = (c f p + c lam J)/d^2 + 2 c lam N y/d^2 + f c lam K y^2/d^2,
    c' = (f c + lam^2 C0 + lam^2 C1 y + f t (p + lam (M + X y)/I))/d,  t = (I w + lam M)/d.
    """
    (y, w, _, p, c), (of_y, of_w, _, of_p, of_c) = before
    (fall, climb, i, j, n, k, m, x, c0, c1), (of_fall, of_climb, of_i, *of) = panel
    of_j, of_n, of_k, of_m, of_x, of_c0, of_c1 = of
    terms = (
        fall + climb + p + 2 * sigma,
        lam + climb + j + 2 * sigma,
        np.log(2.0) + lam + climb + n + sigma + one,
        lam + k + 2 * one,
    )
    *part, log_p = shares(*terms)
    errors = of_fall + of_climb + of_p, of_j, of_n, of_k
    error_p = sum(s * e for s, e in zip(part, errors, strict=True))
    error_p += np.abs(part[2] + 2 * part[3] - 2 * lost) * of_y + 2 * common + of_climb
    times = ((fall + i + w + sigma, of_i + of_w), (fall + lam + m + sigma, of_m))
    rates = (
        (p + sigma, of_p, 0.0),
        (lam + m + sigma - i, of_m + of_i, 0.0),
        (lam + x + one - i, of_x + of_i, 1.0),
    )
    parts = [
        (fall + c + sigma, of_fall + of_c, -lost),
        (2 * lam + c0 + sigma, of_c0, -lost),
        (2 * lam + c1 + one, of_c1, 1.0 - lost),
        *(
            (a + b, of_fall + of_a + of_b, slope - 2.0 * lost)
            for a, of_a in times
            for b, of_b, slope in rates
        ),
    ]
    *part, log_c = shares(*(log for log, *_ in parts))
    error_c = sum(s * e for s, (_, e, _) in zip(part, parts, strict=True)) + 2 * common
    error_c += np.abs(sum(s * slope for s, (*_, slope) in zip(part, parts, strict=True))) * of_y
    return np.stack((log_p, log_c)), np.stack((error_p, error_c))


def shares(*logs: Any) -> tuple[Any, ...]:
    """The shares of positive numbers in their sum, and its logarithm."""
    top = reduce(np.maximum, logs)
    parts = [np.exp(x - top) for x in logs]
    whole = sum(parts[1:], parts[0])
    return *((p / whole).real for p in parts), top + np.log(whole)
