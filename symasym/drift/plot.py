"""The drift and its potential as curves, wells and barriers named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symasym.base import inputs

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 400
_REACH = 1.5


class Drawn(Protocol):
    """What is drawn of a drift."""

    def __call__(self, u: Any) -> Any: ...

    def potential_at(self, u: Any) -> Any: ...

    def scalars(self) -> Any: ...

    def wells(self) -> Any: ...

    def barriers(self) -> Any: ...


def plot(drift: Drawn, axes: Sequence[Axes] | None) -> Any:
    """phi above V; see `symasym.drift.drift.Drift.plot`."""
    drift.scalars()
    if axes is None:
        from matplotlib import pyplot

        axes = pyplot.subplots(2, sharex=True, layout="constrained")[1]
    above, below = inputs.axes("axes", axes, 2)
    u = np.union1d(np.linspace(-_REACH, _REACH, _POINTS), [-1.0, 1.0])
    above.plot(u, drift(u))
    above.axhline(0, color="0.6", linewidth=0.8)
    above.set_ylabel(r"$\phi(u)$")
    below.plot(u, drift.potential_at(u))
    below.set_ylabel("V(u)")
    below.set_xlabel("u")
    for ax in (above, below):
        # The layer's ends, outside of which the drift is constant.
        for end in (-1, 1):
            ax.axvline(end, color="0.6", linewidth=0.8, linestyle=":")
    for kind, points, side in (("well", drift.wells(), -1), ("barrier", drift.barriers(), 1)):
        for point in points:
            place = float(point.u)
            height = float(drift.potential_at(place))
            above.plot(place, 0, "o", color="0.3", markersize=4)
            below.plot(place, height, "o", color="0.3", markersize=4)
            below.annotate(
                f"{kind} at {place:.4g}",
                (place, height),
                xytext=(0, 9 * side),
                textcoords="offset points",
                ha="center",
                va="bottom" if side > 0 else "top",
                fontsize="small",
            )
    below.margins(y=0.2)
    return axes
