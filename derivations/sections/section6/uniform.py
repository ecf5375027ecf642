"""Section 6.2, weak noise: integrals over a pair of zeros of phi, and from a barrier to an end.

What `symasym.expansions.canonical` takes by numbers: the canonical Airy form of a well and a
barrier that may coalesce (Chester, Friedman and Ursell), and the Gaussian truncated by an end
(Bleistein), both to leading order; and the recurrence and the products by which the first goes on
to every order.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import sympy
from sympy import Function, Symbol

from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

x = Symbol("x", positive=True)
s = Symbol("s", real=True)
y = Symbol("y", real=True)
Z = Symbol("Z", real=True)
small = Symbol("small", positive=True)
a, b = Symbol("a", real=True), Symbol("b", real=True)
a_up, b_up = Symbol("a_up", real=True), Symbol("b_up", real=True)
zeta, k = Symbol("zeta", real=True), Symbol("k", integer=True, nonnegative=True)
p_2, q_1, q_2 = (Symbol(name, real=True) for name in ("p_2", "q_1", "q_2"))
H = Function("H")(s)
ai, bi = sympy.airyai(Z), sympy.airybi(Z)
# What is left of phi at the zeros y = -R, R: even - odd R and even + odd R; D = R^2.
even, odd = Symbol("even", positive=True), Symbol("odd", real=True)
square, root = Symbol("square", real=True), Symbol("R", positive=True)
norm = Symbol("norm", positive=True)
slope, side = Symbol("slope", positive=True), Symbol("side", real=True)
# Airy functions as numbers.
known = {
    Symbol("bi", real=True): bi,
    Symbol("bi_slope", real=True): sympy.diff(bi, Z),
    Symbol("squares", positive=True): ai**2 + bi**2,
    Symbol("slopes", positive=True): sympy.diff(ai, Z) ** 2 + sympy.diff(bi, Z) ** 2,
}
BI, BI_SLOPE, SQUARES, SLOPES = known
CROSS = Symbol("cross", real=True)


@derives(
    "airy-form", "A well and a barrier that may coalesce, to leading order", ("pair-products",)
)
def airy_form(d: Any) -> None:
    d.suppose("phi = +-(y^2 - D) psi(y) with psi > 0, y from half-way between the zeros")
    d.suppose("phi du = (s^2 - zeta) ds with u' = a + b s + ..., Z = lam^(2/3) zeta")
    d.suppose(
        "each single integral is the mean of those along both complex paths past the other zero"
    )
    slopes = d.step(
        "u' squared at both zeros",
        "differentiate",
        (1 / (slope * (even + odd * root)), 1 / (slope * (even - odd * root))),
        Identity(_slopes),
        "of phi du = (s^2 - zeta) ds at s = +-R/c, y along s",
        left=(
            r"u'^2 \big|_{y = R}",
            r"u'^2 \big|_{y = -R}",
        ),
    )
    product = d.step(
        "psi at both zeros",
        "evaluate",
        even**2 - odd**2 * square,
        Identity(lambda: _at_both(even + odd * y)),
        "their product N",
        left=r"N = \psi(R) \psi(-R)",
    )
    front = sympy.sqrt((even + sympy.sqrt(norm)) / (2 * slope * norm))
    d.step(
        "a and b",
        "solve",
        (front, -odd / (2 * norm * front)),
        Satisfies(lambda found: _linear(found, slopes, product)),
        "u' = a + b s at both zeros; D may have either sign",
        left=(
            "a",
            "b",
        ),
    )
    d.step(
        "pole terms of 1/phi",
        "split",
        (side * even / norm, -side * odd / norm),
        Satisfies(lambda found: _residues(found, product)),
        "(alpha + beta y)/(y^2 - D) has the residues of 1/phi, phi = sigma (y^2 - D) psi(y)",
        left=(
            r"\alpha",
            r"\beta",
        ),
    )
    exponential = sympy.exp(s**3 / 3 - Z * s)
    integrand = d.step(
        "the integrand is a derivative",
        "integrate",
        exponential,
        Satisfies(lambda found: {"I'' - Z I": sympy.diff(found, s) - (s**2 - Z) * exponential}),
        "it vanishes at the ends of both paths, so that I'' - Z I = 0 for I(Z), the integral of "
        "e^(s^3/3 - s Z)",
        left=r"\int (s^2 - Z) e^{s^3/3 - s Z} \, ds",
    )
    start = d.step(
        "at Z = 0",
        "evaluate",
        tuple(_at_zero(n) for n in range(2)),
        Identity(lambda: [_rays(n, integrand) for n in range(2)]),
        "I and I' over the rays from 0 to -oo and to oo e^(+-i pi/3), the mean of both",
        left=(
            "I(0)",
            "I'(0)",
        ),
    )
    one = d.step(
        "I",
        "solve",
        sympy.pi * bi,
        Satisfies(lambda found: _solves(found, start, integrand)),
        "DLMF 9.5.5",
        left="I(Z)",
    )
    single = d.step(
        "with the weight u'",
        "substitute",
        _single_pair(bi, sympy.diff(bi, Z)),
        Identity(lambda: _weighted(one)),
        "of exp(lam V) and of exp(-lam V), the height left out; V = -+ (s^3/3 - zeta s) along s",
        left=(
            "I_{+}",
            "I_{-}",
        ),
    )
    both = d.step(
        "both",
        "substitute",
        _double_pair(known[SQUARES], known[SLOPES]),
        Identity(lambda: _double(*d.use("pair-products", "J", "J_1", "J_2"))),
        "the contributions of s(u) and s(v), both with the factor a b, cancel",
        left="I_{+-}",
    )
    d.step(
        "single integrals from Bi and Bi'",
        "evaluate",
        _single_pair(BI, BI_SLOPE),
        Satisfies(lambda found: _as_numbers(found, single)),
        left=(
            "I_{+}",
            "I_{-}",
        ),
    )
    d.step(
        "both from products",
        "evaluate",
        _double_pair(SQUARES, SLOPES),
        Satisfies(lambda found: _as_numbers([found], [both])),
        left="I_{+-}",
    )
    lower = d.step(
        "one order lower",
        "integrate",
        (-sympy.diff(H, s) / lam, sympy.diff(H, s) / lam),
        Satisfies(_one_order_lower),
        "the weight that replaces (s^2 - zeta) H(s) in the integrals of exp(-lam V) and of "
        "exp(lam V), by parts",
        left=(r"(s^2 - \zeta) H(s) \to", r"(s^2 - \zeta) H(s) \to"),
    )
    d.step(
        "next weight",
        "differentiate",
        ((2 * k + 1) * q_1 + 2 * (k + 1) * zeta * q_2, 2 * (k + 1) * p_2),
        Identity(lambda: _next_weight(lower)),
        "H is the sum of (p_(k+1) + q_(k+1) s)(s^2 - zeta)^k; even and odd coefficient of H'",
        left=(r"[(s^2 - \zeta)^k] \, H'(s)", r"[s (s^2 - \zeta)^k] \, H'(s)"),
    )
    factors = d.step(
        "weights of the double integral",
        "substitute",
        (a * a_up, a * b_up - b * a_up, -b * b_up),
        Satisfies(lambda found: _factors(found, *d.use("pair-products", "J", "J_1", "J_2"))),
        "of Q = Ai^2 + Bi^2, X = Ai Ai' + Bi Bi' and Q' = Ai'^2 + Bi'^2, over pi^2 and with s in "
        "units of lam^(-1/3); a + b s(u) and a_up + b_up s(v), u < v",
        left=("[Q]", "[X]", "[Q']"),
    )
    d.step(
        "products in lam",
        "substitute",
        tuple(sympy.pi**2 * small ** (n + 2) * e for n, e in enumerate((SQUARES, CROSS, SLOPES))),
        Satisfies(
            lambda found: {
                "both weights": _with_both(
                    found, factors, d.use("pair-products", "J", "J_1", "J_2")
                )
            }
        ),
        "what these weights multiply: J, J_1 and -J_2 of 'pair-products' in units of u",
        left=(r"\lambda^{-2/3} J", r"\lambda^{-1} J_1", r"-\lambda^{-4/3} J_2"),
    )
    d.conclude(
        (Symbol("I_up"), Symbol("I_down"), Symbol("I_both")),
        (*single, both),
        "relative O(1/lam)",
        note="integrals of e^(lam V), of e^(-lam V) over both zeros and of e^(lam (V(v) - V(u))) "
        "over u < v, V less the mean of its heights there; delta = lam^(-1/3)",
    )


def _single_pair(value: Any, slope_of: Any) -> tuple[Any, Any]:
    return tuple(sympy.pi * small * (a * value + sign * b * slope_of * small) for sign in (1, -1))


def _double_pair(values: Any, slopes_of: Any) -> Any:
    return sympy.pi**2 * small**2 * (a**2 * values - b**2 * slopes_of * small**2)


def _at_both(psi: Any) -> Any:
    return sympy.expand(psi.subs(y, root) * psi.subs(y, -root)).subs(root**2, square)


def _slopes() -> list[Any]:
    """2 s/phi'(y) at both zeros, from phi (dy/ds) = s^2 - zeta differentiated there."""
    phi = (y**2 - root**2) * (even + odd * y)
    derivative = sympy.diff(phi, y)
    return [sympy.factor(2 * at / slope / derivative.subs(y, at)) for at in (root, -root)]


