"""The dry-friction oscillator's drift and what is special about it (section 6 of the paper)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import Floats, Numbers, floats
from symasym.drift import models
from symasym.drift.drift import Drift

__all__ = ["Friction", "Folds", "friction"]


@dataclass(frozen=True)
class Folds:
    """Where critical points coalesce: (+) ``u[0]``, ``z0[0]``; (-) ``u[1]``, ``z0[1]``."""

    u: tuple[Any, Any]
    z0: tuple[Any, Any]


class Friction(Drift):
    """`Drift` of the friction oscillator, with its folds and breakaway force."""

    def _parameters(self) -> tuple[Any, Any, Any]:
        """mu and alpha in float64, and where the force turns; refused where one of them is free."""
        missing = [name for name in ("mu", "alpha") if name in self.free]
        if missing:
            raise InputError(f"{missing[0]} has no value; set it with bind({missing[0]}=…).")
        mu, alpha = (np.asarray(floats(n, self._values[n])) for n in ("mu", "alpha"))
        with np.errstate(divide="ignore", invalid="ignore"):
            return mu, alpha, np.where(mu > 0.5, np.sqrt((1 + mu) / (3 * mu)), np.nan)

    def turning_points(self) -> Any:
        """u > 0 at which the friction force turns, sqrt((1+mu)/(3 mu)); nan where mu <= 1/2.

        The force also turns at -u. In float64; multiply by eps for the physical y_s
        (``turning-points``).

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).turning_points()
        0.6666666666666666
        """
        return _plain(self._parameters()[2])

    def folds(self) -> Folds:
        """The fold points u^(±) and z0^(±) (``folds``); nan where mu <= 1/2 (none inside).

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).folds().z0[0]
        -0.7777777777777777
        """
        mu, alpha, u = self._parameters()
        rise = 2 * alpha * (1 + mu) / 3 * u
        return Folds((_plain(u), _plain(-u)), (_plain(1 - rise), _plain(1 + rise)))

    def beta(self) -> Any:
        """The breakaway force (``beta``): the largest friction force inside the layer (float64).

        ``alpha`` times 2 (1+mu)^(3/2) / (3 sqrt(3 mu)) for mu > 1/2, else ``alpha``.

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).beta()
        1.7777777777777777
        """
        mu, alpha, u = self._parameters()
        return _plain(np.where(mu > 0.5, 2 * alpha * (1 + mu) / 3 * u, alpha))


def friction(
    mu: Numbers | None = None, alpha: Numbers | None = None, z0: Numbers | None = None
) -> Friction:
    """The friction oscillator's drift, 1 - z0 - alpha (u + mu (u - u^3)) (eq:phifric0).

    Parameters
    ----------
    mu : number or array_like, optional
        Shape of the friction force, at least 0; above 1/2 it overshoots.
    alpha : number or array_like, optional
        Friction strength, greater than 0.
    z0 : number or array_like, optional
        Spring extension at the start. What is left out stays free.

    Returns
    -------
    Friction

    Raises
    ------
    InputError
        If mu < 0 or alpha <= 0.

    Examples
    --------
    >>> import symasym as sa
    >>> sa.friction(mu=3, alpha=1, z0="-0.4").region
    'crossing'
    """
    return Friction.of(models.Friction(), mu=mu, alpha=alpha, z0=z0)


def _plain(value: Floats) -> Any:
    """`value`, an array of no axes as a float."""
    array = np.asarray(value)
    return float(array) if array.ndim == 0 else array
