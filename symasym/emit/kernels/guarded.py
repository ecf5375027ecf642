"""Functions that `math` raises for where C gives infinity, for the target "python".

C and JavaScript have them of their own (`symasym.emit.kernels.transcribe_expressions`).
"""

from __future__ import annotations

import math


def _exp(x: float) -> float:
    # math.exp raises where this is infinite.
    return math.exp(x) if x < 709.78 else math.exp(x - 9) * math.exp(9) if x < 718 else math.inf


def _expm1(x: float) -> float:
    return math.expm1(x) if x < 709 else _exp(x)


def _sinh(x: float) -> float:
    return math.copysign(_exp(abs(x)) / 2, x) if abs(x) > 700 else math.sinh(x)


def _cosh(x: float) -> float:
    return _exp(abs(x)) / 2 if abs(x) > 700 else math.cosh(x)
