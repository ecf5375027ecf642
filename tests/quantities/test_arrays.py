"""Arrays of scenes are their scalars, and how the public verbs behave as guests."""

from __future__ import annotations

import threading
from collections.abc import Callable
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from tests.problems import BY_NAME, distance, logarithm, relative

FRICTION = sa.friction(3, 1, "-0.4")

# -- arrays --------------------------------------------------------------------------------------


def scalars_of(verb: Callable[..., Any], make: Callable[..., sa.Drift], *arrays: Any) -> Any:
    """The verb, one scene at a time; log, so that nothing overflows."""
    broadcast = np.broadcast_arrays(*(np.asarray(a, dtype=float) for a in arrays))
    values = [
        verb(make(*map(float, scene)), *map(float, scene), log=True)
        for scene in zip(*(a.ravel() for a in broadcast), strict=True)
    ]
    return np.array(values).reshape(broadcast[0].shape)


def assert_same_logs(found: Any, wanted: Any) -> None:
    assert found.shape == wanted.shape
    assert (np.abs(found - wanted) <= 1e-12 * np.maximum(1, np.abs(wanted))).all()


def test_arrays_are_their_scalars_everything_at_once() -> None:
    a_minus = np.array([-1.0, 0.3, 2.0])[:, None, None]
    steepness = np.array([0.5, 6.0])[:, None]
    kappa = np.array([0.1, 0.3, 1.0, 1e-5])
    found = sa.escape_time(sa.tanh(a_minus, -0.5, steepness), kappa, 2.0, log=True)
    wanted = scalars_of(
        lambda d, a, s, k, **o: sa.escape_time(d, k, 2.0, **o),
        lambda a, s, k: sa.tanh(a, -0.5, s), a_minus, steepness, kappa,
    )  # fmt: skip
    assert_same_logs(found, wanted)


def test_chunks_do_not_show() -> None:
    # 5000 scenes, more than are taken at once, mild and stiff ones mixed
    count = 5000
    z0 = -0.9 + 1.3 * np.modf(np.arange(count) * 0.6180339887)[0]
    kappa = 10.0 ** (-3 + 4 * np.modf(np.arange(count) * 0.7548776662)[0])
    drift = sa.friction(3, 1, z0)
    found = sa.escape_time(drift, kappa, 10, log=True)
    some = [0, 1, 2047, 4094, 4095, 4096, 4097, 4998, 4999]
    wanted = [
        sa.escape_time(sa.friction(3, 1, float(z0[i])), float(kappa[i]), 10, log=True) for i in some
    ]
    assert_same_logs(found[some], np.array(wanted))
    sampled = range(0, count, 250)
    for i in sampled:
        exact = sa.escape_time(sa.friction(3, 1, float(z0[i])), float(kappa[i]), 10, dps=25)
        log = logarithm(exact)
        assert distance(float(found[i]), log) <= 1e-12 * max(1, abs(float(log)))


def test_kinds_of_results() -> None:
    drift = sa.linear(1, -1)
    assert isinstance(sa.escape_time(drift, 1, 2), float)
    assert isinstance(sa.escape_time(drift, np.float64(1), np.array(2.0)), float)
    assert isinstance(sa.escape_time(drift, 1, 2, dps=20), mpmath.mpf)
    one = sa.escape_time(drift, [1.0], 2)
    assert isinstance(one, np.ndarray)
    assert one.shape == (1,)
    assert one.dtype == np.float64
    assert sa.escape_time(drift, np.ones((2, 1, 3)), np.full((4, 1), 2.0)).shape == (2, 4, 3)


def test_strings_are_exact_and_floats_are_binary() -> None:
    drift = sa.friction(3, 1, "-0.3")
    exact, binary = (sa.escape_time(drift, k, 10, dps=40) for k in ("0.1", 0.1))
    assert exact == sa.escape_time(drift, F(1, 10), 10, dps=40)
    assert binary == sa.escape_time(drift, F(0.1), 10, dps=40)
    assert 1e-17 < relative(binary, exact) < 1e-12


# -- conduct -------------------------------------------------------------------------------------


