r"""Section 6.1: how much of the time is spent in the layer when sliding."""

from fractions import Fraction

import sympy
from sympy import Derivative, Integral, Limit, exp, oo, pi, sqrt

from derivations.numerics import SLIDING as SCENE
from derivations.numerics import Scene, integral, outside, outside_share, uniform
from derivations.paper import V_1, N, V, a_minus, kappa, lam, u
from derivations.paper import a_plus as crossing
from derivations.paper import a_plus_sliding as a_plus
from symasym.derivation.derivation import derives

# V(1) = 10^-6: both tails weigh in.
BOTH_TAILS = Scene((Fraction(1, 4) - Fraction(1, 2 * 10**6), Fraction(-1), Fraction(-3, 4)))
I_left, I_right, K, M, L, P, K_m, e, s, gap = sympy.symbols(
    r"I_left I_right K M L P K_m e s \delta", positive=True)
V_m, m_1 = sympy.symbols("V_m m_1", real=True)
tails = kappa**2 / (2 * a_minus) - kappa**2 / (2 * a_plus) * exp(-lam * V_1)
OF_N = r"$N$ is the integral of $e^{-2 V/\kappa^2}$ over the layer"


def occupation(k, ctx):
    """P for kappa that is not small."""
    inside = integral(ctx, lambda x: ctx.exp(-2 * SCENE.V(ctx, x) / k**2), uniform(ctx, -1, 1, 1))
    return inside / (inside + outside(ctx, SCENE, k))


@derives("tails", "The two tail integrals of the steady state")
def tail_integrals(d):
    d.suppose("$a^- > 0$ and $a^+ < 0$ (attracting sliding); otherwise a tail diverges")
    weight = lambda side: sympy.expand(exp(-lam * d["eq:V2", side].subs(crossing, a_plus)))
    d.eq("left", I_left, kappa**2 / (2 * a_minus), by=Integral(weight("left"), (u, -oo, -1)))
    d.eq("right", I_right, -kappa**2 / (2 * a_plus) * exp(-lam * V_1), by=Integral(weight("right"), (u, 1, oo)))
    d.conclude("left", "right")


@derives("eq:P", "The occupation probability from the steady state")
def probability(d):
    beside = sympy.simplify(d["eq:pss"] * exp(lam * V(u)))
    constant = d.eq("normalise", K, 1 / (N + M), "the total mass is 1", [(beside * (N + M), 1)])
    d.eq("mass inside", P, N / (N + M), by=(beside * N).subs(K, constant))
    d.conclude(note=r"$N$ and $M$ are the integrals of $e^{-2 V/\kappa^2}$ inside and outside the layer")


@derives("eq:P2", "The occupation probability by the integral over the layer")
def probability_closed(d):
    d.eq("divide through", P, 1 / (1 + tails / N), "the mass outside the layer is that of the two tails",
         by=d["eq:P"].subs(M, sum(d["tails"])))
    d.conclude(note=OF_N)


@derives("eq:Plarge2", "Occupation in strong noise")
def strong(d):
    d.suppose(r"$\kappa \gg 1$")
    series = d["eq:P2"].subs(kappa, sqrt(2 / e)).subs(N, 2 - e * m_1)
    slope = d.eq("coefficient of 2/kappa^2", Limit(series / e, e, 0), 2 / (1 / a_minus - 1 / a_plus),
                 r"with $e = 2/\kappa^2$, $N = 2 - e m_1 + \ldots$, where $m_1$ is the integral of $V$ over the "
                 "layer")
    d.order("remainder", P, slope * lam, kappa**-4, occupation, ("1e3", "1e4"), {a_minus: "3/2", a_plus: "-1/2"},
            r"measured for a friction drift as $\kappa \to \infty$")


@derives("L-bound", "A lower bound on the occupation for any noise")
def lower_bound(d):
    right = Derivative(d["eq:V2", "right"].subs(crossing, a_plus), u).doit()
    d.suppose("$V'(1) = -a^+ > 0$, so $V < V(1)$ on some interval $(1 - L, 1)$, whatever the sign of $V(1)$",
              lambda: bool(right.is_positive))
    below = d.bound("integrand on (1 - L, 1)", exp(-lam * V(u)), ">=", exp(-lam * V_1), "",
                    exp(-lam * V_1) * (exp(lam * gap) - 1), on={gap: V_1 - V(u)})
    floor = d.eq("its integral", Integral(below, (u, 1 - L, 1)), L * exp(-lam * V_1), "it is at most $N$")
    d.bound("N replaced by its lower bound", P, ">=",
            1 / (1 + kappa**2 / (2 * L) * (exp(lam * V_1) / a_minus - 1 / a_plus)), "$P$ grows with $N$",
            s * tails / ((floor + s + tails) * (floor + tails)), on={P: d["eq:P2"], s: N - floor})
    d.suppose(r"$V(1) \le 0$, which is only used to bound the exponential by 1; otherwise reflect $u \to -u$")
    d.conclude(error="a lower bound", note=r"$V \le V(1)$ on $(1 - L, 1)$")


@derives("eq:Psmall2", "Occupation in weak noise: $1 - P$ is exponentially small")
def weak(d):
    d.suppose(r"$\kappa \ll 1$, and there is one lowest well inside the layer, with $V''(u_m) > 0$")
    layer = d.eq("Laplace's method for N", r"N \sim", kappa * sqrt(pi / K_m) * exp(-lam * V_m),
                 by=exp(-lam * V_m) * Integral(exp(-K_m * u**2 / kappa**2), (u, -oo, oo)))
    leading = d.eq("tails over N", r"1/P - 1 \sim", kappa * sqrt(K_m) / (2 * sqrt(pi)) * (
        exp(lam * V_m) / a_minus - exp(lam * (V_m - V_1)) / a_plus), "this is $1 - P$ to this order",
        by=(1 / d["eq:P2"] - 1).subs(N, layer))
    of = lambda f: lambda k, ctx: f(ctx, BOTH_TAILS.roots(ctx)[0])
    at = {a_minus: of(lambda ctx, x: BOTH_TAILS.end(ctx, -1)), a_plus: of(lambda ctx, x: BOTH_TAILS.end(ctx, 1)),
          V_1: of(lambda ctx, x: BOTH_TAILS.V(ctx, ctx.mpf(1))), V_m: of(BOTH_TAILS.V),
          K_m: of(lambda ctx, x: -BOTH_TAILS.phi(ctx, x, 1))}
    d.order("sharp form", 1 - P, leading, leading * kappa**2, lambda k, ctx: outside_share(BOTH_TAILS, k, ctx),
            ("1e-2", "1e-3"), at, r"the paper has $P = 1 + O(\kappa^2)$, which follows from 'L-bound'")
    d.conclude(note="$u_m$ is the lowest point of $V$")
