"""The median Borel–Padé sum against integrals, and what is claimed of its error."""

from __future__ import annotations

import random
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa
from symasym.asymptotics.laplace.borel import approximant

X = sympy.Symbol("x", real=True)
CASES = [
    ("-x**2/2 - x**4", "1", "-oo", "oo"),
    ("-(x**2 - 1)**2", "1", "-oo", "oo"),
    ("-(x**2 - 1)**2*(1 + x/4)**2", "1 + x", "-3", "oo"),
    ("-x**2/2 + x**3/3", "1", "-1", "1"),
    ("-x**2/2", "1 + x**2", "-oo", "oo"),
    ("-x - x**3", "1", "0", "oo"),
    ("-x**6/6 - x**2", "2 - x**3", "-oo", "oo"),
    # Complex singulants beside the real axis: what lies beyond their cut isn't in the sum.
    ("-x**6 - 3*x**4 - x**3/2 + 2*x**2 - 3*x/4", "2 - x**2", "-5/4", "2"),
    ("-x**4 + x**3/2 - x/2", "1", "-oo", "oo"),
    ("-2*x**4 + x**3 + x/2", "2 - x**2", "-5/4", "1/4"),
    # Sums of 37, 39 and 41 coefficients agree to a hundredth of their error.
    ("-x/2 - 5*x**2/4 - x**3 - 5*x**4/4 + 5*x**5/4 - x**6", "1 + x", "-oo", "oo"),
    ("x/2 - x**2 + x**3 - x**4/4 - x**6", "2 - x**2", "-oo", "oo"),
    # A minimum just outside, whose singulant is a thousandth of the next.
    ("-3*x/4 - x**2 + 3*x**3/4 - x**4/4 - x**6", "2 - x**2", "-1/4", "3/4"),
    ("x**2/4 - x**4", "2 - x**2", "-7/4", "2"),
    # f' = f'' = 0 at 0, outside.
    ("-x**4 - x**3/2", "1", "-1", "-1/8"),
]


def integral(f: str, g: str, a: str, b: str, lam: int) -> Any:
    """The integral by quadrature."""
    functions = [sympy.lambdify(X, sympy.sympify(e, {"x": X}), "mpmath") for e in (f, g)]
    lo, hi = (mpmath.mpf(e.replace("oo", "inf")) for e in (a, b))
    cuts = [y for y in np.arange(-2, 2.25, 0.25) if lo < y < hi]
    return mpmath.quad(
        lambda y: functions[1](y) * mpmath.exp(lam * functions[0](y)), [lo, *cuts, hi]
    )


@pytest.mark.every(4)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_claimed_error_holds(case: tuple[str, str, str, str]) -> None:
    """Minima of f between maxima (real singulants), complex ones, ends, a terminating series."""
    f, g, a, b = case
    e = sa.laplace_integral(f, g, "x", a, b, order="borel")
    assert e.bound is None
    with mpmath.workdps(35):
        for lam in (1, 4, 16, 40):
            got = e.evaluate(lam, dps=25, full=True)
            assert got.error_kind == "estimate"
            assert abs(got.value - integral(*case, lam)) <= got.error + mpmath.mpf(10) ** -28


@pytest.mark.slow
def test_the_claimed_error_holds_for_random_polynomials() -> None:
    draw = random.Random(20261122)
    asked = 0
    for _ in range(60):
        degree = draw.choice([3, 4, 5, 6])
        f = " + ".join(f"({draw.randint(-6, 6)})*x**{k}/4" for k in range(1, degree))
        f += f" - x**{degree + degree % 2}"
        ends = [("-oo", "oo"), (f"-{draw.randint(1, 8)}/4", f"{draw.randint(1, 8)}/4")]
        case = (f, draw.choice(["1", "1 + x", "2 - x**2"]), *draw.choice(ends))
        try:
            e = sa.laplace_integral(*case[:2], "x", *case[2:], order="borel")
        except sa.InputError:
            continue
        with mpmath.workdps(30):
            for lam in (1, 4, 16):
                got = e.evaluate(lam, dps=20, full=True)
                truth = integral(*case, lam)
                assert abs(got.value - truth) <= got.error + abs(truth) * mpmath.mpf(10) ** -19
                asked += 1
    assert asked > 120


