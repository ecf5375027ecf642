r"""Sides of moderate scenes in float64: from -r to the start with panels of their own.

On a side, lam phi is a polynomial q(t)/h on [-1, end], t from -1 to 1. With Q the sum of the moduli
of its coefficients over k + 1, lam V moves by Q at most; where that is moderate 1/sigma and w are
carried through the panels as they stand (`sweep.carried`), and only sigma left of u = -1 needs a
logarithm. Panels are as long as the local |q| and its derivatives allow, all of a side alike: they
end where an integral over equal cells passes whole numbers.

Where that sigma is above e^(Q + 45), S is constant on [-1, end] to all digits, so that

    w = e^{lam (V(end) - V(-1))} w(-1) + lam int_{-1}^{end} e^{lam (V(end) - V(u))} du,

a single integral, of which only the part counts where the exponent is above -36 - log(1 + Q). It
takes one Gauss rule: with n nodes the rule of f misses at most 64/15 M rho^(-2n)/(1 - rho^-2) on
[-1, 1], where |f| <= M on the ellipse of foci -1 and 1 whose half axes have the sum rho (L. N.
Trefethen, Approximation Theory and Approximation Practice, theorem 19.3).
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np

from symasym.base.call_context import own_context, step
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels, sweep
from symasym.exact.float_blocks import FAINT, MODERATE, centred
from symasym.exact.float_panels import NODES, REACH, REACH_DOWN, RESOLUTION
from symasym.exact.sweep import Record, Swept
from symasym.numbers.float_arrays import LogPositive

_ULP = 2e-16  # of an exponent, its sum included
_ROUNDING = 2e-15  # of fewer than 15 operations; and what is left out, below e^-36
#: Largest Q of a side that is taken: the errors are proportional to it.
_HIGHEST = 1000.0
_LOWEST = 1e-290  # of 1/sigma, below which floats have fewer digits
#: q' that take a panel of their own, or |q| = REACH; the squares of both are added.
_BENT = 3 / 16
#: Exponents of a single integral that change none of its digits, beside log(1 + Q).
_BELOW = 36.0
#: Q from which on such exponents are looked for.
_LONG = 60.0
_CELLS = 16  # of [-1, 1], in which they are
#: Nodes of the single integral: multiples of a number, up to another.
_RULES, _MOST = 4, 40
#: Sums of half axes of the ellipses.
_AXES = np.array([3.0, 4.0, 5.5, 8.0])
_ENOUGH = -34.5  # of log(what a rule misses times Q)
_FEW = 32  # sides, of which more take a rule of their own


class _Sides(NamedTuple):
    """Some sides: lam, the coefficients of q, Q, the width h, the relative error of a panel; log
    sigma, its error, and w at u = -1."""

    lam: FloatArray
    series: FloatArray
    size: FloatArray
    h: FloatArray
    own: FloatArray
    log_sigma: FloatArray
    error: FloatArray
    w: FloatArray

    def take(self, index: slice | IntArray) -> _Sides:
        """Some of the sides."""
        return _Sides(*(x[..., index] for x in self))


def swept(field: Field, lam: FloatArray, r: FloatArray, end: FloatArray) -> tuple[IntArray, Swept]:
    """The moderate ones among the sides, and sigma and w at their ends (`symasym.exact.sweep`).

    Moderate are those of a polynomial, with r > 1 >= |end|, that few panels resolve.

    Parameters
    ----------
    field : Field
        One scene a side, swept from the left.
    lam, r, end : arrays of shape (sides,)
        A side is [-r, end].
    """
    rate = lam * field.size()[: len(lam)]
    moderate = rate < MODERATE
    for inside in (r > 1.0, end > -1.0, end <= 1.0):
        moderate &= inside
    index = np.flatnonzero(moderate)
    some = _run(index)
    coefficients = None if field.directions else field.series(some)
    if coefficients is None or not index.size:
        return index[:0], _logs(np.empty((4, 0)))
    lam, r, end, rate, a_minus = (x[some] for x in (lam, r, end, rate, field.a_minus))
    h = end + 1.0
    series = centred(coefficients, -1.0, end, lam * h)
    size = (1.0 / np.arange(1.0, len(series) + 1)) @ np.abs(series)
    # The error of a panel is that of others which are not graded (`symasym.exact.floats`).
    own = 5e-15 + 8e-18 * rate
    tail = float_panels.constant(lam * a_minus, r - 1.0)
    sigma, w = sweep.first(Record(tail.int_e, None, tail.nested, 1.0, None), lam)
    fall = np.maximum(-tail.rise, 0.0)
    log_sigma, error = np.log(sigma) + fall, own + _ULP * fall
    sides = _Sides(lam, series, size, h, own, log_sigma, error, w)
    found = np.full((4, len(index)), np.nan)
    alone = np.flatnonzero(log_sigma > FAINT + size)
    if alone.size > _FEW:
        some = _run(alone)
        found[:, some] = _single(sides.take(some))
    rest = np.flatnonzero(np.isnan(found[3]) & (size < _HIGHEST))
    if rest.size:
        some = _run(rest)
        found[:, some] = _nested(sides.take(some))
    done = np.isfinite(found.sum(axis=0))
    if not done.all():
        index, found = index[done], found[:, done]
    return index, _logs(found)


def _run(index: IntArray) -> slice | IntArray:
    """The same indices, of which nothing is copied where they follow each other."""
    if index.size and index[-1] - index[0] == index.size - 1:
        return slice(int(index[0]), int(index[-1]) + 1)
    return index


def _logs(found: FloatArray) -> Swept:
    """sigma and w from their logarithms, each followed by its error."""
    return Swept(LogPositive(found[0], found[1]), LogPositive(found[2], found[3]))


# -- panels ----------------------------------------------------------------------------------------


def _nested(sides: _Sides) -> FloatArray:
    """log sigma, its error, log w and its error, nan where the panels do not resolve e^{lam V}."""
    size, h, own = sides[2:5]
    rate, w, missed, least = _joined(sides, *_integrals(sides.series, h))
    missed[(missed > RESOLUTION) | (least < _LOWEST)] = np.nan
    # Exponents lam (V(v) - V(u)) are off by `moved` at most, by as much for each of two in w.
    moved, own, log = _ULP * size, own + missed, -np.log(rate)
    error = own + moved + sides.error + _ROUNDING
    return np.array((log, error + _ROUNDING * np.abs(log), np.log(w), error + 2 * own + moved))


def _integrals(series: FloatArray, h: FloatArray) -> tuple[FloatArray, list[int], IntArray | slice]:
    """Of each panel e^{lam V} at its right end, 1 being that at its left one, the integrals of
    `float_panels.integrals`, and what the nodes miss of them.

    First come the first panels of all sides, then the second ones, ...: how many there are of each,
    and the sides' order.
    """
    count, ends = _panels(series)
    number, most = len(ends) - 1, int(count.max())
    order: IntArray | slice = slice(None)
    widths = [number]
    if most > 1:
        # The sides with most panels first.
        order = np.argsort(-count, kind="stable")
        widths = np.searchsorted(-count[order], -np.arange(most), side="left").tolist()
        side = np.concatenate([order[:n] for n in widths])
        first = np.add.accumulate(count) - count
        at = first[side] + np.repeat(np.arange(most), widths)
    parts = np.empty((5, number))
    place, memory = float_panels.memory()
    for begin in range(0, number, float_panels.AT_ONCE):
        step()
        some = slice(begin, min(begin + float_panels.AT_ONCE, number))
        local, half = series[:, some], h[some]
        if most > 1:
            row, left = side[some], at[some]
            low, high = ends[left] - 2.0 * row, ends[left + 1] - 2.0 * row
            half = (high - low) / 2
            local = centred(series.take(row, axis=1), low, high, half)
            half *= h[row]
        (out,) = float_panels.arrays_in(place, (NODES,), (1, len(half)))
        exponents, rise = float_panels.exponents_of_series(local, 1, out)
        np.exp(rise[0], out=parts[0, some])
        parts[1:, some] = [x[0] for x in float_panels.integrals(exponents, memory)]
        parts[1:4, some] *= half
        parts[3, some] *= half
    return parts, widths, order


def _joined(
    sides: _Sides, parts: FloatArray, widths: list[int], order: IntArray | slice
) -> FloatArray:
    """1/sigma and w at the ends of the sides, the most that is missed on a panel, and the least
    1/sigma on the way."""
    lam = sides.lam[order]
    result = np.empty((4, len(lam)))
    rates, ws, most, least = result
    np.exp(-sides.log_sigma[order], out=rates)
    ws[:] = sides.w[order]
    most[:] = 0.0
    least[:] = rates
    low = 0
    for n in widths:
        end, int_e, int_inverse, nested, missed = parts[:, low : low + n]
        rate, w = rates[:n], ws[:n]
        # `sweep.carried`, of 1/sigma.
        nested *= rate
        nested += int_inverse
        nested *= lam[:n]
        w += nested
        int_e *= rate
        int_e += 1.0
        end /= int_e
        w *= end
        rate *= end
        np.maximum(most[:n], missed, out=most[:n])
        np.minimum(least[:n], rate, out=least[:n])
        low += n
    if isinstance(order, slice):
        return result
    back = np.empty_like(result)
    back[:, order] = result
    return back


def _panels(series: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of panels of the sides, and where panels end, the k-th side being [2k - 1, 2k + 1].

    On none of them lam V moves by more than `REACH`, or falls by more than `REACH_DOWN`, and no
    Taylor coefficient of many is above `float_panels.bends`.
    """
    at_cells, up_to = _at_cells(len(series))
    values, bent, *others = (at_cells @ series).reshape(-1, len(up_to) + 1, series.shape[1])
    # |q| in panels, squared.
    values *= np.where(values < 0.0, -1.0 / REACH, 1.0 / REACH_DOWN)
    values *= values
    values += np.abs(bent, out=bent)
    values += 1e-9
    for k, other in enumerate(others, 3):
        values += np.abs(other, out=other) ** (2 / k)
    steep = np.maximum(values[1:], values[:-1])
    np.sqrt(steep, out=steep)
    known = np.zeros(steep.size + 1)
    reached = np.matmul(steep.T, up_to, out=known[1:].reshape(steep.T.shape))
    whole = np.ceil(reached[:, -1])
    count: IntArray = whole.astype(np.intp)
    number = int(count.sum())
    ends: FloatArray = np.arange(number + 1.0)
    if number == len(count):
        return count, ends * 2.0 - 1.0
    reached *= (whole / reached[:, -1])[:, None]
    reached += (np.add.accumulate(whole) - whole)[:, None]
    ends = np.interp(ends, known, np.arange(float(len(known))))
    ends *= 2.0 / len(up_to)
    ends -= 1.0
    return count, ends


