"""float64 values of the exact integrals, for many scenes at once (`of_scenes`).

The sweeps of `symasym.exact.sweep` in logarithms (`symasym.numbers.float_arrays`), which carry
bounds on their errors. Panels are sampled where lam V varies by a few units and replaced by their
layers where it varies by hundreds (`symasym.exact.float_panels`), so the cost does not grow with
lam. What float64 cannot promise to a relative `TOLERANCE` is computed with more digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.call_context import step
from symasym.base.inputs import FloatArray, is_array
from symasym.drift.field.float_field import Field, IntArray, field_of
from symasym.exact import float_panels, float_sides, sweep
from symasym.exact.float_blocks import MODERATE, partition
from symasym.exact.float_records import Records, merged, records_of
from symasym.exact.sweep import InLayer, Record, Swept
from symasym.generated import formulas
from symasym.numbers.float_arrays import (
    DualArray,
    LogPositive,
    LogSlopes,
    slopes_of,
    value_of,
    with_log,
)
from symasym.scenes import (
    Answers,
    Request,
    Scenes,
    input_rounding,
    quantity_of,
    rows_of,
    scene_at,
)

if TYPE_CHECKING:
    from symasym.drift.field.directions import Directions

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that more digits gave and float64 rounded.
ROUNDING = 4e-16
_SCENES_AT_ONCE = 4096
# Behind a float64 value that was in doubt.
_FLOAT_DIGITS = 17
_ULP = 3e-16  # of a logarithm, its sum included
_UNDERFLOW = 1e-300  # below which slopes lose digits


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Logarithms right to `TOLERANCE`, and their errors by running analysis."""
    found = [_right_logs(some, request.name) for some in pieces(scenes)]
    logs, errors = found[0] if len(found) == 1 else map(np.concatenate, zip(*found, strict=True))
    return Answers(logs, errors, "estimate", (request.name,))


def pieces(scenes: Scenes) -> Iterator[Scenes]:
    """The scenes, so many at once that their numbers stay in the cache."""
    number = len(scenes.lam)
    if number <= _SCENES_AT_ONCE:
        yield scenes
        return
    for low in range(0, number, _SCENES_AT_ONCE):
        part = slice(low, low + _SCENES_AT_ONCE)
        parameters = {n: x[part] if is_array(x) else x for n, x in scenes.parameters.items()}
        yield rows_of(scenes, part)._replace(parameters=parameters)


def float_logs(scenes: Scenes, name: str, directions: Directions | None = None) -> tuple[Any, Any]:
    """Logarithms in float64 and their errors, however large these are; dual arrays where
    `directions` are given."""
    quantity = quantity_of(name)
    count = len(scenes.lam)
    numbers: dict[str, Any] = {n: scenes.numbers[n] for n in quantity.numbers if n != "kappa"}
    numbers |= {"complement": quantity.complement} if quantity.has_complement else {}
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        field = field_of(scenes.drift, scenes.parameters, count, directions)
        logs, errors = globals()[quantity.verb](field, scenes.lam, **numbers)
        errors += input_rounding(scenes, field.size()[:count])
        if directions:
            # What the start changes is known better (`_with_start`).
            change = input_rounding(scenes, field.size()[:count], ("kappa", "start"))
            errors.slopes += change * directions.largest_change(logs.slopes)
        return logs, errors


def _right_logs(scenes: Scenes, name: str) -> tuple[FloatArray, FloatArray]:
    """Logarithms in float64 and their errors; what is in doubt is evaluated with more digits."""
    logs, errors = float_logs(scenes, name)
    if (errors <= TOLERANCE).all():
        return logs, errors
    from symasym.exact.digits import of_scene

    closer = Request(name, "exact", None, _FLOAT_DIGITS, log=True, full=False)
    for row in np.flatnonzero(~(errors <= TOLERANCE * np.maximum(1.0, np.abs(logs)))):
        logs[row] = float(of_scene(scene_at(scenes, row), closer).value)
        errors[row] = ROUNDING * abs(logs[row])
    return logs, errors


