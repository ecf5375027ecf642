"""The table of scenes, and the distances between numbers of any precision."""

from __future__ import annotations

from typing import Any

import mpmath

from symasym.workshop.problems import BY_NAME, FOLD, PROBLEMS, Problem, tagged

__all__ = [
    "BY_NAME", "FOLD", "PROBLEMS", "Problem", "distance", "logarithm", "relative", "tagged",
]  # fmt: skip


def _context(*numbers: Any) -> Any:
    """Two and a half times as precise as the numbers."""
    context = mpmath.MPContext()
    context.prec = 400 + sum(3 * x._mpf_[1].bit_length() for x in numbers if hasattr(x, "_mpf_"))
    return context


def distance(value: Any, reference: Any) -> Any:
    """abs(value - reference), free of the global precision."""
    context = _context(value, reference)
    return abs(context.convert(value) - context.convert(reference))


def relative(value: Any, reference: Any) -> Any:
    """abs(value - reference)/abs(reference), or the distance from 0."""
    size = abs(_context(reference).convert(reference))
    return distance(value, reference) / (size or 1)


def logarithm(value: Any, dps: int = 60) -> Any:
    """log(value) as an mpf with `dps` digits."""
    context = mpmath.MPContext()
    context.dps = dps
    return mpmath.mp.make_mpf(context.log(context.convert(value))._mpf_)
