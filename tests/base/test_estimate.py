"""An Estimate as text and as a number: never a digit or an error that is not its own."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction

import mpmath
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.base.estimate import Estimate, interval_text, with_error
from tests.strategies import SAMPLE

VALUES = st.floats(-1e290, 1e290)
SIZES = st.floats(1e-16, 1e3)


@SAMPLE
@given(VALUES, SIZES)
def test_the_printed_interval_holds_the_stated_one(value: float, size: float) -> None:
    error = abs(value) * size
    text, shown = (Decimal(x) for x in with_error(value, error).split(" ± "))
    assert text - shown <= Decimal(value) - Decimal(error)
    assert text + shown >= Decimal(value) + Decimal(error)
    # What is cut off the value is at most a few units of the last digit that the error leaves.
    assert shown <= 11 * Decimal(error)


@SAMPLE
@given(VALUES, SIZES)
def test_no_digit_beyond_the_error(value: float, size: float) -> None:
    error = abs(value) * size
    text, shown = (Decimal(x) for x in interval_text(value, error, 17))
    assert abs(text - Decimal(value)) + Decimal(error) <= shown * (1 + Decimal("1e-15"))
    if value and size < 0.1:
        unit = Decimal(1).scaleb(Decimal(text).as_tuple().exponent)  # type: ignore[arg-type]
        assert shown <= unit * Decimal("1.01")


@given(st.fractions().filter(bool), st.integers(-250, 250), st.integers(1, 60), st.integers(0, 30))
def test_the_true_value_lies_within_the_printed_radius(
    value: Fraction, exponent: int, dps: int, guard: int
) -> None:
    truth = value * Fraction(10) ** exponent
    with mpmath.workdps(dps + guard):
        rounded = mpmath.mpf(truth.numerator) / truth.denominator
        error = abs(rounded) * mpmath.mpf(10) ** -(dps + guard - 1)
    mid, rad = interval_text(rounded, error, dps, more=True)
    assert abs(Fraction(mid) - truth) <= Fraction(rad)
    # And no wider than the error plus one unit in the last digit.
    last_digit = abs(truth) * Fraction(10) ** -(dps - 1)
    assert Fraction(rad) <= Fraction(102, 100) * (
        Fraction(10) ** (1 - dps - guard) * abs(truth) * 2 + last_digit
    )


def test_an_array_has_each_element_with_its_error() -> None:
    many = Estimate(np.array([[1.0, np.nan]]), np.array([[1e-3, np.nan]]), "estimate", "laplace")
    assert str(many).count("±") == 1
    assert "nan" in str(many)
    assert "±" not in str(Estimate(0.25, None, "none", "laplace"))


def test_it_unpacks_and_is_a_float() -> None:
    estimate = sa.escape_time(sa.friction(3, 1, "-0.4"), "0.1", 10, full=True)
    value, error = estimate
    assert (value, error) == (estimate.value, estimate.error)
    assert float(estimate) == value


@SAMPLE
@given(st.fractions(-1000, 1000, max_denominator=10**9) | st.floats(1e-290, 1e290).map(Fraction))
def test_numbers_come_back_from_their_source(x: Fraction) -> None:
    drift = sa.linear(x, 1)
    assert eval(repr(drift)) == drift


def test_numbers_are_written_as_people_do() -> None:
    numbers = (3, -0.4, Fraction(-2, 5), Fraction(1, 3), 1e300, math.pi)
    texts = ["3", "-0.4", "'-0.4'", "'1/3'", "1e+300", "3.141592653589793"]
    assert [repr(sa.polynomial(x)) for x in numbers] == [f"sa.polynomial({x})" for x in texts]
