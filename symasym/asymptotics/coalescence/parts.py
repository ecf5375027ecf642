"""The parts of a uniform expansion: ends, a saddle near an end, two coalescing saddles.

**The end and the saddle** (error functions). In the variable v of the saddle, f = f_max - alpha v²
and g dx = G(v) dv, the integral from an end v_e on is (N. Bleistein, Comm. Pure Appl. Math. 19
(1966) 353; R. Wong, Asymptotic Approximations of Integrals, VII.3; DLMF 2.3(iii) for the end by
itself)

    e^(lam f_max) sqrt(pi/(lam alpha)) ½ erfc(v_e sqrt(lam alpha)) sum_n a_n lam^(-n)
    + e^(lam f_end) sum_n b_n lam^(-n-1).

With G_0 = G, G_n = G_n(0) + v H_n and G_(n+1) = H_n'/(2 alpha): a_n = G_n(0) and
b_n = H_n(v_e)/(2 alpha), which is analytic in v_e although H_n is a difference quotient. Near the
saddle b_n is summed from G's Taylor series there. Farther away it's what the end's own expansion
has beyond that of the complementary error function.

**Two saddles** (Airy functions, with coefficients from the cubic map). With f = level + s³/3 - zeta
s and g dx = G ds, G = a_0 + b_0 s + (s² - zeta) H_0, one integration by parts turns (s² - zeta) H_0
into -H_0'/lam: a_n and b_n are those of G_n, G_(n+1) = H_n' (Chester, Friedman and Ursell; DLMF
2.4(v)). From G = sum (p_k + q_k s)(s² - zeta)^k this takes no division, so nothing is lost at the
coalescence.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

import sympy

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.asymptotics.laplace.kinks import Piece
from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError, InputError
from symasym.numbers.polynomials import poly, product
from symasym.series.coefficient_fields import RealField
from symasym.series.quadratic_factor import Pair, split_pair
from symasym.series.taylor_series import NotAnalytic, algebraic, taylor
from symasym.special.airy import by_parts

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real
    from symasym.numbers.arithmetic import Number as Element

#: One term of a part: its value at lam, and a size that has no zeros by chance.
Term = tuple[Any, Any]

#: Terms behind the last one used that the error is estimated from.
BEYOND = 3

# Share of its radius of convergence within which the saddle's series is summed at the end.
# Beyond it the difference of two expansions loses 2 n + 1 times the digits of 1/_NEAR.
_NEAR = 0.15
_LONGEST = 200
# Orders lost to factors such as sin(x)/x.
_SPARE = 4
_GUARD = 10


def series_of(
    name: str, expression: Expr, x: Symbol, point: Real, side: int, n: int, field: RealField
) -> list[mpf]:
    """Taylor coefficients of the expression; InputError where it has none."""
    try:
        return taylor(expression, x, point, side, n, field).c
    except NotAnalytic:
        pass
    try:
        # Zero over zero, as sin(x)/x.
        terms = algebraic(expression, x, point, side, n + _SPARE, field)
        whole = all(isinstance(e, Fraction) and e.denominator == 1 and e >= 0 for e, _ in terms)
    except InputError:
        whole = False
    if not whole:
        shown = point if isinstance(point, sympy.Basic) else field.context.nstr(point, 12)
        raise InputError(
            f"{name} = {expression} has no Taylor series at {x} = {shown}; uniform_integral takes "
            "f and g that are analytic at their saddles, ends and kinks."
        )
    coefficients = [field.rational(Fraction(0))] * n
    for front, series in terms:
        for k, y in enumerate(series.c[: max(0, n - int(front))], start=int(front)):
            coefficients[k] = coefficients[k] + y
    return coefficients


def end_coefficients(
    piece: Piece, x: Symbol, end: Real, side: int, count: int, unit: Element, field: RealField
) -> list[Any]:
    """c_n of e^(lam unit f(end)) sum c_n lam^(-n-1), the integral from the end to its `side`."""
    f = series_of("f", piece.f, x, end, side, count + 2, field)
    g = series_of("g", piece.g, x, end, side, max(count, 2), field)[:count]
    if field.negligible(f[1], f[1:]):
        raise InputError(
            f"the slope of f = {piece.f} is zero at the end {x} = {end}, where f is not largest; "
            "move the end."
        )
    return end_series(f, g, unit)


def end_series(f: list[Any], g: list[Any], unit: Element = 1) -> list[Any]:
    """Watson's coefficients c_n at an end from Taylor coefficients on its side, as many as g's."""
    d, steep = perron_coefficients(f[: len(g) + 1], g, 1), -unit * f[1]
    return [y * math.factorial(n) / steep ** (n + 1) for n, y in enumerate(d)]


def saddle_rows(d: list[Any], alpha: Element, count: int) -> list[list[Any]]:
    """Taylor coefficients of G_0, ..., G_(count - 1) in v, from those of G."""
    row, rows = list(d), []
    for _ in range(count):
        rows.append(row)
        row = [(k + 1) * y / (2 * alpha) for k, y in enumerate(row[2:])]
    return rows


def beyond_erfc(c: list[Any], a: list[Any], alpha: Element, v: Element) -> list[Any]:
    """b_n at an end away from the saddle: c_n of the end's own less those of ½ erfc times a_n."""
    # ½ erfc(v sqrt(lam alpha)) has (-1)^m (1/2)_m (alpha v²)^-m/(2 alpha v), DLMF 7.12.1.
    tail = [1 / (2 * alpha * v)]
    for m in range(len(c) - 1):
        tail.append(-tail[-1] * (2 * m + 1) / (2 * alpha * v * v))
    return [y - z for y, z in zip(c, product(a, tail, len(c)), strict=True)]


