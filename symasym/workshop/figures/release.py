"""The release of the moving block: paths, where and when it comes free, and the regimes of it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import Number, Numbers, exact, positive, to_float
from symasym.drift.models import check_count
from symasym.release.march import Marched, Scene, laws, march
from symasym.workshop.figures.style import (
    FAINT,
    INK,
    colors,
    dark,
    fold_of,
    given_text,
    new_figure,
    number_text,
    reads_numbers,
    several,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

POINTS = 25
_RTOL = 1e-3
_PATHS = 3
_STEP = 0.01


def _fold(mu: Number, alpha: Number, z0: Number) -> float:
    """The fold that the block is taken to; refused where z0 has no well to stick in."""
    fold, edge = fold_of(mu, alpha), 1 - float(exact("a", alpha))
    if not fold < float(exact("z0", z0)) < edge:
        raise InputError(
            f"z0 is {z0}; give it between the fold, {fold:.4g}, and {edge:.4g}, where a switch "
            "without smoothing is crossed and the smoothed one holds."
        )
    return fold


@reads_numbers
def release(
    points: int = POINTS,
    *,
    mu: Number = 3,
    alpha: Number = 1,
    z0: Number = "-0.4",
    kappa: Numbers = ("0.1", "0.2", "0.3"),
    eps: Number = "0.01",
    r: Number = 10,
) -> Figure:
    """The place and time at which the moving block comes free, beside T with z frozen.

    Parameters
    ----------
    points : int
        Noise amplitudes of panel (c), at least 5.
    mu : number
        Shape of the friction force.
    alpha : number
        Strength of the friction force.
    z0 : number
        Spring extension at the start, between the fold and 1 - alpha.
    kappa : number or sequence of up to four numbers
        Scaled noise amplitudes of panels (a) and (b).
    eps : number
        Physical half-width of the layer.
    r : number
        Scaled radius of escape.

    Examples
    --------
    >>> from symasym.workshop.figures import release
    >>> len(release(points=5, kappa="0.5").axes)
    3
    """
    if check_count("points", points) < 5:
        raise InputError(f"points is {points}; give 5 or more.")
    amplitudes = several("kappa", kappa)
    fold = _fold(mu, alpha, z0)
    block = sa.oscillator(mu=mu, alpha=alpha)
    text = given_text(mu=mu, alpha=alpha, z0=z0, eps=eps, r=r)
    caption = (
        f"The block of the oscillator that begins to stick at z0 ({text}): (a) paths in the layer, "
        "taken along the wells (dots: barriers) to the left by the belt; (b) density of z at "
        "release; (c) mean time of release against the scaled kappa: of the whole system, with z "
        "frozen, by the adiabatic law, and by the paper's formula for z frozen."
    )
    noise = [to_float("kappa", positive("kappa", exact("kappa", k))) for k in amplitudes]
    scenes = [
        Scene(block, k, float(exact("r", r)), float(exact("eps", eps)), 0.0, float(exact("z0", z0)))
        for k in noise
    ]
    with style():
        figure = new_figure(7.2, 5.4, caption)
        panels = figure.subplot_mosaic([["paths", "paths"], ["density", "times"]])
        plane, law, times = (panels[name] for name in ("paths", "density", "times"))
        _wells(plane, mu, alpha, fold, scenes[0].z)
        for scene, label, color in zip(scenes, amplitudes, colors(), strict=False):
            name = rf"$\kappa = {number_text(exact('kappa', label))}$"
            _paths(plane, scene, color)
            _density(law, march(scene, _RTOL), scene, color, name)
        plane.set(xlabel="$z$", ylabel="$u$", ylim=(-0.2, 2.2), title="(a)  paths")
        law.axvline(fold, color=INK, linewidth=0.6, linestyle=":")
        law.set(xlabel="$z$ at release", ylabel="density", title="(b)  place of release")
        law.set_xlim(right=scenes[0].z)
        law.legend(loc="upper right")
        plane.legend(*law.get_legend_handles_labels(), loc="upper left")
        _times(times, scenes[0], mu, alpha, points)
        return figure


def _wells(axes: Axes, mu: Number, alpha: Number, fold: float, z0: float) -> None:
    """Wells (solid) and barriers (dotted) in the plane of z and u."""
    across = np.linspace(-0.2, 1.0, 200)
    strength, shape = float(exact("alpha", alpha)), float(exact("mu", mu))
    z = 1 - strength * (across + shape * (across - across**3))
    turn = float(sa.friction(mu=mu, alpha=alpha).turning_points())
    low = across <= turn
    axes.plot(z[low], across[low], color=INK, linewidth=1.4, zorder=3, gid="wells")
    axes.plot(
        z[~low], across[~low], color=INK, linewidth=1.4, linestyle=":", zorder=3, gid="barriers"
    )
    axes.axvline(fold, color=INK, linewidth=0.6, linestyle=":")
    axes.set_xlim(fold - 0.35 * abs(z0 - fold) - 0.1, z0 + 0.05)


def _paths(axes: Axes, scene: Scene, color: str) -> None:
    """A few simulated paths."""
    normal = np.random.default_rng(5).standard_normal
    system, kappa, r, eps, start, z0 = scene
    u, z = np.full(_PATHS, start), np.full(_PATHS, z0)
    rows = [(z, u)]
    while (np.abs(u) < r).any() and len(rows) < 200_000:
        stays = np.abs(u) < r
        push = kappa * np.sqrt(_STEP) * normal(_PATHS)
        moved = u + _STEP * system.phi_at(u, z, eps) + push
        z = np.where(stays, z + _STEP * eps * system.velocity_at(u, z, eps), z)
        u = np.where(stays, moved, u)
        rows.append((z, u))
    every = slice(None, None, max(1, len(rows) // 1200))
    for k in range(_PATHS):
        line = np.array([(a[k], b[k]) for a, b in rows[every]])
        axes.plot(line[:, 0], line[:, 1], color=color, linewidth=0.35, alpha=0.8)


def _density(axes: Axes, marched: Marched, scene: Scene, color: str, name: str) -> None:
    """The density of z at release."""
    _, law = laws(marched.density, scene.z, scene.sign)
    low, high = law.quantile(1e-4), law.quantile(1 - 1e-4)
    z = np.linspace(low, high, 300)
    axes.plot((z[1:] + z[:-1]) / 2, np.diff(law.cdf(z)) / np.diff(z), color=color, label=name)


def _times(axes: Axes, scene: Scene, mu: Number, alpha: Number, points: int) -> None:
    """Mean time against kappa, by the whole system and three approximations."""
    kappa = np.geomspace(0.05, 2.0, points)
    blue, red, teal, ochre = colors()
    ask: dict[str, Any] = {"eps": scene.eps, "start": (scene.u, scene.z)}
    frozen = sa.friction(mu=mu, alpha=alpha, z0=scene.z)
    fine = np.geomspace(0.05, 2.0, 200)
    axes.plot(
        fine,
        np.exp(sa.escape_time(frozen, fine, scene.r, log=True)),
        color=red,
        linestyle="--",
        label="frozen, exact",
    )
    paper = sa.escape_time(frozen, fine, scene.r, method="paper", log=True)
    axes.plot(
        fine, np.exp(paper), color=ochre, linestyle=(0, (1.0, 1.7)), label="frozen, paper's formula"
    )
    laws: tuple[tuple[Literal["adiabatic", "march"], Any, str, str], ...] = (
        ("adiabatic", teal, "-.", "moving, adiabatic law"),
        ("march", blue, "-", "moving"),
    )
    for method, color, dashes, label in laws:
        means = [
            sa.release(scene.system, k, scene.r, method=method, rtol=_RTOL, **ask).mean
            for k in kappa.tolist()
        ]
        axes.plot(kappa, means, color=color, linestyle=dashes, label=label)
    whole = float(axes.lines[-1].get_ydata()[0])  # type: ignore[index, arg-type]
    axes.set(
        xscale="log",
        yscale="log",
        xlabel=r"$\kappa$ (scaled)",
        ylabel="mean time",
        ylim=(5, 30 * whole),
        title="(c)  time of release, $z$ frozen or moving",
    )
    axes.legend(loc="upper right", fontsize="small", handlelength=1.7)


@reads_numbers
def regimes(
    points: int = 4,
    *,
    mu: Number = 3,
    alpha: Number = 1,
    z0: Number = "-0.4",
    r: Number = 10,
) -> Figure:
    """Regions where the block passes, escapes by noise or sticks to the fold, in eps and kappa.

    Parameters
    ----------
    points : int
        Scenes a side that are marched, at least 2.
    mu, alpha, z0 : number
        As in `release`.
    r : number
        Scaled radius.

    Examples
    --------
    >>> from symasym.workshop.figures import regimes
    >>> regimes(points=2).axes[0].get_xlabel()
    '$\\\\varepsilon$'
    """
    if check_count("points", points) < 2:
        raise InputError(f"points is {points}; give 2 or more.")
    fold = _fold(mu, alpha, z0)
    start, radius = float(exact("z0", z0)), float(exact("r", r))
    family = sa.friction(mu=mu, alpha=alpha)
    noise = np.geomspace(0.01, 3.0, 160)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    z = (start + fold) / 2 + (start - fold) / 2 * nodes
    logs = sa.escape_time(family.bind(z0=z[:, None]), noise[None, :], radius, log=True)
    # Held to the fold with probability exp(-hazard/eps), by the adiabatic law.
    hazard = (start - fold) / 2 * (weights[:, None] * np.exp(-np.asarray(logs))).sum(axis=0)
    eps_half = hazard / np.log(2.0)
    # Without a well the block would take this long.
    flight = radius / (1 - start - float(exact("alpha", alpha)))
    here = np.asarray(sa.escape_time(family.bind(z0=start), noise, radius, log=True))
    free = float(np.interp(-np.log(2.0 * flight), -here, noise))
    eps = np.geomspace(1e-5, 0.05, 200)
    text = given_text(mu=mu, alpha=alpha, z0=z0, r=r)
    caption = (
        f"What becomes of a block that begins to stick at z0 ({text}, r scaled), over eps and the "
        "physical kappa_p. It is held to the fold with probability 1/2 on the solid curve, by the "
        "adiabatic law; above the dashed one T is less than twice the time of the ideal switch. "
        "Marks are scenes whose release was computed: squares where the block is held to the fold, "
        "rings where noise frees it before, and crosses where its mean time is less than twice "
        "that of the ideal switch; at the right the belt reaches the fold within that time. "
        "Dotted: the paper's threshold."
    )
    with style():
        figure = new_figure(5.4, 4.6, caption)
        axes = figure.subplots()
        blue, red, teal, ochre = colors()
        seen = (noise < free) & (eps_half > 1e-9)
        axes.plot(
            eps_half[seen],
            (noise * np.sqrt(eps_half))[seen],
            color=blue,
            label="held to the fold with probability 1/2",
        )
        axes.plot(
            eps,
            free * np.sqrt(eps),
            color=red,
            linestyle="--",
            label="$T$ twice that of the ideal switch",
        )
        axes.plot(
            eps,
            np.sqrt(-eps / np.log(eps)),
            color=INK,
            linestyle=":",
            label="the paper's threshold",
        )
        ends = {
            "computed: passes": ("x", red),
            "computed: escapes by noise": ("o", teal),
            "computed: sticks to the fold": ("s", blue),
        }
        mark: dict[str, Any] = {"fillstyle": "none", "markersize": 5, "linestyle": "none"}
        for name, (marker, color) in ends.items():
            axes.plot([], [], marker=marker, color=dark(color, 0.8), label=name, **mark)
        block = sa.oscillator(mu=mu, alpha=alpha)
        for e in np.geomspace(3e-5, 0.03, points).tolist():
            for k in np.geomspace(0.05, 1.6, points).tolist():
                marched = march(Scene(block, k, radius, e, 0.0, start), _RTOL)
                _, law = laws(marched.density, start, -1.0)
                # Past the fold it still takes its way to r.
                held = law.cdf(fold - e * radius / (1 - fold - float(exact("alpha", alpha))))
                passes = marched.mean < 2.0 * flight
                held_to_it = "sticks to the fold" if held > 0.5 else "escapes by noise"
                marker, color = ends[f"computed: {'passes' if passes else held_to_it}"]
                at = [e], [k * np.sqrt(e)]
                axes.plot(*at, marker=marker, color=dark(color, 0.8), **mark)
        axes.set(
            xscale="log",
            yscale="log",
            xlabel=r"$\varepsilon$",
            ylabel=r"$\kappa_p$",
            xlim=(1e-5, 0.05),
            ylim=(1e-4, 1.0),
        )
        axes.text(0.8, 0.1, "sticks to the fold", transform=axes.transAxes, ha="right", color=FAINT)
        axes.text(0.03, 0.93, "passes", transform=axes.transAxes, va="top", color=FAINT)
        axes.text(
            0.27,
            0.16,
            "escapes by noise",
            transform=axes.transAxes,
            ha="center",
            rotation=32,
            color=FAINT,
        )
        figure.legend(loc="outside lower center", ncols=2, fontsize="small")
        return figure
