"""Logarithmic derivatives, against closed forms, exact identities and plain quadrature."""

from __future__ import annotations

import time
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.base.errors import InputError
from symasym.workshop import reference_quadrature
from tests.problems import PROBLEMS, Problem

LONG = {"refused", "slow", "narrow", "analytic", "extreme"}


def number(x: Any) -> Any:
    exact = Fraction(x)
    return mpf(exact.numerator) / exact.denominator


def sum_of(found: sa.Sensitivity, weights: dict[str, Any]) -> tuple[Any, Any]:
    """Weighted sum of the derivatives, and of their errors."""
    total = sum(number(w) * found.derivative[name] for name, w in weights.items())
    return total, sum(abs(number(w)) * found.error[name] for name, w in weights.items())


@pytest.mark.parametrize(("a", "kappa", "r"), [("2/3", "1.1", "4"), ("-1", "0.3", "2.5")])
def test_a_constant_drift(a: str, kappa: str, r: str) -> None:
    # At x = 0 T is (r/a) tanh(a r/kappa^2).
    found = sa.sensitivity(sa.polynomial(a), kappa, r, dps=40)
    assert found.error_kind == "bound"
    with mp.workdps(60):
        c, k, R = (number(x) for x in (a, kappa, r))
        b = c * R / k**2
        slope = 2 * b / mp.sinh(2 * b)
        known = {"c0": (slope - 1) / c, "kappa": -2 * slope / k, "r": (1 + slope) / R}
        # From x: T = (r - x)/a - (2r/a) C, C = (e^{-2ax/k^2} - e^{-2ar/k^2})/(2 sinh(2ar/k^2)).
        known["start"] = (-1 / c + 2 * R / k**2 / mp.sinh(2 * b)) / (R / c * mp.tanh(b))
        for name, value in known.items():
            assert abs(found.derivative[name] - value) <= found.error[name]
            assert found.error[name] <= mpf("1e-40") * max(1, abs(value))
        assert abs(found.condition["kappa"] - 2 * slope) < mpf("1e-38")


@pytest.mark.parametrize(
    ("coefficients", "kappa", "r", "start", "dps"),
    [
        (["0.7", "-1/3", "0.2", "0.5"], "0.4", "4", "0.3", 30),
        (["1.4", "-4", "0", "3"], "0.1", "10", "0", 12),  # friction with a well
        (["1.4", "-4", "0", "3"], "1e-8", "10", "0", 8),
        (["0", "-1"], "0.7", "3", "0", 25),
        (["0", "1"], "30", "2", "1/2", 25),
    ],
)
def test_scaling_of_space_and_time(
    coefficients: list[str], kappa: str, r: str, start: str, dps: int
) -> None:
    drift = sa.polynomial(*coefficients)
    weights = {f"c{k}": c for k, c in enumerate(coefficients)} | {"kappa": Fraction(kappa) / 2}
    for quantity, known in (("T", -1), ("C", 0), ("1 - C", 0)):
        # A drift twice as large with a squared noise twice as large does all in half the time.
        found = sa.sensitivity(drift, kappa, r, start=start, quantity=quantity, dps=dps)
        with mp.workdps(2 * dps + 30):
            total, error = sum_of(found, weights)
            assert abs(total - known) <= error
        for name, value in found.derivative.items():
            assert found.error[name] <= mpf(10) ** -dps * 1.01 * max(1, abs(value))


@pytest.mark.parametrize(
    ("quantity", "name"),
    [("T", "mu"), ("T", "r"), ("T", "start"), ("C", "start"), ("C", "r"), ("1 - C", "r"),
     ("1 - P", "kappa")],
)  # fmt: skip
def test_against_differences_of_plain_quadrature(quantity: str, name: str) -> None:
    at = {"mu": Fraction(3), "alpha": Fraction(1), "z0": Fraction(1, 4)}
    numbers = {"kappa": Fraction(1), "r": Fraction(2), "start": Fraction(1, 3)}

    def log_of(values: dict[str, Fraction]) -> Any:
        *parameters, kappa, r, start = values.values()
        drift = sa.friction(*parameters)
        if quantity == "1 - P":
            return mp.log(1 - reference_quadrature.occupation(drift, kappa, 14))
        if quantity == "T":
            return mp.log(reference_quadrature.escape_time(drift, kappa, r, start, 14))
        chance = reference_quadrature.exit_probability(drift, kappa, r, start, 14)
        return mp.log(chance if quantity == "C" else 1 - chance)

    scene = {} if quantity == "1 - P" else {"r": numbers["r"], "start": numbers["start"]}
    found = sa.sensitivity(sa.friction(**at), numbers["kappa"], **scene, quantity=quantity, dps=15)
    h = Fraction(1, 10**4)
    with mp.workdps(30):
        x = at | numbers
        below, above = (log_of(x | {name: x[name] + k * h}) for k in (-1, 1))
        slope = float((above - below) / (2 * number(h)))
    assert found.derivative[name] == pytest.approx(slope, rel=1e-6)


