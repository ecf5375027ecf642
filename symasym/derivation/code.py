"""Readable Python from SymPy expressions: NumPy, or an mpmath context."""

from __future__ import annotations

import textwrap
from typing import Any

import sympy
from sympy.printing.str import StrPrinter

from symasym.derivation.results import parts

TARGETS = ("numpy", "mpmath")
_KNOWN = {"exp": "exp", "log": "log", "tanh": "tanh", "sin": "sin", "cos": "cos"}


class NotEmittable(ValueError):
    """The expression holds something that has no elementary value."""


class _Printer(StrPrinter):  # type: ignore[misc]
    """SymPy's string printer with the functions of one library."""

    def __init__(self, target: str, names: dict[Any, str]) -> None:
        super().__init__({"order": "none"})
        self.prefix = {"numpy": "np", "mpmath": "ctx"}[target]
        self.target, self.names = target, names

    def _print_Symbol(self, expr: Any) -> str:
        return self.names.get(
            expr,
            str(expr.name).replace("_", "")
            if "_" in expr.name and expr.name[-1].isdigit()
            else str(expr.name),
        )

    def _print_Pi(self, expr: Any) -> str:
        return f"{self.prefix}.pi"

    def _print_Rational(self, expr: Any) -> str:
        if expr.q == 1:
            return str(expr.p)
        # A quotient of Python ints would be a float64: let the context divide.
        return f"{expr.p}/{expr.q}" if self.target == "numpy" else f"ctx.mpf({expr.p})/{expr.q}"

    def _print_Function(self, expr: Any) -> str:
        name = _KNOWN.get(type(expr).__name__)
        if name is None:
            raise NotEmittable(f"{expr} has no closed form to emit.")
        return f"{self.prefix}.{name}({self._print(expr.args[0])})"

    def _print_Pow(self, expr: Any, rational: bool = False) -> str:
        base, exponent = expr.base, expr.exp
        if exponent == sympy.Rational(1, 2):
            return f"{self.prefix}.sqrt({self._print(base)})"
        if exponent == sympy.Rational(-1, 2):
            return f"1/{self.prefix}.sqrt({self._print(base)})"
        if exponent.is_Integer:
            return str(super()._print_Pow(expr, rational=False))
        return f"{self.parenthesize(base, 60)}**({self._print(exponent)})"

    def _print_ExpBase(self, expr: Any) -> str:
        return f"{self.prefix}.exp({self._print(expr.args[0])})"

    _print_exp = _print_ExpBase


def code(expression: Any, target: str, names: dict[Any, str] | None = None) -> str:
    """One expression, or a tuple of them, as Python source.

    Raises
    ------
    NotEmittable
        If it holds an undefined function, an integral or the like.
    """
    pieces = parts(expression)
    for piece in pieces:
        if piece.atoms(sympy.Integral, sympy.Derivative, sympy.core.function.AppliedUndef):
            raise NotEmittable(f"{piece} has no closed form to emit.")
    printer = _Printer(target, names or {})
    return ", ".join(str(printer.doprint(piece)) for piece in pieces)


def function(
    name: str,
    arguments: list[Any],
    expression: Any,
    target: str,
    doc: str,
    names: dict[Any, str] | None = None,
) -> str:
    """A function of `arguments` that returns `expression`, with a docstring."""
    names = names or {}
    shown = [names.get(a, code(a, target)) for a in arguments]
    missing = {s for e in parts(expression) for s in e.free_symbols} - set(arguments)
    if missing:
        raise NotEmittable(f"{name} needs {', '.join(sorted(map(str, missing)))} as arguments.")
    first = ["ctx: Any"] if target == "mpmath" else []
    signature = ", ".join([*first, *(f"{a}: Any" for a in shown)])
    head = f"def {name}({signature}) -> Any:"
    if len(head) > 100:
        head = f"def {name}(\n    {signature}\n) -> Any:"
    body = code(expression, target, names)
    if len(body) > 88:
        # Lines are broken at spaces; a long product has none of its own.
        spaced = body if len(max(body.split(), key=len)) < 80 else body.replace(")*", ") * ")
        wrapped = textwrap.fill(spaced, 88, break_long_words=False, break_on_hyphens=False)
        body = f"(\n{textwrap.indent(wrapped, ' ' * 8)}\n    )"
    return f'{head}\n    """{doc}"""\n    return {body}\n'
