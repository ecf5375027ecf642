"""Conclusions of the uniform expansions, of sections 7 and 8 held to what they are about.

`ANCHORS` and `TOLERANCE` as in `anchors_a`. Definitions are the equation of motion, integrals along
paths, roots, a walk in small steps, and for T the exact engine.
"""

from math import ceil, exp, factorial, pi, sqrt

import numpy as np
import sympy
from numpy.polynomial import Polynomial
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, minimize_scalar
from scipy.special import airy, erfc, erfi

import symasym as sa
from symasym.derivation.derivation import build
from tests.derivations.anchors_a import gauss, number, value

FUNCTIONS = {"erfc": erfc, "erfi": erfi} | {
    name: lambda z, k=k: airy(z)[k] for k, name in enumerate(("airyai", "airyaiprime", "airybi", "airybiprime"))
}  # fmt: skip
u, v, t, kappa = (sympy.Symbol(x, real=True) for x in "uvtk")


def steps(e, f, of):
    """An expression with one function put in, and its derivatives worked out."""
    e = e.replace(sympy.Function(f), of)
    return e.replace(sympy.Derivative, lambda *x: sympy.diff(*x))


# -- the friction oscillator -----------------------------------------------------------------------


def oscillator(rng):
    """z'' + z' + z + F(z' + 1) = 0 between the fold and the edge of sliding."""
    mu, alpha, y, u = rng.uniform(1, 4), rng.uniform(0.5, 2), rng.uniform(-1, 1), rng.uniform(-1, 1)
    inside = Polynomial([0, alpha * (1 + mu), 0, -alpha * mu])
    force = lambda x: inside(x) if abs(x) < 1 else alpha * np.sign(x)
    top = minimize_scalar(lambda x: -inside(x), bounds=(0.4, 1), method="bounded", options={"xatol": 1e-12})
    top = brentq(inside.deriv(), top.x - 0.01, top.x + 0.01, xtol=1e-15)
    beta = inside(top)
    z = 1 - alpha - rng.uniform(0.2, 0.8) * (beta - alpha)
    field = lambda x: 1 - z - force(x)  # z'' on the surface, where z' = -1
    third, low, high = sorted((1 - z - inside).roots().real)
    V = lambda x: -gauss(field, -1, x)
    at = {"mu": mu, "alpha": alpha, "z0": z, "z": z, "y": y, "u": u, "F": force, "u1": low, "u2": high,
          "u3": third, "dt": 0.1, "dW": 0.3, "kappa_phys": 0.5,
          "omega": np.arccos((1 - z) / beta) / 3}  # fmt: skip
    slopes, move = [-inside.deriv()(x) for x in (low, high)], -(y - 1) - z - force(y)
    # Where the field on one side of the surface vanishes.
    edges = [brentq(lambda z, s=s: 1 - z - force(2.0 * s), -3, 4) for s in (1, -1)]
    for label, wanted in {
        "eq:osc2": (y - 1, move), "eq:osc3": (0.1 * (y - 1), 0.1 * move + 0.15), "eq:forcePWC": (*edges, -1),
        "eq:forcePerturbed": (force(u),), "turning-points": (top,), "beta": (beta,), "cubic": (field(u),),
        "folds": (1 - beta, 1 + beta), "fr1": (field(2.0), -inside.deriv()(u)), "fr2": slopes,
        "friction-well": (at["omega"], *slopes, V(high) - V(low)),
    }.items():  # fmt: skip
        yield from zip(np.atleast_1d(value(label, at)), wanted, strict=True)
    for label, truth in (("eq:phifric0", field), ("eq:Vfric", V)):
        yield from ((value(label, at | {"u": x})[k], truth(x)) for k, x in enumerate((-1.7, 0.3, 1.6)))
    # Where the logarithm of eps e^(2 D eps/kappa_p^2) is 0.
    D, ell = rng.uniform(0.1, 1), rng.uniform(3, 8)
    power = brentq(lambda x: 2 * D * exp(-ell) * x - ell, 0, 1e6, xtol=1e-9, rtol=1e-14)
    yield value("threshold", {"D": D, "ell": ell, "epsilon": exp(-ell)}), 1 / sqrt(power)


# -- weak noise ------------------------------------------------------------------------------------


