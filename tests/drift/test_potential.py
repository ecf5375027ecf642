"""The potential."""

from __future__ import annotations

import math
from collections.abc import Callable
from fractions import Fraction as F
from typing import Any

import mpmath
import numpy as np
import pytest

import symasym as sa

POTENTIALS: dict[str, tuple[Callable[[], sa.Drift], Callable[[Any], Any]]] = {
    # V(u) = -int_{-1}^u A in closed form
    "friction": (
        lambda: sa.friction(3, 1, "-0.3"),
        lambda u: -(mpmath.mpf("1.3") * (u + 1) - 2 * (u**2 - 1) + mpmath.mpf(3) / 4 * (u**4 - 1)),
    ),
    "tanh": (
        lambda: sa.tanh(1, -1, 5),
        lambda u: (mpmath.log(mpmath.cosh(5 * u)) - mpmath.log(mpmath.cosh(5)))
        / (5 * mpmath.tanh(5)),
    ),
    "step": (
        lambda: sa.tanh(1, -1, "1e6"),
        lambda u: (abs(u) - 1 + mpmath.log1p(mpmath.exp(-2e6 * abs(u))) / 1e6),
    ),
    "exponential": (
        lambda: sa.Drift("exp(3*u) - 1"),
        lambda u: -((mpmath.exp(3 * u) - mpmath.exp(-3)) / 3 - u - 1),
    ),
    "peak": (
        lambda: sa.Drift("20*exp(-2000*(u - 1/3)**2)"),
        lambda u: -20 * mpmath.sqrt(mpmath.pi / 2000) / 2 * (
            mpmath.erf(mpmath.sqrt(2000) * (u - mpmath.mpf(1) / 3))
            - mpmath.erf(mpmath.sqrt(2000) * (-mpmath.mpf(4) / 3))
        ),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", POTENTIALS)
def test_potential_in_float64(name: str) -> None:
    make, closed = POTENTIALS[name]
    drift = make()
    u = np.array([-3.0, -1.0, -0.7, 0.0, 0.3, 0.5, 1.0, 4.0])
    found = drift.potential_at(u)
    with mpmath.workdps(30):
        inside = np.array([float(closed(mpmath.mpf(max(-1, min(1, x))))) for x in u])
    a_minus, a_plus = (float(a) for a in drift.ends)
    wanted = inside - a_minus * np.minimum(u + 1, 0) - a_plus * np.maximum(u - 1, 0)
    assert found == pytest.approx(wanted, rel=1e-13, abs=1e-14)
    assert drift.potential_at(0.3) == pytest.approx(wanted[4], rel=1e-13)


@pytest.mark.parametrize(
    "make",
    [
        lambda: sa.friction(3, 1, "-0.3"),
        lambda: sa.hill(1, -2, "1/2"),
        lambda: sa.Drift("u - u**3", layer=None),
    ],
)
def test_symbolic_potential_and_drift_agree(make: Callable[[], sa.Drift]) -> None:
    import sympy

    drift, u = make(), sympy.Symbol("u", real=True)
    V, phi = drift.potential(), drift.phi()
    for x in (F(-3), F(-3, 2), F(-1, 2), F(1, 4), F(5, 4)):
        at = sympy.Rational(x.numerator, x.denominator)
        assert float(V.diff(u).subs(u, at)) == pytest.approx(-float(phi.subs(u, at)))
        assert float(V.subs(u, at)) == pytest.approx(drift.potential_at(float(x)), rel=1e-11)
        assert float(phi.subs(u, at)) == pytest.approx(drift(float(x)))
    assert V.subs(u, -1) == 0


def test_potential_of_free_and_of_array_parameters() -> None:
    import sympy

    free = sa.friction(mu=3, alpha=1).potential()
    assert {s.name for s in free.free_symbols} == {"u", "z0"}
    value = free.subs({sympy.Symbol("z0", real=True): 0, sympy.Symbol("u", real=True): 1})
    assert value == sympy.Integer(-2)
    # SymPy's antiderivative is 0 while the sign of c is unknown.
    wide = sa.Drift("1/(c + u**2)").potential()
    at = {sympy.Symbol("c", real=True): 1, sympy.Symbol("u", real=True): 1}
    assert float(wide.subs(at)) == pytest.approx(-math.pi / 2)
    many = sa.friction(3, 1, [0.0, 1.0, 2.0])
    assert many.potential_at(1.0) == pytest.approx([-2.0, 0.0, 2.0], abs=1e-14)
    assert many.potential_at([[0.0], [1.0]]).shape == (2, 3)
    assert many([[0.0], [1.0]]).shape == (2, 3)
    peaks = sa.Drift("1 + exp(-(10**4*(u - c))**2)").bind(c=[-0.7, 0.3, 0.7])
    assert peaks.potential_at(1.0) == pytest.approx(3 * [-2 - np.pi**0.5 / 1e4], rel=1e-13)
    steep = [sa.tanh(1, -0.5, x).potential_at(0.9) for x in (0.1, 80.0)]  # the first has one panel
    assert sa.tanh(1, -0.5, [0.1, 80.0]).potential_at(0.9) == pytest.approx(steep, rel=1e-13)
    with pytest.raises(sa.AccuracyError, match="too many panels"):
        sa.sine(1, 1, 4, waves=1000).potential_at(0.3)
