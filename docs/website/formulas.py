"""A page for each formula, made from the record of its derivation, and the indexes of all."""

from __future__ import annotations

import importlib
import inspect
import json
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cache
from html import escape
from importlib import metadata
from pathlib import Path
from typing import Any

import sympy

from derivations import report
from derivations.errata.entries import ERRATA
from derivations.labels import BEYOND, NUMBERS, numbered
from derivations.prose import prose
from derivations.registry import build, entries
from derivations.runner import slug
from derivations.symbols import IN_WORDS, LOCAL, MEANINGS, QUANTITIES, Listed, quantities, symbols
from symasym import friction
from symasym.base.errors import InputError
from symasym.derivation.results import latex
from symasym.emit import emit
from symasym.formula import Formula, formula
from website import calls, graph
from website.plotting.plots import Picture, Plot

Records = dict[str, dict[str, Any]]
#: What code is emitted for, and how it is coloured.
TARGETS = {
    "numpy": "python",
    "mpmath": "python",
    "python": "python",
    "c": "c",
    "javascript": "javascript",
    "latex": "latex",
}
NAMES = {
    "numpy": "NumPy",
    "mpmath": "mpmath",
    "python": "Python",
    "c": "C",
    "javascript": "JavaScript",
    "latex": "LaTeX",
}


#: Symbols that stand in conditions and notes as well, as they are printed.
_BESIDE = {"a^-": "a_minus", "a^+": "a_plus", r"\lambda": "lam", r"\kappa": "kappa"}
_BESIDE |= {r"\kappa_p": "kappa_phys", r"\varepsilon": "epsilon", "r_p": "r_phys", "r": "r"}
_BESIDE |= {"V": "V", r"\phi": "phi", r"p_{\mathrm{ss}}": "p_ss"}
#: The row of an indicator function, where a formula has one.
_INDICATOR = r"| $\mathbf{1}_{x > 0}$ | 1 where $x > 0$, 0 where $x < 0$ | a number |"
DOCS = Path(__file__).parent.parent
VERSION = metadata.version("symasym")
_ARXIV = "https://arxiv.org/abs/1310.8328"
_SIGNS = {"kappa": "κ", "sigma": "σ", "eps": "ε", "phi": "ϕ"}
_SIGNS |= {"^2": "²", "a-": "a⁻", "a+": "a⁺"}


def pages(
    records: Records, plots: Iterable[Plot | Picture], nothing: Mapping[str, str]
) -> dict[str, str]:
    """File name -> text: a page for each record, the indexes, and one file of all for machines.

    `nothing` says of labels without a plot why they have none.
    """
    drawn = {plot.label: about(plot) for plot in plots}
    drawn |= {label: nothing_of(why) for label, why in nothing.items()}
    made = {f"formulas/{slug(label)}.md": page(label, records, drawn[label]) for label in records}
    return {
        **made,
        "formulas/index.md": index(records),
        **{f"formulas/section-{n}.md": section(n, records) for n in report.SECTIONS},
        "formulas/quantities.md": by_quantity(records),
        "formulas/graph.md": graph_page(records),
        "formulas/formulas.json": machine_readable(records),
        "errata.md": linked((DOCS / "errata.md").read_text("utf-8"), records),
    }


def linked(text: str, records: Records) -> str:
    """A page of docs/ whose labels in code lead to their formulas."""
    return re.sub(
        r"`([\w:-]+)`",
        lambda found: (
            f"[`{found[1]}`](formulas/{slug(found[1])}.md)" if found[1] in records else found[0]
        ),
        text,
    )


def machine_readable(records: Records) -> str:
    """JSON of every formula: label, equation number, TeX, SymPy, assumptions, error, checks.

    `sympy` is equal to what `left` has in TeX; sentences have their formulas between dollar signs.
    """
    listed = []
    for label, record in records.items():
        found = formula(label)
        listed.append(
            {
                "label": label,
                "equation": NUMBERS.get(label),
                "title": record["title"],
                "latex": record["latex"],
                "left": latex(build(label).left, build(label).names),
                "sympy": sympy.srepr(found.expression),
                "remainder": None if found.remainder is None else sympy.srepr(found.remainder),
                "limit": found.limit,
                "assumptions": [
                    {
                        "statement": prose(h["statement"], str),
                        "status": h["status"],
                        "where": prose(h["where"], str),
                    }
                    for h in record["hypotheses"]
                ],
                "error": prose(record["error"], str),
                "note": prose(record["note"], str),
                "rests_on": record["rests_on"],
                "checks": dict(Counter(step["kind"] for step in record["steps"])),
            }
        )
    data = {"format": "symasym-site-formulas/2", "version": VERSION, "formulas": listed}
    return json.dumps(data, indent=1, ensure_ascii=False) + "\n"


