"""`sa.release` against the exact engine, simulation, quadrature and its own refinement."""

from __future__ import annotations

from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor

import numpy as np
import pytest

import symasym as sa
from symasym.base.errors import AccuracyError, InputError
from symasym.release import march as march_module
from symasym.release.simulate import simulate
from tests.release.test_frozen import release_times

BLOCK = sa.oscillator(mu=3, alpha=1)
# Scaled kappa, r, eps, (u, z), mu: three of them sliding at the start or without a well.
SCENES = (
    (0.1, 10, 0.01, (0, -0.4), 3),
    (0.3, 10, 0.01, (0, -0.4), 3),
    (1, 10, 0.01, (0, -0.4), 3),
    (0.1, 10, 0.05, (0, -0.4), 3),
    (0.5, 10, 0.05, (0.5, -0.3), 3),
    (0.2, 10, 0.02, (0, 0.3), 3),  # sliding
    (0.3, 10, 0.01, (0, -0.4), 0.5),  # no well
    (2, 10, 0.01, (-3, -1), 3),  # past the fold
    (5, 10, 0.01, (0, -0.2), 2),
    (10, 10, 0.05, (2, -0.4), 1),
    (0.15, 5, 0.02, (0, -0.5), 2),
    (0.4, 4, 0.005, (0, -0.6), 3),
)


def marched(kappa, r, eps, start, mu=3, rtol=1e-6):
    block = sa.oscillator(mu=mu, alpha=1)
    return sa.release(block, kappa, r, eps=eps, start=start, method="march", rtol=rtol)


@pytest.mark.parametrize(("kappa", "r", "start"), [("0.3", 10, 0), ("0.5", 2, "0.7"), (2, 5, -3)])
def test_where_nothing_moves_it_is_the_exact_engine(kappa, r, start):
    still = sa.System("7/5 - u - 3*(u - u**3)", "-1")
    drift = sa.Drift("7/5 - u - 3*(u - u**3)")
    answer = sa.release(still, kappa, r, eps="0.01", start=(start, 0), method="march", rtol=1e-8)
    exact = sa.escape_time(drift, kappa, r, start=start)
    assert abs(answer.mean - exact) <= answer.error <= 1e-8 * exact
    left = sa.exit_probability(drift, kappa, r, start=start)
    assert abs(answer.exit[0] - left) < 1e-7
    assert sum(answer.exit) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("kappa", [0.1, 0.3])
def test_march_against_simulation(kappa):
    times = release_times(kappa, 2000, frozen=False, seed=3)
    answer = marched(kappa, 10, 0.01, (0, -0.4))
    # The step of the witness leaves a bias of about 0.05.
    assert abs(times.mean() - answer.mean) < 3 * answer.std / np.sqrt(times.size) + 0.1
    assert times.std() == pytest.approx(answer.std, rel=0.1)
    middle = np.median(times)
    assert answer.time.cdf(middle) == pytest.approx(0.5, abs=0.05)


@pytest.mark.slow
@pytest.mark.parametrize("scene", SCENES, ids=str)
def test_march_against_a_hundred_thousand_paths(scene):
    kappa, r, eps, start, mu = scene
    answer = marched(*scene)
    system = sa.oscillator(mu=mu, alpha=1)
    # The bias is of order h: two steps give it away.
    h = min(0.01, 0.0005 * (r / kappa) ** 2)
    # Seeds of each scene's own: with common ones all scenes err to the same side.
    seed = 100 * SCENES.index(scene)
    fine = simulate(system, kappa, r, eps, start, 100_000, h / 2, seed)
    rough = simulate(system, kappa, r, eps, start, 100_000, h, seed + 1)
    mean = 2 * fine.time.mean() - rough.time.mean()
    error = np.hypot(2 * fine.time.std(), rough.time.std()) / np.sqrt(100_000)
    assert abs(answer.mean - mean) < 3 * error + answer.error
    assert abs((fine.side < 0).mean() - answer.exit[0]) < 0.006
    assert answer.time.quantile(0.25) == pytest.approx(np.quantile(fine.time, 0.25), rel=0.02)


def random_scene(rng):
    """A scene of the friction oscillator, from weak to strong noise, either side of the fold."""
    mu, alpha = rng.uniform(0, 4), rng.uniform(0.5, 2)
    eps = 10 ** rng.uniform(-5, np.log10(0.05))
    kappa, r = 10 ** rng.uniform(np.log10(0.05), 1), rng.uniform(2, min(10, 0.9 / eps))
    beta = alpha * (2 * (1 + mu) ** 1.5 / (3 * np.sqrt(3 * mu)) if mu > 0.5 else 1)
    start = rng.uniform(-1, 1), rng.uniform(0.2 - beta, 1.5 + alpha)
    return sa.oscillator(mu=mu, alpha=alpha), kappa, r, eps, start


