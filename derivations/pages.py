"""The pages of a label, in Markdown and LaTeX, and the trace of all, from the derivations alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import derivations.sections  # noqa: F401
from derivations.labels import DEFINITIONS, NUMBERS
from symasym.base.errors import AccuracyError
from symasym.base.files import versions, write_bytes, write_json
from symasym.derivation.derivation import LABELS, Derivation, build

SCHEMA = "symasym-derivation/2"
#: Formulas with more signs stand on lines of their own.
_LONG = 110


def slug(label: str) -> str:
    """A file name for a label."""
    return label.replace(":", "-")


def with_roots(labels: Iterable[str]) -> list[str]:
    """These labels and all they rest on, each after what it rests on."""
    found: dict[str, None] = {}

    def visit(label: str) -> None:
        for other in build(label).rests_on:
            visit(other)
        found[label] = None

    for label in labels:
        visit(label)
    return list(found)


def words(text: str) -> str:
    """A sentence for Markdown, its labels as links to their pages, by the paper's numbers."""

    def link(found: re.Match[str]) -> str:
        label = found[0].strip("'`")
        number = f"equation ({NUMBERS[label]})" if label in NUMBERS else f"`{label}`"
        if label in DEFINITIONS:
            return number
        return f"[{number}]({slug(label)}.md)" if label in LABELS else found[0]

    label = r"\beq:\w+|\bfr[12]\b|'[\w-]+'"
    pieces = re.split(r"(\$[^$]*\$)", text)
    return "".join(p if p.startswith("$") else re.sub(label, link, p) for p in pieces)


def display(latex: str) -> list[str]:
    """Lines of Markdown: a formula, or several, each on a line of its own where they are long."""
    rows = latex.split(r" ,\quad ") if len(latex) > _LONG else [latex]
    return [line for row in rows for line in (f"$$ {row} $$", "")]


def statement(d: Derivation, mark: str) -> list[str]:
    """Lines of Markdown: the formula, what it leaves out, its symbols, its conditions."""
    lines = [*display(d.latex()), f"**Error**: {words(d.leaves_out())}.", ""]
    if d.note:
        lines += [f"**Here** {words(d.note)}.", ""]
    held = [
        f"- {words(text)}{' (checked)' * bool(check)}"
        for text, check, fails in d.supposed
        if not fails
    ]
    false = [
        f"- It is false that {words(text)}: {words(fails)}."
        for text, _, fails in d.supposed
        if fails
    ]
    for title, rows in (("Conditions", held), ("Counterexamples", false)):
        lines += [f"{mark} {title}", "", *rows, ""] if rows else []
    return lines


def steps(d: Derivation, mark: str) -> list[str]:
    """Lines of Markdown: each step under a heading."""
    lines = []
    for number, s in enumerate(d.steps, 1):
        why = f"{words(s.why)[:1].upper()}{words(s.why)[1:]}. " if s.why else ""
        lines += [f"{mark} {number}. {words(s.name)}", "", *display(s.latex())]
        lines += [f"{why}Checked {s.check_kind}.", ""]
    return lines


def markdown(label: str) -> str:
    """The page of a label."""
    d = build(label)
    on = ", ".join(f"[{other}]({slug(other)}.md)" for other in d.rests_on)
    lines = [f"# {label}: {d.title}", "", *statement(d, "##")]
    lines += [f"Rests on {on}.", ""] if on else []
    return "\n".join([*lines, *steps(d, "##")])


def escaped(text: str) -> str:
    """A sentence for LaTeX, its formulas as they are."""
    pieces = re.split(r"(\$[^$]*\$)", text)
    special = r"([&%#_{}])"
    return "".join(
        p if p.startswith("$") else re.sub(special, r"\\\1", p).replace("^", r"\^{}")
        for p in pieces
    )


def latex(label: str) -> str:
    r"""A snippet to ``\input``; it needs amsmath."""
    d = build(label)
    lines = [
        rf"\paragraph{{{escaped(d.title)} ({escaped(label)}).}}",
        rf"\[ {d.latex()} \]",
        f"Error: {escaped(d.leaves_out())}." + (f" Here {escaped(d.note)}." if d.note else ""),
    ]
    for text, _, fails in d.supposed:
        kind = (
            f"It is false that {escaped(text)}: {escaped(fails)}"
            if fails
            else f"Supposed: {escaped(text)}"
        )
        lines.append(rf"\par {kind}.")
    rows = [
        rf"\item {escaped(s.name)}{': ' * bool(s.why)}{escaped(s.why)} \[ {s.latex()} \]"
        for s in d.steps
    ]
    return "\n".join([*lines, r"\begin{enumerate}", *rows, r"\end{enumerate}", ""])


def document() -> str:
    """A LaTeX document of all formulas."""
    body = []
    for label in LABELS:
        d = build(label)
        about = f"{escaped(d.leaves_out())}. {escaped(d.note)}"
        body.append(rf"\paragraph{{{escaped(d.title)}}} \texttt{{{escaped(label)}}}, {about}")
        body += [rf"\[ {row} \]" for row in d.latex().split(r" ,\quad ")]
    head = r"\documentclass[a4paper]{article}" "\n" r"\usepackage{amsmath,amssymb,geometry}"
    return "\n".join([head, r"\begin{document}", *body, r"\end{document}", ""])


def record(label: str) -> dict[str, Any]:
    """A derivation as data."""
    d = build(label)
    return {
        "label": label,
        "title": d.title,
        "latex": d.latex(),
        "error": d.leaves_out(),
        "note": d.note,
        "rests_on": d.rests_on,
        "supposed": [{"statement": text, "fails": fails} for text, _, fails in d.supposed],
        "steps": [
            {"name": s.name, "why": s.why, "latex": s.latex(), "check": s.check_kind}
            for s in d.steps
        ],
    }


def names(labels: Iterable[str]) -> list[str]:
    """The files that `derive` writes for these labels."""
    return [
        *(f"{slug(label)}.{kind}" for label in labels for kind in ("md", "tex")),
        "index.md",
        "trace.json",
    ]


def derive(labels: Iterable[str], folder: Path, step: Callable[[], object]) -> None:
    """Check derivations and write their pages, an index, and ``trace.json``.

    Raises
    ------
    AccuracyError
        At the first step that does not hold.
    """
    rows = ["# Derivations", "", "| label | what | steps | error |", "|---|---|---|---|"]
    traced = []
    for label in labels:
        d = build(label)
        if wrong := d.verify():
            raise AccuracyError(
                f"{label}: {wrong[0]!r} does not hold; correct the step or what it rests on."
            )
        write_bytes(folder / f"{slug(label)}.md", markdown(label).encode())
        write_bytes(folder / f"{slug(label)}.tex", latex(label).encode())
        rows.append(
            f"| [{label}]({slug(label)}.md) | {d.title} | {len(d.steps)} | {d.leaves_out()} |"
        )
        traced.append(record(label))
        step()
    for label, (shown, text) in DEFINITIONS.items():
        rows += ["", f"**{label}** defines {words(text)}.", "", f"$$ {shown} $$"]
    write_bytes(folder / "index.md", "\n".join([*rows, ""]).encode())
    write_json(
        folder / "trace.json",
        {"schema": SCHEMA, "versions": versions("sympy", "mpmath"), "derivations": traced},
    )
