"""Panels of the exact integrals in float64 that many rows of similar shape share.

There exponents are one matrix product, and what is carried are plain numbers. Taken where lam V
moves by less than `_MODERATE`, sigma stays below e^`_HIGHEST`, and one series holds A on the whole
interval. Where sigma is so large that S is constant, w is an integral of 1/e, cut to where it is
not below e^-`_FAINT`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from symasym.exact.float_integrals import (
    AT_ONCE,
    CELLS,
    OWN,
    ULP,
    Logs,
    matrices,
    rounding,
    times,
)
from symasym.exact.float_panels import DEEPEST, MISSED, Side

_COMMON = 16  # nodes
# By the order of the moment: what lam V falls and climbs by on a panel at first, climbs at most.
_DOWN, _UP, _CLIMB = (10.0, 6.5), (7.5, 6.5), (8.0, 7.0)
_FAINT = 45.0  # e^{-45} changes nothing
_MODERATE, _HIGHEST = 2500.0, 650.0  # of the exponents of plain numbers
_GROUP = 200


def together(state: Logs, phi: Side, lam: Any, begin: Any, high: Any, rows: Any, order: int) -> Any:
    """Carry plain numbers through panels that many rows share; of which rows that was done.

    Where sigma is so large that S is constant, w is an integral of 1/e, cut to where it counts.
    """
    act, width = matrices(phi.of.terms, _COMMON), high - begin
    (slope,) = phi.series(rows, lam, begin, width / 2)
    reach, falls = 2.0 * np.abs(slope).sum(axis=0), act.integrals[-1] @ slope
    now = state.of(rows)
    (y, w, e, *more), (of_y, of_w, of_e, *_) = now
    of_a = np.abs(lam) * phi.off[rows] / 2
    moved = 2.0 * of_a * width + 3.0 * ULP * reach
    e -= falls
    of_e += moved + ULP * np.abs(e)
    low = (reach + falls.real) / 2 - y.real < _HIGHEST
    faint = (-y.real > _FAINT + reach) & ((reach > 2 * _DOWN[0]) | ~low)
    if (at := np.flatnonzero(faint)).size:
        y[at] -= falls[at]
        of_y[at] += moved[at] + rounding(y[at])
        for _ in range(DEEPEST):
            if not (at := at[reach[at] > 2 * _FAINT]).size:
                break
            c = slope.take(at, axis=1)
            highest = np.maximum.accumulate((act.to_end @ c).real, axis=0)
            # Between ends of a cell lam V is above both by at most an eighth of its width^2 V''.
            above = np.arange(len(c)) ** 2 @ np.abs(c) * (2.0 / CELLS) ** 2 / 8
            hidden = highest < -_FAINT - np.log1p(reach[at]) - np.maximum(w[at].real, 0.0) - above
            share = 1.0 - np.maximum(hidden.sum(axis=0) - 1, 0) / CELLS
            at, share = at[share < 1.0], share[share < 1.0]
            width[at] *= share
            for log in (w, *more):
                log[at] = -np.inf
            (slope[:, at],) = phi.series(rows[at], lam[at], high[at] - width[at], width[at] / 2)
            reach[at] = 2.0 * np.abs(slope.take(at, axis=1)).sum(axis=0)
    done = (low | faint) & (reach < _MODERATE) & (len(phi.edges) == 2)
    # [-1, 1] is the interval of each row; the error of lam V per unit of it.
    off, half = of_a * width + 1.5 * ULP * reach, lam * width / 2
    if order == 2:
        for index in (np.flatnonzero(done & faint), np.flatnonzero(done & ~faint)):
            for at, some, common in _alike(act, slope, reach, index, done, order):
                part, unit = now.of(at), (half[at], half[at] / lam[at])
                part = _second(act, some, common, part, unit, off[at], bool(faint[at[0]]))
                now.put(at, part)
        done &= (now.error < np.inf).all(axis=0)
        state.put(rows[done], now.of(np.flatnonzero(done)))
        return done
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & faint), done, order):
        whole = np.exp(w[at])
        for j, f in _crossed(act, some, common, True):
            for gain, fall in zip(half[at] * j, f, strict=True):
                whole += gain
                whole /= fall
        w[at] = np.log(whole)
        of_w[at] += 2.0 * off[at] + 2 * OWN + ULP * np.abs(w[at])
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & ~faint), done, order):
        sigma = np.exp(-y[at]) * (lam[at] / half[at])
        time = sigma * np.exp(w[at]) / half[at]
        # With absolute errors, of sigma and of int 1/e both, and of their time.
        both = np.array([sigma, sigma * of_y[at]])
        whole = np.array([time, time * (of_y + of_w)[at]])
        for h, i, j, n, f in _crossed(act, some, common, False):
            own = off[at] * h + OWN
            lost = own + (0.3 * ULP / np.abs(f) + OWN)
            i, n = np.stack((i, i * own), axis=1), np.stack((n, n * lost), axis=1)
            for gain, inverse, nested, fall, error in zip(i, j, n, f, own, strict=True):
                whole += nested
                whole += both * inverse
                both += gain
                both *= fall
                both[1] += both[0] * error
        y[at] = -np.log(both[0] * (half[at] / lam[at]))
        w[at] = np.log(whole[0] / both[0] * half[at])
        of_y[at] = (both[1] / both[0]).real + ULP * np.abs(y[at])
        of_w[at] = (whole[1] / whole[0]).real + of_y[at] + ULP * np.abs(w[at])
    state.put(rows[done], now.of(np.flatnonzero(done)))
    return done


def _second(
    act: Any, slope: Any, common: Any, state: Logs, unit: Any, off: Any, faint: bool
) -> Logs:
    """y, w, e, p and c behind the panels; where `faint`, y = 0."""
    (time, length), (y, w, e, p, c) = unit, state.log
    of_y, of_w, of_e, of_p, of_c = state.error
    of_c_unit = time * time * length
    sigma, w, p, c = np.exp(-y) / length, np.exp(w) / time, np.exp(p) / time, np.exp(c) / of_c_unit
    h, one, count = 1.0, 0.0, 0
    for panels in _crossed(act, slope, common, False, 2):
        count += len(panels[0])
        for i, j, n, fall, k, m, x, c0, c1 in zip(*panels[1:], strict=True):
            if not faint:
                one = 1.0 / (sigma + i)
                h = sigma * one
                sigma = (sigma + i) * fall
            t = (i * w + m) * h
            c = (h * (c + c0) + c1 * one + t * (p * h + (m * h + x * one) / i)) / fall
            w = (h * (w + j) + n * one) / fall
            p = (h * h * (p + j) + (2.0 * n * h + k * one) * one) / fall
    if not faint:
        y = -np.log(sigma * length)
    log = np.stack((y, np.log(w * time), e, np.log(p * time), np.log(c * of_c_unit)))
    own = 4.0 * off + 8 * OWN + 0.6 * ULP * math.exp(_CLIMB[1]) + 6 * ULP * count
    of_y = of_y if faint else of_y + own
    both = of_y + of_w + own
    errors = np.stack((of_y, both, of_e, both + of_p, 2 * both + of_p + of_c))
    return Logs(log, errors + rounding(log))


def _alike(act: Any, slope: Any, reach: Any, index: Any, done: Any, order: int) -> Iterator[Any]:
    """Groups of rows of similar reach with panels for all of them; others are not done."""
    index = index[np.argsort(reach[index])]
    size, low = reach[index], 0
    while low < len(index):
        last = (2.0 if size[-1] < 2.0 * size[low] + 15.0 else 1.5) * size[low] + 15.0
        high = min(np.searchsorted(size, last), low + 2 * AT_ONCE)
        at = index[low:high]
        some = slope.take(at, axis=1)
        common = _common(act, some, order) if len(at) >= min(_GROUP, len(done) / 8) else None
        done[at] = common is not None
        if common:
            yield at, some, common
        low = high


def _common(act: Any, slope: Any, order: int) -> tuple[Any, Any] | None:
    """Half widths of panels of [-1, 1] that suffice for all rows, and what acts on `slope` to make
    their coefficients; None where each row for itself is faster."""
    terms, rows = slope.shape
    steep = (act.at_marks @ slope[:, ::-4]).real  # the steepest row among them
    each = np.maximum(steep / _DOWN[order - 1], steep / -_UP[order - 1])
    steep = each.max(axis=1)
    until = np.append(0.0, np.cumsum(np.maximum(steep[1:], steep[:-1]) + 1e-9)) * (2.0 / CELLS)
    count = math.ceil(until[-1])
    if count > 2 + 2.5 * (2.0 * each.mean()):
        return None
    ends = np.interp(np.arange(count + 1) / count * until[-1], until, act.marks)
    for _ in range(DEEPEST):
        h = np.diff(ends) / 2
        points = ends[:-1, None] + h[:, None] * (1.0 + act.points)
        maps = act.fit @ np.polynomial.chebyshev.chebvander(points, terms - 1)
        maps *= h[:, None, None]
        step, found = max(1, AT_ONCE // rows), []
        for low in range(0, len(h), step):
            c = times(maps[low : low + step], slope)
            falls = times(act.integrals[-1], c).real
            rise = -falls.min(axis=1) if order == 1 else np.abs(falls).max(axis=1)
            found.append((np.abs(c).max(axis=2), rise))
        largest, rise = (np.concatenate(x) for x in zip(*found, strict=True))
        size = np.abs(act.antiderivative) @ largest.T
        bad = (order * (act.heights @ size) + act.accuracy).min(axis=0) > MISSED
        bad |= rise > _CLIMB[order - 1]
        if not bad.any():
            return h, maps
        ends = np.sort(np.append(ends, (ends[:-1] + h)[bad]))
    return None


def _crossed(
    act: Any, slope: Any, common: tuple[Any, Any], single: bool, order: int = 1
) -> Iterator[Any]:
    """Of some panels at once: widths, I, J, N, 1/e(b) and, for order 2, K, M, X, C0, C1.

    `single`: J, 1/e(b).
    """
    (h, maps), (terms, rows) = common, slope.shape
    step = max(1, AT_ONCE // rows)
    v = (act.integrals @ maps).swapaxes(0, 1)
    columns = min(step, len(h)) * rows
    work = np.zeros((3 * order, len(v) * columns), slope.dtype)  # kept in the cache
    for low in range(0, len(h), step):
        some = h[low : low + step, None]
        shape = len(v), len(some) * rows
        exponents, e, running, *spare = (x[: shape[0] * shape[1]].reshape(shape) for x in work)
        of = v[:, low : low + step].reshape(-1, terms)
        np.matmul(of, slope.view(float), out=exponents.view(float).reshape(len(of), -1))
        np.exp(exponents, out=exponents)
        inverse, fall = exponents[:-1], exponents[-1].reshape(-1, rows)
        int_inverse = times(act.weights, inverse).reshape(-1, rows) * some
        if single:
            yield int_inverse, fall
            continue
        np.divide(1.0, inverse, out=e[:-1])
        np.matmul(act.running, e[:-1].view(float), out=running.view(float))
        inside = np.multiply(running[:-1], inverse, out=e[:-1])
        nested = times(act.weights, inside).reshape(-1, rows) * some**2
        int_e = running[-1].reshape(-1, rows) * some
        if order == 1:
            yield 2.0 * some, int_e, int_inverse, nested, fall
            continue
        s, i = running[:-1], running[-1]
        far, of_near, of_far = spare
        r = i - s
        np.multiply(r, inverse, out=far[:-1])
        np.matmul(act.running, inside, out=of_near)
        np.matmul(act.running, far[:-1], out=of_far)
        tau = (r * of_near[:-1] + s * (of_far[-1] - of_far[:-1])) / i
        more = [
            (act.weights @ x).reshape(-1, rows) * some**power
            for x, power in (
                *((inside * s, 3), (far[:-1], 2), (inside * r, 3)),
                *((inverse * tau, 3), (inside * tau, 4)),
            )
        ]
        yield 2.0 * some, int_e, int_inverse, nested, fall, *more
