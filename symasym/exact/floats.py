"""Float64 values of the exact integrals, for many scenes at once (`of_scenes`).

From the left end sigma' = 1 + lam phi sigma, Q' = sigma, both 0 at -r; from the right end the same
of the mirror image -phi(-u). With y = 1/sigma and w = lam Q/sigma at the start (docs/exact.md)

    T = (w_L + w_R)/(y_L + y_R),    C = y_L/(y_L + y_R),

and with -phi in place of phi sigma is the time spent on one side: P is sigma at 1 beside the times
outside, p_ss = 1/(sigma_L + sigma_R). All terms are positive, so that nothing cancels.

A panel is known by e = e^{lam (V - V(a))} at its end, int e, int 1/e and the nested integral. There
lam phi times half the width is a Chebyshev series. Three ways to cross [-1, 1]:

- *together*: `_GROUP` and more rows of similar shape share panels of 16 Gauss nodes, exponents are
  one matrix product, sigma and Q are plain numbers. Taken where lam V moves by less than
  `_MODERATE`, sigma stays below e^`_HIGHEST`, and one series holds A on [-1, 1]. Where sigma is so
  large that S is constant, w is an integral of 1/e, cut to where it is not below e^-`_FAINT`.
- *sampled*: a row's own panels, on which lam V moves by some 20 units and e is known by its values
  at 20 Gauss nodes; joined in logarithms.
- *slow*: lam |phi| is large on a panel and phi has no zero near, so that t_0 = -1/(lam phi),
  t_{k+1} = t_k'/(lam phi) has as sum a solution of t' = 1 + lam phi t, which gives the integrals.

What a panel misses is below `_MISSED` by bounds on ellipses about it; one that passed no such test
has error infinity. The claimed error is an estimate: rounding to first order, with constants that
were checked against balls. A row in doubt is swept once more with A by compensated Horner, then in
balls. lam and the drift's parameters may be complex (derivatives by a complex step).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from functools import cache, reduce
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from symasym.base.errors import AccuracyError
from symasym.base.inputs import is_array
from symasym.drift.evaluate import Sampled, sampled
from symasym.drift.models import Expression
from symasym.exact.balls import of_scene
from symasym.scenes import Answers, Request, Scenes, input_rounding, quantity_of, scene_at

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that balls gave and float64 rounded.
ROUNDING = 4e-16

_MISSED = math.log(1e-16)
_ULP = 2.3e-16
_OF_A = 0.37 * _ULP  # rounding of A, for each of its terms
_OWN = 4e-15  # relative error of a panel's integrals
_FEW, _COEFFICIENTS = 8, 16384  # of A; of all scenes at once, whose panels stay in memory

_NODES, _COMMON = 20, 16  # of a row's own panels, and of those that many share
_SLOW, _TERMS = 44.0, 40  # the slow series is right to e^{-44}
_CLIMB = 8.0  # of lam V on a sampled panel: the nested integral loses so much of e^x ulp
_UNITS, _MOST = 20.0, 24  # exponent on pieces that a row begins with, and their number
_DEEPEST, _PANELS, _AT_ONCE = 38, 2000, 1024  # halvings, panels of a row, columns in the cache

_DOWN, _UP = 10.0, 7.5  # what lam V falls and climbs by on a shared panel
_FAINT = 45.0  # e^{-45} changes nothing
_MODERATE, _HIGHEST = 2500.0, 650.0  # of the exponents of plain numbers
_CELLS, _GROUP = 16, 200

_AXES = 2.0 ** np.array([1.25, 2.0, 2.75, 3.5])[:, None]  # sums of the half axes of ellipses
_ENDS = np.array([3.0, 4.5, 8.0])[:, None]  # where others end
_STRENGTH = (_ENDS - 1.0) ** 2 / (2 * _ENDS)


class Logs(NamedTuple):
    """Natural logarithms of positive numbers, and estimates of their errors; rows come last."""

    log: Any
    error: Any

    def of(self, rows: Any) -> Logs:
        return Logs(self.log.take(rows, axis=-1), self.error.take(rows, axis=-1))

    def put(self, rows: Any, new: Logs) -> None:
        for x, y in zip((*self.log, *self.error), (*new.log, *new.error), strict=True):
            x[rows] = y


@cache
def matrices(terms: int, nodes: int = _NODES) -> Any:
    """What acts on Chebyshev coefficients, so many terms, and on values at Gauss's nodes."""
    cheb, leg = np.polynomial.chebyshev, np.polynomial.legendre
    roots = [arb.legendre_p_root(nodes, k, weight=True) for k in reversed(range(nodes))]
    x, weights = np.array([[float(y) for y in root] for root in roots]).T
    to_series = (np.arange(nodes)[:, None] + 0.5) * leg.legvander(x, nodes - 1).T * weights
    until, ends = np.append(x, 1.0), np.append(x, [-1.0, 1.0])
    k, marks = np.arange(terms), np.linspace(-1.0, 1.0, _CELLS + 1)
    fit: Any = np.cos(np.pi / 2 * (np.outer(k, 2 * k + 1) % (4 * terms)) / terms) * 2 / terms
    fit[0] /= 2

    def each(act: Any, number: int = terms) -> Any:
        return np.stack([act(row) for row in np.eye(number)], axis=1)

    def padded(c: Any) -> Any:
        return np.append(c, np.zeros(terms))[:terms]

    lines: Any = [cheb.Chebyshev([side / 2, 0.5]) for side in (-1, 1)]  # exact to degree 25 or so

    return SimpleNamespace(
        fit=fit,  # coefficients from values at `points`
        points=np.cos(np.pi * (k + 0.5) / terms),
        marks=marks,
        at_marks=cheb.chebvander(marks, terms - 1),
        to_end=each(lambda row: cheb.chebval(marks[:-1], cheb.chebint(row, lbnd=1))),
        values=cheb.chebvander(ends, terms - 1),
        integrals=each(lambda row: cheb.chebval(until, cheb.chebint(row, lbnd=-1))),
        halves=[each(lambda row, u=u: padded(cheb.Chebyshev(row)(u).coef / 2)) for u in lines],
        antiderivative=each(lambda row: cheb.chebint(row)[1:]),
        heights=np.cosh((k + 1) * np.log(_AXES)) + 1.0,  # of that on ellipses, and on [-1, 1]
        accuracy=-2 * nodes * np.log(_AXES),  # of Gauss's rule
        sizes=np.cosh(k[1:] * np.arccosh(_ENDS)),
        powers=each(lambda row: padded(cheb.cheb2poly(row)) / (k + 1)),  # integrated
        weights=weights,
        running=each(lambda row: leg.legval(until, leg.legint(row, lbnd=-1)), nodes) @ to_series,
        slopes=each(lambda row: leg.legval(ends, leg.legder(row)), nodes) @ to_series,
    )


