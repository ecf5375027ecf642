"""Section 6.2, strong noise: the bound on C, the four pieces, T = r/a+ + O(kappa^2)."""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import Any

import sympy
from sympy import Function, Integral, Symbol

from derivations.numerics import Scene, pieces, split_pieces
from derivations.paper import C, V, a_minus, a_plus, kappa, lam, r, u, v
from derivations.registry import derives
from derivations.section5_escape import I0, J0, J1, SCENE, on_bends, on_exponentials
from symasym.derivation import (
    Bound,
    Expansion,
    Identity,
    Inequality,
    Order,
    Satisfies,
)

V_max = Symbol("V_max", real=True)
Delta = Symbol("Delta", positive=True)
ENDS = {a_minus: "12/5", a_plus: "2/5"}
STRONG = ("1e1", "1e2", "1e3", "1e4")


@derives("C-bound", "The chain that bounds C, with the conditions it needs", ("eq:C",))
def bound_on_C(d: Any) -> None:
    X, Y, E, g, h, q, s, gap = (
        Symbol(n, positive=True) for n in ("X", "Y", "E", "g", "h", "q", "s", "delta")
    )
    d.suppose(
        "r Delta >= 1 and e^{2 a- r (1 - Delta)/kappa^2} >= 1/Delta",
        where="what 'sufficiently small' has to mean for the first link",
    )
    d.suppose("V_max <= Delta a- r")
    d.suppose(
        "V_max <= Delta r, as printed, is enough",
        "fails",
        "A = 3 (u + 19/20)(u - 3/5), kappa = 1/5, r = 10, Delta = 1/4: C is far above the bound",
        lambda: d.holds("C_hypothesis"),
    )
    d.step(
        "left integral",
        "integrate",
        kappa**2 / (2 * a_minus) * (sympy.exp(lam * a_minus * (r - 1)) - 1),
        Identity(lambda: sympy.integrate(sympy.exp(-lam * a_minus * (u + 1)), (u, -r, -1))),
    )
    # E = e^{lam a- r (1-Delta)} = (1+g)/Delta and r Delta = 1 + h: the conditions, as g, h > 0.
    d.step(
        "left integral from below",
        "bound",
        Inequality(E * sympy.exp(X * h) - 1, ">=", (1 - Delta) * E),
        Bound(
            difference=E * (sympy.exp(X * h) - 1) + g,
            given={E: (1 + g) / Delta},
            on="r Delta = 1 + h, E = (1 + g)/Delta",
        ),
        "E is e^{X r (1-Delta)}, and e^{X(r-1)} = E e^{X h}",
    )
    d.step(
        "integrand on (0, 1)",
        "bound",
        Inequality(sympy.exp(lam * (V_max - gap)), "<=", sympy.exp(lam * V_max)),
        Bound(
            difference=sympy.exp(lam * (V_max - gap)) * (sympy.exp(lam * gap) - 1),
            on="V = V_max - delta, delta > 0",
        ),
    )
    d.step(
        "integral over (1, r)",
        "bound",
        Inequality(
            kappa**2 / (2 * a_plus) * (1 - sympy.exp(-lam * a_plus * (r - 1))),
            "<=",
            kappa**2 / (2 * a_plus),
        ),
        Bound(difference=kappa**2 / (2 * a_plus) * sympy.exp(-lam * a_plus * (r - 1)), on="r > 0"),
    )
    d.step(
        "C from both",
        "bound",
        Inequality(I0 / (I0 + X + q), "<=", (I0 + s) / (X + I0 + s)),
        Bound(
            difference=(s * X + q * (I0 + s)) / ((I0 + X + q) * (X + I0 + s)),
            on="I0 < Y = I0 + s and I1 = X + q",
        ),
    )
    d.step(
        "drop the 1",
        "bound",
        Inequality(1 / (1 + X / Y), "<=", Y / X),
        Bound(difference=Y**2 / (X * (X + Y)), on="X, Y > 0"),
    )
    low = kappa**2 * (1 - Delta) / (2 * a_minus) * sympy.exp(lam * a_minus * r * (1 - Delta))
    high = (1 + kappa**2 / (2 * a_plus)) * sympy.exp(lam * V_max)
    chained = d.step(
        "ratio of the two bounds",
        "substitute",
        a_minus
        / (1 - Delta)
        * (1 / a_plus + 2 / kappa**2)
        * sympy.exp(-lam * a_minus * r * (1 - Delta - V_max / (a_minus * r))),
        Identity(lambda: high / low),
        "V_max is divided by a- r, not by r; no factor 1 + Delta",
    )
    d.step(
        "V_max at its limit",
        "bound",
        Inequality(
            -lam * a_minus * r * (1 - Delta) + lam * (Delta * a_minus * r - gap),
            "<=",
            -lam * a_minus * r * (1 - 2 * Delta),
        ),
        Bound(difference=lam * gap, on="V_max = Delta a- r - delta"),
    )
    d.step(
        "1/(1 - Delta)",
        "bound",
        Inequality((1 + Delta) / (1 - Delta), "<=", 1 + 4 * Delta),
        Bound(
            difference=2 * Delta * (1 - 2 * Delta) / (1 - Delta),
            given={Delta: 1 / (2 + s)},
            on="0 < Delta < 1/2, so not for any Delta > 0",
        ),
    )
    quarter = sympy.Rational(1, 4)
    d.step(
        "constant at Delta = 1/4",
        "evaluate",
        sympy.Rational(4, 3),
        Identity(lambda: (1 / (1 - Delta)).subs(Delta, quarter)),
        "below the paper's 2",
    )
    final = d.step(
        "Delta = 1/4",
        "evaluate",
        2 * a_minus * (1 / a_plus + 2 / kappa**2) * sympy.exp(-r * a_minus / kappa**2),
        Identity(
            lambda: (
                (1 + 4 * quarter)
                * chained.subs({V_max: quarter * a_minus * r, Delta: quarter})
                * (1 - quarter)
            )
        ),
        "with the paper's 1 + 4 Delta in place of 1/(1 - Delta)",
    )
    d.conclude(
        Symbol("C_high"),
        final,
        "an upper bound, for r >= 4, V_max <= a- r/4 and exp(3 a- r/(2 kappa^2)) >= 4",
    )


