"""Proved bounds of |I - sum| for all large lam: Watson's lemma's remainder, and the complement.

With I = int g e^{lam f} and e^{lam f(p)} taken out, beside a maximum p the integral is

    int_0^{u_0} e^{-lam u^mu} u^{beta - 1} sum_k F_k u^k du,    |F_k| <= M rho^{-k}

(`cauchy_disk`). The truncation error of the first n terms is: the next few terms, which are known;
the tail of a geometric series (Cauchy's estimate), M rho^{-m} Gamma((m + beta)/mu)
lam^{-(m + beta)/mu} over mu (1 - THETA); and what each term has beyond u_0, an incomplete gamma
function Gamma(s, lam u_0^mu) (DLMF 8.10.1). Away from the maxima the integrand is exponentially
small: on a box where f <= f(p) - drop and int |g| <= weight, it is at most weight e^{-lam drop}.
From X to infinity, with (log |g|)' + lam f' <= gamma - c lam there, it is at most
|g(X)| e^{-lam drop}/(c lam - gamma), drop = f(p) - f(X); with x times the derivative in place of
it, X times that (algebraic decay). For Watson's lemma and its error see F. W. J. Olver, Asymptotics
and Special Functions, chapter 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import sympy
from flint import arb

from symasym.asymptotics.laplace.cauchy_disk import THETA, Disk, disk, without_power
from symasym.asymptotics.laplace.expansion import Contribution
from symasym.asymptotics.laplace.kinks import Piece, difference, number
from symasym.asymptotics.laplace.maxima import agree
from symasym.base.call_context import own_context, step
from symasym.base.inputs import exact
from symasym.numbers.balls import NotProved, exact_ball, precision
from symasym.numbers.extended_intervals import enclosure

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real

# Terms behind the last one used that are bounded one by one, the others by Cauchy's estimate.
_EXPLICIT = 4
_SAFETY = 1e-9
_LESS = 1 - 1e-9
_MOST_BOXES = 3000
_DEEPEST = 40
# What a few roundings can do.
_MORE = 1 + 1e-12

#: weight, drop, c, gamma: the integral is at most weight e^(-lam drop) / (c lam - gamma),
#: where a box has c = 0 and gamma = -1.
Part = tuple[float, float, float, float]


@dataclass
class Proof:
    """Everything that bounds the error, over e^(lam height), at any lam.

    Attributes
    ----------
    disks : list of Disk
        Beside each maximum, in the order of `contributions`.
    contributions : list of Contribution
    others : list of Contribution
        Smaller maxima that were kept: their whole share counts as error.
    gaps : list of mpf
        How far those are below.
    parts : list of Part
        The complement: the interval without what is beside the maxima.
    """

    disks: list[Disk]
    contributions: list[Contribution]
    others: list[Contribution]
    gaps: list[mpf]
    parts: list[Part]

    def relative(
        self, lam: Fraction, orders: list[int], weights: list[mpf], top: mpf, context: MPContext
    ) -> mpf:
        """The bound over e^(lam top), the first orders[i] terms used of the i-th contribution.

        Parameters
        ----------
        lam : Fraction
        orders : list of int
            Of all contributions, the smaller maxima last.
        weights : list of mpf
            What the sum has of each contribution, over e^(lam top): heights are numbers there, and
            the balls of f at the maxima tell how wrong these are.
        top : mpf
            The height that is taken out.
        context : MPContext
            Of the numbers.
        """
        bits = int(lam * (1 + abs(_exactly(top)))).bit_length()
        with precision(bits + max(_bits(len(d.coefficients)) for d in self.disks)):
            number, height = exact_ball(lam), exact_ball(_exactly(top))
            wrong = arb(0)
            for d, c, part in zip(self.disks, self.contributions, weights, strict=False):
                own = exact_ball(_exactly(c.height_in(context)))
                off = (number * abs(d.top - own)).expm1()
                wrong += exact_ball(_exactly(abs(part))) * off
            ratios = [(number * (d.top - height)).exp() for d in self.disks]
            algebraic, small = self._two(number, orders, ratios)
            return _above(algebraic + small + wrong, context)

    def statement(self, order: int, sigma: Expr) -> tuple[mpf, Expr, mpf]:
        """(K, sigma, lam0): every summand times lam^sigma falls for lam >= lam0."""
        bits = max(_bits(len(d.coefficients)) for d in self.disks)
        with own_context(20) as context, precision(bits):
            power = Fraction(int(sigma.p), int(sigma.q))
            orders = [order] * len(self.contributions)
            ratios = [arb(1)] * len(self.disks)
            start = self._falls_from(power)
            for _ in range(200):
                algebraic, small = self._two(exact_ball(start), orders, ratios)
                if small <= algebraic / 100 or algebraic.is_zero():
                    break
                start *= Fraction(5, 4)
            constant = (algebraic + small) * exact_ball(start) ** exact_ball(power)
            return _above(constant, context), sigma, _above(exact_ball(start), context)

    def _falls_from(self, power: Fraction) -> Fraction:
        """A lam from which lam^power times each exponentially small term decreases."""
        start = Fraction(1)
        for d in self.disks:
            largest = (len(d.coefficients) + d.beta) / d.contact
            for _, _, drop in d.sides:
                start = max(start, (power + largest + 2) / Fraction(drop))
        for _, drop, steep, growth in self.parts:
            start = max(start, power / Fraction(drop))
            if steep:
                start = max(start, 2 * Fraction(growth) / Fraction(steep))
        for gap in self.gaps:
            start = max(start, power / _exactly(gap))
        # A number with few digits.
        return Fraction(math.ceil(start * 2**20), 2**20)

    def _two(self, lam: arb, orders: list[int], ratios: list[arb]) -> tuple[arb, arb]:
        """The bounds of what is of a power of lam, and of what is exponentially small."""
        algebraic = small = arb(0)
        for d, c, used, ratio in zip(self.disks, self.contributions, orders, ratios, strict=False):
            powers, beyond = _beside(d, c, used, lam)
            algebraic += powers * ratio
            small += beyond * ratio
        # Of the sum itself, in which rounding is counted apart.
        for c, gap in zip(self.others, self.gaps, strict=True):
            for s, k in zip(*c.numbers(20), strict=True):
                term = abs(exact_ball(_exactly(k))) * lam ** -exact_ball(_exactly(s))
                small += term * (-lam * exact_ball(_exactly(gap))).exp() * (1 + _SAFETY)
        for weight, drop, steep, growth in self.parts:
            divisor = lam * steep - growth
            if not divisor > 0:
                infinite = arb("inf")
                return infinite, infinite
            small += weight * (-lam * drop).exp() / divisor
        return algebraic.upper(), small.upper()


def _bits(count: int) -> int:
    """Arb's precision for a disk of so many coefficients."""
    return 128 + 12 * count


