"""The plan of a scene, and method="auto": the stated error allowed is never exceeded."""

from __future__ import annotations

import importlib
import re
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from tests.problems import PROBLEMS, Problem
from tests.strategies import SAMPLE, WHOLE, drifts, scenes

# `sa.plan` is the verb.
plans: Any = importlib.import_module("symasym.plan")

FRICTION = sa.friction(3, 1, "-0.4")
EASY = [p for p in PROBLEMS if not p.tags & {"slow", "refused", "narrow", "may refuse", "extreme"}]


def check(drift: sa.Drift, kappa: Any, r: Any, start: Any, rtol: str, turn: int = 2) -> None:
    """T, C and P, and the complements of both (of one of them in turn 0 and 1)."""
    asked: list[tuple[Any, dict[str, Any]]] = [(sa.escape_time, {"r": r, "start": start})]
    a_minus, a_plus = drift.ends
    for complement in (False, True):
        if turn != complement:
            asked.append((sa.exit_probability, {"r": r, "start": start, "complement": complement}))
        if a_minus > 0 > a_plus and turn in (complement, 2):
            asked.append((sa.occupation, {"complement": complement}))
    for verb, options in asked:
        exact = verb(drift, kappa, **options, dps=40)
        found = verb(drift, kappa, **options, method="auto", rtol=rtol, dps=30, full=True)
        with mpmath.workdps(40):
            wrong = abs(found.value - exact)
            slack = abs(exact) * mpmath.mpf(10) ** -39
            assert wrong <= found.error + slack, (verb.__name__, found)
            assert found.error <= mpmath.mpf(rtol) * abs(found.value) * (1 + mpmath.mpf(10) ** -9)
            assert wrong <= mpmath.mpf(rtol) * abs(exact)


@pytest.mark.parametrize("problem", EASY, ids=str)
@WHOLE
def test_the_error_allowed_holds_on_the_table(problem: Problem, whole: bool) -> None:
    turn = 2 if whole else EASY.index(problem) % 2
    check(problem.make(), problem.kappa, problem.r, problem.start, "1e-4", turn)


@settings(SAMPLE, max_examples=15)
@given(scenes(-1.5, drifts()), st.sampled_from(["1e-1", "1e-3", "1e-6"]))
def test_the_error_allowed_holds_on_random_scenes(scene: Any, rtol: str) -> None:
    check(*scene, rtol)


def test_arrays_use_what_each_element_needs() -> None:
    z0 = np.array([-2, -0.4, -0.1])
    kappa = np.array([[0.05], [0.3], [40.0]])
    drift = sa.friction(mu=3, alpha=1, z0=z0)
    found = sa.escape_time(drift, kappa, 10, method="auto", rtol=1e-6, full=True, log=True)
    exact = sa.escape_time(drift, kappa, 10, log=True)
    assert found.value.shape == (3, 3)
    assert (np.abs(found.value - exact) <= found.error + 1e-12 * np.abs(exact)).all()
    assert (found.error <= 1e-6).all()
    # What is cheap to integrate is integrated.
    assert found.method == "exact"
    share = sa.occupation(
        sa.linear(1, -2), [0.1, 0.3, 40.0], complement=True, method="auto", rtol=1e-4
    )
    wanted = sa.occupation(sa.linear(1, -2), [0.1, 0.3, 40.0], complement=True)
    assert np.allclose(share, wanted, rtol=1e-4, atol=0)


def within(drift: sa.Drift, kappa: Any, r: Any, start: Any, rtol: float) -> set[str]:
    """What arrays state against what was asked for and what is true; the methods used."""
    scene = {"start": start, "log": True}
    exact = sa.escape_time(drift, kappa, r, **scene)
    found = sa.escape_time(drift, kappa, r, **scene, method="auto", rtol=rtol, full=True)
    assert (np.expm1(found.error) <= rtol).all()
    known = 1e-12 * np.maximum(1, np.abs(exact))
    assert (np.abs(found.value - exact) <= found.error + known).all()
    return {name.split(",")[0] for name in found.terms}


@pytest.fixture
def dear(monkeypatch: pytest.MonkeyPatch) -> None:
    """Exact integrals are so dear that every expansion is tried."""
    monkeypatch.setattr(plans, "_SECONDS_EXACT", 1e9)


@pytest.mark.usefixtures("dear")
@pytest.mark.parametrize("rtol", [0.3, 1e-2, 1e-3])
def test_arrays_through_the_fold_and_to_the_kink(rtol: float) -> None:
    around = -7 / 9 + np.array([-1e-2, -1e-6, -1e-12, 0, 1e-12, 1e-6, 1e-2])
    z0 = np.concatenate([np.linspace(-2, -1e-6, 21), around])[:, None]
    for drift, r, start in (
        (sa.friction(3, 1, z0), 10, 0),
        (sa.friction(3, 1, z0), 10, -0.9),
        (sa.polynomial(z0 - 1, -4, 0, 3), 3, 0.2),
    ):
        methods = within(drift, np.geomspace(0.02, 0.4, 12), r, start, rtol)
        assert {"laplace", "uniform", "exact"} - {"exact" if rtol > 0.1 else ""} <= methods


