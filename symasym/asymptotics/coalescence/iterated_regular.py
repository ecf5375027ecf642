"""The regular part of an iterated integral, where u and v are close to each other.

M(v) = e^{lam f(v)} int^v g e^{-lam f} solves M' = g + lam f' M, and besides exponentials it is
m_1/lam + m_2/lam² + ... with phi = -f', m_1 = g/phi and m_(k+1) = -m_k'/phi (the slow manifold of
that equation). Here the integrals of h m_k are taken on a path past both zeros of a pair on one
side: their real part is Hadamard's finite part where the zeros are real, and is analytic through
their coalescence. On the path no m_k is large, so that nothing cancels.

The path is the real line with half circles above the zeros, wide ones: both zeros, and no other
singularity, are below one half circle, or each has its own. Every piece is bisected until the last
Legendre coefficients of the integrand at Gauss's points are small to more than half of the digits:
the error of the integral is about the square of that.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.parts import Nearby, root_test, series_of
from symasym.base.errors import AccuracyError
from symasym.numbers.polynomials import laurent, poly, residues, shifted
from symasym.series.coefficient_fields import RealField

if TYPE_CHECKING:
    from mpmath import mpc, mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

#: A path from t = 0 to 1, and its derivative.
Path = Callable[[Any], tuple[Any, Any]]

# Half the pair's distance over the free radius up to which one half circle is about both.
_NEAR = 0.6
_MOST_PANELS = 200
# Taylor coefficients at one zero from which its free radius is estimated.
_ORDERS = 30


class RegularPart:
    """Integrals of h m_k, k = 1 to `count`, at one precision; `ends` are infinite or mpf."""

    def __init__(
        self,
        f: Expr,
        weights: tuple[Expr, Expr],
        x: Symbol,
        ends: tuple[mpf, mpf],
        near: Nearby,
        count: int,
        context: MPContext,
    ) -> None:
        self._slope, self._weights, self._x = sympy.diff(f, x), weights, x
        self._ends, self._near, self._count, self._context = ends, near, count, context
        self._field = RealField(context)
        # As many points as digits, or nearly: a panel is then as long as it is far from zeros.
        degree = 4 + max(0, int(context.dps / 20).bit_length())
        self._rule = [tuple(context.convert(y) for y in row) for row in _rule(degree, context.prec)]
        self._polynomials = [
            [self._field.expression(c) for c in reversed(sympy.Poly(e, x).all_coeffs())]
            if e.is_polynomial(x)
            else None
            for e in (self._slope, *weights)
        ]
        pair = near.pair
        self._middle, self._half = near.point + pair.middle, context.sqrt(abs(pair.square))
        self._free = self._free_radius(self._middle, pair.psi, near.weights)
        self._together = self._half <= _NEAR * self._free

    def past_both(self) -> list[mpf]:
        """The real part of the integrals on the path above both zeros."""
        if self._near.pair.square < 0 and not self._together:
            on_line, share = self._along([]), self.share()
            return [x - y for x, y in zip(on_line, share, strict=True)]
        return self._along(self._detours())

    def share(self) -> list[mpf]:
        """The integrals along the real line less those of `past_both`, for a complex pair.

        2 pi i times the residues at the zero above the line.
        """
        context, count = self._context, self._count
        zero = self._middle + context.j * self._half
        slope, g, h = (self._taylor(k, zero, 2 * count) for k in range(3))
        row = residues([-c for c in slope], count, g, h)
        return [-2 * context.pi * context.im(residue) for residue in row]

    # -- the path ----------------------------------------------------------------------------------

    def _detours(self) -> list[tuple[mpf, mpf]]:
        """Middles and radii of the half circles, from left to right."""
        context, half, free = self._context, self._half, self._free
        if self._together:
            radius = (
                1 + 2 * half if free == context.inf else max(free / 2, context.sqrt(half * free))
            )
            return [(self._middle, radius)]
        circles = []
        for zero in (self._middle - half, self._middle + half):
            free = min(2 * half, self._free_radius(zero, *self._series_at(zero)))
            circles.append((zero, free * 2 / 5))
        return circles

    def _series_at(self, zero: mpc) -> tuple[list[Any], list[list[Any]]]:
        """Taylor series of f'/(x - zero) and of the weights."""
        rows = [
            series_of(name, e, self._x, zero, 1, _ORDERS, self._field)
            for name, e in zip("fgh", (self._slope, *self._weights), strict=True)
        ]
        return rows[0][1:], rows[1:]

    def _free_radius(self, middle: mpf, rest: list[Any], weights: list[list[Any]]) -> mpf:
        """A radius within which `rest` has no zero, all series converge and no end lies."""
        context = self._context
        radius = min([abs(end - middle) for end in self._ends] + [context.inf])
        for e, row in zip((self._slope, *self._weights), (rest, *weights), strict=True):
            inverse = 0 if e.is_polynomial(self._x) else root_test(row, context)
            if inverse:
                # The root test sees the radius roughly.
                radius = min(radius, context.mpf(7) / 10 / inverse)
        sizes = [abs(c / rest[0]) for c in rest]
        first = min((context.root(1 / c, j) for j, c in enumerate(sizes) if j and c), default=None)
        if first is None:
            return radius
        low, high = first * 9 / 20, first
        for _ in range(6):
            r = (low + high) / 2
            small = sum(c * r**j for j, c in enumerate(sizes) if j) < context.mpf(9) / 10
            low, high = (r, high) if small else (low, r)
        return min(radius, low)

    def _along(self, detours: list[tuple[Any, Any]]) -> list[mpf]:
        """The integrals along the real line with half circles for the detours."""
        context = self._context
        lo, hi = self._ends
        if not detours and context.isinf(lo) and context.isinf(hi):
            detours = [(self._middle, context.zero)]
        marks, total = [lo], [context.zero] * self._count
        pieces: list[Path] = []
        for middle, radius in detours:
            self._require_same(middle, radius)
            marks += [middle - radius, middle + radius]
            if radius:
                pieces.append(_half_circle(middle, radius, context))
        marks.append(hi)
        scale = detours[0][1] if detours and detours[0][1] else 1 + self._half
        ends = zip(marks[::2], marks[1::2], strict=True)
        pieces += [_line(start, end, scale, context) for start, end in ends]
        for piece in pieces:
            for k, y in enumerate(self._integral(piece)):
                total[k] += y
        return total

    def _require_same(self, middle: mpf, radius: mpf) -> None:
        """Refuse expressions that are, off the real line, another branch than their series."""
        context, near = self._context, self._near
        if not (radius and self._together):
            return
        away = context.mpc(0, radius)
        top, by = middle + away, near.pair.middle + away
        # The pair is that of phi = -f'.
        slope = -near.pair.sign * (away**2 - near.pair.square) * poly(near.pair.psi, away)
        series = [slope, *(poly(row, by) for row in near.weights)]
        for name, e, y in zip("fgh", (self._slope, *self._weights), series, strict=True):
            value = series_of(name, e, self._x, top, 1, 2, self._field)[0]
            if abs(value - y) > abs(y) / 10**4:
                raise self._unsettled()

    # -- the rule ----------------------------------------------------------------------------------

    def _values(self, v: mpf | mpc) -> list[mpc]:
        """h m_k at a point off the zeros."""
        n = self._count
        slope, g, h = (self._taylor(k, v, count) for k, count in ((0, n), (1, n), (2, 1)))
        return [h[0] * row[0] for row in laurent([-c for c in slope], False, n, g)]

    def _taylor(self, which: int, v: mpf | mpc, count: int) -> list[mpc]:
        """Taylor coefficients of f', g or h."""
        row, context = self._polynomials[which], self._context
        if row is None:
            e = (self._slope, *self._weights)[which]
            return list(series_of("fgh"[which], e, self._x, v, 1, max(2, count), self._field))[
                :count
            ]
        coefficients = shifted([c + 0 * v for c in row], v)[:count]
        return coefficients + [context.zero] * (count - len(coefficients))

    def _integral(self, path: Path) -> list[mpf]:
        """The integrals over 0 <= t <= 1, bisected until the last Legendre terms are small."""
        waiting, total = [(0, 1), (1, 1)], [self._context.zero] * self._count
        scale: list[Any] = []
        for _ in range(_MOST_PANELS):
            if not waiting:
                return total
            index, depth = waiting.pop()
            values, last, sizes = self._panel(path, index, depth)
            # The largest panel so far is what rounding is seen against.
            scale = [max(x, y) for x, y in zip(scale or sizes, sizes, strict=True)]
            if self._settled(last, scale):
                total = [x + y for x, y in zip(total, values, strict=True)]
            else:
                waiting += [(2 * index, depth + 1), (2 * index + 1, depth + 1)]
        raise self._unsettled()

    def _panel(self, path: Path, index: int, depth: int) -> tuple[list[mpf], list[mpf], list[mpf]]:
        """The integrals over index/2^depth <= t <= (index + 1)/2^depth, by Gauss's rule.

        With the share of the integrands in the last two Legendre polynomials, and the integrals of
        the moduli.
        """
        context, count = self._context, self._count
        half = context.ldexp(1, -depth - 1)
        values, sizes = [context.zero] * count, [context.zero] * count
        tails = [[context.zero] * count, [context.zero] * count]
        for x, weight, *last in self._rule:
            point, speed = path(half * (2 * index + 1 + x))
            for k, y in enumerate(self._values(point)):
                part = half * weight * y * speed
                real = context.re(part)
                values[k] += real
                sizes[k] += abs(part)
                for tail, factor in zip(tails, last, strict=True):
                    tail[k] += factor * real
        return values, [abs(x) + abs(y) for x, y in zip(*tails, strict=True)], sizes

    def _settled(self, off: list[Any], sizes: list[Any]) -> bool:
        """True if the differences are small to more than half of the digits."""
        least = self._context.ldexp(1, -self._context.prec * 11 // 20)
        return all(x <= least * size for x, size in zip(off, sizes, strict=True))

    def _unsettled(self) -> AccuracyError:
        """The error that the digits were not reached."""
        return AccuracyError(
            f"the part of the integral with u near v was not found to {self._context.dps} digits: "
            f"f' = {self._slope} nearly vanishes, or f, g or h varies too fast, on the way from "
            "end to end; give an interval that ends before that, or fewer digits."
        )


@cache
def _rule(degree: int, precision: int) -> list[tuple[mpf, mpf, mpf, mpf]]:
    """Points and weights of Gauss-Legendre with 3 2^(degree - 1) points.

    With the factors of a value, besides its weight, that give the last two Legendre coefficients.
    """
    from mpmath.calculus.quadrature import GaussLegendre
    from mpmath.ctx_mp import MPContext

    context = MPContext()
    context.prec = precision
    nodes = GaussLegendre(context).calc_nodes(degree, precision)
    orders = len(nodes) - 1, len(nodes) - 2
    rule = []
    for x, weight in nodes:
        high, low = ((2 * n + 1) * context.legendre(n, x) / 2 for n in orders)
        rule.append((x, weight, high, low))
    return rule


def _line(a: mpf, b: mpf, scale: mpf, context: MPContext) -> Path:
    """A straight path, mapped rationally where one end is infinite."""
    if context.isinf(a) or context.isinf(b):
        # Where the integrand falls as a power, it is a polynomial in t, or nearly.
        start, side = (b, -1) if context.isinf(a) else (a, 1)
        return lambda t: (start + side * scale * (1 / t - 1), scale / t**2)
    return lambda t: (a + (b - a) * t, b - a)


def _half_circle(middle: mpf, radius: mpf, context: MPContext) -> Path:
    """The half circle above the real line, from left to right."""

    def path(t: mpf) -> tuple[mpc, mpc]:
        turn = radius * context.expjpi(1 - t)
        return middle + turn, -context.j * context.pi * turn

    return path
