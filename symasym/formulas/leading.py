"""The term of T that leads as kappa -> 0: of all products of critical points the highest.

T is a quotient of two sums of exponentials c e^{lam h}; its leading term is the quotient of those
with the largest h, which depends on the parameters and on r.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.expansions.balls import Field
from symasym.formulas.cases import found_cases
from symasym.formulas.letters import KAPPA, LAM, R, X, expanded
from symasym.numbers.balls import precision

if TYPE_CHECKING:
    from symasym.formulas.formula import Expansion

__all__ = ["Leading", "leading"]

_LOG = Symbol("log(lam)", positive=True)
# Heights and radii as near to each other as this are equal.
_SAME = 1e-10


class Leading(NamedTuple):
    """The term of T that is exponentially larger than the others, and where it is."""

    expression: Expr
    conditions: tuple[Any, ...]


def leading(e: Expansion) -> Leading:
    """The leading term, and where it is that."""
    if e.noise != "weak" or e.quantity != "T":
        raise InputError(f"{e.quantity} in {e.noise} noise has no term that leads; T in weak has.")
    if not e.sums:
        return Leading(e.formula, e.conditions)
    highest = _Highest(e)
    height, c = highest.of(e.formula)
    c = sympy.factor_terms(expanded(c))
    value = (c * sympy.exp(LAM * height)).xreplace({_LOG: sympy.log(LAM), X: 1 / LAM})
    value = sympy.powdenest(sympy.powsimp(value.xreplace({LAM: 2 / KAPPA**2})), force=True)
    conditions = dict.fromkeys(c for c in highest.conditions if c is not sympy.true)
    if highest.beyond > max(1.0, float(abs(e.start))) * (1 + _SAME):
        conditions[sympy.Gt(R, sympy.Float(highest.beyond * (1 + 1e-9), 12))] = None
    return Leading(value, tuple(conditions))


class Scaled:
    """Expressions as c e^{lam h}, with a name for the h and the c of each sum.

    Attributes
    ----------
    known : dict
        What each symbol stands for, those of the sums' heights and coefficients among them.
    sums : collection of Symbol
        Those that are sums of exponentials.
    """

    def __init__(self, known: Mapping[Symbol, Expr], sums: Collection[Symbol]) -> None:
        self.known, self.sums = dict(known), sums
        self._made: dict[Expr, tuple[Expr, Expr]] = {}

    def of(self, e: Expr, name: str = "") -> tuple[Expr, Expr]:
        """h and c; `name` is that of the sum."""
        if e not in self._made:
            self._made[e] = self._of(e, name or str(len(self._made)))
        return self._made[e]

    def _of(self, e: Expr, name: str) -> tuple[Expr, Expr]:
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
            s in self.sums for s in e.free_symbols
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
            largest = sympy.Max(largest, h)
        top, total = Symbol(f"top({name})", real=True), Symbol(f"sum({name})", real=True)
        self.known[top] = largest
        shares = (c * sympy.exp(LAM * (h - top)) for h, c in heights.items())
        self.known[total] = sympy.Add(*shares)
        return top, total


class _Highest(Scaled):
    """The highest exponential of an expression, and the conditions under which it is that."""

    def __init__(self, e: Expansion) -> None:
        super().__init__(e.definitions, e.sums)
        self.e, self.numbers, self.conditions = e, _numbers(e), list[Any]()
        #: The radius from which on it is so, of a bound drift.
        self.beyond = 1.0

    def _leaf(self, e: Expr) -> Expr:
        """The first term of a series."""
        if e in self.e.rows:
            row = self.e.rows[e]
            n, c = next((n, c) for n, c in enumerate(row.c) if c != 0)
            return row.front * c * X**n
        return e.xreplace({sympy.log(LAM): _LOG}).xreplace({LAM: 1 / X})

    def _exponential(self, e: Expr) -> bool:
        return True

    def _sum(self, parts: list[tuple[Expr, Expr]], name: str) -> tuple[Expr, Expr]:
        """The largest term; of those as high all that have the least power of x."""
        sizes = {h: _size(h, self.numbers) for h, _ in parts}
        top, same = max(sizes, key=sizes.__getitem__), set[Expr]()
        for h, (slope, level) in sizes.items():
            more = sizes[top][0] - slope, sizes[top][1] - level
            equal = max(abs(x) for x in more) < _SAME
            same |= {h} if equal else set()
            if self.e.drift.free:
                sign = sympy.Eq if equal else sympy.Gt
                self.conditions.append(sign(expanded(top - h), 0))
            elif more[0] > _SAME:
                self.beyond = max(self.beyond, -more[1] / more[0])
        powers: dict[Expr, Expr] = {}
        for h, c in parts:
            if h in same:
                c, power = sympy.powsimp(sympy.expand(c)).as_coeff_exponent(X)
                powers[power] = powers.get(power, S.Zero) + c
        kept = [power for power, c in powers.items() if sympy.expand(c) != 0]
        if not kept:
            raise InputError(f"the leading terms of {self.e.drift!r} cancel, and none leads.")
        return top, powers[min(kept)] * X ** min(kept)


def _numbers(e: Expansion) -> dict[str, float]:
    """V at the points, phi beyond, and parameters, of the drift or an example of its case."""
    drift = e.drift
    if drift.free:
        cases = [c for c in found_cases(drift, e.start) if c == e.case]
        if not cases:
            raise InputError(f"no parameters of {drift!r} in this case are known; bind them.")
        drift = drift.bind(**cases[0].example)
    with precision(200):
        field = Field(drift, abs(e.start) + 2, e.start)
        found = {f"V(u{k})": field.height(u) for k, (u, _) in enumerate(field.zeros, 1)}
        for side in (-1, 1):
            found[f"V({side})"] = field.height(field.a[side] * 0 + side)
            found[f"phi({side})"] = field.a[side]
        known = {name: float(x.mid()) for name, x in found.items()}
    return known | {name: float(x) for name, x in drift.values.items()}


def _size(height: Expr, numbers: dict[str, float]) -> tuple[float, float]:
    """The coefficients of r and of 1."""
    put = {s: numbers[s.name] for s in height.free_symbols - {R} if s.name in numbers}
    value = sympy.expand(height.xreplace(put))
    return float(value.coeff(R, 1)), float(value.coeff(R, 0))
