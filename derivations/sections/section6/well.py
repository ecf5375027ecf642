"""Section 6.2 and appendix A.3, weak noise: the well's term, the Stokes multiplier."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.numerics import WELL as SCENE
from derivations.numerics import Scene, around, integral, well_integral
from derivations.paper import V, a_minus, a_plus, kappa, lam, phi, r, u, u1, u2, v
from derivations.registry import derives
from derivations.sections.section6.crossing import ranges
from symasym.derivation import Expansion, Identity, Leading, Order, Satisfies, Together

D = Symbol("D", positive=True)
A1, A2 = Symbol("A_1", negative=True), Symbol("A_2", positive=True)
V_1, V_2 = Symbol("V_u1", real=True), Symbol("V_u2", real=True)
S1, S2 = Symbol("s_1", positive=True), Symbol("s_2", positive=True)
WEAK = ("1e-1", "1e-2", "1e-3", "1e-4")
prefactor = 2 * sympy.pi / sympy.sqrt(-A1 * A2)


def at_scene(scene: Scene) -> dict[Any, Any]:
    """Values of the symbols on a scene with one well and one barrier."""
    return {
        D: lambda k, ctx: scene.V(ctx, scene.roots(ctx)[1]) - scene.V(ctx, scene.roots(ctx)[0]),
        A1: lambda k, ctx: scene.phi(ctx, scene.roots(ctx)[0], 1),
        A2: lambda k, ctx: scene.phi(ctx, scene.roots(ctx)[1], 1),
        V_1: lambda k, ctx: scene.V(ctx, scene.roots(ctx)[0]),
        V_2: lambda k, ctx: scene.V(ctx, scene.roots(ctx)[1]),
        a_minus: lambda k, ctx: scene.end(ctx, -1),
        a_plus: lambda k, ctx: scene.end(ctx, 1),
    }


@derives("laplace-substitution", "The substitution at the saddle", ("eq:fourPieces",))
def substitution(d: Any) -> None:
    a, b = Symbol("uhat", real=True), Symbol("vhat", real=True)

    def transformed() -> list[Any]:
        u_of, v_of = u1 + kappa * a, u2 + kappa * b
        jacobian = sympy.Matrix([u_of, v_of]).jacobian([a, b]).det()
        inner, outer = ranges(d.use("eq:fourPieces", "T_2"))
        return [
            jacobian,
            *(sympy.solve(v_of - end, b)[0] for end in outer),
            *(sympy.solve(u_of - end.subs(v, v_of), a)[0] for end in inner),
        ]

    d.step(
        "Jacobian and limits",
        "substitute",
        (kappa**2, -u2 / kappa, (1 - u2) / kappa, (-1 - u1) / kappa, b + (u2 - u1) / kappa),
        Identity(transformed),
        left=(
            r"\frac{\partial(u, v)}{\partial(\hat u, \hat v)}",
            r"\hat v \big|_{v = 0}",
            r"\hat v \big|_{v = 1}",
            r"\hat u \big|_{u = -1}",
            r"\hat u \big|_{u = v}",
        ),
    )
    c = sympy.symbols("c2:6", real=True)
    h = Symbol("h", real=True)

    def taylor() -> Any:
        local = V_1 + c[0] * h**2 / 2 + c[1] * h**3 / 6 + c[2] * h**4 / 24
        return sympy.series(local.subs(h, kappa * a), kappa, 0, 3).removeO()

    found = d.step(
        "V at the saddle",
        "expand",
        V_1 + c[0] * kappa**2 * a**2 / 2,
        Identity(taylor),
        "V'(u1) = 0; the rest is O(kappa^3), odd at that order",
        left=r"V(u) \sim",
    )
    d.conclude(V(u), found, "O(kappa^3)", note="u = u1 + kappa uhat, c_2 = V''(u1)")


@derives(
    "gaussian-step",
    "Both Gaussian integrals over the whole line",
    ("laplace-substitution", "eq:V"),
)
def gaussian(d: Any) -> None:
    a, b = Symbol("uhat", real=True), Symbol("vhat", real=True)

    def one_side() -> Any:
        """The well's integral over e^{-lam V(u1)}, its V as in laplace-substitution."""
        bend = d.use("laplace-substitution", "V(u)") - V_1
        bend = bend.subs(Symbol("c2", real=True), S1)
        return kappa * sympy.integrate(sympy.exp(-lam * bend), (a, -sympy.oo, sympy.oo))

    one = d.step(
        "one Gaussian",
        "integrate",
        kappa * sympy.sqrt(sympy.pi / S1),
        Identity(one_side),
        "s1 = V''(u1), lam kappa^2 = 2",
        left=r"\kappa \int_{-\infty}^{\infty} e^{-s_1 \hat u^2} \, d\hat u",
    )

    def both() -> Any:
        jacobian = d.use("laplace-substitution", step="Jacobian and limits")[0]
        weight = sympy.exp(-S1 * a**2) * sympy.exp(-S2 * b**2)
        line = (-sympy.oo, sympy.oo)
        return lam * jacobian * sympy.integrate(weight, (a, *line), (b, *line))

    whole = d.step(
        "Gaussians",
        "integrate",
        2 * sympy.pi / sympy.sqrt(S1 * S2),
        Satisfies(
            lambda found: {
                "in the substituted variables": found - both(),
                "a product of two": found - lam * one * one.subs(S1, S2),
            }
        ),
        "s2 = -V''(u2); what the finite limits cut off is exponentially small",
        left="G",
    )
    bend = d.step(
        "V'' = -A'",
        "differentiate",
        -sympy.Derivative(phi(u), u),
        Identity(lambda: sympy.diff(d.use("eq:V", "V(u)"), u, 2)),
        left="V''(u)",
    )

    def in_slopes() -> Any:
        curvatures = [bend.replace(sympy.Derivative, lambda *_, A=A: A) for A in (A1, A2)]
        return whole.subs({S1: curvatures[0], S2: -curvatures[1]})

    found = d.step("in terms of A'", "substitute", prefactor, Identity(in_slopes), left="G")
    d.conclude(
        Symbol("G"),
        found,
        note="G is lam times the integral of e^{-(V''(u1) (u - u1)^2 - V''(u2) (v - "
        "u2)^2)/kappa^2}",
    )


