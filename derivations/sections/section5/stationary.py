"""Section 5.1: the Fokker-Planck equation, the potential, and the steady state."""

from __future__ import annotations

from typing import Any

import sympy
from sympy import Function, Symbol

from derivations.paper import V, a_minus, a_plus, kappa, phi, u, v
from derivations.registry import derives
from symasym.derivation import Identity, Satisfies

_half = kappa**2 / 2
_V1 = Symbol("V_1", real=True)


@derives("eq:FPE", "The Fokker-Planck equation", ("eq:reducedSDEtilde",))
def fokker_planck(d: Any) -> None:
    g, q = Function("g")(u), Function("q")(u)

    def generator() -> Any:
        first, second = d.use("eq:reducedSDEtilde", "c_1", "c_2")
        return first * sympy.diff(g, u) + second * sympy.diff(g, u, 2)

    backward = d.step(
        "generator",
        "substitute",
        phi(u) * sympy.diff(g, u) + _half * sympy.diff(g, u, 2),
        Identity(generator),
        "the rate at which the mean of g(u) changes",
        left=r"\mathcal{L} g",
    )

    def adjoint(forward: Any) -> dict[str, Any]:
        boundary = -phi(u) * q * g + _half * (sympy.diff(q, u) * g - q * sympy.diff(g, u))
        return {
            "g times it less q times the generator is a derivative": g * forward
            - q * backward
            - sympy.diff(boundary, u)
        }

    # Derivatives left standing: printed, they read as the equation is written.
    forward = -sympy.Derivative(phi(u) * q, u) + _half * sympy.Derivative(q, (u, 2))
    found = d.step(
        "adjoint of the generator",
        "integrate",
        forward,
        Satisfies(adjoint),
        "by parts: the density's operator is the adjoint of the one for expectations",
        left=r"\mathcal{L}^* q",
    )
    d.conclude(
        Symbol("Lq"),
        found,
        note="p is the density of u at a time, and q any function of u",
        display=(
            r"\frac{\partial p}{\partial \tilde t} = \mathcal{L}^* p ,\quad \mathcal{L}^* q = ",
            found,
        ),
    )


@derives("eq:V", "The potential")
def potential(d: Any) -> None:
    c = Symbol("c", real=True)
    every = d.step(
        "every potential of phi",
        "integrate",
        c - sympy.Integral(phi(v), (v, -1, u)),
        Satisfies(lambda V: {"V' = -phi": sympy.diff(V, u) + phi(u)}),
        "what a potential is for: the drift is -V'; c is any constant",
        left="V(u)",
    )
    found = d.step(
        "0 at the left edge",
        "define",
        -sympy.Integral(phi(v), (v, -1, u)),
        Identity(lambda: every.subs(c, sympy.solve(every.subs(u, -1).doit(), c)[0])),
        "V(-1) = 0 fixes the constant: c = 0",
        left="V(u)",
    )
    d.conclude(V(u), found)


