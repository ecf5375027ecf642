"""Emitted code of expansions, run by gcc and Node, and `evaluate`, on the table's drifts."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symasym as sa
from symasym.expansions.cases import case_of
from tests.emitted import Call, available, run
from tests.expansions.test_weak import SCENES, roots_of
from tests.problems import Problem

#: Noise and radius at which the series are good and the exponentials are doubles.
KAPPA, RADIUS = "1/8", "3/2"
#: Each drift and start once.
DISTINCT = list({(str(p.make()), p.start): p for p in SCENES}.values())
SAMPLE = [p for p in DISTINCT if p.name in ("friction r=3", "constant down", "expression, cubic")]


def expansions(problem: Problem, order: int) -> tuple[sa.Expansion, sa.Drift] | None:
    """The expansion with its drift's parameters free, if it is friction; and the bound drift."""
    drift, start = problem.make(), Fraction(problem.start)
    free = sa.friction() if drift.name == "friction" and drift.values["mu"] else drift
    try:
        e = sa.expand(free, order=order, start=start, case=case_of(drift, start))
        e.emit("c")
        return e, drift
    except sa.InputError:
        return None


def arguments(e: sa.Expansion, drift: sa.Drift) -> list[float]:
    """Numbers for the symbols that the code takes, in their order."""
    values: dict[str, Any] = {**drift.values, **roots_of(drift)}
    values |= {"kappa": Fraction(KAPPA), "r": Fraction(RADIUS)}
    return [float(values[name]) for name in sorted(s.name for s in e.expression.free_symbols)]


def compared(scenes: list[Problem], target: str, folder: Path) -> int:
    """The number of scenes whose emitted T is that of `evaluate`."""
    files, calls, wanted = {}, [], []
    for k, problem in enumerate(scenes):
        known = expansions(problem, 1)
        if known is None:
            continue
        e, drift = known
        try:
            want = e.bind(**drift.values).evaluate(KAPPA, RADIUS, dps=20)
        except sa.SymasymError:
            continue
        files[f"scene{k}"] = e.emit(target, name=f"time{k}")
        calls.append(Call(f"scene{k}", f"time{k}", tuple(arguments(e, drift))))
        wanted.append((problem, float(want)))
    for (problem, want), (value,) in zip(wanted, run(target, files, calls, folder), strict=True):
        assert float(value) == pytest.approx(want, rel=1e-8), problem
    return len(wanted)


@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy"])
def test_emitted_weak_noise(target: str, tmp_path: Path) -> None:
    if reason := available(target):
        pytest.skip(reason)
    assert compared(SAMPLE, target, tmp_path) == len(SAMPLE) == 3


@pytest.mark.slow
@pytest.mark.parametrize("target", ["c", "javascript"])
def test_emitted_weak_noise_on_the_whole_table(target: str, tmp_path: Path) -> None:
    if reason := available(target):
        pytest.skip(reason)
    assert compared(DISTINCT, target, tmp_path) >= 7


@pytest.mark.parametrize("target", ["c", "javascript"])
@pytest.mark.parametrize("quantity", ["T", "P"])
def test_emitted_strong_noise(quantity: str, target: str, tmp_path: Path) -> None:
    """With friction's parameters free, in the order of their names."""
    if reason := available(target):
        pytest.skip(reason)
    e = sa.expand(sa.friction(), quantity, noise="strong", order=3)
    drift = sa.friction(mu=3, alpha=1, z0="0.5")
    given = {**drift.values, "kappa": Fraction(7, 2), "r": Fraction(3)}
    names = sorted(s.name for s in e.expression.free_symbols)
    call = Call("strong", "value", tuple(float(given[n]) for n in names))
    ((value,),) = run(target, {"strong": e.emit(target, name="value")}, [call], tmp_path)
    want = e.bind(**drift.values).evaluate("7/2", *([] if quantity == "P" else [3]))
    assert float(value) == pytest.approx(want, rel=1e-11)


