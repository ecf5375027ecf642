"""The oscillator (frictionOsc), its force (fricforce), potentials (potentialSketch), orbits.

The block's extension is z and its velocity relative to the belt y, with z' = y - 1 and
y' = 1 - z - y - F(y) (eq:osc2), in physical units. F is sgn(y) (eq:forcePWC, alpha = 1; fil and
phase) or smoothed over |y| <= eps (eq:forcePerturbed; flows).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Rectangle
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import symasym as sa
from symasym.workshop import style
from symasym.workshop.style import BLUE, FAINT, INK, OCHRE, RED, TEAL, along, straight

_EPS = 0.1
_SURFACE: dict[str, Any] = {"linewidth": 2.0, "zorder": 3, "color": INK}
_CROSSED: dict[str, Any] = {**_SURFACE, "linestyle": (0, (4, 2)), "linewidth": 1.4}
_BOLD: dict[str, Any] = {**_SURFACE, "linewidth": 2.2}
#: The layer |u| <= 1.
_BAND: dict[str, Any] = {"color": "0.93", "linewidth": 0, "zorder": 0}


@style.figure("frictionOsc", 5.6, 2.4)
def friction_osc(figure: Figure) -> None:
    """The oscillator with a block that sticks, and the forces on it (Fig. frictionOsc).

    A block on a belt that runs to the left at unit speed, with a linear spring and damper; the
    spring is extended by z = 0.4 from its rest length (dashed). The block sticks, and the arrows
    show the forces on it to one scale: they add up to zero as long as friction can supply 0.6, of
    at most beta = 1.78.
    """
    z, wall, high, middle = 0.4, -3.0, 1.2, -1.3
    axes = figure.subplots()
    axes.set(xlim=(-3.6, 5.6), ylim=(-1.0, 2.5), aspect="equal")
    axes.set_axis_off()
    dark = partial(axes.plot, color=INK, linewidth=1.3)
    faint = partial(axes.plot, color=FAINT, linewidth=0.8)
    dark([wall, wall], [0, 1.6])
    for y in np.linspace(0.1, 1.6, 7):
        faint([wall - 0.18, wall], [y - 0.16, y])
    spring = np.r_[wall, np.linspace(wall + 0.35, z - 0.35, 22), z]
    dark(spring, 0.88 + 0.16 * np.r_[0, 0, np.tile([1, -1], 10), 0, 0])
    # The damper: a rod from the wall with a piston, in a cup on a rod to the block.
    dark([wall, middle - 0.1, middle - 0.1, middle - 0.1], [0.36, 0.36, 0.25, 0.47])
    dark([middle + 0.5, middle - 0.35, middle - 0.35, middle + 0.5], [0.52, 0.52, 0.2, 0.2])
    dark([middle + 0.5, z], [0.36, 0.36])
    axes.add_patch(Rectangle((z, 0), 1.3, high, facecolor="0.9", edgecolor=INK, zorder=3))
    for y in (0, -0.8):
        dark([-2.5, 4.9], [y, y], linewidth=1.8)
    for x in (-2.5, 4.9):
        axes.add_patch(Circle((x, -0.4), 0.4, facecolor="white", edgecolor=INK, linewidth=1.3))
        axes.add_patch(Circle((x, -0.4), 0.06, facecolor=INK, edgecolor=INK))
    straight(axes, (1.7, -0.4), (0.7, -0.4), INK, 1.2)
    axes.text(1.85, -0.4, "belt, speed 1", va="center")
    faint([0, 0], [0, 2.1], linestyle=(0, (4, 3)), linewidth=1)
    straight(axes, (0, 1.8), (z, 1.8), INK, 1.0)
    faint([z, z], [high, 2.1])
    axes.text(z / 2, 2.2, f"$z = {z}$", ha="center")
    # On the belt z' = -1 and y = 0: spring -z, damper -z' = 1, friction opposes their sum.
    faint([4.1, 4.1], [0.75, 2.15])
    forces = (("spring", -z, BLUE), ("damper", 1.0, RED), ("friction", z - 1, TEAL))
    for height, (name, size, color) in zip((1.95, 1.45, 0.95), forces, strict=True):
        side, align = (-0.12, "right") if size > 0 else (0.12, "left")
        straight(axes, (4.1, height), (4.1 + 1.2 * size, height), color, 2.2)
        text = axes.text(4.1 + side, height, f"{name} {size:+.3g}".replace("-", "−"))
        text.set(color=style.shade(color, 0.8), va="center", ha=align)


def _turn_and_force() -> tuple[float, float]:
    """The turning point and the breakaway force at mu = 3, alpha = 1 (turning-points, beta)."""
    turn, beta = (sa.formula(label).lambdify("numpy") for label in ("turning-points", "beta"))
    return turn(3.0), beta(3.0, 1.0)


@style.figure("fricforce", 5.6, 3.6)
def fricforce(figure: Figure) -> None:
    """The smoothed friction force against the velocity, y/eps (Fig. fricforce).

    The friction force smoothed over |y| <= eps, alpha = 1, for mu = 0, 1/2, 3. Above mu = 1/2 it
    turns twice inside the layer, at -y_s and y_s, and its largest value beta, the breakaway force,
    is more than the alpha of a block in motion.
    """
    u = np.union1d(np.linspace(-2.1, 2.1, 421), [-1.0, 1.0])
    axes = figure.subplots()
    axes.set(xlim=(-2.1, 2.1), xlabel=r"$y/\varepsilon$", ylabel=r"$\mathcal{F}(y)$")
    axes.axvspan(-1, 1, **_BAND)
    axes.axhline(0, color=FAINT, linewidth=0.6)
    for mu, color in (("0", FAINT), ("1/2", BLUE), ("3", OCHRE)):
        # At z0 = 1 the spring balances the belt's drag, and the drift is the friction alone.
        axes.plot(u, -sa.friction(mu, 1, 1)(u), color=color, label=rf"$\mu = {mu}$")
    turn, beta = _turn_and_force()
    axes.plot([-turn, turn], [-beta, beta], "o", color=INK, markersize=4, zorder=4)
    for side, name, up in ((1, r"$y_s/\varepsilon$", -11), (-1, r"$-y_s/\varepsilon$", 4)):
        x, y = side * turn, side * beta
        axes.plot([x, x, np.nan, -2.1, x], [0, y, 0, y, y], ":", color=FAINT, lw=1, zorder=1)
        axes.annotate(name, (x, 0), (0, up), textcoords="offset points", ha="center")
    names = [r"$-\beta$", r"$-\alpha$", "0", r"$\alpha$", r"$\beta$"]
    axes.set_yticks([-beta, -1, 0, 1, beta], names)
    axes.legend(loc="lower right")


@style.figure("potentialSketch", 7.0, 2.6)
def potential_sketch(figure: Figure) -> None:
    """The potential in the three cases of flows (Fig. potentialSketch).

    The potential of the scaled drift, alpha = 1, the layer in grey; wells are full dots, barriers
    open ones. (i) Sliding, mu = 0, z0 = 1: one well that nothing leaves. (ii) Crossing, mu = 0,
    z0 = -0.39: no well. (iii) The same with mu = 3: a well in the layer behind a barrier, which
    noise alone can cross.
    """
    u = np.union1d(np.linspace(-2.5, 2.5, 501), [-1.0, 1.0])
    names = "(i)  global well", "(ii)  no well", "(iii)  local well"
    cases = zip(figure.subplots(1, 3), names, (0, 0, 3), ("1", "-0.39", "-0.39"), strict=True)
    for axes, title, mu, z0 in cases:
        drift = sa.friction(mu, 1, z0)
        height = drift.potential_at(u)
        axes.axvspan(-1, 1, **_BAND)
        axes.plot(u, height, color=BLUE)
        axes.set(title=title, xlabel="$u$", xlim=(-2.5, 2.5), xticks=[-2, -1, 0, 1, 2])
        # Space for the well's name below it.
        axes.set_ylim(bottom=height.min() - 0.14 * np.ptp(height))
        for number, point in enumerate(drift.critical_points(), 1):
            at = float(point.u), float(drift.potential_at(float(point.u)))
            fill, way, side = (INK, -7, "top") if point.kind == "well" else ("w", 7, "bottom")
            axes.plot(*at, "o", zorder=4, markersize=5.5, color=INK, markerfacecolor=fill)
            axes.annotate(
                f"$u_{number}$", at, (0, way), textcoords="offset points", ha="center", va=side
            )
    figure.axes[0].set_ylabel("$V(u)$")


def _landing(t: float, x: Any) -> float:
    return float(x[1])


_landing.terminal = True  # type: ignore[attr-defined]


def filippov(z: float, y: float, duration: float) -> Iterator[Any]:
    """The slipping pieces of an orbit under Coulomb friction, by Filippov's convention.

    It crosses y = 0 where both fields point the same way, and slides along it at z' = -1 where they
    oppose each other, 0 < z < 2, up to z = 0.
    """
    landed = True
    while landed and duration > 1e-6:
        if y == 0 and 1e-9 < z < 2:
            z, duration = max(0.0, z - duration), duration - z
            continue
        side = np.sign(y) or (1.0 if z < 1 else -1.0)
        found = solve_ivp(
            lambda t, x, side=side: (x[1] - 1, 1 - x[0] - x[1] - side), (0, duration),
            (z, y + 1e-12 * side), events=_landing, max_step=0.02, rtol=1e-8,
        )  # fmt: skip
        yield found.y.T
        z, y, duration, landed = found.y[0, -1], 0.0, duration - found.t[-1], found.status == 1


def _orbits(axes: Axes, starts: Any, duration: float, color: str = "") -> None:
    """Draw orbits by Filippov's convention, with an arrow on each piece and one colour a side."""
    for z, y in starts:
        for path in filippov(z, y, duration):
            along(axes, path, color or (BLUE if path[:, 1].sum() > 0 else RED), width=1.1)


