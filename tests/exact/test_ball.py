"""Proved balls: against plain quadrature, closed forms, identities and themselves."""

from __future__ import annotations

import random
import sys
import threading
import time
from collections.abc import Callable
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

from symasym.base.errors import AccuracyError, RegionError
from symasym.drift.drift import Drift
from symasym.drift.ready_made import smoothings
from symasym.exact import digits
from symasym.exact.balls import panels as ball_panels
from symasym.exact.balls import sweep as ball_sweep
from symasym.numbers import balls
from symasym.special.exponentials import ball_quotient
from symasym.workshop import reference_quadrature
from tests.workshop.test_reference_quadrature import Formula, constant_drift

flint = pytest.importorskip("flint")


def friction(mu: Any, alpha: Any, z0: Any) -> Any:
    mu, alpha, z0 = F(mu), F(alpha), F(z0)
    return smoothings.polynomial(1 - z0, -alpha * (1 + mu), 0, alpha * mu)


def rational(x: Any) -> F:
    """The exact value of an mpf or of an exact arb."""
    if isinstance(x, flint.arb):
        mantissa, exponent = x.man_exp()
    else:
        sign, mantissa, exponent, _ = x._mpf_
        mantissa = -mantissa if sign else mantissa
    return F(int(mantissa)) * F(2) ** int(exponent)


def assert_meets(enclosure: Any, value: Any, dps: int) -> None:
    """`value`, known to `dps` digits, and the ball agree; the ball is as narrow as it says."""
    middle, radius = (rational(x) for x in balls.to_mpf(enclosure, dps + 10))
    known = rational(value)
    assert radius <= abs(middle) / F(10) ** dps
    assert abs(middle - known) <= radius + abs(known) / F(10) ** dps


SCENES = {
    "crossing, a well": (friction(3, 1, "-0.3"), F(1), F(10), F(0)),
    "crossing, start outside": (friction(3, 1, "-0.3"), F(1, 2), F(5, 2), F(-3, 2)),
    "crossing backwards": (smoothings.linear(-1, -2), F(1), F(3), F(1, 3)),
    "sliding": (smoothings.linear(1, -2), F(1, 2), F(2), F(1, 7)),
    "repelling sliding": (smoothings.linear(-1, 2), F(2, 3), F(3), F(5, 3)),
    "r inside the layer": (friction(3, 1, "-0.3"), F(1, 3), F(4, 5), F(-1, 3)),
    "r = 1": (smoothings.polynomial("1/3", -1, "1/7", 0, 2), F(1), F(1), F(1, 2)),
    "sine": (smoothings.sine(1, 1, 4, waves=2), F(1), F(2), F(-3, 2)),
    "tanh": (smoothings.tanh(1, -1, 5), F(1, 2), F(2), F(1, 5)),
    "hill, start at the corner": (smoothings.hill(-1, "1/2", "1/2", n=4), F(1), F(2), F(1)),
    "a- = 0": (smoothings.polynomial(1, 1), F(1), F(3), F(-2)),
    "no drift": (smoothings.polynomial(0), F(1), F(3), F(3, 2)),
}


@pytest.mark.every(3)
@pytest.mark.parametrize("name", SCENES)
def test_escape_against_quadrature(name: str) -> None:
    drift, kappa, r, start = SCENES[name]
    for verb in ("escape_time", "exit_probability"):
        reference = getattr(reference_quadrature, verb)(drift, kappa, r, start, 22)
        assert_meets(getattr(ball_sweep, verb)(drift, kappa, r, start, 22), reference, 22)


