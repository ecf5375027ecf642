"""Strong noise: expansions in lam = 2/kappa^2 that hold uniformly in r/kappa^2.

Inside the layer e^{lam V} is expanded in powers of lam (`sweep.layer_record`); outside
it everything is closed form, and its exponentials, with that of V(1) - V(-1),
are kept. The sweeps are those of docs/exact.md, so that all terms are positive
but those of the expansion itself.

What N terms leave out of a layer integral is the next term, which is known, and
a tail that is bounded. Both are carried through the sweep in balls: the error
is proved.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import flint
import numpy as np

from symasym.asymptotics.strong_noise.panel import (
    Record,
    Swept,
    carried,
    escape_time,
    first,
    straight,
)
from symasym.asymptotics.strong_noise.sweep import (
    layer_record,
    moments,
    odds_outside,
    odds_right,
    sides,
)
from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.numbers.balls import exact_ball, precision, profile_of, to_mpf
from symasym.numbers.extended_intervals import ExtendedInterval, Undefined
from symasym.scenes import Answer, Answers, Request, Scene, Scenes, input_rounding

if TYPE_CHECKING:
    from flint import arb

_ATTEMPTS = 7


def of_scene(scene: Scene, request: Request) -> Answer:
    """The expansion to the order of `request`, its error proved; any region, any start."""
    return Answer(*_enclosed(scene, request), "bound", *_terms(request.order))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same in float64, with an estimate of rounding."""
    from symasym.asymptotics.strong_noise.arrays import logs

    value, errors, size = logs(scenes, request.name[-1], request.complement, request.order)
    errors = errors + input_rounding(scenes, size)
    with np.errstate(over="ignore"):
        exponent = scenes.lam * size
    _require_small(scenes.numbers["kappa"], errors, request.order, exponent)
    return Answers(value, errors, "estimate", *_terms(request.order))


