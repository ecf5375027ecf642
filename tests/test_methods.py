"""Every method on every scene of the table.

Values and claims beside the truth, arrays and logarithms beside single values, complements, digits.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction as F
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.drift.scenes import QUANTITIES, Request
from symasym.methods import ask
from symasym.workshop import check, reference_quadrature
from tests.problems import BY_NAME, PROBLEMS, Problem, distance, logarithm, relative, tagged

SLOW = {"slow", "narrow", "extreme"}
METHODS = ("exact", "paper", "laplace", "uniform", "strong_noise", "bound")


def cases(*quantities: str) -> list[Any]:
    """Problem and quantity; the scenes that take long are slow tests."""
    return [
        pytest.param(p, name, marks=pytest.mark.slow if p.tags & SLOW else (), id=f"{p}, {name}")
        for p in PROBLEMS
        for name in quantities or QUANTITIES
        if "refused" not in p.tags and (p.slides or "P" not in name)
    ]


def asked(problem: Problem, quantity: str, kappa: Any = None, **options: Any) -> Any:
    """The answer, or None where the method refuses."""
    if kappa is not None:
        problem = replace(problem, kappa=kappa)
    try:
        return problem.ask(quantity, **options)
    except sa.SymasymError:
        return None


@cache
def exactly(name: str, quantity: str) -> Any:
    """The value to 60 digits, from a closed form where there is one."""
    problem = BY_NAME[name]
    if quantity in problem.closed:
        return problem.known(quantity, 60)
    return asked(problem, quantity, dps=60)


def log_exactly(problem: Problem, quantity: str) -> Any:
    """Its logarithm; of a probability close to 1 by the complement."""
    value, context = exactly(problem.name, quantity), mpmath.MPContext()
    context.dps = 60
    if value is not None and quantity != "T" and value > 0.5:
        other = quantity[4:] if quantity[:1] == "1" else f"1 - {quantity}"
        return context.log1p(-context.convert(exactly(problem.name, other)))
    return None if value is None else logarithm(value)


# -- values and claims -----------------------------------------------------------------------------


@pytest.mark.every(6)
@pytest.mark.parametrize(("problem", "quantity"), cases())
def test_values_and_claims(problem: Problem, quantity: str) -> None:
    """No method is farther from the truth than it says; exact ones have the digits asked for."""
    found = list(check.records(problem, [quantity]))
    assert not [r for r in found if not r.holds]
    exact = [r for r in found if r.method == "exact"]
    assert exact or problem.tags & {"may refuse", "extreme"} or F(problem.kappa) < F(1, 5)
    for r in exact:
        assert r.kind == "bound"
        assert r.error <= (1e-12 if r.digits is None else 1.01 * 10.0**-r.digits)
    for r in found:
        assert (r.stated is None) == (r.kind == "none")
        if F(problem.kappa) >= F(3, 10) and r.method == "strong_noise" and r.order == 8:
            assert r.stated is not None


@pytest.mark.every(5)
@pytest.mark.parametrize("problem", tagged("quadrature"), ids=str)
def test_plain_quadrature_agrees(problem: Problem) -> None:
    for name in problem.quantities:
        if name != "1 - C":
            found = problem.by_quadrature(name, 20)
            assert relative(problem.ask(name, dps=25), found) <= 1e-20, name
    if problem.slides:
        for y in (F(3, 10), F(-5, 2)):
            scene = problem.make(), F(problem.kappa), y
            found = reference_quadrature.stationary_density(*scene, 20)
            assert relative(sa.stationary_density(*scene, dps=25), found) <= 1e-20


@pytest.mark.parametrize("problem", [p for p in tagged("sliding") if not p.tags & SLOW], ids=str)
def test_densities(problem: Problem) -> None:
    """At two points and in an array, to float64 and to digits that are proved."""
    drift, kappa, points = problem.make(), problem.kappa, ("3/10", "-5/2")
    logs = sa.stationary_density(drift, kappa, [0.3, -2.5], log=True, full=True)
    for k, y in enumerate(points):
        fine = sa.stationary_density(drift, kappa, y, dps=60)
        if f"p({y})" in problem.closed:
            assert relative(fine, problem.known(f"p({y})", 60)) <= mpmath.mpf(10) ** -60
        coarse = sa.stationary_density(drift, kappa, y, dps=25, full=True)
        assert distance(coarse.value, fine) <= coarse.error <= 1.01e-25 * fine
        there = sa.stationary_density(drift, F(float(F(kappa))), float(F(y)), dps=25, log=True)
        assert distance(float(logs.value[k]), there) <= logs.error[k]


@pytest.mark.parametrize("problem", tagged("refused"), ids=str)
def test_known_limits_are_refused(problem: Problem) -> None:
    for options in ({}, {"dps": 30}, {"log": True, "full": True}):
        with pytest.raises(sa.SymasymError):
            problem.ask("T", **options)


# -- one scene, many scenes, logarithms ------------------------------------------------------------


@pytest.mark.every(8)
@pytest.mark.parametrize(("problem", "quantity"), cases())
def test_an_array_has_its_scalars_and_their_logarithms(problem: Problem, quantity: str) -> None:
    """At two noises: in an array, alone and with digits, within the errors stated."""
    kappa = float(F(problem.kappa))
    noises = np.array([kappa, 1.25 * kappa])
    for method in METHODS:
        if method == "bound" and quantity[-1] != "C":
            continue
        many = asked(problem, quantity, noises, method=method, log=True, full=True)
        for k, noise in enumerate(noises):
            one = asked(problem, quantity, F(noise), method=method, dps=25, log=True, full=True)
            value = np.nan if many is None else many.value[k]
            if one is None or value != value:
                assert method != "exact" or "may refuse" in problem.tags
                continue
            errors = one.error, None if many.error is None else many.error[k]
            room = sum(float(x) for x in errors if x is not None) + 4e-12 * max(1.0, abs(value))
            assert distance(float(value), one.value) <= room, (method, noise)
        if many is not None and not np.isfinite(many.value).all():
            assert many.notes
    plain = asked(problem, quantity, noises, full=True)
    for k in np.flatnonzero(np.isfinite(plain.value)):
        fine = asked(problem, quantity, F(noises[k]), dps=25)
        assert fine is None or distance(float(plain.value[k]), fine) <= plain.error[k]


@pytest.mark.every(4)
@pytest.mark.parametrize(("problem", "quantity"), cases())
def test_logarithms(problem: Problem, quantity: str) -> None:
    """In float64 and with 25 digits; the value itself is refused where it does not fit float64."""
    log = log_exactly(problem, quantity)
    if log is None:
        assert "may refuse" in problem.tags
        return
    fine, coarse = (asked(problem, quantity, dps=dps, log=True) for dps in (25, None))
    if None in (coarse, fine):
        assert "may refuse" in problem.tags
        return
    assert relative(fine, log) <= mpmath.mpf(10) ** -25 or fine == log == 0
    assert isinstance(coarse, float)
    assert distance(coarse, log) <= 1e-12 * max(1, abs(log))
    plain = asked(problem, quantity)
    if -708 < log < 709:
        assert relative(plain, exactly(problem.name, quantity)) <= 1e-12
    else:
        assert plain is None


@pytest.mark.every(4)
@pytest.mark.parametrize(("problem", "quantity"), cases("C", "P"))
def test_complements(problem: Problem, quantity: str) -> None:
    """Each has digits of its own, and together they are 1."""
    pair = [asked(problem, name, dps=40, full=True) for name in (quantity, f"1 - {quantity}")]
    if None in pair:
        assert "may refuse" in problem.tags
        return
    with mpmath.workdps(60):
        assert abs(sum(x.value for x in pair) - 1) <= sum(x.error for x in pair)
        assert all(0 < x.error <= 1.01e-40 * x.value for x in pair)


# -- digits ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["friction", "linear sliding", "expression, cubic"])
def test_digits(name: str) -> None:
    """Those asked for, whatever mpmath's precision is, and hardly more."""
    problem = BY_NAME[name]
    for quantity in problem.quantities:
        high = problem.ask(quantity, dps=350)
        for dps in (1, 2, 15, 33, 320):
            with mpmath.workdps(7):
                value = problem.ask(quantity, dps=dps)
            assert relative(value, high) <= mpmath.mpf(10) ** -dps, quantity
            assert value._mpf_[1].bit_length() <= 3.33 * dps + 8


