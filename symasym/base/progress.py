"""Progress of long commands on the standard error stream."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager


@contextmanager
def stage(
    name: str, total: int, *, done: int = 0, every: float | None = None
) -> Iterator[Callable[[], object]]:
    """Announce a stage of `total` steps; call what it gives after every step.

    A bar with rate and time left on a terminal, one line a stage elsewhere.

    Parameters
    ----------
    name : str
    total : int
    done : int
        Steps that were made before, and do not count for the rate.
    every : float, optional
        Without a bar, a line with rate and time left after so many seconds.

    Examples
    --------
    >>> with stage("reference", 2) as step:
    ...     for _ in range(2):
    ...         _ = step()
    """
    if sys.stderr.isatty():
        from tqdm import tqdm

        with tqdm(total=total, initial=done, desc=name, file=sys.stderr, dynamic_ncols=True) as bar:
            yield bar.update
        return
    before = f", {done} of them made before" if done else ""
    print(f"{name}: {total} steps{before}", file=sys.stderr, flush=True)
    yield (lambda: None) if every is None else _lines(name, total, done, every)


def _lines(name: str, total: int, done: int, every: float) -> Callable[[], object]:
    """Lines on the standard error stream, at least `every` seconds apart."""
    begun = printed = time.monotonic()
    made = 0

    def step() -> None:
        """Count a step that was made, and print a line if it is time."""
        nonlocal made, printed
        made += 1
        now = time.monotonic()
        if now - printed < every:
            return
        printed, rate = now, made / (now - begun)
        left = round((total - done - made) / rate)
        print(
            f"{name}: {done + made} of {total}, {rate:.3g}/s, "
            f"{left // 3600}:{left // 60 % 60:02d}:{left % 60:02d} left",
            file=sys.stderr,
            flush=True,
        )

    return step
