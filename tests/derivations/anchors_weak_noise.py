"""Conclusions of section 6 held to their definitions; the tables are as in `anchors_exit`.

An expansion is compared with the next term extrapolated away.
"""

from itertools import pairwise
from math import erf, exp, log, pi, sqrt

import numpy as np
from numpy.polynomial import Polynomial
from scipy.special import airy, dawsn, erfcx

from tests.derivations.anchors_exit import Scene, gauss, value

# Chebyshev's points from -1 to 1, and what differentiates there.
GRID, FIRST = -np.cos(np.pi * np.arange(25) / 24), np.arange(25) == 0
ENDS = np.where(FIRST | FIRST[::-1], 2, 1) * (-1) ** np.arange(25)
SLOPE = np.outer(ENDS, 1 / ENDS) / (GRID[:, None] - GRID + np.eye(25))
SLOPE -= np.diag(SLOPE.sum(axis=1))
FUNCTIONS = {"erf": erf, "airyai": lambda z: airy(z)[0], "airybi": lambda z: airy(z)[2]}


def well(rng, barrier=None):
    """A scene with a well and a barrier, and its numbers."""
    s, third, low = Scene(rng), rng.uniform(1.4, 2), rng.uniform(-0.6, -0.4)
    high, s.r = rng.uniform(0.5, 0.7) if barrier is None else barrier, 1.5
    s.inside = Polynomial.fromroots([low, high, -third]) * rng.uniform(1, 1.5)
    slope, (V_1, V_2) = s.inside.deriv(), (s.V(low), s.V(high))
    at = {"A_1": slope(low), "A_2": slope(high), "V_u1": V_1, "V_u2": V_2, "D": V_2 - V_1}
    at |= {"u2": high, "V_top": s.V(1), "V_0": s.V(0), "phi_0": s.phi(0)}
    return s, low, s.known() | at


def spent(s, wall, till, start, to):
    """Mean time spent in (wall, till), a reflecting wall there, on the way from `start` up to `to`.

    Minus the integral of S, S' = -lam (phi S + 1 up to `till`), by Chebyshev collocation.
    """
    slope, total, kinks = 0, 0, {z for z in (-1, 1) if wall < z < to}
    ends = sorted({wall, till, start, to} | kinks)
    steep = s.lam * max(abs(s.phi(z)) for z in np.linspace(-1, 1, 21)) / 8
    cuts = [np.linspace(x, y, int(steep * (y - x)) + 2) for x, y in pairwise(ends)]
    for x, y in (pair for row in cuts for pair in pairwise(row)):
        D, drift = SLOPE * 2 / (y - x), s.inside(np.clip((x + y) / 2 + (y - x) / 2 * GRID, -1, 1))
        known, rows = np.full(25, -s.lam * (x < till)), D + np.diag(s.lam * drift)
        known[0], rows[0] = slope, FIRST
        S = np.linalg.solve(rows, known)
        D[0], slope = FIRST, S[-1]
        total -= np.linalg.solve(D, np.where(FIRST, 0, S))[-1] * (start <= x)
    return total


def pieces(s):
    r = s.r
    return [spent(s, *x) for x in ((-r, -1, 0, 1), (-1, 1, 0, 1), (-r, 1, 1, r), (1, r, 1, r))]


def whole(s):
    return spent(s, -s.r, s.r, 0, s.r)


def limit(f, small, power=2):
    """f at 0, from two numbers, where the next term is of this power."""
    return (2**power * f(small / 2) - f(small)) / (2**power - 1)


def ratio(s, at, label, step, exact, small):
    """The limit of a statement over its definition as kappa falls."""

    def of(k):
        s.kappa = k
        return value(label, at | {"kappa": k, "r": s.r}, step) / exact(s)

    return limit(of, small)


def split(rng):
    s = Scene(rng)
    exact, at = pieces(s), s.known()
    yield from zip(value("eq:fourPieces", at), exact, strict=True)
    yield value("eq:fourthTerm", at, "closed form"), exact[3]
    yield value("eq:TtildeCzero", at, "without C"), whole(s)


