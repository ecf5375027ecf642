"""Library code that computes a derived formula without the emitted one, whatever its letters.

Expressions of three to six numbers are compared by their values over all ways to give these
numbers to their names, so that neither the names nor the order nor the form of a formula counts.
Local variables are put in where they are assigned once. What has fewer than `_LEAST` operations is
no formula that could be told from another one: with three, x y - z w is one.
"""

from __future__ import annotations

import ast
import itertools
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symasym

ROOT = Path(symasym.__file__).parent
_LEAST = 4
_NUMBERS = (0.5881, 1.2763, 0.8317, 1.7139, 2.2361, 0.4142)
_FUNCTIONS = {
    "sqrt": lambda x: np.sqrt(np.abs(x)),
    "exp": np.exp,
    "log": lambda x: np.log(np.abs(x)),
    "log1p": lambda x: np.log(np.abs(1 + x)),
    "expm1": np.expm1,
    "tanh": np.tanh,
    "abs": np.abs,
}
_OPERATIONS = {
    ast.Add: np.add, ast.Sub: np.subtract, ast.Mult: np.multiply, ast.Div: np.divide,
    ast.Pow: lambda x, y: np.power(np.abs(x) if np.ndim(y) or y % 1 else x, y),
}  # fmt: skip
#: What is written by hand all the same, and why.
_NUMBER_FIELD = "products and quotients of a + b sqrt(D)"
ALLOWED = {
    "workshop/problems.py constant_drift": "symasym verify's, which shares nothing with engines",
    "workshop/problems.py time": "part of that",
    "formulas/uniform_series.py __mul__": _NUMBER_FIELD,
    "formulas/uniform_series.py __truediv__": _NUMBER_FIELD,
    "emit/kernels/exact.py _crossed": "a sum of errors, x y + z w y",
    "series/local.py steepness": "over any ring",
    "release/expansions.py expanded": "the motion of both slow variables, x y + z w v",
}


class _Expression:
    """An expression of a function, its local variables put in."""

    def __init__(self, node: ast.expr, local: dict[str, ast.expr]) -> None:
        self.local, self.atoms, self.operations = local, dict[str, int](), 0
        self._count(node, ())
        self.node = node

    def _count(self, node: ast.expr, inside: tuple[str, ...]) -> None:
        if self.operations > 60:
            return
        match node:
            case ast.BinOp(left, op, right) if type(op) in _OPERATIONS:
                self.operations += 1
                self._count(left, inside)
                self._count(right, inside)
            case ast.UnaryOp(ast.USub(), inner):
                self._count(inner, inside)
            case ast.Constant(int() | float()):
                pass
            case ast.Name(name) if name in self.local and name not in inside:
                self._count(self.local[name], (*inside, name))
            case ast.Call() if _called(node):
                self.operations += 1
                self._count(node.args[0], inside)
            case ast.Attribute(_, "pi" | "euler"):
                pass
            case _:
                self.atoms.setdefault(ast.unparse(node), len(self.atoms))

    def told(self) -> bool:
        """Whether there is enough of it to be known by."""
        return _LEAST <= self.operations <= 60 and 3 <= len(self.atoms) <= len(_NUMBERS)

    def signature(self) -> tuple[float, ...]:
        """Sums over all ways to give the numbers to the names."""
        numbers = np.array(list(itertools.permutations(_NUMBERS[: len(self.atoms)]))).T
        with np.errstate(all="ignore"):
            values = np.asarray(self._value(self.node, numbers, ())) + 0 * numbers[0]
        # A sign more or less is another convention.
        values = np.sort(np.abs(values))
        return len(self.atoms), *(float(f"{np.sum(values**p):.9g}") for p in (1, 2))

    def _value(self, node: ast.expr, numbers: Any, inside: tuple[str, ...]) -> Any:
        match node:
            case ast.BinOp(left, op, right) if type(op) in _OPERATIONS:
                return _OPERATIONS[type(op)](
                    self._value(left, numbers, inside), self._value(right, numbers, inside)
                )
            case ast.UnaryOp(ast.USub(), inner):
                return -self._value(inner, numbers, inside)
            case ast.Constant(int() | float()):
                return float(node.value)
            case ast.Name(name) if name in self.local and name not in inside:
                return self._value(self.local[name], numbers, (*inside, name))
            case ast.Call() if name := _called(node):
                return _FUNCTIONS[name](self._value(node.args[0], numbers, inside))
            case ast.Attribute(_, "pi"):
                return np.pi
            case ast.Attribute(_, "euler"):
                return np.euler_gamma
        return numbers[self.atoms[ast.unparse(node)]]


