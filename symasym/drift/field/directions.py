"""How lam phi changes with the parameters of its scenes, in float64.

dA/dp is the imaginary part of A at p + ih over h, right to rounding for h far below it, since
nothing is subtracted (J. N. Lyness, C. B. Moler, SIAM J. Numer. Anal. 4 (1967) 202). As
lam = 2/kappa^2, d(lam phi)/dlog kappa is -2 lam phi, within range where kappa is tiny. A radius
above 1 moves the outer ends alone; one up to 1 stretches the interval, widths h and places u alike:
dh/dr = h/r, dphi/dr = u phi'/r.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from symasym.base.inputs import FloatArray, IntArray, floats
from symasym.drift.drift import Drift, FlatValues
from symasym.numbers.float_arrays import DualArray
from symasym.numbers.trees import NumpyOps

__all__ = ["Directions"]

_STEP = 1e-60


class Directions:
    """Derivatives for scenes and, after all of them, their mirror images.

    `names` are the drift's parameters, log kappa and, where there is one, r: the axis of parameters
    of every `DualArray` that is made here. `off` is the rounding of the start.
    """

    def __init__(
        self,
        drift: Drift,
        parameters: dict[str, Any],
        numbers: dict[str, FloatArray],
        off: float = 0.0,
    ) -> None:
        self._count = len(numbers["kappa"])
        self._drift, self._parameters, self._numbers = drift, parameters, numbers
        self.off = off
        radius = ["r"] if "r" in numbers else []
        self.names = (*self._drift.parameters, "log kappa", *radius)
        r = np.tile(numbers["r"], 2) if "r" in numbers else np.full(2 * self._count, 2.0)
        #: 1/r where r <= 1, else 0.
        self.stretch = np.where(r <= 1.0, 1.0 / r, 0.0)
        self._stretches = bool(self.stretch.any())

    @cached_property
    def _values(self) -> dict[str, FloatArray]:
        """The parameters of all scenes."""
        return {
            name: np.tile(np.broadcast_to(floats(name, x), self._count), 2)
            for name, x in self._parameters.items()
        }

    @cached_property
    def _sign(self) -> FloatArray:
        """-1 of the mirror images."""
        return np.repeat((1.0, -1.0), self._count)

    def series(self, coefficients: FloatArray, scene: slice | IntArray) -> FloatArray:
        """The coefficients of A of these scenes, a column each, and the derivatives of them times
        lam over lam, one after the other; of scenes that no radius stretches."""
        changes = getattr(self._parameters, "changes", None)
        if changes is None:
            changes = self._of_coefficients(len(coefficients))
            if isinstance(self._parameters, FlatValues):
                self._parameters.changes = changes
        count = len(changes)
        rows = np.zeros((1 + len(self.names), *coefficients.shape))
        rows[0], rows[1 : count + 1] = coefficients, changes[:, :, scene]
        np.multiply(coefficients, -2.0, out=rows[count + 1])
        return rows

    def _of_coefficients(self, terms: int) -> FloatArray:
        """The derivatives of A's coefficients by its parameters, and those of all mirror images."""
        names, number = list(self._parameters), len(self._parameters)
        changes = np.zeros((number, terms, 2 * self._count))
        moved = {
            name: self._values[name][: self._count] + _STEP * 1j * np.eye(number)[:, [k]]
            for k, name in enumerate(names)
        }
        with np.errstate(all="ignore"):
            coefficients = self._drift.coefficients(moved, NumpyOps()) if names else []
        for k, c in enumerate(coefficients or []):
            changes[:, k, : self._count] = np.imag(c) / _STEP
            changes[:, k, self._count :] = (1 if k % 2 else -1) * changes[:, k, : self._count]
        return changes

    def of_drift(self, scene: IntArray, u: FloatArray) -> FloatArray:
        """dphi/dp at the points `u`, one row per entry of `scene`, for the drift's parameters; and
        dphi/dr last, where a radius is at most 1."""
        sign, count = self._sign[scene][:, None], len(self._values)
        total = count + self._stretches
        if not total:
            return np.empty((0, *u.shape))
        step = _STEP * 1j * (np.arange(total)[:, None] == np.arange(total))[:, :, None, None]
        moved = {
            name: value[scene][:, None] + step[k]
            for k, (name, value) in enumerate(self._values.items())
        }
        at = u * sign
        with np.errstate(all="ignore"):
            place = at + step[count] if self._stretches else at
            raw = np.asarray(self._drift.evaluate_float(place, moved))
        slopes = sign * np.broadcast_to(raw.imag / _STEP, (total, *u.shape))
        if self._stretches:
            slopes[count] *= at * self.stretch[scene][:, None]
        return slopes

    def rows(self, of_drift: FloatArray, lam_phi: FloatArray) -> FloatArray:
        """Rows for all names from those of the drift, for something linear in lam phi."""
        count, of_kappa = len(self._parameters), -2.0 * lam_phi
        of_radius = [of_drift[count] if len(of_drift) > count else np.zeros_like(of_kappa)]
        others = np.array([of_kappa, *of_radius[: len(self.names) - count - 1]])
        return np.concatenate((of_drift[:count], others))

    @cached_property
    def sizes(self) -> FloatArray:
        """|p| of each name and of the start, where there is one; 1 for log kappa and where p is
        0."""
        radius = [x for name, x in self._numbers.items() if name != "kappa"]
        given = [*self._parameters.values(), np.ones(self._count), *radius]
        sizes = np.array([np.abs(np.broadcast_to(floats("", x), self._count)) for x in given])
        sizes[sizes == 0] = 1.0
        return sizes

    def largest_change(self, slopes: FloatArray) -> FloatArray:
        """Slopes as large, times p, as the largest or 1."""
        largest: FloatArray = np.maximum(1.0, (self.sizes * np.abs(slopes)).max(axis=0))
        return largest / self.sizes

    @cached_property
    def largest(self) -> FloatArray:
        """About the largest |dphi/dp| on [-1, 1], of each of the drift's parameters and scene."""
        count, scene = len(self._values), np.arange(len(self._sign))
        places = np.broadcast_to(np.cos(np.arange(8)), (len(scene), 8))
        sampled: FloatArray = np.abs(self.of_drift(scene, places)[:count]).max(axis=-1, initial=0)
        return sampled

    def rate(self, lam: FloatArray) -> DualArray:
        """lam of the first scenes, or of all."""
        nothing = np.zeros((len(self._parameters), len(lam)))
        return DualArray(lam, self.rows(nothing, lam))

    def at_end(self, values: FloatArray, side: float) -> DualArray:
        """The drift at -1 or 1, which these are the values of."""
        scene = np.arange(len(values))
        slopes = np.zeros((len(self.names), len(values)))
        count = len(self._values)
        slopes[:count] = self.of_drift(scene, np.full((len(values), 1), side))[:count, :, 0]
        return DualArray(values, slopes)

    def outer_width(self, h: FloatArray) -> FloatArray | DualArray:
        """Widths outside [-1, 1], which grow with r."""
        return self._width(h, np.ones_like(h))

    def stretched(self, h: FloatArray, scene: IntArray) -> FloatArray | DualArray:
        """Widths inside [-1, 1], which grow with a radius up to 1."""
        return self._width(h, h * self.stretch[scene]) if self._stretches else h

    def _width(self, h: FloatArray, per_r: FloatArray) -> FloatArray | DualArray:
        """Widths and their derivative in r, the last of the names if it is one."""
        if self.names[-1] != "r":
            return h
        slopes = np.zeros((len(self.names), len(h)))
        slopes[-1] = per_r
        return DualArray(h, slopes)
