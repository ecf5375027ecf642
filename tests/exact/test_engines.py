"""The parts of the engines by themselves: panels, double-doubles, truncated Taylor series."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from fractions import Fraction as F
from functools import partial, reduce
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.drift.field.float_field import field_of
from symasym.drift.field.taylor_field import ExactField, dyadic, to_fraction
from symasym.exact import float_blocks, float_panels, float_records
from symasym.exact import floats as double
from symasym.exact.digits import swept_scene
from symasym.exact.float_blocks import is_slow
from symasym.exact.float_panels import Moments
from symasym.numbers.trees import MpmathOps


def context(dps: int) -> Any:
    mp = mpmath.MPContext()
    mp.dps = dps
    return mp


# -- float64 panels ------------------------------------------------------------------------------


def printed_moments(mp: Any, primitive: Callable[[Any], Any], h: Any) -> list[Any]:
    """The table of `exact.float_panels` by quadrature, for lam int_0^x phi = primitive(x)."""
    x, w = np.polynomial.legendre.leggauss(60)
    nodes = [h * (mp.mpf(t) + 1) / 2 for t in x]
    end = mp.exp(-primitive(h))
    first = sum(v * mp.exp(-primitive(t)) for t, v in zip(nodes, w, strict=True)) * h / 2
    inverse = sum(v * mp.exp(primitive(t)) for t, v in zip(nodes, w, strict=True)) * h / 2
    double_integral = mp.zero
    for t, v in zip(nodes, w, strict=True):
        inner = sum(
            q * mp.exp(-primitive(t * (mp.mpf(s) + 1) / 2)) for s, q in zip(x, w, strict=True)
        )
        double_integral += v * mp.exp(primitive(t)) * inner * t / 2
    double_integral *= h / 2
    if end > 1:
        return [-primitive(h), first / end, inverse, double_integral]
    return [-primitive(h), first, inverse * end, double_integral * end]


def cut(coefficients: list[float], h: float, count: int) -> tuple[Moments, np.ndarray]:
    """A block with lam phi = sum of coefficients[k] x^k, sampled in `count` equal panels."""
    middle = np.polynomial.Polynomial(coefficients)(np.polynomial.Polynomial([h / 2, h / 2]))
    series = np.pad(middle.coef, (0, len(coefficients) - len(middle.coef)))[:, None] * h
    exponents = float_panels.exponents_of_series(series, count)
    return float_panels.sampled(*exponents, np.array([h]))


def sampled(coefficients: list[float], h: float) -> Moments:
    return cut(coefficients, h, 1)[0]


POLYNOMIALS = [
    ([3.0], 0.5), ([-3.0], 0.5), ([0.0, 1.0], 2.0), ([2.0, -8.0], 0.7), ([0.0], 0.3),
    ([-5.0, 4.0, 30.0], 0.6), ([8.0, 0.0, -3.0, 1.0], 0.9), ([1e-9, 2.0], 1e-3), ([100.0], 0.075),
]  # fmt: skip


@pytest.mark.parametrize(("coefficients", "h"), POLYNOMIALS)
def test_sampled_panels(coefficients: list[float], h: float) -> None:
    mp = context(30)

    def primitive(x: Any) -> Any:
        return sum(c * x ** (k + 1) / (k + 1) for k, c in enumerate(coefficients)) + mp.zero

    wanted = printed_moments(mp, primitive, mp.mpf(h))
    found = sampled(coefficients, h)
    for name, value, exact in zip(found._fields, found, wanted, strict=True):
        # of `nested`, 16 nodes lose a little more at the full reach, where it hardly counts
        allowed = 5e-13 if name == "nested" else 3e-14
        assert float(value[0]) == pytest.approx(float(exact), rel=allowed, abs=1e-300)


def test_the_reach_of_sampled_panels_is_what_it_says() -> None:
    # at the largest exponents that are sampled, 16 nodes still give rounding errors only
    mp = context(30)
    for slope in (float_panels.REACH, -float_panels.REACH, float_panels.REACH / 2):
        wanted = printed_moments(mp, lambda x, s=slope: s * (x - x * x / 4), mp.one)
        for value, exact in zip(sampled([slope, -slope / 2], 1.0), wanted, strict=True):
            assert float(value[0]) == pytest.approx(float(exact), rel=5e-14)


@pytest.mark.parametrize("count", [1, 3, 8])
def test_series_and_values_give_the_same_exponents(count: int) -> None:
    c = np.array([[1.5, -2.0, 0.7, 3.0], [0.1, 0.0, 0.0, -1.0]])
    nodes = (np.arange(count)[:, None] + float_panels.gauss().nodes) / count
    values = np.polynomial.polynomial.polyval(2 * nodes - 1, c.T).transpose(1, 2, 0) / count
    first = float_panels.exponents_of_series(c.T, count)
    for x, y in zip(first, float_panels.exponents_of_values(values), strict=True):
        assert np.allclose(x, y, rtol=1e-14, atol=1e-15)


@pytest.mark.parametrize(("coefficients", "h"), POLYNOMIALS[:7])
@pytest.mark.parametrize("count", [2, 3, 7, 32])
def test_joining_panels_restores_the_whole(coefficients: list[float], h: float, count: int) -> None:
    for whole, joined in zip(sampled(coefficients, h), cut(coefficients, h, count)[0], strict=True):
        assert joined[0] == pytest.approx(whole[0], rel=3e-14, abs=1e-300)


@pytest.mark.parametrize("degree", [1, 2, 4, 8])
def test_truncation_errors_are_claimed(degree: int) -> None:
    # panels of all lengths, from those that are exact to those that are far from it
    random, worst = np.random.default_rng(degree), 0.0
    for reach in random.uniform(4.0, 20.0, 200):
        c = random.normal(size=degree + 1) * random.choice([0.3, 1.0, 2.0]) ** np.arange(degree + 1)
        c *= reach / np.abs(np.polynomial.polynomial.polyval(np.linspace(0, 1, 33), c)).max()
        (found, missed), (exact, _) = cut(list(c), 1.0, 1), cut(list(c), 1.0, 16)
        error = max(abs(x[0] / y[0] - 1) for x, y in zip(found[1:], exact[1:], strict=True))
        if missed[0] < 0.1:
            assert error <= 5e-14 + missed[0]
            worst = max(worst, error)
    assert worst > 1e-9


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("slope", [0.0, 0.4, -0.3])
def test_slow_panels_are_what_sampling_gives(sign: float, slope: float) -> None:
    # lam phi of 550 to 900 over a width of 0.7: slow, and still within float64 where sampled
    size, h = 700.0, 0.7
    coefficients = [sign * size, sign * size * slope, sign * size * 0.1]
    nodes = float_panels.lobatto().nodes * h
    lam_phi = np.polynomial.polynomial.polyval(nodes, coefficients)[None, :]
    found, wanted = float_panels.slow(lam_phi * h, np.array([h])), cut(coefficients, h, 256)[0]
    for value, exact in zip(found, wanted, strict=True):
        assert value[0] == pytest.approx(exact[0], rel=2e-13)


def test_slow_panels_see_the_poles_of_the_drift() -> None:
    # 1/phi is a parabola and seen at any width, but the rise needs phi itself, which has poles
    # at distance 1. At this lam an error of 1e-12 in the rise is as large as the layers.
    rule, lam, accepted = float_panels.lobatto(), np.array([1e12]), []
    for reach in np.geomspace(0.02, 3.0, 40):
        u, h = reach * (2 * rule.nodes - 1), np.array([2 * reach])
        phi = 1 / (1 + u**2)[None, :]
        x = lam * phi * h
        accepted.append(bool(is_slow(x.min(axis=1), x.max(axis=1), x.T)[0]))
        if accepted[-1]:
            rise = float_panels.slow(x, h).rise[0]
            assert rise == pytest.approx(-2 * lam[0] * np.arctan(reach), rel=1e-15)
    assert accepted[0]
    assert not accepted[-1]


def test_a_drift_that_is_constant_but_for_a_high_power() -> None:
    # The slow series has terms of phi'' and higher derivatives that phi' does not tell of.
    mp = mpmath.mp
    with mp.workdps(60):
        quad = partial(mp.quad, method="gauss-legendre", maxdegree=5)
        lam, c = mp.mpf(20_000), mp.mpf(10) ** -6

        def w(u: Any) -> Any:
            """-T' = lam int e^{-lam int_z^u phi} dz; from -r nothing is left of e^{-40000}."""
            return quad(
                lambda s: mp.exp(-s - lam * c * (u**8 - (u - s / lam) ** 8) / 8),
                [0, 10, 30, 60, 140],
            )

        time = quad(w, [0, 1]) + (1 + (w(mp.one) - 1 / (1 + c)) / lam) / (1 + c)
        for dps in (30, 50):
            found = sa.escape_time(sa.Drift("1 + u**7/1000000"), "0.01", 2, dps=dps)
            assert abs(found - time) <= mp.mpf(10) ** -dps * time


