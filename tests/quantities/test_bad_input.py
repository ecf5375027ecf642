"""Bad input gets one sentence and the error that fits it."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from tests.searches.test_calls import EXTREME, WRONG

FRICTION = sa.friction(mu=3, alpha=1, z0="-0.4")
SLIDING = sa.linear(1, -1)
CASES: dict[type[Exception], dict[str, Callable[[], Any]]] = {
    sa.InputError: {
        "kappa 0": lambda: sa.escape_time(FRICTION, 0, 10),
        "kappa < 0": lambda: sa.escape_time(FRICTION, "-0.1", 10, dps=9),
        "r 0": lambda: sa.escape_time(FRICTION, 1, 0),
        "r < 0 in an array": lambda: sa.escape_time(FRICTION, 1, [1, -2]),
        "shapes": lambda: sa.escape_time(FRICTION.bind(z0=[1.0, 2, 3]), [1.0, 2], 9),
        "shapes, density": lambda: sa.stationary_density(SLIDING, [0.1, 0.5], [1.0, 2, 3]),
        "shapes, paper": lambda: sa.escape_time(FRICTION, [1, 2], [1, 2, 3], method="paper"),
        "shapes of parameters": lambda: sa.friction(mu=[1.0, 2], alpha=1, z0=[1.0, 2, 3]),
        "an array with dps": lambda: sa.escape_time(FRICTION, [0.1, 1.0], 10, dps=20),
        "ragged": lambda: sa.escape_time(FRICTION, [[1, 2], [3]], 1),
        "free": lambda: sa.escape_time(sa.friction(mu=3), 1, 1),
        "unknown parameter": lambda: FRICTION.bind(nu=1),
        "dps 20000": lambda: sa.escape_time(FRICTION, 1, 1, dps=20000),
        "start at r": lambda: sa.escape_time(FRICTION, 1, 1, start=1),
        "start beyond r": lambda: sa.escape_time(FRICTION, 1, 1, start=[0, 2.0]),
        "order without a use": lambda: sa.escape_time(FRICTION, 1, 1, order=2),
        "rtol without a use": lambda: sa.escape_time(FRICTION, 1, 1, rtol=0.1),
        "paper, four zeros": lambda: sa.escape_time(
            sa.sine(1, 1, 4, waves=2), 1, 10, method="paper"
        ),
        "paper, start": lambda: sa.escape_time(FRICTION, 1, 10, start="0.1", method="paper"),
        "steepness 0": lambda: sa.tanh(1, 2).bind(steepness=0),
        "K < 0 in an array": lambda: sa.hill(1, 2).bind(K=[1.0, -2.0]),
        "no coefficients": lambda: sa.polynomial(),
        "coefficients twice": lambda: sa.polynomial(1, c1=2),
        "pole": lambda: sa.Drift("1/(u - 1/3)"),
        "pole, bound later": lambda: sa.Drift("1/(u-c)").bind(c="0.5"),
        "complex": lambda: sa.Drift("sqrt(u)"),
        "complex power": lambda: sa.Drift("(u - 2)**(1/3)"),
        "branch point at the edge": lambda: sa.Drift("sqrt(u+1)"),
        "log of a negative": lambda: sa.Drift("log(u/2)"),
        "kink": lambda: sa.Drift(sympy.Abs(sympy.Symbol("u"))),
        "a corner": lambda: sa.Drift("sqrt((u - 1/3)**2)"),
        "piecewise": lambda: sa.Drift("Piecewise((u, u > 0), (0, True))"),
        "infinite": lambda: sa.Drift("1/0"),
        "no u": lambda: sa.Drift("x+1"),
        "noise in a list": lambda: sa.Drift("u", noise=[1]),
        "a long number": lambda: sa.escape_time(FRICTION, f"-0.{'3' * 9000}", 1, dps=20),
    },
    sa.RegionError: {
        "not sliding": lambda: sa.occupation(FRICTION, 1),
        "density, not sliding": lambda: sa.stationary_density(FRICTION, 1, 0),
        "occupation at a tangency": lambda: sa.occupation(sa.sine(0, -1, 1), 1),
        "tangency": lambda: sa.friction(mu=3, alpha=1, z0=0).region,
        "tangency in an array": lambda: sa.linear([1.0, 0.0], 1).region,
        "paper, sliding": lambda: sa.escape_time(SLIDING, 1, 10, method="paper"),
    },
    sa.RangeError: {
        "overflow": lambda: sa.escape_time(FRICTION, "1e-4", 10),
        "underflow": lambda: sa.exit_probability(FRICTION, "1e-4", 10),
        "overflow of a logarithm": lambda: sa.escape_time(
            FRICTION, "1e-170", 10, log=True, full=True
        ),
    },
    sa.AccuracyError: {
        "zero everywhere": lambda: sa.polynomial(0).critical_points(),
        "too strong a noise": lambda: sa.escape_time(FRICTION, 3, 10, method="laplace"),
        "too weak a noise": lambda: sa.escape_time(FRICTION, "0.05", 10, method="strong_noise"),
    },
}


@pytest.mark.parametrize(
    ("error", "name"), [(error, name) for error, cases in CASES.items() for name in cases]
)
def test_one_sentence(error: type[Exception], name: str) -> None:
    with pytest.raises(error) as caught:
        CASES[error][name]()
    message = str(caught.value)
    assert re.fullmatch(r"[^\n]{20,400}\.", message)
    assert caught.value.__suppress_context__ or caught.value.__context__ is None


def test_errors_are_the_fitting_builtins() -> None:
    pairs = {sa.InputError: ValueError, sa.RegionError: ValueError, sa.RangeError: OverflowError,
             sa.AccuracyError: ArithmeticError, sa.OutputError: OSError}  # fmt: skip
    assert all(issubclass(own, builtin) for own, builtin in pairs.items())


TAKERS: dict[str, Callable[[Any], Any]] = {
    "kappa": lambda x: sa.escape_time(FRICTION, x, 10),
    "kappa, dps": lambda x: sa.escape_time(FRICTION, x, 10, dps=15),
    "r": lambda x: sa.escape_time(FRICTION, 1, x),
    "start": lambda x: sa.escape_time(FRICTION, 1, 10, start=x),
    "dps": lambda x: sa.escape_time(FRICTION, 1, 10, dps=x),
    "dps, Stokes": lambda x: sa.stokes_multiplier(FRICTION, 1, dps=x),
    "method": lambda x: sa.occupation(SLIDING, 1, method=x),
    "order": lambda x: sa.escape_time(FRICTION, 1, 10, method="laplace", order=x),
    "drift": lambda x: sa.escape_time(x, 1, 10),
    "y": lambda x: sa.stationary_density(SLIDING, 1, x, log=True),
    "mu": lambda x: sa.friction(x, 1, 1),
    "waves": lambda x: sa.sine(1, 1, 1, waves=x),
    "n": lambda x: sa.hill(1, 2, 1, n=x),
    "u of a call": lambda x: FRICTION(x),
    "A": lambda x: sa.Drift(x),
    "eps": lambda x: sa.rescale(x, 1, 1),
    "f": lambda x: sa.laplace_integral(x, 1, "x", -1, 1, 2),
    "order, integral": lambda x: sa.laplace_integral("-x**2", 1, "x", -1, 1, x),
}


@pytest.mark.parametrize("name", TAKERS)
def test_anything_is_taken_or_refused_in_one_sentence(name: str) -> None:
    for value in [*WRONG, *EXTREME[18:]]:
        try:
            found, told = TAKERS[name](value), "taken, or so."
        except sa.SymasymError as error:
            found, told = None, str(error)
        assert re.fullmatch(r"[^\n]{10,400}\.", told)
        if isinstance(found, (float, np.ndarray)):
            assert all(map(mpmath.isfinite, np.ravel(found))), value
