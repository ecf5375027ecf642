"""Iterated integrals through a coalescence, against closed forms and plain nested quadrature."""

from __future__ import annotations

import random
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy
from mpmath import mp

import symasym as sa
from symasym.asymptotics.coalescence.iterated_regular import RegularPart
from symasym.asymptotics.coalescence.parts import nearby_pair
from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError, InputError, SymasymError

X = sympy.Symbol("x")
COUNT = 16
NODES, WEIGHTS = np.polynomial.legendre.leggauss(COUNT)
LEGENDRE = np.polynomial.legendre
# Row i times the values at the nodes is the integral from -1 to node i.
UP_TO = np.array(
    [
        LEGENDRE.legval(NODES, LEGENDRE.legint(row, lbnd=-1))
        for row in np.linalg.inv(LEGENDRE.legvander(NODES, COUNT - 1)).T
    ]
).T


def on_arrays(expression: Any) -> Any:
    function = sympy.lambdify(X, sympy.sympify(expression), "numpy")
    return lambda v: function(v) + 0 * v


def between(f: Any, g: Any, h: Any, a: float, b: float, lam: float) -> float:
    """The double integral over a < u < v < b, panel by panel."""
    f, g, h = map(on_arrays, (f, g, h))
    fine = np.linspace(a, b, 2001)
    rate = lam * np.abs(np.gradient(f(fine), fine)).max()
    edges = np.linspace(a, b, int(max(200, 2 * (b - a) * rate)) + 1)
    half, middle = np.diff(edges) / 2, (edges[1:] + edges[:-1]) / 2
    v = middle[:, None] + half[:, None] * NODES
    rise = lam * (f(v) - f(edges[:-1])[:, None])
    inner, outer = g(v) * np.exp(-rise), h(v) * np.exp(rise)
    own = half**2 * ((outer * (inner @ UP_TO.T)) @ WEIGHTS)
    inner, outer = half * (inner @ WEIGHTS), half * (outer @ WEIGHTS)
    total = before = 0.0
    for k, step in enumerate(np.exp(lam * np.diff(f(edges)))):
        total += own[k] + outer[k] * before
        before = step * (before + inner[k])
    return float(total)


def everywhere(f: Any, g: Any, h: Any, lam: float, cut: float) -> float:
    """The same from -oo to oo; beyond +-cut by t = v - u, on the scale of 1/(lam f')."""
    slope = on_arrays(sympy.diff(sympy.sympify(f), X))
    whole, g_, h_ = map(on_arrays, (f, g, h))
    y, w = np.polynomial.legendre.leggauss(40)
    far = np.concatenate([[0], np.geomspace(0.5, 60, 14)])

    def before(v: Any) -> Any:
        """e^{lam f(v)} int^v g e^{-lam f}."""
        total = 0 * v
        for lo, hi in zip(far, far[1:], strict=False):
            t = ((lo + hi) / 2 + (hi - lo) / 2 * y) / (lam * np.abs(slope(v)))[:, None]
            steps = slope(v[:, None, None] - t[:, :, None] * (1 + NODES) / 2) @ WEIGHTS
            values = w * g_(v[:, None] - t) * np.exp(lam * t / 2 * steps)
            total = total + (hi - lo) / 2 * values.sum(1) / (lam * np.abs(slope(v)))
        return total

    total = between(f, g, h, -cut, cut, lam)
    edges = np.linspace(-cut, cut, 2001)
    v = (edges[:-1, None] + edges[1:, None]) / 2 + np.diff(edges)[:, None] / 2 * NODES
    outer = h_(v) * np.exp(lam * (whole(v) - whole(np.array(-cut))))
    total += before(np.array([-cut]))[0] * (outer @ WEIGHTS * np.diff(edges) / 2).sum()
    for lo, hi in zip(*[[0, 0.05, 0.1, 0.2, 0.4, 0.7, 1][k:] for k in (0, 1)], strict=False):
        s = (lo + hi) / 2 + (hi - lo) / 2 * y
        for v in (-cut / s, cut / s):
            total += (hi - lo) / 2 * (w * cut / s**2 * h_(v) * before(v)).sum()
    return float(total)


