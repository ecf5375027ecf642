"""Derivations checked and written: pages in Markdown and LaTeX, index, trace, and the sheet."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from html import escape
from pathlib import Path
from typing import Any

from derivations.labels import DEFINITIONS, NUMBERS, REASONS
from derivations.prose import prose
from derivations.registry import closure, entries, entry
from derivations.runner import SCHEMA, known, run, slug
from symasym.base.errors import InputError
from symasym.base.files import versions, write_bytes, write_json
from symasym.base.inputs import meant
from symasym.base.progress import stage
from symasym.records import Record


def markdown(record: dict[str, Any]) -> str:
    """The page of one label."""
    lines = [
        f"# {record['label']}: {words(record['title'])}",
        "",
        *statement(record),
    ]
    if record["rests_on"]:
        links = ", ".join(f"[{on}]({slug(on)}.md)" for on in record["rests_on"])
        lines += [f"Rests on {links}.", ""]
    lines += [*conditions(record, "## "), *counterexamples(record, "## "), *steps(record, 2)]
    return "\n".join(lines)


def statement(record: dict[str, Any]) -> list[str]:
    """Lines of Markdown: the formula, its error, what its own symbols are."""
    lines = [*display(record["latex"]), f"**Error**: {words(record['error'])}.", ""]
    if record["note"]:
        lines += [f"**Here** {words(record['note'])}.", ""]
    return lines


def display(latex: str) -> list[str]:
    """Lines of Markdown: a formula; several in a row that are long, each on a line of its own."""
    signs = re.sub(r"\\[a-zA-Z]+|[{}^_ ]", lambda m: "x" if m[0][0] == "\\" else "", latex)
    rows = latex.split(r" ,\quad ") if len(signs) > _ROW else [latex]
    return [line for row in rows for line in (f"$$ {row} $$", "")]


def conditions(record: dict[str, Any], mark: str) -> list[str]:
    """Lines of Markdown: what the formula supposes, if anything, under a heading."""
    lines = []
    for h in record["hypotheses"]:
        if h["status"] != "fails":
            shown = f" (checked: {words(h['where'])})" if h["status"] == "checked" else ""
            shown = shown or (f" ({words(h['where'])})" if h["where"] else "")
            lines.append(f"- {_sentence(h['statement'])}{shown}")
    return [f"{mark}Conditions", "", *lines, ""] if lines else []


def counterexamples(record: dict[str, Any], mark: str) -> list[str]:
    """Lines of Markdown: weaker statements that are false, each with what shows it."""
    lines = [
        f"- It is false that {words(h['statement'])}: {words(h['where'])}"
        for h in record["hypotheses"]
        if h["status"] == "fails"
    ]
    return [f"{mark}Counterexamples", "", *lines, ""] if lines else []


def steps(record: dict[str, Any], level: int) -> list[str]:
    """Lines of Markdown: each step under a heading of this level, a check explained once."""
    lines, explained = [], set[str]()
    for number, step in enumerate(record["steps"], 1):
        lines += [f"{'#' * level} {number}. {_sentence(step['name'])} ({step['rule']})", ""]
        if step["reason"]:
            lines += [f"Why: {words(step['reason'])}.", ""]
        how = "" if step["how"] in explained else f"{words(step['how'])}. "
        detail = step["detail"].replace(" (as it stands)", "")
        checked = f"Check ({step['kind']}): {how}{_sentence(detail)}."
        holds = re.fullmatch(r"holds exactly: ([^;]+)", step["detail"])
        if holds and step["kind"] == "symbolic identity":
            way = escape(step["how"])
            checked = (
                f'<span title="{way}">Checked symbolically</span>, exactly: {words(holds[1])}.'
            )
        elif re.fullmatch(r"(difference is exactly 0 \([^()]*\)(; )?)+", step["detail"]):
            # How it was checked is shown when the words are pointed at.
            way = escape(f"{step['how']}: {step['detail']}")
            sides = "the leading parts" if "leading part" in step["how"] else "both sides"
            checked = f'<span title="{way}">Checked symbolically</span>: {sides} agree.'
        else:
            explained.add(step["how"])
        lines += [*display(step["latex"]), checked, ""]
    return lines


def _sentence(text: str) -> str:
    """Words with formulas, the first of them with a capital letter."""
    shown = words(text)
    return shown[:1].upper() + shown[1:]


def words(text: str) -> str:
    """Plain text for Markdown, its formulas as TeX, labels as links to their pages."""
    return prose(text, _linked)


def _linked(text: str) -> str:
    """Plain text for Markdown; labels lead to pages, those of the paper by their numbers."""

    def link(found: re.Match[str]) -> str:
        label = found[0].strip("'")
        if label in REASONS:
            return f"equation ({NUMBERS[label]})"
        if label not in entries():
            return found[0]
        numbered = label.startswith(("eq:", "fr"))
        shown = f"equation ({NUMBERS[label]})" if numbered else f"`{label}`"
        return f"[{shown}]({slug(label)}.md)"

    return re.sub(r"\beq:\w+|\bfr[12]\b|'[\w-]+'|\b[A-Za-z]+(?:-[A-Za-z]+)+\b", link, plain(text))


def plain(text: str) -> str:
    """Plain text for Markdown, where its stars, bars and brackets would mean something."""
    return re.sub(r"([\\`*_|<>\[\]$])", r"\\\1", text)


_SPECIAL = {
    "\\": r"\textbackslash{}",
    "^": r"\textasciicircum{}",
    "~": r"\textasciitilde{}",
    "<": r"$<$",
    ">": r"$>$",
    "|": r"$|$",
    "–": "--",
    "±": r"$\pm$",
}


def tex_text(text: str) -> str:
    """Plain text for LaTeX."""
    return "".join(_SPECIAL.get(c) or (f"\\{c}" if c in "#$%&_{}" else c) for c in text)


def tex(text: str) -> str:
    """Plain text for LaTeX, its formulas set as such."""
    return prose(text, tex_text)


def latex(record: dict[str, Any]) -> str:
    r"""A snippet to ``\input``: needs amsmath and nothing else."""
    lines = [
        f"% {record['label']}, written by symasym; \\input this file.",
        f"\\paragraph{{{tex(record['title'])} ({tex_text(record['label'])}).}}",
        f"\\[ {record['latex']} \\]",
        f"Error: {tex(record['error'])}.",
    ]
    if record["note"]:
        lines.append(f"Here {tex(record['note'])}.")
    for h in record["hypotheses"]:
        where = f" ({tex(h['where'])})" if h["where"] else ""
        lines.append(f"\\par Hypothesis, {h['status']}: {tex(h['statement'])}{where}.")
    lines.append("\\begin{enumerate}")
    for step in record["steps"]:
        reason = f": {tex(step['reason'])}" if step["reason"] else ""
        lines += [
            f"\\item {tex(step['name'])} ({step['rule']}{reason})",
            f"\\[ {step['latex']} \\]",
            f"{tex_text(step['kind'])}: {tex(step['detail'])}.",
        ]
    return "\n".join([*lines, "\\end{enumerate}", ""])


def names(labels: Iterable[str]) -> list[str]:
    """The files that `write` makes for these labels."""
    pages = [f"{slug(label)}.{kind}" for label in labels for kind in ("md", "tex")]
    return [*pages, "index.md", "trace.json"]


def write(records: dict[str, dict[str, Any]], folder: Path) -> list[Path]:
    """Write a page and a snippet per label, an index, and ``trace.json``; unchanged files stay."""
    written = []
    files = {}
    for label, record in records.items():
        files[f"{slug(label)}.md"] = markdown(record)
        files[f"{slug(label)}.tex"] = latex(record)
    files["index.md"] = _index(records)
    for name, content in files.items():
        path, data = folder / name, content.encode()
        if not path.is_file() or path.read_bytes() != data:
            write_bytes(path, data)
        written.append(path)
    write_json(folder / "trace.json", trace(records))
    return [*written, folder / "trace.json"]


def trace(records: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Every step with its rule, check, result and time, under a versioned schema."""
    return {
        "schema": SCHEMA,
        "versions": versions("sympy", "mpmath", "numpy"),
        "derivations": list(records.values()),
        "definitions": REASONS,
    }


