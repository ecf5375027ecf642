"""The friction oscillator's escape time, z frozen, and the release of the block that moves.

The exact escape time and the paper's formula against z0 (fric1, fric2), and through the fold by
step and uniform approximation (stokes). While the block sticks the belt moves z: paths, where and
when it comes free (release), and the regimes of it (regimes).
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import symasym as sa
from symasym.workshop.figures import style
from symasym.workshop.figures.style import BLUE, FAINT, INK, OCHRE, RED, TEAL, shade

# The paper's setting: eps, kappa and r are the physical ones.
EPS, R = "0.01", "0.1"
KAPPAS = {"0.01": BLUE, "0.02": RED, "0.05": TEAL, "0.1": OCHRE}
MUS = {"1/2": BLUE, "1": RED, "2": TEAL, "3": OCHRE}
#: (mu, kappa) of every curve in fric1 and fric2.
DRAWN = tuple(dict.fromkeys([*((m, k) for m in ("3", "1/2") for k in KAPPAS),
                             *((m, "0.01") for m in MUS)]))  # fmt: skip
# The moving block: scaled, but for eps.
_Z0, _R, _EPS, _FOLD = -0.4, 10.0, 0.01, -7 / 9
_NOISES = {0.1: BLUE, 0.2: RED, 0.3: TEAL}
_SOLID: dict[str, Any] = {"linewidth": 2.4}
_DOTTED: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (1.0, 1.5))}


class _Curve(NamedTuple):
    """log T against z0: exact, and the paper's formula in pieces between its jumps."""

    label: str
    hue: str
    z0: Any
    exact: Any
    pieces: list[Any]
    fold: float  # nan without one

    def draw(self, axes: Axes) -> None:
        """Of one hue, the formula darker, so that it shows where both are."""
        axes.plot(self.z0, self.exact, color=shade(self.hue, 1.45), **_SOLID)
        for piece in self.pieces:
            axes.plot(*piece, color=shade(self.hue, 0.7), **_DOTTED)


def _curve(mu: str, kappa: str, label: str, hue: str) -> _Curve:
    """Of the paper's oscillator."""
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

    return _Curve(label, hue, z0, at(z0, "exact"), [(z, at(z, "paper")) for z in sides], fold)


def _panel(axes: Axes, curves: list[_Curve]) -> None:
    """All curves, each with its name beside its right end, pushed apart where two would overlap."""
    least, most = (f([f(c.exact) for c in curves]) for f in (np.min, np.max))
    low, high = least - 0.03 * (most - least), most + 0.03 * (most - least)
    axes.set(xlim=(-2, 0), ylim=(low, high), xlabel="$z_0$", ylabel=r"$\log T$")
    placed = -1.0
    for curve in sorted(curves, key=lambda c: c.exact[-1]):
        curve.draw(axes)
        height = (curve.exact[-1] - low) / (high - low)
        placed = max(height, placed + 0.065)
        axes.annotate(
            curve.label, (1.0, height), (1.06, placed), "axes fraction", va="center",
            color=shade(curve.hue, 0.8), annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": curve.hue, "linewidth": 0.7},
        )  # fmt: skip


def _inset(axes: Axes, curves: list[_Curve], width: float, ticks: Any) -> None:
    """A window over the left of the folds, where the curves are low."""
    folded = [c for c in curves if len(c.pieces) > 1]
    folds, levels = [c.fold for c in folded], [c.pieces[0][1][-1] for c in folded]
    inset = axes.inset_axes((0.1, 0.4, width, 0.5))
    for curve in curves:
        curve.draw(inset)
    # The formula jumps by about 1 on this scale, whatever the noise.
    inset.set(
        xlim=(min(folds) - 0.15, min(max(folds) + 0.15, 0)),
        ylim=(min(levels) - 0.55, max(levels) + 2.25),
    )
    inset.set_xticks(ticks)
    inset.xaxis.set_major_formatter("{x:.2f}")
    inset.tick_params(labelsize="small")
    inset.spines[["top", "right"]].set_visible(True)
    zoom = axes.indicate_inset_zoom(inset, edgecolor="0.5")
    # One line at most: others go through the tick labels or the curves.
    for corner, line in enumerate(zoom.connectors or ()):
        line.set_visible(corner == 2 and len(set(folds)) == 1)


def _key(figure: Figure) -> None:
    looks = ("exact", "0.65", _SOLID), ("paper's formula", INK, _DOTTED)
    handles = [Line2D([], [], color=color, label=name, **look) for name, color, look in looks]
    figure.legend(handles=handles, loc="outside lower center", ncols=2)


