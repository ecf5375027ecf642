"""Drifts: parameters, regions, continuity."""

from __future__ import annotations

from fractions import Fraction as F

import pytest
import sympy

import symasym as sa


@pytest.mark.parametrize(
    ("ends", "region"),
    [
        ((1, 2), "crossing"),
        ((-1, -2), "crossing"),
        ((1, -2), "sliding"),
        ((-1, 2), "repelling sliding"),
    ],
)
def test_regions_are_the_papers_table(ends: tuple[int, int], region: str) -> None:
    assert sa.linear(*ends).region == region
    assert sa.linear([ends[0]], [ends[1]]).region.tolist() == [region]


def test_decimals_in_a_string_are_exact() -> None:
    assert sa.Drift("0.1*u").exact_coefficients() == [0, F(1, 10)]
    assert sa.Drift(sympy.Float(0.1) * sympy.Symbol("u")).exact_coefficients() == [0, F(0.1)]


def test_a_parameter_may_be_called_self() -> None:
    assert sa.Drift("1 - self*u").bind(self=2)(0.25) == 0.5


def test_parameters_bind_in_any_order() -> None:
    drift = sa.friction()
    assert drift.free == ("mu", "alpha", "z0")
    bound = drift.bind(z0=["-0.4", "-0.5"]).bind(mu=3, alpha=1)
    assert bound.free == ()
    assert bound.shape == (2,)
    assert drift.free == ("mu", "alpha", "z0")
    assert isinstance(bound, type(drift))
