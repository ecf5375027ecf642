"""The friction oscillator's escape time, z frozen, beside what approximates it.

The exact one and the paper's formula against z0 (fric1, fric2), and through the fold by step and
uniform approximation (stokes). In the oscillator z moves while the block sticks, so this is not
the time of its release.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.base.errors import InputError
from symasym.base.inputs import FloatArray, Number, Numbers, exact
from symasym.drift.models import check_count
from symasym.workshop.figures.style import (
    INK,
    colors,
    dark,
    fold_of,
    given_text,
    light,
    new_figure,
    number_text,
    reads_numbers,
    several,
    shape_colors,
    signed,
    style,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from symasym.quantities import TimeMethod


# The paper's setting: everything is exact, and eps, kappa and r are the physical ones.
EPS = "0.01"
R = "0.1"
ALPHA = "1"
KAPPAS = ("0.01", "0.02", "0.05", "0.1")
MUS = ("1/2", "1", "2", "3")
#: (mu, kappa) of every curve in the figures.
DRAWN = tuple(
    dict.fromkeys(
        [(mu, kappa) for mu in ("3", "1/2") for kappa in KAPPAS] + [(mu, KAPPAS[0]) for mu in MUS]
    )
)
POINTS = 400


@dataclass(frozen=True)
class Curve:
    """log of the escape time against z0, for one mu and one noise amplitude.

    Attributes
    ----------
    mu, kappa : str
        Exact; `kappa` is the physical amplitude.
    z0, exact : ndarray
        The exact integral (eq:Ttilde).
    asymptotic : list of (ndarray, ndarray)
        The paper's formula (eq:Ttildesmall), in pieces between its discontinuities.
    fold : float or None
        Where it is discontinuous, z0^(+), if it is.
    """

    mu: str
    kappa: str
    z0: FloatArray
    exact: FloatArray
    asymptotic: list[tuple[FloatArray, FloatArray]]
    fold: float | None


def curve(
    mu: Number,
    kappa: Number,
    points: int = POINTS,
    *,
    alpha: Number = ALPHA,
    eps: Number = EPS,
    r: Number = R,
    low: float | None = None,
) -> Curve:
    """Both sides of the comparison at evenly spaced values of z0 in the crossing region.

    Parameters
    ----------
    mu : number
        Shape of the friction force.
    alpha : number
        Strength of the friction force.
    kappa : number
        Physical noise amplitude.
    eps : number
        Physical half-width of the layer.
    r : number
        Physical radius of escape.
    points : int
        How many values of z0, from `low` to the region's edge 1 - alpha, which is
        left out.
    low : float, optional
        Smallest z0, 1 - 3 alpha if left out.
    """
    scales = sa.rescale(eps=eps, kappa=kappa, r=r)
    family = sa.friction(mu=mu, alpha=alpha)
    edge, strength = 1 - float(exact("alpha", alpha)), float(exact("alpha", alpha))
    begin = edge - 2 * strength if low is None else low
    z0 = np.linspace(begin, edge, check_count("points", points), endpoint=False)
    fold = float(family.folds().z0[0])
    # On the right of the fold the formula diverges like (z0 - fold)^(-1/2), so the grid is
    # refined there and stops short of it; on the left it is continuous up to the fold.
    sides = [z0]
    if not np.isnan(fold):
        near = fold + strength * np.geomspace(1e-4, 2e-2, 40)
        right = np.union1d(z0[z0 > fold], near[near < edge])
        sides = [np.append(z0[z0 < fold - 1e-9], fold - 1e-9), right][: 1 + bool(right.size)]

    def log_time(at: FloatArray, method: TimeMethod) -> FloatArray:
        """log T at these z0."""
        drift = family.bind(z0=at)
        return np.asarray(sa.escape_time(drift, scales.kappa, scales.r, method=method, log=True))

    return Curve(
        mu=str(mu),
        kappa=str(kappa),
        z0=z0,
        exact=log_time(z0, "exact"),
        asymptotic=[(side, log_time(side, "paper")) for side in sides],
        fold=None if np.isnan(fold) else fold,
    )


@reads_numbers
def fric1(
    points: int = POINTS,
    *,
    mu: Numbers = ("3", "1/2"),
    kappa: Numbers = KAPPAS,
    alpha: Number = ALPHA,
    eps: Number = EPS,
    r: Number = R,
) -> Figure:
    """The escape time with z frozen at z0, at several noise amplitudes (Fig. fric1).

    Parameters
    ----------
    points : int
        Values of z0 in the crossing region, at least 2.
    mu : number or sequence of up to four numbers
        Shapes of the friction force, a panel each; with an inset at the fold
        where there is one.
    kappa : number or sequence of up to four numbers
        Physical noise amplitudes, a curve each.
    alpha : number
        Strength of the friction force.
    eps : number
        Physical half-width of the layer.
    r : number
        Physical radius of escape.

    Examples
    --------
    >>> from symasym.workshop.figures import fric1
    >>> len(fric1(points=20, mu=2).axes)
    1
    """
    shapes, amplitudes = several("mu", mu), several("kappa", kappa)
    setting = {"alpha": alpha, "eps": eps, "r": r}
    low = _lowest(shapes, alpha)
    panels = [[_curve(m, k, points, low, setting) for k in amplitudes] for m in shapes]
    labels = [rf"$\kappa_p = {number_text(exact('kappa', k))}$" for k in amplitudes]
    caption = (
        "Logarithm of the mean escape time with the spring extension frozen at z0, "
        f"{given_text(**setting)}: the exact integral (solid) and the paper's leading-order "
        "formula (dotted), for the physical amplitude kappa_p beside the curves."
    )
    if any(curves[0].fold is not None for curves in panels):
        caption += (
            " The formula jumps at the fold, where the well is born; the escape time does not."
        )
    if any(curves[0].fold is None for curves in panels):
        caption += " Without a well, for mu up to 1/2, the formula does not depend on kappa."
    with style():
        figure = new_figure(4.2 * len(shapes) + (0.4 if len(shapes) == 1 else 0), 3.8, caption)
        for n, (axes, curves, m) in enumerate(
            zip(figure.subplots(1, len(shapes), squeeze=False)[0], panels, shapes, strict=True)
        ):
            number = f"({('i', 'ii', 'iii', 'iv')[n]})  " if len(shapes) > 1 else ""
            _limits(axes, curves, 0.03)
            _panel(
                axes, curves, labels, rf"{number}$\mu = {number_text(exact('mu', m))}$", colors()
            )
            _fold_inset(axes, curves)
        if any(axes.child_axes for axes in figure.axes):
            figure.set_label(f"{caption} The inset magnifies the fold.")
        figure.legend(handles=_key(), loc="outside lower center", ncols=2)
        return figure


@reads_numbers
def fric2(
    points: int = POINTS,
    *,
    mu: Numbers = MUS,
    kappa: Number = KAPPAS[0],
    alpha: Number = ALPHA,
    eps: Number = EPS,
    r: Number = R,
) -> Figure:
    """The escape time with z frozen at z0, for several mu at small noise (Fig. fric2).

    Parameters
    ----------
    points : int
        Values of z0 in the crossing region, at least 2.
    mu : number or sequence of up to four numbers
        Shapes of the friction force, a curve each.
    kappa : number
        Physical noise amplitude.
    alpha : number
        Strength of the friction force.
    eps : number
        Physical half-width of the layer.
    r : number
        Physical radius of escape.

    Returns
    -------
    matplotlib.figure.Figure
        Every discontinuity of the asymptotic value is marked.

    Examples
    --------
    >>> from symasym.workshop.figures import fric2
    >>> fric2(points=20, mu=[1, 2]).axes[0].get_xlabel()
    '$z_0$'
    """
    shapes = several("mu", mu)
    setting = {"alpha": alpha, "eps": eps, "r": r}
    low = _lowest(shapes, alpha)
    curves = [_curve(m, kappa, points, low, setting) for m in shapes]
    noise = number_text(exact("kappa", kappa))
    caption = (
        "Logarithm of the mean escape time with the spring extension frozen at z0, "
        f"kappa_p = {noise}, {given_text(**setting)}, for the mu beside the curves: the "
        "exact integral (solid) and the paper's leading-order formula (dotted). The numbers are "
        "the folds, at which the formula jumps: its Stokes discontinuities."
    )
    with style():
        figure = new_figure(5.4, 4.1, caption)
        axes = figure.subplots()
        _limits(axes, curves, 0.03)
        labels = [rf"$\mu = {number_text(exact('mu', m))}$" for m in shapes]
        hues = shape_colors([exact("mu", m) for m in shapes])
        _panel(axes, curves, labels, rf"$\kappa_p = {noise}$", hues)
        inset = _inset(axes, curves, hues)
        _mark_folds(inset or axes, curves, hues, 0.1 if inset is None else 0.2)
        if inset is not None:
            figure.set_label(f"{caption} The inset magnifies them.")
        figure.legend(handles=_key(), loc="outside lower center", ncols=2)
        return figure


def _curve(mu: Number, kappa: Number, points: int, low: float, setting: dict[str, Any]) -> Curve:
    """One curve, of at least two points."""
    if check_count("points", points) < 2:
        raise InputError(f"points is {points}; give at least 2, the ends of a curve.")
    return curve(mu, kappa, points, low=low, **setting)


def _lowest(shapes: tuple[Any, ...], alpha: Number) -> float:
    """The left end of the curves: far enough to show every fold."""
    strength = float(exact("alpha", alpha))
    folds = [float(sa.friction(mu=m, alpha=alpha).folds().z0[0]) for m in shapes]
    return min([1 - 3 * strength, *(f - strength / 2 for f in folds if not np.isnan(f))])


def _limits(axes: Axes, curves: list[Curve], below: float) -> None:
    """Room for the exact curves and the folds; the formula may run out of it on their right."""
    least = min(float(c.exact.min()) for c in curves)
    folds = [float(c.asymptotic[0][1][-1]) for c in curves if c.fold is not None]
    most = max([float(c.exact.max()) for c in curves] + folds)
    edge = float(2 * curves[0].z0[-1] - curves[0].z0[-2])
    height = most - least
    axes.set(xlim=(curves[0].z0[0], edge), ylim=(least - below * height, most + 0.03 * height))


def _panel(axes: Axes, curves: list[Curve], labels: list[str], title: str, hues: list[str]) -> None:
    """Draw all curves of one panel, with their names."""
    for color, drawn in zip(hues, curves, strict=False):
        _draw(axes, drawn, color, gid="")
    axes.set(title=title, xlabel="$z_0$", ylabel=r"$\log T$")
    _label_ends(axes, [float(drawn.exact[-1]) for drawn in curves], labels, hues)


def _draw(axes: Axes, drawn: Curve, color: str, gid: str) -> None:
    """Draw the exact curve and the asymptotic one on both sides of the fold."""
    name = f"{gid}mu-{drawn.mu.replace('/', '-over-')}-kappa-{drawn.kappa}"
    axes.plot(drawn.z0, drawn.exact, color=light(color, 0.45), **_SOLID, gid=f"exact-{name}")
    for side, (z0, log_time) in zip(("left", "right"), drawn.asymptotic, strict=False):
        # Of the same hue and darker, so that it shows where the two coincide.
        axes.plot(z0, log_time, color=dark(color, 0.7), **_DOTTED, gid=f"asymptotic-{side}-{name}")


_SOLID: dict[str, Any] = {"linewidth": 2.4}
_DOTTED: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (1.0, 1.5))}


def _label_ends(axes: Axes, ends: list[float], labels: list[str], hues: list[str]) -> None:
    """Write each curve's name beside its right end, pushed apart where two would overlap."""
    low, high = axes.get_ylim()
    heights = [(end - low) / (high - low) for end in ends]
    placed = -1.0
    for i in sorted(range(len(ends)), key=heights.__getitem__):
        placed = max(heights[i], placed + 0.065)
        axes.annotate(
            labels[i],
            xy=(1.0, heights[i]),
            xytext=(1.06, placed),
            xycoords="axes fraction",
            textcoords="axes fraction",
            va="center",
            color=dark(hues[i], 0.8),
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": hues[i], "linewidth": 0.7},
        )


