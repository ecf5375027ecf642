"""An expression at a point as a sum of t^e times a power series, t the distance to one side.

Over a ring: balls, or exactly over the field that the parameters and the irrational constants met
(sqrt(2), e^c) generate, in which arithmetic is canonical.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import random
import sympy
from flint import fmpq
from sympy import Dummy, Expr, Rational, S, Symbol

from symasym.base.errors import AccuracyError, InputError
from symasym.integrals.enclosure import call, name_of, number, power
from symasym.series.power_series import Series, dot

#: An exponent and the series behind it, whose first coefficient is not 0.
Term = tuple[Expr, Series]


def samples(symbols: Any, count: int = 12) -> list[dict[Symbol, Expr]]:
    """Values that the symbols' assumptions allow, the same ones each time."""
    draw, rows = random.Random(7), []
    for _ in range(count if symbols else 1):
        row = {}
        for s in sorted(symbols, key=str):
            size = Rational(draw.randint(1, 6) if s.is_integer else draw.randint(11, 5000), 1)
            size = size if s.is_integer else size / 1000
            free = not s.is_nonnegative and not s.is_positive
            row[s] = -size if s.is_negative or (free and draw.random() < 0.5) else size
        rows.append(row)
    return rows


def values(e: Expr, count: int = 12) -> list[Any]:
    """Balls of an expression at `samples` of its symbols."""
    return [number(e.xreplace(row)) for row in samples(e.free_symbols, count)]


def vanishes(e: Expr) -> bool:
    """True if an expression is 0: by numbers where it is not, by SymPy where it is."""
    return all(v.contains(0) for v in values(e, 2)) and bool(sympy.simplify(e) == 0)


def sign_of(e: Expr) -> tuple[int | None, bool]:
    """The sign of an expression, None if that depends on its symbols; True if it is proved."""
    if e.is_positive or e.is_negative or e.is_zero:
        return (1 if e.is_positive else -1 if e.is_negative else 0), True
    signs = {(v > 0) - (v < 0) if v.is_finite() else None for v in values(e)}
    return (signs.pop() if len(signs) == 1 else None), not e.free_symbols


class NotAnalytic(InputError):
    """An expression is no sum of powers times power series at the point."""


class Balls:
    """Real balls at the working precision; one that holds 0 is taken for 0 where that is asked."""

    exact = False

    def of(self, e: Any) -> Any:
        return number(e)

    def expression(self, x: Any) -> Any:
        return x

    def call(self, name: str, x: Any) -> Any:
        return call(name, x)

    def power(self, x: Any, p: Expr) -> Any:
        return power(x, fmpq(p.p, p.q) if p.is_Rational else number(p))

    def zero(self, x: Any) -> bool:
        return bool(x.contains(0))

    def sign(self, x: Any) -> int | None:
        return (x > 0) - (x < 0)


class _Missing(Exception):
    """A constant outside of the field."""


class Exact:
    """The field of rational functions that some constants generate."""

    exact = True

    def __init__(self, constants: list[Expr]) -> None:
        self.domain = sympy.construct_domain([S.One, *constants], field=True, composite=True)[0]

    def of(self, e: Expr) -> Any:
        try:
            return self.domain.from_sympy(sympy.expand(e))
        except (ValueError, sympy.CoercionFailed, KeyError):
            raise _Missing(sympy.expand(e)) from None

    def expression(self, x: Any) -> Expr:
        return self.domain.to_sympy(x)

    def call(self, name: str, x: Any) -> Any:
        return self.of(getattr(sympy, name)(sympy.expand(self.expression(x))))

    def power(self, x: Any, p: Expr) -> Any:
        return self.of(sympy.expand(self.expression(x)) ** p)

    def zero(self, x: Any) -> bool:
        return bool(x == 0) or (self.domain != sympy.QQ and vanishes(self.expression(x)))

    def sign(self, x: Any) -> int | None:
        return sign_of(self.expression(x))[0]


def exactly(work: Any) -> Any:
    """work(ring) in the exact field that it needs."""
    constants: list[Expr] = []
    for _ in range(40):
        try:
            return work(Exact(constants))
        except _Missing as missing:
            constants.append(missing.args[0])
    raise AccuracyError(
        "the irrational constants of the expansion did not close under arithmetic; pass dps=… for "
        "numerical coefficients."
    )


