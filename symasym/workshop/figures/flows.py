"""Orbits across the switch: Filippov's (fil), smoothed (flows), and the whole plane (phase).

The block's extension is z and its velocity relative to the belt y, with z' = y - 1 and
y' = 1 - z - y - F(y) (eq:osc2); F is alpha sgn(y) (eq:forcePWC) or smoothed over |y| <= eps
(eq:forcePerturbed). Orbits of Filippov's system are in closed form. Everything is in float64 and
physical units.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, exact, float_text, positive
from symasym.drift.drift import Drift
from symasym.workshop.figures.style import (
    FAINT,
    INK,
    arrow,
    colors,
    dark,
    layer_band,
    new_figure,
    number_text,
    reads_numbers,
    signed,
    style,
    vector,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from symasym.drift.ready_made.friction import Friction


_OMEGA = np.sqrt(0.75)
# Between two samples the velocity turns by less than a percent of a period.
_SAMPLE = 0.01


@dataclass(frozen=True)
class Piece:
    """A stretch of an orbit of Filippov's system.

    Attributes
    ----------
    kind : str
        ``"slip"`` off the surface y = 0, ``"stick"`` (sliding) on it.
    path : ndarray, shape (n, 2)
        Points (z, y).
    """

    kind: str
    path: FloatArray


def slip(side: int, z: float, y: float, alpha: float, time: FloatArray) -> FloatArray:
    """Points (z, y) after each of these times where F stays alpha (side 1) or -alpha (-1).

    The damped oscillation about the rest point (-side alpha, 1), in closed form.
    """
    x, v = z + side * alpha, y - 1.0
    decay = np.exp(-time / 2)
    cosine, sine = np.cos(_OMEGA * time), np.sin(_OMEGA * time)
    position = decay * (x * cosine + (v + x / 2) / _OMEGA * sine)
    speed = decay * (v * cosine - (x + v / 2) / _OMEGA * sine)
    return np.column_stack([position - side * alpha, speed + 1.0])


def filippov(z: float, y: float, alpha: float, duration: float) -> list[Piece]:
    """The orbit of (z, y) under Coulomb friction by Filippov's convention.

    It crosses the surface y = 0 where both fields point the same way, and
    slides along it at z' = -1 where they oppose each other, up to 1 - alpha.
    """
    pieces: list[Piece] = []
    left = duration
    while left > 1e-9:
        below, above = 1 - z + alpha, 1 - z - alpha
        # At the end of sliding the upper field is tangent, and turns upwards beyond it.
        if y == 0 and below > 0 > above and z > 1 - alpha + 1e-9:
            spent = min(left, z - (1 - alpha))
            pieces.append(Piece("stick", np.array([[z, 0.0], [z - spent, 0.0]])))
            z -= spent
        else:
            side = int(np.sign(y)) or (1 if below > 0 else -1)
            path, spent, landed = _until_surface(side, z, y, alpha, left)
            pieces.append(Piece("slip", path))
            z, y = float(path[-1, 0]), 0.0 if landed else float(path[-1, 1])
        left -= spent
    return pieces


def _until_surface(
    side: int, z: float, y: float, alpha: float, left: float
) -> tuple[FloatArray, float, bool]:
    """The path on one side, the time it took, and whether it came to the surface."""
    time = np.linspace(0.0, left, max(2, int(left / _SAMPLE) + 1))
    path = slip(side, z, y, alpha, time)
    over = np.flatnonzero(side * path[1:, 1] < 0) + 1
    # An orbit that leaves the surface starts on it.
    over = over[over > 1] if y == 0 else over
    if not over.size:
        return path, left, False
    low, high = float(time[over[0] - 1]), float(time[over[0]])
    for _ in range(60):
        middle = (low + high) / 2
        inside = side * slip(side, z, y, alpha, np.array([middle]))[0, 1] > 0
        low, high = (middle, high) if inside else (low, middle)
    end = slip(side, z, y, alpha, np.array([high]))
    end[0, 1] = 0.0
    return np.concatenate([path[: over[0]], end]), high, True


def steps_of(eps: float, stiffness: float, duration: float) -> int:
    """The number of steps of `smoothed`: stable on the slow curve, and smooth to the eye off it."""
    return int(np.ceil(duration / eps * max(6 * stiffness, 40)))


def smoothed(drift: Drift, starts: FloatArray, eps: float, steps: int, h: float) -> FloatArray:
    """Orbits of the smoothed oscillator by Runge and Kutta's method of order 4.

    Parameters
    ----------
    drift : Drift
        The friction drift at z0 = 0; at another extension z it is less by z.
    starts : ndarray, shape (m, 2)
        Points (z, u), u = y/eps.
    eps : float
    steps : int
    h : float
        Time of a step, see `steps_of`.

    Returns
    -------
    ndarray, shape (n, m, 2)
        Points (z, u).
    """
    values = drift.float_values()

    def field(points: FloatArray) -> FloatArray:
        """The velocity (z', u') of the smoothed oscillator in scaled variables."""
        z, u = points[:, 0], points[:, 1]
        across = drift.evaluate_float(np.minimum(np.maximum(u, -1.0), 1.0), values) - z
        return np.column_stack([eps * u - 1.0, across / eps - u])

    points = np.empty((steps + 1, *starts.shape))
    points[0] = now = starts
    for k in range(steps):
        first = field(now)
        second = field(now + h / 2 * first)
        third = field(now + h / 2 * second)
        fourth = field(now + h * third)
        points[k + 1] = now = now + h / 6 * (first + 2 * (second + third) + fourth)
    return points


# -- figures ---------------------------------------------------------------------------------------


#: Half-widths of the layer that flows can show: thinner ones are too stiff to see an orbit bend.
_THINNEST, _THICKEST = 0.005, 0.5
_MOST_STEPS = 40_000
_SURFACE: dict[str, Any] = {"linewidth": 2.0, "solid_capstyle": "butt", "zorder": 3}


@reads_numbers
def fil(alpha: Number = 1) -> Figure:
    """Orbits of the ideal switch by Filippov's convention: sliding and crossing (Fig. fil).

    Parameters
    ----------
    alpha : number
        Friction strength, greater than 0.

    Returns
    -------
    matplotlib.figure.Figure
        Panel (i) is about the middle of the sliding region of the friction
        oscillator, with the construction of the sliding vector; panel (ii) is
        in its crossing region.

    Examples
    --------
    >>> from symasym.workshop.figures import fil
    >>> [axes.get_title(loc="left") for axes in fil().axes]
    ['(i)  sliding', '(ii)  crossing']
    """
    strength = positive("alpha", exact("alpha", alpha))
    a = float(strength)
    caption = (
        "The ideal switch at y = 0, here Coulomb friction of strength "
        f"alpha = {number_text(strength)} on the oscillator. (i) Both fields point to the surface: "
        "orbits reach it and slide along it with the combination (bold) of f+ and f- that is "
        "tangent to it. (ii) Both fields point the same way: orbits cross at once, with a kink."
    )
    with style():
        figure = new_figure(7.2, 3.3, caption)
        sliding, crossing = figure.subplots(1, 2)
        for axes, middle in ((sliding, 1.0), (crossing, 1 - 1.85 * a)):
            axes.set(xlim=(middle - 0.75 * a, middle + 0.75 * a), ylim=(-0.75 * a, 0.75 * a))
            _surface(axes, a)
            _axis_labels(axes, "$y$")
            axes.set_yticks([0])
        sliding.set_title("(i)  sliding")
        crossing.set_title("(ii)  crossing")
        # The orbits reach the surface about as far to the left as they started above it.
        for z in np.linspace(0.65, 2.0, 5) * a + 1 - a:
            _filippov_orbit(sliding, z, 0.75 * a, a, 1.5)
        for z in np.linspace(0.45, 1.6, 5) * a + 1 - a:
            _filippov_orbit(sliding, z, -0.75 * a, a, 1.5)
        for z in np.linspace(-1.5, 0.1, 6) * a + 1 - a:
            _filippov_orbit(crossing, z, -0.75 * a, a, 4.0)
        _construction(sliding, 1.0, a)
        return figure


@reads_numbers
def flows(mu: Number = 3, alpha: Number = 1, eps: Number = "1/10") -> Figure:
    """Orbits through the layer of the smoothed switch, in three cases (Fig. flows).

    Parameters
    ----------
    mu : number
        Shape of the friction force in panel ``(ii.b)``, greater than 1/2; the other
        panels have mu = 0.
    alpha : number
        Friction strength, greater than 0.
    eps : number
        Half-width of the layer, in physical units, from 0.005 to 0.5.

    Returns
    -------
    matplotlib.figure.Figure
        Orbits in (z, u), u = y/eps, and the slow manifold, an orbit itself (Fenichel):
        its attracting branch (solid) and its repelling one (dashed).

    Examples
    --------
    >>> from symasym.workshop.figures import flows
    >>> len(flows(mu=2).axes)
    3
    """
    shape, width = exact("mu", mu), positive("eps", exact("eps", eps))
    if not _THINNEST <= width <= _THICKEST:
        raise InputError(
            f"eps is {float_text(width)}; give {_THINNEST} to {_THICKEST}, where orbits can be "
            "seen to bend inside the layer."
        )
    linear, cubic = (sa.friction(mu=m, alpha=alpha, z0=0) for m in (0, shape))
    require_overshoot(shape)
    a, small = float(linear.scalars()["alpha"]), float(width)
    fold = float(cubic.folds().z0[0])
    caption = (
        f"The smoothed switch with a layer |u| <= 1 of half-width eps = {number_text(width)} "
        f"(grey), u = y/eps, alpha = {number_text(exact('alpha', alpha))}. Bold: the slow "
        "manifold, attracting where solid, repelling where dashed. "
        "(i) Sliding region: orbits settle on the attracting one. (ii.a) Crossing "
        "region, linear smoothing: nothing stops them. (ii.b) The same region with "
        f"mu = {number_text(shape)}: orbits from below stay in the layer until the manifold "
        f"ends at the fold, z = {signed(f'{fold:.3g}')} (the dot is that of the curve of zero "
        "drift); those that begin on the repelling "
        "branch leave it either way."
    )
    edge = 1 - a
    left = min(edge - 1.2 * a, fold - 0.4 * a)
    _steps(cubic, small, edge - left)  # Refused before anything is drawn.
    with style():
        figure = new_figure(9.6, 3.4, caption)
        panels = figure.subplots(1, 3, sharey=True)
        cases = (
            ("(i)  sliding", linear, 1 - 0.75 * a, 1 + 0.75 * a),
            (r"(ii.a)  crossing, $\mu = 0$", linear, left, edge),
            (rf"(ii.b)  crossing, $\mu = {number_text(shape)}$", cubic, left, edge),
        )
        for axes, (title, drift, low, high) in zip(panels, cases, strict=True):
            axes.set(xlim=(low, high), ylim=(-3, 3), title=title)
            layer_band(axes, horizontal=True)
            branches = _slow_manifold(drift, small, low, high)
            _smoothed_orbits(axes, drift, small, branches.get("repelling"))
            for kind, path in branches.items():
                dashed = {"linestyle": (0, (3, 1.5))} if kind == "repelling" else {}
                thick = {**_SURFACE, "linewidth": 2.2, **dashed}
                axes.plot(*_thinned(path).T, color=INK, gid=f"slow-{kind}", **thick)
            for edge_of_layer in (-1, 1):
                axes.axhline(edge_of_layer, color=FAINT, linewidth=0.6)
            _axis_labels(axes, r"$u = y/\varepsilon$" if axes is panels[0] else "")
            axes.set_yticks([-3, -1, 0, 1, 3])
        panels[2].plot([fold], [cubic.turning_points()], "o", color=INK, markersize=4, gid="fold")
        panels[2].plot([fold, fold], [-3, cubic.turning_points()], ":", color=FAINT, linewidth=1)
        for axes in panels[1:]:
            axes.set_xticks(np.round(np.linspace(left, edge, 5), 2))
        panels[2].annotate(
            "$z_0^{(+)}$", (fold, -3), (3, 4), textcoords="offset points", ha="left", va="bottom"
        )
        return figure


@reads_numbers
def phase(alpha: Number = 1) -> Figure:
    """The phase portrait of the oscillator with Coulomb friction (Fig. phase).

    Parameters
    ----------
    alpha : number
        Friction strength, greater than 0.

    Returns
    -------
    matplotlib.figure.Figure
        Orbits by Filippov's convention in (z, y); on y = 0 the crossing
        regions are dashed, and the sliding region is solid with its field.

    Examples
    --------
    >>> from symasym.workshop.figures import phase
    >>> phase(alpha=2).axes[0].get_xlabel()
    '$z$'
    """
    strength = positive("alpha", exact("alpha", alpha))
    a = float(strength)
    caption = (
        "Phase portrait of the oscillator with Coulomb friction, "
        f"alpha = {number_text(strength)}, by Filippov's convention. On y = 0 the block sticks to "
        "the belt along the solid stretch, 1 - alpha < z < 1 + alpha, rides to the left and slips "
        "into y > 0 at its end (black); on the dashed stretches orbits cross, from y < 0 (red) "
        "or from y > 0 (blue). The dot is the rest point of the slipping block."
    )
    with style():
        figure = new_figure(5.6, 4.2, caption)
        axes = figure.subplots()
        low, high = min(-a, 1 - a) - 1.6, 1 + a + 1.6
        axes.set(xlim=(low, high), ylim=(-2.2, 3.0))
        _surface(axes, a)
        starts = [(z, -2.2) for z in np.linspace(low + 0.4, high - 0.2, 6)]
        starts += [(z, 3.0) for z in np.linspace(low - 0.8, high - 2.0, 5)]
        for z, y in starts:
            _filippov_orbit(axes, z, y, a, 25.0)
        # The orbit that leaves the end of the sliding stretch, which all that stick share.
        _filippov_orbit(axes, 1 - a, 0.0, a, 25.0, INK)
        for share in (0.22, 0.5, 0.78):
            start = 1 - a + 2 * a * share
            vector(axes, (start + 0.12, 0.0), (-0.24, 0.0), INK, 1.8, "sliding-field")
        axes.plot([-a], [1.0], "o", color=INK, markersize=5, gid="rest")
        _axis_labels(axes, "$y$")
        names = [r"$-\alpha$", r"$1-\alpha$", r"$1+\alpha$"]
        axes.set_xticks([-a, 1 - a, 1 + a], names)
        axes.set_yticks([0, 1])
        _phase_key(figure)
        return figure


def require_overshoot(mu: Fraction) -> None:
    """Refuse a shape without turning points in the layer."""
    if mu <= 0.5:
        raise InputError(
            f"mu is {float_text(mu)}; give more than 1/2, without which the friction force has no "
            "turning point in the layer and there is no well to draw."
        )


def _phase_key(figure: Figure) -> None:
    """The legend of the phase portrait."""
    from matplotlib.lines import Line2D

    above, below = colors()[:2]
    handles = [
        Line2D([], [], color=above, linewidth=1.1, label="slips, $y > 0$"),
        Line2D([], [], color=below, linewidth=1.1, label="slips, $y < 0$"),
        Line2D([], [], color=INK, linewidth=2.0, label="sticks"),
        Line2D([], [], color=INK, linewidth=1.4, linestyle=(0, (4, 2)), label="crosses"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, fontsize="small")


def _axis_labels(axes: Axes, y: str) -> None:
    """Name the axes; no name where `y` is empty."""
    axes.set_xlabel("$z$")
    if y:
        axes.set_ylabel(y)


def _surface(axes: Axes, alpha: float) -> None:
    """The surface y = 0: solid where it slides, dashed where it is crossed."""
    low, high = axes.get_xlim()
    ends = [low, *(z for z in (1 - alpha, 1 + alpha) if low < z < high), high]
    for left, right in zip(ends[:-1], ends[1:], strict=True):
        region = sa.friction(mu=0, alpha=alpha, z0=(left + right) / 2).region
        dashes = {"linestyle": (0, (4, 2)), "linewidth": 1.4} if region == "crossing" else {}
        axes.plot([left, right], [0, 0], color=INK, gid=region, **{**_SURFACE, **dashes})


def _filippov_orbit(
    axes: Axes, z: float, y: float, alpha: float, duration: float, color: str = ""
) -> None:
    """Draw an orbit by Filippov's convention, with an arrow on each of its pieces."""
    hues = {1: colors()[0], -1: colors()[1]}
    for piece in filippov(z, y, alpha, duration):
        if piece.kind == "stick":
            continue  # The surface is drawn already.
        side = 1 if piece.path[:, 1].sum() > 0 else -1
        shown = color or hues[side]
        axes.plot(*piece.path.T, color=shown, linewidth=1.1, gid=f"slip{side:+d}")
        arrow(axes, piece.path, shown, gid=f"along{side:+d}")


