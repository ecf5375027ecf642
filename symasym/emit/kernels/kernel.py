"""Functions in Python that are written into a file, as text: which of them, and what of each."""

from __future__ import annotations

import ast
import inspect
import re
from types import ModuleType
from typing import NamedTuple

__all__ = ["Kernel", "kernel_of", "reached", "table_name"]


class Kernel(NamedTuple):
    """Text of functions in Python, by name and in an order in which they can be defined."""

    functions: dict[str, str]


def kernel_of(*modules: ModuleType) -> Kernel:
    """The functions of the modules, those that are called before those that call them."""
    found = {}
    for module in modules:
        text = inspect.getsource(module)
        lines = text.splitlines()
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef):
                rows = lines[node.lineno - 1 : node.end_lineno]
                found[node.name] = "\n".join(rows).replace("  # fmt: skip", "")
    return Kernel(found)


def reached(kernel: Kernel, first: str, flags: dict[str, bool]) -> Kernel:
    """What `first` calls, without the blocks whose flag is off."""
    texts = {name: _without(text, flags) for name, text in kernel.functions.items()}
    wanted, waiting = set(), [first]
    while waiting:
        name = waiting.pop()
        if name not in wanted:
            wanted.add(name)
            waiting += [n for n in texts if re.search(rf"\b{n}\(", texts[name])]
    return Kernel({name: text for name, text in texts.items() if name in wanted})


def _without(text: str, flags: dict[str, bool]) -> str:
    """The text with its ``if _FLAG:`` blocks kept without their first line, or left out."""
    for name, kept in flags.items():
        while found := re.search(rf"^( *)if {name}:\n((?:\1 .*\n|\n)+)", f"{text}\n", re.MULTILINE):
            inner = re.sub(r"^    ", "", found[2], flags=re.MULTILINE) if kept else ""
            text = (text[: found.start()] + inner + f"{text}\n"[found.end() :]).rstrip("\n")
    return text


def table_name(name: str, target: str) -> str:
    """A table's, or a function's, name in the language."""
    first, *rest = name.strip("_").lower().split("_")
    if target == "c":
        return "_".join([first, *rest, ""])
    return "".join([first, *(part.capitalize() for part in rest)])
