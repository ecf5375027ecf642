"""The paper's figures of the friction oscillator, drawn from the numbers of this package."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import resources
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.inputs import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

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


def curve(mu: str, kappa: str, points: int = POINTS) -> Curve:
    """Both sides of the comparison for `points` values of z0 in [-2, 0).

    Parameters
    ----------
    mu, kappa : str
        Exact; `kappa` is the physical amplitude, and eps = 0.01, r = 0.1, alpha = 1.
    points : int
        How many values of z0, evenly spaced.
    """
    scales = sa.rescale(eps=EPS, kappa=kappa, r=R)
    z0 = np.linspace(-2.0, 0.0, points, endpoint=False)
    fold = float(sa.friction(mu=mu, alpha=ALPHA).folds().z0[0])
    # On the right of the fold the formula diverges like (z0 - fold)^(-1/2), so the grid is
    # refined there and stops short of it; on the left it is continuous up to the fold.
    sides = [z0]
    if not np.isnan(fold):
        near = fold + np.geomspace(1e-4, 2e-2, 40)
        right = np.union1d(z0[z0 > fold], near[near < 0])
        sides = [np.append(z0[z0 < fold - 1e-9], fold - 1e-9), right]
    return Curve(
        mu=mu,
        kappa=kappa,
        z0=z0,
        exact=_log_time(mu, z0, scales, "exact"),
        asymptotic=[(side, _log_time(mu, side, scales, "paper")) for side in sides],
        fold=None if np.isnan(fold) else fold,
    )


def _log_time(mu: str, z0: FloatArray, scales: Any, method: str) -> FloatArray:
    drift = sa.friction(mu=mu, alpha=ALPHA, z0=z0)
    return np.asarray(sa.escape_time(drift, scales.kappa, scales.r, method=method, log=True))


def fric1(points: int = POINTS) -> Figure:
    """The escape time against z0 at several noise amplitudes (Fig. fric1).

    Parameters
    ----------
    points : int
        Values of z0 in [-2, 0).

    Returns
    -------
    matplotlib.figure.Figure
        Panel (i) has mu = 3 and an inset at the fold, panel (ii) has mu = 1/2.
    """
    from matplotlib.figure import Figure

    with _style():
        figure = Figure(figsize=(8.4, 3.8))
        left, right = figure.subplots(1, 2)
        labels = [rf"$\kappa = {kappa}$" for kappa in KAPPAS]
        wells = [curve("3", kappa, points) for kappa in KAPPAS]
        left.set(xlim=(-2, 0), ylim=(0, 82))
        _panel(left, wells, labels, r"(i)  $\mu = 3$")
        _fold_inset(left, wells)
        flat = [curve("1/2", kappa, points) for kappa in KAPPAS]
        right.set(xlim=(-2, 0), ylim=(1, 8.2))
        _panel(right, flat, labels, r"(ii)  $\mu = 1/2$")
        _key(right)
        return figure


def fric2(points: int = POINTS) -> Figure:
    """The escape time against z0 for several mu at small noise (Fig. fric2).

    Parameters
    ----------
    points : int
        Values of z0 in [-2, 0).

    Returns
    -------
    matplotlib.figure.Figure
        Every discontinuity of the asymptotic value is marked.
    """
    from matplotlib.figure import Figure

    with _style():
        figure = Figure(figsize=(5.4, 3.8))
        axes = figure.subplots()
        curves = [curve(mu, KAPPAS[0], points) for mu in MUS]
        axes.set(xlim=(-2, 0), ylim=(-12, 82))
        labels = [rf"$\mu = {mu}$" for mu in MUS]
        _panel(axes, curves, labels, rf"$\kappa = {KAPPAS[0]}$")
        _mark_folds(axes, curves)
        _key(axes)
        return figure


def encode(figure: Figure, kind: str) -> bytes:
    """The figure as the bytes of a ``"png"`` or ``"svg"`` file, the same in every run."""
    buffer = BytesIO()
    undated = {"png": {"Software": None}, "svg": {"Date": None, "Creator": None}}
    with _style():
        figure.savefig(buffer, format=kind, metadata=undated[kind])
    return buffer.getvalue()


def _style() -> Any:
    """Our style over matplotlib's defaults, so that the user's own settings do not enter."""
    from matplotlib import style

    with resources.as_file(resources.files("symasym") / "symasym.mplstyle") as path:
        return style.context(["default", path])


def _colors() -> list[str]:
    from matplotlib import rcParams

    return [str(color) for color in rcParams["axes.prop_cycle"].by_key()["color"]]


def _panel(axes: Axes, curves: list[Curve], labels: list[str], title: str) -> None:
    for color, drawn in zip(_colors(), curves, strict=True):
        _draw(axes, drawn, color, gid="")
    axes.set(title=title, xlabel="$z_0$", ylabel=r"$\log\,\tilde{T}$")
    axes.set_xticks([-2, -1.5, -1, -0.5, 0])
    _label_ends(axes, [float(drawn.exact[-1]) for drawn in curves], labels)


def _draw(axes: Axes, drawn: Curve, color: str, gid: str) -> None:
    name = f"{gid}mu-{drawn.mu.replace('/', '-over-')}-kappa-{drawn.kappa}"
    axes.plot(drawn.z0, drawn.exact, color=color, gid=f"exact-{name}")
    for side, (z0, log_time) in zip(("left", "right"), drawn.asymptotic, strict=False):
        # Darker than the solid line, so that it shows where the two coincide.
        axes.plot(z0, log_time, color=_dark(color), **_DOTTED, gid=f"asymptotic-{side}-{name}")


_DOTTED: dict[str, Any] = {"linewidth": 1.1, "linestyle": (0, (1.0, 1.7))}


def _dark(color: str) -> tuple[float, ...]:
    from matplotlib.colors import to_rgb

    return tuple(0.35 * part for part in to_rgb(color))


def _label_ends(axes: Axes, ends: list[float], labels: list[str]) -> None:
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
            color=_colors()[i],
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": _colors()[i], "linewidth": 0.7},
        )


def _key(axes: Axes) -> None:
    """What solid and dotted mean."""
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color="0.1", label="exact"),
        Line2D([], [], color="0.1", **_DOTTED, label="asymptotic"),
    ]
    axes.legend(handles=handles, loc="upper left")


def _fold_inset(axes: Axes, curves: list[Curve]) -> None:
    """The neighbourhood of the fold, where the asymptotic value is discontinuous."""
    fold = curves[0].fold
    assert fold is not None
    inset = axes.inset_axes((0.1, 0.4, 0.5, 0.5))
    for color, drawn in zip(_colors(), curves, strict=True):
        _draw(inset, drawn, color, gid="inset-")
    inset.set(xlim=(-0.95, -0.65), ylim=(2, 4.8))
    inset.set_xticks([-0.9, fold, -0.7], ["−0.9", "$z_0^{(+)}$", "−0.7"])
    inset.set_yticks([2, 3, 4])
    inset.tick_params(labelsize="small")
    inset.spines[["top", "right"]].set_visible(True)
    axes.indicate_inset_zoom(inset, edgecolor="0.5")


def _mark_folds(axes: Axes, curves: list[Curve]) -> None:
    """A pointer, from below, to every discontinuity of the asymptotic value."""
    height = -9.0
    for color, drawn in zip(_colors(), curves, strict=True):
        if drawn.fold is None:
            continue
        z0, log_time = drawn.asymptotic[0]
        axes.annotate(
            f"{drawn.fold:.2f}".replace("-", "−"),
            xy=(float(z0[-1]), float(log_time[-1]) - 0.5),
            xytext=(float(z0[-1]), height),
            ha="center",
            color=color,
            arrowprops={"arrowstyle": "->", "color": color, "linewidth": 0.9},
        )
    axes.annotate("Stokes discontinuity at $z_0^{(+)} =$", xy=(-1.92, height), color="0.1")
