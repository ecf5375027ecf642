"""The rational numbers of the arbitrary-precision sweeps."""

from __future__ import annotations

from fractions import Fraction
from typing import cast


def _fastest() -> type[Fraction]:
    """GMP's rationals where mpmath uses gmpy2 itself, else Fraction."""
    from mpmath.libmp import BACKEND

    # mpmath takes gmpy2's integers only where it uses them itself.
    if BACKEND != "gmpy":
        return Fraction
    from gmpy2 import mpq

    return cast("type[Fraction]", mpq)


#: GMP's rationals where gmpy2 is installed, otherwise Fraction: the same numbers, faster,
#: since planning a stiff sweep takes thousands of operations with short ones.
Rational = _fastest()
