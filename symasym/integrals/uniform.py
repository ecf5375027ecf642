"""Expansions of int g e^{lam f} dx, uniform as two saddles, or a saddle and an end, coalesce.

On a real interval the integral is computed from panels in canonical form with phi = -f'
(`symasym.expansions.canonical`). On a path between the valleys of two saddles the canonical
integrals are Airy functions (C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957)
599; DLMF 2.4(v)). With f = f_0 + eps (zeta s - s^3/3), Z = lam^(2/3) zeta and coefficients
p_k + q_k s from integration by parts, the expansion is

    2 pi i e^{lam f_0} sum (eps lam)^-k (p_k Ai(Z) lam^(-1/3) + eps q_k Ai'(Z) lam^(-2/3)).
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from typing import Any

import sympy
from flint import acb, arb, ctx

from symasym.base.balls import exact_ball, precision, rounded
from symasym.base.errors import InputError
from symasym.base.inputs import count, exact
from symasym.expansions import canonical, coalescence
from symasym.expansions.answer import NEXT, estimates
from symasym.expansions.coalescence import Factor, Phi
from symasym.expansions.sides import Stretch
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
# The distance at which the valleys of a path are tested.
_OUT = 30


@dataclass(frozen=True, repr=False)
class UniformExpansion(IntegralExpansion):
    """An expansion of the integral of g(x) e^(lam f(x)), uniform as critical points coalesce.

    `path` is True for a path between two complex valleys; `near` is a point near the saddles.
    """

    method = "uniform"
    path: bool
    near: Fraction

    def _again(self, f: Any, g: Any, a: Any, b: Any) -> UniformExpansion:
        return uniform_integral(f, g, self.x, a, b, self.order, near=self.near)

    def coefficients(self, dps: int = 15) -> tuple[Any, list[tuple[Any, Any]]]:
        """zeta and the pairs (p_k, q_k), the coefficients of Ai and Ai'."""
        with precision(4 * count("dps", dps, 1, 10_000) + 120):
            ctx.cap = 4 * dps + 60
            _, zeta, pairs, _ = self._pair(self.order)
            zeta = zeta if abs(zeta) > arb(10) ** (-2 * dps) else arb(0)
            return rounded(zeta, dps)[0], [
                (rounded(p, dps)[0], rounded(q, dps)[0]) for p, q in pairs
            ]

    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """The level 0, the sum, and its error.

        With `full` the error on a real interval is the distance to an enclosure of the integral; on
        a path it is three times the sum of the absolute values of the next three terms.
        """
        wanted = 14 if dps is None else dps
        nats = math.log(10) * (wanted + 2) + math.log(2 + lam)
        with precision(int(2 * nats) + 60):
            ctx.cap = math.ceil(-nats / math.log(coalescence.SHARE))
            large, row, kind = exact_ball(lam), [arb.nan()] * (NEXT + 1), "estimate"
            ends = self._valleys() if self.path else self._ends(large, nats)
            with suppress(ArithmeticError, ValueError):  # raised at zeros and singularities
                row = self._by_airy(large) if self.path else self._by_panels(large, nats, *ends)
            found = row[0]
            error = abs(found) * arb(10) ** -wanted + (estimates(row, 1)[0] if self.path else 0)
            if full and not self.path and found.is_finite():
                marks = [number(self.a), number(self.b)]
                # The integral is computed in units of the sum.
                size = abs(found).upper()
                size = size if size > 0 else arb(1)
                bits, top = int(nats / math.log(2)) + 60, size.log() / large
                true, proved = integral(self.f, self.g, self.x, marks, large, top, bits)
                error, kind = abs(found.mid() - size * true), "bound" if proved else "estimate"
            return arb(0), found.mid(), error.upper(), kind, self.order

    def _weight(self) -> tuple[Any, Any]:
        """The constant factor of g (of I g on a path), and the other factor; None if that is 1."""
        constant, rest = self.g.as_independent(self.x, as_Add=False)
        turned = sympy.expand((sympy.I if self.path else 1) * constant)
        return number(turned), None if rest == 1 else code(rest, self.x)

    def _field(self, lo: Any, hi: Any) -> Phi:
        return Phi(code(-sympy.diff(self.f, self.x), self.x), float(lo), float(hi))

    def _pair(self, terms: int) -> tuple[int, Any, list[tuple[Any, Any]], Any]:
        """eps, zeta, the (p_k, q_k) and f_0 for the two saddles nearest to `near`."""
        near, weight = float(self.near), self._weight()[1]
        field = self._field(near - _CORE, near + _CORE)
        pairs = [c for c in field.clusters() if len(c.zeros) == 2]
        if not pairs:
            raise InputError(f"f = {self.f} has no two saddles near {self.x} = {near:g}.")
        centre, pi = field.factor(min(pairs, key=lambda c: abs(c.centre - near)))
        found = coalescence.central_map(field.taylor(centre), pi)
        g = field.taylor(centre, weight or (lambda y: 0 * y + 1))
        top = coalescence.primitive(2, found.zeta, coalescence.at(found.s, arb(0)))
        rows = coalescence.integrated_by_parts(pi, found, g, terms - 1)[0]
        return found.eps, found.zeta, rows, code(self.f, self.x)(centre) + found.eps * top

    def _valleys(self) -> list[Any]:
        """Raise InputError unless f falls towards both ends and rises once in between."""
        f, near = code(self.f, self.x), exact_ball(self.near)
        end = self.b.xreplace({sympy.oo: sympy.S(_OUT), -sympy.oo: sympy.S(-_OUT)})
        x, y = map(number, end.as_real_imag())
        line = [f(acb(near + x, y * k / 32)).real > f(near) for k in range(-32, 33)]
        if line[0] or line[-1] or sum(q and not p for p, q in pairwise(line)) != 1:
            raise InputError(
                f"from {self.a} to {self.b} f = {self.f} does not fall, rise and fall once; give "
                "ends in the two valleys of its saddles."
            )
        return []

    def _by_airy(self, lam: Any) -> list[Any]:
        eps, zeta, pairs, level = self._pair(self.order + NEXT)
        third, total, rows = lam.root(3), arb(0), []
        ai, slope, _, _ = (zeta * third**2).airy()
        front = 2 * arb.pi() * (lam * level).exp() * self._weight()[0]
        for k, (p, q) in enumerate(pairs):
            total += (p * ai / third + eps * q * slope / third**2) / (eps * lam) ** k
            rows.append(front * total)
        return rows[self.order - 1 :]

    def _by_panels(self, lam: Any, nats: float, lo: Any, hi: Any) -> list[Any]:
        front, weight = self._weight()
        centre, last = min(max(float(self.near), float(lo)), float(hi)), self.order - 1
        low, high = max(lo, arb(centre - _CORE)), min(hi, arb(centre + _CORE))
        field = self._field(low, high)
        before, after = (
            [coalescence.panel(field, at, Factor(0), p, q, last, weight)] if p < q else []
            for at, p, q in ((low, lo, low), (high, high, hi))
        )
        parts = [*before, *field.panels(low, high, last, weight), *after]
        whole = reduce(Stretch.then, (canonical.ways(one, lam, nats)[-1] for one in parts))
        return [front * (lam * code(self.f, self.x)(lo)).exp() * whole.scale]

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
    f : Expr, str or number
        Analytic and real on a real interval; or, for an upward path between the valleys of two
        saddles, with a and b conjugate complex infinities such as ``oo - I*pi``, ``oo + I*pi``.
    g : Expr, str or number
        Analytic and real; on such a path, i times a real function.
    x : Symbol or str
    a, b : Expr or number
    order : int, optional
        The number N of terms, 1 to 40, with relative powers lam^0 to lam^(1 - N).
    near : number, optional
        A point near the saddles, which are searched for within a distance of 8.

    Examples
    --------
    The Bessel function J_100(100) at its turning point, at which the saddle points coalesce, and
    Temme's incomplete gamma function, with the maximum of log(x) - x near the end mu:

    >>> import symasym as sa
    >>> bessel = sa.uniform_integral(
    ...     "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=4
    ... )
    >>> print(bessel.bind(z=1).evaluate(100, dps=20, full=True))
    0.09636667329519 ± 2.02e-12 (estimate, uniform)
    >>> gamma = sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=4, near=1)
    >>> print(gamma.bind(mu="1.01").evaluate(100, dps=20, log=True, full=True))
    -102.1877779347692 ± 2.93e-12 (estimate, uniform)
    """
    f, g, x, a, b = read(f, g, x, a, b)
    order, beside = count("order", order, 1, _MOST, " of terms"), exact("near", near)
    far = sympy.Dummy(positive=True)
    low, high = (e.xreplace({sympy.oo: far, -sympy.oo: -far}) for e in (a, b))
    up = high.has(far) and sympy.im(high).is_positive and low == high.conjugate()
    path = sympy.Tuple(a, b).has(sympy.I)
    weight = sympy.expand(sympy.I * g) if path and up else g
    ordered = path or sympy.Tuple(a, b).free_symbols or number(a) < number(b)
    if f.has(sympy.I) or weight.has(sympy.I) or (path and not up) or not ordered:
        raise InputError(
            f"f = {f}, g = {g}, a = {a}, b = {b}; give real f, g and ends a < b, or real f and I*g "
            "with ends such as oo - I*pi and oo + I*pi (take a constant factor out)."
        )
    # If g has zeros of high order, all computed terms may vanish, and their sizes say nothing.
    zeros = [p.exp for p in g.atoms(sympy.Pow) if p.base.has(x) and p.exp.is_Integer]
    if path and sum(n for n in zeros if n > 0) > 2 * (order + NEXT - 1):
        raise InputError(
            f"g = {g} has zeros of too high an order for order = {order}; give a larger order."
        )
    return UniformExpansion(f, g, x, a, b, order, path, beside)
