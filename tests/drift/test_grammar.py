"""Text is never code: what strangers can hand in is parsed, bounded, and answered in a sentence."""

from __future__ import annotations

import importlib
import random
import re
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from sympy.parsing import sympy_parser

import symasym as sa
from symasym.commands.main import main
from symasym.drift import grammar
from symasym.numbers.trees import FUNCTIONS
from tests.searches.random_calls import random_formula

U, A = sympy.symbols("u a")

READ = {
    "1/2 - 2*u + a*u**3": sympy.Rational(1, 2) - 2 * U + A * U**3,
    "0.1 - u^3": sympy.Rational(1, 10) - U**3,
    "-u**2": -(U**2),
    "-2**-1": -sympy.Rational(1, 2),
    "2**3**2": sympy.Integer(512),
    "u - 1 - 2": U - 3,
    "8/2/2*u": 2 * U,
    "1.5e-3*u": sympy.Rational(3, 2000) * U,
    "exp(-u)*cos(2*u + a) - u/3": sympy.exp(-U) * sympy.cos(2 * U + A) - U / 3,
    "ln(E) + sqrt(4) + pi": 3 + sympy.pi,
    "Piecewise((2*u, u < 0), (-u, True))": sympy.Piecewise((2 * U, U < 0), (-U, True)),
    "Max(u, -2*u)": sympy.Max(U, -2 * U),
    "oo - I*pi": sympy.oo - sympy.I * sympy.pi,
    "S*u + N": sympy.Symbol("S") * U + sympy.Symbol("N"),
}  # fmt: skip


@pytest.mark.parametrize("text", READ)
def test_what_a_text_means(text: str) -> None:
    assert grammar.read("A", text) == READ[text]


#: Code, and texts whose value would fill the memory or take for ever.
CODE = [
    "__import__('os').system('touch hacked')", "().__class__.__base__", "u.__class__", "[u][0]",
    "eval('1')", "exec(u)", "open(u)", "lambda: u", "(lambda u: u)(1)", "u if u else 1", "u; u",
    "u = 1", "u := 1", "print(u)", "Symbol(u)", "sympify(u)", "Function(u)", "f'{u}'", "'a'", "u@u",
    "`id`", "$(id)", "{u}", "<script>", "../../etc", "u\x00", "ü", "u!", "0x10", "1_000", "1..2",
]  # fmt: skip
HUGE = [
    "9**9**9", "9**9**9**9", "1e999999999", "*".join(["1e99999"] * 9),
    "(" * 3000 + "u" + ")" * 3000,
    "u**(10**9)", "(((u+1)**50)**50)**50", "2**(u*10**12)", "exp(10**12*log(2))", "gamma(10**9)",
    "sqrt(10**90000+7)", "tan(10**90000)", "2**(10**9+1/2)", "(1+sqrt(2))**(10**9)", "u" * 20_000,
    "*".join(["(u+1)**90"] * 30), "7**" * 50 + "7", "1" * 9_000,
    "log(" * 12 + "2" + ")" * 12,
]  # fmt: skip
#: What looks like a formula and is none; how numbers grow by powers, roots and functions; names,
#: paths and formulas of other languages.
_SQUARES = "1+sqrt(2)"
for _ in range(40):
    _SQUARES = f"({_SQUARES})^2"
CODE += [
    "\u0435**2 + u", "\uff12*u", "1 \u2212 u", "u\u00b2", "\U0001d462 - 1", "u\u202e-1",
    "u\u200b**2", "\u00bd - u", "\u221e", "$u$", "u$1", "\\input{/etc/passwd}",
    "</script><script>alert(1)", "u'\n'u", "u # 1", "u /* 1 */", "%s%n", "{0.__class__}",
    "=cmd|' /C calc'!A0", "@SUM(1)", "/dev/zero", "file:///etc/passwd", "~root/.x", "\ufeffu",
    "\x1b]0;x\x07u", "1 << 99999",
]  # fmt: skip
HUGE += [
    _SQUARES, "sqrt(" * 50 + "2+u" + ")" * 50, "gamma(gamma(10))", "exp(exp(exp(u)))",
    "(cosh(9)+1)**2000", "2**(exp(9)**exp(9))", "((sin(u)+1)**2000+1)**2000", "cbrt(10**1990+1)",
    "(sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7)+sqrt(11))**99", "erfc(10**1999)",
    "1/(u+" * 61 + "1" + ")" * 61,
]  # fmt: skip
WRONG = ["", " ", "u +", "*", "sin", "sin()", "sin(u, u)", "(u", "u)", "1.2.3", "u == 1",
         "Max(I, 2)", "Piecewise((1, u))", "u u", "2 u", ","]  # fmt: skip


