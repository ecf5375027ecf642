"""Weak noise for arrays of scenes: each drift's expansions once, then all its kappa and r.

Drifts whose A is a polynomial, its coefficients in float64 to the last digit, are expanded together
where their zeros of A, the start and the radius come in the same order (`structure`), others one by
one with more digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import is_dataclass, replace
from functools import lru_cache, partial
from operator import itemgetter
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.compose import Composed
from symasym.asymptotics.weak_noise.interpolation import columns, of_one
from symasym.asymptotics.weak_noise.one_sided import Builder, OneSided, PolynomialScenes, edges_of
from symasym.asymptotics.weak_noise.series import Point, Sizes
from symasym.base.inputs import FloatArray, IntArray, is_array
from symasym.drift.drift import Drift
from symasym.numbers.float_arrays import DoubleDouble, DoubleDoubleOps, shift
from symasym.numbers.polynomials import Zeros, poly, zeros_of
from symasym.scenes import Scenes, by_drift, grouped, input_rounding, rows_of

# Scenes at once: the work arrays of one step, about twenty with errors and ten without, stay in
# the second-level cache, and below what the C library gives back to the system at every step.
_AT_ONCE = 4096
_WITHOUT_ERRORS = 12288
# Drifts at once: with a quarter of them NumPy's cost per call doubles the time; twice as many
# are no quicker and take twice the memory.
_DRIFTS_AT_ONCE = 4096
# Zeros of A whose rounding, relative to their distances, is more than this are not used; of one
# drift, whose zeros with more digits cost little.
_MOST_ROUNDING, _MOST_OF_ONE = 1e-10, 1e-13
_MOST_DEGREE = 12
# |A| at the start, at an end or at a kink beside its largest term, below which it is not known.
_NEAREST = 1e-7
# More values of kappa than that for one drift are taken apart from other drifts'.
_MANY = 256
# Where errors are not asked for, they are looked at for so many scenes; the refusal
# of a scene is for errors 1e3 times larger than is let pass so.
_PROBES = 192
_SMALL = 1e-3
# The same where logarithms may be interpolated: by a factor 30.
_SMALL_SMOOTH = 0.03

Expansions = tuple[OneSided, OneSided]


class ExpandedScenes(NamedTuple):
    """The two sides of these scenes, left and right."""

    rows: IntArray
    sides: Expansions


def scenes_of(
    drift: Drift, values: dict[str, Any], start: FloatArray, r: FloatArray
) -> PolynomialScenes | None:
    """None where A is not a polynomial of modest degree."""
    count = len(start)
    if count == 1 and not drift.shape:
        exact = _exact_scene(drift, start, r)
        if exact is not None:
            return exact
    pairs = {name: DoubleDouble.of(x).broadcast_to((count,)) for name, x in values.items()}
    known = drift.coefficients(pairs, DoubleDoubleOps())
    if known is None or not 0 < len(known) <= _MOST_DEGREE + 1:
        return None
    shaped = [DoubleDouble.of(c).broadcast_to((count,)) for c in known]
    ends = [shift(shaped, np.full(count, side))[0] for side in (-1.0, 1.0)]
    return PolynomialScenes(np.array([c.hi + c.lo for c in shaped]), ends[0], ends[1], start, r)


def _exact_scene(drift: Drift, start: FloatArray, r: FloatArray) -> PolynomialScenes | None:
    """The scene of a drift with rational coefficients, each rounded once; None of any other."""
    known = drift.exact_coefficients()
    if known is None or len(known) > _MOST_DEGREE + 1:
        return None
    alternating = (c if k % 2 == 0 else -c for k, c in enumerate(known))
    try:
        numbers = [float(c) for c in (*known, sum(alternating), sum(known))]
    except OverflowError:
        return None
    *c, a_minus, a_plus = np.array(numbers)[:, None]
    return PolynomialScenes(np.array(c), a_minus, a_plus, start, r)


def clear_of_zero(scenes: PolynomialScenes, ends: bool = True) -> Any:
    """True where A is not too small at the start and at r, and at the layer's `ends`."""
    good = (scenes.a_minus != 0) & (scenes.a_plus != 0)
    c, sizes = list(scenes.c), list(np.abs(scenes.c))
    for u in edges_of(scenes):
        clear = np.abs(poly(c, u)) > _NEAREST * poly(sizes, np.abs(u))
        good &= clear if ends else clear | (np.abs(u) == 1)
    return good