def page(label: str, records: Records, plot: Iterable[str] = ()) -> str:
    """The page of one formula; `plot` are the lines about its plot."""
    record = records[label]
    parts = [
        [f"# {heading(record['title'])}", "", f"{place(label)}. {_section(label)}.", ""],
        report.statement(record),
        _tools(label, record),
        _errata(label),
        ["## Symbols", "", *_symbols(label, record)],
        report.conditions(record, "## "),
        report.counterexamples(record, "## "),
        list(plot),
        ["## Evaluate it", "", *_evaluation(label)],
        ["## Derivation", "", *_rests(label, records), *report.steps(record, 3)],
        ["## Used by", "", *_used(label, records)],
    ]
    return "\n".join(line for part in parts for line in part)


def heading(title: str) -> str:
    """A title as plain text, which the sidebar and the browser's tab show as well."""
    for ascii_, sign in _SIGNS.items():
        title = re.sub(rf"(?<!\w){re.escape(ascii_)}(?!\w)", sign, title)
        title = title.replace(ascii_, sign) if ascii_ == "^2" else title
    title = re.sub(r"(?<=\s)-(?=\s|\w)", "−", title)
    return report.plain(numbered(title, "equation "))


def place(label: str) -> str:
    """A label, and the number of its equation in the paper, or that the paper has it not."""
    number = f", equation ({NUMBERS[label]}) of [the paper]({_ARXIV})" if label in NUMBERS else ""
    beyond = f", not in [the paper]({_ARXIV})" if label in BEYOND else ""
    return f"`{label}`{number}{beyond}"


def _link(label: str, text: str = "") -> str:
    return f"[{text or heading(entries()[label].title)}]({slug(label)}.md)"


def _section(label: str) -> str:
    """The first words of the section module's docstring: where in the paper the formula is."""
    place = sections()[entries()[label].module].partition(":")[0]
    return f"It belongs to {place}" if label in BEYOND and place.startswith("Section") else place


def _cite(label: str = "") -> list[str]:
    """BibTeX of the paper and of symasym, folded; of a formula's label with its place in both.

    What the paper has not begins with its own source.
    """
    number = f"Equation ({NUMBERS[label]})" if label in NUMBERS else ""
    paper = [
        "@misc{JeffreySimpson,",
        "  author = {Jeffrey, M. R. and Simpson, D. J. W.},",
        "  title = {Non-{F}ilippov dynamics arising from the smoothing of nonsmooth systems, and",
        "           its robustness to noise},",
        "  eprint = {1310.8328},",
        "  archiveprefix = {arXiv},",
        f"  year = {{2013}}{number and ','}",
        *([f"  note = {{{number}}}"] if number else []),
        "}",
    ]
    software = [
        "@software{symasym,",
        "  author = {{The symasym developers}},",
        "  title = {symasym: escape times and {Laplace}-type integrals of smoothed switches",
        "           with noise},",
        f"  version = {{{VERSION}}},",
        f"  year = {{2026}}{label and ','}",
        *([f"  note = {{Formula {label}}}"] if label else []),
        "}",
    ]
    cited = [*paper, *software]
    if label in BEYOND:
        cited = [*_source(BEYOND[label]), *software, *paper]
    return folded("Cite", ["```bibtex", *cited, "```", ""])


def _source(key: str) -> list[str]:
    """The lines of an entry of docs/paper.bib; none for no key."""
    bibliography = (DOCS / "paper.bib").read_text("utf-8")
    found = re.search(rf"^@\w+{{{key},.*?^}}$", bibliography, re.DOTALL | re.MULTILINE)
    return found[0].splitlines() if key and found else []