def _surface(axes: Axes) -> None:
    """Draw the surface y = 0, solid where orbits slide and dashed where they cross it."""
    axes.plot([0, 2], [0, 0], **_SURFACE)
    axes.plot([-4, 0, np.nan, 2, 4], np.zeros(5), **_CROSSED)
    axes.set(xlabel="$z$", ylabel="$y$")


@style.figure("fil", 7.2, 3.3)
def fil(figure: Figure) -> None:
    """Orbits of the ideal switch by Filippov's convention: sliding and crossing (Fig. fil).

    The ideal switch at y = 0, here Coulomb friction of strength alpha = 1 on the oscillator. (i)
    Both fields point to the surface: orbits reach it and slide along it with the combination (bold)
    of f+ and f- that is tangent to it. (ii) Both fields point the same way: orbits cross at once,
    with a kink.
    """
    sliding, crossing = figure.subplots(1, 2)
    for axes, middle, title in (sliding, 1.0, "(i)  sliding"), (crossing, -0.85, "(ii)  crossing"):
        axes.set(xlim=(middle - 0.75, middle + 0.75), ylim=(-0.75, 0.75), yticks=[0], title=title)
        _surface(axes)
    _orbits(sliding, [(z, 0.75) for z in np.linspace(0.65, 2.0, 5)], 1.5)
    _orbits(sliding, [(z, -0.75) for z in np.linspace(0.45, 1.6, 5)], 1.5)
    _orbits(crossing, [(z, -0.75) for z in np.linspace(-1.5, 0.1, 6)], 4.0)
    # f+, f- and their tangent combination at z = 1.
    long = 0.5 / np.sqrt(2)
    for side, color, name in ((1, BLUE, "$f^+$"), (-1, RED, "$f^-$")):
        tip, dark = (1 - long, -side * long), style.shade(color, 0.75)
        straight(sliding, (1, 0), tip, dark, 2.0)
        sliding.annotate(
            name, tip, (-3, -4 * side), textcoords="offset points", ha="right", va="center",
            color=dark, zorder=5, bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
        )  # fmt: skip
    sliding.plot([1 - long, 1 - long], [-long, long], ":", color=INK, linewidth=1)
    straight(sliding, (1, 0), (1 - long, 0), INK, 3.4)


