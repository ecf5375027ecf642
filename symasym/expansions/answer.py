"""An expansion as a method: T, C and P of scenes to an order, with what is left out.

The error of one scene is its distance to the exact value, enclosed in balls. Where that is not
asked for, and in arrays, it is three times the sum of the next three differences of the orders,
an estimate, which counts below half the value. An asymptotic series is best cut off where that
is least (R. B. Dingle, Asymptotic Expansions, 1973, ch. I): order "optimal".

What lies between the critical points, such as a bump of A, is in no next term: where errors of an
array are asked for, exact values at a few lam raise the estimates if they show them too small.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from flint import arb

from symasym.base.balls import exact_ball, precision, to_mpf
from symasym.base.errors import AccuracyError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import FloatArray, IntArray, is_array
from symasym.drift.drift import Drift
from symasym.drift.formula import rational
from symasym.drift.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    by_drift,
    rows_of,
    scene_at,
)
from symasym.exact import balls as exact
from symasym.exact import floats
from symasym.expansions.field import LINE, Between
from symasym.expansions.rings import AtLam, AtLams, doubled, local, quantity

_BITS = 192  # of an array's coefficients and heights
_NEXT = 3  # orders by whose differences an error is estimated
# Values of lam of an array at which errors are found, and that are summed up at once.
_SAMPLES, _AT_ONCE = 48, 8192
# Digits up to which the exact value costs no more than some expansions.
_MOST_DIGITS = 300


class Expansion(NamedTuple):
    """A series of T, C and P.

    `local` gives what a drift between two ends, the name of a quantity, a number of terms and bits
    make it of; `quantity` sums that at lam in one of the two rings.
    """

    local: Callable[[Drift, Between, str, int, int], Any]
    quantity: Callable[[Any, str, Any], Any]
    in_balls: Callable[[Any, int], Any]
    in_floats: Callable[[FloatArray, int], Any]
    terms: str
    beyond: str
    reason: str

    def of_scene(self, scene: Scene, request: Request) -> Answer:
        """The quantity, or its logarithm, to the request's order; any start."""
        orders, digits, log = _orders(request), request.digits, request.log
        proved = _exact(scene, request) if request.full and len(orders) == 1 else None
        series = self._series(
            scene, request.name, orders[-1] + (1 if proved else 1 + _NEXT), request.reflecting
        )
        order, error = orders[0], arb("inf")
        kind: ErrorKind = "estimate"
        with precision(int(3.33 * digits) + 64):
            some = orders if proved else _and_next(orders)
            values, logs = series.balls(scene.lam, some, digits + 5, log)
            value = logs[0] if log else values[0]
            if proved is None:
                apart = [abs(b - a).upper() for a, b in pairwise(logs)]
                estimates = [3 * sum(apart[k : k + _NEXT], arb(0)) for k in range(len(orders))]
                known, sizes = (np.array([*map(float, y)]) for y in (logs[:-_NEXT], estimates))
                best = int(np.argmin(np.where(_counted(known, sizes), sizes, np.inf)))
                order, value = orders[best], (logs if log else values)[best]
                error = estimates[best] if log else value * estimates[best].expm1()
            most = arb(2).log().max(abs(value) / 10**11) if log else value / 2
            if proved is None and (request.full or not error < most):
                proved = _exact(scene, request)
            if proved is not None:
                error = abs(value - arb(proved.value)) + arb(proved.error)
                kind = proved.kind
            if not error < most:
                raise self._refusal(scene.noise, orders)
            error = (error + abs(value) / 10 ** (digits + 5)).upper()
            value, error = (to_mpf(x, digits + 10)[0] for x in (value, error))
        return Answer(value, error, kind, (self.terms,), (self.beyond,), order)

    def of_scenes(self, scenes: Scenes, request: Request) -> Answers:
        """The same in float64: each drift's series once, then all its kappa."""
        logs, errors = (np.full(len(scenes.lam), np.nan) for _ in range(2))
        given = scenes.given.items()
        apart = [scenes.numbers[n] for n, x in given if n != "kappa" and is_array(x)]
        many = apart or any(map(is_array, scenes.parameters.values()))
        groups = by_drift(scenes, *apart) if many else [(scenes.drift, np.arange(len(logs)))]
        why = ""
        for drift, rows in groups:
            some = rows_of(scenes, rows)._replace(drift=drift, parameters=dict(drift.values))
            try:
                length = _orders(request)[-1] + 1 + _NEXT
                series = self._series(scene_at(some, 0), request.name, length, request.reflecting)
                with np.errstate(all="ignore"):
                    logs[rows], errors[rows] = series.sampled(some, request)
            except AccuracyError as error:
                why = why or str(error)
        lost = ~_counted(logs, errors)
        if lost.any():
            refused = self._refusal(scenes.noise(np.argmax(lost)), _orders(request))
            why = why or str(refused)
        logs[lost] = np.nan
        return Answers(logs, errors, "estimate", (self.terms,), (self.beyond,), why)

    def _series(
        self, scene: Scene, name: str, length: int, reflecting: str | None = None
    ) -> _Series:
        at = LINE if name[-1] == "P" else Between(*scene.ends, scene.start, reflecting)
        return _Series(self, scene.drift, at, name, length)

    def _refusal(self, kappa: str, orders: Sequence[int]) -> AccuracyError:
        """Of a scene whose error is as large as its value."""
        return AccuracyError(
            f"kappa is {kappa}, {self.reason}: beyond order {orders[-1]} the error is as large as "
            "the value; give another order, or use method='exact'."
        )