def _linear(found: Any, slopes: Any, product: Any) -> dict[str, Any]:
    """(a + b s)^2 at both zeros less u'^2, with q for the square root of the norm."""
    q = Symbol("q", positive=True)
    under = product.subs(square, root**2)
    equations = {}
    for name, at, wanted in (("at y = R", root, slopes[0]), ("at y = -R", -root, slopes[1])):
        gap_to = sympy.expand((found[0] + found[1] * at / slope) ** 2) - wanted
        top = sympy.numer(sympy.together(gap_to.subs(norm, q**2)))
        equations[name] = sympy.rem(sympy.expand(top), q**2 - under, q)
    # The branch on which u grows with s.
    equations["a > 0"] = sympy.sqrt(found[0] ** 2) - found[0]
    return equations


def _residues(found: Any, product: Any) -> dict[str, Any]:
    alpha, beta = (e.subs(norm, product.subs(square, root**2)) for e in found)
    return {
        name: sympy.together((alpha + beta * at) * (even + odd * at) - side)
        for name, at in (("residue at y = R", root), ("residue at y = -R", -root))
    }


def _at_zero(n: int) -> Any:
    power = sympy.Rational(n + 1, 3)
    return sympy.Rational(3, 2) * sympy.Integer(3) ** (power - 1) * sympy.gamma(power)


