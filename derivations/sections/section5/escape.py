"""Section 5.2 and appendix A.1: the mean escape time, forwards and backwards."""

import sympy
from sympy import Derivative, DiracDelta, Function, Heaviside, Integral, Symbol, exp, oo, symbols, tanh

from derivations.paper import C, T, V, eps, kappa, lam, p, phi, r, r_physical, t, u, v
from derivations.sections.section5.stationary import half, q
from symasym.derivation.derivation import derives

f, g, h, G, J, R = map(Function, "fghGJR")
m, s, k, a, I0, I1, J0, J1 = symbols("m s k a I0 I1 J0 J1", positive=True)
c = Symbol("c", real=True)
up, mode = exp(lam * V(v)), exp(-m * t)
ONE_SIDED = (r"$I_0$ and $I_1$ are the integrals of $e^{2 V/\kappa^2}$ over $(0, r)$ and $(-r, 0)$ (scaled "
             "lengths); in $J_0$ and $J_1$ the integrand has the additional factor "
             r"$\int_{-r}^v e^{-2 V/\kappa^2}$ (squares of scaled lengths)")

RESIDENCE = "$R(u)$ is $p(u, t)$ integrated over all time (scaled time over length)"


def adjoint(f):
    """The Fokker-Planck operator on f(u)."""
    return -Derivative(phi(u) * f, u) + half * Derivative(f, (u, 2))


def by_sides(e):
    """Integrals of e^{lam V}, or of the kernel of eq:Ttilde, over (-r, r) by I0, I1, J0, J1."""
    first = e.replace(lambda x: isinstance(x, Integral) and x.limits == ((v, -r, r),),
                      lambda x: _halves(x.function / up, I0, I1))
    last = first.replace(lambda x: isinstance(x, Integral) and x.limits == ((u, -r, v), (v, -r, r)),
                         lambda x: _halves(x.function / up * exp(lam * V(u)), J0, J1))
    return last.subs(Integral(up, (v, 0, r)), I0)


def _halves(kernel, right, left):
    return sum(sympy.expand(kernel.subs(Heaviside(v), on)) * part for on, part in ((1, right), (0, left)))


def interchange(d, name, first, second, why=""):
    """A step: integrals of f(u) g(v) over the same domain, as e^{s u} g = e^{k v} show for all s and k."""
    of = lambda e: e.replace(f, lambda x: exp(s * x)).replace(g, lambda x: exp(k * x))
    return d.eq(name, first, second, why, lambda e: [(of(e), of(first))])


@derives("eq:tilder", "The scaled radius")
def scaled_radius(d):
    d.eq("scale", r, r_physical / eps, by=d["eq:tildexykappa", "u"].subs(Symbol("y", real=True), r_physical))


@derives("eq:Ttilde0", "The mean escape time as the time integral of the surviving mass")
def survival(d):
    d.suppose(r"$t G(t) \to 0$: the surviving mass $G$ decays faster than $1/t$, as it does on a bounded interval")
    parts = d.eq("by parts", -t * Derivative(G(t), t) - Derivative(-t * G(t), t), G(t),
                 "$-G'$, the mass that leaves per unit time, is the density of the escape time, so the mean "
                 "escape time is the integral of $G$")
    mean = Integral(parts.replace(G, lambda _: mode), (t, 0, oo)) * Integral(q(u), (u, -r, r))
    d.eq("surviving mass", T, Integral(p(u, t), (u, -r, r), (t, 0, oo)),
         "a mode $q(u) e^{-m t}$ of $p$ contributes $1/m$ times its mass",
         lambda T: [(T.replace(p, lambda *_: q(u) * mode), mean)])
    d.conclude(note="$p$ is the density of the scaled position $u$ at the scaled time $t$")


