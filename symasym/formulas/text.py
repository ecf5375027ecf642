"""The lines of a formula in LaTeX, as an author writes it."""

from __future__ import annotations

import re

import sympy
from sympy import Expr

from symasym.derivation.tex import tex

# Characters on a line of A4 in small type, and operations worth reducing.
_WIDE, _FEW = 125, 40
_KNOWN = {"lam": r"\lambda", "phi(-1)": "a^-", "phi(1)": "a^+"}


def name_of(name: str) -> str:
    """LaTeX of a symbol: W1 as W_1, E0- as E_0^-, V^(4)(u1) as V^{(4)}(u_1), sigma(u1)."""
    if name[0] == "V" or name.startswith("sigma("):
        name = name.replace("sigma", r"\sigma")
        return re.sub(r"u(\d+)", r"u_{\1}", re.sub(r"\^\((\d+)\)", r"^{(\1)}", name))
    if parts := re.fullmatch(r"([A-Za-z])(\d*)([-+]?)([-+]?)", name):
        head, place, *sides = parts.groups()
        low, high = (place, sides[0]) if place else sides
        return head + f"_{{{low}}}" * bool(low) + f"^{{{high}}}" * bool(high)
    return _KNOWN.get(name) or tex(sympy.Symbol(name))


def latex(e: Expr, names: dict[str, str]) -> str:
    """The expression, a polynomial or a small rational function in the fewest operations."""
    forms = [e]
    if e.is_polynomial() and not e.has(sympy.Integral):
        forms.append(sympy.expand(e))
        if not (short := sympy.factor_terms(forms[1])).as_coeff_Mul()[1].is_Add:
            forms.append(short)
    elif e.is_rational_function() and e.count_ops() < _FEW:
        forms.append(sympy.cancel(e))
    return tex(min(forms, key=sympy.count_ops), names)


def lines(left: str, relation: str, value: Expr, names: dict[str, str]) -> list[str]:
    """An equation in as many lines as it needs, a sum broken between its terms."""
    rows, parts = [f"{left} &{relation} "], [latex(value, names)]
    if value.is_Add and _width(rows[0] + parts[0]) > _WIDE:
        parts = [latex(term, names) for term in value.as_ordered_terms()]
    for k, part in enumerate(parts):
        if k and _width(rows[-1] + part) > _WIDE:
            rows.append(r"&\quad ")
        rows[-1] += f"{'' if part.startswith('-') or not k else '+ '}{part} "
    return [row.rstrip() for row in rows]


def _width(text: str) -> int:
    """Characters of a line, about."""
    shown = re.sub(r"\\(left|right|quad|frac|sqrt|mathrm)|[&\s{}^_]", "", text)
    return len(re.sub(r"\\[A-Za-z]+", "x", shown))