@derives("eq:V2", "The potential, piece by piece", ("eq:V", "eq:phi"))
def potential_pieces(d: Any) -> None:
    A = Function("A")
    ends = {A(-1): a_minus, A(1): a_plus}

    def potential_of(piece: int) -> Any:
        """V of eq:V with one piece of eq:phi for the drift everywhere."""
        drift = d.use("eq:phi", "phi(u)")[piece].subs(ends)
        return d.use("eq:V", "V(u)").replace(phi, lambda at: drift.subs(u, at)).doit()

    places = (r"V \big|_{u \le -1}", r"V \big|_{|u| \le 1}", r"V \big|_{u \ge 1}")
    wanted = (
        lambda: potential_of(0),
        lambda: potential_of(1),
        lambda: _V1 + potential_of(2) - potential_of(2).subs(u, 1),
    )
    whole = d.step(
        "drift of each piece substituted",
        "substitute",
        (
            -sympy.Integral(a_minus, (v, -1, u)),
            -sympy.Integral(A(v), (v, -1, u)),
            _V1 - sympy.Integral(a_plus, (v, 1, u)),
        ),
        Satisfies(
            lambda W: {
                f"piece {k}": (piece - of()).doit()
                for k, (piece, of) in enumerate(zip(W, wanted, strict=True), 1)
            }
        ),
        "a- = A(-1), a+ = A(1); V(1) is the integral over the whole layer",
        left=places,
    )
    inside = whole[1]
    left, right = d.step(
        "constant drifts integrated",
        "integrate",
        (-a_minus * (u + 1), _V1 - a_plus * (u - 1)),
        Identity(lambda: [whole[0].doit(), whole[2].doit()]),
        left=(places[0], places[2]),
    )
    found = d.step(
        "together",
        "evaluate",
        (left, inside, right),
        Satisfies(
            lambda W: {
                "continuous at -1": W[0].subs(u, -1) - W[1].subs(u, -1).doit(),
                "V(1) at 1": W[2].subs(u, 1) - _V1,
                **{
                    f"slope of piece {k}": sympy.diff(piece, u) + drift.subs(ends)
                    for k, (piece, drift) in enumerate(
                        zip(W, d.use("eq:phi", "phi(u)"), strict=True), 1
                    )
                },
            }
        ),
        left=places,
    )
    d.conclude(V(u), found, cases=(r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"))


@derives("eq:pss", "The steady state", ("eq:FPE", "eq:V"))
def steady_state(d: Any) -> None:
    K = Symbol("K", positive=True)

    def with_potential(e: Any) -> Any:
        """`e` with V as eq:V has it."""
        return e.replace(V, lambda at: d.use("eq:V", "V(u)").subs(u, at))

    def no_flux(density: Any) -> dict[str, Any]:
        here = with_potential(density)
        return {
            "flux 0": -phi(u) * here + _half * sympy.diff(here, u),
            "Fokker-Planck": d.use("eq:FPE", "Lq")
            .replace(Function("q"), lambda a: here.subs(u, a))
            .doit(),
            "K is the density at -1": here.subs(u, -1).doit() - K,
        }

    d.suppose("the density and its flux vanish at infinity")
    d.suppose("a- > 0 > a+, for K > 0 to exist", where="else the mass is infinite")
    p = Function("p_ss")(u)
    flux = d.step(
        "flux to the left of a stationary density",
        "integrate",
        -phi(u) * p + _half * sympy.Derivative(p, u),
        Satisfies(
            lambda J: {
                "its derivative is the right side of eq:FPE": (
                    sympy.diff(J, u)
                    - d.use("eq:FPE", "Lq").replace(Function("q"), Function("p_ss"))
                ).doit()
            }
        ),
        "which is 0 in the steady state: the flux is a constant, and 0, as it is at infinity",
        left="J",
    )
    slope = d.step(
        "slope where the flux is 0",
        "solve",
        2 * phi(u) / kappa**2,
        Satisfies(lambda s: {"flux": flux.subs(sympy.Derivative(p, u), s * p)}),
        left=r"\frac{p_{\mathrm{ss}}'(u)}{p_{\mathrm{ss}}(u)}",
    )
    d.step(
        "logarithm of the density",
        "integrate",
        sympy.log(K) - 2 * V(u) / kappa**2,
        Satisfies(
            lambda found: {
                "its slope": sympy.diff(with_potential(found), u) - slope,
                "log K at -1": with_potential(found).subs(u, -1).doit() - sympy.log(K),
            }
        ),
        "V' = -phi and V(-1) = 0",
        left=r"\log p_{\mathrm{ss}}(u)",
    )
    found = d.step(
        "density of zero flux",
        "solve",
        K * sympy.exp(-2 * V(u) / kappa**2),
        Satisfies(no_flux),
        "K is the density at -1, and follows from the whole mass, 1 (eq:P)",
        left=r"p_{\mathrm{ss}}(u)",
    )
    length = Symbol("ell", positive=True)
    decay = sympy.exp(-2 * a_minus * (length - 1) / kappa**2)
    d.step(
        "mass left of the layer, up to -ell",
        "integrate",
        kappa**2 / (2 * a_minus) * (1 - decay),
        Identity(
            lambda: sympy.integrate(
                with_potential(found / K).replace(phi, lambda _: a_minus).doit(), (u, -length, -1)
            )
        ),
        "finite as ell grows only for a- > 0; on the right in the same way only for a+ < 0",
        left=r"\int_{-\ell}^{-1} e^{-2 V(u)/\kappa^2} \, du",
    )
    d.conclude(Function("p_ss")(u), found)
