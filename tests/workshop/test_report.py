"""`symasym report`: its points are true, its files whole, its claims checked."""

from __future__ import annotations

import csv
import json
import math
import runpy
from fractions import Fraction
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symasym as sa
from symasym.commands.main import main
from symasym.workshop.problems import BY_NAME
from symasym.workshop.report import measure, pages, peers, stability, timing
from symasym.workshop.report.diagrams import heat_maps, work_precision
from symasym.workshop.report.measure import (
    MOST,
    SCENES,
    Cell,
    Outcome,
    Point,
    Run,
    chosen,
    known,
    point,
)
from symasym.workshop.verify.findings import Reference
from tests.benchmarks import __main__ as benchmarks

PNG = b"\x89PNG\r\n"


def made(**changes: Any) -> Point:
    kept: dict[str, Any] = {
        "scene": "weak", "method": "exact", "setting": "float64", "ours": True, "seconds": 1e-3,
        "calls": 10, "error": 1e-13, "claimed": 1e-12, "kind": "bound", "below_reference": False,
        "runs": 3, "reason": "",
    }  # fmt: skip
    return Point(**(kept | changes))


def test_every_scene_is_in_the_table_and_starts_at_0() -> None:
    for name, problem in chosen(None).items():
        assert problem is BY_NAME[SCENES[name]]
        assert problem.start == "0"
    with pytest.raises(sa.InputError, match="'cold' is no scene of the report; give weak"):
        chosen(["cold"])
    assert main(["report", "--scene", "cold"]) == 2


def test_references_are_balls() -> None:
    truth = known(BY_NAME["friction k=0.3"])
    wanted = sa.escape_time(sa.friction(3, 1, "-0.3"), "0.3", 10, dps=60, log=True)
    assert abs(truth.value - wanted) < 1e-14
    assert truth.radius < 1e-110


def test_points_have_true_errors_and_honest_claims() -> None:
    problem = BY_NAME["friction k=10"]
    truth = known(problem)
    found = {}
    for run in measure.ours(problem, True):
        p = point("strong", run, truth, 20, once=True)
        found[run.method, run.setting] = p
        assert p.error is None or not p.ours or pages.lies([p]) == []
    assert found["exact", "35 digits"].error < 1e-34  # type: ignore[operator]
    assert 1e-4 < found["strong_noise", "order 0"].error < 1e-2  # type: ignore[operator]
    assert found["paper", "leading order"].claimed is None
    assert found["laplace", "order 2"].reason.startswith("refused: kappa is 10")


def test_a_value_that_claims_too_much_is_a_lie() -> None:
    truth = known(BY_NAME["friction k=10"])
    wrong = Run("exact", "wrong", lambda: Outcome(float(truth.value) + 1e-6, 1e-9, "bound"), True)
    p = point("strong", wrong, truth, 5, once=True)
    assert p.error == pytest.approx(1e-6, rel=1e-6)
    assert pages.lies([p]) == [p]


def test_the_counter_is_the_same_every_time() -> None:
    def call() -> Any:
        return sa.escape_time(sa.friction(3, 1, "-0.3"), "0.3", 10, dps=30)

    call()
    assert timing.calls(call) == timing.calls(call) > 100


def test_cheapest() -> None:
    points = [
        made(setting="a", error=1e-13, seconds=2.0),
        made(setting="b", error=1e-7, seconds=1.0),
        made(setting="c", error=None, seconds=0.1, reason="refused: no."),
        made(method="Arb", setting="d", error=1e-60, seconds=9.0, ours=False),
    ]
    assert pages.cheapest(points, 1e-6, True).setting == "b"  # type: ignore[union-attr]
    assert pages.cheapest(points, 1e-12, True).setting == "a"  # type: ignore[union-attr]
    assert pages.cheapest(points, 1e-50, True) is None
    assert "Arb, d: 9 s" in pages.when(points)
    assert "refused: no." in pages.refusals(points)


