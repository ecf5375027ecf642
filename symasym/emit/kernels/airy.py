"""Products of Airy functions in doubles, to be emitted (see `symasym.emit.kernels.uniform`).

They are evaluated from the tables of `symasym.special.airy`, as there.
"""

from __future__ import annotations

import math

from symasym.asymptotics.uniform.structure import _horner

# Put in when a file is written (`symasym.emit.kernels.tables`).
_AIRY_NEAR: list[float] = []
_AIRY_BELOW: list[float] = []
_AIRY_ABOVE: list[float] = []


def _airy(z: float, count: int, result: list[float]) -> None:
    """Ai^2 + Bi^2, Ai'^2 + Bi'^2, Bi and Bi' times e^{-(4/3) z^(3/2)} or its root, for z > 0.

    The first `count` of them, 1 or 4.
    """
    size = abs(z)
    root = math.sqrt(size)
    if size <= 8:
        place = 2 * (z + 8)
        piece: int = min(int(place), 31)
        t = 2 * (place - piece) - 1
        # Where the table has the exponential, it is taken out here.
        fall = math.exp(-2 * size * root / 3) if 0 < z < 1 else 1.0
        for k in range(count):
            result[k] = _horner(_AIRY_NEAR, 13 * (piece + 32 * k), 13, t) * fall
            if k < 2:
                result[k] *= fall
        return
    cube, half = size * root, math.sqrt(root)
    t = 16 * math.sqrt(8.0) / cube - 1
    if z > 0:
        for k in range(count):
            result[k] = _horner(_AIRY_ABOVE, 14 * k, 14, t)
    else:
        result[0] = _horner(_AIRY_BELOW, 0, 14, t)
        if count > 1:
            turn = 2 * cube / 3 + math.pi / 4
            x, y = math.cos(turn), math.sin(turn)
            result[1] = _horner(_AIRY_BELOW, 14, 14, t)
            for k in range(2, 4):
                real = _horner(_AIRY_BELOW, 28 * (k - 1), 14, t)
                result[k] = real * x - _horner(_AIRY_BELOW, 28 * (k - 1) + 14, 14, t) * y
    result[0] /= root
    if count > 1:
        result[1] *= root
        result[2] /= half
        result[3] *= half


def _log_modulus(x: float) -> float:
    """log(Ai(x)^2 + Bi(x)^2)."""
    squares = [0.0] * 1
    _airy(x, 1, squares)
    return math.log(squares[0]) + (4 * x * math.sqrt(x) / 3 if x > 0 else 0.0)
