"""Values of V in float64 (eq:V2), and the time in which a moving drift loses a well."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.errors import RangeError
from symasym.base.inputs import FloatArray

if TYPE_CHECKING:
    from symasym.drift.critical_points import CriticalPoint
    from symasym.drift.drift import Drift

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(12)


def _integral(A: Callable[[Any], Any], upper: FloatArray, panels: int) -> FloatArray:
    """The integral of A from -1 on so many Gauss-Legendre panels."""
    half = (upper + 1) / panels / 2
    total: FloatArray = np.zeros(upper.shape)
    for k in range(panels):
        for node, weight in zip(_NODES, _WEIGHTS, strict=True):
            total = total + weight * half * A(-1 + half * (2 * k + 1 + node))
    return total


def potential_at(drift: Drift, u: FloatArray) -> float | FloatArray:
    """V in float64 with V(-1) = 0, on as many panels as A takes."""
    position = np.broadcast_to(u, drift.shape_with("u", u))
    inside = np.clip(position, -1.0, 1.0)
    with np.errstate(over="ignore", invalid="ignore"):
        beside = drift(position) * (position - inside)
        before = _integral(drift.evaluate_float, inside, 32)
        for panels in (128, 512, 2048, 8192):
            found = _integral(drift.evaluate_float, inside, panels)
            if np.abs(found - before).max() <= 1e-13 * (np.abs(found).max() + 1e-300):
                break
            before = found
    total: FloatArray = -found - beside
    if not np.isfinite(total).all():
        raise RangeError(
            f"V of {drift!r} leaves the range of float64; rescale the drift, or give u nearer to 0."
        )
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
