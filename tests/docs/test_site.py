"""The site: what is made for it, and, where Chromium is installed, every page as a reader sees it.

The slow tests build the site, or take the one whose folder is in SYMASYM_SITE.
"""

from __future__ import annotations

import importlib.util
import json
import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urlsplit

import numpy as np
import pytest
import sympy

import derivations.sections  # noqa: F401
from derivations.pages import display, slug, with_roots
from symasym.derivation.derivation import LABELS, build

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "docs"))
from website import api, calls, formulas, glossary, graph, stage  # noqa: E402
from website.plotting import expansions  # noqa: E402

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
# No connection is tried: neither the browser's own nor a page's.
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--no-first-run",
]
_LOCAL = ("file:", "data:", "blob:")
WIDE, PHONE = (1280, 900), (390, 844)


# What is made.


def test_every_call_is_of_a_formula() -> None:
    assert set(calls.CALLS) <= set(LABELS)
    assert calls.session("folds").endswith("z0=(-0.7777777777777777, 2.7777777777777777))")


def test_expansions_err_less_than_they_state() -> None:
    noise = expansions.along_noise(3)  # 0.02, 0.77 and 30
    assert np.isfinite(noise.true["laplace"]).tolist() == [True, False, False]
    assert np.isfinite(noise.true["strong_noise"]).tolist() == [False, True, True]
    for name in expansions.METHODS:
        seen = np.isfinite(noise.true[name])
        assert np.all(noise.true[name][seen & np.isfinite(noise.stated[name])] > 0)
        # The truth is a float64 value, of which the last digits are rounding.
        assert not np.any(noise.stated[name] < noise.true[name] * (1 - 1e-12) - 1e-15), name
    assert noise.true["uniform"][0] < noise.true["laplace"][0] < noise.true["paper"][0] < 1e-3


def test_a_page_says_what_where_and_under_which_conditions() -> None:
    text = formulas.page("eq:Ttildesmall")
    assert text.startswith("# The mean escape time in weak noise\n")
    assert "`eq:Ttildesmall`, equation (39) of [the paper](https://arxiv.org/abs/1310.8328)" in text
    order = [text.index(f"## {name}") for name in (
        "Conditions", "Counterexamples", "Symbols", "Evaluate it", "Derivation", "Used by"
    )]  # fmt: skip
    assert order == sorted(order)
    assert text.count("- It is false that the formula holds up to ") == 2
    several = text.count("{admonition} Erratum")
    assert several > 1
    assert f"<summary>{several} errata</summary>" in text
    assert 'data-copy="T = \\frac{r}{a^+} + ' in text
    code = text.partition("<summary>As code")[2].partition("</details>")[0]
    assert set(re.findall(r"^(.*)\n```(?!\n)\w+$", code, re.MULTILINE)) == {"{.no-search}"}


def test_indexes_name_and_show_each_formula_once() -> None:
    listed = formulas.index().partition("## Definitions")[0]
    order = [listed.index(f"`{label}` ({n})") for label, n in (
        ("eq:Ttildelarge", 36), ("eq:Ttildesmall", 39), ("eq:S", 40), ("fr1", 53)
    )]  # fmt: skip
    assert order == sorted(order)
    sections = "\n".join(map(formulas.section, formulas.SECTIONS))
    for label in LABELS:
        assert listed.count(f"({slug(label)}.md)") == 1
        assert len(re.findall(rf"^{slug(label)}$", sections, re.MULTILINE)) == 1
        assert "\n".join(display(build(label).latex())) in sections
        # Titles are words alone, in the sidebar as well.
        assert not re.search(r"eq:|[$\\]", formulas.heading(build(label).title)), label


def test_one_file_holds_every_formula() -> None:
    data = json.loads(formulas.machine_readable())
    found = {item["label"]: item for item in data["formulas"]}
    assert list(found) == list(LABELS)
    assert [found[x]["equation"] for x in ("eq:Ttildesmall", "friction-well")] == [39, None]
    assert sympy.sympify(found["eq:C"]["sympy"][0]) == build("eq:C").right()


def test_labels_on_the_errata_lead_to_their_formulas() -> None:
    text = formulas.linked("(39) `eq:Ttildesmall`, `eq:osc1`")
    assert text == "(39) [`eq:Ttildesmall`](formulas/eq-Ttildesmall.md), `eq:osc1`"


