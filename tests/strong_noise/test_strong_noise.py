"""Strong noise: the expansions against proved values, closed forms, plain quadrature and order."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.strong_noise import arrays as strong_noise_double
from symasym.asymptotics.strong_noise.sweep import moments
from symasym.drift.field.float_field import field_of
from symasym.numbers import balls
from symasym.workshop import reference_quadrature
from tests.asking import exact_value
from tests.problems import PROBLEMS, Problem, constant_drift, distance, linear_sliding, relative
from tests.strategies import ALL, SAMPLE, WHOLE, scenes

STRONG: dict[str, Any] = {"method": "strong_noise"}
FRICTION = sa.friction(3, 1, "-0.3")


# -- honesty -----------------------------------------------------------------------------------


@pytest.mark.every(4)
@pytest.mark.parametrize(
    "problem", [p for p in PROBLEMS if not p.tags & {"slow", "refused", "narrow"}], ids=str
)
@WHOLE
def test_claimed_error_covers_the_true_one(problem: Problem, whole: bool) -> None:
    """At the scene's own noise, which is often refused, and at kappa = 3 and 1000."""
    answers, drift = 0, problem.make()
    own = [] if problem.tags & {"stiff", "extreme"} else [float(Fraction(problem.kappa))]
    arguments = {"r": problem.r, "start": problem.start}
    asked: list[tuple[Any, dict[str, Any]]] = [
        (sa.escape_time, arguments),
        (sa.exit_probability, arguments),
        (sa.exit_probability, {**arguments, "complement": True}),
    ]
    if problem.slides:
        asked += [(sa.occupation, {}), (sa.occupation, {"complement": True})]
    for kappa in (*own, 3.0, 1000.0):
        for verb, given_ in asked:
            if kappa == 1000.0 and "complement" in given_ and not whole:
                continue
            try:
                exact = verb(drift, kappa, **given_, log=True, dps=60)
            except sa.SymasymError:
                continue
            for order in (0, 3, 12) if whole or kappa in own else (0, 12) if kappa == 3 else (3,):
                options = {**given_, **STRONG, "order": order, "log": True, "full": True}
                try:
                    found = verb(drift, kappa, **options, dps=25)
                except sa.SymasymError:
                    continue
                answers += 1
                assert found.error_kind == "bound"
                assert distance(found.value, exact) <= found.error
                try:
                    some = verb(drift, [kappa], **options)
                except sa.AccuracyError:
                    # On the verge itself, or where rounding grows with the layer's exponent.
                    heights = drift.potential_at(np.linspace(-1, 1, 201))
                    assert found.error > 0.3 or 2 / kappa**2 * np.ptp(heights) > 8
                    continue
                assert some.error_kind == "estimate"
                assert distance(float(some.value[0]), exact) <= float(some.error[0])
    assert answers or problem.tags & {"stiff", "refused", "extreme", "may refuse"}


def check_scene(scene: Any, order: int) -> None:
    drift, kappa, r, start = scene
    asked: list[tuple[Any, dict[str, Any]]] = [
        (sa.escape_time, {"r": r, "start": start}),
        (sa.exit_probability, {"r": r, "start": start}),
    ]
    if drift.ends[0] > 0 > drift.ends[1]:
        asked.append((sa.occupation, {}))
    for verb, given_ in asked:
        try:
            found = verb(drift, kappa, **given_, **STRONG, order=order, log=True, dps=20, full=True)
        except sa.AccuracyError:
            continue
        # The logarithm of 1 has as many digits as 1.
        exact = verb(drift, kappa, **given_, log=True, dps=50, full=True)
        assert distance(found.value, exact.value) <= found.error + exact.error


@SAMPLE
@given(scenes(weakest=-0.2), st.integers(0, 9))
def test_random_scenes_sample(scene: Any, order: int) -> None:
    check_scene(scene, order)


@pytest.mark.slow
@ALL
@given(scenes(weakest=-0.5), st.integers(0, 9))
def test_random_scenes(scene: Any, order: int) -> None:
    check_scene(scene, order)


