"""Weak noise: T, C and P as sums over wells, barriers, ends and the regular part, by Laplace.

With S_R = int_x^r e^{lam V}, D_R = int_x^r e^{lam V(v)} int_x^v e^{-lam V(u)} du dv
and their mirror images S_L, D_L,

    T = lam (S_L D_R + S_R D_L)/(S_L + S_R),     C = S_R/(S_L + S_R).

S is a sum over critical points (`symasym.asymptotics.weak_noise.critical_points`), D one over
pairs of them, one of e^{-lam V} left of one of e^{lam V}, and of the regular part. Nothing that is
exponentially small is left out; what is left out is, in every series, of higher order
in 1/lam, and the next two orders tell how much. An asymptotic series is best cut off where that
error is least (optimal truncation: R. B. Dingle, Asymptotic Expansions, 1973, ch. I); bounds
replace the estimate where they are proved.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import cache, partial
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.arrays import logs_of, own_shapes
from symasym.asymptotics.weak_noise.compose import (
    AtOrder,
    Composed,
    Evaluate,
    escape_time,
    exit_probability,
    float_log,
    mean_time,
    of_complement,
    outside_layer,
    pairs_of,
    plain,
    regular_part,
    scale_contributions,
    with_digits,
)
from symasym.asymptotics.weak_noise.critical_points import both_sides, in_float
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.regular_part import require_resolved, unresolved_in
from symasym.asymptotics.weak_noise.series import Point, Series
from symasym.base.call_context import expect, kept, mpf_of, own_context
from symasym.base.errors import AccuracyError, InputError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import FloatArray, IntArray, exact, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField
from symasym.numbers.arithmetic import FLOATS, Digits, Number
from symasym.scenes import (
    FLOAT_DIGITS,
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    float_scenes,
    working_digits,
)

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

#: Proved bounds at an order, or None.
Prove = Callable[[int], Any]

# Values of an analytic A, at least, that V and the regular part take for each bit.
_VALUES_A_BIT = 8

_BOUNDED = ("higher orders of every series, and what is exponentially small, in the bound",)
DROPPED = ("higher orders of every series, in the error",)

# The whole line, of which P is asked, as an interval with a start.
_LINE = {"r": Fraction(3), "start": Fraction(-2)}
_TIME = "start, ends, kinks and the regular part"


class Quantity(NamedTuple):
    """What is asked for at lam, of P its complement; whether it needs the double integrals."""

    evaluate: Evaluate
    regular_part: bool


_QUANTITIES = {
    "T": Quantity(escape_time, True),
    "C": Quantity(partial(exit_probability, False), False),
    "1 - C": Quantity(partial(exit_probability, True), False),
    "P": Quantity(outside_layer, False),
    "1 - P": Quantity(outside_layer, False),
}


def of_scene(scene: Scene, request: Request, prove: Prove | None = None) -> Answer:
    """T, C or P, or a complement, to the request's order, any start; its error by `prove` if given.

    With several orders the one whose error is smallest is taken.
    """
    if request.dps is None and not request.full:
        answer = _float_answer(scene, request)
        if answer is not None:
            return answer
    quantity, orders = _QUANTITIES[request.name], _orders(request)
    drift, lam, digits = scene.drift, scene.lam, request.digits
    r, start = ((_LINE | scene.numbers)[name] for name in _LINE)
    require_resolved(drift, lam)
    near = digits_lost(r, start)
    regular = (digits + 15 + near) * quantity.regular_part
    context, both = _kept_one_sided(
        drift, r, start, orders[-1], working_digits(digits, drift, lam, r) + near, regular
    )
    composed, at = _with_digits(both, lam, r, context)
    expanded = [with_digits(quantity.evaluate, composed, at(n)) for n in orders]
    taken = chosen(expanded, prove, request.full, context)
    if taken is None:
        raise _too_strong(scene.noise, orders)
    log, relative = taken.found.log, taken.found.error / taken.found.value
    if request.name == "P":
        log, relative = of_complement(log, relative, Digits(context))
        if not relative < 1:
            raise _too_strong(scene.noise, orders)
    value = log if request.log else context.exp(log)
    size = of_log(relative, taken.kind, context) if request.log else relative * value
    size += abs(value) * context.mpf(10) ** -(digits + 5)
    terms = _terms(request.name, both, context)
    return Answer(value, size, taken.kind, terms, taken.dropped(context), taken.found.order)


def _float_answer(scene: Scene, request: Request) -> Answer | None:
    """The answer as an array of one scene; None where float64 is not enough for it."""
    try:
        scenes = float_scenes(scene.drift, scene.numbers)
        logs, errors = _logs(scenes, request.name, _orders(request), False)
    except (InputError, ArithmeticError):
        # Numbers beyond float64, and what is refused.
        return None
    if _lost(logs, errors, request.log).any():
        return None
    with own_context(FLOAT_DIGITS) as context:
        log = context.mpf(float(logs[0]))
        return Answer(log if request.log else context.exp(log), None, "estimate")


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same for many scenes in float64: one analysis for each drift and start."""
    orders = _orders(request)
    logs, errors = _logs(scenes, request.name, orders, request.full)
    if request.errors == "raise":
        _require_small(scenes.numbers["kappa"], logs, errors, orders, request.log)
    else:
        logs = np.where(_lost(logs, errors, request.log), np.nan, logs)
    terms = "wells and kinks" if request.name[-1] == "P" else f"wells, barriers, {_TIME}"
    return Answers(logs, errors, "estimate", (terms,), DROPPED)


