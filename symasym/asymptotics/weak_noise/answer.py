"""Weak noise: T, C and 1 - P as sums over wells, barriers, ends and the part between, by Laplace.

With S_R = int_x^r e^{lam V}, D_R = int_x^r e^{lam V(v)} int_x^v e^{-lam V(u)} du dv
and their mirror images S_L, D_L,

    T = lam (S_L D_R + S_R D_L)/(S_L + S_R),     C = S_R/(S_L + S_R).

S is a sum over places (`symasym.asymptotics.weak_noise.critical_points`), D one over pairs of
places, a place of e^{-lam V} left of one of e^{lam V}, and of the outer part. Nothing that is
exponentially small is left out; what is left out is, in every series, of higher order
in 1/lam, and the next two orders tell how much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise import compose_arrays
from symasym.asymptotics.weak_noise.arrays import Evaluate, logs_of, own_shapes
from symasym.asymptotics.weak_noise.compose import (
    Exponentials,
    FloatExponentials,
    Pair,
    Sides,
    outer_part,
    sides_of,
    time_of,
    weight_of,
    weights_of,
)
from symasym.asymptotics.weak_noise.critical_points import Half, Place, half, whole
from symasym.asymptotics.weak_noise.one_sided import sight_of
from symasym.asymptotics.weak_noise.optimal_order import Found, chosen, of_log
from symasym.asymptotics.weak_noise.resolution import unseen, unseen_in
from symasym.base.contexts import mpf_of, own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, exact, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.float_field import IntArray
from symasym.drift.scenes import Answer, Answers, Request, Scene, Scenes, by_drift
from symasym.drift.taylor_field import ExactField

# Relative error of arrays beyond which they are refused: log 2 of the logarithm.
_MOST_FLOAT = 0.4
# Exact values that cost as much as the analysis of one drift with more digits, 10 to 250 ms.
_WORTH = 4000
_BOUNDED = ("higher orders of every series, and what is exponentially small, in the bound",)
_DROPPED = ("higher orders of every series, in the error",)


class Quantity(NamedTuple):
    """What is asked for: from the sides and lam; its logarithm, where 1 - value is tiny.

    `outer` says whether it needs the double integrals.
    """

    value: Callable[[Sides, Any], Pair]
    log: Callable[[Sides, Any], Any] | None
    outer: bool
    in_float: Evaluate


#: Proved bounds at an order, or None.
Prove = Callable[[int], Any]


def of_scene(scene: Scene, request: Request, prove: Prove | None = None) -> Answer:
    """T, C or P, or a complement, to the request's order, any start; its error by `prove` if given.

    With several orders the one whose error is smallest is taken.
    """
    if request.name[-1] == "P":
        return _occupation(scene, request, prove)
    return _answer(scene, request, prove)


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same for many scenes in float64: one analysis for each drift and start."""
    orders = _orders(request)
    if request.name[-1] == "P":
        logs, errors = _occupation_logs(scenes.drift, scenes, request.complement, orders)
        terms = ("wells and kinks",)
    else:
        start, quantity = scenes.given["start"], _QUANTITIES[request.name]
        shapes = own_shapes(scenes.drift, scenes.given, scenes)
        exactly = None if is_array(start) else exact("start", start)
        logs, errors = _array_logs(
            scenes.drift, scenes, shapes, orders, quantity, request.full, exactly
        )
        terms = ("wells, barriers, start, ends, kinks and the part between",)
    _require_small(scenes.numbers["kappa"], logs, errors, orders[-1], request.log)
    return Answers(logs, errors, "estimate", terms, _DROPPED)


def _orders(request: Request) -> Sequence[int]:
    return request.order if isinstance(request.order, range) else (request.order,)


def _occupation(scene: Scene, request: Request, prove: Prove | None) -> Answer:
    """1 - P = int_{|u| > 1} e^{-lam V}/int e^{-lam V}, or P; sliding only."""
    drift, lam, complement = scene.drift, scene.lam, request.complement
    orders = _orders(request)
    order = orders[-1]
    digits = request.digits
    require_seen(drift, lam)
    with own_context(digits + 2 * len(str(int(lam + 1))) + 20) as context:
        stationary = _stationary(drift, order, context)
        number = mpf_of(lam, context)
        found = []
        for n in orders:
            outside, total = _outside(stationary, number, n, Exponentials(context))
            share = outside / total.value
            error = 2 * share * total.error / total.value
            sure = error < share and (complement or error < 1 - share)
            found.append(Found(share, error, n, bool(sure)))
        taken = chosen(found, prove, request.full, context)
        if taken is None:
            raise _too_strong(scene.noise, order)
        (share, error, order, _), kind = taken
        value = share if complement else 1 - share
        if not error < value:
            raise _too_strong(scene.noise, order)
        if request.log:
            error = of_log(error / value, kind, context)
            value = context.log(share) if complement else context.log1p(-share)
        error += abs(value) * context.mpf(10) ** -(digits + 5)
        dropped = _BOUNDED if kind == "bound" else _DROPPED
        return Answer(value, error, kind, stationary.terms, dropped, order)


