"""The command ``symasym show``."""

from __future__ import annotations

import argparse
import re
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError
from symasym.commands.settings import Commands, command, settings, takes_settings
from symasym.drift.ready_made.named import DRIFTS, named_drift

if TYPE_CHECKING:
    from symasym.derivation.derivation import Step
    from symasym.formula import Formula

_OF_EXPANSION = ("drift", "expr", "set", "noise", "order", "start", "case")


def add_parser(commands: Commands) -> None:
    """Add the parser of ``show``."""
    parser = command(
        commands, "show", "print a formula", _run, "symasym show fr1 --latex --steps",
        "symasym show expansion:T --drift friction --order 2",
    )  # fmt: skip
    add = parser.add_argument
    add("label", nargs="?", metavar="LABEL", help="such as eq:Ttilde, fr1, folds, expansion:C")
    add("--all", action="store_true", help="every formula; a document with --latex")
    add("--latex", action="store_true", help="as LaTeX")
    add("--steps", action="store_true", help="with the steps of its derivation")
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--drift", choices=DRIFTS, help="the drift of an expansion")
    what.add_argument("--expr", metavar="A", help='or this A(u), e.g. "1/2 - u + b*u**3"')
    takes_settings(parser, "set a parameter of the drift")
    add("--noise", metavar="NAME", help="weak, strong or uniform (weak)")
    add("--order", type=int, metavar="N", help="of the expansion (2; uniform 0)")
    add("--start", metavar="X", help="starting point (0)")
    add("--case", metavar="WORDS", help='such as "start well barrier"')


def _run(arguments: argparse.Namespace) -> None:
    """``symasym show``."""
    label, latex = arguments.label, arguments.latex
    expansion = label is not None and label.startswith("expansion:")
    others = ("all", "steps") if expansion else _OF_EXPANSION
    if odd := [x for x in others if getattr(arguments, x) not in (None, False, [])]:
        raise InputError(f"--{odd[0]} does not go with {label or '--all'}; leave it out.")
    if (label is None) != arguments.all:
        raise InputError("give a label, or --all.")
    from derivations.labels import DEFINITIONS
    from symasym.formula import formula, labels

    if expansion:
        _show_expansion(arguments)
    elif label in DEFINITIONS:
        shown, text = DEFINITIONS[label]
        print(shown if latex else f"{shown}\n\n{label} defines {text}.")
    elif arguments.all and latex:
        from derivations.pages import document

        print(document(), end="")
    else:
        for each in labels() if arguments.all else [label]:
            _show(formula(each), latex, arguments.steps)


def _show(shown: Formula, latex: bool, steps: bool) -> None:
    """Print a formula, and what belongs to it unless only LaTeX is wanted."""
    if latex:
        print(shown.latex())
    else:
        print(f"{shown.label}: {plain(shown.title)}\n")
        print(*(f"{pretty(step)}\n" for step in shown.concluded), sep="\n")
        print(f"Error: {plain(shown.error)}.")
        for line in (f"Here {shown.note}.",) * bool(shown.note) + shown.assumptions:
            print(plain(line))
    for number, step in enumerate(shown.steps if steps else (), 1):
        print(f"{number}. {step.name}{': ' * bool(step.why)}{plain(step.why)}\n   {step.latex()}")


def _show_expansion(arguments: argparse.Namespace) -> None:
    """Print the expansion of a quantity, as text or in LaTeX."""
    import symasym as sa

    values = settings(arguments.set)
    drift = sa.Drift.general()
    if (arguments.drift, arguments.expr) != (None, None):
        drift = named_drift(arguments.drift, arguments.expr, values)
    elif values:
        raise InputError("--set sets a drift's parameter; give --drift or --expr.")
    asked = {n: getattr(arguments, n) for n in ("noise", "order", "start", "case")}
    given = {n: x for n, x in asked.items() if x is not None}
    name = arguments.label.removeprefix("expansion:").replace("1-", "1 - ")
    shown = sa.expand(drift, name, **given)
    print(shown.latex() if arguments.latex else shown)


def pretty(step: Step) -> str:
    """A step drawn with characters, as wide as it needs."""
    import sympy

    from symasym.derivation.tex import tex

    def drawn(e: Any) -> str:
        names = {s: sympy.Symbol(plain(tex(s))) for s in e.free_symbols}
        return str(sympy.pretty(e.xreplace(names), num_columns=10_000))

    if isinstance(step.left, str):
        left = step.left.removesuffix("=").strip()
        return f"{plain(left)}{'' if left.endswith('sim') else ' ='}\n\n{drawn(step.right)}"
    relation = {"=": sympy.Eq, "<=": sympy.Le, ">=": sympy.Ge, "<": sympy.Lt, ">": sympy.Gt}
    return drawn(relation[step.relation](step.left, step.right, evaluate=False))


def plain(text: str) -> str:
    """A sentence, or a name, with its TeX as characters."""
    for sign, character in ((r"\le", "<="), (r"\ge", ">="), (r"\sim", "~"), (r"\to", "->")):
        text = re.sub(rf"\{sign}\b", character, text)
    return re.sub(r"\\(?:mathrm|tilde|hat|left|right|,|;)?|[{}$]", "", text)