def bounds(rng):
    s = Scene(rng)
    s.r, s.kappa, left = rng.uniform(4, 5), rng.uniform(0.9, 1.4), s.phi(-9)
    top = max(s.V(x) for x in np.linspace(0, s.r, 400))
    s.inside, s.r = (s.inside, s.r) if top <= left * s.r / 4 else (Polynomial([left]), s.r)
    s.r = max(s.r, s.kappa**2 / left)
    up, down = (lambda v, sign=sign: exp(sign * s.lam * s.V(v)) for sign in (1, -1))
    (_, C), J = s.exit(), gauss(lambda v: up(v) * gauss(down, -s.r, v), -s.r, s.r)
    more = "eq:TtildeCzero", "what is left out, at most", C * s.lam * J
    for label, step, x in (("C-bound", None, C), more):
        high = value(label, s.known(J0=J, J1=0), step)
        yield high, max(high, x)
    s = Scene(rng, -1)
    L = next((x for x in np.linspace(0.01, 1.5, 150) if s.V(1 - x) > s.V(1)), 1.5) - 0.01
    (inside, outside), low = s.masses(), value("L-bound", s.known(L=L))
    yield low, min(low, inside / (inside + outside))
    rates = (np.arange(1, 99) * pi * s.kappa / s.r) ** 2 / 8  # of Brownian motion
    sums = {"n": 3, "S_n": sum(rates**-3.0), "S_{n+1}": sum(rates**-4.0)}
    low, high = (value("exit-eigenvalue", sums, f"from {x}") for x in ("below", "above"))
    yield from ((low, min(low, rates[0])), (high, max(high, rates[0])))


def strong(rng):
    s = Scene(rng)

    def of(label, step, exact):
        def relative(x):
            s.kappa, s.r = 1 / x, x**-4
            return value(label, s.known(), step) / exact(s)

        return limit(relative, 1 / 8)

    def gap(x):
        s.kappa, s.r = 1 / x, x**-4
        return s.exit()[0] - value("eq:Ttildelarge", s.known(), "next orders")

    for k, name in enumerate(("first", "second", "third")):
        yield of("first-three", name, lambda s, k=k: pieces(s)[k]), 1
    yield of("eq:fourthTerm", None, lambda s: pieces(s)[3]), 1
    yield of("eq:Ttildelarge", None, lambda s: s.exit()[0]), 1
    yield 1 + limit(gap, 1 / 8), 1


def weak(rng):
    s, low, at = well(rng)
    x, V, known = rng.uniform(0.5, 1.5), at["V_u1"], at | {"c_2": -at["A_1"]}
    near = lambda k: value("laplace-substitution", known | {"kappa": k, r"\hat{u}": x}) - V  # noqa: E731
    yield limit(lambda k: (s.V(low + k * x) - V) / near(k), 1e-3, 1), 1
    line = [gauss(lambda z, a=a: exp(-abs(a) * z * z), -7, 7) for a in (at["A_1"], at["A_2"])]
    yield value("gaussian-step", at), 2 * line[0] * line[1]
    for label, step, exact in (
        ("eq:secondTerm", None, lambda s: pieces(s)[1]),
        ("other-pieces", "first piece", lambda s: pieces(s)[0]),
        ("eq:fourthTerm2", None, lambda s: pieces(s)[3]), ("eq:Ttildesmall", None, whole),
        *[("other-pieces", "third piece", lambda s: pieces(s)[2])] * bool(s.V(1) > V + 0.15),
    ):  # fmt: skip
        yield ratio(s, at, label, step, exact, 0.2), 1
    s.kappa, far = 0.5, []
    for s.r in (20, 40):
        far.append((value("eq:Ttildesmall", at | s.known()), spent(s, -2, s.r, 0, s.r)))
    yield np.subtract(*far)


def saddle(rng):
    s, low = Scene(rng), rng.uniform(-0.1, 0.1)
    s.inside = Polynomial([low, -1]) * Polynomial([1, *rng.uniform(-0.3, 0.3, 4)])
    at = {f"c_{j + 1}": -s.inside.deriv(j)(low) for j in range(1, 6)}
    for label, step, power, *ends in (
        ("saddle-series", None, 3, -1, 1), ("saddle-start", "to the right", 2, low, 1),
        ("saddle-start", "to the left", 2, -1, low),
    ):  # fmt: skip
        def of(x, label=label, step=step, ends=ends):
            part = gauss(lambda u: exp((s.V(low) - s.V(u)) / x), *ends)
            return part / sqrt(2 * pi * x / at["c_2"]) / value(label, at | {"lam": 1 / x}, step)

        yield limit(of, 1 / 200, power), 1
    c, rate, X = at["c_2"], 300.0, 40.0
    a, only = sqrt(rate * c / 2), {f"c_{j}": 0 for j in range(3, 6)} | {"c_2": c, "lam": rate}
    for name, inner in (("well", lambda x: -sqrt(pi) / 2 * erfcx(x)), ("barrier", dawsn)):
        # Less log(X)/c, the finite part of the integral of 1/(c s) over (0, X).
        ends = pairwise((0, *X ** np.linspace(-2, 1, 40)))
        double = sum(gauss(lambda x, f=inner: rate / a * f(a * x), *pair) for pair in ends)
        yield (value("saddle-start", only, f"double integral beside a {name}")[0],
               double - np.sign(double) * log(X) / c)  # fmt: skip


