"""Subdivision of the interval into panels on which e = e^{lam V} has a proved expansion.

With g = lam phi/sigma^2 times half the panel's width, t in [-1, 1], e = exp(-int g), and the
weights a = sigma^(-2 alpha) of the scale and b = sigma^(2 alpha - 2) of the speed density, a panel
is

- *moderate* if int |g| is at most a few dozen: power series in t, truncated with a bound by
  Cauchy's estimate; or
- *slow* if phi has no zero near the panel: x' = f + g x has a slowly varying solution (Chang 1972),
  a polynomial that is found by backward recurrence. Two solutions approach each other at the rate
  |g|, so that its residual divided by min |g| bounds its error.

Coefficients may be complex balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from operator import mul
from typing import Any, NamedTuple

from flint import acb, acb_poly, arb, arb_poly, ctx, fmpq

from symasym.base.errors import AccuracyError
from symasym.base.inputs import float_text
from symasym.drift.evaluate import Piece, halved, poly

_PANELS, _PANELS_A_BIT = 1_500, 12  # the largest number, and what each bit of lam adds to it
_WORK = 3e12  # about a minute: products of coefficients, times bits
_GROWTH = 0.15  # exponent per digit: 1,000 digits take the least time with 0.1 to 0.2
_LOG2, _LOG10 = math.log(2.0), math.log(10.0)
_STEEP = arb(10) ** 1_000  # beyond what numbers within 1e300 make of lam A
ENDS = arb(-1), arb(1)
# Radii of discs: for Cauchy's estimate; and those on which a slow solution's coefficients are
# bounded, with the share of g(0) that bounds |g| from below there.
_DISCS = [(arb(rho), math.log(rho)) for rho in (2, 3, 4.5, 6.5, 10, 16, 32, 100, 1e3, 1e5)]
_WIDTHS = [(arb(z), math.log(z), (z - 1) ** 2 / (2 * z)) for z in (3, 4, 5.5, 8, 20, 100, 1e3)]
_CELL, _GRID = 1 / 8, [arb(k / 8 - 1) for k in range(17)]


def largest_exponent(digits: int) -> float:
    """The largest int |g| over half a moderate panel; it grows with the digits."""
    return max(60.0, _GROWTH * digits)


# -- panels ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class TaylorModel:
    """A polynomial, and a bound of its difference from a function on [-1, 1]."""

    series: Any
    missed: arb

    def __call__(self, x: Any) -> Any:
        value = self.series(x)
        return value + within(self.missed, value)

    def __add__(self, other: TaylorModel) -> TaylorModel:
        return TaylorModel(self.series + other.series, self.missed + other.missed)

    def __mul__(self, other: TaylorModel) -> TaylorModel:
        if other is ONE:
            return self
        missed = self.size * other.missed + other.size * self.missed
        return TaylorModel(self.series * other.series, missed)

    def scaled(self, c: Any) -> TaylorModel:
        """The product with a number."""
        return TaylorModel(self.series * c, self.missed * abs(c))

    def integral(self) -> Any:
        """The integral over [-1, 1]."""
        whole = self.series.integral()
        value = whole(ENDS[1]) - whole(ENDS[0])
        return value + within(2 * self.missed, value)

    @property
    def size(self) -> arb:
        """A bound of the function's absolute value."""
        return sum(map(abs, self.series), self.missed)

    @property
    def relative(self) -> arb:
        """A bound of the relative error."""
        return self.missed / abs(self.series(arb(0, 1))) if self.missed > 0 else arb(0)


#: The weight 1.
ONE = TaylorModel(arb_poly([1]), arb(0))


class Panel(NamedTuple):
    """A panel, mapped to -1 <= t <= 1, and bounds of its integrals."""

    half: arb  # half its width
    slope: list[Any]  # coefficients of the polynomial g(t)
    q: Any  # the integral of g from 0; e = exp(-q) up to a factor
    blur: arb  # a bound of |lam phi half - g| on [-1, 1]
    terms: int  # number of terms of its power series, or of its slow solutions
    cauchy: Any  # rho, and int |g| to |t| = rho with log of a/max a, b/max b; None if slow
    a: TaylorModel
    b: TaylorModel
    rise: arb  # q(1) - q(-1)
    bounds: tuple[Any, Any, Any]  # logarithms of bounds of int a e, int b/e, the nested integral
    system: Any = None  # `transform.System`

    @property
    def work(self) -> float:
        """An estimate of the products of coefficients, times bits."""
        size = len(self.slope)
        return size * (size + self.terms) * ctx.prec * (1 if self.cauchy else 10)


