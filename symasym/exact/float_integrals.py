"""The integrals over a panel in float64, for many panels at once.

lam phi/sigma^2 times half the width is a Chebyshev series, and so is log sigma where noise depends
on u. A panel is known by e = e^{lam V(b) - lam V(a)} and integrals of the scale density a e and the
speed density b/e: with S the integral of a e from the panel's left end, R that to its right end,
and tau(v), for lam = 1, the mean time in which v leaves the panel,

    I = int a e,  J = int b/e,  N = int S b/e,                                        for T and C;
    K = int S^2 b/e,  M = int R b/e,  X = int R S b/e,
    C0 = int tau b/e,  C1 = int S tau b/e,                                    for E[tau^2] as well.

Three ways to cross [-1, 1]:

- *sampled*: e is known by its values at 20 Gauss nodes, lam V moving by some 20 units, or by 8;
- *slow*: lam |phi| is large on a panel and phi has no zero near, so that with g = lam phi
  t_0 = -a/g, t_{k+1} = t_k'/g has as sum a solution of t' = a + g t, and (t e)' = a e. Likewise
  with -g, and with other sources than a, whose integrals over e are then known;
- *constant*: in closed form, where the exponent is not small.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from flint import arb

ULP = 2.3e-16
OWN = 4e-15  # relative error of a panel's integrals
AT_ONCE = 1024  # columns in the cache
CLIMB = 8.0  # of lam V on a sampled panel: the nested integral loses so much of e^x ulp

_NODES, _TERMS = 20, 40  # of the slow series
_CLOSED = (0.25, 8.0)  # least exponents for closed forms
_WIDTHS = np.array([1, 1, 2, 3, 2, 3, 3, 4])[:, None]  # their powers in I, J, N, K, M, X, C0, C1

_AXES = 2.0 ** np.array([1.25, 2.0, 2.75, 3.5])[:, None]  # sums of the half axes of ellipses
ELLIPSES = np.array([3.0, 4.5, 8.0])[:, None]  # where others end


class Logs(NamedTuple):
    """Natural logarithms of positive numbers, and estimates of their errors; rows come last."""

    log: Any
    error: Any

    def of(self, rows: Any) -> Logs:
        return Logs(self.log.take(rows, axis=-1), self.error.take(rows, axis=-1))

    def put(self, rows: Any, new: Logs) -> None:
        for x, y in zip((*self.log, *self.error), (*new.log, *new.error), strict=True):
            x[rows] = y


def rounding(log: Any) -> Any:
    """Of logarithms that went through a sum."""
    size = np.abs(log)
    return ULP * (2 + np.where(size < np.inf, size, 0.0))


@cache
def matrices(terms: int) -> Any:
    """What acts on Chebyshev coefficients, so many terms, and on values at Gauss's nodes."""
    cheb, leg, nodes = np.polynomial.chebyshev, np.polynomial.legendre, _NODES
    roots = [arb.legendre_p_root(nodes, k, weight=True) for k in reversed(range(nodes))]
    x, weights = np.array([[float(y) for y in root] for root in roots]).T
    to_series = (np.arange(nodes)[:, None] + 0.5) * leg.legvander(x, nodes - 1).T * weights
    until, ends = np.append(x, 1.0), np.append(x, [-1.0, 1.0])
    k = np.arange(terms)
    fit: Any = np.cos(np.pi / 2 * (np.outer(k, 2 * k + 1) % (4 * terms)) / terms) * 2 / terms
    fit[0] /= 2

    def each(act: Any, number: int = terms) -> Any:
        return np.stack([act(row) for row in np.eye(number)], axis=1)

    return SimpleNamespace(
        fit=fit,  # coefficients from values at `points`
        points=np.cos(np.pi * (k + 0.5) / terms),
        values=cheb.chebvander(ends, terms - 1),
        integrals=each(lambda row: cheb.chebval(until, cheb.chebint(row, lbnd=-1))),
        antiderivative=each(lambda row: cheb.chebint(row)[1:]),
        heights=np.cosh((k + 1) * np.log(_AXES)) + 1.0,  # of that on ellipses, and on [-1, 1]
        accuracy=-2 * nodes * np.log(_AXES),  # of Gauss's rule
        sizes=np.cosh(k[1:] * np.arccosh(ELLIPSES)),
        powers=each(lambda row: np.append(cheb.cheb2poly(row), 0 * row)[:terms] / (k + 1)),
        weights=weights,
        running=each(lambda row: leg.legval(until, leg.legint(row, lbnd=-1)), nodes) @ to_series,
        slopes=each(lambda row: leg.legval(ends, leg.legder(row)), nodes) @ to_series,
    )


