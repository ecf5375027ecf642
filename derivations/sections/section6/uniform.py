"""Section 6, weak noise: zeros of phi in canonical form, to any order, and a barrier before an end.

The theorem of `symasym.expansions.coalescence`: C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil.
Soc. 53 (1957) 599; N. Bleistein, Comm. Pure Appl. Math. 19 (1966) 353.
"""

import sympy
from sympy import Derivative, Function, Integral, Symbol, exp, log, oo, pi, sqrt, symbols

from derivations.paper import kappa, phi
from symasym.derivation.derivation import derives

s, v, L, sign = symbols(r"s v L \epsilon", real=True)
t, lam, psi_0, sigma = symbols(r"s lam \psi_0 \sigma", positive=True)
k = Symbol("k", integer=True, nonnegative=True)
psi, e, M, n, N, b, S = (Function(x)(s) for x in (r"\psi", "e", "M", "n", "n_{k+1}", "b", "S"))
P, c, P0, P1, c0, c1, u, V = (Function(x)(s) for x in ("P_k", "c_k", "P_0", "P_1", "c_0", "c_1", "u", "V"))
beta = Function("b")
Q, ends, slow = P0 + P1 / L, c0 / L + c1 / L**2, c0 / L - c1 / L**2
first = {b: P0 + psi * c0, c0.diff(s): P1 + psi * c1}
CANONICAL = (r"$\phi \, du = \epsilon \psi(s) \, ds$ with $\epsilon = \pm 1$, where $\psi = 1$, $s$ or "
             r"$s^2 - \zeta$ for no, one or two zeros; $b_0 = du/ds$, $b_k = P_k + \psi c_k$ and "
             r"$b_{k+1} = c_k'$; $L = \epsilon\lambda$, $e = e^{\lambda V}$ and $M = e \int e^{-\lambda V} du$; "
             r"$n$ solves $n' = P_0 - P_1/L - L \psi n$")


@derives("canonical-form", "Zeros of the drift that may coalesce: the integrals in canonical form, to any order")
def canonical_form(d):
    d.suppose("$s(u)$ is analytic, even where the zeros coalesce, and $P_k$ is a polynomial of lower degree "
              r"than $\psi$")
    along = exp(lam * V).diff(s).subs(V.diff(s), -phi(u) * u.diff(s)).subs(phi(u), sign * psi / u.diff(s))
    fall = d.eq("the exponential along s", e.diff(s), -L * psi * e, r"because $V' = -\phi$ in $u$",
                by=along.subs({sign: L / lam, V: log(e) / lam}))
    inner = d.eq("the inner integral along s", M.diff(s), b - L * psi * M, r"here $M = e \int e^{-\lambda V} du$",
                 by=(e * n).diff(s).subs(n.diff(s), b / e).subs(e.diff(s), fall).subs(n, M / e))
    power, term = (-L)**-k, (-L)**-k * c / L
    step = d.eq("inner integral, next order", N.diff(s), S + power * P - power * c.diff(s) / L - L * psi * N,
                r"this holds for $n_{k+1} = n_k - (-L)^{-k} c_k/L$, where $n_k' = S + (-L)^{-k} b_k - L \psi n_k$",
                by=inner.subs({b: S + power * b, M: n}).subs(b, P + psi * c).subs(n, N + term) - term.diff(s))
    outer = d.eq("outer integral, next order", Derivative(-e * c / L, s), e * (psi * c - c.diff(s) / L),
                 r"$\int e \, b_k \, ds$ is $\int e P_k \, ds - e c_k/L$ plus the same integral of $b_{k+1}/L$",
                 by=(-e * c / L).diff(s).subs(e.diff(s), fall))
    double = d.eq("double integral, next order", Derivative(-M * c / L, s), M * (psi * c - c.diff(s) / L)
                  - b * c / L, by=(-M * c / L).diff(s).subs(M.diff(s), inner))
    # To order 1; the parts left out are those of b_2 = c_1'.
    slope = step.subs({k: 1, S: P0}).subs({P: P1, c: c1, N: n}).doit()
    d.eq("inner integral", M, n + slow, r"one sweep of $n' = P_0 - P_1/L - L \psi n$ gives it", lambda m: [
        (m.diff(s).subs(n.diff(s), slope).subs(first).subs(M, m), inner.subs(M, m).subs(first))])
    parts = lambda of, known: sum(of.subs(c, y).doit().subs(first) / L**j for j, y in enumerate((c0, c1))) + known
    d.eq("outer integral", r"\int e \, du =", Integral((e * Q).subs(s, v), (v, 0, s)) - e * ends
         + (e * ends).subs(s, 0), "the integral runs from 0 to $s$", lambda x: [
             (x.subs(s, 0).doit(), 0), (x.diff(s).subs(e.diff(s), fall).subs(first), parts(outer, e * Q))])
    whole = n * Q + (b * c0 + P0 * c0) / L + (b * c1 + P1 * c0 - P0 * c1) / L**2 - P1 * c1 / L**3
    d.eq("double integral", r"\int M \, du =", Integral(whole.subs(s, v), (v, 0, s)) - M * ends,
         "the integral runs from 0, where $M$ "
         "begins, to $s$", lambda x: [(x.subs(s, 0).doit().subs(M.subs(s, 0), 0), 0), (
             x.diff(s).subs(M.diff(s), inner).subs(first).subs(M, n + slow),
             (parts(double, M * Q) + (b * ends).subs(first)).subs(M, n + slow))])
    mean, rise = (beta(sigma) + beta(-sigma)) / 2, (beta(sigma) - beta(-sigma)) / (2 * sigma)
    d.eq("remainder of two zeros", P0, mean + rise * s, "it has the values of $b_0$ at both zeros, "
         r"$s = \pm\sigma$ with $\zeta = \sigma^2$", lambda p: [
             (p.subs(s, sigma), beta(sigma)), (p.subs(s, -sigma), beta(-sigma)), (p.diff(s, 2), 0)])
    d.eq("regular part of order 0", c0 * (b + P0), (b**2 - P0**2) / psi, r"this is the part of $du/\phi$ in the "
         "double integral that is analytic at the zeros", by=(c0 * (b + P0)).subs(c0, (b - P0) / psi))
    d.conclude("inner integral", "outer integral", "double integral", note=CANONICAL, error="relative $O(L^{-2})$")


