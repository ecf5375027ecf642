"""Growth of the cost: with the digits, with lam, with the number of points."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

import symasym as sa
from symasym.workshop.report.timing import calls, forget, peaks, seconds

_RUNS = 5


@dataclass
class Grown:
    """One time; `along` is "digits", "lam" or "points", `at` the number on that axis."""

    along: str
    method: str
    at: float
    seconds: float
    calls: int | None
    mib: float | None = None


def _drift() -> sa.Drift:
    """The drift of the moderate scene."""
    return sa.friction(mu=3, alpha=1, z0="-0.3")


def _timed(along: str, method: str, at: float, call: Callable[[], Any]) -> Grown:
    """The least time of a few runs, each a first question, and the calls of one."""
    call()
    times: list[float] = []
    while len(times) < 1 or (len(times) < _RUNS and sum(times) < 2):
        forget()
        times.append(seconds(call))
    return Grown(along, method, at, min(times), calls(call) if min(times) < 1 else None)


def digits(quick: bool) -> Iterator[Grown]:
    """T of the moderate scene, to ever more digits."""
    counts = (15, 30, 100, 300) if quick else (15, 30, 100, 300, 1000, 3000)

    def ask(n: int, **options: Any) -> Callable[[], Any]:
        """A call of T with so many digits."""
        return lambda: sa.escape_time(_drift(), "0.3", 10, dps=n, **options)

    for n in counts:
        yield _timed("digits", "exact", n, ask(n))
        if n <= 300:
            yield _timed("digits", "exact, proved", n, ask(n, full=True))


def noise(quick: bool) -> Iterator[Grown]:
    """T from moderate noise to the stiffest."""
    kappas = ("1", "0.1", "1e-2", "1e-4", "1e-8") if quick else (
        "10", "1", "0.1", "1e-2", "1e-3", "1e-4", "1e-6", "1e-8",
    )  # fmt: skip
    ways: dict[str, dict[str, Any]] = {
        "exact, float64": {"log": True},
        "exact, 50 digits": {"dps": 50, "log": True},
        "laplace, order 3, 50 digits": {"dps": 50, "log": True, "method": "laplace", "order": 3},
    }
    for kappa in kappas:
        for name, options in ways.items():
            call = partial(_log_time, kappa, options)
            try:
                yield _timed("lam", name, 2 / float(kappa) ** 2, call)
            except sa.AccuracyError:
                continue


def _log_time(kappa: str, options: dict[str, Any]) -> Any:
    """log T of the moderate scene at other noise."""
    return sa.escape_time(_drift(), kappa, 10, **options)


_WARM = """
import numpy as np
import symasym as sa
sa.escape_time(sa.friction(mu=3, alpha=1, z0=[-1.0, -0.4]), 0.1, 10, log=True)
kappa = np.geomspace(0.03, 0.06, {n})
drift = sa.friction(mu=3, alpha=1, z0={z0})
{warm}
"""
_CALL = "sa.escape_time(drift, {kappa}, 10, log=True, method={method!r})"


def points(quick: bool) -> Iterator[Grown]:
    """T of ever longer arrays, each in a process of its own, with the peak of its memory."""
    for count in (10**2, 10**4) if quick else (10**2, 10**3, 10**4, 10**5, 10**6):
        for method, name in (("exact", "exact, arrays of z0"), ("laplace", "laplace, of kappa")):
            weak = method == "laplace"
            z0 = repr("-0.3") if weak else f"np.linspace(-2.0, -1e-6, {count})"
            call = _CALL.format(kappa="kappa" if weak else "0.2", method=method)
            peak = peaks(_WARM.format(n=count, z0=z0, warm=call.replace("kappa,", "[0.05],")
                                       if weak else ""), call)  # fmt: skip
            if peak is None:
                return
            yield Grown("points", name, count, peak[0], None, peak[1])


def exponent(grown: list[Grown]) -> float:
    """Exponent of the time's growth between the last two points."""
    first, last = grown[-2:]
    return math.log(last.seconds / first.seconds) / math.log(last.at / first.at)
