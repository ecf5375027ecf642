"""The friction oscillator's drift: the paper's formula, its folds, its breakaway force."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from tests.problems import relative

SMALL = st.fractions(min_value=-4, max_value=4, max_denominator=100)
FORCES = st.fractions(min_value=F(1, 100), max_value=5, max_denominator=100)
SHAPES = st.fractions(min_value=0, max_value=9, max_denominator=100)


def paper(u: F, mu: F, alpha: F, z0: F) -> F:
    """eq:phifric0."""
    return 1 - z0 - alpha * (u + mu * (u - u**3))


@given(SHAPES, FORCES, SMALL, st.fractions(min_value=-1, max_value=1, max_denominator=50))
def test_drift_is_the_papers(mu: F, alpha: F, z0: F, u: F) -> None:
    drift = sa.friction(mu, alpha, z0)
    assert drift.exact_value(u) == paper(u, mu, alpha, z0)
    assert drift.ends == (1 - z0 + alpha, 1 - z0 - alpha)
    assert drift(float(u)) == pytest.approx(float(paper(u, mu, alpha, z0)), abs=1e-12)


@given(SHAPES, FORCES, SMALL)
def test_reversing_the_force_mirrors_the_drift(mu: F, alpha: F, z0: F) -> None:
    drift, mirrored = sa.friction(mu, alpha, z0), sa.friction(mu, alpha, 2 - z0)
    for u in (F(-1), F(-1, 3), F(0), F(4, 5)):
        assert mirrored.exact_value(u) == -drift.exact_value(-u)


@pytest.mark.parametrize("mu", ["0.6", "1", "3", "50", "1e8"])
@pytest.mark.parametrize("alpha", ["1e-8", "1", "7/3", "1e8"])
def test_folds_are_double_zeros(mu: str, alpha: str) -> None:
    drift = sa.friction(mu, alpha)
    folds = drift.folds()
    for u, z0, sign in zip(folds.u, folds.z0, (1, -1), strict=True):
        assert np.sign(u) == sign
        here = sa.friction(mu, alpha, z0)
        scale = float(F(alpha)) * (1 + float(F(mu))) + abs(1 - z0)
        assert abs(here(u)) <= 1e-14 * scale + 1e-15  # z0 itself is rounded
        h = 1e-6
        assert abs(here(u + h) - here(u - h)) / (2 * h) <= 1e-7 * scale + 1e-9
    assert folds.u[0] == drift.turning_points()
    assert folds.z0 == pytest.approx((1 - drift.beta(), 1 + drift.beta()))


@pytest.mark.parametrize(("mu", "peak"), [(3, F(16, 9)), (F(25, 2), F(27, 5)), (F(12, 13), None)])
def test_breakaway_force_in_closed_form(mu: Any, peak: F | None) -> None:
    # the friction force's largest value, 2 (1+mu)^(3/2)/(3 sqrt(3 mu)), squared is rational
    square = 4 * (1 + F(mu)) ** 3 / (27 * F(mu))
    for alpha in (F(1), F(5, 2)):
        found = sa.friction(mu, alpha).beta()
        assert F(found) ** 2 == pytest.approx(square * alpha**2, rel=1e-14)
        if peak:
            assert found == pytest.approx(float(peak * alpha), rel=1e-15)


@given(SHAPES, FORCES)
def test_breakaway_force_is_the_largest(mu: F, alpha: F) -> None:
    u = np.linspace(-1, 1, 4001)
    force = float(alpha) * (u + float(mu) * (u - u**3))
    assert sa.friction(mu, alpha).beta() >= force.max() * (1 - 1e-14)
    assert sa.friction(mu, alpha).beta() == pytest.approx(force.max(), rel=1e-5)


@pytest.mark.parametrize("mu", ["0", "0.3", "0.5"])
def test_without_overshoot_there_is_no_fold(mu: str) -> None:
    drift = sa.friction(mu, 2)
    assert np.isnan(drift.turning_points())
    assert np.isnan([*drift.folds().u, *drift.folds().z0]).all()
    assert drift.beta() == 2


@pytest.mark.parametrize("gap", ["1e-4", "1e-9", "1e-15", "1e-20"])
def test_just_above_one_half_the_fold_is_at_the_edge(gap: str) -> None:
    # turning point sqrt((1+mu)/(3 mu)) is 1 - 2 gap/3 + ...
    drift = sa.friction(F(1, 2) + F(gap), 1)
    assert drift.beta() == pytest.approx(1, abs=1e-7)
    if F(gap) > F(1, 10**12):
        u = drift.turning_points()
        assert u < 1
        assert 1 - u == pytest.approx(float(2 * F(gap) / 3), rel=1e-3)


def test_arrays_of_shapes() -> None:
    drift = sa.friction(mu=[[0.2], [3.0]], alpha=[1.0, 2.0, 4.0])
    assert drift.beta() == pytest.approx(np.outer([1, 16 / 9], [1, 2, 4]))
    points = drift.turning_points()
    assert np.isnan(points[0]).all()
    assert points[1] == pytest.approx(2 / 3)
    assert np.shape(drift.folds().z0[0]) == (2, 3)


@pytest.mark.parametrize("gap", ["1e-3", "1e-15", "1e-30"])
def test_regions_change_at_the_edges(gap: str) -> None:
    # a+ = 1 - z0 - alpha changes sign at z0 = 1 - alpha, a- at z0 = 1 + alpha
    alpha, e = F(2), F(gap)
    regions = {
        -1 - e: "crossing", -1 + e: "sliding", 3 - e: "sliding", 3 + e: "crossing",
    }  # fmt: skip
    for z0, region in regions.items():
        assert sa.friction(3, alpha, z0).region == region
    for z0 in (F(-1), F(3)):
        with pytest.raises(sa.RegionError, match="tangency"):
            _ = sa.friction(3, alpha, z0).region


def test_parameters_may_stay_free() -> None:
    drift = sa.friction(mu=3)
    assert drift.free == ("alpha", "z0")
    with pytest.raises(sa.InputError, match="alpha has no value"):
        drift.beta()
    with pytest.raises(sa.InputError, match="mu has no value"):
        sa.friction(alpha=1).folds()
    assert drift.bind(alpha=2).beta() == pytest.approx(32 / 9)
    same = sa.friction().bind(z0="-0.3", alpha=1, mu=3)
    one, other = (sa.escape_time(d, 1, 5, dps=20) for d in (same, sa.friction(3, 1, "-0.3")))
    assert relative(one, other) == 0


@pytest.mark.parametrize(
    ("values", "pattern"),
    [
        ({"mu": -1}, "mu is -1; it must be at least 0"),
        ({"mu": [1, -2]}, "mu .*-2.* at least 0"),
        ({"alpha": 0}, "alpha is 0; it must be greater than 0"),
        ({"alpha": "-1e-8"}, "alpha is -1e-08"),
        ({"alpha": [1.0, 0.0]}, "alpha .*0.* greater than 0"),
        ({"z0": "x"}, "z0 is 'x'"),
    ],
)
def test_ranges_hold_wherever_a_parameter_is_bound(values: dict[str, Any], pattern: str) -> None:
    for make in (lambda: sa.friction(**values), lambda: sa.friction().bind(**values)):
        with pytest.raises(sa.InputError, match=pattern):
            make()
