"""Section 6.2, strong noise: the bound on C, the four pieces, T = r/a+ + O(kappa^2)."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import Any

import sympy
from sympy import Function, Heaviside, Integral, Symbol

from derivations.numerics import Scene, pieces, split_pieces
from derivations.paper import C, V, a_minus, a_plus, kappa, lam, r, u, v
from derivations.registry import derives
from derivations.sections.section5.escape import (
    I0,
    I1,
    J0,
    J1,
    SCENE,
    C_in_halves,
    in_halves,
    on_exponentials,
)
from symasym.derivation import (
    Bound,
    Expansion,
    Identity,
    Inequality,
    Leading,
    Order,
    Satisfies,
    Together,
)
from symasym.derivation.numerical import evaluate

V_max = Symbol("V_max", real=True)
Delta = Symbol("Delta", positive=True)
ENDS = {a_minus: "12/5", a_plus: "2/5"}
STRONG = ("1e1", "1e2", "1e3", "1e4")


@derives("C-bound", "An upper bound on C, and its conditions", ("eq:C", "eq:V2"))
def bound_on_C(d: Any) -> None:
    X, Y, E, b, g, h, q, s, gap = (
        Symbol(n, positive=True) for n in ("X", "Y", "E", "b", "g", "h", "q", "s", "delta")
    )
    d.suppose(
        "r Delta >= 1 and e^{2 a- r (1 - Delta)/kappa^2} >= 1/Delta",
        where="what the paper's 'sufficiently small' has to mean in its first inequality",
    )
    d.suppose("V_max <= Delta a- r")
    d.suppose(
        "V_max <= Delta r, as printed, is enough",
        "fails",
        "A = 3 (u + 19/20)(u - 3/5), kappa = 1/5, r = 10, Delta = 1/4: C is far above the bound",
        lambda: d.holds("C_hypothesis"),
    )
    left = d.step(
        "left integral",
        "integrate",
        kappa**2 / (2 * a_minus) * (sympy.exp(lam * a_minus * (r - 1)) - 1),
        Identity(lambda: sympy.integrate(sympy.exp(lam * d.use("eq:V2", "V(u)")[0]), (u, -r, -1))),
        left=r"\int_{-r}^{-1} e^{2 V(v)/\kappa^2} \, dv",
    )
    # E = e^{lam a- r (1-Delta)} = (1+g)/Delta and r Delta = 1 + h: the conditions, as g, h > 0.
    below = d.step(
        "left integral from below",
        "bound",
        Inequality(E * sympy.exp(b * h) - 1, ">=", (1 - Delta) * E),
        Bound(
            difference=E * (sympy.exp(b * h) - 1) + g,
            given={E: (1 + g) / Delta},
            on="r Delta = 1 + h and E = (1 + g)/Delta, with g, h > 0",
        ),
        "E is e^{b r (1-Delta)}, b = lam a-, and e^{b(r-1)} = E e^{b h}",
    )
    meant = {
        E: sympy.exp(lam * a_minus * r * (1 - Delta)),
        b: lam * a_minus,
        h: r * Delta - 1,
    }
    low = d.step(
        "bound on the left integral",
        "substitute",
        kappa**2 * (1 - Delta) / (2 * a_minus) * sympy.exp(lam * a_minus * r * (1 - Delta)),
        Satisfies(
            lambda low: {
                "the integral before, at least its bound": left * below.smaller.subs(meant)
                - low * sympy.powsimp(sympy.expand(below.larger.subs(meant)))
            }
        ),
        left=r"I_1 \ge",
    )
    inside = d.step(
        "integrand on (0, 1)",
        "bound",
        Inequality(sympy.exp(lam * (V_max - gap)), "<=", sympy.exp(lam * V_max)),
        Bound(
            difference=sympy.exp(lam * (V_max - gap)) * (sympy.exp(lam * gap) - 1),
            on="V = V_max - delta, delta > 0",
        ),
    )

    def fall() -> Any:
        """e^{lam (V - V(1))} right of the layer."""
        right = d.use("eq:V2", "V(u)")[2]
        return sympy.exp(lam * sympy.expand(right - right.subs(u, 1)))

    beyond = d.step(
        "integral over (1, r)",
        "integrate",
        kappa**2 / (2 * a_plus) * (1 - sympy.exp(-lam * a_plus * (r - 1))),
        Identity(lambda: sympy.integrate(sympy.expand(fall()), (u, 1, r))),
        "of e^{lam (V - V(1))}, V(1) being at most V_max",
        left=r"\int_{1}^{r} e^{2 (V(v) - V(1))/\kappa^2} \, dv",
    )
    most = d.step(
        "integral over (1, r) from above",
        "bound",
        Inequality(beyond, "<=", kappa**2 / (2 * a_plus)),
        Bound(difference=kappa**2 / (2 * a_plus) * sympy.exp(-lam * a_plus * (r - 1)), on="r > 0"),
    )
    high = d.step(
        "bound on the right integral",
        "integrate",
        (1 + kappa**2 / (2 * a_plus)) * sympy.exp(lam * V_max),
        Satisfies(
            lambda high: {
                "the bounds over (0, 1) and over (1, r), added": high
                - sympy.integrate(inside.larger, (u, 0, 1))
                - inside.larger * most.larger,
                "the integrand on (0, 1), at V = V_max - delta": inside.smaller.subs(
                    gap, V_max - V(u)
                )
                - sympy.exp(lam * V(u)),
            }
        ),
        left=r"I_0 \le",
    )
    ratio = C_in_halves(d).subs(I1, X + q)
    bounded = d.step(
        "C from both",
        "bound",
        Inequality(ratio, "<=", (I0 + s) / (X + I0 + s)),
        Bound(
            difference=(s * X + q * (I0 + s)) / ((I0 + X + q) * (X + I0 + s)),
            on="Y = I_0 + s and I_1 = X + q, with q, s > 0",
        ),
        "eq:C; X is the bound on I_1 from below, Y that on I_0 from above",
    )
    dropped = d.step(
        "without Y in the denominator",
        "bound",
        Inequality(sympy.together(bounded.larger.subs(I0, Y - s)), "<=", Y / X),
        Bound(difference=Y**2 / (X * (X + Y)), on="X, Y > 0"),
    )
    chained = d.step(
        "ratio of the two bounds",
        "substitute",
        a_minus
        / (1 - Delta)
        * (1 / a_plus + 2 / kappa**2)
        * sympy.exp(-lam * (a_minus * r * (1 - Delta) - V_max)),
        Identity(lambda: dropped.larger.subs({X: low, Y: high})),
        "V_max is divided by a- r, not by r; no factor 1 + Delta",
        left=r"C \le \frac{Y}{X} =",
    )
    exponent = d.step(
        "V_max at its limit",
        "bound",
        Inequality(
            -lam * a_minus * r * (1 - Delta) + lam * (Delta * a_minus * r - gap),
            "<=",
            -lam * a_minus * r * (1 - 2 * Delta),
        ),
        Bound(difference=lam * gap, on="V_max = Delta a- r - delta"),
    )
    factor = d.step(
        "1/(1 - Delta)",
        "bound",
        Inequality((1 + Delta) / (1 - Delta), "<=", 1 + 4 * Delta),
        Bound(
            difference=2 * Delta * (1 - 2 * Delta) / (1 - Delta),
            given={Delta: 1 / (2 + s)},
            on="0 < Delta < 1/2, and not for every Delta > 0",
        ),
        "the paper's factor; 1/(1 - Delta) is smaller still",
    )
    at_limit = d.step(
        "with V_max at its limit",
        "substitute",
        (1 + 4 * Delta)
        * a_minus
        * (1 / a_plus + 2 / kappa**2)
        * sympy.exp(-lam * a_minus * r * (1 - 2 * Delta)),
        Satisfies(
            lambda found: {
                "the factor": factor.smaller * (1 - Delta) - (1 + Delta),
                "the exponent": exponent.smaller
                - _exponent(chained).subs(V_max, Delta * a_minus * r - gap),
                "the product of all steps": found
                - chained
                * (1 - Delta)
                * factor.larger
                * sympy.exp(exponent.larger - _exponent(chained)),
            }
        ),
        "with the paper's 1 + 4 Delta in place of 1/(1 - Delta)",
        left=r"C \le",
    )
    d.step(
        "constant at Delta = 1/4",
        "evaluate",
        sympy.Rational(4, 3),
        Identity(
            lambda: (
                sympy.simplify(chained / (at_limit / factor.larger))
                .subs({V_max: Delta * a_minus * r})
                .subs(Delta, sympy.Rational(1, 4))
            )
        ),
        "1/(1 - Delta), below the paper's 2",
        left=r"\frac{1}{1 - \Delta}",
    )
    final = d.step(
        "Delta = 1/4",
        "evaluate",
        2 * a_minus * (1 / a_plus + 2 / kappa**2) * sympy.exp(-r * a_minus / kappa**2),
        Identity(lambda: at_limit.subs(Delta, sympy.Rational(1, 4))),
        left=r"C_{\mathrm{bound}}",
    )
    d.step(
        "factor that the paper's bound loses",
        "evaluate",
        sympy.Rational(3, 2),
        Satisfies(
            lambda ratio: {
                "over the ratio of the two bounds": final
                - ratio * chained.subs(V_max, Delta * a_minus * r).subs(Delta, sympy.Rational(1, 4))
            }
        ),
        "it has 2 in place of 4/3",
        left=r"2 \big/ \tfrac{4}{3}",
    )
    d.conclude(
        Symbol("C_high"),
        final,
        "an upper bound, for r >= 4, V_max <= a- r/4 and exp(3 a- r/(2 kappa^2)) >= 4",
    )


def _exponent(product: Any) -> Any:
    """The exponent of the one exponential in a product."""
    (exponential,) = product.atoms(sympy.exp)
    return exponential.args[0]


@derives("eq:TtildeCzero", "The mean escape time without the terms of C", ("eq:Ttilde", "C-bound"))
def without_C(d: Any) -> None:
    gap = Symbol("delta", positive=True)
    left_out = d.step(
        "what is left out",
        "split",
        -C * lam * (J0 + J1),
        Identity(
            lambda: (
                in_halves(d.use("eq:Ttilde", "T")) - in_halves(d.use("eq:Ttilde", "T").subs(C, 0))
            )
        ),
        "exactly proportional to C",
        left="T - T_0",
    )
    high = d.use("C-bound", "C_high")
    d.step(
        "at most",
        "bound",
        Inequality(
            -left_out.subs(C, high - gap),
            "<=",
            2
            * a_minus
            * (1 / a_plus + 2 / kappa**2)
            * sympy.exp(-r * a_minus / kappa**2)
            * lam
            * (J0 + J1),
        ),
        Bound(difference=gap * lam * (J0 + J1), on="C = C_high - delta, delta > 0 (C-bound)"),
        "exponentially small",
    )

    def from_the_start() -> Any:
        """eq:Ttilde with C = 0, where H(v) leaves v > 0."""
        whole = d.use("eq:Ttilde", "T").subs(C, 0)
        (double,) = whole.atoms(Integral)
        inner, (_, low, end) = double.limits
        right, left = (double.function.subs(Heaviside(v), step) for step in (1, 0))
        if left != 0 or not (low.is_negative and end.is_positive):
            raise ValueError(f"{whole} is not 0 left of the start.")
        return whole / double * Integral(right, inner, (v, 0, end))

    found = d.step(
        "C = 0",
        "substitute",
        lam * Integral(Integral(sympy.exp(lam * (V(v) - V(u))), (u, -r, v)), (v, 0, r)),
        Identity(from_the_start),
        left="T_0",
    )
    d.conclude(
        Symbol("T_0"),
        found,
        "C lam (J0 + J1), exponentially small",
        note="lam = 2/kappa^2; J0, J1: integrals over (0, r), (-r, 0) of e^{lam V(v)} times "
        "that of "
        "e^{-lam V} from -r up to v",
    )


@derives("eq:fourPieces", "Four pieces of the domain of integration", ("eq:TtildeCzero",))
def four_pieces(d: Any) -> None:
    f, g = Function("f"), Function("g")
    s, k = Symbol("s", positive=True), Symbol("k", positive=True)

    def over(u_range: tuple[Any, Any], v_range: tuple[Any, Any]) -> Any:
        return Integral(Integral(f(u) * g(v), (u, *u_range)), (v, *v_range))

    transform = partial(on_exponentials, f=f, g=g, s=s, k=k)
    (whole,) = d.use("eq:TtildeCzero", "T_0").atoms(Integral)
    d.step(
        "integrand",
        "substitute",
        lam * sympy.exp(-lam * V(u)) * sympy.exp(lam * V(v)),
        Identity(lambda: d.use("eq:TtildeCzero", "T_0") / whole * whole.function),
        "lam f(u) g(v), the same in each piece",
        left=r"\lambda f(u) g(v)",
    )
    four = d.step(
        "split",
        "split",
        (
            over((-r, -1), (0, 1)),
            over((-1, v), (0, 1)),
            over((-r, 1), (1, r)),
            over((1, v), (1, r)),
        ),
        Satisfies(
            lambda parts: {
                "sum is the whole": sympy.expand(
                    sum(map(transform, parts)) - transform(Integral(f(u) * g(v), *whole.limits))
                )
            }
        ),
        "kinks of V and the start become edges; r > 1",
        left=tuple(rf"\frac{{T_{k}}}{{\lambda}}" for k in range(1, 5)),
    )
    shown = [(rf" ,\quad T_{k} = \lambda ", piece) for k, piece in enumerate(four, 1)]
    d.conclude(
        sympy.symbols("T_1:5"),
        four,
        note="f(u) = e^{-lam V(u)}, g(v) = e^{lam V(v)}, lam = 2/kappa^2",
        display=("T_0 = T_1 + T_2 + T_3 + T_4", *(part for pair in shown for part in pair)),
    )


def strong_pieces(k: Any, ctx: Any) -> list[Any]:
    """The four pieces of the scene, times lam, at r = kappa^4."""
    return split_pieces(ctx, SCENE, k, k**4)


def ranges(piece: Any) -> tuple[tuple[Any, Any], tuple[Any, Any]]:
    """The ends in u and in v of one of the four pieces."""
    (_, *inner), (_, *outer) = piece.limits
    return tuple(inner), tuple(outer)


@derives(
    "eq:fourthTerm", "The fourth piece, exactly and for strong noise", ("eq:fourPieces", "eq:V2")
)
def fourth(d: Any) -> None:
    def closed_form() -> Any:
        (low, high), outer = ranges(d.use("eq:fourPieces", "T_4"))
        V_right = d.use("eq:V2", "V(u)")[2]
        rise = sympy.expand(V_right.subs(u, v) - V_right)
        inner = sympy.integrate(sympy.expand(sympy.exp(lam * rise)), (u, low, high))
        return lam * sympy.integrate(sympy.expand(inner), (v, *outer))

    d.suppose("kappa bounded from below and r >> kappa^2", where="in weak noise eq:fourthTerm2")
    closed = d.step(
        "closed form",
        "integrate",
        (r - 1) / a_plus - kappa**2 / (2 * a_plus**2) * (1 - sympy.exp(-lam * a_plus * (r - 1))),
        Identity(closed_form),
        "V enters by differences, so V(1) drops out",
        left="T_4",
    )
    found = d.step(
        "r much larger than kappa^2 (r = kappa^4)",
        "expand",
        Expansion(r / a_plus, kappa**2, kappa, sympy.oo),
        Order(lambda k, ctx: strong_pieces(k, ctx)[3], STRONG, {**ENDS, r: lambda k, ctx: k**4}),
        left="T_4",
    )

    def at_weak_noise(k: Any, ctx: Any) -> Any:
        values = {kappa: k, r: 1 / k, a_plus: SCENE.end(ctx, 1)}
        return evaluate(closed, values, ctx)

    d.step(
        "kappa small (r = 1/kappa)",
        "expand",
        Expansion(r / a_plus, sympy.S.One, kappa),
        Order(at_weak_noise, ("1e-1", "1e-3", "1e-5"), {**ENDS, r: lambda k, ctx: 1 / k}),
        left="T_4",
    )
    d.conclude(Symbol("T_4"), found, "-1/a+ - kappa^2/(2 a+^2) to leading order")


def _piece(place: int, k: Any, ctx: Any) -> Any:
    return strong_pieces(k, ctx)[place]


@derives("first-three", "The first three pieces in strong noise", ("eq:fourPieces", "eq:V2"))
def first_three(d: Any) -> None:
    d.suppose("kappa >> 1 and r >> kappa^2", where="r = kappa^4 in the measurements")

    def beyond(sign: int, side: int, ends: tuple[Any, Any]) -> Any:
        """e^{-lam V} (sign -1) or e^{lam V} over one side of the layer, as r grows."""
        V_side = d.use("eq:V2", "V(u)")[1 + side]
        V_side = sympy.expand(V_side - V_side.subs(u, side))
        whole = sympy.integrate(sympy.expand(sympy.exp(sign * lam * V_side)), (u, *ends))
        return sympy.limit(whole, r, sympy.oo)

    def first() -> Any:
        inner, (low, high) = ranges(d.use("eq:fourPieces", "T_1"))
        return lam * beyond(-1, -1, inner) * (high - low)

    def second() -> Any:
        area = d.use("eq:fourPieces", "T_2").func(1, *d.use("eq:fourPieces", "T_2").limits)
        return lam * area.doit()

    def third() -> Any:
        (low, _), outer = ranges(d.use("eq:fourPieces", "T_3"))
        return lam * beyond(-1, -1, (low, -1)) * beyond(1, 1, outer)

    claims = (
        (
            "first",
            Expansion(1 / a_minus, kappa**-2, kappa, sympy.oo),
            first,
            "lam times 1/(lam a-) times 1: V is bounded in the layer, and e^{lam V} there is 1",
        ),
        (
            "second",
            Expansion(3 / kappa**2, kappa**-4, kappa, sympy.oo),
            second,
            "lam times the area 3/2",
        ),
        (
            "third",
            Expansion(kappa**2 / (2 * a_plus * a_minus), sympy.S.One, kappa, sympy.oo),
            third,
            "the largest of the three; with it the paper's O(kappa^2) is sharp",
        ),
    )
    found = [
        d.step(
            name,
            "expand",
            stated,
            Together((Leading(leading), Order(partial(_piece, place), STRONG, ENDS))),
            reason,
            left=f"T_{place + 1}",
        )
        for place, (name, stated, leading, reason) in enumerate(claims)
    ]
    d.conclude(
        Symbol("T_3"),
        found[2],
        "O(1) in T_3; the two others are smaller",
        display=("T_1 = ", found[0], r" ,\quad T_2 = ", found[1], r" ,\quad T_3 = ", found[2]),
    )


@derives(
    "eq:Ttildelarge",
    "The mean escape time in strong noise",
    ("eq:fourthTerm", "first-three", "C-bound"),
)
def large(d: Any) -> None:
    d.suppose("crossing to the right and kappa bounded from below")
    d.suppose("r >> kappa^2", where="follows from kappa_phys << r_phys << 1, see eq:eekappar")
    scene = Scene((Fraction(1), Fraction(1, 2), Fraction(1, 3)))
    V_1 = Symbol("V_1", real=True)
    path = {a_minus: "5/6", a_plus: "11/6", V_1: "-20/9", r: lambda k, ctx: k**4}

    def exact(k: Any, ctx: Any) -> Any:
        return pieces(ctx, scene, k, k**4).T

    d.step(
        "what C adds",
        "take limit",
        sympy.S.Zero,
        Identity(
            lambda: sympy.limit(
                d.use("C-bound", "C_high").subs(r, kappa**4) * kappa**8, kappa, sympy.oo
            )
        ),
        "C is below any power of kappa, by its bound, and so is its share of T",
        left=r"\lim_{\kappa \to \infty} \kappa^8 C_{\mathrm{bound}} \big|_{r = \kappa^4}",
    )
    leading = d.use("eq:fourthTerm", "T_4").leading
    found = d.step(
        "leading term",
        "expand",
        Expansion(leading, kappa**2, kappa, sympy.oo),
        Order(exact, STRONG, path),
        "the fourth piece; C included in the exact side",
        left="T",
    )

    def from_pieces() -> Any:
        third = d.use("first-three", "T_3").leading
        far = d.use("eq:fourthTerm", step="closed form").replace(sympy.exp, lambda _: 0)
        return third + sympy.expand(far).coeff(kappa, 2) * kappa**2

    second = d.step(
        "coefficient of kappa^2",
        "evaluate",
        kappa**2 / 2 * (1 / (a_plus * a_minus) - 1 / a_plus**2),
        Identity(from_pieces),
        "third and fourth pieces; 0 if a+ = a-",
        left=r"T - \frac{r}{a^+} \sim",
    )
    constant = (a_minus + a_plus + V_1) / (a_minus * a_plus)
    d.step(
        "next orders",
        "expand",
        Expansion(leading + second + constant, kappa**-2, kappa, sympy.oo),
        Order(exact, STRONG, path, digits=50),
        "the constant is 0 wherever A less its linear part integrates to 0, as in friction",
        left="T",
    )
    d.conclude(Symbol("T"), found, "O(kappa^2)")