@style.figure(8.4, 3.8)
def fric1(figure: Figure) -> None:
    """The escape time with z frozen at z0, at several noise amplitudes (Fig. fric1).

    Logarithm of the mean escape time with the spring extension frozen at z0, alpha = 1, eps = 0.01,
    r = 0.1: the exact integral (solid) and the paper's leading-order formula (dotted), for the
    physical amplitude kappa_p beside the curves. The formula jumps at the fold, where the well is
    born; the escape time does not. Without a well, for mu up to 1/2, the formula does not depend on
    kappa. The inset magnifies the fold.
    """
    for axes, mu, number in zip(figure.subplots(1, 2), ("3", "1/2"), ("i", "ii"), strict=True):
        curves = [_curve(mu, k, rf"$\kappa_p = {k}$", hue) for k, hue in KAPPAS.items()]
        _panel(axes, curves)
        axes.set_title(rf"({number})  $\mu = {mu}$")
        if mu == "3":
            _inset(axes, curves, 0.5, curves[0].fold + np.array([-0.1, 0, 0.1]))
    _key(figure)


@style.figure(5.4, 4.1)
def fric2(figure: Figure) -> None:
    """The escape time with z frozen at z0, for several mu at small noise (Fig. fric2).

    Logarithm of the mean escape time with the spring extension frozen at z0, alpha = 1, eps = 0.01,
    r = 0.1: the exact integral (solid) and the paper's leading-order formula (dotted), kappa_p =
    0.01, for the mu beside the curves. The inset magnifies the folds, marked on its axis, at which
    the formula jumps: its Stokes discontinuities.
    """
    curves = [_curve(mu, "0.01", rf"$\mu = {mu}$", hue) for mu, hue in MUS.items()]
    axes = figure.subplots()
    _panel(axes, curves)
    axes.set_title(r"$\kappa_p = 0.01$")
    _inset(axes, curves, 0.45, [c.fold for c in curves[1:]])
    _key(figure)


@style.figure(7.6, 6.0)
def stokes(figure: Figure) -> None:
    """The escape time against z0 where the friction oscillator's well is born.

    A well is born at z0 = -0.7778 (mu = 3, kappa = 0.1, r = 10): the escape time with z frozen (a),
    the Stokes multiplier (b), relative errors (c), and the error of the uniform formula's leading
    order over z0 and kappa (d).
    """
    family, fold = sa.friction(3, 1), -7 / 9
    z0 = fold + np.linspace(-0.8, 1.0, 91) * 0.35
    coarse, noises = z0[::5], np.geomspace(0.04, 0.28, 12)

    def log_time(method: Any, order: Any = None, z: Any = z0, kappa: Any = 0.1) -> Any:
        of = family.bind(z0=z)
        return sa.escape_time(of, kappa, 10, method=method, order=order, log=True)

    def error(logs: Any, exact: Any) -> Any:
        return np.maximum(np.abs(np.expm1(logs - exact)), 1e-16)

    exact, paper = log_time("exact"), log_time("paper")
    paper[np.argmin(np.abs(z0 - fold))] = np.nan  # a gap, not a line, at the step
    curves = {
        "step (the paper)": (paper, BLUE, "-."),
        "uniform, order 0": (log_time("uniform", 0), TEAL, "-"),
        "uniform, order 1": (log_time("uniform", 1), OCHRE, "-"),
        "uniform, order 2": (log_time("uniform", 2), shade(OCHRE, 0.5), "-"),
    }
    plain: dict[str, Any] = {"frameon": True, "framealpha": 1, "edgecolor": "none"}
    times, shares, errors, plane = figure.subplots(2, 2).ravel()
    near = np.abs(z0 - fold) < 0.19
    times.semilogy(z0[near], np.exp(exact[near]), color=INK, linewidth=3.2, label="exact")
    for name in ("uniform, order 0", "step (the paper)"):
        logs, color, dashes = curves[name]
        times.semilogy(z0[near], np.exp(logs[near]), dashes, color=color, lw=1.5, label=name)
    times.legend(loc="upper left", **plain)
    shares.plot(z0, sa.stokes_multiplier(family.bind(z0=z0), 0.1), color=TEAL, label="uniform")
    ends = [z0[0], fold, fold, z0[-1]], [0, 0, 1, 1]
    shares.plot(*ends, "-.", color=BLUE, label="step (the paper)", zorder=1)
    shares.legend(loc="center right", fontsize=7.2)
    for name, (logs, color, dashes) in curves.items():
        errors.semilogy(z0, error(logs, exact), dashes, color=color, label=name)
    errors.set_ylim(top=3e4)
    errors.legend(fontsize=7.2, ncols=2, loc="upper left", columnspacing=3.0, **plain)
    scenes = {"z": coarse, "kappa": noises[:, None]}
    worst = np.log10(error(log_time("uniform", 0, **scenes), log_time("exact", **scenes)))
    shown = plane.pcolormesh(coarse, noises, worst, shading="nearest", cmap="cividis")
    plane.set_yscale("log")
    plane.set_yticks([0.05, 0.1, 0.2], ["0.05", "0.1", "0.2"])
    plane.minorticks_off()
    figure.colorbar(shown, ax=plane, label=r"$\log_{10}$ relative error")
    for axes, name, title in (
        (times, "$T$", r"(a)  escape time, $\mu = 3$, $\kappa = 0.1$, $r = 10$"),
        (shares, "", r"(b)  Stokes multiplier, $\kappa = 0.1$"),
        (errors, "relative error", r"(c)  error, $\kappa = 0.1$"),
        (plane, r"$\kappa$", "(d)  error of uniform, order 0"),
    ):
        axes.set(title=title, xlabel="$z_0$", ylabel=name)
        axes.axvline(fold, color=INK, linewidth=0.6, linestyle=":")


