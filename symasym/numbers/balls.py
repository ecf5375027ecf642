"""The drift in ball arithmetic, and the one place that sets the precision of python-flint."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from functools import cached_property, lru_cache, partial
from typing import TYPE_CHECKING, Any, Protocol

import flint

from symasym.base.errors import AccuracyError
from symasym.numbers.trees import FUNCTIONS

if TYPE_CHECKING:
    from flint import acb, arb, arb_series

    from symasym.drift.drift import Drift

    Ball = arb | acb | arb_series

_lock = threading.RLock()


class NotProved(Exception):
    """A step of a proof does not go through; an estimate remains possible."""


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Arb at `bits` bits. Its context is global: one thread at a time, and put back after."""
    context = flint.ctx
    with _lock:
        before = context.prec, context.cap
        context.prec = bits
        try:
            yield
        finally:
            context.prec, context.cap = before


def exact_ball(value: Fraction) -> Any:
    """The ball of a rational: exact but for the rounding of a quotient."""
    return flint.arb(flint.fmpq(value.numerator, value.denominator))


def to_mpf(ball: arb, dps: int) -> tuple[Any, Any]:
    """Midpoint, rounded to `dps` digits, and a radius that covers the rounding as well.

    Parameters
    ----------
    ball : flint.arb
        A finite enclosure.
    dps : int
        Decimal digits of the midpoint.

    Returns
    -------
    tuple of mpf
        ``(mid, rad)`` such that [mid - rad, mid + rad] contains the ball. The precision
        of mpmath's global context is neither used nor changed.
    """
    import mpmath
    from mpmath import libmp

    if not ball.is_finite():
        raise AccuracyError("the ball is not finite and has no midpoint; enclose the value first.")

    def exact(number: arb) -> Any:
        mantissa, exponent = number.man_exp()
        return libmp.from_man_exp(int(mantissa), int(exponent))

    center = exact(ball.mid())
    rounded = libmp.mpf_pos(center, libmp.dps_to_prec(dps), "n")
    # Differences without a precision are exact in libmp; only the sum of the two errors rounds.
    shift = libmp.mpf_abs(libmp.mpf_sub(center, rounded))
    radius = libmp.mpf_add(exact(ball.rad()), shift, 53, "u")
    return mpmath.mp.make_mpf(rounded), mpmath.mp.make_mpf(radius)


class Profile(Protocol):
    """A(u) as the panels need it."""

    def value(self, u: Fraction) -> arb:
        """A ball for A(u)."""

    def bound(self, center: Fraction, radius: Fraction) -> arb:
        """A bound of abs(A) on the complex disk, not finite unless A is analytic there."""

    def series(self, center: Fraction, half: Fraction, terms: int) -> arb_series:
        """Balls for the Taylor coefficients of A(center + half t) in t."""

    def terms(self) -> int | None:
        """The number of coefficients beyond which all vanish, None if there is none."""

    def mirrored(self) -> Profile:
        """The drift of the coordinate -u: -A(-u)."""


class _Polynomial:
    """A with rational coefficients."""

    def __init__(self, coefficients: list[Fraction]) -> None:
        self.coefficients = coefficients

    def value(self, u: Fraction) -> Any:
        """A(u), its rational value rounded once."""
        return flint.arb(self._exact(flint.fmpq(u.numerator, u.denominator)))

    def bound(self, center: Fraction, radius: Fraction) -> Any:
        """Sum of |c_k| radius^k, c_k the Taylor coefficients at the centre."""
        # The sum of |c_k| radius^k is attained on the circle within a factor of two or so,
        # where a ball in place of z would count the same radius once per power.
        shifted = self._shifted(center, radius).coeffs()
        return sum((abs(c) for c in shifted), flint.arb(0))

    def series(self, center: Fraction, half: Fraction, terms: int) -> Any:
        """The Taylor polynomial in t of A(center + half t)."""
        return flint.arb_series(self._shifted(center, half).coeffs(), terms)

    def terms(self) -> int | None:
        return len(self.coefficients)

    def mirrored(self) -> _Polynomial:
        return _Polynomial([c if k % 2 else -c for k, c in enumerate(self.coefficients)])

    @cached_property
    def _exact(self) -> Any:
        return flint.fmpq_poly([flint.fmpq(c.numerator, c.denominator) for c in self.coefficients])

    def _shifted(self, center: Fraction, half: Fraction) -> Any:
        """The coefficients of A(center + half t) in t."""
        return flint.arb_poly(self._exact)(_linear(center, half, flint.ctx.prec))


