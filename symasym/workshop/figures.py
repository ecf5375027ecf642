"""The paper's figures by name, computed from the model, and further figures of the escape time.

fric1 and fric2 show the exact escape time with z frozen and the paper's formula against z0, stokes
the step and the uniform approximation near the fold. As the belt moves z while the block sticks,
release shows paths, and the place and time of the release, and regimes the regimes of release.
"""

from __future__ import annotations

from fractions import Fraction
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

import symasym as sa
from symasym.workshop import oscillator, style
from symasym.workshop.style import BLUE, FAINT, INK, OCHRE, RED, TEAL, shade

__all__ = ["DRAWN", "EPS", "FIGURES", "KINDS", "R", "encode", "oscillator"]

FIGURES, KINDS, encode = style.FIGURES, style.KINDS, style.encode
# The paper's physical values of eps, kappa and r.
EPS, R = "0.01", "0.1"
KAPPAS = {"0.01": BLUE, "0.02": RED, "0.05": TEAL, "0.1": OCHRE}
MUS = {"1/2": BLUE, "1": RED, "2": TEAL, "3": OCHRE}
#: (mu, kappa) of every curve in fric1 and fric2.
DRAWN = *product(("3", "1/2"), KAPPAS), ("1", "0.01"), ("2", "0.01")
# The moving block, in scaled variables except eps.
_Z0, _R, _EPS, _FOLD = -0.4, 10.0, 0.01, -7 / 9
_NOISES = {0.1: BLUE, 0.2: RED, 0.3: TEAL}
_EXACT: dict[str, Any] = {"linewidth": 2.4}
_PAPER: dict[str, Any] = {"linewidth": 1.4, "linestyle": (0, (1.0, 1.5))}


class _Curve(NamedTuple):
    """log T against z0, exact and by the paper's formula, in pieces between its jumps."""

    label: str
    hue: str
    fold: float  # nan without one
    exact: Any
    pieces: list[Any]


def _curve(mu: str, kappa: str, label: str, hue: str) -> _Curve:
    """The curve of the paper's oscillator."""
    scales, family = sa.rescale(EPS, kappa, R), sa.friction(mu, 1)
    shape = float(Fraction(mu))
    fold = sa.formula("folds").lambdify("numpy")(shape, 1) if shape > 0.5 else np.nan
    z0 = -2.0 * np.linspace(1.0, 0.05, 120) ** 2
    sides = [z0]
    if not np.isnan(fold):
        z0 = np.union1d(z0, fold + np.linspace(-0.15, min(0.15, -0.005 - fold), 31))
        # On the right of the fold the formula diverges like (z0 - fold)^(-1/2).
        right = np.union1d(z0[z0 > fold + 1e-4], fold + np.geomspace(1e-4, 2e-2, 40))
        sides = [np.append(z0[z0 < fold - 1e-9], fold - 1e-9), right[right < 0]]

    def at(z: Any, method: Any) -> Any:
        of = family.bind(z0=z)
        return z, sa.escape_time(of, scales.kappa, scales.r, method=method, log=True)

    return _Curve(label, hue, fold, at(z0, "exact"), [at(z, "paper") for z in sides])


def _draw(axes: Axes, curves: list[_Curve]) -> None:
    """Draw each curve in one hue, with the formula darker so that it shows on top."""
    for c in curves:
        axes.plot(*c.exact, color=shade(c.hue, 1.45), **_EXACT)
        for piece in c.pieces:
            axes.plot(*piece, color=shade(c.hue, 0.7), **_PAPER)


def _panel(axes: Axes, title: str, curves: list[_Curve]) -> None:
    """Draw all curves with their names at the right end, moved apart so that none overlap."""
    curves = sorted(curves, key=lambda c: c.exact[1][-1])
    _draw(axes, curves)
    logs = np.concatenate([c.exact[1] for c in curves])
    low, high = logs.min() - 0.03 * np.ptp(logs), logs.max() + 0.03 * np.ptp(logs)
    axes.set(xlim=(-2, 0), ylim=(low, high), xlabel="$z_0$", ylabel=r"$\log T$", title=title)
    placed = -1.0
    for c in curves:
        height = (c.exact[1][-1] - low) / (high - low)
        placed = max(height, placed + 0.065)
        axes.annotate(
            c.label, (1.0, height), (1.06, placed), "axes fraction", va="center",
            color=shade(c.hue, 0.8), annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": c.hue, "linewidth": 0.7},
        )  # fmt: skip


def _at_fold(axes: Any, height: float) -> None:
    """Mark the fold, and name it at a height between 0 and 1."""
    axes.axvline(_FOLD, color=INK, linewidth=0.6, linestyle=":")
    axes.text(_FOLD, height, " fold", color="0.4", transform=axes.get_xaxis_transform())


