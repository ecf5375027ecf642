"""Times that can be compared: peers in turn, the least of several runs, the machine beside them;
and the growth of the cost with the digits, with lam, with the number of points.
"""

from __future__ import annotations

import datetime
import math
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import symasym as sa

if TYPE_CHECKING:
    from types import FrameType


def forget() -> None:
    """Drop every analysis of a drift that is kept, so that the next question is the first one.

    Constants, such as the nodes of a rule, stay: their caches have no bound.
    """
    rooms = ("symasym.expansions.", "symasym.drift.")
    for name in [name for name in sys.modules if name.startswith(rooms)]:
        for value in vars(sys.modules[name]).values():
            bounded = getattr(value, "cache_parameters", lambda: {"maxsize": 2})()["maxsize"]
            if hasattr(value, "cache_clear") and bounded is not None:
                value.cache_clear()


def seconds(call: Callable[[], Any]) -> float:
    """Processor time of this process, all threads: other work on the machine counts less."""
    start = time.process_time()
    call()
    return time.process_time() - start


def wall(call: Callable[[], Any]) -> float:
    """Seconds of one call by the clock."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def interleaved(*calls: Callable[[], Any], runs: int) -> list[float]:
    """The least time of each call, the calls in turn so that all meet the same load."""
    rounds = [[seconds(call) for call in calls] for _ in range(runs)]
    return [min(times) for times in zip(*rounds, strict=True)]


class TooLong(Exception):
    """A peer took longer than it was given."""


def capped(call: Callable[[], Any], limit: float) -> tuple[float, Any]:
    """(seconds, result) of one call; (limit, None) if the clock passes the limit first.

    It is a first question: nothing is kept from earlier ones.
    An alarm in processor time would make the kernel count that time in ticks ever after.
    """

    def stop(*_: object) -> None:
        raise TooLong

    forget()
    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, limit)
    start, clock = time.process_time(), time.perf_counter()
    try:
        result = call()
        return time.process_time() - start, result
    except TooLong:
        return limit, None
    except SystemError:
        # What an extension makes of the alarm in a callback of its own.
        if time.perf_counter() - clock >= limit:
            return limit, None
        raise
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def python(code: str) -> str:
    """The output of `code` in a fresh interpreter."""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return done.stdout


_PEAK = """
import pathlib as _p, re as _r
def peak():  # MiB, of this program; ru_maxrss would include the process that started it
    return int(_r.search(r"VmHWM:\\s+(\\d+)", _p.Path("/proc/self/status").read_text())[1]) / 2**10
"""


def peaks(warm: str, code: str) -> tuple[float, float, float] | None:
    """(seconds, MiB added, MiB before) of `code` after `warm` in a process of its own.

    None where the system does not tell (Linux does).
    """
    if not Path("/proc/self/status").exists():
        return None
    timed = (
        f"{_PEAK}\nimport time\n{warm}\n_before, _start = peak(), time.perf_counter()\n{code}\n"
        "print(time.perf_counter() - _start, peak() - _before, _before)"
    )
    spent, used, before = map(float, python(timed).split())
    return spent, used, before


def calls(call: Callable[[], Any]) -> int:
    """The number of functions, Python's own and those of extensions, that a call of `call` calls.

    The same in every run of the same versions, once what is cached is cached.
    """
    count = 0

    def tick(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(tick)
    try:
        call()
    finally:
        sys.setprofile(before)
    return count


def _version(name: str) -> str:
    """A package with its version."""
    try:
        return f"{name} {version(name)}"
    except PackageNotFoundError:
        return f"no {name}"


def _cpu() -> str:
    """The name of the processor."""
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    model = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return model[0] if model else platform.processor() or platform.machine()


def load() -> str:
    """The load average of the last minute."""
    return f"{os.getloadavg()[0]:.1f}"


def machine() -> str:
    """Date, processor and versions, in a sentence or two."""
    from mpmath.libmp import BACKEND

    packages = ("numpy", "mpmath", "python-flint", "scipy")
    return (
        f"{datetime.date.today()}, {_cpu()}, {os.cpu_count()} cores. "
        f"Python {platform.python_version()}, {', '.join(map(_version, packages))}; "
        f"mpmath computes with {BACKEND}."
    )


def measured_on(before: str) -> str:
    """The machine, with the load before the measurement and now."""
    return f"{machine()} Load average {before} before, {load()} after."


# -- growth ----------------------------------------------------------------------------------------


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

    def ask(n: int) -> Callable[[], Any]:
        """A call of T with so many digits."""
        return lambda: sa.escape_time(_drift(), "0.3", 10, dps=n)

    for n in counts:
        yield _timed("digits", "exact", n, ask(n))


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


def in_tex(name: str) -> str:
    """The name of what was measured, its symbols as formulas."""
    return name.replace("z0", "$z_0$").replace("kappa", r"$\kappa$")
