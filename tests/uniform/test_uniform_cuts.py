"""A start, a kink or an end beside a well or barrier: constants, orders, honesty, no steps."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import symasym as sa
from symasym.asymptotics.uniform.truncated_gaussian import Truncation, corrections
from tests.problems import relative
from tests.strategies import ALL, SAMPLE, powers_of_ten, rationals
from tests.uniform.test_uniform_noise import off

QUARTER, HALF, ONE = Fraction(-1, 4), Fraction(1, 2), Fraction(1)


def with_zeros(lead: Any, *zeros: Any) -> sa.Drift:
    coefficients = [Fraction(lead)]
    for zero in zeros:
        shifted = [Fraction(0), *coefficients]
        coefficients = [
            a - Fraction(zero) * b
            for a, b in zip(shifted, [*coefficients, Fraction(0)], strict=True)
        ]
    return sa.polynomial(*coefficients)


#: A well at -1/4 and a barrier at 1/2.
DRIFT = with_zeros(-2, QUARTER, HALF, Fraction(3, 2))


# -- the functions ---------------------------------------------------------------------------------


@pytest.mark.parametrize("barrier", [True, False])
@pytest.mark.parametrize("t", ["-0.7", "4"])
def test_corrections_against_quadrature(barrier: bool, t: str) -> None:
    """A parabola V = -+s²/2 up to t: everything is an integral of Gaussians."""
    ctx = mpmath.mp.clone()
    ctx.dps = 30
    lam, end = ctx.mpf(9), ctx.mpf(t)
    sign = 1 if barrier else -1
    # phi = ±s, and du = ds: a_0 = 1 is all there is.
    one = [ctx.one, ctx.zero]
    truncation = Truncation(
        barrier, ctx.zero, -sign * end**2 / 2, ctx.zero, end, one, one, ctx.one, [0, 0], 30, {}
    )
    found = corrections(truncation, None, lam, 1, ctx)

    def grown(s: Any, power: int) -> Any:
        """int_0^s e^{power lam v²/2} dv."""
        return ctx.quad(lambda v: ctx.exp(power * lam * v * v / 2), [0, s])

    half = ctx.sqrt(ctx.pi / (2 * lam))
    side = 1 if end > 0 else -1
    gauss, steep = side * half - grown(end, -1), grown(end, 1)
    up, down = ctx.exp(-lam * end**2 / 2), ctx.exp(lam * end**2 / 2)
    odd = [ctx.fac2(2 * m - 1) / (lam ** (m + 1) * end ** (2 * m + 1)) for m in range(2)]
    tail, slow = gauss - up * (odd[0] - odd[1]), steep - down * (odd[0] + odd[1])
    # Of a well e^{-lam V} is the Gaussian; primitives have the other sign.
    expected = (tail, slow) if barrier else (-slow, -tail)
    assert abs(found.scale - expected[0]) < 1e-20 * (1 + abs(steep))
    assert abs(found.speed - expected[1]) < 1e-20 * (1 + abs(steep))

    def outer(s: Any) -> Any:
        if barrier:
            return ctx.quad(lambda v: ctx.exp(lam * (v - s) * (v + s) / 2), [0, s])
        return -ctx.quad(lambda v: ctx.exp(-lam * v * (2 * s + v) / 2), [0, 1, 4, ctx.inf])

    # What the area gains over its series is lost again far from the zero.
    ctx.dps = 15
    far, size = ctx.mpf(8), abs(end)
    area = ctx.quad(outer, [size, (size + far) / 2, far])
    change = (far**-2 - size**-2) / (2 * lam)
    series = sign * (ctx.log(far / size) - sign * change) / lam
    assert abs(found.regular - (series - area)) < 1e-6


# -- a start ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("alone", [False, True])
def test_a_start_beside_a_barrier(order: int, alone: bool) -> None:
    """By its distance in widths of the barrier; the worst errors fall as they should.

    Where the barrier is alone T is a logarithm, all of it from the regular part.
    """
    drift = with_zeros(Fraction(1, 2), HALF, -3) if alone else DRIFT
    worst = []
    for kappa in (Fraction(1, 25), Fraction(1, 50)):
        errors = []
        for widths in (-3, Fraction(1, 2), 4):
            start = HALF + widths * kappa
            error, claim = off(drift, kappa, 3, start=start, method="uniform", order=order)
            assert error <= claim <= 20 * error + 1e-8 * 10.0 ** (-2 * order)
            errors.append(error)
        worst.append(max(errors))
    assert worst[0] <= [0.3, 3, 30][order] * 0.04 ** (2 * order + 2)
    assert np.log2(float(worst[0] / worst[1])) >= 2 * (order + 1) * 0.95


@pytest.mark.parametrize("zero", [QUARTER, HALF])
@pytest.mark.parametrize("beside", ["1e-30", "-1e-30"])
def test_on_a_zero_and_beside_it(zero: Fraction, beside: str) -> None:
    """The same digits: the formula is analytic there."""
    options: dict[str, Any] = {"method": "uniform", "order": 1, "dps": 20}
    there = sa.escape_time(DRIFT, "0.1", 3, start=zero, **options)
    found = sa.escape_time(DRIFT, "0.1", 3, start=zero + Fraction(beside), **options)
    assert relative(found, there) < 1e-19
    exact = sa.escape_time(DRIFT, "0.1", 3, start=zero, dps=20)
    assert relative(there, exact) < 3e-5


@pytest.mark.parametrize("zero", [QUARTER, HALF])
@pytest.mark.parametrize("order", [0, 1])
def test_no_step_as_the_start_passes(zero: Fraction, order: int) -> None:
    h = Fraction(1, 10**6)
    options: dict[str, Any] = {"method": "uniform", "order": order, "dps": 30, "log": True}
    values = [sa.escape_time(DRIFT, "0.25", 3, start=zero + k * h, **options) for k in range(-3, 4)]
    with mpmath.workdps(40):
        second = [a - 2 * b + c for a, b, c in zip(values, values[1:], values[2:], strict=False)]
        # A step of the value or of the slope would be in one or two of these alone.
        bends = [abs(b / a - 1) for a, b in zip(second, second[1:], strict=False)]
    assert max(bends) < 1e-4


def test_start_downwards_is_the_mirror_image() -> None:
    down = with_zeros(-2, -QUARTER, -HALF, Fraction(-3, 2))
    options: dict[str, Any] = {"method": "uniform", "dps": 20}
    up = sa.escape_time(DRIFT, "0.1", 3, start="0.48", **options)
    assert relative(sa.escape_time(down, "0.1", 3, start="-0.48", **options), up) < 1e-18


def test_start_barrier_and_kink_at_once() -> None:
    """Both truncations are exact in the same Gaussian."""
    drift = sa.friction(3, 1, "-1/100")
    for start in ("0.98", "0.999", "1.01"):
        error, claim = off(drift, "0.1", 10, start=start, method="uniform", order=1)
        assert error <= claim < 1e-5


def test_a_start_beside_the_barrier_of_an_analytic_drift() -> None:
    drift = sa.Drift("sin(2*u) + 1/5")
    error, claim = off(drift, "0.1", 3, dps=9, start="-0.1", method="uniform", order=0)
    assert error <= claim < 1e-2


@pytest.mark.parametrize("method", ["uniform", "local"])
@pytest.mark.parametrize("start", [Fraction(1, 10**60) - 2, 2 - Fraction(1, 10**60)])
def test_a_start_all_but_at_the_end(method: str, start: Fraction) -> None:
    """T is as small as the way is, its terms are not."""
    drift = sa.polynomial(1, -2)
    found = sa.escape_time(drift, "0.05", 2, start=start, method=method, dps=15, full=True)
    exact = sa.escape_time(drift, "0.05", 2, start=start, dps=30)
    assert abs(found.value - exact) <= found.error < 1e-14 * exact


# -- a well before the end -------------------------------------------------------------------------


@pytest.mark.parametrize("gap", ["1/10", "1/10000"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_a_well_before_the_end(gap: str, order: int) -> None:
    """u1 meets -1 from inside; the start in the well, between, and beyond the barrier."""
    drift = with_zeros(-2, Fraction(gap) - 1, Fraction(1, 5), Fraction(3, 2))
    for start in (Fraction(gap) - 1, Fraction(-1, 2), Fraction(1, 3)):
        error, claim = off(drift, "0.1", 3, start=start, method="uniform", order=order)
        assert error <= claim
        assert error < [1e-2, 1e-3, 1e-4][order]


@pytest.mark.parametrize("well", ["0.8", "0.97", "-0.999"])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_occupation_with_a_well_before_the_end(well: str, order: int) -> None:
    drift = with_zeros(Fraction(-1, 3), well, -6)
    for complement in (False, True):
        exact = sa.occupation(drift, "0.1", complement=complement, dps=25)
        options: dict[str, Any] = {"complement": complement, "order": order, "full": True}
        found = sa.occupation(drift, "0.1", method="uniform", dps=20, **options)
        assert abs(found.value - exact) <= found.error
        assert relative(found.value, exact) < [2e-4, 1e-7, 3e-10][order]


# -- honesty ---------------------------------------------------------------------------------------

scenes = st.tuples(
    st.lists(rationals(-1.2, 1.2), min_size=2, max_size=4, unique=True),
    st.sampled_from([-3, -1, 1, 2]),
    st.integers(0, 3),
    rationals(-5, 5),
    st.sampled_from([0, 0, 0, -3, -12, -30]),
    powers_of_ten(-2, -0.3),
    st.sampled_from([Fraction(3, 4), Fraction(3, 2), Fraction(10)]),
)


def check_random(scene: Any, order: int) -> None:
    """A start within five widths of a zero, or much less."""
    zeros, lead, which, widths, power, kappa, r = scene
    zero = zeros[which % len(zeros)]
    slope = abs(lead * np.prod([float(zero - z) for z in zeros if z != zero]))
    width = Fraction(float(kappa / np.sqrt(2 * slope)))
    start = zero + widths * width * Fraction(10) ** power
    if abs(start) >= r:
        return
    drift = with_zeros(lead, *zeros)
    try:
        error, claim = off(drift, kappa, r, dps=16, order=order, start=start, method="uniform")
    except sa.SymasymError:
        return
    assert error <= claim * 1.001 + 1e-16


@settings(SAMPLE, max_examples=15)
@given(scenes, st.integers(0, 2))
def test_random_starts_sample(scene: Any, order: int) -> None:
    check_random(scene, order)


@pytest.mark.slow
def test_random_starts() -> None:
    ALL(given(scenes, st.integers(0, 4))(check_random))()
