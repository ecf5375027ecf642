"""The ring of balls: T, C and P of the points of a bound drift (`symasym.expansions.field`)."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple

from flint import arb

from symasym.base.balls import precision
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.expansions.field import RING, Between, Field, Unresolved

_STEPS = 6  # times that bits are doubled, at most


class Local(NamedTuple):
    """A drift's points with their series, its finite parts, phi at both ends."""

    points: list[weak.Point]
    regular: list[list[Any]]
    slopes: tuple[Any, Any]


@lru_cache(maxsize=16)
def local(drift: Drift, at: Between, name: str, count: int, bits: int) -> Local:
    """What the quantity `name` takes, each series to `count` terms, at flint's `bits`."""
    field = Field(drift, at, name == "T")
    points = weak.points_of(field, count, RING)
    regular = field.regular(count) if name == "T" else []
    if name[-1] == "P":
        points = [p for p in points if p.kind != "end"]
    return Local(points, regular, (field.ends[-1], field.ends[1]))


class AtLam:
    """The points' terms at one lam, to an order."""

    def __init__(self, lam: Any, order: int) -> None:
        self.lam, self.order, self.log_lam = lam, order, lam.log()

    number = staticmethod(lambda x: x)
    named = staticmethod(lambda name, value: value)

    def term(self, letter: str, point: weak.Point, height: Any, halves: int, row: list[Any]) -> Any:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        total = arb(0)
        for c in row[self.order :: -1]:
            total = total / self.lam + c
        return total * RING.root(self.lam, -halves) * (self.lam * height).exp()


def quantity(known: Local, name: str, at: Any) -> Any:
    """T, C, 1 - C, P or 1 - P to the order of `at`."""
    if name == "T":
        return weak.escape_time(known.points, known.regular, at)
    if name[-1] == "C":
        return weak.exit_probability(known.points, at, name != "C")
    outside = weak.outside_layer(known.points, known.slopes, at)
    return 1 - outside if name == "P" else outside


def doubled(find: Callable[[int], Any], bits: int, digits: int = 0) -> Any:
    """What `find` gives at flint's precision of so many bits, which it takes: these are doubled
    until zeros and edges are apart, and the balls that it gives have so many digits."""
    for more in (bits << k for k in range(_STEPS)):
        with suppress(Unresolved), precision(more):
            found = find(more)
            if not digits or all(y.rel_accuracy_bits() > 3.33 * digits + 1 for y in found):
                return found
    raise AccuracyError(
        f"A varies too fast, or its zeros are too close to each other or to an end, for many times "
        f"{bits:,} bits; use method='exact'."
    )
