"""The command ``symasym show``."""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from symasym.base.errors import InputError
from symasym.commands.settings import Commands, document

if TYPE_CHECKING:
    from symasym.formula import Formula


def add_parser(subparsers: Commands) -> None:
    """Add the parser of ``show``."""
    parser = subparsers.add_parser("show", help="print a formula")
    parser.add_argument("label", nargs="?", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    parser.add_argument("--all", action="store_true", help="every formula; a document with --latex")
    parser.add_argument("--latex", action="store_true", help="as LaTeX")
    parser.add_argument("--steps", action="store_true", help="with the steps of its derivation")
    document(parser, ("symasym show eq:Ttilde", "symasym show fr1 --latex --steps"))
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """``symasym show``."""
    from symasym.formula import formula
    from symasym.records import definition

    if arguments.all or arguments.label is None:
        _show_all(arguments)
        return
    defined = definition(arguments.label)
    if defined is not None:
        print(defined["latex"] if arguments.latex else defined["text"])
        if not arguments.latex:
            print(f"\n{defined['reason']}")
        return
    shown = formula(arguments.label)
    print(shown.latex() if arguments.latex else pretty(shown))
    if not arguments.latex:
        print(f"\n{shown.title}. Error: {shown.error}.")
        if shown.note:
            print(f"  here {shown.note}")
        for line in shown.assumptions:
            print(f"  supposes: {line}")
    if arguments.steps:
        for number, step in enumerate(shown.trace, 1):
            print(f"{number}. {step['name']} ({step['rule']}; {step['kind']})")
            if step["reason"]:
                print(f"   {step['reason']}")
            print(f"   {step['latex']}")


def _show_all(arguments: argparse.Namespace) -> None:
    """Print every formula, or the document of all with ``--latex``."""
    from symasym.formula import formula, labels

    if not arguments.all:
        raise InputError("no formula is named; give a label, or --all.")
    if arguments.label is not None or arguments.steps:
        extra = "--steps" if arguments.label is None else arguments.label
        raise InputError(f"{extra} does not go with --all; leave one of them out.")
    if arguments.latex:
        from derivations.report import sheet

        print(sheet(), end="")
        return
    for label in labels():
        shown = formula(label)
        print(f"{label}: {shown.title}\n\n{pretty(shown)}\n")


def pretty(shown: Formula) -> str:
    """A formula drawn with characters, as wide as it needs."""
    import sympy

    drawn = {"use_unicode": _has_unicode(), "num_columns": 10_000}
    text = str(sympy.pretty(shown.expression, **drawn))
    if shown.remainder is not None:
        order = str(sympy.pretty(shown.remainder, **drawn))
        text += f"\n\nup to the order ({shown.limit}) of\n\n{order}"
    return text


def _has_unicode() -> bool:
    """True where standard output can show the signs that a formula is drawn with."""
    try:
        "⎛⎝∫λ√".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
