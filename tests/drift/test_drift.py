"""Drifts: parameters, regions, continuity, critical points, potentials, and the paper's numbers."""

from __future__ import annotations

import pickle
from fractions import Fraction as F

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa

READY_MADE = {
    "friction": sa.friction(mu=3, alpha=1, z0="-0.4"),
    "linear": sa.linear("1/2", -2),
    "polynomial": sa.polynomial("1/2", -1, 0, 2),
    "sine": sa.sine(1, "1/3", 4, waves=2),
    "tanh": sa.tanh(1, -1, 5),
    "hill": sa.hill("1/2", -1, K="1/2", n=3),
}


@pytest.mark.parametrize("name", READY_MADE)
def test_numbers_are_those_of_the_expression(name: str) -> None:
    drift = READY_MADE[name]
    u = sympy.Symbol("u", real=True)
    points = np.linspace(-1, 1, 9)
    wanted = [float(drift.expression().subs(u, sympy.Float(x, 30))) for x in points]
    assert np.allclose(drift(points), wanted, rtol=1e-13, atol=1e-13)
    assert drift(-7) == pytest.approx(float(drift.ends[0]))
    assert drift(7) == pytest.approx(float(drift.ends[1]))


@pytest.mark.parametrize("name", READY_MADE)
def test_potential_is_minus_the_integral(name: str) -> None:
    drift = READY_MADE[name]
    u = sympy.Symbol("u", real=True)
    formula = drift.potential()
    for x in (-1.5, -1.0, -0.3, 0.4, 1.0, 2.5):
        value = drift.potential_at(x)
        assert float(formula.subs(u, x).evalf()) == pytest.approx(value, rel=1e-12, abs=1e-13)
    step = 1e-5
    slope = (drift.potential_at(0.2 + step) - drift.potential_at(0.2 - step)) / (2 * step)
    assert slope == pytest.approx(-drift(0.2), rel=1e-6, abs=1e-8)


@pytest.mark.parametrize("name", READY_MADE)
def test_drifts_travel_to_other_processes(name: str) -> None:
    drift = pickle.loads(pickle.dumps(READY_MADE[name]))
    assert sa.escape_time(drift, 1, 3) == sa.escape_time(READY_MADE[name], 1, 3)


def test_friction_is_the_papers_formula() -> None:
    u, mu, alpha, z0 = sympy.symbols("u mu alpha z0", real=True)
    wanted = 1 - z0 - alpha * (u + mu * (u - u**3))
    assert sympy.expand(sa.friction().expression() - wanted) == 0


@pytest.mark.parametrize(
    ("ends", "region"),
    [
        ((1, 2), "crossing"),
        ((-1, -2), "crossing"),
        ((1, -2), "sliding"),
        ((-1, 2), "repelling sliding"),
    ],
)
def test_regions_are_the_papers_table(ends: tuple[int, int], region: str) -> None:
    assert sa.linear(*ends).region == region
    assert sa.linear([ends[0]], [ends[1]]).region.tolist() == [region]


@pytest.mark.parametrize("ends", [(0, 1), (1, 0), (0, 0)])
def test_tangencies_are_refused(ends: tuple[int, int]) -> None:
    with pytest.raises(sa.RegionError, match="tangency"):
        _ = sa.linear(*ends).region


def test_continuity_is_exact() -> None:
    sa.Drift("1/10 - u", a_minus="11/10", a_plus="-0.9")
    with pytest.raises(sa.InputError, match="11/10"):
        sa.Drift("1/10 - u", a_minus="11/10 + 1/10**30")
    with pytest.raises(sa.InputError, match="jumps"):
        sa.Drift("1/10 - u", a_minus=1.1)  # the float is not 11/10
    sa.Drift("a - u", a_minus="a + 1")


def test_decimals_in_a_string_are_exact() -> None:
    assert sa.Drift("0.1*u").exact_coefficients() == [0, F(1, 10)]
    assert sa.Drift(sympy.Float(0.1) * sympy.Symbol("u")).exact_coefficients() == [0, F(0.1)]


def test_a_parameter_may_be_called_self() -> None:
    assert sa.Drift("1 - self*u").bind(self=2)(0.25) == 0.5


def test_parameters_bind_in_any_order() -> None:
    drift = sa.friction()
    assert drift.free == ("mu", "alpha", "z0")
    bound = drift.bind(z0=["-0.4", "-0.5"]).bind(mu=3, alpha=1)
    assert bound.free == ()
    assert bound.shape == (2,)
    assert drift.free == ("mu", "alpha", "z0")
    assert isinstance(bound, type(drift))


def kinds(drift: sa.Drift) -> list[tuple[str, int]]:
    return [(point.kind, point.multiplicity) for point in drift.critical_points()]


@pytest.mark.parametrize("gap", ["1e-6", "1e-15", "1e-30"])
def test_critical_points_beside_and_on_the_fold(gap: str) -> None:
    fold = F(-7, 9)
    assert kinds(sa.friction(mu=3, alpha=1, z0=fold)) == [("inflection", 2)]
    assert kinds(sa.friction(mu=3, alpha=1, z0=fold - F(gap))) == []
    points = sa.friction(mu=3, alpha=1, z0=fold + F(gap)).critical_points()
    assert [point.kind for point in points] == ["well", "barrier"]
    # A = gap - 6 (u - 2/3)^2/... near the fold: the points are sqrt(gap/6) to either side
    with mpmath.workdps(60):
        assert mpmath.almosteq(
            points[1].u - points[0].u, 2 * mpmath.sqrt(mpmath.mpf(gap) / 6), rel_eps=1e-2
        )


