"""Weak noise: T, C and 1 - P as sums over wells, barriers, ends and the part between, by Laplace.

With S_R = int_x^r e^{lam V}, D_R = int_x^r e^{lam V(v)} int_x^v e^{-lam V(u)} du dv
and their mirror images S_L, D_L,

    T = lam (S_L D_R + S_R D_L)/(S_L + S_R),     C = S_R/(S_L + S_R).

S is a sum over critical points (`symasym.asymptotics.weak_noise.critical_points`), D one over
pairs of them, one of e^{-lam V} left of one of e^{lam V}, and of the regular part. Nothing that is
exponentially small is left out; what is left out is, in every series, of higher order
in 1/lam, and the next two orders tell how much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.arrays import Evaluate, logs_of, own_shapes
from symasym.asymptotics.weak_noise.compose import (
    Composed,
    Nodes,
    Ring,
    pairs_of,
    regular_part,
    rising_of,
)
from symasym.asymptotics.weak_noise.critical_points import both_sides, float_point, in_float, whole
from symasym.asymptotics.weak_noise.evaluation import (
    DROPPED,
    AtOrder,
    chosen,
    escape_time,
    exit_probability,
    log_probability,
    of_log,
    plain,
    probability_with_digits,
    require_resolved,
    time_with_digits,
    unresolved_in,
)
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import Part, Point, Series, Sizes
from symasym.base.contexts import kept, mpf_of, own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, exact, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.field.float_field import IntArray
from symasym.drift.field.taylor_field import ExactField
from symasym.numbers.arithmetic import Digits
from symasym.scenes.answers import Answer, Answers, Request
from symasym.scenes.scene import Scene, Scenes, by_drift, working_digits

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

# Relative error of arrays beyond which they are refused: log 2 of the logarithm.
_MOST_FLOAT = 0.4


class Quantity(NamedTuple):
    """What is asked for: with digits, its logarithm where 1 - value is tiny, and in float64.

    `outer` says whether it needs the double integrals.
    """

    with_digits: Callable[[Composed, Point], AtOrder]
    log: Callable[[Composed, Point], Any] | None
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
    if request.errors == "raise":
        _require_small(scenes.numbers["kappa"], logs, errors, orders[-1], request.log)
    else:
        logs = np.where(_lost(logs, errors, request.log), np.nan, logs)
    return Answers(logs, errors, "estimate", terms, DROPPED)


def _orders(request: Request) -> Sequence[int]:
    """The orders among which the best is taken, ascending."""
    return request.order if isinstance(request.order, range) else (request.order,)


def _occupation(scene: Scene, request: Request, prove: Prove | None) -> Answer:
    """1 - P = int_{|u| > 1} e^{-lam V}/int e^{-lam V}, or P; sliding only."""
    drift, lam, complement = scene.drift, scene.lam, request.complement
    orders = _orders(request)
    order = orders[-1]
    digits = request.digits
    require_resolved(drift, lam)
    with own_context(digits + 2 * len(str(int(lam + 1))) + 20) as context:
        points, slopes, terms = _stationary(drift, order, context)
        arithmetic = Digits(context)
        number = arithmetic.number(lam)
        outside, whole_line = stationary_sums(points, slopes)
        expanded = []
        for n in orders:
            at = Point(number, n, True, None, arithmetic)
            total = at.value_of(whole_line)
            share = plain(outside / whole_line, at)[0]
            error = 2 * share * total.error / total.value
            sure = error < share and (complement or error < 1 - share)
            expanded.append(AtOrder(share, error, n, bool(sure)))
        taken = chosen(expanded, prove, request.full, context)
        if taken is None:
            raise _too_strong(scene.noise, order)
        (share, error, order, _), kind = taken.found, taken.kind
        value = share if complement else 1 - share
        if not error < value:
            raise _too_strong(scene.noise, order)
        if request.log:
            error = of_log(error / value, kind, context)
            value = context.log(share) if complement else context.log1p(-share)
        error += abs(value) * context.mpf(10) ** -(digits + 5)
        return Answer(value, error, kind, terms, taken.dropped(context), order)


def _stationary(
    drift: Drift, order: int, context: MPContext
) -> tuple[list[CriticalPoint], list[Any], tuple[str, ...]]:
    """Critical points of int e^{-lam V} over the line, |phi| outside, and their description."""
    field = ExactField(drift, False, context)
    points = whole(field, order, context)
    slopes = [mpf_of(abs(field.value(Fraction(side))), context) for side in (-1, 1)]
    wells = [f"well at u = {context.nstr(p.u, 6)}" for p in points if p.kind == "well"]
    return points, slopes, (*wells, "kinks")


def stationary_sums(
    points: list[CriticalPoint], slopes: list[Any], ring: Ring | None = None
) -> tuple[Any, Any]:
    """int e^{-lam V} over |u| > 1, and over all u; of nodes without a `ring`."""
    ring = Nodes() if ring is None else ring
    ends = zip((points[0].height, points[-1].height), slopes, strict=True)
    outside = [ring.leaf(height, Series([Part(1.0, 0, [1 / slope])])) for height, slope in ends]
    return ring.total(outside), ring.total([ring.leaf(p.height, p.series) for p in points])


def _probability(complement: bool) -> Quantity:
    """C, or with `complement` 1 - C, as a quantity (eq:C)."""
    value = partial(probability_with_digits, complement)
    log = partial(log_probability, complement)
    return Quantity(value, log, False, partial(exit_probability, complement))


_QUANTITIES = {
    "T": Quantity(time_with_digits, None, True, escape_time),
    "C": _probability(False),
    "1 - C": _probability(True),
}


def _answer(scene: Scene, request: Request, prove: Prove | None) -> Answer:
    """T, C or 1 - C of one scene."""
    quantity, orders = _QUANTITIES[request.name], _orders(request)
    drift, lam, values, digits = scene.drift, scene.lam, scene.numbers, request.digits
    order = orders[-1]
    require_resolved(drift, lam)
    near = digits_lost(values["r"], values["start"])
    outer = (digits + 15 + near) * quantity.outer
    dps = working_digits(digits, lam, values["r"]) + near
    context, both = _kept_halves(drift, values["r"], values["start"], order, dps, outer)
    composed, at = _with_digits(both, lam, values["r"], context)
    expanded = [quantity.with_digits(composed, at(n)) for n in orders]
    taken = chosen(expanded, prove, request.full, context)
    if taken is None:
        raise _too_strong(scene.noise, order)
    (value, size, order, _), kind = taken.found, taken.kind
    if request.log:
        log = quantity.log(composed, at(order)) if quantity.log else None
        size = of_log(size / value, kind, context)
        value = context.log(value) if log is None else log
    size += abs(value) * context.mpf(10) ** -(digits + 5)
    return Answer(value, size, kind, _terms(both, context), taken.dropped(context), order)


def _with_digits(
    both: tuple[OneSided, OneSided], lam: Fraction, r: Fraction, context: MPContext
) -> tuple[Composed, Callable[[int], Point]]:
    """The expressions of one scene, and its lam with the values at it, for every order."""
    arithmetic = Digits(context)
    composed = Composed(both, arithmetic.number(r), 64 * context.eps)
    number = arithmetic.number(lam)

    @cache
    def at(order: int) -> Point:
        return Point(number, order, True, None, arithmetic)

    return composed, at


class Parts(NamedTuple):
    """T as a sum: names, shares and their errors; `error` is relative to the total."""

    items: list[tuple[str, Any, Any]]
    total: Any
    error: Any
    order: int


def parts(scene: Scene, digits: int, orders: range, allowed: Fraction) -> Parts:
    """T in parts, to the first of `orders` whose stated error is small enough, or the best."""
    drift, lam, values = scene.drift, scene.lam, scene.numbers
    require_resolved(drift, lam)
    near = digits_lost(values["r"], values["start"])
    dps = working_digits(digits, lam, values["r"]) + near
    # No more digits of the regular part than its share of what is allowed.
    outer = len(str(int(1 / allowed))) + 12 + near
    context, both = _kept_halves(drift, values["r"], values["start"], orders[-1], dps, outer)
    composed, at = _with_digits(both, lam, values["r"], context)
    best: Parts | None = None
    for n in orders:
        total = time_with_digits(composed, at(n))
        if not total.sure:
            continue
        error = total.error / total.value
        if best is None or error < best.error:
            best = Parts(_items(both, composed, at(n)), total.value, error, n)
        if error <= mpf_of(allowed, context):
            break
    if best is None:
        raise _too_strong(float_text(values["kappa"]), orders[-1])
    return best


def _items(
    both: tuple[OneSided, OneSided], composed: Composed, at: Point
) -> list[tuple[str, Any, Any]]:
    """Every pair of critical points and the regular part of both sides, times the chance of it."""
    r, ring, items = composed.r, composed.ring, []
    shares = composed.sides.shares
    rest = time_with_digits(composed, at).value
    for k, one in enumerate(both):
        front = at.lam * plain(shares[1 - k] / composed.sides.total, at)[0]
        sign, chance = 2 * k - 1, "" if k else "C times "
        for low, high, pair in pairs_of(one, rising_of(one, r, ring), ring):
            value, error = plain(pair, at)
            name = f"{chance}{_named(low, sign, r)} with {_named(high, sign, r)}"
            items.append((name, front * value, front * error))
        value, error = plain(regular_part(one, r, ring), at)
        where = f"{chance}the part between, {'right' if k else 'left'}"
        items.append((where, front * value, front * error))
    rest -= sum(value for _, value, _ in items)
    items.append(("the start's own share", rest, 0 * rest))
    return items


def _named(point: CriticalPoint, sign: int, r: mpf) -> str:
    return f"{point.kind} at {sign * float(r if point.u is None else point.u):.4g}"


def digits_lost(r: Fraction, x: Fraction) -> int:
    """Digits that cancel where the way to an end is short: T is as small, its terms are not."""
    return len(str(int(max(r, Fraction(1)) / (r - abs(x))))) - 1


def _too_strong(kappa: str, order: int) -> AccuracyError:
    """The refusal of a scene whose truncation error is as large as its value."""
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong, or a well, a barrier or the start too "
        f"close to another or to an end, for Laplace's method with order={order}: the next terms "
        "are as large as the value; give another order, or use method='exact'."
    )


def _halves(
    drift: Drift, r: Fraction, x: Fraction, order: int, context: MPContext, outer: int
) -> tuple[OneSided, OneSided]:
    """Left, mirrored, and right."""
    return both_sides(ExactField(drift, False, context), x, r, order, context, outer)


@kept
def _kept_halves(
    context: MPContext, drift: Drift, r: Fraction, x: Fraction, order: int, dps: int, outer: int
) -> tuple[OneSided, OneSided]:
    """The same to `dps` digits, for the next question about the drift."""
    context.dps = dps
    return _halves(drift, r, x, order, context, outer)


def _terms(both: tuple[OneSided, OneSided], context: MPContext) -> tuple[str, ...]:
    """The wells and barriers of both sides in words, and what else is in T."""
    words = []
    for side, one in zip((-1, 1), both, strict=True):
        for point in one.rising + one.falling:
            if point.kind in ("well", "barrier"):
                words.append(f"{point.kind} at u = {context.nstr(side * point.u, 6)}")
    return (*sorted(words), "start, ends, kinks and the part between")


# -- many scenes, in float64 -----------------------------------------------------------------------


def _array_logs(
    drift: Drift,
    scenes: Scenes,
    shapes: list[tuple[int, ...]],
    orders: Sequence[int],
    quantity: Quantity,
    everywhere: bool,
    exactly: Fraction | None = None,
    index: IntArray | None = None,
    many: bool = True,
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift and start; vectorised over these, kappa and r.

    A start that all scenes share is `exactly` that, since it may lie on a zero of A.
    """

    def analyse(one: Drift, radius: float, start: float) -> tuple[OneSided, OneSided]:
        x, outer = Fraction(start) if exactly is None else exactly, 30 * quantity.outer
        with own_context(40) as context:
            left, right = _halves(one, Fraction(radius), x, orders[-1], context, outer)
            return in_float(left), in_float(right)

    with_digits = analyse if many else None
    logs, errors = logs_of(
        drift, scenes, shapes, orders, quantity.in_float, with_digits, everywhere, index=index
    )
    unknown = unresolved_in(drift, scenes)
    return logs, np.where(unknown, np.inf, errors) if unknown.any() else errors