def test_an_erratum_on_a_page_leads_to_its_row() -> None:
    rows = re.findall(r'<a id="(erratum-\d+)">', (ROOT / "docs" / "errata.md").read_text("utf-8"))
    boxes = "\n".join("\n".join(formulas._errata(label)) for label in LABELS)
    linked = set(re.findall(r"errata\.html#([\w-]+)", boxes))
    assert len(rows) == 51
    assert len(linked) > 15
    assert linked <= set(rows)


def test_arrows_of_the_graph_lead_down() -> None:
    rests = {label: build(label).rests_on for label in with_roots(LABELS)}
    at = graph.positions(rests)
    arrows = [(b, node) for node, below in rests.items() for b in below]
    assert all(at[b][1] < at[node][1] for b, node in arrows)
    # The page is 1,020 pixels wide beside its sidebar.
    assert max(x for x, _ in at.values()) + graph.WIDTH / 2 < 1020
    # No two boxes of a row overlap.
    boxes = sorted((row, x) for node, (x, row) in at.items() if node in rests)
    for (row, x), (below, after) in pairwise(boxes):
        assert below > row or after - x > graph.WIDTH
    assert len(set(at.values())) == len(at)
    assert graph.svg(rests, {name: name for name in rests}).count("<path") == len(arrows) > 60


def test_pages_take_the_place_of_their_link_and_new_ones_are_not_lost() -> None:
    index = (
        "# S\n\n- [B](b.md)\n- [A](a.md), [there](c.md#x)\n\n## Guides\n\n- [C](c.md), [B](b.md)\n"
    )
    found = stage.with_toctrees(index, {"a.md", "b.md", "c.md", "new.md"})
    trees = re.findall(r"```\{toctree\}\n(.*?)```", found, re.DOTALL)
    listed = [re.sub(r":hidden:|:caption:", "", tree).split() for tree in trees]
    assert listed[:3] == [["b", "a"], ["Guides", "c"], ["More", "new"]]


def test_a_word_of_the_glossary_is_linked_where_it_is_first_used() -> None:
    text = "# A well\n\nAs well as `fold`: the well, $a$ fold and the well's fold."
    assert re.findall(r"#(term-\w+)\">(\w+)<", glossary.linked(text)) == [
        ("term-well", "well"),
        ("term-fold", "fold"),
    ]
    fenced = "````{raw} html\nWells\n```\nfolds\n````\n\nSee `folds`.\n"
    assert glossary.linked(fenced) == fenced
    made = glossary.anchored((ROOT / "docs" / "glossary.md").read_text("utf-8"))
    anchors = re.findall(r'<span id="([\w-]+)">', made)
    assert sorted(anchors) == sorted(set(glossary.terms().values()))
    entries = re.findall(r"\{index\}`[^`]*<([^>]*)>`", made)
    assert {
        "!kappa, !noise amplitude",
        "!mean escape time",
        "!start",
        "!fold",
        "!interior maximum, !saddle",
    } <= set(entries)
    assert not {"!word", "!symbol"} & set(entries)


def test_a_label_leads_to_its_formula() -> None:
    made = {"formulas/eq-S.md": "", "formulas/index.md": ""}
    left = "# `eq:S`\n\n```\n`eq:S`\n```\n[`eq:S`](a.md) and `eq:V`, $u<v$"
    assert stage.labelled(f"{left}, `eq:S`", made) == f"{left}, [`eq:S`](formulas/eq-S.md)"


def test_links_of_the_changelog_lead_to_pages_beside_it(tmp_path: Path) -> None:
    stage.stage(tmp_path / "source", {})
    text = (tmp_path / "source" / "CHANGELOG.md").read_text("utf-8")
    linked = re.findall(r"\]\(([\w./-]+\.md)", text)
    assert linked
    assert all((tmp_path / "source" / name).is_file() for name in linked)


def test_every_public_name_is_in_the_reference() -> None:
    import symasym as sa

    text = "\n".join(api.pages().values())
    assert all(re.search(rf":: {name}(?:\(.*\))?$", text, re.MULTILINE) for name in sa.__all__)
    first = re.findall(r"auto\w+:: (\w+)", text)[:3]
    assert first == ["escape_time", "exit_probability", "occupation"]


def test_hidden_members_are_members() -> None:
    import symasym as sa
    from symasym import derivation

    for name, members in api.INNER.items():
        owner = getattr(sa, name, None) or getattr(derivation, name)
        assert all(hasattr(owner, member) for member in members), name
        assert f"exclude-members: {', '.join(members)}" in "\n".join(api.pages().values())