class _Analytic:
    """Any other drift, through its `evaluate`."""

    def __init__(self, drift: Drift, sign: int = 1) -> None:
        self.drift = drift
        self.sign = sign
        # Derivatives ask for the bounds of the panels again.
        self._bounds: dict[Any, arb] = {}

    def value(self, u: Fraction) -> Any:
        """A(u); at u = -1 and 1 from its exact value where that is rational."""
        if abs(u) == 1 and (known := self.drift.end(self.sign * int(u))) is not None:
            return exact_ball(self.sign * known)
        return self.sign * self.drift.evaluate(exact_ball(self.sign * u), BallOps())

    def bound(self, center: Fraction, radius: Fraction) -> Any:
        """|A| on a square around the disk, nan unless A is analytic there."""
        disk = center, radius, flint.ctx.prec
        if disk not in self._bounds:
            square, ops = _square(self.sign * center, radius, flint.ctx.prec)
            try:
                self._bounds[disk] = abs(flint.acb(self.drift.evaluate(square, ops)))
            except ZeroDivisionError:
                self._bounds[disk] = flint.arb.nan()
        return self._bounds[disk]

    def series(self, center: Fraction, half: Fraction, terms: int) -> Any:
        """The Taylor series in t of A(center + half t), by Arb."""
        line, ops = _line(self.sign * center, self.sign * half, terms, flint.ctx.prec)
        return self.sign * flint.arb_series(self.drift.evaluate(line, ops), terms)

    def terms(self) -> int | None:
        return None

    def mirrored(self) -> _Analytic:
        return _Analytic(self.drift, -self.sign)


class _Sharpened:
    """A function whose formula cancels so many bits, with as many more."""

    def __init__(self, whole: Profile, lost: int) -> None:
        self._whole, self._lost = whole, lost

    def _bits(self) -> int:
        bits: int = flint.ctx.prec
        return bits + self._lost

    def value(self, u: Fraction) -> Any:
        with precision(self._bits()):
            return self._whole.value(u)

    def bound(self, center: Fraction, radius: Fraction) -> Any:
        """By the Taylor coefficients, and Cauchy's bound of others on a disk 2^_WIDER as large,
        whose own bound is that of terms which do not cancel."""
        largest = self._whole.bound(center, 2**_WIDER * radius)
        if not largest.is_finite():
            return self._whole.bound(center, radius)
        terms, cap = self._bits() // _WIDER + 1, flint.ctx.cap
        try:
            flint.ctx.cap = terms
            known = self.series(center, radius, terms).coeffs()
        finally:
            flint.ctx.cap = cap
        tail = largest * flint.arb(2) ** (1 - _WIDER * terms)
        return sum(map(abs, known), tail)

    def series(self, center: Fraction, half: Fraction, terms: int) -> Any:
        with precision(self._bits()):
            return self._whole.series(center, half, terms)

    def terms(self) -> int | None:
        return self._whole.terms()

    def mirrored(self) -> Profile:
        return _Sharpened(self._whole.mirrored(), self._lost)


#: log2 of the radius of a second disk about a panel, over that of the first.
_WIDER = 8
# Bits that a formula may cancel before more are taken, at most so many.
_CANCELLED, _MOST_BITS = 64, 1 << 14


def sharpened(profile: Profile) -> Profile:
    """The same function, right to working precision where its formula cancels."""
    if profile.terms() is not None:
        return profile
    lost, bits = 0, 128
    while bits <= _MOST_BITS:
        with precision(bits):
            values = [profile.value(u) for u in (Fraction(1, 3), Fraction(-3, 7))]
        if all(x.is_finite() for x in values):
            wide = max(values, key=lambda x: x.rad()).rad()
            lost = bits + int(float(wide.log().upper()) * 1.4427) if wide > 0 else 0
            break
        bits *= 2
    return _Sharpened(profile, lost) if lost > _CANCELLED else profile


def profile_of(drift: Drift) -> Profile:
    """A(u) of a drift as the panels need it."""
    coefficients = drift.exact_coefficients()
    return _Analytic(drift) if coefficients is None else _Polynomial(list(coefficients))


@lru_cache(maxsize=4)
def _linear(center: Fraction, half: Fraction, bits: int) -> Any:
    """The polynomial center + half t, on which the changes of a drift are asked for in turn."""
    return flint.arb_poly([exact_ball(center), exact_ball(half)])


