"""The pages of the API, from the public names and their docstrings."""

from __future__ import annotations

import inspect
from importlib import import_module

import symasym as sa

TITLES = {
    "drifts": "Drifts and scales",
    "numbers": "Exact numbers and their formulas",
    "integrals": "Integrals with a large parameter",
    "formulas": "Formulas and results",
    "errors": "Errors",
}
# By the module a name lives in; a module that is not listed is under "numbers".
_PLACES = {
    "symasym.drift.drift": "drifts",
    "symasym.drift.ready_made.friction": "drifts",
    "symasym.drift.ready_made.smoothings": "drifts",
    "symasym.base.scales": "drifts",
    "symasym.drift.reduction": "drifts",
    "symasym.asymptotics.laplace.integral": "integrals",
    "symasym.asymptotics.coalescence.integral": "integrals",
    "symasym.formula": "formulas",
    "symasym.base.estimate": "formulas",
    "symasym.base.errors": "errors",
}
# Not in `symasym` itself, but written for others to build on.
MODULES = {
    "symasym.derivation": "Derivations of your own",
    "symasym.workshop.figures": "The paper's figures",
    "symasym.emit.source": "Emitted source code",
}


def pages() -> dict[str, str]:
    """File name -> reStructuredText."""
    grouped: dict[str, list[str]] = {place: [] for place in TITLES}
    for name in sa.__all__:
        value = getattr(sa, name)
        grouped[_PLACES.get(value.__module__, "numbers")].append(name)
    made = {
        f"api/{place}.rst": _page(TITLES[place], "symasym", names)
        for place, names in grouped.items()
        if names
    }
    for module, title in MODULES.items():
        names = list(import_module(module).__all__)
        made[f"api/{module.rpartition('.')[2]}.rst"] = _page(title, module, names)
    listed = [name.removeprefix("api/").removesuffix(".rst") for name in made]
    tree = ["", ".. toctree::", "", *(f"   {name}" for name in listed), ""]
    made["api/index.rst"] = "\n".join([*_heading("API reference"), _INTRODUCTION, *tree])
    return made


_INTRODUCTION = """
Everything here is reached as ``symasym.NAME``, but for derivations and figures, whose modules their
pages name. Inputs are scaled unless they are said to be physical, and a number in quotes is exact.
"""


def _heading(title: str) -> list[str]:
    return [title, "=" * len(title), ""]


# What a class has of its own and of a class of the project, and not of str or a NamedTuple.
_CLASS = ("   :members:", "   :inherited-members: str, tuple", "   :show-inheritance:")


def _page(title: str, module: str, names: list[str]) -> str:
    lines = [*_heading(title), f".. currentmodule:: {module}", ""]
    for name in names:
        value = getattr(import_module(module), name)
        if isinstance(value, type) and issubclass(value, Exception):
            lines += [f".. autoexception:: {name}", ""]
        elif inspect.isclass(value):
            lines += [f".. autoclass:: {name}", *_CLASS, ""]
        elif callable(value):
            lines += [f".. autofunction:: {name}", ""]
    return "\n".join(lines)
