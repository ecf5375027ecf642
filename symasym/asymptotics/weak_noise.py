"""Weak noise: T, C and 1 - P as sums over wells, barriers, ends and the part between, by Laplace.

With S_R = int_x^r e^{lam V}, D_R = int_x^r e^{lam V(v)} int_x^v e^{-lam V(u)} du dv
and their mirror images S_L, D_L,

    T = lam (S_L D_R + S_R D_L)/(S_L + S_R),     C = S_R/(S_L + S_R).

S is a sum over places (`symasym.asymptotics.places`), D one over pairs of places, a
place of e^{-lam V} left of one of e^{lam V}, and of the outer part. Nothing that is
exponentially small is left out; what is left out is, in every series, of higher order
in 1/lam, and the next two orders tell how much.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics import weak_noise_double
from symasym.asymptotics.bends import unseen, unseen_in
from symasym.asymptotics.log_scaled import LogScaled
from symasym.asymptotics.places import BEYOND, Groups, Half, Place, half, whole
from symasym.asymptotics.sights import sight_of
from symasym.asymptotics.weak_noise_arrays import Evaluate, logs_of
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError
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
)

DEFAULT_ORDER = 2
MOST_ORDER = 20
# Ratio of two neighbouring terms beyond which a series is taken to have stopped falling.
_MOST_FALL = Fraction(3, 4)
# Relative error of arrays beyond which they are refused: log 2 of the logarithm.
_MOST_FLOAT = 0.4
_BOUNDED = ("higher orders of every series, and what is exponentially small, in the bound",)
_DROPPED = ("higher orders of every series, in the error",)


class Pair(NamedTuple):
    """A value and the size of what its series leaves out."""

    value: Any
    error: Any

    def __add__(self, other: Pair) -> Pair:  # type: ignore[override]
        return Pair(self.value + other.value, self.error + other.error)

    def __mul__(self, other: Pair) -> Pair:  # type: ignore[override]
        cross = self.error * (abs(other.value) + other.error) + abs(self.value) * other.error
        return Pair(self.value * other.value, cross)


class Side(NamedTuple):
    """One side of the start at a given lam: S and D without the start's own share, and that.

    `rising` and `falling` are the start's shares of int e^{lam V} and int e^{-lam V}.
    """

    scale: Pair
    nested: Pair
    rising: Pair
    falling: Pair


class Sides(NamedTuple):
    """Both sides, and the start's shares of both together, which all but cancel."""

    left: Side
    right: Side
    rising: Pair
    falling: Pair
    corner: bool

    def total(self) -> Any:
        """int e^{lam V} over both sides."""
        return self.left.scale.value + self.right.scale.value + self.rising.value

    def sure(self) -> Any:
        """Whether that is known to half of itself."""
        error = self.left.scale.error + self.right.scale.error + self.rising.error
        return error < self.total() * 0.5


class Quantity(NamedTuple):
    """What is asked for: from the sides and lam; its logarithm, where 1 - value is tiny.

    `outer` says whether it needs the double integrals; `enclosed` gives proved bounds of it
    (see `symasym.asymptotics.weak_noise_bounds`).
    """

    value: Callable[[Sides, Any], Pair]
    log: Callable[[Sides, Any], Any] | None
    outer: bool
    in_float: Evaluate
    enclosed: Callable[..., Any] | None = None


def escape_time(drift: Drift, kappa: Any, r: Any, start: Any, request: Request) -> Any:
    """T to the order that `request` asks for; any region with simple zeros, any start."""
    return _answer(drift, kappa, r, start, request, _QUANTITIES["T"])


def exit_probability(
    drift: Drift, kappa: Any, r: Any, start: Any, complement: bool, request: Request
) -> Any:
    """C, or 1 - C, to the order that `request` asks for."""
    quantity = _QUANTITIES["1 - C" if complement else "C"]
    return _answer(drift, kappa, r, start, request, quantity)


