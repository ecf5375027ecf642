"""Conclusions of sections 2 to 5 held to what they are about, worked out here from nothing.

`ANCHORS` has a function for each label: from a random number generator, pairs of numbers, that of
the formula and that of the definition; they agree to 1e-8, or to what `TOLERANCE` has.
"""

from itertools import pairwise, product
from math import exp, pi, sqrt

import numpy as np
import sympy
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from sympy.printing.numpy import NumPyPrinter

from symasym.derivation.derivation import build

U, KAPPA = sympy.Symbol("u", real=True), sympy.Symbol("kappa", positive=True)
NODES, WEIGHTS = np.polynomial.legendre.leggauss(24)

def gauss(f, a, b):
    """The integral of f, with kinks at -1, 0 and 1, by Gauss and Legendre's rule."""
    if b == np.inf:
        return gauss(lambda s: f(a + s / (1 - s)) / (1 - s) ** 2, 0, 1)
    if b < a:
        return -gauss(f, b, a)
    ends = [a, *(x for x in (-1, 0, 0.5, 0.75, 1) if a < x < b), b]
    x, w = (np.array([side * (z - y) / 2 for y, z in pairwise(ends)]) for side in (NODES, WEIGHTS))
    middle = np.array([(y + z) / 2 for y, z in pairwise(ends)])[:, None]
    return sum(w * f(x) for x, w in zip((middle + x).flat, w.flat, strict=True))

class _Printer(NumPyPrinter):
    def _print_Integral(self, e):
        shown = self._print(e.function)
        for x, *ends in e.limits:
            shown = f"gauss(lambda {x}: {shown}, {', '.join(map(self._print, ends))})"
        return shown

def value(label, known, step=None):
    """The number of a conclusion, or of a step, with numbers and functions put in by name."""
    return number(build(label).right(step), known)

def number(e, known):
    e = sympy.sympify(e)
    symbols, functions = list(e.free_symbols), {k: f for k, f in known.items() if callable(f)}
    printer = _Printer({"fully_qualified_modules": False, "allow_unknown_functions": True})
    f = sympy.lambdify(symbols, e, [functions | {"gauss": gauss}, "numpy"], printer=printer)
    return f(*(known[s.name] for s in symbols))

class Scene:
    """A cubic drift in the layer, constant beyond; crossing to the right, or sliding."""

    def __init__(self, rng, right=1, width=1):
        am, ap, b, c = rng.uniform([0.2, 0.3, -2, -2], [1.5, 2, 2, 2]) * [1, right, 1, 1]
        self.inside = Polynomial([(am + ap) / 2 + b, (ap - am) / 2 + c, -b, -c])
        self.kappa, self.r, self.width = rng.uniform(0.9, 1.8), rng.uniform(1.2, 2), width

    lam = property(lambda self: 2 / self.kappa**2)

    def phi(self, u): return self.inside(min(max(u / self.width, -1), 1))

    def V(self, u):
        x, W = min(max(u, -1), 1), self.inside.integ()
        return W(-1) - W(x) - (u - x) * self.phi(u)

    def known(self, **more):
        """Numbers and functions by the names of the derivations' symbols."""
        named = {name: getattr(self, name) for name in ("phi", "V", "kappa", "r", "lam")}
        ends = {"a_minus": self.phi(-9), "a_plus": self.phi(9), "V_1": self.V(1), "A": self.phi}
        return named | ends | more

    def along(self, f, y, a, b):
        """y' = f(u, y) from a to b, with steps that end at the kinks."""
        kinks = [x for x in (-self.width, self.width) if min(a, b) < x < max(a, b)]
        for x, z in pairwise(sorted([a, *kinks, b], reverse=bool(b < a))):
            y = solve_ivp(f, (x, z), y, method="DOP853", rtol=1e-12, atol=1e-15).y[:, -1]
        return y

    def exit(self, x=0):
        """T and C from x: T'' + lam phi T' = -lam, 0 at both ends; 0 for lam, and 1 at -r."""
        def field(u, y):
            return y[1], -self.lam * self.phi(u) * y[1], y[3], -self.lam * (1 + self.phi(u) * y[3])
        here = self.along(field, (0, 1, 0, 0), -self.r, x)
        end = self.along(field, here, x, self.r)
        return here[2] - end[2] * here[0] / end[0], 1 - here[0] / end[0]

    def steady(self, b, a=-1, at_a=1):
        """The density of zero flux, 1 at -1, at b, and its integral from a."""
        return self.along(lambda u, y: (self.lam * self.phi(u) * y[0], y[0]), (at_a, 0), a, b)

    def masses(self):
        """Those of the density of zero flux, inside and outside the layer."""
        at_1, inside = self.steady(1)
        left, right = (20 / abs(self.lam * self.phi(x)) + 1 for x in (-1, 1))
        return inside, self.steady(right, 1, at_1)[1] - self.steady(-left)[1]

    def up(self, u): return exp(self.lam * self.V(u))

    def side(self, end, x):
        """sigma and w at x, of the side that ends at `end`."""
        whole = abs(gauss(self.up, end, x))
        inner = gauss(lambda u: gauss(self.up, end, u) / self.up(u), end, x)
        return whole / self.up(x), self.lam * self.up(x) * inner / whole

