"""Truncated power series over any ring: Fractions, balls, SymPy's expressions and field elements.

A series is the list of its coefficients of t^0, t^1, ...; what is beyond the list is unknown, and
an operation keeps as many as are known. Elements need + and * with each other, * and / with whole
numbers; quotients and powers divide by the first coefficient alone.
"""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from typing import Any


class Series:
    """c[0] + c[1] t + ... + O(t^len(c))."""

    __slots__ = ("c",)

    def __init__(self, c: Iterable[Any]) -> None:
        self.c = list(c)

    def __len__(self) -> int:
        return len(self.c)

    def __getitem__(self, k: int) -> Any:
        return self.c[k]

    def __add__(self, other: Series) -> Series:
        return Series(a + b for a, b in zip(self.c, other.c, strict=False))

    def __sub__(self, other: Series) -> Series:
        return Series(a - b for a, b in zip(self.c, other.c, strict=False))

    def __neg__(self) -> Series:
        return Series(-a for a in self.c)

    def __mul__(self, other: Any) -> Series:
        """The product with a series, or with an element of the ring."""
        if not isinstance(other, Series):
            return Series(a * other for a in self.c)
        a, b = self.c, other.c
        return Series(dot(a[: k + 1], b[k::-1]) for k in range(min(len(a), len(b))))

    def __truediv__(self, other: Any) -> Series:
        """The quotient q, from b q = a term by term."""
        if not isinstance(other, Series):
            return Series(a / other for a in self.c)
        b, q = other.c, list[Any]()
        for k in range(min(len(self), len(b))):
            q.append(_over(self.c[k] - dot(q, b[k:0:-1]) if k else self.c[0], b[0]))
        return Series(q)

    def power(self, p: Any, first: Any = None) -> Series:
        """The power p, rational or an element of the ring; `first` is that of the coefficient c[0].

        J. C. P. Miller's recurrence n a_0 b_n = sum (p k - n + k) a_k b_(n-k) (D. E. Knuth, The Art
        of Computer Programming 2, 4.7).
        """
        rational = isinstance(p, (int, Fraction))
        above, below = (p.numerator, p.denominator) if rational else (p, 1)
        a, b = self.c, [_power(self.c[0], p) if first is None else first]
        for n in range(1, len(a)):
            ks = [k for k in range(1, n + 1) if (a[k] == 0) is not True]
            factors = [above * k - below * (n - k) for k in ks]
            total = dot([b[n - k] * a[k] for k in ks], factors) / (n * below) if ks else a[0] * 0
            b.append(_over(total, a[0]))
        return Series(b)

    __pow__ = power

    def slope(self) -> Series:
        """The derivative."""
        return Series(a * k for k, a in enumerate(self.c) if k)

    def theta(self) -> Series:
        """t d/dt."""
        return Series(a * k for k, a in enumerate(self.c))


def dot(a: list[Any], b: list[Any]) -> Any:
    """The sum of a_k b_k."""
    row = [x * y for x, y in zip(a, b, strict=False)]
    return sum(row[1:], row[0])


def _over(x: Any, y: Any) -> Any:
    """x/y; nothing is asked of a polynomial over 1."""
    return x if (y == 1) is True else x / y


def _power(x: Any, p: Any) -> Any:
    """x^p; 1 stays 1, in whatever ring."""
    if (x == 1) is True or p == 1:
        return x
    if not isinstance(p, (int, Fraction)):
        return x**p
    return x ** int(p) if p.denominator == 1 else x ** ((x * 0 + p.numerator) / p.denominator)
