"""Section 6.2 and appendix A.3, weak noise: the well's term, the Stokes multiplier."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.numerics import WELL as SCENE
from derivations.numerics import Scene, around, integral, well_integral
from derivations.paper import V, a_minus, a_plus, kappa, lam, phi, r, t, u, u1, u2
from derivations.registry import derives
from symasym.derivation import Expansion, Identity, Order

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
        return [
            jacobian,
            sympy.solve(v_of - 0, b)[0],
            sympy.solve(v_of - 1, b)[0],
            sympy.solve(u_of + 1, a)[0],
            sympy.solve(u_of - v_of, a)[0],
        ]

    d.step(
        "Jacobian and limits",
        "substitute",
        (kappa**2, -u2 / kappa, (1 - u2) / kappa, (-1 - u1) / kappa, b + (u2 - u1) / kappa),
        Identity(transformed),
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
    )
    d.conclude(V(u), found, "O(kappa^3)", note="u = u1 + kappa uhat, c_2 = V''(u1)")


@derives("gaussian-step", "Both Gaussian integrals over the whole line", ("laplace-substitution",))
def gaussian(d: Any) -> None:
    a, b = Symbol("uhat", real=True), Symbol("vhat", real=True)
    whole = d.step(
        "Gaussians",
        "integrate",
        2 * sympy.pi / sympy.sqrt(S1 * S2),
        Identity(
            lambda: (
                2
                * sympy.integrate(sympy.exp(-S1 * a**2), (a, -sympy.oo, sympy.oo))
                * sympy.integrate(sympy.exp(-S2 * b**2), (b, -sympy.oo, sympy.oo))
            )
        ),
        "s1 = V''(u1), s2 = -V''(u2); lam kappa^2 = 2; what the finite limits cut off is "
        "exponentially small",
    )
    d.step(
        "V'' = -A'",
        "differentiate",
        -sympy.Derivative(phi(u), u),
        Identity(lambda: sympy.diff(-sympy.Integral(phi(t), (t, -1, u)), u, 2)),
    )
    found = d.step(
        "in terms of A'", "substitute", prefactor, Identity(lambda: whole.subs({S1: -A1, S2: A2}))
    )
    d.conclude(Symbol("P"), found)


@derives(
    "eq:secondTerm", "The second piece: the well's term and its sharp order", ("gaussian-step",)
)
def second(d: Any) -> None:
    d.suppose("two simple roots -1 < u1 < u2 < 1 of A, and u2 > 0")
    leading = prefactor * sympy.exp(2 * D / kappa**2)
    d.step(
        "leading term",
        "substitute",
        leading,
        Identity(lambda: d.use("gaussian-step") * sympy.exp(lam * D)),
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
    )
    found = d.step(
        "sharp order",
        "expand",
        Expansion(leading, leading * kappa**2, kappa),
        Order(lambda k, ctx: well_integral(ctx, SCENE, k), WEAK, at_scene(SCENE), digits=60),
        "the odd order cancels: O(kappa^2), where the paper has O(kappa)",
    )
    s, c2, c3, c4 = (
        Symbol("s", real=True),
        Symbol("c_2", positive=True),
        Symbol("c_3", real=True),
        Symbol("c_4", real=True),
    )
    q2, q3, q4 = (Symbol("q_2", positive=True), Symbol("q_3", real=True), Symbol("q_4", real=True))

    def correction(x2: Any, x3: Any, x4: Any) -> Any:
        cube = -sympy.Rational(1, 3) * x3 * s**3 * kappa
        fourth = -sympy.Rational(1, 12) * x4 * s**4 * kappa**2
        weight = sympy.exp(-x2 * s**2)
        terms = sympy.expand(fourth + cube**2 / 2)
        whole = sympy.integrate(weight, (s, -sympy.oo, sympy.oo))
        return sympy.simplify(sympy.integrate(terms * weight, (s, -sympy.oo, sympy.oo)) / whole)

    well = kappa**2 / 2 * (5 * c3**2 / (24 * c2**3) - c4 / (8 * c2**2))
    barrier = kappa**2 / 2 * (5 * q3**2 / (24 * q2**3) - q4 / (8 * q2**2))
    d.step(
        "correction of one saddle",
        "integrate",
        well,
        Identity(lambda: correction(c2, c3, c4)),
        "c_j = V^(j)(u1), and q_j = -V^(j)(u2) at the barrier",
    )
    values: dict[Any, Any] = at_scene(SCENE)
    for j, (c, q) in enumerate(((c2, q2), (c3, q3), (c4, q4)), start=1):
        values[c] = lambda k, ctx, j=j: -SCENE.phi(ctx, SCENE.roots(ctx)[0], j)
        values[q] = lambda k, ctx, j=j: SCENE.phi(ctx, SCENE.roots(ctx)[1], j)
    d.step(
        "next order",
        "expand",
        Expansion(leading * (1 + well + barrier), leading * kappa**4, kappa),
        Order(lambda k, ctx: well_integral(ctx, SCENE, k), WEAK, values, digits=60),
    )
    d.conclude(
        Symbol("T_2"),
        found,
        "relative O(kappa^2)",
        note="D = V(u2) - V(u1), the height of the barrier",
    )


@derives("eq:fourthTerm2", "The fourth piece in weak noise", ("eq:fourthTerm",))
def fourth_weak(d: Any) -> None:
    found = d.step(
        "as kappa -> 0",
        "take limit",
        r / a_plus - 1 / a_plus,
        Identity(lambda: sympy.limit((r - 1) / a_plus - kappa**2 / (2 * a_plus**2), kappa, 0)),
        "the exponential in the closed form is below any power of kappa",
    )
    d.conclude(Symbol("T_4"), found, "O(kappa^2)")


@derives(
    "other-pieces",
    "First and third piece in weak noise, against the well's term",
    ("eq:fourPieces", "eq:secondTerm"),
)
def others(d: Any) -> None:
    values = at_scene(SCENE)
    first = kappa * sympy.sqrt(sympy.pi / A2) / a_minus * sympy.exp(2 * V_2 / kappa**2)
    d.step(
        "first piece",
        "expand",
        Expansion(first, first * kappa**2, kappa),
        Order(_first, WEAK, values, digits=60),
    )
    top = Symbol("V_top", real=True)
    third = kappa * sympy.sqrt(-sympy.pi / A1) / a_plus * sympy.exp(2 * (top - V_1) / kappa**2)
    values[top] = lambda k, ctx: SCENE.V(ctx, ctx.mpf(1))
    found = d.step(
        "third piece",
        "expand",
        Expansion(third, third * kappa**2, kappa),
        Order(_third, WEAK, values, digits=60),
    )
    d.suppose(
        "V(u1) < V(-1) = 0 and V(1) < V(u2)",
        "checked",
        "phi > 0 left of u1 and right of u2; so both are exponentially smaller than D's term",
        _below,
    )
    d.conclude(Symbol("T_3"), found, "relative O(kappa^2)")


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
    d.suppose("u1 and u2 simple and apart, u2 apart from 0 and 1: several kappa each")
    d.suppose(
        "it holds up to the fold",
        "fails",
        "friction, mu = 3, z0 = -777/1000, kappa = 1/10",
        lambda: d.holds("near_fold"),
    )
    d.suppose(
        "it holds up to u2 = 1",
        "fails",
        "friction, mu = 3, z0 = -1/10000, kappa = 1/10",
        lambda: d.holds("near_edge"),
    )
    formula = d.step(
        "sum",
        "substitute",
        prefactor * sympy.exp(2 * D / kappa**2) + r / a_plus,
        Identity(lambda: d.use("eq:secondTerm").leading + d.use("eq:fourthTerm2") + 1 / a_plus),
    )
    found = d.step(
        "order, where both terms are of one size",
        "expand",
        Expansion(formula, kappa**2 * sympy.exp(2 * D / kappa**2), kappa),
        Order(
            _whole, ("1e-1", "3e-2", "1e-2", "3e-3"), {**at_scene(SCENE), r: _comparable}, digits=60
        ),
        "r = e^{2D/kappa^2}; relative O(kappa^2) for the first term, O(1) for the second",
    )
    d.conclude(
        Symbol("T"),
        found,
        "relative O(kappa^2) in the first term, O(1) in the second",
        note="D = V(u2) - V(u1), the height of the barrier",
    )


def _comparable(k: Any, ctx: Any) -> Any:
    low, high = SCENE.roots(ctx)
    return ctx.exp(2 * (SCENE.V(ctx, high) - SCENE.V(ctx, low)) / k**2)


def _whole(k: Any, ctx: Any) -> Any:
    r, ap = _comparable(k, ctx), SCENE.end(ctx, 1)
    fourth = (r - 1) / ap - k**2 / (2 * ap**2)
    return well_integral(ctx, SCENE, k) + _first(k, ctx) + _third(k, ctx) + fourth
