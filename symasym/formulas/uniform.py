"""T through the fold of a well and a barrier, as a formula in Airy functions of order 0.

A well and the barrier behind it are the zeros of y^2 - D, y = u - m, in phi = A, real for D > 0,
past their fold complex. With phi du = (s^2 - zeta) ds and u'(s) = p + q s at both (C. Chester, B.
Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599),

    T = pi^2 [p^2 lam^(1/3) (Ai^2 + Bi^2)(Z) - q^2 lam^(-1/3) (Ai'^2 + Bi'^2)(Z)] + R + (r - 1)/a+,

Z = lam^(2/3) zeta (DLMF 9.11.4 and its derivative). R is the finite part of int du/phi from the
start to 1, without the pair's own pi/(-D)^(1/2). All of it is analytic in D, so that the formula
is one and the same on both sides of the fold. Of a cubic A = (y^2 - D)(psi0 + psi1 y) all is
explicit: m = b + k T_(1/3)(w) with the turning points b +- k, 2 c3 k^3 w = A(b) and T_(1/3)(w) =
cos(acos(w)/3), since 4 (m - b)^3 - 3 k^2 (m - b) = A(b)/(2 c3). The end u = 1 before which a
barrier stands adds E_1 (N. Bleistein, Comm. Pure Appl. Math. 19 (1966) 353). Of another bound A
the pair is found in numbers, and E_1 left out.
"""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from flint import arb, ctx, fmpq
from sympy import Expr, Rational, S

from symasym.base.errors import InputError
from symasym.base.inputs import float_text
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.expansions.canonical import Field, by_parts, central_map, panel
from symasym.formulas.cases import Case, read_case
from symasym.formulas.letters import KAPPA, LAM, R, U
from symasym.numbers.balls import exact_ball, precision, to_mpf

__all__ = ["NAMES", "uniform"]

M, D, K, W, ZETA, Z, N = sympy.symbols("m D k w zeta Z N", real=True)
PSI0, PSI1 = sympy.symbols("psi0 psi1", real=True)
P2, Q2, REST, SLOPE, BESIDE, EDGE = sympy.symbols("p^2 q^2 R_0 a_+ x_1 E_1", real=True)
#: LaTeX of the symbols.
NAMES = {
    LAM: r"\lambda", PSI0: r"\psi_0", PSI1: r"\psi_1", REST: "R_0", SLOPE: "a_+", P2: "p^2",
    Q2: "q^2", BESIDE: "x_1", EDGE: "E_1",
}  # fmt: skip
_DIGITS = 30
# Of lam V, that it falls at least from the barrier to the end, and from the start to the well.
_END, _START = 2, 4


def third(w: Expr) -> Expr:
    """T_(1/3)(w) = cos(acos(w)/3), analytic through w = 1."""
    return sympy.hyper([Rational(1, 3), -Rational(1, 3)], [Rational(1, 2)], (1 - w) / 2)


def inverse_tangent(x: Expr) -> Expr:
    """artanh(x^(1/2))/x^(1/2), analytic through x = 0."""
    return sympy.hyper([Rational(1, 2), 1], [Rational(3, 2)], x)


def formula() -> Expr:
    """T in the symbols."""
    ai, bi, ai1, bi1 = (
        f(Z) for f in (sympy.airyai, sympy.airybi, sympy.airyaiprime, sympy.airybiprime)
    )
    third_power = LAM ** Rational(1, 3)
    airy = P2 * third_power * (ai**2 + bi**2) - Q2 / third_power * (ai1**2 + bi1**2)
    return sympy.pi**2 * airy + REST + EDGE + (R - 1) / SLOPE


