"""Uniform and local escape times: constants, orders, honesty, and the coalescences themselves."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from tests.problems import relative
from tests.strategies import ALL, SAMPLE, powers_of_ten, rationals

FOLD = Fraction(-7, 9)
# Beside the fold on both sides, where the barrier meets u = 1, and between.
PLACES = [-2, -1.2, -0.9, -0.78, FOLD, -0.77, -0.7, -0.55, -0.3, -0.05, -1e-3, -1e-6]


def off(drift: sa.Drift, kappa: Any, r: Any, dps: int = 25, **options: Any) -> tuple[float, float]:
    """Relative error of a formula, and what it claims."""
    found = sa.escape_time(drift, kappa, r, dps=dps, full=True, **options)
    exact = sa.escape_time(drift, kappa, r, dps=dps + 5, start=options.get("start", 0))
    return relative(found.value, exact), float(found.error / exact)


@pytest.mark.parametrize(("order", "constant"), [(0, 0.3), (1, 3), (2, 30)])
def test_error_through_fold_and_kink(order: int, constant: float) -> None:
    kappa = np.array([0.05, 0.1, 0.2, 0.3])
    for z0 in PLACES if order == 1 else PLACES[order // 2 :: 2]:
        drift = sa.friction(3, 1, z0)
        exact = sa.escape_time(drift, kappa, 10, log=True)
        found = sa.escape_time(drift, kappa, 10, method="uniform", order=order, log=True, full=True)
        error = np.abs(found.value - exact)
        assert (np.expm1(error) <= constant * kappa ** (2 * order + 2)).all()
        assert (error <= found.error).all()


@pytest.mark.slow
@pytest.mark.parametrize(("order", "constant"), [(0, 0.3), (1, 3), (2, 30)])
def test_error_over_the_whole_crossing_interval(order: int, constant: float) -> None:
    kappa = np.array([0.05, 0.1, 0.2, 0.3])
    beside = [float(FOLD) + x for x in (-1e-12, -1e-15, 0, 1e-15, 1e-12)]
    for z0 in [*np.linspace(-2, -1e-6, 400), *beside]:
        drift = sa.friction(3, 1, float(z0))
        exact = sa.escape_time(drift, kappa, 10, log=True)
        found = sa.escape_time(drift, kappa, 10, method="uniform", order=order, log=True)
        assert (np.abs(np.expm1(found - exact)) <= constant * kappa ** (2 * order + 2)).all()


@pytest.mark.every(3)
@pytest.mark.parametrize("z0", [FOLD, FOLD + Fraction(1, 10**4), "-0.4", "-0.2"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_orders(order: int, z0: Any) -> None:
    """Twice the noise, 2^(2N + 2) times the error; at the fold itself in thirds of powers."""
    drift = sa.friction(3, 1, z0)
    errors = [off(drift, kappa, 10, method="uniform", order=order)[0] for kappa in ("0.02", "0.01")]
    slope = np.log2(float(errors[0] / errors[1]))
    assert slope >= 2 * (order + 1) * 0.95


def test_never_worse_than_the_step() -> None:
    """But where the error of the step formula goes through zero."""
    z0, kappa = np.linspace(-2, -1e-6, 400)[:, None], np.array([0.05, 0.1, 0.2, 0.3])
    drift = sa.friction(3, 1, z0)
    exact = sa.escape_time(drift, kappa, 10, log=True)
    step = sa.escape_time(drift, kappa, 10, method="paper", log=True) - exact
    found = sa.escape_time(drift, kappa, 10, method="uniform", order=0, log=True) - exact
    turns = np.sign(step[1:]) != np.sign(step[:-1])
    beside = np.pad(turns, ((1, 0), (0, 0))) | np.pad(turns, ((0, 1), (0, 0)))
    assert ((np.abs(np.expm1(found)) <= np.abs(np.expm1(step))) | beside).all()
    assert beside.sum() < 30


@pytest.mark.parametrize("beside", ["0", "1e-30", "-1e-30", "1e-12", "-1e-12", "1e-60"])
def test_on_and_beside_the_fold(beside: str) -> None:
    """All digits of the formula itself: it is analytic there, and the distance hardly counts."""
    drift = sa.friction(3, 1, FOLD + Fraction(beside))
    there = sa.escape_time(sa.friction(3, 1, FOLD), "0.1", 10, method="uniform", dps=20)
    found = sa.escape_time(drift, "0.1", 10, method="uniform", dps=20)
    assert relative(found, there) <= 1e-19 + 1e3 * abs(float(beside))
    assert off(drift, "0.1", 10, method="uniform")[0] < 2e-6


@pytest.mark.parametrize("centre", [float(FOLD), -0.72, -0.2])
def test_no_step_in_value_or_slope(centre: float) -> None:
    h = Fraction(1, 10**6)
    values = [
        sa.escape_time(
            sa.friction(3, 1, Fraction(centre) + k * h),
            "0.2",
            10,
            method="uniform",
            dps=25,
            log=True,
        )
        for k in range(-3, 4)
    ]
    second = np.diff(np.array(values), 2)
    # A step of the slope would be one of these, far above the others.
    assert max(abs(second)) <= 3 * min(abs(second)) + 1e-20


def test_downwards_is_the_mirror_image() -> None:
    up, down = sa.polynomial("1/100", 0, 1, "1/3"), sa.polynomial("-1/100", 0, -1, "1/3")
    options: dict[str, Any] = {"method": "uniform", "dps": 20}
    here = sa.escape_time(up, "0.1", 5, start="-1/2", **options)
    assert relative(here, sa.escape_time(down, "0.1", 5, start="1/2", **options)) < 1e-18
    assert off(up, "0.1", 5, method="uniform", start="-1/2")[0] < 1e-3


def test_several_folds_of_an_analytic_drift() -> None:
    drift = sa.Drift("sin(7*u) + 201/200")
    exact = sa.escape_time(drift, 0.1, 4, start=-0.5)
    found = sa.escape_time(drift, 0.1, 4, method="uniform", order=1, start=-0.5, full=True)
    assert abs(found.value - exact) <= found.error < 1e-3 * exact
    assert sum(term.startswith("well and barrier") for term in found.terms) == 2


def test_sliding_and_its_fold() -> None:
    """mu large: a well beside another one that is about to go."""
    drift = sa.friction(8, 1, "0.3")
    error, claim = off(drift, "0.1", 5, dps=15, method="uniform")
    assert error <= claim < 1e-3


@pytest.mark.parametrize("gap", ["1/100", "0", "-1/50"])
def test_fold_beside_the_well_of_a_sliding_region(gap: str) -> None:
    """1 - P of a deep well and a pair about u = 1/5 that is born, or not yet."""
    kappa, fold = "1/10", Fraction(1, 25) - Fraction(gap)
    # -3 (u + 1/2) ((u - 1/5)² - gap), expanded.
    drift = sa.polynomial(
        -fold * Fraction(3, 2),
        3 * (Fraction(1, 5) - fold),
        3 * (Fraction(2, 5) - Fraction(1, 2)),
        -3,
    )
    for complement in (True, False):
        exact = sa.occupation(drift, kappa, complement=complement, dps=60, log=True)
        found = sa.occupation(
            drift,
            kappa,
            complement=complement,
            method="uniform",
            order=3,
            dps=55,
            log=True,
            full=True,
        )
        assert abs(found.value - exact) <= found.error < abs(exact) / 50
    with pytest.raises(sa.InputError, match="one scene at a time"):
        sa.occupation(drift, [0.1], method="uniform")


@pytest.mark.parametrize("gap", ["1/10", "1/100", "1/1000"])
def test_a_barrier_between_two_wells_is_in_one_pair(gap: str) -> None:
    e = Fraction(gap)
    # -3 (u + 1/2)(u - 1/5)(u - 1/5 - e), expanded.
    c, d = Fraction(1, 5), Fraction(1, 5) + e
    half, sum_, product = Fraction(1, 2), c + d, c * d
    drift = sa.polynomial(-3 * half * product, -3 * (product - half * sum_), -3 * (half - sum_), -3)
    error, claim = off(drift, "0.1", 3, dps=20, method="uniform", start="-3/10")
    assert error <= claim < 0.1


@pytest.mark.parametrize(
    ("coefficients", "kappa", "r"),
    [
        (("-0.119", "0.002", "-0.119"), "0.02", 2),
        (("0.12", "-0.098", "0", "0.249", "-0.085"), "0.11", "1/2"),
    ],
)
def test_a_complex_pair_beside_the_start_or_the_end(coefficients: Any, kappa: Any, r: Any) -> None:
    """Once claimed 1e-4 of the true error: Airy functions take the whole line."""
    for order in (0, 1, 2):
        error, claim = off(sa.polynomial(*coefficients), kappa, r, method="uniform", order=order)
        assert error <= claim


def check_random(scene: Any, order: int) -> None:
    coefficients, level, kappa, r, share = scene
    drift = sa.polynomial(level, *coefficients)
    options = {"order": order, "start": share * r, "method": "uniform"}
    try:
        error, claim = off(drift, kappa, r, dps=16, **options)
    except sa.SymasymError:
        return
    assert error <= claim * 1.001


scenes = st.tuples(
    st.lists(rationals(-3, 3), min_size=2, max_size=4),
    rationals(-0.3, 0.3),
    powers_of_ten(-1.7, -0.5),
    st.sampled_from([Fraction(1, 2), Fraction(2), Fraction(8)]),
    st.sampled_from([Fraction(0), Fraction(1, 3), Fraction(-3, 4)]),
)


@SAMPLE
@given(scenes, st.integers(0, 2))
def test_random_scenes_sample(scene: Any, order: int) -> None:
    check_random(scene, order)


@pytest.mark.slow
def test_random_scenes() -> None:
    ALL(given(scenes, st.integers(0, 4))(check_random))()


def test_arrays_are_their_scenes() -> None:
    z0, kappa = np.array([[-1.0], [-0.5]]), np.array([0.08, 0.12])
    many = sa.escape_time(sa.friction(3, 1, z0), kappa, 10, method="uniform", order=1, full=True)
    assert many.value.shape == many.error.shape == (2, 2)
    for i, j in ((0, 0), (0, 1), (1, 0), (1, 1)):
        one = sa.friction(3, 1, float(z0[i, 0]))
        alone = sa.escape_time(one, kappa[j], 10, method="uniform", order=1, full=True)
        assert many.value[i, j] == pytest.approx(alone.value, rel=1e-13)
        assert many.error[i, j] == pytest.approx(alone.error, rel=1e-2)


def test_local_is_good_at_the_fold_alone() -> None:
    for z0, most in ((FOLD, 1e-3), ("-0.79", 1e-3), ("-0.4", 1)):
        error, claim = off(sa.friction(3, 1, z0), "0.1", 10, method="local")
        assert error <= claim
        assert error <= most


@pytest.mark.parametrize("r", [1, 1.1])
@pytest.mark.parametrize("kappa", [0.5, 0.79, 1.0])
def test_an_end_whose_series_is_of_no_use_counts_in_the_error(r: float, kappa: float) -> None:
    """At -1 phi' is 7,000 and phi 1.6; leaving there is e^{-2 lam} of leaving over the barrier."""
    drift = sa.friction(5800.85, 0.59, 0.00017)
    found = sa.escape_time(drift, kappa, r, method="uniform", order=1, log=True, full=True)
    exact = sa.escape_time(drift, kappa, r, log=True)
    assert abs(found.value - exact) <= found.error < 20 * abs(found.value - exact)


