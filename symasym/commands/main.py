"""The command ``symasym``."""

from __future__ import annotations

import argparse
import re
import signal
import sys
from collections.abc import Sequence
from typing import NoReturn

from symasym.base.errors import SymasymError
from symasym.commands import derive, emit, release, show, table, value, workshop
from symasym.commands.settings import Parser, document

_BAD_INPUT, _INTERRUPTED = 2, 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process when left out.

    Returns
    -------
    int
        0, or 1 for a derivation or check that fails, 2 after an error that is said in one
        sentence, 130 after an interrupt.
    """
    if argv is None:
        argv = sys.argv[1:]
        # A batch system that stops the job is owed the same tidiness as Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        arguments = _parser().parse_args(_join_negative(argv))
        return int(arguments.run(arguments) or 0)
    except SymasymError as error:
        # A stranger's file may hold what a terminal would obey.
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
        print(f"symasym: {text}", file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return _INTERRUPTED


def _join_negative(argv: Sequence[str]) -> list[str]:
    """Write ``--start -1/3`` as ``--start=-1/3``, which argparse would take for an option."""
    joined: list[str] = []
    for word in argv:
        takes_value = joined and re.fullmatch(r"--[a-z]+", joined[-1])
        if takes_value and re.match(r"-[\d.(a-z]", word) and not re.match(r"-[a-z]$", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _Version(argparse.Action):
    """Look the version up when it is asked for, and not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        print(f"symasym {metadata.version('symasym')}")
        parser.exit()


def _parser() -> Parser:
    """The parser of the whole command line."""
    parser = Parser(
        prog="symasym",
        description="Escape times and Laplace-type integrals of smoothed switches with noise.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    document(parser, ("symasym value --help", "symasym show eq:Ttilde"))
    for add_parser in (
        workshop.add_reproduce, value.add_parser, release.add_parser, derive.add_parser,
        show.add_parser, emit.add_parser, workshop.add_figure, table.add_parser,
        workshop.add_verify, workshop.add_report,
    ):  # fmt: skip
        add_parser(commands)
    return parser