def saddle_node(order: int) -> Any:
    return sa.uniform_integral("-(x**3/3 - c*x)", (1, 1), "x", "-oo", "oo", order=order)


@pytest.mark.parametrize("c", ["1/2", "1e-30", "0", "-1/2"])
def test_passage_through_a_saddle_node(c: str) -> None:
    """Ai² + Bi² (DLMF 9.11.4) is all of it, at every order."""
    found = saddle_node(1).bind(c=c).evaluate(8, dps=25, full=True)
    with mp.workdps(40):
        z = 4 * mp.mpf(Fraction(c).numerator) / Fraction(c).denominator
        exact = mp.pi**2 / 4 * (mp.airyai(z) ** 2 + mp.airybi(z) ** 2)
        assert abs(found.value - exact) <= found.error <= 1e-24 * exact
        # The same with v - u and (u + v)/2 in place of u and v, the latter integrated.
        single = mp.quad(lambda t: mp.exp(z * t - t**3 / 12) / mp.sqrt(t), [0, 1, 3, 8, 20])
        assert abs(found.value - mp.sqrt(mp.pi) * single / 4) <= 1e-15 * exact


CASES = [
    ("-(x**3/3 - x/10) - x**4/20", "cos(x)", "1/(2 + x)", "-1", "3/2"),
    ("-x**3/3 + x**4/15", "exp(x/2)", "1 + x/3", "-1", "1"),
    # The maximum first: no products, and the ends above all.
    ("x**3/3 - x/5 - x**4/30", "cos(x)", "1/(2 + x)", "-1", "1"),
]


@pytest.mark.parametrize("case", range(len(CASES)))
def test_against_nested_quadrature(case: int) -> None:
    f, g, h, a, b = CASES[case]
    expansion = sa.uniform_integral(f, (g, h), "x", a, b, order=4, near=0)
    for lam in (15, 60):
        found = expansion.evaluate(lam, full=True)
        exact = between(f, g, h, float(Fraction(a)), float(Fraction(b)), lam)
        assert abs(found.value - exact) <= found.error + 1e-11 * abs(exact)
    assert abs(found.value - exact) <= 2e-3 * abs(exact)
    assert found.error_kind == "estimate"


def test_outer_part_of_a_complex_pair() -> None:
    """On the real line it has a residue more than past both zeros."""
    f = -(X**3) / 3 - X / 4 - X**4 / 20
    weights = sympy.Integer(1), 1 / (2 + X)
    with own_context(20) as context:
        near = nearby_pair(-f, weights, X, context.zero, 5, context)
        ends = context.mpf(-1), context.mpf(3) / 2
        outer = RegularPart(f, weights, X, ends, near, 2, context)
        found = [float(x + y) for x, y in zip(outer.past_both(), outer.share(), strict=True)]
    slope = sympy.diff(f, X)
    integrands = [-weights[1] / slope, weights[1] * sympy.diff(f, X, 2) / slope**3]
    for value, integrand in zip(found, integrands, strict=True):
        exact = mp.quad(sympy.lambdify(X, integrand, "mpmath"), [-1, -0.5, 0, 0.5, 1.5])
        assert abs(value - exact) < 1e-10 * abs(exact)


def test_infinite_ends() -> None:
    f, g, h = "-(x**3/3 + x/8) - x**5/30", "1/(3 + x + x**2)", "1/(1 + x**2/4)"
    found = sa.uniform_integral(f, (g, h), "x", "-oo", "oo", order=3).evaluate(80, full=True)
    exact = everywhere(f, g, h, 80, 1.5)
    assert abs(found.value - exact) <= found.error + 1e-11 * exact
    assert found.error < 1e-3 * exact


