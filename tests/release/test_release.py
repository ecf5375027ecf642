"""`sa.release` against the exact engine, an independent simulation, and its own refinement."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symasym as sa

CUBIC = "7/5 - u - 3*(u - u**3)"
STILL = sa.System(CUBIC, "-1")  # a clock that moves nothing
BLOCK = sa.oscillator(mu=3, alpha=1)


def marched(kappa: Any, r: Any, eps: Any, start: Any, mu: Any = 3, rtol: Any = 1e-5) -> Any:
    return sa.release(sa.oscillator(mu=mu, alpha=1), kappa, r, eps=eps, start=start, rtol=rtol)


# -- where z has no part in it: the exact engine, and quadrature -----------------------------------


@pytest.mark.parametrize(("kappa", "r", "start"), [("0.3", 10, 0), ("0.5", 2, "0.7"), (2, 5, -3)])
def test_where_nothing_moves_it_is_the_exact_engine(kappa: Any, r: Any, start: Any) -> None:
    drift = sa.Drift(CUBIC)
    answer = sa.release(STILL, kappa, r, eps="0.01", start=(start, 0), rtol=1e-8)
    exact = sa.escape_time(drift, kappa, r, start=start)
    assert abs(answer.mean - exact) <= answer.error <= 1e-8 * exact
    left = sa.exit_probability(drift, kappa, r, start=start)
    assert answer.exit == pytest.approx((left, 1 - left), abs=1e-7)


def test_the_time_does_not_depend_on_an_idle_clock() -> None:
    """Where phi is without z, its velocity changes nothing, though it depends on u."""
    assert sa.System("exp(-10000*(u - 1)**2)", "-1").frozen(0)(1.0) == 1.0  # no product of powers
    ask = {"eps": "0.01", "start": ("0.3", 0), "rtol": 1e-8}
    still, idle = (sa.release(sa.System(CUBIC, g), "0.5", 2, **ask) for g in ("-1", "-1 - u/4"))
    assert idle.mean == pytest.approx(still.mean, rel=1e-7)
    assert idle.std == pytest.approx(still.std, rel=1e-6)
    t = still.time.quantile(np.linspace(0.01, 0.99, 99))
    # At a z the time is not quite normal.
    for g, most in (("-1 - u/4", 1e-4), ("-1 - 3*u/4", 1e-3)):
        idle = sa.release(sa.System(CUBIC, g), "0.5", 2, **ask)
        away = np.abs(idle.time.cdf(t) - still.time.cdf(t)).max()
        assert away <= idle.time.error + still.time.error < most


def test_noise_that_depends_on_the_state() -> None:
    """Against the scale function and speed measure on a fine grid (Ito)."""
    kappa, r = 0.5, 2.0
    system = sa.System(CUBIC, "-1", noise="1 + (1 - u**2)**2")
    answer = sa.release(system, kappa, r, eps="0.01", start=(0, 0))
    x = np.linspace(-r, r, 40_001)
    c = np.clip(x, -1, 1)
    variance = (kappa * (1 + (1 - c**2) ** 2)) ** 2

    def integral(f: Any) -> Any:
        return np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(x))])

    log = integral(2 * (1.4 - c - 3 * (c - c**3)) / variance)
    scale, speed = np.exp(-log), 2 * np.exp(log) / variance
    s, nested = integral(scale), integral(scale * integral(speed))
    at = x.size // 2
    assert answer.mean == pytest.approx(nested[-1] * s[at] / s[-1] - nested[at], rel=1e-5)


# -- where z moves: simulation, symmetry, laws -----------------------------------------------------


def paths_released(kappa: float, paths: int, seed: int) -> tuple[Any, Any]:
    """Times and z of paths of the block from (0, -0.4) to |u| = 10, with eps = 1/100.

    Euler and Maruyama's method for eq:osc3; the boundary is moved by 0.5826 kappa sqrt(h) for what
    discrete times miss (Broadie, Glasserman and Kou, Math. Finance 7 (1997) 325).
    """
    h, eps, normal = 0.01, 0.01, np.random.default_rng(seed).standard_normal
    near = 10 - 0.5826 * kappa * np.sqrt(h)
    u, z, step, times, places = np.zeros(paths), np.full(paths, -0.4), 0, [], []
    while u.size:
        c = np.clip(u, -1, 1)
        moved = u + h * (1 - z - (c + 3 * (c - c**3)) - eps * u)
        z = z + h * eps * (eps * u - 1)
        u, step = moved + kappa * np.sqrt(h) * normal(u.size), step + 1
        gone = np.abs(u) >= near
        times += [step * h] * np.count_nonzero(gone)
        places += [*z[gone]]
        u, z = u[~gone], z[~gone]
    return np.array(times), np.array(places)


@pytest.mark.parametrize("kappa", [pytest.param(0.1, marks=pytest.mark.slow), 0.3])
def test_march_against_simulation(kappa: float) -> None:
    times, places = paths_released(kappa, 1000, seed=3)
    answer = marched(kappa, 10, 0.01, (0, -0.4))
    # The step of the witness leaves a bias of about 0.05.
    assert abs(times.mean() - answer.mean) < 3 * answer.std / np.sqrt(times.size) + 0.1
    assert times.std() == pytest.approx(answer.std, rel=0.1)
    assert answer.time.cdf(np.median(times)) == pytest.approx(0.5, abs=0.05)
    assert answer.z.cdf(np.median(places)) == pytest.approx(0.5, abs=0.05)
    for law in (answer.time, answer.z):
        p = np.array([0.01, 0.3, 0.5, 0.9, 0.999])
        x = law.quantile(p)
        assert (np.diff(x) > 0).all()
        assert np.allclose(law.cdf(x), p, atol=1e-8)
        grid = np.linspace(law.quantile(1e-6), law.quantile(1 - 1e-6), 401)
        assert abs(np.trapezoid(1 - law.cdf(grid), grid) + grid[0] - law.mean) < 1e-3 * law.std
    # The deviation comes from an equation of its own, and from the law's density.
    assert answer.time.std == pytest.approx(answer.std, rel=1e-4)
    assert answer.time.mean == pytest.approx(answer.mean, rel=1e-5)


def test_the_mirrored_block_is_released_at_the_same_time() -> None:
    """u, z to -u, -z: the clock runs the other way."""
    mirrored = sa.System("-1 - z - y - u - 3*(u - u**3)", "y + 1")
    one = marched(2, 5, 0.02, (0.5, -0.4))
    other = sa.release(mirrored, 2, 5, eps="0.02", start=("-0.5", "0.4"), rtol=1e-5)
    assert abs(other.mean - one.mean) <= one.error + other.error
    assert other.exit == pytest.approx(one.exit[::-1], abs=1e-6)
    assert other.z.quantile(0.2) == pytest.approx(-one.z.quantile(0.8), abs=1e-4)
    assert other.std == pytest.approx(one.std, rel=1e-5)


def test_laws_are_as_far_as_they_say() -> None:
    rough, fine = (marched("0.3", 5, "0.02", (0, "-0.4"), rtol=x) for x in (1e-3, 1e-7))
    for law, true in ((rough.time, fine.time), (rough.z, fine.z)):
        at = true.quantile(np.linspace(0.01, 0.99, 99))
        away = np.abs(law.cdf(at) - true.cdf(at)).max()
        assert 0 < away <= law.error + true.error


def test_simulation_by_the_verb() -> None:
    """With strong noise and a long step the boundary's shift is most of the answer."""
    ask = {"eps": "0.01", "start": (0, "-0.4"), "method": "simulate", "step": "0.02"}
    answer = sa.release(BLOCK, 2, 5, paths=10_000, seed=11, **ask)
    whole = marched(2, 5, 0.01, (0, -0.4))
    assert abs(answer.mean - whole.mean) < min(answer.error, 0.02 * whole.mean)
    assert answer.exit[0] == pytest.approx(whole.exit[0], abs=0.02)
    assert 3 <= 100 * answer.error / answer.std < 8
    at = whole.time.quantile(np.linspace(0.01, 0.99, 99))
    away = np.abs(answer.time.cdf(at) - whole.time.cdf(at)).max()
    assert away <= answer.time.error + whole.time.error < 8 * away
    assert answer.time.quantile(0.5) == pytest.approx(whole.time.quantile(0.5), rel=0.03)
    assert sa.release(BLOCK, 2, 5, paths=10_000, seed=11, **ask).mean == answer.mean