def formal(rng):
    """Of lam^-k in int e^{-+lam (p u + q u^2/2)} du about a kink, by u = x/lam; h_(k+1) beside a zero."""
    p, left, right, at = (rng.uniform(*x) for x in ((0.5, 2), (-2, 2), (-2, 2), (0.5, 1)))
    k = int(rng.integers(2, 4))

    def beyond(sign, q):
        """On the ray where it falls."""
        front = sign**k * (-q / 2) ** (k - 1) / factorial(k - 1)
        return front * gauss(lambda x: x ** (2 * k - 2) * np.exp(-p * x), 0, np.inf)

    h = lambda q: [1 / p, -(-q / p**2) / p, 3 * q**2 / p**5][k - 1]  # of phi = p + q u at 0
    known = {"s_k": (-1) ** k, "k": k, "h_k^-": h(left), "h_k^+": h(right), "t": at}
    for step, s in (("scale integral", 1), ("speed integral", -1)):
        yield value("endpoint-series", known, step), beyond(-s, -left) + beyond(s, right)
    zero = build("endpoint-series").right("beside a simple zero of phi").subs(sympy.Function(r"\psi")(t), 1)
    zero = steps(zero.replace(sympy.Function(r"\psi"), lambda x: 3 + right * x), "g", lambda x: p + x)
    slope = (1 - 2 * k) * p * at ** (-2 * k) + (2 - 2 * k) * at ** (1 - 2 * k)  # of (p + t) t^(1 - 2 k)
    yield number(zero, known), -slope / (3 + right * at) * at ** (2 * k)


def by_parts(rng):
    """Two zeros, du/ds a polynomial for which nothing is left after order 1."""
    zeta, L, s = rng.uniform(-1, 1), rng.uniform(2, 5), rng.uniform(0.5, 1.2)
    psi, b = Polynomial([-zeta, 0, 1]), Polynomial([rng.uniform(-1, 1) for _ in range(6)])
    (c0, P0), (c1, P1) = (first := divmod(b, psi)), divmod(first[0].deriv(), psi)
    e = lambda x: np.exp(-L * (x**3 / 3 - zeta * x))
    swept = lambda f, start, x: e(x) * (start + gauss(lambda y: f(y) / e(y), 0, x))
    M = lambda x: swept(b, 0, x)
    n = lambda x: swept(lambda y: P0(y) - P1(y) / L, -c0(0) / L + c1(0) / L**2, x)
    known = {"s": s, "L": L, "e": e, "M": M, "n": n, "b": b, "P_0": P0, "P_1": P1, "c_0": c0, "c_1": c1}
    truth = M(s), gauss(lambda x: e(x) * b(x), 0, s), gauss(lambda x: M(x) * b(x), 0, s)
    yield from zip(value("canonical-form", known), truth, strict=True)


def pair(rng):
    """Over rays past the other zero, double integrals by sums; u' = p + q s, s in units of delta."""
    Z, p, q, delta = (rng.uniform(*x) for x in ((-2, 1.5), (0.5, 1), (-1, 1), (0.1, 1)))
    turn = np.exp(1j * pi / 3)

    def single(sign):
        f = lambda s: delta * (p + sign * q * delta * s) * np.exp(s**3 / 3 - Z * s)
        return sum(gauss(lambda x: (f(-x) + turn * f(turn * x)).real, k, k + 1) for k in range(9))

    tau, m = np.linspace(0.02, 3.4, 1200), np.linspace(-7, 7, 161)
    s, t = m[:, None] / tau - tau**2 / 2, m[:, None] / tau + tau**2 / 2  # ds dt = 2 dm dtau
    weight = np.exp(s**3 / 3 - t**3 / 3 + Z * (t - s)) * 2 * (m[1] - m[0])

    def part(moment, singular):
        """Hadamard's finite part of what grows as singular/tau^2."""
        rest = np.sum(weight * moment, axis=0) - singular / tau**2
        return np.trapezoid(rest, tau) + rest[0] * tau[0] - singular / tau[-1]

    both = delta**2 * (p**2 * part(1, 0) + (q * delta) ** 2 * part(s * t, sqrt(pi)))
    known = FUNCTIONS | {"Z": Z, "p": p, "q": q, "delta": delta}
    yield from zip(value("airy-form", known), (single(-1), single(1), both), strict=True)


