r"""The law of the exit time, beyond the paper: its transform, its moments, and its principal eigenvalue.

The backward equation is carried from both ends to the start, as a power series in the Laplace parameter s: D. A.
Darling, A. J. F. Siegert, Ann. Math. Stat. 24 (1953) 624; J. T. Kent, Z. Wahrsch. verw. Geb. 52 (1980) 309. The
bounds are those of Euler and Rayleigh for zeros of Bessel functions: G. N. Watson, Bessel Functions, 15.5.
"""

import sympy
from sympy import Derivative, Function, Symbol, exp, log, symbols

from derivations.paper import T, V, lam, phi, u
from derivations.sections.section5.positive import sigma_left, sigma_right, w
from derivations.sections.section5.stationary import g, half
from symasym.derivation.derivation import derives

y = Function("y")
h, s, eta, zeta, x, rest = symbols(r"h s \eta \zeta \lambda_1 a", positive=True)
n = Symbol("n", integer=True, positive=True)
E_l, E_r, F_l, F_r, Z_l, Z_r, W = symbols(r"\eta^- \eta^+ \zeta^- \zeta^+ Z^- Z^+ W", positive=True)
(E0_l, E1_l), (E0_r, E1_r), (F1_l, F2_l), (F1_r, F2_r) = (
    symbols(rf"{name}_{k}^{side} {name}_{k + 1}^{side}", positive=True)
    for name, k in ((r"\eta", 0), (r"\zeta", 1)) for side in "-+")
SERIES = {E_l: E0_l + s * E1_l, E_r: E0_r + s * E1_r,
          F_l: Z_l + s * F1_l + s**2 * F2_l, F_r: Z_r + s * F1_r + s**2 * F2_r}
LEAVES = r"\mathbb{E}[e^{-s \tau}; u_\tau = %sr] ="
CARRIED = (r"$\tau$ is the time of leaving $(-r, r)$ from $u$, scaled. With $e = e^{\lambda V}$ the equation is "
           r"$y' = e F$, $F' = s \lambda y/e$; $\eta^\mp = y/e$, $\zeta^\mp = \pm F$ are of the $y$ that begins "
           r"at $\mp r$, with $(\eta, \zeta) = (0, 1)$ if that end absorbs, $(1, 0)$ if it reflects; $Z^\mp$ is "
           r"$\zeta^\mp$ there")


def rates(of_eta, of_zeta):
    """d/du of eta and zeta on both sides; the right is the left's mirror image."""
    at = lambda f, a, b, side: side * f.subs({eta: a, zeta: b, phi(u): side * phi(u)}, simultaneous=True)
    return {c: at(f, a, b, side) for a, b, side in ((E_l, F_l, 1), (E_r, F_r, -1))
            for c, f in ((a, of_eta), (b, of_zeta))}


def along(f, rate):
    """d/du of what depends on u by itself and by what changes at these rates."""
    return f.diff(u) + sum(f.diff(a) * by for a, by in rate.items())


def generator(f, rate):
    return half * along(along(f, rate), rate) + phi(u) * along(f, rate)