def structure(scenes: PolynomialScenes, zeros: Zeros) -> IntArray:
    """One number for each way in which zeros, start and radius may be ordered."""
    low, middle, high = edges_of(scenes)
    key = zeros.real * 2 + (scenes.r > 1)
    for edge in (low, middle, high):
        # Beyond the real zeros a row goes on with infinities.
        key = key * 16 + (zeros.values.real < edge).sum(axis=0)
    start = scenes.start
    outside = (start < -1) + 2 * (start == -1) + 3 * (start == 1) + 4 * (start > 1)
    key_of_order: IntArray = (key * 8 + outside) * 2 + (scenes.c[-1] > 0)
    return key_of_order


def expanded_of(scenes: PolynomialScenes, order: int) -> Iterator[ExpandedScenes]:
    """The expansions of all scenes that float64 is enough for, chunk by chunk."""
    degree = np.where(scenes.c != 0, np.arange(len(scenes.c))[:, None], 0).max(axis=0)
    for d in np.unique(degree):
        rows = np.flatnonzero(degree == d)
        zeros = zeros_of(scenes.c[: d + 1, rows])
        good = zeros.apart & clear_of_zero(scenes.take(rows))
        keys = structure(scenes.take(rows), zeros)
        for key in np.unique(keys[good]):
            members = np.flatnonzero(good & (keys == key))
            for low in range(0, len(members), _DRIFTS_AT_ONCE):
                chosen = members[low : low + _DRIFTS_AT_ONCE]
                some = scenes.take(rows[chosen])
                some = some._replace(c=some.c[: d + 1])
                built = _built(rows[chosen], some, zeros.take(chosen), order)
                if built is not None:
                    yield built


def _built(
    rows: IntArray, scenes: PolynomialScenes, zeros: Zeros, order: int
) -> ExpandedScenes | None:
    """Expansions of scenes of one structure, where float64 is enough."""
    if len(rows) == 1:
        try:
            builder = Builder(scenes, zeros, order, plain=True)
            sure = builder.largest_rounding() < _MOST_OF_ONE and builder.estimated()
            return ExpandedScenes(rows, builder.both_sides()) if sure else None
        except (ArithmeticError, ValueError):
            # Python refuses what NumPy makes infinite.
            pass
    builder = Builder(scenes, zeros, order)
    sure = np.broadcast_to(
        (builder.largest_rounding() < _MOST_ROUNDING) & builder.estimated(), rows.shape
    )
    if not sure.any():
        return None
    if not sure.all():
        chosen = np.flatnonzero(sure)
        builder = Builder(scenes.take(chosen), zeros.take(chosen), order)
    return ExpandedScenes(rows[sure], builder.both_sides())


FloatLog = Callable[[Composed, Point], tuple[FloatArray, Any]]
Analyse = Callable[[Drift, float, float], Expansions]
Find = Callable[[PolynomialScenes, int], Iterator[ExpandedScenes]]


class Drifts(NamedTuple):
    """What tells one expansion from another: parameters, start and r where it is inside the layer.

    `rows[i]` are the scenes of the i-th; None where one drift has all.
    """

    parameters: dict[str, FloatArray]
    start: FloatArray
    radius: FloatArray
    rows: IntArray | None


