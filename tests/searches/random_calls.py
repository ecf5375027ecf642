"""Random calls of every public verb: sentences or answers, nothing else, and in the time announced.

    python -m tests.searches.random_calls [COUNT] [SEED] [VERB,...]

Each call takes sensible arguments, some of which are replaced by extreme numbers or by things of
another type; some answers are asked for more (`AFTER`), and some calls are command lines, whose
words are replaced likewise. It ends in an answer, or in an error of `symasym.SymasymError`'s
family; what ends in another error or in a warning (a bare one), or takes longer than `LATE`
seconds of processor time, is printed as a line that makes the call again.
"""

from __future__ import annotations

import ast
import io
import math
import operator
import os
import random
import re
import signal
import sys
import tempfile
import time
import traceback
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib
import mpmath
import numpy as np
import sympy
from matplotlib import pyplot

import symasym as sa
from symasym.base.call_context import limited
from symasym.base.errors import SymasymError
from symasym.commands.main import main as run_command
from symasym.drift.grammar import FUNCTIONS

__all__ = [
    "AFTER",
    "CALLS",
    "COMMANDS",
    "LATE",
    "Outcome",
    "main",
    "outcome_of",
    "random_call",
    "random_formula",
]

#: Seconds of processor time after which a call is late, and its patience.
LATE, PATIENCE = 20.0, 1.0

_SENSIBLE = ["0.1", "0.3", "1", "2", "-0.4", "1/3", "5", "0.02", "10", "-1", "0.7", "3"]
_EXTREME = [
    "0", "1e-30", "1e-60", "1e-124", "1e-139", "1e-145", "1e-200", "'1e-500'", "1e15", "1e150",
    "1e308", "5e-324", "'1e400'", "'1e99999'", "'-1e99999'", "10**5000", "Fraction(1, 10**5000)",
    "Decimal('1E+999999')", "Decimal('1E-999999')", "mpmath.mpf('1e-1000000')", "'1e15'",
    "Fraction(10**40 + 1, 10**40)", "1 - 1e-16", "'0.99999999999999999999'", "2.7e-59", "1e-300",
    "10**400", "-0.0", "2**63", "'1e-12'",
]  # fmt: skip
_WRONG = [
    "None", "True", "np.True_", "[]", "[[1, 2], [3]]", "{}", "{1}", "object()", "slice(1, 2)",
    "slice(None)", "lambda x: x", "'abc'", "''", "b'1'", "1j", "math.inf", "-math.inf", "math.nan",
    "np.array([1.0, 2.0])", "np.array([])", "np.array(1.0)", "np.array([True, False])",
    "np.array([[1, 2]])", "np.array(['a'])", "np.array([None])", "np.array([1j])",
    "np.ma.masked_array([1.0, 2.0], [0, 1])", "np.float32(1)", "np.int8(3)", "sympy.pi",
    "sympy.Symbol('x')", "sympy.Rational(1, 3)", "sympy.oo", "sympy.nan", "sympy.Integer(2)",
    "sympy.true", "sympy.Matrix([[1, 2]])", "sympy.Symbol('x') < 1", "mpmath.mpf('0.5')",
    "mpmath.mpc(1, 1)", "mpmath.inf", "range(3)", "iter([1])", "int", "...", "NotImplemented",
    "'1_000'", "'0x10'", "'u'", "'optimal'", "'auto'", "'__import__(\"os\")'", "'\\x00'", "'é'",
    "Mute()", "Frame()", "(1, 2)", "['0.1', '0.2']", "10**100000", "'9'*5000", "-1", "2.5",
    "sa.Drift", "sa.friction()", "Decimal('NaN')", "Decimal('sNaN')", "np.datetime64('2020')",
]  # fmt: skip


class Mute:
    """An object that can't even be printed."""

    def __repr__(self) -> str:
        raise RuntimeError


class Frame:
    """Like a table of pandas: no truth value, == by elements, any attribute is missing."""

    def __eq__(self, other: object) -> Any:
        return np.array([True, False])

    __hash__ = None  # type: ignore[assignment]

    def __bool__(self) -> bool:
        raise ValueError("The truth value of a Frame is ambiguous.")


class _Place(NamedTuple):
    """An argument: the sensible expressions for it, and the chance that it is given at all."""

    sensible: list[str]
    chance: float = 1.0


