"""Section 6.1: how much of the time is spent in the layer when sliding."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Symbol

from derivations.numerics import SLIDING as SCENE
from derivations.numerics import Scene, integral, outside, outside_share, uniform
from derivations.paper import V_1, N, V, a_minus, kappa, lam, u
from derivations.paper import a_plus_sliding as a_plus
from derivations.registry import derives
from symasym.derivation import (
    Bound,
    Expansion,
    Identity,
    Inequality,
    Order,
    Satisfies,
    Together,
)

# Sliding friction drift: a- = 3/2, a+ = -1/2, one well, V(1) = -1: the right tail leads.
ENDS = {a_minus: "3/2", a_plus: "-1/2"}
# One well, V(1) = 0: both tails weigh the same. a- = 1/2, a+ = -3/2.
LEVEL = Scene((Fraction(1, 4), Fraction(-1), Fraction(-3, 4)))


def occupation(k: Any, ctx: Any) -> Any:
    """P of the scene, for kappa that is not small."""
    inside = integral(ctx, lambda x: ctx.exp(-2 * SCENE.V(ctx, x) / k**2), uniform(ctx, -1, 1, 1))
    return inside / (inside + outside(ctx, SCENE, k))


@derives("tails", "Both tail integrals of the steady state", ("eq:V2",))
def tail_integrals(d: Any) -> None:
    d.suppose("a- > 0 and a+ < 0", where="attracting sliding; otherwise a tail diverges")
    crossing = Symbol("a_plus", positive=True)

    def weight(piece: int) -> Any:
        """e^{-lam V} on one piece of eq:V2."""
        beyond = d.use("eq:V2", "V(u)")[piece].subs(crossing, a_plus)
        return sympy.expand(sympy.exp(-lam * beyond))

    left = d.step(
        "left",
        "integrate",
        kappa**2 / (2 * a_minus),
        Identity(lambda: sympy.integrate(weight(0), (u, -sympy.oo, -1))),
        left=r"I_{\mathrm{left}} = \int_{-\infty}^{-1} e^{-2 V(u)/\kappa^2} \, du",
    )
    right = d.step(
        "right",
        "integrate",
        -(kappa**2) / (2 * a_plus) * sympy.exp(-lam * V_1),
        Identity(lambda: sympy.integrate(weight(2), (u, 1, sympy.oo))),
        left=r"I_{\mathrm{right}} = \int_{1}^{\infty} e^{-2 V(u)/\kappa^2} \, du",
    )
    d.conclude((Symbol("I_left"), Symbol("I_right")), (left, right))


@derives("eq:P", "The occupation probability from the steady state", ("eq:pss",))
def probability(d: Any) -> None:
    outer = Symbol("M", positive=True)
    K = Symbol("K", positive=True)

    def masses() -> list[Any]:
        # What stands beside e^{-2V/kappa^2}, whose integrals N and M are.
        front = sympy.simplify(d.use("eq:pss", "p_ss(u)") * sympy.exp(2 * V(u) / kappa**2))
        return [front * N, front * outer]

    inside, outside = d.step(
        "mass inside and outside the layer",
        "integrate",
        (K * N, K * outer),
        Identity(masses),
        "N, M: integrals of e^{-2V/kappa^2} inside and outside the layer",
        left=(
            r"\int_{|u| < 1} p_{\mathrm{ss}} \, du",
            r"\int_{|u| > 1} p_{\mathrm{ss}} \, du",
        ),
    )
    constant = d.step(
        "normalise",
        "solve",
        1 / (N + outer),
        Satisfies(lambda value: {"mass 1": (inside + outside).subs(K, value) - 1}),
        "K, so that the whole mass is 1",
        left="K",
    )
    found = d.step(
        "mass inside, normalised",
        "substitute",
        N / (N + outer),
        Identity(lambda: inside.subs(K, constant)),
        left="P = K N",
    )
    d.conclude(
        Symbol("P"),
        found,
        note="N, M are the integrals of e^{-2V/kappa^2} inside and outside the layer",
    )


@derives("eq:P2", "The occupation probability by the integral over the layer", ("eq:P", "tails"))
def probability_closed(d: Any) -> None:
    tails = kappa**2 / (2 * a_minus) - kappa**2 / (2 * a_plus) * sympy.exp(-lam * V_1)
    d.step(
        "mass outside the layer",
        "substitute",
        tails,
        Identity(lambda: sum(d.use("tails", "I_left", "I_right"))),
        "the integrals over both tails",
        left=r"M = I_{\mathrm{left}} + I_{\mathrm{right}}",
    )
    found = d.step(
        "divide through",
        "substitute",
        1 / (1 + tails / N),
        Identity(
            lambda: d.use("eq:P", "P").subs(
                Symbol("M", positive=True), sum(d.use("tails", "I_left", "I_right"))
            )
        ),
        left=r"P = \frac{1}{1 + M/N}",
    )
    d.conclude(
        Symbol("P"),
        found,
        note="N is the integral of e^{-2V/kappa^2} over the layer",
    )


@derives("eq:Plarge2", "Occupation in strong noise", ("eq:P2",))
def strong(d: Any) -> None:
    e, moment = Symbol("e", positive=True), Symbol("m_1", real=True)

    def series() -> Any:
        # N = 2 - e m_1 + ..., e = 2/kappa^2 and m_1 the integral of V over the layer.
        formula = d.use("eq:P2", "P").subs(kappa, sympy.sqrt(2 / e)).subs(N, 2 - e * moment)
        return sympy.limit(formula / e, e, 0)

    d.suppose("kappa >> 1")
    coefficient = d.step(
        "coefficient of 2/kappa^2",
        "take limit",
        2 / (1 / a_minus - 1 / a_plus),
        Identity(series),
        left=r"\lim_{\kappa \to \infty} \frac{\kappa^2}{2} P",
    )
    found = d.step(
        "remainder",
        "expand",
        Expansion(coefficient * lam, kappa**-4, kappa, sympy.oo),
        Order(occupation, ("1e1", "1e2", "1e3", "1e4"), ENDS),
        left="P",
    )
    d.conclude(Symbol("P"), found, "O(kappa^-4), kappa large")


@derives("L-bound", "A lower bound on the occupation for any noise", ("eq:P2", "eq:V2"))
def lower_bound(d: Any) -> None:
    L, gap, s = (Symbol(n, positive=True) for n in ("L", "delta", "s"))
    crossing = Symbol("a_plus", positive=True)
    slope = d.step(
        "slope of V at the right edge",
        "differentiate",
        -a_plus,
        Identity(lambda: sympy.diff(d.use("eq:V2", "V(u)")[2], u).subs(crossing, a_plus)),
        "so V < V(1) on some (1 - L, 1), whatever the sign of V(1)",
        left="V'(1)",
    )
    d.suppose("V'(1) > 0", "checked", "from a+ < 0", lambda: bool(slope.is_positive))
    below = d.step(
        "integrand on (1 - L, 1)",
        "bound",
        Inequality(sympy.exp(-lam * (V_1 - gap)), ">=", sympy.exp(-lam * V_1)),
        Bound(
            difference=sympy.exp(-lam * V_1) * (sympy.exp(lam * gap) - 1),
            on="V = V(1) - delta, delta > 0",
        ),
    )
    floor = d.step(
        "integral of the lower bound",
        "integrate",
        L * sympy.exp(-lam * V_1),
        Satisfies(
            lambda floor: {
                "its integral": floor - sympy.integrate(below.smaller, (u, 1 - L, 1)),
                "the larger side is the integrand": below.larger.subs(gap, V_1 - V(u))
                - sympy.exp(-lam * V(u)),
            }
        ),
        left=r"\int_{1 - L}^{1} e^{-2 V(1)/\kappa^2} \, du",
    )
    low = d.step(
        "N replaced by its lower bound",
        "substitute",
        1 / (1 + kappa**2 / (2 * L) * (sympy.exp(lam * V_1) / a_minus - 1 / a_plus)),
        Identity(lambda: d.use("eq:P2", "P").subs(N, floor)),
        left=r"P_{\mathrm{bound}}",
    )
    whole = d.use("eq:P2", "P")
    tails = sympy.expand(N / whole - N)
    d.step(
        "P grows with N",
        "bound",
        Inequality(whole.subs(N, floor + s), ">=", low),
        Bound(
            difference=s * tails / ((floor + s + tails) * (floor + tails)),
            on="all L, s > 0, where N = L e^{-2V(1)/kappa^2} + s",
        ),
    )
    d.suppose("V(1) <= 0", where="used only to bound the exponential by 1; else reflect u -> -u")
    d.conclude(Symbol("P_low"), low, "a lower bound", note="V <= V(1) on (1 - L, 1)")


@derives(
    "eq:Psmall2", "Occupation in weak noise: 1 - P is exponentially small", ("L-bound", "eq:P2")
)
def weak(d: Any) -> None:
    V_m = Symbol("V_m", real=True)
    curvature = Symbol("K_m", positive=True)
    d.suppose("kappa << 1 and one lowest well inside the layer, of curvature V''(u_m) > 0")
    L = Symbol("L", positive=True)
    bracket = kappa**2 / (2 * L) * (sympy.exp(lam * V_1) / a_minus - 1 / a_plus)
    d.step(
        "from the lower bound",
        "bound",
        Inequality(1 - d.use("L-bound", "P_low"), "<=", bracket),
        Bound(
            difference=bracket**2 / (1 + bracket),
            on="all L > 0; the right side is O(kappa^2) where V(1) <= 0",
        ),
        "1 - P = O(kappa^2): true, and not sharp",
    )
    width = d.step(
        "Laplace's method for N",
        "integrate",
        kappa * sympy.sqrt(sympy.pi / curvature) * sympy.exp(-lam * V_m),
        Identity(
            lambda: (
                sympy.exp(-lam * V_m)
                * sympy.integrate(sympy.exp(-curvature * u**2 / kappa**2), (u, -sympy.oo, sympy.oo))
            )
        ),
        left=r"N \sim",
    )
    leading = d.step(
        "tails over N",
        "substitute",
        kappa
        * sympy.sqrt(curvature)
        / (2 * sympy.sqrt(sympy.pi))
        * (sympy.exp(lam * V_m) / a_minus - sympy.exp(lam * (V_m - V_1)) / a_plus),
        Identity(lambda: (1 / d.use("eq:P2", "P") - 1).subs(N, width)),
        "1/P - 1, which is 1 - P to this order",
        left=r"\frac{1}{P} - 1 = \frac{M}{N} \sim",
    )

    def measured(scene: Scene) -> Order:
        at: dict[Any, Any] = {
            a_minus: lambda k, ctx: scene.end(ctx, -1),
            a_plus: lambda k, ctx: scene.end(ctx, 1),
            V_1: lambda k, ctx: scene.V(ctx, ctx.mpf(1)),
            V_m: lambda k, ctx: scene.V(ctx, scene.roots(ctx)[0]),
            curvature: lambda k, ctx: -scene.phi(ctx, scene.roots(ctx)[0], 1),
        }
        return Order(
            lambda k, ctx: outside_share(scene, k, ctx), ("1e-1", "1e-2", "1e-3"), at, digits=50
        )

    found = d.step(
        "sharp form",
        "expand",
        Expansion(leading, leading * kappa**2, kappa),
        Together((measured(SCENE), measured(LEVEL))),
        "measured on two drifts: one tail leading, and both of equal size",
        left="1 - P",
    )
    d.conclude(
        1 - Symbol("P"),
        found,
        "relative O(kappa^2); the paper has P = 1 + O(kappa^2)",
        note="u_m is the lowest point of V",
    )
