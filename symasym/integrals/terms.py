"""An expression beside a point as a sum of t^e times a power series, t >= 0 the distance from it.

Over a ring: balls, or exactly over the field that the parameters and the irrational constants met
(sqrt(2), e^c) generate, in which arithmetic is canonical.
"""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import sympy
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
            size = Rational(draw.randint(11, 5000), 1000)
            size = S(draw.randint(1, 6)) if s.is_integer else size
            free = not s.is_nonnegative and not s.is_positive
            row[s] = -size if s.is_negative or (free and draw.random() < 0.5) else size
        rows.append(row)
    return rows


def sign_of(e: Expr) -> tuple[int | None, bool]:
    """The sign of an expression, None if it depends on its symbols; True if it is proved."""
    if e.is_positive or e.is_negative or e.is_zero:
        return (1 if e.is_positive else -1 if e.is_negative else 0), True
    balls = [number(e.xreplace(row)) for row in samples(e.free_symbols)]
    signs = {(v > 0) - (v < 0) if v.is_finite() else None for v in balls}
    return (signs.pop() if len(signs) == 1 else None), not e.free_symbols


def vanishes(e: Expr) -> bool:
    """True if an expression is 0: by numbers where it is not, by SymPy where it is."""
    return sign_of(e)[0] == 0 and bool(e == 0 or sympy.simplify(e) == 0)


class NotAnalytic(InputError):
    """An expression is no sum of powers times power series at the point."""


class Balls:
    """Real balls at the working precision; one that holds 0 is taken for 0 where that is asked."""

    exact = False
    of = staticmethod(number)
    call = staticmethod(call)
    power = staticmethod(power)

    def expression(self, x: Any) -> Any:
        return x

    def sign(self, x: Any) -> tuple[int | None, bool]:
        return (None if not x.is_finite() else 0 if x.contains(0) else 1 if x > 0 else -1), True


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
        except (ValueError, KeyError, sympy.CoercionFailed):
            raise _Missing(sympy.expand(e)) from None

    def expression(self, x: Any) -> Expr:
        return self.domain.to_sympy(x)

    def call(self, name: str, x: Any) -> Any:
        return self.of(getattr(sympy, name)(sympy.expand(self.expression(x))))

    def power(self, x: Any, p: Expr) -> Any:
        return self.of(sympy.expand(self.expression(x)) ** p)

    def sign(self, x: Any) -> tuple[int | None, bool]:
        e = self.expression(x)
        sign, proved = sign_of(e)
        return (None if sign == 0 and not vanishes(e) else sign), proved


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
    """Expressions in x beside a point, on one side, to `count` terms."""

    def __init__(self, x: Symbol, point: Any, side: int, count: int, ring: Any) -> None:
        self.x, self.point, self.count, self.ring = x, point, count, ring
        self.zero, self.moving = ring.of(S.Zero), {x}
        line = Series([ring.of(point), ring.of(S(side)), *[self.zero] * (count - 2)])
        self.known: dict[Expr, list[Term]] = {x: self._normal(S.Zero, line)}

    def terms(self, e: Expr) -> list[Term]:
        """The terms, whose exponents differ by no whole number."""
        if e not in self.known:
            self.known[e] = self._terms(e)
        return self.known[e]

    def taylor(self, e: Expr) -> Series:
        """The series of an expression that is analytic on this side."""
        terms = self.terms(e) or [(S.Zero, Series([self.zero] * self.count))]
        front, series = terms[0]
        if len(terms) > 1 or not front.is_Integer or front < 0:
            raise NotAnalytic(f"{e} has no Taylor series at {self.x} = {self.point}.")
        return Series(([self.zero] * int(front) + series.c)[: self.count])

    def _terms(self, e: Expr) -> list[Term]:
        if not e.has(*self.moving):
            series = Series([self.ring.of(e), *[self.zero] * (self.count - 1)])
            return self._normal(S.Zero, series)
        if e.is_Add:
            return self._sum([term for part in e.args for term in self.terms(part)])
        if e.is_Mul:
            total = self.terms(S.One)
            for part in e.args:
                total = self._sum([(p + q, a * b) for p, a in total for q, b in self.terms(part)])
            return total
        if e.is_Pow and e.exp.has(*self.moving):
            return self.terms(sympy.exp(e.exp * sympy.log(e.base), evaluate=False))
        if e.is_Pow:
            return self._raised(e)
        name = name_of(e)
        if name in ("sinh", "cosh", "tanh"):
            return self.terms(e.rewrite(sympy.exp))
        if name == "tan":
            return self.terms(sympy.sin(e.args[0]) / sympy.cos(e.args[0]))
        return self._normal(S.Zero, self._function(name, self.taylor(e.args[0])))

    def _raised(self, e: Expr) -> list[Term]:
        """The power of a term: of its exponent, and of its series."""
        terms, p = self.terms(e.base), e.exp
        if len(terms) != 1:
            raise NotAnalytic(f"{e} is no power times a power series at {self.x} = {self.point}.")
        ((front, series),) = terms
        if not p.is_Integer and self.ring.sign(series[0])[0] != 1:
            raise NotAnalytic(
                f"{e} is complex beside {self.x} = {self.point}, or its sign is unknown; give a "
                "real one, or symbols with positive=True."
            )
        first = series[0] ** int(p) if p.is_Integer else self.ring.power(series[0], p)
        rational = Fraction(int(p.p), int(p.q)) if p.is_Rational else self.ring.of(p)
        return [(sympy.expand(front * p), series.power(rational, first))]

    def _function(self, name: str, a: Series) -> Series:
        """An elementary function of a series."""
        first = None
        if name != "log" or self.ring.sign(a[0])[0] != 0:
            first = self.ring.call(name, a[0])
        if first is None or (not self.ring.exact and not first.is_finite()):
            raise NotAnalytic(f"{name} is singular or complex at {self.x} = {self.point}.")
        if name == "exp":
            return a.exp(first)
        slope = a.slope()
        if name in ("sin", "cos"):
            s, c = ([self.ring.call(n, a[0])] for n in ("sin", "cos"))
            for n in range(1, len(a)):
                risen, fallen = dot(slope.c[:n], c[::-1]) / n, dot(slope.c[:n], s[::-1]) / n
                s.append(risen)
                c.append(-fallen)
            return Series(s if name == "sin" else c)
        # The others' derivatives are algebraic, or an exponential.
        w = Dummy()
        self.moving.add(w)
        self.known[w] = self._normal(S.Zero, a)
        return (self.taylor(getattr(sympy, name)(w).diff(w)) * slope).primitive(first)

    def _normal(self, front: Expr, series: Series) -> list[Term]:
        """Leading zeros counted into the exponent; no term where all are 0."""
        nonzero = (k for k, c in enumerate(series.c) if self.ring.sign(c)[0] != 0)
        first = next(nonzero, None)
        return [] if first is None else [(front + first, Series(series.c[first:]))]

    def _sum(self, terms: list[Term]) -> list[Term]:
        """Terms whose exponents differ by a whole number as one."""
        joined: list[Term] = []
        for front, series in terms:
            for index, (known, other) in enumerate(joined):
                gap = sympy.simplify(front - known)
                if gap.is_Integer:
                    pair = (known, other), (front, series)
                    (low, base), (_, high) = pair if gap >= 0 else pair[::-1]
                    shifted = Series([self.zero] * abs(int(gap)) + high.c)
                    joined[index : index + 1] = self._normal(low, base + shifted)
                    break
            else:
                joined.append((front, series))
        return joined