def _tools(label: str, record: Mapping[str, Any]) -> list[str]:
    """Permalink, TeX to copy, a BibTeX entry to cite."""
    return [
        "```{raw} html",
        '<div class="formula-tools">',
        '<button type="button" data-permalink="">copy permalink</button>',
        f'<button type="button" data-copy="{escape(record["latex"])}">copy TeX</button>',
        "</div>",
        "```",
        "",
        *_cite(label),
    ]


def folded(summary: str, lines: Iterable[str]) -> list[str]:
    """Lines that are shown when their summary is chosen."""
    return [f"<details><summary>{summary}</summary>", "", *lines, "</details>", ""]


@cache
def sections() -> dict[str, str]:
    """Module of derivations -> the sentence that says what it holds."""
    found = {}
    for name in {entry.module for entry in entries().values()}:
        text = inspect.getdoc(importlib.import_module(name)) or ""
        found[name] = " ".join(text.partition("\n\n")[0].split()).rstrip(".")
    return found


def _symbols(label: str, record: Mapping[str, Any]) -> list[str]:
    conditions = [h["statement"] for h in record["hypotheses"] if h["status"] != "fails"]
    said = " ".join(map(report.words, (record["note"], record["error"], *conditions)))
    shown = " ".join([record["latex"], *re.findall(r"\$([^$]*)\$", said)])
    own = IN_WORDS.get(label, {})
    beside = {sign: MEANINGS[name] for sign, name in _BESIDE.items() if _found(sign, shown)}
    meant = {**beside, **own, **{s.latex: s.meaning for s in _explained(label, shown)}}
    # In the order of the formula and of the words below it.
    order = sorted(
        meant, key=lambda sign: at.start() if (at := _found(sign, shown)) else len(shown)
    )
    rows = [
        f"| ${sign}$ | {report.words(meant[sign].text)} | {report.words(meant[sign].scale)} |"
        for sign in order
    ]
    if r"\mathbf{1}" in record["latex"]:
        rows.append(_INDICATOR)
    return ["| symbol | meaning | measured in |", "|---|---|---|", *rows, ""]


def _explained(label: str, shown: str) -> list[Listed]:
    """The symbols of a formula that stand in its equation as it is written, in their order."""
    here = {s: at for s in symbols(label) if (at := _found(s.latex, shown)) and s.meaning.text}
    return sorted(here, key=lambda s: here[s].start())


def _found(sign: str, shown: str) -> re.Match[str] | None:
    """Where a symbol in TeX stands in a text, and not as the head of an indexed one."""
    whole = rf"{re.escape(sign)}(?![A-Za-z_])" if sign[-1].isalpha() else re.escape(sign)
    before = r"(?<![\\A-Za-z])" if sign[0].isalpha() else ""
    return re.search(f"{before}{whole}", shown)


def _errata(label: str) -> list[str]:
    """Boxes of the errata about a formula, folded where there are several."""
    boxes: list[list[str]] = []
    for number, slip in enumerate(ERRATA, 1):
        if label == slip.label or (label == slip.derivation and slip.counterexample is not None):
            place, printed, right = (
                numbered(text, "equation ") for text in (slip.place, slip.printed, slip.right)
            )
            box = [
                f":::{{admonition}} Erratum ({slip.kind}): {place}",
                f"Printed: {printed}.",
                "",
                f"Correct: {right}.",
                "",
                # In HTML: what it leads to is no heading, which a link in Markdown looks for.
                f'<a href="../errata.html#erratum-{number}">Number {number} of the errata</a>.',
                ":::",
                "",
            ]
            boxes.append(box)
    lines = [line for box in boxes for line in box]
    return folded(f"{len(boxes)} errata", lines) if boxes[1:] else lines


def _evaluation(label: str) -> list[str]:
    lines: list[str] = []
    session = calls.session(label)
    if session:
        lines += ["```pycon", session, "```", ""]
    else:
        lines += ["No function of symasym evaluates this formula alone.", ""]
    found = formula(label)
    if found.functions:
        names = ", ".join(f"`{name}`" for name in found.functions)
        lines += [f"In `symasym.generated.numpy_formulas` and `mpmath_formulas`: {names}.", ""]
    return lines + _emitted(found)


