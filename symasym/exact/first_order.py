"""The matrix of (y, F) across a panel to first order in s.

Its entries are the integrals of a e and b/e and the nested integral of a(u) b(x) e(u)/e(x) over
u < x, by power series about the middle of a moderate panel or by the slow solution of
t' = a + g t. A first pass decides which integrals change a digit; the others are enclosed by
bounds. `transform` gives the same matrix to any order in s, ten times slower.
"""

from __future__ import annotations

import math
from operator import mul
from typing import Any, NamedTuple

from flint import acb_poly, acb_series, arb, arb_series, ctx

from symasym.drift.evaluate import poly
from symasym.exact.panels import ENDS, ONE, Panel, TaylorModel, slow_solver, within

_SHORT = 8  # terms of a polynomial drift up to which recurrence is faster than multiplication
_LOG10 = math.log(10.0)
_NEVER = -math.inf


class Record(NamedTuple):
    """The matrix ((1, y2), (s z1, 1 + s z2)) of (y, F) across a panel, with e = 1 at its left end.

    `y2` is the integral of a e, `z1` and `z2` are lam times that of b/e and the nested integral;
    the s-terms of the first row are not needed. `inverse` is 1/e at the right end.
    """

    y2: Any
    z1: Any
    z2: Any
    inverse: Any


def records(found: list[Panel], lam: Any, eta: Any, digits: int, order: int) -> list[Record]:
    """The panels' records; integrals that change no digit are replaced by their bounds.

    This choice needs no proof, as a wrong one only widens the final ball.
    """
    small = -digits * _LOG10 - 8
    eta = [eta.real.log().mid() if eta.real > 0 else _NEVER]
    for p in found:
        eta.append(_log_sum(eta[-1], p.bounds[0]) + p.rise)
    parts = [(x + p.bounds[1], p.bounds[2]) for x, p in zip(eta, found, strict=False)]
    whole = max([_NEVER, *(x for pair in parts for x in pair)]) - 12
    # `allowed`: the logarithm of a relative error of eta that changes nothing.
    allowed, out = small, []
    for p, before, (first, second) in zip(found[::-1], eta[-2::-1], parts[::-1], strict=True):
        after = _log_sum(before, p.bounds[0])
        wanted = (
            p.bounds[0] - after > allowed - 12,
            order > 0 and first - whole > small,
            order > 0 and second - whole > small,
        )
        out.append(record(p, lam, wanted))
        allowed = min(allowed + after - before, small + whole - first if order else math.inf)
    return out[::-1]


def _log_sum(x: Any, y: Any) -> Any:
    """log(e^x + e^y)."""
    low, top = (x, y) if x < y else (y, x)
    return top if low == _NEVER else top + math.log1p(math.exp(max(float(low - top), -800.0)))


def record(p: Panel, lam: Any, wanted: tuple[bool, bool, bool] = (True, True, True)) -> Record:
    """The panel's record; integrals that are not wanted are enclosed by their bounds."""
    # blur is integrated over [-1, 1], of length 2.
    rise = p.q(ENDS[1]) - p.q(ENDS[0]) + within(2 * p.blur, p.q)
    found: tuple[Any, ...] = (None, None, None)
    if any(wanted):
        found = (_moderate_integrals if p.cauchy else _slow_integrals)(p, rise, wanted)
    y2, z1, z2 = (
        within(arb(bound).exp(), p.q) if x is None else x
        for x, bound in zip(found, p.bounds, strict=True)
    )
    return Record(y2, lam * z1, lam * z2, rise.exp())


def _moderate_integrals(p: Panel, _: Any, wanted: tuple[bool, bool, bool]) -> tuple[Any, ...]:
    """The integrals of a moderate panel, by power series about its middle."""
    (rho, height), (need_e, need_inverse, need_nested) = p.cauchy, wanted
    n, h, kind = p.terms, p.half, acb_series if isinstance(p.q, acb_poly) else arb_series
    ctx.cap = n  # `precision` restores it
    series, low = kind(list(p.q), n), p.q(ENDS[0]).exp()
    # On |t| <= rho, |q| <= height (`panels._moderate`): a e^{-q}, b e^q and b y with
    # y = int_0 a e^{q(t) - q(w)} dw have integrals below rho^2 e^height times the largest weights.
    # Cauchy's estimate bounds the sum of the terms from n on.
    rest = 2 * height.exp() / rho ** (n - 2)
    # blur changes an exponent by at most 2 blur.
    off = [2 * p.blur + x for x in (p.a.relative, p.b.relative, p.a.relative + p.b.relative)]
    missed = [
        within(x.expm1() * arb(bound).exp(), p.q) if x > 0 else 0
        for x, bound in zip(off, p.bounds, strict=True)
    ]

    def weighted(x: Any, w: TaylorModel) -> Any:
        return x if w is ONE else x * kind(list(w.series), n)

    int_e = int_inverse = nested = None
    if need_e or need_nested:
        down = weighted((-series).exp(), p.a).integral()
        begin, end = _at_ends(down, within(rest * p.a.size, p.q))
        int_e = h * (end - begin) * low + missed[0]
    if need_inverse or need_nested:
        up = series.exp()
        first, last = _at_ends(weighted(up, p.b).integral(), within(rest * p.b.size, p.q))
        int_inverse = h * (last - first) / low + missed[1]
    if need_nested:
        # y also solves y' = a + g y, a short recurrence if g is short.
        short = len(p.slope) < _SHORT
        y = kind(_by_equation(p.slope, list(p.a.series), n), n) if short else up * down
        outer = within(rest * p.a.size * p.b.size, p.q)
        below, above = _at_ends(weighted(y, p.b).integral(), outer)
        nested = h * h * (above - below - begin * (last - first)) + missed[2]
    return int_e, int_inverse, nested


def _by_equation(g: list[Any], a: list[Any], n: int) -> list[Any]:
    """The coefficients of the solution of y' = a + g y with y(0) = 0."""
    y, turned, m = [arb(0)], g[::-1], len(g)
    a = [*a, *[arb(0)] * (n - len(a))]
    for k in range(n - 1):
        y.append(sum(map(mul, turned[-k - 1 :], y[max(k + 1 - m, 0) :]), a[k]) / (k + 1))
    return y


def _at_ends(series: Any, rest: Any) -> tuple[Any, Any]:
    """The values at -1 and 1 of a series whose omitted terms sum to less than `rest`."""
    whole = poly(list(series))
    return whole(ENDS[0]) + rest, whole(ENDS[1]) + rest


def _slow_integrals(p: Panel, rise: Any, wanted: tuple[bool, bool, bool]) -> tuple[Any, ...]:
    """The integrals of a slow panel: t' = h a + g t implies (t e)' = h a e; for b/e with -g."""
    need_e, need_inverse, need_nested = wanted
    int_e = int_inverse = nested = None

    def solved(sign: int, source: TaylorModel) -> TaylorModel:
        return slow_solver([sign * c for c in p.slope], p.blur, p.terms)(source.scaled(p.half))

    if need_inverse or need_nested:
        back = solved(-1, p.b)
        int_inverse = back(ENDS[1]) * rise.exp() - back(ENDS[0])
    if need_e or need_nested:
        t = solved(1, p.a)
        start = t(ENDS[0])
        int_e = t(ENDS[1]) * (-rise).exp() - start
        if need_nested:
            # The integral of a e from the left end, divided by e, is t - t(-1)/e.
            nested = p.half * (t * p.b).integral() - start * int_inverse
    return int_e, int_inverse, nested
