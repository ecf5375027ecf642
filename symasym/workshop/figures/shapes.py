"""The potential (potentialSketch), the friction force (fricforce), the oscillator (frictionOsc)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import Number, Numbers, exact, float_text
from symasym.workshop.figures.flows import require_overshoot
from symasym.workshop.figures.style import (
    FAINT,
    INK,
    colors,
    dark,
    layer_band,
    new_figure,
    number_text,
    reads_numbers,
    several,
    shape_colors,
    signed,
    style,
    vector,
)

if TYPE_CHECKING:
    from fractions import Fraction

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from symasym.drift.ready_made.friction import Friction

_FORCES = ("spring", "damper", "friction")


@reads_numbers
def potential_sketch(
    mu: Number = 3, alpha: Number = 1, sliding: Number = 1, crossing: Number | None = None
) -> Figure:
    """The potential in the three cases of flows (Fig. potentialSketch).

    Parameters
    ----------
    mu : number
        Shape of the friction force in panel (iii), greater than 1/2; the other
        panels have mu = 0.
    alpha : number
        Friction strength, greater than 0.
    sliding : number
        Spring extension of panel (i), in the sliding region.
    crossing : number, optional
        Spring extension of panels (ii) and (iii), in the crossing region; if
        left out, halfway between the fold and the region's edge.

    Returns
    -------
    matplotlib.figure.Figure
        V(u) of eq:V, the well u1 as a full dot and the barrier u2 as an open one.

    Examples
    --------
    >>> from symasym.workshop.figures import potential_sketch
    >>> potential_sketch(mu=2).axes[2].get_title(loc="left")
    '(iii)  local well'
    """
    shape = exact("mu", mu)
    family = sa.friction(mu=shape, alpha=alpha)
    require_overshoot(shape)
    z0 = exact("sliding", sliding)
    if crossing is None:
        past = _between(float(family.folds().z0[0]), 1 - float(exact("alpha", alpha)))
    else:
        past = exact("crossing", crossing)
    linear = sa.friction(mu=0, alpha=alpha)
    drifts = [linear.bind(z0=z0), linear.bind(z0=past), family.bind(z0=past)]
    for drift, wanted in zip(drifts, ("sliding", "crossing", "crossing"), strict=True):
        if drift.region != wanted:
            raise InputError(
                f"{wanted} is {float_text(drift.scalars()['z0'])}, where the drift is "
                f"{drift.region}; give a spring extension in the {wanted} region."
            )
    caption = (
        f"The potential of the scaled drift, alpha = {number_text(exact('alpha', alpha))}, the "
        "layer in grey; wells are full dots, barriers open ones. "
        f"(i) Sliding, mu = 0, z0 = {number_text(z0)}: one well that nothing leaves. "
        f"(ii) Crossing, mu = 0, z0 = {number_text(past)}: no well. (iii) The same with "
        f"mu = {number_text(shape)}: {_count(drifts[2])}, which noise alone can cross."
    )
    titles = (
        "(i)  global well",
        "(ii)  no well",
        "(iii)  local well" if drifts[2].wells() else "(iii)  no well",
    )
    with style():
        figure = new_figure(9.6, 3.0, caption)
        panels = figure.subplots(1, 3)
        for axes, drift, title in zip(panels, drifts, titles, strict=True):
            _potential(axes, drift)
            axes.set_title(title)
        panels[0].set_ylabel("$V(u)$")
        return figure


def _between(low: float, high: float) -> Fraction:
    """About halfway, with as few digits as will do, so that the caption can name it."""
    middle, room = (low + high) / 2, (high - low) / 8
    texts = [f"{middle:.{digits}g}" for digits in range(2, 18)]
    near = (text for text in texts if abs(float(text) - middle) < room)
    return exact("crossing", next(near, repr(middle)))


def _count(drift: Friction) -> str:
    """A clause of the caption on the wells of a drift."""
    if drift.wells() and drift.barriers():
        return "a well in the layer behind a barrier"
    return "no well either at this extension"


def _potential(axes: Axes, drift: Friction) -> None:
    """Draw V with its critical points."""
    u = np.union1d(np.linspace(-2.5, 2.5, 501), [-1.0, 1.0])
    axes.set(xlim=(-2.5, 2.5), xlabel="$u$")
    axes.set_xticks([-2, -1, 0, 1, 2])
    layer_band(axes, horizontal=False)
    height = drift.potential_at(u)
    axes.plot(u, height, color=colors()[0], gid="potential")
    # Room for the well's name below it.
    axes.set_ylim(bottom=height.min() - 0.14 * np.ptp(height))
    for number, point in enumerate(drift.critical_points(), 1):
        filled = {"well": INK, "barrier": "white"}.get(point.kind, FAINT)
        at = float(point.u)
        below = point.kind == "well"
        axes.annotate(
            f"$u_{number}$",
            xy=(at, float(drift.potential_at(at))),
            xytext=(0, -7 if below else 7),
            textcoords="offset points",
            ha="center",
            va="top" if below else "bottom",
        )
        axes.plot(
            [at],
            [drift.potential_at(at)],
            "o",
            markersize=5.5,
            color=INK,
            markerfacecolor=filled,
            gid=point.kind,
            zorder=4,
        )


@reads_numbers
def fricforce(mu: Numbers = ("0", "1/2", "3"), alpha: Number = 1) -> Figure:
    """The smoothed friction force against the velocity, y/eps (Fig. fricforce).

    Parameters
    ----------
    mu : number or sequence of up to four numbers
        Shapes, a curve each.
    alpha : number
        Friction strength, greater than 0.

    Returns
    -------
    matplotlib.figure.Figure
        Where mu > 1/2, the turning points are marked, and beta and y_s written.

    Examples
    --------
    >>> from symasym.workshop.figures import fricforce
    >>> len(fricforce(mu=2).axes[0].get_lines()) > 1
    True
    """
    shapes = [exact("mu", value) for value in several("mu", mu)]
    # At z0 = 1 the spring balances the belt's drag, and the drift is the friction alone.
    drifts = [sa.friction(mu=shape, alpha=alpha, z0=1) for shape in shapes]
    a = float(drifts[0].scalars()["alpha"])
    peaked = [drift for drift, shape in zip(drifts, shapes, strict=True) if shape > 0.5]
    caption = (
        f"The friction force smoothed over |y| <= eps, alpha = "
        f"{number_text(exact('alpha', alpha))}, for mu = "
        f"{', '.join(number_text(shape) for shape in shapes)}. "
    ) + (
        "Above mu = 1/2 it turns twice inside the layer, at y_s on either side, and its largest "
        "value beta, the breakaway force, is more than the alpha of a block in motion."
        if peaked
        else "None of them turns inside the layer, so that alpha is also the largest force."
    )
    with style():
        figure = new_figure(5.6, 3.6, caption)
        axes = figure.subplots()
        axes.set(xlim=(-2.1, 2.1), xlabel=r"$y/\varepsilon$", ylabel=r"$\mathcal{F}(y)$")
        layer_band(axes, horizontal=False)
        axes.axhline(0, color=FAINT, linewidth=0.6)
        u = np.union1d(np.linspace(-2.1, 2.1, 421), [-1.0, 1.0])
        for color, drift, shape in zip(shape_colors(shapes), drifts, shapes, strict=True):
            label = rf"$\mu = {number_text(shape)}$"
            name = str(shape).replace("/", "-over-")
            axes.plot(u, -drift(u), color=color, label=label, gid=f"force-mu-{name}")
        ticks = {-a: r"$-\alpha$", 0.0: "0", a: r"$\alpha$"}
        for drift in peaked:
            turn, beta = drift.turning_points(), drift.beta()
            ends = [-turn, turn], [-beta, beta]
            axes.plot(*ends, "o", color=INK, markersize=4, gid="turning", zorder=4)
        if peaked:
            highest = max(peaked, key=lambda drift: float(drift.beta()))
            turn, beta = highest.turning_points(), highest.beta()
            axes.plot([-2.1, turn], [beta, beta], ":", color=FAINT, linewidth=1, zorder=1)
            axes.plot([turn, turn], [0, beta], ":", color=FAINT, linewidth=1, zorder=1)
            axes.annotate(
                r"$y_s/\varepsilon$",
                xy=(turn, 0),
                xytext=(0, -11),
                textcoords="offset points",
                ha="center",
            )
            # Where alpha and beta would be written over each other, beta goes without.
            if beta > 1.12 * a:
                ticks |= {beta: r"$\beta$", -beta: r"$-\beta$"}
        axes.set_yticks(list(ticks), list(ticks.values()))
        axes.legend(loc="lower right")
        return figure


@reads_numbers
def friction_osc(z: Number = "2/5", mu: Number = 3, alpha: Number = 1) -> Figure:
    """The oscillator with a block that sticks, and the forces on it (Fig. frictionOsc).

    Parameters
    ----------
    z : number
        Spring extension, at which the block must be able to stick: ``|1 - z|`` is
        at most the breakaway force.
    mu : number
        Shape of the friction force, at least 0.
    alpha : number
        Friction strength, greater than 0.

    Returns
    -------
    matplotlib.figure.Figure
        The arrows of spring, damper and friction are to one scale and add up to 0.

    Examples
    --------
    >>> from symasym.workshop.figures import friction_osc
    >>> friction_osc(z="-0.4").get_label()[:10]
    'A block on'
    """
    extension = exact("z", z)
    drift = sa.friction(mu=mu, alpha=alpha, z0=extension)
    x, beta = float(extension), float(drift.beta())
    if abs(1 - x) > beta:
        raise InputError(
            f"z is {float_text(extension)}, where the block slips; give {1 - beta:.4g} to "
            f"{1 + beta:.4g}, where friction can hold it."
        )
    # On the belt z' = -1 and y = 0: spring -z, damper -z' = 1, and friction against their sum.
    forces = dict(zip(_FORCES, (-x, 1.0, x - 1.0), strict=True))
    caption = (
        "A block on a belt that runs to the left at unit speed, with a linear spring and damper; "
        f"the spring is extended by z = {number_text(extension)} from its rest length (dashed). "
        "The block sticks, and the arrows show the forces on it to one scale: they add up to "
        f"zero as long as friction can supply {abs(1 - x):.3g}, of at most beta = {beta:.3g}."
    )
    with style():
        figure = new_figure(6.6, 2.7, caption)
        axes = figure.subplots()
        axes.set(xlim=(-3.6, 5.6), ylim=(-1.0, 2.5), aspect="equal")
        axes.set_axis_off()
        # A picture has room for so long a way; the forces are to a scale of their own.
        _machine(axes, x * min(1.0, 1.2 / max(abs(x), 1e-9)), number_text(extension))
        _forces(axes, forces)
        return figure


#: Where the block's left side is at rest, its width and height, and the wall.
_REST, _WIDE, _HIGH, _WALL = 0.0, 1.3, 1.2, -3.0


def _machine(axes: Axes, z: float, named: str) -> None:
    """Wall, spring, damper, block and belt, the block at its extension."""
    from matplotlib.patches import Circle, Rectangle

    left = _REST + z
    line: dict[str, Any] = {"color": INK, "linewidth": 1.3}
    axes.plot([_WALL, _WALL], [0, 1.6], **line)
    for y in np.linspace(0.1, 1.6, 7):
        axes.plot([_WALL - 0.18, _WALL], [y - 0.16, y], color=FAINT, linewidth=0.8)
    # Ten turns between two straight ends, whatever the length.
    ends = np.array([_WALL, _WALL + 0.35, left - 0.35, left])
    turns = np.linspace(ends[1], ends[2], 22)
    heights = 0.88 + 0.16 * np.r_[0, np.tile([1, -1], 10), 0]
    spring = np.r_[ends[0], turns, ends[3]]
    axes.plot(spring, np.r_[0.88, heights, 0.88], gid="spring-coil", **line)
    middle = (_WALL + left) / 2
    axes.plot([_WALL, middle - 0.1], [0.36, 0.36], **line)
    axes.plot([middle + 0.5, middle - 0.35, middle - 0.35, middle + 0.5], _CUP, **line)
    axes.plot([middle - 0.1, middle - 0.1], [0.25, 0.47], **line)
    axes.plot([middle + 0.5, left], [0.36, 0.36], **line)
    axes.add_patch(
        Rectangle((left, 0.0), _WIDE, _HIGH, facecolor="0.9", edgecolor=INK, gid="block", zorder=3)
    )
    axes.plot([-2.5, 4.9], [0, 0], gid="belt", **{**line, "linewidth": 1.8})
    axes.plot([-2.5, 4.9], [-0.8, -0.8], **{**line, "linewidth": 1.8})
    for centre in (-2.5, 4.9):
        axes.add_patch(Circle((centre, -0.4), 0.4, facecolor="white", edgecolor=INK, linewidth=1.3))
        axes.add_patch(Circle((centre, -0.4), 0.06, facecolor=INK, edgecolor=INK))
    vector(axes, (1.7, -0.4), (-1.0, 0.0), INK, 1.2, "belt-speed")
    axes.text(1.85, -0.4, "belt, speed 1", va="center")
    axes.plot([_REST, _REST], [0, 2.1], linestyle=(0, (4, 3)), color=FAINT, linewidth=1)
    if z:
        vector(axes, (_REST, 1.8), (z, 0.0), INK, 1.0, "extension")
        axes.plot([left, left], [_HIGH, 2.1], color=FAINT, linewidth=0.8)
    axes.text(_REST + z / 2, 2.2, f"$z = {named}$", ha="center")


_CUP = [0.52, 0.52, 0.2, 0.2]


def _forces(axes: Axes, forces: dict[str, float]) -> None:
    """The forces side by side from one line, each named on the side it does not point to."""
    unit = 1.2 / max(abs(size) for size in forces.values())
    middle = 4.1
    axes.plot([middle, middle], [0.75, 2.15], color=FAINT, linewidth=0.8)
    for k, (name, size) in enumerate(forces.items()):
        color, height = colors()[k], 1.95 - 0.5 * k
        if abs(size) > 1e-12:
            vector(axes, (middle, height), (unit * size, 0.0), color, 2.2, name)
        side = -1 if size > 0 else 1
        axes.text(
            middle + 0.12 * side,
            height,
            signed(f"{name} {size:+.3g}"),
            color=dark(color, 0.8),
            ha="right" if side < 0 else "left",
            va="center",
        )
