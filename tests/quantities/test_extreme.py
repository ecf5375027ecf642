"""The ends of the ranges: right digits, or a sentence that says why there are none."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from tests.problems import FOLD, distance, logarithm, relative

# -- constant drift over 600 decades -------------------------------------------------------------


def decades() -> list[tuple[int, int, int]]:
    """Exponents of a, r and kappa such that T = (r/a) tanh(a r/kappa^2) spans 1e-300 to 1e300."""
    found = []
    for a in range(-150, 151, 50):
        for r in (-140, -40, 0, 12, 90, 150):
            # a r/kappa^2 is 10^x, or ten times that where kappa would not be a power of ten
            for x in (-200, -30, -1, 0, 1, 4, 9):
                found.append((a, r, (a + r - x) // 2))
    # kappa and 2 |A|/kappa^2 have to fit float64
    return [(a, r, k) for a, r, k in found[::3] if abs(k) <= 140 and abs(a - 2 * k) <= 280]


def closed(a: int, r: int, k: int, dps: int = 40) -> tuple[Any, Any, Any]:
    """T, log C and log(1 - C) of the drift 10^a, by elementary integration."""
    mp = mpmath.MPContext()
    mp.dps = dps
    power = mp.mpf(10)
    x = power ** (a + r - 2 * k)
    T = power ** (r - a) * mp.tanh(x)
    shrink = mp.exp(-2 * x)
    return T, -2 * x - mp.log1p(shrink), -mp.log1p(shrink)


def test_constant_drift_over_600_decades_float64() -> None:
    scenes = decades()
    logs = []
    for a, r, k in scenes:
        T, log_C, log_rest = closed(a, r, k)
        drift, scene = sa.polynomial(f"1e{a}"), (f"1e{k}", f"1e{r}")
        wanted = [logarithm(T), log_C, log_rest]
        for verb, options, log in (
            (sa.escape_time, {}, wanted[0]),
            (sa.exit_probability, {}, wanted[1]),
            (sa.exit_probability, {"complement": True}, wanted[2]),
        ):
            found = verb(drift, *scene, log=True, **options)
            assert distance(found, log) <= 1e-12 * max(1, abs(log)), (a, r, k, options)
        logs.append(float(wanted[0]) / np.log(10))
    assert min(logs) < -290
    assert max(logs) > 290


# -- fold and kink, ever closer --------------------------------------------------------------------


@pytest.mark.parametrize("place", [FOLD, F(0)], ids=["fold", "kink"])
@pytest.mark.parametrize("kappa", ["0.1", "1e-3"])
def test_values_are_continuous_through_fold_and_kink(place: F, kappa: str) -> None:
    at = sa.escape_time(sa.friction(3, 1, place), kappa, 10, dps=60, log=True)
    for gap in ("1e-15", "1e-20", "1e-30"):
        sides = [
            sa.escape_time(sa.friction(3, 1, place + s * F(gap)), kappa, 10, dps=60, log=True)
            for s in (-1, 1)
        ]
        with mpmath.workdps(60):
            before, after = (side - at for side in sides)
            # d log T/d z0 is at most lam dV/dz0, and V changes by z0 times the distance
            most = F(gap) * 40 / F(kappa) ** 2
            assert before * after < 0
            assert max(abs(before), abs(after)) <= float(most)
            # and log T is smooth there, so that the gap's square is all that the sum keeps
            assert abs(before + after) <= 1e-3 * abs(before)
        for s, side in zip((-1, 1), sides, strict=True):
            exactly = sa.escape_time(sa.friction(3, 1, place + s * F(gap)), kappa, 10, log=True)
            assert distance(exactly, side) <= 1e-12 * max(1, abs(side))


@pytest.mark.parametrize(("gap", "kappa"), [("1e-15", "3e-8"), ("1e-30", "1e-15")])
def test_exact_strings_make_a_difference_where_it_matters(gap: str, kappa: str) -> None:
    # lam * gap is about 2: a factor of e or so between two z0 that are neighbours in float64,
    # or the same float64
    drifts = [sa.friction(3, 1, z) for z in ("-0.3", F("-0.3") + F(gap))]
    logs = [sa.escape_time(d, kappa, 10, dps=60, log=True) for d in drifts]
    with mpmath.workdps(60):
        assert 0.1 < abs(logs[1] - logs[0]) < 10
    for drift, log in zip(drifts, logs, strict=True):
        found = sa.escape_time(drift, kappa, 10, log=True)
        assert distance(found, log) <= 1e-12 * abs(log)


@pytest.mark.parametrize("log", [False, True])
def test_places_that_are_equal_in_float64_alone(log: bool) -> None:
    """1e-20 from an end, where the density 200 is that of a drift of 100."""
    edge, drift = f"0.{'9' * 20}", sa.Drift(100, layer=None)
    within: Any = {"ends": (-1, 1), "complement": True, "log": log}
    for found in (
        sa.occupation(drift, 1, interval=(0, edge), **within),
        sa.occupation(drift, [1.0, 2.0], interval=(0, edge), **within)[0],
        sa.exit_probability(drift, 1, start=f"-{edge}", **within),
    ):
        assert found == pytest.approx(np.log(2e-18) if log else 2e-18, rel=1e-12)


# -- symmetric extremes ----------------------------------------------------------------------------


@pytest.mark.parametrize("kappa", ["1e-8", "1e-4", "0.01", "1", "1e4", "1e8"])
def test_odd_drifts_leave_through_either_end(kappa: str) -> None:
    odd = [sa.linear(1, -1), sa.linear(-3, 3), sa.friction(3, 1, 1), sa.friction("1e8", 2, 1)]
    for drift in odd:
        assert sa.exit_probability(drift, kappa, 5, dps=30) == 0.5
        assert sa.exit_probability(drift, kappa, 5, log=True) == pytest.approx(
            -np.log(2), abs=1e-12
        )


# -- layers thinner than rounding ----------------------------------------------------------------


@pytest.mark.parametrize("kappa", ["1e-20"])
@pytest.mark.parametrize(("high", "steepness"), [("1", "1.4"), ("2", "3")])
def test_a_well_far_thinner_than_rounding(kappa: str, high: str, steepness: str) -> None:
    # phi = -h tanh(s u)/tanh(s), V = h log cosh(s u)/(s tanh(s)): log T = lam max V, all else far
    # below rounding.
    drift = sa.tanh(high, f"-{high}", steepness)
    with mpmath.workdps(40):
        h, s, k = (mpmath.mpf(x) for x in (high, steepness, kappa))
        lam = 2 / k**2
        edge = h * mpmath.log(mpmath.cosh(s)) / (s * mpmath.tanh(s))
        wanted = {"T": lam * (edge + h), "1 - P": -lam * edge, "p_ss": -lam * (edge + h / 2)}
    found = {
        "T": sa.escape_time(drift, kappa, 2, log=True),
        "1 - P": sa.occupation(drift, kappa, complement=True, log=True),
        "p_ss": sa.stationary_density(drift, kappa, "1.5", log=True),
    }
    for name, value in found.items():
        assert distance(value, wanted[name]) <= 1e-12 * abs(wanted[name]), name
    assert sa.occupation(drift, kappa, log=True) == 0.0


@pytest.mark.parametrize(
    ("drift", "kappa"),
    [
        (sa.tanh(1, -1, "1.4"), "1e-11"),
        (sa.sine(1, -1, "0.3", waves=2), "1e-9"),
        (sa.sine(1, -1, "0.3", waves=2), "1e-12"),
    ],
)
@pytest.mark.parametrize("complement", [False, True])
def test_two_exits_that_are_equally_far(drift: sa.Drift, kappa: str, complement: bool) -> None:
    # A is odd: C = 1/2. The heights, some 1e20, are known to 1e4 in float64.
    share = sa.exit_probability(drift, kappa, 2, complement=complement)
    assert share == pytest.approx(0.5, rel=1e-12)


@pytest.mark.slow
def test_a_sigmoid_is_constant_beside_its_steep_part() -> None:
    # In the limit phi = -sign(u), by elementary integration from 0: T = (e^{lam r} - 1)/lam - r.
    time = sa.escape_time(sa.tanh(1, -1, "1e30"), "0.1", 2, dps=25)
    with mpmath.workdps(40):
        assert relative(time, mpmath.expm1(400) / 200 - 2) < 1e-24
    inside = sa.occupation(sa.tanh(1, -1, "1e30"), 2, dps=25)
    with mpmath.workdps(40):
        assert relative(inside, -mpmath.expm1(-mpmath.mpf(1) / 2)) < 1e-24


@pytest.mark.parametrize("method", ["exact", "laplace"])
@pytest.mark.parametrize(("c", "k", "r"), [(40, 2, 2), (40, 2, 10**30), (0, 25, 10**60)])
def test_exponents_of_more_digits_than_are_asked_for(method: Any, c: int, k: int, r: int) -> None:
    # V = 10^c (e^u - u - 1), straight on beyond u = -1 and 1. With one part in lam 10^c the first
    # terms of Laplace's method at the well and at both ends are T and C.
    drift, ask = sa.Drift(f"10**{c}*(1 - exp(u))"), {"dps": 20, "full": True, "method": method}
    kappa = F(1, 10**k)
    times = sa.escape_time(drift, kappa, r, **ask)
    share = sa.exit_probability(drift, kappa, r, log=True, **ask)
    with mpmath.workdps(200):
        size, e = mpmath.mpf(10) ** c, mpmath.e
        lam = 2 * mpmath.mpf(10) ** (2 * k)
        left = (1 / e + (1 - 1 / e) * (r - 1)) * size
        right = (e - 2 + (e - 1) * (r - 1)) * size
        time = mpmath.sqrt(2 * mpmath.pi / (lam * size)) * mpmath.exp(lam * left)
        time /= size * (1 - 1 / e)
        assert abs(times.value - time) <= times.error <= 1e-19 * time
        # The slopes of V at the ends are e - 1 and 1 - 1/e.
        wanted = mpmath.exp(lam * (left - right)) * e
        assert abs(share.value + wanted) <= abs(share.error)


@pytest.mark.parametrize("c", [2**12, 2**40, 2**63])
@pytest.mark.parametrize("layer", [(-1, 1), None])
def test_a_drift_beyond_the_domain_is_refused(c: int, layer: Any) -> None:
    """Not by running out of memory."""
    with pytest.raises(sa.SymasymError):
        sa.escape_time(sa.Drift("exp(-c*u) - 1/2", layer=layer).bind(c=c), 1, 2)