@derives(
    "eq:secondTerm",
    "The second piece: Kramers' time and its first correction",
    ("gaussian-step", "saddle-series"),
)
def second(d: Any) -> None:
    d.suppose("two simple roots -1 < u1 < u2 < 1 of A, and u2 > 0")
    leading = d.step(
        "leading term",
        "substitute",
        prefactor * sympy.exp(2 * D / kappa**2),
        Identity(lambda: d.use("gaussian-step", "G") * sympy.exp(lam * D)),
        left=r"T_2 \sim",
    )
    depth = Symbol("s", positive=True)
    d.step(
        "logarithm",
        "evaluate",
        sympy.log(2 * sympy.pi) + 2 * D / kappa**2 - sympy.log(-A1 * A2) / 2,
        Identity(
            lambda: sympy.expand_log(sympy.log(leading.subs(A1, -depth)), force=True).subs(
                depth, -A1
            )
        ),
        "finite where the term itself overflows",
        left=r"\log T_2 \sim",
    )
    found = d.step(
        "sharp order",
        "expand",
        Expansion(leading, leading * kappa**2, kappa),
        Order(lambda k, ctx: well_integral(ctx, SCENE, k), WEAK, at_scene(SCENE), digits=60),
        "the odd order cancels: O(kappa^2), where the paper has O(kappa)",
        left="T_2",
    )
    c2, c3, c4 = Symbol("c_2", positive=True), Symbol("c_3", real=True), Symbol("c_4", real=True)
    q2, q3, q4 = Symbol("q_2", positive=True), Symbol("q_3", real=True), Symbol("q_4", real=True)
    well = d.step(
        "correction of one saddle",
        "integrate",
        kappa**2 / 2 * (5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2)),
        Identity(lambda: d.use("saddle-series", step="first correction") / lam),
        "c_j = V^(j)(u1), and q_j = -V^(j)(u2) at the barrier",
        left=r"\frac{Q_1}{\lambda}",
    )
    barrier = well.subs({c2: q2, c3: q3, c4: q4})
    values: dict[Any, Any] = at_scene(SCENE)
    for j, (c, q) in enumerate(((c2, q2), (c3, q3), (c4, q4)), start=1):
        values[c] = lambda k, ctx, j=j: -SCENE.phi(ctx, SCENE.roots(ctx)[0], j)
        values[q] = lambda k, ctx, j=j: SCENE.phi(ctx, SCENE.roots(ctx)[1], j)
    d.step(
        "next order",
        "expand",
        Expansion(leading * (1 + well + barrier), leading * kappa**4, kappa),
        Order(lambda k, ctx: well_integral(ctx, SCENE, k), WEAK, values, digits=60),
        left="T_2",
    )
    d.conclude(
        Symbol("T_2"),
        found,
        "relative O(kappa^2)",
        note="D = V(u2) - V(u1), the height of the barrier. With its first correction, the factor "
        "1 + (kappa^2/2) (Q(u1) + Q(u2)), the error is relative O(kappa^4): "
        "Q = 5 c_3^2/(24 c_2^3) - c_4/(8 c_2^2), with c_j the derivatives of V at the well and of "
        "-V at the barrier ('saddle-series')",
    )