@pytest.mark.every(3)
@pytest.mark.parametrize(
    ("drift", "kappa"),
    [
        (smoothings.linear(1, -2), F(1, 3)),
        (friction(3, 1, "1.2"), F(1)),
        (smoothings.tanh(1, "-1/2", 5), F(1, 2)),
        (smoothings.sine("1/2", -1, 4), F(2)),
    ],
)
def test_stationary_against_quadrature(drift: Any, kappa: F) -> None:
    for complement in (False, True):
        reference = reference_quadrature.occupation(drift, kappa, 22, complement=complement)
        assert_meets(ball_sweep.occupation(drift, kappa, 22, complement=complement), reference, 22)
    for y in (F(-7, 3), F(1, 3), F(1)):
        reference = reference_quadrature.stationary_density(drift, kappa, y, 22)
        assert_meets(ball_sweep.stationary_density(drift, kappa, y, 22), reference, 22)


FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "exp": lambda u, ops: ops.exp(u),
    "log": lambda u, ops: ops.log(u + 3),
    "sqrt": lambda u, ops: ops.sqrt(u + ops.rational(F(3, 2))),
    "sin": lambda u, ops: ops.sin(ops.pi() * u),
    "cos": lambda u, ops: ops.cos(2 * u),
    "tan": lambda u, ops: ops.tan(u),
    "sinh": lambda u, ops: ops.sinh(u),
    "cosh": lambda u, ops: ops.cosh(u),
    "tanh": lambda u, ops: ops.tanh(3 * u),
    "asin": lambda u, ops: ops.asin(u / 2),
    "acos": lambda u, ops: ops.acos(u / 2),
    "atan": lambda u, ops: ops.atan(3 * u),
    "asinh": lambda u, ops: ops.asinh(2 * u),
    "acosh": lambda u, ops: ops.acosh(u + 3),
    "atanh": lambda u, ops: ops.atanh(u / 2),
    "erf": lambda u, ops: ops.erf(2 * u),
    "power": lambda u, ops: ops.power(u + 2, F(-2, 3)),
    "quotient": lambda u, ops: 1 / (1 + 4 * u**2),
    "constants": lambda u, ops: ops.tanh(ops.acosh(ops.pi())) - u / ops.sqrt(ops.pi()),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_function_a_drift_may_contain(name: str) -> None:
    drift, scene = Formula(FUNCTIONS[name]), (F(3, 2), F(2), F(-1, 3), 20)
    assert_meets(
        ball_sweep.escape_time(drift, *scene), reference_quadrature.escape_time(drift, *scene), 20
    )


def test_a_constant_that_ignores_u() -> None:
    drift = Formula(lambda u, ops: ops.sin(ops.rational(F(1, 2))))
    scene = (F(1), F(2), F(0), 20)
    assert_meets(
        ball_sweep.escape_time(drift, *scene), reference_quadrature.escape_time(drift, *scene), 20
    )


@pytest.mark.parametrize(
    "function",
    [
        lambda u, ops: ops.sqrt(u),
        lambda u, ops: ops.log(u + 1) + 3,
        lambda u, ops: 1 / u,
        lambda u, ops: ops.power(u + ops.rational(F(1, 2)), F(1, 3)),
        lambda u, ops: ops.atanh(u),
        lambda u, ops: ops.tan(2 * u),
        lambda u, ops: ops.sqrt(u * u),
    ],
)
def test_what_is_not_analytic_is_refused(function: Callable[[Any, Any], Any]) -> None:
    with pytest.raises(AccuracyError, match="may not be analytic"):
        ball_sweep.escape_time(Formula(function), F(1), F(2), F(0), 15)


@pytest.mark.parametrize(
    ("function", "on_cut"),
    [
        ("log", -1), ("sqrt", -1), ("asin", 2), ("acos", -2), ("atanh", 3),
        ("atan", 2j), ("asinh", -2j), ("acosh", -3), ("acosh", 0.5),
    ],
)  # fmt: skip
def test_balls_across_a_branch_cut_are_not_finite(function: str, on_cut: complex) -> None:
    spread = flint.arb(0, 0.01)
    across = flint.acb(on_cut) + flint.acb(spread, spread)
    assert not getattr(balls.BallOps(), function)(across).is_finite()
    off = across + (1 + 1j) * 0.1
    assert getattr(balls.BallOps(), function)(off).is_finite()
    assert not balls.BallOps().power(flint.acb(-1, spread), F(1, 3)).is_finite()