def _rays(n: int, integrand: Any) -> Any:
    """The mean over both paths of int (-s)^n e^(s^3/3) ds."""
    start = integrand.subs({Z: 0, s: -x})
    if start != sympy.exp(-(x**3) / 3):
        raise ValueError(f"{start} is not the integrand that falls along both rays.")
    length = sympy.integrate(x**n * start, (x, 0, sympy.oo))
    total = sympy.S.Zero
    for turn in (sympy.pi / 3, -sympy.pi / 3):
        out = sympy.exp(sympy.I * turn)
        # s = -x from -oo on; s = x e^(i turn) onwards.
        total += length + (-1) ** n * sympy.expand_complex(out ** (n + 1)) * length
    return sympy.simplify(total / 2)


def _solves(found: Any, start: Any, integrand: Any) -> dict[str, Any]:
    # The integral of the derivative along s is 0, and the weight s is -d/dZ.
    weight = sympy.expand(sympy.diff(integrand, s) / integrand)
    equation = sum(weight.coeff(s, n) * (-1) ** n * sympy.diff(found, Z, n) for n in range(3))
    equations = {
        "the differential equation": sympy.expand(equation),
        "the weight s is minus the derivative by Z": sympy.simplify(
            sympy.diff(integrand, Z) / integrand + s
        ),
    }
    for n, wanted in enumerate(start):
        here = sympy.diff(found, Z, n).subs(Z, 0) - wanted
        swap = 2 * sympy.pi / (sympy.sqrt(3) * sympy.gamma(sympy.Rational(1, 3)))
        equations[f"derivative {n} at 0"] = sympy.simplify(
            here.subs(sympy.gamma(sympy.Rational(2, 3)), swap)
        )
    return equations


