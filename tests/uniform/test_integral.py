"""Integrals with coalescing saddles and ends, against special functions and quadrature."""

from __future__ import annotations

from typing import Any

import pytest
from mpmath import mp, mpf

import symasym as sa

#: f, g, x, a, b, and a point beside the saddles.
CASES: dict[str, Any] = {
    "Bessel": ("z*sinh(t) - t", "1/(2*pi*I)", "t", "oo - I*pi", "oo + I*pi", 0),
    "Airy": ("t**3/3 - z*t", "1/(2*pi*I)", "t", "oo*exp(-I*pi/3)", "oo*exp(I*pi/3)", 0),
    "gamma": ("log(x) - x", "1/x", "x", "z", "oo", 1),
}

#: g and ends that leave the integral complex, or are no path between valleys.
PATHS = [(1, "t", "oo - I*pi", "oo + I*pi"), ("I", "t", "-I", "I"),
         ("I", "t", "oo + I*pi", "oo - I*pi"), ("I", "t", "oo - 3*I*pi", "oo + 3*I*pi"),
         ("I", "t", "-oo - I*pi", "-oo + I*pi")]  # fmt: skip


EXACT: dict[str, Any] = {
    "Bessel": lambda lam, z: mp.besselj(lam, lam * z),
    "Airy": lambda lam, z: mp.airyai(mp.cbrt(lam) ** 2 * z) / mp.cbrt(lam),
    "gamma": lambda lam, z: mp.gammainc(lam, z * lam) * lam**-lam,
}


@pytest.mark.parametrize(
    ("name", "lam", "zs", "most"),
    [  # the largest error with 1, 2, ... terms
        ("Bessel", 100, "0.5 0.999999999999 1 1.01 2", {1: 4e-3, 4: 4e-11, 7: 4e-16}),
        ("Airy", 8, "-2 0 1", {1: 1e-10}),
        ("gamma", 60, "0.25 0.9 1 1.01 2 10", {1: 1e-2, 4: 3e-9}),
    ],
)
def test_right_and_honest(name: str, lam: float, zs: str, most: dict[int, float]) -> None:
    *integral, near = CASES[name]
    for order in most:
        expansion = sa.uniform_integral(*integral, order=order, near=near)
        for z in zs.split():
            found = expansion.bind(z=z).evaluate(lam, dps=22, full=True)
            assert found.error_kind == "estimate"
            with mp.workdps(40):
                exact = EXACT[name](mpf(lam), mpf(z))
                # J has zeros where z > 1; its envelope has not.
                large = name == "Bessel" and mpf(z) > 1
                size = abs(mp.hypot(exact, mp.bessely(lam, lam * mpf(z))) if large else exact)
                assert abs(found.value - exact) <= found.error < most[order] * size


def test_terms_that_vanish_are_no_proof() -> None:
    """g's zero at the maximum leaves nothing of six orders: the error is the integral itself."""
    found = sa.uniform_integral("-tan(x)**2", "x**30", "x", -1, 1).evaluate(10, full=True)
    with mp.workdps(20):
        marks = mp.linspace(-1, 1, 17)
        exact = mp.quad(lambda z: z**30 * mp.exp(-10 * mp.tan(z) ** 2), marks)
        assert abs(found.value - exact) <= found.error * (1 + mpf(10) ** -9) < 2 * exact
    assert found.error_kind == "bound"


def test_arrays_and_refusals() -> None:
    *integral, near = CASES["gamma"]
    pair = sa.uniform_integral(*integral, order=4, near=near).bind(z="1.01")
    values = pair.evaluate([50.0, 100.0], full=True)
    assert abs(values.value[1] - float(pair.evaluate(100, dps=20))) <= values.error[1]
    assert pair.evaluate(10**6, log=True) < -1e6
    waves = "*".join(f"sin({k}*x)" for k in range(1, 30))
    refused: list[Any] = [
        lambda: pair.evaluate(10**6),
        lambda: sa.uniform_integral(*integral).evaluate(3),
        lambda: sa.uniform_integral("x**2", 1, "x", "-oo", "oo").evaluate(3),
        lambda: sa.uniform_integral("t", 1, "t", "oo - I*pi", "oo + I*pi").evaluate(3),
        lambda: sa.uniform_integral("I*t**3", 1, "t", 0, 1),
        lambda: sa.uniform_integral(waves, 1, "x", -1, 1),
        lambda: sa.uniform_integral("-x**2", 1, "x", "-oo", "-oo"),
        *(lambda e=e: sa.uniform_integral("sinh(t) - t", *e).evaluate(3) for e in PATHS),
        lambda: sa.uniform_integral("-x**2", "1 + I*x", "x", -1, 1),
        lambda: sa.uniform_integral("-x - sqrt((x - 1)**2)/2", 1, "x", 0, 2).evaluate(9),
        lambda: sa.uniform_integral("t**3/3", "I*t**30", "t", "oo*exp(-I*pi/3)", "oo*exp(I*pi/3)"),
    ]
    for call in refused:
        with pytest.raises(sa.SymasymError):
            call()