@derives("eq:fourthTerm2", "The fourth piece in weak noise", ("eq:fourthTerm",))
def fourth_weak(d: Any) -> None:
    def limit() -> Any:
        width = Symbol("width", positive=True)
        closed = d.use("eq:fourthTerm", step="closed form").subs(r, 1 + width)
        return sympy.limit(closed, kappa, 0).subs(width, r - 1)

    width = r - 1
    beyond = kappa**2 / (2 * a_plus**2) * (1 - sympy.exp(-2 * a_plus * width / kappa**2))
    d.step(
        "closed form",
        "substitute",
        width / a_plus - beyond,
        Identity(lambda: d.use("eq:fourthTerm", step="closed form")),
        "as it was integrated for eq:fourthTerm",
        left="T_4",
    )
    found = d.step(
        "as kappa -> 0",
        "take limit",
        r / a_plus - 1 / a_plus,
        Identity(limit),
        "the exponential in the closed form is below any power of kappa",
        left=r"\lim_{\kappa \to 0} T_4",
    )
    d.conclude(Symbol("T_4"), found, "O(kappa^2)")


@derives(
    "other-pieces",
    "The first and the third piece in weak noise",
    ("eq:fourPieces", "eq:V2", "gaussian-step", "eq:secondTerm"),
)
def others(d: Any) -> None:
    values = at_scene(SCENE)
    top = Symbol("V_top", real=True)
    values[top] = lambda k, ctx: SCENE.V(ctx, ctx.mpf(1))

    def beyond(sign: int, side: int, ends: tuple[Any, Any]) -> Any:
        """e^{-lam V} (sign -1) or e^{lam V} over one side of the layer, as kappa -> 0."""
        V_side = d.use("eq:V2", "V(u)")[1 + side]
        V_side = sympy.expand(V_side - V_side.subs(u, side))
        whole = sympy.integrate(sympy.expand(sympy.exp(sign * lam * V_side)), (u, *ends))
        return sympy.expand(whole).replace(sympy.exp, lambda _: 0)

    def first() -> Any:
        inner, outer = ranges(d.use("eq:fourPieces", "T_1"))
        if outer != (0, 1):  # which holds the barrier
            raise ValueError(f"the first piece is over {outer}")
        at_barrier = d.use("gaussian-step", step="one Gaussian").subs(S1, A2)
        return lam * beyond(-1, -1, inner) * at_barrier * sympy.exp(lam * V_2)

    def third() -> Any:
        (low, high), outer = ranges(d.use("eq:fourPieces", "T_3"))
        if (low, high) != (-r, 1):  # which holds the well
            raise ValueError(f"the third piece is over {(low, high)}")
        at_well = d.use("gaussian-step", step="one Gaussian").subs(S1, -A1)
        return lam * at_well * beyond(1, 1, outer) * sympy.exp(lam * (top - V_1))

    left = kappa * sympy.sqrt(sympy.pi / A2) / a_minus * sympy.exp(2 * V_2 / kappa**2)
    right = kappa * sympy.sqrt(-sympy.pi / A1) / a_plus * sympy.exp(2 * (top - V_1) / kappa**2)
    before = d.step(
        "first piece",
        "expand",
        Expansion(left, left * kappa**2, kappa),
        Together((Leading(first), Order(_first, WEAK, values, digits=60))),
        "the integral of e^{-lam V} over (-r, -1), times a Gaussian at the barrier",
        left="T_1",
    )
    after = d.step(
        "third piece",
        "expand",
        Expansion(right, right * kappa**2, kappa),
        Together((Leading(third), Order(_third, WEAK, values, digits=60))),
        "a Gaussian at the well, times the integral of e^{lam V} over (1, r)",
        left="T_3",
    )
    d.step(
        "against the well's term",
        "substitute",
        (
            kappa * sympy.sqrt(-A1) / (2 * a_minus * sympy.sqrt(sympy.pi)) * sympy.exp(lam * V_1),
            kappa
            * sympy.sqrt(A2)
            / (2 * a_plus * sympy.sqrt(sympy.pi))
            * sympy.exp(lam * (top - V_2)),
        ),
        Identity(
            lambda: [
                piece.leading / d.use("eq:secondTerm", "T_2").leading.subs(D, V_2 - V_1)
                for piece in (before, after)
            ]
        ),
        "exponentially small where V(u1) < 0 and V(1) < V(u2)",
        left=(
            r"\frac{T_1}{T_2} \sim",
            r"\frac{T_3}{T_2} \sim",
        ),
    )
    d.suppose(
        "V(u1) < V(-1) = 0 and V(1) < V(u2)",
        "checked",
        "phi > 0 left of u1 and right of u2; so both are exponentially smaller than T_2",
        _below,
    )
    d.suppose(
        "V(u1) < V(1)",
        where="the third piece; else what u = 1 itself contributes, O(kappa^2), is larger",
    )
    d.conclude(
        Symbol("T_3"),
        after,
        "relative O(kappa^2)",
        note="T_1 and T_3 are exponentially smaller than T_2, the well's term of eq:secondTerm",
        display=("T_1 = ", before, r" ,\quad T_3 = ", after),
    )