def _inset(axes: Axes, curves: list[_Curve], width: float, ticks: Any) -> None:
    """Draw an inset of the region left of the folds, where the curves are low, and the legend."""
    folds, levels = zip(
        *((c.fold, c.pieces[0][1][-1]) for c in curves if len(c.pieces) > 1), strict=True
    )
    inset = axes.inset_axes((0.14, 0.4, width, 0.5))
    _draw(inset, curves)
    # The formula jumps by about 1 on this scale for any noise.
    inset.set(
        xlim=(min(folds) - 0.15, min(max(folds) + 0.15, 0)),
        ylim=(min(levels) - 0.55, max(levels) + 2.25), xticks=ticks,
    )  # fmt: skip
    inset.xaxis.set_major_formatter("{x:.2f}")
    inset.tick_params(labelsize="small")
    inset.spines[["top", "right"]].set_visible(True)
    zoom = axes.indicate_inset_zoom(inset, edgecolor="0.5")
    # At most one leader line, as others would cross the tick labels or the curves.
    for corner, line in enumerate(zoom.connectors or ()):
        line.set_visible(corner == 2 and len(set(folds)) == 1)
    looks = ("exact", "0.65", _EXACT), ("paper's formula", INK, _PAPER)
    handles = [Line2D([], [], color=color, label=name, **look) for name, color, look in looks]
    axes.figure.legend(handles=handles, loc="outside lower center", ncols=2)


@style.figure("fric1", 7.4, 3.8)
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
        _panel(axes, rf"({number})  $\mu = {mu}$", curves)
        if mu == "3":
            _inset(axes, curves, 0.47, _FOLD + np.array([-0.1, 0, 0.1]))


@style.figure("fric2", 5.4, 4.1)
def fric2(figure: Figure) -> None:
    """The escape time with z frozen at z0, for several mu at small noise (Fig. fric2).

    Logarithm of the mean escape time with the spring extension frozen at z0, alpha = 1, eps = 0.01,
    r = 0.1: the exact integral (solid) and the paper's leading-order formula (dotted), kappa_p =
    0.01, for the mu beside the curves. The inset magnifies the folds, marked on its axis, at which
    the formula jumps: its Stokes discontinuities.
    """
    curves = [_curve(mu, "0.01", rf"$\mu = {mu}$", hue) for mu, hue in MUS.items()]
    axes = figure.subplots()
    _panel(axes, r"$\kappa_p = 0.01$", curves)
    _inset(axes, curves, 0.45, [c.fold for c in curves[1:]])


@style.figure("stokes", 5.4, 6.2)
def stokes(figure: Figure) -> None:
    """The escape time against z0 where the friction oscillator's well is born.

    A well is born at z0 = -0.7778 (mu = 3, kappa = 0.1, r = 10; dotted line): the escape time with
    z frozen (a), the Stokes multiplier (b), and relative errors of the escape time (c).
    """
    z0 = _FOLD + np.linspace(-0.2, 0.2, 51)
    drift, step = sa.friction(3, 1).bind(z0=z0), np.abs(z0 - _FOLD) < 1e-9
    times, shares, errors = figure.subplots(3, 1, sharex=True)
    exact = sa.escape_time(drift, 0.1, 10)
    times.semilogy(z0, exact, color=INK, linewidth=3.2, label="exact")
    for label, method, order, color, dashes in (
        ("step (the paper)", "paper", None, BLUE, "-."),
        ("uniform, order 0", "uniform", 0, TEAL, "-"),
        ("uniform, order 1", "uniform", 1, OCHRE, "-"),
        ("uniform, order 2", "uniform", 2, shade(OCHRE, 0.5), "-"),
    ):
        found: Any = sa.escape_time(drift, 0.1, 10, method=method, order=order)  # type: ignore[arg-type]
        found[step & (method == "paper")] = np.nan  # a gap, not a line, at the step
        if not order:
            times.semilogy(z0, found, dashes, color=color, label=label)
        errors.semilogy(z0, np.abs(found / exact - 1), dashes, color=color, label=label)
    ends = [z0[0], _FOLD, _FOLD, z0[-1]], [0, 0, 1, 1]
    shares.plot(*ends, "-.", color=BLUE, label="step (the paper)")
    shares.plot(z0, sa.stokes_multiplier(drift, 0.1), color=TEAL, label="uniform")
    for axes, name, title in (
        (times, "$T$", "(a)  escape time"), (shares, "", "(b)  Stokes multiplier"),
        (errors, "relative error", "(c)  error of the escape time"),
    ):  # fmt: skip
        axes.set(title=title, ylabel=name)
        _at_fold(axes, 0.05)
        plain: Any = {"frameon": True, "framealpha": 1, "edgecolor": "none"}
        axes.legend(loc="upper left", ncols=1 + (axes is errors), **plain)
    errors.set(xlabel="$z_0$", ylim=(1e-13, 1e6))


