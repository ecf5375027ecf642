"""Panels in float64, for many rows at once: their subdivision, and the integrals over them.

lam phi/sigma^2 times half the width is a Chebyshev series, and so is log sigma if the noise sigma
depends on u. With e = e^{lam V}, 1 at the panel's left end, the scale density is a e and the speed
density lam b/e. Let S(v) be the integral of a e from the left end to v, R(v) that from v to the
right end, and theta(v), for lam = 1, the mean exit time from the panel. A panel's integrals are

    I = int a e,    m_jk = int R^j S^k b/e,    t_k = int theta S^k b/e:

I, m00 and m01 for T and C, and m02, m10, m11, t0 and t1 for E[tau^2] as well. There are two ways to
evaluate them; pieces are halved until one of them applies:

- *sampled*: e by its values at 20 Gauss nodes, where lam V climbs by at most 8 and varies little;
- *slow*: if phi has no zero near and lam |phi| is large, with g = lam phi the asymptotic series
  x_0 = -a/g, x_{k+1} = x_k'/g sums to a solution of x' = a + g x, for which (x e)' = a e; likewise
  for -g, and for other sources than a. If g is constant, as outside a layer, one term is exact.

Truncation errors are below 1e-16 by bounds on ellipses; a panel without a bound has error infinity.
"""

from __future__ import annotations

from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from symasym.drift.sampled import FloatDrift
from symasym.exact.logs import ULP, Logs

OF_A = 0.37 * ULP  # relative rounding error of A, for each of its terms
_ERROR = 4e-15  # relative error of a panel's integrals
_LONG = float(np.finfo(np.longdouble).eps / np.finfo(float).eps)
_MISSED = np.log(1e-16)
_AT_ONCE = 1024  # columns that fit in the cache
# The largest climb x of lam V on a sampled panel, by order: it costs the nested integrals e^x ulp.
_CLIMB = {1: 8.0, 2: 6.0}
_DEEPEST, _PANELS = 38, 2000  # numbers of halvings, and of a row's panels
_FEW = 8  # terms of A that are all significant
_NODES, _TERMS, _SLOW = 20, 40, 44.0  # nodes; terms of the slow series; its accuracy e^{-44}
# Powers of the width in I, m00, m01, m02, m10, m11, t0, t1.
_WIDTHS = np.array([1, 1, 2, 3, 2, 3, 3, 4])[:, None]
_AXES = 2.0 ** np.array([1.25, 2.0, 2.75, 3.5])[:, None]  # sums of half axes of ellipses
_ELLIPSES = np.array([3.0, 4.5, 8.0])[:, None]  # right ends of others
_STRENGTH = (_ELLIPSES - 1.0) ** 2 / (2 * _ELLIPSES)


@cache
def matrices(terms: int) -> Any:
    """Matrices acting on so many Chebyshev coefficients, and on values at Gauss nodes."""
    cheb, leg, nodes = np.polynomial.chebyshev, np.polynomial.legendre, _NODES
    roots = [arb.legendre_p_root(nodes, k, weight=True) for k in reversed(range(nodes))]
    x, weights = np.array([[float(y) for y in root] for root in roots]).T
    to_series = (np.arange(nodes)[:, None] + 0.5) * leg.legvander(x, nodes - 1).T * weights
    until, ends = np.append(x, 1.0), np.append(x, [-1.0, 1.0])
    k = np.arange(terms)
    fit: Any = np.cos(np.pi / 2 * (np.outer(k, 2 * k + 1) % (4 * terms)) / terms) * 2 / terms
    fit[0] /= 2
    lines: Any = [cheb.Chebyshev([side / 2, 0.5]) for side in (-1, 1)]  # exact to degree 25 or so

    def halved(row: Any, line: Any) -> Any:
        return np.append(cheb.Chebyshev(row)(line).coef / 2, 0 * row)[:terms]

    def each(act: Any, number: int = terms) -> Any:
        return np.stack([act(row) for row in np.eye(number)], axis=1)

    return SimpleNamespace(
        fit=fit,  # coefficients from values at `points`
        points=np.cos(np.pi * (k + 0.5) / terms),
        values=cheb.chebvander(ends, terms - 1),
        integrals=each(lambda row: cheb.chebval(until, cheb.chebint(row, lbnd=-1))),
        halves=[each(lambda row, line=line: halved(row, line)) for line in lines],
        antiderivative=each(lambda row: cheb.chebint(row)[1:]),
        heights=np.cosh((k + 1) * np.log(_AXES)) + 1.0,  # its size on ellipses and on [-1, 1]
        accuracy=-2 * nodes * np.log(_AXES),  # the error of Gauss's rule
        sizes=np.cosh(k[1:] * np.arccosh(_ELLIPSES)),
        weights=weights,
        running=each(lambda row: leg.legval(until, leg.legint(row, lbnd=-1)), nodes) @ to_series,
        slopes=each(lambda row: leg.legval(ends, leg.legder(row)), nodes) @ to_series,
    )


