"""A page for each formula, made from the record of its derivation, and the indexes of all."""

from __future__ import annotations

import importlib
import inspect
from collections.abc import Callable, Iterable, Mapping
from functools import cache
from typing import Any

from derivations import report
from derivations.errata import ERRATA
from derivations.registry import entries
from derivations.runner import slug
from derivations.symbols import QUANTITIES, quantities, symbols
from symasym import friction
from symasym.base.errors import InputError
from symasym.emit import emit
from symasym.formula import Formula, formula
from website import calls, graph
from website.plots import Picture, Plot

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


def pages(
    records: Records, plots: Iterable[Plot | Picture], nothing: Mapping[str, str]
) -> dict[str, str]:
    """File name -> Markdown: a page for each record and the indexes.

    `nothing` says of labels without a plot why they have none.
    """
    drawn = {plot.label: about(plot) for plot in plots}
    drawn |= {label: nothing_of(why) for label, why in nothing.items()}
    made = {f"formulas/{slug(label)}.md": page(label, records, drawn[label]) for label in records}
    return {
        **made,
        "formulas/index.md": index(records),
        "formulas/quantities.md": by_quantity(records),
        "formulas/graph.md": graph_page(records),
    }


def page(label: str, records: Records, plot: Iterable[str] = ()) -> str:
    """The page of one formula; `plot` are the lines about its plot."""
    record = records[label]
    parts = [
        [f"# {label}", "", f"{report.plain(record['title'])}. {_section(label)}.", ""],
        report.statement(record),
        _errata(label),
        ["## Symbols", "", *_symbols(label)],
        ["## Assumptions", "", *report.ledger(record)] if record["hypotheses"] else [],
        ["## Evaluate it", "", *_evaluation(label)],
        list(plot),
        ["## What it rests on, and what rests on it", "", *_neighbours(label, records)],
        ["## Derivation", "", *report.steps(record, 3)],
    ]
    return "\n".join(line for part in parts for line in part)


def _link(label: str, text: str = "") -> str:
    return f"[{text or label}]({slug(label)}.md)"


def _section(label: str) -> str:
    """The first words of the section module's docstring: where in the paper the formula is."""
    return sections()[entries()[label].module].partition(":")[0]


@cache
def sections() -> dict[str, str]:
    """Module of derivations -> the sentence that says what it holds."""
    found = {}
    for name in {entry.module for entry in entries().values()}:
        text = inspect.getdoc(importlib.import_module(name)) or ""
        found[name] = " ".join(text.partition("\n\n")[0].split()).rstrip(".")
    return found


def _symbols(label: str) -> list[str]:
    rows = [
        f"| ${s.latex}$ | {report.plain(s.meaning.text)} | {report.plain(s.meaning.scale)} |"
        for s in symbols(label)
    ]
    return ["| symbol | meaning | measured in |", "|---|---|---|", *rows, ""]


def _errata(label: str) -> list[str]:
    lines = [
        f"- {slip.place} ({slip.kind}). Printed: {slip.printed}. Right: {slip.right}. "
        f"Number {place} of the [errata](../errata.md)."
        for place, slip in enumerate(ERRATA, 1)
        if label == slip.label or (label == slip.derivation and slip.counterexample is not None)
    ]
    return [":::{admonition} Where the print differs", *lines, ":::", ""] if lines else []


def _evaluation(label: str) -> list[str]:
    lines: list[str] = []
    session = calls.session(label)
    if session:
        lines += ["```pycon", session, "```", ""]
    else:
        lines += ["No verb of symasym is for this formula alone.", ""]
    found = formula(label)
    if found.functions:
        names = ", ".join(f"`{name}`" for name in found.functions)
        lines += [f"In `symasym.generated.numpy_formulas` and `mpmath_formulas`: {names}.", ""]
    return lines + _emitted(found)


