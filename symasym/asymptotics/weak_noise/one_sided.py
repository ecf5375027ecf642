"""What lies left and right of a start, as float64 arrays: series, heights and their rounding.

The same contents as `symasym.asymptotics.weak_noise.critical_points.Half`, one entry of each array
a drift, for drifts whose wells, barriers and kinks come in the same order. A sight that was found
with more digits, one drift at a time, takes the same form (`sight_of`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from symasym.asymptotics.weak_noise.critical_points import Groups, Half
from symasym.base.inputs import FloatArray

#: Of a coefficient, and of the sum that is made of it; what cancels in sums of series has it left.
ROUNDING = 1e-15

#: A number of each drift, or one of all.
Numbers = Any


class Part(NamedTuple):
    """lam^-offset log(lam)^logs (c[0] + c[1]/lam + ...); coefficients that are missing are 0."""

    offset: float
    logs: int
    coefficients: list[Numbers]


class Series(NamedTuple):
    """A sum of parts, each known to `rounding`: of its value, or where given of its `terms`."""

    parts: list[Part]
    rounding: Numbers = 0.0
    # Coefficients as large as what cancels in those of the first part.
    size: list[Numbers] | None = None


class Local(Protocol):
    """A function of lam that is no power series (`symasym.asymptotics.uniform.canonical_forms`)."""

    def at(self, point: Any) -> tuple[Any, Any]:
        """The value and its error."""


class Spot(NamedTuple):
    """e^{lam height} times a series; `rank` tells the order from the start on."""

    rank: int
    height: Numbers
    series: Series | Local
    onward: Series | Local | None


class Joint(NamedTuple):
    """What takes the place of the product of the shares at two ranks, falling and rising."""

    falling: int
    rising: int
    height: Numbers
    local: Local | None


class Sight(NamedTuple):
    """One side of the start (see `symasym.asymptotics.weak_noise.critical_points.Half`).

    `beyond` is (length up to r, V where the straight part begins, phi) without r itself:
    the length is r - `beyond[0]`. `rough` is the rounding of every height. `joint` are places that
    meet, and `slack` tells what that costs: e^{-lam slack} of the value.
    """

    rising_start: Series
    falling_start: Series
    corner: bool
    rising: list[Spot]
    falling: list[Spot]
    outer: Series
    beyond: tuple[Numbers, Numbers, Numbers] | None
    rough: Numbers
    joint: list[Joint] = []
    slack: Numbers = np.inf


def trimmed(coefficients: list[Numbers]) -> list[Numbers]:
    """Without zeros at the end."""
    found = list(coefficients)
    while found and not (found[-1].any() if isinstance(found[-1], np.ndarray) else found[-1]):
        found.pop()
    return found


def series_of(groups: Groups) -> Series:
    """A series that was found with more digits than float64 has."""
    parts: dict[tuple[float, int], list[float]] = {}
    for n, group in enumerate(groups):
        for c, p, q in group:
            row = parts.setdefault((float(p) - n, q), [0.0] * len(groups))
            row[n] += float(c)
    taken = [Part(*key, found) for key, row in parts.items() if (found := trimmed(row))]
    return Series(taken, ROUNDING)


def sight_of(half: Half) -> Sight:
    """`half`, found with more digits than float64 has, as a sight of one drift."""
    at = sorted({place.u for place in half.rising + half.falling})
    rising, falling = (
        [
            Spot(at.index(p.u), float(p.height), series_of(p.groups), series_of(p.onward))
            for p in places
        ]
        for places in (half.rising, half.falling)
    )
    # Heights cancel each other in pairs of places.
    rough = 3e-16 * max([abs(p.height) for p in rising + falling], default=0.0)
    beyond = None if half.beyond is None else tuple(float(x) for x in half.beyond)
    start = half.start
    return Sight(
        series_of(start.rising),
        series_of(start.falling),
        start.corner,
        rising,
        falling,
        series_of(half.outer),
        beyond,  # type: ignore[arg-type]
        rough,
    )


def mapped(found: Any, change: Callable[[FloatArray], Any]) -> Any:
    """The same with `change` made to every array in it."""
    if isinstance(found, np.ndarray):
        return change(found)
    if isinstance(found, list):
        return [mapped(x, change) for x in found]
    if isinstance(found, tuple):
        parts = [mapped(x, change) for x in found]
        return type(found)(*parts) if hasattr(found, "_fields") else tuple(parts)
    if is_dataclass(found) and not isinstance(found, type):
        return replace(found, **{name: mapped(x, change) for name, x in vars(found).items()})
    return found


def first_of(found: Any) -> Any:
    """The same with the arrays' first entries: NumPy is quicker with plain numbers."""
    return mapped(found, lambda x: float(x.ravel()[0]))


def added(a: Series, b: Series) -> Series:
    """The sum, of terms that may cancel."""
    keys = {(p.offset, p.logs): p.coefficients for p in a.parts}
    for part in b.parts:
        mine = keys.get((part.offset, part.logs), [])
        width = max(len(mine), len(part.coefficients))
        rows = [row + [0.0] * (width - len(row)) for row in (mine, part.coefficients)]
        keys[part.offset, part.logs] = [x + y for x, y in zip(*rows, strict=True)]
    rounding = np.maximum(a.rounding, b.rounding)
    parts = [Part(*key, row) for key, values in keys.items() if (row := trimmed(values))]
    size = a.size if a.size is not None else b.size
    return Series(parts, rounding, size)


__all__ = ["FloatArray", "Joint", "Local", "Part", "Series", "Sight", "Spot"]
