"""Weak noise of arrays: the same values and claims as one scene at a time with more digits."""

from __future__ import annotations

import itertools
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.weak_noise import answer as weak_noise
from symasym.numbers.polynomials import zeros_of
from symasym.workshop.entered import calls, entered
from tests.strategies import SAMPLE, WHOLE, powers_of_ten, rationals

QUANTITIES: dict[str, tuple[Any, dict[str, Any]]] = {
    "T": (sa.escape_time, {}),
    "C": (sa.exit_probability, {}),
    "1 - C": (sa.exit_probability, {"complement": True}),
}
QUANTITY = st.sampled_from(sorted(QUANTITIES))


def ask(quantity: str, *scene: Any, **options: Any) -> Any:
    function, more = QUANTITIES[quantity]
    options = {"method": "laplace", "log": True, "full": True} | more | options
    return function(*scene, **options)


def alone(quantity: str, *scene: Any, **options: Any) -> Any:
    """With 20 digits, or None where that is refused or hardly known."""
    try:
        found = ask(quantity, *scene, **options, dps=20)
    except sa.SymasymError:
        return None
    return found if found.error < 0.3 else None


def assert_same(value: float, error: float, one: Any, kappa: float) -> None:
    """Values to the rounding part of the claim, and claims to a factor; `one` has 20 digits."""
    reference, claim = float(one.value), float(one.error)
    rounding = 1e-16 * abs(reference)
    if one.error_kind == "bound":
        # What is proved may say much less than the estimate.
        assert abs(value - reference) <= 1e-11 + 1e-13 * (abs(reference) + 2 / kappa**2)
        return
    # Both leave out the same orders: what is between them is rounding, a small part of them.
    assert abs(value - reference) <= error - 0.4 * claim + rounding
    assert 0.5 * claim <= error + rounding
    assert error <= 3 * claim + 1e-11 + 1e-13 * (abs(reference) + 2 / kappa**2)


coefficients = st.lists(rationals(-3, 3), min_size=5, max_size=5)


@SAMPLE
@given(
    st.integers(0, 4),
    st.lists(coefficients, min_size=3, max_size=6),
    powers_of_ten(-2.5, -1),
    st.sampled_from(["0.4", "1", "1.5", "10"]),
    st.sampled_from(["0", "0.9", "-0.7", "0.3", "-0.1"]),
    st.sampled_from([0, 1, 2, 3, 5, 8]),
    QUANTITY,
)
def test_any_polynomials(
    degree: int, rows: Any, kappa: Any, r: str, share: str, order: int, quantity: str
) -> None:
    rows = [[float(c) for c in row[: degree + 1]] for row in rows]
    scene = float(kappa), float(r), float(Fraction(r) * Fraction(share))
    options: dict[str, Any] = {"start": scene[2], "order": order}
    pairs = [(row, alone(quantity, sa.polynomial(*row), *scene[:2], **options)) for row in rows]
    pairs = [(row, one) for row, one in pairs if one is not None]
    if not pairs:
        return
    many = sa.polynomial(*np.array([row for row, _ in pairs]).T)
    found = ask(quantity, many, *scene[:2], **options)
    for k, (_, one) in enumerate(pairs):
        assert_same(found.value[k], found.error[k], one, scene[0])


@pytest.mark.every(4)
@pytest.mark.parametrize("quantity", sorted(QUANTITIES))
@pytest.mark.parametrize("order", [0, 2, 5, "optimal"])
@WHOLE
def test_all_regions_starts_and_radii_at_once(quantity: str, order: Any, whole: bool) -> None:
    """Every structure in one array of three axes, and each entry as alone."""
    z0 = np.array([-1.5, -1.0, -0.3, 0.5, 1.3, 3.0])[:, None, None]
    start = np.array([-4.0, -1.0, 0.0, 0.2, 1.0, 2.0])[:, None]
    r = np.array([5.0])
    found = ask(quantity, sa.friction(3, 1, z0), 0.015, r, start=start, order=order)
    assert found.value.shape == (6, 6, 1)
    # Every other entry, and the others at the next order.
    turn = [0, 2, 5, "optimal"].index(order)
    for index in itertools.product(range(6), range(6), range(1)):
        i, j, k = index
        if (i + j + turn) % 2 and not whole:
            continue
        drift = sa.friction(3, 1, float(z0[i, 0, 0]))
        one = ask(
            quantity, drift, 0.015, float(r[k]), start=float(start[j, 0]), order=order, dps=20
        )
        assert_same(found.value[index], found.error[index], one, 0.015)


