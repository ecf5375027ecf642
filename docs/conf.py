"""Sphinx's settings: pages in Markdown, the reference from docstrings, formulas by MathJax.

`docs/build.py` stages the pages and runs Sphinx with them.
"""

import re
import sys
from importlib import metadata
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent)]

from derivations.pages import slug  # noqa: E402
from symasym.formula import labels  # noqa: E402

project = "symasym"
author = project_copyright = "The symasym developers"
release = version = metadata.version("symasym")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
]
myst_enable_extensions = ["colon_fence", "dollarmath"]
myst_heading_anchors = 4
myst_update_mathjax = False
default_role = "code"
smartquotes_action = "D"  # dashes alone: V'' is a second derivative

autodoc_typehints = "none"  # docstrings have the types in words
autodoc_member_order = "bysource"
templates_path = [str(Path(__file__).parent / "_templates")]
# A type in words, such as "pair of numbers", leads nowhere.
napoleon_google_docstring = napoleon_use_param = napoleon_use_rtype = False
python_maximum_signature_line_length = 80
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True

html_theme = "furo"
html_title = "symasym"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/icon.svg"
html_copy_source = html_show_sourcelink = html_show_search_summary = False
html_theme_options = {"footer_icons": []}  # pages ask for nothing from elsewhere

# SVG rather than fonts, which some browsers refuse to load for pages opened from the file system.
mathjax_path = "mathjax/startup.js"
mathjax_config_path = "mathjax.js"


def _linked(line: str) -> str:
    """A line of a docstring whose pages and labels lead to where they are."""
    line = re.sub(r"(?<![`\w])\|(\w+)\|", r"\|\1\|", line)  # no substitution of reStructuredText
    line = re.sub(
        r"(?<![\w`/])docs/([\w-]+)\.md",
        lambda m: f":doc:`/{m[1]}`" if (Path(__file__).parent / f"{m[1]}.md").exists() else m[0],
        line,
    )
    return re.sub(
        r"(?<![\w`\"'/])eq:\w+(?![\w`\"'])",
        lambda m: f":doc:`{m[0]} </formulas/{slug(m[0])}>`" if m[0] in labels() else m[0],
        line,
    )


def _link_docstring(app, what, name, value, options, lines) -> None:
    lines[:] = [line if ">>>" in line else _linked(line) for line in lines]


def setup(app) -> None:
    """Docstrings are written as for a shell; here their labels lead."""
    app.connect("autodoc-process-docstring", _link_docstring, priority=100)  # before napoleon