_DRIFT = _Place(["DRIFT"])
_KAPPA, _R = _Place(_SENSIBLE[:4] + ["0.05", "[0.1, 0.5]"]), _Place(["2", "10", "'1/2'", "0.5"])
_START = _Place(["0", "'0.1'", "-0.2", "[0, 0.1]"], 0.3)
_FLAG = _Place(["True", "False"], 0.4)
_DPS = _Place(["15", "30", "None"], 0.3)
_ORDER = _Place(["0", "1", "2", "4", "'optimal'", "None"], 0.2)
_RTOL = _Place(["1e-3", "'1e-6'", "None"], 0.15)
_METHODS = _Place(
    ["'exact'", "'paper'", "'laplace'", "'uniform'", "'strong_noise'", "'auto'",
     "'bound'"], 0.5
)  # fmt: skip
_MANY = {"errors": _Place(["'nan'", "'raise'"], 0.2), "workers": _Place(["1", "None"], 0.05)}
_OPTIONS = {"method": _METHODS, "order": _ORDER, "dps": _DPS, "log": _FLAG, "full": _FLAG,
            "rtol": _RTOL, **_MANY}  # fmt: skip
_TEXT = _Place(["'-x**2'", "'cos(x)'", "'-tan(x)**2'", "'x - x**3/3'", "'log(x) - x'", "'a*x'",
                "FORMULA x"])  # fmt: skip
_WEIGHT = _Place(["1", "'x**2'", "'1/x'", "'exp(x)'", "'x**100'", "('1', 'x')", "FORMULA x"])
_ENDS = _Place(["-1", "0", "1", "'oo'", "'-oo'", "'pi'", "'1/2'"])

_FREE = ["sa.friction()", "sa.friction(mu=3, alpha=1)", "sa.Drift.general()", "sa.linear()",
         "sa.Drift('1/2 - u + b*u**3')", "sa.tanh()"]  # fmt: skip
_QUANTITY = _Place(["'T'", "'C'", "'1 - C'", "'P'", "'1 - P'", "'density'"])
_TARGET = _Place(["'c'", "'numpy'", "'latex'", "'javascript'", "'mpmath'"], 0.8)
_NAME = _Place(["'f'", "'time'"], 0.2)

