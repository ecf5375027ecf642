"""Strong noise: expansions in lam = 2/kappa^2 that hold uniformly in r/kappa^2.

Inside the layer e^{lam V} is expanded in powers of lam; outside it everything
is closed form, and its exponentials, with that of V(1) - V(-1), are kept. The
sweeps are those of docs/exact.md, so that all terms are positive but those of
the expansion itself.

What N terms leave out of a layer integral is the next term, which is known,
and a rest below length * x^{N+2}/(N+2)! e^x with x = lam (max V - min V). Both
are carried through the sweep: the error is proved.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.strong_noise.moments import Moments, moments
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
from symasym.exact import ball_sweep
from symasym.numbers.intervals import Intervals, intervals, quotients

DEFAULT_ORDER = 2
MOST_ORDER = 100
_ATTEMPTS = 7


def escape_time(drift: Drift, kappa: Any, r: Any, start: Any, request: Request) -> Any:
    """T of eq:Ttilde to the order that `request` asks for; any region, any start."""

    def combined(left: _Side, right: _Side, number: Intervals) -> Any:
        time = (left.work * right.scale + right.work * left.scale) / (left.scale + right.scale)
        return number.log(time) if request.log else time

    return _answer(drift, {"kappa": kappa, "r": r, "start": start}, request, combined)


def exit_probability(
    drift: Drift, kappa: Any, r: Any, start: Any, complement: bool, request: Request
) -> Any:
    """C of eq:C, or 1 - C, to the order that `request` asks for; any region, any start."""

    def combined(left: _Side, right: _Side, number: Intervals) -> Any:
        ratio = right.scale / left.scale if complement else left.scale / right.scale
        return _share(ratio, request.log, number)

    numbers = {"kappa": kappa, "r": r, "start": start}
    return _answer(drift, numbers, request, combined, complement)


def occupation(drift: Drift, kappa: Any, complement: bool, request: Request) -> Any:
    """P of eq:P, or 1 - P, to the order that `request` asks for; sliding only."""

    def combined(left: _Side, right: _Side, number: Intervals) -> Any:
        ratio = right.scale / left.scale if complement else left.scale / right.scale
        return _share(ratio, request.log, number)

    return _answer(drift, {"kappa": kappa}, request, combined, complement)


def _share(ratio: Any, log: bool, number: Intervals) -> Any:
    """part/(part + rest) of ratio = rest/part."""
    return -number.log1p(ratio) if log else 1 / (1 + ratio)


def _answer(
    drift: Drift,
    numbers: dict[str, Any],
    request: Request,
    combined: Callable[[_Side, _Side, Intervals], Any],
    complement: bool = False,
) -> Any:
    order = read_order(request.order, DEFAULT_ORDER, MOST_ORDER)
    request = request._replace(order=order)
    terms = tuple(f"lam^{k} of the layer" for k in range(order + 1))
    dropped = (f"lam^{order + 1} of the layer and beyond, bounded by the error",)
    scalar = one_scene(drift, numbers)
    if request.dps is None and not (scalar and request.full and _provable(drift)):
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
    value, error = _enclosed(drift, values, digits, order, request.log, combined)
    return as_digits(request, value, error, "bound", terms, dropped)


def _provable(drift: Drift) -> bool:
    return ball_sweep.available() or drift.exact_coefficients() is not None


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


# -- digits ----------------------------------------------------------------------------------------


class _Negative(Exception):
    """A truncated integral of something positive is negative: the noise is far too weak."""


class _Side(NamedTuple):
    """S and its time at the point reached, both in units of e^{lam V} there (as in ball_sweep)."""

    scale: Any
    work: Any


class _Piece(NamedTuple):
    """g = e^{lam (V(a) - V(b))} of a stretch [a, b] and its integrals."""

    g: Any
    near: Any
    far: Any
    nested: Any


def _enclosed(
    drift: Drift,
    values: dict[str, Fraction],
    digits: int,
    order: int,
    log: bool,
    combined: Callable[[_Side, _Side, Intervals], Any],
) -> tuple[Any, Any]:
    """The expansion's value and a bound of what it and the rounding leave out."""
    lam = 2 / values["kappa"] ** 2
    exponent = lam * (1 + values.get("r", Fraction(0))) * 64
    bits = int(digits * 3.33) + 64 + int(exponent).bit_length()
    for _ in range(_ATTEMPTS):
        with intervals(bits) as number, own_context(digits + 10) as context:
            pieces = _Pieces(drift, values, lam, order, number)

            def enclosure(
                whole: bool, pieces: _Pieces = pieces, number: Intervals = number
            ) -> tuple[Any, Any] | None:
                sides = pieces.sides(whole)
                try:
                    found = number.middle(combined(*sides, number))
                except (AccuracyError, ArithmeticError, ValueError):
                    return None  # an interval that contains 0, or all numbers
                return found

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


