"""Section 5.1: the Fokker-Planck equation, the potential, and the steady state."""

from sympy import Derivative, Function, Integral, Symbol, exp

from derivations.paper import V_1, V, a_minus, a_plus, kappa, phi, u, v
from derivations.sections.section4_reduction import PIECES, A, moments
from symasym.derivation.derivation import derives

g, q, p_ss = Function("g"), Function("q"), Function("p_ss")
half = kappa**2 / 2


@derives("eq:FPE", "The Fokker-Planck equation")
def fokker_planck(d):
    drift, variance = moments(d["eq:reducedSDEtilde"])
    mean = lambda L, f: L.replace(g, f).doit()
    backward = d.eq("generator", r"\mathcal{L} g", phi(u) * Derivative(g(u), u) + half * Derivative(g(u), (u, 2)),
                    "for smooth $g$; it is determined by the rates at which the means of $u$ and of $u^2$ change",
                    lambda L: [(mean(L, lambda x: x), drift), (mean(L, lambda x: x**2), 2 * u * drift + variance)])
    boundary = -phi(u) * q(u) * g(u) + half * (q(u).diff(u) * g(u) - q(u) * g(u).diff(u))
    d.eq("adjoint of the generator", r"\mathcal{L}^* q",
         -Derivative(phi(u) * q(u), u) + half * Derivative(q(u), (u, 2)),
         "by integration by parts, the operator for the density is the adjoint of the one for expectations",
         lambda forward: [(g(u) * forward - q(u) * backward, Derivative(boundary, u).doit())])
    d.conclude(note=r"$\partial p/\partial t = \mathcal{L}^* p$ for the density $p$ of $u$ at the scaled time $t$")


@derives("eq:V", "The potential")
def potential(d):
    d.eq("0 at the left edge", V(u), -Integral(phi(v), (v, -1, u)), "$V' = -\\phi$ and $V(-1) = 0$",
         [(Derivative(V(u), u), -phi(u)), (V(-1), 0)])


@derives("eq:V2", "The potential, piece by piece")
def potential_pieces(d):
    drift = {x: d["eq:phi", x].subs({A(-1): a_minus, A(1): a_plus}) for x in ("left", "inside", "right")}
    of = {x: d["eq:V"].replace(phi, lambda at, x=x: drift[x].subs(u, at)) for x in drift}
    d.eq("left", V(u), -a_minus * (u + 1), "$a^- = A(-1)$", by=of["left"])
    d.eq("inside", V(u), -Integral(A(v), (v, -1, u)), by=of["inside"])
    d.eq("right", V(u), V_1 - a_plus * (u - 1), "it continues from $V(1)$, and $a^+ = A(1)$",
         [(Derivative(V(u), u), Derivative(of["right"], u)), (V(1), V_1)])
    d.conclude("left", "inside", "right", cases=PIECES,
               note="$V(1)$ is the potential at the right edge, that is, the second line at $u = 1$")


@derives("eq:pss", "The steady state")
def steady_state(d):
    K = Symbol("K", positive=True)
    d.suppose("the density and its flux vanish at infinity")
    d.suppose("$a^- > 0 > a^+$, so that $K > 0$ exists; otherwise a tail and hence the mass is infinite")
    of = lambda p, e: e.replace(q, lambda x: p.subs(u, x)).replace(V, lambda x: d["eq:V"].subs(u, x))
    d.eq("density of zero flux", p_ss(u), K * exp(-2 * V(u) / kappa**2),
         r"$\mathcal{L}^* p_{ss} = 0$ means that the flux $(\kappa^2/2) p_{ss}' - \phi p_{ss}$ is constant; it "
         "is 0, since it vanishes at infinity",
         lambda p: [(of(p, d["eq:FPE"]), 0), (of(p, half * Derivative(q(u), u) - phi(u) * q(u)), 0),
                    (of(p, q(-1)), K)])
    d.conclude(note="$K$ is the density at $u = -1$ (1/scaled length); it follows from the total mass, which is "
                    "1 (eq:P)")
