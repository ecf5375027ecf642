"""Float64 values of the exact integrals, for many scenes at once (`of_scenes`).

With y = 1/sigma and w = lam Q/sigma of both sides at the start (docs/exact.md)

    T = (w_L + w_R)/(y_L + y_R),    C = y_L/(y_L + y_R),
    E[tau^2] = 2 (T (p_L + p_R) + c_L + c_R)/(y_L + y_R)

(`float_sweep`). With -phi in place of phi, and the scale and speed density in each other's, sigma
is the time spent on one side: P is made of it, and p_ss = 1/(sigma_L + sigma_R). All terms are
positive, so that nothing cancels.

Panels are a row's own (`float_panels`) or shared by rows of similar shape (`float_together`). The
claimed error is an estimate: rounding to first order, with constants that were checked against
balls. A row in doubt is swept once more with A in long double, then in balls, as are higher
moments and the line's stationary state without a layer. lam and the drift's parameters may be
complex (derivatives by a complex step).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from symasym.base.errors import AccuracyError
from symasym.base.inputs import is_array
from symasym.drift.sampled import Field
from symasym.drift.scenes import (
    Answers,
    Request,
    Scenes,
    ends_of,
    moved_places,
    quantity_of,
    scene_at,
)
from symasym.exact.balls import of_scene
from symasym.exact.float_integrals import ULP, Logs
from symasym.exact.float_panels import OF_A, seen
from symasym.exact.float_sweep import absorbing, shares, swept

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that balls gave and float64 rounded.
ROUNDING = 4e-16
_COEFFICIENTS = 16384  # of all scenes at once, whose panels stay in memory
_MOMENTS = 2
_HALVES = ("left", "right")


@np.errstate(all="ignore")
def logs_of(
    name: str,
    of: Field,
    numbers: Mapping[str, Any],
    moment: int = 1,
    reflecting: str | None = None,
) -> Logs:
    """log of "T", "C", "1 - C", "P", "1 - P" or "p_ss", and its estimated error, maybe infinite.

    `numbers` are arrays: kappa, which may be complex, and the quantity's own ones.
    """
    lam = 2.0 / (numbers["kappa"] * numbers["kappa"])
    found, many = [], max(256, _COEFFICIENTS // max(part.terms for part in of.parts))
    for low in range(0, len(lam), many):
        rows = np.arange(low, min(low + many, len(lam)))
        some = {n: x[rows] for n, x in numbers.items()}
        if name in ("T", "C", "1 - C"):
            found.append(_of_exit(name, of, lam[rows], some, rows, moment, reflecting))
        else:
            found.append(_of_stay(name, of, lam[rows], some, rows))
    logs, errors = map(np.concatenate, zip(*found, strict=True))
    return Logs(logs, np.where(np.isnan(logs + errors), np.inf, errors))


def _of_exit(
    name: str,
    of: Field,
    lam: Any,
    numbers: Mapping[str, Any],
    rows: Any,
    moment: int,
    reflecting: str | None,
) -> Logs:
    start, ends = numbers["start"], ends_of(numbers)
    rate, w, *more = sides(of, lam, ends, (start, start), rows, moment, reflecting)
    if name != "T":
        return _share(*(rate if name == "C" else rate[::-1]))
    (log, error), (other, of_other) = _total(*w), _total(*rate)
    time = Logs(log - other, error + of_other)
    if moment == 1:
        return time
    square, cross = (_total(*x) for x in more)
    both = Logs(time.log + square.log, time.error + square.error)
    log, error = _total(both, cross)
    return Logs(np.log(2.0) + log - other, error + of_other + ULP)


def _of_stay(name: str, of: Field, lam: Any, numbers: Mapping[str, Any], rows: Any) -> Logs:
    n, one, layer = len(lam), np.ones(len(lam)), "left" not in numbers
    low, high = numbers.get("low", -one), numbers.get("high", one)
    if name == "p_ss":
        low = high = numbers["y"]
    ends = (np.minimum(low, -1.0), np.maximum(high, 1.0)) if layer else ends_of(numbers)
    low, high = np.clip(low, *ends), np.clip(high, *ends)
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    phi, two = seen(of, rows, far, -1.0, True), np.tile(lam, 2)
    loose = max(side.loose for side in phi)
    begin, end = np.concatenate((ends[0], -ends[1])), np.concatenate((low, -high))
    state = absorbing(two)
    if layer:
        a, of_a, log = phi[0].end(-1)
        power = of.powers[1] if of.powers else 0.0
        state.log[0], state.log[1] = np.log(-two * a) - power * log, 0.0
        state.error[0] = of_a / -a.real + ULP * (2 + np.abs(state.log[0])) + loose
    (log, *_), (error, *_) = swept(phi, two, begin, end, state)
    before, after = Logs(-log[:n], error[:n]), Logs(-log[n:], error[n:])
    if name == "p_ss":
        log, error = _total(before, after)
        if of.powers:
            u = np.clip(low, -1.0, 1.0)[None]
            log = log - of.powers[1] * of.parts[0].log_noise(u, rows)[0]
        return Logs(-log, error + loose)
    middle = seen(of, rows, far, -1.0)
    (y, _, e), (of_y, _, of_e) = swept(middle, lam, low, high, absorbing(lam))
    outside = _total(Logs(before.log - e, before.error + of_e + 4 * ULP), after)
    inside = Logs(-y, of_y)
    return _share(inside, outside) if name == "P" else _share(outside, inside)


@np.errstate(all="ignore")
def sides(
    of: Field,
    lam: Any,
    ends: tuple[Any, Any],
    until: tuple[Any, Any],
    rows: Any,
    order: int = 1,
    reflecting: str | None = None,
) -> list[list[Logs]]:
    """y and w, for order 2 p and c, from the left end at until[0], from the right at until[1]."""
    n, two = len(lam), np.tile(lam, 2)
    phi = seen(of, rows, np.maximum(np.abs(ends[0]), np.abs(ends[1])), both=True)
    begin, end = (np.concatenate((a, -b)) for a, b in (ends, until))
    back = np.repeat([side == reflecting for side in _HALVES], n)
    log, error = swept(phi, two, begin, end, absorbing(two, order, back))
    log, error = (x.reshape(-1, 2, n) for x in (log, error))
    return [
        [Logs(log[k, side], error[k, side]) for side in (0, 1)] for k in (0, 1, 3, 4)[: 2 * order]
    ]


def _total(x: Logs, y: Logs) -> Logs:
    """The sum of positive numbers."""
    of_x, of_y, log = shares(x.log, y.log)
    return Logs(log, of_x * x.error + of_y * y.error + ULP * (2 + np.abs(log)))


def _share(x: Logs, rest: Logs) -> Logs:
    """x/(x + rest)."""
    part, other, log = shares(x.log, rest.log)
    value = np.where(part > 0.5, -np.log1p(np.exp(rest.log - x.log)), x.log - log)
    error = other * (x.error + rest.error + ULP * (np.abs(x.log) + np.abs(rest.log)))
    return Logs(value, error + ULP * (1 + np.abs(value)))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Logarithms right to `TOLERANCE`, and their estimated errors; in doubt by balls."""
    logs, errors = found = float_logs(scenes, request)
    closer = request._replace(dps=17, log=True, full=False)
    why = ""
    for row in _in_doubt(found):
        try:
            logs[row] = float(of_scene(scene_at(scenes, row), closer).value)
        except AccuracyError as error:
            logs[row], why = np.nan, why or str(error)
        errors[row] = ROUNDING * abs(logs[row]) + 5e-324
    return Answers(logs, errors, "estimate", (request.name,), why=why)