class SumPart(Protocol):
    """A part of a sum, of which the terms at any lam are known."""

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """The terms of order lam^0 to lam^(1 - count), beside the part's own functions."""


@dataclass(frozen=True)
class EndPart:
    """The endpoint contribution of a finite end where f has no saddle near it (Watson's lemma).

    side is 1 at the lower end and -1 at the upper one; unit is 1, or i for an oscillating integral.
    """

    piece: Piece
    x: Symbol
    end: Real
    side: int
    oscillating: bool = False

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """e^(lam f) c_n lam^(-n-1)."""
        height, c = kept(self, count, context, self._coefficients)
        unit = context.j if self.oscillating else context.mpf(1)
        front = context.exp(unit * lam * height)
        values = [front * y * lam ** (-n - 1) for n, y in enumerate(c)]
        return [(y, abs(y)) for y in values]

    def _coefficients(self, count: int, context: MPContext) -> tuple[Any, list[Any]]:
        """f at the end, and c_n of `end_coefficients`."""
        field = RealField(context)
        unit = context.j if self.oscillating else context.mpf(1)
        height = series_of("f", self.piece.f, self.x, self.end, 1, 2, field)[0]
        c = end_coefficients(self.piece, self.x, self.end, self.side, count, unit, field)
        return height, c