def test_terms_of_the_slow_series_are_repeated_derivatives() -> None:
    # lam phi = 1/(a + b x): t_0 = a + b x and t_1 = b t_0, t_2 = b^2 t_0, ...
    a, b, h = 2e-3, 1e-3, 0.8
    nodes = float_panels.lobatto().nodes * h
    terms = float_panels.slow_terms(h / (a + b * nodes)[None, :])
    for k in range(4):
        wanted = b**k * (a + b * nodes) / h
        assert terms[k][0] == pytest.approx(wanted, rel=10.0 ** (3 * k - 13))


@pytest.mark.parametrize("x", [0.0, 1e-300, 1e-12, 0.3, 0.49999, 0.50001, 2.0, 700.0, 1e5, 1e300])
@pytest.mark.parametrize("sign", [1, -1])
def test_panels_of_constant_drift(x: float, sign: int) -> None:
    mp = context(700)
    h = 0.75
    with np.errstate(over="ignore"):
        found = float_panels.constant(np.array([sign * x / h]), np.array([h]))
    size = mp.mpf(x / h * h)
    if x:
        end = mp.exp(-size) if x < 1e6 else mp.zero
        first = (1 - end) / size
        second = (size - 1 + end if sign < 0 else 1 - (1 + size) * end) / size**2
    else:
        first, second = mp.one, mp.one / 2
    assert abs(float(found.rise[0])) == pytest.approx(x, rel=1e-15)
    assert (found.rise[0] > 0) == (sign < 0 and x > 0)
    wanted = (float(h * first), float(h * first), float(h * h * second))
    assert [float(m[0]) for m in found[1:]] == pytest.approx(wanted, rel=2e-15)