def array_logs(
    drift: Drift, scenes: Scenes, name: str, order: int, index: IntArray, with_digits: bool
) -> tuple[FloatArray, FloatArray]:
    """Logarithms of T, C, 1 - C, P or 1 - P with their errors, infinite where nothing is known.

    Scenes of equal `index` have the drift, the start and a radius below 1 in common. A drift
    that needs more digits is left out unless `with_digits`; P always does.
    """
    if name in _QUANTITIES:
        quantity = _QUANTITIES[name]
        return _array_logs(drift, scenes, [], (order,), quantity, True, None, index, with_digits)
    return _occupation_logs(drift, scenes, name == "1 - P", (order,))


def _lost(logs: FloatArray, errors: FloatArray, log: bool) -> Any:
    """True where an error leaves no digit of the value, or is not known."""
    # A logarithm of 1e15 is right to all its digits where it is wrong by 1.
    return ~(errors <= np.maximum(np.log(2), 1e-11 * np.abs(logs) if log else 0.0))


def _require_small(
    kappa: FloatArray, logs: FloatArray, errors: FloatArray, order: int, log: bool
) -> None:
    """Raise AccuracyError where an error is infinite or leaves no digit of the value."""
    if errors.max() <= np.log(2):
        return
    bad = np.flatnonzero(~(errors < np.inf))
    if bad.size:
        raise _too_strong(f"{kappa[bad[0]]:.6g}", order)
    lost = np.flatnonzero(_lost(logs, errors, log))
    if lost.size:
        raise AccuracyError(
            f"kappa is {kappa[lost[0]]:.6g}, so small that the exponents of float64 leave no digit "
            "of the value; give dps=n and one scene at a time, or use method='exact'."
        )