# The site as it is built.


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Path:
    if given := os.environ.get("SYMASYM_SITE"):
        return Path(given)
    for module in ("sphinx", "furo", "myst_parser"):
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
    """Targets, anchors and formulas of a page."""

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
        for name in ("href", "src"):
            if found.get(name):
                self.targets.append(str(found[name]))


def _pages(site: Path) -> dict[Path, _Page]:
    found = {}
    for path in sorted(site.rglob("*.html")):
        if "_static" not in path.relative_to(site).parts:
            found[path] = _Page(path.read_text("utf-8"))
    return found


@pytest.mark.slow
def test_signatures_have_the_names_of_types(site: Path) -> None:
    for page in (site / "api").glob("*.html"):
        text = re.sub(r"<[^>]*>", "", page.read_text("utf-8"))
        found = re.findall(r"TypeAliasForwardRef|_SupportsArray|&lt;factory&gt;|<factory>", text)
        assert not found, page.name


@pytest.mark.slow
def test_no_link_is_broken_and_nothing_comes_from_elsewhere(site: Path) -> None:
    pages, broken, followed = _pages(site), [], 0
    for path, page in pages.items():
        for target in page.targets:
            parts = urlsplit(target)
            if parts.scheme == "data" or parts.scheme == "mailto":
                continue
            if parts.scheme:
                # A link may lead out; what a page loads may not (checked in the browser).
                continue
            goal = (path.parent / unquote(parts.path)).resolve() if parts.path else path
            followed += 1
            if not goal.is_file() or (
                parts.fragment and goal in pages and parts.fragment not in pages[goal].anchors
            ):
                broken.append(f"{path.relative_to(site)}: {target}")
    assert not broken
    assert followed > 1000
    assert {f"formulas/{label.replace(':', '-')}.html" for label in LABELS} <= {
        str(path.relative_to(site)) for path in pages
    }


@pytest.fixture(scope="module")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="playwright is not installed (extra docs)"
    )
    if CHROMIUM is None:
        pytest.skip("chromium is not installed")
    with playwright.sync_playwright() as running:
        started = running.chromium.launch(executable_path=CHROMIUM, args=FLAGS)
        yield started
        started.close()


# The formulas that were drawn, those that were not, those with symbols on each other or wider than
# their column, and how wide the page is.
_LOOK = """async () => {
  if (window.MathJax) await MathJax.startup.promise;
  const wrong = [...document.querySelectorAll('[data-mjx-error], [data-mml-node="merror"]')];
  const drawn = [...document.querySelectorAll('mjx-container')];
  const folded = (c) => c.closest('details:not([open])') !== null;
  const boxes = (c) => [...c.querySelectorAll('[data-mml-node="mi"], [data-mml-node="mn"]')]
    .map((symbol) => symbol.getBoundingClientRect());
  const common = (a, b) =>
    Math.min(a.right, b.right) - Math.max(a.left, b.left) > 0.3 * Math.min(a.width, b.width) &&
    Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.35 * Math.min(a.height, b.height);
  const overlaps = (c) => boxes(c).some((a, k, all) => all.slice(k + 1).some((b) => common(a, b)));
  const wide = (c) => {
    const column = c.closest('div.math')?.getBoundingClientRect();
    return column && boxes(c).some((b) => b.left < column.left - 1 || b.right > column.right + 1);
  };
  return {
    misplaced: drawn.filter((c) => overlaps(c) || wide(c)).map((c) => c.textContent.slice(0, 80)),
    drawn: drawn.filter((c) => !folded(c) && c.getBoundingClientRect().width > 0).length,
    hidden: drawn.filter(folded).length,
    wrong: wrong.map((e) => e.closest('mjx-container').textContent.slice(0, 80)),
    width: document.documentElement.scrollWidth,
  };
}"""


def _look(tab, path: Path) -> tuple[dict, list[str]]:
    """What is on a page, and whatever its console says or its requests do wrong."""
    said: list[str] = []
    ears = {
        "console": lambda m: said.append(m.text) if m.type in ("error", "warning") else None,
        "pageerror": lambda error: said.append(str(error)),
        "requestfailed": lambda request: said.append(f"failed: {request.url}"),
        "request": lambda q: None if q.url.startswith(_LOCAL) else said.append(f"asks {q.url}"),
    }
    for event, heard in ears.items():
        tab.on(event, heard)
    tab.goto(path.as_uri())
    found = tab.evaluate(_LOOK)
    for event, heard in ears.items():
        tab.remove_listener(event, heard)
    return found, said


