"""The main job: it makes what is missing or stale, and nothing twice."""

from __future__ import annotations

import json
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure
from mpmath import mp, mpf

import symasym as sa
from symasym.derivation.derivation import build
from symasym.workshop import figures, reference_quadrature, reproduce

STAGES = ["one", "two", "reference", "standard", "derivations"]
STANDARD = reproduce.STANDARD
LABELS = ["eq:osc2", "filippov"]  # without checks that take time


@pytest.fixture(autouse=True)
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures without curves, two derivations, few extensions; and a source that stays."""
    drawn = {name: partial(Figure, figsize=(1, 1), label=name) for name in STAGES[:2]}
    monkeypatch.setattr(figures, "FIGURES", drawn)
    monkeypatch.setattr(reproduce, "Z0", ("-1.50", "-0.05"))
    monkeypatch.setattr(reproduce, "STANDARD", STANDARD[:2])
    monkeypatch.setattr(reproduce, "_source", lambda: "source")
    monkeypatch.setattr(reproduce, "labels", lambda: list(LABELS))


def made(out: Path, **options: Any) -> list[str]:
    """Names of the stages that were made and not up to date."""
    found = reproduce.reproduce(out, **options)
    return [stage for stage, _, seconds in found if seconds is not None]


def test_what_is_missing_or_stale_is_made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert made(tmp_path, only=["two"]) == ["two"]
    assert {p.name for p in tmp_path.iterdir()} == {"two.png", "two.svg", ".stamps.json"}
    assert made(tmp_path) == ["one", "reference", "standard", "derivations"]
    assert made(tmp_path) == []
    (tmp_path / "one.svg").unlink()
    assert made(tmp_path) == ["one"]
    (tmp_path / "two.png").write_bytes(b"someone else's")
    assert made(tmp_path) == ["two"]
    page = next((tmp_path / "derivations").glob("*filippov*.md"))
    page.unlink()
    assert made(tmp_path) == ["derivations"]
    assert page.exists()
    assert made(tmp_path, only=["one"], force=True) == ["one"]
    monkeypatch.setattr(reproduce, "_source", lambda: "changed")
    assert made(tmp_path, only=["one", "two"]) == ["one", "two"]
    (tmp_path / ".stamps.json").unlink()
    assert made(tmp_path, only=["two"]) == ["two"]
    with pytest.raises(sa.InputError):
        made(tmp_path, only=["three"])


def test_a_derivation_that_fails_ends_the_job(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    step = build("filippov").steps[0]
    monkeypatch.setattr(step, "right", 2 * step.right)
    for _ in range(2):  # and isn't taken for made
        with pytest.raises(sa.SymasymError, match="filippov"):
            made(tmp_path, only=["derivations"])


def test_the_reference_table_is_right(tmp_path: Path) -> None:
    """Against plain quadrature, where that is possible, and against more digits."""
    assert made(tmp_path, only=["reference"], dps=30) == ["reference"]
    values = json.loads((tmp_path / "reference.json").read_text())["values"]
    assert len(values) == 2 * len(figures.DRAWN) * len(reproduce.Z0)
    x = {"mu": "3", "alpha": "1", "z0": "-1.50", "kappa": "1", "r": "10"}
    time, side = (v for v in values if v["x"] == x)
    scene = sa.friction(3, 1, "-3/2"), Fraction(1), Fraction(10)
    with mp.workdps(50):
        exact = reference_quadrature.escape_time(*scene, Fraction(0), 20)
        assert abs(mpf(time["mid"]) / exact - 1) < 1e-20
        assert abs(mpf(time["paper"]) / sa.escape_time(*scene, method="paper", dps=40) - 1) < 1e-29
        for found, verb in ((time, sa.escape_time), (side, sa.exit_probability)):
            assert abs(mpf(found["mid"]) - verb(*scene, dps=40)) <= mpf(found["rad"])
            assert mpf(found["rad"]) < mpf("1e-28") * mpf(found["mid"])


def test_standard_problems_have_their_closed_forms(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Brownian motion without and with drift, and geometric Brownian motion."""
    monkeypatch.setattr(reproduce, "STANDARD", STANDARD[:3])
    assert made(tmp_path, only=["standard"], dps=30) == ["standard"]
    table = json.loads((tmp_path / "standard.json").read_text())
    assert "proved" in table["error"]
    with mp.workdps(50):
        far = mp.log(2)
        exact = [
            {"T": 1, "variance": mpf(2) / 3, "C": mpf(1) / 2, "rate": mp.pi**2 / 8},
            {"T": mp.tanh(1), "C": 1 / (1 + mp.e**2), "rate": (1 + mp.pi**2 / 4) / 2},
            {
                "T": 2 * far * mp.tanh(far / 2),
                "C": mpf(1) / 3,
                "rate": (1 + (mp.pi / far) ** 2) / 8,
            },
        ]
        for problem, values in zip(table["problems"], exact, strict=True):
            for name, value in values.items():
                found = problem[name]
                assert abs(mpf(found["mid"]) - value) <= mpf(found["rad"]) < value / 10**28