def _below() -> bool:
    import mpmath

    low, high = SCENE.roots(mpmath.mp)
    V = [SCENE.V(mpmath.mp, x) for x in (low, high, mpmath.mpf(1))]
    return bool(V[0] < 0 and V[2] < V[1])


def _first(k: Any, ctx: Any) -> Any:
    lam = 2 / k**2
    _, high = SCENE.roots(ctx)
    top = SCENE.V(ctx, high)
    width = 1 / ctx.sqrt(lam * SCENE.phi(ctx, high, 1))
    outer = integral(
        ctx, lambda x: ctx.exp(lam * (SCENE.V(ctx, x) - top)), around(ctx, high, width, 0, 1)
    )
    # The inner integral is 1/(lam a-) up to e^{-lam a- (r-1)}, which C-bound's scale drops.
    return outer * ctx.exp(lam * top) / SCENE.end(ctx, -1)


def _third(k: Any, ctx: Any) -> Any:
    lam = 2 / k**2
    low, _ = SCENE.roots(ctx)
    bottom = SCENE.V(ctx, low)
    width = 1 / ctx.sqrt(-lam * SCENE.phi(ctx, low, 1))
    inner = integral(
        ctx, lambda x: ctx.exp(-lam * (SCENE.V(ctx, x) - bottom)), around(ctx, low, width, -1, 1)
    )
    return ctx.exp(lam * (SCENE.V(ctx, ctx.mpf(1)) - bottom)) * inner / SCENE.end(ctx, 1)


