"""Expansions of int g e^{lam f} dx, uniform as two saddles, or a saddle and an end, coalesce.

The integral is that of e^{lam V} with the weight g and phi = -f', over panels in canonical form
(`symasym.expansions.coalescence`, `symasym.expansions.uniform`).
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from typing import Any

import sympy
from flint import arb, ctx

from symasym.base.balls import precision, rational
from symasym.base.inputs import count, exact
from symasym.expansions import coalescence
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.coalescence import Factor, Phi
from symasym.expansions.sides import Stretch
from symasym.expansions.uniform import record
from symasym.integrals.integral import IntegralExpansion, code, cut, middle, number

__all__ = ["UniformExpansion", "uniform_integral"]

_MOST = 40
# The distance from `near` within which saddles are searched for.
_CORE = 8


@dataclass(frozen=True)
class UniformExpansion(IntegralExpansion):
    """An expansion of the integral of g(x) e^(lam f(x)), uniform as critical points coalesce.

    `near` is a point near the saddles.
    """

    method = "uniform"
    near: Fraction

    def _sum(self, lam: Any) -> tuple[Any, Any, int]:
        nats = (ctx.prec - 60) * math.log(2)
        with precision(int(2 * nats) + 60):
            ctx.cap = math.ceil(-nats / math.log(coalescence.SHARE))
            found = arb.nan()
            with suppress(ArithmeticError, ValueError):  # raised at zeros and singularities
                found = self._by_panels(lam, nats).mid()
            size = arb(1) if found == 0 else abs(found)
            return size.log() / lam, found / size, self.order

    def _by_panels(self, lam: Any, nats: float) -> Any:
        """The sum in balls, whose radii do not count; nan if the integral diverges."""
        lo, hi, inside = number(self.a), number(self.b), arb(rational(self.near))
        inside = inside if lo < inside < hi else middle(lo, hi)
        f, tiny = code(self.f, self.x), (-arb(nats) - 10).exp()
        top = f(inside)
        # Infinite ends, and those where f -> -oo, move to where e^{lam f} is small.
        (lo, before), (hi, after) = (
            cut(lambda u: (lam * (f(u) - top)).exp(), end, inside, tiny) for end in (lo, hi)
        )
        if not (before + after).is_finite():
            return arb.nan()
        constant, rest = self.g.as_independent(self.x, as_Add=False)
        weight = None if rest == 1 else code(rest, self.x)
        centre, last = min(max(float(self.near), float(lo)), float(hi)), self.order - 1
        low, high = max(lo, arb(centre - _CORE)), min(hi, arb(centre + _CORE))
        field = Phi(code(-sympy.diff(self.f, self.x), self.x), float(low), float(high))
        outside = [
            [coalescence.panel(field, at, Factor(0), p, q, last, weight)] if p < q else []
            for at, p, q in ((low, lo, low), (high, high, hi))
        ]
        parts = [*outside[0], *field.panels(low, high, last, weight), *outside[1]]
        at = InBalls(lam, last)
        whole = reduce(Stretch.then, (record(one, at, nats) for one in parts))
        return number(constant) * (lam * f(lo)).exp() * whole.scale


def uniform_integral(
    f: Any, g: Any, x: Any, a: Any, b: Any, order: Any = 3, *, near: Any = 0
) -> UniformExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)), uniform as its critical points coalesce.

    Two saddles, or a saddle and an end, may coalesce; near three saddles the error is large.

    Parameters
    ----------
    f, g : Expr, str or number
        Analytic and real on the interval.
    x : Symbol or str
    a, b : Expr or number
        Ends, possibly -oo and oo.
    order : int, optional
        The number N of terms, 1 to 40, with relative powers lam^0 to lam^(1 - N).
    near : number, optional
        A point near the saddles, which are searched for within a distance of 8.

    Examples
    --------
    Temme's incomplete gamma function, with the maximum of log(x) - x near the end mu:

    >>> import symasym as sa
    >>> gamma = sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=4, near=1)
    >>> print(gamma.bind(mu="1.01").evaluate(100, dps=20, log=True, full=True))
    -102.1877779347692 ± 2.93e-12 (estimate, uniform)
    """
    order, beside = count("order", order, 1, _MOST, " of terms"), exact("near", near)
    return UniformExpansion.of(f, g, x, a, b, order, beside)
