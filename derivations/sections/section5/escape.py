"""Section 5.2 and appendix A.1: the mean escape time, forwards and backwards."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Heaviside, Integral, Symbol

from derivations.numerics import Scene
from derivations.paper import C, V, eps, kappa, lam, p, phi, r, r_physical, t, u, v
from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

_half = kappa**2 / 2
_up = sympy.exp(lam * V(v))
_m = Symbol("m", positive=True)
I0, I1, J0, J1 = sympy.symbols("I0 I1 J0 J1", positive=True)
SCENE = Scene.friction("3", "1", "-2/5")


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
        Identity(lambda: d.use("eq:tildexykappa", "u").subs(y, r_physical)),
        left=r"r = u \big|_{y = r_p}",
    )
    d.conclude(r, found)


def sides(kernel: Any) -> tuple[Any, Any]:
    """What a kernel with H(v) has beside e^{lam V(v)}: for v > 0, and for v < 0."""
    right, left = (kernel.subs(Heaviside(v), step) for step in (1, 0))
    return sympy.simplify(right / _up), sympy.simplify(left / _up)


def in_halves(double: Any) -> Any:
    """lam times the integral of (H - C) e^{lam (V(v) - V(u))} over -r < u < v < r, by J0 and J1."""
    (whole,) = double.atoms(Integral)
    if whole.limits != ((u, -r, v), (v, -r, r)):
        raise ValueError(f"{whole} is not over -r < u < v < r.")
    right, left = sides(whole.function * sympy.exp(lam * V(u)))
    return double / whole * (right * J0 + left * J1)


@derives(
    "eq:Ttilde0", "The mean escape time as the time integral of the surviving mass", ("eq:FPE",)
)
def survival(d: Any) -> None:
    G, q = Function("G"), Function("q")
    d.suppose(
        "t G(t) -> 0: the surviving mass G decays faster than 1/t",
        where="exponentially, on a bounded interval",
    )
    d.step(
        "mass moves by a flux",
        "integrate",
        -phi(u) * q(u) + _half * sympy.Derivative(q(u), u),
        Satisfies(lambda flux: {"its derivative": sympy.diff(flux, u) - d.use("eq:FPE", "Lq")}),
        "so that none is lost inside: -G' is what leaves through -r and r in unit time",
        left=r"\int \mathcal{L}^* q \, du",
    )
    by_parts = d.step(
        "by parts",
        "integrate",
        G(t),
        Satisfies(
            lambda rest: {
                "-t G' less this is the derivative of -t G": -t * sympy.diff(G(t), t)
                - rest
                - sympy.diff(-t * G(t), t)
            }
        ),
        "-G' is the density of the escape time, so that its mean is the integral of G",
        left=r"-t G'(t) - \frac{d}{dt} \left[-t G(t)\right]",
    )
    mode = sympy.exp(-_m * t)

    def mean_of_mode() -> Any:
        """The mean of q(u) e^{-m t}, by the integral of its mass."""
        mass = Integral(q(u), (u, -r, r))
        return sympy.integrate(by_parts.replace(G, lambda _: mode), (t, 0, sympy.oo)) * mass

    found = d.step(
        "surviving mass",
        "substitute",
        Integral(Integral(p(u, t), (u, -r, r)), (t, 0, sympy.oo)),
        Satisfies(
            lambda T: {
                "the mean of one mode": T.replace(p, lambda *_: q(u) * mode).doit() - mean_of_mode()
            }
        ),
        "G is the integral of p over |u| < r; a mode q(u) e^{-m t} has the mean 1/m times its mass",
        left=r"T = \int_{0}^{\infty} G(t) \, dt",
    )
    d.conclude(Symbol("T"), found)


@derives("eq:odeR", "The Fokker-Planck equation integrated over all time", ("eq:FPE",))
def integrated(d: Any) -> None:
    q, R = Function("q"), Function("R")
    d.suppose("escape is certain: p(u, t) -> 0 as t grows", where="a bounded interval")
    mode = d.step(
        "left side of one mode",
        "integrate",
        -q(u),
        Identity(
            lambda: sympy.integrate(sympy.diff(sympy.exp(-_m * t), t), (t, 0, sympy.oo)) * q(u)
        ),
        "p is a sum of modes q(u) e^{-m t}: minus its value at the start, -delta in all (eq:BCs2)",
        left=r"\int_{0}^{\infty} \frac{\partial}{\partial t} \left[q(u) e^{-m t}\right] dt",
    )
    operator = -sympy.Derivative(phi(u) * q(u), u) + _half * sympy.Derivative(q(u), (u, 2))
    found = d.step(
        "right side of one mode",
        "interchange",
        operator / _m,
        Identity(
            lambda: sympy.integrate(sympy.exp(-_m * t), (t, 0, sympy.oo)) * d.use("eq:FPE", "Lq")
        ),
        "time integral and operator interchange: R = q/m for this mode",
        left=r"\int_{0}^{\infty} \mathcal{L}^* \left[q(u) e^{-m t}\right] dt",
    )
    of_R = d.step(
        "in terms of R",
        "substitute",
        -sympy.Derivative(phi(u) * R(u), u) + _half * sympy.Derivative(R(u), (u, 2)),
        Satisfies(
            lambda e: {"q = m R": (e - found.replace(q, lambda at: _m * R(at))).doit().expand()}
        ),
        left=r"\mathcal{L}^* R",
    )
    source = d.step(
        "start at 0",
        "substitute",
        -sympy.DiracDelta(u),
        Identity(lambda: mode.replace(q, sympy.DiracDelta)),
        "the modes sum to delta(u) at the start (eq:BCs2)",
        left=r"\mathcal{L}^* R",
    )
    d.conclude(
        Symbol("LR"),
        found,
        note="R(u) is p(u, t) integrated over all time: q/m for a mode q(u) e^{-m t}",
        display=(r"\mathcal{L}^* R = ", of_R, " = ", source),
    )


@derives(
    "first-integral", "The flux of R: C to the left of the start, C - 1 to its right", ("eq:odeR",)
)
def first_integral(d: Any) -> None:
    R = Function("R")
    d.step(
        "flux",
        "integrate",
        -phi(u) * R(u) + _half * sympy.Derivative(R(u), u),
        Satisfies(
            lambda flux: {
                "its derivative is the left side of eq:odeR": (
                    sympy.diff(flux, u) - d.use("eq:odeR", step="in terms of R")
                ).doit()
            }
        ),
        left="J",
    )
    found = d.step(
        "integrate once",
        "integrate",
        C - Heaviside(u),
        Satisfies(
            lambda flux: {
                "derivative is -delta": sympy.diff(flux, u) - d.use("eq:odeR", step="start at 0"),
                "C left of the start": flux.subs(u, -1) - C,
            }
        ),
        left="J",
    )
    d.conclude(Symbol("J"), found, note="J = (kappa^2/2) R' - phi R, the flux of R to the left")


@derives("density-R", "R by an integrating factor", ("first-integral",))
def density(d: Any) -> None:
    factor, R = sympy.exp(lam * V(u)), Function("R")

    def derivative() -> Any:
        """That of e^{lam V} R, with R' from the flux."""
        flux = d.use("first-integral", step="flux").subs(phi(u), -sympy.diff(V(u), u))
        slope = sympy.diff(R(u), u)
        (from_flux,) = sympy.solve(flux - d.use("first-integral", "J"), slope)
        return sympy.expand(sympy.diff(factor * R(u), u).subs(slope, from_flux))

    rate = d.step(
        "integrating factor",
        "differentiate",
        lam * factor * (C - Heaviside(u)),
        Identity(derivative),
        "the derivative of e^{lam V} R: phi = -V' makes it lam e^{lam V} times the flux",
        left=r"\frac{d}{du} \left[e^{2 V(u)/\kappa^2} R(u)\right]",
    )
    found = d.step(
        "integrate again",
        "solve",
        lam * sympy.exp(-lam * V(u)) * Integral((Heaviside(v) - C) * _up, (v, u, r)),
        Satisfies(
            lambda R: {
                "the derivative of e^{lam V} R": sympy.diff(factor * R, u) - rate,
                "R(r) = 0": R.subs(u, r).doit(),
            }
        ),
        "from u to r, where R is 0",
        left="R(u)",
    )
    d.conclude(Function("R")(u), found)


