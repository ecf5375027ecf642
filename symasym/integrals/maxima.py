"""Where f is largest on [a, b]: f beside the ends and the zeros of f'.

With parameters free the answer must be the same at all values tried that their assumptions allow.
"""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from math import cos, pi
from typing import Any, NamedTuple

import sympy
from flint import arb, fmpz_poly
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import InputError
from symasym.integrals.integral import Zero, code, middle, number
from symasym.integrals.local import Balls, NotAnalytic, Point, samples

#: Terms with which f is compared with a constant.
FLAT = 24
# Critical points; operations of a point in parameters.
_MOST, _SHORT = 60, 40
# Powers of 2 near an end, and far out, at which a limit shows; and lam there.
_NEAR, _FAR, _LARGE = range(-25, -201, -25), range(14, 21), 10**4
_SIDES = {-1: "left", 0: "both", 1: "right"}


class Maximum(NamedTuple):
    """A local maximum of f on the closed interval, and the side on which this has it."""

    point: Any
    side: str
    height: Any = None


def located(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others.

    Of free parameters all samples must give the same.
    """
    whole = sympy.Tuple(f, g, x, a, b)
    free = whole.free_symbols - {x}
    if not free:
        return _highest(f, g, x, a, b)
    known = [z for z in (a, b, *zeros(f.diff(x), x, a, b)) if isinstance(z, Expr)]
    known = [z for z in known if z.count_ops() <= _SHORT]

    def named(point: Any, row: dict[Symbol, Expr]) -> Expr:
        """A point in the parameters; StopIteration where none is known to be that of the row."""
        closed = [*known, point] if isinstance(point, Expr) else known
        at = ((z, number(z.xreplace(row))) for z in closed)
        return next(z for z, y in at if y.is_finite() and y.overlaps(number(point)))

    found = list[Any]()
    for row in samples(free):
        found.append([])
        with suppress(InputError, StopIteration):
            tops = sorted(_highest(*whole.xreplace(row))[0], key=lambda m: number(m.point).mid())
            found[-1] = [Maximum(named(m.point, row), m.side) for m in tops]
    if not found[0] or any(row != found[0] for row in found):
        first, *_ = names = sorted(map(str, free))
        raise InputError(
            f"where f = {f} is largest, if anywhere, depends on {', '.join(names)}; give numbers, "
            f"or symbols with assumptions that decide, such as Symbol('{first}', positive=True)."
        )
    return found[0], []


def _highest(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> tuple[list[Maximum], list[Maximum]]:
    """The maxima that share the largest height, and the others, without parameters."""
    maxima = list[Maximum]()
    inside = middle(number(a), number(b))
    for z, side in ((a, 1), (b, -1), *((z, 0) for z in zeros(f.diff(x), x, a, b))):
        c = _beside(f, g, x, z, side, inside)
        if c and _falls(c, side):
            maxima.append(Maximum(z, _SIDES[side], c[0]))
    if not maxima:
        raise InputError(
            f"f = {f} has no isolated maximum for {x} in [{a}, {b}]; give an f that is not "
            "constant, and an interval on which it is largest somewhere."
        )
    maxima.sort(key=lambda m: -m.height.mid())
    tops = [m for m in maxima if m.height.overlaps(maxima[0].height)]
    return tops, maxima[len(tops) :]


def _beside(f: Expr, g: Expr, x: Symbol, point: Any, side: int, inside: Any) -> list[Any]:
    """f's Taylor coefficients in the distance from a point, to one side or, 0, to both.

    Where it has none, its limit by numbers, which also show divergence; nothing for -oo.
    """
    start = number(point)
    far = not start.is_finite()
    with suppress(NotAnalytic):
        if not far:
            return Point(x, point, side or 1, FLAT + 1, Balls()).taylor(f).c
    start, way = inside if far else start, -side if far else side or 1
    at = [start + way * arb(2) ** k for k in (_FAR if far else _NEAR)]
    heights, weights = ([code(e, x)(y) for y in at] for e in (f, g))
    gap = abs(heights[-1] - heights[-2])
    if not far and gap < 1e-9 * (1 + abs(heights[-1])):
        return [] if heights[-1] < heights[-2] else [heights[-1] + arb(0, gap)]
    rows = zip(at, heights, weights, strict=True)
    sizes = [(_LARGE * h + (abs(w) * abs(y - start)).log()).mid() for y, h, w in rows]
    if not all(later < earlier for earlier, later in pairwise(sizes)):
        raise InputError(
            f"f = {f} does not fall as {x} tends to {point}, or g = {g} grows, so that the "
            "integral diverges or has no maximum to expand at; give others, or ends."
        )
    return []


def _falls(c: list[Any], side: int) -> bool:
    """True if f of these Taylor coefficients falls; also where it has no more than a limit."""
    signs = ((k, s) for k, y in enumerate(c) if k and (s := Balls().sign(y)) != 0)
    contact, sign = next(signs, (2, -1 if len(c) == 1 else 0))
    return sign == -1 and (side != 0 or contact % 2 == 0)


# -- zeros -------------------------------------------------------------------------------------


@lru_cache(maxsize=512)
def zeros(e: Expr, x: Symbol, lo: Expr, hi: Expr) -> list[Any]:
    """Real zeros in (lo, hi): all of a rational function, others where the sign changes on a grid.

    With parameters those of linear and quadratic factors, or that SymPy solves for.
    """
    rational = e.is_rational_function(x)
    above = sympy.fraction(sympy.together(e))[0] if rational else e
    if any(y.free_symbols - {x} for y in (e, lo, hi)):
        parts = [e]
        if rational:
            parts = [y for y, _ in sympy.factor_list(above)[1] if 0 < sympy.degree(y, x) <= 2]
        elif len([n for n in e.atoms(sympy.Function, sympy.Pow) if n.has(x)]) > 1:
            return []  # which might take for ever
        with suppress(NotImplementedError):
            return [z for y in parts for z in sympy.solve(y, x) if z.is_real is not False]
        return []
    poly, a, b = rational and above.as_poly(x), number(lo), number(hi)
    exact = poly and poly.domain in (sympy.ZZ, sympy.QQ)
    found = _algebraic(poly, x) if exact else _on_grid(e, x, a, b) if e.has(x) else []
    found = [z for z in found if a < number(z) < b]
    if len(found) > _MOST:
        raise InputError(
            f"{e} has more than {_MOST} zeros for {x} in ({lo}, {hi}); give an integral with "
            "fewer critical points."
        )
    return [_recognised(z) if isinstance(z, Zero) and not exact else z for z in found]


def _algebraic(poly: Any, x: Symbol) -> list[Any]:
    """The real zeros of a polynomial with rational coefficients."""
    found: list[Any] = []
    whole: Any = fmpz_poly([int(c) for c in poly.clear_denoms(convert=True)[1].all_coeffs()[::-1]])
    for factor, _ in whole.factor()[1]:
        e = sympy.Poly([int(c) for c in factor.coeffs()[::-1]], x)
        if factor.degree() <= 2:
            found += e.real_roots()
        else:
            near = (z.real for z, _ in factor.complex_roots() if z.imag == 0)
            found += [Zero(e.as_expr(), x, z.lower(), z.upper()) for z in near]
    return found


def _on_grid(e: Expr, x: Symbol, a: Any, b: Any) -> list[Any]:
    """Zeros where the sign changes between points of a grid."""
    of, found = code(e, x), []
    if (b - a).is_finite():
        grid = [a + (b - a) * arb((1 - cos(pi * k / 800)) / 2) for k in range(1, 800)]
    else:
        reach = [arb(2) ** (arb(k) / 30 - 27) for k in range(1600)]
        base = a if a.is_finite() else b if b.is_finite() else arb(0)
        left = [] if a.is_finite() else [base - y for y in reach[::-1]]
        grid = [*left, base, *([] if b.is_finite() else [base + y for y in reach])]
    known = [(y.mid(), v) for y in grid if (v := of(y)).is_finite() and not v.contains(0)]
    for (p, u), (q, v) in pairwise(known):
        zero = Zero(e, x, p, q)
        if u * v < 0 and abs(of(zero.ball())) < max(abs(u), abs(v)):  # else a pole
            found.append(zero)
        if len(found) > _MOST:
            break
    return found


def _recognised(zero: Zero) -> Any:
    """As a rational, its multiple of pi, logarithm or root, if it is one."""
    z = zero.ball().mid()
    forms = (z, S), (z / arb.pi(), lambda r: r * sympy.pi), (z.exp(), sympy.log)
    for value, form in (*forms, (z * z, lambda r: (1 if z > 0 else -1) * sympy.sqrt(r))):
        if abs(value) < 10**6:
            whole = Rational(str(value.str(50, radius=False)))
            near = whole.limit_denominator(10**6)
            if abs(near - whole) < Rational(1, 10**30):
                closed = form(near)
                if sympy.simplify(zero.equation.xreplace({zero.x: closed})) == 0:
                    return closed
    return zero
