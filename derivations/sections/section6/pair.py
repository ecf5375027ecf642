"""Section 6.2, weak noise: Airy functions for a well and a barrier that may coalesce, and for a cubic.

This is order 0 of canonical-form with two zeros, over all s; `symasym.formulas.series` writes it out.
"""

from fractions import Fraction
from functools import cache

import sympy
from sympy import Derivative, Function, Integral, Rational, S, Symbol, exp, gamma, pi, sqrt, symbols

from derivations.numerics import Scene, split_pieces
from derivations.paper import T, a_plus, alpha, kappa, mu, r, u, z0
from derivations.sections.section7_friction import BETA, PEAK
from symasym.derivation.derivation import derives

y, s, m, Z, q, w, b, psi1 = symbols(r"y s m Z q w b \psi_1", real=True)
t, zeta, sigma, R, D, delta, p, x, psi0 = symbols(r"t zeta \sigma R \Delta delta p x \psi_0", positive=True)
plus, minus, N, k, c3, lam = symbols(r"\psi_+ \psi_- \nu k c_3 lam", positive=True)
n = Symbol("n", integer=True, nonnegative=True)
J, A, third, R0 = Function("J"), Function("A"), Rational(1, 3), Symbol("R_0", real=True)
ai, bi, ai1, bi1 = (f(Z) for f in (sympy.airyai, sympy.airybi, sympy.airyaiprime, sympy.airybiprime))
canonical = s**3 / 3 - Z * s


def in_thirds(e):
    """gamma(1/6), gamma(5/6) and gamma(2/3) by gamma(1/3): duplication and reflection."""
    one, sixth = gamma(third), sqrt(3 / pi) * gamma(third)**2 / sympy.cbrt(2)
    put = {gamma(2 * third): 2 * pi / (sqrt(3) * one), gamma(S(1) / 6): sixth, gamma(S(5) / 6): 2 * pi / sixth}
    return sympy.simplify(sympy.sympify(e).subs(put))


def by_power(e, power):
    """The integral of e over (0, sympy.oo), by the variable w = power of it."""
    (z,), new = power.free_symbols, Symbol("w", positive=True)
    (old,) = (root for root in sympy.solve(power - new, z) if root.is_positive)
    inside = sympy.powsimp(sympy.expand_power_base(e.subs(z, old) * old.diff(new)))
    return sympy.integrate(inside, (new, 0, sympy.oo))


