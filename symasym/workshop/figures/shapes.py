"""The potential (potentialSketch), the friction force (fricforce), the oscillator (frictionOsc)."""

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
    headed,
    layer_band,
    new_figure,
    shade,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def potential_sketch() -> Figure:
    """The potential in the three cases of flows (Fig. potentialSketch)."""
    caption = (
        "The potential of the scaled drift, alpha = 1, the layer in grey; wells are full dots, "
        "barriers open ones. (i) Sliding, mu = 0, z0 = 1: one well that nothing leaves. "
        "(ii) Crossing, mu = 0, z0 = -0.39: no well. (iii) The same with mu = 3: a well in the "
        "layer behind a barrier, which noise alone can cross."
    )
    u = np.union1d(np.linspace(-2.5, 2.5, 501), [-1.0, 1.0])
    with style():
        figure = new_figure(9.6, 3.0, caption)
        for axes, mu, z0, title in zip(
            figure.subplots(1, 3), (0, 0, 3), ("1", "-0.39", "-0.39"),
            ("(i)  global well", "(ii)  no well", "(iii)  local well"), strict=True,
        ):  # fmt: skip
            drift = sa.friction(mu=mu, alpha=1, z0=z0)
            height = drift.potential_at(u)
            layer_band(axes, horizontal=False)
            axes.plot(u, height, color=BLUE)
            axes.set(title=title, xlabel="$u$", xlim=(-2.5, 2.5), xticks=[-2, -1, 0, 1, 2])
            # Room for the well's name below it.
            axes.set_ylim(bottom=height.min() - 0.14 * np.ptp(height))
            for number, point in enumerate(drift.critical_points(), 1):
                at = float(point.u), float(drift.potential_at(float(point.u)))
                well = point.kind == "well"
                axes.annotate(
                    f"$u_{number}$", at, (0, -7 if well else 7), textcoords="offset points",
                    ha="center", va="top" if well else "bottom",
                )  # fmt: skip
                look = {"markersize": 5.5, "color": INK, "markerfacecolor": INK if well else "w"}
                axes.plot(*at, "o", zorder=4, **look)
        figure.axes[0].set_ylabel("$V(u)$")
    return figure


def fricforce() -> Figure:
    """The smoothed friction force against the velocity, y/eps (Fig. fricforce)."""
    caption = (
        "The friction force smoothed over |y| <= eps, alpha = 1, for mu = 0, 1/2, 3. Above "
        "mu = 1/2 it turns twice inside the layer, at -y_s and y_s, and its largest value beta, "
        "the breakaway force, is more than the alpha of a block in motion."
    )
    u = np.union1d(np.linspace(-2.1, 2.1, 421), [-1.0, 1.0])
    with style():
        figure = new_figure(5.6, 3.6, caption)
        axes = figure.subplots()
        axes.set(xlim=(-2.1, 2.1), xlabel=r"$y/\varepsilon$", ylabel=r"$\mathcal{F}(y)$")
        layer_band(axes, horizontal=False)
        axes.axhline(0, color=FAINT, linewidth=0.6)
        for mu, color in (("0", FAINT), ("1/2", BLUE), ("3", OCHRE)):
            # At z0 = 1 the spring balances the belt's drag, and the drift is the friction alone.
            axes.plot(u, -sa.friction(mu, 1, 1)(u), color=color, label=rf"$\mu = {mu}$")
        drift = sa.friction(3, 1)
        turn, beta = drift.turning_points(), drift.beta()
        axes.plot([-turn, turn], [-beta, beta], "o", color=INK, markersize=4, zorder=4)
        for side, name, up in ((1, r"$y_s/\varepsilon$", -11), (-1, r"$-y_s/\varepsilon$", 4)):
            axes.plot([side * turn] * 2, [0, side * beta], ":", color=FAINT, linewidth=1, zorder=1)
            axes.annotate(name, (side * turn, 0), (0, up), textcoords="offset points", ha="center")
        axes.plot([-2.1, turn], [beta, beta], ":", color=FAINT, linewidth=1, zorder=1)
        axes.plot([-2.1, -turn], [-beta, -beta], ":", color=FAINT, linewidth=1, zorder=1)
        names = [r"$-\beta$", r"$-\alpha$", "0", r"$\alpha$", r"$\beta$"]
        axes.set_yticks([-beta, -1, 0, 1, beta], names)
        axes.legend(loc="lower right")
    return figure