@derives("exit-transform", "The Laplace transform of the exit time, by the end where it leaves")
def transform(d):
    e, slope = exp(lam * V(u)), y(u).diff(u)
    moved = d.eq("backward equation", r"\mathcal{L} y =", s * y(u), r"$y$ is the mean of $e^{-s \tau}$, and its "
                 "own mean after a time $h$ is $e^{s h} y$", by=Derivative(exp(s * h) * y(u), h).doit().subs(h, 0))
    (bend,) = sympy.solve(d["eq:FPE", "generator"].replace(g, y) - moved, Derivative(y(u), (u, 2)))
    carried = lambda f: f.diff(u).subs(slope.diff(u), bend).subs(V(u).diff(u), -phi(u)).subs(
        slope, e * zeta).subs(y(u), e * eta)
    first = d.eq("eta", r"\eta' =", zeta + lam * phi(u) * eta, r"here $\eta = y/e$ and $\zeta = y'/e$, with "
                 "mirror images on the right", by=carried(y(u) / e))
    rate = rates(first, d.eq("zeta", r"\zeta' =", s * lam * eta, by=carried(slope / e)))
    whole = d.eq("Wronskian", W, E_l * F_r + E_r * F_l, "$e W$ does not depend on $u$", lambda f: [
        (along(f, rate), lam * phi(u) * f), (f.subs({E_l: 0, F_l: Z_l}), Z_l * E_r),
        (f.subs({E_r: 0, F_r: Z_r}), E_l * Z_r)])
    chance = lambda f, at: f.subs(W, whole).subs({(E_l, E_r)[at]: 0, (F_l, F_r)[at]: 1, (Z_l, Z_r)[at]: 1})
    ends = [d.eq(f"leaving on the {name}", LEAVES % ("-" * (1 - at)), top / W,
                 "if both ends absorb, it is 1 at this end and 0 at the other; through a reflecting end no path "
                 "leaves",
                 lambda f, at=at: [(generator(f, rate | {W: lam * phi(u) * W}), s * f), (chance(f, at), 1),
                                   (chance(f, 1 - at), 0), (f.subs((Z_l, Z_r)[at], 0), 0)])
            for at, name, top in ((0, "left", E_r * Z_l), (1, "right", E_l * Z_r))]
    d.eq("in positive terms", r"1 - \mathbb{E}[e^{-s \tau}] =", (E_l * (F_r - Z_r) + E_r * (F_l - Z_l)) / W,
         r"because $\zeta - Z$ has no negative coefficient", by=(1 - sum(ends)).subs(W, whole) * whole / W)
    d.conclude("leaving on the left", "leaving on the right", "in positive terms", "Wronskian", note=CARRIED)


@derives("exit-moments", "Mean and second moment of the exit time")
def moments(d):
    of_scene = rates(d["exit-transform", "eta"], d["exit-transform", "zeta"])
    rate = {c: sympy.expand(of.subs(SERIES)).coeff(s, k) for a, of in of_scene.items()
            for (k,), c in sympy.Poly(SERIES[a], s).terms() if c not in (Z_l, Z_r)}
    whole = sympy.expand(d["exit-transform", "Wronskian"].subs(SERIES))
    gone = sympy.expand((d["exit-transform", "in positive terms"] * W).subs(SERIES))
    w_0, w_1 = symbols("w_0 w_1", positive=True)
    parts = {w_0: E0_l * Z_r + E0_r * Z_l, w_1: E0_l * F1_r + E1_l * Z_r + E0_r * F1_l + E1_r * Z_l}
    put = {a: d.eq(f"coefficient {k} of W", a, right, by=whole.coeff(s, k))
           for k, (a, right) in enumerate(parts.items())}
    rate |= {a: lam * phi(u) * a for a in parts}  # as e W is the same everywhere
    poly = lambda f: sympy.expand(f * w_0**3).subs(put)
    left = lambda k, f: poly(sympy.expand(gone - (w_0 + w_1 * s) * f).coeff(s, k))
    alone = {E0_l: sigma_left, E0_r: sigma_right, Z_l: 1, Z_r: 1}
    mean = d.eq("mean", T, (E0_l * F1_r + E0_r * F1_l) / w_0, "from "
                r"$1 - \mathbb{E}[e^{-s \tau}] = s T - \dots$; if both ends absorb, the result agrees with "
                "'positive-form'", lambda f: [(left(1, s * f), 0), (
                    f.subs(put).subs(alone), d["positive-form", "from both sweeps"].subs(
                        w, F1_l / sigma_left + F1_r / sigma_right))])
    second = E0_l * F2_r + E1_l * F1_r + E0_r * F2_l + E1_r * F1_l
    source = d["release-time", "second moment"].replace(lambda e: e.func == Function("T"), lambda e: mean)
    d.eq("second moment", r"\mathbb{E}[\tau^2] =", (T * w_1 - second) / w_0 * 2,
         r"from the coefficient of $-s^2/2$; it solves $\mathcal{L} f = -2 T$ ('release-time')", lambda f: [
             (left(2, s * mean - s**2 / 2 * f.subs(T, mean)), 0),
             (poly(generator(f.subs(T, mean), rate)), poly(source))])
    d.conclude("mean", "second moment", "coefficient 0 of W", "coefficient 1 of W",
               note=r"$\eta_k$, $\zeta_k$ are coefficients of $s^k$: on the left $\eta_k' = \zeta_k + \lambda "
                    r"\phi \eta_k$, $\zeta_k' = \lambda \eta_{k - 1}$, on the right mirrored. " + CARRIED)