@derives("airy-form", "A well and a barrier that may coalesce, to leading order")
def airy_form(d):
    d.suppose(r"$\phi = (y^2 - \Delta) \, \psi(y)$ with $\psi > 0$, where $y$ is measured from the midpoint of "
              "the zeros; this is order 0 of 'canonical-form'")
    d.suppose("each single integral is the mean of the integrals along the two complex paths that pass the "
              "other zero")
    d.eq("height of the barrier", Symbol("D", positive=True), 4 * zeta**Rational(3, 2) / 3,
         r"$V(u_2) - V(u_1)$ determines $\zeta$", by=-Integral(s**2 - zeta, (s, -sqrt(zeta), sqrt(zeta))))
    mean = (plus + minus) / 2
    rate = ((y**2 - R**2) * (mean + (plus - minus) * y / (2 * R))).diff(y)
    up, down = (d.eq(f"du/ds at the {name}", f"u'({at}) =", sqrt(sigma / (R * value)),
        r"from $\phi \, u' = s^2 - \sigma^2$, with $\zeta = \sigma^2$, $\Delta = R^2$ and "
        r"$\psi_\pm = \psi(\pm R)$",
                     lambda e, side=side: [(e**2 * rate.subs(y, side * R), 2 * side * sigma), (sqrt(e**2), e)])
                for name, at, value, side in (("barrier", r"\sigma", plus, 1), ("well", r"-\sigma", minus, -1)))
    values, root = lambda at: up if at == sigma else down, {N: sqrt(plus * minus)}
    line = d["canonical-form", "remainder of two zeros"].replace(Function("b"), values).expand()
    for name, value, j in (("p^2", sigma * (mean + N) / (2 * R * N**2), 0),
                           ("q^2", (plus - minus)**2 / (8 * R * sigma * N**2 * (mean + N)), 1)):
        d.eq(name, f"{name} =", value, r"from $u' = p + q s$ at both zeros, with $\nu^2 = \psi_+ \psi_-$; "
             r"$\Delta$ may have either sign", lambda e, j=j: [(e.subs(root), line.coeff(s, j)**2)])
    exponent = d.eq("distance and middle", r"\lambda (V(v) - V(u)) =", Z * t - t**3 / 12 - m**2 * t,
                    "$t = s(v) - s(u)$ is the distance and $m$ the midpoint; $s$ is in units of "
                    r"$\delta = \lambda^{-1/3}$, and $Z = \lambda^{2/3} \zeta$",
                    by=canonical.subs(s, m - t / 2) - canonical.subs(s, m + t / 2))
    bare = exponent.subs(m, 0)
    inner = d.eq("over the middle", Integral(exp(Z * t - t**3 / 12 - m**2 * t), (m, -sympy.oo, sympy.oo)),
                 sqrt(pi / t) * exp(Z * t - t**3 / 12),
                 by=exp(bare) * Integral(exp(exponent - bare), (m, -sympy.oo, sympy.oo)))
    power = d.eq("the integrand is a derivative", Derivative(-4 * t * inner, t), (t**3 - 4 * Z * t - 2) * inner,
                  "the primitive is 0 at both ends, so the integral $J(Z)$ over $t$ satisfies "
                  "$J''' - 4 Z J' - 2 J = 0$")
    weight = (power / inner).expand()
    moment = d.eq("moments at Z = 0", Integral(t**n * sqrt(pi / t) * exp(-t**3 / 12), (t, 0, sympy.oo)),
                  sqrt(pi) * 12**((2 * n + 1) / S(6)) * gamma((2 * n + 1) / S(6)) / 3,
                  "these are $J$, $J'$ and $J''$ for "
                  "$n = 0, 1, 2$", by=by_power(t**n * inner.subs(Z, 0), t**3 / 12))
    both = d.eq("J", J(Z), pi**2 * (ai**2 + bi**2), "see DLMF 9.11.4", lambda f: [
        (sum(weight.coeff(t, j) * f.diff(Z, j) for j in range(4)), 0), (weight.coeff(t, 3), 1),
        *((in_thirds(f.diff(Z, j).subs(Z, 0)), in_thirds(moment.subs(n, j))) for j in range(3))])
    first = d.eq("J with s(v)", "J_1 =", pi**2 * (ai * ai1 + bi * bi1), "$J'$ contains $s(v) - s(u)$, whose two "
                 "parts are opposite by symmetry", by=Derivative(both, Z) / 2)
    second = d.eq("J with s(u) s(v)", "J_2 =", -pi**2 * (ai1**2 + bi1**2), "$J''$ contains $(s(v) - s(u))^2$, "
                  "in which $s^2$ may be replaced by $Z$ up "
                  "to the regular part", by=Z * both - Derivative(first, Z))
    slope = d.eq("one integrand is a derivative", Derivative(exp(canonical), s), (s**2 - Z) * exp(canonical),
               "the primitive is 0 at the ends of both paths, so $I'' = Z I$")
    one = sympy.powsimp(slope / exp(canonical))
    length = d.eq("a ray at Z = 0", Integral(x**n * exp(-x**3 / 3), (x, 0, sympy.oo)),
                  3**((n - 2) / S(3)) * gamma((n + 1) / S(3)), r"the rays are $s = -x$ and $s = x e^{\pm i\pi/3}$",
                  by=by_power(x**n * exp(canonical).subs({Z: 0, s: -x}), x**3 / 3))
    rays = lambda j: length.subs(n, j) * (1 + (-1)**j * sympy.cos(pi * (j + 1) / 3))
    single = d.eq("I", Function("I")(Z), pi * bi, "see DLMF 9.5.5", lambda f: [
        (sum(one.coeff(s, j) * (-1)**j * f.diff(Z, j) for j in range(3)), 0), (one.coeff(s, 2), 1),
        *((in_thirds(f.diff(Z, j).subs(Z, 0)), in_thirds(rays(j))) for j in range(2))])
    for name, sign in (("scale integral", 1), ("speed integral", -1)):
        d.eq(name, f"I_{'+' if sign > 0 else '-'} =", pi * delta * (p * bi + sign * q * delta * bi1),
             "the weight is $p + q s$, and a factor "
             "$s$ is $-d/dZ$", by=delta * p * single + sign * delta**2 * q * Derivative(single, Z))
    d.eq("double integral", "I_{+-} =",
         pi**2 * delta**2 * (p**2 * (ai**2 + bi**2) - q**2 * delta**2 * (ai1**2 + bi1**2)),
         "over $u < v$ the contributions of $s(u)$ and $s(v)$ cancel",
         by=delta**2 * (p**2 * both + p * q * delta * (first - first) + q**2 * delta**2 * second))
    d.conclude("scale integral", "speed integral", "double integral",
               note=r"these are the integrals of $e^{\lambda V}$, of $e^{-\lambda V}$ and, over $u < v$, of "
                    r"$e^{\lambda(V(v) - V(u))}$ across both zeros, with $V$ measured from the mean of its "
                    r"values at the zeros; $\delta = \lambda^{-1/3}$, $Z = \lambda^{2/3} \zeta$, and "
                    r"$u' = p + q s$ at both zeros of $s^2 - \zeta$", error=r"relative $O(1/\lambda)$")


