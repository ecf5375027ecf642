"""Panels in float64, for many rows at once: where they are.

Pieces are halved until they are sampled or slow panels (`float_integrals`). What a panel misses is
below 1e-16 by bounds on ellipses about it; one that passed no such test has error infinity.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from symasym.drift.models import Expression
from symasym.drift.sampled import Field, Sampled
from symasym.exact.float_integrals import (
    AT_ONCE,
    CLIMB,
    ELLIPSES,
    ULP,
    Logs,
    matrices,
    records,
    times,
)

OF_A = 0.37 * ULP  # rounding of A, for each of its terms
_MISSED = np.log(1e-16)
_LONG = float(np.finfo(np.longdouble).eps / np.finfo(float).eps)
_DEEPEST = 38  # halvings
_FEW, _PANELS = 8, 2000  # terms of A, panels of a row
_UNITS, _MOST = (20.0, 14.0), 24  # exponent on pieces that a row begins with, and their number
_SLOW = 44.0  # the slow series is right to e^{-44}
_STRENGTH = (ELLIPSES - 1.0) ** 2 / (2 * ELLIPSES)


class Side(NamedTuple):
    """`sign` phi(u) of rows by one formula, where `mirror` is -1 the image -`sign` phi(-u)."""

    field: Field
    of: Sampled
    rows: Any
    mirror: Any
    sign: float
    off: Any  # the error of phi
    loose: float  # the error of powers of sigma
    edges: Any  # between them all is held by its Chebyshev terms

    @property
    def powers(self) -> tuple[float, float] | None:
        """Of sigma in a and b."""
        powers = self.field.powers
        return powers if self.sign > 0 or powers is None else powers[::-1]

    def end(self, side: int) -> tuple[Any, Any, Any]:
        """phi/sigma^2 beside the layer, its error, and log sigma there."""
        at = side * self.mirror
        left, right = (x[self.rows] for x in self.field.ends)
        a = self.sign * self.mirror * np.where(at < 0, left, right)
        off = ULP * np.abs(a) + _LONG * self.off if self.of.long else self.off
        return a, off, self.of.log_noise(at[None], self.rows)[0]

    def series(self, some: Any, lam: Any, left: Any, half: Any) -> Any:
        """Chebyshev coefficients of lam phi times `half`, and of log sigma, on panels."""
        act, m, rows = matrices(self.of.terms), self.mirror[some], self.rows[some]
        u = m * ((left + half) + half * act.points[:, None])
        slope = act.fit @ self.of(u, rows) * (self.sign * m * lam * half)
        if self.powers is None:
            return slope[None]
        return np.stack((slope, act.fit @ self.of.log_noise(u, rows)))


def seen(
    field: Field, rows: Any, far: Any = 1.0, sign: float = 1.0, both: bool = False
) -> list[Side]:
    """The formulas of a drift in these rows as far as |u| = `far`, and behind them, where asked,
    in their mirror images."""
    mirror, found = np.repeat([1.0, -1.0] if both else [1.0], len(rows)), []
    for of in field.parts:
        act, (low, high) = matrices(of.terms), of.span
        u = (low + high) / 2 + (high - low) / 2 * act.points[:, None]
        c = act.fit @ of(u + np.zeros(len(rows)), rows)
        size = np.abs(c).sum(axis=0)
        if of.exact and field.layered:  # a polynomial's terms may be much larger than their sum
            size = np.maximum(size, np.abs(act.powers @ c).sum(axis=0))
        elif of.exact:
            size = of.majorant(np.minimum(far, max(abs(low), abs(high))), rows)
        off, loose, edges = OF_A * of.terms * size, 0.0, np.array([-np.inf, np.inf])
        if not of.exact:
            rounding, loose = of.rounding
            off = max(OF_A * _FEW, rounding) * size
            # Where rows differ, cuts prove nothing: ready-made drifts are judged by last terms.
            judged = not of.varied or not (
                field.powers or not field.layered or isinstance(of.model, Expression)
            )
            if of.cuts is None or not judged:
                off = off + np.inf
            else:
                every = np.array([low, *of.cuts, high])
                edges = np.unique([*every, *-every])
        loose = 4 * (loose + 2 * ULP) if field.powers else 0.0
        tiled = np.tile(rows, 1 + both), mirror, sign, np.tile(off, 1 + both)
        found.append(Side(field, of, *tiled, loose, edges))
    return found


def panels(
    phi: Side, rows: Any, lam: Any, low: Any, high: Any, order: int
) -> tuple[Logs, Any, Any]:
    """Records of each row's first panel, of the second, ...; rows by number; how many have each."""
    act, n = matrices(phi.of.terms), len(rows)
    # Pieces between edges, halved until they suffice.
    ends = np.clip(phi.edges[:, None], low, high)
    piece, row = np.nonzero(np.diff(ends, axis=0) > 0.0)
    left, half = ends[piece, row], (ends[piece + 1, row] - ends[piece, row]) / 2
    c = phi.series(rows[row], lam[row], left, half)
    # Where few are needed they are made at once; where many are, some may be slow.
    units = np.abs(c[0]).sum(axis=0) * (2 / _UNITS[order - 1]) + 1e-9
    few = np.bincount(row, units, n)[row] < _MOST
    count = np.where(few, np.ceil(units), 1.0).astype(int)
    step = np.arange(count.sum()) - np.repeat(np.cumsum(count) - count, count)
    row, left, half = (np.repeat(x, count) for x in (row, left, half / count))
    left = left + 2 * half * step
    kept = []
    for level in range(_DEEPEST + 1):
        c = phi.series(rows[row], lam[row], left, half)
        strength = _tested(act, c, phi.powers, order)
        done = (strength >= 0.0) | ~(np.abs(c[0, 0]) < np.inf) | (level == _DEEPEST)
        done |= np.bincount(row[~done], minlength=n)[row] > _PANELS
        at = np.flatnonzero(done)
        kept.append([x.take(at, axis=-1) for x in (row, left, half, strength, c)])
        row, left, half = (x[~done] for x in (row, left, half / 2))
        if not row.size:
            break
        row, left, half = np.tile(row, 2), np.append(left, left + 2 * half), np.tile(half, 2)
    parts = [np.concatenate(x, axis=-1) for x in zip(*kept, strict=True)]
    row, left = parts[:2]
    number = np.bincount(row, minlength=n)
    by_number = np.argsort(-number, kind="stable")
    widths = np.searchsorted(-number[by_number], -np.arange(number.max(initial=0)), side="left")
    by_row = np.lexsort((left, row))
    rank = np.arange(len(row)) - np.repeat(np.cumsum(number) - number, number)
    where = by_row[np.lexsort((np.argsort(by_number)[row[by_row]], rank))]
    row, left, half, strength, c = (x.take(where, axis=-1) for x in parts)
    off, size = np.abs(lam[row]) * half * phi.off[rows[row]], np.abs(c[0])
    if not phi.of.exact:  # the last terms tell what is missing, noise included
        off += 2 * size[-2:].max(axis=0)
    if phi.of.long:  # what is left of rounding is relative to A here
        far = np.maximum(1.0, np.abs(left) + 2 * half)
        off = _LONG * off + OF_A * phi.of.terms * size.sum(axis=0)
        off += ULP * far / half * size[1:].sum(axis=0)
    return records(half, c, off, strength, phi.powers, phi.loose, order), by_number, widths


