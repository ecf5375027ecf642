"""The paper's own formulas, against the same formulas written down again here."""

from __future__ import annotations

from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from tests.problems import relative, tagged


def small_noise(mu: Any, alpha: Any, z0: Any, kappa: Any, r: Any) -> Any:
    """eq:Ttildesmall with eq:S for the friction drift, a- and a+ > 0, in 60 digits."""
    with mpmath.workdps(60):
        mu, alpha, z0, kappa, r = (
            mpmath.mpf(F(x).numerator) / F(x).denominator for x in (mu, alpha, z0, kappa, r)
        )

        def V(u: Any) -> Any:
            return -((1 - z0) * (u + 1) - alpha * ((1 + mu) * (u**2 - 1) / 2 - mu * (u**4 - 1) / 4))

        def slope(u: Any) -> Any:
            return -alpha * (1 + mu - 3 * mu * u**2)

        roots = mpmath.polyroots([alpha * mu, 0, -alpha * (1 + mu), 1 - z0], 200, extraprec=200)
        inside = sorted(x.real for x in map(mpmath.mpc, roots)
                        if abs(x.imag) < 1e-20 and abs(x.real) < 1)  # fmt: skip
        T = r / (1 - z0 - alpha)
        if len(inside) == 2 and inside[1] > 0:
            low, high = inside
            front = 2 * mpmath.pi / mpmath.sqrt(-slope(low) * slope(high))
            T += front * mpmath.exp(2 * (V(high) - V(low)) / kappa**2)
        return T


SCENES = [
    ("3", "1", "-0.3", "0.1", "10"), ("3", "1", "-0.4", "0.3", "10"),
    ("3", "1", "-0.77", "1", "7"), ("3", "1", "-1", "0.2", "10"),
    ("1/2", "1", "-0.3", "0.05", "3"), ("8", "0.3", "0.2", "0.2", "5"),
    ("3", "1", "-1e-9", "0.1", "10"), ("3", "1", "-0.3", "1e-3", "1e6"),
    ("1e4", "1", "-0.3", "5", "9"),
]  # fmt: skip


@pytest.mark.parametrize(("mu", "alpha", "z0", "kappa", "r"), SCENES)
def test_escape_time_is_the_printed_formula(
    mu: str, alpha: str, z0: str, kappa: str, r: str
) -> None:
    wanted = small_noise(mu, alpha, z0, kappa, r)
    drift = sa.friction(mu, alpha, z0)
    assert relative(sa.escape_time(drift, kappa, r, method="paper", dps=40), wanted) < 1e-40
    log = float(mpmath.log(wanted))
    found = sa.escape_time(drift, kappa, r, method="paper", log=True)
    assert found == pytest.approx(log, rel=1e-12, abs=1e-12)
    many = sa.escape_time(drift, [float(F(kappa))], float(F(r)), method="paper", log=True)
    assert many[0] == pytest.approx(log, rel=1e-11, abs=1e-11)


def test_arrays_are_their_scalars() -> None:
    z0 = np.array([-2.0, -0.9, -7 / 9 - 1e-6, -7 / 9 + 1e-6, -0.3, -1e-6])
    kappa, r = np.array([[0.05], [0.3]]), 10.0
    found = sa.escape_time(sa.friction(3, 1, z0), kappa, r, method="paper", log=True)
    assert found.shape == (2, 6)
    for i, k in enumerate(kappa[:, 0]):
        for j, z in enumerate(z0):
            one = sa.escape_time(sa.friction(3, 1, z), k, r, method="paper", log=True)
            assert found[i, j] == pytest.approx(one, rel=1e-9), (k, z)


def test_the_multiplier_steps_at_the_fold_and_where_the_barrier_passes_the_start() -> None:
    drift = sa.friction(3, 1)
    below = sa.escape_time(drift.bind(z0=-7 / 9 - 1e-9), 0.3, 10, method="paper")
    above = sa.escape_time(drift.bind(z0=-7 / 9 + 1e-9), 0.3, 10, method="paper")
    assert below == pytest.approx(10 / (7 / 9 + 1e-9))
    assert above > 5 * below
    # a well and a barrier, both left of the start: the well does not count
    left = sa.polynomial(F(1, 2) * F("0.3") * F("0.7") * 9, 9 * F("1/2"), F(9, 2))
    assert [p.kind for p in left.critical_points()] == ["well", "barrier"]
    a_plus = float(left.ends[1])
    assert sa.escape_time(left, "0.1", 10, method="paper") == pytest.approx(10 / a_plus)


def test_the_error_of_the_bound_on_c_is_the_bound() -> None:
    found = sa.exit_probability(sa.friction(3, 1, "-0.4"), "0.3", 10, method="paper", full=True)
    assert 0 < found.value < 1e-113
    assert found.error / found.value == pytest.approx(1)


def test_crossing_downwards_is_the_mirror_image() -> None:
    here, there = sa.friction(3, 1, "-0.3"), sa.friction(3, 1, "2.3")
    for options in ({"dps": 30}, {}):
        one, other = (
            sa.escape_time(d, "0.2", 10, method="paper", **options) for d in (here, there)
        )
        assert relative(one, other) < 1e-13
    many = sa.escape_time(sa.friction(3, 1, [-0.3, 2.3]), 0.2, 10, method="paper")
    assert many[0] == pytest.approx(many[1], rel=1e-12)


def test_flight_time_where_there_is_no_well() -> None:
    for drift in (sa.linear(2, 1), sa.tanh(1, 2, 5), sa.hill("1/3", 2, "1/5", n=1)):
        found = sa.escape_time(drift, 1, 10, method="paper", dps=25)
        assert relative(found, mpmath.mpf(10) / float(drift.ends[1])) < 1e-14


