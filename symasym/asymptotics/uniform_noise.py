"""Weak noise through the coalescence of wells, barriers and ends: T by uniform approximation.

Laplace's sums (`symasym.asymptotics.weak_noise`) with the places that may meet taken
together (`symasym.asymptotics.coalescence`): a well and the barrier next to it, also past the
fold where they are a complex pair, and a barrier before the end of the layer. Their own
series stay below the sum, in the places and in the outer part; the singular terms cancel there,
for which digits are added beforehand, so that nothing is lost beside a coalescence.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.coalescence import (
    Fold,
    airy,
    parabola,
)
from symasym.asymptotics.cuts import Corrections, Cut, Cuts, corrections, cuts_at, cuts_of
from symasym.asymptotics.local_double import escape_time as in_float
from symasym.asymptotics.meetings import (
    Seen,
    Stretch,
    folds_of,
    lost_digits,
    place_at,
    seen,
    zeros_of,
)
from symasym.asymptotics.meetings_double import found_of
from symasym.asymptotics.order_zero import scene_of
from symasym.asymptotics.place_sums import (
    Exponentials,
    Pair,
    Side,
    Sides,
    outer_part,
    series_of,
    time_of,
    weights_of,
)
from symasym.asymptotics.places import BEYOND, Place, barriers, whole
from symasym.asymptotics.weak_noise import require_seen, working_digits
from symasym.asymptotics.weak_noise_arrays import logs_of, rounding_of_places
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError, InputError
from symasym.exact.fields import IntArray
from symasym.exact.local import ExactField
from symasym.inputs import FloatArray, float_text, is_array
from symasym.scenes import (
    Request,
    Scenes,
    as_digits,
    as_floats,
    exact_scene,
    float_scenes,
    one_scene,
    read_order,
    rows_of,
)

__all__ = ["escape_time", "occupation"]

DEFAULT_ORDER = 2
MOST_ORDER = 6
# Of lam, where the next terms are looked at.
_BESIDE = (1, 0.8, 0.64)
_TERMS = ("wells, barriers, start, ends, kinks and the part between",)
_DROPPED = ("higher orders of every series, in the error",)


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
    if order == 0 and not local:
        found = _closed(drift, values, request)
        if found is not None:
            return found
    lam = 2 / values["kappa"] ** 2
    with _analysed(drift, values["r"], values["start"], lam, order, request.digits, local) as scene:
        value, size = _estimate(scene, lam, order, float_text(values["kappa"]))
        return _handed(request, value, size, _names(scene.sides, scene.context), scene.context)


def _closed(drift: Drift, values: dict[str, Fraction], request: Request) -> Any:
    """Order 0 by closed forms; None where they don't tell."""
    r, lam = values["r"], 2 / values["kappa"] ** 2
    with own_context(working_digits(request.digits, lam, r) + 10) as context:
        scene = scene_of(drift, r, values["start"], context)
        found = scene and scene.time(context.mpf(lam.numerator) / lam.denominator)
        if scene is None or found is None:
            return None
        return _handed(request, *found, (*scene.names, *_TERMS), context)


def _handed(request: Request, value: Any, size: Any, names: tuple[str, ...], context: Any) -> Any:
    if request.log:
        size = _log_error(value, size, context)
        value = context.log(value)
    size += abs(value) * context.mpf(10) ** -(request.digits + 5)
    return as_digits(request, value, size, "estimate", names, _DROPPED)


