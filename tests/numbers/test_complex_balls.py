"""The range of a function over a ball holds what the function does there."""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.numbers.complex_balls import ComplexBallOps, resolved
from symasym.numbers.trees import FUNCTIONS, MpmathOps, NumpyOps

ARRAYS = ComplexBallOps(NumpyOps())
NUMBERS = ComplexBallOps(MpmathOps(mpmath.MPContext()))


def change_on_circle(function: Callable[[Any], Any], centre: float, radius: float) -> float:
    """The largest |f(z) - f(c)| at some points of the circle."""
    middle = function(mpmath.mpf(centre))
    around = (centre + radius * cmath.exp(2j * math.pi * k / 16) for k in range(16))
    return max(float(abs(function(mpmath.mpmathify(z)) - middle)) for z in around)


@pytest.mark.parametrize("name", FUNCTIONS)
@settings(max_examples=80, deadline=None, derandomize=True)
@given(centre=st.floats(-4, 4), power=st.floats(-8, 0.6))
def test_functions(name: str, centre: float, power: float) -> None:
    radius = 10**power
    for ops in (ARRAYS, NUMBERS):
        given_numbers: list[Any] = [centre, radius]
        if ops is ARRAYS:
            given_numbers = [np.array([x]) for x in given_numbers]
        else:
            given_numbers = [mpmath.mpf(x) for x in given_numbers]
        try:
            with np.errstate(all="ignore"):
                found = getattr(ops, name)(ops.ball(*given_numbers))
        except (ZeroDivisionError, ValueError):  # mpmath at a pole
            continue
        bound = float(np.ravel(found.radius)[0]) if ops is ARRAYS else float(found.radius)
        if not bound < math.inf:
            continue
        function = getattr(mpmath, name)
        assert change_on_circle(function, centre, radius) <= bound * (1 + 1e-9) + 1e-13


@settings(max_examples=80, deadline=None, derandomize=True)
@given(st.floats(-3, 3), st.floats(-8, 0.5), st.floats(-2, 2))
def test_arithmetic(centre: float, power: float, b: float) -> None:
    radius = 10**power
    z = NUMBERS.ball(mpmath.mpf(centre), mpmath.mpf(radius))
    for function in (
        lambda z: (z * z - b) * (b - z) + z * 3 - 1,
        lambda z: 2 / (z * z + 5) - (z - b) / (z + 4),
        lambda z: -z / (b * b + 1),
    ):
        bound = function(z).radius
        if bound < math.inf:
            assert change_on_circle(function, centre, radius) <= float(bound) * (1 + 1e-9) + 1e-13


@pytest.mark.parametrize(
    ("name", "centre", "radius"),
    [
        ("log", 0.5, 0.5), ("log", -1.0, 0.1), ("sqrt", 0.0, 0.1), ("sqrt", 0.2, 0.3),
        ("tan", 1.5, 0.2), ("tanh", 0.0, 1.6), ("atan", 0.0, 1.0), ("asin", 0.9, 0.2),
        ("acosh", 1.1, 0.2), ("atanh", -0.5, 0.5), ("asinh", 0.0, 1.1), ("acos", 2.0, 0.1),
    ],
)  # fmt: skip
def test_a_singularity_is_not_resolved(name: str, centre: float, radius: float) -> None:
    with np.errstate(all="ignore"):
        found = getattr(ARRAYS, name)(ARRAYS.ball(np.array([centre]), np.array([radius])))
    assert not resolved(found.radius, np.array([1e300])).any()
    number = getattr(NUMBERS, name)(NUMBERS.ball(mpmath.mpf(centre), mpmath.mpf(radius)))
    assert not resolved(number.radius, mpmath.mpf(10) ** 300)


def test_reciprocal_of_a_disc_around_zero_is_not_resolved() -> None:
    for centre, radius in ((0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (-1.0, 2.0)):
        with np.errstate(all="ignore"):
            found = 1 / ARRAYS.ball(np.array([centre]), np.array([radius]))
        assert not resolved(found.radius, np.array([1e300])).any()


def test_a_needle_is_not_resolved_and_what_is_left_of_it_is() -> None:
    drift = sa.Drift("1 + exp(-((u - 0.3)/1e-5)**2)")
    centre, radius = np.array([0.3, -0.5, 0.3]), np.array([0.1, 0.3, 1e-5])
    assert resolved(drift.spread(centre, radius).radius, 1.0).tolist() == [False, True, True]


def test_a_tanh_saturated_on_all_of_a_huge_disc() -> None:
    with (context := mpmath.MPContext()).workdps(400):
        found = ComplexBallOps(MpmathOps(context)).tanh(
            ComplexBallOps(MpmathOps(context)).ball(
                context.mpf(2) ** 1001 + 1.5, context.mpf(2) ** 1001
            )
        )
        # z = 1.5 is on the disc.
        assert 1 - context.tanh(1.5) <= found.radius < 1


def test_huge_exponents_come_to_an_end() -> None:
    z = NUMBERS.ball(mpmath.mpf(0), mpmath.mpf(10) ** 9)
    assert not NUMBERS.exp(NUMBERS.exp(z)).radius < math.inf
