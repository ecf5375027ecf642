"""Expressions in balls, and the integral of g e^(lam f) itself, enclosed.

The integral is flint's (F. Johansson, Numerical integration in arbitrary-precision ball arithmetic,
2018), proved on a finite interval with the integrand analytic at both ends. At infinity, or at a
singular end, it is cut off at some distance and what lies beyond is bounded on shells, each of
twice the distance of the last one, or half of it: to 1e300 or until they are below 2^-(10^9), and
to 1e-300 or the square of the digits. That they go on as the last two do is assumed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate, pairwise
from typing import Any

from flint import acb, arb, ctx
from sympy import Expr, S, Symbol

from symasym.base.balls import precision
from symasym.base.errors import InputError
from symasym.drift.evaluate import box, profile
from symasym.drift.models import Expression

# Shells towards an end, and halvings of each.
_SHELLS, _DEPTH, _NOTHING = 997, 6, arb(2) ** -(10**9)
_model = lru_cache(maxsize=512)(Expression)


def code(e: Expr, x: Symbol) -> Any:
    """The expression as a function of balls, nan across branch cuts and at poles."""
    return profile(_model(e, x), {})


def number(e: Any) -> Any:
    """A constant as a ball, nan where it isn't real."""
    if isinstance(e, Zero):
        return e.ball()
    if e in (S.Infinity, S.NegativeInfinity):
        return arb.pos_inf() if e > 0 else arb.neg_inf()
    try:
        return arb(code(e, Symbol("x"))(arb(0)))
    except InputError:  # as of a sampled value that is complex
        return arb.nan()


@dataclass(frozen=True)
class Zero:
    """Where an expression in x changes its sign between two numbers."""

    equation: Expr
    x: Symbol
    lo: Any
    hi: Any

    def ball(self) -> Any:
        """By bisection."""
        bits = ctx.prec
        with precision(2 * bits + 200):
            of, p, q = code(self.equation, self.x), self.lo, self.hi
            sign = of(p)
            for _ in range(bits + 100):
                m = ((p + q) / 2).mid()
                value = of(m)
                if value.contains(0):
                    return m
                p, q = (m, q) if value * sign > 0 else (p, m)
            return p.union(q)

    def __str__(self) -> str:
        return str(self.ball().str(12, radius=False))


def middle(lo: Any, hi: Any) -> Any:
    """A point inside an interval, of balls."""
    if lo.is_finite():
        return (lo + hi) / 2 if hi.is_finite() else lo + 1
    return hi - 1 if hi.is_finite() else arb(0)


def integral(
    f: Expr, g: Expr, x: Symbol, marks: list[Any], lam: Any, top: Any, bits: int
) -> tuple[Any, bool]:
    """int g e^(lam (f - top)) from the first mark to the last to about 2^-`bits`, in a ball that is
    not finite where it can't be enclosed; and True if nothing is assumed.

    Marks split the integral, so that f and g may be singular there; the ball holds with any.
    """
    height, slope, bend, weight = (code(e, x) for e in (f, f.diff(x), f.diff(x, 2), g))

    def integrand(z: Any) -> Any:
        value = height(z)
        # The ball is finite only where f is analytic; f'' may be simpler, and finite elsewhere.
        if value.is_finite() and not lam * value.rad() < 1:
            # Beside a maximum the ball of its Taylor polynomial is narrower.
            m = z.mid()
            near = height(m) + (z - m) * (slope(m) + (z - m) * bend(z) / 2)
            value = near if near.rad() < value.rad() else value
        return weight(z) * (lam * (value - top)).exp()

    total, tiny, proved = arb(0), arb(2) ** -bits, True
    for lo, hi in pairwise(marks):
        if lo < hi:
            inside = middle(lo, hi)
            (a, before), (b, after) = (cut(integrand, end, inside, tiny) for end in (lo, hi))
            found = acb.integral(lambda z, _: acb(integrand(z)), acb(a), acb(b), tiny, tiny)
            total += found.real + arb(0, before + after)
            proved = proved and before == after == 0
    return total, proved


def cut(integrand: Any, end: Any, inside: Any, tiny: Any) -> tuple[Any, Any]:
    """Where to end towards an end, and what bounds the integral beyond: 0 at a regular end."""
    far = not end.is_finite()
    if not far and integrand(acb(end) + box(0, tiny, tiny)).is_finite():
        return end, arb(0)
    # Near an end other than 0 points need their own digits.
    with precision(ctx.prec + (0 if far or end == 0 else _SHELLS)):
        reach = (arb(2) ** (k if far else -k) for k in range(_SHELLS))
        way = (1 if end > 0 else -1) if far else inside - end
        at = [(inside if far else end) + way * y for y in reach]
        shells: list[Any] = []
        for p, q in pairwise(at):
            shells.append(_bound(integrand, p, q, tiny / _SHELLS, _DEPTH))
            known = shells[-1] < _NOTHING or (shells[-1] < tiny * tiny and not far)
            if known and len(shells) > 1 and shells[-1] < shells[-2]:
                break
    # Beyond the last one they are taken to go on as they do.
    ratio = shells[-1] / shells[-2] if shells[-1] > _NOTHING else arb(0)
    last = shells[-1] * ratio / (1 - ratio) if ratio < 1 else arb.pos_inf()
    rests = list(accumulate(reversed(shells), initial=last))[::-1]
    found = zip(at, rests, strict=False)
    return next(((y, r) for y, r in found if r < tiny), (at[len(shells)], last))


def _bound(integrand: Any, p: Any, q: Any, small: Any, depth: int) -> Any:
    """An upper bound of the integral of |integrand| over [p, q], in parts where it varies."""
    whole = abs(integrand(p.union(q))) * abs(q - p)
    if depth and not (whole < small or whole < 64 * abs(q - p) * abs(integrand(p))):
        m = ((p + q) / 2).mid()
        return sum((_bound(integrand, *h, small, depth - 1) for h in ((p, m), (m, q))), arb(0))
    return whole.upper()
