"""Pictures of the docs that are not figures of the paper. ``python docs/website/pictures.py``.

expansions: what the expansions reach (docs/choose.md). law: how long a well holds
(docs/law.md).
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import symasym as sa
from symasym.workshop.style import METHODS, encode, style

ORDERS = {"laplace": 2, "uniform": 2, "strong_noise": 2, "paper": None}


def errors(x: Any, scene: Callable[[float], tuple[Any, Any]]) -> dict[str, list[float]]:
    """Relative errors of T over x by method, nan where a method gives no value."""
    found: dict[str, list[float]] = {name: [] for name in ORDERS}
    for one in x:
        drift, kappa = scene(float(one))
        exact = sa.escape_time(drift, kappa, 10, dps=25)
        for name, order in ORDERS.items():
            try:
                value = sa.escape_time(drift, kappa, 10, method=name, order=order, dps=25)
            except sa.AccuracyError:
                found[name].append(np.nan)
            else:
                found[name].append(float(abs(value / exact - 1)))
    return found


def expansions(count: int = 50) -> Any:
    """Over the noise with one well and one barrier, and over z0 through the fold."""
    from matplotlib.figure import Figure

    noise, spring = np.geomspace(0.02, 30, count), np.linspace(-1.2, -0.02, count)
    panels = (
        (noise, lambda k: (sa.friction(3, 1, "-0.4"), k), r"$\kappa$", "(a) $z_0 = -0.4$"),
        (spring, lambda z: (sa.friction(3, 1, z), "0.1"), "$z_0$", r"(b) $\kappa = 0.1$"),
    )
    with style():
        figure = Figure(figsize=(7.4, 3.9))
        axes = figure.subplots(1, 2, sharey=True)
        for place, (x, scene, name, title) in zip(axes, panels, strict=True):
            for method, row in errors(x, scene).items():
                place.semilogy(x, row, color=METHODS[method], marker=".", ms=4, label=method)
            place.set(xlabel=name, title=title, ylim=(1e-16, 30))
        axes[0].set(xscale="log", ylabel="relative error of $T$")
        axes[1].axvline(-7 / 9, color="0.6", lw=0.8)
        axes[1].annotate("fold", (-7 / 9, 1e-15), (3, 0), textcoords="offset points", color="0.4")
        handles = axes[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=4)
    return figure


def law(count: int = 40) -> Any:
    """From a well's bottom to the barrier: densities, and P(tau > t) beside e^{-rate t}."""
    from matplotlib.figure import Figure

    well = sa.Drift("u - u**3", layer=None)
    with style():
        figure = Figure(figsize=(7.4, 3.9))
        left, right = figure.subplots(1, 2)
        early, late = np.geomspace(0.05, 200, 2 * count), np.linspace(0, 8, count // 3)
        for kappa, look, color in (("0.5", "-", "C0"), ("0.7", "--", "C1"), ("1", "-.", "C2")):
            found = sa.exit_law(well, kappa, ends=(-2, 0), start=-1, dps=12)
            name = rf"$\kappa = {kappa}$"
            left.plot(early, early * found.pdf(early), color + look, label=name)
            left.plot(float(found.mean), 0, color + "^", clip_on=False, ms=6, zorder=3)
            right.semilogy(late, found.survival(late), color + look, label=name)
            right.semilogy(late, np.exp(-float(found.rate) * late), color=color, lw=0.8)
        left.set(xscale="log", xlabel="$t$", title=r"(a) density of $\log \tau$", ylim=(0, None))
        right.set(xlabel="$t$", title=r"(b) $P(\tau > t)$", ylim=(0.01, 1.2))
        left.plot([], [], "^", color="0.4", ms=6, label="mean")
        left.plot([], [], color="0.4", lw=0.8, label=r"$e^{-\lambda_1 t}$ (thin)")
        handles = left.get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=5)
    return figure


PICTURES = {"expansions": expansions, "law": law}

if __name__ == "__main__":
    for name, draw in PICTURES.items():
        file = Path(__file__).parent.parent / "images" / f"{name}.png"
        file.write_bytes(encode(draw(), "png"))
