"""Every conclusion of the derivations, held to the definition of what stands on its left side.

The definitions (`tests.derivation.definitions`) are differential equations solved from nothing, or
plain sums; the statement is SymPy's, both sides, with numbers put in by name. So a mistake dies here
that a derivation makes consistently, in its result and in what it compares the result with.
"""

from __future__ import annotations

import random
from collections import ChainMap
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from fractions import Fraction
from functools import cache
from itertools import islice
from typing import Any

import numpy as np
import pytest
import sympy

from derivations import registry
from symasym.derivation.mutation import mutants
from symasym.derivation.results import Expansion
from tests.derivation.definitions import CTX, Drift, Scene, gauss, of_fraction, roots, taylor


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


# -- SymPy's statements in numbers ----------------------------------------------------------

_NUMPY = {sympy.exp: np.exp, sympy.log: np.log, sympy.tanh: np.tanh, sympy.Abs: np.abs}


def value(e: Any, at: Mapping[str, Any]) -> Any:
    """`e` with the numbers of `at`: to 20 digits, in float64 where there is an integral in it."""
    e = sympy.sympify(e)
    if e.has(sympy.Integral):
        return _number(_float(e, at))
    functions = {f: sympy.Dummy() for f in e.atoms(sympy.core.function.AppliedUndef)}
    put = {d: at[f.func.__name__](value(f.args[0], at)) for f, d in functions.items()}
    e = e.xreplace(functions)
    names = sorted(e.free_symbols, key=str)
    given = [_number(put[s] if s in put else at[s.name]) for s in names]
    # Digits enough for 1 - P where that is exponentially small.
    with CTX.workdps(200):
        return _number(sympy.lambdify(names, e, modules=[_OF_CTX, CTX])(*given))


def _number(x: Any) -> Any:
    """A number of the context."""
    return CTX.convert(float(x) if isinstance(x, (np.ndarray, np.generic)) else x)


_OF_CTX = {"Heaviside": lambda x, *_: CTX.mpf(x > 0), "airybi": CTX.airybi, "airyai": CTX.airyai} | {
    "airyaiprime": lambda z: CTX.airyai(z, derivative=1),
    "airybiprime": lambda z: CTX.airybi(z, derivative=1),
}


def _deeper(x: Any) -> Any:
    """An array with one axis more, at its end."""
    return x[..., None] if isinstance(x, np.ndarray) else x


def _float(e: Any, at: Mapping[Any, Any]) -> Any:
    """`e` in float64, numbers or arrays, its integrals by Gauss's rule on panels between kinks."""
    if e.is_Number or e.is_NumberSymbol:
        return np.inf if e is sympy.oo else float(e)
    if e.is_Symbol:
        found = at[e.name]
        return found if isinstance(found, np.ndarray) else float(found)
    if isinstance(e, sympy.Integral):
        *inner, (variable, low, high) = e.limits
        rest = sympy.Integral(e.function, *inner) if inner else e.function

        def integrand(x: Any) -> Any:
            return _float(rest, {k: _deeper(at[k]) for k in needed} | {variable.name: x})

        needed = {s.name for s in rest.free_symbols - {variable}} | {
            f.func.__name__ for f in rest.atoms(sympy.core.function.AppliedUndef)
        }
        return gauss(integrand, _float(low, at), _float(high, at))
    arguments = [_float(a, at) for a in e.args]
    if isinstance(e, sympy.core.function.AppliedUndef):
        return at[e.func.__name__](*arguments)
    if isinstance(e, sympy.Heaviside):
        return np.heaviside(arguments[0], 0.5)
    if e.is_Add:
        return sum(arguments)
    if e.is_Mul:
        return np.prod(np.broadcast_arrays(*arguments), axis=0)
    if e.is_Pow and e.base is not sympy.E:
        return arguments[0] ** arguments[1]
    return _NUMPY[e.func](arguments[-1])


# -- random scenes --------------------------------------------------------------------------

Draw = Callable[[random.Random], Any]


