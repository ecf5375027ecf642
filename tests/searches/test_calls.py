"""Random calls of the public functions: an answer or an error of symasym's own, nothing else.

Each call takes sensible arguments, some of which are replaced by extreme numbers or by things of
another type or shape; some answers are asked for more (`AFTER`).
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction as F
from typing import Any

import matplotlib as mpl
import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.base.inputs import shown
from tests.strategies import random_formula

mpl.use("agg")


class Mute:
    """An object that can't even be printed."""

    def __repr__(self) -> str:
        raise RuntimeError


class Frame:
    """Like a table of pandas: no truth value, == by elements."""

    def __eq__(self, other: object) -> Any:
        return np.array([True, False])

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise ValueError("The truth value of a Frame is ambiguous.")


EXTREME: list[Any] = [
    0, -1, "1e-30", "1e-60", 1e-124, "1e-145", 1e-200, "1e-300", 1e15, 1e150, 1e300, "1e-12",
    F(10**40 + 1, 10**40), 1 - 1e-16, "0.99999999999999999999", 2.7e-59, -0.0, 2**63,
    1e308, 5e-324, "1e400", "1e99999", "-1e99999", 10**5000, F(1, 10**5000), Decimal("1E+999999"),
    mpmath.mpf("1e-1000000"), 10**400,
]  # fmt: skip
WRONG: list[Any] = [
    None, True, np.True_, [], [[1, 2], [3]], {}, {1}, object(), slice(1, 2), "abc", "", b"1", 1j,
    math.inf, -math.inf, math.nan, np.array([1.0, 2.0]), np.array([]), np.array(1.0),
    np.array([True, False]), np.array([[1, 2]]), np.array(["a"]), np.array([None]), np.array([1j]),
    np.ma.masked_array([1.0, 2.0], [0, 1]), np.float32(1), np.int8(3), sympy.pi, sympy.Symbol("x"),
    sympy.Rational(1, 3), sympy.oo, sympy.nan, sympy.Integer(2), sympy.true, sympy.Matrix([[1, 2]]),
    sympy.Symbol("x") < 1, mpmath.mpf("0.5"), mpmath.mpc(1, 1), mpmath.inf, range(3), int, ...,
    NotImplemented, "1_000", "0x10", "u", "optimal", "auto", '__import__("os")', "\x00", "é",
    Mute(), Frame(), (1, 2), ["0.1", "0.2"], "9" * 5000, 2.5, sa.Drift, sa.friction(),
    Decimal("NaN"), Decimal("sNaN"), np.datetime64("2020"), np.ones((2, 3)), [[0.1], [0.5]],
]  # fmt: skip

NUMBER = ["0.1", "0.3", 1, 2, "-0.4", "1/3", 5, 0.02, 10, -1, "0.7", 3]
KAPPA, R = ["0.1", 0.3, 1, "2", 0.05, [0.1, 0.5]], [2, 10, "1/2", 0.5]
FLAG, DPS, ORDER = [True, False], [15, 30, None], [0, 1, 2, 4, "optimal", None]
START, RTOL = [0, "0.1", -0.2, [0, 0.1]], [1e-3, "1e-6", None]
METHOD = ["exact", "paper", "laplace", "uniform", "strong_noise", "auto", "bound"]
QUANTITY = ["T", "C", "1 - C", "P", "1 - P", "density"]
ENDS = [-1, 0, 1, "oo", "-oo", "pi", "1/2"]
WEIGHT = [1, "x**2", "1/x", "exp(x)", "x**100", ("1", "x"), "FORMULA x"]
PHASE = ["-x**2", "cos(x)", "-tan(x)**2", "x - x**3/3", "log(x) - x", "a*x", "FORMULA x"]
SYSTEM = [sa.oscillator(3, 1), sa.System("1 - z - u - 3*(u - u**3)", "y - 1", "1 + u**2/2")]
OPTIONS = {"method?": METHOD, "order?": ORDER, "dps?": DPS, "log?": FLAG, "full?": FLAG}
SCENE = {"drift": ["DRIFT"], "kappa": KAPPA, "r": R, "start?": START}
PAIR = [(-1, 1), ("-0.5", 2), (0, [1, 2]), (2, 1)]
EQUATIONS = {
    "f_minus": [("2 - z", "-z")], "f_plus": [("-1 - z", "-z")], "F": [("1/2 - 3*s/2 - z", "-z")],
    "D": [((3, 4), (0, 0))], "coordinates": [("y", "z")], "switch?": ["y"], "layer?": ["s"],
    "at?": [{"z": 0}],
}  # fmt: skip

