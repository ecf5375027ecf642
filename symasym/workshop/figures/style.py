"""Shared by the figures: the style, arrows along curves, the layer's band, and files."""

from __future__ import annotations

import functools
import inspect
import warnings
from collections.abc import Callable, Iterable
from importlib import resources
from io import BytesIO
from typing import TYPE_CHECKING, Any, ParamSpec

import numpy as np

import symasym as sa
from symasym.base.errors import InputError, SymasymError
from symasym.base.inputs import (
    FloatArray,
    Number,
    choice,
    exact,
    float_text,
    is_array,
    shown,
    to_float,
)

if TYPE_CHECKING:
    from fractions import Fraction

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

#: Kinds of file that `encode` writes.
KINDS = ("png", "svg", "pdf")
INK = "0.1"
FAINT = "0.55"

_P = ParamSpec("_P")


def reads_numbers(figure: Callable[_P, Figure]) -> Callable[_P, Figure]:
    """`figure`, whose numbers are read before it draws: one each, or some where its default is a
    tuple, in the range of float64. What can't be drawn for another reason is told in a sentence."""
    signature = inspect.signature(figure)

    @functools.wraps(figure)
    def draw(*args: _P.args, **kwargs: _P.kwargs) -> Figure:
        given = signature.bind(*args, **kwargs).arguments
        try:
            for name, value in given.items():
                many = isinstance(signature.parameters[name].default, tuple)
                for number in several(name, value) if many else (value,):
                    if number is not None:
                        to_float(name, exact(name, number))
            with warnings.catch_warnings():
                # matplotlib warns where axes have no extent.
                warnings.simplefilter("error", UserWarning)
                return figure(*args, **kwargs)
        except (UserWarning, ArithmeticError) as error:
            if isinstance(error, SymasymError):
                raise
            values = ", ".join(
                f"{name} = {value if isinstance(value, str) else shown(value)}"
                for name, value in given.items()
            )
            raise InputError(
                f"{figure.__name__} cannot be drawn with {values or 'its own values'}; give values "
                "nearer to 1."
            ) from None

    return draw


def encode(figure: Figure, kind: str) -> bytes:
    """The figure as the bytes of a file, the same in every run.

    Parameters
    ----------
    figure : matplotlib Figure
        Its label, which holds the caption, goes into the file as a description.
    kind : {"png", "svg", "pdf"}

    Raises
    ------
    InputError
        For another kind.
    """
    choice("kind", kind, KINDS)
    caption = str(figure.get_label()) or None
    undated: dict[str, dict[str, str | None]] = {
        "png": {"Software": None} | ({"Description": caption} if caption else {}),
        "svg": {"Date": None, "Creator": None, "Description": caption},
        "pdf": {"CreationDate": None, "Creator": None, "Producer": None, "Subject": caption},
    }
    buffer = BytesIO()
    with style():
        figure.savefig(buffer, format=kind, metadata=undated[kind])
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


def colors() -> list[str]:
    """The colours of the style, from dark to light."""
    from matplotlib import rcParams

    return [str(color) for color in rcParams["axes.prop_cycle"].by_key()["color"]]


def shape_colors(shapes: Iterable[Fraction]) -> list[str]:
    """The colour of each shape mu of the friction force: the paper's keep theirs in all figures."""
    known = dict(zip(("1/2", "1", "2", "3"), colors(), strict=True)) | {"0": FAINT}
    named = [str(shape) for shape in shapes]
    free = iter([color for name, color in known.items() if name not in named and name != "0"])
    return [known[name] if name in known else next(free) for name in named]


def dark(color: str, share: float) -> tuple[float, ...]:
    """A colour with this share of its light."""
    from matplotlib.colors import to_rgb

    return tuple(share * part for part in to_rgb(color))


def light(color: str, share: float) -> tuple[float, ...]:
    """A colour with this share of white mixed in."""
    from matplotlib.colors import to_rgb

    return tuple(part + share * (1 - part) for part in to_rgb(color))


def several(name: str, values: Any) -> tuple[Any, ...]:
    """One value or a few as a tuple; there are as many as the style has colours."""
    given = tuple(values) if is_array(values) else (values,)
    if not 1 <= len(given) <= 4:
        raise InputError(
            f"{name} has {len(given)} values; give one to four, which is as many curves "
            "as stay apart in grey."
        )
    return given


def number_text(value: Fraction) -> str:
    """A number as it stands in a label: 1/2, −0.4, 3."""
    return signed(str(value) if value.denominator in (1, 2, 3, 4) else float_text(value))


def signed(number: str) -> str:
    """A number's text with a minus sign of its own."""
    return number.replace("-", "\N{MINUS SIGN}")


def given_text(**given: Number) -> str:
    """Parameters and their values, for a caption."""
    return ", ".join(f"{name} = {number_text(exact(name, x))}" for name, x in given.items())


def fold_of(mu: Number, alpha: Number) -> float:
    """The friction oscillator's fold; refused where it has none."""
    fold = float(sa.friction(mu=mu, alpha=alpha).folds().z0[0])
    if np.isnan(fold):
        raise InputError(f"mu is {mu}; this figure is about the fold, which needs mu > 1/2.")
    return fold


def arrow(axes: Axes, path: FloatArray, color: str, share: float = 0.5, gid: str = "") -> None:
    """An arrowhead on a path of shape (n, 2), at this share of its length as it is seen."""
    low = np.array([axes.get_xlim()[0], axes.get_ylim()[0]])
    high = np.array([axes.get_xlim()[1], axes.get_ylim()[1]])
    seen = (path - low) / (high - low)
    kept = ((seen >= 0) & (seen <= 1)).all(axis=1)
    if kept.sum() < 2:
        return
    path, seen = path[kept], seen[kept]
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(seen, axis=0).T))])
    at = share * length[-1]
    # The head points along a short chord, which is longer than a pixel on every figure.
    ends = [[np.interp(s, length, path[:, k]) for k in (0, 1)] for s in (at - 0.01, at)]
    _headed(axes, ends[0], ends[1], (0.42, 0.2), color, 0.8, gid, 4)


def vector(
    axes: Axes,
    start: Iterable[float],
    step: Iterable[float],
    color: str | tuple[float, ...],
    width: float,
    gid: str,
) -> None:
    """A straight arrow from `start` by `step`, in data units."""
    begin = np.asarray(tuple(start), dtype=float)
    end = begin + np.asarray(tuple(step), dtype=float)
    _headed(axes, begin, end, (0.5, 0.24), color, width, gid, 5)


def _headed(
    axes: Axes,
    begin: Iterable[float],
    end: Iterable[float],
    head: tuple[float, float],
    color: str | tuple[float, ...],
    width: float,
    gid: str,
    zorder: int,
) -> None:
    """A line that ends in an arrowhead of this length and width."""
    (x, y), (from_x, from_y) = end, begin
    line: dict[str, Any] = {"color": color, "linewidth": width, "shrinkA": 0, "shrinkB": 0}
    line["arrowstyle"] = "-|>,head_length={},head_width={}".format(*head)
    axes.annotate("", (x, y), (from_x, from_y), arrowprops=line, gid=gid or None, zorder=zorder)


def layer_band(axes: Axes, horizontal: bool) -> None:
    """The layer |u| <= 1 as a grey band across the axes."""
    band = axes.axhspan if horizontal else axes.axvspan
    band(-1, 1, color="0.93", linewidth=0, zorder=0, gid="layer")