def _weighted(one: Any) -> list[Any]:
    """int (a + b s) e^(-+ lam V) ds from I(Z) = int e^(s^3/3 - Z s) ds: s = small sigma."""
    # The weight s is -d/dZ; e^(lam V) has -s in place of s.
    return [
        sympy.expand(a * one * small - sign * b * sympy.diff(one, Z) * small**2) for sign in (-1, 1)
    ]


def _double(J: Any, J_1: Any, J_2: Any) -> Any:
    """(a + b s(u))(a + b s(v)), with s = small sigma."""
    cross = a * b * small**3 * (J_1 - J_1)
    return sympy.expand(a**2 * J * small**2 + cross + b**2 * J_2 * small**4)


def _as_numbers(found: Any, stated: Any) -> dict[str, Any]:
    return {
        f"integral {k}": sympy.expand(e.subs(known) - whole)
        for k, (e, whole) in enumerate(zip(found, stated, strict=True), 1)
    }


def _one_order_lower(found: Any) -> dict[str, Any]:
    """What is left is a derivative, of +-H e^(-+lam V)/lam."""
    equations = {}
    for sign, lower in zip((1, -1), found, strict=True):
        exponential = sympy.exp(sign * lam * (s**3 / 3 - zeta * s))
        whole = sign * sympy.diff(H * exponential, s) / (lam * exponential)
        equations[f"of e^({'-' if sign > 0 else ''}lam V)"] = sympy.expand(
            (s**2 - zeta) * H - lower - sympy.expand(whole)
        )
    return equations


def _next_weight(lower: Any) -> Any:
    """Two terms of H, with E for (s^2 - zeta)^k, in what stands for (s^2 - zeta) H."""
    p_1, E, step = Symbol("p_1", real=True), Function("E")(s), s**2 - zeta
    terms = (p_1 + q_1 * s) * E + (p_2 + q_2 * s) * E * step
    weight = (lam * (lower[1] - lower[0]) / 2).subs(H, terms).doit()
    weight = weight.subs(sympy.diff(E, s), 2 * k * s * E / step) * step / E
    # Orders k - 1, k and k + 1.
    above, _ = sympy.div(sympy.expand(sympy.simplify(weight)), step, s)
    _, found = sympy.div(above, step, s)
    return [sympy.expand(found).coeff(s, n) for n in range(2)]


def _factors(found: Any, J: Any, J_1: Any, J_2: Any) -> dict[str, Any]:
    """The double integral with both weights; s(u) has the share of s(v), with the other sign."""
    whole = a * a_up * J + (a * b_up - b * a_up) * J_1 + b * b_up * J_2
    slopes = sympy.diff(ai, Z), sympy.diff(bi, Z)
    products = ai**2 + bi**2, ai * slopes[0] + bi * slopes[1], slopes[0] ** 2 + slopes[1] ** 2
    stated = sum(factor * f for factor, f in zip(found, products, strict=True))
    return {"both weights": sympy.expand(sympy.pi**2 * stated - whole)}


def _with_both(found: Any, factors: Any, products: Any) -> Any:
    """The double integral with both weights, s = small sigma, less the factors times `found`."""
    swap = known | {CROSS: ai * sympy.diff(ai, Z) + bi * sympy.diff(bi, Z)}
    J, J_1, J_2 = (small ** (n + 2) * e for n, e in enumerate(products))
    whole = a * a_up * J + (a * b_up - b * a_up) * J_1 + b * b_up * J_2
    stated = sum(factor * e for factor, e in zip(factors, found, strict=True))
    return sympy.expand(stated.subs(swap) - whole)


# -- a barrier before an end -----------------------------------------------------------------------

lam = Symbol("lam", positive=True)
t = Symbol("t", positive=True)
gap = Symbol("gap", positive=True)
bottom, area = Symbol("bottom", positive=True), Symbol("area", positive=True)
first, second = Symbol("first", real=True), Symbol("second", real=True)
value = Symbol("value", positive=True)
mean = Symbol("mean", positive=True)
peak, rest = Symbol("peak", positive=True), Symbol("rest", real=True)
tail, dawson = Symbol("tail", positive=True), Symbol("dawson", positive=True)
integral = Symbol("integral", real=True)
beyond, _sigma, _D, _area = (Function(name) for name in ("rho", "sigma", "D", "area"))
a_down, weights = Symbol("a_down", real=True), Symbol("weights", real=True)
b_down = Symbol("b_down", real=True)
_B, _B_down = Function("B")(t), Function("B_down")(t)


