"""A page for each formula, made from its derivation, and the indexes of all."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from importlib import import_module, metadata
from pathlib import Path

from derivations import pages as made
from derivations.labels import BEYOND, DEFINITIONS, NUMBERS
from derivations.pages import slug, words
from derivations.paper import MEANINGS
from symasym import friction
from symasym.base.errors import InputError
from symasym.derivation.derivation import LABELS, build
from symasym.formula import formula, labels
from website import calls, graph

DOCS = Path(__file__).parent.parent
VERSION = metadata.version("symasym")
#: Sections of the paper, and what is beyond it.
SECTIONS = {
    "2": "Section 2: The systems",
    "3": "Section 3: The results in physical units",
    "4": "Section 4: Reduction to one dimension",
    "5": "Section 5: Stationary density and escape time",
    "6": "Section 6: Strong and weak noise",
    "7": "Section 7: The friction oscillator",
    "8": "Beyond the paper: the whole system",
    "9": "Beyond the paper: the law of the exit time, and noise that depends on the state",
}
#: What code is emitted for, and how it is coloured.
_LANGUAGES = ("python", "python", "c", "javascript", "latex")
TARGETS = dict(zip(("NumPy", "mpmath", "C", "JavaScript", "LaTeX"), _LANGUAGES, strict=True))
_ARXIV = "https://arxiv.org/abs/1310.8328"
#: Symbols of the problem, which need no explanation in a list of formulas.
_COMMON = {*"uvyztarTCPVA", "phi", "kappa", "lam", "epsilon", "mu", "alpha", "z0", "u1", "u2"}
_COMMON |= {"kappa_phys", "r_phys", "t_phys", "a_minus", "a_plus"}


def pages() -> dict[str, str]:
    """File name -> text: a page for each formula, and the indexes."""
    labels()
    return {
        **{f"formulas/{slug(label)}.md": page(label) for label in LABELS},
        "formulas/index.md": index(),
        **{f"formulas/section-{n}.md": section(n) for n in SECTIONS},
        "formulas/graph.md": graph_page(),
    }


def page(label: str) -> str:
    """The page of one formula."""
    d = build(label)
    used = [other for other in LABELS if label in build(other).rests_on]
    lines = [
        *(f"# {heading(d.title)}", "", f"{_place(label)}. {_section(label)}.", ""),
        *made.statement(d, "##"),
        *_errata(label),
        *("## Derivation", "", f"Starts from: {_links(d.rests_on) or 'definitions only'}.", ""),
        *made.steps(d, "###"),
        *_evaluation(label),
        *("## Used by", "", f"{_links(used) or 'No other formula'}.", ""),
        *_cite(label),
    ]
    return "\n".join(lines)


def heading(title: str) -> str:
    """A title as plain text, because the sidebar and the browser's tab show it as well."""
    signs = {r"\kappa": "κ", r"\sigma": "σ", r"\varepsilon": "ε", r"\phi": "ϕ", r"\lambda": "λ"}
    signs |= {"^2": "²", "^-": "⁻", "^+": "⁺", "$": "", r"\to": "→", r"\le": "≤", r"\infty": "∞"}
    title = re.sub(r"\beq:\w+|\bfr[12]\b", lambda m: f"equation ({NUMBERS[m[0]]})", title)
    for sign, character in signs.items():
        title = title.replace(sign, character)
    return title


def _place(label: str) -> str:
    """A label with the number of its equation in the paper, or a note that it is not there."""
    number = f", equation ({NUMBERS[label]}) of [the paper]({_ARXIV})" if label in NUMBERS else ""
    beyond = f", not in [the paper]({_ARXIV})" if label in BEYOND else ""
    return f"`{label}`{number}{beyond}"


def _named(label: str) -> str:
    return f"`{label}` ({NUMBERS[label]})" if label in NUMBERS else f"`{label}`"


def _module(label: str) -> str:
    return str(LABELS[label][1].__module__)


def _section(label: str) -> str:
    """Where in the paper the formula is, the first words of its module's docstring."""
    text = (import_module(_module(label)).__doc__ or "").partition(".\n")[0].partition(":")[0]
    return " ".join(text.split()).rstrip(".")


def _link(label: str) -> str:
    return f"[{heading(build(label).title)}]({slug(label)}.md)"


def _links(chosen: Iterable[str]) -> str:
    return "; ".join(map(_link, chosen))


def _cite(label: str) -> list[str]:
    """BibTeX of the paper and of symasym with the formula's place in both, folded."""
    number = f",\n  note = {{Equation ({NUMBERS[label]})}}" if label in NUMBERS else ""
    paper = f"""@misc{{JeffreySimpson,
  author = {{Jeffrey, M. R. and Simpson, D. J. W.}},
  title = {{Non-{{F}}ilippov dynamics arising from the smoothing of nonsmooth systems, and
           its robustness to noise}},
  eprint = {{1310.8328}},
  archiveprefix = {{arXiv}},
  year = {{2013}}{number}
}}"""
    software = f"""@software{{symasym,
  author = {{{{The symasym developers}}}},
  title = {{symasym: escape times and {{Laplace}}-type integrals of smoothed switches
           with noise}},
  version = {{{VERSION}}},
  year = {{2026}},
  note = {{Formula {label}}}
}}"""
    key = BEYOND.get(label)
    pattern = rf"^@\w+{{{key},.*?^}}$"
    found = re.search(pattern, (DOCS / "paper.bib").read_text("utf-8"), re.DOTALL | re.MULTILINE)
    cited = [
        *([found[0]] if key and found else []),
        *sorted((paper, software), reverse=label in BEYOND),
    ]
    return folded("Cite", ["```bibtex", *cited, "```", ""])