def assert_honest(rng):
    system, kappa, r, eps, start = random_scene(rng)
    rtol = 10 ** rng.uniform(-6, -3)
    ask = {"eps": eps, "start": start, "method": "march"}
    answer = sa.release(system, kappa, r, rtol=rtol, **ask)
    refined = sa.release(system, kappa, r, rtol=rtol / 1000, **ask)
    assert abs(answer.mean - refined.mean) <= answer.error + refined.error
    assert answer.error <= rtol * answer.mean


@pytest.mark.parametrize("seed", range(4))
def test_the_claimed_error_holds(seed):
    assert_honest(np.random.default_rng([seed, 17]))


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4, 200))
def test_the_claimed_error_holds_everywhere(seed):
    assert_honest(np.random.default_rng([seed, 17]))


def test_two_derivations_of_the_variance_agree():
    answer = marched(0.3, 10, 0.01, (0, -0.4))
    # v solves an equation of its own; the law's is of the density.
    assert answer.time.std == pytest.approx(answer.std, rel=1e-4)
    assert answer.time.mean == pytest.approx(answer.mean, rel=1e-5)
    assert answer.time.error < 1e-3


def test_the_mirrored_block_is_released_at_the_same_time():
    """u, z to -u, -z: the clock runs the other way."""
    mirrored = sa.System("-1 - z - y - u - 3*(u - u**3)", "y + 1")
    one = marched(2, 5, 0.02, (0.5, -0.4))
    other = sa.release(mirrored, 2, 5, eps="0.02", start=("-0.5", "0.4"), method="march")
    assert other.mean == pytest.approx(one.mean, rel=1e-6)
    assert other.exit == pytest.approx(one.exit[::-1], abs=1e-6)
    assert other.z.quantile(0.2) == pytest.approx(-one.z.quantile(0.8), abs=1e-4)
    assert other.std == pytest.approx(one.std, rel=1e-5)


def test_a_clock_that_comes_to_rest_is_refused():
    resting = sa.System("7/5 - u - 3*(u - u**3)", "-z")
    with pytest.raises((InputError, AccuracyError), match="no one sign|still held"):
        sa.release(resting, "0.1", 10, eps="0.05", start=(0, "1e-3"), method="march", rtol=1e-3)


def test_laws_are_laws():
    answer = marched(0.3, 10, 0.01, (0, -0.4))
    for law in (answer.time, answer.z):
        p = np.array([0.01, 0.3, 0.5, 0.9, 0.999])
        x = law.quantile(p)
        assert (np.diff(x) > 0).all()
        assert np.allclose(law.cdf(x), p, atol=1e-8)
        grid = np.linspace(law.quantile(1e-6), law.quantile(1 - 1e-6), 401)
        assert abs(np.trapezoid(1 - law.cdf(grid), grid) + grid[0] - law.mean) < 1e-3 * law.std
    # While it sticks z moves at about -1, by eps in a unit of time.
    assert answer.z.mean == pytest.approx(-0.4 - 0.01 * answer.mean, abs=0.03)


def test_full_has_the_laws_at_once():
    answer = sa.release(sa.oscillator(3, 1), 1, 10, eps=0.01, start=(0, -0.4), full=True)
    assert "_laws" in vars(answer)
    assert answer.time.mean == pytest.approx(answer.mean, rel=1e-3)