@style.figure("phase", 5.6, 4.2)
def phase(figure: Figure) -> None:
    """The phase portrait of the oscillator with Coulomb friction (Fig. phase).

    Phase portrait of the oscillator with Coulomb friction, alpha = 1, by Filippov's convention. On
    y = 0 the block sticks to the belt along the solid stretch, 1 - alpha < z < 1 + alpha, rides to
    the left and slips into y > 0 at its end (black); on the dashed stretches orbits cross, from
    y < 0 (red) or from y > 0 (blue). The dot is the rest point of the slipping block.
    """
    axes = figure.subplots()
    axes.set(xlim=(-2.6, 3.6), ylim=(-2.2, 3.0))
    _surface(axes)
    _orbits(axes, [(z, -2.2) for z in np.linspace(-2.2, 3.4, 6)], 25.0)
    _orbits(axes, [(z, 3.0) for z in np.linspace(-3.4, 1.6, 5)], 25.0)
    # The orbit from the end of the sliding region, which all sticking orbits share.
    _orbits(axes, [(0.0, 0.0)], 25.0, INK)
    for z in (0.44, 1.0, 1.56):
        straight(axes, (z + 0.12, 0), (z - 0.12, 0), INK, 1.8)
    axes.plot([-1], [1], "o", color=INK, markersize=5)
    axes.set_xticks([-1, 0, 2], [r"$-\alpha$", r"$1-\alpha$", r"$1+\alpha$"])
    axes.set_yticks([0, 1])
    slips = ((f"slips, $y {sign} 0$", {"color": c}) for sign, c in ((">", BLUE), ("<", RED)))
    looks = [*slips, ("sticks", _SURFACE), ("crosses", _CROSSED)]
    handles = [Line2D([], [], label=name, **{"linewidth": 1.1, **look}) for name, look in looks]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize="small")


