"""The exact integrals in positive terms: what the numeric engines evaluate."""

from __future__ import annotations

from functools import partial
from typing import Any

import sympy
from sympy import Function, Integral, Symbol

from derivations.paper import V_1, N, V, a_minus, a_plus_sliding, lam, r, u, v, x
from derivations.registry import derives
from derivations.sections.section5.escape import I0, I1, J0, J1, C_in_halves, on_exponentials
from symasym.derivation import Identity, Satisfies


def _positive(names: str) -> Any:
    return sympy.symbols(names, positive=True)


# A symbol of its own for 2/kappa^2: the engines carry it, not kappa.
rate = Symbol("lam", positive=True)
sigma_left, sigma_right = _positive("sigma_left sigma_right")
total = Symbol("w", positive=True)


@derives(
    "positive-form",
    "The escape time and the exit probability from both sides of the start, in positive terms",
    ("backward", "eq:C"),
)
def positive_form(d: Any) -> None:
    f, g = Function("f"), Function("g")
    p, q = _positive("p q")
    m, K_left, K_right, scale = _positive("m K_left K_right s")

    transform = partial(on_exponentials, f=f, g=g, s=p, k=q)

    def same(original: Any) -> Satisfies:
        return Satisfies(
            lambda stated: {"same domain": sympy.expand(transform(stated) - transform(original))}
        )

    def over(inner: tuple[Any, Any, Any], outer: tuple[Any, Any, Any]) -> Any:
        return Integral(Integral(f(u) * g(v), inner), outer)

    before = Integral(f(u), (u, -r, x))
    left = d.step(
        "left of the start",
        "interchange",
        before * Integral(g(v), (v, -r, x)) - over((v, -r, u), (u, -r, x)),
        same(over((u, -r, v), (v, -r, x))),
        "f = e^{-lam V}, g = e^{lam V}: J1 = m I1 - K_left, a square less a triangle",
        left=r"\int_{-r}^{x} \int_{-r}^{v} f(u) g(v) \, du \, dv",
    )
    right = d.step(
        "right of the start",
        "interchange",
        before * Integral(g(v), (v, x, r)) + over((v, u, r), (u, x, r)),
        same(over((u, -r, v), (v, x, r))),
        "J0 = m I0 + K_right, a rectangle and a triangle; eq:Ttilde has x = 0",
        left=r"\int_{x}^{r} \int_{-r}^{v} f(u) g(v) \, du \, dv",
    )
    named = {
        over((v, -r, u), (u, -r, x)): K_left,
        over((v, u, r), (u, x, r)): K_right,
        Integral(g(v), (v, -r, x)): I1,
        Integral(g(v), (v, x, r)): I0,
        before: m,
    }
    positive = d.step(
        "nothing cancels",
        "substitute",
        lam * (I0 * K_left + I1 * K_right) / (I0 + I1),
        Identity(
            lambda: d.use("backward", "T").subs({J0: right.subs(named), J1: left.subs(named)})
        ),
        "m, the mass left of the start, drops out",
        left="T",
    )
    # What the two sweeps carry: sigma = I/s and w = lam s K/I, s = e^{lam V} at the start.
    carried = {
        sigma_left: I1 / scale,
        sigma_right: I0 / scale,
        total: lam * scale * (K_left / I1 + K_right / I0),
    }
    found = d.step(
        "from both sweeps",
        "substitute",
        total / (1 / sigma_left + 1 / sigma_right),
        Satisfies(lambda T: {"the same T": T.subs(carried) - positive}),
        "w = w_left + w_right",
        left="T",
    )
    share = d.step(
        "chance of leaving on the left",
        "substitute",
        1 / (1 + sigma_left / sigma_right),
        Satisfies(lambda c: {"in sigma": c.subs(carried) - C_in_halves(d)}),
        "eq:C",
        left="C",
    )
    d.step(
        "logarithm of C",
        "substitute",
        -sympy.log(1 + sigma_left / sigma_right),
        Satisfies(lambda c: {"C": sympy.exp(c) - share}),
        left=r"\log C",
    )
    d.conclude(
        Symbol("T"),
        found,
        note="sigma = Sigma/s and w on either side of the start: s = e^{lam V}, Sigma its integral "
        "from the end, w the time spent there per unit of rate; w = w_left + w_right",
    )


