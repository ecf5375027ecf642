"""The strong-noise expansion as a formula: powers of lam = 2/kappa^2 with the moments of V.

The sweep is that of `strong_noise.panel` and the moments are the iterated integrals of
`symasym.asymptotics.strong_noise.sweep`, both run over SymPy: polynomials in u whose coefficients
are polynomials in the drift's parameters. Outside the layer all is closed form, of (e^x - 1)/x and
(e^x - 1 - x)/x^2, which stand as functions (`symasym.emit.forms.exprel`).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Poly, Rational, S, Symbol

from symasym.asymptotics.strong_noise.panel import Record, Swept, carried, escape_time, first
from symasym.asymptotics.strong_noise.sweep import (
    Moments,
    layer_record,
    moments_of,
    odds_outside,
    odds_right,
)
from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit.forms import exprel, exprel2
from symasym.emit.symbolic_sums import BEYOND_1, LAM
from symasym.expansions.builder import U

__all__ = ["strong"]


class _Polynomials:
    """Polynomials in u on [a, b] (`sweep.Primitives`)."""

    def __init__(self, A: Poly, a: Expr, b: Expr) -> None:
        self.A, self.a, self.b = A, a, b
        # The function 1, and du/du.
        self.one: Any = A * 0 + 1
        self.rate: Any = self.one

    def primitive(self, f: Any) -> tuple[Any, Any]:
        """The integral of f from a, as a function; its value at b."""
        step()
        whole = f.integrate(U)
        whole = whole - whole.eval(self.a)
        return whole, whole.eval(self.b)

    def area(self, f: Any) -> Any:
        """The integral of f over [a, b]."""
        return self.primitive(f)[1]

    def times_slope(self, f: Any) -> Any:
        """A f."""
        return self.A * f


class _Terms:
    """The terms that are kept (`sweep.Arithmetic`)."""

    def tail(self, x: Expr, count: int) -> Expr:
        """Nothing: what is left out is not in the formula."""
        return S.Zero

    def exponential(self, x: Expr) -> Expr:
        """e^x."""
        return sympy.exp(x)

    def truncated(self, terms: list[Any], tail: Expr, size: Expr, x: Expr) -> Any:
        """The sum of all terms but the last."""
        return sum(terms[:-1], S.Zero)


class _Formula:
    """The stretches of one drift with a symbol for each moment (`sweep.Layered`)."""

    lam: Any = LAM

    def __init__(self, drift: Drift, order: int) -> None:
        self.order = order
        expression = drift.expression()
        poly = expression.as_poly(U)
        if poly is None:
            raise InputError(
                f"A = {expression} is no polynomial in u, so that the moments of V have no closed "
                "form; sa.escape_time(method='strong_noise') and its like take numbers."
            )
        self.A = poly.to_field()
        self.values: dict[Symbol, Expr] = {}
        self.tex: dict[Symbol, str] = {}
        self.slopes = {side: self._named(f"phi({side})", "a^+" if side > 0 else "a^-",
                                         expression.subs(U, side)) for side in (-1, 1)}  # fmt: skip

    def _named(self, name: str, tex: str, value: Expr) -> Symbol:
        symbol = Symbol(name, real=True)
        self.values[symbol], self.tex[symbol] = sympy.sympify(value), tex
        return symbol

    def slope(self, mirrored: bool) -> Expr:
        """phi left of the layer."""
        return -self.slopes[1] if mirrored else self.slopes[-1]

    def layer(self, mirrored: bool, a: Expr, b: Expr, mark: str = "") -> Record:
        """The stretch [a, b] of the layer, expanded."""
        A = -self.A.compose(Poly(-U, U)) if mirrored else self.A
        drop, *lists = moments_of(_Polynomials(A, a, b), self.order + 1, S.One)
        upper = f"^{{{mark}}}" if mark else ""
        rows = [
            [self._named(f"{letter}{k}{mark}", f"{letter}_{{{k}}}{upper}", value)
             for k, value in enumerate(values)]
            for letter, values in zip("nfm", lists, strict=True)
        ]  # fmt: skip
        fall = self._named(f"d{mark}", f"d{upper}", drop)
        known = Moments(b - a, fall, rows[0], rows[1], rows[2], S.Zero)
        return layer_record(known, LAM, self.order, _Terms())

    def straight(self, mirrored: bool, side: int, length: Expr) -> Record:
        """A stretch of that length left (side -1) or right (1) of the layer."""
        phi = self.slope(mirrored) if side < 0 else -self.slope(not mirrored)
        x = phi * LAM * length
        once, twice = length * exprel(x), length**2 * exprel2(x)
        return Record(once, once, twice, S.One, sympy.exp(x))

    def side(self, mirrored: bool, start: Expr, mark: str) -> Swept:
        """sigma and w at the start, absorbed at -r, r > 1 and before the start."""
        before = BEYOND_1 + min(start + 1, S.Zero)
        swept = first(self.straight(mirrored, -1, before), LAM)
        if start > -1:
            layer = self.layer(mirrored, -S.One, min(start, S.One), mark)
            swept = carried(swept, layer, LAM)
        if start > 1:
            swept = carried(swept, self.straight(mirrored, 1, start - 1), LAM)
        return swept


def strong(
    drift: Drift, quantity: str, order: int, start: Fraction
) -> tuple[Expr, dict[Symbol, Expr], dict[Symbol, str]]:
    """The formula in lam, r and the moments; what these are in the parameters; their LaTeX."""
    made = _Formula(drift, order)
    at = Rational(start.numerator, start.denominator)
    if quantity in ("P", "1 - P"):
        formula = 1 / (1 + odds_outside(made, quantity != "P", S.One))
    else:
        left, right = made.side(False, at, "-"), made.side(True, -at, "+")
        if quantity == "T":
            formula = escape_time(left, right)
        else:
            formula = 1 / (1 + odds_right(left, right, quantity != "C"))
    return formula, made.values, made.tex