@pytest.mark.slow
def test_every_page_loads_and_every_formula_is_drawn(site: Path, browser) -> None:
    problems, drawn = [], 0
    tab = browser.new_page()
    for path, page in _pages(site).items():
        tab.set_viewport_size({"width": PHONE[0], "height": PHONE[1]})
        found, said = _look(tab, path)
        drawn += found["drawn"]
        name = path.relative_to(site)
        problems += [f"{name}: {line}" for line in said]
        problems += [f"{name}: not TeX: {line}" for line in found["wrong"]]
        problems += [f"{name}: overlaps or too wide: {line}" for line in found["misplaced"]]
        if found["drawn"] + found["hidden"] != page.formulas:
            problems.append(f"{name}: {found} of {page.formulas} formulas")
        widths = {PHONE[0]: found["width"]}
        tab.set_viewport_size({"width": WIDE[0], "height": WIDE[1]})
        widths[WIDE[0]] = tab.evaluate("document.documentElement.scrollWidth")
        problems += [f"{name}: {w} pixels wide in {size}" for size, w in widths.items() if w > size]
    tab.close()
    assert not problems
    assert drawn > 500


#: What is asked for, and where the first answer leads.
FOUND = {
    "fold": "uniform.html",
    "start": "glossary.html",
    "barrier": "glossary.html",
    "error": "glossary.html",
    "probability": "bounds.html",
    "install": "index.html#install",
    "kappa": "glossary.html",
    "escape%20time": "glossary.html",
    "stationary%20density": "glossary.html",
    "weak%20noise": "weak-noise.html",
    "Stokes": "uniform.html",
    "gene": "tutorial-own-drift.html",
    "Hill": "api/drifts.html#symasym.hill",
    "escape_time": "api/quantities.html#symasym.escape_time",
}


@pytest.mark.slow
@pytest.mark.parametrize("asked", FOUND)
def test_the_search_finds_the_guide_first(site: Path, browser, asked: str) -> None:
    tab = browser.new_page()
    tab.goto(f"{(site / 'search.html').as_uri()}?q={asked}")
    links = tab.locator("ul.search li > a:first-child")
    links.first.wait_for()
    goal = links.first.get_attribute("href") or ""
    assert goal == FOUND[asked] or goal.startswith(f"{FOUND[asked]}#index-")
    assert "\\" not in "".join(links.all_inner_texts())
    tab.close()


@pytest.mark.slow
def test_bad_tex_and_a_missing_script_are_noticed(site: Path, browser) -> None:
    good = site / "formulas" / "eq-Ttilde.html"
    bad = good.with_name("bad-on-purpose.html")
    text = good.read_text("utf-8").replace(r"\[", r"\[ \nosuchmacro ", 1)
    bad.write_text(text.replace("</head>", '<script src="absent.js"></script></head>'), "utf-8")
    tab = browser.new_page()
    try:
        found, said = _look(tab, bad)
    finally:
        bad.unlink()
        tab.close()
    assert found["wrong"]
    assert any("absent.js" in line for line in said)


# The explorer.

SLIDERS = {
    "mu": "μ shape",
    "alpha": "α friction",
    "z0": "z₀ spring",
    "kappa": "κₚ noise",
    "eps": "ε half-width",
    "r": "rₚ radius",
}
_DRAWN = """async () => {
  // What an event asks for is drawn before the next frame.
  for (let k = 0; k < 2; k++) await new Promise(requestAnimationFrame);
  // The exact curve comes later.
  while (document.querySelector('#oscillator [aria-busy]')) {
    await new Promise((done) => setTimeout(done, 20));
  }
  const all = (selector) => [...document.querySelectorAll('#oscillator ' + selector)];
  const text = (node, selector) => node.querySelector(selector).textContent;
  return {
    plots: all('svg').map((svg) => svg.innerHTML),
    values: Object.fromEntries(all('dl > div').map((row) => [text(row, 'dt'), text(row, 'dd')])),
    region: document.querySelector('#explorer-region').textContent,
    sliders: Object.fromEntries(all('div:not([hidden]) > input[type=range]').map((i) => [
      i.name, i.parentElement.querySelector('input[type=text]').value.replace('−', '-')])),
  };
}"""


