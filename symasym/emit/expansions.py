"""The functions of an expansion, in which no exponential overflows even where its value does.

Each sum of exponentials is scaled by its largest e^(lam h), and products and quotients add and
subtract these heights, so that log f = lam h + log c. Everything else follows step by step, as in
`symasym.Expansion.definitions`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.emit.printing import LAM, Function, plain


class Exponentials:
    """Expressions as c e^(lam h), with symbols for the h and the c of each sum.

    `known` defines every symbol, including these. Heights that may be large are subtracted from
    each other only where they are equal.
    """

    def __init__(self, known: Mapping[Symbol, Expr]) -> None:
        self.known = dict(known)

    def named(self, e: Expr, head: str = "h") -> Expr:
        """The expression if it is a symbol or a number, otherwise a symbol for it."""
        if e.is_Symbol or e.is_Number:
            return e
        same = (s for s, v in self.known.items() if v == e and s.name.startswith(head))
        symbol = next(same, Symbol(f"{head}{len(self.known)}", real=True))
        self.known[symbol] = e
        return symbol

    def grows(self, e: Expr) -> bool:
        """True if the expression, or a symbol in it, contains exponentials of lam."""
        return any(x.has(LAM) for x in e.atoms(sympy.exp)) or any(
            self.grows(self.known[s]) for s in e.free_symbols if s in self.known
        )

    def of(self, e: Expr) -> tuple[Expr, Expr]:
        """The height h and the factor c of an expression."""
        if not self.grows(e):
            return S.Zero, e
        if e in self.known:
            return self.of(self.known[e])
        if isinstance(e, sympy.exp):
            return expanded(e.args[0] / LAM), S.One
        if e.is_Pow:
            height, c = self.of(e.base)
            return e.exp * height, c**e.exp
        if e.is_Add:
            return self._sum([self.of(a) for a in e.args])
        parts = [a for a in e.args if self.grows(a)]
        below = [a for a in parts if a.is_Pow and a.exp == -1]
        above = [a for a in parts if a not in below]
        rest = sympy.Mul(*(a for a in e.args if a not in parts))
        if below and (sums := [a for a in above if a.is_Add]):
            others = sympy.Mul(*(a for a in e.args if a is not sums[0]))
            return self._sum([self.of(others * a) for a in sums[0].args])
        # First the factors that are a part of the denominator, as their heights may be equal.
        above.sort(key=lambda a: not (below and a in below[0].base.free_symbols))
        heights, factors = zip(*map(self.of, above), strict=True) if above else ((), ())
        c = rest * sympy.Mul(*factors)
        if not below:
            return expanded(sympy.Add(*heights)), c
        low, d = self.of(below[0].base)
        first = self.named(heights[0] - low) if heights else -low
        return expanded(sympy.Add(first, *heights[1:])), c / d

    def _sum(self, parts: list[tuple[Expr, Expr]]) -> tuple[Expr, Expr]:
        heights: dict[Expr, Expr] = {}
        for h, c in parts:
            h = self.named(h)
            heights[h] = heights.get(h, S.Zero) + c
        if len(heights) == 1:
            return next(iter(heights.items()))
        top = self.named(sympy.Max(*heights, evaluate=False), "top")
        shares = (c * sympy.exp(LAM * (h - top)) for h, c in heights.items())
        return top, self.named(sympy.Add(*shares), "sum")


def expanded(e: Expr) -> Expr:
    """The expression expanded without separating r - 1."""
    r, beyond = Symbol("r", positive=True), Symbol("r - 1", positive=True)
    return sympy.expand(e.xreplace({r: 1 + beyond})).xreplace({beyond: r - 1})


def of_expansion(e: Any, numbers: Mapping[Symbol, Expr], name: str) -> list[Function]:
    """The function of an expansion, through its logarithm except for uniform noise.

    It has no value where a condition ``a > b`` without noise fails, such as r > 1. `numbers` are
    the values of a bound drift's symbols.
    """

    known = {s: plain(v) for s, v in {**e.definitions, **numbers}.items()}
    complement = e.quantity == "P" and e.noise == "weak"
    value = plain(1 - e.formula if complement else e.formula)
    if e.noise != "uniform":
        scaled = Exponentials(known)
        height, c = scaled.of(value)
        value, known = LAM * height + sympy.log(c), scaled.known
    rows: dict[Symbol, Expr] = {}

    def visit(expression: Expr) -> None:
        for s in sorted(expression.free_symbols - rows.keys(), key=str):
            if s in known and s not in rows:
                visit(known[s])
                rows[s] = known[s]

    visit(value)
    met = value.free_symbols.union(rows, *(v.free_symbols for v in rows.values()))
    strict = (sympy.StrictGreaterThan, sympy.StrictLessThan)
    signs = [c for c in e.conditions if isinstance(c, strict) and not c.has(LAM)]
    signs = [c for c in signs if c.free_symbols <= met | known.keys()]
    visit(sympy.Tuple(*(side for c in signs for side in c.args)))
    value = sympy.Piecewise((value, sympy.And(*signs)), (sympy.nan, True))
    used = value.free_symbols.union(*(v.free_symbols for v in rows.values()))
    free = sorted(used - rows.keys(), key=str)
    if odd := [s for s in free if s in e.equations and not s.is_real]:
        raise InputError(f"{odd[0]} may be complex, which code has no numbers for; bind the drift.")
    words: dict[Symbol, str] = {}
    for s in (*free, *rows):
        words[s] = plain_name(s.name)
        while [*words.values()].count(words[s]) > 1 or words[s] in (name, f"log_{name}"):
            words[s] += "_"
    named = {s: Symbol(word, **s._assumptions_orig) for s, word in words.items()}
    shared = tuple((named[s], v.xreplace(named)) for s, v in rows.items())
    value = value.xreplace(named)
    if e.noise != "uniform":
        value = 1 - sympy.exp(value) if complement else sympy.exp(value)
    about = f"{e.quantity} of {e.drift!r}, {e.noise} noise to order {e.order}, case '{e.case}'"
    if signs:
        about += f"; it has a value where {sympy.And(*signs).xreplace(named)}, and is nan elsewhere"
    arguments = tuple(sorted((named[s] for s in free), key=str))
    return [Function(name, arguments, (value,), about, shared)]


def plain_name(name: str) -> str:
    """``V''(u1)`` as ``V2_u1``, ``V^(4)(0)`` as ``V4_0``, ``V''(-1)`` as ``V2_m1``."""
    word = re.sub(r"'+", lambda m: str(len(m[0])), name).replace("^(", "")
    return re.sub(r"\W+", "_", word.replace("-", "m").replace("+", "p")).strip("_")