def _occupation_logs(
    drift: Drift, scenes: Scenes, complement: bool, orders: Sequence[int]
) -> tuple[FloatArray, FloatArray]:
    """Logarithms of P or 1 - P and their errors, by Laplace at each well (`_occupation`)."""
    logs, errors = np.empty(len(scenes.lam)), np.full(len(scenes.lam), np.inf)
    for one, rows in by_drift(scenes):
        with own_context(40) as context:
            points, slopes, _ = _stationary(one, orders[-1], context)
            points = list(map(float_point, points))
            outside, whole_line = stationary_sums(points, [float(slope) for slope in slopes])
        lam, sizes = scenes.lam[rows], Sizes(p.series for p in points)
        top = max(abs(p.height) for p in points)
        with np.errstate(all="ignore"):
            for n in orders:
                at = Point(lam, n, True, sizes)
                total = at.value_of(whole_line)
                relative = 2 * (total.error / total.value)
                known = (relative >= 0) & (relative < _MOST_FLOAT)
                relative = np.where(known, relative, np.inf)
                rise = lam * (outside.height - whole_line.height)
                share = np.log(at.value_of(outside).value / total.value) + rise
                relative = relative + 1e-14 * (8 + lam * top)
                if not complement:
                    # log(1 - share), and how it changes.
                    relative = relative * np.exp(share) / -np.expm1(share)
                    share = np.log1p(-np.exp(share))
                better = relative < errors[rows]
                logs[rows] = np.where(better, share, logs[rows])
                errors[rows] = np.where(better, relative, errors[rows])
    return logs, np.where(unresolved_in(drift, scenes), np.inf, errors)