def _released(kappa: float, eps: float = _EPS) -> Any:
    block = sa.oscillator(mu=3, alpha=1)
    return sa.release(block, kappa, _R, eps=eps, start=(0, _Z0), method="march", rtol=1e-3)


@style.figure(7.2, 5.4)
def release(figure: Figure) -> None:
    """The place and time at which the moving block comes free, beside T with z frozen.

    The block of the oscillator that begins to stick at z0 (mu = 3, alpha = 1, z0 = -0.4, eps =
    0.01, r = 10): (a) paths in the layer, taken along the wells (dots: barriers) to the left by the
    belt; (b) density of z at release; (c) mean time of release against the scaled kappa: of the
    whole system, with z frozen, and by the paper's formula for z frozen.
    """
    panels = figure.subplot_mosaic([["paths", "paths"], ["density", "times"]])
    plane, law, times = panels.values()
    for u, dashes in ((np.linspace(-0.2, 2 / 3, 150), "-"), (np.linspace(2 / 3, 1, 60), ":")):
        plane.plot(1 - 4 * u + 3 * u**3, u, dashes, color=INK, linewidth=1.4, zorder=3)
    for kappa, color in _NOISES.items():
        _paths(plane, kappa, color)
        place = _released(kappa).z
        z = np.linspace(place.quantile(1e-4), place.quantile(1 - 1e-4), 300)
        density = np.diff(place.cdf(z)) / np.diff(z)
        law.plot((z[1:] + z[:-1]) / 2, density, color=color, label=rf"$\kappa = {kappa}$")
    for axes in (plane, law):
        axes.axvline(_FOLD, color=INK, linewidth=0.6, linestyle=":")
    plane.set(xlabel="$z$", ylabel="$u$", title="(a)  paths")
    plane.set(xlim=(-1.02, -0.35), ylim=(-0.2, 2.2))
    law.set(xlabel="$z$ at release", ylabel="density", title="(b)  place of release")
    law.set_xlim(right=_Z0)
    law.legend(loc="upper right")
    plane.legend(*law.get_legend_handles_labels(), loc="upper left")
    frozen, fine = sa.friction(3, 1, "-0.4"), np.geomspace(0.05, 2.0, 200)
    looks: dict[Any, tuple[str, Any, str]] = {
        "exact": (RED, "--", "frozen, exact"),
        "paper": (OCHRE, (0, (1.0, 1.7)), "frozen, paper's formula"),
    }
    for method, (color, dashes, label) in looks.items():
        logs = sa.escape_time(frozen, fine, _R, method=method, log=True)
        times.plot(fine, np.exp(np.minimum(logs, 600)), color=color, ls=dashes, label=label)
    some = np.geomspace(0.05, 2.0, 25)
    means = [_released(k).mean for k in some.tolist()]
    times.plot(some, means, color=BLUE, label="moving")
    times.set(
        xscale="log", yscale="log", xlabel=r"$\kappa$ (scaled)", ylabel="mean time",
        ylim=(5, 30 * means[0]), title="(c)  time of release, $z$ frozen or moving",
    )  # fmt: skip
    times.legend(loc="upper right", fontsize="small", handlelength=1.7)


