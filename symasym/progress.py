"""Progress of long commands on the standard error stream."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stage(name: str, total: int) -> Iterator[Callable[[], object]]:
    """Announce a stage of `total` steps; call what it gives after every step.

    A bar on a terminal where tqdm is installed, one line a stage otherwise.

    Examples
    --------
    >>> with stage("reference", 2) as step:
    ...     for _ in range(2):
    ...         _ = step()
    """
    if sys.stderr.isatty():
        try:
            from tqdm import tqdm
        except ImportError:
            pass
        else:
            with tqdm(total=total, desc=name, file=sys.stderr, dynamic_ncols=True) as bar:
                yield bar.update
            return
    print(f"{name}: {total} steps", file=sys.stderr, flush=True)
    yield lambda: None
