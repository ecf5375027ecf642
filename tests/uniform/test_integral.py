"""Integrals with coalescing saddles and ends, against special functions and quadrature."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
from mpmath import mp

import symasym as sa
from symasym.base.errors import AccuracyError, InputError


def number(text: Any) -> Any:
    q = Fraction(text)
    return mp.mpf(q.numerator) / q.denominator


def bessel(order: int) -> Any:
    return sa.uniform_integral(
        "z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", order=order
    )


def gamma(order: int) -> Any:
    return sa.uniform_integral("log(x) - x", "1/x", "x", "mu", "oo", order=order, near=1)


@pytest.mark.parametrize("z", ["1/2", "0.999999999999", "1", "1.01", "2"])
@pytest.mark.parametrize(("order", "most"), [(1, 1e-3), (4, 1e-11), (7, 1e-16)])
def test_bessel_through_its_turning_point(z: str, order: int, most: float) -> None:
    found = bessel(order).bind(z=z).evaluate(100, dps=25, full=True)
    with mp.workdps(35):
        y = 100 * number(z)
        exact = mp.besselj(100, y)
        size = abs(exact) if y < 100 else mp.hypot(exact, mp.bessely(100, y))
        assert abs(found.value - exact) <= found.error < 4 * most * size
    assert found.error_kind == "estimate"


@pytest.mark.parametrize("z", ["1/2", "1", "2"])
def test_bessel_coefficients(z: str) -> None:
    """DLMF 10.20: A_1 and B_0 at the turning point, zeta and B_0 beside it."""
    zeta, ((p0, _), (_, q1), (p2, _)) = bessel(3).bind(z=z).coefficients(dps=25)
    with mp.workdps(30):
        square = 1 - number(z) ** 2
        if not square:
            known, b, front = 0, mp.cbrt(2) / 70, mp.cbrt(2)
            assert abs(p2 / p0 + mp.mpf(1) / 225) < 1e-22
        else:
            root = mp.sqrt(abs(square))
            inner = 5 / (24 * root**3) - mp.sign(square) / (8 * root)
            area = mp.acosh(1 / number(z)) - root if square > 0 else root - mp.acos(1 / number(z))
            known = mp.sign(square) * mp.cbrt(area * 3 / 2) ** 2
            front = mp.root(4 * known / square, 4)
            b = -5 / (48 * known**2) + inner / mp.sqrt(abs(known))
        assert abs(zeta - known) < 1e-22
        assert abs(p0 - front) < 1e-22
        assert abs(q1 / p0 - b) < 1e-21


@pytest.mark.parametrize("mu", ["1/4", "0.9", "1", "1.01", "2", "10"])
@pytest.mark.parametrize(("order", "most"), [(1, 1e-2), (4, 3e-9)])
def test_incomplete_gamma(mu: str, order: int, most: float) -> None:
    """Gamma(a, mu a): DLMF 8.12."""
    found = gamma(order).bind(mu=mu).evaluate(60, dps=20, full=True)
    with mp.workdps(30):
        exact = mp.gammainc(60, 60 * number(mu)) * mp.mpf(60) ** -60
        assert abs(found.value - exact) <= found.error < most * exact


@pytest.mark.parametrize("z", ["-2", "0", "1"])
def test_airy_is_exact(z: str) -> None:
    waves = sa.uniform_integral("I*(t**3/3 + z*t)", "1/(2*pi)", "t", "-oo", "oo", order=1)
    found = waves.bind(z=z).evaluate(8, dps=20)
    with mp.workdps(30):
        assert abs(found - mp.airyai(4 * number(z)) / 2) < 1e-20


@pytest.mark.parametrize(("nu", "z"), [("40", "1"), ("40.3", "0.9"), ("40.3", "1.2")])
def test_oscillating_with_ends(nu: str, z: str) -> None:
    """Over [-pi, pi] it's Bessel's function for whole orders, else Anger's; the ends count."""
    found = sa.uniform_integral("I*(z*sin(t) - t)", "1/(2*pi)", "t", "-pi", "pi", order=3)
    found = found.bind(z=z).evaluate(nu, dps=20, full=True)
    with mp.workdps(25):
        y = number(nu)
        marks = mp.linspace(0, mp.pi, 16)
        exact = mp.quad(lambda t: mp.cos(y * (t - number(z) * mp.sin(t))), marks) / mp.pi
        assert abs(found.value - exact) <= found.error < 1e-7