def cut_gaussian(rng):
    """u' = p + q s up to an end: nothing is left after the first order. E_1 with p = 1/sqrt(psi_0)."""
    lam, t, p, q = (rng.uniform(*x) for x in ((2, 20), (0.3, 2), (0.5, 2), (-1, 1)))
    bell = lambda x: np.exp(-lam * x**2 / 2)
    dawson = lambda x: bell(x) * gauss(lambda s: 1 / bell(s), 0, x)
    tail = lambda f: sum(gauss(lambda s: f(s) * bell(s) / bell(t), t + k / 2, t + (k + 1) / 2) for k in range(12))
    regular = (2 * p * q * t + q**2 * t**2 / 2) / lam + p**2 * np.log(t) / lam
    bend, D = rng.uniform(1, 3), rng.uniform(0.1, 0.5)
    well = lam * exp(lam * D) * sqrt(2 * pi / (lam * bend)) * bell(t)
    known = {"lam": lam, "kappa": sqrt(2 / lam), "s": t, "p": p, "q": q, "F_D": dawson, r"\psi_0": 1 / p**2}
    yield from zip(value("truncated-gaussian", FUNCTIONS | known | {"V''(u_1)": bend, "D": D}), (
        -tail(lambda s: p + q * s), gauss(lambda s: (p + q * s) * bell(t) / bell(s), 0, t) + q / lam * bell(t),
        gauss(lambda s: (p + q * s) * (p * dawson(s) + q / lam), 0, t) - regular,
        well * (p / (lam * t) - p * tail(lambda s: 1)),
    ), strict=True)  # fmt: skip


def through_the_fold(rng):
    """T of friction with a well and a barrier, on the other side of the fold than the order is measured."""
    z0, kappa = -rng.integers(660, 741) / 1000, 0.1
    centre = value("cubic-pair", {"b": 0, "k": 2 / 3, "w": (1 - z0) * 9 / 16}, "the middle")
    A = Polynomial([1 - z0, -4, 0, 3])(Polynomial([centre, 1]))
    _, rest, psi0, psi1 = A.coef
    square = -rest / psi1
    known = {r"\psi_0": psi0, r"\psi_1": psi1, r"\Delta": square, r"\nu": sqrt(psi0**2 - psi1**2 * square)}
    p2, q2, zeta = (value("cubic-pair", known, step) for step in ("p^2", "q^2", "zeta"))
    # From y = -m to 1 - m past both zeros, on a half circle.
    turn = lambda a: np.exp(1j * a) / 2
    finite = gauss(lambda a: (1j * turn(a) / A(0.5 - centre + turn(a))).real, pi, 0)
    known = {"p": sqrt(p2), "q": sqrt(q2), "Z": (2 / kappa**2) ** (2 / 3) * zeta, "kappa": kappa, "R_0": finite}
    found = value("cubic-pair", FUNCTIONS | known | {"r": 10, "a_plus": -z0})
    yield found, sa.escape_time(sa.friction(mu=3, alpha=1, z0=z0), kappa, 10)


# -- the slow variable moves -----------------------------------------------------------------------


