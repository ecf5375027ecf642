"""Random scenes with their numbers by name, as the derivations' symbols are called.

Each number is worked out from a definition (`tests.derivations.definitions`) or by a plain sum,
when it is asked for.
The functions of the last part give a scene that moves with a parameter to a limit.
"""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Iterator, Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from tests.derivations.definitions import CTX, Drift, Scene, gauss, of_fraction, roots, taylor


class Numbers(Mapping[str, Any]):
    """Numbers and functions by the names of symbols, each worked out when it is asked for."""

    def __init__(self, **known: Any) -> None:
        self._known = known
        self._done: dict[str, Any] = {}

    def __getitem__(self, name: str) -> Any:
        if name not in self._done:
            self._done[name] = self._known[name]()
        return self._done[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._known)

    def __len__(self) -> int:
        return len(self._known)


# -- random scenes --------------------------------------------------------------------------

Draw = Callable[[random.Random], Any]


def within(rng: random.Random, low: str, high: str) -> Fraction:
    return Fraction(low) + (Fraction(high) - Fraction(low)) * Fraction(rng.randint(1, 98), 99)


def _polynomial(rng: random.Random, right: int) -> Drift:
    """A cubic with a- > 0 and a+ of the sign `right`, as it likes between them."""
    am, ap = within(rng, "0.2", "1.5"), right * within(rng, "0.3", "2")
    b, c = within(rng, "-2", "2"), within(rng, "-2", "2")
    # (1 - u^2)(b + c u) vanishes at both ends.
    line = (am + ap) / 2, (ap - am) / 2
    return Drift.layer((line[0] + b, line[1] + c, -b, -c))


def _well(rng: random.Random) -> Drift:
    """A well in (-0.7, -0.3) and a barrier in (0.4, 0.7), crossing to the right."""
    low, high = within(rng, "-0.7", "-0.3"), within(rng, "0.4", "0.7")
    scale, third = within(rng, "1", "1.6"), within(rng, "1.4", "2")
    found = np.polynomial.polynomial.polyfromroots([low, high, -third])
    return Drift.layer([scale * c for c in found])


def _bowl(rng: random.Random, bend: Fraction | None = None) -> Drift:
    """One well in (-0.3, 0.3), sliding; its drift bends as `bend` says."""
    low, scale = within(rng, "-0.3", "0.3"), within(rng, "0.5", "1")
    first = within(rng, "-0.2", "0.2") if bend is None else bend
    inner = (Fraction(1), first, *(within(rng, "-0.2", "0.2") for _ in range(3)))
    shifted = [scale * low * c for c in (*inner, 0)]
    return Drift.layer([a - scale * b for a, b in zip(shifted, (0, *inner), strict=True)])


def numbers(scene: Scene, **more: Any) -> Numbers:
    """Numbers of a scene, by the names that the derivations give them."""
    drift, lam = scene.drift, scene.lam
    edge = of_fraction(drift.edges[-1])

    def phi(u: Any) -> Any:
        found = drift.numpy(u if isinstance(u, np.ndarray) else float(u))
        return CTX.mpf(float(found)) if isinstance(u, CTX.mpf) else found

    def numpy_potential(u: Any) -> Any:
        if isinstance(u, CTX.mpf):
            return drift.potential(u)
        # V' = -phi and V(-1) = 0, by the rule itself.
        return -gauss(drift.numpy, -1.0, u, panels=1)

    def critical(place: int, derivative: int) -> Callable[[], Any]:
        return lambda: taylor(drift, roots(drift)[place], derivative + 1)[derivative]

    def piece(start: int, to: Any, source: int) -> Callable[[], Any]:
        """Mean time spent left of `start`, or right of it, on the way from it to `to`."""

        def work() -> Any:
            if source:
                return scene.time_from_wall(-1 if start == 0 else 1, start, to)
            at, _ = drift.slope(lam, -CTX.mpf(scene.r), CTX.mpf(2 * start - 1), 0, 1)
            if start == 0:
                at, _ = drift.slope(lam, CTX.mpf(-1), CTX.zero, at, 0)
            return -drift.slope(lam, CTX.mpf(start), CTX.mpf(to), at, 0)[1]

        return work

    def up(u: Any) -> Any:
        return np.exp(float(lam) * numpy_potential(u))

    def down(u: Any) -> Any:
        return np.exp(-float(lam) * numpy_potential(u))

    def scale(x: float) -> float:
        return gauss(up, -float(scene.r), x)

    def spent(x: float, end: float) -> Any:
        """w of docs/exact.md between `end` and x, and sigma there."""
        from_end = gauss(up, end, x)
        times = gauss(lambda u: down(u) * gauss(up, end, u), end, x)
        return float(lam) * up(x) * times / from_end, abs(from_end / up(x))

    known = {
        "kappa": lambda: CTX.mpf(scene.kappa),
        "lam": lambda: lam,
        "r": lambda: CTX.mpf(scene.r),
        "a_minus": lambda: of_fraction(drift.fields[0][0]),
        "a_plus": lambda: of_fraction(drift.fields[-1][0]),
        "phi": lambda: phi,
        "A": lambda: phi,
        "V": lambda: numpy_potential,
        "V_1": lambda: drift.potential(edge),
        "V_top": lambda: drift.potential(edge),
        "V_0": lambda: drift.potential(0),
        # Leaving.
        "T": lambda: scene.T,
        "C": lambda: scene.C,
        "R": lambda: scene.R,
        "T_0": lambda: scene.time_from_wall(-scene.r, 0, scene.r),
        "T_1": piece(0, 1, 0),
        "T_2": piece(0, 1, 1),
        "T_3": piece(1, scene.r, 0),
        "T_4": piece(1, scene.r, 1),
        "I1": lambda: scene.sides[2],
        "I0": lambda: scene.sides[3],
        "J1": lambda: -scene.sides[0] / lam,
        "J0": lambda: -scene.sides[1] / lam,
        "sigma_left": lambda: spent(0.0, -float(scene.r))[1],
        "sigma_right": lambda: spent(0.0, float(scene.r))[1],
        "w": lambda: spent(0.0, -float(scene.r))[0] - spent(0.0, float(scene.r))[0],
        # Staying.
        "P": lambda: scene.P,
        "p_ss": lambda: scene.p_ss,
        "K": lambda: scene.p_ss(-1),
        "N": lambda: scene.masses[1],
        "M": lambda: scene.masses[0] + scene.masses[2],
        "I_left": lambda: scene.masses[0],
        "I_right": lambda: scene.masses[2],
        # Wells and barriers.
        "u1": lambda: roots(drift)[0],
        "u2": lambda: roots(drift)[1],
        "A_1": critical(0, 1),
        "A_2": critical(1, 1),
        "K_m": lambda: -critical(0, 1)(),
        "V_u1": lambda: drift.potential(roots(drift)[0]),
        "V_m": lambda: drift.potential(roots(drift)[0]),
        "V_u2": lambda: drift.potential(roots(drift)[1]),
        "D": lambda: drift.potential(roots(drift)[1]) - drift.potential(roots(drift)[0]),
    }
    return Numbers(**(known | more))


