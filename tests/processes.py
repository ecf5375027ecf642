"""Processes that a test starts, interrupts and never leaves behind."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import symasym as sa

#: The command line, for what follows `symasym`.
PROGRAM = [
    sys.executable,
    "-c",
    "import sys; from symasym.commands.main import main; sys.exit(main())",
]


@contextmanager
def started(command: list[str], **options: Any) -> Iterator[subprocess.Popen[Any]]:
    """A process that imports the `symasym` of the tests and hears Ctrl-C.

    A shell's background jobs are born deaf to SIGINT, and so would be what they start. An error
    in the block ends the process; otherwise its end is waited for.
    """
    options["env"] = {**os.environ, "PYTHONPATH": str(Path(sa.__file__).parent.parent)}
    if os.name != "nt":
        options["preexec_fn"] = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(command, **options) as process:
        try:
            yield process
        except BaseException:
            process.kill()
            raise
