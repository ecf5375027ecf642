"""Section 6.2 and appendix A.3, weak noise: the well's term of the escape time."""

import mpmath
import sympy
from sympy import Derivative, Function, Integral, Limit, Matrix, Symbol, exp, log, oo, pi, sqrt

from derivations.numerics import WELL as SCENE
from derivations.numerics import around, integral, well_integral
from derivations.paper import T, V, a_minus, a_plus, kappa, lam, phi, r, u, u1, u2, v
from symasym.derivation.derivation import derives

a, b, h, top = sympy.symbols("uhat vhat h V_top", real=True)
D, W, S1, S2, depth, height = sympy.symbols("D w s_1 s_2 d g", positive=True)
A1, A2 = Symbol("A_1", negative=True), Symbol("A_2", positive=True)
V_1, V_2 = sympy.symbols("V_u1 V_u2", real=True)
G, T1, T2, T3, T4 = sympy.symbols("G T_1 T_2 T_3 T_4")
prefactor = 2 * pi / sqrt(-A1 * A2)
leading = prefactor * exp(2 * D / kappa**2)
first = kappa * sqrt(pi / A2) / a_minus * exp(2 * V_2 / kappa**2)
third = kappa * sqrt(-pi / A1) / a_plus * exp(2 * (top - V_1) / kappa**2)
WEAK = ("1e-1", "1e-2", "1e-3", "1e-4")


def _of(f):
    """A number of the scene from its well and barrier."""
    return lambda k, ctx: f(ctx, *SCENE.roots(ctx))


AT = {
    D: _of(lambda ctx, x, y: SCENE.V(ctx, y) - SCENE.V(ctx, x)),
    A1: _of(lambda ctx, x, y: SCENE.phi(ctx, x, 1)), A2: _of(lambda ctx, x, y: SCENE.phi(ctx, y, 1)),
    V_1: _of(lambda ctx, x, y: SCENE.V(ctx, x)), V_2: _of(lambda ctx, x, y: SCENE.V(ctx, y)),
    a_minus: lambda k, ctx: SCENE.end(ctx, -1), a_plus: lambda k, ctx: SCENE.end(ctx, 1),
    top: lambda k, ctx: SCENE.V(ctx, ctx.mpf(1)),
}


def by_quadrature(number, low):
    """The integral of e^{+-lam V} about a zero of the drift, on from `low`, at high precision."""
    def exact(k, ctx):
        sign, at = (-1, 1)[number], SCENE.roots(ctx)[number]
        width = 1 / ctx.sqrt(sign * 2 / k**2 * SCENE.phi(ctx, at, 1))
        near = around(ctx, at, width, low, 1)
        value = integral(ctx, lambda x: ctx.exp(sign * 2 / k**2 * (SCENE.V(ctx, x) - SCENE.V(ctx, at))), near)
        return value * ctx.exp(sign * 2 / k**2 * SCENE.V(ctx, at))
    return exact


def exact_first(k, ctx):
    return by_quadrature(1, 0)(k, ctx) / SCENE.end(ctx, -1)


def exact_third(k, ctx):
    return by_quadrature(0, -1)(k, ctx) * ctx.exp(2 / k**2 * SCENE.V(ctx, ctx.mpf(1))) / SCENE.end(ctx, 1)


def one_size(k, ctx):
    """r for which both terms of T are of one size."""
    return ctx.exp(2 * AT[D](k, ctx) / k**2)


def exact_time(k, ctx):
    r, ap = one_size(k, ctx), SCENE.end(ctx, 1)
    return (well_integral(ctx, SCENE, k) + exact_first(k, ctx) + exact_third(k, ctx)
            + (r - 1) / ap - k**2 / (2 * ap**2))


@derives("laplace-substitution", "The substitution at the saddle")
def substitution(d):
    at = Matrix([u1 + kappa * a, u2 + kappa * b])
    (_, low, high), (_, start, end) = next(iter(d["eq:fourPieces", "T_2"].atoms(Integral))).limits
    solve = lambda value, x: sympy.solve(value, x)[0]
    d.eq("Jacobian", r"\partial(u, v)/\partial(\hat u, \hat v)", kappa**2, by=at.jacobian([a, b]).det())
    d.eq("v at its lower limit", r"\hat v|_{v = 0}", -u2 / kappa, by=solve(at[1] - start, b))
    d.eq("v at its upper limit", r"\hat v|_{v = 1}", (1 - u2) / kappa, by=solve(at[1] - end, b))
    d.eq("u at its lower limit", r"\hat u|_{u = -1}", (-1 - u1) / kappa, by=solve(at[0] - low, a))
    d.eq("u at its upper limit", r"\hat u|_{u = v}", b + (u2 - u1) / kappa, by=solve(at[0] - high.subs(v, at[1]), a))
    c2, c3, c4 = sympy.symbols("c2:5", real=True)
    local = V_1 + c2 * h**2 / 2 + c3 * h**3 / 6 + c4 * h**4 / 24
    d.eq("V at the saddle", r"V(u) \sim", V_1 + c2 * kappa**2 * a**2 / 2, "$V'(u_1) = 0$; the rest is "
         "$O(\\kappa^3)$, odd at that order", by=sympy.series(local.subs(h, kappa * a), kappa, 0, 3).removeO())