@lru_cache(maxsize=4)
def _square(center: Fraction, radius: Fraction, bits: int) -> tuple[Any, BallOps]:
    """The square about a disk, and the arithmetic in which drifts share what they have in common
    there."""
    spread = flint.arb(0, exact_ball(radius))
    return flint.acb(exact_ball(center) + spread, spread), BallOps({})


@lru_cache(maxsize=4)
def _line(center: Fraction, half: Fraction, terms: int, bits: int) -> tuple[Any, BallOps]:
    """The series of center + half t, and such an arithmetic."""
    return flint.arb_series([exact_ball(center), exact_ball(half)], terms), BallOps({})


class BallOps:
    """Functions of arb, acb and arb_series that are finite only where they are analytic.

    A finite value of Arb's own complex functions doesn't prove analyticity: on a ball across
    a branch cut they enclose both sides of the jump. These return nan there.
    """

    def __init__(self, known: dict[Any, Any] | None = None) -> None:
        self.known = known

    def rational(self, value: Fraction) -> Any:
        return exact_ball(value)

    def pi(self) -> Any:
        return flint.arb.pi()

    def power(self, base: Ball, exponent: Fraction) -> Any:
        """A rational power, on a complex ball nan where it touches the cut."""
        rational = flint.fmpq(exponent.numerator, exponent.denominator)
        if isinstance(base, flint.acb):
            return base.pow(flint.acb(exact_ball(exponent)), analytic=True)
        return base**rational

    def __getattr__(self, name: str) -> Callable[[Ball], Any]:
        if name not in FUNCTIONS:
            raise AttributeError(name)
        return partial(_function, name)


class BallContext:
    """What an emitted formula asks of its context (`symasym.generated`), for balls."""

    @staticmethod
    def exp(x: arb) -> Any:
        """e^x."""
        return x.exp()


def _function(name: str, x: Ball) -> Any:
    """An elementary function of x, not finite where it is not analytic on all of a complex x."""
    if isinstance(x, flint.arb_series) and name in _OF_SERIES:
        try:
            return _OF_SERIES[name](x)
        except ValueError:  # a divisor whose constant term may be 0
            return flint.arb_series([flint.arb.nan()] * x.prec, x.prec)
    if isinstance(x, flint.acb):
        if name in ("log", "sqrt"):
            return getattr(x, name)(analytic=True)
        if name in _CUTS and _CUTS[name](x):
            return flint.acb(flint.arb.nan())
    return getattr(x, name)()


def _antiderivative(x: arb_series, name: str, slope: arb_series) -> Any:
    """f(x) for a series x, from f' at the series and f at its constant term."""
    return (x.derivative() * slope).integral() + getattr(x[0], name)()


def _tanh(x: arb_series) -> Any:
    """tanh of a series; 1 - 2/(1 + e^2x) cancels in the constant term alone."""
    series = 1 - 2 / (1 + (2 * x).exp())
    return type(x)([x[0].tanh(), *series.coeffs()[1:]], series.prec)


# What Arb's real series lack.
_OF_SERIES: dict[str, Callable[[arb_series], Any]] = {
    "sinh": lambda x: (x.exp() - (-x).exp()) / 2,
    "cosh": lambda x: (x.exp() + (-x).exp()) / 2,
    "tanh": _tanh,
    "asinh": lambda x: _antiderivative(x, "asinh", (1 + x * x).rsqrt()),
    "acosh": lambda x: _antiderivative(x, "acosh", (x * x - 1).rsqrt()),
    "atanh": lambda x: _antiderivative(x, "atanh", 1 / (1 - x * x)),
}


def _outside_real(z: acb) -> bool:
    """True where the ball may touch the real axis at abs(z) >= 1."""
    return bool(z.imag.contains(0)) and not abs(z.real) < 1


def _outside_imaginary(z: acb) -> bool:
    """True where the ball may touch the imaginary axis at abs(z) >= 1."""
    return bool(z.real.contains(0)) and not abs(z.imag) < 1


def _left_of_one(z: acb) -> bool:
    """True where the ball may touch the real axis at z <= 1."""
    return bool(z.imag.contains(0)) and not z.real > 1


# Where the inverse functions are not analytic (DLMF 4.23.1, 4.37.1).
_CUTS: dict[str, Callable[[acb], bool]] = {
    **dict.fromkeys(("asin", "acos", "atanh"), _outside_real),
    **dict.fromkeys(("atan", "asinh"), _outside_imaginary),
    "acosh": _left_of_one,
}