def crossing(rng: random.Random) -> Numbers:
    """A scene that crosses to the right, its noise and radius of the size of the layer."""
    r = within(rng, "1.2", "2")
    scene = Scene(_polynomial(rng, 1), of_fraction(within(rng, "0.9", "1.8")), of_fraction(r))
    u = of_fraction(within(rng, "-1", "1") * r)
    return numbers(scene, u=lambda: u, J=lambda: scene.flux(u))


def sliding(rng: random.Random) -> Numbers:
    """A scene that slides, with a position anywhere."""
    scene = Scene(_polynomial(rng, -1), of_fraction(within(rng, "0.6", "1.6")))
    u = of_fraction(within(rng, "-2", "2"))

    def w() -> Any:
        """lam e^{lam V} times the mass of e^{-lam V}."""
        at = scene.lam * scene.drift.potential(u)
        return scene.lam * CTX.exp(at) * sum(scene.masses)

    return numbers(scene, u=lambda: u, w=w)


def constant(rng: random.Random) -> Numbers:
    """A drift that is one number; p is its transition density, by eigenfunctions."""
    a, r = within(rng, "0.2", "1.5"), within(rng, "0.5", "1")
    kappa = float(within(rng, "0.8", "1.5"))
    scene = Scene(Drift((Fraction(0),), ((a,), (a,))), CTX.mpf(kappa), of_fraction(r))
    wide, pull = float(r), float(a)

    def p(u: Any, t: Any) -> Any:
        """Of the generator kappa^2/2 d^2 + a d on (-r, r), from 0: sines times an exponential."""
        total = 0.0
        for n in range(1, 121):
            rate = pull**2 / (2 * kappa**2) + (kappa * n * np.pi / wide) ** 2 / 8
            shape = np.sin(n * np.pi / 2) * np.sin(n * np.pi * (u + wide) / (2 * wide))
            total = total + shape * np.exp(-rate * t)
        return total * np.exp(pull * u / kappa**2) / wide

    return numbers(scene, a=lambda: of_fraction(a), p=lambda: p)


def friction(rng: random.Random) -> Numbers:
    """The oscillator between the fold and the edge of sliding, from its force and Newton's law."""
    mu, alpha = within(rng, "1", "4"), within(rng, "0.5", "2")
    y, u = of_fraction(within(rng, "-1", "1")), of_fraction(within(rng, "-1", "1"))
    z = of_fraction(within(rng, "-2", "2"))

    def force(x: Any) -> Any:
        """alpha (x + mu (x - x^3)) inside the layer, -+ alpha outside it."""
        if abs(x) >= 1:
            return CTX.mpf(alpha.numerator) / alpha.denominator * CTX.sign(x)
        return of_fraction(alpha) * (x + of_fraction(mu) * (x - x**3))

    top = CTX.findroot(lambda x: CTX.diff(force, x), CTX.mpf("0.65"))
    beta = force(top)
    share = of_fraction(within(rng, "0.2", "0.8"))
    z0 = 1 - of_fraction(alpha) - share * (beta - of_fraction(alpha))

    def field(x: Any) -> Any:
        """y' at y = eps x, z = z0, as eps -> 0: z'' + z' + z + F(z' + 1) = 0 with z' = -1."""
        return 1 - z0 - force(x)

    cubic = np.roots([float(alpha * mu), 0, -float(alpha * (1 + mu)), float(1 - z0)])
    third, well, barrier = (
        CTX.findroot(
            lambda x: 1 - z0 - of_fraction(alpha) * (x + of_fraction(mu) * (x - x**3)), CTX.mpf(x)
        )
        for x in sorted(cubic.real)
    )

    def V(x: Any) -> Any:
        cuts = [c for c in (CTX.mpf(-1), CTX.mpf(1)) if min(-1, x) < c < max(-1, x)]
        return -CTX.quad(field, [-1, *cuts, x])

    def slides(side: int) -> Callable[[Any], Any]:
        return lambda z: 1 - z - of_fraction(alpha) * side

    return Numbers(
        u=lambda: u,
        y=lambda: y,
        z=lambda: z,
        zdot=lambda: y - 1,
        # z'' at the velocity z' = y - 1.
        ydot=lambda: -(y - 1) - z - force(y),
        drift_z=lambda: y - 1,
        drift_y=lambda: -(y - 1) - z - force(y),
        noise_z=lambda: CTX.zero,
        noise_y=lambda: CTX.mpf("0.3"),
        kappa_phys=lambda: CTX.mpf("0.3"),
        mu=lambda: of_fraction(mu),
        alpha=lambda: of_fraction(alpha),
        z0=lambda: z0,
        F=lambda: force,
        phi=lambda: field,
        V=lambda: V,
        beta=lambda: beta,
        u_s=lambda: top,
        z_plus=lambda: 1 - beta,
        z_minus=lambda: 1 + beta,
        z_1=lambda: CTX.findroot(slides(1), 0),
        z_2=lambda: CTX.findroot(slides(-1), 0),
        a_plus=lambda: field(CTX.mpf(2)),
        a_minus=lambda: field(CTX.mpf(-2)),
        omega=lambda: CTX.acos((1 - z0) / beta) / 3,
        u1=lambda: well,
        u2=lambda: barrier,
        u3=lambda: third,
        D=lambda: V(barrier) - V(well),
        **{"A'": lambda: CTX.diff(field, u)},
        **{"A'_1": lambda: CTX.diff(field, well), "A'_2": lambda: CTX.diff(field, barrier)},
    )


