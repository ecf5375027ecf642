"""The command ``symasym show``."""

from __future__ import annotations

import argparse
import re
import sys
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError
from symasym.commands.settings import Commands, document, settings
from symasym.drift.ready_made.named import DRIFTS

if TYPE_CHECKING:
    from symasym.derivation.derivation import Step
    from symasym.formula import Formula

_OF_EXPANSION = ("drift", "expr", "set", "noise", "order", "start", "case")
#: The methods that have an expansion's numbers.
_METHODS = {"weak": "laplace", "strong": "strong_noise", "uniform": "uniform"}


def add_parser(subparsers: Commands) -> None:
    """Add the parser of ``show``."""
    parser = subparsers.add_parser("show", help="print a formula")
    parser.add_argument("label", nargs="?", metavar="LABEL", help="such as eq:Ttilde, fr1, folds")
    parser.add_argument("--all", action="store_true", help="every formula; a document with --latex")
    parser.add_argument("--latex", action="store_true", help="as LaTeX")
    parser.add_argument("--steps", action="store_true", help="with the steps of its derivation")
    expansion = parser.add_argument_group(
        "expansion:QUANTITY", "the expansion of T, C, 1-C, P, 1-P or density for a drift"
    )
    what = expansion.add_mutually_exclusive_group()
    what.add_argument("--drift", choices=DRIFTS, help="a ready-made drift")
    what.add_argument("--expr", metavar="A", help='A(u), e.g. "1/2 - u + b*u**3"')
    expansion.add_argument("--set", action="append", metavar="NAME=X", help="set a parameter")
    expansion.add_argument("--noise", metavar="NAME", help="weak, strong or uniform (weak)")
    expansion.add_argument("--order", type=int, metavar="N", help="of the expansion (2; uniform 0)")
    expansion.add_argument("--start", metavar="X", help="starting point (0)")
    expansion.add_argument("--case", metavar="WORDS", help='such as "start well barrier"')
    document(
        parser,
        (
            "symasym show fr1 --latex --steps",
            "symasym show expansion:T --drift friction --order 2",
        ),
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """``symasym show``."""
    given = {name for name in _OF_EXPANSION if getattr(arguments, name) is not None}
    if arguments.label is not None and arguments.label.startswith("expansion:"):
        _show_expansion(arguments, given)
        return
    if given:
        raise InputError(
            f"--{min(given)} does not go with {arguments.label or '--all'}; give it with a label "
            "such as expansion:T."
        )
    if (arguments.label is None) != arguments.all:
        raise InputError("give a label, or --all.")
    from derivations.labels import DEFINITIONS
    from symasym.formula import formula, labels

    if arguments.label in DEFINITIONS:
        shown, text = DEFINITIONS[arguments.label]
        print(shown if arguments.latex else f"{shown}\n\n{arguments.label} defines {text}.")
    elif arguments.all and arguments.latex:
        from derivations.pages import document

        labels()
        print(document(), end="")
    else:
        for label in labels() if arguments.all else [arguments.label]:
            _show(formula(label), arguments.latex, arguments.steps)


def _show(shown: Formula, latex: bool, steps: bool) -> None:
    """Print a formula, and what belongs to it unless only LaTeX is wanted."""
    if latex:
        print(shown.latex())
    else:
        print(f"{shown.label}: {plain(shown.title)}\n")
        for step in shown.concluded:
            print(f"{pretty(step)}\n")
        print(f"Error: {plain(shown.error)}.")
        for line in (f"Here {shown.note}.",) * bool(shown.note) + shown.assumptions:
            print(plain(line))
    for number, step in enumerate(shown.steps if steps else (), 1):
        print(f"{number}. {step.name}{': ' * bool(step.why)}{plain(step.why)}")
        print(f"   {step.latex()}")


def _show_expansion(arguments: argparse.Namespace, given: set[str]) -> None:
    """Print the expansion of a quantity, as text or in LaTeX."""
    from symasym.drift.drift import Drift
    from symasym.drift.ready_made.named import named_drift
    from symasym.formulas import expand
    from symasym.scenes import quantity_of

    extra = next((name for name in ("all", "steps") if getattr(arguments, name)), None)
    if extra is not None:
        raise InputError(f"--{extra} does not go with {arguments.label}; leave it out.")
    drift = Drift.general()
    if given & {"drift", "expr"}:
        drift = named_drift(arguments.drift, arguments.expr, settings(arguments.set or ()))
    elif arguments.set:
        raise InputError("--set sets a drift's parameter; give --drift or --expr.")
    named = {n: getattr(arguments, n) for n in ("noise", "order", "start", "case") if n in given}
    quantity = arguments.label.removeprefix("expansion:").replace("1-", "1 - ")
    shown = expand(drift, quantity, **named)
    if arguments.latex:
        print(shown.latex())
        return
    of = quantity_of(shown.quantity)
    numbers = " ".join(
        ["symasym value", of.verb.replace("_", "-"), *["--complement"] * of.complement]
        + ["--method", _METHODS[shown.noise], "--json"]
    )
    print(str(shown).replace("evaluate(…, full=True)", numbers))


def pretty(step: Step) -> str:
    """A step drawn with characters, as wide as it needs."""
    import sympy

    def drawn(e: Any) -> str:
        names = {s: sympy.Symbol(plain(tex(s))) for s in e.free_symbols}
        return str(sympy.pretty(e.xreplace(names), use_unicode=_has_unicode(), num_columns=10_000))

    from symasym.derivation.tex import tex

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


def _has_unicode() -> bool:
    """True where standard output can show the signs that a formula is drawn with."""
    try:
        "⎛⎝∫λ√".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