def occupation(drift: Drift, kappa: Any, complement: bool, request: Request) -> Any:
    """1 - P = int_{|u| > 1} e^{-lam V}/int e^{-lam V}, or P; sliding only."""
    best, order = request.order == "optimal", _most_order(request)
    orders = range(order + 1) if best else (order,)
    numbers = {"kappa": kappa}
    if request.dps is None and not one_scene(drift, numbers):
        return _occupation_of_arrays(drift, numbers, complement, request, orders)
    values = exact_scene(drift, numbers, request.dps)
    digits = request.digits
    lam = 2 / values["kappa"] ** 2
    require_seen(drift, lam)
    with own_context(digits + 2 * len(str(int(lam + 1))) + 20) as context:
        stationary = _stationary(drift, order, context)
        number = context.mpf(lam.numerator) / lam.denominator
        found = []
        for n in orders:
            outside, total = _outside(stationary, number, n, Exponentials(context))
            if total.error < total.value / 2:
                found.append((outside / total.value, total.error / total.value, n))
        if not found:
            raise _too_strong(float_text(values["kappa"]), order)
        share, relative, order = min(found, key=lambda item: item[1])
        error = 2 * relative * share
        if not (complement or error < 1 - share):
            raise _too_strong(float_text(values["kappa"]), order)
        value = share if complement else 1 - share
        if request.log:
            error = error / (value - error)
            value = context.log(share) if complement else context.log1p(-share)
        error += abs(value) * context.mpf(10) ** -(digits + 5)
        request = request._replace(order=order)
        return as_digits(request, value, error, "estimate", stationary.terms, _DROPPED)


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
    ends = tuple(
        (context.mpf(s.numerator) / s.denominator, h) for s, h in zip(slopes, heights, strict=True)
    )
    wells = [f"well at u = {context.nstr(p.u, 6)}" for p in places if p.kind == "well"]
    return _Stationary(places, (ends[0], ends[1]), (*wells, "kinks"))


def _outside(found: _Stationary, lam: Any, order: int, ops: Any) -> tuple[Any, Pair]:
    """int e^{-lam V} over |u| > 1, and over all u."""
    unit = ops.exp(0 * lam)
    total = Pair(0 * unit, 0 * unit)
    for place in found.places:
        total = total + _weight(place, lam, order, ops)[0]
    outside = 0 * unit
    for slope, height in found.outside:
        outside = outside + ops.exp(lam * ops.number(height)) * (1 / (lam * ops.number(slope)))
    return outside, total


def time_of(sides: Sides, lam: Any) -> Pair:
    """lam (L D_R + R D_L)/(L + R), the start's own share of each taken out.

    With l, m the start's shares of int e^{lam V} and int e^{-lam V} to the right, those to the
    left are -l and -m, so that m drops out, and l from L + R: written so, errors of the two
    series, which are large beside a zero of A, do not count where they cancel.
    """
    left, right = sides.left, sides.right
    behind = left.scale.value + left.rising.value
    ahead = right.scale.value + right.rising.value
    total = sides.total()
    if sides.corner:
        product = behind * ahead
        extra = Pair(product * sides.falling.value, product * sides.falling.error)
        slope = behind * sides.falling.value, ahead * sides.falling.value
    else:
        one = right.falling * right.scale
        two = left.falling * left.scale
        extra = Pair(behind * one.value + ahead * two.value, behind * one.error + ahead * two.error)
        slope = two.value, one.value
    value = behind * right.nested.value + ahead * left.nested.value + extra.value
    error = behind * right.nested.error + ahead * left.nested.error + extra.error
    gap = right.nested.value - left.nested.value
    # How the value changes with what is left, right, and at the start of e^{lam V}.
    error = error + left.scale.error * ahead * abs(gap + slope[1]) / total
    error = error + right.scale.error * behind * abs(gap - slope[0]) / total
    error = error + right.rising.error * abs(gap + slope[1] - slope[0])
    error = error + sides.rising.error * (abs(gap) + abs(slope[0]) + abs(slope[1]))
    return Pair(lam * value / total, lam * error / total)


