"""The picture of `docs/choose.md`: what each expansion states and what is true, scene by scene."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import symasym as sa
from symasym.workshop.figures.style import style

METHODS = {
    "laplace": {"order": 2},
    "uniform": {"order": 2},
    "strong_noise": {"order": 2},
    "paper": {},
}
_DPS = 25


@dataclass(frozen=True)
class Errors:
    """Relative errors of T over x; NaN where a method was refused, or states none."""

    x: Any
    true: dict[str, Any]
    stated: dict[str, Any]


def along_noise(count: int) -> Errors:
    """With one well and one barrier, kappa from 0.02 to 30."""
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    return _errors(np.geomspace(0.02, 30, count), lambda x: (drift, x))


def along_spring(count: int) -> Errors:
    """At kappa = 1/10, z0 through the fold at -7/9 towards the kink at 0."""
    return _errors(
        np.linspace(-1.2, -0.02, count), lambda x: (sa.friction(mu=3, alpha=1, z0=x), "0.1")
    )


def _errors(x: Any, scene: Callable[[float], tuple[Any, Any]]) -> Errors:
    true = {name: np.full(len(x), np.nan) for name in METHODS}
    stated = {name: np.full(len(x), np.nan) for name in METHODS}
    for k, one in enumerate(x):
        drift, kappa = scene(float(one))
        exact = sa.escape_time(drift, kappa, 10, dps=_DPS)
        for name, options in METHODS.items():
            try:
                found = sa.escape_time(
                    drift, kappa, 10, method=name, dps=_DPS, full=True, **options
                )
            except sa.AccuracyError:
                continue
            true[name][k] = abs(found.value / exact - 1)
            if found.error is not None:
                stated[name][k] = found.error / exact
    return Errors(x, true, stated)


def draw(count: int) -> Any:
    """Both as a figure: true errors solid, stated ones dotted."""
    from matplotlib.figure import Figure

    panels = (
        (
            along_noise(count),
            r"noise amplitude $\kappa$",
            "log",
            "(a) weak to strong noise, $z_0 = -0.4$",
        ),
        (along_spring(count), "$z_0$", "linear", r"(b) through the fold, $\kappa = 0.1$"),
    )
    with style():
        figure = Figure(figsize=(7.4, 3.9))
        axes = figure.subplots(1, 2, sharey=True)
        for place, (errors, name, scale, title) in zip(axes, panels, strict=True):
            for k, method in enumerate(METHODS):
                color = "black" if method == "paper" else f"C{k}"
                place.semilogy(
                    errors.x, errors.true[method], color=color, marker=".", ms=3, label=method
                )
                place.semilogy(errors.x, errors.stated[method], color=color, linestyle=":")
            place.set(xlabel=name, xscale=scale, title=title, ylim=(1e-16, 30))
        axes[0].set_ylabel("relative error of $T$")
        axes[1].axvline(-7 / 9, color="0.6", lw=0.8)
        axes[1].annotate("fold", (-7 / 9, 1e-15), (3, 0), textcoords="offset points", color="0.4")
        figure.legend(
            *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=len(METHODS)
        )
        return figure
