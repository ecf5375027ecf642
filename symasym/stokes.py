"""The Stokes multiplier of a well as it is born: a step, or the smooth function behind it (eq:S).

Where a well and a barrier coalesce, phi du = (s^2 - zeta) ds takes the pair to the canonical Airy
form (Chester, Friedman and Ursell), in which the well's exponential is switched on by
Ai^2 + Bi^2 of Z = lam^(2/3) zeta.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Literal

import numpy as np

from symasym.base.call_context import mpf_of, own_context, patient, to_mpf
from symasym.base.errors import InputError, SymasymError
from symasym.base.inputs import Floats, Numbers, choice
from symasym.drift.drift import Drift
from symasym.scenes import (
    FLOAT_DIGITS,
    Scene,
    exponent_bits,
    float_scenes,
    one_scene,
    read_scene,
    require_drift,
    scene_at,
)

if TYPE_CHECKING:
    from mpmath import mpf

__all__ = ["stokes_multiplier"]

_METHODS = ("step", "local", "uniform")
_GUARD = 15


@patient
def stokes_multiplier(
    drift: Drift,
    kappa: Numbers,
    *,
    method: Literal["step", "local", "uniform"] = "uniform",
    dps: int | None = None,
    patience: float | None = None,
) -> Floats | mpf:
    """Share of a well's exponential in T, from 0 before the fold to 1 beyond it (eq:Ttildesmall).

    With phi du = (s^2 - zeta) ds for the well and the barrier next to each other,
    Z = lam^(2/3) zeta and G = Ai^2 + Bi^2, it is G(Z)/(G(Z) + G(-Z)): 1/2 at the fold, and over
    a width of lam^(-2/3) in the least value of phi from 0 to 1. The leading term goes with it as
    pi^2 p_0^2 lam^(1/3) (G(Z) + G(-Z)), which is even in Z and for Z >> 1 is the paper's; what
    multiplier times leading term leaves of T is the regular part on a path past both zeros, which
    does not notice the fold.

    Parameters
    ----------
    drift : Drift
        With a value for each of its parameters; values may be arrays. With several wells, the one
        that is nearest to its fold counts.
    kappa : number or array_like
        Scaled noise amplitude, greater than 0.
    method : {"uniform", "local", "step"}
        ``"uniform"``: zeta from the potential's values at the zeros. ``"local"``: zeta linear in
        phi at its turning point. ``"step"``: 0, 1/2 or 1, as the paper has it.
    dps : int, optional
        Digits, 1 to 10,000, for scalars. None: float64.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    float, ndarray or mpf
        Between 0 and 1.

    Raises
    ------
    InputError
        If A has no turning point inside (-1, 1), or a value is outside its range.

    Examples
    --------
    >>> import symasym as sa
    >>> fold = sa.friction(mu=3, alpha=1, z0="-7/9")
    >>> sa.stokes_multiplier(fold, "0.1")
    0.5
    >>> beside = sa.friction(mu=3, alpha=1, z0="-0.7")
    >>> for method in ("step", "local", "uniform"):
    ...     print(f"{sa.stokes_multiplier(beside, '0.1', method=method):.4f}")
    1.0000
    0.9281
    0.9283
    """
    require_drift(drift)
    choice("method", method, _METHODS)
    numbers = {"kappa": kappa}
    if dps is None and not one_scene(drift, numbers):
        scenes = float_scenes(drift, numbers)
        each = (scene_at(scenes, row) for row in range(len(scenes.lam)))
        values = np.array([float(_multiplier(scene, method, FLOAT_DIGITS)) for scene in each])
        return values.reshape(scenes.shape)
    scene = read_scene(drift, numbers, dps)
    if dps is None:
        return float(_multiplier(scene, method, FLOAT_DIGITS))
    return to_mpf(_multiplier(scene, method, dps), dps)


def _multiplier(scene: Scene, method: str, digits: int) -> mpf:
    """G(Z)/(G(Z) + G(-Z)) of the pair that is nearest to its fold."""
    from symasym.asymptotics.weak_noise.critical_points import turning_points
    from symasym.drift.field.taylor_field import ExactField
    from symasym.series.quadratic_factor import split_pair

    drift, lam = scene.drift, scene.lam
    exponent = exponent_bits(drift, lam, Fraction(1))
    with own_context(2 * digits + int(0.30103 * exponent) + _GUARD) as context:
        field, one = ExactField(drift, False, context), Fraction(1)
        nearest = None
        for point in turning_points(field, -one, one, context):
            exact = field.taylor(point, one, 4 * digits + 40)
            taylor = [mpf_of(c, context) for c in exact]
            if abs(taylor[0]) < abs(taylor[2]) * context.ldexp(1, -context.prec + 16):
                # The turning point is known to rounding: exactly on the fold.
                return context.mpf(1) / 2
            sign = 1 if taylor[2] > 0 else -1
            zeta = -sign * taylor[0] / context.cbrt(abs(taylor[2]))
            if method == "uniform":
                try:
                    zeta = split_pair(taylor, context).zeta
                except SymasymError:
                    # No pair by itself: far from its fold, where only the side counts.
                    zeta = context.sign(zeta) * context.inf
            if nearest is None or abs(zeta) < abs(nearest):
                nearest = zeta
        if nearest is None:
            raise InputError(
                f"A of {drift!r} has no turning point inside (-1, 1), so that no well is born or "
                "lost there; the Stokes multiplier is that of a fold."
            )
        if method == "step" or not context.isfinite(nearest):
            return (1 + context.sign(nearest)) / 2
        z = context.cbrt(mpf_of(lam, context)) ** 2 * nearest
        there, back = (context.airyai(x) ** 2 + context.airybi(x) ** 2 for x in (z, -z))
        return there / (there + back)