def logs_of(
    drift: Drift,
    scenes: Scenes,
    shapes: list[tuple[int, ...]],
    orders: Sequence[int],
    evaluate: FloatLog,
    analyse: Analyse | None,
    full: bool,
    find: Find = expanded_of,
    index: IntArray | None = None,
    smooth: bool = False,
) -> tuple[FloatArray, FloatArray]:
    """Logarithms and their errors; errors are only known not to be too large unless `full`.

    Which scenes have a drift, start and radius in common follows from the `shapes` of these, or
    follows from `index`, a number for each (see `index_of`). `smooth`: logarithms may be
    interpolated between values of lam, where one costs so much that it pays.

    What `find` does not find in float64 goes to `analyse`, or is left with infinite errors. An
    error that all scenes share may come as an array of one.
    """
    logs = errors = np.empty(0)
    with np.errstate(all="ignore"):
        if index is None and shapes:
            index = index_of(shapes, scenes.shape)
        for drifts in _grouped(scenes, index):
            # One drift has all scenes, or none.
            if drifts.rows is not None and not logs.size:
                logs, errors = (np.full(len(scenes.lam), x) for x in (np.nan, np.inf))
            for chosen, sides in _all_expansions(drift, scenes, drifts, orders[-1], analyse, find):
                if drifts.rows is None:
                    some: Any = slice(None)
                else:
                    some = drifts.rows[chosen].T
                    if _single(sides):
                        some = some.ravel()
                values, wrong = _filled(
                    sides, rows_of(scenes, some), orders, evaluate, full, smooth
                )
                if drifts.rows is None:
                    logs, errors = values, wrong
                else:
                    logs[some], errors[some] = values, wrong
        if not errors.size:
            logs, errors = (np.full(len(scenes.lam), x) for x in (np.nan, np.inf))
        errors = errors + rounding_of_places(drift, scenes)
    return logs, errors


def own_shapes(drift: Drift, numbers: dict[str, Any], scenes: Scenes) -> list[tuple[int, ...]]:
    """Shapes of what the expansions depend on: parameters, start, and r inside the layer."""
    shapes = [np.shape(x) for x in (*drift.values.values(), numbers.get("start")) if is_array(x)]
    if is_array(numbers.get("r")) and (scenes.numbers["r"] <= 1).any():
        shapes.append(np.shape(numbers["r"]))
    return shapes


def index_of(shapes: list[tuple[int, ...]], shape: tuple[int, ...]) -> IntArray:
    """The number of its drift, start and radius for each scene."""
    common = np.broadcast_shapes(*shapes)
    own = (1,) * (len(shape) - len(common)) + common
    count = np.arange(int(np.prod(own)))
    return np.broadcast_to(count.reshape(own), shape).ravel()


def _grouped(scenes: Scenes, index: IntArray | None) -> Iterator[Drifts]:
    """Drifts with about as many scenes each; what one has less it has several times."""
    if index is None or not len(index) or (index == index[0]).all():
        yield _drifts_of(scenes, None)
        return
    order, first, count = grouped(index)
    width = 2 ** np.ceil(np.log2(count)).astype(np.intp)
    for most in np.unique(width):
        chosen = np.flatnonzero(width == most)
        columns = np.arange(count[chosen].max())
        taken = np.minimum(columns, count[chosen, None] - 1)
        yield _drifts_of(scenes, order[first[chosen, None] + taken])


def _drifts_of(scenes: Scenes, rows: IntArray | None) -> Drifts:
    """The first scene of every drift as what tells it from the others."""
    first = np.zeros(1, dtype=np.intp) if rows is None else rows[:, 0]
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    given = {n: x[first] for n, x in scenes.parameters.items() if is_array(x)}
    # Beyond the layer the radius enters only where the sums are evaluated.
    radius = np.where(r[first] > 1, 2.0, r[first])
    return Drifts(given, start[first], radius, rows)


