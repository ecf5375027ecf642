"""Conclusions of the uniform expansions and of sections 7 and 8, held to what they are about.

`ANCHORS` and `TOLERANCE` as in `anchors_a`. Definitions are integrals along paths, the equation of
motion, roots, a walk with small steps, the exact engine for T.
"""

from __future__ import annotations

import math
from itertools import pairwise
from random import Random
from typing import Any

import mpmath
import numpy as np
import sympy
from numpy.polynomial import Polynomial

import symasym as sa
from symasym.derivation.derivation import build

MP = mpmath.mp.clone()
MP.dps = 20
Pair = tuple[Any, Any]
NODES = list(zip(*np.polynomial.legendre.leggauss(24), strict=True))


def gauss(f: Any, ends: Any) -> Any:
    """The integral along straight lines from one end to the next, by Gauss-Legendre's rule."""
    total = MP.zero
    for a, b in pairwise(ends):
        count = math.ceil(abs(b - a))
        half = (b - a) / count / 2
        total += half * sum(w * f(a + half * (2 * k + 1 + x)) for k in range(count) for x, w in NODES)
    return total


AIRY = {"airyai": MP.airyai, "airybi": MP.airybi, "erfc": MP.erfc, "erfi": MP.erfi, "sqrt": MP.sqrt, "exp": MP.exp}
AIRY |= {"quad": gauss} | {f"{f}prime": lambda z, f=f: getattr(MP, f)(z, derivative=1) for f in ("airyai", "airybi")}


def number(e: Any, known: dict[str, Any]) -> Any:
    """An expression with numbers and functions put in by name."""
    symbols, functions = list(e.free_symbols), {k: f for k, f in known.items() if callable(f)}
    return sympy.lambdify(symbols, e, [functions | AIRY, "mpmath"])(*(known[s.name] for s in symbols))


def values(label: str, known: dict[str, Any], *steps: str) -> list[Any]:
    """The numbers of what a label concluded, or of some of its steps."""
    d = build(label)
    rights = [d.right(step) for step in steps] or [s.right for s in d.concluded]
    return [number(sympy.sympify(e), known) for e in rights]


def within(rng: Random, low: float, high: float) -> Any:
    return MP.mpf(rng.uniform(low, high))


# -- the friction oscillator -----------------------------------------------------------------------


class Oscillator:
    """z'' + z' + z + F(z' + 1) = 0 between the fold and the edge of sliding."""

    def __init__(self, rng: Random) -> None:
        self.mu, self.alpha, self.y, self.u = (within(rng, *ends) for ends in ((1, 4), (0.5, 2), (-1, 1), (-1, 1)))
        self.u_s = MP.findroot(lambda x: MP.diff(self.force, x), MP.mpf("0.65"))
        self.beta = self.force(self.u_s)
        self.z0 = 1 - self.alpha - within(rng, 0.2, 0.8) * (self.beta - self.alpha)
        roots = Polynomial([1 - self.z0, -self.alpha * (1 + self.mu), 0, self.alpha * self.mu]).trim()
        self.u3, self.u1, self.u2 = sorted(MP.re(x) for x in MP.polyroots([*roots.coef[::-1]]))

    def force(self, x: Any) -> Any:
        return self.alpha * (x + self.mu * (x - x**3) if abs(x) < 1 else MP.sign(x))

    def field(self, x: Any) -> Any:
        """y' on the surface where the force is that at y = eps x: z' = -1, z'' = y'."""
        return -(-1) - self.z0 - self.force(x)

    def V(self, x: Any) -> Any:
        return -gauss(self.field, [-1, *(c for c in (-1, 1) if min(-1, x) < c < max(-1, x)), x])

    def known(self, **more: Any) -> dict[str, Any]:
        return {**vars(self), "F": self.force, "z": self.z0, **more}


