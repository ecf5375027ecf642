"""The escape time through the fold, by step, local and uniform approximation (stokes)."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, exact
from symasym.drift.models import check_count
from symasym.workshop.figures.style import INK, colors, new_figure, number_text, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from symasym.quantities import TimeMethod

POINTS = 27
# As many more where arrays are quick.
_FINER = 8
# Noise amplitudes of the error map.
_MAP = np.geomspace(0.04, 0.28, 40)

#: Values of z0 and logarithms of T, by name.
Curves = dict[str, tuple[FloatArray, FloatArray]]


def stokes(
    points: int = POINTS,
    *,
    mu: Number = 3,
    alpha: Number = 1,
    kappa: Number = "0.1",
    r: Number = 10,
) -> Figure:
    """The escape time against z0 where the friction oscillator's well is born.

    Parameters
    ----------
    points : int
        Values of z0 on both sides of the fold, at least 8.
    mu, alpha : number
        Shape and strength of the friction force; mu > 1/2, so that there is a fold.
    kappa, r : number
        Scaled noise amplitude and radius.

    Returns
    -------
    matplotlib.figure.Figure
        Times, multiplier, relative errors, and the error of the uniform formula over z0
        and kappa.

    Raises
    ------
    InputError
        If a parameter is out of its range, or there is no fold.

    Examples
    --------
    >>> from symasym.workshop.figures import stokes
    >>> [len(axes.lines) for axes in stokes(points=8).axes[:3]]
    [5, 3, 5]
    """
    if check_count("points", points) < 8:
        raise InputError(f"points is {points}; give 8 or more.")
    family = sa.friction(mu=mu, alpha=alpha)
    fold = float(family.folds().z0[0])
    if np.isnan(fold):
        raise InputError(f"mu is {mu}; this figure is about the fold, which needs mu > 1/2.")
    width = min(0.35, 0.9 * (1 - float(alpha) - fold))
    fine = fold + np.linspace(-0.8, 1.0, _FINER * (points - 1) + 1) * width
    z0 = fine[::_FINER]
    drift, every = family.bind(z0=z0), family.bind(z0=fine[:, None])
    noise = [float(kappa), *_MAP]
    wanted = np.asarray(sa.escape_time(every, noise, r, log=True))
    both = np.asarray(sa.escape_time(every, noise, r, method="uniform", order=0, log=True))

    def log_time(method: TimeMethod, order: int | None = None) -> FloatArray:
        """log T over z0 by a method."""
        return np.asarray(
            sa.escape_time(drift, float(kappa), r, method=method, order=order, log=True)
        )

    step = sa.escape_time(family.bind(z0=fine), float(kappa), r, method="paper", log=True)
    curves = {
        "step (the paper)": (fine, np.asarray(step)),
        "local": (z0, log_time("local")),
        "uniform, order 0": (fine, both[:, 0]),
        "uniform, order 1": (z0, log_time("uniform", 1)),
        "uniform, order 2": (z0, log_time("uniform", 2)),
    }
    exact_logs = dict(zip(fine.tolist(), wanted[:, 0].tolist(), strict=True))
    with style():
        figure = new_figure(7.2, 5.6, _caption(fold, mu, kappa, r))
        times, shares, errors, plane = figure.subplots(2, 2).ravel()
        _times(times, curves, fine, wanted[:, 0], fold)
        _shares(shares, drift, kappa, z0, fold)
        _errors(errors, curves, exact_logs)
        _plane(plane, fine, np.abs(np.expm1(both - wanted))[:, 1:], fold)
        for letter, one in zip("abcd", (times, shares, errors, plane), strict=True):
            one.set_title(f"({letter})", loc="left")
            one.set_xlabel(r"$z_0$")
    return figure


def _caption(fold: float, mu: Number, kappa: Number, r: Number) -> str:
    """The figure's caption."""
    given = {"mu": mu, "kappa": kappa, "r": r}
    shown = ", ".join(f"{name} = {number_text(exact(name, x))}" for name, x in given.items())
    return (
        f"A well is born at z0 = {fold:.4g} ({shown}): the escape time (a), the "
        "Stokes multiplier (b), relative errors (c), and the error of the uniform formula's "
        "leading order over z0 and kappa (d)."
    )


def _marked(axes: Axes, fold: float) -> None:
    """Draw the fold as a dotted line."""
    axes.axvline(fold, color=INK, linewidth=0.6, linestyle=":")


def _times(axes: Axes, curves: Curves, z0: FloatArray, wanted: FloatArray, fold: float) -> None:
    """Draw the escape time near the fold."""
    near = 0.55 * np.ptp(z0) / 2
    chosen = np.abs(z0 - fold) < near
    axes.semilogy(z0[chosen], np.exp(wanted[chosen]), color=INK, label="exact")
    shown = ("step (the paper)", "local", "uniform, order 0")
    for name, color, dashes in zip(shown, colors(), ("-.", "--", ":"), strict=False):
        at, logs = curves[name]
        chosen = np.abs(at - fold) < near
        at, values = at[chosen], np.exp(logs[chosen])
        if name.startswith("step"):
            # A gap, not a line, at the step.
            index = int(np.searchsorted(at, fold))
            at, values = np.insert(at, index, fold), np.insert(values, index, np.nan)
        axes.semilogy(at, values, dashes, color=color, label=name)
    _marked(axes, fold)
    axes.set_ylabel("escape time")
    axes.legend()


def _shares(axes: Axes, drift: sa.Drift, kappa: Number, z0: FloatArray, fold: float) -> None:
    """Draw the Stokes multiplier."""
    for method, color, dashes in zip(
        ("uniform", "local"), colors()[2:0:-1], ("-", "--"), strict=False
    ):
        values = sa.stokes_multiplier(drift, float(kappa), method=method)
        axes.plot(z0, values, dashes, color=color, label=method)
    axes.step([z0[0], fold, z0[-1]], [0, 0, 1], where="pre", color=INK, label="step", zorder=1)
    axes.set_ylabel("Stokes multiplier")
    axes.legend()


def _errors(axes: Axes, curves: Curves, wanted: dict[float, float]) -> None:
    """Draw the relative errors of T."""
    looks = zip(curves.items(), [*colors(), INK], ("-.", "--", "-", "-", "-"), strict=False)
    for (name, (z0, logs)), color, dashes in looks:
        exact_logs = np.array([wanted[z] for z in z0.tolist()])
        error = np.maximum(np.abs(np.expm1(logs - exact_logs)), 1e-16)
        axes.semilogy(z0, error, dashes, color=color, label=name)
    axes.set_ylabel("relative error")
    axes.set_ylim(top=1e3)
    axes.legend(fontsize=7.2, ncols=2, loc="upper left")


def _plane(axes: Axes, z0: FloatArray, error: FloatArray, fold: float) -> None:
    """Draw the error of the uniform formula over z0 and kappa."""
    shown = axes.pcolormesh(
        z0, _MAP, np.log10(np.maximum(error.T, 1e-16)), shading="nearest", cmap="cividis"
    )
    axes.set_yscale("log")
    axes.set_yticks([0.05, 0.1, 0.2], ["0.05", "0.1", "0.2"])
    axes.minorticks_off()
    axes.set_ylabel(r"$\kappa$")
    _marked(axes, fold)
    axes.figure.colorbar(shown, ax=axes, label=r"$\log_{10}$ relative error")