_exactly = partial(exact, "a number")


def _beside(d: Disk, c: Contribution, used: int, lam: arb) -> tuple[arb, arb]:
    """Bounds of the truncation error beside one maximum: powers of lam, and exponentially small.

    The first is the next terms one by one, then Cauchy's tail; the second the terms' integrals
    beyond the transformed part, although they are integrated to infinity. The tail may begin behind
    any term that is not used; where the series diverges, the last one known is not the best.
    """
    both = len(d.sides) == 2
    _, coefficients = c.numbers(40)
    # On two sides every second coefficient cancels.
    shift = int(d.beta - 1) % 2 if both else 0
    position, total, small = 0, arb(0), arb(0)
    best, least = (arb("inf"), arb("inf")), math.inf
    for k, ball in enumerate(d.coefficients):
        s = exact_ball((k + d.beta) / d.contact)
        power = lam**-s
        size = d.peak * arb(d.rho) ** -k / d.contact * power
        small += size * sum((_upper_gamma(s, lam * drop) for _, _, drop in d.sides), arb(0))
        if not (both and (k + shift) % 2):
            value = 2 * ball if both else ball
            if position < used:
                value = value - exact_ball(exact("c", coefficients[position]))
            total += abs(value) * power
            position += 1
        if position >= used:
            powers = total + _cauchy_tail(d, k + 1, lam)
            if float(powers + small) < least:
                best, least = (powers, small), float(powers + small)
    return best


def _cauchy_tail(d: Disk, count: int, lam: arb) -> Any:
    """The bound of the terms from n = `count` on, on all sides, as far as u = THETA rho.

    It is M rho^-n Gamma(s) lam^-s/(mu (1 - THETA)), s = (n + beta)/mu (Cauchy's estimate).
    """
    s = exact_ball((count + d.beta) / d.contact)
    size = d.peak * arb(d.rho) ** -count / (1 - arb(THETA)) / d.contact
    return len(d.sides) * size * s.gamma() * lam**-s


