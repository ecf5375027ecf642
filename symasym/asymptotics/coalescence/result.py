"""The result of a uniform expansion: its parts added up at any lam, with an error.

Each part brings its terms in powers of 1/lam with a size that has no zeros by chance (the modulus
functions of DLMF 9.8 in place of Ai); the truncation error is estimated from the next terms.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy

from symasym.asymptotics.coalescence.endpoints import BEYOND
from symasym.asymptotics.laplace.result import IntegralParts
from symasym.base.contexts import mpf_of, own_context
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import Estimate
from symasym.base.inputs import digits, exact, float_text, floats, is_array

_FLOAT_DIGITS = 20
_NAMES = {
    "airy": "Ai, Ai'",
    "erfc": "erfc, ends",
    "products": "Ai² + Bi² and its kin, ends, u near v",
}


@dataclass(frozen=True, repr=False)
class UniformExpansion(IntegralParts):
    """An expansion of the integral of g(x) e^(lam f(x)) that holds as critical points coalesce.

    Or, with g a pair (g, h), of the iterated integral of g(u) h(v) e^(lam (f(v) - f(u))), u < v.

    Attributes
    ----------
    f, g, x, a, b : Expr
        The integral.
    order : int
        Terms kept.
    kind : {"airy", "erfc", "products"}
        Two coalescing saddles, saddles near ends and kinks, or an iterated integral with products
        of Airy functions.
    conditions : tuple of str
        What is taken for granted.
    """

    f: Any
    g: Any
    x: Any
    a: Any
    b: Any
    order: int
    kind: str
    conditions: tuple[str, ...]
    _factor: Any = field(compare=False)
    _parts: tuple[Any, ...] = field(compare=False)
    _again: Callable[..., UniformExpansion] = field(compare=False)

    @property
    def error_kind(self) -> str:
        """``"estimate"``, or ``"none"`` while parameters are free."""
        return "none" if self.parameters else "estimate"

    def bind(self, **values: Any) -> UniformExpansion:
        """The expansion with numbers for parameters.

        Raises
        ------
        InputError
            For a name that is not a parameter.
        """
        return self._again(*self._with_numbers(values), self.order)

    def coefficients(self, dps: int = 15) -> tuple[Any, list[tuple[Any, ...]]]:
        """zeta and the pairs (a_n, b_n) that stand with Ai and Ai' in the terms lam^(-n).

        They are of G_n, G_0 = g x'(s), before the powers of i (f imaginary) or -1 (f real). Of an
        iterated integral: four numbers for each n, which stand with Ai² + Bi², Ai Ai' + Bi Bi' and
        Ai'² + Bi'², times lam^(-n) and lam^(-2/3), lam^(-1) and lam^(-4/3), and with lam^(-n-1).
        What finite ends add is not among them, nor is the weights' constant factor.

        Raises
        ------
        InputError
            Unless two saddles coalesce.
        """
        if self.kind == "erfc":
            raise InputError(
                "kind is 'erfc', which has no zeta; coefficients() is for two saddles."
            )
        self._require_bound()
        from symasym.base.contexts import to_mpf

        with own_context(digits(dps) + 10) as context:
            if self.kind == "products":
                zeta, rows = self._parts[0].coefficients(self.order, context)
            else:
                zeta, _, _, a, b = self._parts[0].coefficients(self.order, context)
                rows = list(zip(a, b, strict=True))
            return to_mpf(zeta, dps), [tuple(to_mpf(y, dps) for y in row) for row in rows]

    def expression(self, lam: Any = "lam", *, saddles: Any = None) -> Any:
        """The first terms, at most three, as a SymPy expression in airyai or erfc.

        Parameters
        ----------
        lam : Symbol or str
        saddles : sequence of Expr, optional
            The zeros of f' that coalesce with each other or an end, where SymPy doesn't find them.

        Returns
        -------
        Expr
            0/0 where the points coalesce: numbers near that come from `bind` and `evaluate`.

        Raises
        ------
        InputError
            For more than three terms, kinks, or saddles that are not known or not real for all
            parameters.
        """
        from symasym.asymptotics.coalescence.formulas import MOST_TERMS, end_formula, pair_formula
        from symasym.asymptotics.coalescence.iterated_formulas import iterated_formula

        if self.order > MOST_TERMS:
            raise InputError(
                f"order is {self.order}; formulas are given to {MOST_TERMS} terms, beyond which "
                "they fill pages."
            )
        symbol = sympy.Symbol(lam, positive=True) if isinstance(lam, str) else lam
        if self.kind == "products":
            g, h = (part.as_independent(self.x, as_Add=False)[1] for part in self.g)
            ends = self.a, self.b
            found = iterated_formula(self.f, g, h, self.x, *ends, self.order, symbol, saddles)
            return self._factor * found
        weight = self.g.as_independent(self.x, as_Add=False)[1]
        if self.kind == "erfc":
            parts = (self.f, weight, self.x, self.a, self.b)
            return self._factor * end_formula(*parts, self.order, symbol, saddles)
        oscillating = self.f.has(sympy.I)
        f = sympy.expand(self.f / sympy.I) if oscillating else self.f
        found = pair_formula(f, weight, self.x, self.order, symbol, saddles, oscillating)
        return self._factor * found

    def evaluate(
        self, lam: Any, *, dps: int | None = None, log: bool = False, full: bool = False
    ) -> Any:
        """The sum of the terms at `lam`.

        Parameters
        ----------
        lam : number or array_like
            Greater than 0.
        dps : int, optional
            Digits of the sum, as mpf or mpc. None: float64 or complex128.
        log : bool
            Natural logarithm of a real value, finite where the value overflows.
        full : bool
            An `Estimate`: its error is that of the sum as a value of the integral.

        Returns
        -------
        float, complex, ndarray, mpf, mpc or Estimate
            Complex where f is imaginary, or g's constant factor leaves it so.

        Raises
        ------
        InputError
            While parameters are free, or lam is not above 0.
        RangeError
            If the value does not fit float64 and `log` is False.
        AccuracyError
            For the logarithm of a sum that is complex, or not surely positive; if the saddles are
            too far apart for one expansion.
        """
        self._require_bound()
        if dps is not None and is_array(lam):
            raise InputError(
                f"lam is an array and dps is {dps}; arrays are for float64 (dps=None)."
            )
        if dps is not None:
            return self._by_digits(lam, digits(dps), log, full)
        if not is_array(lam):
            return self._by_float(lam, log, full)
        values = floats("lam", lam)
        found = [self._by_float(float(y), log, full) for y in values.ravel()]
        if not full:
            return np.array(found).reshape(values.shape)
        value, error = (
            np.array([getattr(e, name) for e in found]).reshape(values.shape)
            for name in ("value", "error")
        )
        return Estimate(value, error, "estimate", "uniform", self.order, found[0].terms)

    def _by_float(self, lam: Any, log: bool, full: bool) -> Any:
        found = self._by_digits(lam, _FLOAT_DIGITS, log, True)
        kind = complex if hasattr(found.value, "_mpc_") else float
        with own_context(15) as context:
            size = abs(context.convert(found.value))
            logarithm = context.log(size) if size else context.mpf(0)
            if not log and not -708.39 < logarithm < 709.78:
                raise RangeError(
                    f"the integral's logarithm is {float(logarithm):.6g}, beyond float64; "
                    "pass log=True or dps=…."
                )
        rounded = kind(found.value)
        if not full:
            return rounded
        with own_context(2 * _FLOAT_DIGITS) as context:
            shift = abs(context.convert(rounded) - context.convert(found.value))
            error = float((shift + context.convert(found.error)) * (1 + context.mpf(2) ** -40))
        return Estimate(rounded, error, "estimate", "uniform", self.order, found.terms)

    def _by_digits(self, lam: Any, dps: int, log: bool, full: bool) -> Any:
        import mpmath

        rational = exact("lam", lam)
        if rational <= 0:
            raise InputError(f"lam is {float_text(rational)}; it must be greater than 0.")
        with own_context(dps + 10) as context:
            size = context.log10(mpf_of(rational, context))
            context.dps += max(0, int(size))
            large = mpf_of(rational, context)
            total, error = self._sum(large, context)
            # What the sum and its coefficients are rounded to.
            error += abs(total) * context.mpf(10) ** -(dps + 5)
            if log:
                if not hasattr(total, "_mpf_") or total <= error:
                    raise AccuracyError(
                        f"the sum at lam = {float_text(rational)} is complex or not surely "
                        "positive, so its logarithm is not known; ask for the value."
                    )
                total, error = context.log(total), -context.log1p(-error / total)
                error += abs(total) * context.mpf(10) ** -(dps + 5)
            value = _rounded(mpmath.mp, total, dps)
            error += abs(total - context.convert(value))
            error = _rounded(mpmath.mp, error * (1 + context.mpf(10) ** -10), 15)
        if not full:
            return value
        names = (_NAMES[self.kind],)
        return Estimate(value, error, "estimate", "uniform", self.order, names)

    def _sum(self, lam: Any, context: Any) -> tuple[Any, Any]:
        """The sum, and an error from the next terms.

        Twice the largest; and eight times the last, which counts where terms fall slowly and their
        sum is many times the first.
        """
        count = self.order + BEYOND
        total, beyond = context.mpf(0), [context.mpf(0)] * BEYOND
        for part in self._parts:
            terms = part.terms(lam, count, context)
            total += context.fsum(value for value, _ in terms[: self.order])
            for k, (_, size) in enumerate(terms[self.order :]):
                beyond[k] += size
        re, im = (context.make_mpf(y._mpf_) for y in _parts_of(self._factor, context))
        factor = context.mpc(re, im) if im else re
        return factor * total, abs(factor) * (2 * max(beyond) + 8 * beyond[-1])

    def __str__(self) -> str:
        what = f"the integral of ({self.g}) e^(lam ({self.f}))"
        if self.kind == "products":
            g, h = self.g
            what = f"the iterated integral of ({g}) and ({h}) with f = {self.f}"
        return (
            f"uniform expansion ({self.kind}, {self.order} terms) of {what} over {self.x} from "
            f"{self.a} to {self.b}; error: {self.error_kind}"
        )

    def __repr__(self) -> str:
        return f"UniformExpansion({self})"


def _parts_of(value: Any, context: Any) -> tuple[Any, Any]:
    from symasym.asymptotics.laplace.kinks import number

    return tuple(number(part, dps=context.dps) for part in sympy.sympify(value).as_real_imag())


def _rounded(target: Any, value: Any, dps: int) -> Any:
    """`value` as the caller's mpf or mpc, rounded."""
    from symasym.base.contexts import to_mpf

    if hasattr(value, "_mpc_"):
        return target.make_mpc(tuple(to_mpf(y, dps)._mpf_ for y in (value.real, value.imag)))
    return to_mpf(value, dps)
