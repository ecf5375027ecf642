"""The public verbs obey what their integrals obey: mirrors, scaling, sums, their equations."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction as F

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from tests.problems import BY_NAME, relative

MIRRORS: list[tuple[str, Callable[[], sa.Drift], Callable[[], sa.Drift]]] = [
    ("friction", lambda: sa.friction(3, 1, "-0.3"), lambda: sa.friction(3, 1, "2.3")),
    ("linear", lambda: sa.linear(1, "-1/3"), lambda: sa.linear("1/3", -1)),
    ("sine", lambda: sa.sine(1, 2, 5, waves=2), lambda: sa.sine(-2, -1, 5, waves=2)),
    ("tanh", lambda: sa.tanh(1, "-1/3", 7), lambda: sa.tanh("1/3", -1, 7)),
    ("hill", lambda: sa.hill(1, -2, "1/3", n=3),
     lambda: sa.Drift("-(1 - 3*x**3*(1 + 1/27)/(x**3 + 1/27))".replace("x", "((1 - u)/2)"))),
    ("polynomial", lambda: sa.polynomial(1, -2, "1/3", 3),
     lambda: sa.polynomial(-1, -2, "-1/3", 3)),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "make", "mirrored"), MIRRORS, ids=[m[0] for m in MIRRORS])
@pytest.mark.parametrize("start", ["0", "-1/7", "1", "3/2", "-19/10"])
def test_mirror_image(
    kind: str, make: Callable[[], sa.Drift], mirrored: Callable[[], sa.Drift], start: str
) -> None:
    kappa, r, other = "0.3", "2", str(-F(start))
    for verb, swap in ((sa.escape_time, False), (sa.exit_probability, True)):
        here = verb(make(), kappa, r, start=start, dps=25)
        options = {"complement": True} if swap else {}
        there = verb(mirrored(), kappa, r, start=other, dps=25, **options)
        assert relative(here, there) <= 2e-25, kind
        here, there = (
            verb(make(), kappa, r, start=start, log=True),
            verb(mirrored(), kappa, r, start=other, log=True, **options),
        )
        assert abs(here - there) <= 2e-12 * max(1, abs(here)), kind


@pytest.mark.parametrize("name", ["friction r=3", "linear sliding, uneven", "sine", "quintic"])
@pytest.mark.parametrize("factor", ["3", "1/1000000", "1e30"])
def test_scaling_drift_and_noise_together_scales_time(name: str, factor: str) -> None:
    # phi -> c phi and kappa^2 -> c kappa^2 leave lam V as it is.
    problem, c = BY_NAME[name], F(factor) ** 2
    scaled = sa.Drift(problem.make().expression() * sympy.Rational(c.numerator, c.denominator))
    kappa = F(problem.kappa) * F(factor)
    for dps in (25, None):
        allowed = 2e-25 if dps else 4e-12
        T = problem.ask("T", dps=dps)
        faster = sa.escape_time(scaled, kappa, problem.r, start=problem.start, dps=dps)
        with mpmath.workdps(40):
            assert relative(faster * (mpmath.mpf(c.numerator) / c.denominator), T) <= allowed
        C = problem.ask("C", dps=dps)
        same = sa.exit_probability(scaled, kappa, problem.r, start=problem.start, dps=dps)
        assert relative(same, C) <= allowed * max(1, abs(float(mpmath.log(C))))


INSIDE = ["friction k=0.3", "linear sliding, uneven", "expression, cubic", "z0=-1e8"]


@pytest.mark.parametrize(
    "name", [*INSIDE, *(pytest.param(n, marks=pytest.mark.slow) for n in ("tanh", "sine weak"))]
)
def test_backward_equation(name: str) -> None:
    # (kappa^2/2) T'' + phi T' = -1 and (kappa^2/2) C'' + phi C' = 0
    problem = BY_NAME[name]
    drift, kappa = problem.make(), F(problem.kappa)
    for x in (F(-13, 10), F(1, 3), F(6, 5)):
        inside, u = sympy.Rational(max(F(-1), min(F(1), x))), sympy.Symbol("u", real=True)
        phi = F(str(drift.expression().subs(u, inside).evalf(120)))
        width = kappa**2 / (1 + abs(phi)) / 10**12  # far below the shortest length
        for verb, source in ((sa.escape_time, 1), (sa.exit_probability, 0)):
            left, here, right = (
                verb(drift, kappa, problem.r, start=x + k * width, dps=100) for k in (-1, 0, 1)
            )
            with mpmath.workdps(100):
                h = mpmath.mpf(width.numerator) / width.denominator
                noise = mpmath.mpf((kappa**2).numerator) / (kappa**2).denominator / 2
                second = noise * (left - 2 * here + right) / h**2
                first = mpmath.mpf(phi.numerator) / phi.denominator * (right - left) / (2 * h)
                size = abs(second) + abs(first) + source
                assert abs(second + first + source) <= mpmath.mpf(10) ** -15 * size


SLIDING = ["linear sliding", "linear sliding, uneven", "friction sliding", "tanh"]


@pytest.mark.parametrize("name", SLIDING)
def test_density_integrates_to_one_and_to_the_occupation(name: str) -> None:
    problem = BY_NAME[name]
    drift, kappa = problem.make(), problem.kappa
    x, w = np.polynomial.legendre.leggauss(20)
    pieces = 40
    edges = np.linspace(-1, 1, pieces + 1)
    nodes = edges[:-1, None] + (x + 1) / pieces
    inside = (sa.stationary_density(drift, kappa, nodes) @ w).sum() / pieces
    assert inside == pytest.approx(sa.occupation(drift, kappa), rel=1e-11)
    # the tails are exponentials, p(±1) kappa^2/(2 |a±|)
    ends = sa.stationary_density(drift, kappa, [-1.0, 1.0])
    slopes = np.array([float(abs(a)) for a in drift.ends])
    tails = (ends * float(F(kappa)) ** 2 / 2 / slopes).sum()
    assert tails == pytest.approx(sa.occupation(drift, kappa, complement=True), rel=1e-11)
    assert inside + tails == pytest.approx(1, rel=1e-11)
