"""Uniform expansions of one integral: its coalescing critical points, and the parts of its sum.

Two coalescing saddles give Airy functions (C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil.
Soc. 53 (1957) 599), a saddle near an end or a kink the complementary error function (N. Bleistein,
Comm. Pure Appl. Math. 19 (1966) 353); DLMF 2.4(v), 2.4(vi).
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING

import sympy

from symasym.asymptotics.coalescence.iterated import iterated_parts
from symasym.asymptotics.coalescence.parts import BestOf, EndPart, PairPart, SaddlePart, SumPart
from symasym.asymptotics.coalescence.reading import (
    closest_pair,
    far_end,
    read_integral,
    require_alone,
    require_known,
    require_no_pole,
    require_smooth,
)
from symasym.asymptotics.coalescence.result import UniformExpansion
from symasym.asymptotics.laplace.kinks import WORK, Piece, at, cut, number
from symasym.asymptotics.laplace.maxima import local_maxima, vanishes_identically
from symasym.base.call_context import own_context, symbolic
from symasym.base.errors import InputError
from symasym.base.inputs import count, exact
from symasym.drift.expressions import expect_algebra
from symasym.drift.short import simplified

if TYPE_CHECKING:
    from mpmath import mpf
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.base.inputs import Number

__all__ = ["uniform_integral"]

_MOST = 40
# A slope below it, at 60 digits, is that of a saddle on the end itself.
_FLAT = 1e-45


@symbolic
def uniform_integral(
    f: Number,
    g: Number | tuple[Number, Number],
    x: Symbol | str,
    a: Number,
    b: Number,
    order: int = 3,
    *,
    near: Number | None = None,
    patience: float | None = None,
) -> UniformExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)), uniform as its critical points coalesce.

    Parameters
    ----------
    f : Expr, str or number
        Which points may coalesce depends on f:

        - f real, a < b real: its maxima, inside or beyond, run into ends and kinks (`Abs`, `Max`,
          `Piecewise`, ...). Complementary error functions.
        - f imaginary, a < b real: two stationary points of f coalesce, or leave the real axis.
          Airy functions; both points of the pair are inside, and no other is.
        - f real, a and b conjugate complex infinities such as ``oo - I*pi`` and ``oo + I*pi``: two
          real saddles coalesce, or leave the real axis; the path runs between the valleys beside
          them. Airy functions.

        It has a Taylor series at these points.
    g : Expr, str or number, or a pair of them
        Real, up to a constant factor, with a Taylor series at these points.

        A pair (g, h) asks for the iterated integral over a < u < v < b of
        g(u) h(v) e^(lam (f(v) - f(u))), f real on a real interval that holds a minimum and a
        maximum of f, or has a complex pair near it, and no other stationary point. Products of
        Airy functions, Ai^2 + Bi^2 the first. f falls from oo at a = -oo, and to -oo at b = oo.
    x : Symbol or str
        Variable of integration.
    a, b : Expr or number
        Ends, see above.
    order : int, optional
        Terms kept, 1 to 40: powers lam^0 to lam^(1 - N), N the order, with each special function.
    near : number, optional
        A point beside the pair of saddles, if f has several pairs.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    UniformExpansion
        With ``evaluate(lam, dps=None, log=False, full=False)``, ``bind(**values)``,
        ``coefficients()`` and ``conditions``.

    Raises
    ------
    InputError
        If the integral diverges, f or g is neither real nor imaginary or not analytic where it
        counts, or no pair of saddles is found.
    AccuracyError
        By ``evaluate``, where the saddles are too far apart for one expansion, or an iterated
        integral's part with u near v is not found to the digits asked for.

    Notes
    -----
    C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599; N. Bleistein, Comm.
    Pure Appl. Math. 19 (1966) 353; R. Wong, Asymptotic Approximations of Integrals, chapter VII;
    DLMF 2.4(v), 2.4(vi). The error is an estimate from the next three terms: twice the largest and
    eight times the third.

    Examples
    --------
    The Bessel function J_100(100) at its turning point, where saddle points coalesce:

    >>> import symasym as sa
    >>> bessel = sa.uniform_integral(
    ...     "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=4
    ... )
    >>> print(bessel.bind(z=1).evaluate(100, dps=20, full=True))
    0.09636667329519 ± 1.35e-12 (estimate, uniform)

    Temme's incomplete gamma function: the maximum of log(x) - x at 1, near the end mu.

    >>> gamma = sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=4)
    >>> print(gamma.bind(mu="1.01").evaluate(100, dps=20, log=True, full=True))
    -102.18777793476922 ± 5.98e-12 (estimate, uniform)

    The time through a saddle-node with noise, an iterated integral; it is all in the first term.

    >>> law = sa.uniform_integral("c*x - x**3/3", (1, 1), "x", "-oo", "oo", order=1)
    >>> print(law.bind(c="-1/4").evaluate(20, dps=20))
    0.308419621286275
    """
    order = count("order", order, 1, _MOST, " of terms")
    beside = None if near is None else exact("near", near)
    if isinstance(g, (tuple, list, sympy.Tuple)):
        return _iterated(f, g, x, a, b, order, beside)
    kind, formula, weight, factor, symbol, lo, hi = read_integral(f, g, x, a, b)
    given_f, given_g = (formula * sympy.I if kind == "oscillating" else formula), weight * factor
    free = set().union(*(e.free_symbols for e in (formula, given_g, lo, hi))) - {symbol}
    parts: list[SumPart] = []
    conditions = []
    if kind == "contour":
        factor = factor * sympy.I
        conditions.append("the path can be moved to one between the valleys beside the pair")
    if not free:
        if kind == "real":
            parts = _real_parts(formula, weight, symbol, lo, hi)
        else:
            parts = _pair_parts(kind, formula, weight, symbol, lo, hi, beside)

    return UniformExpansion(
        given_f,
        given_g,
        symbol,
        lo,
        hi,
        order,
        partial(uniform_integral, near=near),
        "erfc" if kind == "real" else "airy",
        tuple(conditions),
        simplified(factor),
        tuple(parts),
    )


