"""The one place that sets the precision of python-flint, and numbers to and from its balls."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any

import flint
from flint import arb

from symasym.base.errors import AccuracyError

_lock = threading.RLock()


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
