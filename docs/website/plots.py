"""Formulas of the paper against the exact values, drawn when the site is built."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import resources
from typing import Any

import numpy as np

import symasym as sa
from derivations.runner import slug
from symasym.figures import encode
from symasym.generated import numpy_formulas


@dataclass(frozen=True)
class Plot:
    """One formula: the quantity, its scene, the range of kappa in powers of ten, and the formula.

    Without `emitted`, the formula is what ``method="paper"`` evaluates.
    """

    label: str
    quantity: str
    verb: str
    scene: tuple[Any, ...]
    powers: tuple[float, float]
    complement: bool = False
    title: str = ""
    emitted: Callable[[Any], Any] | None = None

    def exact(self, kappa: Any, method: str = "exact") -> Any:
        """The natural logarithm of the quantity at these kappa."""
        options: dict[str, Any] = {"method": method, "log": True}
        if self.complement:
            options["complement"] = True
        drift, *rest = self.scene
        return getattr(sa, self.verb)(drift, kappa, *rest, **options)

    def formula(self, kappa: Any) -> Any:
        """The same by the formula."""
        return np.log(self.emitted(kappa)) if self.emitted else self.exact(kappa, "paper")


def _plots() -> tuple[Plot, ...]:
    friction = sa.friction(mu=3, alpha=1, z0="-0.4")
    sliding = sa.linear(a_minus=1, a_plus=-1)
    oscillator = "friction, μ = 3, α = 1, z₀ = -0.4"
    strong = partial(numpy_formulas.strong_noise_occupation, a_minus=1, a_plus=-1)
    # A = -u - u^3/2, so that V = u^2/2 + u^4/8 - 5/8.
    cubic = sa.polynomial(0, -1, 0, "-1/2")
    well = {"V1": 0, "V_well": -0.625, "curvature": 1}
    weak = partial(numpy_formulas.weak_noise_outside, a_minus=1.5, a_plus=-1.5, **well)
    line = "linear, a⁻ = 1, a⁺ = -1"
    return (
        Plot("eq:Ttildesmall", "T", "escape_time", (friction, 10), (-1, 0.3), title=oscillator),
        Plot(
            "eq:Ttildelarge",
            "T",
            "escape_time",
            (sa.friction(mu=3, alpha=1, z0=-1), 10**4),
            (-1, 1.5),
            title="friction, μ = 3, α = 1, z₀ = -1 (no well)",
        ),
        Plot("C-bound", "C", "exit_probability", (friction, 10), (-0.5, 0.2), title=oscillator),
        Plot("eq:Plarge2", "P", "occupation", (sliding,), (0, 2), title=line, emitted=strong),
        Plot("eq:Psmall2", "1 - P", "occupation", (cubic,), (-1, 0.3), True, "A = -u - u³/2", weak),
    )


def all_plots() -> tuple[str, ...]:
    """The labels that have one."""
    return tuple(plot.label for plot in _plots())


def files(labels: tuple[str, ...]) -> dict[str, str]:
    """File name -> SVG."""
    return {
        f"formulas/{slug(plot.label)}.svg": draw(plot) for plot in _plots() if plot.label in labels
    }


def draw(plot: Plot) -> str:
    """Formula and exact value above, the formula's relative error below."""
    from matplotlib import style
    from matplotlib.figure import Figure

    kappa = np.logspace(*plot.powers, 60)
    exact, formula = plot.exact(kappa), plot.formula(kappa)
    with style.context(str(resources.files("symasym").joinpath("symasym.mplstyle"))):
        figure = Figure(figsize=(6.4, 5.2))
        above, below = figure.subplots(2, 1, sharex=True)
        log10 = np.log(10)
        above.semilogx(kappa, exact / log10, label="exact")
        above.semilogx(kappa, formula / log10, "--", label=plot.label)
        above.set(ylabel=f"log₁₀ {plot.quantity}", title=plot.title)
        above.legend()
        below.loglog(kappa, np.abs(np.expm1(formula - exact)), color="black")
        below.set(xlabel="κ, scaled", ylabel="relative error of the formula")
        return encode(figure, "svg").decode()
