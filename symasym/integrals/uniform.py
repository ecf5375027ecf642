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

from symasym.base.balls import exact_ball, precision
from symasym.base.errors import InputError
from symasym.base.inputs import count, exact
from symasym.expansions import coalescence
from symasym.expansions.coalescence import Factor, Phi
from symasym.expansions.sides import Stretch
from symasym.expansions.uniform import record
from symasym.integrals.integral import (
    IntegralExpansion,
    code,
    cut,
    integral,
    middle,
    number,
    read,
)

__all__ = ["UniformExpansion", "uniform_integral"]

_MOST = 40
# The distance from `near` within which saddles are searched for.
_CORE = 8


@dataclass(frozen=True, repr=False)
class UniformExpansion(IntegralExpansion):
    """An expansion of the integral of g(x) e^(lam f(x)), uniform as critical points coalesce.

    `near` is a point near the saddles.
    """

    method = "uniform"
    near: Fraction

    def _again(self, f: Any, g: Any, a: Any, b: Any) -> UniformExpansion:
        return uniform_integral(f, g, self.x, a, b, self.order, near=self.near)

    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """The level 0, the sum, and with `full` its distance to an enclosure of the integral."""
        wanted = 14 if dps is None else dps
        nats = math.log(10) * (wanted + 2) + math.log(2 + lam)
        with precision(int(2 * nats) + 60):
            ctx.cap = math.ceil(-nats / math.log(coalescence.SHARE))
            large, found, proved = exact_ball(lam), arb.nan(), False
            ends = self._ends(large, nats)
            with suppress(ArithmeticError, ValueError):  # raised at zeros and singularities
                found = self._by_panels(large, nats, *ends)
            error = abs(found) * arb(10) ** -wanted
            if full and found.is_finite():
                marks = [number(self.a), number(self.b)]
                # The integral is computed in units of the sum.
                size = abs(found).upper()
                size = size if size > 0 else arb(1)
                bits, top = int(nats / math.log(2)) + 60, size.log() / large
                true, proved = integral(self.f, self.g, self.x, marks, large, top, bits)
                error = abs(found.mid() - size * true)
            kind = "bound" if proved else "estimate"
            return arb(0), found.mid(), error.upper(), kind, self.order

    def _by_panels(self, lam: Any, nats: float, lo: Any, hi: Any) -> Any:
        constant, rest = self.g.as_independent(self.x, as_Add=False)
        weight = None if rest == 1 else code(rest, self.x)
        centre, last = min(max(float(self.near), float(lo)), float(hi)), self.order - 1
        low, high = max(lo, arb(centre - _CORE)), min(hi, arb(centre + _CORE))
        field = Phi(code(-sympy.diff(self.f, self.x), self.x), float(low), float(high))
        before, after = (
            [coalescence.panel(field, at, Factor(0), p, q, last, weight)] if p < q else []
            for at, p, q in ((low, lo, low), (high, high, hi))
        )
        parts = [*before, *field.panels(low, high, last, weight), *after]
        whole = reduce(Stretch.then, (record(one, lam, nats, last) for one in parts))
        return number(constant) * (lam * code(self.f, self.x)(lo)).exp() * whole.scale

    def _ends(self, lam: Any, nats: float) -> list[Any]:
        """The ends; infinite ones, and those where f -> -oo, move to where e^{lam f} is small."""
        lo, hi, inside = number(self.a), number(self.b), exact_ball(self.near)
        inside = inside if lo < inside < hi else middle(lo, hi)
        f, found = code(self.f, self.x), list[Any]()
        top, tiny = f(inside), (-arb(nats) - 10).exp()
        for end in (lo, hi):
            here, rest = cut(lambda u: (lam * (f(u) - top)).exp(), end, inside, tiny)
            if not rest.is_finite():
                raise InputError(
                    f"f = {self.f} does not fall, or not fast enough, as {self.x} tends to {end}, "
                    "so the integral diverges; give other ends."
                )
            found.append(here)
        return found

    def __repr__(self) -> str:
        return (
            f"uniform expansion ({self.order} terms) of the integral of {self.g} with f = {self.f} "
            f"over {self.x} from {self.a} to {self.b}"
        )


def uniform_integral(
    f: Any, g: Any, x: Any, a: Any, b: Any, order: Any = 3, *, near: Any = 0
) -> UniformExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)), uniform as its critical points coalesce.

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
    f, g, x, a, b = read(f, g, x, a, b)
    order, beside = count("order", order, 1, _MOST, " of terms"), exact("near", near)
    ordered = sympy.Tuple(a, b).free_symbols or number(a) < number(b)
    if sympy.Tuple(f, g, a, b).has(sympy.I) or not ordered:
        raise InputError(
            f"f = {f}, g = {g}, a = {a}, b = {b}; give real f and g, and real ends with a less "
            "than b."
        )
    return UniformExpansion(f, g, x, a, b, order, beside)
