"""A drift and its potential in an mpmath context, by evaluation and mpmath's own quadrature."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any

import symasym as sa
from symasym.numbers.trees import MpmathOps

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


class Field:
    """phi and V of one drift at the precision of `mp`."""

    def __init__(self, drift: sa.Drift, mp: MPContext) -> None:
        self.drift, self.mp, self.ops = drift, mp, MpmathOps(mp)
        a_minus, a_plus = (mp.convert(Fraction(x)) for x in drift.ends)
        self.ends = (a_minus, a_plus)

    def A(self, u: mpf | Fraction | float) -> Any:
        """The drift's formula at `u`, inside the layer or not."""
        return self.drift.evaluate(u, self.ops)

    def phi(self, u: mpf | Fraction | float) -> Any:
        """eq:phi."""
        return self.A(min(max(self.mp.convert(u), -self.mp.one), self.mp.one))

    def rise(self, *points: mpf | Fraction | float) -> Any:
        """V at the last of `points`, in the layer, less V at the first."""
        return -self.mp.quad(self.A, [self.mp.convert(u) for u in points])

    def slope(self, u: mpf | Fraction | float, order: int = 1) -> Any:
        """A derivative of A."""
        return self.mp.diff(self.A, u, order)

    def zero(self, near: mpf | Fraction | float) -> Any:
        """The zero of A beside `near`."""
        return self.mp.findroot(self.A, self.mp.convert(near))
