"""The command ``symasym``.

Each command is a function in `verbs`. Its docstring is the help text; it takes the arguments that
were given, of which those without a default are required, and returns an exit status or None.
"""

from __future__ import annotations

import argparse
import difflib
import inspect
import re
import sys
import warnings
from collections.abc import Sequence
from importlib import metadata
from typing import Any, NoReturn

from symasym.base.errors import InputError, SymasymError
from symasym.commands import verbs
from symasym.drift.ready_made import DRIFTS, drift_signatures
from symasym.methods import METHODS


def order(text: str) -> int | str:
    """The order of an expansion: an int or ``"optimal"``."""
    return text if text == "optimal" else int(text)


_QUANTITIES = [*verbs.QUANTITIES.values(), *verbs.QUANTITIES]
_MODELS = "; ".join(f"{name}, with {taken}" for name, taken in drift_signatures().items())
_X, _N, _TWO = {"metavar": "X"}, {"metavar": "N", "type": int}, {"metavar": "X", "nargs": 2}
_NAME, _ON = {"metavar": "NAME"}, {"action": "store_true"}
_SET = {"action": "append", "type": lambda text: text.partition("=")[::2], "metavar": "NAME=X"}
#: The commands that take an argument, its name, its help text, and the keywords for argparse.
OPTIONS: tuple[tuple[str, str, str, dict[str, Any]], ...] = (
    ("value", "quantity", "one of %(choices)s", {"choices": _QUANTITIES, "metavar": "QUANTITY"}),
    ("show", "labels", "such as eq:Ttilde, fr1, expansion:T", {"nargs": "*"}),
    ("derive", "labels", "such as eq:Ttilde, fr1", {"nargs": "*"}),
    ("emit", "label", "such as eq:Ttilde, folds, expansion:C", {}),
    ("figure", "name", "such as phase or fric1; without it they are listed", {"nargs": "?"}),
    ("table", "spec", "a TOML file: drift, grid, quantities, dps", {}),
    ("show", "--latex", "LaTeX; without labels a document of all formulas", _ON),
    ("show", "--steps", "with the steps of the derivation", _ON),
    ("emit", "--target", "numpy, mpmath, c, javascript or latex (numpy)", _NAME),
    ("value show emit", "--drift", f"a ready-made drift: {_MODELS}", {"choices": DRIFTS, **_NAME}),
    ("value show emit", "--expr", 'or a formula of A(u), such as "1/2 - u + b*u**3"', _X),
    ("release", "--phi", "phi(u, z, y), y = eps u, in place of the oscillator's", _X),
    ("release", "--velocity", "velocity of z in the same variables, in place of y - 1", _X),
    ("value show emit release", "--set", "the value of a parameter; may be repeated", _SET),
    ("value show emit", "--no-layer", "A(u) is the drift for all u, not constant for |u| > 1",
     {"action": "store_false", "dest": "layer"}),
    ("value show emit release", "--noise", "sigma(u) in the noise kappa sigma(u) dW (1)", _X),
    ("value show emit", "--stratonovich", "this product is Stratonovich's, not Itô's",
     {"action": "store_const", "const": "stratonovich", "dest": "ito"}),
    ("value release", "--kappa", "noise amplitude", _X),
    ("value release", "--r", "escape radius", _X),
    ("value", "--ends", "the interval in place of (-r, r); of occupation, reflecting ends", _TWO),
    ("value", "--reflecting", "the end that reflects: left or right", _NAME),
    ("release", "--eps", "half-width of the switch", _X),
    ("release", "--z", "the slow variable at the start", _X),
    ("value show emit release", "--start", "starting point (0)", _X),
    ("value", "--moment", "k from 1 to 20: the mean of the time to the power k", _N),
    ("value", "--quantile", "the X-quantile of the time, not the mean (1/2: median)", _X),
    ("value", "--interval", "the interval of occupation, in place of the layer", _TWO),
    ("value", "--y", "position, of stationary-density", _X),
    ("value", "--complement", "1 minus a probability", _ON),
    ("value", "--method", f"{', '.join(METHODS)} (exact); bound for C alone", _NAME),
    ("show emit", "--method", "of an expansion: laplace, strong_noise, uniform (laplace)", _NAME),
    ("release", "--method", "march (a parabolic equation in u and z) or simulate (march)", _NAME),
    ("value", "--order", 'of an expansion, or "optimal"', {"type": order}),
    ("show emit", "--order", "of an expansion", _N),
    ("show emit", "--case", 'of an expansion, such as "start well barrier"', {"metavar": "WORDS"}),
    ("value", "--rtol", "relative error allowed, of the method auto (1e-6)", _X),
    ("release", "--rtol", "relative error allowed, of the method march (1e-6)", _X),
    ("value", "--log", "the natural logarithm", _ON),
    ("value", "--dps", "significant digits, 1 to 10,000, in place of float64", _N),
    ("reproduce", "--dps", "significant digits of the reference values (50)", _N),
    ("release", "--paths", "number of paths of --method simulate (10000)", _N),
    ("release verify", "--seed", "seed of random numbers", _N),
    ("value release", "--json", "a JSON record, with error and method", _ON),
    ("table", "--workers", "processes (1)", _N),
    ("table", "--cluster", "or the address of a dask.distributed scheduler", _X),
    ("reproduce", "--only", "these stages, not all", {"nargs": "+", **_NAME}),
    ("reproduce", "--force", "make everything again", _ON),
    ("verify", "--level", "quick or full (quick)", _NAME),
    ("report", "--scene", "these scenes, not all", {"nargs": "+", **_NAME}),
    ("report", "--quick", "fewer scenes and programs", _ON),
    ("emit figure table", "--out", "file to write", _NAME),
    ("derive reproduce report", "--out", "folder to write", _NAME),
)  # fmt: skip


