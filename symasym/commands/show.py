"""The command ``symasym show``."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from symasym.base.errors import InputError
from symasym.commands.settings import Commands, document, settings
from symasym.drift.ready_made.named import DRIFTS

if TYPE_CHECKING:
    import sympy

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
    from symasym.formula import formula
    from symasym.records import definition

    given = {name for name in _OF_EXPANSION if getattr(arguments, name) is not None}
    if arguments.label is not None and arguments.label.startswith("expansion:"):
        _show_expansion(arguments, given)
        return
    if given:
        raise InputError(
            f"--{min(given)} does not go with {arguments.label or '--all'}; give it with a label "
            "such as expansion:T."
        )
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
            print(f"  {line}")
    if arguments.steps:
        for number, step in enumerate(shown.trace, 1):
            print(f"{number}. {step['name']} ({step['rule']}; {step['kind']})")
            if step["reason"]:
                print(f"   {step['reason']}")
            print(f"   {step['latex']}")


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
    shown = expand(drift, arguments.label.removeprefix("expansion:"), **named)
    if arguments.latex:
        print(shown.latex())
        return
    quantity = quantity_of(shown.quantity)
    numbers = " ".join(
        ["symasym value", quantity.verb.replace("_", "-"), *["--complement"] * quantity.complement]
        + ["--method", _METHODS[shown.noise], "--json"]
    )
    print(str(shown).replace("evaluate(…, full=True)", numbers))


def _show_all(arguments: argparse.Namespace) -> None:
    """Print every formula, or the document of all with ``--latex``."""
    from symasym.formula import formula, labels
    from symasym.records import definitions

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
    for label, defined in definitions().items():
        print(f"{label}: {defined['reason']}\n\n{defined['text']}\n")


def pretty(shown: Formula) -> str:
    """A formula drawn with characters, ``left = right``, as wide as it needs."""
    import sympy

    def drawn(expression: Any) -> str:
        named = expression.xreplace(
            {s: sympy.Symbol(_name(s, shown.names)) for s in expression.free_symbols}
            | {h: sympy.Symbol(f"[{h.args[0]} > 0]") for h in expression.atoms(sympy.Heaviside)}
        )
        return str(sympy.pretty(named, use_unicode=_has_unicode(), num_columns=10_000))

    left, right = shown.left, shown.expression
    if shown.cases:
        pieces = [
            f"{drawn(sympy.Eq(left, piece, evaluate=False))}\n\nwhere {_plain(when)}"
            for piece, when in zip(right, shown.cases, strict=True)
        ]
    else:
        sides = zip(left, right, strict=True) if isinstance(left, sympy.Tuple) else [(left, right)]
        pieces = [drawn(sympy.Eq(*side, evaluate=False)) for side in sides]
    if shown.remainder is not None:
        pieces.append(f"up to the order ({shown.limit}) of\n\n{drawn(shown.remainder)}")
    return "\n\n".join(pieces)


#: LaTeX of names and conditions -> characters.
_CHARACTERS = ((r"\le", "<="), (r"\ge", ">="), (r"\kappa", "kappa"), (r"\ ", " "))


def _plain(latex: str) -> str:
    """A name or a condition in plain characters: ``A'(u2)``, ``u <= -1``."""
    for sign, character in _CHARACTERS:
        latex = latex.replace(sign, character)
    latex = re.sub(r"\\(?:text|mathrm)|[{}]", "", latex)
    return re.sub(r"(?<=\w)_(?=\d)", "", latex)


def _name(symbol: sympy.Symbol, names: Mapping[str, str]) -> str:
    """The name to draw a symbol with: as LaTeX has it, if that is readable as characters."""
    plain = _plain(names.get(symbol.name, symbol.name))
    if re.fullmatch(r"\\[a-zA-Z]+", plain):
        return plain[1:].removeprefix("var")  # A Greek letter, which SymPy draws by its name.
    return str(symbol.name) if "\\" in plain else plain


def _has_unicode() -> bool:
    """True where standard output can show the signs that a formula is drawn with."""
    try:
        "⎛⎝∫λ√".encode(sys.stdout.encoding or "ascii")
    except UnicodeEncodeError:
        return False
    return True
