"""Curves of a quantity against its noise, radius, start or a parameter, with their errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from symasym.base.call_context import patient
from symasym.base.errors import InputError
from symasym.base.estimate import Estimate
from symasym.base.inputs import (
    FloatArray,
    Numbers,
    axes,
    choice,
    floats,
    is_array,
    meant,
)
from symasym.drift.drift import Drift
from symasym.quantities import call_named, stationary_density
from symasym.scenes import QUANTITIES, require_drift

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["plot"]

_LABELS = {
    "T": "mean escape time T",
    "C": "probability C of leaving through −r",
    "1 - C": "probability 1 − C of leaving through r",
    "P": "stationary probability P of |u| ≤ 1",
    "1 - P": "stationary probability 1 − P of |u| > 1",
    "p_ss": "stationary density",
}
_NUMBERS = {"kappa": "κ", "r": "r", "start": "start", "y": "u"}
# Values beyond e to this are drawn as their decimal logarithms.
_MOST = 600.0
# Ratio of the largest to the smallest value from which on the axis is logarithmic.
_MANY = 100.0
_OF_METHODS = ("method", "order", "rtol")


@patient
def plot(
    quantity: Literal["T", "C", "1 - C", "P", "1 - P", "p_ss"],
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    start: Numbers = 0,
    y: Numbers | None = None,
    ax: Axes | None = None,
    label: str | None = None,
    patience: float | None = None,
    **options: Any,
) -> Axes:
    """Draw a quantity against the one argument or parameter that is an array.

    Parameters
    ----------
    quantity : {"T", "C", "1 - C", "P", "1 - P", "p_ss"}
    drift : Drift
        With a value for each of its parameters; one of them may be the array.
    kappa : number or array_like
        Scaled noise amplitude.
    r : number or array_like
        Scaled radius, for ``"T"``, ``"C"`` and ``"1 - C"``.
    start : number or array_like
        Scaled starting point, for the same.
    y : number or array_like
        Scaled position, for the stationary density ``"p_ss"``.
    ax : matplotlib Axes, optional
        Where to draw; a new figure's when left out.
    label : str, optional
        In the legend; the method when left out.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.
    **options
        Of the function: `method`, `order`, `rtol`, `dps`, `errors`, `workers`.

    Returns
    -------
    matplotlib Axes
        With a line and, where an error is stated, the band of it; elements that are refused
        leave a gap, unless all are.

    Raises
    ------
    InputError
        Unless exactly one argument is an array, of one axis; and as the function does.

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
    quantity = choice("quantity", quantity, _LABELS)
    require_drift(drift)
    if ax is not None:
        (ax,) = axes("ax", ax)
    given: dict[str, Any] = {"kappa": kappa, "r": r, "start": start, "y": y}
    numbers = {name: x for name, x in given.items() if x is not None and name in _takes(quantity)}
    for unused in ("r", "y"):
        if unused not in numbers and given[unused] is not None:
            raise InputError(
                f"{unused} is given, but {quantity} does not depend on it; leave it out."
            )
    missing = [n for n in _takes(quantity) if n not in numbers]
    if missing:
        takes = ", ".join(_takes(quantity))
        raise InputError(f"{missing[0]} is missing; {quantity} depends on {takes}.")
    known = ("dps", "errors", "workers", *(() if quantity == "p_ss" else _OF_METHODS))
    if unknown := [n for n in options if n not in known]:
        raise InputError(
            f"{unknown[0]} is no option of {quantity}; the options are {', '.join(known)}"
            f"{meant(unknown[0], known)}."
        )
    name, abscissa = _abscissa(drift, numbers)
    options = {"errors": "nan", **options, "log": True, "full": True}
    ask: Callable[..., Estimate] = partial(call_named, quantity, drift, numbers)
    if quantity == "p_ss":
        ask = partial(stationary_density, drift, **numbers)
    estimate = ask(**options)
    if np.all(estimate.mask):
        ask(**options | {"errors": "raise"})
    if ax is None:
        from matplotlib import pyplot

        ax = pyplot.subplots(layout="constrained")[1]
    shown = label if label is not None else estimate.method.replace("_", " ")
    logs = np.asarray(estimate.value, dtype=float)
    errors = None if estimate.error is None else np.asarray(estimate.error, dtype=float)
    _draw(ax, abscissa, logs, errors, shown, _LABELS[quantity])
    ax.set_xlabel(_NUMBERS.get(name, name))
    return ax


def _takes(quantity: str) -> tuple[str, ...]:
    """The names of a quantity's numbers."""
    return ("kappa", "y") if quantity == "p_ss" else QUANTITIES[quantity].numbers


def _abscissa(drift: Drift, numbers: dict[str, Any]) -> tuple[str, FloatArray]:
    """The name and the values of the one array."""
    arrays = {name: x for name, x in (drift.values | numbers).items() if is_array(x)}
    if len(arrays) != 1:
        arrays_given = f"{', '.join(arrays)} are arrays" if arrays else "no argument is an array"
        raise InputError(
            f"{arrays_given}; give one argument or parameter, what to plot against, as an array."
        )
    ((name, given),) = arrays.items()
    values = floats(name, given)
    if values.ndim != 1:
        raise InputError(f"{name} has shape {values.shape}; give an array of one axis.")
    return name, values


def _draw(
    ax: Axes, x: FloatArray, logs: FloatArray, errors: FloatArray | None, label: str, about: str
) -> None:
    """A line with its band, of the values or of their decimal logarithms."""
    # What is drawn into the same axes later has the same units.
    decimal = ax.get_ylabel().startswith("log₁₀") or np.nanmax(np.abs(logs), initial=0) > _MOST
    known = [] if errors is None else [logs - errors, logs + errors]
    line, *band = [y / np.log(10) for y in (logs, *known)] if decimal else np.exp([logs, *known])
    (drawn,) = ax.plot(x, line, label=label)
    if band:
        ax.fill_between(x, *band, color=drawn.get_color(), alpha=0.25, linewidth=0)
    if not decimal and np.nanmax(line, initial=0) > _MANY * np.nanmin(line, initial=np.inf):
        ax.set_yscale("log")
    if x.min() > 0 and x.max() > _MANY / 2 * x.min():
        ax.set_xscale("log")
    ax.set_ylabel(f"log₁₀ of {about}" if decimal else about)
