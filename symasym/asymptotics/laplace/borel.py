"""The median Borel–Padé sum of a Laplace expansion, beyond its optimal order.

sum_k c_k lam^-(s + k) is lam^(b - s) times the Laplace transform of t^(b - 1) B(t), B = sum_k c_k
t^k/Gamma(b + k), a series with a radius of convergence (Borel and Leroy; any b > 0 would do, and
b = s/2 was the best of those tried: its singularities are the most like poles, which are all that
Padé has). For polynomial f, B is singular where t is a singulant
F = f(p) - f(q), q a saddle of f that is seen from the maximum p (M. V. Berry and C. J. Howls, Proc.
R. Soc. A 434 (1991) 657). A real minimum q has F > 0, on the path of the Laplace transform: real
lam is on the series' Stokes line. There the sum is the mean of those that pass F above and below,
the Stokes multiplier being 1/2 (the median sum), and the real integral goes on beyond q with no
share of it. (From a q where f'' vanishes too it turns by other angles than where it came, and q
would have a share of its own: such f are refused.) Padé's approximant of the series [m/m]
continues B; with its poles p_j and residues r_j, z = -p_j,

    int_0^oo e^(-lam t) t^(b - 1)/(t - p_j) dt = Gamma(b) z^(b - 1) e^(lam z) Gamma(1 - b, lam z)

(DLMF 8.6.4), of which for p_j > 0 the real part is the mean.

A complex pair of singulants with Re F > 0 limits that. The poles of Padé's approximants gather on
the set of least capacity, in 1/t, that joins the singularities (H. Stahl, J. Approx. Theory 91
(1997) 139), which joins the pair across the real axis; beyond, at t > |F|^2/Re F, that bounds the
convex hull of 0 and the 1/F, they may converge to another branch, all of them alike. What a saddle
contributes at that height is therefore part of the claimed error (`pairs_beyond`).
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy

from symasym.asymptotics.laplace.kinks import number
from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.numbers.polynomials import shifted

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Poly, Symbol

    from symasym.asymptotics.laplace.expansion import Contribution

__all__ = [
    "BOREL",
    "BOREL_DIGITS",
    "Approximant",
    "approximant",
    "left_out",
    "median_sums",
    "pairs_beyond",
    "require_simple_points",
    "require_unit_steps",
]

#: Coefficients that order="borel" uses, and their digits.
BOREL, BOREL_DIGITS = 41, 90
#: How many coefficients fewer the sums have that tell the error.
_FEWER = (2, 4, 6, 8, 10, 12)
# The slowest rate at which their changes are taken to go on.
_SLOWEST = 0.95
# A denominator's coefficient beside the largest, below which the degree is lower.
_NOTHING = 40


class Approximant(NamedTuple):
    """Padé's approximant of B, of a series from lam^-s on: a polynomial part, poles, residues."""

    first: Any
    whole: list[Any]
    poles: list[tuple[Any, Any]]

    def laplace(self, lam: mpf, context: MPContext) -> Any:
        """The sum of the series at lam."""
        c, b = context, self.first / 2
        total = sum(
            (a * c.gamma(b + k) * lam ** -(b + k) for k, a in enumerate(self.whole)), c.zero
        )
        for p, residue in self.poles:
            z = -p
            share = c.gamma(b) * z ** (b - 1) * c.exp(lam * z) * c.gammainc(1 - b, lam * z)
            total += c.re(residue * share)
        return total * lam ** (b - self.first)


