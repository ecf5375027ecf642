"""Weak noise through the coalescence of wells, barriers and ends: T by uniform approximation.

Laplace's sums (`symasym.asymptotics.weak_noise`) with the places that may meet taken
together (`symasym.asymptotics.coalescence`): a well and the barrier next to it, also past the
fold where they are a complex pair, and a barrier before the end of the layer. Their own
series stay below the sum, in the places and in the outer part; the singular terms cancel there,
for which digits are added beforehand, so that nothing is lost beside a coalescence.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

from symasym.asymptotics.coalescence import Edge, Fold, airy, edge_corrections, fold_of
from symasym.asymptotics.cubic_pair import Pair, split_pair
from symasym.asymptotics.places import BEYOND, Half, Place, half, refined_mark
from symasym.asymptotics.weak_noise import (
    Exponentials,
    Pair as Value,
    Side,
    Sides,
    outer_part,
    series_of,
    time_of,
    weights_of,
    working_digits,
)
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError, SymasymError
from symasym.exact.local import ExactField, to_fraction
from symasym.inputs import float_text
from symasym.scenes import Request, as_digits, exact_scene, read_order

__all__ = ["escape_time"]

DEFAULT_ORDER = 2
MOST_ORDER = 6
_DROPPED = ("higher orders of every series, in the error",)


class _Seen(NamedTuple):
    """One side of the start, with what meets in it."""

    half: Half
    folds: list[Fold]
    edge: Edge | None


def escape_time(drift: Drift, kappa: Any, r: Any, start: Any, request: Request) -> Any:
    """T of one scene, to the order that `request` asks for."""
    order = read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    values = exact_scene(drift, {"kappa": kappa, "r": r, "start": start}, request.dps)
    lam = 2 / values["kappa"] ** 2
    digits = request.digits
    base = working_digits(digits, lam, values["r"])
    extra, offset = _lost(drift, order, base)
    with own_context(base + extra) as context:
        number = context.mpf(lam.numerator) / lam.denominator
        sides = [
            _seen(ExactField(drift, mirrored, context, offset), x, values["r"], order, context)
            for mirrored, x in ((True, -values["start"]), (False, values["start"]))
        ]
        radius = context.mpf(values["r"].numerator) / values["r"].denominator
        found = [_time(sides, number, radius, n, context) for n in range(order, order + 1 + BEYOND)]
        value = found[0]
        near, far = (abs(b - a) for a, b in zip(found, found[1:], strict=False))
        # Twice what the next two orders add, and as many more as long as they hardly fall.
        size = 2 * (near + far) / (1 - min(far / near, context.mpf(3) / 4)) if near else 8 * far
        if not (value > 0 and size < value):
            raise AccuracyError(
                f"kappa is {float_text(values['kappa'])}, where the noise is too strong for the "
                f"uniform series with order={order}: the next terms are as large as the value; "
                "use method='exact'."
            )
        if request.log:
            size = -context.log1p(-size / value)
            value = context.log(value)
        size += abs(value) * context.mpf(10) ** -(digits + 5)
        request = request._replace(order=order)
        return as_digits(request, value, size, "estimate", _names(sides, context), _DROPPED)


def _names(sides: list[_Seen], context: Any) -> tuple[str, ...]:
    found = []
    for sign, side in zip((-1, 1), sides, strict=True):
        for fold in side.folds:
            at = sign * (context.mpf(fold.point.numerator) / fold.point.denominator)
            found.append(f"well and barrier about u = {context.nstr(at, 6)}")
        if side.edge is not None:
            found.append(f"barrier before u = {sign}")
    return (*found, "wells, barriers, start, ends, kinks and the part between")


# -- what meets ------------------------------------------------------------------------------------


def _lost(drift: Drift, order: int, digits: int) -> tuple[int, Fraction]:
    """Digits that cancel, and what is added to A where a pair is too close for any."""
    count, lost, offset = order + 1 + BEYOND, 0.0, Fraction(0)
    # A so far below the digits asked for changes no digit of T.
    least = Fraction(1, 10 ** (digits + 10))
    with own_context(2 * digits + 40) as context:
        field = ExactField(drift, False, context)
        for mark in sorted(map(Fraction, field.monotone_marks())):
            if not -1 < mark < 1:
                continue
            point = refined_mark(field, mark, context)
            taylor = field.taylor(point, Fraction(1), 3)
            if abs(taylor[0]) < least:
                offset = least if taylor[2] > 0 else -least
            depth = max(abs(taylor[0]), least)
            lost = max(lost, -1.5 * _log10(depth) * count)
        for end in (-1, 1):
            slope = abs(field.value(Fraction(end)))
            if slope:
                lost = max(lost, 0.0) + max(0.0, -2 * _log10(slope) * (count + 1))
    return int(lost) + 10 * count, offset


def _log10(x: Fraction) -> float:
    # Digits of the parts, since x may be beyond float64.
    return 0.30103 * (x.numerator.bit_length() - x.denominator.bit_length())


def _seen(field: ExactField, x: Fraction, r: Fraction, order: int, context: Any) -> _Seen:
    one = half(field, x, r, order, context, context.dps)
    count = order + 1 + BEYOND
    lo, hi = max(x, Fraction(-1)), min(r, Fraction(1))
    folds = []
    if lo < hi:
        for mark in sorted(map(Fraction, field.monotone_marks())):
            if lo < mark < hi:
                fold = _fold(field, refined_mark(field, mark, context), x, lo, count, one, context)
                if fold is not None:
                    folds.append(fold)
    return _Seen(one, folds, _edge(one))


def _fold(
    field: ExactField,
    point: Fraction,
    x: Fraction,
    lo: Fraction,
    count: int,
    one: Half,
    context: Any,
) -> Fold | None:
    """The pair about this zero of phi's slope, if it is one by itself."""
    taylor = [context.mpf(c.numerator) / c.denominator for c in _taylor(field, point, count)]
    if not taylor[2]:
        return None
    try:
        pair = split_pair(taylor, context)
        height = _height(field, point, x, lo, context)
        fold = fold_of(pair, taylor, point, height, count, context)
    except SymasymError:
        return None
    if pair.zeta > 0 and not _both(fold, one):
        return None
    return fold


