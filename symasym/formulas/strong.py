"""Strong noise over SymPy: `symasym.expansions.strong_noise` with a symbol for each moment.

Moments are polynomials in the drift's parameters. Outside the layer all is closed form, of
(e^x - 1)/x and (e^x - 1 - x)/x^2, which stand as functions.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Poly, S

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.expansions.strong_noise import Moments, Stretch, layer, quantity, straight, swept
from symasym.formulas.cases import Case, U
from symasym.formulas.letters import IN_KAPPA, LAM, Field, R
from symasym.formulas.weak import ends


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


class _Ring:
    """Expressions at lam."""

    number = staticmethod(sympy.sympify)
    exp = staticmethod(lambda growth: sympy.exp(growth * LAM))
    exprel = staticmethod(lambda growth, n: (exprel, exprel2)[n - 1](growth * LAM))
    total = staticmethod(lambda row: sympy.Add(*(c * LAM**k for k, c in enumerate(row))))


def _layer(of: Field, order: int, side: int, b: Any, mark: str) -> Stretch:
    """The layer from -1 to b, in the mirror for side -1: f_0 = 1 or u + 1, f_k = int A f_(k-1)."""

    def primitive(f: Any) -> Any:
        whole = f.integrate(U)
        return whole - whole.eval(-1)

    A, rows = Poly(side * of.A.subs(U, side * U), U).to_field(), []
    for f in (A * 0 + 1, Poly(U + 1, U)):
        row = [f]
        for _ in range(max(order, 1)):
            row.append(primitive(A * row[-1]))
        rows += [[S(f.eval(b)) for f in row], [S(primitive(f).eval(b)) for f in row]]
    known = (
        [of.named(f"{letter}{k}{mark}", c) for k, c in enumerate(rows[n][: order + 1])]
        for n, letter in ((2, "n"), (1, "f"), (3, "m"))
    )
    return layer(Moments(of.named(f"d{mark}", rows[0][1]), *known), _Ring())


def strong(drift: Drift, name: str, order: int, start: Fraction) -> dict[str, Any]:
    """The formula in lam, r and the moments, what these are, and where it holds."""
    case, ring, sides = Case(("start",)), _Ring(), list[list[Stretch]]()
    of = Field(drift, case, start)
    if of.poly is None:
        raise InputError(
            f"A = {of.A} is no polynomial in u, so that the moments of V have no closed form; "
            "sa.escape_time(method='strong_noise') and its like take numbers."
        )
    for side, letter, mark in ((1, "L", "-"), (-1, "R", "+")) if name[-1] != "P" else ():
        x, row = side * of.start, [straight(side * of.slopes[-side], R - 1, ring)]
        row += [_layer(of, order, side, x, mark)] if x > -1 else []
        # What is swept of a side stands as one stretch.
        sigma, w = swept(row)
        sides.append([Stretch(of.named(letter, sigma), S.Zero, of.named(f"w{mark}", w), S.One)])
    slopes = of.slopes[-1], of.slopes[1]
    formula = quantity(name, sides or [[_layer(of, order, 1, S.One, "")]], slopes, LAM)
    known = {**of.values, **IN_KAPPA}
    return {"case": case, "formula": formula, "definitions": known, "conditions": ends(of, name)}
