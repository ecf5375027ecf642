"""A in balls and in float64, against SymPy's evalf and exact arithmetic."""

from __future__ import annotations

import math
import random
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from flint import acb, arb, fmpq

import symasym as sa
from symasym.base.balls import precision, rounded
from symasym.drift.evaluate import box, pieces
from symasym.drift.sampled import FloatDrift

# Of all admitted functions.
FORMULAS = [
    "sqrt(u**2 + 1/100) - 1/2", "(u + 5/4)**(3/2) - b*(u + 2)**(-1/3)", "(2 + u)**b/(u**2 + 1/30)",
    "sin(3*u)*cos(b*u) - tan(u/2)", "sinh(b*u) + cosh(u) - tanh(9*u)", "erf(2*u)*exp(-b*u**2)",
    "asin(u/2) + acos(b*u/3) - atan(5*u)", "asinh(4*u) - acosh(u*b + 3) + atanh(u/2)",
    "log(u + 3)**2 - pi*b/(u + 3)**2 + E**u", "exp(-(100*u - 11)**2) - b/3", "b*u**3 - pi*u",
]  # fmt: skip


def true(drift: sa.Drift, u: Any) -> Any:
    """A(u) to 70 digits."""
    at = sympy.Symbol("u", real=True), sympy.Rational(int(u.p), int(u.q))
    return mpmath.mpf(str(drift.expression().subs(*at).evalf(70)))


@pytest.mark.parametrize("text", FORMULAS)
def test_balls_and_taylor_polynomials_hold_the_function(text: str) -> None:
    rng, drift, told = random.Random(text), sa.Drift(text), 0
    drift = drift.bind(b="1/2") if drift.free else drift
    with precision(200), mpmath.workdps(70):
        of = pieces(drift, fmpq(-1), fmpq(1))[0].phi
        for phi, sign in ((of, 1), (of.turned(1, -1), -1)):
            for k in range(12):
                middle, half = fmpq(rng.randint(-90, 90), 100), fmpq(1, 16 << k)
                series, missed = phi.taylor(middle, half, 25)
                assert len(list(series)) <= 2 * (25 * math.log(10) + 12) / math.log(2)
                t = fmpq(rng.randint(-8, 8), 9)
                wanted = true(drift, sign * (middle + half * t))
                balls = [phi(arb(middle + half * t)), series(arb(t)) + arb(0, missed)]
                told += bool(missed < 1e-20)
                for mid, rad in (rounded(ball, 65) for ball in balls if ball.is_finite()):
                    assert abs(mid - wanted) <= rad + mpmath.mpf(10) ** -60
    assert told > 10


@pytest.mark.parametrize("text", [text for text in FORMULAS if "b" in text])
def test_complex_steps_are_derivatives(text: str) -> None:
    drift, h = sa.Drift(text), arb(10) ** -40
    u, b = sympy.symbols("u b", real=True)
    slope = sympy.diff(drift.expression(), b)
    wanted = float(slope.subs({u: sympy.Rational(3, 10), b: sympy.Rational(1, 2)}).evalf(30))
    with precision(200):
        phi = pieces(drift.bind(b="1/2"), fmpq(-1), fmpq(1), {"b": acb(0.5, h)})[0].phi
        series, missed = phi.taylor(fmpq(3, 10), fmpq(1, 100), 60)
        assert missed < 1e-50
        for value in (phi(arb(fmpq(3, 10))), series(arb(0))):
            assert float((acb(value).imag / h).mid()) == pytest.approx(wanted, rel=1e-14)
    (rows,) = FloatDrift(drift, {"b": np.array([0.5, 0.5 + 1e-30j])}, 2).parts
    found = rows(np.array([[0.3, 0.3]]), np.arange(2))[0, 1].imag / 1e-30
    assert found == pytest.approx(wanted, rel=1e-13)


SINGULAR = {
    -1.25: ["sqrt(u + 5/4)", "(u + 5/4)**(-3/2)", "(u + 5/4)**(1/3)", "(u + 5/4)**pi",
            "log(u + 5/4)", "acosh(u + 9/4)", "1/(u + 5/4)", "tan(2*pi*u/5)", "asin(4*u/5)",
            "acos(4*u/5)", "atanh(4*u/5)", "sqrt(25/16 - u**2)"],
    1.25j: ["atan(4*u/5)", "asinh(4*u/5)", "sqrt(u**2 + 25/16)", "log(u**2 + 25/16)",
            "tanh(2*pi*u/5)", "1/(u**2 + 25/16)", "sqrt(u**2 + 25/16)**3*exp(u)"],
}  # fmt: skip


@pytest.mark.parametrize("at", SINGULAR)
def test_boxes_with_singularities_are_not_finite(at: complex) -> None:
    for text in SINGULAR[at]:
        with precision(100):
            phi = pieces(sa.Drift(text), fmpq(-1), fmpq(1))[0].phi
            for size in (fmpq(3, 20), fmpq(1, 4) + fmpq(1, 10**9)):
                wide = box(fmpq(-1), size, fmpq(1, 50))
                high = box(fmpq(0), fmpq(1, 50), size + 1)
                assert phi(high if at.imag else wide).is_finite() == (size < fmpq(1, 4)), text


def test_other_functions_are_refused() -> None:
    for text in ("Abs(u)", "gamma(u + 3)", "sign(u)", "Max(u, 0)", "airyai(u)", "erfc(u)", "I*u"):
        with pytest.raises(sa.InputError):
            sa.Drift(text)


# -- float64 ---------------------------------------------------------------------------------------


def test_rows_of_polynomials() -> None:
    rng = np.random.default_rng(1)
    z0, mu = rng.uniform(-1, 1, 50), F(1, 3)
    drift = sa.friction(mu, 1)
    field, again = (FloatDrift(drift, {"z0": z0}, 50, long=x) for x in (False, True))
    (plain,), (long,) = field.parts, again.parts
    u = rng.uniform(-1, 1, (20, 50))
    rows = rng.permutation(50)
    exact = [
        [1 - F(z0[j]) - (1 + mu) * F(x) + mu * F(x) ** 3 for x, j in zip(one, rows, strict=True)]
        for one in u
    ]
    errors = [
        max(
            abs(F(a) - b) / abs(b)
            for a, b in zip(found(u, rows).ravel(), sum(exact, []), strict=True)
        )
        for found in (plain, long)
    ]
    assert errors[1] <= F(1.01) * F(1, 2**53) < errors[0]
    for end, side in zip(again.ends, (-1, 1), strict=True):
        wanted = [float(1 - F(z) - (1 + mu) * side + mu * side) for z in z0]
        assert end.tolist() == wanted


def test_coefficients_that_cancel() -> None:
    rng = np.random.default_rng(2)
    a = 1000 + rng.uniform(0, 1, 9)
    drift = sa.Drift("1/2 - (a**2 - b)*u").bind(a=a, b=a**2 - rng.uniform(0.5, 2, 9))
    found = sa.escape_time(drift, 0.5, 3, full=True)
    for k, (value, error) in enumerate(zip(found.value, found.error, strict=True)):
        one = drift.bind(**{name: float(x[k]) for name, x in drift.values.items()})
        assert abs(value - sa.escape_time(one, 0.5, 3, dps=25)) <= error
    plain = sa.Drift("pi*u - 1/2")
    assert sa.escape_time(plain, [0.5], 2)[0] == sa.escape_time(plain, 0.5, 2)
