"""Integers of fixed point, in which power series are added up, back to mpf."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from mpmath import libmp

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

#: Bits of e, and bits beyond those asked for.
BITS = 1.4426950408889634
GUARD = 24


def from_fixed(x: int, bits: int, context: MPContext) -> Any:
    """x/2^bits in the context."""
    return context.make_mpf(libmp.from_man_exp(x, -bits, context.prec, "n"))
