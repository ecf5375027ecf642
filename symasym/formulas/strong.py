"""Strong noise over SymPy: `symasym.expansions.strong` with a symbol for each moment.

Moments are polynomials in the drift's parameters. Outside the layer all is closed form, of
(e^x - 1)/x and (e^x - 1 - x)/x^2, which stand as functions (`symasym.emit.forms.exprel`).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Poly, Rational, S, Symbol

from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.emit import forms
from symasym.expansions.strong import (
    Moments,
    escape_time,
    exit_probability,
    layer,
    moments,
    outside_odds,
    stretches,
)
from symasym.formulas.letters import LAM, R, U

__all__ = ["strong"]


class Polynomials:
    """Functions of expressions, and polynomials in u whose coefficients are some."""

    number, exp = staticmethod(sympy.sympify), staticmethod(sympy.exp)
    exprel, exprel2 = forms.exprel, forms.exprel2

    @staticmethod
    def polynomial(c: list[Any]) -> Poly:
        """Of ascending coefficients."""
        return Poly(c[::-1], U)

    @staticmethod
    def primitive(f: Poly, a: Any) -> Poly:
        """The integral from a."""
        step()
        whole = f.integrate(U)
        return whole - whole.eval(a)

    @classmethod
    def area(cls, f: Poly, a: Any, b: Any) -> Expr:
        """The integral from a to b."""
        return cls.primitive(f, a).eval(b)


class _Drift:
    """A polynomial drift with a symbol for each moment; what is 0 has none."""

    def __init__(self, drift: Drift) -> None:
        A = drift.expression()
        poly = A.as_poly(U)
        if poly is None:
            raise InputError(
                f"A = {A} is no polynomial in u, so that the moments of V have no closed form; "
                "sa.escape_time(method='strong_noise') and its like take numbers."
            )
        self.A = poly.to_field()
        self.values: dict[Symbol, Expr] = {}
        self.tex: dict[Symbol, str] = {LAM: r"\lambda"}
        self.slopes = {
            side: self._named(f"phi({side})", "a^+" if side > 0 else "a^-", A.subs(U, side))
            for side in (-1, 1)
        }

    def _named(self, name: str, tex: str, value: Any) -> Expr:
        value = sympy.sympify(value)
        if value.is_Rational or value.is_Symbol or (-value).is_Symbol:
            return value
        symbol = Symbol(name, real=True)
        self.values[symbol], self.tex[symbol] = value, tex
        return symbol

    def slope(self, mirrored: bool, side: int) -> Expr:
        """phi beyond the layer, in the mirror the other one with the other sign."""
        return -self.slopes[-side] if mirrored else self.slopes[side]

    def moments(self, mirrored: bool, a: Any, b: Any, order: int, mark: str = "") -> Moments:
        """As symbols."""
        mark = mark or ("+" if mirrored else "-")
        A = -self.A.compose(Poly(-U, U)) if mirrored else self.A
        found, upper = moments(A, Polynomials, a, b, order), f"^{{{mark}}}" if mark.strip() else ""
        mark = mark.strip()
        rows = [
            [self._named(f"{letter}{k}{mark}", f"{letter}_{{{k}}}{upper}", value)
             for k, value in enumerate(row)]
            for letter, row in zip("nfm", found[1:], strict=True)
        ]  # fmt: skip
        return Moments(self._named(f"d{mark}", f"d{upper}", found.drop), *rows)


def strong(
    drift: Drift, quantity: str, order: int, start: Fraction
) -> tuple[Expr, dict[Symbol, Expr], dict[Symbol, str]]:
    """The formula in lam, r and the moments; what these are in the parameters; their LaTeX."""
    known, at = _Drift(drift), Rational(start.numerator, start.denominator)
    if quantity in ("P", "1 - P"):
        inside = layer(known.moments(False, -S.One, S.One, order, " "), LAM, Polynomials)
        odds = sympy.factor_terms(outside_odds(known.slopes[-1], inside, known.slopes[1], LAM))
        formula = 1 / (1 + odds) if quantity == "P" else 1 / (1 + 1 / odds)
    else:
        left, right = stretches(known, order, LAM, Polynomials, R, at, True)
        formula = (
            escape_time(left, right, LAM)
            if quantity == "T"
            else exit_probability(left, right, quantity != "C")
        )
    return formula, known.values, known.tex
