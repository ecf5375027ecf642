"""Section 4: reduction to one dimension, scaling, and the table of regions."""

import sympy
from sympy import Derivative, Function, Limit, Matrix, Symbol, exp, sign, sqrt, symbols

from derivations.paper import eps, kappa, phi, r_physical, t, u
from derivations.paper import kappa_physical as k_p
from derivations.paper import t_physical as t_p
from derivations.sections.section2_systems import F, f_minus, f_plus, inside, y, z
from symasym.derivation.derivation import derives

A, f = Function("A"), Function("f")
b = symbols("b1:4", real=True)
dt, dW, *dW_j = symbols("dt dW dW1:4", real=True)
PIECES = r"u \le -1", r"-1 \le u \le 1", r"u \ge 1"
NOISES = "the $W_j$ are independent Brownian motions"


@derives("eq:scaledSDE", "The coefficients frozen at the origin, and the remainder")
def frozen(d):
    rho, h = symbols("rho h", positive=True)
    c, s, f_0, f_x, f_y, f_xx = symbols("c s f(0) f_x f_y f_xx", real=True)
    near = lambda x, y: f_0 + f_x * x + f_y * y + f_xx * x**2
    d.suppose("$f^-$, $f^+$, $F$ and $D$ are smooth near the origin, and their slopes there are at most $M$")
    at_a, at_b = symbols("a b", real=True)
    slope = d.eq("slope along a ray", Derivative(f(c * h, s * h), h),
                 c * sympy.Subs(Derivative(f(at_a, s * h), at_a), at_a, c * h)
                 + s * sympy.Subs(Derivative(f(c * h, at_b), at_b), at_b, s * h), "by the chain rule")
    value = near(c * rho, s * rho)
    d.eq("frozen at the origin", "f(x)", f_0, r"at $x = \rho\, (c, s)$ the remainder is at most $M \rho$ by the "
         r"mean value theorem, and it is of order $\rho$ unless the slope is 0",
         lambda origin: [(Limit(value, rho, 0), origin),
                         (Limit((value - origin) / rho, rho, 0), slope.replace(f, near).doit().subs(h, 0))])
    d.conclude(error=rho, note=r"$f$ is any of the coefficients $f^-, f^+, F, D$ of eq:genSDE, and $\rho = |x|$ "
                               "is the distance from the origin, at most $O(r_p)$")


@derives("eq:scaledSDEx", "The component across the surface")
def component(d):
    field = Matrix([Function("F_1")(u), A(u), Function("F_3")(u)])
    D = Matrix(3, 3, symbols("d_1:4(1:4)", real=True))
    d.eq("project", "dy", field[1] * dt + k_p * (D[1, 0] * dW_j[0] + D[1, 1] * dW_j[1] + D[1, 2] * dW_j[2]),
         "the second of three coordinates, with the unit vector $e_2$, points across the surface",
         by=(Matrix([[0, 1, 0]]) * (field * dt + k_p * D * Matrix(dW_j)))[0])
    d.conclude(error=r_physical, note=r"$u = y/\varepsilon$; the second component of the drift, $A(u)$ inside "
               "the layer, and the entries $d_{ij}$ of $D$ are taken at the origin (eq:scaledSDE); " + NOISES)


@derives("noise-amplitude", "Independent noises through $B$ add up to one noise of amplitude $|B|$")
def amplitude(d):
    theta = Symbol("theta", real=True)
    square = b[0]**2 + b[1]**2 + b[2]**2
    of_sum = d.eq("characteristic function", r"\langle e^{i \theta (b_1 W_1 + b_2 W_2 + b_3 W_3)} \rangle",
                  exp(-theta**2 * t_p * square / 2), "the noises are independent, so it is the product of three "
                  "Gaussian characteristic functions",
                  by=sympy.prod(exp(-(theta * x)**2 * t_p / 2) for x in b))
    d.eq("standard deviation per root of time", Symbol("sigma"), sqrt(square),
         r"the variance is minus the second derivative at $\theta = 0$",
         by=sqrt(sympy.expand(-of_sum.diff(theta, 2).subs(theta, 0) / t_p)))
    d.conclude(note="the $b_j$ are the strengths of the noises; " + NOISES)


