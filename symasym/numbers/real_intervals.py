"""The elementary functions of real intervals, rounded outwards."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath

from symasym.numbers.trees import MpmathOps


class _Singular(ArithmeticError):
    """An interval touches a place where a function is not analytic."""


class IntervalOps(MpmathOps):
    """mpmath's intervals; a function that is not analytic on its whole argument raises.

    The logarithm may reach 0, where it is -oo: from above it is bounded all the same.
    """

    def __init__(self) -> None:
        super().__init__(mpmath.iv)

    def power(self, base: Any, exponent: Fraction) -> Any:
        return mpmath.iv.exp(self.rational(exponent) * self.log(base))

    def __getattr__(self, name: str) -> Any:
        iv = mpmath.iv
        composed = {
            "log": iv.log,
            "sqrt": lambda x: iv.sqrt(_above(x, 0)),
            "tan": lambda x: iv.sin(x) / iv.cos(x),
            "sinh": lambda x: (iv.exp(x) - iv.exp(-x)) / 2,
            "cosh": lambda x: (iv.exp(x) + iv.exp(-x)) / 2,
            "tanh": lambda x: 1 - 2 / (iv.exp(2 * x) + 1),
            "asin": lambda x: _monotone(mpmath.asin, _within_one(x)),
            "acos": lambda x: -_monotone(lambda y: -mpmath.acos(y), _within_one(x)),
            "atan": lambda x: _monotone(mpmath.atan, x),
            "asinh": lambda x: _monotone(mpmath.asinh, x),
            "acosh": lambda x: _monotone(mpmath.acosh, _above(x, 1)),
            "atanh": lambda x: _monotone(mpmath.atanh, _within_one(x)),
            "erf": lambda x: _monotone(mpmath.erf, x),
        }
        return composed.get(name) or super().__getattr__(name)


def _above(x: Any, least: int) -> Any:
    if not mpmath.mpf(mpmath.iv.mpf(x).a) > least:
        raise _Singular
    return x


def _within_one(x: Any) -> Any:
    return _above(1 - x, 0) and _above(1 + x, 0) and x


def _monotone(function: Any, x: Any) -> Any:
    ends = [function(mpmath.mpf(y)) for y in (x.a, x.b)]
    if any(isinstance(y, mpmath.mpc) for y in ends):
        raise ValueError("complex")
    return mpmath.iv.mpf([ends[0] - mpmath.mpf(2) ** -40, ends[1] + mpmath.mpf(2) ** -40])