def times(matrix: Any, x: Any) -> Any:
    # Complex columns are pairs of real ones.
    return (matrix @ x.view(float)).view(x.dtype)


def records(
    half: Any, c: Any, off: Any, strength: Any, powers: Any, loose: float, order: int
) -> Logs:
    """Of panels, e(b) = f/c, the larger 1: f, c, c I, f J, f N, and f c K, c M, c X, f C0, f C1."""
    slope, act = c[0], matrices(c.shape[1])
    falls = times(act.integrals[-1], slope)  # lam (V(a) - V(b))
    found, slow = np.ones((3 if order == 1 else 8, len(falls)), falls.dtype), strength > 0
    for mask, integrals in ((strength == 0, _sampled), (slow, _slow)):
        index = np.flatnonzero(mask)
        index = index[np.argsort(strength[index], kind="stable")]
        for low in range(0, len(index), AT_ONCE):
            at = index[low : low + AT_ONCE]
            weights = (1.0, 1.0)
            if powers:
                log = act.values @ c[1].take(at, axis=1)
                weights = tuple(np.exp(p * log) for p in powers)
            some = slope.take(at, axis=1), falls[at], weights
            found[:, at] = integrals(act, *some, strength[at], order)
    own = 2.0 * off / np.where(slow, np.maximum(np.abs(slope[0]), 1e-300), 1.0)
    own += OWN + loose
    own[strength < 0] = np.inf  # neither kind of panel is known to be right
    steep = falls.real if order == 1 else -np.abs(falls)
    lost = np.where(slow, 0.0, 0.3 * ULP * np.exp(np.minimum(-steep, CLIMB)))
    return _record(found, half, falls, 2.0 * off, own, lost)


def _record(found: Any, unit: Any, falls: Any, moved: Any, own: Any, lost: Any = 0.0) -> Logs:
    """With the smaller of e(b) and 1/e(b), the other being 1."""
    ends = np.stack((np.minimum(-falls, 0.0), np.minimum(falls, 0.0)))
    of_ends = np.where(ends < 0, 1.5 * ULP * np.abs(falls) + moved, 0.0)
    logs = np.log(found) + _WIDTHS[: len(found)] * np.log(unit)
    errors = np.stack((own, own, *[2 * own + lost] * 4, *[3 * own + 2 * lost] * 2)[: len(found)])
    return Logs(np.concatenate((ends, logs)), np.concatenate((of_ends, errors)))


def _sampled(act: Any, slope: Any, falls: Any, weights: Any, _: Any, order: int) -> Any:
    """The integrals for half width 1, from values at the nodes."""
    inverse = times(act.integrals[:-1], slope)
    np.exp(inverse, out=inverse)
    e, (a, b) = 1.0 / inverse, weights
    if np.ndim(a):
        e *= a[:_NODES]
        inverse *= b[:_NODES]
    running = times(act.running, e)
    s, i = running[:-1], running[-1]
    fall, climb = np.exp(np.minimum(-falls, 0.0)), np.exp(np.minimum(falls, 0.0))
    whole, nested = (times(act.weights, x) for x in (inverse, s * inverse))
    found = [i * climb, whole * fall, nested * fall]
    if order == 2:
        r = i - s
        near, far = inverse * s, inverse * r
        of_near, of_far = times(act.running, near), times(act.running, far)
        tau = (r * of_near[:-1] + s * (of_far[-1] - of_far[:-1])) / i
        more = (near * s, far, near * r, inverse * tau, near * tau)
        scales = (fall * climb, climb, climb, fall, fall)
        found += [times(act.weights, x) * y for x, y in zip(more, scales, strict=True)]
    return np.stack(found)