#: The arguments of each verb that is called.
CALLS: dict[str, dict[str, _Place]] = {
    "escape_time": {
        "drift": _DRIFT, "kappa": _KAPPA, "r": _R, "start": _START, **_OPTIONS,
        "drag_time": _Place(["0.5", "'1/3'"], 0.1),
    },
    "exit_probability": {
        "drift": _DRIFT, "kappa": _KAPPA, "r": _R, "start": _START, "complement": _FLAG, **_OPTIONS
    },
    "occupation": {"drift": _DRIFT, "kappa": _KAPPA, "complement": _FLAG, **_OPTIONS},
    "stationary_density": {
        "drift": _DRIFT, "kappa": _KAPPA, "y": _START._replace(chance=1.0), "dps": _DPS,
        "log": _FLAG, "full": _FLAG, **_MANY,
    },
    "sensitivity": {
        "drift": _DRIFT, "kappa": _KAPPA, "r": _R, "start": _START, "dps": _DPS,
        "quantity": _Place(["'T'", "'C'", "'1 - C'", "'P'", "'1 - P'"], 0.5),
    },
    "plan": {"drift": _DRIFT, "kappa": _KAPPA, "r": _R, "rtol": _RTOL, "start": _START},
    "stokes_multiplier": {
        "drift": _DRIFT, "kappa": _KAPPA, "dps": _DPS,
        "method": _Place(["'step'", "'uniform'"], 0.5),
    },
    "rescale": {"eps": _KAPPA, "kappa": _KAPPA, "r": _R},
    "laplace_integral": {
        "f": _TEXT, "g": _WEIGHT, "x": _Place(["'x'"]), "a": _ENDS, "b": _ENDS,
        "order": _Place(["1", "2", "3", "'optimal'"], 0.5), "maxima": _Place(["[0]"], 0.1),
        "dps": _DPS, "keep": _FLAG,
    },
    "uniform_integral": {
        "f": _TEXT, "g": _WEIGHT, "x": _Place(["'x'"]), "a": _ENDS, "b": _ENDS,
        "order": _Place(["1", "2", "3"], 0.5), "near": _Place(["0", "'1/2'"], 0.1),
    },
    "formula": {"label": _Place(["'eq:Ttilde'", "'fr1'", "'folds'", "'eq:P'"])},
    "emit": {
        "what": _Place(["'eq:Ttilde'", "'fr1'", "sympy.Symbol('x')**2", "'eq:S'"]),
        "target": _Place(["'c'", "'numpy'", "'latex'"], 0.7),
        "parameters": _Place(["{'mu': 3}", "None"], 0.2), "drift": _Place(["DRIFT"], 0.2),
        "name": _Place(["'f'"], 0.2),
    },
    "reduce": {
        "f_minus": _Place(["('2 - z', '-z')"]), "f_plus": _Place(["('-1 - z', '-z')"]),
        "F": _Place(["('1/2 - 3*s/2 - z', '-z')"]), "D": _Place(["((3, 4), (0, 0))"]),
        "coordinates": _Place(["('y', 'z')"]), "switch": _Place(["'y'"], 0.1),
        "layer": _Place(["'s'"], 0.1), "at": _Place(["{'z': 0}"]),
    },
    "Drift": {
        "A": _Place(["'1/2 - u + u**3'", "'exp(-u)*cos(u)'", "'a*u'", "FORMULA u"]),
        "u": _Place(["'u'"], 0.2), "a_minus": _Place(["-1/2", "None"], 0.1),
        "a_plus": _Place(["1/2", "None"], 0.1),
    },
    "friction": {"mu": _KAPPA, "alpha": _KAPPA, "z0": _KAPPA},
    "tanh": {"a_minus": _KAPPA, "a_plus": _KAPPA, "steepness": _KAPPA},
    "sine": {"a_minus": _KAPPA, "a_plus": _KAPPA, "b": _KAPPA, "waves": _Place(["2"], 0.5)},
    "hill": {"a_minus": _KAPPA, "a_plus": _KAPPA, "K": _KAPPA, "n": _Place(["3"], 0.5)},
    "linear": {"a_minus": _KAPPA, "a_plus": _KAPPA},
    "polynomial": {"c0": _KAPPA, "c3": _KAPPA},
    "expand": {
        "drift": _Place(["DRIFT", *_FREE]), "quantity": _QUANTITY._replace(chance=0.8),
        "noise": _Place(["'weak'", "'strong'", "'uniform'"], 0.7),
        "order": _Place(["0", "1", "2", "3"], 0.7), "start": _Place(["0", "'0.1'", "-0.2"], 0.2),
        "case": _Place(["'start well barrier'", "'well'", "'start'", "'barrier well start'"], 0.2),
    },
    "release": {
        "system": _Place(["sa.oscillator(3, 1)", "sa.oscillator(mu='1/2', alpha=2)",
                          "sa.System('1 - z - u - 3*(u - u**3)', 'y - 1', '1 + u**2/2')"]),
        "kappa": _Place(["'0.1'", "0.3", "1"]), "r": _Place(["10", "2", "'1/2'"]),
        "eps": _Place(["'0.01'", "'0.1'", "1e-3"]),
        "start": _Place(["(0, '-0.4')", "(0, 0)", "('0.1', -0.5)"], 0.8),
        "method": _Place(["'march'", "'frozen'", "'first_order'", "'adiabatic'", "'simulate'"],
                         0.7),
        "rtol": _RTOL, "full": _FLAG, "paths": _Place(["100"]), "seed": _Place(["3"], 0.2),
        "workers": _MANY["workers"],
        "step": _Place(["0.01", "None"], 0.2), "tau": _Place(["0", "0.1"], 0.2),
    },
    "oscillator": {"mu": _KAPPA, "alpha": _KAPPA},
    "System.of": {
        "reduction": _Place(["sa.reduce(('1 - z', '-z'), ('-1 - z', '-z'), ('-s - z', '-z'), "
                             "((3,), (0,)), ('y', 'z'))"]),
        "slow": _Place(["'z'"]), "across": _Place(["'y'"]), "at": _Place(["None", "{}"], 0.5),
    },
    "System": {
        "phi": _Place(["'1 - z - u'", "'u - u**3 - z*y'", "'exp(-u) - z'", "FORMULA u z y"]),
        "velocity": _Place(["'y - 1'", "'-1'", "'1/(1 + z**2)'", "FORMULA y z"]),
        "noise": _Place(["'1'", "'1 + u**2'", "'2 - u'", "FORMULA u"], 0.4),
    },
    "plot": {
        "quantity": _Place(["'T'", "'C'", "'1 - C'", "'P'", "'1 - P'", "'p_ss'"]),
        "drift": _DRIFT, "kappa": _Place(["[0.1, 0.5, 1]", "np.geomspace(0.02, 2, 9)", "0.3"]),
        "r": _Place(["2", "10", "[1, 2]"], 0.8), "start": _Place(["0", "[0, 0.1]"], 0.2),
        "y": _Place(["0", "[0, 0.5]"], 0.2), "label": _Place(["'a'", "'$x'"], 0.1),
        "ax": _Place(["None"], 0.1), "method": _METHODS._replace(chance=0.3),
        "order": _Place(["0", "1", "2"], 0.1),
    },
    "labels": {},
}  # fmt: skip
_ESTIMATE = {"__str__": {}, "__repr__": {}, "terms": None, "dropped": None,
             "notes": None, "mask": None}  # fmt: skip