def filippov(rng):
    am, ap, gm, gp = rng.uniform(0.2, 2, 4) * [1, -1, 1, 1]
    share = np.linalg.solve([[am, ap], [1, 1]], [0, 1])
    at = {"a_minus": am, "a_plus": ap, "g^-": gm, "g^+": gp}
    yield value("filippov", at), share @ [gm, gp]

def scales(rng):
    """The same escape in the paper's own variables and in scaled ones."""
    seed, eps = rng.integers(99), rng.uniform(0.05, 0.3)
    own, scaled = (Scene(np.random.default_rng(seed), width=width) for width in (eps, 1))
    own.kappa, own.r = rng.uniform(0.3, 0.6), eps * rng.uniform(1.2, 2)
    (T, C), at = own.exit(), {"epsilon": eps, "kappa_phys": own.kappa, "r_phys": own.r, "y": own.r}
    at["t_phys"] = T
    scaled.kappa, scaled.r = value("eq:tildexykappa", at, "kappa"), value("eq:tilder", at)
    yield from zip((value("eq:tildexykappa", at, "t"), C), scaled.exit(), strict=True)
    yield value("eq:tildexykappa", at, "u"), scaled.r
    yield value("eq:eekappar", at, "scaled ratio"), scaled.r / abs(scaled.kappa) / scaled.kappa
    at = {"kappa_phys": 1, "r_phys": 1}  # where the bound is attained
    yield value("eq:eekappar", at, "scaled ratio"), value("eq:eekappar", at, "the ratio exceeds 1")

def noises(rng):
    """Mean and variance of a step, with noises that are 1 or -1."""
    b, (drift, k, eps), signs = rng.uniform(-2, 2, 3), rng.uniform(0.2, 2, 3), (-1, 1)
    at = {"phi": lambda u: drift, "u": 0, "dt": 1, "kappa_phys": k, "kappa": k / sqrt(eps)}
    at |= {"A": at["phi"]} | {f"b{n}": x for n, x in enumerate(b, 1)}
    at |= {f"{name}{n}": x for name in ("d_2", "dW") for n, x in enumerate(b, 1)}
    three = np.array(list(product(signs, repeat=3))) @ b
    one = [value("eq:reducedSDE", at | {"dW": W}) for W in signs]
    yield from ((np.mean(one), drift), ((one[1] - one[0]) / 2, np.std(k * three)))
    yield value("eq:scaledSDEx", at), drift + k * b @ b
    yield value("noise-amplitude", at), np.std(three)
    yield value("eq:scaledSDE", {"f(0)": np.exp(drift)}), np.exp(drift * np.cos(1e-5) + 1e-9)
    yield value("eq:reducedSDEtilde", at | {"dW": 1}), (drift * eps + k * sqrt(eps)) / eps

def drift(rng):
    """Each piece of phi and V; and N + 1, by short steps from both edges."""
    s = Scene(rng)
    for name, u in (("left", -1.3), ("inside", rng.uniform(-1, 1)), ("right", 1.7)):
        fall = -s.along(lambda x, _: (s.phi(x),), (0,), -1, u)[0]
        yield value("eq:phi", s.known(u=u), name), s.phi(u)
        yield from ((value("eq:V2", s.known(u=u), name), fall), (value("eq:V", s.known(u=u)), fall))
    for am, ap in product((-1, 1), repeat=2):
        closer = (abs(-1 + am / 9) < 1) + (abs(1 + ap / 9) < 1)
        yield 1 + value("regions", {"a_minus": am, "a_plus": ap}), 1 + closer

