"""The Stokes multiplier of a well at a fold: the paper's step (eq:S), or a smooth function.

As a well and a barrier coalesce, phi du = (s^2 - zeta) ds maps the pair to the canonical Airy form
(C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599). The exponential of the
well then appears through Ai^2 + Bi^2 at Z = lam^(2/3) zeta."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from flint import arb, ctx, fmpq

from symasym.base.balls import precision, rational, rounded
from symasym.base.errors import InputError
from symasym.base.inputs import Numbers, choice, digits
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.drift.scenes import FLOAT_DIGITS, Scene, read, require_drift
from symasym.expansions.coalescence import Phi, central_map

__all__ = ["stokes_multiplier"]


def stokes_multiplier(
    drift: Drift,
    kappa: Numbers,
    *,
    method: Literal["step", "uniform"] = "uniform",
    dps: int | None = None,
) -> Any:
    """The factor of a well's exponential in T, between 0 and 1 (eq:Ttildesmall).

    With phi du = (s^2 - zeta) ds for a well and the adjacent barrier, Z = lam^(2/3) zeta and
    G = Ai^2 + Bi^2, it is S = G(Z)/(G(Z) + G(-Z)). It is 1/2 at the fold and increases from 0 to 1
    while the extremum of phi there changes by the order of lam^(-2/3). The leading term of T is S
    pi^2 p_0^2 lam^(1/3) (G(Z) + G(-Z)); the factor of S is even in Z, and the paper's for Z >> 1.

    Parameters
    ----------
    drift : Drift
        A drift whose parameters all have values, which may be arrays. If it has several wells,
        the multiplier is that of the well nearest to its fold.
    kappa : number or array_like
        Scaled noise amplitude, greater than 0.
    method : {"uniform", "step"}
        ``"step"``: 0, 1/2 or 1, as in the paper.
    dps : int, optional
        Number of digits, 1 to 10,000, for numbers. By default the result is in float64.

    Returns
    -------
    float, ndarray or mpf
        A number between 0 and 1.

    Raises
    ------
    InputError
        If no well and barrier coalesce in (-1, 1), or a value is outside its range.

    Examples
    --------
    >>> import symasym as sa
    >>> fold = sa.friction(mu=3, alpha=1, z0="-7/9")
    >>> sa.stokes_multiplier(fold, "0.1")
    0.5
    >>> beside = sa.friction(mu=3, alpha=1, z0="-0.7")
    >>> for method in ("step", "uniform"):
    ...     print(f"{sa.stokes_multiplier(beside, '0.1', method=method):.4f}")
    1.0000
    0.9283
    """
    require_drift(drift)
    choice("method", method, ("step", "uniform"))
    scenes = read(drift, {"kappa": kappa})
    if digits(dps) is not None:
        return rounded(_multiplier(scenes.one(), method, dps), dps)[0]
    balls = (_multiplier(scenes.at(row), method, FLOAT_DIGITS) for row in range(len(scenes.lam)))
    values = [rounded(ball, None)[0] for ball in balls]
    return np.reshape(values, scenes.shape) if scenes.shape else values[0]


def _multiplier(scene: Scene, method: str, places: Any) -> Any:
    """G(Z)/(G(Z) + G(-Z)) for the pair nearest to its fold."""
    bits = 4 * places + 61 + int(scene.lam).bit_length()
    with precision(bits):
        ctx.cap = 4 * places + 40
        zetas = []
        field = Phi(pieces(scene.drift, fmpq(-1), fmpq(1))[0].phi)
        for cluster in field.clusters():
            if len(cluster.zeros) == 2 and abs(cluster.centre) < 1:
                centre, pi = field.factor(cluster)
                found = central_map(field.taylor(centre), pi)
                psi0, psi1 = found.chi[0], found.chi[1]
                # Otherwise (y^2 - D)(psi0 + psi1 y) has no turning point.
                if 3 * pi.square * psi1 * psi1 > -psi0 * psi0:
                    # zeta is 0 within the accuracy of the zeros.
                    on = abs(found.zeta) < arb(2) ** (-bits // 2)
                    zetas.append(arb(0) if on else found.zeta)
        if not zetas:
            raise InputError(
                f"A of {scene.drift!r} has no turning point inside (-1, 1) at which a well and a "
                "barrier coalesce; the Stokes multiplier is that of a fold."
            )
        zeta = min(zetas, key=lambda z: float(abs(z)))
        Z = arb(rational(scene.lam)).root(3) ** 2 * zeta
        if method == "step":
            return (1 + zeta.sgn()) / 2
        there, back = (x.airy()[0] ** 2 + x.airy()[2] ** 2 for x in (Z, -Z))
        return there / (there + back)