@derives("truncated-gaussian", "A barrier before an end, to leading order")
def truncated_gaussian(d: Any) -> None:
    d.suppose("phi = x psi(x) > 0 from the barrier x = 0 to the end x = g; V(0) - V(x) = t^2/2")
    d.suppose("sigma' = lam t sigma - 1, D' = 1 - lam t D (DLMF 7.2), from D = 0 at t = 0")
    distance = d.step(
        "t at the end",
        "integrate",
        gap * sympy.sqrt(2 * area),
        Satisfies(
            lambda found: (
                {
                    "the fall of V": found**2 / 2 - gap**2 * area,
                    "t > 0": sympy.sqrt(found**2) - found,
                }
                | _falls()
            )
        ),
        "a is the integral of y psi(g y) over (0, 1)",
        left="t",
    )
    width = d.step(
        "du/dt at the barrier",
        "take limit",
        1 / sympy.sqrt(bottom),
        Satisfies(
            lambda found: {
                "phi du = t dt": bottom * found * t * found - t,
                "u grows with t": sympy.sqrt(found**2) - found,
            }
        ),
        "phi = psi(0) u and u = p t beside it, p being this",
        left=r"p = \frac{du}{dt} \big|_{t = 0}",
    )
    d.step(
        "mean of psi",
        "evaluate",
        sympy.sqrt(2 * area * bottom),
        Satisfies(lambda found: {"t/(p g)": found - distance / (width * gap)}),
        "phi(g) is g psi(g), and p/t is 1/g over this",
        left=r"\bar\psi",
    )
    beside = d.step(
        "1/phi less the barrier's pole",
        "evaluate",
        (first * bottom - 2 * bottom * second - gap * second**2) / (value * mean * (value + mean)),
        Satisfies(_cancelled),
        "psi(g) = psi(0) + g psi_2, 2 a = psi(0) + g psi_1: nothing cancels",
        left=r"\frac{1}{\phi(g)} - \frac{p}{t}",
    )
    d.step(
        "close to the barrier",
        "take limit",
        (-2 * second / (3 * bottom**2), 5 * second**2 / (6 * bottom ** sympy.Rational(7, 2))),
        Satisfies(lambda found: _next_slopes(found, width, beside)),
        "rho(0) and rho'(0) of u' = p + t rho(t), where psi is a straight line and the end near",
        left=(
            r"\rho(0)",
            r"\rho'(0)",
        ),
    )
    barrier = d.step(
        "a barrier to every order",
        "integrate",
        (a * tail, a_down * dawson, weights * integral - a_down * dawson * b),
        Satisfies(lambda found: _to_every_order(found, 1, _D)),
        "by parts u' is a + lam t B - B' for e^(-lam t^2/2) and c + lam t E + E' for "
        "e^(lam t^2/2), a, c and B, E series in 1/lam; w = a c, L is the integral of D; what is "
        "left is analytic at the barrier",
        left=(
            r"\int_t^\infty e^{\lambda (t^2 - s^2)/2} u'(s) \, ds - B",
            r"\int_0^t e^{\lambda (s^2 - t^2)/2} u'(s) \, ds - E",
            r"\int u' (c D + E) \, dt \simeq",
        ),
    )
    well = d.step(
        "a well to every order",
        "integrate",
        (-a_down * dawson, -a * tail, -weights * integral - a * tail * b_down),
        Satisfies(lambda found: _to_every_order(found, -1, _sigma)),
        "as before, L now the integral of sigma",
        left=(
            r"E - \int_0^t e^{\lambda (s^2 - t^2)/2} u'(s) \, ds",
            r"B - \int_t^\infty e^{\lambda (t^2 - s^2)/2} u'(s) \, ds",
            r"-\int u' (a \sigma + B) \, dt \simeq",
        ),
    )
    parts = d.step(
        "by parts",
        "integrate",
        tuple(sign * _exponential(sign) * beyond(t) / lam for sign in (-1, 1)),
        Satisfies(
            lambda found: {
                f"rho' over lam is left of e^({'-' if sign < 0 else ''}lam t^2/2)": sympy.diff(e, t)
                - (t * beyond(t) + sign * sympy.diff(beyond(t), t) / lam) * _exponential(sign)
                for sign, e in zip((-1, 1), found, strict=True)
            }
        ),
        "u' = p + t rho(t)",
        left=(
            r"\int \left(t \rho(t) - \frac{\rho'(t)}{\lambda}\right) e^{-\lambda t^2/2} \, dt",
            r"\int \left(t \rho(t) + \frac{\rho'(t)}{\lambda}\right) e^{\lambda t^2/2} \, dt",
        ),
    )
    single = d.step(
        "single integrals",
        "substitute",
        (-(peak * tail + rest / lam), peak * dawson + rest / lam),
        Satisfies(lambda found: _single(found, parts) | _first(found, barrier, well)),
        "the first terms, a = c = p and B = E = q/lam with q = rho(t) at the end, in units of "
        "e^(-+lam t^2/2); what is left is rho' over lam",
        left=(
            "I_{+}",
            "I_{-}",
        ),
    )
    both = d.step(
        "both",
        "integrate",
        peak**2 * (integral - sympy.log(t)) / lam - peak * dawson * rest / lam,
        Satisfies(lambda found: _nested(found) | _first_both(found, barrier, well)),
        "L is the integral of lam D from 0 on; the regular part is that of 1/phi over lam",
        left="I_{+-}",
    )
    d.conclude(
        (Symbol("I_up"), Symbol("I_down"), Symbol("I_both")),
        (*single, both),
        "relative O(1/lam)",
        note="contributions of the end to the integrals of e^(lam V) and e^(-lam V) up to "
        "it, and of "
        "e^(lam (V(v) - V(u))) over u < v, in units of e^(+-lam V) there; sigma is "
        "e^(lam t^2/2) int e^(-lam s^2/2) ds from t on, D is Dawson's integral, L that of lam D",
    )


