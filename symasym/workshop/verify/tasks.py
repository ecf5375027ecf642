"""The tasks of each level of verification, small enough for any process to take."""

from __future__ import annotations

import signal
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, NamedTuple

from symasym.workshop.problems import PROBLEMS, Problem
from symasym.workshop.verify import claims, exact_checks, formulas, identities, limits, orders
from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.references import Key, scene

#: Random scenes of each level.
SCENES = {"quick": 9, "full": 84}


#: Processor seconds after which a task is stopped; the longest take a quarter of it.
MOST_SECONDS = 120.0


class Task(NamedTuple):
    """A check and its scene or family; small, so that it travels between processes."""

    check: str
    key: Key


class Done(NamedTuple):
    """The findings of a task, the processor time it took, and whether it was stopped for that."""

    task: Task
    findings: list[Finding]
    seconds: float
    stopped: bool = False


_OF_SCENES: dict[str, Callable[[Problem, bool], Iterator[Finding]]] = {
    "quadrature": exact_checks.quadrature,
    "accuracy": exact_checks.accuracy,
    "honesty": claims.honesty,
    "arrays": claims.arrays,
    "sums": identities.sums,
    "symmetries": identities.symmetries,
    "equations": identities.equations,
}
_OF_FAMILIES: dict[str, tuple[Callable[[str, bool], Iterator[Finding]], tuple[str, ...]]] = {
    "orders": (orders.order, tuple(orders.BY_NAME)),
    "strong limit": (limits.strong, tuple(limits.DRIFTS)),
    "weak limit": (limits.weak, tuple(limits.DRIFTS)),
    "far limit": (limits.far, tuple(limits.DRIFTS)),
    "pieces": (formulas.pieces, formulas.EXACT),
    "leading": (formulas.leading, formulas.LEADING),
}


def tasks(level: str, seed: int) -> list[Task]:
    """Every task of a level, those that take long first."""
    full = level == "full"
    keys: list[Key] = [("random", str(seed), str(k)) for k in range(SCENES[level])]
    keys += [("table", p.name) for p in PROBLEMS if full or not p.tags & _LONG]
    asked = [
        Task(check, key)
        for check in _OF_SCENES
        for key in keys
        if _applies(check, scene(key), full)
    ]
    asked += [
        Task(check, (name,))
        for check, (_, names) in _OF_FAMILIES.items()
        for name in names
        if full or name not in _DEAR
    ]
    return sorted(asked, key=_rank)


_LONG = {"slow", "may refuse", "narrow"}
# Differences and exponents take digits without end there.
# Families that take seconds each, of what quick tests on others too.
_DEAR = {"well", "behind the barrier", "tanh sliding"}
_POLYNOMIAL = {"friction", "linear", "polynomial"}
_STIFF = {"stiff", "extreme", "narrow", "refused", "slow", "may refuse"}


def _applies(check: str, problem: Problem, full: bool) -> bool:
    """True if a check is made on a scene at this level."""
    tags = problem.tags
    if check == "quadrature":
        return "quadrature" in tags
    if check in ("equations", "symmetries"):
        return not tags & _STIFF and (full or "moderate" in tags)
    if not full and tags & {"extreme"}:
        return False
    dear = check in ("honesty", "arrays", "equations") and not tags & _POLYNOMIAL
    if not full and (dear or (check == "honesty" and tags & {"fold", "kink"})):
        return False
    if check in ("arrays", "honesty"):
        return not tags & (_STIFF if not full else {"refused", "may refuse", "slow"})
    return check != "sums" or not tags & {"refused", "may refuse", "slow"}


def _rank(task: Task) -> int:
    """The rank of a task by how long it takes."""
    order = ("orders", "leading", "honesty", "arrays", "quadrature", "accuracy", "equations")
    return order.index(task.check) if task.check in order else len(order)


class _Stopped(BaseException):
    """No Exception, so that no check takes it for a failure of what it checks."""


def _stop(*_: object) -> None:
    raise _Stopped


@contextmanager
def _at_most(seconds: float) -> Iterator[None]:
    """Stops what takes more processor time, where that can be timed: not on Windows."""
    main = threading.current_thread() is threading.main_thread()
    if not main or not hasattr(signal, "setitimer"):
        yield
        return
    before = signal.signal(signal.SIGPROF, _stop)
    # Again later: an exception in a destructor is lost.
    signal.setitimer(signal.ITIMER_PROF, seconds, 5)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def run_task(task: Task, full: bool) -> Done:
    """All findings of a task; whatever is raised is one of them."""
    began = time.process_time()
    findings: list[Finding] = []
    stopped = False
    try:
        if task.check in _OF_SCENES:
            run: Any = _OF_SCENES[task.check](scene(task.key), full)
        else:
            run = _OF_FAMILIES[task.check][0](task.key[0], full)
        with _at_most(MOST_SECONDS):
            findings.extend(run)
    except _Stopped:
        stopped = True
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} ({last.name}, line {last.lineno})"
        where = " ".join(task.key)
        findings.append(Finding(task.check, "", "runs", float("inf"), where, message))
    return Done(task, findings, time.process_time() - began, stopped)