def _upper_gamma(s: arb, z: arb) -> Any:
    """A bound of Gamma(s, z): DLMF 8.10.1 for s <= 1, integration by parts beyond, and Gamma(s)."""
    whole = s.gamma()
    if not z > 0:
        return whole
    if s <= 1:
        return whole.min(z ** (s - 1) * (-z).exp())
    if not z > s - 1:
        return whole
    return whole.min(z**s * (-z).exp() / (z - s + 1))


def _above(value: arb, context: MPContext) -> mpf:
    """The upper end of a ball, exactly."""
    from mpmath import libmp

    end = value.upper()
    if not end.is_finite():
        return context.inf
    mantissa, exponent = end.man_exp()
    return context.make_mpf(libmp.from_man_exp(int(mantissa), int(exponent)))


def prove(
    pieces: tuple[Piece, ...],
    x: Symbol,
    contributions: tuple[Contribution, ...],
    origins: tuple[tuple[Piece, Real, str], ...],
) -> Proof | None:
    """A `Proof`, or None where a step does not go through."""
    if len(set(origins)) != len(origins):
        return None
    top = max(number(c.height) for c in contributions)
    kept = [agree(number(c.height), top) for c in contributions]
    orders = max(len(c.coefficients) for c in contributions) + _EXPLICIT
    main = [c for c, k in zip(contributions, kept, strict=True) if k]
    others = [c for c, k in zip(contributions, kept, strict=True) if not k]
    try:
        disks = []
        for (piece, point, side), c, use in zip(origins, contributions, kept, strict=True):
            if not use:
                continue
            count = orders * (2 if side == "both" else 1) + 1
            with precision(_bits(count)):
                disks.append(disk(piece, x, point, side, c.contact, c.beta, count))
        taken = [o for o, use in zip(origins, kept, strict=True) if use]
        parts = _complement(pieces, x, taken, disks)
    except (NotProved, OverflowError, ZeroDivisionError):
        return None
    gaps = [difference(top, number(c.height)) for c in others]
    return Proof(disks, main, others, gaps, parts)


def _complement(
    pieces: tuple[Piece, ...],
    x: Symbol,
    origins: list[tuple[Piece, Real, str]],
    disks: list[Disk],
) -> list[Part]:
    """The interval without the transformed neighbourhoods."""
    gap = min(drop for d in disks for _, _, drop in d.sides)
    ceiling = math.nextafter(min(float(d.top.lower()) for d in disks), -math.inf)
    parts: list[Part] = []
    for piece in pieces:
        low, high = _float(piece.lo, -1), _float(piece.hi, 1)
        edges = [(low, high)]
        for (home, point, _), d in zip(origins, disks, strict=True):
            if home is not piece:
                continue
            # A little less than what was transformed, so that nothing is left out between.
            start, stop = _float(point, 1), _float(point, -1)
            for sign, reach, _ in d.sides:
                if sign > 0:
                    stop = high if reach is None else stop + float(reach) * _LESS
                else:
                    start = low if reach is None else start - float(reach) * _LESS
            edges = [part for a, b in edges for part in ((a, min(b, start)), (max(a, stop), b))]
        for a, b in edges:
            if a < b:
                parts += boxes(piece, x, a, b, ceiling, gap)
    return parts


def _float(point: Real, direction: int) -> float:
    """The point if it is a float, else a float beyond it in `direction`."""
    exactly = number(point)
    near = float(exactly)
    return near if exactly == near else math.nextafter(near, direction * math.inf)


# -- away from the maxima --------------------------------------------------------------------------


