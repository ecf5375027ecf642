r"""Section 6.2, end: the Stokes multiplier, and the way back to unscaled time."""

from fractions import Fraction

import sympy
from sympy import Integral, Limit, Symbol, airyai, airybi, erf, exp, log, oo, pi, sqrt

from derivations.numerics import Scene, integral, split_pieces, well_integral
from derivations.paper import T, a_plus, eps, kappa, r, t_physical, u2
from derivations.sections.section6.well import A1, A2, V_1, a, about, at_scene
from symasym.derivation.derivation import derives

SMOOTH = Scene((Fraction(2, 3), Fraction(1, 2)))
BEHIND = Scene((Fraction(8, 25), Fraction(18, 5), Fraction(4)))
AT_TOP = Scene((Fraction(0), Fraction(3, 2), Fraction(27, 8), Fraction(3, 8)))
S, s = sympy.symbols("S s", positive=True)
phi_0 = Symbol("phi_0", positive=True)
V_0, Z = sympy.symbols("V_0 Z", real=True)


def exact_behind(k, ctx):
    """lam times e^{lam V(v)} over v in (0, 1), the inner integral over the whole well."""
    lam, begin = 2 / k**2, BEHIND.V(ctx, ctx.zero)
    step = 4 / (lam * BEHIND.phi(ctx, ctx.zero))
    ends = [j * step for j in range(30) if j * step < 1]
    outer = integral(ctx, lambda x: ctx.exp(lam * (BEHIND.V(ctx, x) - begin)), ends)
    return lam * about(BEHIND, 0, -1, 0, k, ctx) * outer * ctx.exp(lam * begin)


@derives("eq:S", "The Stokes multiplier of a well, and how it changes as the barrier passes 0 or a well is born")
def stokes(d):
    d.suppose("crossing to the right, and $A$ has no zeros but $u_1$ and $u_2$, or none")
    d.suppose("for $u_2 < 0$ no term of $T$ is exponentially large",
              fails=r"$A = 4 (u + 4/5)(u + 1/10)$ with $\kappa = 1/20$ and start 0")
    d.suppose(r"for $A > 0$ it is linear in the layer; else $\int_0^1 du/A$ replaces the term with the logarithm")
    whole = d["eq:Ttildesmall"]
    well = whole.subs(r, 0)
    d.order("no well", r"T|_{A > 0} =",
            sympy.expand(whole - well) + log(a_plus / phi_0) / (a_plus - phi_0) - 1 / a_plus, kappa**2,
            lambda k, ctx: sum(split_pieces(ctx, SMOOTH, k, ctx.mpf(10))), ("1e-1", "5e-2"),
            {a_plus: "7/6", phi_0: "2/3", r: "10"}, "measured for the linear drift $A = 2/3 + u/2$; the $O(1)$ "
            "term is the integral of $1/A$ over $(0, 1)$ minus $1/a^+$", digits=30)
    behind = kappa * sqrt(-pi / A1) / phi_0 * exp(2 * (V_0 - V_1) / kappa**2)
    start = {phi_0: lambda k, ctx: BEHIND.phi(ctx, ctx.zero), V_0: lambda k, ctx: BEHIND.V(ctx, ctx.zero)}
    d.order("start behind the barrier", r"T|_{u_2 < 0} =", behind, behind * kappa**2, exact_behind,
            ("1e-2", "1e-3"), at_scene(BEHIND) | start, "a well exists and $S = 0$ by the paper's condition, "
            "but $T$ is exponentially large if $V(0) > V(u_1)$")
    on_top = d.order("start on the barrier", T, well / 2, well * kappa,
                     lambda k, ctx: well_integral(ctx, AT_TOP, k), ("1e-3", "1e-4"), at_scene(AT_TOP),
                     r"it is half of the well's term, now with an $O(\kappa)$ correction, so there is no jump")
    begin, weight = d["laplace-substitution", "v at its lower limit"], exp(-A2 * a**2)
    beyond = Integral(weight, (a, begin, oo)) / Integral(weight, (a, -oo, oo))
    share = d.eq("barrier near the start", S, (1 + erf(sqrt(A2) * u2 / kappa)) / 2,
                 r"for $u_2 = O(\kappa)$ it is the share of the barrier's Gaussian that lies beyond the start, "
                 r"$-u_2/\kappa$", by=beyond.doit().rewrite(erf))
    for name, sign, place, value in (("barrier ahead", ">", s, 1), ("barrier at the start", "=", 0, on_top / well),
                                     ("barrier behind", "<", -s, 0)):
        d.eq(name, f"S|_{{u_2 {sign} 0}} =", value, r"the limit for a fixed $u_2$ as $\kappa \to 0$",
             by=Limit(share.subs(u2, place), kappa, 0))
    J = d["airy-form", "J"]
    G = lambda z: airyai(z)**2 + airybi(z)**2
    d.eq("near the fold", "S_f(Z) =", G(Z) / (G(Z) + G(-Z)), "it is $J(Z)$ of 'airy-form' divided by "
         r"$J(Z) + J(-Z)$, which is even in $Z$; $T$ contains $p^2 \lambda^{1/3} J(Z)$, which is finite at the "
         r"fold, where $S_f = 1/2$; $S_f \to 1$ for $Z \gg 1$",
         by=J / (J + J.subs(Z, -Z)))
    d.conclude("barrier ahead", "barrier at the start", "barrier behind", "barrier near the start",
               "near the fold", "no well", "start behind the barrier", error=r"leading order in $\kappa$", note=(
        "$S$ as a function of $u_2$ multiplies the well's term of eq:Ttildesmall, and is uniform as the barrier "
        "passes the start, $u_2 = 0$; for $u_2 < 0$ another term may be large. Without a well, $A > 0$ and $S = "
        "0$. $S_f(Z)$ is another multiplier, uniform through the fold of well and barrier, where the well's term "
        r"diverges. It multiplies $\pi^2 p^2 \lambda^{1/3} (G(Z) + G(-Z))$ with $G = \mathrm{Ai}^2 + "
        r"\mathrm{Bi}^2$, which is finite at the fold and, for $Z \gg 1$, equals the well's term to leading "
        r"order in $\zeta$. In this factor $p = du/ds$ at the midpoint of the zeros, "
        r"$\phi\,du = (s^2 - \zeta)\,ds$ and $Z = \lambda^{2/3} \zeta$, as in 'airy-form'"))


@derives("eq:TtildetoT", "The escape time in unscaled time")
def unscaled(d):
    d.suppose(r"$\kappa$ is bounded from below; in weak noise an $O(r_p)$ error of $V$ is divided by $\kappa^2$ "
              "in an exponent")
    d.eq("time", Symbol("T_phys", positive=True), eps * T, "the mean of the time is scaled like the time",
         lambda real: [(d["eq:tildexykappa", "t"].subs(t_physical, real), T)])
    d.conclude(error="relative $O(r_p)$, like the error of $a^+$")