def _within(rng: random.Random, low: str, high: str) -> Fraction:
    return Fraction(low) + (Fraction(high) - Fraction(low)) * Fraction(rng.randint(1, 98), 99)


def _polynomial(rng: random.Random, right: int) -> Drift:
    """A cubic with a- > 0 and a+ of the sign `right`, as it likes between them."""
    am, ap = _within(rng, "0.4", "2"), right * _within(rng, "0.4", "2")
    b, c = _within(rng, "-2", "2"), _within(rng, "-2", "2")
    # (1 - u^2)(b + c u) vanishes at both ends.
    line = (am + ap) / 2, (ap - am) / 2
    return Drift.layer((line[0] + b, line[1] + c, -b, -c))


def _well(rng: random.Random) -> Drift:
    """A well in (-0.7, -0.3) and a barrier in (0.4, 0.7), crossing to the right."""
    low, high = _within(rng, "-0.7", "-0.3"), _within(rng, "0.4", "0.7")
    scale, third = _within(rng, "1", "1.6"), _within(rng, "1.4", "2")
    found = np.polynomial.polynomial.polyfromroots([low, high, -third])
    return Drift.layer([scale * c for c in found])


def _bowl(rng: random.Random) -> Drift:
    """One well in (-0.3, 0.3), sliding."""
    low, scale = _within(rng, "-0.3", "0.3"), _within(rng, "0.5", "1")
    bend, third = _within(rng, "-0.3", "0.3"), _within(rng, "0.1", "0.4")
    inner = (1 + bend, bend, third)
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
    r = _within(rng, "1.3", "2.5")
    scene = Scene(_polynomial(rng, 1), of_fraction(_within(rng, "0.8", "1.6")), of_fraction(r))
    u = of_fraction(_within(rng, "-1", "1") * r)
    return numbers(scene, u=lambda: u, J=lambda: scene.flux(u))


def sliding(rng: random.Random) -> Numbers:
    """A scene that slides, with a position anywhere."""
    scene = Scene(_polynomial(rng, -1), of_fraction(_within(rng, "0.6", "1.6")))
    u = of_fraction(_within(rng, "-2", "2"))

    def w() -> Any:
        """lam e^{lam V} times the mass of e^{-lam V}."""
        at = scene.lam * scene.drift.potential(u)
        return scene.lam * CTX.exp(at) * sum(scene.masses)

    return numbers(scene, u=lambda: u, w=w)


