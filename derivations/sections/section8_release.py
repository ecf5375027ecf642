"""The whole system, beyond the paper: the mean time of release, its expansion, and its rate.

Scaled variables: du = phi(u, z, eps u) dt + kappa dW, dz = eps g dt, and L f = phi f_u +
(kappa^2/2) f_uu + eps g f_z. No label of the paper rests on these.
"""

import sympy
from sympy import Derivative, Function, Integral, Limit, Rational, Symbol, exp, log, oo, symbols

from derivations.paper import eps, kappa, lam, r, t, u, v
from symasym.derivation.derivation import derives

g, phi, z, x = symbols("g phi z x", real=True)
slope_y = Symbol(r"\phi_y", real=True)
p, q, h, past, a, b = symbols("p q h s a b", positive=True)
T, M, V, H, k, D = (Function(name) for name in ("T", "M", "v", "H", "k", "D"))
at = u, z
SLOW = r"$g$ is $dz/dt$ over $\varepsilon$, $z$ the slow variable, unscaled"


def operator(symbol, f):
    """L f from the symbol of L: p stands for d/du, q for d/dz."""
    return sum(c * sympy.diff(f, (u, i), (z, j)) for (i, j), c in sympy.Poly(symbol, p, q).terms())


@derives("release-time", "Mean and variance of the time of release")
def marched(d):
    d.suppose(r"$\phi$ and $g$ are Lipschitz continuous, so that the diffusion $(u, z)$ exists and is unique")
    d.suppose("release is certain and its time has a second moment, which is the case where $g$ keeps its sign")
    wave = exp(p * u + q * z)
    up, down = (wave.subs({u: u + phi * h**2 + s * kappa * h, z: z + eps * g * h**2}, simultaneous=True)
                for s in (1, -1))
    symbol = d.eq("generator", r"e^{-p u - q z} \mathcal{L} e^{p u + q z} =",
                  phi * p + kappa**2 / 2 * p**2 + eps * g * q,
                  r"it is the rate at which the mean changes in a time $h^2$ with steps $\pm \kappa h$; $p$ "
                  r"stands for $\partial_u$ and $q$ for $\partial_z$",
                  by=(sympy.diff((up + down) / 2, h, 2).subs(h, 0) / 2 / wave).expand())
    mean = d.eq("mean", r"\mathcal{L} T =", -1, "$T$ exceeds its own mean after a time $h$ by $h$",
                by=Derivative(T(*at) - h, h))
    second = d.eq("second moment", r"\mathcal{L} M =", -2 * T(*at), "$M$ is the mean square of the time; for a "
                  "time that is longer by $s$, the mean square has the derivative $2 T$ at $s = 0$",
                  by=-sympy.diff((T(*at) + past)**2, past).subs(past, 0))
    (T_z,) = sympy.solve(operator(symbol, T(*at)) - mean, T(*at).diff(z))
    d.eq("variance", r"\mathcal{L} v =", -kappa**2 * T(*at).diff(u)**2, "the variance is $v = M - T^2$",
         by=(second - operator(symbol, T(*at)**2)).subs(T(*at).diff(z), T_z).expand())
    d.conclude("mean", "variance", note=r"$\mathcal{L} = \phi \, \partial_u + (\kappa^2/2) \, \partial_u^2 + "
               r"\varepsilon g \, \partial_z$; $T$ and the variance $v$ of the time from $(u, z)$ are 0 at $u = "
               r"\pm r$; " + SLOW)


@derives("release-order", "The first correction to T by the motion of the slow variable")
def first_order(d):
    d.suppose(r"$T$ has two derivatives in $\varepsilon$ at 0, which requires that $\varepsilon T$ is small "
              "compared with the distance to the fold")
    frozen, T_f, T_1 = Function("phi")(*at), Function("T_f")(*at), Function("T_1")(*at)
    symbol = d["release-time", "generator"]
    whole = operator(symbol.subs(phi, frozen + eps * u * slope_y), T_f + eps * T_1)
    d.eq("source", "s(u) =", g * T_f.diff(z) + u * slope_y * T_f.diff(u), r"$\mathcal{L}_0 T_1 = -s$, where "
         r"$\mathcal{L}_0$ is $\mathcal{L}$ for $\varepsilon = 0$",
         by=whole.expand().diff(eps).subs(eps, 0) - operator(symbol.subs({eps: 0, phi: frozen}), T_1))
    Sigma, s, T1 = Function("Sigma"), Function("s"), Function("T_1")
    left = Integral(Sigma(v) / Sigma(v).diff(v) * s(v), (v, -r, x))
    right = Integral((Sigma(r) - Sigma(v)) / Sigma(v).diff(v) * s(v), (v, x, r))

    def rows(stated):
        """L_0 T_1 + s, phi = -(kappa^2/2) Sigma''/Sigma', and both ends, on exponentials."""
        scale, force = exp(x) - exp(-r), a * exp(2 * x) + b * exp(3 * x)
        known = stated.replace(s, lambda y: force.subs(x, y)).replace(Sigma, lambda y: scale.subs(x, y))
        known = known.doit().expand()
        return [(known.diff(x, 2) / lam - scale.diff(x, 2) / scale.diff(x) / lam * known.diff(x), -force),
                (known.subs(x, r), 0), (known.subs(x, -r), 0)]

    d.eq("Green's function", T1(x), lam * ((Sigma(r) - Sigma(x)) * left + Sigma(x) * right) / Sigma(r),
         "each integrand times its prefactor is $s(v)$ times the mean time spent at $v$ per length", rows)
    d.conclude("source", "Green's function", note=r"$\Sigma' = e^{\lambda V}$, $\Sigma(-r) = 0$; $T_f$ is $T$ for "
               r"$z$ frozen; $\phi_y$ is the slope of $\phi$ in $y = \varepsilon u$; " + SLOW,
               error=r"$O(\varepsilon^2)$ in $T = T_f + \varepsilon T_1$")