def _emitted(found: Formula) -> list[str]:
    """One fold with the code for each target, or why there is none."""
    if not found.expression.free_symbols:
        return []
    lines: list[str] = []
    names = []
    refused = ""
    for target, language in TARGETS.items():
        drift = ""
        try:
            code = found.emit(target)
        except InputError as error:
            refused = refused or str(error)
            try:
                code, drift = emit(found, target, drift=friction()), ", with the friction drift"
            except InputError:
                continue
        names.append(NAMES[target])
        title = f"**{NAMES[target]}**{drift}"
        lines += [title, "", "{.no-search}", f"```{language}", code.rstrip(), "```", ""]
    if not lines:
        return [f"No code is emitted: {report.words(refused)}", ""]
    return folded(f"As code: {', '.join(names)}", lines)


def nothing_of(why: str) -> list[str]:
    """What a page says that has no plot."""
    return ["## Plot", "", f"Nothing to plot: {report.words(why)}.", ""]


def about(plot: Plot | Picture) -> list[str]:
    """A page's lines with its plot."""
    if isinstance(plot, Picture):
        title, seen = "What it defines", plot.what
    else:
        title = "Against the exact value"
        seen = (
            f"the formula {plot.label} and the exact value, and below them the error of the formula"
        )
        if plot.agrees():
            title = "Computed in two ways"
            seen = f"{plot.label} by its formula and in another way, which agree to rounding"
    lines = [f"## {title}", "", f"![{seen}]({slug(plot.label)}.svg)", ""]
    if isinstance(plot, Picture):
        lines += [f"{report.plain(seen[:1].upper() + seen[1:])}.", ""]
    return lines


def _rests(label: str, records: Records) -> list[str]:
    below = records[label]["rests_on"]
    return [f"Starts from: {'; '.join(map(_link, below)) or 'definitions only'}.", ""]


def _used(label: str, records: Records) -> list[str]:
    above = [other for other, record in records.items() if label in record["rests_on"]]
    lines = [f"{'; '.join(map(_link, above)) or 'No other formula'}.", ""]
    if above or records[label]["rests_on"]:
        # In HTML: the graph's nodes are no headings, which a link in Markdown would look for.
        lines += [
            f'<a href="graph.html#focus-{slug(label)}">The graph about this formula</a> shows all '
            "that it rests on and all that rests on it.",
            "",
        ]
    return lines


def _rows(labels: Iterable[str], records: Records) -> list[str]:
    """Each formula under its title, with its error and the symbols that are its own."""
    lines: list[str] = []
    for label in labels:
        record = records[label]
        lines += [
            f"**{_link(label)}**, {_named(label)}; error: {report.words(record['error'])}.",
            "",
            *report.display(record["latex"]),
            *_own(label, record["latex"]),
        ]
    return lines


#: Symbols of the problem, which need no explanation beside every formula.
_COMMON = frozenset(
    """
    u v y z t a phi A V T C P r kappa lam epsilon kappa_phys r_phys a_minus a_plus u1 u2 mu alpha
    z0
    """.split()  # noqa: SIM905
)


def _own(label: str, shown: str) -> list[str]:
    """A line that explains the symbols of a formula that are not the problem's."""
    local = LOCAL.get(label, {})
    own = [
        f"${s.latex}$: {report.words(s.meaning.text)}"
        for s in _explained(label, shown)
        if s.name in local or not (s.left or s.name in _COMMON)
    ]
    return [f"where {'; '.join(own)}.", ""] if own else []


def _named(label: str) -> str:
    """A label, and the number of its equation in the paper if it has one."""
    return f"`{label}` ({NUMBERS[label]})" if label in NUMBERS else f"`{label}`"


def _of_module(records: Records, module: str) -> list[str]:
    known = entries()
    return [label for label in records if known[label].module == module]


def _modules(number: str) -> list[tuple[str, str, str]]:
    """Section modules of a section, in the paper's order: module, its place, what is derived."""
    chosen = [
        (module, *title.partition(": ")[::2])
        for module, title in sections().items()
        if report.section(module) == number
    ]
    first: dict[str, int] = {}
    for label, entry in entries().items():
        if label in NUMBERS:
            first[entry.module] = min(first.get(entry.module, NUMBERS[label]), NUMBERS[label])
    # What the paper has no equation of comes last.
    return sorted(chosen, key=lambda item: (first.get(item[0], len(NUMBERS) * 2), item[1]))


