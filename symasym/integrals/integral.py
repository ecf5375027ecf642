"""The integral of g e^(lam f): zeros of f', its enclosure, and the values of its expansions.

The error of an expansion at a given lam is the distance of the sum to an enclosure of the integral,
whatever the expansion has missed.

The enclosure is computed by flint (F. Johansson, Numerical integration in arbitrary-precision ball
arithmetic, 2018); it is proved on a finite interval if the integrand is analytic at both ends. At
an infinite or singular end the integral is truncated and the tail is bounded on dyadic shells, out
to 1e300 or a bound below 2^-(10^9), or in to 1e-300 or the square of the tolerance. The remaining
tail is assumed to decrease geometrically, with the ratio of the last two shells.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache
from itertools import accumulate, pairwise
from math import cos, log, pi
from typing import Any, ClassVar, Self

import numpy as np
import sympy
from flint import acb, arb, ctx
from sympy import Expr, S, Symbol

from symasym.base import inputs
from symasym.base.balls import cached_property, precision, rational
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import Number, Numbers, exact
from symasym.drift.evaluate import box, profile
from symasym.drift.expressions import parse
from symasym.drift.formula import FUNCTIONS, interned
from symasym.drift.scenes import Answer, Request
from symasym.methods import in_digits

# The largest numbers of operations and functions, for which an expansion takes seconds, and of
# zeros of f'.
_OPERATIONS, _CALLS, _MOST = 250, 12, 60
#: The precision at which critical points and ends are compared.
BITS = 256
# The number of shells towards an end, the halvings of each, and the bound at which they stop.
_SHELLS, _DEPTH, _NOTHING = 997, 6, arb(2) ** -(10**9)


def code(e: Expr, x: Symbol) -> Any:
    """The expression as a function of balls; nan on balls that meet a branch cut or a pole."""
    return profile(interned(e, x), {})


def number(e: Any) -> Any:
    """A constant as a ball; nan if it is not real."""
    if isinstance(e, Zero):
        return e.ball()
    if e in (S.Infinity, S.NegativeInfinity):
        return arb.pos_inf() if e > 0 else arb.neg_inf()
    try:
        return arb(code(e, Symbol("x"))(arb(0)))
    except InputError:  # for example, a complex value at sampled parameters
        return arb.nan()


def middle(lo: Any, hi: Any) -> Any:
    """A point inside an interval whose ends are balls."""
    if lo.is_finite():
        return (lo + hi) / 2 if hi.is_finite() else lo + 1
    return hi - 1 if hi.is_finite() else arb(0)


# -- zeros -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Zero:
    """A point between two numbers at which an expression in x changes sign."""

    equation: Expr
    x: Symbol
    lo: Any
    hi: Any

    def ball(self) -> Any:
        """The point as a ball, by bisection."""
        bits = ctx.prec
        with precision(2 * bits + 200):
            of, p, q = code(self.equation, self.x), self.lo, self.hi
            sign = of(p)
            for _ in range(bits + 100):
                m = ((p + q) / 2).mid()
                value = of(m)
                if value == 0:
                    return m
                if value.contains(0):
                    r = arb(2) ** -ctx.prec
                    while r < q - p and not of(m - r) * of(m + r) < 0:
                        r *= 2
                    return arb(m, r)
                p, q = (m, q) if value * sign > 0 else (p, m)
            return p.union(q)

    def __str__(self) -> str:
        return str(self.ball().str(12, radius=False))


@lru_cache(maxsize=512)
def zeros(e: Expr, x: Symbol, lo: Expr, hi: Expr) -> list[Zero]:
    """The real zeros and poles in (lo, hi); for other than rational functions, sign changes."""
    a, b, poly = number(lo), number(hi), None
    if e.is_rational_function(x):
        poly = sympy.Mul(*sympy.fraction(sympy.together(e))).as_poly(x)
    if poly and poly.domain in (sympy.ZZ, sympy.QQ):
        # The ends of the intervals are no zeros of the irreducible factor, unless it is linear.
        rows = [(f.as_expr(), pair) for f, _ in poly.factor_list()[1] for pair, _ in f.intervals()]
        found = [Zero(f, x, *map(number, pair)) for f, pair in rows]
    else:
        found = _on_grid(e, x, a, b)
    if len(found) > _MOST:
        raise InputError(
            f"{e} has more than {_MOST} zeros for {x} in ({lo}, {hi}); give an integral with "
            "fewer critical points."
        )
    return [z for z in found if a < z.ball() < b]


def _on_grid(e: Expr, x: Symbol, a: Any, b: Any) -> list[Zero]:
    """The points at which the sign changes between points of a grid, also at poles and jumps."""
    of = code(e, x)
    if (b - a).is_finite():
        grid = [a + (b - a) * arb((1 - cos(pi * k / 800)) / 2) for k in range(1, 800)]
    else:
        reach = [arb(2) ** (arb(k) / 30 - 27) for k in range(1600)]
        base = a if a.is_finite() else b if b.is_finite() else arb(0)
        left = [] if a.is_finite() else [base - y for y in reach[::-1]]
        grid = [*left, base, *([] if b.is_finite() else [base + y for y in reach])]
    known = [(y.mid(), v) for y in grid if (v := of(y)).is_finite() and not v.contains(0)]
    return [Zero(e, x, p, q) for (p, u), (q, v) in pairwise(known) if u * v < 0]


# -- integrals -------------------------------------------------------------------------------------


def integral(f: Expr, g: Expr, x: Symbol, marks: list[Any], lam: Any, top: Any) -> tuple[Any, bool]:
    """A ball for int g e^(lam (f - top)) dx from the first to the last mark, infinite if there is
    no enclosure; and True if the enclosure is proved.

    The integral is split at the marks, where f and g may be singular; any marks give enclosures.
    """
    height, slope, bend, weight = (code(e, x) for e in (f, f.diff(x), f.diff(x, 2), g))

    def integrand(z: Any) -> Any:
        value = height(z)
        # Finiteness of f itself is required, since f'' may be finite where f is not analytic.
        if value.is_finite() and not lam * value.rad() < 1:
            # Near a maximum the enclosure by Taylor's formula is narrower.
            m = z.mid()
            near = height(m) + (z - m) * (slope(m) + (z - m) * bend(z) / 2)
            value = near if near.rad() < value.rad() else value
        return weight(z) * (lam * (value - top)).exp()

    total, tiny, proved = arb(0), arb(2) ** -ctx.prec, True
    for lo, hi in pairwise(marks):
        if lo < hi:
            inside = middle(lo, hi)
            (a, before), (b, after) = (cut(integrand, end, inside, tiny) for end in (lo, hi))
            # Beside a singular end other than 0 the distance from it takes more bits.
            cuts = [(p, q) for p, q in ((a, lo), (b, hi)) if q != 0 and not p.overlaps(q)]
            near = [abs(p - q).log() for p, q in cuts]
            more = max(0, *(int(-float(y) / log(2)) for y in near if y.is_finite()), 0)
            with precision(ctx.prec + more):
                found = acb.integral(lambda z, _: acb(integrand(z)), acb(a), acb(b), tiny, tiny)
            total += found.real + arb(0, before + after)
            proved = proved and before == after == 0
    return total, proved


def towards(end: Any, inside: Any, k: int) -> Any:
    """The point at 2^k towards an infinite end, or at 2^-k of the way from another end."""
    if end.is_finite():
        return end + (inside - end) * arb(2) ** -k
    return inside + (1 if end > 0 else -1) * arb(2) ** k


def cut(integrand: Any, end: Any, inside: Any, tiny: Any) -> tuple[Any, Any]:
    """The point of truncation near an end, and a bound on the tail, which is 0 at a regular end."""
    far = not end.is_finite()
    if not far and integrand(acb(end) + box(0, tiny, tiny)).is_finite():
        return end, arb(0)
    # Points near an end other than 0 need a higher precision.
    with precision(ctx.prec + (0 if far or end == 0 else _SHELLS)):
        at = [towards(end, inside, k) for k in range(_SHELLS)]
        shells: list[Any] = []
        for p, q in pairwise(at):
            shells.append(_bound(integrand, p, q, tiny / _SHELLS, _DEPTH))
            known = shells[-1] < _NOTHING or (shells[-1] < tiny * tiny and not far)
            if known and len(shells) > 1 and shells[-1] < shells[-2]:
                break
    # Beyond the last shell a geometric decrease is assumed.
    ratio = shells[-1] / shells[-2] if shells[-1] > _NOTHING else arb(0)
    last = shells[-1] * ratio / (1 - ratio) if ratio < 1 else arb.pos_inf()
    rests = list(accumulate(reversed(shells), initial=last))[::-1]
    found = zip(at, rests, strict=False)
    return next(((y, r) for y, r in found if r < tiny), (at[len(shells)], last))


def _bound(integrand: Any, p: Any, q: Any, small: Any, depth: int) -> Any:
    """An upper bound of the integral of |integrand| over [p, q], which is bisected if needed."""
    whole = abs(integrand(p.union(q))) * abs(q - p)
    if depth and not (whole < small or whole < 64 * abs(q - p) * abs(integrand(p))):
        m = ((p + q) / 2).mid()
        return sum((_bound(integrand, *h, small, depth - 1) for h in ((p, m), (m, q))), arb(0))
    return whole.upper()


# -- expansions ------------------------------------------------------------------------------------


@dataclass(frozen=True, repr=False)
class IntegralExpansion(ABC):
    """An expansion of the integral of g(x) e^(lam f(x)) over [a, b]."""

    f: Any
    g: Any
    x: Any
    a: Any
    b: Any
    order: Any
    #: The name of the method in an `Estimate`.
    method: ClassVar[str]

    def __post_init__(self) -> None:
        """Raise InputError unless the integral is real, and f and g can be expanded."""
        f, g, x, ends = self.f, self.g, self.x, sympy.Tuple(self.a, self.b)
        whole = sympy.Tuple(f, g, ends)
        with precision(BITS):
            real = isinstance(x, Symbol) and f.has(x) and not ends.has(x) and not whole.has(sympy.I)
            ordered = real and (ends.free_symbols or number(self.a) < number(self.b))
            if not ordered or "lam" in {str(s) for s in whole.free_symbols - {x}}:
                raise InputError(
                    f"f = {f}, g = {g}, x = {inputs.shown(x)}, a = {self.a}, b = {self.b}; give "
                    "real f and g, of which f depends on the symbol x, and real ends, of which a "
                    "is less than b; no parameter may be called lam."
                )
        for e in (f, g):
            calls = [type(n).__name__ for n in e.atoms(sympy.Function)]
            odd = {*calls} - {*FUNCTIONS} or e.atoms(sympy.oo, -sympy.oo, sympy.zoo, sympy.nan)
            if odd or len(calls) > _CALLS or sympy.count_ops(e) > _OPERATIONS:
                raise InputError(
                    f"f or g has {sympy.count_ops(e)} operations, {len(calls)} functions and "
                    f"{', '.join(map(str, odd)) or 'none'} that can't be expanded; give at most "
                    f"{_OPERATIONS} and {_CALLS}, of {', '.join(FUNCTIONS)}, powers and numbers."
                )

    @classmethod
    def of(cls, f: Any, g: Any, x: Any, a: Any, b: Any, *rest: Any) -> Self:
        """The expansion for expressions, texts and numbers."""
        symbol = Symbol(x) if inputs.is_name(x) else x
        names = {symbol.name: symbol} if isinstance(symbol, Symbol) else {}
        f, g, a, b = (parse(*row, names) for row in (("f", f), ("g", g), ("a", a), ("b", b)))
        return cls(f, g, symbol, a, b, *rest)

    @cached_property
    def parameters(self) -> tuple[Symbol, ...]:
        """The free symbols other than x."""
        free = sympy.Tuple(self.f, self.g, self.a, self.b).free_symbols - {self.x}
        return tuple(sorted(free, key=str))

    @abstractmethod
    def _sum(self, lam: Any) -> tuple[Any, Any, int]:
        """A height, the sum over e^(lam height), and its number of terms.

        Flint's precision is 64 bits more than the digits of the sum need.
        """

    def bind(self, /, **values: Number) -> Self:
        """The expansion with exact values of parameters."""
        names, swap = {str(s): s for s in self.parameters}, {}
        for name, value in values.items():
            if name not in names:
                known = ", ".join(names) or "none"
                raise InputError(f"{name} is not a parameter of the integral ({known}).")
            swap[names[name]] = sympy.Rational(*exact(name, value).as_integer_ratio())
        f, g, a, b = sympy.Tuple(self.f, self.g, self.a, self.b).xreplace(swap)
        return replace(self, f=f, g=g, a=a, b=b)

    def evaluate(
        self, lam: Numbers, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum of the terms at `lam`, which must be greater than 0.

        Parameters
        ----------
        lam : number or array_like
        dps : int, optional
            The digits of the sum, which is then an mpf. By default it is a float64 number.
        log : bool
            Return the natural logarithm, which is finite even if the value overflows.
        full : bool
            Return an `Estimate` with the error, however large.

        Raises
        ------
        AccuracyError
            If the error is unknown or, without `full`, exceeds half of the value; in an array such
            an element is nan.
        """
        if self.parameters:
            names = ", ".join(map(str, self.parameters))
            raise InputError(f"no value is set for {names}; set each by bind.")
        log, full = inputs.flag("log", log), inputs.flag("full", full)
        dps = inputs.digits(dps)
        request = Request("the integral", self.method, None, dps, log, full)
        if not inputs.is_array(lam):
            return self._one(exact("lam", lam), request)
        if dps is not None:
            raise InputError(f"lam is an array and dps is {dps}; arrays are for float64.")
        given = inputs.floats("lam", lam)
        each, notes = list[Any](), list[str]()
        for y in given.ravel():
            try:
                each.append(self._one(Fraction(y), request))
            except (AccuracyError, RangeError) as problem:
                each.append(Estimate(np.nan, np.nan, "bound", self.method) if full else np.nan)
                notes.append(str(problem))
        if not full:
            return np.reshape(each, given.shape)
        value, error = (np.reshape(y, given.shape) for y in zip(*each, strict=True))
        kind = max(y.error_kind for y in each)  # an estimate if one of the errors is
        return replace(each[0], value=value, error=error, error_kind=kind, notes=tuple(notes[:1]))

    def _one(self, lam: Fraction, request: Request) -> Any:
        """The value at one lam, and its distance to an enclosure of the integral."""
        size = int(inputs.positive("lam", lam)).bit_length()
        with precision(int(3.33 * (request.dps or 17)) + 64 + size):
            large, x, a, b = arb(rational(lam)), self.x, self.a, self.b
            height, total, terms = self._sum(large)
            inside = [z.ball() for z in zeros(self.f.diff(x), x, a, b)]
            marks = [number(a), *sorted(inside, key=float), number(b)]
            whole, proved = total, False  # without a sum there is nothing to enclose
            if height.is_finite():
                whole, proved = integral(self.f, self.g, x, marks, large, height)
            off, level = abs(total - whole), large * height
            if request.log:
                value, error = level + total.log(), -(-off / total).log1p()
            else:
                value, error = level.exp() * total, level.exp() * off
            known = value.is_finite() and error.is_finite()
            if not (known and (request.full or off < abs(total) / 2)):
                raise AccuracyError(
                    f"the integral of f = {self.f} at lam = {inputs.float_text(lam)} has no value "
                    "here: the error exceeds half of it, or there is a singularity, a slow decay, "
                    "three saddles close together or, for the logarithm, a sum that may be "
                    "negative; split it, or give a larger lam or another order."
                )
            kind: ErrorKind = "bound" if proved else "estimate"
            return in_digits(request, Answer(value + arb(0, error.upper()), kind, terms))