def test_a_peer_that_is_not_installed_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure.shutil, "which", lambda name: None)
    assert "PARI" in measure.missing()
    names = {run.method for run in measure.others(BY_NAME["friction"], False)}
    assert "PARI" not in names
    assert "mpmath.quad" in names


def test_pari_is_asked_through_gp(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    program = tmp_path / "gp"
    program.write_text("#!/bin/sh\ncat > /dev/null\necho 3.4224224764058850934 E-1\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    assert "PARI" not in measure.missing()
    runs = [r for r in measure.others(BY_NAME["friction"], True) if r.method == "PARI"]
    spent, outcome, reason = measure.attempt(runs[0], 10)
    assert reason == ""
    assert outcome is not None
    # kappa = 0.1, so that lam = 200; the rest is what the exponent that was taken out adds.
    barrier = peers._barrier_height(peers.coefficients(3, "-0.3"), 10.0)
    wanted = 0.34224224764058850934 + 200 * barrier + math.log(200)
    assert float(outcome.log) == pytest.approx(wanted, rel=1e-15)
    text = peers.pari_program(peers.coefficients(3, "-0.3"), Fraction(1), 10, 19)
    assert text.count("intnum") == 14
    assert "default(realprecision, 19);" in text


@pytest.mark.parametrize(("kappa", "panels"), [(1.0, 3), (0.5, 3), (0.2, 12), (0.1, 48)])
def test_panels_by_hand_give_our_times(kappa: float, panels: int) -> None:
    z0 = np.linspace(-2.0, -1e-6, 7)
    c = np.array(np.broadcast_arrays(1 - z0, -4.0, 0.0, 3.0))
    by_hand = peers.numpy_log_escape_time(c, kappa, 10, panels)
    ours = sa.escape_time(sa.friction(mu=3, alpha=1, z0=z0), kappa, 10, log=True)
    assert by_hand == pytest.approx(ours, rel=1e-12, abs=1e-12)
    if kappa < 1:
        with np.errstate(all="ignore"):
            fewer = peers.numpy_log_escape_time(c, kappa, 10, panels // 3)
        assert not np.allclose(fewer, ours, rtol=1e-12, atol=1e-12)


def test_a_peer_that_breaks_or_takes_too_long_is_told() -> None:
    def slow() -> Outcome:
        while True:
            math.sqrt(2)

    def broken() -> Outcome:
        raise OverflowError("math range error")

    truth = Reference(sa.escape_time(sa.linear(1, 1), 1, 5, dps=20), sa.escape_time(
        sa.linear(1, 1), 1, 5, dps=20) * 0)  # fmt: skip
    assert point("x", Run("Arb", "", slow, False), truth, 0.2).reason == "stopped after 0.2 s"
    assert "math range error" in point("x", Run("dblquad", "", broken, False), truth, 1).reason
    with pytest.raises(OverflowError):
        point("x", Run("exact", "", broken, True), truth, 1)


def few(problem: Any, quick: bool) -> list[Run]:
    wanted = {("exact", "float64"), ("exact", "35 digits"), ("strong_noise", "order 2"),
              ("paper", "leading order"), ("laplace", "order 2")}  # fmt: skip
    return [r for r in measure.ours(problem, quick) if (r.method, r.setting) in wanted]


def test_report_writes_whole_files(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(pages, "ours", few)
    monkeypatch.setattr(
        pages, "others",
        lambda problem, quick: [r for r in measure.others(problem, quick) if r.method == "dblquad"],
    )  # fmt: skip
    monkeypatch.setattr(timing, "digits", lambda quick: [
        timing.Grown("digits", "exact", n, n / 1e4, n) for n in (10, 100)])  # fmt: skip
    monkeypatch.setattr(timing, "noise", lambda quick: [])
    monkeypatch.setattr(timing, "points", lambda quick: [
        timing.Grown("points", "exact", n, n / 1e6, None, 12.0) for n in (100, 10000)])  # fmt: skip
    assert main(["report", "--quick", "--scene", "strong", "-o", str(tmp_path)]) == 0
    record = json.loads((tmp_path / "points.json").read_text())
    methods_seen = {p["method"] for p in record["points"]}
    assert {"exact", "strong_noise", "paper", "laplace", "dblquad"} <= methods_seen
    rows = list(csv.DictReader((tmp_path / "points.csv").read_text().splitlines()))
    assert len(rows) == len(record["points"])
    text = (tmp_path / "report.md").read_text()
    for part in ("## Which method when", "**strong**", "is below the true one: 0 of symasym",
                 "Exponent of the growth", "12 MiB", "mpmath computes with"):  # fmt: skip
        assert part in text
    for name in ("work-precision", "growth"):
        assert (tmp_path / f"{name}.png").read_bytes().startswith(PNG)
        assert "<svg" in (tmp_path / f"{name}.svg").read_text()


def test_stability_over_two_scenes(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked = [BY_NAME["k=1e8"], BY_NAME["r=1e12"]]
    monkeypatch.setattr(stability, "scenes", lambda quick: asked)
    monkeypatch.setattr(stability, "others", lambda problem, quick: [])
    monkeypatch.setattr(stability, "OURS", [*stability.OURS[:3], ("strong_noise", "order 2")])
    assert main(["report", "--stability", "-o", str(tmp_path)]) == 0
    record = json.loads((tmp_path / "stability.json").read_text())
    cells = {(c["scene"], c["method"], c["setting"]): c for c in record["cells"]}
    exact = cells["k=1e8", "exact", "35 digits"]
    assert exact["claimed"] >= 35
    assert 35 <= exact["true"] <= MOST
    assert "that claim more digits than are true: 0." in (tmp_path / "stability.md").read_text()
    # T is (r^2 - x^2)/kappa^2 where noise is that strong, so that both condition numbers are 2.
    (strong, _) = record["conditions"]
    assert strong["of_T"]["kappa"] == pytest.approx(2, rel=1e-6)
    assert strong["of_T"]["r"] == pytest.approx(2, rel=1e-6)
    # log10(2); the start, which costs no digits in any scene, has no column.
    row = "| `k=1e8` | · / · | · / · | · / · | 0.3 / · | 0.3 / · |  |"
    row = row.replace(" / ", "\u00a0/\u00a0")
    assert row in (tmp_path / "stability.md").read_text()
    assert (tmp_path / "stability.png").read_bytes().startswith(PNG)
    assert main(["report", "--stability", "--scene", "weak", "-o", str(tmp_path)]) == 2


def test_a_claim_above_the_truth_is_a_wrong_cell() -> None:
    cell = Cell("a", "exact", "float64", True, 12.0, 9.0, "bound", "")
    assert cell.wrong
    assert not Cell("a", "exact", "float64", True, 12.0, 12.5, "bound", "").wrong
    assert not Cell("a", "paper", "", True, None, 1.0, "none", "").wrong
    panels = heat_maps([cell]).axes
    assert any(p.get_edgecolor()[:3] == (1.0, 0.0, 0.0) for p in panels[0].patches)


def test_diagrams_have_a_panel_a_scene() -> None:
    points = [made(scene=s, error=e) for s in ("weak", "stiff") for e in (1e-2, 1e-200)]
    figure = work_precision(points)
    assert [axes.get_title(loc="left") for axes in figure.axes] == ["weak", "stiff"]


# What is kept in docs/.


def _keep() -> SimpleNamespace:
    return SimpleNamespace(**runpy.run_path(str(Path(__file__).parents[2] / "docs/keep.py")))


def test_the_kept_pages_are_what_their_points_say() -> None:
    keep = _keep()
    for name, text in keep.made().items():
        assert (keep.DOCS / name).read_text("utf-8") == text, f"{name}: run docs/keep.py"
    assert json.loads(keep.short(b'{"a": [1, {"b": []}], "c": []}')) == {
        "a": [1, {"b": []}],
        "c": [],
    }
    with pytest.raises(ValueError, match="0 places for the part when"):
        keep.filled("", {"when": "| a |"})


def test_how_to_choose_says_what_was_measured() -> None:
    record = json.loads((_keep().DOCS / "measured.json").read_text())
    points = [Point(**p) for p in record["points"]]
    assert not [p for p in pages.lies(points) if p.ours]
    winners = []
    for scene in {p.scene for p in points}:
        here = [p for p in points if p.scene == scene]
        for allowed in pages.THRESHOLDS.values():
            best = min(
                (pages.cheapest(here, allowed, mine) for mine in (True, False)),
                key=lambda p: math.inf if p is None else p.seconds,
            )
            assert best is not None
            winners.append(best)
    # The exact integral, or the uniform formula: of order 0 but in the most extreme scene.
    exactly = [p for p in winners if p.method.startswith("exact")]
    others = [p for p in winners if p not in exactly]
    assert len(exactly) > 2 * len(others)
    assert {p.method for p in others} <= {"uniform"}
    assert all(p.setting == "order 0" for p in others if p.scene != "extreme")
    at = {(p.scene, p.method, p.setting): p.error for p in points if p.error is not None}
    both = [key for key in at if key[1] == "laplace" and (key[0], "uniform", key[2]) in at]
    assert len({scene for scene, _, _ in both}) >= 3
    assert all(at[key[0], "uniform", key[2]] <= at[key] * (1 + 1e-9) for key in both)
    rows = {line.split("|")[1].strip(" *"): line for line in pages.reached(points).splitlines()}
    assert all("(order" in rows[scene] for scene in ("weak", "fold", "kink"))
    assert "–" in rows["fold"].split("|")[2]  # laplace
    with_lower = [made(method="laplace", setting="order 0"), made(method="laplace", error=1e-15)]
    assert "1e-15 (float64)" in pages.reached(with_lower)


def test_some_parts_of_the_benchmarks_are_renewed_alone() -> None:
    page = (Path(__file__).parents[2] / "docs/speed.md").read_text()
    old = page.partition(benchmarks.START)[2].partition(benchmarks.END)[0].strip()
    assert benchmarks.renewed(old, old) == old
    head = "machine\n\n| ratio | measured |\n| --- | --- |"
    new = f"{head}\n| a | 1 |"
    with_one = benchmarks.renewed(old, f"{new}\n\n### Import\n\nNothing.")
    assert with_one.count("\n") < old.count("\n") + 2
    assert "| a | 1 |" in with_one
    assert with_one.partition("### Import\n\nNothing.")[2][:5] in ("", "\n\n###")
    assert with_one.count("### Import") == 1
    assert "### Weak noise" in with_one


def test_laplace_integrals_beside_a_peer(monkeypatch: pytest.MonkeyPatch) -> None:
    """Our claim holds on each; without the peer the page says so."""
    monkeypatch.setattr(peers, "installed", lambda: None)
    rows = peers.measured()
    assert {row.tool for row in rows} == {"symasym"}
    for row in rows:
        claimed = float(row.claim.rpartition(" ")[2])
        assert row.claim.startswith("bound")
        assert row.error is not None
        assert 1e-12 < row.error <= claimed
    text = peers.section()
    assert "`asymptotic` is not installed" in text
    assert text.count("| symasym |") == len(peers.INTEGRALS)


def test_tables_of_the_benchmarks_are_set_as_formulas() -> None:
    from tests.benchmarks.__main__ import in_tex

    text = "| slowest kappa (it is 1e-8), kappa = 0.1 | 4.2e-14 | `dblquad` 1e-6, z0 to -0.2. |"
    shown = in_tex(text)
    assert shown == (
        r"| slowest $\kappa$ (it is $10^{-8}$), $\kappa = 0.1$ | $4.2 \times 10^{-14}$ "
        r"| `dblquad` $10^{-6}$, $z_0$ to -0.2. |"
    )
    assert in_tex(shown) == shown