def _probability(complement: bool) -> Quantity:
    def split(sides: Sides) -> tuple[Any, Any]:
        shares = [side.scale.value + side.rising.value for side in (sides.left, sides.right)]
        return (shares[0], shares[1]) if complement else (shares[1], shares[0])

    def value(sides: Sides, lam: Any) -> Pair:
        part, rest = (sides.left, sides.right) if complement else (sides.right, sides.left)
        total = sides.total()
        share, other = (x / total for x in split(sides))
        error = other * part.scale.error + share * rest.scale.error
        error = error + part.rising.error + sides.rising.error
        return Pair(share, error / total)

    def logarithm(sides: Sides, ops: Any) -> Any:
        part, rest = split(sides)
        return -ops.log1p(rest / part)

    in_float = partial(weak_noise_double.exit_probability, complement)
    return Quantity(value, logarithm, False, in_float)


def _enclosed_time(drift: Drift, values: dict[str, Fraction], order: int, digits: int) -> Any:
    from symasym.exact import ball

    if not ball.available():
        return None
    from symasym.asymptotics.weak_noise_bounds import enclosure

    scene = values["kappa"], values["r"], values["start"]
    return enclosure(drift, *scene, order, digits)


_QUANTITIES = {
    "T": Quantity(time_of, None, True, weak_noise_double.escape_time, _enclosed_time),
    "C": _probability(False),
    "1 - C": _probability(True),
}


def _answer(
    drift: Drift,
    kappa: Any,
    r: Any,
    start: Any,
    request: Request,
    quantity: Quantity,
) -> Any:
    best, order = request.order == "optimal", _most_order(request)
    orders = range(order + 1) if best else (order,)
    numbers = {"kappa": kappa, "r": r, "start": start}
    if request.dps is None and not one_scene(drift, numbers):
        return _of_arrays(drift, numbers, request, orders, quantity)
    values = exact_scene(drift, numbers, request.dps)
    digits = request.digits
    lam = 2 / values["kappa"] ** 2
    require_seen(drift, lam)
    with own_context(working_digits(digits, lam, values["r"])) as context:
        halves = _halves(
            drift, values["r"], values["start"], order, context, (digits + 15) * quantity.outer
        )
        number = context.mpf(lam.numerator) / lam.denominator
        found, ops = [], Exponentials(context)
        for n in orders:
            sides = _sides(halves, number, values["r"], n, ops)
            if sides.sure():
                log = quantity.log(sides, ops) if quantity.log else None
                found.append((*quantity.value(sides, number), n, log))
        if not found:
            raise _too_strong(float_text(values["kappa"]), order)
        value, error, order, log = min(found, key=lambda item: item[1])
        if not error < value / 2:
            raise _too_strong(float_text(values["kappa"]), order)
        size = 2 * error
        if request.log:
            size = size / (value - error)
            value = context.log(value) if log is None else log
        size += abs(value) * context.mpf(10) ** -(digits + 5)
        request = request._replace(order=order)
        terms = _terms(halves, context)
        if request.full and quantity.enclosed is not None:
            bounds = quantity.enclosed(drift, values, order, digits)
            proved = None if bounds is None else _distance(bounds, value, request.log, context)
            if proved is not None:
                return as_digits(request, value, proved, "bound", terms, _BOUNDED)
        return as_digits(request, value, size, "estimate", terms, _DROPPED)


