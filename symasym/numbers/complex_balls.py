"""The range of a drift over complex balls, which shows what samples of it can miss.

Samples cannot tell a smooth function from one with a needle between them; a
bound on a complex ball can, since whatever is narrow on the real line is huge,
or singular, a little off it. A ball here has a real centre, so that one
evaluation of the drift at the centre carries its radius along; every rule
below is a bound, except that rounding (1e-16 of it) is only added where the
operations have an `ulp`.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np

from symasym.numbers.arithmetic import Number
from symasym.numbers.trees import FUNCTIONS, MpmathOps, NumpyOps

#: A function whose change over a ball of twice a panel's half-width stays below this many
#: times its size on the panel has no feature that 17 nodes there could miss: a needle of
#: width w would change by e^((h/w)^2), a pole would make it infinite.
RESOLVED = 1e6


class ComplexBall:
    """All complex numbers within `radius` of the real `centre`; arrays, or numbers of mpmath.

    A radius that is not finite says that nothing is known.
    """

    __slots__ = ("_base", "centre", "radius")
    __array_ufunc__ = None  # an ndarray on the left must defer to our operators

    centre: Any
    radius: Any

    def __init__(self, centre: Number, radius: Number, base: ComplexBallOps) -> None:
        self.centre, self.radius, self._base = centre, radius, base

    def _other(self, value: ComplexBall | Number) -> ComplexBall:
        return value if isinstance(value, ComplexBall) else self._with(value, 0 * abs(value))

    def _with(self, centre: Number, radius: Number) -> ComplexBall:
        """The ball of this centre and radius, widened by the rounding of the centre."""
        if self._base.ulp:
            radius = radius + self._base.ulp * abs(centre)
        return ComplexBall(centre, radius, self._base)

    def __neg__(self) -> ComplexBall:
        return ComplexBall(-self.centre, self.radius, self._base)

    def __add__(self, other: ComplexBall | Number) -> ComplexBall:
        y = self._other(other)
        return self._with(self.centre + y.centre, self.radius + y.radius)

    __radd__ = __add__

    def __sub__(self, other: ComplexBall | Number) -> ComplexBall:
        return self + (-self._other(other))

    def __rsub__(self, other: ComplexBall | Number) -> ComplexBall:
        return self._other(other) + (-self)

    def __mul__(self, other: ComplexBall | Number) -> ComplexBall:
        y = self._other(other)
        return self._with(
            self.centre * y.centre,
            abs(self.centre) * y.radius + abs(y.centre) * self.radius + self.radius * y.radius,
        )

    __rmul__ = __mul__

    def __truediv__(self, other: ComplexBall | Number) -> ComplexBall:
        return self * self._other(other).reciprocal()

    def __rtruediv__(self, other: ComplexBall | Number) -> ComplexBall:
        return self._other(other) * self.reciprocal()

    def reciprocal(self) -> ComplexBall:
        """The ball of 1/z: |1/z - 1/c| <= r/(|c| (|c| - r))."""
        size = abs(self.centre)
        inverse = self._base.inverse(size)
        rest = self._base.inverse(size - self.radius)
        return self._with(inverse * self._base.sign(self.centre), self.radius * inverse * rest)


class ComplexBallOps:
    """The elementary functions of balls over the numbers of `real`.

    Parameters
    ----------
    real : NumpyOps or MpmathOps
    ulp : float
        Relative rounding of one operation; a function is allowed two of them.
    """

    def __init__(
        self,
        real: NumpyOps | MpmathOps,
        ulp: float = 0.0,
        known: dict[Any, Any] | None = None,
    ) -> None:
        self.real, self.ulp, self.known = real, ulp, known
        self._arrays = isinstance(real, NumpyOps)

    def ball(self, centre: Number, radius: Number) -> ComplexBall:
        """The ball of this centre and radius, widened by the rounding of both."""
        if self.ulp:
            radius = radius + 2 * self.ulp * abs(centre)
        return ComplexBall(centre, radius, self)

    def _where_real(self, centre: Number, radius: Number) -> ComplexBall:
        """Nothing known where a function of a real centre is not real."""
        if hasattr(centre, "_mpc_"):
            centre = self.real.context.nan
        return self.ball(centre, radius + 0 * centre)

    def inverse(self, gap: Number) -> Any:
        """1/gap, infinite unless gap > 0."""
        if self._arrays:
            with np.errstate(divide="ignore"):
                return 1.0 / np.maximum(gap, 0.0)
        return 1 / gap if gap > 0 else self.real.context.inf

    def least(self, x: Number, y: Number) -> Any:
        """The smaller one; what is not a number counts as infinite."""
        if self._arrays:
            return np.fmin(x, y)
        return y if not x < y else x

    def sign(self, x: Number) -> Any:
        """-1 or 1, the latter at 0."""
        if self._arrays:
            return np.where(np.asarray(x) < 0, -1.0, 1.0)
        return -1 if x < 0 else 1

    def rational(self, value: Fraction) -> Any:
        return self.real.rational(value)

    def pi(self) -> Any:
        return self.real.pi()

    def _lift(self, x: ComplexBall | Number) -> ComplexBall:
        """A number as the ball of radius 0."""
        return x if isinstance(x, ComplexBall) else self.ball(x, 0 * abs(x))

    def exp(self, x: ComplexBall | Number) -> ComplexBall:
        """e^z, whose distance from e^c is at most e^c (e^r - 1)."""
        z = self._lift(x)
        top = z.centre + z.radius
        if self._too_large(top):
            return self.ball(z.centre, self.real.context.inf)
        value = self.real.exp(z.centre)
        return self.ball(value, self.real.exp(top) - value)

    def _too_large(self, x: Number) -> bool:
        """True where mpmath would go on with numbers whose exponents grow without end."""
        return not self._arrays and not x < 2**1000

    def power(self, base: ComplexBall | Number, exponent: Fraction) -> ComplexBall:
        """z^p; the coefficients of (1 + t)^p are at most those of (1 - t)^-|p|."""
        # The coefficients of (1 + t)^p are at most those of (1 - t)^-|p|.
        z = self._lift(base)
        value = self.real.power(z.centre, exponent)
        reach = abs(z.centre) * self.inverse(abs(z.centre) - z.radius)
        return self._where_real(value, abs(value) * (self.real.power(reach, abs(exponent)) - 1))

    def sqrt(self, x: ComplexBall | Number) -> ComplexBall:
        """The square root."""
        return self.power(x, Fraction(1, 2))

    def log(self, x: ComplexBall | Number) -> ComplexBall:
        """log z, whose distance from log c is at most -log(1 - r/|c|)."""
        z = self._lift(x)
        reach = abs(z.centre) * self.inverse(abs(z.centre) - z.radius)
        return self._where_real(self.real.log(z.centre), self.real.log(reach))

    def sin(self, x: ComplexBall | Number) -> ComplexBall:
        """sin z (see `_wave`)."""
        return self._wave(x, "sin", "cos")

    def cos(self, x: ComplexBall | Number) -> ComplexBall:
        """cos z."""
        return self._wave(x, "cos", "sin")

    def sinh(self, x: ComplexBall | Number) -> ComplexBall:
        """sinh z."""
        return self._wave(x, "sinh", "cosh")

    def cosh(self, x: ComplexBall | Number) -> ComplexBall:
        """cosh z."""
        return self._wave(x, "cosh", "sinh")

    def _wave(self, x: ComplexBall | Number, name: str, slope: str) -> ComplexBall:
        """f(c + d) = f(c) cosh(d) + f'(c) sinh(d), or the same with cos(d) and sin(d)."""
        z = self._lift(x)
        if self._too_large(abs(z.centre) + z.radius):
            return self.ball(z.centre, self.real.context.inf)
        value, other = getattr(self.real, name)(z.centre), getattr(self.real, slope)(z.centre)
        grown = self.real.exp(z.radius)
        return self.ball(
            value,
            abs(value) * (self.real.cosh(z.radius) - 1) + abs(other) * (grown - 1 / grown) / 2,
        )

    def tan(self, x: ComplexBall | Number) -> ComplexBall:
        """tan z = sin z/cos z."""
        return self.sin(x) / self.cos(x)

    def tanh(self, x: ComplexBall | Number) -> ComplexBall:
        """tanh z, by its addition theorem or by the exponential, whichever is narrower."""
        z = self._lift(x)
        # tanh(c + d) - tanh(c) = sinh(d)/(cosh(c) cosh(c + d)), and |cosh|^2 is sinh^2 of the
        # real part plus cos^2 of the imaginary one.
        size, real = abs(z.centre), self.real
        if self._too_large(size + z.radius):
            gap = size - z.radius
            # Of these functions the exponentials alone.
            change = 2.4 * real.exp(-2 * min(gap, 2**20)) if gap > 1 else real.context.inf
            return self.ball(real.tanh(z.centre), change)
        inner = real.sinh((size - z.radius + abs(size - z.radius)) / 2)
        wide = z.radius >= 1.5
        least = inner * inner + (1 - wide) * real.cos(z.radius * (1 - wide)) ** 2
        change = (
            real.sinh(z.radius) * self.inverse(real.cosh(size)) * self.inverse(real.sqrt(least))
        )
        # Beyond that, 2/(1 + e^(-2 z)) - 1 on the side on which the exponential is small.
        switch = 2 / (1 + self.exp(-2 * self.sign(z.centre) * z))
        return self.ball(real.tanh(z.centre), self.least(change, switch.radius))

    def erf(self, x: ComplexBall | Number) -> ComplexBall:
        """erf z, by its largest slope: Re z^2 >= c^2/2 - r^2 on the ball."""
        z = self._lift(x)
        # Re z^2 >= c^2/2 - r^2 on the ball, and |erf'| = 2/sqrt(pi) e^(-Re z^2).
        steepest = 1.13 * self.real.exp(z.radius * z.radius - z.centre * z.centre / 2)
        return self.ball(self.real.erf(z.centre), z.radius * steepest)

    def _by_slope(self, x: ComplexBall | Number, name: str, slope: ComplexBall) -> ComplexBall:
        """A function by its value at the centre and a ball of its derivative."""
        z = self._lift(x)
        steepest = abs(slope.centre) + slope.radius
        return self._where_real(getattr(self.real, name)(z.centre), z.radius * steepest)

    def __getattr__(self, name: str) -> Any:
        """The inverse functions, by their derivatives."""
        if name not in FUNCTIONS:
            raise AttributeError(name)
        slopes: dict[str, Callable[[Any], Any]] = {
            "asin": lambda z: self.power(1 - z * z, Fraction(-1, 2)),
            "acos": lambda z: self.power(1 - z * z, Fraction(-1, 2)),
            "atan": lambda z: 1 / (1 + z * z),
            "asinh": lambda z: self.power(1 + z * z, Fraction(-1, 2)),
            "acosh": lambda z: self.power(z * z - 1, Fraction(-1, 2)),
            "atanh": lambda z: 1 / (1 - z * z),
        }
        return lambda x: self._by_slope(x, name, slopes[name](self._lift(x)))


def resolved(change: Number, size: Number) -> Any:
    """True if a change over a ball leaves no room for a feature that samples miss.

    False also for a `change` that is not a number.
    """
    return change <= RESOLVED * size