def float_logs(scenes: Scenes, request: Request) -> Logs:
    """Logarithms in float64 and their errors, however large these are, in two rounds."""
    name, moment, reflecting = request.name, request.moment, request.reflecting
    numbers, model = scenes.numbers, scenes.drift.model
    if "start" not in quantity_of(name).numbers:
        numbers = {n: x for n, x in numbers.items() if n not in ("r", "start")}
    values, count, span = scenes.parameters, len(scenes.lam), (-1.0, 1.0)
    if moment > _MOMENTS or not (model.layered or numbers.keys() & {"r", "left"}):
        return Logs(np.zeros(count), np.full(count, np.inf))
    if not model.layered:
        ends = scenes.ends
        span = float(ends[0].min()), float(ends[1].max())
    of = Field(scenes.drift, values, count, span)
    found = logs_of(name, of, numbers, moment, reflecting)
    if of.exact and (some := _in_doubt(found)).size:
        values = {n: x[some] if is_array(x) else x for n, x in values.items()}
        longer = Field(scenes.drift, values, len(some), span, long=True)
        fewer = {n: x[some] for n, x in numbers.items()}
        found.log[some], found.error[some] = logs_of(name, longer, fewer, moment, reflecting)
    moved, room = moved_places(scenes)
    if moved:  # no faster than lam |phi|, or as two places come close to each other
        far = np.full(count, max(map(abs, span)))
        size = np.max([side.off for side in seen(of, np.arange(count), far)], axis=0) / OF_A
        found.error[:] += moved * (scenes.lam * size + 2 / room)
    return found


def _in_doubt(found: Logs) -> Any:
    return np.flatnonzero(~(found.error <= TOLERANCE * np.maximum(1.0, np.abs(found.log))))
