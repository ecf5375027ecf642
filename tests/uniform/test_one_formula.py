"""One formula for each method and order: a float, an array, 40 digits and emitted code agree."""

from __future__ import annotations

from fractions import Fraction
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.uniform.order_zero import closed_form
from symasym.base.call_context import own_context
from tests.strategies import SAMPLE

# -- uniform, order 0 ------------------------------------------------------------------------------

DEGREES = 6


@st.composite
def uniform_scenes(draw: st.DrawFn) -> tuple[list[float], float, float, float]:
    """Coefficients of A, half of them beside a coalescence, kappa, r and start."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    degree = int(rng.integers(0, DEGREES))
    c = np.round(rng.uniform(-3, 3, degree + 1), 3)
    if degree > 1 and draw(st.booleans()):
        u = rng.uniform(-0.9, 0.9)
        c[1] -= sum(k * c[k] * u ** (k - 1) for k in range(1, degree + 1))
        c[0] -= sum(c[k] * u**k for k in range(degree + 1))
        c[0] += rng.choice([-1, 1]) * 10 ** rng.uniform(-12, -0.5)
    r = float(rng.choice([0.8, 1.0, 3.0, 10.0]))
    start = float(rng.choice([0.0, 0.0, 0.0, rng.uniform(-0.9, 0.9) * r, 1.0 if r > 1 else 0.0]))
    return c.tolist(), float(10 ** rng.uniform(-2, -0.3)), r, start


def asked(drift: sa.Drift, kappa: Any, r: float, start: float, **options: Any) -> Any:
    """log T with its error, or None where it is refused."""
    try:
        return sa.escape_time(
            drift, kappa, r, start=start, method="uniform", order=0, log=True, full=True, **options
        )
    except sa.SymasymError:
        return None


def closed(drift: sa.Drift, kappa: float, r: float) -> bool:
    """Whether the closed forms claim anything; the emitted code has these alone, and no claim."""
    with own_context(40) as context:
        scene = closed_form(drift, Fraction(r), Fraction(0), context)
        return scene is not None and scene.time(2 / context.mpf(kappa) ** 2) is not None


@cache
def emitted() -> Any:
    """The uniform time as Python code, for any polynomial."""
    free = sa.Drift(" + ".join(f"c{k}*u**{k}" for k in range(DEGREES)), "u")
    return sa.emit("eq:Ttilde", "python", drift=free, method="uniform", order=0).load()


def check_uniform(scene: tuple[list[float], float, float, float]) -> None:
    c, kappa, r, start = scene
    drift = sa.polynomial(*c)
    one = asked(drift, kappa, r, start)
    array = asked(drift, np.array([kappa]), r, start)
    many = asked(drift, kappa, r, start, dps=40)
    assert (one is None) == (array is None) == (many is None), scene
    if one is None or array is None or many is None:
        return
    size = max(1.0, abs(one.value))
    assert abs(mpmath.mpf(one.value) - many.value) <= 4e-16 * size, scene
    assert abs(one.error - many.error) <= 1e-6 * one.error + 1e-15 * size, scene
    # On a coalescence float64 may take another barrier for the last one.
    assert abs(array.value[0] - one.value) <= 1e-11 * size + 1e-4 * one.error, scene
    assert abs(array.error[0] - one.error) <= 0.05 * one.error + 1e-11 * size, scene
    if start == 0 and closed(drift, kappa, r):
        code = emitted().log_uniform_time(kappa, r, *c, *[0.0] * (DEGREES - len(c)))
        assert abs(code - array.value[0]) <= 1e-11 * size + 1e-4 * one.error, scene


@pytest.mark.parametrize("start", [0.3, 0.6, 0.9, 0.97, 1.0])
def test_uniform_about_a_barrier(start: float) -> None:
    """Friction with a well at 0.360 and a barrier at 0.932: before the well, between, beyond."""
    check_uniform(([1.3, -4.0, 0.0, 3.0], 0.02, 10.0, start))


@settings(SAMPLE, max_examples=15)
@given(uniform_scenes())
def test_uniform_sample(scene: Any) -> None:
    check_uniform(scene)


@pytest.mark.slow
def test_uniform() -> None:
    settings(SAMPLE, max_examples=1000)(given(uniform_scenes())(check_uniform))()
