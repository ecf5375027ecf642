"""Sums over critical points with a symbol for lam and one for every series.

`symasym.asymptotics.weak_noise.compose` runs with these in place of numbers, so that what is
emitted is the composition that is evaluated. Exponentials are kept apart by their heights.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import Part, Series, terms
from symasym.emit.forms import larger

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr

#: Digits of the coefficients.
DIGITS = 50
KAPPA, R, LAM, X = sympy.symbols("kappa r lam x", positive=True)
BEYOND_1 = sympy.Symbol("beyond", positive=True)  # r - 1, in which exponents lose no digits
# A sum of coefficients this much below its terms is rounding.
NOTHING = 10.0**-38


class Names:
    """A symbol for every series of an expansion, and what it stands for.

    `size` is that of the drift: lam^-p comes with about size^-p.
    """

    def __init__(self, order: int, context: MPContext, size: float) -> None:
        self.order, self._context, self._size = order, context, context.mpf(size)
        self.series: list[tuple[Any, Any]] = []

    def named(self, name: str, series: Series) -> Series:
        """A series of one term, the symbol; of none where it vanishes."""
        parts = [self._without_rounding(part) for part in series.parts] if terms(series) else []
        if not any(c for part in parts for c in part.coefficients):
            return Series([])
        symbol = sympy.Symbol(name, real=True)
        self.series.append((symbol, sum((_horner(part) for part in parts), sympy.S.Zero)))
        return Series([Part(0.0, 0, [symbol])])

    def _without_rounding(self, part: Part) -> Part:
        """The part without coefficients that are 0 but for rounding."""
        kept = [
            c if c and abs(c) * self._size ** (part.offset + n) > NOTHING else 0
            for n, c in enumerate(part.coefficients[: self.order + 1])
        ]
        return part._replace(coefficients=kept)

    def one_sided(self, one: OneSided, side: str) -> OneSided:
        """One side with symbols for its series."""

        def points(known: Iterable[CriticalPoint], what: str) -> list[CriticalPoint]:
            """The critical points with symbols for their series."""
            return [
                p._replace(
                    series=self.named(f"{p.kind}_{what}{side}_{k}", p.series),
                    onward=self.named(f"{p.kind}_onward_{side}_{k}", p.onward),
                )
                for k, p in enumerate(known, 1)
            ]

        return one._replace(
            scale_start=self.named(f"start_scale_{side}", one.scale_start),
            speed_start=self.named(f"start_speed_{side}", one.speed_start),
            scale_points=points(one.scale_points, ""),
            speed_points=points(one.speed_points, "speed_"),
            regular_part=self.named(f"between_{side}", one.regular_part),
        )


def _horner(part: Part) -> Expr:
    """The part in x = 1/lam, lowest power taken out."""
    kept = list(part.coefficients)
    low = next((n for n, c in enumerate(kept) if c), len(kept))
    inner = sympy.S.Zero
    for c in reversed(kept[low:]):
        inner = inner * X + number_of(c)
    return X ** sympy.Rational(part.offset + low) * inner * sympy.log(LAM) ** part.logs


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

    def __truediv__(self, other: Sum) -> Sum | Ratio:
        # Errors vanish here.
        return Ratio(self, other) if self.terms else self


def as_sum(x: Sum | Expr | int) -> Sum:
    """A sum as it is, a number as a sum of one term."""
    return x if isinstance(x, Sum) else Sum([(sympy.S.Zero, sympy.sympify(x))])


def _line(height: Expr) -> tuple[Any, Any]:
    """Value at r = 1 and slope of a height, without rounding."""
    height = sympy.expand(height)
    parts = height.coeff(BEYOND_1, 0), height.coeff(BEYOND_1, 1)
    level, slope = (sympy.S.Zero if c.is_number and abs(c) < NOTHING else c for c in parts)
    return level, slope


def _nothing(height: Expr) -> bool:
    """True of a height that is 0 for all r."""
    return _line(height) == (0, 0)


class Ratio:
    """N/D, both with exponentials."""

    def __init__(self, above: Sum, below: Sum) -> None:
        self.above, self.below = above, below

    def log(self, far: float) -> tuple[Any, int]:
        """log(N/D) without overflow; terms that are `far` below are left out, and counted."""
        tops = _highest([h for h, _ in self.below.terms])
        # Each exponent of N, less D's largest: differences that are rounded once.
        above = [([h - top for top in tops], a) for h, a in self.above.terms]
        # A height is the least of these lines; one that has them all below is the larger.
        heads: list[list[Any]] = []
        for lines, _ in above:
            if not any(_all_below(lines, other) for other in heads):
                heads = [other for other in heads if not _all_below(other, lines)] + [lines]
        head = _largest([_least(lines) for lines in heads])
        total, rest, faint = [], [], 0
        for lines, a in above:
            if any(_all_below(lines, other, far) for other in heads):
                faint += 1
                continue
            if lines in heads and len(heads) == 1:
                total.append(a)
            elif len(heads) == 1 and len(lines) == 1:
                total.append(_times_exp(a, lines[0] - heads[0][0]))
            else:
                total.append(a * sympy.exp(LAM * (_least(lines) - head)))
        for h, a in self.below.terms:
            lines = [h - top for top in tops]
            if any(_all_below([line], [0], far) for line in lines):
                faint += 1
            elif len(lines) == 1:
                rest.append(_times_exp(a, lines[0]))
            else:
                rest.append(a * sympy.exp(LAM * _least(lines)))
        return (
            LAM * head + sympy.log(sympy.Add(*total)) - sympy.log(sympy.Add(*rest)),
            faint,
        )


def _times_exp(factor: Expr, line: Expr) -> Expr:
    """factor e^(lam line)."""
    level, slope = _line(line)
    return factor * sympy.exp(LAM * (level + slope * BEYOND_1))


def _all_below(lines: list[Any], others: list[Any], far: float = 0.0) -> bool:
    """True where the least of `lines` is `far` below the least of `others` for all r > 1."""
    if not lines:
        return False

    def below(h: Expr, k: Expr) -> bool:
        """True where h <= k - far for all r > 1."""
        level, slope = _line(k - h)
        return bool(level >= far and slope >= 0)

    return all(any(below(h, k) for h in lines) for k in others)


def _highest(heights: list[Any]) -> list[Any]:
    """Heights that are the largest for some r > 1."""
    highest: list[Any] = []
    for h in heights:
        if not any(_all_below([h], [k]) for k in highest):
            highest = [k for k in highest if not _all_below([k], [h])] + [h]
    return highest


def _largest(values: list[Any]) -> Expr:
    """The maximum of the values, as nested calls of `larger`."""
    largest = values[0]
    for value in values[1:]:
        largest = larger(largest, value)
    return largest


def _least(lines: list[Any]) -> Expr:
    """The minimum of the lines, as nested calls of `larger`."""
    parts = [level + slope * BEYOND_1 for level, slope in map(_line, lines)]
    return parts[0] if len(parts) == 1 else -_largest([-part for part in parts])
