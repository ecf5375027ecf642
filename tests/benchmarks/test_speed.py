"""Times of the main calls, by pytest-benchmark: `pytest tests/benchmarks`.

Nothing here passes or fails on a time; the ratios to peers, and what they should be, are
printed by `python -m tests.benchmarks` and stand in docs/speed.md.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symasym as sa

Z0 = np.linspace(-2.0, -1e-6, 400)[:, None]


def friction(z0: Any = "-0.3") -> sa.Drift:
    return sa.friction(mu=3, alpha=1, z0=z0)


@pytest.mark.parametrize("kappa", ["1", "0.3", "0.1", "1e-4", "1e-8"])
@pytest.mark.parametrize("dps", [30, 1000])
def test_digits(benchmark: Any, kappa: str, dps: int) -> None:
    if dps == 1000 and float(kappa) < 0.1:
        pytest.skip("seconds a call")
    assert benchmark(lambda: sa.escape_time(friction(), kappa, 10, dps=dps)) > 1


@pytest.mark.parametrize("kappa", ["1", "0.3", "0.1"])
def test_proved(benchmark: Any, kappa: str) -> None:
    found = benchmark(lambda: sa.escape_time(friction(), kappa, 10, dps=30, full=True))
    assert found.error_kind == "bound"


@pytest.mark.parametrize("kappa", ["1", "0.1", "1e-4", "1e-8"])
def test_float64_scalar(benchmark: Any, kappa: str) -> None:
    assert benchmark(lambda: sa.escape_time(friction(), kappa, 10, log=True)) > 1


def test_float64_grid(benchmark: Any) -> None:
    drift, kappas = friction(Z0), np.array([0.1, 0.2, 0.5, 1.0])
    assert benchmark(lambda: sa.escape_time(drift, kappas, 10, log=True)).shape == (400, 4)


def test_float64_stiff(benchmark: Any) -> None:
    drift = friction(Z0[:, 0])
    assert np.isfinite(benchmark(lambda: sa.escape_time(drift, 1e-8, 10, log=True))).all()


def test_float64_analytic(benchmark: Any) -> None:
    drift = sa.tanh(1, -1, steepness=3)
    assert benchmark(lambda: sa.escape_time(drift, np.linspace(0.3, 1, 100), 5, log=True)).size


def test_exit_probability(benchmark: Any) -> None:
    drift = friction(Z0[:, 0])
    assert (benchmark(lambda: sa.exit_probability(drift, 0.3, 10, log=True)) < 0).all()


def test_occupation(benchmark: Any) -> None:
    drift, kappas = sa.linear(1, -1), np.geomspace(1e-3, 10, 400)
    assert (benchmark(lambda: sa.occupation(drift, kappas)) <= 1).all()


def test_stationary_density(benchmark: Any) -> None:
    drift, y = sa.linear(1, -1), np.linspace(-3, 3, 601)
    assert (benchmark(lambda: sa.stationary_density(drift, 0.3, y)) >= 0).all()


def test_paper(benchmark: Any) -> None:
    drift = friction(Z0[:, 0])
    assert benchmark(lambda: sa.escape_time(drift, 0.3, 10, method="paper", log=True)).shape == (
        400,
    )