class Logs(NamedTuple):
    """Natural logarithms of a quantity, and a bound on their absolute error by running analysis.

    Of a field with directions, dual arrays: the slopes of `error` estimate the errors of slopes.
    """

    value: Any
    error: Any


def escape_time(field: Field, lam: FloatArray, r: FloatArray, start: FloatArray) -> Logs:
    """log T (eq:Ttilde) of each scene; the error of a scene that is not resolved may be infinite.

    Parameters
    ----------
    field : Field
        Each scene and, after all of them, each mirror image.
    lam, r, start : arrays of shape (scenes,)
    """
    left, right = _from_both_ends(field, lam, r, start)
    time = _logs(sweep.escape_time(left, right))
    return _with_start(field, lam, time, "T", start, left, right)


def exit_probability(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray, complement: bool
) -> Logs:
    """log C (eq:C), or log(1 - C); parameters as in `escape_time`."""
    left, right = _from_both_ends(field, lam, r, start)
    sigmas = (right.sigma, left.sigma) if complement else (left.sigma, right.sigma)
    share = _logs(formulas.exit_share(*sigmas))
    return _with_start(field, lam, share, "1 - C" if complement else "C", start, left, right)


def stationary_density(field: Field, lam: FloatArray, y: FloatArray) -> Logs:
    """log p_ss(y) (eq:pss) of each scene, which must slide."""
    n = len(lam)
    end = np.concatenate((y, -y))
    rate = _rates(field, np.tile(lam, 2))
    panels = _panels(field, np.tile(lam, 2), np.full(2 * n, -np.inf), end)
    (w,) = panels.through(
        lambda w, p, lam: (sweep.carried_freely(w[0], p, lam),),
        (LogPositive.of(formulas.tail_left(field.a_minus)),),
        rate,
    )
    return _logs(sweep.density(rate[:n], w[:n], w[n:]))


def occupation(field: Field, lam: FloatArray, complement: bool) -> Logs:
    """log P (eq:P), or log(1 - P), of each scene, which must slide."""
    n = len(lam)
    one = np.ones(n)
    panels = _panels(field, lam, -one, one)
    nothing = LogPositive.of(np.zeros(n))
    a_minus, a_plus = _ends(field, n)
    before = LogPositive.of(formulas.tail_left(a_minus))
    layer = panels.through(
        lambda state, p, lam: sweep.carried_in_layer(InLayer(*state), p, lam),
        (nothing, before),
        _rates(field, lam),
    )
    after = LogPositive.of(formulas.tail_right(a_plus))
    wanted, rest = sweep.layer_times(InLayer(*layer), after, complement)
    return _logs(formulas.occupation_share(wanted, rest))


def _logs(quantity: LogPositive) -> Logs:
    """Logarithms and their errors, infinite where they are unknown."""
    bad = np.isnan(quantity.log + quantity.error)
    error = np.where(bad, np.inf, quantity.error)
    if not isinstance(quantity, LogSlopes):
        return Logs(np.asarray(quantity.log), error)
    unknown = np.isnan(quantity.slopes) | np.isnan(quantity.slope_error)
    return Logs(
        DualArray(quantity.log, quantity.slopes),
        DualArray(error, np.where(unknown, np.inf, quantity.slope_error + _UNDERFLOW)),
    )


