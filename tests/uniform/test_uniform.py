"""T, C and P by panels in canonical form, against the exact engines."""

from __future__ import annotations

import math
import random
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.base.errors import AccuracyError

U = sympy.Symbol("u", real=True)
NOISE = (0.05, 0.1, 0.2, 0.3)


def fold(mu: str) -> Fraction:
    """z0 where the well is born."""
    if mu == "3":
        return Fraction(-7, 9)
    m = float(mu)
    return Fraction(1 - 2 / 3 * (1 + m) * math.sqrt((1 + m) / (3 * m)))


def off(method: Any, exact: float) -> float:
    return abs(math.expm1(method - exact))


@pytest.mark.parametrize("mu", ["9", "3", "1", "0.7"])
def test_through_fold_and_end(mu: str) -> None:
    beside = [fold(mu) + Fraction(x) for x in ("0", "1e-13", "-1e-13")]
    far = map(Fraction, ("-2", "-0.9", "-0.4", "-0.1", "-0.01", "-1e-6"))
    for z0 in (*beside, *far):
        drift = sa.friction(mu=mu, alpha=1, z0=z0)
        exact = sa.escape_time(drift, NOISE, 10, log=True)
        for order, goal in enumerate((0.3, 3, 30)):
            found = sa.escape_time(drift, NOISE, 10, method="uniform", order=order, log=True)
            errors = np.abs(np.expm1(np.asarray(found) - exact))
            assert (errors <= goal * np.array(NOISE) ** (2 * order + 2) + 1e-11).all(), (z0, order)


DRIFTS = [
    ("1 - 13/10*sin(pi*u)", 0, 2e-3, 4e-7),
    ("1 - 19/20*sin(pi*u)", 0, 2e-3, 4e-7),
    ("1 - 13/10*sin(2*pi*u)", 0, 2e-3, 2e-6),
    ("1 - 11/10*sin(3*pi*u)", 0, 2e-3, 3e-6),
    ("11/10 - 9/10*tanh(3*u)/tanh(3)", 0, 1e-2, 6e-4),
    ("9/20 + u/10 - 2*u**2 + u**3/5 + 9/5*u**4", "-2/5", 4e-3, 1e-4),
    ("9/20 + u/10 - 2*u**2 + u**3/5 + 9/5*u**4", "7/10", 4e-3, 1e-4),
    ("7/10 - 2*u + 3/2*u**3", "0.39688857852827417", 1e-3, 2e-7),
    ("7/10 - 2*u + 3/2*u**3", "0.90391360430250663", 1e-3, 2e-7),
    ("7/10 - 2*u + 3/2*u**3", "-2", 1e-3, 2e-7),
    ("7/10 - 2*u + 3/2*u**3", "1", 1e-3, 2e-7),
]


@pytest.mark.parametrize(("text", "start", "first", "third"), DRIFTS)
def test_other_drifts_and_starts(text: str, start: Any, first: float, third: float) -> None:
    drift = sa.Drift(text)
    exact = sa.escape_time(drift, "0.2", 10, start=start, log=True)
    for order, most in ((0, first), (2, third)):
        ask = {"start": start, "method": "uniform", "order": order, "log": True}
        assert off(sa.escape_time(drift, "0.2", 10, **ask), exact) < most
        found = sa.exit_probability(drift, "0.2", 10, complement=True, full=True, **ask)
        true = sa.exit_probability(drift, "0.2", 10, start=start, complement=True, log=True, dps=20)
        assert found.error_kind == "bound"
        assert abs(found.value - true) <= found.error < 3 * max(most, 1e-12)


@pytest.mark.parametrize("text", ["1/5 - u", "1/5 + u/2 - u**2/10 - u**3", "-u - 3/10*sin(2*pi*u)"])
def test_occupation(text: str) -> None:
    drift = sa.Drift(text)
    for complement in (True, False):
        exact = sa.occupation(drift, "0.1", complement=complement, log=True, dps=20)
        for order in (0, 2):
            found = sa.occupation(
                drift, "0.1", complement=complement, method="uniform", order=order, log=True,
                full=True,
            )  # fmt: skip
            assert abs(found.value - exact) <= found.error < (1e-2, 1e-5)[order > 0]


@pytest.mark.parametrize(
    ("text", "kappa", "r", "true"),
    [
        ("(u + 21/20)*(u + 1/10)*(u - 4/5)", "0.2", "1", 15521.4),
        ("(u + 21/20)*(u + 1/10)*(u - 4/5)", "0.2", "1.02", None),
        ("(u + 21/20)*(u + 1/10)*(u - 4/5)", "0.2", "0.98", None),
        ("(u - 51/100)*(u + 3/10)*(u + 26/25)", "0.17", "1", 800.7),
        ("7/5 - 4*u + 3*u**3", "0.2", "0.4", 0.739),
    ],
)
def test_zeros_just_beyond_an_end(text: str, kappa: str, r: str, true: float | None) -> None:
    drift = sa.Drift(text)
    exact = sa.escape_time(drift, float(kappa), r, dps=30)
    assert true is None or abs(exact / true - 1) < 1e-3
    for order in (0, 2, 4):
        found = sa.escape_time(drift, [float(kappa)], r, method="uniform", order=order, full=True)
        assert abs(found.value[0] - exact) <= found.error[0] < exact / 2
        assert found.error_kind == "bound"