def _construction(axes: Axes, z: float, alpha: float) -> None:
    """f+, f- and their tangent combination at a point of the surface."""
    fields = {side: np.array([-1.0, 1 - z - side * alpha]) for side in (1, -1)}
    share = fields[-1][1] / (fields[-1][1] - fields[1][1])
    sliding = share * fields[1] + (1 - share) * fields[-1]
    # Fields of their own length would run off the panel where alpha is not 1.
    unit = 0.5 * alpha / max(np.hypot(*f) for f in fields.values())
    # Each field in the colour of its side's orbits.
    hues = {1: colors()[0], -1: colors()[1]}
    for side, name in ((1, "$f^+$"), (-1, "$f^-$")):
        hue = dark(hues[side], 0.75)
        vector(axes, (z, 0), unit * fields[side], hue, 2.0, f"f{side:+d}")
        end = unit * fields[side]
        axes.annotate(
            name,
            xy=(z + end[0], end[1]),
            xytext=(-3, 4 * -side),
            textcoords="offset points",
            ha="right",
            va="center",
            color=hue,
            bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
            zorder=5,
        )
    tips = np.array([unit * fields[side] for side in (1, -1)])
    axes.plot(z + tips[:, 0], tips[:, 1], ":", color=INK, linewidth=1)
    vector(axes, (z, 0), unit * sliding, INK, 3.4, "sliding-vector")


