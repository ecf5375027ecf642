"""Orbits across the switch: Filippov's (fil), smoothed (flows), and the whole plane (phase).

The block's extension is z and its velocity relative to the belt y, with z' = y - 1 and
y' = 1 - z - y - F(y) (eq:osc2); F is sgn(y) (eq:forcePWC, alpha = 1) or smoothed over |y| <= eps
(eq:forcePerturbed). Everything is in physical units.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.workshop.figures.style import (
    BLUE,
    FAINT,
    INK,
    RED,
    SURFACE,
    arrow,
    headed,
    layer_band,
    new_figure,
    shade,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_EPS, _MU = 0.1, 3
_CROSSED: dict[str, Any] = {"linestyle": (0, (4, 2)), "linewidth": 1.4}


def filippov(z: float, y: float, duration: float) -> list[Any]:
    """The slipping pieces of an orbit under Coulomb friction, by Filippov's convention.

    It crosses y = 0 where both fields point the same way, and slides along it at z' = -1 where they
    oppose each other, 0 < z < 2, up to z = 0.
    """
    from scipy.integrate import solve_ivp

    pieces, left = [], duration
    while left > 1e-6:
        if y == 0 and 1e-9 < z < 2:
            z, left = max(0.0, z - left), left - z
            continue
        side = np.sign(y) or (1.0 if z < 1 else -1.0)

        def landing(t: float, x: Any) -> float:
            return float(x[1])

        landing.terminal, landing.direction = True, -side  # type: ignore[attr-defined]
        found = solve_ivp(
            lambda t, x, side=side: (x[1] - 1, 1 - x[0] - x[1] - side),
            (0, left), (z, y + 1e-12 * side), events=landing, max_step=0.02, rtol=1e-8,
        )  # fmt: skip
        pieces.append(found.y.T)
        left -= found.t[-1]
        z, y = float(found.y[0, -1]), 0.0
        if found.status != 1:
            break
    return pieces


def _orbits(axes: Axes, starts: Any, duration: float, color: str = "") -> None:
    """Orbits by Filippov's convention, with an arrow on each piece, in the colour of its side."""
    for z, y in starts:
        for path in filippov(z, y, duration):
            shown = color or (BLUE if path[:, 1].sum() > 0 else RED)
            axes.plot(*path.T, color=shown, linewidth=1.1)
            arrow(axes, path, shown)


def _surface(axes: Axes) -> None:
    """The surface y = 0: solid where it slides, dashed where it is crossed."""
    low, high = axes.get_xlim()
    for a, b in ((low, min(0, high)), (max(low, 0), min(2, high)), (max(2, low), high)):
        if a < b:
            axes.plot([a, b], [0, 0], **{**SURFACE, **({} if 0 < (a + b) / 2 < 2 else _CROSSED)})
    axes.set_xlabel("$z$")
    axes.set_ylabel("$y$")


def fil() -> Figure:
    """Orbits of the ideal switch by Filippov's convention: sliding and crossing (Fig. fil)."""
    caption = (
        "The ideal switch at y = 0, here Coulomb friction of strength alpha = 1 on the oscillator. "
        "(i) Both fields point to the surface: orbits reach it and slide along it with the "
        "combination (bold) of f+ and f- that is tangent to it. (ii) Both fields point the same "
        "way: orbits cross at once, with a kink."
    )
    with style():
        figure = new_figure(7.2, 3.3, caption)
        sliding, crossing = figure.subplots(1, 2)
        for axes, middle, title in ((sliding, 1.0, "sliding"), (crossing, -0.85, "crossing")):
            number = "i" if axes is sliding else "ii"
            axes.set(xlim=(middle - 0.75, middle + 0.75), ylim=(-0.75, 0.75), yticks=[0])
            axes.set_title(f"({number})  {title}")
            _surface(axes)
        _orbits(sliding, [(z, 0.75) for z in np.linspace(0.65, 2.0, 5)], 1.5)
        _orbits(sliding, [(z, -0.75) for z in np.linspace(0.45, 1.6, 5)], 1.5)
        _orbits(crossing, [(z, -0.75) for z in np.linspace(-1.5, 0.1, 6)], 4.0)
        # f+, f- and their tangent combination at z = 1.
        tip = -0.5 / np.sqrt(2)
        tips = {1: (tip, tip), -1: (tip, -tip)}
        for side, color, name in ((1, BLUE, "$f^+$"), (-1, RED, "$f^-$")):
            x, y = tips[side]
            headed(sliding, (1, 0), (1 + x, y), shade(color, 0.75), 2.0)
            sliding.annotate(
                name, (1 + x, y), (-3, -4 * side), textcoords="offset points", ha="right",
                va="center", color=shade(color, 0.75), zorder=5,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            )  # fmt: skip
        sliding.plot([1 + tips[1][0]] * 2, [tips[1][1], tips[-1][1]], ":", color=INK, linewidth=1)
        headed(sliding, (1, 0), (1 + tips[1][0], 0), INK, 3.4)
    return figure