@derives(
    "positive-density",
    "The stationary density and the occupation, in positive terms",
    ("eq:pss", "eq:P", "tails"),
)
def positive_density(d: Any) -> None:
    M_left, M_right, scale, outer = _positive("M_left M_right s M")
    inside, outside = _positive("inside outside")
    carried = {total: rate * scale * (M_left + M_right)}
    K = Symbol("K", positive=True)

    def steady() -> Any:
        """eq:pss by s, its e^{lam V}."""
        return d.use("eq:pss", "p_ss(u)").subs(sympy.exp(lam * V(u)), scale)

    constant = d.step(
        "mass 1",
        "solve",
        1 / (M_left + M_right),
        Satisfies(lambda k: {"mass": (steady() * scale).subs(K, k) * (M_left + M_right) - 1}),
        "M_left and M_right are the integrals of e^{-lam V} over both sides of u",
        left="K",
    )
    normal = d.step(
        "density of mass 1",
        "substitute",
        1 / (scale * (M_left + M_right)),
        Identity(lambda: steady().subs(K, constant)),
        "s = e^{lam V(u)}",
        left=r"p_{\mathrm{ss}}(u)",
    )
    density = d.step(
        "density",
        "substitute",
        rate / total,
        Satisfies(lambda p: {"with w of both sweeps": p.subs(carried) - normal}),
        "w = lam s (M_left + M_right)",
        left=r"p_{\mathrm{ss}}(u)",
    )
    share = d.step(
        "occupation",
        "substitute",
        1 / (1 + outside / inside),
        Identity(lambda: d.use("eq:P", "P").subs({N: inside, outer: outside})),
        left="P",
    )
    d.step(
        "logarithm of the occupation",
        "substitute",
        -sympy.log(1 + outside / inside),
        Satisfies(lambda p: {"P": sympy.exp(p) - share}),
        left=r"\log P",
    )
    d.step(
        "w beyond the layer",
        "substitute",
        (1 / a_minus, -1 / a_plus_sliding),
        Identity(
            lambda: [
                lam * d.use("tails", "I_left"),
                lam * sympy.exp(lam * V_1) * d.use("tails", "I_right"),
            ]
        ),
        "lam e^{lam V} times the mass of each tail: V is 0 at -1 and V(1) at 1",
        left=(
            r"\lambda I_{\mathrm{left}}",
            r"\lambda e^{\lambda V(1)} I_{\mathrm{right}}",
        ),
    )
    d.conclude(
        Function("p_ss")(u),
        density,
        note="w = lam e^{lam V(u)} times the integral of e^{-lam V} over all positions",
    )


@derives("constant-panel", "Integrals over a panel of constant drift", ("eq:V",))
def constant_panel(d: Any) -> None:
    size = Symbol("x", positive=True)
    t = Symbol("t", positive=True)

    def e(direction: int, at: Any) -> Any:
        """exp(lam (V - V at the left end)), V falling (1) or rising (-1), widths of 1."""
        V = d.use("eq:V", "V(u)").replace(Function("phi"), lambda _: direction * size).doit()
        return sympy.exp((V - V.subs(u, -1)).subs(u, at - 1))

    def single(direction: int) -> Any:
        whole = sympy.integrate(e(direction, t), (t, 0, 1))
        return sympy.expand(whole * (1 if direction > 0 else 1 / e(direction, 1)))

    def double(direction: int) -> Any:
        inner = sympy.integrate(e(direction, v), (v, 0, t))
        whole = sympy.integrate(sympy.expand(inner / e(direction, t)), (t, 0, 1))
        return sympy.expand(whole * (e(direction, 1) if direction > 0 else 1))

    first = d.step(
        "V falls: single",
        "integrate",
        (1 - sympy.exp(-size)) / size,
        Identity(lambda: single(1)),
        left=r"I = \int_{0}^{1} e^{-x t} \, dt",
    )
    d.step(
        "V rises: single",
        "integrate",
        first,
        Identity(lambda: single(-1)),
        left=r"I = e^{-x} \int_{0}^{1} e^{x t} \, dt",
    )
    # From the single integral: no square of x, which may be as large as float64 allows.
    int_e = Symbol("int_e", positive=True)
    down = d.step(
        "V falls: double",
        "integrate",
        (int_e - sympy.exp(-size)) / size,
        Satisfies(lambda e: {"integral": e.subs(int_e, first) - double(1)}),
        left=r"N_{-} = e^{-x} \int_{0}^{1} \int_{0}^{t} e^{x (t - v)} \, dv \, dt",
    )
    up = d.step(
        "V rises: double",
        "integrate",
        (1 - int_e) / size,
        Satisfies(lambda e: {"integral": e.subs(int_e, first) - double(-1)}),
        left=r"N_{+} = \int_{0}^{1} \int_{0}^{t} e^{-x (t - v)} \, dv \, dt",
    )
    d.conclude(
        sympy.symbols("int_e nested_down nested_up"),
        (first, down, up),
        note="x = lam |a| h; I, the integral of e^{+-lam V}, in units of the width h, N_- "
        "and N_+, the "
        "double integrals of e^{lam (V(u) - V(v))} over v < u where V falls and where it rises, in "
        "units of h^2, each integrand divided by its largest value",
    )


