"""Many lam of one drift: the coefficients once in balls, their sums in float64 arrays.

At some of the lam, the least and the largest among them, the balls tell how much float64 loses.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import cached_property, partial
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, IntArray, exact, is_array
from symasym.drift.drift import Drift
from symasym.exact import floats
from symasym.expansions import weak
from symasym.numbers.balls import precision
from symasym.scenes import Request, Scenes, by_drift, rows_of

#: Of the coefficients, and of the heights.
BITS = 192
#: Orders beyond the one asked for, by whose differences its error is estimated.
NEXT = 3
# Values of lam at which errors are looked at where they are not asked for, and compared.
_PROBES, _COMPARED = 3, 48
_SMALL, _AT_ONCE = 0.1, 8192


_NOTHING = 0  # what a sum begins with


class Scaled:
    """m e^(lam h), m an array and h one ball; a sum has the height of its highest term."""

    __array_ufunc__ = None  # an array times this is this class's product

    def __init__(self, m: Any, h: Any, lam: FloatArray) -> None:
        self.m, self.h, self.lam = m, h, lam

    def __add__(self, other: Any) -> Scaled:
        if not isinstance(other, Scaled):
            return self if other is _NOTHING else self + Scaled(other, arb(0), self.lam)
        low, high = (self, other) if float(self.h) < float(other.h) else (other, self)
        gap = float(low.h - high.h)
        return Scaled(high.m + low.m * (np.exp(self.lam * gap) if gap else 1.0), high.h, self.lam)

    __radd__ = __add__

    def __neg__(self) -> Scaled:
        return Scaled(-self.m, self.h, self.lam)

    def __sub__(self, other: Any) -> Scaled:
        return self.__add__(-1 * other)

    def __mul__(self, other: Any) -> Scaled:
        if not isinstance(other, Scaled):
            return Scaled(self.m * other, self.h, self.lam)
        return Scaled(self.m * other.m, self.h + other.h, self.lam)

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Scaled:
        if not isinstance(other, Scaled):
            return Scaled(self.m / other, self.h, self.lam)
        return Scaled(self.m / other.m, self.h - other.h, self.lam)

    def plain(self) -> FloatArray:
        """The value itself."""
        found: FloatArray = self.m * np.exp(self.lam * float(self.h))
        return found

    def log(self) -> FloatArray:
        """The logarithm; nan where the value is not positive."""
        found: FloatArray = np.log(self.m) + self.lam * float(self.h)
        return found


class AtLams:
    """The points' terms at many lam, to an order."""

    def __init__(self, lam: FloatArray, order: int) -> None:
        self.lam, self.order, self.x = lam, order, 1 / lam

    @cached_property
    def log_lam(self) -> FloatArray:
        """log lam."""
        found: FloatArray = np.log(self.lam)
        return found

    def named(self, name: str, value: Any) -> Any:
        """The value itself."""
        return value

    def term(self, letter: str, point: weak.Point, height: Any, halves: int, row: list[Any]) -> Any:
        """lam^(-halves/2) e^(lam height) sum row_n lam^-n."""
        *rest, last = (float(c) for c in row[: self.order + 1])
        total: Any = last
        for c in reversed(rest):
            total = total * self.x
            total += c
        front = np.sqrt(self.x) if halves == 1 else self.x
        return Scaled(total * front, height, self.lam)


class Expanded(NamedTuple):
    """A quantity of one drift: at many lam to an order, at one to several orders in balls."""

    in_floats: Callable[[FloatArray, int], Scaled]
    in_balls: Callable[[Fraction, list[int]], list[Any]]


#: The expansion of a drift with r, start and the name of a quantity.
Expand = Callable[[Drift, Fraction, Fraction, str], Expanded]
#: The refusal of a kappa, given as text, with these orders.
Refuse = Callable[[str, Sequence[int]], AccuracyError]


def other(name: str) -> str:
    """The name of the complement."""
    return name.removeprefix("1 - ") if name.startswith("1 - ") else f"1 - {name}"


def counted(logs: Any, errors: Any, log: bool) -> Any:
    """True where a logarithm is known to a factor 2 of the value; one of 1e15 may be wrong by 1."""
    with np.errstate(invalid="ignore"):
        most = np.maximum(np.log(2), 1e-11 * np.abs(logs) if log else 0.0)
    return np.isfinite(logs) & (errors < most)


def orders_of(request: Request) -> Sequence[int]:
    """The orders among which the best is taken, ascending."""
    return request.order if isinstance(request.order, range) else (request.order,)


def of_drifts(
    scenes: Scenes, request: Request, expand: Expand, refuse: Refuse
) -> tuple[FloatArray, FloatArray, str]:
    """Logarithms and their errors, drift by drift; nan where there is none, and why."""
    why = ""
    numbers, given = scenes.numbers, scenes.given
    logs, errors = (np.full(len(scenes.lam), np.nan) for _ in range(2))
    apart = [numbers[name] for name in ("r", "start") if is_array(given.get(name))]

    def exactly(name: str, row: Any) -> Fraction:
        if name not in numbers:
            return Fraction(1)
        known = given[name]
        return Fraction(float(numbers[name][row])) if is_array(known) else exact("number", known)

    alike = not any(map(is_array, scenes.parameters.values())) and not apart
    groups = [(scenes.drift, np.arange(len(logs)))] if alike else by_drift(scenes, *apart)
    for drift, rows in groups:
        r, start = exactly("r", rows[0]), exactly("start", rows[0])
        some = rows_of(scenes, rows)._replace(shape=(len(rows),), drift=drift)
        some = some._replace(parameters=dict(drift.values))
        try:
            with np.errstate(all="ignore"), precision(BITS):
                logs[rows], errors[rows] = _of_drift(
                    some, request, partial(expand, drift, r, start)
                )
        except AccuracyError as error:
            why = why or str(error)
    lost = ~counted(logs, errors, request.log)
    if lost.any():
        why = why or str(refuse(scenes.noise(np.argmax(lost)), orders_of(request)))
    logs[lost] = np.nan
    return logs, errors, why


