"""Section 5.2 and appendix A.1: the mean escape time, forwards and backwards."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import sympy
from sympy import Function, Heaviside, Integral, Symbol

from derivations.numerics import Bends, Scene
from derivations.paper import C, V, eps, kappa, lam, p, phi, r, r_physical, t, u, v
from derivations.registry import derives
from symasym.derivation import Identity, Sampled, Satisfies

_half = kappa**2 / 2
_up = sympy.exp(lam * V(v))
_m = Symbol("m", positive=True)
I0, I1, J0, J1 = sympy.symbols("I0 I1 J0 J1", positive=True)
SCENE = Scene.friction("3", "1", "-2/5")


# A well and a barrier of straight lines: what the double integrals are compared on.
BENDS = Bends((Fraction(-12, 5), Fraction(4, 3), Fraction(7, 4), Fraction(-2, 5)))
# Zeros of a difference between two such integrals. In kappa: 21 differences of V between the
# five edges, each with a factor of degree 2 in lam, so 63 terms and 62 zeros. In r: 7 exponents
# made of the outer slopes, with factors of degree 1, so 13. In C: 1.
ZEROS = 62 + 13 + 1


def on_bends(reference: Any, ranges: dict[Any, Any]) -> Sampled:
    """A double integral against closed forms, for V of straight lines."""
    return Sampled(
        lambda values, ctx: reference(BENDS.pieces(ctx, values[kappa], values[r]), values),
        {kappa: ("9/10", "2"), r: ("1", "2"), **ranges},
        points=12,
        digits=20,
        zeros=ZEROS,
        functions={V: lambda at, ctx: BENDS.V(ctx, at)},
    )


def on_exponentials(e: Any, f: Any, g: Any, s: Any, k: Any) -> Any:
    """`e` with e^{s a} and e^{k a} in place of f(a) and g(a).

    Iterated integrals become Laplace transforms of their domains: where two are equal for all
    rates s and k, their domains are.
    """
    return e.replace(f, lambda a: sympy.exp(s * a)).replace(g, lambda a: sympy.exp(k * a)).doit()


@derives("eq:tilder", "The scaled radius", ("eq:tildexykappa",))
def scaled_radius(d: Any) -> None:
    y = Symbol("y", real=True)
    found = d.step(
        "scale",
        "scale",
        r_physical / eps,
        Identity(lambda: d.use("eq:tildexykappa")[0].subs(y, r_physical)),
    )
    d.conclude(r, found)


@derives("eq:Ttilde0", "The mean escape time as the time integral of the surviving mass")
def survival(d: Any) -> None:
    S = Function("S")
    d.suppose(
        "t S(t) -> 0: the surviving mass S decays faster than 1/t",
        where="exponentially, on a bounded interval",
    )
    d.step(
        "by parts",
        "integrate",
        S(t),
        Satisfies(
            lambda rest: {
                "-t S' less this is the derivative of -t S": -t * sympy.diff(S(t), t)
                - rest
                - sympy.diff(-t * S(t), t)
            }
        ),
        "-S' is the density of the escape time, so that its mean is the integral of S",
    )
    weight = Symbol("q", positive=True)
    d.step(
        "on a mixture of two rates",
        "integrate",
        weight / _m + (1 - weight) / (3 * _m),
        Identity(
            lambda: sympy.integrate(
                (
                    -t
                    * sympy.diff(
                        weight * sympy.exp(-_m * t) + (1 - weight) * sympy.exp(-3 * _m * t), t
                    )
                ).expand(),
                (t, 0, sympy.oo),
            )
        ),
        "both sides of the integrated identity, where the boundary term is gone",
    )
    inside = Integral(p(u, t), (u, -r, r))
    found = d.step(
        "surviving mass",
        "substitute",
        Integral(inside, (t, 0, sympy.oo)),
        Identity(lambda: Integral(S(t), (t, 0, sympy.oo)).replace(S(t), inside)),
    )
    d.conclude(Symbol("T"), found)


@derives("eq:odeR", "The Fokker-Planck equation integrated over all time", ("eq:FPE",))
def integrated(d: Any) -> None:
    q = Function("q")
    d.suppose("escape is certain: p(u, t) -> 0 as t grows", where="a bounded interval")
    d.step(
        "left side of one mode",
        "integrate",
        -q(u),
        Identity(
            lambda: sympy.integrate(sympy.diff(sympy.exp(-_m * t), t), (t, 0, sympy.oo)) * q(u)
        ),
        "p is a sum of modes q(u) e^{-m t}: minus its value at the start, -delta in all",
    )
    operator = -sympy.Derivative(phi(u) * q(u), u) + _half * sympy.Derivative(q(u), (u, 2))
    found = d.step(
        "right side of one mode",
        "interchange",
        operator / _m,
        Identity(lambda: sympy.integrate(sympy.exp(-_m * t), (t, 0, sympy.oo)) * d.use("eq:FPE")),
        "time integral and operator interchange: R = q/m for this mode",
    )
    d.conclude(Symbol("LR"), found, note="L*R = -delta(u), and R = q/m for a mode q(u) e^{-m t}")


@derives(
    "first-integral", "The flux of R: C to the left of the start, C - 1 to its right", ("eq:odeR",)
)
def first_integral(d: Any) -> None:
    found = d.step(
        "integrate once",
        "integrate",
        C - Heaviside(u),
        Satisfies(
            lambda flux: {
                "derivative is -delta": sympy.diff(flux, u) + sympy.DiracDelta(u),
                "C left of the start": flux.subs(u, -1) - C,
            }
        ),
    )
    d.conclude(Symbol("J"), found, note="J is the flux of R")


@derives("density-R", "R by an integrating factor", ("first-integral",))
def density(d: Any) -> None:
    def equations(R: Any) -> dict[str, Any]:
        flux = sympy.diff(V(u), u) * R + _half * sympy.diff(R, u)
        return {"flux": flux - d.use("first-integral"), "R(r) = 0": R.subs(u, r).doit()}

    found = d.step(
        "integrate again",
        "solve",
        lam * sympy.exp(-lam * V(u)) * Integral((Heaviside(v) - C) * _up, (v, u, r)),
        Satisfies(equations),
    )
    d.conclude(Function("R")(u), found)


@derives("eq:C", "The constant C, which is the chance of leaving through -r", ("density-R",))
def constant(d: Any) -> None:
    d.step(
        "R(-r) = 0",
        "solve",
        I0 / (I0 + I1),
        Satisfies(lambda c: {"(1 - C) I0 - C I1": (1 - c) * I0 - c * I1}),
        "I0 and I1 are the integrals of e^{lam V} over (0, r) and (-r, 0)",
    )
    left_exit = Integral(_up, (v, u, r)) / Integral(_up, (v, -r, r))
    d.step(
        "splitting probability",
        "solve",
        left_exit,
        Satisfies(
            lambda h: {
                "backward equation": _half * sympy.diff(h, u, 2)
                - sympy.diff(V(u), u) * sympy.diff(h, u),
                "1 at -r": h.subs(u, -r) - 1,
                "0 at r": h.subs(u, r).doit(),
            }
        ),
        "independent: at the start 0 this is the same ratio",
    )
    ratio = Integral(_up, (v, 0, r)) / Integral(_up, (v, -r, r))
    full = d.step("at the start", "evaluate", ratio, Identity(lambda: left_exit.subs(u, 0)))
    d.conclude(C, full)


@derives(
    "eq:Ttilde",
    "The mean escape time as a double integral (forwards)",
    ("eq:Ttilde0", "density-R", "eq:C"),
)
def escape_time(d: Any) -> None:
    f, g = Function("f"), Function("g")
    s, k = Symbol("s", positive=True), Symbol("k", positive=True)
    above = Integral((Heaviside(v) - C) * _up, (v, u, r))
    d.step(
        "what is integrated over u",
        "substitute",
        lam * sympy.exp(-lam * V(u)) * above,
        Identity(lambda: d.use("density-R")),
        "time and place interchanged in eq:Ttilde0: T is the integral of R over (-r, r)",
    )

    def same_domain(order: Any) -> dict[str, Any]:
        first = Integral(Integral(f(u) * g(v), (v, u, r)), (u, -r, r))
        gap = on_exponentials(order, f, g, s, k) - on_exponentials(first, f, g, s, k)
        return {"same domain": sympy.expand(gap)}

    d.step(
        "order of integration",
        "interchange",
        Integral(Integral(f(u) * g(v), (u, -r, v)), (v, -r, r)),
        Satisfies(same_domain),
        "R(u) is itself an integral over v > u",
    )
    kernel = d.step(
        "integrand",
        "substitute",
        (Heaviside(v) - C) * sympy.exp(lam * (V(v) - V(u))),
        Identity(lambda: sympy.exp(-lam * V(u)) * ((Heaviside(v) - C) * _up)),
        "f(u) = e^{-lam V(u)}, g(v) = (H - C) e^{lam V(v)}",
    )
    by_pieces = d.step(
        "mean escape time",
        "substitute",
        lam * Integral(Integral(kernel, (u, -r, v)), (v, -r, r)),
        on_bends(
            lambda p, values: p.lam * ((1 - values[C]) * p.J0 - values[C] * p.J1),
            {C: ("0", "1")},
        ),
        "compared with the four one-sided integrals, where V has straight lines and bends",
    )
    d.conclude(Symbol("T"), by_pieces)


@derives("backward", "The mean escape time from the backward equation", ("eq:Ttilde", "eq:C"))
def backward(d: Any) -> None:
    c = Symbol("c", real=True)
    down = Integral(sympy.exp(-lam * V(v)), (v, -r, u))
    d.step(
        "first integral of (kappa^2/2) T'' + phi T' = -1",
        "solve",
        sympy.exp(lam * V(u)) * (c - lam * down),
        Satisfies(
            lambda S: {
                "equation": _half * sympy.diff(S, u) - sympy.diff(V(u), u) * S + 1,
                "c is the slope at -r where V = 0": S.subs(u, -r).doit().subs(V(-r), 0) - c,
            }
        ),
    )
    # T(-r) = 0 and T(r) = 0: the integral of the slope over (-r, r) vanishes.
    constant = d.step(
        "both ends absorb",
        "solve",
        lam * (J0 + J1) / (I0 + I1),
        Satisfies(lambda found: {"T(r) - T(-r)": found * (I0 + I1) - lam * (J0 + J1)}),
        "J0, J1: integrals over (0, r), (-r, 0) of e^{lam V(v)} times that of e^{-lam V} up to v",
    )
    at_start = d.step(
        "at the start 0",
        "integrate",
        lam * J0 - lam * (J0 + J1) * I0 / (I0 + I1),
        Identity(lambda: -(constant * I0 - lam * J0)),
        "T(0) is minus the integral of the slope over (0, r)",
    )
    d.step(
        "the same as eq:Ttilde",
        "substitute",
        at_start,
        Identity(lambda: lam * ((1 - I0 / (I0 + I1)) * J0 - I0 / (I0 + I1) * J1)),
        "eq:Ttilde split at v = 0, with C = I0/(I0 + I1)",
    )
    d.conclude(
        Symbol("T"),
        at_start,
        note="I0, I1: integrals of e^{lam V} over (0, r), (-r, 0); J0, J1: the same with the "
        "integral of e^{-lam V} from -r up to v as a factor; lam = 2/kappa^2",
    )


@derives(
    "constant-drift",
    "Constant drift: escape time and exit probability in closed form",
    ("backward",),
)
def constant_drift(d: Any) -> None:
    a = Symbol("a", positive=True)
    at = u
    scale = sympy.exp(-lam * a * at)
    edge = sympy.exp(lam * a * r)
    exit_left = d.step(
        "splitting probability",
        "solve",
        (scale - 1 / edge) / (edge - 1 / edge),
        Satisfies(
            lambda h: {
                "equation": _half * sympy.diff(h, u, 2) + a * sympy.diff(h, u),
                "1 at -r": h.subs(u, -r) - 1,
                "0 at r": h.subs(u, r),
            }
        ),
    )
    mean = d.step(
        "mean escape time from u",
        "solve",
        (r - u) / a - 2 * r / a * exit_left,
        Satisfies(
            lambda T: {
                "equation": _half * sympy.diff(T, u, 2) + a * sympy.diff(T, u) + 1,
                "0 at -r": T.subs(u, -r),
                "0 at r": T.subs(u, r),
            }
        ),
    )
    found = d.step(
        "from 0",
        "evaluate",
        r / a * sympy.tanh(a * r / kappa**2),
        Identity(lambda: mean.subs(u, 0).rewrite(sympy.exp)),
    )
    d.step(
        "exit through -r, from 0",
        "evaluate",
        1 / (1 + sympy.exp(2 * a * r / kappa**2)),
        Identity(lambda: exit_left.subs(u, 0)),
    )
    d.conclude(Symbol("T"), found)
