"""Distances between two numbers, free of any global precision."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mpmath

if TYPE_CHECKING:
    from mpmath import mpf


def relative(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference)/abs(reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    a, b = context.convert(value), context.convert(reference)
    return abs(a - b) / abs(b) if b else abs(a)


def _bits(x: mpf | float) -> int:
    """Bits of the mantissa of an mpf; more than enough for any other number."""
    return int(x._mpf_[1].bit_length()) if hasattr(x, "_mpf_") else 64


def logarithm(value: mpf | float, dps: int = 60) -> Any:
    """log(value) as an mpf with `dps` digits."""
    context = mpmath.MPContext()
    context.dps = dps
    return mpmath.mp.make_mpf(context.log(context.convert(value))._mpf_)


def distance(value: mpf | float, reference: mpf | float) -> Any:
    """abs(value - reference), free of the global precision."""
    context = mpmath.MPContext()
    context.prec = 400 + 2 * max(_bits(value), _bits(reference))
    return abs(context.convert(value) - context.convert(reference))