def _terms(order: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The terms of the expansion in words, and what is left out."""
    terms = tuple(f"lam^{k} of the layer" for k in range(order + 1))
    return terms, (f"lam^{order + 1} of the layer and beyond, bounded by the error",)


def _require_small(kappa: FloatArray, errors: FloatArray, order: int, exponent: FloatArray) -> None:
    """Refuse where the bound is as large as the value, which is an error of log 2."""
    bad = np.flatnonzero(~(errors < np.log(2)))
    if bad.size:
        raise _too_weak(f"{kappa[bad[0]]:.6g}", order, exponent[bad[0]])


#: The mean of lam |A| over the layer, over the number of terms, from which on they are of no use.
_HOPELESS = 1e6


#: Size of lam A from which on no order that may be asked for is of use.
_MOST_EXPONENT = 1000


def _too_weak(kappa: str, order: int, exponent: float) -> AccuracyError:
    """The refusal of noise so weak that the error is as large as the value, `exponent` being the
    size of lam A."""
    advice = "give a larger order, or" if exponent < _MOST_EXPONENT else "no order helps;"
    return AccuracyError(
        f"kappa is {kappa}, where the noise is so weak that {order + 1} terms in 2/kappa^2 leave "
        f"an error as large as the value; {advice} use method='exact'."
    )


# -- one scene, in balls ---------------------------------------------------------------------------


class _Negative(Exception):
    """A truncated integral of something positive is negative: the noise is far too weak."""


class _Balls:
    """Enclosures of the whole series, or (not `whole`) of the terms that are kept."""

    def __init__(self, whole: bool) -> None:
        self._whole = whole

    def tail(self, x: arb, count: int) -> Any:
        """A bound of |e^y - its first `count` terms| for all |y| <= x (Lagrange)."""
        following = x**count / flint.arb(count).fac()
        ratio = x / (count + 1)
        # Below a geometric series, and below e^x.
        return following * (x.exp().min(1 / (1 - ratio)) if ratio < 1 else x.exp())

    def exponential(self, x: arb) -> Any:
        """A ball of e^x."""
        return x.exp()

    def truncated(self, terms: list[Any], tail: arb, size: arb, x: arb) -> Any:
        """The terms kept, or a ball of the whole series (`sweep.Arithmetic`)."""
        if self._whole:
            value, reach, most = sum(terms[1:], terms[0]), tail * size, x.exp()
            low, high = (value - reach).max(size / most), (value + reach).min(size * most)
            return ExtendedInterval(low, high)
        kept = sum(terms[1:-1], terms[0])
        if kept < 0:
            raise _Negative
        return kept


class _OneScene:
    """The stretches of one scene (`sweep.Stretches`), at Arb's precision `bits`."""

    nothing = None

    def __init__(self, scene: Scene, order: int, bits: int, number: _Balls) -> None:
        self._drift, self._order, self._bits, self._number = scene.drift, order, bits, number
        self._lam, self.lam = scene.lam, exact_ball(scene.lam)

    def behind(self, state: Swept | None, length: Fraction, record: Callable[[], Record]) -> Any:
        """sigma and w behind one more stretch, if its length is positive."""
        if length <= 0:
            return state
        return first(record(), self.lam) if state is None else carried(state, record(), self.lam)

    def slope(self, mirrored: bool, side: int = -1) -> Any:
        """A ball of phi left (side -1) or right (1) of the layer."""
        sign = -1 if mirrored else 1
        known = self._drift.end(sign * side)
        if known is not None:
            return exact_ball(sign * known)
        return sign * profile_of(self._drift).value(Fraction(sign * side))

    def outside(self, mirrored: bool, side: int, length: Fraction) -> Record:
        """A stretch of constant drift, in closed form."""
        return straight(self.lam * self.slope(mirrored, side), exact_ball(length))

    def layer(self, mirrored: bool, a: Fraction, b: Fraction) -> Record:
        """The stretch [a, b] of the layer, expanded."""
        ends = Fraction(a), Fraction(b)
        integrals = moments(self._drift, mirrored, *ends, self._order + 1, self._bits)
        return layer_record(integrals, self.lam, self._order, self._number)


def _quantity(scene: Scene, request: Request, of: _OneScene) -> Any:
    """A ball of what is asked for."""
    log = request.log
    if request.name[-1] == "P":
        against = odds_outside(of, request.complement, Fraction(1))
    else:
        both = sides(of, scene.r, scene.start)
        if request.name[-1] == "T":
            time = ExtendedInterval.of(escape_time(*both))
            return time.image(lambda x: x.log() if log else x)
        against = odds_right(*both, request.complement)
    return -ExtendedInterval.of(against).image(lambda x: x.log1p() if log else -1 / (1 + x))


def _enclosed(scene: Scene, request: Request) -> tuple[Any, Any]:
    """The expansion's value and a bound of what it and the rounding leave out."""
    digits, order, log = request.digits, request.order, request.log
    with np.errstate(all="ignore"):
        size = np.mean(np.abs(scene.drift.evaluate_float(np.linspace(-0.9, 0.9, 7))))
    exponent_size = float(scene.lam) * float(size) if scene.lam < 10**300 else math.inf
    if not exponent_size < _HOPELESS * (order + 1):
        raise _too_weak(scene.noise, order, exponent_size)
    exponent = scene.lam * (1 + scene.numbers.get("r", Fraction(0))) * 64
    bits = int(digits * 3.33) + 64 + int(exponent).bit_length()
    for _ in range(_ATTEMPTS):
        with precision(bits), own_context(digits + 10) as context:

            def enclosure(whole: bool, bits: int = bits) -> tuple[Any, Any] | None:
                """A ball of the quantity; None where it contains 0, or all numbers."""
                of = _OneScene(scene, order, bits, _Balls(whole))
                try:
                    return to_mpf(_quantity(scene, request, of), int(bits / 3.3) + 5)
                except (AccuracyError, ZeroDivisionError, Undefined):
                    return None  # what contains 0, or all numbers

            unit = context.mpf(10) ** -digits
            try:
                first = enclosure(False)
            except _Negative:
                break
            if first is None or first[1] > unit * max(abs(first[0]), unit if log else 0):
                bits *= 2
                continue
            whole = enclosure(True)
            if whole is None:
                break
            value, rounding = (context.make_mpf(x._mpf_) for x in first)
            middle, width = (context.make_mpf(x._mpf_) for x in whole)
            error = (abs(middle - value) + width + rounding) * (1 + context.mpf(10) ** -8)
            if not error < (context.log(2) if log else abs(value)):
                break
            return value, error
    raise _too_weak(scene.noise, order, exponent_size)
