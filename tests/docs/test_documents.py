"""The documents' links lead somewhere; their code blocks are run by conftest.py."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").glob("**/*.md"))]


def _anchors(page: Path) -> set[str]:
    headings = re.findall(r"^#+ +(.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"```.*?```|`[^`\n]*`", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if target.startswith(("http:", "https:", "mailto:")):
            continue
        name, _, anchor = target.partition("#")
        found = page.parent / name if name else page
        assert found.exists(), f"{page.name}: no {target}"
        if anchor and found.suffix == ".md":
            assert anchor in _anchors(found), f"{page.name}: no heading for {target}"


#: The page of changes, in plain text as in the repository.
_PLAIN_PAGES = {"CHANGELOG.md"}
_PLAIN = re.compile(
    r"[α-ωΓΔΦΩ²³√∫′∞]|[⁰¹⁴-⁹⁻⁺₀-₉]|\^|<=|>=|<<|>>|\b(?:kappa|lam|eps|mu|alpha|sqrt|lambda)\b|\bz0\b"
    r"|\b[a-zA-Z] ?[=<>≤≥≈] ?[-−\d]|\b[uV]\d\b|\b[aVOuAMTPGH]\(\w|\d×|[\w)] [≤≥≈×·] [\w(]"
    r"|(?<![\w.])1e[-−]?\d"
)


def _prose(text: str) -> str:
    """A page without code, formulas, headings, pictures, addresses and tables as measured."""
    text = re.sub(r"```.*?```|<!-- measured.*?<!-- end -->", "", text, flags=re.DOTALL)
    text = re.sub(r"(?m)^#.*$", "", text)
    text = re.sub(r"\$\$.*?\$\$|\$[^$]*\$|`[^`]*`|!\[[^\]]*\]", "", text, flags=re.DOTALL)
    return re.sub(r"\]\([^)]*\)|<[^>]*>", "]", text)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_formulas_are_typeset(page: Path) -> None:
    if page.name not in _PLAIN_PAGES:
        prose = _prose(page.read_text(encoding="utf-8"))
        assert not [line for line in prose.splitlines() if _PLAIN.search(line)]


def test_a_formula_in_plain_characters_is_seen() -> None:
    for plain in ("of order κ²", "O(kappa)", "at u = 1", "e^x", "to 1e-6", "V(u1)", "a ≤ b"):
        assert _PLAIN.search(_prose(f"It is {plain} here."))
    assert not _PLAIN.search(_prose("It is $O(\\kappa)$, or `kappa=1`, 3 ± 1."))


def test_the_paper_cites_what_is_listed() -> None:
    text = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
    listed = (ROOT / "docs" / "paper.bib").read_text(encoding="utf-8")
    cited = set(re.findall(r"@(\w+)", text))
    assert cited == set(re.findall(r"@\w+\{(\w+),", listed)) != set()
