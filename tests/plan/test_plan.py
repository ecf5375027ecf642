"""The plan of a scene, and method="auto": the error allowed is never exceeded."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.workshop.problems import BY_NAME

FRICTION = sa.friction(3, 1, "-0.4")
#: A drift, kappa, r, the start; and whether 1e-3 is reached.
SCENES: list[tuple[sa.Drift, Any, Any, Any, bool]] = [
    (FRICTION, "0.05", 10, 0, True),
    (FRICTION, 30, 10, 0, False),
    (sa.friction(3, 1, "-0.77"), "0.05", 10, 0, False),
    (sa.friction(3, 1, -2), "0.1", 10, 0, True),
    (sa.linear(1, -2), "0.1", 4, "1/2", True),
    (sa.linear(-1, 2), "0.1", 4, -2, True),
    (sa.polynomial("1/2", -1), "0.1", 4, "1/2", True),
    (sa.polynomial("3/10", 1, -2), "0.1", 4, 1, True),
    (BY_NAME["sine"].make(), "0.05", 3, 0, True),
]


@pytest.mark.parametrize("scene", SCENES, ids=lambda s: f"{s[0]}, {s[1]}")
def test_the_sizes_add_up_and_the_error_holds(scene: Any) -> None:
    """Each part of T is there once, whatever the start; the rest is the error."""
    drift, kappa, r, start, reached = scene
    made = sa.plan(drift, kappa, r, rtol=1e-3, start=start)
    exact = sa.escape_time(drift, kappa, r, start=start, dps=30)
    assert made.suffices is reached
    assert (made.error <= 1e-3) is reached
    with mpmath.workdps(40):
        assert abs(made.value - exact) <= (made.error * (1 + 1e-9) + 1e-18) * exact
        kept = sum(t.size for t in made.terms if t.kept)
        assert abs(kept - made.value / exact) < 1e-14 * abs(kept)
        if reached:
            options: dict[str, Any] = {"start": start, "dps": 25, "method": "laplace"}
            want = sa.escape_time(drift, kappa, r, order=made.order, **options) / exact
            assert abs(sum(t.size for t in made.terms) - want) < 1e-14


def test_what_is_kept() -> None:
    weak = sa.plan(FRICTION, "0.05", 10, rtol=1e-3)
    assert weak.order == 1
    assert [t.name for t in weak.terms if t.kept] == ["well at 0.3969 with barrier at 0.9039"]
    sharper = sa.plan(FRICTION, "0.05", 10, rtol=1e-10)
    assert sharper.order > 1
    assert sum(t.kept for t in sharper.terms) > 1
    no_well = sa.plan(sa.friction(3, 1, -2), "0.1", 10, rtol=1e-8)
    assert "the regular part, right" in [t.name for t in no_well.terms if t.kept]


@pytest.mark.parametrize("name", ["friction", "sine", "kink + 1e-15", "linear sliding"])
def test_auto_of_one_scene_is_exact(name: str) -> None:
    p = BY_NAME[name]
    scene, options = (p.make(), p.kappa, p.r), {"start": p.start, "log": True}
    exact = sa.escape_time(*scene, **options, full=True)
    auto = sa.escape_time(*scene, **options, method="auto", rtol=1e-6, full=True)
    assert (auto.value, auto.method, auto.error_kind) == (exact.value, "exact", exact.error_kind)


@pytest.mark.parametrize("rtol", [1e-3, 1e-6])
@pytest.mark.parametrize("drift", [FRICTION, sa.linear(1, -2)])
def test_auto_of_many_kappa(drift: sa.Drift, rtol: float) -> None:
    """Expansions up to a kappa, exact values beyond; in any order of kappa."""
    kappa = np.random.default_rng(1).permutation(np.geomspace(0.01, 3, 5000)).reshape(2, -1)
    found = sa.escape_time(drift, kappa, 10, method="auto", rtol=rtol, full=True, log=True)
    exact = sa.escape_time(drift, kappa, 10, log=True)
    assert (np.abs(found.value - exact) <= found.error + 1e-12 * np.maximum(1, np.abs(exact))).all()
    assert (np.expm1(found.error) <= rtol).all()
    assert {"laplace, order 5", "exact"} <= set(found.notes)


def test_auto_of_arrays_of_drifts_is_exact() -> None:
    drift, kappa = sa.friction(3, 1, np.array([-2, -0.4, -0.1])), np.array([[0.05], [0.3], [40.0]])
    found = sa.escape_time(drift, kappa, 10, method="auto", rtol=1e-6, log=True)
    assert np.array_equal(found, sa.escape_time(drift, kappa, 10, log=True))


def test_bad_input() -> None:
    for rtol in (0, 1, "x", float("nan"), [1e-3]):
        with pytest.raises(sa.InputError, match="rtol"):
            sa.plan(FRICTION, "0.1", 10, rtol=rtol)
    for options, words in (
        ({"rtol": 1e-3, "order": 2}, "order is 2"),
        ({"rtol": "1e-20"}, "1e-20"),
    ):
        with pytest.raises(sa.InputError, match=words):
            sa.escape_time(FRICTION, "0.1", 10, method="auto", **options)
    with pytest.raises(sa.AccuracyError, match="the series for weak noise do not exist"):
        sa.plan(sa.friction(3, 1, "-7/9"), "0.1", 10)
