r"""Sides of mild scenes in float64: from -r to the start with one row of panels.

On a side, lam phi is a polynomial q(t)/h on [-1, end], t from -1 to 1, whose coefficients have the
sum Q of their moduli. Then lam V moves by Q at most, and where that is moderate nothing needs a
logarithm but sigma left of u = -1, in units of which the panels are joined (`sweep.carried`).
Panels end where the integral of |q|/2, by its values at the ends of equal cells, is so large that
e^{lam V} has moved as far on each.

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

from symasym.base.call_context import step
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels, sweep
from symasym.exact.float_blocks import FAINT, MILD, centred
from symasym.exact.float_panels import NODES, REACH, REACH_DOWN, RESOLUTION, Moments
from symasym.exact.sweep import Record, Swept
from symasym.numbers.float_arrays import LogPositive
from symasym.numbers.positive import Positive

_ULP = 2e-16  # of an exponent, its sum included
_ROUNDING = 2e-15  # of fewer than 15 operations; and what is left out, below e^-36
#: Largest Q of a side that is taken: e^Q, and its product with others, are floats.
_HIGHEST = 300.0
#: q' that take a panel of their own, or |q| = REACH; the squares of both are added.
_BENT = 3 / 16
#: Exponents of a single integral that change none of its digits, beside log(1 + Q).
_BELOW = 36.0
#: Q from which on such exponents are looked for.
_LONG = 60.0
_CELLS = 16  # of [-1, 1], in which they are
#: Nodes of the rules of the single integral, and sums of half axes of the ellipses.
_RULES = np.array([16, 24, 32])
_AXES = np.array([2.5, 3.5, 5.0, 7.0, 10.0])
_ENOUGH = -34.5  # of log(what a rule misses times Q)
_FEW = 32  # sides, of which more are taken rather than another rule


class _Sides(NamedTuple):
    """Some sides: lam, the coefficients of q, the sum of their moduli, the width h, the relative
    error of a panel; log sigma, its error, and w at u = -1."""

    lam: FloatArray
    series: FloatArray
    size: FloatArray
    h: FloatArray
    own: FloatArray
    log_sigma: FloatArray
    error: FloatArray
    w: FloatArray

    def take(self, index: IntArray) -> _Sides:
        """Some of the sides."""
        if len(index) == len(self.lam):
            return self
        return _Sides(*(x[..., index] for x in self))


def swept(field: Field, lam: FloatArray, r: FloatArray, end: FloatArray) -> tuple[IntArray, Swept]:
    """The mild ones among the sides, and sigma and w at their ends (`symasym.exact.sweep`).

    Mild are those of a polynomial, with r > 1 >= |end|, that few panels resolve.

    Parameters
    ----------
    field : Field
        One scene a side, swept from the left.
    lam, r, end : arrays of shape (sides,)
        A side is [-r, end].
    """
    rate = lam * field.size()[: len(lam)]
    mild = (r > 1.0) & (end > -1.0) & (end <= 1.0) & (rate < MILD)
    index = np.arange(len(lam)) if mild.all() else np.flatnonzero(mild)
    coefficients = None if field.directions else field.series(index)
    if coefficients is None or not index.size:
        return index[:0], _logs(np.empty((4, 0)))
    a_minus = field.a_minus
    if len(index) < len(lam):
        lam, r, end, rate, a_minus = (x[index] for x in (lam, r, end, rate, a_minus))
    h = end + 1.0
    series = centred(coefficients, -1.0, end, lam * h)
    size = np.abs(series).sum(axis=0)
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
        found[:, alone] = _single(sides.take(alone))
    rest = np.flatnonzero(np.isnan(found[0]) & (size < _HIGHEST))
    if rest.size:
        found[:, rest] = _nested(sides.take(rest))
    done = np.isfinite(found).all(axis=0)
    if not done.all():
        index, found = index[done], found[:, done]
    return index, _logs(found)


def _logs(found: FloatArray) -> Swept:
    """sigma and w from their logarithms, each followed by its error."""
    return Swept(LogPositive(found[0], found[1]), LogPositive(found[2], found[3]))


# -- two integrals and the nested one --------------------------------------------------------------


def _nested(sides: _Sides) -> FloatArray:
    """log sigma, its error, log w and its error, nan where the panels do not resolve e^{lam V}."""
    lam, series, size, h, own = sides[:5]
    (rise, int_e, int_inverse, nested), missed = _moments(series, h)
    missed[missed > RESOLUTION] = np.nan
    moved = _ULP * size
    own = own + missed + moved
    unit = np.exp(-sides.log_sigma)
    record = Record(
        Positive(int_e * unit, own + sides.error),
        Positive(int_inverse, own),
        Positive(nested * unit, own + sides.error),
        Positive(np.exp(np.minimum(rise, 0.0)), moved),
        Positive(np.exp(np.minimum(-rise, 0.0)), moved),
    )
    sigma, w = sweep.carried(Swept(1, Positive(sides.w, 2 * own)), record, lam)
    log = sides.log_sigma + np.log(sigma.value)
    error = sides.error + sigma.error + _ROUNDING * (1.0 + np.abs(log))
    return np.array((log, error, np.log(w.value), w.error + _ROUNDING))


def _moments(series: FloatArray, h: FloatArray) -> tuple[Moments, FloatArray]:
    """Moments of the sides, and what the nodes miss of them."""
    count, ends = _panels(series)
    number = len(ends) - 1
    row = np.repeat(np.arange(len(h)), count)
    low, high = ends[:-1] - 2.0 * row, ends[1:] - 2.0 * row
    width = (high - low) / 2
    local = series if number == len(h) else centred(series[:, row], low, high, width)
    # The rise of lam V, the integrals of `float_panels`, what is missed: one column a panel.
    parts = np.empty((5, number))
    place, memory = float_panels.memory()
    for begin in range(0, number, float_panels.AT_ONCE):
        step()
        some = slice(begin, min(begin + float_panels.AT_ONCE, number))
        (out,) = float_panels.arrays_in(place, (NODES,), (1, some.stop - begin))
        exponents, parts[:1, some] = float_panels.exponents_of_series(local[:, some], 1, out)
        for part, values in zip(parts[1:], float_panels.integrals(exponents, memory), strict=True):
            part[some] = values[0]
    parts[1:4] *= width
    parts[3] *= width
    if number > len(h):
        table = np.zeros((5, count.max(), len(h)))
        first = np.add.accumulate(count) - count
        table[:, np.arange(number) - first[row], row] = parts
    else:
        table = parts[:, None]
    return float_panels.joined(*table[:4], h), table[4].max(axis=0)


def _panels(series: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of panels of the sides, and where panels end, the k-th side being [2k - 1, 2k + 1].

    On none of them lam V moves by more than `REACH`, or falls by more than `REACH_DOWN`.
    """
    powers, slopes = _at_cells(len(series))
    values, cells = powers @ series, len(powers) - 1
    values = np.maximum(values / REACH_DOWN, values / -REACH)
    values *= values
    values += np.abs(slopes @ series)
    # An integral by the larger ends of the cells; nowhere 0.
    reached = np.add.accumulate(np.sqrt(np.maximum(values[1:], values[:-1]) + 1e-9))
    whole = np.ceil(reached[-1] / cells)
    count = whole.astype(np.intp)
    if len(count) == count.sum():
        return count, np.arange(len(count) + 1) * 2.0 - 1.0
    reached *= whole / reached[-1]
    reached += np.add.accumulate(whole) - whole
    known = np.append(0.0, reached.T)
    ends = np.interp(np.arange(count.sum() + 1.0), known, np.arange(float(len(known))))
    return count, ends * (2.0 / cells) - 1.0