def fewest_terms(height: Callable[[arb], Any], wanted: float) -> tuple[float, arb, Any]:
    """The least (height + wanted)/log rho, and rho and `height` there: the number of terms that by
    Cauchy's estimate give a power series, below e^height on |t| = rho, to e^-wanted."""
    best = math.inf, arb(1), arb(0)
    for rho, log in _DISCS:
        size = height(rho)
        if not (terms := (float(size) + wanted) / log) < best[0]:
            break  # `height` is convex in log rho, so that there is one minimum
        best = terms, rho, size
    return best


def panels(
    drift: Sequence[Piece],
    lam: Any,
    begin: fmpq,
    end: fmpq,
    digits: int,
    make: Callable[[Piece, Any, fmpq, fmpq, int], Any],
) -> list[Any]:
    """The panels from `begin` to `end`: parts of the pieces, halved until `make` accepts them."""
    found, work = list[Any](), 0.0
    most = _PANELS + _PANELS_A_BIT * max(0, math.ceil(float(abs(lam).log()) / _LOG2))

    def accepted(piece: Piece, middle: fmpq, half: fmpq) -> bool:
        nonlocal work
        if work > _WORK or not (panel := make(piece, lam, middle, half, digits)):
            return False
        found.append(panel)
        work += panel.work
        return True

    for piece in drift:
        low, high, lost = max(piece.left, begin), min(piece.right, end), None
        if low < high:
            lost = halved(low, high, partial(accepted, piece), most - len(found), most)[1]
        if lost is not None:
            u = float_text(Fraction(abs(int(lost.p)), int(lost.q)))  # the drift may be mirrored
            raise AccuracyError(
                f"near |u| = {u} more than {most} panels, or a minute, are needed: A is singular, "
                "complex, large or steep there, or a time short; give a smooth A, nearer ends, "
                "fewer digits, or a larger kappa."
            )
    return found


def panel_of(piece: Piece, lam: Any, middle: fmpq, half: fmpq, digits: int) -> Panel | None:
    """The panel [middle - half, middle + half], or None if it must be halved."""
    scale = lam * half
    # An absolute error of lam V is a relative error of e.
    size = abs(scale * piece.phi(arb(middle, arb(half)))).upper()
    if not size < _STEEP:
        return None
    more = math.ceil(float(size.log()) / _LOG10) if size > 1 else 0
    series, missed = piece.phi.taylor(middle, half, digits + more)
    slope, blur = list(series * scale) or [arb(0)], abs(missed * scale)
    a, b = (
        ONE if w is None else TaylorModel(*w.taylor(middle, half, digits))
        for w in (piece.scale, piece.speed)
    )
    varied = [w for w in (a, b) if w.series.degree() > 0]
    majorant = arb_poly([abs(c) for c in slope])
    terms, cauchy = _moderate(majorant, varied, digits)
    if len(slope) == 1 and abs(slope[0].real) > 1 and not varied:
        terms, cauchy = 1, None
    if not terms and (terms := slow_terms(majorant, digits * _LOG10)):
        terms = max(terms, a.series.length(), b.series.length())
    if not (terms and blur < 1 and all(w is ONE or 4 * w.relative < 1 for w in (a, b))):
        return None
    q = poly(slope).integral()
    rise, bounds = _bounds(slope, q, majorant, cauchy, half, blur)
    if piece.scale or piece.speed:
        of_a, of_b = a.size.log(), b.size.log()
        bounds = bounds[0] + of_a, bounds[1] + of_b, bounds[2] + of_a + of_b
    return Panel(arb(half), slope, q, blur, terms, cauchy, a, b, rise, bounds)


def _moderate(
    majorant: arb_poly, weights: list[TaylorModel], digits: int
) -> tuple[int, tuple[arb, arb] | None]:
    """The number of terms of a moderate panel's power series, and `Panel.cauchy`; else 0, None."""
    grown, reach = majorant.integral(), largest_exponent(digits)
    whole = grown(ENDS[1])
    if not whole < reach:
        return 0, None
    wanted = float(whole) + math.log1p(float(whole)) + digits * _LOG10
    sizes = [arb_poly([abs(c) for c in w.series]) for w in weights]

    def height(rho: arb) -> arb:
        return sum(((w(rho) / w(ENDS[1])).log() for w in sizes), grown(rho))

    terms, *cauchy = fewest_terms(height if weights else grown, wanted)
    # Where A varies fast the number may be astronomic: such a panel is halved.
    if terms + 2 >= 8 * (digits * _LOG10 + 2 * reach):
        return 0, None
    return math.ceil(terms) + 4, (cauchy[0], cauchy[1])


