"""The canonical integrals of up to two coalescing zeros, and from them the records of panels.

With L = eps lam and p_- = sum (-L)^-k p_k, p_+ = sum L^-k p_k for a panel in canonical form
(`symasym.expansions.coalescence`), its integrals with e^{lam V} and e^{-lam V} reduce to those of
p_+ and p_- with e and 1/e, e' = -L psi e: Airy functions over all s, erfc and Dawson's integral
over half of it, otherwise incomplete Airy functions. One sweep of n' = p_- - L psi n gives them for
any ends. The numbers are midpoints of balls: rounding is not enclosed.
"""

from __future__ import annotations

import math
from functools import reduce
from typing import Any

import numpy as np
from flint import arb, arb_poly, arb_series, ctx

from symasym.exact.panels import slow_solver, slow_terms
from symasym.expansions.coalescence import CanonicalForm
from symasym.expansions.sides import Stretch

# The variation of lam V on a step of the sweep, and the bits that series of e^{lam V} lose there.
_REACH, _MORE = 30.0, 90


def canonical(L: Any, d: int, zeta: Any, lo: Any, hi: Any, nats: float) -> Stretch:
    """The record of [lo, hi] in s for psi and the weights s^j, 0 <= j < d, to e^-nats.

    With e' = -L psi e from 1 and n_i' = s^i - L psi n_i from 0 it has e and n_i (a column) at hi,
    and the integrals of e s^j (a row) and n_i s^j. Intervals are halved until either method
    applies: power series of e^{L int psi}, or the slow solutions n_i.
    """
    found, waiting = [], [(lo, hi)]
    before, ctx.prec = ctx.prec, ctx.prec + _MORE
    while waiting:
        a, b = waiting.pop()
        mid, half = ((a + b) / 2).mid(), ((b - a) / 2).mid()
        shape = [mid * mid - zeta, 2 * mid * half, half * half] if d == 2 else [mid, half]
        g, p = [L * half * c for c in shape], [[half], [half * mid, half * half]][:d]
        sizes = [float(abs(c)) for c in g]
        if sum(c / (k + 1) for k, c in enumerate(sizes)) < _REACH:
            found.append(_moderate(g, p, sizes, nats))
        elif terms := slow_terms(arb_poly([abs(c) for c in g]), nats):
            found.append(_slow(g, p, terms))
        else:
            waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
    ctx.prec = before
    return reduce(Stretch.then, found)


def _moderate(g: list[Any], p: list[list[Any]], sizes: list[float], nats: float) -> Stretch:
    """The record by power series about the middle, to the number of terms that Cauchy's
    estimate requires."""
    sizes = [c / (k + 1) for k, c in enumerate(sizes)]
    counts = [
        (nats + sum(sizes) + sum(c * rho ** (k + 1) for k, c in enumerate(sizes))) / math.log(rho)
        for rho in (1.5, 2.0, 3.0, 4.5, 6.5, 10.0, 16.0, 32.0, 100.0, 1e4)
    ]
    before, ctx.cap = ctx.cap, math.ceil(min(counts)) + 2
    q = arb_series(g).integral()
    down, up, rows, n = (-q).exp(), q.exp(), [arb_series(x) for x in p], []
    low, high = _ends(down.coeffs())
    for row in rows:
        area = (row * up).integral()
        n.append(down * (area - _ends(area.coeffs())[0]))
    B = [_between(row * down) / low for row in rows]
    J = [[_between(row * x) for row in rows] for x in n]
    ctx.cap = before
    return _record(B, [_ends(x.coeffs())[1] for x in n], J, high / low)


def _ends(c: list[Any]) -> tuple[Any, Any]:
    """The values at -1 and 1 of the polynomial with these coefficients."""
    even, odd = sum(c[::2], arb(0)), sum(c[1::2], arb(0))
    return (even - odd).mid(), (even + odd).mid()


def _between(x: Any) -> Any:
    """The integral from -1 to 1 of a polynomial or power series."""
    return sum((c / (k + 0.5) for k, c in enumerate(x.coeffs()[::2])), arb(0)).mid()


def _slow(g: list[Any], p: list[list[Any]], terms: int) -> Stretch:
    """The record where L psi is large, from the slow solutions for both signs."""
    e = (-_between(arb_poly(g))).exp()
    ahead, back = (
        [[c.mid() for c in of(x, arb(0))[0]] for x in p]
        for of in (slow_solver([sign * c for c in g], arb(0), terms) for sign in (-1, 1))
    )
    ends, B = [_ends(t) for t in ahead], [after * e - before for before, after in map(_ends, back)]
    J = [
        [_between(arb_poly(t) * arb_poly(x)) - before * b for x, b in zip(p, B, strict=True)]
        for t, (before, _) in zip(ahead, ends, strict=True)
    ]
    return _record(B, [after - before * e for before, after in ends], J, e)


def _record(B: list[Any], n: list[Any], J: list[list[Any]], e: Any) -> Stretch:
    return Stretch(np.array(B), np.array(n)[:, None], np.array(J), e)


def ways(one: CanonicalForm, lam: Any, nats: float) -> list[Stretch]:
    """The record of the panel at one lam, to the orders 0, 1, ..., N."""
    L, found = one.eps * lam, []
    if one.degree:
        known = canonical(L, one.degree, one.zeta, *one.ends, nats)
    else:
        zero = np.zeros((1, 1), int)
        known = Stretch(zero[0], zero, zero, (-L * (one.ends[1] - one.ends[0])).exp())
    p, c = np.array(one.p)[:, : max(1, one.degree)], np.array(one.c)
    minus = plus = slow = ends = regular = 0
    for k in range(len(one.own)):
        sign, power = (-1) ** k, 1 / L ** (k + 1)
        minus, plus = minus + sign * power * L * p[k], plus + power * L * p[k]
        slow, ends = slow + sign * power * c[k], ends + power * c[k]
        mixed = sum((-1) ** (k - i) * row[k - i] for i, row in enumerate(one.mixed[: k + 1]))
        regular += power * (one.own[k] + mixed)
        scale, (speed,) = known.scale @ plus, minus @ known.speed
        speed += slow[1] - slow[0] * known.climb
        nested = minus @ known.nested @ plus - slow[0] * scale + regular - speed * ends[1]
        scale += ends[0] - known.climb * ends[1]
        found.append(Stretch(scale, speed, nested, known.climb))
    return found