def oscillator(label: str) -> Any:
    """Pairs of a conclusion of section 7, each piece where it holds."""

    def pairs(rng: Random) -> list[Pair]:
        o, dt, dW = Oscillator(rng), MP.mpf("0.1"), MP.mpf("0.3")
        move = -(o.y - 1) - o.z0 - o.force(o.y)
        slopes = [MP.diff(o.field, x) for x in (o.u1, o.u2)]
        side = {"u": o.u} if label in ("cubic", "fr1", "eq:forcePerturbed") else {}
        wanted = {
            "eq:osc2": [o.y - 1, move], "eq:osc3": [(o.y - 1) * dt, move * dt + dW / 2],
            # The field on one side of the surface vanishes; on it z' is y - 1 at y = 0.
            "eq:forcePWC": [MP.findroot(lambda z, s=s: 1 - z - s * o.force(MP.mpf(2)), 0) for s in (1, -1)] + [-1],
            "eq:forcePerturbed": [o.force(o.u)], "turning-points": [o.u_s], "beta": [o.beta],
            "cubic": [o.field(o.u)], "folds": [1 - o.beta, 1 + o.beta],
            "fr1": [o.field(MP.mpf(2)), MP.diff(o.field, o.u)], "fr2": slopes,
            "friction-well": [MP.acos((1 - o.z0) / o.beta) / 3, *slopes, o.V(o.u2) - o.V(o.u1)],
        }  # fmt: skip
        known = o.known(dt=dt, dW=dW, kappa_phys=MP.mpf("0.5"), omega=MP.acos((1 - o.z0) / o.beta) / 3, **side)
        return list(zip(values(label, known), wanted[label], strict=True))

    return pairs


def pieces(label: str) -> Any:
    def pairs(rng: Random) -> list[Pair]:
        o, at = Oscillator(rng), [MP.mpf(x) for x in ("-1.7", "0.3", "1.6")]
        truth = o.field if label == "eq:phifric0" else o.V
        return [(values(label, o.known(u=x))[k], truth(x)) for k, x in enumerate(at)]

    return pairs


def threshold(rng: Random) -> list[Pair]:
    D, ell = within(rng, 0.1, 1), within(rng, 3, 8)
    # Where the logarithm of eps e^(2 D eps/kappa_p^2) is 0.
    power = MP.findroot(lambda x: 2 * D * MP.exp(-ell) * x - ell, 1)
    return [(values("threshold", {"D": D, "ell": ell, "epsilon": MP.exp(-ell)})[0], 1 / MP.sqrt(power))]


# -- weak noise ------------------------------------------------------------------------------------


def formal(rng: Random) -> list[Pair]:
    """Of lam^-k in int e^{-+lam (p u + q u^2/2)} du about a kink, by u = x/lam; h_(k+1) beside a zero."""
    p, left, right, at = (within(rng, *ends) for ends in ((0.5, 2), (-2, 2), (-2, 2), (0.5, 1)))
    k = rng.randint(1, 3)

    def beyond(sign: int, q: Any) -> Any:
        """On the ray where it falls."""
        front = sign**k * (-q / 2) ** (k - 1) / MP.factorial(k - 1)
        return front * gauss(lambda x: x ** (2 * k - 2) * MP.exp(-p * x), [0, 90 / p])

    def h(order: int, u: Any, q: Any) -> Any:
        phi = p + q * u
        return 1 / phi if order == 1 else -MP.diff(lambda x: h(order - 1, x, q), u) / phi

    known = {"s_k": (-1) ** k, "k": k, "h_k^-": h(k, 0, left), "h_k^+": h(k, 0, right), "t": at}
    wanted = [beyond(-s, -left) + beyond(s, right) for s in (1, -1)]
    g, psi = (lambda u: sympy.Float(p, 20) + u), (lambda u: 3 + sympy.Float(right, 20) * u)
    zero = build("endpoint-series").right("beside a simple zero of phi").replace(sympy.Function("g"), g)
    zero = number(zero.replace(sympy.Function("\\psi"), psi).doit(), known)
    wanted.append(-MP.diff(lambda u: (p + u) * u ** (1 - 2 * k), at) / (3 + right * at) * at ** (2 * k))
    return list(zip([*values("endpoint-series", known, "of exp(lam V)", "of exp(-lam V)"), zero], wanted, strict=True))