@pytest.mark.parametrize("power", range(17))
def test_rules_integrate_and_differentiate_powers(power: int) -> None:
    gauss, lobatto = float_panels.gauss(), float_panels.lobatto()
    for rule in (gauss, lobatto):
        assert rule.weights @ rule.nodes**power == pytest.approx(1 / (power + 1), rel=1e-14)
    if power < float_panels.NODES:
        running = gauss.integrate @ gauss.nodes**power
        assert running == pytest.approx(gauss.nodes ** (power + 1) / (power + 1), abs=2e-15)
    slope = lobatto.differentiate @ lobatto.nodes**power
    wanted = power * lobatto.nodes ** max(power - 1, 0)
    assert slope == pytest.approx(wanted, abs=1e-11)


# -- fields and partitions -------------------------------------------------------------------------

FIELDS = {
    "friction": lambda: sa.friction(3, 1, "-0.3"),
    "polynomial": lambda: sa.polynomial("1/7", 2, 0, -3, "1/2"),
    "tanh": lambda: sa.tanh(1, "-1/2", 4),
    "sine": lambda: sa.sine(1, 2, 3, waves=2),
}


@pytest.mark.parametrize("name", FIELDS)
@pytest.mark.parametrize("mirrored", [False, True])
def test_exact_fields(name: str, mirrored: bool) -> None:
    mp = context(40)
    drift = FIELDS[name]()
    field = ExactField(drift, mirrored, mp)
    sign = -1 if mirrored else 1
    centre, scale = F(2, 7), F(1, 16)
    c = field.taylor(centre, scale, 24)
    for s in (F(-1), F(1, 3), F(1)):
        u = centre + scale * s
        wanted = sign * to_fraction(drift.evaluate(mp.mpf((sign * u).numerator) / u.denominator,
                                                   _Ops(mp)))  # fmt: skip
        summed = sum(x * s**k for k, x in enumerate(c))
        assert abs(summed - wanted) < F(1, 10**17)
        assert abs(field.value(u) - wanted) < F(1, 10**36)
    # the integral is that of the series
    t0, t1 = F(-1, 20), F(1, 30)
    by_series = sum(x / scale**k * (t1 ** (k + 1) - t0 ** (k + 1)) / (k + 1)
                    for k, x in enumerate(c))  # fmt: skip
    assert abs(field.integral(centre, t0, t1, 24) - by_series) < F(1, 10**16)
    # a zero, polished
    for u in field.zeros(F(-1), F(1)):
        assert abs(field.value(u)) < F(1, 10**10) or abs(field.slope(mp.mpf(u.numerator)
            / u.denominator)) < 1e-3 or name == "polynomial"  # fmt: skip