def times(matrix: Any, x: Any) -> Any:
    # Complex columns are pairs of real ones.
    return (matrix @ x.view(float)).view(x.dtype)


class _Outside:
    """The drift and the noise outside a layer, where they are constant."""

    terms, exact, long = 1, True, False

    def __init__(self, field: FloatDrift) -> None:
        self.ends, self.inside = field.ends, field.parts[0]

    def __call__(self, u: Any, rows: Any) -> Any:
        left, right = (x[rows] for x in self.ends)
        return np.where(u < 0, left, right)

    def log_noise(self, u: Any, rows: Any) -> Any:
        return self.inside.log_noise(np.sign(u), rows)


class SampledDrift(NamedTuple):
    """`sign` phi(u) of rows by one formula, or -`sign` phi(-u) where `mirror` is -1."""

    field: FloatDrift
    of: Any  # Sampled or _Outside
    rows: Any
    mirror: Any
    sign: float
    blur: Any  # the error of phi
    loose: float  # the error of powers of sigma
    edges: Any  # between these the Chebyshev terms suffice

    @property
    def powers(self) -> tuple[float, float] | None:
        """The powers of sigma in a and b."""
        powers = self.field.powers
        return powers if self.sign > 0 or powers is None else powers[::-1]

    def end(self, side: int) -> tuple[Any, Any, Any]:
        """phi/sigma^2 outside the layer, its error, and log sigma."""
        at = side * self.mirror
        left, right = (x[self.rows] for x in self.field.ends)
        a = self.sign * self.mirror * np.where(at < 0, left, right)
        blur = ULP * np.abs(a) + _LONG * self.blur if self.of.long else self.blur
        return a, blur, self.of.log_noise(at[None], self.rows)[0]

    def outside(self, side: int) -> SampledDrift:
        """The same on one side of the layer."""
        edges = np.array([-np.inf, np.inf])
        return self._replace(of=_Outside(self.field), blur=self.end(side)[1], edges=edges)

    def series(self, some: Any, lam: Any, left: Any, half: Any) -> Any:
        """Chebyshev coefficients of lam phi times `half`, and of log sigma, on panels."""
        act, m, rows = matrices(self.of.terms), self.mirror[some], self.rows[some]
        u = m * ((left + half) + half * act.points[:, None])
        slope = times(act.fit, self.of(u, rows)) * (self.sign * m * lam * half)
        if self.powers is None:
            return slope[None]
        return np.stack((slope, act.fit @ self.of.log_noise(u, rows)))


