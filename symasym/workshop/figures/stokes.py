"""The escape time through the fold, by step, local and uniform approximation (stokes)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, exact
from symasym.drift.models import check_count
from symasym.workshop.figures.style import (
    INK,
    colors,
    dark,
    fold_of,
    given_text,
    new_figure,
    number_text,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from symasym.quantities import TimeMethod

POINTS = 33
# As many more where arrays are quick.
_FINER = 7
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
        Values of z0 on both sides of the fold, at least 8, for the methods that take
        one scene at a time; the others have seven times as many.
    mu, alpha : number
        Shape and strength of the friction force; mu > 1/2, so that there is a fold.
    kappa, r : number
        Scaled noise amplitude and radius.

    Returns
    -------
    matplotlib.figure.Figure
        Times, multiplier, relative errors, and the error of the uniform formula over z0
        and kappa.

    Examples
    --------
    >>> from symasym.workshop.figures import stokes
    >>> [len(axes.lines) for axes in stokes(points=8).axes[:3]]
    [5, 4, 6]
    """
    if check_count("points", points) < 8:
        raise InputError(f"points is {points}; give 8 or more.")
    family = sa.friction(mu=mu, alpha=alpha)
    fold = fold_of(mu, alpha)
    width = min(0.35, 0.9 * (1 - float(alpha) - fold))
    fine = fold + np.linspace(-0.8, 1.0, _FINER * (points - 1) + 1) * width
    z0 = fine[::_FINER]
    drift, every = family.bind(z0=z0), family.bind(z0=fine[:, None])
    noise = [float(kappa), *_MAP]
    wanted = np.asarray(sa.escape_time(every, noise, r, log=True))
    both = np.asarray(sa.escape_time(every, noise, r, method="uniform", order=0, log=True))

    def log_time(method: TimeMethod, order: int | None = None) -> FloatArray:
        """log T over z0 by a method that takes one scene at a time."""
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
    caption = (
        f"A well is born at z0 = {fold:.4g} ({given_text(mu=mu, kappa=kappa, r=r)}): the escape "
        "time with z frozen (a), the Stokes multiplier (b), relative errors (c), and the error of "
        "the uniform formula's leading order over z0 and kappa (d)."
    )
    with style():
        figure = new_figure(7.6, 6.0, caption)
        times, shares, errors, plane = figure.subplots(2, 2).ravel()
        _times(times, curves, fine, wanted[:, 0], fold)
        _shares(shares, family.bind(z0=fine), kappa, fine, fold)
        _errors(errors, curves, fine, wanted[:, 0])
        _plane(plane, fine, np.abs(np.expm1(both - wanted))[:, 1:])
        amplitude = rf"$\kappa = {number_text(exact('kappa', kappa))}$"
        titles = {
            times: rf"escape time, $\mu = {number_text(exact('mu', mu))}$, {amplitude}, $r = {r}$",
            shares: f"Stokes multiplier, {amplitude}",
            errors: f"error, {amplitude}",
            plane: r"error of uniform, order 0",
        }
        for letter, (one, title) in zip("abcd", titles.items(), strict=True):
            one.set_title(f"({letter})  {title}", loc="left")
            one.set_xlabel(r"$z_0$")
            one.axvline(fold, color=INK, linewidth=0.6, linestyle=":")
    return figure


def _looks() -> dict[str, tuple[object, str]]:
    """Colour and dashes of each formula, the same in all panels."""
    blue, red, teal, ochre = colors()
    return {
        "exact": (INK, "-"),
        "step (the paper)": (blue, "-."),
        "local": (red, "--"),
        "uniform, order 0": (teal, "-"),
        "uniform, order 1": (ochre, "-"),
        "uniform, order 2": (dark(ochre, 0.5), "-"),
    }


# A legend that the line at the fold does not go through.
_ON_TOP: dict[str, Any] = {"frameon": True, "framealpha": 1, "edgecolor": "none"}


def _times(axes: Axes, curves: Curves, z0: FloatArray, wanted: FloatArray, fold: float) -> None:
    """Draw the escape time near the fold."""
    near = 0.55 * np.ptp(z0) / 2
    looks = _looks()
    shown = {"exact": (z0, wanted), **{name: curves[name] for name in list(curves)[2::-1]}}
    for name, (at, logs) in shown.items():
        color, dashes = looks[name]
        chosen = np.abs(at - fold) < near
        at, values = at[chosen], np.exp(logs[chosen])
        if name.startswith("step"):
            # A gap, not a line, at the step.
            index = int(np.searchsorted(at, fold))
            at, values = np.insert(at, index, fold), np.insert(values, index, np.nan)
        wide = 3.2 if name == "exact" else 1.5
        axes.semilogy(at, values, dashes, color=color, linewidth=wide, label=name)
    axes.set_ylabel(r"$T$")
    axes.legend(loc="upper left", **_ON_TOP)


def _shares(axes: Axes, drift: sa.Drift, kappa: Number, z0: FloatArray, fold: float) -> None:
    """Draw the Stokes multiplier."""
    looks = _looks()
    for method, name in (("uniform", "uniform, order 0"), ("local", "local")):
        values = sa.stokes_multiplier(drift, float(kappa), method=method)
        color, dashes = looks[name]
        axes.plot(z0, values, dashes, color=color, label=method)
    color, dashes = looks["step (the paper)"]
    ends, values = [z0[0], fold, fold, z0[-1]], [0, 0, 1, 1]
    axes.plot(ends, values, dashes, color=color, label="step (the paper)", zorder=1)
    axes.legend(loc="upper left", bbox_to_anchor=(0, 0.93), fontsize=7.2, handlelength=1.6)


def _errors(axes: Axes, curves: Curves, z0: FloatArray, wanted: FloatArray) -> None:
    """Draw the relative errors of T."""
    looks = _looks()
    for name, (at, logs) in curves.items():
        color, dashes = looks[name]
        known = wanted[:: (len(z0) - 1) // (len(at) - 1)]
        error = np.maximum(np.abs(np.expm1(logs - known)), 1e-16)
        axes.semilogy(at, error, dashes, color=color, label=name)
    axes.set_ylabel("relative error")
    axes.set_ylim(top=3e4)
    axes.legend(fontsize=7.2, ncols=2, loc="upper left", columnspacing=3.0, **_ON_TOP)


def _plane(axes: Axes, z0: FloatArray, error: FloatArray) -> None:
    """Draw the error of the uniform formula over z0 and kappa."""
    shown = axes.pcolormesh(
        z0, _MAP, np.log10(np.maximum(error.T, 1e-16)), shading="nearest", cmap="cividis"
    )
    axes.set_yscale("log")
    axes.set_yticks([0.05, 0.1, 0.2], ["0.05", "0.1", "0.2"])
    axes.minorticks_off()
    axes.set_ylabel(r"$\kappa$")
    axes.figure.colorbar(shown, ax=axes, label=r"$\log_{10}$ relative error")
