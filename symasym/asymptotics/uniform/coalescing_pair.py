"""Wells and barriers that coalesce: which are taken together, and their canonical Airy form.

The uniform expansion of Chester, Friedman and Ursell, of both integrals and the double one.

Laplace's series of each is singular where they coalesce; here the integrals over both together are
known in closed form to every order. With phi du = (s² - zeta) ds
(`symasym.asymptotics.coalescence.cubic_map`) u'(s) is the weight of both integrals, Bi and Bi'
stand in the single ones, and Ai² + Bi² and its kin in the double one
(`symasym.special.airy`). What is left over by the integrations by parts has no
exponential, and is the regular part.

Pairs are found for both sides of the start (`symasym.asymptotics.weak_noise.critical_points`); one
may have a member in each. Beside a coalescence singular terms cancel, for which digits are added.
"""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.asymptotics.weak_noise.critical_points import both_sides, turning_points
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import BEYOND
from symasym.base.call_context import mpf_of, own_context
from symasym.base.errors import AccuracyError, SymasymError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.numbers.arithmetic import Digits
from symasym.numbers.polynomials import residues, shifted
from symasym.series.quadratic_factor import Pair, split_pair
from symasym.special.airy import AiryProducts, airy_products, by_parts, pair_terms

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

# How many times as long Taylor's series is made until both zeros have all digits.
_LONGER = (1, 2, 4)


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


def parabola(canonical: CanonicalPair, context: MPContext) -> CanonicalPair:
    """The canonical form for phi = c_0 + c_2 (u - point)².

    u' = p = c_2^(-1/3) and zeta = -c_0 p, linear in c_0.
    """
    low, bend = canonical.bottom
    p = 1 / context.cbrt(bend)
    pair = replace(canonical.pair, zeta=-low * p)
    return canonical._replace(
        pair=pair, terms=[(p, context.zero)], height=canonical.level, known={}
    )


def _share(pair: Pair, taylor: list[Any], count: int, context: MPContext) -> list[Any]:
    """Re 2 pi i Res h_k at the zero above the real line: the real line passes below it."""
    at = pair.middle + 1j * context.sqrt(-pair.square)
    about = shifted([context.mpc(c) for c in taylor], at)[: 2 * count]
    about += [context.mpc(0)] * (2 * count - len(about))
    return [-2 * context.pi * context.im(residue) for residue in residues(about, count)]


class Airy(NamedTuple):
    """Local integrals of a `CanonicalPair` at one lam, with `order` terms; heights are left out."""

    scale: Any
    speed: Any
    both: Any


def airy(canonical: CanonicalPair, lam: mpf, order: int, context: MPContext) -> Airy:
    """The local integrals of the pair at one lam, to `order` (Chester, Friedman and Ursell)."""
    c, rows = context, canonical.terms[: order + 1]
    if lam not in canonical.known:
        with c.workdps(canonical.digits):
            canonical.known[lam] = airy_products(c.cbrt(lam) ** 2 * canonical.pair.zeta, Digits(c))
    known_terms = pair_terms(canonical.pair.zeta, rows, rows, lam, c, canonical.known[lam])
    scale, speed, both = (
        c.fsum(value for value, _ in terms)
        for terms in (known_terms.scale, known_terms.speed, known_terms.both)
    )
    return Airy(scale, speed, both)


# -- which critical points are taken together ------------------------------------------------------


class OneSide(NamedTuple):
    """One side of the start, with the pairs whose turning point is in it."""

    one_sided: OneSided
    pairs: list[CanonicalPair]