def phase() -> Figure:
    """The phase portrait of the oscillator with Coulomb friction (Fig. phase)."""
    from matplotlib.lines import Line2D

    caption = (
        "Phase portrait of the oscillator with Coulomb friction, alpha = 1, by Filippov's "
        "convention. On y = 0 the block sticks to the belt along the solid stretch, "
        "1 - alpha < z < 1 + alpha, rides to the left and slips into y > 0 at its end (black); on "
        "the dashed stretches orbits cross, from y < 0 (red) or from y > 0 (blue). The dot is the "
        "rest point of the slipping block."
    )
    with style():
        figure = new_figure(5.6, 4.2, caption)
        axes = figure.subplots()
        low, high = -2.6, 3.6
        axes.set(xlim=(low, high), ylim=(-2.2, 3.0))
        _surface(axes)
        starts = [(z, -2.2) for z in np.linspace(low + 0.4, high - 0.2, 6)]
        _orbits(axes, starts + [(z, 3.0) for z in np.linspace(low - 0.8, high - 2.0, 5)], 25.0)
        # The orbit that leaves the end of the sliding stretch, which all that stick share.
        _orbits(axes, [(0.0, 0.0)], 25.0, INK)
        for z in (0.44, 1.0, 1.56):
            headed(axes, (z + 0.12, 0), (z - 0.12, 0), INK, 1.8)
        axes.plot([-1], [1], "o", color=INK, markersize=5)
        axes.set_xticks([-1, 0, 2], [r"$-\alpha$", r"$1-\alpha$", r"$1+\alpha$"])
        axes.set_yticks([0, 1])
        looks = [
            ("slips, $y > 0$", {"color": BLUE, "linewidth": 1.1}),
            ("slips, $y < 0$", {"color": RED, "linewidth": 1.1}),
            ("sticks", {"color": INK, "linewidth": 2.0}),
            ("crosses", {"color": INK, **_CROSSED}),
        ]
        handles = [Line2D([], [], label=name, **look) for name, look in looks]
        figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize="small")
    return figure


def _smoothed(drift: Any, z: float, u: float, time: float) -> Any:
    """The orbit of (z, u) in the smoothed oscillator; `drift` is that at z0 = 0."""
    from scipy.integrate import solve_ivp

    def field(t: float, x: Any) -> tuple[float, float]:
        return _EPS * x[1] - 1, (drift(x[1]) - x[0]) / _EPS - x[1]

    found = solve_ivp(field, (0, time), (z, u), "LSODA", max_step=0.01, rtol=1e-8, atol=1e-10)
    return found.y.T


