"""The composition of T, C and P over symbols.

It is that of `symasym.asymptotics.weak_noise.compose`, the one that evaluates
``method="laplace"``, run with a symbol for every series (`symasym.expansions.builder`).
With x = kappa^2/2 and lam = 1/x,

    T = lam (L D+ + R D-)/(L + R),    C = R/(L + R),

L and R being int e^{lam V} left and right of the start and D- and D+ the nested integrals there.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import sympy
from sympy import Expr, S, Symbol

from symasym.asymptotics.weak_noise.compose import (
    Side,
    Sides,
    mean_time,
    pairs_of,
    scale_contributions,
    side_of,
    stationary_sums,
)
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import Part, Series
from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.emit.symbolic_sums import BEYOND_1, KAPPA, LAM, R, Sum, Symbolic, X
from symasym.expansions.builder import SeriesOf, Symbols, U
from symasym.expansions.emitted import Quotient, one_exponential
from symasym.expansions.uniform_series import Apart, UniformSeries, stationary, two_sides
from symasym.generated.formulas import share_of_side

__all__ = [
    "D_MINUS",
    "D_PLUS",
    "OF_START",
    "Composition",
    "Contribution",
    "composed",
    "radius_condition",
]

# Those that depend on the start and the radius.
OF_START = ("T", "C", "1 - C")
_L, _R, D_MINUS, D_PLUS = sympy.symbols("L R D- D+", positive=True)
_Y = Symbol("y", real=True)


@dataclass(frozen=True)
class Contribution:
    """One product of a critical point of e^{-lam V} with one of e^{lam V}.

    It adds weight * front * e^{exponent} (c_0 + c_1 kappa^2 + c_2 kappa^4 + ...) to T.

    Attributes
    ----------
    pair : tuple of str
        The two points, such as ``("well u1", "barrier u2")``.
    exponent, front : expression
    coefficients : tuple of expressions
        c_0 = 1, c_1, ..., exact in V's derivatives at the two points.
    weight : str
        ``"1 - C"`` right of the start and ``"C"`` left of it.
    """

    pair: tuple[str, str]
    exponent: Expr
    front: Expr
    coefficients: tuple[Expr, ...]
    weight: str

    @property
    def expression(self) -> Expr:
        """The contribution without its weight."""
        series = sum((c * KAPPA ** (2 * n) for n, c in enumerate(self.coefficients)), S.Zero)
        return self.front * sympy.exp(self.exponent) * series


class Composition(NamedTuple):
    """A formula, what its symbols stand for, T's pairs, where it holds, and how it is emitted."""

    formula: Expr
    definitions: dict[Symbol, Expr]
    terms: tuple[Contribution, ...]
    conditions: tuple[Any, ...]
    quotient: Quotient | None


def composed(symbols: Symbols, ring: Any, noise: str, quantity: str, order: int) -> Composition:
    """The formula of a quantity by the composition of both one-sided expansions."""
    terms: tuple[Contribution, ...] = ()
    sums: dict[Symbol, Expr] = {}
    if quantity in OF_START:
        both = symbols.both_sides()
        if isinstance(symbols, (UniformSeries, Apart)):
            left, right = two_sides(symbols)
        else:
            left, right = (side_of(one, 1 + BEYOND_1, ring) for one in both)
        # The same composition over plain symbols, whose sums are defined beside it.
        plain = [
            Side(total, nested, *map(_expression, side[2:]))
            for total, nested, side in zip((_L, _R), (D_MINUS, D_PLUS), (left, right), strict=True)
        ]
        scale, speed = (a + b for a, b in zip(plain[0][2:], plain[1][2:], strict=True))
        sides = Sides(plain[0], plain[1], scale, speed, both[1].endpoint_product)
        behind, ahead = sides.shares
        # Of the start itself, in T: of both sides together, or at a barrier of each.
        starts = (
            (S.Zero, speed)
            if sides.endpoint_product
            else (plain[0].speed_start, plain[1].speed_start)
        )
        rows = (ahead, _L), (behind, ahead if sides.endpoint_product else _R)
        own = [(*row, value) for row, value in zip(rows, starts, strict=True) if value != 0]
        formula = {
            "T": LAM * mean_time(sides), "C": share_of_side(ahead, sides.total),
            "1 - C": share_of_side(behind, sides.total)
        }[quantity]  # fmt: skip
        products = {
            "T": ((ahead, D_MINUS), (behind, D_PLUS), *own), "C": ((ahead,),), "1 - C": ((behind,),)
        }[quantity]  # fmt: skip
        quotient = Quotient(products, (behind, ahead), LAM if quantity == "T" else S.One)
        for symbol, value in (
            (_L, left.scale), (_R, right.scale), (D_MINUS, left.nested), (D_PLUS, right.nested)
        ):  # fmt: skip
            sums[symbol] = _expression(value)
        terms = () if noise == "uniform" else tuple(
            t for one, weight, own_share in zip(both, ("C", "1 - C"), starts, strict=True)
            for t in _contributions(one, symbols, order, weight, own_share)
        )  # fmt: skip
    else:
        if noise == "uniform":
            outside, whole = stationary(symbols, order)
        else:
            slopes = [symbols.a_minus, -symbols.a_plus]
            sums_of = stationary_sums(symbols.line(), slopes, ring)
            outside, whole = map(_expression, sums_of)
        quotient = Quotient(((outside,),), (whole,), complement=quantity == "P")
        if quantity == "density":
            formula = sympy.exp(-LAM * symbols.height_at(_Y)) / whole
            quotient = Quotient(((formula * whole,),), (whole,))
        else:
            formula = outside / whole if quantity == "1 - P" else 1 - outside / whole
    if symbols.general and quantity == "T":
        pairs = [t for t in terms if t.pair[0][:4] == "well" and t.pair[1][:7] == "barrier"]
        if len(pairs) != 1:
            raise InputError(
                f"case is {str(symbols.case)!r}, without one pair of a well and a barrier; give "
                "'start well barrier' or 'barrier well start'."
            )
        terms, formula, sums = (pairs[0],), pairs[0].expression, {}
    definitions = {
        **sums,
        **{s: value.expression for s, value in symbols.series.items()},
        **symbols.values,
        **getattr(symbols, "locals", {}),
        LAM: 2 / KAPPA**2,
        X: KAPPA**2 / 2,
        BEYOND_1: R - 1,
    }
    conditions = dict.fromkeys(_conditions(symbols, quantity))
    return Composition(
        formula, definitions, terms, tuple(c for c in conditions if c is not sympy.true),
        None if symbols.general and quantity == "T" else replace(
            quotient, sums=tuple(sums), code=symbols.code, growth=symbols.growth
        ),
    )  # fmt: skip