def _all_expansions(
    drift: Drift,
    scenes: Scenes,
    drifts: Drifts,
    order: int,
    analyse: Analyse | None,
    find: Find,
) -> Iterator[tuple[IntArray, Expansions]]:
    """Expansions in float64 where that is enough, else one by one with more digits."""
    left = np.ones(len(drifts.start), dtype=bool)
    if len(left) == 1 and not drift.shape:
        every: Iterable[ExpandedScenes] = _of_one(
            drift, float(drifts.start[0]), float(drifts.radius[0]), order, find
        )
    else:
        values = {**scenes.parameters, **drifts.parameters}
        known = scenes_of(drift, values, drifts.start, drifts.radius)
        every = () if known is None else find(known, order)
    for built in every:
        left[built.rows] = False
        if drifts.rows is not None and len(built.rows) > 1 and drifts.rows.shape[1] > _MANY:
            yield from _apart(built.rows, built.sides)
        else:
            yield built.rows, built.sides
    rest = np.flatnonzero(left)
    if analyse is None or not rest.size:
        return
    radius, start = drifts.radius[rest], drifts.start[rest]
    given = {name: x[rest] for name, x in drifts.parameters.items()}
    some = scenes._replace(parameters={**scenes.parameters, **given}, lam=start)
    for one, rows in by_drift(some, radius, start):
        yield rest[rows], analyse(one, float(radius[rows[0]]), float(start[rows[0]]))


@lru_cache(maxsize=32)
def _of_one(
    drift: Drift, start: float, radius: float, order: int, find: Find
) -> list[ExpandedScenes]:
    """The expansions of one drift in float64, for the next question about it."""
    known = scenes_of(drift, dict(drift.values), np.array([start]), np.array([radius]))
    return [] if known is None else list(find(known, order))


def _apart(rows: IntArray, sides: Expansions) -> Iterator[tuple[IntArray, Expansions]]:
    """The expansions of many drifts one by one."""
    for k in range(len(rows)):
        yield rows[k : k + 1], mapped(sides, itemgetter(slice(k, k + 1)))


def mapped(value: Any, change: Callable[[FloatArray], Any]) -> Any:
    """The same with `change` made to every array in it."""
    if isinstance(value, np.ndarray):
        return change(value)
    if isinstance(value, list):
        return [mapped(x, change) for x in value]
    if isinstance(value, tuple):
        parts = [mapped(x, change) for x in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{name: mapped(x, change) for name, x in vars(value).items()})
    return value


def first_of(value: Any) -> Any:
    """The same with the arrays' first entries: NumPy is quicker with plain numbers."""
    return mapped(value, lambda x: float(x.ravel()[0]))


def _single(sides: Expansions) -> bool:
    """True for the expansions of one drift."""
    return not any(np.size(height) > 1 for side in sides for height in _heights(side))