def _smoothed_orbits(axes: Axes, drift: Friction, eps: float, repelling: FloatArray | None) -> None:
    """Draw orbits through the layer of the smoothed switch."""
    low, high = axes.get_xlim()
    span = high - low
    # From below everywhere; from above only what comes back to the layer.
    starts = [(z, -3.0) for z in np.linspace(low + 0.1 * span, high + 0.25 * span, 7)]
    if high > 1:
        starts += [(z, 3.0) for z in np.linspace(low + 0.25 * span, high + 0.3 * span, 6)]
    if repelling is not None:
        # Off the repelling branch by less than is seen, to both sides of it in turn.
        for k, share in enumerate((0.15, 0.35, 0.55, 0.75)):
            z, u = repelling[int(share * (len(repelling) - 1))]
            starts.append((z, u + (1e-3 if k % 2 else -1e-3)))
    steps = _steps(drift, eps, span)
    paths = smoothed(drift, np.array(starts), eps, steps, 1.5 * span / steps)
    for k, (_, u) in enumerate(starts):
        path = paths[:, k]
        outside = np.flatnonzero((path[1:, 0] < low) | (np.abs(path[1:, 1]) > 3.0 + 1e-9))
        path = path[: outside[0] + 2] if outside.size else path
        side = 1 if u > 0 else -1
        color = colors()[0 if side > 0 else 1]
        axes.plot(*_thinned(path).T, color=color, linewidth=1.0, gid=f"orbit-{k}")
        arrow(axes, path, color, 0.75 if abs(u) < 1.5 else 0.18, gid=f"along-{k}")


