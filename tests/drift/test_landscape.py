"""Critical points, wells and barriers, and the potential."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.drift.landscape import float_marks
from tests.problems import FOLD, relative


def shape(drift: sa.Drift) -> list[tuple[float, int, str]]:
    return [(round(float(p.u), 9), p.multiplicity, p.kind) for p in drift.critical_points()]


# -- polynomials -----------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(25))
def test_planted_zeros_are_found(seed: int) -> None:
    rng = random.Random(seed)
    inside = sorted(rng.sample(range(-19, 20), rng.randint(1, 5)))
    zeros = [(F(k, 20), rng.choice([1, 1, 1, 2, 3])) for k in inside]
    outside = [(F(rng.choice([-1, 1]) * rng.randint(21, 60), 20), 1) for _ in range(2)]
    coefficients = [F(rng.choice([-3, 2]))]
    for zero, multiplicity in zeros + outside:
        for _ in range(multiplicity):
            shifted = [F(0), *coefficients]
            for k, c in enumerate(coefficients):
                shifted[k] -= zero * c
            coefficients = shifted
    drift = sa.polynomial(*coefficients)
    points = drift.critical_points()
    assert [(p.multiplicity) for p in points] == [m for _, m in zeros]
    for point, (zero, multiplicity) in zip(points, zeros, strict=True):
        assert relative(point.u, mpmath.mpf(zero.numerator) / zero.denominator) < 1e-15
        before, after = drift.exact_value(zero - F(1, 1000)), drift.exact_value(zero + F(1, 1000))
        assert before is not None
        assert after is not None
        if multiplicity % 2 == 0:
            assert point.kind == "inflection"
        else:
            assert point.kind == ("well" if before > 0 > after else "barrier")
        assert point.stable == (point.kind == "well")
    assert drift.wells() == [p for p in points if p.kind == "well"]
    assert drift.barriers() == [p for p in points if p.kind == "barrier"]


def test_zeros_at_the_ends_and_outside_do_not_count() -> None:
    assert sa.linear(0, 1).critical_points() == []
    assert sa.linear(1, 0).critical_points() == []
    assert sa.polynomial(2, -1).critical_points() == []
    assert sa.polynomial(3).critical_points() == []


def test_a_zero_in_the_middle() -> None:
    for drift in (sa.linear(1, -1), sa.tanh(1, -1, 5), sa.friction(3, 1, 1), sa.sine(1, -1, -1)):
        (point,) = [p for p in drift.critical_points() if abs(p.u) < 1e-9]
        assert abs(point.u) < mpmath.mpf(10) ** -50
        assert point.kind == "well"


def test_zeros_next_to_the_end() -> None:
    (point,) = sa.linear("1e-40", -1).critical_points()
    with mpmath.workdps(60):
        # 1e-40 (1-u)/2 = (1+u)/2
        assert abs(point.u + 1 - 2 * mpmath.mpf(10) ** -40) < mpmath.mpf(10) ** -59


@pytest.mark.parametrize("gap", ["1e-3", "1e-15", "1e-30", "1e-60", "1e-300"])
def test_beside_the_fold(gap: str) -> None:
    assert sa.friction(3, 1, FOLD - F(gap)).critical_points() == []
    well, barrier = sa.friction(3, 1, FOLD + F(gap)).critical_points()
    assert (well.kind, barrier.kind) == ("well", "barrier")
    assert well.multiplicity == barrier.multiplicity == 1
    assert well.u <= barrier.u
    if F(gap) >= F(1, 10**60):
        # A = -gap + 6 (u - 2/3)^2 + 3 (u - 2/3)^3
        with mpmath.workdps(60):
            half = mpmath.sqrt(mpmath.mpf(gap) / 6)
            assert abs((barrier.u - well.u) / (2 * half) - 1) < 0.1 * half + 1e-15
    (point,) = sa.friction(3, 1, FOLD).critical_points()
    assert (point.multiplicity, point.kind) == (2, "inflection")
    assert relative(point.u, mpmath.mpf(2) / 3) < 1e-15


@pytest.mark.parametrize("mu", ["1e4", "1e8"])
def test_large_mu(mu: str) -> None:
    points = sa.friction(mu, 1, "-0.3").critical_points()
    assert [p.kind for p in points] == ["well", "barrier"]
    assert float(points[0].u) == pytest.approx(1.3 / float(F(mu)), rel=1e-3)
    assert 1 - float(points[1].u) == pytest.approx(0.15 / float(F(mu)), rel=1e-3)


# -- other functions -------------------------------------------------------------------------------

ANALYTIC: dict[str, tuple[Callable[[], sa.Drift], list[tuple[float, int, str]]]] = {
    "sine": (
        lambda: sa.sine(1, 1, 2), [(-5 / 6, 1, "well"), (-1 / 6, 1, "barrier")],
    ),
    "sine squared": (
        lambda: sa.Drift("sin(pi*u*3/2)**2"),
        [(-2 / 3, 2, "inflection"), (0.0, 2, "inflection"), (2 / 3, 2, "inflection")],
    ),
    "a triple zero": (lambda: sa.Drift("-(u - 1/4)**3*exp(u)"), [(0.25, 3, "well")]),
    "a steep sigmoid": (lambda: sa.tanh(1, -1, 1000), [(0.0, 1, "well")]),
    "a steep sigmoid, off the middle": (
        lambda: sa.Drift("-tanh(300*(u - 1/7))"), [(1 / 7, 1, "well")],
    ),
    "hill": (lambda: sa.hill(-1, 1, "1/2", n=1), [(-0.5, 1, "barrier")]),
    "no zero": (lambda: sa.Drift("exp(u)"), []),
    "nearly none": (lambda: sa.Drift("(u - 1/3)**2*exp(u) + 10**(-30)"), []),
    "a peak through zero": (
        lambda: sa.Drift("1/2 - exp(-200*(u - 1/3)**2)"),
        [(1 / 3 - 0.058870501, 1, "well"), (1 / 3 + 0.058870501, 1, "barrier")],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ANALYTIC)
def test_zeros_of_analytic_drifts(name: str) -> None:
    make, wanted = ANALYTIC[name]
    try:
        found = shape(make())
    except sa.AccuracyError:
        assert "needle" in name  # what is not resolved may be refused, not missed
        return
    assert [x[1:] for x in found] == [x[1:] for x in wanted]
    for (u, *_), (v, *_) in zip(found, wanted, strict=True):
        assert u == pytest.approx(v, abs=1e-6)


@pytest.mark.parametrize("steepness", ["1e-20", "1e-70", "1e-100", "1e-145"])
def test_digits_that_cancel_are_computed_besides(steepness: str) -> None:
    # A is linear to twice as many digits.
    (well,) = sa.tanh(3, -1, steepness).critical_points()
    assert (well.kind, well.multiplicity) == ("well", 1)
    assert abs(well.u - 0.5) <= max(mpmath.mpf(steepness) ** 2, mpmath.mpf(10) ** -50)


def test_what_cancels_altogether_is_refused() -> None:
    with pytest.raises(sa.AccuracyError, match="1,000 digits do not tell apart"):
        sa.Drift("sin(u)**2 + cos(u)**2 - 1").critical_points()


def test_many_wells() -> None:
    drift = sa.sine(1, -1, 40, waves=20)
    points = drift.critical_points()
    u = np.linspace(-1, 1, 200_000)[1:-1]
    assert len(points) == np.count_nonzero(np.diff(np.sign(drift(u))))
    kinds = [p.kind for p in points]
    assert kinds == ["well", "barrier"] * (len(points) // 2) + ["well"]
    for point in points:
        with mpmath.workdps(50):
            assert abs(-point.u + 40 * mpmath.sin(20 * mpmath.pi * point.u)) < 1e-45


def test_what_cannot_be_told_is_refused() -> None:
    for drift in (sa.polynomial(0), sa.polynomial(0, 0, 0)):
        with pytest.raises(sa.AccuracyError, match="A is 0 on all"):
            drift.critical_points()
    with pytest.raises(sa.InputError, match="no value"):
        sa.friction().critical_points()
    with pytest.raises(sa.InputError, match="z0 is an array"):
        sa.friction(3, 1, [0.1, 0.2]).critical_points()


def test_global_precision_does_not_matter() -> None:
    for make in (lambda: sa.friction(3, 1, "-0.3"), lambda: sa.sine(1, 1, 4, waves=2)):
        with mpmath.workdps(5):
            low = [p.u for p in make().critical_points()]
        assert low == [p.u for p in make().critical_points()]


def test_marks_are_zeros_and_extremes() -> None:
    drift = sa.Drift("sin(7*u)")
    marks = float_marks(drift.evaluate_float, drift.spread)
    wanted = [k * np.pi / 14 for k in range(-4, 5)]
    for mark in wanted:
        assert min(abs(x - mark) for x in marks) < 1e-9
    with pytest.raises(sa.AccuracyError, match="not finite"):
        float_marks(lambda u: np.full(u.shape, np.inf), drift.spread)


@pytest.mark.parametrize("width", ["1e-3", "1e-6", "1e-9"])
def test_wells_of_a_needle_are_found(width: str) -> None:
    # 1 - 2 exp(-x^2) of x = (u - 0.3)/width vanishes at x = -+sqrt(log 2)
    points = sa.Drift(f"1 - 2*exp(-((u - 0.3)/{width})**2)").critical_points()
    assert [p.kind for p in points] == ["well", "barrier"]
    with mpmath.workdps(50):
        half = mpmath.mpf(width) * mpmath.sqrt(mpmath.log(2))
        for point, sign in zip(points, (-1, 1), strict=True):
            wanted = mpmath.mpf(3) / 10 + sign * half
            assert abs(point.u - wanted) <= mpmath.mpf(10) ** -45


# -- the potential ---------------------------------------------------------------------------------

POTENTIALS: dict[str, tuple[Callable[[], sa.Drift], Callable[[Any], Any]]] = {
    # V(u) = -int_{-1}^u A in closed form
    "friction": (
        lambda: sa.friction(3, 1, "-0.3"),
        lambda u: -(mpmath.mpf("1.3") * (u + 1) - 2 * (u**2 - 1) + mpmath.mpf(3) / 4 * (u**4 - 1)),
    ),
    "tanh": (
        lambda: sa.tanh(1, -1, 5),
        lambda u: (mpmath.log(mpmath.cosh(5 * u)) - mpmath.log(mpmath.cosh(5)))
        / (5 * mpmath.tanh(5)),
    ),
    "steep tanh": (
        lambda: sa.tanh(1, -1, 1000),
        lambda u: (mpmath.log(mpmath.cosh(1000 * u)) - mpmath.log(mpmath.cosh(1000)))
        / (1000 * mpmath.tanh(1000)),
    ),
    "exponential": (
        lambda: sa.Drift("exp(3*u) - 1"),
        lambda u: -((mpmath.exp(3 * u) - mpmath.exp(-3)) / 3 - u - 1),
    ),
    "peak": (
        lambda: sa.Drift("20*exp(-2000*(u - 1/3)**2)"),
        lambda u: -20 * mpmath.sqrt(mpmath.pi / 2000) / 2 * (
            mpmath.erf(mpmath.sqrt(2000) * (u - mpmath.mpf(1) / 3))
            - mpmath.erf(mpmath.sqrt(2000) * (-mpmath.mpf(4) / 3))
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", POTENTIALS)
def test_potential_in_float64(name: str) -> None:
    make, closed = POTENTIALS[name]
    drift = make()
    u = np.array([-3.0, -1.0, -0.7, 0.0, 0.3, 0.5, 1.0, 4.0])
    found = drift.potential_at(u)
    with mpmath.workdps(30):
        inside = np.array([float(closed(mpmath.mpf(max(-1, min(1, x))))) for x in u])
    a_minus, a_plus = (float(a) for a in drift.ends)
    wanted = inside - a_minus * np.minimum(u + 1, 0) - a_plus * np.maximum(u - 1, 0)
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-12)
    assert drift.potential_at(0.3) == pytest.approx(wanted[4], rel=1e-10)


@pytest.mark.parametrize("make", [lambda: sa.friction(3, 1, "-0.3"), lambda: sa.hill(1, -2, "1/2")])
def test_symbolic_potential_and_drift_agree(make: Callable[[], sa.Drift]) -> None:
    import sympy

    drift, u = make(), sympy.Symbol("u", real=True)
    V, phi = drift.potential(), drift.phi()
    for x in (F(-3), F(-1, 2), F(1, 4), F(5, 2)):
        at = sympy.Rational(x.numerator, x.denominator)
        assert float(V.diff(u).subs(u, at)) == pytest.approx(-float(phi.subs(u, at)))
        assert float(V.subs(u, at)) == pytest.approx(drift.potential_at(float(x)), rel=1e-11)
        assert float(phi.subs(u, at)) == pytest.approx(drift(float(x)))
    assert V.subs(u, -1) == 0


def test_potential_of_free_and_of_array_parameters() -> None:
    import sympy

    free = sa.friction(mu=3, alpha=1).potential()
    assert {s.name for s in free.free_symbols} == {"u", "z0"}
    value = free.subs({sympy.Symbol("z0", real=True): 0, sympy.Symbol("u", real=True): 1})
    assert value == sympy.Integer(-2)
    many = sa.friction(3, 1, [0.0, 1.0, 2.0])
    assert many.potential_at(1.0) == pytest.approx([-2.0, 0.0, 2.0], abs=1e-14)
    assert many.potential_at([[0.0], [1.0]]).shape == (2, 3)
    assert many([[0.0], [1.0]]).shape == (2, 3)


def test_shapes_that_do_not_broadcast_are_refused() -> None:
    many = sa.friction(3, 1, [0.0, 1.0, 2.0])
    for call in (many, many.potential_at):
        with pytest.raises(sa.InputError, match=r"broadcast"):
            call([0.1, 0.2])
