"""Laplace's method for int g(x) e^(lam f(x)) dx over [a, b] as lam -> oo.

To all orders in 1/lam the integral is the sum of contributions of the points p, interior or end
points, at which f is largest. With the distance t from p, on one side or on both sides,
f = f(p) - a t^mu (1 + ...) and g = t^(beta - 1) (g_0 + ...), the contribution is

    e^(lam f(p)) sum over k of c_k lam^(-(k + beta)/mu)

(Watson's lemma after Lagrange's reversion: DLMF 2.3(ii), 2.3(iii); A. Erdelyi, Asymptotic
Expansions, 2.4; `symasym.series.watson`). At an interior maximum the terms with k + beta - 1 odd
from the two sides cancel.

The error at a given lam is the distance to an enclosure of the integral: a bound on a finite
interval with f and g analytic at its ends, even if a maximum was missed, else an estimate
(`symasym.integrals.integral`).

The median Borel–Padé sum goes beyond the optimal order. With the first exponent s and b = s/2 the
series is lam^(b - s) times the Laplace transform of t^(b - 1) B(t), B = sum_k c_k t^k/Gamma(b + k),
which is singular at the singulants F = f(p) - f(q) of the saddles q adjacent to the maximum p (M.
V. Berry and C. J. Howls, Proc. R. Soc. A 434 (1991) 657). At a minimum q of f, F > 0: real lam is
on the Stokes line, and the real integral is the mean of the sums along paths above and below F (E.
Delabaere and F. Pham, Ann. IHP 71 (1999) 1). The point q itself does not contribute unless f''
vanishes there; such f are refused. A Padé approximant with poles p_j continues B analytically; with
z = -p_j, t in units of 1/lam and Tricomi's function,

    int_0^oo e^(-t) t^(b - 1)/(t - p_j) dt = Gamma(b) z^(b - 1) U(b, b, z)

(DLMF 13.4.4), whose real part is the mean if p_j > 0. For a complex pair of singulants with
Re F > 0 the approximants may continue to another branch; the error is then of the order
e^(-lam |F|^2/Re F).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import partial
from typing import Any

import sympy
from flint import acb, acb_poly, arb, arb_mat
from sympy import Expr, Float, Rational, S, Symbol

from symasym.base.balls import cached_property, exact_ball, precision
from symasym.base.errors import InputError
from symasym.base.inputs import count
from symasym.derivation.tex import tex
from symasym.integrals import maxima
from symasym.integrals.integral import IntegralExpansion, Zero, integral, number, read
from symasym.integrals.local import Balls, NotAnalytic, Point, exactly, exponent, sign_of
from symasym.series import Series, watson

__all__ = ["Contribution", "LaplaceExpansion", "laplace_integral"]

#: The numbers of terms available to order="optimal", used by order="borel", and the largest order.
_OPTIMAL, _BOREL, _MOST = 48, 41, 100
#: The precision of the Padé approximants in bits.
_PADE = 640
#: Bits for the comparison of f at critical points; digits of coefficients that are not exact.
_BITS, _DIGITS = 256, 60
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
    f: Expr, g: Expr, x: Symbol, top: maxima.Maximum, order: int, ring: Any
) -> Contribution:
    """The contribution of a maximum, with `order` terms."""
    point, side, both = top.point, top.side, top.side == "both"
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
        if len(weight) < n:
            raise NotAnalytic(f"{g} vanishes, or cancels, to all computed orders")
        if sign_of(front + 1) != 1:
            raise NotAnalytic(f"{g} behaves as a power {sympy.simplify(front)} of the distance")
    except NotAnalytic as error:
        raise InputError(
            f"{error} at {x} = {point}, where f is largest; Laplace's method needs a Taylor series "
            "of f there, and of g such a series times a power above -1 of the distance (inside, an "
            "integer power): change f or g, split the integral, or give symbols assumptions."
        ) from None
    beta, a = front + 1, ring.expression(-lead[contact])
    exponents, values = tuple((k + beta) / contact for k in range(first, n, step)), []
    steep = Series([ring.of(S.One), *(y / lead[contact] for y in lead[contact + 1 :])][:n])
    reduced = watson(
        steep, Series(weight.c[:n]), contact, exponent(beta, ring), first=first, step=step
    )
    for d, s in zip(reduced, exponents, strict=True):
        # Each side contributes the moment of t^(mu s - 1) e^(-a t^mu).
        gamma = sympy.gamma(s) if ring.exact else number(s).gamma()
        raised = a**s if ring.exact else ring.power(a, s)
        values.append(ring.expression(d) * (step * (gamma / (contact * raised))))
    height = ring.expression(lead[0])
    return Contribution(point, side, height, contact, beta, exponents, tuple(values))


@dataclass(frozen=True, repr=False)
class LaplaceExpansion(IntegralExpansion):
    """The expansion of the integral of g(x) e^(lam f(x)) over [a, b] for large lam.

    `conditions` were verified at sampled values of the parameters, but not proved from their
    assumptions.
    """

    method = "laplace"
    conditions: tuple[str, ...] = ()
    _tops: tuple[maxima.Maximum, ...] = field(default=(), compare=False)
    _known: dict[int, list[Contribution]] = field(default_factory=dict, compare=False)

    def _again(self, f: Any, g: Any, a: Any, b: Any) -> LaplaceExpansion:
        return laplace_integral(f, g, self.x, a, b, self.order)

    def _expanded(self, ring: Any, terms: int = 0) -> list[Contribution]:
        n = terms or self._terms
        return [contribution(self.f, self.g, self.x, m, n, ring) for m in self._tops]

    @property
    def _terms(self) -> int:
        return int({"optimal": _OPTIMAL, "borel": _BOREL}.get(self.order, self.order))

    @cached_property
    def contributions(self) -> tuple[Contribution, ...]:
        """The contributions of the maxima of f."""
        roots = sympy.Tuple(self.f, self.g).atoms(sympy.Function, sympy.Pow)
        roots = {n for n in roots if not n.args[-1].is_Integer}
        closed = all(isinstance(m.point, Expr) for m in self._tops)
        few = len(roots) <= _FUNCTIONS and self._terms <= _EXACT_TERMS
        if self.parameters or (closed and few):
            return tuple(exactly(self._expanded))
        bits = int(3.4 * _DIGITS) + 64
        with precision(bits):
            return tuple(
                Contribution(*(_rounded(y) for y in vars(c).values())) for c in self._in_balls(bits)
            )

    def _in_balls(self, bits: int) -> list[Contribution]:
        """The contributions in ball arithmetic; the result is cached."""
        if bits not in self._known:
            with precision(bits + 6 * self._terms):
                self._known[bits] = self._expanded(Balls())
        return self._known[bits]

    # -- numbers ------------------------------------------------------------------------------

    def _at(self, lam: Fraction, dps: int | None, full: bool) -> tuple[Any, ...]:
        """The sum divided by e^(lam height), and with `full` its distance to the integral."""
        wanted = dps or 17
        first = int(3.33 * wanted) + 64 + (_PADE if self.order == "borel" else 0)
        for bits in (first << k for k in range(4)):
            with precision(bits):
                large = exact_ball(lam)
                total, top, used = self._sum(large, bits)
            if total.rel_accuracy_bits() > 3.33 * wanted + 4:
                break
        with precision(bits):
            error, proved = arb(0), True
            if full:
                f, x, a, b = self.f, self.x, self.a, self.b
                inside = sorted(map(number, maxima.zeros(f.diff(x), x, a, b)), key=float)
                marks = [number(a), *inside, number(b)]
                whole, proved = integral(f, self.g, x, marks, large, top, bits)
                error = abs(total - whole)
            kind = "bound" if proved else "estimate"
            return large * top, total, error, kind, used

    def _sum(self, lam: Any, bits: int) -> tuple[Any, Any, int]:
        """The sum divided by e^(lam top), the maximum top of f, and the largest number of terms."""
        found = self._in_balls(bits)
        top, total, used = found[0].height, arb(0), 0
        for c in found:
            s = [number(e) for e in c.exponents]
            terms = [y * lam**-e for y, e in zip(c.coefficients, s, strict=True)]
            if self.order == "optimal":
                sizes = [arb.pos_inf() if t.contains(0) else abs(t.mid()) for t in terms]
                terms = terms[: max(1, min(range(len(sizes)), key=sizes.__getitem__))]
            borel = self.order == "borel"
            part = _median_sum(terms, s[0]) if borel else sum(terms, arb(0))
            total, used = total + part * (lam * (c.height - top)).exp(), max(used, len(terms))
        return total, top, used

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
        names = {Symbol("lam", positive=True): Symbol("lambda", positive=True)}
        total, size = (tex(e.xreplace(names)) for e in (self.expression, self.error))
        return f"{total} + O\\left({size}\\right)"

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {self.latex()}$"

    def __repr__(self) -> str:
        return f"{short(self.expression)} + O({short(self.error)})"


def _rounded(y: Any) -> Any:
    """A value, or a tuple of values, in which balls are rounded to `_DIGITS` digits."""
    if isinstance(y, tuple):
        return tuple(map(_rounded, y))
    y = number(y) if isinstance(y, Zero) else y
    return Float(y.mid().str(_DIGITS, radius=False), _DIGITS) if isinstance(y, arb) else y


def short(value: Any) -> str:
    """An expression as a text, with numbers rounded to twelve digits."""
    value = _rounded(value)
    return str(value.xreplace({y: y.n(12) for y in value.atoms(Float)}))


def _simple(f: Expr, g: Expr, x: Symbol, a: Expr, b: Expr) -> bool:
    """True if f and g are polynomials, and f' and f'' have no common zero in (a, b)."""
    if not (f.is_polynomial(x) and g.is_polynomial(x)):
        return False
    slope = sympy.Poly(f, x).diff(x)
    return not any(a < z and z < b for z in sympy.gcd(slope, slope.diff(x)).real_roots())


