r"""Sides of moderate scenes in float64: from -r to the start with panels of their own.

On a side, lam phi is a polynomial q(t)/h on [-1, end], t from -1 to 1. With Q the sum of the moduli
of its coefficients over k + 1, lam V moves by Q at most; where that is moderate sigma and w sigma
are carried through the panels as they stand: w sigma is lam times the integral of sigma, and gains
lam (sigma int 1/e + the nested integral) on a panel (`sweep.carried`). Only sigma left of u = -1
needs a logarithm. Panels are as long as the local |q| and its derivatives allow, all of a side
alike: they end where an integral over equal cells passes whole numbers.

Where that sigma is above e^(Q + 45), S is constant on [-1, end] to all digits, so that

    w = e^{lam (V(end) - V(-1))} w(-1) + lam int_{-1}^{end} e^{lam (V(end) - V(u))} du,

a single integral, of which only the part counts where the exponent is above -36 - log(1 + Q). It
takes one Gauss rule: with n nodes the rule of f misses at most 64/15 M rho^(-2n)/(1 - rho^-2) on
[-1, 1], where |f| <= M on the ellipse of foci -1 and 1 whose half axes have the sum rho (L. N.
Trefethen, Approximation Theory and Approximation Practice, theorem 19.3).

Derivatives by parameters go along as dual arrays, by panels alone. All that is linear in q is done
at once, to the coefficients and, behind them in one array, to their derivatives.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.call_context import own_context, step
from symasym.base.inputs import FloatArray
from symasym.drift.field.float_field import Field, IntArray
from symasym.exact import float_panels
from symasym.exact.float_blocks import FAINT, MODERATE, centred
from symasym.exact.float_panels import NODES, REACH, REACH_DOWN, RESOLUTION
from symasym.exact.float_records import SLOPE_ROUNDING, SLOPE_TRUNCATION
from symasym.exact.sweep import Swept
from symasym.numbers.float_arrays import DualArray, empty, slopes_of, value_of, with_log
from symasym.special.exponentials import log_quotient, mean_place, spread_of_place

if TYPE_CHECKING:
    from symasym.drift.field.directions import Directions

_ULP = 2e-16  # of an exponent, its sum included
_ROUNDING = 2e-15  # of fewer than 15 operations; and what is left out, below e^-36
#: Largest Q of a side that is taken: the errors are proportional to it.
_HIGHEST = 1000.0
#: q' that take a panel of their own, or |q| = REACH; the squares of both are added.
_BENT = 3 / 16
#: Exponents of a single integral that change none of its digits, beside log(1 + Q).
_BELOW = 36.0
#: Q from which on such exponents are looked for.
_LONG = 60.0
_CELLS = 16  # of [-1, 1], in which they are
#: Nodes of the single integral: multiples of a number, up to another.
_RULES, _MOST = 4, 48
#: The sum of the half axes of the ellipse.
_AXES = 4.0
_ENOUGH = -34.5  # of log(what a rule misses times Q)
_FEW = 32  # sides, of which more take a rule of their own


class _Sides(NamedTuple):
    """Some sides: lam, the coefficients of q, Q, the width h, the relative error of a panel, that
    of an exponential; log sigma at u = -1, its error with those of a side, and w there.

    In directions lam, log sigma and w are dual, the slopes of the error are the errors of slopes,
    the coefficients' derivatives come after them, and so do those of Q, by which no exponent
    changes more, in `reach`.
    """

    lam: Any
    series: FloatArray
    size: FloatArray
    h: FloatArray
    own: FloatArray
    moved: FloatArray
    log_sigma: Any
    error: Any
    w: Any
    reach: FloatArray

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
    index = moderate.nonzero()[0]
    some = _run(index)
    coefficients = field.series(some)
    if coefficients is None or not index.size:
        return index[:0], _logs(np.empty((4, 0)))
    lam, r, end, rate, a_minus = (x[some] for x in (lam, r, end, rate, field.a_minus))
    h = end + 1.0
    terms = len(coefficients)
    if field.directions:
        coefficients = field.directions.series(coefficients, some)
    if (end == end[0]).all():
        series = _shift(terms, float(end[0])) @ coefficients
        series *= lam * h
    else:
        series = _centred(coefficients.copy(), (end - 1.0) / 2, h / 2, lam * h)
    reach = _weights(terms) @ np.abs(series)
    size = _first(reach, 1)
    # The error of a panel is that of others which are not graded (`symasym.exact.floats`).
    own = 5e-15 + 8e-18 * rate
    # Left of u = -1 sigma and w are those of a constant drift.
    width = r - 1.0
    w = lam * width
    x = w * a_minus
    log_sigma = log_quotient(x, width)
    w *= mean_place(x)
    moved = _ULP * size
    error = own + moved + _ULP * np.maximum(x, 0.0) + _ROUNDING
    sides = _Sides(lam, series, size, h, own, moved, log_sigma, error, w, reach)
    found: Any = np.empty((4, len(index)))
    found[3] = np.nan
    alone = (log_sigma > FAINT + size).nonzero()[0]
    if field.directions:
        sides = _with_slopes(sides, field.directions, coefficients[1:], width, x)
        found = empty(found.shape, sides.w)
        found.value[:] = np.nan
    elif alone.size > _FEW:
        some = _run(alone)
        found[:, some] = _single(sides.take(some))
    rest = (np.isnan(value_of(found)[3]) & (size < _HIGHEST)).nonzero()[0]
    if rest.size:
        some = _run(rest)
        for row, values in zip(found, _nested(sides.take(some)), strict=True):
            row[some] = values
    done = value_of(found)[1:].sum(axis=0)
    if field.directions:
        done += found.slopes.sum(axis=(0, 1))
    if not math.isfinite(done.sum()):
        done = np.isfinite(done)
        index, found = index[done], found[:, done]
    return index, _logs(found)


def _with_slopes(
    sides: _Sides, directions: Directions, changes: FloatArray, width: FloatArray, x: FloatArray
) -> _Sides:
    """The sides with all slopes at u = -1, where the derivatives of lam A over lam are polynomials
    with these `changes` for coefficients; x = lam a- `width`."""
    lam, mean, away = sides.lam, mean_place(x), mean_place(-x)
    rate = directions.rate(lam)
    signs = np.resize((1.0, -1.0), changes.shape[1])
    of_x, known = (lam * width * y for y in (signs @ changes, 1e-15 * np.abs(changes).sum(axis=1)))
    wider = slopes_of(directions.outer_width(width)) / width
    of_x += x * wider
    of_sigma, of_w = away * of_x + wider, spread_of_place(x) / mean * of_x
    known *= np.maximum(away, spread_of_place(x) / mean)
    # sigma counts beside e^Q h.
    beside = np.exp(np.minimum(sides.size - sides.log_sigma, 0.0))
    reach = sides.reach[1:] + np.abs(of_w) + np.abs(wider) + beside * np.abs(of_sigma)
    known += SLOPE_ROUNDING * (np.abs(of_sigma) + np.abs(of_w))
    shares = sides.own + sides.moved + _ROUNDING + _ULP * np.maximum(x, 0.0) * beside
    known += (2.0 * shares + SLOPE_ROUNDING) * reach
    return sides._replace(
        lam=rate,
        log_sigma=DualArray(sides.log_sigma, of_sigma),
        w=DualArray(sides.w, sides.w * (rate.slopes / lam + wider - of_w)),
        error=DualArray(sides.error, known),
        reach=reach,
    )


@cache
def _weights(terms: int) -> FloatArray:
    """Integrals of t^k from 0 to 1."""
    return 1.0 / np.arange(1.0, terms + 1)


def _dual(x: FloatArray) -> Any:
    """A matrix, or the dual array of several, one after the other."""
    return x if x.ndim == 2 else DualArray(x[0], x[1:])


def _first(x: FloatArray, axes: int) -> FloatArray:
    """The first of arrays that are one after the other, where these have so many axes; else `x`."""
    return x if x.ndim == axes else x[0]


def _centred(coefficients: FloatArray, middle: Any, half: Any, scale: FloatArray) -> FloatArray:
    """`centred`, of one array or of several, one after the other."""
    centred(coefficients.swapaxes(0, -2), middle, half, scale)
    return coefficients


@lru_cache
def _shift(terms: int, end: float) -> FloatArray:
    """The matrix that `centred` multiplies polynomials by for [-1, end]."""
    return centred(np.eye(terms), (end - 1.0) / 2, (end + 1.0) / 2, np.ones(terms))


def _run(index: IntArray) -> slice | IntArray:
    """The same indices, of which nothing is copied where they follow each other."""
    if index.size and index[-1] - index[0] == index.size - 1:
        return slice(int(index[0]), int(index[-1]) + 1)
    return index


def _logs(found: FloatArray) -> Swept:
    """sigma and w from their logarithms, each followed by its error."""
    return Swept(with_log(found[0], found[1]), with_log(found[2], found[3]))


# -- panels ----------------------------------------------------------------------------------------


def _nested(sides: _Sides) -> tuple[FloatArray, ...]:
    """log sigma, its error, log w and its error, nan where the panels do not resolve e^{lam V}."""
    state, off = _joined(sides, *_integrals(sides.series))
    sigma, time = state
    missed = _first(off, 1)
    missed[missed > RESOLUTION] = np.nan
    # Exponents lam (V(v) - V(u)) are off by `moved` at most, by as much for each of two in w.
    lost: Any = sides.own + missed
    if isinstance(sides.error, DualArray):
        lost = DualArray(lost, SLOPE_TRUNCATION * off[1:] + 2.0 * missed * sides.reach)
    log, error = np.log(sigma * sides.h), sides.error + lost
    time /= sigma
    time *= sides.lam * sides.h
    lost *= 2.0
    lost += sides.moved
    return log, error + _ROUNDING * np.abs(value_of(log)), np.log(time), error + lost


def _integrals(series: FloatArray) -> tuple[Any, FloatArray, list[int], IntArray]:
    """Of each panel e^{lam V} at its right end, 1 being that at its left one, the integrals of
    `float_panels.integrals` in half widths of the side; what the nodes miss of them.

    First come the first panels of all sides, then the second ones, ...: how many there are of each,
    and the sides' order.
    """
    count, ends = _panels(_first(series, 2))
    number, sides = len(ends) - 1, len(count)
    order, widths = np.arange(sides), [sides]
    if number > sides:
        # The sides with most panels first.
        order = (-count).argsort(kind="stable")
        widths = (sides - np.add.accumulate(np.bincount(count))[:-1]).tolist()
        first = (np.add.accumulate(count) - count)[order]
        side = np.concatenate([order[:n] for n in widths])
        at = np.concatenate([first[:n] + k for k, n in enumerate(widths)])
    parts = empty((4, number), _dual(series))
    missed = np.empty((*series.shape[:-2], number))
    place, memory = float_panels.memory()
    for begin in range(0, number, float_panels.AT_ONCE):
        step()
        some = slice(begin, min(begin + float_panels.AT_ONCE, number))
        local = series[..., some]
        if number > sides:
            row, left = side[some], at[some]
            # The k-th side is [2 k - 1, 2 k + 1] there.
            middle, half = ends.take(left), ends.take(left + 1)
            half -= middle
            half *= 0.5
            middle -= 2.0 * row
            middle += half
            local = _centred(series.take(row, axis=-1), middle, half, half)
        if local.ndim == 2:
            (out,) = float_panels.arrays_in(place, (NODES,), (1, local.shape[1]))
            exponents, rise = float_panels.exponents_of_series(local, 1, out)
            *integrals, lost = float_panels.integrals(exponents, memory)
        else:
            exponents, rise = float_panels.exponents_of_series(_dual(local), 1)
            *integrals, lost = float_panels.integrals(exponents)
        for part, found in zip(parts, (np.exp(rise), *integrals), strict=True):
            part[some] = found[0]
        missed[..., some] = lost[0]
        if local.ndim > 2:
            missed[1:, some] *= _weights(local.shape[1]) @ np.abs(local[1:])
        if number > sides:
            parts[1:4, some] *= half
            parts[3, some] *= half
    return parts, missed, widths, order


def _joined(
    sides: _Sides, parts: Any, missed: FloatArray, widths: list[int], order: IntArray
) -> tuple[Any, FloatArray]:
    """sigma in widths of the side and its integral in their squares, w sigma over lam, at the ends
    of the sides; the most that is missed on a panel."""
    state = empty((2, len(order)), sides.w)
    state[0] = np.exp(sides.log_sigma) / sides.h
    state[1] = sides.w / (sides.lam * sides.h) * state[0]
    if len(widths) > 1:
        state = state[:, order]
    most, low = np.zeros((*missed.shape[:-1], len(order))), 0
    for n in widths:
        end, int_e, int_inverse, nested = parts[:, low : low + n]
        sigma, time = state[:, :n]
        int_inverse *= sigma
        nested += int_inverse
        time += nested
        sigma += int_e
        sigma /= end
        np.maximum(most[..., :n], missed[..., low : low + n], out=most[..., :n])
        low += n
    if len(widths) == 1:
        return state, most
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return state[:, back], most[..., back]


def _panels(series: FloatArray) -> tuple[IntArray, FloatArray]:
    """Numbers of panels of the sides, and where panels end, the k-th side being [2k - 1, 2k + 1].

    On none of them lam V moves by more than `REACH`, or falls by more than `REACH_DOWN`, and no
    Taylor coefficient of many is above `float_panels.bends`.
    """
    at_cells, up_to = _at_cells(len(series))
    down, up, bent, *others = (at_cells @ series).reshape(-1, len(up_to), series.shape[1])
    # |q| in panels, squared.
    values = np.maximum(down, up, out=down)
    values *= values
    values += np.abs(bent, out=bent)
    for k, other in enumerate(others, 3):
        values += np.abs(other, out=other) ** (2 / k)
    steep = np.maximum(values[1:], values[:-1], out=values[:-1])
    np.sqrt(steep, out=steep)
    wanted = up_to[:-1, -1] @ steep
    wanted += 1e-9
    whole = np.ceil(wanted)
    # Small integers are sorted in a third of the time.
    count: IntArray = whole.astype(np.int16)
    until = np.add.accumulate(whole)
    number = int(until[-1])
    ends: FloatArray = np.arange(number + 1.0)
    if number == len(count):
        return count, ends * 2.0 - 1.0
    # In whole numbers of panels of each side, after those of the sides before it.
    steep *= whole / wanted
    np.subtract(until, whole, out=values[-1])
    known = np.zeros(steep.size + 1)
    reached = np.matmul(values.T, up_to, out=known[1:].reshape(steep.T.shape))
    reached[:, -1] = until
    ends = np.interp(ends, known, np.arange(float(len(known))))
    ends *= 2.0 / len(steep)
    ends -= 1.0
    return count, ends


@cache
def _at_cells(terms: int) -> tuple[FloatArray, FloatArray]:
    """t^k over `REACH_DOWN` and over -`REACH` at the ends of equal cells of [-1, 1], two for each
    term and not fewer than eight; its derivatives times `_BENT`, and of many terms the higher ones
    over k! and `float_panels.bends`; the matrix from a row of values on the cells to running means.
    """
    cells = max(8, 2 * terms)
    t, k = np.linspace(-1.0, 1.0, cells + 1)[:, None], np.arange(terms)
    rows = [t**k / REACH_DOWN, -(t**k) / REACH, _BENT * k * t ** np.maximum(k - 1, 0)]
    if terms > float_panels.PLAIN:
        weights = float_panels.binomials(terms) / float_panels.bends(terms)[:, None]
        rows += [w * t ** np.maximum(k - n, 0) for n, w in enumerate(weights, 2)]
    return np.vstack(rows), np.vstack((np.tri(cells).T / cells, np.ones(cells)))


# -- a single integral -----------------------------------------------------------------------------


def _single(sides: _Sides) -> tuple[FloatArray, ...]:
    """The same where S is constant, by a rule for many at once; nan where it misses too much."""
    lam, series, size, h, own, moved = sides[:6]
    rise = _to_ellipse(len(series))[-1] @ series
    largest = size.max()
    many = math.log(1.0 + len(series) * largest)
    if largest > _LONG:
        long = np.flatnonzero(size > _LONG)
        some = series.take(long, axis=1)
        start = _start(some, many)
        half = (1.0 - start) / 2
        series, h = series.copy(), h.copy()
        series[:, long] = centred(some, (1.0 + start) / 2, half, half)
        h[long] *= half
    total, missed = np.empty((2, len(h)))
    for low in range(0, len(h), float_panels.COLUMNS):
        step()
        part = slice(low, low + float_panels.COLUMNS)
        total[part], missed[part] = _by_rule(series[:, part], many)
    before = np.exp(rise) * sides.w
    w = before + lam * h * total
    log = sides.log_sigma - rise
    of_w = 2 * (own + _ROUNDING) + missed / total + moved * before / w
    return log, sides.error + _ROUNDING * np.abs(log), np.log(w), of_w


def _by_rule(series: FloatArray, many: float) -> tuple[FloatArray, FloatArray]:
    """Half the integrals of e^{lam (V(end) - V)} over [-1, 1], and what a rule of all may miss of
    them; `many` is log(1 + Q) or more."""
    count = series.shape[1]
    points = _to_ellipse(len(series))
    place, memory = float_panels.memory()
    (heights,) = float_panels.arrays_in(place, (len(points),), (1, count))
    np.matmul(points, series, out=heights[0])
    outside, inside = heights[0].reshape(2, -1, count).max(axis=1)
    # The mean of the exponential is e^inside/(1 + Q) or more, roughly.
    enough = np.maximum(inside, 0.0)
    enough += _ENOUGH - many
    excess = outside - enough
    known, each = math.log(15 / 32 * (1.0 - _AXES**-2)), 2.0 * math.log(_AXES)
    nodes = min(-int((known - excess.max()) / each // _RULES) * _RULES, _MOST)
    enough[excess > each * _MOST + known] = np.nan
    powers, weights = _to_end(nodes, len(series))
    (exponents,) = float_panels.arrays_in(memory, (nodes,), (1, count))
    np.matmul(powers, series, out=exponents[0])
    np.exp(exponents, out=exponents)
    return weights @ exponents[0], np.exp(enough)


@cache
def _to_end(count: int, terms: int) -> tuple[FloatArray, FloatArray]:
    """Half the integrals of t^k from 1 to the nodes of Gauss's rule, and half its weights, rounded
    once.

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
            powers[i] = [float((t**k - 1) / (2 * k)) for k in range(1, terms + 1)]
            weights[i] = float(1 / ((1 - t * t) * slope * slope))
    return powers, weights


