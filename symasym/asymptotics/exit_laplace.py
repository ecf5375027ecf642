"""The exit probability in weak noise: Laplace's method on both sides of the start.

C = 1/(1 + sigma_L/sigma_R), where sigma_R = int_x^r e^{lam (V(u) - V(x))} du and
sigma_L is its mirror image. Each is a sum over the places where V is largest: the
start, if V falls from it; barriers; the end at r, if V rises to it. Every place
brings a series in 1/lam (`symasym.asymptotics.coefficients`). In a crossing region
with r >> 1 the end on the upstream side wins, and C is exponentially small in r.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.coefficients import laplace_coefficients
from symasym.asymptotics.layer_bounds import rough_barriers
from symasym.context import own_context
from symasym.drift import Drift
from symasym.errors import AccuracyError, InputError
from symasym.exact.local import ExactField
from symasym.inputs import FloatArray, float_text, is_array
from symasym.scenes import (
    Request,
    as_digits,
    as_floats,
    exact_scene,
    float_scenes,
    input_rounding,
    one_scene,
    read_order,
    rows_of,
)

DEFAULT_ORDER = 2
MOST_ORDER = 20
_DROPPED = ("what a barrier's series says beyond the layer's edges and the start, in the error",)


class Peak(NamedTuple):
    """Weight e^{lam height} sum_n c_n lam^{-p_n}; `groups` holds (c, p) by order in 1/lam."""

    height: Any
    groups: list[list[tuple[Any, Any]]]


def exit_probability(
    drift: Drift, kappa: Any, r: Any, start: Any, complement: bool, request: Request
) -> Any:
    """C, or 1 - C, with `order` corrections in 1/lam; the error is the next two, doubled."""
    if request.order == "optimal":
        raise InputError(
            f"order is 'optimal', which this method has not; give a number from 0 to {MOST_ORDER}."
        )
    order = read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    request = request._replace(order=order)
    numbers = {"kappa": kappa, "r": r, "start": start}
    terms = ("start, barriers and ends on both sides",)
    if not one_scene(drift, numbers) and request.dps is None:
        return _of_arrays(drift, numbers, complement, order, request, terms)
    values = exact_scene(drift, numbers, request.dps)
    digits = request.digits
    lam = 2 / values["kappa"] ** 2
    extra = 2 * len(str(int(lam * (1 + values["r"]) + 1))) + 20
    with own_context(digits + extra) as context:
        left = peaks(drift, True, values["r"], -values["start"], order, context)
        right = peaks(drift, False, values["r"], values["start"], order, context)
        number = context.mpf(lam.numerator) / lam.denominator
        sides = [_weight(side, number, context) for side in (left, right)]
        # Relative to each side, because the error of C is taken as linear in theirs.
        if not all(error < value / 2 for value, error in sides):
            raise _too_strong(float_text(values["kappa"]), order)
        wanted, other = sides if complement else sides[::-1]
        ratio = other[0] / wanted[0]
        share = 1 / (1 + ratio)
        rest = ratio / (1 + ratio)
        error = rest * (wanted[1] / wanted[0] + other[1] / other[0])
        value = -context.log1p(ratio) if request.log else share
        size = 2 * error if request.log else 2 * error * share
        size += abs(value) * context.mpf(10) ** -(digits + 5)
        return as_digits(request, value, size, "estimate", terms, _DROPPED)


def _too_strong(kappa: str, order: int) -> AccuracyError:
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong, or a barrier too close to another or "
        f"to an end, for Laplace's method with order={order}: the next terms are as large as the "
        "value; give another order, or use method='exact'."
    )


def _weight(peaks: list[Peak], lam: Any, context: Any) -> tuple[Any, Any]:
    """The sum over the peaks, and the size of what comes next."""
    total = error = context.zero
    for peak in peaks:
        scale = context.exp(lam * peak.height)
        sums = [sum((c * lam**-p for c, p in group), context.zero) for group in peak.groups]
        total += scale * sum(sums[:-2], context.zero)
        error += scale * (abs(sums[-2]) + abs(sums[-1]))
    return total, error


def peaks(
    drift: Drift, mirrored: bool, r: Fraction, x: Fraction, order: int, context: Any
) -> list[Peak]:
    """All places right of x where V may be largest, V measured from x."""
    field = ExactField(drift, mirrored, context)
    one = Fraction(1)

    def number(y: Any) -> Any:
        return context.mpf(y.numerator) / y.denominator if isinstance(y, Fraction) else y

    def constant(height: Any, slope: Any) -> Peak:
        # A straight potential: the first term is all there is.
        return Peak(height, [[(1 / abs(slope), 1)], *([] for _ in range(order + 2))])

    def edge_error(height: Any, slope: Any) -> Peak:
        return Peak(height, [*([] for _ in range(order + 2)), [(1 / abs(slope), 1)]])

    found = []
    a_minus, a_plus = (number(field.value(Fraction(side))) for side in (-1, 1))
    if not (a_minus and a_plus):
        raise InputError(
            "a- or a+ is 0, a tangency, where the weak-noise series has no terms; use "
            "method='exact'."
        )
    height = context.zero
    if x < -1:
        found.append((constant if a_minus > 0 else edge_error)(height, a_minus))
        height -= a_minus * number(-one - x)
    lo, hi = max(x, -one), min(r, one)
    if lo < hi:
        low, high = number(lo), number(hi)

        def at(u: Any) -> Any:
            return height + field.potential_rise(low, u)

        inside = [field.polish(float(b)) for b in rough_barriers(drift, mirrored, lo, hi)]
        # A start on a barrier is the start's, not the barrier's once more.
        near = context.ldexp(1, -context.prec // 3)
        inside = [b for b in inside if low + near < b < high - near]
        for b in inside:
            both = [
                _series(_fall(field, b, side, order, context), order, context, 2)
                for side in (1, -1)
            ]
            groups = [p + q for p, q in zip(*both, strict=True)]
            found.append(Peak(at(b), groups))
        for place, u, side in ((lo, low, 1), (hi, high, -1)):
            slope = number(field.value(place))
            own = place == x if side > 0 else place == r
            falls = slope * side > 0
            touches = slope == 0
            if own and (falls or touches):
                fall = _fall(field, u, side, order, context, exact=place)
                if not touches or next(c for c in fall if c) > 0:
                    groups = _series(fall, order, context)
                    found.append(Peak(at(u), groups))
                    continue
            if slope:
                # What the series of a peak inside counts beyond this end, or a corner adds.
                found.append(edge_error(at(u), slope))
        height = at(high)
    if r > 1:
        beyond = max(x, one)
        if x >= 1 and a_plus > 0:
            found.append(constant(height, a_plus))
        if a_plus < 0:
            found.append(constant(height - a_plus * number(r - beyond), a_plus))
        if x >= 1:
            other = height if a_plus < 0 else height - a_plus * number(r - beyond)
            found.append(edge_error(other, a_plus))
        elif a_plus > 0:
            found.append(edge_error(height - a_plus * number(r - one), a_plus))
    return found


def _fall(
    field: ExactField, u: Any, side: int, order: int, context: Any, exact: Fraction | None = None
) -> list[Any]:
    """Coefficients of V(u) - V(u + side t) in t, from t^1 on."""
    from symasym.exact.local import to_fraction

    place = to_fraction(u) if exact is None else exact
    count = 3 * (order + 3) + 2
    taylor = field.taylor(place, Fraction(1), count)
    taylor = [*taylor, *([Fraction(0)] * max(0, count - len(taylor)))][:count]
    fall = [c * side ** (k + 1) / (k + 1) for k, c in enumerate(taylor)]
    if exact is None:
        fall[0] = Fraction(0)  # the zero of A itself, to the last digit
    return [context.mpf(c.numerator) / c.denominator for c in fall]


def _series(
    fall: list[Any], order: int, context: Any, expected: int | None = None
) -> list[list[tuple[Any, Any]]]:
    """int_0 e^{-lam fall} dt as coefficients and powers of 1/lam, `order` + 3 groups of them.

    A group holds what lies between two whole powers of 1/lam.
    """
    m = next((k for k, c in enumerate(fall, start=1) if c), 0)
    if not m or m > 3 or (expected and m != expected):
        raise InputError(
            "A vanishes to high order at a barrier or at the start, where the weak-noise series "
            "is not of this kind; use method='exact'."
        )
    count = (order + 3) * m
    zero = context.zero
    f = [zero, *(-c for c in fall)]
    found = laplace_coefficients(f, [zero + 1, *[zero] * (count - 1)], m)
    terms = [(c, context.mpf(n + 1) / m) for n, c in enumerate(found)]
    return [terms[k : k + m] for k in range(0, count, m)]


# -- many scenes, in float64 -----------------------------------------------------------------------


def _of_arrays(
    drift: Drift,
    numbers: dict[str, Any],
    complement: bool,
    order: int,
    request: Request,
    terms: tuple[str, ...],
) -> Any:
    """One analysis for each drift, radius and start; vectorised over kappa."""
    scenes = float_scenes(drift, numbers)
    given = {name: x for name, x in scenes.parameters.items() if is_array(x)}
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    unique, group = np.unique(np.array([*given.values(), r, start]).T, axis=0, return_inverse=True)
    logs, errors, worst = (np.empty(len(r)) for _ in range(3))
    for k in range(len(unique)):
        rows = np.flatnonzero(group.ravel() == k)
        first = {name: float(x[rows[0]]) for name, x in given.items()}
        one = drift.bind(**first) if first else drift
        places = Fraction(float(r[rows[0]])), Fraction(float(start[rows[0]]))
        with own_context(40) as context:
            sides = [
                peaks(
                    one, mirrored, places[0], -places[1] if mirrored else places[1], order, context
                )
                for mirrored in (True, False)
            ]
        with np.errstate(all="ignore"):
            found = [_float_weight(side, scenes.lam[rows]) for side in sides]
            wanted, other = found if complement else found[::-1]
            ratio = other[0] - wanted[0]
            logs[rows] = -np.logaddexp(0.0, ratio)
            rest = -np.expm1(logs[rows])
            slack = 1e-14 * (8 + np.abs(other[0]) + np.abs(wanted[0]))
            steepest = np.abs(one.evaluate_float(np.linspace(-1, 1, 65))).max()
            slack = slack + input_rounding(rows_of(scenes, rows), np.full(len(rows), steepest))
            errors[rows] = 2 * rest * (wanted[1] + other[1]) + slack
            worst[rows] = np.maximum(wanted[1], other[1])
    bad = np.flatnonzero(~(worst < 0.5) | ~(errors < np.log(2)))
    if bad.size:
        raise _too_strong(f"{scenes.numbers['kappa'][bad[0]]:.6g}", order)
    return as_floats(request, scenes.shape, logs, errors, "estimate", terms, _DROPPED)


def _float_weight(peaks: list[Peak], lam: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Logarithm of the sum, and the size of what comes next relative to it."""
    total = error = np.full(lam.shape, -np.inf)
    for peak in peaks:
        height = lam * float(peak.height)
        sums = np.array(
            [
                sum((float(c) * lam ** -float(p) for c, p in group), np.zeros_like(lam))
                for group in peak.groups
            ]
        )
        # An error's place has no terms; a series whose sum is not positive is none.
        if any(peak.groups[:-2]):
            total = np.logaddexp(total, height + np.log(sums[:-2].sum(axis=0)))
        error = np.logaddexp(error, height + np.log(np.abs(sums[-2]) + np.abs(sums[-1])))
    return total, np.exp(error - total)