class _Stationary(NamedTuple):
    """Places of int e^{-lam V}, what lies outside (slopes and V there), and their description."""

    places: list[Place]
    outside: tuple[tuple[Any, Any], tuple[Any, Any]]
    terms: tuple[str, ...]


def _stationary(drift: Drift, order: int, context: Any) -> _Stationary:
    field = ExactField(drift, False, context)
    places = whole(field, order, context)
    slopes = [abs(field.value(Fraction(side))) for side in (-1, 1)]
    heights = places[0].height, places[-1].height
    ends = tuple((mpf_of(s, context), h) for s, h in zip(slopes, heights, strict=True))
    wells = [f"well at u = {context.nstr(p.u, 6)}" for p in places if p.kind == "well"]
    return _Stationary(places, (ends[0], ends[1]), (*wells, "kinks"))


def _outside(found: _Stationary, lam: Any, order: int, ops: Any) -> tuple[Any, Pair]:
    """int e^{-lam V} over |u| > 1, and over all u."""
    unit = ops.exp(0 * lam)
    total = Pair(0 * unit, 0 * unit)
    for place in found.places:
        total = total + weight_of(place, lam, order, ops)[0]
    outside = 0 * unit
    for slope, height in found.outside:
        outside = outside + ops.exp(lam * ops.number(height)) * (1 / (lam * ops.number(slope)))
    return outside, total


def _probability(complement: bool) -> Quantity:
    def split(sides: Sides) -> tuple[Any, Any]:
        shares = [side.scale.value + side.rising.value for side in (sides.left, sides.right)]
        return (shares[0], shares[1]) if complement else (shares[1], shares[0])

    def value(sides: Sides, lam: Any) -> Pair:
        part, rest = (sides.left, sides.right) if complement else (sides.right, sides.left)
        total = sides.total()
        share, other = (x / total for x in split(sides))
        error = abs(other) * part.scale.error + abs(share) * rest.scale.error
        error = error + part.rising.error + sides.rising.error
        return Pair(share, error / total)

    def logarithm(sides: Sides, ops: Any) -> Any:
        part, rest = split(sides)
        return -ops.log1p(rest / part)

    in_float = partial(compose_arrays.exit_probability, complement)
    return Quantity(value, logarithm, False, in_float)


_QUANTITIES = {
    "T": Quantity(time_of, None, True, compose_arrays.escape_time),
    "C": _probability(False),
    "1 - C": _probability(True),
}


def _answer(scene: Scene, request: Request, prove: Prove | None) -> Answer:
    """T, C or 1 - C of one scene."""
    quantity, orders = _QUANTITIES[request.name], _orders(request)
    drift, lam, values, digits = scene.drift, scene.lam, scene.numbers, request.digits
    order = orders[-1]
    require_seen(drift, lam)
    near = digits_lost(values["r"], values["start"])
    with own_context(working_digits(digits, lam, values["r"]) + near) as context:
        outer = (digits + 15 + near) * quantity.outer
        halves = _halves(drift, values["r"], values["start"], order, context, outer)
        number = mpf_of(lam, context)
        ops, tried = Exponentials(context), {}
        found = []
        for n in orders:
            tried[n] = sides = sides_of(halves, number, values["r"], n, ops)
            value, error = quantity.value(sides, number)
            sure = sides.sure() and error < value / 2
            found.append(Found(value, 2 * error, n, bool(sure)))
        taken = chosen(found, prove, request.full, context)
        if taken is None:
            raise _too_strong(scene.noise, order)
        (value, size, order, _), kind = taken
        if request.log:
            log = quantity.log(tried[order], ops) if quantity.log else None
            size = of_log(size / value, kind, context)
            value = context.log(value) if log is None else log
        size += abs(value) * context.mpf(10) ** -(digits + 5)
        dropped = _BOUNDED if kind == "bound" else _DROPPED
        return Answer(value, size, kind, _terms(halves, context), dropped, order)


