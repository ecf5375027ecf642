"""Laplace's method for int g(x) e^(lam f(x)) dx over [a, b] as lam -> oo.

To all orders in 1/lam the integral is the sum of contributions of the points p, interior or end
points, at which f is largest. With the distance t from p, on one side or on both sides,
f = f(p) - a t^mu (1 + ...) and g = t^(beta - 1) (g_0 + ...), the contribution is

    e^(lam f(p)) sum over k of c_k lam^(-(k + beta)/mu)

(Watson's lemma after Lagrange's reversion: DLMF 2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic
Expansions, 2.4; `symasym.series.watson`). At an interior maximum the terms with k + beta - 1 odd
from the two sides cancel.

The median Borel–Padé sum goes beyond the optimal order. With the first exponent s and b = s/2 the
series is lam^(b - s) times the Laplace transform of t^(b - 1) B(t), B = sum_k c_k t^k/Gamma(b + k),
which is singular at the singulants F = f(p) - f(q) of the saddles q adjacent to the maximum p (M.
V. Berry and C. J. Howls, Proc. R. Soc. A 434 (1991) 657). Those of minima are positive, and the
real integral is the mean of the sums along paths above and below them (E. Delabaere and F. Pham,
Ann. IHP 71 (1999) 1). With the poles p_j of a Padé approximant of B, z = -p_j, t in units of 1/lam
and Tricomi's function,

    int_0^oo e^(-t) t^(b - 1)/(t - p_j) dt = Gamma(b) z^(b - 1) U(b, b, z)

(DLMF 13.4.4), whose real part is the mean if p_j > 0.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import sympy
from flint import acb, acb_poly, arb, arb_mat, ctx
from sympy import Expr, Float, Rational, S, Symbol

from symasym.base.balls import Unresolved, cached_property, doubled, precision
from symasym.base.errors import InputError
from symasym.base.inputs import count
from symasym.derivation.tex import tex
from symasym.integrals.integral import BITS, IntegralExpansion, Zero, number
from symasym.integrals.local import Balls, NotAnalytic, Point, exactly, maxima, sign_of
from symasym.series import Series, watson

__all__ = ["Contribution", "LaplaceExpansion", "laplace_integral"]

#: The numbers of terms available to order="optimal", used by order="borel", and the largest order.
_OPTIMAL, _BOREL, _MOST = 48, 41, 100
#: The precision of the Padé approximants in bits.
_PADE = 640
#: Digits of coefficients that are not exact.
_DIGITS = 60
# Coefficients are exact for at most so many terms, and so many functions and roots in f and g.
_EXACT_TERMS, _FUNCTIONS = 12, 6
# Terms after which f is taken for a constant; spare orders for factors such as sin(x)/x.
_FLAT, _SPARE = 24, 4


@dataclass(frozen=True)
class Contribution:
    """The contribution e^(lam height) sum coefficients[k] lam^(-exponents[k]) of a maximum of f.

    `side` is "both", "left" or "right", the part of the point's neighbourhood in the interval.
    The leading term of f - height is -a t^contact, that of g is proportional to t^(beta - 1).
    """

    point: Expr
    side: str
    height: Expr
    contact: int
    beta: Expr
    exponents: tuple[Expr, ...]
    coefficients: tuple[Expr, ...]

    @property
    def step(self) -> Expr:
        """The difference between successive exponents."""
        return Rational(2 if self.side == "both" else 1, self.contact)


def contribution(
    of: IntegralExpansion, top: tuple[Any, str], order: int, ring: Any
) -> Contribution:
    """The contribution of a maximum, with `order` terms."""
    f, g, x, (point, side) = of.f, of.g, of.x, top
    both = side == "both"
    sign, step = {"left": -1, "both": 0, "right": 1}[side], (2 if both else 1)
    try:
        c = Point(x, point, sign, _FLAT + 1, ring).taylor(f).c
        contact = next((k for k, y in enumerate(c) if k and ring.sign(y) != 0), _FLAT)
        here = Point(x, point, sign, step * order + contact + _SPARE, ring)
        lead, (front, weight) = here.taylor(f).c, here.term(g)
        first = int(front % 2) if both else 0
        n = first + step * (order - 1) + 1
        if ring.sign(-lead[contact]) != 1 or (both and contact % 2):
            raise NotAnalytic(f"{f} is flat, or not proved to have a maximum,")
        if len(weight) < n or sign_of(front + 1) != 1:
            raise NotAnalytic(f"{g} cancels to all computed orders, or is not integrable,")
    except NotAnalytic as error:
        raise InputError(
            f"{error} at {x} = {point}, where f is largest; Laplace's method needs a Taylor series "
            "of f there, and of g such a series times a power above -1 of the distance (inside, an "
            "integer power): change f or g, split the integral, or give symbols assumptions."
        ) from None
    beta, a = front + 1, -lead[contact]
    exponents = tuple((k + beta) / contact for k in range(first, n, step))
    steep = Series([ring.of(S.One), *(y / lead[contact] for y in lead[contact + 1 :])][:n])
    power = beta if beta.is_Rational else ring.of(beta)
    reduced = watson(steep, Series(weight.c[:n]), contact, power, first=first, step=step)
    # Each side contributes the moment of t^(mu s - 1) e^(-a t^mu).
    values = tuple(
        ring.expression(d) * (step * (ring.moment(s, a) / contact))
        for d, s in zip(reduced, exponents, strict=True)
    )
    return Contribution(point, side, ring.expression(lead[0]), contact, beta, exponents, values)


@dataclass(frozen=True, repr=False)
class LaplaceExpansion(IntegralExpansion):
    """The expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam."""

    method = "laplace"

    def __post_init__(self) -> None:
        super().__post_init__()
        with precision(BITS):
            steps = {c.step for c in self._expanded(1)}
        f, x = self.f, self.x
        known = not self.parameters and f.is_polynomial(x) and self.g.is_polynomial(x)
        simple = known and steps == {1} and sympy.Poly(f, x).diff().is_sqf
        if self.order == "borel" and not simple:
            raise InputError(
                f"order is 'borel', f = {self.f} and g = {self.g}; it is for polynomials with "
                "numbers, simple zeros of f', and terms in steps of 1/lam: give another order, "
                "such as 'optimal'."
            )

    @cached_property
    def _tops(self) -> list[tuple[Any, str]]:
        return maxima(self.f, self.g, self.x, self.a, self.b)

    def _expanded(self, terms: int, exact: bool = False) -> list[Contribution]:
        """The contributions of the maxima, exact if there are parameters."""

        def work(ring: Any) -> list[Contribution]:
            return [contribution(self, m, terms, ring) for m in self._tops]

        return exactly(work) if exact or self.parameters else work(Balls())

    @property
    def _terms(self) -> int:
        return int({"optimal": _OPTIMAL, "borel": _BOREL}.get(self.order, self.order))

    @property
    def conditions(self) -> tuple[str, ...]:
        """What was verified at sampled values of the parameters, but not proved."""
        how = "compared at sampled parameters"
        tops = self._tops if self.parameters else []
        return tuple(f"f is largest at {self.x} = {z} ({how})" for z, _ in tops)

    @cached_property
    def contributions(self) -> tuple[Contribution, ...]:
        """The contributions of the maxima of f."""
        roots = sympy.Tuple(self.f, self.g).atoms(sympy.Function, sympy.Pow)
        roots = {n for n in roots if not n.args[-1].is_Integer}
        closed = all(isinstance(z, Expr) for z, _ in self._tops)
        few = len(roots) <= _FUNCTIONS and self._terms <= _EXACT_TERMS
        if self.parameters or (closed and few):
            return tuple(self._expanded(self._terms, exact=True))
        found = in_balls(self, int(3.4 * _DIGITS) + 64)
        with precision(4 * _DIGITS):
            return tuple(Contribution(*(_rounded(y) for y in vars(c).values())) for c in found)

    # -- numbers ------------------------------------------------------------------------------

    def _sum(self, lam: Any) -> tuple[Any, Any, int]:
        bits = ctx.prec + (_PADE if self.order == "borel" else 0)
        found, total, used = in_balls(self, bits - bits % -64), arb(0), 0
        with precision(bits):
            for c in found:
                s = [number(e) for e in c.exponents]
                terms = [y * lam**-e for y, e in zip(c.coefficients, s, strict=True)]
                if self.order == "optimal":
                    sizes = [arb.pos_inf() if t.contains(0) else abs(t.mid()) for t in terms]
                    terms = terms[: max(1, min(range(len(sizes)), key=sizes.__getitem__))]
                borel = self.order == "borel"
                part = _median_sum(terms, s[0]) if borel else sum(terms, arb(0))
                total += part * (lam * (c.height - found[0].height)).exp()
                used = max(used, len(terms))
        return found[0].height, total, used

    # -- as a formula -------------------------------------------------------------------------

    @property
    def expression(self) -> Expr:
        """The sum as an expression in the parameters and the symbol lam."""
        lam = Symbol("lam", positive=True)
        return sympy.Add(
            *(
                sympy.exp(lam * c.height) * k * lam**-s
                for c in self.contributions
                for k, s in zip(c.coefficients, c.exponents, strict=True)
            )
        )

    @property
    def error(self) -> Expr:
        """The order of the first omitted term."""
        lam = Symbol("lam", positive=True)
        omitted = sympy.Min(*(c.exponents[-1] + c.step for c in self.contributions))
        return sympy.exp(lam * self.contributions[0].height) * lam**-omitted

    def latex(self) -> str:
        """The expansion with its O term in LaTeX."""
        return f"{tex(self.expression)} + O\\left({tex(self.error)}\\right)"

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {self.latex()}$"

    def __repr__(self) -> str:
        total, size = (
            e.xreplace({y: y.n(12) for y in e.atoms(Float)}) for e in (self.expression, self.error)
        )
        return f"{total} + O({size})"


@lru_cache(maxsize=64)
def in_balls(of: LaplaceExpansion, bits: int) -> list[Contribution]:
    """The contributions in balls of at least so many bits; a ball that contains 0 counts as 0."""

    def found(_: int) -> list[Contribution]:
        row = of._expanded(of._terms)
        balls = [y for c in row for y in c.coefficients]
        if any(y.rel_accuracy_bits() < bits and not y.contains(0) for y in balls):
            raise Unresolved
        return row

    row: list[Contribution] = doubled(found, bits + 6 * of._terms + 64)
    return row


def _rounded(y: Any) -> Any:
    """A value, or a tuple of values, in which balls are rounded to `_DIGITS` digits."""
    if isinstance(y, tuple):
        return tuple(map(_rounded, y))
    y = number(y) if isinstance(y, Zero) else y
    return Float(y.mid().str(_DIGITS, radius=False), _DIGITS) if isinstance(y, arb) else y


def _median_sum(terms: list[Any], first: Any) -> Any:
    """The median Borel–Padé sum of the terms c_k lam^-(first + k), which are balls.

    Numerator and denominator have half the degree of the series, or a lower degree if the linear
    equations for the denominator are singular.
    """
    s = first / 2
    b = [x / (s + k).gamma() for k, x in enumerate(terms)]
    for m in range((len(b) - 1) // 2, 0, -1):
        rows = [[b[m + i - j] for j in range(m)] for i in range(m)]
        with suppress(ValueError, ZeroDivisionError):
            solved = arb_mat(rows).solve(arb_mat([[-y] for y in b[m + 1 : 2 * m + 1]]))
            q = acb_poly([arb(1), *(x.mid() for x in solved.entries())])
            p = acb_poly((acb_poly(b[: m + 1]) * q).coeffs()[: m + 1])
            total = (p[m] / q[m]).real * s.gamma()
            for z in q.roots(tol=arb(2) ** (-_PADE // 2)):
                pole = acb(z.real) if z.imag.contains(0) else z
                share = (-pole) ** (s - 1) * (-pole).hypgeom_u(s, s)
                total += s.gamma() * (p(z) / q.derivative()(z) * share).real
            if q.degree() == m:
                return total
    return sum(terms, arb(0))


def laplace_integral(f: Any, g: Any, x: Any, a: Any, b: Any, order: Any = 3) -> LaplaceExpansion:
    """Expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam (Laplace's method).

    Parameters
    ----------
    f, g : Expr, str or number
        Elementary functions that are real on (a, b), with parameters; split the integral at kinks.
        At its maximum f has a Taylor series, and g is a Taylor series times a power, greater than
        -1, of the distance.
    x : Symbol or str
        Variable of integration.
    a, b : Expr or number
        Ends, possibly -oo and oo.
    order : int, "optimal" or "borel"
        The number of terms per maximum, 1 to 100; ``"optimal"``: up to the smallest term at each
        lam; ``"borel"``: the far more accurate median Borel–Padé sum of 41 terms, for polynomials
        f and g without free parameters and with simple zeros of f' (`symasym.integrals.laplace`).

    Returns
    -------
    LaplaceExpansion
        Its coefficients are exact if there are parameters, or for up to 12 terms if the maximum
        has a closed form and f and g few functions; otherwise they have 60 digits.

    Notes
    -----
    With ``full=True`` the error is a bound if the interval is finite with regular ends, else an
    estimate (`symasym.integrals.integral`). The method is Watson's lemma after Lagrange's
    reversion: DLMF 2.3(iii); J. Wojdylo, SIAM Rev. 48 (2006) 76.

    Examples
    --------
    Stirling's series, Gamma(lam + 1) lam^(-lam - 1):

    >>> import symasym as sa
    >>> stirling = sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", order=3)
    >>> stirling.contributions[0].coefficients
    (sqrt(2)*sqrt(pi), sqrt(2)*sqrt(pi)/12, sqrt(2)*sqrt(pi)/288)
    >>> print(stirling.evaluate(1000, dps=20, log=True, full=True))
    -1002.5348557729532 ± 2.73e-12 (estimate, laplace)
    >>> stirling.evaluate([10.0, 100.0]).round(12).tolist()
    [3.6288097e-05, 0.0]
    """
    if not isinstance(order, str) or order not in ("optimal", "borel"):
        order = count("order", order, 1, _MOST, " of terms", ', "optimal" or "borel"')
    return LaplaceExpansion.of(f, g, x, a, b, order)
