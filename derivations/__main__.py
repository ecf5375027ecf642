"""``python -m derivations``: the same as ``symasym derive``."""

from __future__ import annotations

import argparse
import sys


def main(arguments: list[str] | None = None) -> int:
    """Run; the exit status is 1 if a check fails."""
    from symasym.commands.derive import add_parsers, run

    parser = argparse.ArgumentParser(prog="python -m derivations")
    add_parsers(parser.add_subparsers())
    given = sys.argv[1:] if arguments is None else arguments
    return run(parser.parse_args(["derive", *given]))


if __name__ == "__main__":
    sys.exit(main())
