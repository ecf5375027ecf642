"""Laplace expansions: against published series, other people's code, and their own claims."""

from __future__ import annotations

import math
import time
from fractions import Fraction
from functools import cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st
from mpmath import mp, mpf

import symasym as sa
from symasym.asymptotics.laplace import errors as laplace_errors
from symasym.asymptotics.laplace import integral as laplace
from symasym.base.call_context import limited
from tests.integrals import DIGITS, INTEGRALS, NAMED, Integral, scaled, truth

x, nu = sympy.Symbol("x"), sympy.Symbol("nu", positive=True)
scenes = pytest.mark.parametrize("scene", INTEGRALS, ids=lambda scene: scene.name)


@cache
def expansion(name: str, order: Any) -> Any:
    scene = NAMED[name]
    return sa.laplace_integral(scene.f, scene.g, x, scene.a, scene.b, order)


# -- honesty and accuracy ------------------------------------------------------------------------


@scenes
@pytest.mark.parametrize("order", [1, 2, 5, "optimal"])
def test_error_is_never_below_the_true_one(scene: Integral, order: Any) -> None:
    result = expansion(scene.name, order)
    for lam in (3, 10, 40, 200):
        found = result.evaluate(lam, dps=25, full=True)
        value, error = scaled(result, found, lam)
        with mp.workdps(DIGITS):
            assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -15), (lam, found)


@scenes
def test_error_is_small_and_of_the_kind_the_table_says(scene: Integral) -> None:
    result = expansion(scene.name, 5)
    found = result.evaluate(2000, dps=25, full=True)
    value, error = scaled(result, found, 2000)
    assert found.error_kind == scene.kind
    assert error < 1e-4 * abs(value)
    assert abs(value - truth(scene.name, 2000)) <= error * (1 + 1e-15)


@scenes
def test_bound_statement_holds(scene: Integral) -> None:
    result = expansion(scene.name, 2)
    if scene.kind != "bound":
        assert result.bound is None
        return
    constant, sigma, start = result.bound
    for factor in (1, 3, 10):
        lam = math.ceil(start) * factor
        if lam > 3000:
            break
        value, _ = scaled(result, result.evaluate(lam, dps=25, full=True), lam)
        assert abs(value - truth(scene.name, lam)) <= constant * mpf(lam) ** -sigma


SLOPED = ["Stirling", "Bessel I", "Bessel K", "Struve", "Kummer U", "incomplete gamma", "erfc",
          "beta, algebraic decay", "beta, symmetric", "Legendre", "quartic", "sextic",
          "cubic end", "kink and smooth", "unequal kink", "two unequal", "no closed form",
          "zero of g", "branch point inside", "two powers", "removable"]  # fmt: skip


@pytest.mark.parametrize("name", SLOPED)
@pytest.mark.parametrize("order", [1, 3])
def test_order_is_measured(name: str, order: int) -> None:
    result = expansion(name, order)
    lams, errors = (1000, 2000), []
    for lam in lams:
        found = result.evaluate(lam, dps=25, full=True)
        with mp.workdps(DIGITS):
            errors.append(abs(scaled(result, found, lam)[0] - truth(name, lam)))
    slope = -math.log(errors[1] / errors[0]) / math.log(2)
    # A coefficient that is zero lets the next one show: never a smaller slope, at most 3 steps.
    steps = [float(result.omitted) + k * gap for gap in _gaps(result) for k in range(4)]
    assert min(abs(slope - step) for step in steps) < 0.06, (slope, steps)
    assert slope > float(result.omitted) - 0.06


def _gaps(result: Any) -> set[float]:
    return {(2 if c.side == "both" else 1) / c.contact for c in result.contributions}


@settings(max_examples=60)
@given(
    scene=st.sampled_from(INTEGRALS),
    order=st.integers(1, 9),
    lam=st.sampled_from([2, 7, 15, 60, 500]),
    dps=st.integers(3, 28),
)
def test_printed_digits_hold_at_any_order_and_precision(
    scene: Integral, order: int, lam: int, dps: int
) -> None:
    result = expansion(scene.name, order)
    found = result.evaluate(lam, dps=dps, full=True)
    value, error = scaled(result, found, lam)
    with mp.workdps(DIGITS):
        assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -12)