def _slow(act: Any, slope: Any, falls: Any, weights: Any, strength: Any, order: int) -> Any:
    """The same by slow series, the weakest panels first, turned so that e grows on them."""
    g, small = times(act.values, slope), np.exp(-np.maximum(falls, -falls))
    g, (a, b) = np.where(falls > 0, -_turned(g), g), weights
    if np.ndim(a):
        a, b = (np.where(falls > 0, _turned(x), x) for x in weights)
    # k terms are enough where k!/strength^k < e^{-38}.
    j = np.arange(1.0, _TERMS + 1)
    enough = np.maximum.accumulate(-np.exp((np.cumsum(np.log(j)) + 38.0) / j))
    needed = np.searchsorted(enough, -strength)
    inverse = np.negative(1.0 / g)

    def solved(source: Any, slope: Any = None) -> tuple[Any, Any]:
        """Slow solutions of t' = source + g t and of -t' = source + g t; `slope` of a source
        that vanishes at an end."""
        term = source * inverse
        even, odd = term.copy(), np.zeros_like(term)
        for k in range(1, _TERMS + 1):
            n = np.searchsorted(-needed, -k, side="right")
            if not n:
                break
            if k == 1 and slope is not None:
                term = slope * inverse + source * times(act.slopes, inverse[:_NODES])
            else:
                term = times(act.slopes, term[:_NODES, :n])
            term = term[:, :n] * -inverse[:, :n]
            (odd if k % 2 else even)[:, :n] += term
        return even + odd, even - odd

    t, back = solved(a)
    if np.ndim(a) and (a is not b):
        back = solved(b)[1]
    t_a, t_b = t[_NODES:]
    i, j = t_b - t_a * small, back[_NODES] - back[_NODES + 1] * small
    whole = times(act.weights, (b * t)[:_NODES])
    nested, mirrored = whole - t_a * j, t_b * j - whole * small
    found: list[Any] = [i, j, nested, mirrored]
    if order == 2:
        q_a, q_b = solved(b * t * t)[0][_NODES:]
        square = q_b - small * (q_a + t_a * (2.0 * whole - t_a * j))
        cross = t_b * nested - q_b + small * (t_a * whole + q_a)
        r = times(act.running, (a * back)[:_NODES])
        r = np.concatenate((r[:-1], 0.0 * r[-1:], r[-1:]))
        r_b = r[-1] / i
        steep = b * a * back + (times(act.slopes, b[:_NODES]) * r if np.ndim(b) else 0.0)
        slow = solved(b * r, steep)[1]
        first = slow[_NODES] - slow[_NODES + 1] * small
        second = times(act.weights, (b * t * r)[:_NODES]) - t_a * first - r_b * square
        found += [square, cross, first - r_b * nested * small, second]
    return _oriented(found, small, falls > 0)


def _turned(x: Any) -> Any:
    """Values at the nodes and both ends, from right to left."""
    return np.concatenate((x[_NODES - 1 :: -1], x[: _NODES - 1 : -1]))


def _oriented(found: list[Any], small: Any, down: Any) -> Any:
    """I, J, N and the others from I, J, N, M, K, X, C0, C1 of panels some of which were turned."""
    i, j, nested, mirrored, *more = found
    ways = [i, j, np.where(down, mirrored, nested)]
    if more:
        square, cross, first, second = more
        ways += [
            np.where(down, i * mirrored - small * cross, square),
            np.where(down, nested, mirrored),
            cross,
            first,
            np.where(down, i * first - small * second, second),
        ]
    return np.stack(ways)


def constant(rate: Any, width: Any, off: Any, order: int) -> Logs:
    """The record of an interval of any width on which lam phi is `rate`, for a = b = 1."""
    x = np.maximum(rate * width, -rate * width)
    small, i, unit = np.exp(-x), -np.expm1(-x), width / x
    nested, whole = x - i, i - x * small
    found = [i, i, nested, whole]
    if order == 2:
        square = i * (1.0 + small) - 2.0 * x * small
        first, second = whole - x * nested * small / i, x * x / 2 - whole - x * square / i
        found += [square, i * nested - square, first, second]
    known = _oriented(found, small, rate.real > 0)
    at = np.flatnonzero(x.real < _CLOSED[order - 1])
    for low in range(0, len(at), AT_ONCE):
        some = at[low : low + AT_ONCE]
        y = (rate * width)[some]
        known[:, some] = _sampled(matrices(1), y[None] / 2, y, (1.0, 1.0), None, order)
    unit[at] = width[at] / 2
    own = OWN + 2 * off / np.maximum(x.real, 1.0)
    return _record(known, unit, rate * width, off + 2 * ULP * x.real, own)
