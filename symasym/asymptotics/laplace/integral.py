"""Laplace's method for int g(x) e^(lam f(x)) dx over [a, b] as lam grows.

The integral is, to all powers of 1/lam, the sum of the contributions of the points where f is
largest (`.maxima`): interior maxima, ends, and kinks (`.kinks`), each with its own expansion
(`.expansion`). Smaller maxima are exponentially small beside them. Theorem and conditions: DLMF
2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic Expansions, section 2.4; F. W. J. Olver, Asymptotics and
Special Functions, chapter 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.laplace.borel import (
    BOREL,
    BOREL_DIGITS,
    require_simple_points,
    require_unit_steps,
)
from symasym.asymptotics.laplace.errors import ErrorModel
from symasym.asymptotics.laplace.expansion import Contribution, expand, irrational_constants
from symasym.asymptotics.laplace.kinks import Piece, cut, difference, number
from symasym.asymptotics.laplace.maxima import Maximum, highest, symbolic_maximum
from symasym.asymptotics.laplace.result import LaplaceExpansion, short
from symasym.base.call_context import symbolic
from symasym.base.errors import InputError
from symasym.base.inputs import count, digits, flag, is_name, sequence, shown
from symasym.drift.expressions import expect_algebra, parse
from symasym.drift.grammar import functions_inside
from symasym.numbers.trees import FUNCTIONS

if TYPE_CHECKING:
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.base.inputs import Number

__all__ = ["laplace_integral"]

#: Terms that order="optimal" chooses from.
OPTIMAL = 48
_MOST = 400
# Irrational constants swell exact coefficients beyond use at higher orders.
_EXACT_ORDERS = 12
_NUMERIC = 40
# Functions and roots, and how many in each other, beyond which they do so in any order.
_FUNCTIONS, _NESTED = 8, 2


@symbolic
def laplace_integral(
    f: Number,
    g: Number,
    x: Symbol | str,
    a: Number,
    b: Number,
    order: int | str = 3,
    *,
    maxima: Sequence[Real] | None = None,
    dps: int | None = None,
    keep: bool = False,
    check: bool = False,
    patience: float | None = None,
) -> LaplaceExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam (Laplace's method).

    Parameters
    ----------
    f : Expr, str or number
        Real on (a, b), with a Taylor series on each side of its maximum. It may have pieces (Abs,
        Max, Min, sign, Heaviside, Piecewise) and other symbols.
    g : Expr, str or number
        Likewise; at the maximum it is a power of the distance, above -1, times a Taylor series.
    x : Symbol or str
        Variable of integration.
    a : Expr or number
        Lower end, possibly -oo.
    b : Expr or number
        Upper end, above a, possibly oo.
    order : int, "optimal" or "borel"
        Terms for each maximum, 1 to 400; ``"optimal"``: up to the smallest term at each lam;
        ``"borel"``: the median Borel–Padé sum of 41 terms, far beyond that, of polynomial f and g
        without free parameters, f's critical points simple (`symasym.asymptotics.laplace.borel`).
    maxima : sequence of Expr, optional
        Where f is largest, if parameters leave it open. It is compared with f all the same.
    dps : int, optional
        Digits of numerical coefficients. None: exact ones, except at a maximum that has no closed
        form, of many functions or functions in each other, or beyond 12 terms with irrational
        constants: then 40 digits.
    keep : bool
        Keep the terms of smaller maxima too; otherwise they are listed in `dropped`.
    check : bool
        Compute all coefficients a second time, by moments, and compare.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    LaplaceExpansion
        With the methods of `Expansion`: ``expression``, ``terms``, ``conditions``, ``error``,
        ``bind(**values)``, ``evaluate(lam, dps=None, log=False, full=False)``, ``latex()`` and
        ``emit(target)``; and ``bound``, ``contributions`` and ``dropped``.

    Raises
    ------
    InputError
        If the integral diverges, f is complex, constant or larger elsewhere than at `maxima`, or
        contains what symasym doesn't evaluate.
    AccuracyError
        If the two ways to the coefficients disagree.
    TimeLimitError
        If it would take longer than `patience`.

    Notes
    -----
    Watson's lemma after Lagrange's reversion: DLMF 2.3(iii); J. Wojdylo, SIAM Rev. 48 (2006) 76.
    The error is a proved bound where ball arithmetic can enclose what it is made of, and
    otherwise twice the largest of the next terms, which `error_kind` calls an estimate.

    Examples
    --------
    Stirling's series, Gamma(lam + 1) lam^(-lam - 1):

    >>> import symasym as sa
    >>> stirling = sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", order=3)
    >>> stirling.contributions[0].coefficients
    (sqrt(2)*sqrt(pi), sqrt(2)*sqrt(pi)/12, sqrt(2)*sqrt(pi)/288)
    >>> print(stirling.evaluate(1000, dps=20, log=True, full=True))
    -1002.53485577295316 ± 2.69e-12 (proved bound, laplace)
    >>> stirling.evaluate([10.0, 100.0]).round(12).tolist()
    [3.6288097e-05, 0.0]
    """
    formula, weight, symbol, lo, hi = _read(f, g, x, a, b)
    terms, keep, check = _order(order), flag("keep", keep), flag("check", check)
    if maxima is not None:
        maxima = [parse("maxima", point) for point in sequence("maxima", maxima)]
    if dps is not None:
        dps = digits(dps)
    if order == "borel":
        free = set().union(*(e.free_symbols for e in (formula, weight, lo, hi))) - {symbol}
        if free:
            raise InputError(
                f'order is "borel", which needs numbers, and {", ".join(sorted(map(str, free)))} '
                "have no value; put numbers in."
            )
        dps = max(dps or 0, BOREL_DIGITS)
        for name, part in (("f", formula), ("g", weight)):
            if not part.is_polynomial(symbol):
                raise InputError(
                    f'order is "borel" and {name} = {part} is no polynomial in {symbol}; give '
                    'another order, such as "optimal".'
                )
    pieces = cut(formula, weight, symbol, lo, hi)
    for piece in pieces:
        require_known("f", piece.f, symbol)
        require_known("g", piece.g, symbol)
    free = set().union(*(e.free_symbols for e in (formula, weight, lo, hi))) - {symbol}
    if free:
        tops, conditions = _symbolic_tops(pieces, symbol, maxima)
        others: list[Maximum] = []
        if dps is not None:
            raise InputError(
                f"dps is {dps}, but {', '.join(sorted(map(str, free)))} have no value; leave dps "
                "out for a formula."
            )
    else:
        tops, others = _numeric_tops(pieces, symbol, maxima)
        conditions = []
    kept = [*tops, *others] if keep else tops
    wanted = dps
    if wanted is None and any(not isinstance(p.point, sympy.Basic) for p in kept):
        wanted = _NUMERIC
    contributions: list[Contribution] = []
    origins: list[tuple[Piece, Any, str]] = []
    for maximum in kept:
        for piece, side in _sides(maximum):
            used = wanted
            if used is None and not free:
                numeric = _is_long(piece) or (
                    terms > _EXACT_ORDERS
                    and irrational_constants(piece, symbol, maximum.point, side)
                )
                used = _NUMERIC if numeric else None
            expanded, more = expand(
                piece, symbol, maximum.point, side, terms, digits=used, check=check
            )
            contributions += expanded
            origins += [(piece, maximum.point, side)] * len(expanded)
            conditions += [line for line in more if line not in conditions]
    if order == "borel":
        for contribution in contributions:
            require_unit_steps(contribution)
        require_simple_points(formula, symbol, lo, hi)
    left = [] if keep else others
    dropped = tuple(
        f"maximum at {symbol} = {short(p.point)}: smaller by a factor "
        f"e^(-{short(difference(tops[0].height, p.height))} lam)"
        for p in left
    )
    errors = None
    if not free:
        errors = ErrorModel(
            pieces=tuple(pieces),
            x=symbol,
            contributions=tuple(contributions),
            origins=tuple(origins),
            smaller=tuple(left),
            digits=wanted or _NUMERIC,
        )
    return LaplaceExpansion(
        formula,
        weight,
        symbol,
        lo,
        hi,
        order,
        laplace_integral,
        tuple(contributions),
        dropped,
        tuple(conditions),
        errors,
    )