@settings(max_examples=25)
@given(
    mu=st.integers(1, 5),
    beta=st.fractions(min_value=Fraction(1, 5), max_value=4, max_denominator=6),
    c=st.fractions(min_value=Fraction(-1, 2), max_value=1, max_denominator=5),
    lam=st.sampled_from([8, 50, 400]),
    order=st.integers(1, 6),
)
def test_random_endpoint(mu: int, beta: Fraction, c: Fraction, lam: int, order: int) -> None:
    """Integral over (0, 1) of x^(beta - 1) e^(c x) e^(-lam x^mu), as a series in c."""
    g = x ** (sympy.Rational(beta) - 1) * sympy.exp(sympy.Rational(c) * x)
    result = sa.laplace_integral(-(x**mu), g, x, 0, 1, order)
    found = result.evaluate(lam, dps=20, full=True)
    with mp.workdps(40):
        exact = mpf(0)
        for k in range(60):
            s = (mpf(beta.numerator) / beta.denominator + k) / mu
            part = mp.gammainc(s, 0, lam) / (mu * mpf(lam) ** s)
            exact += (mpf(c.numerator) / c.denominator) ** k / mp.factorial(k) * part
        assert abs(found.value - exact) <= found.error * (1 + mpf(10) ** -12)


# -- values --------------------------------------------------------------------------------------


def test_arrays_are_the_numbers_one_by_one() -> None:
    lam = np.array([[1.5, 20.0, 300.0], [4000.0, 2.0, 700.0]])
    for name in ("Stirling", "two equal", "two unequal", "kink and smooth", "zero of g"):
        result = expansion(name, 4)
        logs = result.evaluate(lam, log=True) if name != "zero of g" else None
        small = lam[lam < 500]
        plain = result.evaluate(small)
        for value, y in zip(plain, small, strict=True):
            assert value == pytest.approx(result.evaluate(y), rel=2e-14)
        if logs is not None:
            assert logs.shape == lam.shape
            for value, y in zip(logs.ravel(), lam.ravel(), strict=True):
                exact = result.evaluate(float(y), dps=30, log=True)
                assert abs(value - exact) <= 4e-15 * max(1, abs(exact))


def test_full_arrays_carry_errors() -> None:
    found = expansion("erfc", 3).evaluate([50.0, 500.0], full=True)
    assert found.value.shape == found.error.shape == (2,)
    assert found.error_kind == "bound"
    assert (found.error < 1e-4 * found.value).all()


def test_out_of_range_is_an_error_and_its_logarithm_is_not() -> None:
    result = expansion("Stirling", 3)
    with pytest.raises(sa.RangeError, match="log=True"):
        result.evaluate(10_000)
    with pytest.raises(sa.RangeError):
        result.evaluate([1.0, 10_000.0])
    assert result.evaluate(10_000, log=True) == pytest.approx(-10003.68623)


def test_logarithm_of_a_sum_that_is_not_positive() -> None:
    negative = sa.laplace_integral(-(x**2), -1, x, -1, 1, 2)
    with pytest.raises(sa.AccuracyError, match="not surely positive"):
        negative.evaluate(10, log=True)


def test_optimal_truncation_beats_every_fixed_order() -> None:
    lam = 6
    exact = truth("Stirling", lam)
    best = expansion("Stirling", "optimal")
    reached = abs(scaled(best, best.evaluate(lam, dps=30, full=True), lam)[0] - exact)
    fixed = []
    for order in (1, 4, 8, 60):
        result = expansion("Stirling", order)
        fixed.append(abs(scaled(result, result.evaluate(lam, dps=30, full=True), lam)[0] - exact))
    assert reached < min(fixed)


def test_the_caller_s_precision_is_left_alone() -> None:
    before = mp.dps, mpmath.iv.prec
    with mp.workdps(7):
        coarse = sa.laplace_integral("sin(x) - x**2/5", "1/(1 + x**2)", x, 0, 5, 4)
        found = coarse.evaluate(200, dps=25, full=True)
        assert mp.dps == 7
    assert (mp.dps, mpmath.iv.prec) == before
    again = expansion("no closed form", 4).evaluate(200, dps=25, full=True)
    assert found.value == again.value
    assert found.error == pytest.approx(again.error, rel=1e-6)