def _distance(bounds: Any, value: Any, log: bool, context: Any) -> Any:
    """The farther of two bounds from the value; None where that exceeds the value."""
    low, high = (
        context.mpf(int(mantissa)) * context.mpf(2) ** int(exponent)
        for mantissa, exponent in (x.man_exp() for x in (bounds.low, bounds.high))
    )
    if not low > 0:
        return None
    near = context.exp(value) if log else value
    size = max(abs(high - near), abs(low - near))
    if not size < near:
        return None
    if log:
        size = max(abs(context.log(high / near)), abs(context.log(low / near)))
    # The roundings here and of `near`, which is what the last term is for.
    slack = context.mpf(10) ** (8 - context.dps)
    return size * (1 + slack) + slack * (1 + abs(value))


class Parts(NamedTuple):
    """T as a sum: names, shares and their errors; `error` is relative to the total."""

    items: list[tuple[str, Any, Any]]
    total: Any
    error: Any
    order: int


def parts(
    drift: Drift, numbers: dict[str, Any], digits: int, orders: range, allowed: Fraction
) -> Parts:
    """T in parts, to the first of `orders` whose stated error is small enough, or the best."""
    values = exact_scene(drift, numbers, digits)
    lam = 2 / values["kappa"] ** 2
    require_seen(drift, lam)
    with own_context(working_digits(digits, lam, values["r"])) as context:
        ops, number = Exponentials(context), context.mpf(lam.numerator) / lam.denominator
        # No more digits of the outer part than its share of what is allowed.
        outer = len(str(int(1 / allowed))) + 12
        halves = _halves(drift, values["r"], values["start"], orders[-1], context, outer)
        best: Parts | None = None
        for n in orders:
            sides = _sides(halves, number, values["r"], n, ops)
            total = time_of(sides, number)
            if not (sides.sure() and total.error < total.value / 2):
                continue
            error = 2 * total.error / total.value
            if best is None or error < best.error:
                items = _items(halves, sides, number, values["r"], n, ops)
                best = Parts(items, total.value, error, n)
            if error <= _number(allowed, context):
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


def _number(x: Fraction, context: Any) -> Any:
    return context.mpf(x.numerator) / x.denominator


def _most_order(request: Request) -> int:
    if request.order == "optimal":
        return MOST_ORDER
    return read_order(request.order, DEFAULT_ORDER, MOST_ORDER)


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


# -- at a given lam --------------------------------------------------------------------------------


class Exponentials:
    """e^{lam height} in an mpmath context."""

    def __init__(self, context: Any) -> None:
        self._context = context
        # Places are known to a few units, and sums of theirs may cancel.
        self.unit = 64 * context.eps
        self._fall = self.number(_MOST_FALL)

    def exp(self, x: Any) -> Any:
        return self._context.exp(x)

    def log(self, x: Any) -> Any:
        return self._context.log(x)

    def log1p(self, x: Any) -> Any:
        return self._context.log1p(x)

    def tail(self, near: Any, far: Any) -> Any:
        return 1 / (1 - min(far / near, self._fall)) if near else 1 / (1 - self._fall)

    def number(self, x: Any) -> Any:
        if isinstance(x, Fraction):
            return self._context.mpf(x.numerator) / x.denominator
        return x


class _FloatExponentials:
    """The same for arrays of floats."""

    unit = 1e-15

    def exp(self, x: FloatArray) -> LogScaled:
        return LogScaled(np.ones_like(x), x)

    def log(self, x: FloatArray) -> FloatArray:
        return np.log(x)

    def tail(self, near: FloatArray, far: FloatArray) -> FloatArray:
        ratio = np.where(near > 0, far / np.where(near > 0, near, 1.0), 1.0)
        found: FloatArray = 1 / (1 - np.minimum(ratio, float(_MOST_FALL)))
        return found

    def number(self, x: Any) -> Any:
        return x if isinstance(x, np.ndarray) else float(x)


def _sides(halves: tuple[Half, Half], lam: Any, r: Any, order: int, ops: Any) -> Sides:
    left, right = (_side(one, lam, r, order, ops) for one in halves)
    starts = [one.start for one in halves]
    both = (
        [a + b for a, b in zip(*pair, strict=True)]
        for pair in ([s.rising for s in starts], [s.falling for s in starts])
    )
    unit = ops.exp(0 * lam)
    rising, falling = (_times(series_of(_gathered(g), lam, order, ops), unit) for g in both)
    return Sides(left, right, rising, falling, starts[0].corner)


