"""The command ``symasym derive``."""

from __future__ import annotations

import argparse
from pathlib import Path

from symasym.commands.settings import Commands, command, takes_place


def add_parser(commands: Commands) -> None:
    """Add the parser of ``derive``."""
    about = "check the derivation of a label and of all it rests on (default: every one)"
    examples = "symasym derive", "symasym derive eq:Ttilde"
    parser = command(commands, "derive", about, _run, *examples)
    parser.add_argument("labels", nargs="*", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    folder = "folder of pages and trace (%(default)s)"
    takes_place(parser, folder, default="build/derivations", metavar="DIR")


def _run(arguments: argparse.Namespace) -> None:
    """``symasym derive``."""
    from derivations.pages import derive, with_roots
    from symasym.base.progress import stage
    from symasym.formula import formula, labels

    for label in arguments.labels:
        formula(label)  # which refuses what is no label
    chosen = with_roots(arguments.labels or labels())
    with stage("derivations", len(chosen)) as step:
        derive(chosen, Path(arguments.out), step)
    for label in arguments.labels or chosen:
        shown = formula(label)
        print(f"{label}: {shown.title}; {len(shown.steps)} steps hold; error: {shown.error}")
        for s in shown.steps if arguments.labels else ():
            print(f"  {s.name} (checked {s.check_kind}): {s.left} {s.relation} {s.right}")
    print(f"{len(chosen)} derivations hold; pages in {arguments.out}")