# -- order -------------------------------------------------------------------------------------


def slope(verb: Any, drift: sa.Drift, kappas: list[int], order: int, **given_: Any) -> float:
    """d log(relative error)/d log(lam) between the two noises."""
    errors = []
    for kappa in kappas:
        found = verb(drift, kappa, **given_, **STRONG, order=order, dps=90)
        errors.append(relative(found, exact_value(verb, drift, kappa, **given_, dps=95)))
    with mpmath.workdps(20):
        return float(
            mpmath.log(errors[1] / errors[0]) / (-2 * mpmath.log(mpmath.mpf(kappas[1]) / kappas[0]))
        )


@pytest.mark.parametrize("order", [0, 1, 2, 3, 5, 8])
def test_orders(order: int) -> None:
    kappas, sliding = [300, 3000], sa.polynomial("-1/4", -1, "1/3")
    for verb, drift, scene in (
        (sa.escape_time, FRICTION, {"r": 4, "start": "1/3"}),
        (sa.exit_probability, FRICTION, {"r": 4, "start": "1/3"}),
        (sa.occupation, sliding, {}),
    ):
        assert slope(verb, drift, kappas, order, **scene) == pytest.approx(order + 1, rel=0.03)
    # 1 - P is nearly 1 and gains the factor lam of P.
    measured = slope(sa.occupation, sliding, kappas, order, complement=True)
    assert measured == pytest.approx(order + 2, rel=0.03)


@pytest.mark.parametrize("order", [0, 2, 4])
def test_uniform_in_r_over_kappa_squared(order: int) -> None:
    """The error of order lam^{order + 1} whatever lam r is, from 1e-3 to 1e6."""
    for product in ("1e-3", "1", "1e6"):
        errors = []
        for kappa in (100, 1000):
            r = 1 + Fraction(product) * kappa**2 / 2
            found = sa.escape_time(FRICTION, kappa, r, **STRONG, order=order, dps=70)
            errors.append(
                relative(found, exact_value(sa.escape_time, FRICTION, kappa, r=r, dps=75))
            )
        with mpmath.workdps(20):
            measured = -mpmath.log(errors[1] / errors[0]) / (2 * mpmath.log(10))
        assert measured > 0.97 * (order + 1)


def test_the_paper_s_leading_terms() -> None:
    """eq:Plarge2, and eq:Ttildelarge with the two terms behind it, O(kappa^2) and O(1)."""
    sliding, kappa = sa.linear(2, -1), 10**6
    leading = 4 / ((Fraction(1, 2) + 1) * kappa**2)
    found = sa.occupation(sliding, kappa, **STRONG, order=0, dps=30)
    assert relative(found, mpmath.mpf(leading.numerator) / leading.denominator) < 1e-11
    drift = sa.polynomial(1, "1/2", "1/3")  # a- = 5/6, a+ = 11/6, V(1) = -20/9
    k, am, ap, v1 = 10**3, Fraction(5, 6), Fraction(11, 6), Fraction(-20, 9)
    r = Fraction(k) ** 4
    three = r / ap + Fraction(k**2, 2) * (1 / (am * ap) - 1 / ap**2) + (am + ap + v1) / (am * ap)
    found = sa.escape_time(drift, k, r, **STRONG, order=2, dps=40)
    with mpmath.workdps(40):
        # What is left is O(1/kappa^2).
        assert abs(found - mpmath.mpf(three.numerator) / three.denominator) < 1e-5


# -- against code and formulas that share nothing ----------------------------------------------