def test_coloured_noise_spreads_by_its_own_law() -> None:
    """Of du = dt + kappa x dt it is known: kappa^2 (t - tau (1 - e^(-t/tau)))."""
    ask = {"method": "simulate", "paths": 8000, "seed": 5, "tau": 1, "step": "0.05"}
    answer = sa.release(sa.System("1", "-1"), "0.2", 2, eps="0.01", start=(0, 0), **ask)
    assert answer.mean == pytest.approx(2, abs=0.05)
    assert answer.std == pytest.approx(0.2 * np.sqrt(2 - (1 - np.exp(-2))), rel=0.025)


@pytest.mark.slow
def test_coloured_noise_tends_to_the_white() -> None:
    ask = {"eps": "0.01", "start": (0, 0), "method": "simulate", "paths": 4000, "seed": 2}
    exact = sa.escape_time(sa.Drift(CUBIC), "0.5", 10)
    long = sa.release(STILL, "0.5", 10, tau="0.16", step="0.02", **ask)
    short = sa.release(STILL, "0.5", 10, tau="0.02", step="0.005", **ask)
    assert long.mean > 1.06 * exact
    assert short.mean == pytest.approx(exact, rel=0.03)


@pytest.mark.parametrize(
    "seed", [0, 3, *(pytest.param(k, marks=pytest.mark.slow) for k in range(4, 100))]
)
def test_the_claimed_error_holds(seed: int) -> None:
    """Random scenes, from weak to strong noise, either side of the fold, against finer marches."""
    rng = np.random.default_rng([seed, 17])
    mu, alpha = rng.uniform(0, 4), rng.uniform(0.5, 2)
    eps = 10 ** rng.uniform(-5, np.log10(0.05))
    kappa, r = 10 ** rng.uniform(np.log10(0.05), 1), rng.uniform(2, min(10, 0.9 / eps))
    beta = alpha * (2 * (1 + mu) ** 1.5 / (3 * np.sqrt(3 * mu)) if mu > 0.5 else 1)
    start = rng.uniform(-1, 1), rng.uniform(0.2 - beta, 1.5 + alpha)
    rtol, block = 10 ** rng.uniform(-6, -3), sa.oscillator(mu=mu, alpha=alpha)
    answer, finer = (
        sa.release(block, kappa, r, rtol=x, eps=eps, start=start) for x in (rtol, rtol / 100)
    )
    assert abs(answer.mean - finer.mean) <= answer.error + finer.error
    assert answer.error <= rtol * answer.mean


