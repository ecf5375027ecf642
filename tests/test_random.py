"""No claimed digit is wrong: float64, many digits and proved balls on random scenes."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.exact import arbitrary, ball

needs_flint = pytest.mark.skipif(not ball.available(), reason="python-flint is not installed")


def rationals(low: float, high: float) -> st.SearchStrategy[Fraction]:
    return st.integers(int(low * 1000), int(high * 1000)).map(lambda k: Fraction(k, 1000))


def powers_of_ten(low: float, high: float) -> st.SearchStrategy[Fraction]:
    # six digits, so that the scene is a short rational and still anywhere
    return st.floats(low, high).map(lambda x: Fraction(f"{10**x:.5e}"))


@st.composite
def drifts(draw: st.DrawFn) -> sa.Drift:
    kind = draw(st.sampled_from(["friction", "polynomial", "linear", "sine", "tanh", "hill"]))
    ends = draw(rationals(-3, 3)), draw(rationals(-3, 3))
    if kind == "friction":
        return sa.friction(
            mu=draw(rationals(0, 8)), alpha=draw(rationals(0.1, 4)), z0=draw(rationals(-4, 6))
        )
    if kind == "polynomial":
        return sa.polynomial(*draw(st.lists(rationals(-3, 3), min_size=1, max_size=7)))
    if kind == "linear":
        return sa.linear(*ends)
    if kind == "sine":
        return sa.sine(*ends, draw(rationals(-4, 4)), waves=draw(st.integers(1, 4)))
    if kind == "tanh":
        return sa.tanh(*ends, draw(rationals(0.1, 20)))
    return sa.hill(*ends, K=draw(rationals(0.1, 2)), n=draw(st.integers(1, 8)))


@st.composite
def scenes(draw: st.DrawFn, weakest: float) -> tuple[sa.Drift, Fraction, Fraction, Fraction]:
    r = draw(powers_of_ten(-0.5, 4))
    start = r * draw(rationals(-0.99, 0.99))
    return draw(drifts()), draw(powers_of_ten(weakest, 4)), r, draw(st.sampled_from([0 * r, start]))


def gap(found: float, wanted: Any) -> float:
    """Error relative to the logarithm, or absolute where that is small."""
    return float(abs(mpmath.mpf(found) - wanted) / max(1, abs(wanted)))


def check_floats(scene: tuple[sa.Drift, Fraction, Fraction, Fraction]) -> None:
    drift, kappa, r, start = scene
    asked: list[tuple[Any, dict[str, Any]]] = [
        (sa.escape_time, {"r": r, "start": start}),
        (sa.exit_probability, {"r": r, "start": start}),
        (sa.exit_probability, {"r": r, "start": start, "complement": True}),
    ]
    a_minus, a_plus = drift.ends
    if a_minus > 0 > a_plus:
        asked += [
            (sa.occupation, {}),
            (sa.occupation, {"complement": True}),
            (sa.stationary_density, {"y": start}),
        ]
    for verb, arguments in asked:
        found = verb(drift, kappa, **arguments, log=True)
        wanted = verb(drift, kappa, **arguments, log=True, dps=22)
        assert math.isfinite(found)
        assert gap(found, wanted) <= 1e-12, (verb.__name__, found, wanted)


def check_balls(scene: tuple[sa.Drift, Fraction, Fraction, Fraction], dps: int) -> None:
    drift, kappa, r, start = scene
    found = arbitrary.escape_time(drift, kappa, r, start, dps)
    share = arbitrary.exit_probability(drift, kappa, r, start, dps)
    try:
        middle, radius = ball.to_mpf(ball.escape_time(drift, kappa, r, start, dps + 5), dps + 10)
        chance, spread = ball.to_mpf(
            ball.exit_probability(drift, kappa, r, start, dps + 5), dps + 10
        )
    except sa.AccuracyError:
        return  # too stiff for a proof in seconds: a stated limit
    with mpmath.workdps(dps + 20):
        unit = mpmath.mpf(10) ** -dps
        assert abs(found - middle) <= radius + unit * abs(middle)
        assert abs(share - chance) <= spread + unit * abs(chance)


SAMPLE = settings(
    max_examples=40,
    derandomize=True,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)
ALL = settings(SAMPLE, max_examples=10_000)


@SAMPLE
@given(scenes(weakest=-1.5))
def test_floats_sample(scene: Any) -> None:
    check_floats(scene)


@needs_flint
@SAMPLE
@given(scenes(weakest=-1), st.integers(15, 60))
def test_balls_sample(scene: Any, dps: int) -> None:
    check_balls(scene, dps)


@pytest.mark.slow
@ALL
@given(scenes(weakest=-4))
def test_floats_on_ten_thousand_scenes(scene: Any) -> None:
    check_floats(scene)


@needs_flint
@pytest.mark.slow
@ALL
@given(scenes(weakest=-1.5), st.integers(15, 60))
def test_balls_on_ten_thousand_scenes(scene: Any, dps: int) -> None:
    check_balls(scene, dps)
