"""The matrix of (y, F) across a panel as power series in s, for any noise: moments and transforms.

With g = lam phi/sigma^2, e = exp(-int g), a = sigma^(-2 alpha) and b = sigma^(2 alpha - 2), where
sigma(u) is the noise, the equation L y = s y of the generator L is the system (Feller 1952)

    y' = a e F,    F' = s lam (b/e) y.

Its matrix across a panel has determinant 1, and its entries have positive coefficients in s.

- Moderate panel: a power series in t about the middle, with the unknowns y and w = a e F, so that
  only one factor e^(int |g|) is lost by cancellation. Multiplied by sigma^2, y' = h w and

    sigma^2 w' = -(h lam phi + 2 alpha sigma sigma') w + s h lam y

  have few coefficients where phi and sigma are polynomials; h is half the width.
- Slow panel: t = y/z and v = z/y have slowly varying solutions, found order by order in s from

    t' = a + g t - s lam b t^2,    v' = s lam b - g v - a v^2.

Each entry f is a constant, or s, times prod(1 + s/z_k) with z_k > 0, a Sturm-Liouville problem's
characteristic function. By Newton's inequality, f_k^2 >= (k+1)/k f_(k-1) f_(k+1), the quotients
f_(k+1)/f_k decrease: the last two coefficients bound the truncated terms (`spectral.truncated`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from operator import mul
from typing import Any, NamedTuple

from flint import arb, arb_poly, arb_series, ctx, fmpq

from symasym.drift.evaluate import Piece
from symasym.exact.panels import (
    ENDS,
    Panel,
    TaylorModel,
    fewest_terms,
    largest_exponent,
    panel_of,
    panels,
    slow_solver,
)

_DISC = arb(2)  # the radius of the least disc for Cauchy's estimate
_SHARE = 0.4  # of the largest int |g| on a moderate panel: shorter panels have shorter series
# The largest sqrt(lam |s|) u and |s| u/phi across a panel, where coefficients in s decrease like
# those of cosh and exp.
_TRAVEL, _DELAY = 4.0, 0.5
_LOG10 = math.log(10.0)
_ONE, _NOTHING = arb_poly([1]), arb_poly([0])
_ZERO = TaylorModel(_NOTHING, arb(0))


class Undecided(ArithmeticError):
    """More powers of s or more bits are needed."""


class Matrix(NamedTuple):
    """((y1, y2), (z1, z2)) of (y, F) across a panel, with e = 1 at its left end and 1/`inverse` at
    its right end."""

    y1: Any
    y2: Any
    z1: Any
    z2: Any
    inverse: Any


def matrices(
    drift: Sequence[Piece], lam: arb, begin: fmpq, end: fmpq, digits: int, order: int, s: float = 0
) -> list[Matrix]:
    """The panels' matrices from `begin` to `end`, to s^order, on panels for numbers up to |s|."""
    found = panels(drift, lam, begin, end, digits, partial(_short_panel, s))
    return [
        _moderate_matrix(p, digits, order, s) if p.cauchy else _slow_matrix(p, lam, digits, order)
        for p in found
    ]


def swept(
    found: Sequence[Matrix],
    reflecting: bool,
    length: int,
    of: Any = arb_poly,
    enclosed: bool = True,
) -> tuple[Any, Any]:
    """eta = y/e and zeta = F after these panels, `length` coefficients of polynomials in s.

    Complex balls grow by rotation on many panels: unless `enclosed`, midpoints are kept.
    """
    eta, zeta = (of([x]) for x in ((1, 0) if reflecting else (0, 1)))
    for p in found:
        eta, zeta = (p.y1 * eta + p.y2 * zeta) * p.inverse, p.z1 * eta + p.z2 * zeta
        eta, zeta = eta.truncate(length), zeta.truncate(length)
        if not enclosed:
            eta, zeta = (of([c.mid() for c in x]) for x in (eta, zeta))
    return eta, zeta


def mirrored(drift: Sequence[Piece]) -> list[Piece]:
    """The pieces of -phi(-u) and sigma(-u)."""
    return [p.mirrored() for p in reversed(drift)]