@derives("eq:TtildeCzero", "The mean escape time without the terms of C", ("eq:Ttilde", "C-bound"))
def without_C(d: Any) -> None:
    d.step(
        "what is left out",
        "split",
        -C * lam * (J0 + J1),
        Identity(lambda: lam * ((1 - C) * J0 - C * J1) - lam * J0),
        "exactly proportional to C, which C-bound makes exponentially small",
    )
    kernel = sympy.exp(lam * (V(v) - V(u)))
    found = d.step(
        "C = 0",
        "substitute",
        lam * Integral(Integral(kernel, (u, -r, v)), (v, 0, r)),
        on_bends(lambda p, values: p.lam * p.J0, {}),
        "compared as in eq:Ttilde",
    )
    d.conclude(Symbol("T_0"), found, "C lam (J0 + J1), exponentially small")


@derives("eq:fourPieces", "Four pieces of the domain of integration", ("eq:TtildeCzero",))
def four_pieces(d: Any) -> None:
    f, g = Function("f"), Function("g")
    s, k = Symbol("s", positive=True), Symbol("k", positive=True)

    def over(u_range: tuple[Any, Any], v_range: tuple[Any, Any]) -> Any:
        return Integral(Integral(f(u) * g(v), (u, *u_range)), (v, *v_range))

    transform = partial(on_exponentials, f=f, g=g, s=s, k=k)
    whole = over((-r, v), (0, r))
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
                "sum is the whole": sympy.expand(sum(map(transform, parts)) - transform(whole))
            }
        ),
        "kinks of V and the start become edges; r > 1",
    )
    d.conclude(
        sympy.symbols("T_1:5"),
        four,
        note="f(u) = e^{-lam V(u)}, g(v) = e^{lam V(v)}, and T_0 is lam times their sum",
    )


def strong_pieces(k: Any, ctx: Any) -> list[Any]:
    """The four pieces of the scene, times lam, at r = kappa^4."""
    return split_pieces(ctx, SCENE, k, k**4)


