"""Laplace expansions of the table's integrals, right and honest; published series; refusals."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache
from typing import Any

import flint
import mpmath
import numpy as np
import pytest
import sympy
from mpmath import mp, mpf

import symasym as sa
from symasym.series.local import watson
from symasym.series.power_series import Series
from tests.integrals.table import DIGITS, INTEGRALS, NAMED, scaled, truth
from tests.moments import moment_coefficients

x, nu = sympy.Symbol("x"), sympy.Symbol("nu", positive=True)
ROWS = [(scene.name, order) for scene in INTEGRALS for order in (3, "optimal")]


@cache
def expansion(name: str, order: Any) -> Any:
    scene = NAMED[name]
    return sa.laplace_integral(scene.f, scene.g, x, scene.a, scene.b, order)


@pytest.mark.parametrize(("name", "order"), ROWS, ids=str)
def test_right_and_honest(name: str, order: Any) -> None:
    """The claimed error is the true one, also of float64; and as small as the order says."""
    result = expansion(name, order)
    for lam in (4, 60):
        found = result.evaluate(lam, dps=25, full=True)
        value, error = scaled(result, found, lam)
        assert found.error_kind == "bound"
        with mp.workdps(DIGITS):
            true = abs(value - truth(name, lam))
            assert true <= error <= true * mpf("1.01") + mpf(10) ** -22
    rounded = result.evaluate(60, full=True)
    assert abs(rounded.value - found.value) <= 2 * rounded.error
    if order == 3:
        errors = [scaled(result, result.evaluate(n, dps=30, full=True), n)[1] for n in (900, 1800)]
        slope = math.log2(errors[0] / errors[1])
        # Where a coefficient is 0 the next one shows.
        steps = {Fraction(2 if c.side == "both" else 1, c.contact) for c in result.contributions}
        powers = [float(result.omitted) + k * float(gap) for gap in steps for k in range(4)]
        # There what the near end cuts off is all there is.
        small = name == "cut close" or errors[1] < mpf(10) ** -28
        assert small or min(abs(slope - power) for power in powers) < 0.06


def test_stirling_to_twenty_terms() -> None:
    """DLMF 5.11.3 from 5.11.1: the exponential of the series of Bernoulli numbers."""
    logs = [Fraction(0)] * 20
    for k in range(1, 11):
        b = sympy.bernoulli(2 * k)
        logs[2 * k - 1] = Fraction(int(b.p), int(b.q)) / (2 * k * (2 * k - 1))
    series = [Fraction(1)]
    for n in range(1, 20):
        series.append(sum(j * logs[j] * series[n - j] for j in range(1, n + 1)) / n)
    (only,) = expansion("Stirling", 20).contributions
    root = sympy.sqrt(2 * sympy.pi)
    assert [sympy.nsimplify(c / root) for c in only.coefficients] == list(
        map(sympy.Rational, series)
    )


def hankel(k: int) -> Any:
    """a_k(nu) of DLMF 10.17.1."""
    product = sympy.prod([4 * nu**2 - (2 * j - 1) ** 2 for j in range(1, k + 1)])
    return product / (sympy.factorial(k) * 8**k)


@pytest.mark.parametrize(
    ("f", "g", "a", "b", "term"),
    [
        (sympy.cos(x), sympy.cos(nu * x), 0, sympy.pi, lambda k: (-1) ** k * hankel(k)),
        (-sympy.cosh(x), sympy.cosh(nu * x), "-oo", "oo", hankel),
        (-x, (1 + x) ** (nu - 1), 0, "oo", lambda k: (-1) ** k * sympy.rf(1 - nu, k)),
        (-x, x ** (nu - 1) * sympy.exp(-x / 2), 0, "oo",
         lambda k: (-sympy.S.Half) ** k * sympy.rf(nu, k) / sympy.factorial(k)),
    ],
    ids=["10.40.1", "10.40.2", "8.11.2", "gamma"],
)  # fmt: skip
def test_dlmf_with_a_free_parameter(f: Any, g: Any, a: Any, b: Any, term: Any) -> None:
    (only,) = sa.laplace_integral(f, g, x, a, b, 9).contributions
    # At an end every other term of a smooth maximum is 0.
    step = only.contact if only.side == "right" else 1
    for k, c in enumerate(only.coefficients[::step][:5]):
        assert sympy.simplify(sympy.gammasimp(c / only.coefficients[0]) - term(k)) == 0


@pytest.mark.parametrize(("contact", "beta"), [(1, 1), (2, Fraction(1, 2)), (3, 2), (4, 1)])
def test_reversion_and_moments_agree(contact: int, beta: Any) -> None:
    f = [Fraction(0)] * contact + [Fraction(-3, k + 2) for k in range(20)]
    g = [Fraction((-1) ** k, 2 * k + 1) for k in range(20)]
    steep = Series(c / f[contact] for c in f[contact:])
    assert list(watson(steep, Series(g), contact, beta)) == moment_coefficients(f, g, contact, beta)


def test_powers_that_differ_by_an_integer_are_one_series() -> None:
    g = [x ** sympy.Rational(p) for p in ("7/2", "-1/2")]
    both, *alone = (sa.laplace_integral(-x, e, x, 0, 1, 6) for e in (sum(g), *g))
    assert len(both.contributions) == 1
    gap = both.expression_in(nu) - sum(part.expression_in(nu) for part in alone)
    assert sympy.expand(gap) == 0


# -- the median Borel-Padé sum ----------------------------------------------------------------

BOREL = [
    ("-x**2/2 - x**4", "1", "-oo", "oo", 16, 1e-15),
    ("-(x**2 - 1)**2", "1", "-oo", "oo", 10, 1e-17),
    ("-x**2/2", "1 + x**2", "-oo", "oo", 4, 1e-30),
    ("-x - x**3", "1", "0", "oo", 16, 1e-13),
    # Complex singulants beside the real axis: what lies beyond their cut isn't in the sum.
    ("-x**4 + x**3/2 - x/2", "1", "-oo", "oo", 16, 1e-3),
    # A minimum just outside, whose singulant is a thousandth of the next.
    ("-3*x/4 - x**2 + 3*x**3/4 - x**4/4 - x**6", "2 - x**2", "-1/4", "3/4", 16, 1e-3),
]


@pytest.mark.parametrize("case", BOREL, ids=lambda case: case[0])
def test_median_sums(case: Any) -> None:
    """Right by quadrature, honest, and far beyond the optimal order."""
    f, g, a, b, lam, most = case
    code = [sympy.lambdify(x, sympy.sympify(e), "mpmath") for e in (f, g)]
    ends = [mpf(e.replace("oo", "inf")) for e in (a, b)]
    with mp.workdps(40):
        cuts = [ends[0], *(mpf(k) / 4 for k in range(-8, 9) if ends[0] < mpf(k) / 4 < ends[1])]
        true = mp.quad(lambda z: code[1](z) * mp.exp(lam * code[0](z)), [*cuts, ends[1]])
        e = sa.laplace_integral(f, g, "x", a, b, order="borel")
        found = e.evaluate(lam, dps=30, full=True)
        assert abs(found.value - true) <= found.error * (1 + mpf(10) ** -20) + mpf(10) ** -36
        assert found.error <= most * abs(true)


def test_the_median_sum_goes_beyond_the_optimal_order() -> None:
    well = ("-(x**2 - 1)**2", 1, "x", "-oo", "oo")
    errors = [
        sa.laplace_integral(*well, order=order).evaluate(10, dps=25, full=True).error
        for order in ("optimal", "borel")
    ]
    assert errors[1] < 1e-10 * errors[0]


# -- the object -------------------------------------------------------------------------------


def test_arrays_logarithms_and_range() -> None:
    result = expansion("Stirling", 3)
    lam = np.array([[1.5, 20.0], [300.0, 2.0]])
    assert np.array_equal(result.evaluate(lam)[0], [result.evaluate(1.5), result.evaluate(20)])
    full = result.evaluate(lam, full=True, log=True)
    assert full.value.shape == full.error.shape == lam.shape
    large = 10**15
    exact = mpmath.loggamma(large + 1) - (large + 1) * mpmath.log(large)
    found = result.evaluate(large, dps=40, log=True, full=True)
    with mp.workdps(80):
        exact = mp.loggamma(large + 1) - (large + 1) * mp.log(large)
        assert abs(found.value - exact) <= found.error < mpf(10) ** -24
    with pytest.raises(sa.RangeError, match="log=True"):
        result.evaluate(10_000)
    with pytest.raises(sa.AccuracyError, match="not surely positive"):
        sa.laplace_integral(-(x**2), -1, x, -1, 1, 2).evaluate(10, log=True)
    with pytest.raises(sa.AccuracyError, match="could not be enclosed"):
        sa.laplace_integral(-(x**2), "1/(x - 1/2)", x, -1, 1).evaluate(9, full=True)


def test_rounded_coefficients_and_precisions_of_the_caller() -> None:
    before = mp.dps, flint.ctx.prec
    coarse = sa.laplace_integral("sin(x) - x**2/5", "1/(1 + x**2)", x, 0, 5, 2, dps=80)
    with mp.workdps(7):
        value = coarse.evaluate(10, dps=60)
    assert abs(value - expansion("no closed form", 2).evaluate(10, dps=25)) < 1e-20
    assert str(coarse.contributions[0].point).startswith("1.1105")
    assert (mp.dps, flint.ctx.prec) == before


def test_smaller_maxima_are_dropped_or_kept() -> None:
    wells = ("-x**2*(x - 2)**2 + x/10", 1, "x", -1, 3)
    (line,) = sa.laplace_integral(*wells).dropped
    assert line.startswith("maximum at x = 0.01")
    kept = sa.laplace_integral(*wells, keep=True)
    assert len(kept.contributions) == 2
    assert not kept.dropped


@pytest.mark.parametrize("target", ["numpy", "mpmath"])
def test_the_verbs_of_expansions(target: str) -> None:
    """Expression, terms, error, LaTeX and code are the sum that evaluate adds up."""
    c = sympy.Symbol("c", positive=True)
    free = sa.laplace_integral(-(x**2) / 2 - c * x**4 - x**3 / 9, 1 + x**2, x, "-oo", "oo", 4)
    assert free.error_kind == "none"
    assert "none claimed" in free.error
    assert sum(free.terms) == free.expression
    assert r"O\left(" in free.latex()
    assert free._repr_latex_() == rf"$\displaystyle {free.latex()}$"
    assert str(free).endswith(free.error)
    bound = free.bind(c="1/3")
    want = bound.evaluate(37)
    assert float(free.emit(target, name="f").load().f(1 / 3, 37.0)) == pytest.approx(
        want, rel=1e-13
    )
    (lam,) = bound.expression.free_symbols
    assert float(bound.expression.subs(lam, 37)) == pytest.approx(want, rel=1e-13)
    short = sa.laplace_integral(-x, 1 / (1 + x), x, 0, "oo", 3)
    assert str(short).startswith("e^(lam (0)) [(1) lam^(-1) + (-1) lam^(-2) + (2) lam^(-3)]")


def test_signs_and_given_maxima() -> None:
    c = sympy.Symbol("c", positive=True)
    (own,) = sa.laplace_integral(-(x**2) / 2 - c * x**4, 1, x, "-oo", "oo", order=2).contributions
    root = sympy.sqrt(2 * sympy.pi)
    # Gaussian moments: E x^4 = 3.
    assert [sympy.simplify(k / root) for k in own.coefficients] == [1, -3 * c]
    given = sa.laplace_integral(-c * sympy.cosh(x), 1, x, -2, 2, maxima=[0])
    assert given.conditions == ("f is largest at x = 0 (compared at sampled parameters)",)


y = sympy.Symbol("y")


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ((x, 1, x, 0, "oo"), "does not fall"),
        (("cos(x)", 1, x, 0, "oo"), "does not fall"),
        (("1/(1 + x**2)", 1, x, 0, "oo"), "does not fall"),
        ((-x, "exp(x**2)", x, 0, "oo"), "g = exp.x..2. grows"),
        (("1/x", 1, x, 0, 1), "tends to oo"),
        (("sin(1/x)", 1, x, 0, 1), "diverges or is complex"),
        ((-x, 1 / x, x, 0, 1), "diverges unless"),
        ((-(x**2), "sqrt(x)", x, -1, 1), "isn't real"),
        ((-(x**2), "log(x)", x, 0, 1), "log is singular"),
        ((-(sympy.Abs(x) ** sympy.Rational(3, 2)), 1, x, -1, 1), "no Taylor series"),
        ((sympy.I * x, 1, x, 0, 1), "complex"),
        ((-x, "oo*x", x, 0, 1), "g = oo.x is complex, infinite or undefined"),
        ((sympy.Integer(3), 1, x, 0, 1), "does not contain x"),
        ((-sympy.gamma(x), 1, x, 1, 3), "contains gamma"),
        ((-x, 1, x, 1, 0), "a must be less than b"),
        ((-x, 1, x, 0, x), "contains x"),
        ((-(nu**2), 1, nu, -1, 1), "by its own assumptions"),
        ((-x, 0, x, 0, 1), "g is 0"),
        ((-x, [1], x, 0, 1), "give a SymPy expression"),
        ((-x, 1, 3, 0, 1), "variable of integration"),
        ((-x, 1, x, 0, 1, 0), "order is 0"),
        ((-x, 1, x, 0, 1, "best"), "order is 'best'"),
        (("Piecewise((0, x < 1), (1 - x, True))", 1, x, 0, 2), "no isolated"),
        ((-x, x ** (y - 1), x, 0, 1), "diverges unless"),
        ((-y * x**2, 1, x, -1, 1), "depends on the sign of y"),
        (("-x**2/2 - c*x**4", 1, x, "-oo", "oo"), "c must be positive: pass Symbol.'c'"),
        (("-(x - a)**2*(x - b)**2 + a*x", 1, x, -10, 10), "could not be decided|no isolated"),
        ((-x, "1 + lam*x", x, 0, "oo"), "has a parameter lam, which the formula has"),
        (("log(x) - x", 1, "x", 0, "oo", "borel"), "f = .*log.x.* is no polynomial in x"),
        (("-x**4", 1, "x", "-oo", "oo", "borel"), "f' = f'' = 0 at x = 0"),
        (("-x**2 - x**3", "x", "x", 0, 1, "borel"), "in steps of"),
        (("-c*x**2", 1, "x", "-oo", "oo", "borel"), "which needs numbers, and c have no value"),
    ],
)
def test_bad_integrals(arguments: Any, says: str) -> None:
    with pytest.raises(sa.InputError, match=says) as caught:
        sa.laplace_integral(*arguments)
    assert str(caught.value).endswith(".")


@pytest.mark.parametrize("lam", [0, -1, [1.0, -2.0], 1j, "a", float("nan")])
def test_bad_lam(lam: Any) -> None:
    with pytest.raises(sa.InputError):
        expansion("erfc", 3).evaluate(lam)


def test_wrong_maxima_are_refused() -> None:
    with pytest.raises(sa.InputError, match="has no maximum"):
        sa.laplace_integral(-(x**2), 1, x, -1, 1, maxima=["1/2"])
