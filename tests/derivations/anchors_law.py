"""Conclusions of section 9 held to boundary-value problems, by collocation and shooting, and to steps in time.

The tables are as in `anchors_exit`.
"""
# ruff: noqa: E501, E731

from math import exp, pi, sqrt, tanh

import numpy as np
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from derivations.sections.section9_noise import V, f, sigma
from symasym.derivation.derivation import build
from tests.derivations.anchors_exit import U, gauss, number, value
from tests.derivations.anchors_weak_noise import GRID, SLOPE


def powers(phi, lam, x, begin, n=12):
    """The coefficients of eta and zeta at x, from -1, where they are (0, 1) or (1, 0)."""
    def field(u, y):
        eta, zeta = np.split(y, 2)
        return np.concatenate([zeta + lam * phi(u) * eta, [0, *lam * eta[:-1]]])

    start = np.zeros(2 * n)
    start[[0, n]] = begin
    return np.split(solve_ivp(field, (-1, x), start, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1], 2)


def exit_law(rng):
    """Transform, mean and second moment: two absorbing ends, then one that reflects."""
    phi, kappa, s, j = Polynomial(rng.uniform(-1, 1, 4)), *rng.uniform((0.8, 0.2), (1.2, 0.4)), 11
    mirror, lam, x = (lambda u: -phi(-u)), 2 / kappa**2, GRID[j]
    L = kappa**2 / 2 * SLOPE @ SLOPE + phi(GRID)[:, None] * SLOPE
    for begin in ((0, 1), (1, 0)):
        def solve(s, known, left, right, reflects=begin[0]):
            rows, force = L - s * np.eye(25), np.full(25, 1.0) * known
            rows[0], rows[-1], force[0], force[-1] = SLOPE[0] if reflects else np.eye(25)[0], np.eye(25)[-1], left, right
            return np.linalg.solve(rows, force)

        T, at = solve(0, -1, 0, 0), {"s": s}
        for side, (eta, zeta), Z in (("-", powers(phi, lam, x, begin), begin[1]), ("+", powers(mirror, lam, -x, (0, 1)), 1)):
            at |= {rf"\eta_{k}^{side}": e for k, e in enumerate(eta)} | {rf"\zeta_{k}^{side}": z for k, z in enumerate(zeta)}
            at |= {f"Z^{side}": Z, rf"\eta^{side}": Polynomial(eta)(s), rf"\zeta^{side}": Polynomial(zeta)(s)}
        at["W"] = value("exit-transform", at, "Wronskian")
        at |= {f"w_{k}": value("exit-moments", at, f"coefficient {k} of W") for k in (0, 1)} | {"T": T[j]}
        right, left = solve(s, 0, 0, 1)[j], 0 if begin[0] else solve(s, 0, 1, 0)[j]
        yield from ((1 + value("exit-transform", at, f"leaving on the {x}"), 1 + y) for x, y in (("left", left), ("right", right)))
        yield value("exit-transform", at, "in positive terms"), 1 - left - right
        yield value("exit-moments", at, "mean"), T[j]
        yield value("exit-moments", at, "second moment"), solve(0, -2 * T, 0, 0)[j]


def spectrum(rng):
    """A constant drift a: the eigenvalues are (k pi kappa)^2/8 + a^2/(2 kappa^2)."""
    a, kappa, x = rng.uniform((0.2, 0.8, -0.5), (1, 1.5, 0.5))
    (e, z), (f, w) = (powers(lambda u, c=c: c, 2 / kappa**2, y, (0, 1)) for c, y in ((a, x), (-a, -x)))
    W = np.convolve(e, w)[:4] + np.convolve(f, z)[:4]
    at = {f"c_{n}": W[n] / W[0] for n in range(4)} | {"Z^-": 1, "Z^+": 1}
    at |= {rf"\{name}_{k}^{side}": y[k] for name, ys in (("eta", (e, f)), ("zeta", (z, w))) for side, y in zip("-+", ys, strict=True) for k in (0, 1)}
    rates, b = (np.arange(1, 20_000) * pi * kappa) ** 2 / 8 + a**2 / (2 * kappa**2), 2 * a / kappa**2
    yield at["c_1"], value("exit-eigenvalue", at, "first coefficient")
    yield value("exit-eigenvalue", at, "sum of powers 1"), (b / tanh(b) - 1) * kappa**2 / a**2
    yield from ((value("exit-eigenvalue", at, f"sum of powers {n}"), sum(rates**-n)) for n in (2, 3))


