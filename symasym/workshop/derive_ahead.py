"""Derivations checked beside other work, in a process of their own.

What the process leaves is the cache of `symasym derive` and nothing else, so
that nothing rests on it: a derivation it did not get to, or that fails, is run
where its outcome is wanted, with its message.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

_PROGRAM = (
    "import sys; from symasym.workshop.derive_ahead import work; work(sys.argv[1], sys.argv[2:])"
)


def work(cache: str, labels: list[str]) -> None:
    """Fill the cache, a line on standard output for each derivation."""
    from derivations.runner import run

    run(labels, Path(cache), lambda: print(flush=True))


@contextmanager
def ahead(cache: Path, labels: list[str]) -> Iterator[Callable[[Callable[[], object]], int]]:
    """Begin with `labels`; what it gives waits for the end, calls its argument after each of
    them, and tells how many there were. Leaving ends the process.
    """
    process = subprocess.Popen(
        [sys.executable, "-c", _PROGRAM, str(cache), *labels],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path or os.getcwd() for path in sys.path)},
        # Ctrl-C is for this process, which ends the other one.
        start_new_session=True,
    )
    assert process.stdout is not None
    lines = process.stdout

    def wait(step: Callable[[], object]) -> int:
        """The number of derivations, when the process has ended."""
        count = 0
        for _ in lines:
            step()
            count += 1
        return count

    try:
        yield wait
    finally:
        process.kill()
        process.wait()
        lines.close()
