"""Weak noise for arrays of scenes: each drift's places once, then all its kappa and r."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.places_double import Found, found_of, scenes_of
from symasym.asymptotics.places_double import Scenes as PolynomialScenes
from symasym.asymptotics.sights import Series, Sight, added, first_of
from symasym.asymptotics.weak_noise_double import Point
from symasym.drift import Drift
from symasym.exact.fields import IntArray
from symasym.inputs import FloatArray, is_array
from symasym.scenes import Scenes, input_rounding, rows_of

# Scenes at once: work arrays stay in the second-level cache.
_AT_ONCE = 4096
# Of one drift, whose coefficients are plain numbers; above 128 kB an array may cost page faults.
_OF_ONE = 12288
# More values of kappa than that for one drift are taken apart from other drifts'.
_MANY = 256
# Where errors are not asked for, they are looked at in so many places; the refusal
# of a scene is for errors 1e3 times larger than is let pass so.
_PROBES = 192
_SMALL = 1e-3

Sights = tuple[Sight, Sight]
Evaluate = Callable[[Sights, tuple[Series, Series], Any, Point], tuple[FloatArray, Any]]
Analyse = Callable[[dict[str, float], float, float], Sights]
Find = Callable[[PolynomialScenes, int], Iterator[Found]]


class Drifts(NamedTuple):
    """What distinguishes the places: parameters, start and r where it is inside the layer.

    `rows[i]` are the scenes of the i-th.
    """

    parameters: dict[str, FloatArray]
    start: FloatArray
    radius: FloatArray
    rows: IntArray


def logs_of(
    drift: Drift,
    scenes: Scenes,
    shapes: list[tuple[int, ...]],
    orders: Any,
    evaluate: Evaluate,
    analyse: Analyse | None,
    full: bool,
    find: Find = found_of,
) -> tuple[FloatArray, FloatArray]:
    """Logarithms and their errors; errors are only told from "too large" unless `full`.

    What `find` does not find in float64 goes to `analyse`, or is left with infinite errors.
    """
    drifts = _drifts(scenes, shapes)
    logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    with np.errstate(all="ignore"):
        for chosen, sights in _all_sights(drift, scenes, drifts, orders[-1], analyse, find):
            rows = drifts.rows[chosen].T
            _fill(sights, scenes, rows, orders, evaluate, full, logs, errors)
        errors += rounding_of_places(drift, scenes)
    return logs, errors


def _drifts(scenes: Scenes, shapes: list[tuple[int, ...]]) -> Drifts:
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    common = np.broadcast_shapes(*shapes)
    own = (1,) * (len(scenes.shape) - len(common)) + common
    count = int(np.prod(own))
    if count == 1:
        rows = np.arange(len(r))[None]
    else:
        index = np.broadcast_to(np.arange(count).reshape(own), scenes.shape).ravel()
        rows = np.argsort(index, kind="stable").reshape(count, -1)
    first = rows[:, 0]
    given = {n: x[first] for n, x in scenes.parameters.items() if is_array(x)}
    # Beyond the layer the radius enters only where the sums are evaluated.
    radius = np.where(r[first] > 1, 2.0, r[first])
    return Drifts(given, start[first], radius, rows)


def _all_sights(
    drift: Drift,
    scenes: Scenes,
    drifts: Drifts,
    order: int,
    analyse: Analyse | None,
    find: Find,
) -> Iterator[tuple[IntArray, Sights]]:
    """In float64 where that is enough, else one by one with more digits."""
    left = np.ones(len(drifts.start), dtype=bool)
    values = {**scenes.parameters, **drifts.parameters}
    known = scenes_of(drift, values, drifts.start, drifts.radius)
    if known is not None:
        for found in find(known, order):
            left[found.rows] = False
            if len(found.rows) > 1 and drifts.rows.shape[1] > _MANY:
                yield from _apart(found.rows, found.sights)
            else:
                yield found.rows, found.sights
    rest = np.flatnonzero(left)
    if analyse is None or not rest.size:
        return
    columns = [*drifts.parameters.values(), drifts.radius, drifts.start]
    unique, first, group = np.unique(
        np.array([x[rest] for x in columns]).T, axis=0, return_index=True, return_inverse=True
    )
    for k in range(len(unique)):
        one = rest[first[k]]
        given = {name: float(x[one]) for name, x in drifts.parameters.items()}
        sights = analyse(given, float(drifts.radius[one]), float(drifts.start[one]))
        yield rest[group.ravel() == k], sights


def _apart(rows: IntArray, sights: Sights) -> Iterator[tuple[IntArray, Sights]]:
    for k in range(len(rows)):
        yield rows[k : k + 1], _picked(sights, k)


def _picked(found: Any, k: int) -> Any:
    """One of the drifts."""
    if isinstance(found, np.ndarray):
        return found[k : k + 1]
    if isinstance(found, list):
        return [_picked(x, k) for x in found]
    if isinstance(found, tuple):
        parts = [_picked(x, k) for x in found]
        return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
    return found


def _fill(
    sights: Sights,
    scenes: Scenes,
    rows: IntArray,
    orders: Any,
    evaluate: Evaluate,
    full: bool,
    logs: FloatArray,
    errors: FloatArray,
) -> None:
    """Scenes `rows`, one column a drift of `sights`, or all of one drift."""
    one = rows.shape[1] == 1 or not any(np.size(h) > 1 for s in sights for h in _heights(s))
    if one:
        rows, sights = rows.ravel(), first_of(sights)
    starts = (
        added(sights[0].rising_start, sights[1].rising_start),
        added(sights[0].falling_start, sights[1].falling_start),
    )
    r = scenes.numbers["r"]
    # A radius that all scenes share keeps its exponents shared as well.
    first = float(r[rows.flat[0]])
    shared = first if r.strides == (0,) or (r[rows] == first).all() else None

    def at(part: IntArray, order: int, wanted: bool) -> tuple[FloatArray, Any]:
        point = Point(scenes.lam[part], order, wanted)
        return evaluate(sights, starts, r[part] if shared is None else shared, point)

    if one and len(orders) == 1 and not full and len(rows) > 4 * _PROBES:
        probes = _probes(scenes.lam[rows])
        error = at(rows[probes], orders[0], True)[1]
        if (error < _SMALL).all():
            for low in range(0, len(rows), _OF_ONE):
                part = rows[low : low + _OF_ONE]
                logs[part] = at(part, orders[0], False)[0]
            errors[rows] = error.max()
            return
    step = max(1, _AT_ONCE // (1 if one else rows.shape[1]))
    for low in range(0, len(rows), step):
        part = rows[low : low + step]
        log, error = np.full(part.shape, np.nan), np.full(part.shape, np.inf)
        for n in orders:
            found, wrong = at(part, n, True)
            better = wrong < error
            log, error = np.where(better, found, log), np.where(better, wrong, error)
        logs[part], errors[part] = log, error


def _heights(sight: Sight) -> list[Any]:
    return [sight.rough, *(spot.height for spot in sight.rising + sight.falling)]


def _probes(lam: FloatArray) -> IntArray:
    """Some scenes over the whole range of lam, its ends among them."""
    low, high = np.argmin(lam), np.argmax(lam)
    spread = np.geomspace(lam[low], lam[high], _PROBES)
    # Bins of log(lam), one member each: cheaper than sorting.
    inner = spread[1:-1]
    steps = np.linspace(0, len(lam) - 1, 16 * _PROBES).astype(np.intp)
    some = steps[np.searchsorted(np.sort(lam[steps]), inner).clip(0, len(steps) - 1)]
    found: IntArray = np.concatenate(([low, high], some))
    return found


def rounding_of_places(drift: Drift, scenes: Scenes) -> Any:
    """What reading r and start as floats changes in log T, at most."""
    if not any(gap.any() for name, gap in scenes.moved.items() if name != "kappa"):
        return 0.0
    grid = np.linspace(-1, 1, 65)
    values = {
        name: np.asarray(x, dtype=float)[..., None] if is_array(x) else np.asarray(float(x))
        for name, x in scenes.parameters.items()
    }
    size = np.abs(drift.evaluate_float(grid, values)).max(axis=-1)
    return input_rounding(rows_of(scenes, slice(None)), np.broadcast_to(size, scenes.lam.shape))
