"""Bounds, Laplace's method and the paper's bound for the exit probability."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings

import symasym as sa
from symasym.asymptotics.proofs.layer_bounds import layer_of
from symasym.numbers.balls import exact_ball, precision
from symasym.workshop import reference_quadrature
from tests.problems import PROBLEMS, Problem, constant_drift, distance, relative
from tests.strategies import ALL, SAMPLE, scenes

FRICTION = sa.friction(3, 1, "-0.3")
BOUND: dict[str, Any] = {"method": "bound"}
LAPLACE: dict[str, Any] = {"method": "laplace"}


# -- never violated ------------------------------------------------------------------------------


def check_both(drift: sa.Drift, kappa: Any, r: Any, start: Any) -> list[float]:
    """Both methods and both sides against the exact value; claimed over true error of bounds."""
    tightness = []
    for complement in (False, True):
        scene: dict[str, Any] = {"r": r, "start": start, "complement": complement, "log": True}
        try:
            exact = sa.exit_probability(drift, kappa, **scene, dps=60)
        except sa.SymasymError:
            return []
        for options in (BOUND, {**LAPLACE, "order": 0}, {**LAPLACE, "order": 3}):
            try:
                found = sa.exit_probability(drift, kappa, **scene, **options, dps=20, full=True)
            except sa.SymasymError:
                continue
            wrong = distance(found.value, exact)
            assert wrong <= found.error, (options, found)
            if options is BOUND:
                assert found.error_kind == "bound"
                if wrong:
                    tightness.append(float(found.error / wrong))
            else:
                assert found.error_kind == "estimate"
    return tightness


@pytest.mark.every(4)
@pytest.mark.parametrize(
    "problem", [p for p in PROBLEMS if not p.tags & {"slow", "refused", "narrow"}], ids=str
)
def test_holds_on_the_table(problem: Problem) -> None:
    check_both(problem.make(), problem.kappa, problem.r, problem.start)
    check_both(problem.make(), "1/4", problem.r, problem.start)


@settings(SAMPLE, max_examples=20)
@given(scenes(weakest=-2))
def test_random_scenes_sample(scene: Any) -> None:
    check_both(*scene)


@pytest.mark.slow
@ALL
@given(scenes(weakest=-3))
def test_random_scenes(scene: Any) -> None:
    check_both(*scene)


def test_floats_hold() -> None:
    z0 = np.linspace(-1.9, 3.9, 15)
    kappa = np.geomspace(0.05, 50, 9)[:, None]
    drift = sa.friction(3, 1, z0)
    for complement in (False, True):
        given_: dict[str, Any] = {"start": 0.25, "complement": complement, "log": True}
        exact = sa.exit_probability(drift, kappa, 6, **given_, full=True)
        found = sa.exit_probability(drift, kappa, 6, **given_, **BOUND, full=True)
        assert (np.abs(found.value - exact.value) <= found.error + exact.error).all()
        for i, j in ((0, 3), (4, 7), (8, 14)):
            one = sa.exit_probability(
                sa.friction(3, 1, z0[j]), kappa[i, 0], 6, **given_, **BOUND, full=True, dps=20
            )
            if one.error > 1e-6:
                assert relative(float(found.error[i, j]), one.error) < 0.02


@pytest.mark.parametrize("count", [3, 40])
def test_few_scenes_and_many_of_a_drift_hold(count: int) -> None:
    """Few are bounded in balls, many in intervals of float64; also where a window is too wide."""
    drift, kappa = sa.friction(3, 1, "0.171"), np.geomspace(0.04, 0.4, count)
    found = sa.exit_probability(drift, kappa, 6, start=0.25, **BOUND, log=True, full=True)
    for k, value, error in zip(kappa, found.value, found.error, strict=True):
        exact = sa.exit_probability(drift, k, 6, start=0.25, log=True, dps=30)
        assert abs(exact - mpmath.mpf(value)) <= error < 1e-3 * abs(exact)


# -- they close ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drift", "r", "start"),
    [
        (FRICTION, 10, "0"),  # a barrier
        (FRICTION, 10, "0.95"),  # the start
        (sa.linear(1, -1), 4, "1/2"),  # both ends at r
        (sa.tanh(2, 1, 3), "1/2", "1/5"),  # absorbed inside the layer
        (sa.polynomial("1/5", 2, 0, -3), 3, "-1/4"),
    ],
)
def test_they_close_as_kappa_squared(drift: sa.Drift, r: Any, start: str) -> None:
    widths = [
        sa.exit_probability(drift, k, r, start=start, **BOUND, log=True, dps=60, full=True).error
        for k in ("1e-2", "1e-3", "1e-6")
    ]
    assert widths[0] < 0.05
    with mpmath.workdps(20):
        # Down to the rounding of log C, which may be of 1e12 and more.
        assert widths[1] <= widths[0] / 97 + mpmath.mpf("1e-50")
        assert widths[2] <= widths[0] / 97e6 + mpmath.mpf("1e-42")


def test_they_do_not_open_with_r() -> None:
    """In a crossing region C falls like e^{-lam a- r}, and the ratio of the bounds stays."""
    errors = [
        sa.exit_probability(FRICTION, "0.2", r, **BOUND, log=True, full=True, dps=60).error
        for r in ("10", "1e3", "1e20")
    ]
    assert relative(errors[1], errors[0]) < 1e-6
    assert relative(errors[2], errors[0]) < 1e-6


def test_constant_drift() -> None:
    closed = constant_drift("23.02585")["C"]
    drift = sa.linear("23.02585", "23.02585")
    with mpmath.workdps(150):
        wanted = mpmath.log(closed(mpmath.mp, *(mpmath.mpf(x) for x in ("1e-4", "0.5", "0"))))
    assert wanted < -1e9
    for options in (BOUND, LAPLACE):
        found = sa.exit_probability(drift, "1e-4", "0.5", **options, log=True, dps=30, full=True)
        assert distance(found.value, wanted) <= found.error < 1e-9


def test_layer_against_plain_quadrature() -> None:
    wanted = reference_quadrature.exit_probability(
        FRICTION, Fraction(2, 5), Fraction(2), Fraction(1, 5), 15
    )
    found = sa.exit_probability(FRICTION, "2/5", 2, start="1/5", **BOUND, full=True, dps=20)
    assert distance(found.value, wanted) <= found.error < 0.02 * found.value
    with precision(128):
        layer = layer_of(FRICTION, False, Fraction(-1), Fraction(1))
        # V(1), less V(-1) = 0, is -2 c0 - 2 c2/3.
        assert layer.end.contains(exact_ball(Fraction(-26, 10)))
        kinds = [type(r.peak).__name__ for r in layer.segments if r.peak]
    assert kinds == ["Edge", "Barrier"]


# -- Laplace -------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0, 1, 2, 3])
def test_order_of_laplace(order: int) -> None:
    errors = []
    for kappa in ("1e-3", "1e-4"):
        found = sa.exit_probability(FRICTION, kappa, 10, **LAPLACE, order=order, log=True, dps=80)
        exact = sa.exit_probability(FRICTION, kappa, 10, log=True, dps=80)
        errors.append(distance(found, exact))
    with mpmath.workdps(20):
        measured = mpmath.log10(errors[0] / errors[1]) / 2
    assert float(measured) == pytest.approx(order + 1, rel=0.03)


def test_laplace_from_a_barrier_and_from_a_well() -> None:
    """Start exactly on a critical point: half a Gaussian on each side."""
    repelling = sa.polynomial("1/2", "3/2")  # V = -(3/4)(u + 1/3)^2 + const
    found = sa.exit_probability(repelling, "1e-3", 3, start="-1/3", **LAPLACE, dps=20, full=True)
    assert abs(found.value - 0.5) <= found.error < 1e-15
    uneven = sa.polynomial("1/2", "3/2", "1/3", "-1/4").bind()
    assert uneven.region == "repelling sliding"
    root = "0"
    for k in ("1e-2", "1e-3"):
        found = sa.exit_probability(
            uneven, k, 3, start=root, **LAPLACE, log=True, dps=20, full=True
        )
        exact = sa.exit_probability(uneven, k, 3, start=root, log=True, dps=40)
        assert distance(found.value, exact) <= found.error


def test_laplace_of_arrays() -> None:
    drift = sa.friction(3, 1, np.array([-1.5, -0.3, 0.5]))
    kappa = np.array([[0.01], [0.1]])
    found = sa.exit_probability(drift, kappa, 4, **LAPLACE, order=0, log=True, full=True)
    exact = sa.exit_probability(drift, kappa, 4, log=True)
    assert (np.abs(found.value - exact) <= found.error + 2e-15 * np.abs(exact)).all()
    one = sa.exit_probability(sa.friction(3, 1, "-0.3"), 0.1, 4, **LAPLACE, order=0, log=True)
    assert found.value[1, 1] == pytest.approx(one, rel=1e-14)


# -- the paper's bound ---------------------------------------------------------------------------


def test_the_paper_s_bound() -> None:
    for kappa in ("0.2", "1", "3"):
        found = sa.exit_probability(FRICTION, kappa, 12, method="paper", full=True, dps=30)
        am, ap, k2 = mpmath.mpf("2.3"), mpmath.mpf("0.3"), mpmath.mpf(kappa) ** 2
        with mpmath.workdps(40):
            am, ap = mpmath.mpf(23) / 10, mpmath.mpf(3) / 10
            k2 = (mpmath.mpf(Fraction(kappa).numerator) / Fraction(kappa).denominator) ** 2
            printed = 2 * am * (1 / ap + 2 / k2) * mpmath.exp(-12 * am / k2)
        assert relative(found.value, printed) < 1e-29
        exact = sa.exit_probability(FRICTION, kappa, 12, dps=30)
        assert 0 < exact < found.value
        assert found.error_kind == "bound"
        assert distance(found.value, exact) <= found.error
        log = sa.exit_probability(FRICTION, kappa, 12, method="paper", full=True, log=True)
        assert log.error is None
        assert log.error_kind == "none"
        mirror = sa.polynomial("-1.3", -4, 0, 3)
        other = sa.exit_probability(mirror, kappa, 12, method="paper", complement=True, dps=30)
        assert relative(other, found.value) < 1e-29
    some = sa.exit_probability(FRICTION, [1.0, 2.0], 12, method="paper", full=True)
    assert some.value[0] == pytest.approx(
        sa.exit_probability(FRICTION, 1, 12, method="paper"), rel=1e-14
    )
    assert (some.error >= some.value).all()


def test_where_the_paper_s_bound_would_be_wrong() -> None:
    """The erratum's counterexample: V_max <= r/4 as printed, but not <= a- r/4."""
    steep = sa.Drift("3*(u + 19/20)*(u - 3/5)")
    k, r = Fraction(1, 5), 10
    exact = sa.exit_probability(steep, k, r, log=True)
    am, ap = (float(a) for a in steep.ends)
    assert exact > np.log(2 * am * (1 / ap + 2 / float(k) ** 2)) - r * am / float(k) ** 2
    for kappa in (k, [0.2, 0.3]):
        with pytest.raises(sa.InputError, match=r"V reaches .*a- r/4"):
            sa.exit_probability(steep, kappa, r, method="paper")


