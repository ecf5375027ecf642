"""The matrix of (y, F) across a panel as power series in s, for any noise: moments and transforms.

With g = lam phi/sigma^2, e = exp(-int g), a = sigma^(-2 alpha) and b = sigma^(2 alpha - 2), the
equation L y = s y of the generator is the system (Feller 1952)

    y' = a e F,    F' = s lam (b/e) y.

Its matrix across a panel has determinant 1, and entries with positive coefficients of s. With
y and z = e F as unknowns a power series about a moderate panel's middle loses e^(int |g|) but once.
On a slow panel t = y/z and v = z/y have slow solutions, found order by order,

    t' = a + g t - s lam b t^2,    v' = s lam b - g v - a v^2.

Each entry f is a constant, or s, times prod(1 + s/z_k) with z_k > 0: a Sturm-Liouville problem's
characteristic function. So f_k^2 >= (k+1)/k f_(k-1) f_(k+1) (Newton's inequality), and its last two
coefficients bound what was cut off, at any complex s (`at`). Panels are halved until few powers do.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import partial
from operator import mul
from typing import Any, NamedTuple

from flint import acb, acb_poly, arb, arb_poly, arb_series, ctx, fmpq

from symasym.drift.evaluate import Piece
from symasym.exact.panels import ENDS, Panel, panel_of, panels, slow_solver

_REACH = 24.0  # int |g| on a panel of an A that is no polynomial, the shorter whose series are
_SHORT = 8  # coefficients of a polynomial
# sqrt(lam |s|) u and |s| u/phi across a panel, at most: terms fall like those of cosh and exp.
_TRAVEL, _DELAY = 4.0, 0.5
_LOG10 = math.log(10.0)
_ONE, _NOTHING = arb_poly([1]), arb_poly([0])
_DISCS = (2.0, 3.0, 4.5, 6.5, 10.0, 16.0, 32.0, 100.0, 1e3, 1e5)


class Undecided(ArithmeticError):
    """More powers of s, or more bits, are needed."""


class Local(NamedTuple):
    """A function as a polynomial of t on [-1, 1], within `missed`."""

    series: arb_poly
    missed: arb


class Weighted(NamedTuple):
    """A panel with its weights a and b."""

    of: Panel
    a: Local
    b: Local

    @property
    def work(self) -> float:
        """As of a panel."""
        return 4 * self.of.work


class Matrix(NamedTuple):
    """((y1, y2), (z1, z2)) of (y, F) across a panel, e being 1 where it begins and 1/inverse where
    it ends."""

    y1: Any
    y2: Any
    z1: Any
    z2: Any
    inverse: Any


class Swept(NamedTuple):
    """eta = y/e and zeta = F, power series in s, and the speed measure's mass with e = 1 here."""

    eta: Any
    zeta: Any
    mass: Any


STARTS = {False: Swept(_NOTHING, _ONE, arb(0)), True: Swept(_ONE, _NOTHING, arb(0))}


def matrices(
    drift: Sequence[Piece], lam: arb, begin: fmpq, end: fmpq, digits: int, order: int, s: float = 0
) -> list[Matrix]:
    """Those of the panels from `begin` to `end`, to s^order; panels for numbers up to |s|."""
    found = panels(drift, lam, begin, end, digits, partial(_weighted, s))
    return [(_resolved if p.of.cauchy else _slow)(p, lam, digits, order) for p in found]


def carried(state: Swept, p: Matrix, order: int) -> Swept:
    """The state after a panel, as power series in s."""
    eta, zeta = state.eta, state.zeta
    return Swept(
        ((p.y1 * eta + p.y2 * zeta) * p.inverse).truncate(max(order, 1)),
        (p.z1 * eta + p.z2 * zeta).truncate(order + 1),
        (state.mass + p.z1[1]) * p.inverse**-1,
    )


def ways(
    drift: Sequence[Piece], ends: tuple[fmpq, fmpq], start: fmpq
) -> list[tuple[Sequence[Piece], fmpq, fmpq]]:
    """The drift from the left end to the start, and its mirror image from the right one."""
    return [(drift, ends[0], start), ([p.mirrored() for p in reversed(drift)], -ends[1], -start)]