def _gathered(groups: Groups) -> Groups:
    """Terms of one power added up, before any is evaluated."""
    found: Groups = []
    for group in groups:
        sums: dict[Any, Any] = {}
        for c, p, q in group:
            sums[p, q] = sums.get((p, q), 0) + c
        found.append([(c, *key) for key, c in sums.items()])
    return found


def _times(series: Pair, factor: Any) -> Pair:
    return Pair(series.value * factor, series.error * factor)


def _side(one: Half, lam: Any, r: Any, order: int, ops: Any) -> Side:
    """One side at `lam`, with the end at `r` where that is beyond the layer."""
    rising, falling = weights_of(one, lam, r, order, ops)
    unit = ops.exp(0 * lam)
    scale = rising.pop()[1] if one.beyond is not None else Pair(0 * unit, 0 * unit)
    nested = _times(outer_part(one, lam, r, order, ops), unit)
    # From right to left: what e^{lam V} has to the right of each place of e^{-lam V}.
    for place, share, onward in reversed(rising):
        while falling and falling[-1][0].u > place.u:
            nested = nested + falling.pop()[1] * scale
        if falling and falling[-1][0].u == place.u:
            nested = nested + falling.pop()[1] * (scale + onward)
        scale = scale + share
    for _, share, _ in falling:
        nested = nested + share * scale
    starts = (_times(series_of(g, lam, order, ops), unit) for g in one.start[:2])
    return Side(scale, nested, *starts)


def outer_part(one: Half, lam: Any, r: Any, order: int, ops: Any) -> Pair:
    """What lies between the places, in the layer and beyond it."""
    found = series_of(one.outer, lam, order, ops, ops.number(one.unit))
    if one.beyond is None:
        return found
    u, _, slope = (ops.number(x) for x in one.beyond)
    return Pair(found.value + (ops.number(r) - u) / (slope * lam), found.error)


def weights_of(
    one: Half, lam: Any, r: Any, order: int, ops: Any
) -> tuple[list[tuple[Place, Pair, Pair]], list[tuple[Place, Pair, Pair]]]:
    """The places of e^{lam V} and of e^{-lam V} with their shares and onward ones."""
    rising = list(one.rising)
    if one.beyond is not None:
        u, height, slope = (ops.number(x) for x in one.beyond)
        height = height - slope * (ops.number(r) - u)
        rising.append(Place("end", None, height, [[(-1 / slope, 1, 0)]], []))
    first, second = (
        [(p, *_weight(p, lam, order, ops)) for p in places] for places in (rising, one.falling)
    )
    return first, second


def _weight(place: Place, lam: Any, order: int, ops: Any) -> tuple[Pair, Pair]:
    """The place's share of its own integral, and its `onward`."""
    factor = ops.exp(lam * ops.number(place.height))
    share, onward = (
        _times(series_of(g, lam, order, ops), factor) for g in (place.groups, place.onward)
    )
    return share, onward


def series_of(groups: Groups, lam: Any, order: int, ops: Any, unit: Any = 0) -> Pair:
    """The first order + 1 groups, and the size of what follows, judged by the next two."""
    sums, size = [], 0 * lam
    for group in groups[: order + 1 + BEYOND]:
        total = 0 * lam
        for c, p, q in group:
            term = ops.number(c) * lam ** -ops.number(p)
            term = term * ops.log(lam) if q else term
            total, size = total + term, size + abs(term)
        sums.append(total)
    # A straight stretch has one term, and a place with nothing to its right has none.
    sums += [0 * lam] * (order + 1 + BEYOND - len(sums))
    value = sum(sums[: order + 1], 0 * lam)
    near, far = (abs(s) for s in sums[order + 1 :])
    # Where the terms hardly fall any more, as many more are as large before they rise.
    return Pair(value, (near + far) * ops.tail(near, far) + max(unit, ops.unit) * size)


