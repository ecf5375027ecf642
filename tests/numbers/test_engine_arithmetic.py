"""Arithmetic below the engines: double-doubles, truncated Taylor series, Taylor recurrences."""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest
from symasym.exact.digit_panels import (
    constant_moments,
    guard_bits,
    integers,
    layers,
    recurrence,
    slow_moments,
    slow_series,
    terms_needed,
)

import symasym as sa
from symasym.numbers.float_arrays import DoubleDouble, DoubleDoubleOps, shift
from symasym.series.truncated_series import SeriesOps, TruncatedSeries


def context(dps: int) -> Any:
    mp = mpmath.MPContext()
    mp.dps = dps
    return mp


# -- double-doubles ------------------------------------------------------------------------------


def exactly(x: DoubleDouble) -> F:
    return F(float(x.hi)) + F(float(x.lo))


def test_double_double_arithmetic() -> None:
    rng = random.Random(1)
    for _ in range(300):
        a, b = (F(rng.randint(-(10**40), 10**40), 10 ** rng.randint(20, 60)) for _ in range(2))
        x, y = DoubleDouble.of(a), DoubleDouble.of(b)
        assert abs(exactly(x) - a) <= abs(a) * F(1, 10**31)
        a, b = exactly(x), exactly(y)
        for found, wanted, size in (
            (x + y, a + b, abs(a) + abs(b)),
            (x - y, a - b, abs(a) + abs(b)),
            (x * y, a * b, abs(a * b)),
            (x / y, a / b, abs(a / b)),
            (2 - x, 2 - a, 2 + abs(a)),
            (3 / y, 3 / b, abs(3 / b)),
            (-x, -a, F(0)),
        ):
            assert abs(exactly(found) - wanted) <= size * F(1, 10**30)


def test_double_double_sums_that_cancel() -> None:
    x = DoubleDouble.of(F(1, 3)) + DoubleDouble.of(F(1, 10**25)) - DoubleDouble.of(F(1, 3))
    assert abs(exactly(x) - F(1, 10**25)) <= F(1, 10**31)


def test_shift_keeps_what_vanishes_at_the_centre() -> None:
    # (u - c)^3 with c = 2/3 in double-doubles: everything cancels but the cube
    c = F(2, 3)
    coefficients = [DoubleDouble.of(x) for x in (-(c**3), 3 * c**2, -3 * c, F(1))]
    centre = np.array([0.6666, 2 / 3, 0.7])
    found = shift(coefficients, centre)
    for k, u in enumerate(centre):
        gap = F(float(u)) - c
        for value, wanted in zip(found, (gap**3, 3 * gap**2, 3 * gap, F(1)), strict=True):
            assert abs(F(float(value[k])) - wanted) <= abs(wanted) * F(1, 10**14) + F(1, 10**30)


@pytest.mark.parametrize("name", ["exp", "log", "sin", "tanh", "erf", "sqrt", "atan"])
def test_double_double_functions(name: str) -> None:
    mp = context(60)
    x = DoubleDouble.of(F(17, 10))
    found = getattr(DoubleDoubleOps(), name)(x)
    wanted = getattr(mp, name)(mp.mpf(17) / 10)
    assert abs(mp.mpf(float(found.hi)) + float(found.lo) - wanted) <= abs(wanted) * 1e-30
    power = DoubleDoubleOps().power(x, F(-2, 3))
    value = mp.mpf(float(power.hi)) + float(power.lo)
    assert abs(value - (mp.mpf(17) / 10) ** (-mp.mpf(2) / 3)) < 1e-30
    pi = DoubleDoubleOps().pi()
    assert abs(mp.mpf(float(pi.hi)) + float(pi.lo) - mp.pi) < 1e-31


# -- truncated Taylor series ----------------------------------------------------------------------

FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
    "exp": lambda u, f: f.exp(u / 2 - 1),
    "log": lambda u, f: f.log(u + 3),
    "sqrt": lambda u, f: f.sqrt(u + 2),
    "sin": lambda u, f: f.sin(3 * u),
    "cos": lambda u, f: f.cos(3 * u),
    "tan": lambda u, f: f.tan(u / 2),
    "sinh": lambda u, f: f.sinh(u),
    "cosh": lambda u, f: f.cosh(u),
    "tanh": lambda u, f: f.tanh(4 * u),
    "asin": lambda u, f: f.asin(u / 2),
    "acos": lambda u, f: f.acos(u / 2),
    "atan": lambda u, f: f.atan(3 * u),
    "asinh": lambda u, f: f.asinh(2 * u),
    "acosh": lambda u, f: f.acosh(u + 3),
    "atanh": lambda u, f: f.atanh(u / 2),
    "erf": lambda u, f: f.erf(2 * u),
    "quotient": lambda u, f: (1 - u) / (2 + u * u),
    "reciprocal": lambda u, f: 3 / (4 + u),
    "a gaussian": lambda u, f: f.exp(-20 * u * u),
    "one over a growing exponential": lambda u, f: 1 / f.exp(12 * u * u),
    "composed": lambda u, f: f.exp(f.sin(2 * u)) / (2 + f.cos(u)) - u * u * u,
}


def jet_and_series(name: str, centre: F, scale: F, order: int, dps: int) -> tuple[Any, Any, Any]:
    mp, fine = context(dps), context(2 * dps + 60)
    ops = SeriesOps(order, mp)
    series = FUNCTIONS[name](ops.variable(centre, scale), ops)
    point = fine.mpf(centre.numerator) / centre.denominator
    step = fine.mpf(scale.numerator) / scale.denominator
    plain = fine.taylor(lambda u: FUNCTIONS[name](u, fine), point, order - 1)
    return TruncatedSeries.fractions(series, ops), [c * step**k for k, c in enumerate(plain)], fine


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize("centre", ["-1", "0", "1/3", "1"])
def test_jets_are_taylor_series(name: str, centre: str) -> None:
    found, wanted, mp = jet_and_series(name, F(centre), F(1, 8), 10, 30)
    largest = max(abs(c) for c in wanted)
    for value, exact in zip(found, wanted, strict=True):
        assert abs(mp.mpf(value.numerator) / value.denominator - exact) <= largest * 1e-28


@pytest.mark.parametrize("name", FUNCTIONS)
def test_jets_of_a_wide_variable_keep_their_digits(name: str) -> None:
    # beyond the radius of convergence the coefficients grow; the first ones must survive
    found, wanted, mp = jet_and_series(name, F(1, 3), F(4), 12, 30)
    largest = max(abs(c) for c in wanted)
    for value, exact in zip(found, wanted, strict=True):
        assert abs(mp.mpf(value.numerator) / value.denominator - exact) <= largest * 1e-27


def test_powers_of_jets() -> None:
    mp = context(40)
    ops = SeriesOps(6, mp)
    u = ops.variable(F(1, 2))
    for exponent in (F(1, 3), F(-2, 3), F(5, 2)):
        found = TruncatedSeries.coefficients_of(ops.power(u + 1, exponent), ops)
        power = mp.mpf(exponent.numerator) / exponent.denominator
        for k, value in enumerate(found):
            wanted = mp.binomial(power, k) * mp.mpf("1.5") ** (power - k)
            assert abs(value - wanted) < 1e-38
    cube, inverse = u**3, u**-2
    assert [F(x) for x in TruncatedSeries.fractions(cube, ops)] == [
        F(1, 8),
        F(3, 4),
        F(3, 2),
        1,
        0,
        0,
    ]
    for k, value in enumerate(TruncatedSeries.coefficients_of(inverse, ops)):
        assert abs(value - (-1) ** k * (k + 1) * mp.mpf(2) ** (k + 2)) < 1e-35
    assert TruncatedSeries.coefficients_of(u**0, ops) == [1, 0, 0, 0, 0, 0]
    assert TruncatedSeries.coefficients_of(mp.mpf(3), ops) == [3, 0, 0, 0, 0, 0]


