"""The canonical integrals of one, two or no coalescing zeros, and T, C and P's way through a panel.

With L = eps lam and the weights P = sum (-L)^-k P_k and Q = sum L^-k P_k of a panel in canonical
form (`symasym.expansions.coalescence`), its integrals with e^{lam V} and e^{-lam V} are those of
e' = -L psi e: over all s Airy functions, over half of it erfc and Dawson's integral, else
incomplete Airy functions. One sweep of n' = P - L psi n gives them, whatever the ends. Numbers are
midpoints of balls: rounding is not enclosed.
"""

from __future__ import annotations

import math
from functools import reduce
from operator import mul
from typing import Any, NamedTuple

from flint import arb, arb_poly, arb_series, ctx

from symasym.exact.panels import slow_solver, slow_terms
from symasym.expansions.coalescence import Panel

# How far lam V varies on a panel of the sweep.
_REACH = 30.0
# Bits that series of e^{lam V} lose there.
_MORE = 90


class Canonical(NamedTuple):
    """Over a stretch of s, with e' = -L psi e from 1 and n_i' = s^i - L psi n_i from 0: e and n_i
    at its end, and the integrals of e s^j and of n_i s^j."""

    e: Any
    n: list[Any]
    B: list[Any]
    J: list[list[Any]]

    def then(self, other: Canonical) -> Canonical:
        """This stretch and the next."""
        J = [
            [x + y + n * b for x, y, b in zip(p, q, other.B, strict=True)]
            for p, q, n in zip(self.J, other.J, self.n, strict=True)
        ]
        n = [x * other.e + y for x, y in zip(self.n, other.n, strict=True)]
        B = [x + self.e * y for x, y in zip(self.B, other.B, strict=True)]
        return Canonical(self.e * other.e, n, B, J)


def canonical(L: Any, d: int, zeta: Any, lo: Any, hi: Any, nats: float) -> Canonical:
    """The canonical integrals from lo to hi, to e^-nats, by panels halved until one of two ways
    takes them: power series of e^{L int psi}, or the slow solution of n' = P - L psi n."""
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
    return reduce(Canonical.then, found)


def _moderate(g: list[Any], p: list[list[Any]], sizes: list[float], nats: float) -> Canonical:
    """The integrals of a panel by power series about its middle, as many terms as Cauchy's
    estimate takes."""
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
    return Canonical(high / low, [_ends(x.coeffs())[1] for x in n], B, J)


def _ends(c: list[Any]) -> tuple[Any, Any]:
    """A polynomial of these coefficients at -1 and 1."""
    even, odd = sum(c[::2], arb(0)), sum(c[1::2], arb(0))
    return (even - odd).mid(), (even + odd).mid()


def _between(x: Any) -> Any:
    """The integral of a polynomial or power series from -1 to 1."""
    return sum((c / (k + 0.5) for k, c in enumerate(x.coeffs()[::2])), arb(0)).mid()


def _slow(g: list[Any], p: list[list[Any]], terms: int) -> Canonical:
    """The integrals of a panel on which L psi is large, from the slow solutions of both signs."""
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
    return Canonical(e, [after - before * e for before, after in ends], B, J)


def dot(x: list[Any], y: list[Any]) -> Any:
    """The sum of products, of the shorter one."""
    return sum(map(mul, x, y), arb(0))


# -- at one lam ------------------------------------------------------------------------------------


class Way(NamedTuple):
    """A stretch: m = e^{lam V} int e^{-lam V} and E = e^{lam V} at its end, V = 0 at its start;
    int e^{lam V} and int m."""

    m: Any
    E: Any
    B: Any
    J: Any

    def then(self, other: Way) -> Way:
        """This stretch and the next."""
        J = self.J + other.J + self.m * other.B
        return Way(self.m * other.E + other.m, self.E * other.E, self.B + self.E * other.B, J)


def ways(one: Panel, lam: Any, nats: float) -> list[Way]:
    """The panel at one lam, to the orders 0, 1, ..., N."""
    L, zero, found = one.eps * lam, arb(0), []
    if one.degree:
        known = canonical(L, one.degree, one.zeta, *one.ends, nats)
    else:
        known = Canonical((-L * (one.ends[1] - one.ends[0])).exp(), [], [], [])
    P, Q, slow, ends, regular = [zero] * 2, [zero] * 2, [zero] * 2, [zero] * 2, zero

    def more(total: list[Any], factor: Any, terms: Any) -> list[Any]:
        return [x + factor * y for x, y in zip(total, terms, strict=True)]

    for k in range(len(one.own)):
        sign, power = (-1) ** k, 1 / L ** (k + 1)
        P, Q = more(P, sign * power * L, one.P[k]), more(Q, power * L, one.P[k])
        slow, ends = more(slow, sign * power, one.c[k]), more(ends, power, one.c[k])
        mixed = sum((-1) ** (k - i) * row[k - i] for i, row in enumerate(one.mixed[: k + 1]))
        regular += power * (one.own[k] + mixed)
        B = dot(Q, known.B)
        m = dot(P, known.n) - slow[0] * known.e + slow[1]
        J = dot(P, [dot(Q, row) for row in known.J]) - slow[0] * B + regular - m * ends[1]
        found.append(Way(m, known.e, B - known.e * ends[1] + ends[0], J))
    return found


def straight(slope: Any, length: Any, lam: Any) -> Way:
    """Constant phi."""
    rate = lam * slope
    if rate == 0:
        return Way(length, arb(1), length, length * length / 2)
    m = -(-rate * length).expm1() / rate
    return Way(m, (-rate * length).exp(), m, (length - m) / rate)
