"""The engine: each kind of check passes what is right and fails what is not; LaTeX as by hand."""

from __future__ import annotations

from typing import Any

import mpmath
import pytest
import sympy
from sympy import Function, Integral, Rational, Symbol, cos, exp, log, oo, sin, sqrt

from symasym.base.errors import InputError
from symasym.derivation.derivation import Derivation
from symasym.derivation.tex import tex
from symasym.formula import formula
from tests.derivations.mistakes import survivors

u, v, t = (Symbol(name, real=True) for name in "uvt")
a, b, k = (Symbol(name, positive=True) for name in ("a", "b", "kappa"))
n, lam = Symbol("n", negative=True), Symbol("lam", positive=True)
V, f = Function("V"), Function("f")


def stated(right: Any, kind: str) -> Derivation:
    """A derivation of one step; of each kind one that holds for the right `right`."""
    d = Derivation("mine", "My own")
    if kind == "value":
        d.eq("one", Integral(t * exp(-t), (t, 0, a)), right)
    elif kind == "given":
        d.eq(
            "one",
            f(u),
            right,
            given=[(f(u).diff(u, 2) - f(u), 0), (f(0), 1), (f(u).diff(u).subs(u, 0), 1)],
        )
    elif kind == "by":
        d.eq("one", r"\hat f", right, by=sympy.solve(a * u - b, u)[0])
    elif kind == "unknown":
        d.eq("one", Integral(V(u).diff(u), (u, 0, a)).doit(), right)
    elif kind == "bound":
        d.bound("one", exp(a), ">=", right)
    else:
        exact = lambda x, ctx: ctx.quad(lambda s: ctx.exp(-s / x) / (1 + s), [0, 1])  # noqa: E731
        d.order("one", "E", right, k**3, exact, ("1e-2", "1e-3"), {})
    return d


@pytest.mark.parametrize(
    ("kind", "right"),
    [
        ("value", 1 - exp(-a) - a * exp(-a)),
        ("given", exp(u)),
        ("by", b / a),
        ("unknown", V(a) - V(0)),
        ("bound", sympy.Integer(1)),
        ("order", k - k**2),
    ],
)
def test_what_holds_passes_and_each_change_fails(kind: str, right: Any) -> None:
    d = stated(right, kind)
    assert d.verify() == []
    if kind == "bound":  # what is weaker holds as well
        assert stated(sympy.Integer(2), kind).verify() == ["one"]
        return
    alive, tried = survivors(d.steps[0])
    assert (alive, tried > 0) == ([], True)


def test_a_condition_that_does_not_hold_is_told() -> None:
    d = stated(b / a, "by")
    d.suppose("$1 > 2$", lambda: bool(mpmath.mpf(1) > 2))
    assert d.verify() == ["$1 > 2$"]


def test_a_formula_is_its_derivation() -> None:
    found = formula("eq:Ttildesmall")
    assert found.latex().startswith(r"T = \frac{r}{a^+} + ")
    assert found.error == r"$O(\kappa^2 e^{2 D/\kappa^2})$"
    assert "eq:secondTerm" in found.rests_on
    assert formula("saddle-series-3").steps
    for label, told in (
        ("Ttilde", "is no formula"),
        ("eq:genSDE", "defines the system"),
        (3, "no"),
    ):
        with pytest.raises(InputError, match=told):
            formula(label)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("expression", "wanted"),
    [
        (2 * sympy.pi * exp(2 * a / k**2) / sqrt(-n * b),
         r"\frac{2 \pi}{\sqrt{-b n}} e^{2 a/\kappa^2}"),
        (sqrt(2) * sqrt(a) / sqrt(b), r"\sqrt{\frac{2 a}{b}}"),
        (sqrt(3) * a / 9, r"\frac{a}{3 \sqrt{3}}"),
        (sqrt(-sympy.pi / n), r"\sqrt{-\frac{\pi}{n}}"),
        (a * (b + 1) / (b + 2), r"\frac{a (1 + b)}{2 + b}"),
        ((1 / a - 1 / b) / k, r"\frac{1}{\kappa} \left(\frac{1}{a} - \frac{1}{b}\right)"),
        (a ** Rational(-1, 3), "a^{-1/3}"),
        (a ** Rational(3, 2) / sqrt(b), r"\frac{a^{3/2}}{\sqrt{b}}"),
        (-a * u * (1 + b), "-a (1 + b) u"),
        (exp((2 * V(v) - 2 * V(u)) / k**2), r"e^{2 (V(v) - V(u))/\kappa^2}"),
        (1 - a - u**2, "1 - a - u^2"),
        (u**3 * a - u - 1, "a u^3 - u - 1"),
        (cos(a) ** 3, r"\cos^3(a)"),
        (a * sin(b) * (cos(b) - sin(b)), r"a (\cos(b) - \sin(b)) \sin(b)"),
        (V(u).diff(u, 2) * a - V(u) * Function("phi")(u), r"a V''(u) - V(u) \phi(u)"),
        (2 * Integral((sympy.Heaviside(v) - a) * V(v), (u, -1, v), (v, 0, b)) / k**2,
         r"\frac{2}{\kappa^2} \int_0^b \int_{-1}^v (\mathbf{1}_{v > 0} - a) V(v) \, du \, dv"),
        (Integral(V(u), (u, 0, a)) / Integral(V(u), (u, 0, oo)),
         r"\frac{\int_0^a V(u) \, du}{\int_0^{\infty} V(u) \, du}"),
        (1 / lam - 1 / lam**2, r"\frac{1}{\lambda} - \frac{1}{\lambda^2}"),
        (a / (1 / b + a / (2 * k)), r"\frac{a}{\frac{1}{b} + \frac{a}{2 \kappa}}"),
        (log(a / b), r"\log\left(\frac{a}{b}\right)"),
        (Symbol("a_minus", positive=True) ** 2 * Symbol("u_s"), "(a^-)^2 u_s"),
    ],
)  # fmt: skip
def test_formulas_are_written_as_by_hand(expression: Any, wanted: str) -> None:
    assert tex(expression) == wanted
