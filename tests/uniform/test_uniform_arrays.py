"""Order 0 of the uniform formula in float64: the tables, agreement with many digits, honesty."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.asymptotics.uniform import answer as uniform_noise
from symasym.asymptotics.uniform.order_zero import OrderZero
from symasym.asymptotics.weak_noise import arrays as weak_noise_arrays
from symasym.asymptotics.weak_noise.interpolation import columns, of_one
from symasym.numbers.arithmetic import FLOATS
from symasym.special.airy import airy_products
from symasym.special.dawson import dawson

FOLD = -7 / 9
PLACES = [-2, -1.2, -0.9, -0.78, FOLD, FOLD + 1e-12, FOLD - 1e-12, -0.77, -0.7, -0.4, -0.1, -0.01,
          -1e-4, -1e-6]  # fmt: skip


@pytest.fixture
def vectorised_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fails where a scene is not done in float64."""

    def never(*_: Any) -> Any:
        raise AssertionError("a scene was evaluated by itself")

    monkeypatch.setattr(uniform_noise, "_one_by_one", never)


# -- tables ----------------------------------------------------------------------------------------


def test_airy_products_against_mpmath() -> None:
    inside = np.concatenate([np.linspace(-9, 9, 91), [1e-300, -1e-300, 0.99999, 1.0, 8.0, -8.0]])
    z = np.concatenate([inside, [-900.0, -40.0, 40.0, 900.0, 1e6]])
    found = airy_products(z, FLOATS)
    with mpmath.workdps(30):
        for k, x in enumerate(map(mpmath.mpf, z.tolist())):
            ai, bi = mpmath.airyai(x), mpmath.airybi(x)
            ai1, bi1 = mpmath.airyai(x, derivative=1), mpmath.airybi(x, derivative=1)
            fall = mpmath.exp(-2 * x**1.5 / 3) if x > 0 else mpmath.mpf(1)
            squares, slopes = (ai**2 + bi**2) * fall**2, (ai1**2 + bi1**2) * fall**2
            cross = (ai * ai1 + bi * bi1) * fall**2
            assert abs(found.squares[k] - squares) <= 8e-15 * squares
            assert abs(found.slopes[k] - slopes) <= 8e-15 * slopes
            assert abs(found.cross[k] - cross) <= 8e-15 * abs(cross)
            # The phase of an oscillation is rounded with its argument.
            phase = 8e-15 * max(1, abs(x) ** 1.5 if x < 0 else 1)
            assert abs(found.bi[k] - bi * fall) <= phase * mpmath.sqrt(squares)
            assert abs(found.bi_slope[k] - bi1 * fall) <= phase * mpmath.sqrt(slopes)


def test_dawson_against_mpmath() -> None:
    x = np.concatenate([np.linspace(0, 7, 71), [1e-200, 5.9999999, 6.0, 6.0000001, 30.0]])
    found = dawson(x, FLOATS)
    with mpmath.workdps(40):
        for k, y in enumerate(map(mpmath.mpf, x.tolist())):
            shade = mpmath.exp(y * y) * mpmath.erfc(y)
            value = mpmath.sqrt(mpmath.pi) / 2 * mpmath.exp(-y * y) * mpmath.erfi(y)
            area = y * y * mpmath.hyp2f2(1, 1, mpmath.mpf(3) / 2, 2, -y * y)
            assert abs(found.erfcx[k] - shade) <= 4e-15 * shade
            assert abs(found.value[k] - value) <= 2e-16 + 4e-15 * value
            assert abs(found.area[k] - area) <= 2e-16 + 4e-15 * area


def test_dawson_far_out() -> None:
    found = dawson(np.array([1e3, 1e8]), FLOATS)
    np.testing.assert_allclose(found.erfcx * [1e3, 1e8], (1 - 0.5e-6) / np.sqrt(np.pi), rtol=1e-6)
    np.testing.assert_allclose(found.value, [0.5e-3, 0.5e-8], rtol=1e-6)


# -- agreement with many digits --------------------------------------------------------------------


def downwards(z0: Any) -> sa.Drift:
    """Friction with mu = 3, seen in the mirror."""
    return sa.polynomial(z0 - 1, -4, 0, 3)