#: The arguments of each function; those with ? are left out half the time.
CALLS: dict[str, dict[str, list[Any]]] = {
    "escape_time": {**SCENE, **OPTIONS, "rtol?": RTOL, "moment?": [1, 2, 3]},
    "exit_probability": {**SCENE, "complement?": FLAG, **OPTIONS, "rtol?": RTOL},
    "occupation": {"drift": ["SLIDING"], "kappa": KAPPA, "complement?": FLAG, **OPTIONS,
                   "interval?": PAIR, "ends?": PAIR},
    "exit_law": {"drift": ["DRIFT"], "kappa": KAPPA, "ends": PAIR, "start?": START,
                 "reflecting?": ["left", "right"], "dps?": DPS, "full?": FLAG},
    "stationary_density": {"drift": ["SLIDING"], "kappa": KAPPA, "y": START, "dps?": DPS,
                           "log?": FLAG, "full?": FLAG},
    "sensitivity": {**SCENE, "dps?": DPS, "quantity?": QUANTITY},
    "plan": {**SCENE, "rtol?": RTOL},
    "stokes_multiplier": {"drift": ["DRIFT"], "kappa": KAPPA, "dps?": DPS,
                          "method?": ["step", "uniform"]},
    "rescale": {"eps": KAPPA, "kappa": KAPPA, "r": R},
    "laplace_integral": {"f": PHASE, "g": WEIGHT, "x": ["x"], "a": ENDS, "b": ENDS,
                         "order?": [1, 2, 3]},
    "uniform_integral": {"f": PHASE, "g": WEIGHT, "x": ["x"], "a": ENDS, "b": ENDS,
                         "order?": [1, 2, 3], "near?": [0, "1/2"]},
    "formula": {"label": ["eq:Ttilde", "fr1", "folds", "eq:P"]},
    "emit": {"what": ["eq:Ttilde", "fr1", sympy.Symbol("x") ** 2, "eq:S"],
             "target": ["c", "numpy", "latex", "mpmath"], "parameters?": [{"mu": 3}],
             "name?": ["f"]},
    "reduce": EQUATIONS,
    "Drift": {"A": ["1/2 - u + u**3", "exp(-u)*cos(u)", "a*u", "FORMULA u"], "u?": ["u"],
              "layer?": [None, (-1, 1)], "noise?": ["1 + u**2", "2", "FORMULA u"],
              "ito?": [0, "stratonovich"]},
    "friction": {"mu": NUMBER, "alpha": NUMBER, "z0": NUMBER},
    "tanh": {"a_minus": NUMBER, "a_plus": NUMBER, "steepness": NUMBER},
    "sine": {"a_minus": NUMBER, "a_plus": NUMBER, "b": NUMBER, "waves?": [2]},
    "hill": {"a_minus": NUMBER, "a_plus": NUMBER, "K": NUMBER, "n?": [3]},
    "linear": {"a_minus": NUMBER, "a_plus": NUMBER},
    "polynomial": {"c0": NUMBER, "c3": NUMBER},
    "expand": {"drift": ["DRIFT", sa.friction(), sa.linear(), sa.Drift("1/2 - u + b*u**3")],
               "quantity?": QUANTITY, "noise?": ["weak", "strong", "uniform"], "order": [0, 1, 2],
               "case?": ["start well barrier", "well", "start"]},
    "release": {"system": SYSTEM, "kappa": ["0.1", 0.3, 1], "r": [10, 2, "1/2"],
                "eps": ["0.1", 1], "start": [(0, "-0.4"), (0, 0), ("0.1", -0.5)]},
    "oscillator": {"mu": NUMBER, "alpha": NUMBER},
    "System": {"phi": ["1 - z - u", "u - u**3 - z*y", "FORMULA u z y"],
               "velocity": ["y - 1", "-1", "FORMULA y z"], "noise?": ["1", "2 - u", "FORMULA u"]},
    "plot": {"quantity": QUANTITY, "drift": ["DRIFT"], "kappa": [[0.1, 0.5, 1], 0.3],
             "r": [2, 10, [1, 2]], "start?": [0, [0, 0.1]], "method?": METHOD},
}  # fmt: skip
LANDSCAPE: dict[str, list[list[Any]]] = {
    "critical_points": [], "region": [], "phi": [], "potential_at": [NUMBER], "ends": [],
    "__call__": [NUMBER], "__repr__": [], "_repr_latex_": [], "__hash__": [],
}  # fmt: skip
TARGETS = ["c", "numpy", "latex", "javascript", "mpmath"]
#: What an answer may be asked for, with the arguments.
AFTER: dict[str, dict[str, list[list[Any]]]] = {
    "expand": {"latex": [], "__str__": [], "emit": [TARGETS], "evaluate": [KAPPA, R]},
    "laplace_integral": {"evaluate": [[10, "1e3", 50]], "latex": [], "__str__": [],
                         "expression_in": [["n"]], "emit": [TARGETS]},
    "uniform_integral": {"evaluate": [[10, "1e3", 50]], "__str__": []},
    "formula": {"latex": [], "__str__": [], "emit": [TARGETS]},
    "rescale": {"__str__": []},
    "exit_law": {"moment": [[1, 2, 5]], "laplace": [NUMBER], "survival": [NUMBER],
                 "cdf": [NUMBER], "pdf": [NUMBER], "__repr__": []},
    "oscillator": {"frozen": [KAPPA], "drag_time": [KAPPA, KAPPA], "__str__": []},
    "System": {"frozen": [KAPPA], "__str__": []},
    "plan": {"__str__": []},
    "escape_time": {"__str__": [], "__repr__": []},
    "friction": LANDSCAPE,
    **dict.fromkeys(("Drift", "tanh", "sine", "hill", "linear", "polynomial"), LANDSCAPE),
}  # fmt: skip