def spread(rng):
    """L* on a density, and what a short step phi dt + kappa dW does to a mean under it."""
    k, q, A = rng.uniform(0.5, 1.5), *(Polynomial(rng.uniform(x, 1, 4)) for x in (0, -1))
    e = build("eq:FPE").right().replace(sympy.Function("q"), q).replace(sympy.Function("phi"), A)
    stated = sympy.lambdify(U, e.doit().subs(KAPPA, k))
    nodes, shares = np.polynomial.hermite_e.hermegauss(6)
    g = Polynomial.fromroots([-1] * 8 + [1] * 8)
    def rate(dt):
        step = list(zip(k * sqrt(dt) * nodes, shares / sum(shares), strict=True))
        def change(x): return sum(s * (g(x + A(x) * dt + W) - g(x)) for W, s in step)
        return gauss(lambda x: q(x) * change(x), -1, 1) / dt
    yield gauss(lambda x: stated(x) * g(x), -1, 1), 2 * rate(1e-5) - rate(2e-5)

def constant(rng):
    """A constant drift: the boundary-value problem, and the density as a sum of modes."""
    s, a, start = Scene(rng), *rng.uniform(0.3, 1, 2)
    s.inside, k, r = Polynomial([a]), s.kappa, s.r
    at, (T, C) = s.known(a=a, u=start), s.exit()
    yield value("constant-drift", at, "from 0"), T
    yield value("constant-drift", at, "mean escape time from u"), s.exit(start)[0]
    yield value("constant-drift", at, "exit through -r, from 0"), C
    n = np.arange(1, 120)
    rates = (a / k) ** 2 / 2 + (k * n * pi / r) ** 2 / 8
    def p(u, t):
        shapes = np.sin(n * pi / 2) * np.sin(n * pi * (u + r) / (2 * r)) * np.exp(-rates * t)
        return exp(a * u / k**2) * sum(shapes) / r
    yield value("eq:Ttilde0", at | {"p": p}), T
    mode = sympy.exp(a * U / k**2) * sympy.sin(sympy.pi * (U + r) / (2 * r))
    e = build("eq:odeR").right("in terms of R").replace(sympy.Function("phi"), lambda _: a)
    e = e.replace(sympy.Function("R"), lambda _: mode / rates[0]).doit()
    yield number(e, at), -number(mode, at)
    yield sympy.integrate(build("eq:odeR").right("start at 0"), (U, -1, 1)), -1

def crossing(rng):
    s = Scene(rng)
    T, C = s.exit()
    def both(v): return s.up(v) * gauss(lambda u: 1 / s.up(u), -s.r, v)
    sums = (gauss(f, *over) for f in (s.up, both) for over in ((0, s.r), (-s.r, 0)))
    at = s.known(C=C, **dict(zip(("I0", "I1", "J0", "J1"), sums, strict=True)))
    (left, w), (right, more) = (s.side(end, 0) for end in (-s.r, s.r))
    at |= {"sigma_left": left, "sigma_right": right, "w": w + more}
    yield from ((value("first-integral", at | {"u": side}), C - (side > 0)) for side in (-1, 1))
    yield number(sympy.Integral(build("density-R").right(), (U, -s.r, s.r)), at), T
    yield from ((value(x, at), y) for x, y in (("eq:C", C), ("eq:Ttilde", T), ("backward", T)))
    yield value("positive-form", at, "from both sweeps"), T
    yield value("positive-form", at, "chance of leaving on the left"), C

