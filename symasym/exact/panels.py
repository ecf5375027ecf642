"""Parts of the drift's pieces, halved until e = e^{lam V} across each can be expanded with a proof.

With g = lam phi/sigma^2 and e = exp(-int g), a panel is

- *moderate*: int |g| is a few dozen, and power series hold, what they miss being bounded by
  Cauchy's estimate; or
- *slow*: phi has no zero near, and t' = 1 + g t has a slow solution (Chang 1972), a polynomial
  found from its last coefficient down. Its residual over the least |g| bounds its error, that being
  the rate at which two solutions approach each other.

Numbers may be complex balls.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from operator import mul
from typing import Any, NamedTuple

from flint import acb, acb_poly, arb, arb_poly, ctx, fmpq

from symasym.base.errors import AccuracyError
from symasym.base.inputs import float_text
from symasym.drift.evaluate import Piece

_PANELS, _PANELS_A_BIT = 1_500, 12  # at most, the latter for each bit of lam
_WORK = 3e12  # a minute or so: products of coefficients, times bits
_GROWTH = 0.15  # of that with digits: 1,000 digits take the least time with 0.1 to 0.2
_LOG2, _LOG10 = math.log(2.0), math.log(10.0)
ENDS = arb(-1), arb(1)
# Radii for Cauchy's estimate, and of discs on which a slow solution's coefficients are bounded.
_DISCS = [(arb(rho), math.log(rho)) for rho in (2, 3, 4.5, 6.5, 10, 16, 32, 100, 1e3, 1e5)]
_WIDTHS = [(arb(z), math.log(z), (z - 1) ** 2 / (2 * z)) for z in (3, 4, 5.5, 8, 20, 100, 1e3)]
_CELL, _GRID = 1 / 8, [arb(k / 8 - 1) for k in range(17)]


def largest_exponent(digits: int) -> float:
    """The largest exponent on half a moderate panel: the more digits, the fewer panels."""
    return max(60.0, _GROWTH * digits)


# -- panels ----------------------------------------------------------------------------------------


class Panel(NamedTuple):
    """A part of a piece on which t runs from -1 to 1, and what is known of its integrals."""

    half: arb  # of its width
    slope: list[Any]  # g, lam phi times `half`, as a polynomial of t
    q: Any  # the integral of g from 0; e is e^{-q} up to a factor
    blur: arb  # what g misses on [-1, 1], at most
    terms: int  # of its series
    cauchy: tuple[arb, arb] | None  # a radius, a bound of int |g| on rays to it; None: slow
    rise: arb  # of q
    bounds: tuple[Any, Any, Any]  # logarithms of bounds of int e, int 1/e and the nested integral

    @property
    def work(self) -> float:
        """Products of coefficients times bits, about."""
        size = len(self.slope)
        return size * (size + self.terms) * ctx.prec * (1 if self.cauchy else 10)


def panels(
    drift: Sequence[Piece],
    lam: Any,
    begin: fmpq,
    end: fmpq,
    digits: int,
    make: Callable[[Piece, Any, fmpq, fmpq, int], Any] | None = None,
) -> list[Any]:
    """Those from `begin` to `end`: parts of the pieces, halved until `make` takes them.

    By itself it takes what is moderate or slow, as a `Panel`.
    """
    found: list[Any] = []
    most = _PANELS + _PANELS_A_BIT * max(0, math.ceil(float(abs(lam).log()) / _LOG2))
    work = 0.0
    for piece in drift:
        low, high = max(piece.left, begin), min(piece.right, end)
        waiting = [(low, high)] if low < high else []
        while waiting:
            a, b = waiting.pop()
            middle = (a + b) / 2
            if len(found) + len(waiting) > most or work > _WORK:
                u = float_text(Fraction(int(middle.p), int(middle.q)))
                raise AccuracyError(
                    f"A varies too fast near u = {u} for so many digits in {most} panels, or in a "
                    "minute; ask for fewer digits, make A smooth there, or give a larger kappa."
                )
            if panel := (make or panel_of)(piece, lam, a, b, digits):
                found.append(panel)
                work += panel.work
            else:
                waiting += [(middle, b), (a, middle)]
    return found


def panel_of(piece: Piece, lam: Any, a: fmpq, b: fmpq, digits: int) -> Panel | None:
    """[a, b] as a panel, or None where it must be halved."""
    middle, half = (a + b) / 2, (b - a) / 2
    scale = lam * half
    # An absolute error of lam V is a relative one of e.
    size = abs(scale * piece.phi(arb(middle, arb(half)))).upper()
    if not size.is_finite():
        return None
    more = math.ceil(float(size.log()) / _LOG10) if size > 1 else 0
    series, missed = piece.phi.taylor(middle, half, digits + more)
    slope, blur = list(series * scale) or [arb(0)], abs(missed * scale)
    majorant = arb_poly([abs(c) for c in slope])
    terms, cauchy = _moderate(majorant, digits)
    if len(slope) == 1 and abs(slope[0].real) > 1:
        terms, cauchy = 1, None
    terms = terms or slow_terms(majorant, digits * _LOG10)
    if not (terms and blur < 1):
        return None
    q = poly(slope).integral()
    known = _bounds(slope, q, majorant, cauchy, half, blur)
    return Panel(arb(half), slope, q, blur, terms, cauchy, *known)


def _moderate(majorant: arb_poly, digits: int) -> tuple[int, tuple[arb, arb] | None]:
    """Terms of a moderate panel's power series, with `Panel.cauchy`; 0 where it is not moderate."""
    grown, reach = majorant.integral(), largest_exponent(digits)
    whole = grown(ENDS[1])
    if not whole < reach:
        return 0, None
    wanted = float(whole) + math.log1p(float(whole)) + digits * _LOG10
    # Where A varies fast the terms may be astronomic: such a panel is halved.
    best, cauchy = 8 * (digits * _LOG10 + 2 * reach), None
    for rho, log in _DISCS:
        height = grown(rho)
        if (n := (float(height) + wanted) / log + 2) < best:
            best, cauchy = n, (rho, height)
        elif cauchy:
            break
    return (math.ceil(best) + 2, cauchy) if cauchy else (0, None)