def moments(
    found: Sequence[Sequence[Matrix]],
    reflects: Sequence[bool],
    order: int,
    sides: Sequence[int] = (0, 1),
) -> list[arb]:
    """E[tau^k; these sides]/k! at the start, k up to `order`, all terms positive.

    With r = zeta/eta and q = zeta(0 of its end)/eta of both sides, sum q = E[e^{-s tau}] sum r. As
    q is completely monotone and r - r(0) a Bernstein function, the signs of their powers alternate.
    """
    total, given = [arb(0)] * (order + 1), [arb(0)] * (order + 1)
    for k, (side, reflecting) in enumerate(zip(found, reflects, strict=True)):
        r, q = _inwards(side, reflecting, order)
        total = [x + abs(r[m]) for m, x in enumerate(total)]
        if k in sides:
            given = [x + abs(q[m]) for m, x in enumerate(given)]
    out: list[arb] = []
    for k, x in enumerate(given):
        out.append(sum((total[j] * out[k - j] for j in range(1, k + 1)), x) / total[0])
    return out


def _inwards(
    found: Sequence[Matrix], reflecting: bool, order: int
) -> tuple[arb_series, arb_series]:
    """r and q after these panels: eta and zeta themselves may be as large as the other way out."""
    ctx.cap = n = order + 1
    r = q = arb_series([0], n)
    for k, p in enumerate(found):
        y1, y2, z1, z2 = (arb_series(list(f), n) for f in p[:4])
        if k == 0:
            below, above = (y1, z1) if reflecting else (y2, z2)
        else:
            below, above = y1 + y2 * r, z1 + z2 * r
        below *= p.inverse
        r = above / below
        q = (q if k or reflecting else arb_series([1], n)) / below
    return r, q


def swept_at(
    found: Sequence[Matrix],
    s: Any,
    reflecting: bool,
    digits: int,
    length: int = 1,
    enclosed: bool = True,
) -> tuple[Any, Any]:
    """eta and zeta at a number s, with a derivative where `length` is 2, as polynomials.

    Complex balls turn and grow on many panels: where rounding is not to be `enclosed`, midpoints.
    """
    of = acb_poly if isinstance(s, acb) else arb_poly
    eta, zeta = (of([x]) for x in ((1, 0) if reflecting else (0, 1)))
    for p in found:
        y1, y2, z1, z2 = (
            of([at(g, s, digits) for g in (f, f.derivative())[:length]]) for f in p[:4]
        )
        eta, zeta = (y1 * eta + y2 * zeta) * p.inverse, z1 * eta + z2 * zeta
        eta, zeta = eta.truncate(length), zeta.truncate(length)
        if not enclosed:
            eta, zeta = (of([c.mid() for c in x]) for x in (eta, zeta))
    return eta, zeta


def at(f: arb_poly, s: Any, digits: int) -> Any:
    """f(s) from the first coefficients of a constant, or s, times prod(1 + s/z_k)."""
    k = f.degree()
    while k > 1 and f[k].rel_accuracy_bits() < 8:
        k -= 1  # a coefficient that is hardly known bounds nothing
    if k < 1 or s == 0:
        return f(s)
    f, size = f.truncate(k + 1), abs(s)
    ratio = abs(f[k] / f[k - 1]) * size
    rest = f[k] * size**k * ratio / (1 - ratio)
    if not (ratio < 0.5 and rest < f(size) / arb(10) ** digits):
        raise Undecided(f"{k} powers of s do not reach {s}")
    rest = arb(0, rest.upper())
    return f(s) + (acb(rest, rest) if isinstance(s, acb) else rest)


# -- panels ----------------------------------------------------------------------------------------


def _weighted(
    s: float, piece: Piece, lam: arb, begin: fmpq, end: fmpq, digits: int
) -> Weighted | None:
    """[begin, end] as a panel, or None where it must be halved."""
    if not (p := panel_of(piece, lam, begin, end, digits)):
        return None
    middle, half = (begin + end) / 2, (end - begin) / 2
    if p.cauchy and len(p.slope) > _SHORT and not abs_integral(p.slope) < _REACH:
        return None
    local = [
        Local(_ONE, arb(0)) if w is None else Local(*w.taylor(middle, half, digits))
        for w in (piece.scale, piece.speed)
    ]
    if not all(4 * _relative(w) < 1 for w in local):
        return None
    if s:
        # y grows like e^{d u}, d = sqrt(g^2/4 + s lam a b) - |g|/2, beside 1 and e.
        a, b = (w.series(arb(0, 1)) for w in local)
        travel = (lam * s * abs(a * b)).sqrt() * p.half
        least = abs(p.slope[0]) - sum(map(abs, p.slope[1:]), arb(0))
        if not (2 * travel < _TRAVEL or 2 * travel**2 < _DELAY * least):
            return None
    return Weighted(p, *local)


