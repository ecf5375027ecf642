"""Progress of long commands on the standard error stream."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stage(
    name: str, total: int, *, done: int = 0, every: float = 10.0
) -> Iterator[Callable[[], object]]:
    """Announce a stage of `total` steps, some `done` before; call what it gives after every step.

    A bar with rate and time left on a terminal; elsewhere a line, and the bar each
    so many seconds.

    Examples
    --------
    >>> with stage("reference", 2) as step:
    ...     for _ in range(2):
    ...         _ = step()
    """
    from tqdm import tqdm

    terminal = sys.stderr.isatty()
    if not terminal:
        before = f", {done} of them made before" if done else ""
        print(f"{name}: {total} steps{before}", file=sys.stderr, flush=True)
    wait = {} if terminal else {"mininterval": every, "delay": every}
    with tqdm(
        total=total, initial=done, desc=name, file=sys.stderr, dynamic_ncols=terminal, **wait
    ) as bar:
        yield bar.update
