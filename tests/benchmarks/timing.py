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
from typing import Any


def seconds(call: Callable[[], Any]) -> float:
    """Processor time of this process, all threads: other work on the machine counts less."""
    start = time.process_time()
    call()
    return time.process_time() - start


def wall(call: Callable[[], Any]) -> float:
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

    An alarm in processor time would make the kernel count that time in ticks ever after.
    """

    def stop(*_: Any) -> None:
        raise TooLong

    before = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, limit)
    start = time.process_time()
    try:
        result = call()
        return time.process_time() - start, result
    except TooLong:
        return limit, None
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def python(code: str) -> str:
    """What a fresh interpreter prints after `code`."""
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    return done.stdout


def _version(name: str) -> str:
    try:
        return f"{name} {version(name)}"
    except PackageNotFoundError:
        return f"no {name}"


def _cpu() -> str:
    information = Path("/proc/cpuinfo")
    lines = information.read_text().splitlines() if information.exists() else []
    model = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return model[0] if model else platform.processor() or platform.machine()


def load() -> str:
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