def test_constant_drift_is_elementary() -> None:
    """The layer of a constant drift is no different from the rest of space."""
    closed = constant_drift("3/2")
    for kappa in ("3", "1e15"):  # lam down to 2e-30
        for r in ("1e-3", "1/2", "5", "1e30"):
            scene = (kappa, r)
            with mpmath.workdps(160):
                numbers = [
                    mpmath.mpf(Fraction(x).numerator) / Fraction(x).denominator
                    for x in (*scene, "0")
                ]
                time, below = (closed[q](mpmath.mp, *numbers) for q in ("T", "C"))
                log_below = mpmath.log(below)
            drift = sa.polynomial("3/2")
            found = sa.escape_time(drift, *scene, **STRONG, order=20, dps=30, full=True)
            assert distance(found.value, time) <= found.error
            assert relative(found.value, time) < 1e-12
            chance = sa.exit_probability(
                drift, *scene, **STRONG, order=20, log=True, full=True, dps=30
            )
            assert distance(chance.value, log_below) <= chance.error
            assert relative(chance.value, log_below) < 1e-12
            if scene == ("3", "1e30"):
                # e^(3e29) outside the layer: float64 has no digit of it.
                with pytest.raises(sa.AccuracyError, match="an error as large as the value"):
                    sa.escape_time(drift, [3.0], 1e30, **STRONG, order=20)
                continue
            floats = sa.escape_time(drift, [float(kappa)], float(Fraction(r)), **STRONG, order=20)
            assert relative(float(floats[0]), time) < 2e-14


def test_parabola_between_lines() -> None:
    closed = linear_sliding("1")
    for kappa in ("1", "4", "1e8"):
        with mpmath.workdps(60):
            k = mpmath.mpf(kappa)
            known = {q: closed[q](mpmath.mp, k, None, None) for q in ("P", "1-P")}
        for name, complement in (("P", False), ("1-P", True)):
            found = sa.occupation(
                sa.linear(1, -1),
                kappa,
                complement=complement,
                **STRONG,
                order=25,
                dps=20,
                full=True,
            )
            assert distance(found.value, known[name]) <= found.error
            assert relative(found.value, known[name]) < 1e-18


@pytest.mark.parametrize("drift", [FRICTION, sa.tanh(1, "-1/2", 3), sa.hill(-1, 1, "1/2")])
def test_against_plain_quadrature(drift: sa.Drift) -> None:
    kappa, r, start = Fraction(2), Fraction(3), Fraction(-1, 4)
    wanted = reference_quadrature.escape_time(drift, kappa, r, start, 18)
    share = reference_quadrature.exit_probability(drift, kappa, r, start, 18)
    options: dict[str, Any] = {"start": start, **STRONG, "order": 30, "dps": 18}
    assert relative(sa.escape_time(drift, kappa, r, **options), wanted) < 1e-17
    assert relative(sa.exit_probability(drift, kappa, r, **options), share) < 1e-17


@pytest.mark.parametrize("drift", [FRICTION, sa.sine(1, "-1/2", 2, waves=2)])
def test_moments_against_quadrature(drift: sa.Drift) -> None:
    a, b = Fraction(-1, 3), Fraction(4, 5)
    with balls.precision(90):
        found = moments(drift, False, a, b, 4, 90)
    x, w = np.polynomial.legendre.leggauss(24)
    low, half = float(a), float(b - a) / 2
    u = low + half * (x + 1)
    v = drift.potential_at(u)
    begin, end = drift.potential_at(low), drift.potential_at(float(b))
    for k in range(5):
        fact = math.factorial(k)
        assert float(found.int_e[k]) == pytest.approx(
            half * w @ (v - end) ** k / fact, rel=1e-11, abs=1e-13
        )
        assert float(found.int_inverse[k]) == pytest.approx(
            half * w @ (begin - v) ** k / fact, rel=1e-11, abs=1e-13
        )
        inner = []
        for top, height in zip(u, v, strict=True):
            h = (top - low) / 2
            inner.append(h * w @ (drift.potential_at(low + h * (x + 1)) - height) ** k)
        assert float(found.nested[k]) == pytest.approx(
            half * w @ np.array(inner) / fact, rel=1e-11, abs=1e-13
        )
    fine = drift.potential_at(np.linspace(low, float(b), 4001))
    spread = fine.max() - fine.min()
    assert spread <= float(found.spread) <= 1.2 * spread


# -- arrays, options, refusals -----------------------------------------------------------------