def _expression(total: Sum | Expr) -> Expr:
    """A sum of exponentials as an expression."""
    if not isinstance(total, Sum):
        return sympy.expand_mul(total).replace(lambda e: e.is_Mul, one_exponential)
    return sum((a * sympy.exp(LAM * height) for height, a in total.terms), S.Zero)


def _contributions(
    one: OneSided, symbols: Symbols, order: int, weight: str, start: Expr
) -> Iterator[Contribution]:
    """The pairs of one side, the first with what the start adds to int e^{-lam V}."""
    ring, sign = Symbolic(), "" if weight == "1 - C" else "-"
    scale = scale_contributions(one, 1 + BEYOND_1, ring)
    if start != 0:
        series, u = Series([Part(0.0, 0, [start])]), symbols.start
        kind = symbols.case.at_start or "kink"
        own = CriticalPoint(-1, S.Zero, series, None, kind, -u if sign else u)
        one = one._replace(speed_points=[own, *one.speed_points])
    for low, high, product_of_both in pairs_of(one, scale, ring):
        if not product_of_both.terms:
            continue
        parts = [_series(p.series, symbols) for p in (low, high)]
        if high.rank == low.rank:
            parts[1] = _series(high.onward, symbols)
        rows = [[sympy.sympify(c) for c in p.coefficients] for p in parts]
        front = 2 / KAPPA**2
        for part in parts:
            front *= part.front
        product = []
        for n in range(order + 1):
            step()
            shared = [rows[0][i] * rows[1][n - i] for i in range(n + 1)
                      if i < len(rows[0]) and n - i < len(rows[1])]  # fmt: skip
            product.append(sympy.expand(sympy.Add(*shared) / 2**n))
        yield Contribution(
            (_called(low, sign), _called(high, sign)),
            (2 / KAPPA**2 * (low.height + high.height)).xreplace({BEYOND_1: R - 1}),
            sympy.powdenest(front.xreplace({X: KAPPA**2 / 2}), force=True),
            tuple(product),
            weight,
        )


def _series(series: Any, symbols: Symbols) -> SeriesOf:
    """A series by the definition of its symbol."""
    (part,) = series.parts
    (c,) = part.coefficients
    factor, symbol = c.as_coeff_Mul()
    if symbol in symbols.series:
        known = symbols.series[symbol]
        return replace(known, front=factor * known.front)
    return SeriesOf(X ** sympy.Rational(part.offset), (c,))


def _called(p: CriticalPoint, sign: str) -> str:
    """The name of a point; in the mirror its u has the other sign."""
    if p.u is None:
        return f"end u = {sign}r"
    u = -p.u if sign else p.u
    return f"{p.kind} u = {u}" if u.is_number else f"{p.kind} {u}"


def radius_condition(start: Any) -> Any:
    """The condition that the radius is beyond the layer and the start."""
    return sympy.Gt(R, max(S.One, abs(sympy.sympify(start))))


def _conditions(symbols: Symbols, quantity: str) -> Iterator[Any]:
    """The conditions of the formula, as predicates."""
    yield from symbols.conditions()
    points: list[Any] = [-S.One, *symbols.zeros, S.One]
    if quantity in OF_START:
        if abs(symbols.start) < 1:
            points.insert(1 + symbols.case.before, symbols.start)
        if not symbols.general:
            yield radius_condition(symbols.start)
    yield from (a < b for a, b in itertools.pairwise(points) if (a < b) is not sympy.true)
    for u in symbols.zeros:
        yield sympy.Eq(sympy.Function("A")(u) if symbols.general else symbols.A.subs(U, u), 0)
    if symbols.general:
        (well, barrier) = symbols.zeros
        yield sympy.Gt(symbols.heights[barrier], symbols.heights[well])
        return
    if symbols.powers is not None and symbols.kept:
        yield sympy.Ne(symbols.powers.LC(), 0)
    ends = symbols.A.subs(U, -1), symbols.A.subs(U, 1)
    if quantity in OF_START:
        yield from (sympy.Ne(a, 0) for a in ends)
        if kind := symbols.case.at_start:
            slope = sympy.diff(symbols.A, U).subs(U, symbols.start)
            yield sympy.Gt(slope, 0) if kind == "barrier" else sympy.Lt(slope, 0)
        elif abs(symbols.start) < 1:
            yield sympy.Ne(symbols.A.subs(U, symbols.start), 0)
    else:
        yield from (sympy.Gt(ends[0], 0), sympy.Lt(ends[1], 0))