def _key() -> list[Any]:
    """The legend: solid is exact, dotted the paper's formula."""
    from matplotlib.lines import Line2D

    return [
        Line2D([], [], color="0.65", **_SOLID, label="exact"),
        Line2D([], [], color=INK, **_DOTTED, label="paper's formula"),
    ]


def _inset(axes: Axes, curves: list[Curve], hues: list[str]) -> Axes | None:
    """A window over the left of the folds, where the curves are low; None where it has no room."""
    folds = [c.fold for c in curves if c.fold is not None]
    left, right = axes.get_xlim()
    room = (min(folds) - left) / (right - left) - 0.11 if folds else 0.0
    if room < 0.25:
        return None
    inset = axes.inset_axes((0.1, 0.4, min(room, 0.5), 0.5))
    for color, drawn in zip(hues, curves, strict=False):
        _draw(inset, drawn, color, gid="inset-")
    # The formula jumps by about 1 on this scale, whatever the noise.
    levels = [float(c.asymptotic[0][1][-1]) for c in curves if c.fold is not None]
    half = 0.075 * (right - left)
    inset.set(
        xlim=(min(folds) - half, min(max(folds) + half, right)),
        ylim=(min(levels) - 0.55, max(levels) + 2.25),
    )
    inset.tick_params(labelsize="small")
    inset.spines[["top", "right"]].set_visible(True)
    zoom = axes.indicate_inset_zoom(inset, edgecolor="0.5")
    # One line at most: the left corners' go through the tick labels, and a long one through curves.
    alone = len(set(folds)) == 1
    for corner, line in zip(_CORNERS, zoom.connectors or (), strict=True):
        line.set_visible(alone and corner == "lower right")
    return inset