def sliding(rng):
    s = Scene(rng, -1)
    (at_1, inside), far = s.steady(1), [float(20 / abs(s.lam * s.phi(x)) + 1) for x in (-1, 1)]
    tails = -s.steady(-far[0])[1], s.steady(far[1], 1, at_1)[1]
    at = s.known(N=gauss(lambda u: exp(-s.lam * s.V(u)), -1, 1), M=sum(tails))
    yield from zip((value("tails", at, x) for x in ("left", "right")), tails, strict=True)
    yield from ((value(label, at), inside / (inside + sum(tails))) for label in ("eq:P", "eq:P2"))


def limits(rng):
    s, low = Scene(rng, -1), rng.uniform(-0.3, 0.3)
    for label, small, of_bowl in (("eq:Plarge2", 1 / 30, 0), ("eq:Psmall2", 0.2, 1)):
        if of_bowl:
            s.inside = Polynomial([low, -1]) * Polynomial([1, rng.uniform(-0.2, 0.2)])

        def of(x, label=label, k=of_bowl):
            s.kappa = x if k else 1 / x
            stated = value(label, s.known(V_m=s.V(low), K_m=-s.inside.deriv()(low)))
            return stated * sum(s.masses()) / s.masses()[k]

        yield limit(of, small), 1


def multiplier(rng):
    x, seed = rng.uniform(-1, 1), rng.integers(99)

    def passing(k):
        s, _, at = well(np.random.default_rng(seed), k * x)
        s.kappa = k
        term = 2 * pi / sqrt(-at["A_1"] * at["A_2"]) * exp(s.lam * at["D"])
        share = value("eq:S", at | {"kappa": k} | FUNCTIONS, "barrier near the start")
        return (whole(s) - s.r / s.phi(9)) / term / share

    yield limit(passing, 0.06, 1), 1
    s, _, at = well(rng, -0.1)
    yield ratio(s, at, "eq:S", "start behind the barrier", whole, 0.05), 1
    s.inside = Polynomial([0.7, rng.uniform(0.2, 0.5)])
    yield ratio(s, s.known(phi_0=0.7), "eq:S", "no well", whole, 0.1), 1
    Z = rng.uniform(-2, 2)
    J = [gauss(lambda t, z=z: 2 * exp(z * t**2 - t**6 / 12), 0, 4) for z in (Z, -Z)]
    yield value("eq:S", {"Z": Z} | FUNCTIONS, "near the fold"), J[0] / sum(J)


def clocks(rng):
    seed, eps = rng.integers(99), rng.uniform(0.05, 0.3)
    own, scaled = (Scene(np.random.default_rng(seed), width=width) for width in (eps, 1))
    own.kappa, own.r = scaled.kappa * sqrt(eps), scaled.r * eps
    yield value("eq:TtildetoT", {"epsilon": eps, "T": scaled.exit()[0]}), own.exit()[0]


GROUPS = (
    (split, 1e-8, "eq:fourPieces eq:TtildeCzero"), (bounds, 1e-8, "C-bound L-bound"),
    (strong, 1e-2, "first-three eq:fourthTerm eq:Ttildelarge"),
    (weak, 1e-3, "laplace-substitution gaussian-step eq:secondTerm"),
    (weak, 1e-3, "other-pieces eq:fourthTerm2 eq:Ttildesmall"),
    (saddle, 1e-6, "saddle-series saddle-start"), (sliding, 1e-8, "tails eq:P eq:P2"),
    (limits, 1e-5, "eq:Plarge2 eq:Psmall2"), (multiplier, 3e-2, "eq:S"),
    (clocks, 1e-8, "eq:TtildetoT"),
)  # fmt: skip
ANCHORS = {label: function for function, _, labels in GROUPS for label in labels.split()}
TOLERANCE = {label: size for _, size, labels in GROUPS for label in labels.split()}