def friction_root(rng: random.Random) -> Numbers:
    """The oscillator, with u one of the zeros of its drift."""
    at = friction(rng)
    u = at[rng.choice(("u1", "u2"))]
    return Numbers(u=lambda: u, **{k: (lambda k=k: at[k]) for k in at if k != "u"})


def two_scales(rng: random.Random) -> Numbers:
    """A scene and the same in the paper's own variables: a layer of half-width epsilon."""
    eps, r = within(rng, "0.01", "0.2"), within(rng, "1.3", "2.5")
    layer = _polynomial(rng, 1)
    scene = Scene(layer, of_fraction(within(rng, "0.8", "1.6")), of_fraction(r))
    narrow = Drift.layer(layer.fields[1], eps)

    def physical(k: Any) -> Scene:
        return Scene(narrow, k, of_fraction(r * eps))

    # The noise for which the chance of leaving on the left is the same.
    kappa = CTX.exp(
        CTX.findroot(
            lambda x: CTX.log(physical(CTX.exp(x)).C / scene.C), (CTX.mpf(-2), CTX.mpf(-1))
        )
    )
    wide = physical(kappa)
    return numbers(
        scene,
        epsilon=lambda: of_fraction(eps),
        kappa_phys=lambda: kappa,
        r_phys=lambda: wide.r,
        y=lambda: wide.r,
        u=lambda: scene.r,
        t=lambda: wide.T,
        t_s=lambda: scene.T,
        T=lambda: wide.T,
        rho=lambda: scene.r / scene.kappa**2,
    )


def noises(rng: random.Random) -> Numbers:
    """Three noises of given strength; the amplitude of their sum from its second moment."""
    strength = [within(rng, "-2", "2") for _ in range(3)]
    kappa, drift = of_fraction(within(rng, "0.2", "2")), _polynomial(rng, 1)
    # Gauss-Hermite with 3 nodes: exact for squares of Gaussian numbers.
    nodes, weights = np.polynomial.hermite_e.hermegauss(3)
    weights = weights / weights.sum()
    second = sum(
        w1 * w2 * w3 * float(strength[0] * x1 + strength[1] * x2 + strength[2] * x3) ** 2
        for x1, w1 in zip(map(Fraction, nodes), weights, strict=True)
        for x2, w2 in zip(map(Fraction, nodes), weights, strict=True)
        for x3, w3 in zip(map(Fraction, nodes), weights, strict=True)
    )
    at = numbers(Scene(drift, kappa))
    u = of_fraction(within(rng, "-1", "1"))
    return Numbers(
        **{f"b{n}": (lambda b=b: of_fraction(b)) for n, b in enumerate(strength, start=1)},
        sigma=lambda: CTX.sqrt(second),
        noise=lambda: kappa * CTX.sqrt(second),
        drift=lambda: at["phi"](u),
        kappa_phys=lambda: kappa,
        kappa=lambda: kappa,
        phi=lambda: at["phi"],
        u=lambda: u,
        c_1=lambda: at["phi"](u),
        # Half the variance of kappa dW for a unit of time.
        c_2=lambda: sum(w * (float(kappa) * x) ** 2 for x, w in zip(nodes, weights)) / 2,  # noqa: B905
    )


def convex(rng: random.Random) -> Numbers:
    """Filippov's combination of two fields: the one that stays on the surface."""
    am, ap = within(rng, "0.2", "2"), -within(rng, "0.2", "2")
    gm, gp = within(rng, "-2", "2"), within(rng, "-2", "2")
    share = np.linalg.solve([[float(am), float(ap)], [1.0, 1.0]], [0.0, 1.0])
    return Numbers(
        a_minus=lambda: of_fraction(am),
        a_plus=lambda: of_fraction(ap),
        g_minus=lambda: of_fraction(gm),
        g_plus=lambda: of_fraction(gp),
        g_s=lambda: float(share[0] * float(gm) + share[1] * float(gp)),
    )


def panel(rng: random.Random) -> Numbers:
    """sigma and w at both ends of a panel, and its three integrals, as docs/exact.md has them."""
    scene = Scene(_polynomial(rng, 1), CTX.mpf(float(within(rng, "0.8", "1.6"))), 2)
    a, b = sorted(float(within(rng, "-1", "1")) for _ in range(2))
    V = numbers(scene)["V"]
    lam, end = float(scene.lam), -2.0

    def e(u: Any) -> Any:
        return np.exp(lam * (V(u) - V(a)))

    def sides(x: float) -> tuple[float, float]:
        whole = gauss(e, end, x)
        return whole / e(x), lam * e(x) * gauss(lambda u: gauss(e, end, u) / e(u), end, x) / whole

    fall, climb = min(float(e(b)), 1.0), min(float(1 / e(b)), 1.0)
    at = {"sigma": sides(a)[0], "w": sides(a)[1], "sigma_b": sides(b)[0], "w_b": sides(b)[1]}
    at |= {"lam": lam, "fall": fall, "climb": climb, "int_e": climb * gauss(e, a, b)}
    at["int_inverse"] = fall * gauss(lambda u: 1 / e(u), a, b)
    at["nested"] = fall * gauss(lambda v: gauss(e, a, v) / e(v), a, b)
    return Numbers(**{k: (lambda x=x: float(x)) for k, x in at.items()})


def straight_panel(rng: random.Random) -> Numbers:
    """The three integrals over a panel of constant drift."""
    x = float(within(rng, "0.2", "4"))

    def double(sign: int) -> Any:
        return gauss(
            lambda v: np.exp(sign * x * v) * gauss(lambda u: np.exp(-sign * x * u), 0.0, v),
            0.0,
            1.0,
        )

    return Numbers(
        x=lambda: x,
        int_e=lambda: gauss(lambda u: np.exp(-x * u), 0.0, 1.0),
        nested_down=lambda: np.exp(-x) * double(1),
        nested_up=lambda: double(-1),
    )