@derives("gaussian-step", "Both Gaussian integrals over the whole line")
def gaussian(d):
    bend = (d["laplace-substitution"] - V_1).subs(Symbol("c2", real=True), S1)
    one = d.eq("one Gaussian", kappa * Integral(exp(-lam * bend), (a, -oo, oo)), kappa * sqrt(pi / S1),
               "$s_1 = V''(u_1)$")
    whole = lam * d["laplace-substitution", "Jacobian"] * Integral(
        exp(-S1 * a**2), (a, -oo, oo)) * Integral(exp(-S2 * b**2), (b, -oo, oo))
    both = d.eq("Gaussians", whole, 2 * pi / sqrt(S1 * S2),
                "$s_2 = -V''(u_2)$; what the finite limits cut off is exponentially small",
                lambda G: [(lam * one * one.subs(S1, S2), G)], whole)
    bend = d.eq("V'' = -A'", V(u).diff(u, 2), -Derivative(phi(u), u), by=Derivative(d["eq:V", "V(u)"], (u, 2)))
    d.eq("in terms of A'", G, prefactor, by=both.subs(
        {x: sign * bend.subs(Derivative(phi(u), u), A) for x, sign, A in ((S1, 1, A1), (S2, -1, A2))}))


@derives("eq:secondTerm", "The second piece: Kramers' time and its first correction")
def second(d):
    d.suppose("two simple roots $-1 < u_1 < u_2 < 1$ of $A$, and $u_2 > 0$")
    lead = d.eq("leading term", r"T_2 \sim", leading, by=d["gaussian-step"] * exp(lam * D))
    d.eq("logarithm", log(lead), log(2 * pi) + 2 * D / kappa**2 - log(-A1 * A2) / 2,
         "finite where the term itself overflows", lambda e: [(exp(e), lead)])
    exact = lambda k, ctx: well_integral(ctx, SCENE, k)
    d.order("sharp order", T2, lead, lead * kappa**2, exact, WEAK, AT,
            "the odd order cancels: $O(\\kappa^2)$, where the paper has $O(\\kappa)$")
    c, q = sympy.symbols("c_2:5", real=True), sympy.symbols("q_2:5", real=True)
    known = d["saddle-series", "first correction"]
    well = d.eq("correction of one saddle", r"Q_1/\lambda",
                kappa**2 / 2 * (5 * c[1]**2 / (24 * c[0]**3) - c[2] / (8 * c[0]**2)),
                "$c_j = V^{(j)}(u_1)$, and $q_j = -V^{(j)}(u_2)$ at the barrier",
                by=known.subs({s: x for s in known.free_symbols for x in c if s.name == x.name}) / lam)
    bends = {x: _of(lambda ctx, x, y, j=j, n=n: (-1, 1)[n] * SCENE.phi(ctx, (x, y)[n], j))
             for n, row in enumerate((c, q)) for j, x in enumerate(row, 1)}
    d.order("next order", T2, lead * (1 + well + well.subs(dict(zip(c, q)))), lead * kappa**4, exact,
            WEAK, AT | bends)
    d.conclude("sharp order", note="$D = V(u_2) - V(u_1)$, the height of the barrier")


@derives("eq:fourthTerm2", "The fourth piece in weak noise")
def fourth_weak(d):
    beyond = kappa**2 / (2 * a_plus**2) * (1 - exp(-2 * a_plus * (r - 1) / kappa**2))
    closed = d.eq("closed form", T4, (r - 1) / a_plus - beyond, by=d["eq:fourthTerm", "closed form"])
    d.eq("as kappa -> 0", Limit(closed.subs(r, 1 + W), kappa, 0).subs(W, r - 1), r / a_plus - 1 / a_plus,
         "the exponential is below any power of $\\kappa$",
         lambda e: [(sympy.limit(closed.subs(r, 1 + W), kappa, 0), e.subs(r, 1 + W))])