class Parts(NamedTuple):
    """T as a sum: names, shares and their errors; `error` is relative to the total."""

    items: list[tuple[str, Any, Any]]
    total: Any
    error: Any
    order: int


def parts(scene: Scene, digits: int, orders: range, allowed: Fraction) -> Parts:
    """T in parts, to the first of `orders` whose stated error is small enough, or the best."""
    drift, lam, values = scene.drift, scene.lam, scene.numbers
    require_seen(drift, lam)
    near = digits_lost(values["r"], values["start"])
    with own_context(working_digits(digits, lam, values["r"]) + near) as context:
        ops, number = Exponentials(context), mpf_of(lam, context)
        # No more digits of the outer part than its share of what is allowed.
        outer = len(str(int(1 / allowed))) + 12 + near
        halves = _halves(drift, values["r"], values["start"], orders[-1], context, outer)
        best: Parts | None = None
        for n in orders:
            sides = sides_of(halves, number, values["r"], n, ops)
            total = time_of(sides, number)
            if not (sides.sure() and total.error < total.value / 2):
                continue
            error = 2 * total.error / total.value
            if best is None or error < best.error:
                items = _items(halves, sides, number, values["r"], n, ops)
                best = Parts(items, total.value, error, n)
            if error <= mpf_of(allowed, context):
                break
    if best is None:
        raise _too_strong(float_text(values["kappa"]), orders[-1])
    return best


def _items(
    halves: tuple[Half, Half], sides: Sides, lam: Any, r: Any, order: int, ops: Any
) -> list[tuple[str, Any, Any]]:
    """Every pair of places and the outer part of both sides, times the chance to be there."""
    total, found = sides.total(), []
    shares = [side.scale.value + side.rising.value for side in (sides.left, sides.right)]
    rest = time_of(sides, lam).value
    for k, one in enumerate(halves):
        front = lam * shares[1 - k] / total
        sign = 2 * k - 1
        chance = "" if k else "C times "
        rising, falling = weights_of(one, lam, r, order, ops)
        for low, weight, _ in falling:
            for high, share, onward in rising:
                if high.u is None or high.u >= low.u:
                    pair = weight * (onward if high.u == low.u else share)
                    name = f"{chance}{_named(low, sign, r)} with {_named(high, sign, r)}"
                    found.append((name, front * pair.value, front * pair.error))
        outer = outer_part(one, lam, r, order, ops)
        where = f"{chance}the part between, {'right' if k else 'left'}"
        found.append((where, front * outer.value, front * outer.error))
    rest -= sum(value for _, value, _ in found)
    found.append(("the start's own share", rest, 0 * rest))
    return found


def _named(place: Place, sign: int, r: Any) -> str:
    return f"{place.kind} at {sign * float(r if place.u is None else place.u):.4g}"


def working_digits(digits: int, lam: Fraction, r: Fraction) -> int:
    """Digits that leave `digits` right in e^{lam V}."""
    return digits + 2 * len(str(int(lam * (1 + r) + 1))) + 20


def digits_lost(r: Fraction, x: Fraction) -> int:
    """Digits that cancel where the way to an end is short: T is as small, its terms are not."""
    return len(str(int(max(r, Fraction(1)) / (r - abs(x))))) - 1


def require_seen(drift: Drift, lam: Fraction, folds: Sequence[float] = ()) -> None:
    """Raise AccuracyError where A bends faster than the noise can tell, but at the folds."""
    # Noise beyond the range of float64 is weak.
    if lam < 10**300 and unseen(drift, float(lam), folds):
        raise AccuracyError(
            f"kappa is {float(2 / lam) ** 0.5:.6g}, where the noise is too strong for a drift that "
            "bends this fast: no term of Laplace's method would tell its error; use "
            "method='exact' or 'strong_noise'."
        )


def _too_strong(kappa: str, order: int) -> AccuracyError:
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong, or a well, a barrier or the start too "
        f"close to another or to an end, for Laplace's method with order={order}: the next terms "
        "are as large as the value; give another order, or use method='exact'."
    )


def _halves(
    drift: Drift, r: Fraction, x: Fraction, order: int, context: Any, outer: int
) -> tuple[Half, Half]:
    """Left, mirrored, and right."""
    left = half(ExactField(drift, True, context), -x, r, order, context, outer)
    return left, half(ExactField(drift, False, context), x, r, order, context, outer)


