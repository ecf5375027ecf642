"""An Estimate as text and as a number: never a digit or an error that is not its own."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.base.estimate import Estimate
from symasym.base.texts import carried_text, number_repr, with_error
from tests.strategies import SAMPLE

VALUES = st.floats(-1e300, 1e300)
SIZES = st.floats(1e-22, 1e3)


@SAMPLE
@given(VALUES, SIZES)
def test_the_text_is_right_and_as_the_attributes(value: float, size: float) -> None:
    error = abs(value) * size
    text, shown = map(Decimal, with_error(value, error))
    exact, radius = Decimal(value), Decimal(error)
    # The interval that is printed holds the one that is stated, and is hardly larger.
    slack = radius * Decimal("1e-15")
    assert text - shown <= exact - radius + slack
    assert text + shown >= exact + radius - slack
    if 1e-17 < size < 1 and error > 1e-300:
        assert radius * (1 - Decimal("1e-15")) <= shown <= radius * Decimal("1.02")


@SAMPLE
@given(VALUES, SIZES)
def test_no_digit_beyond_the_error(value: float, size: float) -> None:
    error = abs(value) * size
    text, shown = (Decimal(x) for x in carried_text(value, error, 17))
    assert abs(text - Decimal(value)) + Decimal(error) <= shown * (1 + Decimal("1e-15"))
    if value and size < 0.1:
        unit = Decimal(1).scaleb(Decimal(text).as_tuple().exponent)  # type: ignore[arg-type]
        assert shown <= unit * Decimal("1.01")
        if len(text.as_tuple().digits) < 17:
            # One digit more would be wrong by more than one.
            assert Decimal(error) * 2 > unit / 10


def test_what_is_printed() -> None:
    for value, error, kind, text in (
        (78.3992241, 1.08e-5, "estimate", "78.3992241 ± 1.09e-5 (estimate, laplace)"),
        (mpmath.mpf("1e-2000"), mpmath.mpf("1e-2004"), "bound", "1.000000e-2000 ± 1.01e-2004"),
        (10.0, 1.85e5, "estimate", "1.e+1 ± 1.85e+5"),
        (1 + 2j, 1e-3, "estimate", "(1.00000 +2.00000j) ± 0.001"),
        (2.0, math.inf, "estimate", "2. ± inf"),
        (0.25, None, "none", "0.25 (no error claimed, laplace)"),
    ):
        assert str(Estimate(value, error, kind, "laplace")).startswith(text)  # type: ignore[arg-type]
    bound = Estimate(1.0, 1e-3, "bound", "exact")
    assert str(bound) == "1.00000 ± 0.001 (proved bound, exact)"
    assert repr(bound) == f"Estimate({bound})"
    many = Estimate(np.array([[1.0, np.nan]]), np.array([[1e-3, np.nan]]), "estimate", "auto")
    assert str(many) == "[[1.00000 ± 0.001, nan]] (estimate, auto)"
    assert bound._repr_latex_() == r"$1.00000 \pm 0.001$"
    assert Estimate(2e30, 1e28, "bound", "")._repr_latex_() == (
        r"$2.0000 \times 10^{30} \pm 1.01 \times 10^{28}$"
    )
    assert many._repr_latex_() is None


def test_it_stands_for_its_value() -> None:
    drift = sa.friction(3, 1, "-0.4")
    estimate = sa.escape_time(drift, "0.1", 10, full=True)
    value, error = estimate
    assert (value, error) == (estimate.value, estimate.error)
    assert float(estimate) == value
    assert mpmath.mpf(estimate) == value
    assert mpmath.sqrt(estimate) == mpmath.sqrt(value)
    assert f"{estimate:.3g}" == f"{value:.3g}"
    assert f"{estimate}" == str(estimate)
    assert 2e11 < estimate <= value == estimate != 0
    assert estimate >= value
    assert hash(estimate) == hash(value)
    assert max(estimate, 3) is estimate
    digits = sa.escape_time(drift, "0.1", 10, dps=30, full=True)
    with mpmath.workdps(40):
        assert mpmath.mpf(digits) == digits.value
    assert abs(float(digits) - value) < 1e-4
    assert digits == digits.value
    # T is 239803837121.03777001127804867950918...
    for spec, text in (
        (".10f", "239803837121.0377700113"),
        (".25g", "239803837121.0377700112780"),
        (">22,.3f", "   239,803,837,121.038"),
        ("e", "2.398038e+11"),
        ("g", "2.39804e+11"),
        (".4", "2.398e+11"),
    ):
        assert format(digits, spec) == text
    many = sa.escape_time(drift, [0.1, 0.2], 10, full=True)
    assert (many > [1e11, 1e11]).tolist() == [True, False]
    with pytest.raises(TypeError):
        float(many)
    far = sa.escape_time(drift, "0.001", 10, dps=20, full=True)
    with pytest.raises(sa.RangeError, match="its attribute value"):
        float(far)
    assert f"{far:.3e}" == f"{mpmath.nstr(far.value, 4)}"
    with pytest.raises(sa.InputError, match="format its elements"):
        format(many, ".3f")


@SAMPLE
@given(st.fractions(-1000, 1000, max_denominator=10**9) | st.floats(1e-290, 1e290).map(Fraction))
def test_numbers_come_back_from_their_source(x: Fraction) -> None:
    from symasym.base.inputs import exact

    source: Any = eval(number_repr(x))
    assert exact("x", source) == x


def test_numbers_are_written_as_people_do() -> None:
    numbers = (3, -0.4, Fraction(-2, 5), Fraction(1, 3), 1e300, Fraction(10) ** 400, math.pi)
    texts = ["3", "-0.4", "'-0.4'", "'1/3'", "1e+300", repr(str(10**400)), "3.141592653589793"]
    assert [number_repr(Fraction(x)) for x in numbers] == texts