def ways(
    drift: Sequence[Piece], ends: tuple[fmpq, fmpq], start: fmpq
) -> list[tuple[Sequence[Piece], fmpq, fmpq]]:
    """The drift from the left end to the start, and its mirror image from the right end."""
    return [(drift, ends[0], start), (mirrored(drift), -ends[1], -start)]


def moments(
    found: Sequence[Sequence[Matrix]],
    reflects: Sequence[bool],
    order: int,
    sides: Sequence[int] = (0, 1),
) -> list[arb]:
    """E[tau^k; exit on these sides]/k! at the start, k up to `order`; all terms are positive.

    With d = zeta/eta and q = zeta(end)/eta of each side, sum q = E[e^{-s tau}] sum d. As q is
    completely monotone and d - d(0) is a Bernstein function, their coefficients alternate in sign.
    """
    total, given = [arb(0)] * (order + 1), [arb(0)] * (order + 1)
    for k, (side, reflecting) in enumerate(zip(found, reflects, strict=True)):
        d, q = _quotients(side, reflecting, order)
        total = [x + abs(d[m]) for m, x in enumerate(total)]
        if k in sides:
            given = [x + abs(q[m]) for m, x in enumerate(given)]
    out: list[arb] = []
    for k, x in enumerate(given):
        out.append(sum((total[j] * out[k - j] for j in range(1, k + 1)), x) / total[0])
    return out


def _quotients(
    found: Sequence[Matrix], reflecting: bool, order: int
) -> tuple[arb_series, arb_series]:
    """d and q after these panels; eta and zeta themselves may be as large as 1/P(other side)."""
    ctx.cap = n = order + 1
    d = q = arb_series([0], n)
    for k, p in enumerate(found):
        y1, y2, z1, z2 = (arb_series(list(f), n) for f in p[:4])
        if k == 0:
            eta, zeta = (y1, z1) if reflecting else (y2, z2)
        else:
            eta, zeta = y1 + y2 * d, z1 + z2 * d
        eta *= p.inverse
        d = zeta / eta
        q = (q if k or reflecting else arb_series([1], n)) / eta
    return d, q


# -- panels ----------------------------------------------------------------------------------------


def _short_panel(
    s: float, piece: Piece, lam: arb, middle: fmpq, half: fmpq, digits: int
) -> Panel | None:
    """The panel [middle - half, middle + half], or None if it must be halved."""
    if not (p := panel_of(piece, lam, middle, half, digits)):
        return None
    if p.cauchy:
        system = _system(p, piece, lam, middle, half, digits)
        most = _SHARE * largest_exponent(digits)
        if not (system.room(_DISC) > 0 and system.growth(ENDS[1]) < most and system.wide < 1):
            return None
        p = p._replace(system=system)
    if s:
        # Solutions grow like exp(sqrt(g^2/4 + s lam a b) -+ g/2).
        a, b = (w.series(arb(0, 1)) for w in (p.a, p.b))
        travel = (lam * s * abs(a * b)).sqrt() * p.half
        least = abs(p.slope[0]) - sum(map(abs, p.slope[1:]), arb(0))
        if not (2 * travel < _TRAVEL or 2 * travel**2 < _DELAY * least):
            return None
    return p


def _ball(radius: Any) -> arb:
    return arb(0, arb(radius).upper())


# -- moderate panels -------------------------------------------------------------------------------


class System(NamedTuple):
    """(1 + S) w' = -P w + s c y, y' = h w for y and w = a z, as polynomials in t.

    With 1 + S = sigma^2 over its value in the middle these have few coefficients if phi and sigma
    are polynomials. `wide` bounds the changes of log a, log b and int g by the errors of phi and
    sigma.
    """

    square: list[arb]  # S_1, S_2, ...
    drag: list[arb]  # P
    source: arb  # c
    wide: arb

    def room(self, x: arb) -> arb:
        """A lower bound of |1 + S| for |t| <= x."""
        return 1 - arb_poly([0, *map(abs, self.square)])(x)

    def growth(self, x: arb) -> arb:
        """A bound of the integral of |P/(1 + S)| to |t| = x."""
        return arb_poly([abs(c) for c in self.drag]).integral()(x) / self.room(x)


