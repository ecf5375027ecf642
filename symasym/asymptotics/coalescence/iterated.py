"""The double integral over u < v of g(u) h(v) e^{lam (f(v) - f(u))} as two saddles coalesce.

The inner integral up to v has a part without exponential, and a constant times e^{lam f(v)} from
the lower end, and from the minimum of f where v has passed it. Integrated over v the first is the
regular part (`symasym.asymptotics.coalescence.iterated_regular`); the second brings the maximum
and the upper end. Minimum and maximum are taken together, in canonical Airy form (Chester, Friedman
and Ursell 1957; DLMF 9.11.4, `symasym.special.airy`), so that

    I = nested + regular + (end a) (max) + (min) (end b) + (end a) (end b) + (end a)²,

the products without those in which v would come first, and each end by its own series. The
regular part is that on a path past both points on one side. Far past their coalescence, where the
ends are nearer than the complex pair, what is left of the pair is an algebraic contribution to the
regular part, and the path is the real line.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.cubic_map import map_coefficients, truncation
from symasym.asymptotics.coalescence.iterated_regular import RegularPart
from symasym.asymptotics.coalescence.parts import end_coefficients, kept, nearby_pair, series_of
from symasym.asymptotics.coalescence.reading import closest_pair, require_alone, require_no_pole
from symasym.asymptotics.laplace.kinks import Piece, at, number
from symasym.base.call_context import own_context
from symasym.base.errors import InputError
from symasym.numbers.polynomials import product
from symasym.series.coefficient_fields import RealField
from symasym.special.airy import Rows, Term, by_parts, pair_terms, product_rows

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.numbers.arithmetic import Number as Element

_FAR = (10**2, 10**4, 10**6)
# Digits that the regular part, where nothing cancels, can do without.
_SPARE = 3


def iterated_parts(
    f: Expr, g: Expr, h: Expr, x: Symbol, lo: Expr, hi: Expr, near: Fraction | None
) -> list[IteratedPart]:
    """The parts of the integral, or the sentence that says why it is refused."""
    piece = Piece(lo, hi, f, g)
    for e in (g, h):
        require_no_pole(Piece(lo, hi, f, e), x)
    _require_fall(f, g, h, x, lo, hi)
    point, spread = closest_pair(piece, x, near, f)
    require_alone(piece, x, point, spread, f)
    return [IteratedPart(f, g, h, x, point, lo, hi)]


def _require_fall(f: Expr, g: Expr, h: Expr, x: Symbol, lo: Expr, hi: Expr) -> None:
    """Refuse infinite ends at which the integral diverges, or f has a finite limit."""
    integrand = g * h / sympy.diff(f, x)
    for end, side, weight in ((lo, -1, g), (hi, 1, h)):
        if not end.is_infinite:
            continue
        heights, sizes, tails = (
            [at(e, x, sympy.Integer(side * y)) for y in _FAR] for e in (f, weight, integrand)
        )
        with own_context(30) as context:
            drops = [context.mpf(-side) * context.make_mpf(y._mpf_) for y in heights]
            if not (drops[0] < drops[1] < drops[2] and drops[2] - drops[1] > 1):
                raise InputError(
                    f"f = {f} does not go to {'-oo' if side > 0 else 'oo'} as {x} tends to {end}, "
                    "so the integral diverges or has no expansion there; f must fall from oo at "
                    "a = -oo and to -oo at b = oo."
                )
            size, tail = (
                [abs(context.make_mpf(y._mpf_)) for y in row[1:]] for row in (sizes, tails)
            )
            if size[1] and context.log(size[1]) > drops[2]:
                raise InputError(
                    f"{weight} grows faster than the exponential falls as {x} tends to {end}, so "
                    "the integral diverges for some lam; give weights of slower growth."
                )
            if tail[1] and not tail[1] * _FAR[2] < tail[0] * _FAR[1] * context.mpf("0.97"):
                raise InputError(
                    f"g h/f' = {integrand} falls no faster than 1/{x} as {x} tends to {end}, so "
                    "the part with u near v diverges; give weights that fall faster, or a finite "
                    "end."
                )


@dataclass(frozen=True)
class IteratedPart:
    """The whole integral; `point` is the zero of f'' at the pair."""

    f: Expr
    g: Expr
    h: Expr
    x: Symbol
    point: Real
    lo: Expr
    hi: Expr
    _regular: dict[Any, Any] = field(default_factory=dict, compare=False)

    def coefficients(self, count: int, context: MPContext) -> tuple[Any, list[tuple[Any, ...]]]:
        """zeta, and the coefficients of the products of Airy functions and of the regular part."""
        zeta, onward, _, speed, scale, _, _ = self._pair(count, context)
        front = context.pi**2 if onward else context.zero
        rows = [[front * y for y in row] for row in product_rows(speed, scale)]
        regular = self._regular_rows(count, False, context.dps, context)
        return zeta, [(*row, y) for row, y in zip(rows, regular, strict=True)]

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """The terms of order lam^(-n), summed over the products of the module's formula."""
        zeta, onward, level, speed, scale, low, high = kept(self, count, context, self._pair)
        pair = pair_terms(zeta, speed, scale, lam, context)
        gaps = [abs(end[0] - level) for end in (low, high) if end]
        gap = min(gaps, default=context.inf)
        truncated, without_pair = truncation(zeta, gap, lam, context)
        parts = [self._regular_terms(lam, count, without_pair, context)]
        if onward and not without_pair:
            parts.append(pair.both)
        nothing = [(context.zero, context.zero)] * count
        low, high = (
            (end[0], *(_series(row, lam) for row in end[1:])) if end else () for end in (low, high)
        )
        both = None if without_pair else (pair.speed, pair.scale)
        for exponent, inner, outer in end_products(level, both, low, high):
            parts.append(_product(inner, outer, context.exp(lam * exponent)))
        sums = []
        for terms in zip(nothing, *parts, strict=True):
            sums.append((sum(v for v, _ in terms), sum(s for _, s in terms)))
        scale = truncated * sum((size for _, size in sums[:1]), context.zero)
        return [(value, size + scale) for value, size in sums]

    # -- what does not depend on lam ---------------------------------------------------------------

    def _pair(self, count: int, context: MPContext) -> tuple[Any, ...]:
        """zeta, whether the minimum is first, f's mean, both rows, and what the ends have."""
        near = nearby_pair(-self.f, (self.g, self.h), self.x, self.point, 2 * count - 1, context)
        pair = near.pair
        rows: list[Rows] = []
        for weight in near.weights:
            pq = map_coefficients(pair, 2 * count - 1, context, weight)
            a, b = by_parts(pair.zeta, pq, count)
            # s may run against u, and du = u' ds with it.
            rows.append([(pair.sign * y, pair.sign * z) for y, z in zip(a, b, strict=True)])
        level = -(near.start + pair.level)
        low, high = self._ends(count, context)
        return (pair.zeta, bool(pair.sign > 0), level, *rows, low, high)

    def _ends(self, count: int, context: MPContext) -> tuple[Any, Any]:
        """f at each finite end, and `end_coefficients` of the integrals from it."""
        field = RealField(context)
        down, up = Piece(self.lo, self.hi, -self.f, self.g), Piece(self.lo, self.hi, self.f, self.h)

        def row(piece: Piece, end: Expr, side: int) -> list[mpf]:
            return end_coefficients(piece, self.x, end, side, count, context.one, field)

        low: tuple[Any, ...] = ()
        high: tuple[Any, ...] = ()
        if not self.lo.is_infinite:
            height = series_of("f", self.f, self.x, self.lo, 1, 2, field)[0]
            low = height, row(down, self.lo, 1), row(up, self.lo, 1)
        if not self.hi.is_infinite:
            height = series_of("f", self.f, self.x, self.hi, 1, 2, field)[0]
            high = height, row(up, self.hi, -1)
        return low, high

    # -- at one lam --------------------------------------------------------------------------------

    def _regular_terms(self, lam: mpf, count: int, on_line: bool, context: MPContext) -> list[Term]:
        """The integrals of h m_k times lam^(-k)."""
        # lam has brought digits of its own for the exponents.
        digits = context.dps - max(0, int(context.log10(lam))) - _SPARE
        regular = self._regular_rows(count, on_line, digits, context)
        rows = [y * lam ** (-k - 1) for k, y in enumerate(regular)]
        return [(y, abs(y)) for y in rows]

    def _regular_rows(
        self, count: int, on_line: bool, digits: int, context: MPContext
    ) -> list[mpf]:
        """The integrals of h m_k, kept by digits."""
        key = count, on_line, -(-digits // 10) * 10
        if key not in self._regular:
            with own_context(key[2]) as inner:
                self._regular[key] = self._integrals(count, on_line, inner)
        return [context.make_mpf(y._mpf_) for y in self._regular[key]]

    def _integrals(self, count: int, on_line: bool, context: MPContext) -> list[mpf]:
        """The integrals of h m_k on the path past both points, or on the real line."""
        weights = self.g, self.h
        near = nearby_pair(-self.f, weights, self.x, self.point, 2 * count - 1, context)
        field = RealField(context)
        ends = [
            context.make_mpf(number(end)._mpf_) if end.is_infinite else field.expression(end)
            for end in (self.lo, self.hi)
        ]
        regular = RegularPart(self.f, weights, self.x, (ends[0], ends[1]), near, count, context)
        integrals = regular.past_both()
        if on_line:
            integrals = [y + z for y, z in zip(integrals, regular.share(), strict=True)]
        return integrals


def end_products(
    level: Element, pair: tuple[Any, Any] | None, low: tuple[Any, ...], high: tuple[Any, ...]
) -> list[tuple[Any, Any, Any]]:
    """(exponent over lam, inner, outer) of each product in which an end has a part.

    `pair` holds the expansions of int g e^{-lam f} and int h e^{lam f} at the pair of points about
    the height `level`, `low` the height of the lower end and the same two there, `high` the height
    of the upper end and that of int h e^{lam f}.
    """
    inner = [] if pair is None else [(-level, pair[0])]
    products = []
    if low:
        products.append((0 * level, low[1], low[2]))
        if pair is not None:
            products.append((level - low[0], low[1], pair[1]))
        inner.append((-low[0], low[1]))
    if high:
        products += [(exponent + high[0], row, high[1]) for exponent, row in inner]
    return products


def _series(c: list[mpf], lam: mpf) -> list[Term]:
    """c_n lam^(-n-1) with their moduli."""
    return [(y * lam ** (-n - 1), abs(y) * lam ** (-n - 1)) for n, y in enumerate(c)]


def _product(first: list[Term], second: list[Term], factor: mpf) -> list[Term]:
    """Terms of the product of two sums, in the order of their powers of 1/lam."""
    rows = [product([x[j] for x in first], [y[j] for y in second]) for j in (0, 1)]
    return [(factor * value, factor * size) for value, size in zip(*rows, strict=True)]
