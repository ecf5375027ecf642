"""Formulas for a drift in one case: weak noise, strong noise, and uniform at a fold.

Weak noise (`symasym.expansions.weak`): T is a quotient of sums of exponentials c e^{lam h}; each
term of T is the product of one contribution to int e^{-lam V} and one to int e^{lam V}.

Strong noise (`symasym.expansions.strong_noise`): the moments of V are symbols for polynomials in
the drift's parameters. The integrals outside the layer are elementary, in terms of the functions
(e^x - 1)/x and (e^x - 1 - x)/x^2.

Uniform: T for a quadratic or cubic A to leading order, uniformly as a well and a barrier coalesce.
With phi du = (s^2 - zeta) ds and u'(s) = p + q s at both zeros of s^2 - zeta (C. Chester,
B. Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599),

    T = pi^2 [p^2 lam^(1/3) (Ai^2 + Bi^2)(Z) - q^2 lam^(-1/3) (Ai'^2 + Bi'^2)(Z)] + R + (r - 1)/a+,

Z = lam^(2/3) zeta (DLMF 9.11.4 and its derivative), for a start left of a well left of a barrier;
R is the finite part of int du/phi from the start to 1, without the contribution of this pair.

All symbols are explicit and analytic at the fold D = 0: A = (y^2 - D)(psi0 + psi1 y), y = u - m,
m = b + k T_(1/3)(w), where b +- k are the zeros of A', 2 c3 k^3 w = A(b) and
T_(1/3)(w) = cos(acos(w)/3), since 4 (m - b)^3 - 3 k^2 (m - b) = A(b)/(2 c3).
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator
from contextlib import suppress
from fractions import Fraction
from functools import reduce
from operator import mul
from typing import Any, NamedTuple

import sympy
from sympy import Expr, Poly, Rational, S

from symasym.base.errors import InputError
from symasym.drift.drift import Drift
from symasym.expansions import weak as theorem
from symasym.expansions.sides import Stretch, quantity, straight
from symasym.expansions.strong_noise import Moments, layer, moments_by
from symasym.formulas.cases import PAIRS, Case, U, case_for
from symasym.formulas.letters import (
    IN_KAPPA,
    KAPPA,
    LAM,
    Letters,
    Pair,
    R,
    SymbolicDrift,
    Terms,
    exponentials,
    put_in,
)  # fmt: skip
from symasym.series import Series


class Contribution(NamedTuple):
    """The product of a contribution to int e^{-lam V} and one to int e^{lam V}, a term of T.

    The term is weight * front * e^{exponent} (c_0 + c_1 kappa^2 + c_2 kappa^4 + ...). `pair` has
    the two points, such as ``("well u1", "barrier u2")``, `coefficients` c_0 = 1, c_1, ...;
    `weight` is ``"1 - C"`` right of the start, ``"C"`` left of it, else ``"C (1 - C)"``.
    """

    pair: tuple[str, ...]
    exponent: Expr
    front: Expr
    coefficients: tuple[Expr, ...]
    weight: str

    @property
    def expression(self) -> Expr:
        """The contribution without its weight."""
        series = sympy.Add(*(c * KAPPA ** (2 * n) for n, c in enumerate(self.coefficients)))
        return self.front * sympy.exp(self.exponent) * series


def weak(
    drift: Drift, quantity: str, order: int, start: Fraction, asked: str | None
) -> dict[str, Any]:
    """The weak-noise formula, its case, the definitions of its symbols and its conditions."""
    if drift.model.plain and drift != Drift.general():
        of = SymbolicDrift(drift, case_for(drift, start, asked, quantity[-1] == "P"), start)
    else:
        of = _pair(drift, start, asked)
    at, where, count = Terms(of.start), [*conditions(of, quantity)], order + 1
    found = {"case": of.case, "conditions": where, "equations": of.equations}
    if not of.A.has(U) and quantity[-1] != "P" and not start:
        # Reflection of u interchanges C and 1 - C.
        half = (-of.A if quantity == "1 - C" else of.A) * R / KAPPA**2
        value = R * sympy.tanh(half) / of.A if quantity == "T" else 1 / (1 + sympy.exp(2 * half))
        return {**found, "formula": value}
    if not of.pair:
        known = theorem.coefficients(of, quantity, count, Letters)
        formula = theorem.quantity(quantity, known, at)
        row = _products(known, at) if quantity == "T" else []
        terms = tuple(_contributions(row, at, count))
    else:
        points = theorem.points_of(of, count, Letters)
        row = [theorem.Sums([p], 1 if p.tops(1) else -1, at).whole[0] for p in points]
        points.sort(key=lambda p: p.tops(1))
        weight = "C" if of.case.kinds[0] == "barrier" else "1 - C"
        terms = tuple(_contributions([(weight, tuple(points), mul(*row))], at, count))
        formula = terms[0].expression
        if of.values.keys() >= {*of.zeros}:
            whole = terms[0]
            height, *row = (
                put_in(e, of.values)
                for e in (whole.exponent, *(whole.front * c for c in whole.coefficients))
            )
            row = [sympy.simplify(c) * KAPPA ** (2 * n) for n, c in enumerate(row)]
            formula = sympy.exp(sympy.simplify(height, doit=False))
            formula *= sympy.factor_terms(sympy.Add(*row))
            found["conditions"] = [by_sign(put_in(c, of.values)) for c in where]
    return {**found, "formula": formula, "terms": terms,
            "definitions": {**at.known, **of.values, **IN_KAPPA}}  # fmt: skip


def _pair(drift: Drift, start: Fraction, asked: str | None) -> Pair:
    """The well and the barrier in the case `asked`, by default in the first case that exists."""
    first = case_for(drift, start, asked, False)
    if asked is None:
        with suppress(InputError):
            return Pair(drift, first, start)
        first = PAIRS[1]
    return Pair(drift, first, start)


def _products(known: theorem.Coefficients, at: Terms) -> Iterator[tuple[str, Any, Any]]:
    """Weight, points and value of the products in T; a start on a well has one with each."""
    points = known.points
    of, start = theorem.shares(points, known.regular, at), points[theorem.start_of(points)]
    for weight, side in zip(("C", "1 - C"), of.sides, strict=True):
        yield from ((weight, *part) for part in side if part[0])
    if of.own != 0:
        whole = zip(points, theorem.Sums(points, 1, at).whole, strict=True)
        yield from (("C (1 - C)", (start, p), of.own * s) for p, s in whole if s != 0)


def _contributions(products: Iterable[Any], at: Terms, count: int) -> Iterator[Contribution]:
    """The contributions to T, with exact coefficients."""
    for weight, pair, value in products:
        ((height, c),) = exponentials(value).items()
        series = [at.rows.get(f, (f, [S.One])) for f in sympy.Mul.make_args(c)]
        front = sympy.Mul(LAM, *(first * row[0] for first, row in series))
        rows = (Series(a / row[0] for a in [*row, *[S.Zero] * count][:count]) for _, row in series)
        yield Contribution(
            tuple(f"{p.name} {'' if str(p.u)[0] == 'u' else 'u = '}{p.u}" for p in pair),
            (LAM * height).xreplace(IN_KAPPA),
            sympy.powdenest(front.xreplace(IN_KAPPA), force=True),
            tuple(sympy.expand(a / 2**n) for n, a in enumerate(reduce(mul, rows).c)), weight,
        )  # fmt: skip


def ends(of: SymbolicDrift, quantity: str) -> list[Any]:
    """The conditions on r and on the drift at the ends of the layer."""
    low, high = of.at(-S.One), of.at(S.One)
    if quantity[-1] == "P":
        return [sympy.Gt(low, 0), sympy.Lt(high, 0)]
    return [sympy.Gt(R, 1), sympy.Ne(low, 0), sympy.Ne(high, 0)]


def conditions(of: SymbolicDrift, quantity: str) -> Iterator[Any]:
    """The conditions for the formula as SymPy predicates."""
    inside = [u for u, _ in of.places if u in of.zeros or u == of.start and abs(u) < 1]
    edges = ([-S.One], [S.One]) if of.layered else ([], [])
    yield from (a < b for a, b in itertools.pairwise([*edges[0], *inside, *edges[1]]))
    yield from (sympy.Eq(of.A.subs(U, u), 0) for u in of.zeros if not (of.pair and u in of.values))
    if of.pair:
        well, barrier = sorted(of.zeros, key=lambda u: of.kinds[u] == "barrier")
        yield of.height(barrier) > of.height(well)
        if of.values.keys() >= {*of.zeros}:
            slope = of.slope * of.sigma**2
            yield from (slope.subs(U, barrier) > 0, slope.subs(U, well) < 0)
        return
    yield from ends(of, quantity)
    if of.poly is not None and of.poly.degree():
        yield sympy.Ne(of.poly.LC(), 0)
    if kind := of.case.at_start:
        slope = of.slope.subs(U, of.start)
        yield sympy.Gt(slope, 0) if kind == "barrier" else sympy.Lt(slope, 0)
    elif abs(of.start) < 1:
        yield sympy.Ne(of.at(of.start), 0)


def by_sign(c: Any) -> Any:
    """A condition a > b as one on the sign of a - b, without its number and its odd or half-integer
    power, where that is shorter."""
    if not isinstance(c, (sympy.StrictGreaterThan, sympy.StrictLessThan)):
        return c
    number, rest = sympy.factor(sympy.simplify(c.gts - c.lts)).as_coeff_Mul()
    base, power = rest.as_base_exp()
    rest = base if power.is_Rational and (power.q == 2 or power % 2) else rest
    return min(sympy.Gt(rest, 0) if number > 0 else sympy.Lt(rest, 0), c, key=sympy.count_ops)


def _layer(of: SymbolicDrift, order: int, side: int, a: Any, mark: str) -> Stretch:
    """The layer from a to 1; for side = -1 that of the mirror image."""
    A = Poly(side * of.A.subs(U, side * U), U).to_field()

    def integral(f: Any) -> Any:
        whole = f.integrate(U)
        return whole - whole.eval(a)

    known = moments_by(A.one, integral, A.neg().mul, lambda f: S(f.eval(1)), order + 1)
    rows = (
        [of.named(f"{letter}{k}{mark}", c) for k, c in enumerate(row)]
        for letter, row in zip("nfm", known[1:], strict=True)
    )
    return layer(Moments(of.named(f"d{mark}", known.rise), *rows), Terms(of.start))


def strong(drift: Drift, name: str, order: int, start: Fraction, _: Any) -> dict[str, Any]:
    """The strong-noise formula in lam, r and the moments, with definitions and conditions."""
    case, sides = Case(("start",)), list[Stretch]()
    of = SymbolicDrift(drift, case, start)
    if of.poly is None:
        raise InputError(
            f"A = {of.A} is no polynomial in u, so that the moments of V have no closed form; "
            "use method 'strong_noise' for numbers."
        )
    for side, letter, mark in ((-1, "L", "-"), (1, "R", "+")) if name[-1] != "P" else ():
        x, beyond = side * of.start, straight(-side * of.ends[side], R - 1, Terms(of.start))
        whole = _layer(of, order, side, x, mark).then(beyond)
        scale, nested = of.named(letter, whole.scale), of.named(f"w{mark}", whole.nested)
        sides.append(Stretch(scale, S.Zero, nested, S.One))
    slopes = of.ends[-1], of.ends[1]
    formula = quantity(name, sides or [_layer(of, order, -1, -S.One, "")], slopes, LAM)
    known = {**of.values, **IN_KAPPA}
    return {"case": case, "formula": formula, "definitions": known, "conditions": ends(of, name)}


# -- uniform -----------------------------------------------------------------------------------

M, D, K, W, ZETA, Z, N = sympy.symbols("m D k w zeta Z N", real=True)
PSI0, PSI1, P2, Q2, REST, SLOPE = sympy.symbols("psi0 psi1 p^2 q^2 R_0 phi(1)", real=True)
_THIRD = Rational(1, 3)
# The least differences of lam V from the barrier to the end and from the start to the well.
_FALL = 4


def _of_cubic(A: Expr, start: Expr) -> tuple[dict[Any, Expr], list[Any]]:
    """The definitions of the symbols and the conditions for a polynomial A of degree 2 or 3, whose
    leading coefficient is taken to be positive unless it is known to be negative."""
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
    where = [sympy.Gt(R, 1), SLOPE > 0, PSI0 > 0, sympy.Gt(M - top, start), sympy.Gt(1, M)]
    return known, [*where, *(LAM * fall > _FALL for fall in falls)]


def uniform(
    drift: Drift, _name: str, _order: int, start: Fraction, asked: str | None
) -> dict[str, Any]:
    """The uniform formula, which exists for T to order 0, with definitions and conditions."""
    A, x = drift.expression(), Rational(start.numerator, start.denominator)
    cubic = A.is_polynomial(U) and sympy.degree(A, U) in (2, 3)
    for own in [c for c in PAIRS if asked in (None, str(c)) and abs(start) < 1 and cubic]:
        side = -1 if own.before else 1
        known, where = _of_cubic(sympy.expand(side * A.subs(U, side * U)), side * x)
        signs = (put_in(c.lhs - c.rhs, known).evalf() for c in where if not c.has(R, LAM))
        if drift.free or all(sign.is_positive for sign in signs):
            size = sympy.airyai(Z) ** 2 + sympy.airybi(Z) ** 2
            steep = sympy.airyaiprime(Z) ** 2 + sympy.airybiprime(Z) ** 2
            airy = sympy.pi**2 * (P2 * LAM**_THIRD * size - Q2 / LAM**_THIRD * steep)
            formula = airy + REST + (R - 1) / SLOPE
            return {"case": own, "formula": formula, "definitions": known, "conditions": where}
    raise InputError(
        f"{drift!r} from {float(start):.6g} has no uniform formula, which exists for a cubic A, a "
        'well next to the start and a barrier beyond it; use method="uniform" for numbers.'
    )