def test_constant_drift_closed_form() -> None:
    for a, kappa, r, start in [
        (F(1), F(1), F(2), F(0)),
        (F(-3), F(1, 5), F(10), F(-7, 2)),
        (F(1, 10**9), F(1), F(3), F(1, 2)),
        (F(2), F(50), F(1, 100), F(0)),
    ]:
        time_, probability = constant_drift(a, kappa, r, start)
        drift = smoothings.polynomial(a)
        assert_meets(ball_sweep.escape_time(drift, kappa, r, start, 40), time_, 40)
        assert_meets(ball_sweep.exit_probability(drift, kappa, r, start, 40), probability, 40)


def test_digits_where_a_sigmoid_is_nearly_constant() -> None:
    drift, kappa, r = smoothings.tanh(1, "-0.4", 100), F(1, 50), F(4, 5)
    proved = ball_sweep.escape_time(drift, kappa, r, F(0), 55)
    assert_meets(proved, digits.escape_time(drift, kappa, r, F(0), 50), 50)


def test_no_drift_is_brownian_motion() -> None:
    kappa, r, start = F(3, 7), F(5), F(-4, 3)
    drift = smoothings.polynomial(0)
    time_, probability = (r**2 - start**2) / kappa**2, (r - start) / (2 * r)
    # flint rounds a rational to the current precision before it compares.
    with flint.ctx.workprec(400):
        assert ball_sweep.escape_time(drift, kappa, r, start, 50).contains(balls.exact_ball(time_))
        assert ball_sweep.exit_probability(drift, kappa, r, start, 50).contains(
            balls.exact_ball(probability)
        )


@pytest.mark.parametrize("name", SCENES)
def test_mirror_image(name: str) -> None:
    drift, kappa, r, start = SCENES[name]
    mirrored = Formula(lambda u, ops: -drift.evaluate(-u, ops))
    assert ball_sweep.escape_time(drift, kappa, r, start, 25).overlaps(
        ball_sweep.escape_time(mirrored, kappa, r, -start, 25)
    )
    through_right = ball_sweep.exit_probability(mirrored, kappa, r, -start, 25)
    other = ball_sweep.exit_probability(drift, kappa, r, start, 25, complement=True)
    assert other.overlaps(through_right)
    assert (other + ball_sweep.exit_probability(drift, kappa, r, start, 25)).overlaps(flint.arb(1))


@pytest.mark.parametrize("name", SCENES)
def test_precisions_nest_and_polynomials_equal_formulas(name: str) -> None:
    drift, kappa, r, start = SCENES[name]
    low = ball_sweep.escape_time(drift, kappa, r, start, 6)
    middle = ball_sweep.escape_time(Formula(drift.evaluate), kappa, r, start, 27)
    high = ball_sweep.escape_time(drift, kappa, r, start, 60)
    with flint.ctx.workprec(400):
        for other in (low, middle):
            assert other.overlaps(high)
            assert other.contains(high.mid())


def test_density_at_the_corners_gives_the_tails() -> None:
    for drift in (smoothings.linear(1, "-1/3"), smoothings.tanh(1, "-1/3", 4)):
        kappa = F(1, 2)
        rate_minus, rate_plus = flint.arb(8), flint.arb(8) / 3
        tails = ball_sweep.stationary_density(drift, kappa, F(-1), 30) / rate_minus
        tails += ball_sweep.stationary_density(drift, kappa, F(1), 30) / rate_plus
        assert tails.overlaps(ball_sweep.occupation(drift, kappa, 30, complement=True))