def _tested(act: Any, c: Any, powers: Any, order: int) -> Any:
    """0 where sampling suffices, the strength of the slow series where that does, else -1."""
    slope, weight = c[0], np.zeros((1, c.shape[-1]))
    if len(slope) > _FEW:  # high terms that are rounding alone
        slope = np.where(np.abs(slope) < 4e-15 * np.abs(slope).sum(axis=0), 0.0, slope)
    if powers:
        weight = max(map(abs, powers)) * np.abs(c[1, 1:])
    # e^{lam (V(x) - V(u))} on ellipses, beside the error of Gauss's rule on them.
    heights = act.heights @ np.abs(times(act.antiderivative, slope))
    heights += act.heights[:, : len(weight)] @ weight
    rise = times(act.integrals[-1], slope).real
    fits = ((order * heights + act.accuracy).min(axis=0) < _MISSED) & (rise > -CLIMB)
    if order == 2:
        fits &= rise < CLIMB
    # Where |phi| is between 0 and twice its mean on an ellipse, the slow series is known.
    found, size = np.where(fits, 0.0, -1.0), np.abs(slope)
    at = np.flatnonzero(~fits & (size[0] > _SLOW / _STRENGTH[-1, 0]) & (size[0] < np.inf))
    size = size.take(at, axis=1)
    free = act.sizes @ size[1:] < size[0]
    strength = size[0] * (free * _STRENGTH).max(axis=0)
    if powers:
        strength -= act.sizes[0] @ weight.take(at, axis=1)
    found[at] = np.where(free[0] & (strength > _SLOW), strength, -1.0)
    return found
