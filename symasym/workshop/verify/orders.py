"""Orders of convergence and limits: the error of N terms falls as fast as the next term does, and
the exact integrals go where they should as kappa or r goes to an end of its range.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import symasym as sa
from symasym.base.call_context import mpf_of, own_context
from symasym.workshop.problems import question
from symasym.workshop.verify.findings import LABELS, Field, Finding, compared, failed, relative

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext


#: How much an observed order may fall short of the stated one.
SHORTFALL = 0.25
_DPS = 50


class Family(NamedTuple):
    """A drift with radius and start; the noise is varied."""

    name: str
    make: Callable[[], sa.Drift]
    r: str
    start: str
    kappas: tuple[str, str]
    quantities: tuple[str, ...]
    methods: tuple[str, ...]


def _friction(z0: str) -> Callable[[], sa.Drift]:
    """The friction drift, made when it is asked for."""
    return lambda: sa.friction(3, 1, z0)


# Far enough into the limit that the next term rules the error, and a factor 2 apart.
_WEAK, _MILD, _STRONG = ("1/320", "1/640"), ("1/20", "1/40"), ("40", "80")
_ALL, _ESCAPE = ("T", "C", "1-C", "P", "1-P"), ("T", "C", "1-C")

FAMILIES = (
    Family("friction, well", _friction("-0.4"), "4", "0", _WEAK, ("T", "C"), ("laplace", "paper")),
    Family("friction, well, uniform", _friction("-0.4"), "4", "0", _WEAK, ("T",), ("uniform",)),
    Family("friction, well, from outside", _friction("-0.4"), "4", "-2", _WEAK, ("T", "C"),
           ("laplace",)),
    Family("friction, from the well", _friction("-0.4"), "4", "0.35", _WEAK, ("T",), ("laplace",)),
    Family("friction past the fold", _friction("-1.5"), "4", "0", _WEAK, ("T", "C"), ("laplace",)),
    Family("friction down", _friction("3"), "4", "1/4", _WEAK, ("T", "1-C"), ("laplace",)),
    Family("tanh sliding", lambda: sa.tanh(1, "-1/2", 3), "2", "1/5", _MILD, ("T", "1-P"),
           ("laplace",)),
    Family("linear repelling", lambda: sa.linear(-1, 2), "3", "-1/8", _WEAK, ("T", "1-C"),
           ("laplace",)),
    Family("friction, strong", _friction("-0.4"), "4", "1/2", _STRONG, _ESCAPE,
           ("strong_noise",)),
    Family("sine sliding, strong", lambda: sa.sine(1, "-1/2", 2, waves=1), "3", "-1/2", _STRONG,
           _ALL, ("strong_noise",)),
    Family("linear repelling, strong", lambda: sa.linear(-1, 2), "1/2", "0", _STRONG, _ESCAPE,
           ("strong_noise",)),
    Family("linear sliding, strong", lambda: sa.linear(1, "-1/2"), "3", "0", _STRONG, ("P",),
           ("paper",)),
)  # fmt: skip
BY_NAME = {family.name: family for family in FAMILIES}


def order(name: str, full: bool) -> Iterator[Finding]:
    """Observed order in kappa over the stated one, method by method."""
    family = BY_NAME[name]
    for method in family.methods:
        if method == "paper":
            yield from _paper(family)
            continue
        for n in (0, 1, 2, 3, 5) if full else (0, 2):
            for quantity in family.quantities:
                # In 1/lam = kappa^2/2 or lam = 2/kappa^2: one more power than was kept.
                yield from _observed(family, quantity, method, {"order": n}, 2 * n + 2)


def _paper(family: Family) -> Iterator[Finding]:
    """Findings on the paper's own formulas."""
    if "P" in family.quantities:
        # P itself is O(kappa^-2), what follows O(kappa^-4).
        yield from _observed(family, "P", "paper", {}, 2, "eq:Plarge2")
    else:
        yield from _observed(family, "T", "paper", {}, 2, "eq:Ttildesmall")


