"""The plan of a scene, and method="auto": the error allowed is never exceeded."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from tests.problems import PROBLEMS, Problem
from tests.strategies import SAMPLE, drifts, scenes

FRICTION = sa.friction(3, 1, "-0.4")
EASY = [p for p in PROBLEMS if not p.tags & {"slow", "refused", "narrow", "may refuse", "extreme"}]


def held(made: sa.Plan, exact: Any) -> None:
    """The estimate of a plan is as wrong as it says at most, and that is allowed."""
    value, error = made.estimate
    with mpmath.workdps(40):
        assert abs(value - exact) <= error + abs(exact) * mpmath.mpf(10) ** -29
        assert error <= made.error * abs(value) * (1 + 1e-9)
        assert made.error <= made.rtol
    shown = str(made)
    assert made.method in shown
    assert all(name in shown for name in made.refused)


@pytest.mark.parametrize("problem", EASY[::5], ids=str)
def test_the_error_of_a_plan_holds_on_the_table(problem: Problem) -> None:
    drift, scene = problem.make(), (problem.kappa, problem.r)
    exact = sa.escape_time(drift, *scene, start=problem.start, dps=30)
    held(sa.plan(drift, *scene, 1e-3, start=problem.start), exact)


@settings(SAMPLE, max_examples=6)
@given(scenes(-1.5, drifts()), st.sampled_from(["1e-1", "1e-3", "1e-6"]))
def test_the_error_of_a_plan_holds_on_random_scenes(scene: Any, rtol: str) -> None:
    drift, kappa, r, start = scene
    held(sa.plan(drift, kappa, r, rtol, start=start),
         sa.escape_time(drift, kappa, r, start=start, dps=30))  # fmt: skip


def test_what_is_kept() -> None:
    weak = sa.plan(FRICTION, "0.05", 10, rtol=1e-3)
    assert (weak.method, weak.order) == ("laplace", 1)
    assert [t.name for t in weak.terms if t.kept] == ["well at 0.3969 with barrier at 0.9039"]
    sharper = sa.plan(FRICTION, "0.05", 10, rtol=1e-10)
    assert sharper.order is not None
    assert sharper.order > 1
    assert sum(t.kept for t in sharper.terms) > 1
    assert "left out" in str(weak)
    no_well = sa.plan(sa.friction(3, 1, -2), "0.1", 10, rtol=1e-8)
    assert not any("well" in t.name for t in no_well.terms)
    assert "the regular part, right" in [t.name for t in no_well.terms if t.kept]
    uniform = sa.plan(sa.friction(3, 1, "-0.77"), "0.05", 10, rtol=1e-2)
    strong, neither = sa.plan(FRICTION, 30, 10, rtol=1e-8), sa.plan(FRICTION, "0.3", 10, rtol=1e-8)
    assert [p.method for p in (uniform, strong, neither)] == ["uniform", "strong_noise", "exact"]
    assert list(neither.refused) == ["laplace", "uniform", "strong_noise"]


def test_the_sizes_add_up_to_the_whole() -> None:
    """Each part of T is there once, whatever the start; the rest is the error."""
    cases: list[tuple[sa.Drift, Any]] = [
        (FRICTION, 0), (sa.linear(1, -2), "1/2"), (sa.linear(-1, 2), -2),
        (sa.polynomial("1/2", -1), "1/2"), (sa.polynomial("3/10", 1, -2), 1),
    ]  # fmt: skip
    for drift, start in cases:
        made = sa.plan(drift, "0.1", 4, rtol=1e-2, start=start)
        size = sum(t.size for t in made.terms)
        options: dict[str, Any] = {"start": start, "dps": 25}
        want = sa.escape_time(drift, "0.1", 4, method="laplace", order=made.order, **options)
        want /= sa.escape_time(drift, "0.1", 4, **options)
        assert abs(size - want) < 1e-14
        kept = sum(t.size for t in made.terms if t.kept)
        assert abs(kept - 1) <= made.error * (1 + 1e-9) * kept


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("problem", EASY[1::9], ids=str)
def test_auto_of_one_scene_is_exact(problem: Problem, full: bool) -> None:
    scene, options = (
        (problem.make(), problem.kappa, problem.r),
        {"start": problem.start, "log": True},
    )
    exact = sa.escape_time(*scene, **options, full=True)
    auto = sa.escape_time(*scene, **options, method="auto", rtol=1e-6, full=full)
    assert (auto.value if full else auto) == exact.value
    if full:
        assert (auto.method, auto.error_kind) == ("exact", exact.error_kind)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
@pytest.mark.parametrize(
    "drift", [FRICTION, sa.friction(3, 1, "-0.79"), sa.linear(1, -2), sa.Drift("1/5 - tanh(2*u)")],
    ids=str,
)  # fmt: skip
def test_auto_of_many_kappa(drift: sa.Drift, rtol: float) -> None:
    """Expansions up to a kappa, exact values beyond; in any order of kappa."""
    kappa = np.random.default_rng(1).permutation(np.geomspace(0.01, 3, 6000)).reshape(2, -1)
    found = sa.escape_time(drift, kappa, 10, method="auto", rtol=rtol, full=True, log=True)
    exact = sa.escape_time(drift, kappa, 10, log=True)
    assert (np.abs(found.value - exact) <= found.error + 1e-12 * np.maximum(1, np.abs(exact))).all()
    assert (np.expm1(found.error) <= rtol).all()
    assert "exact" in found.terms
    # Beside the fold no expansion is good to 1e-6.
    assert ("laplace, order 2" in found.terms) == (drift.values.get("z0") != -Fraction("0.79") or
                                                    rtol > 1e-6)  # fmt: skip


def test_auto_of_arrays_of_drifts_is_exact() -> None:
    drift = sa.friction(mu=3, alpha=1, z0=np.array([-2, -0.4, -0.1]))
    kappa = np.array([[0.05], [0.3], [40.0]])
    found = sa.escape_time(drift, kappa, 10, method="auto", rtol=1e-6, log=True)
    assert np.array_equal(found, sa.escape_time(drift, kappa, 10, log=True))
    many = sa.occupation(sa.linear(1, -2), np.full(6000, 0.1), complement=True, method="auto",
                         rtol=1e-4)  # fmt: skip
    want = sa.occupation(sa.linear(1, -2), 0.1, complement=True)
    assert np.allclose(many, want, rtol=1e-4, atol=0)


def test_bad_input() -> None:
    for rtol in (0, 1, -1, "x", float("nan"), [1e-3]):
        with pytest.raises(sa.InputError, match="rtol"):
            sa.plan(FRICTION, "0.1", 10, rtol=rtol)
    with pytest.raises(sa.InputError, match="needs the relative error"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto")
    with pytest.raises(sa.InputError, match="order is 2"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto", rtol=1e-3, order=2)
    with pytest.raises(sa.InputError, match="arrays"):
        sa.plan(FRICTION, [0.1], 10)
    with pytest.raises(sa.AccuracyError, match="rtol is 1e-20.*dps"):
        sa.escape_time(FRICTION, "0.1", 10, method="auto", rtol="1e-20")
    with pytest.raises(sa.InputError, match="drift"):
        sa.plan("friction", "0.1", 10)
