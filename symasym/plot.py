"""Plots of a quantity against the noise, the radius, the start or a parameter, with error bands."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import Numbers, choice, floats, is_array
from symasym.drift.drift import Drift
from symasym.drift.scenes import QUANTITIES, Ends, Request, between, require_drift, taken
from symasym.methods import ask

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot"]

_LABELS = {
    "T": "mean escape time T",
    "C": "probability C of leaving on the left",
    "1 - C": "probability 1 − C of leaving on the right",
    "P": "stationary probability P of |u| ≤ 1",
    "1 - P": "stationary probability 1 − P of |u| > 1",
    "p_ss": "stationary density",
}
_NUMBERS = {"kappa": "κ", "y": "u"}
# The axis is logarithmic if the ratio of the largest to the smallest value is above this.
_MANY = 100.0


def plot(
    quantity: Literal["T", "C", "1 - C", "P", "1 - P", "p_ss"],
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    ends: Ends | None = None,
    start: Numbers = 0,
    y: Numbers | None = None,
    ax: Axes | None = None,
    label: str | None = None,
    **options: Any,
) -> Axes:
    """Plot a quantity against the one argument or parameter that is an array.

    Parameters
    ----------
    quantity : {"T", "C", "1 - C", "P", "1 - P", "p_ss"}
    drift : Drift
        A drift whose parameters all have values; one of these may be the array.
    kappa, r, start, y : number or array_like
        Scaled noise amplitude; radius and starting point, for ``"T"``, ``"C"`` and ``"1 - C"``;
        position, for the stationary density ``"p_ss"``.
    ends : pair of numbers or array_like, optional
        The ends of the interval in place of -r and r.
    ax : matplotlib Axes, optional
        The axes to draw in, by default those of a new figure.
    label : str, optional
        The label in the legend, by default the method.
    **options
        Options of its function: `method`, `order`, `rtol`, `log`, `moment`, `reflecting`.

    Returns
    -------
    matplotlib Axes
        The axes with a line, a legend and a band for a stated error. Elements without a value
        leave a gap. The horizontal axis is logarithmic if the array is logarithmically spaced.

    Raises
    ------
    InputError
        Unless exactly one argument is an array, and this has one axis; or as by the function.

    Examples
    --------
    >>> import matplotlib
    >>> matplotlib.use("agg")
    >>> import numpy as np
    >>> import symasym as sa
    >>> drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    >>> ax = sa.plot("T", drift, np.geomspace(0.05, 2, 50), 10)
    >>> ax = sa.plot("T", drift, np.geomspace(0.05, 2, 50), 10, method="laplace", ax=ax)
    >>> ax.get_xlabel(), ax.get_ylabel(), len(ax.lines)
    ('κ', 'mean escape time T', 2)
    """
    choice("quantity", quantity, _LABELS)
    require_drift(drift, plain=False)
    needed = QUANTITIES.get(quantity, ("kappa", "y"))
    if ends is not None and "r" in needed:
        needed = ("kappa", "ends", "start")
    numbers = taken(quantity, needed, kappa=kappa, r=r, ends=ends, start=start, y=y)
    if "ends" in numbers:
        numbers = between(kappa, None, ends, start)
    arrays = {n: floats(n, x) for n, x in (drift.values | numbers).items() if is_array(x)}
    if [x.ndim for x in arrays.values()] != [1]:
        raise InputError(
            f"the arrays are {', '.join(arrays) or 'none'}; give exactly one argument or parameter "
            "as an array, of one axis: the plot is against it."
        )
    ((name, x),) = arrays.items()
    found = ask(drift, numbers, Request(quantity, full=True, **options))
    value, log = found.value, options.get("log")
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.subplots(layout="constrained")[1]
    look = "-" if found.method == "exact" else "--"
    own = found.method.replace("_", " ") + f", order {found.order}" * (found.order is not None)
    (line,) = ax.plot(x, value, look, label=label or own)
    if found.error is not None:
        band = value - found.error, value + found.error
        ax.fill_between(x, *band, color=line.get_color(), alpha=0.25, linewidth=0)
    if not log and np.nanmax(value, initial=0) > _MANY * np.nanmin(value, initial=np.inf):
        ax.set_yscale("log")
    steps = np.diff(np.log(x)) if x.min() > 0 else np.empty(0)
    if steps.size > 1 and np.ptp(steps) < 0.01 * abs(steps[0]):
        ax.set_xscale("log")
    k = options.get("moment", 1)
    what = _LABELS[quantity] if k == 1 else f"moment {k} of the escape time"
    ax.set(xlabel=_NUMBERS.get(name, name), ylabel="log of " * bool(log) + what)
    ax.legend()
    return ax