def by_parts(rng: Random) -> list[Pair]:
    """Two zeros, du/ds a polynomial for which nothing is left after order 1: by quadrature."""
    zeta, L, s = within(rng, -1, 1), within(rng, 2, 5), within(rng, 0.5, 1.2)
    psi, b = Polynomial([-zeta, 0, 1]), Polynomial([within(rng, -1, 1) for _ in range(6)])
    (c0, P0), (c1, P1) = (first := divmod(b, psi)), divmod(first[0].deriv(), psi)
    e = lambda x: MP.exp(-L * (x**3 / 3 - zeta * x))
    swept = lambda f, start, x: e(x) * (start + gauss(lambda y: f(y) / e(y), [0, x]))
    M = lambda x: swept(b, 0, x)
    n = lambda x: swept(lambda y: P0(y) - P1(y) / L, -c0(0) / L + c1(0) / L**2, x)
    known = {"s": s, "L": L, "e": e, "M": M, "n": n, "b": b, "P_0": P0, "P_1": P1, "c_0": c0, "c_1": c1}
    truth = [M(s), gauss(lambda x: e(x) * b(x), [0, s]), gauss(lambda x: M(x) * b(x), [0, s])]
    return list(zip(values("canonical-form", known), truth, strict=True))


def airy(rng: Random) -> list[Pair]:
    """Along the rays past the other zero, and double integrals by sums; u' = p + q s, s in units of delta."""
    Z, p, q, delta = (within(rng, *ends) for ends in ((-2, 1.5), (0.5, 1), (-1, 1), (0.1, 1)))
    rays = [-9, 0, 9 * MP.expjpi(MP.one / 3)]
    single = lambda sign: MP.re(gauss(
        lambda s: delta * (p + sign * q * delta * s) * MP.exp(s**3 / 3 - Z * s), rays))  # fmt: skip
    tau, m = np.linspace(0.02, 3.4, 1200), np.linspace(-7, 7, 161)
    s, t = m[:, None] / tau - tau**2 / 2, m[:, None] / tau + tau**2 / 2  # ds dt = 2 dm dtau
    weight = np.exp(s**3 / 3 - t**3 / 3 + float(Z) * (t - s)) * 2 * (m[1] - m[0])

    def part(moment: Any, singular: float) -> Any:
        """Hadamard's finite part of what grows as singular/tau^2."""
        rest = np.sum(weight * moment, axis=0) - singular / tau**2
        return np.trapezoid(rest, tau) + rest[0] * tau[0] - singular / tau[-1]

    both = delta**2 * (p**2 * part(1, 0) + (q * delta) ** 2 * part(s * t, np.sqrt(np.pi)))
    known = {"Z": Z, "p": p, "q": q, "delta": delta}
    return list(zip(values("airy-form", known), (single(-1), single(1), both), strict=True))


def cut_gaussian(rng: Random) -> list[Pair]:
    """u' = p + q s up to an end: nothing is left after the first order. E_1 with p = 1/sqrt(psi_0)."""
    lam, t, p, q = (within(rng, *ends) for ends in ((2, 20), (0.3, 2), (0.5, 2), (-1, 1)))
    bell = lambda x: MP.exp(-lam * x**2 / 2)
    dawson = lambda x: bell(x) * gauss(lambda s: 1 / bell(s), [0, x])
    tail = lambda f: gauss(lambda s: f(s) * bell(s) / bell(t), [t, t + 8])
    down = gauss(lambda s: (p + q * s) * bell(t) / bell(s), [0, t]) + q / lam * bell(t)
    regular = (2 * p * q * t + q**2 * t**2 / 2) / lam + p**2 * MP.log(t) / lam
    both = gauss(lambda s: (p + q * s) * (p * dawson(s) + q / lam), [0, t]) - regular
    bend, D = within(rng, 1, 3), within(rng, 0.1, 0.5)
    well = lam * MP.exp(lam * D) * MP.sqrt(2 * MP.pi / (lam * bend)) * bell(t) * (p / (lam * t) - p * tail(lambda _: 1))
    known = {"lam": lam, "kappa": MP.sqrt(2 / lam), "s": t, "p": p, "q": q, "F_D": dawson, "\\psi_0": 1 / p**2,
             "V''(u_1)": bend, "D": D}  # fmt: skip
    return list(zip(values("truncated-gaussian", known), (-tail(lambda s: p + q * s), down, both, well), strict=True))


