"""Laws of the time and of z at release, from densities marched in z.

At the end of each stretch of way z is known, so that the law of z is what is no longer held. The
time at which z comes there depends on the path by the little that u adds to g; of it the mean m and
the variance v are marched with the density, conditional on leaving there, and taken as normal:
t = m(way) + sqrt(v(way)) N. Where g does not depend on u, v is 0 and the law exact.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.polynomial import hermite_e, legendre

from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Numbers, floats
from symasym.release.march import Forward
from symasym.release.slabs import radau

__all__ = ["Law", "Piecewise", "laws"]

# An interval is cut into so many parts, so often.
_PARTS, _CUTS = 32, 11


class Piecewise:
    """A function that is a polynomial on each slab.

    Parameters
    ----------
    ends : ndarray, shape (m + 1,)
        Of the slabs, increasing.
    values : ndarray, shape (m, n + 1)
        At each slab's beginning and at its n stages.
    """

    def __init__(self, ends: FloatArray, values: FloatArray) -> None:
        n = values.shape[1] - 1
        nodes = np.concatenate([[-1.0], 2.0 * radau(n).nodes - 1.0])
        self._ends = ends
        self._series = np.linalg.inv(legendre.legvander(nodes, n)) @ values.T

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values at x, those at the ends beyond them."""
        ends = self._ends
        x = np.clip(x, ends[0], ends[-1])
        k = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
        local = 2.0 * (x - ends[k]) / (ends[k + 1] - ends[k]) - 1.0
        result: FloatArray = np.asarray(
            legendre.legval(local, self._series[:, k], tensor=False), dtype=np.float64
        )
        return result


class Law:
    """A law on a line: mean, standard deviation, distribution function and quantiles.

    Attributes
    ----------
    mean, std : float
    error : float
        Of `cdf`, an estimate.
    """

    def __init__(
        self,
        cdf: Callable[[FloatArray], FloatArray],
        low: float,
        high: float,
        mean: float,
        std: float,
        error: float,
    ) -> None:
        self.mean, self.std, self.error = mean, std, error
        self._cdf, self._low, self._high = cdf, low, high

    def cdf(self, x: Numbers) -> Any:
        """The chance to be at most x."""
        at = floats("x", x)
        result = np.clip(self._cdf(at), 0.0, 1.0)
        return float(result) if result.ndim == 0 else result

    def quantile(self, p: Numbers) -> Any:
        """The x at which `cdf` is p, which must lie in (0, 1)."""
        level = floats("p", p)
        if not ((level > 0.0) & (level < 1.0)).all():
            raise InputError(f"p is {level[()]}; give a probability between 0 and 1.")
        crossing = _crossing(
            lambda x: self._cdf(x) >= level[..., None],
            np.full(level.shape, self._low),
            np.full(level.shape, self._high),
        )
        return float(crossing) if crossing.ndim == 0 else crossing

    def __repr__(self) -> str:
        return f"Law(mean={self.mean:.6g}, std={self.std:.3g})"


def _crossing(above: Callable[[FloatArray], Any], low: FloatArray, high: FloatArray) -> FloatArray:
    """Where `above`, of points on a last axis, becomes true between `low` and `high`."""
    shares = np.linspace(0.0, 1.0, _PARTS + 1)
    for _ in range(_CUTS):
        points = low[..., None] + (high - low)[..., None] * shares
        past = np.asarray(above(points[..., 1:-1]))
        first = np.where(past.any(-1), np.argmax(past, axis=-1), _PARTS - 1)[..., None]
        low = np.take_along_axis(points, first, -1)[..., 0]
        high = np.take_along_axis(points, first + 1, -1)[..., 0]
    return high


def laws(density: Forward, z: float, sign: float, error: float = 0.0) -> tuple[Law, Law]:
    """The laws of the time and of z at release, from a start at z that moves to `sign`."""
    ends = density.way
    held = Piecewise(ends, density.held)
    clock = Piecewise(ends, density.clock)
    n = density.held.shape[1] - 1
    rule, lengths = radau(n), np.diff(ends)
    stages = ends[:-1, None] + lengths[:, None] * rule.nodes
    share = lengths[:, None] * rule.weights * density.flux[..., 0]
    flux = density.flux
    sure = flux[..., 0] > 1e-9 * flux[..., 0].max()
    safe = np.where(sure, flux[..., 0], 1.0)
    late = np.where(sure, flux[..., 1] / safe, np.nan)
    spread = np.where(sure, np.maximum(flux[..., 2] / safe - late**2, 0.0), np.nan)
    known = stages[sure], late[sure], np.sqrt(spread[sure])

    def arrival(way: FloatArray, normal: float) -> FloatArray:
        """The time at which z has gone this way, `normal` standard deviations late."""
        beyond = np.interp(way, known[0], known[1]) + normal * np.interp(way, known[0], known[2])
        result: FloatArray = clock(way) + beyond
        return result

    normals, weights = hermite_e.hermegauss(9)
    weights = weights / weights.sum()

    def time_cdf(x: FloatArray) -> FloatArray:
        """The chance to have left by the time x."""
        total = np.zeros(x.shape)
        for normal, weight in zip(normals, weights, strict=True):
            way = _crossing(
                lambda way, normal=normal: arrival(way, normal) >= x[..., None],  # type: ignore[misc]
                np.zeros(x.shape),
                np.full(x.shape, ends[-1]),
            )
            total += weight * (1.0 - held(way))
        return total

    def z_cdf(x: FloatArray) -> FloatArray:
        """The chance that z is at most x at release."""
        way = (x - z) * sign
        gone = np.where(way <= 0.0, 0.0, 1.0 - held(way))
        return gone if sign > 0 else 1.0 - gone

    far_time = float(density.clock[-1, -1])
    at_stages = density.clock[:, 1:]
    mean = float((share * at_stages).sum() + (lengths[:, None] * rule.weights * flux[..., 1]).sum())
    beyond = flux[..., 2] + 2.0 * (at_stages - mean) * flux[..., 1]
    square = share * (at_stages - mean) ** 2 + lengths[:, None] * rule.weights * beyond
    gone = float((share * stages).sum())
    deviation = float(np.sqrt(max((share * (stages - gone) ** 2).sum(), 0.0)))
    time = Law(time_cdf, 0.0, 2.0 * far_time, mean, float(np.sqrt(max(square.sum(), 0.0))), error)
    edges = sorted((z, z + sign * float(ends[-1])))
    return time, Law(z_cdf, edges[0], edges[1], z + sign * gone, deviation, error)