def _fold_inset(axes: Axes, curves: list[Curve]) -> None:
    """The neighbourhood of the fold, where the asymptotic value is discontinuous."""
    inset, fold = _inset(axes, curves, colors()), curves[0].fold
    if inset is None or fold is None:
        return
    left, right = inset.get_xlim()
    ends = [fold - 0.7 * (fold - left), fold, fold + 0.7 * (fold - left)]
    names = [signed(f"{end:.2g}") for end in ends]
    names[1] = "$z_0^{(+)}$"
    inset.set_xticks([e for e in ends if e < right], names[: sum(e < right for e in ends)])


# In matplotlib's order.
_CORNERS = ("lower left", "upper left", "lower right", "upper right")


def _mark_folds(axes: Axes, curves: list[Curve], hues: list[str], spacing: float) -> None:
    """The fold's number above every discontinuity of the asymptotic value."""
    low, high = axes.get_ylim()
    left, right = axes.get_xlim()
    folded = [(c.fold, k) for k, c in enumerate(curves) if c.fold is not None]
    gap = spacing * (right - left)
    text = right + 0.2 * gap
    # From right to left, pushed apart where two would overlap.
    for fold, k in sorted(folded, reverse=True):
        # On the right of a fold close to the edge there may be nothing of the formula.
        top = min(float(curves[k].asymptotic[-1][1][0]), high - 0.1 * (high - low))
        text = min(fold - 0.1 * gap, text - gap)
        axes.text(
            text,
            top + 0.02 * (high - low),
            signed(f"{fold:.2f}"),
            ha="center",
            va="bottom",
            color=dark(hues[k], 0.8),
        )