def _with_start(
    field: Field,
    lam: FloatArray,
    logs: Logs,
    quantity: str,
    start: FloatArray,
    left: Swept,
    right: Swept,
) -> Logs:
    """The logarithms with their derivative in the start, from both sides of it, as the last.

    T' = (w_R sigma_R - w_L sigma_L)/(sigma_L + sigma_R); sigma is S/S' (see `exact.sweep`). Where
    r stretches the interval it has moved the start as well. A start that is not the one given moves
    the slopes, its own as T'' = -lam (1 + phi T') and C'' = -lam phi C'.
    """
    if not field.directions:
        return logs
    nothing = 0 * left.sigma
    if quantity == "T":
        w = left.w + right.w
        terms = right.w / w / left.sigma, left.w / w / right.sigma
    else:
        terms = (1 / left.sigma, nothing) if quantity == "1 - C" else (nothing, 1 / right.sigma)
    first, second = (np.exp(x.log) for x in terms)
    error = first * (terms[0].error + 4e-16) + second * (terms[1].error + 4e-16)
    error += _UNDERFLOW
    slope, error = first - second, np.where(np.isnan(error), np.inf, error)
    if off := 2.0 * field.directions.off:
        scene = np.arange(len(start))
        inside = field.phi(scene, np.clip(start, -1.0, 1.0)[:, None])[:, 0]
        ends = field.a_minus[scene], field.a_plus[scene]
        phi = np.where(start < -1.0, ends[0], np.where(start > 1.0, ends[1], inside))
        curved = phi * slope + (np.exp(-logs.value.value) if quantity == "T" else 0.0)
        error += off * (np.abs(lam * curved) + slope * slope)
        logs.error.slopes[:] += off * np.abs(first * terms[0].slopes - second * terms[1].slopes)
    moved = start * field.directions.stretch[: len(start)]
    logs.value.slopes[-1] -= moved * slope
    logs.error.slopes[-1] += np.abs(moved) * error
    return Logs(
        DualArray(logs.value.value, np.vstack((logs.value.slopes, slope))),
        DualArray(logs.error.value, np.vstack((logs.error.slopes, error))),
    )


def _rates(field: Field, lam: FloatArray) -> LogPositive:
    """lam, which changes with kappa."""
    return LogPositive.of(field.directions.rate(lam) if field.directions else lam)


def _ends(field: Field, count: int) -> tuple[Any, Any]:
    """a- and a+ of the first scenes."""
    ends = field.a_minus[:count], field.a_plus[:count]
    if not field.directions:
        return ends
    return field.directions.at_end(ends[0], -1.0), field.directions.at_end(ends[1], 1.0)


def _from_both_ends(
    field: Field, lam: FloatArray, r: FloatArray, start: FloatArray
) -> tuple[Swept, Swept]:
    """sigma and w at the start from the left and from the right."""
    n, rates = len(lam), np.concatenate((lam, lam))
    end, r = np.concatenate((start, -start)), np.concatenate((r, r))
    moderate, known = float_sides.swept(field, rates, r, end)
    sigma, w = known
    if len(moderate) < 2 * n:
        # A side that is known has no panels: both of its ends are -1.
        low, high = -r, end.copy()
        low[moderate] = high[moderate] = -1.0
        unknown = LogPositive.of(np.full(2 * n, np.nan))
        sigma, w = _panels(field, rates, low, high).through(
            lambda state, p, lam: sweep.carried(Swept(*state), p, lam),
            (unknown, unknown),
            _rates(field, rates),
            sweep.first,
        )
        for whole, some in zip((sigma, w), known, strict=True):
            whole[moderate] = some
    return Swept(sigma[:n], w[:n]), Swept(sigma[n:], w[n:])


class _Panels(NamedTuple):
    """Panels of many scenes, of each from `begin` on."""

    records: Record
    begin: IntArray
    number: IntArray

    def through(
        self,
        onward: Callable[[tuple[LogPositive, ...], Record, LogPositive], tuple[LogPositive, ...]],
        start: tuple[LogPositive, ...],
        lam: LogPositive,
        first: Callable[[Record, LogPositive], tuple[LogPositive, ...]] | None = None,
    ) -> tuple[LogPositive, ...]:
        """The numbers that `onward` makes of those at the `start`, one panel of each scene at once.

        The first panel takes `first` in its place where that is given.
        """
        # Scenes with more panels come first: those with a k-th one are the first of all.
        order = np.argsort(-self.number, kind="stable")
        lam, at, count = lam[order], self.begin[order], self.number[order]
        state = tuple(x[order] for x in start)
        for k in range(count.max(initial=0)):
            step()
            n = int(np.searchsorted(-count, -k, side="left"))
            panel = Record(*(x[at[:n] + k] for x in self.records))
            if first and k == 0:
                changed = first(panel, lam[:n])
            else:
                changed = onward(tuple(x[:n] for x in state), panel, lam[:n])
            state = tuple(x.followed_by(y[n:]) for x, y in zip(changed, state, strict=True))
        back = np.argsort(order)
        return tuple(x[back] for x in state)


