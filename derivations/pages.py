"""The pages of a label, in Markdown and LaTeX, and the trace of all, from the derivations alone."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from importlib import import_module
from pathlib import Path
from typing import Any

import sympy

import derivations.sections  # noqa: F401
from derivations.labels import DEFINITIONS, NUMBERS
from derivations.paper import MEANINGS
from symasym.base.errors import AccuracyError
from symasym.base.files import versions, write_bytes, write_json
from symasym.derivation.derivation import LABELS, MODULES, Derivation, Step, build
from symasym.derivation.tex import NAMES, tex

SCHEMA = "symasym-derivation/2"
#: Formulas with more signs stand on lines of their own.
_LONG = 110
_FORMULA = r"(\$[^$]*\$)"
#: A letter with its index, in TeX; not that of a set or an operator.
_LETTER = r"(?<!mathbb{)(?<!mathcal{)\\?[A-Za-z]+(?:_(?:\w|\\[a-z]+)|\^[+-])?"
#: What is given; other letters have the signs that follow.
_GIVEN = ("kappa", "kappa_phys", "r", "r_phys", "epsilon", "a", "a_minus", "a_plus", "mu", "alpha")
#: Letters that a page uses in a sense of its own, which its text explains.
_OWN = {
    **dict.fromkeys(("airy-form", "cubic-pair"), {*"DpqRJtym", "J1", "sigma"}),
    "truncated-gaussian": {*"DpqRJtym", "J1", "sigma"},
    **dict.fromkeys(("backward", "canonical-form"), set("LMS")),
    "endpoint-series": {"t", "sigma"},
    **dict.fromkeys(("eq:cont", "eq:phi"), {"F"}),
    "eq:odeR": {"m"},
    **dict.fromkeys(("eq:reducedSDE", "eq:reducedSDEtilde", "eq:scaledSDEx"), {"D", "W"}),
    "eq:scaledSDE": {"a"},
    **dict.fromkeys(("exit-eigenvalue", "exit-moments", "exit-transform"), {"y", "F"}),
    "fold-delay": {"t"},
    **dict.fromkeys(("noise-amplitude", "positive-form"), {"sigma"}),
    "panel-step": {"a", "F", "D", "sigma"},
    "regions": {"N"},
    "eq:S": {"p"},
    "release-order": {"p", "q", "T_1"},
    "release-time": {"p", "q", "M", "v"},
    "saddle-start": {"N", "p", "t"},
}

for module in dict.fromkeys(MODULES.values()):
    import_module(module)


def slug(label: str) -> str:
    """A file name for a label."""
    return label.replace(":", "-")


def with_roots(labels: Iterable[str]) -> list[str]:
    """These labels and all they rest on, each after what it rests on."""
    found: dict[str, None] = {}
    for label in labels:
        found |= dict.fromkeys([*with_roots(build(label).rests_on), label])
    return list(found)


def words(text: str) -> str:
    """A sentence for Markdown, its labels as links to their pages, by the paper's numbers."""

    def link(found: re.Match[str]) -> str:
        label = found[0].strip("'`")
        number = f"equation ({NUMBERS[label]})" if label in NUMBERS else f"`{label}`"
        linked = f"[{number}]({slug(label)}.md)" if label in LABELS else found[0]
        return number if label in DEFINITIONS else linked

    label = r"\beq:\w+|\bfr[12]\b|'[\w-]+'"
    pieces = re.split(_FORMULA, text)
    return "".join(p if p.startswith("$") else re.sub(label, link, p) for p in pieces)


def heading(name: str) -> str:
    """The name of a step for Markdown; a word at its beginning, but no symbol, gets a capital."""
    first = name.partition(" ")[0].rstrip(",")
    spoken = first.isalpha() and (first == "a" or len(first) > 1)
    return words(name[:1].upper() + name[1:] if spoken else name)


def escaped(text: str) -> str:
    """A sentence for LaTeX, its formulas as they are."""
    return "".join(
        p if p.startswith("$") else re.sub("([&%#_{}])", r"\\\1", p).replace("^", r"\^{}")
        for p in re.split(_FORMULA, text)
    )


def display(latex: str) -> list[str]:
    """Lines of Markdown: a formula, or several, each on a line of its own where they are long."""
    rows = latex.split(r" ,\quad ") if len(latex) > _LONG else [latex]
    return [line for row in rows for line in (f"$$ {row} $$", "")]


def letters(d: Derivation, steps: Iterable[Step], text: str = "") -> list[str]:
    """The names in steps, in a text and in what these mean, if the paper's table explains them."""
    held: set[str] = set()
    for e in (side for step in steps for side in (step.left, step.right)):
        if isinstance(e, str):
            text += f" ${e}$"
        else:
            known = sympy.sympify(e)
            held |= {s.name for s in known.atoms(sympy.Symbol)}
            held |= {type(f).__name__ for f in known.atoms(sympy.Function)}
    own = _OWN.get(d.label, set())
    named = {shown(s): s for s in MEANINGS}
    found: list[str] = []
    while len(found) < len(new := [s for s in MEANINGS if s in held - own]):
        found = new
        told = " ".join([text, *(MEANINGS[s][0] for s in found)])
        parts = {p for formula in re.findall(_FORMULA, told) for p in re.findall(_LETTER, formula)}
        held |= {named[p] for p in parts & named.keys() - {shown(s) for s in found}}
    return found