def test_first_order_is_the_slope_in_eps():
    ask = {"start": (0, "-0.4")}
    frozen = sa.release(BLOCK, "0.5", 10, eps="1e-5", method="frozen", **ask)
    first = sa.release(BLOCK, "0.5", 10, eps="1e-5", method="first_order", **ask)
    whole = sa.release(BLOCK, "0.5", 10, eps="1e-5", method="march", rtol=1e-9, **ask)
    slope = whole.mean - frozen.mean
    assert first.mean - frozen.mean == pytest.approx(slope, rel=0.01)
    assert slope / (1e-5 * frozen.mean**2) == pytest.approx(-1.2, abs=0.02)
    for answer in (frozen, first):
        assert abs(answer.mean - whole.mean) <= answer.error
    assert frozen.mean == pytest.approx(
        sa.escape_time(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.5", 10), rel=1e-12
    )


def test_frozen_claims_nothing_where_z_moves():
    answer = sa.release(BLOCK, "0.1", 10, eps="0.01", start=(0, "-0.4"), method="frozen")
    assert answer.error is None
    assert "not the time of release; a well has changed by its depth in 37.78." in answer.notes[0]
    with pytest.raises(AccuracyError, match="first correction is .* take method='march'"):
        sa.release(BLOCK, "0.1", 10, eps="0.01", start=(0, "-0.4"), method="first_order")


def test_auto_takes_the_cheapest():
    slow = sa.release(BLOCK, 1, 10, eps="1e-9", start=(0, "-0.4"), rtol="1e-6")
    first = sa.release(BLOCK, 1, 10, eps="1e-5", start=(0, "-0.4"), rtol="1e-5")
    quick = sa.release(BLOCK, "0.3", 10, eps="0.01", start=(0, "-0.4"), rtol="1e-4")
    assert (slow.method, first.method, quick.method) == ("frozen", "first_order", "march")


def test_noise_that_depends_on_the_state():
    """Against the scale function and speed measure on a fine grid (Ito)."""
    kappa, r = 0.5, 2.0
    system = sa.System("7/5 - u - 3*(u - u**3)", "-1", noise="1 + (1 - u**2)**2")
    answer = sa.release(system, kappa, r, eps="0.01", method="march")
    x = np.linspace(-r, r, 40_001)
    c = np.clip(x, -1, 1)
    phi, sigma = 1.4 - c - 3 * (c - c**3), 1 + (1 - c**2) ** 2
    rate = 2 * phi / (kappa * sigma) ** 2

    def integral(f):
        return np.concatenate([[0.0], np.cumsum((f[1:] + f[:-1]) / 2 * np.diff(x))])

    log = integral(rate)
    scale, speed = np.exp(-log), 2 * np.exp(log) / (kappa * sigma) ** 2
    s, nested = integral(scale), integral(scale * integral(speed))
    at = x.size // 2
    assert answer.mean == pytest.approx(nested[-1] * s[at] / s[-1] - nested[at], rel=1e-5)


def test_simulation_by_the_verb():
    """With strong noise and a long step the boundary's shift is most of the answer."""
    ask = {"eps": "0.01", "start": (0, "-0.4"), "method": "simulate", "step": "0.02"}
    answer = sa.release(BLOCK, 2, 5, paths=20_000, seed=11, **ask)
    whole = marched(2, 5, 0.01, (0, -0.4))
    assert abs(answer.mean - whole.mean) < 0.02 * whole.mean
    assert abs(answer.mean - whole.mean) <= answer.error
    assert answer.exit[0] == pytest.approx(whole.exit[0], abs=0.015)
    assert answer.time.quantile(0.5) == pytest.approx(whole.time.quantile(0.5), rel=0.03)
    assert "standard error" in answer.notes[0]


def test_coloured_noise_tends_to_the_white():
    still = sa.System("7/5 - u - 3*(u - u**3)", "-1")
    ask = {"eps": "0.01", "method": "simulate", "paths": 4000, "seed": 2}
    exact = sa.escape_time(sa.Drift("7/5 - u - 3*(u - u**3)"), "0.5", 10)
    long = sa.release(still, "0.5", 10, tau="0.16", step="0.02", **ask)
    short = sa.release(still, "0.5", 10, tau="0.02", step="0.005", **ask)
    assert long.mean > 1.06 * exact
    assert short.mean == pytest.approx(exact, rel=0.03)


def test_adiabatic_where_escape_is_rare_and_early():
    slow = sa.release(BLOCK, "0.15", 10, eps="1e-4", start=(0, "-0.5"), method="adiabatic")
    whole = marched(0.15, 10, 1e-4, (0, -0.5), rtol=1e-4)
    assert slow.error is None
    assert slow.mean == pytest.approx(whole.mean, rel=0.015)
    assert slow.std == pytest.approx(whole.std, rel=0.05)
    # Where nothing changes it is the exponential law of mean T.
    still = sa.System("7/5 - u - 3*(u - u**3)", "-1")
    answer = sa.release(still, "0.3", 10, eps="0.01", method="adiabatic")
    exact = sa.escape_time(sa.Drift("7/5 - u - 3*(u - u**3)"), "0.3", 10)
    assert answer.mean == pytest.approx(exact, rel=1e-6)
    assert answer.time.cdf(exact) == pytest.approx(1 - np.exp(-1), abs=1e-6)


def test_simulation_is_the_same_for_any_workers():
    ask = (BLOCK, 1.0, 5.0, 0.01, (0.0, -0.4), 12_000, 0.05, 4)
    alone = simulate(*ask)
    with ThreadPoolExecutor(2) as threads:
        shared = simulate(*ask, threads)
    assert np.array_equal(alone.time, shared.time)
    assert np.array_equal(alone.z, shared.z)
    elsewhere = simulate(*ask, 2)
    assert np.array_equal(alone.time, elsewhere.time)
    with pytest.raises(InputError, match="scheduler"):
        simulate(*ask, "nowhere")


class Dying(Executor):
    """Does the first batch, and dies."""

    done = 0

    def submit(self, fn, /, *args, **kwargs):
        future: Future = Future()
        if self.done:
            future.set_exception(BrokenExecutor("gone"))
        else:
            future.set_result(fn(*args, **kwargs))
        self.done += 1
        return future


def test_an_executor_that_dies_loses_nothing():
    ask = (BLOCK, 1.0, 5.0, 0.01, (0.0, -0.4), 12_000, 0.05, 4)
    with pytest.warns(RuntimeWarning, match="died .* with 2 of 3 batches not done"):
        saved = simulate(*ask, Dying())
    assert np.array_equal(saved.time, simulate(*ask).time)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"eps": 0}, "eps is 0; it must be greater than 0"),
        ({"eps": "-1"}, "eps is -1; it must be greater than 0"),
        ({"kappa": 0}, "kappa is 0; it must be"),
        ({"r": 100}, "no one sign in .* r eps smaller"),
        ({"start": (10, 0)}, r"start's u is 10; it must be inside \(-r, r\)"),
        ({"start": 0}, "give the pair"),
        ({"method": "magic"}, "give one of 'auto', 'march'"),
        ({"rtol": "1e-14"}, "rtol is 1e-14; give 1e-10 to 1"),
        ({"method": "simulate", "seed": 1.5}, "seed is 1.5; give a whole number"),
        ({"method": "simulate", "paths": 0}, "paths is 0; give a whole number"),
        ({"method": "simulate", "paths": 10**12}, "paths is 1000000000000; give at most 100000000"),
        ({"method": "simulate", "workers": 0}, "workers is 0; give a whole number"),
        ({"method": "simulate", "step": -1}, "step is -1; it must be greater"),
        ({"method": "simulate", "tau": -1}, "tau is -1; it must be at least 0"),
        ({"method": "simulate", "tau": "1e-13"}, "tau is 1e-13, of too many steps"),
        ({"method": "simulate", "tau": "0.1", "step": "0.03"}, "step is 0.03, too long for"),
        ({"method": "march", "tau": 1}, "coloured noise is for method='simulate'"),
        ({"kappa": "0.012", "method": "frozen"}, r"T is e\^1\d\d\d\.\d*, beyond float64"),
        ({"kappa": "1e-4"}, "would need .* elements"),
    ],
)
def test_bad_input(change, message):
    ask = {"kappa": 1, "r": 10, "eps": "0.01", "start": (0, "-0.4"), **change}
    with pytest.raises(sa.SymasymError, match=message):
        sa.release(BLOCK, ask.pop("kappa"), ask.pop("r"), **ask)


