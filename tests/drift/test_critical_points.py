"""Zeros of A with their multiplicities and kinds."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction as F

import mpmath
import pytest
from mpmath import mpf

import symasym as sa


def places(drift: sa.Drift) -> list[tuple[int, str]]:
    return [(p.multiplicity, p.kind) for p in drift.critical_points()]


def product_of(zeros: list[tuple[F, int]], lead: F) -> list[F]:
    """Ascending coefficients of lead (u - z)^m ..., by multiplying out."""
    c = [lead]
    for zero, multiplicity in zeros:
        for _ in range(multiplicity):
            c = [a - zero * b for a, b in zip([F(0), *c], [*c, F(0)], strict=True)]
    return c


@pytest.mark.parametrize("seed", range(12))
def test_planted_zeros_of_polynomials(seed: int) -> None:
    rng = random.Random(seed)
    inside = [F(k, 41) for k in sorted(rng.sample(range(-40, 41), rng.randint(1, 6)))]
    inside.insert(1, inside[0] + F(1, 10 ** rng.choice([3, 20, 100])))
    zeros = [(z, rng.choice([1, 1, 1, 2, 3])) for z in inside]
    outside = [(F(s), rng.randint(0, 2)) for s in (-1, 1)] + [(F(5, 4), 50 if seed == 0 else 1)]
    lead = F(rng.choice([-3, 2]), 10 ** rng.choice([0, 200]))
    drift = sa.polynomial(*product_of(zeros + outside, lead))
    points = drift.critical_points()
    assert [p.multiplicity for p in points] == [m for _, m in zeros]
    with mpmath.workdps(70):
        for point, (z, m) in zip(points, zeros, strict=True):
            assert abs(point.u - mpmath.mpf(z.numerator) / z.denominator) < 1e-58
            # The sign of A to the right is the product of the signs of its factors.
            right = (lead > 0) == (sum(n for w, n in zeros + outside if w > z) % 2 == 0)
            wanted = "barrier" if right else "well"
            assert point.kind == (wanted if m % 2 else "inflection")
    assert drift.wells() + drift.barriers() == [
        p for kind in ("well", "barrier") for p in points if p.kind == kind
    ]


def test_zeros_at_and_beside_the_ends() -> None:
    for A in ("1 + u", "1 - u", "2 - u", "3", "(u - 1)*exp(u)", "-(u + 1)*exp(u)"):
        assert places(sa.Drift(A)) == []
    assert places(sa.Drift("(u + 1)**2*exp(u)*(1/3 - u)")) == [(1, "well")]
    tilted = sa.Drift("u - u**3 + 1/10", layer=None)
    assert [(p.kind, round(float(p.u), 6)) for p in tilted.critical_points()] == [
        ("well", -0.945649), ("barrier", -0.101031), ("well", 1.046681),
    ]  # fmt: skip
    with pytest.raises(sa.RegionError):
        sa.Drift("tanh(u) - u", layer=None).wells()
    (point,) = sa.linear("1e-40", -1).critical_points()
    with mpmath.workdps(60):  # 1e-40 (1 - u)/2 = (1 + u)/2
        assert abs(point.u + 1 - 2 * mpmath.mpf(10) ** -40) < mpmath.mpf(10) ** -59


# -- other functions -------------------------------------------------------------------------------

WELL, BARRIER, FOLD_POINT = (1, "well"), (1, "barrier"), (2, "inflection")
# Drifts, what is at their zeros, and these in closed form.
ANALYTIC: list[tuple[Callable[[], sa.Drift], list[tuple[int, str]], Callable[[], list[object]]]] = [
    (lambda: sa.tanh(1, -1, "1e6"), [WELL], lambda: [0]),
    (lambda: sa.tanh(3, -1, "1e-145"), [WELL], lambda: [mpf(1) / 2]),
    (lambda: sa.sine(1, 1, 2), [WELL, BARRIER], lambda: [-mpf(5) / 6, -mpf(1) / 6]),
    (lambda: sa.hill(-1, 1, "1/2", n=1), [BARRIER], lambda: [-mpf(1) / 2]),
    (
        lambda: sa.Drift("pi*u**2 - sqrt(2)/4"), [WELL, BARRIER],
        lambda: [s * mpmath.sqrt(mpmath.sqrt(2) / (4 * mpmath.pi)) for s in (-1, 1)],
    ),
    (
        lambda: sa.Drift("sin(3*pi*u/2)**2"), [FOLD_POINT] * 3,
        lambda: [-mpf(2) / 3, 0, mpf(2) / 3],
    ),
    (lambda: sa.Drift("-(u - 1/4)**3*exp(u)"), [(3, "well")], lambda: [mpf(1) / 4]),
    (lambda: sa.Drift("cosh(u) - 1 - u**2/2"), [(4, "inflection")], lambda: [0]),
    (lambda: sa.Drift("(u - 1/3)**2*exp(u) + 10**(-30)"), [], lambda: []),
    (
        lambda: sa.Drift("((u - 1/3)**2 - 10**(-30))*exp(u)"), [WELL, BARRIER],
        lambda: [mpf(1) / 3 + s / mpf(10) ** 15 for s in (-1, 1)],
    ),
    (
        lambda: sa.Drift("1 - 2*exp(-((u - 3/10)*10**9)**2)"), [WELL, BARRIER],
        lambda: [mpf(3) / 10 + s * mpmath.sqrt(mpmath.log(2)) / 10**9 for s in (-1, 1)],
    ),
    (lambda: sa.Drift("tanh(u) - tanh(1/2)"), [BARRIER], lambda: [mpf(1) / 2]),
    (lambda: sa.Drift("exp(50*u) - exp(-20)"), [BARRIER], lambda: [-mpf(2) / 5]),
    (lambda: sa.Drift("asin(u/2) - 1/10"), [BARRIER], lambda: [2 * mpmath.sin(mpf(1) / 10)]),
]  # fmt: skip


@pytest.mark.parametrize(("make", "kinds", "closed"), ANALYTIC)
def test_zeros_in_closed_form(
    make: Callable[[], sa.Drift], kinds: list[tuple[int, str]], closed: Callable[[], list[object]]
) -> None:
    drift = make()
    assert places(drift) == kinds
    with mpmath.workdps(70):
        for point, u in zip(drift.critical_points(), closed(), strict=True):
            assert abs(point.u - u) <= mpf(10) ** -59


def test_what_cannot_be_told_is_refused() -> None:
    for drift, why in (
        (sa.polynomial(0), "A is 0 on all"),
        (sa.Drift("sin(u)**2 + cos(u)**2 - 1"), "do not tell apart"),
        (sa.Drift("(sin(u) - 1/3)**2"), "do not tell apart"),
    ):
        with pytest.raises(sa.AccuracyError, match=why):
            drift.critical_points()
    with pytest.raises(sa.InputError, match="no value"):
        sa.friction().critical_points()
    with pytest.raises(sa.InputError, match="z0 is an array"):
        sa.friction(3, 1, [0.1, 0.2]).critical_points()
