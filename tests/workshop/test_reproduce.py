"""The main job: what it makes, what it makes again, and what a failure leaves."""

from __future__ import annotations

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from fractions import Fraction
from functools import partial
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from mpmath import mp, mpf

import symasym as sa
from symasym.commands.main import main
from symasym.derivation.derivation import build
from symasym.workshop import figures, reference_quadrature, reproduce
from tests.processes import PROGRAM, started

FILES = {"fric1.png", "fric1.svg", "fric2.png", "fric2.svg", "reference.json"}
STAGES = ["fric1", "fric2", "reference", "derivations"]
# Two derivations without checks that take time.
LABELS = ["eq:osc2", "filippov"]
PAGES = {f"{slug}.{kind}" for slug in ("eq-osc2", "filippov") for kind in ("md", "tex")}
PAGES |= {"index.md", "trace.json"}


REAL = {"fric1": partial(figures.fric1, 12), "fric2": partial(figures.fric2, 12)}


def line(name: str) -> Figure:
    """A figure that is drawn at once."""
    figure = Figure(figsize=(1, 1), label=name)
    figure.add_artist(Line2D([0, 1], [0, 1]))
    return figure


@pytest.fixture(autouse=True)
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few points and plain figures, so that the whole job takes a second; and a source that
    stays as it is.
    """
    monkeypatch.setattr(figures, "FIGURES", {name: partial(line, name) for name in REAL})
    monkeypatch.setattr(reproduce, "Z0", ("-1.50", "-0.80", "-0.05"))
    monkeypatch.setattr(
        reproduce, "_folder_hash", lambda *of: ("source", "derivations")[len(of) - 1]
    )
    monkeypatch.setattr(reproduce, "_labels", lambda: list(LABELS))


def made(out: Path, **options: object) -> list[str]:
    """Names of the stages that were made and not up to date."""
    outcomes = reproduce.reproduce(out, **options)  # type: ignore[arg-type]
    return [outcome.stage.name for outcome in outcomes if outcome.seconds is not None]


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("whole")


@pytest.fixture
def whole(coarse: None, store: Path, tmp_path: Path) -> Path:
    """A folder in which everything was made, once for all tests that begin with one."""
    if not any(store.iterdir()):
        assert made(store) == STAGES
    shutil.copytree(store, tmp_path, dirs_exist_ok=True)
    return tmp_path


def files(out: Path) -> set[str]:
    """Of all stages but the derivations, whose folder has a cache besides."""
    return {name for name in os.listdir(out) if name not in (".stamps.json", "derivations")}


def pages(out: Path) -> set[str]:
    return {p.name for p in (out / "derivations").iterdir() if p.is_file()}


def test_a_second_run_makes_nothing(whole: Path) -> None:
    tmp_path = whole
    assert files(tmp_path) == FILES
    assert pages(tmp_path) == PAGES
    assert made(tmp_path) == []
    assert made(tmp_path, force=True) == STAGES


def test_only_what_is_missing_or_stale_is_made(
    whole: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tmp_path = whole
    (tmp_path / "fric1.svg").unlink()
    assert made(tmp_path) == ["fric1"]
    (tmp_path / "fric2.png").write_bytes(b"someone else's")
    assert made(tmp_path) == ["fric2"]
    assert made(tmp_path, dps=20) == ["reference"]
    assert made(tmp_path, dps=20) == []
    (tmp_path / ".stamps.json").write_text("{half")
    assert made(tmp_path, only=["fric1"]) == ["fric1"]
    assert made(tmp_path, dps=20) == STAGES[1:]
    monkeypatch.setattr(reproduce, "_folder_hash", lambda *of: ("new", "derivations")[len(of) - 1])
    assert made(tmp_path, dps=20) == STAGES[:3]
    (tmp_path / "derivations" / "filippov.md").unlink()
    assert made(tmp_path, dps=20) == ["derivations"]
    monkeypatch.setattr(reproduce, "_folder_hash", lambda *of: "new")
    assert made(tmp_path, dps=20) == ["derivations"]
    assert pages(tmp_path) == PAGES


def test_every_figure_is_a_stage(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(figures.FIGURES, "another", figures.fricforce)
    assert [stage.name for stage in reproduce._stages()] == [*figures.FIGURES, *STAGES[2:]]


def test_derivations_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["reproduce", "--out", str(tmp_path), "--only", "derivations"]) == 0
    printed = capsys.readouterr()
    assert f"{tmp_path / 'derivations'}, 2 derivations whose" in printed.out
    assert printed.err.splitlines() == ["derivations: 2 steps"]
    assert files(tmp_path) == set()
    trace = json.loads((tmp_path / "derivations" / "trace.json").read_text())
    assert [record["label"] for record in trace["derivations"]] == LABELS


def test_a_derivation_that_fails_ends_the_job(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    step = build("filippov").steps[0]
    monkeypatch.setattr(step, "right", 2 * step.right)
    out = str(tmp_path)
    assert main(["reproduce", "--out", out, "--only", "derivations"]) == 2
    assert f"filippov: {step.name!r} does not hold" in capsys.readouterr().err
    assert ".stamps.json" not in os.listdir(tmp_path)


def test_files_are_the_same_in_every_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(figures, "FIGURES", REAL)
    for folder in ("one", "another"):
        assert made(tmp_path / folder) == STAGES
    for name in FILES | {f"derivations/{page}" for page in PAGES - {"trace.json"}}:
        one, another = (tmp_path / folder / name for folder in ("one", "another"))
        assert one.read_bytes() == another.read_bytes()


def test_every_module_and_style_is_part_of_the_source(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.undo()
    monkeypatch.setattr(sa, "__file__", str(tmp_path / "__init__.py"))
    found = set()
    for name in ("__init__.py", "below/module.py", "symasym.mplstyle"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        for content in ("one", "two"):
            (tmp_path / name).write_text(content)
            found.add(reproduce._folder_hash(sa))
    assert len(found) == 6


def test_reference_table(tmp_path: Path) -> None:
    made(tmp_path, only=["reference"], dps=20)
    values = json.loads((tmp_path / "reference.json").read_text())["values"]
    scenes = {(v["quantity"], v["x"]["mu"], v["physical"]["kappa"], v["x"]["z0"]) for v in values}
    curves = {("3", k) for k in figures.KAPPAS} | {("1/2", k) for k in figures.KAPPAS}
    curves |= {("1", "0.01"), ("2", "0.01")}
    assert scenes == {(q, *curve, z0) for q in "TC" for curve in curves for z0 in reproduce.Z0}
    assert len(values) == len(scenes)
    for record in values:
        x = record["x"]
        assert Fraction(x["kappa"]) == Fraction(record["physical"]["kappa"]) * 10
        assert x["r"] == "10"
        assert set(record) >= {"mid", "rad", "dps", "method", "versions", "error_kind"}
        assert mpf(record["rad"]) <= mpf(record["mid"]) * mpf("1e-19")
        assert ("paper" in record) == (record["quantity"] == "T")


def test_reference_values_against_plain_quadrature(tmp_path: Path) -> None:
    made(tmp_path, only=["reference"], dps=20)
    values = json.loads((tmp_path / "reference.json").read_text())["values"]
    strong = [v for v in values if v["physical"]["kappa"] == "0.1" and v["x"]["z0"] == "-0.80"]
    assert len(strong) == 4
    for record in strong:
        x = {name: Fraction(text) for name, text in record["x"].items()}
        kappa, r = x.pop("kappa"), x.pop("r")
        verb = (
            reference_quadrature.escape_time
            if record["quantity"] == "T"
            else reference_quadrature.exit_probability
        )
        with mp.workdps(40):
            truth = verb(sa.friction(**x), kappa, r, Fraction(0), 25)
            assert abs(truth - mpf(record["mid"])) <= mpf(record["rad"]) + abs(truth) * mpf("1e-25")


def test_the_worst_disagreement_is_the_worst(tmp_path: Path) -> None:
    assert reproduce.worst_disagreement(tmp_path) is None
    made(tmp_path, only=["reference"])
    worst = reproduce.worst_disagreement(tmp_path)
    assert worst is not None
    assert worst.scenes == 10 * len(reproduce.Z0)
    found = {}
    for mu, kappa in figures.DRAWN:
        for z0 in reproduce.Z0:
            drift = sa.friction(mu=mu, alpha=1, z0=z0)
            scaled = Fraction(kappa) * 10
            exact = sa.escape_time(drift, scaled, 10)
            paper = sa.escape_time(drift, scaled, 10, method="paper")
            found[mu, kappa, z0] = abs(paper - exact) / exact
    assert worst.relative == pytest.approx(max(found.values()))
    assert found[worst.mu, worst.kappa, worst.z0] == max(found.values())


def test_the_command_tells_where_things_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["reproduce", "--out", str(tmp_path), "--dps", "15"]) == 0
    printed = capsys.readouterr()
    assert all(str(tmp_path / name) in printed.out for name in FILES)
    assert "farthest from the exact escape time at mu = 1/2, kappa = 0.1" in printed.out
    assert "2 derivations whose" in printed.out
    assert "2.398e+11 units of eps, and the whole oscillator" in printed.out
    assert "releases the block after 51.1." in printed.out
    assert [line.partition(":")[0] for line in printed.err.splitlines()] == STAGES
    assert main(["reproduce", "--out", str(tmp_path), "--dps", "15"]) == 0
    printed = capsys.readouterr()
    assert printed.out.count("up to date") == 4
    assert printed.err == ""


@pytest.mark.parametrize(
    ("arguments", "told"),
    [(["--only", "fric3"], "fric3 is no stage"), (["--dps", "0"], "dps is 0")],
)
def test_bad_input_makes_nothing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], told: str
) -> None:
    assert main(["reproduce", "--out", str(tmp_path / "out"), *arguments]) == 2
    assert told in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_place_that_cannot_be_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "file").write_text("mine")
    assert main(["reproduce", "--out", str(tmp_path / "file" / "out"), "--only", "fric2"]) == 2
    error = capsys.readouterr().err.splitlines()[-1]
    assert error.startswith("symasym: ")
    assert "cannot be written" in error
    assert (tmp_path / "file").read_text() == "mine"


def test_a_full_disk_leaves_earlier_results(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    made(tmp_path, dps=15)
    before = {name: (tmp_path / name).read_bytes() for name in FILES}

    def full(_: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert main(["reproduce", "--out", str(tmp_path), "--dps", "20"]) == 2
    assert "No space left on device" in capsys.readouterr().err
    assert {name: (tmp_path / name).read_bytes() for name in files(tmp_path)} == before
    assert made(tmp_path, dps=20) == ["reference"]


def test_an_interrupt_between_files_leaves_whole_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    encode = figures.encode

    def interrupted(figure: object, kind: str) -> bytes:
        if kind == "svg":
            raise KeyboardInterrupt
        return encode(figure, kind)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(figures, "encode", interrupted)
        assert main(["reproduce", "--out", str(tmp_path)]) == 130
    assert capsys.readouterr().err.splitlines()[-1].startswith("symasym: interrupted")
    assert files(tmp_path) == {"fric1.png"}
    assert made(tmp_path) == STAGES
    assert files(tmp_path) == FILES


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
@pytest.mark.parametrize("stop", [signal.SIGINT, signal.SIGTERM])
def test_stopped_from_outside(tmp_path: Path, stop: signal.Signals) -> None:
    arguments = ["reproduce", "--out", str(tmp_path), "--only", "reference", "--dps", "200"]
    with started([*PROGRAM, *arguments], stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr.readline().startswith("reference")
        time.sleep(0.3)
        process.send_signal(stop)
        assert process.stderr.read().startswith("symasym: interrupted")
    assert process.returncode == 130
    assert os.listdir(tmp_path) == []
