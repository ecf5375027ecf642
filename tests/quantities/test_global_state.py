"""No answer depends on the precision that mpmath, its intervals or flint are set to outside."""

from __future__ import annotations

import dataclasses
import json
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import flint
import mpmath
import numpy as np
import pytest

import symasym as sa
from symasym.base.balls import precision
from symasym.drift.scenes import Request
from symasym.methods import ask

FRICTION, SLIDING, ANALYTIC = sa.friction(3, 1, "-0.3"), sa.linear(1, -1), sa.tanh(1, "-1/2", 3)


def _scene(name: str, drift: sa.Drift, kappa: str, **more: Any) -> Callable[[], list[Any]]:
    """An array, a float, digits; the logarithm."""

    def asked() -> list[Any]:
        numbers = {"kappa": kappa, **({"r": 3, "start": 0} if name[-1] in "TC" else {})}
        array = {**numbers, "kappa": [float(kappa)]}
        found = [ask(drift, array, Request(name, full=True, **more))]
        for options in ({}, {"dps": 22}, {"log": True}):
            found.append(ask(drift, numbers, Request(name, full=True, **options, **more)))
        return [*found, *map(str, found)]

    return asked


CALLS: dict[str, Callable[[], Any]] = {
    "T": _scene("T", FRICTION, "0.3"),
    "T, analytic": _scene("T", ANALYTIC, "0.5"),
    "P": _scene("P", SLIDING, "0.4"),
    "density": lambda: sa.stationary_density(SLIDING, "0.4", "1/3", dps=20),
    "T laplace": _scene("T", FRICTION, "0.1", method="laplace", order=2),
    "C laplace, analytic": _scene("C", ANALYTIC, "0.1", method="laplace", order=1),
    "T uniform": _scene("T", FRICTION, "0.1", method="uniform", order=0),
    "C strong": _scene("C", ANALYTIC, "4", method="strong_noise", order=4),
    "C bound": _scene("C", FRICTION, "0.5", method="bound"),
    "T paper": _scene("T", FRICTION, "0.1", method="paper"),
    "T auto": lambda: sa.escape_time(FRICTION, "0.1", 10, method="auto", rtol=1e-6, full=True),
    "plan": lambda: str(sa.plan(FRICTION, 0.1, 10, rtol=1e-6)),
    "laplace": lambda: sa.laplace_integral("log(x) - x", 1, "x", 0, "oo", 3).evaluate(40, dps=18),
    "uniform": lambda: sa.uniform_integral(
        "-(x - 1/10)**2", "1/(1 + x**2)", "x", 0, "oo", 2
    ).evaluate("40", dps=20),
    "critical points": lambda: [FRICTION.critical_points(), ANALYTIC.critical_points()],
    "potential": lambda: [FRICTION.potential_at([0.25, 2.0]), ANALYTIC.potential_at(0.25)],
    "Stokes": lambda: sa.stokes_multiplier(sa.friction(3, 1, "-0.7"), "0.2", dps=20),
    "rescale": lambda: sa.rescale(eps="0.02", kappa="0.03", r="0.1"),
    "sensitivity": lambda: sa.sensitivity(FRICTION, "0.4", 3, dps=20),
}


def plain(x: Any) -> Any:
    """The answer as exact text."""
    if hasattr(x, "_mpf_"):
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


def test_threads_do_not_wait_for_each_other_forever() -> None:
    """One is inside a block of its own precision, the other computes a cached property."""
    asked, done = threading.Event(), threading.Event()

    def inside() -> None:
        with precision(60):
            asked.set()
            time.sleep(0.2)
            _ = sa.friction(3, 1, "-0.4").ends
        done.set()

    def outside() -> None:
        asked.wait()
        _ = sa.friction(3, 1, "-0.3").ends

    for work in (inside, outside):
        threading.Thread(target=work, daemon=True).start()
    assert done.wait(30)