@pytest.mark.parametrize(
    ("phi", "velocity", "noise", "message"),
    [
        ("1 - z - b*u", "-1", "1", "symbol b, which has no value"),
        ("1 - z - u", "-1", "z", "an expression in u alone"),
        ("1 - z - u", "-1", "u", "comes down to -1 in the layer"),
    ],
)
def test_bad_systems(phi, velocity, noise, message):
    with pytest.raises(InputError, match=message):
        sa.System(phi, velocity, noise)


@pytest.mark.parametrize("method", ["auto", "simulate"])
def test_a_field_without_a_value_is_refused(method):
    system = sa.System("1 - z - u", "-1 - sqrt(u)")
    with pytest.raises(InputError, match="velocity has no value at u = -5, z = 0.5"):
        sa.release(system, 1, 5, eps="0.01", start=(0, "0.5"), method=method)


def test_a_reduction_becomes_a_system():
    relay = sa.reduce(
        ("1 - 2*x - w", "-1 - x"),
        ("-1 - 2*x - w", "-1 - x"),
        ("-sin(pi*s/2) - 2*x - w", "-1 - x"),
        ((1,), (0,)),
        ("x", "w"),
    )
    system = sa.System.of(relay, "w", "x")
    assert system == sa.System("-sin(pi*u/2) - 2*y - z", "-1 - y")
    for arguments, message in (
        (("q", "x"), "slow is 'q'; give two different coordinates out of x, w"),
        (("w", "w"), "two different coordinates"),
    ):
        with pytest.raises(InputError, match=message):
            sa.System.of(relay, *arguments)


