"""Universal coefficients of weak noise, as polynomials in normalised derivatives of V.

Each series of `symasym.asymptotics.weak_noise` has coefficients that are polynomials, the same for
every drift, in quotients of V's derivatives at one point. They are computed once for an order, by
the recursions that evaluate them, run over a SymPy polynomial ring in place of numbers:

- at a well or a barrier u, with a_j = 2 V^(j+2)(u)/((j+2)! V''(u)), Watson's lemma
  (`symasym.asymptotics.laplace.watson.perron_coefficients`) gives

      int e^{-lam |V - V(u)|} ~ (2 pi/(lam |V''|))^(1/2) sum_n (2n-1)!! d_2n / (|V''| lam)^n;

- at any other point, with g_j = phi^(j)/(j! phi), h_k = phi^-k H_k(g) of integration by parts;
- beside a zero of A, with g_j = phi^(j+1)/((j+1)! phi'), the Laurent coefficients of h_k, whose
  primitives make up the regular part (`symasym.numbers.polynomials.laurent` for both);
- at a start on a zero of A, with the same g_j, half a Gaussian and the double integral beside it
  (`symasym.asymptotics.weak_noise.critical_points.corner_terms`).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import sympy
from sympy import QQ, Add, Mul, Pow, ring

from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.asymptotics.weak_noise.critical_points import corner_terms, finite_part_change
from symasym.base.call_context import step
from symasym.numbers.polynomials import laurent

if TYPE_CHECKING:
    from sympy import Expr

__all__ = ["Beside", "at_zero", "beside_start", "endpoint", "gaussian", "put_in"]


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


class Beside(NamedTuple):
    """Beside a start on a zero of A, polynomials in g_1, g_2, ... for n = 0, 1, ...

    With y = 1/(|phi'| lam), to the right: half of the Gaussian has sum_n odd_n y^(n+1) besides half
    of the whole one, and the double integral, that of h_n as a finite part apart, is

        sum_n y^(n+1) (plain_n + log_n (log(2/y) + gamma)) + (2 pi)^(1/2) sum_n half_n y^(n+3/2).
    """

    odd: list[Any]
    plain: list[Any]
    log: list[Any]
    half: list[Any]


@cache
def beside_start(count: int, kept: int | None, barrier: bool) -> Beside:
    """The polynomials of `Beside` up to n = `count` - 1; `kept` as in `gaussian`.

    Examples
    --------
    >>> beside_start(2, None, True).odd
    [-2/3*a1, -64/27*a1**3 + 4*a1*a2 - 8/5*a3]
    """
    one, g = _generators(2 * count - 1, _length(2 * count - 1, kept))
    f = [0, 0, -1, *(-2 * x / (j + 2) for j, x in enumerate(g, 1))]
    a = perron_coefficients(f, [one, *[one * 0] * (2 * count - 1)], 2)
    moments = [one]
    for n in range(1, count):
        moments.append(moments[-1] * (2 * n))
    plain, log, half = ([one * 0] * count for _ in range(3))
    of_sympy = SimpleNamespace(
        mpf=sympy.sympify, pi=sympy.pi, gamma=sympy.gamma, factorial=sympy.factorial,
        sin=sympy.sin, log=sympy.log, euler=sympy.EulerGamma, fsum=sum,
    )  # fmt: skip
    for i in range(2 * count):
        for j in range(2 * count - i):
            n, weight = (i + j) // 2, a[i] * a[j]
            for value, power, logs in corner_terms(sympy.S.One, i, j, barrier, of_sympy):
                if logs:
                    log[n] += weight * QQ.from_sympy(value)
                elif power.is_Integer:
                    # gamma + log(2) comes with log(lam).
                    value = sympy.expand(value)
                    value -= value.coeff(sympy.EulerGamma) * (sympy.EulerGamma + sympy.log(2))
                    plain[n] += weight * QQ.from_sympy(sympy.expand(value))
                else:
                    half[n] += weight * QQ.from_sympy(value / sympy.sqrt(2 * sympy.pi))
    slope = one if barrier else -one
    taylor = [one * 0, slope, *(slope * x for x in g)]
    for n, (_, change) in enumerate(finite_part_change(taylor, a, count, one)):
        plain[n] -= change
    odd = [a[2 * n + 1] * moment for n, moment in enumerate(moments)]
    return Beside(odd, plain, log, half)


def put_in(polynomial: Any, values: Sequence[Expr]) -> Expr:
    """The polynomial with expressions for its generators."""
    terms = []
    for powers, c in polynomial.terms():
        step()
        factors = [Pow(v, p) for v, p in zip(values, powers, strict=False) if p]
        terms.append(Mul(QQ.to_sympy(c), *factors))
    return Add(*terms)
