"""Evaluates a truncated expansion of T, C or P together with its truncation error.

The error of a partial sum is its distance to the exact value, because features between the critical
points, such as a bump of A, show in no later term: for one scene in balls, for an array in float64.
Where the errors of an array are not asked for, they are taken at a few dozen lam, and interpolated
upwards between these. A value whose error is above half of it is refused. The exact value has at
most `_MOST_DIGITS` digits. Order "optimal" is the one nearest to the exact value: an asymptotic
series is best truncated where its error is least (R. B. Dingle, Asymptotic Expansions, 1973).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from fractions import Fraction
from typing import Any, Self

import numpy as np
from flint import arb

from symasym.base.balls import doubled, precision, rational
from symasym.base.errors import AccuracyError, RegionError
from symasym.base.inputs import FloatArray, float_text
from symasym.drift.drift import Drift
from symasym.drift.scenes import FLOAT_DIGITS, Answer, Request, Scene, Scenes, require_sliding
from symasym.exact import balls as exact
from symasym.exact import floats
from symasym.expansions.arithmetic import InBalls, InFloats
from symasym.expansions.ball_drift import LINE, Between

_BITS = 192  # of the coefficients and heights behind an array
# Values of lam of an array that are compared with exact values, and that are summed at once.
_SAMPLES, _AT_ONCE = 48, 8192
# Digits up to which the exact value costs no more than some expansions; few errors are smaller.
_MOST_DIGITS = 300


class PartialSums(ABC):
    """Partial sums of an expansion of T, C, 1 - C, P or 1 - P for one drift, its ends and start.

    `quantity` evaluates them from the coefficients that are `known`. If rounding is not `enclosed`,
    each partial sum is compared with the exact value.
    """

    reason: str
    enclosed = True
    float_digits = FLOAT_DIGITS

    def __init__(self, drift: Drift, between: Between, name: str, length: int) -> None:
        self.drift, self.between, self.name, self.length = drift, between, name, length

    @classmethod
    def of(cls, scene: Scene, request: Request, order: int) -> Self:
        """The partial sums for a scene up to an order."""
        of_p = request.name[-1] == "P"
        between = LINE if of_p else Between(*scene.ends, scene.start, request.reflecting)
        return cls(scene.drift, between, request.name, order + 1)

    @abstractmethod
    def known(self, bits: int) -> Any:
        """The coefficients, which do not depend on lam, at flint's precision of so many bits."""

    @abstractmethod
    def quantity(self, known: Any, arithmetic: Any) -> Any:
        """The quantity in an arithmetic."""

    def complement(self) -> PartialSums:
        """The partial sums of the complementary probability."""
        name = self.name.removeprefix("1 - ")
        name = name if name != self.name else f"1 - {name}"
        return type(self)(self.drift, self.between, name, self.length)

    def bits(self, lam: Fraction, digits: int) -> int:
        """The precision to begin with for that many digits."""
        low, high = self.between[:2]
        way = exact.bits_of_way(*map(rational, (lam, 1 + max(-low, high))))
        bits = int(3.33 * digits) + way + 96
        return bits - bits % -64

    def balls(
        self, lam: Fraction, orders: Sequence[int], digits: int, log: bool
    ) -> tuple[list[Any], list[Any]]:
        """The partial sums to these orders and digits, and their logarithms."""

        def sums(bits: int) -> list[Any]:
            known, number = self.known(bits), arb(rational(lam))
            return [self.quantity(known, InBalls(number, n)) for n in orders]

        found = doubled(sums, self.bits(lam, digits), digits if self.enclosed else 0)
        if log and self.name != "T" and found[0] > 0.5:
            rest = self.complement().balls(lam, orders, digits, False)[0]
            return found, [(-y).log1p() for y in rest]
        return found, [y.log() for y in found]

    def logs(self, lam: FloatArray, order: int) -> FloatArray:
        """The logarithms at many lam, in blocks that fit into the cache."""
        known = doubled(self.known, _BITS)
        with precision(_BITS):
            blocks = (lam[k : k + _AT_ONCE] for k in range(0, len(lam), _AT_ONCE))
            sums = (self.quantity(known, InFloats(block, order)) for block in blocks)
            found = np.concatenate([y.log() for y in sums])
        if self.name != "T" and (near := np.flatnonzero(found > -0.5)).size:
            found[near] = np.log1p(-np.exp(self.complement().logs(lam[near], order)))
        return found


# -- one scene -------------------------------------------------------------------------------------


