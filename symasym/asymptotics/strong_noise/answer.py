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

from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.asymptotics.strong_noise import sweep
from symasym.asymptotics.strong_noise.moments import moments
from symasym.asymptotics.strong_noise.sweep import Side, Stretch, after, layer, odds, weights
from symasym.base.contexts import own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.numbers import balls
from symasym.numbers.balls import exact_ball, flint_module, precision, profile_of, to_mpf
from symasym.numbers.extended_intervals import ExtendedInterval, Undefined
from symasym.scenes.answers import Answer, Answers, Request
from symasym.scenes.scene import Scene, Scenes, input_rounding
from symasym.special.exponentials import ball_quotient

if TYPE_CHECKING:
    from flint import arb

_ATTEMPTS = 7


def of_scene(scene: Scene, request: Request) -> Answer:
    """The expansion to the order of `request`, its error proved; any region, any start."""
    if not balls.available():
        raise AccuracyError(
            "the digits of this expansion are proved with python-flint, which is not installed; "
            "install it with pip install python-flint, or use method='exact'."
        )
    return Answer(*_enclosed(scene, request), "bound", *_terms(request.order))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same in float64, with an estimate of rounding."""
    from symasym.asymptotics.strong_noise.arrays import logs

    value, errors, size = logs(scenes, request.name[-1], request.complement, request.order)
    errors = errors + input_rounding(scenes, size)
    _require_small(scenes.numbers["kappa"], errors, request.order)
    return Answers(value, errors, "estimate", *_terms(request.order))


def _terms(order: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The terms of the expansion in words, and what is left out."""
    terms = tuple(f"lam^{k} of the layer" for k in range(order + 1))
    return terms, (f"lam^{order + 1} of the layer and beyond, bounded by the error",)


def _require_small(kappa: FloatArray, errors: FloatArray, order: int) -> None:
    """Refuse where the bound is as large as the value, which is an error of log 2."""
    bad = np.flatnonzero(~(errors < np.log(2)))
    if bad.size:
        raise _too_weak(f"{kappa[bad[0]]:.6g}", order)


#: The mean of lam |A| over the layer, over the number of terms, from which on they are of no use.
_HOPELESS = 1e6


def _too_weak(kappa: str, order: int) -> AccuracyError:
    """The refusal of noise so weak that the error is as large as the value."""
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

    def tail(self, x: arb, count: int) -> Any:
        """A bound of |e^y - its first `count` terms| for all |y| <= x (Lagrange)."""
        following = x**count / flint_module().arb(count).fac()
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


class _Stretches:
    """The stretches of one scene, at Arb's precision `bits`."""

    def __init__(self, scene: Scene, order: int, bits: int) -> None:
        self._scene, self._order, self._bits = scene, order, bits
        self._lam = exact_ball(scene.lam)
        self._outer = cache(self._outer_stretch)

    def quantity(self, request: Request, number: _Balls) -> Any:
        """A ball of what is asked for."""
        log = request.log
        if request.name[-1] == "T":
            time = ExtendedInterval.of(sweep.escape_time(*self.sides(number)))
            return time.image(lambda x: x.log() if log else x)
        if request.name[-1] == "P":
            both = self.weights(number)
        else:
            left, right = self.sides(number)
            both = left.scale, right.scale
        against = ExtendedInterval.of(odds(*both, request.complement))
        return -against.image(lambda x: x.log1p() if log else -1 / (1 + x))

    def sides(self, number: _Balls) -> tuple[Side, Side]:
        """S and W on the left and on the right of the start."""
        r, start = self._scene.r, self._scene.start
        return self._swept(False, r, start, number), self._swept(True, r, -start, number)

    def _swept(self, mirrored: bool, r: Fraction, x: Fraction, number: _Balls) -> Side:
        """S and W at x, absorbed at -r."""
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
        """int e^{-lam V} over |u| > 1 and over the layer (eq:pss)."""
        stretch = self._layer(False, Fraction(-1), Fraction(1), number)
        slopes = self._slope(False, -1), -self._slope(False, 1)
        return weights(slopes, stretch, self._lam)

    def _slope(self, mirrored: bool, side: int) -> Any:
        """A ball of A at the layer's edge `side`."""
        sign = -1 if mirrored else 1
        known = self._scene.drift.end(sign * side)
        if known is not None:
            return exact_ball(sign * known)
        return sign * profile_of(self._scene.drift).value(Fraction(sign * side))

    def _outer_stretch(self, mirrored: bool, side: int, length: Fraction) -> Stretch:
        """A stretch of constant drift, in closed form."""
        x = self._slope(mirrored, side) * exact_ball(self._scene.lam * length)
        size, rising, g = exact_ball(length), ball_quotient(x, 1), x.exp()
        return Stretch(g, size * rising, size * rising / g, size * ball_quotient(x, 2) / rising)

    def _layer(self, mirrored: bool, a: Fraction, b: Fraction, number: _Balls) -> Stretch:
        """The stretch [a, b] of the layer, expanded."""
        integrals = moments(self._scene.drift, mirrored, a, b, self._order + 1, self._bits)
        return layer(integrals, self._lam, self._order, number)


def _enclosed(scene: Scene, request: Request) -> tuple[Any, Any]:
    """The expansion's value and a bound of what it and the rounding leave out."""
    digits, order, log = request.digits, request.order, request.log
    with np.errstate(all="ignore"):
        drift = np.abs(scene.drift.evaluate_float(np.linspace(-0.9, 0.9, 7)))
    if scene.lam > 10**300 or not float(scene.lam) * np.mean(drift) < _HOPELESS * (order + 1):
        raise _too_weak(scene.noise, order)
    exponent = scene.lam * (1 + scene.numbers.get("r", Fraction(0))) * 64
    bits = int(digits * 3.33) + 64 + int(exponent).bit_length()
    for _ in range(_ATTEMPTS):
        with precision(bits), own_context(digits + 10) as context:
            parts = _Stretches(scene, order, bits)

            def enclosure(
                whole: bool, parts: _Stretches = parts, bits: int = bits
            ) -> tuple[Any, Any] | None:
                """A ball of the quantity; None where it contains 0, or all numbers."""
                try:
                    return to_mpf(parts.quantity(request, _Balls(whole)), int(bits / 3.3) + 5)
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
    raise _too_weak(scene.noise, order)
