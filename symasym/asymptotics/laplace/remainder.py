"""Proved bounds of |I - sum| for all large lam: Watson's lemma's remainder, and the complement.

With I = int g e^{lam f} and e^{lam f(p)} taken out, beside a maximum p the integral is

    int_0^{u_0} e^{-lam u^mu} u^{beta - 1} sum_k F_k u^k du,    |F_k| <= M rho^{-k}

(`cauchy_disk`). The truncation error of the first n terms is: the next few terms, which are known;
the tail of a geometric series (Cauchy's estimate), M rho^{-m} Gamma((m + beta)/mu)
lam^{-(m + beta)/mu} over mu (1 - THETA); and what each term has beyond u_0, an incomplete gamma
function Gamma(s, lam u_0^mu) (DLMF 8.10.1). Away from the maxima the integrand is exponentially
small (`tail_bounds`). For Watson's lemma and its error see F. W. J. Olver, Asymptotics and Special
Functions, chapter 3.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from symasym.asymptotics.laplace.cauchy_disk import THETA, Disk, disk
from symasym.asymptotics.laplace.expansion import Contribution
from symasym.asymptotics.laplace.kinks import Piece, difference, number
from symasym.asymptotics.laplace.maxima import agree
from symasym.asymptotics.laplace.tail_bounds import Part, boxes
from symasym.base.contexts import mpf_of, own_context
from symasym.base.inputs import exact
from symasym.numbers.balls import NotProved, exact_ball, precision

if TYPE_CHECKING:
    from flint import arb
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol

    from symasym.asymptotics.laplace.kinks import Real

# Terms behind the last one used that are bounded one by one, the others by Cauchy's estimate.
_EXPLICIT = 4
_SAFETY = 1e-9
_LESS = 1 - 1e-9


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

    def relative(self, lam: mpf, orders: list[int], context: MPContext) -> mpf:
        """The bound with the first orders[i] terms used of the i-th contribution."""
        algebraic, small = self._two(lam, orders, context)
        return algebraic + small

    def statement(self, order: int, sigma: Expr) -> tuple[mpf, Expr, mpf]:
        """(K, sigma, lam0): every summand times lam^sigma falls for lam >= lam0."""
        with own_context(20) as context:
            power = context.mpf(sigma.p) / sigma.q
            orders = [order] * len(self.contributions)
            start = self._falls_from(power)
            for _ in range(200):
                algebraic, small = self._two(start, orders, context)
                if small <= algebraic / 100 or not algebraic:
                    break
                start *= context.mpf(5) / 4
            constant = (algebraic + small) * start**power
            return context.mpf(constant), sigma, start

    def _falls_from(self, power: mpf) -> mpf:
        """A lam from which lam^power times each exponentially small term decreases."""
        with own_context(20) as context:
            start = context.mpf(1)
            for d in self.disks:
                largest = (len(d.coefficients) + context.mpf(d.beta.numerator)) / d.contact
                for _, _, drop in d.sides:
                    start = max(start, (power + largest + 2) / drop)
            for _, drop, steep, growth in self.parts:
                start = max(start, power / drop)
                if steep:
                    start = max(start, 2 * growth / steep)
            for gap in self.gaps:
                start = max(start, power / context.make_mpf(gap._mpf_))
            return start

    def _two(self, lam: mpf, orders: list[int], context: MPContext) -> tuple[mpf, mpf]:
        """The bounds of what is of a power of lam, and of what is exponentially small."""
        algebraic, small = context.mpf(0), context.mpf(0)
        for d, c, used in zip(self.disks, self.contributions, orders, strict=False):
            with precision(_bits(len(d.coefficients))):
                powers, beyond = _beside(d, c, used, lam, context)
            algebraic += powers
            small += beyond
        for c, gap in zip(self.others, self.gaps, strict=True):
            size = sum(abs(term) for term in c.terms(lam, 20, context))
            small += size * context.exp(-lam * context.make_mpf(gap._mpf_))
        for weight, drop, steep, growth in self.parts:
            divisor = lam * steep - growth
            if divisor <= 0:
                return context.inf, context.inf
            small += weight * context.exp(-lam * drop) / divisor
        return algebraic * (1 + _SAFETY), small * (1 + _SAFETY)


def _bits(count: int) -> int:
    """Arb's precision for a disk of so many coefficients."""
    return 128 + 12 * count


def _beside(d: Disk, c: Contribution, used: int, lam: mpf, context: MPContext) -> tuple[mpf, mpf]:
    """Bounds of the truncation error beside one maximum: powers of lam, and exponentially small.

    The first is the next terms one by one, then Cauchy's tail; the second the terms' integrals
    beyond the transformed part, although they are integrated to infinity. The tail may begin behind
    any term that is not used; where the series diverges, the last one known is not the best.
    """
    both = len(d.sides) == 2
    _, coefficients = c.numbers(40)
    beta = mpf_of(d.beta, context)
    # On two sides every second coefficient cancels.
    shift = int(d.beta - 1) % 2 if both else 0
    position, total, small = 0, context.mpf(0), context.mpf(0)
    best = context.inf, context.inf
    for k, ball in enumerate(d.coefficients):
        s = (k + beta) / d.contact
        size = d.peak * context.mpf(d.rho) ** -k / d.contact * lam**-s
        small += size * sum(_upper_gamma(s, lam * drop, context) for _, _, drop in d.sides)
        if not (both and (k + shift) % 2):
            value = 2 * ball if both else ball
            if position < used:
                value = value - exact_ball(exact("c", coefficients[position]))
            total += _mpf(abs(value), context) * lam**-s
            position += 1
        if position >= used:
            powers = total + _cauchy_tail(d, k + 1, lam, beta, context)
            if powers + small < sum(best):
                best = powers, small
    return best


def _cauchy_tail(d: Disk, count: int, lam: mpf, beta: mpf, context: MPContext) -> mpf:
    """The bound of the terms from n = `count` on, on all sides, as far as u = THETA rho.

    It is M rho^-n Gamma(s) lam^-s/(mu (1 - THETA)), s = (n + beta)/mu (Cauchy's estimate).
    """
    s = (count + beta) / d.contact
    size = d.peak * context.mpf(d.rho) ** -count / (1 - context.mpf(THETA)) / d.contact
    return len(d.sides) * size * context.gamma(s) * lam**-s


def _upper_gamma(s: mpf, z: mpf, context: MPContext) -> mpf:
    """A bound of Gamma(s, z): DLMF 8.10.1 for s <= 1, integration by parts beyond, and Gamma(s)."""
    whole = context.gamma(s)
    if z <= 0:
        return whole
    if s <= 1:
        return min(whole, z ** (s - 1) * context.exp(-z))
    if z <= s - 1:
        return whole
    return min(whole, z**s * context.exp(-z) / (z - s + 1))


def _mpf(value: arb, context: MPContext) -> mpf:
    """The upper end of a ball, rounded up."""
    return context.mpf(value.upper().str(20, radius=False)) * (1 + context.mpf(10) ** -15)


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
        parts = _complement(pieces, x, taken, disks, top)
    except (NotProved, OverflowError, ZeroDivisionError):
        return None
    gaps = [difference(top, number(c.height)) for c in others]
    return Proof(disks, main, others, gaps, parts)


def _complement(
    pieces: tuple[Piece, ...],
    x: Symbol,
    origins: list[tuple[Piece, Real, str]],
    disks: list[Disk],
    top: mpf,
) -> list[Part]:
    """The interval without the transformed neighbourhoods."""
    gap = min(drop for d in disks for _, _, drop in d.sides)
    ceiling = math.nextafter(float(top), -math.inf)
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
