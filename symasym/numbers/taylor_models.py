"""Functions of y = lam^(-1/2) near 0, for all y of a range at once: polynomials, and their rests.

A `Model` is y^v (c_0 + c_1 y + …) with a bound of what is left out, relative to y^(v + terms). A
`Small` is a sum of C y^p e^(-delta/y^2), which no power of y sees. All in balls.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

from symasym.numbers.balls import NotProved, flint_module

# Parts of the range on each of which a polynomial is bounded.
_PARTS = 12


class Range(NamedTuple):
    """0 < y <= `top`, a ball, and the number of coefficients kept."""

    top: Any
    terms: int


class Model(NamedTuple):
    """|f - y^power sum c_k y^k| <= rest y^(power + terms), on the whole of `over`."""

    power: int
    coefficients: tuple[Any, ...]
    rest: Any
    over: Range

    def __add__(self, other: Model) -> Model:  # type: ignore[override]
        if self.power > other.power:
            return other + self
        shift = other.power - self.power
        moved = (*[0] * shift, *other.coefficients)
        sums = [a + b for a, b in zip(self.coefficients, moved, strict=False)]
        lost = _sizes(moved[self.over.terms :], self.over.top)
        rest = self.rest + lost + other.rest * self.over.top**shift
        return self._replace(coefficients=tuple(sums), rest=rest.upper())

    def __mul__(self, other: Model) -> Model:  # type: ignore[override]
        flint, count, top = flint_module(), self.over.terms, self.over.top
        product = flint.arb_poly(list(self.coefficients)) * flint.arb_poly(list(other.coefficients))
        found = [product[k] for k in range(2 * count)]
        rest = _sizes(found[count:], top)
        rest += self.largest() * other.rest + (other.polynomial_size()) * self.rest
        return Model(self.power + other.power, tuple(found[:count]), rest.upper(), self.over)

    def __truediv__(self, other: Model) -> Model:
        """The quotient; NotProved where the divisor is not shown to be positive."""
        flint, count, top = flint_module(), self.over.terms, self.over.top
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
        rest = (lost + self.rest + size * other.rest) / least
        return Model(self.power - other.power, tuple(quotient), rest.upper(), self.over)

    def least(self) -> Any:
        """A positive lower bound of y^(-power) f; NotProved where there is none."""
        top, count = self.over.top, self.over.terms
        flint = flint_module()
        low = flint.arb("inf")
        for part in _parts(flint.arb(0), top):
            low = low.min(_value(self.coefficients, part).lower())
        low = (low - self.rest * top**count).lower()
        if not low > 0:
            raise NotProved
        return low

    def polynomial_size(self) -> Any:
        return _largest(self.coefficients, self.over.top)

    def largest(self) -> Any:
        """An upper bound of |y^(-power) f|."""
        return (self.polynomial_size() + self.rest * self.over.top**self.over.terms).upper()

    def tail(self, first: int, low: Any) -> Any:
        """The largest |f y^(-power) - its first terms|/y^first for low <= y <= top."""
        beyond = _largest(self.coefficients[first:], self.over.top, low)
        return (beyond + self.rest * self.over.top ** (self.over.terms - first)).upper()


class Term(NamedTuple):
    """size y^power e^(-gap/y^2)."""

    size: Any
    power: int
    gap: Any


Small = tuple[Term, ...]


def supremum(terms: Iterable[Term], power: int, low: Any, top: Any) -> Any:
    """An upper bound of sum |terms| y^(-power) for low <= y <= top."""
    total = flint_module().arb(0)
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


def _parts(low: Any, top: Any) -> list[Any]:
    width = (top - low) / _PARTS
    found = []
    for k in range(_PARTS):
        a, b = low + k * width, low + (k + 1) * width
        found.append(a.union(b))
    return found


def _value(coefficients: Sequence[Any], y: Any) -> Any:
    total = flint_module().arb(0)
    for c in reversed(coefficients):
        total = total * y + c
    return total


def _largest(coefficients: Sequence[Any], top: Any, low: Any = 0) -> Any:
    flint = flint_module()
    found = flint.arb(0)
    for part in _parts(flint.arb(low), top):
        found = found.max(abs(_value(coefficients, part)).upper())
    return found


def _sizes(coefficients: Sequence[Any], top: Any) -> Any:
    """sum |c_k| top^k."""
    flint = flint_module()
    return _value([abs(flint.arb(c)) for c in coefficients], top)
