"""One exit to so many digits: powers of s and bits as needed, probabilities.

Which way serves a time is decided beforehand: few rates by Weyl's law, a vertical line where the
law is narrow or the probability small, else Talbot's contour. Theorems and symbols: `symasym.law`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

from flint import arb

from symasym.base.balls import exact_ball, precision
from symasym.base.errors import AccuracyError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import float_text
from symasym.drift.formula import rational
from symasym.drift.scenes import Scene
from symasym.exact.balls import bits
from symasym.exact.spectral import Series, TooEarly, TooFar
from symasym.exact.transform import Undecided

#: Powers of s at first, and at most.
ORDER, _MOST = 20, 120
_MOST_BITS = 1_500
_MODES = 6  # rates for a probability
_NARROW = 0.3  # std over mean, below which the sum over the modes cancels
_WIDTHS = 40.0  # t over std, at most
_EARLY = 0.01  # of the mean: times at which nothing may have happened
_LEFT = 7.0  # above which the contour is no longer bent to the left
_ROUGH, _SURE = 8, 12  # digits, and bits that show these many to be enough
_NOTHING = arb(10) ** -305
_STEPS = 200
_LONG = Fraction(10**300)


class Exit:
    """The exit time of a scene to so many digits; series that were found are kept."""

    def __init__(self, scene: Scene, reflecting: str | None, digits: int) -> None:
        self.scene, self.reflecting, self.digits = scene, reflecting, digits
        self._kept: dict[Any, Series] = {}

    def ball(
        self, of: Callable[[Series], Any], order: int, size: float = 0.0, wanted: int = 0
    ) -> Any:
        """A ball with the digits wanted; powers of s, then bits, are added until it has them."""
        wanted, more = wanted or self.digits, 0
        size = 2.0 ** math.ceil(math.log2(size)) if size else 0.0
        while order <= _MOST and more < _MOST_BITS:
            working = wanted + 6 + more // 8
            with precision(bits(working, more)), suppress(ZeroDivisionError, ValueError):
                powers = max(order, working // 2 + 8) if size else order
                key = powers, size, working, more
                if key not in self._kept:
                    self._kept[key] = Series(self.scene, self.reflecting, powers, size, working)
                try:
                    found = of(self._kept[key])
                except Undecided:
                    order += order // 3 + 4
                    continue
                except TooFar:
                    size *= 2
                    continue
                if found.rel_accuracy_bits() > wanted * 3.33 + 1:
                    return found
            more = 2 * more + 60
        given = ", ".join(f"{n} = {float_text(x)}" for n, x in self.scene.numbers.items())
        raise AccuracyError(
            f"{given} leave fewer than {wanted} digits right in {_MOST_BITS:,} bits or {_MOST} "
            "powers of s; ask for fewer digits, or a number nearer to the mean or its inverse."
        )

    @cached_property
    def rate(self) -> Any:
        """The principal eigenvalue."""
        most = float(self.ball(Series.most, 11, wanted=3))
        return self.ball(lambda f: f.rates(1)[0][0], ORDER, most)

    @cached_property
    def mean(self) -> Any:
        """E[tau]."""
        return self.ball(lambda f: f.moment(1), 3)

    @cached_property
    def std(self) -> float:
        """Of tau, about."""
        return math.sqrt(self.ball(lambda f: f.variance(), 3))

    def at_time(self, t: Fraction, name: str, wanted: int = 0) -> tuple[arb, ErrorKind]:
        """survival, cdf or pdf at a rational t."""
        wanted = wanted or self.digits
        if t == 0:
            return arb(name == "survival"), "bound"
        for modes in (1, 2, 4, _MODES) if self._few_modes(float(min(t, _LONG))) else ():
            with suppress(TooEarly):
                late = partial(Series.late, t=rational(t), name=name, count=modes)
                order, size = ORDER + 8 * (modes - 1), modes**2 * float(self.rate)
                return self.ball(late, order, size), "bound"
        if float(t) > _WIDTHS * self.std:
            raise AccuracyError(
                f"t is {float_text(t)} and the standard deviation {self.std:.6g}, too little for a "
                "contour; take a larger kappa, or the normal law to which this one is close."
            )
        # The contour bent to the left loses the digits of what is small beside its integrand.
        if (
            float(t) > _LEFT * self.std
            or (float(t) < _EARLY * float(self.mean) and self._tilt(t)[1] < _NOTHING)
            or self._on_contour(t, name, _ROUGH).rel_accuracy_bits() < _SURE
        ):
            return self._on_line(t, name, wanted), "estimate"
        for more in (1, 15):
            found = self._on_contour(t, name, wanted + more)
            if found.rel_accuracy_bits() > wanted * 3.33 - 4:
                return found, "estimate"
        raise AccuracyError(
            f"t is {float_text(t)}, where {name} is not known in {wanted} digits; take fewer, "
            "or a t nearer to the mean."
        )

    def _tilt(self, t: Fraction) -> tuple[float, arb]:
        """c, and e^{c t} E[e^{-c tau}], about the least for c = 2^k c_0, and negative c beyond the
        mean: by Markov's inequality above P(tau <= t), or P(tau > t)."""
        early = float(t) < float(self.mean) + self.std / 2
        least = float(self.ball(Series.least, 11, wanted=3))
        c, best = max(5 / self.std, 1 / float(t)), (0.0, arb.pos_inf())
        if not early:
            c = -min(c, 0.24 * least)
        while early or 2 * abs(c) < least:
            with precision(64):
                most = (exact_ball(t) * arb(c)).exp() * self._transform(arb(c))
            if not most < best[1]:
                break
            best, c = (c, most), 2 * c
            if most < _NOTHING:
                break
        return best

    def _transform(self, s: Any) -> Any:
        """|E[e^{-s tau}]|, about."""
        size = float(abs(s).upper())
        return self.ball(lambda f: abs(f.transform(s, None)), ORDER, size, wanted=3).upper()

    def _on_line(self, t: Fraction, name: str, wanted: int) -> Any:
        """By a vertical line in the plane of s, where the integrand is about the smallest."""
        c, most = self._tilt(t)
        complement = name == ("survival" if c > 0 else "cdf")
        if most < (arb(10) ** -wanted if complement else _NOTHING):
            return self._named(name, c, arb(0, most))
        with precision(64):
            other = 1 + (2 * exact_ball(t) * arb(c)).exp() * self._transform(arb(2 * c))
        line = partial(
            Series.bromwich, t=rational(t), density=name == "pdf", c=c, most=most, other=other
        )
        return self.ball(lambda f: self._named(name, c, line(f)), ORDER, 16 * abs(c), wanted)

    def _named(self, name: str, c: float, found: arb) -> arb:
        """The probability of that name from P(tau <= t), or for negative c from -P(tau > t)."""
        if name == "pdf":
            return found
        return abs(found) if (name == "cdf") == (c > 0) else 1 - abs(found)

    def _few_modes(self, t: float) -> bool:
        """True where so few rates should do, by Weyl's law."""
        low, high = self.scene.ends
        wanted = self.digits * math.log(10) * float(self.scene.lam) / t
        narrow = self.std < _NARROW * float(self.mean)
        return not narrow and float(high - low) / math.pi * math.sqrt(wanted) < _MODES

    def _on_contour(self, t: Fraction, name: str, wanted: int) -> Any:
        """By Talbot's contour with two numbers of nodes."""
        nodes = 2 * math.ceil(0.9 * wanted) + 8
        one, two = (
            self.ball(
                partial(Series.talbot, t=rational(t), density=name == "pdf", nodes=n),
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
        """t with P(tau <= t) = p, within an estimate."""
        name, share = ("cdf", p) if 2 * p <= 1 else ("survival", 1 - p)
        with precision(bits(self.digits)):
            t, places = self.mean.mid(), _ROUGH
            for _ in range(_STEPS):
                found, slope = (self.at_time(_rational(t), key, places)[0] for key in (name, "pdf"))
                # Newton's step for the logarithm, which is nearly straight.
                step = (found / exact_ball(share)).log() * found / slope
                step = -step if name == "survival" else step
                room = abs(step).upper()
                if room < t / 10 ** (self.digits - 4):
                    return t + arb(0, room)
                places = self.digits if room < t / 10 ** (_ROUGH - 3) else _ROUGH
                t = min(max(t - step.mid(), t / 2), 2 * t).mid()
        raise AccuracyError(
            f"p is {float_text(p)}, whose quantile is not found; take one further in."
        )


def _rational(x: arb) -> Fraction:
    """A point."""
    mantissa, power = x.man_exp()
    return Fraction(int(mantissa)) * Fraction(2) ** int(power)
