"""Integers of fixed point, in which power series are added up, back to mpf."""

from __future__ import annotations

from typing import Any

from mpmath import libmp

#: Bits of e, and bits beyond those asked for.
BITS = 1.4426950408889634
GUARD = 24


def from_fixed(x: Any, bits: int, context: Any) -> Any:
    """x/2^bits in the context."""
    return context.make_mpf(libmp.from_man_exp(x, -bits, context.prec, "n"))
