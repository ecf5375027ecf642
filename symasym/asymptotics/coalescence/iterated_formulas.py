"""Iterated integrals through a coalescence as formulas, in SymPy's Airy functions.

As in `symasym.asymptotics.coalescence.formulas` they hold beside the coalescence, where both
points of f are real. The outer part is an antiderivative of a rational function, its real part.
"""

from __future__ import annotations

from typing import Any

import sympy

from symasym.asymptotics.coalescence.formulas import taylor_of, two_saddles
from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.errors import InputError
from symasym.special.airy_products import product_rows

Series = list[Any]


def iterated_formula(
    f: Any, g: Any, h: Any, x: Any, lo: Any, hi: Any, order: int, lam: Any, saddles: Any
) -> Any:
    """Expansion at a minimum and a maximum of f, both real, with the finite ends."""
    third = sympy.cbrt(lam)
    root, level, direction, (falling, rising) = two_saddles(-f, (g, h), x, saddles, order)
    z, level = third**2 * root**2, -level
    functions = (
        (sympy.airyai(z) ** 2 + sympy.airybi(z) ** 2) / third**2,
        (sympy.airyai(z) * sympy.airyaiprime(z) + sympy.airybi(z) * sympy.airybiprime(z)) / lam,
        (sympy.airyaiprime(z) ** 2 + sympy.airybiprime(z) ** 2) / third**4,
    )
    total = sum(y * lam ** (-k - 1) for k, y in enumerate(_outer(f, g, h, x, lo, hi, order)))
    if direction == 1:
        for n, row in enumerate(product_rows(falling, rising)):
            inner = sum(c * y for c, y in zip(row, functions, strict=True))
            total += sympy.pi**2 * lam**-n * inner

    def single(rows: Any, step: int) -> Series:
        bi, slope = sympy.airybi(z) / third, sympy.airybiprime(z) / third**2
        return [sympy.pi * (a * bi + step * b * slope) for a, b in rows]

    signed = [((-1) ** n * a, (-1) ** n * b) for n, (a, b) in enumerate(falling)]
    down, up = [(-level, single(signed, -1))], [(level, single(rising, 1))]
    pairs = []
    if not lo.is_infinite:
        height = f.xreplace({x: lo})
        first, second = _end(-f, g, x, lo, 1, order), _end(f, h, x, lo, 1, order)
        pairs.append((0, first, 2, second))
        pairs += [(y - height, first, 1, row) for y, row in up]
        down.append((-height, first))
    if not hi.is_infinite:
        height, last = f.xreplace({x: hi}), _end(f, h, x, hi, -1, order)
        pairs += [(height + y, row, 1 if row is down[0][1] else 2, last) for y, row in down]
    for exponent, one, power, other in pairs:
        series = sum(
            one[i] * other[n - i] * lam ** (-n - power) for n in range(order) for i in range(n + 1)
        )
        total += sympy.exp(lam * exponent) * series
    return total


def _end(f: Any, g: Any, x: Any, end: Any, side: int, order: int) -> Series:
    """Of int g e^{lam f} from the end to its side, over e^{lam f(end)}/lam."""
    steep = [side**k * y for k, y in enumerate(taylor_of(f, x, end, order + 2))]
    weight = [side**k * y for k, y in enumerate(taylor_of(g, x, end, max(order, 2))[:order])]
    d = perron_coefficients(steep[: order + 1], weight, 1)
    return [y * sympy.factorial(n) / (-steep[1]) ** (n + 1) for n, y in enumerate(d)]


def _outer(f: Any, g: Any, h: Any, x: Any, lo: Any, hi: Any, order: int) -> Series:
    """Finite parts of the integrals of h m_k, m_1 = -g/f', m_(k+1) = m_k'/f'."""
    slope = sympy.diff(f, x)
    m, found = sympy.together(-g / slope), []
    for _ in range(order):
        integrand = sympy.cancel(h * m)
        if not integrand.is_rational_function(x):
            raise InputError(
                f"h g/f' = {integrand} is not rational in {x}, so the part with u near v has no "
                "formula here; take numbers from bind(…) and evaluate."
            )
        parts = [_antiderivative(y, x) for y in sympy.Add.make_args(sympy.apart(integrand, x))]
        rise = sum(_at(y, x, hi) - _at(y, x, lo) for y in parts)
        found.append(sympy.simplify(rise))
        m = sympy.together(sympy.diff(m, x) / slope)
    return found


def _antiderivative(fraction: Any, x: Any) -> Any:
    """Of one partial fraction, with log|y| for log(y): the real part on both sides of a zero."""
    front, rest = fraction.as_independent(x, as_Add=False)
    whole = sympy.integrate(rest, x)
    if whole.has(sympy.Integral, sympy.RootSum):
        raise InputError(
            f"SymPy finds no antiderivative of {rest} in elementary functions; take numbers from "
            "bind(…) and evaluate."
        )
    return front * whole.replace(sympy.log, lambda y: sympy.log(y**2) / 2)


def _at(whole: Any, x: Any, end: Any) -> Any:
    if not end.is_infinite:
        return whole.xreplace({x: end})

    def leading(y: Any) -> Any:
        return sympy.log(sympy.LC(y, x)) if y.has(x) else sympy.log(y)

    # The integral converges, so that log(x) itself cancels between all fractions.
    far = sympy.Dummy("far", positive=True)
    shown = whole.replace(sympy.log, leading).xreplace({x: far if end == sympy.oo else -far})
    return sympy.limit(shown, far, sympy.oo)
