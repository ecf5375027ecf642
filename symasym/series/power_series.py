"""Truncated power series as lists of their coefficients, in any arithmetic.

c[0] + c[1] t + ... + c[n - 1] t^(n - 1) + O(t^n), over floats, rows of arrays (one column a scene),
Fractions, mpf, balls, or elements of a SymPy field. Powers, exponentials and what follows from
them solve a differential equation of first order, y' a = b y, coefficient by coefficient
(J. C. P. Miller's recurrence; P. Henrici, Applied and Computational Complex Analysis 1, section
1.6; Knuth, The Art of Computer Programming 2, section 4.7), so that nothing is composed.

Sums of products of mpf are rounded once, which takes a quarter of the time; coefficients that are
exactly zero, as most of a polynomial's, are passed over.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from symasym.base.patience import step
from symasym.generated.plain_formulas import fall_by_powers, manifold_term
from symasym.numbers.arithmetic import Number

__all__ = [
    "Truncated", "composed", "dot", "exponential", "laurent", "power", "product", "quotient",
    "reciprocal", "residues", "rotation",
]  # fmt: skip

Coefficients = Sequence[Any]


def dot(a: Coefficients, b: Coefficients) -> Any:
    """The sum of a[k] b[k]."""
    return _sum(list(zip(a, b, strict=True)), 0)


def _sum(pairs: list[tuple[Any, Any]], nothing: Number) -> Any:
    """The sum of all products; `nothing` if there are none."""
    if len(pairs) > 2:
        context = getattr(pairs[0][0], "context", None) or getattr(pairs[0][1], "context", None)
        if context is not None:
            step()
            return context.fdot(pairs)
    if not pairs:
        return nothing
    total = pairs[0][0] * pairs[0][1]
    for x, y in pairs[1:]:
        total = total + x * y
    return total


def _support(c: Coefficients, first: int = 0) -> list[int]:
    """Indices from `first` on whose coefficient is not exactly zero."""
    return [k for k in range(first, len(c)) if isinstance(c[k], np.ndarray) or c[k] != 0]


def product(a: Coefficients, b: Coefficients, count: int | None = None) -> list[Any]:
    """The first `count` coefficients of a b, as many as both determine by default."""
    count = min(len(a), len(b)) if count is None else count
    others = _support(b[:count])
    rows: list[list[tuple[Any, Any]]] = [[] for _ in range(count)]
    for j in _support(a[:count]):
        x = a[j]
        for k in others:
            if j + k >= count:
                break
            rows[j + k].append((x, b[k]))
    nothing = 0 * a[0] * b[0]
    return [_sum(row, nothing) for row in rows]


def quotient(a: Coefficients, b: Coefficients, count: int) -> list[Any]:
    """The first `count` coefficients of a/b, b[0] not zero."""
    inverse, support = 1 / b[0], _support(b[:count], 1)
    rounded_once = hasattr(inverse, "context")
    series: list[Any] = []
    for n in range(count):
        near = [j for j in support if j <= n]
        total: Any = a[n] if n < len(a) else 0
        if near and rounded_once:
            total = total - _sum([(b[j], series[n - j]) for j in near], 0)
        elif near:
            total = total - b[near[0]] * series[n - near[0]]
            for j in near[1:]:
                # In place, now that it is not an entry of a any more.
                total -= b[j] * series[n - j]
        series.append(total * inverse)
    return series


def reciprocal(c: Coefficients) -> list[Any]:
    """As many coefficients of 1/c, c[0] not zero."""
    return quotient([1], c, len(c))


def composed(outer: Coefficients, inner: Coefficients, count: int) -> list[Any]:
    """The first `count` coefficients of outer(inner(t)), inner[0] = 0, by Horner's rule."""
    total = [0 * inner[0]] * count
    for c in reversed(outer):
        total = product(total, inner, count)
        total[0] = total[0] + c
    return total