def section(number: str, records: Records) -> str:
    """The formulas of one section of the paper."""
    lines = [f"# {report.SECTIONS[number]}", ""]
    chosen = []
    for module, place, what in _modules(number):
        labels = _of_module(records, module)
        chosen += labels
        lines += [f"## {heading(what[:1].upper() + what[1:])}", "", f"{place}.", ""]
        lines += _rows(labels, records)
    return "\n".join([*lines, *_toctree(map(slug, chosen))])


def _toctree(names: Iterable[str]) -> list[str]:
    return ["```{toctree}", ":hidden:", "", *names, "```", ""]


def index(records: Records) -> str:
    """The sections with the titles of their formulas, and the definitions."""
    listed = []
    for number, title in report.SECTIONS.items():
        name = title.partition(":")[0]
        listed += [f"## {title}", "", f"[{name} with its formulas](section-{number}.md).", ""]
        for module, place, what in _modules(number):
            titles = [f"{_link(label)}, {_named(label)}" for label in _of_module(records, module)]
            listed += [f"{place}, {heading(what)}:", "", *(f"- {title}" for title in titles), ""]
    steps = sum(len(record["steps"]) for record in records.values())
    return "\n".join(
        [
            "# Formulas",
            "",
            f"{len(records)} results, derived in {steps} checked steps, by section of the paper; "
            "[by quantity](quantities.md), and as [a graph](graph.md) of which rests on which. "
            "[All of them in one file](formulas.json), for programs: label, TeX, SymPy expression, "
            "assumptions, error, number of checks of each kind. After a title stand its label "
            "and, in brackets, the number of its equation in the paper, counted through from the "
            "first (the paper's source begins anew in each section).",
            "",
            *_cite(),
            *listed,
            "## Definitions, with nothing to derive",
            "",
            *report.definitions(),
            *_toctree(["quantities", "graph", *(f"section-{n}" for n in report.SECTIONS)]),
        ]
    )


def by_quantity(records: Records) -> str:
    """The formulas by the quantity on their left side."""
    lines = [
        "# Formulas by quantity",
        "",
        "Each formula under the quantity on its left side, with its label, the number of its "
        "equation in the paper where it has one, and its error. "
        "[By section of the paper](index.md) they are listed by title.",
        "",
    ]
    for quantity in QUANTITIES:
        chosen = [label for label in records if quantity in quantities(label)]
        lines += [f"## {quantity}", "", *_rows(chosen, records)]
    return "\n".join(lines)


def graph_page(records: Records) -> str:
    """The graph of which formula rests on which, as a drawing and as a list."""
    used = {below for record in records.values() for below in record["rests_on"]}
    chosen = [
        f'<option value="{slug(label)}">{escape(heading(record["title"]))}</option>'
        for label, record in sorted(records.items(), key=lambda item: item[1]["title"])
        if record["rests_on"] or label in used
    ]
    lines = [
        "---",
        "hide-toc: true",
        "---",
        "# Which formula rests on which",
        "",
        "An arrow leads down from a result to one that uses it. A box that no arrow enters rests "
        "on definitions only. Each label leads to the page of its formula.",
        "",
        "```{raw} html",
        '<p><label>Only what one formula rests on, and what rests on it: <select id="graph-focus">'
        '<option value="">all formulas</option>',
        *chosen,
        "</select></label></p>",
        '<p id="graph-title" role="status">Point at a label to read its title.</p>',
        '<p id="graph-hint" hidden>Scroll ↔</p>',
        graph.svg(
            {label: record["rests_on"] for label, record in records.items()},
            {label: heading(record["title"]) for label, record in records.items()},
        ),
        "```",
        "",
        "## As a list",
        "",
    ]
    for label, record in records.items():
        if record["rests_on"]:
            lines.append(f"- {_link(label)} rests on: {'; '.join(map(_link, record['rests_on']))}.")
    return "\n".join([*lines, ""])