def _taylor(field: ExactField, point: Fraction, count: int) -> list[Fraction]:
    terms = 4 * count + 40
    found = field.taylor(point, Fraction(1), terms)
    return list(found) + [Fraction(0)] * (3 - len(found))


def _height(field: ExactField, point: Fraction, x: Fraction, lo: Fraction, context: Any) -> Any:
    a, b = (context.mpf(u.numerator) / u.denominator for u in (lo, point))
    rise = field.potential_rise(a, b)
    if x < -1:
        slope, length = field.value(Fraction(-1)), -1 - x
        rise -= context.mpf((slope * length).numerator) / (slope * length).denominator
    return rise


def _zeros(fold: Fold, context: Any) -> tuple[Any, Any]:
    middle = context.mpf(fold.point.numerator) / fold.point.denominator + fold.pair.middle
    half_way = context.sqrt(fold.pair.square)
    return middle - half_way, middle + half_way


def _both(fold: Fold, one: Half) -> bool:
    """Whether both of the real pair are places of this side."""
    context = fold.height.context
    return all(_place_at(u, one.rising + one.falling) is not None for u in _zeros(fold, context))


def _place_at(u: Any, places: list[Place]) -> Place | None:
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
        ratio = 8 * (zero.height + well.height) / (zero.height - end.height)
        peak = [a * context.gammainc(n + 2, 0, ratio, True) for n, a in enumerate(peak)]
    before = [
        sum((c for c, _, _ in after), context.zero) - sum((c for c, _, _ in change), context.zero)
        for after, change in zip(end.onward, end.groups, strict=True)
    ]
    return Edge(zero.height, end.height, peak, before)


# -- at one lam --------------------------------------------------------------------------------------


def _time(sides: list[_Seen], lam: Any, r: Any, order: int, context: Any) -> Any:
    ops = Exponentials(context)
    left, right = (_side(one, lam, r, order, ops, context) for one in sides)
    starts = [one.half.start for one in sides]
    rising = sum((s.rising.value for s in (left, right)), context.zero)
    falling = sum((s.falling.value for s in (left, right)), context.zero)
    whole = Sides(left, right, Value(rising, 0), Value(falling, 0), starts[0].corner)
    return time_of(whole, lam).value


def _side(seen: _Seen, lam: Any, r: Any, order: int, ops: Any, context: Any) -> Side:
    one = seen.half
    places = [(p, a.value, b.value) for p, a, b in weights_of(one, lam, r, order, ops)[0]]
    low = [(p, a.value, b.value) for p, a, b in weights_of(one, lam, r, order, ops)[1]]
    rising = [[p.u, share, onward, p] for p, share, onward in places]
    falling = [[p.u, share, p] for p, share, _ in low]
    nested = outer_part(one, lam, r, order, ops).value
    left_out = set()
    for k, fold in enumerate(seen.folds):
        local, height = airy(fold, lam, order, context), context.exp(lam * fold.height)
        up, down = local.rising * height, local.falling / height
        if fold.pair.zeta > 0:
            zeros = _zeros(fold, context)
            barrier = next(x for x in rising if x[3] is _of(zeros, one.rising))
            well = next(x for x in falling if x[2] is _of(zeros, one.falling))
            barrier[1], well[1] = up, down
        else:
            middle = context.mpf(fold.point.numerator) / fold.point.denominator
            barrier, well = [middle, up, 0, k], [middle, down, k]
            rising.append(barrier)
            falling.append(well)
            nested -= sum(
                (x * lam ** -(n + 1) for n, x in enumerate(fold.share[: order + 1])), context.zero
            )
        if fold.onward:
            nested += local.both
        left_out.add((id(well), id(barrier)))
    if seen.edge is not None:
        nested += _cut(seen.edge, rising, falling, lam, order, context)
    for down in falling:
        for up in rising:
            if (id(down), id(up)) in left_out:
                continue
            if up[0] is None or up[0] > down[0]:
                nested += down[1] * up[1]
            elif up[0] == down[0] and up[3] is not None:
                nested += down[1] * up[2]
    scale = sum((up[1] for up in rising), context.zero)
    starts = [series_of(g, lam, order, ops).value for g in one.start[:2]]
    return Side(Value(scale, 0), Value(nested, 0), Value(starts[0], 0), Value(starts[1], 0))


def _of(zeros: tuple[Any, Any], places: list[Place]) -> Place:
    found = (_place_at(u, places) for u in zeros)
    return next(p for p in found if p is not None)


def _cut(
    edge: Edge, rising: list[Any], falling: list[Any], lam: Any, order: int, context: Any
) -> Any:
    """Correct the shares at the end of the layer; returns what the double integral gains."""
    found = edge_corrections(edge, lam, order, context)
    end = next(x for x in rising if getattr(x[3], "kind", "") in ("end", "kink") and x[3].height == edge.end)
    height = context.exp(lam * edge.end)
    rising.append([end[0], found.rising * height, 0, None])
    for down in falling:
        if getattr(down[2], "kind", "") == "kink" and down[0] == end[0]:
            down[1] += found.falling / height
    return found.nested


_ = Pair, to_fraction
