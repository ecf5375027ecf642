"""Section 2: the discontinuous system, its smoothing, and Filippov's sliding field."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Symbol

from derivations.paper import a_minus, a_plus_sliding, alpha, eps, mu
from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

y, z = Symbol("y", real=True), Symbol("z", real=True)


@derives("filippov", "Filippov's sliding vector field")
def filippov(d: Any) -> None:
    theta = Symbol("theta", positive=True)
    g_minus, g_plus = Symbol("g_minus", real=True), Symbol("g_plus", real=True)
    d.names |= {theta: r"\theta", g_minus: "g^-", g_plus: "g^+"}
    d.suppose("attracting sliding: a- > 0 > a+", where="the lower left entry of the region table")
    share = d.step(
        "share of f+",
        "solve",
        a_minus / (a_minus - a_plus_sliding),
        Satisfies(lambda s: {"normal component 0": s * a_plus_sliding + (1 - s) * a_minus}),
        "the convex combination of the two fields that is tangent to the surface",
    )
    field = d.step(
        "tangential component",
        "substitute",
        (a_minus * g_plus - a_plus_sliding * g_minus) / (a_minus - a_plus_sliding),
        Identity(lambda: share * g_plus + (1 - share) * g_minus),
    )
    d.conclude(Symbol("g_s"), field)


@derives("eq:cont", "The smoothing joins both fields at the edges of the layer")
def cont(d: Any) -> None:
    def inside(side: int) -> Any:
        s = y / eps
        force = alpha * (s + mu * (s - s**3))
        return sympy.limit(1 - z - y - force, y, side * eps)

    # Shown on the friction oscillator, where y occurs both inside y/eps and by itself.
    limits = d.step(
        "limits from inside",
        "take limit",
        (1 - z - eps - alpha, 1 - z + eps + alpha),
        Identity(lambda: [inside(1), inside(-1)]),
        "y/eps is held at 1 and -1 while the y that stands by itself stays",
    )
    d.step(
        "values outside",
        "substitute",
        limits,
        Identity(lambda: [(1 - z - y - alpha).subs(y, eps), (1 - z - y + alpha).subs(y, -eps)]),
        "the same two values from f+ at y = eps and f- at y = -eps",
    )
    F = sympy.Function("F")
    d.conclude((F(1), F(-1)), limits)