def test_threads_get_what_one_thread_gets() -> None:
    names = ["friction k=0.3", "tanh", "linear sliding", "hill"]
    jobs = [(n, d) for n in names for d in (20, 35, 50)] * 2
    wanted = {job: BY_NAME[job[0]].ask("T", dps=job[1]) for job in jobs}
    found: dict[int, Any] = {}

    def work(index: int) -> None:
        name, dps = jobs[index]
        found[index] = BY_NAME[name].ask("T", dps=dps)

    threads = [threading.Thread(target=work, args=(k,)) for k in range(len(jobs))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [found[k] for k in range(len(jobs))] == [wanted[job] for job in jobs]


def test_arguments_are_not_changed() -> None:
    kappa, z0 = np.array([0.1, 0.3]), np.array([-0.3, -0.4])
    drift = sa.friction(3, 1, z0)
    sa.escape_time(drift, kappa, 10)
    assert kappa.tolist() == [0.1, 0.3]
    assert z0.tolist() == [-0.3, -0.4]
    drift.bind(z0=1)
    assert drift.values["z0"].tolist() == [-0.3, -0.4]


#: A function, its options, and noises of which those that are False have no value.
REFUSED: list[tuple[Any, sa.Drift, dict[str, Any], dict[float, bool]]] = [
    (sa.escape_time, FRICTION, {"r": 10}, {1e-3: False, 0.1: True, 1e-4: False, 1.0: True}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "laplace"}, {0.05: True, 3.0: False}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "uniform"}, {0.05: True, 3.0: False}),
    (sa.escape_time, FRICTION, {"r": 10, "method": "strong_noise"}, {0.05: False, 30.0: True}),
    (sa.exit_probability, sa.linear(1, 2), {"r": 3, "method": "paper"}, {1.0: False}),
    (sa.occupation, sa.linear(1, -1), {"complement": True}, {0.01: False, 1.0: True}),
    (sa.stationary_density, sa.linear(1, -1), {"y": 3}, {0.01: False, 1.0: True}),
]


@pytest.mark.parametrize(("verb", "drift", "options", "noises"), REFUSED)
def test_an_element_without_a_value_is_nan(
    verb: Any, drift: sa.Drift, options: dict[str, Any], noises: dict[float, bool]
) -> None:
    kappa, good = np.array(list(noises)), np.array(list(noises.values()))
    found = verb(drift, kappa[:, None], **options, full=True)
    assert (np.isnan(found.value[:, 0]) == ~good).all()
    with pytest.raises(sa.SymasymError) as refused:
        verb(drift, float(kappa[np.argmin(good)]), **options)
    assert str(refused.value) in found.notes[-1]
    for k, value in zip(kappa[good], found.value[good, 0], strict=True):
        assert value == pytest.approx(verb(drift, float(k), **options), rel=1e-9)


@pytest.mark.parametrize("kappa", ["0.5", [0.5, 0.6]])
def test_ends_beyond_the_layer_of_an_own_drift_warn(kappa: Any) -> None:
    between: Any = {"ends": (-2, 1), "start": -1}
    with pytest.warns(UserWarning, match="layer=None"):
        clipped = sa.escape_time(sa.Drift("u - u**3"), kappa, **between)
    # Others do not, and here a warning is an error.
    assert np.all(sa.escape_time(sa.Drift("u - u**3", layer=None), kappa, **between) > clipped)
    sa.escape_time(sa.Drift(1), kappa, **between)


@pytest.mark.parametrize("method", ["exact", "paper", "laplace", "uniform", "strong_noise", "auto"])
def test_a_drift_without_a_stationary_state_is_nan(method: Any) -> None:
    found = sa.occupation(sa.linear(1, [-1.0, 2.0]), 1, method=method, full=True)
    assert np.isnan(found.value).tolist() == [False, True]
    assert "sliding" in found.notes[-1]
    if method == "exact":
        outwards = sa.Drift("a*u", layer=None).bind(a=[-1.0, 1.0])
        assert np.isnan(sa.occupation(outwards, 1)).tolist() == [False, True]
        # kappa^2 is beyond float64, kappa is not.
        assert sa.escape_time(sa.linear(1, 1), "1e-200", 2) == pytest.approx(2.0, rel=1e-12)
