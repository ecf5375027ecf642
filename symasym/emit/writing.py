"""Text of expressions, lines and comments in any language, and the helpers a file needs."""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

import sympy

from symasym.base.errors import InputError
from symasym.derivation.code import NotEmittable, Printer
from symasym.emit.program import Ready

if TYPE_CHECKING:
    from sympy import Expr

_WIDTH = 96
#: A helper, or what writes it where that takes long.
Written = str | Callable[[], str]


class CodePrinter(Printer):
    """The derivations' printer, with the names of a file and with conditions."""

    def __init__(self, target: str) -> None:
        super().__init__(target, {})

    def _print_Symbol(self, expr: Expr) -> str:
        return str(self.names.get(expr, expr.name))

    def _print_Float(self, expr: Expr) -> str:
        number = str(super()._print_Float(expr))
        # Python would read it as a double.
        return f'ctx.mpf("{number}")' if self.target == "mpmath" else number

    def _print_EulerGamma(self, expr: Expr) -> str:
        return "ctx.euler" if self.target == "mpmath" else str(float(expr))

    def _print_Exp1(self, expr: Expr) -> str:
        return str(self._call("exp", sympy.S.One))

    def _print_Relational(self, expr: Expr) -> str:
        sign = {"Eq": "==", "Ne": "!="}.get(type(expr).__name__, expr.rel_op)
        return f"{self._print(expr.lhs)} {sign} {self._print(expr.rhs)}"

    def _print_CalledBase(self, expr: Expr) -> str:
        first, mark = (["ctx"], "_") if self.target == "mpmath" else ([], "")
        arguments = [*first, *(self._print(a) for a in expr.args)]
        return f"{mark}{type(expr).__name__}({', '.join(arguments)})"

    _print_Equality = _print_Unequality = _print_Relational
    _print_StrictLessThan = _print_LessThan = _print_Relational
    _print_StrictGreaterThan = _print_GreaterThan = _print_Relational


def text(e: Expr, target: str) -> str:
    """An expression or a condition in the target's language."""
    try:
        return str(CodePrinter(target).doprint(e))
    except NotEmittable as error:
        raise InputError(f"{str(error).rstrip('.')}; use the function that evaluates it.") from None


def wrapped(
    first: str, code: str, indent: str, *, end: str = "", brackets: str = "", deeper: str = "    "
) -> list[str]:
    """``first code end`` on one line, or broken at spaces, in brackets, where it is too long.

    `brackets` are there in any case; round ones only where they are needed.
    """
    line = f"{indent}{first}{brackets[:1]}{code}{brackets[1:]}{end}"
    if len(line) <= _WIDTH:
        return [line]
    opening, closing = tuple(brackets or "()")
    lines = _broken(code, _WIDTH - len(indent) - len(deeper))
    return [
        f"{indent}{first}{opening}",
        *(f"{indent}{deeper}{part}" for part in lines),
        f"{indent}{closing}{end}",
    ]


def _broken(code: str, width: int) -> list[str]:
    """Lines of at most `width` characters."""
    return textwrap.wrap(code, width, break_long_words=False, break_on_hyphens=False)


def heading(first: str, arguments: list[str], last: str) -> list[str]:
    """The first line of a function, or its lines where the arguments need more."""
    listed = ", ".join(arguments)
    if len(first) + len(listed) + len(last) + 2 <= _WIDTH:
        return [f"{first}({listed}){last}"]
    return [f"{first}(", *(f"    {part}" for part in _broken(listed, _WIDTH - 4)), f"){last}"]


def comment(lines: list[str], mark: str) -> list[str]:
    """Lines of text as comments, broken at spaces."""
    broken = []
    for line in lines:
        # What users wrote must not end the comment.
        line = re.sub(r"\s+", " ", line.replace("*/", "* /").replace("..", "."))
        broken += textwrap.wrap(
            line,
            _WIDTH,
            initial_indent=f"{mark} ",
            subsequent_indent=f"{mark}   ",
            break_long_words=False,
            break_on_hyphens=False,
        )
    return broken


def helpers(code: str, known: Mapping[str, Written]) -> list[str]:
    """Helpers, of the `known` ones, that the code calls, and that these call."""
    called: list[str] = []
    seen: set[str] = set()

    def look(where: str) -> None:
        """Append the helpers whose names stand in the text, those that they call before them."""
        for name, written in known.items():
            if name not in seen and re.search(rf"(?<!\w)(?<!\w\.){re.escape(name)}\b", where):
                seen.add(name)
                source = written if isinstance(written, str) else written()
                look(source)
                called.append(source)

    look(code)
    return called


def signature_doc(function: Ready) -> str:
    """The first line of a docstring."""
    return function.doc if function.doc.endswith(".") else f"{function.doc}."


def argument_values(function: Ready, form: str) -> str:
    """The arguments' values as the language puts them into text: NAME in `form` is a name."""
    values = [f"{name} is {form.replace('NAME', name)}" for name in function.arguments]
    return f"{', '.join(values)}: " if values else ""


def refusal(function: Ready) -> list[str]:
    """The lines that raise in Python where no case holds."""
    lines = [f'f"{argument_values(function, "{NAME}")}"', f'"{function.outside}"']
    return ["    raise ValueError(", *(f"        {line}" for line in lines), "    )"]