def _orders(request: Request) -> Sequence[int]:
    """The orders among which the best is taken, ascending."""
    return request.order if isinstance(request.order, range) else (request.order,)


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
    dps = working_digits(digits, drift, lam, values["r"]) + near
    # No more digits of the regular part than its share of what is allowed.
    regular = len(str(int(1 / allowed))) + 12 + near
    context, both = _kept_one_sided(drift, values["r"], values["start"], orders[-1], dps, regular)
    composed, at = _with_digits(both, lam, values["r"], context)
    best: Parts | None = None
    for n in orders:
        total = with_digits(escape_time, composed, at(n))
        if not total.sure:
            continue
        error = total.error / total.value
        if best is None or error < best.error:
            best = Parts(_items(both, composed, at(n)), total.value, error, n)
        if error <= mpf_of(allowed, context):
            break
    if best is None:
        raise _too_strong(float_text(values["kappa"]), orders)
    return best


def _items(
    both: tuple[OneSided, OneSided], composed: Composed, at: Point
) -> list[tuple[str, Any, Any]]:
    """Every pair of critical points and the regular part of both sides, times the chance of it."""
    r, nodes, items = composed.r, composed.nodes, []
    sides, none = composed.sides, nodes.exponential(0.0, Series([]))
    shares = sides.shares
    for k, one in enumerate(both):
        front = at.lam * plain(shares[1 - k] / sides.total, at)[0]
        sign, chance = 2 * k - 1, "" if k else "C times "
        for low, high, pair in pairs_of(one, scale_contributions(one, r, nodes), nodes):
            value, error = plain(pair, at)
            name = f"{chance}{_named(low, sign, r)} with {_named(high, sign, r)}"
            items.append((name, front * value, front * error))
        value, error = plain(regular_part(one, r, nodes), at)
        where = f"{chance}the regular part, {'right' if k else 'left'}"
        items.append((where, front * value, front * error))
    # T is linear in D; taken from the rest of T, a share of 0 would be its rounding.
    left, right = (side._replace(nested=none) for side in (sides.left, sides.right))
    value, error = plain(mean_time(replace(sides, left=left, right=right)), at)
    if value or error:
        items.append(("the start's own share", at.lam * value, at.lam * error))
    return items


def _named(point: CriticalPoint, sign: int, r: mpf) -> str:
    # Plus 0: no -0.
    return f"{point.kind} at {sign * float(r if point.u is None else point.u) + 0.0:.4g}"


