"""The integrand of a uniform expansion read, and the pair of its saddles that coalesces.

A pair of saddles coalesces where f' and f'' vanish together. Beside it, about the zero c of f'',
f' = f_1 + f_3 (x - c)²/2 + ..., so that the pair lies near x = c ± sqrt(-2 f_1/f_3): real, or
conjugate complex.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING

import numpy as np
import sympy

from symasym.asymptotics.laplace.kinks import WORK, Piece, at, difference, number
from symasym.asymptotics.laplace.maxima import grid_of, interior_maxima, on_grid
from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.base.inputs import is_name, shown
from symasym.drift.expressions import expect_algebra, parse, quotient_parts
from symasym.numbers.trees import FUNCTIONS

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.base.inputs import Number

_LARGE = sympy.Integer(10) ** 6


def read_integral(
    f: Number, g: Number, x: Symbol | str, a: Number, b: Number, name: str = "g"
) -> tuple[str, Expr, Expr, Expr, Symbol, Expr, Expr]:
    """The kind of integral, f (over i if oscillating), g, its constant factor, x and ends.

    The kind is ``"real"``, ``"oscillating"`` (f imaginary) or ``"contour"`` (complex ends).
    """
    symbol = variable(x)
    names = {symbol.name: symbol}
    formula, weight, lo, hi = (
        parse(name, value, names) for name, value in (("f", f), (name, g), ("a", a), ("b", b))
    )
    expect_algebra(formula, weight)
    kind = "real"
    if formula.has(sympy.I):
        kind, formula = "oscillating", over_i(formula)
    elif any(end.has(sympy.I) for end in (lo, hi)):
        kind = "contour"
        require_valleys(lo, hi)
    if formula.has(sympy.I, sympy.oo, -sympy.oo, sympy.zoo, sympy.nan):
        raise InputError(f"f = {f} is neither real nor imaginary; give one or the other.")
    require_exponent(formula, symbol)
    if weight == 0:
        raise InputError(f"{name} is 0, so the integral is; give one that is not.")
    factor, weight = weight.as_independent(symbol, as_Add=False)
    without = (sympy.oo, -sympy.oo, sympy.zoo, sympy.nan)
    if weight.has(sympy.I, *without) or factor.has(*without):
        raise InputError(
            f"{name} = {g} is not a constant times a real function; split it into parts."
        )
    require_free_ends(lo, hi, symbol)
    if kind != "contour":
        require_real_ends(lo, hi)
    if kind != "real":
        require_smooth(symbol, {"f": formula, name: weight})
    return kind, formula, weight, factor, symbol, lo, hi


def over_i(formula: Expr) -> Expr:
    """The formula over i, term by term, multiplied out where i is left in it."""
    terms = sympy.Add(*(term / sympy.I for term in sympy.Add.make_args(formula)))
    if not terms.has(sympy.I):
        return terms
    expect_algebra(formula)
    return sympy.expand(terms)


def variable(x: Symbol | str) -> Symbol:
    """The variable of integration as a symbol."""
    symbol = sympy.Symbol(x) if is_name(x) else x
    if not isinstance(symbol, sympy.Symbol):
        raise InputError(f"x is {shown(x)}; give the variable of integration, a SymPy symbol.")
    return symbol


def require_exponent(f: Expr, x: Symbol) -> None:
    """Refuse an f without x."""
    if not f.has(x):
        raise InputError(
            f"f = {f} does not contain {x}, so the exponential is constant; give an f that "
            f"depends on {x}."
        )


def require_free_ends(lo: Expr, hi: Expr, x: Symbol) -> None:
    """Refuse ends that contain x."""
    for name, end in (("a", lo), ("b", hi)):
        if end.has(x):
            raise InputError(f"{name} = {end} contains {x}; give an end free of it.")


def require_real_ends(lo: Expr, hi: Expr) -> None:
    """Refuse ends that are neither real nor ±oo, or not in their order."""
    for name, end in (("a", lo), ("b", hi)):
        if end.is_extended_real is False or end.has(sympy.I):
            raise InputError(f"{name} = {end} is not real; give a real end or ±oo.")
    if not (lo.free_symbols or hi.free_symbols) and not number(lo) < number(hi):
        raise InputError(f"a is {lo} and b is {hi}; a must be less than b.")


def require_known(name: str, expression: Expr, x: Symbol) -> None:
    """Refuse functions of x that are not evaluated."""
    for node in expression.atoms(sympy.Function, sympy.Integral, sympy.Derivative):
        if node.has(x) and type(node).__name__ not in FUNCTIONS:
            raise InputError(
                f"{name} contains {node}, which is not among the functions symasym evaluates; "
                f"write {name} with {', '.join(FUNCTIONS)}, Abs, Max, Min, sign, Piecewise and "
                "powers."
            )


_KINKS = (sympy.Abs, sympy.sign, sympy.Max, sympy.Min, sympy.Heaviside, sympy.Piecewise)


def require_smooth(symbol: Symbol, given: dict[str, Expr]) -> None:
    """Refuse expressions with kinks, or of functions that are not evaluated."""
    for name, expression in given.items():
        if expression.has(*_KINKS):
            raise InputError(f"{name} = {expression} has kinks; split the integral at them.")
        require_known(name, expression, symbol)


def far_end(end: Expr) -> complex:
    """A complex end, with a large number for oo."""
    return complex(sympy.N(end.xreplace({sympy.oo: _LARGE, -sympy.oo: -_LARGE})))


def require_valleys(lo: Expr, hi: Expr) -> None:
    """Refuse ends that are not two conjugate complex infinities."""
    ends = [far_end(end) for end in (lo, hi) if not end.free_symbols]
    if (
        len(ends) < 2
        or not all(abs(end) > 1e5 for end in ends)
        or abs(ends[0] - ends[1].conjugate()) > 1e-6 * abs(ends[0])
        or not ends[0].imag < 0 < ends[1].imag
    ):
        raise InputError(
            f"a is {lo} and b is {hi}; a path off the real axis goes from a complex infinity in "
            "the lower half plane to the conjugate one, as from oo - I*pi to oo + I*pi."
        )


def require_no_pole(piece: Piece, x: Symbol) -> None:
    """Refuse a g whose denominator alone changes sign inside: the integral diverges."""
    top, bottom = quotient_parts(piece.g, x)
    if not bottom.has(x):
        return
    grid = grid_of(piece)
    signs = [np.sign(on_grid(e, x, grid)) for e in (bottom, top)]
    flips = [row[1:] * row[:-1] < 0 for row in signs]
    # A numerator that vanishes, too, makes it a removable singularity.
    poles = np.flatnonzero(flips[0] & ~flips[1] & (signs[1][1:] != 0) & (signs[1][:-1] != 0))
    if poles.size:
        raise InputError(
            f"g = {piece.g} has a pole at {x} = {grid[poles[0]]:.4g} or thereabouts, so the "
            "integral diverges; give an interval without it."
        )


def closest_pair(piece: Piece, x: Symbol, near: Fraction | None, shown: Expr) -> tuple[mpf, mpf]:
    """The zero of f'' amid the closest pair of saddles, and a quarter of their distance squared.

    The latter is negative for a complex pair.
    """
    slopes = [piece.f]
    for _ in range(3):
        slopes.append(sympy.diff(slopes[-1], x))
        expect_algebra(slopes[-1])
    _, slope, curved, third_slope = slopes
    if near is not None:
        points = [number(sympy.Rational(near.numerator, near.denominator))]
    else:
        points = []
        for sign in (1, -1):
            signed = Piece(piece.lo, piece.hi, sign * slope, piece.g)
            points += interior_maxima(signed, sign * curved, x)
    pairs = []
    with own_context(WORK) as context:
        for point in points:
            first, third = (context.make_mpf(at(e, x, point)._mpf_) for e in (slope, third_slope))
            if third:
                pairs.append((-2 * first / third, point))
    if not pairs:
        raise InputError(
            f"f = {shown} has no two saddles that could coalesce between {piece.lo} and "
            f"{piece.hi}; give near=… beside them."
        )
    spread, point = min(pairs, key=lambda pair: abs(pair[0]))
    return point, spread


def require_alone(piece: Piece, x: Symbol, point: Real, spread: mpf, shown: Expr) -> None:
    """Refuse a pair of which a point is outside, or which has other stationary points beside it."""
    values = on_grid(sympy.diff(piece.f, x), x, grid_of(piece))
    signs = np.sign(values[np.isfinite(values) & (values != 0)])
    count = int(np.count_nonzero(signs[1:] != signs[:-1]))
    inside = True
    if spread > 0:
        with own_context(WORK) as context:
            reach = context.sqrt(context.make_mpf(spread._mpf_)) * 9 / 10
            middle, lo, hi = (number(y) for y in (point, piece.lo, piece.hi))
            inside = bool(difference(middle, lo) > reach and difference(hi, middle) > reach)
    if count not in (0, 2) or not inside:
        raise InputError(
            f"f = {shown} has {count} stationary points between {piece.lo} and "
            f"{piece.hi} beside the pair at {x} = {float(number(point)):.6g}; give an interval "
            "that holds the pair and no other."
        )
