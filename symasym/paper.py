"""The paper's own leading-order formulas, as printed (``method="paper"``)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import Any

import numpy as np

from symasym.base.contexts import mpf_of, own_context, to_mpf
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import Estimate
from symasym.base.inputs import FloatArray, digits, exact, floats, is_array
from symasym.drift.drift import Drift
from symasym.drift.scenes import exact_scene, float_scenes, one_scene, require_fits
from symasym.generated import mpmath_formulas, numpy_formulas


def escape_time(
    drift: Drift, kappa: Any, r: Any, start: Any, *, dps: int | None, log: bool, full: bool
) -> Any:
    """eq:Ttildesmall with the step eq:S, which is eq:Ttildelarge where there is no well.

    The paper's assumptions are checked: a crossing region, and no zero of A in
    (-1, 1) or exactly two, a well before a barrier in the direction of the
    crossing. The well counts if the barrier lies beyond the start, u = 0.
    """
    if is_array(start) or exact("start", start) != 0:
        raise InputError(
            f"start is {start}; the paper's formula is for start 0, use method='exact'."
        )
    numbers = {"kappa": kappa, "r": r, "start": start}
    if dps is not None or one_scene(drift, numbers):
        values = exact_scene(drift, numbers, dps)
        n = 17 if dps is None else digits(dps)
        result = _escape_by_digits(drift, values["kappa"], values["r"], n, log or dps is None)
        if dps is None:
            return _float_result(np.asarray(float(result)), log, full)
        return Estimate(result, None, "none", "paper") if full else result
    return _float_result(_escape_by_floats(drift, kappa, r), log, full)


def _float_result(logs: FloatArray, log: bool, full: bool) -> Any:
    require_fits("the value", logs, log)
    value: Any = logs if log else np.exp(logs)
    value = float(value) if value.ndim == 0 else value
    return Estimate(value, None, "none", "paper") if full else value


def _refuse_region(a_minus: Any, a_plus: Any) -> None:
    raise RegionError(
        f"a- = {float(a_minus):.6g} and a+ = {float(a_plus):.6g} are no crossing region, where "
        "the paper gives no escape time; use method='exact'."
    )


def _refuse_zeros(count: int) -> None:
    raise InputError(
        f"A has {count} zeros in (-1, 1), but the paper's formula is for none, or for one well "
        "followed by one barrier; use method='exact'."
    )


def _well_counts(u1: Any, u2: Any) -> bool:
    """The paper's condition for its multiplier to be 1: -1 < u1 < u2 < 1 and u2 > 0."""
    return bool(u1 < u2 and u2 > 0)


@dataclass(frozen=True)
class Well:
    """What eq:Ttildesmall needs of a drift that crosses: in the direction it goes.

    Attributes
    ----------
    ahead : mpf
        The drift beyond the layer, positive.
    slopes : tuple of mpf
        A' at the well and at the barrier, where the multiplier eq:S is 1.
    barrier : mpf or None
        V(u2) - V(u1); None where it is 0.
    """

    ahead: Any
    slopes: tuple[Any, ...] = ()
    barrier: Any = None


def well(drift: Drift, context: Any) -> Well:
    """The well before a barrier beyond the start, if there is one, at the context's precision.

    Raises
    ------
    RegionError
        If the drift does not cross.
    InputError
        If A has other zeros than those of one well and one barrier.
    """
    from symasym.drift.taylor_field import ExactField

    a_minus, a_plus = drift.ends
    if a_minus * a_plus <= 0:
        _refuse_region(a_minus, a_plus)
    down = a_plus < 0
    points = [p for p in drift.critical_points() if p.multiplicity % 2]
    if down:
        points = points[::-1]
    if len(points) not in (0, 2) or [p.kind for p in points] not in ([], ["well", "barrier"]):
        _refuse_zeros(len(points))
    field = ExactField(drift, down, context)
    ahead = mpf_of(field.value(Fraction(1)), context)
    if points:
        u1, u2 = (field.polish(-p.u if down else p.u) for p in points)
        if _well_counts(u1, u2):
            return Well(ahead, (field.slope(u1), field.slope(u2)), field.potential_rise(u1, u2))
    return Well(ahead)