class Caller:
    """Random arguments, a share of which is spoiled."""

    def __init__(self, draw: random.Random) -> None:
        self.draw, self.spoiled = draw, draw.choice([0.0, 0.05, 0.15])
        self.said: list[str] = []

    def one_of(self, choices: list[Any]) -> Any:
        draw, value = self.draw, self.draw.choice(choices)
        if draw.random() < self.spoiled:
            return draw.choice(EXTREME if draw.random() < 0.5 else WRONG)
        if isinstance(value, str) and value in ("DRIFT", "SLIDING"):
            return self.drift(value == "SLIDING")
        if isinstance(value, str) and value.startswith("FORMULA"):
            return random_formula(draw, 2, value.split()[1:])
        return value

    def drift(self, sliding: bool) -> sa.Drift:
        """A drift, extreme ones among them."""

        def number() -> Any:
            return self.draw.choice(EXTREME[:18] if self.draw.random() < 0.15 else NUMBER)

        a, b, c, d = (number() for _ in range(4))
        if sliding and self.draw.random() < 0.9:
            a, b = self.draw.choice([(1, -1), ("0.3", "-2"), (3, -1)])
        makers: list[Callable[[], sa.Drift]] = [
            lambda: sa.linear(a, b),
            lambda: sa.tanh(a, b, c),
            lambda: sa.sine(a, b, c, waves=self.draw.choice([1, 1, 2, 3])),
            lambda: sa.hill(a, b, c, n=self.draw.choice([1, 2, 4])),
            lambda: sa.friction(a, b, c),
            lambda: sa.polynomial(a, b, c, d),
            lambda: sa.Drift("1 - 2*u - 5*10**15*exp(-(10**9*(u + 1/2))**2)"),
            lambda: sa.Drift("a - b*u + exp(-c*u)").bind(a=a, b=b, c=c),
            lambda: sa.Drift("a - b*u", layer=None, noise="1 + u**2").bind(a=a, b=b),
            lambda: sa.Drift.piecewise([("a - b*u", 0), ("-c", None)]).bind(a=a, b=b, c=c),
        ]
        return self.draw.choice(makers[:4] if sliding else makers)()

    def call(self, name: str) -> Any:
        """One call, and what its answer is asked for."""
        given = {}
        for key, choices in CALLS[name].items():
            if not key.endswith("?") or self.draw.random() < 0.4:
                given[key.rstrip("?")] = self.one_of(choices)
        self.said = [name, *(f"{k}={shown(x)}" for k, x in given.items())]
        found = getattr(sa, name)(**given)
        if name in AFTER and self.draw.random() < 0.7:
            more = self.draw.choice(list(AFTER[name]))
            values = [self.one_of(choices) for choices in AFTER[name][more]]
            self.said += [f".{more}", *map(shown, values)]
            attribute = getattr(found, more, None)
            if callable(attribute):
                attribute(*values)
        return found


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize(
    ("first", "count"), [(0, 80), pytest.param(1000, 20_000, marks=pytest.mark.slow)]
)
def test_only_answers_and_symasyms_errors(first: int, count: int) -> None:
    from matplotlib import pyplot

    wrong, answers = [], 0
    for seed in range(first, first + count):
        draw = random.Random(seed)
        # Most questions are about numbers, whose functions are few.
        names = list(CALLS)[:5] if draw.random() < 0.5 else list(CALLS)
        caller = Caller(draw)
        try:
            caller.call(draw.choice(names))
            answers += 1
        except sa.SymasymError as error:
            if "\n" in str(error):
                wrong.append(f"{seed}: {caller.said}\n    {error}")
        except Exception as error:
            wrong.append(f"{seed}: {caller.said}\n    {type(error).__name__}: {error}")
        pyplot.close("all")
    assert not wrong, "\n".join(wrong)
    assert answers > count / 4


def test_every_public_function_is_called() -> None:
    public = {name for name in sa.__all__ if callable(getattr(sa, name))}
    classes = {n for n in public if isinstance(getattr(sa, n), type)}
    assert public - classes <= {*CALLS, "labels"}