def airy_pair(rng: random.Random) -> Numbers:
    """The numbers of `airy_pair_at` at a random Z."""
    return airy_pair_at(float(within(rng, "-2", "1.5")))


def airy_pair_at(Z: float) -> Numbers:
    """Double integrals of e^{h(s) - h(t)}, h(s) = s^3/3 - Z s, over s < t, by plain sums."""
    tau, n = np.linspace(0.02, 3.4, 1200), np.linspace(-7, 7, 161)
    # t - s = tau^2 and (s + t)/2 = n/tau: ds dt = 2 dn dtau.
    s, t = n[:, None] / tau - tau**2 / 2, n[:, None] / tau + tau**2 / 2
    weight = np.exp(s**3 / 3 - Z * s - t**3 / 3 + Z * t) * 2 * (n[1] - n[0])

    def part(moment: Any, singular: float) -> Any:
        """The integral; Hadamard's finite part of what grows like singular/tau^2."""
        rest = np.sum(weight * moment, axis=0) - singular / tau**2
        return np.trapezoid(rest, tau) + rest[0] * tau[0] - singular / tau[-1]

    return Numbers(
        Z=lambda: Z,
        J=lambda: part(1, 0),
        # Half of it at t and half, with the other sign, at s.
        J_1=lambda: part((t - s) / 2, 0),
        J_2=lambda: part(s * t, np.sqrt(np.pi)),
    )


def weighted_pair(rng: random.Random) -> Numbers:
    """Integrals over a pair with the weight a + b s: on rays past the other zero, both ways."""
    Z = float(within(rng, "-2", "1.5"))
    a, b, small = (float(within(rng, low, "1")) for low in ("0.5", "-1", "0.1"))
    double = airy_pair_at(Z)

    def single(sign: int) -> float:
        """Of e^{sign (s^3/3 - Z s)}: from -sign oo to 0, on to the mean of both other ends."""

        def integrand(s: Any, slope: Any) -> Any:
            # s^3/3 - Z s changes its sign with s.
            weight = small * (a + sign * b * small * s)
            return (weight * np.exp(s**3 / 3 - Z * s) * slope).real

        def whole(x: Any) -> Any:
            turn = np.exp(1j * np.pi / 3)
            return integrand(-x + 0j, 1) + integrand(x * turn, turn)

        return float(sum(gauss(whole, low, low + 1.0) for low in range(9)))

    return Numbers(
        **{k: (lambda x=x: x) for k, x in {"Z": Z, "a": a, "b": b, "small": small}.items()},
        I_down=lambda: single(1),
        I_up=lambda: single(-1),
        I_both=lambda: small**2 * (a**2 * double["J"] + b**2 * small**2 * double["J_2"]),
    )


def formal(rng: random.Random) -> Numbers:
    """Coefficient of lam^-k, k to 3, in int e^{-+lam (p u + q u^2/2)} du, by u = x/lam.

    At 0 the integral begins or ends, or q has another value on the left.
    """
    p = float(within(rng, "0.5", "2"))
    bends = [float(within(rng, "-2", "2")) for _ in range(2)]
    k, kind = rng.randint(1, 3), rng.choice(("start", "kink", "kink", "end"))

    def beyond(sign: int, q: float) -> Any:
        """Of e^{-sign lam (p u + q u^2/2)}: of 1/(sign lam)^k, along the ray where it falls."""
        front = sign**k * (-q / 2) ** (k - 1) / [1, 1, 2][k - 1]
        return front * gauss(lambda x: x ** (2 * k - 2) * np.exp(-p * x), 0.0, 60 / p, panels=30)

    def coefficient(sign: int) -> Any:
        # The left in a mirror.
        left, right = beyond(-sign, -bends[0]), beyond(sign, bends[1])
        return (kind != "start") * left + (kind != "end") * right

    def h(order: int, u: Any, q: float) -> Any:
        phi = p + q * u
        return 1 / phi if order == 1 else -CTX.diff(lambda x: h(order - 1, x, q), u) / phi

    return Numbers(
        side=lambda: (-1) ** k,
        left=lambda: (kind != "start") * h(k, CTX.zero, bends[0]),
        right=lambda: (kind != "end") * h(k, CTX.zero, bends[1]),
        E_up=lambda: coefficient(1),
        E_down=lambda: coefficient(-1),
    )


def powers(rng: random.Random) -> Numbers:
    """Coefficients of -h' and of the primitive of c t^(index - power), and of c t^-power."""
    power, index, c = rng.randint(2, 7), rng.randint(0, 9), float(within(rng, "-2", "2"))
    slope = CTX.diff(lambda t: c * t ** (index - power), CTX.one)
    return Numbers(
        power=lambda: power,
        index=lambda: index,
        term=lambda: c,
        h_next=lambda: -slope,
        # From oo, where nothing is left.
        H=lambda: -gauss(lambda t: c * t**-power, 1.0, np.inf),
    )


def moments(rng: random.Random) -> Numbers:
    """Moments of a Gaussian by sums; V beside a zero of the drift by quadrature."""
    n, j = rng.randint(0, 4), rng.randint(1, 4)
    slope, c = float(within(rng, "-2", "-0.5")), float(within(rng, "-2", "2"))

    def moment(n: int) -> Any:
        s = np.linspace(-14, 14, 561)
        return np.sum(s ** (2 * n) * np.exp(-(s**2) / 2)) * (s[1] - s[0])

    def fall(c: float) -> Any:
        return gauss(lambda t: slope * t + c * t ** (j + 1), 0.0, 1.0)

    return Numbers(
        n=lambda: n, j=lambda: j, slope=lambda: slope, term=lambda: c,
        m_0=lambda: moment(0), moment=lambda: moment(n), m_next=lambda: moment(n + 1),
        alpha_j=lambda: fall(c) / fall(0.0) - 1,
    )  # fmt: skip


