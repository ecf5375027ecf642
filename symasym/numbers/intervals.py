"""Interval arithmetic: Arb's balls where python-flint is installed, else mpmath's intervals."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, Protocol

from symasym.base.contexts import mpf_of
from symasym.exact import ball_sweep
from symasym.numbers.balls import exact_ball, flint_module, precision


class Intervals(Protocol):
    """Enclosures that any operation keeps."""

    bits: int

    def of(self, value: Fraction) -> Any: ...

    def about(self, middle: Any, radius: Any) -> Any:
        """The interval around `middle`, which may be one itself, widened by `radius`."""
        ...

    def exp(self, x: Any) -> Any: ...

    def log(self, x: Any) -> Any: ...

    def log1p(self, x: Any) -> Any: ...

    def size(self, x: Any) -> Any:
        """A thin interval that is at least abs(x)."""
        ...

    def middle(self, x: Any) -> tuple[Any, Any]:
        """A number of the interval and an upper bound of its distance to the rest, as mpf."""
        ...


class _Balls:
    def __init__(self, bits: int) -> None:
        self.bits = bits

    def of(self, value: Any) -> Any:
        flint = flint_module()
        return flint.arb(value) if isinstance(value, flint.fmpq) else exact_ball(value)

    def about(self, middle: Any, radius: Any) -> Any:
        return middle + flint_module().arb(0, radius.abs_upper())

    def exp(self, x: Any) -> Any:
        return x.exp()

    def log(self, x: Any) -> Any:
        return x.log()

    def log1p(self, x: Any) -> Any:
        return x.log1p()

    def size(self, x: Any) -> Any:
        return x.abs_upper()

    def middle(self, x: Any) -> tuple[Any, Any]:
        return ball_sweep.to_mpf(x, int(self.bits / 3.3) + 5)


class _Endpoints:
    """mpmath's interval context: the same with both ends rounded outwards."""

    def __init__(self, bits: int) -> None:
        from mpmath.ctx_iv import MPIntervalContext

        self.bits = bits
        self.context = MPIntervalContext()
        self.context.prec = bits

    def of(self, value: Fraction) -> Any:
        return mpf_of(value, self.context)

    def about(self, middle: Any, radius: Any) -> Any:
        top = self.size(radius)
        return middle + self.context.mpf([-top.b, top.b])

    def exp(self, x: Any) -> Any:
        return self.context.exp(x)

    def log(self, x: Any) -> Any:
        return self.context.log(x)

    def log1p(self, x: Any) -> Any:
        if x.b < self.context.ldexp(1, -self.bits):
            return x * self.context.mpf([1 - x.b, 1])  # x - x^2/2 < log(1 + x) < x
        lost = max(0, -int(self.context.mag(x.a)))
        before = self.context.prec
        self.context.prec = before + min(lost, before)
        try:
            return self.context.log(1 + x)
        finally:
            self.context.prec = before

    def size(self, x: Any) -> Any:
        return self.context.mpf(abs(x).b)

    def middle(self, x: Any) -> tuple[Any, Any]:
        from mpmath import libmp, mp

        low, high = x._mpi_
        half = libmp.mpf_shift(libmp.mpf_add(low, high), -1)
        rounded = libmp.mpf_pos(half, self.bits, "n")
        far = [libmp.mpf_abs(libmp.mpf_sub(end, rounded)) for end in (low, high)]
        radius = far[0] if libmp.mpf_gt(far[0], far[1]) else far[1]
        return mp.make_mpf(rounded), mp.make_mpf(libmp.mpf_pos(radius, 53, "u"))


@contextmanager
def intervals(bits: int) -> Iterator[Intervals]:
    """The best interval arithmetic there is, at `bits` bits."""
    if not ball_sweep.available():
        yield _Endpoints(bits)
        return
    with precision(bits):
        yield _Balls(bits)


def quotients(x: Any, number: Intervals) -> tuple[Any, Any]:
    """(e^x - 1)/x and (e^x - 1 - x)/x^2 of a thin interval, also about 0."""
    one = number.of(Fraction(1))
    if not abs(x) < 1:
        first = number.exp(x) - 1
        return first / x, (first - x) / (x * x)
    # Sums of x^k/(k + 1)! and x^k/(k + 2)!; a term of index n and those after it make less than
    # twice that term.
    first, second, term = 0 * one, 0 * one, one
    for k in range(number.bits + 8):
        first += term / (k + 1)
        second += term / ((k + 1) * (k + 2))
        term = term * x / (k + 1)
        if abs(term) < number.of(Fraction(1, 1 << (number.bits + 8))):
            break
    rest = 2 * number.size(term)
    return number.about(first, rest), number.about(second, rest)