class _Ops:
    def __new__(cls, mp: Any) -> Any:
        from symasym.numbers.trees import MpmathOps

        return MpmathOps(mp)


@pytest.mark.parametrize("kappa", ["1", "0.1", "1e-4", "1e-8"])
@pytest.mark.parametrize("name", FIELDS)
def test_partitions_tile_the_interval(name: str, kappa: str) -> None:
    # the exponents of the panels add up to lam (V(end) - V(start))
    mp = context(30)
    drift, lam = FIELDS[name](), 2 / F(kappa) ** 2
    field = ExactField(drift, False, mp)
    start, end = F(-5, 2), F(7, 3)
    rises = []
    for panel in swept_scene(drift, False, lam, -start, 30, mp).panels(start, end):
        log = mp.log(panel.end)
        rises.append(-log if panel.up else log)
    total = reduce(lambda x, y: x + y, rises)
    a_minus, a_plus = (field.value(F(x)) for x in (-1, 1))
    wide = context(60)
    inner = ExactField(drift, False, wide).potential_rise(wide.mpf(-1), wide.mpf(1))
    outer = a_minus * (start + 1) - a_plus * (end - 1)
    exact = (
        mp.mpf(lam.numerator)
        / lam.denominator
        * (inner + mp.mpf(outer.numerator) / outer.denominator)
    )
    assert abs(total - exact) <= 1e-20 * (abs(exact) + sum(abs(x) for x in rises))


@pytest.mark.parametrize("name", FIELDS)
def test_float_fields(name: str) -> None:
    drift = FIELDS[name]()
    field = field_of(drift, drift.values, 1)
    u = np.array([[-1.0, -0.4, 0.3, 0.9]])
    both = field.phi(np.array([0, 1]), np.concatenate((u, u)))
    assert both[0] == pytest.approx(drift(u[0]), rel=1e-13, abs=1e-14)
    assert both[1] == pytest.approx(-drift(-u[0]), rel=1e-13, abs=1e-14)
    ends = [float(x) for x in drift.ends]
    assert [field.a_minus[0], field.a_plus[0]] == pytest.approx(ends)
    assert [field.a_minus[1], field.a_plus[1]] == pytest.approx([-ends[1], -ends[0]])
    assert (field.size() >= np.abs(both).max(axis=1) * 0.99).all()
    c, radius = field.taylor(np.array([1]), np.array([0.25]))
    assert radius[0] > 0
    t = min(0.01, radius[0])
    summed = sum(x * t**k for k, x in enumerate(c[0]))
    assert summed == pytest.approx(-float(drift(-0.25 - t)), rel=1e-12)
    zeros = field.zeros(np.array([0]))[0]
    for point in drift.critical_points():
        assert np.nanmin(np.abs(zeros - float(point.u))) < 1e-9


def to_mpf(drift: sa.Drift, u: F) -> Any:
    mp = mpmath.MPContext()
    mp.dps = 60
    return drift.evaluate(mp.mpf(u.numerator) / u.denominator, MpmathOps(mp))


@pytest.mark.parametrize("bound", [1, [1, 2]])
def test_outer_drift_of_float_fields_is_right_to_half_an_ulp(bound: Any) -> None:
    drift = sa.Drift("sin(200*u + 639/5)*a - 9/8").bind(a=bound)
    count = 1 if bound == 1 else 2
    field = field_of(drift, drift.values, count)
    for k, a in enumerate(np.atleast_1d(bound)):
        one = sa.Drift("sin(200*u + 639/5)*a - 9/8").bind(a=int(a))
        for side, found, mirrored in (
            (-1, field.a_minus[k], field.a_plus[count + k]),
            (1, field.a_plus[k], field.a_minus[count + k]),
        ):
            exact = to_mpf(one, F(side))
            assert found == -mirrored
            assert abs(found - exact) <= 1.2e-16 * abs(exact)