def occupation(drift: Drift, kappa: Any, complement: bool, request: Request) -> Any:
    """1 - P, or P, of one sliding scene, through folds of wells inside the layer."""
    order = read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    request = request._replace(order=order)
    numbers = {"kappa": kappa}
    if request.dps is None and not one_scene(drift, numbers):
        raise InputError(
            "arrays have no uniform 1 - P; give one scene at a time, or use method='laplace'."
        )
    values = exact_scene(drift, numbers, request.dps)
    lam = 2 / values["kappa"] ** 2
    digits = request.digits
    base = working_digits(digits, lam, Fraction(1))
    one = Fraction(1)
    extra, offset = lost_digits(drift, order, base, one)
    with own_context(base + extra) as context:
        field = ExactField(drift, False, context, offset)
        places = whole(field, order, context)
        every = places + barriers(field, order, context)
        stretch = Stretch(field, -one, -one, one, (-one, one), base, context)
        folds = folds_of(stretch, order, every)
        require_seen(drift, lam, [float(f.point) for f in folds])
        slopes = [abs(field.number(context.mpf(side))) for side in (-1, 1)]
        heights = places[0].height, places[-1].height
        zeros = [p for p in every if p.kind in ("well", "barrier")]
        left, right = (
            cuts_at(field, side * one, -height, zeros, order, base, context)
            for side, height in zip((-1, 1), heights, strict=True)
        )

        def share(number: Any, n: int) -> Any:
            total, met = _whole(places, folds, number, n, context)
            for sign, cuts in ((1, right), (-1, left)):
                total += sign * _corrected(cuts, met, number, n, context).falling
            outside = sum(
                context.exp(number * h) / (number * a) for a, h in zip(slopes, heights, strict=True)
            )
            return outside / total

        number = context.mpf(lam.numerator) / lam.denominator
        folds, cut = _apart(folds, number, context)
        value, size = _with_error(share, number, order, float_text(values["kappa"]), context)
        size += 10 * cut * value
        if not size < (value if complement else 1 - value):
            raise _too_strong(float_text(values["kappa"]), order)
        if not complement:
            value = 1 - value
        if request.log:
            size = _log_error(value, size, context)
            value = context.log(value)
        size += abs(value) * context.mpf(10) ** -(digits + 5)
        wells = [f"well at u = {context.nstr(p.u, 6)}" for p in places if p.kind == "well"]
        return as_digits(request, value, size, "estimate", (*wells, "folds and kinks"), _DROPPED)


def _whole(
    places: list[Place], folds: list[Fold], lam: Any, order: int, context: Any
) -> tuple[Any, list[_Met]]:
    """int e^{-lam V} over all u, with Laplace's series at the kinks, and the wells of pairs."""
    ops, left_out = Exponentials(context), []
    total, met = context.zero, []
    for fold in folds:
        value = airy(fold, lam, order, context).falling * context.exp(-lam * fold.height)
        total += value
        if fold.pair.zeta > 0:
            own = [p for u in zeros_of(fold, context) if (p := place_at(u, places))]
            met += [_Met(p.u, value) for p in own]
            left_out += own
    for place in places:
        if not any(place is p for p in left_out):
            factor = context.exp(lam * place.height)
            total += series_of(place.groups, lam, order, ops).value * factor
    return total, met


def _of_arrays(drift: Drift, numbers: dict[str, Any], request: Request, local: bool) -> Any:
    """Order 0 of polynomials in float64 where that is enough; the others one by one."""
    scenes = float_scenes(drift, numbers)
    if request.order == 0 and not local:
        shapes = [np.shape(x) for x in (*drift.values.values(), numbers["start"]) if is_array(x)]
        if is_array(numbers["r"]) and (scenes.numbers["r"] <= 1).any():
            shapes.append(np.shape(numbers["r"]))
        logs, errors = logs_of(
            drift, scenes, shapes, (0,), in_float, None, request.full, found_of, smooth=True
        )
    else:
        logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    rest = np.flatnonzero(~(errors < np.inf))
    if rest.size:
        logs[rest], errors[rest] = _one_by_one(drift, scenes, rest, request, local)
    return as_floats(request, scenes.shape, logs, errors, "estimate", _TERMS, _DROPPED)


