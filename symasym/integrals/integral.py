"""The integral of g e^(lam f): as read, in balls, enclosed, and how values of expansions are given.

The enclosure is flint's (F. Johansson, Numerical integration in arbitrary-precision ball
arithmetic, 2018), proved on a finite interval with the integrand analytic at both ends. At
infinity, or at a singular end, it is cut off at some distance and what lies beyond is bounded on
shells, each of twice the distance of the last one, or half of it: to 1e300 or until they are below
2^-(10^9), and to 1e-300 or the square of the digits. That they go on as the last two do is assumed.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from itertools import accumulate, pairwise
from typing import Any, ClassVar

import numpy as np
import sympy
from flint import acb, arb, ctx
from sympy import Expr, S, Symbol

from symasym.base import inputs
from symasym.base.balls import precision
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import Number, Numbers, exact
from symasym.drift.evaluate import box, profile
from symasym.drift.expressions import parse
from symasym.drift.formula import FUNCTIONS, interned
from symasym.drift.scenes import Answer, Request
from symasym.methods import in_digits

# What is worked out within seconds.
_OPERATIONS, _CALLS = 250, 12


@dataclass(frozen=True, repr=False)
class IntegralExpansion(ABC):
    """An expansion of the integral of g(x) e^(lam f(x)) over [a, b]."""

    f: Expr
    g: Expr
    x: Symbol
    a: Expr
    b: Expr
    order: Any
    #: Its name in an `Estimate`.
    method: ClassVar[str]

    @cached_property
    def parameters(self) -> tuple[Symbol, ...]:
        """Free symbols besides x."""
        free = sympy.Tuple(self.f, self.g, self.a, self.b).free_symbols - {self.x}
        return tuple(sorted(free, key=str))

    @abstractmethod
    def _again(self, f: Any, g: Any, a: Any, b: Any) -> Any:
        """The expansion of another integral."""

    @abstractmethod
    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """level, sum and error over e^level, and what else an `Answer` has, at one lam."""

    def bind(self, /, **values: Number) -> Any:
        """The expansion with exact numbers for parameters."""
        names, swap = {str(s): s for s in self.parameters}, {}
        for name, value in values.items():
            if name not in names:
                known = ", ".join(names) or "none"
                raise InputError(f"{name} is not a parameter of the integral ({known}).")
            swap[names[name]] = sympy.Rational(*exact(name, value).as_integer_ratio())
        f, g, a, b = sympy.Tuple(self.f, self.g, self.a, self.b).xreplace(swap)
        return self._again(f, g, a, b)

    def evaluate(
        self, lam: Numbers, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum of the terms at `lam`, greater than 0: a number, or an array of them.

        Parameters
        ----------
        lam : number or array_like
        dps : int, optional
            Digits of the sum, as mpf. None: float64.
        log : bool
            Natural logarithm, finite where the value overflows.
        full : bool
            An `Estimate`, with the error.
        """
        if self.parameters:
            names = ", ".join(map(str, self.parameters))
            raise InputError(f"parameters have no value: {names}; call bind(…) first.")
        log, full = inputs.flag("log", log), inputs.flag("full", full)
        dps = inputs.digits(dps)
        request = Request("the integral", self.method, None, dps, log, full)
        if not inputs.is_array(lam):
            return self._one(exact("lam", lam), request)
        if dps is not None:
            raise InputError(f"lam is an array and dps is {dps}; arrays are for float64.")
        given = inputs.floats("lam", lam)
        each = [self._one(Fraction(y), request) for y in given.ravel()]
        if not full:
            return np.reshape(each, given.shape)
        value, error = (np.reshape(y, given.shape) for y in zip(*each, strict=True))
        kind = max(y.error_kind for y in each)  # an estimate, if one of them is
        return replace(each[0], value=value, error=error, error_kind=kind)

    def _one(self, lam: Fraction, request: Request) -> Any:
        """At one lam, from the sum and its error over e^level."""
        level, total, error, *said = self._at(
            inputs.positive("lam", lam), request.dps, request.full
        )
        if not (total.is_finite() and error.is_finite()):
            raise AccuracyError(
                f"the integral of f = {self.f} at lam = {inputs.float_text(lam)} could not be "
                "enclosed, because of a singularity, a slow decay or more than two saddles close "
                "together; split it there, or leave full out for the sum alone."
            )
        with precision(7 * request.digits + 300 + lam.numerator.bit_length()):
            if request.log and not total > error:
                raise AccuracyError(
                    f"the sum at lam = {inputs.float_text(lam)} is not surely positive, so its "
                    "logarithm is not known; ask for the value, or for a larger lam."
                )
            if request.log:
                value, error = level + total.log(), -(-error / total).log1p()
            else:
                value, error = level.exp() * total, level.exp() * error
            return in_digits(request, Answer(value + arb(0, error.upper()), *said))