@pytest.mark.parametrize("shape", ["X*exp(-X**2)", "tanh(X)", "1/(1 + X**2)"])
@pytest.mark.parametrize("width", ["3e-3", "3e-6", "1e-9"])
def test_float_expansions_beside_a_narrow_feature(shape: str, width: str) -> None:
    drift = sa.Drift("2*u - 1/8 + " + shape.replace("X", f"((u - 1/4)/({F(width)}))"))
    field = field_of(drift, drift.values, 1)
    w = float(F(width))
    for centre in (0.25, 0.25 + w, 0.25 - 4 * w):
        c, radius = field.taylor(np.array([0]), np.array([centre]))
        assert radius[0] > 0.01 * w
        for t in (0.0, 0.3 * radius[0], -radius[0]):
            exact = to_mpf(drift, F(centre) + F(t))
            summed = sum(mpmath.mpf(x) * mpmath.mpf(t) ** k for k, x in enumerate(c[0]))
            assert abs(summed - exact) <= 1e-14 * abs(exact) + 1e-15


def test_bisection_gives_up_where_it_does_not_help(monkeypatch: pytest.MonkeyPatch) -> None:
    seen = []

    def hidden(*args: Any) -> np.ndarray:
        seen.append(len(args[1].scene))
        assert sum(seen) < 200_000, "bisection runs away"
        return np.ones(seen[-1], dtype=bool)

    monkeypatch.setattr(float_blocks, "hidden", hidden)
    drift = sa.Drift("tanh(2*u)")
    field = field_of(drift, drift.values, 1)
    one = np.ones(1)
    with np.errstate(invalid="ignore"):
        assert np.isinf(double.escape_time(field, 2 * one, one, 0 * one).error).all()
        assert np.isinf(double.occupation(field, 2 * one, False).error).all()


@pytest.mark.parametrize("kappa", [0.05, 0.03])
def test_blocks_that_do_not_count_are_claimed(
    kappa: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    drift, counting, left_out = sa.friction(3, 1, "-0.4"), float_records.counting, []
    exact = sa.escape_time(drift, kappa, 10, log=True, dps=25)

    def seen(*args: Any) -> np.ndarray:
        counts = counting(*args)
        left_out.append(np.count_nonzero(~counts))
        return counts

    def log_time() -> tuple[float, float]:
        lam, r = np.array([2 / kappa**2]), np.array([10.0])
        logs = double.escape_time(field_of(drift, drift.values, 1), lam, r, 0 * r)
        return float(logs.value[0]), float(logs.error[0])

    monkeypatch.setattr(float_records, "counting", seen)
    value, error = log_time()
    assert abs(value - exact) <= error < 1e-12 * abs(value)
    assert left_out[0] > 3
    # Even if the choice were wrong, the error would say so.
    monkeypatch.setattr(float_records, "counting", lambda blocks, plan, ahead: plan.turns)
    value, error = log_time()
    assert 1e-4 < abs(value - exact) <= error


def test_dyadic_numbers_are_short_and_near() -> None:
    for x in (F(1, 3), F(-22, 7), F(10**30 + 1, 10**30)):
        near = dyadic(x, 20)
        assert abs(near - x) <= F(1, 2**20)
        assert near.denominator <= 2**20


@pytest.mark.parametrize("rows", [1, 399, 400, 800, 1500, 2048, 9000])
@pytest.mark.parametrize("shape", [(17, 3), (17,)])
def test_products_in_pieces_are_products(rows: int, shape: tuple[int, ...]) -> None:
    random = np.random.default_rng(rows)
    x, matrix = random.normal(size=(rows, 17)), random.normal(size=shape)
    wanted = np.einsum("ij,j...->i...", x, matrix)
    assert np.allclose(float_panels.product(x, matrix), wanted, rtol=1e-13, atol=1e-13)
    if len(shape) > 1:
        found = float_panels.by_columns(matrix.T, x.T)
        assert np.allclose(found, wanted.T, rtol=1e-13, atol=1e-13)


def test_arrays_leave_other_cores_alone() -> None:
    # Threads of BLAS spin beside work that is too small for them.
    code = (
        "import time, numpy as np, symasym as sa\n"
        "drift = sa.friction(mu=3, alpha=1, z0=np.linspace(-2, 0, 2000, endpoint=False))\n"
        "ask = lambda: sa.escape_time(drift, 0.05, 10, log=True)\n"
        "ask()\n"
        "whole, own = time.process_time(), time.thread_time()\n"
        "ask()\n"
        "print(time.process_time() - whole, time.thread_time() - own)"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(sa.__file__).parent.parent)}
    env.pop("OPENBLAS_NUM_THREADS", None)
    python = [sys.executable, "-c", code]
    done = subprocess.run(python, capture_output=True, text=True, check=True, env=env)
    whole, own = map(float, done.stdout.split())
    assert whole < 1.2 * own