@derives("eq:C", "C, the probability of leaving through -r", ("density-R",))
def constant(d: Any) -> None:
    def at_left_end(c: Any) -> Any:
        """R(-r) over lam e^{-lam V(-r)}, its integral split at the start."""
        (above,) = d.use("density-R", "R(u)").subs(u, -r).atoms(Integral)
        if above.limits != ((v, -r, r),):
            raise ValueError(f"{above} is not over (-r, r).")
        right, left = sides(above.function)
        return (right * I0 + left * I1).subs(C, c)

    by_sides = d.step(
        "R(-r) = 0",
        "solve",
        I0 / (I0 + I1),
        Satisfies(lambda c: {"R(-r) = 0": at_left_end(c)}),
        "I0 and I1 are the integrals of e^{lam V} over (0, r) and (-r, 0)",
        left="C",
    )
    left_exit = d.step(
        "splitting probability",
        "solve",
        Integral(_up, (v, u, r)) / Integral(_up, (v, -r, r)),
        Satisfies(
            lambda h: {
                "backward equation": _half * sympy.diff(h, u, 2)
                - sympy.diff(V(u), u) * sympy.diff(h, u),
                "1 at -r": h.subs(u, -r) - 1,
                "0 at r": h.subs(u, r).doit(),
            }
        ),
        "independently: the probability of leaving through -r from u",
        left="h(u)",
    )
    right, whole = Integral(_up, (v, 0, r)), Integral(_up, (v, -r, r))
    full = d.step(
        "at the start",
        "evaluate",
        right / whole,
        Satisfies(
            lambda c: {
                "splitting probability": c - left_exit.subs(u, 0),
                "R(-r) = 0": c - by_sides.subs({I0: right, I1: whole - right}),
            }
        ),
        "the same ratio by both routes",
        left="C = h(0)",
    )
    d.conclude(C, full)