@derives("truncated-gaussian", "A barrier before an end, to leading order")
def truncated_gaussian(d):
    d.suppose(r"$\phi = x \, \psi(x) > 0$ from the barrier $x = 0$ to the end; on this interval "
              r"$V(0) - V = s^2/2$, so that $\phi \, du = s \, ds$ and $L = \lambda$ in 'canonical-form'")
    p, q, x = Symbol("p", positive=True), Symbol("q", real=True), Symbol("x", positive=True)
    tau, F, rho = Symbol(r"\tau", positive=True), Function("F_D"), Function(r"\rho")
    peak = d.eq("du/ds at the barrier", p, 1 / sqrt(psi_0), r"near the barrier $u = p s$ and $\phi = \psi(0) u$",
                lambda p: [(psi_0 * p * t * p, t), (sqrt(p**2), p)])
    unit, rate = exp(lam * t**2 / 2), p + t * rho(t)
    tail = d.eq("the tail beyond the end", unit * Integral(exp(-lam * tau**2 / 2), (tau, t, oo)),
                sqrt(pi / (2 * lam)) * unit * sympy.erfc(sqrt(lam / 2) * t), "see DLMF 7.2.2",
                lambda f: [(f.diff(t), lam * t * f - 1), ((f / unit).limit(t, oo), 0)])
    dawson = d.eq("Dawson's integral", F(t), sqrt(pi / (2 * lam)) / unit * sympy.erfi(sqrt(lam / 2) * t),
                  "see DLMF 7.2.5", lambda f: [(f.diff(t), 1 - lam * t * f), (f.subs(t, 0), 0)])
    put = {psi: t, c: rho(t), b: rate, e: 1 / unit, L: lam}
    here = lambda step: d["canonical-form", step].subs(c.diff(s), rho(t).diff(t)).subs(P0, p).subs(put)
    beyond = d.eq("scale integral", "I_+ =", -p * tail - q / lam, r"this is $-\int_s^\infty$, with "
                  r"$u' = p + s \rho(s)$ and $q = \rho$ at the end; the remaining "
                  r"integrand is $\rho'/\lambda$", lambda f: [
                      ((f.subs(q, rho(t)) / unit).diff(t), p / unit + here("outer integral, next order"))])
    d.eq("speed integral", "I_- =", p * dawson + q / lam, "this is $M$ of 'canonical-form', integrated from the "
         "barrier on", lambda f: [
        (f.subs(q, rho(t)).diff(t),
         here("the inner integral along s").subs(M, f.subs(q, rho(t))) + rho(t).diff(t) / lam)])
    regular, moves = here("regular part of order 0") + p**2 / t, {q: rho(t), F(t).diff(t): 1 - lam * t * F(t)}
    d.eq("double integral", "I_{+-} =", p**2 * (Integral(F(x), (x, 0, t)) - log(t) / lam) - p * q * F(t) / lam,
         r"over $u < v$; the regular part, $\lambda^{-1} \int du/\phi$, is left out", lambda f: [
             (f.subs(q, rho(t)).diff(t).subs(moves),
              rate * (p * F(t) + rho(t) / lam) - regular / lam - p * F(t) * rho(t).diff(t) / lam),
             (f.subs({t: 1, q: 0}), p**2 * Integral(F(x), (x, 0, 1)))])
    bend, D = Symbol("V''(u_1)", positive=True), Symbol("D", positive=True)
    well = d["gaussian-step", "one Gaussian"].subs(Symbol("s_1", positive=True), bend)
    change = (beyond + (q + p / t) / lam).subs(p, peak) / unit
    d.eq("the end's part of T", r"E_1 \sim", -pi / sqrt(bend * psi_0) * exp(2 * D / kappa**2) * (
        sympy.erfc(t / kappa) - kappa * exp(-t**2 / kappa**2) / (sqrt(pi) * t)),
         r"it is the time in a well times $I_+ + 1/(\lambda\phi)$, since $\int du/\phi$ already contains the pole",
         by=(lam * exp(lam * D) * well * change).subs(lam, 2 / kappa**2))
    d.conclude("scale integral", "speed integral", "double integral", "the end's part of T",
               note=r"the formulas give the contributions of the end to the integral of $e^{\lambda V}$, to that "
                    r"of $e^{-\lambda V}$ and to the double integral over $u < v$, in units of "
                    r"$e^{\pm\lambda V}$ at the end; $p = du/ds$ at the barrier, and $q = 1/\phi - p/s$ at the "
                    "end; $F_D$ is Dawson's integral",
               error=r"relative $O(1/\lambda)$")
