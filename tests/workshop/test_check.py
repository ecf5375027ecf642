"""`verify` and `report`: the truth is the truth, a wrong claim is noticed, peers agree."""

from __future__ import annotations

import csv
import dataclasses
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from mpmath import mp

import symasym as sa
from symasym.workshop import check, peers
from symasym.workshop.problems import BY_NAME, Problem

SCENES = [BY_NAME[name] for name in ("linear sliding", "constant", "friction k=1")]


@pytest.fixture
def few(monkeypatch: pytest.MonkeyPatch) -> None:
    """Three scenes, and what each method does in a moment."""
    monkeypatch.setattr(check, "PROBLEMS", SCENES)
    monkeypatch.setattr(
        check, "RUNS", [r for r in check.RUNS if r[1] in (None, 0, 1) and r[2] != 50]
    )


def test_every_claim_holds(few: None) -> None:
    found, table = check.verify()
    assert all(r.holds for r in found)
    assert table.endswith(f"{len(found)} values, 0 above their errors.")
    methods = {r.method for r in found}
    assert {"exact", "laplace", "uniform", "strong_noise", "bound", "paper"} <= methods
    assert {r.scene for r in found} == {p.name for p in SCENES}
    # They are as good as they are said to be, too: no truth is as rough as a value.
    assert min(r.error for r in found if r.digits == 20) < 1e-20


@pytest.mark.parametrize(
    ("method", "change"),
    [
        ("exact", lambda e: {"value": e.value * (1 + 1e-8)}),
        ("exact", lambda e: {"error": 0 * e.error}),
        ("laplace", lambda e: {"error": e.error / 1000}),
        ("strong_noise", lambda e: {"value": e.value + 3 * e.error}),
        ("bound", lambda e: {"value": e.value - 3 * e.error}),
    ],
)
def test_a_wrong_claim_is_noticed(
    few: None, monkeypatch: pytest.MonkeyPatch, method: str, change: Any
) -> None:
    ask = Problem.ask

    def wrong(*given: Any, **options: Any) -> Any:
        found = ask(*given, **options)
        broken = options.get("full") and options["method"] == method
        with mp.workdps(60):
            return dataclasses.replace(found, **change(found)) if broken else found

    monkeypatch.setattr(Problem, "ask", wrong)
    found, table = check.verify()
    failed = {r.method for r in found if not r.holds}
    assert failed == {method}
    assert "FAILED" in table


@pytest.mark.parametrize("name", ["constant", "linear sliding", "r=1", "hill", "quintic"])
def test_truths_agree(name: str) -> None:
    """Closed form, quadrature, and the exact value in balls."""
    problem = BY_NAME[name]
    for quantity in problem.quantities:
        true, error = check.truth(problem, quantity)
        with mp.workdps(60):
            assert abs(problem.ask(quantity, dps=30) / true - 1) <= error + 1e-29


def test_random_scenes_are_the_same_for_a_seed() -> None:
    for index in range(6):
        one, again, other = (check.random_scene(seed, index) for seed in (1, 1, 2))
        assert (one.kappa, one.make()) == (again.kappa, again.make())
        assert one.kappa != other.kappa
        assert ("quadrature" in one.tags) == (index % 3 == 0)


def test_report(few: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    numpy = [("NumPy", partial(peers.by_numpy, [Fraction(1)], Fraction(1), Fraction(2), 8))]
    monkeypatch.setattr(peers, "of", lambda problem, quick: numpy)
    found, paths = check.report(tmp_path, ["friction k=1"])
    assert {p.name for p in tmp_path.iterdir()} == {p.name for p in paths}
    rows = [*csv.DictReader((tmp_path / "report.csv").read_text().splitlines())]
    assert [float(r["error"]) for r in rows] == [r.error for r in found]
    assert {r.method for r in found} > {"NumPy", "exact", "laplace"}
    text = (tmp_path / "report.md").read_text()
    assert text.count("\n| ") == len(found) + 1
    assert "NumPy" in (tmp_path / "report.svg").read_text()
    with pytest.raises(sa.InputError):
        check.report(tmp_path, ["weka"])


@pytest.mark.parametrize(
    ("peer", "most"),
    [
        (partial(peers.by_numpy, panels=16), 1e-12),
        (partial(peers.by_arb, dps=20), 1e-20),
        pytest.param(partial(peers.by_mpmath, dps=15), 1e-15, marks=pytest.mark.slow),
        pytest.param(peers.by_scipy, 1e-7, marks=pytest.mark.slow),
    ],
)
@pytest.mark.parametrize("scene", [(("1/2", -1, 0, 2), "0.8", 2), ((1, "1/3"), 2, "3/2")])
def test_peers_agree_with_the_exact_value(peer: Any, most: float, scene: Any) -> None:
    c, kappa, r = scene
    exact = sa.escape_time(sa.polynomial(*c), kappa, r, dps=30)
    found = peer([Fraction(x) for x in c], Fraction(kappa), Fraction(r))
    with mp.workdps(40):
        assert abs(found / exact - 1) < most
