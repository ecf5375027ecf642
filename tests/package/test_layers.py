"""The layers of the package: the contracts in pyproject.toml, and their page in docs/."""

from __future__ import annotations

import re
import sys
import tomllib
from pathlib import Path

import pytest
from importlinter.cli import EXIT_STATUS_SUCCESS, lint_imports

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
from website import layers  # noqa: E402

SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]


@pytest.mark.parametrize("contract", [c["id"] for c in SETTINGS["contracts"]])
def test_imports_go_down(
    contract: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    status = lint_imports(str(ROOT / "pyproject.toml"), (contract,), no_cache=True, no_logo=True)
    assert status == EXIT_STATUS_SUCCESS, capsys.readouterr().out


def test_every_room_has_its_line() -> None:
    rooms = [room for row in layers.rows() for room in row if room != ":"]
    page = (ROOT / "docs" / "house.md").read_text("utf-8")
    assert re.findall(r"^\| ([\w.]+) \|", page, re.MULTILINE)[1:] == rooms


def test_the_picture_has_every_room() -> None:
    rooms = [room for row in layers.rows() for room in row if room != ":"]
    (page,) = layers.pages().values()
    assert re.findall(r"<text[^>]*>([\w.]+)</text>", page) == rooms