@derives(
    "eq:Ttildesmall",
    "The mean escape time in weak noise",
    ("eq:secondTerm", "eq:fourthTerm2", "other-pieces", "C-bound"),
)
def small(d: Any) -> None:
    d.suppose("u1 and u2 are simple zeros; u1, u2, 0 and 1 are several kappa apart")
    d.suppose(
        "the formula holds up to the fold",
        "fails",
        "friction, mu = 3, z0 = -777/1000, kappa = 1/10",
        lambda: d.holds("near_fold"),
    )
    d.suppose(
        "the formula holds up to u2 = 1",
        "fails",
        "friction, mu = 3, z0 = -1/10000, kappa = 1/10",
        lambda: d.holds("near_edge"),
    )
    formula = d.step(
        "sum",
        "substitute",
        prefactor * sympy.exp(2 * D / kappa**2) + r / a_plus,
        Identity(
            lambda: (
                d.use("eq:secondTerm", "T_2").leading
                + sympy.expand(d.use("eq:fourthTerm2", "T_4")).coeff(r) * r
            )
        ),
        "the second and the fourth piece, the latter for large r",
        left=r"T \sim",
    )
    deep, high = Symbol("depth", positive=True), Symbol("height", positive=True)
    top = Symbol("V_top", real=True)

    def smaller() -> list[Any]:
        first, third = d.use("other-pieces", step="against the well's term")
        small = [first.subs(V_1, -deep), third.subs(V_2, top + high), d.use("C-bound", "C_high")]
        return [sympy.limit(sympy.powsimp(e) / kappa**8, kappa, 0) for e in small]

    d.step(
        "what is left out",
        "take limit",
        (sympy.S.Zero, sympy.S.Zero, sympy.S.Zero),
        Identity(smaller),
        "first and third piece over the well's term, and C by its bound: below any power of kappa",
        left=(
            r"\lim_{\kappa \to 0} \frac{T_1}{\kappa^8 T_2}",
            r"\lim_{\kappa \to 0} \frac{T_3}{\kappa^8 T_2}",
            r"\lim_{\kappa \to 0} \frac{C_{\mathrm{bound}}}{\kappa^8}",
        ),
    )
    found = d.step(
        "order, where both terms are of one size",
        "expand",
        Expansion(formula, kappa**2 * sympy.exp(2 * D / kappa**2), kappa),
        Order(
            _whole, ("1e-1", "3e-2", "1e-2", "3e-3"), {**at_scene(SCENE), r: _comparable}, digits=60
        ),
        "r = e^{2D/kappa^2}; relative O(kappa^2) for the exponential term, O(1) for the other",
        left="T",
    )
    d.conclude(
        Symbol("T"),
        found,
        "relative O(kappa^2) in the exponential term, O(1) in the other",
        note="D = V(u2) - V(u1), the height of the barrier; the exponential term is that of a well "
        "with 0 < u2 < 1; the paper has S of eq:S before it, 0 without such a well",
    )


def _comparable(k: Any, ctx: Any) -> Any:
    low, high = SCENE.roots(ctx)
    return ctx.exp(2 * (SCENE.V(ctx, high) - SCENE.V(ctx, low)) / k**2)


def _whole(k: Any, ctx: Any) -> Any:
    r, ap = _comparable(k, ctx), SCENE.end(ctx, 1)
    fourth = (r - 1) / ap - k**2 / (2 * ap**2)
    return well_integral(ctx, SCENE, k) + _first(k, ctx) + _third(k, ctx) + fourth
