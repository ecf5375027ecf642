"""Conclusions of the uniform expansions and sections 7, 8; the tables are as in `anchors_exit`.

Held to the equation of motion, integrals along paths, roots, a walk in small steps, and T to the
exact engine.
"""
# ruff: noqa: E501, E731

from math import ceil, exp, pi, sqrt

import numpy as np
import sympy
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import airy, erfc, erfi

import symasym as sa
from symasym.derivation.derivation import build
from tests.derivations.anchors_exit import gauss, number, value

AIRY = "airyai", "airyaiprime", "airybi", "airybiprime"
FUNCTIONS = {f: lambda z, k=k: airy(z)[k] for k, f in enumerate(AIRY)} | {"erfc": erfc, "erfi": erfi}


def oscillator(rng):
    """z'' + z' + z + F(z' + 1) = 0 between the fold and the edge of sliding."""
    mu, alpha, y, u = rng.uniform((1, 0.5, -1, -1), (4, 2, 1, 1))
    inside = Polynomial([0, alpha * (1 + mu), 0, -alpha * mu])
    force = lambda x: inside(x) if abs(x) < 1 else alpha * np.sign(x)
    top = max(inside.deriv().roots().real)
    z = 1 - alpha - rng.uniform(0.2, 0.8) * ((beta := inside(top)) - alpha)
    field = lambda x: 1 - z - force(x)  # z'' on the surface, where z' = -1
    V = lambda x: -gauss(field, -1, x)
    third, low, high = sorted((1 - z - inside).roots().real)
    angle, D, ell = np.arccos((1 - z) / beta) / 3, V(high) - V(low), rng.uniform(3, 8)
    at = {"mu": mu, "alpha": alpha, "z0": z, "z": z, "y": y, "u": u, "F": force, "u1": low, "u2": high}
    at |= {"u3": third, "omega": angle, "D": D, "ell": ell, "epsilon": exp(-ell), "kappa_phys": 0.5}
    slopes, move = [-inside.deriv()(x) for x in (low, high)], -(y - 1) - z - force(y)
    power = brentq(lambda x: 2 * D * exp(-ell) * x - ell, 0, 1e9, rtol=1e-14)  # 1/kappa_c^2
    for label, wanted in {
        "eq:osc2": (y - 1, move), "eq:osc3": ((y - 1) / 9, move / 9 + 0.15), "turning-points": top,
        "eq:forcePWC": (1 - force(9), 1 - force(-9), -1), "eq:forcePerturbed": force(u), "beta": beta,
        "cubic": field(u), "folds": (1 - beta, 1 + beta), "fr1": (field(9), -inside.deriv()(u)),
        "fr2": slopes, "friction-well": (angle, *slopes, D), "threshold": power**-0.5,
    }.items():  # fmt: skip
        found = value(label, at | {"dt": 1 / 9, "dW": 0.3})
        yield from zip(np.atleast_1d(found), np.atleast_1d(wanted), strict=True)
    for label, truth in (("eq:phifric0", field), ("eq:Vfric", V)):
        yield from ((value(label, at | {"u": x})[k], truth(x)) for k, x in enumerate((-1.7, 0.3, 1.6)))


def formal(rng):
    """Of lam^-2 in int e^{-+lam (p u + q u^2/2)} du about a kink, by u = x/lam; h_3 beside a zero."""
    p, left, right, at = rng.uniform((0.5, -2, -2, 0.5), (2, 2, 2, 1))
    both = (left - right) / 2 * gauss(lambda x: x**2 * np.exp(-p * x), 0, np.inf)
    known = {"s_k": 1, "k": 2, "h_k^-": left / p**3, "h_k^+": right / p**3, "t": at}  # phi = p + q u
    zero = build("endpoint-series").right("beside a simple zero of phi")
    for f, of in (("g", lambda x: p + x), (r"\psi", lambda x: 3 + x)):
        zero = zero.replace(sympy.Function(f), of)
    third = (3 * p * at**-4 + 2 * at**-3) / (at * (3 + at))  # of (p + t) t^-3
    yield from ((value("endpoint-series", known, f"{x} integral"), both) for x in ("scale", "speed"))
    yield number(zero.doit(), known), third * at**5


def by_parts(rng):
    """Two zeros, du/ds a polynomial for which nothing is left after order 1."""
    zeta, L, s = rng.uniform((-1, 2, 0.5), (1, 5, 1.2))
    psi, b = Polynomial([-zeta, 0, 1]), Polynomial(rng.uniform(-1, 1, 6))
    (c0, P0), (c1, P1) = (first := divmod(b, psi)), divmod(first[0].deriv(), psi)
    e = lambda x: np.exp(-L * (x**3 / 3 - zeta * x))
    swept = lambda f, start, x: e(x) * (start + gauss(lambda y: f(y) / e(y), 0, x))
    M = lambda x: swept(b, 0, x)
    n = lambda x: swept(lambda y: P0(y) - P1(y) / L, -c0(0) / L + c1(0) / L**2, x)
    known = {"s": s, "L": L, "e": e, "M": M, "n": n, "b": b, "P_0": P0, "P_1": P1, "c_0": c0, "c_1": c1}
    truth = M(s), gauss(lambda x: e(x) * b(x), 0, s), gauss(lambda x: M(x) * b(x), 0, s)
    yield from zip(value("canonical-form", known), truth, strict=True)