@pytest.mark.usefixtures("vectorised_only", "as_in_float")
@pytest.mark.parametrize(
    ("make", "last", "r", "start"),
    [
        (lambda z0: sa.friction(3, 1, z0), -1e-6, 10, 0),
        (lambda z0: sa.friction(1, 1, z0), -1e-6, 10, -0.3),
        (downwards, -1e-6, 10, 0),
        (lambda z0: sa.friction(3, 1, z0), -0.4, 0.97, 0),
        (lambda z0: sa.friction(8, 2, z0), -1e-6, 30, 3),
    ],
)
def test_arrays_are_the_scenes_with_more_digits(
    make: Any, last: float, r: float, start: float
) -> None:
    z0 = np.array([z for z in PLACES if z <= last])
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "log": True}
    found = sa.escape_time(make(z0), 0.06, r, full=True, **options)
    # The ends of the list, and every second place between.
    for k in [*range(0, len(z0), 2), len(z0) - 1]:
        z = float(z0[k])
        many = sa.escape_time(make(z), 0.06, r, dps=20, **options)
        exact = sa.escape_time(make(z), 0.06, r, start=start, log=True)
        assert abs(found.value[k] - many) <= 4e-14 * max(1, abs(many))
        assert abs(found.value[k] - exact) <= found.error[k] <= 0.3


@pytest.mark.usefixtures("vectorised_only", "as_in_float")
def test_two_folds_of_a_quintic() -> None:
    # Wells at both signs of u; the distance of each from its barrier goes through 0.
    level = np.array([-0.02, -1e-3, -1e-9, 0, 1e-9, 1e-3, 0.02])
    bottom = "(u**2 - 1/4)**2*3 + (1/10)*u + 1/20"
    drift = sa.Drift(f"{bottom} - shift").bind(shift=0.06 + level)
    found = sa.escape_time(drift, 0.04, 3, start=-1, method="uniform", order=0, log=True)
    for k, s in enumerate((0.06 + level).tolist()):
        one = sa.Drift(f"{bottom} - shift").bind(shift=s)
        many = sa.escape_time(one, 0.04, 3, start=-1, method="uniform", order=0, log=True, dps=20)
        assert abs(found[k] - many) <= 4e-13 * max(1, abs(many))


@pytest.mark.usefixtures("vectorised_only")
@pytest.mark.parametrize(
    ("c", "kappa", "r", "start"),
    [
        # Two complex pairs with no real zero between them.
        ([-0.0771398213865333, 0.34706325922020437, -0.166, -2.353, -2.442], 0.22, 7.3, 5.4),
        # One between the last barrier and the end of the layer.
        ([-0.4525670653, 1.8786812296636826, -0.927, -2.633, 1.916, 0.326], 0.0675, 7.3, 0.0),
    ],
)
def test_complex_pairs_in_their_order(
    c: Any, kappa: float, r: float, start: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Closed forms, also where the start lies beside a barrier.
    monkeypatch.setattr(OrderZero, "beside_a_barrier", lambda self: False)
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "log": True}
    found = sa.escape_time(sa.polynomial(*c), np.array([kappa]), r, **options)[0]
    many = sa.escape_time(sa.polynomial(*c), kappa, r, dps=20, **options)
    assert abs(found - many) <= 4e-13 * max(1, abs(many))


# -- many values of kappa --------------------------------------------------------------------------