def test_local_has_no_time_that_is_not_positive() -> None:
    drift, options = sa.polynomial(-0.1, 1.6, 3.44, -0.316), {"start": 0.3, "method": "local"}
    with pytest.raises(sa.AccuracyError, match="gives T no sign; use method='uniform'"):
        sa.escape_time(drift, 0.016, 1.5, **options)
    found = sa.escape_time(drift, [0.016, 0.1], 1.5, errors="nan", log=True, **options)
    assert np.isnan(found).tolist() == [True, False]


def test_bad_input() -> None:
    drift = sa.friction(3, 1, "-0.5")
    with pytest.raises(sa.InputError, match="order is 7"):
        sa.escape_time(drift, "0.1", 10, method="uniform", order=7)
    with pytest.raises(sa.InputError, match="order is 1, but method 'local'"):
        sa.escape_time(drift, "0.1", 10, method="local", order=1)
    with pytest.raises(sa.AccuracyError, match="kappa is 5, where the noise is too strong"):
        sa.escape_time(drift, 5, 10, method="uniform")
    with pytest.raises(sa.AccuracyError, match="double zero at u = 0.3"):
        sa.escape_time(sa.Drift("(u-3/10)**2*exp(u)"), "0.1", 4, method="uniform")
    for power in (2, 3):
        drift = sa.Drift(f"(u-1/5)**{power}*(3-u)")
        with pytest.raises(sa.InputError, match="multiple zero at the start, u = 0.2"):
            sa.escape_time(drift, "0.01", 4, start="1/5", method="uniform", order=power)


