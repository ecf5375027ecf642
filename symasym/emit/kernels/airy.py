"""Products of Airy functions in doubles, to be emitted (see `symasym.emit.kernels.uniform`)."""

from __future__ import annotations

import math

# Put in when a file is written (`symasym.emit.kernels.airy_magnitude`).
_AIRY_NEAR: list[float] = []
_AIRY_BELOW: list[float] = []
_AIRY_ABOVE: list[float] = []


def _horner(table: list[float], at: int, terms: int, t: float) -> float:
    total = 0.0
    for k in range(terms - 1, -1, -1):
        total = total * t + table[at + k]
    return total


def _airy(z: float, found: list[float]) -> None:
    """Ai^2 + Bi^2, Ai'^2 + Bi'^2, Bi and Bi' times e^{-(4/3) z^(3/2)} or its root, for z > 0."""
    size = abs(z)
    root = math.sqrt(size)
    if size <= 8:
        place = 2 * (z + 8)
        piece: int = min(int(place), 31)
        t = 2 * (place - piece) - 1
        # Where the table has the exponential, it is taken out here.
        fall = math.exp(-2 * size * root / 3) if 0 < z < 1 else 1.0
        found[0] = _horner(_AIRY_NEAR, 13 * piece, 13, t) * fall * fall
        found[1] = _horner(_AIRY_NEAR, 13 * (piece + 32), 13, t) * fall * fall
        found[2] = _horner(_AIRY_NEAR, 13 * (piece + 64), 13, t) * fall
        found[3] = _horner(_AIRY_NEAR, 13 * (piece + 96), 13, t) * fall
        return
    cube, half = size * root, math.sqrt(root)
    t = 16 * math.sqrt(8.0) / cube - 1
    if z > 0:
        found[0] = _horner(_AIRY_ABOVE, 0, 14, t) / root
        found[1] = _horner(_AIRY_ABOVE, 14, 14, t) * root
        found[2] = _horner(_AIRY_ABOVE, 28, 14, t) / half
        found[3] = _horner(_AIRY_ABOVE, 42, 14, t) * half
        return
    turn = 2 * cube / 3 + math.pi / 4
    x, y = math.cos(turn), math.sin(turn)
    found[0] = _horner(_AIRY_BELOW, 0, 14, t) / root
    found[1] = _horner(_AIRY_BELOW, 14, 14, t) * root
    found[2] = (_horner(_AIRY_BELOW, 28, 14, t) * x - _horner(_AIRY_BELOW, 42, 14, t) * y) / half
    found[3] = (_horner(_AIRY_BELOW, 56, 14, t) * x - _horner(_AIRY_BELOW, 70, 14, t) * y) * half


def _log_modulus(x: float) -> float:
    """log(Ai(x)^2 + Bi(x)^2)."""
    size = abs(x)
    root = math.sqrt(size)
    # Left out of the tables where x > 1.
    rise = 4 * x * root / 3 if x >= 1 else 0.0
    if size <= 8:
        piece: int = min(int(2 * (x + 8)), 31)
        t = 2 * (2 * (x + 8) - piece) - 1
        return math.log(_horner(_AIRY_NEAR, 13 * piece, 13, t)) + rise
    t = 16 * math.sqrt(8.0) / (size * root) - 1
    if x > 8:
        return math.log(_horner(_AIRY_ABOVE, 0, 14, t) / root) + rise
    if x < -8:
        return math.log(_horner(_AIRY_BELOW, 0, 14, t) / root)
    return math.nan