@scenes
def test_estimates_are_honest_too(scene: Integral, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(laplace_errors.ErrorModel, "proof", None)
    for order in (1, 2, 5, "optimal"):
        result = sa.laplace_integral(scene.f, scene.g, x, scene.a, scene.b, order)
        for lam in (3, 10, 40, 200):
            found = result.evaluate(lam, dps=25, full=True)
            value, error = scaled(result, found, lam)
            assert found.error_kind == "estimate"
            assert abs(value - truth(scene.name, lam)) <= error * (1 + mpf(10) ** -15), (order, lam)


@pytest.mark.parametrize("powers", [("1/2", "-1/2"), ("-1/2", "3/2"), ("7/2", "-1/2")])
def test_powers_that_differ_by_an_integer_are_one_series(powers: tuple[str, str]) -> None:
    first, second = (x ** sympy.Rational(p) for p in powers)
    both, *alone = (sa.laplace_integral(-x, g, x, 0, 1, 6) for g in (first + second, first, second))
    assert len(both.contributions) == 1
    assert both.contributions[0].exponents[0] == sympy.Rational(1, 2)
    n = sympy.Symbol("n", positive=True)
    assert sympy.expand(both.expression_in(n) - sum(part.expression_in(n) for part in alone)) == 0


@pytest.mark.parametrize(
    ("f", "g"), [("-x", "x**3"), ("-x**2", "1/sqrt(x)"), ("-3*log(1 + x)", "sqrt(x)")]
)
@pytest.mark.parametrize("lam", [3, 10])
def test_tail_is_bounded(f: str, g: str, lam: int) -> None:
    from symasym.asymptotics.laplace.remainder import _tail

    exponent, weight = sympy.sympify(f), sympy.sympify(g)
    start, (size, drop, steep, growth) = _tail(exponent, weight, x, 0.5, 0.0)
    bound = size * math.exp(-lam * drop) / (lam * steep - growth)
    integrand = sympy.lambdify(x, weight * sympy.exp(lam * exponent), "mpmath")
    exact = mp.quad(integrand, [start, start + 1, start + 10, start + 100, mp.inf])
    assert exact <= bound * (1 + 1e-9)
    assert bound < 100 * exact


@pytest.mark.parametrize("power", ["-1/3", "-9/10"])
def test_a_weight_singular_at_an_end_has_a_bounded_integral(power: str) -> None:
    from symasym.asymptotics.laplace.kinks import Piece
    from symasym.asymptotics.laplace.remainder import _weight

    def exact(t: Any) -> Any:
        """The integral of s^power e^s over (0, 1/2), where s = t^10."""
        return 10 * t ** (10 * mp.convert(Fraction(power)) + 9) * mp.exp(t**10)

    value, s = mp.quad(exact, [0, mpf(0.5) ** mpf(0.1)]), sympy.Rational(power)
    f, low, high = -((x - 1) ** 2), sympy.Integer(0), sympy.Integer(2)
    for g, a in ((x**s * sympy.exp(x), 0.0), ((2 - x) ** s * sympy.exp(2 - x), 1.5)):
        bound = _weight(Piece(low, high, f, g), x, a, a + 0.5)
        assert value <= bound < 2 * value


def test_a_polygon_around_another_zero_proves_nothing() -> None:
    import flint

    from symasym.asymptotics.laplace.cauchy_disk import _proved, _Surroundings
    from symasym.numbers.balls import precision

    f = sympy.sympify("-x**2*(1 + x)")
    zero = flint.arb(0)
    around = _Surroundings(f, sympy.Integer(1), x, zero, zero, 2, Fraction(1), 0)
    circle = np.exp(2j * np.pi * np.arange(64) / 64)
    with precision(100):
        # The other zero of h, at -1, is outside the first circle and inside the second.
        found = _proved(around, 0.5 * circle, 0.5**1.5)
        assert found is not None
        assert 0.9 * 0.5**1.5 < found[0] <= 0.5**1.5
        assert _proved(around, 2 * circle, 2.0) is None


def test_a_flat_f_is_not_taken_for_a_narrow_peak() -> None:
    result = sa.laplace_integral("-1e-30*x**2", 1, x, -1, 1, 2)
    found = result.evaluate(100, full=True)
    assert abs(found.value - 2) <= found.error
    numeric = sa.laplace_integral(-x, "1e-30 + x", x, 0, 1, 2, dps=20)
    with mp.workdps(30):
        assert abs(numeric.contributions[0].coefficients[0] * mpf(10) ** 30 - 1) < mpf(10) ** -19


def test_printing() -> None:
    result = sa.laplace_integral(-x, 1 / (1 + x), x, 0, "oo", 3)
    assert str(result).startswith("e^(lam (0)) [(1) lam^(-1) + (-1) lam^(-2) + (2) lam^(-3)]")
    assert "O(e^(lam (0)) lam^(-4)); error: at most" in str(result)
    terms = r"\frac{1}{\lambda} - \frac{1}{\lambda^2} + \frac{2}{\lambda^3}"
    assert result.latex() == terms + r" + O\left(\frac{1}{\lambda^4}\right)"
    n = sympy.Symbol("n", positive=True)
    assert result.expression_in(n) == 1 / n - 1 / n**2 + 2 / n**3


def test_latex_of_two_heights_keeps_both_exponentials() -> None:
    kept = sa.laplace_integral("-x**2*(x - 2)**2*(2 - x/4) + x/9", 1, x, -1, 3, 1, keep=True)
    # Of each contribution, and of the O term.
    assert kept.latex().count("e^{") == 3


# -- bad input -----------------------------------------------------------------------------------

y = sympy.Symbol("y")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((x, 1, x, 0, "oo"), "does not fall"),
        (("log(x)", 1, x, 0, "oo"), "does not fall"),
        (("cos(x)", 1, x, 0, "oo"), "does not fall"),
        (("1/(1 + x**2)", 1, x, 0, "oo"), "does not fall"),
        ((-x, "exp(x**2)", x, 0, "oo"), "diverges for every lam"),
        (("1/x", 1, x, 0, 1), "tends to oo"),
        ((-x, 1 / x, x, 0, 1), "diverges"),
        ((-(x**2), 1 / x**2, x, -1, 1), "diverges"),
        ((-(x**2), "sqrt(x)", x, -1, 1), "isn't real"),
        ((-(x**2), "log(x)", x, 0, 1), "neither analytic nor"),
        ((-(sympy.Abs(x) ** sympy.Rational(3, 2)), 1, x, -1, 1), "no Taylor series"),
        ((sympy.I * x, 1, x, 0, 1), "complex"),
        ((-x, "oo*x", x, 0, 1), "g = oo.x is complex, infinite or undefined"),
        ((sympy.Integer(3), 1, x, 0, 1), "does not contain x"),
        ((-sympy.gamma(x), 1, x, 1, 3), "f contains gamma"),
        ((-x, sympy.besselj(0, x), x, 0, 1), "g contains besselj"),
        ((-x, 1, x, 1, 0), "a must be less than b"),
        ((-x, 1, x, 0, x), "contains x"),
        ((-(nu**2), 1, nu, -1, 1), "by its own assumptions"),
        ((-x, 0, x, 0, 1), "g is 0"),
        (("-x**", 1, x, 0, 1), "which ends where a number or name"),
        ((-x, [1], x, 0, 1), "give a SymPy expression"),
        ((-x, 1, 3, 0, 1), "variable of integration"),
        ((-x, 1, x, 0, 1, 0), "order is 0"),
        ((-x, 1, x, 0, 1, 2.5), "order is 2.5"),
        ((-x, 1, x, 0, 1, "best"), "order is 'best'"),
        ((-y * x**2, 1, x, -1, 1), "depends on the sign of y"),
        ((-x, x ** (y - 1), x, 0, 1), "diverges unless"),
        (("Piecewise((0, x < 1), (1 - x, True))", 1, x, 0, 2), "flat|no isolated|not largest"),
    ],
)
def test_bad_integrals(arguments: Any, says: str) -> None:
    with pytest.raises(sa.InputError, match=says) as caught:
        sa.laplace_integral(*arguments)
    text = str(caught.value)
    assert text.endswith(".")
    assert ";" in text or "unless" in text