def _emitted(found: Formula) -> list[str]:
    """The code for each target, with friction where a drift is asked for, or why there is none."""
    lines: list[str] = []
    refused = ""
    for target, language in TARGETS.items():
        drift = ""
        try:
            code = found.emit(target)
        except InputError as error:
            refused = refused or str(error)
            try:
                code, drift = emit(found, target, drift=friction()), ", friction in it"
            except InputError:
                continue
        lines += [
            f"<details><summary>As code for {target}{drift}</summary>",
            "",
            f"```{language}",
            code.rstrip(),
            "```",
            "",
            "</details>",
            "",
        ]
    return lines or [f"No code is emitted: {report.plain(refused)}", ""]


def nothing_of(why: str) -> list[str]:
    """What a page says that has no plot."""
    return ["## Plot", "", f"Nothing to plot: {report.plain(why)}.", ""]


def about(plot: Plot | Picture) -> list[str]:
    """A page's lines with its plot."""
    if isinstance(plot, Picture):
        title, seen = "What it defines", plot.what
    else:
        title = "Against the exact value"
        seen = (
            f"the formula {plot.label} and the exact value, and below them the error of the formula"
        )
    lines = [f"## {title}", "", f"![{seen}]({slug(plot.label)}.svg)", ""]
    if isinstance(plot, Picture):
        lines += [f"{report.plain(seen[:1].upper() + seen[1:])}.", ""]
    return lines


def _neighbours(label: str, records: Records) -> list[str]:
    below = records[label]["rests_on"]
    above = [other for other, record in records.items() if label in record["rests_on"]]
    return [
        f"Rests on: {', '.join(map(_link, below)) or 'definitions only'}.",
        "",
        f"Rests on it: {', '.join(map(_link, above)) or 'nothing here'}.",
        "",
        "All of them: [the graph](graph.md).",
        "",
    ]


def _rows(labels: Iterable[str], records: Records) -> list[str]:
    return [
        "| formula | what | error |",
        "|---|---|---|",
        *(
            f"| {_link(label)} | {report.plain(records[label]['title'])} "
            f"| {report.plain(records[label]['error'])} |"
            for label in labels
        ),
        "",
    ]


def _grouped(groups: Iterable[tuple[str, Callable[[str], bool]]], records: Records) -> list[str]:
    lines: list[str] = []
    for title, belongs in groups:
        chosen = [label for label in records if belongs(label)]
        if chosen:
            name, _, what = title.partition(": ")
            says = [f"{what[:1].upper()}{what[1:]}.", ""] if what else []
            lines += [f"## {report.plain(name)}", "", *says, *_rows(chosen, records)]
    return lines


def index(records: Records) -> str:
    """The formulas by section of the paper."""
    known = entries()
    groups = [
        (title, lambda label, module=module: known[label].module == module)
        for module, title in sorted(sections().items(), key=lambda item: (item[1] + "~", item[0]))
    ]
    steps = sum(len(record["steps"]) for record in records.values())
    return "\n".join(
        [
            "# Formulas",
            "",
            f"{len(records)} results in {steps} steps, made from the derivations when this site "
            "was built, after every check had passed. They are listed here by section of the "
            "paper; also [by quantity](quantities.md), and as [a graph](graph.md) of which "
            "rests on which.",
            "",
            *_grouped(groups, records),
            "## Definitions, with nothing to derive",
            "",
            *report.definitions(),
            "```{toctree}",
            ":hidden:",
            "",
            "quantities",
            "graph",
            *map(slug, records),
            "```",
            "",
        ]
    )


def by_quantity(records: Records) -> str:
    """The formulas by the quantity on their left side."""
    groups = [(q, lambda label, q=q: q in quantities(label)) for q in QUANTITIES]
    return "\n".join(["# Formulas by quantity", "", *_grouped(groups, records)])


def graph_page(records: Records) -> str:
    """The graph of which formula rests on which, as a drawing and as a list."""
    lines = [
        "# Which formula rests on which",
        "",
        "An arrow leads from a result to one that uses it. Results that rest on definitions only "
        "are on the left. Each name leads to its page.",
        "",
        "```{raw} html",
        graph.svg({label: record["rests_on"] for label, record in records.items()}),
        "```",
        "",
        "## As a list",
        "",
    ]
    for label, record in records.items():
        if record["rests_on"]:
            lines.append(f"- {_link(label)} rests on {', '.join(map(_link, record['rests_on']))}")
    return "\n".join([*lines, ""])
