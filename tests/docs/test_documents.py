"""The documents' links lead somewhere; conftest.py runs their code blocks."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CHANGELOG.md",
    ROOT / "CONTRIBUTING.md",
    *sorted((ROOT / "docs").glob("*.md")),
]


def _anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ +(.*)$", page.read_text("utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text("utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        found = page.parent / name if name else page
        assert found.exists(), f"{page.name}: no {target}"
        if anchor and found.suffix == ".md":
            assert anchor in _anchors(found), f"{page.name}: no heading for {target}"


def test_every_page_has_a_place_in_the_index() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    listed = set(re.findall(r"^- .*?\]\(([\w-]+\.md)\)", index, re.MULTILINE))
    assert {p.name for p in (ROOT / "docs").glob("*.md")} - {"index.md"} <= listed


def test_every_picture_is_shown() -> None:
    text = "".join(page.read_text("utf-8") for page in PAGES)
    assert {p.name for p in (ROOT / "docs" / "images").iterdir()} == set(
        re.findall(r"images/([\w.-]+)", text)
    )


def test_the_layers_on_the_page_are_those_of_the_contract() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    (layers,) = (
        c["layers"] for c in settings["tool"]["importlinter"]["contracts"] if c["id"] == "layers"
    )
    page = (ROOT / "docs" / "house.md").read_text("utf-8")
    drawn = re.search(r"```text\n(.*?)```", page, re.DOTALL)
    assert drawn is not None
    assert drawn[1].split("\n")[:-1] == layers
    rooms = [room for row in layers for room in re.findall(r"\w+", row)]
    assert re.findall(r"^\| (\w+) \| .* \| .*\|$", page, re.MULTILINE)[1:] == rooms
