"""The parts of a file that all targets with functions have, each in its own syntax.

A `Language` is that syntax: how a constant is given, a case asked for, a value returned, and how a
function of u is handed to a helper of the file. From it `block` writes a case, `integral` and
`first_passage` the bodies of the functions that are no closed forms.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType
from typing import Any

import sympy

from symasym.emit.kernels import airy, elementary, exact, tables
from symasym.emit.kernels.kernel import kernel_of, named
from symasym.emit.kernels.transcribe import FUNCTION_IN_C, transcribed
from symasym.emit.program import Body, FirstPassage, Quadrature, Ready
from symasym.emit.writing import Written, text, wrapped


@dataclass(frozen=True)
class Language:
    """A target's syntax.

    Attributes
    ----------
    target : str
    deeper : str
        One step of indentation.
    end : str
        What a statement ends with.
    constant, numbers : str
        What stands before the name of a number that is given once, and of a list of numbers; of a
        whole number `whole`.
    brackets : str
        Those of a list.
    several : str
        Those around several values that are returned.
    function : str
        What makes a function of an expression in u; empty where that takes a function beside it.
    first : str
        The first argument of every helper.
    """

    target: str
    deeper: str = "    "
    end: str = ""
    constant: str = ""
    numbers: str = ""
    whole: str = ""
    brackets: str = "[]"
    several: str = ""
    function: str = "lambda u: "
    first: str = ""

    def text(self, e: Any) -> str:
        """An expression or a condition."""
        return text(e, self.target)

    def given(self, name: str, value: str, indent: str) -> list[str]:
        """A number under a name."""
        first = f"{self.constant}{name} = "
        return wrapped(first, value, indent, end=self.end, deeper=self.deeper)

    def listed(self, name: str, values: Sequence[str]) -> list[str]:
        """A list of numbers under a name."""
        size = f"[{max(1, len(values))}]" if self.target == "c" else ""
        # C has no empty list.
        inside = ", ".join(values) or ("0.0" if size else "")
        first, around = f"{self.numbers}{name}{size} = ", self.brackets
        return wrapped(first, inside, self.deeper, end=self.end, brackets=around,
                       deeper=self.deeper)  # fmt: skip

    def returned(self, value: str, indent: str, call: str = "", brackets: str = "") -> list[str]:
        """The value, or that of `call` with it as arguments."""
        brackets = "()" if call else brackets
        return wrapped(f"return {call}", value, indent, end=self.end, brackets=brackets,
                       deeper=self.deeper)  # fmt: skip

    def block(self, body: Body) -> list[str]:
        """A case as an ``if``, its shared parts and its value."""
        lines, indent, curly = [], self.deeper, bool(self.end)
        if body.conditions:
            asked = (" && " if curly else " and ").join(map(self.text, body.conditions))
            if self.target == "javascript":
                asked = asked.replace("==", "===").replace("!=", "!==")
            end, around = (" {", "()") if curly else (":", "")
            lines += wrapped("if ", asked, indent, end=end, brackets=around, deeper=self.deeper)
            indent += self.deeper
        for symbol, value in body.shared:
            shown = self.text(value)
            # A quotient of Python's integers would be a double.
            if self.target == "mpmath" and value.is_Integer:
                shown = f"ctx.mpf({shown})"
            lines += self.given(str(symbol), shown, indent)
        values = list(map(self.text, body.values))
        if self.target == "c" and len(values) > 1:
            for number, value in enumerate(values):
                lines += wrapped(f"out[{number}] = ", value, indent, end=";")
        else:
            around = self.several if len(values) > 1 else ""
            lines += self.returned(", ".join(values), indent, brackets=around)
        return [*lines, *([f"{self.deeper}}}"] if body.conditions and curly else [])]

    def marks(self, q: Quadrature | FirstPassage) -> list[str]:
        """Lines that give the zeros of the drift in the layer as `marks`, and their `count`."""
        if not q.coefficients:
            count = str(len(q.points))
            return [
                *self.listed("marks", list(map(self.text, q.points))),
                f"{self.deeper}{self.whole}count = {count}{self.end}",
            ]
        size = len(q.coefficients)
        empty = {
            "c": f"double marks[{size}];",
            "javascript": "const marks = [];",
        }.get(self.target, f"marks = [0.0] * {size}")
        low, high = (self.text(sympy.Integer(end)) for end in (-1, 1))
        call = f"{named('_zeros', self.target)}(c, {size}, {low}, {high}, marks)"
        return [
            *self.listed("c", list(map(self.text, q.coefficients))),
            f"{self.deeper}{empty}",
            f"{self.deeper}{self.whole}count = {call}{self.end}",
        ]

    def passed(self, function: Ready, e: Any) -> str:
        """The argument that hands a helper `e` as a function of u; C has that apart."""
        own = f"{self.function}{self.text(e)}" if self.function else f"{function.name}_at_, p"
        return f"{self.first}{own}"

    def integral(self, function: Ready, q: Quadrature) -> list[str]:
        """The body of an integral: the points between which its exponent is monotone, its value."""
        ends = f"{self.text(q.lower)}, {self.text(q.upper)}"
        value = f"{self.passed(function, q.exponent)}, marks, count, {ends}"
        call = named("_log_integral", self.target)
        return [*self.marks(q), *self.returned(value, self.deeper, call)]

    def first_passage(self, function: Ready, q: FirstPassage) -> list[str]:
        """The body of an exact time: its drift, where that is zero, its value."""
        drift = self.passed(function, q.drift)
        value = f"{drift}, ends, {self.text(q.rounding)}, marks, count, kappa, r"
        return [
            *self.listed("ends", list(map(self.text, q.ends))),
            *self.marks(q),
            *self.returned(value, self.deeper, named("_log_time", self.target)),
        ]

    def body(
        self,
        function: Ready,
        passage: Callable[[Ready, FirstPassage], list[str]],
        refusal: Callable[[Ready], list[str]],
    ) -> list[str]:
        """The body of a function: its integral, its exact time by `passage`, or its cases, with
        the `refusal` where none holds."""
        if function.quadrature:
            return self.integral(function, function.quadrature)
        if function.first_passage:
            return passage(function, function.first_passage)
        lines = [line for case in function.bodies for line in self.block(case)]
        partial = function.bodies and function.bodies[-1].conditions
        return lines + refusal(function) if partial else lines


def helpers_of(
    target: str, functions: list[Ready], own: Mapping[str, Written] = MappingProxyType({})
) -> dict[str, Written]:
    """The helpers of a file with such functions, and their tables, by the names that it calls.

    `own` are the target's in place of those of the exact time, for arrays.
    """
    return {**_exact(target), **own}


@cache
def _exact(target: str) -> dict[str, Written]:
    """Helpers of integrals and of the exact time."""
    texts = transcribed(kernel_of(elementary, airy, exact), target)
    own = {"function_": FUNCTION_IN_C} if target == "c" else {}
    constants = {**tables.GAUSS, **tables.airy(), **tables.lobatto()}
    return {**own, **tables.helpers_of(constants, target), **texts}