def folded(summary: str, lines: Iterable[str]) -> list[str]:
    """Lines that are shown when their summary is clicked."""
    return [f"<details><summary>{summary}</summary>", "", *lines, "</details>", ""]


@cache
def _slips() -> list[list[str]]:
    """The rows of the table of errata: number, place, printed, correct, kind, and what follows."""
    text = (DOCS / "errata.md").read_text("utf-8")
    rows = re.findall(r'^\| <a id="erratum-\d+"></a>(\d+) \| (.*) \|$', text, re.MULTILINE)
    return [[number, *rest.split(" | ")] for number, rest in rows]


def _errata(label: str) -> list[str]:
    """Boxes of the errata that name a formula, folded where there are several."""
    boxes = [
        [
            f":::{{admonition}} Erratum ({kind}): {place.replace(f'`{label}`', '').strip()}",
            *(f"Printed: {printed}.", "", f"Correct: {right}.", ""),
            # In HTML: what it leads to is no heading, which a link in Markdown looks for.
            *(
                f'<a href="../errata.html#erratum-{number}">Number {number} of the errata</a>.',
                ":::",
                "",
            ),
        ]
        for number, place, printed, right, kind, *_ in _slips()
        if f"`{label}`" in place
    ]
    lines = [line for box in boxes for line in box]
    return folded(f"{len(boxes)} errata", lines) if boxes[1:] else lines


def _evaluation(label: str) -> list[str]:
    """Calls that evaluate the formula, and its code, for friction where it needs a drift."""
    session = calls.session(label)
    lines = ["## Evaluate it", "", "```pycon", session, "```", ""] if session else []
    code: list[str] = []
    for name, language in TARGETS.items():
        for drift in (None, friction()):
            try:
                text = str(formula(label).emit(name.lower(), drift=drift)).rstrip()
            except InputError:
                continue
            title = f"**{name}**{', with the friction drift' if drift is not None else ''}"
            code += [title, "", f"```{language}", text, "```", ""]
            break
    return [*lines, *(["## As code", "", *folded(", ".join(TARGETS), code)] if code else [])]


def section(number: str) -> str:
    """The formulas of one section of the paper."""
    lines = [f"# {SECTIONS[number]}", ""]
    chosen = _of_section(number)
    for label in chosen:
        d = build(label)
        own = [s for s in made.letters(d, d.concluded) if s not in _COMMON]
        lines += [f"**{_link(label)}**, {_named(label)}; error: {words(d.leaves_out())}.", ""]
        lines += made.display(d.latex())
        means = [f"${made.shown(s)}$: {MEANINGS[s][0]}" for s in own]
        lines += [f"where {'; '.join(means)}.", ""] if means else []
    return "\n".join([*lines, *_toctree(map(slug, chosen))])


def _of_section(number: str) -> list[str]:
    """The labels of a section in the paper's order; those beyond the paper come last."""
    chosen = [x for x in LABELS if _module(x).startswith(f"derivations.sections.section{number}")]
    return sorted(chosen, key=lambda x: NUMBERS.get(x, len(NUMBERS) * 2))


def _toctree(names: Iterable[str]) -> list[str]:
    return ["```{toctree}", ":hidden:", "", *names, "```", ""]


def index() -> str:
    """The sections with the titles of their formulas, and the definitions."""
    lines = [
        *("# Formulas", ""),
        f"{len(LABELS)} results are derived in {sum(len(build(x).steps) for x in LABELS)} checked "
        "steps. They are listed by section of the paper; [a graph](graph.md) shows which result "
        "rests on which. Each title is followed by its label and, in brackets, the number of its "
        "equation in the paper.",
        "",
    ]
    for number, title in SECTIONS.items():
        lines += [
            f"## {title}",
            "",
            f"[{title.partition(':')[0]}, with the formulas in full](section-{number}.md).",
            "",
        ]
        lines += [*(f"- {_link(label)}, {_named(label)}" for label in _of_section(number)), ""]
    lines += ["## Definitions, which need no derivation", ""]
    for label, (shown, text) in DEFINITIONS.items():
        lines += [f"**{label}** defines {words(text)}.", "", f"$$ {shown} $$", ""]
    return "\n".join([*lines, *_toctree(["graph", *(f"section-{n}" for n in SECTIONS)])])


def graph_page() -> str:
    """The graph of which formula rests on which, as a drawing and as a list."""
    rests = {label: build(label).rests_on for label in made.with_roots(LABELS)}
    titles = {label: heading(build(label).title) for label in rests}
    listed = []
    for number, title in SECTIONS.items():
        found = ((label, build(label).rests_on) for label in _of_section(number))
        rows = [f"- {_link(label)} rests on: {_links(below)}." for label, below in found if below]
        listed += ["", f"## {title}", "", *rows] if rows else []
    lines = [
        *("---", "hide-toc: true", "---", "# Which formula rests on which", ""),
        "An arrow leads down from a result to another that uses it. A box without an incoming "
        "arrow rests on definitions only. Each label is a link to the page of its formula.",
        *("", "```{raw} html", graph.svg(rests, titles), "```", *listed),
    ]
    return "\n".join([*lines, ""])