def abs_integral(slope: Sequence[arb]) -> arb:
    """int |g| from 0 to 1, at most."""
    return sum((abs(c) / (k + 1) for k, c in enumerate(slope)), arb(0))


def _relative(w: Local) -> arb:
    """What the polynomial misses, over the least value of the weight."""
    return w.missed / abs(w.series(_ball(1))) if w.missed > 0 else arb(0)


def _ball(radius: Any) -> arb:
    return arb(0, arb(radius).upper())


# -- moderate panels -------------------------------------------------------------------------------


def _resolved(p: Weighted, lam: arb, digits: int, order: int) -> Matrix:
    """From the power series about the middle: y' = h a z, z' = -g z + s lam h b y, z = e F."""
    g, h = p.of.slope, p.of.half
    a, b = list(p.a.series * h), list(p.b.series * (lam * h))
    terms, *rests = _cauchy(p, lam, digits, order)
    ends = []
    for y, z, of_y, of_z in ((_ONE, _NOTHING, *rests[:2]), (_NOTHING, _ONE, *rests[2:])):
        ys, zs = [y], [z]
        for k in range(terms - 1):
            by = _convolved(b, ys).left_shift(1).truncate(order + 1)
            dy, dz = _convolved(a, zs), by - _convolved(g, zs)
            ys.append(dy * (arb(1) / (k + 1)))
            zs.append(dz * (arb(1) / (k + 1)))
        ends.append((_at_ends(ys, of_y), _at_ends(zs, of_z)))
    (y1, z1), (y2, z2) = ends
    up, down = p.of.q(ENDS[1]).exp(), p.of.q(ENDS[0]).exp()  # 1/e at both ends
    wide = 2 * p.of.blur + _relative(p.a) + _relative(p.b)

    def entry(first: arb_poly, second: arb_poly, scale: arb) -> list[arb]:
        whole = list(((first + second) * scale).truncate(order + 1))
        if not wide > 0:
            return whole
        return [c * (1 + _ball(((k + 2) * wide).expm1())) for k, c in enumerate(whole)]

    return _matrix(
        entry(y1[1] * z2[0], -y2[1] * z1[0], down),
        entry(y2[1] * y1[0], -y1[1] * y2[0], down),
        entry(z1[1] * z2[0], -z2[1] * z1[0], up),
        entry(z2[1] * y1[0], -z1[1] * y2[0], up),
        up / down * (1 + _ball((2 * p.of.blur).expm1())),
    )


def _matrix(y1: list[arb], y2: list[arb], z1: list[arb], z2: list[arb], inverse: arb) -> Matrix:
    """With what is known of s^0."""
    one, none = [arb(1)], [arb(0)]
    y, z = (arb_poly(one + y1[1:]), arb_poly(y2)), (arb_poly(none + z1[1:]), arb_poly(one + z2[1:]))
    return Matrix(*y, *z, inverse)


def _convolved(f: list[arb], series: list[arb_poly]) -> arb_poly:
    """The next coefficient of f times the series."""
    return sum(map(mul, series[: -len(f) - 1 : -1], f), _NOTHING)


def _at_ends(series: list[arb_poly], rest: arb_poly) -> tuple[arb_poly, arb_poly]:
    """The values at -1 and 1."""
    even, odd = sum(series[2::2], series[0] + rest), sum(series[3::2], series[1])
    return even - odd, even + odd


