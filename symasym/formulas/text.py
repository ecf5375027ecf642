"""The lines of a formula in LaTeX, as an author writes it."""

from __future__ import annotations

import re

import sympy
from sympy import Expr

from symasym.derivation.tex import tex

# Characters on a line of A4 in small type, and operations worth reducing.
_WIDE, _FEW = 125, 40


def name_of(name: str) -> str:
    """LaTeX of a symbol: W1 as W_{1}, E0- as E_{0}^-, V^(4)(u1) as V^{(4)}(u_{1})."""
    if name in (known := {"lam": r"\lambda", "phi(-1)": "a^-", "phi(1)": "a^+"}):
        return known[name]
    if name[0] == "V":
        return re.sub(r"u(\d+)", r"u_{\1}", re.sub(r"\^\((\d+)\)", r"^{(\1)}", name))
    if parts := re.fullmatch(r"([A-Za-z])(\d+|[-+])?([-+])?", name):
        head, place, side = parts.groups()
        index = f"_{{{place}}}" if place and place.isdigit() else f"_{place}" if place else ""
        return head + index + (f"^{{{side}}}" if side else "")
    return latex(sympy.Symbol(name), {})


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
    rows = [f"{left} &{relation} "]
    whole = rows[0] + latex(value, names)
    if _width(whole) <= _WIDE or not value.is_Add:
        return [whole]
    for k, term in enumerate(value.as_ordered_terms()):
        text = latex(term, names)
        if _width(rows[-1] + text) > _WIDE:
            rows.append(r"&\quad ")
        rows[-1] += f"{'' if text.startswith('-') or not k else '+ '}{text} "
    return [row.rstrip() for row in rows]


def _width(text: str) -> int:
    """Characters of a line, about, those of a fraction counted once."""
    letters = re.sub(r"\\(left|right|quad|mathrm|operatorname|sqrt|,|!)|[&\s{}_^]", "", text)
    more = 2 * len(re.findall("[-+=]", letters)) - 3 * letters.count(r"\frac")
    return len(re.sub(r"\\[A-Za-z]+", "x", letters)) + more
