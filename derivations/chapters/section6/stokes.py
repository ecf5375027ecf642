r"""Section 6.2, end: the Stokes multiplier, and the way back to unscaled time."""

from fractions import Fraction

import sympy
from sympy import Integral, Limit, Rational, Symbol, airyai, airybi, erf, exp, log, oo, pi, sqrt

from derivations.chapters.section6.well import A1, A2, V_1, a, about, at_scene
from derivations.numerics import Scene, integral, split_pieces, well_integral
from derivations.paper import T, a_plus, eps, kappa, r, t, u2
from symasym.derivation.derivation import derives

SMOOTH = Scene((Fraction(2, 3), Fraction(1, 2)))
BEHIND = Scene((Fraction(8, 25), Fraction(18, 5), Fraction(4)))
AT_TOP = Scene((Fraction(0), Fraction(3, 2), Fraction(27, 8), Fraction(3, 8)))
S, far, c, rho, s = sympy.symbols(r"S Z c \rho s", positive=True)
phi_0, t_s = sympy.symbols("phi_0 t_s", positive=True)
V_0, Z = sympy.symbols("V_0 Z", real=True)


def exact_behind(k, ctx):
    """lam times e^{lam V(v)} over v in (0, 1), the inner integral over the whole well."""
    lam, begin = 2 / k**2, BEHIND.V(ctx, ctx.zero)
    step = 4 / (lam * BEHIND.phi(ctx, ctx.zero))
    outer = integral(ctx, lambda x: ctx.exp(lam * (BEHIND.V(ctx, x) - begin)), [j * step for j in range(30) if j * step < 1])
    return lam * about(BEHIND, 0, -1, 0, k, ctx) * outer * ctx.exp(lam * begin)


def switched_on(Z, ctx):
    """G(Z)/(G(Z) + G(-Z)) with G = Ai^2 + Bi^2."""
    there, back = (ctx.airyai(x) ** 2 + ctx.airybi(x) ** 2 for x in (Z, -Z))
    return there / (there + back)


@derives("eq:S", "The Stokes multiplier of a well, and how it changes as the barrier passes 0 or a well is born")
def stokes(d):
    d.suppose("for $u_2 < 0$ no term of $T$ is exponentially large", fails="$A = 4 (u + 4/5)(u + 1/10)$, "
              r"$\kappa = 1/20$, start at 0")
    whole = d["eq:Ttildesmall"]
    well = whole.subs(r, 0)
    d.order("no well: S = 0", T, sympy.expand(whole - well) + log(a_plus / phi_0) / (a_plus - phi_0) - 1 / a_plus, kappa**2,
            lambda k, ctx: sum(split_pieces(ctx, SMOOTH, k, ctx.mpf(10))), ("3e-2", "1e-2"),
            {a_plus: "7/6", phi_0: "2/3", r: "10"}, "for the linear $A = 2/3 + u/2$; the $O(1)$ is the integral of "
            "$1/A$ over $(0, 1)$ less $1/a^+$", digits=40)
    behind = kappa * sqrt(-pi / A1) / phi_0 * exp(2 * (V_0 - V_1) / kappa**2)
    start = {phi_0: lambda k, ctx: BEHIND.phi(ctx, ctx.zero), V_0: lambda k, ctx: BEHIND.V(ctx, ctx.zero)}
    d.order("u2 < 0: start behind the barrier", T, behind, behind * kappa**2, exact_behind, ("1e-2", "1e-3"),
            at_scene(BEHIND) | start, "a well exists, $S = 0$ by the paper's condition, and yet $T$ is exponentially large "
            "if $V(0) > V(u_1)$")
    d.order("u2 = 0: start on the barrier", T, well / 2, well * kappa, lambda k, ctx: well_integral(ctx, AT_TOP, k),
            ("1e-3", "1e-4"), at_scene(AT_TOP), r"half the well's term, now with an $O(\kappa)$ correction: no jump")
    begin, weight = d["laplace-substitution", "v at its lower limit"], exp(-A2 * a**2)
    beyond = Integral(weight, (a, begin, oo)) / Integral(weight, (a, -oo, oo))
    share = d.eq("u2 near 0: the barrier passes the start", S, (1 + erf(sqrt(A2) * u2 / kappa)) / 2, "the share of the "
                 r"barrier's Gaussian beyond the start, $-u_2/\kappa$; $u_2 = O(\kappa)$", by=beyond.doit().rewrite(erf))
    for name, place, value in (("u2 > 0", s, 1), ("u2 = 0", 0, Rational(1, 2)), ("u2 < 0", -s, 0)):
        d.eq(name, Limit(share.subs(u2, place), kappa, 0), value, r"$\kappa \to 0$")
    J = d["airy-form", "J"]
    G = lambda z: airyai(z)**2 + airybi(z)**2
    fold = d.eq("near the fold: well and barrier coalesce", r"S(Z) =", G(Z) / (G(Z) + G(-Z)), "$J(Z)$ of airy-form over "
                r"$J(Z) + J(-Z)$, which is even in $Z$; $T$ has $p^2 \lambda^{1/3} J(Z)$, finite on the fold",
                by=J / (J + J.subs(Z, -Z)))
    d.eq("on the fold", "S(0) =", Rational(1, 2), by=fold.subs(Z, 0))
    d.order("beyond the fold", "S(Z)", sympy.S.One, exp(-4 * far**Rational(3, 2) / 3), switched_on, ("16", "25"), {},
            "1 with a well, and 0 before the fold, where $Z < 0$", digits=120)
    d.conclude("u2 > 0", "u2 = 0", "u2 < 0", "u2 near 0: the barrier passes the start",
               "near the fold: well and barrier coalesce", error=r"leading order in $\kappa$",
               note="$S$ of $u_2$ is uniform through $u_2 = 0$ and multiplies the well's term of eq:Ttildesmall, as the "
               "barrier passes the start; for $u_2 < 0$ another term may be large. Without a well, $A > 0$ on the layer, "
               "$S = 0$. $S(Z)$ is another multiplier, uniform through the fold of well and barrier, where that term "
               r"diverges: it multiplies $\pi^2 p^2 \lambda^{1/3} (G(Z) + G(-Z))$, $G = \mathrm{Ai}^2 + \mathrm{Bi}^2$, which "
               r"is finite there and for $Z \gg 1$ is that term to leading order in $\zeta$. Here $p = du/ds$ half-way "
               r"between the zeros, $\phi\,du = (s^2 - \zeta)\,ds$ and $Z = \lambda^{2/3} \zeta$, as in airy-form")


@derives("eq:TtildetoT", "Back to unscaled time")
def unscaled(d):
    d.suppose(r"$\kappa$ bounded from below: in weak noise an $O(r_p)$ error of $V$ is divided by $\kappa^2$ in an exponent")
    leading = d["eq:Ttildelarge"]
    relative = leading.subs(a_plus, a_plus * (1 + c * rho)) / leading
    d.eq("error of the coefficients", r"a^+/(a^+ (1 + c \rho)) - 1 \sim", -c * rho, r"a relative error $c \rho$ of $a^+$ "
         r"is a relative error $-c \rho$ of $r/a^+$ (strong noise)", by=rho * relative.diff(rho).subs(rho, 0))
    d.eq("time", Symbol("T_phys", positive=True), eps * t_s, r"$T_p = \langle t \rangle$, $\varepsilon$ times the mean "
         "scaled time", lambda real: [(d["eq:tildexykappa", "t_s"].subs(t, real), t_s)])
    d.conclude(error="relative $O(r_p)$", note="$t_s$ is the scaled escape time")