def _slow_manifold(drift: Friction, eps: float, low: float, high: float) -> dict[str, FloatArray]:
    """The branches of the slow manifold in a window: orbits that have forgotten their start.

    An orbit forgets where it came from along the attracting branch, and run backwards along
    the repelling one. Each begins on the zero of the drift at one end of the branch.
    """
    turn = float(drift.turning_points())
    folded = not np.isnan(turn)
    fold = float(drift(turn)) if folded else -np.inf
    span = high - low
    steps = _steps(drift, eps, span)
    step = 1.5 * span / steps
    branches = {}
    # The drift at z0 = 0 is where z has to be for it to vanish.
    u = np.linspace(-turn if folded else -1.0, turn if folded else 1.0, 401)
    z = drift(u)
    begin = min(high + 0.4 * span, float(z.max()) - 1e-3)
    if float(z.min()) < high and begin > max(low, fold):
        start = [begin, float(np.interp(-begin, -z, u))]
        path = smoothed(drift, np.array([start]), eps, steps, step)[:, 0]
        seen = (path[:, 0] <= high) & (path[:, 0] >= max(low, fold))
        branches["attracting"] = path[seen]
    if folded:
        u = np.linspace(turn, 1.0, 401)
        z = drift(u)
        start = [fold + 1e-3, float(np.interp(fold + 1e-3, z, u))]
        path = smoothed(drift, np.array([start]), eps, steps, -step)[:, 0]
        branches["repelling"] = path[(path[:, 0] <= high) & (path[:, 1] <= 1)]
    return branches


def _steps(drift: Friction, eps: float, span: float) -> int:
    """The number of steps of orbits through a window of this width; refused where too many."""
    alpha, mu = (float(drift.scalars()[name]) for name in ("alpha", "mu"))
    steps = steps_of(eps, alpha * max(1 + mu, 2 * mu - 1), 1.5 * span)
    if steps > _MOST_STEPS:
        least = eps * steps / _MOST_STEPS
        raise InputError(
            f"eps is {eps:.6g}, too thin a layer for so stiff a force; give at least {least:.2g}, "
            "or a smaller mu or alpha."
        )
    return steps


def _thinned(path: FloatArray) -> FloatArray:
    """Every so many points of a path of tiny steps, its end included."""
    stride = max(1, len(path) // 400)
    kept = path[::stride]
    return kept if (len(path) - 1) % stride == 0 else np.append(kept, path[-1:], axis=0)
