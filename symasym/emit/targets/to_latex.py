"""LaTeX for \\input; needs amsmath."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import sympy

from symasym.derivation.chain import RELATIONS
from symasym.derivation.printing import tex
from symasym.emit.forms import as_printed
from symasym.emit.program import Function, Program, Ready, header
from symasym.emit.writing import comment

NAMES = {
    "slope_well": "A'(u_1)", "slope_barrier": "A'(u_2)", "barrier": "D", "V1": "V(1)", "V0": "V(0)",
    "V_well": "V(u_1)", "a_minus": "a^-", "a_plus": "a^+", "drift0": r"\phi(0)", "ell": r"\ell",
    "lam": r"\lambda", "z0": "z_0",
}  # fmt: skip
# Parts of an expansion are called by words.
_WORDS = {"start", "well", "barrier", "kink", "end", "between", "beyond"}


def render(program: Program, _: list[Ready]) -> str:
    """The file: the formula as it is derived, then the functions that it does not state itself.

    One that a step of the derivation states is written as there, in the formula's symbols.
    """
    # The drift stands beside a formula that holds it.
    general = not program.folded or any(f.first_passage for f in program.functions)
    parts = [_block("equation*", program.latex)] if general and program.latex else []
    for function in program.functions:
        if general and function.latex is not None and not program.folded:
            step = _block("equation*", function.latex)
            parts += [step] if function.latex not in program.latex and step not in parts else []
            continue
        parts.append(_block("equation*", _function(function)))
        shared = dict.fromkeys(part for case in function.cases for part in case.shared)
        if shared:
            rows = (f"{_tex(s)} &= {_tex(e)}" for s, e in shared)
            parts.append(_block("align*", " \\\\\n".join(rows)))
    equations = "\n\n".join(parts)
    top = comment([re.sub(r"%", r"\\%", line) for line in header(program)], "%")
    return "\n".join([*top, "", equations, ""])


def _block(name: str, body: str) -> str:
    return f"\\begin{{{name}}}\n{body}\n\\end{{{name}}}"


def _function(function: Function) -> str:
    name = rf"\mathrm{{{function.name}}}".replace("_", r"\_")
    if function.quadrature is not None:
        q = function.quadrature
        ends = f"{{{_tex(q.lower)}}}^{{{_tex(q.upper)}}}"
        return rf"{name} = \log \int_{ends} {_tex(sympy.exp(q.exponent))} \, du"
    if function.first_passage is not None:
        return rf"\phi(u) = {_tex(function.first_passage.drift)} \quad (|u| \le 1)"
    if len(function.cases) == 1 and not function.cases[0].conditions:
        values = function.cases[0].values
        if len(function.left) != len(values):
            return f"{name} = {_values(values)}"
        return r" ,\quad ".join(
            f"{left} {'' if left.endswith(RELATIONS) else '= '}{_tex(value, function.names)}"
            for left, value in zip(function.left, values, strict=True)
        )
    rows = []
    for case in function.cases:
        asked = r",\ ".join(_tex(c) for c in case.conditions) or r"\text{otherwise}"
        rows.append(rf"{_values(case.values)} , & {asked}")
    inside = " \\\\\n".join(rows)
    return f"{name} = \\begin{{cases}}\n{inside}\n\\end{{cases}}"


def _values(values: tuple[Any, ...]) -> str:
    return r" ,\quad ".join(_tex(v) for v in values)


def _tex(e: Any, shown: Mapping[str, str] = NAMES) -> str:
    e = as_printed(e)
    # Numbers of the program have more digits than a reader wants.
    e = e.xreplace({x: sympy.Float(x, 20) for x in e.atoms(sympy.Float)})
    names = {s: shown[s.name] for s in e.free_symbols if s.name in shown}
    for s in e.free_symbols - set(names):
        if s.name.split("_")[0] in _WORDS:
            names[s] = rf"\mathrm{{{s.name.replace('_', chr(92) + ' ')}}}"
    return tex(e, names)