def pair(rng):
    """Over rays past the other zero; double integrals by sums, with Hadamard's finite part."""
    Z, p, q, delta = rng.uniform((-2, 0.5, -1, 0.1), (1.5, 1, 1, 1))
    turn, known = np.exp(1j * pi / 3), FUNCTIONS | {"Z": Z, "p": p, "q": q, "delta": delta}
    *singles, double = value("airy-form", known)
    for sign, found in zip((-1, 1), singles, strict=True):
        f = lambda s, c=sign * q * delta: delta * (p + c * s) * np.exp(s**3 / 3 - Z * s)
        rays = lambda x, f=f: (f(-x) + turn * f(turn * x)).real
        yield found, sum(gauss(rays, k, k + 1) for k in range(9))
    tau, m = np.linspace(0.02, 3.4, 1200), np.linspace(-7, 7, 161)
    s, t = m[:, None] / tau - tau**2 / 2, m[:, None] / tau + tau**2 / 2  # ds dt = 2 dm dtau
    weight = (p + q * delta * s) * (p + q * delta * t) * np.exp(s**3 / 3 - t**3 / 3 + Z * (t - s))
    grows = (q * delta) ** 2 * sqrt(pi)  # as this over tau^2
    rest = np.sum(weight, axis=0) * 2 * (m[1] - m[0]) - grows / tau**2
    yield double, delta**2 * (np.trapezoid(rest, tau) + rest[0] * tau[0] - grows / tau[-1])


def cut_gaussian(rng):
    """u' = p + q s up to an end: nothing is left after the first order. E_1 with p = 1/sqrt(psi_0)."""
    lam, t, p, q, bend, D = rng.uniform((2, 0.3, 0.5, -1, 1, 0.1), (20, 2, 2, 1, 3, 0.5))
    bell = lambda x: np.exp(-lam * x**2 / 2)
    dawson = lambda x: bell(x) * gauss(lambda s: 1 / bell(s), 0, x)
    tail = lambda f: sum(gauss(lambda s: f(s) * bell(s), t + k / 2, t + k / 2 + 0.5) for k in range(12))
    known = {"lam": lam, "kappa": sqrt(2 / lam), "s": t, "p": p, "q": q, "D": D, "V''(u_1)": bend}
    up, down, both, end = value("truncated-gaussian", FUNCTIONS | known | {"F_D": dawson, r"\psi_0": p**-2})
    yield up, -tail(lambda s: p + q * s) / bell(t)
    yield down, gauss(lambda s: (p + q * s) * bell(t) / bell(s), 0, t) + q / lam * bell(t)
    regular = (2 * p * q * t + q**2 * t**2 / 2 + p**2 * np.log(t)) / lam
    yield both, gauss(lambda s: (p + q * s) * (p * dawson(s) + q / lam), 0, t) - regular
    well = lam * exp(lam * D) * sqrt(2 * pi / (lam * bend))
    yield end, well * (p / (lam * t) * bell(t) - p * tail(lambda s: 1))


def through_the_fold(rng):
    """T of friction with a well and a barrier: its order is measured on the fold's other side."""
    z0, kappa = rng.uniform(-0.74, -0.66), 0.1
    centre = value("cubic-pair", {"b": 0, "k": 2 / 3, "w": (1 - z0) * 9 / 16}, "the middle")
    A = Polynomial([1 - z0, -4, 0, 3])(Polynomial([centre, 1]))
    _, rest, psi0, psi1 = A.coef
    known = {r"\psi_0": psi0, r"\psi_1": psi1, r"\Delta": -rest / psi1, r"\nu": sqrt(psi0**2 + psi1 * rest)}
    p2, q2, zeta = (value("cubic-pair", known, step) for step in ("p^2", "q^2", "zeta"))
    turn = lambda a: np.exp(1j * a) / 2  # from y = -m to 1 - m past both zeros
    finite = gauss(lambda a: (1j * turn(a) / A(0.5 - centre + turn(a))).real, pi, 0)
    known = {"p": sqrt(p2), "q": sqrt(q2), "Z": (2 / kappa**2) ** (2 / 3) * zeta, "kappa": kappa}
    found = value("cubic-pair", FUNCTIONS | known | {"R_0": finite, "r": 10, "a_plus": -z0})
    yield found, sa.escape_time(sa.friction(mu=3, alpha=1, z0=z0), kappa, 10)