def _filled(
    sides: Expansions,
    scenes: Scenes,
    orders: Sequence[int],
    evaluate: FloatLog,
    full: bool,
    smooth: bool,
) -> tuple[FloatArray, FloatArray]:
    """Scenes in columns, one a drift of `sides`, or all of one drift."""
    one, lam, r = scenes.lam.ndim == 1, scenes.lam, scenes.numbers["r"]
    if one and not isinstance(sides[0].height_rounding, float):
        sides = first_of(sides)
    # A radius that all scenes share keeps its exponents shared as well.
    first = float(r.flat[0])
    sizes = _sizes(sides)
    shared = Composed(sides, first) if r.strides == (0,) or (r == first).all() else None

    def at(part: slice | IntArray, order: int, wanted: bool) -> tuple[FloatArray, Any]:
        composed = Composed(sides, r[part]) if shared is None else shared
        return evaluate(composed, Point(lam[part], order, wanted, sizes))

    if one and len(orders) == 1 and not full and len(lam) > 4 * _PROBES:
        if smooth and shared is not None:
            composed = shared
            known = of_one(
                lambda x: evaluate(composed, Point(x, orders[0], True, sizes)), lam, _SMALL_SMOOTH
            )
            if known is not None:
                return known
        error = at(_probes(lam), orders[0], True)[1]
        if (error < _SMALL).all():
            logs: FloatArray = np.empty(lam.shape)
            for low in range(0, len(lam), _WITHOUT_ERRORS):
                part = slice(low, low + _WITHOUT_ERRORS)
                logs[part] = at(part, orders[0], False)[0]
            return logs, np.array([error.max()])
    if smooth and not (one or full) and shared is not None and (lam == lam[:, :1]).all():
        between = _between(sides, lam, shared, orders[0], evaluate)
        if between is not None:
            logs, errors, good = between
            if not good.all():
                rest = np.flatnonzero(~good)
                some = rows_of(scenes, (slice(None), rest))
                sides = mapped(sides, itemgetter(rest))
                left = _filled(sides, some, orders, evaluate, full, False)
                logs[:, rest], errors[:, rest] = left
            return logs, errors
    logs, errors = np.empty(lam.shape), np.empty(lam.shape)
    step = max(1, _AT_ONCE // (1 if one else lam.shape[1]))
    for low in range(0, len(lam), step):
        part = slice(low, low + step)
        logs[part], errors[part] = _best(partial(at, part), orders)
    return logs, errors


def _between(
    sides: Expansions, lam: FloatArray, composed: Composed, order: int, evaluate: FloatLog
) -> tuple[FloatArray, FloatArray, Any] | None:
    """Logarithms in columns by interpolation, the largest errors, and where it is good.

    None where it doesn't pay.
    """
    count, sizes = lam.shape[1], _sizes(sides)

    def at(some: FloatArray, wanted: bool) -> tuple[FloatArray, Any]:
        most = _AT_ONCE if wanted else _WITHOUT_ERRORS
        # A little more at once is no slower, another step is.
        steps = max(1, round(len(some) * count / most))
        points = (
            Point(np.repeat(x[:, None], count, axis=1), order, wanted, sizes)
            for x in np.array_split(some, steps)
        )
        logs, errors = zip(*(evaluate(composed, point) for point in points), strict=True)
        return np.concatenate(logs), np.concatenate(errors) if wanted else None

    curves = columns(at, lam[:, 0])
    if curves is None:
        return None
    logs, worst, good = curves
    good &= worst < _SMALL_SMOOTH
    return logs, np.broadcast_to(worst, lam.shape).copy(), good


def _best(
    at: Callable[[int, bool], tuple[FloatArray, Any]], orders: Sequence[int]
) -> tuple[Any, Any]:
    """The logarithm and error at each scene of the order whose error is smallest."""
    log, wrong = at(orders[0], True)
    if len(orders) == 1 and wrong.max() < np.inf:
        return log, wrong
    known = wrong < np.inf
    log, wrong = np.where(known, log, np.nan), np.where(known, wrong, np.inf)
    for n in orders[1:]:
        logs, error = at(n, True)
        better = error < wrong
        log, wrong = np.where(better, logs, log), np.where(better, error, wrong)
    return log, wrong


def _sizes(sides: Expansions) -> Sizes:
    """The sizes of the terms of all series of both sides."""
    return Sizes([series for one in sides for series in one.all_series()])


def _heights(side: OneSided) -> list[Any]:
    """All heights of one side, and their rounding."""
    return [
        side.height_rounding,
        *(point.height for point in side.scale_points + side.speed_points),
    ]


def _probes(lam: FloatArray) -> IntArray:
    """Some scenes over the whole range of lam, its ends among them."""
    low, high = np.argmin(lam), np.argmax(lam)
    spread = np.geomspace(lam[low], lam[high], _PROBES)
    # Bins of log(lam), one member each: cheaper than sorting.
    inner = spread[1:-1]
    steps = np.linspace(0, len(lam) - 1, 16 * _PROBES).astype(np.intp)
    some = steps[np.searchsorted(np.sort(lam[steps]), inner).clip(0, len(steps) - 1)]
    rows: IntArray = np.concatenate(([low, high], some))
    return rows


def rounding_of_places(drift: Drift, scenes: Scenes) -> Any:
    """The change of log T when r and the start are read as floats, at most."""
    if not any(gap for name, gap in scenes.moved.items() if name != "kappa"):
        return 0.0
    grid = np.linspace(-1, 1, 65)
    values = {
        name: np.asarray(x, dtype=float)[..., None] if is_array(x) else np.asarray(float(x))
        for name, x in scenes.parameters.items()
    }
    size = np.abs(drift.evaluate_float(grid, values)).max(axis=-1)
    return input_rounding(rows_of(scenes, slice(None)), np.broadcast_to(size, scenes.lam.shape))
