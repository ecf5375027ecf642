"""Work-precision diagrams and growth, in the package's style."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from symasym.workshop.figures.style import style
from symasym.workshop.report.measure import MOST, Cell, Point, columns
from symasym.workshop.report.timing import Grown, in_tex

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# One colour and mark a method, the same in all panels.
_LOOKS: dict[str, tuple[str, str]] = {
    "exact": ("#0072B2", "o"),
    "exact, arrays": ("#003F66", "v"),
    "laplace": ("#D55E00", "^"),
    "uniform": ("#E69F00", ">"),
    "strong_noise": ("#009E73", "D"),
    "paper": ("#000000", "*"),
    "auto": ("#AA3377", "P"),
    "mpmath.quad": ("#000000", "x"),
    "dblquad": ("#8B0000", "+"),
    "Arb": ("#3B3B98", "1"),
    "PARI": ("#5B2C00", "2"),
}
# The peers' marks, which have no inside: larger and bolder.
_LINES = ("x", "+", "1", "2")
_BOLD = {"markersize": 9, "markeredgewidth": 2.0}
_FARTHEST = 1e-70


def work_precision(points: list[Point]) -> Figure:
    """Error on x, seconds on y, a panel a scene."""
    from matplotlib.figure import Figure

    scenes = list(dict.fromkeys(p.scene for p in points))
    # As wide as a column of text, so that its own text is as large.
    columns = min(2, len(scenes))
    rows = math.ceil(len(scenes) / columns)
    with style():
        figure = Figure(figsize=(7.4, 2.5 * rows + 1.0))
        panels = figure.subplots(rows, columns, squeeze=False, sharey=True).ravel()
        for axes, scene in zip(panels, scenes, strict=False):
            _panel(axes, [p for p in points if p.scene == scene], scene)
        for axes in panels[len(scenes) :]:
            axes.set_visible(False)
        for k, axes in enumerate(panels[: len(scenes)]):
            if k % columns == 0:
                axes.set_ylabel("seconds")
            axes.set_xlabel("relative error of T")
        used = {p.method for p in points if p.error is not None}
        handles = [_handle(name) for name in _LOOKS if name in used]
        figure.legend(handles=handles, loc="outside lower center", ncols=min(5, len(handles)))
        return figure


def _handle(name: str) -> Any:
    """A method's entry in the legend."""
    from matplotlib.lines import Line2D

    color, mark = _LOOKS[name]
    bold = _BOLD if mark in _LINES else {"markersize": 5}
    width = 0 if mark in _LINES else 1
    return Line2D([], [], color=color, marker=mark, linewidth=width, label=name, **bold)


def _panel(axes: Axes, points: list[Point], title: str) -> None:
    """Draw the points of one scene."""
    axes.set(title=title, xscale="log", yscale="log")
    for name, (color, mark) in _LOOKS.items():
        own = [p for p in points if p.method == name and p.error is not None]
        own.sort(key=lambda p: p.error or 0.0)
        if not own:
            continue
        x = [max(p.error or 0.0, _FARTHEST) for p in own]
        y = [p.seconds or 0.0 for p in own]
        axes.plot(x, y, color=color, linewidth=0.8, alpha=0.7)
        for p, a, b in zip(own, x, y, strict=True):
            filled = p.claimed is not None or mark in _LINES
            face = color if filled else "white"
            bold = _BOLD if mark in _LINES else {"markersize": 5}
            axes.plot([a], [b], marker=mark, color=color, markerfacecolor=face, **bold)
            if p.below_reference or (p.error or 0.0) < _FARTHEST:
                axes.plot([a], [b], marker=8, color=color, markersize=5)
    axes.set_xlim(_FARTHEST / 30, 1e3)
    axes.set_xticks([1e-60, 1e-40, 1e-20, 1])
    axes.minorticks_off()
    axes.grid(True, color="0.92", linewidth=0.6)