@pytest.mark.usefixtures("dear")
@pytest.mark.parametrize("problem", [p for p in EASY if "analytic" not in p.tags], ids=str)
def test_arrays_on_the_table(problem: Problem) -> None:
    kappa = float(Fraction(problem.kappa)) * np.array([0.5, 0.9, 1.0])
    where = float(Fraction(problem.r)), float(Fraction(problem.start))
    for rtol in (1e-2, 1e-4):
        within(problem.make(), kappa, *where, rtol)


def held(made: Any, exact: Any) -> None:
    """The estimate of a plan is as wrong as it says at most, and that is allowed."""
    value, error = made.estimate
    with mpmath.workdps(40):
        # The exact value has 30 digits.
        assert abs(value - exact) <= error + abs(exact) * mpmath.mpf(10) ** -29
        assert error <= made.error * abs(value) * (1 + 1e-9)
        assert made.error <= made.rtol


@pytest.mark.parametrize(
    "problem", [p for p in EASY if not p.tags & {"analytic", "stiff"}][::4], ids=str
)
def test_the_estimate_of_a_plan_holds_on_the_table(problem: Problem) -> None:
    drift, scene = problem.make(), (problem.kappa, problem.r)
    exact = sa.escape_time(drift, *scene, start=problem.start, dps=30)
    held(sa.plan(drift, *scene, 1e-3, start=problem.start), exact)


