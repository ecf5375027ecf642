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

    def _mu_alpha(self) -> tuple[Any, Any]:
        """mu and alpha in float64; refused where one of them is free."""
        missing = [name for name in ("mu", "alpha") if name in self.free]
        if missing:
            raise InputError(f"{missing[0]} has no value; set it with bind({missing[0]}=…).")
        mu, alpha = (self._values[n] for n in ("mu", "alpha"))
        return floats("mu", mu)[()], floats("alpha", alpha)[()]

    def turning_points(self) -> Any:
        """u > 0 at which the friction force turns, sqrt((1+mu)/(3 mu)); nan where mu <= 1/2.

        The force also turns at -u. In float64; multiply by eps for the physical y_s.

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).turning_points()
        0.6666666666666666
        """
        mu, _ = self._mu_alpha()
        with np.errstate(divide="ignore", invalid="ignore"):
            return _plain(np.where(mu > 0.5, turning_point(mu), np.nan))

    def folds(self) -> Folds:
        """The fold points u^(±) and z0^(±); nan where mu <= 1/2 (no turning point inside).

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).folds().z0[0]
        -0.7777777777777777
        """
        u = self.turning_points()
        mu, alpha = self._mu_alpha()
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            force = breakaway(mu, alpha)
            z0 = [np.where(np.isnan(u), np.nan, z) for z in (1 - force, 1 + force)]
        _require_finite("z0 of a fold", z0)
        return Folds((_plain(u), _plain(-np.asarray(u))), (_plain(z0[0]), _plain(z0[1])))

    def beta(self) -> Any:
        """The breakaway force: the largest friction force inside the layer (float64).

        ``alpha`` times 2 (1+mu)^(3/2) / (3 sqrt(3 mu)) for mu > 1/2, else ``alpha``.

        Examples
        --------
        >>> import symasym as sa
        >>> sa.friction(mu=3, alpha=1).beta()
        1.7777777777777777
        """
        mu, alpha = self._mu_alpha()
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            force = np.where(mu > 0.5, breakaway(mu, alpha), alpha)
        _require_finite("the breakaway force", force)
        return _plain(force)


def turning_point(mu: Any) -> Any:
    """u at which the force turns, for mu > 1/2 (turning-points)."""
    return np.sqrt((1 + mu) / mu / 3)


def breakaway(mu: Any, alpha: Any) -> Any:
    """The largest force, for mu >= 1/2 (beta); folds are at z0 = 1 -+ it (folds)."""
    return 2 / 3 * alpha * (1 + mu) * turning_point(mu)


def _require_finite(name: str, values: Any) -> None:
    """Refuse what overflows, on the way at least."""
    if np.isinf(values).any():
        raise InputError(f"{name} is beyond the range of float64; rescale the problem.")


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
