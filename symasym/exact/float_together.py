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
_DOWN, _UP, _CLIMB = 10.0, 7.5, 8.0  # what lam V falls and climbs by at first, climbs by at most
_FAINT = 45.0  # e^{-45} changes nothing
_MODERATE, _HIGHEST = 2500.0, 650.0  # of the exponents of plain numbers
_GROUP = 200


def together(state: Logs, phi: Side, lam: Any, begin: Any, high: Any, rows: Any) -> Any:
    """Carry plain numbers through panels that many rows share; of which rows that was done.

    Where sigma is so large that S is constant, w is an integral of 1/e, cut to where it counts.
    """
    act, width = matrices(phi.of.terms, _COMMON), high - begin
    (slope,) = phi.series(rows, lam, begin, width / 2)
    reach, falls = 2.0 * np.abs(slope).sum(axis=0), act.integrals[-1] @ slope
    now = state.of(rows)
    (y, w, e), (of_y, of_w, of_e) = now
    of_a = np.abs(lam) * phi.off[rows] / 2
    moved = 2.0 * of_a * width + 3.0 * ULP * reach
    e -= falls
    of_e += moved + ULP * np.abs(e)
    low = (reach + falls.real) / 2 - y.real < _HIGHEST
    faint = (-y.real > _FAINT + reach) & ((reach > 2 * _DOWN) | ~low)
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
            w[at] = -np.inf
            (slope[:, at],) = phi.series(rows[at], lam[at], high[at] - width[at], width[at] / 2)
            reach[at] = 2.0 * np.abs(slope.take(at, axis=1)).sum(axis=0)
    done = (low | faint) & (reach < _MODERATE) & (len(phi.edges) == 2)
    # [-1, 1] is the interval of each row; the error of lam V per unit of it.
    off, half = of_a * width + 1.5 * ULP * reach, lam * width / 2
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & faint), done):
        whole = np.exp(w[at])
        for j, f in _crossed(act, some, common, True):
            for gain, fall in zip(half[at] * j, f, strict=True):
                whole += gain
                whole /= fall
        w[at] = np.log(whole)
        of_w[at] += 2.0 * off[at] + 2 * OWN + ULP * np.abs(w[at])
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & ~faint), done):
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


def _alike(act: Any, slope: Any, reach: Any, index: Any, done: Any) -> Iterator[Any]:
    """Groups of rows of similar reach with panels for all of them; others are not done."""
    index = index[np.argsort(reach[index])]
    size, low = reach[index], 0
    while low < len(index):
        last = (2.0 if size[-1] < 2.0 * size[low] + 15.0 else 1.5) * size[low] + 15.0
        high = min(np.searchsorted(size, last), low + 2 * AT_ONCE)
        at = index[low:high]
        some = slope.take(at, axis=1)
        common = _common(act, some) if len(at) >= min(_GROUP, len(done) / 8) else None
        done[at] = common is not None
        if common:
            yield at, some, common
        low = high


def _common(act: Any, slope: Any) -> tuple[Any, Any] | None:
    """Half widths of panels of [-1, 1] that suffice for all rows, and what acts on `slope` to make
    their coefficients; None where each row for itself is faster."""
    terms, rows = slope.shape
    steep = (act.at_marks @ slope[:, ::-4]).real  # the steepest row among them
    each = np.maximum(steep / _DOWN, steep / -_UP)
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
            rise = -times(act.integrals[-1], c).real.min(axis=1)
            found.append((np.abs(c).max(axis=2), rise))
        largest, rise = (np.concatenate(x) for x in zip(*found, strict=True))
        size = np.abs(act.antiderivative) @ largest.T
        bad = (act.heights @ size + act.accuracy).min(axis=0) > MISSED
        bad |= rise > _CLIMB
        if not bad.any():
            return h, maps
        ends = np.sort(np.append(ends, (ends[:-1] + h)[bad]))
    return None


def _crossed(act: Any, slope: Any, common: tuple[Any, Any], single: bool) -> Iterator[Any]:
    """Of some panels at once: widths, I, J, N, 1/e(b); where `single` J and 1/e(b)."""
    (h, maps), (terms, rows) = common, slope.shape
    step = max(1, AT_ONCE // rows)
    v = (act.integrals @ maps).swapaxes(0, 1)
    columns = min(step, len(h)) * rows
    work = np.zeros((3, len(v) * columns), slope.dtype)  # kept in the cache
    for low in range(0, len(h), step):
        some = h[low : low + step, None]
        shape = len(v), len(some) * rows
        exponents, e, running = (x[: shape[0] * shape[1]].reshape(shape) for x in work)
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
        yield 2.0 * some, running[-1].reshape(-1, rows) * some, int_inverse, nested, fall