# -- many scenes, in float64 -----------------------------------------------------------------------


def _of_arrays(
    drift: Drift,
    numbers: dict[str, Any],
    request: Request,
    orders: Any,
    quantity: Quantity,
) -> Any:
    scenes = float_scenes(drift, numbers)
    shapes = [np.shape(x) for x in (*drift.values.values(), numbers["start"]) if is_array(x)]
    if is_array(numbers["r"]) and (scenes.numbers["r"] <= 1).any():
        shapes.append(np.shape(numbers["r"]))
    logs, errors = _array_logs(drift, scenes, shapes, orders, quantity, request.full)
    _require_small(scenes.numbers["kappa"], logs, errors, orders[-1], request.log)
    request = request._replace(order=orders[-1] if len(orders) == 1 else None)
    terms = ("wells, barriers, start, ends, kinks and the part between",)
    return as_floats(request, scenes.shape, logs, errors, "estimate", terms, _DROPPED)


def _array_logs(
    drift: Drift,
    scenes: Scenes,
    shapes: list[tuple[int, ...]],
    orders: Any,
    quantity: Quantity,
    everywhere: bool,
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift and start; vectorised over these, kappa and r."""

    def analyse(given: dict[str, float], radius: float, start: float) -> Any:
        one = drift.bind(**given) if given else drift
        outer = 30 * quantity.outer
        with own_context(40) as context:
            found = _halves(one, Fraction(radius), Fraction(start), orders[-1], context, outer)
            return sight_of(found[0]), sight_of(found[1])

    logs, errors = logs_of(drift, scenes, shapes, orders, quantity.in_float, analyse, everywhere)
    return logs, np.where(unseen_in(drift, scenes), np.inf, errors)


def array_logs(
    drift: Drift, scenes: Scenes, name: str, order: int
) -> tuple[FloatArray, FloatArray]:
    """Logarithms of T, C, 1 - C, P or 1 - P with their errors, infinite where nothing is known."""
    if name in _QUANTITIES:
        quantity = _QUANTITIES[name]
        return _array_logs(drift, scenes, [scenes.shape], (order,), quantity, True)
    return _occupation_logs(drift, scenes, name == "1 - P", (order,))


def _require_small(
    kappa: FloatArray, logs: FloatArray, errors: FloatArray, order: int, log: bool
) -> None:
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


def _occupation_of_arrays(
    drift: Drift, numbers: dict[str, Any], complement: bool, request: Request, orders: Any
) -> Any:
    scenes = float_scenes(drift, numbers)
    logs, errors = _occupation_logs(drift, scenes, complement, orders)
    _require_small(scenes.numbers["kappa"], logs, errors, orders[-1], request.log)
    request = request._replace(order=orders[-1] if len(orders) == 1 else None)
    terms = ("wells and kinks",)
    return as_floats(request, scenes.shape, logs, errors, "estimate", terms, _DROPPED)


def _occupation_logs(
    drift: Drift, scenes: Scenes, complement: bool, orders: Any
) -> tuple[FloatArray, FloatArray]:
    given = {name: x for name, x in scenes.parameters.items() if is_array(x)}
    keys = np.array([*given.values(), np.zeros(len(scenes.lam))]).T
    unique, group = np.unique(keys, axis=0, return_inverse=True)
    logs, errors = np.empty(len(scenes.lam)), np.full(len(scenes.lam), np.inf)
    ops = _FloatExponentials()
    for k in range(len(unique)):
        rows = np.flatnonzero(group.ravel() == k)
        first = {name: float(x[rows[0]]) for name, x in given.items()}
        with own_context(40) as context:
            found = _stationary(drift.bind(**first) if first else drift, orders[-1], context)
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
