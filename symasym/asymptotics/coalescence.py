"""What a well and a barrier make of weak noise as they meet.

Laplace's series of each is singular where they meet; here the integrals over both together,
known in closed form to every order. With
phi du = (s² - zeta) ds (`symasym.asymptotics.cubic_map`) and Z = lam^(2/3) zeta, integrations by
parts lower u'(s) to sum (±1/lam)^k (a_k + b_k s), and then

    int e^{-lam V}                 = pi (a Bi(Z) lam^(-1/3) - b Bi'(Z) lam^(-2/3)),
    int e^{lam V}                  = pi (a Bi(Z) lam^(-1/3) + b Bi'(Z) lam^(-2/3)),
    the double integral over both  = pi² (a a' (Ai² + Bi²) lam^(-2/3)
            + (a b' - b a') (Ai Ai' + Bi Bi') lam^(-1) - b b' (Ai'² + Bi'²) lam^(-4/3)),

a, b with -1/lam, a', b' with 1/lam (DLMF 9.11.4 for the first; the others are its derivatives).
What is left over by the integrations by parts has no exponential, and is the outer part.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.asymptotics.cubic_map import map_coefficients
from symasym.asymptotics.cubic_pair import Pair, shifted
from symasym.asymptotics.outer import laurent

__all__ = ["Airy", "Fold", "airy", "fold_of", "parabola"]


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
    room: Any
    digits: int
    known: dict[Any, tuple[Any, ...]]


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
    terms, rest = [], list(found)
    for _ in range(count):
        terms.append(rest[0])
        rest = _lowered(rest, pair.zeta)
    onward = bool(pair.sign > 0)
    if not onward:
        # s runs against u, and du = u' ds with it.
        terms = [(-a, -b) for a, b in terms]
    share = [context.zero] * count
    if pair.zeta < 0:
        share = _share(pair, taylor, count, context)
    bottom = pair.sign * taylor[0], pair.sign * taylor[2]
    middle = height - pair.level
    return Fold(point, pair, onward, middle, terms, share, height, bottom, context.inf, digits, {})


def parabola(fold: Fold, context: Any) -> Fold:
    """With phi = c_0 + c_2 (u - point)²: u' = p = c_2^(-1/3) and zeta = -c_0 p, linear in c_0."""
    low, bend = fold.bottom
    p = 1 / context.cbrt(bend)
    pair = replace(fold.pair, zeta=-low * p)
    return fold._replace(pair=pair, terms=[(p, context.zero)], height=fold.level, known={})


def _lowered(c: list[tuple[Any, Any]], zeta: Any) -> list[tuple[Any, Any]]:
    """The derivative of f_1 in f = p_0 + q_0 s + w f_1, w = s² - zeta, in the same form."""
    found = [[0 * zeta, 0 * zeta] for _ in range(max(1, len(c) - 1))]
    for j, (p, q) in enumerate(c[1:], start=1):
        # d/ds (p + q s) w^(j-1) = q w^(j-1) + (j-1) (2 p s + 2 q (w + zeta)) w^(j-2).
        found[j - 1][0] += (2 * j - 1) * q
        if j > 1:
            found[j - 2][0] += 2 * (j - 1) * zeta * q
            found[j - 2][1] += 2 * (j - 1) * p
    return [(p, q) for p, q in found]


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
    c = context
    third = c.cbrt(lam)
    if lam not in fold.known:
        with c.workdps(fold.digits):
            z = third**2 * fold.pair.zeta
            fold.known[lam] = c.airyai(z), c.airybi(z), c.airyai(z, 1), c.airybi(z, 1)
    ai, bi, ai1, bi1 = fold.known[lam]
    sums = [[c.zero, c.zero], [c.zero, c.zero]]
    both = c.zero
    for k in range(order + 1):
        power = lam**-k
        for side, sign in enumerate((1, (-1) ** k)):
            for i in (0, 1):
                sums[side][i] += sign * power * fold.terms[k][i]
        squares = cross = slopes = c.zero
        for i in range(k + 1):
            (a, b), (other_a, other_b) = fold.terms[i], fold.terms[k - i]
            sign = (-1) ** i
            squares += sign * a * other_a
            cross += sign * (a * other_b - b * other_a)
            slopes += sign * b * other_b
        inner = squares * (ai**2 + bi**2) + cross * (ai * ai1 + bi * bi1) / third
        both += power * (inner - slopes * (ai1**2 + bi1**2) / third**2)
    (up, up_s), (down, down_s) = sums
    return Airy(
        c.pi * (up * bi + up_s * bi1 / third) / third,
        c.pi * (down * bi - down_s * bi1 / third) / third,
        c.pi**2 * both / third**2,
    )
