"""Iterated integrals through a coalescence as formulas, in products of SymPy's Airy functions.

As in `symasym.asymptotics.coalescence.formulas` they hold beside the coalescence, where both
points of f are real. The regular part is the real part of an antiderivative of a rational function:
Hadamard's finite part.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.endpoints import end_series
from symasym.asymptotics.coalescence.formulas import taylor_of, two_saddles
from symasym.asymptotics.coalescence.iterated import end_products
from symasym.base.errors import InputError
from symasym.series.power_series import product
from symasym.special.airy_products import product_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr, Symbol

    from symasym.special.airy_products import Rows

Series = list[Any]


def iterated_formula(
    f: Expr,
    g: Expr,
    h: Expr,
    x: Symbol,
    lo: Expr,
    hi: Expr,
    order: int,
    lam: Symbol,
    saddles: Sequence[Expr] | None,
) -> Expr:
    """Expansion at a minimum and a maximum of f, both real, with the finite ends."""
    third = sympy.cbrt(lam)
    root, level, direction, (falling, rising) = two_saddles(-f, (g, h), x, saddles, order)
    z, level = third**2 * root**2, -level
    functions = (
        (sympy.airyai(z) ** 2 + sympy.airybi(z) ** 2) / third**2,
        (sympy.airyai(z) * sympy.airyaiprime(z) + sympy.airybi(z) * sympy.airybiprime(z)) / lam,
        (sympy.airyaiprime(z) ** 2 + sympy.airybiprime(z) ** 2) / third**4,
    )
    total = sum(y * lam ** (-k - 1) for k, y in enumerate(_regular(f, g, h, x, lo, hi, order)))
    if direction == 1:
        for n, row in enumerate(product_rows(falling, rising)):
            inner = sum(c * y for c, y in zip(row, functions, strict=True))
            total += sympy.pi**2 * lam**-n * inner

    def single(rows: Rows, step: int) -> Series:
        """The expansion of one integral of the pair, in Bi and Bi'."""
        bi, slope = sympy.airybi(z) / third, sympy.airybiprime(z) / third**2
        return [
            sympy.pi * (step * lam) ** -n * (a * bi + step * b * slope)
            for n, (a, b) in enumerate(rows)
        ]

    def end(phase: Expr, weight: Expr, at: Expr, side: int) -> Series:
        """Watson's series at an end."""
        steep = [side**k * y for k, y in enumerate(taylor_of(phase, x, at, order + 2))]
        row = [side**k * y for k, y in enumerate(taylor_of(weight, x, at, max(order, 2))[:order])]
        return [y * lam ** (-n - 1) for n, y in enumerate(end_series(steep, row))]

    low: tuple[Any, ...] = ()
    high: tuple[Any, ...] = ()
    if not lo.is_infinite:
        low = f.xreplace({x: lo}), end(-f, g, lo, 1), end(f, h, lo, 1)
    if not hi.is_infinite:
        high = f.xreplace({x: hi}), end(f, h, hi, -1)
    pair = single(falling, -1), single(rising, 1)
    for exponent, inner, outer in end_products(level, pair, low, high):
        total += sympy.exp(lam * exponent) * sum(product(inner, outer))
    return total


def _regular(f: Expr, g: Expr, h: Expr, x: Symbol, lo: Expr, hi: Expr, order: int) -> Series:
    """Finite parts of the integrals of h m_k, m_1 = -g/f', m_(k+1) = m_k'/f'."""
    slope = sympy.diff(f, x)
    m, integrals = sympy.together(-g / slope), []
    for _ in range(order):
        integrand = sympy.cancel(h * m)
        if not integrand.is_rational_function(x):
            raise InputError(
                f"h g/f' = {integrand} is not rational in {x}, so the part with u near v has no "
                "formula here; take numbers from bind(…) and evaluate."
            )
        parts = [_antiderivative(y, x) for y in sympy.Add.make_args(sympy.apart(integrand, x))]
        rise = sum(_at(y, x, hi) - _at(y, x, lo) for y in parts)
        integrals.append(sympy.simplify(rise))
        m = sympy.together(sympy.diff(m, x) / slope)
    return integrals


def _antiderivative(fraction: Expr, x: Symbol) -> Expr:
    """The real antiderivative of one partial fraction, with log|y| for log(y)."""
    front, rest = fraction.as_independent(x, as_Add=False)
    whole = sympy.integrate(rest, x)
    if whole.has(sympy.Integral, sympy.RootSum):
        raise InputError(
            f"SymPy finds no antiderivative of {rest} in elementary functions; take numbers from "
            "bind(…) and evaluate."
        )
    return front * whole.replace(sympy.log, lambda y: sympy.log(y**2) / 2)


def _at(whole: Expr, x: Symbol, end: Expr) -> Expr:
    """An antiderivative at an end; at an infinite one its limit without log(x), which cancels."""
    if not end.is_infinite:
        return whole.xreplace({x: end})

    def leading(y: Expr) -> Expr:
        return sympy.log(sympy.LC(y, x)) if y.has(x) else sympy.log(y)

    # The integral converges, so that log(x) itself cancels between all fractions.
    far = sympy.Dummy("far", positive=True)
    shown = whole.replace(sympy.log, leading).xreplace({x: far if end == sympy.oo else -far})
    return sympy.limit(shown, far, sympy.oo)