@contextmanager
def seconds(count: int) -> Iterator[None]:
    """Fail where it takes for ever (a busy machine is no failure)."""

    def late(*_: Any) -> None:
        raise AssertionError("no answer")

    signal.signal(signal.SIGALRM, late)
    signal.alarm(count)
    try:
        yield
    finally:
        signal.alarm(0)


def _told(code: int) -> None:
    """A command's refusal as an error."""
    if code:
        raise sa.InputError("told by the command.")


def _value(*options: str) -> None:
    _told(main(["value", "escape-time", *options, "--kappa", "1", "--r", "2"]))


def _table(line: str, text: str) -> None:
    quoted = text.replace("\\", "\\\\").replace('"', '\\"').replace("\x00", "\\u0000")
    lines = {"quantities": '["T"]', "dps": "15", "kappa": '"1"', "r": '"2"', "expr": '"a - u"'}
    parameters = {"a": '"1"'}
    key = line.partition(".")
    if key[0] == "parameters":
        parameters[f'"{quoted}"' if key[2] == "?" else key[2]] = f'"{quoted}"'
    else:
        lines[f'"{quoted}"' if line == "?" else line] = f'"{quoted}"'
    if line == "drift":
        del lines["expr"]
    written = [*lines.items(), ("[parameters]", ""), *parameters.items()]
    Path("t.toml").write_text("\n".join(f"{k} = {v}" if v else k for k, v in written) + "\n")
    _told(main(["table", "t.toml", "-o", "t.jsonl"]))


FRICTION = ["--drift", "friction", "--set", "alpha=1", "--set", "z0=0"]
RELEASE = ["release", "--kappa", "1", "--r", "2", "--eps", "0.1", "--z", "0"]
SHOWN = ["show", "expansion:T", "--drift", "friction"]


def _released(*options: str) -> None:
    _told(main([*RELEASE, *options]))


def _drawn(*options: str) -> None:
    _told(main(["figure", *options, "-o", "f.png"]))


def _reduced(noise: Any = ((1,), (0,)), **options: Any) -> Any:
    return sa.reduce(
        ("1 - z", "-1"), ("-1 - z", "-1"), ("-s - z", "-1"), noise, ("y", "z"), **options
    )


