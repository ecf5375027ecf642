"""The pages of the API, from the public names and their docstrings.

In a terminal docstrings read as they are written: ``kappa^2/2``, ``docs/limits.md``, ``eq:Ttilde``.
On a page (`typeset`) pages and labels are links.
"""

from __future__ import annotations

import inspect
import re
from dataclasses import MISSING, Field, fields, is_dataclass
from importlib import import_module
from typing import get_args

import symasym as sa
from derivations.pages import slug
from symasym import quantities
from symasym.formula import labels

#: The pages in their order, the functions that answer a question first.
TITLES = {
    "quantities": "Escape time, exit probability, occupation, density",
    "drifts": "Drifts and scales",
    "release": "The oscillator with a moving spring extension",
    "integrals": "Integrals with a large parameter",
    "formulas": "Formulas, source code and results",
    "errors": "Errors",
}
# By the module or package a name lives in; one that is not listed is under "quantities".
_PLACES = {
    "symasym.base.scales": "drifts",
    "symasym.drift": "drifts",
    "symasym.release": "release",
    "symasym.integrals": "integrals",
    "symasym.formula": "formulas",
    "symasym.emit": "formulas",
    "symasym.base.estimate": "formulas",
    "symasym.base.errors": "errors",
}
#: What stands first on its page; all else follows, functions before classes.
_FIRST = ("escape_time", "exit_probability", "occupation", "stationary_density", "plan", "friction")
#: Members that the package needs of itself, and that are no part of its interface.
INNER = {
    "Drift": (
        *(
            "shape_with",
            "scalars",
            "require_bound",
            "evaluate",
        ),
        *("evaluate_float", "float_values", "coefficients"),
        *("exact_coefficients", "exact_end", "exact_value", "end", "of", "flat_values"),
    ),
    "Formula": ("functions",),
    "System": ("phi_at", "velocity_at", "noise_at", "slope_in_y"),
}
# Not in `symasym` itself, but written for others to build on.
MODULES = {
    "symasym.derivation": "Derivations of your own",
    "symasym.workshop.figures": "The paper's figures",
}

#: Classes of answers in `symasym`, which nobody builds: shown without arguments.
RETURNED = {
    "CriticalPoint", "Expansion", "Folds", "Formula", "Friction", "LaplaceExpansion", "Plan",
    "Reduction", "Release", "Sensitivity", "UniformExpansion",
}  # fmt: skip

#: The types in signatures that are no classes, with what they are.
TYPES = {
    "Number": "int, float, str, Fraction or Decimal; text is taken exactly.",
    "Numbers": "A number, or an array or nested list of them.",
    "Floats": "A float, or an array of float64.",
    "FloatArray": "An array of float64.",
    "Answer": "A float, or an array where an argument is one; with ``dps`` an mpf, or an array of "
    "them; with ``full=True`` an :class:`Estimate`.",
    **{
        name: ", ".join(f'``"{word}"``' for word in get_args(getattr(quantities, name))) + "."
        for name in ("TimeMethod", "ExitMethod", "OccupationMethod", "Errors")
    },
}


def pages() -> dict[str, str]:
    """File name -> reStructuredText."""
    grouped: dict[str, list[str]] = {place: [] for place in TITLES}
    for name in sa.__all__:
        value = getattr(sa, name)
        grouped[_place(value.__module__)].append(name)
    made = {
        f"api/{place}.rst": _page(TITLES[place], "symasym", sorted(names, key=_rank))
        for place, names in grouped.items()
        if names
    }
    types = "\n".join(f".. py:type:: {name}\n\n   {text}\n" for name, text in TYPES.items())
    made["api/quantities.rst"] += f"\nTypes in signatures\n-------------------\n\n{types}"
    for module, title in MODULES.items():
        names = list(import_module(module).__all__)
        made[f"api/{module.rpartition('.')[2]}.rst"] = _page(title, module, names)
    listed = {
        name.removeprefix("api/").removesuffix(".rst"): re.findall(r"auto\w+:: (\w+)", text)
        for name, text in made.items()
    }
    lines = [
        f"- :doc:`{page}`: {', '.join(f'``{name}``' for name in names)}"
        for page, names in listed.items()
    ]
    tree = ["", ".. toctree::", "   :hidden:", "", *(f"   {page}" for page in listed), ""]
    made["api/index.rst"] = "\n".join([*_heading("API reference"), _INTRODUCTION, *lines, *tree])
    return made


def _place(module: str) -> str:
    """The page of a module's names."""
    return next(
        (page for home, page in _PLACES.items() if f"{module}.".startswith(f"{home}.")),
        "quantities",
    )


def _rank(name: str) -> tuple[int, bool, str]:
    first = _FIRST.index(name) if name in _FIRST else len(_FIRST)
    return first, inspect.isclass(getattr(sa, name)), name


_INTRODUCTION = """
Everything here is reached as ``symasym.NAME``, but for derivations and figures, whose modules their
pages name. Inputs are scaled unless they are said to be physical, and a number in quotes is exact.
"""


def _heading(title: str) -> list[str]:
    return [title, "=" * len(title), ""]


# What a class has of its own and of a class of the project, and not of str, a NamedTuple or Drift.
_CLASS = ("   :members:", "   :inherited-members: str, tuple, Drift")


def _arguments(value: type) -> str:
    """The arguments of a class with empty mappings as defaults, which Sphinx would print at length.

    Empty for all other classes.
    """
    known = [f for f in fields(value) if f.init] if is_dataclass(value) else []
    if all(f.default_factory is MISSING for f in known):
        return ""
    shown = [f"{f.name}{_default(f)}" for f in known if not f.name.startswith("_")]
    return f"({', '.join(shown)})"


def _default(of: Field[object]) -> str:
    """What stands behind a field's name in a call."""
    if of.default_factory is not MISSING:
        return f"={of.default_factory()!r}"
    return "" if of.default is MISSING else f"={of.default!r}"


def _page(title: str, module: str, names: list[str]) -> str:
    lines = [*_heading(title), f".. currentmodule:: {module}", ""]
    for name in names:
        value = getattr(import_module(module), name)
        if isinstance(value, type) and issubclass(value, Exception):
            lines += [f".. autoexception:: {name}", ""]
        elif inspect.isclass(value):
            inner = [f"   :exclude-members: {', '.join(INNER[name])}"] if name in INNER else []
            given = "()" if module == "symasym" and name in RETURNED else _arguments(value)
            base = value.__bases__[0]
            known = base is str or hasattr(import_module(module), base.__name__)
            below = ["   :show-inheritance:"] if known else []
            lines += [f".. autoclass:: {name}{given}", *_CLASS, *below, *inner, ""]
        elif callable(value):
            lines += [f".. autofunction:: {name}", ""]
    return "\n".join(lines)


# -- docstrings ------------------------------------------------------------------------------------


def typeset(lines: list[str]) -> list[str]:
    """The lines of a docstring, in reStructuredText, with links to pages and formulas."""
    return [line if ">>>" in line else _linked(line) for line in lines]


def _linked(line: str) -> str:
    """A line whose pages and labels lead to where they are."""
    line = re.sub(r"(?<![\w`/])docs/([\w-]+)\.md", r":doc:`/\1`", line)
    return re.sub(
        r"(?<![\w`\"'/])eq:\w+(?![\w`\"'])",
        lambda m: f":doc:`{m[0]} </formulas/{slug(m[0])}>`" if m[0] in labels() else m[0],
        line,
    )