@pytest.mark.parametrize("c", ["1/10", "-1/10"])
def test_orders(c: str) -> None:
    """Twice lam, 2^-N times the relative error of N terms."""
    f, g, h = f"-(x**3/3 - ({c})*x) - x**4/15", "exp(x)", "1/(2 + x)"
    exact = [between(f, g, h, -1, 1, lam) for lam in (250, 500)]
    for order in (1, 2):
        found = sa.uniform_integral(f, (g, h), "x", -1, 1, order=order, near=0).evaluate([250, 500])
        first, second = abs(found / exact - 1)
        assert abs(np.log2(first / second) - order) < 0.05 * order


def test_nothing_lost_at_the_coalescence() -> None:
    f, weights = "-(x**3/3 - c*x) - x**4/15", ("1 + x/3", 1)
    expansion = sa.uniform_integral(f, weights, "x", -1, 1, order=1, near=0)
    gaps = [0, "1e-25", "-1e-25", "1e-6", "-1e-6"]
    bound = [expansion.bind(c=c) for c in gaps]
    middle, up, down, *far = [one.evaluate(50, dps=32) for one in bound]
    with mp.workdps(40):
        slope = (up - down) / mp.mpf("2e-25")
        assert abs(slope / ((far[0] - far[1]) / mp.mpf("2e-6")) - 1) < 1e-6
        assert abs(up + down - 2 * middle) < 1e-31 * middle


def scene(rng: random.Random) -> tuple[Any, ...]:
    """f, g, h, ends, lam and order, drawn at random."""

    def number(lo: float, hi: float) -> Any:
        return sympy.Rational(rng.randint(int(lo * 1000), int(hi * 1000)), 1000)

    c, s = number(-0.3, 0.4), number(-1, 1)
    lam, order = round(float(np.exp(rng.uniform(1.4, 5.2))), 3), rng.randint(1, 5)
    if rng.random() < 0.3:
        f = rng.choice([-(X**3) / 3 + c * X - number(0, 0.3) * X**5, (1 + c) * X - sympy.sinh(X)])
        weights = [sympy.Integer(1), 1 / (3 + X + X**2), sympy.exp(-(X**2) / 4), 1 / (1 + X**2 / 4)]
        a, b = -sympy.oo, sympy.oo
    else:
        f = -(X**3) / 3 + c * X + number(-0.12, 0.12) * X**4 + number(-0.08, 0.08) * X**5
        f *= rng.choice([1, 1, 1, -1])
        weights = [1 + 0 * X, sympy.cos(X + s), 1 / (3 + X), sympy.exp(s * X), 1 + s * X / 2]
        a, b = -number(0.8, 1.8), number(0.8, 1.8)
    return f, rng.choice(weights), rng.choice(weights), a, b, lam, order


def is_honest(f: Any, g: Any, h: Any, a: Any, b: Any, lam: float, order: int) -> bool | None:
    """None where it is refused, or the quadrature is beyond float64."""
    try:
        near = 0 if b.is_finite else None
        found = sa.uniform_integral(f, (g, h), X, a, b, order=order, near=near)
        found = found.evaluate(lam, full=True)
    except SymasymError:
        return None
    with np.errstate(all="ignore"):
        if b.is_finite:
            exact = between(f, g, h, float(a), float(b), lam)
        else:
            exact = everywhere(f, g, h, lam, 2.0 if f.has(sympy.sinh) else 1.6)
    if not np.isfinite(exact):
        return None
    return bool(abs(found.value - exact) <= found.error + 1e-11 * abs(exact))


def test_ends_that_cut_off_a_complex_pair() -> None:
    f = "-59*x**5/1000 + 33*x**4/500 - x**3/3 - 127*x/500"
    parts = map(sympy.sympify, (f, "1/(x + 3)", 1, "-447/500", "107/100"))
    assert is_honest(*parts, 15.479, 4)


@pytest.mark.parametrize(("seed", "count"), [(3, 1), pytest.param(1, 240, marks=pytest.mark.slow)])
def test_estimates_are_honest(seed: int, count: int) -> None:
    rng = random.Random(seed)
    found = [is_honest(*scene(rng)) for _ in range(count)]
    assert found.count(True) >= 2 * count / 3
    assert False not in found