def _smoothed(drift: Any, z: float, u: float, time: float, way: int = 1) -> Any:
    """The orbit of (z, u) in the smoothed oscillator, or backwards; `drift` is that at z0 = 0."""

    def field(t: float, x: Any) -> tuple[float, float]:
        return way * (_EPS * x[1] - 1), way * ((drift(x[1]) - x[0]) / _EPS - x[1])

    return solve_ivp(field, (0, time), (z, u), "LSODA", max_step=0.01, rtol=1e-8, atol=1e-10).y.T


@style.figure("flows", 7.6, 3.2)
def flows(figure: Figure) -> None:
    """Orbits through the layer of the smoothed switch, in three cases (Fig. flows).

    The smoothed switch with a layer |u| <= 1 of half-width eps = 1/10 (grey), u = y/eps, alpha = 1.
    Bold: the slow manifold, attracting where solid, repelling where dashed. (i) Sliding region:
    orbits settle on the attracting one. (ii.a) Crossing region, linear smoothing: nothing stops
    them. (ii.b) The same region with mu = 3: orbits from below stay in the layer until the manifold
    ends at the fold, z = −0.778 (the dot is that of the curve of zero drift); those that begin on
    the repelling branch leave it either way.
    """
    linear, cubic = (sa.friction(m, 1, 0) for m in (0, 3))
    turn, beta = _turn_and_force()
    fold = 1 - beta
    # On its zeros the drift is z. Orbits forget where they began along the manifold: along the
    # repelling branch, which attracts backwards, when they are followed back.
    begin, back = (
        brentq(lambda u, z=z: cubic(u) - z, a, b)
        for z, a, b in ((0.48, -turn, turn), (fold + 1e-3, turn, 1))
    )
    repelling = _smoothed(cubic, fold + 1e-3, back, -1.2 * fold, way=-1)
    repelling = repelling[(repelling <= (0, 1)).all(axis=1)]
    begins = repelling[[int(share * (len(repelling) - 1)) for share in (0.15, 0.35, 0.55, 0.75)]]
    panels = figure.subplots(1, 3, sharey=True)
    for axes, drift, low, high, title in (
        (panels[0], linear, 0.25, 1.75, "(i)  sliding"),
        (panels[1], linear, -1.2, 0.0, r"(ii.a)  crossing, $\mu = 0$"),
        (panels[2], cubic, -1.2, 0.0, r"(ii.b)  crossing, $\mu = 3$"),
    ):
        axes.set(xlim=(low, high), ylim=(-3, 3), title=title, xlabel="$z$")
        axes.axhspan(-1, 1, **_BAND)
        for edge in (-1, 1):
            axes.axhline(edge, color=FAINT, linewidth=0.6)
        span = high - low
        starts = [(z, -3.0) for z in np.linspace(low + 0.1 * span, high + 0.25 * span, 7)]
        if high > 1:
            starts += [(z, 3.0) for z in np.linspace(low + 0.25 * span, high + 0.3 * span, 6)]
        if drift is cubic:
            starts += [(z, u + way) for (z, u), way in zip(begins, [-2e-2, 2e-2] * 2, strict=True)]
        for z, u in starts:
            path = _smoothed(drift, z, u, 1.5 * span)
            out = np.flatnonzero((path[1:, 0] < low) | (np.abs(path[1:, 1]) > 3 + 1e-9))
            path = path[: out[0] + 2] if out.size else path
            along(axes, path, BLUE if u > 0 else RED, 0.75 if abs(u) < 1.5 else 0.18)
        if drift is cubic or high > 1:
            first = (0.48, begin, 2.8) if drift is cubic else (1.99, -0.99, 3.25)
            path, end = _smoothed(drift, *first), fold if drift is cubic else low
            axes.plot(*path[(path[:, 0] >= end) & (path[:, 0] <= high)].T, **_BOLD)
        axes.set_yticks([-3, -1, 0, 1, 3])
        if high < 1:
            axes.set_xticks([-1, -0.6, -0.2])
    panels[0].set_ylabel(r"$u = y/\varepsilon$")
    axes.plot(*repelling.T, **_BOLD, linestyle=(0, (3, 1.5)))
    axes.plot([fold], [turn], "o", color=INK, markersize=4)
    axes.plot([fold, fold], [-3, turn], ":", color=FAINT, linewidth=1)
    axes.annotate("$z_0^{(+)}$", (fold, -3), (3, 4), textcoords="offset points")
