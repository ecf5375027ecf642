"""The one place that sets the precision of python-flint, and numbers to and from its balls."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import flint
from flint import arb

from symasym.base.errors import AccuracyError

if TYPE_CHECKING:
    from mpmath import mpf

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


def rounded(value: mpf, error: mpf, dps: int) -> tuple[mpf, mpf]:
    """A number to `dps` digits, and its error, which the rounding adds to.

    The precision of mpmath's global context is neither used nor changed.
    """
    import mpmath
    from mpmath import libmp

    near = libmp.mpf_pos(value._mpf_, libmp.dps_to_prec(dps), "n")
    # Differences without a precision are exact in libmp; only the sum of the two errors rounds.
    shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, near))
    radius = libmp.mpf_add(error._mpf_, shift, 53, "u")
    return mpmath.mp.make_mpf(near), mpmath.mp.make_mpf(radius)


def to_mpf(ball: arb, dps: int) -> tuple[mpf, mpf]:
    """Midpoint of a finite ball, `rounded` to `dps` digits, and a radius that covers it all."""
    import mpmath
    from mpmath import libmp

    if not ball.is_finite():
        raise AccuracyError("the ball is not finite and has no midpoint; enclose the value first.")
    parts = ([int(x) for x in part.man_exp()] for part in (ball.mid(), ball.rad()))
    middle, radius = (mpmath.mp.make_mpf(libmp.from_man_exp(*part)) for part in parts)
    return rounded(middle, radius, dps)