def friction_osc() -> Figure:
    """The oscillator with a block that sticks, and the forces on it (Fig. frictionOsc)."""
    z, beta = 0.4, float(sa.friction(3, 1).beta())
    caption = (
        "A block on a belt that runs to the left at unit speed, with a linear spring and damper; "
        f"the spring is extended by z = {z} from its rest length (dashed). The block sticks, and "
        "the arrows show the forces on it to one scale: they add up to zero as long as friction "
        f"can supply {1 - z:.3g}, of at most beta = {beta:.3g}."
    )
    with style():
        figure = new_figure(6.6, 2.7, caption)
        axes = figure.subplots()
        axes.set(xlim=(-3.6, 5.6), ylim=(-1.0, 2.5), aspect="equal")
        axes.set_axis_off()
        _machine(axes, z)
        # On the belt z' = -1 and y = 0: spring -z, damper -z' = 1, and friction against their sum.
        middle = 4.1
        axes.plot([middle, middle], [0.75, 2.15], color=FAINT, linewidth=0.8)
        for k, (name, size, color) in enumerate(
            (("spring", -z, BLUE), ("damper", 1.0, RED), ("friction", z - 1, TEAL))
        ):
            height, side = 1.95 - 0.5 * k, -1 if size > 0 else 1
            headed(axes, (middle, height), (middle + 1.2 * size, height), color, 2.2)
            axes.text(
                middle + 0.12 * side, height, f"{name} {size:+.3g}".replace("-", "−"), va="center",
                color=shade(color, 0.8), ha="right" if side < 0 else "left",
            )  # fmt: skip
    return figure


def _machine(axes: Axes, z: float) -> None:
    """Wall, spring, damper, block and belt, the block at its extension."""
    from matplotlib.patches import Circle, Rectangle

    wall, wide, high = -3.0, 1.3, 1.2
    line: dict[str, Any] = {"color": INK, "linewidth": 1.3}
    axes.plot([wall, wall], [0, 1.6], **line)
    for y in np.linspace(0.1, 1.6, 7):
        axes.plot([wall - 0.18, wall], [y - 0.16, y], color=FAINT, linewidth=0.8)
    turns = np.linspace(wall + 0.35, z - 0.35, 22)
    heights = 0.88 + 0.16 * np.r_[0, np.tile([1, -1], 10), 0]
    axes.plot(np.r_[wall, turns, z], np.r_[0.88, heights, 0.88], **line)
    middle = (wall + z) / 2
    axes.plot([wall, middle - 0.1], [0.36, 0.36], **line)
    cup = np.array([0.5, -0.35, -0.35, 0.5])
    axes.plot(middle + cup, [0.52, 0.52, 0.2, 0.2], **line)
    axes.plot([middle - 0.1, middle - 0.1], [0.25, 0.47], **line)
    axes.plot([middle + 0.5, z], [0.36, 0.36], **line)
    axes.add_patch(Rectangle((z, 0), wide, high, facecolor="0.9", edgecolor=INK, zorder=3))
    for y in (0, -0.8):
        axes.plot([-2.5, 4.9], [y, y], **{**line, "linewidth": 1.8})
    for x in (-2.5, 4.9):
        axes.add_patch(Circle((x, -0.4), 0.4, facecolor="white", edgecolor=INK, linewidth=1.3))
        axes.add_patch(Circle((x, -0.4), 0.06, facecolor=INK, edgecolor=INK))
    headed(axes, (1.7, -0.4), (0.7, -0.4), INK, 1.2)
    axes.text(1.85, -0.4, "belt, speed 1", va="center")
    axes.plot([0, 0], [0, 2.1], linestyle=(0, (4, 3)), color=FAINT, linewidth=1)
    headed(axes, (0, 1.8), (z, 1.8), INK, 1.0)
    axes.plot([z, z], [high, 2.1], color=FAINT, linewidth=0.8)
    axes.text(z / 2, 2.2, f"$z = {z}$", ha="center")