def _read(
    f: Number, g: Number, x: Symbol | str, a: Number, b: Number
) -> tuple[Expr, Expr, Symbol, Expr, Expr]:
    """(f, g, x, a, b) as expressions, checked."""
    symbol = variable(x)
    # Strings name x without assumptions; what counts is the name.
    names = {symbol.name: symbol}
    expressions = []
    for name, value in (("f", f), ("g", g), ("a", a), ("b", b)):
        expression = parse(name, value, names)
        infinite = (sympy.oo, -sympy.oo) if name in "fg" else ()
        if expression.has(sympy.I, sympy.zoo, sympy.nan, *infinite):
            raise InputError(
                f"{name} = {expression} is complex, infinite or undefined; give a real one "
                "(Laplace's method is for real f; oscillating integrals need stationary phase)."
            )
        expressions.append(expression)
    expect_algebra(*expressions)
    formula, weight, lo, hi = expressions
    require_free_ends(lo, hi, symbol)
    require_exponent(formula, symbol)
    require_real_ends(lo, hi)
    for name, end, wrong in (("a", lo, symbol.is_nonnegative), ("b", hi, symbol.is_nonpositive)):
        below = end.is_negative if name == "a" else end.is_positive
        if wrong and below:
            raise InputError(
                f"{name} is {end}, where {symbol} cannot be by its own assumptions; give a symbol "
                "without them."
            )
    if weight == 0:
        raise InputError("g is 0, so the integral is; give a g that is not.")
    return formula, weight, symbol, lo, hi