@cache
def _at_cells(terms: int) -> tuple[FloatArray, FloatArray]:
    """t^k at the ends of equal cells of [-1, 1], two for each term and not fewer than eight;
    its derivatives times `_BENT`, and of many terms the higher ones over k! and
    `float_panels.bends`; the matrix from a row of values on the cells to running means."""
    cells = max(8, 2 * terms)
    t, k = np.linspace(-1.0, 1.0, cells + 1)[:, None], np.arange(terms)
    rows = [t**k, _BENT * k * t ** np.maximum(k - 1, 0)]
    if terms > float_panels.PLAIN:
        weights = float_panels.binomials(terms) / float_panels.bends(terms)[:, None]
        rows += [w * t ** np.maximum(k - n, 0) for n, w in enumerate(weights, 2)]
    return np.vstack(rows), np.tri(cells).T / cells


# -- a single integral -----------------------------------------------------------------------------


def _single(sides: _Sides) -> FloatArray:
    """The same where S is constant, by one rule for all; nan where it misses too much."""
    lam, series, size, h, own = sides[:5]
    # lam (V(end) - V) is the sum of these times t^k - 1, k from 1.
    twice = 2.0 * np.arange(1, len(series) + 1)[:, None]
    heights = series / twice
    rise = -2.0 * (np.arange(1, len(series) + 1) % 2 @ heights)
    moved = _ULP * size
    long = np.flatnonzero(size > _LONG)
    if long.size:
        some = series.take(long, axis=1)
        start = _start(some, size[long])
        half = (1.0 - start) / 2
        heights[:, long] = centred(some, start, 1.0, half) / twice
        h = h.copy()
        h[long] *= half
    outside, inside, bounds = _ellipses(len(series))
    # The mean of the exponential is e^highest/(1 + Q) or more, roughly.
    highest = np.maximum((inside @ heights).max(axis=0), 0.0)
    enough = _ENOUGH + highest - np.log1p(len(series) * size)
    most = (outside @ heights).reshape(len(bounds), -1, len(h)).max(axis=1)
    wanted = ((most - enough + bounds[:, :1]) * bounds[:, 1:]).min(axis=0)
    nodes = min(-int(-wanted.max() // _RULES) * _RULES, _MOST)
    enough[wanted > _MOST] = np.nan
    powers, weights = _to_end(nodes, len(series))
    total = np.empty(len(h))
    for low in range(0, len(h), float_panels.COLUMNS):
        step()
        part = slice(low, low + float_panels.COLUMNS)
        exponents = powers @ heights[:, part]
        total[part] = weights @ np.exp(exponents, out=exponents)
    before = np.exp(rise) * sides.w
    w = before + lam * h * total
    log = sides.log_sigma - rise
    error = 2 * (own + _ROUNDING) + np.exp(enough) / total + moved * before / w
    return np.array((log, sides.error + moved + _ROUNDING * (1.0 + np.abs(log)), np.log(w), error))


@cache
def _to_end(count: int, terms: int) -> tuple[FloatArray, FloatArray]:
    """t^k - 1 at the nodes of Gauss's rule, k from 1, and half its weights, rounded once.

    Of NumPy's rules the weights are right to 1e-13 only.
    """
    powers, weights = np.empty((count, terms)), np.empty(count)
    with own_context(30) as context:
        for i, near in enumerate(np.polynomial.legendre.leggauss(count)[0].tolist()):
            t = context.mpf(near)
            for _ in range(2):
                before, value = 1, t
                for j in range(2, count + 1):
                    before, value = value, ((2 * j - 1) * t * value - (j - 1) * before) / j
                slope = count * (t * value - before) / (t * t - 1)
                t -= value / slope
            powers[i] = [float(t**k - 1) for k in range(1, terms + 1)]
            weights[i] = float(1 / ((1 - t * t) * slope * slope))
    return powers, weights


@cache
def _ellipses(terms: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Re z^k - 1 at points z of each ellipse, and on [-1, 1]; for each ellipse a number to add to
    log M and one to multiply by, for the nodes with which half an integral misses 1 at most."""
    angle = np.linspace(0.0, np.pi, terms + 4)
    z = (_AXES[:, None] * np.exp(1j * angle) + np.exp(-1j * angle) / _AXES[:, None]) / 2
    k = np.arange(1, terms + 1)
    inside = np.linspace(-1.0, 0.5, 4)[:, None] ** k
    bounds = np.log(32 / 15 / (1.0 - _AXES**-2.0)), 0.5 / np.log(_AXES)
    outside = np.ascontiguousarray((z.reshape(-1, 1) ** k).real)
    return outside - 1.0, inside - 1.0, np.array(bounds).T


@cache
def _to_cells(terms: int) -> FloatArray:
    """Half the integrals of t^k from 1 to the left ends of `_CELLS` equal cells of [-1, 1]."""
    t, k = np.linspace(-1.0, 1.0, _CELLS + 1)[:-1, None], np.arange(1, terms + 1)
    powers: FloatArray = (t**k - 1.0) / (2 * k)
    return powers


def _start(series: FloatArray, size: FloatArray) -> FloatArray:
    """t up to which lam (V(end) - V) is too low to count in the single integral."""
    terms = np.arange(len(series))
    # Between the ends of a cell a function is above the smaller by its width^2/8 times the second
    # derivative, which is half of q'.
    above = (2.0 / _CELLS) ** 2 / 16 * (terms @ np.abs(series))
    exponents = _to_cells(len(series)) @ series
    highest = np.maximum.accumulate(exponents, axis=0) + above
    below = (highest < -(_BELOW + np.log1p(len(series) * size))).sum(axis=0)
    start: FloatArray = 2.0 / _CELLS * np.maximum(below - 1, 0) - 1.0
    return start
