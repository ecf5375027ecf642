"""The friction oscillator's drift: the paper's formula, its folds, its breakaway force."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from tests.strategies import SAMPLE

SMALL = st.fractions(min_value=-4, max_value=4, max_denominator=100)
FORCES = st.fractions(min_value=F(1, 100), max_value=5, max_denominator=100)
SHAPES = st.fractions(min_value=0, max_value=9, max_denominator=100)


def paper(u: F, mu: F, alpha: F, z0: F) -> F:
    """eq:phifric0."""
    return 1 - z0 - alpha * (u + mu * (u - u**3))


def value(drift: sa.Drift, u: F) -> F:
    return sum(c * u**k for k, c in enumerate(drift.exact_coefficients() or []))


@SAMPLE
@given(SHAPES, FORCES, SMALL, st.fractions(min_value=-1, max_value=1, max_denominator=50))
def test_drift_is_the_papers(mu: F, alpha: F, z0: F, u: F) -> None:
    drift, mirrored = sa.friction(mu, alpha, z0), sa.friction(mu, alpha, 2 - z0)
    assert value(drift, u) == paper(u, mu, alpha, z0) == -value(mirrored, -u)
    assert drift.ends == (1 - z0 + alpha, 1 - z0 - alpha)
    assert drift(float(u)) == pytest.approx(float(paper(u, mu, alpha, z0)), abs=1e-12)


@pytest.mark.parametrize("mu", ["0.6", "1", "3", "50", "1e8"])
@pytest.mark.parametrize("alpha", ["1e-8", "1", "7/3", "1e8"])
def test_folds_are_double_zeros(mu: str, alpha: str) -> None:
    found = [sa.formula(name).emit("numpy").load() for name in ("folds", "turning-points")]
    turn, folds = found[1].turning_points(float(mu)), found[0]
    for sign, fold in ((1, folds.folds_right_fold), (-1, folds.folds_left_fold)):
        u, z0 = sign * turn, float(fold(float(mu), float(F(alpha))))
        here = sa.friction(mu, alpha, z0)
        scale = float(F(alpha)) * (1 + float(F(mu))) + abs(1 - z0)
        assert abs(here(u)) <= 1e-14 * scale + 1e-15  # z0 itself is rounded
        h = 1e-6
        assert abs(here(u + h) - here(u - h)) / (2 * h) <= 1e-7 * scale + 1e-9


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


@pytest.mark.parametrize(
    "values", [{"mu": -1}, {"mu": [1, -2]}, {"alpha": 0}, {"alpha": [1.0, 0.0]}, {"z0": "x"}]
)
def test_ranges_hold_wherever_a_parameter_is_bound(values: dict[str, Any]) -> None:
    for make in (sa.friction, sa.friction().bind):
        with pytest.raises(sa.InputError):
            make(**values)
