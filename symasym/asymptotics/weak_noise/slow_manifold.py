"""The terms h_k of the outer part, and what is done with their series.

h_1 = 1/phi and h_{k+1} = -h_k'/phi (`symasym.asymptotics.weak_noise.regular_part`).
"""

from __future__ import annotations

from typing import Any

from symasym.numbers.power_series import laurent, product, reciprocal

__all__ = ["laurent", "least_square", "primitive", "product", "reciprocal"]


def primitive(t: Any, j: int, context: Any) -> Any:
    """A primitive of t^-j; nothing at t = 0, the finite part."""
    if t == 0:
        return context.zero
    if j == 1:
        return context.log(abs(t)) if isinstance(t, context.mpf) else context.log(t)
    return t ** (1 - j) / (1 - j)


def least_square(context: Any) -> Any:
    """Below this rounding decides whether two zeros are real."""
    return context.ldexp(1, 24 - context.prec)
