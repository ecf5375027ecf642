"""The public verbs on the table of scenes: every engine against the others."""

from __future__ import annotations

import inspect
import typing
from fractions import Fraction as F

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym import quantities
from tests.asking import ASKED, ask_or_refuse, each, later, reference
from tests.problems import (
    BY_NAME,
    PROBLEMS,
    Problem,
    distance,
    logarithm,
    relative,
    tagged,
)

# -- engines against each other ------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_float64(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        log = logarithm(value)
        allowed = 1e-12 * max(1.0, abs(float(log)))
        found = ask_or_refuse(problem, ask, log=True)
        if found is None:
            continue
        assert isinstance(found, float)
        assert distance(found, log) <= allowed, quantity
        if -708 < log < 709:
            assert relative(ask(), value) <= allowed, quantity
        else:
            with pytest.raises(sa.RangeError, match=r"log=True"):
                ask()


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_thirty_digits_are_the_first_of_sixty(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        found = ask_or_refuse(problem, ask, dps=30)
        assert found is None or relative(found, value) <= mpmath.mpf(10) ** -30, quantity


@pytest.mark.parametrize("problem", later(ASKED, "narrow"))
def test_digits_are_proved_and_nested(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        found = ask_or_refuse(problem, ask, dps=25, full=True)
        if found is not None:
            assert found.error_kind == "bound"
            assert distance(value, found.value) <= found.error, quantity
            assert found.error <= abs(found.value) * mpmath.mpf("1.01e-25"), quantity


@pytest.mark.parametrize("problem", tagged("quadrature"), ids=str)
def test_plain_quadrature_agrees(problem: Problem) -> None:
    quantity = "1-P" if problem.slides else "T"
    found = problem.by_quadrature()[quantity](12)
    assert relative(found, reference(problem.name, quantity)) <= 1e-12


@pytest.mark.slow
@pytest.mark.parametrize("problem", tagged("quadrature"), ids=str)
def test_plain_quadrature_agrees_on_everything(problem: Problem) -> None:
    for quantity, ask in problem.by_quadrature().items():
        assert relative(ask(20), reference(problem.name, quantity)) <= 1e-20, quantity


@pytest.mark.parametrize("problem", [p for p in PROBLEMS if p.closed], ids=str)
def test_closed_forms(problem: Problem) -> None:
    for quantity, ask in problem.questions().items():
        if quantity not in problem.closed:
            continue
        known = problem.known(quantity, 60)
        found = ask_or_refuse(problem, ask, dps=50)
        assert found is None or relative(found, known) <= mpmath.mpf(10) ** -50, quantity


@pytest.mark.parametrize("name", ["friction", "friction sliding", "expression, cubic"])
def test_a_thousand_digits(name: str) -> None:
    ask = BY_NAME[name].questions()["T"]
    high = ask(dps=1000)
    assert relative(ask(dps=200), high) <= mpmath.mpf(10) ** -200
    if name == "expression, cubic":
        assert relative(high, ask(dps=1100)) <= mpmath.mpf(10) ** -1000


@pytest.mark.slow
@pytest.mark.parametrize("name", ["tanh", "expression", "hill", "kink + 1e-30, stiff", "sine"])
def test_a_thousand_digits_of_other_drifts(name: str) -> None:
    for quantity, ask in BY_NAME[name].questions().items():
        assert relative(ask(dps=300), ask(dps=1000)) <= mpmath.mpf(10) ** -300, quantity


@pytest.mark.slow
@pytest.mark.parametrize("name", ["friction k=0.3", "linear sliding"])
def test_ten_thousand_digits(name: str) -> None:
    for quantity, ask in BY_NAME[name].questions().items():
        high = ask(dps=10_000)
        assert relative(ask(dps=2000), high) <= mpmath.mpf(10) ** -2000, quantity
        if quantity in BY_NAME[name].closed:
            known = BY_NAME[name].known(quantity, 10_000)
            assert relative(high, known) <= mpmath.mpf(10) ** -10_000


@pytest.mark.parametrize("problem", tagged("refused"), ids=str)
def test_limits_are_refused_in_a_sentence(problem: Problem) -> None:
    for options in ({}, {"dps": 30}, {"dps": 30, "full": True}, {"log": True}):
        with pytest.raises(sa.SymasymError, match=r"\w+.*\.$"):
            problem.questions()["T"](**options)


# -- error claims --------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "narrow", "slow", "extreme"))
def test_claimed_errors_hold(problem: Problem) -> None:
    mild = problem.tags & {"moderate", "strong"}
    for quantity, ask, value in each(problem):
        if not mild and quantity != "T":
            continue  # a ball that is refused costs up to a second
        for options in (*({"dps": 20, "log": True}, {"log": True}, {}) * bool(mild), {"dps": 20}):
            if not options and not -708 < logarithm(value) < 709:
                continue
            found = ask_or_refuse(problem, ask, full=True, **options)
            if found is None:
                continue
            assert isinstance(found, sa.Estimate)
            assert found.error_kind in ("bound", "estimate")
            assert found.method == "exact"
            true = logarithm(value, 80) if "log" in options else value
            unknown = abs(value) * mpmath.mpf(10) ** -59 if true is value else 1e-59
            assert distance(found.value, true) <= found.error + unknown, (quantity, options)
            limit = 1e-12 if "dps" not in options else mpmath.mpf("1.01e-19")
            assert found.error <= limit * max(abs(true), 1e-3), (quantity, options)


def test_kinds_of_error() -> None:
    drift = sa.friction(3, 1, "-0.3")
    for kappa in ("0.3", "1e-6"):
        assert sa.escape_time(drift, kappa, 10, dps=20, full=True).error_kind == "bound"
    many = sa.escape_time(drift, [0.3, 1.0], 10, full=True)
    assert many.error_kind == "estimate"
    assert many.value.shape == many.error.shape == (2,)
    one = sa.escape_time(drift, 0.3, 10, full=True)
    assert isinstance(one.value, float)
    assert isinstance(one.error, float)
    paper = sa.escape_time(drift, "0.3", 10, method="paper", full=True)
    assert (paper.error_kind, paper.error) == ("none", None)


@pytest.mark.parametrize("name", ["friction", "linear sliding, uneven", "sine weak", "hill n=12"])
def test_claimed_errors_of_arrays_hold(name: str) -> None:
    problem = BY_NAME[name]
    kappas = [str(F(problem.kappa) * F(k, 7)) for k in (5, 6, 7, 9, 14)]
    drift, scene = problem.make(), (problem.r,)
    for log in (False, True):
        floats = np.array([float(F(k)) for k in kappas])
        found = sa.escape_time(drift, floats, *scene, start=problem.start, log=log, full=True)
        for k, value, error in zip(floats, found.value, found.error, strict=True):
            true = sa.escape_time(drift, F(k), *scene, start=problem.start, dps=30)
            true = logarithm(true) if log else true
            assert distance(value, true) <= error
            assert error <= 1e-11 * max(1, abs(true))


def test_str_of_an_estimate_shows_value_error_and_kind() -> None:
    drift = sa.linear(1, -1)
    text = str(sa.escape_time(drift, 1, 2, dps=20, full=True))
    assert "±" in text
    assert "exact" in text
    assert "no error claimed" in str(sa.escape_time(
        sa.friction(3, 1, "-0.3"), "0.3", 10, method="paper", full=True
    ))  # fmt: skip
    assert "estimate" in str(sa.escape_time(drift, [1.0, 2.0], 2, full=True))


# -- logarithms ----------------------------------------------------------------------------------


@pytest.mark.parametrize("problem", later(ASKED, "slow"))
def test_logarithms_have_all_their_digits(problem: Problem) -> None:
    for quantity, ask, value in each(problem):
        found = ask_or_refuse(problem, ask, dps=25, log=True)
        complement = {"C": "1-C", "1-C": "C", "P": "1-P", "1-P": "P"}.get(quantity)
        if found is None:
            continue
        if complement and value > 0.5:
            rest = reference(problem.name, complement)
            context = mpmath.MPContext()
            context.dps = 50
            log = context.log1p(-context.convert(rest))
        else:
            log = logarithm(value)
        if log:
            assert relative(found, log) <= mpmath.mpf(10) ** -25, quantity
        else:
            assert found == 0


def test_logarithm_of_a_value_next_to_one() -> None:
    # T = r^2/kappa^2 = 1 + 1e-40
    drift = sa.polynomial(0)
    r = F(1) + F("1e-40")
    found = sa.escape_time(drift, 1, r, dps=20, log=True)
    assert relative(found, mpmath.mpf(F("2e-40").numerator) / F("2e-40").denominator) < 1e-15
    assert sa.escape_time(drift, 1, 1, dps=20, log=True) == 0
    assert sa.escape_time(drift, 1, 1, log=True) == pytest.approx(0, abs=1e-14)


@pytest.mark.parametrize(
    "verb", ["escape_time", "exit_probability", "occupation", "stationary_density"]
)
def test_types_have_the_options_that_the_verb_has(verb: str) -> None:
    whole = inspect.unwrap(getattr(sa, verb))
    stubs = typing.get_overloads(whole)
    assert [s.__annotations__["return"] for s in stubs] == ["Estimate", "Value", "Answer"]
    for stub in stubs:
        options = getattr(quantities, stub.__annotations__["options"][len("Unpack[") : -1])
        own = {n: kind.__forward_arg__ for n, kind in options.__annotations__.items()}
        given = {n: x for n, x in stub.__annotations__.items() if n != "options"} | own
        same = {"full": whole.__annotations__["full"], "return": whole.__annotations__["return"]}
        assert given | same == whole.__annotations__