def _paths(axes: Axes, kappa: float, color: str) -> None:
    """Three simulated paths, by steps of 0.01."""
    normal, step = np.random.default_rng(5).standard_normal, 0.01
    u, z = np.zeros(3), np.full(3, _Z0)
    rows = [(z, u)]
    while (stays := np.abs(u) < _R).any():
        inside = np.clip(u, -1, 1)
        phi = 1 - z - _EPS * u - inside - 3 * (inside - inside**3)
        moved = u + step * phi + kappa * np.sqrt(step) * normal(3)
        z = np.where(stays, z + step * _EPS * (_EPS * u - 1), z)
        u = np.where(stays, moved, u)
        rows.append((z, u))
    every = rows[:: max(1, len(rows) // 1200)]
    axes.plot(*np.array(every).transpose(1, 0, 2), color=color, linewidth=0.35, alpha=0.8)


@style.figure(5.4, 4.6)
def regimes(figure: Figure) -> None:
    """Regions where the block passes, escapes by noise or sticks to the fold, in eps and kappa.

    What becomes of a block that begins to stick at z0 (mu = 3, alpha = 1, z0 = -0.4, r = 10
    scaled), over eps and the physical kappa_p. It is held to the fold with probability 1/2 on the
    solid curve, by the adiabatic law; above the dashed one T is less than twice the time of the
    ideal switch. Marks are scenes whose release was computed: squares where the block is held to
    the fold, rings where noise frees it before, and crosses where its mean time is less than twice
    that of the ideal switch; at the right the belt reaches the fold within that time. Dotted: the
    paper's threshold.
    """
    family, noise = sa.friction(3, 1), np.geomspace(0.01, 3.0, 160)
    nodes, weights = np.polynomial.legendre.leggauss(60)
    z = (_Z0 + _FOLD) / 2 + (_Z0 - _FOLD) / 2 * nodes
    logs = sa.escape_time(family.bind(z0=z[:, None]), noise, _R, log=True)
    # Held to the fold with probability exp(-hazard/eps), by the adiabatic law.
    half = (_Z0 - _FOLD) / 2 * weights @ np.exp(-logs) / np.log(2.0)
    flight = _R / -_Z0  # without a well
    here = sa.escape_time(family.bind(z0=_Z0), noise, _R, log=True)
    free = float(np.interp(-np.log(2.0 * flight), -here, noise))
    half[(noise >= free) | (half < 1e-9)] = np.nan
    axes, eps = figure.subplots(), np.geomspace(1e-5, 0.05, 200)
    axes.plot(half, noise * np.sqrt(half), BLUE, label="held to the fold with probability 1/2")
    axes.plot(eps, free * np.sqrt(eps), "--", color=RED, label="$T$ twice that of the ideal switch")
    axes.plot(eps, np.sqrt(-eps / np.log(eps)), ":", color=INK, label="the paper's threshold")

    def end(e: float, k: float) -> str:
        """What becomes of the block."""
        found = _released(k, e)
        if found.mean < 2.0 * flight:
            return "passes"
        # Past the fold it still takes its way to r.
        stuck = found.z.cdf(_FOLD - e * _R / -_FOLD) > 0.5
        return "sticks to the fold" if stuck else "escapes by noise"

    scenes = [(e, k) for e in np.geomspace(3e-5, 0.03, 4) for k in np.geomspace(0.05, 1.6, 4)]
    ends = np.array([end(float(e), float(k)) for e, k in scenes])
    for name, marker, color, x, y, turned in (
        ("passes", "x", RED, 0.1, 0.93, 0),
        ("escapes by noise", "o", TEAL, 0.27, 0.16, 32),
        ("sticks to the fold", "s", BLUE, 0.62, 0.1, 0),
    ):
        e, k = np.array(scenes)[ends == name].T
        axes.plot(e, k * np.sqrt(e), marker, color=shade(color, 0.8), fillstyle="none",
                  markersize=5, label=f"computed: {name}")  # fmt: skip
        axes.text(x, y, name, transform=axes.transAxes, ha="center", rotation=turned, color=FAINT)
    axes.set(
        xscale="log", yscale="log", xlabel=r"$\varepsilon$", ylabel=r"$\kappa_p$",
        xlim=(1e-5, 0.05), ylim=(1e-4, 1.0),
    )  # fmt: skip
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