def _integrals_to_end(z: Any, terms: int) -> FloatArray:
    """Half the real parts of the integrals of t^k from 1 to points z, a row each."""
    k = np.arange(1, terms + 1)
    powers: FloatArray = np.ascontiguousarray(((z[:, None] ** k - 1.0) / (2 * k)).real)
    return powers


@cache
def _to_ellipse(terms: int) -> FloatArray:
    """`_integrals_to_end` at points of the ellipse, and at as many of [-1, 1], the last at -1."""
    z = _AXES * np.exp(1j * np.linspace(0.0, np.pi, terms + 4))
    points = np.append((z + 1.0 / z) / 2, np.linspace(0.5, -1.0, terms + 4))
    return _integrals_to_end(points, terms)


@cache
def _to_cells(terms: int) -> FloatArray:
    """`_integrals_to_end` at the left ends of `_CELLS` equal cells of [-1, 1]."""
    return _integrals_to_end(np.linspace(-1.0, 1.0, _CELLS + 1)[:-1], terms)


def _start(series: FloatArray, many: float) -> FloatArray:
    """t up to which lam (V(end) - V) is too low to count in the single integral, at `_BELOW` and
    `many` below its largest value."""
    terms = np.arange(len(series))
    # Between the ends of a cell a function is above the smaller by its width^2/8 times the second
    # derivative, which is half of q'.
    above = (2.0 / _CELLS) ** 2 / 16 * (terms @ np.abs(series))
    highest = np.maximum.accumulate(_to_cells(len(series)) @ series, axis=0)
    below = (highest < -(_BELOW + many + above)).sum(axis=0)
    start: FloatArray = 2.0 / _CELLS * np.maximum(below - 1, 0) - 1.0
    return start
