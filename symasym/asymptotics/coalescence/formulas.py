"""Uniform expansions as formulas: Chester-Friedman-Ursell and Bleistein in SymPy's functions.

airyai, airyaiprime and erfc stand with coefficients in closed form. These hold beside the
coalescence: at it they are 0/0, and numbers come from `bind` and `evaluate`. The algebra is that of
the numbers, over SymPy's elements: `.cubic_map` (both saddles), `.parts` (ends), `.iterated`
(products of Airy functions). Of an iterated integral the regular part is the real part of an
antiderivative of a rational function: Hadamard's finite part.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.cubic_map import both_saddles, slope_by_square
from symasym.asymptotics.coalescence.iterated import end_products
from symasym.asymptotics.coalescence.parts import beyond_erfc, end_series, saddle_rows
from symasym.asymptotics.laplace.kinks import number
from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.errors import InputError
from symasym.generated.formulas import over_pair, pair_units
from symasym.numbers.polynomials import product
from symasym.series.coefficient_fields import ExpressionField, sampled_parameters, vanishes
from symasym.series.taylor_series import NotAnalytic, taylor
from symasym.special.airy import by_parts, product_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr, Symbol

    from symasym.special.airy import Rows

#: Terms beyond this one are too long to be of use as formulas.
MOST_TERMS = 3


def pair_formula(
    f: Expr,
    g: Expr,
    x: Symbol,
    order: int,
    lam: Symbol,
    saddles: Sequence[Expr] | None,
    oscillating: bool,
) -> Expr:
    """Expansion at two real saddles, of the integral over i where it's not oscillating."""
    root, level, direction, ((*rows,),) = two_saddles(f, (g,), x, saddles, order)
    a, b = zip(*rows, strict=True)
    argument = (-1 if oscillating else 1) * lam ** sympy.Rational(2, 3) * root**2
    unit = sympy.I if oscillating else sympy.Integer(1)
    step = sympy.I / lam if oscillating else -1 / lam
    turn = -sympy.I if oscillating else sympy.Integer(-1)
    airy = sympy.airyai(argument) * lam ** -sympy.Rational(1, 3)
    slope = turn * sympy.airyaiprime(argument) * lam ** -sympy.Rational(2, 3)
    total = airy * sum(y * step**n for n, y in enumerate(a))
    total += slope * sum(y * step**n for n, y in enumerate(b))
    return 2 * sympy.pi * sympy.exp(unit * lam * level) * total


def two_saddles(
    f: Expr, weights: tuple[Any, ...], x: Symbol, saddles: Sequence[Expr] | None, order: int
) -> tuple[Expr, Expr, Expr, list[list[tuple[Expr, Expr]]]]:
    """sqrt(zeta), f's mean, the direction of s, and for each weight (a_n, b_n) with its sign."""
    low, high = _pair_of(f, x, saddles)
    level = (f.xreplace({x: low}) + f.xreplace({x: high})) / 2
    # At s = + sqrt(zeta) f has a minimum, at s = - sqrt(zeta) a maximum.
    drop = f.xreplace({x: low}) - f.xreplace({x: high})
    root = sympy.cbrt(sympy.Rational(3, 4) * drop)
    rows = []
    for g in weights:
        a, b, direction = _pair_coefficients(f, g, x, low, high, root, order)
        rows.append([(direction * y, direction * z) for y, z in zip(a, b, strict=True)])
    return root, level, direction, rows


def _pair_of(f: Expr, x: Symbol, given: Sequence[Expr] | None) -> tuple[Expr, Expr]:
    """The maximum and the minimum among two saddles, by the sign of f'' at sampled parameters."""
    saddles = list(given) if given is not None else _zeros(f, x)
    saddles = [sympy.sympify(point) for point in saddles]
    if len(saddles) != 2:
        raise InputError(
            f"f' of {f} has {len(saddles)} real zeros by SymPy; ask for "
            "expression_in(saddles=(first, second)), or for numbers by bind(…)."
        )
    curved = sympy.diff(f, x, 2)
    signs = set()
    free = set().union(curved.free_symbols, *(p.free_symbols for p in saddles)) - {x}
    for values in sampled_parameters(free):
        curvatures = [number(curved.xreplace({x: p}), values) for p in saddles]
        signs.add(tuple(int(c > 0) - int(c < 0) for c in curvatures))
    if signs == {(-1, 1)}:
        return saddles[0], saddles[1]
    if signs == {(1, -1)}:
        return saddles[1], saddles[0]
    raise InputError(
        f"the saddles {saddles[0]} and {saddles[1]} of {f} are not a maximum and a minimum for all "
        "parameters; write f with parameters for which both are real and apart."
    )


