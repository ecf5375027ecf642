"""The command ``symasym``.

Each command is a function in `verbs`, which takes the namespace of argparse and returns an exit
status or None (for 0); its docstring is the help text. `COMMANDS` lists the arguments of each
command, `OPTIONS` describes the arguments of all commands.
"""

from __future__ import annotations

import argparse
import difflib
import inspect
import re
import signal
import sys
from collections.abc import Callable, Sequence
from importlib import metadata
from typing import Any, NoReturn

from symasym.base.errors import SymasymError
from symasym.commands import verbs
from symasym.drift.ready_made import DRIFTS, drift_signatures
from symasym.methods import METHODS


def parameter(text: str) -> tuple[str, str]:
    """The name and the value in an argument ``NAME=X``."""
    if text.count("=") != 1:
        raise argparse.ArgumentTypeError(f"{text!r} is not NAME=X")
    name, value = text.split("=")
    return name, value


def order(text: str) -> int | str:
    """The order of an expansion: an int or ``"optimal"``."""
    return text if text == "optimal" else int(text)


_X, _N = {"metavar": "X"}, {"metavar": "N", "type": int}
_NAME, _ON = {"metavar": "NAME"}, {"action": "store_true"}
_MODELS = "; ".join(f"{name}, with {taken}" for name, taken in drift_signatures().items())
#: The help text of each argument, and the keywords for argparse.
OPTIONS: dict[str, tuple[str, dict[str, Any]]] = {
    "quantity": ("one of %(choices)s", {"choices": verbs.QUANTITIES, "metavar": "QUANTITY"}),
    "label": ("such as eq:Ttilde, folds, expansion:C", {}),
    "labels": ("such as eq:Ttilde, fr1, folds; all if left out", {"nargs": "*"}),
    "name": ("such as phase or fric1; without it they are listed", {"nargs": "?"}),
    "spec": ("a TOML file: drift, grid, quantities, dps", {}),
    "--drift": (f"a ready-made drift: {_MODELS}", {"choices": DRIFTS, "metavar": "NAME"}),
    "--expr": ('or a formula of A(u), such as "1/2 - u + b*u**3"', {"metavar": "A"}),
    "--set": ("the value of a parameter; may be repeated",
              {"action": "append", "default": [], "type": parameter, "metavar": "NAME=X"}),
    "--no-layer": ("A(u) is the drift for all u, which is constant for |u| > 1 otherwise", _ON),
    "value --noise": ("sigma(u) of du = phi dt + kappa sigma(u) dW (1)", _X),
    "release --noise": ("factor of kappa, in u (1)", _X),
    "show --noise": ("of an expansion: weak, strong or uniform (weak)", _NAME),
    "--phi": ("phi(u, z, y), y = eps u, in place of the oscillator's", _X),
    "--velocity": ("velocity of z in the same variables, in place of y - 1", _X),
    "--kappa": ("noise amplitude", _X),
    "--r": ("escape radius", _X),
    "--eps": ("half-width of the switch", _X),
    "--start": ("starting point (0)", _X),
    "--y": ("position, of stationary-density", _X),
    "--z": ("the slow variable at the start", _X),
    "--case": ('of an expansion, such as "start well barrier"', {"metavar": "WORDS"}),
    "--ends": ("the interval in place of (-r, r); of occupation, reflecting ends",
               {"nargs": 2, **_X}),
    "--interval": ("the interval of occupation, in place of the layer", {"nargs": 2, **_X}),
    "--reflecting": ("the end that reflects: left or right", _NAME),
    "--moment": ("k from 1 to 20: the mean of the time to the power k", _N),
    "value --method": (f"{', '.join(METHODS)} (exact)", _NAME),
    "release --method": ("march or simulate (%(default)s)", _NAME),
    "value --order": ('of an expansion, or "optimal"', {"type": order, "metavar": "N"}),
    "--order": ("of an expansion", _N),
    "value --rtol": ("relative error allowed, with --method auto", _X),
    "release --rtol": ("relative error allowed, of --method march (%(default)s)", _X),
    "--complement": ("1 minus a probability", _ON),
    "--dps": ("significant digits; float64 if left out", _N),
    "reproduce --dps": ("significant digits of the reference values (%(default)s)", _N),
    "--log": ("the natural logarithm", _ON),
    "--paths": ("number of paths of --method simulate (%(default)s)", _N),
    "--seed": ("seed of random numbers (%(default)s)", _N),
    "--json": ("a JSON record with error, method, inputs", _ON),
    "--latex": ("LaTeX; without labels a document of all formulas", _ON),
    "--steps": ("with the steps of the derivation", _ON),
    "--target": ("numpy, mpmath, c, javascript or latex", _NAME),
    "--workers": ("processes (%(default)s)", _N),
    "--cluster": ("or the address of a dask.distributed scheduler", _X),
    "--only": ("these stages, not all", {"nargs": "+", **_NAME}),
    "--scene": ("these scenes, not all", {"nargs": "+", **_NAME}),
    "--level": ("quick or full (%(default)s)", _NAME),
    "--quick": ("fewer scenes and programs", _ON),
    "--force": ("make everything again", _ON),
    "--out": ("the file or folder to write (%(default)s)", {"metavar": "PLACE"}),
}  # fmt: skip
_DRIFT = "--drift --expr --set --no-layer"
#: The commands, each with its required options, its other arguments, and defaults except None.
COMMANDS: tuple[tuple[Callable[[Any], int | None], str, str, dict[str, Any]], ...] = (
    (verbs.value, "--kappa", f"quantity {_DRIFT} --noise --r --ends --start --reflecting --moment "
     "--interval --y --complement --method --order --rtol --log --dps --json", {}),
    (verbs.show, "", f"labels --latex --steps {_DRIFT} --noise --order --start --case", {}),
    (verbs.derive, "", "labels --out", {"out": "build/derivations"}),
    (verbs.emit, "--target", f"label --out {_DRIFT} --order", {}),
    (verbs.release, "--kappa --r --eps --z",
     "--start --set --phi --velocity --noise --method --rtol --paths --seed --json",
     {"start": "0", "noise": "1", "method": "march", "rtol": "1e-6", "paths": 10_000, "seed": 0}),
    (verbs.figure, "", "name --out", {}),
    (verbs.table, "--out", "spec --workers --cluster", {"workers": 1}),
    (verbs.reproduce, "", "--out --only --dps --force", {"out": "build", "dps": 50}),
    (verbs.verify, "", "--level --seed", {"level": "quick", "seed": 1}),
    (verbs.report, "", "--scene --quick --out", {"out": "build/report"}),
)  # fmt: skip