def read(f: Any, g: Any, x: Any, a: Any, b: Any) -> tuple[Any, ...]:
    """(f, g, x, a, b) as expressions, checked: what they are made of and how large they are."""
    symbol = Symbol(x) if inputs.is_name(x) else x
    names = {str(symbol): symbol}
    row = (("f", f), ("g", g), ("a", a), ("b", b))
    f, g, a, b = (parse(name, e, names) for name, e in row)
    if not isinstance(symbol, Symbol) or not f.has(symbol) or a.has(symbol) or b.has(symbol):
        raise InputError(
            f"x is {inputs.shown(x)}, f = {f}, a = {a} and b = {b}; give a SymPy symbol on which f "
            "depends, and ends that do not."
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
    return f, g, symbol, a, b


# -- in balls ----------------------------------------------------------------------------------

# Shells towards an end, and halvings of each.
_SHELLS, _DEPTH, _NOTHING = 997, 6, arb(2) ** -(10**9)


def code(e: Expr, x: Symbol) -> Any:
    """The expression as a function of balls, nan across branch cuts and at poles."""
    return profile(interned(e, x), {})


def number(e: Any) -> Any:
    """A constant as a ball, nan where it isn't real."""
    if isinstance(e, Zero):
        return e.ball()
    if e in (S.Infinity, S.NegativeInfinity):
        return arb.pos_inf() if e > 0 else arb.neg_inf()
    try:
        return arb(code(e, Symbol("x"))(arb(0)))
    except InputError:  # as of a sampled value that is complex
        return arb.nan()


@dataclass(frozen=True)
class Zero:
    """Where an expression in x changes its sign between two numbers."""

    equation: Expr
    x: Symbol
    lo: Any
    hi: Any

    def ball(self) -> Any:
        """By bisection."""
        bits = ctx.prec
        with precision(2 * bits + 200):
            of, p, q = code(self.equation, self.x), self.lo, self.hi
            sign = of(p)
            for _ in range(bits + 100):
                m = ((p + q) / 2).mid()
                value = of(m)
                if value.contains(0):
                    return m
                p, q = (m, q) if value * sign > 0 else (p, m)
            return p.union(q)

    def __str__(self) -> str:
        return str(self.ball().str(12, radius=False))


def middle(lo: Any, hi: Any) -> Any:
    """A point inside an interval, of balls."""
    if lo.is_finite():
        return (lo + hi) / 2 if hi.is_finite() else lo + 1
    return hi - 1 if hi.is_finite() else arb(0)


def integral(
    f: Expr, g: Expr, x: Symbol, marks: list[Any], lam: Any, top: Any, bits: int
) -> tuple[Any, bool]:
    """int g e^(lam (f - top)) from the first mark to the last to about 2^-`bits`, in a ball that is
    not finite where it can't be enclosed; and True if nothing is assumed.

    Marks split the integral, so that f and g may be singular there; the ball holds with any.
    """
    height, slope, bend, weight = (code(e, x) for e in (f, f.diff(x), f.diff(x, 2), g))

    def integrand(z: Any) -> Any:
        value = height(z)
        # The ball is finite only where f is analytic; f'' may be simpler, and finite elsewhere.
        if value.is_finite() and not lam * value.rad() < 1:
            # Beside a maximum the ball of its Taylor polynomial is narrower.
            m = z.mid()
            near = height(m) + (z - m) * (slope(m) + (z - m) * bend(z) / 2)
            value = near if near.rad() < value.rad() else value
        return weight(z) * (lam * (value - top)).exp()

    total, tiny, proved = arb(0), arb(2) ** -bits, True
    for lo, hi in pairwise(marks):
        if lo < hi:
            inside = middle(lo, hi)
            (a, before), (b, after) = (cut(integrand, end, inside, tiny) for end in (lo, hi))
            found = acb.integral(lambda z, _: acb(integrand(z)), acb(a), acb(b), tiny, tiny)
            total += found.real + arb(0, before + after)
            proved = proved and before == after == 0
    return total, proved


def cut(integrand: Any, end: Any, inside: Any, tiny: Any) -> tuple[Any, Any]:
    """Where to end towards an end, and what bounds the integral beyond: 0 at a regular end."""
    far = not end.is_finite()
    if not far and integrand(acb(end) + box(0, tiny, tiny)).is_finite():
        return end, arb(0)
    # Near an end other than 0 points need their own digits.
    with precision(ctx.prec + (0 if far or end == 0 else _SHELLS)):
        reach = (arb(2) ** (k if far else -k) for k in range(_SHELLS))
        way = (1 if end > 0 else -1) if far else inside - end
        at = [(inside if far else end) + way * y for y in reach]
        shells: list[Any] = []
        for p, q in pairwise(at):
            shells.append(_bound(integrand, p, q, tiny / _SHELLS, _DEPTH))
            known = shells[-1] < _NOTHING or (shells[-1] < tiny * tiny and not far)
            if known and len(shells) > 1 and shells[-1] < shells[-2]:
                break
    # Beyond the last one they are taken to go on as they do.
    ratio = shells[-1] / shells[-2] if shells[-1] > _NOTHING else arb(0)
    last = shells[-1] * ratio / (1 - ratio) if ratio < 1 else arb.pos_inf()
    rests = list(accumulate(reversed(shells), initial=last))[::-1]
    found = zip(at, rests, strict=False)
    return next(((y, r) for y, r in found if r < tiny), (at[len(shells)], last))


def _bound(integrand: Any, p: Any, q: Any, small: Any, depth: int) -> Any:
    """An upper bound of the integral of |integrand| over [p, q], in parts where it varies."""
    whole = abs(integrand(p.union(q))) * abs(q - p)
    if depth and not (whole < small or whole < 64 * abs(q - p) * abs(integrand(p))):
        m = ((p + q) / 2).mid()
        return sum((_bound(integrand, *h, small, depth - 1) for h in ((p, m), (m, q))), arb(0))
    return whole.upper()
