"""Functions in Python that are written into a file: their text, and their names in a language.

Kernels are written for doubles as they stand (`kernel_of`).
"""

from __future__ import annotations

import ast
import inspect
from types import ModuleType

__all__ = ["kernel_of", "named"]


def kernel_of(*modules: ModuleType) -> dict[str, str]:
    """The text of each function of the modules."""
    texts = {}
    for module in modules:
        source = inspect.getsource(module)
        lines = source.splitlines()
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef):
                text = "\n".join(lines[node.lineno - 1 : node.end_lineno])
                # A function's type has no name where the text is read.
                texts[node.name] = text.replace("  # fmt: skip", "").replace(": Curve", "")
    return texts


def named(name: str, target: str) -> str:
    """The name of a table or a function of a kernel in the language."""
    if target not in ("c", "javascript"):
        return name
    first, *more = name.strip("_").lower().split("_")
    if target == "c":
        return "_".join([first, *more, ""])
    return "".join([first, *(part.capitalize() for part in more)])