@pytest.mark.parametrize("c", ["1/4", "0", "-1/4"])
def test_passage_through_a_saddle_node(c: str) -> None:
    """It is Ai² + Bi² (DLMF 9.11.4)."""
    law = sa.uniform_integral("c*x - x**3/3", (1, 1), "x", "-oo", "oo", order=2).bind(c=c)
    found = law.evaluate(20, dps=20, full=True)
    with mp.workdps(30):
        z = mp.mpf(20) ** (mp.mpf(2) / 3) * number(c)
        exact = mp.pi**2 * (mp.airyai(z) ** 2 + mp.airybi(z) ** 2) / mp.mpf(20) ** (mp.mpf(2) / 3)
        assert abs(found.value - exact) <= found.error < 1e-8 * exact


@pytest.mark.parametrize("f", ["-x**3/3 + x/10 - x**4/20", "-x**3/3 + x**4/15", "x**3/3 - x/5"])
def test_iterated_against_quadrature(f: str) -> None:
    """Nested Gauss rules on panels, with the exponent taken out of each."""
    of = eval(f"lambda x: {f}")
    nodes, weights = np.polynomial.legendre.leggauss(16)
    legendre, lam = np.polynomial.legendre, 60
    up = np.array([
        legendre.legval(nodes, legendre.legint(row, lbnd=-1))
        for row in np.linalg.inv(legendre.legvander(nodes, 15)).T
    ]).T  # fmt: skip
    edges = np.linspace(-1, 1, 2001)
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    v = middle[:, None] + half[:, None] * nodes
    rise = lam * (of(v) - of(edges[:-1])[:, None])
    inner, outer = np.exp(v / 2 - rise), np.exp(rise) / (2 + v)
    own = half**2 * ((outer * (inner @ up.T)) @ weights)
    inner, outer = half * (inner @ weights), half * (outer @ weights)
    total = before = 0.0
    for k, step in enumerate(np.exp(lam * np.diff(of(edges)))):
        total += own[k] + outer[k] * before
        before = step * (before + inner[k])
    for order in (1, 4):
        expansion = sa.uniform_integral(f, ("exp(x/2)", "1/(2 + x)"), "x", -1, 1, order=order)
        found = expansion.evaluate(lam, full=True)
        assert abs(found.value - total) <= found.error + 1e-11 * total
    assert found.error < 1e-3 * total


def test_arrays_logs_and_refusals() -> None:
    pair = gamma(4).bind(mu="1.01")
    values = pair.evaluate([50.0, 100.0], full=True)
    assert abs(values.value[1] - float(pair.evaluate(100, dps=20))) <= values.error[1]
    assert pair.evaluate(10**6, log=True) < -1e6
    with pytest.raises(sa.RangeError, match="log=True"):
        pair.evaluate(10**6)
    wave = sa.uniform_integral("I*(t**3/3 - t)", 1, "t", "-oo", "oo")
    assert isinstance(wave.evaluate(5), complex)
    with pytest.raises(AccuracyError, match="complex"):
        sa.uniform_integral("I*t**3", "1 + t", "t", 0, 1).evaluate(5, log=True)
    with pytest.raises(InputError, match="call bind"):
        gamma(2).evaluate(3)
    with pytest.raises(InputError, match="diverges"):
        sa.uniform_integral("x**2", 1, "x", "-oo", "oo").evaluate(3)
    with pytest.raises(InputError, match="no two saddles"):
        sa.uniform_integral("t", 1, "t", "oo - I*pi", "oo + I*pi").evaluate(3)
    with mpmath.workdps(4):
        first = pair.evaluate(30, dps=20)
    assert pair.evaluate(30, dps=20) == first
