"""Functions in Python that are written into a file: their text, and their names in a language."""

from __future__ import annotations

import ast
import inspect
import re
from collections.abc import Mapping
from types import ModuleType

__all__ = ["kernel_of", "named"]


def kernel_of(*modules: ModuleType, flags: Mapping[str, bool] | None = None) -> dict[str, str]:
    """The text of each function of the modules, without the blocks whose flag is off."""
    texts = {}
    for module in modules:
        source = inspect.getsource(module)
        lines = source.splitlines()
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef):
                text = "\n".join(lines[node.lineno - 1 : node.end_lineno])
                # A function's type has no name where the text is read.
                text = text.replace("  # fmt: skip", "").replace(": Curve", "")
                texts[node.name] = _without(text, flags or {})
    return texts


def _without(text: str, flags: Mapping[str, bool]) -> str:
    """The text with its ``if _FLAG:`` blocks kept without their first line, or left out."""
    for name, kept in flags.items():
        while block := re.search(rf"^( *)if {name}:\n((?:\1 .*\n|\n)+)", f"{text}\n", re.MULTILINE):
            inner = re.sub(r"^    ", "", block[2], flags=re.MULTILINE) if kept else ""
            text = (text[: block.start()] + inner + f"{text}\n"[block.end() :]).rstrip("\n")
    return text


def named(name: str, target: str) -> str:
    """The name of a table or a function of a kernel in the language."""
    if target not in ("c", "javascript"):
        return name
    first, *more = name.strip("_").lower().split("_")
    if target == "c":
        return "_".join([first, *more, ""])
    return "".join([first, *(part.capitalize() for part in more)])
