"""What meets in weak noise: wells with barriers, and barriers with the end of the layer.

Found for one side of the start (`symasym.asymptotics.places`), with the digits that cancel there.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

from symasym.asymptotics.coalescence import Edge, Fold, fold_of
from symasym.asymptotics.cubic_pair import split_pair
from symasym.asymptotics.places import BEYOND, Half, Place, half, turning_points
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError, SymasymError
from symasym.exact.local import ExactField

__all__ = ["Seen", "Stretch", "folds_of", "lost_digits", "place_at", "seen", "zeros_of"]


# Any number would do for every order; this is about the best for friction with mu = 3.
_FADE = 8


class Seen(NamedTuple):
    """One side of the start, with what meets in it."""

    half: Half
    folds: list[Fold]
    edge: Edge | None


def lost_digits(drift: Drift, order: int, digits: int) -> tuple[int, Fraction]:
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
        for end in (-1, 1):
            slope = abs(field.value(Fraction(end)))
            if slope:
                lost = max(lost, 0.0) + max(0.0, -2 * _log10(slope) * (count + 1))
    return int(lost) + 4 * count, offset


def _log10(x: Fraction) -> float:
    # Digits of the parts, since x may be beyond float64.
    return 0.30103 * (x.numerator.bit_length() - x.denominator.bit_length())


class Stretch(NamedTuple):
    """The part of the layer that is looked at, seen from the start x to the right.

    `cuts` are the places in it where the line ends that Airy functions take to be infinite.
    """

    field: ExactField
    x: Fraction
    lo: Fraction
    hi: Fraction
    cuts: tuple[Fraction, ...]
    digits: int
    context: Any


def seen(
    field: ExactField, x: Fraction, r: Fraction, order: int, digits: int, context: Any
) -> Seen:
    """What lies right of `x`, with the pairs and the barrier before the end."""
    one = half(field, x, r, order, context, context.dps)
    lo, hi = max(x, Fraction(-1)), min(r, Fraction(1))
    # Beyond u = 1 the line goes on, so that a kink is no cut.
    cuts = tuple(u for u in (lo, hi) if abs(u) < 1)
    stretch = Stretch(field, x, lo, hi, cuts, digits, context)
    return Seen(one, folds_of(stretch, order, one.rising + one.falling), _edge(one))


def folds_of(stretch: Stretch, order: int, places: list[Place]) -> list[Fold]:
    """The pairs in it, no place in two of them: in that with which it meets first."""
    field, lo, hi, context = stretch.field, stretch.lo, stretch.hi, stretch.context
    found = []
    turns = turning_points(field, Fraction(-1), Fraction(1), context)
    for point in turns:
        if lo < point < hi:
            fold = _fold(stretch, point, order + 1 + BEYOND, places)
            if fold is not None and _is_own(fold, turns, context):
                found.append(fold)
    taken: list[Place] = []
    chosen = []
    for fold in sorted(found, key=lambda f: abs(f.pair.zeta)):
        if fold.pair.zeta > 0:
            own = [place_at(u, places) for u in zeros_of(fold, context)]
            if any(p is q for p in own for q in taken):
                continue
            taken += [p for p in own if p is not None]
        chosen.append(fold)
    return sorted(chosen, key=lambda f: f.point)


def _fold(stretch: Stretch, point: Fraction, count: int, places: list[Place]) -> Fold | None:
    """The pair about this zero of phi's slope, if it is one by itself."""
    context = stretch.context
    taylor = [
        context.mpf(c.numerator) / c.denominator for c in _taylor(stretch.field, point, count)
    ]
    try:
        pair = split_pair(taylor, context)
        fold = fold_of(pair, taylor, point, _height(stretch, point), count, stretch.digits, context)
    except SymasymError:
        return None
    if pair.zeta > 0 and None in [place_at(u, places) for u in zeros_of(fold, context)]:
        return None
    rooms = [abs(_height(stretch, u) - fold.height) for u in stretch.cuts]
    middle = context.mpf(point.numerator) / point.denominator + pair.middle
    ends = [context.mpf(u.numerator) / u.denominator for u in (stretch.lo, stretch.hi)]
    # Beyond the layer phi is another function, and the pair none of its own.
    room = min(rooms, default=context.inf) if ends[0] < middle < ends[1] else context.zero
    return fold._replace(room=room)


def _is_own(fold: Fold, turns: list[Fraction], context: Any) -> bool:
    """Whether no other turning point is nearer to a complex pair, which may be found from both."""
    if fold.pair.zeta > 0:
        return True
    middle = context.mpf(fold.point.numerator) / fold.point.denominator + fold.pair.middle
    away = [abs(context.mpf(u.numerator) / u.denominator - middle) for u in turns]
    return bool(abs(fold.pair.middle) <= min(away) * (1 + context.eps**0.5))


def _taylor(field: ExactField, point: Fraction, count: int) -> list[Fraction]:
    terms = 4 * count + 40
    found = field.taylor(point, Fraction(1), terms)
    return list(found) + [Fraction(0)] * (3 - len(found))


def _height(stretch: Stretch, point: Fraction) -> Any:
    """V, from the start."""
    field, x, context = stretch.field, stretch.x, stretch.context
    a, b = (context.mpf(u.numerator) / u.denominator for u in (stretch.lo, point))
    rise = field.potential_rise(a, b)
    if x < -1:
        fall = field.value(Fraction(-1)) * (-1 - x)
        rise -= context.mpf(fall.numerator) / fall.denominator
    return rise


def zeros_of(fold: Fold, context: Any) -> tuple[Any, Any]:
    """The two of a real pair."""
    middle = context.mpf(fold.point.numerator) / fold.point.denominator + fold.pair.middle
    half_way = context.sqrt(fold.pair.square)
    return middle - half_way, middle + half_way


def place_at(u: Any, places: list[Place]) -> Place | None:
    """The well or barrier at `u`."""
    for place in places:
        # Neighbours in a pair are much farther apart than what rounding leaves.
        if place.kind in ("well", "barrier") and abs(place.u - u) <= u.context.eps**0.75:
            return place
    return None


def _edge(one: Half) -> Edge | None:
    """The barrier next to the end of the layer."""
    last = [p for p in one.rising if p.kind in ("end", "kink")]
    zeros = [p for p in one.rising + one.falling if p.kind in ("well", "barrier")]
    if not (last and zeros):
        return None
    end, zero = max(last, key=lambda p: p.u), max(zeros, key=lambda p: p.u)
    if zero.kind != "barrier":
        return None
    context = end.u.context
    root = context.sqrt(2 * context.pi)
    wells = [p for p in one.falling if p.kind == "well"]
    peak = [g[0][0] / root for g in zero.groups]
    if wells:
        # As the well comes near the barrier, which is then far from the end, the barrier's own
        # series breaks down, and nothing is to be corrected. This fades the correction without
        # a trace in any order of 1/lam, since it is then of a higher order anyway, and faster
        # than any power where the end comes near.
        well = max(wells, key=lambda p: p.u)
        ratio = _FADE * (zero.height + well.height) / (zero.height - end.height)
        peak = [a * context.gammainc(n + 2, 0, ratio, True) for n, a in enumerate(peak)]
    before = [
        sum((c for c, _, _ in after), context.zero) - sum((c for c, _, _ in change), context.zero)
        for after, change in zip(end.onward, end.groups, strict=True)
    ]
    return Edge(zero.height, end.height, peak, before)