def test_multiplicities() -> None:
    u = sympy.Symbol("u")
    drift = sa.Drift(-((u - sympy.Rational(1, 3)) ** 3) * (u + sympy.Rational(1, 2)) ** 2, u)
    assert kinds(drift) == [("inflection", 2), ("well", 3)]
    assert kinds(sa.Drift("(u - 1/3)**2*exp(u)")) == [("inflection", 2)]
    assert drift.wells()[0].stable


def test_wells_of_an_analytic_drift_are_zeros() -> None:
    drift = sa.sine(1, 1, 4, waves=2)
    assert [p.kind for p in drift.critical_points()] == ["well", "barrier"] * 2
    for point in drift.critical_points():
        with mpmath.workdps(50):
            assert abs(1 + 4 * mpmath.sin(2 * mpmath.pi * point.u)) < mpmath.mpf(10) ** -48


def test_folds_and_breakaway_force() -> None:
    drift = sa.friction(mu=3, alpha=2)
    assert drift.folds().u == pytest.approx((2 / 3, -2 / 3))
    assert drift.folds().z0 == pytest.approx((1 - drift.beta(), 1 + drift.beta()))
    assert drift.beta() == pytest.approx(32 / 9)
    below = sa.friction(mu=[0.0, 0.5], alpha=1)
    assert below.beta().tolist() == [1.0, 1.0]
    assert np.isnan(below.folds().z0[0]).all()
    # the fold is where the largest friction force is: by search, not by formula
    u = np.linspace(-1, 1, 20001)
    assert drift.beta() == pytest.approx((2 * (u + 3 * (u - u**3))).max(), rel=1e-7)


def test_rescale() -> None:
    scaled = sa.rescale(eps="0.01", kappa="0.03", r="0.1")
    assert (scaled.kappa, scaled.r, scaled.time) == (F(3, 10), 10, F(1, 100))
    with mpmath.workdps(60):
        irrational = sa.rescale(eps="0.02", kappa="0.03")
        assert mpmath.almosteq(
            irrational.kappa, mpmath.mpf(3) / 100 / mpmath.sqrt(mpmath.mpf(1) / 50), 1e-58
        )
    arrays = sa.rescale(eps=[0.01, 0.04], kappa=0.03, r=0.1)
    assert arrays.kappa == pytest.approx([0.3, 0.15])
    assert arrays.r == pytest.approx([10, 2.5])


def test_physical_time_scales_with_eps() -> None:
    # the same problem in units where the layer is eps wide: dy = phi(y/eps) dt + kappa dW
    drift, eps = sa.linear(1, 1), F(1, 100)
    scaled = sa.rescale(eps=eps, kappa="0.03", r="0.1")
    time = scaled.time * F(sa.escape_time(drift, scaled.kappa, scaled.r))
    wanted = 0.1 * np.tanh(0.1 / 0.03**2)
    assert float(time) == pytest.approx(wanted, rel=1e-13)


def test_papers_formula_by_hand() -> None:
    # eq:Ttildesmall with the roots of 1.4 - 4u + 3u^3 found here by mpmath
    with mpmath.workdps(40):
        roots = [x for x in mpmath.polyroots([3, 0, -4, mpmath.mpf(7) / 5]) if abs(x) < 1]
        u1, u2 = sorted(mpmath.re(x) for x in roots)

        def potential(u: mpmath.mpf) -> mpmath.mpf:
            return -(mpmath.mpf(7) / 5 * (u + 1) - 2 * (u**2 - 1) + mpmath.mpf(3) / 4 * (u**4 - 1))

        def slope(u: mpmath.mpf) -> mpmath.mpf:
            return -4 + 9 * u**2

        kappa = mpmath.mpf(1) / 5
        wanted = 2 * mpmath.pi / mpmath.sqrt(-slope(u1) * slope(u2)) * mpmath.exp(
            2 * (potential(u2) - potential(u1)) / kappa**2
        ) + 10 / (mpmath.mpf(2) / 5)
        drift = READY_MADE["friction"]
        found = sa.escape_time(drift, "1/5", 10, method="paper", dps=35)
        assert mpmath.almosteq(found, wanted, rel_eps=mpmath.mpf(10) ** -34)
    arrays = sa.escape_time(drift.bind(z0=[-0.4, -1.0]), 0.2, 10, method="paper")
    assert arrays == pytest.approx([float(wanted), 5 + 5], rel=1e-12)


def test_papers_occupation() -> None:
    drift = sa.linear(1, -2)
    assert sa.occupation(drift, 20, method="paper") == pytest.approx(4 / (1.5 * 400))
    weak = sa.occupation(drift, "0.3", method="paper", full=True)
    assert weak.error_kind == "bound"
    exact = sa.occupation(drift, "0.3")
    assert weak.value <= exact <= weak.value + weak.error
