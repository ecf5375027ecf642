"""Verification: its tasks at each level, run in processes, which Ctrl-C stops at once; its table
and its record.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
import time
import traceback
from collections.abc import Callable, Generator, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from symasym.base import progress
from symasym.base.errors import InputError
from symasym.base.files import versions
from symasym.base.inputs import choice, shown
from symasym.workshop.problems import PROBLEMS, Problem
from symasym.workshop.verify import claims, exact_checks, findings, orders
from symasym.workshop.verify.findings import Finding, Key, scene

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
    "stated error": claims.stated_error,
    "arrays": claims.arrays,
    "sums": exact_checks.sums,
    "symmetries": exact_checks.symmetries,
    "equations": exact_checks.equations,
}
_OF_FAMILIES: dict[str, tuple[Callable[[str, bool], Iterator[Finding]], tuple[str, ...]]] = {
    "orders": (orders.order, tuple(orders.BY_NAME)),
    "strong limit": (orders.strong, tuple(orders.DRIFTS)),
    "weak limit": (orders.weak, tuple(orders.DRIFTS)),
    "far limit": (orders.far, tuple(orders.DRIFTS)),
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
_DEAR = {"tanh sliding"}
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
    dear = check in ("stated error", "arrays", "equations") and not tags & _POLYNOMIAL
    if not full and (dear or (check == "stated error" and tags & {"fold", "kink"})):
        return False
    if check in ("arrays", "stated error"):
        return not tags & (_STIFF if not full else {"refused", "may refuse", "slow"})
    return check != "sums" or not tags & {"refused", "may refuse", "slow"}


def _rank(task: Task) -> int:
    """The rank of a task by how long it takes."""
    order = ("orders", "leading", "stated error", "arrays", "quadrature", "accuracy", "equations")
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


@dataclass
class Verification:
    """The result of `verify`: what was `done` of so many `tasks`."""

    level: str
    seed: int
    tasks: int
    done: list[Done] = field(default_factory=list)
    seconds: float = 0.0
    interrupted: bool = False

    @property
    def findings(self) -> list[Finding]:
        """Every finding, in an order that does not depend on the processes."""
        every = (f for done in self.done for f in done.findings)
        return sorted(every, key=lambda f: (f.formula, f.evaluator, f.check, f.where, f.detail))

    @property
    def failures(self) -> list[Finding]:
        """The findings that did not pass."""
        return [f for f in self.findings if not f.passed]

    @property
    def stopped(self) -> list[Done]:
        """Tasks that took too long and were not finished."""
        return sorted(done for done in self.done if done.stopped)

    @property
    def passed(self) -> bool:
        """True if all was done and nothing failed."""
        return not self.interrupted and not self.failures and not self.stopped


def verify(
    level: str = "quick",
    seed: int = 1,
    workers: int | None = None,
    only: Callable[[Task], bool] | None = None,
) -> Verification:
    """Every formula and evaluator against quadrature, balls and identities.

    The level is "quick" or "full", the seed that of the random scenes; `workers` are processes, as
    many as there are processors when left out, 0 for none but this one (others import the calling
    script, which must guard its main part as `multiprocessing` asks); `only` tells which tasks to
    do. After an interrupt it has what was done until then.
    """
    choice("level", level, SCENES)
    for name, value in (("seed", seed), ("workers", workers)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
            raise InputError(f"{name} is {shown(value)}; give a whole number.")
    if workers is not None and workers < 0:
        raise InputError(f"workers is {workers}; give a number of processes, or 0.")
    asked = [task for task in tasks(level, seed) if only is None or only(task)]
    verification = Verification(level, seed, len(asked))
    began = time.perf_counter()
    count = min(os.cpu_count() or 1, len(asked)) if workers is None else workers
    run = _in_processes(asked, level == "full", count) if count else _here(asked, level == "full")
    try:
        with progress.stage(f"verify {level}", len(asked), every=30.0) as step:
            for done in run:
                verification.done.append(done)
                step()
    except KeyboardInterrupt:
        verification.interrupted = True
    finally:
        run.close()
    verification.seconds = time.perf_counter() - began
    return verification


def _here(asked: list[Task], full: bool) -> Generator[Done, None, None]:
    """The tasks done one after the other in this process."""
    findings.forget()
    for task in asked:
        yield run_task(task, full)


def _in_processes(asked: list[Task], full: bool, count: int) -> Generator[Done, None, None]:
    """The tasks done in processes of their own, in the order in which they end."""
    # Processes that fork would share locks of threads that they do not have.
    context = multiprocessing.get_context("spawn")
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(count, context, initializer=_ignore_interrupts)
    ended = False
    try:
        waiting = [pool.submit(run_task, task, full) for task in asked]
        for future in as_completed(waiting):
            yield future.result()
        ended = True
    finally:
        if not ended:
            # A running task is not waited for.
            for process in set(multiprocessing.active_children()) - before:
                process.terminate()
        pool.shutdown(wait=ended, cancel_futures=True)


def _ignore_interrupts() -> None:
    """Ctrl-C is for the process that started this one, which ends it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


