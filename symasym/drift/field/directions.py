"""How lam phi changes with the parameters of its scenes, in float64.

dA/dp is the imaginary part of A at p + ih over h, right to rounding for h far below it, since
nothing is subtracted (J. N. Lyness, C. B. Moler, SIAM J. Numer. Anal. 4 (1967) 202). As
lam = 2/kappa^2, d(lam phi)/dkappa is -2/kappa lam phi. The radius moves the absorbing ends alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.inputs import FloatArray, IntArray, floats
from symasym.numbers.dual_arrays import DualArray

if TYPE_CHECKING:
    from symasym.drift.field.scenes import Scenes

__all__ = ["Directions"]

_STEP = 1e-60


class Directions:
    """Derivatives for scenes and, after all of them, their mirror images.

    `names` are the drift's parameters, kappa and, where there is one, r: the axis of parameters of
    every `DualArray` that is made here.
    """

    def __init__(self, scenes: Scenes) -> None:
        count = len(scenes.lam)
        self._drift = scenes.drift
        self.names = (*self._drift.parameters, "kappa", *(["r"] if "r" in scenes.numbers else []))
        self._values = {
            name: np.tile(np.broadcast_to(floats(name, x), count), 2)
            for name, x in scenes.parameters.items()
        }
        self._sign = np.repeat((1.0, -1.0), count)
        self._per_kappa = -2.0 / np.tile(scenes.numbers["kappa"], 2)

    def of_drift(self, scene: IntArray, u: FloatArray) -> FloatArray:
        """dphi/dp at the points `u`, one row per entry of `scene`, for the drift's parameters."""
        sign, count = self._sign[scene][:, None], len(self._values)
        if not count:
            return np.empty((0, *u.shape))
        moved = {
            name: value[scene][:, None] + _STEP * 1j * (np.arange(count) == k)[:, None, None]
            for k, (name, value) in enumerate(self._values.items())
        }
        with np.errstate(all="ignore"):
            raw = np.asarray(self._drift.evaluate_float(u * sign, moved))
        slopes: FloatArray = sign * np.broadcast_to(raw.imag / _STEP, (count, *u.shape))
        return slopes

    def rows(self, of_drift: FloatArray, scene: IntArray, lam_phi: FloatArray) -> FloatArray:
        """Rows for all names from those of the drift, for something linear in lam phi."""
        axes = (slice(None), *(None,) * (lam_phi.ndim - 1))
        of_kappa = self._per_kappa[scene][axes] * lam_phi
        extra = [np.zeros_like(of_kappa)] * (len(self.names) - len(of_drift) - 1)
        return np.concatenate((of_drift, np.array([of_kappa, *extra])))

    def rate(self, lam: FloatArray) -> DualArray:
        """lam of the first scenes, or of all."""
        nothing = np.zeros((len(self._values), len(lam)))
        return DualArray(lam, self.rows(nothing, np.arange(len(lam)), lam))

    def at_end(self, values: FloatArray, side: float) -> DualArray:
        """The drift at -1 or 1, which these are the values of."""
        scene = np.arange(len(values))
        slopes = np.zeros((len(self.names), len(values)))
        slopes[: len(self._values)] = self.of_drift(scene, np.full((len(values), 1), side))[..., 0]
        return DualArray(values, slopes)

    def width(self, h: FloatArray) -> DualArray:
        """Widths that grow with r."""
        slopes = np.zeros((len(self.names), len(h)))
        slopes[-1] = 1.0
        return DualArray(h, slopes)
