"""T through the fold of a well and a barrier, of a cubic A: a formula in Airy functions of order 0.

With phi du = (s^2 - zeta) ds and u'(s) = p + q s at both (C. Chester, B. Friedman, F. Ursell, Proc.
Camb. Phil. Soc. 53 (1957) 599),

    T = pi^2 [p^2 lam^(1/3) (Ai^2 + Bi^2)(Z) - q^2 lam^(-1/3) (Ai'^2 + Bi'^2)(Z)] + R + (r - 1)/a+,

Z = lam^(2/3) zeta (DLMF 9.11.4 and its derivative), for a well behind the start and the barrier
behind it; R is the finite part of int du/phi from the start to 1, without the pair's own term.

All is explicit, and analytic through the fold: with A = (y^2 - D)(psi0 + psi1 y), y = u - m, real
zeros for D > 0, m = b + k T_(1/3)(w), where b +- k are the turning points, 2 c3 k^3 w = A(b) and
T_(1/3)(w) = cos(acos(w)/3), since 4 (m - b)^3 - 3 k^2 (m - b) = A(b)/(2 c3).
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Expr, Rational, S

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.formulas.cases import PAIRS, U
from symasym.formulas.letters import IN_KAPPA, LAM, R

M, D, K, W, ZETA, Z, N = sympy.symbols("m D k w zeta Z N", real=True)
PSI0, PSI1, P2, Q2, REST, SLOPE = sympy.symbols("psi0 psi1 p^2 q^2 R_0 phi(1)", real=True)
_THIRD = Rational(1, 3)
# Of lam V, that it falls at least from the barrier to the end, and from the start to the well.
_FALL = 4


def of_cubic(A: Expr, start: Expr) -> tuple[dict[Any, Expr], list[Any]]:
    """What the symbols are for a polynomial of degree 2 or 3, its first coefficient positive if
    not known to be negative, and where the formula holds."""
    c3, c2, c1, c0 = [S.Zero, S.Zero, *sympy.Poly(A, U).all_coeffs()][-4:]
    if c3 == 0:
        known = {M: -c1 / (2 * c2), D: M**2 - c0 / c2, PSI0: c2, PSI1: S.Zero}
    else:
        side, b = (-1 if c3.is_negative else 1), -c2 / (3 * c3)
        third = sympy.hyper([_THIRD, -_THIRD], [S.Half], (1 - side * W) / 2)
        known = {
            K: sympy.sqrt(sympy.factor(b**2 - c1 / (3 * c3))),
            W: sympy.cancel(A.subs(U, b) / c3) / (2 * K**3),
            M: b + side * K * third, D: 3 * (K**2 - (M - b) ** 2),
            PSI0: 3 * c3 * (M - b), PSI1: c3,
        }  # fmt: skip

    def from_middle(y: Expr) -> Expr:
        """V(m) - V(m + y)."""
        return PSI0 * (y**3 / 3 - D * y) + PSI1 * (y**4 / 4 - D * y**2 / 2)

    def over(y: Expr) -> Expr:
        """artanh(D^(1/2)/y)/D^(1/2), analytic through D = 0."""
        return sympy.hyper([S.Half, 1], [Rational(3, 2)], D / y**2) / y

    # 1/A = (psi0 - psi1 y)/(N^2 (y^2 - D)) + psi1/(N^2 (y + psi0/psi1)).
    y0, y1, log = start - M, 1 - M, sympy.log
    rest = (
        PSI0 * (over(y0) - over(y1)) - PSI1 * log(sympy.Abs((y1**2 - D) / (y0**2 - D))) / 2
        + PSI1 * log((PSI0 + PSI1 * y1) / (PSI0 + PSI1 * y0))
    ) / N**2  # fmt: skip
    known |= {
        N: sympy.sqrt(PSI0**2 - PSI1**2 * D), ZETA: PSI0 ** (2 * _THIRD) * D, REST: rest,
        P2: PSI0**_THIRD * (PSI0 + N) / (2 * N**2),
        Q2: PSI1**2 / (2 * N**2 * (PSI0 + N) * PSI0**_THIRD), SLOPE: A.subs(U, 1),
        Z: LAM ** (2 * _THIRD) * ZETA, **IN_KAPPA,
    }  # fmt: skip
    top = sympy.sqrt(sympy.Max(D, 0))
    falls = from_middle(y1) - from_middle(top), from_middle(-top) - from_middle(y0)
    return known, [sympy.Gt(R, 1), SLOPE > 0, PSI0 > 0, *(LAM * fall > _FALL for fall in falls)]


def uniform(drift: Drift, start: Fraction, asked: str | None) -> dict[str, Any]:
    """The formula of T, its case, what its symbols are, and where it holds."""
    A, x = drift.expression(), Rational(start.numerator, start.denominator)
    cubic = A.is_polynomial(U) and sympy.degree(A, U) in (2, 3)
    for own in [c for c in PAIRS if asked in (None, str(c)) and abs(start) < 1 and cubic]:
        side = -1 if own.before else 1
        known, where = of_cubic(sympy.expand(side * A.subs(U, side * U)), side * x)
        middle = M.xreplace(known).xreplace(known).xreplace(known).evalf()
        if drift.free or (middle.is_real and side * x < middle < 1):
            size = sympy.airyai(Z) ** 2 + sympy.airybi(Z) ** 2
            steep = sympy.airyaiprime(Z) ** 2 + sympy.airybiprime(Z) ** 2
            airy = sympy.pi**2 * (P2 * LAM**_THIRD * size - Q2 / LAM**_THIRD * steep)
            formula = airy + REST + (R - 1) / SLOPE
            return {"case": own, "formula": formula, "definitions": known, "conditions": where}
    raise InputError(
        f"{drift!r} from {float(start):.6g} has no uniform formula, which is of a cubic A with a "
        'well and a barrier behind the start; take numbers of method="uniform".'
    )
