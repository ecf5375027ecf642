"""Values known in closed form, as functions of an mpmath context and kappa, r, start in it."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from symasym.base.contexts import mpf_of

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


ClosedForm = Callable[[Any, Any, Any, Any], Any]


def constant_drift(a: str) -> dict[str, ClosedForm]:
    """T and C of the drift `a` everywhere (design.md, section 5, fact 9, with any start)."""

    def number(mp: MPContext) -> Any:
        """The drift a."""
        exact = Fraction(a)
        return mpf_of(exact, mp)

    def below(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """C, the probability of leaving through -r."""
        rate = 2 * number(mp) / kappa**2
        if rate == 0:
            return (r - x) / (2 * r)
        # both terms times the larger exponential, which would overflow nothing but memory
        return mp.exp(-rate * (r + x)) * mp.expm1(rate * (x - r)) / mp.expm1(-2 * rate * r)

    def above(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """1 - C."""
        rate = 2 * number(mp) / kappa**2
        return mp.expm1(-rate * (r + x)) / mp.expm1(-2 * rate * r) if rate else (r + x) / (2 * r)

    def time(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """T, by Wald's identity for the martingale u - a t."""
        if not number(mp):
            return (r * r - x * x) / kappa**2
        # u - a t is a martingale
        if x == 0:
            return r / number(mp) * mp.tanh(number(mp) * r / kappa**2)
        return (r - 2 * r * below(mp, kappa, r, x) - x) / number(mp)

    return {"T": time, "C": below, "1-C": above}


def linear_sliding(slope: str) -> dict[str, ClosedForm]:
    """P, 1 - P and the density of A = -slope u, whose potential is a parabola between lines."""

    def parts(mp: MPContext, kappa: mpf) -> tuple[Any, Any, Any]:
        """The integrals of e^(-lam V) over the layer and the tails, and q = slope/kappa^2."""
        a = mpf_of(Fraction(slope), mp)
        q = a / kappa**2  # lam V = q u^2 up to a constant
        inside = mp.sqrt(mp.pi / q) * mp.erf(mp.sqrt(q))
        return inside, mp.exp(-q) / q, q

    def inside(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """P, the share of the layer."""
        layer, tails, _ = parts(mp, kappa)
        return layer / (layer + tails)

    def outside(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
        """1 - P, the share of the tails."""
        layer, tails, _ = parts(mp, kappa)
        return tails / (layer + tails)

    def density(at: str) -> ClosedForm:
        """The stationary density at a point."""

        def value(mp: MPContext, kappa: mpf, r: mpf, x: mpf) -> Any:
            """e^{-lam V} at the point over its integral."""
            layer, tails, q = parts(mp, kappa)
            y = abs(mpf_of(Fraction(at), mp))
            rise = y * y if y <= 1 else 1 + 2 * (y - 1)
            return mp.exp(-q * rise) / (layer + tails)

        return value

    half = {"C": lambda mp, *_: mp.mpf(1) / 2, "1-C": lambda mp, *_: mp.mpf(1) / 2}
    return half | {
        "P": inside,
        "1-P": outside,
        "p(3/10)": density("3/10"),
        "p(-5/2)": density("-5/2"),
    }


HALF: dict[str, ClosedForm] = {
    name: lambda mp, *_: mp.mpf(1) / 2 for name in ("C", "1-C")
}  # an odd drift, from 0
