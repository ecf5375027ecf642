"""Sums over critical points with a symbol for lam and one for every series.

`symasym.asymptotics.weak_noise.compose` runs with these in place of numbers. Exponentials are kept
apart by their heights.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.weak_noise.series import Series

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr

#: Digits of the coefficients.
DIGITS = 50
KAPPA, R, LAM, X = sympy.symbols("kappa r lam x", positive=True)
BEYOND_1 = sympy.Symbol("beyond", positive=True)  # r - 1, in which exponents lose no digits
# A sum of coefficients this much below its terms is rounding.
NOTHING = 10.0**-38


def number_of(x: Expr | Fraction | mpf | int) -> Expr:
    """A SymPy number: exact for a rational, else to 50 digits."""
    if isinstance(x, sympy.Basic | int):
        return sympy.sympify(x)
    if isinstance(x, Fraction):
        return sympy.Rational(x.numerator, x.denominator)
    return sympy.Float(x, DIGITS)


class Symbolic:
    """These sums for `weak_noise.compose`."""

    rounding = 0.0

    def exponential(self, height: Expr | mpf, series: Series, rounding: float = 0.0) -> Sum:
        """One symbol, or a number over lam, times e^{lam height}."""
        factor = sum((X ** sympy.Rational(p.offset) * p.coefficients[0] for p in series.parts), 0)
        return Sum([(sympy.expand(number_of(height)), sympy.sympify(factor))])

    def total(self, terms: list[Any]) -> Sum:
        """The sum of the terms."""
        return sum(terms, Sum([]))

    def number(self, x: Expr | Fraction | mpf | int) -> Expr:
        """A SymPy number."""
        return number_of(x)


class Sum:
    """Factors times e^{lam height}; heights are linear in r."""

    def __init__(self, terms: Iterable[tuple[Any, Any]]) -> None:
        self.terms: list[tuple[Any, Any]] = []
        for height, factor in terms:
            factor = factor.subs(1 / LAM, X) if factor.has(LAM) else factor
            if factor == 0:
                continue
            for k, (known, other) in enumerate(self.terms):
                if _nothing(known - height):
                    self.terms[k] = known, other + factor
                    break
            else:
                self.terms.append((height, factor))

    def __add__(self, other: Sum | Expr | int) -> Sum:
        return Sum([*self.terms, *as_sum(other).terms])

    __radd__ = __add__

    def __mul__(self, other: Sum | Expr | int) -> Sum:
        return Sum((h + k, a * b) for h, a in self.terms for k, b in as_sum(other).terms)

    __rmul__ = __mul__

    def __neg__(self) -> Sum:
        return Sum((h, -a) for h, a in self.terms)

    def __sub__(self, other: Sum | Expr | int) -> Sum:
        return self + -as_sum(other)

    def __abs__(self) -> Sum:
        # Only errors ask for it.
        return Sum([])


def as_sum(x: Sum | Expr | int) -> Sum:
    """A sum as it is, a number as a sum of one term."""
    return x if isinstance(x, Sum) else Sum([(sympy.S.Zero, sympy.sympify(x))])


def _nothing(height: Expr) -> bool:
    """True of a height that is 0 for all r."""
    height = sympy.expand(height)
    parts = height.coeff(BEYOND_1, 0), height.coeff(BEYOND_1, 1)
    return all(c == 0 or (c.is_number and abs(c) < NOTHING) for c in parts)