ENTRIES: dict[str, Callable[[str], Any]] = {
    "Drift": lambda t: sa.Drift(t),
    "a_minus": lambda t: sa.Drift("u", a_minus=t),
    "laplace f": lambda t: sa.laplace_integral(t, 1, "x", 0, 1),
    "laplace g": lambda t: sa.laplace_integral("-x**2", t, "x", 0, 1),
    "laplace end": lambda t: sa.laplace_integral("-x**2", 1, "x", t, 1),
    "laplace variable": lambda t: sa.laplace_integral("-x**2", 1, t, 0, 1),
    "uniform f": lambda t: sa.uniform_integral(t, 1, "x", 0, 1),
    "reduce": lambda t: sa.reduce(
        (t, "y - 1"), ("-1", "y - 1"), ("-s", "y - 1"), ((0, 1), (0, 0)), ("y", "z"), at={"z": 0}
    ),
    "bind": lambda t: sa.Drift("u*a").bind(a=t),
    "friction": lambda t: sa.friction(t, 1, 0),
    "kappa": lambda t: sa.escape_time(sa.linear(), t, 1),
    "label": lambda t: sa.formula(t),
    "emit": lambda t: sa.emit(t),
    "target": lambda t: sa.emit("eq:T", t),
    "name": lambda t: sa.emit(U + 1, name=t),
    "symbol": lambda t: sa.Drift(sympy.Symbol(t) * U),
    "emitted symbol": lambda t: sa.emit(sympy.Symbol(t) + 1, "numpy"),
    "coordinate": lambda t: sa.reduce(
        ("1", "1"), ("-1", "1"), ("-s", "1"), ((0, 1), (0, 0)), ("y", t)
    ),
    "command": lambda t: _value(f"--expr={t}"),
    "command, parameter": lambda t: _value(*FRICTION, "--set", f"mu={t}"),
    "command, name": lambda t: _value(*FRICTION, "--set", f"{t}=1"),
    "command, start": lambda t: _value(*FRICTION, "--set", "mu=1", f"--start={t}"),
    "command, method": lambda t: _value(*FRICTION, "--set", "mu=1", f"--method={t}"),
    "uniform g": lambda t: sa.uniform_integral("-x**2", t, "x", 0, 1),
    "uniform near": lambda t: sa.uniform_integral("-x**2", 1, "x", 0, 1, near=t),
    "integral's parameter": lambda t: sa.laplace_integral("-a*x**2", 1, "x", 0, 1).bind(a=t),
    "integral's lambda": lambda t: sa.laplace_integral("-x**2", 1, "x", 0, 1).expression_in(t),
    "integral's function": lambda t: sa.laplace_integral("-x**2", 1, "x", 0, 1).emit("c", t),
    "integral's maxima": lambda t: sa.laplace_integral("-x**2", 1, "x", -1, 1, maxima=[t]),
    "reduce, point": lambda t: _reduced(at={"z": t}),
    "reduce, noise": lambda t: _reduced(noise=((t,), (0,))),
    "reduction, sliding": lambda t: _reduced().sliding_at({"z": t}),
    "reduction, drag": lambda t: _reduced().drag_time(1, {"z": t}),
    "system's point": lambda t: sa.System.of(_reduced(noise=((t,), (0,))), "z", "y"),
    "emitted parameter": lambda t: sa.emit("fr1", "numpy", {"mu": t}),
    "velocity of u": lambda t: sa.System(t, "-1"),
    "velocity of z": lambda t: sa.System("1 - z - u", t),
    "noise of u": lambda t: sa.System("1 - z - u", "-1", t),
    "oscillator": lambda t: sa.oscillator(mu=t, alpha=1),
    "release, start": lambda t: sa.release(sa.oscillator(3, 1), 1, 2, eps=1, start=(0, t)),
    "release, method": lambda t: sa.release(sa.oscillator(3, 1), 1, 2, eps=1, method=t),
    "expand": lambda t: sa.expand(sa.friction(), t),
    "expand, noise": lambda t: sa.expand(sa.friction(), noise=t),
    "expand, case": lambda t: sa.expand(sa.friction(), case=t),
    "expand, start": lambda t: sa.expand(sa.friction(), start=t),
    "expansion, target": lambda t: sa.expand(sa.linear(), order=0, case="start").emit(t),
    "expansion, name": lambda t: sa.expand(sa.linear(), order=0, case="start").emit("c", t),
    "plot": lambda t: sa.plot(t, sa.linear(1, 1), [1, 2], 2),
    "plot, number": lambda t: sa.plot("T", sa.linear(1, 1), [1, 2], t),
    "sensitivity": lambda t: sa.sensitivity(sa.linear(1, 1), 1, 2, quantity=t),
    "workers": lambda t: sa.escape_time(sa.linear(1, 1), [1, 2], 2, dps=15, workers=t),
    "show": lambda t: _told(main(["show", "--", t])),
    "show, quantity": lambda t: _told(main(["show", f"expansion:{t}"])),
    "show, expression": lambda t: _told(main([*SHOWN[:2], f"--expr={t}"])),
    "show, case": lambda t: _told(main([*SHOWN, f"--case={t}"])),
    "show, noise": lambda t: _told(main([*SHOWN, f"--noise={t}"])),
    "emit command": lambda t: _told(main(["emit", "--target=c", "--", t])),
    "emit command, target": lambda t: _told(main(["emit", "folds", f"--target={t}"])),
    "emit command, expression": lambda t: _told(
        main(["emit", "eq:V", "--target=c", f"--expr={t}"])
    ),
    "emit command, number": lambda t: _told(main(["emit", "fr1", "--target=c", f"--set=mu={t}"])),
    "derive": lambda t: _told(main(["derive", "--", t])),
    "verify": lambda t: _told(main(["verify", f"--level={t}"])),
    "report": lambda t: _told(main(["report", f"--scene={t}"])),
    "figure": lambda t: _told(main(["figure", "--", t])),
    "figure, number": lambda t: _drawn("fric1", "--set", f"alpha={t}"),
    "figure, name": lambda t: _drawn("fric1", "--set", f"{t}=1"),
    "figure, points": lambda t: _drawn("fric1", "--set", f"points={t}"),
    "figure, kind": lambda t: _told(main(["figure", "fric1", "-o", f"f.{t}"])),
    "release, phi": lambda t: _released(f"--phi={t}", "--velocity=-1"),
    "release, velocity": lambda t: _released("--phi=1 - z - u", f"--velocity={t}"),
    "release, noise": lambda t: _released(f"--noise={t}"),
    "release, number": lambda t: _released("--set", f"mu={t}"),
    "release, name": lambda t: _released("--set", f"{t}=1"),
    "release, z": lambda t: _told(main([*RELEASE[:-1], t])),
    "release command, method": lambda t: _released(f"--method={t}"),
    "release, paths": lambda t: _released("--method=simulate", f"--paths={t}"),
    "table, r": partial(_table, "r"),
    "table, digits": partial(_table, "dps"),
    "table": partial(_table, "expr"),
    "table, drift": partial(_table, "drift"),
    "table, quantity": partial(_table, "quantities"),
    "table, number": partial(_table, "kappa"),
    "table, parameter": partial(_table, "parameters.a"),
    "table, name": partial(_table, "parameters.?"),
    "table, key": partial(_table, "?"),
}


