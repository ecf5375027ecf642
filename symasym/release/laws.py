"""Laws of the time and of z at release.

At each z the time of a march is taken as normal, of the mean and the variance that left there; the
law of the time is their mixture, by Gauss and Hermite's rule.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Numbers, floats
from symasym.release.march import March

Function = Callable[[FloatArray], FloatArray]


class Law:
    """A law on a line: `mean`, `std`, distribution function with its `error`, quantiles."""

    def __init__(self, of: Function, ends: Any, mean: float, std: float, error: float) -> None:
        self._of, self._ends, self.mean, self.std, self.error = of, ends, mean, std, error

    def cdf(self, x: Numbers) -> Any:
        """The chance to be at most x."""
        return np.clip(self._of(floats("x", x)), 0.0, 1.0)[()]

    def quantile(self, p: Numbers) -> Any:
        """The x at which `cdf` is p, which must lie in (0, 1)."""
        level = floats("p", p)
        if not ((level > 0.0) & (level < 1.0)).all():
            raise InputError(f"p is {level[()]}; give a probability between 0 and 1.")
        low, high = (np.full(level.shape, end) for end in self._ends)
        for _ in range(60):
            middle = (low + high) / 2
            past = self._of(middle) >= level
            low, high = np.where(past, low, middle), np.where(past, middle, high)
        return high[()]


def of_march(rough: March, fine: March) -> tuple[Law, Law]:
    """The laws of the time and of z of the finer march, and how far the other one is."""
    laws = _of(fine)
    for law, other in zip(laws, _of(rough), strict=True):
        x = law.quantile(np.linspace(0.0, 1.0, 402)[1:-1])
        law.error = float(np.abs(law.cdf(x) - other.cdf(x)).max())
    return laws


def _of(found: March) -> tuple[Law, Law]:
    from scipy.interpolate import PchipInterpolator

    share, z, sign = found.share[:, 0], found.scene.z, found.scene.sign
    sure = share > 1e-9 * share.max()
    late, square = (found.share[sure, 1:] / share[sure, None]).T
    way, left, clock = (np.append(0.0, x[sure]) for x in (found.way, found.left, found.clock))
    time = clock + np.append(0.0, late)
    spread = np.append(0.0, np.sqrt(np.maximum(square - late**2, 0.0)))

    def table(x: FloatArray) -> Function:
        """The chance to have left by x."""
        grows = np.append(True, np.diff(np.maximum.accumulate(x)) > 0.0)
        inner, last = PchipInterpolator(x[grows], left[grows]), x[grows][-1]
        return lambda at: np.asarray(inner(np.clip(at, 0.0, last)))

    normals, weights = np.polynomial.hermite_e.hermegauss(9)
    tables, by_way = [table(time + k * spread) for k in normals], table(way)

    def of_time(x: FloatArray) -> FloatArray:
        return np.average([one(x) for one in tables], 0, weights)

    def of_z(x: FloatArray) -> FloatArray:
        gone = by_way((x - z) * sign)
        return gone if sign > 0 else 1.0 - gone

    ends, mean = sorted((z, z + sign * way[-1])), float(share @ found.way)
    std = float(share @ (found.way - mean) ** 2) ** 0.5
    of_t = Law(of_time, (0.0, time[-1] + 5.0 * spread[-1]), found.mean, found.std, 0.0)
    return of_t, Law(of_z, ends, z + sign * mean, std, 0.0)


def of_sample(values: FloatArray) -> Law:
    """The law of a sample."""
    order, n = np.sort(values), len(values)
    mean, std, error = float(order.mean()), float(order.std()), 1.36 / n**0.5
    return Law(lambda x: order.searchsorted(x, "right") / n, order[[0, -1]], mean, std, error)