def _one_by_one(
    drift: Drift, scenes: Scenes, rest: IntArray, request: Request, local: bool
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift, radius and start; each kappa is then a few sums."""
    given = {name: x[rest] for name, x in scenes.parameters.items() if is_array(x)}
    some = rows_of(scenes, rest)
    keys = np.array([*given.values(), some.numbers["r"], some.numbers["start"]]).T
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    logs, errors = np.empty(len(rest)), np.empty(len(rest))
    for k, key in enumerate(unique.tolist()):
        one = drift.bind(**dict(zip(given, key, strict=False))) if given else drift
        rows = np.flatnonzero(group.ravel() == k)
        lam = 2 / Fraction(float(some.numbers["kappa"][rows].min())) ** 2
        place = Fraction(key[-2]), Fraction(key[-1])
        with _analysed(one, *place, lam, request.order, request.digits, local) as scene:
            for row in rows.tolist():
                kappa = Fraction(float(some.numbers["kappa"][row]))
                value, size = _estimate(scene, 2 / kappa**2, request.order, float_text(kappa))
                logs[row] = float(scene.context.log(value))
                errors[row] = float(_log_error(value, size, scene.context))
    errors += 4e-16 * (1 + np.abs(logs)) + _rounding(drift, scenes)[rest]
    return logs, errors


def _rounding(drift: Drift, scenes: Scenes) -> FloatArray:
    found: FloatArray = np.zeros(len(scenes.lam)) + rounding_of_places(drift, scenes)
    return found


class _Scene(NamedTuple):
    """A drift, radius and start, seen to both sides."""

    context: Any
    sides: list[Seen]
    cuts: Cuts
    radius: Any
    local: bool


@contextmanager
def _analysed(
    drift: Drift, r: Fraction, x: Fraction, lam: Fraction, order: int, digits: int, local: bool
) -> Iterator[_Scene]:
    """For any lam up to this one, to `order` and what tells its error."""
    base = working_digits(digits, lam, r)
    x = _beside_zero(drift, x, base)
    extra, offset = lost_digits(drift, order, base, x)
    with own_context(base + extra) as context:
        left, right = (ExactField(drift, mirrored, context, offset) for mirrored in (True, False))
        sides = seen((left, right), x, r, order, base, context)
        cuts = cuts_of(right, (sides[0].half, sides[1].half), x, r, order, base, context)
        signs = (-1, 1)
        folds = [
            sign * float(f.point) for sign, s in zip(signs, sides, strict=True) for f in s.folds
        ]
        require_seen(drift, lam, folds)
        yield _Scene(context, sides, cuts, context.mpf(r.numerator) / r.denominator, local)


def _beside_zero(drift: Drift, x: Fraction, digits: int) -> Fraction:
    """The start, moved by less than the digits can tell if it is a zero of a polynomial A.

    Of other A it stays there: so many more digits of them would take minutes.
    """
    known = drift.exact_coefficients()
    if known is None or abs(x) > 1 or sum((c * x**k for k, c in enumerate(known)), Fraction(0)):
        return x
    move = Fraction(1, 10 ** (digits + 10))
    return x - move if x > 0 else x + move


def _estimate(scene: _Scene, lam: Fraction, order: int, kappa: str) -> tuple[Any, Any]:
    """T and its error; that of `local` is its distance from the uniform formula as well."""
    context, number = scene.context, scene.context.mpf(lam.numerator) / lam.denominator
    sides, cut = [], []
    for side in scene.sides:
        folds, cost = _apart(side.folds, number, context)
        sides.append(side._replace(folds=folds))
        cut.append(cost)
    scene = scene._replace(sides=sides)
    value, size = _with_error(partial(_time, scene), number, order, kappa, context)
    size += 10 * max(cut) * value
    if not size < value:
        raise _too_strong(kappa, order)
    if scene.local:
        straight = scene._replace(sides=[_straightened(side, context) for side in scene.sides])
        local = _time(straight, number, 0)
        # Away from the fold that may be off by more than itself.
        return local, size + abs(local - value)
    return value, size


def _apart(folds: list[Fold], lam: Any, context: Any) -> tuple[list[Fold], Any]:
    """Without complex pairs that the start or an end cuts through, and what either way costs.

    Airy functions take a pair's integrals over all of the line. Where the pair is far from the
    real line its own exponentials are small, and the outer part has all that counts.
    """
    kept, cost = [], context.zero
    for fold in folds:
        if fold.pair.zeta < 0:
            inside = context.exp(-lam * fold.room)
            outside = context.exp(-lam * 4 * (-fold.pair.zeta) ** context.mpf(1.5) / 3)
            cost = max(cost, min(inside, outside))
            if outside < inside:
                continue
        kept.append(fold)
    return kept, cost


def _with_error(
    at: Callable[[Any, int], Any], lam: Any, order: int, kappa: str, context: Any
) -> tuple[Any, Any]:
    """A value of (lam, order) and its error, from what the next orders add."""
    # The next terms may vanish by chance, but not at several lam.
    rows = [[at(lam * s, n) for n in range(order + 1 + BEYOND)] for s in _BESIDE]
    value, size = rows[0][order], context.inf
    for n in range(order + 1):
        relative = max(
            _next_terms(row, n, context) * step ** (n + 1)
            for row, step in zip(rows, _BESIDE, strict=True)
        )
        # A lower order may be known better, where noise is strong.
        size = min(size, relative * value + abs(value - rows[0][n]))
    if not (value > 0 and size < value):
        raise _too_strong(kappa, order)
    return value, size


def _too_strong(kappa: str, order: int) -> AccuracyError:
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong for the uniform series with "
        f"order={order}: the next terms are as large as the value; give another order, or use "
        "method='exact'."
    )


def _next_terms(found: list[Any], n: int, context: Any) -> Any:
    """What order n leaves out, of the value: five times the next two, more if they hardly fall."""
    near, far = (abs(found[n + k + 1] - found[n + k]) for k in range(BEYOND))
    fall = min(far / near, context.mpf(3) / 4) if near else context.mpf(3) / 4
    # Five, for scenes where fold and end meet: the error of the composite is in no next term.
    return 5 * (near + far) / (1 - fall) / abs(found[n])


def _log_error(value: Any, size: Any, context: Any) -> Any:
    return -context.log1p(-size / value) if size < value else context.inf


def _straightened(side: Seen, context: Any) -> Seen:
    """phi taken as a parabola about each fold: Airy's argument is linear in its height there."""
    return side._replace(folds=[parabola(fold, context) for fold in side.folds])


def _names(sides: list[Seen], context: Any) -> tuple[str, ...]:
    found = []
    for sign, side in zip((-1, 1), sides, strict=True):
        for fold in side.folds:
            at = sign * (context.mpf(fold.point.numerator) / fold.point.denominator)
            found.append(f"well and barrier about u = {context.nstr(at, 6)}")
    return (*found, *_TERMS)


# -- at one lam ------------------------------------------------------------------------------------


@dataclass
class _Share:
    """A place's value at one lam; `u` is None for the end at r, `place` for what has no series."""

    u: Any
    value: Any
    onward: Any
    place: Place | None


class _Sum:
    """One side of the start at one lam: its places' shares, and what is known of their pairs."""

    def __init__(self, side: Seen, lam: Any, r: Any, order: int, ops: Any) -> None:
        self.half = side.half
        self.rising, self.falling = (
            [_Share(place.u, share.value, onward.value, place) for place, share, onward in found]
            for found in weights_of(side.half, lam, r, order, ops)
        )
        self.nested = outer_part(side.half, lam, r, order, ops).value
        self.starts = [series_of(g, lam, order, ops).value for g in side.half.start[:2]]

    def all(self) -> list[_Share]:
        return self.rising + self.falling

    def nearest(self) -> _Share | None:
        """The well or barrier next to the start."""
        zeros = [x for x in self.all() if x.place and x.place.kind in ("well", "barrier")]
        return min(zeros, key=lambda x: x.u, default=None)

    def cut(self, near: Corrections, start: Corrections, far: Corrections, sign: int) -> None:
        """Corrections at the start and at the ends of the layer; `sign` is -1 in the mirror."""
        kinks = [x.u for x in self.rising if x.place and x.place.kind in ("end", "kink")]
        ends = sorted(u for u in kinks if u is not None)
        if not ends:
            return
        self.starts[0] += sign * start.rising
        self.starts[1] -= sign * start.falling
        # From a start beyond the layer both of its ends are seen.
        at_ends = [(ends[0], near, 1), (ends[-1], far, -1)][-len(ends) :]
        self.nested += far.outer - (start.outer if len(ends) == 1 else near.outer)
        for u, found, after in at_ends:
            for up in self.rising:
                if up.u == u and up.place is not None:
                    up.value += sign * after * found.rising
                    if after > 0:
                        up.onward += sign * found.rising
            for down in self.falling:
                if down.u == u:
                    down.value -= sign * after * found.falling

    def side(self) -> Side:
        for down in self.falling:
            for up in self.rising:
                if up.u is None or up.u > down.u:
                    self.nested += down.value * up.value
                elif up.u == down.u:
                    self.nested += down.value * up.onward
        scale = sum((up.value for up in self.rising), 0 * self.nested)
        return Side(Pair(scale, 0), Pair(self.nested, 0), *(Pair(x, 0) for x in self.starts))


def _time(scene: _Scene, lam: Any, order: int) -> Any:
    context, ops = scene.context, Exponentials(scene.context)
    sums = [_Sum(one, lam, scene.radius, order, ops) for one in scene.sides]
    met: list[_Met] = []
    for k, one in enumerate(scene.sides):
        for fold in one.folds:
            met += _meet(fold, k, sums, lam, order, context)
    left, start, right = (
        _corrected(cuts, met, lam, order, context)
        for cuts in (scene.cuts.left, scene.cuts.start, scene.cuts.right)
    )
    sums[0].cut(right, start, left, -1)
    sums[1].cut(left, start, right, 1)
    one, two = (part.side() for part in sums)
    rising, falling = one.rising.value + two.rising.value, one.falling.value + two.falling.value
    corner = scene.sides[0].half.start.corner
    whole = Sides(one, two, Pair(rising, 0), Pair(falling, 0), corner)
    return time_of(whole, lam).value


class _Met(NamedTuple):
    """A well or barrier of a pair, and the share that the sums take for it."""

    u: Any
    value: Any


def _meet(fold: Fold, k: int, sums: list[_Sum], lam: Any, order: int, context: Any) -> list[_Met]:
    """Take the pair, seen from side k, together; returns its members."""
    local, height, own = airy(fold, lam, order, context), context.exp(lam * fold.height), sums[k]
    for n, share in enumerate(fold.share[: order + 1]):
        own.nested -= share * lam ** -(n + 1)
    if fold.pair.zeta < 0:
        middle = context.mpf(fold.point.numerator) / fold.point.denominator
        own.rising.append(_Share(middle, local.rising * height, context.zero, None))
        own.falling.append(_Share(middle, local.falling / height, context.zero, None))
        own.nested += local.both if fold.onward else context.zero
        return []
    low, high = (_found(u, k, sums) for u in zeros_of(fold, context))
    (well_side, well), (barrier_side, barrier) = (low, high) if fold.onward else (high, low)
    barrier.value, well.value = local.rising * height, local.falling / height
    gain = local.both - barrier.value * well.value
    if well_side != barrier_side:
        sums[barrier_side].nested += gain * _beyond(well, barrier, lam, context)
    elif barrier.u > well.u:
        behind, part = sums[1 - well_side].nearest(), context.one
        if sums[well_side].nearest() is well:
            part -= _beyond(well, behind, lam, context)
        sums[well_side].nested += gain * part
    members = ((well_side, well), (barrier_side, barrier))
    return [_Met(x.u if side else -x.u, x.value) for side, x in members]


def _found(u: Any, k: int, sums: list[_Sum]) -> tuple[int, _Share]:
    """The share of the well or barrier at `u` seen from side k, and the side where it is."""
    for side, at in ((k, u), (1 - k, -u)):
        place = place_at(at, [x.place for x in sums[side].all() if x.place is not None])
        if place is not None:
            return side, next(x for x in sums[side].all() if x.place is place)
    raise AssertionError


def _beyond(well: _Share, top: _Share | None, lam: Any, context: Any) -> Any:
    """The part of a well's Gaussian at the other side of the start, next to it.

    What a pair has beyond the product of its members is lost as the start passes the well, and
    all of it when the start reaches the barrier behind, `top`.
    """
    assert well.place is not None
    depth = max(well.place.height, context.zero)
    if top is not None and top.place is not None:
        way = abs(top.place.height)
        depth *= (way + depth) / way
    return context.erfc(context.sqrt(lam * depth)) / 2


def _corrected(cuts: list[Cut], met: list[_Met], lam: Any, order: int, context: Any) -> Corrections:
    """Of all zeros that cut through one place."""
    found = [Corrections(*[context.zero] * 3)]
    for cut in cuts:
        share = None
        for member in met:
            if abs(member.u - cut.zero) <= context.eps**0.75:
                sign = -1 if cut.barrier else 1
                share = member.value * context.exp(sign * lam * cut.rise)
        found.append(corrections(cut, share, lam, order, context))
    return Corrections(*(sum(parts, context.zero) for parts in zip(*found, strict=True)))
