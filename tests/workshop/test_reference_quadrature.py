"""The plain quadrature: closed forms, its own rules, and that it refuses."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import mpmath
import pytest
import sympy

from symasym.base.errors import AccuracyError
from symasym.drift import ready_made
from symasym.workshop import reference_quadrature
from symasym.workshop.problems import BY_NAME, constant_drift
from tests.problems import relative


class Corner:
    """A drift that is no smooth function of u."""

    def exact_coefficients(self) -> None:
        return None

    def expression(self) -> Any:
        return 1 + sympy.Abs(sympy.Symbol("u", real=True) - sympy.Rational(1, 3))


@pytest.mark.parametrize(
    ("a", "kappa", "r", "start"),
    [
        (F(1), F(1), F(2), F(0)),
        (F(-1), F(1), F(3), F(1, 3)),  # H - C cancels 5 digits
        (F(-2), F(1, 2), F(3), F(0)),  # and here 20
        (F(-2), F(1, 2), F(3), F(-5, 2)),
        (F(3, 2), F(2), F(1, 2), F(1, 5)),
        (F(1, 10**6), F(1), F(5, 4), F(9, 8)),
    ],
)
def test_constant_drift(a: F, kappa: F, r: F, start: F) -> None:
    scene = ready_made.polynomial(a), kappa, r, start
    for name, of in (
        ("T", reference_quadrature.escape_time), ("C", reference_quadrature.exit_probability)
    ):  # fmt: skip
        with mpmath.workdps(200):  # the closed form of T cancels where a is small
            numbers = (mpmath.mp.convert(x) for x in (kappa, r, start))
            closed = constant_drift(str(a))[name](*numbers)
        assert relative(of(*scene, 16), closed) < 1e-16


def test_linear_sliding() -> None:
    """A parabola between lines: every integral is an error function."""
    problem = BY_NAME["linear sliding"]
    for name in ("C", "P", "1 - P"):
        assert relative(problem.by_quadrature(name, 25), problem.known(name, 40)) < 1e-25
    for y in ("3/10", "-5/2"):
        found = reference_quadrature.stationary_density(problem.make(), F(problem.kappa), F(y), 25)
        assert relative(found, problem.known(f"p({y})", 40)) < 1e-25


def test_global_precision_is_neither_used_nor_changed() -> None:
    drift = ready_made.linear(1, -2)
    with mpmath.workdps(7):
        low = reference_quadrature.escape_time(drift, F(1), F(2), F(0), 30)
        assert mpmath.mp.dps == 7
    with mpmath.workdps(90):
        high = reference_quadrature.escape_time(drift, F(1), F(2), F(0), 30)
    assert low == high


def test_a_corner_is_not_passed_off_as_accurate() -> None:
    with pytest.raises(AccuracyError):
        reference_quadrature.escape_time(Corner(), F(2), F(1), F(0), 12)


def test_cancellation_within_the_drift_is_noticed() -> None:
    # A(-1) = 1e-20 is a difference of numbers near 1: 20 digits less than the work has.
    drift = ready_made.linear(F(1, 10**20), -2)
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
    drift = ready_made.linear(1, -2)
    with pytest.raises(AccuracyError):
        reference_quadrature.escape_time(drift, F(1, 10**6), F(10), F(0), 10)