@derives("panel-step", "One step of the sweep: sigma and w across a panel", ("positive-form",))
def panel_step(d: Any) -> None:
    sigma, work, E, F, D, end = _positive("sigma w E F D e")
    int_e, int_inverse, nested = _positive("int_e int_inverse nested")
    fall, climb = _positive("fall climb")
    S, scale = _positive("S s")
    after = d.step(
        "sigma",
        "split",
        (sigma + E) / end,
        # S grows by s(a) E, and s by the factor e.
        Identity(lambda: ((S + scale * E) / (scale * end)).subs(S, sigma * scale)),
        "sigma = Sigma/s, Sigma the integral of s; E is the panel's integral of e",
        left=r"\sigma_b",
    )

    def spent() -> Any:
        # w S/s at b: the earlier part times e(b), and lam e(b) int S(u)/(s(a) e(u)) du.
        carried = end * work * S + rate * end * (S * F + scale * D)
        return (carried / (S + scale * E)).subs(S, sigma * scale)

    later = d.step(
        "w",
        "split",
        end * (sigma * (work + rate * F) + rate * D) / (sigma + E),
        Identity(spent),
        "F, D: integrals of 1/e and of e(v)/e(u) over v < u",
        left="w_b",
    )
    # One of both scales is 1, so that no number grows with lam.
    scaled = {E: int_e / climb, F: int_inverse / fall, D: nested / fall, end: fall / climb}
    grown = int_e + climb * sigma
    found = d.step(
        "scaled",
        "scale",
        (
            grown / fall,
            # A logarithm of sigma, however large, does not enter w where int_e is nothing beside.
            (fall * work + rate * int_inverse) / (climb + int_e / sigma) + rate * nested / grown,
        ),
        Identity(lambda: [after.subs(scaled), later.subs(scaled)]),
        "e(b) = f/c, I = c E, J = f F and N = f D",
        left=(
            r"\sigma_b",
            "w_b",
        ),
    )
    begun = d.step(
        "from an absorbing end",
        "take limit",
        (int_e / fall, rate * nested / int_e),
        Identity(lambda: [sympy.limit(e, sigma, 0) for e in found]),
        left=(
            r"\lim_{\sigma \to 0} \sigma_b",
            r"\lim_{\sigma \to 0} w_b",
        ),
    )
    d.step(
        "the same panel on either side of the start",
        "substitute",
        rate * nested / fall,
        Identity(
            lambda: d.use("positive-form", "T").subs(
                {sigma_left: begun[0], sigma_right: begun[0], total: 2 * begun[1]}
            )
        ),
        "lam D, D the double integral over one panel: positive-form with K_left = K_right = D",
        left="T",
    )
    d.conclude(
        sympy.symbols("sigma_b w_b"),
        found,
        note="from u = a to u = b; f = e^{-lam |V(b) - V(a)|} where V falls, c where it rises, the "
        "other is 1; I, J and N are the panel's integrals of e = e^{lam (V - V(a))}, of 1/e and of "
        "e(v)/e(u), v < u, each integrand divided by its largest value",
    )
