"""Reduction to one dimension: the friction oscillator and systems of our own."""

from __future__ import annotations

from fractions import Fraction

import pytest
import sympy

from symasym import friction
from symasym.base.errors import InputError
from symasym.drift.reduction import reduce

y, z, s = sympy.symbols("y z s", real=True)
mu, alpha, z0 = sympy.symbols("mu alpha z0", real=True)


def _friction_oscillator():
    common = 1 - z - y
    return reduce(
        (common + alpha, y - 1),
        (common - alpha, y - 1),
        (common - alpha * (s + mu * (s - s**3)), y - 1),
        ((0, 1), (0, 0)),
        (y, z),
        layer=s,
        at={z: z0},
    )


def test_friction_oscillator_gives_the_friction_drift():
    drift, amplitude = _friction_oscillator()
    assert amplitude == 1
    bound, same = (d.bind(mu=3, alpha=1, z0="-0.4") for d in (drift, friction()))
    assert bound.exact_coefficients() == same.exact_coefficients()
    for u in (-3, -0.5, 0.9, 4):
        assert bound(u) == pytest.approx(same(u), rel=1e-14)
        assert bound.potential_at(u) == pytest.approx(same.potential_at(u), rel=1e-13)


def test_friction_oscillator_sliding_field():
    found = _friction_oscillator()
    # Sticking: the block moves with the belt (z' = -1) and y stays 0.
    assert tuple(e.subs(y, 0) for e in found.sliding) == (0, -1)


def test_three_dimensional_relay_with_the_switch_as_second_coordinate():
    """A relay control: x' = y, y' = -x - w - sgn(y) b, w' = -w + y, noise of rank 2."""
    x, v, w, b = sympy.symbols("x v w b", real=True)
    common = (v, -x - w, -w + v)
    plus = (common[0], common[1] - b, common[2])
    minus = (common[0], common[1] + b, common[2])
    inside = (common[0], common[1] - b * sympy.sin(sympy.pi * s / 2), common[2])
    found = reduce(
        minus,
        plus,
        inside,
        ((0, 0), (2, -3), (1, 1)),
        (x, v, w),
        switch=v,
        layer=s,
        at={x: sympy.Rational(1, 5), w: 0},
    )
    drift, amplitude = found
    assert amplitude == sympy.sqrt(13)
    drift = drift.bind(b=1)
    assert drift(-1) == pytest.approx(0.8)
    assert drift(1) == pytest.approx(-1.2)
    assert drift.region == "sliding"
    # Tangent field: x' = 0, y' = 0, w' = -w, whatever the convex share.
    assert tuple(e.subs(v, 0) for e in found.sliding) == (0, 0, -w)


def test_scalar_switch_function_that_is_no_coordinate():
    """h = x + y^2 - 1 in the plane; normal components by the chain rule, checked by hand."""
    x, q = sympy.symbols("x q", real=True)
    plus, minus = (sympy.Integer(-1), q), (sympy.Integer(2), q)
    inside = (sympy.Rational(1, 2) - 3 * s / 2, q)
    found = reduce(
        minus,
        plus,
        inside,
        ((1, 0), (0, 1)),
        (x, q),
        switch=x + q**2 - 1,
        layer=s,
        at={q: sympy.Rational(1, 2)},
    )
    # grad h = (1, 2 q) = (1, 1) at q = 1/2, so f.grad h = f1 + q = f1 + 1/2 and |B| = sqrt 2.
    assert found.amplitude == sympy.sqrt(2)
    assert found.drift.ends == (Fraction(5, 2), Fraction(-1, 2))
    field = [e.subs({x: Fraction(3, 4), q: Fraction(1, 2)}) for e in found.sliding]
    # Tangent to the surface: grad h . field = 0, and the second component is common.
    assert field[0] + field[1] == 0
    assert field[1] == sympy.Rational(1, 2)


@pytest.mark.parametrize(
    "change",
    [
        {"F": (sympy.Integer(1) - s, z)},  # jumps
        {"f_plus": (sympy.Integer(-1),)},
        {"D": ((1, 0),)},
        {"at": {"q": 0}},
        {"at": {"y": 1, "z": 0}},  # not on the surface
        {"switch": y**2},
        {"F": ("1/2 - 3*s/2", "z +")},
        {"f_minus": ("2 + u", z), "f_plus": ("u - 1", z), "F": ("u + 1/2 - 3*s/2", z)},  # two u
    ],
)
def test_refusals(change):
    given = {
        "f_minus": (sympy.Integer(2), z),
        "f_plus": (sympy.Integer(-1), z),
        "F": (sympy.Rational(1, 2) - 3 * s / 2, z),
        "D": ((1,), (0,)),
        "coordinates": (y, z),
        "at": {"z": 0},
        "layer": s,
    } | change
    with pytest.raises(InputError):
        reduce(**given)