ALPHA = sympy.Symbol("alpha", positive=True)
CUBIC = ALPHA**2 * X - X**3 / 3


@pytest.mark.parametrize(
    ("f", "weights", "end", "order"),
    [
        (CUBIC, (1, 1 / (1 + X**2)), sympy.oo, 2),
        (CUBIC, (1 + X, 2 + X), sympy.Integer(2), 1),
    ],
)
def test_formula_and_numbers(f: Any, weights: Any, end: Any, order: int) -> None:
    """The formula comes from series at each point and antiderivatives, the number from neither."""
    expansion = sa.uniform_integral(f, weights, X, -end, end, order)
    formula = expansion.expression_in("lam", saddles=(-ALPHA, ALPHA))
    slopes = {
        f"airy{k}prime": lambda y, k=k: getattr(mp, f"airy{k}")(y, derivative=1)
        for k in ("ai", "bi")
    }
    lam = sympy.Symbol("lam", positive=True)
    value = expansion.bind(alpha="3/5").evaluate(30, dps=20)
    with mp.workdps(40):
        number = sympy.lambdify([ALPHA, lam], formula, [slopes, "mpmath"])(mp.mpf(3) / 5, 30)
        assert abs(number - value) <= 1e-19 * abs(value)


def test_calls() -> None:
    law = saddle_node(2)
    assert law.parameters == (sympy.Symbol("c"),)
    assert law.error_kind == "none"
    assert "iterated" in str(law)
    bound = law.bind(c="1/4")
    values = bound.evaluate([10.0, 20.0], full=True)
    assert values.value.shape == (2,)
    assert abs(values.value[1] - float(bound.evaluate(20, dps=20))) <= values.error[1]
    assert bound.evaluate(1e6, log=True) == pytest.approx(
        float(bound.evaluate(10**6, dps=20, log=True))
    )
    zeta, rows = bound.coefficients(dps=20)
    with mp.workdps(20):
        assert abs(zeta - mp.mpf("0.25")) < 1e-19
        assert abs(rows[0][0] - mp.pi**2) < 1e-18
        assert max(abs(y) for y in (*rows[0][1:], *rows[1])) < 1e-18


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("-x**3", (1, 1, 1), "x", -1, 1), "has 3 parts"),
        (("-x**3", (1, 0), "x", -1, 1), "h is 0"),
        (("-x**3", (1, "x + I"), "x", -1, 1), "h = x . I is not a constant times"),
        (("I*x**3", (1, 1), "x", -1, 1), "not real"),
        (("-Abs(x)**3", (1, 1), "x", -1, 1), "kinks"),
        (("-x**3", (1, "1/(x - 1/3)"), "x", -1, 1), "pole"),
        (("x - x**3/3", (1, 1), "x", "-1/2", 3), "no other"),
        (("x**3/3 - x", (1, 1), "x", "-oo", "oo"), "must fall from oo"),
        (("x - x**3/3", (1, "x"), "x", "-oo", "oo"), "no faster than 1/x"),
        (("-x", (1, 1), "x", -1, 1), "no two saddles"),
        (("x - x**3/3", (1, 1), "x", -2, 2, 0), "from 1 to"),
    ],
)
def test_refused(arguments: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        sa.uniform_integral(*arguments).evaluate(10)


def test_no_formula_where_there_is_none() -> None:
    waves = sa.uniform_integral(CUBIC, (1, sympy.cos(X)), X, -2, 2, 1)
    with pytest.raises(InputError, match="not rational"):
        waves.expression_in(saddles=(-ALPHA, ALPHA))
    apart = sa.uniform_integral("9*x - x**3/3", (1, "1/(1 + x**2)"), "x", "-oo", "oo")
    with pytest.raises(AccuracyError, match="too far apart"):
        apart.evaluate(10)
