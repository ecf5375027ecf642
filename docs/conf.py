"""Sphinx's settings. `docs/build.py` stages the pages and runs Sphinx with them."""

import re
import sys
from importlib import metadata
from pathlib import Path

sys.path[:0] = [str(Path(__file__).parent), str(Path(__file__).parent.parent)]

from website.api import TYPES, typeset  # noqa: E402

project = "symasym"
author = "The symasym developers"
release = version = metadata.version("symasym")
project_copyright = author

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
]
myst_enable_extensions = ["attrs_block", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
myst_update_mathjax = False
exclude_patterns: list[str] = []
# A type in words ("expression") may be the name of an attribute of several classes.
suppress_warnings = ["ref.python"]
# A single backtick in a docstring is a name or a value.
default_role = "code"
# Dashes alone: V'' is a second derivative.
smartquotes_action = "D"

autodoc_typehints = "signature"
# Names of types that the reference explains, for the unions that they stand for.
autodoc_type_aliases = {name: f"symasym.{name}" for name in TYPES}
autodoc_typehints_format = "short"
python_use_unqualified_type_names = True
python_display_short_literal_types = True
python_maximum_signature_line_length = 80
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = True
viewcode_line_numbers = True

html_theme = "furo"
html_title = "symasym"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_favicon = "_static/icon.svg"
html_js_files = ["site.js"]
html_search_scorer = str(Path(__file__).parent / "search.js")
html_copy_source = False
html_show_sourcelink = False
# Pages opened from the file system must not ask for anything from elsewhere.
html_theme_options = {"footer_icons": []}

# From the npm package that docs/package.json names. SVG rather than fonts, which some browsers
# refuse to load for pages opened from the file system.
mathjax_path = "mathjax/startup.js"
mathjax_config_path = "mathjax.js"


def _link_docstring(app, what, name, value, options, lines) -> None:
    lines[:] = typeset(lines)


def _whole_signatures(app) -> None:
    """Show a verb's own signature, with all its options, in place of its overloads for checkers."""
    from sphinx.pycode import ModuleAnalyzer  # the tests read this file without Sphinx

    verbs = ModuleAnalyzer.for_module("symasym.quantities")
    verbs.analyze()
    verbs.overloads.clear()


def _named_types(app, what, name, value, options, arguments, returned):
    """The signature with the names of types, also where Sphinx shows what it has for a name."""
    plain = [
        text and re.sub(r"TypeAliasForwardRef\('([\w.]+)'\)", r"\1", text)
        for text in (arguments, returned)
    ]
    return tuple(plain)


def _without_builtins(app):
    """viewcode lists the module of plain dicts and numbers, for which it writes no page."""
    getattr(app.env, "_viewcode_modules", {}).pop("builtins", None)
    return []


def setup(app) -> None:
    """Docstrings are written as for a shell; here their formulas are set and their labels lead."""
    app.connect("html-collect-pages", _without_builtins, priority=100)
    app.connect("builder-inited", _whole_signatures)
    app.connect("autodoc-process-signature", _named_types)
    app.connect("autodoc-process-docstring", _link_docstring)