def _observed(
    family: Family,
    quantity: str,
    method: str,
    setting: dict[str, Any],
    stated: int,
    formula: str = "",
) -> Iterator[Finding]:
    """The finding that the error of a method falls with the stated power of kappa."""
    formula = formula or LABELS[quantity]
    shown = "".join(f", {name} {value}" for name, value in setting.items())
    where = f"{family.name}, {quantity}{shown}"
    errors = []
    for kappa in family.kappas:
        ask = question(quantity, family.make(), kappa, family.r, family.start)
        try:
            value = ask(method=method, dps=_DPS, **setting)
        except sa.SymasymError as error:
            yield failed(formula, method, "order", where, error)
            return
        errors.append(relative(value, ask(dps=_DPS)))
    yield shortfall(formula, method, where, errors, stated, family.kappas)


def shortfall(
    formula: str,
    method: str,
    where: str,
    errors: list[Any],
    stated: float,
    kappas: tuple[str, str],
) -> Finding:
    """The finding that errors at two noises fall with at least the stated power of kappa."""
    from mpmath import log, mp, mpf

    first, second = (mpf(e._mpf_) if hasattr(e, "_mpf_") else mpf(e) for e in errors)
    # Where the series ends the error is exponentially small, or 0: any order is met.
    if max(first, second) < mpf(10) ** (8 - _DPS):
        return Finding(formula, method, "order", 0.0, where)
    ratio = Fraction(kappas[0]) / Fraction(kappas[1])
    observed = float("inf")
    if first and second:
        # Towards the limit: smaller kappa for weak noise, larger for strong.
        observed = abs(float(log(mpf_of(ratio, mp))))
        observed = float(log(first / second)) / observed
    size = max(0.0, (stated - observed) / SHORTFALL)
    detail = "" if size <= 1 else f"order {observed:.3g} in kappa, where {stated} is stated"
    return Finding(formula, method, "order", size, where, detail)


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
                answer = question(quantity, drift, kappa, r, x)(dps=_DPS)
                errors[quantity].append(abs(mp.convert(answer) / mp.convert(value) - 1))
        for quantity, pair in errors.items():
            formula = "eq:Ttilde" if quantity == "T" else "eq:C"
            where = f"{name}, {quantity}, kappa -> oo"
            yield shortfall(formula, "digits", where, pair, 2, kappas)._replace(check="limit")


def weak(name: str, full: bool) -> Iterator[Finding]:
    """kappa -> 0: the flight time along the drift, or e^{lam} to the highest barrier of V."""
    drift, r = DRIFTS[name](), Fraction(3)
    barrier = _barrier_height(drift)
    kappas = ("1e-3", "5e-4")
    where = f"{name}, T, kappa -> 0"
    with own_context(_DPS + 10) as mp:
        times = [mp.convert(question("T", drift, k, r)(dps=_DPS)) for k in kappas]
        if barrier is None:
            side, field = 1 if drift.ends[1] > 0 else -1, Field(drift, mp)
            flight = mp.quad(lambda u: 1 / field.A(side * u), [0, 1]) * side
            flight += (3 - mp.one) / abs(field.ends[side > 0])
            errors = [abs(t / flight - 1) for t in times]
            finding = shortfall("eq:Ttilde", "digits", where, errors, 2, kappas)
            yield finding._replace(check="limit")
            return
        noises = [mp.convert(Fraction(k) ** 2 / 2) for k in kappas]
        # log T = barrier/noise + O(log): Kramers' exponent.
        for noise, time in zip(noises, times, strict=True):
            gap = abs(noise * mp.log(time) - barrier(mp))
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
            [mp.convert(question(q, drift, kappa, r)(dps=_DPS)) for r in radii] for q in ("T", "C")
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
                shares = [mp.convert(question("1-C", drift, kappa, r)(dps=_DPS)) for r in radii]
            slope = -mp.log(shares[1] / shares[0]) / 2
            gap = abs(slope / abs(mp.convert(behind)) - 1)
            yield compared("eq:C", "digits", "limit", gap, 1e-12, f"{where}, {quantity}")
        else:
            easier = min(abs(a_minus), abs(a_plus))
            slope = mp.log(times[1] / times[0]) / 2
            gap = abs(slope / mp.convert(easier) - 1)
            yield compared("eq:Ttilde", "digits", "limit", gap, 1e-12, f"{where}, T")


def _barrier_height(drift: sa.Drift) -> Any:
    """The height T's exponent takes within |u| < 3, as a function of a context; None for none."""
    a_minus, a_plus = (Fraction(x) for x in drift.ends)
    if a_minus * a_plus > 0 and not drift.wells():
        return None

    def height(mp: MPContext) -> Any:
        """The barrier of V in T's exponent."""
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