def _panels(field: Field, lam: FloatArray, start: FloatArray, end: FloatArray) -> _Panels:
    """Panels from `start` to `end`; from u = -1 where `start` is -inf."""
    left = np.flatnonzero(np.isfinite(start) & (start < -1.0))
    before = _outer(field, lam, left, -1, np.minimum(end[left], -1.0) - start[left])
    blocks, anchors = partition(field, lam, np.maximum(start, -1.0), np.minimum(end, 1.0))
    ahead = np.full(len(lam), -np.inf)
    rise, int_e = (value_of(x) for x in before.moments[:2])
    ahead[left] = np.log(int_e) + np.maximum(-rise, 0.0)
    inside = records_of(field, lam, blocks, anchors, ahead)
    right = np.flatnonzero(end > 1.0)
    parts = [before, inside]
    if right.size:
        parts.append(_outer(field, lam, right, 1, end[right] - np.maximum(1.0, start[right])))
    records = merged(Records.joined(parts).sorted())
    count = np.bincount(records.scene, minlength=len(lam))
    # A panel is good to about 20 ulp, and to the rounding of phi in its exponent where phi
    # is not taken about a nearby centre.
    rounding = lam * field.size()[: len(lam)]
    local = 5e-15 + 8e-18 * np.where(rounding < MODERATE, rounding, 1e3)
    own = local[records.scene] + records.local
    rise = records.moments.rise
    up = rise > 0
    moved: Any = _ULP * np.abs(value_of(rise)) + value_of(records.shift)
    if isinstance(rise, DualArray):
        moved = DualArray(moved, _ULP * np.abs(rise.slopes) + slopes_of(records.shift))
    _, int_e, int_inverse, nested = records.moments
    logs = Record(
        LogPositive.of(int_e, own),
        LogPositive.of(int_inverse, own),
        LogPositive.of(nested, own),
        fall=with_log(np.where(up, 0.0, rise), np.where(up, 0.0, moved)),
        climb=with_log(np.where(up, -rise, 0.0), np.where(up, moved, 0.0)),
    )
    return _Panels(logs, np.cumsum(count) - count, count)


def _outer(field: Field, lam: FloatArray, scene: IntArray, side: int, h: FloatArray) -> Records:
    """One record a scene outside [-1, 1], in closed form."""
    part = -1 if side < 0 else np.iinfo(np.intp).max
    drift: Any = (field.a_minus if side < 0 else field.a_plus)[: len(lam)]
    if not field.directions:
        return Records.exactly(scene, part, float_panels.constant(lam[scene] * drift[scene], h))
    rate: Any = (field.directions.rate(lam) * field.directions.at_end(drift, side))[scene]
    width: Any = field.directions.outer_width(h) if side < 0 else h
    records = Records.exactly(scene, part, float_panels.constant(rate, width))
    known = field.rounding(scene, np.full((len(scene), 1), float(side)))[:, 0]
    relative = 1e-15 + 4 * known / np.maximum(field.size()[scene], 1e-300)
    missed = relative * np.abs(rate.slopes)
    missed[: len(field.directions.largest)] += (
        relative * lam[scene] * field.directions.largest[:, scene]
    )
    shift = h * missed + 1e-15 * np.abs(slopes_of(records.moments.rise))
    # The moments depend on x = lam a h no faster than on log x, or than e^x.
    local = missed * h / np.maximum(1.0, np.abs(rate.value) * h)
    local += 2e-15 * np.abs(slopes_of(width)) / h
    errors: dict[str, Any] = {
        "shift": DualArray(records.shift, shift), "local": DualArray(records.local, local)
    }  # fmt: skip
    return records._replace(**errors)