def _times(matrix: Any, x: Any) -> Any:
    # Complex columns are pairs of real ones.
    return (matrix @ x.view(float)).view(x.dtype)


class Side(NamedTuple):
    """`sign` A(u) of rows, and where `mirror` is -1 the mirror image -`sign` A(-u)."""

    of: Sampled
    rows: Any
    mirror: Any
    sign: float
    off: Any  # the error of A
    edges: Any  # between them A is held by its Chebyshev terms

    def slope(self, some: Any, lam: Any, left: Any, half: Any) -> Any:
        """Chebyshev coefficients of lam phi times `half` on [left, left + 2 half]."""
        act, m = matrices(self.of.terms), self.mirror[some]
        u = m * ((left + half) + half * act.points[:, None])
        return act.fit @ self.of(u, self.rows[some]) * (self.sign * m * lam * half)

    def end(self, side: int) -> tuple[Any, Any]:
        """The value at an end, and its error."""
        left, right = (x[self.rows] for x in self.of.ends)
        a = self.sign * self.mirror * np.where(side * self.mirror < 0, left, right)
        return a, (_ULP * np.abs(a) + 1e-16 * self.off if self.of.careful else self.off)


def seen(of: Sampled, rows: Any, sign: float, both: bool) -> Side:
    """These rows of a drift, and behind them, where asked, their mirror images."""
    act = matrices(of.terms)
    c = act.fit @ of(act.points[:, None] + np.zeros(len(rows)), rows)
    size = np.abs(c).sum(axis=0)
    if of.exact:  # a polynomial's terms may be much larger than their sum
        size = np.maximum(size, np.abs(act.powers @ c).sum(axis=0))
    off = (_OF_A * of.terms if of.exact else max(_OF_A * _FEW, of.rounding)) * size
    off, edges = (off, np.array([-1.0, 1.0])) if of.exact else _resolved(of, rows, off)
    mirror = np.repeat([1.0, -1.0] if both else [1.0], len(rows))
    return Side(of, np.tile(rows, 1 + both), mirror, sign, np.tile(off, 1 + both), edges)


