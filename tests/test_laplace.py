"""Laplace expansions: against published series, other people's code, and their own claims."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

import symasym as sa
from symasym.asymptotics import laplace, laplace_errors
from symasym.asymptotics.coefficients import (
    laplace_coefficients,
    moment_coefficients,
    perron_coefficients,
)
from symasym.context import own_context
from tests.integrals import DIGITS, INTEGRALS, Integral

x = sympy.Symbol("x")
NAMED = {scene.name: scene for scene in INTEGRALS}
scenes = pytest.mark.parametrize("scene", INTEGRALS, ids=lambda scene: scene.name)


@cache
def expansion(name: str, order: Any) -> Any:
    scene = NAMED[name]
    return sa.laplace_integral(scene.f, scene.g, x, scene.a, scene.b, order)


@cache
def truth(name: str, lam: int) -> Any:
    with mp.workdps(DIGITS):
        return NAMED[name].reference(mpf(lam))


def scaled(result: Any, found: Any, lam: int) -> tuple[Any, Any]:
    """Value and error over e^(lam top)."""
    with mp.workdps(DIGITS):
        height = result.height
        height = sympy.N(height, DIGITS) if isinstance(height, sympy.Basic) else height
        scale = mp.exp(-lam * mpf(str(height)))
        return found.value * scale, found.error * scale


# -- honesty and accuracy ------------------------------------------------------------------------


@scenes
@pytest.mark.parametrize("order", [1, 2, 5, "optimal"])
def test_error_is_never_below_the_true_one(scene: Integral, order: Any) -> None:
    result = expansion(scene.name, order)
    for lam in (3, 10, 40, 200):
        found = result.evaluate(lam, dps=25, full=True)
        value, error = scaled(result, found, lam)
        with mp.workdps(DIGITS):
            assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -15), (lam, found)


@scenes
def test_error_is_small_and_of_the_kind_the_table_says(scene: Integral) -> None:
    result = expansion(scene.name, 5)
    found = result.evaluate(2000, dps=25, full=True)
    value, error = scaled(result, found, 2000)
    assert found.error_kind == scene.kind
    assert error < 1e-4 * abs(value)
    assert abs(value - truth(scene.name, 2000)) <= error * (1 + 1e-15)


@scenes
def test_bound_statement_holds(scene: Integral) -> None:
    result = expansion(scene.name, 2)
    if scene.kind != "bound":
        assert result.bound is None
        return
    constant, sigma, start = result.bound
    for factor in (1, 3, 10):
        lam = math.ceil(start) * factor
        if lam > 3000:
            break
        value, _ = scaled(result, result.evaluate(lam, dps=25, full=True), lam)
        assert abs(value - truth(scene.name, lam)) <= constant * mpf(lam) ** -sigma


SLOPED = ["Stirling", "Bessel I", "Bessel K", "Struve", "Kummer U", "incomplete gamma", "erfc",
          "beta, algebraic decay", "beta, symmetric", "Legendre", "quartic", "sextic",
          "cubic end", "kink and smooth", "unequal kink", "two unequal", "no closed form",
          "zero of g", "branch point inside", "two powers", "removable"]  # fmt: skip


@pytest.mark.parametrize("name", SLOPED)
@pytest.mark.parametrize("order", [1, 3])
def test_order_is_measured(name: str, order: int) -> None:
    result = expansion(name, order)
    lams, errors = (1000, 2000), []
    for lam in lams:
        found = result.evaluate(lam, dps=25, full=True)
        with mp.workdps(DIGITS):
            errors.append(abs(scaled(result, found, lam)[0] - truth(name, lam)))
    slope = -math.log(errors[1] / errors[0]) / math.log(2)
    # A coefficient that is zero lets the next one show: never a smaller slope, at most 3 steps.
    steps = [float(result.omitted) + k * gap for gap in _gaps(result) for k in range(4)]
    assert min(abs(slope - step) for step in steps) < 0.06, (slope, steps)
    assert slope > float(result.omitted) - 0.06


def _gaps(result: Any) -> set[float]:
    return {(2 if c.side == "both" else 1) / c.contact for c in result.contributions}


@settings(max_examples=60)
@given(
    scene=st.sampled_from(INTEGRALS),
    order=st.integers(1, 9),
    lam=st.sampled_from([2, 7, 15, 60, 500]),
    dps=st.integers(3, 28),
)
def test_printed_digits_hold_at_any_order_and_precision(
    scene: Integral, order: int, lam: int, dps: int
) -> None:
    result = expansion(scene.name, order)
    found = result.evaluate(lam, dps=dps, full=True)
    value, error = scaled(result, found, lam)
    with mp.workdps(DIGITS):
        assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -12)


@settings(max_examples=25)
@given(
    mu=st.integers(1, 5),
    beta=st.fractions(min_value=Fraction(1, 5), max_value=4, max_denominator=6),
    c=st.fractions(min_value=Fraction(-1, 2), max_value=1, max_denominator=5),
    lam=st.sampled_from([8, 50, 400]),
    order=st.integers(1, 6),
)
def test_random_endpoint(mu: int, beta: Fraction, c: Fraction, lam: int, order: int) -> None:
    """Integral over (0, 1) of x^(beta - 1) e^(c x) e^(-lam x^mu), as a series in c."""
    g = x ** (sympy.Rational(beta) - 1) * sympy.exp(sympy.Rational(c) * x)
    result = sa.laplace_integral(-(x**mu), g, x, 0, 1, order)
    found = result.evaluate(lam, dps=20, full=True)
    with mp.workdps(40):
        exact = mpf(0)
        for k in range(60):
            s = (mpf(beta.numerator) / beta.denominator + k) / mu
            part = mp.gammainc(s, 0, lam) / (mu * mpf(lam) ** s)
            exact += (mpf(c.numerator) / c.denominator) ** k / mp.factorial(k) * part
        assert abs(found.value - exact) <= found.error * (1 + mpf(10) ** -12)


# -- published series ----------------------------------------------------------------------------


def test_stirling_to_twenty_terms() -> None:
    """DLMF 5.11.3 from 5.11.1: the exponential of the series of Bernoulli numbers."""
    logs = [Fraction(0)] * 20
    for k in range(1, 11):
        bernoulli = sympy.bernoulli(2 * k)
        logs[2 * k - 1] = Fraction(int(bernoulli.p), int(bernoulli.q)) / (2 * k * (2 * k - 1))
    series = [Fraction(1)]
    for n in range(1, 20):
        series.append(sum(j * logs[j] * series[n - j] for j in range(1, n + 1)) / n)
    found = sa.laplace_integral("log(x) - x", 1, x, 0, "oo", 20, check=True)
    got = [c / sympy.sqrt(2 * sympy.pi) for c in found.contributions[0].coefficients]
    assert [sympy.nsimplify(c) for c in got] == [sympy.Rational(c) for c in series]
    assert series[:4] == [1, Fraction(1, 12), Fraction(1, 288), Fraction(-139, 51840)]


def _ratios(result: Any) -> list[Any]:
    (only,) = result.contributions
    return [sympy.simplify(sympy.gammasimp(c / only.coefficients[0])) for c in only.coefficients]


def _hankel(nu: Any, k: int) -> Any:
    """a_k(nu) of DLMF 10.17.1."""
    product = sympy.prod([4 * nu**2 - (2 * j - 1) ** 2 for j in range(1, k + 1)])
    return product / (sympy.factorial(k) * 8**k)


nu = sympy.Symbol("nu", positive=True)


@pytest.mark.parametrize(
    ("f", "g", "a", "b", "term"),
    [
        # DLMF 10.40.1 and 10.40.2
        (sympy.cos(x), sympy.cos(nu * x), 0, sympy.pi, lambda k: (-1) ** k * _hankel(nu, k)),
        (-sympy.cosh(x), sympy.cosh(nu * x), "-oo", "oo", lambda k: _hankel(nu, k)),
        # DLMF 13.7.3 with a = nu, b = 1/3
        (
            -x,
            x ** (nu - 1) * (1 + x) ** (sympy.Rational(1, 3) - nu - 1),
            0,
            "oo",
            lambda k: (-1) ** k * sympy.rf(nu, k) * sympy.rf(nu + sympy.Rational(2, 3), k)
            / sympy.factorial(k),
        ),
        # DLMF 8.11.2 with a = nu
        (-x, (1 + x) ** (nu - 1), 0, "oo", lambda k: (-1) ** k * sympy.rf(1 - nu, k)),
    ],
    ids=["10.40.1", "10.40.2", "13.7.3", "8.11.2"],
)  # fmt: skip
def test_dlmf_with_a_free_parameter(f: Any, g: Any, a: Any, b: Any, term: Any) -> None:
    result = sa.laplace_integral(f, g, x, a, b, 8, check=True)
    # At an end with contact 2 every second coefficient is zero.
    found = [r for k, r in enumerate(_ratios(result)) if r != 0 or term(k) == 0]
    if f == sympy.cos(x):
        assert _ratios(result)[1::2] == [0] * 4
    for k, ratio in enumerate(found):
        assert sympy.expand(sympy.expand_func(ratio - term(k))) == 0, k
    assert len(found) >= 4


def test_struve_dlmf_11_6_1() -> None:
    result = sa.laplace_integral(-x, (1 + x**2) ** (nu - sympy.Rational(1, 2)), x, 0, "oo", 9)
    (only,) = result.contributions
    half = sympy.Rational(1, 2)
    for k, c in enumerate(only.coefficients[::2]):
        # Gamma(k + 1/2) 4^k / Gamma(nu + 1/2 - k), relative to k = 0
        wanted = sympy.rf(half, k) * 4**k * sympy.ff(nu - half, k)
        assert sympy.expand(c - wanted) == 0
    assert set(only.coefficients[1::2]) == {0}


def test_first_correction_of_bender_and_orszag() -> None:
    """Advanced Mathematical Methods, 6.4.35, from derivatives."""
    f2, f3, f4, g0, g1, g2 = (Fraction(n, d) for n, d in
                              ((-7, 3), (2, 5), (11, 4), (3, 2), (-5, 7), (13, 9)))  # fmt: skip
    f = [0, 0, f2 / 2, f3 / 6, f4 / 24]
    wanted = (-g2 / (2 * f2) + g0 * f4 / (8 * f2**2) + g1 * f3 / (2 * f2**2)
              - 5 * g0 * f3**2 / (24 * f2**3))  # fmt: skip
    d = perron_coefficients(f, [g0, g1, g2 / 2], 2, step=2)
    # Gamma(3/2)/Gamma(1/2) = 1/2, and 1/a = -2/f2.
    assert d[1] * Fraction(1, 2) * (-2 / f2) == wanted


def test_symbolic_order_eight_has_every_partition() -> None:
    """General f and g to order 8, against numbers put in before."""
    names = sympy.symbols("p3:8")
    f = -(x**2) / 2 + sum(c * x**k for k, c in enumerate(names, start=3))
    result = sa.laplace_integral(
        f.subs({names[4]: 0, names[3]: 0}), sympy.exp(x / 2), x,
        -sympy.Rational(1, 1000), sympy.Rational(1, 1000), 8, maxima=[0],
    )  # fmt: skip
    bound = dict(zip(names, map(sympy.Rational, ("1/3", "-2/7", "1/5", "0", "0")), strict=True))
    numbers = [c.xreplace(bound) for c in result.contributions[0].coefficients]
    series = [0, 0, Fraction(-1, 2), Fraction(1, 3), Fraction(-2, 7), Fraction(1, 5)] + [0] * 13
    g = [Fraction(1, 2**k * math.factorial(k)) for k in range(17)]
    d = moment_coefficients(series, g, 2, step=2)
    for k, c in enumerate(numbers):
        factor = sympy.gamma(k + sympy.Rational(1, 2)) * 2 ** (k + sympy.Rational(1, 2))
        assert sympy.simplify(c / factor) == sympy.Rational(d[k])


# -- the coefficients' own function ----------------------------------------------------------------

rationals = st.fractions(min_value=-3, max_value=3, max_denominator=20)


@given(
    contact=st.integers(1, 6),
    steep=st.fractions(min_value=Fraction(1, 9), max_value=4, max_denominator=9),
    tail=st.lists(rationals, min_size=1, max_size=12),
    g=st.lists(rationals, min_size=1, max_size=13),
    beta=st.fractions(min_value=Fraction(1, 9), max_value=5, max_denominator=9),
    step=st.integers(1, 2),
    start=st.integers(0, 1),
)
def test_both_ways_agree_exactly(
    contact: int, steep: Fraction, tail: Any, g: Any, beta: Fraction, step: int, start: int
) -> None:
    f = [Fraction(0)] * contact + [-steep, *tail]
    first = perron_coefficients(f, g, contact, beta, step=step, start=start)
    second = moment_coefficients(f, g, contact, beta, step=step, start=start)
    assert first == second
    assert len(first) == len(range(start, min(len(tail) + 1, len(g)), step))


def test_both_ways_agree_to_order_64() -> None:
    f = [Fraction(0)] * 2 + [Fraction((-1) ** (k + 1), k) for k in range(2, 131)]
    g = [Fraction(1, k + 1) for k in range(129)]
    assert perron_coefficients(f, g, 2, step=2) == moment_coefficients(f, g, 2, step=2)


def test_check_option_finds_a_wrong_coefficient(monkeypatch: pytest.MonkeyPatch) -> None:
    from symasym.asymptotics import local_expansion

    def wrong(*args: Any, **kwargs: Any) -> Any:
        right = perron_coefficients(*args, **kwargs)
        return [*right[:-1], right[-1] * sympy.QQ(1001, 1000)]

    monkeypatch.setattr(local_expansion, "perron_coefficients", wrong)
    sa.laplace_integral("log(x) - x", 1, x, 0, "oo", 4)
    with pytest.raises(sa.AccuracyError, match="disagree at coefficient 3"):
        sa.laplace_integral("log(x) - x", 1, x, 0, "oo", 4, check=True)


def test_scenes_in_float64_are_the_exact_ones() -> None:
    rng = np.random.default_rng(5)
    f = rng.uniform(-1, 1, (11, 7))
    f[2] = -rng.uniform(0.5, 2, 7)
    g = rng.uniform(-1, 1, (9, 7))
    found = laplace_coefficients(f, g, 2, sides=2)
    assert found.shape == (5, 7)
    for scene in range(7):
        f_exact = [Fraction(v) for v in f[:, scene]]
        exact = laplace_coefficients(f_exact, list(g[:, scene]), 2, sides=2, dps=30)
        assert [float(c) for c in exact] == pytest.approx(list(found[:, scene]), rel=1e-12)


def test_two_sides_are_the_sum_of_one_and_its_mirror_image() -> None:
    f = [0, 0, 0, 0, -1.5, 0.3, 0.7, -0.2, 0.1]
    g = [1.0, 2.0, -0.5, 0.25, 0.125]
    right = laplace_coefficients(f, g, 4, sides=1)
    mirror = [c * (-1) ** k for k, c in enumerate(f)], [c * (-1) ** k for k, c in enumerate(g)]
    left = laplace_coefficients(*mirror, 4, sides=1)
    both = laplace_coefficients(f, g, 4, sides=2)
    assert (right + left)[::2] == pytest.approx(both, rel=1e-14)
    assert (right + left)[1::2] == pytest.approx([0, 0], abs=1e-15)


def test_mpf_keeps_its_own_precision() -> None:
    with own_context(40) as context:
        f = [context.mpf(0)] * 2 + [context.mpf((-1) ** (k + 1)) / k for k in range(2, 8)]
        found = laplace_coefficients(f, [1, 0, 0, 0, 0, 0], 2, sides=2)
    with mp.workdps(40):
        assert abs(found[2] - mp.sqrt(2 * mp.pi) / 288) < mpf(10) ** -38


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (([0, 0, -1], [], 2), "needs at least"),
        (([0, 0], [1], 2), "needs at least"),
        (([0, 0, 1.0], [1], 2), "negative"),
        (([0, 0, Fraction(1)], [1], 0), "whole number"),
        (([0, 0, -1.0], [1], 2, 0), "greater than 0"),
        (([0, 0, -1.0], [1], 2, "x"), "not a number"),
    ],
)
def test_bad_coefficients(arguments: Any, says: str) -> None:
    with pytest.raises(sa.InputError, match=says):
        laplace_coefficients(*arguments)


def test_bad_sides() -> None:
    with pytest.raises(sa.InputError, match="odd"):
        laplace_coefficients([0, -1.0, 0], [1, 0], 1, sides=2)
    with pytest.raises(sa.InputError, match="sides is 3"):
        laplace_coefficients([0, -1.0, 0], [1, 0], 1, sides=3)


# -- maxima --------------------------------------------------------------------------------------


def test_unequal_maxima_are_dropped_or_kept() -> None:
    f, g = "-x**2*(x - 2)**2 + x/10", "1"
    plain = sa.laplace_integral(f, g, x, -1, 3, 3)
    kept = sa.laplace_integral(f, g, x, -1, 3, 3, keep=True)
    assert len(plain.contributions) == 1
    assert len(kept.contributions) == 2
    assert len(plain.dropped) == 1
    assert "e^(-0.19998" in plain.dropped[0]
    assert kept.dropped == ()
    exact = truth("two unequal", 40)
    errors = [
        abs(scaled(r, r.evaluate(40, dps=25, full=True), 40)[0] - exact) for r in (plain, kept)
    ]
    assert errors[1] < errors[0] / 10
    for result in (plain, kept):
        for lam in (10, 40, 200):
            value, error = scaled(result, result.evaluate(lam, dps=25, full=True), lam)
            assert abs(value - truth("two unequal", lam)) <= error


@pytest.mark.parametrize(
    ("f", "a", "b", "points"),
    [
        ("-(x - 1/3)**2", 0, 1, ["1/3"]),
        ("cos(x)", -1, 20, ["0", "2*pi", "4*pi", "6*pi"]),
        ("-(x**2 - 2)**2", "-oo", "oo", ["-sqrt(2)", "sqrt(2)"]),
        ("log(x)/x", 1, 100, ["E"]),
        ("x", 0, 2, ["2"]),
        ("-exp(x) + 3*x", "-oo", "oo", ["log(3)"]),
        ("-Abs(x - 1/7)", -1, 1, ["1/7"]),
        ("-Max(x, -2*x)", -1, 1, ["0"]),
    ],
)
def test_maxima_are_found_in_closed_form(f: str, a: Any, b: Any, points: list[str]) -> None:
    result = sa.laplace_integral(f, 1, x, a, b, 1)
    found = {c.point for c in result.contributions}
    wanted = {sympy.sympify(point, rational=True) for point in points}
    if f == "log(x)/x":
        (only,) = found
        assert abs(mpf(only) - mpmath.e) < 1e-14
        return
    assert found == wanted


def test_a_maximum_without_closed_form_has_all_its_digits() -> None:
    result = sa.laplace_integral("cos(x) - x**3/3", 1, x, -0.5, 3, 2, dps=60)
    # cos x - x^3/3 is largest at 0 and at no other point of the interval.
    assert result.contributions[0].point == 0
    result = sa.laplace_integral("sin(x) - x**2/5", 1, x, 0, 5, 20, dps=60)
    with mp.workdps(80):
        p = mp.findroot(lambda y: mp.cos(y) - 2 * y / 5, mpf("1.11"))
        lead = mp.sqrt(2 * mp.pi / (mp.sin(p) + mpf(2) / 5))
        assert abs(result.contributions[0].coefficients[0] / lead - 1) < mpf(10) ** -58


def test_parameters_bind_to_the_bound() -> None:
    c = sympy.Symbol("c", positive=True)
    result = sa.laplace_integral(-c * x**2 / 2 - x**4, sympy.cos(x), x, -2, 2, 3)
    assert result.parameters == (c,)
    assert result.error_kind == "none"
    assert result.conditions
    with pytest.raises(sa.InputError, match="bind"):
        result.evaluate(10)
    with pytest.raises(sa.InputError, match="not a parameter"):
        result.bind(q=1)
    number = result.bind(c="3/2")
    assert number.error_kind == "bound"
    symbolic = result.expression("n").subs(c, sympy.Rational(3, 2))
    assert sympy.expand(number.expression("n") - symbolic) == 0


# -- values --------------------------------------------------------------------------------------


def test_arrays_are_the_numbers_one_by_one() -> None:
    lam = np.array([[1.5, 20.0, 300.0], [4000.0, 2.0, 700.0]])
    for name in ("Stirling", "two equal", "two unequal", "kink and smooth", "zero of g"):
        result = expansion(name, 4)
        logs = result.evaluate(lam, log=True) if name != "zero of g" else None
        small = lam[lam < 500]
        plain = result.evaluate(small)
        for value, y in zip(plain, small, strict=True):
            assert value == pytest.approx(result.evaluate(y), rel=2e-14)
        if logs is not None:
            assert logs.shape == lam.shape
            for value, y in zip(logs.ravel(), lam.ravel(), strict=True):
                exact = result.evaluate(float(y), dps=30, log=True)
                assert abs(value - exact) <= 4e-15 * max(1, abs(exact))


def test_full_arrays_carry_errors() -> None:
    found = expansion("erfc", 3).evaluate([50.0, 500.0], full=True)
    assert found.value.shape == found.error.shape == (2,)
    assert found.error_kind == "bound"
    assert (found.error < 1e-4 * found.value).all()


def test_out_of_range_is_an_error_and_its_logarithm_is_not() -> None:
    result = expansion("Stirling", 3)
    with pytest.raises(sa.RangeError, match="log=True"):
        result.evaluate(10_000)
    with pytest.raises(sa.RangeError):
        result.evaluate([1.0, 10_000.0])
    assert result.evaluate(10_000, log=True) == pytest.approx(-10003.68623)


def test_logarithm_of_a_sum_that_is_not_positive() -> None:
    negative = sa.laplace_integral(-(x**2), -1, x, -1, 1, 2)
    with pytest.raises(sa.AccuracyError, match="not surely positive"):
        negative.evaluate(10, log=True)


def test_optimal_truncation_beats_every_fixed_order() -> None:
    lam = 6
    exact = truth("Stirling", lam)
    best = expansion("Stirling", "optimal")
    reached = abs(scaled(best, best.evaluate(lam, dps=30, full=True), lam)[0] - exact)
    fixed = []
    for order in (1, 4, 8, 60):
        result = expansion("Stirling", order)
        fixed.append(abs(scaled(result, result.evaluate(lam, dps=30, full=True), lam)[0] - exact))
    assert reached < min(fixed)


def test_the_caller_s_precision_is_left_alone() -> None:
    before = mp.dps, mpmath.iv.prec
    with mp.workdps(7):
        coarse = sa.laplace_integral("sin(x) - x**2/5", "1/(1 + x**2)", x, 0, 5, 4)
        found = coarse.evaluate(200, dps=25, full=True)
        assert mp.dps == 7
    assert (mp.dps, mpmath.iv.prec) == before
    again = expansion("no closed form", 4).evaluate(200, dps=25, full=True)
    assert found.value == again.value
    assert found.error == pytest.approx(again.error, rel=1e-6)


def test_without_flint_there_is_an_estimate(monkeypatch: pytest.MonkeyPatch) -> None:
    from symasym.exact import ball

    monkeypatch.setattr(ball, "available", lambda: False)
    result = sa.laplace_integral("log(x) - x", 1, x, 0, "oo", 3)
    found = result.evaluate(500, dps=25, full=True)
    assert found.error_kind == result.error_kind == "estimate"
    value, error = scaled(result, found, 500)
    assert abs(value - truth("Stirling", 500)) <= error


@scenes
def test_estimates_are_honest_too(scene: Integral, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laplace_errors.ErrorModel, "proof", None)
    for order in (1, 2, 5, "optimal"):
        result = sa.laplace_integral(scene.f, scene.g, x, scene.a, scene.b, order)
        for lam in (3, 10, 40, 200):
            found = result.evaluate(lam, dps=25, full=True)
            value, error = scaled(result, found, lam)
            assert found.error_kind == "estimate"
            assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -15), (order, lam)


@pytest.mark.parametrize("powers", [("1/2", "-1/2"), ("-1/2", "3/2"), ("7/2", "-1/2")])
def test_powers_that_differ_by_an_integer_are_one_series(powers: tuple[str, str]) -> None:
    first, second = (x ** sympy.Rational(p) for p in powers)
    both, *alone = (sa.laplace_integral(-x, g, x, 0, 1, 6) for g in (first + second, first, second))
    assert len(both.contributions) == 1
    assert both.contributions[0].exponents[0] == sympy.Rational(1, 2)
    n = sympy.Symbol("n", positive=True)
    assert sympy.expand(both.expression(n) - sum(part.expression(n) for part in alone)) == 0


@pytest.mark.parametrize(
    ("f", "g"), [("-x", "x**3"), ("-x**2", "1/sqrt(x)"), ("-3*log(1 + x)", "sqrt(x)")]
)
@pytest.mark.parametrize("lam", [3, 10])
def test_tail_is_bounded(f: str, g: str, lam: int) -> None:
    from symasym.asymptotics.rest import _tail

    exponent, weight = sympy.sympify(f), sympy.sympify(g)
    start, (size, drop, steep, growth) = _tail(exponent, weight, x, 0.5, 0.0)
    bound = size * math.exp(-lam * drop) / (lam * steep - growth)
    integrand = sympy.lambdify(x, weight * sympy.exp(lam * exponent), "mpmath")
    exact = mp.quad(integrand, [start, start + 1, start + 10, start + 100, mp.inf])
    assert exact <= bound * (1 + 1e-9)
    assert bound < 100 * exact


def test_a_polygon_around_another_zero_proves_nothing() -> None:
    from symasym.asymptotics.disk import _proved, _Surroundings
    from symasym.exact.ball_drift import flint_module, precision

    f = sympy.sympify("-x**2*(1 + x)")
    zero = flint_module().arb(0)
    around = _Surroundings(f, sympy.Integer(1), x, zero, zero, 2, Fraction(1), 0)
    circle = np.exp(2j * np.pi * np.arange(64) / 64)
    with precision(100):
        # The other zero of h, at -1, is outside the first circle and inside the second.
        found = _proved(around, 0.5 * circle, 0.5**1.5)
        assert found is not None
        assert 0.9 * 0.5**1.5 < found[0] <= 0.5**1.5
        assert _proved(around, 2 * circle, 2.0) is None


def test_a_flat_f_is_not_taken_for_a_narrow_peak() -> None:
    result = sa.laplace_integral("-1e-30*x**2", 1, x, -1, 1, 2)
    found = result.evaluate(100, full=True)
    assert abs(found.value - 2) <= found.error
    numeric = sa.laplace_integral(-x, "1e-30 + x", x, 0, 1, 2, dps=20)
    with mp.workdps(30):
        assert abs(numeric.contributions[0].coefficients[0] * mpf(10) ** 30 - 1) < mpf(10) ** -19


def test_printing() -> None:
    result = sa.laplace_integral(-x, 1 / (1 + x), x, 0, "oo", 3)
    assert str(result).startswith("e^(lam (0)) [(1) lam^(-1) + (-1) lam^(-2) + (2) lam^(-3)]")
    assert "O(e^(lam (0)) lam^(-4)); error: at most" in str(result)
    assert r"O\left(\frac{1}{\lambda^{4}}\right)" in result.latex()
    n = sympy.Symbol("n", positive=True)
    assert result.expression(n) == 1 / n - 1 / n**2 + 2 / n**3


def test_latex_of_two_heights_keeps_both_exponentials() -> None:
    kept = sa.laplace_integral("-x**2*(x - 2)**2*(2 - x/4) + x/9", 1, x, -1, 3, 1, keep=True)
    # Of each contribution, and of the O term.
    assert kept.latex().count("e^{") == 3


# -- bad input -----------------------------------------------------------------------------------

y = sympy.Symbol("y")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((x, 1, x, 0, "oo"), "does not fall"),
        (("log(x)", 1, x, 0, "oo"), "does not fall"),
        (("cos(x)", 1, x, 0, "oo"), "does not fall"),
        (("1/(1 + x**2)", 1, x, 0, "oo"), "does not fall"),
        ((-x, "exp(x**2)", x, 0, "oo"), "diverges for every lam"),
        (("1/x", 1, x, 0, 1), "tends to oo"),
        ((-x, 1 / x, x, 0, 1), "diverges"),
        ((-(x**2), 1 / x**2, x, -1, 1), "diverges"),
        ((-(x**2), "sqrt(x)", x, -1, 1), "isn't real"),
        ((-(x**2), "log(x)", x, 0, 1), "neither analytic nor"),
        ((-(sympy.Abs(x) ** sympy.Rational(3, 2)), 1, x, -1, 1), "no Taylor series"),
        ((sympy.I * x, 1, x, 0, 1), "complex"),
        ((sympy.Integer(3), 1, x, 0, 1), "does not contain x"),
        ((-sympy.gamma(x), 1, x, 1, 3), "f contains gamma"),
        ((-x, sympy.besselj(0, x), x, 0, 1), "g contains besselj"),
        ((-x, 1, x, 1, 0), "a must be less than b"),
        ((-x, 1, x, 0, x), "contains x"),
        ((-(nu**2), 1, nu, -1, 1), "by its own assumptions"),
        ((-x, 0, x, 0, 1), "g is 0"),
        (("-x**", 1, x, 0, 1), "which SymPy cannot read"),
        ((-x, [1], x, 0, 1), "give a SymPy expression"),
        ((-x, 1, 3, 0, 1), "variable of integration"),
        ((-x, 1, x, 0, 1, 0), "order is 0"),
        ((-x, 1, x, 0, 1, 2.5), "order is 2.5"),
        ((-x, 1, x, 0, 1, "best"), "order is 'best'"),
        ((-y * x**2, 1, x, -1, 1), "could not be decided"),
        ((-x, x ** (y - 1), x, 0, 1), "diverges unless"),
        (("Piecewise((0, x < 1), (1 - x, True))", 1, x, 0, 2), "flat|no isolated|not largest"),
    ],
)
def test_bad_integrals(arguments: Any, says: str) -> None:
    with pytest.raises(sa.InputError, match=says) as caught:
        sa.laplace_integral(*arguments)
    text = str(caught.value)
    assert text.endswith(".")
    assert ";" in text or "unless" in text


def test_wrong_maxima_are_refused() -> None:
    with pytest.raises(sa.InputError, match="has no maximum"):
        sa.laplace_integral(-(x**2), 1, x, -1, 1, maxima=["1/2"])
    c = sympy.Symbol("c", positive=True)
    with pytest.raises(sa.InputError, match="could not be decided"):
        sa.laplace_integral(-c * x**2, 1, x, -1, 1, maxima=[c])


@pytest.mark.parametrize("lam", [0, -1, [1.0, -2.0], 1j, "a", float("nan")])
def test_bad_lam(lam: Any) -> None:
    with pytest.raises(sa.InputError):
        expansion("erfc", 2).evaluate(lam)


def test_more_digits_than_the_coefficients_have() -> None:
    result = expansion("no closed form", 2)
    with pytest.raises(sa.AccuracyError, match="pass dps"):
        result.evaluate(10, dps=60)
    fine = sa.laplace_integral("sin(x) - x**2/5", "1/(1 + x**2)", x, 0, 5, 2, dps=80)
    assert abs(fine.evaluate(10, dps=60) - result.evaluate(10, dps=25)) < 1e-24 * 7000


def test_public_body_and_verb_agree_on_their_arguments() -> None:
    import inspect

    verb, body = (
        inspect.signature(function).parameters
        for function in (sa.laplace_integral, laplace.laplace_integral)
    )
    assert [(p.name, p.default) for p in verb.values()] == [
        (p.name, p.default) for p in body.values()
    ]
