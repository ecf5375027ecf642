"""The terms h_k of the slow manifold M = h_1/lam + h_2/lam^2 + ... of M' = 1 - lam phi M.

h_1 = 1/phi and h_{k+1} = -h_k'/phi; beside a simple zero of phi at t = 0, t^(2k - 1) h_k is a power
series. Their integrals are the regular part (`symasym.asymptotics.weak_noise.regular_part`).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symasym.numbers.power_series import laurent, product, reciprocal

__all__ = ["laurent", "least_square", "pole_primitive", "primitive", "product", "reciprocal"]


def pole_primitive(series: list[Any], k: int, t: Any, log: Any) -> Any:
    """A primitive at t of h_{k+1}'s poles, from its coefficients times t^(2k + 1).

    `log` is log(t) or log|t|; nothing at t = 0, the finite part.
    """
    if not isinstance(t, np.ndarray) and t == 0:
        return 0 * t
    inverse = 1 / t
    total: Any = 0.0
    for j in range(2 * k + 1, 1, -1):
        total = (total + series[2 * k + 1 - j] / (1 - j)) * inverse
    return total + series[2 * k] * log


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