def _system(p: Panel, piece: Piece, lam: arb, middle: fmpq, half: fmpq, digits: int) -> System:
    """The system of a panel; its phi and sigma are polynomials or have errors in `wide`."""
    scale = lam * p.half
    if not piece.noise:
        return System([], p.slope, scale, 2 * p.blur)
    phi, sigma, alpha = piece.noise
    (f, off), (of_sigma, missed) = (x.taylor(middle, half, digits) for x in (phi, sigma))
    first, *square = of_sigma * of_sigma
    drag = f * scale + of_sigma * of_sigma.derivative() * (2 * alpha)
    system = System([c / first for c in square], [c / first for c in drag], scale / first, arb(0))
    if off > 0 or missed > 0:
        # Let sigma change by the factor 1 + delta: 1/sigma^2 by less than 3 delta, a b/e by less.
        least = first * system.room(ENDS[1])
        delta = missed / least.sqrt()
        size = sum(map(abs, f), off)
        wide = 2 * scale * (2 * off + 3 * delta * size) / least + 3 * delta
        system = system._replace(wide=wide if delta < 0.1 else arb.pos_inf())
    return system


def _moderate_matrix(p: Panel, digits: int, order: int, s: float) -> Matrix:
    """The matrix by power series about the middle, from the solutions with (y, w) = (1, 0), (0, 1)
    there; z = e F = w/a."""
    square, drag, source, wide = p.system
    terms, *rests = _cauchy(p, digits, order, s)
    ends = []
    for y, w, of_y, of_w in ((_ONE, _NOTHING, *rests[:2]), (_NOTHING, _ONE, *rests[2:])):
        ys, ws, slopes = [y], [w], list[arb_poly]()
        for k in range(terms - 1):
            by = (ys[k] * source).left_shift(1).truncate(order + 1)
            slopes.append(by - _convolved(drag, ws) - _convolved(square, slopes))
            ys.append(ws[k] * (p.half / (k + 1)))
            ws.append(slopes[k] * (arb(1) / (k + 1)))
        ends.append((_at_ends(ys, of_y), _at_ends(ws, of_w)))
    (y1, w1), (y2, w2) = ends
    # 1/e at both ends, with e = 1 in the middle, and a over its value there.
    loose = 1 + _ball(p.blur.expm1())
    down, up = (p.q(x).exp() * loose for x in ENDS)
    left, right = (p.a(x) / p.a(arb(0)) for x in ENDS)

    def entry(first: arb_poly, second: arb_poly, scale: arb) -> list[arb]:
        whole = list(((first + second) * scale).truncate(order + 1))
        if not wide > 0:
            return whole
        # Coefficient k has k + 1 factors a, b and e, and those of the change from w to F.
        return [c * (1 + _ball(((k + 4) * wide).expm1())) for k, c in enumerate(whole)]

    middle = p.a(arb(0))
    return _matrix(
        entry(y1[1] * w2[0], -y2[1] * w1[0], down / left),
        entry(y2[1] * y1[0], -y1[1] * y2[0], down * middle),
        entry(w1[1] * w2[0], -w2[1] * w1[0], up / (left * right * middle)),
        entry(w2[1] * y1[0], -w1[1] * y2[0], up / right),
        up / down,
    )


def _matrix(y1: list[arb], y2: list[arb], z1: list[arb], z2: list[arb], inverse: arb) -> Matrix:
    """The matrix with its exact entries at s = 0."""
    one, none = [arb(1)], [arb(0)]
    y, z = (arb_poly(one + y1[1:]), arb_poly(y2)), (arb_poly(none + z1[1:]), arb_poly(one + z2[1:]))
    return Matrix(*y, *z, inverse)


def _convolved(f: list[arb], series: list[arb_poly]) -> arb_poly:
    """The next coefficient of the product of f and the series."""
    return sum(map(mul, series[: -len(f) - 1 : -1], f), _NOTHING)