def test_the_drag_time_is_the_way_to_the_fold():
    fold = sa.friction(mu=2, alpha=1).folds().z0[0]
    block = sa.oscillator(mu=2, alpha=1)
    assert block.drag_time("-0.3", "0.02") == pytest.approx((-0.3 - fold) / 0.02, rel=1e-14)
    # From the other fold on, the well grows deeper.
    other = sa.friction(mu=2, alpha=1).folds().z0[1]
    assert block.drag_time("2.2", "0.02") == pytest.approx((other - 2.2) / 0.02, rel=1e-13)
    assert block.drag_time("-3", "0.02") == float("inf")
    # Marched without much noise, the block is past the fold that much later and its flight.
    answer = sa.release(block, 0.05, 10, eps="0.02", start=(0, "-0.3"), rtol=1e-3)
    assert block.drag_time("-0.3", "0.02") < answer.mean < block.drag_time("-0.3", "0.02") + 40


@pytest.mark.parametrize(("turn", "ratio"), [("1", 1.0), ("2", 0.5), ("-1", 1.0)])
def test_the_drag_time_on_a_curved_surface(turn: str, ratio: float):
    """A rotation along a circle at whose (1, 0) the drift is friction's, z going down with y."""
    across = "(7/5 + y - s - 3*(s - s**3))"
    inside = (f"x*{across} - {turn}*y", f"y*{across} + {turn}*x")
    minus, plus = ([e.replace("s", f"({side})") for e in inside] for side in (-1, 1))
    circle = sa.reduce(
        minus, plus, inside, (1, 1), ("x", "y"), switch="(x**2 + y**2 - 1)/2", at={"y": 0, "x": 1}
    )
    expected = ratio * BLOCK.drag_time("-0.4", "0.01")
    assert circle.drag_time("0.01") == pytest.approx(expected, rel=1e-12)


def test_the_drag_time_needs_every_coordinate():
    free = sa.reduce(("2 - z", "-1"), ("-z", "-1"), ("1 - s - z", "-1"), (1, 0), ("y", "z"))
    with pytest.raises(InputError, match="values has no z; give it a number there"):
        free.drag_time("0.01")
    assert free.drag_time("0.01", {"z": "1/2"}) == float("inf")
    with pytest.raises(InputError, match="eps is 0; it must be greater than 0"):
        free.drag_time(0, {"z": "1/2"})


def test_a_note_where_t_is_not_small_beside_the_drag_time():
    frozen = BLOCK.frozen("-0.4")
    borne = BLOCK.drag_time("-0.4", "0.01")
    fold = sa.friction(mu=3, alpha=1).folds().z0[0]
    assert sa.rescale("0.01", 1).drag_time(-0.4 - fold) == pytest.approx(borne, rel=1e-6)
    noted = sa.escape_time(frozen, "0.1", 10, full=True, drag_time=borne)
    assert "T is 6.3e+09 times the drag time 37.7778 " in str(noted)
    assert noted.value == sa.escape_time(frozen, "0.1", 10, full=True).value
    for log in (False, True):
        short = sa.escape_time(frozen, 40, 10, log=log, full=True, drag_time=borne)
        assert short.notes == ()
    both = sa.escape_time(frozen, [40, 0.01], 10, log=True, full=True, drag_time=borne)
    assert "more than 10^300 times" in both.notes[0]
    for longer in (float("inf"), "1e300"):
        assert sa.escape_time(frozen, 1, 10, full=True, drag_time=longer).notes == ()
    with pytest.raises(InputError, match="drag_time is 3, for a note; pass full=True with it"):
        sa.escape_time(frozen, 1, 10, drag_time=3)


def test_only_known_laws():
    answer = sa.release(BLOCK, 1, 10, eps="1e-9", start=(0, "-0.4"), method="frozen")
    with pytest.raises(InputError, match="gives no law"):
        _ = answer.time
    with pytest.raises(InputError, match="give a probability"):
        marched(1, 10, 0.01, (0, -0.4), rtol=1e-3).z.quantile(1.5)


def test_an_error_not_reached_says_so(monkeypatch):
    monkeypatch.setattr(march_module, "_FINEST", 1)
    with pytest.raises(AccuracyError, match="reaches .* elements and .* slabs"):
        marched(0.05, 10, 0.05, (0, -0.4), rtol=1e-10)


def test_patience() -> None:
    scene = sa.oscillator(mu=3, alpha=1), "0.1", 10
    with pytest.raises(sa.TimeLimitError, match="0.05 seconds"):
        sa.release(*scene, eps="0.01", start=(0, "-0.4"), method="march", patience=0.05)
    with pytest.raises(sa.InputError, match="patience is 'x'"):
        sa.release(*scene, eps="0.01", start=(0, "-0.4"), patience="x")  # type: ignore[arg-type]