_LANDSCAPE = {"wells": {}, "barriers": {}, "critical_points": {}, "region": None, "plot": {},
              "phi": {}, "expression": {}, "potential": {}, "potential_at": {"u": _KAPPA},
              "ends": None, "free": None, "parameters": None, "values": None, "shape": None,
              "__repr__": {}, "__str__": {}, "_repr_latex_": {}, "__hash__": {}}  # fmt: skip
_SYMBOLIC = {"latex": {}, "cases": {}, "__str__": {}, "emit": {"target": _TARGET, "name": _NAME},
             "bind": {"mu": _KAPPA, "alpha": _KAPPA, "z0": _KAPPA},
             "expression": None, "terms": None, "leading": None, "conditions": None,
             "nested": None, "error": None,
             "put_in": {"expression": _Place(["sympy.Symbol('kappa')**2"])}}  # fmt: skip
_INTEGRAL = {
    "evaluate": {"lam": _Place(["10", "'1e3'", "50"]), "dps": _DPS,
                 "full": _FLAG},
    "latex": {}, "__str__": {}, "emit": {"target": _TARGET, "name": _NAME},
    "expression": None, "terms": None, "conditions": None, "error": None,
    "expression_in": {"lam": _Place(["sympy.Symbol('n')", "'n'"])},
    "bind": {"a": _Place(["2", "'1/2'"])}, "error_kind": None, "parameters": None,
}  # fmt: skip
#: What an answer may be asked for: its methods with their arguments, None for attributes.
AFTER: dict[str, dict[str, dict[str, _Place] | None]] = {
    **dict.fromkeys(list(CALLS)[:4], _ESTIMATE),
    "expand": {**_SYMBOLIC, "evaluate": {"kappa": _KAPPA, "r": _R, "dps": _DPS, "log": _FLAG,
                                         "full": _FLAG}},
    "laplace_integral": {**_INTEGRAL, "omitted": None, "height": None, "contributions": None},
    "uniform_integral": {
        **{name: _INTEGRAL[name] for name in ("evaluate", "bind", "error_kind", "parameters")},
        "coefficients": {"dps": _DPS}, "__str__": {},
    },
    "formula": {"latex": {}, "__str__": {}, "emit": {"target": _TARGET, "drift": _DRIFT},
                "expression": None, "left": None, "steps": None},
    "rescale": {"__str__": {}, "drag_time": {"distance": _KAPPA, "velocity": _KAPPA}},
    "reduce": {"__str__": {}, "drift": None, "amplitude": None,
               "drag_time": {"eps": _KAPPA, "values": _Place(["{'z': 0}", "None"])},
               "sliding_at": {"values": _Place(["{'z': 0}", "{}"])}},
    "release": {"__str__": {}, "time": None, "z": None, "notes": None, "__float__": {}},
    "oscillator": {"frozen": {"z": _KAPPA}, "drag_time": {"z": _KAPPA, "eps": _KAPPA},
                   "__str__": {}, "drift": None},
    "System": {"frozen": {"z": _KAPPA}, "drift": None, "__str__": {}},
    "plan": {"__str__": {}, "terms": None},
    "sensitivity": {"__str__": {}},

    "Drift": {**_LANDSCAPE, "bind": {"a": _KAPPA}, "derivative": {"name": _Place(["'a'"])}},
    "friction": {**_LANDSCAPE, "folds": {}, "turning_points": {}, "beta": {}},
    **dict.fromkeys(("tanh", "sine", "hill", "linear", "polynomial"), _LANDSCAPE),
}  # fmt: skip
#: Verbs with an argument ``patience``.
_PATIENT = {
    "escape_time", "exit_probability", "occupation", "stationary_density", "plan",
    "release",
    "plot", "expand", "emit", "reduce",
}  # fmt: skip