def test_escape_time_solves_its_differential_equation() -> None:
    # (kappa^2/2) T'' + phi T' + 1 = 0: fourth differences in step h leave O(h^4).
    drift, kappa, r = SCENES["tanh"][:3]
    x, h = F(1, 5), F(1, 10**8)
    with flint.ctx.workprec(300):
        T = [ball_sweep.escape_time(drift, kappa, r, x + k * h, 70) for k in (-2, -1, 0, 1, 2)]
        step = flint.arb(flint.fmpq(1, 10**8))
        first = (T[0] - 8 * T[1] + 8 * T[3] - T[4]) / (12 * step)
        second = (-T[0] + 16 * T[1] - 30 * T[2] + 16 * T[3] - T[4]) / (12 * step**2)
        A = drift.evaluate(flint.arb(flint.fmpq(1, 5)), balls.BallOps())
        residual = second * flint.arb(flint.fmpq(1, 8)) + A * first + 1
        assert abs(residual) < 1e-25


def panels_of(drift: Any, center: F, half: F, lam: F, terms: int) -> Any:
    profile = balls.profile_of(drift)
    bound = balls.exact_ball(lam * half) * profile.bound(center, ball_panels.RATIO * half)
    return ball_panels.Panel(profile, lam, center, half, bound, terms)


def test_drifts_share_nothing_that_depends_on_their_parameters() -> None:
    drift = Drift("b*exp(u) + u")
    whole, half = F(1), F(1, 2)
    with balls.precision(100):
        one, two = (balls.profile_of(drift.bind(b=b)) for b in (1, 2))
        series = [p.series(whole, half, 6)[0] for p in (one, two)]
        assert (series[1] - series[0]).overlaps(flint.arb(1).exp())
        bounds = [p.bound(whole, half).abs_upper() for p in (one, two)]
        assert bounds[1] > bounds[0] + 3


@pytest.mark.parametrize("moment", ["growth", "plus", "minus", "nested"])
def test_truncation_is_enclosed_when_terms_are_few(moment: str) -> None:
    # Few terms make the ball wide by truncation alone; the value has to stay inside.
    rng = random.Random(moment)
    for _ in range(60):
        drift = rng.choice(
            [friction(3, 1, "-0.3"), smoothings.tanh(1, 2, 5), smoothings.sine(1, -1, 4, waves=2)]
        )
        center, half = F(rng.randint(-9, 9), 10), F(1, rng.randint(30, 200))
        lam = F(rng.randint(1, 60))
        with balls.precision(rng.randint(60, 300)):
            few = getattr(panels_of(drift, center, half, lam, rng.randint(6, 25)), moment)
        with balls.precision(400):
            many = getattr(panels_of(drift, center, half, lam, 250), moment)
            assert few.contains(many.mid())
            assert many.rad() < 1e-30