@pytest.mark.parametrize("name", ["lam", "lambda", "e", "O"])
def test_no_parameter_reads_as_the_formula_s_own(name: str) -> None:
    """Two symbols of one name would be one argument of emitted code."""
    with pytest.raises(sa.InputError, match=f"has a parameter {name}, which the formula has"):
        sa.laplace_integral("log(x) - x", f"1 + {name}*x", "x", 0, "oo")
    other = sa.laplace_integral("log(x) - x", "1 + Ai*x", "x", 0, "oo")
    assert [str(s) for s in other.parameters] == ["Ai"]
    with pytest.raises(sa.InputError, match="has a parameter Ai, which the formula has"):
        other.expression_in("Ai")


def test_wrong_maxima_are_refused() -> None:
    with pytest.raises(sa.InputError, match="has no maximum"):
        sa.laplace_integral(-(x**2), 1, x, -1, 1, maxima=["1/2"])
    c = sympy.Symbol("c", positive=True)
    with pytest.raises(sa.InputError, match="could not be decided"):
        sa.laplace_integral(-c * x**2, 1, x, -1, 1, maxima=[c])


@pytest.mark.parametrize("lam", [0, -1, [1.0, -2.0], 1j, "a", float("nan")])
def test_bad_lam(lam: Any) -> None:
    with pytest.raises(sa.InputError):
        expansion("erfc", 2).evaluate(lam)


