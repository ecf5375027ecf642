r"""Section 6.2 and appendix A.3, weak noise: the well's term of the escape time."""

import mpmath
import sympy
from sympy import Derivative, Integral, Limit, Matrix, Symbol, exp, oo, pi, sqrt

from derivations.numerics import WELL as SCENE
from derivations.numerics import around, integral, well_integral
from derivations.paper import T, V, a_minus, a_plus, kappa, lam, phi, r, u, u1, u2
from derivations.sections.section6.crossing import beside, piece
from symasym.derivation.derivation import derives

a, b, h, V_top, V_1, V_2, c3, c4 = sympy.symbols(r"\hat{u} \hat{v} h V_top V_u1 V_u2 c_3 c_4", real=True)
D, S1, S2, c2, depth, height = sympy.symbols("D s_1 s_2 c_2 d g", positive=True)
A1, A2 = Symbol("A_1", negative=True), Symbol("A_2", positive=True)
G, T1, T2, T3 = sympy.symbols("G T_1:4", positive=True)
WEAK = ("1e-3", "1e-4")
CROSSING = (r"crossing to the right, $a^- > 0$ and $a^+ > 0$; the only zeros of $A$ are $u_1$ and $u_2$, both "
            "simple, $-1 < u_1 < u_2 < 1$, and $u_2$ is positive")


def at_scene(scene):
    """The numbers of a drift with a well and a barrier."""
    of = lambda f: lambda k, ctx: f(ctx, *scene.roots(ctx))
    return {
        D: of(lambda ctx, x, y: scene.V(ctx, y) - scene.V(ctx, x)),
        A1: of(lambda ctx, x, y: scene.phi(ctx, x, 1)), A2: of(lambda ctx, x, y: scene.phi(ctx, y, 1)),
        V_1: of(lambda ctx, x, y: scene.V(ctx, x)), V_2: of(lambda ctx, x, y: scene.V(ctx, y)),
        a_minus: lambda k, ctx: scene.end(ctx, -1), a_plus: lambda k, ctx: scene.end(ctx, 1),
        V_top: lambda k, ctx: scene.V(ctx, ctx.mpf(1)),
    }


AT = at_scene(SCENE)


def about(scene, zero, low, high, k, ctx, weight=lambda x: 1):
    """The integral of e^{+-lam V} about a zero of the drift (0 the well, 1 the barrier), by quadrature."""
    rate, at = (-2, 2)[zero] / k**2, scene.roots(ctx)[zero]
    ends = around(ctx, at, 1 / ctx.sqrt(rate * scene.phi(ctx, at, 1)), low, high)
    value = integral(ctx, lambda x: weight(x) * ctx.exp(rate * (scene.V(ctx, x) - scene.V(ctx, at))), ends)
    return value * ctx.exp(rate * scene.V(ctx, at))


def exact_well(k, ctx):
    return well_integral(ctx, SCENE, k)


def exact_first(k, ctx):
    return about(SCENE, 1, 0, 1, k, ctx) / SCENE.end(ctx, -1)


def exact_third(k, ctx):
    return about(SCENE, 0, -1, 1, k, ctx) * ctx.exp(2 / k**2 * SCENE.V(ctx, ctx.mpf(1))) / SCENE.end(ctx, 1)


def one_size(k, ctx):
    """r for which both terms of T are of one size."""
    return ctx.exp(2 * AT[D](k, ctx) / k**2)


def exact_time(k, ctx):
    fourth = (one_size(k, ctx) - 1) / SCENE.end(ctx, 1) - k**2 / (2 * SCENE.end(ctx, 1) ** 2)
    return exact_well(k, ctx) + exact_first(k, ctx) + exact_third(k, ctx) + fourth


@derives("laplace-substitution", "The substitution at the saddle")
def substitution(d):
    at = Matrix([u1 + kappa * a, u2 + kappa * b])
    _, (_, start, _) = piece(d, 2).limits
    d.eq("Jacobian", r"\partial(u, v)/\partial(\hat u, \hat v) =", kappa**2, by=at.jacobian([a, b]).det())
    d.eq("v at its lower limit", r"\hat v|_{v = 0} =", -u2 / kappa, by=sympy.solve(at[1] - start, b)[0],
         why=r"the other limits of eq:fourPieces are $(1 - u_2)/\kappa$, $(-1 - u_1)/\kappa$ and "
             r"$\hat v + (u_2 - u_1)/\kappa$")
    local = V_1 + c2 * h**2 / 2 + c3 * h**3 / 6 + c4 * h**4 / 24
    d.eq("V at the saddle", r"V(u) \sim", V_1 + c2 * kappa**2 * a**2 / 2, "because $V'(u_1) = 0$; the next "
         r"term, $O(\kappa^3)$, is odd", by=sympy.series(local.subs(h, kappa * a), kappa, 0, 3).removeO())
    d.conclude(error=r"$O(\kappa^3)$",
               note=r"$u = u_1 + \kappa \hat u$ and $v = u_2 + \kappa \hat v$, where the unit of $\hat u$ is the "
                    "square root of scaled time; $c_2 = V''(u_1)$ (1/scaled time)")


