"""Limits of the exact integrals as kappa or r goes to an end of its range."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base.contexts import own_context
from symasym.workshop.verify.field import Field
from symasym.workshop.verify.findings import Finding, compared
from symasym.workshop.verify.orders import shortfall

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext


_DPS = 40

DRIFTS: dict[str, Callable[[], sa.Drift]] = {
    "friction, well": lambda: sa.friction(3, 1, "-0.4"),
    "friction past the fold": lambda: sa.friction(3, 1, "-1.5"),
    "linear sliding": lambda: sa.linear(1, "-1/2"),
    "tanh sliding": lambda: sa.tanh(1, -2, 4),
    "hill down": lambda: sa.hill(-1, "-1/3", "1/2", n=3),
}


def strong(name: str, full: bool) -> Iterator[Finding]:
    """kappa -> oo: Brownian motion, T = (r^2 - x^2)/kappa^2 and C = (r - x)/(2 r)."""
    drift, r, x = DRIFTS[name](), Fraction(3), Fraction(1, 2)
    errors: dict[str, list[Any]] = {"T": [], "C": [], "1-C": []}
    kappas = ("1e4", "2e4")
    with own_context(_DPS + 10) as mp:
        for kappa in kappas:
            k = Fraction(kappa)
            share = (r - x) / (2 * r)
            free = {"T": (r * r - x * x) / k**2, "C": share, "1-C": 1 - share}
            for quantity, value in free.items():
                answer = _escape(drift, quantity, kappa, r, x)
                errors[quantity].append(abs(mp.convert(answer) / mp.convert(value) - 1))
        for quantity, pair in errors.items():
            formula = "eq:Ttilde" if quantity == "T" else "eq:C"
            where = f"{name}, {quantity}, kappa -> oo"
            yield shortfall(formula, "digits", where, pair, 2, kappas)._replace(check="limit")


def weak(name: str, full: bool) -> Iterator[Finding]:
    """kappa -> 0: the flight time along the drift, or e^{lam} to the highest climb of V."""
    drift, r = DRIFTS[name](), Fraction(3)
    climb = _climb(drift)
    kappas = ("1e-3", "5e-4")
    where = f"{name}, T, kappa -> 0"
    with own_context(_DPS + 10) as mp:
        times = [mp.convert(_escape(drift, "T", k, r, Fraction(0))) for k in kappas]
        if climb is None:
            side, field = 1 if drift.ends[1] > 0 else -1, Field(drift, mp)
            flight = mp.quad(lambda u: 1 / field.A(side * u), [0, 1]) * side
            flight += (3 - mp.one) / abs(field.ends[side > 0])
            errors = [abs(t / flight - 1) for t in times]
            finding = shortfall("eq:Ttilde", "digits", where, errors, 2, kappas)
            yield finding._replace(check="limit")
            return
        noises = [mp.convert(Fraction(k) ** 2 / 2) for k in kappas]
        # log T = climb/noise + O(log): Kramers' exponent.
        for noise, time in zip(noises, times, strict=True):
            gap = abs(noise * mp.log(time) - climb(mp))
            yield compared("eq:Ttilde", "digits", "limit", gap, 5 * noise * -mp.log(noise), where)
        if drift.region == "sliding":
            outside = [sa.occupation(drift, k, complement=True, dps=_DPS) for k in kappas]
            for noise, share in zip(noises, outside, strict=True):
                depth = -noise * mp.log(mp.convert(share))
                gap = abs(depth - _depth(drift, mp))
                room = 5 * noise * -mp.log(noise)
                yield compared("eq:P", "digits", "limit", gap, room, f"{name}, 1-P, kappa -> 0")


def far(name: str, full: bool) -> Iterator[Finding]:
    """r -> oo: T grows by 1/|a| a unit where it leaves freely, as e^{lam |a|} where it climbs."""
    drift, kappa = DRIFTS[name](), Fraction(1)
    a_minus, a_plus = (Fraction(x) for x in drift.ends)
    where = f"{name}, r -> oo"
    with own_context(_DPS + 10) as mp:
        radii = (Fraction(60), Fraction(61))
        times, shares = (
            [mp.convert(_escape(drift, q, kappa, r, Fraction(0))) for r in radii]
            for q in ("T", "C")
        )
        if a_minus * a_plus > 0:
            growth, wanted = times[1] - times[0], 1 / abs(mp.convert(a_plus))
            if a_plus < 0:
                wanted = 1 / abs(mp.convert(a_minus))
            gap = abs(growth / wanted - 1)
            yield compared("eq:Ttilde", "digits", "limit", gap, 1e-12, f"{where}, T")
            behind = a_minus if a_plus > 0 else a_plus
            quantity = "C" if a_plus > 0 else "1-C"
            if quantity == "1-C":
                shares = [mp.convert(_escape(drift, "1-C", kappa, r, Fraction(0))) for r in radii]
            slope = -mp.log(shares[1] / shares[0]) / 2
            gap = abs(slope / abs(mp.convert(behind)) - 1)
            yield compared("eq:C", "digits", "limit", gap, 1e-12, f"{where}, {quantity}")
        else:
            easier = min(abs(a_minus), abs(a_plus))
            slope = mp.log(times[1] / times[0]) / 2
            gap = abs(slope / mp.convert(easier) - 1)
            yield compared("eq:Ttilde", "digits", "limit", gap, 1e-12, f"{where}, T")


def _escape(drift: sa.Drift, quantity: str, kappa: str | Fraction, r: Fraction, x: Fraction) -> Any:
    """T, C or 1 - C to 40 digits."""
    if quantity == "T":
        return sa.escape_time(drift, kappa, r, start=x, dps=_DPS)
    other = quantity == "1-C"
    return sa.exit_probability(drift, kappa, r, start=x, complement=other, dps=_DPS)


def _climb(drift: sa.Drift) -> Any:
    """The height T's exponent takes within |u| < 3, as a function of a context; None for none."""
    a_minus, a_plus = (Fraction(x) for x in drift.ends)
    if a_minus * a_plus > 0 and not drift.wells():
        return None

    def height(mp: MPContext) -> Any:
        """The height of V that T's exponent climbs."""
        (well,), field = drift.wells(), Field(drift, mp)
        if a_minus * a_plus > 0:
            (barrier,) = drift.barriers()
            return field.rise(well.u, barrier.u)
        return min(field.rise(well.u, side) + 2 * abs(field.ends[side > 0]) for side in (-1, 1))

    return height


def _depth(drift: sa.Drift, mp: MPContext) -> Any:
    """V at the lower edge of the layer, from its well."""
    (well,) = drift.wells()
    return min(Field(drift, mp).rise(well.u, side) for side in (-1, 1))
