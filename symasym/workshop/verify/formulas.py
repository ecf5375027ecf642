"""The paper's formulas of single pieces, as they were emitted, against quadrature."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.base.call_context import own_context
from symasym.generated import mpmath_formulas as of
from symasym.generated import numpy_formulas
from symasym.workshop import reference_quadrature
from symasym.workshop.verify.findings import Field, Finding, compared, relative
from symasym.workshop.verify.orders import shortfall

if TYPE_CHECKING:
    from mpmath import mpf


_DPS = 18
_ALLOWED = 1e-17
# The numpy functions: a few roundings of numbers of order one, and exponents up to a few tens.
_FLOAT = 1e-13
_K = Fraction
_WEAK, _WEAKER = ("1/8", "1/16"), ("1/12", "1/24")
# Enough to see errors of a few kappa^4.
_FEW = 10
_DRIFT = ("3", "1", "-0.4")


def _both(
    label: str, name: str, arguments: dict[str, Fraction], wanted: mpf, where: str, part: int = -1
) -> Iterator[Finding]:
    """An emitted function, with mpmath and with NumPy, against a number."""
    with own_context(_DPS + 12) as mp:
        given = {k: mp.convert(v) for k, v in arguments.items()}
        value = getattr(of, name)(mp, **given)
        in_float64 = getattr(numpy_formulas, name)(**{k: float(v) for k, v in arguments.items()})
        if part >= 0:
            value, in_float64 = value[part], in_float64[part]
        gaps = [relative(x, wanted) for x in (value, float(in_float64))]
        yield compared(label, f"{name}, digits", "quadrature", gaps[0], _ALLOWED, where)
        yield compared(label, f"{name}, float64", "quadrature", gaps[1], _FLOAT, where)


def pieces(name: str, full: bool) -> Iterator[Finding]:
    """Formulas that hold exactly: pieces of T, P from the layer, potentials, constant drift."""
    yield from _EXACT[name]()


def _outer() -> Iterator[Finding]:
    """Findings on eq:fourthTerm: the double integral over 1 < u < v < r."""
    drift, kappa, r = sa.friction(*_DRIFT), _K(1, 2), _K(3)
    piece = reference_quadrature.double_integral(drift, kappa, _K(1), _K(1), r, _DPS + 2)
    with own_context(_DPS + 12) as mp:
        wanted = mp.convert(piece) * mp.convert(2 / kappa**2)
        arguments = {"kappa": kappa, "r": r, "a_plus": Fraction(drift.ends[1])}
        yield from _both("eq:fourthTerm", "outer_piece", arguments, wanted, "kappa = 1/2, r = 3")


def _layer() -> Iterator[Finding]:
    """Findings on eq:P2: P from the integral over the layer."""
    drift, kappa = sa.tanh(1, "-1/2", 3), _K(2, 3)
    layer = reference_quadrature.integral(drift, kappa, _K(-1), _K(1), -1, _DPS + 5)
    wanted = reference_quadrature.occupation(drift, kappa, _DPS + 2)
    with own_context(_DPS + 12) as mp:
        field = Field(drift, mp)
        ends, top = field.ends, field.rise(-1, 0, 1)
        value = of.occupation_from_layer(mp, mp.convert(kappa), *ends, mp.convert(layer), top)
        gap = relative(value, wanted)
        name = "occupation_from_layer, digits"
        yield compared("eq:P2", name, "quadrature", gap, _ALLOWED, "tanh, kappa = 2/3")
        inner = numpy_formulas.occupation_from_layer(
            float(kappa), float(ends[0]), float(ends[1]), float(layer), float(top)
        )
        name = "occupation_from_layer, float64"
        gap = relative(float(inner), wanted)
        yield compared("eq:P2", name, "quadrature", gap, _FLOAT, "tanh, kappa = 2/3")


def _potentials() -> Iterator[Finding]:
    """Findings on eq:phifric0, eq:Vfric and eq:V2, by mpmath's quadrature of phi."""
    drift = sa.friction(*_DRIFT)
    mu, alpha, z0 = (Fraction(x) for x in _DRIFT)
    with own_context(_DPS + 12) as mp:
        phi = Field(drift, mp).phi
        for u, side in ((_K(-5, 2), "left"), (_K(3, 10), "inside"), (_K(7, 3), "right")):
            edges = [-1, *([1] if u > 1 else []), mp.convert(u)]
            wanted = -mp.quad(phi, edges)
            arguments = {"u": u, "alpha": alpha, "z0": z0}
            if side == "inside":
                arguments["mu"] = mu
            where = f"u = {u}"
            yield from _both("eq:Vfric", f"friction_potential_{side}", arguments, wanted, where)
            if side != "inside":
                ends = [Fraction(x) for x in drift.ends]
                edge = {"a_plus": ends[1], "V1": 2 * z0 - 2}
                if side == "left":
                    edge = {"a_minus": ends[0]}
                yield from _both("eq:V2", f"potential_{side}", {"u": u, **edge}, wanted, where)
        for u, side in ((_K(-1), "left"), (_K(1, 3), "inside"), (_K(1), "right")):
            arguments = {"alpha": alpha, "z0": z0}
            if side == "inside":
                arguments |= {"u": u, "mu": mu}
            wanted = phi(u)
            yield from _both("eq:phifric0", f"friction_{side}", arguments, wanted, f"u = {u}")