def lost_digits(drift: Drift, order: int, digits: int, x: Fraction) -> tuple[int, Fraction]:
    """Digits that cancel, and what is added to A where a pair is too close for any."""
    count, lost, offset = order + 1 + BEYOND, 0.0, Fraction(0)
    # A so far below the digits asked for changes no digit of T.
    least = Fraction(1, 10 ** (digits + 10))
    with own_context(2 * digits + 40) as context:
        field = ExactField(drift, False, context)
        for point in turning_points(field, Fraction(-1), Fraction(1), context):
            taylor = field.taylor(point, Fraction(1), 3)
            if abs(taylor[0]) < least:
                if not field.is_polynomial:
                    raise AccuracyError(
                        f"A has a double zero at u = {float(point):.6g}, or all but one, where the "
                        "uniform series is for polynomials only; use method='exact'."
                    )
                offset = least if taylor[2] > 0 else -least
            depth = max(abs(taylor[0]), least)
            lost = max(lost, -1.5 * _log10(depth) * count)
        for u in (Fraction(-1), Fraction(1), x):
            slope = abs(field.value(u)) if abs(u) <= 1 else None
            if slope:
                lost = max(lost, 0.0) + max(0.0, -2 * _log10(slope) * (count + 1))
    return int(lost) + 4 * count, offset


def _log10(x: Fraction) -> float:
    # Digits of the parts, since x may be beyond float64.
    """log10 of x, to about 0.3."""
    return 0.30103 * (x.numerator.bit_length() - x.denominator.bit_length())


class LayerPart(NamedTuple):
    """The part of the layer to the right of the start x.

    `cuts` are the points in it where the line ends that Airy functions take to be infinite.
    """

    field: ExactField
    x: Fraction
    lo: Fraction
    hi: Fraction
    cuts: tuple[Fraction, ...]
    digits: int
    context: Any

    def has(self, point: Fraction) -> bool:
        """True if it has the point; one of two that coalesce at the start has that."""
        if point == self.lo == self.x:
            return not self.field.mirrored
        return self.lo < point < self.hi


def windows(
    fields: tuple[ExactField, ExactField],
    x: Fraction,
    r: Fraction,
    order: int,
    digits: int,
    context: MPContext,
) -> list[OneSide]:
    """The expansions left of `x`, mirrored, and right of it; no critical point in two pairs."""
    both = both_sides(fields[1], x, r, order, context, context.dps)
    points = [one.scale_points + one.speed_points for one in both]
    pairs = []
    for k, (field, begin) in enumerate(zip(fields, (-x, x), strict=True)):
        lo, hi = max(begin, Fraction(-1)), min(r, Fraction(1))
        # Beyond u = 1 the line goes on, so that a kink is no cut.
        cuts = tuple(u for u in (lo, hi) if abs(u) < 1)
        stretch = LayerPart(field, begin, lo, hi, cuts, digits, context)
        behind = [p._replace(u=-p.u) for p in points[1 - k] if p.u is not None]
        pairs.append(_candidates(stretch, order, points[k] + behind))
    chosen = _chosen(pairs[0] + pairs[1])
    return [
        OneSide(one, [canonical for canonical, _ in own if any(canonical is c for c in chosen)])
        for one, own in zip(both, pairs, strict=True)
    ]


def coalescing_pairs(
    stretch: LayerPart, order: int, points: list[CriticalPoint]
) -> list[CanonicalPair]:
    """The pairs in it, no critical point in two of them: in that where it coalesces first."""
    return _chosen(_candidates(stretch, order, points))


def _candidates(
    stretch: LayerPart, order: int, points: list[CriticalPoint]
) -> list[tuple[CanonicalPair, list[CriticalPoint]]]:
    """Every pair, and its critical points, left to right."""
    field, context = stretch.field, stretch.context
    pairs = []
    turns = turning_points(field, Fraction(-1), Fraction(1), context)
    for point in turns:
        if stretch.has(point):
            canonical = _canonical_pair(stretch, point, order + 1 + BEYOND, points)
            if canonical is not None and _is_own(canonical, turns, context):
                real = zeros_of(canonical, context) if canonical.pair.zeta >= 0 else ()
                own = [p for u in real if (p := place_at(u, points)) is not None]
                pairs.append((canonical, own))
    return pairs


def _chosen(pairs: list[tuple[CanonicalPair, list[CriticalPoint]]]) -> list[CanonicalPair]:
    """The pairs that coalesce first, no critical point in two of them, from left to right."""
    taken: list[Any] = []
    chosen = []
    for canonical, own in sorted(pairs, key=lambda f: abs(f[0].pair.zeta)):
        # From both sides a critical point has one and the same coefficients.
        if any(p.series is series for p in own for series in taken):
            continue
        taken += [p.series for p in own]
        chosen.append(canonical)
    return sorted(chosen, key=lambda f: f.point)


