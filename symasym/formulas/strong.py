"""Strong noise over SymPy: `symasym.expansions.strong_noise` with a symbol for each moment.

Moments are polynomials in the drift's parameters. Outside the layer all is closed form, of
(e^x - 1)/x and (e^x - 1 - x)/x^2, which stand as functions.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Poly, Rational, S, Symbol

from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.expansions.strong_noise import Moments, Stretch, layer, quantity, straight
from symasym.formulas.letters import LAM, R, U

__all__ = ["strong"]


class exprel(sympy.Function):  # type: ignore[misc]
    """(e^x - 1)/x."""

    at_zero, is_positive = S.One, True

    @classmethod
    def eval(cls, x: Expr) -> Expr | None:
        return cls.at_zero if x.is_zero else None


class exprel2(exprel):
    """(e^x - 1 - x)/x^2."""

    at_zero = S.Half


def written_out(e: Expr) -> Expr:
    """The expression without these functions."""
    e = e.replace(exprel2, lambda x: (sympy.exp(x) - 1 - x) / x**2)
    return e.replace(exprel, lambda x: (sympy.exp(x) - 1) / x)


class _Terms:
    """The functions of expressions at lam."""

    number = staticmethod(sympy.sympify)

    def exp(self, growth: Expr) -> Expr:
        """e^(lam growth)."""
        return sympy.exp(growth * LAM)

    def exprel(self, growth: Expr, n: int) -> Expr:
        """(e^y - 1)/y, or (e^y - 1 - y)/y^2 for n = 2, at y = lam growth."""
        return (exprel if n == 1 else exprel2)(growth * LAM)

    def total(self, row: list[Expr]) -> Expr:
        """The polynomial in lam, by Horner's rule."""
        value: Expr = S.Zero
        for c in reversed(row):
            value = value * LAM + c
        return value


class _Stretches:
    """The stretches of a polynomial drift, with a symbol for each moment that is no number."""

    def __init__(self, drift: Drift, order: int) -> None:
        A = drift.expression()
        poly = A.as_poly(U)
        if poly is None:
            raise InputError(
                f"A = {A} is no polynomial in u, so that the moments of V have no closed form; "
                "sa.escape_time(method='strong_noise') and its like take numbers."
            )
        self.A, self.order = poly.to_field(), order
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

    def layer(self, side: int, b: Any, mark: str) -> Stretch:
        """That from -1 to b, in the mirror for side -1: f_0 = 1 or u + 1, f_k = int A f_(k-1)."""
        A = self.A if side > 0 else -self.A.compose(Poly(-U, U))
        ends, areas = list[list[Expr]](), list[list[Expr]]()
        for f in (A * 0 + 1, Poly(U + 1, U)):
            ends.append([])
            areas.append([])
            for _ in range(max(self.order, 1) + 1):
                ends[-1].append(f.eval(b))
                areas[-1].append(_primitive(f).eval(b))
                f = _primitive(A * f)
        count, upper = self.order + 1, f"^{{{mark}}}" if mark else ""
        rows = [
            [self._named(f"{letter}{k}{mark}", f"{letter}_{{{k}}}{upper}", value)
             for k, value in enumerate(row[:count])]
            for letter, row in zip("nfm", (ends[1], *areas), strict=True)
        ]  # fmt: skip
        drop = self._named(f"d{mark}", f"d{upper}", ends[0][1])
        return layer(Moments(drop, *rows), _Terms())

    def side(self, side: int, start: Expr) -> list[Stretch]:
        """All of them from an end, r > 1, to the start."""
        x, (before, after) = side * start, (side * self.slopes[s] for s in (-side, side))
        row = [straight(before, R + min(x, -S.One), _Terms())]
        if x > -1:
            row.append(self.layer(side, min(x, S.One), "-" if side > 0 else "+"))
        if x > 1:
            row.append(straight(after, x - 1, _Terms()))
        return row


def _primitive(f: Poly) -> Poly:
    """The integral from -1."""
    step()
    whole = f.integrate(U)
    return whole - whole.eval(-1)


def strong(
    drift: Drift, name: str, order: int, start: Fraction
) -> tuple[Expr, dict[Symbol, Expr], dict[Symbol, str]]:
    """The formula in lam, r and the moments; what these are in the parameters; their LaTeX."""
    known, at = _Stretches(drift, order), Rational(start.numerator, start.denominator)
    if name[-1] == "P":
        sides = [[known.layer(1, S.One, "")]]
    else:
        sides = [known.side(side, at) for side in (1, -1)]
    formula = quantity(name, sides, (known.slopes[-1], known.slopes[1]), LAM)
    if name == "P":
        # Nothing cancels in what is left over of the whole.
        (whole,) = (a.base for a in formula.args if a.is_Pow and a.base.is_Add)
        formula = (whole - formula * whole) / whole
    return formula, known.values, known.tex