# -- bad input, System, drag time ------------------------------------------------------------------


@pytest.mark.parametrize(
    "change",
    [
        {"eps": 0}, {"eps": "-1"}, {"kappa": 0}, {"r": 100}, {"start": (10, 0)}, {"start": 0},
        {"method": "magic"}, {"rtol": "1e-14"}, {"kappa": "1e-4"}, {"tau": 1},
        {"method": "simulate", "seed": 1.5}, {"method": "simulate", "paths": 0},
        {"method": "simulate", "paths": 10**12}, {"method": "simulate", "step": -1},
        {"method": "simulate", "tau": -1},
        {"method": "simulate", "tau": "0.1", "step": "0.03"},
        {"system": "u"}, {"system": sa.System("1 - z - u", "-1 - sqrt(u)")},
        {"system": sa.System(CUBIC, "-z")},  # the clock comes to rest
        {"kappa": "1e160"}, {"system": sa.System("log(z) - u", "-1"), "start": (0, 1)},
    ],
    ids=str,
)  # fmt: skip
def test_bad_input(change: dict[str, Any]) -> None:
    ask = {"system": BLOCK, "kappa": 1, "r": 10, "eps": "0.01", "start": (0, "-0.4"), **change}
    with pytest.raises(sa.SymasymError):
        sa.release(**ask)


@pytest.mark.parametrize(
    "texts",
    [("1 - z - b*u", "-1"), ("1 - z - u", "-1", "z"), ("1 - z - u", "-1", "u"), ("1 +", "-1")],
)
def test_bad_systems(texts: tuple[str, ...]) -> None:
    with pytest.raises(sa.InputError):
        sa.System(*texts)


def test_the_drag_time_is_the_way_to_the_fold() -> None:
    folds = sa.formula("folds").emit("numpy").load()
    low, high = folds.folds_right_fold(2, 1), folds.folds_left_fold(2, 1)
    block = sa.oscillator(mu=2, alpha=1)
    assert block.drag_time("-0.3", "0.02") == pytest.approx((-0.3 - low) / 0.02, rel=1e-13)
    # From the other fold on, the well grows deeper.
    assert block.drag_time("2.2", "0.02") == pytest.approx((high - 2.2) / 0.02, rel=1e-13)
    assert block.drag_time("-3", "0.02") == float("inf")
    # Without much noise the block is released past the fold, that much later and its flight.
    answer = sa.release(block, 0.1, 10, eps="0.02", start=(0, "-0.3"), rtol=1e-3)
    assert block.drag_time("-0.3", "0.02") < answer.mean < block.drag_time("-0.3", "0.02") + 40