class _Series(NamedTuple):
    """The expansion of one drift, with ends, start and the name of a quantity."""

    of: Expansion
    drift: Drift
    at: Between
    name: str
    length: int  # of each series
    in_balls: bool = False  # also at many lam, where float64 loses too much

    @property
    def rest(self) -> _Series:
        """That of the complement."""
        name = self.name.removeprefix("1 - ")
        return self._replace(name=name if name != self.name else f"1 - {name}")

    def balls(
        self, lam: Fraction, orders: Sequence[int], digits: int, log: bool
    ) -> tuple[list[Any], list[Any]]:
        """To each of the orders, good to so many digits, and the logarithms."""

        def to_orders(bits: int) -> Any:
            known, number = self._known(bits), exact_ball(lam)
            return [self.of.quantity(known, self.name, self.of.in_balls(number, n)) for n in orders]

        low, high, start, _ = self.at
        bits = (
            int(3.33 * digits) + exact.bits_of_way(*map(rational, (lam, 1 + max(-low, high)))) + 96
        )
        bits += max(int((high - low) / x).bit_length() for x in (start - low, high - start) if x)
        found = doubled(to_orders, bits - bits % -64, digits)
        if log and self.name != "T" and found[0] > 0.5:
            return found, [(-y).log1p() for y in self.rest.balls(lam, orders, digits, False)[0]]
        return found, [y.log() for y in found]

    def _known(self, bits: int) -> Any:
        return self.of.local(*self[1:5], bits)

    def logs(self, lam: FloatArray, order: int) -> FloatArray:
        """The logarithms at many lam, in steps that stay in a cache."""
        if self.in_balls:
            return np.array([float(self.balls(Fraction(x), [order], 16, True)[1][0]) for x in lam])
        known = doubled(self._known, _BITS)
        with precision(_BITS):
            sums = (
                self.of.quantity(known, self.name, self.of.in_floats(lam[k : k + _AT_ONCE], order))
                for k in range(0, len(lam), _AT_ONCE)
            )
            found = np.concatenate([y.log() for y in sums])
        if self.name != "T" and (near := np.flatnonzero(found > -0.5)).size:
            found[near] = np.log1p(-np.exp(self.rest.logs(lam[near], order)))
        return found

    def sampled(self, scenes: Scenes, request: Request) -> tuple[FloatArray, FloatArray]:
        """The logarithms and their errors, estimated at some of the lam; the best order at all."""
        lam, orders = scenes.lam, _orders(request)
        rising = np.argsort(lam) if (np.diff(lam) < 0).any() else np.arange(len(lam))
        some = rising[_few(len(lam))] if len(orders) == 1 else rising
        best, errors, lost = self._estimates(rows_of(scenes, some), request)
        if lost and not self.in_balls:
            return self._replace(in_balls=True).sampled(scenes, request)
        logs, beside = np.empty(len(lam)), np.searchsorted(lam[some], lam)
        for n in np.unique(best):
            rows = np.flatnonzero(best[beside] == n)
            logs[rows] = self.logs(lam[rows], orders[n])
        errors = _between(lam, lam[some], errors)
        # Where the estimate does not count the exact value decides, at all lam if errors are asked.
        rows = rising[np.isfinite(logs[rising]) & (errors[rising] == np.inf)]
        if rows.size:
            some = rows if request.full else rows[_few(len(rows))]
            away, missed = _distance(rows_of(scenes, some), request, logs[some])
            errors[rows] = _between(lam[rows], lam[some], away + missed)
        return logs, np.nan_to_num(errors, nan=np.inf)

    def _estimates(self, scenes: Scenes, request: Request) -> tuple[IntArray, FloatArray, bool]:
        """The place of the best of the orders, its error, infinite where it does not count, and
        whether float64 loses much, by balls at a few lam."""
        lam, orders = scenes.lam, _orders(request)
        every = np.array([self.logs(lam, n) for n in _and_next(orders)])
        apart = np.abs(np.diff(every, axis=0))
        estimates = 3 * np.array([apart[k : k + _NEXT].sum(axis=0) for k in range(len(orders))])
        estimates = np.where(_counted(every[: len(orders)], estimates), estimates, np.inf)
        best = np.argmin(estimates, axis=0)
        logs, errors = np.choose(best, every), np.choose(best, estimates)
        sure = np.flatnonzero(errors < np.inf)
        if not sure.size:
            return best, errors, False
        off, few = 0.0, sure[[0, len(sure) // 2, -1]]
        for k in few:
            ball = self.balls(Fraction(lam[k]), [orders[best[k]]], 16, True)[1][0]
            off = max(off, abs(float(ball) - logs[k]))
        errors = errors + 4 * off + 1e-15 * (1 + np.abs(logs))
        if request.full:
            away, missed = _distance(rows_of(scenes, sure), request, logs[sure])
            worst = np.nan_to_num((away - missed) / errors[sure]).max()
            errors *= 3 * worst if worst > 0.5 else 1
        return best, errors, off > 1e-13 + 1e-15 * np.abs(logs[few]).max()


def _few(count: int) -> IntArray:
    """Places of some of so many, the first and the last among them."""
    return np.linspace(0, count - 1, min(count, _SAMPLES)).astype(int)


def _between(lam: FloatArray, some: FloatArray, errors: FloatArray) -> FloatArray:
    """The errors at these lam from those at some of them, rising: between two the larger twice."""
    beside = np.searchsorted(some, lam)
    wide = 2 * np.maximum(errors[beside], errors[beside - 1])
    found: FloatArray = np.where(lam == some[beside], errors[beside], wide)
    return found


def _distance(scenes: Scenes, request: Request, logs: FloatArray) -> tuple[FloatArray, FloatArray]:
    """How far logarithms are from the exact ones, and the error of these."""
    true: Any = floats.of_scenes(scenes, request._replace(method="exact", order=None, full=True))
    return np.abs(true.logs - logs), true.errors


def _orders(request: Request) -> Sequence[int]:
    """The orders among which the best is taken, ascending."""
    return request.order if isinstance(request.order, range) else (request.order,)


def _and_next(orders: Sequence[int]) -> Sequence[int]:
    return (*orders, *range(orders[-1] + 1, orders[-1] + _NEXT + 1))


def _counted(logs: Any, errors: Any) -> Any:
    """True where a logarithm is known to a factor 2 of the value; one of 1e15 may be wrong by 1."""
    return np.isfinite(logs) & (errors < np.maximum(np.log(2), 1e-11 * np.abs(logs)))


def _exact(scene: Scene, request: Request) -> Answer | None:
    """The exact value in a ball; None where it would cost far more than the expansion."""
    if request.digits > _MOST_DIGITS:
        return None
    asked = request._replace(method="exact", order=None, dps=request.digits + 2, full=True)
    with suppress(AccuracyError):
        return exact.of_scene(scene, asked)
    return None


LAPLACE = Expansion(
    local, quantity, AtLam, AtLams,
    "wells, barriers, start, ends, kinks and the regular part",
    "higher orders of every series, in the error",
    "where the noise is too strong, or a well, a barrier or the start too close to another or to "
    "an end, for Laplace's method",
)  # fmt: skip
of_scene, of_scenes = LAPLACE.of_scene, LAPLACE.of_scenes