def both_sides(rng: random.Random) -> Numbers:
    """Integrals over both sides of the start; of the inner ones any shares are the start's."""
    at = crossing(rng)
    lam, V, r = float(at["lam"]), at["V"], float(at["r"])
    share = [float(within(rng, "-1", "1")) for _ in range(2)]

    def up(u: Any) -> Any:
        return np.exp(lam * V(u))

    def double(end: float) -> Any:
        return gauss(lambda v: up(v) * abs(gauss(lambda u: np.exp(-lam * V(u)), 0.0, v)), 0.0, end)

    known = {"behind": abs(gauss(up, 0.0, -r)), "ahead": abs(gauss(up, 0.0, r))}
    known |= {
        "total": known["behind"] + known["ahead"],
        "speed_start": sum(share),
        "nested_left": abs(double(-r)) - share[0] * known["behind"],
        "nested_right": abs(double(r)) - share[1] * known["ahead"],
    }
    return Numbers(
        T=lambda: at["T"], lam=lambda: at["lam"],
        **{name: (lambda x=x: float(x)) for name, x in known.items()},
    )  # fmt: skip


def cut_gaussian(rng: random.Random) -> Numbers:
    """A Gaussian with the weight peak + rest s, cut off at t, and both functions of it."""
    lam, t = (float(within(rng, low, high)) for low, high in (("2", "20"), ("0.3", "2")))
    peak, rest = float(within(rng, "0.5", "2")), float(within(rng, "-1", "1"))

    def weight(s: Any) -> Any:
        return peak + rest * s

    def beyond(f: Any) -> Any:
        return gauss(lambda s: f(s) * np.exp(-lam * (s**2 - t**2) / 2), t, t + 12 / lam**0.5)

    def dawson(x: Any) -> Any:
        return gauss(
            lambda s: x[..., None] * np.exp(lam * x[..., None] ** 2 * (s**2 - 1) / 2), 0.0, 1.0
        )

    def before(f: Any) -> Any:
        return gauss(lambda s: f(s) * np.exp(lam * (s**2 - t**2) / 2), 0.0, t)

    # What the start of the barrier has, and the regular part.
    own = rest / lam * np.exp(-lam * t**2 / 2)
    regular = (weight(t) ** 2 - peak**2 - 2 * peak * rest * t) / 2 / lam + 2 * peak * rest * t / lam
    return Numbers(
        **{k: (lambda x=x: x) for k, x in
           {"lam": lam, "t": t, "peak": peak, "rest": rest}.items()},
        tail=lambda: beyond(np.ones_like),
        dawson=lambda: before(np.ones_like),
        integral=lambda: lam * gauss(dawson, 0.0, t),
        I_up=lambda: -beyond(weight),
        I_down=lambda: before(weight) + own,
        I_both=lambda: (
            gauss(lambda s: weight(s) * (peak * dawson(s) + rest / lam), 0.0, t)
            - regular - peak**2 * np.log(t) / lam
        ),
    )  # fmt: skip


# -- z moves ----------------------------------------------------------------------------------


def walked(
    drift: Callable[[Any, float], Any], kappa: float, r: float, around: int = 1, n: int = 12
) -> tuple[float, Any]:
    """Mean time to leave (-r, r), and mean square, of a walk whose drift changes with the time.

    The step h, and both from 2 n + 1 places by rows, at the times k h, |k| <= `around`, by columns.
    The walk goes dx = r/n up or down each h = (dx/kappa)^2; its error, O(dx^2), is extrapolated.
    """
    found, step = [], (r / n / kappa) ** 2
    for fine in (1, 2):
        u = np.linspace(-r, r, 2 * n * fine + 1)
        h, kept = step / fine**2, []
        first, square = np.zeros((2, u.size))
        # Whoever is in at 14 widths' time has left all but surely.
        for k in range(round(14 * (r / kappa) ** 2 / h), -around * fine**2 - 1, -1):
            up = 0.5 + drift(u, k * h)[1:-1] * (u[1] - u[0]) / (2 * kappa**2)
            ahead, ahead_square = (up * f[2:] + (1 - up) * f[:-2] for f in (first, square))
            first[1:-1], square[1:-1] = h + ahead, h * h + 2 * h * ahead + ahead_square
            if k % fine**2 == 0 and abs(k) <= around * fine**2:
                kept.insert(0, (first[::fine].copy(), square[::fine].copy()))
        found.append(np.array(kept).transpose(1, 2, 0))
    return step, (4 * found[1] - found[0]) / 3


def moving(rng: random.Random) -> Numbers:
    """Mean and variance of the time to leave, and their derivatives at a point, z moving with t."""
    r, kappa, n = 1.0, float(within(rng, "0.8", "1.2")), 12
    a, b, c, g = (float(within(rng, low, "1")) for low in ("-1", "0.2", "-1", "0.3"))
    eps, place = float(within(rng, "0.2", "0.8")), n + rng.randint(-4, 4)
    step, (first, square) = walked(
        lambda u, t: a + b * eps * g * t + c * u, kappa, r, around=2, n=n
    )

    def slopes(f: Any) -> dict[str, Any]:
        """The value, both derivatives by u and that by z = eps g t; differences of 5 points."""
        row, column = f[place - 2 : place + 3, 2], f[place]
        rise, bend = np.array([1, -8, 0, 8, -1]) / 12, np.array([-1, 16, -30, 16, -1]) / 12
        return {
            "": row[2], "u": rise @ row * n / r, "uu": bend @ row * (n / r) ** 2,
            "z": rise @ column / step / (eps * g),
        }  # fmt: skip

    known = {"T": slopes(first), "v": slopes(square - first**2)}
    return Numbers(
        **{f"{f}{by}": (lambda x=x: x) for f, all_ in known.items() for by, x in all_.items()},
        phi=lambda: a + c * (place - n) * r / n, g=lambda: g, epsilon=lambda: eps,
        kappa=lambda: kappa,
    )  # fmt: skip