def _paper_time(sliders: dict[str, str]) -> str:
    import symasym as sa

    drift = sa.friction(sliders["mu"], sliders["alpha"], sliders["z0"])
    scales = sa.rescale(eps=sliders["eps"], kappa=sliders["kappa"], r=sliders["r"])
    time = sa.escape_time(drift, float(scales.kappa), float(scales.r), method="paper")
    return f"{time:.4g}"


@pytest.mark.slow
def test_the_explorer_answers_to_every_slider_by_key(site: Path, browser) -> None:
    tab = browser.new_page(viewport={"width": PHONE[0], "height": PHONE[1]})
    tab.goto((site / "explorer.html").as_uri())
    start = seen = tab.evaluate(_DRAWN)
    assert len(start["plots"]) == 5
    for name, label in SLIDERS.items():
        tab.get_by_role("slider", name=label).focus()
        tab.keyboard.press("ArrowRight")
        now = tab.evaluate(_DRAWN)
        moved = [k for k in SLIDERS if now["sliders"][k] != seen["sliders"][k]]
        assert moved == [name]
        changed = [k for k in range(5) if now["plots"][k] != seen["plots"][k]]
        # V and phi hold neither noise nor radius.
        assert (0 in changed and 1 in changed) == (name in ("mu", "alpha", "z0"))
        assert 4 in changed
        assert now["values"]["T, scaled, by the paper’s formula"] == _paper_time(now["sliders"])
        for kind in ("curve", "dashed", "dotted"):
            assert f'class="{kind}"' in now["plots"][4]
        assert now["values"]["T, scaled, by the uniform formula"] not in ("–", "")
        seen = now
    slider = tab.get_by_role("slider", name="z₀ spring")
    slider.fill("0.5")
    slid = tab.evaluate(_DRAWN)
    assert slid["region"].startswith("Sliding")
    # T is far above the frame, at whose top an arrow stands.
    assert '<polygon class="dot"' in slid["plots"][4]
    labels = ("V", "ϕ", "p", "S", "log₁₀ T")
    for plot, label in zip(slid["plots"], labels, strict=True):
        assert re.search(rf"rotate[^>]*>{label}</text>", plot)
    assert "<path" in slid["plots"][2]
    assert "p(u)" in tab.locator("#oscillator figure").nth(2).inner_text()
    # The sliders stay in sight while the last plot is looked at.
    tab.locator("#oscillator figure").last.scroll_into_view_if_needed()
    box = slider.bounding_box()
    assert box is not None
    assert 0 < box["y"] < PHONE[1] / 3
    tab.get_by_role("button", name="Reset").press("Enter")
    tab.wait_for_timeout(100)
    assert tab.evaluate(_DRAWN) == start
    tab.close()


@pytest.mark.slow
def test_the_explorers_address_holds_its_sliders(site: Path, browser) -> None:
    tab = browser.new_page()
    page = (site / "explorer.html").as_uri()
    tab.goto(f"{page}#mu=2&z0=-0.5&kappa_p=0.045&r_p=nothing")
    seen = tab.evaluate(_DRAWN)
    wanted = {"mu": "2.00", "z0": "-0.50", "kappa": "0.045", "r": "0.1"}
    assert {name: seen["sliders"][name] for name in wanted} == wanted
    log = {
        name: float(seen["values"][f"T, scaled, {name}"].replace(" × 10", "e"))
        for name in ("z frozen", "by the paper’s formula")
    }
    error = abs(log["by the paper’s formula"] / log["z frozen"] - 1)
    shown = float(
        seen["values"]["relative error of the paper’s formula"]
        .replace(" × 10", "e")
        .replace("−", "-")
    )
    assert shown == pytest.approx(error, abs=2e-3)
    tab.get_by_role("slider", name=SLIDERS["alpha"]).focus()
    tab.keyboard.press("ArrowRight")
    again = tab.evaluate(_DRAWN)
    other = browser.new_page()
    other.goto(tab.url)
    assert other.evaluate(_DRAWN)["sliders"] == again["sliders"] != seen["sliders"]
    other.goto("about:blank")
    other.goto((site / "explorer.html").as_uri() + "#kappa=0.02&r_p=7&mu=2")
    region = other.locator("#explorer-region").text_content()
    said = "kappa = 0.02 (write kappa_p, which is physical), r_p = 7 (from 0.05 to 1)"
    assert region.endswith(f"Not taken: {said}.")
    sliders = other.evaluate(_DRAWN)["sliders"]
    assert (sliders["kappa"], sliders["mu"]) == ("0.03", "2.00")
    other.close()
    tab.close()


