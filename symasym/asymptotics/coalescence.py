"""What a well and a barrier, or a barrier and an end, make of weak noise as they meet.

Laplace's series of each is singular where they meet; here the integrals over both together.
All are local, and known in closed form to every order:

- well and barrier, phi du = (s² - zeta) ds: Bi and Bi' in the single integrals, Ai² + Bi² and its
  kin in the double one (`symasym.asymptotics.airy_products`), with u'(s) as weight of both.
- barrier and end, phi du = t dt, x² = lam t²/2 at the end: erfc(x), Dawson's integral F(x) and
  the integral of F take the place of their asymptotic series.

What is left over by the integrations by parts has no exponential, and is the outer part.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.asymptotics.airy_products import by_parts, pair_terms
from symasym.asymptotics.cubic_map import map_coefficients
from symasym.asymptotics.cubic_pair import Pair, shifted
from symasym.asymptotics.outer import laurent

__all__ = ["Airy", "Edge", "Fold", "airy", "edge_corrections", "fold_of", "parabola"]


class Fold(NamedTuple):
    """A well and a barrier, real or a complex pair.

    Attributes
    ----------
    point : Fraction
        The zero of phi's slope between them.
    pair : Pair
    onward : bool
        Whether the well comes first, seen from the start.
    height : mpf
        Mean of V over both, from the start.
    terms : list of (a_k, b_k)
    share : list
        Of a complex pair in the outer part's integrals of h_k along the real line.
    level : mpf
        V at the point.
    room : mpf
        How far V is from `height` where the line is cut off; infinite if nowhere.
    bottom : (mpf, mpf)
        phi and half its curvature at the point, with the sign that makes the curvature positive.
    """

    point: Fraction
    pair: Pair
    onward: bool
    height: Any
    terms: list[tuple[Any, Any]]
    share: list[Any]
    level: Any
    bottom: tuple[Any, Any]
    room: Any


def fold_of(
    pair: Pair,
    taylor: list[Any],
    point: Fraction,
    height: Any,
    count: int,
    digits: int,
    context: Any,
) -> Fold:
    """`taylor` are those of phi about `point`, where V is `height`; to `count` orders.

    The map needs `digits`; the share in the outer part is to cancel, and has all of them.
    """
    with context.workdps(digits + 12 + 4 * count):
        found = map_coefficients(pair, 2 * count + 1, context, None)
    terms = list(zip(*by_parts(pair.zeta, found, count), strict=True))
    onward = bool(pair.sign > 0)
    if not onward:
        # s runs against u, and du = u' ds with it.
        terms = [(-a, -b) for a, b in terms]
    share = [context.zero] * count
    if pair.zeta < 0:
        share = _share(pair, taylor, count, context)
    bottom = pair.sign * taylor[0], pair.sign * taylor[2]
    middle = height - pair.level
    return Fold(point, pair, onward, middle, terms, share, height, bottom, context.inf)


def parabola(fold: Fold, context: Any) -> Fold:
    """With phi = c_0 + c_2 (u - point)²: u' = p = c_2^(-1/3) and zeta = -c_0 p, linear in c_0."""
    low, bend = fold.bottom
    p = 1 / context.cbrt(bend)
    pair = replace(fold.pair, zeta=-low * p)
    return fold._replace(pair=pair, terms=[(p, context.zero)], height=fold.level)


def _share(pair: Pair, taylor: list[Any], count: int, context: Any) -> list[Any]:
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
    """Local integrals of a `Fold` at one lam, with `order` terms; heights are left out."""

    rising: Any
    falling: Any
    both: Any


def airy(fold: Fold, lam: Any, order: int, context: Any) -> Airy:
    rows = fold.terms[: order + 1]
    found = pair_terms(fold.pair.zeta, rows, rows, lam, context)
    rising, falling, both = (
        context.fsum(value for value, _ in terms)
        for terms in (found.rising, found.falling, found.both)
    )
    return Airy(rising, falling, both)


class Edge(NamedTuple):
    """A barrier before an end or kink of the layer.

    Attributes
    ----------
    barrier, end : mpf
        Their heights.
    peak : list
        alpha_n of int e^{lam V} = sqrt(2 pi/lam) e^{lam barrier} sum alpha_n lam^-n.
    series : list
        Of the formal series -sum_k series[k] lam^-(k+1) of int e^{lam V} up to the end.
    """

    barrier: Any
    end: Any
    peak: list[Any]
    series: list[Any]


class Corrections(NamedTuple):
    """What is to be added to Laplace's: at the end to both integrals, and to the double one."""

    rising: Any
    falling: Any
    nested: Any


def edge_corrections(edge: Edge, lam: Any, order: int, context: Any) -> Corrections:
    """Uniform functions less the terms of their series that Laplace's has, times e^{lam ...}.

    `rising` is in units of e^{lam end}, `falling` in those of e^{-lam end}.
    """
    c, terms = context, order + 1
    t = c.sqrt(2 * (edge.barrier - edge.end))
    x = t * c.sqrt(lam / 2)
    down = [(-1) ** n * a for n, a in enumerate(edge.peak)]
    odd = [c.fac2(2 * m - 1) / t ** (2 * m + 1) for m in range(terms)]
    # sqrt(pi/(2 lam)) e^{x²} erfc(x) = sum (-1)^m odd[m] lam^-(m+1), and Dawson's without signs.
    shade = [(-1) ** m * y for m, y in enumerate(odd)]
    shaded, dawson = _product(edge.peak, shade, terms), _product(down, odd, terms)
    series = [y - z for y, z in zip(edge.series[:terms], shaded, strict=True)]
    tail = c.sqrt(c.pi / (2 * lam)) * c.exp(x * x) * c.erfc(x)
    rising = -_sum(edge.peak[:terms], lam) * tail + _sum(shaded, lam) / lam
    f = c.sqrt(c.pi) / 2 * c.exp(-x * x) * c.erfi(x)
    slow = _sum(down[:terms], lam) * c.sqrt(2 / lam) * f
    falling = slow - _sum(dawson, lam) / lam
    # int F, and log(t) - sum (2m-1)!!/(2m) (lam t²)^-m, which is what it is far from the barrier.
    weights = _product(edge.peak, down, terms)
    area = x * x * c.hyp2f2(1, 1, c.mpf(3) / 2, 2, -x * x)
    area -= (c.euler + c.log(2 * lam)) / 2
    formal = [c.log(t), *(-c.fac2(2 * m - 1) / (2 * m * t ** (2 * m)) for m in range(1, terms))]
    nested = _sum(weights, lam) * area / lam - _sum(_product(weights, formal, terms), lam) / lam
    # Less what the end cuts off: Dawson's times the regular part of the end's series.
    nested -= slow * _sum(series, lam) / lam
    nested += _sum(_product(dawson, series, max(terms - 1, 0)), lam) / lam**2
    return Corrections(rising, falling, nested)


def _product(a: list[Any], b: list[Any], count: int) -> list[Any]:
    return [sum(a[i] * b[k - i] for i in range(k + 1)) for k in range(count)]


def _sum(c: list[Any], lam: Any) -> Any:
    return sum((x * lam**-k for k, x in enumerate(c)), 0 * lam)