def exit_times(phi, kappa, z, rate):
    """u, T and the variance from there at a slow z, z' = rate: a walk, each step up or down by 1/n."""
    found = []
    for n in (12, 24):
        u, h = np.linspace(-1, 1, 2 * n + 1), 1 / (n * kappa) ** 2
        mean, square = np.zeros((2, u.size))
        for k in reversed(range(ceil(14 / kappa**2 / h))):  # back from a time when all have left
            up = 0.5 + phi(u, z + rate * k * h)[1:-1] / (2 * n * kappa**2)
            first, second = (up * f[2:] + (1 - up) * f[:-2] for f in (mean, square))
            mean[1:-1], square[1:-1] = h + first, h * h + 2 * h * first + second
        found.append((mean[:: n // 12], (square - mean**2)[:: n // 12]))
    return u[::2], *((4 * b - a) / 3 for a, b in zip(*found, strict=True))


def leaving(rng):
    """L of T and of v, by differences of five points."""
    kappa, a, b, c, rate = (rng.uniform(*x) for x in ((0.8, 1.2), (-1, 1), (0.2, 1), (-1, 1), (0.1, 0.5)))
    phi, step, j = (lambda u, z: a + b * z + c * u), 0.05, 12 + rng.integers(-4, 5)
    u, *now = exit_times(phi, kappa, 0.0, rate)
    back, ahead = (exit_times(phi, kappa, z, rate)[1:] for z in (-step, step))
    rise, bend = np.array([1, -8, 0, 8, -1]), np.array([-1, 16, -30, 16, -1])
    mean, spread = (s.right for s in build("release-time").concluded)
    spread = number(spread.replace(sympy.Derivative, lambda *_: rise @ now[0][j - 2 : j + 3]), {"kappa": kappa})
    for k, right in enumerate((mean, spread)):
        row, moved = now[k][j - 2 : j + 3], (ahead[k][j] - back[k][j]) / (2 * step)
        # The variance's may be small.
        yield float(right) - 1, phi(u[j], 0) * (rise @ row) + kappa**2 / 2 * 12 * (bend @ row) + rate * moved - 1


def nudged(rng):
    """The slope of T in eps at 0, phi = a + b z + c eps u, z' = eps g; T_f of a constant drift."""
    kappa, a, b, c, g = (rng.uniform(*x) for x in ((0.8, 1.2), (0.3, 1), (0.2, 1), (0.2, 1), (-1, 1)))
    j, eps = 12 + rng.integers(-4, 5), 0.02
    (u, low, _), (_, high, _) = (
        exit_times(lambda u, z, e=e: a + b * z + c * e * u, kappa, 0.0, e * g) for e in (-eps, eps))  # fmt: skip
    scale = lambda y, drift=a: (1 - sympy.exp(-2 * drift * (y + 1) / kappa**2)) * kappa**2 / (2 * drift)
    still = lambda y, z: (2 * scale(y, a + b * z) / scale(1, a + b * z) - y - 1) / (a + b * z)
    source, green = (s.right for s in build("release-order").concluded)
    source, green = steps(source, "T_f", still), steps(green, "Sigma", scale)
    known = {"g": g, r"\phi_y": c, "z": 0.0, "kappa": kappa, "r": 1.0, "x": float(u[j])}
    found = number(green, known | {"s": lambda y: number(source, known | {"u": y})})
    yield found, (high[j] - low[j]) / (2 * eps)


def waiting(rng):
    """The chance not to have left; slopes in eps of mean and deviation at the rate 1/T, T = T_f e^(lam D)."""
    time, slope, g, eps, lam = *(rng.uniform(*x) for x in ((1, 3), (0.3, 1), (0.5, 1))), 1e-3, 2

    def stays(eps, end):
        t, h = np.linspace(0, end, 100_001, retstep=True)
        rate = np.exp(-lam * slope * eps * g * t) / time
        return t, np.exp(-np.concatenate(([0], np.cumsum((rate[1:] + rate[:-1]) * h / 2))))

    rate = lambda x: np.exp(-lam * slope * g * x) / time
    yield value("release-adiabatic", {"t": 0.9, "k": rate}), stays(1, 0.9)[1][-1]

    def moments(eps):
        t, H = stays(eps, 40 * time)
        mean, square = np.trapezoid(H, t), np.trapezoid(2 * t * H, t)
        return np.array([mean, sqrt(square - mean**2), mean / time - 1])

    def stated(eps):
        known = {"T_f": time, "T_f'": lam * slope * time, "epsilon": eps, "g": g, "kappa": 1}
        sides = [s.right.replace(sympy.Derivative, lambda *_: slope) for s in build("frozen-time").concluded]
        return np.array([number(e, known) for e in sides])

    yield from zip(stated(eps) - stated(-eps), moments(eps) - moments(-eps), strict=True)


def past_fold(rng):
    """The path of w' = w^2 + eps t that comes from the well."""
    eps, t = rng.uniform(0.1, 0.6), rng.uniform(-1, 1)
    begin = -8 / np.cbrt(eps)
    path = solve_ivp(lambda t, w: w**2 + eps * t, (begin, t), [-sqrt(-eps * begin)], rtol=1e-10, atol=1e-12)
    known = FUNCTIONS | {"epsilon": eps, "s": t * np.cbrt(eps)}
    w1 = value("fold-delay", known, "Airy's equation")
    yield value("fold-delay", known | {"w_1": lambda s: w1}, "distance"), path.y[0, -1]
    yield value("fold-delay", known, "time"), t


ANCHORS = {
    label: function
    for function, labels in {
        oscillator: """eq:osc2 eq:osc3 eq:forcePWC eq:forcePerturbed turning-points beta cubic folds fr1 fr2
                       friction-well eq:phifric0 eq:Vfric threshold""",
        formal: "endpoint-series", by_parts: "canonical-form", pair: "airy-form",
        cut_gaussian: "truncated-gaussian", through_the_fold: "cubic-pair",
        leaving: "release-time", nudged: "release-order",
        waiting: "release-adiabatic frozen-time", past_fold: "fold-delay",
    }.items()
    for label in labels.split()
}  # fmt: skip
TOLERANCE = {"airy-form": 1e-4, "cubic-pair": 3e-4, "release-time": 2e-3, "release-order": 1e-3}
TOLERANCE |= {"release-adiabatic": 1e-3, "frozen-time": 1e-3, "fold-delay": 1e-6, "endpoint-series": 1e-6}
