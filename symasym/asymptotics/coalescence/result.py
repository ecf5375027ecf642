"""The result of a uniform expansion: its parts added up at any lam, with an error.

Each part brings its terms in powers of 1/lam with a size that has no zeros by chance (the modulus
functions of DLMF 9.8 in place of Ai); the truncation error is estimated from the next terms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import sympy

from symasym.asymptotics.coalescence.iterated import IteratedPart
from symasym.asymptotics.coalescence.parts import BEYOND, PairPart, SumPart
from symasym.asymptotics.coalescence.reading import over_i, require_smooth
from symasym.asymptotics.laplace.kinks import number
from symasym.asymptotics.laplace.result import IntegralExpansion
from symasym.base.call_context import mpf_of, own_context, symbolic, to_mpf
from symasym.base.errors import AccuracyError, InputError
from symasym.base.estimate import Estimate
from symasym.base.inputs import digits, float_text, sequence

if TYPE_CHECKING:
    from mpmath import mpc, mpf
    from mpmath.ctx_mp import MPContext
    from sympy import Expr, Symbol


_NAMES = {
    "airy": "Ai, Ai'",
    "erfc": "erfc, ends",
    "products": "Ai² + Bi² and its kin, ends, u near v",
}


@dataclass(frozen=True, repr=False)
class UniformExpansion(IntegralExpansion):
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

    order: int
    kind: str
    conditions: tuple[str, ...]
    _factor: Expr = field(compare=False)
    _parts: tuple[SumPart, ...] = field(compare=False)

    @property
    def _own_names(self) -> tuple[str, ...]:
        """lam in text and LaTeX, the number e, and Airy functions."""
        return "lam", "lambda", "e", *(("Ai", "Bi") if self.kind != "erfc" else ())

    @property
    def error_kind(self) -> str:
        """``"estimate"``, or ``"none"`` while parameters are free."""
        return "none" if self.parameters else "estimate"

    def coefficients(self, dps: int = 15) -> tuple[mpf, list[tuple[mpf, ...]]]:
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
        with own_context(digits(dps) + 10) as context:
            part = self._parts[0]
            if isinstance(part, IteratedPart):
                zeta, rows = part.coefficients(self.order, context)
            else:
                assert isinstance(part, PairPart)
                zeta, _, _, a, b = part.coefficients(self.order, context)
                rows = list(zip(a, b, strict=True))
            return to_mpf(zeta, dps), [tuple(to_mpf(y, dps) for y in row) for row in rows]

    @symbolic
    def expression_in(
        self, lam: Symbol | str = "lam", *, saddles: Sequence[Expr] | None = None
    ) -> Expr:
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
        from symasym.asymptotics.coalescence.formulas import (
            MOST_TERMS,
            end_formula,
            iterated_formula,
            pair_formula,
        )
        from symasym.drift.expressions import parse

        if self.order > MOST_TERMS:
            raise InputError(
                f"order is {self.order}; formulas are given to {MOST_TERMS} terms, beyond which "
                "they fill pages."
            )
        symbol = self._lam(lam)
        if saddles is not None:
            names = {s.name: s for s in self.f.free_symbols}
            saddles = [parse("saddles", p, names) for p in sequence("saddles", saddles)]
        if self.kind == "products":
            g, h = (part.as_independent(self.x, as_Add=False)[1] for part in self.g)
            ends = self.a, self.b
            formula = iterated_formula(self.f, g, h, self.x, *ends, self.order, symbol, saddles)
            return self._factor * formula
        weight = self.g.as_independent(self.x, as_Add=False)[1]
        if self.kind == "erfc":
            require_smooth(self.x, {"f": self.f, "g": weight})
            parts = (self.f, weight, self.x, self.a, self.b)
            return self._factor * end_formula(*parts, self.order, symbol, saddles)
        oscillating = self.f.has(sympy.I)
        f = over_i(self.f) if oscillating else self.f
        formula = pair_formula(f, weight, self.x, self.order, symbol, saddles, oscillating)
        return self._factor * formula

    @property
    def error(self) -> str:
        """The order of the terms left out, and what is claimed of them."""
        kind = "none claimed while parameters are free" if self.parameters else "estimate"
        return f"relative O(lam^(-{self.order})), also where the points coalesce; error: {kind}"

    def _by_digits(self, lam: Fraction, dps: int, log: bool, full: bool) -> Any:
        """The sum at one lam as an mpf or mpc, or an `Estimate` from the next terms."""
        with own_context(dps + 10) as context:
            size = context.log10(mpf_of(lam, context))
            # Digits that lam f has before its point, in any term of f.
            context.dps += max(0, int(size) + self._digits_of_f)
            large = mpf_of(lam, context)
            total, error = self._sum(large, context)
            # What the sum and its coefficients are rounded to.
            error += abs(total) * context.mpf(10) ** -(dps + 5)
            if log:
                if not hasattr(total, "_mpf_") or total <= error:
                    raise AccuracyError(
                        f"the sum at lam = {float_text(lam)} is complex or not surely "
                        "positive, so its logarithm is not known; ask for the value."
                    )
                total, error = context.log(total), -context.log1p(-error / total)
                error += abs(total) * context.mpf(10) ** -(dps + 5)
            value = _rounded(total, dps)
            error += abs(total - context.convert(value))
            error = to_mpf(error * (1 + context.mpf(10) ** -10), 15)
        if not full:
            return value
        names = (_NAMES[self.kind],)
        return Estimate(value, error, "estimate", "uniform", self.order, names)

    @cached_property
    def _digits_of_f(self) -> int:
        """About the digits before the point of f and of what it is made of."""
        ends = [end for end in (self.a, self.b) if end.is_finite]
        made = [self.f, *(self.f.subs(self.x, end) for end in ends)]
        numbers = {part for whole in made for part in sympy.preorder_traversal(whole)}
        with own_context(15) as context:
            sizes = [
                abs(context.mpmathify(part.n(5)))
                for part in numbers
                if part.is_number and part.is_finite
            ]
            return 2 * max(0, int(context.log10(max([1, *sizes]))))

    def _sum(self, lam: mpf, context: MPContext) -> tuple[mpf | mpc, mpf]:
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
        parts = sympy.sympify(self._factor).as_real_imag()
        re, im = (context.make_mpf(number(y, dps=context.dps)._mpf_) for y in parts)
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


def _rounded(value: mpf | mpc, dps: int) -> Any:
    """`value` as the caller's mpf or mpc, rounded."""
    import mpmath

    if hasattr(value, "_mpc_"):
        return mpmath.mp.make_mpc(tuple(to_mpf(y, dps)._mpf_ for y in (value.real, value.imag)))
    return to_mpf(value, dps)