def _falls() -> dict[str, Any]:
    """V falls by the integral of x psi(x), power by power, x = g y."""
    k, c = Symbol("k", positive=True), Symbol("c", real=True)
    inner = sympy.integrate(c * x ** (k + 1), (x, 0, gap))
    return {"x = g y": inner - gap**2 * sympy.integrate(c * x * (gap * x) ** k, (x, 0, 1))}


def _cancelled(found: Any) -> dict[str, Any]:
    """The difference to 1/phi(g) - peak/t, modulo mean^2 = 2 area psi(0)."""
    gap_to = found - (1 / (gap * value) - 1 / (gap * mean))
    top = sympy.numer(sympy.together(gap_to)).subs(value, bottom + gap * second)
    return {
        "1/phi(g) - p/t": sympy.rem(
            sympy.expand(top), mean**2 - bottom * (bottom + gap * first), mean
        )
    }


def _exponential(sign: int) -> Any:
    return sympy.exp(sign * lam * t**2 / 2)


def _along(e: Any) -> Any:
    """`e` as a function of t: D, sigma, lam int D and rho change with it."""
    return e.subs({tail: _sigma(t), dawson: _D(t), integral: _area(t), rest: beyond(t)})


def _to_every_order(found: Any, inward: int, of_area: Any) -> dict[str, Any]:
    """Both integrands, and the regular part's: its products with D or sigma are those found."""
    here = {
        tail: _sigma(t), dawson: _D(t), integral: _area(t), b: _B, b_down: _B_down,
        weights: a * a_down,
    }  # fmt: skip
    slopes = {
        sympy.diff(_sigma(t), t): lam * t * _sigma(t) - 1,
        sympy.diff(_D(t), t): 1 - lam * t * _D(t),
        sympy.diff(_area(t), t): of_area(t),
    }
    up, down, regular = (e.subs(here) for e in found)
    by_sigma, by_dawson = (up, down) if inward > 0 else (-down, -up)
    weight = a + lam * t * _B - sympy.diff(_B, t)
    weight_down = a_down + lam * t * _B_down + sympy.diff(_B_down, t)

    def slope_of(e: Any) -> Any:
        return sympy.diff(e, t).subs(slopes)

    by_sigma, by_dawson = by_sigma + _B, by_dawson + _B_down
    left_out = sympy.expand(weight * by_dawson if inward > 0 else -weight_down * by_sigma)
    left_out = sympy.expand(left_out - slope_of(regular))
    return {
        "e^(-lam t^2/2)": sympy.expand(slope_of(by_sigma) - lam * t * by_sigma + weight),
        "e^(lam t^2/2)": sympy.expand(slope_of(by_dawson) + lam * t * by_dawson - weight_down),
        "the regular part has D": left_out.coeff(_D(t)),
        "the regular part has sigma": left_out.coeff(_sigma(t)),
    }