@pytest.mark.slow
def test_the_explorer_takes_typed_numbers_other_drifts_and_an_axis_of_noise(site, browser) -> None:
    import symasym as sa

    tab = browser.new_page()
    tab.goto((site / "explorer.html").as_uri())
    typed = tab.get_by_label("z₀ spring, typed")
    typed.fill("-0.4321")
    typed.press("Enter")
    seen = tab.evaluate(_DRAWN)
    assert seen["values"]["T, scaled, by the paper’s formula"] == _paper_time(seen["sliders"])
    assert "z0=-0.4321" in tab.url
    typed.fill("7")
    typed.press("Enter")
    assert tab.evaluate(_DRAWN)["values"] == seen["values"]
    region = tab.locator("#explorer-region")
    assert region.text_content().endswith("Not taken: z₀ spring = 7 (from −3 to 5).")
    assert typed.get_attribute("aria-invalid") == "true"
    typed.fill("−7/9")
    typed.press("Enter")
    fold = tab.evaluate(_DRAWN)["values"]
    assert "Not taken" not in region.text_content()
    assert fold["height of the barrier"] in ("–", "below 10−10")
    assert fold["time for the belt to carry z to the fold z₀⁽⁺⁾"] in ("–", "0")
    typed.fill("-0.4321")
    typed.press("Enter")
    tab.get_by_label("Curves against").select_option("kappa")
    noise = tab.evaluate(_DRAWN)
    assert noise["values"] == seen["values"]
    for kind in ("curve", "dashed", "dotted", "belt"):
        assert f'class="{kind}"' in noise["plots"][4]
    for name, drift in (("tanh", sa.tanh(1, "1/2", 5)), ("sine", sa.sine(1, "1/2", 2))):
        tab.get_by_label("Drift", exact=True).select_option(name)
        found = tab.evaluate(_DRAWN)
        scales = sa.rescale(eps="0.01", kappa="0.03", r="0.1")
        time = sa.escape_time(drift, scales.kappa, scales.r)
        assert float(found["values"]["T, scaled"]) == pytest.approx(time, rel=1e-3)
        assert all("<path" in plot for plot in found["plots"])
    # Noise so weak that C is less than a double may be.
    import mpmath

    tab.get_by_label("κₚ noise, typed").fill("0.004")
    tab.get_by_label("κₚ noise, typed").press("Enter")
    found = tab.evaluate(_DRAWN)["values"]
    assert "NaN" not in str(found)
    log = sa.exit_probability(drift, "0.04", 10, log=True)
    digits, power = found["C, chance of leaving through −r"].replace("−", "-").split(" × 10")
    assert int(power) < -308
    seen = float(mpmath.log(mpmath.mpf(digits)) + int(power) * mpmath.log(10))
    assert seen == pytest.approx(float(log), abs=1e-3)
    tab.close()


_CONTRAST = """() => {
  const light = (colour) => {
    const part = colour.match(/[\\d.]+/g).slice(0, 3).map((x) => x / 255);
    const [r, g, b] = part.map((x) => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
    return 0.2126 * r + 0.7152 * g + 0.0722 * b;
  };
  const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const style = (selector) => getComputedStyle(document.querySelector('#oscillator ' + selector));
  const ground = light(style('svg').backgroundColor);
  const stroke = (kind) => ratio(light(style(kind).stroke), ground);
  const found = [Math.min(...['.curve', '.dashed', '.dotted'].map(stroke))];
  return [...found, ratio(light(style('svg text').fill), ground), ground];
}"""


@pytest.mark.slow
def test_the_explorer_is_legible_in_light_and_dark(site: Path, browser) -> None:
    grounds = {}
    for scheme in ("light", "dark"):
        tab = browser.new_page(color_scheme=scheme)
        tab.goto((site / "explorer.html").as_uri())
        curve, text, grounds[scheme] = tab.evaluate(_CONTRAST)
        assert curve > 3  # WCAG 1.4.11
        assert text > 4.5  # WCAG 1.4.3
        tab.close()
    assert grounds["dark"] < 0.2 < 0.8 < grounds["light"]
