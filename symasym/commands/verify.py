"""The command ``symasym verify``."""

from __future__ import annotations

import argparse

from symasym.commands.settings import Commands, command


def add_parser(commands: Commands) -> None:
    """Add the parser of ``verify``."""
    parser = command(
        commands, "verify",
        "check every formula and evaluator against quadrature, balls and identities",
        run, "symasym verify", "symasym verify --level full --seed 2 -o verify.json",
    )  # fmt: skip
    parser.add_argument("--level", default="quick", metavar="NAME", help="quick or full (quick)")
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of random scenes (1)")
    parser.add_argument("--workers", type=int, metavar="N", help="processes (one a processor)")
    parser.add_argument("-o", "--out", metavar="FILE", help="write the record there, as JSON")


def run(arguments: argparse.Namespace) -> int:
    """Status 0 if all passes, 1 if something fails, 130 after an interrupt."""
    from symasym.base.files import write_json
    from symasym.workshop.verify import verify
    from symasym.workshop.verify.pages import record, table

    report = verify(arguments.level, arguments.seed, arguments.workers)
    if arguments.out:
        write_json(arguments.out, record(report))
    print(table(report))
    if report.interrupted:
        return 130
    return 0 if report.passed else 1