def C_in_halves(d: Any) -> Any:
    """eq:C by the symbols I0 and I1."""
    right, whole = Integral(_up, (v, 0, r)), Integral(_up, (v, -r, r))
    return d.use("eq:C", "C").subs(whole, I0 + I1).subs(right, I0)


@derives(
    "eq:Ttilde",
    "The mean escape time as a double integral, from the forward equation",
    ("eq:Ttilde0", "density-R", "eq:C"),
)
def escape_time(d: Any) -> None:
    f, g, R = Function("f"), Function("g"), Function("R")
    s, k = Symbol("s", positive=True), Symbol("k", positive=True)

    def over_time() -> Any:
        whole = d.use("eq:Ttilde0", "T")
        inside, over = whole.limits
        if over != (t, 0, sympy.oo) or whole.function != p(u, t):
            raise ValueError(f"{whole} is not p integrated over all time.")
        return Integral(R(u), inside)

    of_R = d.step(
        "order of integration in time and position",
        "interchange",
        Integral(R(u), (u, -r, r)),
        Identity(over_time),
        "R(u) is p(u, t) integrated over all time",
        left="T",
    )
    above = Integral((Heaviside(v) - C) * _up, (v, u, r))
    iterated = d.step(
        "R substituted",
        "substitute",
        Integral(lam * sympy.exp(-lam * V(u)) * above, (u, -r, r)),
        Identity(lambda: of_R.replace(R, lambda at: d.use("density-R", "R(u)").subs(u, at))),
        left="T",
    )

    def same_domain(order: Any) -> dict[str, Any]:
        first = Integral(Integral(f(u) * g(v), *above.limits), *iterated.limits)
        gap = on_exponentials(order, f, g, s, k) - on_exponentials(first, f, g, s, k)
        return {"same domain": sympy.expand(gap)}

    swapped = d.step(
        "order of integration",
        "interchange",
        Integral(Integral(f(u) * g(v), (u, -r, v)), (v, -r, r)),
        Satisfies(same_domain),
        "R(u) is itself an integral over v > u",
        left=r"\int_{-r}^{r} \int_{u}^{r} f(u) g(v) \, dv \, du",
    )
    kernel = (Heaviside(v) - C) * sympy.exp(lam * (V(v) - V(u)))
    together = iterated.function / above * above.function
    found = d.step(
        "mean escape time",
        "substitute",
        lam * Integral(Integral(kernel, (u, -r, v)), (v, -r, r)),
        Identity(lambda: lam * Integral(together / lam, *swapped.limits)),
        "f(u) is lam e^{-lam V(u)}, and g(v) the rest of the integrand",
        left="T",
    )
    d.step(
        "by one-sided integrals",
        "split",
        lam * (I1 * J0 - I0 * J1) / (I0 + I1),
        Identity(lambda: in_halves(found).subs(C, C_in_halves(d))),
        "with eq:C: I0, I1 are integrals of e^{lam V} over (0, r), (-r, 0); J0, J1 have that of "
        "e^{-lam V} from -r up to v as a factor",
        left="T",
    )
    d.conclude(Symbol("T"), found)