@pytest.mark.parametrize(
    ("drift", "options", "match"),
    [
        (FRICTION, {"r": 3}, "r is 3"),
        (FRICTION, {"start": "1/4"}, "start is 0.25"),
        (FRICTION, {"complement": True}, "1 - C"),
        (sa.linear(1, -1), {}, "not both positive"),
        (FRICTION, {"kappa": 10}, "below 4"),
        (FRICTION, {"order": 1}, "no order"),
    ],
)
def test_where_the_paper_has_no_bound(drift: sa.Drift, options: Any, match: str) -> None:
    scene: dict[str, Any] = {"kappa": "0.5", "r": 10, **options}
    with pytest.raises(sa.InputError, match=match):
        sa.exit_probability(drift, **scene, method="paper")


# -- refusals ------------------------------------------------------------------------------------


def test_refusals() -> None:
    near_edge = sa.friction(3, 1, "-1e-9")  # the barrier is 1e-10 away from the layer's end
    for kappa in ("1e-5", [1e-5]):
        with pytest.raises(sa.AccuracyError, match=r"kappa is 1e-05.*factor 3.*exact"):
            sa.exit_probability(near_edge, kappa, 10, **BOUND, log=True)
    with pytest.raises(sa.AccuracyError, match=r"too strong.*order=2"):
        sa.exit_probability(FRICTION, 3, 10, **LAPLACE)
    with pytest.raises(sa.InputError, match="tangency"):
        sa.exit_probability(sa.friction(3, 1, 0), "0.1", 10, **LAPLACE)
    for order in (-1, 21, 0.5):
        with pytest.raises(sa.InputError, match="order is .*0 to 20"):
            sa.exit_probability(FRICTION, "0.1", 10, **LAPLACE, order=order)
    with pytest.raises(sa.InputError, match="no order"):
        sa.exit_probability(FRICTION, "0.1", 10, **BOUND, order=1)
    with pytest.raises(sa.InputError, match="start"):
        sa.exit_probability(FRICTION, "0.1", 10, **BOUND, start=11)
