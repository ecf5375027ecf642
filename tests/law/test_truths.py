"""The law of the exit time: closed forms to 30 digits, a collocation, a simulation."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest
from mpmath import mp, mpc, mpf
from scipy.integrate import quad

import symasym as sa
from tests.law.scenes import TABLE, function

# -- closed forms ----------------------------------------------------------------------------------


def powers(a: str, rest: str = "0") -> Callable[[Any], Any]:
    """e^{m u} of kappa^2/2 m^2 + (a - rest kappa^2) m = s."""

    def roots(s: Any, kappa: Any) -> Any:
        drift = mpf(a) - mpf(rest) * kappa**2
        root = mp.sqrt(drift**2 + 2 * s * kappa**2)
        return (-drift + root) / kappa**2, (-drift - root) / kappa**2

    return lambda s, kappa: [
        (lambda u, m=m: mp.exp(m * u), lambda u, m=m: m * mp.exp(m * u)) for m in roots(s, kappa)
    ]


def in_logarithms(basis: Any) -> Any:
    """The same of log u; derivatives are not needed."""
    return lambda s, kappa: [(lambda u, f=f: f(mp.log(u)), None) for f, _ in basis(s, kappa)]


def kummer(s: Any, kappa: Any) -> Any:
    """Solutions of kappa^2/2 y'' - u y' = s y (DLMF 13.2)."""

    def even(u: Any, k: int = 0) -> Any:
        return mp.hyp1f1(s / 2 + k, mpf(1) / 2 + k, (u / kappa) ** 2)

    def odd(u: Any) -> Any:
        return u * mp.hyp1f1(s / 2 + mpf(1) / 2, mpf(3) / 2, (u / kappa) ** 2)

    return [(even, lambda u: 2 * s * u / kappa**2 * even(u, 1)), (odd, None)]


class Closed(NamedTuple):
    """A drift, kappa, ends, a start, an end that reflects, and two solutions of L y = s y."""

    drift: sa.Drift
    kappa: str
    ends: tuple[str, str]
    start: str
    reflecting: Any
    basis: Any

    def law(self, dps: int | None = 30) -> Any:
        numbers = {"ends": self.ends, "start": self.start, "reflecting": self.reflecting}
        return sa.exit_law(self.drift, self.kappa, **numbers, dps=dps, full=True)

    def rows(self, s: Any) -> tuple[Any, Any]:
        """The conditions at both ends, and the solutions at the start."""
        basis = self.basis(s, mpf(self.kappa))
        rows = [
            [pair[side == self.reflecting](mpf(x)) for pair in basis]
            for side, x in zip(("left", "right"), self.ends, strict=True)
        ]
        return mp.matrix(rows), [f(mpf(self.start)) for f, _ in basis]

    def laplace(self, s: Any, sides: tuple[int, int] = (1, 1)) -> Any:
        rows, here = self.rows(s)
        wanted = [
            x * (side != self.reflecting) for x, side in zip(sides, ("left", "right"), strict=True)
        ]
        c = mp.lu_solve(rows, mp.matrix(wanted))
        return c[0] * here[0] + c[1] * here[1]


CLOSED = {
    "Brownian": Closed(sa.polynomial(0), "0.7", ("-1", "1.5"), "0.25", None, powers("0")),
    "Brownian, reflected": Closed(
        sa.Drift("0*u", layer=None), "1.3", ("-1", "1.5"), "0.25", "left", powers("0")
    ),
    "constant": Closed(sa.polynomial(2), "0.7", ("-1", "1.5"), "0.25", None, powers("2")),
    "Ornstein-Uhlenbeck": Closed(
        sa.Drift("-u", layer=None), "0.8", ("-1", "1.5"), "0.25", None, kummer
    ),
    "dry friction": Closed(  # by symmetry: half of it
        sa.Drift.piecewise([("1", 0), ("-1", None)]), "0.9", ("-1.5", "1.5"), "0", None,
        powers("-1"),
    ),
    "geometric, Ito": Closed(
        sa.Drift("u/4", layer=None, noise="u"), "0.6", ("0.5", "2"), "1.25", None,
        in_logarithms(powers("0.25", "0.5")),
    ),
    "geometric, Stratonovich": Closed(
        sa.Drift("u/4", layer=None, noise="u", ito="stratonovich"), "0.6", ("0.5", "2"), "1.25",
        None, in_logarithms(powers("0.25")),
    ),
}  # fmt: skip
HALF = Closed(sa.polynomial(-1), "0.9", ("0", "1.5"), "0", "left", powers("-1"))


