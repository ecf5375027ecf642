r"""Noise that depends on the state, beyond the paper: scale and speed, the mean exit time, and Kramers' rate.

du = phi dt + kappa sigma(u) dW with sigma taken at u + alpha du: alpha is 0 by Itô's prescription, 1/2 by that of
Stratonovich. C. W. Gardiner, Handbook of Stochastic Methods, 4.3 and 5.2; H. A. Kramers, Physica 7 (1940) 284.
"""

import sympy
from sympy import Derivative, Function, Integral, S, Symbol, exp, pi, sqrt, symbols

from derivations import paper
from derivations.paper import kappa, lam, phi, r, u, v
from derivations.sections.section4_reduction import dt, dW, moments
from derivations.sections.section5.stationary import half
from derivations.sections.section6.well import A1, A2, AT, S1, S2, SCENE, WEAK, about
from derivations.sections.section6.well import D as barrier_height
from symasym.derivation.derivation import derives

alpha, x, V_1, V_2 = symbols(r"\alpha x V_\sigma(u_1) V_\sigma(u_2)", real=True)
sigma_1, sigma_2, D = symbols(r"\sigma(u_1) \sigma(u_2) D_\sigma", positive=True)
f, V, m, Sigma, T, C = (Function(name) for name in ("f", r"V_\sigma", "m", "Sigma", "T", "C"))
sigma, slope = Function("sigma", positive=True)(u), Function("sigma", positive=True)(u).diff(u)
FORCE = {V(u).diff(u): -phi(u) / sigma**2}
STATE = (r"in $du = \phi \, dt + \kappa \sigma(u) \, dW$ the amplitude $\sigma$ is taken at $u + \alpha \, du$, "
    r"with $\alpha = 0$ for Itô's prescription and 1/2 for that of Stratonovich")


@derives("state-noise", "Noise that depends on the state: the generator, the scale and the speed density")
def state_noise(d):
    d.suppose(r"$\sigma$ is smooth and positive")
    moved = sigma + alpha * slope * kappa * sigma * dW
    step = d.eq("one step", "du", (phi(u) + alpha * kappa**2 * sigma * slope) * dt + kappa * sigma * dW,
                r"at $u + \alpha \, du$ the amplitude is $\sigma + \alpha \sigma' \kappa \sigma \, dW$, and "
                "$dW^2 = dt$",
                by=(phi(u) * dt + kappa * moved * dW).expand().subs(dW**2, dt))
    drift, variance = moments(step.expand())
    whole = d.eq("generator", r"\mathcal{L} f =", phi(u) * f(u).diff(u) + half * sigma**(2 - 2 * alpha)
                 * Derivative(sigma**(2 * alpha) * f(u).diff(u), u), "it follows from the drift and the "
                 "variance of the step",
                 by=drift * f(u).diff(u) + variance / 2 * f(u).diff(u, u))
    d.eq("Itô", r"\mathcal{L} f|_{\alpha = 0} =", phi(u) * f(u).diff(u) + half * sigma**2 * f(u).diff(u, u),
         by=whole.subs(alpha, 0))
    d.eq("Stratonovich", r"\mathcal{L} f|_{\alpha = 1/2} =", (phi(u) + half * sigma * slope) * f(u).diff(u) + half
         * sigma**2 * f(u).diff(u, u),
         r"the drift has the additional term $\kappa^2 \sigma \sigma'/2$", by=whole.subs(alpha, S.Half))
    scale = d.eq("scale density", Sigma(u).diff(u), exp(lam * V(u)) * sigma**(-2 * alpha),
                 r"from $\mathcal{L} \Sigma = 0$, with the value $\sigma^{-2 \alpha}$ "
                 r"where $V_\sigma = 0$", lambda e: [
                     (whole.subs(f(u).diff(u), e).doit().subs(FORCE), 0), (e.subs(V(u), 0), sigma**(-2 * alpha))])
    d.eq("speed density", m(u), lam * exp(-lam * V(u)) * sigma**(2 * alpha - 2),
         r"from $m \, \mathcal{L} f = (f'/\Sigma')'$ for all $f$",
         lambda e: [(e * whole.doit(), (f(u).diff(u) / scale).diff(u).subs(FORCE))])
    d.conclude("generator", "Itô", "Stratonovich", "scale density", "speed density", note=STATE)