def definitions() -> list[str]:
    """Lines of Markdown: each definition with its formula."""
    return [
        line
        for label, defined in DEFINITIONS.items()
        for line in (f"**{label}**: {words(defined.reason)}", "", f"$$ {defined.latex} $$", "")
    ]


def _index(records: dict[str, dict[str, Any]]) -> str:
    lines = ["# Derivations", "", "| label | what | steps | error |", "|---|---|---|---|"]
    lines += [
        f"| [{label}]({slug(label)}.md) | {words(r['title'])} | {len(r['steps'])} "
        f"| {words(r['error'])} |"
        for label, r in records.items()
    ]
    lines += ["", "Definitions, with nothing to derive:", ""]
    lines += definitions()
    return "\n".join([*lines, ""])


DEFAULT = Path("build/derivations")


def derive(
    labels: list[str] | None = None,
    out: Path = DEFAULT,
    *,
    fresh: bool = False,
    step: Callable[[], object] | None = None,
) -> dict[str, dict[str, Any]]:
    """Check derivations, write their pages and trace.

    Parameters
    ----------
    labels : list of str, optional
        Which; all if left out or empty. What they rest on is checked as well.
    out : path
        Folder of the Markdown and LaTeX pages, ``trace.json`` and the cache.
    fresh : bool
        Take nothing from the cache.
    step : callable, optional
        Called after every derivation; left out, the progress goes to stderr.

    Returns
    -------
    dict
        Label -> record, as `derivations.runner.run` gives it.

    Raises
    ------
    InputError
        For a label that nothing derives.
    """
    chosen = labels or list(entries())
    for label in chosen:
        if label in REASONS:
            raise InputError(f"{label} is not derived. {REASONS[label]}")
        try:
            entry(label)
        except KeyError:
            near = meant(label, entries()) or "; sa.labels() lists them"
            raise InputError(f"{label} is no label that is derived{near}.") from None
    with nullcontext(step) if step else stage("derivations", len(closure(chosen))) as report:
        records = run(chosen, out / "cache", report, fresh=fresh)
    # A run of a few labels must not shrink the index and the trace of an earlier full one.
    write({**known(out / "cache"), **records}, out)
    return records


