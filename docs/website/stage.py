"""The pages of docs/ and those made for the site, side by side in one folder.

What is written by hand stays plain Markdown that reads well in a repository: the
order of the pages in the site is that of the lists of links in docs/index.md, heading by
heading, and a page that is not linked there yet comes after them. MathJax comes from its npm
package, and is put beside the pages.
"""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

from derivations.pages import slug
from website import api, explorer, formulas, glossary, layers, notebooks

DOCS = Path(__file__).parent.parent
ROOT = DOCS.parent
# Where a link that leaves docs/ leads in the site.
OUTSIDE = {"../CHANGELOG.md": "CHANGELOG.md"}
NO_PAGES = ("*.py", "*.json", "paper.*", "website", "__pycache__", "mathjax.js", "search.js")
# Indexes of made pages, with what they are called beside the pages of docs/.
MADE = {"Formulas": "formulas/index", "Reference": "api/index"}
# What the front page says of them, first under these headings.
IN_THE_SITE = {
    "Formulas": """- [Formulas](formulas/index.md) by section of the paper, and
  [as a graph](formulas/graph.md) of which rests on which
""",
    "Reference": "- [API reference](api/index.rst)\n",
}
#: Pages whose words are not linked: the glossary, and what is a record rather than a text.
UNLINKED = {"glossary.md", "errata.md", "CHANGELOG.md", "house.md"}
# A formula's label in code; blocks, formulas, links and headings are left alone.
_LABEL = re.compile(
    r"(?P<fence>^`{3,}).*?^(?P=fence)|\$\$.*?\$\$|\$[^$]*\$|\[[^\]]*\]\([^)]*\)|^#.*?$|<[^>]*>"
    r"|`(?P<label>[\w:-]+)`",
    re.DOTALL | re.MULTILINE,
)
# To a page; one to a section of it gives the page no place.
_LINK = re.compile(r"\]\(([\w./-]+\.md)\)")
# What takes TeX and draws SVG, with all it may load while it does; see docs/mathjax.js.
PARTS = (
    "startup.js",
    "core.js",
    "input/tex.js",
    "input/tex",
    "output/svg.js",
    "a11y/assistive-mml.js",
    "LICENSE",
)
FONT = "@mathjax/mathjax-newcm-font"


def all_pages() -> dict[str, str]:
    """File name -> text."""
    return {
        **formulas.pages(),
        **api.pages(),
        **explorer.pages(),
        **layers.pages(),
        **notebooks.files(),
    }


def stage(folder: Path, made: dict[str, str]) -> None:
    """Fill `folder` with the sources of the site.

    Parameters
    ----------
    folder : path
        What it held before is replaced.
    made : dict
        File name -> text of the pages that are made, not written.
    """
    if folder.exists():
        shutil.rmtree(folder)
    shutil.copytree(DOCS, folder, ignore=shutil.ignore_patterns(*NO_PAGES))
    # From the root of the repository its links lead into docs/, whose pages stand beside it here.
    changes = (ROOT / "CHANGELOG.md").read_text("utf-8").replace("](docs/", "](")
    (folder / "CHANGELOG.md").write_text(changes, encoding="utf-8")
    for name, text in made.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for page in folder.glob("*.md"):
        text = _inward(page.read_text("utf-8"))
        if page.name not in UNLINKED:
            text = glossary.linked(text)
        if page.name == "glossary.md":
            text = glossary.anchored(text)
        if page.name not in ("errata.md", "CHANGELOG.md"):
            text = labelled(text, made)
        if f"notebooks/{page.stem}.ipynb" in made:
            text = notebooks.offered(text, page.stem)
        page.write_text(text, encoding="utf-8")
    index = folder / "index.md"
    pages = {str(path.relative_to(folder)) for path in folder.glob("*.md")} - {"index.md"}
    index.write_text(with_toctrees(index.read_text("utf-8"), pages), encoding="utf-8")


def labelled(text: str, made: dict[str, str]) -> str:
    """A page whose labels of formulas lead to their pages."""

    def piece(found: re.Match[str]) -> str:
        page = f"formulas/{slug(found['label'] or '')}.md"
        return f"[{found[0]}]({page})" if page in made else found[0]

    return _LABEL.sub(piece, text)


def _inward(text: str) -> str:
    for outside, inside in OUTSIDE.items():
        text = text.replace(f"]({outside}", f"]({inside}")
    return text


def with_toctrees(index: str, pages: set[str]) -> str:
    """`index` with a hidden toctree for the pages that each of its headings links, in order."""
    caption, listed = "", {"": list[str]()}
    prose = re.sub(r"```.*?```", "", index, flags=re.DOTALL)
    for line in prose.splitlines():
        if line.startswith("#"):
            caption = line.lstrip("# ") if line.startswith("##") else ""
            listed.setdefault(caption, [])
            continue
        # A link in a sentence gives a page no place.
        for name in _LINK.findall(line) if line.startswith(("- ", "  ")) else ():
            if name in pages and not any(name in names for names in listed.values()):
                listed[caption].append(name)
    left = sorted(pages - {name for names in listed.values() for name in names})
    listed.setdefault("More", []).extend(left)
    for heading, name in MADE.items():
        listed.setdefault(heading, []).insert(0, f"{name}.md")
    for heading, line in IN_THE_SITE.items():
        index = index.replace(f"\n## {heading}\n\n", f"\n## {heading}\n\n{line}")
    return index + "".join(_toctree(caption, names) for caption, names in listed.items() if names)


def _toctree(caption: str, names: list[str]) -> str:
    head = [":hidden:"] + ([f":caption: {caption}"] if caption else [])
    body = [name.removesuffix(".md") for name in names]
    return "\n".join(["\n```{toctree}", *head, "", *body, "```\n"])


# -- MathJax ---------------------------------------------------------------------------------------


class NoMathJax(RuntimeError):
    """MathJax is neither installed nor to be had."""


def install(folder: Path) -> Path:
    """The folder of node's packages with the MathJax that docs/package.json names."""
    wanted = json.loads((DOCS / "package.json").read_text("utf-8"))["dependencies"]["mathjax"]
    there = folder / "node_modules" / "mathjax" / "package.json"
    if there.is_file() and json.loads(there.read_text("utf-8"))["version"] == wanted:
        return folder / "node_modules"
    npm = shutil.which("npm")
    if npm is None:
        raise NoMathJax(
            "npm is not installed, and MathJax comes by it; install Node.js, or give "
            "--node-modules the folder of an installed MathJax."
        )
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(DOCS / "package.json", folder)
    command = [npm, "install", "--no-audit", "--no-fund", "--no-package-lock", "--loglevel=error"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    if done.returncode:
        raise NoMathJax(f"npm could not install MathJax {wanted}: {done.stderr.strip()[-400:]}")
    return folder / "node_modules"


def place(node_modules: Path, static: Path) -> None:
    """Copy what pages need of it to `static`/mathjax."""
    target = static / "mathjax"
    font = node_modules / FONT
    for source, name in [
        *((node_modules / "mathjax" / part, part) for part in PARTS),
        (font / "svg.js", "fonts/mathjax-newcm-font/svg.js"),
        (font / "svg", "fonts/mathjax-newcm-font/svg"),
    ]:
        goal = target / name
        goal.parent.mkdir(parents=True, exist_ok=True)
        if source.is_dir():
            shutil.copytree(source, goal, dirs_exist_ok=True)
        else:
            shutil.copy(source, goal)
