"""Style, captions and files of the figures, and arrows along curves."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from importlib import resources
from io import BytesIO
from typing import Any

import matplotlib.style
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

#: Kinds of file that `encode` writes.
KINDS = ("png", "svg", "pdf")
INK, FAINT = "0.1", "0.55"
#: The colours of the style, from dark to light.
BLUE, RED, TEAL, OCHRE = "#20409A", "#BC3638", "#2E90A8", "#D29400"
#: The colour of a method wherever several are compared; other programs are grey.
METHODS = {"exact": INK, "laplace": BLUE, "uniform": RED, "strong_noise": TEAL, "paper": OCHRE}


#: Every figure by name; its caption is its label, ``figure.get_label()``.
FIGURES: dict[str, Callable[[], Figure]] = {}


def figure(name: str, width: float, height: float) -> Callable[[Callable[[Figure], None]], None]:
    """Turn a function that draws on an empty figure into one that returns the styled figure.

    The caption is the second paragraph of its docstring.
    """

    def drawn(draw: Callable[[Figure], None]) -> None:
        @wraps(draw)
        def make() -> Figure:
            with style():
                new = Figure(figsize=(width, height))
                new.set_label(" ".join(str(draw.__doc__).partition("\n\n")[2].split()))
                draw(new)
            return new

        FIGURES[name] = make

    return drawn


def encode(figure: Figure, kind: str) -> bytes:
    """The figure as the bytes of a file, identical in every run, with its label as description."""
    caption = str(figure.get_label()) or None
    undated: dict[str, dict[str, str | None]] = {
        "png": {"Software": None, "Description": caption},
        "svg": {"Date": None, "Creator": None, "Description": caption},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None, "Subject": caption},
    }
    buffer = BytesIO()
    with style():
        figure.savefig(buffer, format=kind, metadata=undated[kind])
    return buffer.getvalue()


def style() -> Any:
    """The style on top of matplotlib's defaults, independent of the user's own settings."""
    with resources.as_file(resources.files("symasym") / "symasym.mplstyle") as path:
        return matplotlib.style.context(["default", path])


def shade(color: str, share: float) -> Any:
    """A colour darkened by this factor below 1, or mixed with white above 1."""
    if share <= 1:
        return tuple(share * part for part in to_rgb(color))
    return tuple(part + (share - 1) * (1 - part) for part in to_rgb(color))


def straight(
    axes: Axes, begin: Any, end: Any, color: Any, width: float, head: str = "0.5,head_width=0.24"
) -> None:
    """A straight arrow between two points in data units."""
    line: dict[str, Any] = {"color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    line["arrowstyle"] = f"-|>,head_length={head}"
    axes.annotate("", tuple(end), tuple(begin), arrowprops=line, zorder=5)


def along(axes: Axes, path: Any, color: Any, share: float = 0.5, width: float = 1.0) -> None:
    """A path of shape (n, 2) with an arrowhead at this fraction of its length on the page."""
    axes.plot(*path.T, color=color, linewidth=width)
    low, high = np.array([axes.get_xlim(), axes.get_ylim()]).T
    seen = (path - low) / (high - low)
    kept = ((seen >= 0) & (seen <= 1)).all(axis=1)
    if kept.sum() < 2:
        return
    path, seen = path[kept], seen[kept]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
    at = share * length[-1]
    # The head follows a short chord, which exceeds a pixel on every figure.
    begin, end = ([np.interp(s, length, path[:, k]) for k in (0, 1)] for s in (at - 0.01, at))
    straight(axes, begin, end, color, 0.8, "0.42,head_width=0.2")
