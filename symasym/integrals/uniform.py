"""Integrals of g e^{lam f}, uniform as two saddles, or a saddle and an end, coalesce.

On a real interval the integral is B of panels in canonical form with phi = -f'
(`symasym.expansions.canonical`), with lam i in place of lam where f is imaginary; iterated over
u < v with the weights g(u) h(v) it is J. On a path between the valleys beside two saddles, or over
the whole line for imaginary f, the canonical integrals are Airy functions alone (C. Chester, B.
Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599; DLMF 2.4(v)): with the coefficients
p_k + q_k s of the integration by parts, f = f_0 + eps (zeta s - s^3/3) and Z = lam^(2/3) zeta

    2 pi i e^{lam f_0} sum (eps lam)^-k (p_k Ai(Z) lam^(-1/3) + eps q_k Ai'(Z) lam^(-2/3)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import reduce
from itertools import pairwise
from typing import Any

import numpy as np
import sympy
from flint import acb, arb, ctx
from sympy import Expr, Symbol

from symasym.base.call_context import symbolic
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import Estimate
from symasym.base.inputs import (
    Number,
    Numbers,
    count,
    digits,
    exact,
    flag,
    floats,
    is_array,
    is_name,
    positive,
    shown,
)  # fmt: skip
from symasym.drift.evaluate import profile
from symasym.drift.expressions import parse
from symasym.drift.models import Expression
from symasym.expansions.canonical import (
    SHARE,
    Factor,
    Field,
    Way,
    at,
    by_parts,
    central_map,
    panel,
    primitive,
    ways,
)  # fmt: skip
from symasym.numbers.balls import exact_ball, precision, to_mpf

__all__ = ["UniformExpansion", "uniform_integral"]

_MOST, _NEXT, _SAFETY = 40, 3, 3
# How far from its middle an infinite interval is looked at for saddles.
_CORE = 8
_VALLEYS = (sympy.oo, -sympy.oo)


@dataclass(frozen=True, repr=False)
class UniformExpansion:
    """An expansion of the integral of g(x) e^(lam f(x)) that holds as critical points coalesce.

    Or, with g a pair (g, h), of the iterated integral of g(u) h(v) e^(lam (f(v) - f(u))), u < v.

    Attributes
    ----------
    f, a, b : Expr
    g : tuple of Expr
        One weight, or g and h.
    x : Symbol
    order : int
        Terms kept.
    kind : {"real", "oscillating", "contour", "iterated"}
    near : Fraction
        A point beside the saddles.
    """

    f: Expr
    g: tuple[Expr, ...]
    x: Symbol
    a: Expr
    b: Expr
    order: int
    kind: str
    near: Any

    @property
    def parameters(self) -> tuple[Symbol, ...]:
        """Free symbols besides x."""
        parts = (self.f, *self.g, self.a, self.b)
        return tuple(sorted(set().union(*(e.free_symbols for e in parts)) - {self.x}, key=str))

    def bind(self, /, **values: Number) -> UniformExpansion:
        """The expansion with exact numbers for parameters."""
        names, swap = {str(s): s for s in self.parameters}, {}
        for name, value in values.items():
            if name not in names:
                raise InputError(f"{name} is not a parameter of the integral ({', '.join(names)}).")
            number = exact(name, value)
            swap[names[name]] = sympy.Rational(number.numerator, number.denominator)
        g = tuple(w.xreplace(swap) for w in self.g)
        f, a, b = (e.xreplace(swap) for e in (self.f, self.a, self.b))
        return replace(self, f=f, g=g, a=a, b=b)

    def evaluate(
        self, lam: Numbers, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum at `lam`, a number or an array of them (float64), greater than 0.

        With `dps` an mpf or mpc, with `log` its natural logarithm; `full` gives an `Estimate`,
        whose error is three times the sum of the next three differences.
        """
        if self.parameters:
            names = ", ".join(map(str, self.parameters))
            raise InputError(f"parameters have no value: {names}; call bind(...) first.")
        log, full = flag("log", log), flag("full", full)
        dps = None if dps is None else digits(dps)
        if is_array(lam):
            if dps is not None:
                raise InputError(f"lam is an array and dps is {dps}; arrays are for float64.")
            rows = [self._at(exact("lam", float(y)), None, log) for y in floats("lam", lam).flat]
            value, error = (
                np.array(x).reshape(floats("lam", lam).shape) for x in zip(*rows, strict=True)
            )
        else:
            value, error = self._at(positive("lam", exact("lam", lam)), dps, log)
        return Estimate(value, error, "estimate", "uniform", self.order) if full else value

    def coefficients(self, dps: int = 15) -> tuple[Any, list[tuple[Any, Any]]]:
        """zeta and the pairs (p_k, q_k) of g that stand with Ai and Ai' (of a pair (g, h): g's)."""
        with precision(4 * digits(dps) + 120):
            ctx.cap = 4 * dps + 60
            _, zeta, pairs, _ = self._pair(self.order)
            zeta = zeta if abs(zeta) > arb(10) ** (-2 * dps) else arb(0)
            return to_mpf(zeta, dps)[0], [(to_mpf(p, dps)[0], to_mpf(q, dps)[0]) for p, q in pairs]

    # -- at one lam --------------------------------------------------------------------------------

    def _at(self, lam: Any, dps: int | None, log: bool) -> tuple[Any, Any]:
        """The value and its error."""
        wanted = 14 if dps is None else dps
        nats = math.log(10) * (wanted + 2) + math.log(2 + lam)
        with precision(int(2 * nats) + 60):
            ctx.cap = math.ceil(-nats / math.log(SHARE))
            number, last = exact_ball(lam), self.order + _NEXT
            try:
                row = (self._by_airy if self._whole else self._by_panels)(number, last, nats)
            except AccuracyError:
                row = [arb.nan()] * (last + 1)
            gaps = [abs(y - x) for x, y in pairwise(row[self.order - 1 :])]
            value = acb(row[self.order - 1])
            error = _SAFETY * sum(gaps, arb(0)) + abs(value) * arb(10) ** -wanted
            if not (value.is_finite() and error.is_finite()):
                raise AccuracyError(
                    f"f = {self.f} has more than two saddles close together, or f or g is singular "
                    "inside; split the integral there."
                )
            if log:
                if not (value.imag == 0 and value.real > error):
                    raise AccuracyError(
                        f"the sum at lam = {float(lam):.6g} is complex or not surely positive; ask "
                        "for the value, not its logarithm."
                    )
                value, error = value.log(), -(1 - error / value.real).log()
            parts = [to_mpf(y, wanted)[0] for y in (value.real, value.imag)]
            size = to_mpf(error, 15)[0]
        real = self.kind != "oscillating"
        if dps is not None:
            import mpmath

            pair = tuple(y._mpf_ for y in parts)
            return (parts[0] if real else mpmath.mp.make_mpc(pair)), size
        found = float(parts[0]), float(parts[1])
        if max(map(abs, found)) == math.inf or (parts[0] and not any(found)):
            raise RangeError(
                f"the value at lam = {float(lam):.6g} is outside the range of float64; pass "
                "log=True or dps=..."
            )
        return (found[0] if real else complex(*found)), float(size) + 2e-16 * abs(complex(*found))

    @property
    def _whole(self) -> bool:
        """True where no end adds anything."""
        oscillating = self.kind == "oscillating"
        return self.kind == "contour" or (oscillating and {self.a, self.b} == set(_VALLEYS))

    @property
    def _phase(self) -> Expr:
        """f, over i where it is imaginary."""
        phase = sympy.expand(self.f / sympy.I) if self.kind == "oscillating" else self.f
        if phase.has(sympy.I):
            raise InputError(f"f = {self.f} is neither real nor imaginary; give one or the other.")
        return phase

    def _function(self, e: Any) -> Any:
        """An expression as a function of balls and power series."""
        return profile(Expression(sympy.sympify(e), self.x), {})

    def _factor(self, g: Expr) -> tuple[Any, Expr]:
        """A constant factor, and the rest, which is real."""
        constant, rest = g.as_independent(self.x, as_Add=False)
        re, im = (self._function(y)(arb(0)) for y in sympy.expand_complex(constant).as_real_imag())
        return acb(re, im), rest

    def _field(self, lo: float, hi: float) -> Field:
        return Field(self._function(-sympy.diff(self._phase, self.x)), lo, hi)

    def _pair(self, terms: int) -> tuple[int, Any, list[tuple[Any, Any]], Any]:
        """eps, zeta, (p_k, q_k) and f_0 of the two saddles nearest to `near`."""
        middle = float(self.near)
        field = self._field(middle - _CORE, middle + _CORE)
        pairs = [c for c in field.clusters() if len(c.zeros) == 2]
        if not pairs:
            raise InputError(f"f = {self.f} has no two saddles near {self.x} = {middle:g}.")
        centre, pi = field.factor(min(pairs, key=lambda c: abs(c.centre - middle)))
        found = central_map(field.taylor(centre), pi)
        weight = field.taylor(centre, self._function(self._factor(self.g[0])[1]))
        top = primitive(2, found.zeta, at(found.s, arb(0)))
        level = self._function(self._phase)(centre) + found.eps * top
        return found.eps, found.zeta, by_parts(pi, found, weight, terms - 1)[0], level

    def _by_airy(self, lam: Any, terms: int, nats: float) -> list[Any]:
        eps, zeta, pairs, level = self._pair(terms)
        Z, third, total, rows = zeta * lam.root(3) ** 2, lam.root(3), acb(0), []
        turned = self.kind == "oscillating"
        ai, slope, _, _ = (-Z if turned else Z).airy()
        for k, (p, q) in enumerate(pairs):
            if turned:
                # With s = i t on the path.
                term = p * ai / third + acb(0, eps) * q * slope / third**2
                total += term / acb(0, eps * lam) ** k
            else:
                total += (p * ai / third + eps * q * slope / third**2) / (eps * lam) ** k
            rows.append(total)
        front = (
            2
            * arb.pi()
            * (acb(0, lam * level).exp() if turned else acb(0, 1) * (lam * level).exp())
        )
        return [front * self._factor(self.g[0])[0] * y for y in rows]

    def _by_panels(self, lam: Any, terms: int, nats: float) -> list[Any]:
        f, (lo, hi) = self._function(self._phase), self._ends(float(lam), nats)
        factors, rests = zip(*map(self._factor, self.g), strict=True)
        weights = [None if w == 1 else self._function(w) for w in rests]
        middle, last = min(max(float(self.near), float(lo)), float(hi)), terms - 1
        low, high = max(lo, arb(middle - _CORE)), min(hi, arb(middle + _CORE))
        field = self._field(float(low), float(high))
        parts = field.panels(low, high, last, *weights)
        if lo < low:
            parts.insert(0, panel(field, low, Factor(0), lo, low, last, *weights))
        if high < hi:
            parts.append(panel(field, high, Factor(0), high, hi, last, *weights))
        turned = acb(0, lam) if self.kind == "oscillating" else lam
        rows = [ways(one, turned, nats) for one in parts]
        front = reduce(lambda x, y: x * y, factors)
        if self.kind == "iterated":
            return [front * reduce(Way.then, row).J for row in zip(*rows, strict=True)]
        front *= (turned * f(lo)).exp()
        return [front * reduce(Way.then, row).B for row in zip(*rows, strict=True)]

    def _ends(self, lam: float, nats: float) -> tuple[Any, Any]:
        """The ends, where infinite or f is -oo moved to where e^{lam f} is below all digits."""
        f, near = self._function(self._phase), float(self.near)
        found: list[Any] = []
        for end, side in ((self.a, -1), (self.b, 1)):
            here = None if end.is_infinite else self._function(end)(arb(0))
            if here is None and self.kind == "iterated":
                # The part with u near v falls like a power.
                here = arb(near + side * math.exp(nats))
            elif here is None or not f(here).is_finite():
                # Outwards, or half of what is left at a time.
                steps = (2.0**k for k in range(60))
                inside = max(near, float(found[0]) + 1) if found else near
                marks = [
                    inside + side * y if here is None else here + (inside - here) / y for y in steps
                ]
                heights = [float(f(arb(y))) for y in marks]
                falls = (
                    k for k, y in enumerate(heights)
                    if lam * (max(heights[: k + 1]) - y) > nats + 10
                )  # fmt: skip
                k = next(falls, None)
                if k is None:
                    raise InputError(
                        f"f = {self.f} does not fall as {self.x} tends to {end}, so the integral "
                        "diverges; give other ends."
                    )
                here = arb(marks[k])
            found.append(here)
        return found[0], found[1]

    @property
    def error_kind(self) -> str:
        """``"estimate"``, or ``"none"`` while parameters are free."""
        return "none" if self.parameters else "estimate"

    def __repr__(self) -> str:
        return (
            f"uniform expansion ({self.kind}, {self.order} terms) of the integral of "
            f"{', '.join(map(str, self.g))} with f = {self.f} over {self.x} from {self.a} to "
            f"{self.b}; error: {self.error_kind}"
        )