# -- through the fold ------------------------------------------------------------------------------


# As many more where arrays are quick.
_FINER = 7
# Noise amplitudes of the error map.
_MAP = np.geomspace(0.04, 0.28, 14)

#: Logarithms of T by name.
Curves = dict[str, FloatArray]


@reads_numbers
def stokes(
    points: int = 33,
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
        one scene at a time, interpolated between; the others have seven times as many.
    mu : number
        Shape of the friction force, greater than 1/2, so that there is a fold.
    alpha : number
        Strength of the friction force.
    kappa : number
        Scaled noise amplitude.
    r : number
        Scaled radius of escape.

    Returns
    -------
    matplotlib.figure.Figure
        Times, multiplier, relative errors, and the error of the uniform formula over z0
        and kappa.

    Examples
    --------
    >>> from symasym.workshop.figures import stokes
    >>> [len(axes.lines) for axes in stokes(points=8).axes[:3]]
    [4, 3, 5]
    """
    if check_count("points", points) < 8:
        raise InputError(f"points is {points}; give 8 or more.")
    family = sa.friction(mu=mu, alpha=alpha)
    fold = fold_of(mu, alpha)
    width = min(0.35, 0.9 * (1 - float(exact("alpha", alpha)) - fold))
    fine = fold + np.linspace(-0.8, 1.0, _FINER * (points - 1) + 1) * width
    z0 = fine[::_FINER]
    drift, chosen = family.bind(z0=z0), float(exact("kappa", kappa))
    wanted = np.asarray(sa.escape_time(family.bind(z0=fine), chosen, r, log=True))
    every = family.bind(z0=z0[:, None])
    true = np.asarray(sa.escape_time(every, _MAP, r, log=True))
    map_of = np.asarray(sa.escape_time(every, _MAP, r, method="uniform", order=0, log=True))

    def log_time(method: TimeMethod, order: int | None = None) -> FloatArray:
        """log T by a method that takes one scene at a time: its error interpolated."""
        logs = sa.escape_time(drift, chosen, r, method=method, order=order, log=True)
        return wanted + _between(z0, np.asarray(logs) - wanted[::_FINER], fine)

    step = sa.escape_time(family.bind(z0=fine), chosen, r, method="paper", log=True)
    curves = {
        "step (the paper)": np.asarray(step),
        "uniform, order 0": log_time("uniform", 0),
        "uniform, order 1": log_time("uniform", 1),
        "uniform, order 2": log_time("uniform", 2),
    }
    caption = (
        f"A well is born at z0 = {fold:.4g} ({given_text(mu=mu, kappa=kappa, r=r)}): the escape "
        "time with z frozen (a), the Stokes multiplier (b), relative errors (c), and the error of "
        "the uniform formula's leading order over z0 and kappa (d)."
    )
    with style():
        figure = new_figure(7.6, 6.0, caption)
        times, shares, errors, plane = figure.subplots(2, 2).ravel()
        _times(times, curves, fine, wanted, fold)
        _shares(shares, family.bind(z0=fine), kappa, fine, fold)
        _errors(errors, curves, fine, wanted)
        _plane(plane, z0, np.abs(np.expm1(map_of - true)))
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


def _between(at: FloatArray, values: FloatArray, wanted: FloatArray) -> FloatArray:
    """The polynomials through the six nearest of these points, at the wanted ones."""
    first = np.clip(np.searchsorted(at, wanted) - 3, 0, len(at) - 6)
    rows = first[:, None] + np.arange(6)
    nodes = at[rows]
    others = ~np.eye(6, dtype=bool)
    shares = np.where(others, wanted[:, None, None] - nodes[:, None, :], 1.0).prod(axis=2)
    scales = np.where(others, nodes[:, :, None] - nodes[:, None, :], 1.0).prod(axis=2)
    return np.asarray((shares / scales * values[rows]).sum(axis=1))


def _looks() -> dict[str, tuple[object, str]]:
    """Colour and dashes of each formula, the same in all panels."""
    blue, _, teal, ochre = colors()
    return {
        "exact": (INK, "-"),
        "step (the paper)": (blue, "-."),
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
    chosen = np.abs(z0 - fold) < near
    shown = {"exact": wanted, **{name: curves[name] for name in list(curves)[1::-1]}}
    for name, logs in shown.items():
        color, dashes = looks[name]
        at, values = z0[chosen], np.exp(logs[chosen])
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
    values = sa.stokes_multiplier(drift, float(exact("kappa", kappa)))
    color, dashes = looks["uniform, order 0"]
    axes.plot(z0, values, dashes, color=color, label="uniform")
    color, dashes = looks["step (the paper)"]
    ends, values = [z0[0], fold, fold, z0[-1]], [0, 0, 1, 1]
    axes.plot(ends, values, dashes, color=color, label="step (the paper)", zorder=1)
    axes.legend(loc="center right", fontsize=7.2)


def _errors(axes: Axes, curves: Curves, z0: FloatArray, wanted: FloatArray) -> None:
    """Draw the relative errors of T."""
    looks = _looks()
    for name, logs in curves.items():
        color, dashes = looks[name]
        error = np.maximum(np.abs(np.expm1(logs - wanted)), 1e-16)
        axes.semilogy(z0, error, dashes, color=color, label=name)
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
