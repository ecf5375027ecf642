"""The composition of T and 1 - P over symbols, uniform in a coalescence.

It is that of `symasym.asymptotics.weak_noise.compose`, run with a symbol for every series
(`symasym.formulas.builder`, `symasym.formulas.uniform`, `symasym.formulas.uniform_series`). With
lam = 2/kappa^2,

    T = lam (L D+ + R D-)/(L + R),

L and R being int e^{lam V} left and right of the start and D- and D+ the nested integrals there.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any

import sympy
from sympy import Expr, S, Symbol

from symasym.asymptotics.weak_noise.compose import Side, Sides, mean_time, side_of
from symasym.base.errors import InputError
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.formulas.builder import Symbols
from symasym.formulas.cases import Case, found_cases, zero_at
from symasym.formulas.formula import OF_START, Expanded, Expansion
from symasym.formulas.letters import Row, U, joined
from symasym.formulas.symbolic_sums import BEYOND_1, KAPPA, LAM, R, Sum, Symbolic, X
from symasym.formulas.uniform import Coalescing, Locals
from symasym.formulas.uniform_series import (
    Apart,
    UniformSeries,
    stationary,
    two_sides,
    uniform_symbols,
)

__all__ = ["uniform"]

_MOST = 1
_L, _R, _D_MINUS, _D_PLUS = sympy.symbols("L R D- D+", positive=True)


def uniform(
    drift: Drift, quantity: Expanded, order: int, start: Fraction, case: str | Case | None,
    find: Callable[..., Case], verb: Callable[..., Expansion],
) -> Expansion:  # fmt: skip
    """The uniform formula of the case asked for, or of the first that has one.

    `find` gives the first case of a drift, a start, a case asked for and a quantity; `verb` is
    `symasym.expand`.
    """
    if quantity == "T" and (abs(start) >= 1 or zero_at(drift, start)):
        where = "a zero of A" if abs(start) < 1 else "outside of the layer"
        raise InputError(
            f"start is {float_text(start)}, {where}; the uniform formula is that of another start "
            "in the layer, and sa.escape_time(method='uniform') has numbers."
        )
    if quantity not in ("T", "P", "1 - P") or order > _MOST:
        raise InputError(
            f"quantity is {quantity!r} and order {order}; the uniform formula is that of T and "
            f"1 - P, to order {_MOST}."
        )
    own = find(drift, start, case, quantity)
    if not drift.free or drift.shape or drift == Drift.general():
        return _of_case(drift, quantity, order, start, own, verb)
    asked: tuple[Case, ...] = (own,)
    if case is None or drift.expression().as_poly(U) is None:
        # Of what is no polynomial with parameters at which it is in the case asked for.
        known = found_cases(drift, start, quantity not in OF_START)
        asked = known if case is None else tuple(c for c in known if c == own) or asked
    refused = []
    for one in asked:
        try:
            return _of_case(drift, quantity, order, start, one, verb)
        except InputError as error:
            refused.append(str(error))
    several = f"no case of {drift!r} has the uniform formula; of the first, '{own}': "
    raise InputError(several * (len(refused) > 1) + refused[0])


@lru_cache(maxsize=32)
def _of_case(
    drift: Drift, quantity: Expanded, order: int, start: Fraction, case: Case,
    verb: Callable[..., Expansion],
) -> Expansion:  # fmt: skip
    """T or 1 - P through a coalescence."""
    symbols = uniform_symbols(drift, quantity, order, start, case)
    sums = dict[Symbol, Expr]()
    if quantity == "T":
        ring = Locals(symbols) if isinstance(symbols, Coalescing) else Symbolic()
        formula = _time(symbols, ring, sums)
    else:
        outside, whole = stationary(symbols, order)
        formula = outside / whole if quantity == "1 - P" else 1 - outside / whole
    known = {
        **sums, **{s: value.expression for s, value in symbols.series.items()}, **symbols.values,
        **getattr(symbols, "locals", {}), LAM: 2 / KAPPA**2, X: KAPPA**2 / 2, BEYOND_1: R - 1,
    }  # fmt: skip
    conditions = dict.fromkeys(_conditions(symbols, quantity))
    tex = {_D_MINUS: "D_-", _D_PLUS: "D_+", LAM: r"\lambda", BEYOND_1: "(r - 1)", **symbols.tex}
    rows = {s: Row(value.front, value.coefficients) for s, value in symbols.series.items()}
    e = Expansion(
        quantity, "uniform", order, drift, start, case, formula, known, symbols.equations, (),
        tuple(c for c in conditions if c is not sympy.true), symbols.integrals, symbols.rules, tex,
        rows, tuple(sums), symbols.code, symbols.growth, verb,
    ).with_own_names()  # fmt: skip
    # That A is 0 at u1, u2, ... is how these are defined; SymPy would take seconds to find it.
    others = (c for c in e.conditions if not isinstance(c, sympy.Eq))
    try:
        holds = all(e.put_in(c) != False for c in others)  # noqa: E712
    except TypeError:  # a condition on what is infinite
        holds = False
    if not holds:
        raise InputError(
            f"{drift!r} from {start} has a pair of zeros that the formula does not cover, such as "
            "a complex one near the start or an end; use sa.escape_time(method='uniform')."
        )
    return e


def _time(symbols: Symbols, ring: Any, sums: dict[Symbol, Expr]) -> Expr:
    """T by both one-sided expansions, whose sums are put into `sums`."""
    both = symbols.both_sides()
    if isinstance(symbols, (UniformSeries, Apart)):
        left, right = two_sides(symbols)
    else:
        left, right = (side_of(one, 1 + BEYOND_1, ring) for one in both)
    # The same composition over plain symbols.
    plain = [
        Side(total, nested, *map(_expression, side[2:]))
        for total, nested, side in zip((_L, _R), (_D_MINUS, _D_PLUS), (left, right), strict=True)
    ]
    scale, speed = (a + b for a, b in zip(plain[0][2:], plain[1][2:], strict=True))
    for symbol, value in (
        (_L, left.scale), (_R, right.scale), (_D_MINUS, left.nested), (_D_PLUS, right.nested)
    ):  # fmt: skip
        sums[symbol] = _expression(value)
    return LAM * mean_time(Sides(plain[0], plain[1], scale, speed, both[1].endpoint_product))


def _expression(total: Sum | Expr) -> Expr:
    """A sum of exponentials as an expression."""
    if not isinstance(total, Sum):
        return joined(sympy.expand_mul(total))
    return sum((a * sympy.exp(LAM * height) for height, a in total.terms), S.Zero)


def _conditions(symbols: Symbols, quantity: str) -> Iterator[Any]:
    """The conditions of the formula, as predicates."""
    yield from symbols.conditions()
    points: list[Any] = [-S.One, *symbols.zeros, S.One]
    if quantity in OF_START:
        points.insert(1 + symbols.case.before, symbols.start)
        yield sympy.Gt(R, 1)
    yield from (a < b for a, b in itertools.pairwise(points) if (a < b) is not sympy.true)
    for u in symbols.zeros:
        yield sympy.Eq(symbols.A.subs(U, u), 0)
    if symbols.powers is not None and symbols.kept:
        yield sympy.Ne(symbols.powers.LC(), 0)
    ends = symbols.A.subs(U, -1), symbols.A.subs(U, 1)
    if quantity in OF_START:
        yield from (sympy.Ne(a, 0) for a in ends)
        yield sympy.Ne(symbols.A.subs(U, symbols.start), 0)
    else:
        yield from (sympy.Gt(ends[0], 0), sympy.Lt(ends[1], 0))