@pytest.mark.usefixtures("vectorised_only")
@pytest.mark.parametrize("z0", [-2.0, -0.8, -0.775, -0.7, -1e-3])
def test_one_drift_is_interpolated_to_the_last_digits(
    z0: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    kappa = np.random.default_rng(3).permutation(np.geomspace(0.008, 0.09, 8000))
    options: dict[str, Any] = {"method": "uniform", "order": 0, "log": True}
    drift = sa.friction(3, 1, z0)
    every = sa.escape_time(drift, kappa, 10, full=True, **options).value
    with monkeypatch.context() as patch:
        # What takes the values as they are.
        patch.setattr(weak_noise_arrays, "_best", None)
        patch.setattr(weak_noise_arrays, "_probes", None)
        found = sa.escape_time(drift, kappa, 10, **options)
    assert (np.abs(found - every) <= 4e-15 * np.maximum(1, np.abs(every))).all()


@pytest.mark.usefixtures("vectorised_only")
def test_a_grid_is_interpolated_to_the_last_digits() -> None:
    z0, kappa = np.linspace(-2, -1e-6, 41)[:, None], np.geomspace(0.01, 0.1, 250)
    options: dict[str, Any] = {"method": "uniform", "order": 0, "log": True}
    drift = sa.friction([[[3.0]], [[5.0]]], 1, z0)
    every = sa.escape_time(drift, kappa, 10, full=True, **options).value
    found = sa.escape_time(drift, kappa, 10, **options)
    assert (np.abs(found - every) <= 1e-14 * np.maximum(1, np.abs(every))).all()
    assert (found != every).mean() > 0.5


def test_what_is_not_smooth_is_not_interpolated() -> None:
    lam = np.geomspace(200, 2e4, 5000)

    def kinked(x: Any) -> Any:
        return np.log(x) + np.abs(x - 2005.0) * 1e-9, np.full(x.shape, 1e-3)

    assert of_one(kinked, lam, 0.1) is None
    assert of_one(lambda x: (np.log(x), 1 / x), lam, 1e-3) is None
    found = of_one(lambda x: (np.log(x), 1 / x), lam, 0.1)
    assert found is not None
    np.testing.assert_allclose(found[0], np.log(lam), rtol=3e-15)

    def mixed(x: Any, errors: bool) -> Any:
        values = np.stack([np.log(x), np.log(x) + np.abs(x - 2005.0) * 1e-9], axis=1)
        return values, 1 / np.stack([x, x], axis=1)

    between = columns(mixed, lam[::20])
    assert between is not None
    assert between[2].tolist() == [True, False]
    assert columns(mixed, lam[:40]) is None


@pytest.mark.usefixtures("vectorised_only")
def test_no_step_through_the_fold() -> None:
    for centre in (FOLD, -0.7, -0.01):
        z0 = centre + 1e-6 * np.arange(-40, 41)
        logs = sa.escape_time(sa.friction(3, 1, z0), 0.1, 10, method="uniform", order=0, log=True)
        bends = np.diff(logs, 2)
        assert np.abs(np.diff(bends)).max() <= 1e-12 * np.abs(logs).max()


@pytest.mark.usefixtures("vectorised_only")
def test_shapes_broadcast() -> None:
    z0, kappa = np.linspace(-1.5, -0.1, 7)[:, None], np.geomspace(0.02, 0.1, 5)
    drift = sa.friction(3, 1, z0)
    every = sa.escape_time(drift, kappa, 10, method="uniform", order=0, log=True, full=True)
    assert every.value.shape == every.error.shape == (7, 5)
    assert every.error_kind == "estimate"
    row = sa.escape_time(
        sa.friction(3, 1, -0.8), kappa, [[10.0], [20.0]], method="uniform", order=0
    )
    assert row.shape == (2, 5)
    alone = sa.escape_time(sa.friction(3, 1, -0.8), 0.1, 20, method="uniform", order=0)
    assert abs(row[1, 4] / alone - 1) <= 1e-13


# -- honesty ---------------------------------------------------------------------------------------


def check_random(seed: int, count: int, degree: int, beside_a_fold: bool) -> int:
    """No claim below the true error; returns how many were made."""
    rng = np.random.default_rng(seed)
    c = np.round(rng.uniform(-3, 3, (degree + 1, count)), 3)
    if beside_a_fold:
        u = rng.uniform(-0.9, 0.9, count)
        slope = sum(k * c[k] * u ** (k - 1) for k in range(1, degree + 1))
        c[1] -= slope
        c[0] -= sum(c[k] * u**k for k in range(degree + 1))
        c[0] += rng.choice([-1, 1], count) * 10 ** rng.uniform(-17, -0.5, count)
    # Every second sample is of very weak noise, where rounding is all there is.
    kappa = 10 ** (rng.uniform(-6, -2, count) if seed % 2 else rng.uniform(-2, -0.3, count))
    r = 10 ** rng.uniform(-0.2, 2)
    start = rng.choice([0.0, float(rng.uniform(-0.9, 0.9) * r)])
    drift, claimed = sa.polynomial(*c), 0
    exact = sa.escape_time(drift, kappa, r, start=start, log=True, full=True)
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "log": True}
    found = where_claimed(drift, kappa, r, options)
    off = np.abs(found[0] - exact.value)
    known = np.isfinite(found[1])
    assert (off[known] <= (found[1] + exact.error)[known]).all(), c[:, known & (off > found[1])]
    claimed = int(known.sum())
    return claimed