#: Entries that take numbers.
NUMBERS = (
    "bind", "friction", "kappa", "command, parameter", "command, start", "table, number",
    "table, parameter", "table, r", "plot, number", "oscillator", "release, start",
    "integral's parameter", "uniform near", "emit command, number", "figure, number",
    "figure, points", "release, number", "release, z", "release, paths", "expand, start",
    "reduction, sliding", "reduction, drag", "emitted parameter", "integral's maxima",
    "reduce, point", "reduce, noise", "system's point",
)  # fmt: skip


@pytest.fixture
def nothing_is_run(monkeypatch) -> Iterator[list[str]]:
    """What SymPy's parser, which runs texts as Python, was given meanwhile."""
    run: list[str] = []
    importlib.import_module("sympy.physics.units")  # which names its units so
    monkeypatch.setattr(sympy_parser, "eval_expr", lambda code, *_: run.append(code))
    yield run
    assert run == []


#: Entries that take expressions, or numbers by a reader of their own.
_TAKE_OBJECTS = [
    "Drift", "a_minus", "laplace f", "laplace g", "laplace end", "laplace variable", "uniform f",
    "reduce", "bind", "friction", "kappa", "emit", "coordinate", "uniform g", "uniform near",
    "integral's parameter", "integral's lambda", "integral's maxima",
    "reduce, point", "reduce, noise", "reduction, sliding", "reduction, drag", "system's point",
    "emitted parameter", "velocity of u", "velocity of z",
    "noise of u", "oscillator", "release, start", "expand", "expand, start", "plot, number",
]  # fmt: skip


@pytest.mark.parametrize("entry", _TAKE_OBJECTS)
def test_no_text_inside_another_object_is_run(entry, nothing_is_run) -> None:
    text = CODE[0]
    for given in (
        (text,), [text], {text: 1}, {1: text}, {text}, frozenset([text]), ((text,),),
        np.array([text]), np.array(text, dtype=object), np.str_(text), text.encode(),
    ):  # fmt: skip
        with seconds(20), pytest.raises(sa.SymasymError):
            ENTRIES[entry](given)  # type: ignore[arg-type]