def _iterated(
    f: Number,
    weights: tuple[Number, ...],
    x: Symbol | str,
    a: Number,
    b: Number,
    order: int,
    near: Fraction | None,
) -> UniformExpansion:
    """`uniform_integral` of an iterated integral with the weights (g, h)."""
    if len(weights) != 2:
        raise InputError(
            f"g has {len(weights)} parts; give one weight, or (g, h) for the iterated integral."
        )
    kind, formula, g, first, symbol, lo, hi = read_integral(f, weights[0], x, a, b)
    _, _, h, second, *_ = read_integral(f, weights[1], x, a, b, "h")
    if kind != "real":
        raise InputError(
            f"f = {f} between {lo} and {hi} is not real on a real interval, which an iterated "
            "integral with (g, h) has to be."
        )
    require_smooth(symbol, {"f": formula, "g": g, "h": h})
    given = sympy.Tuple(g * first, h * second)
    free = set().union(*(e.free_symbols for e in (formula, given, lo, hi))) - {symbol}

    return UniformExpansion(
        formula,
        given,
        symbol,
        lo,
        hi,
        order,
        partial(uniform_integral, near=near),
        "products",
        (),
        simplified(first * second),
        () if free else tuple(iterated_parts(formula, g, h, symbol, lo, hi, near)),
    )


def _pair_parts(
    kind: str, phase: Expr, weight: Expr, x: Symbol, lo: Expr, hi: Expr, near: Fraction | None
) -> list[SumPart]:
    """The pair in Airy form, and the finite ends of an oscillating integral."""
    oscillating = kind == "oscillating"
    piece = (
        Piece(lo, hi, phase, weight) if oscillating else Piece(-sympy.oo, sympy.oo, phase, weight)
    )
    point, spread = closest_pair(piece, x, near, sympy.I * phase if oscillating else phase)
    if oscillating:
        require_no_pole(piece, x)
        require_alone(piece, x, point, spread, sympy.I * phase)
    parts: list[SumPart] = [PairPart(piece, x, point, oscillating)]
    if not oscillating:
        side = far_end(hi).real
        third = at(sympy.diff(phase, x, 3), x, point)
        if abs(side) > 1e5 and (side > 0) != (third > 0):
            raise InputError(
                f"f = {phase} rises from its saddles towards {lo} and {hi}; the path must end in "
                f"the valleys, on the other side."
            )
    for end, direction in ((lo, 1), (hi, -1)):
        if oscillating and not end.is_infinite:
            parts.append(EndPart(piece, x, end, direction, oscillating=True))
    return parts