def in_rows(
    field: FloatDrift, rows: Any, far: Any = 1.0, sign: float = 1.0, both: bool = False
) -> list[SampledDrift]:
    """The drift's formulas in these rows up to |u| = `far`; if `both`, mirror images follow."""
    mirror, found = np.repeat([1.0, -1.0] if both else [1.0], len(rows)), []
    for of in field.parts:
        (low, high), edges, loose = of.span, np.array([-np.inf, np.inf]), 0.0
        if of.exact:
            blur = OF_A * of.terms * of.majorant(np.minimum(far, max(abs(low), abs(high))), rows)
        else:
            rounding, loose = of.rounding
            act, middle, half = matrices(of.terms), (low + high) / 2, (high - low) / 2
            c = act.fit @ of(middle + half * act.points[:, None] + np.zeros(len(rows)), rows)
            blur = (max(OF_A * _FEW, rounding) + 2 * ULP) * np.abs(c).sum(axis=0)
            # Cuts hold for one row; ready-made drifts in many rows are judged by their last terms.
            each = field.powers or not field.layered or not field.ready_made
            varied = any(np.ptp(np.real(x)) > 0 for x in of.arrays.values())
            if of.cuts is None or (varied and each):
                blur += np.inf
            else:
                edges = np.unique([side * x for x in (low, *of.cuts, high) for side in (-1, 1)])
        loose = 4 * (loose + 2 * ULP) if field.powers else 0.0
        tiled = np.tile(rows, 1 + both), mirror, sign, np.tile(blur, 1 + both)
        found.append(SampledDrift(field, of, *tiled, loose, edges))
    return found


def panels(
    phi: SampledDrift, rows: Any, lam: Any, low: Any, high: Any, order: int
) -> tuple[Logs, Any, Any]:
    """Records of the first panels of all rows, then of the second ones, ...; their rows; and where
    each of these groups ends."""
    row, left, half, strength, c = _subdivided(phi, rows, lam, low, high, order)
    where = np.lexsort((left, row))
    rank = np.arange(len(row)) - np.searchsorted(row[where], row[where])
    where = where[np.argsort(rank, kind="stable")]
    row, left, half, strength, c = (x.take(where, axis=-1) for x in (row, left, half, strength, c))
    blur, size = np.abs(lam[row]) * half * phi.blur[rows[row]], np.abs(c[0])
    if not phi.of.exact:  # The last terms estimate what is missing, noise included.
        blur += 2 * size[-2:].max(axis=0)
    if phi.of.long:  # The remaining rounding is relative to A on the panel.
        far = np.maximum(1.0, np.abs(left) + 2 * half)
        blur = _LONG * blur + OF_A * phi.of.terms * size.sum(axis=0)
        blur += ULP * far / half * size[1:].sum(axis=0)
    found = records(half, c, blur, strength, phi.powers, phi.loose, order)
    return found, row, np.cumsum(np.bincount(rank))


def _subdivided(
    phi: SampledDrift, rows: Any, lam: Any, low: Any, high: Any, order: int
) -> tuple[Any, ...]:
    """Rows, left ends, half widths, strengths and coefficients of the panels, in any order."""
    act, n, kept = matrices(phi.of.terms), len(rows), list[Any]()
    ends = np.clip(phi.edges[:, None], low, high)
    piece, row = np.nonzero(np.diff(ends, axis=0) > 0.0)
    left, half = ends[piece, row], (ends[piece + 1, row] - ends[piece, row]) / 2
    c: Any = None
    for level in range(_DEEPEST + 1):
        if level == 0 or phi.of.exact:
            c = phi.series(rows[row], lam[row], left, half)
        else:
            c = np.concatenate([times(m, c) for m in act.halves], axis=-1)
            c[1:] *= 2.0  # The slope alone has the width as a factor.
        blocks = (c[..., i : i + _AT_ONCE] for i in range(0, len(row), _AT_ONCE))
        strength = np.concatenate([_tested(act, x, phi.powers, order) for x in blocks])
        done = (strength >= 0.0) | ~(np.abs(c[0, 0]) < np.inf) | (level == _DEEPEST)
        done |= np.bincount(row[~done], minlength=n)[row] > _PANELS
        kept.append([x.compress(done, axis=-1) for x in (row, left, half, strength, c)])
        rest: Any = (x.compress(~done, axis=-1) for x in (row, left, half / 2, c))
        row, left, half, c = rest
        if not row.size:
            break
        row, left, half = np.tile(row, 2), np.append(left, left + 2 * half), np.tile(half, 2)
    return tuple(np.concatenate(x, axis=-1) for x in zip(*kept, strict=True))