def _resolved(of: Sampled, rows: Any, off: Any) -> tuple[Any, Any]:
    """The error of A, and ends, in both orientations, of intervals on which a series holds A.

    Between cuts that is proved if the rows have one drift. Cuts are joined where the series' last
    terms are small and it is right at cuts and midway. Ready-made drifts that differ are judged by
    that alone; formulas of the caller's that differ, and what has too many cuts, are in doubt.
    """
    act, none, marks = matrices(of.terms), np.zeros(len(rows)), of.cuts
    if marks is None or (of.varied and isinstance(of.model, Expression)):
        return off + np.inf, np.array([-1.0, 1.0])
    if of.varied:
        marks = np.union1d(marks, np.linspace(-1.0, 1.0, 65))

    def holds(a: float, b: float) -> bool:
        inside, half = marks[(marks > a) & (marks < b)], (b - a) / 2
        if not inside.size and (not of.varied or half < 1e-9):
            return True
        c = act.fit @ of(a + half + half * act.points[:, None] + none, rows)
        allowed = 1e-14 * np.abs(c).sum(axis=0) + 2 * off
        if (np.abs(c[-2:]) > allowed).any():
            return False
        u = np.convolve(np.repeat([a, *inside, b], 2), [0.5, 0.5], "valid")  # these, and midway
        values = np.polynomial.chebyshev.chebvander((u - a) / half - 1.0, of.terms - 1) @ c
        return bool((np.abs(of(u[:, None] + none, rows) - values) <= allowed).all())

    found, waiting = [1.0], [(-1.0, 1.0)]
    while waiting:
        a, b = waiting.pop()
        if holds(a, b):
            found.append(a)
        else:
            waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
    return off, np.unique([*found, *-np.array(found)])


def panels(phi: Side, rows: Any, lam: Any, low: Any, high: Any) -> tuple[Logs, Any, Any]:
    """Records of each row's first panel, of the second, ...; rows by number; how many have each."""
    act, n = matrices(phi.of.terms), len(rows)
    # Pieces between edges, halved until they suffice.
    ends = np.clip(phi.edges[:, None], low, high)
    piece, row = np.nonzero(np.diff(ends, axis=0) > 0.0)
    left, half = ends[piece, row], (ends[piece + 1, row] - ends[piece, row]) / 2
    slope = phi.slope(rows[row], lam[row], left, half)
    # Where few are needed they are made at once; where many are, some may be slow.
    units = np.abs(slope).sum(axis=0) * (2 / _UNITS) + 1e-9
    few = np.bincount(row, units, n)[row] < _MOST
    count = np.where(few, np.ceil(units), 1.0).astype(int)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, left, half = (np.repeat(x, count) for x in (row, left, half / count))
    left = left + 2 * half * step
    slope = phi.slope(rows[row], lam[row], left, half)
    off = np.abs(lam[row]) * half * phi.off[rows[row]]
    if not phi.of.exact:  # the last terms tell what is missing, noise included
        off += 2 * np.abs(slope[-2:]).max(axis=0)
    kept = []
    for level in range(_DEEPEST + 1):
        blocks = range(0, slope.shape[1], _AT_ONCE)
        strength = np.concatenate([_tested(act, slope[:, i : i + _AT_ONCE]) for i in blocks])
        done = (strength >= 0.0) | ~(np.abs(slope[0]) < np.inf) | (level == _DEEPEST)
        done |= np.bincount(row[~done], minlength=n)[row] > _PANELS
        at = np.flatnonzero(done)
        kept.append([x.take(at, axis=-1) for x in (row, left, half, off, strength, slope)])
        at = np.flatnonzero(~done)
        if not at.size:
            break
        slope = slope.take(at, axis=1)
        slope = np.hstack([_times(m, slope) for m in act.halves])
        row, half, off = (np.tile(x[at], 2) for x in (row, half / 2, off / 2))
        left = np.tile(left[at], 2)
        left[len(at) :] += 2 * half[len(at) :]
        off += _ULP * np.abs(slope).sum(axis=0)
    parts = [np.concatenate(x, axis=-1) for x in zip(*kept, strict=True)]
    row, left = parts[:2]
    number = np.bincount(row, minlength=n)
    order = np.argsort(-number, kind="stable")
    widths = np.searchsorted(-number[order], -np.arange(number.max(initial=0)), side="left")
    by_row = np.lexsort((left, row))
    rank = np.arange(len(row)) - np.repeat(np.cumsum(number) - number, number)
    where = by_row[np.lexsort((np.argsort(order)[row[by_row]], rank))]
    row, left, half, off, strength, slope = (x.take(where, axis=-1) for x in parts)
    if phi.of.careful:
        # Once more where the panels are: what is left of rounding is relative to A there.
        slope = phi.slope(rows[row], lam[row], left, half)
        size = np.abs(slope)
        off = _OF_A * phi.of.terms * size.sum(axis=0) + _ULP / half * size[1:].sum(axis=0)
    return records(half, slope, off, strength), order, widths


