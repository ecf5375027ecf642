"""Integrals with coalescing saddles and ends, against special functions and quadrature."""

from __future__ import annotations

from typing import Any

import pytest
from mpmath import mp, mpf

import symasym as sa

GAMMA: Any = ("log(x) - x", "1/x", "x", "z", "oo")


@pytest.mark.parametrize(("order", "most"), [(1, 1e-2), (4, 3e-9)])
def test_right_and_honest(order: int, most: float) -> None:
    expansion = sa.uniform_integral(*GAMMA, order=order, near=1)
    for z in ["0.25", "0.9", "1", "1.01", "2", "10"]:
        found = expansion.bind(z=z).evaluate(60, dps=22, full=True)
        assert found.error_kind == "estimate"
        with mp.workdps(40):
            exact = mp.gammainc(60, mpf(z) * 60) * mpf(60) ** -60
            assert abs(found.value - exact) <= found.error < most * exact


def test_terms_that_vanish_are_no_proof() -> None:
    """g's zero at the maximum leaves nothing of six orders: the error is the integral itself."""
    found = sa.uniform_integral("-tan(x)**2", "x**30", "x", -1, 1).evaluate(10, full=True)
    with mp.workdps(20):
        marks = mp.linspace(-1, 1, 17)
        exact = mp.quad(lambda z: z**30 * mp.exp(-10 * mp.tan(z) ** 2), marks)
        assert abs(found.value - exact) <= found.error * (1 + mpf(10) ** -9) < 2 * exact
    assert found.error_kind == "bound"


def test_arrays_and_refusals() -> None:
    pair = sa.uniform_integral(*GAMMA, order=4, near=1).bind(z="1.01")
    values = pair.evaluate([50.0, 100.0], full=True)
    assert abs(values.value[1] - float(pair.evaluate(100, dps=20))) <= values.error[1]
    assert pair.evaluate(10**6, log=True) < -1e6
    waves = "*".join(f"sin({k}*x)" for k in range(1, 30))
    refused: list[Any] = [
        lambda: pair.evaluate(10**6),
        lambda: sa.uniform_integral(*GAMMA).evaluate(3),
        lambda: sa.uniform_integral("x**2", 1, "x", "-oo", "oo").evaluate(3),
        lambda: sa.uniform_integral("t", 1, "t", "oo - I*pi", "oo + I*pi"),
        lambda: sa.uniform_integral("I*t**3", 1, "t", 0, 1),
        lambda: sa.uniform_integral(waves, 1, "x", -1, 1),
        lambda: sa.uniform_integral("-x**2", 1, "x", "-oo", "-oo"),
        lambda: sa.uniform_integral("-x**2", "1 + I*x", "x", -1, 1),
        lambda: sa.uniform_integral("-x - sqrt((x - 1)**2)/2", 1, "x", 0, 2).evaluate(9),
    ]
    for call in refused:
        with pytest.raises(sa.SymasymError):
            call()