@pytest.mark.parametrize("entry", ENTRIES)
def test_hostile_text_is_answered_in_a_sentence(
    entry, tmp_path, monkeypatch, capsys, nothing_is_run
) -> None:
    monkeypatch.chdir(tmp_path)
    texts = [*CODE, *HUGE]
    if entry == "name":
        texts += ["lambda", "double", "u" * 100]
    if entry in NUMBERS:  # which are numbers for Python, too
        texts = [t for t in texts if t != "1_000" and not t.isdigit()]
    for text in texts:
        with seconds(20), pytest.raises((sa.SymasymError, SystemExit)):
            ENTRIES[entry](text)
    assert {p.name for p in tmp_path.iterdir()} <= {"t.toml"}


def test_the_page_describes_the_grammar() -> None:
    page = (Path(__file__).parents[2] / "docs" / "safety.md").read_text(encoding="utf-8")
    page = page.partition("## How an expression is written")[2].partition("## ")[0]
    rows = dict(re.findall(r"\| ([a-z ]+) \| (.*) \|", page))
    for about, arity in {"functions of one argument": (1, 1), "of two": (2, 2),
                         "of one to eight": (1, 8)}.items():  # fmt: skip
        named = re.findall(r"`(.*?)`", rows[about])[0].split()
        assert set(named) == {n for n, k in grammar.FUNCTIONS.items() if k == arity}
    assert set(re.findall(r"`(\w+)`", rows["names"])) == {"_", "u", *grammar.CONSTANTS}
    taken = re.findall(r"`([a-z ]+)`\.", page)[-1].split()
    assert taken == FUNCTIONS
    # Each limit that it states: just below it is read, beyond it is not.
    for text, beyond in (
        ("1" * 4_000, "1" * 4_001), ("2**(2000*u)", "2**(2001*u)"),
        ("gamma(u + 10000)", "gamma(u + 10001)"), ("besselj(10000, u)", "besselj(10001, u)"),
        ("10**99999", "10**120500"), ("sqrt(10**2000*u)", "sqrt(10**2500*u)"),
        ("sqrt(10**500+u)", "sqrt(10**700+7)"), ("(1+sqrt(2))**100", "(1+sqrt(2))**101"),
        ("(sqrt(2)+sqrt(3)+1)**99", "(sqrt(2)+sqrt(3)+1)**49*(1+pi)**49*(1+E)"),
        ("Max(1, 2, 3, 4, 5, 6, 7, u)", "Max(1, 2, 3, 4, 5, 6, 7, 8, u)"),
        ("2^3^2 - -u^2", "2 u"), (".5*u + 1.5e-3", "1_0*u"),
    ):  # fmt: skip
        grammar.read("A", text)
        with pytest.raises(sa.InputError):
            grammar.read("A", beyond)
    assert grammar.read("A", "2^3^2 + -u^2") == 512 - U**2


@pytest.mark.parametrize("text", [*CODE, *HUGE, *WRONG])
def test_the_sentence_names_what_is_wrong(text: str) -> None:
    with seconds(10), pytest.raises(sa.InputError) as caught:
        grammar.read("A", text)
    message = str(caught.value)
    assert message.startswith("A ")
    assert message.endswith(".")
    assert "\n" not in message
    assert len(message) < 600


_WORDS = [*"uabxIE+-*/^(),.0123456789<>=", "**", "pi", "oo", "1e9", "1e-99", "Piecewise", "True",
          *grammar.FUNCTIONS, "__class__", "import", "lambda", "'", '"', "[", "]", " "]  # fmt: skip


def _random_text(draw: random.Random) -> str:
    return "".join(draw.choice(_WORDS) for _ in range(draw.randrange(1, 30)))


@pytest.mark.parametrize("count", [600, pytest.param(10_000, marks=pytest.mark.slow)])
def test_random_text(count: int) -> None:
    draw, read = random.Random(4), 0
    for number in range(count):
        text = random_formula(draw, 4) if number % 2 else _random_text(draw)
        with seconds(20):
            try:
                grammar.read("A", text)
                read += 1
            except sa.InputError:
                pass
    assert read > count / 5