def _at_ends(series: list[arb_poly], rest: arb_poly) -> tuple[arb_poly, arb_poly]:
    """The values at -1 and 1 of a power series, with a bound of the terms left out."""
    even, odd = sum(series[2::2], series[0] + rest), sum(series[3::2], series[1])
    return even - odd, even + odd


def _cauchy(p: Panel, digits: int, order: int, s: float) -> tuple[Any, ...]:
    """The number of terms, and for every power of s a bound of the sum of the others, for y and w
    from (1, 0) and from (0, 1).

    Replacing coefficients by their absolute values, and 1 + S by 1 - |S|, gives a majorant. On
    |t| = rho its coefficient of s^k is at most e^G A^i B^k/(i + k)! with G = int |P|/(1 - |S|),
    A = h rho, B = c rho/(1 - |S|) and i = k, k - 1, k + 1, k. At numbers s the last coefficients
    need to be right to e^-8 only.
    """
    system: System = p.system
    whole = float(system.growth(ENDS[1]))
    wanted = whole + math.log1p(whole) + digits * _LOG10

    def height(rho: arb) -> arb:
        if not (room := system.room(rho)) > 0:
            return arb.pos_inf()
        powers = (rho**2 * system.room(ENDS[1]) / room).log() * order
        more = powers if not s else (powers - wanted + 8).max(arb(0))
        return system.growth(rho) + 2 * rho.log() + more

    best, rho, _ = fewest_terms(height, wanted)
    count = math.ceil(best) + 4
    first, second = p.half * rho, system.source * rho / system.room(rho)
    parts = [4 * rho**2 * system.growth(rho).exp() / rho**count]
    for k in range(1, order + 1):
        parts.append(parts[-1] * first * second / (2 * k * (2 * k - 1)))
    same, before = ([x * c for x in parts] for c in (1, second))
    rests = same, [arb(0), *before][: order + 1], [x * first for x in parts], same
    return count, *(arb_poly([*map(_ball, x)]) for x in rests)


# -- slow panels -----------------------------------------------------------------------------------


def _slow_matrix(p: Panel, lam: arb, digits: int, order: int) -> Matrix:
    """The matrix of a panel from the slow solutions t = y/z and v = z/y."""
    inverse = (p.q(ENDS[1]) - p.q(ENDS[0]) + _ball(2 * p.blur)).exp()
    a, b = p.a.scaled(p.half), p.b.scaled(lam * p.half)
    of_t, of_v = (slow_solver([sign * c for c in p.slope], p.blur, p.terms) for sign in (1, -1))
    t, v = [of_t(a)], [_ZERO, of_v(b)]
    for k in range(1, order + 1):
        t.append(of_t((b * _squared(t, k - 1)).scaled(-1)))
        v.append(of_v((a * _squared(v, k + 1)).scaled(-1)))
    t_a, t_b = _values(t)
    v_a, v_b = _values(v[: order + 1])
    ctx.cap = n = order + 1
    along = [(b * x).integral() for x in t[:order]]
    other = [(a * x).integral() for x in v[1:n]]
    whole = 1 / (1 - t_a * v_a)
    first, second = (arb_series([0, *c], n).exp() * whole for c in (along, other))
    entries = (
        second - v_a * t_b * first / inverse,
        t_b * first / inverse - t_a * second,
        v_b * second * inverse - v_a * first,
        first - t_a * v_b * second * inverse,
    )
    y1, y2, z1, z2 = map(list, entries)
    return _matrix(y1, y2, z1, z2, inverse)


def _squared(x: list[TaylorModel], k: int) -> TaylorModel:
    """Coefficient k of the square of the power series in s with these coefficients."""
    some = range(max(0, k + 1 - len(x)), min(k + 1, len(x)))
    return sum((x[i] * x[k - i] for i in some), _ZERO)


def _values(x: list[TaylorModel]) -> tuple[arb_series, arb_series]:
    """The values at t = -1 and 1, as power series in s."""
    ctx.cap = n = len(x)
    first, last = (arb_series([c(u) for c in x], n) for u in ENDS)
    return first, last
