"""Section 3: the paper's summary, each statement taken back to the result it abridges."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.paper import (
    a_minus,
    a_plus,
    a_plus_sliding,
    eps,
    kappa,
    kappa_physical,
    r,
    r_physical,
)
from derivations.registry import derives
from symasym.derivation import Bound, Identity, Inequality, Satisfies

_k, _r = kappa_physical, r_physical


@derives(
    "eq:eekappar",
    "What the ordering of scales implies: r/kappa^2 is large",
    ("eq:tildexykappa", "eq:tilder"),
)
def eekappar(d: Any) -> None:
    s, q = Symbol("s", positive=True), Symbol("q", positive=True)
    d.suppose("0 < eps, kappa_phys < r_phys < 1", where="eq:eekappar, with < for <<")
    ratio = d.step(
        "scaled ratio",
        "scale",
        _r / _k**2,
        Identity(lambda: d.use("eq:tilder", "r") / d.use("eq:tildexykappa", "kappa") ** 2),
        "r/kappa^2 is the same in scaled and unscaled variables",
        left=r"\rho = \frac{r}{\kappa^2}",
    )
    form = d.step(
        "in terms of the two gaps",
        "substitute",
        (1 + q) ** 2 * (1 + s),
        Identity(lambda: ratio.subs(_k, _r / (1 + q)).subs(_r, 1 / (1 + s))),
        "kappa_phys = r_phys/(1 + q) and r_phys = 1/(1 + s) cover 0 < kappa_phys < r_phys < 1 as "
        "q and s go over (0, oo)",
        left=r"\rho",
    )
    d.step(
        "the ratio exceeds 1",
        "bound",
        Inequality(form, ">", sympy.Integer(1)),
        Bound(difference=q**2 * s + q**2 + 2 * q * s + 2 * q + s, on="0 < kappa_phys < r_phys < 1"),
    )
    d.conclude(
        Symbol("rho"),
        ratio,
        note="the ordering of the scales is the paper's assumption; it makes r/kappa^2 > 1, "
        "and large",
        display=(
            r"0 < \varepsilon, \kappa_p \ll r_p \ll 1 ,\quad \frac{r}{\kappa^2} = ",
            ratio,
            r" \gg 1",
        ),
    )


def _scaled_rate(d: Any) -> None:
    """The step by which 2/kappa^2 is written with the physical noise amplitude."""
    d.step(
        "the noise in physical units",
        "substitute",
        2 * eps / _k**2,
        Identity(lambda: 2 / d.use("eq:tildexykappa", "kappa") ** 2),
        "kappa = kappa_phys/sqrt(eps); V, a- and a+ are the same in both",
        left=r"\frac{2}{\kappa^2}",
    )


@derives("eq:Plarge", "Occupation in strong noise, unscaled", ("eq:Plarge2", "eq:tildexykappa"))
def p_large(d: Any) -> None:
    leading = 4 * eps / ((1 / a_minus - 1 / a_plus_sliding) * _k**2)

    def reference() -> list[Any]:
        scaled = d.use("eq:Plarge2", "P")
        K = d.use("eq:tildexykappa", "kappa")
        return [scaled.leading.subs(kappa, K), scaled.gauge.subs(kappa, K)]

    _scaled_rate(d)

    d.suppose("attracting sliding and kappa_phys >> sqrt(eps)")
    d.suppose(
        "times longer than the relaxation time, O(kappa_phys^2), and at most O(r_phys)",
        where="the density is then near its steady state",
    )
    found = d.step(
        "unscale",
        "scale",
        (leading, eps**2 / _k**4),
        Identity(reference),
        left=(
            r"\frac{4}{\kappa^2 (1/a^- - 1/a^+)}",
            r"\frac{1}{\kappa^4}",
        ),
    )
    d.conclude(Symbol("P"), found[0], "next term O(eps^2/kappa_phys^4)")


@derives("eq:Psmall", "Occupation in weak noise, unscaled", ("eq:Psmall2", "eq:tildexykappa"))
def p_small(d: Any) -> None:
    names = {n: Symbol(n, real=True) for n in ("V_1", "V_m")}
    curvature = Symbol("K_m", positive=True)
    V_1, V_m = names["V_1"], names["V_m"]
    rate = 2 * eps / _k**2
    leading = (
        _k
        * sympy.sqrt(curvature)
        / (2 * sympy.sqrt(sympy.pi * eps))
        * (sympy.exp(rate * V_m) / a_minus - sympy.exp(rate * (V_m - V_1)) / a_plus_sliding)
    )
    d.suppose(
        "attracting sliding, kappa_phys << sqrt(eps), and one lowest well inside the layer, of "
        "curvature V''(u_m) > 0"
    )
    _scaled_rate(d)
    found = d.step(
        "unscale",
        "scale",
        leading,
        Identity(
            lambda: d.use("eq:Psmall2", "1 - P").leading.subs(
                kappa, d.use("eq:tildexykappa", "kappa")
            )
        ),
        "1 - P is exponentially small in eps/kappa_phys^2; the paper's O(kappa_phys^2/eps) is not "
        "sharp",
        left=r"1 - P \sim",
    )
    d.conclude(
        1 - Symbol("P"),
        found,
        "relative O(kappa_phys^2/eps)",
        note="u_m is the lowest point of V",
    )


@derives(
    "eq:Tlarge",
    "Escape in strong noise, unscaled",
    ("eq:Ttildelarge", "eq:TtildetoT", "eq:tilder", "eq:tildexykappa"),
)
def t_large(d: Any) -> None:
    s = Symbol("s", positive=True)
    d.suppose("crossing to the right, sqrt(eps) <= kappa_phys < r_phys")

    def unscaled() -> list[Any]:
        expansion = d.use("eq:Ttildelarge", "T")
        scales = {r: d.use("eq:tilder", "r"), kappa: d.use("eq:tildexykappa", "kappa")}
        time = d.use("eq:TtildetoT", "T")
        clock = Symbol("t_s", positive=True)
        return [time.subs(clock, e.subs(scales)) for e in (expansion.leading, expansion.gauge)]

    scaled = d.step(
        "unscale",
        "scale",
        (_r / a_plus, _k**2),
        Identity(unscaled),
        "eps times eq:Ttildelarge: the remainder is O(kappa_phys^2)",
        left=(
            r"\varepsilon \frac{r}{a^+}",
            r"\varepsilon \kappa^2",
        ),
    )
    d.step(
        "kappa_phys^2 is inside O(r_phys^2)",
        "bound",
        Inequality(scaled[1], "<", (_k + s) ** 2),
        Bound(difference=2 * _k * s + s**2, on="kappa_phys < r_phys = kappa_phys + s"),
        "with the O(r_phys) of the coefficients this is the paper's O(r_phys^2)",
    )
    d.conclude(
        Symbol("T"),
        scaled[0],
        "O(r_phys^2), for sqrt(eps) <= kappa_phys < r_phys, so that eps < r_phys^2",
        note="in weak noise, with phi > 0, the error is O(eps) + O(r_phys^2), by eq:S",
    )


@derives("eq:Tsmall", "The noise at which the well's term equals r/a+", ("eq:Ttildesmall",))
def t_small(d: Any) -> None:
    D = Symbol("D", positive=True)
    A1, A2 = Symbol("A_1", negative=True), Symbol("A_2", positive=True)
    prefactor = 2 * sympy.pi / sympy.sqrt(-A1 * A2)
    d.suppose("a well at u1 and a barrier at u2, 0 < u2 < 1")
    d.suppose(
        "r sqrt(-A_1 A_2) > 2 pi a+", where="else the well's term exceeds r/a+ at every noise"
    )
    d.suppose(
        "a negative drift on some interval is enough for T > O(r)",
        "fails",
        "A = 3/10 + 2 u + 3 u^2, kappa = 1/20",
        lambda: d.holds("harmless_well"),
    )
    d.suppose(
        "kappa << 1 is enough for T > O(r)",
        "fails",
        "friction, mu = 3, z0 = -2/5, kappa = 3/10, r = 10^12",
        lambda: d.holds("far_radius"),
    )
    large = Symbol("X", positive=True)

    def equal_terms() -> Any:
        formula = d.use("eq:Ttildesmall", "T").leading
        drift = formula - formula.subs(r, 0)
        well = formula.subs(r, 0).subs(kappa, sympy.sqrt(large))
        return sympy.sqrt(sympy.solve(well - drift, large)[0])

    d.step(
        "the well's term as large as r/a+",
        "solve",
        r / (a_plus * prefactor),
        Satisfies(
            lambda size: {
                "both terms": d.use("eq:Ttildesmall", "T").leading.subs(
                    kappa, sympy.sqrt(2 * D / sympy.log(size))
                )
                - 2 * r / a_plus
            }
        ),
        "eq:Ttildesmall has one term with r and one with the exponential",
        left=r"e^{2 D/\kappa_e^2}",
    )
    edge = d.step(
        "noise at which both terms of eq:Ttildesmall are equal",
        "solve",
        sympy.sqrt(2 * D / sympy.log(r / (a_plus * prefactor))),
        Identity(equal_terms),
        "T > O(r) needs kappa below this, which is stronger than kappa << 1: r/eps enters",
        left=r"\kappa_e",
    )
    d.conclude(
        Symbol("kappa_e"),
        edge,
        note="D = V(u2) - V(u1), the height of the barrier",
    )
