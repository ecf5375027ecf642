"""No answer depends on the precision that mpmath, its intervals or flint are set to outside."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flint
import mpmath
import numpy as np
import pytest
import sympy

import symasym as sa

DRIFT = sa.friction(3, 1, "-0.3")
SLIDING = sa.linear(1, -1)
ANALYTIC = sa.tanh(1, "-1/2", 3)
# An order of its own for each kind of answer, all with their errors.
FULL: dict[str, Any] = {"full": True}
DIGITS: dict[str, Any] = {"full": True, "dps": 22}


def _integral(*given: Any, **options: Any) -> list[Any]:
    found = sa.laplace_integral(*given, **options)
    values = [found.evaluate(40, **FULL), found.evaluate("40", dps=18, full=True)]
    return [str(found), str(found.expression_in()), found.latex(), *values]


def _uniform(*given: Any) -> list[Any]:
    found = sa.uniform_integral(*given)
    return [str(found), found.evaluate(40, **FULL), found.evaluate("40", **DIGITS)]


def _scene(verb: Callable[..., Any], *scene: Any, **options: Any) -> Callable[[], list[Any]]:
    """A float, an array, digits; the logarithm."""
    array = [[float(sympy.Rational(str(x)))] if k == 0 else x for k, x in enumerate(scene[1:])]

    def ask() -> list[Any]:
        found = [
            verb(*scene, **options, **FULL),
            verb(*scene, **options, **DIGITS),
            verb(scene[0], *array, **options, **FULL),
            verb(*scene, **options, log=True, **FULL),
        ]
        return [*found, *map(str, found)]

    return ask


CALLS: dict[str, Callable[[], Any]] = {
    # -- exact
    "T exact": _scene(sa.escape_time, DRIFT, "0.3", 10),
    "T exact, analytic": _scene(sa.escape_time, ANALYTIC, "0.5", 3),
    "C exact": _scene(sa.exit_probability, DRIFT, "0.4", 2),
    "P exact": _scene(sa.occupation, SLIDING, "0.4"),
    "density": lambda: sa.stationary_density(SLIDING, "0.4", "1/3", dps=20),
    # -- bounds and estimates
    "T laplace": _scene(sa.escape_time, DRIFT, "0.1", 10, method="laplace", order=2),
    "T laplace, analytic": _scene(
        sa.escape_time, sa.tanh(1, "-1/2", 3), "0.1", 3, method="laplace", order=1
    ),
    "C laplace": _scene(sa.exit_probability, ANALYTIC, "0.1", 3, method="laplace", order=2),
    "P laplace": _scene(sa.occupation, SLIDING, "0.1", complement=True, method="laplace", order=2),
    "T uniform": _scene(sa.escape_time, DRIFT, "0.1", 10, method="uniform", order=0),
    "1 - P uniform": lambda: sa.occupation(
        SLIDING, "0.1", complement=True, method="uniform", order=0, **FULL
    ),
    "T strong": _scene(sa.escape_time, DRIFT, 4, 3, method="strong_noise", order=4),
    "C strong": _scene(sa.exit_probability, ANALYTIC, 4, 3, method="strong_noise", order=4),
    "P strong": _scene(sa.occupation, SLIDING, 4, method="strong_noise", order=4),
    "C bound": _scene(sa.exit_probability, DRIFT, "0.5", 2, method="bound"),
    "C bound, analytic": _scene(sa.exit_probability, ANALYTIC, "0.2", 3, method="bound"),
    "T paper": _scene(sa.escape_time, DRIFT, "0.1", 10, method="paper"),
    "C paper": _scene(sa.exit_probability, sa.linear(1, 2), "0.3", 5, method="paper"),
    "T auto": lambda: sa.escape_time(DRIFT, "0.1", 10, method="auto", rtol=1e-6, full=True),
    "T auto, weak": lambda: sa.escape_time(DRIFT, "0.05", 10, method="auto", rtol=1e-3, full=True),
    "plan": lambda: str(sa.plan(DRIFT, 0.1, 10, rtol=1e-6)),
    "plan, a fold": lambda: str(sa.plan(sa.friction(3, 1, "-0.7"), 0.2, 10, rtol=1e-2)),
    # -- integrals
    "atan": lambda: _integral("-atan(x)**2 - x**2/8", 1, "x", -3, 4, order=2),
    "numeric": lambda: _integral("-x**2 + cos(x)", "exp(x)/3", "x", "-1/2", 2, order=2, dps=30),
    "Stirling": lambda: _integral("log(x) - x", 1, "x", 0, "oo", 3),
    "Bessel": lambda: _integral("-cosh(x)", 1, "x", "-oo", "oo", 3),
    "end": lambda: _integral("-asinh(x)", "1/sqrt(x)", "x", 0, 2, 2),
    "coefficients": lambda: sa.laplace_integral("-x**2 - x**3/3", 1, "x", -1, 1, 3).contributions,
    "saddles": lambda: _uniform("x**3/3 - x/10", 1, "x", "-oo*I", "oo*I", 2),
    "saddle beside an end": lambda: _uniform("-(x - 1/10)**2", "1/(1 + x**2)", "x", 0, "oo", 2),
    # -- others
    "critical points": lambda: [DRIFT.critical_points(), ANALYTIC.critical_points()],
    "region": lambda: [DRIFT.region, ANALYTIC.region, str(DRIFT), repr(ANALYTIC)],
    "potential": lambda: [
        str(DRIFT.potential()),
        DRIFT.potential_at([0.25, 2.0]),
        ANALYTIC.potential_at(0.25),
    ],
    "Stokes": lambda: sa.stokes_multiplier(sa.friction(3, 1, "-0.7"), "0.2", dps=20),
    "rescale": lambda: sa.rescale(eps="0.01", kappa="0.03", r="0.1"),
    "sensitivity": lambda: sa.sensitivity(DRIFT, "0.4", 3),
    "sensitivity, digits": lambda: sa.sensitivity(DRIFT, "0.4", 3, dps=20),
    "formula": lambda: str(sa.formula("eq:Ttilde").latex()),
}


def plain(x: Any) -> Any:
    """The answer as exact text."""
    if hasattr(x, "_mpf_") and not isinstance(x, sympy.Basic):
        return [int(part) for part in x._mpf_]
    if hasattr(x, "_mpc_"):
        return [plain(x.real), plain(x.imag)]
    if isinstance(x, (float, np.floating, np.ndarray)):
        return repr(np.asarray(x).tolist())
    if dataclasses.is_dataclass(x):
        return {f.name: plain(getattr(x, f.name)) for f in dataclasses.fields(x) if f.repr}
    if isinstance(x, dict):
        return {str(k): plain(v) for k, v in x.items()}
    if isinstance(x, (tuple, list)):
        return [plain(y) for y in x]
    return str(x)


def answers(dps: int, bits: int) -> dict[str, Any]:
    """Every call's answer, or its refusal, at these precisions outside."""
    mpmath.mp.dps, mpmath.iv.dps = dps, dps
    flint.ctx.prec, flint.ctx.cap = bits, 7
    found = {}
    for name, call in CALLS.items():
        try:
            found[name] = plain(call())
        except sa.SymasymError as refusal:
            found[name] = f"{type(refusal).__name__}: {refusal}"
        assert (mpmath.mp.dps, mpmath.iv.dps) == (dps, dps), name
        assert (flint.ctx.prec, flint.ctx.cap) == (bits, 7), name
    return found


def at(dps: int, bits: int) -> dict[str, Any]:
    """`answers` of a process of its own: caches would hide what depends on the precision."""
    run = subprocess.run(
        [sys.executable, __file__, str(dps), str(bits)],
        capture_output=True,
        text=True,
        check=False,
        cwd=Path(__file__).parents[2],
    )
    assert run.returncode == 0, run.stderr
    found: dict[str, Any] = json.loads(run.stdout)
    return found


@pytest.fixture(scope="module")
def usual() -> dict[str, Any]:
    return at(15, 53)


def test_the_table_is_answered(usual: dict[str, Any]) -> None:
    assert {k: v for k, v in usual.items() if "Error: " in str(v)[:30]} == {}


@pytest.mark.parametrize(("dps", "bits"), [(3, 20), (50, 200)])
def test_answers_do_not_depend_on_global_precision(
    usual: dict[str, Any], dps: int, bits: int
) -> None:
    found = at(dps, bits)
    assert [name for name in CALLS if found[name] != usual[name]] == []


if __name__ == "__main__":
    print(json.dumps(answers(int(sys.argv[1]), int(sys.argv[2]))))