def _tested(act: Any, c: Any, powers: Any, order: int) -> Any:
    """0 where sampling suffices, the strength of the slow series where this suffices, else -1."""
    slope, weight = c[0], np.zeros((1, c.shape[-1]))
    if len(slope) > _FEW:  # High terms may be rounding alone.
        slope = np.where(np.abs(slope) < 4e-15 * np.abs(slope).sum(axis=0), 0.0, slope)
    if powers:
        weight = max(map(abs, powers)) * np.abs(c[1, 1:])
    # The size of e^{lam (V(x) - V(u))} on ellipses, times the error of Gauss's rule on them.
    heights = act.heights @ np.abs(times(act.antiderivative, slope))
    heights += act.heights[:, : len(weight)] @ weight
    rise = times(act.integrals[-1], slope).real
    fits = ((order * heights + act.accuracy).min(axis=0) < _MISSED) & (rise > -_CLIMB[order])
    fits &= (order == 1) | (rise < _CLIMB[order])
    # If phi has no zero in an ellipse, |phi| there bounds the terms of the slow series.
    found, size = np.where(fits, 0.0, -1.0), np.abs(slope)
    at = np.flatnonzero(~fits & (size[0] > _SLOW / _STRENGTH[-1, 0]) & (size[0] < np.inf))
    size = size.take(at, axis=1)
    free = act.sizes @ size[1:] < size[0]
    strength = size[0] * (free * _STRENGTH).max(axis=0)
    if order == 1 and len(size) == 1:
        strength[:] = np.inf  # Where g is constant, one term is exact.
    if powers:
        strength -= act.sizes[0] @ weight.take(at, axis=1)
    # For E[tau^2] high powers of 1/phi are differentiated, which takes a larger ellipse.
    found[at] = np.where(free[order - 1] & (strength > _SLOW), strength, -1.0)
    return found


def records(
    half: Any, c: Any, blur: Any, strength: Any, powers: Any, loose: float, order: int
) -> Logs:
    """Logarithms of f, c, c I, f m00, f m01, f c m02, c m10, c m11, f t0, f t1; e(right) = f/c."""
    slope, act = c[0], matrices(c.shape[1])
    falls = times(act.integrals[-1], slope)  # lam (V(a) - V(b))
    found, slow = np.ones((3 if order == 1 else 8, len(falls)), falls.dtype), strength > 0
    for mask, integrals in ((strength == 0, _sampled_record), (slow, _slow_record)):
        index = np.flatnonzero(mask)
        index = index[np.argsort(strength[index], kind="stable")]
        for low in range(0, len(index), _AT_ONCE):
            at = index[low : low + _AT_ONCE]
            log = act.values @ c[1].take(at, axis=1) if powers else 0.0
            weights = tuple(np.exp(p * log) for p in powers or (0, 0))
            some = slope.take(at, axis=1), falls[at], weights
            found[:, at] = integrals(act, *some, strength[at], order)
    error = 2.0 * blur / np.where(slow, np.maximum(np.abs(slope[0]), 1e-300), 1.0)
    error += _ERROR + loose
    error[strength < 0] = np.inf  # no accepted panel
    steep = falls.real if order == 1 else -np.abs(falls)
    lost = np.where(slow, 0.0, 0.3 * ULP * np.exp(np.minimum(-steep, _CLIMB[order])))
    return _in_logs(found, half, falls, 2.0 * blur, error, lost)


def _in_logs(found: Any, unit: Any, falls: Any, moved: Any, error: Any, lost: Any = 0.0) -> Logs:
    """The record with the width as a factor, and its errors."""
    ends = np.stack((np.minimum(-falls, 0.0), np.minimum(falls, 0.0)))
    of_ends = np.where(ends < 0, 1.5 * ULP * np.abs(falls) + moved, 0.0)
    logs = np.log(found) + _WIDTHS[: len(found)] * np.log(unit)
    several = (2 * error + k * lost for k in (1, 1, 2, 2))
    each = error, error, *several, *[3 * error + 10 * lost] * 2
    errors = np.stack(each[: len(found)])
    return Logs(np.concatenate((ends, logs)), np.concatenate((of_ends, errors)))