def _folds() -> Iterator[Finding]:
    """At a fold A has a double zero, at the turning point: A = A' = 0, of mpmath's own roots."""
    mu, alpha = _K(3), _K(1)
    with own_context(_DPS + 30) as mp:
        turning = mp.findroot(lambda u: 9 * u**2 - 4, mp.mpf("0.66"))
        force = turning + 3 * (turning - turning**3)
        arguments = {"mu": mu}
        yield from _both("turning-points", "friction_turning_point", arguments, turning, "mu = 3")
        arguments = {"mu": mu, "alpha": alpha}
        yield from _both("beta", "friction_breakaway", arguments, force, "mu = 3")
        for part, z0 in enumerate((1 - force, 1 + force)):
            yield from _both("folds", "friction_folds", arguments, z0, "mu = 3", part)


def _friction() -> Iterator[Finding]:
    """Findings on friction-well, from mpmath's zeros of A, and on threshold, where T is 1."""
    where = "mu = 3, z0 = -0.4"
    with own_context(_DPS + 12) as mp:
        known = _landscape(Field(sa.friction(*_DRIFT), mp))
        shape, size, place = (mp.convert(Fraction(x)) for x in _DRIFT)
        omega = of.friction_angle(mp, shape, size, place)
        closed = {
            "slope_well": of.friction_slope_well(mp, omega, shape, size),
            "slope_barrier": of.friction_slope_barrier(mp, omega, shape, size),
            "barrier": of.friction_barrier(mp, omega, shape, size),
        }
        for name, value in closed.items():
            gap = relative(value, known[name])
            yield compared("friction-well", f"friction_{name}", "its zeros", gap, _ALLOWED, where)
        eps = mp.mpf(1) / 100
        kappa = of.noise_threshold(mp, eps, -mp.log(eps), known["barrier"])
        gap = relative(eps * mp.exp(2 * known["barrier"] * eps / kappa**2), mp.one)
        yield compared("threshold", "noise_threshold", "scale of T", gap, _ALLOWED, "eps = 1/100")


def _constant() -> Iterator[Finding]:
    """Findings on T and C of a constant drift."""
    for a, kappa in ((_K(3, 2), _K(1)), (_K(-1), _K(3, 4))):
        drift = sa.polynomial(a)
        arguments = {"kappa": kappa, "r": _K(2), "a": a}
        where = f"a = {a}, kappa = {kappa}"
        wanted = reference_quadrature.escape_time(drift, kappa, _K(2), _K(0), _DPS + 2)
        yield from _both("constant-drift", "constant_drift_time", arguments, wanted, where)
        wanted = reference_quadrature.exit_probability(drift, kappa, _K(2), _K(0), _DPS + 2)
        yield from _both("constant-drift", "constant_drift_exit", arguments, wanted, where)


def _slopes() -> Iterator[Finding]:
    """fr1: the slope of A; eq:Tsmall: where the well's term is as large as the flight."""
    drift = sa.friction(*_DRIFT)
    with own_context(_DPS + 30) as mp:
        field = Field(drift, mp)
        for u in (_K(-1, 3), _K(9, 10)):
            wanted = field.slope(mp.convert(u))
            arguments = {"u": u, "mu": _K(3), "alpha": _K(1)}
            yield from _both("fr1", "friction_slope", arguments, wanted, f"u = {u}")
        points, r = _landscape(field), mp.mpf(1000)
        flight = r / field.ends[1]
        kappa = of.well_edge(mp, r, field.ends[1], **points)
        gap = relative(of.well_term(mp, kappa, **points), flight)
        yield compared("eq:Tsmall", "well_edge", "both terms equal", gap, _ALLOWED, "r = 1000")


