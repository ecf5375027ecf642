"""Coefficients and maxima of Laplace expansions: published series, and two ways to each."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp, mpf

import symasym as sa
from symasym.asymptotics.laplace.watson import (
    laplace_coefficients,
    moment_coefficients,
    perron_coefficients,
)
from symasym.base.call_context import own_context
from tests.integrals import scaled, truth

x = sympy.Symbol("x")

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


def test_first_correction_in_derivatives() -> None:
    """f4/(8 f2^2) - 5 f3^2/(24 f2^3) and its kin of g, from derivatives (DLMF 2.4(iv))."""
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
    from symasym.asymptotics.laplace import expansion

    def wrong(*args: Any, **kwargs: Any) -> Any:
        right = perron_coefficients(*args, **kwargs)
        return [*right[:-1], right[-1] * sympy.QQ(1001, 1000)]

    monkeypatch.setattr(expansion, "perron_coefficients", wrong)
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
    symbolic = result.expression_in("n").subs(c, sympy.Rational(3, 2))
    assert sympy.expand(number.expression_in("n") - symbolic) == 0