def of_scene(kind: type[PartialSums], scene: Scene, request: Request) -> Answer:
    """The quantity, or its logarithm, to the request's order or to the best of its orders."""
    orders, log = request.order, request.log
    digits = kind.float_digits if request.dps is None else request.dps
    known = min(request.digits, _MOST_DIGITS) + 2
    asked = request._replace(method="exact", order=(), dps=known, full=True)
    proved, sums = exact.of_scene(scene, asked), kind.of(scene, request, orders[-1])
    with precision(int(3.33 * digits) + 64):
        found = sums.balls(scene.lam, orders, digits + 5, log)[log]
        rows = [
            (error, value, order)
            for value, order in zip(found, orders, strict=True)
            if _half(log, value, error := abs(value - proved.value).upper())
        ]
        if not rows:
            raise _refusal(kind, scene, orders)
        error, value, order = min(rows, key=lambda row: row[0])
        value += arb(0, (error + abs(value) / 10 ** (digits + 5)).upper())
    return Answer(value, proved.kind, order)


def _half(log: bool, value: Any, error: Any) -> bool:
    """True if the error is below half the value; the logarithm 1e15 may have the error 1."""
    return bool(error < (arb(2).log().max(abs(value) / 10**11) if log else value / 2))


def _refusal(kind: type[PartialSums], scene: Scene, orders: Sequence[int]) -> AccuracyError:
    kappa, words = float_text(scene.numbers["kappa"]), "and" if len(orders) == 1 else "up to"
    return AccuracyError(
        f"at kappa = {kappa} {words} order {orders[-1]} the error exceeds half of the value, as "
        f"{kind.reason}; use method 'exact', or another order."
    )


# -- many scenes -----------------------------------------------------------------------------------


def of_scenes(kind: type[PartialSums], scenes: Scenes, request: Request) -> Answer:
    """The logarithms in float64, with one set of coefficients for all kappa of a drift."""
    logs, errors = (np.full(len(scenes.lam), np.nan) for _ in range(2))
    orders, why = request.order, ""
    for rows, some in scenes.alike():
        sums = kind.of(some.at(0), request, orders[-1])
        found = _best if len(orders) > 1 else _compared
        try:
            if request.stationary:
                require_sliding(some.drift)
            with np.errstate(all="ignore"):
                logs[rows], errors[rows] = found(sums, some, request)
        except (AccuracyError, RegionError) as error:
            why = why or str(error)
    # The value is known to a factor 2; the logarithm 1e15 may have the error 1.
    lost = ~(np.isfinite(logs) & (errors < np.maximum(np.log(2), 1e-11 * np.abs(logs))))
    if lost.any():
        why = why or str(_refusal(kind, scenes.at(np.argmax(lost)), orders))
    logs[lost] = np.nan
    (order,) = orders if len(orders) == 1 else (None,)
    return Answer(logs, "estimate", order, errors, why)


def _compared(sums: PartialSums, scenes: Scenes, request: Request) -> tuple[FloatArray, FloatArray]:
    """The logarithms, with their distances to exact values; unless the errors are asked for, these
    are taken at some of the lam, and elsewhere twice the larger neighbouring one.
    """
    lam, (order,), rising = scenes.lam, request.order, np.argsort(scenes.lam)
    logs, last = sums.logs(lam, order), len(lam) - 1
    many = last + 1 if request.full else min(last + 1, _SAMPLES)
    some = rising[np.linspace(0, last, many).astype(int)]
    away, missed = _distance(scenes.some(some), request, logs[some])
    at_some, after = away + missed, np.searchsorted(lam[some], lam)
    errors = np.where(
        lam == lam[some][after], at_some[after], 2 * np.maximum(at_some[after], at_some[after - 1])
    )
    return logs, errors


def _best(sums: PartialSums, scenes: Scenes, request: Request) -> tuple[FloatArray, FloatArray]:
    """The logarithms to the order nearest to the exact value, and their errors."""
    every = np.array([sums.logs(scenes.lam, n) for n in request.order])
    away, missed = _distance(scenes, request, every)
    best = np.argmin(np.nan_to_num(away, nan=np.inf), axis=0)
    return np.choose(best, every), np.choose(best, away) + missed


def _distance(scenes: Scenes, request: Request, logs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The distances of logarithms from the exact ones, and the errors of the latter."""
    true = floats.of_scenes(scenes, request._replace(method="exact", order=(), full=True))
    return np.abs(true.value - logs), true.error