def _zeros(f: Expr, x: Symbol) -> list[Expr]:
    """Zeros of f' that are real at sampled parameters."""
    try:
        points = sympy.solve(sympy.diff(f, x), x)
    except NotImplementedError:
        return []
    return [
        point
        for point in points
        if all(number(point, v) == number(point, v) for v in sampled_parameters(point.free_symbols))
    ]


def _pair_coefficients(
    f: Expr, g: Expr, x: Symbol, low: Expr, high: Expr, root: Expr, order: int
) -> tuple[Any, ...]:
    """a_n, b_n and the direction of s; computed once for unnamed Taylor coefficients."""
    count = 2 * order - 1
    names = ["R", *(f"{k}{side}{j}" for side in "pm" for k in "ac" for j in range(count))]
    names += ["Wp", "Wm"]
    ring = sympy.polys.rings.PolyRing(names, sympy.QQ)
    gens = dict(zip(names, ring.gens, strict=True))
    values = {"R": 1 / root}
    direction = _direction(low, high)
    sides = []
    for side, mark, point in ((1, "p", high), (-1, "m", low)):
        steep = taylor_of(f, x, point, count + 2)[2:]
        weight = taylor_of(g, x, point, max(count, 2))[:count]
        for j in range(count):
            values[f"a{mark}{j}"] = steep[j] / steep[0]
            values[f"c{mark}{j}"] = weight[j]
        values[f"W{mark}"] = direction * sympy.sqrt(side * root / steep[0])
        alpha = [ring.one, *(gens[f"a{mark}{j}"] for j in range(1, count))]
        weights = [gens[f"c{mark}{j}"] for j in range(count)]
        d = perron_coefficients([ring.zero, ring.zero, *alpha], weights, 2)
        front = gens[f"W{mark}"]
        sides.append(slope_by_square(d, side, gens["R"], front, count, ring.one))
    p, q = both_saddles(sides, gens["R"], ring.one)
    swap = {sympy.Symbol(name): value for name, value in values.items()}
    p, q = ([y.as_expr().xreplace(swap) for y in row] for row in (p, q))
    pq = [(root * y, z) for y, z in zip(p, q, strict=True)]
    return (*by_parts(root**2, pq, order), direction)


def _direction(low: Expr, high: Expr) -> Expr:
    """1 if the second saddle is the larger one for all parameters, -1 if it is the smaller."""
    signs = set()
    for values in sampled_parameters((high - low).free_symbols):
        signs.add(bool(number(high - low, values) > 0))
    if len(signs) != 1:
        raise InputError(
            f"which of the saddles {low} and {high} is larger depends on the parameters; give "
            "symbols with assumptions, or numbers."
        )
    return sympy.Integer(1 if signs.pop() else -1)


def taylor_of(expression: Expr, x: Symbol, point: Expr, count: int) -> list[Expr]:
    """Exact Taylor coefficients of an expression."""
    try:
        return list(taylor(expression, x, point, 1, count, ExpressionField()).c)
    except NotAnalytic:
        raise InputError(f"{expression} has no Taylor series at {x} = {point}.") from None


