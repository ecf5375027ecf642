"""The friction oscillator's escape time, z frozen, beside what approximates it.

The exact one and the paper's formula against z0 (fric1, fric2), and through the fold by step and
uniform approximation (stokes). In the oscillator z moves while the block sticks, so this is not
the time of its release.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

import symasym as sa
from symasym.workshop.figures.style import BLUE, INK, OCHRE, RED, TEAL, new_figure, shade, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The paper's setting: eps, kappa and r are the physical ones.
EPS, R = "0.01", "0.1"
KAPPAS = ("0.01", "0.02", "0.05", "0.1")
MUS = ("1/2", "1", "2", "3")
#: (mu, kappa) of every curve in fric1 and fric2.
DRAWN = tuple(dict.fromkeys([*((m, k) for m in ("3", "1/2") for k in KAPPAS),
                             *((m, KAPPAS[0]) for m in MUS)]))  # fmt: skip
_SOLID: dict[str, Any] = {"linewidth": 2.4}
_DOTTED: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (1.0, 1.5))}
_COLORS = {"1/2": BLUE, "1": RED, "2": TEAL, "3": OCHRE}
_CAPTION = (
    "Logarithm of the mean escape time with the spring extension frozen at z0, alpha = 1, "
    "eps = 0.01, r = 0.1: the exact integral (solid) and the paper's leading-order formula "
    "(dotted), "
)


def _log_times(mu: str, kappa: str) -> tuple[Any, Any, list[Any], float]:
    """z0, log T there, the formula in pieces between its jumps, and the fold (nan without one)."""
    scales, family = sa.rescale(EPS, kappa, R), sa.friction(mu, 1)
    fold = float(family.folds().z0[0])
    z0 = np.linspace(-2.0, 0.0, 400, endpoint=False)
    # On the right of the fold the formula diverges like (z0 - fold)^(-1/2).
    sides = [z0]
    if not np.isnan(fold):
        near = fold + np.geomspace(1e-4, 2e-2, 40)
        right = np.union1d(z0[z0 > fold], near[near < 0])
        sides = [np.append(z0[z0 < fold - 1e-9], fold - 1e-9), right]

    def at(z: Any, method: Any) -> Any:
        return sa.escape_time(family.bind(z0=z), scales.kappa, scales.r, method=method, log=True)

    return z0, at(z0, "exact"), [(z, at(z, "paper")) for z in sides], fold


def _draw(axes: Axes, curve: Any, color: str) -> None:
    """The exact curve; of the same hue and darker the formula, so that it shows where both are."""
    z0, exact, pieces, _ = curve
    axes.plot(z0, exact, color=shade(color, 1.45), **_SOLID)
    for piece in pieces:
        axes.plot(*piece, color=shade(color, 0.7), **_DOTTED)


def _panel(axes: Axes, curves: list[Any], labels: list[str], hues: list[str]) -> None:
    """All curves, each with its name beside its right end, pushed apart where two would overlap."""
    least, most = (f([f(c[1]) for c in curves]) for f in (np.min, np.max))
    most = max([most, *(c[2][0][1][-1] for c in curves if len(c[2]) > 1)])
    low, high = least - 0.03 * (most - least), most + 0.03 * (most - least)
    axes.set(xlim=(-2, 0), ylim=(low, high), xlabel="$z_0$", ylabel=r"$\log T$")
    placed = -1.0
    for height, label, hue, curve in sorted(
        ((float(c[1][-1]) - low) / (high - low), *rest, c)
        for c, *rest in zip(curves, labels, hues, strict=True)
    ):
        _draw(axes, curve, hue)
        placed = max(height, placed + 0.065)
        axes.annotate(
            label, (1.0, height), (1.06, placed), "axes fraction", "axes fraction", va="center",
            color=shade(hue, 0.8), annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": hue, "linewidth": 0.7},
        )  # fmt: skip


def _inset(axes: Axes, curves: list[Any], hues: list[str], width: float) -> Axes:
    """A window over the left of the folds, where the curves are low."""
    folded = [c for c in curves if len(c[2]) > 1]
    folds, levels = [c[3] for c in folded], [c[2][0][1][-1] for c in folded]
    inset = axes.inset_axes((0.1, 0.4, width, 0.5))
    for curve, hue in zip(curves, hues, strict=True):
        _draw(inset, curve, hue)
    # The formula jumps by about 1 on this scale, whatever the noise.
    inset.set(
        xlim=(min(folds) - 0.15, min(max(folds) + 0.15, 0)),
        ylim=(min(levels) - 0.55, max(levels) + 2.25),
    )
    inset.tick_params(labelsize="small")
    inset.spines[["top", "right"]].set_visible(True)
    zoom = axes.indicate_inset_zoom(inset, edgecolor="0.5")
    # One line at most: others go through the tick labels or the curves.
    for corner, line in enumerate(zoom.connectors or ()):
        line.set_visible(corner == 2 and len(set(folds)) == 1)
    return inset


def _key(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color="0.65", **_SOLID, label="exact"),
        Line2D([], [], color=INK, **_DOTTED, label="paper's formula"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)


def fric1() -> Figure:
    """The escape time with z frozen at z0, at several noise amplitudes (Fig. fric1)."""
    caption = _CAPTION + (
        "for the physical amplitude kappa_p beside the curves. The formula jumps at the fold, "
        "where the well is born; the escape time does not. Without a well, for mu up to 1/2, the "
        "formula does not depend on kappa. The inset magnifies the fold."
    )
    hues, labels = [BLUE, RED, TEAL, OCHRE], [rf"$\kappa_p = {k}$" for k in KAPPAS]
    with style():
        figure = new_figure(8.4, 3.8, caption)
        for axes, mu, number in zip(figure.subplots(1, 2), ("3", "1/2"), ("i", "ii"), strict=True):
            curves = [_log_times(mu, k) for k in KAPPAS]
            _panel(axes, curves, labels, hues)
            axes.set_title(rf"({number})  $\mu = {mu}$")
            if mu == "3":
                inset, fold = _inset(axes, curves, hues, 0.5), curves[0][3]
                inset.set_xticks([fold - 0.1, fold, fold + 0.1], ["−0.88", "$z_0^{(+)}$", "−0.68"])
        _key(figure)
    return figure


def fric2() -> Figure:
    """The escape time with z frozen at z0, for several mu at small noise (Fig. fric2)."""
    caption = _CAPTION + (
        "kappa_p = 0.01, for the mu beside the curves. The numbers are the folds, at which the "
        "formula jumps: its Stokes discontinuities. The inset magnifies them."
    )
    curves, hues = [_log_times(m, KAPPAS[0]) for m in MUS], [_COLORS[m] for m in MUS]
    with style():
        figure = new_figure(5.4, 4.1, caption)
        axes = figure.subplots()
        _panel(axes, curves, [rf"$\mu = {m}$" for m in MUS], hues)
        axes.set_title(r"$\kappa_p = 0.01$")
        inset = _inset(axes, curves, hues, 0.45)
        left, right = inset.get_xlim()
        text, high = right, inset.get_ylim()[1]
        folded = [
            (c[3], c[2][1][1][0], hue) for c, hue in zip(curves, hues, strict=True) if c[2][1:]
        ]
        for fold, peak, hue in sorted(folded, reverse=True):
            text = min(fold - 0.02 * (right - left), text - 0.2 * (right - left))
            name = f"{fold:.2f}".replace("-", "−")
            look = {"ha": "center", "va": "bottom", "color": shade(hue, 0.8)}
            inset.text(text, min(float(peak), 0.9 * high), name, **look)
        _key(figure)
    return figure


def stokes() -> Figure:
    """The escape time against z0 where the friction oscillator's well is born."""
    family, fold = sa.friction(3, 1), -7 / 9
    z0 = fold + np.linspace(-0.8, 1.0, 91) * 0.35
    noises = np.geomspace(0.04, 0.28, 12)
    drift = family.bind(z0=z0)

    def log_time(method: Any, order: Any = None, of: Any = drift, kappa: Any = 0.1) -> Any:
        return sa.escape_time(of, kappa, 10, method=method, order=order, log=True)

    exact = log_time("exact")
    curves = {
        "step (the paper)": (log_time("paper"), BLUE, "-."),
        "uniform, order 0": (log_time("uniform", 0), TEAL, "-"),
        "uniform, order 1": (log_time("uniform", 1), OCHRE, "-"),
        "uniform, order 2": (log_time("uniform", 2), shade(OCHRE, 0.5), "-"),
    }
    coarse = z0[::5]
    every = family.bind(z0=coarse[:, None])
    apart = log_time("uniform", 0, every, noises) - log_time("exact", None, every, noises)
    caption = (
        f"A well is born at z0 = {fold:.4g} (mu = 3, kappa = 0.1, r = 10): the escape time with z "
        "frozen (a), the Stokes multiplier (b), relative errors (c), and the error of the uniform "
        "formula's leading order over z0 and kappa (d)."
    )
    top: dict[str, Any] = {"frameon": True, "framealpha": 1, "edgecolor": "none"}
    with style():
        figure = new_figure(7.6, 6.0, caption)
        times, shares, errors, plane = figure.subplots(2, 2).ravel()
        near = np.abs(z0 - fold) < 0.19
        times.semilogy(z0[near], np.exp(exact[near]), color=INK, linewidth=3.2, label="exact")
        for name, (logs, color, dashes) in [*curves.items()][1::-1]:
            at, values = z0[near], np.exp(logs[near])
            if dashes == "-.":  # a gap, not a line, at the step
                k = int(np.searchsorted(at, fold))
                at, values = np.insert(at, k, fold), np.insert(values, k, np.nan)
            times.semilogy(at, values, dashes, color=color, linewidth=1.5, label=name)
        times.set_ylabel(r"$T$")
        times.legend(loc="upper left", **top)
        shares.plot(z0, sa.stokes_multiplier(drift, 0.1), color=TEAL, label="uniform")
        ends = [z0[0], fold, fold, z0[-1]], [0, 0, 1, 1]
        shares.plot(*ends, "-.", color=BLUE, label="step (the paper)", zorder=1)
        shares.legend(loc="center right", fontsize=7.2)
        for name, (logs, color, dashes) in curves.items():
            gap = np.maximum(np.abs(np.expm1(logs - exact)), 1e-16)
            errors.semilogy(z0, gap, dashes, color=color, label=name)
        errors.set_ylabel("relative error")
        errors.set_ylim(top=3e4)
        errors.legend(fontsize=7.2, ncols=2, loc="upper left", columnspacing=3.0, **top)
        shown = plane.pcolormesh(
            coarse, noises, np.log10(np.maximum(np.abs(np.expm1(apart.T)), 1e-16)),
            shading="nearest", cmap="cividis",
        )  # fmt: skip
        plane.set(yscale="log", ylabel=r"$\kappa$")
        plane.set_yticks([0.05, 0.1, 0.2], ["0.05", "0.1", "0.2"])
        plane.minorticks_off()
        figure.colorbar(shown, ax=plane, label=r"$\log_{10}$ relative error")
        titles = (
            r"escape time, $\mu = 3$, $\kappa = 0.1$, $r = 10$",
            r"Stokes multiplier, $\kappa = 0.1$",
            r"error, $\kappa = 0.1$", "error of uniform, order 0",
        )  # fmt: skip
        for letter, axes, title in zip("abcd", figure.axes, titles, strict=False):
            axes.set_title(f"({letter})  {title}", loc="left")
            axes.set_xlabel(r"$z_0$")
            axes.axvline(fold, color=INK, linewidth=0.6, linestyle=":")
    return figure