def exit_times(phi, kappa, rate=0):
    """u, T and the variance from there at z = 0, z' = rate: a walk, each step up or down by 1/n."""
    found = []
    for n in (12, 24):
        u, h = np.linspace(-1, 1, 2 * n + 1), 1 / (n * kappa) ** 2
        mean, square = np.zeros((2, u.size))
        for k in reversed(range(ceil(14 / kappa**2 / h))):  # back from a time when all have left
            up = 0.5 + phi(u, rate * k * h)[1:-1] / (2 * n * kappa**2)
            first, second = (up * f[2:] + (1 - up) * f[:-2] for f in (mean, square))
            mean[1:-1], square[1:-1] = h + first, h * h + 2 * h * first + second
        found.append((mean[:: n // 12], (square - mean**2)[:: n // 12]))
    return u[::2], *((4 * b - a) / 3 for a, b in zip(*found, strict=True))


def leaving(rng):
    """L of T and of v, where z rests; the slope of T in eps, phi = a + b z + c eps u, z' = eps g."""
    kappa, a, b, c, g, j, eps = *rng.uniform((0.8, 0.3, 0.2, 0.2, 0.3), (1.2, 1, 1, 1, 1)), 16, 0.02
    u, *times = exit_times(lambda u, z: a + c * u, kappa)
    bend, rise = (np.array(x) @ np.transpose([f[14:19] for f in times]) for x in (
        [-12, 192, -360, 192, -12], [1, -8, 0, 8, -1]))  # fmt: skip
    mean, spread = (s.right for s in build("release-time").concluded)
    spread = number(spread.replace(sympy.Derivative, lambda *_: rise[0]), {"kappa": kappa})
    yield from zip((mean, spread), (a + c * u[j]) * rise + kappa**2 / 2 * bend, strict=True)
    phi = lambda e: lambda u, z: a + b * z + c * e * u
    low, high = (exit_times(phi(e), kappa, e * g)[1][j] for e in (-eps, eps))
    scale = lambda y, a=a: (1 - sympy.exp(-2 * a * (y + 1) / kappa**2)) / a
    still = lambda y, z: (2 * scale(y, a + b * z) / scale(1, a + b * z) - y - 1) / (a + b * z)
    source, green = (s.right.replace(sympy.Function(f), of).replace(
        sympy.Derivative, lambda *x: sympy.diff(*x)) for f, of, s in zip(
            ("T_f", "Sigma"), (still, scale), build("release-order").concluded, strict=True))  # fmt: skip
    known = {"g": g, r"\phi_y": c, "z": 0.0, "kappa": kappa, "r": 1.0, "x": float(u[j])}
    yield number(green, known | {"s": lambda y: number(source, known | {"u": y})}), (high - low) / (2 * eps)


def waiting(rng):
    """Slopes in eps of mean and deviation of the time of leaving at the rate 1/T, T = T_f e^(c t)."""
    T, slope, g, eps = *rng.uniform((1, 0.3, 0.5), (3, 1, 1)), 1e-3
    stays = lambda t, c: np.exp(np.expm1(-c * t) / (c * T))

    def stated(eps):
        known = {"T_f": T, "T_f'": 2 * slope * T, "epsilon": eps, "g": g, "kappa": 1}  # lam = 2
        sides = (s.right.replace(sympy.Derivative, lambda *_: slope) for s in build("frozen-time").concluded)
        return np.array([number(e, known) for e in sides])

    def moments(c):
        first, square = (sum(gauss(lambda t, w=w: w(t) * stays(t, c), k, k + 1) for k in range(ceil(40 * T)))
                         for w in (lambda t: 1, lambda t: 2 * t))  # fmt: skip
        return np.array([first, sqrt(square - first**2), first / T - 1])

    c = 2 * slope * g * eps
    yield from zip(stated(eps) - stated(-eps), moments(c) - moments(-c), strict=True)
    yield value("release-adiabatic", {"t": 0.9, "k": lambda x: np.exp(-c * x) / T}), stays(0.9, c)


def past_fold(rng):
    """The path of w' = w^2 + eps t that comes from the well."""
    eps, t = rng.uniform((0.1, -1), (0.6, 1))
    begin, known = -8 / np.cbrt(eps), FUNCTIONS | {"epsilon": eps, "s": t * np.cbrt(eps)}
    path = solve_ivp(lambda t, w: w**2 + eps * t, (begin, t), [-sqrt(-eps * begin)], rtol=1e-10, atol=1e-12)
    known["w_1"] = lambda _: value("fold-delay", known, "Airy's equation")
    yield from zip((value("fold-delay", known, x) for x in ("distance", "time")), (path.y[0, -1], t), strict=True)


ANCHORS = {
    label: function
    for function, labels in {
        oscillator: "eq:osc2 eq:osc3 eq:forcePWC eq:forcePerturbed turning-points beta cubic folds fr1 fr2 "
                    "friction-well eq:phifric0 eq:Vfric threshold",
        formal: "endpoint-series", by_parts: "canonical-form", pair: "airy-form",
        cut_gaussian: "truncated-gaussian", through_the_fold: "cubic-pair", past_fold: "fold-delay",
        leaving: "release-time release-order", waiting: "release-adiabatic frozen-time",
    }.items()
    for label in labels.split()
}  # fmt: skip
TOLERANCE = {"airy-form": 1e-4, "cubic-pair": 3e-4, "release-time": 2e-3, "release-order": 2e-3, "fold-delay": 1e-6}
TOLERANCE |= {"release-adiabatic": 1e-3, "frozen-time": 1e-3, "endpoint-series": 1e-6}