def _tested(act: Any, slope: Any) -> Any:
    """0 where sampling suffices, the strength of the slow series where that does, else -1."""
    if len(slope) > _FEW:  # high terms that are rounding alone
        slope = np.where(np.abs(slope) < 4e-15 * np.abs(slope).sum(axis=0), 0.0, slope)
    # e^{lam (V(x) - V(u))} on ellipses, beside the error of Gauss's rule on them.
    heights = act.heights @ np.abs(_times(act.antiderivative, slope))
    heights += act.accuracy
    fits = (heights.min(axis=0) < _MISSED) & (_times(act.integrals[-1], slope).real > -_CLIMB)
    # Where |phi| is between 0 and twice its mean on an ellipse, the slow series is known.
    found, size = np.where(fits, 0.0, -1.0), np.abs(slope)
    at = np.flatnonzero(~fits & (size[0] > _SLOW / _STRENGTH[-1, 0]) & (size[0] < np.inf))
    size = size.take(at, axis=1)
    free = act.sizes @ size[1:] < size[0]
    strength = size[0] * (free * _STRENGTH).max(axis=0)
    found[at] = np.where(free[0] & (strength > _SLOW), strength, -1.0)
    return found


def records(half: Any, slope: Any, off: Any, strength: Any) -> Logs:
    """Of panels, e(b) = f/c, the larger 1: f, c, c int e, f int 1/e, f times the nested one."""
    act = matrices(len(slope))
    falls = _times(act.integrals[-1], slope)  # lam (V(a) - V(b))
    found, slow = np.ones((3, len(falls)), falls.dtype), strength > 0
    for mask, integrals in ((strength == 0, _sampled), (slow, _slow)):
        index = np.flatnonzero(mask)
        for low in range(0, len(index), _AT_ONCE):
            at = index[low : low + _AT_ONCE]
            found[:, at] = integrals(act, slope.take(at, axis=1), falls[at], strength[at])
    h, ends = np.log(half), _ends(falls, 2.0 * off)
    own = _OWN + 2.0 * off / np.where(slow, np.maximum(np.abs(slope[0]), 1e-300), 1.0)
    own[strength < 0] = np.inf  # neither kind of panel is known to be right
    lost = np.where(slow, 0.0, 0.3 * _ULP * np.exp(np.minimum(-falls.real, _CLIMB)))
    logs = np.log(found) + np.stack((h, h, 2 * h))
    return Logs(np.concatenate((ends.log, logs)), np.stack((*ends.error, own, own, 2 * own + lost)))


def _ends(falls: Any, moved: Any) -> Logs:
    """The smaller of e(b) and 1/e(b), the other being 1."""
    log = np.stack((np.minimum(-falls, 0.0), np.minimum(falls, 0.0)))
    return Logs(log, np.where(log < 0, 1.5 * _ULP * np.abs(falls) + moved, 0.0))


def _sampled(act: Any, slope: Any, falls: Any, _: Any) -> Any:
    """The three integrals for half width 1, from values at the nodes."""
    inverse = _times(act.integrals[:-1], slope)
    np.exp(inverse, out=inverse)
    running = _times(act.running, 1.0 / inverse)
    fall, climb = np.exp(np.minimum(-falls, 0.0)), np.exp(np.minimum(falls, 0.0))
    whole, nested = (_times(act.weights, x) for x in (inverse, running[:-1] * inverse))
    return np.stack((running[-1] * climb, whole * fall, nested * fall))