class State:
    """phi = p sigma^2 on (-r, r), and the drift by Itô's calculus."""

    def __init__(self, p, sigma, alpha, kappa, r=1):
        self.V, self.phi, self.sigma = -p.integ(), p * sigma**2, sigma
        self.alpha, self.kappa, self.r = alpha, kappa, r
        self.drift = self.phi + alpha * kappa**2 * sigma * sigma.deriv()

    def scale(self, u): return exp(2 / self.kappa**2 * self.V(u)) * self.sigma(u) ** (-2 * self.alpha)

    def along(self, source, y, b, a):
        """y and y' at b, L y = source(y) from a on."""
        field = lambda u, y: (y[1], 2 * (source(y[0]) - self.drift(u) * y[1]) / (self.kappa * self.sigma(u)) ** 2)
        return solve_ivp(field, (a, b), y, method="DOP853", rtol=1e-11, atol=1e-14).y[:, -1]


def state(rng):
    """The generator by a short step, the densities by their equations, T and C by shooting."""
    p, g, x = Polynomial(rng.uniform(-1, 1, 4)), Polynomial(rng.uniform(-1, 1, 4)), rng.uniform(-0.5, 0.5)
    d, nodes, shares = build("state-noise"), *np.polynomial.hermite_e.hermegauss(16)
    for alpha, step in ((0, "Itô"), (0.5, "Stratonovich"), (0.3, "generator")):
        s = State(p, Polynomial([1, *rng.uniform(-0.3, 0.3, 2)]), alpha, rng.uniform(0.8, 1.2))
        at = {"u": x, "kappa": s.kappa, r"\alpha": alpha, "x": x, "r": 1, "phi": s.phi}

        def rate(dt, s=s):
            move = 0
            for _ in range(40):
                move = s.phi(x) * dt + s.kappa * s.sigma(x + s.alpha * move) * sqrt(dt) * nodes
            return shares @ (g(x + move) - g(x)) / sum(shares) / dt

        e = d.right(step).replace(f, g).replace(sigma.func, s.sigma).doit()
        yield number(e, at), (8 * rate(1e-4) - 6 * rate(2e-4) + rate(4e-4)) / 3
        scale, speed = (number(d.right(f"{name} density").subs({V(U): s.V(x), sigma: s.sigma(x)}), at) for name in ("scale", "speed"))
        yield scale, s.along(lambda y: 0, (0, s.scale(0)), x, 0)[1]
        flow = lambda u, q, s=s: 2 * q * (s.drift(u) / (s.kappa * s.sigma(u)) ** 2 - s.sigma.deriv()(u) / s.sigma(u))
        first = 2 / s.kappa**2 * s.sigma(0) ** (2 * alpha - 2)
        yield speed, solve_ivp(flow, (0, x), [first], method="DOP853", rtol=1e-11, atol=1e-14).y[0, -1]
        h, T = (s.along(lambda y, c=c: c, (0, 1 + c), 1, -1)[0] for c in (0, -1))
        at["Sigma"] = lambda u, s=s: gauss(s.scale, -1, u)
        at["m"] = lambda u, s=s: 2 / (s.kappa * s.sigma(u)) ** 2 / s.scale(u)
        at["C"] = lambda y, at=at: value("state-noise-time", at, "leaving on the left")
        yield at["C"](x), 1 - s.along(lambda y: 0, (0, 1), x, -1)[0] / h
        yield value("state-noise-time", at, "mean exit time"), s.along(lambda y: -1, (0, -T / h), x, -1)[0]


def rate(rng):
    """A well and a barrier, a reflecting end: the time from the well and the first eigenvalue."""
    low, high, c, k, alpha = rng.uniform((-0.6, 0.4, -0.2, 2, 0), (-0.4, 0.6, 0.2, 3, 1))
    ratios, p = [], Polynomial.fromroots([low, high]) * k
    for kappa in (0.2, 0.1 * sqrt(2)):
        s = State(p, Polynomial([1, c]), alpha, kappa, 1.5)
        at = {"kappa": kappa, r"\alpha": alpha, r"D_\sigma": s.V(high) - s.V(low), r"\sigma(u_1)": s.sigma(low), r"\sigma(u_2)": s.sigma(high)}
        at |= {"A_1": s.phi.deriv()(low), "A_2": s.phi.deriv()(high)}
        T, slowest = value("state-noise-rate", at)
        time = s.along(lambda y: -1, (0, 0), low, -1.5)[0] - s.along(lambda y: -1, (0, 0), 1.5, -1.5)[0]
        end = lambda x, s=s, T=T: s.along(lambda y: -x / T * y, (T, 0), 1.5, -1.5)[0]
        ratios.append((T / time, slowest * T / brentq(end, 0.5, 2, xtol=1e-6)))
    yield from ((2 * b - a, 1) for a, b in zip(*ratios, strict=True))


ANCHORS = {label: function for function, labels in {
    exit_law: "exit-transform exit-moments", spectrum: "exit-eigenvalue",
    state: "state-noise state-noise-time", rate: "state-noise-rate",
}.items() for label in labels.split()}  # fmt: skip
TOLERANCE = {"state-noise-rate": 5e-3}