def end_formula(
    f: Expr,
    g: Expr,
    x: Symbol,
    lo: Expr,
    hi: Expr,
    order: int,
    lam: Symbol,
    saddles: Sequence[Expr] | None,
) -> Expr:
    """Expansion at one maximum with the finite ends, wherever they are beside it."""
    point = _maximum(f, x, saddles)
    count = 2 * order
    at_saddle = taylor_of(f, x, point, count + 3)
    weight = taylor_of(g, x, point, count + 1)
    alpha = -at_saddle[2]
    d = perron_coefficients([sympy.Integer(0)] * 2 + at_saddle[2:], weight, 2)
    rows = saddle_rows(d, alpha, order)
    a = [row[0] for row in rows]
    share, edges = [], sympy.Integer(0)
    for side, end in ((1, lo), (-1, hi)):
        if end.is_infinite:
            continue
        here = taylor_of(f, x, end, order + 2)
        t = end - point
        if vanishes(t):
            v, b = sympy.Integer(0), [row[1] / (2 * alpha) for row in rows]
        elif vanishes(here[1]):
            raise InputError(
                f"f = {f} has a slope of 0 at the end {x} = {end}, where it is not largest, so the "
                "end has no formula here; take numbers from bind(…) and evaluate."
            )
        else:
            # Its sign is t's on both sides: v is analytic there.
            v = t * sympy.sqrt((at_saddle[0] - here[0]) / (alpha * t**2))
            c = end_series(here, taylor_of(g, x, end, max(order, 2))[:order])
            b = beyond_erfc(c, a, alpha, v)
        share.append((side, v))
        edges += side * sympy.exp(lam * here[0]) * sum(y * lam ** (-n - 1) for n, y in enumerate(b))
    scale = sympy.sqrt(lam * alpha)
    part = sympy.Integer(1)
    if len(share) == 2:
        part = (sympy.erfc(share[0][1] * scale) - sympy.erfc(share[1][1] * scale)) / 2
    elif share:
        part = sympy.erfc(share[0][0] * share[0][1] * scale) / 2
    front = sympy.exp(lam * at_saddle[0]) * sympy.sqrt(sympy.pi / (lam * alpha)) * part
    return front * sum(y * lam**-n for n, y in enumerate(a)) + edges


def _maximum(f: Expr, x: Symbol, given: Sequence[Expr] | None) -> Expr:
    """The one zero of f' at which f'' < 0 for all parameters."""
    points = [sympy.sympify(p) for p in (given if given is not None else _zeros(f, x))]
    curved = sympy.diff(f, x, 2)
    maxima = []
    for point in points:
        curvature = curved.xreplace({x: point})
        if all(number(curvature, v) < 0 for v in sampled_parameters(curvature.free_symbols)):
            maxima.append(point)
    if len(maxima) != 1:
        raise InputError(
            f"f = {f} has {len(maxima)} maxima by SymPy; ask for "
            "expression_in(saddles=(point,)), or for numbers by bind(…)."
        )
    return maxima[0]


# -- iterated integrals ----------------------------------------------------------------------------


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
    root, level, direction, (speed, scale) = two_saddles(-f, (g, h), x, saddles, order)
    z, level = third**2 * root**2, -level
    constants: Any = sympy
    ai, bi, ai_slope, bi_slope = (
        e(z) for e in (sympy.airyai, sympy.airybi, sympy.airyaiprime, sympy.airybiprime)
    )
    products = ai**2 + bi**2, ai * ai_slope + bi * bi_slope, ai_slope**2 + bi_slope**2
    functions = pair_units(constants, 1 / third, *products)
    total = sum(y * lam ** (-k - 1) for k, y in enumerate(_regular(f, g, h, x, lo, hi, order)))
    if direction == 1:
        for n, row in enumerate(product_rows(speed, scale)):
            inner = sum(c * y for c, y in zip(row, functions, strict=True))
            total += lam**-n * inner

    def single(rows: Rows, step: int) -> list[Any]:
        """The expansion of one integral of the pair, in Bi and Bi'."""
        which = (1 - step) // 2
        return [
            (step * lam) ** -n * over_pair(constants, a, 1 / third, b, bi, bi_slope)[which]
            for n, (a, b) in enumerate(rows)
        ]

    def end(phase: Expr, weight: Expr, at: Expr, side: int) -> list[Any]:
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
    pair = single(speed, -1), single(scale, 1)
    for exponent, inner, outer in end_products(level, pair, low, high):
        total += sympy.exp(lam * exponent) * sum(product(inner, outer))
    return total


def _regular(f: Expr, g: Expr, h: Expr, x: Symbol, lo: Expr, hi: Expr, order: int) -> list[Any]:
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