@cache
def _at_cells(terms: int) -> tuple[FloatArray, FloatArray]:
    """t^k at the ends of equal cells of [-1, 1], two for each term and not fewer than eight, and
    `_BENT` times its derivative."""
    t, k = np.linspace(-1.0, 1.0, max(8, 2 * terms) + 1)[:, None], np.arange(terms)
    return t**k, _BENT * k * t ** np.maximum(k - 1, 0)


# -- a single integral -----------------------------------------------------------------------------


def _single(sides: _Sides) -> FloatArray:
    """The same where S is constant, by one rule for the whole of a side."""
    lam, series, size, h, own = sides[:5]
    # lam (V(end) - V) is the sum of these times t^k - 1.
    heights = series / (2.0 * np.arange(1, len(series) + 1)[:, None])
    rise = heights[::2].sum(axis=0) * -2.0
    moved = _ULP * size
    long = np.flatnonzero(size > _LONG)
    if long.size:
        heights, h = heights.copy(), h.copy()
        start = _start(series[:, long], size[long])
        half = (1.0 - start) / 2
        kept = centred(series[:, long], start, 1.0, half)
        heights[:, long] = kept / (2.0 * np.arange(1, len(series) + 1)[:, None])
        h[long] *= half
    bounds, powers = _ellipses(len(series))
    most = (powers @ heights).reshape(len(_AXES), -1, len(h)).max(axis=1)
    least = np.array([(most - bound).min(axis=0) for bound in bounds])
    rule = (least > _ENOUGH - np.log1p(size)).sum(axis=0)
    total = np.full(len(h), np.nan)
    for k, count in enumerate(_RULES):
        some = np.flatnonzero(rule == k)
        nodes, weights = _to_end(count, len(series))
        for low in range(0, len(some), float_panels.COLUMNS):
            step()
            part = some[low : low + float_panels.COLUMNS]
            total[part] = weights @ np.exp(nodes @ heights[:, part])
    missed = np.exp(least[np.minimum(rule, len(_RULES) - 1), np.arange(len(h))]) / total
    inside = Positive(h * total, own + missed + _ROUNDING)
    w = Positive(np.exp(rise), moved) * Positive(sides.w, 2 * own) + lam * inside
    log = sides.log_sigma - rise
    error = sides.error + moved + _ROUNDING * (1.0 + np.abs(log))
    return np.array((log, error, np.log(w.value), w.error + _ROUNDING))


@cache
def _to_end(count: int, terms: int) -> tuple[FloatArray, FloatArray]:
    """t^k - 1 at the nodes of Gauss's rule, k from 1, and half its weights."""
    t, weights = np.polynomial.legendre.leggauss(count)
    powers: FloatArray = t[:, None] ** np.arange(1, terms + 1) - 1.0
    return powers, weights / 2


@cache
def _ellipses(terms: int) -> tuple[FloatArray, FloatArray]:
    """For each rule and ellipse the logarithm of what divides M in the bound of half an integral;
    Re z^k - 1 at points z of each ellipse."""
    angle = np.linspace(0.0, np.pi, 2 * terms + 3)
    z = (_AXES[:, None] * np.exp(1j * angle) + np.exp(-1j * angle) / _AXES[:, None]) / 2
    powers = z.reshape(-1, 1) ** np.arange(1, terms + 1)
    bounds = 2.0 * _RULES[:, None] * np.log(_AXES) - np.log(32 / 15 / (1.0 - _AXES**-2.0))
    return bounds[..., None], np.ascontiguousarray(powers.real) - 1.0


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
    below = (highest < -(_BELOW + np.log1p(size))).sum(axis=0)
    start: FloatArray = 2.0 / _CELLS * np.maximum(below - 1, 0) - 1.0
    return start