def approximant(coefficients: Sequence[Any], first: Any, context: MPContext) -> Approximant:
    """Padé's approximant from c_0, c_1, ..., of exponents first, first + 1, ...

    Its degrees are as equal as the number of coefficients allows, and lower where the series is
    that of a lower one.
    """
    c = context
    b = [a / c.gamma(first / 2 + k) for k, a in enumerate(coefficients)]
    # In units of the radius of convergence, about, coefficients and zeros keep their digits.
    last = max((k for k, a in enumerate(b) if k and a), default=0)
    unit = abs(b[0] / b[last]) ** (c.one / last) if last and b[0] else c.one
    b = [a * unit**k for k, a in enumerate(b)]
    for m in range((len(b) - 1) // 2, -1, -1):
        p, q = _quotient(b[: 2 * m + 1] if m else b, m, c)
        if q is not None:
            break
    assert q is not None
    while len(q) > 1 and abs(q[-1]) < c.mpf(10) ** -_NOTHING * max(map(abs, q)):
        q.pop()
    whole, rest = _divided(p, q)
    roots = c.polyroots(q[::-1], maxsteps=2000, extraprec=c.prec) if len(q) > 1 else []
    slope = [k * a for k, a in enumerate(q)][1:]
    poles = [(unit * z, unit * c.polyval(rest[::-1], z) / c.polyval(slope[::-1], z)) for z in roots]
    return Approximant(first, [a * unit**-k for k, a in enumerate(whole)], poles)


def _quotient(b: list[Any], m: int, context: MPContext) -> tuple[list[Any], list[Any] | None]:
    """Numerator and denominator of degree m, ascending; None where there is no such one."""
    if not m:
        return b, [context.one]
    try:
        p, q = context.pade(b, m, m)
    except ZeroDivisionError:
        return b, None
    return list(p), list(q)


def _divided(p: list[Any], q: list[Any]) -> tuple[list[Any], list[Any]]:
    """Quotient and rest, ascending."""
    rest, whole = list(p), []
    while len(rest) >= len(q) and (len(q) > 1 or rest):
        factor = rest[-1] / q[-1]
        whole.append(factor)
        shift = len(rest) - len(q)
        for k, a in enumerate(q):
            rest[shift + k] -= factor * a
        rest.pop()
    return whole[::-1], rest or [0 * p[0]]


def require_simple_points(f: Expr, x: Symbol, a: Expr, b: Expr) -> None:
    """Refuse a polynomial f with f' = f'' = 0 somewhere in a < x < b."""
    slope = sympy.Poly(f, x).diff(x)
    common = sympy.gcd(slope, slope.diff(x))
    for point in common.real_roots():
        if bool(a < point) and bool(point < b):
            raise InputError(
                f"order is \"borel\" and f = {f} has f' = f'' = 0 at {x} = {point}; it is for f "
                'whose critical points are simple; give another order, such as "optimal".'
            )


def require_unit_steps(contribution: Contribution) -> None:
    """Refuse a maximum whose exponents do not go up by 1."""
    exponents = contribution.exponents
    if len(exponents) > 1 and exponents[1] - exponents[0] != 1:
        raise InputError(
            f'order is "borel", and the maximum at {contribution.point} has terms in steps of '
            f"lam^-({exponents[1] - exponents[0]}); it is for simple maxima, in steps of 1/lam."
        )


def pairs_beyond(f: Expr, g: Expr, x: Symbol, height: mpf, lam: mpf, context: MPContext) -> mpf:
    """The size of what complex saddles of f contribute where the sum crosses their pair's cut.

    Over e^(lam height), height being f at the maximum.
    """
    c = context
    exponent, weight = (
        [c.convert(number(a, dps=c.dps)) for a in sympy.Poly(e, x).all_coeffs()[::-1]]
        for e in (f, g)
    )
    total = c.zero
    for q, multiplicity in _complex_zeros(sympy.Poly(f, x).diff(x), c):
        top, *bends = shifted(exponent, q)
        singulant = height - top
        if c.re(singulant) <= 0:
            continue
        m = multiplicity + 1
        width = (lam * abs(bends[m - 1])) ** (-c.one / m)
        size = width * sum(abs(a) * width**k for k, a in enumerate(shifted(weight, q)))
        total += size * c.exp(-lam * abs(singulant) ** 2 / c.re(singulant))
    return total


def _complex_zeros(p: Poly, context: MPContext) -> list[tuple[Any, int]]:
    """The zeros of a real polynomial that are not real, and their multiplicities."""
    found = []
    for factor, multiplicity in p.sqf_list()[1]:
        values = [context.convert(number(a, dps=context.dps)) for a in factor.all_coeffs()]
        roots = context.polyroots(values, maxsteps=500, extraprec=2 * context.prec)
        found += [(z, multiplicity) for z in roots if context.im(z)]
    return found


def left_out(sums: list[Any]) -> Any:
    """The estimated error of the first of sums whose orders go down in steps.

    Two of them may agree by chance: beside a complex pair of singulants, or where one is very near,
    the changes from sum to sum swing. So the largest of them counts, as the first of a geometric
    series whose rate is that of the newer half to the older one.
    """
    changes = [abs(a - b) for a, b in pairwise(sums)]
    half = len(changes) // 2
    newer, older = max(changes[:half]), max(changes[half:])
    rate = _SLOWEST if newer >= older else min(_SLOWEST, (newer / older) ** (1 / half))
    return 4 * max(newer, older) / (1 - rate)


def median_sums(contribution: Contribution, lam: mpf, context: MPContext) -> list[Any]:
    """The sum from all coefficients, and those from 2 fewer each (`left_out` tells the error)."""
    known: dict[Any, list[Approximant]] = contribution.__dict__.setdefault("_borel", {})
    if not known:
        with own_context(BOREL_DIGITS) as own:
            exponents, values = (
                [own.make_mpf(a._mpf_) for a in row] for row in contribution.numbers(BOREL_DIGITS)
            )
            known[0] = [
                approximant(values[: len(values) - fewer], exponents[0], own)
                for fewer in (0, *_FEWER)
            ]
    with context.workdps(max(context.dps, 30) + 20):
        return [
            Approximant(
                context.make_mpf(one.first._mpf_),
                [context.convert(a) for a in one.whole],
                [(context.convert(p), context.convert(r)) for p, r in one.poles],
            ).laplace(lam, context)
            for one in known[0]
        ]