@derives("other-pieces", "The first and the third piece in weak noise")
def others(d):
    def beyond(sign, side, low, high):
        """e^{-lam V} or e^{lam V} over one side of the layer, as kappa -> 0."""
        fall = sympy.expand(d["eq:V2", "V(u)"][1 + side] - d["eq:V2", "V(u)"][1 + side].subs(u, side))
        whole = sympy.expand(sympy.integrate(sympy.expand(exp(sign * lam * fall)), (u, low, high)))
        return whole.replace(exp, lambda _: 0)

    gauss = d["gaussian-step", "one Gaussian"]
    (_, *inner), (_, *outer) = next(iter(d["eq:fourPieces", "T_1"].atoms(Integral))).limits
    before = d.eq("leading part of the first", r"T_1 \sim", first,
         by=lam * beyond(-1, -1, *inner) * gauss.subs(S1, A2) * exp(lam * V_2))
    d.order("first piece", T1, before, before * kappa**2, exact_first, WEAK, AT,
            "the integral of $e^{-\\lambda V}$ over $(-r, -1)$, times a Gaussian at the barrier")
    (_, *inner), (_, *outer) = next(iter(d["eq:fourPieces", "T_3"].atoms(Integral))).limits
    after = d.eq("leading part of the third", r"T_3 \sim", third,
         by=lam * gauss.subs(S1, -A1) * beyond(1, 1, *outer) * exp(lam * (top - V_1)))
    d.order("third piece", T3, after, after * kappa**2, exact_third, WEAK, AT,
            "a Gaussian at the well, times the integral of $e^{\\lambda V}$ over $(1, r)$")
    second = d["eq:secondTerm"].subs(D, V_2 - V_1)
    d.eq("first against the well's term", T1 / T2, kappa * sqrt(-A1) / (2 * a_minus * sqrt(pi))
         * exp(lam * V_1), "exponentially small: $V(u_1) < 0$", by=before / second)
    d.eq("third against the well's term", T3 / T2, kappa * sqrt(A2) / (2 * a_plus * sqrt(pi))
         * exp(lam * (top - V_2)), "exponentially small: $V(1) < V(u_2)$", by=after / second)
    d.suppose("$V(u_1) < V(-1) = 0$ and $V(1) < V(u_2)$: $\\phi > 0$ left of $u_1$ and right of $u_2$",
              lambda: bool(AT[V_1](0, mpmath.mp) < 0 and AT[top](0, mpmath.mp) < AT[V_2](0, mpmath.mp)))
    d.suppose("$V(u_1) < V(1)$ (the third piece; else what $u = 1$ contributes, $O(\\kappa^2)$, is larger)")
    d.conclude("third piece", note="$T_1$ and $T_3$ are exponentially smaller than $T_2$")


@derives("eq:Ttildesmall", "The mean escape time in weak noise")
def small(d):
    d.suppose("$u_1$ and $u_2$ are simple zeros; $u_1$, $u_2$, 0 and 1 are several $\\kappa$ apart")
    d.suppose("the formula holds up to the fold", fails="friction, mu = 3, z0 = -777/1000, kappa = 1/10")
    d.suppose("the formula holds up to $u_2 = 1$", fails="friction, mu = 3, z0 = -1/10000, kappa = 1/10")
    formula = d.eq("sum", r"T \sim", leading + r / a_plus, "the second and the fourth piece, the latter for "
                   "large $r$", by=d["eq:secondTerm"] + sympy.expand(d["eq:fourthTerm2"]).coeff(r) * r)
    small = {"T_1/T_2": d["other-pieces", "first against the well's term"].subs(V_1, -depth),
             "T_3/T_2": d["other-pieces", "third against the well's term"].subs(V_2, top + height),
             "C": d["C-bound", "C_high"]}
    for name, e in small.items():
        d.eq(f"{name} is left out", Limit(sympy.powsimp(e) / kappa**8, kappa, 0), sympy.S.Zero,
             "below any power of $\\kappa$")
    d.order("order, where both terms are of one size", T, formula, kappa**2 * exp(2 * D / kappa**2), exact_time,
            ("1e-1", "3e-2", "1e-2", "3e-3"), AT | {r: one_size},
            "$r = e^{2D/\\kappa^2}$; relative $O(\\kappa^2)$ for the exponential term, $O(1)$ for the other")
    d.conclude(note="$D = V(u_2) - V(u_1)$; the paper has eq:S before the exponential term, 0 without a well")