def shown(name: str) -> str:
    return NAMES.get(name, tex(sympy.Symbol(name)))


def table(names: Iterable[str]) -> list[str]:
    """Lines of Markdown: what the letters of formulas mean."""
    rows = [f"| ${shown(s)}$ | {' | '.join(MEANINGS[s])} |" for s in names]
    return ["| letter | meaning | measured in |", "|---|---|---|", *rows, ""] if rows else []


def statement(d: Derivation, mark: str) -> list[str]:
    """Lines of Markdown: the formula, where it holds, its letters, its error."""
    held, false = [], []
    right = {s for step in d.concluded for s in sympy.sympify(step.right).free_symbols}
    for sign, kind in ((">", "positive"), ("<", "negative")):
        found = {s.name for s in right if s.assumptions0.get(kind)}
        if signed := [shown(s) for s in _GIVEN if s in found]:
            held.append(f"- ${', '.join(signed)} {sign} 0$.")
    for x, check, fails in d.supposed:
        if fails:
            example = f"A counterexample is {words(fails)}."
            false.append(f"- It is not always true that {words(x)}. {example}")
        else:
            held.append(f"- {words(x[:1].upper() + x[1:])}{' (checked)' * bool(check)}.")
    lines = display(d.latex())
    for title, rows in (("Where it holds", held), ("Counterexamples", false)):
        lines += [f"{mark} {title}", "", *rows, ""] if rows else []
    lines += [f"{mark} Letters", "", *[f"Here {words(d.note)}.", ""] * bool(d.note)]
    lines += table(letters(d, d.concluded, d.note))
    error = d.leaves_out()
    known = f" {words(d.known[:1].upper() + d.known[1:])}." * bool(d.known)
    return [*lines, f"{mark} Error", "", f"{words(error[:1].upper() + error[1:])}.{known}", ""]


def steps(d: Derivation, mark: str) -> list[str]:
    """Lines of Markdown: the letters that only the steps have; each step under a heading."""
    first = letters(d, d.concluded, d.note)
    lines = table(s for s in letters(d, d.steps) if s not in first)
    for number, s in enumerate(d.steps, 1):
        why = words(s.why)
        lines += [f"{mark} {number}. {heading(s.name)}", "", *display(s.latex())]
        lines += [f"{why[:1].upper()}{why[1:]}{'. ' * bool(why)}Checked {s.check_kind}.", ""]
    return lines


def markdown(label: str) -> str:
    """The page of a label."""
    d = build(label)
    on = ", ".join(f"[{other}]({slug(other)}.md)" for other in d.rests_on)
    lines = [f"# {label}: {d.title}", "", *statement(d, "##")]
    return "\n".join([*lines, *[f"Rests on {on}.", ""] * bool(on), *steps(d, "##")])


def latex(label: str, whole: bool = True) -> str:
    r"""A snippet to ``\input``, with the steps or the formula alone; it needs amsmath."""
    d = build(label)
    about = f"{escaped(d.leaves_out())}. {escaped(d.note)}"
    lines = [rf"\paragraph{{{escaped(d.title)}}} \texttt{{{escaped(label)}}}, {about}"]
    lines += [rf"\[ {row} \]" for row in d.latex().split(r" ,\quad ")]
    for name, why, shown in ((s.name, s.why, s.latex()) for s in d.steps if whole):
        lines.append(rf"\par {escaped(f'{name}: {why}'.removesuffix(': '))} \[ {shown} \]")
    return "\n".join([*lines, ""])


def document() -> str:
    """A LaTeX document of all formulas."""
    head = "\\documentclass[a4paper]{article}\n\\usepackage{amsmath,amssymb,geometry}\n"
    body = "".join(latex(label, whole=False) for label in MODULES)
    return f"{head}\\begin{{document}}\n{body}\\end{{document}}\n"


def record(label: str) -> dict[str, Any]:
    """A derivation as data."""
    d = build(label)
    found = {name: getattr(d, name) for name in ("label", "title", "note", "rests_on")}
    found |= {"latex": d.latex(), "error": d.leaves_out()}
    found["supposed"] = [{"statement": text, "fails": fails} for text, _, fails in d.supposed]
    found["steps"] = [{"name": s.name, "why": s.why, "latex": s.latex(), "check": s.check_kind}
                      for s in d.steps]  # fmt: skip
    return found


def names(labels: Iterable[str]) -> list[str]:
    """The files that `derive` writes for these labels."""
    pages = [f"{slug(label)}.{kind}" for label in labels for kind in ("md", "tex")]
    return [*pages, "index.md", "trace.json"]


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
            raise AccuracyError(f"{label}: {wrong[0]!r} does not hold; correct the step.")
        for kind, text in (("md", markdown(label)), ("tex", latex(label))):
            write_bytes(folder / f"{slug(label)}.{kind}", text.encode())
        cells = f"[{label}]({slug(label)}.md)", d.title, str(len(d.steps)), d.leaves_out()
        rows.append(f"| {' | '.join(cells)} |")
        traced.append(record(label))
        step()
    for label, (shown, text) in DEFINITIONS.items():
        rows += ["", f"**{label}** defines {words(text)}.", "", f"$$ {shown} $$"]
    write_bytes(folder / "index.md", "\n".join([*rows, ""]).encode())
    trace = {"schema": SCHEMA, "versions": versions("sympy", "mpmath"), "derivations": traced}
    write_json(folder / "trace.json", trace)