def nudged(rng: random.Random) -> Numbers:
    """The derivative by eps at 0 of the mean time to leave, phi = a + b z + c y, y = eps u."""
    r, kappa, n, eps = 1.0, float(within(rng, "0.8", "1.2")), 12, 0.02
    a, b, c, g = (float(within(rng, low, "1")) for low in ("0.2", "0.2", "0.2", "-1"))
    place = n + rng.randint(-4, 4)

    def mean(eps: float) -> Any:
        return walked(lambda u, t: a + eps * (b * g * t + c * u), kappa, r, n=n)[1][0, place, 1]

    return Numbers(
        a=lambda: a, b=lambda: b, phi_y=lambda: c, g=lambda: g, kappa=lambda: kappa, r=lambda: r,
        x=lambda: (place - n) * r / n, rest=lambda: mean(0.0),
        T_1=lambda: (mean(eps) - mean(-eps)) / (2 * eps),
    )  # fmt: skip


def survival(rate: Callable[[Any], Any], end: float, n: int) -> tuple[Any, Any]:
    """Times, and the chances not to have left by then: those of short times multiplied."""
    t = np.linspace(0, end, n + 1)
    half = rate((t[1:] + t[:-1]) / 2) * (t[1] - t[0]) / 2
    return t, np.concatenate(([1.0], np.cumprod((1 - half) / (1 + half))))


def held(rng: random.Random) -> Numbers:
    """A rate that changes, and the chance not to have left at a time."""
    start, slope, end = (float(within(rng, low, "2")) for low in ("0.2", "-0.1", "0.5"))

    def rate(x: Any) -> Any:
        return start + slope * x**2

    return Numbers(
        t=lambda: end, k=lambda: rate,
        H=lambda: lambda at: CTX.mpf(float(survival(rate, float(at), 20_000)[1][-1])),
    )  # fmt: skip


def past_fold(rng: random.Random) -> Numbers:
    """Paths of w' = w^2 + eps t from the well on, with one eps and with 1."""
    eps, at = float(within(rng, "0.1", "0.6")), float(within(rng, "-1", "1.5"))

    def path(eps: float, until: float = np.inf) -> tuple[float, float]:
        """The time at which w is infinite, or `until`, and w there: tan(angle) is w."""

        def rate(t: float, angle: float) -> float:
            return np.sin(angle) ** 2 + eps * t * np.cos(angle) ** 2

        # From far before, where the path runs into that of the well.
        t, h = -30.0, 2e-3
        angle = -np.arctan(np.sqrt(-eps * t))
        while angle < np.pi / 2 and t < until:
            h = min(h, until - t)
            one = rate(t, angle)
            two = rate(t + h / 2, angle + h * one / 2)
            three = rate(t + h / 2, angle + h * two / 2)
            four = rate(t + h, angle + h * three)
            t, angle = t + h, angle + h * (one + 2 * two + 2 * three + four) / 6
        return t - max(angle - np.pi / 2, 0.0), np.tan(angle)

    return Numbers(
        epsilon=lambda: eps, s=lambda: at,
        a=lambda: path(eps, 0.0)[1] / path(1.0, 0.0)[1],
        b=lambda: path(eps)[0] / path(1.0)[0],
        w_1=lambda: lambda s: CTX.mpf(float(path(1.0, float(s))[1])),
    )  # fmt: skip


# -- scenes on a path to a limit --------------------------------------------------------------

Path = Callable[[random.Random], Callable[[Any], Numbers]]


def weak(rng: random.Random) -> Callable[[Any], Numbers]:
    """A well and a barrier as kappa -> 0, r = 10."""
    drift, hat = _well(rng), of_fraction(within(rng, "-2", "2"))

    def at(kappa: Any) -> Numbers:
        scene = Scene(drift, kappa, 10)
        known = numbers(scene)
        small = roots(drift)[0] + kappa * hat

        def multiplier(start: Any = 0) -> Any:
            """Share of the Gaussian term of the well that is in T."""
            term = 2 * CTX.pi / CTX.sqrt(-known["A_1"] * known["A_2"])
            time = scene.with_(start=start).T - 10 / known["a_plus"]
            return time / (term * CTX.exp(scene.lam * known["D"]))

        return numbers(
            scene,
            S=multiplier,
            S_from=lambda: multiplier,
            uhat=lambda: hat,
            u=lambda: small,
            c2=lambda: -known["A_1"],
        )

    return at


def both_terms(rng: random.Random) -> Callable[[Any], Numbers]:
    """The same with r so large that the way to r takes as long as the well."""
    drift = _well(rng)
    barrier = numbers(Scene(drift, 1))["D"]
    return lambda kappa: numbers(Scene(drift, kappa, CTX.exp(2 * barrier / kappa**2)))


def high_end(rng: random.Random) -> Callable[[Any], Numbers]:
    """A well that lies lower than the layer's right end."""
    while True:
        drift = _well(rng)
        at = numbers(Scene(drift, 1))
        if at["V_1"] > at["V_u1"] + CTX.mpf("0.1"):
            return lambda kappa: numbers(Scene(drift, kappa, 10))


def equal_terms(rng: random.Random) -> Callable[[Any], Numbers]:
    """The same with the r for which T is twice r/a+: half of it is the well's."""
    drift = _well(rng)

    def at(kappa: Any) -> Numbers:
        ap = numbers(Scene(drift, 1))["a_plus"]
        # T - r/a+ does not depend on r, but for exponentially small terms.
        rest = Scene(drift, kappa, 10).T - 10 / ap
        return numbers(Scene(drift, kappa, rest * ap), kappa_e=lambda: kappa)

    return at


def long_escape(rng: random.Random) -> Callable[[Any], Numbers]:
    """A well and a barrier as kappa -> 0, with the epsilon for which T is 1/epsilon."""
    drift = _well(rng)

    def at(kappa: Any) -> Numbers:
        scene = Scene(drift, kappa, 2)
        ell = CTX.log(scene.time_from_wall(-2, 0, 2))
        eps = CTX.exp(-ell)
        return numbers(
            scene, kappa_c=lambda: kappa * CTX.sqrt(eps), epsilon=lambda: eps, ell=lambda: ell
        )

    return at


