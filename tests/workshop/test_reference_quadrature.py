"""The plain quadrature: closed forms, its own rules, and that it refuses."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import mpmath
import pytest
import sympy

from symasym.base.errors import AccuracyError, RegionError
from symasym.drift.ready_made import smoothings
from symasym.workshop import reference_quadrature


class Corner:
    """A drift that is no smooth function of u."""

    def exact_coefficients(self) -> None:
        return None

    def expression(self) -> Any:
        return 1 + sympy.Abs(sympy.Symbol("u", real=True) - sympy.Rational(1, 3))


def constant_drift(a: F, kappa: F, r: F, start: F) -> tuple[Any, Any]:
    """T and C of a constant drift a, to 60 digits."""
    mp = mpmath.MPContext()
    mp.dps = 200  # the closed form of T cancels where a is small
    a_, k, r_, x = (mp.mpf(v.numerator) / v.denominator for v in (a, kappa, r, start))
    rate = 2 * a_ / k**2
    C = (mp.exp(-rate * x) - mp.exp(-rate * r_)) / (mp.exp(rate * r_) - mp.exp(-rate * r_))
    # E[u at exit] = start + a T, as u - a t is a martingale.
    return (r_ * (1 - 2 * C) - x) / a_, C


def relative(value: Any, reference: Any) -> Any:
    with mpmath.workdps(80):
        return abs(mpmath.mpf(value) - mpmath.mpf(reference)) / abs(mpmath.mpf(reference))


@pytest.mark.parametrize(
    ("a", "kappa", "r", "start"),
    [
        (F(1), F(1), F(2), F(0)),
        (F(-1), F(1), F(3), F(1, 3)),  # H - C cancels 5 digits
        (F(-2), F(1, 2), F(6), F(0)),  # and here 40
        (F(-2), F(1, 2), F(3), F(-5, 2)),
        (F(3, 2), F(2), F(1, 2), F(1, 5)),
        (F(1, 10**6), F(1), F(5, 4), F(9, 8)),
    ],
)
def test_constant_drift(a: F, kappa: F, r: F, start: F) -> None:
    time, probability = constant_drift(a, kappa, r, start)
    drift = smoothings.polynomial(a)
    assert relative(reference_quadrature.escape_time(drift, kappa, r, start, 25), time) < 1e-25
    side = reference_quadrature.exit_probability(drift, kappa, r, start, 25)
    assert relative(side, probability) < 1e-25


def test_linear_potential_well_on_the_line() -> None:
    # V = |u|-like tails and a parabola between: every integral is an error function.
    drift, kappa = smoothings.linear(1, -1), F(1, 2)
    with mpmath.workdps(40):
        lam = mpmath.mpf(8)
        inside = mpmath.exp(lam / 2) * mpmath.sqrt(2 * mpmath.pi / lam)
        inside *= mpmath.erf(mpmath.sqrt(lam / 2))
        tails = 2 / lam
        P = inside / (inside + tails)
        density = mpmath.exp(lam / 2 - lam / 18) / (inside + tails)
        far = mpmath.exp(-lam * 3) / (inside + tails)
    assert relative(reference_quadrature.occupation(drift, kappa, 25), P) < 1e-25
    rest = reference_quadrature.occupation(drift, kappa, 25, complement=True)
    assert relative(rest, tails / (inside + tails)) < 1e-14
    assert (
        relative(reference_quadrature.stationary_density(drift, kappa, F(1, 3), 25), density)
        < 1e-25
    )
    assert relative(reference_quadrature.stationary_density(drift, kappa, F(-4), 25), far) < 1e-25


def test_global_precision_is_neither_used_nor_changed() -> None:
    drift = smoothings.linear(1, -2)
    with mpmath.workdps(7):
        low = reference_quadrature.escape_time(drift, F(1), F(2), F(0), 30)
        assert mpmath.mp.dps == 7
    with mpmath.workdps(90):
        high = reference_quadrature.escape_time(drift, F(1), F(2), F(0), 30)
    assert low == high


def test_a_corner_is_not_passed_off_as_accurate() -> None:
    with pytest.raises(AccuracyError):
        reference_quadrature.escape_time(Corner(), F(1), F(2), F(0), 15)


def test_cancellation_within_the_drift_is_noticed() -> None:
    # A(-1) = 1e-20 is a difference of numbers near 1: 20 digits less than the work has.
    drift = smoothings.linear(F(1, 10**20), -2)
    with mpmath.workdps(60):
        a = mpmath.mpf(10) ** -20
        lam, slope = mpmath.mpf(2), (2 + a) / 2
        # V = -a x + slope x^2/2 on [0, 2], x = u + 1
        width = mpmath.sqrt(lam * slope / 2)
        inside = mpmath.erf((2 - a / slope) * width) + mpmath.erf(a / slope * width)
        inside *= mpmath.exp(lam * a * a / (2 * slope)) * mpmath.sqrt(mpmath.pi) / (2 * width)
        tails = 1 / (lam * a) + mpmath.exp(-lam * (2 * slope - 2 * a)) / (lam * 2)
        P = inside / (inside + tails)
    assert relative(reference_quadrature.occupation(drift, F(1), 15), P) < 1e-15


def test_refusals() -> None:
    drift = smoothings.linear(1, -2)
    with pytest.raises(RegionError):
        reference_quadrature.occupation(smoothings.linear(1, 2), F(1), 10)
    with pytest.raises(AccuracyError):
        reference_quadrature.escape_time(drift, F(1, 10**6), F(10), F(0), 10)
