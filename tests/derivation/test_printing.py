"""Printed formulas: read back by a reader of TeX of the tests' own, they have the same values."""

from __future__ import annotations

import random
import re
from typing import Any

import mpmath
import pytest
import sympy
from sympy import Integral, Rational, Symbol, cos, exp, sqrt
from sympy.core.function import AppliedUndef

from derivations.registry import build, entries
from symasym.derivation import Derivation, Expansion, Identity, Inequality
from symasym.derivation.printing import tex
from symasym.derivation.results import latex, parts

u, v = Symbol("u", real=True), Symbol("v", real=True)
a, b, k = (Symbol(name, positive=True) for name in ("a", "b", "kappa"))
n, lam = Symbol("n", negative=True), Symbol("lambda", positive=True)
V = sympy.Function("V")


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        (
            2 * sympy.pi * exp(2 * a / k**2) / sqrt(-n * b),
            r"\frac{2 \pi}{\sqrt{-b n}} e^{2 a/\kappa^2}",
        ),
        (sqrt(2) * sqrt(a) / sqrt(b), r"\sqrt{\frac{2 a}{b}}"),
        (sqrt(3) * a / 9, r"\frac{a}{3 \sqrt{3}}"),
        (sqrt(-sympy.pi / n), r"\sqrt{\frac{\pi}{-n}}"),
        (a * (b + 1) / (b + 2), r"\frac{a (1 + b)}{2 + b}"),
        ((1 / a - 1 / b) / k, r"\frac{1}{\kappa} \left(\frac{1}{a} - \frac{1}{b}\right)"),
        (a ** Rational(-1, 3), "a^{-1/3}"),
        (2 * 2 ** Rational(2, 3), "2^{5/3}"),
        (-a * u * (1 + b), "-a (1 + b) u"),
        (sympy.Function("T")(u, v).diff(u, 2), r"\frac{\partial^2 T}{\partial u^2}"),
        (exp((2 * V(v) - 2 * V(u)) / k**2), r"e^{2 (V(v) - V(u))/\kappa^2}"),
        (-1 + u, "u - 1"),
        # A name that is a word is one, not a product of letters.
        (Symbol("slope") * a, r"a \, \mathrm{slope}"),
        (1 - a - u**2, "1 - a - u^2"),
        (u**3 * a - u - 1, "a u^3 - u - 1"),
        (a * (u - 1) / 2, r"\frac{a}{2} (u - 1)"),
        ((a + b) / k, r"\frac{a + b}{\kappa}"),
        (cos(a) ** 3, r"\cos^3(a)"),
        (sympy.Derivative(V(u), (u, 2)) * a - V(u) * sympy.Function("phi")(u),
         r"a V''(u) - \phi(u) V(u)"),
        (sympy.airyaiprime(u) ** 2, r"\operatorname{Ai}'(u)^2"),
        (
            2 * Integral((sympy.Heaviside(v) - a) * V(v), (u, -1, v), (v, 0, b)) / k**2,
            r"\frac{2}{\kappa^2} \int_{0}^{b} \int_{-1}^{v} "
            r"(\mathbf{1}_{v > 0} - a) V(v) \, du \, dv",
        ),
        (Integral(V(u), (u, 0, a)) / Integral(V(u), (u, 0, b)),
         r"\frac{\int_{0}^{a} V(u) \, du}{\int_{0}^{b} V(u) \, du}"),
        # Falling powers in a series, and a long one behind the exponential.
        (1 / lam - 1 / lam**2 + 2 / lam**3,
         r"\frac{1}{\lambda} - \frac{1}{\lambda^2} + \frac{2}{\lambda^3}"),
        (exp(a) * (1 + k * sum(V(u) ** j / 7**j for j in range(1, 6))),
         r"e^{a} \left(1 + \kappa \left(\frac{V(u)}{7} + \frac{V^2(u)}{49} + \frac{V^3(u)}{343} "
         r"+ \frac{V^4(u)}{2401} + \frac{V^5(u)}{16807}\right)\right)"),
        (sqrt((1 + a) / a) / sqrt(3), r"\sqrt{\frac{1 + a}{3 a}}"),
        # A fraction within a fraction is on one line, or the outer one is a power.
        (a / (1 / b + a / (2 * k)), r"\frac{a}{1/b + a/(2 \kappa)}"),
        (a / (1 + exp(u) / b), r"a \left[1 + \frac{1}{b} e^{u}\right]^{-1}"),
        (a / (1 + (a - k) / (b * k)), r"\frac{a}{1 + (a - \kappa)/(b \kappa)}"),
        ((a - k) / (1 + exp(u) / b), r"(a - \kappa) \left[1 + \frac{1}{b} e^{u}\right]^{-1}"),
        # Signs are taken out where most terms have one, and whole numbers stand in front.
        ((-1 - b) / k, r"-\frac{1 + b}{\kappa}"),
        ((k - a - 1) * (v + 1) * b, r"-b (1 + a - \kappa) (v + 1)"),
        (a * (2 * Symbol("j", integer=True) + 1) * V(u), "(2 j + 1) a V(u)"),
        ((2 * Symbol("j", integer=True) - 1) * V(u), "(2 j - 1) V(u)"),
        (b * (sympy.sin(a) + sqrt(3) * cos(a)) * sympy.sin(a),
         r"b \sin(a) (\sqrt{3} \cos(a) + \sin(a))"),
        (sympy.Subs(sympy.Derivative(V(u), u), u, a), r"V'(u) \Big|_{u = a}"),
        (Symbol("a_minus", positive=True) ** 2, "(a^-)^2"),
        (Symbol("nested") * a / Symbol("int_e"), r"\frac{a \, \mathrm{nested}}{\mathrm{int}_e}"),
    ],
)  # fmt: skip
def test_formulas_are_written_as_by_hand(expression: Any, wanted: str) -> None:
    assert tex(expression) == wanted