#: Command lines: the words of each, those in capitals replaced by a number, a drift's name and
#: parameters, an expression or a spec's path.
COMMANDS = [
    "value escape-time DRIFT --kappa X --r X",
    "value escape-time DRIFT --kappa X --r X --start X --method METHOD --json",
    "value escape-time --expr TEXT --set b=X --kappa X --r X --dps N --log --patience X",
    "value exit-probability DRIFT --kappa X --r X --complement --order N --method METHOD",
    "value occupation DRIFT --kappa X --json --rtol X --method auto",
    "value stationary-density DRIFT --kappa X --y X --dps N",
    "show LABEL", "show LABEL --latex", "show LABEL --steps", "show --all",
    "show expansion:T DRIFT --order N", "show expansion:T --expr TEXT --noise WORD --latex",
    "show expansion:WORD DRIFT --start X --case WORD --patience X",
    "emit LABEL --target WORD", "emit eq:Ttilde --target WORD DRIFT",
    "emit expansion:WORD --target WORD DRIFT --order N",
    "emit LABEL --target WORD -o OUT",
    "emit eq:V --target WORD --expr TEXT --set b=X",
    "figure", "figure FIGURE --set points=N -o OUT", "figure FIGURE --set mu=X -o OUT",
    "figure FIGURE --set kappa=X --set alpha=X -o OUT --patience X",
    "figure FIGURE --set z0=X,X -o OUT",
    "table SPEC -o OUT --workers 1", "table SPEC -o OUT --workers 1 --force",
    "release --phi TEXT --velocity TEXT --kappa X --r X --eps X --z X --method WORD --json",
    "release --set mu=X --set alpha=X --kappa X --r X --eps X --z X --start X --quantiles",
    "release --kappa X --r X --eps X --z X --method simulate --paths N --seed N --patience X",
    "derive WORD -o OUT", "verify --level WORD --seed N -o OUT",
    "reproduce --only WORD --dps N -o OUT", "report --scene X --quick -o OUT",
    "report --scene X --stability", "value", "--version",
]  # fmt: skip
_WORDS: dict[str, list[str]] = {
    "X": ["0.1", "0.3", "1", "10", "-0.4", "1/3", "2", "0.5", "0.02"],
    "N": ["0", "1", "2", "5", "20"],
    "DRIFT": [
        "--drift friction --set mu=3 --set alpha=1 --set z0=-0.4", "--drift linear --set a_minus=1 "
        "--set a_plus=-1", "--drift tanh --set a_minus=3 --set a_plus=-1 --set steepness=X",
        "--drift friction --set mu=X --set alpha=X --set z0=X", "--drift friction",
        "--drift hill --set a_minus=X --set a_plus=X --set K=X", "--expr 1/2-u+u**3",
    ],
    "TEXT": ["1/2-u+b*u**3", "exp(-u)*cos(u)", "1 - z - u", "y - 1", "2 - u^3", "-1"],
    "METHOD": ["exact", "laplace", "uniform", "paper", "bound", "strong_noise", "auto"],
    "LABEL": ["eq:Ttilde", "fr1", "folds", "eq:V", "eq:P", "eq:S", "endpoint-series", "eq:osc1"],
    "WORD": ["c", "python", "numpy", "weak", "strong", "uniform", "march", "frozen", "C", "P",
             "start well barrier", "latex"],
    "FIGURE": ["phase", "fric1", "fric2", "fil", "stokes", "flows", "fricforce", "release",
               "regimes"],
    "OUT": ["a.png", "b.svg", "t.jsonl", "e.c", "a.pdf"],
}  # fmt: skip
_HOSTILE = [
    "", "-", "--", "abc", "1e400", "1e-400", "1e-99999", "10**9", "0", "-1", "nan", "inf", "é",
    "\x1b[2J", "..", "a/b/c.png", ".", "__import__('os').system('false')", "1e15", "9" * 5000,
    "--set", "mu=3", "1000000000", "2.7e-59", "1e-139", "\udce9", "a" * 300 + ".png", "'", "*",
    "--json", "1,2", "x=1=2", "escape_time", "/dev/null/x.png", "1_000", "0x10", "u", "lambda",
]  # fmt: skip
_SPEC = {
    "drift": ["'friction'", "'linear'", "'tanh'"], "expr": ["'1/2 - u + b*u**3'"],
    "quantities": ["['T']", "['T', 'C', '1 - C']", "['P']"], "dps": ["20", "5"],
    "kappa": ["[0.1, 0.3]", "{from = 0.1, to = 1, points = 3}", "1",
              "{from = 0.01, to = 1, points = 3, spacing = 'log'}"],
    "r": ["10", "[1, 2]"], "start": ["0"],
    "parameters": ["{mu = 3, alpha = 1, z0 = -0.4}", "{a_minus = 1, a_plus = -1}",
                   "{a_minus = 3, a_plus = -1, steepness = [1, 5]}", "{b = '3/4'}"],
}  # fmt: skip
_SPOILED = [
    "true", "[]", "{}", "'x'", "nan", "inf", "1e400", "'1e-500'", "-1", "0", "[[1]]", "'\\u0000'",
    "{from = 0, to = 1}", "{from = 1, to = 0, step = 0.1}", "{points = 1000000000}", "1979-05-27",
    "{from = 0.1, to = 1, points = 1000000000000}", "=", "'", "[1, 'a']", "10000", "1e15",
    "{from = 1, to = 1e300, step = '1e-300'}", "'__import__(\"os\")'",
]  # fmt: skip