def waiting(rng: random.Random) -> Callable[[Any], Numbers]:
    """Mean and deviation of the time of leaving at a rate 1/T(z), as eps -> 0, z = eps g t."""
    time, slope, bend, g = (
        float(within(rng, low, high))
        for low, high in (("1", "3"), ("0.3", "1"), ("0", "0.1"), ("0.5", "1"))
    )

    def at(eps: Any) -> Numbers:
        def rate(t: Any) -> Any:
            z = float(eps) * g * t
            return 1 / (time + slope * z + bend * z**2)

        t, chance = survival(rate, 50 * time, 200_000)
        mean, square = np.trapezoid(chance, t), np.trapezoid(2 * t * chance, t)
        return Numbers(
            T_f=lambda: time, Tf_z=lambda: slope, g=lambda: g, epsilon=lambda: eps,
            T=lambda: mean, sigma_T=lambda: np.sqrt(square - mean**2),
        )  # fmt: skip

    return at


def strong(rng: random.Random) -> Callable[[Any], Numbers]:
    """Crossing as kappa -> oo, r = kappa^4."""
    drift = _polynomial(rng, 1)
    return lambda kappa: numbers(Scene(drift, kappa, kappa**4))


def strong_sliding(rng: random.Random) -> Callable[[Any], Numbers]:
    """Sliding as kappa -> oo."""
    drift = _polynomial(rng, -1)
    return lambda kappa: numbers(Scene(drift, kappa))


def weak_sliding(rng: random.Random) -> Callable[[Any], Numbers]:
    """One well, sliding, as kappa -> 0."""
    drift = _bowl(rng)
    return lambda kappa: numbers(Scene(drift, kappa))


def narrow_layer(rng: random.Random) -> Callable[[Any], Numbers]:
    """Sliding in the paper's variables as epsilon -> 0 at one noise."""
    inside, kappa = _polynomial(rng, -1).fields[1], of_fraction(within(rng, "0.3", "1"))
    return lambda eps: _narrow(inside, eps, kappa)


def weak_narrow(rng: random.Random) -> Callable[[Any], Numbers]:
    """One well, sliding, in the paper's variables, as kappa/sqrt(eps) -> 0."""
    inside, eps = _bowl(rng).fields[1], within(rng, "0.01", "0.1")
    return lambda k: _narrow(inside, eps, k * CTX.sqrt(of_fraction(eps)))


def _narrow(inside: Any, eps: Any, kappa: Any) -> Numbers:
    width = Fraction(str(eps)) if not isinstance(eps, Fraction) else eps
    known = numbers(Scene(Drift.layer(inside), 1))
    scene = Scene(Drift.layer(inside, width), kappa)
    return numbers(
        scene,
        epsilon=lambda: of_fraction(width),
        kappa_phys=lambda: kappa,
        **{s: (lambda s=s: known[s]) for s in ("K_m", "V_m", "V_1")},
    )


def short_way(rng: random.Random) -> Callable[[Any], Numbers]:
    """Crossing in the paper's variables as r -> 0, eps = r^2 and kappa = c sqrt(eps), c > 1."""
    inside, c = _polynomial(rng, 1).fields[1], of_fraction(within(rng, "1", "2"))

    def at(r: Any) -> Numbers:
        eps = Fraction(str(r)) ** 2
        scene = Scene(Drift.layer(inside, eps), c * r, r)
        return numbers(scene, r_phys=lambda: r)

    return at


def one_well(rng: random.Random) -> Callable[[Any], Numbers]:
    """The integral of e^{-lam V} about a well, over that of its parabola, as lam -> oo."""
    drift = _bowl(rng, within(rng, "0.4", "0.6"))

    def at(lam: Any) -> Numbers:
        scene = Scene(drift, CTX.sqrt(2 / lam))
        (low,) = roots(drift)
        slopes = taylor(drift, low, 18)
        gaussian = CTX.sqrt(CTX.pi * 2 / (lam * -slopes[1])) * CTX.exp(-lam * drift.potential(low))
        return numbers(
            scene,
            S=lambda: scene.masses[1] / gaussian,
            **{f"c_{j}": (lambda j=j: -slopes[j - 1]) for j in range(2, 19)},
        )

    return at


def from_well(rng: random.Random) -> Callable[[Any], Numbers]:
    """The integral of e^{-lam V} to the right of a well, over that of its parabola over the line.

    It bends so that the next two terms do not cancel.
    """
    drift = _bowl(rng, -within(rng, "0.4", "0.6"))

    def at(lam: Any) -> Numbers:
        (low,) = roots(drift)
        slopes = taylor(drift, low, 20)
        whole = CTX.sqrt(CTX.pi * 2 / (lam * -slopes[1]))
        return numbers(
            Scene(drift, CTX.sqrt(2 / lam)),
            H=lambda: drift.against().slope(lam, low, CTX.one, 1, 0)[1] / whole,
            **{f"c_{j}": (lambda j=j: -slopes[j - 1]) for j in range(2, 21)},
        )

    return at


def barely(rng: random.Random) -> Numbers:
    """r >= 4, V_max = a- r/4 and exp(3 a- r/(2 kappa^2)) a little above 4: C is largest there.

    V falls steeply at -1, comes back to 0, keeps its maximum on (0, 1), and falls beyond. A drift
    with jumps is a limit of continuous ones.
    """
    am, r = within(rng, "50", "100"), rng.choice((4, 4, 4, 5, 9))
    ap = am * rng.choice((Fraction(1, 2), 2, 1000))
    exponent = of_fraction(within(rng, "1.3863", "1.5")) * rng.choice((1, 1, 5, 20))
    top, depth = am * r / 4, 20 * am
    edges = tuple(Fraction(n, 1000) for n in (-1000, -999, -1, 0, 1000))
    down, up = 1000 * depth, -1000 * (depth + top)
    drift = Drift(edges, ((am,), (down,), (Fraction(0),), (up,), (Fraction(0),), (ap,)))
    return numbers(Scene(drift, CTX.sqrt(of_fraction(3 * am * r / 2) / exponent), r))


