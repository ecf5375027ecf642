"""The notation sheet: every formula with its label, as one LaTeX document."""

from __future__ import annotations

from collections.abc import Iterator

from derivations.registry import entries
from derivations.report import tex, tex_text
from symasym.formula import Formula, formula

_SECTIONS = {
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
    (r"\kappa_{\mathrm{phys}},\ r_{\mathrm{phys}}", "the same in physical units", r"\kappa,\ r"),
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
    section = ""
    for label, entry in entries().items():
        number = entry.module.removeprefix("derivations.section")[0]
        if number != section:
            section = number
            lines += ["", f"\\section*{{{_SECTIONS[number]}}}"]
        lines += ["", *_entry(formula(label))]
    return "\n".join([*lines, "\\end{document}", ""])


def _entry(found: Formula) -> Iterator[str]:
    label = tex_text(found.label)
    yield f"\\formula{{{tex(found.title)}}}{{{label}}}{{{tex(found.error)}}}"
    yield "\\begin{equation}"
    yield f"\\label{{{found.label}}}"
    rows = " \\\\\n".join(_rows(found.latex()))
    yield f"\\begin{{gathered}}\n{rows}\n\\end{{gathered}}" if "\n" in rows else rows
    yield "\\end{equation}"
    if found.note:
        yield f"{{\\small Here {tex(found.note)}.}}"


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