def test_radii_below_and_above_one() -> None:
    r, start = np.array([0.3, 0.7, 1.0, 1.2, 8.0]), np.array([0.0, 0.25, -0.1])[:, None]
    drift = sa.friction(3, 1, np.array([-1.3, 1.6])[:, None, None])
    for quantity in QUANTITIES:
        found = ask(quantity, drift, 0.02, r, start=start)
        for i, j, k in itertools.product(range(2), range(3), range(5)):
            one = sa.friction(3, 1, [-1.3, 1.6][i])
            exact = ask(quantity, one, 0.02, float(r[k]), start=float(start[j, 0]), dps=20)
            assert_same(found.value[i, j, k], found.error[i, j, k], exact, 0.02)


def test_shapes() -> None:
    drift = sa.friction(3, 1, "-0.3")
    one = ask("T", drift, 0.03, 10)
    assert isinstance(one.value, float)
    for shape in ((1,), (3,), (2, 3), (1, 2, 1)):
        found = ask("T", drift, np.full(shape, 0.03), 10)
        assert found.value.shape == found.error.shape == shape
        assert found.value == pytest.approx(np.full(shape, one.value), rel=1e-14)
    again = ask("T", sa.friction(3, np.ones((2, 1)), np.full(3, -0.3)), 0.03, 10)
    assert again.value == pytest.approx(np.full((2, 3), one.value), rel=1e-14)


def test_without_errors_the_values_are_the_same() -> None:
    """Errors are then only looked at in a few places, and what is faint left out."""
    kappa = np.geomspace(0.004, 0.05, 30_000)
    for quantity in QUANTITIES:
        drift = sa.friction(3, 1, "-0.3")
        full = ask(quantity, drift, kappa, 10, order=4)
        plain = ask(quantity, drift, kappa, 10, order=4, full=False)
        assert (np.abs(plain - full.value) <= 4e-15 * (1 + np.abs(full.value))).all()
        # A start that is no float has an error of its own at each kappa.
        inexact: dict[str, Any] = {"start": "0.1", "order": 4}
        full = ask(quantity, drift, kappa, 10, **inexact)
        plain = ask(quantity, drift, kappa, 10, full=False, **inexact)
        assert (np.abs(plain - full.value) <= 4e-15 * (1 + np.abs(full.value))).all()


def test_many_kappas_of_a_few_drifts() -> None:
    kappa, z0 = np.geomspace(0.01, 0.03, 1000), np.array([-1.3, -0.3, 1.4])
    found = ask("T", sa.friction(3, 1, z0[:, None]), kappa, 10)
    for k, z in enumerate(z0):
        alone = ask("T", sa.friction(3, 1, float(z)), kappa, 10)
        assert (np.abs(found.value[k] - alone.value) <= 1e-14 * np.abs(alone.value) + 1e-14).all()