def _released(kappa: float, eps: float = _EPS) -> Any:
    return sa.release(sa.oscillator(3, 1), kappa, _R, eps=eps, start=(0, _Z0), rtol=1e-3)


def _paths() -> Any:
    """z and u on three simulated paths for each noise, with steps of 0.01."""
    normal, step = np.random.default_rng(5).standard_normal, 0.01
    u, z, rows = np.zeros((3, 3)), np.full((3, 3), _Z0), []
    while (stays := np.abs(u) < _R).any():
        rows.append((z, u))
        inside = np.clip(u, -1, 1)
        phi = 1 - z - _EPS * u - inside - 3 * (inside - inside**3)
        moved = step * phi + np.array([*_NOISES])[:, None] * np.sqrt(step) * normal(3)
        u, z = u + stays * moved, z + stays * step * _EPS * (_EPS * u - 1)
    return np.array(rows[::4]).transpose(2, 1, 0, 3)


@style.figure("release", 7.2, 5.4)
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
    for (kappa, color), path in zip(_NOISES.items(), _paths(), strict=True):
        plane.plot(*path, color=color, linewidth=0.35, alpha=0.8)
        place = _released(kappa).z
        z = np.linspace(place.quantile(1e-4), place.quantile(1 - 1e-4), 300)
        density = np.diff(place.cdf(z)) / np.diff(z)
        law.plot((z[1:] + z[:-1]) / 2, density, color=color, label=rf"$\kappa = {kappa}$")
    _at_fold(plane, 0.05)
    _at_fold(law, 0.9)
    plane.set(xlabel="$z$", ylabel="$u$", title="(a)  paths")
    plane.set(xlim=(-1.02, -0.35), ylim=(-0.2, 2.2))
    law.set(xlabel="$z$ at release", ylabel="density", title="(b)  place of release")
    law.set_xlim(right=_Z0)
    law.legend(loc="upper right")
    plane.legend(*law.get_legend_handles_labels(), loc="upper left")
    # Weak noise takes the most time and changes the least.
    fine, some = np.geomspace(0.05, 2.0, 200), np.geomspace(0.05, 2.0, 25)[[0, 2, 4, *range(6, 25)]]
    looks: dict[Any, Any] = {
        "exact": (RED, "--", "frozen, exact"),
        "paper": (OCHRE, (0, (1.0, 1.7)), "frozen, paper's formula"),
    }
    for method, (color, dashes, label) in looks.items():
        logs = sa.escape_time(sa.friction(3, 1, _Z0), fine, _R, method=method, log=True)
        times.plot(fine, np.exp(np.minimum(logs, 600)), color=color, ls=dashes, label=label)
    means = [_released(k).mean for k in some.tolist()]
    times.plot(some, means, color=BLUE, label="moving")
    times.set(
        xscale="log", yscale="log", xlabel=r"$\kappa$ (scaled)", ylabel="mean time",
        ylim=(5, 30 * means[0]), title="(c)  time of release, $z$ frozen or moving",
    )  # fmt: skip
    times.legend(loc="upper right", fontsize="small", handlelength=1.7)


@style.figure("regimes", 5.4, 4.6)
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

    scenes = [(e, k) for e in np.geomspace(3e-5, 0.03, 4) for k in np.geomspace(0.05, 1.6, 4)]
    ends = []
    for e, k in scenes:
        found = _released(float(k), float(e))
        # Past the fold it still takes time to reach r.
        stuck = found.z.cdf(_FOLD - e * _R / -_FOLD) > 0.5
        ends.append(0 if found.mean < 2.0 * flight else 2 if stuck else 1)
    for number, (name, marker, color, x, y, turned) in enumerate((
        ("passes", "x", RED, 0.1, 0.93, 0),
        ("escapes by noise", "o", TEAL, 0.27, 0.16, 32),
        ("sticks to the fold", "s", BLUE, 0.62, 0.1, 0),
    )):  # fmt: skip
        e, k = np.array(scenes)[np.equal(ends, number)].T
        axes.plot(e, k * np.sqrt(e), marker, color=shade(color, 0.8), fillstyle="none",
                  markersize=5, label=f"computed: {name}")  # fmt: skip
        axes.text(x, y, name, transform=axes.transAxes, ha="center", rotation=turned, color=FAINT)
    axes.set(
        xscale="log", yscale="log", xlabel=r"$\varepsilon$", ylabel=r"$\kappa_p$",
        xlim=(1e-5, 0.05), ylim=(1e-4, 1.0),
    )  # fmt: skip
    figure.legend(loc="outside lower center", ncols=2, fontsize="small")
