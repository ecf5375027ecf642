"""Universal coefficients of weak noise, as polynomials in normalised derivatives of V.

Each series of `symasym.asymptotics.weak_noise` has coefficients that are polynomials, the same for
every drift, in quotients of V's derivatives at one point. They are computed once for an order, by
the recursions that evaluate them, run over a SymPy polynomial ring in place of numbers:

- at a well or a barrier u, with a_j = 2 V^(j+2)(u)/((j+2)! V''(u)), Watson's lemma
  (`symasym.asymptotics.laplace.watson.perron_coefficients`) gives

      int e^{-lam |V - V(u)|} ~ (2 pi/(lam |V''|))^(1/2) sum_n (2n-1)!! d_2n / (|V''| lam)^n;

- at any other point, with g_j = phi^(j)/(j! phi), h_k = phi^-k H_k(g) of integration by parts;
- beside a zero of A, with g_j = phi^(j+1)/((j+1)! phi'), the Laurent coefficients of h_k, whose
  primitives make up the regular part (`symasym.numbers.polynomials.laurent` for both).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

from sympy import QQ, Add, Mul, Pow, ring

from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.call_context import step
from symasym.numbers.polynomials import laurent

if TYPE_CHECKING:
    from sympy import Expr

__all__ = ["at_zero", "endpoint", "gaussian", "put_in"]


@cache
def _generators(count: int, kept: int) -> tuple[Any, list[Any]]:
    """1, and generators 1 to `kept` followed by zeros up to `count`, of one ring."""
    domain, *known = ring([f"a{j}" for j in range(1, max(kept, 1) + 1)], QQ)
    return domain.one, [*known[:kept], *[domain.zero] * (count - kept)]


def _length(count: int, kept: int | None) -> int:
    """The number of generators that are not zero."""
    return count if kept is None else max(0, min(count, kept))


@cache
def gaussian(order: int, kept: int | None = None) -> list[Any]:
    """(2n-1)!! d_2n for n = 0 to `order`, polynomials in a_1, a_2, ...

    `kept` is how many of these are not 0, where A is a polynomial.

    Examples
    --------
    >>> gaussian(1)
    [1, 15/8*a1**2 - 3/2*a2]
    """
    one, alpha = _generators(2 * order, _length(2 * order, kept))
    f = [0, 0, -1, *(-a for a in alpha)]
    reduced = perron_coefficients(f, [one, *[one * 0] * (2 * order)], 2, step=2)
    moments = [1]
    for n in range(order):
        moments.append(moments[-1] * (2 * n + 1))
    return [d * m for d, m in zip(reduced, moments, strict=True)]


@cache
def endpoint(count: int, kept: int | None = None) -> list[Any]:
    """H_1, ..., H_count, polynomials in g_1, g_2, ...

    Examples
    --------
    >>> endpoint(3)
    [1, a1, 3*a1**2 - 2*a2]
    """
    one, g = _generators(count - 1, _length(count - 1, kept))
    rows = laurent([QQ(1), *g], False, count)
    return [one * row[0] for row in rows]


@cache
def at_zero(count: int, kept: int | None = None) -> list[list[Any]]:
    """Of h_k, k = 1 to `count`, coefficients of t^(1 - 2k) to t^-1 times phi'^k.

    Examples
    --------
    >>> at_zero(2)
    [[1], [1, -a1, 0]]
    """
    length = 2 * count - 1
    one, g = _generators(length - 1, _length(length - 1, kept))
    rows = laurent([one * 0, QQ(1), *g], True, count)
    return [[one * c for c in row[: 2 * k + 1]] for k, row in enumerate(rows)]


def put_in(polynomial: Any, values: Sequence[Expr]) -> Expr:
    """The polynomial with expressions for its generators."""
    terms = []
    for powers, c in polynomial.terms():
        step()
        factors = [Pow(v, p) for v, p in zip(values, powers, strict=False) if p]
        terms.append(Mul(QQ.to_sympy(c), *factors))
    return Add(*terms)