class Point:
    """Expressions in x about a point, on one side, to `count` terms."""

    def __init__(self, x: Symbol, point: Any, side: int, count: int, ring: Any) -> None:
        self.x, self.point, self.count, self.ring = x, point, count, ring
        self.moving = {x}
        line = [ring.of(point), ring.of(S(side)), *[ring.of(S.Zero)] * (count - 2)]
        self.known: dict[Expr, list[Term]] = {x: self._normal(S.Zero, Series(line))}

    def terms(self, e: Expr) -> list[Term]:
        """The terms, whose exponents differ by no whole number."""
        if e not in self.known:
            self.known[e] = self._terms(e)
        return self.known[e]

    def taylor(self, e: Expr) -> Series:
        """The series of an expression that is analytic on this side."""
        terms = self.terms(e)
        zero = self.ring.of(S.Zero)
        if not terms:
            return Series([zero] * self.count)
        (front, series), *more = terms
        if more or not front.is_Integer or front < 0:
            raise NotAnalytic(f"{e} has no Taylor series at {self.x} = {self.point}; split it.")
        return Series(([zero] * int(front) + series.c)[: self.count])

    def _constant(self, c: Any) -> Series:
        return Series([c, *[self.ring.of(S.Zero)] * (self.count - 1)])

    def _terms(self, e: Expr) -> list[Term]:
        if not e.has(*self.moving):
            return self._normal(S.Zero, self._constant(self.ring.of(e)))
        if e.is_Add:
            return self._sum([term for part in e.args for term in self.terms(part)])
        if e.is_Mul:
            total = self._normal(S.Zero, self._constant(self.ring.of(S.One)))
            for part in e.args:
                total = self._sum([(p + q, a * b) for p, a in total for q, b in self.terms(part)])
            return total
        if e.is_Pow and not e.exp.has(*self.moving):
            return self._raised(e)
        if e.is_Pow:
            return self.terms(sympy.exp(e.exp * sympy.log(e.base), evaluate=False))
        name = name_of(e)
        if name in ("sinh", "cosh", "tanh", "tan"):
            both = sympy.sin(e.args[0]) / sympy.cos(e.args[0])
            return self.terms(both if name == "tan" else e.rewrite(sympy.exp))
        return self._normal(S.Zero, self._function(name, self.taylor(e.args[0])))

    def _raised(self, e: Expr) -> list[Term]:
        """The power of a term: of its exponent, and of its series."""
        terms = self.terms(e.base)
        if len(terms) != 1:
            raise NotAnalytic(f"{e} is no power times a power series at {self.x} = {self.point}.")
        (front, series), p = terms[0], e.exp
        if not p.is_Integer and self.ring.sign(series[0]) != 1:
            raise NotAnalytic(
                f"{e} is complex beside {self.x} = {self.point}, or its sign is unknown; give a "
                "real one, or symbols with positive=True."
            )
        rational = Fraction(int(p.p), int(p.q)) if p.is_Rational else self.ring.of(p)
        if p.is_Integer:
            first = series[0] ** int(p)
        else:
            first = self.ring.power(series[0], p)
        return [(sympy.expand(front * p), series.power(rational, first))]

    def _function(self, name: str, a: Series) -> Series:
        """An elementary function of a series."""
        first = self.ring.call(name, a[0]) if name != "log" or not self.ring.zero(a[0]) else None
        if first is None or (hasattr(first, "is_finite") and not first.is_finite()):
            raise NotAnalytic(f"{name} is singular at {self.x} = {self.point}; split g there.")
        if name == "exp":
            return a.exp(first)
        if name in ("sin", "cos"):
            slope, s, c = a.slope().c, [self.ring.call("sin", a[0])], [self.ring.call("cos", a[0])]
            for n in range(1, len(a)):
                sine, cosine = dot(slope[:n], c[::-1]) / n, dot(slope[:n], s[::-1]) / n
                s.append(sine)
                c.append(-cosine)
            return Series(s if name == "sin" else c)
        # The others have algebraic derivatives, or exponentials.
        w = Dummy()
        self.moving.add(w)
        self.known[w] = self._normal(S.Zero, a)
        slope = self.taylor(getattr(sympy, name)(w).diff(w))
        return (slope * a.slope()).primitive(first)

    def _normal(self, front: Expr, series: Series) -> list[Term]:
        """Leading zeros counted into the exponent; no term where all are 0."""
        zeros = (k for k, c in enumerate(series.c) if not self.ring.zero(c))
        first = next(zeros, None)
        return [] if first is None else [(front + first, Series(series.c[first:]))]

    def _sum(self, terms: list[Term]) -> list[Term]:
        """Terms whose exponents differ by a whole number as one."""
        joined: list[Term] = []
        for front, series in terms:
            for index, (known, other) in enumerate(joined):
                gap = sympy.simplify(front - known)
                if gap.is_Integer:
                    if gap < 0:
                        front, series, known, other = known, other, front, series
                    shifted = Series([self.ring.of(S.Zero)] * abs(int(gap)) + series.c)
                    joined[index : index + 1] = self._normal(known, other + shifted)
                    break
            else:
                joined.append((front, series))
        return joined
