"""Text is never code: what strangers can hand in is parsed, bounded, and answered in a sentence."""

from __future__ import annotations

import importlib
import random
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from sympy.parsing import sympy_parser

import symasym as sa
from symasym.commands.main import main
from symasym.drift import texts
from tests.strategies import random_formula

U, A = sympy.symbols("u a")

READ = {
    "1/2 - 2*u + a*u**3": sympy.Rational(1, 2) - 2 * U + A * U**3,
    "0.1 - u^3": sympy.Rational(1, 10) - U**3,
    "-u**2": -(U**2),
    "-2**-1": -sympy.Rational(1, 2),
    "2**3**2": sympy.Integer(512),
    "2^3^2 + -u^2": 512 - U**2,
    "u - 1 - 2": U - 3,
    "8/2/2*u": 2 * U,
    "1.5e-3*u": sympy.Rational(3, 2000) * U,
    "exp(-u)*cos(2*u + a) - u/3": sympy.exp(-U) * sympy.cos(2 * U + A) - U / 3,
    "ln(E) + sqrt(4) + pi": 3 + sympy.pi,
    "oo - I*pi": sympy.oo - sympy.I * sympy.pi,
    "S*u + N": sympy.Symbol("S") * U + sympy.Symbol("N"),
    "lambda*u": sympy.Symbol("lambda") * U,
    "inf*u": sympy.Symbol("inf") * U,  # not the keyword in
}  # fmt: skip


@pytest.mark.parametrize("text", READ)
def test_what_a_text_means(text: str) -> None:
    assert texts.read("A", text) == READ[text]


#: Code; what looks like a formula and is none; names, paths and formulas of other languages.
CODE = [
    "__import__('os').system('touch hacked')", "().__class__.__base__", "u.__class__", "[u][0]",
    "eval('1')", "exec(u)", "open(u)", "lambda: u", "(lambda u: u)(1)", "u if u else 1", "u; u",
    "u = 1", "u := 1", "print(u)", "Symbol(u)", "sympify(u)", "Function(u)", "f'{u}'", "'a'", "u@u",
    "`id`", "$(id)", "{u}", "<script>", "../../etc", "u\x00", "ü", "u!", "0x10", "1_000", "1..2",
    "\u0435**2 + u", "\uff12*u", "1 \u2212 u", "u\u00b2", "\U0001d462 - 1", "u\u202e-1",
    "u\u200b**2", "\u00bd - u", "\u221e", "$u$", "u$1", "\\input{/etc/passwd}",
    "</script><script>alert(1)", "u'\n'u", "u # 1", "u /* 1 */", "%s%n", "{0.__class__}",
    "=cmd|' /C calc'!A0", "@SUM(1)", "/dev/zero", "file:///etc/passwd", "~root/.x", "\ufeffu",
    "\x1b]0;x\x07u", "1 << 99999",
]  # fmt: skip
_SQUARES = "1+sqrt(2)"
for _ in range(40):
    _SQUARES = f"({_SQUARES})^2"
#: Texts whose value would fill the memory or take for ever.
HUGE = [
    "9**9**9", "9**9**9**9", "1e999999999", "*".join(["1e99999"] * 9),
    "(" * 3000 + "u" + ")" * 3000,
    "u**(10**9)", "(((u+1)**50)**50)**50", "2**(u*10**12)", "exp(10**12*log(2))", "gamma(10**9)",
    "sqrt(10**90000+7)", "tan(10**90000)", "2**(10**9+1/2)", "(1+sqrt(2))**(10**9)", "u" * 20_000,
    "*".join(["(u+1)**90"] * 30), "7**" * 50 + "7", "1" * 9_000, "log(" * 12 + "2" + ")" * 12,
    _SQUARES, "sqrt(" * 50 + "2+u" + ")" * 50, "gamma(gamma(10))", "exp(exp(exp(u)))",
    "(cosh(9)+1)**2000", "2**(exp(9)**exp(9))", "((sin(u)+1)**2000+1)**2000", "cbrt(10**1990+1)",
    "(sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7)+sqrt(11))**99", "erfc(10**1999)",
    "1/(u+" * 61 + "1" + ")" * 61,
]  # fmt: skip
WRONG = ["", " ", "u +", "*", "sin", "sin()", "sin(u, u)", "(u", "u)", "1.2.3", "u == 1",
         "Max(u, 2)", "Abs(u)", "Piecewise((u, True))", "u u", "2 u", ","]  # fmt: skip
HANDFUL = [
    CODE[0],
    "u.__class__",
    "9**9**9",
    "exp(exp(exp(u)))",
    "(" * 3000 + "u" + ")" * 3000,
    "u +",
]


@pytest.mark.parametrize("text", [*CODE, *HUGE, *WRONG])
def test_hostile_and_malformed_texts_are_refused(text: str) -> None:
    with pytest.raises(sa.InputError, match=r"^A .*\.$") as caught:
        texts.read("A", text)
    assert len(str(caught.value)) < 400


# -- every entry -----------------------------------------------------------------------------------


def _reduced(noise: Any = ((1,), (0,)), f: Any = "1 - z", **options: Any) -> Any:
    return sa.reduce((f, "-1"), ("-1 - z", "-1"), ("-s - z", "-1"), noise, ("y", "z"), **options)


def _integral(f: Any = "-x**2", g: Any = 1, x: Any = "x", a: Any = 0, b: Any = 1) -> Any:
    return sa.laplace_integral(f, g, x, a, b)


def _told(*words: str) -> None:
    """A command's refusal as an error."""
    if main(list(words)):
        raise sa.InputError("told by the command.")