def panels(rng):
    s, (a, b) = Scene(rng), sorted(rng.uniform(-1, 1, 2))
    def e(u): return s.up(u) / s.up(a)
    f, c = min(e(b), 1), min(1 / e(b), 1)
    at = s.known(f=f, c=c, E_s=c * gauss(e, a, b), F_s=f * gauss(lambda u: 1 / e(u), a, b))
    at["D_s"] = f * gauss(lambda v: gauss(e, a, v) / e(v), a, b)
    at["sigma"], at["w"] = s.side(-2, a)
    for name, end in ((", scaled", -2), (" from an absorbing end", a)):
        for what, exact in zip(("sigma", "w"), s.side(end, b), strict=True):
            yield value("panel-step", at, what + name), exact
    x = rng.uniform(0.2, 4)
    single = gauss(lambda t: exp(-x * t), 0, 1)
    yield value("constant-panel", {"x": x}, "single"), single
    for name, y in (("double, V falls", x), ("double, V rises", -x)):
        double = gauss(lambda t, y=y: gauss(lambda v: exp(y * (t - v)), 0, t), 0, 1)
        yield value("constant-panel", {"x": x, "E_s": single}, name), double / max(exp(y), 1)

def sliding(rng):
    s, u = Scene(rng, -1), rng.uniform(-2, 2)
    here, (inside, outside) = s.steady(u)[0], s.masses()
    N, *tails = (gauss(lambda x, z=z: exp(-s.lam * s.V(z * x)), y, t) for z, y, t in
                 ((1, -1, 1), (1, 1, np.inf), (-1, 1, np.inf)))  # fmt: skip
    at = s.known(K=1, u=u, N=N, M=sum(tails), w=s.lam * exp(s.lam * s.V(u)) * (N + sum(tails)))
    yield value("eq:pss", at), here
    yield value("positive-density", at, "density"), here / (inside + outside)
    yield value("positive-density", at, "occupation"), inside / (inside + outside)

def limits(rng):
    """Orders: what is left out, a power of the noise, is extrapolated away."""
    s, eps, (low, bend) = Scene(rng, -1), rng.uniform(0.1, 0.3), rng.uniform(-0.02, 0.02, 2)
    for label, noises, place in (("eq:Plarge", (30, 60), 0), ("eq:Psmall", (0.2, 0.1), 1)):
        if place:
            s.inside = Polynomial([low, -1]) * Polynomial([0.8, bend])
        found = []
        for s.kappa in noises:
            at = s.known(epsilon=eps, kappa_phys=s.kappa * sqrt(eps))
            at |= {"V_m": s.V(low), "K_m": -s.inside.deriv()(low)}
            found.append(value(label, at) * sum(s.masses()) / s.masses()[place])
        yield (4 * found[1] - found[0]) / 3, 1

def radii(rng):
    """T_p grows by r_p/a+; and the noise at which the well's time is r/a+, for far radii."""
    s, found = Scene(rng), []
    for s.r in (60, 80):
        found.append((value("eq:Tlarge", s.known(r_phys=s.r / 9)), s.exit()[0] / 9))
    yield np.subtract(*found)
    low, high, s.r, found = rng.uniform(-0.6, -0.4), rng.uniform(0.5, 0.7), 6, []
    s.inside = Polynomial.fromroots([low, high, -rng.uniform(1.4, 2)])
    slopes = {"A_1": s.inside.deriv()(low), "A_2": s.inside.deriv()(high)}
    for r in (1e8, 1e16):
        s.kappa = value("eq:Tsmall", s.known(r=r, D=s.V(high) - s.V(low)) | slopes | {"r": r})
        found += [s.kappa**2, s.exit()[0] * s.phi(9) / r]
    yield (found[0] * found[3] - found[2] * found[1]) / (found[0] - found[2]), 1

ANCHORS = {label: function for function, labels in {
    filippov: "filippov", scales: "eq:tildexykappa eq:tilder eq:eekappar", spread: "eq:FPE",
    noises: "eq:scaledSDE noise-amplitude eq:scaledSDEx eq:reducedSDE eq:reducedSDEtilde",
    drift: "eq:phi eq:V eq:V2 regions", constant: "constant-drift eq:Ttilde0 eq:odeR",
    crossing: "first-integral density-R eq:C eq:Ttilde backward positive-form",
    panels: "constant-panel panel-step", sliding: "eq:pss positive-density",
    limits: "eq:Plarge eq:Psmall", radii: "eq:Tlarge eq:Tsmall",
}.items() for label in labels.split()}
TOLERANCE = {"eq:Ttilde0": 1e-5, "constant-drift": 1e-5, "eq:odeR": 1e-5, "eq:FPE": 1e-6}
TOLERANCE |= {"eq:Plarge": 1e-2, "eq:Psmall": 1e-2, "eq:Tlarge": 2e-2, "eq:Tsmall": 2e-2}