# -- the table and the record ----------------------------------------------------------------------


_LIBRARIES = ("numpy", "mpmath", "python-flint", "sympy")


@dataclass
class Row:
    """One formula, evaluator and check."""

    formula: str
    evaluator: str
    check: str
    cases: int = 0
    passed: int = 0
    refused: int = 0
    worst: float = 0.0
    where: str = ""

    def add(self, finding: Finding) -> None:
        """Count one more finding."""
        self.cases += 1
        self.refused += finding.refused
        self.passed += finding.passed and not finding.refused
        # A NaN is worse than any number.
        size = 0.0 if finding.size is None else finding.size
        size = float("inf") if size != size else size
        if not finding.refused and (size > self.worst or not self.where):
            self.worst, self.where = size, finding.where

    @property
    def failed(self) -> int:
        """The number of findings that failed."""
        return self.cases - self.passed - self.refused


def rows(verification: Verification) -> list[Row]:
    """One row for each formula, evaluator and check, in that order."""
    by_name: dict[tuple[str, str, str], Row] = {}
    for finding in verification.findings:
        key = finding.formula, finding.evaluator, finding.check
        by_name.setdefault(key, Row(*key)).add(finding)
    return [by_name[key] for key in sorted(by_name)]


def table(verification: Verification) -> str:
    """The rows as text, failures below, and a sentence."""
    lines: list[tuple[str, ...]] = [
        ("formula", "evaluator", "check", "cases", "passed", "refused", "worst", "where")
    ]
    for row in rows(verification):
        numbers = (row.cases, row.passed, row.refused)
        worst = "" if row.refused == row.cases else f"{row.worst:.2g}"
        mark = "" if not row.failed else "  FAILED"
        lines.append(
            (row.formula, row.evaluator, row.check, *map(str, numbers), worst, row.where + mark)
        )
    widths = [max(len(line[k]) for line in lines) for k in range(7)]
    text = [
        "  ".join([*(c.ljust(w) for c, w in zip(x, widths, strict=False)), x[7]]) for x in lines
    ]
    text += ["", *_failures(verification), _sentence(verification)]
    return "\n".join(line.rstrip() for line in text)


def _failures(verification: Verification) -> Iterator[str]:
    """A line for each of the first twenty failures, and for each task that was stopped."""
    shown = verification.failures[:20]
    for f in shown:
        yield f"FAILED {f.formula}, {f.evaluator}, {f.check}, at {f.where}: {f.detail}"
    if len(verification.failures) > len(shown):
        yield f"… and {len(verification.failures) - len(shown)} more."
    for done in verification.stopped:
        yield f"STOPPED {_named(done)}: not finished after {done.seconds:.0f} s."


def _named(done: Done) -> str:
    """The check and the scene of a task."""
    return f"{done.task.check} of {' '.join(done.task.key)}"


def _sentence(of: Verification) -> str:
    """The numbers of cases, tasks and seconds in a sentence."""
    cases = of.findings
    refused = sum(f.refused for f in cases)
    how = "interrupted after" if of.interrupted else "in"
    stopped = f", {len(of.stopped)} of them stopped," if of.stopped else ""
    return (
        f"{len(cases)} cases: {len(cases) - refused - len(of.failures)} passed, "
        f"{len(of.failures)} failed, {refused} refused; {len(of.done)} of {of.tasks} "
        f"tasks{stopped} {how} {of.seconds:.1f} s (level {of.level}, seed {of.seed}). "
        "Worst is what was found over what is allowed: 1 is the limit."
    )


def record(verification: Verification) -> dict[str, Any]:
    """The verification as data for JSON."""
    from symasym.formula import labels

    checked = {row.formula for row in rows(verification)}
    return {
        "level": verification.level,
        "seed": verification.seed,
        "interrupted": verification.interrupted,
        "passed": verification.passed,
        "seconds": round(verification.seconds, 3),
        "tasks": {"done": len(verification.done), "all": verification.tasks},
        "versions": versions(*_LIBRARIES),
        "rows": [_plain(vars(row)) for row in rows(verification)],
        "stopped": [_named(done) for done in verification.stopped],
        "failures": [_plain(f._asdict()) for f in verification.failures],
        "seconds_by_check": _times(verification),
        # Definitions, equations and identities of symbols: their check is their derivation.
        "formulas_without_numbers_here": [x for x in labels() if x not in checked],
    }


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    """JSON has no infinity."""
    return {
        name: str(x) if isinstance(x, float) and (x != x or abs(x) == float("inf")) else x
        for name, x in record.items()
    }


def _times(verification: Verification) -> dict[str, float]:
    """Seconds of each check."""
    times: dict[str, float] = {}
    for done in verification.done:
        times[done.task.check] = times.get(done.task.check, 0.0) + done.seconds
    return {name: round(seconds, 3) for name, seconds in sorted(times.items())}
