"""The points at which f is largest on [a, b], found among the ends and the zeros of f'.

With free parameters they must be the same at all sampled values that the assumptions allow.
"""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from itertools import pairwise
from math import cos, pi
from typing import Any, NamedTuple

import sympy
from flint import arb
from sympy import Expr, Rational, S, Symbol

from symasym.base.errors import InputError
from symasym.integrals.integral import Zero, code, cut, middle, number
from symasym.integrals.local import samples

# The largest number of critical points; the largest size of a point as a formula in parameters.
_MOST, _SHORT = 60, 40
# Powers of 2: distances at which limits at an end are probed; lam for the test of convergence.
_NEAR, _FAR, _LARGE, _TINY = (-100, -200), (19, 20), 10**4, arb(2) ** -200


class Maximum(NamedTuple):
    """A point at which f is largest; the interval lies on its left, its right or both sides."""

    point: Any
    side: str


def located(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Maximum]:
    """The maxima of f; with free parameters they must be the same for all samples."""
    whole = sympy.Tuple(f, g, x, a, b)
    free = whole.free_symbols - {x}
    if not free:
        return _highest(f, g, x, a, b)
    known = [z for z in (a, b, *zeros(f.diff(x), x, a, b)) if isinstance(z, Expr)]
    known = [z for z in known if z.count_ops() <= _SHORT]

    def named(top: Maximum, row: dict[Symbol, Expr]) -> Maximum:
        """The maximum with its point as a formula; StopIteration if no known formula fits."""
        closed = [*known, top.point] if isinstance(top.point, Expr) else known
        at = ((z, number(z.xreplace(row))) for z in closed)
        same = (z for z, y in at if y.is_finite() and y.overlaps(number(top.point)))
        return Maximum(next(same), top.side)

    found: list[Maximum] = []
    for row in samples(free):
        tops: list[Maximum] = []
        with suppress(InputError, StopIteration):
            tops = _highest(*whole.xreplace(row))
            tops = [named(m, row) for m in sorted(tops, key=lambda m: number(m.point).mid())]
        found = found or tops
        if not tops or tops != found:
            first, *_ = names = sorted(map(str, free))
            raise InputError(
                f"the points where f = {f} is largest depend on {', '.join(names)}; give numbers, "
                f"or symbols with assumptions that determine them, such as Symbol('{first}', "
                "positive=True)."
            )
    return found


def _highest(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> list[Maximum]:
    """The maxima of f without parameters; also checks that the integral converges."""
    lo, hi, height, weight = number(a), number(b), code(f, x), code(g, x)
    inside = middle(lo, hi)
    rows = []
    for z in zeros(f.diff(x), x, a, b):
        at = number(z).mid()
        level = height(at)
        rows.append((level if level.is_finite() else height(at + _TINY), z, "both"))  # at a pole
    for z, end, side in ((a, lo, "right"), (b, hi, "left")):
        level = height(end)
        if end.is_finite() and level.is_finite():
            rows.append((level, z, side))
            continue
        start, way, powers = (
            (end, inside - end, _NEAR) if end.is_finite() else (inside, 1 if end > 0 else -1, _FAR)
        )
        before, level = (height(start + way * arb(2) ** k) for k in powers)
        if level > before:
            # f may be largest in the limit at this end, which is not a maximum.
            rows.append((level + arb(0, (level - before).upper()), z, ""))
    top = max((level for level, _, _ in rows), key=lambda y: y.mid(), default=arb.nan())

    def large(u: Any) -> Any:
        return weight(u) * (_LARGE * (height(u) - top)).exp()

    tops = [Maximum(z, side) for level, z, side in rows if level.overlaps(top)]
    rests = [cut(large, end, inside, _TINY)[1] for end in (lo, hi)]
    if not all(rest.is_finite() for rest in rests) or not all(m.side for m in tops):
        raise InputError(
            f"f = {f} does not attain a maximum on [{a}, {b}], or, towards an end, f does not fall "
            f"or g = {g} grows, so that the integral diverges; give other functions or ends."
        )
    return tops


# -- zeros -------------------------------------------------------------------------------------


@lru_cache(maxsize=512)
def zeros(e: Expr, x: Symbol, lo: Expr, hi: Expr) -> list[Any]:
    """The real zeros and poles in (lo, hi); for other than rational functions, sign changes.

    With parameters, the zeros of linear and quadratic factors, or those that SymPy finds.
    """
    rational = e.is_rational_function(x)
    above = sympy.Mul(*sympy.fraction(sympy.together(e))) if rational else e
    if any(y.free_symbols - {x} for y in (e, lo, hi)):
        parts = [e]
        if rational:
            parts = [y for y, _ in sympy.factor_list(above)[1] if 0 < sympy.degree(y, x) <= 2]
        elif len([n for n in e.atoms(sympy.Function, sympy.Pow) if n.has(x)]) > 1:
            return []  # SymPy might not terminate
        with suppress(NotImplementedError):
            return [z for y in parts for z in sympy.solve(y, x) if z.is_real is not False]
        return []
    poly, a, b = rational and above.as_poly(x), number(lo), number(hi)
    exact = poly and poly.domain in (sympy.ZZ, sympy.QQ)
    found = _algebraic(poly, x) if exact else _on_grid(e, x, a, b) if e.has(x) else []
    if len(found) > _MOST:
        raise InputError(
            f"{e} has more than {_MOST} zeros for {x} in ({lo}, {hi}); give an integral with "
            "fewer critical points."
        )
    found = [_recognised(z) if isinstance(z, Zero) and not exact else z for z in found]
    return [z for z in found if a < number(z) < b]


def _algebraic(poly: Any, x: Symbol) -> list[Any]:
    """The real zeros of a polynomial with rational coefficients."""
    found: list[Any] = []
    for factor, _ in poly.factor_list()[1]:
        if factor.degree() <= 2:
            found += factor.real_roots()
        else:
            ends = (map(number, pair) for pair, _ in factor.intervals())
            found += [Zero(factor.as_expr(), x, *pair) for pair in ends]
    return found


def _on_grid(e: Expr, x: Symbol, a: Any, b: Any) -> list[Any]:
    """The points at which the sign changes between points of a grid, also at poles and jumps."""
    of = code(e, x)
    if (b - a).is_finite():
        grid = [a + (b - a) * arb((1 - cos(pi * k / 800)) / 2) for k in range(1, 800)]
    else:
        reach = [arb(2) ** (arb(k) / 30 - 27) for k in range(1600)]
        base = a if a.is_finite() else b if b.is_finite() else arb(0)
        left = [] if a.is_finite() else [base - y for y in reach[::-1]]
        grid = [*left, base, *([] if b.is_finite() else [base + y for y in reach])]
    known = [(y.mid(), v) for y in grid if (v := of(y)).is_finite() and not v.contains(0)]
    return [Zero(e, x, p, q) for (p, u), (q, v) in pairwise(known) if u * v < 0]


def _recognised(zero: Zero) -> Any:
    """The zero, in closed form if it is q, q pi, log q or ±sqrt(q) with a rational number q."""
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