def through_the_fold(rng: Random) -> list[Pair]:
    """T of friction with a well, on the fold's other side than where the order is measured: the exact engine."""
    z0, kappa = -rng.randint(660, 740) / 1000, 0.1
    third = {"b": 0, "k": MP.mpf(2) / 3, "w": (1 - MP.mpf(z0)) * 9 / 16}
    centre = values("cubic-pair", third, "the middle")[0]
    # A = (y^2 - D)(psi0 + psi1 y), from its derivatives at the middle.
    A = lambda y: 1 - z0 - 4 * (centre + y) + 3 * (centre + y) ** 3
    psi0, psi1 = MP.diff(A, 0, 2) / 2, MP.diff(A, 0, 3) / 6
    square = -MP.diff(A, 0) / psi1
    known = {"\\psi_0": psi0, "\\psi_1": psi1, "\\Delta": square, "\\nu": MP.sqrt(psi0**2 - psi1**2 * square)}
    p2, q2, zeta = values("cubic-pair", known, "p^2", "q^2", "zeta")
    path = [-centre, -centre + 1j, 1 - centre + 1j, 1 - centre]
    finite = MP.re(gauss(lambda y: 1 / A(y), path))  # past both zeros, where it is Hadamard's
    known = {"p": MP.sqrt(p2), "q": MP.sqrt(q2), "Z": MP.cbrt(4 / kappa**4) * zeta, "kappa": kappa, "R_0": finite}
    found = values("cubic-pair", known | {"r": 10, "a_plus": -z0})
    return [(found[0], sa.escape_time(sa.friction(mu=3, alpha=1, z0=z0), kappa, 10)), (A(0), -square * psi0)]


# -- the slow variable moves -----------------------------------------------------------------------


def walk(phi: Any, kappa: float, z: float, rate: float, n: int) -> Any:
    """u, and mean time and mean square to leave (-1, 1) from there at a slow z, z' = rate.

    Du = 1/n up or down each Du^2/kappa^2, back from a time when all have left.
    """
    u, h = np.linspace(-1, 1, 2 * n + 1), 1 / (n * kappa) ** 2
    mean, square = np.zeros((2, u.size))
    for k in reversed(range(round(14 / kappa**2 / h))):
        up = 0.5 + phi(u, z + rate * k * h)[1:-1] / (2 * n * kappa**2)
        first, second = (up * f[2:] + (1 - up) * f[:-2] for f in (mean, square))
        mean[1:-1], square[1:-1] = h + first, h * h + 2 * h * first + second
    return u, mean, square - mean**2


def exit_times(phi: Any, kappa: float, z: float, rate: float) -> Any:
    """u, T and v there, the error of the step extrapolated; 12 places to a unit."""
    (u, *coarse), (_, *fine) = (walk(phi, kappa, z, rate, n) for n in (12, 24))
    return u, *((4 * b[::2] - a) / 3 for a, b in zip(coarse, fine, strict=True))


def leaving(rng: Random) -> list[Pair]:
    """L of T and of v, their derivatives by differences of five points."""
    kappa, a, b, c, rate = (rng.uniform(*ends) for ends in ((0.8, 1.2), (-1, 1), (0.2, 1), (-1, 1), (0.1, 0.5)))
    phi, step, j = (lambda u, z: a + b * z + c * u), 0.05, 12 + rng.randint(-4, 4)
    u, *now = exit_times(phi, kappa, 0.0, rate)
    near = [exit_times(phi, kappa, k * step, rate)[1:] for k in (-1, 1)]
    rise, bend = np.array([1, -8, 0, 8, -1]), np.array([-1, 16, -30, 16, -1])
    pairs, slope = [], {}
    for k, f in enumerate(now):
        row = f[j - 2 : j + 3]
        slope[k] = rise @ row
        moved = (near[1][k][j] - near[0][k][j]) / (2 * step)
        pairs.append(phi(u[j], 0) * slope[k] + kappa**2 / 2 * 12 * bend @ row + rate * moved)
    mean, spread = (s.right for s in build("release-time").concluded)
    spread = spread.replace(sympy.Derivative, lambda *_: sympy.Float(slope[0]))
    return list(zip([float(mean), number(spread, {"kappa": kappa})], pairs, strict=True))