def _median_sum(terms: list[Any], first: Any) -> Any:
    """The median Borel–Padé sum of the terms c_k lam^-(first + k), which are balls."""
    b = first / 2
    whole, poles = _approximant([x / (b + k).gamma() for k, x in enumerate(terms)])
    total = sum((a * (b + k).gamma() for k, a in enumerate(whole)), arb(0))
    for pole, residue in poles:
        share = (-pole) ** (b - 1) * (-pole).hypgeom_u(b, b)
        total += b.gamma() * (residue * share).real
    return total


def _approximant(b: list[Any]) -> tuple[list[Any], list[tuple[Any, Any]]]:
    """The Padé approximant of sum b_k t^k: its polynomial part, and its poles with residues.

    Numerator and denominator have half the degree of the series, or a lower degree if the linear
    equations for the denominator are singular.
    """
    for m in range((len(b) - 1) // 2, 0, -1):
        rows = [[b[m + i - j] for j in range(1, m + 1)] for i in range(1, m + 1)]
        try:
            solved = arb_mat(rows).solve(arb_mat([[-b[m + i]] for i in range(1, m + 1)]))
            q = acb_poly([arb(1), *(x.mid() for x in solved.entries())])
            zeros = q.roots(tol=arb(2) ** (-_PADE // 2)) if q.degree() == m else []
        except (ValueError, ZeroDivisionError):
            continue
        if zeros:
            p = acb_poly((acb_poly(b[: m + 1]) * q).coeffs()[: m + 1])
            poles = [acb(z.real) if z.imag.contains(0) else z for z in zeros]
            return [(p[m] / q[m]).real], [(z, p(z) / q.derivative()(z)) for z in poles]
    return b, []


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
    estimate (`symasym.integrals.laplace`). The method is Watson's lemma after Lagrange's
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
    f, g, x, a, b = read(f, g, x, a, b)
    with precision(_BITS):
        ends = [number(e) for e in (a, b) if not e.free_symbols]
        free = sympy.Tuple(f, g, a, b).free_symbols - {x}
        known = len(ends) < 2 or ends[0] < ends[1]
        if sympy.Tuple(f, g, a, b).has(sympy.I) or not known or "lam" in map(str, free):
            raise InputError(
                f"f = {f}, g = {g}, a = {a}, b = {b}; give real f and g (oscillating integrals "
                "need stationary phase), real ends with a less than b, and no parameter lam."
            )
        tops = maxima.located(f, g, x, a, b)
        how = "compared at sampled parameters"
        said = tuple(f"f is largest at {x} = {m.point} ({how})" for m in tops if free)
        found = LaplaceExpansion(f, g, x, a, b, order, said, tuple(tops))
        one = partial(found._expanded, terms=1)
        steps = {c.step for c in (exactly(one) if free else one(Balls()))}
        if order == "borel" and not (steps == {1} and not free and _simple(f, g, x, a, b)):
            raise InputError(
                f"order is 'borel', f = {f} and g = {g}; it is for polynomials with numbers, f' "
                "and f'' without common zeros inside, and terms in steps of 1/lam: give another "
                "order, such as 'optimal'."
            )
    return found