def _escape_by_digits(drift: Drift, kappa: Fraction, r: Fraction, dps: int, log: bool) -> Any:
    with own_context(dps + 15) as context:
        # The exponent 2 V/kappa^2 has as many digits before the point as lam.
        with context.workprec(context.prec + max(0, _bits(2 / kappa**2))):
            found = well(drift, context)
            radius, noise = mpf_of(r, context), mpf_of(kappa, context)
            if found.barrier is None:
                total = mpmath_formulas.strong_noise_time(context, radius, found.ahead)
            else:
                low, high = found.slopes
                total = mpmath_formulas.weak_noise_time(
                    context, noise, radius, found.ahead, low, high, found.barrier
                )
        if log:
            total = context.log(total)
        return to_mpf(total, dps)


def _bits(x: Fraction) -> int:
    """Bits before the point, at least, or fewer than none."""
    return x.numerator.bit_length() - x.denominator.bit_length() + 1


def _escape_by_floats(drift: Drift, kappa: Any, r: Any) -> FloatArray:
    from symasym.drift.float_field import field_of

    scenes = float_scenes(drift, {"kappa": kappa, "r": r, "start": 0})
    k, radius = (scenes.numbers[name].reshape(scenes.shape) for name in ("kappa", "r"))
    # The landscape depends on the drift alone: find it once per drift, not per point.
    own = drift.shape
    count = int(np.prod(own, dtype=int))
    values = {
        n: np.broadcast_to(v, own).ravel() if is_array(v) else v for n, v in drift.values.items()
    }
    field = field_of(drift, values, count)
    for bad in np.flatnonzero(field.a_minus * field.a_plus <= 0):
        _refuse_region(field.a_minus[bad % count], field.a_plus[bad % count])
    scene = np.where(field.a_plus[:count] > 0, 0, count) + np.arange(count)
    u1, u2, number = _well_and_barrier(field, scene)
    for bad in number[(number != 0) & (number != 2)]:
        _refuse_zeros(int(bad))
    well = np.flatnonzero((number == 2) & (u2 > 0))
    # Any slopes will do where no well counts.
    low, high, rise = -np.ones(count), np.ones(count), np.full(count, -np.inf)
    if well.size:
        low[well], high[well] = (field.taylor(scene[well], u[well])[0][:, 1] for u in (u1, u2))
        rise[well] = _rise(field, scene[well], u1[well], u2[well])
    well_time = numpy_formulas.log_well_term(k, *(x.reshape(own) for x in (low, high, rise)))
    flight = np.log(numpy_formulas.strong_noise_time(radius, field.a_plus[scene].reshape(own)))
    total: FloatArray = np.logaddexp(well_time, flight)
    return total


def _well_and_barrier(field: Any, scene: Any) -> tuple[FloatArray, FloatArray, Any]:
    """First two zeros of A inside (-1, 1), and how many there are, for each scene."""
    from symasym.drift.float_field import extremes

    marks = extremes(field, scene)
    n = len(scene)
    edges = np.concatenate((np.full((n, 1), -1.0), marks, np.ones((n, 1))), axis=1)
    owner = np.repeat(scene, edges.shape[1])
    values = field.taylor(owner, edges.ravel())[0][:, 0].reshape(edges.shape)
    # A is monotone between neighbouring marks, so a change of sign brackets one zero.
    change = values[:, :-1] * values[:, 1:] < 0
    number = change.sum(axis=1)
    found = np.full((n, 2), np.nan)
    for which in range(2):
        rows = np.flatnonzero(number > which)
        if not rows.size:
            continue
        column = np.argmax(np.cumsum(change[rows], axis=1) == which + 1, axis=1)
        lo, hi = edges[rows, column], edges[rows, column + 1]
        found[rows, which] = _bracketed(
            partial(_phi_at, field, scene[rows]),
            lo,
            hi,
            values[rows, column] > 0,
        )
    return found[:, 0], found[:, 1], number


def _phi_at(field: Any, scene: Any, u: FloatArray) -> FloatArray:
    result: FloatArray = field.phi(scene, u[:, None])[:, 0]
    return result


def _bracketed(
    function: Callable[[FloatArray], FloatArray], lo: FloatArray, hi: FloatArray, positive_low: Any
) -> FloatArray:
    for _ in range(60):
        middle = (lo + hi) / 2
        same = (function(middle) > 0) == positive_low
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return (lo + hi) / 2