def digits_lost(r: Fraction, x: Fraction) -> int:
    """Digits that cancel where the way to an end is short: T is as small, its terms are not."""
    share = max(r, Fraction(1)) / (r - abs(x))
    return math.ceil(0.30103 * ((share.numerator // share.denominator).bit_length() - 1))


def _too_strong(kappa: str, orders: Sequence[int]) -> AccuracyError:
    """The refusal of a scene whose truncation error is as large as its value."""
    single = len(orders) == 1
    tried = f"order={orders[0]}" if single else f"any order to {orders[-1]}"
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong, or a well, a barrier or the start too "
        f"close to another or to an end, for Laplace's method with {tried}: the next terms are as "
        f"large as the value; {'give another order, or ' * single}use method='exact'."
    )


def _one_sided(
    drift: Drift, r: Fraction, x: Fraction, order: int, context: MPContext, regular: int
) -> tuple[OneSided, OneSided]:
    """Left, mirrored, and right."""
    return both_sides(ExactField(drift, False, context), x, r, order, context, regular)


@kept
def _kept_one_sided(
    context: MPContext, drift: Drift, r: Fraction, x: Fraction, order: int, dps: int, regular: int
) -> tuple[OneSided, OneSided]:
    """The same to `dps` digits, for the next question about the drift."""
    context.dps = dps
    field = ExactField(drift, False, context)
    if not field.is_polynomial:
        each = []
        for _ in range(2):  # the first also makes what later ones share
            begun = time.thread_time()
            field.number(context.mpf(1) / 3)
            each.append(time.thread_time() - begun)
        seconds = _VALUES_A_BIT * context.prec * min(each)
        expect(seconds, f"the weak-noise series of A to {dps:,} digits")
    return _one_sided(drift, r, x, order, context, regular)


def _terms(name: str, both: tuple[OneSided, OneSided], context: MPContext) -> tuple[str, ...]:
    """The wells and barriers of both sides in words, and what else is in the quantity."""
    kinds = ("well",) if name[-1] == "P" else ("well", "barrier")
    words = []
    for side, one in zip((-1, 1), both, strict=True):
        for point in one.scale_points + one.speed_points:
            if point.kind in kinds:
                words.append(f"{point.kind} at u = {context.nstr(side * point.u, 6)}")
    return (*sorted(words), "kinks" if name[-1] == "P" else _TIME)


# -- the order that is taken -----------------------------------------------------------------------


class Chosen(NamedTuple):
    """The order that is taken, the kind of its error, and what a proof allows where that is larger.

    `allowed` is relative to the value.
    """

    found: AtOrder
    kind: ErrorKind
    allowed: Any = None

    def dropped(self, context: MPContext) -> tuple[str, ...]:
        """The terms left out in words; never an estimate below what a proof allows without that."""
        if self.kind == "bound":
            return _BOUNDED
        if self.allowed is None:
            return DROPPED
        size = context.nstr(self.allowed, 3)
        return (
            *DROPPED,
            f"the error is an estimate; what is proved is a relative error of {size}",
        )


def chosen(
    expanded: list[AtOrder],
    prove: Callable[[int], Any] | None,
    full: bool,
    context: MPContext,
) -> Chosen | None:
    """The best order, its error proved where that is asked for or where no estimate is sure.

    None where neither is known. `prove` gives bounds in balls, or None, for an order.
    """
    sure = [f for f in expanded if f.sure]
    best = [min(sure, key=lambda f: f.error)] if sure else []
    bounds = None
    if prove is not None and (full or not sure):
        bounds = prove((best or expanded)[-1].order)
    allowed = None
    if bounds is not None:
        proved = [f._replace(error=_distance(bounds, f.value, context)) for f in best or expanded]
        # What is refused unless it is proved has to be as good as what is not; where the bounds
        # are far apart, as without a well, a good estimate says more, unless they disprove it.
        most = max(best[0].value / 100, min(best[0].value, 100 * best[0].error)) if sure else None
        if most is None or _outside(bounds, best[0], context):
            best, most = [], None
        allowed = min(f.error / abs(f.value) for f in proved)
        proved = [f for f in proved if f.error < (f.value / 2 if most is None else most)]
        if proved:
            return Chosen(min(proved, key=lambda f: f.error), "bound")
    return Chosen(best[0], "estimate", allowed) if best else None


def of_log(relative: Number, kind: ErrorKind, context: MPContext) -> Any:
    """The error of a logarithm from the relative one of the value, below 1."""
    if kind == "bound":
        return -context.log1p(-relative) * (1 + context.mpf(10) ** (8 - context.dps))
    return relative / (1 - relative / 2)


def _ends(bounds: Any, context: MPContext) -> list[Any]:
    """Two proved bounds as numbers of the context."""
    pairs = (x.man_exp() for x in (bounds.low, bounds.high))
    return [context.mpf(int(mantissa)) * context.mpf(2) ** int(power) for mantissa, power in pairs]


def _distance(bounds: Any, value: Number, context: MPContext) -> Any:
    """The farther of two proved bounds from the value."""
    size = max(abs(end - value) for end in _ends(bounds, context))
    # The roundings here.
    return size + (abs(value) + size) * context.mpf(10) ** (8 - context.dps)


def _outside(bounds: Any, found: AtOrder, context: MPContext) -> bool:
    """True where proved bounds leave no room for the value and its estimated error."""
    low, high = _ends(bounds, context)
    reach = found.error + abs(found.value) * context.mpf(10) ** (8 - context.dps)
    return bool(found.value + reach < low or found.value - reach > high)


# -- many scenes, in float64 -----------------------------------------------------------------------


def _logs(
    scenes: Scenes,
    name: str,
    orders: Sequence[int],
    everywhere: bool,
    index: IntArray | None = None,
    many: bool = True,
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift and start; vectorised over these, kappa and r.

    A start that all scenes share is exactly what was given, since it may lie on a zero of A. What
    float64 is not enough for is left out unless `many`.
    """
    drift, quantity, start = scenes.drift, _QUANTITIES[name], scenes.given.get("start", -2)
    if name[-1] == "P":
        line = {n: np.broadcast_to(float(x), scenes.lam.shape) for n, x in _LINE.items()}
        scenes = scenes._replace(numbers=scenes.numbers | line)
    exactly = None if is_array(start) else exact("start", start)
    regular = 30 * quantity.regular_part

    def analyse(one: Drift, radius: float, start: float) -> tuple[OneSided, OneSided]:
        x, r = Fraction(start) if exactly is None else exactly, Fraction(radius)
        if len(scenes.lam) == 1:
            left, right = _kept_one_sided(one, r, x, orders[-1], 40, regular)[1]
            return in_float(left), in_float(right)
        with own_context(40) as context:
            left, right = _one_sided(one, r, x, orders[-1], context, regular)
            return in_float(left), in_float(right)

    shapes = own_shapes(drift, scenes.given, scenes) if index is None else []
    logs, errors = logs_of(
        drift,
        scenes,
        shapes,
        orders,
        partial(float_log, quantity.evaluate),
        analyse if many else None,
        everywhere,
        index=index,
    )
    if name == "P":
        with np.errstate(all="ignore"):
            logs, errors = of_complement(logs, errors, FLOATS)
    unknown = unresolved_in(drift, scenes)
    return logs, np.where(unknown, np.inf, errors) if unknown.any() else errors


def array_logs(
    scenes: Scenes, name: str, order: int, index: IntArray, with_digits: bool
) -> tuple[FloatArray, FloatArray]:
    """Logarithms of T, C, 1 - C, P or 1 - P with their errors, infinite where nothing is known.

    Scenes of equal `index` have the drift, the start and a radius below 1 in common. A drift
    that needs more digits is left out unless `with_digits`.
    """
    return _logs(scenes, name, (order,), True, index, many=with_digits)


def _lost(logs: FloatArray, errors: FloatArray, log: bool) -> Any:
    """True where an error leaves no digit of the value, or is not known."""
    # A logarithm of 1e15 is right to all its digits where it is wrong by 1.
    return ~(errors <= np.maximum(np.log(2), 1e-11 * np.abs(logs) if log else 0.0))


def _require_small(
    kappa: FloatArray, logs: FloatArray, errors: FloatArray, orders: Sequence[int], log: bool
) -> None:
    """Raise AccuracyError where an error is infinite or leaves no digit of the value."""
    if errors.max() <= np.log(2):
        return
    bad = np.flatnonzero(~(errors < np.inf))
    if bad.size:
        raise _too_strong(f"{kappa[bad[0]]:.6g}", orders)
    lost = np.flatnonzero(_lost(logs, errors, log))
    if lost.size:
        raise AccuracyError(
            f"kappa is {kappa[lost[0]]:.6g}, so small that the exponents of float64 leave no digit "
            "of the value; give dps=n and one scene at a time, or use method='exact'."
        )
