"""Section 2: the discontinuous system, its smoothing, and Filippov's sliding field."""

from __future__ import annotations

from typing import Any

from sympy import Function, Symbol

from derivations.paper import a_minus, a_plus_sliding, eps
from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

y, z = Symbol("y", real=True), Symbol("z", real=True)
f_minus, F, f_plus = Function("f^-"), Function("F"), Function("f^+")


@derives("filippov", "Filippov's sliding vector field")
def filippov(d: Any) -> None:
    theta = Symbol("theta", positive=True)
    g_minus, g_plus = Symbol("g_minus", real=True), Symbol("g_plus", real=True)
    d.names |= {theta: r"\theta", g_minus: "g^-", g_plus: "g^+"}
    d.suppose("attracting sliding: a- > 0 > a+")
    share = d.step(
        "share of f+",
        "solve",
        a_minus / (a_minus - a_plus_sliding),
        Satisfies(lambda s: {"normal component 0": s * a_plus_sliding + (1 - s) * a_minus}),
        "the convex combination of the two fields that is tangent to the surface",
        left=r"\theta",
    )
    field = d.step(
        "tangential component",
        "substitute",
        (a_minus * g_plus - a_plus_sliding * g_minus) / (a_minus - a_plus_sliding),
        Identity(lambda: share * g_plus + (1 - share) * g_minus),
        left=r"g_s = \theta g^+ + (1 - \theta) g^-",
    )
    d.conclude(Symbol("g_s"), field)


def smoothed() -> tuple[Any, Any, Any]:
    """The field of eq:genPerturbed below, in and above the layer, at (y, z)."""
    return f_minus(y, z), F(y / eps, y, z), f_plus(y, z)


@derives("eq:cont", "The smoothing joins both fields at the edges of the layer")
def cont(d: Any) -> None:
    below, inside, above = smoothed()
    d.suppose("f-, f+ and F are continuous in all their arguments")
    limits = d.step(
        "limits from inside",
        "take limit",
        (F(1, eps, z), F(-1, -eps, z)),
        Identity(lambda: [inside.subs(y, eps), inside.subs(y, -eps)]),
        "F(y/eps, y, z) as y goes to eps and to -eps: the y that stands by itself goes along",
        left=(
            r"\lim_{y \to \varepsilon} F(y/\varepsilon, y, z)",
            r"\lim_{y \to -\varepsilon} F(y/\varepsilon, y, z)",
        ),
    )
    values = d.step(
        "values outside",
        "substitute",
        (f_plus(eps, z), f_minus(-eps, z)),
        Identity(lambda: [above.subs(y, eps), below.subs(y, -eps)]),
        "the field outside at the same two edges; continuity there is that both agree",
        left=(
            r"\lim_{y \to \varepsilon} f^+(y, z)",
            r"\lim_{y \to -\varepsilon} f^-(y, z)",
        ),
    )
    d.conclude(limits, values, note="f-, f+ and F are the fields of eq:genPerturbed")