OSCILLATOR = sa.oscillator(3, 1)
INTEGRAL = _integral(f=-sympy.Symbol("a", positive=True) * sympy.Symbol("x") ** 2)
ENTRIES: dict[str, Callable[[Any], Any]] = {
    "Drift": lambda t: sa.Drift(t),
    "variable": lambda t: sa.Drift("1 - u", t),
    "symbol": lambda t: sa.Drift(sympy.Symbol(str(t)) * U),
    "laplace f": lambda t: _integral(f=t),
    "laplace g": lambda t: _integral(g=t),
    "laplace end": lambda t: _integral(a=t),
    "laplace variable": lambda t: _integral(x=t),
    "laplace parameter": lambda t: INTEGRAL.bind(a=t),
    "uniform f": lambda t: sa.uniform_integral(t, 1, "x", 0, 1),
    "uniform g": lambda t: sa.uniform_integral("-x**2", t, "x", 0, 1),
    "uniform near": lambda t: sa.uniform_integral("-x**2", 1, "x", 0, 1, near=t),
    "reduce": lambda t: _reduced(f=t),
    "reduce, noise": lambda t: _reduced(((t,), (0,))),
    "reduce, point": lambda t: _reduced(at={"z": t}),
    "bind": lambda t: sa.Drift("u*a").bind(a=t),
    "friction": lambda t: sa.friction(t, 1, 0),
    "kappa": lambda t: sa.escape_time(sa.linear(1, 1), t, 1),
    "method": lambda t: sa.escape_time(sa.linear(1, 1), 1, 1, method=t),
    "formula": lambda t: sa.formula(t),
    "emit": lambda t: sa.emit(t),
    "emit, target": lambda t: sa.emit("eq:T", t),
    "emit, name": lambda t: sa.emit(U + 1, name=t),
    "emit, parameter": lambda t: sa.emit("fr1", "numpy", {"mu": t}),
    "velocity of u": lambda t: sa.System(t, "-1"),
    "velocity of z": lambda t: sa.System("1 - z - u", t),
    "noise of u": lambda t: sa.System("1 - z - u", "-1", t),
    "oscillator": lambda t: sa.oscillator(mu=t, alpha=1),
    "release, start": lambda t: sa.release(OSCILLATOR, 1, 2, eps=1, start=(0, t)),
    "expand": lambda t: sa.expand(sa.friction(), t),
    "expand, case": lambda t: sa.expand(sa.friction(), case=t),
    "expand, start": lambda t: sa.expand(sa.friction(), start=t),
    "plot": lambda t: sa.plot(t, sa.linear(1, 1), [1, 2], 2),
    "sensitivity": lambda t: sa.sensitivity(sa.linear(1, 1), 1, 2, quantity=t),
    "command": lambda t: _told(
        "value", "escape-time", f"--expr={t}", "--kappa", "1", "--r", "2"
    ),
    "command, number": lambda t: _told(
        "value", "escape-time", "--drift", "friction", "--set", "alpha=1", "--set", "z0=0",
        "--set", f"mu={t}", "--kappa", "1", "--r", "2",
    ),
    "show": lambda t: _told("show", "--", t),
    "show, expression": lambda t: _told("show", "expansion:T", f"--expr={t}"),
    "emit command": lambda t: _told("emit", "--target=c", "--", t),
    "release command": lambda t: _told(
        "release", "--kappa=1", "--r=2", "--eps=0.1", "--z=0", f"--phi={t}", "--velocity=-1"
    ),
}  # fmt: skip


@pytest.fixture(autouse=True)
def _nothing_is_run(monkeypatch: Any, tmp_path: Path) -> Iterator[None]:
    """SymPy's parser, which runs texts as Python, is given nothing; no file appears."""
    run: list[str] = []
    importlib.import_module("sympy.physics.units")  # which names its units so
    monkeypatch.setattr(sympy_parser, "eval_expr", lambda code, *_: run.append(code))
    monkeypatch.chdir(tmp_path)
    yield
    assert run == []
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("entry", ENTRIES)
def test_every_entry_refuses(entry: str, capsys: Any) -> None:
    for text in HANDFUL:
        with pytest.raises((sa.SymasymError, SystemExit)):
            ENTRIES[entry](text)


@pytest.mark.parametrize(
    "entry",
    [
        e
        for e in ENTRIES
        if not {"command", "show", "symbol", "formula"} & {*e.replace(",", "").split()}
    ],
)
def test_no_text_inside_another_object_is_run(entry: str) -> None:
    text = CODE[0]
    for given in (
        (text,), [text], {text: 1}, {text}, ((text,),), np.array([text]),
        np.array(text, dtype=object), np.str_(text), text.encode(),
    ):  # fmt: skip
        with pytest.raises(sa.SymasymError):
            ENTRIES[entry](given)


# -- random texts ----------------------------------------------------------------------------------

_WORDS = [*"uabxIE+-*/^(),.0123456789<>=", "**", "pi", "oo", "1e9", "1e-99", "Piecewise", "True",
          *texts.FUNCTIONS, "__class__", "import", "lambda", "'", '"', "[", "]", " "]  # fmt: skip


@pytest.mark.parametrize("count", [400, pytest.param(10_000, marks=pytest.mark.slow)])
def test_random_text(count: int) -> None:
    draw, read = random.Random(4), 0
    for number in range(count):
        garbage = "".join(draw.choice(_WORDS) for _ in range(draw.randrange(1, 30)))
        try:
            texts.read("A", random_formula(draw, 4) if number % 2 else garbage)
            read += 1
        except sa.InputError:
            pass
    assert read > count / 6