class _Parser(argparse.ArgumentParser):
    """A parser that suggests a word for a misspelt one, and accepts -1/3 and -u as values."""

    def __init__(self, **told: Any) -> None:
        shown = argparse.RawDescriptionHelpFormatter
        super().__init__(allow_abbrev=False, formatter_class=shown, **told)
        self._negative_number_matcher = re.compile("-(?!-|[oh]$)")

    def error(self, message: str) -> NoReturn:
        if wrong := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            known = re.findall(r"[\w-]+", wrong[2])
            for near in difflib.get_close_matches(wrong[1], known, 1):
                message += f"; perhaps you mean {near!r}"
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help.\n")


def _parser() -> _Parser:
    """The parser of the whole command line."""
    about = "Escape times and Laplace-type integrals of smoothed switches with noise."
    more = "examples:\n  symasym value --help\n  symasym show eq:Ttilde"
    whole = _Parser(prog="symasym", description=about, epilog=more)
    version = f"symasym {metadata.version('symasym')}"
    whole.add_argument("--version", action="version", version=version)
    commands = whole.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for run, needed, others, defaults in COMMANDS:
        about, _, more = inspect.cleandoc(str(run.__doc__)).partition("\n\n")
        parser = commands.add_parser(run.__name__, help=about, description=about, epilog=more)
        either: Any = parser
        if "--expr" in others:
            either = parser.add_mutually_exclusive_group(required=run is verbs.value)
        for word in [*needed.split(), *others.split()]:
            about, told = OPTIONS.get(f"{run.__name__} {word}") or OPTIONS[word]
            about = about if word.strip("-") in defaults else about.replace(" (%(default)s)", "")
            to = either if word in ("--drift", "--expr") else parser
            argument = to.add_argument(*["-o"] * (word == "--out"), word, help=about, **told)
            argument.required = argument.required or word in needed.split()
        parser.set_defaults(run=run, **defaults)
    return whole


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line, by default that of the process, and return its exit status.

    The status is 0; 1 if a check fails or a value does not exist; 2 after an error, which is
    printed in one sentence; 130 after an interrupt.
    """
    if argv is None:
        # Termination by a batch system is handled like Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
        argv = sys.argv[1:]
    try:
        given = _parser().parse_args(argv or ["--help"])
        return int(given.run(given) or 0)
    except SymasymError as error:
        # A text from a file may contain control characters for the terminal.
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
        print(f"symasym: {text}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return 130