def test_jets_refuse_what_is_not_real_or_not_finite() -> None:
    ops = SeriesOps(5, context(20))
    u = ops.variable(F(0))
    for make in (
        lambda: 1 / u,
        lambda: ops.sqrt(u),
        lambda: ops.sqrt(u - 1),
        lambda: ops.log(u - 2),
        lambda: ops.acosh(u),
        lambda: ops.atanh(u + 1),
    ):
        with pytest.raises(sa.SymasymError, match=r"\.$"):
            make()


# -- Taylor recurrences ----------------------------------------------------------------------------


def rationals(rng: random.Random, count: int, size: int) -> list[F]:
    return [F(rng.randint(-(10**6), 10**6) * size, 10**6) for _ in range(count)]


@pytest.mark.parametrize("size", [1, 8, 30, 80])
@pytest.mark.parametrize("bits", [100, 400])
def test_recurrences_solve_their_equations(size: int, bits: int) -> None:
    rng = random.Random(size * bits)
    mp = mpmath.MPContext()
    mp.prec = bits + 200
    for _ in range(4):
        check_recurrences(mp, rationals(rng, rng.choice([1, 2, 4]), size), bits)


def check_recurrences(mp: Any, q: list[F], bits: int) -> None:
    growth = [abs(float(x)) / (k + 1) for k, x in enumerate(q)]
    places = bits + guard_bits(sum(growth))
    count = terms_needed(growth, places)
    whole, denominator = integers(q, places)
    end, far = recurrence(whole, denominator, places, count, False)
    near, both = recurrence(whole, denominator, places, count, True)
    slopes = [mp.mpf(x.numerator) / x.denominator for x in q]

    def primitive(s: Any) -> Any:
        return sum(x * s ** (k + 1) / (k + 1) for k, x in enumerate(slopes))

    unit, allowed = mp.ldexp(1, -places), mp.ldexp(1, -bits)
    assert abs(int(end) * unit / mp.exp(primitive(mp.one)) - 1) <= allowed
    pieces = [mp.mpf(k) / 8 for k in range(9)]
    exact = mp.quad(lambda s: mp.exp(primitive(s)), pieces)
    assert abs(int(far) * unit / exact - 1) <= 8 * allowed
    exact = mp.quad(lambda s: mp.exp(primitive(mp.one) - primitive(s)), pieces)
    assert abs(int(near) * unit / exact - 1) <= 8 * allowed
    assert 0 < both < far * near  # e(w)/e(x) over w < x is part of the product


@pytest.mark.parametrize("rate", ["40", "-40", "3", "-1/7", "0"])
def test_double_integral_of_a_constant_drift(rate: str) -> None:
    bits, q = 200, [F(rate)]
    growth = [abs(float(q[0]))]
    places = bits + guard_bits(growth[0])
    whole, denominator = integers(q, places)
    _, both = recurrence(whole, denominator, places, terms_needed(growth, places), True)
    mp = context(120)
    x = mp.mpf(q[0].numerator) / q[0].denominator
    exact = (mp.exp(x) - 1 - x) / x**2 if x else mp.one / 2
    assert abs(mp.ldexp(int(both), -places) / exact - 1) < mp.ldexp(1, -bits + 3)


def test_terms_needed_where_powers_leave_floats() -> None:
    # A tanh drift at 900 digits has 2,500 coefficients, and 1.4^2500 is no float64.
    logs = [-k * math.log(2.5) for k in range(2500)]
    growth = [math.exp(max(x, -740.0)) for x in logs]
    assert terms_needed(growth[:600], 3000, logs[:600]) == terms_needed(growth[:600], 3000)
    count = terms_needed(growth, 3000, logs)
    assert 3000 * math.log(2) / math.log(2.5) < count < 3000 * math.log(2) / math.log(1.4)


