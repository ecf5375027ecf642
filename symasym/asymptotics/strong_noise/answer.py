"""Strong noise: expansions in lam = 2/kappa^2 that hold uniformly in r/kappa^2.

Inside the layer e^{lam V} is expanded in powers of lam (`sweep.layer`); outside
it everything is closed form, and its exponentials, with that of V(1) - V(-1),
are kept. The sweeps are those of docs/exact.md, so that all terms are positive
but those of the expansion itself.

What N terms leave out of a layer integral is the next term, which is known, and
a tail that is bounded. Both are carried through the sweep in balls: the error
is proved.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np

from symasym.asymptotics.strong_noise import sweep
from symasym.asymptotics.strong_noise.moments import moments
from symasym.asymptotics.strong_noise.sweep import Side, Stretch, after, layer, odds, weights
from symasym.base.contexts import own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, float_text
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    Request,
    as_digits,
    as_floats,
    exact_scene,
    float_scenes,
    input_rounding,
    one_scene,
    read_order,
)
from symasym.exact.ball_panels import exp_quotient
from symasym.numbers import balls
from symasym.numbers.balls import exact_ball, flint_module, precision, profile_of, to_mpf
from symasym.numbers.extended_intervals import ExtendedInterval, Undefined

DEFAULT_ORDER = 2
MOST_ORDER = 100
_ATTEMPTS = 7


def escape_time(drift: Drift, kappa: Any, r: Any, start: Any, request: Request) -> Any:
    """T of eq:Ttilde to the order that `request` asks for; any region, any start."""

    def combined(scene: _Scene, number: _Balls) -> Any:
        time = sweep.escape_time(*scene.sides(number))
        return ExtendedInterval.of(time).image(lambda x: x.log() if request.log else x)

    return _answer(drift, {"kappa": kappa, "r": r, "start": start}, request, combined)


def exit_probability(
    drift: Drift, kappa: Any, r: Any, start: Any, complement: bool, request: Request
) -> Any:
    """C of eq:C, or 1 - C, to the order that `request` asks for; any region, any start."""

    def combined(scene: _Scene, number: _Balls) -> Any:
        left, right = scene.sides(number)
        return _share(odds(left.scale, right.scale, complement), request.log)

    numbers = {"kappa": kappa, "r": r, "start": start}
    return _answer(drift, numbers, request, combined, complement)


def occupation(drift: Drift, kappa: Any, complement: bool, request: Request) -> Any:
    """P of eq:P, or 1 - P, to the order that `request` asks for; sliding only."""

    def combined(scene: _Scene, number: _Balls) -> Any:
        return _share(odds(*scene.weights(number), complement), request.log)

    return _answer(drift, {"kappa": kappa}, request, combined, complement)


def _share(odds: Any, log: bool) -> Any:
    """The chance 1/(1 + odds) against something, or its logarithm, as a ball."""
    whole = ExtendedInterval.of(odds)
    return -whole.image(lambda x: x.log1p() if log else -1 / (1 + x))


def _answer(
    drift: Drift,
    numbers: dict[str, Any],
    request: Request,
    combined: Callable[[_Scene, _Balls], Any],
    complement: bool = False,
) -> Any:
    order = read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    request = request._replace(order=order)
    terms = tuple(f"lam^{k} of the layer" for k in range(order + 1))
    dropped = (f"lam^{order + 1} of the layer and beyond, bounded by the error",)
    scalar = one_scene(drift, numbers)
    if request.dps is None and not (scalar and request.full and balls.available()):
        from symasym.asymptotics.strong_noise import arrays as strong_noise_double

        scenes = float_scenes(drift, numbers)
        logs, errors, size = strong_noise_double.logs(
            drift, scenes, request.name[-1], complement, order
        )
        errors = errors + input_rounding(scenes, size)
        _require_small(scenes.numbers["kappa"], errors, order)
        return as_floats(request, scenes.shape, logs, errors, "estimate", terms, dropped)
    values = exact_scene(drift, numbers, request.dps)
    digits = request.digits
    if not balls.available():
        raise AccuracyError(
            "the digits of this expansion are proved with python-flint, which is not installed; "
            "install it with pip install python-flint, or use method='exact'."
        )
    value, error = _enclosed(drift, values, digits, order, request.log, combined)
    return as_digits(request, value, error, "bound", terms, dropped)


def _require_small(kappa: FloatArray, errors: FloatArray, order: int) -> None:
    """Refuse where the bound is as large as the value, which is an error of log 2."""
    bad = np.flatnonzero(~(errors < np.log(2)))
    if bad.size:
        raise _too_weak(f"{kappa[bad[0]]:.6g}", order)


def _too_weak(kappa: str, order: int) -> AccuracyError:
    return AccuracyError(
        f"kappa is {kappa}, where the noise is so weak that {order + 1} terms in 2/kappa^2 leave "
        "an error as large as the value; give a larger order, or use method='exact'."
    )


# -- one scene, in balls ---------------------------------------------------------------------------


class _Negative(Exception):
    """A truncated integral of something positive is negative: the noise is far too weak."""


class _Balls:
    """Enclosures of the whole series, or (not `whole`) of the terms that are kept."""

    def __init__(self, whole: bool) -> None:
        self._whole = whole

    def tail(self, x: Any, count: int) -> Any:
        following = x**count / flint_module().arb(count).fac()
        ratio = x / (count + 1)
        # Below a geometric series, and below e^x.
        return following * (x.exp().min(1 / (1 - ratio)) if ratio < 1 else x.exp())

    def exponential(self, x: Any) -> Any:
        return x.exp()

    def truncated(self, terms: list[Any], tail: Any, size: Any, x: Any) -> Any:
        if self._whole:
            value, reach, most = sum(terms[1:], terms[0]), tail * size, x.exp()
            low, high = (value - reach).max(size / most), (value + reach).min(size * most)
            return ExtendedInterval(low, high)
        kept = sum(terms[1:-1], terms[0])
        if kept < 0:
            raise _Negative
        return kept


class _Scene:
    """The stretches of one scene, at Arb's precision `bits`."""

    def __init__(self, drift: Drift, values: dict[str, Fraction], order: int, bits: int) -> None:
        self._drift, self._values, self._order, self._bits = drift, values, order, bits
        self._exactly = 2 / values["kappa"] ** 2
        self._lam = exact_ball(self._exactly)
        self._outer = cache(self._outer_stretch)

    def sides(self, number: _Balls) -> tuple[Side, Side]:
        r, start = self._values["r"], self._values["start"]
        return self._swept(False, r, start, number), self._swept(True, r, -start, number)

    def _swept(self, mirrored: bool, r: Fraction, x: Fraction, number: _Balls) -> Side:
        one, side = Fraction(1), None
        stretches = []
        if r > 1:
            stretches.append(self._outer(mirrored, -1, min(-one, x) + r))
        if x > -1:
            stretches.append(self._layer(mirrored, max(-one, -r), min(x, one), number))
        if x > 1:
            stretches.append(self._outer(mirrored, 1, x - 1))
        for stretch in stretches:
            side = after(side, stretch, self._lam)
        assert side is not None
        return side

    def weights(self, number: _Balls) -> tuple[Any, Any]:
        stretch = self._layer(False, Fraction(-1), Fraction(1), number)
        slopes = self._slope(False, -1), -self._slope(False, 1)
        return weights(slopes, stretch, self._lam)

    def _slope(self, mirrored: bool, side: int) -> Any:
        sign = -1 if mirrored else 1
        known = self._drift.end(sign * side)
        if known is not None:
            return exact_ball(sign * known)
        return sign * profile_of(self._drift).value(Fraction(sign * side))

    def _outer_stretch(self, mirrored: bool, side: int, length: Fraction) -> Stretch:
        x = self._slope(mirrored, side) * exact_ball(self._exactly * length)
        size, rising, g = exact_ball(length), exp_quotient(x, 1), x.exp()
        return Stretch(g, size * rising, size * rising / g, size * exp_quotient(x, 2) / rising)

    def _layer(self, mirrored: bool, a: Fraction, b: Fraction, number: _Balls) -> Stretch:
        found = moments(self._drift, mirrored, a, b, self._order + 1, self._bits)
        return layer(found, self._lam, self._order, number)


def _enclosed(
    drift: Drift,
    values: dict[str, Fraction],
    digits: int,
    order: int,
    log: bool,
    combined: Callable[[_Scene, _Balls], Any],
) -> tuple[Any, Any]:
    """The expansion's value and a bound of what it and the rounding leave out."""
    exponent = 2 / values["kappa"] ** 2 * (1 + values.get("r", Fraction(0))) * 64
    bits = int(digits * 3.33) + 64 + int(exponent).bit_length()
    for _ in range(_ATTEMPTS):
        with precision(bits), own_context(digits + 10) as context:
            scene = _Scene(drift, values, order, bits)

            def enclosure(
                whole: bool, scene: _Scene = scene, bits: int = bits
            ) -> tuple[Any, Any] | None:
                try:
                    return to_mpf(combined(scene, _Balls(whole)), int(bits / 3.3) + 5)
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
    raise _too_weak(float_text(values["kappa"]), order)