@pytest.mark.parametrize("full", [False, True])
@pytest.mark.parametrize("count", [3, 5000])
def test_one_bad_entry_is_named(full: bool, count: int) -> None:
    kappa = np.full(count, 0.02)
    kappa[count // 2] = 0.31415
    with pytest.raises(sa.AccuracyError, match=r"kappa is 0\.31415, .* order=3"):
        ask("T", sa.friction(3, 1, "-0.3"), kappa, 10, order=3, full=full)
    z0 = np.full(count, -0.3) + 1e-6 * np.arange(count)
    with pytest.raises(sa.AccuracyError, match=r"kappa is 0\.31415, .* order=3"):
        ask("T", sa.friction(3, 1, z0), kappa, 10, order=3, full=full)


def test_a_tangency_among_others_is_refused() -> None:
    with pytest.raises(sa.InputError, match="tangency"):
        ask("T", sa.friction(3, 1, np.array([-0.3, 0.0])), 0.01, 10)


def test_more_digits_only_where_float64_is_not_enough(monkeypatch: pytest.MonkeyPatch) -> None:
    """Beside a fold, and from a start on a well or barrier."""
    asked: list[Fraction] = []
    halves = weak_noise._one_sided

    def counted(drift: sa.Drift, *rest: Any) -> Any:
        asked.append(drift.values["z0"])
        return halves(drift, *rest)

    monkeypatch.setattr(weak_noise, "_one_sided", counted)
    z0 = np.array([-1.5, -0.3, 0.5, -7 / 9 - 1e-6, 1.0, 3.0])
    found = ask("T", sa.friction(3, 1, z0), 1e-5, 10)
    assert sorted(map(float, asked)) == [z0[3], 1.0]
    for k, z in enumerate(z0):
        one = ask("T", sa.friction(3, 1, float(z)), 1e-5, 10, dps=20)
        # The heights' own rounding, times lam = 2e10, is most of the claim.
        assert abs(found.value[k] - float(one.value)) <= found.error[k]


def test_rounding_beside_a_fold_is_claimed() -> None:
    """Weak noise, so that nothing but rounding is left; zeros 0.04 to 0.2 apart."""
    z0 = -7 / 9 + np.geomspace(2e-3, 3e-2, 12)
    kappa = 10 ** np.linspace(-4, -3.5, 12)
    found = ask("T", sa.friction(3, 1, z0), kappa, 10, order=4)
    off = []
    for k in range(12):
        one = ask("T", sa.friction(3, 1, float(z0[k])), float(kappa[k]), 10, order=4, dps=20)
        off.append(abs(found.value[k] - float(one.value)) / found.error[k])
    assert max(off) <= 1


@pytest.mark.parametrize("degree", [1, 2, 3, 4, 6])
def test_zeros(degree: int) -> None:
    random = np.random.default_rng(degree)
    c = random.uniform(-2, 2, (degree + 1, 500))
    found = zeros_of(c)
    for k in range(500):
        if not found.apart[k]:
            continue
        known = np.polynomial.polynomial.polyroots(c[:, k])
        real = int(found.real[k])
        mine = [*found.values[:real, k]]
        for pair in found.pairs[: (degree - real) // 2]:
            mine += [pair[k], np.conj(pair[k])]
        for z in known:
            assert np.abs(np.array(mine) - z).min() < 1e-6 * (1 + abs(z))
    assert found.apart.mean() > 0.97


@pytest.mark.parametrize("degree", [3, 5])
def test_zeros_of_all_sizes(degree: int) -> None:
    """Zeros that are called all and apart are, though formulas lose small ones beside large."""
    random, seen = np.random.default_rng(degree), 0
    c = 10 ** random.uniform(-12, 12, (degree + 1, 60)) * random.choice([-1, 1], (degree + 1, 60))
    found = zeros_of(c)
    for k in np.flatnonzero(found.apart):
        with mpmath.workdps(60):
            known = mpmath.polyroots([*c[::-1, k]], maxsteps=500, extraprec=2000)
            real = sorted(float(z.real) for z in known if abs(z.imag) < 1e-40 * max(1, abs(z)))
        assert found.values[: found.real[k], k] == pytest.approx(real, rel=1e-10, abs=1e-10)
        seen += 1
    assert seen > 30


@pytest.mark.parametrize("method", ["laplace", "uniform"])
@pytest.mark.parametrize("c", [1e-12, 1e-14, 1e-25])
def test_a_zero_far_from_the_layer_changes_nothing(method: str, c: float) -> None:
    near, far = (sa.polynomial([-0.25, -0.25], [0, 0.05], [1], [x]) for x in (0, c))
    found, known = (sa.escape_time(drift, 0.1, 3, method=method, order=1) for drift in (far, near))
    assert found == pytest.approx(known, rel=1e-10)


def test_optimal_order_where_powers_overflow() -> None:
    # 1/lam = 5e-17, whose 20th power no float64 holds.
    drift = sa.friction(3, 1, "-0.4")
    one = sa.escape_time(drift, 1e-8, 10, method="laplace", order="optimal", log=True)
    many = sa.escape_time(drift, [1e-8, 2e-8], 10, method="laplace", order="optimal", log=True)
    assert many[0] == pytest.approx(one, rel=1e-14)


@pytest.mark.every(3)
@pytest.mark.parametrize("complement", [False, True])
@pytest.mark.parametrize("order", [0, 3, "optimal"])
def test_shares_of_many_drifts(complement: bool, order: Any) -> None:
    """P and 1 - P of one well and of two, analysed together, each as alone and as it is."""
    tilt = np.array([0.05, 0.2, -0.3, 0.6])
    options: dict[str, Any] = {"complement": complement, "method": "laplace", "order": order}
    options |= {"log": True, "full": True}
    for rest in ((-2, 0, 0.5), (2, 0, -3)):
        found = sa.occupation(sa.polynomial(tilt, *rest), [[0.05], [0.09]], **options)
        for (i, kappa), (k, a) in itertools.product(enumerate((0.05, 0.09)), enumerate(tilt)):
            drift = sa.polynomial(float(a), *rest)
            one = sa.occupation(drift, kappa, dps=20, **options)
            if one.error < 0.3:
                assert_same(found.value[i, k], found.error[i, k], one, kappa)
            # The exact integrals share nothing with the series.
            exact = sa.occupation(drift, kappa, complement=complement, dps=20, log=True)
            assert abs(found.value[i, k] - float(exact)) <= found.error[i, k]


FLOATS = [
    (sa.friction(3, 1, -0.3), 0.05, 10, 0.0, 2),
    (sa.friction(3, 1, -0.3), 0.05, 0.75, 0.25, "optimal"),
    # The start on a barrier, a drift that is no polynomial, zeros close to each other.
    (sa.polynomial(0, 1, 0, -3), 0.1, 10, 0.0, 2),
    (sa.tanh(2, -1, "1/10"), 0.1, 3, -2.0, 1),
    (sa.friction(3, 1, -7 / 9 - 1e-6), 1e-5, 10, 0.0, 2),
]


@pytest.mark.parametrize("scene", FLOATS, ids=str)
def test_a_float_is_an_array_of_one(scene: Any) -> None:
    drift, kappa, r, start, order = scene
    for quantity in ("T", "C"):
        options = {"start": start, "order": order, "full": False}
        one = ask(quantity, drift, kappa, r, **options)
        assert isinstance(one, float)
        assert one == ask(quantity, drift, [kappa], r, **options)[0]
        exact = float(ask(quantity, drift, kappa, r, **options, dps=20))
        assert abs(one - exact) <= 1e-13 * (1 + abs(exact))


def test_a_float_that_float64_is_not_enough_for() -> None:
    # kappa² underflows; then, no estimate is sure and a bound is.
    scene = sa.linear(1, 2), "1e-200", 10
    assert ask("T", *scene, full=False) == float(ask("T", *scene, full=False, dps=20)) != 0
    with pytest.raises(sa.RangeError, match="log T is outside the range"):
        ask("T", sa.friction(3, 1, "-0.3"), "1e-200", 10, full=False)
    options: dict[str, Any] = {"method": "laplace", "order": 0, "full": True}
    drift, kappa = sa.polynomial("1/5", -2, 0, "1/2"), 0.5
    bound = sa.occupation(drift, kappa, complement=True, **options)
    plain = sa.occupation(drift, kappa, complement=True, **options | {"full": False})
    assert abs(plain - bound.value) <= 1e-13 * bound.value


def test_a_float_and_an_array_enter_the_same_files() -> None:
    one, many = (
        {name for name in entered(call.ask) if name.startswith(("asymptotics", "series", "drift"))}
        for call in calls()
        if call.name in ("laplace, float", "laplace, array")
    )
    assert one == many != set()