def command(*words: str) -> int:
    """The exit status of a command line, run in a folder of its own, which takes `PATIENCE`."""
    with tempfile.TemporaryDirectory() as folder, _inside(folder):
        out, err = io.StringIO(), io.StringIO()
        try:
            with redirect_stdout(out), redirect_stderr(err), limited(PATIENCE):
                status = run_command([_written(word) for word in words])
        except SystemExit as end:
            status = int(end.code or 0)
    said = err.getvalue().strip().rpartition("\n")[2]
    if status not in (0, 1, 2):
        raise RuntimeError(f"status {status}")
    if status == 2:
        if "Traceback" in err.getvalue() or not said.startswith("symasym"):
            raise RuntimeError(said)
        raise SymasymError(said)
    return status


def _written(word: str) -> str:
    """A word; a spec's path in place of its text."""
    if word.startswith("spec:"):
        Path("spec.toml").write_text(word[5:], encoding="utf-8", errors="surrogateescape")
        return "spec.toml"
    return word


@contextmanager
def _inside(folder: str) -> Iterator[None]:
    """The folder as the working one."""
    before = Path.cwd()
    os.chdir(folder)
    try:
        yield
    finally:
        os.chdir(before)


_NAMES: dict[str, Any] = {
    "command": command,
    "sa": sa, "np": np, "sympy": sympy, "mpmath": mpmath, "math": math, "Fraction": Fraction,
    "Decimal": Decimal, "Mute": Mute, "Frame": Frame, "object": object, "slice": slice,
    "range": range, "iter": iter, "int": int, "NotImplemented": NotImplemented,
}  # fmt: skip
_OPERATORS: dict[type, Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Pow: operator.pow,
    ast.Div: operator.truediv,
    ast.Lt: operator.lt,
}  # fmt: skip


#: How an answer is shown.
_SHOWN = {"__str__", "_repr_latex_", "__repr__", "__float__", "__hash__"}


def value_of(node: ast.expr) -> Any:
    """The value of an argument, or of a call: literals, lists, `_NAMES` and what belongs to them.

    Examples
    --------
    >>> value_of(ast.parse("[Fraction(1, 3), 2**63 - 1]", mode="eval").body)
    [Fraction(1, 3), 9223372036854775807]
    """
    match node:
        case ast.Constant():
            return node.value
        case ast.Name():
            return _NAMES[node.id]
        case ast.Attribute() if not node.attr.startswith("_") or node.attr in _SHOWN:
            return getattr(value_of(node.value), node.attr)
        case ast.List():
            return [value_of(x) for x in node.elts]
        case ast.Tuple():
            return tuple(value_of(x) for x in node.elts)
        case ast.Set():
            return {value_of(x) for x in node.elts}
        case ast.Dict():
            keys = (value_of(x) for x in node.keys if x)
            return dict(zip(keys, map(value_of, node.values), strict=True))
        case ast.UnaryOp(op=ast.USub()):
            return -value_of(node.operand)
        case ast.BinOp():
            return _OPERATORS[type(node.op)](value_of(node.left), value_of(node.right))
        case ast.Compare(ops=[op], comparators=[right]):
            return _OPERATORS[type(op)](value_of(node.left), value_of(right))
        case ast.Lambda(body=ast.Name()):
            return lambda x: x
        case ast.Call():
            given = {x.arg: value_of(x.value) for x in node.keywords if x.arg}
            return value_of(node.func)(*map(value_of, node.args), **given)
        case _:
            raise ValueError(f"{ast.unparse(node)} is no argument")