# -- the multiplier --------------------------------------------------------------------------------


def test_multiplier() -> None:
    z0 = np.linspace(-1.1, -0.45, 14)
    drift = sa.friction(3, 1, z0)
    for method in ("local", "uniform"):
        found = sa.stokes_multiplier(drift, 0.1, method=method)
        assert (np.diff(found) > 0).all()
        assert found[0] < 1e-5
        assert found[-1] > 1 - 1e-5
    step = sa.stokes_multiplier(drift, 0.1, method="step")
    assert step.tolist() == (z0 > float(FOLD)).astype(float).tolist()
    for method in ("step", "local", "uniform"):
        assert sa.stokes_multiplier(sa.friction(3, 1, FOLD), "0.1", method=method, dps=30) == 0.5


def test_multiplier_s_width_is_a_power_of_lam() -> None:
    """The same value where the distance is lam^(-2/3) times as large."""
    near = [
        sa.stokes_multiplier(
            sa.friction(3, 1, FOLD + Fraction(1, 1000 * 16**k)),
            Fraction(1, 100 * 8**k),
            method="local",
        )
        for k in range(2)
    ]
    assert near[0] == pytest.approx(near[1], rel=1e-12)
    assert 0.5 < near[0] < 1


def test_multiplier_times_leading_term_is_the_exponential_part() -> None:
    """Against DLMF 9.11.4's integral, in place of Airy functions."""
    ctx = mpmath.mp.clone()
    ctx.dps = 20
    drift, lam = sa.polynomial("-1/50", 0, 1), ctx.mpf(2) / ctx.mpf("0.2") ** 2

    def squares(z: Any) -> Any:
        return ctx.quad(lambda t: ctx.exp(z * t * t - t**6 / 12) * 2, [0, 1, 2, 3, 4]) / ctx.pi**1.5

    z = ctx.cbrt(lam) ** 2 / 50
    found = sa.stokes_multiplier(drift, "0.2", dps=15)
    assert abs(found - squares(z) / (squares(z) + squares(-z))) < 1e-13