def test_it_goes_far_beyond_the_optimal_order() -> None:
    f, g, a, b = CASES[1]
    errors = []
    with mpmath.workdps(35):
        truth = integral(f, g, a, b, 10)
        for order in ("optimal", "borel"):
            value = sa.laplace_integral(f, g, "x", a, b, order=order).evaluate(10, dps=25)
            errors.append(abs(value / truth - 1))
    assert errors[0] > 1e-6
    assert errors[1] < 1e-17


def well_of_friction() -> tuple[list[Any], Any, Any]:
    """Coefficients of the well's series (z0 = -0.4), lam at kappa = 0.3, and its true sum.

    The quartic V goes on for ever; the well's integral runs from one of its complex valleys to
    another, and the median is the mean of both ways round the barrier: the real part.
    """
    drift = sa.friction(mu=3, alpha=1, z0="-0.4")
    u = sympy.Symbol("u", real=True)
    A = drift.expression()
    f = sympy.integrate(A, u).subs(u, X)
    left, well, barrier = sorted(sympy.Poly(A, u).nroots(60))
    order = 59
    e = sa.laplace_integral(f, 1, X, (left + well) / 2, (well + barrier) / 2, order, dps=90)
    lam = mpmath.mpf(2) / mpmath.mpf("0.09")
    height = f.subs(X, well)
    rise = sympy.lambdify(X, f - height, "mpmath")
    points = [mpmath.mpf(str(p)) for p in (left, well, barrier)]
    turn = mpmath.expjpi(mpmath.mpf(1) / 4)
    path = [points[2] + k * turn for k in (3, 0.5, 0.2, 0)][::-1]
    right = mpmath.quad(lambda z: mpmath.exp(lam * rise(z)), [points[1], *path])
    path = [points[0] - k * turn for k in (3, 0.5, 0.2, 0)]
    there = mpmath.quad(lambda z: mpmath.exp(lam * rise(z)), [*path, points[1]])
    return list(e.contributions[0].coefficients), lam, mpmath.re(there + right)


def test_friction_s_well_at_kappa_0_3() -> None:
    """2e-6 from 11 coefficients, where the optimal order leaves 5e-3; ten digits more from 59."""
    with mpmath.workdps(90):
        c, lam, truth = well_of_friction()
        first = mpmath.mpf(1) / 2
        terms = [a * lam ** -(first + k) for k, a in enumerate(c)]
        least = min(range(len(terms)), key=lambda k: abs(terms[k]))
        assert 3e-3 < abs(mpmath.fsum(terms[:least]) / truth - 1) < 8e-3
        for count, most in ((11, 5e-7), (59, 1e-15)):
            found = approximant(c[:count], first, mpmath.mp)
            assert any(abs(mpmath.im(p)) < 1e-30 and mpmath.re(p) > 0 for p, _ in found.poles)
            assert abs(found.laplace(lam, mpmath.mp) / truth - 1) < most


def test_floats_arrays_and_logarithms() -> None:
    e = sa.laplace_integral("-(x**2 - 1)**2", 1, "x", "-oo", "oo", order="borel")
    one = e.evaluate(7)
    assert np.array_equal(e.evaluate([7, 9]), [one, e.evaluate(9)])
    assert e.evaluate(7, log=True) == pytest.approx(np.log(one), rel=1e-15)
    assert e.bind().evaluate(7) == one
    assert e.error_kind == "estimate"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("log(x) - x", 1, "x", 0, "oo"), "f = .*log.x.* is no polynomial in x"),
        (("-x**2", "exp(x)", "x", "-oo", "oo"), "g = exp.x. is no polynomial in x"),
        (("-x**4", 1, "x", "-oo", "oo"), "is for simple maxima, in steps of 1/lam"),
        (("-x**4 - x**3/2", 1, "x", "-oo", "oo"), "f' = f'' = 0 at x = 0; it is for f whose"),
        (("-c*x**2", 1, "x", "-oo", "oo"), "which needs numbers, and c have no value"),
    ],
)
def test_bad_input(arguments: tuple[Any, ...], words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.laplace_integral(*arguments, order="borel")