def _of_drift(
    scenes: Scenes, request: Request, expand: Callable[[str], Expanded]
) -> tuple[FloatArray, FloatArray]:
    """Those of one drift, r and start."""
    name = request.name
    found: tuple[Any, Any]
    if name == "P":
        found = _complement(*_direct(scenes, request, expand("1 - P")))
    else:
        found = _direct(scenes, request, expand(name))
        if request.log and name[-1] == "C" and (near := found[0] > -0.5).any():
            others = _complement(*_direct(scenes, request, expand(other(name))))
            found = (
                np.where(near, others[0], found[0]),
                np.where(near, others[1], found[1]),
            )
    return found[0], _compared(scenes, request, *found)


def _complement(logs: FloatArray, errors: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The logarithm of 1 - y and its error, from those of y."""
    odds = 1 / np.expm1(-logs)
    return np.log1p(-np.exp(logs)), -np.log1p(-np.minimum(odds * np.expm1(errors), 1))


def _direct(scenes: Scenes, request: Request, known: Expanded) -> tuple[FloatArray, FloatArray]:
    """The logarithms by the sums themselves."""
    lam, orders = scenes.lam, list(orders_of(request))
    probes = np.argsort(lam)[np.linspace(0, len(lam) - 1, _PROBES).astype(int)]
    rows, orders_and_next = [], [*orders, *range(orders[-1] + 1, orders[-1] + NEXT + 1)]
    few = len(orders) == 1 and not request.full
    relative: Any = np.inf
    if few:
        # Errors grow with the noise: small at some lam, the least among them, they are everywhere.
        relative = np.max(_estimates(_rows(known, lam[probes], orders_and_next), 1))
        rows = _rows(known, lam, orders)
    if not (few and relative < _SMALL):
        rows = _rows(known, lam, orders_and_next)
        relative = _estimates(rows, len(orders))
    best = np.argmin(relative, axis=0) if len(orders) > 1 else 0
    logs = np.choose(best, [y.log() for y in rows[: len(orders)]])
    relative = np.min(relative, axis=0)
    errors = np.where(relative < 0.5, -np.log1p(-relative), np.inf)
    return _rounded(known, lam, logs, errors, np.array(orders)[best] + 0 * lam.astype(int))


def _rounded(
    known: Expanded, lam: FloatArray, logs: FloatArray, errors: FloatArray, orders: IntArray
) -> tuple[FloatArray, FloatArray]:
    """The same with the error of rounding, found at a few lam; in balls where it is large."""

    def in_balls(k: Any) -> float:
        ball = known.in_balls(Fraction(lam[k]), [int(orders[k])])[0]
        return float(ball.log()) if ball > 0 else np.nan

    rows = np.flatnonzero(errors < np.inf)
    rows = rows[np.argsort(lam[rows])]
    if not rows.size:
        return logs, errors
    probes = np.unique(rows[np.linspace(0, len(rows) - 1, _PROBES).astype(int)])
    lost = np.max(np.abs([in_balls(k) - logs[k] for k in probes]))
    if not lost < 1e-13 + 1e-15 * np.abs(logs[probes]).max():
        for k in rows:
            logs[k] = in_balls(k)
        lost = 0.0
    return logs, errors + 4 * lost + 1e-15 * (1 + np.abs(logs))


def _rows(known: Expanded, lam: FloatArray, orders: Sequence[int]) -> list[Scaled]:
    """The quantity to each order, in steps that stay in a cache."""
    found = []
    for n in orders:
        steps = [known.in_floats(lam[k : k + _AT_ONCE], n) for k in range(0, len(lam), _AT_ONCE)]
        found.append(Scaled(np.concatenate([y.m for y in steps]), steps[0].h, lam))
    return found


def _estimates(rows: list[Scaled], count: int) -> FloatArray:
    """Three times the sum of the next three differences, relative to each of the first rows."""
    found = []
    for k in range(count):
        ratios = [(y / rows[k]).plain() for y in rows[k : k + NEXT + 1]]
        found.append(3 * sum(np.abs(b - a) for a, b in pairwise(ratios)))
    estimates: FloatArray = np.nan_to_num(np.array(found), nan=np.inf)
    return estimates


def _compared(scenes: Scenes, request: Request, logs: FloatArray, errors: FloatArray) -> FloatArray:
    """The errors by exact values where the estimate does not count, and at a few lam if asked for.

    What lies between the critical points, such as a bump of A, is in no next term: where a few lam
    show that the estimates are too small, all are raised.
    """
    known = counted(logs, errors, request.log)
    rows = np.flatnonzero(~known & np.isfinite(logs))
    sure = np.flatnonzero(known)
    if request.full and sure.size:
        sure = sure[np.argsort(scenes.lam[sure])]
        sure = np.unique(sure[np.linspace(0, len(sure) - 1, _COMPARED).astype(int)])
        rows = np.concatenate([rows, sure])
    if not rows.size:
        return errors
    asked = request._replace(method="exact", order=None, full=True)
    true = floats.of_scenes(rows_of(scenes, rows), asked)
    missed = 0.0 if true.errors is None else true.errors
    apart = np.abs(true.logs - logs[rows])
    factor = np.nanmax(np.where(known[rows], (apart - missed) / errors[rows], 0), initial=0)
    raised: FloatArray = np.where(known, errors * (3 * factor if factor > 0.5 else 1), np.inf)
    raised[rows] = np.where(known[rows] | np.isnan(apart), raised[rows], apart + missed)
    return raised