@derives("backward", "The mean escape time from the backward equation", ("eq:Ttilde", "eq:C"))
def backward(d: Any) -> None:
    c = Symbol("c", real=True)
    e, down = sympy.exp(lam * V(u)), Integral(sympy.exp(-lam * V(v)), (v, -r, u))
    slope = d.step(
        "first integral of (kappa^2/2) T'' + phi T' = -1",
        "solve",
        e * (c - lam * down),
        Satisfies(
            lambda S: {
                "equation": _half * sympy.diff(S, u) - sympy.diff(V(u), u) * S + 1,
                "c is the slope at -r where V = 0": S.subs(u, -r).doit().subs(V(-r), 0) - c,
            }
        ),
        left="T'(u)",
    )

    def integral(single: Any, double: Any) -> Any:
        """The slope integrated, by those of e^{lam V} and of e^{lam V} times `down`."""
        parts = sympy.expand(slope / e)
        rest = sympy.expand(parts - parts.coeff(c) * c - parts.coeff(down) * down)
        if rest != 0:
            raise ValueError(f"{rest} is left of the slope.")
        return parts.coeff(c) * c * single + parts.coeff(down) * double

    # T(-r) = 0 and T(r) = 0: the integral of the slope over (-r, r) vanishes.
    constant = d.step(
        "both ends absorb",
        "solve",
        lam * (J0 + J1) / (I0 + I1),
        Satisfies(lambda found: {"T(r) - T(-r)": integral(I0 + I1, J0 + J1).subs(c, found)}),
        "J0, J1: integrals over (0, r), (-r, 0) of e^{lam V(v)} times that of e^{-lam V} up to v",
        left="c",
    )
    at_start = d.step(
        "at the start 0",
        "integrate",
        lam * J0 - lam * (J0 + J1) * I0 / (I0 + I1),
        Identity(lambda: -integral(I0, J0).subs(c, constant)),
        "T(0) is minus the integral of the slope over (0, r)",
        left="T(0)",
    )
    d.step(
        "the same as eq:Ttilde",
        "substitute",
        at_start,
        Identity(lambda: in_halves(d.use("eq:Ttilde", "T")).subs(C, C_in_halves(d))),
        "eq:Ttilde split at v = 0, with the C of eq:C",
        left="T",
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
    ("backward", "eq:C", "eq:V"),
)
def constant_drift(d: Any) -> None:
    a = Symbol("a", positive=True)
    edge = sympy.exp(lam * a * r)
    exit_left = d.step(
        "splitting probability",
        "solve",
        (sympy.exp(-lam * a * u) - 1 / edge) / (edge - 1 / edge),
        Satisfies(
            lambda h: {
                "equation": _half * sympy.diff(h, u, 2) + a * sympy.diff(h, u),
                "1 at -r": h.subs(u, -r) - 1,
                "0 at r": h.subs(u, r),
            }
        ),
        left="h(u)",
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
        left="T(u)",
    )

    def integrals() -> dict[Any, Any]:
        """The four integrals of 'backward' for this drift."""
        fall = d.use("eq:V", "V(u)").replace(phi, lambda _: a).doit()
        up = sympy.expand(sympy.exp(lam * fall.subs(u, v)))
        mass = sympy.integrate(sympy.expand(sympy.exp(-lam * fall)), (u, -r, v))
        both = ((v, 0, r), (v, -r, 0))
        single = [sympy.integrate(up, over) for over in both]
        double = [sympy.integrate(sympy.expand(up * mass), over) for over in both]
        return dict(zip((I0, I1, J0, J1), (*single, *double), strict=True))

    found = d.step(
        "from 0",
        "evaluate",
        r / a * sympy.tanh(a * r / kappa**2),
        Satisfies(
            lambda T: {
                "mean escape time from 0": T.rewrite(sympy.exp) - mean.subs(u, 0),
                "'backward' for this drift": T.rewrite(sympy.exp)
                - d.use("backward", "T").subs(integrals()),
            }
        ),
        "from the equation, and from the integrals",
        left="T(0)",
    )
    share = d.step(
        "exit through -r, from 0",
        "evaluate",
        1 / (1 + sympy.exp(2 * a * r / kappa**2)),
        Satisfies(
            lambda share: {
                "splitting probability at 0": share - exit_left.subs(u, 0),
                "eq:C for this drift": share - C_in_halves(d).subs(integrals()),
            }
        ),
        left="C = h(0)",
    )
    d.conclude((Symbol("T"), C), (found, share))