def of_cubic(A: Expr, start: Expr) -> dict[Any, Expr]:
    """What the symbols are for a polynomial of degree 2 or 3, its first coefficient positive if
    not known to be negative."""
    c3, c2, c1, c0 = [S.Zero, S.Zero, *sympy.Poly(A, U).all_coeffs()][-4:]
    if c3 == 0:
        known = {M: -c1 / (2 * c2), D: M**2 - c0 / c2, PSI0: c2, PSI1: S.Zero}
    else:
        side, b = (-1 if c3.is_negative else 1), -c2 / (3 * c3)
        known = {
            K: sympy.sqrt(sympy.factor(b**2 - c1 / (3 * c3))),
            W: sympy.factor(A.subs(U, b) / c3) / (2 * K**3),
            M: b + side * K * third(side * W),
            D: 3 * (K**2 - (M - b) ** 2),
            PSI0: 3 * c3 * (M - b),
            PSI1: c3,
        }
    # 1/A = (psi0 - psi1 y)/(N^2 (y^2 - D)) + psi1/(N^2 (y + psi0/psi1)).
    y0, y1, log = start - M, 1 - M, sympy.log
    rest = (
        PSI0 * (inverse_tangent(D / y0**2) / y0 - inverse_tangent(D / y1**2) / y1)
        - PSI1 * log(sympy.Abs((y1**2 - D) / (y0**2 - D))) / 2
        + PSI1 * log((PSI0 + PSI1 * y1) / (PSI0 + PSI1 * y0))
    ) / N**2
    return {
        **known,
        N: sympy.sqrt(PSI0**2 - PSI1**2 * D),
        ZETA: PSI0 ** Rational(2, 3) * D,
        P2: PSI0 ** Rational(1, 3) * (PSI0 + N) / (2 * N**2),
        Q2: PSI1**2 / (2 * N**2 * (PSI0 + N) * PSI0 ** Rational(1, 3)),
        REST: rest,
    }


def in_numbers(drift: Drift, mirrored: bool, start: Fraction) -> dict[Any, Expr] | None:
    """The same of any bound drift; None where it has no pair behind the start."""
    with precision(5 * _DIGITS):
        ctx.cap = 6 * _DIGITS
        field = Field(pieces(drift, fmpq(1))[0].phi)
        field = field.mirrored() if mirrored else field
        x, one = exact_ball(-start if mirrored else start), arb(1)
        pairs = [c for c in field.clusters() if len(c.zeros) == 2 and x < c.centre < 1]
        if len(pairs) != 1:
            return None
        centre, pi = field.factor(pairs[0])
        found = central_map(field.taylor(centre), pi)
        if found.eps < 0:
            return None
        ((p, q),) = by_parts(pi, found, arb(1), 0)[0]
        whole = panel(field, centre, pi, x, one, 0)
        rest = whole.own[0] + whole.mixed[0][0]
        for sign, s in zip((-1, 1), whole.ends, strict=True):
            # The finite part of (p + q s)^2/(s^2 - zeta), its mean along paths past both zeros.
            ratio = found.zeta / (s * s)
            tangent = _tangent(ratio)
            rest += sign * (
                q * q * s - (p * p + q * q * found.zeta) * tangent / s
                + p * q * abs(s * s - found.zeta).log()
            )  # fmt: skip
        values = {M: centre, D: pi.square, ZETA: found.zeta, P2: p * p, Q2: q * q, REST: rest}
        return {s: sympy.Float(to_mpf(v, _DIGITS)[0], _DIGITS) for s, v in values.items()}


def _tangent(x: Any) -> Any:
    """`inverse_tangent` of a ball."""
    if abs(x) < 1e-8:
        return 1 + x / 3 + x * x / 5 + x**3 / 7 + x**4 / 9
    root = abs(x).sqrt()
    return (root.atan() if x < 0 else ((1 + root) / abs(1 - root)).log() / 2) / root


def fall(y: Expr) -> Expr:
    """V(m) - V(m + y) of a cubic A."""
    return PSI0 * (y**3 / 3 - D * y) + PSI1 * (y**4 / 4 - D * y**2 / 2)