def _slow(act: Any, slope: Any, falls: Any, strength: Any) -> Any:
    """The same by the slow series from V's lower end; from the other its odd terms change sign."""
    g = _times(act.values, slope)
    down = np.flatnonzero(falls > 0)
    g[:_NODES, down] = -g[_NODES - 1 :: -1, down]
    g[_NODES:, down] = -g[_NODES:, down][::-1]
    order = np.argsort(strength)
    g, small = g.take(order, axis=1), np.exp(-np.maximum(falls, -falls)[order])
    # k terms are enough where k!/strength^k < e^{-38}.
    j = np.arange(1.0, _TERMS + 1)
    enough = np.maximum.accumulate(-np.exp((np.cumsum(np.log(j)) + 38.0) / j))
    needed = np.searchsorted(enough, -strength[order])
    inverse = np.negative(1.0 / g)
    term, even, odd = inverse, inverse.copy(), np.zeros_like(inverse)
    for k in range(1, _TERMS + 1):
        n = np.searchsorted(-needed, -k, side="right")
        if not n:
            break
        term = _times(act.slopes, term[:_NODES, :n]) * -inverse[:, :n]
        (odd if k % 2 else even)[:, :n] += term
    t, (back_a, back_b) = even + odd, (even - odd)[_NODES:]
    t_a, t_b = t[_NODES:]
    int_e, int_inverse = t_b - t_a * small, back_a - back_b * small
    found = np.zeros((3, len(order)), falls.dtype)
    found[:, order] = int_e, int_inverse, _times(act.weights, t[:-2]) - t_a * int_inverse
    found[2, down] = found[0, down] * found[1, down] - np.exp(-falls[down]) * found[2, down]
    return found


def constant(rate: Any, width: Any, off: Any) -> Logs:
    """The record of an interval of any width on which lam phi is `rate`, in closed form."""
    x = np.maximum(rate * width, -rate * width)
    mean = -np.expm1(-x) / x
    other = (1.0 - mean) / x
    if (some := np.flatnonzero(x.real < 0.5)).size:
        near, series = x[some], np.zeros(len(some))
        for k in range(15, 1, -1):
            series = 1.0 / math.factorial(k) - series * near
        mean[some], other[some] = 1.0 - near * series, series
    one, own = np.log(width * mean), 2e-15 + 2 * off / np.maximum(x.real, 1.0)
    nested = np.log(np.where(rate > 0, mean * mean - np.exp(-x) * other, other)) + 2 * np.log(width)
    ends = _ends(rate * width, off + 2 * _ULP * x.real)
    return Logs(np.stack((*ends.log, one, one, nested)), np.stack((*ends.error, own, own, 2 * own)))


def carried(before: Logs, panel: Logs, lam: Any) -> Logs:
    """y' = f y/(c + I y), w' = (f w + lam J + lam N y)/(c + I y), e' = e f/c; errors by shares."""
    (y, w, e), (of_y, of_w, of_e) = before
    (fall, climb, i, j, n), (of_fall, of_climb, of_i, of_j, of_n) = panel
    # Whatever of c and I y is larger is divided out: neither may lose the other's digits.
    x = climb - y - i
    less = x.real < 0
    sigma, one = np.where(less, -y - i, -climb), np.where(less, -i, y - climb)
    tail, log_lam = np.exp(-np.maximum(x, -x)), np.log(lam)
    kept = np.where(less, tail, 1.0).real / (1.0 + tail.real)
    old, new, nested, log_n = _shares(fall + w + sigma, log_lam + j + sigma, log_lam + n + one)
    log_d, lost = np.log1p(tail), 1.0 - kept
    common = kept * of_climb + lost * of_i
    of_rate = of_fall + kept * of_y + common
    of_time = old * (of_fall + of_w) + new * of_j + nested * of_n + common
    of_time += np.abs(nested - lost) * of_y
    log = np.stack((fall + one - log_d, log_n - log_d, e + fall - climb))
    error = np.stack((of_rate, of_time, of_e + of_fall + of_climb))
    return Logs(log, error + _ULP * (2 + np.abs(log)))


def _shares(*logs: Any) -> tuple[Any, ...]:
    """The shares of positive numbers in their sum, and its logarithm."""
    top = reduce(np.maximum, logs)
    parts = [np.exp(x - top) for x in logs]
    whole = sum(parts[1:], parts[0])
    return *((p / whole).real for p in parts), top + np.log(whole)


def absorbing(lam: Any) -> Logs:
    """y, w and e where a sweep begins, sigma being 0."""
    ends, nothing = np.array([[np.inf], [-np.inf], [0.0]]), np.zeros((3, len(lam)))
    return Logs(ends + nothing.astype(lam.dtype), nothing)


def swept(phi: Side, lam: Any, begin: Any, end: Any, state: Logs) -> Logs:
    """y, w and e at `end` from those at `begin`, where e is 1."""
    low, high = np.clip(begin, -1.0, 1.0), np.clip(end, -1.0, 1.0)
    _outside(state, phi.end(-1), lam, np.minimum(end, -1.0) - begin)
    some = np.flatnonzero(high > low)
    if some.size and not phi.of.careful:
        some = some[~_together(state, phi, lam[some], low[some], high[some], some)]
    if some.size:
        of, order, widths = panels(phi, some, lam[some], low[some], high[some])
        order = some[order]
        now, at = state.of(order), 0
        for n in widths:
            first, panel = Logs(*(x[:, :n] for x in now)), Logs(*(x[:, at : at + n] for x in of))
            now.put(slice(n), carried(first, panel, lam[order[:n]]))
            at += n
        state.put(order, now)
    _outside(state, phi.end(1), lam, end - np.maximum(begin, 1.0))
    return state