def _called(node: ast.Call) -> str:
    """The function of one argument that is called, by its name in any library."""
    name = getattr(node.func, "attr", getattr(node.func, "id", ""))
    return name if name in _FUNCTIONS and len(node.args) == 1 and not node.keywords else ""


def _functions(tree: ast.AST) -> Iterator[ast.FunctionDef]:
    return (node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef))


def _local(function: ast.FunctionDef) -> dict[str, ast.expr]:
    """The variables of a function that are assigned once, by one statement."""
    found: dict[str, list[Any]] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.setdefault(node.id, []).append(None)
    for node in ast.walk(function):
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            found[node.targets[0].id].append(node.value)
    return {name: v[1] for name, v in found.items() if len(v) == 2 and v[1] is not None}


def _expressions(tree: ast.AST) -> Iterator[tuple[str, int, _Expression]]:
    for function in _functions(tree):
        local = _local(function)
        for node in ast.walk(function):
            if isinstance(node, ast.BinOp):
                expression = _Expression(node, local)
                if expression.told():
                    yield function.name, node.lineno, expression


@cache
def _emitted() -> dict[tuple[float, ...], str]:
    """Signatures of what each emitted function returns."""
    found = {}
    for path in (ROOT / "generated").glob("*formulas.py"):
        for function in _functions(ast.parse(path.read_text(encoding="utf-8"))):
            returned = [n.value for n in ast.walk(function) if isinstance(n, ast.Return)]
            # Protocols return nothing.
            for piece in (e for r in returned for e in getattr(r, "elts", [r])):
                expression = _Expression(piece, _local(function))
                if expression.told():
                    found[expression.signature()] = function.name
    return found


def _retyped(text: str, where: str) -> list[str]:
    """Expressions in a text that are emitted formulas."""
    return [
        f"{where} {name}:{line}: {_emitted()[signature]}"
        for name, line, expression in _expressions(ast.parse(text))
        if (signature := expression.signature()) in _emitted()
    ]


def test_no_derived_formula_is_written_by_hand():
    assert len(_emitted()) > 20
    found = []
    for path in sorted(ROOT.rglob("*.py")):
        where = path.relative_to(ROOT).as_posix()
        if not where.startswith("generated/"):
            found += _retyped(path.read_text(encoding="utf-8"), where)
    assert {f.partition(":")[0] for f in found} == set(ALLOWED), "\n".join(found)


@pytest.mark.parametrize(
    "text",
    [
        # Other letters, order and form of `end_rest`, `over_pair_twice` and `over_end`.
        "def f(A, g, b, d, v, q):\n    top = A * b - d * (2 * b + g * d)\n"
        "    return top / (q + v) / q / v",
        "def f(a, s, b, x, y):\n    z = c.pi * s\n"
        "    return z * z * (x * a * a - y * (b * s) ** 2)",
        "def f(p, i, t, L, d, r):\n    return p / L * (p * (i - np.log(t)) - d * r)",
    ],
)
def test_a_formula_is_known_in_other_letters(text):
    assert _retyped(text, "mine")
    assert not _retyped(text.replace("return ", "return 3 * "), "mine")