#: Sections of the paper, and what is beyond it.
SECTIONS = {
    "2": "Section 2: The systems",
    "3": "Section 3: The results in physical units",
    "4": "Section 4: Reduction to one dimension",
    "5": "Section 5: Stationary density and escape time",
    "6": "Section 6: Strong and weak noise",
    "7": "Section 7: The friction oscillator",
    "8": "Beyond the paper: the whole system",
}

# Symbol, meaning, how the paper writes it.
_SYMBOLS = (
    (r"\varepsilon", "half-width of the layer |y| <= eps, in physical units", r"\varepsilon"),
    ("u,\\ v", "scaled position y/eps", r"\tilde y,\ u,\ v"),
    (r"\kappa", "scaled noise amplitude, the physical one over sqrt(eps)", r"\tilde\kappa"),
    ("r", "scaled escape radius, the physical one over eps", r"\tilde r"),
    (r"\kappa_p,\ r_p", "the same in physical units", r"\kappa,\ r"),
    (r"\lambda", "large parameter of every Laplace-type integral", r"2/\tilde\kappa^2"),
    (r"\phi,\ A", "scaled drift, and its part inside the layer", r"\phi,\ A"),
    ("a^-,\\ a^+", "scaled drift for u <= -1 and u >= 1", "a^-,\\ a^+"),
    ("V", "potential: V' = -phi, V(-1) = 0", "V"),
    ("u_1,\\ u_2", "well and barrier, the zeros of A", r"\tilde y_1,\ \tilde y_2"),
    ("T", "mean time to leave |u| < r from 0, in units of eps", r"\tilde T"),
    ("C", "probability of leaving through -r", "C"),
    ("P", "stationary probability of |u| <= 1", r"\mathbb{P}"),
    ("S", "Stokes multiplier", "S"),
    (r"\mu,\ \alpha,\ z_0", "shape, strength and extension of the friction model", "the same"),
)

_HEAD = r"""% Written by symasym: show --all --latex.
\documentclass[a4paper]{article}
\usepackage[margin=22mm]{geometry}
\usepackage{amsmath,amssymb}
\allowdisplaybreaks
\setlength{\parindent}{0pt}
\postdisplaypenalty=10000
\newcommand{\formula}[3]{\par\pagebreak[0]\medskip
  \textbf{#1}\quad{\small\texttt{#2}\quad#3}\nopagebreak}
\begin{document}
\section*{Formulas of the smoothed switch with noise}
All quantities are scaled by the half-width of the layer unless marked. Labels are those of the
paper, or this project's names for results that have none there. After its label stands how exact
a formula is: what it leaves out, and when.

\medskip
\begin{tabular}{@{}lll@{}}
symbol & meaning & in the paper \\ \hline"""


def sheet() -> str:
    """The LaTeX document; it needs amsmath, amssymb and geometry."""
    lines = [_HEAD]
    for symbol, meaning, printed in _SYMBOLS:
        shown = printed if printed == "the same" else f"${printed}$"
        lines.append(f"${symbol}$ & {tex(meaning)} & {shown} \\\\")
    lines.append("\\end{tabular}")
    before = ""
    for label, own in entries().items():
        number = section(own.module)
        if number != before:
            before = number
            lines += ["", f"\\section*{{{SECTIONS[number]}}}"]
        lines += ["", *_entry(Record.of(label))]
    return "\n".join([*lines, "\\end{document}", ""])


def section(module: str) -> str:
    """The entry of `SECTIONS` that a module of derivations belongs to."""
    return module.removeprefix("derivations.sections.section")[0]


def _entry(found: Record) -> Iterator[str]:
    label = tex_text(found.label)
    yield f"\\formula{{{tex(found.title)}}}{{{label}}}{{{tex(found.error)}}}"
    yield "\\begin{equation}"
    yield f"\\label{{{found.label}}}"
    rows = " \\\\\n".join(_rows(found.latex()))
    yield f"\\begin{{gathered}}\n{rows}\n\\end{{gathered}}" if "\n" in rows else rows
    yield "\\end{equation}"
    if found.note:
        yield f"{{\\small Here {tex(found.note)}.}}"


#: Rows of formulas with more signs stand one below the other.
_ROW = 45
#: Longer ones are broken before their remainder, which is as wide as what stands before it.
_LONG = 150


def _rows(latex: str) -> list[str]:
    """The lines of a formula: one a statement, and a long remainder on its own."""
    parts = latex.split(" ,\\quad ")
    rows = parts if len(latex) > _LONG else [latex]
    broken: list[str] = []
    for row in rows:
        before, remainder, after = row.partition(" + O\\left(")
        if remainder and len(row) > _LONG and len(after) > 40:
            broken += [before, "{}" + remainder + after]
        else:
            broken.append(row)
    return broken