def test_more_digits_than_the_coefficients_have() -> None:
    result = expansion("no closed form", 2)
    with pytest.raises(sa.AccuracyError, match="pass dps"):
        result.evaluate(10, dps=60)
    fine = sa.laplace_integral("sin(x) - x**2/5", "1/(1 + x**2)", x, 0, 5, 2, dps=80)
    assert abs(fine.evaluate(10, dps=60) - result.evaluate(10, dps=25)) < 1e-24 * 7000


def test_public_body_and_verb_agree_on_their_arguments() -> None:
    import inspect

    verb, body = (
        inspect.signature(function).parameters
        for function in (sa.laplace_integral, laplace.laplace_integral)
    )
    assert [(p.name, p.default) for p in verb.values()] == [
        (p.name, p.default) for p in body.values()
    ]


def test_expansions_show_as_latex():
    stirling = sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", order=2)
    assert stirling._repr_latex_() == rf"$\displaystyle {stirling.latex()}$"


@pytest.mark.parametrize("target", ["numpy", "mpmath", "python"])
def test_the_verbs_of_expansions(target: str) -> None:
    """Expression, terms, error, LaTeX and code are the sum that evaluate adds up."""
    x, c = sympy.Symbol("x"), sympy.Symbol("c", positive=True)
    free = sa.laplace_integral(-(x**2) / 2 - c * x**4 - x**3 / 9, 1 + x**2, x, "-oo", "oo", 4)
    assert "none claimed" in free.error
    assert sum(free.terms) == free.expression
    assert len(free.terms) > 3
    assert r"O\left(" in free.latex()
    code = free.emit(target, name="integral").load()
    bound = free.bind(c="1/3")
    assert "O(" in bound.error
    want = bound.evaluate(37)
    assert float(code.integral(1 / 3, 37.0)) == pytest.approx(want, rel=1e-13)
    (lam,) = bound.expression.free_symbols
    assert float(bound.expression.subs(lam, 37)) == pytest.approx(want, rel=1e-13)


def test_a_product_of_many_polynomials_is_proved_in_time() -> None:
    """SymPy would multiply it out term by term, for a quarter of a minute, as it is printed."""
    weight = "*".join(f"(1 + x**{k})" for k in range(1, 40))
    found = sa.laplace_integral("-x**2", weight, "x", -1, 1, patience=3)
    with limited(3):
        assert "(bound)" in str(found)


@pytest.mark.parametrize(
    ("f", "g"),
    [
        ("log(" * 10 + "x" + ")" * 10, "1"),
        ("-x**2", "+".join(f"1/(x - {k} - 1/2)" for k in range(1, 400))),
    ],
)
def test_work_that_would_take_too_long_is_not_begun(f: str, g: str) -> None:
    begun = time.thread_time()
    with pytest.raises(sa.TimeLimitError, match="SymPy's work on .* would take"):
        sa.laplace_integral(f, g, "x", -1, 1, patience=10)
    assert time.thread_time() - begun < 4


@pytest.mark.parametrize("f", ["sin(1/x)", "tanh(log(x)**(1/3)*cos(7))"])
def test_a_limit_that_sympy_has_not_is_a_sentence(f) -> None:
    with pytest.raises(sa.InputError, match=r"at x = 0, so the integral diverges or is complex"):
        sa.laplace_integral(f, 1, "x", 0, 1)