def flows() -> Figure:
    """Orbits through the layer of the smoothed switch, in three cases (Fig. flows)."""
    linear, cubic = (sa.friction(mu=m, alpha=1, z0=0) for m in (0, _MU))
    fold, turn = float(cubic.folds().z0[0]), float(cubic.turning_points())
    caption = (
        "The smoothed switch with a layer |u| <= 1 of half-width eps = 1/10 (grey), u = y/eps, "
        "alpha = 1. Bold: the slow manifold, attracting where solid, repelling where dashed. "
        "(i) Sliding region: orbits settle on the attracting one. (ii.a) Crossing region, linear "
        "smoothing: nothing stops them. (ii.b) The same region with mu = 3: orbits from below stay "
        f"in the layer until the manifold ends at the fold, z = {fold:.3g}".replace("-", "−")
        + " (the dot is that of the curve of zero drift); those that begin on the repelling branch "
        "leave it either way."
    )
    with style():
        figure = new_figure(9.6, 3.4, caption)
        panels = figure.subplots(1, 3, sharey=True)
        for axes, drift, low, high, title in (
            (panels[0], linear, 0.25, 1.75, "(i)  sliding"),
            (panels[1], linear, -1.2, 0.0, r"(ii.a)  crossing, $\mu = 0$"),
            (panels[2], cubic, -1.2, 0.0, r"(ii.b)  crossing, $\mu = 3$"),
        ):
            axes.set(xlim=(low, high), ylim=(-3, 3), title=title, xlabel="$z$")
            layer_band(axes, horizontal=True)
            for edge in (-1, 1):
                axes.axhline(edge, color=FAINT, linewidth=0.6)
            span = high - low
            starts = [(z, -3.0) for z in np.linspace(low + 0.1 * span, high + 0.25 * span, 7)]
            if high > 1:
                starts += [(z, 3.0) for z in np.linspace(low + 0.25 * span, high + 0.3 * span, 6)]
            # On its zeros the drift is z; orbits forget where they began along the manifold.
            inner = turn if drift is cubic else 1.0
            rise = np.linspace(-inner, inner, 401)
            begin = min(high + 0.4 * span, 1.99)
            if drift is cubic or high > 1:
                at = float(np.interp(-begin, -drift(rise), rise))
                path = _smoothed(drift, begin, at, 1.5 * span + 1)
                seen = (path[:, 0] <= high) & (path[:, 0] >= (fold if drift is cubic else low))
                axes.plot(*path[seen].T, **{**SURFACE, "linewidth": 2.2})
            if drift is cubic:
                outer = np.linspace(turn, 1.0, 401)
                at = float(np.interp(fold + 1e-3, drift(outer), outer))
                path = _smoothed_back(drift, fold + 1e-3, at, high - fold)
                look = {**SURFACE, "linewidth": 2.2, "linestyle": (0, (3, 1.5))}
                axes.plot(*path.T, **look)
                for k, share in enumerate((0.15, 0.35, 0.55, 0.75)):
                    z, u = path[int(share * (len(path) - 1))]
                    starts.append((z, u + (1e-3 if k % 2 else -1e-3)))
            for z, u in starts:
                path = _smoothed(drift, z, u, 1.5 * span)
                out = np.flatnonzero((path[1:, 0] < low) | (np.abs(path[1:, 1]) > 3 + 1e-9))
                path = path[: out[0] + 2] if out.size else path
                color = BLUE if u > 0 else RED
                axes.plot(*path.T, color=color, linewidth=1.0)
                arrow(axes, path, color, 0.75 if abs(u) < 1.5 else 0.18)
        panels[0].set_ylabel(r"$u = y/\varepsilon$")
        panels[0].set_yticks([-3, -1, 0, 1, 3])
        for axes in panels[1:]:
            axes.set_xticks([-1, -0.6, -0.2])
        panels[2].plot([fold], [turn], "o", color=INK, markersize=4)
        panels[2].plot([fold, fold], [-3, turn], ":", color=FAINT, linewidth=1)
        panels[2].annotate("$z_0^{(+)}$", (fold, -3), (3, 4), textcoords="offset points")
    return figure


def _smoothed_back(drift: Any, z: float, u: float, span: float) -> Any:
    """The repelling branch, which attracts backwards, as far as the window."""
    from scipy.integrate import solve_ivp

    def field(t: float, x: Any) -> tuple[float, float]:
        return 1 - _EPS * x[1], x[1] - (drift(x[1]) - x[0]) / _EPS

    path = solve_ivp(field, (0, 1.2 * span), (z, u), "LSODA", max_step=0.01, rtol=1e-8).y.T
    return path[(path[:, 0] <= z + span) & (path[:, 1] <= 1)]
