"""Section 6.2, end: the Stokes multiplier, and the way back to unscaled time."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Symbol

from derivations.numerics import Scene, around, integral, split_pieces, well_integral
from derivations.paper import a_plus, eps, kappa, r, t, u2
from derivations.registry import derives
from derivations.sections.section6.well import A1, A2, V_1, WEAK, at_scene
from symasym.derivation import Expansion, Identity, Order, Satisfies


@derives(
    "eq:S",
    "The Stokes multiplier of a well, and how it changes as the barrier passes 0 or a well is born",
    ("eq:Ttildesmall", "laplace-substitution", "pair-products"),
)
def stokes(d: Any) -> None:
    d.suppose(
        "for u2 < 0 no term of T is exponentially large",
        "fails",
        "A = 4 (u + 4/5)(u + 1/10), kappa = 1/20, start at 0",
        lambda: d.holds("behind_barrier"),
    )
    whole = d.use("eq:Ttildesmall", "T").leading
    well_term = whole.subs(r, 0)
    start_drift = Symbol("phi_0", positive=True)
    smooth = Scene((Fraction(2, 3), Fraction(1, 2)))
    regular = sympy.log(a_plus / start_drift) / (a_plus - start_drift) - 1 / a_plus
    d.step(
        "no well: S = 0",
        "expand",
        Expansion(whole - well_term + regular, kappa**2, kappa),
        Order(
            lambda k, ctx: sum(split_pieces(ctx, smooth, k, ctx.mpf(10))),
            ("3e-1", "1e-1", "3e-2", "1e-2"),
            {a_plus: "7/6", start_drift: "2/3", r: "10"},
            digits=40,
        ),
        "for the linear A = 2/3 + u/2; the O(1) is the integral of 1/A over (0, 1) less 1/a+",
        left="T",
    )
    V_0 = Symbol("V_0", real=True)
    behind = Scene((Fraction(8, 25), Fraction(18, 5), Fraction(4)))
    leading = (
        kappa * sympy.sqrt(-sympy.pi / A1) / start_drift * sympy.exp(2 * (V_0 - V_1) / kappa**2)
    )
    values = at_scene(behind) | {
        start_drift: lambda k, ctx: behind.phi(ctx, ctx.zero),
        V_0: lambda k, ctx: behind.V(ctx, ctx.zero),
    }
    d.step(
        "u2 < 0: start behind the barrier",
        "expand",
        Expansion(leading, leading * kappa**2, kappa),
        Order(lambda k, ctx: _start_behind(ctx, behind, k), WEAK, values, digits=60),
        "a well exists, S = 0 by the paper's condition, and yet T is exponentially large "
        "if V(0) > V(u1)",
        left="T",
    )
    at_top = Scene((Fraction(0), Fraction(3, 2), Fraction(27, 8), Fraction(3, 8)))
    half = well_term / 2
    d.step(
        "u2 = 0: start on the barrier",
        "expand",
        Expansion(half, half * kappa, kappa),
        Order(lambda k, ctx: well_integral(ctx, at_top, k), WEAK, at_scene(at_top), digits=60),
        "half the well's term, now with an O(kappa) correction: no jump from 0 to 1",
        left="T",
    )
    across = Symbol("vhat", real=True)

    def beyond_start() -> Any:
        """The share of the barrier's Gaussian that lies beyond the start."""
        (_, begin, *_) = d.use("laplace-substitution", step="Jacobian and limits")
        weight = sympy.exp(-A2 * across**2)
        line = sympy.integrate(weight, (across, -sympy.oo, sympy.oo))
        share = sympy.integrate(weight, (across, begin, sympy.oo)) / line
        return sympy.expand(share).rewrite(sympy.erf)

    at_start = d.step(
        "u2 near 0: the barrier passes the start",
        "integrate",
        (1 + sympy.erf(sympy.sqrt(A2) * u2 / kappa)) / 2,
        Identity(beyond_start),
        "the substituted integral begins at -u2/kappa",
        left="S",
    )
    some, ahead = Symbol("s", positive=True), Symbol("x", positive=True)
    cases = d.step(
        "u2 > 0, u2 = 0, u2 < 0",
        "take limit",
        (sympy.S.One, sympy.S.Half, sympy.S.Zero),
        Identity(
            lambda: [
                sympy.limit(at_start.subs(u2, place).subs(kappa, 1 / some), some, sympy.oo)
                for place in (ahead, 0, -ahead)
            ]
        ),
        "as kappa -> 0",
        left=(
            "S",
            "S",
            "S",
        ),
    )
    Z = Symbol("Z", real=True)

    def of_the_pair() -> Any:
        double = d.use("pair-products", "J")
        return double / (double + double.subs(Z, -Z))

    products = [sympy.airyai(z) ** 2 + sympy.airybi(z) ** 2 for z in (Z, -Z)]
    at_fold = d.step(
        "near the fold: well and barrier coalesce",
        "substitute",
        products[0] / sum(products),
        Identity(of_the_pair),
        "J(Z) of 'pair-products' over J(Z) + J(-Z), which is even in Z; T has "
        "p^2 lam^(1/3) J(Z), finite on the fold",
        left="S(Z)",
    )
    d.step(
        "on the fold", "evaluate", sympy.S.Half, Identity(lambda: at_fold.subs(Z, 0)), left="S(0)"
    )
    far = Symbol("Z", positive=True)
    d.step(
        "beyond the fold",
        "expand",
        Expansion(sympy.S.One, sympy.exp(-4 * far ** sympy.Rational(3, 2) / 3), far, sympy.oo),
        Order(_switched_on, ("4", "9", "16", "25"), digits=120),
        "1 with a well, and 0 before the fold, where Z < 0",
        left="S(Z)",
    )
    found = (cases[0], cases[1], cases[2], cases[2], at_start, at_fold)
    d.conclude(
        Symbol("S"),
        found,
        "leading order in kappa",
        cases=(
            r"\kappa \to 0, \ 0 < u_2 < 1",
            r"\kappa \to 0, \ u_2 = 0",
            r"\kappa \to 0, \ u_2 < 0",
            r"\kappa \to 0, \ A > 0",
            r"u_2 = O(\kappa)",
            r"Z = O(1)",
        ),
        note="A > 0 on the layer means that there is no well. S of u2, uniform through u2 = 0, "
        "multiplies the well's term of eq:Ttildesmall, as the barrier passes the start; for "
        "u2 < 0 another term may be large. S(Z) is another multiplier, uniform through the fold of "
        "well and barrier, where that term diverges: it multiplies pi^2 p^2 lam^(1/3) (G(Z) + "
        "G(-Z)), G = Ai^2 + Bi^2, which is finite there and for Z >> 1 is that term to leading "
        "order in zeta. Here p = du/ds half-way between the zeros, phi du = (s^2 - zeta) ds and "
        "Z = lam^(2/3) zeta, as for 'pair-products'",
    )


