"""Polynomials as lists of their coefficients, ascending, in any arithmetic.

Coefficients may be floats, the rows of an array (one column a scene), Fractions, mpf, balls,
double-doubles or elements of a SymPy ring: what is asked of them is + and *. Zeros are in
`symasym.numbers.polynomial_roots`, factors of degree two in `symasym.numbers.quadratic_factor`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from symasym.numbers.arithmetic import Number

__all__ = ["divided", "poly", "poly_slope", "shifted"]


def poly(c: Sequence[Any], x: Number) -> Any:
    """The value at `x`, by Horner's rule."""
    if len(c) < 2:
        return 0 * x + c[0] if len(c) else 0 * x
    total = c[-1] * x + c[-2]
    for a in c[-3::-1]:
        total = total * x + a
    return total


def poly_slope(c: Sequence[Any], x: Number) -> Any:
    """The derivative's value at `x`."""
    return poly([k * a for k, a in enumerate(c)][1:], x)


def shifted(c: Sequence[Any], by: Number) -> list[Any]:
    """Taylor coefficients at `by`, by Horner's rule again and again."""
    work = list(c)
    for lowest in range(len(work) - 1):
        for k in range(len(work) - 2, lowest - 1, -1):
            work[k] = work[k] + work[k + 1] * by
    return work


def divided(c: Sequence[Any], p: Number, q: Number) -> tuple[list[Any], Any, Any]:
    """The quotient by x² + p x + q, and the remainder's coefficients of x and of 1."""
    if len(c) < 3:
        return [], c[1] if len(c) > 1 else 0 * p, c[0] if len(c) else 0 * p
    work = list(c)
    for k in range(len(c) - 3, -1, -1):
        top = work[k + 2]
        work[k + 1] = work[k + 1] - p * top
        work[k] = work[k] - q * top
    return work[2:], work[1], work[0]
