"""The command ``symasym table`` (see docs/tables.md)."""

from __future__ import annotations

import argparse

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
    takes_place(parser, "JSON lines; a CSV file goes beside them", required=True)
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--workers", type=int, metavar="N", help="processes (as many as there are processors)"
    )
    where.add_argument("--scheduler", metavar="ADDRESS", help="of a dask.distributed cluster")
    parser.add_argument("--force", action="store_true", help="make everything again")


def run(arguments: argparse.Namespace) -> int:
    """``symasym table``: status 1 if some of its values do not exist or could not be had."""
    from symasym.base import executors
    from symasym.tables.run import write_table
    from symasym.tables.spec import read_spec

    spec = read_spec(arguments.spec)
    if arguments.scheduler is not None:
        where = executors.cluster(arguments.scheduler)
    elif arguments.workers is not None:
        where = executors.local(arguments.workers)
    else:
        # Starting processes takes longer than a few values do.
        few = spec.scenes * len(spec.quantities) * spec.dps < 1000
        where = executors.local(1 if few else executors.processors())
    with where as executor:
        outcome = write_table(spec, arguments.out, executor=executor, force=arguments.force)
    made = f"{outcome.made} of them new" if outcome.made else "up to date"
    print(f"{outcome.path} and {outcome.csv}: {outcome.values} values, {made}")
    if outcome.refused:
        print(f"{outcome.refused} values do not exist or could not be had; their lines say why.")
    return 1 if outcome.refused else 0