def _outside(state: Logs, end: tuple[Any, Any], lam: Any, width: Any) -> None:
    """Across an interval of constant drift, whose width may be 0."""
    if (some := np.flatnonzero(width > 0)).size:
        (a, off), lam, width = (x[some] for x in end), lam[some], width[some]
        panel = constant(lam * a, width, np.abs(lam) * width * off)
        state.put(some, carried(state.of(some), panel, lam))


def _together(state: Logs, phi: Side, lam: Any, begin: Any, high: Any, rows: Any) -> Any:
    """Carry plain numbers through panels that many rows share; of which rows that was done.

    Where sigma is so large that S is constant, w is an integral of 1/e, cut to where it counts.
    """
    act, width = matrices(phi.of.terms, _COMMON), high - begin
    slope = phi.slope(rows, lam, begin, width / 2)
    reach, falls = 2.0 * np.abs(slope).sum(axis=0), act.integrals[-1] @ slope
    (y, w, e), (of_y, of_w, of_e) = now = state.of(rows)
    of_a = np.abs(lam) * phi.off[rows] / 2
    moved = 2.0 * of_a * width + 3.0 * _ULP * reach
    e -= falls
    of_e += moved + _ULP * np.abs(e)
    low = (reach + falls.real) / 2 - y.real < _HIGHEST
    faint = (-y.real > _FAINT + reach) & ((reach > 2 * _DOWN) | ~low)
    if (at := np.flatnonzero(faint)).size:
        y[at] -= falls[at]
        of_y[at] += moved[at] + _ULP * np.abs(y[at])
        for _ in range(_DEEPEST):
            if not (at := at[reach[at] > 2 * _FAINT]).size:
                break
            c = slope.take(at, axis=1)
            highest = np.maximum.accumulate((act.to_end @ c).real, axis=0)
            # Between ends of a cell lam V is above both by at most an eighth of its width^2 V''.
            above = np.arange(len(c)) ** 2 @ np.abs(c) * (2.0 / _CELLS) ** 2 / 8
            hidden = highest < -_FAINT - np.log1p(reach[at]) - np.maximum(w[at].real, 0.0) - above
            share = 1.0 - np.maximum(hidden.sum(axis=0) - 1, 0) / _CELLS
            at, share = at[share < 1.0], share[share < 1.0]
            width[at], w[at] = width[at] * share, -np.inf
            slope[:, at] = phi.slope(rows[at], lam[at], high[at] - width[at], width[at] / 2)
            reach[at] = 2.0 * np.abs(slope.take(at, axis=1)).sum(axis=0)
    done = (low | faint) & (reach < _MODERATE) & (len(phi.edges) == 2)
    # [-1, 1] is the interval of each row; the error of lam V per unit of it.
    off, half = of_a * width + 1.5 * _ULP * reach, lam * width / 2
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & faint), done):
        whole = np.exp(w[at])
        for j, f in _crossed(act, some, common, True):
            for gain, fall in zip(half[at] * j, f, strict=True):
                whole += gain
                whole /= fall
        w[at] = np.log(whole)
        of_w[at] += 2.0 * off[at] + 2 * _OWN + _ULP * np.abs(w[at])
    for at, some, common in _alike(act, slope, reach, np.flatnonzero(done & ~faint), done):
        sigma = np.exp(-y[at]) * (lam[at] / half[at])
        time = sigma * np.exp(w[at]) / half[at]
        # With absolute errors, of sigma and of int 1/e both, and of their time.
        both = np.array([sigma, sigma * of_y[at]])
        whole = np.array([time, time * (of_y + of_w)[at]])
        for h, i, j, n, f in _crossed(act, some, common, False):
            own = off[at] * h + _OWN
            lost = own + (0.3 * _ULP / np.abs(f) + _OWN)
            i, n = np.stack((i, i * own), axis=1), np.stack((n, n * lost), axis=1)
            for gain, inverse, nested, fall, error in zip(i, j, n, f, own, strict=True):
                whole += nested
                whole += both * inverse
                both += gain
                both *= fall
                both[1] += both[0] * error
        y[at] = -np.log(both[0] * (half[at] / lam[at]))
        w[at] = np.log(whole[0] / both[0] * half[at])
        of_y[at] = (both[1] / both[0]).real + _ULP * np.abs(y[at])
        of_w[at] = (whole[1] / whole[0]).real + of_y[at] + _ULP * np.abs(w[at])
    state.put(rows[done], now.of(np.flatnonzero(done)))
    return done


