"""The command ``symasym emit``."""

from __future__ import annotations

import argparse
import re

from symasym.base.errors import InputError
from symasym.commands.settings import Commands, command, settings, takes_place, takes_settings
from symasym.drift.ready_made.named import DRIFTS, named_drift


def add_parser(commands: Commands) -> None:
    """Add the parser of ``emit``."""
    parser = command(
        commands, "emit", "write a formula as source code", _run,
        "symasym emit eq:Ttilde --target c --drift friction --set mu=3 --set alpha=1 -o time.c",
        "symasym emit expansion:T --target c --drift friction --order 2 -o time.c",
        description="Write a formula as source code. Parameters that are set are put in.",
    )  # fmt: skip
    parser.add_argument("label", metavar="LABEL", help="such as folds, eq:V, expansion:T")
    # The error names the targets: asking here would load SymPy.
    targets = "numpy, mpmath, c, javascript or latex"
    parser.add_argument("--target", required=True, metavar="T", help=targets)
    takes_place(parser, "where to (standard output)")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--drift", choices=DRIFTS, help="put this drift into the formula")
    what.add_argument("--expr", metavar="A", help='or this A(u), e.g. "1/2 - u + u**3"')
    parser.add_argument("--order", type=int, metavar="N", help="of an expansion, 0 to 8")
    takes_settings(parser, "put a parameter in")


def _run(arguments: argparse.Namespace) -> None:
    """``symasym emit``."""
    import symasym as sa

    values, drift = settings(arguments.set), None
    if arguments.drift or arguments.expr:
        # What shapes a drift is needed to make it; `emit` binds the rest.
        shapes = r"c\d+" if arguments.drift == "polynomial" else r"waves|n"
        named = [name for name in values if arguments.drift and re.fullmatch(shapes, name)]
        drift = named_drift(arguments.drift, arguments.expr, {n: values.pop(n) for n in named})
    quantity = arguments.label.removeprefix("expansion:")
    if quantity != arguments.label:
        drift = (drift or sa.Drift.general()).bind(**values)
        shown = sa.expand(drift, quantity.replace("1-", "1 - "), order=arguments.order)
        source = shown.emit(arguments.target)
    elif arguments.order is not None:
        raise InputError(f"--order is of an expansion such as expansion:T, not {arguments.label}.")
    else:
        source = sa.emit(arguments.label, arguments.target, values, drift=drift)
    if arguments.out is None:
        print(source, end="")
    else:
        print(source.write(arguments.out))