def beside_end() -> dict[Any, Expr]:
    """What the layer's end changes before a barrier: its Gaussian is cut off there, and a straight
    line of slope a+ follows, with x^2 = lam (V(u2) - V(1)).

    First the time in the well times the change of int e^{lam V} behind it; then the time beyond
    the end, where int e^{-lam V} before it is no longer e^{-lam V(1)}/(lam a+). A pair that is
    close together, as seen from the end, has all of it in its Airy functions.
    """
    root, climb = sympy.sqrt(D), Rational(4, 3) * Z ** Rational(3, 2)
    well, top = 2 * root * (PSI0 - PSI1 * root), 2 * root * (PSI0 + PSI1 * root)
    share = 1 - (1 + 8 * climb / BESIDE**2) * sympy.exp(-8 * climb / BESIDE**2)
    tail, pi = sympy.exp(-(BESIDE**2)), sympy.pi
    left = sympy.exp(-LAM * SLOPE * (R - 1)) / (LAM * SLOPE)
    cut = (
        pi
        / (2 * root * N)
        * sympy.exp(climb)
        * (tail / (sympy.sqrt(pi) * BESIDE) - sympy.erfc(BESIDE))
    )
    over = sympy.sqrt(2 * pi * LAM / well) * sympy.exp(climb - BESIDE**2) * left
    dawson = sympy.sqrt(pi) / 2 * tail * sympy.erfi(BESIDE)
    slow = sympy.sqrt(2 * LAM / top) * (dawson - 1 / (2 * BESIDE)) * (1 / (LAM * SLOPE) - left)
    return {
        BESIDE: sympy.sqrt(LAM * (fall(1 - M) - fall(root))),
        EDGE: sympy.Piecewise((share * (cut - over + slow), D > 0), (0, True)),
    }


def conditions(known: dict[Any, Expr], start: Expr) -> list[Any]:
    """Where the formula holds: neither the layer's end nor the start comes too near to the pair."""
    found = [sympy.Gt(R, 1), sympy.Gt(SLOPE, 0)]
    if PSI0 in known:
        top = sympy.sqrt(sympy.Max(D, 0))
        found.append(sympy.Gt(PSI0, 0))
        found.append(sympy.Gt(LAM * (fall(1 - M) - fall(top)), _END))
        found.append(sympy.Gt(LAM * (fall(-top) - fall(start - M)), _START))
    return found


def uniform(
    drift: Drift, quantity: str, order: int, start: Fraction, case: Any = None
) -> tuple[Case, Expr, dict[Any, Expr], tuple[Any, ...]]:
    """The case, the formula, what its symbols are, and where it holds."""
    if quantity != "T" or order:
        raise InputError(
            f"quantity is {quantity!r} and order {order}; the uniform formula is that of T to "
            "order 0, and method='uniform' has numbers of the others."
        )
    if abs(start) >= 1:
        raise InputError(
            f"start is {float_text(start)}, outside of the layer; sa.escape_time(method='uniform') "
            "has numbers."
        )
    sides = [False, True]
    if case is not None:
        kinds = str(case).split()
        sides = [kinds.index("start") > 0]
    A, x = drift.expression(), sympy.Rational(start.numerator, start.denominator)
    cubic = A.is_polynomial(U) and sympy.degree(A, U) in (2, 3)
    for mirrored in sides:
        seen, begin = (sympy.expand(-A.subs(U, -U)), -x) if mirrored else (A, x)
        if drift.free or drift.shape:
            if not cubic:
                continue
            known = of_cubic(seen, begin) | beside_end()
        else:
            numbers = in_numbers(drift, mirrored, start)
            if numbers is None:
                continue
            known = of_cubic(seen, begin) | beside_end() if cubic else {**numbers, EDGE: S.Zero}
        known |= {Z: LAM ** Rational(2, 3) * ZETA, SLOPE: seen.subs(U, 1), LAM: 2 / KAPPA**2}
        own = read_case("barrier well start" if mirrored else "start well barrier")
        where = tuple(c for c in conditions(known, begin) if c is not sympy.true)
        return own, formula(), known, where
    raise InputError(
        f"{drift!r} from {float_text(start)} has no well with a barrier behind it that the uniform "
        "formula is of: it takes a cubic A, or any bound drift; sa.escape_time(method='uniform') "
        "has numbers."
    )