def _alike(act: Any, slope: Any, reach: Any, index: Any, done: Any) -> Iterator[Any]:
    """Groups of rows of similar reach with panels for all of them; others are not done."""
    index = index[np.argsort(reach[index])]
    size, low = reach[index], 0
    while low < len(index):
        last = (2.0 if size[-1] < 2.0 * size[low] + 15.0 else 1.5) * size[low] + 15.0
        high = min(np.searchsorted(size, last), low + 2 * _AT_ONCE)
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
    until = np.append(0.0, np.cumsum(np.maximum(steep[1:], steep[:-1]) + 1e-9)) * (2.0 / _CELLS)
    count = math.ceil(until[-1])
    if count > 2 + 2.5 * (2.0 * each.mean()):
        return None
    ends = np.interp(np.arange(count + 1) / count * until[-1], until, act.marks)
    for _ in range(_DEEPEST):
        h = np.diff(ends) / 2
        points = ends[:-1, None] + h[:, None] * (1.0 + act.points)
        maps = act.fit @ np.polynomial.chebyshev.chebvander(points, terms - 1)
        maps *= h[:, None, None]
        step, found = max(1, _AT_ONCE // rows), []
        for low in range(0, len(h), step):
            c = _times(maps[low : low + step], slope)
            found.append((np.abs(c).max(axis=2), _times(act.integrals[-1], c).real.min(axis=1)))
        largest, rise = (np.concatenate(x) for x in zip(*found, strict=True))
        size = np.abs(act.antiderivative) @ largest.T
        bad = (act.heights @ size + act.accuracy).min(axis=0) > _MISSED
        bad |= rise < -_CLIMB
        if not bad.any():
            return h, maps
        ends = np.sort(np.append(ends, (ends[:-1] + h)[bad]))
    return None


def _crossed(act: Any, slope: Any, common: tuple[Any, Any], single: bool) -> Iterator[Any]:
    """Of some panels at once: widths, int e, int 1/e, nested, 1/e(b); `single`: int 1/e, 1/e(b)."""
    (h, maps), (terms, rows) = common, slope.shape
    step = max(1, _AT_ONCE // rows)
    v = (act.integrals @ maps).swapaxes(0, 1)
    work = np.zeros((3, len(v) * min(step, len(h)) * rows), slope.dtype)  # kept in the cache
    for low in range(0, len(h), step):
        some = h[low : low + step, None]
        shape = len(v), len(some) * rows
        exponents, e, running = (x[: shape[0] * shape[1]].reshape(shape) for x in work)
        of = v[:, low : low + step].reshape(-1, terms)
        np.matmul(of, slope.view(float), out=exponents.view(float).reshape(len(of), -1))
        np.exp(exponents, out=exponents)
        inverse, fall = exponents[:-1], exponents[-1].reshape(-1, rows)
        int_inverse = _times(act.weights, inverse).reshape(-1, rows) * some
        if single:
            yield int_inverse, fall
            continue
        np.divide(1.0, inverse, out=e[:-1])
        np.matmul(act.running, e[:-1].view(float), out=running.view(float))
        inside = np.multiply(running[:-1], inverse, out=e[:-1])
        nested = _times(act.weights, inside).reshape(-1, rows) * some**2
        yield 2.0 * some, running[-1].reshape(-1, rows) * some, int_inverse, nested, fall


@np.errstate(all="ignore")
def logs_of(name: str, of: Sampled, numbers: Mapping[str, Any]) -> Logs:
    """log of "T", "C", "1 - C", "P", "1 - P" or "p_ss", and its estimated error, maybe infinite.

    `numbers` are arrays: kappa, which may be complex, and the quantity's own ones.
    """
    lam = 2.0 / (numbers["kappa"] * numbers["kappa"])
    found, many = [], max(256, _COEFFICIENTS // of.terms)
    for low in range(0, len(lam), many):
        rows = np.arange(low, min(low + many, len(lam)))
        found.append(_logs_of(name, of, lam[rows], {n: x[rows] for n, x in numbers.items()}, rows))
    logs, errors = map(np.concatenate, zip(*found, strict=True))
    return Logs(logs, np.where(np.isnan(logs + errors), np.inf, errors))


def _logs_of(name: str, of: Sampled, lam: Any, numbers: Mapping[str, Any], rows: Any) -> Logs:
    if name in ("T", "C", "1 - C"):
        start = numbers["start"]
        rate, w = sides(of, lam, numbers["r"], (start, -start), rows)
        if name == "T":
            (log, error), (other, of_other) = _total(*w), _total(*rate)
            return Logs(log - other, error + of_other)
        return _share(*(rate if name == "C" else rate[::-1]))
    n, phi = len(lam), seen(of, rows, -1.0, name == "p_ss")
    if name == "p_ss":
        y, lam = np.concatenate((numbers["y"], -numbers["y"])), np.tile(lam, 2)
        a, of_a = phi.end(-1)
        state = absorbing(lam)
        state.log[0], state.log[1] = np.log(-lam * a), 0.0
        state.error[0] = of_a / -a.real + _ULP * (2 + np.abs(state.log[0]))
        (log, *_), (error, *_) = swept(phi, lam, np.minimum(y, -1.0), y, state)
        total = _total(Logs(-log[:n], error[:n]), Logs(-log[n:], error[n:]))
        return Logs(-total.log, total.error)
    one = np.ones(n)
    (y, _, e), (of_y, _, of_e) = swept(phi, lam, -one, one, absorbing(lam))
    (left, of_left), (right, of_right) = phi.end(-1), phi.end(1)
    before = Logs(-e - np.log(-lam * left), of_e + of_left / -left.real + 4 * _ULP)
    after = Logs(-np.log(lam * right), of_right / right.real + 4 * _ULP)
    inside, outside = Logs(-y, of_y), _total(before, after)
    return _share(inside, outside) if name == "P" else _share(outside, inside)


@np.errstate(all="ignore")
def sides(of: Sampled, lam: Any, r: Any, ends: tuple[Any, Any], rows: Any) -> list[list[Logs]]:
    """y and w, each from the left at ends[0] and from the right at -ends[1]."""
    n, phi, two = len(lam), seen(of, rows, 1.0, True), np.tile(lam, 2)
    found = swept(phi, two, -np.tile(r, 2), np.concatenate(ends), absorbing(two))
    log, error = (x.reshape(3, 2, n) for x in found)
    return [[Logs(log[k, side], error[k, side]) for side in (0, 1)] for k in (0, 1)]


def _total(x: Logs, y: Logs) -> Logs:
    """The sum of positive numbers."""
    of_x, of_y, log = _shares(x.log, y.log)
    return Logs(log, of_x * x.error + of_y * y.error + _ULP * (2 + np.abs(log)))


def _share(x: Logs, rest: Logs) -> Logs:
    """x/(x + rest)."""
    part, other, log = _shares(x.log, rest.log)
    value = np.where(part > 0.5, -np.log1p(np.exp(rest.log - x.log)), x.log - log)
    error = other * (x.error + rest.error + _ULP * (np.abs(x.log) + np.abs(rest.log)))
    return Logs(value, error + _ULP * (1 + np.abs(value)))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Logarithms right to `TOLERANCE`, and their estimated errors; in doubt by balls."""
    logs, errors = found = float_logs(scenes, request.name)
    closer = Request(request.name, "exact", None, 17, log=True, full=False)
    why = ""
    for row in _in_doubt(found):
        try:
            logs[row] = float(of_scene(scene_at(scenes, row), closer).value)
        except AccuracyError as error:
            logs[row], why = np.nan, why or str(error)
        errors[row] = ROUNDING * abs(logs[row]) + 5e-324
    return Answers(logs, errors, "estimate", (request.name,), why=why)


def float_logs(scenes: Scenes, name: str) -> Logs:
    """Logarithms in float64 and their errors, however large these are, in two rounds."""
    numbers = {n: scenes.numbers[n] for n in quantity_of(name).numbers}
    values, count = scenes.parameters, len(scenes.lam)
    found = logs_of(name, of := sampled(scenes.drift, values, count), numbers)
    if of.exact and (some := _in_doubt(found)).size:
        values = {n: x[some] if is_array(x) else x for n, x in values.items()}
        careful = sampled(scenes.drift, values, len(some)).carefully()
        numbers = {n: x[some] for n, x in numbers.items()}
        found.log[some], found.error[some] = logs_of(name, careful, numbers)
    off = seen(of, np.arange(count), 1.0, False).off
    found.error[:] += input_rounding(scenes, off / _OF_A)
    return found


def _in_doubt(found: Logs) -> Any:
    return np.flatnonzero(~(found.error <= TOLERANCE * np.maximum(1.0, np.abs(found.log))))
