"""From (eps, kappa, r) to scaled numbers and back."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.drift.reduction import Scales

POSITIVE = st.fractions(min_value=F(1, 10**6), max_value=10**6)


@given(POSITIVE, POSITIVE, POSITIVE)
def test_squares_of_eps_stay_exact(root: F, kappa: F, r: F) -> None:
    s = sa.rescale(eps=root**2, kappa=kappa, r=r)
    assert s == Scales(kappa / root, r / root**2, root**2)


@given(POSITIVE, POSITIVE)
def test_other_eps_give_sixty_digits(eps: F, kappa: F) -> None:
    s = sa.rescale(eps=eps, kappa=kappa)
    square = F(*s.kappa.as_integer_ratio()) if hasattr(s.kappa, "as_integer_ratio") else None
    if square is None:
        _, mantissa, exponent, _ = s.kappa._mpf_
        square = F(int(mantissa)) * F(2) ** exponent
    assert abs(square**2 * eps / kappa**2 - 1) < F(3, 10**60)
    assert s.r == 1 / eps
    assert s.time == eps


def test_arrays_broadcast() -> None:
    s = sa.rescale(eps=[[0.01], [0.04]], kappa=[0.03, 0.1, 0.2], r=0.1)
    assert s.kappa.shape == s.r.shape == s.time.shape == (2, 3)
    assert s.kappa == pytest.approx(np.array([[0.3, 1, 2], [0.15, 0.5, 1]]))
    assert s.r == pytest.approx(np.array([[10.0] * 3, [2.5] * 3]))
    assert s.time.flags.writeable


def test_scaled_and_physical_problem_are_the_same() -> None:
    # dy = a dt + kappa dW from |y| < r: T is r/a tanh(a r/kappa^2), whatever the layer's width
    for eps in ("0.01", "0.02"):
        s = sa.rescale(eps, "0.03", "0.1")
        time = s.time * F(sa.escape_time(sa.linear(1, 1), s.kappa, s.r))
        assert float(time) == pytest.approx(0.1 * np.tanh(0.1 / 0.03**2), rel=1e-13)


BAD: list[tuple[Any, Any, Any, str]] = [
    (0, 1, 1, "eps is 0"),
    (1, "-1", 1, "kappa is -1"),
    (1, 1, 0, "r is 0"),
    ("x", 1, 1, "eps is 'x'"),
    (1, float("nan"), 1, "kappa is nan"),
    ([1.0, 0.0], 1, 1, "eps is 0"),
    ([1.0, 2.0], [1.0, 2.0, 3.0], 1, "do not broadcast"),
    (1, "1e301", 1, "kappa is '1e301'"),
    ("1e-200", 1, "1e200", "r/eps is"),
    ([1e300], "1e-300", 1, "kappa/sqrt.eps. is 0"),
]


@pytest.mark.parametrize(("eps", "kappa", "r", "pattern"), BAD)
def test_refusals(eps: Any, kappa: Any, r: Any, pattern: str) -> None:
    with pytest.raises(sa.InputError, match=pattern):
        sa.rescale(eps=eps, kappa=kappa, r=r)
