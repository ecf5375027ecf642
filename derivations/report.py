"""The pages: Markdown and LaTeX of a record, and the trace of all."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from derivations.labels import DEFINITIONS, NUMBERS, REASONS
from derivations.prose import prose
from derivations.runner import SCHEMA, slug
from symasym.base.files import versions, write_bytes, write_json


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
    lines = [f"$$ {record['latex']} $$", "", f"**Error**: {words(record['error'])}.", ""]
    if record["note"]:
        lines += [f"**Here** {words(record['note'])}.", ""]
    return lines


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
    """Lines of Markdown: weaker conditions that are not enough, each with what shows it."""
    lines = [
        f"- Not enough: {words(h['statement'])}; false for {words(h['where'])}"
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
        explained.add(step["how"])
        found = _sentence(step["detail"])
        lines += [f"$$ {step['latex']} $$", "", f"Check ({step['kind']}): {how}{found}.", ""]
    return lines


def _sentence(text: str) -> str:
    """Words with formulas, the first of them with a capital letter."""
    shown = words(text)
    return shown[:1].upper() + shown[1:]


def words(text: str) -> str:
    """Plain text for Markdown, its formulas as TeX, labels as links to their pages."""
    return prose(text, _linked)


def _linked(text: str) -> str:
    """Plain text for Markdown, where the paper's labels are equation numbers that lead to pages."""

    def number(found: re.Match[str]) -> str:
        label = found[0]
        if label not in NUMBERS:
            return label
        shown = f"equation ({NUMBERS[label]})"
        return shown if label in REASONS else f"[{shown}]({slug(label)}.md)"

    return re.sub(r"\beq:\w+", number, plain(text))


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
        "versions": versions("sympy", "mpmath", "gmpy2", "numpy"),
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
