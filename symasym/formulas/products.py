"""T as products of critical points: each of them, and the one that leads as kappa -> 0.

A product is of a critical point of e^{-lam V} and one of e^{lam V}. T is a quotient of two sums of
such exponentials c e^{lam h}, run by `symasym.expansions.weak`; its leading term is the quotient of
those with the largest h, which depends on the parameters and on r.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import sympy
from sympy import Expr, S, Symbol

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.formulas.cases import Case, found_cases
from symasym.formulas.letters import (
    IN_KAPPA,
    KAPPA,
    LAM,
    Field,
    Letters,
    R,
    Terms,
    X,
    expanded,
    exponentials,
)
from symasym.formulas.numbers import numbers_of

_LOG = Symbol("log(lam)", positive=True)
# Heights and radii as near to each other as this are equal.
_SAME = 1e-10
# Terms of each series, of which the first that is not 0 leads.
_TERMS = 3


@dataclass(frozen=True)
class Contribution:
    """One product of a critical point of e^{-lam V} with one of e^{lam V}.

    It adds weight * front * e^{exponent} (c_0 + c_1 kappa^2 + c_2 kappa^4 + ...) to T.

    Attributes
    ----------
    pair : tuple of str
        The two points, such as ``("well u1", "barrier u2")``.
    exponent, front : expression
    coefficients : tuple of expressions
        c_0 = 1, c_1, ..., exact in V's derivatives at the two points.
    weight : str
        ``"1 - C"`` right of the start, ``"C"`` left of it; ``"C (1 - C)"`` of a start on a well.
    """

    pair: tuple[str, ...]
    exponent: Expr
    front: Expr
    coefficients: tuple[Expr, ...]
    weight: str

    @property
    def expression(self) -> Expr:
        """The contribution without its weight."""
        series = sum((c * KAPPA ** (2 * n) for n, c in enumerate(self.coefficients)), S.Zero)
        return self.front * sympy.exp(self.exponent) * series


def contributions(
    points: list[weak.Point], regular: Any, at: Terms, order: int
) -> Iterator[Contribution]:
    """The products of T's critical points, a start on a well with all others."""
    of, start = weak.shares(points, regular, at), points[weak.start_of(points)]
    found = [(w, *pair) for w, side in zip(("C", "1 - C"), of.sides, strict=True) for pair in side]
    if of.own != 0:
        whole = zip(points, weak.Sums(points, 1, at).whole, strict=True)
        found += [("C (1 - C)", (start, p), of.own * s) for p, s in whole if s != 0]
    for weight, pair, value in found:
        if not pair:
            continue
        ((height, c),) = exponentials(value).items()
        front, product = LAM, [S.One, *[S.Zero] * order]
        for factor in sympy.Mul.make_args(c):
            first, row = at.rows.get(factor, (factor, [S.One]))
            front *= first * row[0]
            product = [
                sum((product[n - i] * a / row[0] for i, a in enumerate(row[: n + 1])), S.Zero)
                for n in range(order + 1)
            ]
        yield Contribution(
            tuple(f"{p.name} {'' if str(p.u)[0] == 'u' else 'u = '}{p.u}" for p in pair),
            (LAM * height).xreplace(IN_KAPPA),
            sympy.powdenest(front.xreplace(IN_KAPPA), force=True),
            tuple(sympy.expand(a / 2**n) for n, a in enumerate(product)),
            weight,
        )


class Leading(NamedTuple):
    """The term of T that is exponentially larger than the others, and where it is."""

    expression: Expr
    conditions: tuple[Any, ...]


def leading(drift: Drift, case: Case, start: Fraction) -> Leading:
    """The leading term of T for weak noise, and where it is that."""
    bound = drift
    if drift.free:
        cases = [c for c in found_cases(drift, start) if c == case]
        if not cases:
            raise InputError(f"no parameters of {drift!r} in this case are known; bind them.")
        bound = drift.bind(**cases[0].example)
    field = Field(drift, case, start)
    points, regular = weak.points_of(field, _TERMS, Letters), field.regular(_TERMS)
    numbers = numbers_of({s for p in points for s in p.height.free_symbols}, bound, start)
    values = {n: sympy.Rational(x.numerator, x.denominator) for n, x in bound.values.items()}
    numbers |= {Symbol(n, real=True): x for n, x in values.items()}
    at = _Tops(field.start, numbers, bool(drift.free))
    ((height, c),) = exponentials(at.named("T", weak.escape_time(points, regular, at))).items()
    value = sympy.factor_terms(expanded(c)) * sympy.exp(LAM * height)
    value = value.xreplace({_LOG: sympy.log(LAM), X: 1 / LAM}).xreplace(IN_KAPPA)
    conditions = dict.fromkeys(c for c in at.conditions if c is not sympy.true)
    if at.beyond > max(1.0, float(abs(start))) * (1 + _SAME):
        conditions[sympy.Gt(R, sympy.Float(at.beyond * (1 + 1e-9), 12))] = None
    return Leading(sympy.powdenest(sympy.powsimp(value), force=True), tuple(conditions))


class _Tops(Terms):
    """Of each sum the highest exponential alone, and the conditions under which it is that."""

    def __init__(self, start: Expr, numbers: dict[Symbol, Expr], free: bool) -> None:
        super().__init__(start)
        self.lam, self.log_lam, self.numbers, self.free = 1 / X, _LOG, numbers, free
        self.conditions: list[Any] = []
        #: The radius from which on it is so, of a bound drift.
        self.beyond = 1.0

    def term(self, letter: str, point: Any, height: Any, halves: int, row: Any) -> Any:
        """The first term of a series."""
        n, c = next(((n, c) for n, c in enumerate(map(sympy.sympify, row)) if c != 0), (0, S.Zero))
        return X ** (sympy.Rational(halves, 2) + n) * c * sympy.exp(LAM * height) if c != 0 else 0

    def named(self, name: str, value: Any) -> Expr:
        """The largest term; of those as high all that have the least power of x."""
        if name == "S":
            value = self.known["L"] + self.known["R"]
        terms = exponentials(sympy.expand(value))
        sizes = {h: self._size(h) for h in terms}
        top, c = max(sizes, key=sizes.__getitem__), S.Zero
        for h, (slope, level) in sizes.items():
            more = sizes[top][0] - slope, sizes[top][1] - level
            equal = max(abs(x) for x in more) < _SAME
            c += terms[h] if equal else S.Zero
            if self.free:
                self.conditions.append((sympy.Eq if equal else sympy.Gt)(expanded(top - h), 0))
            elif more[0] > _SAME:
                self.beyond = max(self.beyond, -more[1] / more[0])
        powers: dict[Expr, Expr] = {}
        for a in sympy.Add.make_args(sympy.expand(c)):
            factor, power = sympy.powsimp(a).as_coeff_exponent(X)
            powers[power] = powers.get(power, S.Zero) + factor
        kept = [power for power, a in powers.items() if sympy.expand(a) != 0]
        if not kept:
            raise InputError("the leading terms of T cancel, and none leads; use `terms`.")
        self.known[name] = powers[min(kept)] * X ** min(kept) * sympy.exp(LAM * top)
        return self.known[name]

    def _size(self, height: Expr) -> tuple[float, float]:
        """The coefficients of r and of 1."""
        value = sympy.expand(height.xreplace(self.numbers))
        return float(value.coeff(R, 1)), float(value.coeff(R, 0))