class Outcome(NamedTuple):
    """How a call ended: ``"answer"``, an error's name, ``"bare"`` or ``"late"``; and where."""

    kind: str
    where: str
    seconds: float


def random_call(draw: random.Random, verbs: Sequence[str] = ()) -> str:
    """A call as a line of Python, of one of the verbs or of any; ``"command"`` is one of them."""
    verb = draw.choice(verbs or [*CALLS, *["command"] * 3])
    # Most questions are about numbers, whose verbs are few.
    if not verbs and draw.random() < 0.5:
        verb = draw.choice(list(CALLS)[:5])
    spoiled = draw.choice([0.0, 0.05, 0.15])
    if verb == "command":
        return f"command({', '.join(map(repr, _random_command(draw, spoiled)))})"
    given = _arguments(draw, CALLS[verb], spoiled)
    if verb in ("occupation", "stationary_density") and draw.random() < 0.8:
        given["drift"] = _random_drift(draw, sliding=True)
    if verb in _PATIENT:
        given["patience"] = draw.choice(_WRONG) if draw.random() < 0.01 else str(PATIENCE)
    asked = verb in AFTER and draw.random() < (0.2 if AFTER[verb] is _ESTIMATE else 0.7)
    if asked and AFTER[verb] is _ESTIMATE:
        given["full"] = "True"
    call = f"sa.{verb}({_joined(given)})"
    if asked:
        name = draw.choice(list(AFTER[verb]))
        call += f".{name}"
        if (places := AFTER[verb][name]) is not None:
            call += f"({_joined(_arguments(draw, places, spoiled))})"
    return call


def _joined(given: dict[str, str]) -> str:
    """Arguments by name as they are written in a call."""
    return ", ".join(f"{k}={v}" for k, v in given.items())


def _arguments(draw: random.Random, places: dict[str, _Place], spoiled: float) -> dict[str, str]:
    """Arguments by name, a share of which is `spoiled`."""
    given = {}
    for name, place in places.items():
        if draw.random() > place.chance:
            continue
        text = draw.choice(place.sensible)
        if text == "DRIFT":
            text = _random_drift(draw)
        elif text.startswith("FORMULA"):
            text = repr(random_formula(draw, 3, text.split()[1:]))
        if draw.random() < spoiled:
            text = draw.choice(_EXTREME if draw.random() < 0.5 else _WRONG)
        given[name] = text
    return given


def random_formula(draw: random.Random, depth: int, names: Sequence[str] = ("u", "a")) -> str:
    """A text that is mostly a formula, with numbers of any size."""
    if depth == 0 or draw.random() < 0.2:
        numbers = ["2", "1/3", "10", "1e30", "1e-9", "123456789", "pi", "0.5"]
        return draw.choice([*names, *numbers])
    parts = [random_formula(draw, depth - 1, names) for _ in range(2)]
    kind = draw.randrange(6)
    if kind == 5:
        return f"{draw.choice(list(FUNCTIONS))}({parts[0]})"
    return f"({parts[0]}){draw.choice(['+', '-', '*', '/', '**'])}({parts[1]})"


def _random_command(draw: random.Random, spoiled: float) -> list[str]:
    """The words of a command line, a share of which is `spoiled`."""
    words = []
    for part in draw.choice(COMMANDS).split():
        if part == "SPEC":
            words.append(f"spec:{_random_spec(draw, spoiled)}")
            continue
        text = part
        if "TEXT" in part and draw.random() < 0.2:
            text = part.replace("TEXT", random_formula(draw, 3).replace(" ", ""))
        for kind in (*list(_WORDS)[2:], "X", "N"):
            chosen = draw.choice(_WORDS[kind])
            text = re.sub(rf"(?<![A-Z]){kind}(?![A-Z])", lambda _, x=chosen: x, text)
        words += text.split() if part == "DRIFT" else [text]
    return [draw.choice(_HOSTILE) if draw.random() < spoiled / 2 else word for word in words]


