"""The command ``symasym table`` (see docs/command-line.md)."""

from __future__ import annotations

import argparse
import os
import threading
import time
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import nullcontext
from typing import Any

from symasym.commands.settings import Commands, command, takes_place


def add_parser(commands: Commands) -> None:
    """Add the parser of ``table``."""
    parser = command(
        commands, "table", "make a table of exact values from a spec", run,
        "symasym table well.toml -o well.jsonl",
        "symasym table well.toml -o well.jsonl --workers 4",
        description="Make a table of exact values, or what is missing of it.",
    )  # fmt: skip
    parser.add_argument("spec", metavar="SPEC", help="a TOML file: drift, grid, quantities, dps")
    takes_place(parser, "JSON lines; CSV and LaTeX go beside them", required=True)
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", type=int, default=1, metavar="N", help="processes (1)")
    where.add_argument("--cluster", metavar="ADDRESS", help="a dask.distributed scheduler's")
    parser.add_argument("--force", action="store_true", help="make everything again")


def run(arguments: argparse.Namespace) -> int:
    """``symasym table``: status 1 if some of its values do not exist or could not be had."""
    from symasym.base.inputs import count
    from symasym.tables import read_spec, write_table

    spec = read_spec(arguments.spec)
    where: Any = nullcontext()
    if arguments.cluster is not None:
        where = _cluster(arguments.cluster)
    elif count("--workers", arguments.workers, 1, 1_000) > 1:
        where = ProcessPoolExecutor(
            arguments.workers, initializer=_end_with, initargs=(os.getpid(),)
        )
    with where as executor:
        outcome = write_table(spec, arguments.out, executor=executor, force=arguments.force)
    made = f"{outcome.made} of them new" if outcome.made else "up to date"
    print(f"{outcome.path}, {outcome.csv}, {outcome.tex}: {outcome.values} values, {made}")
    if outcome.refused:
        print(f"{outcome.refused} values do not exist or could not be had; their lines say why.")
    return 1 if outcome.refused else 0


def _end_with(parent: int) -> None:
    """End this process when its parent is gone, killed for example."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1)
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def _cluster(address: str) -> Executor:
    """The workers of a cluster."""
    from symasym.base.errors import OutputError

    try:
        from distributed import Client

        executor: Executor = Client(address, timeout=10).get_executor()
    except (ImportError, OSError, ValueError) as error:
        raise OutputError(
            f"no cluster is reached at {address!r} ({error}); start a dask scheduler, with the "
            "extra symasym[cluster] installed."
        ) from None
    return executor