def test_analytic_drifts() -> None:
    # A = 1/2 + 2 sin(pi u): well at u1, barrier at u2, in the direction of a+ = 1/2
    drift = sa.sine("1/2", "1/2", -2)
    well, barrier = drift.critical_points()
    assert (well.kind, barrier.kind) == ("well", "barrier")
    with mpmath.workdps(50):

        def V(u: Any) -> Any:
            return -(u / 2 + 2 * mpmath.cos(mpmath.pi * u) / mpmath.pi)

        slopes = [-2 * mpmath.pi * mpmath.cos(mpmath.pi * p.u) for p in (well, barrier)]
        rise = V(barrier.u) - V(well.u)
        wanted = 20 + 2 * mpmath.pi / mpmath.sqrt(-slopes[0] * slopes[1]) * mpmath.exp(2 * rise / 4)
    found = sa.escape_time(drift, 2, 10, method="paper", dps=30)
    assert relative(found, wanted) < 1e-30
    many = sa.escape_time(drift, [2.0], 10, method="paper")
    assert many[0] == pytest.approx(float(wanted), rel=1e-11)


# -- occupation ------------------------------------------------------------------------------------

SLIDING = [
    pytest.param(p, marks=pytest.mark.slow if "analytic" in p.tags else (), id=p.name)
    for p in tagged("sliding")
    if not p.tags & {"narrow", "slow", "extreme"}
]


@pytest.mark.parametrize("problem", SLIDING)
@pytest.mark.parametrize("kappa", ["0.05", "0.4", "1", "1.5"])
def test_occupation_s_lower_bound_holds(problem: Any, kappa: str) -> None:
    drift = problem.make()
    found = sa.occupation(drift, kappa, method="paper", dps=20, full=True)
    if found.error_kind == "none":
        return
    exact = sa.occupation(drift, kappa, dps=25)
    with mpmath.workdps(30):
        assert found.value <= exact <= found.value + found.error
    rest = sa.occupation(drift, kappa, method="paper", complement=True, dps=20, full=True)
    exact = sa.occupation(drift, kappa, complement=True, dps=25)
    with mpmath.workdps(30):
        assert abs(rest.value - exact) <= rest.error
    log = sa.occupation(drift, kappa, method="paper", log=True, dps=20, full=True)
    exact = sa.occupation(drift, kappa, log=True, dps=25)
    with mpmath.workdps(30):
        assert log.value <= exact <= log.value + log.error


@pytest.mark.parametrize("kappa", ["3", "20", "1e4", "1e8"])
def test_occupation_in_strong_noise_is_the_printed_leading_term(kappa: str) -> None:
    drift = sa.linear("2/3", "-3")
    k = F(kappa)
    wanted = 4 / ((F(3, 2) + F(1, 3)) * k * k)
    found = sa.occupation(drift, kappa, method="paper", dps=30, full=True)
    assert (found.error_kind, found.error) == ("none", None)
    assert relative(found.value, mpmath.mpf(wanted.numerator) / wanted.denominator) < 1e-15
    exact = sa.occupation(drift, kappa, dps=30)
    # eq:Plarge2: the next term is smaller by kappa^-2
    assert relative(found.value, exact) < 6 / float(k) ** 2


def test_occupation_s_bound_counts_its_rounding_to_float64() -> None:
    """Where P is 1 to any digits, the distance to 1 is the whole error."""
    drift, kappa = sa.friction("7.99", "1.725", "1.286"), "0.0629939"
    for dps in (None, 16, 25):
        found = sa.occupation(drift, kappa, method="paper", full=True, dps=dps)
        value, error = (
            F(x) if dps is None else F(mpmath.nstr(x, 60)) for x in (found.value, found.error)
        )
        assert sa.occupation(drift, kappa, complement=True, dps=20) < 1e-50
        assert 1 - F(1, 10**50) - value <= error


# -- refusals --------------------------------------------------------------------------------------


REFUSED: list[tuple[sa.Drift, Any, type[Exception]]] = [
    (sa.friction(3, 1, "0.5"), 0, sa.RegionError),
    (sa.linear(-1, 1), 0, sa.RegionError),
    (sa.friction(3, 1, 0), 0, sa.RegionError),
    (sa.sine(1, 1, 4, waves=2), 0, sa.InputError),
    (sa.friction(3, 1, "-0.3"), "0.1", sa.InputError),
    (sa.friction(3, 1, "-0.3"), -1, sa.InputError),
]


@pytest.mark.parametrize(("drift", "start", "error"), REFUSED)
def test_what_the_paper_has_no_formula_for(drift: sa.Drift, start: Any, error: Any) -> None:
    """An error for one scene; of an array nan, and why."""
    with pytest.raises(error) as caught:
        sa.escape_time(drift, "0.3", 10, method="paper", start=start)
    many = sa.escape_time(drift, [0.3, 0.4], 10, method="paper", start=start, full=True)
    assert np.isnan(many.value).all()
    assert str(caught.value).rstrip(".") in many.notes[0]


def test_bad_input_and_overflow() -> None:
    drift = sa.friction(3, 1, "-0.3")
    for kappa, options in ((-1, {}), ([1.0, -1.0], {}), ("0.3", {"order": 1})):
        with pytest.raises(sa.InputError):
            sa.escape_time(drift, kappa, 10, method="paper", **options)
    with pytest.raises(sa.RangeError):
        sa.escape_time(drift, "0.01", 10, method="paper")
    many = sa.escape_time(drift, [0.01, 0.1], 10, method="paper")
    assert np.isnan(many).tolist() == [True, False]
    logs = sa.escape_time(drift, ["0.01", 0.01], 10, method="paper", log=True)
    assert logs[0] == logs[1] > 3600