@pytest.mark.parametrize("drift", [friction(3, 1, "-0.3"), friction("1/3", "-9", 2)])
def test_cauchy_bounds_hold_on_their_circle(drift: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    used: list[float] = []

    def record(panel: Any, bound: Any) -> Any:
        used.append(float(bound.upper()))
        return flint.arb(0, 10 ** len(used))

    monkeypatch.setattr(ball_panels.Panel, "_tail", record)
    center, half, lam = F(1, 3), F(1, 20), F(9)
    with balls.precision(100):
        # Two functions are cut off, and both of what is left out goes into the radius.
        assert panels_of(drift, center, half, lam, 40).nested.rad() > 100 * float(half) ** 2
        assert len(used) == 2
        monkeypatch.setattr(ball_panels.Panel, "_exp_tail", flint.arb(0, 10**6))
        assert panels_of(drift, center, half, lam, 40).nested.rad() > 10**5 * float(half) ** 2

    # The same two on the circle, in floating point.
    c = [float(x) for x in drift.exact_coefficients()]
    primitive = np.polynomial.Polynomial(c).integ() * -float(lam)

    def exponent(t: Any) -> Any:
        return primitive(float(center) + float(half) * t)

    x, w = np.polynomial.legendre.leggauss(60)
    for z in ball_panels.RATIO * np.exp(2j * np.pi * np.arange(48) / 48):
        path = -1 + (z + 1) * (x + 1) / 2
        nested = np.sum(w * np.exp(exponent(path) - exponent(z))) * (z + 1) / 2
        assert abs(nested) <= used[1]
        for sign in (-1, 1):
            assert abs(np.exp(sign * (exponent(z) - exponent(0)))) <= used[0]


@pytest.mark.parametrize("order", [1, 2])
def test_exponential_quotients(order: int) -> None:
    rng = random.Random(order)
    for _ in range(300):
        x = F(rng.choice([-1, 1]) * rng.randint(0, 10**6), 10 ** rng.randint(3, 60))
        with balls.precision(rng.randint(30, 200)):
            found = ball_quotient(balls.exact_ball(x), order)
        with balls.precision(2000):
            X = balls.exact_ball(x)
            exact = flint.arb(1) / order
            if x:
                exact = X.expm1() / X if order == 1 else (X.expm1() - X) / X**2
            assert found.contains(exact.mid())
            assert found.rad() < abs(found) * flint.arb(2) ** -25
    with balls.precision(64):
        around = ball_quotient(flint.arb(0, 0.5), order)
        for x in (-0.5, -0.1, 0.3, 0.5):
            assert around.contains(ball_quotient(flint.arb(x), order).mid())


# -- logarithms ----------------------------------------------------------------------------------


def test_logarithms() -> None:
    drift, kappa, r, start = SCENES["sliding"]
    for verb, arguments in [
        (ball_sweep.escape_time, (drift, kappa, r, start, 30)),
        (ball_sweep.exit_probability, (drift, kappa, r, start, 30)),
        (ball_sweep.occupation, (drift, kappa, 30)),
        (ball_sweep.stationary_density, (drift, kappa, start, 30)),
    ]:
        value, logarithm = verb(*arguments), verb(*arguments, log=True)
        with flint.ctx.workprec(200):
            assert value.log().overlaps(logarithm)
            assert logarithm.rad() <= abs(logarithm) * flint.arb(10) ** -30


def test_logarithm_of_almost_one_keeps_its_digits() -> None:
    drift = smoothings.linear(1, 1)  # C = 1/(1 + e^{200000})
    scene = (drift, F(1, 10), F(1000), F(0), 30)
    logarithm = ball_sweep.exit_probability(*scene, complement=True, log=True)
    with flint.ctx.workprec(200):
        assert logarithm.overlaps(-(flint.arb(-200_000).exp().log1p()))
        assert logarithm.rad() <= abs(logarithm) * flint.arb(10) ** -30


def test_logarithm_zero() -> None:
    logarithm = ball_sweep.escape_time(smoothings.polynomial(0), F(1), F(1), F(0), 20, log=True)
    assert logarithm.contains(0)
    assert logarithm.rad() < 1e-39


def test_values_beyond_float64() -> None:
    logarithm = ball_sweep.escape_time(friction(3, 1, "-0.3"), F(1, 30), F(10), F(0), 20, log=True)
    assert 320 < float(logarithm) < 330


# -- conduct -------------------------------------------------------------------------------------


def test_to_mpf_covers_the_ball() -> None:
    rng = random.Random(7)
    before = mpmath.mp.prec
    for _ in range(200):
        with flint.ctx.workprec(rng.randint(10, 300)):
            x = flint.arb(rng.randint(-(10**40), 10**40)) / rng.randint(1, 10**30)
            x += flint.arb(0, rng.random() * 10.0 ** rng.randint(-40, 5))
            x *= flint.arb(2) ** rng.randint(-5000, 5000)
        dps = rng.randint(1, 60)
        middle, radius = (rational(part) for part in balls.to_mpf(x, dps))
        with flint.ctx.workprec(20_000):
            low, high = rational(x.mid() - x.rad()), rational(x.mid() + x.rad())
        assert middle - radius <= low <= high <= middle + radius
        assert abs(middle - rational(x.mid())) <= abs(middle) / F(10) ** (dps - 1)
    assert mpmath.mp.prec == before
    assert isinstance(balls.to_mpf(flint.arb(1), 5)[0], mpmath.mpf)
    with pytest.raises(AccuracyError, match="not finite"):
        balls.to_mpf(flint.arb.nan(), 5)


def test_flint_context_is_put_back() -> None:
    drift, kappa, r, start = SCENES["tanh"]
    with flint.ctx.workprec(77):
        cap, flint.ctx.cap = flint.ctx.cap, 13
        try:
            ball_sweep.escape_time(drift, kappa, r, start, 20)
            assert (flint.ctx.prec, flint.ctx.cap) == (77, 13)
            with pytest.raises(AccuracyError):
                ball_sweep.escape_time(Formula(lambda u, ops: 1 / u), kappa, r, start, 20)
            assert (flint.ctx.prec, flint.ctx.cap) == (77, 13)
        finally:
            flint.ctx.cap = cap


def test_threads_do_not_spoil_each_other() -> None:
    drift, kappa, r, start = SCENES["crossing, a well"]
    found: dict[int, Any] = {}

    def work(dps: int) -> None:
        found[dps] = ball_sweep.escape_time(drift, kappa, r, start, dps)

    threads = [threading.Thread(target=work, args=(dps,)) for dps in range(10, 70, 10)]
    before, interval = (flint.ctx.prec, flint.ctx.cap), sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    try:
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
    finally:
        sys.setswitchinterval(interval)
    assert (flint.ctx.prec, flint.ctx.cap) == before
    with flint.ctx.workprec(400):
        assert all(found[dps].contains(found[60].mid()) for dps in found)


def test_missing_coefficients_are_noticed() -> None:
    with balls.precision(100):
        panel = panels_of(smoothings.tanh(1, 2, 5), F(0), F(1, 100), F(1), 30)
        _ = panel._exponent
        flint.ctx.cap = 5  # as another thread would
        with pytest.raises(AccuracyError, match=r"flint\.ctx\.cap"):
            _ = panel.plus


@pytest.mark.parametrize("drift", [friction(3, 1, "-0.3"), smoothings.tanh(1, 2, 5)])
@pytest.mark.parametrize("kappa", [F(1, 400), F(1, 1000), F(1, 10**7), F(1, 10**200)])
def test_too_much_work_is_refused_soon(drift: Any, kappa: F) -> None:
    begin = time.process_time()
    with pytest.raises(AccuracyError, match="without a ball"):
        ball_sweep.escape_time(drift, kappa, F(10), F(0), 30)
    # The widest of these are refused before any panel is cut.
    assert time.process_time() - begin < (10 if kappa > F(1, 1000) else 0.5)


def test_refusals() -> None:
    for other in (smoothings.linear(1, 2), smoothings.linear(-1, -1), smoothings.linear(0, -1)):
        with pytest.raises(RegionError, match="no stationary"):
            ball_sweep.occupation(other, F(1), 10)
        with pytest.raises(RegionError, match="no stationary"):
            ball_sweep.stationary_density(other, F(1), F(0), 10)


def test_a_sign_that_needs_more_precision() -> None:
    tiny = F(1, 10**80)
    drift = Formula(lambda u, ops: ops.sin(ops.pi()) + ops.rational(tiny) - (1 + u))
    value = ball_sweep.occupation(drift, F(1), 10)
    assert value.overlaps(ball_sweep.occupation(smoothings.linear(tiny, tiny - 2), F(1), 10))
    assert value.rad() < value * 1e-10
    undecided = Formula(lambda u, ops: ops.sin(ops.pi()) - (1 + u))
    with pytest.raises(AccuracyError, match="no ball"):
        ball_sweep.occupation(undecided, F(1), 10)


def test_without_flint(monkeypatch: pytest.MonkeyPatch) -> None:
    assert balls.available()
    monkeypatch.setitem(sys.modules, "flint", None)
    assert not balls.available()
    with pytest.raises(AccuracyError, match="pip install python-flint"):
        ball_sweep.escape_time(smoothings.linear(1, -2), F(1), F(2), F(0), 10)
