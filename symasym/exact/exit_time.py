"""Exit-time quantities of one scene to a requested accuracy.

The number of powers of s and the working precision are raised as needed. For a probability at time
t the method is chosen in advance: few modes if by Weyl's law these suffice, a vertical line if the
law is narrow or the probability is small, else Talbot's contour. Theorems: `symasym.law`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from functools import cache, partial
from typing import Any

from flint import arb

from symasym.base.balls import cached_property, extra_bits, precision, rational
from symasym.base.errors import AccuracyError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import float_text
from symasym.drift.formula import exactly
from symasym.drift.scenes import Scene
from symasym.exact.balls import bits
from symasym.exact.spectral import ExitTransform, TooEarly
from symasym.exact.transform import Undecided

#: Powers of s at first.
ORDER = 12
_MOST, _MOST_BITS = 120, 1_500  # of powers; of bits beyond those that the digits take
_MODES = 8  # the largest number of modes for a probability
_NARROW = 0.3  # std/mean below which the sum over the modes cancels
_WIDTHS = 40.0  # the largest t/std
_EARLY = 0.01  # t/mean below which the probability may be negligible
_LEFT = 14.0  # t/std above which Talbot's contour is not used
_ROUGH, _SURE = 8, 12  # digits of a first attempt; bits of it that show the contour to be suitable
_NOTHING = arb(10) ** -305
_STEPS = 200
_LONG = Fraction(10**300)


class Exit:
    """The exit time of a scene to so many digits; power series in s are kept for further calls."""

    def __init__(self, scene: Scene, reflecting: str | None, digits: int) -> None:
        self.scene, self.reflecting, self.digits = scene, reflecting, digits
        self._to = cache(partial(ExitTransform, scene, reflecting))

    def ball(
        self, of: Callable[[ExitTransform], Any], order: int, size: float = 0.0, wanted: int = 0
    ) -> Any:
        """The quantity `of` to the digits wanted, by power series in s to this order or above, on
        panels for |s| <= `size`."""
        wanted = wanted or self.digits
        size = 2.0 ** math.ceil(math.log2(size)) if size else 0.0
        for more in extra_bits(_MOST_BITS):
            working = wanted + 6 + more // 8
            with precision(bits(working, more)), suppress(ZeroDivisionError, ValueError):
                found = self._reached(of, order, size, working)
                if found is None:
                    break
                if found.rel_accuracy_bits() > wanted * 3.33 + 1:
                    return found
        given = ", ".join(f"{n} = {float_text(x)}" for n, x in self.scene.numbers.items())
        raise AccuracyError(
            f"{given} leave fewer than {wanted} digits right in {_MOST_BITS:,} bits or {_MOST} "
            "powers of s; ask for fewer digits, or a number nearer to the mean or its inverse."
        )

    def _reached(
        self, of: Callable[[ExitTransform], Any], order: int, size: float, digits: int
    ) -> Any:
        """The quantity with as many powers of s as it needs; None beyond `_MOST`."""
        while order <= _MOST:
            try:
                return of(self._to(max(order, digits // 2 + 8) if size else order, size, digits))
            except Undecided:
                order += order // 3 + 4
        return None

    @cached_property
    def rate(self) -> Any:
        """The principal eigenvalue."""
        most = float(self.ball(ExitTransform.most, 5, wanted=3))
        return self.ball(lambda f: f.rates(1)[0][0], ORDER, most)

    @cached_property
    def mean(self) -> Any:
        """E[tau]."""
        return self.ball(ExitTransform.mean, 3)

    @cached_property
    def std(self) -> float:
        """The standard deviation of tau in float64."""
        return math.sqrt(self.ball(ExitTransform.variance, 3))

    def at_time(self, t: Fraction, name: str, wanted: int = 0) -> tuple[arb, ErrorKind]:
        """The survival function, cdf or pdf at a rational t."""
        wanted = max(wanted or self.digits, _ROUGH)
        if t == 0:
            return arb(name == "survival"), "bound"
        for modes in self._modes(float(min(t, _LONG))):
            with suppress(TooEarly, AccuracyError):
                late = partial(ExitTransform.late, t=rational(t), name=name, count=modes)
                order, size = ORDER + 6 * (modes - 1), modes**2 * float(self.rate)
                return self.ball(late, order, size, wanted), "bound"
        # Talbot's contour loses the digits of a value that is small compared with its integrand.
        early = float(t) < _EARLY * float(self.mean) and self._tilt(t)[1] < _NOTHING
        suits = not early and float(t) < _LEFT * self.std
        for n in (_ROUGH, wanted + 1, wanted + 15) if suits else ():
            found = self._on_contour(t, name, n)
            if found.rel_accuracy_bits() < _SURE:
                break
            if n >= wanted and found.rel_accuracy_bits() > wanted * 3.33 - 4:
                return found, "estimate"
        return self._on_line(t, name, wanted), "estimate"

    def _tilt(self, t: Fraction) -> tuple[float, arb]:
        """The c = 2^k c_0 that about minimizes e^{c t} E[e^{-c tau}], and this minimum: by Markov's
        inequality a bound of P(tau <= t) or, beyond the mean, where c < 0, of P(tau > t)."""
        early = float(t) < float(self.mean) + self.std / 2
        least = float(self.ball(ExitTransform.least, 11, wanted=3))
        c, best = max(5 / self.std, 1 / float(t)), (0.0, arb.pos_inf())
        if not early:
            c = -min(c, 0.24 * least)
        while early or 2 * abs(c) < least:
            with precision(64):
                most = (arb(rational(t)) * arb(c)).exp() * self._transform(arb(c))
            if not most < best[1]:
                break
            best, c = (c, most), 2 * c
            if most < _NOTHING:
                break
        return best

    def _transform(self, s: Any) -> Any:
        """|E[e^{-s tau}]| to three digits, rounded up."""
        size = float(abs(s).upper())
        return self.ball(lambda f: abs(f.transform(s, None)), ORDER, size, wanted=3).upper()

    def _on_line(self, t: Fraction, name: str, wanted: int) -> Any:
        """The value by inversion along the line Re s = c with nearly the smallest integrand."""
        c, most = self._tilt(t)
        complement = name == ("survival" if c > 0 else "cdf")
        if most < (arb(10) ** -wanted if complement else _NOTHING):
            return self._named(name, c, arb(0, most))
        if float(t) > _WIDTHS * self.std:
            raise AccuracyError(
                f"t is {float_text(t)} and the standard deviation {self.std:.6g}, too little for a "
                "contour; take a larger kappa, or the normal law to which this one is close."
            )
        with precision(64):
            other = 1 + (2 * arb(rational(t)) * arb(c)).exp() * self._transform(arb(2 * c))
        line = partial(
            ExitTransform.bromwich,
            t=rational(t), density=name == "pdf", c=c, most=most, other=other,
        )  # fmt: skip
        return self.ball(lambda f: self._named(name, c, line(f)), ORDER, 16 * abs(c), wanted)

    def _named(self, name: str, c: float, found: arb) -> arb:
        """The value `name` from P(tau <= t) or, for negative c, from -P(tau > t)."""
        if name == "pdf":
            return found
        return abs(found) if (name == "cdf") == (c > 0) else 1 - abs(found)

    def _modes(self, t: float) -> tuple[int, ...]:
        """The numbers of modes to be tried: one beyond the mean, more if by Weyl's law `_MODES`
        should suffice at t, and none for a narrow law."""
        if self.std < _NARROW * float(self.mean):
            return ()
        low, high = self.scene.ends
        wanted = self.digits * math.log(10) * float(self.scene.lam) / t
        few = float(high - low) / math.pi * math.sqrt(wanted) < _MODES
        several = few or t > _LEFT * self.std
        return (1, 2, 4, _MODES) if several else (1,) if t > float(self.mean) else ()

    def _on_contour(self, t: Fraction, name: str, wanted: int) -> Any:
        """The value by Talbot's contour; its error is estimated from two numbers of nodes."""
        nodes = 2 * math.ceil(0.9 * wanted) + 8
        one, two = (
            self.ball(
                partial(ExitTransform.talbot, t=rational(t), density=name == "pdf", nodes=n),
                ORDER,
                n / float(t),
                wanted,
            )
            for n in (nodes, nodes + 8)
        )
        with precision(bits(wanted)):
            found = two + arb(0, abs(one - two).upper())
            return 1 - found if name == "survival" else found

    def quantile(self, p: Fraction) -> Any:
        """t with P(tau <= t) = p, with an estimated error, by Newton's method."""
        name, share = ("cdf", p) if 2 * p <= 1 else ("survival", 1 - p)
        with precision(bits(self.digits)):
            t, places = self.mean.mid(), _ROUGH
            for _ in range(_STEPS):
                at: Any = exactly(t)
                found, slope = (self.at_time(at, key, places)[0] for key in (name, "pdf"))
                # Newton's step for log P, which is nearly linear in t.
                step = (found / arb(rational(share))).log() * found / slope
                step = -step if name == "survival" else step
                room = abs(step).upper()
                if room < t / 10 ** (self.digits - 4):
                    return t + arb(0, room)
                places = self.digits if room < t / 10 ** (_ROUGH - 3) else _ROUGH
                t = min(max(t - step.mid(), t / 2), 2 * t).mid()
        raise AccuracyError(
            f"p is {float_text(p)}, whose quantile is not found; take one further in."
        )