@derives("cubic-pair", "The escape time through the fold of a cubic drift, in Airy functions")
def cubic_pair(d):
    d.suppose("the distance of the start and of the layer's end from the pair is several of its widths, and "
              r"$\psi_0 > 0$")
    cubic = c3 * ((u - b)**3 - 3 * k**2 * (u - b) + 2 * k**3 * w)
    friction = d.eq("friction", A(u), cubic.subs({b: 0, k: PEAK, c3: alpha * mu, w: (1 - z0) / BETA}),
                    r"$b = 0$, $k = u_s$, $w = (1 - z_0)/\beta$, $c_3 = \alpha\mu$", by=d["cubic"])
    turn = lambda e: 4 * ((e - b) / k)**3 - 3 * (e - b) / k
    middle = d.eq("the middle", m, b + k * sympy.cos(sympy.acos(w) / 3), "$T_{1/3}(w)$ is analytic through the "
                  r"fold $w = 1$; $b \pm k$ are the turning points", lambda e: [(turn(e), w)])
    about = d.eq("the cubic about the middle", A(m + y), (y**2 - 3 * (k**2 - (m - b)**2)) * c3 * (3 * (m - b) + y),
                 r"it is $y^2 - \Delta$ times $\psi_0 + \psi_1 y$", by=cubic.subs({u: m + y, w: turn(m)}))
    drift, height = (y**2 - R**2) * (psi0 + psi1 * y), d["airy-form", "height of the barrier"]
    scale = d.eq("zeta", zeta, psi0**(2 * third) * D, r"the barrier's height is $4 \zeta^{3/2}/3$", lambda e: [
        (height.subs(zeta, e.subs(D, R**2)), -Integral(drift, (y, -R, R)).doit())])
    pair = {plus: psi0 + psi1 * R, minus: psi0 - psi1 * R, sigma: sqrt(scale.subs(D, R**2))}
    p2 = d.eq("p^2", p**2, psi0**third * (psi0 + N) / (2 * N**2), r"with $\nu^2 = \psi_0^2 - \psi_1^2 \Delta$",
              by=d["airy-form", "p^2"].subs(pair))
    q2 = d.eq("q^2", q**2, psi1**2 / (2 * N**2 * (psi0 + N) * psi0**third), by=d["airy-form", "q^2"].subs(pair))
    part = -psi0 * sympy.atanh(R / y) / R - psi1 * sympy.log(y**2 - R**2) / 2 + psi1 * sympy.log(psi0 + psi1 * y)
    regular = d.eq("regular part", Derivative(part / (psi0**2 - psi1**2 * R**2), y), 1 / drift,
                   r"$R_0$ is the change of its finite part, in which the logarithm is that of $|y^2 - \Delta|$; "
                   r"$\mathrm{artanh}(\sqrt{x})/\sqrt{x}$ is analytic at 0")
    squares = p**2 * lam**third * (ai**2 + bi**2) - q**2 * lam**-third * (ai1**2 + bi1**2)
    formula = d.eq("escape time", T, pi**2 * squares + R0 + (r - 1) / a_plus,
                   by=lam * d["airy-form", "double integral"].subs(delta, lam**-third) + R0 + d["eq:fourthTerm2"])
    # Friction past its fold, where no part of T is exponentially larger than another.
    at = {mu: 3, alpha: 1, z0: -Rational(9, 10)}
    here = {b: 0, k: PEAK.subs(at), c3: 3, w: ((1 - z0) / BETA).subs(at)}
    here[m] = middle.subs(here)
    psi_1, psi_0, linear, _ = sympy.Poly(about.subs(here), y).all_coeffs()
    known = {psi0: psi_0, psi1: psi_1, D: -linear / psi_1, R: sqrt(-linear / psi_1)}
    known[N] = sqrt(psi_0**2 + psi_1 * linear)
    of = lambda e: str(sympy.re(e.subs(known).evalf(40)))
    scene = Scene(tuple(Fraction(str(x)) for x in sympy.Poly(friction.subs(at), u).all_coeffs()[::-1]))

    @cache
    def finite_part(_, ctx):
        """From the start to 1, the mean of the paths on either side of both zeros."""
        start, end = (ctx.mpf(of(edge - here[m])) for edge in (0, 1))
        slope = sympy.lambdify(y, regular.subs(known).evalf(40), "mpmath")
        return ctx.re(ctx.quad(slope, [start, start + ctx.j, end + ctx.j, end]))

    values = {p: of(sqrt(p2)), q: of(sqrt(q2)), R0: finite_part, r: "3", a_plus: "9/10",
              Z: lambda kappa, ctx: ctx.cbrt(4 / kappa**4) * ctx.mpf(of(scale))}
    d.order("order", T, formula.subs(lam, 2 / kappa**2), kappa**2, lambda kappa, ctx: sum(split_pieces(
        ctx, scene, kappa, ctx.mpf(3))), ("1e-1", "5e-2"), values, r"measured for friction with $\mu = 3$, "
            r"$\alpha = 1$ and $z_0 = -9/10$, past the fold; the error is relative to $T$ on both sides of the "
            "fold", digits=30)
    d.conclude("order", note=r"$A = c_3((u - b)^3 - 3 k^2 (u - b) + 2 k^3 w)$ is $(y^2 - \Delta)(\psi_0 + \psi_1 "
               r"y)$, $y = u - m$; $\nu^2 = \psi_0^2 - \psi_1^2 \Delta$, $\zeta = \psi_0^{2/3} \Delta$, $p$ and "
               r"$q$ those of airy-form, $Z = \lambda^{2/3} \zeta$; $R_0$ is the finite part of $\int du/A$ from "
               r"the start to 1; all of it is analytic in $\Delta$, the same on both sides of the fold",
               known=r"it is so for $T = O(1)$, past the fold; with a well it is relative to $T$")
