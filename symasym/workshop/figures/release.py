"""The release of the moving block: paths, where and when it comes free, and the regimes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.workshop.figures.style import (
    BLUE,
    FAINT,
    INK,
    OCHRE,
    RED,
    TEAL,
    new_figure,
    shade,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_Z0, _R, _EPS, _FOLD = -0.4, 10.0, 0.01, -7 / 9
_RTOL = 1e-3
_NOISES = {"0.1": BLUE, "0.2": RED, "0.3": TEAL}


def _released(kappa: float, eps: float = _EPS) -> Any:
    block = sa.oscillator(mu=3, alpha=1)
    return sa.release(block, kappa, _R, eps=eps, start=(0, _Z0), method="march", rtol=_RTOL)


def release() -> Figure:
    """The place and time at which the moving block comes free, beside T with z frozen."""
    caption = (
        "The block of the oscillator that begins to stick at z0 (mu = 3, alpha = 1, z0 = -0.4, "
        "eps = 0.01, r = 10): (a) paths in the layer, taken along the wells (dots: barriers) to "
        "the left by the belt; (b) density of z at release; (c) mean time of release against the "
        "scaled kappa: of the whole system, with z frozen, and by the paper's formula for z frozen."
    )
    with style():
        figure = new_figure(7.2, 5.4, caption)
        panels = figure.subplot_mosaic([["paths", "paths"], ["density", "times"]])
        plane, law, times = (panels[name] for name in ("paths", "density", "times"))
        u = np.linspace(-0.2, 1.0, 200)
        z, low = 1 - 4 * u + 3 * u**3, u <= 2 / 3
        plane.plot(z[low], u[low], color=INK, linewidth=1.4, zorder=3)
        plane.plot(z[~low], u[~low], ":", color=INK, linewidth=1.4, zorder=3)
        for name, color in _NOISES.items():
            _paths(plane, float(name), color)
            place = _released(float(name)).z
            z = np.linspace(place.quantile(1e-4), place.quantile(1 - 1e-4), 300)
            density = np.diff(place.cdf(z)) / np.diff(z)
            law.plot((z[1:] + z[:-1]) / 2, density, color=color, label=rf"$\kappa = {name}$")
        for axes in (plane, law):
            axes.axvline(_FOLD, color=INK, linewidth=0.6, linestyle=":")
        plane.set(xlabel="$z$", ylabel="$u$", title="(a)  paths")
        plane.set(xlim=(-1.02, -0.35), ylim=(-0.2, 2.2))
        law.set(xlabel="$z$ at release", ylabel="density", title="(b)  place of release")
        law.set_xlim(right=_Z0)
        law.legend(loc="upper right")
        plane.legend(*law.get_legend_handles_labels(), loc="upper left")
        frozen, fine = sa.friction(3, 1, "-0.4"), np.geomspace(0.05, 2.0, 200)
        for method, color, dashes, label in (
            ("exact", RED, "--", "frozen, exact"),
            ("paper", OCHRE, (0, (1.0, 1.7)), "frozen, paper's formula"),
        ):
            logs = sa.escape_time(frozen, fine, _R, method=method, log=True)  # type: ignore[arg-type]
            times.plot(fine, np.exp(np.minimum(logs, 600)), color=color, ls=dashes, label=label)
        some = np.geomspace(0.05, 2.0, 25)
        means = [_released(k).mean for k in some.tolist()]
        times.plot(some, means, color=BLUE, label="moving")
        times.set(
            xscale="log", yscale="log", xlabel=r"$\kappa$ (scaled)", ylabel="mean time",
            ylim=(5, 30 * means[0]), title="(c)  time of release, $z$ frozen or moving",
        )  # fmt: skip
        times.legend(loc="upper right", fontsize="small", handlelength=1.7)
    return figure


def _paths(axes: Axes, kappa: float, color: str) -> None:
    """Three simulated paths, by steps of 0.01."""
    normal, step = np.random.default_rng(5).standard_normal, 0.01
    u, z = np.zeros(3), np.full(3, _Z0)
    rows = [(z, u)]
    while (stays := np.abs(u) < _R).any() and len(rows) < 200_000:
        inside = np.clip(u, -1, 1)
        phi = 1 - z - _EPS * u - inside - 3 * (inside - inside**3)
        moved = u + step * phi + kappa * np.sqrt(step) * normal(3)
        z = np.where(stays, z + step * _EPS * (_EPS * u - 1), z)
        u = np.where(stays, moved, u)
        rows.append((z, u))
    every = rows[:: max(1, len(rows) // 1200)]
    axes.plot(*np.array(every).transpose(1, 0, 2), color=color, linewidth=0.35, alpha=0.8)


def regimes() -> Figure:
    """Regions where the block passes, escapes by noise or sticks to the fold, in eps and kappa."""
    caption = (
        "What becomes of a block that begins to stick at z0 (mu = 3, alpha = 1, z0 = -0.4, r = 10 "
        "scaled), over eps and the physical kappa_p. It is held to the fold with probability 1/2 "
        "on the solid curve, by the adiabatic law; above the dashed one T is less than twice the "
        "time of the ideal switch. Marks are scenes whose release was computed: squares where the "
        "block is held to the fold, rings where noise frees it before, and crosses where its mean "
        "time is less than twice that of the ideal switch; at the right the belt reaches the fold "
        "within that time. Dotted: the paper's threshold."
    )
    family, noise = sa.friction(3, 1), np.geomspace(0.01, 3.0, 160)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    z = (_Z0 + _FOLD) / 2 + (_Z0 - _FOLD) / 2 * nodes
    logs = sa.escape_time(family.bind(z0=z[:, None]), noise[None, :], _R, log=True)
    # Held to the fold with probability exp(-hazard/eps), by the adiabatic law.
    half = (_Z0 - _FOLD) / 2 * (weights[:, None] * np.exp(-logs)).sum(axis=0) / np.log(2.0)
    flight = _R / -_Z0  # without a well
    here = sa.escape_time(family.bind(z0=_Z0), noise, _R, log=True)
    free = float(np.interp(-np.log(2.0 * flight), -here, noise))
    eps = np.geomspace(1e-5, 0.05, 200)
    mark: dict[str, Any] = {"fillstyle": "none", "markersize": 5, "linestyle": "none"}
    stick = "sticks to the fold"
    ends = {"passes": ("x", RED), "escapes by noise": ("o", TEAL), stick: ("s", BLUE)}
    with style():
        figure = new_figure(5.4, 4.6, caption)
        axes = figure.subplots()
        seen = (noise < free) & (half > 1e-9)
        held = "held to the fold with probability 1/2"
        axes.plot(half[seen], (noise * np.sqrt(half))[seen], color=BLUE, label=held)
        twice = "$T$ twice that of the ideal switch"
        axes.plot(eps, free * np.sqrt(eps), color=RED, linestyle="--", label=twice)
        axes.plot(eps, np.sqrt(-eps / np.log(eps)), ":", color=INK, label="the paper's threshold")
        for name, (marker, color) in ends.items():
            axes.plot([], [], marker, color=shade(color, 0.8), label=f"computed: {name}", **mark)
        for e in np.geomspace(3e-5, 0.03, 4).tolist():
            for k in np.geomspace(0.05, 1.6, 4).tolist():
                found = _released(k, e)
                # Past the fold it still takes its way to r.
                stuck = found.z.cdf(_FOLD - e * _R / -_FOLD) > 0.5
                name = stick if stuck else "escapes by noise"
                marker, color = ends["passes" if found.mean < 2.0 * flight else name]
                axes.plot([e], [k * np.sqrt(e)], marker, color=shade(color, 0.8), **mark)
        axes.set(
            xscale="log", yscale="log", xlabel=r"$\varepsilon$", ylabel=r"$\kappa_p$",
            xlim=(1e-5, 0.05), ylim=(1e-4, 1.0),
        )  # fmt: skip
        for x, y, text, turned in (
            (0.62, 0.1, "sticks to the fold", 0), (0.1, 0.93, "passes", 0),
            (0.27, 0.16, "escapes by noise", 32),
        ):  # fmt: skip
            axes.text(
                x, y, text, transform=axes.transAxes, ha="center", rotation=turned, color=FAINT
            )
        figure.legend(loc="outside lower center", ncols=2, fontsize="small")
    return figure
