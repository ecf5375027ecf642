"""The shape of the potential: values of V, and where A vanishes or turns, in float64."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import step
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray
from symasym.generated.numpy_formulas import potential_left, potential_right
from symasym.numbers.complex_balls import ComplexBall, resolved

if TYPE_CHECKING:
    from symasym.drift.critical_points import CriticalPoint
    from symasym.drift.drift import Drift

# Values whose Chebyshev series stays within float64.
_HUGE = 1e300
_NARROWEST = 1e-12


def float_marks(
    function: Callable[[FloatArray], Any], spread: Callable[[FloatArray, FloatArray], ComplexBall]
) -> list[float]:
    """Zeros and extremes of a smooth function on [-1, 1], in float64, by Chebyshev proxies.

    Parameters
    ----------
    function : callable
        Takes and returns a float64 array.
    spread : callable
        The images of complex balls, given their centres and radii.
    """
    marks: list[float] = []
    for lo, hi, series in _proxies(function, spread):
        for poly in (series, np.polynomial.chebyshev.chebder(series)):
            if len(poly) < 2:
                continue
            roots = np.polynomial.chebyshev.chebroots(poly)
            good = roots[(np.abs(roots.imag) < 1e-6) & (np.abs(roots.real) <= 1 + 1e-9)].real
            marks += list((lo + hi) / 2 + (hi - lo) / 2 * good)
    return sorted(float(np.clip(x, -1, 1)) for x in marks)


def _proxies(
    function: Callable[[FloatArray], Any], spread: Callable[[FloatArray, FloatArray], ComplexBall]
) -> list[tuple[float, float, FloatArray]]:
    """Pieces of [-1, 1] with Chebyshev coefficients that have died out, down to rounding."""
    degree = 32
    nodes = np.cos(np.pi * np.arange(degree + 1) / degree)
    pending = [(-1.0, 1.0)]
    done: list[tuple[float, float, Any]] = []
    while pending:
        step()
        lo, hi = pending.pop()
        with np.errstate(all="ignore"):
            x = (lo + hi) / 2 + (hi - lo) / 2 * nodes
            values = np.broadcast_to(np.asarray(function(x), dtype=np.float64), x.shape)
        if not (np.abs(values) < _HUGE).all():
            raise AccuracyError(
                f"A is not finite, or above {_HUGE:g}, between u = {lo:.6g} and {hi:.6g}; give an "
                "A that is real and smooth on [-1, 1], or A/c and kappa/sqrt(c), T being c times "
                "as long."
            )
        series = np.polynomial.chebyshev.chebfit(nodes, values, degree)
        change = spread(np.array([(lo + hi) / 2]), np.array([hi - lo])).radius[0]
        # Rounding of x is multiplied by the slope, which is at most change/radius.
        size = np.abs(series).max()
        noise = 1e-14 * size + 4e-16 * change / (hi - lo)
        settled = np.abs(series[-3:]).max() <= 1e-12 * size + noise
        if (settled and resolved(change, np.abs(values).max())) or hi - lo < _NARROWEST:
            done.append((lo, hi, np.polynomial.chebyshev.chebtrim(series, min(noise, size))))
        else:
            pending += [(lo, (lo + hi) / 2), ((lo + hi) / 2, hi)]
    return done


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
        outside = potential_right(np.maximum(position, 1.0), a_plus, total)
        outside = outside + potential_left(np.minimum(position, -1.0), a_minus)
    if not np.isfinite(outside).all():
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
    total = total + potential_left(np.minimum(position, -1.0), a_minus)
    total = potential_right(np.maximum(position, 1.0), a_plus, total)
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