def test_a_derivative_at_a_point_is_raised_without_parentheses() -> None:
    assert tex(a**2 / b, {a: "V''(u_1)", b: "a^+"}) == r"\frac{V''(u_1)^2}{a^+}"


def test_the_large_parameter_stands_first() -> None:
    assert tex(Symbol("lam") * Symbol("J"), {"lam": r"\lambda"}) == r"\lambda J"


def test_a_step_is_shown_behind_its_left_side() -> None:
    d = Derivation("x", "x")
    d.step("one", "expand", a + 1, Identity(a + 1), left="T")
    d.step("two", "expand", (a, b), Identity((a, b)), left=("P", r"C \sim"))
    assert [step.latex for step in d.verify()] == [
        f"T = {tex(a + 1)}",
        r"P = a ,\quad C \sim b",
    ]


def test_roots_of_numbers_that_may_be_negative_are_not_joined() -> None:
    x, y = sympy.symbols("x y", real=True)
    assert tex(sqrt(x) * sqrt(y)).count(r"\sqrt") == 2
    assert tex(sqrt(a) * sqrt(y)).count(r"\sqrt") == 1


def test_a_relative_remainder_is_a_factor() -> None:
    leading = exp(a / k**2)
    assert latex(Expansion(leading, 3 * leading * k**2, k)) == (
        rf"{tex(leading)} \left(1 + O(\kappa^2)\right)"
    )
    assert latex(Expansion(a, 2 * k**2, k)) == r"a + O(\kappa^2)"
    series = 1 + a * k**2
    assert latex(Expansion(b * leading * series, 3 * b * leading * k**4, k)) == (
        rf"{tex(b * leading)} \left({tex(series)} + O(\kappa^4)\right)"
    )
    # The remainder is not relative to b.
    assert latex(Expansion(b * series, k**4, k)).endswith(r"+ O(\kappa^4)")


def test_an_equation_that_leaves_out_an_order_is_asymptotic() -> None:
    for result, error, relation in (
        (a, "exact", "="),
        (a, "O(k^2)", r"\sim"),
        ((a, b), "relative O(k^2)", r"\sim"),
        (Expansion(a, k**2, k), "O(k^2)", "="),
    ):
        d = Derivation("order", "An order")
        d.step("only", "expand", result, Identity(result), left=("T", "C"))
        left = tuple(map(Symbol, "TC")) if isinstance(result, tuple) else Symbol("T")
        d.conclude(left, result, error)
        assert d.latex().startswith(f"T {relation} a")
        assert d.latex().count(r"\sim") == (2 if isinstance(result, tuple) else relation != "=")


def test_an_equation_is_written_with_what_steps_stated() -> None:
    d = Derivation("noise", "A stochastic equation", names={"kappa": r"\kappa"})
    half = d.step("generator", "define", k**2 / 2, Identity(lambda: k**2 / 2))
    noise = d.step("amplitude", "substitute", k, Identity(lambda: sqrt(2 * half)))
    with pytest.raises(ValueError, match="no step has checked"):
        d.conclude(a, half, display=("du = ", 2 * noise, r" \, dW"))
    d.conclude(a, half, display=("du = ", noise, r" \, dW"))
    assert d.latex() == r"du = \kappa \, dW"


# -- reading back ----------------------------------------------------------------------------------

_FUNCTIONS = {
    "log": mpmath.log, "sin": mpmath.sin, "cos": mpmath.cos, "tanh": mpmath.tanh,
    "arccos": mpmath.acos, "arcsin": mpmath.asin, "erf": mpmath.erf,
    "Ai": mpmath.airyai, "Bi": mpmath.airybi,
    "Ai'": lambda x: mpmath.airyai(x, derivative=1),
    "Bi'": lambda x: mpmath.airybi(x, derivative=1),
    "Gamma": mpmath.gamma, "arccot": lambda x: mpmath.pi / 2 - mpmath.atan(x),
}  # fmt: skip
_AIRY = {"airyaiprime": _FUNCTIONS["Ai'"], "airybiprime": _FUNCTIONS["Bi'"]}
_TOKEN = re.compile(
    r"\\(?:frac|sqrt|pi|operatorname\{\w+\}'?|[a-zA-Z]+)|@\d+|\d+|[{}()^+\-/e]|(?P<bad>\S)"
)