@derives("state-noise-time", "Mean exit time and exit probability with noise that depends on the state")
def exit_time(d):
    whole, density = d["state-noise", "generator"].doit(), lambda name: d["state-noise", f"{name} density"]
    bend = lambda y, value: sympy.solve(whole.replace(f, y).doit() - value, y(u).diff(u, u))[0]
    source = d.eq("over the square of sigma", r"\frac{\kappa^2}{2} \left( T'' - T' \Sigma''/\Sigma' \right) =",
                  -m(u) * Sigma(u).diff(u) / lam,
                  r"from $\mathcal{L} T = -1$ and $\mathcal{L} \Sigma = 0$", lambda e: [
                      (half * (bend(T, -1) - bend(Sigma, 0) / Sigma(u).diff(u) * T(u).diff(u)), e.subs(
                          {m(u): density("speed"), Sigma(u).diff(u): density("scale")}))])
    left = d.eq("leaving on the left", C(x), (Sigma(r) - Sigma(x)) / Sigma(r),
                r"from $\mathcal{L} C = 0$", lambda e: [
        (whole.replace(f, lambda at: e.subs(x, at)).doit().subs(Sigma(u).diff(u, u), bend(Sigma, 0)), 0),
        (e.subs(x, r), 0), (e.subs(x, -r).subs(Sigma(-r), 0), 1)])
    force = lambda at: -(lam * source).subs(u, at)
    green = d["release-order", "Green's function"].replace(Function("s"), force) / lam
    d.eq("mean exit time", T(x), C(x) * Integral(Sigma(v) * m(v), (v, -r, x))
         + (1 - C(x)) * Integral((Sigma(r) - Sigma(v)) * m(v), (v, x, r)), "this is the solution of "
         "'release-order', in positive terms",
         lambda e: [(e.subs(C(x), left), green)])
    d.conclude("mean exit time", "leaving on the left", note=r"$x$ is the start, $\Sigma' = e^{\lambda V_\sigma} "
               r"\sigma^{-2 \alpha}$ the scale density, $\Sigma(-r) = 0$, $m = \lambda e^{-\lambda V_\sigma} "
               r"\sigma^{2 \alpha - 2}$ the speed density, $C$ the probability of leaving through $-r$; " + STATE)


def exact(k, ctx):
    """Mass times barrier for alpha = 0.3, sigma = 1 + u/4 and SCENE's potential, which is V_sigma."""
    well, barrier = (about(SCENE, zero, -1, 1, k, ctx, lambda y, power=power: (1 + y / 4)**ctx.mpf(power))
                     for zero, power in ((0, "-1.4"), (1, "-0.6")))
    return 2 / k**2 * well * barrier


@derives("state-noise-rate", "Kramers' time and the principal eigenvalue with noise that depends on the state")
def kramers(d):
    d.suppose(r"$\phi$ has two simple zeros: the well $u_1$, where $V_\sigma$ is lowest, and the barrier "
              r"$u_2 > u_1$, where $V_\sigma$ is highest up to $r$; the start is on the well's side of $u_2$")
    d.suppose(r"either $V_\sigma(-r) > V_\sigma(u_2)$, so that $C$ is exponentially small, or the end $-r$ "
              "reflects")
    gauss, density = d["gaussian-step", "one Gaussian"], lambda name: d["state-noise", f"{name} density"]
    mass = d.eq("mass of the well", r"\int m \, du \sim", lam * kappa * sqrt(pi / S1) * exp(-lam * V_1)
                * sigma_1**(2 * alpha - 2), r"here $s_1 = V_\sigma''(u_1)$",
                by=density("speed").subs({V(u): V_1, sigma: sigma_1}) * gauss)
    climb = d.eq("barrier", r"\int \Sigma' \, du \sim", kappa * sqrt(pi / S2) * exp(lam * V_2)
                 * sigma_2**(-2 * alpha), r"here $s_2 = -V_\sigma''(u_2)$",
                 by=density("scale").subs({V(u): V_2, sigma: sigma_2}) * gauss.subs(S1, S2))
    inner = d["state-noise-time", "mean exit time"].subs(C(x), 0).subs({Sigma(r): climb, Sigma(v): 0, m(v): 1})
    lead = d.eq("product", r"T \sim", 2 * pi / sqrt(S1 * S2) * sigma_1**(2 * alpha - 2) * sigma_2**(-2 * alpha)
                * exp(2 * D / kappa**2), r"where $m$ is large, $\Sigma(r) - \Sigma$ is the integral over the "
                                         "whole barrier",
                by=(inner.function * mass).subs(V_2, V_1 + D))
    found = d.order("order", paper.T, lead, kappa**2 * exp(2 * D / kappa**2), exact, WEAK, {
        S1: lambda k, ctx: -AT[A1](k, ctx), S2: AT[A2], D: AT[barrier_height], alpha: "0.3",
        **{s: lambda k, ctx, n=n: 1 + SCENE.roots(ctx)[n] / 4 for n, s in enumerate((sigma_1, sigma_2))}})
    bend = Derivative(-phi(u) / sigma**2, u).doit().subs(phi(u).diff(u), A1).subs({phi(u): 0, sigma: sigma_1})
    curved = d.eq("curvature", r"V_\sigma''(u_1) =", -A1 / sigma_1**2, r"because $\phi(u_1) = 0$", by=bend)
    time = d.eq("mean time", paper.T, 2 * pi / sqrt(-A1 * A2) * (sigma_1 / sigma_2)**(2 * alpha - 1)
                * exp(2 * D / kappa**2), r"under Stratonovich's prescription $\sigma$ appears only in $D_\sigma$",
                by=found.subs({S1: curved, S2: -curved.subs({A1: A2, sigma_1: sigma_2})}))
    d.eq("principal eigenvalue", Symbol(r"\lambda_1"), sqrt(-A1 * A2) / (2 * pi)
         * (sigma_2 / sigma_1)**(2 * alpha - 1) * exp(-2 * D / kappa**2), "its mode $q$, which solves "
         r"$(q'/\Sigma')' = -\lambda_1 m q$, is 1 in the well and falls to 0 over the barrier; the fall is "
         r"$\lambda_1 \int m \, du \int \Sigma' \, du = \lambda_1 T$", lambda e: [(e * time, 1)])
    d.conclude("mean time", "principal eigenvalue", error=r"relative $O(\kappa^2)$",
               note=STATE)