@pytest.mark.every(2)
@pytest.mark.parametrize("name", CLOSED)
def test_closed_form(name: str) -> None:
    scene = CLOSED[name]
    law, symmetric = scene.law(), name == "dry friction"
    with mp.workdps(50):
        truth = HALF if symmetric else scene

        large = 20 if "geometric" in name else 1000
        for s in (mpf("0.5"), mpf(large), mpc("0.2", -large / 50)):
            holds(law.laplace(s), truth.laplace(s))
        # Cauchy's integral over a circle inside the first pole.
        radius = mpf(float(law.rate)) / 5
        around = [radius * mp.expjpi(mpf(k + 0.5) / 32) for k in range(64)]
        values = [truth.laplace(s) for s in around]

        def moment(k: int) -> Any:
            return (-1) ** k * mp.fac(k) * sum(
                x / s**k for x, s in zip(values, around, strict=True)
            ).real / 64  # fmt: skip

        for k in (1, 5):
            holds(law.moment(k), moment(k))
        holds(law.variance, moment(2) - moment(1) ** 2)
        for side, wanted in (("left", (1, 0)), ("right", (0, 1))):
            if not symmetric and side != scene.reflecting:
                given = getattr(law, side)
                p, s = truth.laplace(mpf(10) ** -45, wanted), mpc(3, 1)
                holds(given.probability, p)
                holds(given.laplace(s), truth.laplace(s, wanted) / p)
        for found in law.rates(1 if symmetric else 2):
            zero = mp.findroot(lambda x: mp.det(truth.rows(-x)[0]), found.value, tol=1e-60)
            holds(found, zero.real)
        t = moment(1) / 2
        with mp.workdps(30):
            cdf = mp.invertlaplace(lambda s: truth.laplace(s) / s, t, method="talbot", degree=40)
        holds(scene.law(None).cdf(t), cdf, 14)


def holds(found: sa.Estimate, true: Any, digits: int = 29) -> None:
    """The value is within its error, and right to so many digits."""
    assert abs(found.value - true) <= found.error + abs(true) * mpf(10) ** -(digits + 2)
    assert found.error <= abs(true) * mpf(10) ** -digits


def test_eigenvalues_in_closed_form() -> None:
    """None is left out: a^2/(2 kappa^2) + (k pi kappa/w)^2/2."""
    law = sa.exit_law(sa.polynomial("1.5"), "0.7", ends=("-1", "1.5"), dps=30, full=True)
    with mp.workdps(45):
        for k, found in enumerate(law.rates(5), 1):
            kappa = mpf("0.7")
            holds(found, mpf("1.5") ** 2 / (2 * kappa**2) + (k * mp.pi * kappa / 2.5) ** 2 / 2)