class _Parser(argparse.ArgumentParser):
    """A parser that suggests a word for a misspelt one, and accepts -1/3 and -u as values."""

    def __init__(self, **told: Any) -> None:
        told |= {"allow_abbrev": False, "argument_default": argparse.SUPPRESS}
        super().__init__(formatter_class=argparse.RawDescriptionHelpFormatter, **told)
        self._negative_number_matcher = re.compile("-(?!-|[oh]$)")

    def error(self, message: str) -> NoReturn:
        if wrong := re.search(r"(?:choice: '|arguments: )([\w-]+)", message):
            listed = re.findall(r"[\w-]+", message.partition("(choose from ")[2])
            known = listed or [word for _, word, *_ in OPTIONS if word != wrong[1]]
            for near in difflib.get_close_matches(wrong[1], known, 1, 0.75):
                message += f"; perhaps you mean {near!r}"
        self.exit(2, f"{self.prog}: {message}; see {self.prog} --help.\n")


def _parser() -> _Parser:
    """The parser of the whole command line."""
    about = "Escape times and Laplace-type integrals of smoothed switches with noise."
    more = "examples:\n  symasym value T --expr 1-u --kappa 1 --r 2\n  symasym show eq:Ttilde"
    whole = _Parser(prog="symasym", description=about, epilog=more)
    version = f"%(prog)s {metadata.version('symasym')}"
    whole.add_argument("--version", action="version", version=version)
    commands = whole.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for name in dict.fromkeys(" ".join(row[0] for row in OPTIONS).split()):
        run = getattr(verbs, name)
        about, _, more = inspect.cleandoc(run.__doc__).partition("\n\n")
        parser = commands.add_parser(name, help=about, description=about, epilog=more)
        parser.set_defaults(run=run)
        needed = [n for n, p in inspect.signature(run).parameters.items() if p.default is p.empty]
        for takers, word, about, told in OPTIONS:
            if name in takers.split():
                made = parser.add_argument(*["-o"] * (word == "--out"), word, help=about, **told)
                made.required = made.required or made.dest in needed
    return whole


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line, by default that of the process, and return its exit status."""
    argv = sys.argv[1:] if argv is None else argv
    warnings.formatwarning = lambda message, *_: f"note: {message}\n"
    try:
        given = vars(_parser().parse_args(argv or ["--help"]))
        names = [name for name, _ in given.get("set", ())]
        if wrong := [name for name, x in given.get("set", ()) if not x or names.count(name) > 1]:
            raise InputError(f"--set {wrong[0]} is no NAME=X, or given twice; set each name once.")
        return int(given.pop("run")(**given) or 0)
    except SymasymError as error:
        # A text from a file may contain control characters for the terminal.
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
        print(f"symasym: {text}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return 130