def _canonical_pair(
    stretch: LayerPart, point: Fraction, count: int, points: list[CriticalPoint]
) -> CanonicalPair | None:
    """The pair about this zero of phi's slope, if it is one by itself."""
    context = stretch.context
    for more in _LONGER:
        terms = more * (4 * count + 40)
        taylor = [mpf_of(c, context) for c in _taylor(stretch.field, point, terms)]
        try:
            pair = split_pair(taylor, context)
            canonical = canonical_pair(
                pair, taylor, point, _height(stretch, point), count, stretch.digits, context
            )
        except SymasymError:
            return None
        zeros = zeros_of(canonical, context) if pair.zeta >= 0 else ()
        if None not in [place_at(u, points) for u in zeros]:
            break
        # A polynomial has no more terms; another series may be short of the zeros' digits.
        if stretch.field.is_polynomial or any(abs(u) > 1 for u in zeros):
            return None
    else:
        return None
    gaps = [_total_variation(stretch, canonical, u, points) for u in stretch.cuts]
    middle = mpf_of(point, context) + pair.middle
    ends = [mpf_of(u, context) for u in (stretch.lo, stretch.hi)]
    # Beyond the layer phi is another function, and the pair none of its own.
    gap = min(gaps, default=context.inf) if ends[0] < middle < ends[1] else context.zero
    return canonical._replace(gap=gap)


def _total_variation(
    stretch: LayerPart, canonical: CanonicalPair, cut: Fraction, points: list[CriticalPoint]
) -> Any:
    """The total variation of V between a pair and a cut."""
    context = stretch.context
    point, end = (mpf_of(u, context) for u in (canonical.point, cut))
    zeros = sorted(
        (p for p in points if p.kind in ("well", "barrier") and (p.u - point) * (p.u - end) < 0),
        key=lambda p: abs(p.u - point),
    )
    heights = [p.height if p.kind == "barrier" else -p.height for p in zeros]
    way = [canonical.height, *heights, _height(stretch, cut)]
    return sum((abs(b - a) for a, b in pairwise(way)), context.zero)


def _is_own(canonical: CanonicalPair, turns: list[Fraction], context: MPContext) -> bool:
    """True where no other turning point is nearer to a complex pair, which both may find."""
    if canonical.pair.zeta > 0:
        return True
    others = [u - canonical.point for u in turns if u != canonical.point]
    away = [abs(mpf_of(u, context) - canonical.pair.middle) for u in others]
    return all(abs(canonical.pair.middle) <= distance for distance in away)


def _taylor(field: ExactField, point: Fraction, terms: int) -> list[Fraction]:
    """Taylor coefficients of phi at the point, at least three."""
    taylor = field.taylor(point, Fraction(1), terms)
    return list(taylor) + [Fraction(0)] * (3 - len(taylor))


def _height(stretch: LayerPart, point: Fraction) -> Any:
    """V, from the start."""
    field, x, context = stretch.field, stretch.x, stretch.context
    a, b = (mpf_of(u, context) for u in (stretch.lo, point))
    rise = field.potential_rise(a, b)
    if x < -1:
        fall = field.value(Fraction(-1)) * (-1 - x)
        rise -= mpf_of(fall, context)
    return rise


def zeros_of(canonical: CanonicalPair, context: MPContext) -> tuple[Any, Any]:
    """The two of a real pair."""
    middle = mpf_of(canonical.point, context) + canonical.pair.middle
    half_way = context.sqrt(canonical.pair.square)
    return middle - half_way, middle + half_way


def place_at(u: mpf, points: list[CriticalPoint]) -> CriticalPoint | None:
    """The well or barrier at `u`."""
    for point in points:
        # Neighbours in a pair are much farther apart than what rounding leaves.
        if point.kind in ("well", "barrier") and abs(point.u - u) <= u.context.eps**0.75:
            return point
    return None