@derives("release-adiabatic", "The adiabatic law of release")
def adiabatic(d):
    d.suppose(r"$1/|A'(u_1)| \ll T$ and $|dT/dt| \ll 1$, where $T$ is computed with $z$ frozen at its value at "
              "the time $t$")
    lost = d.eq("what is lost in a short time", Limit((H(t) * (1 - x * k(t)) - H(t)) / x, x, 0), -k(t) * H(t),
                r"of the blocks held at $t$ the share $k(t) \, dt$ is released in $dt$, which gives $H'$")
    d.eq("held", H(t), exp(-Integral(k(x), (x, 0, t))), "$H' = -k H$, and $H = 1$ at the start", lambda held: [
        (held.diff(t), lost.subs(H(t), held)), (held.subs(t, 0).doit(), 1)])
    d.conclude(note="$H$ is the probability that the block is still held at the time $t$, and $k(t) = 1/T$ with "
                    "$z$ frozen at its value at this time",
               error="not estimated, but small where the conditions hold")


@derives("frozen-time", "When T, with z frozen, is the time of release")
def frozen(d):
    d.suppose(r"$\kappa^2 \ll D$, so escape is rare and the adiabatic law holds")
    d.suppose("$z$ is far from the fold, so that $T(z)$ has two derivatives")
    d.suppose(r"$T_f$ is much longer than $r/a^+$, the time from the barrier to the end, which is left out")
    T_f, slope = symbols("T_f T_f'", positive=True)
    rate = d.eq("rate on the way", r"k(t) \sim", 1 / T_f - eps * g * t * slope / T_f**2,
                r"along the path $z = z_0 + \varepsilon g t$",
                by=sympy.series(1 / (T_f + eps * g * t * slope), eps, 0, 2).removeO())
    held = d["release-adiabatic"].replace(k, lambda s: rate.subs(t, s)).doit().series(eps, 0, 2).removeO()
    moment = lambda weight: Integral(sympy.expand(weight * held), (t, 0, oo)).doit()
    mean = d.eq("mean", r"T \sim", T_f + eps * g * T_f * slope, "it is the integral of $H$", by=moment(1))
    d.eq("standard deviation", r"\sigma_T \sim", T_f + 2 * eps * g * T_f * slope,
         "it follows from the integral of $2 t H$; if $z$ is at rest it is $T_f$, because the waiting time is "
         "exponentially distributed",
         by=sympy.sqrt(moment(2 * t) - mean**2).series(eps, 0, 2).removeO())
    grown = d.eq("by the barrier", Derivative(log(exp(lam * D(z))), z), lam * D(z).diff(z),
                 r"this is $T_f'/T_f$ if $T$ grows as $e^{\lambda D}$")
    d.eq("share", r"\frac{T - T_f}{T_f} \sim", eps * g * lam * D(z).diff(z) * T_f,
         "this is the relative change caused by the motion of $z$",
         by=(mean / T_f - 1).subs(slope, grown * T_f))
    d.conclude("mean", "standard deviation", "share", note="$T_f$ is $T$ with $z$ frozen at the start, $T_f'$ its "
               r"slope in $z$, $\sigma_T$ the standard deviation of the time, $D$ the height of the barrier; "
               + SLOW, error=r"a share of the coefficient of $\varepsilon$ that vanishes as "
               r"$\kappa \to 0$ (for the coefficient see 'release-order'), and $O(\varepsilon^2)$",
               known=r"for friction with $\mu = 3$, $\alpha = 1$, $z_0 = -2/5$, $r = 10$ the coefficient of "
                     r"$\varepsilon$ in the mean is 50 % off at $\kappa = 0.3$ and 2 % at 0.2, that of the "
                     "share with $D'$ 9 %")


@derives("fold-delay", "The delay after the fold of a block without noise")
def fold_delay(d):
    d.suppose("$w$ is small, that is, $u$ is close to the fold, where well and barrier coalesce")
    d.suppose(r"the units of $u$ and $z$ are such that $\frac{1}{2} \partial^2\phi/\partial u^2$ and "
              r"$g \, \partial\phi/\partial z$ are 1 at the fold")
    w1, s = Function("w_1"), Symbol("s", real=True)
    time = d.eq("time", "t =", s * eps**-Rational(1, 3), "with $t = b s$ and $w = w_1/b$ the equation becomes "
                r"$w_1' = w_1^2 + s$, in which both terms of $w^2 + \varepsilon t$ "
                "have the same size", lambda t: [((t / s)**-2, eps * t / s)])
    d.eq("distance", "w =", w1(s) * eps**Rational(1, 3), "the rate of $w$ has the size of $w^2$",
         lambda w: [(w / w1(s) / (time / s), (w / w1(s))**2)])
    d.eq("Airy's equation", w1(s), sympy.airyaiprime(-s) / sympy.airyai(-s),
         "the block leaves at the first zero of Ai, $s = 2.338$", lambda w: [(w.diff(s), w**2 + s)])
    d.conclude("distance", "time", "Airy's equation",
               note="$w$ is the distance of $u$ from its value at the fold, and $t$ is the time since the fold, "
                    "in the units of the conditions; the block leaves at $s = 2.338$",
               error=r"leading order in $\varepsilon$ without noise, and exact for $\dot w = w^2 + \varepsilon t$")
