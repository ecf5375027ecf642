"""Weak noise through the coalescence of wells, barriers and ends: T by uniform approximation.

Laplace's sums (`symasym.asymptotics.weak_noise`) with the places that may meet taken
together (`symasym.asymptotics.coalescence`): a well and the barrier next to it, also past the
fold where they are a complex pair, and a barrier before the end of the layer. Their own
series stay below the sum, in the places and in the outer part; the singular terms cancel there,
for which digits are added beforehand, so that nothing is lost beside a coalescence.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.coalescence import (
    Edge,
    Fold,
    airy,
    edge_corrections,
    fold_of,
    parabola,
)
from symasym.asymptotics.cubic_pair import split_pair
from symasym.asymptotics.places import BEYOND, Half, Place, half, turning_points
from symasym.asymptotics.weak_noise import (
    Exponentials,
    Side,
    Sides,
    outer_part,
    require_seen,
    series_of,
    time_of,
    weights_of,
    working_digits,
)
from symasym.asymptotics.weak_noise import Pair as Value
from symasym.asymptotics.weak_noise_arrays import rounding_of_places
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError, InputError, SymasymError
from symasym.exact.local import ExactField
from symasym.inputs import float_text, is_array
from symasym.scenes import (
    Request,
    as_digits,
    as_floats,
    exact_scene,
    float_scenes,
    one_scene,
    read_order,
)

__all__ = ["escape_time"]

DEFAULT_ORDER = 2
MOST_ORDER = 6
_TERMS = ("wells, barriers, start, ends, kinks and the part between",)
_DROPPED = ("higher orders of every series, in the error",)


class _Seen(NamedTuple):
    """One side of the start, with what meets in it."""

    half: Half
    folds: list[Fold]
    edge: Edge | None


def escape_time(
    drift: Drift, kappa: Any, r: Any, start: Any, request: Request, *, local: bool = False
) -> Any:
    """T to the order that `request` asks for; `local`: with the fold's own Airy functions."""
    order = 0 if local else read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    if local and request.order not in (None, 0):
        raise InputError(
            f"order is {request.order!r}, but method 'local' is of order 0; leave it out, or use "
            "method='uniform'."
        )
    numbers = {"kappa": kappa, "r": r, "start": start}
    request = request._replace(order=order)
    if request.dps is None and not one_scene(drift, numbers):
        return _of_arrays(drift, numbers, request, local)
    values = exact_scene(drift, numbers, request.dps)
    lam = 2 / values["kappa"] ** 2
    digits = request.digits
    with _analysed(drift, values["r"], values["start"], lam, order, digits, local) as scene:
        value, size = _estimate(scene, lam, order, float_text(values["kappa"]))
        if request.log:
            size = _log_error(value, size, scene.context)
            value = scene.context.log(value)
        size += abs(value) * scene.context.mpf(10) ** -(digits + 5)
        names = _names(scene.sides, scene.context)
        return as_digits(request, value, size, "estimate", names, _DROPPED)


def _of_arrays(drift: Drift, numbers: dict[str, Any], request: Request, local: bool) -> Any:
    """One analysis for each drift, radius and start; each kappa is then a few sums."""
    scenes = float_scenes(drift, numbers)
    given = {name: x for name, x in scenes.parameters.items() if is_array(x)}
    keys = np.array([*given.values(), scenes.numbers["r"], scenes.numbers["start"]]).T
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    logs, errors = np.empty(len(scenes.lam)), np.empty(len(scenes.lam))
    for k, key in enumerate(unique.tolist()):
        one = drift.bind(**dict(zip(given, key, strict=False))) if given else drift
        rows = np.flatnonzero(group.ravel() == k)
        lam = 2 / Fraction(float(scenes.numbers["kappa"][rows].min())) ** 2
        place = Fraction(key[-2]), Fraction(key[-1])
        with _analysed(one, *place, lam, request.order, request.digits, local) as scene:
            for row in rows.tolist():
                kappa = Fraction(float(scenes.numbers["kappa"][row]))
                value, size = _estimate(scene, 2 / kappa**2, request.order, float_text(kappa))
                logs[row] = float(scene.context.log(value))
                errors[row] = float(_log_error(value, size, scene.context))
    errors += 4e-16 * (1 + np.abs(logs)) + rounding_of_places(drift, scenes)
    return as_floats(request, scenes.shape, logs, errors, "estimate", _TERMS, _DROPPED)


class _Scene(NamedTuple):
    """A drift, radius and start, seen to both sides."""

    context: Any
    sides: list[_Seen]
    radius: Any
    local: bool


