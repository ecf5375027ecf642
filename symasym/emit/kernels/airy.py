"""log(Ai^2 + Bi^2) in doubles, to be emitted, from tables (`symasym.emit.kernels.tables`)."""

from __future__ import annotations

import math

from symasym.emit.kernels.elementary import _horner

# Put in when a file is written.
_AIRY_NEAR: list[float] = []
_AIRY_BELOW: list[float] = []
_AIRY_ABOVE: list[float] = []


def _log_modulus(x: float) -> float:
    """log(Ai(x)^2 + Bi(x)^2)."""
    size = abs(x)
    root = math.sqrt(size)
    rise = 4 * size * root / 3 if x >= 1 else 0.0
    if size <= 8:
        place = 2 * (x + 8)
        piece: int = min(int(place), 31)
        return rise + math.log(_horner(_AIRY_NEAR, 13 * piece, 13, 2 * (place - piece) - 1))
    t = 16 * math.sqrt(8.0) / (size * root) - 1
    if x > 0:
        return rise + math.log(_horner(_AIRY_ABOVE, 0, 14, t) / root)
    return math.log(_horner(_AIRY_BELOW, 0, 14, t) / root)