def _without_C() -> Iterator[Finding]:
    """eq:TtildeCzero: what it leaves out is C lam (J0 + J1), from quadrature."""
    drift, kappa, r = sa.friction(*_DRIFT), _K(2), _K(2)
    time = reference_quadrature.escape_time(drift, kappa, r, _K(0), _DPS)
    share = reference_quadrature.exit_probability(drift, kappa, r, _K(0), _DPS)
    right, left = (
        reference_quadrature.double_integral(drift, kappa, -r, low, low + r, _DPS)
        for low in (_K(0), -r)
    )
    with own_context(_DPS + 12) as mp:
        T, C, J0, J1 = (mp.convert(x) for x in (time, share, right, left))
        lam = mp.convert(2 / kappa**2)
        gap = relative(lam * J0 - T, C * lam * (J0 + J1))
        where = "kappa = 2, r = 2"
        yield compared("eq:TtildeCzero", "quadrature", "what is left out", gap, 1e-15, where)


_EXACT: dict[str, Callable[[], Iterator[Finding]]] = {
    "outer piece": _outer,
    "layer": _layer,
    "potentials": _potentials,
    "folds": _folds,
    "friction": _friction,
    "constant drift": _constant,
    "slopes": _slopes,
    "without C": _without_C,
}
EXACT = tuple(_EXACT)


# -- leading orders --------------------------------------------------------------------------------


def leading(name: str, full: bool) -> Iterator[Finding]:
    """Leading orders, whose error must fall as fast as they state."""
    yield from _LEADING[name]()


def _landscape(field: Field) -> dict[str, Any]:
    """Slopes of A at well and barrier, and the height between them."""
    roots = [field.zero(points[0].u) for points in (field.drift.wells(), field.drift.barriers())]
    slopes = [field.slope(u) for u in roots]
    return {
        "slope_well": slopes[0],
        "slope_barrier": slopes[1],
        "barrier": field.rise(*roots),
    }


def _well() -> Iterator[Finding]:
    """The second piece: the double integral over u from -1, v from 0 to 1."""
    drift = sa.friction(*_DRIFT)
    stated = {"well_term": 2, "with saddle_correction": 4, "with saddle_first, saddle_second": 6}
    errors: dict[str, list[Any]] = {name: [] for name in stated}
    for kappa in _WEAKER:
        noise = Fraction(kappa)
        piece = reference_quadrature.double_integral(drift, noise, _K(-1), _K(0), _K(1), _FEW)
        with own_context(40) as mp:
            field = Field(drift, mp)
            wanted = mp.convert(piece) * mp.convert(2 / noise**2)
            value = of.well_term(mp, mp.convert(noise), **_landscape(field))
            errors["well_term"].append(relative(value, wanted))
            correction, series, lam = mp.one, mp.one, mp.convert(2 / noise**2)
            for kind, sign in (("wells", 1), ("barriers", -1)):
                u = field.zero(getattr(drift, kind)()[0].u)
                # Derivatives of V = -integral of A; for a barrier of -V.
                derivatives = [-sign * field.slope(u, n) for n in range(1, 6)]
                correction += of.saddle_correction(mp, mp.convert(noise), *derivatives[:3])
                first = of.saddle_first(mp, *derivatives[:3])
                series *= 1 + first / lam + of.saddle_second(mp, *derivatives) / lam**2
            errors["with saddle_correction"].append(relative(value * correction, wanted))
            errors["with saddle_first, saddle_second"].append(relative(value * series, wanted))
    for name, pair in errors.items():
        label = "saddle-series" if "saddle_second" in name else "eq:secondTerm"
        yield shortfall(label, name, "friction, z0 = -0.4", pair, stated[name], _WEAKER)


