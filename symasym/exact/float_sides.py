r"""Sides of mild scenes in float64: from -r to the start with one row of equal panels.

On a side, lam phi is a polynomial q(t)/h on [-1, end], t from -1 to 1, whose coefficients have the
sum Q of their moduli. Then lam V moves by Q at most, and where that is moderate nothing needs a
logarithm but sigma left of u = -1, in units of which the panels are joined (`sweep.carried`).

Where that sigma is above e^(Q + 45), S is constant on [-1, end] to all digits, so that

    w = e^{lam (V(end) - V(-1))} w(-1) + lam int_{-1}^{end} e^{lam (V(end) - V(u))} du,

a single integral, of which only the part counts where the exponent is above -36 - log(1 + Q).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import NamedTuple

import numpy as np

from symasym.base.call_context import step
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels, sweep
from symasym.exact.float_blocks import FAINT, MILD, centred
from symasym.exact.float_panels import NODES, REACH, REACH_DOWN, RESOLUTION
from symasym.exact.sweep import Record, Swept
from symasym.numbers.float_arrays import LogPositive, Positive

#: Panels of a side.
_COUNTS = np.array([1, 2, 3, 4, 5, 6, 7, 8, 10, 12, 14, 16, 20, 24])
_ULP = 2e-16  # of an exponent, its sum included
_ROUNDING = 2e-15  # of fewer than 15 operations; and what is left out, below e^-36
#: Exponents of a single integral that change none of its digits, beside log(1 + Q).
_BELOW = 36.0
#: Q from which on such exponents are looked for.
_LONG = 60.0
_CELLS = 16  # of [-1, 1], in which they are
#: The largest |q| of one, two, … panels where V falls, and where from the end they begin.
_GRADED = np.array([10.0, 28.0, 50.0, 76.0])
_FEW = 250  # panels, of which more are taken rather than another group of sides


class _Sides(NamedTuple):
    """Some sides: lam, the coefficients of q, the sum of their moduli, the largest |q|, True where
    q > 0, the width h, the relative error of a panel; log sigma, its error, and w at u = -1."""

    lam: FloatArray
    series: FloatArray
    size: FloatArray
    steep: FloatArray
    falls: np.ndarray
    h: FloatArray
    own: FloatArray
    log_sigma: FloatArray
    error: FloatArray
    w: FloatArray

    def take(self, index: IntArray) -> _Sides:
        """Some of the sides."""
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
    sides = _Sides(lam, series, size, *_steepest(series, size), h, own, log_sigma, error, w)
    # Few sides more of the general rule cost less than another.
    alone = sides.log_sigma > FAINT + size
    if alone.all():
        found = _single(sides)
    elif size[alone].sum() < _FEW * REACH:
        found = _nested(sides)
    else:
        found = np.empty((4, len(index)))
        for rule, chosen in ((_single, alone), (_nested, ~alone)):
            some = np.flatnonzero(chosen)
            found[:, some] = rule(sides.take(some))
    done = np.isfinite(found).all(axis=0)
    if not done.all():
        index, found = index[done], found[:, done]
    return index, _logs(found)


def _logs(found: FloatArray) -> Swept:
    """sigma and w from their logarithms, each followed by its error."""
    return Swept(LogPositive(found[0], found[1]), LogPositive(found[2], found[3]))


def _groups(wanted: FloatArray) -> Iterator[tuple[int, IntArray]]:
    """Numbers of panels, each with sides that want no more; few enough for the cache."""
    place = np.searchsorted(_COUNTS, wanted)
    order = np.argsort(place, kind="stable")
    ends = np.searchsorted(place[order], np.arange(len(_COUNTS)), side="right").tolist()
    low, numbers = 0, _COUNTS.tolist()
    for count, high, following in zip(numbers, ends, [*numbers[1:], np.inf], strict=True):
        if (high - low) * (following - count) < _FEW:
            continue
        at_once = min(float_panels.AT_ONCE // count, float_panels.COLUMNS)
        for begin in range(low, high, at_once):
            step()
            yield count, order[begin : min(begin + at_once, high)]
        low = high


def _nested(sides: _Sides) -> FloatArray:
    """log sigma, its error, log w and its error, nan where `_COUNTS` are not enough."""
    lam, series, size, steep, falls, h, own = sides[:7]
    moments, missed = np.full((4, len(h)), np.nan), np.full(len(h), np.nan)
    place, memory = float_panels.memory()
    for count, some in _groups(steep / np.where(falls, REACH_DOWN, REACH)):
        (out,) = float_panels.arrays_in(place, (NODES,), (count, len(some)))
        exponents = float_panels.exponents_of_series(series[:, some], count, out)
        moments[:, some], missed[some] = float_panels.sampled(*exponents, h[some], memory)
    rise, int_e, int_inverse, nested = moments
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


def _single(sides: _Sides) -> FloatArray:
    """The same where S is constant."""
    lam, series, size, steep, falls, h, own = sides[:7]
    to_end = float_panels.running_powers(1, len(series))[1][0]
    rise = -(to_end @ series)
    moved = _ULP * size
    long = np.flatnonzero(size > _LONG)
    if long.size:
        series, h, steep, falls = (x.copy() for x in (series, h, steep, falls))
        start = _start(series[:, long], size[long])
        kept = centred(series[:, long], start, 1.0, (1.0 - start) / 2)
        series[:, long] = kept
        h[long] *= (1.0 - start) / 2
        steep[long], falls[long] = _steepest(kept, np.abs(kept).sum(axis=0))
    # Where V falls the first panels hardly count: they are longer. Elsewhere all are equal.
    few = np.searchsorted(_GRADED, steep) + 1
    equal = np.maximum(steep / REACH_DOWN, len(_GRADED) + 1)
    wanted = np.where(falls | (few == 1), few, equal)
    total, missed = np.full((2, len(h)), np.nan)
    place = float_panels.memory()[0]
    for count, some in _groups(wanted):
        to_nodes, width = _to_end(count, len(series))
        (terms,) = float_panels.arrays_in(place, (NODES,), (count, len(some)))
        np.exp(np.matmul(to_nodes, series[:, some], out=terms), out=terms)
        sums = float_panels.last_coefficients() @ terms
        sums *= width
        last = np.abs(sums[:, 1]) + np.abs(sums[:, 2])
        total[some] = sums[:, 0].sum(axis=0)
        missed[some] = 6e-4 * (last * last / sums[:, 0]).sum(axis=0) / total[some]
    missed[missed > RESOLUTION] = np.nan
    inside = Positive(h * total, own + missed + _ROUNDING)
    w = Positive(np.exp(rise), moved) * Positive(sides.w, 2 * own) + lam * inside
    log = sides.log_sigma - rise
    error = sides.error + moved + _ROUNDING * (1.0 + np.abs(log))
    return np.array((log, error, np.log(w.value), w.error + _ROUNDING))


def _steepest(series: FloatArray, size: FloatArray) -> tuple[FloatArray, np.ndarray]:
    """The largest |q|, seen at the Lobatto nodes where it is not small; True where q > 0."""
    steep, falls = size.copy(), 2 * series[0] > size
    large = np.flatnonzero(size > REACH)
    if large.size:
        powers = float_panels.lobatto_powers(len(series))[::2]
        values = float_panels.by_columns(powers, series[:, large])
        low, high = values.min(axis=0), values.max(axis=0)
        steep[large], falls[large] = np.maximum(-low, high), low > 0
    return steep, falls


@cache
def _to_end(count: int, terms: int) -> tuple[FloatArray, FloatArray]:
    """Half the integrals of t^k from 1 to the Gauss nodes of panels of [-1, 1], of up to four in
    the proportions of `_GRADED`; and the widths of the panels in that of [-1, 1]."""
    ends = np.linspace(-1.0, 1.0, count + 1)
    if count <= len(_GRADED):
        ends = 1.0 - 2.0 * np.append(0.0, _GRADED[:count])[::-1] / _GRADED[count - 1]
    width = np.diff(ends)
    nodes = ends[:-1, None] + width[:, None] * float_panels.gauss().nodes
    k = np.arange(1, terms + 1)
    powers = (nodes[..., None] ** k - 1.0) / (2 * k)
    return powers, width[:, None, None] / 2


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