def _first_terms(barrier: Any, well: Any) -> Iterator[tuple[str, Any]]:
    """A barrier's pieces to first order: its own, and a well's with the sign of lam changed."""
    mirror = {
        tail: -dawson, dawson: -tail, integral: -integral, a: a_down, a_down: a, b_down: -b,
    }  # fmt: skip
    first = {a: peak, a_down: peak, weights: peak**2, b: rest / lam, integral: integral / lam}
    for name, pieces in {
        "barrier": barrier,
        "well": [e.subs(mirror, simultaneous=True) for e in well],
    }.items():
        yield name, [e.subs(first) for e in pieces]


def _first(found: Any, barrier: Any, well: Any) -> dict[str, Any]:
    """What is beyond the end, and what is before it, less rho over lam."""
    return {
        f"{way} of a {name}": e
        for name, (up, down, _) in _first_terms(barrier, well)
        for way, e in {
            "beyond": found[0] + up + rest / lam,
            "before": found[1] - down - rest / lam,
        }.items()
    }


def _first_both(found: Any, barrier: Any, well: Any) -> dict[str, Any]:
    """The iterated integral but for the logarithm, which the regular part leaves."""
    logarithm = peak**2 * sympy.log(t) / lam
    return {
        f"of a {name}": sympy.expand(found + logarithm - regular)
        for name, (*_, regular) in _first_terms(barrier, well)
    }


def _changed(e: Any) -> Any:
    """The derivative of that by t."""
    slopes = {
        _sigma(t): lam * t * _sigma(t) - 1, _D(t): 1 - lam * t * _D(t), _area(t): lam * _D(t),
    }  # fmt: skip
    changed = sympy.diff(_along(e), t)
    return changed.subs({sympy.diff(f, t): slope for f, slope in slopes.items()})


def _single(found: Any, parts: Any) -> dict[str, Any]:
    """The peak's integral and what by parts gives, each divided by the Gaussian."""
    return {
        f"e^({'-' if sign < 0 else ''}lam t^2/2)": sympy.expand(
            _changed(e) + sign * lam * t * _along(e)
            - peak - sympy.diff(part, t) / _exponential(sign)
        )
        for sign, e, part in zip((-1, 1), found, parts, strict=True)
    }  # fmt: skip


def _next_slopes(found: Any, width: Any, beside: Any) -> dict[str, Any]:
    """phi du = t dt to the third power of t, and what is left of 1/phi as the end comes near."""
    at = width * t + found[0] * t**2 / 2 + found[1] * t**3 / 3
    whole = sympy.expand(at * (bottom + second * at) * sympy.diff(at, t) - t)
    # The mean of 2 y (psi(g y) - psi(0))/g over (0, 1).
    slope_of = second * sympy.integrate(2 * y**2, (y, 0, 1))
    line = {
        first: slope_of,
        value: bottom + gap * second,
        mean: sympy.sqrt(bottom * (bottom + gap * slope_of)),
    }
    near = beside.subs(line) - found[0] - found[1] * gap / width
    return {
        "t^2": whole.coeff(t, 2),
        "t^3": whole.coeff(t, 3),
        "g = 0": near.subs(gap, 0),
        "its slope in g": sympy.simplify(sympy.diff(near, gap).subs(gap, 0)),
    }


def _nested(found: Any) -> dict[str, Any]:
    whole = peak + t * beyond(t)
    inner = peak * _D(t) + beyond(t) / lam
    # du/phi = u'^2 dt/t: the regular part; rho' has a factor 1/lam more.
    rest_of = whole**2 / (t * lam) + peak * _D(t) * sympy.diff(beyond(t), t) / lam
    return {
        "u' M": sympy.expand(whole * inner - _changed(found) - rest_of),
        "the logarithm from t = 1 on": found.subs({t: 1, integral: 0, rest: 0}),
    }