def nudged(rng: Random) -> list[Pair]:
    """The slope of T in eps at 0, phi = a + b z + c eps u, z' = eps g; T_f of a constant drift."""
    kappa, a, b, c, g = (rng.uniform(*ends) for ends in ((0.8, 1.2), (0.3, 1), (0.2, 1), (0.2, 1), (-1, 1)))
    j, eps = 12 + rng.randint(-4, 4), 0.02
    times = [exit_times(lambda u, z, e=e: a + b * z + c * e * u, kappa, 0.0, e * g)[:2] for e in (-eps, eps)]
    x, r = float(times[0][0][j]), sympy.Integer(1)
    scale = lambda y, drift=a: (1 - sympy.exp(-2 * drift * (y + r) / kappa**2)) * kappa**2 / (2 * drift)
    still = lambda y, z: (2 * scale(y, a + b * z) / scale(r, a + b * z) - y - 1) / (a + b * z)
    source, green = (s.right for s in build("release-order").concluded)
    known = {"g": g, "\\phi_y": c, "z": 0.0, "kappa": kappa, "r": 1.0, "x": x}
    worked = lambda e, f, of: e.replace(sympy.Function(f), of).replace(sympy.Derivative, lambda *x: sympy.diff(*x))
    source, green = worked(source, "T_f", still), worked(green, "Sigma", scale)
    s = lambda y: number(source, known | {"u": y})
    return [(number(green, known | {"s": s}), (times[1][1][j] - times[0][1][j]) / (2 * eps))]


def held(rng: Random) -> list[Pair]:
    """The chance not to have left: those of short times multiplied."""
    start, bend, end = (rng.uniform(low, 2) for low in (0.2, -0.1, 0.5))
    t, rate = np.linspace(0, end, 20_001), lambda x: start + bend * x**2
    half = rate((t[1:] + t[:-1]) / 2) * end / 40_000
    return [(values("release-adiabatic", {"t": end, "k": rate})[0], np.prod((1 - half) / (1 + half)))]


def waiting(rng: Random) -> list[Pair]:
    """Slopes in eps of the mean and deviation of the time of leaving at the rate 1/T, T = T_f e^(lam D)."""
    time, slope, g, eps, lam = *(rng.uniform(*ends) for ends in ((1, 3), (0.3, 1), (0.5, 1))), 1e-3, 2

    def moments(eps: float) -> Any:
        t, h = np.linspace(0, 40 * time, 100_001, retstep=True)
        rate = np.exp(-lam * slope * eps * g * t) / time
        stays = np.exp(-np.concatenate(([0], np.cumsum((rate[1:] + rate[:-1]) * h / 2))))
        mean, square = np.trapezoid(stays, t), np.trapezoid(2 * t * stays, t)
        return np.array([mean, np.sqrt(square - mean**2), mean / time - 1])

    d = build("frozen-time")
    share = d.right("share").replace(sympy.Derivative, lambda *_: sympy.Float(slope))

    def stated(eps: float) -> Any:
        known = {"T_f": time, "T_f'": lam * slope * time, "epsilon": eps, "g": g, "kappa": 1}
        return np.array([*values("frozen-time", known, "mean", "standard deviation"), number(share, known)])

    return list(zip(stated(eps) - stated(-eps), moments(eps) - moments(-eps), strict=True))


def past_fold(rng: Random) -> list[Pair]:
    """The path of w' = w^2 + eps t that comes from the well, w = w(eps t, ...), by Taylor's method."""
    eps, t = within(rng, 0.1, 0.6), within(rng, -1, 1)
    begin = -8 / MP.cbrt(eps)
    w = mpmath.odefun(lambda t, w: w**2 + float(eps) * t, float(begin), -math.sqrt(-eps * begin))(float(t))
    s = t * MP.cbrt(eps)
    known = {"epsilon": eps, "s": s}
    w1 = values("fold-delay", known, "Airy's equation")[0]
    return list(zip(values("fold-delay", known | {"w_1": lambda _: w1}, "distance", "time"), (w, t), strict=True))


FRICTION = """eq:osc2 eq:osc3 eq:forcePWC eq:forcePerturbed turning-points beta cubic folds fr1 fr2 friction-well"""
ANCHORS = {label: oscillator(label) for label in FRICTION.split()} | {
    "eq:phifric0": pieces("eq:phifric0"), "eq:Vfric": pieces("eq:Vfric"), "threshold": threshold,
    "endpoint-series": formal, "canonical-form": by_parts, "airy-form": airy, "truncated-gaussian": cut_gaussian,
    "cubic-pair": through_the_fold, "release-time": leaving, "release-order": nudged, "release-adiabatic": held,
    "frozen-time": waiting, "fold-delay": past_fold,
}  # fmt: skip
TOLERANCE = {"airy-form": 1e-4, "cubic-pair": 3e-4, "release-time": 2e-3, "release-order": 1e-3, "release-adiabatic": 1e-6,
             "frozen-time": 1e-3, "fold-delay": 1e-6}  # fmt: skip
