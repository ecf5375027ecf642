"""Section 7: the friction oscillator."""

from sympy import Derivative, Function, Rational, Symbol, sqrt, symbols

from derivations.paper import V, alpha, kappa_physical, mu, phi, u, z0
from derivations.sections.section4_reduction import PIECES
from symasym.derivation.derivation import derives

F, A = Function("F"), Function("A")
y, z, c_3, beta = symbols("y z c_3 beta", real=True)
zdot, ydot, zddot, g_s = symbols(r"\dot{z} \dot{y} \ddot{z} g_s", real=True)
dt, dW = symbols("dt dW")
m, q, s = symbols("m q s", positive=True)
force = alpha * (u + mu * (u - u**3))
PEAK = sqrt((1 + mu) / (3 * mu))
BETA = 2 * alpha * (1 + mu) ** Rational(3, 2) / (3 * sqrt(3 * mu))
half = Rational(1, 2)
BLOCK = ("$y$ is the velocity of the block relative to the belt, and $z$ is the extension of the spring, both "
         "unscaled")


@derives("eq:osc2", "The oscillator as a first-order system")
def first_order(d):
    pulled = d.eq("acceleration", zddot, -zdot - z - F(zdot + 1), "this is eq:osc1 solved for the acceleration",
                  [(zddot + zdot + z + F(zdot + 1), 0)])
    along = d.eq("along the surface", zdot, y - 1, r"$y = \dot z + 1$ is the velocity relative to the belt",
                 [(zdot + 1, y)])
    d.eq("across the surface", ydot, 1 - z - y - F(y), r"because $\dot y = \ddot z$", by=pulled.subs(zdot, along))
    d.conclude("along the surface", "across the surface", note=BLOCK)


@derives("eq:forcePWC", "Coulomb friction: the sliding region, in which the block sticks to the belt")
def coulomb(d):
    at_zero = d["eq:osc2", "across the surface"].subs(y, 0)
    left, right = (at_zero.subs(F(0), side * alpha) for side in (-1, 1))
    am, ap = symbols("a_minus a_plus", real=True)
    regions = d["regions"]
    number = lambda at: regions.subs({am: left.subs(z, at), ap: right.subs(z, at)})
    low = d.eq("lower edge", Symbol("z_1"), 1 - alpha, r"here $a^+ = 0$ with $F = \alpha$; to the left of this "
               "edge orbits cross, since only one field points "
               "at the surface", lambda z1: [(right.subs(z, z1), 0), (number(z1 - alpha), 1)])
    d.eq("upper edge", Symbol("z_2"), 1 + alpha, r"here $a^- = 0$ with $F = -\alpha$; both fields point at the "
         "surface between the edges, and only one does to their right", lambda z2: [
             (left.subs(z, z2), 0), (number((low + z2) / 2), 2), (number(z2 + alpha), 1)])
    velocity, along = d["filippov"], d["eq:osc2", "along the surface"].subs(y, 0)
    known = {"a_minus": left, "a_plus": right, "g^-": along, "g^+": along}
    d.eq("sliding velocity", g_s, -1, "the block rides the belt",
         by=velocity.subs({x: known[x.name] for x in velocity.free_symbols}, simultaneous=True))
    d.conclude("lower edge", "upper edge", "sliding velocity",
               note="the block sticks for $z_1 < z < z_2$; " + BLOCK)


@derives("eq:forcePerturbed", "The smoothed friction force")
def smoothed(d):
    every = d.eq("odd cubics from -alpha to alpha", F(u), (alpha - c_3) * u + c_3 * u**3,
                 r"with $u = y/\varepsilon$, these are the forces inside the layer, $|u| < 1$, that are "
                 "continuous at both edges", lambda f: [
                     (f.subs(u, 1), alpha), (f.subs(u, -1), -alpha), (f.diff(u, 4), 0), (f.coeff(u, 3), c_3)])
    d.eq("shape of the force", F(u), force, r"here $\mu = -c_3/\alpha$, which is 0 if the force is linear in the "
                                            "layer",
         by=every.subs(c_3, -alpha * mu))
    d.conclude(note=r"$|u| \le 1$; outside the layer the force is $-\alpha$ for $u \le -1$ and $\alpha$ for "
                    r"$u \ge 1$")