def _real_parts(f: Expr, g: Expr, x: Symbol, lo: Expr, hi: Expr) -> list[SumPart]:
    """The parts of a real integral: each piece's maxima, ends and kinks."""
    pieces = cut(f, g, x, lo, hi)
    for piece in pieces:
        require_known("f", piece.f, x)
        require_known("g", piece.g, x)
    # Divergent integrals are refused there.
    tops = local_maxima(pieces, x)
    parts: list[SumPart] = []
    for piece in pieces:
        require_no_pole(piece, x)
        slope = sympy.diff(piece.f, x)
        expect_algebra(slope)
        if vanishes_identically(slope, x):
            raise InputError(
                f"f is constant between {x} = {piece.lo} and {piece.hi}; integrate g there."
            )
        inside = [top.point for top in tops if top.smooth and top.left is piece]
        inside.sort(key=number)
        parts += _piece_parts(piece, slope, x, inside)
    if not parts:
        raise InputError(f"f = {f} has no maximum and no finite end; give another interval.")
    return parts


def _piece_parts(piece: Piece, slope: Expr, x: Symbol, inside: list[Real]) -> list[SumPart]:
    """The saddles of one piece with the ends they can coalesce with, and the other ends."""
    parts: list[SumPart] = []
    beside: dict[int, Real] = {}
    # Ways to take an end without the maximum it belongs to.
    apart: dict[int, list[SumPart]] = {}
    for end, side in ((piece.lo, 1), (piece.hi, -1)):
        # Where f tends to -oo (`local_maxima` has seen to that), an end adds nothing.
        if end.is_infinite or not _finite(at(piece.f, x, end)):
            continue
        name = "lower" if side == 1 else "upper"
        rise = at(slope, x, end) * side
        if abs(rise) < _FLAT:
            if at(sympy.diff(slope, x), x, end) < 0:
                beside[side] = end
            else:
                parts.append(SaddlePart(piece, x, end, **{name: end}, minimum=True))
            continue
        ways: list[SumPart] = [EndPart(piece, x, end, side)]
        # Outwards of a fall there may be a maximum, inwards a minimum; of a rise the other way.
        least = _beyond(slope, x, end, side if rise < 0 else -side)
        if least is not None:
            ways.append(SaddlePart(piece, x, least, **{name: end}, minimum=True))
        if rise > 0 and inside:
            beside[side] = inside[0] if side == 1 else inside[-1]
            if least is not None:
                apart[side] = ways
            continue
        most = _beyond(slope, x, end, -side) if rise < 0 else None
        if most is not None:
            ways.append(SaddlePart(piece, x, most, **{name: end}))
        parts.append(BestOf(tuple((way,) for way in ways)))
    lower, upper = beside.get(1), beside.get(-1)
    for point in {str(p): p for p in (*inside, lower, upper) if p is not None}.values():
        ends = {1: piece.lo if point is lower else None, -1: piece.hi if point is upper else None}
        parts.append(_with_ends(piece, x, point, ends, apart))
    return parts


def _finite(value: mpf) -> bool:
    """True for a number that is neither infinite nor nan."""
    with own_context(WORK) as context:
        return bool(context.isfinite(context.make_mpf(value._mpf_)))


def _with_ends(
    piece: Piece,
    x: Symbol,
    point: Real,
    ends: dict[int, Expr | None],
    apart: dict[int, list[SumPart]],
) -> BestOf:
    """A maximum with its ends; with those that a minimum parts from it also by themselves."""
    ways: list[tuple[SumPart, ...]] = []
    choices = [
        [None, *apart.get(side, [])] if ends[side] is not None else [None] for side in (1, -1)
    ]
    for low in choices[0]:
        for high in choices[1]:
            own = SaddlePart(piece, x, point, None if low else ends[1], None if high else ends[-1])
            ways.append((own, *(part for part in (low, high) if part is not None)))
    return BestOf(tuple(ways))


def _beyond(slope: Expr, x: Symbol, end: Real, side: int) -> mpf | None:
    """The next zero of f' on `side` of the end, inside or outside; None if none is seen."""
    with own_context(WORK) as context:
        here = number(end)
        first, second = at(slope, x, here), at(sympy.diff(slope, x), x, here)
        step = context.mpf(1)
        if second:
            step = min(
                step, abs(context.make_mpf(first._mpf_) / context.make_mpf(second._mpf_)) / 4
            )
        point, low = context.make_mpf(here._mpf_), None
        for _ in range(120):
            value = at(slope, x, point + side * step)
            if context.isnan(value) or context.isinf(value):
                # A singularity: what lies before it is looked at in smaller steps.
                step /= 4
                continue
            if value == 0 or (value > 0) != (first > 0):
                low = point
                break
            point += side * step
            step *= context.mpf("1.3")
        if low is None:
            return None
        high = point + side * step
        for _ in range(context.prec):
            middle = (low + high) / 2
            value = at(slope, x, middle)
            if (value > 0) == (first > 0) and value != 0:
                low = middle
            else:
                high = middle
        return (low + high) / 2