def _random_spec(draw: random.Random, spoiled: float) -> str:
    """The text of a table's TOML file."""
    kind = draw.choice(["drift", "drift", "expr"])
    keys = [kind, "quantities", "dps", "kappa", "parameters"]
    keys += ["r"] if draw.random() < 0.9 else []
    keys += ["start"] if draw.random() < 0.2 else []
    lines = []
    for key in keys:
        value = draw.choice(_SPOILED if draw.random() < spoiled else _SPEC[key])
        if key not in ("parameters", "expr") or draw.random() > spoiled:
            lines.append(f"{key} = {value}")
    return "\n".join(lines)


def _random_drift(draw: random.Random, sliding: bool = False) -> str:
    """A drift, extreme ones among them."""

    def number() -> str:
        """A parameter."""
        if draw.random() < 0.15:
            return str(draw.choice(_EXTREME))
        return f"{draw.choice(_SENSIBLE)!r}"

    ends = f"{number()}, {number()}"
    if sliding and draw.random() < 0.9:
        ends = draw.choice(["1, -1", "'0.3', '-2'", "3, -1"])
    drifts = [
        f"sa.linear({ends})",
        f"sa.tanh({ends}, {number()})",
        f"sa.sine({ends}, {number()}, waves={draw.choice([1, 1, 2, 3])})",
        f"sa.hill({ends}, {number()}, n={draw.choice([1, 2, 4])})",
        *(() if sliding else (f"sa.friction({number()}, {number()}, {number()})",)),
        f"sa.polynomial({ends}, {number()}, {number()})",
        "sa.Drift('1 - 2*u - 5*10**15/sqrt(pi)*exp(-(10**15*(u+1/2))**2)')",
        f"sa.Drift('a - b*u + exp(-c*u)').bind(a={number()}, b={number()}, c={number()})",
    ]
    return str(draw.choice(drifts))


def outcome_of(call: str, late: float = LATE) -> Outcome:
    """How a call ends."""
    begun = time.process_time()
    kind, where = "answer", ""
    try:
        with _alarm(late):
            value_of(ast.parse(call, mode="eval").body)
    except sa.SymasymError as error:
        kind, where = type(error).__name__, str(error)
        if "\n" in where or len(where) > 1000:
            kind = "bare"
    except _Late:
        kind = "late"
    except Exception as error:
        # The last line of the package on the way.
        lines = traceback.extract_tb(error.__traceback__)
        own = [x for x in lines if "symasym" in x.filename] or lines
        place = f"{own[-1].filename.rpartition('symasym/')[2]}:{own[-1].lineno}"
        kind, where = "bare", f"{type(error).__name__}: {str(error)[:100]} at {place}"
    return Outcome(kind, where, time.process_time() - begun)


class _Late(BaseException):
    """The call takes too long; no `except Exception` on the way takes it."""


class _alarm:
    """Interrupt what runs inside after so many seconds of processor time."""

    def __init__(self, seconds: float) -> None:
        self.seconds = seconds

    def __enter__(self) -> None:
        def late(*_: object) -> None:
            raise _Late

        self.before = signal.signal(signal.SIGPROF, late)
        signal.setitimer(signal.ITIMER_PROF, self.seconds)

    def __exit__(self, *_: object) -> None:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, self.before)


def main(
    total: int = 60_000,
    seed: int = 1,
    report: Callable[[str], object] | None = print,
    verbs: Sequence[str] = (),
) -> Counter[str]:
    """Make `total` random calls, and count how they end."""
    matplotlib.use("agg")
    draw, counts, seen = random.Random(seed), Counter[str](), Counter[str]()
    warnings.simplefilter("error")
    longest = 0.0
    for number in range(1, total + 1):
        call = random_call(draw, verbs)
        outcome = outcome_of(call)
        counts[outcome.kind] += 1
        longest = max(longest, outcome.seconds)
        slow = outcome.seconds > 3 * PATIENCE and f"patience={PATIENCE}" in call
        counts["slow"] += slow
        if report and (outcome.kind in ("bare", "late") or slow):
            place = outcome.where.rpartition(" at ")[2] or outcome.kind
            seen[place] += 1
            if seen[place] <= 3:
                report(f"{outcome.kind} {outcome.seconds:.1f} s: {call}\n    {outcome.where}")
        if "plot" in call:
            pyplot.close("all")
        if report and number % 250 == 0:
            report(f"{number}: {dict(counts)}, longest {longest:.1f} s")
            sys.stdout.flush()
    return counts


if __name__ == "__main__":
    _total, _seed = (*map(int, sys.argv[1:3]), *(60_000, 1)[len(sys.argv) - 1 :])
    main(_total, _seed, verbs=[verb for words in sys.argv[3:] for verb in words.split(",")])