def slow_terms(majorant: arb_poly, nats: float) -> int:
    """Terms of the slow solution that make it right to e^-nats; 0 where none does."""
    mean, wanted, least = majorant[0], nats + 6, 0
    for z, log, share in _WIDTHS:
        # On |z| = z the least |g| is above 0, and the terms fall off like z^-k.
        if not majorant(z) < 2 * mean:
            break
        if mean * share > wanted:
            least = math.ceil(wanted / log) + 2
    return least


def _bounds(
    slope: list[Any], q: Any, majorant: arb_poly, cauchy: Any, half: fmpq, blur: arb
) -> tuple[arb, tuple[Any, Any, Any]]:
    """`Panel.rise` and `Panel.bounds`."""
    ball = (q(ENDS[1]) - q(ENDS[0])).real
    width, rise = math.log(2 * int(half.p)) - math.log(int(half.q)), ball.mid()
    # Differences of q from these midpoints: blur over [-1, 1] at most, and radii.
    loose = (2 * blur + ball.rad() + 2 * sum([c.rad() for c in slope], arb(0))).upper()
    least = abs(slope[0].real) - (majorant(ENDS[1]) - majorant[0]) - blur
    if least > 0:
        # |Re g| >= least: integrands fall off from one end at least at that rate, so that their
        # integrals are below min(2, 1/least) half times the value there.
        short = width - math.log(max(min(float(least.lower()), 1e300), 1.0)) + 0.1 + loose
        down, up = (-rise, 0.0) if rise < 0 else (0.0, rise)
        return rise, (short + down, short + up, width + short + up)
    if not cauchy:
        # A ball so wide that it hides the sign: more bits will tell.
        return rise, (math.inf,) * 3
    # Between points of the grid |q''| <= sum k |g_k| keeps q within _CELL^2/8 of that of a chord.
    heights = [float(q(t).real) for t in _GRID]
    between = float((majorant.derivative()(ENDS[1]) * _CELL**2 / 8 + loose).upper()) + 0.1
    low, climb = heights[0], 0.0
    for x in heights:
        low = min(low, x)
        climb = max(climb, x - low)
    down, up = heights[0] - low + between, max(heights) - heights[0] + between
    return rise, (width + down, width + up, 2 * (width + between) + climb)


def slow_solver(
    g: list[Any], blur: arb, n: int
) -> Callable[[list[Any], Any], tuple[list[Any], arb]]:
    """The slow solution of x' = f + g x on a slow panel, g within `blur`: n coefficients, and a
    bound of its error, as a function of f's coefficients and of what these miss."""
    m, minus, zero = len(g), [-c for c in g], arb(0)
    # (k + 1) x_{k+1} - sum g_j x_{k-j} = f_k, x_n = 0: row k is of x_k, x_{k-1}, ...
    rows, factors = [minus], [zero]
    for k in range(n - 1, 0, -1):
        factors.append(k / rows[-1][0])
        shifted = zip(minus, rows[-1][1:], strict=False)
        rows.append([c - factors[-1] * x for c, x in shifted] + minus[-1:])
    rows.reverse()
    factors = factors[:0:-1]  # of row k + 1 in row k
    # A solution that it equals at the end towards which |e^q| grows is d away from it, where
    # |d' - (g + blur) d| <= residual: so |d| <= residual/least |Re (g + blur)|.
    least = abs(g[0].real) - sum([abs(c) for c in g[1:]], zero) - blur

    def solution(f: list[Any], missed: Any) -> tuple[list[Any], arb]:
        right = f[:n] + [zero] * (n - len(f))
        for k in range(min(n, len(f)) - 2, -1, -1):
            right[k] -= factors[k] * right[k + 1]
        x: list[Any] = []
        for row, c in zip(rows, right, strict=True):
            x.append((c - sum(map(mul, row[1 : len(x) + 1], x[: -len(row) : -1]), zero)) / row[0])
        # It solves the equation but for f's other terms, t^n ... t^{n+m-2} of g x, and blur.
        residual = sum(map(abs, f[n:]), missed + blur * sum(map(abs, x), zero))
        for k in range(m - 1):
            residual += abs(sum(map(mul, g[k + 1 :], x[:-m:-1]), zero))
        return x, residual / least if least > 0 else arb.pos_inf()

    return solution


def poly(terms: list[Any]) -> Any:
    """The polynomial with these coefficients."""
    return (acb_poly if isinstance(terms[-1], acb) else arb_poly)(terms)


def within(bound: arb, like: Any) -> Any:
    """A ball about 0 of at least that radius, for a polynomial's values."""
    real = arb(0, bound.upper())
    return acb(real, real) if isinstance(like, acb_poly) else real
