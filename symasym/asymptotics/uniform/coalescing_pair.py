"""The canonical Airy form of a well and a barrier that coalesce, to every order.

The uniform expansion of Chester, Friedman and Ursell, of both integrals and the double one.

Laplace's series of each is singular where they coalesce; here the integrals over both together are
known in closed form to every order. With phi du = (s² - zeta) ds
(`symasym.asymptotics.coalescence.cubic_map`) u'(s) is the weight of both integrals, Bi and Bi'
stand in the single ones, and Ai² + Bi² and its kin in the double one
(`symasym.special.airy_products`). What is left over by the integrations by parts has no
exponential, and is the regular part.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.numbers.arithmetic import Digits
from symasym.numbers.polynomials import shifted
from symasym.series.power_series import laurent
from symasym.series.quadratic_factor import Pair
from symasym.special.airy import AiryProducts, airy_products
from symasym.special.airy_products import by_parts, pair_terms

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["Airy", "CanonicalPair", "airy", "canonical_pair", "parabola"]


class CanonicalPair(NamedTuple):
    """A well and a barrier, real or a complex pair.

    Attributes
    ----------
    point : Fraction
        The zero of phi's slope between them.
    pair : Pair
    onward : bool
        True where the well comes first from the start on.
    height : mpf
        Mean of V over both, from the start.
    terms : list of (a_k, b_k)
    share : list
        Of a complex pair in the regular part's integrals of h_k along the real line.
    level : mpf
        V at the point.
    gap : mpf
        How far V is from `height` where the line is cut off; infinite if nowhere.
    bottom : (mpf, mpf)
        phi and half its curvature at the point, with the sign that makes the curvature positive.
    digits : int
        Of Airy's functions.
    known : dict
        These by lam.
    """

    point: Fraction
    pair: Pair
    onward: bool
    height: Any
    terms: list[tuple[Any, Any]]
    share: list[Any]
    level: Any
    bottom: tuple[Any, Any]
    gap: Any
    digits: int
    known: dict[Any, AiryProducts]


def canonical_pair(
    pair: Pair,
    taylor: list[Any],
    point: Fraction,
    height: mpf,
    count: int,
    digits: int,
    context: MPContext,
) -> CanonicalPair:
    """The canonical Airy form of the pair about `point`, to `count` orders.

    `taylor` are those of phi about it, where V is `height`. The map needs `digits`; the share in
    the regular part is to cancel, and has all of them.
    """
    with context.workdps(digits + 12 + 4 * count):
        weights = map_coefficients(pair, 2 * count + 1, context, None)
    terms = list(zip(*by_parts(pair.zeta, weights, count), strict=True))
    onward = bool(pair.sign > 0)
    if not onward:
        # s runs against u, and du = u' ds with it.
        terms = [(-a, -b) for a, b in terms]
    share = [context.zero] * count
    if pair.zeta < 0:
        share = _share(pair, taylor, count, context)
    bottom = pair.sign * taylor[0], pair.sign * taylor[2]
    middle = height - pair.level
    return CanonicalPair(
        point, pair, onward, middle, terms, share, height, bottom, context.inf, digits, {}
    )


def parabola(fold: CanonicalPair, context: MPContext) -> CanonicalPair:
    """With phi = c_0 + c_2 (u - point)²: u' = p = c_2^(-1/3) and zeta = -c_0 p, linear in c_0."""
    low, bend = fold.bottom
    p = 1 / context.cbrt(bend)
    pair = replace(fold.pair, zeta=-low * p)
    return fold._replace(pair=pair, terms=[(p, context.zero)], height=fold.level, known={})


def _share(pair: Pair, taylor: list[Any], count: int, context: MPContext) -> list[Any]:
    """Re 2 pi i Res h_k at the zero above the real line: the real line passes below it."""
    at = pair.middle + 1j * context.sqrt(-pair.square)
    about = shifted([context.mpc(c) for c in taylor], at)[: 2 * count]
    about += [context.mpc(0)] * (2 * count - len(about))
    about[0] = context.mpc(0)
    return [
        -2 * context.pi * context.im(series[2 * k])
        for k, series in enumerate(laurent(about, True, count))
    ]


class Airy(NamedTuple):
    """Local integrals of a `CanonicalPair` at one lam, with `order` terms; heights are left out."""

    rising: Any
    falling: Any
    both: Any


def airy(fold: CanonicalPair, lam: mpf, order: int, context: MPContext) -> Airy:
    """The local integrals of the pair at one lam, to `order` (Chester, Friedman and Ursell)."""
    c, rows = context, fold.terms[: order + 1]
    if lam not in fold.known:
        with c.workdps(fold.digits):
            fold.known[lam] = airy_products(c.cbrt(lam) ** 2 * fold.pair.zeta, Digits(c))
    known_terms = pair_terms(fold.pair.zeta, rows, rows, lam, c, fold.known[lam])
    rising, falling, both = (
        c.fsum(value for value, _ in terms)
        for terms in (known_terms.rising, known_terms.falling, known_terms.both)
    )
    return Airy(rising, falling, both)