def _is_long(piece: Piece) -> bool:
    """True if exact coefficients would fill pages: many functions and roots, or in each other."""
    parts = [node for e in (piece.f, piece.g) for node in e.atoms(sympy.Function, sympy.Pow)]
    functions = sum(node.is_Function or not node.exp.is_Integer for node in parts)
    deepest = max(functions_inside(e) for e in (piece.f, piece.g))
    return functions > _FUNCTIONS or deepest > _NESTED


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


def _order(order: int | str) -> int:
    """The number of terms that `order` asks for."""
    if isinstance(order, str) and order in ("optimal", "borel"):
        return OPTIMAL if order == "optimal" else BOREL
    return count("order", order, 1, _MOST, " of terms", ', "optimal" or "borel"')


def _numeric_tops(
    pieces: list[Piece], x: Symbol, given: Sequence[Real] | None
) -> tuple[list[Maximum], list[Maximum]]:
    """The highest maxima of f and the others; refused if `given` has a point that is none."""
    tops, others = highest(pieces, x)
    if given is not None:
        for point in given:
            if point.free_symbols:
                raise InputError(f"maxima has {shown(point)}; give numbers, f has no parameters.")
            value = number(sympy.sympify(point))
            if not any(
                abs(difference(number(p.point), value)) < 1e-15 * max(1, abs(value))
                for p in (*tops, *others)
            ):
                raise InputError(
                    f"maxima has {point}, where f = {pieces[0].f} has no maximum; it has them at "
                    f"{', '.join(short(p.point) for p in (*tops, *others))}."
                )
    return tops, others


def _symbolic_tops(
    pieces: list[Piece], x: Symbol, given: Sequence[Real] | None
) -> tuple[list[Maximum], list[str]]:
    """The highest maxima with parameters free, and what was assumed of them."""
    points, was_given = symbolic_maximum(pieces, x, None if given is None else list(given))
    conditions = []
    tops = []
    for point in points:
        left = right = None
        for piece in pieces:
            if point == piece.lo:
                right = piece
            elif point == piece.hi:
                left = piece
            elif left is None and right is None and _within(point, piece):
                left = right = piece
        tops.append(Maximum(point, None, left, right))
        origin = "given" if was_given else "found"
        conditions.append(
            f"f is largest at {x} = {point} ({origin}; compared at sampled parameters)"
        )
    return tops, conditions


def _within(point: Real, piece: Piece) -> bool:
    """True if the point lies inside the piece at all sampled parameters."""
    from symasym.series.coefficient_fields import sampled_parameters

    free = point.free_symbols | piece.lo.free_symbols | piece.hi.free_symbols
    return all(
        bool(number(piece.lo, v) < number(point, v) < number(piece.hi, v))
        for v in sampled_parameters(free)
    )


def _sides(maximum: Maximum) -> list[tuple[Piece, str]]:
    """The pieces in which a maximum is expanded, each with its side."""
    if maximum.smooth:
        # g may be singular there: then the two sides differ.
        assert maximum.right is not None
        return [(maximum.right, "both")]
    sides = [(maximum.left, "left"), (maximum.right, "right")]
    return [(piece, side) for piece, side in sides if piece is not None]