def test_arrays_are_their_scalars() -> None:
    z0, kappa = np.array([-1.2, -0.5]), np.array([[0.3], [2.0]])
    found = sa.sensitivity(sa.friction(mu=3, alpha=1, z0=z0), kappa, "5")
    assert all(value.shape == (2, 2) for value in found.derivative.values())
    one = sa.sensitivity(sa.friction(mu=3, alpha=1, z0=-0.5), 2.0, "5")
    assert list(one.derivative) == ["mu", "alpha", "z0", "kappa", "r", "start"]
    for name, value in one.derivative.items():
        assert isinstance(value, float)
        apart = abs(value - found.derivative[name][1, 1])
        assert apart <= one.error[name] + found.error[name][1, 1]
        assert 0 < one.error[name] <= 1e-9 * max(1, abs(value))


@pytest.mark.every(9)
@pytest.mark.parametrize("problem", [p for p in PROBLEMS if not p.tags & LONG], ids=str)
def test_float64_claims_hold_on_the_table(problem: Problem) -> None:
    drift, names = problem.make(), ("T", "C", *(("1 - P",) if problem.slides else ()))
    for quantity in names:
        scene = {} if "P" in quantity else {"r": problem.r, "start": problem.start}
        options = {"quantity": quantity, **scene}
        proved = sa.sensitivity(drift, problem.kappa, **options, dps=17)
        found = sa.sensitivity(drift, problem.kappa, **options)
        assert proved.error_kind == "bound"
        for name, value in found.derivative.items():
            off = abs(mpf(value) - proved.derivative[name])
            assert off <= found.error[name] + proved.error[name], (quantity, name)


def test_weak_noise_stays_in_float64() -> None:
    begun = time.process_time()
    sa.sensitivity(sa.friction(mu=3, alpha=1, z0=np.linspace(-2, -0.1, 400)), 0.1, 10)
    assert time.process_time() - begun < 4  # in balls 20


@pytest.mark.parametrize("kappa", [0.05, 0.5])
def test_float64_claims_hold_where_A_is_no_polynomial(kappa: float) -> None:
    drift = sa.tanh(1, -0.5, 4.0)
    proved, found = (sa.sensitivity(drift, kappa, 3.0, dps=dps) for dps in (17, None))
    for name, value in found.derivative.items():
        assert abs(mpf(value) - proved.derivative[name]) <= found.error[name] + proved.error[name]


@pytest.mark.parametrize(
    "call",
    [
        lambda: sa.sensitivity(sa.linear(1, -1), 1),
        lambda: sa.sensitivity(sa.linear(1, -1), 1, 2, quantity="P"),
        lambda: sa.sensitivity(sa.linear(1, -1), 1, 2, quantity="p_ss"),
        lambda: sa.sensitivity(sa.linear(1), 1, 2),
        lambda: sa.sensitivity("friction", 1, 2),
        lambda: sa.sensitivity(sa.linear(1, 1), 1, 2, dps=5000),
        lambda: sa.sensitivity(sa.linear([1, 2], 1), 1, 2, dps=20),
        lambda: sa.sensitivity(sa.linear(1, 1), 1, quantity="P"),
    ],
)
def test_bad_input(call: Any) -> None:
    with pytest.raises(InputError):
        call()


def test_a_needle_in_the_derivative_alone() -> None:
    # Where b is 0 the needle is in dA/db, between the nodes that suffice for A.
    drift = sa.Drift("1 - u/2 + b*exp(-(1000*(u - 1/3))**2)").bind(b=0)
    found = sa.sensitivity(drift, "0.5", 2)
    assert found.derivative["b"] == pytest.approx(-0.000836945634543285, rel=1e-11)
