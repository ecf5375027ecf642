"""Uniform expansions as formulas: Chester-Friedman-Ursell and Bleistein in SymPy's functions.

airyai, airyaiprime and erfc stand with coefficients in closed form. These hold beside the
coalescence: at it they are 0/0, and numbers come from `bind` and `evaluate`. The algebra is that of
the numbers, over SymPy's elements: `.cubic_map` (both saddles), `.endpoints` (ends).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.cubic_map import both_saddles, slope_by_square
from symasym.asymptotics.coalescence.endpoints import beyond_erfc, end_series, saddle_rows
from symasym.asymptotics.laplace.kinks import number
from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.errors import InputError
from symasym.series.coefficient_fields import ExpressionField, sampled_parameters
from symasym.series.taylor_series import NotAnalytic, taylor
from symasym.special.airy_products import by_parts

if TYPE_CHECKING:
    from collections.abc import Sequence

    from sympy import Expr, Symbol

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
            f"f' of {f} has {len(saddles)} real zeros by SymPy; give saddles=(first, second) for a "
            "formula, or numbers by bind(…)."
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
    a = [row[0] for row in saddle_rows(d, alpha, order)]
    share, edges = [], sympy.Integer(0)
    for side, end in ((1, lo), (-1, hi)):
        if end.is_infinite:
            continue
        here = taylor_of(f, x, end, order + 2)
        t = end - point
        # Its sign is t's on both sides: v is analytic there.
        v = t * sympy.sqrt((at_saddle[0] - here[0]) / (alpha * t**2))
        share.append((side, v))
        c = end_series(here, taylor_of(g, x, end, max(order, 2))[:order])
        inner = [y * lam ** (-n - 1) for n, y in enumerate(beyond_erfc(c, a, alpha, v))]
        edges += side * sympy.exp(lam * here[0]) * sum(inner)
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
            f"f = {f} has {len(maxima)} maxima by SymPy; give saddles=(point,) for a formula, or "
            "numbers by bind(…)."
        )
    return maxima[0]