def where_claimed(drift: sa.Drift, kappa: Any, r: float, options: dict[str, Any]) -> Any:
    """Logarithms and errors, infinite where refused."""
    refused = {}

    def instead(_drift: Any, scenes: Any, rest: Any, *_: Any) -> Any:
        refused["rows"] = rest
        return np.zeros(len(rest)), np.full(len(rest), np.inf)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(uniform_noise, "_one_by_one", instead)
        found = sa.escape_time(drift, kappa, r, full=True, **options)
    return found.value, found.error


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 5])
@pytest.mark.parametrize("beside_a_fold", [False, True])
def test_random_drifts_sample(degree: int, beside_a_fold: bool) -> None:
    if degree == 1 and beside_a_fold:
        pytest.skip("a line has no fold")
    claimed = sum(check_random(seed, 150, degree, beside_a_fold) for seed in range(2))
    assert claimed >= 100


@pytest.mark.slow
@pytest.mark.parametrize("degree", [2, 3, 4, 5])
@pytest.mark.parametrize("beside_a_fold", [False, True])
def test_random_drifts(degree: int, beside_a_fold: bool) -> None:
    for seed in range(10, 40):
        check_random(seed, 500, degree, beside_a_fold)


@pytest.mark.parametrize(
    ("coefficients", "kappa", "r", "start"),
    [
        # Two turning points from which one and the same complex pair is found.
        ((-2.855, -1.993, 2.174, 1.31, -2.288), 0.338, 2.9, 0),
        ((0.654, 0.151, 0.816, 1.502, 0.764), 0.199, 2.9, 0),
        ((2.535, 0.56, -0.123, -3.898, 4.904), 0.0315, 84, -51.5),
        # A pair whose turning point is in the layer, and its middle is not.
        ((2.789, -0.203, -0.55, 0.808), 0.0351, 24.3, -10.6),
        ((0.338, 1.767, -0.171, -1.381, -0.609, 1.088), 0.278, 21.9, 1.262),
        # Start and end cancel in order 1 of the regular part.
        ((-1.955, -0.183, -2.832, -2.081, -1.123), 0.4957, 0.8014, 0.486),
    ],
)
@pytest.mark.parametrize("many", [False, True])
def test_complex_pairs_are_counted_once(
    coefficients: Any, kappa: float, r: float, start: float, many: bool
) -> None:
    drift = sa.polynomial(*coefficients) if many else sa.polynomial(*np.array([coefficients]).T)
    exact = sa.escape_time(sa.polynomial(*coefficients), kappa, r, start=start, log=True)
    options: dict[str, Any] = {"start": start, "method": "uniform", "order": 0, "log": True}
    found = sa.escape_time(drift, kappa, r, full=True, **options)
    assert abs(np.ravel(found.value)[0] - exact) <= np.ravel(found.error)[0]


@pytest.mark.usefixtures("vectorised_only", "as_in_float")
def test_a_barrier_all_but_at_the_end() -> None:
    z0 = -np.array([1e-9, 1e-12, 1e-15])
    options: dict[str, Any] = {"method": "uniform", "order": 0, "log": True}
    found = sa.escape_time(sa.friction(3, 1, z0), 0.06, 10, **options)
    for k, z in enumerate(z0.tolist()):
        many = sa.escape_time(sa.friction(3, 1, z), 0.06, 10, dps=20, **options)
        assert abs(found[k] - many) <= 4e-14 * abs(many)