def growth(grown: list[Grown]) -> Figure:
    """Seconds against digits, lam and the number of points."""
    from matplotlib.figure import Figure

    labels = {"digits": "digits", "lam": r"$\lambda = 2/\kappa^2$", "points": "points"}
    axes_of = list(dict.fromkeys(g.along for g in grown))
    with style():
        figure = Figure(figsize=(3.3 * len(axes_of), 3.3))
        panels = figure.subplots(1, len(axes_of), squeeze=False)[0]
        for axes, axis in zip(panels, axes_of, strict=True):
            own = [g for g in grown if g.along == axis]
            marks = ("o", "s", "^", "D")
            for mark, name in zip(marks, dict.fromkeys(g.method for g in own), strict=False):
                part = [g for g in own if g.method == name]
                axes.plot([g.at for g in part], [g.seconds for g in part], marker=mark,
                          markersize=4, label=in_tex(name))  # fmt: skip
            axes.set(xscale="log", yscale="log", xlabel=labels[axis], ylabel="seconds")
            low, high = (math.log10(y) for y in axes.get_ylim())
            # Whole decades, and room for the names above the curves.
            axes.set_ylim(10 ** math.floor(low), 10 ** math.ceil(high + 0.45 * (high - low)))
            if axis == "digits":
                counts = sorted({g.at for g in own})
                axes.set_xticks(counts, [f"{x:g}" for x in counts])
            axes.legend(loc="upper left", fontsize=8)
            axes.minorticks_off()
            axes.grid(True, color="0.92", linewidth=0.6)
        return figure


def heat_maps(cells: list[Cell]) -> Figure:
    """A panel a method: digits claimed and digits true, a row a scene."""
    from matplotlib.colors import Normalize
    from matplotlib.figure import Figure

    scenes = list(dict.fromkeys(c.scene for c in cells))
    methods = columns(cells)
    across = min(7, len(methods))
    down = math.ceil(len(methods) / across)
    by_key = {(c.scene, c.method, c.setting): c for c in cells}
    with style():
        figure = Figure(figsize=(1.9 + 0.85 * across, 0.9 + down * (0.9 + 0.22 * len(scenes))))
        panels = figure.subplots(down, across, squeeze=False, sharey=True).ravel()
        norm = Normalize(0, MOST)
        for axes in panels[len(methods) :]:
            axes.set_visible(False)
        for axes, key in zip(panels, methods, strict=False):
            own = [by_key.get((scene, *key)) for scene in scenes]
            pairs = [
                [math.nan if c is None or x is None else max(x, 0.0) for x in _pair(c)] for c in own
            ]
            image = axes.imshow(pairs, aspect="auto", norm=norm, cmap="viridis")
            for row, (cell, pair) in enumerate(zip(own, pairs, strict=True)):
                _write(axes, row, cell, pair)
            axes.set_title(f"{key[0]}\n{key[1]}".replace(", ", ",\n"), fontsize=8, loc="center")
            axes.set_xticks([0, 1], ["claimed", "true"], rotation=90, fontsize=8)
            axes.set_yticks(range(len(scenes)), scenes, fontsize=8)
            axes.tick_params(length=0)
            axes.set_facecolor("0.93")
            for spine in axes.spines.values():
                spine.set_visible(False)
        bar = figure.colorbar(
            image, ax=list(panels), location="bottom", pad=0.02, fraction=0.02, aspect=50
        )
        bar.set_label("digits")
        return figure


def _pair(cell: Cell | None) -> tuple[float | None, float | None]:
    """Digits claimed and digits true."""
    return (None, None) if cell is None else (cell.claimed, cell.true)


def _write(axes: Axes, row: int, cell: Cell | None, pair: list[float]) -> None:
    """Write the digits of a cell, framed where more are claimed than are true."""
    from matplotlib.patches import Rectangle

    for column, digits in enumerate(pair):
        if math.isfinite(digits):
            dark = digits < 0.6 * MOST
            text = f"{digits:.0f}" if digits < MOST else f"≥{MOST:.0f}"
            axes.text(column, row, text, ha="center", va="center", fontsize=8,
                      color="white" if dark else "black")  # fmt: skip
        elif cell is not None:
            # Refused, stopped or without a claim.
            axes.text(column, row, "–", ha="center", va="center", fontsize=8, color="0.5")
    if cell is not None and cell.wrong:
        axes.add_patch(
            Rectangle((-0.48, row - 0.46), 1.96, 0.92, fill=False, edgecolor="red", linewidth=1.3)
        )