@derives("turning-points", "Turning points of the friction force")
def turning(d):
    d.suppose(r"$\mu > 1/2$; otherwise the force grows throughout the layer (see 'beta')")
    slope = d.eq("slope", Derivative(F(u), u), alpha * (1 + mu - 3 * mu * u**2),
                 by=d["eq:forcePerturbed"].diff(u))
    square = d.bound("inside the layer", 1, ">", (1 + mu) / (3 * mu), "the turning point is inside the layer "
                     r"exactly for $\mu > 1/2$",
                     2 * m / (3 * (half + m)), on={mu: half + m})
    d.eq("zero", Symbol("u_s"), PEAK, "minus this value is the other zero, since the slope is even",
         lambda at: [(slope.subs(u, at), 0), (at**2, square), (sqrt(at**2), at)])
    d.conclude("zero", note=r"$u_s$ is a scaled position $y/\varepsilon$")


@derives("beta", "The breakaway force")
def breakaway(d):
    d.suppose(r"$\mu \ge 1/2$; otherwise the force grows throughout the layer, and $\beta = \alpha$")
    slope, at = d["turning-points", "slope"], d["turning-points"]
    least = d.bound("above alpha for mu > 1/2", BETA**2, ">", alpha**2,
                    r"the difference is $(2\mu - 1)^2 (\mu + 4) \alpha^2/(27\mu)$",
                    4 * alpha**2 * m**2 * (m + Rational(9, 2)) / (27 * (half + m)), on={mu: half + m})
    flat = d.bound("no turning point for mu < 1/2: the force grows", slope, ">", 0,
                   r"this holds for $|u| < 1$, so the largest value is $\alpha$, at $u = 1$",
                   alpha * (s + (3 + s) * q * (2 + q)) / ((2 + s) * (1 + q) ** 2),
                   on={mu: 1 / (2 + s), u: 1 / (1 + q)})
    d.eq("force at the turning point", beta, BETA, r"the slope of the force is 0 there; for $\mu = 1/2$ the "
         r"force is $\alpha$",
         lambda e: [(e.subs(mu, half)**2, least), (slope.subs(u, at), flat)], d["eq:forcePerturbed"].subs(u, at))
    d.conclude("force at the turning point", note=r"$\beta$ is the largest force, unscaled")


@derives("eq:osc3", "The oscillator with noise on the force")
def noisy(d):
    d.eq("along the surface", "dz =", (y - 1) * dt, by=d["eq:osc2", "along the surface"] * dt)
    d.eq("across the surface", "dy =", (1 - z - y - F(y)) * dt + kappa_physical * dW,
         r"the force $\kappa_p \, dW/dt$ only adds to the acceleration, and the mass is 1",
         by=d["eq:osc2", "across the surface"] * dt + kappa_physical * dW)
    d.conclude("along the surface", "across the surface", note=BLOCK)


@derives("eq:phifric0", "The friction drift")
def friction_drift(d):
    frozen = d["eq:osc3", "across the surface"].coeff(dt).subs({z: z0, y: 0}, simultaneous=True)
    frozen = frozen.subs(F(0), d["eq:forcePerturbed"])
    left, inside, right = (e.replace(A, lambda at: frozen.subs(u, at)) for e in d["eq:phi"])
    d.eq("left", phi(u), 1 - z0 + alpha, r"this is the drift at $(0, z_0)$ with $y/\varepsilon$ kept", by=left)
    found = d.eq("inside", phi(u), 1 - z0 - force, by=inside)
    d.eq("right", phi(u), 1 - z0 - alpha, by=right)
    d.eq("powers of u", A(u), 1 - z0 - alpha * (1 + mu) * u + alpha * mu * u**3, by=found)
    d.conclude("left", "inside", "right", cases=PIECES)


@derives("eq:Vfric", "The friction potential")
def friction_potential(d):
    left, middle, right = (d["eq:phifric0", x] for x in ("left", "inside", "right"))
    climb = lambda e: d["eq:V"].replace(phi, lambda at: e.subs(u, at)).doit()
    falls = lambda e, at, value: lambda found: [(found.diff(u), -e), (found.subs(u, at), value)]
    d.eq("left", V(u), -(1 - z0 + alpha) * (u + 1), r"from $V' = -\phi$ and $V(-1) = 0$",
         falls(left, -1, 0), climb(left))
    inside = d.eq("inside", V(u), -(1 - z0) * (u + 1) + alpha * (1 + mu) * (u**2 - 1) / 2
                  - alpha * mu * (u**4 - 1) / 4, r"from $V' = -\phi$ and "
                  "$V(-1) = 0$", falls(middle, -1, 0), climb(middle))
    top = inside.subs(u, 1)
    d.eq("right", V(u), -2 * (1 - z0) - (1 - z0 - alpha) * (u - 1), "$V$ does not jump at 1",
         falls(right, 1, top), top + climb(right) - climb(right).subs(u, 1))
    d.conclude("left", "inside", "right", cases=PIECES)
