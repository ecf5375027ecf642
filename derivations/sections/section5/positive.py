"""The exact integrals in positive terms."""

from sympy import Function, Integral, Limit, Symbol, exp, expand, symbols

from derivations.paper import C, N, T, V, lam, phi, r, t, u, v, x
from derivations.sections.section5.escape import I0, I1, J0, J1, by_sides, f, g, interchange
from symasym.derivation.derivation import derives

rate = Symbol("lam", positive=True)
s, w, sigma, sigma_left, sigma_right = symbols("s w sigma sigma_left sigma_right", positive=True)
fall, climb, E_s, F_s, D_s = symbols("f c E_s F_s D_s", positive=True)
p_ss = Function("p_ss")


@derives("positive-form",
         "The escape time and the exit probability from both sides of the start, in positive terms")
def positive_form(d):
    m, K_left, K_right = symbols("m K_left K_right", positive=True)
    over = lambda inner, outer: Integral(f(u) * g(v), inner, outer)
    before, behind, ahead = Integral(f(u), (u, -r, x)), Integral(g(v), (v, -r, x)), Integral(g(v), (v, x, r))
    left = interchange(
        d, "left of the start", over((u, -r, v), (v, -r, x)), before * behind - over((v, -r, u), (u, -r, x)),
        r"with $f = e^{-\lambda V}$, $g = e^{\lambda V}$ and the start $x$ this says $J_1 = m I_1 - K_l$, a "
        "square minus a triangle")
    right = interchange(
        d, "right of the start", over((u, -r, v), (v, x, r)), before * ahead + over((v, u, r), (u, x, r)),
        "this says $J_0 = m I_0 + K_r$, a rectangle plus a triangle")
    named = {over((v, -r, u), (u, -r, x)): K_left, over((v, u, r), (u, x, r)): K_right}
    named |= {behind: I1, ahead: I0, before: m}
    positive = d.eq("nothing cancels", T, lam * (I0 * K_left + I1 * K_right) / (I0 + I1), "the mass $m$ drops out",
                    by=d["backward"].subs({J0: right.subs(named), J1: left.subs(named)}))
    carried = {sigma_left: I1 / s, sigma_right: I0 / s, w: lam * s * (K_left / I1 + K_right / I0)}
    d.eq("from both sweeps", T, w / (1 / sigma_left + 1 / sigma_right), "here $w = w_l + w_r$",
         lambda T: [(T.subs(carried), positive)])
    d.eq("chance of leaving on the left", C, 1 / (1 + sigma_left / sigma_right), "this agrees with eq:C",
         lambda C: [(C.subs(carried), by_sides(d["eq:C"]))])
    d.conclude("from both sweeps", "chance of leaving on the left", note=(
        r"$\sigma = \Sigma/s$ on either side of the start (a scaled length), where $s = e^{2 V/\kappa^2}$ and "
        r"$\Sigma$ is the integral of $s$ from the end; $w$ is $2 s/(\kappa^2 \Sigma)$ times the integral of "
        r"$\Sigma/s$ from the end (scaled time over length), with both sides added"))


@derives("positive-density", "The stationary density and the occupation, in positive terms")
def positive_density(d):
    M, M_left, M_right, K = symbols("M M_left M_right K", positive=True)
    steady = d["eq:pss"].subs(exp(lam * V(u)), s)
    constant = d.eq("mass 1", K, 1 / (M_left + M_right),
                    r"$M_l$ and $M_r$ are the integrals of $e^{-\lambda V}$ to the left and to the right of $u$; "
                    r"$s = e^{\lambda V(u)}$",
                    [(steady * s * (M_left + M_right), 1)])
    normal = d.eq("density of mass 1", p_ss(u), 1 / (s * (M_left + M_right)), by=steady.subs(K, constant))
    d.eq("density", p_ss(u), rate / w, r"here $w = \lambda s (M_l + M_r)$; at an edge of the layer the tail "
                                       r"contributes $1/|a^\pm|$",
         lambda p: [(p.subs(w, rate * s * (M_left + M_right)), normal)])
    d.eq("occupation", Symbol("P"), 1 / (1 + M / N), by=d["eq:P"])
    d.conclude("density", "occupation", note=(
        r"$w$ is $\lambda e^{\lambda V(u)}$ times the integral of $e^{-\lambda V}$ over all positions (scaled "
        r"time over length), with $\lambda = 2/\kappa^2$; $N$ and $M$ are the integrals of $e^{-\lambda V}$ "
        "inside and outside the layer"))


