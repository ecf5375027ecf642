"""Functions in Python that are written into a file: their text, and their names in a language.

Kernels are written for doubles as they stand (`kernel_of`). Formulas of the library that run over
any arithmetic (`symasym.numbers.arithmetic`) are made into such functions by `in_doubles`.
"""

from __future__ import annotations

import ast
import inspect
import math
import re
import textwrap
from collections.abc import Callable, Iterable, Mapping
from types import ModuleType
from typing import Any

from symasym.numbers.arithmetic import FLOATS

__all__ = ["in_doubles", "kernel_of", "named"]


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


def in_doubles(functions: Iterable[Callable[..., Any]]) -> dict[str, str]:
    """The text of formulas over an arithmetic, their first argument, as functions of doubles.

    What has several values stores them in a list, the last argument.
    """
    texts = {}
    for function in functions:
        (tree,) = ast.parse(textwrap.dedent(inspect.getsource(function))).body
        assert isinstance(tree, ast.FunctionDef)
        head, body = ast.unparse(_InDoubles(tree, function.__globals__).visit(tree)).split("\n", 1)
        if len(head) > 100:
            first, arguments, result = re.split(r"\((?=\w)|\)(?= ->)", head)
            lines = textwrap.wrap(f"{arguments},", 92)
            head = "\n    ".join([f"{first}(", *lines]) + f"\n){result}"
        texts[tree.name] = f"{head}\n{body}"
    return texts


class _InDoubles(ast.NodeTransformer):
    """One formula without its arithmetic."""

    def __init__(self, tree: ast.FunctionDef, known: Mapping[str, Any]) -> None:
        self.own, self.known = tree.args.args[0].arg, known

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        several = any(isinstance(x, ast.Return) and isinstance(x.value, ast.Tuple)
                      for x in ast.walk(node))  # fmt: skip
        node.args.args = node.args.args[1:]
        for argument in node.args.args:
            argument.annotation = ast.Name("float")
        if several:
            node.args.args.append(ast.arg("result", ast.parse("list[float]", mode="eval").body))
        node.returns = ast.Constant(None) if several else ast.Name("float")
        self.generic_visit(node)
        return node

    def visit_Return(self, node: ast.Return) -> Any:
        self.generic_visit(node)
        if not isinstance(node.value, ast.Tuple):
            return node
        values = enumerate(map(ast.unparse, node.value.elts))
        return [ast.parse(f"result[{k}] = {value}").body[0] for k, value in values]

    def visit_Name(self, node: ast.Name) -> ast.expr:
        value = self.known.get(node.id)
        return ast.Constant(value) if isinstance(value, int | float) else node

    def visit_BinOp(self, node: ast.BinOp) -> ast.expr:
        """A whole power of a name is a product."""
        self.generic_visit(node)
        if not isinstance(node.op, ast.Pow):
            return node
        assert isinstance(node.left, ast.Name | ast.Attribute), ast.unparse(node)
        times = ast.literal_eval(node.right)
        assert isinstance(times, int), ast.unparse(node)
        product: ast.expr = node.left
        for _ in range(times - 1):
            product = ast.BinOp(product, ast.Mult(), node.left)
        return product

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        """A number of the arithmetic."""
        if hasattr(math, node.attr):
            return ast.Attribute(ast.Name("math"), node.attr)
        return ast.Constant(getattr(FLOATS, node.attr))

    def visit_Call(self, node: ast.Call) -> ast.expr:
        arguments = [self.visit(a) for a in node.args]
        if not isinstance(node.func, ast.Attribute):
            kept = [a for a in arguments if not (isinstance(a, ast.Name) and a.id == self.own)]
            return ast.Call(node.func, kept, [])
        name = node.func.attr
        if name in ("any", "all"):
            return arguments[0]  # type: ignore[no-any-return]
        if name == "where":
            return ast.IfExp(*arguments)
        if name == "rational":
            return ast.BinOp(arguments[0], ast.Div(), arguments[1]) if arguments[1:] else (
                ast.Constant(float(arguments[0].value)))  # fmt: skip
        if name in ("maximum", "minimum"):
            return ast.Call(ast.Name(name[:3]), arguments, [])
        assert hasattr(math, name), name
        return ast.Call(ast.Attribute(ast.Name("math"), name), arguments, [])


def named(name: str, target: str) -> str:
    """The name of a table or a function of a kernel in the language."""
    if target not in ("c", "javascript"):
        return name
    first, *more = name.strip("_").lower().split("_")
    if target == "c":
        return "_".join([first, *more, ""])
    return "".join([first, *(part.capitalize() for part in more)])
