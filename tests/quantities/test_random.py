"""No claimed digit is wrong: float64 and many digits on random scenes."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import pytest
from hypothesis import given, settings

import symasym as sa
from symasym.workshop import reference_quadrature
from tests.strategies import ALL, SAMPLE, drifts, narrow, scenes


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
    kappa = Fraction(float(kappa))
    for verb, arguments in asked:
        found = verb(drift, [float(kappa)], **arguments, log=True, full=True)
        value, error = float(found.value[0]), float(found.error[0])
        wanted = verb(drift, kappa, **arguments, log=True, dps=22)
        assert math.isfinite(value)
        assert gap(value, wanted) <= 1e-12, (verb.__name__, value, wanted)
        # the last digit of the float64 that is returned is not part of the analysis
        with mpmath.workdps(30):
            assert abs(value - wanted) <= error + math.ulp(value), (verb.__name__, error)


def check_quadrature(scene: tuple[sa.Drift, Fraction, Fraction, Fraction]) -> None:
    """The printed double integral, by plain quadrature."""
    drift, kappa, r, start = scene
    wanted = reference_quadrature.escape_time(drift, kappa, min(r, Fraction(20)), start * 0, 16)
    found = sa.escape_time(drift, kappa, min(r, Fraction(20)), dps=16)
    assert abs(found - wanted) <= mpmath.mpf(10) ** -15 * abs(wanted)


FEW = settings(SAMPLE, max_examples=8)
KINDS = {"ready-made": drifts(), "narrow": narrow()}
# A scene with a narrow feature takes seconds.
SAMPLES = {"ready-made": settings(SAMPLE, max_examples=12), "narrow": FEW}


@pytest.mark.parametrize("kind", KINDS)
def test_floats_sample(kind: str) -> None:
    SAMPLES[kind](given(scenes(-1.5, KINDS[kind]))(check_floats))()


@FEW
@given(scenes(-0.3, drifts()))
def test_quadrature_sample(scene: Any) -> None:
    check_quadrature(scene)


FOUND = {
    # phi of -0.4 as the difference of two numbers near 95
    "cancellation": (
        sa.tanh(Fraction("190.899"), Fraction("-0.401974"), Fraction("5.22181")),
        Fraction("2.12628e-4"),
        Fraction(10),
        Fraction("9.9999639121"),
    ),
    # the sine of a large argument: half an ulp of that is 50 ulp of a-
    "outer drift": (
        sa.Drift(
            "327*u/1000 - 172*sin(200*u + 639/5)/125 + atan(500000*u/60333 - 12500/4641)/2"
            " + 1821/1000"
        ),
        Fraction("156847/5000000"),
        Fraction("226941/50000"),
        Fraction("-4765761/2500000"),
    ),
    # a power so steep at 1 that rounding 11/10 - u counts for 75 ulp, all of it on slow panels
    "steep end": (sa.Drift("(11/10-u)**(-15/2)"), Fraction("1e-4"), Fraction(2), Fraction(3, 4)),
}


@pytest.mark.parametrize("name", FOUND)
def test_scenes_that_once_failed(name: str) -> None:
    check_floats(FOUND[name])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_floats_on_ten_thousand_scenes(kind: str) -> None:
    ALL(given(scenes(-4, KINDS[kind]))(check_floats))()
