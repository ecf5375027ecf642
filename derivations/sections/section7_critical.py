"""Section 7: critical points, folds, the threshold of the noise."""

import sympy
from sympy import Rational, Symbol, asin, cos, exp, log, sin, sqrt, symbols

from derivations.paper import a_plus, alpha, eps, kappa, kappa_physical, mu, u, u1, u2, z0
from derivations.sections.section7_friction import BETA, PEAK, A
from symasym.derivation.derivation import derives

h, p, q, c = symbols("h p q c", positive=True)
D, ell = Symbol("D", positive=True), Symbol("ell", positive=True)
u3, fold = Symbol("u3", real=True), Symbol("u_s", positive=True)
omega = Symbol("omega", positive=True)
size = eps * exp(2 * D * eps / kappa_physical**2)
C1, S1 = cos(omega), sin(omega)


def of_angle(e):
    """A polynomial in the cosine and sine of omega, with sin^2 = 1 - cos^2 put in."""
    return sympy.expand(sympy.expand(e).replace(
        lambda x: x.is_Pow and x.base == S1, lambda x: S1 ** (x.exp % 2) * (1 - C1**2) ** (x.exp // 2)))


@derives("cubic", "The equation of the critical points")
def cubic(d):
    found = d.eq("zero of the drift inside", "0 = A(u) =", 1 - z0 - alpha * (1 + mu) * u + alpha * mu * u**3,
                 by=d["eq:phifric0", "powers of u"])
    d.eq("discriminant", r"\operatorname{disc}_u A =", 4 * alpha**4 * mu * (1 + mu)**3
         - 27 * alpha**2 * mu**2 * (1 - z0)**2, "it is positive between the folds, where there are three real "
         "roots; in the crossing region the third is outside $|u| < 1$", by=sympy.discriminant(found, u))
    d.conclude("zero of the drift inside", note="its solutions $u$ are the critical points")


@derives("folds", "Where two critical points coalesce")
def folds(d):
    d.suppose(r"$\mu > 1/2$; otherwise the folds are at $|u| \ge 1$, outside the layer")
    cubic, disc, top, beta = d["cubic"], d["cubic", "discriminant"], d["turning-points"], d["beta"]
    at = d.eq("position", fold, PEAK, "the double root is the turning point of the force", lambda s: [
        (cubic.diff(u).subs(u, s), 0), (top, s)])
    for name, power, side in (("right fold", "+", -1), ("left fold", "-", 1)):
        d.eq(name, Symbol(f"z_0^{{({power})}}"), 1 + side * BETA, r"the folds are $1 \mp \beta$; for $\mu = 3$ "
             r"and $\alpha = 1$ this fold is $-7/9$, "
             "printed as $-0.78$" if side < 0 else "", lambda end, side=side: [
                 (cubic.subs({u: -side * at, z0: end}), 0), (end - 1, side * beta),
                 (disc, 27 * alpha**2 * mu**2 * ((end - 1)**2 - (1 - z0)**2))])
    d.conclude("right fold", "left fold", note="these are the spring extensions at which a well and a barrier "
                                               "coalesce, one on $u > 0$ and one on $u < 0$")


@derives("fr1", "$a^+$ and $A'$ of the friction drift")
def parameters(d):
    d.eq("a+", a_plus, 1 - z0 - alpha, r"the paper prints $+ \alpha$, which "
                                       "gives $a^-$", by=d["eq:phifric0", "right"])
    d.eq("A'", A(u).diff(u), -alpha * (1 + mu - 3 * mu * u**2), by=d["eq:phifric0", "inside"].diff(u))
    d.conclude("a+", "A'")


@derives("fr2", "Order and stability of the two critical points")
def critical_points(d):
    lead, _, linear, _ = sympy.Poly(d["cubic"], u).all_coeffs()
    product = lead * (u - u1) * (u - u2) * (u - u3)
    lowest = d.eq("sum of the roots", u3, -u1 - u2, "the cubic has no term in $u^2$; for $u_1, u_2 > 0$ this is "
                  "the lowest root",
                  lambda x: [(product.subs(u3, x).expand().coeff(u, 2), 0)])
    slope, by_roots = sympy.expand(d["fr1", "A'"]), product.subs(u3, lowest).expand().coeff(u, 1)
    pair = []
    for name, x, other in (("well", u1, u2), ("barrier", u2, u1)):
        pair.append(d.eq(f"slope at the {name}", Symbol(f"A'(u_{1 if x == u1 else 2})"),
                         alpha * mu * (x - other) * (x - u3), "from "
                         r"$A = \alpha\mu (u - u_1)(u - u_2)(u - u_3)$; the same follows from fr1 if the "
                         "coefficient of $u$ is written in terms of the roots", lambda e, x=x: [
                             (product.diff(u).subs(u, x), e), (slope.subs(u, 0), linear),
                             (slope.subs(u, x) - slope.subs(u, 0) + by_roots, e.subs(u3, lowest))]))
    put = {u1: u3 + p, u2: u3 + p + h}
    d.bound("well", pair[0], "<", 0, "because $u_3 < u_1 < u_2$; the inequality is "
                                     "strict except at folds", alpha * mu * h * p, on=put)
    d.bound("barrier", pair[1], ">", 0, "because $u_3 < u_1 < u_2$", alpha * mu * h * (p + h), on=put)
    d.bound("no root in u < 0 when crossing", d["cubic"].subs(u, -c), ">", 0, "for $0 < c < 1$ and "
            r"$z_0 < 1 - \alpha$; therefore $0 < u_1 < u_2$, and the start is to the left of the well",
            alpha + p + alpha / (1 + q) + alpha * mu * q * (q + 2) / (1 + q)**3,
            on={c: 1 / (1 + q), z0: 1 - alpha - p})
    d.conclude("slope at the well", "slope at the barrier", note="$u_3 = -(u_1 + u_2)$ is the third root")


@derives("friction-well", "Well and barrier of the friction drift in closed form")
def closed_form(d):
    d.suppose(r"$z_0 < 1$, and there are a well and a barrier in the layer, that is, $\mu > 1/2$ and "
              r"$\alpha < 1 - z_0 < \beta$")
    thirds, root, beta, u_s = Rational(3, 2), sqrt(3), d["beta"], d["turning-points"]
    cubic, V, zero = d["cubic"], d["eq:Vfric", "inside"], d["fr2", "no root in u < 0 when crossing"]
    d.eq("angle", omega, Rational(2, 3) * asin(sqrt((1 - (1 - z0) / BETA) / 2)),
         r"from $\beta \cos 3\omega = 1 - z_0$; the form with the sine keeps its digits near the fold", lambda w: [
             (1 - 2 * sin(thirds * w)**2, (1 - z0) / beta),
             (sin(thirds * w), sqrt((1 - (1 - z0) / beta) / 2))])
    on = {z0: 1 - beta * (4 * C1**3 - 3 * C1)}
    at_root = lambda x: of_angle(cubic.subs(u, x).subs(on))
    well = d.eq("well", u1, PEAK * (C1 - root * S1), r"from $\cos 3\omega = 4 c^3 - 3 c$ with $c = \cos\omega$, "
                r"where $0 < \omega < \pi/6$ for $0 < 1 - z_0 < \beta$", lambda x: [
                    (at_root(x), zero), (x.subs(omega, 0), u_s),
                    (x.diff(omega).subs(omega, 0), -root * u_s)])
    top = d.eq("barrier", u2, PEAK * (C1 + root * S1), "", lambda x: [
        (at_root(x), 0), (x - well, 2 * root * u_s * S1)])
    put = {u1: well, u2: top}
    for name, sign in (("well", -1), ("barrier", 1)):
        d.eq(f"slope at the {name}", Symbol(f"A'(u_{1 if sign < 0 else 2})"),
             2 * sign * alpha * (1 + mu) * S1 * (root * C1 + sign * S1), "it is 0 at the fold, where "
             r"$\omega = 0$",
             lambda e, flat=d["fr2", name]: [(e.subs(omega, 0), flat)],
             by=d["fr2", f"slope at the {name}"].subs(u3, d["fr2", "sum of the roots"]).subs(
                 put, simultaneous=True))
    height = lambda x: V.subs(u, x)
    d.eq("height of the barrier", D, 4 * root / 3 * alpha * (1 + mu)**2 / mu * S1**3 * C1,
         "$V(u_2) - V(u_1)$ is written as one product, because the difference would lose digits near the fold",
         lambda e: [(of_angle((height(top) - height(well)).subs(on) - e), 0)])
    d.conclude("angle", "slope at the well", "slope at the barrier", "height of the barrier",
               note=r"$\omega$ is a third of $\arccos((1 - z_0)/\beta)$, $u_1$ is the well, and $u_2$ is the "
                    "barrier")


@derives("threshold", "The noise below which the escape time is exponentially large")
def threshold(d):
    d.suppose(r"$0 < \varepsilon < 1$, and the conditions of eq:Ttildesmall, with a well and a barrier")
    (well,) = d["eq:Ttildesmall"].atoms(exp)
    scaled = well.subs(kappa, d["eq:tildexykappa", "kappa"])
    whole = d.eq("exponential factor of the well's term", r"T_p \sim", size, "the prefactor is left out, and "
                 "the noise is unscaled",
                 by=d["eq:TtildetoT"].subs(Symbol("T", positive=True), scaled))
    d.eq("threshold", Symbol("kappa_c"), sqrt(2 * D * eps / ell), "at the threshold this $T_p$ is 1, where "
         r"$\varepsilon = e^{-\ell}$, so the scaled $T$ is of order $1/\varepsilon$; $T_p$ falls as $\kappa_p$ "
         "grows, so large times need noise below the threshold; the paper's rule is the case $2 D = 1$, which "
         r"gives 0.0466 for $\varepsilon = 0.01$, rounded to 0.05", lambda k: [
             (sympy.expand_log(log(whole)).subs({log(eps): -ell, kappa_physical: k}), 0), (sqrt(k**2), k)])
    d.conclude("threshold", note="$D = V(u_2) - V(u_1)$ is the height of the barrier, "
                                 r"$\ell = -\log\varepsilon$, and the threshold is unscaled",
               error="only the leading exponential is kept; prefactors are left out")