def test_arrays_are_the_scalars() -> None:
    z0 = np.linspace(-2.0, 4.0, 7)
    kappa = np.array([[4.0], [30.0]])
    start = np.linspace(-2.5, 2.5, 7)
    drift = sa.friction(3, 1, z0)
    for verb in (sa.escape_time, sa.exit_probability):
        found = verb(drift, kappa, 3, start=start, **STRONG, order=12, full=True)
        assert found.value.shape == (2, 7)
        for i, j in np.ndindex(2, 7):
            one = verb(
                sa.friction(3, 1, z0[j]), kappa[i, 0], 3, start=start[j], **STRONG, order=12, dps=25
            )
            assert relative(float(found.value[i, j]), one) < 3e-14


def test_more_terms_are_better_and_weak_noise_is_refused() -> None:
    errors = [
        sa.escape_time(FRICTION, 1, 5, **STRONG, order=n, dps=30, full=True).error
        for n in (8, 12, 16, 24, 40)
    ]
    assert all(b < a for a, b in zip(errors, errors[1:], strict=False))
    for kappa in ("0.3", [0.3, 3.0]):
        with pytest.raises(sa.AccuracyError, match=r"kappa is 0\.3.*larger order.*exact"):
            sa.escape_time(FRICTION, kappa, 5, **STRONG)
    # The default is order 2.
    assert sa.escape_time(FRICTION, 9, 5, **STRONG, full=True).order == 2
    assert sa.escape_time(FRICTION, 9, 5, **STRONG) == sa.escape_time(
        FRICTION, 9, 5, **STRONG, order=2
    )


@pytest.mark.parametrize("order", [-1, 101, 2.5, True, "optimal"])
def test_absurd_orders(order: Any) -> None:
    with pytest.raises(sa.InputError, match="order is .*whole number from 0 to 100"):
        sa.escape_time(FRICTION, 9, 5, **STRONG, order=order)


def test_regions_and_ranges() -> None:
    with pytest.raises(sa.RegionError, match="sliding"):
        sa.occupation(FRICTION, 9, **STRONG)
    with pytest.raises(sa.InputError, match="start is 5"):
        sa.escape_time(FRICTION, 9, 5, start=5, **STRONG)
    with pytest.raises(sa.InputError, match="kappa is -9"):
        sa.exit_probability(FRICTION, [9, -9], 5, **STRONG)
    many = sa.exit_probability(FRICTION, [9], 5, dps=20, **STRONG)
    assert many[0] == sa.exit_probability(FRICTION, 9, 5, dps=20, **STRONG)
    with pytest.raises(sa.RangeError, match=r"e\^-.*log=True"):
        sa.exit_probability(sa.polynomial(1), 9, 1e6, **STRONG)


def test_ends_of_the_float_stack() -> None:
    """Both ends, not only the larger of the two distances, hold for T, C and 1 - C."""
    rng = np.random.default_rng(3)
    count = 300
    z0, kappa = rng.uniform(-2, 4, count), 10 ** rng.uniform(0.2, 1.5, count)
    r = 10 ** rng.uniform(-0.5, 1.5, count)
    start = r * rng.uniform(-0.95, 0.95, count)
    drift = sa.friction(3, 1, z0)
    field = field_of(drift, {"mu": Fraction(3), "alpha": Fraction(1), "z0": z0}, count)
    numbers = {"kappa": kappa, "r": r, "start": start}
    for quantity, complement, verb in (
        ("T", False, sa.escape_time),
        ("C", False, sa.exit_probability),
        ("C", True, sa.exit_probability),
    ):
        extra = {"complement": True} if complement else {}
        exact = verb(drift, kappa, r, start=start, log=True, **extra)
        for order in (0, 1, 4):
            with np.errstate(all="ignore"):
                found = strong_noise_double._chunk(
                    field, 2 / kappa**2, numbers, quantity, complement, order
                )
            stack = found.log
            slack = found.error + 2e-12 * (1 + np.abs(exact))
            # Not a number: refused, because the expansion itself is negative.
            given_ = np.isfinite(stack[0])
            assert given_.sum() > count / 3
            assert (stack[1] <= exact + slack[1])[given_].all()
            assert (exact <= stack[2] + slack[2])[given_].all()