@pytest.mark.parametrize("gap", ["0", "1e-25", "-1e-25", "1e-12", "-1e-12", "1e-6", "-1e-1"])
def test_no_digit_is_lost_at_a_fold(gap: str) -> None:
    drift = sa.friction(mu=3, alpha=1, z0=Fraction(-7, 9) + Fraction(gap))
    few, many = (
        sa.escape_time(drift, "0.1", 10, method="uniform", order=2, dps=dps) for dps in (25, 60)
    )
    with mpmath.workdps(70):
        assert abs(few / many - 1) < 1e-24


def claims(rng: random.Random, adverse: bool) -> Any:
    """A random polynomial drift with its scene; adverse ones have zeros near the ends."""
    degree = rng.choice((2, 3, 3, 4))
    if adverse:
        zeros = [
            Fraction(rng.choice((1, -1)) * (1000 + rng.randint(-60, 120)), 1000)
            if rng.random() < 0.6
            else Fraction(rng.randint(-99, 99), 100)
            for _ in range(degree)
        ]
        A = Fraction(rng.choice((-30, -10, 5, 20)), 10) * sympy.prod(
            U - sympy.Rational(z.numerator, z.denominator) for z in zeros
        )
        r = rng.choice(("1", "1.02", "0.98", "1/2", "3"))
    else:
        A = sum(sympy.Rational(rng.randint(-30, 30), 10) * U**k for k in range(degree + 1))
        r = "10"
    start = Fraction(rng.choice((0, 0, rng.randint(-40, 40))), 100)
    return A, Fraction(rng.randint(5, 30), 100), r, start


@pytest.mark.parametrize("adverse", [False, True])
def test_claims_are_kept(adverse: bool) -> None:
    """Bounds hold; what isn't refused is within half of the value, a logarithm to a factor 2."""
    rng, claimed = random.Random(12), 0
    while claimed < 40:
        A, kappa, r, start = claims(rng, adverse)
        drift = sa.Drift(A, U)
        if 0 in drift.ends:
            continue
        exact = sa.escape_time(drift, kappa, r, start=start, log=True)
        left = sa.exit_probability(drift, kappa, r, start=start, log=True)
        for order in (0, 2):
            ask = {"start": start, "method": "uniform", "order": order, "log": True, "full": True}
            for verb, true in ((sa.escape_time, exact), (sa.exit_probability, left)):
                try:
                    found = verb(drift, [float(kappa)], r, **ask)
                    plain = verb(drift, kappa, r, **{**ask, "full": False})
                except AccuracyError:
                    continue
                claimed += 1
                case = A, kappa, r, start, order
                assert abs(found.value[0] - true) <= found.error[0] + 3e-12, case
                assert abs(plain - true) < math.log(2), case


def test_arrays_are_scenes() -> None:
    z0, kappa = np.linspace(-1, -0.2, 3)[:, None], np.array([0.02, 0.3])
    found = sa.escape_time(
        sa.friction(mu=3, alpha=1, z0=z0), kappa, [2, 10], method="uniform", log=True, full=True
    )
    for row, z in enumerate(z0[:, 0]):
        for k, r in enumerate((2, 10)):
            one = sa.friction(mu=3, alpha=1, z0=float(z))
            ask = {"method": "uniform", "log": True}
            assert found.value[row, k] == pytest.approx(
                sa.escape_time(one, float(kappa[k]), r, **ask), rel=1e-12
            )
            exact = sa.escape_time(one, float(kappa[k]), r, log=True)
            assert abs(found.value[row, k] - exact) <= found.error[row, k] + 1e-11 * abs(exact)
    assert found.error_kind == "bound"


def test_what_is_not_known_is_refused() -> None:
    with pytest.raises(AccuracyError, match="error exceeds half"):
        sa.escape_time(sa.friction(mu=3, alpha=1, z0="-0.4"), 3, 10, method="uniform")
    with pytest.raises(AccuracyError, match=r"three zeros|error exceeds half"):
        sa.escape_time(sa.Drift("-u**3 + u**4/9"), "0.2", 2, method="uniform")
    with pytest.raises(sa.InputError, match="whole number"):
        sa.escape_time(sa.linear(1, 2), "0.2", 2, method="uniform", order=7)


@pytest.mark.parametrize("z0", ["-7/9", "-0.7", "-0.9", "-0.4"])
def test_the_stokes_multiplier(z0: str) -> None:
    """By the potential's values at both zeros; at the fold 1/2."""
    drift = sa.friction(mu=3, alpha=1, z0=z0)
    found = sa.stokes_multiplier(drift, "0.1", dps=20)
    step = sa.stokes_multiplier(drift, "0.1", method="step")
    if z0 == "-7/9":
        assert found == step == 0.5
        return
    assert step == (z0 != "-0.9")
    with mpmath.workdps(30):
        z = mpmath.mpf(z0)
        roots = mpmath.polyroots([3, 0, -4, 1 - z], maxsteps=200, extraprec=200)
        one, other = sorted(roots, key=lambda u: mpmath.re(u))[1:]
        V = lambda u: -(1 - z) * u + 2 * u**2 - mpmath.mpf(3) / 4 * u**4  # noqa: E731
        gap = V(other) - V(one)
        size = (mpmath.mpf(3) / 4 * abs(gap)) ** (mpmath.mpf(2) / 3)
        Z = 200 ** (mpmath.mpf(2) / 3) * (size if step else -size)
        there, back = (mpmath.airyai(x) ** 2 + mpmath.airybi(x) ** 2 for x in (Z, -Z))
        assert abs(found / (there / (there + back)) - 1) < 1e-18


def test_no_multiplier_without_a_fold() -> None:
    with pytest.raises(sa.InputError, match="turning point"):
        sa.stokes_multiplier(sa.linear(1, 2), "0.1")
    assert sa.stokes_multiplier(sa.friction(3, 1, "-0.4"), "1e-160") == 1
