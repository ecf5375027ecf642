"""Taylor models in y = lam^(-1/2), for all 0 < y <= top at once.

A `Model` is y^v (c_0 + c_1 y + … + c_{n-1} y^{n-1}) with a bound of the complement, relative to
y^(v + n); sums, products and quotients carry that bound along (K. Makino, M. Berz, Taylor models
and other validated functional inclusion methods, Int. J. Pure Appl. Math. 4 (2003) 379). A
`SmallTerms` is a sum of C y^p e^(-gap/y^2), which no power of y sees. All in balls.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import flint

from symasym.numbers.balls import NotProved

if TYPE_CHECKING:
    from flint import arb

# Parts of the range on each of which a polynomial is bounded.
_PARTS = 12


class Range(NamedTuple):
    """0 < y <= `top`, a ball, and the number of coefficients kept."""

    top: Any
    terms: int


class Model(NamedTuple):
    """|f - y^power sum c_k y^k| <= tail_bound y^(power + terms), on the whole of `over`."""

    power: int
    coefficients: tuple[Any, ...]
    tail_bound: Any
    over: Range

    def __add__(self, other: Model) -> Model:  # type: ignore[override]
        if self.power > other.power:
            return other + self
        shift = other.power - self.power
        moved = (*[0] * shift, *other.coefficients)
        sums = [a + b for a, b in zip(self.coefficients, moved, strict=False)]
        lost = _sizes(moved[self.over.terms :], self.over.top)
        tail = self.tail_bound + lost + other.tail_bound * self.over.top**shift
        return self._replace(coefficients=tuple(sums), tail_bound=tail.upper())

    def __mul__(self, other: Model) -> Model:  # type: ignore[override]
        count, top = self.over.terms, self.over.top
        product = flint.arb_poly(list(self.coefficients)) * flint.arb_poly(list(other.coefficients))
        all_terms = [product[k] for k in range(2 * count)]
        tail = _sizes(all_terms[count:], top)
        tail += self.largest() * other.tail_bound + (other.polynomial_size()) * self.tail_bound
        return Model(self.power + other.power, tuple(all_terms[:count]), tail.upper(), self.over)

    def __truediv__(self, other: Model) -> Model:
        """The quotient; NotProved where the divisor is not shown to be positive."""
        count, top = self.over.terms, self.over.top
        least = other.least()
        if not other.coefficients[0] > 0:
            raise NotProved
        quotient: list[Any] = []
        for k, c in enumerate(self.coefficients):
            known = sum(
                (q * other.coefficients[k - j] for j, q in enumerate(quotient)), flint.arb(0)
            )
            quotient.append((c - known) / other.coefficients[0])
        # f - h g begins with y^count: the product of the two polynomials there, and both rests.
        product = flint.arb_poly(quotient) * flint.arb_poly(list(other.coefficients))
        lost = _sizes([product[k] for k in range(count, 2 * count)], top)
        size = _largest(quotient, top)
        tail = (lost + self.tail_bound + size * other.tail_bound) / least
        return Model(self.power - other.power, tuple(quotient), tail.upper(), self.over)

    def least(self) -> Any:
        """A positive lower bound of y^(-power) f; NotProved where there is none."""
        top, count = self.over.top, self.over.terms
        low = flint.arb("inf")
        for part in _parts(flint.arb(0), top):
            low = low.min(_value(self.coefficients, part).lower())
        low = (low - self.tail_bound * top**count).lower()
        if not low > 0:
            raise NotProved
        return low

    def polynomial_size(self) -> Any:
        """An upper bound of |sum c_k y^k| on the whole range."""
        return _largest(self.coefficients, self.over.top)

    def largest(self) -> Any:
        """An upper bound of |y^(-power) f|."""
        return (self.polynomial_size() + self.tail_bound * self.over.top**self.over.terms).upper()

    def tail(self, first: int, low: arb) -> Any:
        """The largest |f y^(-power) - its first terms|/y^first for low <= y <= top."""
        beyond = _largest(self.coefficients[first:], self.over.top, low)
        return (beyond + self.tail_bound * self.over.top ** (self.over.terms - first)).upper()


class SmallTerm(NamedTuple):
    """size y^power e^(-gap/y^2)."""

    size: Any
    power: int
    gap: Any


SmallTerms = tuple[SmallTerm, ...]


def supremum(terms: Iterable[SmallTerm], power: int, low: arb, top: arb) -> Any:
    """An upper bound of sum |terms| y^(-power) for low <= y <= top."""
    total = flint.arb(0)
    for size, own, gap in terms:
        if not gap > 0:
            raise NotProved
        falls = power - own
        # y^-q e^(-gap/y^2) rises up to y^2 = 2 gap/q and falls from there.
        y = top
        if falls > 0:
            summit = (2 * gap / falls).sqrt()
            y = top.min(summit).max(low)
        total += size * (y ** (-falls)) * (-gap / y**2).exp()
    return total.upper()


def _parts(low: arb, top: arb) -> list[Any]:
    """Balls that cover [low, top]."""
    width = (top - low) / _PARTS
    edges = [low + k * width for k in range(_PARTS + 1)]
    return [a.union(b) for a, b in pairwise(edges)]


def _value(coefficients: Sequence[Any], y: arb) -> Any:
    """sum c_k y^k."""
    total = flint.arb(0)
    for c in reversed(coefficients):
        total = total * y + c
    return total


def _largest(coefficients: Sequence[Any], top: arb, low: arb | int = 0) -> Any:
    """An upper bound of |sum c_k y^k| for low <= y <= top."""
    most = flint.arb(0)
    for part in _parts(flint.arb(low), top):
        most = most.max(abs(_value(coefficients, part)).upper())
    return most


def _sizes(coefficients: Sequence[Any], top: arb) -> Any:
    """sum |c_k| top^k."""
    return _value([abs(flint.arb(c)) for c in coefficients], top)