UNIFORM: list[tuple[sa.Drift, str, str, dict[str, Any]]] = [
    # Both sides of the fold at z0 = -7/9, and 2e-5 from it.
    (sa.friction(), "T", "start well barrier", {"mu": 3, "alpha": 1, "z0": "-0.4"}),
    (sa.friction(), "T", "start well barrier", {"mu": 3, "alpha": 1, "z0": "-0.77775"}),
    (sa.friction(), "T", "start", {"mu": 3, "alpha": 1, "z0": "-0.8"}),
    (sa.friction(), "T", "barrier well start", {"mu": 3, "alpha": 1, "z0": "2.4"}),
    (sa.Drift("20*((u - m0)**2 - d)"), "T", "start well barrier", {"m0": "1/3", "d": "1/50"}),
    (
        sa.Drift("-5*((u - a)**2 + 1/40)*(u + b)").bind(a="1/3", b="1/2"),
        "1 - P", "well", {},
    ),
    (sa.Drift("a - b*u"), "P", "well", {"a": "1/5", "b": 2}),
]  # fmt: skip


@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy", "mpmath"])
@pytest.mark.parametrize("order", [0, 1])
def test_emitted_uniform(target: str, order: int, tmp_path: Path) -> None:
    """Free parameters, against the verb; beside the fold order 1 loses digits in doubles."""
    if reason := available(target):
        pytest.skip(reason)
    files, calls, wanted = {}, [], []
    for k, (drift, quantity, case, values) in enumerate(UNIFORM):
        e = sa.expand(drift, quantity, noise="uniform", order=order, case=case)
        files[f"scene{k}"] = e.emit(target, name=f"value{k}")
        bound = drift.bind(**values)
        known = {**bound.values, **roots_of(bound), "kappa": Fraction("1/8"), "r": Fraction("3/2")}
        names = files[f"scene{k}"]._ready[0].arguments
        given = tuple(float(known[name]) for name in names)
        exact = {name: x for name, x in zip(names, given, strict=True) if name in values}
        at = (given[names.index("kappa")], *([3 / 2] if quantity == "T" else []))
        wanted.append(e.bind(**exact).evaluate(*at, dps=20))
        calls.append(Call(f"scene{k}", f"value{k}", given))
    found = run(target, files, calls, tmp_path)
    for scene, want, (value,) in zip(UNIFORM, wanted, found, strict=True):
        lost = 1e-7 if order and scene[3].get("z0") == "-0.77775" else 2e-12
        assert abs(float(value) / float(want) - 1) < (1e-14 if target == "mpmath" else lost), scene


@pytest.mark.parametrize("target", ["c", "javascript", "python", "numpy"])
@pytest.mark.parametrize(("noise", "order"), [("weak", 2), ("uniform", 1)])
def test_logarithms_where_exponentials_overflow(
    target: str, noise: str, order: int, tmp_path: Path
) -> None:
    """kappa = 1/100: T is about e^2544, and kappa = 1/10 with r = 3/2, where T is a double."""
    if reason := available(target):
        pytest.skip(reason)
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    e = sa.expand(sa.friction(), noise=noise, order=order)
    source = e.emit(target, name="value")
    known = {**drift.values, **roots_of(drift), "r": Fraction("3/2")}
    calls, wanted = [], []
    for kappa in ("1/100", "1/10"):
        at = known | {"kappa": Fraction(kappa)}
        given = tuple(float(at[name]) for name in source._ready[0].arguments)
        calls.append(Call("scene", "log_value", given))
        wanted.append(float(e.bind(**drift.values).evaluate(kappa, "3/2", log=True, dps=20)))
    for want, (value,) in zip(wanted, run(target, {"scene": source}, calls, tmp_path), strict=True):
        assert float(value) == pytest.approx(want, rel=1e-13)


def same(problem: Problem, order: int) -> bool:
    """True if `evaluate` is the verb: one number and an array, to the last bit."""
    drift, start = problem.make(), Fraction(problem.start)
    try:
        e = sa.expand(drift, order=order, start=start)
    except sa.SymasymError:
        return False
    kappas = np.array([0.05, 0.1])
    for kappa in (0.05, kappas):
        options: dict[str, Any] = (
            {"log": True, "errors": "nan"} if kappa is kappas else {"log": True}
        )
        results = []
        for call in (
            e.evaluate,
            partial(sa.escape_time, drift, start=start, method="laplace", order=order),
        ):
            try:
                results.append(call(kappa, problem.r, **options))
            except sa.SymasymError as error:
                results.append(str(error))
        assert np.array_equal(*results, equal_nan=not isinstance(results[0], str)), problem
    return True


def test_evaluate_is_the_verb() -> None:
    assert sum(same(problem, 2) for problem in SAMPLE) == 3


@pytest.mark.slow
@pytest.mark.parametrize("order", [0, 1, 4])
def test_evaluate_is_the_verb_on_the_whole_table(order: int) -> None:
    assert sum(same(problem, order) for problem in DISTINCT) >= 10
