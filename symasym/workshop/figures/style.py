"""Shared by the figures: the style, arrows along curves, the layer's band, and files."""

from __future__ import annotations

from importlib import resources
from io import BytesIO
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.inputs import choice

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Kinds of file that `encode` writes.
KINDS = ("png", "svg", "pdf")
INK, FAINT = "0.1", "0.55"
#: The colours of the style, from dark to light.
BLUE, RED, TEAL, OCHRE = "#20409A", "#BC3638", "#2E90A8", "#D29400"
SURFACE: dict[str, Any] = {"linewidth": 2.0, "solid_capstyle": "butt", "zorder": 3, "color": INK}


def encode(figure: Figure, kind: str) -> bytes:
    """The figure as the bytes of a file, the same in every run, its label as a description."""
    caption = str(figure.get_label()) or None
    undated: dict[str, dict[str, str | None]] = {
        "png": {"Software": None} | ({"Description": caption} if caption else {}),
        "svg": {"Date": None, "Creator": None, "Description": caption},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None, "Subject": caption},
    }
    buffer = BytesIO()
    with style():
        figure.savefig(buffer, format=choice("kind", kind, KINDS), metadata=undated[kind])
    return buffer.getvalue()


def style() -> Any:
    """Our style over matplotlib's defaults, so that the user's own settings do not enter."""
    from matplotlib import style

    with resources.as_file(resources.files("symasym") / "symasym.mplstyle") as path:
        return style.context(["default", path])


def new_figure(width: float, height: float, caption: str) -> Figure:
    """An empty figure whose label is its caption; call it inside `style`."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    figure.set_label(caption)
    return figure


def shade(color: str, share: float) -> Any:
    """A colour with this share of its light (below 1), or with white mixed in (above)."""
    from matplotlib.colors import to_rgb

    if share <= 1:
        return tuple(share * part for part in to_rgb(color))
    return tuple(part + (share - 1) * (1 - part) for part in to_rgb(color))


def arrow(axes: Axes, path: Any, color: Any, share: float = 0.5) -> None:
    """An arrowhead on a path of shape (n, 2), at this share of its length as it is seen."""
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    seen = (path - low) / (high - low)
    kept = ((seen >= 0) & (seen <= 1)).all(axis=1)
    if kept.sum() < 2:
        return
    path, seen = path[kept], seen[kept]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
    at = share * length[-1]
    # The head points along a short chord, which is longer than a pixel on every figure.
    begin, end = ([np.interp(s, length, path[:, k]) for k in (0, 1)] for s in (at - 0.01, at))
    headed(axes, begin, end, color, 0.8, (0.42, 0.2), 4)


def headed(
    axes: Axes,
    begin: Any,
    end: Any,
    color: Any,
    width: float,
    head: tuple[float, float] = (0.5, 0.24),
    zorder: int = 5,
) -> None:
    """A straight arrow between two points in data units, with a head of this length and width."""
    line: dict[str, Any] = {"color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    line["arrowstyle"] = "-|>,head_length={},head_width={}".format(*head)
    axes.annotate("", tuple(end), tuple(begin), arrowprops=line, zorder=zorder)


def layer_band(axes: Axes, horizontal: bool) -> None:
    """The layer |u| <= 1 as a grey band across the axes."""
    (axes.axhspan if horizontal else axes.axvspan)(-1, 1, color="0.93", linewidth=0, zorder=0)
