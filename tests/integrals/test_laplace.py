"""Laplace expansions of the table's integrals, right and honest; published series; refusals."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import flint
import numpy as np
import pytest
import sympy
from mpmath import mp, mpf

import symasym as sa
from tests.integrals.table import DIGITS, INTEGRALS, NAMED, scaled, truth

x, nu = sympy.Symbol("x"), sympy.Symbol("nu", positive=True)
c, y = sympy.Symbol("c", positive=True), sympy.Symbol("y")


#: Where f or g is singular at an end, or inside.
SINGULAR = ("beta, symmetric", "singular end", "singular at 1", "removable")


@cache
def expansion(name: str, order: Any) -> Any:
    row = NAMED[name]
    return sa.laplace_integral(row.f, row.g, x, row.a, row.b, order)


@pytest.mark.parametrize("name", [row.name for row in INTEGRALS])
def test_right_and_honest(name: str) -> None:
    """The claimed error is the true one, also of float64; and as small as the order says.

    It is a bound on closed intervals with regular ends.
    """
    row = NAMED[name]
    for order, lam in ((3, 4), ("optimal", 30)):
        found = expansion(name, order).evaluate(lam, dps=25, full=True)
        value, error = scaled(expansion(name, order), found, lam)
        sampled = "oo" in (row.a, row.b) or name in SINGULAR
        assert found.error_kind == ("estimate" if sampled else "bound")
        with mp.workdps(DIGITS):
            true = abs(value - truth(name, lam))
            room = mpf(10) ** (2 - DIGITS)  # of the truth
            assert true - room <= error <= true * mpf("1.01") + mpf(10) ** -22
    rounded = expansion(name, order).evaluate(lam, full=True)
    assert abs(rounded.value - found.value) <= 2 * rounded.error
    result = expansion(name, 3)
    errors = [scaled(result, result.evaluate(n, dps=20, full=True), n)[1] for n in (900, 1800)]
    slope = math.log2(errors[0] / errors[1])
    # Where a coefficient is 0 the next one shows.
    steps = {d.step for d in result.contributions}
    last = min(float(d.exponents[-1]) for d in result.contributions)
    powers = [last + k * float(gap) for gap in steps for k in range(1, 5)]
    # There what the near end cuts off is all there is.
    small = name == "cut close" or errors[1] < mpf(10) ** -18
    assert small or min(abs(slope - power) for power in powers) < 0.06


def hankel(k: int) -> Any:
    """a_k(nu) of DLMF 10.17.1."""
    product = sympy.prod([4 * nu**2 - (2 * j - 1) ** 2 for j in range(1, k + 1)])
    return product / (sympy.factorial(k) * 8**k)


@pytest.mark.parametrize(
    ("f", "g", "a", "b", "term"),
    [  # DLMF 10.40.1, 10.40.2, 8.11.2; a free exponent; 5.11.3
        (sympy.cos(x), sympy.cos(nu * x), 0, sympy.pi, lambda k: (-1) ** k * hankel(k)),
        (-sympy.cosh(x), sympy.cosh(nu * x), "-oo", "oo", hankel),
        (-x, (1 + x) ** (nu - 1), 0, "oo", lambda k: (-1) ** k * sympy.rf(1 - nu, k)),
        (-x, x ** (nu - 1) * sympy.exp(-x / 2), 0, "oo",
         lambda k: (-sympy.S.Half) ** k * sympy.rf(nu, k) / sympy.factorial(k)),
        (-(x**2) / 2 - c * x**4, 1, "-oo", "oo", lambda k: (-c) ** k * sympy.rf(sympy.S.Half, 2 * k)
         * 4**k / sympy.factorial(k)),
        ("log(x) - x", 1, 0, "oo", [1, "1/12", "1/288"].__getitem__),
    ],
)  # fmt: skip
def test_published_series(f: Any, g: Any, a: Any, b: Any, term: Any) -> None:
    (only,) = sa.laplace_integral(f, g, x, a, b, 5).contributions
    # At an end every other term of a smooth maximum is 0.
    step = only.contact if only.side == "right" else 1
    for k, found in enumerate(only.coefficients[::step][:3]):
        gap = found / only.coefficients[0] - sympy.sympify(term(k))
        assert sympy.simplify(sympy.gammasimp(gap)) == 0


@pytest.mark.parametrize(
    ("f", "g", "a", "b", "lam", "most"),
    [
        ("-x**2/2 - x**4", "1", "-oo", "oo", 16, 1e-15),
        ("-(x**2 - 1)**2", "1", "-oo", "oo", 10, 1e-17),
        ("-x - x**3", "1", "0", "oo", 16, 1e-13),
        ("-x - x**3", "1", "0", "oo", 300, 1e-26),
        # Complex singulants beside the real axis: what lies beyond their cut isn't in the sum.
        ("-x**4 + x**3/2 - x/2", "1", "-oo", "oo", 16, 1e-3),
        # A minimum just outside, whose singulant is a thousandth of the next.
        ("-3*x/4 - x**2 + 3*x**3/4 - x**4/4 - x**6", "2 - x**2", "-1/4", "3/4", 16, 1e-3),
        # Small and large singulants: zeros keep their digits only where lam is put in first.
        ("-(x**2 - 1)**2/10**100", "1", "-3", "3", 10**101, 1e-17),
        ("-10**100*(x**2 - 1)**2", "1", "-3", "3", mpf(10) ** -99, 1e-17),
    ],
)
def test_median_sums(f: str, g: str, a: str, b: str, lam: Any, most: float) -> None:
    """Right by quadrature, honest, and beyond the optimal order."""
    code = [sympy.lambdify(x, sympy.sympify(e), "mpmath") for e in (f, g)]
    with mp.workdps(40):
        ends = [mpf(e.replace("oo", "inf")) for e in (a, b)]
        cuts = [ends[0], *(mpf(k) / 4 for k in range(-8, 9) if ends[0] < mpf(k) / 4 < ends[1])]
        true = mp.quad(lambda z: code[1](z) * mp.exp(lam * code[0](z)), [*cuts, ends[1]])
        found, best = (
            sa.laplace_integral(f, g, "x", a, b, order).evaluate(lam, dps=30, full=True)
            for order in ("borel", "optimal")
        )
        assert abs(found.value - true) <= found.error * (1 + mpf(10) ** -20) + mpf(10) ** -36
        assert found.error <= min(most * abs(true), 2 * best.error)


def test_arrays_logarithms_and_precisions_of_the_caller() -> None:
    result, before = expansion("Stirling", 3), (mp.dps, flint.ctx.prec)
    lam = np.array([[1.5, 20.0], [300.0, 2.0]])
    assert np.array_equal(result.evaluate(lam)[0], [result.evaluate(1.5), result.evaluate(20)])
    some = expansion("zero of g", 3).evaluate([4.0, 400.0])
    assert np.isnan(some).tolist() == [True, False]
    full = result.evaluate(lam, full=True, log=True)
    assert full.value.shape == full.error.shape == lam.shape
    large = 10**15
    found = result.evaluate(large, dps=40, log=True, full=True)
    with mp.workdps(80):
        exact = mp.loggamma(large + 1) - (large + 1) * mp.log(large)
        assert abs(found.value - exact) <= found.error < mpf(10) ** -24
    assert (mp.dps, flint.ctx.prec) == before


@pytest.mark.parametrize("target", ["numpy", "mpmath"])
def test_the_formula_is_the_sum(target: str) -> None:
    free = sa.laplace_integral(-(x**2) / 2 - c * x**4 - x**3 / 9, 1 + x**2, x, "-oo", "oo", 4)
    assert "compared at sampled" in free.conditions[0]
    want = free.bind(c="1/3").evaluate(37)
    code = sa.emit(free.expression, target, name="f").load().f(1 / 3, 37.0)
    names = {
        s: 37 if str(s) == "lam" else sympy.Rational(1, 3) for s in free.expression.free_symbols
    }
    assert [float(code), float(free.expression.subs(names))] == pytest.approx([want] * 2, rel=1e-13)
    assert r"O\left(" in free.latex()


@pytest.mark.parametrize(
    "given",
    [
        (x, 1, x, 0, "oo"), ("cos(x)", 1, x, 0, "oo"), ("1/(1 + x**2)", 1, x, 0, "oo"),
        (-x, "exp(x**2)", x, 0, "oo"), ("1/x", 1, x, 0, 1), ("sin(1/x)", 1, x, 0, 1),
        (-x, 1 / x, x, 0, 1), (-(x**2), "sqrt(x)", x, -1, 1),
        (-(x**2), "sqrt(x**2)", x, -1, 1), (-(x**2), "log(x)", x, 0, 1),
        (-x, "sqrt(x) + x", x, 0, 1), ("-x**(3/2)", 1, x, 0, 1), ("-Abs(x)", 1, x, -1, 1),
        ("1 - x**(3/2) + 9*x**3/10", 1, x, 0, 1),
        (sympy.I * x, 1, x, 0, 1),
        (-x, "oo*x", x, 0, 1), (sympy.Integer(3), 1, x, 0, 1), (-sympy.gamma(x), 1, x, 1, 3),
        (-x, 1, x, 1, 0), (-x, 1, x, 0, x), (-x, 0, x, 0, 1), (-x, [1], x, 0, 1), (-x, 1, 3, 0, 1),
        (-x, 1, x, 0, 1, 0), (-x, 1, x, 0, 1, "best"), (-x, x ** (y - 1), x, 0, 1),
        # A corner above the end that has a maximum; a pole.
        ("exp(-20*x)/2 - sqrt((x - 1)**2)", 1, x, 0, 3), ("exp(-20*x) + tan(x)**2", 1, x, 0, 2),
        ("1/(10*(x - 1/2)**2) - 20*x", 1, x, 0, 1),
        # Limits at ends as high as a maximum, or higher.
        ("x*log(x)", 1, x, 0, 1), ("x/(1 + x)", "1/(1 + x)**2", x, 0, "oo"),
        (-(x**2), "Piecewise((1, x < 1), (2, True))", x, 0, 2),
        ("-(x - a)**2*(x - b)**2 + a*x", 1, x, -10, 10), (-x, "1 + lam*x", x, 0, "oo"),
        ("log(x) - x", 1, x, 0, "oo", "borel"), ("-x**4", 1, x, "-oo", "oo", "borel"),
        ("-x**2 - x**3", "x", x, 0, 1, "borel"), (-c * x**2, 1, x, "-oo", "oo", "borel"),
        (-(x**61), 1, x, 0, 1),
        ("-1/(x+" * 15 + "1" + ")" * 15, 1, x, 1, 2),
    ],
)  # fmt: skip
def test_bad_integrals(given: Any) -> None:
    with pytest.raises(sa.InputError):
        sa.laplace_integral(*given)


@pytest.mark.parametrize("f", ["-x**2/2 + x**3/10", "cos(x)", "-x - x**3"])
def test_the_first_omitted_term_has_the_stated_order(f: str) -> None:
    of, lam = sa.laplace_integral(f, "exp(x)", "x", 0, 1, 3), sympy.Symbol("lam", positive=True)
    one, two = (
        of.evaluate(n, dps=50, full=True).error / mpf(of.error.subs(lam, n).evalf(50))
        for n in (10_000, 40_000)
    )
    assert 0.8 < one / two < 1.25


def test_a_sign_that_decides_is_asked_for() -> None:
    with pytest.raises(sa.InputError, match=r"Symbol\('c', positive=True\)"):
        sa.laplace_integral("-x**2/2 - c*x**4", 1, x, "-oo", "oo")


@pytest.mark.parametrize(
    ("name", "lam", "options", "error"),
    [
        ("erfc", 0, {}, sa.InputError),
        ("erfc", [1.0, -2.0], {}, sa.InputError),
        ("Stirling", 10_000, {}, sa.RangeError),
        ("zero of g", 4, {"log": True, "full": True}, sa.AccuracyError),
        ("zero of g", 4, {}, sa.AccuracyError),  # the sum is off by more than half of it
    ],
)
def test_bad_values(name: str, lam: Any, options: Any, error: Any) -> None:
    with pytest.raises(error):
        expansion(name, 3).evaluate(lam, **options)
    # A pole; a jump, and a corner, of f where its derivatives are simpler than f.
    jump, corner = ("-x - atan(tan(x))/2", 1, 3), ("-x - sqrt((x - 1)**2)/2", 1, 2)
    for f, g, b in ((-(x**2), "1/(x - 1/2)", 1), jump, corner):
        with pytest.raises(sa.AccuracyError):
            sa.laplace_integral(f, g, x, 0, b).evaluate(9, full=True)