@pytest.mark.slow
@pytest.mark.parametrize("name", ["friction k=0.3", "linear sliding", "tanh", "hill"])
def test_thousands_of_digits(name: str) -> None:
    problem = BY_NAME[name]
    for quantity in problem.quantities:
        high = problem.ask(quantity, dps=3000)
        low = problem.ask(quantity, dps=1000)
        assert relative(low, high) <= mpmath.mpf(10) ** -1000, quantity
        if quantity in problem.closed:
            assert relative(high, problem.known(quantity, 3000)) <= mpmath.mpf(10) ** -3000


# -- orders ----------------------------------------------------------------------------------------

FRICTION, SLIDES = sa.friction(3, 1, "-0.3"), sa.friction(3, 1, "0.5")
#: Method, quantity, drift, orders, kappa, the factor for kappa, and the power of kappa per order.
ORDERS: list[tuple[str, str, sa.Drift, tuple[int, ...], str, F, int]] = [
    ("laplace", "T", FRICTION, (0, 1, 2, 3), "0.04", F(1, 2), 2),
    ("laplace", "C", FRICTION, (0, 1, 2, 3), "0.04", F(1, 2), 2),
    ("laplace", "1 - P", SLIDES, (0, 1, 2, 3), "0.04", F(1, 2), 2),
    ("laplace", "T", sa.tanh(1, -1, 2), (0, 1), "0.02", F(1, 2), 2),
    ("laplace", "T", sa.Drift("3/2 + sin(u)"), (0, 1, 2), "0.04", F(1, 2), 2),
    ("uniform", "T", FRICTION, (0, 1, 2, 4), "0.04", F(1, 2), 2),
    ("strong_noise", "T", FRICTION, (0, 1, 2, 3), "40", F(2), -2),
    ("strong_noise", "1 - C", FRICTION, (0, 1, 2, 3), "40", F(2), -2),
    ("strong_noise", "P", SLIDES, (0, 1, 2, 3), "40", F(2), -2),
]


