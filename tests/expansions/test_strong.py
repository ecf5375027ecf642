"""The strong-noise expansion as a formula against method="strong_noise", which runs in balls."""

from __future__ import annotations

import time
from pathlib import Path

import mpmath
import pytest
import sympy

import symasym as sa
from tests.latex import compiled, needs_latex


@pytest.mark.parametrize("order", [0, 3])
@pytest.mark.parametrize("quantity", ["T", "C", "1-C", "P", "1-P"])
def test_the_formula_is_the_methods(quantity: str, order: int) -> None:
    start = 0 if quantity[-1] == "P" else "1/5"
    e = sa.expand(sa.friction(), quantity, noise="strong", order=order, start=start)
    given = {"mu": 3, "alpha": 1, "z0": "1/2", "kappa": 10, "r": 4}
    symbols = sorted(e.expression.free_symbols, key=str)
    with mpmath.workdps(60):
        exact = {n: sympy.Rational(x) for n, x in given.items()}
        values = {n: mpmath.mpf(x.p) / x.q for n, x in exact.items()}
        f = sympy.lambdify(symbols, e.expression, "mpmath")
        got = f(*[values[s.name] for s in symbols])
        bound = e.bind(mu=3, alpha=1, z0="1/2")
        want = bound.evaluate(10, 4, dps=25, full=True).value
        assert abs(got - want) < abs(want) * mpmath.mpf(10) ** -22


@pytest.mark.parametrize("quantity", ["T", "C", "1-C"])
@pytest.mark.parametrize("start", ["-2", "-1", "1", "7/4"])
def test_a_start_outside_the_layer(quantity: str, start: str) -> None:
    drift = sa.friction(3, 1, "1/2")
    e = sa.expand(drift, quantity, noise="strong", order=2, start=start)
    kappa, r = (s for s in sorted(e.expression.free_symbols, key=str))
    with mpmath.workdps(60):
        got = sympy.lambdify([kappa, r], e.expression, "mpmath")(mpmath.mpf(10), mpmath.mpf(4))
        want = e.evaluate(10, 4, dps=25, full=True).value
        assert abs(got - want) < abs(want) * mpmath.mpf(10) ** -22


def test_code_with_a_drift_that_may_vanish_beyond_the_layer() -> None:
    """z0 = 0: a tangency, at which (e^x - 1)/x is 1; the code is made in seconds."""
    e = sa.expand(sa.friction(mu=3, alpha=1), noise="strong", order=0, start="0.1")
    begin = time.perf_counter()
    module = e.emit("python").load()
    assert time.perf_counter() - begin < 30
    want = sa.escape_time(sa.friction(3, 1, 0), 20, 3, start="0.1", method="strong_noise", order=0)
    assert module.f(20.0, 3.0, 0.0) == pytest.approx(want, rel=1e-12)


def test_moments_are_polynomials_in_the_parameters() -> None:
    e = sa.expand(sa.friction(), "T", noise="strong", order=2)
    moments = {s.name: v for s, v in e.definitions.items() if s.name[0] in "nfm"}
    assert len(moments) == 2 * 3 * 4
    assert all(v.is_polynomial(*v.free_symbols) for v in moments.values())
    # Of V - V(0) over [-1, 0], times -1: n is of e^{lam (V - V(0))}.
    u = sympy.Symbol("u", real=True)
    V = -sympy.integrate(sa.friction().expression(), u)
    assert sympy.expand(moments["n1-"] - sympy.integrate(sympy.expand(V), (u, -1, 0))) == 0


@needs_latex
def test_latex_compiles(tmp_path: Path) -> None:
    text = sa.expand(sa.friction(), "P", noise="strong", order=1).latex()
    page = tmp_path / "page.tex"
    page.write_text(
        "\\documentclass{article}\\usepackage{amsmath}\\usepackage[paperwidth=200cm]{geometry}"
        f"\\begin{{document}}\\[{text}\\]\\end{{document}}"
    )
    compiled(page)


@pytest.mark.parametrize(
    ("drift", "quantity", "words"),
    [
        (sa.friction(), "density", "weak noise only"),
        (sa.Drift.general(), "T", "has no moments"),
        (sa.Drift("1 + sin(u)"), "T", "no polynomial in u, so that the moments"),
    ],
)
def test_bad_input(drift: sa.Drift, quantity: str, words: str) -> None:
    with pytest.raises(sa.InputError, match=words):
        sa.expand(drift, quantity, noise="strong")