@derives("eq:odeR", "The Fokker-Planck equation integrated over all time")
def integrated(d):
    d.suppose("escape is certain on a bounded interval: $p(u, t) \\to 0$ as $t$ grows")
    start = d.eq("left side of one mode", Integral(Derivative(q(u) * mode, t), (t, 0, oo)), -q(u),
                 "$p$ is a sum of modes $q e^{-m t}$; each gives minus its value at the start, and together "
                 r"they give $-\delta$ (eq:BCs2)")
    of_mode = d.eq("right side of one mode", Integral(mode, (t, 0, oo)) * d["eq:FPE"], adjoint(q(u)) / m,
                   "the time integral and the operator interchange, and $R = q/m$ for this mode")
    d.eq("in terms of R", r"\mathcal{L}^* R", adjoint(R(u)), by=of_mode.replace(q, lambda x: m * R(x)))
    d.eq("start at 0", r"\mathcal{L}^* R", -DiracDelta(u), r"the modes add up to $\delta(u)$ at the start "
         "(eq:BCs2)",
         by=start.replace(q, DiracDelta))
    d.conclude("in terms of R", "start at 0", note=RESIDENCE)


@derives("first-integral", "The flux of $R$: $C$ to the left of the start, $C - 1$ to its right")
def first_integral(d):
    d.eq("flux", J(u), -phi(u) * R(u) + half * Derivative(R(u), u), "counted positive to the left",
         [(Derivative(J(u), u), d["eq:odeR", "in terms of R"])])
    d.eq("integrate once", J(u), C - Heaviside(u), "the flux is $C$ to the left of the start",
         [(Derivative(J(u), u), d["eq:odeR", "start at 0"]), (J(-1), C)])
    d.conclude(note=r"$J = (\kappa^2/2) R' - \phi R$ is the flux of $R$ to the left")


@derives("density-R", "The function $R$ by an integrating factor")
def density(d):
    e = exp(lam * V(u))
    flux = d["first-integral", "flux"].subs(phi(u), -Derivative(V(u), u))
    (slope,) = sympy.solve(flux - d["first-integral"], Derivative(R(u), u))
    product = Derivative(e * R(u), u)
    rate = d.eq("integrating factor", product, lam * e * (C - Heaviside(u)),
                r"since $\phi = -V'$, this derivative is $\lambda e^{\lambda V}$ times the flux, where "
                r"$\lambda = 2/\kappa^2$",
                by=product.doit().subs(Derivative(R(u), u), slope))
    d.eq("integrate again", R(u), lam * exp(-lam * V(u)) * Integral((Heaviside(v) - C) * up, (v, u, r)),
         "the integral runs from $u$ to $r$, where $R = 0$", [(product, rate), (R(r), 0)])
    d.conclude(note=RESIDENCE)


@derives("eq:C", "The probability $C$ of leaving through $-r$")
def constant(d):
    at_left = by_sides(d["density-R"].subs(u, -r) / lam * exp(lam * V(-r)))
    by = d.eq("R(-r) = 0", C, I0 / (I0 + I1), ONE_SIDED, [(at_left, 0)])
    left = d.eq("splitting probability", h(u), Integral(up, (v, u, r)) / Integral(up, (v, -r, r)),
                "independently of this, the backward equation gives the probability of leaving through $-r$ "
                "from $u$",
                [(half * h(u).diff(u, 2) - V(u).diff(u) * h(u).diff(u), 0), (h(-r), 1), (h(r), 0)])
    d.eq("at the start", C, Integral(up, (v, 0, r)) / Integral(up, (v, -r, r)), "$h(0)$ is the same by both "
         "routes",
         lambda found: [(left.subs(u, 0), found), (by_sides(found), by)])