def constant(rng: random.Random) -> Numbers:
    """A drift that is one number; p is its transition density, by eigenfunctions."""
    a, r = _within(rng, "0.2", "1.5"), _within(rng, "0.5", "1")
    kappa = float(_within(rng, "0.8", "1.5"))
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
    """The oscillator between both folds and the edge of sliding, from the force and Newton's law."""
    mu, alpha = _within(rng, "1", "4"), _within(rng, "0.5", "2")
    y, u = of_fraction(_within(rng, "-1", "1")), of_fraction(_within(rng, "-1", "1"))
    z = of_fraction(_within(rng, "-2", "2"))

    def force(x: Any) -> Any:
        """alpha (x + mu (x - x^3)) inside the layer, -+ alpha outside it."""
        if abs(x) >= 1:
            return CTX.mpf(alpha.numerator) / alpha.denominator * CTX.sign(x)
        return of_fraction(alpha) * (x + of_fraction(mu) * (x - x**3))

    top = CTX.findroot(lambda x: CTX.diff(force, x), CTX.mpf("0.65"))
    beta = force(top)
    share = of_fraction(_within(rng, "0.2", "0.8"))
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
    eps, r = _within(rng, "0.01", "0.2"), _within(rng, "1.3", "2.5")
    layer = _polynomial(rng, 1)
    scene = Scene(layer, of_fraction(_within(rng, "0.8", "1.6")), of_fraction(r))
    narrow = Drift.layer(layer.fields[1], eps)

    def physical(k: Any) -> Scene:
        return Scene(narrow, k, of_fraction(r * eps))

    # The noise for which the chance of leaving on the left is the same.
    kappa = CTX.exp(
        CTX.findroot(lambda x: CTX.log(physical(CTX.exp(x)).C / scene.C), (CTX.mpf(-2), CTX.mpf(-1)))
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
    strength = [_within(rng, "-2", "2") for _ in range(3)]
    kappa, drift = of_fraction(_within(rng, "0.2", "2")), _polynomial(rng, 1)
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
    u = of_fraction(_within(rng, "-1", "1"))
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
    am, ap = _within(rng, "0.2", "2"), -_within(rng, "0.2", "2")
    gm, gp = _within(rng, "-2", "2"), _within(rng, "-2", "2")
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
    scene = Scene(_polynomial(rng, 1), CTX.mpf(float(_within(rng, "0.8", "1.6"))), 2)
    a, b = sorted(float(_within(rng, "-1", "1")) for _ in range(2))
    V = numbers(scene)["V"]
    lam, end = float(scene.lam), -2.0

    def e(u: Any) -> Any:
        return np.exp(lam * (V(u) - V(a)))

    def sides(x: float) -> tuple[float, float]:
        whole = gauss(e, end, x)
        return whole / e(x), lam * e(x) * gauss(
            lambda u: gauss(e, end, u) / e(u), end, x
        ) / whole

    fall, climb = min(float(e(b)), 1.0), min(float(1 / e(b)), 1.0)
    at = {"sigma": sides(a)[0], "w": sides(a)[1], "sigma_b": sides(b)[0], "w_b": sides(b)[1]}
    at |= {"lam": lam, "fall": fall, "climb": climb, "int_e": climb * gauss(e, a, b)}
    at["int_inverse"] = fall * gauss(lambda u: 1 / e(u), a, b)
    at["nested"] = fall * gauss(lambda v: gauss(e, a, v) / e(v), a, b)
    return Numbers(**{k: (lambda x=x: float(x)) for k, x in at.items()})


def straight_panel(rng: random.Random) -> Numbers:
    """The three integrals over a panel of constant drift."""
    x = float(_within(rng, "0.2", "4"))

    def double(sign: int) -> Any:
        return gauss(lambda v: np.exp(sign * x * v) * gauss(lambda u: np.exp(-sign * x * u), 0.0, v), 0.0, 1.0)

    return Numbers(
        x=lambda: x,
        int_e=lambda: gauss(lambda u: np.exp(-x * u), 0.0, 1.0),
        nested_down=lambda: np.exp(-x) * double(1),
        nested_up=lambda: double(-1),
    )


def airy_pair(rng: random.Random) -> Numbers:
    """Double integrals of e^{h(s) - h(t)}, h(s) = s^3/3 - Z s, over s < t, by plain sums."""
    Z = float(_within(rng, "-2", "1.5"))
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


# -- scenes on a path to a limit --------------------------------------------------------------

Path = Callable[[random.Random], Callable[[Any], Numbers]]


def weak(rng: random.Random) -> Callable[[Any], Numbers]:
    """A well and a barrier as kappa -> 0, r = 10."""
    drift, hat = _well(rng), of_fraction(_within(rng, "-2", "2"))

    def at(kappa: Any) -> Numbers:
        scene = Scene(drift, kappa, 10)
        known = numbers(scene)
        small = roots(drift)[0] + kappa * hat

        def multiplier() -> Any:
            """Share of the Gaussian term of the well that is in T."""
            term = 2 * CTX.pi / CTX.sqrt(-known["A_1"] * known["A_2"])
            return (scene.T - 10 / known["a_plus"]) / (term * CTX.exp(scene.lam * known["D"]))

        return numbers(
            scene, S=multiplier, uhat=lambda: hat, u=lambda: small, c2=lambda: -known["A_1"]
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
    inside, kappa = _polynomial(rng, -1).fields[1], of_fraction(_within(rng, "0.3", "1"))
    return lambda eps: _narrow(inside, eps, kappa)


def weak_narrow(rng: random.Random) -> Callable[[Any], Numbers]:
    """One well, sliding, in the paper's variables, as kappa/sqrt(eps) -> 0."""
    inside, eps = _bowl(rng).fields[1], _within(rng, "0.01", "0.1")
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
    """Crossing in the paper's variables as r -> 0, with eps = r^2 and kappa = c sqrt(eps), c > 1."""
    inside, c = _polynomial(rng, 1).fields[1], of_fraction(_within(rng, "1", "2"))

    def at(r: Any) -> Numbers:
        eps = Fraction(str(r)) ** 2
        scene = Scene(Drift.layer(inside, eps), c * r, r)
        return numbers(scene, r_phys=lambda: r)

    return at


def one_well(rng: random.Random) -> Callable[[Any], Numbers]:
    """The integral of e^{-lam V} about a well, over that of its parabola, as lam -> oo."""
    drift = _bowl(rng)

    def at(lam: Any) -> Numbers:
        scene = Scene(drift, CTX.sqrt(2 / lam))
        (low,) = roots(drift)
        slopes = taylor(drift, low, 6)
        gaussian = CTX.sqrt(CTX.pi * 2 / (lam * -slopes[1])) * CTX.exp(-lam * drift.potential(low))
        return numbers(
            scene,
            S=lambda: scene.masses[1] / gaussian,
            **{f"c_{j}": (lambda j=j: -slopes[j - 1]) for j in range(2, 7)},
        )

    return at


# -- what is held to what ---------------------------------------------------------------------

#: Exact conclusions: the scenes on which both sides agree, and to which relative error.
EXACT: dict[str, tuple[Draw, float]] = {
    "filippov": (convex, 1e-12),
    "eq:eekappar": (two_scales, 1e-8),
    "noise-amplitude": (noises, 1e-12),
    "eq:phi": (sliding, 1e-12),
    "eq:reducedSDE": (noises, 1e-12),
    "eq:tildexykappa": (two_scales, 1e-8),
    "eq:reducedSDEtilde": (noises, 1e-12),
    "eq:tilder": (two_scales, 1e-12),
    "eq:Ttilde0": (constant, 1e-5),
    "first-integral": (crossing, 1e-12),
    "density-R": (crossing, 1e-10),
    "eq:C": (crossing, 1e-10),
    "eq:Ttilde": (crossing, 1e-10),
    "backward": (crossing, 1e-12),
    "constant-drift": (constant, 1e-12),
    "positive-form": (crossing, 1e-10),
    "positive-density": (sliding, 1e-10),
    "constant-panel": (straight_panel, 1e-12),
    "panel-step": (panel, 1e-10),
    "eq:V": (crossing, 1e-12),
    "eq:V2": (crossing, 1e-12),
    "eq:pss": (sliding, 1e-12),
    "eq:TtildeCzero": (crossing, 1e-10),
    "pair-products": (airy_pair, 1e-5),
    "tails": (sliding, 1e-12),
    "eq:P": (sliding, 1e-12),
    "eq:P2": (sliding, 1e-12),
    "eq:TtildetoT": (two_scales, 1e-10),
    "cubic": (friction_root, 1e-12),
    "folds": (friction, 1e-12),
    "fr1": (friction, 1e-8),
    "fr2": (friction, 1e-8),
    "friction-well": (friction, 1e-8),
    "eq:osc2": (friction, 1e-12),
    "eq:forcePWC": (friction, 1e-12),
    "eq:forcePerturbed": (friction, 1e-12),
    "turning-points": (friction, 1e-12),
    "beta": (friction, 1e-12),
    "eq:osc3": (friction, 1e-12),
    "eq:phifric0": (friction, 1e-12),
    "eq:Vfric": (friction, 1e-12),
}



#: Expansions: the path, its points, and the size of the error where the statement has it in words.
ORDERS: dict[str, tuple[Path, tuple[str, ...], Callable[[Numbers, Any], Any] | None]] = {
    "eq:Plarge": (
        narrow_layer,
        ("1e-2", "1e-3"),
        lambda at, _: (at["epsilon"] / at["kappa_phys"] ** 2) ** 2,
    ),
    "eq:Psmall": (
        weak_narrow,
        ("0.14", "0.1"),
        lambda at, leading: leading * at["kappa_phys"] ** 2 / at["epsilon"],
    ),
    "eq:Tlarge": (short_way, ("1e-2", "1e-3"), lambda at, _: at["r_phys"] ** 2),
    "eq:Tsmall": (equal_terms, ("0.2", "0.14"), lambda at, leading: leading * at["kappa"] ** 4),
    "eq:fourthTerm": (strong, ("1e2", "1e3"), None),
    "first-three": (strong, ("1e2", "1e3"), None),
    "eq:Ttildelarge": (strong, ("1e2", "1e3"), None),
    "saddle-series": (one_well, ("150", "300"), None),
    "eq:Plarge2": (strong_sliding, ("1e2", "1e3"), None),
    "eq:Psmall2": (weak_sliding, ("0.14", "0.1"), None),
    "eq:S": (weak, ("0.2", "0.14"), lambda at, _: at["kappa"] ** 2),
    "laplace-substitution": (weak, ("1e-2", "1e-3"), lambda at, _: at["kappa"] ** 3),
    "eq:secondTerm": (weak, ("0.2", "0.14"), None),
    "eq:fourthTerm2": (weak, ("0.2", "0.14"), lambda at, _: at["kappa"] ** 2),
    "other-pieces": (high_end, ("0.14", "0.1"), None),
    "eq:Ttildesmall": (both_terms, ("0.2", "0.14"), None),
    "threshold": (long_escape, ("0.1", "0.07"), lambda at, leading: leading / at["ell"]),
}


@cache
def scenes(draw: Draw, seed: int) -> Any:
    """A random scene, its numbers worked out once."""
    return draw(random.Random(f"{draw.__name__} {seed}"))


@cache
def on_path(path: Path, seed: int, point: str) -> Numbers:
    """The scene of a path at one of its points."""
    return scenes(path, seed)(CTX.mpf(point))


def exact(label: str, left: Any, result: Any, seeds: range) -> None:
    """Raise unless both sides agree on the scenes of `seeds`."""
    draw, tolerance = EXACT[label]
    for seed in seeds:
        at = scenes(draw, seed)
        if registry.build(label).cases:
            # One function, piece by piece: left of the layer, in it, right of it.
            rows = [
                (left, piece, ChainMap({"u": CTX.mpf(u)}, at))
                for piece, u in zip(result, ("-1.7", "0.3", "1.6"), strict=True)
            ]
        elif isinstance(left, tuple):
            rows = [(a, b, at) for a, b in zip(left, result, strict=True)]
        else:
            rows = [(left, result, at)]
        for a, b, known in rows:
            want, got = value(a, known), value(b, known)
            # Not "gap > tolerance": a NaN must fail.
            assert abs(got - want) <= tolerance * (abs(want) or 1), (seed, a, want, got)


def orders(label: str, left: Any, result: Any, seeds: range) -> None:
    """Raise unless the error is of the stated order: no larger on any drift, no smaller on most."""
    path, points, size = ORDERS[label]
    leading = result.leading if isinstance(result, Expansion) else result
    slopes = []
    for seed in seeds:
        ratios = []
        for point in points:
            at = on_path(path, seed, point)
            got, want = value(leading, at), value(left, at)
            gauge = size(at, got) if size else value(result.gauge, at)
            ratios.append(abs(got - want) / abs(gauge))
        # Positive where the error falls more slowly than the gauge.
        ends = [abs(CTX.log(CTX.mpf(x))) for x in points]
        slopes.append(float(CTX.log(ratios[1] / ratios[0]) / abs(ends[1] - ends[0])))
    assert max(slopes) < 0.35, slopes
    assert sorted(slopes)[len(slopes) // 2] > -0.35, slopes


def four_pieces(_: str, left: Any, result: Any, seeds: range) -> None:
    """The four double integrals, each lam times the time that it stands for."""
    for seed in seeds:
        at = scenes(crossing, seed)
        lam, V = float(at["lam"]), at["V"]
        known = ChainMap(
            {"f": lambda u: np.exp(-lam * V(u)), "g": lambda v: np.exp(lam * V(v))},  # noqa: B023
            at,
        )
        for a, b in zip(left, result, strict=True):
            want, got = value(a, at), lam * value(b, known)
            assert abs(got - want) <= 1e-10 * abs(want), (seed, a, want, got)


def forward_operator(label: str, left: Any, result: Any, seeds: range) -> None:
    """The operator of densities by its weak form: g (L* q) and q (L g) have one integral."""
    u, kappa = sympy.Symbol("u", real=True), sympy.Symbol("kappa", positive=True)
    rate = sympy.Symbol("m", positive=True)
    assert left.name == {"eq:FPE": "Lq", "eq:odeR": "LR"}[label]
    for seed in seeds:
        rng = random.Random(seed)
        q, g, phi = (
            sum(rng.randint(-5, 5) * u**k for k in range(4)) + rng.randint(1, 5) for _ in range(3)
        )
        q, g = (1 - u**2) ** 2 * q, (1 - u**2) ** 2 * g
        numbers = {kappa: sympy.Rational(7, 5), rate: sympy.Rational(3, 2)}
        density = q if label == "eq:FPE" else q / rate
        backward = phi * sympy.diff(g, u) + kappa**2 / 2 * sympy.diff(g, u, 2)
        stated = result.replace(sympy.Function("q"), lambda x, q=q: q.subs(u, x))
        stated = stated.replace(sympy.Function("phi"), lambda x, phi=phi: phi.subs(u, x)).doit()
        both = [
            sympy.integrate(sympy.expand(e.subs(numbers)), (u, -1, 1))
            for e in (g * stated, density * backward)
        ]
        assert both[0] == both[1], (seed, both)


def gaussians(_: str, left: Any, result: Any, seeds: range) -> None:
    """lam times both Gaussian integrals over the line, by sums (the trapezoidal rule)."""
    for seed in seeds:
        rng = random.Random(seed)
        at = {"A_1": -_within(rng, "0.5", "3"), "A_2": _within(rng, "0.5", "3")}
        lam, x = 3.0, np.linspace(-12, 12, 2001)
        both = [np.sum(np.exp(-lam * abs(float(a)) * x**2 / 2)) * (x[1] - x[0]) for a in at.values()]
        want, got = lam * both[0] * both[1], value(result, {k: of_fraction(a) for k, a in at.items()})
        assert left.name == "P"
        assert abs(got - want) <= 1e-12 * want, (seed, want, got)


def regions(_: str, left: Any, result: Any, seeds: range) -> None:
    """How many of the two fields point to the surface; rows a- < 0, > 0 and columns a+ < 0, > 0."""
    assert left.name == "N"
    for row, am in enumerate((-1, 1)):
        for column, ap in enumerate((-1, 1)):
            toward = sum(abs(y + v / 10) < abs(y) for y, v in ((-1, am), (1, ap)))
            assert result[row, column] == toward, (am, ap)


def upper_bound(_: str, left: Any, result: Any, seeds: range) -> None:
    """C of drifts that make it as large as the conditions of the bound let it be.

    V falls steeply from -1 to 0, comes back, keeps its maximum a- r/4 on (0, 1), and falls beyond.
    A drift with jumps is a limit of continuous ones.
    """
    assert left.name == "C_high"
    for seed in seeds:
        rng = random.Random(seed)
        am, ap, r = _within(rng, "0.3", "2"), 1000 * _within(rng, "0.3", "2"), 4 + seed % 3
        top, depth = am * r / 4, Fraction(40)
        edges = tuple(Fraction(n, 1000) for n in (-1000, -999, -1, 0, 1000))
        down, up = 1000 * depth, -1000 * (depth + top)
        drift = Drift(edges, ((am,), (down,), (Fraction(0),), (up,), (Fraction(0),), (ap,)))
        # exp(3 a- r/(2 kappa^2)) is 4 and a little more, or much more.
        for exponent in (Fraction(1387, 1000), Fraction(6), Fraction(30)):
            kappa = CTX.sqrt(of_fraction(3 * am * r / (2 * exponent)))
            at = numbers(Scene(drift, kappa, r))
            assert at["C"] <= value(result, at), (seed, exponent, at["C"], value(result, at))
    for seed in seeds:
        # Where it has to be: no bound says less than C = 0 does.
        assert 0 < value(result, scenes(crossing, seed))


def lower_bound(_: str, left: Any, result: Any, seeds: range) -> None:
    """P of any sliding drift with V <= V(1) on (1 - L, 1), and of one where V is flat: equality."""
    assert left.name == "P_low"
    for seed in seeds:
        rng = random.Random(seed)
        kappa, L = of_fraction(_within(rng, "0.4", "2")), _within(rng, "0.2", "1.9")
        ends = (_within(rng, "0.4", "2"),), (-_within(rng, "0.4", "2"),)
        # A jump of V up to V(1) = h at 1 - L, and no mass left of it (V is huge there).
        h, edge = _within(rng, "-1", "1"), 1 - L
        steep = Fraction(1, 10**6)
        edges = (Fraction(-1), -1 + steep, edge - steep, edge, Fraction(1))
        fields = ((-60 / steep,), (Fraction(0),), ((60 - h) / steep,), (Fraction(0),))
        at = numbers(Scene(Drift(edges, (ends[0], *fields, ends[1])), kappa))
        low = value(result, ChainMap({"L": of_fraction(L)}, at))
        assert abs(low - at["P"]) <= 1e-4 * at["P"], (seed, low, at["P"])
        assert low <= at["P"]


OTHERS: dict[str, Callable[[str, Any, Any, range], None]] = {
    "eq:fourPieces": four_pieces,
    "eq:FPE": forward_operator,
    "eq:odeR": forward_operator,
    "gaussian-step": gaussians,
    "regions": regions,
    "C-bound": upper_bound,
    "L-bound": lower_bound,
}

#: Conclusions without a number, and why.
NO_NUMBER = {
    "eq:cont": "the condition that a smoothing has to meet",
    "eq:scaledSDE": "a field is its value at the origin, up to O(r): Taylor's theorem",
    "eq:scaledSDEx": "one component is picked out",
}


def anchor(label: str, left: Any, result: Any, seeds: range = range(3)) -> None:
    """Raise an AssertionError unless the statement is true of what its left side means."""
    if label in EXACT:
        exact(label, left, result, seeds)
    elif label in ORDERS:
        orders(label, left, result, range(max(5, len(seeds))))
    else:
        OTHERS[label](label, left, result, seeds)


def holds(label: str, left: Any, result: Any) -> bool:
    """True if the statement passes; one that has no value at all does not."""
    try:
        anchor(label, left, result)
    except (AssertionError, ArithmeticError, KeyError, TypeError, ValueError, AttributeError):
        return False
    return True


ANCHORED = [label for label in registry.entries() if label not in NO_NUMBER]


def test_every_label_has_an_anchor_or_a_reason():
    held = [*EXACT, *ORDERS, *OTHERS]
    assert len(held) == len(set(held))
    assert sorted(held) == sorted(ANCHORED)
    assert all(len(reason) > 20 for reason in NO_NUMBER.values())


@pytest.mark.parametrize("label", ANCHORED)
def test_anchor(label):
    derivation = registry.build(label)
    anchor(label, derivation.left, derivation.result)


@pytest.mark.slow
@pytest.mark.parametrize("label", ANCHORED)
def test_anchor_on_more_scenes(label):
    derivation = registry.build(label)
    anchor(label, derivation.left, derivation.result, range(20))


@pytest.mark.parametrize("every", [12, pytest.param(1, marks=pytest.mark.slow)])
def test_no_changed_conclusion_passes(every, capsys):
    survivors, tried = [], 0
    for label in ANCHORED:
        derivation = registry.build(label)
        for change, mutant in islice(mutants(derivation.result), None, None, every):
            tried += 1
            if holds(label, derivation.left, mutant):
                survivors.append(f"{label}: {change}: {mutant}")
    with capsys.disabled():
        print(f"\nanchors: {tried} changed conclusions, {len(survivors)} pass")
        for survivor in survivors:
            print(f"  {survivor}")
    assert not survivors
