"""An expansion as functions: no exponential overflows, and its logarithm is finite where it is not.

Each sum of exponentials is scaled by its largest e^(lam h); products and quotients add up and
subtract these heights, so that log f = lam h + log c. Everything else is given step by step, as in
`symasym.Expansion.definitions`.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.emit.emit import LAM, Function, own, plain


class Scaled:
    """Expressions as c e^(lam h), with a symbol for the h and the c of each sum.

    `known` is what each symbol stands for, those of the sums' heights and coefficients among them.
    """

    def __init__(self, known: Mapping[Symbol, Expr]) -> None:
        self.known, self._made = dict(known), dict[Expr, tuple[Expr, Expr]]()

    def of(self, e: Expr, name: str = "") -> tuple[Expr, Expr]:
        """h and c; `name` is that of the sum."""
        if e not in self._made:
            self._made[e] = self._of(e, name)
        return self._made[e]

    def _of(self, e: Expr, name: str) -> tuple[Expr, Expr]:
        if e in self.known and self._exponential(e):
            return self.of(self.known[e], str(e))
        if isinstance(e, sympy.exp):
            height = sympy.expand(e.args[0] / LAM)
            return (S.Zero, e) if height.has(LAM) else (height, S.One)
        if e.is_Pow and e.exp.is_Integer and self._exponential(e.base):
            height, c = self.of(e.base)
            return e.exp * height, c**e.exp
        if e.is_Mul:
            parts = [self.of(a) for a in e.args]
            return sympy.expand(sum(h for h, _ in parts)), sympy.Mul(*(c for _, c in parts))
        if e.is_Add and self._exponential(e):
            return self._sum([self.of(a) for a in e.args], name)
        return S.Zero, self._leaf(e)

    def _leaf(self, e: Expr) -> Expr:
        """The c of what has no exponential."""
        return e

    def _exponential(self, e: Expr) -> bool:
        """True where an expression has exponentials of lam, perhaps in its symbols."""
        return any(x.has(LAM) for x in e.atoms(sympy.exp)) or any(
            self._exponential(self.known[s]) for s in e.free_symbols if s in self.known
        )

    def _sum(self, parts: list[tuple[Expr, Expr]], name: str) -> tuple[Expr, Expr]:
        heights: dict[Expr, Expr] = {}
        for h, c in parts:
            heights[h] = heights.get(h, S.Zero) + c
        if len(heights) == 1:
            return next(iter(heights.items()))
        name = name or str(sum(s.name.startswith("top(") for s in self.known))
        top, total = Symbol(f"top({name})", real=True), Symbol(f"sum({name})", real=True)
        self.known[top] = sympy.Max(*heights, evaluate=False)
        shares = (c * sympy.exp(LAM * (h - top)) for h, c in heights.items())
        self.known[total] = sympy.Add(*shares)
        return top, total


def of_expansion(e: Any, numbers: Mapping[Symbol, Expr], name: str) -> list[Function]:
    """The functions of an expansion: its logarithm first in weak noise.

    They give nan where a condition ``a > b`` without noise does not hold, as for r < 1. `numbers` are
    those of a bound drift's symbols.
    """

    def printed(v: Expr) -> Expr:  # erfc stands beside exponentials, and of a square root
        return plain(v.replace(sympy.erfc, lambda x: sympy.exp(-(x**2)) * own("erfcx")(x)))

    known = {s: printed(v) for s, v in {**e.definitions, **numbers}.items()}
    complement, by_logarithm = e.quantity == "P" and e.noise == "weak", e.noise != "uniform"
    value = printed(1 - e.formula if complement else e.formula)
    if by_logarithm:
        scaled = Scaled(known)
        height, c = scaled.of(value)
        value, known = LAM * height + sympy.log(c), scaled.known
    rows: dict[Symbol, Expr] = {}

    def visit(expression: Expr) -> None:
        for s in sorted(expression.free_symbols - rows.keys(), key=str):
            if s in known and s not in rows:
                visit(known[s])
                rows[s] = known[s]

    visit(value)
    met = set(rows).union(value.free_symbols, *(v.free_symbols for v in rows.values()))
    signs = [c for c in e.conditions if isinstance(c, (sympy.StrictGreaterThan, sympy.StrictLessThan))]
    signs = [c for c in signs if c.free_symbols <= met | known.keys() and not c.has(LAM)]
    for c in signs:
        visit(c)
    value = sympy.Piecewise((value, sympy.And(*signs)), (sympy.nan, True))
    free = set().union(value.free_symbols, *(v.free_symbols for v in rows.values())) - rows.keys()
    _refuse(e, free, rows.values())
    words: dict[Symbol, str] = {}
    for s in (*sorted(free, key=str), *rows):
        word = plain_name(s.name)
        while word in (*words.values(), name, f"log_{name}") or re.fullmatch(r"t\d*", word):
            word += "_"
        words[s] = word
    named = {s: Symbol(word, **s._assumptions_orig) for s, word in words.items()}
    shared = tuple((named[s], v.xreplace(named)) for s, v in rows.items())
    arguments = tuple(sorted((named[s] for s in free), key=str))
    about = f"{e.quantity} of {e.drift!r}, {e.noise} noise to order {e.order}, case '{e.case}'"
    about += f", where {', '.join(map(str, signs))}." if signs else "."
    value = value.xreplace(named)
    if by_logarithm:
        value = 1 - sympy.exp(value) if complement else sympy.exp(value)
    return [Function(name, arguments, (value,), about, shared)]


def _refuse(e: Any, free: set[Symbol], expressions: Any) -> None:
    """Refuse complex numbers, and integrals without a closed form."""
    names = ", ".join(e.drift.free) or "y"
    if any(x.has(sympy.Integral) or "FinitePart" in str(x) for x in expressions):
        raise InputError(
            f"A = {e.drift.expression()} is no polynomial in u, so that V and the regular part "
            f"have no closed form in {names}; bind all parameters, or call sa.stationary_density."
        )
    if odd := [s for s in free if s in e.equations and not s.is_real]:
        raise InputError(f"{odd[0]} may be complex, which code has no numbers for; bind {names}.")


def plain_name(name: str) -> str:
    """``V''(u1)`` as ``V2_u1``, ``V^(4)(0)`` as ``V4_0``, ``V''(-1)`` as ``V2_m1``."""
    word = re.sub(r"'+", lambda m: str(len(m[0])), name).replace("^(", "")
    return re.sub(r"\W+", "_", word.replace("-", "m").replace("+", "p")).strip("_")
