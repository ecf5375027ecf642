"""Section 3: the paper's summary, each statement derived from the full result."""

from sympy import Symbol, exp, log, pi, solve, sqrt, symbols

from derivations.paper import V_1, a_minus, a_plus, a_plus_sliding, eps, kappa, r
from derivations.paper import kappa_physical as k_p
from derivations.paper import r_physical as r_p
from symasym.derivation.derivation import derives

P = Symbol("P", positive=True)


def unscaled(d, e):
    """An expression with kappa and r in the paper's own variables."""
    scales = {kappa: ("eq:tildexykappa", "kappa"), r: "eq:tilder"}
    return e.subs({x: d[at] for x, at in scales.items() if e.has(x)})


@derives("eq:eekappar", r"The ordering of the scales implies that $r/\kappa^2$ is large")
def scales(d):
    q, s = symbols("q s", positive=True)
    d.suppose(r"$0 < \varepsilon, \kappa_p < r_p < 1$ (eq:eekappar, with $<$ for $\ll$)")
    ratio = d.eq("scaled ratio", r / kappa**2, r_p / k_p**2, "the ratio is the same in scaled and unscaled "
                 "variables",
                 by=unscaled(d, r / kappa**2))
    d.bound("the ratio exceeds 1", ratio, ">", 1, r"$\kappa_p = r_p/(1 + q)$, $r_p = 1/(1 + s)$, where $q, s > 0$",
            q**2 * s + q**2 + 2 * q * s + 2 * q + s, on={k_p: 1 / (1 + s) / (1 + q), r_p: 1 / (1 + s)})
    d.conclude("scaled ratio", "the ratio exceeds 1",
               note="the ordering of the scales is an assumption of the paper, which makes the ratio large")


@derives("eq:Plarge", "Occupation in strong noise, unscaled")
def occupation_strong(d):
    d.suppose(r"attracting sliding and $\kappa_p \gg \sqrt{\varepsilon}$")
    d.suppose(r"times are longer than the relaxation time, $O(\kappa_p^2)$, and at most $O(r_p)$, so that the "
              "density is near its steady state")
    d.eq("unscale", P, 4 * eps / ((1 / a_minus - 1 / a_plus_sliding) * k_p**2), by=unscaled(d, d["eq:Plarge2"]))
    d.conclude(error=unscaled(d, d.error("eq:Plarge2")))


@derives("eq:Psmall", "Occupation in weak noise, unscaled")
def occupation_weak(d):
    V_m, K_m, rate = Symbol("V_m", real=True), Symbol("K_m", positive=True), 2 * eps / k_p**2
    d.suppose(r"attracting sliding, $\kappa_p \ll \sqrt{\varepsilon}$, and one lowest well inside the layer, with "
              "$V''(u_m) > 0$")
    d.eq("unscale", 1 - P, k_p * sqrt(K_m) / (2 * sqrt(pi * eps)) * (
        exp(rate * V_m) / a_minus - exp(rate * (V_m - V_1)) / a_plus_sliding),
        r"this is exponentially small in $\varepsilon/\kappa_p^2$; the paper's $O(\kappa_p^2/\varepsilon)$ is "
        "not sharp",
        by=unscaled(d, d["eq:Psmall2"]))
    d.conclude(error=r"relative $O(\kappa_p^2/\varepsilon)$",
               note="$u_m$ is the lowest point of $V$, $V_m = V(u_m)$, $K_m = V''(u_m)$ (1/scaled time)")


@derives("eq:Tlarge", "Escape in strong noise, unscaled")
def escape_strong(d):
    d.suppose(r"crossing to the right, $\sqrt{\varepsilon} \le \kappa_p < r_p$")
    clock, time = d["eq:TtildetoT"], Symbol("T", positive=True)
    d.eq("unscale", Symbol("T_phys", positive=True), r_p / a_plus, r"the remainder $O(\kappa^2)$ becomes "
         r"$O(\kappa_p^2)$, which is less than $r_p^2$; the relative error $O(r_p)$ of the coefficients changes "
         "$T_p$ by $O(r_p^2)$, too",
         lambda T: [(clock.subs(time, unscaled(d, d["eq:Ttildelarge"])), T),
                    (clock.subs(time, unscaled(d, d.error("eq:Ttildelarge"))), k_p**2)])
    d.conclude(error=r"$O(r_p^2)$, for $\sqrt{\varepsilon} \le \kappa_p < r_p$, so that $\varepsilon < r_p^2$",
               note=r"$\kappa_p$ is at least $\sqrt{\varepsilon}$; in weak noise, with $\phi > 0$, the error is "
                    r"$O(\varepsilon) + O(r_p^2)$ by eq:S")


@derives("eq:Tsmall", "The noise at which the well's term equals $r/a^+$")
def escape_weak(d):
    D, A_1, A_2 = Symbol("D", positive=True), Symbol("A_1", negative=True), Symbol("A_2", positive=True)
    d.suppose("the conditions of eq:Ttildesmall")
    d.suppose(r"$r \sqrt{-A'(u_1) A'(u_2)} > 2 \pi a^+$; otherwise the well's term exceeds $r/a^+$ at every noise")
    d.suppose("a negative drift on some interval implies $T > O(r)$",
              fails=r"$A = \frac{3}{10} + 2 u + 3 u^2$ with $\kappa = \frac{1}{20}$")
    d.suppose(r"$\kappa \ll 1$ implies $T > O(r)$",
              fails=r"friction with $\mu = 3$, $z_0 = -\frac{2}{5}$, $\kappa = \frac{3}{10}$ and $r = 10^{12}$")
    formula, square = d["eq:Ttildesmall"], Symbol("X", positive=True)
    well = formula.subs(r, 0)
    both = solve(well.subs(kappa, sqrt(square)) - (formula - well), square)
    d.eq("both terms equal", Symbol("kappa_e", positive=True),
         sqrt(2 * D / log(r * sqrt(-A_1 * A_2) / (2 * pi * a_plus))),
         r"$T > O(r)$ requires $\kappa$ below this value, a stronger condition than $\kappa \ll 1$, because it "
         "contains $r$",
         by=sqrt(both[0]))
    d.conclude(note="$D = V(u_2) - V(u_1)$ is the height of the barrier",
               error="none for the two terms of eq:Ttildesmall, which has an error of its own")