@derives("gaussian-step", "Both Gaussian integrals over the whole line")
def gaussian(d):
    bend = (d["laplace-substitution"] - V_1).subs(c2, S1)
    one = d.eq("one Gaussian", kappa * Integral(exp(-lam * bend), (a, -oo, oo)), kappa * sqrt(pi / S1),
               "here $s_1 = V''(u_1)$")
    whole = lam * d["laplace-substitution", "Jacobian"] * Integral(
        exp(-S1 * a**2) * exp(-S2 * b**2), (a, -oo, oo), (b, -oo, oo))
    both = d.eq("Gaussians", whole, 2 * pi / sqrt(S1 * S2),
                "here $s_2 = -V''(u_2)$; it is the product of two Gaussian integrals, and what the finite "
                "limits cut off is exponentially small",
                lambda product: [(lam * one * one.subs(S1, S2), product)], whole)
    bend = d.eq("V'' = -A'", Derivative(V(u), (u, 2)), -Derivative(phi(u), u), by=Derivative(d["eq:V"], (u, 2)))
    d.eq("in terms of A'", G, 2 * pi / sqrt(-A1 * A2), by=both.subs(
        {x: sign * bend.subs(Derivative(phi(u), u), A) for x, sign, A in ((S1, 1, A1), (S2, -1, A2))}))
    d.conclude(note=r"$G$, a scaled time, is $\lambda$ times the integral of "
                    r"$e^{-(V''(u_1) (u - u_1)^2 - V''(u_2) (v - u_2)^2)/\kappa^2}$ over $u$ and $v$")


@derives("eq:secondTerm", "The second piece: Kramers' time and its first correction")
def second(d):
    d.suppose(CROSSING)
    lead = d.eq("leading term", r"T_2 \sim", 2 * pi / sqrt(-A1 * A2) * exp(2 * D / kappa**2),
                by=d["gaussian-step"] * exp(lam * D))
    c, q = (c2, c3, c4), sympy.symbols("q_2:5", real=True)
    well = d.eq("correction of one saddle", r"Q_1/\lambda =",
                kappa**2 / 2 * (5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2)),
                "$c_j = V^{(j)}(u_1)$ at the well, and $q_j = -V^{(j)}(u_2)$ at the barrier",
                by=d["saddle-series", "first correction"] / lam)
    bends = {x: lambda k, ctx, j=j, n=n: (-1, 1)[n] * SCENE.phi(ctx, SCENE.roots(ctx)[n], j)
             for n, row in enumerate((c, q)) for j, x in enumerate(row, 1)}
    both = d.order("next order", T2, lead * (1 + well + well.subs(dict(zip(c, q, strict=True)))), lead * kappa**4,
                   exact_well, WEAK, AT | bends)
    d.eq("sharp order", T2, 2 * pi / sqrt(-A1 * A2) * exp(2 * D / kappa**2), "the odd order cancels, so the "
         r"relative error is $O(\kappa^2)$, where the "
         r"paper has $O(\kappa)$", by=both.subs(dict.fromkeys((c3, c4, *q[1:]), 0)))
    d.conclude(error=lead * kappa**2,
               note="$D$ is the height of the barrier. With the correction in the step 'next order' the "
                    r"relative error is $O(\kappa^4)$; $c_j = V^{(j)}(u_1)$ and $q_j = -V^{(j)}(u_2)$ "
                    "('saddle-series')")


@derives("eq:fourthTerm2", "The fourth piece in weak noise")
def fourth_weak(d):
    beyond = d["eq:fourthTerm", "closed form"].subs(r, 1 + height)
    d.eq("as kappa -> 0", r"T_4 \sim", r / a_plus - 1 / a_plus, "the exponential in the closed form is smaller "
         r"than any power of $\kappa$", by=Limit(beyond, kappa, 0).doit().subs(height, r - 1))
    d.conclude(error=r"$O(\kappa^2)$")