@pytest.mark.parametrize(
    ("kappa", "r", "t", "names"),
    [
        ("0.25", "2", "0.6", ["cdf"]),
        ("0.25", "2", "1.8", ["cdf", "survival"]),
        ("0.25", "2", "2.4", ["cdf", "pdf"]),
        ("0.1", "1", "1.3", ["cdf"]),
    ],
)
def test_narrow_laws_and_rare_times(kappa: str, r: str, t: str, names: list[str]) -> None:
    """The inverse Gaussian law of a constant drift: the other side is left e^-64 times or less."""
    law, mean = sa.exit_law(sa.polynomial(1), kappa, r, full=True), mpf(r)
    shape = (mean / mpf(kappa)) ** 2

    def normal(x: mpf) -> mpf:
        return mp.erfc(-x / mp.sqrt(2)) / 2

    with mp.workdps(60):
        first, other = (
            mp.sqrt(shape / mpf(t)) * x for x in (mpf(t) / mean - 1, -mpf(t) / mean - 1)
        )
        true = {
            "cdf": normal(first) + mp.exp(2 * shape / mean) * normal(other),
            "survival": normal(-first) - mp.exp(2 * shape / mean) * normal(other),
            "pdf": mp.sqrt(shape / (2 * mp.pi * mpf(t) ** 3)) * mp.exp(-(first**2) / 2),
        }
        for name in names:
            found = getattr(law, name)(t)
            assert abs(found.value - true[name]) <= mpf(found.error) + true[name] * mpf("1e-15")
            assert found.error < 1e-15 * true[name]
    # Far beyond the mean P(tau > t) is below any digit by Markov's inequality.
    found = law.cdf(40)
    assert found.value == 1.0
    assert found.error < 1e-20