def _switched_on(Z: Any, ctx: Any) -> Any:
    """G(Z)/(G(Z) + G(-Z)), G = Ai^2 + Bi^2, by mpmath."""
    there, back = (ctx.airyai(x) ** 2 + ctx.airybi(x) ** 2 for x in (Z, -Z))
    return there / (there + back)


def _start_behind(ctx: Any, scene: Scene, k: Any) -> Any:
    """lam times e^{lam V(v)} over v in (0, 1), the inner integral over the whole well."""
    lam = 2 / k**2
    low, _ = scene.roots(ctx)
    bottom, begin = scene.V(ctx, low), scene.V(ctx, ctx.zero)
    inner = integral(
        ctx,
        lambda x: ctx.exp(-lam * (scene.V(ctx, x) - bottom)),
        around(ctx, low, 1 / ctx.sqrt(-lam * scene.phi(ctx, low, 1)), -1, 0),
    )
    step = 1 / (lam * scene.phi(ctx, ctx.zero))
    ends = [x for x in (4 * j * step for j in range(30)) if x < 1]
    outer = integral(ctx, lambda x: ctx.exp(lam * (scene.V(ctx, x) - begin)), ends)
    return lam * inner * outer * ctx.exp(lam * (begin - bottom))


@derives("eq:TtildetoT", "Back to unscaled time", ("eq:tildexykappa", "eq:Ttildelarge"))
def unscaled(d: Any) -> None:
    time = Symbol("t_s", positive=True)
    found = d.step(
        "time",
        "scale",
        eps * time,
        Satisfies(
            lambda real: {
                "inverse of the scaling": d.use("eq:tildexykappa", "t_s").subs(t, real) - time
            }
        ),
        left=r"T_p = \langle t \rangle = \varepsilon \langle \tilde t \rangle =",
    )
    rho, c = Symbol("rho", positive=True), Symbol("c", positive=True)

    def relative() -> Any:
        T = d.use("eq:Ttildelarge", "T").leading
        return rho * sympy.diff(T.subs(a_plus, a_plus * (1 + c * rho)) / T, rho).subs(rho, 0)

    d.step(
        "error of the coefficients",
        "expand",
        -c * rho,
        Identity(relative),
        "a relative error c rho of a+ is a relative error -c rho of r/a+ (strong noise)",
        left=r"\frac{a^+}{a^+ (1 + c \rho)} - 1 \sim",
    )
    d.suppose(
        "kappa bounded from below",
        where="in weak noise an O(r_phys) error of V is divided by kappa^2 in an exponent",
    )
    d.conclude(Symbol("T"), found, "relative O(r_phys)")