def power(c: Coefficients, p: Number, q: int, count: int, first: Number) -> list[Any]:
    """The first `count` coefficients of c^(p/q); `first` is c[0]^(p/q).

    p and q are integers, or p an element of the arithmetic and q = 1.
    """
    support, series = _support(c[:count], 1), [first]
    for n in range(1, count):
        pairs = [((p * j - q * (n - j)) * c[j], series[n - j]) for j in support if j <= n]
        series.append(_sum(pairs, 0 * first) / (c[0] * (q * n)))
    return series


def exponential(c: Coefficients, count: int, first: Number) -> list[Any]:
    """The first `count` coefficients of e^c times a constant; `first` is the first."""
    slopes, series = _slopes(c, count), [first]
    for n in range(1, count):
        series.append(_next(slopes, series, n, 0 * first) / n)
    return series


def rotation(
    c: Coefficients, count: int, first: tuple[Any, Any], sign: int
) -> tuple[list[Any], list[Any]]:
    """sin c and cos c (`sign` -1) or sinh c and cosh c (1), from both values at c[0]."""
    slopes, (s, k) = _slopes(c, count), ([value] for value in first)
    for n in range(1, count):
        up, down = (_next(slopes, row, n, 0 * first[0]) / n for row in (k, s))
        s.append(up)
        k.append(sign * down)
    return s, k


def _slopes(c: Coefficients, count: int) -> list[tuple[int, Any]]:
    """The nonzero coefficients of t c', by their powers."""
    return [(j, j * c[j]) for j in _support(c[:count], 1)]


def _next(slopes: list[tuple[int, Any]], known: list[Any], n: int, nothing: Number) -> Any:
    """Coefficient n - 1 of c' times the series that is known to order n - 1."""
    return _sum([(s, known[n - j]) for j, s in slopes if j <= n], nothing)


class Truncated:
    """A power series of `count` coefficients `c`, on which emitted formulas run."""

    def __init__(self, c: Coefficients, count: int) -> None:
        self.c, self.count = c, count

    def __neg__(self) -> Truncated:
        return Truncated([-x for x in self.c], self.count)

    def __sub__(self, other: Truncated) -> Truncated:
        rows = zip(self.c, other.c, strict=True)
        return Truncated([x - y for x, y in rows], self.count)

    def __mul__(self, other: Truncated) -> Truncated:
        return Truncated(product(self.c, other.c, self.count), self.count)

    def __truediv__(self, other: Truncated) -> Truncated:
        return Truncated(quotient(self.c, other.c, self.count), self.count)


def laurent(
    phi: Coefficients, zero: bool, count: int, weight: Coefficients | None = None
) -> Iterator[list[Any]]:
    """The series of h_1 = g/phi, h_(k + 1) = -h_k'/phi, up to h_count; g = 1 without a `weight`.

    Integration by parts of int g e^(±lam V), V' = -phi, leaves the h_k as coefficients of lam^-k;
    with alternating signs they are the slow manifold of M' = g - lam phi M
    (`endpoint-series`). If `zero`, phi[0]
    counts as 0 and the series are those of h_k t^(2k - 1); else each is a coefficient shorter than
    the one before.
    """
    # Divided by phi, which is short where it is a polynomial, not times 1/phi.
    psi = phi[1:] if zero else phi
    count_of = len(psi) if weight is None else min(len(weight), len(psi))
    drift: Any = Truncated(psi, len(psi))
    source: Any = Truncated([1] if weight is None else weight, count_of)
    last = manifold_term(source, drift).c
    yield last
    for k in range(1, count):
        pole = 2 * k - 1 if zero else 0
        fall = [fall_by_powers(j, pole, c) for j, c in enumerate(last)][0 if zero else 1 :]
        source = Truncated(fall, len(fall))
        last = manifold_term(source, drift).c
        yield last


def residues(
    phi: Coefficients, count: int, weight: Coefficients | None = None, outer: Coefficients = (1,)
) -> list[Any]:
    """Residues of outer h_1, ..., outer h_count at a simple zero of phi, h_k those of `laurent`.

    The series are about the zero, phi[0] counts as 0; at least 2 `count` coefficients each.
    """
    rows = laurent(phi, True, count, weight)
    return [product(outer, row, 2 * k + 1)[2 * k] for k, row in enumerate(rows)]