def _rise(field: Any, scene: Any, lo: FloatArray, hi: FloatArray) -> FloatArray:
    """V(hi) - V(lo) by Gauss-Legendre."""
    x, w = np.polynomial.legendre.leggauss(16)
    panels = 8
    offsets = ((np.arange(panels)[:, None] + (x + 1) / 2) / panels).ravel()
    weights = np.tile(w / 2 / panels, panels)
    values = field.phi(scene, lo[:, None] + (hi - lo)[:, None] * offsets)
    result: FloatArray = -(hi - lo) * (values @ weights)
    return result


def occupation(
    drift: Drift, kappa: Any, complement: bool, *, dps: int | None, log: bool, full: bool
) -> Any:
    """Leading term of eq:Plarge2 where it is below 1, else the bound behind eq:Psmall2.

    The bound is a lower bound on P; as an `Estimate` its error, 1 - P's bound,
    is of kind ``"bound"``, and that of eq:Plarge2 is of kind ``"none"``.
    """
    if dps is None and not one_scene(drift, {"kappa": kappa}):
        return _occupation_of_arrays(drift, kappa, complement, log, full)
    values = exact_scene(drift, {"kappa": kappa}, dps)
    n = 17 if dps is None else digits(dps)
    with own_context(n + 15) as context:
        a_minus, a_plus = (mpf_of(Fraction(x), context) for x in drift.ends)
        noise = mpf_of(values["kappa"], context)
        large = mpmath_formulas.strong_noise_occupation(context, noise, a_minus, a_plus)
        small = large >= 1
        p = _lower_bound(drift, noise, context) if small else large
        value = 1 - p if complement else p
        error = 1 - p if small else None
        if log:
            error = -context.log(p) if error is not None and not complement else None
            value = context.log(value)
        result = to_mpf(value, n)
        if error is not None:
            # Rounding the value must not let the truth out of the interval.
            slack = abs(value) * max(context.mpf(10) ** -n, 0 if dps else context.mpf(2) ** -52)
            error = to_mpf((error + slack) * (1 + context.mpf(10) ** -n), n)
    if dps is None:
        result, error = (
            float(result),
            None if error is None else float(np.nextafter(float(error), 2.0)),
        )
    if not full:
        return result
    return Estimate(result, error, "none" if error is None else "bound", "paper")


def _occupation_of_arrays(drift: Drift, kappa: Any, complement: bool, log: bool, full: bool) -> Any:
    k = floats("kappa", kappa)
    shape = drift.shape_with("kappa", k)
    flat = np.broadcast_to(k, shape).ravel()
    values = {
        n: np.broadcast_to(v, shape).ravel() if is_array(v) else v for n, v in drift.values.items()
    }
    found = np.array(
        [
            occupation(
                drift.bind(**{n: float(v[i]) if is_array(v) else v for n, v in values.items()}),
                float(x),
                complement,
                dps=None,
                log=log,
                full=False,
            )
            for i, x in enumerate(flat)
        ]
    ).reshape(shape)
    return Estimate(found, None, "none", "paper") if full else found


def _lower_bound(drift: Drift, noise: Any, context: Any) -> Any:
    """The unlabelled bound before eq:Psmall2, with the largest L that the drift allows."""
    from symasym.drift.taylor_field import ExactField

    field = ExactField(drift, False, context)
    top = field.potential_rise(context.mpf(-1), context.mpf(1))
    if top > 0:
        # V(1) > 0: the same in the mirrored variable, whose V at the right end is -V(1).
        field, top = ExactField(drift, True, context), -top
    a_minus, a_plus = (mpf_of(field.value(Fraction(x)), context) for x in (-1, 1))
    length = _stays_below(drift, field, context)
    return mpmath_formulas.occupation_bound(context, noise, a_minus, a_plus, length, top)


def _stays_below(drift: Drift, field: Any, context: Any) -> Any:
    """The largest L with V(u) <= V(1) for 1 - L <= u <= 1, where V(1) <= V(-1)."""
    side = -1 if field.mirrored else 1
    barriers = sorted(field.polish(side * p.u) for p in drift.barriers())
    wells = sorted(field.polish(side * p.u) for p in drift.wells())
    one = context.one
    peaks = [-one, *(b for b in barriers if field.potential_rise(b, one) < 0)]
    high = peaks[-1]
    low = min(w for w in wells if w > high)
    # V falls from its highest place left of 1 to this well, and crosses V(1) once.
    for _ in range(int(context.prec) + 8):
        middle = (low + high) / 2
        if field.potential_rise(middle, one) < 0:
            high = middle
        else:
            low = middle
    return one - low
