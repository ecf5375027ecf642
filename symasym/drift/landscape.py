"""Values of V in float64, and the time in which a moving drift loses a well."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import step
from symasym.base.errors import RangeError
from symasym.base.inputs import FloatArray

if TYPE_CHECKING:
    from symasym.drift.critical_points import CriticalPoint
    from symasym.drift.drift import Drift


def _minus_integral(
    drift: Drift, inside: FloatArray, values: dict[str, Any], panels: int
) -> FloatArray:
    """-int A from -1 to `inside` on so many Gauss-Legendre panels."""
    x, w = np.polynomial.legendre.leggauss(12)
    total: FloatArray = np.zeros(inside.shape)
    half = (inside + 1) / panels / 2
    for k in range(panels):
        for node, weight in zip(x, w, strict=True):
            u = -1 + half * (2 * k + 1 + node)
            total = total - weight * half * drift.evaluate_float(u, values)
    return total


def potential_at(drift: Drift, u: FloatArray) -> float | FloatArray:
    """V in float64 with V(-1) = 0, by Gauss-Legendre on panels short enough for any A."""
    values = drift.float_values()
    shape = drift.shape_with("u", u)
    position = np.broadcast_to(u, shape)
    inside = np.clip(position, -1.0, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        total, panels = _minus_integral(drift, inside, values, 32), 32
        a_minus, a_plus = (drift.evaluate_float(np.asarray(x), values) for x in (-1.0, 1.0))
        # V is a straight line on either side of the layer (eq:V2).
        beyond = a_minus * (1 + np.minimum(position, -1.0)) + a_plus * (
            np.maximum(position, 1.0) - 1
        )
    if not np.isfinite(total - beyond).all():
        raise RangeError(
            f"V of {drift!r} or its numbers leave the range of float64 (1e-308 to 1e308); rescale "
            "the drift, or give u nearer to 0."
        )
    while panels < 8192:
        step()
        panels *= 4
        finer = _minus_integral(drift, inside, values, panels)
        settled = np.abs(finer - total).max() <= 1e-13 * (np.abs(finer).max() + 1e-300)
        total = finer
        if settled:
            break
    total = total - beyond
    return float(total) if total.ndim == 0 else total


def drag_time(
    points: list[CriticalPoint],
    phi: Callable[[FloatArray], FloatArray],
    rate: Callable[[FloatArray], FloatArray],
) -> float:
    """Time in which a drift that changes at `rate` changes one of its wells by its depth.

    The depth of phi between a well and its barrier over the rate there: to first order, the time
    after which the well is lost, or is twice as deep. Infinite without a well that a barrier ends.
    """
    times = []
    for one, other in zip(points[:-1], points[1:], strict=True):
        low, high = float(one.u), float(other.u)
        # The depth is stationary at its place: three grids in turn have it to rounding.
        for _ in range(3):
            u = np.linspace(low, high, 2001)
            depth = phi(u)
            k = int(np.argmax(np.abs(depth)))
            low, high = u[max(k - 1, 0)], u[min(k + 1, u.size - 1)]
        change = float(rate(u[k : k + 1])[0])
        if {one.kind, other.kind} == {"well", "barrier"} and change != 0.0:
            times.append(float(abs(depth[k] / change)))
    return min(times, default=float("inf"))
