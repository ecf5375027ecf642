"""The command ``symasym derive``."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from symasym.base.errors import SymasymError
from symasym.commands.settings import Commands, document, takes_place


def add_parser(subparsers: Commands) -> None:
    """Add the parser of ``derive``."""
    parser = subparsers.add_parser(
        "derive", help="check the derivation of a label and of all it rests on (default: every one)"
    )
    parser.add_argument("labels", nargs="*", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    takes_place(
        parser, "folder of pages, trace and cache (%(default)s)", default="build/derivations",
        metavar="DIR",
    )  # fmt: skip
    parser.add_argument("--fresh", action="store_true", help="take nothing from the cache")
    parser.add_argument(
        "--errata",
        action="store_true",
        help="list where the paper's print differs, with counterexamples",
    )
    document(parser, ("symasym derive eq:Ttilde", "symasym derive --errata"))
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """``symasym derive``: status 1 if a check fails."""
    if arguments.errata:
        from derivations.errata.page import text

        print(text())
        return 0
    from derivations.report import derive

    try:
        records = derive(arguments.labels, Path(arguments.out), fresh=arguments.fresh)
    except SymasymError as error:
        # A DerivationError, without SymPy, which its module loads.
        if not isinstance(error, ArithmeticError):
            raise
        print(f"symasym: {error}", file=sys.stderr)
        return 1
    for label in arguments.labels or records:
        record = records[label]
        print(
            f"{label}: {record['title']}; {len(record['steps'])} steps pass; "
            f"error: {record['error']}"
        )
        if arguments.labels:
            for step in record["steps"]:
                print(f"  {step['name']} ({step['rule']}; {step['kind']}): {step['detail']}")
    reused = sum(record["reused"] for record in records.values())
    seconds = sum(r["seconds"] for r in records.values() if not r["reused"])
    print(
        f"{len(records)} derivations pass, {reused} of them unchanged since an earlier run; "
        f"{seconds:.1f} s of checks; pages in {arguments.out}"
    )
    return 0