def _terms(halves: tuple[Half, Half], context: Any) -> tuple[str, ...]:
    found = []
    for side, one in zip((-1, 1), halves, strict=True):
        for place in one.rising + one.falling:
            if place.kind in ("well", "barrier"):
                found.append(f"{place.kind} at u = {context.nstr(side * place.u, 6)}")
    return (*sorted(found), "start, ends, kinks and the part between")


# -- many scenes, in float64 -----------------------------------------------------------------------


def _array_logs(
    drift: Drift,
    scenes: Scenes,
    shapes: list[tuple[int, ...]],
    orders: Any,
    quantity: Quantity,
    everywhere: bool,
    exactly: Fraction | None = None,
    index: IntArray | None = None,
    many: bool = True,
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift and start; vectorised over these, kappa and r.

    A start that all scenes share is `exactly` that, since it may lie on a zero of A.
    """

    def analyse(given: dict[str, float], radius: float, start: float) -> Any:
        one = drift.bind(**given) if given else drift
        place = Fraction(start) if exactly is None else exactly
        outer = 30 * quantity.outer
        with own_context(40) as context:
            found = _halves(one, Fraction(radius), place, orders[-1], context, outer)
            return sight_of(found[0]), sight_of(found[1])

    with_digits = analyse if many else None
    logs, errors = logs_of(
        drift, scenes, shapes, orders, quantity.in_float, with_digits, everywhere, index=index
    )
    unknown = unseen_in(drift, scenes)
    return logs, np.where(unknown, np.inf, errors) if unknown.any() else errors


def array_logs(
    drift: Drift, scenes: Scenes, name: str, order: int, index: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Logarithms of T, C, 1 - C, P or 1 - P with their errors, infinite where nothing is known.

    Scenes of equal `index` have the drift, the start and a radius below 1 in common. A drift
    that needs more digits is left out unless it has many scenes.
    """
    worth = len(index) >= _WORTH * len(np.unique(index))
    if name in _QUANTITIES:
        quantity = _QUANTITIES[name]
        return _array_logs(drift, scenes, [], (order,), quantity, True, index=index, many=worth)
    if not worth:
        return np.full(len(index), np.nan), np.full(len(index), np.inf)
    return _occupation_logs(drift, scenes, name == "1 - P", (order,))


def _require_small(
    kappa: FloatArray, logs: FloatArray, errors: FloatArray, order: int, log: bool
) -> None:
    if errors.max() <= np.log(2):
        return
    bad = np.flatnonzero(~(errors < np.inf))
    if bad.size:
        raise _too_strong(f"{kappa[bad[0]]:.6g}", order)
    # A logarithm of 1e15 is right to all its digits where it is wrong by 1.
    lost = np.flatnonzero(errors > np.maximum(np.log(2), 1e-11 * np.abs(logs) if log else 0.0))
    if lost.size:
        raise AccuracyError(
            f"kappa is {kappa[lost[0]]:.6g}, so small that the exponents of float64 leave no digit "
            "of the value; give dps=n and one scene at a time, or use method='exact'."
        )


def _occupation_logs(
    drift: Drift, scenes: Scenes, complement: bool, orders: Any
) -> tuple[FloatArray, FloatArray]:
    logs, errors = np.empty(len(scenes.lam)), np.full(len(scenes.lam), np.inf)
    ops = FloatExponentials()
    for one, rows in by_drift(scenes):
        with own_context(40) as context:
            found = _stationary(one, orders[-1], context)
        lam = scenes.lam[rows]
        top = max(abs(float(p.height)) for p in found.places)
        with np.errstate(all="ignore"):
            for n in orders:
                outside, total = _outside(found, lam, n, ops)
                relative = 2 * np.exp(total.error.log() - total.value.log())
                relative = np.where(relative < _MOST_FLOAT, relative, np.inf)
                share = outside.log() - total.value.log()
                relative = relative + 1e-14 * (8 + lam * top)
                if not complement:
                    # log(1 - share), and how it changes.
                    relative = relative * np.exp(share) / -np.expm1(share)
                    share = np.log1p(-np.exp(share))
                better = relative < errors[rows]
                logs[rows] = np.where(better, share, logs[rows])
                errors[rows] = np.where(better, relative, errors[rows])
    return logs, np.where(unseen_in(drift, scenes), np.inf, errors)
