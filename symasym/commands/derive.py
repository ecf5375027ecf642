"""The commands ``symasym derive`` and ``symasym show``.

For the command line of the project: call `add_parsers` with the subparsers
object, and `run` with the parsed arguments where ``args.run`` is set to it.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path
from typing import Any

DEFAULT = Path("build/derivations")


def add_parsers(subparsers: Any) -> None:
    """Add the parsers of ``derive`` and ``show``; each sets ``run`` to its function.

    Parameters
    ----------
    subparsers : argparse subparsers action
        What ``ArgumentParser.add_subparsers`` returned.
    """
    derive = subparsers.add_parser(
        "derive", help="check the derivation of a label and of all it rests on (default: every one)"
    )
    derive.add_argument("labels", nargs="*", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    derive.add_argument(
        "--out",
        type=Path,
        default=DEFAULT,
        help="folder of pages, trace and cache (default: %(default)s)",
    )
    derive.add_argument("--fresh", action="store_true", help="take nothing from the cache")
    derive.add_argument(
        "--errata",
        action="store_true",
        help="list where the paper's print differs, with counterexamples",
    )
    derive.set_defaults(run=run_derive)
    show = subparsers.add_parser("show", help="print a formula")
    show.add_argument("label", nargs="?", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    show.add_argument("--all", action="store_true", help="every formula; a document with --latex")
    show.add_argument("--latex", action="store_true", help="as LaTeX")
    show.add_argument("--steps", action="store_true", help="with the steps of its derivation")
    show.set_defaults(run=run_show)


def run(args: argparse.Namespace) -> int:
    """Run whichever of the two commands `args` were parsed for; returns the exit status."""
    return int(args.run(args))


def run_derive(args: argparse.Namespace) -> int:
    """``symasym derive``: status 1 if a check fails, 2 for an unknown label or a full disk."""
    from symasym.base.errors import OutputError, SymasymError

    if args.errata:
        from derivations.errata_page import text

        print(text())
        return 0
    try:
        records = derive(args.labels, args.out, fresh=args.fresh)
    except (UnknownLabel, OutputError) as error:
        print(f"symasym: {error}", file=sys.stderr)
        return 2
    except SymasymError as error:
        print(f"symasym: {error}", file=sys.stderr)
        return 1
    for label in args.labels or records:
        record = records[label]
        print(
            f"{label}: {record['title']}; {len(record['steps'])} steps pass; "
            f"error: {record['error']}"
        )
        if args.labels:
            for step in record["steps"]:
                print(f"  {step['name']} ({step['rule']}; {step['kind']}): {step['detail']}")
    reused = sum(record["reused"] for record in records.values())
    seconds = sum(r["seconds"] for r in records.values() if not r["reused"])
    print(
        f"{len(records)} derivations pass, {reused} of them unchanged since an earlier run; "
        f"{seconds:.1f} s of checks; pages in {args.out}"
    )
    return 0


class UnknownLabel(ValueError):
    """A label that nothing derives."""


def derive(
    labels: list[str] | None = None,
    out: Path = DEFAULT,
    *,
    fresh: bool = False,
    step: Callable[[], object] | None = None,
) -> dict[str, dict[str, Any]]:
    """Check derivations, write their pages and trace.

    Parameters
    ----------
    labels : list of str, optional
        Which; all if left out or empty. What they rest on is checked as well.
    out : path
        Folder of the Markdown and LaTeX pages, ``trace.json`` and the cache.
    fresh : bool
        Take nothing from the cache.
    step : callable, optional
        Called after every derivation; left out, the progress goes to stderr.

    Returns
    -------
    dict
        Label -> record, as `derivations.runner.run` gives it.
    """
    from derivations.labels import REASONS
    from derivations.registry import closure, entries
    from derivations.report import write
    from derivations.runner import known
    from derivations.runner import run as run_labels
    from symasym.base.progress import stage

    chosen = labels or list(entries())
    for label in chosen:
        if label in REASONS:
            raise UnknownLabel(f"{label} is not derived. {REASONS[label]}")
        if label not in entries():
            near = [known for known in entries() if label.split(":")[-1] in known]
            hint = f"perhaps {min(near, key=len)}" if near else "see symasym.formula.labels()"
            raise UnknownLabel(f"{label} is no label that is derived; {hint}.")
    with nullcontext(step) if step else stage("derivations", len(closure(chosen))) as report:
        records = run_labels(chosen, out / "cache", report, fresh=fresh)
    # A run of a few labels must not shrink the index and the trace of an earlier full one.
    write({**known(out / "cache"), **records}, out)
    return records


def run_show(args: argparse.Namespace) -> int:
    """``symasym show``: status 2 for an unknown label."""
    from symasym.base.errors import InputError
    from symasym.formula import formula

    try:
        if args.all or args.label is None:
            _show_all(args)
            return 0
        found = formula(args.label)
    except InputError as error:
        print(f"symasym: {error}", file=sys.stderr)
        return 2
    print(found.latex() if args.latex else pretty(found))
    if args.latex and not args.steps:
        return 0
    if not args.latex:
        print(f"\n{found.title}. Error: {found.error}.")
        if found.note:
            print(f"  here {found.note}")
        for line in found.assumptions:
            print(f"  supposes: {line}")
    if args.steps:
        for number, step in enumerate(found.trace, 1):
            print(f"{number}. {step['name']} ({step['rule']}; {step['kind']})")
            if step["reason"]:
                print(f"   {step['reason']}")
            print(f"   {step['latex']}")
    return 0


def _show_all(args: argparse.Namespace) -> None:
    from symasym.base.errors import InputError
    from symasym.formula import formula, labels

    if not args.all:
        raise InputError("no formula is named; give a label, or --all.")
    if args.label is not None or args.steps:
        extra = "--steps" if args.label is None else args.label
        raise InputError(f"{extra} does not go with --all; leave one of them out.")
    if args.latex:
        from derivations.sheet import sheet

        print(sheet(), end="")
        return
    for label in labels():
        found = formula(label)
        print(f"{label}: {found.title}\n\n{pretty(found)}\n")


def pretty(found: Any) -> str:
    """A formula drawn with characters, as wide as it needs."""
    import sympy

    text = str(sympy.pretty(found.expression, use_unicode=True, num_columns=10_000))
    if found.remainder is not None:
        order = str(sympy.pretty(found.remainder, use_unicode=True, num_columns=10_000))
        text += f"\n\nup to the order ({found.limit}) of\n\n{order}"
    return text