@symbolic
def uniform_integral(
    f: Number,
    g: Number | tuple[Number, Number],
    x: Symbol | str,
    a: Number,
    b: Number,
    order: int = 3,
    *,
    near: Number = 0,
) -> UniformExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)), uniform as its critical points coalesce.

    Parameters
    ----------
    f : Expr, str or number
        Real on a real interval; or real with a and b conjugate complex infinities such as
        ``oo - I*pi`` and ``oo + I*pi``, for a path between the valleys beside two saddles; or
        imaginary, on a finite interval or from -oo to oo. Analytic; split integrals at kinks.
    g : Expr, str or number, or a pair of them
        Real up to a constant factor, analytic. A pair (g, h) asks for the iterated integral over
        a < u < v < b of g(u) h(v) e^(lam (f(v) - f(u))).
    x : Symbol or str
        Variable of integration.
    a, b : Expr or number
        Ends.
    order : int, optional
        Terms kept, 1 to 40: relative powers lam^0 to lam^(1 - N).
    near : number, optional
        A point beside the saddles, which are looked for within 8 of it.

    Returns
    -------
    UniformExpansion
        With ``evaluate(lam, dps=None, log=False, full=False)``, ``bind(**values)`` and
        ``coefficients()``.

    Raises
    ------
    InputError
        If f is neither real nor imaginary, or no pair of saddles is found where one is needed.

    Examples
    --------
    The Bessel function J_100(100) at its turning point, where saddle points coalesce, and Temme's
    incomplete gamma function, where the maximum of log(x) - x is near the end mu:

    >>> import symasym as sa
    >>> bessel = sa.uniform_integral(
    ...     "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=4
    ... )
    >>> print(bessel.bind(z=1).evaluate(100, dps=20, full=True))
    0.09636667329519 ± 2.02e-12 (estimate, uniform)
    >>> gamma = sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=4, near=1)
    >>> print(gamma.bind(mu="1.01").evaluate(100, dps=20, log=True, full=True))
    -102.18777793476922 ± 9.19e-12 (estimate, uniform)
    """
    symbol = Symbol(x) if is_name(x) else x
    if not isinstance(symbol, Symbol):
        raise InputError(f"x is {shown(x)}; give the variable of integration, a SymPy symbol.")
    names = {symbol.name: symbol}
    iterated = isinstance(g, (tuple, list, sympy.Tuple))
    weights = tuple(parse("g", w, names) for w in (g if iterated else (g,)))  # type: ignore[union-attr]
    formula, lo, hi = (parse(n, v, names) for n, v in (("f", f), ("a", a), ("b", b)))
    order, beside = count("order", order, 1, _MOST, " of terms"), exact("near", near)
    kind = "iterated" if iterated else "oscillating" if formula.has(sympy.I) else "real"
    if lo.has(sympy.I) or hi.has(sympy.I):
        kind = "contour"
    return UniformExpansion(formula, weights, symbol, lo, hi, order, kind, beside)
