"""Reading numbers: what each kind of argument stands for, exactly."""

from __future__ import annotations

import math
from decimal import Decimal
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.base.inputs import (
    choice,
    count,
    exact,
    flag,
    floats,
    is_array,
    sequence,
    shown,
)

EXACT: list[tuple[Any, F]] = [
    (3, F(3)),
    (-(10**300), F(-(10**300))),
    (0.1, F(3602879701896397, 36028797018963968)),
    ("-0.4", F(-2, 5)),
    ("1/3", F(1, 3)),
    ("1e-8", F(1, 10**8)),
    ("1E+3", F(1000)),
    (" 2.50 ", F(5, 2)),
    ("\N{MINUS SIGN}7/9", F(-7, 9)),
    ("1e-300", F(1, 10**300)),
    (F(22, 7), F(22, 7)),
    (Decimal("0.1"), F(1, 10)),
    (Decimal("-1.5e3"), F(-1500)),
    (np.float64(0.1), F(0.1)),
    (np.float32(0.1), F(float(np.float32(0.1)))),
    (np.int64(-7), F(-7)),
    (np.array(0.25), F(1, 4)),
    (mpmath.mpf("0.5"), F(1, 2)),
    (mpmath.mpf(-3) * 2**200, F(-3 * 2**200)),
    (mpmath.mpf(0), F(0)),
    (sympy.Rational(2, 7), F(2, 7)),
    (sympy.Integer(-4), F(-4)),
    (sympy.Float(0.1), F(0.1)),
]


@pytest.mark.parametrize(("value", "wanted"), EXACT, ids=[repr(v)[:25] for v, _ in EXACT])
def test_exact(value: Any, wanted: F) -> None:
    assert exact("x", value) == wanted
    assert isinstance(exact("x", value), F)


def test_mpf_is_read_whatever_the_global_precision() -> None:
    with mpmath.workdps(60):
        x = mpmath.mpf(1) / 3
    with mpmath.workdps(5):
        assert abs(exact("x", x) - F(1, 3)) < F(1, 10**59)


@given(st.floats(-1e300, 1e300).filter(lambda x: not 0 < abs(x) < 1e-300))
def test_floats_are_their_binary_values(x: float) -> None:
    assert float(exact("x", x)) == x
    assert exact("x", x) == F(x)


@pytest.mark.parametrize(
    "value",
    [
        None, "", "a", "nan", "inf", "1/0", "1e", "0x1", "1 2", "½", b"1", [1], (1,), {}, {1},
        object, True, np.True_, 1j, np.complex64(1), mpmath.mpc(1, 1), mpmath.inf, mpmath.nan,
        float("nan"), float("inf"), -float("inf"), np.float32("nan"), Decimal("nan"),
        Decimal("sNaN"), Decimal("-Infinity"), sympy.oo, sympy.nan, sympy.pi, sympy.I,
        sympy.Symbol("x"), "1e301", "1e-301", "1e-99999999999", np.datetime64("2020"), 5e-324,
        Decimal("1E+999999"), Decimal("-1E-999999"), mpmath.mpf("1e1000000"), 10**200_000,
        F(1, 10**200_000), "1e200000", "9" * 200_000, "1/" + "9" * 200_000,
    ],
    ids=lambda x: shown(x)[:40],
)  # fmt: skip
def test_what_is_no_finite_number_is_refused_by_name(value: Any) -> None:
    with pytest.raises(sa.InputError, match=r"^kappa (is|has) .{,250}[.]$"):
        exact("kappa", value)


ARRAYS: list[tuple[Any, list[Any]]] = [
    ([1, 2.5], [1.0, 2.5]),
    ((1, 2), [1.0, 2.0]),
    (["0.1", "1/3"], [0.1, 1 / 3]),
    ([F(1, 3), 2], [1 / 3, 2.0]),
    ([mpmath.mpf("0.5"), Decimal("0.25")], [0.5, 0.25]),
    ([sympy.Rational(1, 8)], [0.125]),
    (np.array([1, 2], dtype=np.int8), [1.0, 2.0]),
    (np.array([0.5], dtype=np.float16), [0.5]),
    ([[1, 2], [3, 4]], [[1.0, 2.0], [3.0, 4.0]]),
    (np.arange(4)[::2], [0.0, 2.0]),
]


@pytest.mark.parametrize(("value", "wanted"), ARRAYS, ids=[repr(v)[:30] for v, _ in ARRAYS])
def test_arrays_become_float64(value: Any, wanted: list[Any]) -> None:
    assert is_array(value)
    found = floats("x", value)
    assert found.dtype == np.float64
    assert found.tolist() == wanted


@pytest.mark.parametrize(
    "value",
    [
        [], [[]], np.empty((0, 3)), [[1, 2], [3]], [1, None], [1, "x"], [True], ["nan"], [1j],
        np.array([np.nan]), np.array([np.inf, 1]), np.array(["a"]), np.array([object]),
        np.array(["2020-01-01"], dtype="datetime64"), [10**400], ["1e-400"], [1, [2]],
    ],
    ids=repr,
)  # fmt: skip
def test_arrays_that_are_refused(value: Any) -> None:
    with pytest.raises(sa.InputError, match=r"^r (is|has) .*[.]$"):
        floats("r", value)


ODD: list[Any] = [
    None, [], {}, np.array([True, False]), np.array(3), sympy.Symbol("x"), object(), "x", "3",
    b"1", 1j, math.nan, 2.0, 10**5000, ..., {1}, Decimal("1E+999999"),
]  # fmt: skip


@pytest.mark.parametrize("value", ODD, ids=[str(k) for k in range(len(ODD))])
def test_flags_words_and_counts_are_what_they_say(value: Any) -> None:
    for read in (
        lambda: flag("x", value),
        lambda: choice("x", value, ["a", "b"]),
        lambda: count("x", value, 0, 20),
    ):
        with pytest.raises(sa.InputError):
            read()


def test_what_is_taken() -> None:
    assert [flag("x", value) for value in (True, False, np.True_)] == [True, False, True]
    assert choice("x", "b", ["a", "b"]) == "b"
    assert [count("x", n, 0, 20) for n in (0, np.int8(20), sympy.Integer(3))] == [0, 20, 3]
    assert sequence("x", np.array([1, 2])) == [1, 2]
    for bad in (True, "ab", 3, None, {"a": 1}, np.array(1.0)):
        with pytest.raises(sa.InputError, match="^x is .*; give a sequence"):
            sequence("x", bad)
