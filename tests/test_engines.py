"""The parts of the engines by themselves: panels, double-doubles, jets, Taylor recurrences."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction as F
from functools import reduce
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.arithmetic import MpmathOps
from symasym.exact import block_records, double, panels
from symasym.exact.block_records import is_slow
from symasym.exact.double_double import DoubleDouble, DoubleDoubleOps, shift
from symasym.exact.fields import field_of
from symasym.exact.jets import Jet, JetOps
from symasym.exact.local import ExactField, dyadic, to_fraction
from symasym.exact.partition import Partition
from symasym.exact.taylor import (
    constant_moments,
    guard_bits,
    integers,
    layer,
    recurrence,
    slow_integral,
    terms_needed,
)


def context(dps: int) -> Any:
    mp = mpmath.MPContext()
    mp.dps = dps
    return mp


# -- float64 panels ------------------------------------------------------------------------------


def printed_moments(mp: Any, primitive: Callable[[Any], Any], h: Any) -> list[Any]:
    """The table of `symasym.exact.panels` by quadrature, for lam int_0^x phi = primitive(x)."""
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


def sampled(coefficients: list[float], h: float) -> panels.Moments:
    """A panel with lam phi = sum of coefficients[k] x^k."""
    scaled = np.array([[c * h ** (k + 1) for k, c in enumerate(coefficients)]])
    return panels.sampled(panels.exponents_of_series(scaled), np.array([h]))[0]


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
        # of `both`, 16 nodes lose a little more at the full reach, where it hardly counts
        allowed = 5e-13 if name == "both" else 3e-14
        assert float(value[0]) == pytest.approx(float(exact), rel=allowed, abs=1e-300)


def test_the_reach_of_sampled_panels_is_what_it_says() -> None:
    # at the largest exponents that are sampled, 16 nodes still give rounding errors only
    mp = context(30)
    for slope in (panels.REACH, -panels.REACH, panels.REACH / 2):
        wanted = printed_moments(mp, lambda x, s=slope: s * (x - x * x / 4), mp.one)
        for value, exact in zip(sampled([slope, -slope / 2], 1.0), wanted, strict=True):
            assert float(value[0]) == pytest.approx(float(exact), rel=5e-14)


def test_series_and_values_give_the_same_exponents() -> None:
    c = np.array([[1.5, -2.0, 0.7, 3.0], [0.1, 0.0, 0.0, -1.0]])
    nodes = panels.gauss().nodes
    values = c @ nodes[None, :] ** np.arange(4)[:, None]
    first, second = panels.exponents_of_series(c), panels.exponents_of_values(values)
    assert np.allclose(first, second, rtol=1e-14, atol=1e-15)


def many(coefficients: list[float], h: float, count: int) -> panels.Moments:
    """The panel cut into `count` sampled panels, merged."""
    pieces = []
    for k in range(count):
        t0, width = h * k / count, h / count
        local = np.polynomial.Polynomial(coefficients)(np.polynomial.Polynomial([t0, width]))
        padded = np.zeros(len(coefficients))
        padded[: len(local.coef)] = local.coef
        pieces.append(padded * width)
    exponents = panels.exponents_of_series(np.array(pieces))
    found, _ = panels.sampled(exponents, np.full(count, h / count))
    return panels.merge(found, np.arange(count), np.full(count, count))


@pytest.mark.parametrize(("coefficients", "h"), POLYNOMIALS[:7])
@pytest.mark.parametrize("count", [2, 3, 7, 32])
def test_merging_restores_the_whole(coefficients: list[float], h: float, count: int) -> None:
    for whole, merged in zip(sampled(coefficients, h), many(coefficients, h, count), strict=True):
        assert merged[0] == pytest.approx(whole[0], rel=3e-14, abs=1e-300)


def test_merging_keeps_runs_apart() -> None:
    one, two = many([3.0, 1.0], 0.5, 3), many([-7.0], 0.4, 4)
    parts = []
    for coefficients, h, count in (([3.0, 1.0], 0.5, 3), ([-7.0], 0.4, 4)):
        for k in range(count):
            t0, width = h * k / count, h / count
            local = np.polynomial.Polynomial(coefficients)(np.polynomial.Polynomial([t0, width]))
            parts.append((np.pad(local.coef, (0, 2 - len(local.coef))) * width, width))
    exponents = panels.exponents_of_series(np.array([p[0] for p in parts]))
    found, _ = panels.sampled(exponents, np.array([p[1] for p in parts]))
    k, count = np.array([0, 1, 2, 0, 1, 2, 3]), np.array([3, 3, 3, 4, 4, 4, 4])
    for merged, first, second in zip(panels.merge(found, k, count), one, two, strict=True):
        assert merged == pytest.approx([first[0], second[0]], rel=1e-13)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("slope", [0.0, 0.4, -0.3])
def test_slow_panels_are_what_sampling_gives(sign: float, slope: float) -> None:
    # lam phi of 550 to 900 over a width of 0.7: slow, and still within float64 where sampled
    size, h = 700.0, 0.7
    coefficients = [sign * size, sign * size * slope, sign * size * 0.1]
    nodes = panels.lobatto().nodes * h
    lam_phi = np.polynomial.polynomial.polyval(nodes, coefficients)[None, :]
    found, wanted = panels.slow(lam_phi, np.array([h])), many(coefficients, h, 256)
    for value, exact in zip(found, wanted, strict=True):
        assert value[0] == pytest.approx(exact[0], rel=2e-13)


def test_slow_panels_see_the_poles_of_the_drift() -> None:
    # 1/phi is a parabola and seen at any width, but the rise needs phi itself, which has poles
    # at distance 1. At this lam an error of 1e-12 in the rise is as large as the layers.
    rule, lam, accepted = panels.lobatto(), np.array([1e12]), []
    for reach in np.geomspace(0.02, 3.0, 40):
        u, h = reach * (2 * rule.nodes - 1), np.array([2 * reach])
        phi = 1 / (1 + u**2)[None, :]
        low, high = phi.min(axis=1), phi.max(axis=1)
        accepted.append(bool(is_slow(low, high, lam * phi, lam * h, h)[0]))
        if accepted[-1]:
            rise = panels.slow(lam * phi, h).rise[0]
            assert rise == pytest.approx(-2 * lam[0] * np.arctan(reach), rel=1e-15)
    assert accepted[0]
    assert not accepted[-1]


def test_terms_of_the_slow_series_are_repeated_derivatives() -> None:
    # lam phi = 1/(a + b x): t_0 = a + b x and t_1 = b t_0, t_2 = b^2 t_0, ...
    a, b, h = 2e-3, 1e-3, 0.8
    nodes = panels.lobatto().nodes * h
    terms = panels.slow_terms(1 / (a + b * nodes)[None, :], np.array([h]))
    for k in range(4):
        assert terms[k, 0] == pytest.approx(b**k * (a + b * nodes), rel=10.0 ** (3 * k - 13))


@pytest.mark.parametrize("x", [0.0, 1e-300, 1e-12, 0.3, 0.49999, 0.50001, 2.0, 700.0, 1e5, 1e300])
@pytest.mark.parametrize("sign", [1, -1])
def test_panels_of_constant_drift(x: float, sign: int) -> None:
    mp = context(700)
    h = 0.75
    with np.errstate(over="ignore"):
        found = panels.constant(np.array([sign * x / h]), np.array([h]))
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
    gauss, lobatto = panels.gauss(), panels.lobatto()
    for rule in (gauss, lobatto):
        assert rule.weights @ rule.nodes**power == pytest.approx(1 / (power + 1), rel=1e-14)
    if power < panels.NODES:
        running = gauss.integrate @ gauss.nodes**power
        assert running == pytest.approx(gauss.nodes ** (power + 1) / (power + 1), abs=2e-15)
    slope = lobatto.differentiate @ lobatto.nodes**power
    wanted = power * lobatto.nodes ** max(power - 1, 0)
    assert slope == pytest.approx(wanted, abs=1e-11)


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


# -- jets ----------------------------------------------------------------------------------------

JET_FUNCTIONS: dict[str, Callable[[Any, Any], Any]] = {
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
    ops = JetOps(order, mp)
    jet = JET_FUNCTIONS[name](ops.variable(centre, scale), ops)
    point = fine.mpf(centre.numerator) / centre.denominator
    step = fine.mpf(scale.numerator) / scale.denominator
    plain = fine.taylor(lambda u: JET_FUNCTIONS[name](u, fine), point, order - 1)
    return Jet.fractions(jet, ops), [c * step**k for k, c in enumerate(plain)], fine


@pytest.mark.parametrize("name", JET_FUNCTIONS)
@pytest.mark.parametrize("centre", ["-1", "0", "1/3", "1"])
def test_jets_are_taylor_series(name: str, centre: str) -> None:
    found, wanted, mp = jet_and_series(name, F(centre), F(1, 8), 10, 30)
    largest = max(abs(c) for c in wanted)
    for value, exact in zip(found, wanted, strict=True):
        assert abs(mp.mpf(value.numerator) / value.denominator - exact) <= largest * 1e-28


@pytest.mark.parametrize("name", JET_FUNCTIONS)
def test_jets_of_a_wide_variable_keep_their_digits(name: str) -> None:
    # beyond the radius of convergence the coefficients grow; the first ones must survive
    found, wanted, mp = jet_and_series(name, F(1, 3), F(4), 12, 30)
    largest = max(abs(c) for c in wanted)
    for value, exact in zip(found, wanted, strict=True):
        assert abs(mp.mpf(value.numerator) / value.denominator - exact) <= largest * 1e-27


def test_powers_of_jets() -> None:
    mp = context(40)
    ops = JetOps(6, mp)
    u = ops.variable(F(1, 2))
    for exponent in (F(1, 3), F(-2, 3), F(5, 2)):
        found = Jet.coefficients_of(ops.power(u + 1, exponent), ops)
        power = mp.mpf(exponent.numerator) / exponent.denominator
        for k, value in enumerate(found):
            wanted = mp.binomial(power, k) * mp.mpf("1.5") ** (power - k)
            assert abs(value - wanted) < 1e-38
    cube, inverse = u**3, u**-2
    assert [F(x) for x in Jet.fractions(cube, ops)] == [F(1, 8), F(3, 4), F(3, 2), 1, 0, 0]
    for k, value in enumerate(Jet.coefficients_of(inverse, ops)):
        assert abs(value - (-1) ** k * (k + 1) * mp.mpf(2) ** (k + 2)) < 1e-35
    assert Jet.coefficients_of(u**0, ops) == [1, 0, 0, 0, 0, 0]
    assert Jet.coefficients_of(mp.mpf(3), ops) == [3, 0, 0, 0, 0, 0]


def test_jets_refuse_what_is_not_real_or_not_finite() -> None:
    ops = JetOps(5, context(20))
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
    assert abs(layer(phi, True, mp) / M - 1) < 1e-38
    assert abs(layer(phi, False, mp) / Q - 1) < 1e-38


def test_integral_of_a_solution_without_layers() -> None:
    # lam phi = L (3 + s) on [-1, 1]; with x = 3 + s, M'(x) = 1 - L x M
    mp, L = context(35), 4000
    phi = [mp.mpf(3 * L), mp.mpf(L)] + [mp.zero] * 118
    found = slow_integral(phi, 120, 22, True, mp)
    with mp.workdps(45):
        root = mp.sqrt(mp.mpf(L) / 2)

        def M(x: Any) -> Any:
            t = root * x
            terms = [mp.fac2(2 * k - 1) / (2 * t * t) ** k for k in range(28)]
            return mp.sqrt(mp.mpf(2) / L) * sum(terms) / (2 * t)

        wanted = mp.quad(M, [2, 3, 4])
    assert abs(found / wanted - 1) < 1e-30


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
        from symasym.arithmetic import MpmathOps

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
    for panel in Partition(field, lam, mp).records(start, end):
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

    monkeypatch.setattr(block_records, "hidden", hidden)
    drift = sa.Drift("tanh(2*u)")
    field = field_of(drift, drift.values, 1)
    one = np.ones(2)
    found = double.sweep(field, 2 * one, -one, one, free=False)
    assert np.isinf(found.sigma_error).all()
    assert np.isinf(found.w_error).all()


def test_dyadic_numbers_are_short_and_near() -> None:
    for x in (F(1, 3), F(-22, 7), F(10**30 + 1, 10**30)):
        near = dyadic(x, 20)
        assert abs(near - x) <= F(1, 2**20)
        assert near.denominator <= 2**20