def _sampled_record(act: Any, slope: Any, falls: Any, weights: Any, _: Any, order: int) -> Any:
    """The record for half width 1, from values at the nodes."""
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


def _slow_solver(act: Any, inverse: Any, strength: Any) -> Any:
    """The slow solutions of x' = source + g x and -x' = source + g x, given -1/g and its strength,
    as a function of the source and, if this vanishes at an end, of its derivative. The solution
    then begins there with the second term, so that it takes one more."""
    # k terms suffice where k!/strength^k < e^{-38}.
    j = np.arange(1.0, _TERMS + 1)
    enough = np.maximum.accumulate(-np.exp((np.cumsum(np.log(j)) + 38.0) / j))
    needed = np.searchsorted(enough, -strength)

    def solved(source: Any, slope: Any = None) -> tuple[Any, Any]:
        term = source * inverse
        even, odd = term.copy(), np.zeros_like(term)
        for k in range(1, _TERMS + 1):
            n = np.searchsorted(-needed, -k + (slope is not None), side="right")
            if not n:
                break
            if k == 1 and slope is not None:
                term = slope * inverse + source * times(act.slopes, inverse[:_NODES])
            else:
                term = times(act.slopes, term[:_NODES, :n])
            term = term[:, :n] * -inverse[:, :n]
            (odd if k % 2 else even)[:, :n] += term
        return even + odd, even - odd

    return solved


def _slow_record(act: Any, slope: Any, falls: Any, weights: Any, strength: Any, order: int) -> Any:
    """The record for half width 1 by slow series, of columns with increasing strength.

    Panels on which e decreases are turned, so that it increases on all of them.
    """
    g, small = times(act.values, slope), np.exp(-np.maximum(falls, -falls))
    g, (a, b) = np.where(falls > 0, -_turned(g), g), weights
    if np.ndim(a):
        a, b = (np.where(falls > 0, _turned(x), x) for x in weights)
    solved = _slow_solver(act, np.negative(1.0 / g), strength)
    x, back = solved(a)
    if np.ndim(a) and (a is not b):
        back = solved(b)[1]
    x_a, x_b = x[_NODES:]
    i, m00 = x_b - x_a * small, back[_NODES] - back[_NODES + 1] * small
    whole = times(act.weights, (b * x)[:_NODES])
    m01, mirrored = whole - x_a * m00, x_b * m00 - whole * small
    found: list[Any] = [i, m00, m01, mirrored]
    if order == 2:
        q_a, q_b = solved(b * x * x)[0][_NODES:]
        m02 = q_b - small * (q_a + x_a * (2.0 * whole - x_a * m00))
        m11 = x_b * m01 - q_b + small * (x_a * whole + q_a)
        r = times(act.running, (a * back)[:_NODES])
        r = np.concatenate((r[:-1], 0.0 * r[-1:], r[-1:]))
        r_b = r[-1] / i
        steep = b * a * back + (times(act.slopes, b[:_NODES]) * r if np.ndim(b) else 0.0)
        slow = solved(b * r, steep)[1]
        t0 = slow[_NODES] - slow[_NODES + 1] * small
        t1 = times(act.weights, (b * x * r)[:_NODES]) - x_a * t0 - r_b * m02
        found += [m02, m11, t0 - r_b * m01 * small, t1]
    return _oriented(found, small, falls > 0)


def _turned(x: Any) -> Any:
    """Values at the nodes and both ends, in reverse order."""
    return np.concatenate((x[_NODES - 1 :: -1], x[: _NODES - 1 : -1]))


def _oriented(found: list[Any], small: Any, down: Any) -> Any:
    """The record from I, m00, m01, m10, m02, m11, t0, t1 of panels, turned where `down`."""
    i, m00, m01, m10, *second = found
    ways = [i, m00, np.where(down, m10, m01)]
    if second:
        m02, m11, t0, t1 = second
        ways += [
            np.where(down, i * m10 - small * m11, m02),
            np.where(down, m01, m10),
            m11,
            t0,
            np.where(down, i * t0 - small * t1, t1),
        ]
    return np.stack(ways)