def _large() -> Iterator[Finding]:
    """eq:Ttildelarge: what it leaves out is O(kappa^2), and with the next terms O(kappa^-2)."""
    drift, r = sa.friction(*_DRIFT), _K(10**9)
    kappas = ("20", "40")
    errors: dict[str, list[Any]] = {"strong_noise_time": [], "strong_noise_time_next": []}
    for kappa in kappas:
        noise = Fraction(kappa)
        exact = sa.escape_time(drift, noise, r, dps=50)
        with own_context(60) as mp:
            T, a_minus, a_plus = mp.convert(exact), *Field(drift, mp).ends
            # V(1) of this drift: 2 (z0 - 1)
            radius, top = mp.convert(r), mp.convert(2 * (Fraction(_DRIFT[2]) - 1))
            first = of.strong_noise_time(mp, radius, a_plus)
            both = of.strong_noise_time_next(mp, mp.convert(noise), radius, a_minus, a_plus, top)
            errors["strong_noise_time"].append(abs(T - first))
            errors["strong_noise_time_next"].append(abs(T - both))
    for name, stated in (("strong_noise_time", -2), ("strong_noise_time_next", 2)):
        yield shortfall("eq:Ttildelarge", name, "r = 1e9", errors[name], stated, kappas)


def _outside() -> Iterator[Finding]:
    """eq:Psmall2, on a drift with one well and uneven edges."""
    drift = sa.tanh(1, -2, 3)
    errors = []
    for kappa in _WEAK:
        exact = sa.occupation(drift, kappa, complement=True, dps=40)
        with own_context(50) as mp:
            field = Field(drift, mp)
            well = field.zero(drift.wells()[0].u)
            low, top = field.rise(-1, well), field.rise(-1, well, 1)
            noise, bend = mp.convert(Fraction(kappa)), -field.slope(well)
            value = of.weak_noise_outside(mp, noise, *field.ends, top, low, bend)
            errors.append(relative(value, exact))
    yield shortfall("eq:Psmall2", "weak_noise_outside", "tanh(1, -2, 3)", errors, 2, _WEAK)


def _behind() -> Iterator[Finding]:
    """eq:S: from behind the barrier, where the well's term keeps only one Gaussian."""
    drift = sa.Drift("(u + 4/5)*(u + 3/10)*(3 + u)/2")
    errors = []
    for kappa in _WEAK:
        noise = Fraction(kappa)
        piece = reference_quadrature.double_integral(drift, noise, _K(-1), _K(0), _K(1), _FEW)
        with own_context(40) as mp:
            field, well = Field(drift, mp), mp.mpf(-4) / 5
            # What does not come from the well is the flight, of order one.
            low, start = field.rise(-1, well), field.rise(-1, 0)
            here, slope = field.A(mp.zero), field.slope(well)
            value = of.behind_barrier_term(mp, mp.convert(noise), here, slope, start, low)
            wanted = mp.convert(piece) * mp.convert(2 / noise**2)
            flight = mp.quad(lambda u, A=field.A: 1 / A(u), [0, 1])
            errors.append(abs(wanted - value - flight) / max(value, flight))
    yield shortfall("eq:S", "behind_barrier_term", "from 0", errors, 2, _WEAK)


def _bounds() -> Iterator[Finding]:
    """C-bound and L-bound lie on their sides of the truth."""
    for z0, kappa in (("-0.4", "1"), ("-1", "1/2"), ("-0.1", "1/3")):
        drift, where = sa.friction(3, 1, z0), f"z0 = {z0}, kappa = {kappa}"
        exact = reference_quadrature.exit_probability(drift, Fraction(kappa), _K(10), _K(0), 12)
        with own_context(30) as mp:
            noise, value = mp.convert(Fraction(kappa)), mp.convert(exact)
            bound = of.exit_bound(mp, noise, mp.mpf(10), *Field(drift, mp).ends)
            yield compared("C-bound", "exit_bound", "upper bound", value, bound, where)
    for kappa in ("1/2", "1", "4"):
        exact = reference_quadrature.occupation(sa.linear(1, -1), Fraction(kappa), 12)
        with own_context(30) as mp:
            # V = (u^2 - 1)/2 <= 0 = V(1) on the whole layer, so that L = 2.
            noise, value = mp.convert(Fraction(kappa)), mp.convert(exact)
            bound = of.occupation_bound(mp, noise, mp.one, -mp.one, mp.mpf(2), mp.zero)
            where = f"linear(1, -1), kappa = {kappa}"
            yield compared("L-bound", "occupation_bound", "lower bound", bound, value, where)


_LEADING: dict[str, Callable[[], Iterator[Finding]]] = {
    "well": _well,
    "strong noise": _large,
    "outside": _outside,
    "behind the barrier": _behind,
    "bounds": _bounds,
}
LEADING = tuple(_LEADING)