@pytest.mark.parametrize(
    ("a", "kappa", "r", "times"),
    [(0, "1", "1", ("0.01", "0.4", "100")), (1, "1", "5", ("18", "26", "60"))],
)
def test_survival_of_a_constant_drift(a: int, kappa: str, r: str, times: tuple[str, ...]) -> None:
    """Theta series, from early times to late ones."""
    law = sa.exit_law(sa.polynomial(a), kappa, r, full=True)
    with mp.workdps(50):
        noise, width = mpf(kappa) ** 2, 2 * mpf(r)
        sides = mp.exp(a * mpf(r) / noise), mp.exp(-a * mpf(r) / noise)
        for t in times:
            survival = density = mpf(0)
            for k in range(1, 400, 2):
                rate = a**2 / (2 * noise) + noise * (k * mp.pi / width) ** 2 / 2
                size = noise * mp.pi * k / width**2 * (-1) ** (k // 2) * sum(sides)
                density += size * mp.exp(-rate * mpf(t))
                survival += size / rate * mp.exp(-rate * mpf(t))
            holds(law.survival(t), survival, 14)
            holds(law.cdf(t), 1 - survival, 14)
            holds(law.pdf(t), density, 14)


# -- collocation -----------------------------------------------------------------------------------


@pytest.mark.every(4)
@pytest.mark.parametrize("name", TABLE)
def test_collocation(name: str) -> None:
    scene = TABLE[name]
    law, known = scene.law(), scene.collocation(64)
    one, first, second = known.moments()
    assert law.mean == pytest.approx(first, rel=1e-10)
    assert law.moment(2) == pytest.approx(second, rel=1e-10)
    assert law.variance == pytest.approx(second - first**2, rel=1e-9)
    for s in (0.7, 5.0, -law.rate.value * 0.5, 0.3 + 2j):
        s = s if isinstance(s, complex) else float(s)
        assert law.laplace(s) == pytest.approx(known.laplace(s), rel=1e-8)
    sides = [("left", (1, 0)), ("right", (0, 1))]
    given = [(getattr(law, k), known.moments(x), x) for k, x in sides if k != scene.reflecting]
    for side, (p, mean, square), x in given:
        assert side.probability == pytest.approx(p, rel=1e-10)
        assert side.mean == pytest.approx(mean / p, rel=1e-9)
        assert side.variance == pytest.approx(square / p - (mean / p) ** 2, rel=1e-8)
        assert side.laplace(0.7) == pytest.approx(known.laplace(0.7, x) / p, rel=1e-8)
    rates, c = known.modes()
    assert law.rates(3) == pytest.approx(rates[:3].real, rel=1e-8)
    times = np.array([0.3, 1.0, 4.0]) * law.mean
    times = times[2:] if scene.sigma != "1" else times  # early ones take seconds there
    survival = [(c * np.exp(-rates * t)).sum().real for t in times]
    assert law.survival(times) == pytest.approx(survival, abs=1e-8)
    assert law.cdf(times) == pytest.approx(1 - np.array(survival), abs=1e-8)
    assert law.pdf(times[-1]) == pytest.approx((c * rates * np.exp(-rates * times[-1])).sum().real)
    found = law.quantile(law.cdf(times[-2:]))
    assert found == pytest.approx(times[-2:], rel=1e-11)
    assert law.quantile(law.cdf(times[-1])) == pytest.approx(found[-1], rel=1e-14)


# -- stationary states -----------------------------------------------------------------------------

STATES = [
    ("u - u**3", "u**2/2 - u**4/4", None), ("-u", "-u**2/2", None), ("1 - u", "u - u**2/2", None),
    ("-u*(2 + sin(u))**2", "-u**2/2", "2 + sin(u)"),
    ("-u*(1 + u**2/4)**2", "-u**2/2", "1 + u**2/4"),
]  # fmt: skip


@pytest.mark.every(2)
@pytest.mark.parametrize(("phi", "minus_v", "noise"), STATES)
@pytest.mark.parametrize("rule", [0, "stratonovich"])
def test_stationary_shares_by_quadrature(phi: str, minus_v: str, noise: Any, rule: Any) -> None:
    kappa, drift = 0.7, sa.Drift(phi, layer=None, noise=noise, ito=rule)
    power, sigma, exponent = (2 if rule == 0 else 1), function(noise or "1"), function(minus_v)

    def density(u: float) -> float:
        return float(np.exp(2 / kappa**2 * exponent(u)) / sigma(u) ** power)

    def mass(a: float, b: float) -> float:
        return float(quad(density, a, b, epsabs=0, epsrel=1e-12, limit=200)[0])

    for a, b in ((-1.0, 0.5), (0.25, 1.5)):
        wanted = mass(a, b) / mass(-1.5, 2)
        found = sa.occupation(drift, kappa, interval=(a, b), ends=(-1.5, 2))
        assert found == pytest.approx(wanted, rel=1e-10)
        by_balls = sa.occupation(drift, kappa, interval=(a, b), ends=(-1.5, 2), dps=15)
        assert float(by_balls) == pytest.approx(wanted, rel=1e-10)
        rest = sa.occupation(drift, [kappa], interval=(a, b), ends=(-1.5, 2), complement=True)
        assert rest[0] == pytest.approx(1 - wanted, rel=1e-10)
    if noise in (None, "1 + u**2/4") and (phi[0] != "-" or noise is None):
        whole = mass(-8, 8)
        assert sa.occupation(drift, kappa, interval=(-1, 2)) == pytest.approx(mass(-1, 2) / whole)
        found = sa.stationary_density(drift, kappa, 0.3)
        assert found == pytest.approx(density(0.3) / whole, rel=1e-10)


# -- simulation ------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("name", ["double well", "Ito", "Stratonovich", "jumps"])
def test_simulation(name: str) -> None:
    """Euler's steps (Heun's for Stratonovich), ends moved in by 0.5826 kappa sigma sqrt(dt)."""
    scene, dt, many = TABLE[name], 2e-3, 20_000
    random, kappa, (low, high) = np.random.default_rng(1), float(scene.kappa), scene.ends
    parts, cuts = [function(a) for a, _ in scene.phi], [float(x) for _, x in scene.phi[:-1]]
    sigma = function(scene.sigma)
    u, t, times = np.full(many, float(scene.start)), 0.0, []
    while len(u) and t < 200:
        t += dt
        which = np.searchsorted(cuts, u)
        phi = np.choose(which, [f(u) for f in parts])
        dw = kappa * np.sqrt(dt) * random.standard_normal(len(u))
        weight = sigma(u)
        if scene.ito:
            weight = (weight + sigma(u + weight * dw)) / 2
        u = u + phi * dt + weight * dw
        shift = 0.5826 * kappa * sigma(u) * np.sqrt(dt)
        out = (u < float(low) + shift) | (u > float(high) - shift)
        times += [t] * out.sum()
        u = u[~out]
    law = scene.law()
    error = law.std / np.sqrt(many)
    assert abs(np.mean(times) - law.mean) < 4 * error + 0.01 * law.mean
    share = np.mean(np.array(times) <= law.mean)
    assert abs(share - law.cdf(law.mean)) < 0.02