@contextmanager
def _analysed(
    drift: Drift, r: Fraction, x: Fraction, lam: Fraction, order: int, digits: int, local: bool
) -> Iterator[_Scene]:
    """For any lam up to this one, to `order` and what tells its error."""
    base = working_digits(digits, lam, r)
    extra, offset = _lost(drift, order, base)
    with own_context(base + extra) as context:
        sides = [
            _seen(ExactField(drift, mirrored, context, offset), place, r, order, base, context)
            for mirrored, place in ((True, -x), (False, x))
        ]
        signs = (-1, 1)
        folds = [
            sign * float(f.point) for sign, s in zip(signs, sides, strict=True) for f in s.folds
        ]
        require_seen(drift, lam, folds)
        yield _Scene(context, sides, context.mpf(r.numerator) / r.denominator, local)


def _estimate(scene: _Scene, lam: Fraction, order: int, kappa: str) -> tuple[Any, Any]:
    """T and its error, from what the next orders add, or the least of lower ones."""
    context, number = scene.context, scene.context.mpf(lam.numerator) / lam.denominator
    found = [_time(scene, number, n) for n in range(order + 1 + BEYOND)]
    value, size = found[order], context.inf
    for n in range(order + 1):
        near, far = (abs(found[n + k + 1] - found[n + k]) for k in range(BEYOND))
        # Twice what the next two orders add, and as many more as long as they hardly fall.
        fall = min(far / near, context.mpf(3) / 4) if near else context.mpf(3) / 4
        # A lower order may be known better, where noise is strong.
        size = min(size, 2 * (near + far) / (1 - fall) + abs(value - found[n]))
    if not (value > 0 and size < value):
        raise AccuracyError(
            f"kappa is {kappa}, where the noise is too strong for the uniform series with "
            f"order={order}: the next terms are as large as the value; give another order, or use "
            "method='exact'."
        )
    if scene.local:
        straight = scene._replace(sides=[_straightened(side, context) for side in scene.sides])
        local = _time(straight, number, 0)
        # Away from the fold that may be off by more than itself.
        return local, size + abs(local - value)
    return value, size


def _log_error(value: Any, size: Any, context: Any) -> Any:
    return -context.log1p(-size / value) if size < value else context.inf


def _straightened(side: _Seen, context: Any) -> _Seen:
    """phi taken as a parabola about each fold: Airy's argument is linear in its height there."""
    return side._replace(folds=[parabola(fold, context) for fold in side.folds])


def _names(sides: list[_Seen], context: Any) -> tuple[str, ...]:
    found = []
    for sign, side in zip((-1, 1), sides, strict=True):
        for fold in side.folds:
            at = sign * (context.mpf(fold.point.numerator) / fold.point.denominator)
            found.append(f"well and barrier about u = {context.nstr(at, 6)}")
        if side.edge is not None:
            found.append(f"barrier before u = {sign}")
    return (*found, *_TERMS)


# -- what meets ------------------------------------------------------------------------------------


def _lost(drift: Drift, order: int, digits: int) -> tuple[int, Fraction]:
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


def _seen(
    field: ExactField, x: Fraction, r: Fraction, order: int, digits: int, context: Any
) -> _Seen:
    one = half(field, x, r, order, context, context.dps)
    count = order + 1 + BEYOND
    lo, hi = max(x, Fraction(-1)), min(r, Fraction(1))
    folds = []
    if lo < hi:
        for point in turning_points(field, lo, hi, context):
            fold = _fold(field, point, x, lo, count, one, digits, context)
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
    digits: int,
    context: Any,
) -> Fold | None:
    """The pair about this zero of phi's slope, if it is one by itself."""
    taylor = [context.mpf(c.numerator) / c.denominator for c in _taylor(field, point, count)]
    try:
        pair = split_pair(taylor, context)
        height = _height(field, point, x, lo, context)
        fold = fold_of(pair, taylor, point, height, count, digits, context)
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


# -- at one lam ------------------------------------------------------------------------------------


def _time(scene: _Scene, lam: Any, order: int) -> Any:
    context, ops = scene.context, Exponentials(scene.context)
    left, right = (_side(one, lam, scene.radius, order, ops, context) for one in scene.sides)
    rising = left.rising.value + right.rising.value
    falling = left.falling.value + right.falling.value
    corner = scene.sides[0].half.start.corner
    whole = Sides(left, right, Value(rising, 0), Value(falling, 0), corner)
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
    end = next(
        x
        for x in rising
        if getattr(x[3], "kind", "") in ("end", "kink") and x[3].height == edge.end
    )
    height = context.exp(lam * edge.end)
    rising.append([end[0], found.rising * height, 0, None])
    for down in falling:
        if getattr(down[2], "kind", "") == "kink" and down[0] == end[0]:
            down[1] += found.falling / height
    return found.nested
