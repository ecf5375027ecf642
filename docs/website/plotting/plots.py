"""Formulas of the paper against the exact values, drawn when the site is built."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from importlib import resources
from typing import Any

import numpy as np

from derivations.runner import slug
from symasym.workshop.figures import encode

Curve = Callable[[Any], Any]
# An error that is nowhere larger is that of rounding, stated and not drawn.
_ROUNDING = 1e-9
# Below this a relative error of float64 is noise.
_NOISE = 1e-14
# Where a relative error is larger, the logarithm of the quotient is drawn in its place.
_FAR = 1e3


@dataclass(frozen=True)
class Plot:
    """One formula: the quantity, both curves over x, and what is said of them.

    With `logs` the curves are natural logarithms and the error is relative; without, the error is
    that over the largest value. `by` says of both curves, where they agree, how they are computed,
    and so does the title, after "exact: ", of the first.
    """

    label: str
    quantity: str
    title: str
    x: Any
    exact: Curve
    formula: Curve
    axis: str = "κ, scaled"
    logs: bool = True
    log_x: bool = True
    by: tuple[str, str] = ("in another way", "by the formula")

    def values(self) -> tuple[Any, Any, Any]:
        """Over x: what is exact, the formula, and its error."""
        return self._values

    @cached_property
    def _values(self) -> tuple[Any, Any, Any]:
        exact, formula = self.exact(self.x), self.formula(self.x)
        return exact, formula, self._error(exact, formula)

    def agrees(self) -> bool:
        """True where the error is that of rounding."""
        return bool(np.max(self.values()[2]) < _ROUNDING)

    def error(self) -> Any:
        """The formula's error over x."""
        return self.values()[2]

    def _error(self, exact: Any, formula: Any) -> Any:
        if self.logs:
            return np.abs(np.expm1(formula - exact))
        return np.abs(formula - exact) / np.max(np.abs(exact))


@dataclass(frozen=True)
class Picture:
    """What a label defines, where there is no number to compare it with.

    `what` says in words what is seen, and `paint` draws it on axes.
    """

    label: str
    what: str
    paint: Callable[[Any], None]


def files(plots: Iterable[Plot | Picture]) -> dict[str, str]:
    """File name -> SVG."""
    return {f"formulas/{slug(plot.label)}.svg": draw(plot) for plot in plots}


def draw(plot: Plot | Picture) -> str:
    """Formula and exact value above, the formula's error, if it has one, below; or the picture."""
    from matplotlib import style
    from matplotlib.figure import Figure

    with style.context(str(resources.files("symasym").joinpath("symasym.mplstyle"))):
        if isinstance(plot, Picture):
            figure = Figure(figsize=(6.4, 4.2))
            plot.paint(figure.subplots())
            return _written(figure)
        unit = np.log(10) if plot.logs else 1.0
        values, formula, error = plot.values()
        exact = plot.agrees()
        figure = Figure(figsize=(6.4, 3.4 if exact else 5.2))
        above, *below = np.atleast_1d(figure.subplots(1 if exact else 2, 1, sharex=True))
        title, names = plot.title, ("exact", "formula")
        if exact:
            title, _, way = title.partition("; exact: ")
            names = (way or plot.by[0], plot.by[1])
        above.plot(plot.x, values / unit, label=names[0])
        # Of two curves that coincide one is drawn as circles.
        drawn = {"ls": "none", "marker": "o", "mfc": "none", "markevery": len(plot.x) // 24 or 1}
        above.plot(plot.x, formula / unit, **(drawn if exact else {"ls": "--"}), label=names[1])
        named = f"({plot.quantity})" if re.search("^-| - |/", plot.quantity) else plot.quantity
        name = f"log₁₀ {named}" if plot.logs else plot.quantity
        above.set(ylabel=name, title=title)
        above.set(xscale="log" if plot.log_x else "linear")
        above.legend()
        if exact:
            most = np.max(error)
            first, power = f"{most:.0e}".split("e")
            of = f"relative difference of {plot.quantity}"
            if not plot.logs:
                of = f"difference of {plot.quantity} over its largest value"
            within = rf"both agree: {of} at most ${first} \times 10^{{{int(power)}}}$"
            said = within if most else "both agree in every digit"
            above.set(xlabel=f"{plot.axis}\n{said}")
        else:
            if plot.logs and np.max(error) > _FAR:
                below[0].plot(plot.x, (formula - values) / unit, "k-")
                over = "log₁₀ of formula over exact"
            else:
                below[0].semilogy(plot.x, np.where(error > _NOISE, error, np.nan), "k-")
                over = "relative error" if plot.logs else "error, over the largest value"
            below[0].set(xlabel=plot.axis, ylabel=over)
        return _written(figure)


def _written(figure: Any) -> str:
    """SVG of a figure, its texts typeset, its logarithmic axes with few labels."""
    from matplotlib.text import Text

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() == "log":
                _few_labels(axis)
    for text in figure.findobj(Text):
        text.set_text(typeset(text.get_text()))
    return encode(figure, "svg").decode()


def _few_labels(axis: Any) -> None:
    """Labels at 1, 2 and 5 at most between powers of ten, which stand too close otherwise."""
    from matplotlib.ticker import LogFormatterSciNotation, LogLocator

    low, high = axis.get_view_interval()
    if low > 0 and high / low < 200:
        axis.set_minor_locator(LogLocator(subs=(2, 5)))
        axis.set_minor_formatter(LogFormatterSciNotation(minor_thresholds=(np.inf, np.inf)))


def typeset(text: str) -> str:
    """Text of a figure with minus signs, and e^(lam V) and powers of lam as they are written."""
    text = re.sub(r"(?<![^\s(=])-(?=[\s\w∫])", "−", text)
    text = re.sub(r"([eλ])\^(?:\(([^()]*)\)|(-?\d+))", _raised, text)
    return text


def _raised(found: re.Match[str]) -> str:
    base, power = (part.replace("λ", r"\lambda ") for part in (found[1], found[2] or found[3]))
    return rf"${base}^{{{power}}}$"