def _cauchy(p: Weighted, lam: arb, digits: int, order: int) -> tuple[Any, ...]:
    """The number of terms, and a bound on the sum of the others for every power of s, for y and z
    from (1, 0) and from (0, 1).

    Coefficients in absolute value make a majorant. In it G = int |g| grows, so that at rho the part
    of s^k is at most e^G A^i B^k/(i + k)!: i = k, k - 1, k + 1, k, where A = rho |a|, B = rho |b|.
    The disc is chosen by them beside those at 1; of that rho^(2k) is in the number of terms.
    """
    g = [float(abs(c).upper()) for c in p.of.slope]
    whole = sum(c / (k + 1) for k, c in enumerate(g))
    wanted = -whole - math.log(1 + whole) - digits * _LOG10
    weights = [(arb_poly([abs(c) for c in w.series]), p.of.half) for w in (p.a, p.b)]
    best, height, rho = math.inf, 0.0, 0.0
    for disc in _DISCS:
        size, power = 2 * math.log(disc), 1.0
        for k, c in enumerate(g, 1):
            power *= disc  # may be infinite
            size += c * power / k if c else 0.0
        grown = math.prod(w(arb(disc)) / w(ENDS[1]) for w, _ in weights)
        all_powers = size + order * float(arb(grown).log())
        if (terms := (all_powers - wanted) / math.log(disc)) < best:
            best, height, rho = terms, size, disc
    count = math.ceil(best) + 2 * order + 4
    first, second = (w(arb(rho)) * rho * half for w, half in weights)
    second *= lam
    parts = [4 * arb(height).exp() / arb(rho) ** count]
    for k in range(1, order + 1):
        parts.append(parts[-1] * first * second / (2 * k * (2 * k - 1)))
    same, before = ([x * c for x in parts] for c in (1, second))
    rests = same, [arb(0), *before][: order + 1], [x * first for x in parts], same
    return count, *(arb_poly([*map(_ball, x)]) for x in rests)


# -- slow panels -----------------------------------------------------------------------------------


def _slow(p: Weighted, lam: arb, digits: int, order: int) -> Matrix:
    """From the slow solutions t = y/z and v = z/y."""
    h, q = p.of.half, p.of.q
    terms = max(p.of.terms, len(list(p.a.series)), len(list(p.b.series)))
    inverse = (q(ENDS[1]) - q(ENDS[0]) + _ball(2 * p.of.blur)).exp()
    a, b = (Local(w.series * c, w.missed * c) for w, c in ((p.a, h), (p.b, lam * h)))
    of_t, of_v = _solver(p.of, 1, terms), _solver(p.of, -1, terms)
    t, v = [of_t(a)], [Local(_NOTHING, arb(0)), of_v(b)]
    for k in range(1, order + 1):
        t.append(of_t(_product(b, _squared(t, k - 1), -1, terms)))
        v.append(of_v(_product(a, _squared(v, k + 1), -1, terms)))
    t_a, t_b = _values(t)
    v_a, v_b = _values(v[: order + 1])
    ctx.cap = n = order + 1
    along = [_integral(_product(b, x, 1, terms)) for x in t[:order]]
    other = [_integral(_product(a, x, 1, terms)) for x in v[1:n]]
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


def _solver(p: Panel, sign: int, n: int) -> Callable[[Local], Local]:
    """The slow solution of x' = f + sign g x as a function of f."""
    of = slow_solver([sign * c for c in p.slope], p.blur, n)

    def solution(source: Local) -> Local:
        x, error = of(list(source.series), source.missed)
        return Local(arb_poly(x), error)

    return solution


def _product(x: Local, y: Local, sign: int, terms: int) -> Local:
    """Their product to so many terms."""
    whole = x.series * y.series
    missed = _sum(x.series) * y.missed + _sum(y.series) * x.missed + x.missed * y.missed
    missed += _sum(list(whole)[terms:])
    return Local(whole.truncate(terms) * sign, missed)


def _sum(series: Any) -> arb:
    return sum(map(abs, series), arb(0))


def _squared(x: list[Local], k: int) -> Local:
    """Coefficient k of the square of a power series in s."""
    total, missed = _NOTHING, arb(0)
    for i in range(max(0, k + 1 - len(x)), min(k + 1, len(x))):
        total += x[i].series * x[k - i].series
        missed += 2 * _sum(x[i].series) * x[k - i].missed + x[i].missed * x[k - i].missed
    return Local(total, missed)


def _values(x: list[Local]) -> tuple[arb_series, arb_series]:
    """At both ends, as power series in s."""
    ctx.cap = n = len(x)
    first, last = (arb_series([c.series(u) + _ball(c.missed) for c in x], n) for u in ENDS)
    return first, last


def _integral(x: Local) -> arb:
    """Over [-1, 1]."""
    even = [c / (k + 1) for k, c in enumerate(x.series) if k % 2 == 0]
    return 2 * (sum(even, arb(0)) + _ball(x.missed))