def beside_pair(rng: random.Random) -> Numbers:
    """Integrals beside the zeros of y^2 - R^2 or y^2 + R^2, as sums and off the real line."""
    y, R = float(within(rng, "0.2", "3")), float(within(rng, "0.3", "1.5"))
    alpha, beta = (float(within(rng, "-2", "2")) for _ in range(2))
    n, i, index, power = rng.randint(1, 4), rng.randint(0, 4), rng.randint(0, 5), rng.randint(1, 4)
    before, after = (float(within(rng, "-2", "2")) for _ in range(2))
    sign = rng.choice((-1, 1))

    def to_infinity(f: Any) -> Any:
        """From y on by y + i, real part: the mean of both ways past a zero."""
        up = gauss(lambda s: (1j * f(y + 1j * s)).real, 0.0, 1.0, panels=8)
        return up + gauss(lambda t: f(t + 1j).real, y, np.inf)

    def over_line(n: int) -> Any:
        return 2 * gauss(lambda t: (t * t + R * R) ** -n, 0.0, np.inf)

    def beyond(power: int, n: int) -> Any:
        return gauss(lambda t: t**power * (t * t + R * R) ** -n, y, y + 1.0)

    def binomial(i: int) -> Any:
        z = np.exp(2j * np.pi * np.arange(128) / 128) / 2
        return np.mean((1 - z) ** -n * z**-i).real

    def fall(t: Any) -> Any:
        """-h' (t^2 + R^2)^(power + 1), a polynomial but for a pole at 0 where index is 0."""
        terms = lambda x: before * x ** (index - 1) + after * x ** (index + 1)  # noqa: E731
        slope = CTX.diff(lambda x: terms(x) * (x * x + R * R) ** -power, t)
        return -slope * (t * t + R * R) ** (power + 1)

    turns = [CTX.expjpi(CTX.mpf(k) / 8) for k in range(16)]
    log = lambda t: sign * R**2 / t / (t * t - sign * R**2)  # noqa: E731
    return Numbers(
        y=lambda: y, R=lambda: R, gap=lambda: y - R, alpha=lambda: alpha, beta=lambda: beta,
        product=lambda: abs(y * y - sign * R * R), square=lambda: -(R**2), n=lambda: n, i=lambda: i,
        index=lambda: index, power=lambda: power, before=lambda: before, after=lambda: after,
        share=lambda: over_line(n), term=lambda: binomial(i), lower=lambda: beyond(index, n - 1),
        same=lambda: beyond(index, n),
        H_even=lambda: -alpha * to_infinity(lambda t: 1 / (t * t - R * R)),
        H_line=lambda: -alpha * to_infinity(lambda t: 1 / (t * t + R * R)),
        # Like beta log y at infinity.
        H_odd=lambda: beta * (np.log(y) - to_infinity(log)),
        s_1=lambda: over_line(1), s_next=lambda: over_line(n + 1), b_next=lambda: binomial(i + 1),
        I=lambda: beyond(index + 2, n),
        h_next=lambda: CTX.re(CTX.fsum(fall(t) * t**-index for t in turns) / 16),
    )  # fmt: skip


def _field(rng: random.Random, arguments: int) -> Callable[..., Any]:
    """A smooth field of so many arguments, which changes with each."""
    rates = [of_fraction(within(rng, "0.5", "2")) for _ in range(arguments)]
    bend = of_fraction(within(rng, "0.2", "1"))

    def field(*x: Any) -> Any:
        phase = CTX.fsum(rate * u for rate, u in zip(rates, x, strict=True))
        return 2 + CTX.sin(phase) + bend * CTX.fprod(CTX.exp(u / 2) for u in x)

    return field


def edges(rng: random.Random) -> Numbers:
    """A smoothed field that need not be continuous, and its values just beside both edges."""
    eps, z = (of_fraction(within(rng, low, "0.5")) for low in ("0.1", "-0.5"))
    below, inside, above = (_field(rng, n) for n in (2, 3, 2))

    def smoothed(y: Any) -> Any:
        if abs(y) < eps:
            return inside(y / eps, y, z)
        return above(y, z) if y > 0 else below(y, z)

    step = CTX.mpf("1e-15")
    return Numbers(
        **{"f^-": lambda: below, "F": lambda: inside, "f^+": lambda: above},
        epsilon=lambda: eps, z=lambda: z,
        jumps=lambda: [smoothed(y + x * step) - smoothed(y - x * step)
                       for y, x in ((eps, 1), (-eps, -1))],
    )  # fmt: skip


def along_a_ray(rng: random.Random) -> Path:
    """A field of the plane at a distance from the origin, in a direction of its own."""
    field, turn = _field(rng, 2), of_fraction(within(rng, "0.1", "1.4"))

    def at(rho: Any) -> Numbers:
        return Numbers(
            f=lambda: field(rho * CTX.cos(turn), rho * CTX.sin(turn)),
            f_0=lambda: field(CTX.zero, CTX.zero),
            rho=lambda: rho,
        )

    return at


def one_step(rng: random.Random) -> Numbers:
    """The middle one of three coordinates after a step of dx = F dt + D dW: mean, correlations."""
    fields = [_field(rng, 1) for _ in range(3)]
    u, dt = of_fraction(within(rng, "-1", "1")), CTX.mpf("0.01")
    D = [[of_fraction(within(rng, "-2", "2")) for _ in range(3)] for _ in range(3)]
    # Gauss-Hermite with 3 nodes: exact for squares of Gaussian numbers.
    nodes = [
        (-CTX.sqrt(3), CTX.mpf(1) / 6),
        (CTX.zero, CTX.mpf(2) / 3),
        (CTX.sqrt(3), CTX.mpf(1) / 6),
    ]

    def mean(of: Callable[[Any, Any], Any]) -> Any:
        total = CTX.zero
        for drawn in itertools.product(nodes, repeat=3):
            dW = [CTX.sqrt(dt) * x for x, _ in drawn]
            step = [f(u) * dt + CTX.fdot(row, dW) for f, row in zip(fields, D, strict=True)]
            total += CTX.fprod(w for _, w in drawn) * of(step[1], dW)
        return total / dt

    return Numbers(
        **{f"F{k}": (lambda f=f: f) for k, f in enumerate(fields, start=1)},
        **{f"d{i}{j}": (lambda x=x: x)
           for i, row in enumerate(D, start=1) for j, x in enumerate(row, start=1)},
        **{f"B{j}": (lambda j=j: mean(lambda dy, dW: dy * dW[j - 1])) for j in (1, 2, 3)},
        u=lambda: u, drift=lambda: mean(lambda dy, dW: dy),
    )  # fmt: skip
