"""Times that can be compared: peers in turn, the least of several runs, the machine beside them."""

from __future__ import annotations

import datetime
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from types import FrameType


def forget() -> None:
    """Drop every analysis of a drift that is kept, so that the next question is the first one.

    Constants, such as the nodes of a rule, stay: their caches have no bound.
    """
    rooms = ("symasym.asymptotics.", "symasym.drift.")
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

    packages = ("numpy", "mpmath", "gmpy2", "python-flint", "scipy")
    return (
        f"{datetime.date.today()}, {_cpu()}, {os.cpu_count()} cores. "
        f"Python {platform.python_version()}, {', '.join(map(_version, packages))}; "
        f"mpmath computes with {BACKEND}."
    )


def measured_on(before: str) -> str:
    """The machine, with the load before the measurement and now."""
    return f"{machine()} Load average {before} before, {load()} after."