def slow_terms(majorant: arb_poly, nats: float) -> int:
    """The number of terms that give the slow solution to e^-nats; 0 if no number does."""
    mean, wanted, least = majorant[0], nats + 6, 0
    for z, log, share in _WIDTHS:
        # |g| > 0 on the disc of this radius, so that coefficient k is at most of order z^-k.
        if not majorant(z) < 2 * mean:
            break
        if mean * share > wanted:
            least = math.ceil(wanted / log) + 2
    return least


def _bounds(
    slope: list[Any], q: Any, majorant: arb_poly, cauchy: Any, half: fmpq, blur: arb
) -> tuple[arb, tuple[Any, Any, Any]]:
    """`Panel.rise` and `Panel.bounds`."""
    # All exponents are differences of q; `loose` bounds their errors by blur and radii.
    ball = (q(ENDS[1]) - q(ENDS[0])).real
    width, rise = math.log(2 * int(half.p)) - math.log(int(half.q)), ball.mid()
    loose = (2 * blur + ball.rad() + 2 * sum([c.rad() for c in slope], arb(0))).upper()
    least = abs(slope[0].real) - (majorant(ENDS[1]) - majorant[0]) - blur
    if least > 0:
        # |Re g| >= least: e and 1/e decrease from one end at least at this rate, so that their
        # integrals are at most min(2, 1/least) half times the value at that end.
        short = width - math.log(max(min(float(least.lower()), 1e300), 1.0)) + 0.1 + loose
        down, up = (-rise, 0.0) if rise < 0 else (0.0, rise)
        return rise, (short + down, short + up, width + short + up)
    if not cauchy:
        # The ball of g contains 0: more bits decide.
        return rise, (math.inf,) * 3
    # Between points of the grid q differs from its chord by at most max |q''| _CELL^2/8.
    heights = [float(q(t).real) for t in _GRID]
    between = float((majorant.derivative()(ENDS[1]) * _CELL**2 / 8 + loose).upper()) + 0.1
    low, climb = heights[0], 0.0
    for x in heights:
        low = min(low, x)
        climb = max(climb, x - low)
    down, up = heights[0] - low + between, max(heights) - heights[0] + between
    return rise, (width + down, width + up, 2 * (width + between) + climb)


def slow_solver(g: list[Any], blur: arb, n: int) -> Callable[[TaylorModel], TaylorModel]:
    """The operator from f to the slow solution of x' = f + g x, in n coefficients, with g known
    within `blur`."""
    m, minus, zero = len(g), [-c for c in g], arb(0)
    # (k + 1) x_{k+1} - sum g_j x_{k-j} = f_k, x_n = 0: row k is of x_k, x_{k-1}, ...
    rows, factors = [minus], [zero]
    for k in range(n - 1, 0, -1):
        factors.append(k / rows[-1][0])
        shifted = zip(minus, rows[-1][1:], strict=False)
        rows.append([c - factors[-1] * x for c, x in shifted] + minus[-1:])
    rows.reverse()
    factors = factors[:0:-1]  # of row k + 1 in row k
    # Let d be its difference from the exact solution with the same value at the end towards which
    # |e^q| grows. Then |d' - (g + blur) d| <= residual, so that |d| <= residual/min |Re g + blur|.
    least = abs(g[0].real) - sum([abs(c) for c in g[1:]], zero) - blur

    def solution(source: TaylorModel) -> TaylorModel:
        f = list(source.series)
        right = f[:n] + [zero] * (n - len(f))
        for k in range(min(n, len(f)) - 2, -1, -1):
            right[k] -= factors[k] * right[k + 1]
        x: list[Any] = []
        for row, c in zip(rows, right, strict=True):
            x.append((c - sum(map(mul, row[1 : len(x) + 1], x[: -len(row) : -1]), zero)) / row[0])
        # The residual: f's other terms, the powers t^n ... t^{n+m-2} of g x, and blur.
        residual = sum(map(abs, f[n:]), source.missed + blur * sum(map(abs, x), zero))
        for k in range(m - 1):
            residual += abs(sum(map(mul, g[k + 1 :], x[:-m:-1]), zero))
        return TaylorModel(poly(x), residual / least if least > 0 else arb.pos_inf())

    return solution


def within(bound: arb, like: Any) -> Any:
    """A ball about 0 of at least that radius, complex where `like` is."""
    real = arb(0, bound.upper())
    return acb(real, real) if isinstance(like, (acb, acb_poly)) else real
