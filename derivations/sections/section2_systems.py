"""Section 2: the discontinuous system, its smoothing, and Filippov's sliding field."""

from sympy import Function, Symbol, symbols

from derivations.paper import a_minus, a_plus_sliding, eps
from symasym.derivation.derivation import derives

y, z, g_s, g_minus, g_plus = symbols("y z g_s g^- g^+", real=True)
theta = Symbol("theta", positive=True)
f_minus, F, f_plus = Function("f^-"), Function("F"), Function("f^+")
below, inside, above = f_minus(y, z), F(y / eps, y, z), f_plus(y, z)  # eq:genPerturbed


@derives("filippov", "Filippov's sliding vector field")
def filippov(d):
    d.suppose("attracting sliding: $a^- > 0 > a^+$")
    share = d.eq("share of f+", theta, a_minus / (a_minus - a_plus_sliding),
                 "the share of $f^+$ in the convex combination of the two fields that is tangent to the surface",
                 [(theta * a_plus_sliding + (1 - theta) * a_minus, 0)])
    d.eq("tangential component", g_s, (a_minus * g_plus - a_plus_sliding * g_minus) / (a_minus - a_plus_sliding),
         r"it is $\theta g^+ + (1 - \theta) g^-$", by=share * g_plus + (1 - share) * g_minus)
    d.conclude(note="$g^-$, $g^+$ and $g_s$ are the velocities along the surface: on its left, on its right, "
                    "and while sliding on it")


@derives("eq:cont", "The smoothing joins both fields at the edges of the layer")
def continuity(d):
    d.suppose("$f^-$, $f^+$ and $F$ are continuous in all their arguments")
    d.eq("lower edge", F(-1, -eps, z), f_minus(-eps, z), r"the limit $y \to -\varepsilon$ from inside, with the "
         "second argument held fixed, equals the value outside", [(inside.subs(y, -eps), below.subs(y, -eps))])
    d.eq("upper edge", F(1, eps, z), f_plus(eps, z), r"this is the same limit for $y \to \varepsilon$",
         [(inside.subs(y, eps), above.subs(y, eps))])
    d.conclude("lower edge", "upper edge", note=r"$f^-$, $F(y/\varepsilon, \cdot)$, $f^+$ are the fields below, "
               "in and above the layer (eq:genPerturbed)")
