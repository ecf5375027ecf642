"""The functions of an expansion, in which no exponential overflows even where its value does.

Each sum of exponentials is scaled by its largest e^(lam h), and products and quotients add and
subtract these heights, so that log f = lam h + log c. Everything else follows step by step, as in
`symasym.Expansion.definitions`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.emit.printing import LAM, Function, own

_KAPPA = Symbol("kappa", positive=True)


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

    def of(self, e: Expr) -> tuple[Expr, Expr]:
        """The height h and the factor c of an expression; without exponentials h is 0."""
        if e in self.known:
            height, c = self.of(self.known[e])
            return height, c if height != 0 else e
        if isinstance(e, sympy.exp) and e.has(LAM):
            return expanded(e.args[0] / LAM), S.One
        if e.is_Pow:
            height, c = self.of(e.base)
            return e.exp * height, c**e.exp
        if e.is_Add:
            return self._sum([self.of(a) for a in e.args])
        return self._product(e) if e.is_Mul else (S.Zero, e)

    def _product(self, e: Expr) -> tuple[Expr, Expr]:
        parts = {a: self.of(a) for a in e.args}
        grows = [a for a, (height, _) in parts.items() if height != 0]
        below = [a for a in grows if a.is_Pow and a.exp == -1]
        if below and (sums := [a for a in grows if a.is_Add]):
            return self._sum([self.of(e / sums[0] * a) for a in sums[0].args])
        heights, factors = zip(*parts.values(), strict=True)
        height, c = sympy.Add(*heights), sympy.Mul(*factors)
        if below:
            # First the factor that is a part of the denominator, as their heights may be equal.
            within = [a for a in grows if a in below[0].free_symbols]
            first = sum((parts[a][0] for a in (*within[:1], below[0])), S.Zero)
            height = height - first + self.named(first)
        return expanded(height), c

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


def symbols_of(expressions: Iterable[Expr]) -> set[Symbol]:
    """The symbols in all of the expressions."""
    return set().union(*(e.free_symbols for e in expressions))


def in_order(e: Expr, known: Mapping[Symbol, Expr]) -> dict[Symbol, Expr]:
    """The definitions of the symbols in an expression, each after those that it needs."""
    rows: dict[Symbol, Expr] = {}
    for s in sorted(e.free_symbols & known.keys(), key=str):
        rows |= {**in_order(known[s], known), s: known[s]}
    return rows


def _scaled(e: Expr) -> Expr:
    """The expression with exponentials and functions that don't overflow in place of exprel."""

    def of_exprel(e: Expr) -> Expr:
        x, n = e.args
        return own("exprel_")(x, n) * sympy.exp(LAM * sympy.Max(sympy.expand(x / LAM), 0))

    return e.replace(lambda x: type(x).__name__ == "exprel", of_exprel)


def of_expansion(e: Any, numbers: Mapping[Symbol, Expr], name: str) -> list[Function]:
    """The function of an expansion, through its logarithm except for uniform noise.

    It has no value where a condition ``a > b`` without noise fails, such as r > 1. `numbers` are
    the values of a bound drift's symbols.
    """
    known = {s: _scaled(v) for s, v in {**e.definitions, **numbers}.items()}
    known[LAM] = 2 / _KAPPA**2
    complement = e.quantity == "P" and e.noise == "weak"
    value = _scaled(1 - e.formula if complement else e.formula)
    value = value.replace(sympy.exp, lambda x: sympy.exp(x.xreplace({_KAPPA: sympy.sqrt(2 / LAM)})))
    if e.noise != "uniform":
        scaled = Exponentials(known)
        height, c = scaled.of(value)
        value, known = LAM * height + sympy.log(c), scaled.known
    met = symbols_of([value, *in_order(value, known).values()])
    strict = (sympy.StrictGreaterThan, sympy.StrictLessThan)
    signs = [c for c in e.conditions if isinstance(c, strict) and not c.has(LAM)]
    signs = [c for c in signs if c.free_symbols <= met | known.keys()]
    value = sympy.Piecewise((value, sympy.And(*signs)), (sympy.nan, True))
    rows = in_order(value, known)
    free = symbols_of([value, *rows.values()]) - rows.keys()
    if odd := [s.name for s in free if s in e.equations and not s.is_real]:
        raise InputError(
            f"{min(odd)} may be complex, which code has no numbers for; bind the drift."
        )
    if e.noise != "uniform":
        value = 1 - sympy.exp(value) if complement else sympy.exp(value)
    about = f"{e.quantity} of {e.drift!r}, noise={e.noise!r}, order {e.order}, case '{e.case}'"
    order = dict.fromkeys(("kappa", "r", *e.drift.parameters, *sorted(s.name for s in free)))
    arguments = tuple(sorted(free, key=lambda s: [*order].index(s.name)))
    return [Function(name, arguments, (value,), about, tuple(rows.items())).in_code()]
