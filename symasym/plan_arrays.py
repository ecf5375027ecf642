"""method="auto" for arrays: each scene by the cheapest method in float64 whose error will do."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np

from symasym.base.errors import SymasymError
from symasym.base.inputs import FloatArray, is_array
from symasym.drift.drift import Drift
from symasym.drift.float_field import IntArray
from symasym.drift.scenes import Request, Scenes, as_floats, float_scenes
from symasym.methods.driver import answer

__all__ = ["of_arrays", "uniform_logs"]

_WEAK_ORDERS = (0, 1, 2, 4, 8)


def of_arrays(
    drift: Drift,
    numbers: dict[str, Any],
    allowed: Fraction,
    request: Request,
) -> Any:
    """Each element by the first method and order whose stated error is small enough.

    Strong noise takes longer than the exact integral in arrays, so that it is left out.
    """
    from symasym.asymptotics.weak_noise.arrays import index_of, own_shapes

    scenes = float_scenes(drift, numbers)
    logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    given = {name: x for name, x in scenes.parameters.items() if is_array(x)}
    shapes = own_shapes(drift, numbers, scenes) if request.name[-1] != "P" else [drift.shape]
    index = index_of(shapes, scenes.shape)
    # Of a value, not of its logarithm.
    most = np.log1p(float(allowed)) * (1 - 1e-12)
    plans: list[tuple[str, int | None]] = [("laplace", n) for n in _WEAK_ORDERS]
    plans += [("uniform", 0)] * (request.name == "T") + [("exact", None)]
    used = []
    for method, order in plans:
        rows = np.flatnonzero(~(errors <= most))
        if not rows.size:
            break
        some = drift.bind(**{name: x[rows] for name, x in given.items()}) if given else drift
        # A number that all share stays what it is, so that reading it as a float counts.
        values = {n: scenes.numbers[n][rows] if is_array(x) else x for n, x in numbers.items()}
        if order is None:
            last = answer(some, values, request._replace(method=method, log=True, full=True))
            found = np.atleast_1d(last.value), np.atleast_1d(last.error)
            better = np.ones(len(rows), dtype=bool)
        else:
            found = _attempt(some, values, request.name, method, order, index[rows])
            better = found[1] <= most
        logs[rows[better]], errors[rows[better]] = found[0][better], found[1][better]
        if better.any():
            used.append(method if order is None else f"{method}, order {order}")
    request = request._replace(method="auto")
    return as_floats(request, scenes.shape, logs, errors, "estimate", tuple(used), ())


def _attempt(
    drift: Drift, numbers: dict[str, Any], name: str, method: str, order: int, index: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Logarithms and their errors by one method, infinite errors where it refuses."""
    from symasym.asymptotics.weak_noise import answer as weak_noise

    scenes = float_scenes(drift, numbers)
    try:
        if method == "laplace":
            return weak_noise.array_logs(drift, scenes, name, order, index)
        return uniform_logs(drift, scenes, index)
    except SymasymError:
        return np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)


def uniform_logs(drift: Drift, scenes: Scenes, index: IntArray) -> tuple[FloatArray, FloatArray]:
    """Order 0 in float64: polynomial A, everything else would cost more than the integral."""
    from symasym.asymptotics.uniform.order_zero import escape_time
    from symasym.asymptotics.uniform.pairing_arrays import found_of
    from symasym.asymptotics.weak_noise.arrays import logs_of

    logs, errors = logs_of(
        drift, scenes, [], (0,), escape_time, None, True, find=found_of, index=index
    )
    return logs, np.where(errors >= 0, errors, np.inf)