class Reader:
    """Value of a formula in TeX, symbols being ``@0``, ``@1``, ... ."""

    def __init__(self, text: str, values: list[Any]) -> None:
        text = re.sub(r"\\left|\\right|\\cdot\b|\\,", " ", text)
        text = text.replace("[", "(").replace("]", ")")
        self.tokens = [m[0] for m in _TOKEN.finditer(text)]
        assert not any(m["bad"] for m in _TOKEN.finditer(text)), text
        self.values, self.at = values, 0

    def value(self) -> Any:
        found = self.sum()
        assert self.at == len(self.tokens), self.tokens[self.at :]
        return found

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self, wanted: str = "") -> str:
        token = self.tokens[self.at]
        assert not wanted or token == wanted, (token, wanted)
        self.at += 1
        return token

    def sum(self) -> Any:
        total = mpmath.mpf(0)
        while True:
            sign = -1 if self.peek() == "-" else 1
            if self.peek() in ("+", "-"):
                self.take()
            total += sign * self.product()
            if self.peek() not in ("+", "-"):
                return total

    def product(self) -> Any:
        found = self.factor()
        while self.peek() not in ("", "+", "-", ")", "}"):
            if self.peek() == "/":
                self.take()
                found /= self.factor()
            else:
                found *= self.factor()
        return found

    def group(self) -> Any:
        """An argument: in braces, or one token."""
        if self.peek() != "{":
            return self.atom()
        self.take("{")
        found = self.sum()
        self.take("}")
        return found

    def factor(self) -> Any:
        found = self.atom()
        if self.peek() == "^":
            self.take()
            found **= self.group()
        return found

    def atom(self) -> Any:
        token = self.take()
        if token.startswith("@"):
            return self.values[int(token[1:])]
        if token.isdigit():
            return mpmath.mpf(token)
        if token == "e":
            return +mpmath.e
        if token == r"\pi":
            return +mpmath.pi
        if token == r"\gamma":
            return +mpmath.euler
        if token == r"\frac":
            return self.group() / self.group()
        if token == r"\sqrt":
            return mpmath.sqrt(self.group())
        if token == "(":
            found = self.sum()
            self.take(")")
            return found
        function = _FUNCTIONS[re.sub(r"\\(?:operatorname\{(\w+)\}('?))?", r"\1\2", token)]
        power = mpmath.mpf(1)
        if self.peek() == "^":
            self.take()
            power = self.group()
        self.take("(")
        found = function(self.sum())
        self.take(")")
        return found**power


def _readable(stated: Any) -> list[Any]:
    """The expressions of a statement that hold numbers and symbols alone."""
    if isinstance(stated, Expansion):
        return _readable(stated.leading) + _readable(stated.gauge)
    if isinstance(stated, Inequality):
        return _readable(stated.left) + _readable(stated.right)
    if isinstance(stated, (tuple, list)):
        return [e for item in stated for e in _readable(item)]
    distributions = (sympy.Heaviside, sympy.DiracDelta)
    beyond = (Integral, sympy.Derivative, AppliedUndef, *distributions, sympy.Abs, sympy.Sum)
    return [e for e in parts(stated) if isinstance(e, sympy.Expr) and not e.has(*beyond)]


@pytest.mark.parametrize("label", entries())
def test_printed_values_are_the_expressions(label: str) -> None:
    derivation = build(label)
    chance = random.Random(label)
    stated = [derivation.result, *(step.result for step in derivation.steps)]
    for expression in (e for one in stated for e in _readable(one)):
        symbols = sorted(expression.free_symbols, key=str)
        shown = {s: tex(s, derivation.names) for s in symbols}
        text = tex(expression, derivation.names)
        for s in sorted(symbols, key=lambda s: -len(shown[s])):
            text = re.sub(
                rf"(?<![@\\a-zA-Z]){re.escape(shown[s])}(?![a-zA-Z_])",
                f"@{symbols.index(s)} ",
                text,
            )
        values = [
            Rational(chance.randint(20, 300), 151) * (-1 if s.is_negative else 1) for s in symbols
        ]
        with mpmath.workdps(30):
            numbers = [mpmath.mpf(x.p) / x.q for x in values]
            wanted = sympy.lambdify(symbols, expression, [_AIRY, "mpmath"])(*numbers)
            found = Reader(text, numbers).value()
            assert abs(found - wanted) <= abs(wanted) * mpmath.mpf(10) ** -20, (text, label)


def test_a_minus_before_a_sum() -> None:
    a = sympy.Symbol("a")
    assert tex(sympy.Mul(-1, a + 3, evaluate=False)) == "-(3 + a)"