def test_terms_needed_are_enough_and_not_far_too_many() -> None:
    for growth in ([5.0], [30.0, 4.0], [0.0, 0.0, 60.0], [1e-8]):
        for bits in (60, 500, 3000):
            count = terms_needed(growth, bits)
            # exact majorant: coefficients of exp(sum growth s^(k+1)), by the same recurrence
            mp = context(bits // 3 + 200)
            c = [mp.one]
            slopes = [(k + 1) * mp.mpf(g) for k, g in enumerate(growth)]
            for n in range(1, 3 * count + 60):
                c.append(sum(s * c[n - 1 - k] for k, s in enumerate(slopes) if n - 1 >= k) / n)
            assert sum(c[count:]) < mp.ldexp(1, -bits)
            if sum(growth) > 1:
                assert sum(c[count // 2 - 8 :]) > mp.ldexp(1, -bits)


@pytest.mark.parametrize("x", ["1e-40", "1e-9", "0.7", "12", "5000", "1e8"])
@pytest.mark.parametrize("sign", [1, -1])
def test_moments_of_constant_drift(x: str, sign: int) -> None:
    mp, fine = context(40), context(300)
    end, first, second = constant_moments(sign * F(x), mp)
    y = fine.mpf(F(x).numerator) / F(x).denominator
    e = fine.exp(-y)
    wanted = (e, (1 - e) / y, (y - 1 + e if sign < 0 else 1 - (1 + y) * e) / y**2)
    for value, exact in zip((end, first, second), wanted, strict=True):
        assert abs(fine.convert(value) / exact - 1) < 1e-39


def test_moments_of_no_drift() -> None:
    assert constant_moments(F(0), context(20)) == (1, 1, 0.5)


@pytest.mark.parametrize("place", [1, 3])
def test_layers_of_a_linear_drift(place: int) -> None:
    # lam phi = L x: the solutions without a layer are Dawson's and the scaled erfc
    mp, L = context(40), 10**6
    rounds = 30
    phi = [mp.mpf(L * place), mp.mpf(L)] + [mp.zero] * (rounds - 1)
    x, root = mp.mpf(place), mp.sqrt(mp.mpf(L) / 2)
    with mp.workdps(60):
        t = root * x
        # sums of their asymptotic series, to the smallest term and far beyond 40 digits
        odd = [mp.fac2(2 * k - 1) / (2 * t * t) ** k for k in range(30)]
        dawson = sum(odd) / (2 * t)
        erfc = sum((-1) ** k * c for k, c in enumerate(odd)) / t
        M, Q = mp.sqrt(mp.mpf(2) / L) * dawson, erfc / mp.sqrt(2 * mp.mpf(L))
    # M' = 1 - lam phi M follows, Q' = -1 + lam phi Q opposes
    following, opposing = layers(phi, mp)
    assert abs(following / M - 1) < 1e-38
    assert abs(opposing / Q - 1) < 1e-38


def test_integral_of_a_solution_without_layers() -> None:
    # lam phi = L (3 + s) on [-1, 1]; with x = 3 + s, M'(x) = 1 - L x M
    mp, L = context(35), 4000
    phi = [mp.mpf(3 * L), mp.mpf(L)] + [mp.zero] * 118
    bits = mp.prec + 32
    following, _ = slow_series(phi, 22, bits)
    even = (mp.mpf(int(x)) / (2 * k + 1) for k, x in enumerate(following[::2]))
    found = mp.ldexp(2 * sum(even) / phi[0], -bits)
    with mp.workdps(45):
        root = mp.sqrt(mp.mpf(L) / 2)

        def M(x: Any) -> Any:
            t = root * x
            terms = [mp.fac2(2 * k - 1) / (2 * t * t) ** k for k in range(28)]
            return mp.sqrt(mp.mpf(2) / L) * sum(terms) / (2 * t)

        wanted = mp.quad(M, [2, 3, 4])
    assert abs(found / wanted - 1) < 1e-30


def test_moments_of_a_slow_panel() -> None:
    mp = context(30)
    phi = [mp.mpf(2000), mp.mpf(300), mp.mpf(-70), mp.mpf(11)]
    found = slow_moments(phi, 40, mp)
    with mp.workdps(40):
        for j in (0, 1, 2, 5):
            wanted = mp.quad(
                lambda t, j=j: (
                    t**j * mp.exp(sum(p * t ** (k + 1) / (k + 1) for k, p in enumerate(phi)))
                ),
                [-0.1, -0.02, -0.005, -0.001, 0],
            )
            assert abs(found[j] / wanted - 1) < 1e-25, j
