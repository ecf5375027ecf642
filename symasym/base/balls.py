"""Control of python-flint's precision, and conversion of numbers to balls and back."""

from __future__ import annotations

import functools
import math
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import Any

import flint
from flint import acb, arb
from mpmath import libmp, mp, mpf

from symasym.base.errors import AccuracyError

_lock = threading.RLock()
_DOUBLINGS = 6  # of the precision, at most


@contextmanager
def precision(bits: int) -> Iterator[None]:
    """Set Arb's precision to `bits` in a block. The context is global, so one thread enters."""
    context = flint.ctx
    with _lock:
        before = context.prec, context.cap
        context.prec = bits
        try:
            yield
        finally:
            context.prec, context.cap = before


class cached_property(functools.cached_property[Any]):
    """A cached property that is computed without a lock, as from Python 3.12 on.

    Python 3.11 holds a lock meanwhile. A thread that computes with balls then waits for the lock of
    `precision`, and the thread that has this one for the property: a deadlock.
    """

    def __get__(self, instance: Any, owner: Any = None) -> Any:
        if instance is None:
            return self
        value = instance.__dict__[str(self.attrname)] = self.func(instance)
        return value


def extra_bits(most: int) -> Iterator[int]:
    """Additional bits 0, 60, 180, ... below `most`, to be tried until a ball is narrow enough."""
    more = 0
    while more < most:
        yield more
        more = 2 * more + 60


class Unresolved(ArithmeticError):
    """The precision is too low, for example to separate zeros and ends."""


def doubled(find: Callable[[int], Any], bits: int, digits: int = 0) -> Any:
    """The value of `find(bits)` at flint's precision of so many bits.

    These are doubled while `find` raises Unresolved or the balls found have fewer digits.
    """
    for more in (bits << k for k in range(_DOUBLINGS)):
        with suppress(Unresolved), precision(more):
            found = find(more)
            if not digits or all(y.rel_accuracy_bits() > 3.33 * digits + 1 for y in found):
                return found
    raise AccuracyError(
        f"a function varies too fast, or its zeros are too close to each other or to an end, for "
        f"many times {bits:,} bits; give other numbers, or use method 'exact'."
    )


def rational(x: Any) -> Any:
    """A number as flint's rational."""
    return flint.fmpq(*x.as_integer_ratio())


def rounded(ball: arb | acb, dps: int | None) -> tuple[Any, Any]:
    """The midpoint of a finite ball in float64, or as an mpf of `dps` digits, and its error.

    The error includes the rounding of the midpoint. mpmath's global precision is neither used nor
    changed."""
    if not ball.is_finite():
        raise AccuracyError("the ball is not finite and has no midpoint; enclose the value first.")
    parts = [x.mid() for x in ((ball.real, ball.imag) if isinstance(ball, acb) else (ball,))]
    near: list[Any] = [float(x) if dps is None else _mpf(x, dps) for x in parts]
    with precision(64):
        radius = abs(ball - acb(*near)).upper()
    # float() turns a radius below the range of float64 into 0, so the next float64 is taken.
    error = math.nextafter(float(radius), math.inf) if dps is None else _mpf(radius)
    if len(near) == 1:
        return near[0], error
    return complex(*near) if dps is None else mp.make_mpc(tuple(x._mpf_ for x in near)), error


def _mpf(point: arb, dps: int | None = None) -> mpf:
    """An exact ball (radius 0) as an mpf, rounded to `dps` digits if these are given."""
    exactly = libmp.from_man_exp(*(int(x) for x in point.man_exp()))
    near = exactly if dps is None else libmp.mpf_pos(exactly, libmp.dps_to_prec(dps), "n")
    return mp.make_mpf(near)
