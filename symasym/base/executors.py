"""Executors of batches of work: in this thread, in processes of this machine, or on a cluster."""

from __future__ import annotations

import logging
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future, ProcessPoolExecutor
from contextlib import contextmanager
from typing import Any

from symasym.base.errors import InputError, OutputError
from symasym.base.inputs import count

__all__ = ["Here", "cluster", "local", "processors", "result_of"]

#: Seconds to wait for a scheduler to answer, and for workers once none is left.
_PATIENCE, _GIVE_UP = 10, 300
_MOST_WORKERS = 1_000


class Here(Executor):
    """Does the work in this thread, when it is submitted."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The call's result, in a future that is done."""
        done: Future[Any] = Future()
        done.set_result(fn(*args, **kwargs))
        return done


class _Cluster(Executor):
    """The workers of a cluster, whose state can be asked for.

    Parameters
    ----------
    client : distributed.Client
    address : str
    """

    def __init__(self, client: Any, address: str) -> None:
        self._client, self._executor, self._address = client, client.get_executor(), address

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """The call's result, in a future."""
        future: Future[Any] = self._executor.submit(fn, *args, **kwargs)
        return future

    def trouble(self) -> str | None:
        """Why nothing can be done there at the moment; None where work goes on."""
        answers: list[Any] = []
        # A scheduler that hangs must not take this thread with it.
        asking = threading.Thread(
            target=lambda: answers.append(self._client.scheduler_info()), daemon=True
        )
        asking.start()
        asking.join(_PATIENCE)
        if not answers:
            return f"the scheduler at {self._address} does not answer"
        return None if answers[0]["workers"] else f"the cluster at {self._address} has no workers"


def result_of(future: Future[Any], executor: Executor) -> Any:
    """The result of a future once it is done, however long work goes on.

    Raises
    ------
    OutputError
        If a cluster has been without workers, or its scheduler silent, for five minutes.
    """
    if not isinstance(executor, _Cluster):
        return future.result()
    since: float | None = None
    while True:
        try:
            return future.result(timeout=_PATIENCE)
        except TimeoutError:
            if future.done():  # the work's own
                raise
            trouble = executor.trouble()
        if trouble is None:
            since = None
        elif since is None:
            since = time.monotonic()
            print(f"{trouble}; waiting for {_GIVE_UP} seconds.", file=sys.stderr, flush=True)
        elif time.monotonic() - since > _GIVE_UP:
            raise OutputError(
                f"{trouble} since {_GIVE_UP} seconds; start workers with dask worker, then run the "
                "same command again, which keeps what is written."
            )


def processors() -> int:
    """Processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def local(workers: int) -> Iterator[Executor]:
    """Processes of this machine; this one alone for a single worker.

    An error or an interrupt ends them at once, and so does the end of this process, however it
    comes.
    """
    workers = count("workers", workers, 1, _MOST_WORKERS)
    if workers == 1:
        yield Here()
        return
    from multiprocessing import get_context

    # Spawned, not forked: threads and open files of this process stay its own.
    pool = ProcessPoolExecutor(workers, mp_context=get_context("spawn"), initializer=_attend)
    try:
        yield pool
    except BaseException:
        for process in list((pool._processes or {}).values()):
            process.kill()
        pool.shutdown(wait=True, cancel_futures=True)
        raise
    pool.shutdown()


def _attend() -> None:
    """In a worker: Ctrl-C is for the process that started it, whose end is the worker's too."""
    from multiprocessing import parent_process

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = parent_process()
    assert parent is not None

    def watch() -> None:
        """End this process when its parent ends."""
        parent.join()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """The workers of the dask.distributed scheduler at `address`, such as ``tcp://host:8786``.

    What a worker that is lost was doing is done again by another one.

    Raises
    ------
    InputError
        If dask.distributed is missing, or nobody answers at that address.
    """
    try:
        import distributed
    except ImportError:
        raise InputError(
            "a scheduler needs dask.distributed, which is not installed; "
            "install symasym with its extra 'cluster', or use local workers."
        ) from None
    if not re.fullmatch(r"(\w+://)?[^\s/]+:\d+", address):
        raise InputError(
            f"the scheduler's address is {address!r}; give its host and port, such as "
            "tcp://127.0.0.1:8786."
        )
    # What it logs of a lost connection is said in one sentence below.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    connect: Any = distributed.Client
    try:
        client = connect(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise InputError(
            f"no scheduler answers at {address} ({reason.rstrip('.')}); start one with "
            "dask scheduler, and give the address that it prints."
        ) from None
    with client:
        try:
            yield _Cluster(client, address)
        except (RuntimeError, ImportError, CancelledError, distributed.KilledWorker) as error:
            reason = str(error).partition(".")[0] or type(error).__name__
            raise OutputError(
                f"the cluster at {address} did not do the work ({reason}); see that its scheduler "
                "and workers are up and have the same symasym, then run the same command again, "
                "which keeps what is written."
            ) from None
