"""Verification over processes, which Ctrl-C stops at once and keeps what was done."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Generator
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass, field

from symasym.base import progress
from symasym.base.errors import InputError
from symasym.workshop.verify import references
from symasym.workshop.verify.findings import Finding
from symasym.workshop.verify.tasks import SCENES, Done, Task, run_task, tasks


@dataclass
class Verification:
    """The result of `verify`.

    Attributes
    ----------
    level : {"quick", "full"}
    seed : int
    done : list of Done
        One for each task that ended.
    tasks : int
        How many there were to do.
    seconds : float
    interrupted : bool
    """

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

    Parameters
    ----------
    level : {"quick", "full"}
    seed : int
        Of the random scenes.
    workers : int, optional
        Processes; as many as there are processors when left out, 0 for none but this one.
        Other processes import the calling script, which must guard its main part as
        `multiprocessing` asks.
    only : callable, optional
        Which tasks to do, all of them when left out.

    Returns
    -------
    Verification
        After an interrupt as well, with what was done until then.

    Raises
    ------
    InputError
        For a level that does not exist, or a seed or number of workers that is none.
    """
    if level not in SCENES:
        raise InputError(f"level is {level!r}; give one of {', '.join(map(repr, SCENES))}.")
    for name, value in (("seed", seed), ("workers", workers)):
        if value is not None and (isinstance(value, bool) or not isinstance(value, int)):
            raise InputError(f"{name} is {value!r}; give a whole number.")
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
    references.forget()
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
