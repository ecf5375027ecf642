"""A formula as a program: no exponential overflows, and its logarithm is finite where it is not.

Each sum of exponentials is scaled by its largest e^{lam h}; products and quotients add up and
subtract these heights, so that log f = lam h + log c. Everything else is given step by step, as in
`symasym.formulas.formula.Expansion.definitions`.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.emit.forms import height_exp, larger
from symasym.emit.program import Case, Function, Program, by_logarithm
from symasym.formulas.letters import LAM, FinitePart, expanded, joined
from symasym.formulas.numbers import DIGITS, numbers_of

if TYPE_CHECKING:
    from symasym.formulas.formula import Expansion

__all__ = ["Scaled", "plain_name", "program"]


class Scaled:
    """Expressions as c e^{lam h}, with a name for the h and the c of each sum.

    Attributes
    ----------
    known : dict
        What each symbol stands for, those of the sums' heights and coefficients among them.
    sums : collection of Symbol
        Those that are sums of exponentials.
    growth : mapping
        h of symbols that `known` has without their e^{lam h}.
    """

    def __init__(
        self, known: Mapping[Symbol, Expr], sums: Collection[Symbol], growth: Mapping[Symbol, Expr]
    ) -> None:
        self.known, self.sums, self.growth = dict(known), sums, growth
        self._made: dict[Expr, tuple[Expr, Expr]] = {}

    def of(self, e: Expr, name: str = "") -> tuple[Expr, Expr]:
        """h and c; `name` is that of the sum."""
        if e not in self._made:
            self._made[e] = self._of(e, name or str(len(self._made)))
        return self._made[e]

    def _of(self, e: Expr, name: str) -> tuple[Expr, Expr]:
        if e in self.growth:
            return self.growth[e], e
        if e in self.sums:
            return self.of(self.known[e], str(e))
        if isinstance(e, sympy.exp):
            height = expanded(e.args[0] / LAM)
            return (S.Zero, e) if height.has(LAM) else (height, S.One)
        if e.is_Pow and e.exp.is_Integer and e.base.is_Add:
            height, c = self.of(e.base)
            return e.exp * height, c**e.exp
        if e.is_Mul:
            parts = [self.of(a) for a in e.args]
            return expanded(sum(h for h, _ in parts)), sympy.Mul(*(c for _, c in parts))
        if e.is_Add and self._exponential(e):
            return self._sum([self.of(a) for a in e.args], name)
        return S.Zero, self._leaf(e)

    def _leaf(self, e: Expr) -> Expr:
        """The c of what has no exponential."""
        return e

    def _exponential(self, e: Expr) -> bool:
        """True where an expression has exponentials of lam, perhaps in its symbols."""
        return any(x.has(LAM) for x in e.atoms(sympy.exp)) or any(
            s in self.sums or s in self.growth for s in e.free_symbols
        )

    def _sum(self, parts: list[tuple[Expr, Expr]], name: str) -> tuple[Expr, Expr]:
        heights: dict[Expr, Expr] = {}
        for h, c in parts:
            heights[h] = heights.get(h, S.Zero) + c
        if len(heights) == 1:
            ((h, c),) = heights.items()
            return h, c
        first, *others = heights
        largest = first
        for h in others:
            largest = larger(largest, h)
        top, total = Symbol(f"top({name})", real=True), Symbol(f"sum({name})", real=True)
        self.known[top] = largest
        self.known[total] = sum((c * height_exp(LAM, h - top) for h, c in heights.items()), S.Zero)
        return top, total


def program(e: Expansion, name: str) -> Program:
    """The program of one function: 1 less a formula, strong noise as it is, else a logarithm."""
    numbers, plain_noise = numbers_of(e), e.noise == "strong"
    complement = e.quantity == "P" and not plain_noise
    known: dict[Symbol, Expr] = {**e.nested, **e.code, **numbers}
    value = 1 - e.formula if complement else e.formula
    if not plain_noise:
        scaled = Scaled(known, e.sums, e.growth)
        height, c = scaled.of(value)
        value, known = LAM * height + sympy.log(c), scaled.known
    order: dict[Symbol, Expr] = {}

    def visit(expression: Expr) -> None:
        for s in sorted(expression.free_symbols - order.keys(), key=str):
            if s in known and s not in order:
                value = _in_code(known[s])
                visit(value)
                order[s] = value

    visit(value)
    free = set().union(value.free_symbols, *(v.free_symbols for v in order.values())) - order.keys()
    _refuse(e, free, order.values())
    plain = {s: plain_name(s.name) for s in sorted(free, key=str)}
    # Beside the function's own names.
    plain |= {s: f"{text}_" for s, text in plain.items() if text in (name, f"log_{name}")}
    for s in order:
        base = re.sub(r"\W+", "_", s.name.replace("'", "d").replace("-", "m").replace("+", "p"))
        base = f"{base.strip('_')}_" if base[:1] == "t" else base.strip("_")
        while base in plain.values():
            base = f"{base}_1"
        plain[s] = base
    named = {s: Symbol(text, **s._assumptions_orig) for s, text in plain.items()}
    shared = tuple((named[s], e.xreplace(named)) for s, e in order.items())
    value, arguments = value.xreplace(named), tuple(sorted(named[s].name for s in free))
    where = f", r > {max(1, abs(e.start))}" if e.quantity in ("T", "C", "1 - C") else ""
    about = (
        f"{e.quantity} of {e.drift!r}, {e.noise} noise to order {e.order}, case '{e.case}'{where}."
    )
    if plain_noise or complement:
        whole = 1 - sympy.exp(value) if complement else value
        function = Function(name, about, arguments, (Case((whole,), shared=shared),))
    else:
        function = by_logarithm(name, about, arguments, value, (), shared)
    digits = DIGITS if numbers else Program.digits
    return Program("expression", about.rstrip("."), (function,), error=e.error, digits=digits)


def _refuse(e: Expansion, free: Iterable[Symbol], expressions: Iterable[Expr]) -> None:
    """Refuse complex numbers, and integrals without a closed form."""
    names = ", ".join(e.drift.free)
    if any(x.has(FinitePart, sympy.Integral) for x in expressions):
        way = f"bind them with bind({'=…, '.join(e.drift.free)}=…)" if names else (
            "use sa.stationary_density")  # fmt: skip
        raise InputError(
            f"A = {e.drift.expression()} is no polynomial in u, so that V and the regular "
            f"part have no closed form in {names or 'y'}; {way}."
        )
    odd = [s for s in free if s in e.equations and not s.is_real]
    if odd:
        raise InputError(
            f"{odd[0]} may be complex, which the code has no numbers for; bind {names}."
        )


def _in_code(e: Expr) -> Expr:
    """The expression in functions that every language has."""
    e = e.replace(sympy.acosh, lambda w: sympy.log(w + sympy.sqrt(w**2 - 1)))
    # One of two exponentials may overflow where their product does not.
    return joined(e)


def plain_name(name: str) -> str:
    """``V''(u1)`` as ``V2_u1``, ``V^(4)(0)`` as ``V4_0``, ``V''(-1)`` as ``V2_m1``."""
    head, _, place = name.rpartition("(")
    if not head:
        return name
    order = head[3:-1] if "^" in head else str(head.count("'") or "")
    return f"{head[0]}{order}_{place.rstrip(')').replace('-', 'm').replace('/', '_')}"