@derives("exit-eigenvalue", "Two-sided bounds of the principal eigenvalue of the exit problem")
def eigenvalue(d):
    d.suppose(r"$W$ is an entire function of $s$ of order 1/2 with the zeros $-\lambda_k$, "
              r"$0 < \lambda_1 < \lambda_2 < \dots$ (Sturm and Liouville), so $W(s)/W(0)$ is the product of all "
              r"$1 + s/\lambda_k$ (Hadamard)")
    whole = sympy.expand(d["exit-transform", "Wronskian"].subs(SERIES))
    x_k, beyond, T_n, T_m = symbols(r"\lambda_k m S_n S_{n+1}", positive=True)
    c, sums = symbols("c_1:4", real=True), symbols("S_1:4", positive=True)
    d.eq("first coefficient", c[0], (E0_l * F1_r + E1_l * Z_r + E0_r * F1_l + E1_r * Z_l)
         / (E0_l * Z_r + E0_r * Z_l), "of $W(s)/W(0)$; it does not depend on the start",
         by=whole.coeff(s, 1) / whole.coeff(s, 0))
    one = 1 / d.eq("one factor", -Derivative(log(1 - s / x_k), s), 1 / (x_k - s),
        "of $W(-s)/W(0)$; the contributions of all factors add up")
    term = d.eq("its power series", r"[s^{n - 1}] \frac{1}{\lambda_k - s} =", x_k**-n, given=lambda f: [
        (one.coeff(s, 0) * f.subs(n, 1), 1), (one.coeff(s, 0) * f.subs(n, n + 1) + one.coeff(s, 1) * f, 0)])
    product, found = 1 + sum(a * (-s)**k for k, a in enumerate(c, 1)), {}
    newton = product.diff(s) + product * sum(term * x_k**n * a * s**k for k, a in enumerate(sums))
    for k, stated in enumerate((c[0], c[0]**2 - 2 * c[1], c[0]**3 - 3 * c[0] * c[1] + 3 * c[2])):
        row = sympy.expand(newton.subs(found)).coeff(s, k)
        found[sums[k]] = d.eq(f"sum of powers {k + 1}", sums[k], stated,
                              r"of $1/\lambda_k$, by Newton's identities", [(row, 0)])
    apart = x_k**-n - x * x_k**(-n - 1)
    share = d.eq("one term", apart, (x_k - x) * x_k**(-n - 1), r"this is one term of $S_n - \lambda_1 S_{n+1}$")
    d.bound("from below", x, ">=", T_n**(-1 / n), r"$S_n$ exceeds $\lambda_1^{-n}$; it is written as "
            r"$\lambda_1^{-n} e^{n a}$",
            x * (1 - exp(-rest)), {T_n: x**-n * exp(n * rest)})
    d.bound("from above", x, "<=", T_n / T_m, r"no term of $S_n - \lambda_1 S_{n+1}$ is negative",
            share.subs(x_k, x + beyond) / T_m, {T_n: x * T_m + apart.subs(x_k, x + beyond)})
    d.conclude("from below", "from above", *(f"sum of powers {k}" for k in (1, 2, 3)), "first coefficient",
               note=r"$\lambda_1$, the principal eigenvalue, is the rate at which $\mathbb{P}[\tau > t]$ falls in "
                    r"the end; $S_n$ is the sum of all $\lambda_k^{-n}$ and $c_n$ the coefficient of $s^n$ in "
                    r"$W(s)/W(0)$, both in units of the $n$-th power of scaled time; $\eta_k$, $\zeta_k$, $Z$ "
                    "are those of 'exit-moments'")
