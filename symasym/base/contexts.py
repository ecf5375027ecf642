"""mpmath contexts of our own: the caller's precision is never read or changed."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from functools import lru_cache
from numbers import Rational
from typing import TYPE_CHECKING, TypeVar

from symasym.base.patience import step

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


_local = threading.local()

_R = TypeVar("_R")
_KEPT = 32


@contextmanager
def own_context(dps: int) -> Iterator[MPContext]:
    """An mpmath context private to this thread, at `dps` digits while the block runs."""
    step()
    stack = getattr(_local, "stack", None)
    if stack is None:
        stack = _local.stack = []
    # Making a context takes a millisecond, so finished ones are kept for the next caller.
    if stack:
        context = stack.pop()
    else:
        from mpmath.ctx_mp import MPContext

        context = MPContext()
    context.dps = dps
    try:
        yield context
    finally:
        stack.append(context)


def kept(analysis: Callable[..., _R]) -> Callable[..., tuple[MPContext, _R]]:
    """`analysis` of hashable arguments, worked out once for equal ones; its context comes with it.

    Numbers carry their context, so that each of the last `_KEPT` analyses has one of its own, whose
    digits the analysis sets and which stay, in each thread.
    """

    @lru_cache(maxsize=_KEPT)
    def known(thread: int, *args: Hashable) -> tuple[MPContext, _R]:
        from mpmath.ctx_mp import MPContext

        context = MPContext()
        return context, analysis(context, *args)

    def of(*args: Hashable) -> tuple[MPContext, _R]:
        step()
        return known(threading.get_ident(), *args)

    of.cache_clear = known.cache_clear  # type: ignore[attr-defined]
    return of


def float_with_error(value: mpf, error: mpf) -> tuple[float, float]:
    """`value`, an mpf, as a float; `error` with what that rounds off, rounded up."""
    from mpmath import libmp

    rounded = float(value)
    # Differences without a precision are exact in libmp; only the sum rounds.
    shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, libmp.from_float(rounded)))
    total = libmp.to_float(libmp.mpf_add(error._mpf_, shift, 53, "u"))
    # to_float rounds to nearest, and flushes what is below the range to 0.
    return rounded, math.nextafter(total, math.inf)


def mpf_of(x: Rational | int, context: MPContext) -> mpf:
    """The rational `x` (int, Fraction or gmpy2's) in mpmath's `context`, rounded as it rounds."""
    # Not by libmp, which would give an interval context one end, and no enclosure.
    return context.mpf(x.numerator) / x.denominator


def to_mpf(value: mpf, dps: int) -> mpf:
    """`value`, of any mpmath context, as the caller's kind of mpf, rounded to `dps` digits."""
    import mpmath

    rounded = mpmath.libmp.mpf_pos(value._mpf_, mpmath.libmp.dps_to_prec(dps), "n")
    return mpmath.mp.make_mpf(rounded)
