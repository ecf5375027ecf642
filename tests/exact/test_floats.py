"""The float engine: no claim is below the true error, which the proved engine tells."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import symasym as sa
from symasym.base.balls import rounded
from symasym.drift.scenes import Request, read
from symasym.exact import balls, floats
from tests.law.scenes import TABLE

pytestmark = pytest.mark.filterwarnings("ignore:outside")  # a layer between ends beyond it

DIGITS = 25
NAMES = ("T", "C", "1 - C", "P", "1 - P", "p_ss")


def numbers_of(name: str, kappa: Any, r: Any, start: Any) -> dict[str, Any]:
    if name in ("T", "C", "1 - C"):
        return {"kappa": kappa, "r": r, "start": start}
    return {"kappa": kappa, "y": start} if name == "p_ss" else {"kappa": kappa}


def require_honest(drift: sa.Drift, name: str, kappa: Any, r: Any = 1.0, start: Any = 0.0) -> Any:
    """The answers of scenes, after a look at their claims: those before balls help, and these."""
    return require_claims(drift, numbers_of(name, kappa, r, start), asked(name))


def require_claims(drift: sa.Drift, numbers: dict[str, Any], request: Request) -> Any:
    scenes = read(drift, numbers, request.reflecting)
    found, answers = floats.float_logs(scenes, request), floats.of_scenes(scenes, request)
    with mp.workdps(DIGITS + 20):
        for row in range(len(scenes.lam)):
            ball = balls.of_scene(scenes.at(row), request._replace(dps=DIGITS)).value
            true = rounded(ball, DIGITS)[0]
            for logs, errors in ((found.log, found.error), (answers.value, answers.error)):
                assert abs(mpf(float(logs[row])) - true) <= errors[row], (request, row, drift)
    assert (answers.error <= floats.TOLERANCE * np.maximum(1.0, np.abs(answers.value))).all()
    return answers


def asked(name: str, moment: int = 1, reflecting: str | None = None) -> Request:
    return Request(name, "exact", None, None, True, True, moment, reflecting)


# -- random scenes ---------------------------------------------------------------------------------


def random_numbers(random: Any, c: Any, noise: tuple[float, float]) -> tuple[Any, Any, Any]:
    """kappa, r and starts, many of them beside zeros, kinks and ends."""
    count = c.shape[1]
    kappa, r = 10 ** random.uniform(*noise, count), 10 ** random.uniform(-1, 6, count)
    start = random.uniform(-1, 1, count) * np.minimum(r, 3.0) * (random.random(count) < 0.7)
    for row in np.flatnonzero(random.random(count) < 0.4):
        zeros = np.roots(np.trim_zeros(c[::-1, row], "f"))
        places = [*zeros[abs(zeros.imag) < 1e-9].real, -1.0, 1.0, r[row], -r[row]]
        near = random.choice(places) + random.choice([-1, 0, 1]) * 10.0 ** -random.integers(3, 12)
        start[row] = near if abs(near) < r[row] else 0.0
    return kappa, r, start


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("noise", [(-8.0, -2.0), (-2.0, 4.0)])
def test_random_polynomials(seed: int, noise: tuple[float, float]) -> None:
    """Unlike rows in one call: degrees to 6, noise over many decades, r to 1e6."""
    random = np.random.default_rng(seed)
    c = np.round(random.uniform(-3, 3, (7, 25)), 2)
    c[np.arange(7)[:, None] > random.integers(0, 7, 25)] = 0.0
    c[0, c[0] == 0.0] = 0.5
    kappa, r, start = random_numbers(random, c, noise)
    for name in NAMES[:3]:
        require_honest(sa.polynomial(*c), name, kappa, r, start)
    ends = (c * (-1.0) ** np.arange(7)[:, None]).sum(axis=0), c.sum(axis=0)
    slides = (ends[0] > 0.01) & (ends[1] < -0.01)
    for name in NAMES[3:]:
        require_honest(sa.polynomial(*c[:, slides]), name, kappa[slides], 1.0, start[slides])


FAMILIES = {
    "tanh": sa.tanh(1, "-0.5", steepness=np.geomspace(0.5, 30, 5)),
    "sine": sa.sine(1, -1, b=np.linspace(0.3, 4, 5), waves=3),
    "hill": sa.hill(1, -1, K=np.linspace(0.2, 0.9, 5), n=4),
    "exp": sa.Drift("2 - exp(c*u) - u").bind(c=np.linspace(0.2, 3, 5)),
}


@pytest.mark.parametrize("family", FAMILIES)
@pytest.mark.parametrize("name", NAMES)
def test_drifts_that_are_no_polynomials(family: str, name: str) -> None:
    kappa = np.array([1e3, 0.3, 0.1, 0.03, 1e-3])
    require_honest(FAMILIES[family], name, kappa, 3.0, np.linspace(-0.9, 1.2, 5))


@pytest.mark.parametrize("kappa", [0.5, 0.05])
@pytest.mark.parametrize("name", NAMES[:5])
def test_many_like_rows(kappa: float, name: str) -> None:
    """Each is what it is alone, and every fortieth what the proved engine says."""
    z0 = np.linspace(0.01, 0.9, 400) if "P" in name else np.linspace(-2.0, -0.01, 400)
    found = floats.of_scenes(
        read(sa.friction(3, 1, z0), numbers_of(name, kappa, 10.0, 0.1)), asked(name)
    )
    alone = require_honest(sa.friction(3, 1, z0[::40]), name, kappa, 10.0, 0.1)
    room = found.error[::40] + alone.error
    assert (np.abs(found.value[::40] - alone.value) <= room).all()
    assert (found.error <= floats.TOLERANCE * np.maximum(1.0, np.abs(found.value))).all()


# -- traps -----------------------------------------------------------------------------------------

CHEBYSHEV = sa.polynomial("-0.9", "-0.5", 18, 0, -48, 0, 32)
TRAPS = {
    "the nested integral of a climb loses e^x ulp": (sa.friction(3, 1, "-0.4"), "T", 0.08, 10, 0.9),
    "a slow panel one width from a zero": (sa.linear(1, -1), "T", 1e-3, 5, 0.01),
    "A(1) near 0": (sa.polynomial("1.0000000001", -1), "T", 0.3, 1e4, 0.2),
    "terms of A that cancel": (CHEBYSHEV, "1 - C", 1e-6, 1.5, 0.5),
    "coefficients found with rounding": (sa.polynomial("2.85", "-2.86"), "1 - P", 4.1e-8, 1, 0),
    "an almost flat well": (sa.polynomial("0.02", "-2.02"), "p_ss", 3.9e-7, 1, 0),
    "log(1 - P) near -1e6": (sa.friction(3, 1, "0.3"), "1 - P", 1e-3, 1, 0),
    "1/sigma of e^(-1e16) beside an end": (
        *(sa.polynomial("1.65", "-1.54", "-0.63"), "C"),
        *(3.783680784370448e-08, 8.408, -8.40799999),
    ),
    "the same, 1e-11 from it": (
        *(sa.polynomial("1.14", "-621.05"), "1 - C"),
        *(0.0007478995161530978, 15022.446092741358, -15022.44609274135),
    ),
    "phi as the difference of two numbers near 95": (
        *(sa.tanh("190.899", "-0.401974", "5.22181"), "T"),
        *(2.12628e-4, 10, 9.9999639121),
    ),
    "the sine of a large argument, half an ulp of which is 50 of a-": (
        sa.Drift("327*u/1000 - 172*sin(200*u + 639/5)/125 + atan(500000*u/60333)/2 + 1821/1000"),
        *("T", 0.03, 4.5, -1.9),
    ),
    "a power so steep that rounding 11/10 - u counts for 75 ulp": (
        *(sa.Drift("(11/10-u)**(-15/2)"), "T", 1e-4, 2, 0.75),
    ),
    "large beside one end only": (sa.Drift("(11/10-u)**(-15/2) - 50"), "C", 0.03, 3, 0.99),
    "a parameter less a number that float64 rounds": (
        *(sa.Drift("a - 1/10", "u").bind(a=np.full(2, 0.1 + 1e-9)), "T", 1e-3, 10, 0.3),
    ),
    "a needle beside which Taylor series lose their first coefficients": (
        sa.Drift("2*u - 21/125 - X*exp(-X**2)/2".replace("X", "((u + 0.666)/3.2e-6)")),
        *("T", 0.003, 3, 0),
    ),
}


@pytest.mark.parametrize("trap", TRAPS)
def test_trap(trap: str) -> None:
    drift, name, kappa, r, start = TRAPS[trap]
    require_honest(drift, name, np.array([kappa, kappa * 1.01]), r, start)


@pytest.mark.parametrize("place", ["110", "-501", "333"])
def test_a_spike_between_the_nodes_is_found(place: str) -> None:
    """Narrower than what 17 nodes see of [-1, 1]; without it log T is another one."""
    drift = sa.Drift(f"1/2 - u + 40*exp(-(1000*u - {place})**2)")
    kappa = np.array([1.0, 0.3])
    found = require_honest(drift, "T", kappa, 2.0)
    without = sa.escape_time(sa.polynomial("1/2", -1), kappa, 2, log=True)
    assert (np.abs(found.value - without) > 1e5 * found.error).all()


# -- pieces, noise, ends, second moments -----------------------------------------------------------

KAPPA = np.array([0.02, 0.3, 3.0])
JUMPS = [("2", -1), ("cos(3*u)", 0), ("-exp(u)/2", "4/3"), ("u - 1", None)]
#: A drift, its ends and a start.
SCENES = {
    "layer": (sa.friction(3, 1, "-0.4"), -10.0, 8.0, -3.0),
    "ends close to the layer": (sa.linear(-1, 1), -1.5, 1.4, -0.9),
    "Ornstein-Uhlenbeck": (sa.Drift("-u", layer=None), -2.0, 3.0, 0.5),
    "double well": (sa.Drift("u - u**3", layer=None), -2.0, 1.5, -0.9),
    "jumps": (sa.Drift.piecewise(JUMPS), -2.0, 2.5, 0.3),
    "Ito": (sa.Drift("-u", layer=None, noise="2 + sin(u)"), -2.0, 3.0, 0.5),
    "noise of a layer": (sa.Drift("1/2 - u", noise="1 + u/4"), -4.0, 3.0, 0.5),
    "Stratonovich": (
        sa.Drift.piecewise([("1 - u/2", "1/3"), ("-1 - u/2", None)], noise="exp(u/4)",
                           ito="stratonovich"),
        *(-3.0, 2.0, 0.2),
    ),
    "outwards": (
        sa.Drift("2 + u", layer=None, noise="2 + sin(u)", ito="stratonovich"), -1.0, 3.0, 0.5,
    ),
}  # fmt: skip


@pytest.mark.parametrize("scene", SCENES)
@pytest.mark.parametrize("moment", [1, 2])
@pytest.mark.parametrize("reflecting", [None, "left", "right"])
def test_moments_between_ends(scene: str, moment: int, reflecting: str | None) -> None:
    drift, left, right, start = SCENES[scene]
    numbers = {"kappa": KAPPA, "left": left, "right": right, "start": start}
    require_claims(drift, numbers, asked("T", moment, reflecting))


@pytest.mark.parametrize(
    ("drift", "left", "right", "start", "kappa"),
    [
        (sa.Drift("-3/2"), -17, 17, -16.5, (0.1, 30)),
        (sa.Drift("-0.241", noise="1 + u**2/4"), -6.4626, 6.4626, -6.3266, (0.1, 30)),
        (sa.linear(1, 3), -1, 1, 0.999999, (1e-4, 0.1)),
        (sa.Drift("u", layer=None), 1, 2, 1.99, (0.01, 1)),
        (sa.Drift("100*u*(u + 3)", layer=None), 2.3, 4, 4 - 4.7e-9, (1e-3, 0.1)),
    ],
)
def test_second_moments_beside_an_end(
    drift: sa.Drift, left: float, right: float, start: float, kappa: tuple[float, float]
) -> None:
    numbers = {"kappa": np.geomspace(*kappa, 80), "left": left, "right": right, "start": start}
    require_claims(drift, numbers, asked("T", 2))


@pytest.mark.parametrize("scene", SCENES)
def test_probabilities_between_ends(scene: str) -> None:
    drift, left, right, start = SCENES[scene]
    ends = {"kappa": KAPPA, "left": left, "right": right}
    for name in ("C", "1 - C"):
        require_claims(drift, ends | {"start": start}, asked(name))
    for low, name in ((left, "P"), (left + 1.2, "1 - P")):
        require_claims(drift, ends | {"low": low, "high": start + 1.1}, asked(name))


def test_a_layer_with_noise_on_the_line() -> None:
    drift = SCENES["noise of a layer"][0]
    for y in (-1.5, 0.3, 2.0):
        require_claims(drift, {"kappa": KAPPA, "y": y}, asked("p_ss"))
        require_claims(drift, {"kappa": KAPPA, "low": y, "high": 2.5}, asked("1 - P"))


@pytest.mark.parametrize("start", [-0.5, 0.0, 0.9])
@pytest.mark.parametrize("kappa", [0.5, 20.0])
def test_second_moment_of_brownian_motion(start: float, kappa: float) -> None:
    """E[tau^2] = (5 - 6 x^2 + x^4)/(3 kappa^4) on (-1, 1), and on (0, 1) where 0 reflects."""
    wanted = (5 - 6 * start**2 + start**4) / (3 * kappa**4)
    drift = sa.Drift("0*u", layer=None)
    for left, reflecting in ((-1, None), (0, "left")):
        if start >= left:
            found = sa.escape_time(
                drift, [kappa], ends=(left, 1), start=start, moment=2, reflecting=reflecting
            )
            assert found[0] == pytest.approx(wanted, rel=1e-12)


@pytest.mark.parametrize("name", TABLE)
def test_collocation_tells_the_same(name: str) -> None:
    scene = TABLE[name]
    known = scene.collocation(64).moments()
    for moment in (1, 2):
        found = sa.escape_time(scene.drift, [float(scene.kappa)], **scene.numbers, moment=moment)
        assert found[0] == pytest.approx(known[moment], rel=1e-10)


def test_what_arrays_leave_to_balls() -> None:
    """Third moments, and the line's stationary state without a layer."""
    drift, ends = sa.Drift("-u", layer=None), {"left": -1.0, "right": 2.0, "start": 0.5}
    require_claims(drift, {"kappa": KAPPA[2:], **ends}, asked("T", 3))
    require_claims(drift, {"kappa": KAPPA[2:], "low": -1.0, "high": 0.5}, asked("P"))
