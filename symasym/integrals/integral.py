"""What the expansions of int g e^(lam f) share: the integral as read, and how a value is given."""

from __future__ import annotations

from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.base import inputs
from symasym.base.balls import precision, to_mpf
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import Number, Numbers, exact
from symasym.drift.expressions import parse
from symasym.drift.scenes import Answer, Request
from symasym.methods import as_digits

# What is worked out within seconds.
_OPERATIONS, _CALLS = 250, 12


@dataclass(frozen=True, repr=False)
class IntegralExpansion:
    """An expansion of the integral of g(x) e^(lam f(x)) over [a, b]."""

    f: Expr
    g: Any
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

    def _again(self, f: Any, g: Any, a: Any, b: Any) -> Any:
        """The expansion of another integral."""
        raise NotImplementedError

    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """level, sum and error over e^level, and what else an `Answer` has, at one lam."""
        raise NotImplementedError

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
        dps = None if dps is None else inputs.digits(dps)
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
            middle, radius = to_mpf(value, request.digits)
            # The last rounding is within the factor.
            whole = ((error + arb(radius)) * (1 + arb(2) ** -30)).upper()
            return as_digits(request, Answer(middle, to_mpf(whole, 15)[0], *said))


def read(
    f: Any, g: Any, x: Any, a: Any, b: Any, functions: Any, pairs: bool = False
) -> tuple[Any, ...]:
    """(f, g, x, a, b) as expressions, checked: what they are made of and how large they are."""
    symbol = Symbol(x) if inputs.is_name(x) else x
    names = {str(symbol): symbol}
    several = pairs and isinstance(g, (tuple, list, sympy.Tuple))
    weights = tuple(parse("g", w, names) for w in (g if several else (g,)))
    f, a, b = (parse(name, e, names) for name, e in (("f", f), ("a", a), ("b", b)))
    if not isinstance(symbol, Symbol) or not f.has(symbol) or a.has(symbol) or b.has(symbol):
        raise InputError(
            f"x is {inputs.shown(x)}, f = {f}, a = {a} and b = {b}; give a SymPy symbol on which f "
            "depends, and ends that do not."
        )
    for e in (f, *weights):
        calls = [type(n).__name__ for n in e.atoms(sympy.Function)]
        odd = {*calls} - {*functions} or e.atoms(sympy.oo, -sympy.oo, sympy.zoo, sympy.nan)
        if odd or len(calls) > _CALLS or sympy.count_ops(e) > _OPERATIONS:
            raise InputError(
                f"f or g has {sympy.count_ops(e)} operations, {len(calls)} functions and "
                f"{', '.join(map(str, odd)) or 'none'} that can't be expanded; give at most "
                f"{_OPERATIONS} and {_CALLS}, of {', '.join(functions)}, powers and numbers."
            )
    return f, weights if several else weights[0], symbol, a, b
