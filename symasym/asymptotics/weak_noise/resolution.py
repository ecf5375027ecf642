"""The resolution test: an expansion is unresolved where phi' is large away from critical points.

Between critical points (`symasym.asymptotics.weak_noise.critical_points`) the expansions are in
|phi'|/(lam phi^2). A drift that is no polynomial may vary fast there although it is straight where
its series are taken; then what is left out, e^{lam V} there, is in no next term.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, is_array
from symasym.drift.drift import Drift
from symasym.drift.scenes import Scenes

_POINTS = 513
# Of |phi'|/(lam phi^2), outside of e^{±3} around wells and barriers.
_MOST_BEND = 0.25
_NEAR = 3.0
_EDGE = 13
_AT_ONCE = 512


def unresolved(drift: Drift, lam: float, folds: Sequence[float] = ()) -> bool:
    """True where A varies too fast for this noise, but at the folds; never for a polynomial."""
    if drift.exact_coefficients() is not None:
        return False
    u = np.linspace(-1, 1, _POINTS)
    with np.errstate(all="ignore"):
        phi = np.broadcast_to(drift.evaluate_float(u), u.shape)
    return bool(_unresolved(phi[None], np.array([lam]), folds)[0])


def require_resolved(drift: Drift, lam: Fraction, folds: Sequence[float] = ()) -> None:
    """Raise AccuracyError where A varies too fast for the noise (`resolution`), but at folds."""
    # Noise beyond the range of float64 is weak.
    if lam < 10**300 and unresolved(drift, float(lam), folds):
        raise AccuracyError(
            f"kappa is {float(2 / lam) ** 0.5:.6g}, where the noise is too strong for a drift that "
            "varies this fast: no term of Laplace's method estimates its error; use "
            "method='exact' or 'strong_noise'."
        )


def unresolved_in(drift: Drift, scenes: Scenes) -> Any:
    """The same, for each scene."""
    unresolved = np.zeros(len(scenes.lam), dtype=bool)
    first = {n: float(x.flat[0]) if is_array(x) else x for n, x in scenes.parameters.items()}
    if not len(unresolved) or drift.bind(**first).exact_coefficients() is not None:
        return unresolved
    u = np.linspace(-1, 1, _POINTS)
    for low in range(0, len(unresolved), _AT_ONCE):
        part = slice(low, low + _AT_ONCE)
        lam = scenes.lam[part]
        values = {
            name: np.asarray(x[part])[:, None] if is_array(x) else np.asarray(float(x))
            for name, x in scenes.parameters.items()
        }
        with np.errstate(all="ignore"):
            phi = np.broadcast_to(drift.evaluate_float(u, values), (len(lam), _POINTS))
        unresolved[part] = _unresolved(phi, lam)
    return unresolved


def _unresolved(phi: FloatArray, lam: FloatArray, folds: Sequence[float] = ()) -> Any:
    """True for each row of phi that |phi'|/(lam phi^2) shows to vary too fast.

    Near a zero of phi, within e^{±3}, phi is instead to be nearly its tangent where the Gaussian
    is wide.
    """
    step = 2 / (_POINTS - 1)
    slope = np.gradient(phi, step, axis=1)
    # By trapezoids, exact where phi is its tangent: at a zero that decides what is near.
    rise = (np.cumsum(phi, axis=1) - phi / 2) * step
    # Beside u = -1 and 1 the series of these points estimate.
    near = np.zeros(phi.shape, dtype=bool)
    near[:, :_EDGE] = near[:, -_EDGE:] = True
    # Where a well and a barrier meet, phi is a parabola, and Airy functions tell.
    for fold in folds:
        middle = round((fold + 1) / step)
        near |= lam[:, None] * np.abs(rise - rise[:, middle : middle + 1]) < _NEAR
    known = near.copy()
    rows, columns = np.nonzero((phi[:, 1:] > 0) != (phi[:, :-1] > 0))
    crooked = np.zeros(len(phi), dtype=bool)
    for row, column in zip(rows, columns, strict=True):
        near[row] |= lam[row] * np.abs(rise[row] - rise[row, column]) < _NEAR
        if folds and known[row, column]:
            continue
        # At the width of the Gaussian A must still be nearly its tangent.
        steep = np.abs(slope[row, column])
        reach = max(1, int(1 / np.sqrt(lam[row] * steep + 1e-300) / step))
        for end in (max(int(column) - reach, 0), min(int(column) + reach, _POINTS - 1)):
            straight = steep * abs(end - int(column)) * step
            crooked[row] |= np.abs(phi[row, end] - phi[row, column]) < straight / 2
    with np.errstate(all="ignore"):
        bend = np.abs(slope) / (lam[:, None] * phi**2)
    return crooked | (np.where(near, 0.0, bend) > _MOST_BEND).any(axis=1)
