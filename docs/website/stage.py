"""The pages of docs/ and those made for the site, side by side in one folder.

What is written by hand stays plain Markdown that reads well in a repository: the order of the pages
in the site is that of the lists of links in docs/index.md, heading by heading.
"""

from __future__ import annotations

import inspect
import re
import shutil
from pathlib import Path

import symasym as sa
from derivations.pages import slug
from symasym.formula import labels
from website import formulas

DOCS = Path(__file__).parent.parent
NO_PAGES = ("*.py", "*.json", "paper.bib", "website", "__pycache__", "mathjax.js")
#: What the front page says of the pages that are made, first under these headings.
MADE = {
    "The paper": "- [Formulas](formulas/index.md) by section of the paper, and [as a "
    "graph](formulas/graph.md)\n",
    "Reference": "- [Functions and classes](api.rst)\n",
}
# A formula's label in code; blocks, formulas, links and headings are left alone.
_LABEL = re.compile(
    r"(?P<fence>^`{3,}).*?^(?P=fence)|\$\$.*?\$\$|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|^#.*?$|<[^>]*>"
    r"|`(?P<label>[\w:-]+)`",
    re.DOTALL | re.MULTILINE,
)
#: Members of `Drift` that the package needs of itself.
_INNER = "scalars, require_bound, values, exact_coefficients, end, of, model, shape"


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
    """The page of the public names, functions first, from their docstrings."""
    named = {name: getattr(sa, name) for name in sa.__all__}
    kinds = {
        "Functions": [n for n, x in named.items() if inspect.isfunction(x)],
        "Classes": [
            n for n, x in named.items() if inspect.isclass(x) and not issubclass(x, Exception)
        ],
        "Errors": [n for n, x in named.items() if inspect.isclass(x) and issubclass(x, Exception)],
    }
    lines = ["Functions and classes", "=====================", "", ".. currentmodule:: symasym", ""]
    for title, names in kinds.items():
        lines += [title, "-" * len(title), ""]
        lines += ["", ".. autosummary::", "", *(f"   {name}" for name in names), ""]
        for name in names:
            kind = {"Functions": "function", "Classes": "class", "Errors": "exception"}[title]
            lines += [f".. auto{kind}:: {name}"]
            if title == "Classes":
                lines += ["   :members:", "   :inherited-members: str, tuple"]
            lines += [f"   :exclude-members: {_INNER}"] * (name in ("Drift", "Friction")) + [""]
    return "\n".join(lines)