@derives("eq:phi", "The scaled drift")
def scaled_drift(d):
    d.suppose("$F$ is continuous at both edges (eq:cont)")
    of_u = lambda e: e.replace(F, lambda x, *_: A(x))
    (left, right) = (edge.subs({eps: 0, z: 0}) for edge in d["eq:cont"])
    solve = sympy.solve
    d.eq("left", phi(u), A(-1), "this is the field at the origin, equal to that at the layer's edge",
         by=of_u(solve(left - F(-1, 0, 0), f_minus(0, 0))[0]))
    d.eq("inside", phi(u), A(u), r"$y = \varepsilon u$, and all other coordinates "
                                 "are at the origin", by=of_u(inside.subs(y, eps * u)))
    d.eq("right", phi(u), A(1), "this follows as on the left", by=of_u(solve(right - F(1, 0, 0), f_plus(0, 0))[0]))
    d.conclude("left", "inside", "right", cases=PIECES,
               note="$A(u) = F(u, 0, 0)$; the drifts outside are $a^- = A(-1)$ and $a^+ = A(1)$")


def moments(e):
    """The rates of the means of y and of y^2 at y = 0 for dy = e: the drift and the variance."""
    return e.coeff(dt), sum(e.coeff(x)**2 for x in (dW, *dW_j))


@derives("eq:reducedSDE", "Reduction to one dimension and one noise")
def reduced(d):
    three = sympy.expand(d["eq:scaledSDEx"].replace(A, phi).subs(
        dict(zip(symbols("d_21:24", real=True), b, strict=True))))
    drift, variance = moments(three)
    mean = lambda found, g: found.replace(f, lambda _: g).doit()
    sigma = k_p * d["noise-amplitude"]
    generator = d.eq("Itô's generator", r"\mathcal{L} f", phi(u) * Derivative(f(y), y)
                     + sigma**2 / 2 * Derivative(f(y), (y, 2)),
                     r"for smooth $f$; the mean of $y$ changes at the rate $\phi$, and that of $y^2$ at the rate "
                     r"$2 y \phi$ plus the variances of three independent noises",
                     lambda L: [(mean(L, y), drift), (mean(L, y**2), 2 * y * drift + variance)])
    first, second = mean(generator, y), mean(generator, y**2) - 2 * y * mean(generator, y)
    d.eq("one noise", "dy", phi(u) * dt + k_p * sqrt(b[0]**2 + b[1]**2 + b[2]**2) * dW,
         "it has the same generator",
         lambda e: [*zip(moments(e), (first, second), strict=True), (e.coeff(dW), sqrt(moments(e)[1]))])
    d.conclude(error=r_physical, note=r"$u = y/\varepsilon$; the $b_j$ are the entries of $D(0)$ that act on $y$; "
               "$W$ is a Brownian motion")


@derives("eq:tildexykappa", "The scaling that makes the layer of unit size")
def scaling(d):
    X = d.eq("u", u, y / eps, "this puts the edge of the layer at 1",
             lambda X: [(X.subs(y, eps), 1), (Derivative(X, (y, 2)), 0)])
    time = d.eq("t", t, t_p / eps, r"with this time the drift remains $\phi$", lambda s: [
        (Derivative(X, y) * phi(u) / Derivative(s, t_p), phi(u)), (s.subs(t_p, 0), 0)])
    d.eq("kappa", kappa, k_p / sqrt(eps), "because "
                                          "$dW^2 = dt$", by=k_p * Derivative(X, y) / sqrt(Derivative(time, t_p)))
    d.conclude("u", "t", "kappa")


@derives("eq:reducedSDEtilde", "The scaled equation")
def reduced_scaled(d):
    X, time, K = (d["eq:tildexykappa", x] for x in ("u", "t", "kappa"))
    unscaled = kappa * k_p / K
    one = d["eq:reducedSDE"].subs(dict(zip(b, (1, 0, 0), strict=True)))
    d.eq("in scaled variables", "du", phi(u) * dt + kappa * dW,
         r"from here on the paper's $\kappa_p$ includes the factor $|B|$",
         by=(one * X.diff(y)).subs({dt: dt / time.diff(t_p), dW: dW / sqrt(time.diff(t_p)), k_p: unscaled}))
    d.conclude(note="$W$ is a Brownian motion in the scaled time $t$")


@derives("regions", "Sliding, crossing and repelling regions by the signs of $a^-$ and $a^+$")
def regions(d):
    speeds, x = symbols("a_minus a_plus", real=True), Function("u")
    rates = [Derivative(x(t)**2, t).doit().subs(Derivative(x(t), t), speed).subs(x(t), end)
             for end, speed in zip((-1, 1), speeds, strict=True)]
    d.eq("sides from which the field points at the surface", Symbol("N"),
         1 + (sign(speeds[0]) - sign(speeds[1])) / 2,
         "these are the sides where $d u^2/dt$ is negative; it is $-2 a^-$ at $u = -1$ and $2 a^+$ at $u = 1$",
         by=sum((1 - sign(rate)) / 2 for rate in rates))
    d.conclude(note="2 means attracting sliding ($a^- > 0 > a^+$), 1 crossing, and 0 repelling sliding; between "
                    "these regions there is a tangency, where $a^-$ or $a^+$ is 0")