def test_multiplier_bad_input() -> None:
    with pytest.raises(sa.InputError, match="no turning point"):
        sa.stokes_multiplier(sa.linear(1, 2), "0.1")
    with pytest.raises(sa.InputError, match="method is 'smooth'"):
        sa.stokes_multiplier(sa.friction(3, 1, "-0.7"), "0.1", method="smooth")
    with pytest.raises(sa.InputError, match="kappa"):
        sa.stokes_multiplier(sa.friction(3, 1, "-0.7"), 0)


@pytest.mark.parametrize("dps", [None, 25])
def test_the_logarithm_of_p_next_to_one(dps: int | None) -> None:
    """P = 1 - 1e-81 has a logarithm with digits and an error of its own."""
    with mpmath.workdps(120):
        q = 1 / mpmath.mpf("0.075") ** 2
        outside = mpmath.exp(-q) / q / (mpmath.sqrt(mpmath.pi / q) * mpmath.erf(mpmath.sqrt(q)))
        log = -mpmath.log1p(outside)
        for order in (0, 1):
            found = sa.occupation(
                sa.linear(1, -1), "0.075", method="uniform", order=order, log=True, dps=dps,
                full=True,
            )  # fmt: skip
            off = abs(mpmath.mpf(found.value) - log)
            assert off <= found.error < abs(log) * 1e-12