def kept(
    part: object, count: int, context: MPContext, compute: Callable[[int, MPContext], Any]
) -> Any:
    """The numbers of `compute`, kept by digits in steps of ten: neighbouring lam share them."""
    dps = -(-context.dps // 10) * 10
    known = part.__dict__.setdefault("_known", {})
    if (count, dps) not in known:
        with own_context(dps + _GUARD + 3 * count) as inner:
            known[count, dps] = compute(count, inner)
    return _into(context, known[count, dps])


def _into(context: MPContext, value: object) -> Any:
    """Numbers of another context, in lists and tuples, as this one's."""
    if isinstance(value, (list, tuple)):
        return type(value)(_into(context, y) for y in value)
    if hasattr(value, "_mpc_"):
        return context.make_mpc(value._mpc_)
    return context.make_mpf(value._mpf_) if hasattr(value, "_mpf_") else value


@dataclass(frozen=True)
class SaddlePart:
    """A maximum of f, inside or beyond the ends, with the ends it can coalesce with.

    lower and upper are None where no end is near: then the integral is over all of that side. Or a
    minimum, which adds nothing by itself, with one end: then erfc's odd part stands for it.
    """

    piece: Piece
    x: Symbol
    point: Real
    lower: Real | None = None
    upper: Real | None = None
    minimum: bool = False

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """The terms of order lam^(-n), those of erfc and those of the ends together (Bleistein).

        The integral over the whole line, one end (erfc) or between two (a difference of erfc);
        beside a minimum erfi.
        """
        alpha, height, a, ends = kept(self, count, context, self._coefficients)
        root = context.sqrt(abs(lam * alpha))
        distances = {sign: v for sign, v, _, _ in ends}
        part = context.mpf(1)
        if self.minimum:
            ((sign, v),) = distances.items()
            part = -sign * context.erfi(v * root) / 2
        elif len(ends) == 2:
            part = (context.erfc(distances[1] * root) - context.erfc(distances[-1] * root)) / 2
        elif ends:
            ((sign, v),) = distances.items()
            part = context.erfc(sign * v * root) / 2
        front = context.exp(lam * height) * context.sqrt(context.pi) / root * part
        terms = []
        for n in range(count):
            inside = front * a[n] * lam**-n
            value, size = inside, abs(inside)
            for sign, _, b, level in ends:
                edge = sign * context.exp(lam * level) * b[n] * lam ** (-n - 1)
                value, size = value + edge, size + abs(edge)
            terms.append((value, size))
        return terms

    def _coefficients(self, count: int, context: MPContext) -> tuple[Any, ...]:
        """alpha, f at the saddle, a_n, and for each end its side, v, b_n and f."""
        local = _SaddleNumbers(self, count, context)
        return local.alpha, local.height, local.a, local.ends


@dataclass(frozen=True)
class BestOf:
    """Ways to add up the same ends and saddles, of which the one that errs least at lam is taken.

    An end may stand alone or with the saddle that it has on either side. A saddle far away is of no
    use, and what is analytic on the interval may be singular there; with one near, an end alone
    has coefficients that diverge.
    """

    ways: tuple[tuple[SumPart, ...], ...]

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """The terms of the way whose next terms are smallest at this lam."""
        sums: list[list[Term]] = []
        refusal: InputError | AccuracyError | None = None
        for parts in self.ways:
            try:
                rows = [part.terms(lam, count, context) for part in parts]
            except (InputError, AccuracyError) as error:
                refusal = error
                continue
            columns = zip(*rows, strict=True)
            sums.append([(sum(v for v, _ in c), sum(s for _, s in c)) for c in columns])
        if not sums:
            assert refusal is not None
            raise refusal
        return min(sums, key=lambda terms: max(size for _, size in terms[-BEYOND:]))


class _SaddleNumbers:
    """The numbers of a `SaddlePart` at one precision."""

    def __init__(self, part: SaddlePart, count: int, context: MPContext) -> None:
        self._part, self._count = part, count
        self._field = RealField(context)
        self.point = self._field.expression(refined(part.piece, part.x, part.point, self._field))
        self._expand(2 * count + 12)
        self.ends: list[tuple[int, Any, list[Any], Any]] = []
        for sign, end in ((1, part.lower), (-1, part.upper)):
            if end is not None:
                self.ends.append((sign, *self._end(end)))

    def _expand(self, n: int) -> None:
        """G(v) = sum of d_k v^k, to order n."""
        part, field = self._part, self._field
        f = series_of("f", part.piece.f, part.x, self.point, 1, n + 3, field)
        g = series_of("g", part.piece.g, part.x, self.point, 1, n + 1, field)
        if (f[2] < 0) == part.minimum or field.negligible(f[2], f[2:]):
            raise InputError(
                f"f = {part.piece.f} is flatter than a parabola at its maximum; uniform_integral "
                "takes maxima with f'' < 0 (laplace_integral takes others)."
            )
        self.f, self.alpha, self.height = f, -f[2], f[0]
        self.d = perron_coefficients([0 * f[0], 0 * f[0], *f[2:]], g, 2)
        # For the series and for what it gives after differentiating, the later terms count.
        top = max(abs(y) for y in self.d[:4]) or max(abs(y) for y in self.d)
        if not top:
            raise InputError(
                f"g = {part.piece.g} vanishes at the maximum to so high an order that no term "
                "asked for is left; ask for a higher order=n."
            )
        self._rate = max(
            (abs(y) / top) ** (field.context.mpf(1) / k) for k, y in enumerate(self.d) if k > 3
        )
        self.a = [row[0] for row in saddle_rows(self.d, self.alpha, self._count)]

    def _end(self, end: Real) -> tuple[Any, list[Any], Any]:
        """v at an end, b_n there and f."""
        context = self._field.context
        where = self._field.expression(end)
        height = series_of("f", self._part.piece.f, self._part.x, where, 1, 2, self._field)[0]
        v = self._distance(where, height)
        reach = abs(v) * self._rate
        if reach <= _NEAR:
            digits = context.dps / -context.log10(reach) if reach else 0
            n = int(digits) + 2 * self._count + 4
            if n <= _LONGEST:
                if n > len(self.d):
                    self._expand(n)
                rows = saddle_rows(self.d, self.alpha, self._count)
                return v, [poly(row[1:], v) / (2 * self.alpha) for row in rows], height
        return v, self._matched(where, v), height

    def _distance(self, where: mpf, height: mpf) -> Any:
        """v at the end: from the series where f_max - f would cancel."""
        context = self._field.context
        t = where - self.point
        ratios = [y / self.f[2] for y in self.f[2:]]
        size = max((abs(y * t**k) for k, y in enumerate(ratios) if k > len(ratios) // 2), default=0)
        if size < context.mpf(2) ** -context.prec:
            return t * context.sqrt(poly(ratios, t))
        drop = (self.height - height) / self.alpha
        if not drop > 0:
            raise AccuracyError(
                f"f at the end {self._part.x} = {context.nstr(where, 12)} is as high as at the "
                f"saddle {context.nstr(self.point, 12)}, so the end belongs to another maximum; "
                "split the integral between them."
            )
        return context.sqrt(drop) * (1 if t > 0 else -1)

    def _matched(self, where: mpf, v: Element) -> list[Any]:
        """b_n from the end's own expansion, away from the saddle (`beyond_erfc`)."""
        part, context = self._part, self._field.context
        unit = context.mpf(1)
        c = end_coefficients(part.piece, part.x, where, 1, self._count, unit, self._field)
        return beyond_erfc(c, self.a, self.alpha, v)


# -- two coalescing saddles ------------------------------------------------------------------------


_MOST_TERMS = 800


@dataclass(frozen=True)
class PairPart:
    """The pair of `phase`'s stationary points next to `point`, a zero of its second derivative.

    oscillating: the integral of weight e^(i lam phase) along the real axis. Otherwise that of
    weight e^(lam phase) from the valley in the lower half plane to the one in the upper, over i.
    """

    piece: Piece
    x: Symbol
    point: Real
    oscillating: bool

    def terms(self, lam: mpf, count: int, context: MPContext) -> list[Term]:
        """2 pi e^(lam level) (-lam)^-n (a_n Ai lam^(-1/3) - b_n Ai' lam^(-2/3)), of lam^(2/3) zeta.

        Of an oscillating integral the same with lam/i; the sizes have the modulus functions for Ai.
        """
        zeta, level, sign, a_, b_ = kept(self, count, context, self.coefficients)
        cube = context.cbrt(lam)
        argument = (-1 if self.oscillating else 1) * cube**2 * zeta
        ai, slope = context.airyai(argument), context.airyai(argument, derivative=1)
        # Ai and Ai' have zeros on the oscillating side; the modulus functions don't.
        size, size_slope = abs(ai), abs(slope)
        if argument < 0:
            size = context.hypot(ai, context.airybi(argument))
            size_slope = context.hypot(slope, context.airybi(argument, derivative=1))
        unit = context.j if self.oscillating else context.mpf(1)
        step = context.j / lam if self.oscillating else -1 / lam
        front = 2 * context.pi * sign * context.exp(unit * lam * level)
        turn = -context.j if self.oscillating else -1
        terms = []
        for n in range(count):
            a, b = a_[n], b_[n]
            value = front * step**n * (a * ai / cube + turn * b * slope / cube**2)
            spread = abs(a) * size / cube + abs(b) * size_slope / cube**2
            terms.append((value, abs(front) * spread / lam**n))
        return terms

    def coefficients(self, count: int, context: MPContext) -> tuple[Any, ...]:
        """zeta, level and sign of the map, and a_n, b_n without their powers of i or -1."""
        f, weights = self.piece.f, (self.piece.g,)
        _, pair, (weight,), start = nearby_pair(
            f, weights, self.x, self.point, 2 * count - 1, context
        )
        pq = map_coefficients(pair, 2 * count - 1, context, weight)
        return (pair.zeta, start + pair.level, pair.sign, *by_parts(pair.zeta, pq, count))


class Nearby(NamedTuple):
    """A pair of saddles, about `point`, where f is `start` and the weights have these series."""

    point: Real
    pair: Pair
    weights: list[list[Any]]
    start: Any


def nearby_pair(
    f: Expr, weights: tuple[Expr, ...], x: Symbol, point: Real, count: int, context: MPContext
) -> Nearby:
    """The pair of f' about `point`, a zero of its slope.

    From as many coefficients as `count` pairs of the cubic map and the digits ask for.
    """
    field = RealField(context)
    # refined finds zeros of a derivative: here of f''.
    curved = Piece(-sympy.oo, sympy.oo, sympy.diff(f, x), sympy.Integer(1))
    point = field.expression(refined(curved, x, point, field))
    n = 2 * count + 30
    while True:
        steep = series_of("f", f, x, point, 1, n + 1, field)
        rows = [series_of("g", g, x, point, 1, n, field) for g in weights]
        c = [(k + 1) * y for k, y in enumerate(steep[1:])]
        try:
            pair = split_pair(without_zeros(c, 3), context)
        except AccuracyError:
            raise _too_far(x, point, context) from None
        distance = context.sqrt(abs(pair.square)) + abs(pair.middle)
        # Polynomials are known as a whole. (A last coefficient of 0 does not make one.)
        series = [
            row
            for e, row in zip((f, *weights), (c[2:], *rows), strict=True)
            if not e.is_polynomial(x)
        ]
        reach = max((distance * root_test(row, context) for row in series), default=context.zero)
        needed = 2 * count + 6
        if reach > 0:
            needed += int(context.dps / max(-context.log10(reach), context.mpf("0.001")))
        if reach >= 1 or needed > _MOST_TERMS:
            raise _too_far(x, point, context)
        if needed <= n:
            return Nearby(point, pair, [without_zeros(row) for row in rows], steep[0])
        n = needed + needed // 10


def root_test(row: list[mpf], context: MPContext) -> mpf:
    """One over the radius of convergence, roughly."""
    top = max(abs(y) for y in row[:3])
    later = [(k, y) for k, y in enumerate(row) if k >= max(1, len(row) // 2) and y and top]
    return max((context.root(abs(y) / top, k) for k, y in later), default=context.zero)


def _too_far(x: Symbol, point: Real, context: MPContext) -> AccuracyError:
    """The error that the pair is not alone."""
    return AccuracyError(
        f"no pair of saddles next to {x} = {context.nstr(point, 8)} is alone within the "
        "radius of convergence, so they're too far apart, or a third is near; give near=… for "
        "another pair, or take each saddle by itself, as laplace_integral does."
    )


def without_zeros(c: list[Any], least: int = 1) -> list[Any]:
    """Polynomials without the zeros behind them, which only cost time."""
    n = len(c)
    while n > least and c[n - 1] == 0:
        n -= 1
    return c[:n]


def refined(piece: Piece, x: Symbol, point: Real, field: RealField) -> Real:
    """A point that is a rounded zero of f', to the field's precision (Newton); else unchanged."""
    if isinstance(point, sympy.Basic):
        return point
    context = field.context
    current = context.make_mpf(point._mpf_)
    for _ in range(60):
        try:
            _, slope, half = taylor(piece.f, x, current, 1, 3, field).c
        except NotAnalytic:
            break
        step = slope / (2 * half) if half else context.mpf(0)
        current -= step
        # Quadratic convergence: after a step of half the digits the next one is below the last.
        if abs(step) <= abs(current) * context.mpf(10) ** (-(context.dps * 2) // 3):
            break
    return current