@derives("constant-panel", "Integrals over a panel of constant drift")
def constant_panel(d):
    size = Symbol("x", positive=True)
    e = lambda drift, at: exp(expand(d["eq:V"].replace(phi, lambda _: drift).doit().subs(u, at - 1)))
    down, up = Integral(e(size, t), (t, 0, 1)), Integral(e(-size, t), (t, 0, 1)) / e(-size, 1)
    single = d.eq("single", E_s, (1 - exp(-size)) / size, "the integral is the same where $V$ falls and where "
                  "it rises",
                  [(E_s, down), (E_s, up)])
    double = lambda drift: Integral(e(drift, v) / e(drift, t), (v, 0, t), (t, 0, 1))
    why = "written with $E_s$ it contains no $x^2$, which could overflow float64"
    d.eq("double, V falls", Symbol("D_-"), (E_s - exp(-size)) / size, why,
         lambda D: [(e(size, 1) * double(size), D.subs(E_s, single))])
    d.eq("double, V rises", Symbol("D_+"), (1 - E_s) / size, why, lambda D: [(double(-size), D.subs(E_s, single))])
    d.conclude("single", "double, V falls", "double, V rises", note=(
        r"$x = \lambda |a| h$ for a panel of width $h$ and drift $a$; $E_s$ is the integral of $e^{\lambda V}$, "
        r"in units of $h$; $D_-$ and $D_+$ are the integrals of $e^{\lambda (V(v) - V(u))}$ over $v < u$ where "
        "$V$ falls and rises, in units of $h^2$; each integrand is divided by its largest value"))


@derives("panel-step", "One step of the sweep: $\\sigma$ and $w$ across a panel")
def panel_step(d):
    E, F, D, end, Sigma = symbols("E F D e Sigma", positive=True)
    after = d.eq("sigma", r"\sigma_b", (sigma + E) / end, r"$\Sigma$ grows by $s E$, and $s$ grows by the factor "
                 "$e$",
                 by=((Sigma + s * E) / (s * end)).subs(Sigma, sigma * s))
    later = d.eq("w", "w_b", end * (sigma * (w + rate * F) + rate * D) / (sigma + E),
                 "$F$ and $D$ are the integrals of $1/e$ and, over $v < u$, of $e(v)/e(u)$",
                 by=(end * (w * Sigma + rate * (Sigma * F + s * D)) / (Sigma + s * E)).subs(Sigma, sigma * s))
    scaled, grown = {E: E_s / climb, F: F_s / fall, D: D_s / fall, end: fall / climb}, E_s + climb * sigma
    first = d.eq("sigma, scaled", r"\sigma_b", grown / fall, "with $e(b) = f/c$, $E_s = c E$, $F_s = f F$ and "
                 "$D_s = f D$",
                 by=after.subs(scaled))
    second = d.eq("w, scaled", "w_b", (fall * w + rate * F_s) / (climb + E_s / sigma) + rate * D_s / grown,
                  r"in this form no number grows with $\lambda$", by=later.subs(scaled))
    begun = d.eq("sigma from an absorbing end", r"\lim_{\sigma \to 0} \sigma_b", E_s / fall,
                 by=Limit(first, sigma, 0))
    d.eq("w from an absorbing end", r"\lim_{\sigma \to 0} w_b", rate * D_s / E_s,
         r"if the same panel lies on either side of the start, then $K_l = K_r = D$ and $T = \lambda D$ by "
         "'positive-form'",
         lambda e: [(Limit(second, sigma, 0), e), (d["positive-form", "from both sweeps"].subs(
             {sigma_left: begun, sigma_right: begun, w: 2 * e}), rate * D_s / fall)])
    d.conclude("sigma, scaled", "w, scaled", "sigma from an absorbing end", "w from an absorbing end", note=(
        r"the panel goes from $u = a$ to $u = b$; $e^{-\lambda |V(b) - V(a)|}$ is $f$ where $V$ falls and $c$ "
        "where it rises, and the other of the two is 1; $E_s$, $F_s$ and $D_s$ are the integrals of "
        r"$e = e^{\lambda (V - V(a))}$, of $1/e$ and, over $v < u$, of $e(v)/e(u)$, with each integrand divided "
        r"by its largest value; $\sigma$ and $w$ are those of 'positive-form'"))