@pytest.mark.parametrize("problem", PROBLEMS, ids=str)
@pytest.mark.parametrize("full", [False, True])
def test_auto_of_one_scene_is_exact(
    problem: Problem, full: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No more is done than for the exact value, so that no more time is taken."""
    if "refused" in problem.tags:
        return

    def analysed(*_: Any) -> None:
        raise AssertionError("an expansion was made")

    monkeypatch.setattr(plans, "_planned", analysed)
    monkeypatch.setattr(plans, "_attempt", analysed)
    scene = (problem.make(), problem.kappa, problem.r)
    options: dict[str, Any] = {"start": problem.start, "log": True}
    try:
        exact = sa.escape_time(*scene, **options)
    except sa.AccuracyError:
        return
    auto = sa.escape_time(*scene, **options, method="auto", rtol=1e-6, full=full)
    assert abs(float(auto) - exact) <= 2e-12 * max(1, abs(exact))
    if full:
        assert auto.method == "exact"
        assert abs(auto.value - exact) <= auto.error + 1e-12 * max(1, abs(exact))


def test_what_plans_print() -> None:
    """No number that stands for none, and no row without a size."""
    for kappa, z0 in (("0.05", "-0.4"), ("30", "-0.4"), ("0.1", "-0.01"), ("0.3", "-0.4")):
        drift = sa.friction(3, 1, z0)
        for rtol in (1e-2, 1e-8):
            shown = str(sa.plan(drift, kappa, 10, rtol))
            assert not re.search(r"\b(nan|inf|None)\b|\s-?0\s|part of the method", shown), shown
    for drift in (sa.linear(1, -1), sa.tanh(1, -1, "1.4")):
        shown = str(sa.plan(drift, "0.1", 10, 1e-3, start="0.3"))
        assert "C times well at 0 with" in shown, shown


def test_scenes_that_meet_are_planned_uniform() -> None:
    for z0, kappa in (("-0.77", "0.05"), ("-0.01", "0.1")):
        drift = sa.friction(3, 1, z0)
        made = sa.plan(drift, kappa, 10, rtol=1e-2)
        assert (made.method, made.order) == ("uniform", 0)
        assert made.error <= 1e-2
        held(made, sa.escape_time(drift, kappa, 10, dps=30))
    sharp = sa.plan(sa.friction(3, 1, "-0.77"), "0.05", 10, rtol=1e-6)
    assert sharp.method == "exact"
    assert "order 0" in sharp.refused["uniform"]
    assert "uniform" in sa.plan(sa.tanh(1, "-1/2", 2), "1", 10, rtol=1e-3).refused


def test_what_is_kept() -> None:
    weak = sa.plan(FRICTION, "0.05", 10, rtol=1e-3)
    assert weak.method == "laplace"
    assert [t.name for t in weak.terms if t.kept] == ["well at 0.3969 with barrier at 0.9039"]
    assert weak.error <= 1e-3
    sharper = sa.plan(FRICTION, "0.05", 10, rtol=1e-10)
    assert sharper.order is not None
    assert weak.order is not None
    assert sharper.order > weak.order
    assert sum(t.kept for t in sharper.terms) > sum(t.kept for t in weak.terms)
    no_well = sa.plan(sa.friction(3, 1, -2), "0.1", 10, rtol=1e-8)
    assert not any("well" in t.name for t in no_well.terms)
    assert "the regular part, right" in [t.name for t in no_well.terms if t.kept]
    strong = sa.plan(FRICTION, 30, 10, rtol=1e-8)
    assert (strong.method, strong.error_kind) == ("strong_noise", "bound")
    assert "laplace" in strong.refused
    neither = sa.plan(FRICTION, "0.3", 10, rtol=1e-8)
    assert neither.method == "exact"
    assert weak.cost < strong.cost < neither.cost
    assert "left out" in str(weak)
    assert "kept" in str(weak)


def test_the_sizes_add_up_to_the_whole() -> None:
    # The start's share of a well and of a kink; elsewhere those of both sides cancel.
    scenes = (
        (FRICTION, 0, False),
        (sa.linear(1, -2), "1/2", False),
        (sa.linear(-1, 2), -2, False),
        (sa.polynomial("1/2", -1), "1/2", True),
        (sa.polynomial("3/10", 1, -2), 1, True),
    )
    for drift, start, own in scenes:
        made = sa.plan(drift, "0.1", 4, rtol=1e-2, start=start)
        assert made.method == "laplace"
        assert abs(sum(t.size for t in made.terms) - 1) < 1e-14
        assert ("the start's own share" in [t.name for t in made.terms]) == own


def test_bad_input() -> None:
    for rtol in (0, 1, -1, "x", float("nan"), [1e-3]):
        with pytest.raises(sa.InputError, match="rtol"):
            sa.plan(FRICTION, "0.1", 10, rtol=rtol)
    with pytest.raises(sa.InputError, match="needs the relative error"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto")
    with pytest.raises(sa.InputError, match=r"rtol is 0\.001.*'exact'.*auto"):
        sa.escape_time(FRICTION, "0.1", 10, rtol=1e-3)
    with pytest.raises(sa.InputError, match="order is 2"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto", rtol=1e-3, order=2)
    with pytest.raises(sa.InputError, match="arrays"):
        sa.plan(FRICTION, [0.1], 10)
    with pytest.raises(sa.AccuracyError, match="rtol is 1e-20.*dps"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto", rtol="1e-20")
    with pytest.raises(sa.InputError, match="drift"):
        sa.plan("friction", "0.1", 10)


def test_auto_keeps_rtol_where_the_value_is_large() -> None:
    """A value's rtol is not that of its logarithm, which float64 has to 1e-12."""
    scene = FRICTION, "0.0202", 10
    exact = sa.escape_time(*scene, dps=30)
    assert exact > mpmath.mpf(10) ** 250
    for full in (False, True):
        found = float(sa.escape_time(*scene, method="auto", rtol=1e-12, full=full))
        # Not by luck: no error of float64's analysis is below 1e-12 here.
        assert abs(found - exact) <= 2e-16 * exact


@pytest.mark.parametrize(
    ("drift", "kappa"),
    [
        (sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05"),
        # The nearest saddle of the well is a complex one.
        (sa.Drift("-40*(u - 1/2)*((u - 1/4)**2 + 1/9)"), "0.05"),
    ],
    ids=str,
)
def test_singulants(drift: sa.Drift, kappa: str) -> None:
    """The least |int A| from a well or barrier to a neighbour or a complex zero."""
    chosen = sa.plan(drift, kappa, 3, rtol="1e-2")
    assert chosen.method == "laplace"
    c = [mpmath.mpf(x.numerator) / x.denominator for x in drift.exact_coefficients()][::-1]
    zeros = mpmath.polyroots(c, extraprec=100)
    assert chosen.singulants
    for one in chosen.singulants:
        u = min(zeros, key=lambda z: abs(z - float(one.point.split()[-1])))
        heights = [
            abs(mpmath.quad(lambda x: mpmath.polyval(c, x), [u, z])) for z in zeros if z is not u
        ]
        assert one.value == pytest.approx(float(min(heights)), rel=1e-9)
        assert one.order == int(2 / float(kappa) ** 2 * one.value)
        assert f"series of the {one.point}: singulant {one.value:.3g}" in str(chosen)
    assert not sa.plan(sa.Drift("1/5 - tanh(u)"), kappa, 3, rtol="1e-2").singulants


def test_singulants_of_huge_drifts() -> None:
    """They scale with A, until float64 has them no more."""
    one, large, beyond = (
        sa.plan(sa.friction(3, f"1e{n}", f"-5e{n - 1}"), f"1e{n // 2 - 2}", 2).singulants
        for n in (4, 300, 400)
    )
    assert [x.value for x in large] == pytest.approx([1e296 * x.value for x in one], rel=1e-3)
    assert [x.order for x in large] == pytest.approx([x.order for x in one], rel=1e-3)
    assert one
    assert not beyond
