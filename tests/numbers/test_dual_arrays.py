"""Arrays with derivatives, and logarithms with derivatives, against differences."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from mpmath import exp, log, log1p, mpf

from symasym.exact import float_panels
from symasym.numbers.float_arrays import (
    DualArray,
    LogPositive,
    LogSlopes,
    slopes_of,
    value_of,
    with_log,
)

NODES = float_panels.gauss().nodes


def slope(f: Callable[[float], Any], h: float = 1e-5) -> Any:
    """df/dp at 0, of order 4."""
    return (8 * (f(h) - f(-h)) - (f(2 * h) - f(-2 * h))) / (12 * h)


def dual(f: Callable[[float], Any]) -> DualArray:
    """f at 0 with its derivative in one parameter."""
    return DualArray(f(0.0), slope(f)[None])


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rules_of_panels(sign: float) -> None:
    def exponents(p: float) -> Any:
        rates = sign * np.array([[[1.0 + p], [2.0 - p]], [[1.5], [p - 0.5]]])
        x = rates * (lambda x: x + p * x**2)(np.append(NODES, 1.0)) * 3
        return x[..., :-1].swapaxes(1, 2), -x[..., -1]

    def values(p: float) -> Any:
        x = float_panels.lobatto().nodes
        return sign * (900.0 + p) * (1 + (0.1 + p) * x)[None, :]

    h, one = np.array([0.3, 0.4]), np.array([0.5])
    pair = (dual(lambda p, k=k: exponents(p)[k]) for k in range(2))
    moments = float_panels.sampled(*pair, h)[0]
    layers = float_panels.slow(dual(values), one)
    outside = float_panels.constant(dual(lambda p: sign * np.array([0.0, 1e-9, 3.0]) + p), 1.5)
    for k in range(4):
        for found, plain in (
            (moments[k], lambda p, k=k: float_panels.sampled(*exponents(p), h)[0][k]),
            (layers[k], lambda p, k=k: float_panels.slow(values(p), one)[k]),
        ):
            np.testing.assert_allclose(found.value, plain(0.0), rtol=1e-15)
            np.testing.assert_allclose(found.slopes[0], slope(plain), rtol=1e-8, atol=1e-9)
    assert np.isfinite(outside.nested.slopes).all()
    # int_0^h e^{-a u} du falls with a as h^2/2 there.
    assert outside.rise.slopes[0] == pytest.approx(-1.5)


def test_plain_arrays_stand_for_constants() -> None:
    x = DualArray(np.array([1.0, 2.0]), np.array([[1.0, 0.0]]))
    joined = np.concatenate([np.zeros(1), x])
    assert joined.slopes.tolist() == [[0.0, 1.0, 0.0]]
    assert (np.array([1.0, 3.0]) - x).slopes.tolist() == [[-1.0, 0.0]]
    assert value_of(3.0 / x).tolist() == [3.0, 1.5]
    assert slopes_of(np.ones(2)) == 0.0
    with pytest.raises(TypeError):
        np.sin(x)


def test_sums_forget_the_smaller_term() -> None:
    large = with_log(DualArray(np.array([50.0]), np.array([[1.0]])), 0.0)
    small = with_log(
        DualArray(np.array([-1e6]), np.array([[1e14]])), DualArray(np.ones(1), [[9.0]])
    )
    total = large + small
    assert isinstance(total, LogSlopes)
    assert total.slopes[0, 0] == 1.0
    assert total.slope_error[0, 0] < 1e-15
    product = (total * small) / small
    assert product.slopes[0, 0] == pytest.approx(1.0, abs=product.slope_error[0, 0])
    assert isinstance(1 / LogPositive.of(np.ones(1)) + large, LogSlopes)


@pytest.mark.parametrize(
    "errors", [(40.0, 0.0), (0.0, 40.0), (30.0, 30.0), (1e6, 2e6), (1e-9, 0.3)]
)
@pytest.mark.parametrize("apart", [0.0, 35.0, 60.0, -60.0, 2e5])
def test_the_smaller_term_counts_where_it_could_be_the_larger_one(
    errors: tuple[float, float], apart: float
) -> None:
    first, second = (np.array([[x]]) for x in (1.0, -3.0))
    x = with_log(DualArray(np.array([apart]), first), np.array([errors[0]]))
    y = with_log(DualArray(np.array([0.0]), second), np.array([errors[1]]))
    total, one_more = x + y, 1 + x
    assert isinstance(total, LogSlopes)
    for moved in itertools.product((-1, 1), repeat=2):
        logs = [mpf(z) + k * e for z, k, e in zip((apart, 0), moved, errors, strict=True)]
        weights = [exp(z - max(logs)) for z in logs]
        true = max(logs) + log(sum(weights))
        assert abs(true - total.log[0]) <= total.error[0] * 1.006
        slope = (weights[0] - 3 * weights[1]) / sum(weights)
        assert abs(slope - total.slopes[0, 0]) <= total.slope_error[0, 0]
        # log(1 + e^a)
        a = logs[0]
        true = a + log1p(exp(-a)) if a > 0 else log1p(exp(a))
        assert abs(true - one_more.log[0]) <= one_more.error[0] * 1.006


def test_slopes_of_a_reciprocal_beyond_the_square_root_of_the_range() -> None:
    x = DualArray(np.array([2e248]), np.array([[2e248]]))
    assert (1.0 / x).slopes[0, 0] == -(1.0 / x).value[0]
