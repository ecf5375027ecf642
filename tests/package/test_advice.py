"""What a message advises exists, and does what the message promises."""

from __future__ import annotations

import argparse
import ast
import contextlib
import inspect
import io
import re
import tempfile
from collections.abc import Collection, Iterator, Sequence
from functools import cache, cached_property
from pathlib import Path
from typing import Any

import pytest
import sympy

import symasym as sa
from symasym.commands.main import _parser, in_options
from symasym.commands.main import main as run_command
from symasym.commands.settings import Parser
from symasym.methods import METHODS
from symasym.release.answer import METHODS as OF_RELEASE

ROOTS = [Path(str(sa.__file__)).parent, Path(str(sa.__file__)).parent.parent / "derivations"]


def sentences() -> Iterator[tuple[str, str]]:
    """Every text in a raise, or in a function that makes an error, with where it stands."""
    for root in ROOTS:
        for path in sorted(root.rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
                if isinstance(node, ast.Call) and re.search(r"Error$|_Refused$", _name(node.func)):
                    yield f"{path.name}:{node.lineno}", "".join(map(_text, node.args))


def _name(node: ast.expr) -> str:
    return node.id if isinstance(node, ast.Name) else getattr(node, "attr", "")


def _text(node: ast.expr) -> str:
    """The text of a literal, values in it as a dash."""
    if isinstance(node, ast.Constant):
        return str(node.value)
    if isinstance(node, ast.JoinedStr):
        return "".join(_text(part) for part in node.values)
    if isinstance(node, ast.BinOp):
        return _text(node.left) + _text(node.right)
    return "–"


@cache
def public() -> dict[str, Any]:
    """The public callables, and the methods of public classes and of what verbs return."""
    from symasym.emit.source import Source

    found = {name: getattr(sa, name) for name in sa.__all__}
    classes = [x for x in found.values() if inspect.isclass(x)]
    for kind in (*classes, Source):
        found |= {n: x for n, x in inspect.getmembers(kind, callable) if not n.startswith("__")}
    return found


@cache
def parameters() -> set[str]:
    names: set[str] = set()
    for call in public().values():
        try:
            names |= set(inspect.signature(call).parameters)
        except (ValueError, TypeError):
            continue
    return names


@cache
def options() -> set[str]:
    return set(_options(_parser()))


def _options(parser: Parser) -> Iterator[str]:
    """The options of a parser and of those below it."""
    yield from parser._options()
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for below in action.choices.values():
                yield from _options(below)


ALL = list(sentences())


def test_there_are_messages() -> None:
    assert len(ALL) > 200


@pytest.mark.parametrize("message", sorted({text for _, text in ALL}))
def test_what_is_advised_exists(message: str) -> None:
    known, calls = parameters(), public()
    flags = options()
    for name in re.findall(r"\bsa\.(\w+)", message):
        assert name in sa.__all__, name
    assert not re.search(r"\bsymasym\.\w", message), "advice names what is not public"
    for name in re.findall(r"\b([a-zA-Z_]\w*)=(?:…|n\b|True|'|\")", message):
        assert name in known | {"CC", "positive"}, name
    for name in re.findall(r"method='(\w+)'", message):
        assert name in {*METHODS, *OF_RELEASE}, name
    for name in re.findall(r"(?<![\w.])([a-z_]{3,})\((?:\)|…|\w+=)", message):
        assert name in calls, name
    for flag in re.findall(r"(?<![\w-])--[a-z][\w-]*", message):
        assert flag in flags, flag
    for command in re.findall(r"\bsymasym ([a-z]{4,})\b", message):
        assert command in {"show", "derive", "evaluates", "with", "that"}, command


@pytest.mark.parametrize("message", sorted({text for _, text in ALL}))
def test_the_command_line_speaks_its_own_language(message: str) -> None:
    for flag in re.findall(r"(?<![\w-])--[a-z][\w-]*", in_options(message)):
        assert flag in options(), flag
    assert not re.search(
        r"\b(log|full|complement)=True|bind\(\w+=|\bDrift\b\W|case='|sa\.(escape|exit|occ|stat)\w*",
        in_options(message).replace("give a Drift", ""),
    )


FAR = sa.polynomial(-0.1, 1.6, 3.44, -0.316)
FRICTION, SLIDING = sa.friction(3, 1, "-0.4"), sa.linear(1, -1)
CROSSING = sa.linear(1, 1)
BLOCK = sa.oscillator(3, 1)
U = sympy.Symbol("u")


class Refused:
    """A call that is refused, and the calls that its message advises.

    Those of `then`, or, for advice of an option, the same call with it.
    """

    def __init__(self, verb: Any, *args: Any, then: Sequence[Any] = (), **options: Any) -> None:
        self.verb, self.args, self.options, self.then = verb, args, options, then

    @cached_property
    def message(self) -> str:
        """What the call is refused with."""
        with pytest.raises((sa.SymasymError, ValueError)) as told:
            self.verb(*self.args, **self.options)
        return str(told.value)

    def advised(self) -> Iterator[Any]:
        """The calls that the message advises."""
        yield from self.then
        if self.then:
            return
        for words in re.findall(r"method=((?:'\w+'(?:, | or )?)+)", self.message):
            for method in re.findall(r"\w+", words):
                if method != "or":
                    digits = {"dps": 20} if f"'{method}' with dps=…" in self.message else {}
                    yield self._with({"method": method} | digits, {"order", "rtol"})
        if "log=True with dps=…" in self.message:
            yield self._with({"log": True, "dps": 20})
        elif "log=True, or dps=…" in self.message:
            yield from (self._with({"log": True}), self._with({"dps": 20}))
        elif re.search(r"(pass|give) dps=", self.message):
            yield self._with({"dps": 20})
        if re.search(r"pass log=True or", self.message):
            yield self._with({"log": True})
        if words := re.search(r"^(\w+) is .*; give one of ([\w', -]+)", self.message):
            yield from (self._with({words[1]: x.strip("'")}) for x in words[2].split(", "))
        if ends := re.search(r"^(\w+) is .*; give .* from (\d+) to (\d+)", self.message):
            yield from (self._with({ends[1]: int(x)}) for x in ends.groups()[1:])
        for option, value in (("rtol", 1e-3), ("drift", FRICTION), ("full", True)):
            if f"{option}=…" in self.message or f"{option}=True" in self.message:
                yield self._with({option: value})
        if "errors='nan'" in self.message:
            yield self._with({"errors": "nan"})
        if "leave it out" in self.message:
            yield self._with({}, {self.message.partition(" is ")[0]})

    def _with(self, options: dict[str, Any], without: Collection[str] = ()) -> Any:
        """The call with other options; with one value of an array where it is to be one."""
        kept = {k: x for k, x in self.options.items() if k not in without}
        single = re.search(r"one (scene|value) at a time", self.message)
        args = [x[0] if single and isinstance(x, list) else x for x in self.args]
        return lambda: self.verb(*args, **(kept | options))


def command(*words: str) -> int:
    """Run a command line in a folder of its own; its sentence as an error, as Python has it."""
    said = io.StringIO()
    with (
        tempfile.TemporaryDirectory() as folder,
        contextlib.chdir(folder),
        contextlib.redirect_stderr(said),
        contextlib.redirect_stdout(io.StringIO()),
    ):
        try:
            status = run_command(words)
        except SystemExit as end:
            status = int(end.code or 0)
    if status == 2:
        raise sa.SymasymError(said.getvalue().strip().rpartition("symasym: ")[2])
    return status


def done(*words: str) -> bool:
    """True for a command line that ends well."""
    assert command(*words) == 0
    return True


VALUE = ("value", "escape-time", "--drift", "friction", "--set", "mu=3", "--set", "alpha=1",
         "--set", "z0=-1", "--kappa", "1", "--r", "10")  # fmt: skip
RELEASE = ("release", "--kappa", "1", "--r", "2", "--eps", "0.1", "--z", "0")


def _released(**options: Any) -> Any:
    """The block's release, other options put in."""
    known: dict[str, Any] = {"kappa": "0.1", "r": 10, "eps": "0.01", "start": (0, "-0.4")}
    return sa.release(BLOCK, **known | options)


def _quantile(method: str = "frozen") -> Any:
    """The median of the release, by a method."""
    return _released(kappa="0.5", method=method).time.quantile(0.5)


def _plain(f: str, g: Any = 1, **options: Any) -> Any:
    """A uniform integral, of weight 1 if none is given."""
    return sa.uniform_integral(f, g, "x", *options.pop("ends", (-1, 1)), **options)


FRACTION = _plain("x - x**3/3", (1, "1/(x**6 + x + 9)**2"), ends=("-oo", "oo"), order=1)
BELL = _plain("cos(x) - x**2*exp(x)")


def _emitted(drift: sa.Drift, target: str = "numpy", **options: Any) -> Any:
    return sa.emit("eq:Ttilde", target, drift=drift, **options)


LINES = sa.tanh(1, -1, 1)
CUBIC = sa.polynomial(-0.1, 1.6, 3.44, -0.316)
WAVES = sa.Drift("1/2 - 3/4*u - 3/5*sin(6*u)")

#: Calls that are refused with advice; each message that advises a call or an option is among them.
REFUSED = {
    "uniform 1 - P": Refused(
        sa.occupation,
        SLIDING,
        ["0.1", "0.2"],
        method="uniform",
        complement=True,
        then=[
            lambda: sa.occupation(SLIDING, "0.1", method="uniform", complement=True),
            lambda: sa.occupation(SLIDING, [0.1, 0.2], method="laplace", complement=True),
        ],
    ),
    "system": Refused(sa.release, "x", 1, 2, eps=0.1, start=(0, 0), then=[_released]),
    "tau": Refused(
        _released,
        tau="0.1",
        then=[lambda: _released(tau="0.1", method="simulate", paths=20, seed=1)],
    ),
    "first order": Refused(_released, kappa=1, eps="0.09", method="first_order"),
    "strong noise": Refused(sa.escape_time, FRICTION, 3, 10, method="laplace"),
    "uniform": Refused(sa.escape_time, FRICTION, 3, 10, method="uniform"),
    "law": Refused(_quantile),
    "weak noise": Refused(sa.escape_time, FRICTION, "0.5", 10, method="strong_noise"),
    "large drift": Refused(
        sa.escape_time, sa.linear("1e300", "-1e300"), "1e-5", 2, method="strong_noise"
    ),
    "emit uniform": Refused(
        _emitted,
        sa.Drift("cos(2*u)"),
        method="uniform",
        then=[
            lambda: _emitted(sa.Drift("cos(2*u)")),
            lambda: sa.escape_time(sa.Drift("cos(2*u)"), "0.1", 2, method="uniform"),
        ],
    ),
    "extreme": Refused(
        sa.escape_time,
        sa.Drift("u**2 - 3/10"),
        "1e400",
        "1e-60",
        method="uniform",
        then=[lambda: sa.escape_time(sa.Drift("u**2 - 3/10"), "1e400", "1e-60", dps=20)],
    ),
    "logarithm beyond float64": Refused(
        sa.escape_time, FRICTION, "1e-300", 10, method="paper", log=True
    ),
    "both beyond float64": Refused(sa.escape_time, FRICTION, "1e-300", 10, method="paper"),
    "multiplicity": Refused(
        sa.expand,
        sa.Drift("u**2"),
        "T",
        start="1/2",
        then=[lambda: sa.escape_time(sa.Drift("u**2"), "0.1", 2, start="1/2", method="uniform")],
    ),
    "double zero": Refused(
        sa.escape_time, sa.Drift("1 - cos(u)"), "0.1", 2, method="uniform", start="1/2"
    ),
    "variable": Refused(
        sa.Drift,
        "1-x",
        then=[lambda: eval(REFUSED["variable"].message.rpartition(" as in ")[2].rstrip("."))],
    ),
    "emit order": Refused(
        sa.emit, "eq:Ttilde", order=1, then=[lambda: _emitted(FRICTION, method="laplace", order=1)]
    ),
    "multiple zero": Refused(sa.escape_time, sa.Drift("u**3 - u**2"), "0.1", 2, method="laplace"),
    "flat": Refused(sa.escape_time, sa.Drift("u**20*(1 - u) - u + 1"), "0.01", 2, method="laplace"),
    "tangency": Refused(sa.escape_time, sa.linear(1, 0), "0.1", 2, method="laplace"),
    "r at a zero": Refused(sa.escape_time, sa.Drift("u - 1/2"), "0.1", "1/2", method="laplace"),
    "one value": Refused(
        lambda a: sa.linear(a, 1).wells(), [1, 2], then=[lambda: sa.linear(1, 1).wells()]
    ),
    "wells": Refused(
        sa.emit,
        "eq:pss",
        drift=sa.tanh(),
        then=[lambda: sa.emit("eq:pss", drift=LINES), lambda: sa.emit("eq:pss", drift=sa.linear())],
    ),
    "emit uniform order": Refused(
        _emitted,
        FRICTION,
        method="uniform",
        order=1,
        then=[lambda: sa.escape_time(FRICTION, "0.1", 10, method="uniform", order=1)],
    ),
    "emit exact order": Refused(
        _emitted, FRICTION, order=1, then=[lambda: _emitted(FRICTION, method="laplace", order=1)]
    ),
    "fold": Refused(
        sa.emit,
        "eq:S",
        drift=sa.linear(),
        then=[
            lambda: sa.emit("eq:S", drift=sa.friction()),
            lambda: sa.stokes_multiplier(sa.friction(3, 1, -1), "0.1"),
        ],
    ),
    "header": Refused(
        command,
        "emit",
        "eq:V",
        "--drift",
        "friction",
        "--target",
        "c",
        "--header",
        then=[
            lambda: done(
                "emit", "eq:V", "--drift", "friction", "--target", "c", "--header", "-o", "v.c"
            )
        ],
    ),
    "float": Refused(
        lambda: float(sa.escape_time(FRICTION, "0.001", 10, dps=20, full=True)),
        then=[lambda: sa.escape_time(FRICTION, "0.001", 10, dps=20, full=True).value],
    ),
    "density": Refused(
        lambda: sa.expand(SLIDING, "density").evaluate(1),
        then=[lambda: sa.stationary_density(SLIDING, 1, 0)],
    ),
    "regular part": Refused(
        lambda: sa.expand(sa.Drift("c - sin(2*u)"), "T").emit("c"),
        then=[lambda: sa.expand(sa.Drift("c - sin(2*u)").bind(c="1/2"), "T").emit("c")],
    ),
    "uniform start": Refused(
        sa.expand,
        FRICTION,
        "T",
        noise="uniform",
        start=2,
        then=[lambda: sa.escape_time(FRICTION, "0.1", 10, start=2, method="uniform")],
    ),
    "general case": Refused(
        sa.expand,
        sa.Drift.general(),
        "T",
        case="start well",
        then=[
            lambda: sa.expand(sa.Drift.general(), "T", case="start well barrier"),
            lambda: sa.expand(sa.Drift.general(), "T", case="barrier well start"),
            lambda: sa.expand(sa.friction(), "T", case="start well"),
        ],
    ),
    "no values": Refused(
        sa.expand,
        sa.Drift("(u - 1/2)**2 - a**2/10**12"),
        "T",
        then=[
            lambda: sa.expand(
                sa.Drift("(u - 1/2)**2 - a**2/10**12"), "T", case="start well barrier"
            ),
            lambda: sa.escape_time(sa.Drift("(u - 1/2)**2"), "0.1", 2, method="uniform"),
        ],
    ),
    "other case": Refused(
        sa.expand,
        FRICTION,
        "T",
        case="start well",
        then=[lambda: sa.expand(FRICTION, "T", case="start well barrier")],
    ),
    "general P": Refused(
        sa.expand, sa.Drift.general(), "P", then=[lambda: sa.expand(SLIDING, "P")]
    ),
    "sliding case": Refused(
        sa.expand,
        sa.Drift("a + b*u - c*u**3"),
        "P",
        case="barrier well",
        then=[
            lambda: sa.expand(sa.Drift("a + b*u - c*u**3"), "P", case="well"),
            lambda: sa.expand(sa.Drift("a + b*u - c*u**3"), "P", case="well barrier well"),
        ],
    ),
    "no pair covered": Refused(
        sa.expand,
        sa.Drift("2 - u**3"),
        "T",
        noise="uniform",
        then=[lambda: sa.escape_time(sa.Drift("2 - u**3"), "0.1", 2, method="uniform")],
    ),
    "general moments": Refused(
        sa.expand,
        sa.Drift.general(),
        "T",
        noise="strong",
        then=[lambda: sa.expand(FRICTION, "T", noise="strong")],
    ),
    "beyond float64": Refused(
        _released,
        kappa="0.001",
        eps="0.0001",
        method="frozen",
        then=[
            lambda: sa.escape_time(BLOCK.frozen("-0.4"), "0.001", 10, log=True),
            lambda: _released(kappa="0.1", eps="0.0001", method="march"),
        ],
    ),
    "first order beyond float64": Refused(
        _released,
        kappa="0.01",
        eps="0.0001",
        method="first_order",
        then=[
            lambda: sa.escape_time(BLOCK.frozen("-0.4"), "0.01", 10, log=True),
            lambda: _released(kappa="0.1", eps="0.0001", method="march"),
        ],
    ),
    "clock": Refused(
        _released,
        kappa=3,
        r=12,
        eps="0.1",
        then=[
            lambda: _released(kappa=3, r=5, eps="0.1"),
            lambda: _released(
                kappa=3, r=12, eps="0.1", method="simulate", paths=9, seed=1, step=0.01
            ),
        ],
    ),
    "elements": Refused(
        _released,
        kappa="0.001",
        then=[
            lambda: _released(kappa="0.1"),
            lambda: _released(kappa="0.001", r=2, method="simulate", paths=5, seed=1, step=0.01),
        ],
    ),
    "no antiderivative": Refused(
        lambda: FRACTION.expression_in(), then=[lambda: FRACTION.evaluate(10)]
    ),
    "maxima that SymPy does not find": Refused(
        lambda: BELL.expression_in(),
        then=[lambda: BELL.expression_in(saddles=(0,)), lambda: BELL.evaluate(10)],
    ),
    "flat end": Refused(
        lambda: _plain("cos(x)", ends=(0, "pi")).expression_in(),
        then=[lambda: _plain("cos(x)", ends=(0, "pi")).evaluate(10)],
    ),
    "flat weight": Refused(
        lambda: _plain("-x**2", g="x**60").evaluate(10),
        then=[lambda: _plain("-x**2", g="x**60", order=40).evaluate(10)],
    ),
    "functions": Refused(
        sa.laplace_integral,
        "gamma(x)",
        1,
        "x",
        1,
        2,
        then=[lambda: sa.laplace_integral("-x**2*exp(x)", 1, "x", 1, 2)],
    ),
    "local": Refused(
        sa.escape_time,
        FRICTION,
        "0.1",
        10,
        method="local",
        order=1,
        then=[
            lambda: sa.escape_time(FRICTION, "0.1", 10, method="local"),
            lambda: sa.escape_time(FRICTION, "0.1", 10, method="uniform", order=1),
        ],
    ),
    "local far from the coalescence": Refused(
        sa.escape_time,
        FAR,
        0.016,
        1.5,
        start=0.3,
        method="local",
        then=[
            lambda: sa.escape_time(FAR, 0.016, 1.5, start=0.3, method="uniform"),
            lambda: sa.escape_time(FAR, 0.016, 1.5, start=0.3, method="exact"),
        ],
    ),
    "own error": Refused(
        sa.escape_time,
        FRICTION,
        1,
        10,
        rtol=1e-3,
        then=[
            lambda: sa.escape_time(FRICTION, 1, 10),
            lambda: sa.escape_time(FRICTION, 1, 10, rtol=1e-3, method="auto"),
        ],
    ),
    "no sliding": Refused(
        sa.occupation, FRICTION, 1, then=[lambda: sa.escape_time(FRICTION, 1, 10)]
    ),
    "general": Refused(
        sa.escape_time,
        sa.Drift.general(),
        "0.1",
        2,
        then=[lambda: sa.escape_time(FRICTION, "0.1", 2)],
    ),
    "paper C, start": Refused(sa.exit_probability, CROSSING, 1, 10, method="paper", start="0.1"),
    "paper C, signs": Refused(sa.exit_probability, SLIDING, "0.1", 10, method="paper", full=True),
    "paper C, r": Refused(sa.exit_probability, CROSSING, "0.1", 2, method="paper"),
    "paper C, V": Refused(sa.exit_probability, sa.Drift("7*u**2 - 6"), "0.1", 4, method="paper"),
    "paper C, kappa": Refused(
        sa.exit_probability,
        CROSSING,
        10,
        4,
        method="paper",
        then=[
            lambda: sa.exit_probability(CROSSING, 10, 4),
            lambda: sa.exit_probability(CROSSING, 10, 4, method="bound"),
        ],
    ),
    "paper T, start": Refused(sa.escape_time, FRICTION, "0.1", 10, method="paper", start="0.1"),
    "paper T, region": Refused(sa.escape_time, SLIDING, 1, 10, method="paper"),
    "paper T, zeros": Refused(
        sa.escape_time, sa.Drift("7*u**4 - 7*u**2 + 1"), "0.1", 10, method="paper"
    ),
    "auto": Refused(sa.escape_time, FRICTION, 1, 10, method="auto"),
    "auto, digits": Refused(sa.escape_time, FRICTION, 1, 10, method="auto", rtol="1e-20"),
    "no closed form": Refused(
        sa.emit,
        "eq:Ttilde",
        then=[lambda: _emitted(FRICTION), lambda: sa.escape_time(FRICTION, 1, 10)],
    ),
    "drag_time": Refused(sa.escape_time, FRICTION, 1, 10, drag_time=3),
    "workers": Refused(
        sa.escape_time,
        FRICTION,
        [0.1, 1],
        10,
        workers=2,
        then=[
            lambda: sa.escape_time(FRICTION, [0.1, 1], 10, workers=2, dps=15),
            lambda: sa.escape_time(FRICTION, [0.1, 1], 10),
        ],
    ),
    "label": Refused(sa.formula, 3, then=[lambda: sa.formula(sa.labels()[0])]),
    "labels": Refused(sa.formula, "qqq", then=[lambda: sa.formula(sa.labels()[0])]),
    "varies fast": Refused(sa.escape_time, sa.tanh(3, 1, 5), 8, 2, method="laplace"),
    "lam f beyond its digits": Refused(
        sa.laplace_integral("10**60*(x/3 + sin(x) - x**3)", 1, "x", -1, 1).evaluate,
        3,
        dps=20,
        then=[
            lambda: sa.laplace_integral(
                "10**60*(x/3 + sin(x) - x**3)", 1, "x", -1, 1, dps=100
            ).evaluate(3, dps=20)
        ],
    ),
    "integral in float64": Refused(sa.laplace_integral("3 - x**2", 1, "x", -1, 1).evaluate, 1000),
    "integral's digits": Refused(
        sa.laplace_integral("-x**2 - x**3/10", 1, "x", -1, 1, dps=20).evaluate,
        10,
        dps=80,
        then=[
            lambda: sa.laplace_integral("-x**2 - x**3/10", 1, "x", -1, 1, dps=100).evaluate(
                10, dps=80
            )
        ],
    ),
    "coefficients": Refused(
        lambda: _plain("-x**2").coefficients(),
        then=[
            lambda: (
                sa.uniform_integral("c*x - x**3/3", (1, 1), "x", "-oo", "oo", order=1)
                .bind(c="-1/4")
                .coefficients()
            )
        ],
    ),
    "derivatives in float64": Refused(
        sa.sensitivity,
        SLIDING,
        ["1e-150"],
        1e10,
        then=[lambda: sa.sensitivity(SLIDING, "1e-150", 1e10, dps=20)],
    ),
    "array with dps": Refused(
        sa.sensitivity,
        FRICTION,
        [0.1, 0.2],
        10,
        dps=20,
        then=[lambda: sa.sensitivity(FRICTION, 0.1, 10, dps=20)],
    ),
    "array": Refused(
        sa.escape_time,
        FRICTION,
        [0.001, 1],
        10,
        then=[
            lambda: sa.escape_time(FRICTION, [0.001, 1], 10, errors="nan"),
            lambda: sa.escape_time(FRICTION, [0.001, 1], 10, log=True),
            lambda: sa.escape_time(FRICTION, [0.001, 1], 10, dps=20),
        ],
    ),
    "log": Refused(sa.escape_time, FRICTION, "0.001", 10),
    "log with dps": Refused(sa.exit_probability, CROSSING, "1e-140", "1e100", log=True),
    "kappa squared": Refused(
        sa.escape_time,
        SLIDING,
        ["1e-152"],
        2,
        log=True,
        then=[lambda: sa.escape_time(SLIDING, ["1e-152"], 2, log=True, dps=20)],
    ),
    "drift": Refused(
        sa.escape_time, 3, 1, 2, then=[lambda: sa.escape_time(sa.friction(3, 1, -1), 1, 2)]
    ),
    "parameters": Refused(
        sa.escape_time,
        sa.friction(mu=3, z0=-1),
        1,
        10,
        then=[lambda: sa.escape_time(sa.friction(mu=3, z0=-1).bind(alpha=1), 1, 10)],
    ),
    "emit uniform digits": Refused(
        _emitted,
        FRICTION,
        "mpmath",
        method="uniform",
        then=[
            lambda: sa.escape_time(FRICTION, "0.1", 10, method="uniform", dps=20),
            lambda: _emitted(FRICTION, "mpmath"),
        ],
    ),
    "strong formula": Refused(
        sa.expand,
        LINES,
        "T",
        noise="strong",
        then=[lambda: sa.escape_time(LINES, 5, 2, method="strong_noise")],
    ),
    "reduction": Refused(
        sa.System.of,
        ("drift", 1),
        "z",
        "y",
        then=[
            lambda: sa.reduce(
                ("-1 - z", "-1"), ("1 - z", "-1"), ("s - z", "-1"), (1, 0), ("y", "z")
            )
        ],
    ),
    "noise of u": Refused(
        lambda method: sa.release(
            sa.System("-u - z", "-1", noise="1 + u**2"),
            1,
            2,
            eps="0.1",
            start=(0, 0),
            method=method,
            **({"paths": 20} if method == "simulate" else {}),
        ),
        "frozen",
        then=[
            lambda: sa.release(
                sa.System("-u - z", "-1", noise="1 + u**2"),
                1,
                2,
                eps="0.1",
                start=(0, 0),
                method="march",
            ),
            lambda: sa.release(
                sa.System("-u - z", "-1", noise="1 + u**2"),
                1,
                2,
                eps="0.1",
                start=(0, 0),
                method="simulate",
                paths=20,
                seed=1,
            ),
        ],
    ),
    "uniform formula": Refused(
        sa.expand,
        WAVES,
        "T",
        noise="uniform",
        then=[lambda: sa.escape_time(WAVES, "0.1", 2, method="uniform")],
    ),
    "uniform case": Refused(
        sa.expand,
        sa.friction(),
        "T",
        noise="uniform",
        case="barrier well start barrier",
        then=[lambda: sa.escape_time(FRICTION, "0.1", 10, method="uniform")],
    ),
    "analytic": Refused(sa.Drift, "gamma(u)", then=[lambda: sa.Drift("exp(u) - u**(1/2 + 1/2)")]),
    "emitted function": Refused(
        sa.emit, sympy.zeta(sympy.Symbol("x")), "c", then=[lambda: sympy.zeta(sympy.Float(2))]
    ),
    "multiple zero at the start": Refused(
        sa.escape_time, sa.Drift("u**3 - u**2"), "0.1", 2, method="uniform"
    ),
    "multiple zero beside": Refused(
        sa.escape_time, sa.Drift("(u - 1/5)**2"), "0.1", 2, start="1/5", method="laplace"
    ),
    "no sign": Refused(
        sa.escape_time,
        CUBIC,
        0.016,
        1.5,
        start=0.3,
        method="local",
        then=[
            lambda: sa.escape_time(CUBIC, 0.016, 1.5, start=0.3, method="uniform", log=True),
            lambda: sa.escape_time(CUBIC, 0.016, 1.5, start=0.3, method="exact"),
        ],
    ),
    "weakest noise": Refused(sa.escape_time, CROSSING, "1e-200", 2),
    "weakest noise in an array": Refused(sa.escape_time, CROSSING, [0.1, 1e-200], 2),
    "weakest noise, a text in an array": Refused(
        sa.escape_time,
        CROSSING,
        ["1e-320", "1/10"],
        2,
        then=[
            lambda: sa.escape_time(CROSSING, ["1e-320", "1/10"], 2, method="laplace", dps=20),
            lambda: sa.escape_time(CROSSING, ["1e-320", "1/10"], 2, errors="nan"),
        ],
    ),
    "weakest noise, digits": Refused(sa.escape_time, CROSSING, "1e-200", 2, dps=20),
    "multiple zero near the start": Refused(
        sa.escape_time,
        sa.Drift("(u - 1/5)**2*(u + 2)"),
        "0.01",
        2,
        start="0.2000000000001",
        method="uniform",
    ),
    "multiple zero, but for rounding": Refused(
        sa.escape_time, sa.Drift("(u - 1/5)**2"), "0.1", 2, start=0.2, method="uniform"
    ),
    "well": Refused(
        sa.emit,
        "eq:Ttildesmall",
        drift=sa.hill(),
        then=[lambda: sa.emit("eq:Ttildesmall", drift=sa.friction())],
    ),
    "bind": Refused(
        sa.laplace_integral(-sympy.Symbol("a", positive=True) * U**2, 1, "u", -1, 1).evaluate,
        3,
        then=[
            lambda: (
                sa.laplace_integral(-sympy.Symbol("a", positive=True) * U**2, 1, "u", -1, 1)
                .bind(a=2)
                .evaluate(3)
            )
        ],
    ),
    "noise": Refused(sa.expand, FRICTION, "T", noise="wek"),
    "errors": Refused(sa.escape_time, FRICTION, [0.1, 1], 10, errors="ignore"),
    "target": Refused(sa.emit, "fr1", target="matlab"),
    "whole number": Refused(sa.sine, 1, 1, 1, waves=0),
    "order of strong noise": Refused(
        sa.escape_time, SLIDING, 10, 2, method="strong_noise", order="optimal"
    ),
    "emitted method": Refused(_emitted, FRICTION, method="exakt"),
    # Command line.
    "--set": Refused(
        command,
        "value",
        "escape-time",
        "--drift",
        "friction",
        "--set",
        "mu",
        "--kappa",
        "1",
        "--r",
        "10",
        then=[lambda: done(*VALUE)],
    ),
    "--set of show": Refused(
        command,
        "show",
        "expansion:T",
        "--set",
        "mu=3",
        then=[
            lambda: done("show", "expansion:T", "--drift", "friction", "--set", "mu=3"),
            lambda: done("show", "expansion:T", "--expr", "mu/2 - u", "--set", "mu=1"),
        ],
    ),
    "--out": Refused(
        command,
        *("emit", "fr1", "--target", "c", "-o", ""),
        then=[lambda: done("emit", "fr1", "--target", "c", "--out", "fr1.c")],
    ),
    "no label": Refused(
        command, "show", then=[lambda: done("show", "--all"), lambda: done("show", "fr1")]
    ),
    "--all": Refused(
        command,
        "show",
        "fr1",
        "--all",
        then=[lambda: done("show", "--all"), lambda: done("show", "fr1")],
    ),
    "--phi": Refused(
        command,
        *RELEASE,
        "--phi",
        "-u - z",
        then=[
            lambda: done(*RELEASE),
            lambda: done(*RELEASE, "--phi", "-u - z", "--velocity", "-1"),
        ],
    ),
    "--set of release": Refused(
        command,
        *RELEASE,
        "--set",
        "mu=3",
        "--phi",
        "-u - z",
        "--velocity",
        "-1",
        then=[lambda: done(*RELEASE, "--phi", "-3*u - z", "--velocity", "-1")],
    ),
}

#: What in a message advises a call or an option.
ADVICE = re.compile(
    r"\bsa\.\w+|\b[a-z_]\w*=(?:…|n\b|True|False|'|\"|–)|\bbind\(–|\b\w+\((?:\)|…|\w+=)|(?<![\w-])--[a-z]"
    r"|\bsymasym [a-z]|\bpip install|\buse (?!of)|\bpass |\btry |\btake (?:method|numbers)"
    r"|ask for (?:escape_time|T)|give one of (?!these)|give .* from (?:–|\d+) to (?:–|\d)"
)

#: Messages with advice that is not followed here: their beginnings, and why.
NOT_FOLLOWED = {
    "a scheduler needs dask": "an installation",
    "flint.ctx.cap was changed": "another thread at work",
    "– was computed with": "another version of a library",
    "– is not the value that this spec": "tests/tables do",
    "--scene is –": "a report, of minutes",
    "– is no relation": "for derivations",
    "– is no status": "for derivations",
    "– rests on –": "for derivations",
    "proved derivatives would take": "for the differences that sensitivity takes then",
    "V of – has no proved upper bound": "seen for extreme steepness alone",
    "– of – paths are held": "a million steps",
    "no proved bound of A was found": "not brought about",
    "A is – to order –": "not brought about",
    "A varies too fast, or nearly": "followed in 'varies fast', another noise",
    "the irrational constants": "not brought about",
    "kappa is –, so small that": "not brought about",
    "d log(–)/d(–) is outside": "not brought about",
    "eps has an entry –": "not brought about",
    "h g/f' = –": "not brought about",
    "f' of – has": "not brought about",
    "no pair of saddles": "not brought about",
    "a power – of a number": "not brought about",
    "kappa is –, where the two bounds": "not brought about",
    "f = – has no two saddles": "not brought about",
    "– has no value; set it with bind": "followed in 'parameters', where all are listed",
    "– may be complex": "not brought about",
}


@cache
def advising() -> dict[str, re.Pattern[str]]:
    """The messages that advise a call or an option, with what they look like when raised."""
    texts = {re.sub(r"\s+", " ", text) for _, text in ALL if ADVICE.search(text)}
    return {x: re.compile(".*".join(map(re.escape, x.split("–"))), re.DOTALL) for x in texts}


def test_every_advice_is_followed() -> None:
    told = [x.message for x in REFUSED.values()]
    left = [text for text, like in advising().items()
            if not any(map(like.fullmatch, told))
            and not any(text.startswith(x) for x in NOT_FOLLOWED)]  # fmt: skip
    assert not left, "\n".join(left)


def test_what_is_not_followed_is_there() -> None:
    for beginning in NOT_FOLLOWED:
        assert any(text.startswith(beginning) for text in advising()), beginning


@pytest.mark.parametrize("name", REFUSED)
def test_advice_that_is_followed_helps(name: str) -> None:
    refused = REFUSED[name]
    assert ADVICE.search(refused.message), refused.message
    calls = list(refused.advised())
    assert calls, f"no call follows from: {refused.message}"
    for call in calls:
        assert call() is not None
