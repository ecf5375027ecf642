"""The pages of docs/ and those made for the site, side by side in one folder.

What is written by hand stays plain Markdown that reads well in a repository: the order of the pages
in the site is that of the lists of links in docs/index.md, heading by heading.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path

from derivations.pages import slug
from symasym.formula import labels
from website import formulas

DOCS = Path(__file__).parent.parent
NO_PAGES = ("*.py", "*.json", "paper.bib", "website", "_templates", "__pycache__", "mathjax.js")
#: What the front page says of the pages that are made, first under these headings.
MADE = {
    "The paper": "- [Formulas](formulas/index.md) by section of the paper, and [as a "
    "graph](formulas/graph.md)\n",
    "Reference": "- [Functions and classes](api.rst)\n",
}
#: Words of a search that a page is the answer to.
SOUGHT = {"pieces.md": "double well"}
# A formula's label in code; blocks, formulas, links and headings are left alone.
_LABEL = re.compile(
    r"(?P<fence>^`{3,}).*?^(?P=fence)|\$\$.*?\$\$|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|^#.*?$|<[^>]*>"
    r"|`(?P<label>[\w:-]+)`",
    re.DOTALL | re.MULTILINE,
)
#: The public names by question.
API = {
    "Times and probabilities": "escape_time exit_probability occupation stationary_density "
    "stokes_multiplier sensitivity Estimate Sensitivity",
    "The law of the exit time": "exit_law ExitLaw",
    "Drifts": "Drift friction linear polynomial sine tanh hill reduce rescale "
    "CriticalPoint Reduction Scales",
    "Formulas": "expand formula labels Expansion Formula",
    "Integrals with a large parameter": "laplace_integral uniform_integral LaplaceExpansion "
    "UniformExpansion",
    "Release": "release oscillator System Release",
    "Source code, plans and pictures": "emit plan plot Plan",
    "Errors": "SymasymError InputError RegionError RangeError AccuracyError OutputError",
}


def stage(folder: Path) -> int:
    """Fill `folder` with the sources of the site; the number of pages that are made."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(DOCS, folder, ignore=shutil.ignore_patterns(*NO_PAGES))
    changes = (DOCS.parent / "CHANGELOG.md").read_text("utf-8").replace("](docs/", "](")
    made = {**formulas.pages(), "api.rst": api(), "CHANGELOG.md": changes}
    for name, text in made.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for page in folder.glob("*.md"):
        text = page.read_text("utf-8").replace("](../CHANGELOG.md", "](CHANGELOG.md")
        text = text if page.name == "CHANGELOG.md" else labelled(text)
        if page.name in SOUGHT:
            text = text.replace("\n", f"\n\n```{{index}} ! {SOUGHT[page.name]}\n```\n", 1)
        page.write_text(with_toctrees(text) if page.name == "index.md" else text, encoding="utf-8")
    return len(made)


def labelled(text: str) -> str:
    """A page whose labels of formulas lead to their pages."""

    def piece(found: re.Match[str]) -> str:
        label = found["label"]
        return f"[{found[0]}](formulas/{slug(label)}.md)" if label in labels() else found[0]

    return _LABEL.sub(piece, text)


def with_toctrees(index: str) -> str:
    """`index` with a hidden toctree for the pages that the lists under each heading link first."""
    for heading, line in MADE.items():
        index = index.replace(f"\n## {heading}\n\n", f"\n## {heading}\n\n{line}")
    trees = []
    for part in re.split(r"(?m)^## ", index)[1:]:
        names = re.findall(r"(?m)^- [^\n]*?\]\(([\w/-]+)\.(?:md|rst)\)", part)
        if names:
            caption = part.partition("\n")[0]
            head = ["```{toctree}", ":hidden:", f":caption: {caption}", ""]
            trees += ["", *head, *names, "```"]
    return "\n".join([index, *trees, ""])


def api() -> str:
    """The tables of the public names, whose pages autosummary makes from their docstrings."""
    lines = ["Functions and classes", "=====================", "", ".. currentmodule:: symasym"]
    for title, names in API.items():
        lines += ["", title, "-" * len(title), "", ".. autosummary::", "   :toctree: api"]
        lines += ["   :nosignatures:", "", *(f"   {name}" for name in names.split())]
    return "\n".join([*lines, ""])
