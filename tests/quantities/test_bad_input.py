"""Bad input gets one sentence: the value, the rule, what to do."""

from __future__ import annotations

import re
from collections.abc import Callable
from decimal import Decimal
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa

FRICTION = sa.friction(mu=3, alpha=1, z0="-0.4")
SLIDING = sa.linear(1, -1)
U = sympy.Symbol("u")

# name: (call, error, what the sentence must name)
CASES: dict[str, tuple[Callable[[], Any], type[Exception], str]] = {
    "kappa 0": (lambda: sa.escape_time(FRICTION, 0, 10), sa.InputError, "kappa is 0"),
    "kappa < 0": (lambda: sa.escape_time(FRICTION, "-0.1", 10, dps=9), sa.InputError, "-0.1"),
    "r 0": (lambda: sa.escape_time(FRICTION, 1, 0), sa.InputError, "r is 0"),
    "r < 0 in an array": (lambda: sa.escape_time(FRICTION, 1, [1, -2]), sa.InputError, "-2"),
    "nan": (lambda: sa.escape_time(FRICTION, float("nan"), 1), sa.InputError, "nan"),
    "inf": (lambda: sa.escape_time(FRICTION, 1, np.inf), sa.InputError, "inf"),
    "nan entry": (lambda: sa.escape_time(FRICTION, [1, np.nan], 1), sa.InputError, "nan"),
    "decimal nan": (lambda: sa.escape_time(FRICTION, Decimal("nan"), 1), sa.InputError, "finite"),
    "mpf inf": (lambda: sa.escape_time(FRICTION, mpmath.inf, 1), sa.InputError, "inf"),
    "empty": (lambda: sa.escape_time(FRICTION, [], 1), sa.InputError, "empty"),
    "empty parameter": (lambda: sa.friction(mu=3, alpha=1, z0=[]), sa.InputError, "empty"),
    "shapes": (
        lambda: sa.escape_time(FRICTION.bind(z0=[1.0, 2, 3]), [1.0, 2], 9),
        sa.InputError,
        r"\(3,\)",
    ),
    "shapes, with digits": (
        lambda: sa.escape_time(FRICTION, [1, 2], [1, 2, 3], dps=20),
        sa.InputError,
        r"\(3,\)",
    ),
    "shapes, no region": (
        lambda: sa.stationary_density(sa.linear(1, 1), [0.1, 0.5], [1.0, 2, 3]),
        sa.InputError,
        "broadcast",
    ),
    "parameter shapes": (
        lambda: sa.friction(mu=[1.0, 2], alpha=1, z0=[1.0, 2, 3]),
        sa.InputError,
        "broadcast",
    ),
    "ragged": (lambda: sa.escape_time(FRICTION, [[1, 2], [3]], 1), sa.InputError, "ragged"),
    "text": (lambda: sa.escape_time(FRICTION, "abc", 1), sa.InputError, "'abc'"),
    "complex": (lambda: sa.escape_time(FRICTION, 1j, 1), sa.InputError, "real"),
    "complex array": (lambda: sa.escape_time(FRICTION, np.array([1j]), 1), sa.InputError, "real"),
    "mpc": (lambda: sa.escape_time(FRICTION, mpmath.mpc(1, 1), 1), sa.InputError, "real"),
    "irrational": (lambda: sa.escape_time(FRICTION, sympy.sqrt(2), 1), sa.InputError, "rational"),
    "truth value": (lambda: sa.escape_time(FRICTION, True, 1), sa.InputError, "True"),
    "None": (lambda: sa.escape_time(FRICTION, None, 1), sa.InputError, "None"),
    "no drift": (lambda: sa.escape_time(None, 1, 1), sa.InputError, "Drift"),
    "no drift, sliding": (lambda: sa.occupation(None, 1), sa.InputError, "Drift"),
    "no drift, paper": (lambda: sa.escape_time(None, 1, 1, method="paper"), sa.InputError, "Drift"),
    "free": (lambda: sa.escape_time(sa.friction(mu=3), 1, 1), sa.InputError, "alpha, z0"),
    "unknown parameter": (lambda: FRICTION.bind(nu=1), sa.InputError, "nu"),
    "dps 0": (lambda: sa.escape_time(FRICTION, 1, 1, dps=0), sa.InputError, "dps is 0"),
    "dps 2.5": (lambda: sa.escape_time(FRICTION, 1, 1, dps=2.5), sa.InputError, "2.5"),
    "dps 20000": (lambda: sa.escape_time(FRICTION, 1, 1, dps=20000), sa.InputError, "20000"),
    "pole": (lambda: sa.Drift("1/(u - 1/3)"), sa.InputError, "0.333333"),
    "pole, bound later": (lambda: sa.Drift("1/(u-c)").bind(c="0.5"), sa.InputError, "0.5"),
    "pole in an array": (
        lambda: sa.escape_time(sa.Drift("1/(u-c)").bind(c=[0.5, 3.0]), 1, 10),
        sa.SymasymError,
        "finite|singular",
    ),
    "complex A": (lambda: sa.Drift("sqrt(u)"), sa.InputError, "complex"),
    "branch point at the edge": (lambda: sa.Drift("sqrt(u+1)"), sa.InputError, "u = -1"),
    "kink": (lambda: sa.Drift(sympy.Abs(U)), sa.InputError, "Abs"),
    "unreadable": (lambda: sa.Drift("1+"), sa.InputError, r"1\+"),
    "jump": (lambda: sa.Drift(1 - U, U, a_minus=2, a_plus=1), sa.InputError, "is 0 but a. is 1"),
    "a jump of 1e-35 between irrational ends": (
        lambda: sa.Drift("exp(u)", a_minus="exp(-1)*(1 + 10**-35)"),
        sa.InputError,
        "A jumps at u = -1",
    ),
    "no u": (lambda: sa.Drift("x+1"), sa.InputError, "no symbol u"),
    "not sliding": (lambda: sa.occupation(FRICTION, 1), sa.RegionError, "2.4"),
    "density, not sliding": (
        lambda: sa.stationary_density(FRICTION, 1, 0),
        sa.RegionError,
        "sliding",
    ),
    "tangency": (lambda: sa.friction(mu=3, alpha=1, z0=0).region, sa.RegionError, "tangency"),
    "overflow": (lambda: sa.escape_time(FRICTION, "1e-4", 10), sa.RangeError, "log=True"),
    "underflow": (lambda: sa.exit_probability(FRICTION, "1e-4", 10), sa.RangeError, "log=True"),
    "overflow in an array": (
        lambda: sa.escape_time(FRICTION, [1e-4, 1], 10),
        sa.RangeError,
        "log=True",
    ),
    "start at r": (lambda: sa.escape_time(FRICTION, 1, 1, start=1), sa.InputError, "inside"),
    "start beyond r": (
        lambda: sa.escape_time(FRICTION, 1, 1, start=[0, 2.0]),
        sa.InputError,
        "start is 2",
    ),
    "method": (lambda: sa.escape_time(FRICTION, 1, 1, method="foo"), sa.InputError, "'foo'"),
    "order": (lambda: sa.escape_time(FRICTION, 1, 1, order=2), sa.InputError, "order is 2"),
    "mu < 0": (lambda: sa.friction(mu=-1), sa.InputError, "mu is -1"),
    "alpha 0, bound later": (lambda: FRICTION.bind(alpha=0), sa.InputError, "alpha is 0"),
    "K < 0": (lambda: sa.hill(1, 2, K=-1), sa.InputError, "K is -1"),
    "n 2.5": (lambda: sa.hill(1, 2, K=1, n=2.5), sa.InputError, "n is 2.5"),
    "waves 0": (lambda: sa.sine(1, 1, 1, waves=0), sa.InputError, "waves is 0"),
    "no coefficients": (lambda: sa.polynomial(), sa.InputError, "coefficients"),
    "paper, sliding": (
        lambda: sa.escape_time(SLIDING, 1, 10, method="paper"),
        sa.RegionError,
        "crossing",
    ),
    "paper, four zeros": (
        lambda: sa.escape_time(sa.sine(1, 1, 4, waves=2), 1, 10, method="paper"),
        sa.InputError,
        "4 zeros",
    ),
    "paper, start": (
        lambda: sa.escape_time(FRICTION, 1, 10, start="0.1", method="paper"),
        sa.InputError,
        "start is 0.1",
    ),
    "eps 0": (lambda: sa.rescale(eps=0, kappa=1, r=1), sa.InputError, "eps is 0"),
    "eps entry < 0": (lambda: sa.rescale(eps=[1.0, -1], kappa=1), sa.InputError, "-1"),
    "too small for float64": (
        lambda: sa.escape_time(FRICTION, "1e-400", 1),
        sa.InputError,
        "1e±300",
    ),
    "2/kappa^2 overflows": (lambda: sa.escape_time(FRICTION, 1e-200, 1), sa.InputError, "1e-200"),
    "2/kappa^2 underflows": (lambda: sa.escape_time(FRICTION, 1e200, 1), sa.InputError, "1e.200"),
    "start inside, but not in float64": (
        lambda: sa.escape_time(FRICTION, 1, 1, start="0.99999999999999999999"),
        sa.InputError,
        "start",
    ),
    "n is text": (lambda: sa.hill(1, 2, 1, n="x"), sa.InputError, "n is 'x'"),
    "n is None": (lambda: sa.hill(1, 2, 1, n=None), sa.InputError, "n is None"),
    "n is nan": (lambda: sa.hill(1, 2, 1, n=float("nan")), sa.InputError, "n is nan"),
    "waves inf": (lambda: sa.sine(1, 2, 1, waves=float("inf")), sa.InputError, "waves is inf"),
    "waves true": (lambda: sa.sine(1, 2, 1, waves=True), sa.InputError, "waves is True"),
    "degree and order": (lambda: sa.polynomial(1, c1=2), sa.InputError, "coefficients"),
    "no coefficient": (lambda: sa.polynomial(d1=2), sa.InputError, "d1"),
    "K 0, bound later": (
        lambda: sa.escape_time(sa.hill(1, 2).bind(K=0), 1, 2),
        sa.InputError,
        "K is 0",
    ),
    "steepness 0, bound later": (
        lambda: sa.escape_time(sa.tanh(1, 2).bind(steepness=0), 1, 2),
        sa.InputError,
        "steepness",
    ),
    "mu < 0, bound later": (lambda: sa.friction().bind(mu="-1/3"), sa.InputError, "mu is -0.33"),
    "K in an array": (lambda: sa.hill(1, 2).bind(K=[1.0, -2.0]), sa.InputError, "K"),
    "huge and negative": (
        lambda: sa.escape_time(FRICTION, -(10**5000), 1, dps=20),
        sa.InputError,
        "kappa is -1e5000",
    ),
    "signalling nan": (
        lambda: sa.escape_time(FRICTION, Decimal("sNaN"), 1),
        sa.InputError,
        "kappa is Dec",
    ),
    "set": (lambda: sa.escape_time(FRICTION, {1}, 1), sa.InputError, r"kappa is \{1\}"),
    "generator": (
        lambda: sa.escape_time(FRICTION, (x for x in (1, 2)), 1),
        sa.InputError,
        "generator",
    ),
    "symbol": (lambda: sa.escape_time(FRICTION, U, 1), sa.InputError, "kappa is u"),
    "bytes": (lambda: sa.escape_time(FRICTION, b"1", 1), sa.InputError, "b'1'"),
    "division by zero in text": (lambda: sa.escape_time(FRICTION, "1/0", 1), sa.InputError, "1/0"),
    "drift called with text": (lambda: FRICTION("x"), sa.InputError, "u is 'x'"),
    "drift called, shapes": (
        lambda: FRICTION.bind(z0=[1.0, 2.0, 3.0])([0.1, 0.2]),
        sa.InputError,
        "broadcast",
    ),
    "drift called, free": (lambda: sa.friction()(0), sa.InputError, "mu, alpha, z0"),
    "density, y text": (lambda: sa.stationary_density(SLIDING, 1, "y"), sa.InputError, "y is 'y'"),
    "density, y complex": (lambda: sa.stationary_density(SLIDING, 1, 1j), sa.InputError, "1j"),
    "sliding in part of an array": (
        lambda: sa.occupation(sa.linear(1, [-1.0, 2.0]), 1),
        sa.RegionError,
        r"a\+ = 2",
    ),
    "tangency, sine": (lambda: sa.sine(0, 1, 1).region, sa.RegionError, "tangency"),
    "tangency, an array": (lambda: sa.linear([1.0, 0.0], 1).region, sa.RegionError, "tangency"),
    "occupation at a tangency": (
        lambda: sa.occupation(sa.sine(0, -1, 1), 1),
        sa.RegionError,
        "a- = 0",
    ),
    "A a list": (lambda: sa.Drift("[1, 2]"), sa.InputError, "A is"),
    "A a truth value": (lambda: sa.Drift("True"), sa.InputError, "A is"),
    "A None": (lambda: sa.Drift(None), sa.InputError, "A is None"),
    "A a function": (lambda: sa.Drift(lambda u: u), sa.InputError, "A is <function"),
    "A text in quotes": (lambda: sa.Drift("'abc'"), sa.InputError, "A is"),
    "A imaginary": (lambda: sa.Drift("I*u"), sa.InputError, "I"),
    "A infinite": (lambda: sa.Drift("1/0"), sa.InputError, "zoo"),
    "A a relation": (lambda: sa.Drift("u > 0"), sa.InputError, "u > 0"),
    "A a matrix": (lambda: sa.Drift("Matrix([u])"), sa.InputError, "Matrix"),
    "A piecewise": (
        lambda: sa.Drift("Piecewise((u, u > 0), (0, True))"),
        sa.InputError,
        "Piecewise",
    ),
    "A of a function unknown": (lambda: sa.Drift("foo(u)"), sa.InputError, "foo"),
    "A and a number for u": (lambda: sa.Drift("1 - u", 5), sa.InputError, "5"),
    "jump, nan": (lambda: sa.Drift("1 - u", a_minus=float("nan")), sa.InputError, "nan"),
    "complex power": (lambda: sa.Drift("(u - 2)**(1/3)"), sa.InputError, "complex"),
    "log of a negative": (
        lambda: sa.Drift("log(u/2)"),
        sa.InputError,
        "singular, complex or too steep",
    ),
    "a corner": (lambda: sa.Drift("sqrt(u**2)"), sa.InputError, "u = "),
    "a corner elsewhere": (lambda: sa.Drift("sqrt((u - 1/3)**2)"), sa.InputError, "u = 0.333"),
    "huge coefficients": (
        lambda: sa.escape_time(sa.Drift("10**400*u"), 1, 10),
        sa.SymasymError,
        "1e±300",
    ),
    "paper, drift is no drift": (
        lambda: sa.occupation(3, 1, method="paper"),
        sa.InputError,
        "drift is 3",
    ),
    "paper, shapes": (
        lambda: sa.escape_time(FRICTION, [1.0, 2.0], [1.0, 2.0, 3.0], method="paper"),
        sa.InputError,
        "broadcast",
    ),
    "critical points of nothing": (
        lambda: sa.polynomial(0).critical_points(),
        sa.AccuracyError,
        "A is 0",
    ),
    "rescale overflows": (
        lambda: sa.rescale([1e-300], [1e200], 1.0),
        sa.InputError,
        "float64",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_one_sentence(name: str) -> None:
    call, error, pattern = CASES[name]
    with pytest.raises(error, match=pattern) as caught:
        call()
    message = str(caught.value)
    assert message.endswith(".")
    assert "\n" not in message
    assert len(message) < 400
    # one sentence: no full stop, question or exclamation mark before another one begins
    assert not re.search(r"[.!?] +[A-Z]", message)
    assert isinstance(caught.value, sa.SymasymError)
    # the cause is told in the sentence, not in a traceback below it
    assert caught.value.__cause__ is None
    assert caught.value.__suppress_context__ or caught.value.__context__ is None


@pytest.mark.parametrize("digits", [3000, 9000])
def test_long_numbers_are_not_printed_in_full(digits: int) -> None:
    for bad in (f"0.{'3' * digits}x", f"-0.{'3' * digits}", -(10**digits)):
        with pytest.raises(sa.InputError, match="kappa") as caught:
            sa.escape_time(FRICTION, bad, 1, dps=20)
        assert len(str(caught.value)) < 400


def test_a_long_expression_is_quoted_in_part() -> None:
    names = [f"a{i}" for i in range(900)]
    for call in (
        lambda: sa.laplace_integral(" + ".join(names), 1, "x", -1, 1),
        lambda: sa.escape_time(sa.Drift("u*(" + " + ".join(names) + ")"), 1, 10),
    ):
        with pytest.raises(sa.InputError, match=r"a1 \+|a0, a1") as caught:
            call()
        assert re.search(r" \.\.\. .*; (give an f that|set them with)", str(caught.value))
        assert len(str(caught.value)) < 1000


def test_a_refusal_in_one_thread_leaves_the_next_call_alone() -> None:
    before = sa.escape_time(FRICTION, 1, 10, dps=30)
    for name in ("pole", "2/kappa^2 overflows", "overflow", "density, not sliding"):
        call, error, _ = CASES[name]
        with pytest.raises(error):
            call()
    assert sa.escape_time(FRICTION, 1, 10, dps=30) == before


def test_errors_are_the_fitting_builtins() -> None:
    assert issubclass(sa.InputError, ValueError)
    assert issubclass(sa.RegionError, ValueError)
    assert issubclass(sa.AccuracyError, ArithmeticError)
    assert issubclass(sa.RangeError, OverflowError)
    assert issubclass(sa.OutputError, OSError)


# -- anything at all -------------------------------------------------------------------------------

SLIDING_LINE = sa.linear(1, -1)
TAKERS: dict[str, Callable[[Any], Any]] = {
    "kappa": lambda x: sa.escape_time(FRICTION, x, 10),
    "kappa, dps": lambda x: sa.escape_time(FRICTION, x, 10, dps=15),
    "kappa, paper": lambda x: sa.escape_time(FRICTION, x, 10, method="paper"),
    "r": lambda x: sa.escape_time(FRICTION, 1, x),
    "r, dps": lambda x: sa.exit_probability(FRICTION, 1, x, dps=15, log=True),
    "start": lambda x: sa.escape_time(FRICTION, 1, 10, start=x),
    "dps": lambda x: sa.escape_time(FRICTION, 1, 10, dps=x),
    "method": lambda x: sa.occupation(SLIDING_LINE, 1, method=x),
    "order": lambda x: sa.escape_time(FRICTION, 1, 10, order=x),
    "drift": lambda x: sa.escape_time(x, 1, 10),
    "drift, occupation": lambda x: sa.occupation(x, 1),
    "drift, density": lambda x: sa.stationary_density(x, 1, 0),
    "occupation": lambda x: sa.occupation(SLIDING_LINE, x),
    "y": lambda x: sa.stationary_density(SLIDING_LINE, 1, x, log=True),
    "mu": lambda x: sa.friction(x, 1, 1),
    "z0": lambda x: FRICTION.bind(z0=x),
    "waves": lambda x: sa.sine(1, 1, 1, waves=x),
    "n": lambda x: sa.hill(1, 2, 1, n=x),
    "K": lambda x: sa.hill(1, 2, x),
    "coefficient": lambda x: sa.polynomial(x),
    "u of a call": lambda x: FRICTION(x),
    "A": lambda x: sa.Drift(x),
    "u": lambda x: sa.Drift("1-u", x),
    "a-": lambda x: sa.Drift("1-u", a_minus=x),
    "eps": lambda x: sa.rescale(x, 1, 1),
    "kappa, rescale": lambda x: sa.rescale("0.01", x, 1),
    "label": lambda x: sa.formula(x),
    "f": lambda x: sa.laplace_integral(x, 1, "x", -1, 1, 2),
    "g": lambda x: sa.laplace_integral("-x**2", x, "x", -1, 1, 2),
    "x": lambda x: sa.laplace_integral("-x**2", 1, x, -1, 1, 2),
    "a": lambda x: sa.laplace_integral("-x**2", 1, "x", x, 1, 2),
    "order, integral": lambda x: sa.laplace_integral("-x**2", 1, "x", -1, 1, x),
}
ANYTHING: list[Any] = [
    None, [], (), {}, set(), b"1", object(), type, lambda: 1, slice(1), range(3), ..., True,
    float("nan"), float("inf"), -1, 0, 10**400, -(10**400), 5e-324, 1.7e308, 1j,
    "", "abc", "1/0", "nan", "1e999999999", "\uff11", " 0.5 ", "0x10", "1_000", "+-1", "--1",
    Decimal("NaN"), Decimal("Infinity"), sympy.oo, sympy.sqrt(2), U,
    mpmath.inf, mpmath.nan, mpmath.mpc(1, 2),
    np.array([]), np.array([np.nan]), np.array(["a"]), np.array([1j]), np.array(0.5),
    np.array([[1, 2], [3]], dtype=object), np.array([True]), np.array([1e-320]),
    np.datetime64("2020-01-01"), np.longdouble(1) / 3, np.float16(np.inf),
    np.ma.MaskedArray([1.0, 2.0], mask=[False, True]), [None], [[1, 2], [3]], ["1", "x"],
]  # fmt: skip


@pytest.mark.parametrize("name", TAKERS)
def test_anything_is_taken_or_refused_in_one_sentence(name: str) -> None:
    for value in ANYTHING:
        try:
            found = TAKERS[name](value)
        except sa.SymasymError as error:
            message = str(error)
            assert message.endswith("."), message
            assert "\n" not in message, message
            assert len(message) < 400, message
        else:
            if isinstance(found, (float, np.ndarray)):
                assert all(map(mpmath.isfinite, np.ravel(found))), value