def boxes(piece: Piece, x: Symbol, lo: float, hi: float, top: float, gap: float) -> list[Part]:
    """Parts for [lo, hi], possibly infinite, where f should stay `gap` below `top`.

    `top` is a float not above f's maximum.
    """
    parts: list[Part] = []
    if math.isinf(hi):
        hi, part = _tail(piece.f, piece.g, x, lo, top)
        parts.append(part)
    if math.isinf(lo):
        mirror = {x: -x}
        start, part = _tail(piece.f.xreplace(mirror), piece.g.xreplace(mirror), x, -hi, top)
        parts.append(part)
        lo = -start
    waiting = [(lo, hi, 0)]
    while waiting:
        step()
        a, b, depth = waiting.pop()
        if not a < b:
            continue
        heights = enclosure(piece.f, x, a, b)
        # Far enough below, or as flat as it is low (a smaller maximum).
        if heights is not None and top - heights[1] > min(
            0.95 * gap, 3 * (heights[1] - heights[0])
        ):
            weight = _weight(piece, x, a, b)
            if weight is not None:
                parts.append((weight, _drop(top, heights[1]), 0.0, -1.0))
                continue
        if depth == _DEEPEST or len(parts) + len(waiting) > _MOST_BOXES:
            raise NotProved
        middle = (a + b) / 2
        waiting += [(a, middle, depth + 1), (middle, b, depth + 1)]
    return parts


def _drop(top: float, height: float) -> float:
    """top - height, rounded down; what is beyond 1e100 is nobody's concern."""
    return math.nextafter(min(top - height, 1e100), 0.0)


def _weight(piece: Piece, x: Symbol, a: float, b: float) -> float | None:
    """A bound of the integral of |g| over [a, b]."""
    width = math.nextafter(b - a, math.inf)
    size = _largest(piece.g, x, a, b)
    if size is not None:
        return size * width * _MORE
    for end, edge, sign in ((piece.lo, a, 1), (piece.hi, b, -1)):
        if end.is_infinite or abs(float(number(end)) - edge) > 1e-12 * max(1, abs(edge)):
            continue
        rest, front = without_power(piece.g, x, end, sign)
        size = _largest(rest, x, a, b)
        if size is not None and -1 < front < 0:
            power = float(front) + 1
            return float(size * (width * _MORE) ** power / power * _MORE)
    return None


def _largest(expression: Expr, x: Symbol, a: float, b: float) -> float | None:
    """A bound of the absolute value on [a, b]."""
    sizes = enclosure(expression, x, a, b)
    if sizes is None or math.isinf(sizes[0]) or math.isinf(sizes[1]):
        return None
    return max(abs(sizes[0]), abs(sizes[1]))


def _tail(f: Expr, g: Expr, x: Symbol, start: float, top: float) -> tuple[float, Part]:
    """(X, its part): the point where the interval to infinity is cut off, and the bound beyond.

    From there on either (log |g|)' + lam f' <= gamma - c lam, or the same times x: exponential
    or algebraic decay.
    """
    slope, growth = sympy.diff(f, x), None
    if g.has(x):
        growth = sympy.simplify(sympy.diff(g, x) / g)
    begin = max(start, 0.0) + 1
    for _ in range(40):
        begin *= 2
        here = enclosure(f, x, begin, begin)
        size = _largest(g, x, begin, begin)
        if here is None or size is None or not here[1] < top:
            continue
        for factor in (sympy.Integer(1), x):
            fall = enclosure(_factored(slope * factor, x), x, begin, math.inf)
            # fall[1] is rounded up from what may be 0.
            if fall is None or not fall[1] < 1e-300:
                continue
            gain = 0.0
            if growth is not None:
                everywhere = _largest(g, x, begin, math.inf)
                growths = enclosure(_factored(growth * factor, x), x, begin, math.inf)
                if growths is not None and not math.isinf(growths[1]):
                    gain = growths[1]
                elif everywhere is not None:
                    size = everywhere
                else:
                    continue
            # The integral of (y/X)^(-1 - s) over y > X is X/s.
            extra, shift = (begin, 1.0) if factor is x else (1.0, 0.0)
            steepness = max(min(-fall[1], 1e100), 0.0)
            if not steepness and gain + shift >= 0:
                continue
            return begin, (size * extra * _MORE, _drop(top, here[1]), steepness, gain + shift)
    raise NotProved


def _factored(expression: Expr, x: Symbol) -> Expr:
    """A form whose intervals reach to infinity without oo - oo or oo/oo."""
    top, bottom = sympy.fraction(sympy.together(expression))
    if not (top.is_polynomial(x) and bottom.is_polynomial(x)):
        return sympy.expand(expression)
    degree, parts = 0, []
    for part, sign in ((top, 1), (bottom, -1)):
        polynomial = sympy.Poly(part, x)
        degree += sign * polynomial.degree()
        parts.append(sum(c * x ** (m[0] - polynomial.degree()) for m, c in polynomial.terms()))
    return sympy.Mul(x**degree, parts[0], 1 / parts[1], evaluate=False)
