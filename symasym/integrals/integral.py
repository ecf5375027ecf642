"""What the expansions of int g e^(lam f) share: the integral as read, and how a value is given."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any

import numpy as np
import sympy
from flint import arb
from sympy import Expr, Symbol

from symasym.base import inputs
from symasym.base.balls import precision, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import Number, Numbers, exact
from symasym.drift.expressions import parse

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

    @cached_property
    def parameters(self) -> tuple[Symbol, ...]:
        """Free symbols besides x."""
        free = sympy.Tuple(self.f, self.g, self.a, self.b).free_symbols - {self.x}
        return tuple(sorted(free, key=str))

    def _again(self, f: Any, g: Any, a: Any, b: Any) -> Any:
        """The expansion of another integral."""
        raise NotImplementedError

    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """level, sum and error over e^level, the error's kind and the method, ..., at one lam."""
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
        if not inputs.is_array(lam):
            found = self._estimate(exact("lam", lam), dps, log, full)
            return found if full else found.value
        if dps is not None:
            raise InputError(f"lam is an array and dps is {dps}; arrays are for float64.")
        given = inputs.floats("lam", lam)
        each = [self._estimate(Fraction(y), None, log, full) for y in given.ravel()]
        value, error = (np.reshape(y, given.shape) for y in zip(*each, strict=True))
        proved = all(y.error_kind == "bound" for y in each)
        kind: ErrorKind = "bound" if proved else "estimate"
        return Estimate(value, error, kind, each[0].method) if full else value

    def _estimate(self, lam: Fraction, dps: int | None, log: bool, full: bool) -> Estimate:
        """At one lam, from the sum and its error over e^level."""
        wanted = dps or 17
        level, total, error, notes = self._at(inputs.positive("lam", lam), dps, full)
        if not (total.is_finite() and error.is_finite()):
            raise AccuracyError(
                f"the integral of f = {self.f} at lam = {inputs.float_text(lam)} could not be "
                "enclosed, because of a singularity, a slow decay or more than two saddles close "
                "together; split it there, or leave full out for the sum alone."
            )
        with precision(7 * wanted + 300 + lam.numerator.bit_length()):
            size = float((level + abs(total).log()).mid()) if total != 0 else 0.0
            if dps is None and not log and not -708.39 < size < 709.78:
                raise RangeError(
                    f"the integral's logarithm is {size:.6g}, beyond float64; pass log=True or "
                    "dps=…."
                )
            if log and not total > error:
                raise AccuracyError(
                    f"the sum at lam = {inputs.float_text(lam)} is not surely positive, so its "
                    "logarithm is not known; ask for the value, or for a larger lam."
                )
            if log:
                value, error = level + total.log(), -(-error / total).log1p()
            else:
                value, error = level.exp() * total, level.exp() * error
            middle, radius = to_mpf(value, wanted)
            error += arb(radius) + (abs(value) * arb(2) ** -52 if dps is None else 0)
            # The last rounding is within the factor.
            whole = to_mpf((error * (1 + arb(2) ** -30)).upper(), 15)[0]
        if dps is None:
            return Estimate(float(middle), float(whole), *notes)
        return Estimate(middle, whole, *notes)


def read(
    f: Any, g: Any, x: Any, a: Any, b: Any, functions: Any, pairs: bool = False
) -> tuple[Any, ...]:
    """(f, g, x, a, b) as expressions, checked: what they are made of and how large they are."""
    symbol = Symbol(x) if inputs.is_name(x) else x
    if not isinstance(symbol, Symbol):
        given = inputs.shown(x)
        raise InputError(f"x is {given}; give the variable of integration, a SymPy symbol.")
    names = {symbol.name: symbol}
    several = pairs and isinstance(g, (tuple, list, sympy.Tuple))
    weights = tuple(parse("g", w, names) for w in (g if several else (g,)))
    f, a, b = (parse(name, e, names) for name, e in (("f", f), ("a", a), ("b", b)))
    if not f.has(symbol) or a.has(symbol) or b.has(symbol):
        raise InputError(
            f"f = {f} does not contain {symbol}, or a = {a} or b = {b} does; give an f that "
            "depends on it, and ends that do not."
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