@pytest.mark.parametrize("case", ORDERS, ids=[f"{c[0]}, {c[1]}" for c in ORDERS])
def test_errors_fall_with_the_noise_as_the_order_says(case: Any) -> None:
    method, quantity, drift, orders, kappa, factor, power = case
    numbers = {"r": 10, "start": 0}
    for order in orders:
        errors = []
        for noise in (F(kappa), F(kappa) * factor):
            scene = {"kappa": noise} | (numbers if quantity[-1] in "TC" else {})
            exact = ask(drift, scene, Request(quantity, dps=40))
            found = ask(drift, scene, Request(quantity, method=method, order=order, dps=40))
            errors.append(relative(found, exact))
        fall = float(errors[0] / errors[1])
        assert fall == pytest.approx(float(factor) ** -(power * (order + 1)), rel=0.25), order
        if method != "uniform":  # Beyond 300 digits the next differences tell the error.
            options: Any = {"method": method, "order": order, "dps": 301, "full": True}
            told = ask(drift, scene, Request(quantity, **options))
            assert 1 <= float(told.error / distance(told.value, exact)) < 4


@pytest.mark.parametrize(("kappa", "order"), [("0.06", 5), ("0.3", 1)])
def test_the_best_order(kappa: str, order: int) -> None:
    """The smallest of the stated errors; the same value without them, and in an array."""
    drift = sa.friction(3, 1, "-0.4")
    numbers = {"kappa": kappa, "r": 10, "start": 0}
    asked: Any = {"method": "laplace", "dps": 20}
    best = ask(drift, numbers, Request("T", order="optimal", full=True, **asked))
    others = [ask(drift, numbers, Request("T", order=k, full=True, **asked)) for k in range(2)]
    assert best.order == order
    assert all(best.error <= other.error for other in others)
    assert ask(drift, numbers, Request("T", order="optimal", **asked)) == best.value
    many = numbers | {"kappa": [float(kappa)]}
    asked["dps"] = None
    (same,) = ask(drift, many, Request("T", order="optimal", **asked))
    assert relative(same, best.value) < 1e-12
    assert distance(best.value, ask(drift, numbers, Request("T", dps=30))) <= best.error
