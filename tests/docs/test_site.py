"""The site: what is made for it, and, where Chromium is installed, every page as a reader sees it.

The slow tests build the site, or take the one whose folder is in SYMASYM_SITE.
"""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

import pytest

import derivations.sections  # noqa: F401
import symasym as sa
from derivations.pages import display, slug, with_roots
from symasym.derivation.derivation import LABELS, build

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
from website import calls, formulas, graph, stage  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
WIDTHS = (390, 1280)


def test_a_page_says_what_where_and_under_which_conditions() -> None:
    assert set(calls.CALLS) <= set(LABELS)
    text = formulas.page("eq:Ttildesmall")
    assert "`eq:Ttildesmall`, equation (39) of [the paper](https://arxiv.org/abs/1310.8328)" in text
    order = [text.index(f"## {name}") for name in (
        "Where it holds", "Counterexamples", "Letters", "Error", "Derivation", "As code", "Used by"
    )]  # fmt: skip
    assert order == sorted(order)
    for letter in (r"A'(u_1)", r"\kappa", "D", "u_2"):
        assert text.count(f"\n| ${letter}$ |") == 1
    assert text.count("{admonition} Erratum") > 1
    assert all(f"**{target}**" in text for target in formulas.TARGETS)


def test_indexes_show_each_formula_once() -> None:
    listed = formulas.index().partition("## Definitions")[0]
    sections = "\n".join(map(formulas.section, formulas.SECTIONS))
    for label in LABELS:
        assert listed.count(f"({slug(label)}.md)") == 1
        assert len(re.findall(rf"^{slug(label)}$", sections, re.MULTILINE)) == 1
        assert "\n".join(display(build(label).latex())) in sections
        # Titles are words alone, in the sidebar as well.
        assert not re.search(r"eq:|[$\\]", formulas.heading(build(label).title)), label


def test_an_erratum_on_a_page_leads_to_its_row() -> None:
    rows = re.findall(r'<a id="(erratum-\d+)">', (ROOT / "docs" / "errata.md").read_text("utf-8"))
    boxes = "\n".join("\n".join(formulas._errata(label)) for label in LABELS)
    linked = set(re.findall(r"errata\.html#([\w-]+)", boxes))
    assert 15 < len(linked) <= len(rows)
    assert linked <= set(rows)


def test_arrows_of_the_graph_lead_down_and_boxes_stand_apart() -> None:
    rests = {label: build(label).rests_on for label in with_roots(LABELS)}
    at = graph.positions(rests)
    arrows = [(b, node) for node, below in rests.items() for b in below]
    assert all(at[b][1] < at[node][1] for b, node in arrows)
    boxes = sorted((row, x) for node, (x, row) in at.items() if node in rests)
    for (row, x), (below, after) in pairwise(boxes):
        assert below > row or after - x > graph.WIDTH
    assert graph.svg(rests, {name: name for name in rests}).count("<path") == len(arrows) > 60


def test_lists_of_the_front_page_give_pages_their_order_and_labels_lead() -> None:
    index = (ROOT / "docs" / "index.md").read_text("utf-8")
    trees = re.findall(r"```\{toctree\}\n(.*?)```", stage.with_toctrees(index), re.DOTALL)
    assert "tutorial-friction\ntutorial-own-drift" in trees[0]
    assert any("formulas/index" in tree for tree in trees)
    assert sorted(" ".join(stage.API.values()).split()) == sorted(sa.__all__)
    left = "# `eq:S`\n\n```\n`eq:S`\n```\n[`eq:S`](a.md) and `eq:none`, $u<v$"
    assert stage.labelled(f"{left}, `eq:S`") == f"{left}, [`eq:S`](formulas/eq-S.md)"


# The site as it is built.


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    if given := os.environ.get("SYMASYM_SITE"):
        return Path(given)
    for module in ("sphinx", "furo", "myst_parser", "sphinx_copybutton"):
        if importlib.util.find_spec(module) is None:
            pytest.skip(f"{module} is not installed (extra docs)")
    if shutil.which("npm") is None:
        pytest.skip("npm, by which MathJax comes, is not installed")
    out = tmp_path_factory.mktemp("build")
    command = [sys.executable, str(ROOT / "docs" / "build.py"), "-W", "--out", str(out)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=900)
    assert done.returncode == 0, done.stderr
    return out / "site"


class _Page(HTMLParser):
    """Targets, anchors and the number of formulas of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.anchors: set[str] = set()
        self.formulas = 0
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = dict(attrs)
        self.anchors.add(found.get("id") or "")
        self.formulas += "math" in (found.get("class") or "").split()
        self.targets += [str(found[name]) for name in ("href", "src") if found.get(name)]


def _pages(site: Path) -> dict[Path, _Page]:
    paths = (p for p in sorted(site.rglob("*.html")) if "_static" not in p.parts)
    return {path: _Page(path.read_text("utf-8")) for path in paths}


@pytest.mark.slow
def test_no_link_is_broken(site: Path) -> None:
    pages, broken = _pages(site), []
    for path, page in pages.items():
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme:
                continue
            goal = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            if not goal.is_file() or (
                parts.fragment and goal in pages and parts.fragment not in pages[goal].anchors
            ):
                broken.append(f"{path.relative_to(site)}: {target}")
    assert not broken
    assert {site / "formulas" / f"{slug(label)}.html" for label in LABELS} <= set(pages)


# The formulas that were drawn or stand folded, those that are no TeX, and how wide the page is.
_LOOK = """async () => {
  if (window.MathJax) await MathJax.startup.promise;
  const wrong = [...document.querySelectorAll('[data-mjx-error], [data-mml-node="merror"]')];
  return {
    drawn: document.querySelectorAll('mjx-container').length,
    wrong: wrong.map((e) => e.closest('mjx-container').textContent.slice(0, 80)),
    width: document.documentElement.scrollWidth,
  };
}"""


@pytest.mark.slow
def test_every_page_loads_and_every_formula_is_drawn(site: Path) -> None:
    playwright: Any = pytest.importorskip("playwright.sync_api", reason="no playwright")
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    problems: list[str] = []
    with playwright.sync_playwright() as running:
        browser = running.chromium.launch(
            executable_path=CHROMIUM, args=["--no-sandbox", "--disable-gpu"]
        )
        tab, said = browser.new_page(), []
        local = ("file:", "data:", "blob:")
        tab.on("console", lambda m: m.type in ("error", "warning") and said.append(m.text))
        tab.on("pageerror", lambda error: said.append(str(error)))
        tab.on("request", lambda q: q.url.startswith(local) or said.append(f"asks {q.url}"))
        for path, page in _pages(site).items():
            said.clear()
            name = path.relative_to(site)
            tab.set_viewport_size({"width": WIDTHS[0], "height": 844})
            tab.goto(path.as_uri())
            for width in WIDTHS:
                tab.set_viewport_size({"width": width, "height": 844})
                found = tab.evaluate(_LOOK)
                if found["width"] > width:
                    problems.append(f"{name}: {found['width']} pixels wide in {width}")
            problems += [f"{name}: {line}" for line in [*said, *found["wrong"]]]
            if found["drawn"] != page.formulas:
                problems.append(f"{name}: {found['drawn']} of {page.formulas} formulas")
        browser.close()
    assert not problems