@derives(
    "eq:fourthTerm", "The fourth piece, exactly and for strong noise", ("eq:fourPieces", "eq:V2")
)
def fourth(d: Any) -> None:
    d.step(
        "closed form",
        "integrate",
        (r - 1) / a_plus - kappa**2 / (2 * a_plus**2) * (1 - sympy.exp(-lam * a_plus * (r - 1))),
        Identity(
            lambda: (
                lam
                * sympy.integrate(
                    sympy.expand(
                        sympy.exp(-lam * a_plus * v)
                        * sympy.integrate(sympy.exp(lam * a_plus * u), (u, 1, v))
                    ),
                    (v, 1, r),
                )
            )
        ),
        "V enters by differences, so V(1) drops out",
    )
    found = d.step(
        "r much larger than kappa^2 (r = kappa^4)",
        "expand",
        Expansion(r / a_plus, kappa**2, kappa, sympy.oo),
        Order(lambda k, ctx: strong_pieces(k, ctx)[3], STRONG, {**ENDS, r: lambda k, ctx: k**4}),
    )
    d.step(
        "kappa small (r = 1/kappa)",
        "expand",
        Expansion(r / a_plus, sympy.S.One, kappa),
        Order(
            lambda k, ctx: _fourth_closed(ctx, k, 1 / k),
            ("1e-1", "1e-3", "1e-5"),
            {**ENDS, r: lambda k, ctx: 1 / k},
        ),
    )
    d.conclude(Symbol("T_4"), found, "O(1) + O(kappa^2), both sharp: -1/a+ - kappa^2/(2 a+^2)")


def _fourth_closed(ctx: Any, k: Any, r: Any) -> Any:
    ap = SCENE.end(ctx, 1)
    return (r - 1) / ap - k**2 / (2 * ap**2) * (1 - ctx.exp(-2 * ap * (r - 1) / k**2))


def _piece(place: int, k: Any, ctx: Any) -> Any:
    return strong_pieces(k, ctx)[place]


@derives("first-three", "The first three pieces in strong noise", ("eq:fourPieces",))
def first_three(d: Any) -> None:
    d.suppose("kappa >> 1 and r >> kappa^2", where="r = kappa^4 in the measurements")
    claims = (
        (
            "first",
            Expansion(1 / a_minus, kappa**-2, kappa, sympy.oo),
            "lam times 1/(lam a-) times 1",
        ),
        ("second", Expansion(3 / kappa**2, kappa**-4, kappa, sympy.oo), "lam times the area 3/2"),
        (
            "third",
            Expansion(kappa**2 / (2 * a_plus * a_minus), sympy.S.One, kappa, sympy.oo),
            "the largest of the three; with it the paper's O(kappa^2) is sharp",
        ),
    )
    for place, (name, stated, reason) in enumerate(claims):
        d.step(
            name,
            "expand",
            stated,
            Order(partial(_piece, place), STRONG, ENDS),
            reason,
        )
    d.conclude(Symbol("T_3"), claims[2][1], "O(1)")


@derives(
    "eq:Ttildelarge",
    "The mean escape time in strong noise",
    ("eq:fourthTerm", "first-three", "C-bound"),
)
def large(d: Any) -> None:
    d.suppose("crossing to the right and kappa >= O(1)")
    d.suppose("r >> kappa^2", where="follows from kappa << r << 1, see eq:eekappar")
    scene = Scene((Fraction(1), Fraction(1, 2), Fraction(1, 3)))
    V_1 = Symbol("V_1", real=True)
    path = {a_minus: "5/6", a_plus: "11/6", V_1: "-20/9", r: lambda k, ctx: k**4}

    def exact(k: Any, ctx: Any) -> Any:
        return pieces(ctx, scene, k, k**4).T

    found = d.step(
        "leading term",
        "expand",
        Expansion(r / a_plus, kappa**2, kappa, sympy.oo),
        Order(exact, STRONG, path),
        "C included in the exact side",
    )
    second = kappa**2 / 2 * (1 / (a_plus * a_minus) - 1 / a_plus**2)
    d.step(
        "coefficient of kappa^2",
        "evaluate",
        second,
        Identity(lambda: kappa**2 / (2 * a_plus * a_minus) - kappa**2 / (2 * a_plus**2)),
        "third and fourth pieces; 0 if a+ = a-",
    )
    constant = (a_minus + a_plus + V_1) / (a_minus * a_plus)
    d.step(
        "next orders",
        "expand",
        Expansion(r / a_plus + second + constant, kappa**-2, kappa, sympy.oo),
        Order(exact, STRONG, path, digits=50),
        "the constant is 0 wherever A less its linear part integrates to 0, as in friction",
    )
    d.conclude(Symbol("T"), found, "O(kappa^2)")