@derives("eq:Ttilde", "The mean escape time as a double integral, from the forward equation")
def escape_time(d):
    (inside, _) = d["eq:Ttilde0"].limits
    of_R = d.eq("order of integration in time and position", T, Integral(R(u), inside),
                "$R(u)$ is $p(u, t)$ integrated over all time",
                lambda T: [(T.replace(R, lambda x: Integral(p(x, t), (t, 0, oo))), d["eq:Ttilde0"].func(
                    Integral(p(u, t), (t, 0, oo)), inside))])
    above = Integral((Heaviside(v) - C) * up, (v, u, r))
    iterated = d.eq("R substituted", T, Integral(lam * exp(-lam * V(u)) * above, (u, -r, r)),
                    by=of_R.replace(R, lambda x: d["density-R"].subs(u, x)))
    swapped = interchange(d, "order of integration", Integral(f(u) * g(v), *above.limits, *iterated.limits),
                          Integral(f(u) * g(v), (u, -r, v), (v, -r, r)), "$R(u)$ is an integral over $v > u$, "
                          "and the two integrals interchange")
    kernel = (Heaviside(v) - C) * exp(lam * (V(v) - V(u)))
    whole = iterated.function / above * above.function
    found = d.eq("mean escape time", T, lam * Integral(kernel, (u, -r, v), (v, -r, r)),
                 r"the integrand is of the form $f(u)\, g(v)$", by=lam * Integral(whole / lam, *swapped.limits))
    d.eq("by one-sided integrals", T, lam * (I1 * J0 - I0 * J1) / (I0 + I1), ONE_SIDED,
         by=by_sides(found).subs(C, by_sides(d["eq:C"])))
    d.conclude("mean escape time", note="$C$ is the exit probability of eq:C")


@derives("backward", "The mean escape time from the backward equation")
def backward(d):
    e, S = exp(lam * V(u)), Function("S")
    down = Integral(exp(-lam * V(v)), (v, -r, u))
    slope = d.eq("first integral", S(u), e * (c - lam * down), "this integrates "
                 r"$(\kappa^2/2) T'' + \phi T' = -1$ once, with $S = T'$",
                 [(half * S(u).diff(u) - V(u).diff(u) * S(u), -1), (S(-r), c * exp(lam * V(-r)))])
    integral = lambda single, double: (slope / e).expand().subs(down, double / single).expand() * single
    const = d.eq("both ends absorb", c, lam * (J0 + J1) / (I0 + I1), "the integral of $S$ over $(-r, r)$ is 0",
                 [(integral(I0 + I1, J0 + J1), 0)])
    start = d.eq("at the start 0", T, lam * J0 - lam * (J0 + J1) * I0 / (I0 + I1),
                 "it is minus the integral of $S$ over $(0, r)$", by=-integral(I0, J0).subs(c, const))
    d.eq("the same as eq:Ttilde", T, start, "this is eq:Ttilde split at $v = 0$, with $C$ from eq:C",
         by=d["eq:Ttilde", "by one-sided integrals"])
    d.conclude(note=ONE_SIDED)


@derives("constant-drift", "Constant drift: escape time and exit probability in closed form")
def constant_drift(d):
    edge, mean = exp(lam * a * r), Function("T")
    L = lambda y: half * y(u).diff(u, 2) + a * y(u).diff(u)
    left = d.eq("splitting probability", h(u), (exp(-lam * a * u) - 1 / edge) / (edge - 1 / edge),
                "this is the probability of leaving through $-r$ from $u$", [(L(h), 0), (h(-r), 1), (h(r), 0)])
    time = d.eq("mean escape time from u", mean(u), (r - u) / a - 2 * r / a * left,
                "it solves the backward equation",
                [(L(mean), -1), (mean(-r), 0), (mean(r), 0)])
    fall = d["eq:V"].replace(phi, lambda _: a).doit()
    rise = sympy.expand(exp(lam * fall.subs(u, v)))
    mass = Integral(sympy.expand(exp(-lam * fall)), (u, -r, v)).doit()
    whole = {x: Integral(sympy.expand(rise * w), (v, *over)).doit() for x, w, over in (
        (I0, 1, (0, r)), (I1, 1, (-r, 0)), (J0, mass, (0, r)), (J1, mass, (-r, 0)))}
    d.eq("from 0", T, r / a * tanh(a * r / kappa**2), "this follows from the equation, and also from 'backward'",
         lambda T: [(time.subs(u, 0), T.rewrite(exp)), (d["backward"].subs(whole), T.rewrite(exp))])
    d.eq("exit through -r, from 0", C, 1 / (1 + exp(2 * a * r / kappa**2)), "this follows also from eq:C",
         lambda C: [(left.subs(u, 0), C), (by_sides(d["eq:C"]).subs(whole), C)])
    d.conclude("from 0", "exit through -r, from 0", "mean escape time from u",
               note="the third line is the mean time from a start at $u$")