class _Pieces:
    """The stretches of one scene, in intervals."""

    def __init__(
        self,
        drift: Drift,
        values: dict[str, Fraction],
        lam: Fraction,
        order: int,
        number: Intervals,
    ) -> None:
        self._drift, self._values, self._order = drift, values, order
        self._number, self._lam = number, lam
        self._profiles: dict[bool, Any] = {}
        self._moments: dict[bool, Moments] = {}

    def sides(self, whole: bool) -> tuple[_Side, _Side]:
        """Both sweeps up to the start; with what is left out enclosed if `whole`."""
        if "r" not in self._values:
            return self._stationary(whole)
        r, start = self._values["r"], self._values["start"]
        return self._swept(False, r, start, whole), self._swept(True, r, -start, whole)

    def _swept(self, mirrored: bool, r: Fraction, x: Fraction, whole: bool) -> _Side:
        number, one = self._number, Fraction(1)
        scale = work = number.of(Fraction(0))
        pieces = []
        if r > 1:
            pieces.append(self._outer(mirrored, -1, min(-one, x) + r))
        if x > -1:
            pieces.append(self._layer(mirrored, max(-one, -r), min(x, one), whole))
        if x > 1:
            pieces.append(self._outer(mirrored, 1, x - 1))
        lam = number.of(self._lam)
        for piece in pieces:
            work = work + lam * (scale * piece.far + piece.nested)
            scale = scale * piece.g + piece.near
        return _Side(scale, work)

    def _stationary(self, whole: bool) -> tuple[_Side, _Side]:
        """Weights of the outside and of the inside, e^{-lam V} integrated."""
        number = self._number
        layer = self._layer(False, Fraction(-1), Fraction(1), whole)
        slopes = self._slope(False, -1), -self._slope(False, 1)
        outside = (1 / slopes[0] + layer.g / slopes[1]) / number.of(self._lam)
        return _Side(outside, None), _Side(layer.far, None)

    def _slope(self, mirrored: bool, side: int) -> Any:
        sign = -1 if mirrored else 1
        known = self._drift.end(sign * side)
        if known is not None:
            return self._number.of(sign * known)
        from symasym.numbers.balls import profile_of

        return sign * profile_of(self._drift).value(Fraction(sign * side))

    def _outer(self, mirrored: bool, side: int, length: Fraction) -> _Piece:
        number = self._number
        x = self._slope(mirrored, side) * number.of(self._lam * length)
        first, second = quotients(x, number)
        size = number.of(length)
        return _Piece(number.exp(x), size * first, size * first, size * size * second)

    def _layer(self, mirrored: bool, a: Fraction, b: Fraction, whole: bool) -> _Piece:
        number, order = self._number, self._order
        if mirrored not in self._moments:
            self._moments[mirrored] = moments(
                self._drift, mirrored, a, b, order + 1, self._number.bits
            )
        found = self._moments[mirrored]
        lam, length = number.of(self._lam), _in(number, found.length)
        x = lam * _in(number, found.spread)
        powers = [number.of(Fraction(1))]
        for _ in range(order + 1):
            powers.append(powers[-1] * lam)
        rest = x
        for k in range(2, order + 3):
            rest = rest * x / k
        rest = rest * number.exp(x) if not x < order + 3 else rest / (1 - x / (order + 3))

        def total(values: list[Any], size: Any) -> Any:
            count = order + 2 if whole else order + 1
            parts = [_in(number, v) * p for v, p in zip(values[:count], powers, strict=False)]
            result = sum(parts[1:], parts[0])
            if not whole and result < 0:
                raise _Negative
            return number.about(result, rest * size) if whole else result

        return _Piece(
            number.exp(lam * _in(number, found.drop)),
            total(found.near, length),
            total(found.far, length),
            total(found.nested, length * length / 2),
        )


def _in(number: Intervals, value: Any) -> Any:
    """A rational as an interval; an interval as it is."""
    return number.of(value) if isinstance(value, Fraction) or hasattr(value, "numer") else value