@derives("other-pieces", "The first and the third piece in weak noise")
def others(d):
    gauss = d["gaussian-step", "one Gaussian"]
    (_, *left), _ = piece(d, 1).limits
    _, (_, *right) = piece(d, 3).limits
    for name, side, leading, by, exact, why in (
        ("first", T1, kappa * sqrt(pi / A2) / a_minus * exp(2 * V_2 / kappa**2),
         lam * beside(d, -1, -1, *left) * gauss.subs(S1, A2) * exp(lam * V_2), exact_first,
         r"it is the integral of $e^{-\lambda V}$ over $(-r, -1)$ times a Gaussian at the barrier"),
        ("third", T3, kappa * sqrt(-pi / A1) / a_plus * exp(2 * (V_top - V_1) / kappa**2),
         lam * gauss.subs(S1, -A1) * beside(d, 1, 1, *right) * exp(lam * (V_top - V_1)), exact_third,
         r"it is a Gaussian at the well times the integral of $e^{\lambda V}$ over $(1, r)$"),
    ):
        found = d.eq(f"leading part of the {name}", side, leading, why, by=by)
        d.order(f"{name} piece", side, found, leading * kappa**2, exact, WEAK, AT)
    low, high, edge = (lambda x=x: AT[x](0, mpmath.mp) for x in (V_1, V_2, V_top))
    d.suppose(r"$V(u_1) < V(-1) = 0$ and $V(1) < V(u_2)$, since $\phi > 0$ left of $u_1$ and right of $u_2$; "
              "therefore both pieces are exponentially "
              "smaller than $T_2$", lambda: bool(low() < 0 and edge() < high()))
    d.suppose("$V(u_1) < V(1)$ for the third piece; otherwise the contribution of $u = 1$, which is "
              r"$O(\kappa^2)$, is larger")
    d.conclude("first piece", "third piece", note="both are exponentially smaller than $T_2$ of eq:secondTerm")


@derives("eq:Ttildesmall", "The mean escape time in weak noise")
def small(d):
    d.suppose(CROSSING)
    d.suppose(r"$V(-r) = a^- (r - 1) > V(u_2)$, so that $C$ is exponentially small")
    d.suppose(r"the distances between $u_1$, $u_2$, 0 and 1 are several $\kappa$")
    d.suppose("the formula holds up to the fold",
              fails=r"friction with $\mu = 3$, $\alpha = 1$, $z_0 = -777/1000$, $\kappa = 1/10$ and $r = 10$; "
                    "there $T$ is 19.8 and the formula gives 59.0")
    d.suppose("the formula holds up to $u_2 = 1$",
              fails=r"friction with $\mu = 3$, $\alpha = 1$, $z_0 = -1/10000$, $\kappa = 1/10$ and $r = 10$; "
                    r"there $T$ is $1.1 \times 10^{35}$ and the formula gives $1.1 \times 10^{33}$")
    second = d["eq:secondTerm"]
    first, third = (x / second.subs(D, V_2 - V_1) for x in d["other-pieces"])
    adds = [d.eq(f"{name} is negligible", Limit(sympy.powsimp(sympy.expand(e)) / kappa**8, kappa, 0), 0,
                 rf"{left} is below any power of $\kappa$, here over $\kappa^8${means}")
            for name, left, means, e in (
        ("the first piece", "$T_1/T_2$, a ratio of pieces of eq:fourPieces,", "; $d = -V(u_1)$",
         first.subs(V_1, -depth)), ("C", "$C$, the probability of leaving on the left,", "", d["C-bound"]),
        ("the third piece", "$T_3/T_2$", "; $g = V(u_2) - V(1)$", third.subs(V_2, V_top + height)))]
    formula = d.eq("sum", r"T \sim", 2 * pi / sqrt(-A1 * A2) * exp(2 * D / kappa**2) + r / a_plus,
                   "it is the sum of the second piece and of the fourth piece for large $r$",
                   by=second * (1 + sum(adds)) + sympy.expand(d["eq:fourthTerm2"]).coeff(r) * r)
    d.order("order, where both terms are of one size", T, formula, kappa**2 * exp(2 * D / kappa**2), exact_time,
            ("1e-2", "3e-3"), AT | {r: one_size},
            r"measured at $r = e^{2 D/\kappa^2}$; the error of the exponential term is relative $O(\kappa^2)$, "
            "and that of the other term is $O(1)$")
    d.conclude(note="$0 < u_2 < 1$; the paper multiplies the exponential term by $S$ of eq:S, which is 0 without "
                    "such a well",
               known=r"the next term is that of eq:secondTerm. For friction with $\mu = 3$, $\alpha = 1$, "
                     r"$z_0 = -2/5$ and $r = 10$ the formula is too low by 7.7 %, 1.2 % and 0.28 % at "
                     r"$\kappa = 0.2$, 0.1 and 0.05")
