"""The command ``symasym``.

A command is a function of `numbers`, `formulas` or `workshop`: its arguments are the command's, its
keywords the options, its documentation the help, and what it gives an exit status or None. What an
option is called and means is said in `OPTIONS`, for all commands that have it.
"""

from __future__ import annotations

import argparse
import difflib
import inspect
import re
import signal
import sys
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NoReturn

import symasym as sa
from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.inputs import is_name
from symasym.commands import formulas, numbers, workshop
from symasym.drift.ready_made import DRIFTS

_BAD_INPUT, _INTERRUPTED = 2, 130
_ABOUT = """Escape times and Laplace-type integrals of smoothed switches with noise.

examples:
  symasym value --help
  symasym show eq:Ttilde
"""
COMMANDS = (
    workshop.reproduce,
    numbers.value,
    numbers.release,
    formulas.derive,
    formulas.show,
    formulas.emit,
    workshop.figure,
    numbers.table,
    workshop.verify,
    workshop.report,
)


class _Set(argparse.Action):
    """Collect ``NAME=X`` by name."""

    def __call__(self, _: Any, found: argparse.Namespace, pair: Any, *__: object) -> None:
        name, equals, text = pair.partition("=")
        known = dict(found.values)
        if not equals or not is_name(name) or name in known:
            raise InputError(f"--set is {pair!r}; give each name once, as NAME=NUMBER.")
        found.values = {**known, name: text}


class _Version(argparse.Action):
    """Look the version up when it is asked for, and not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        print(f"symasym {metadata.version('symasym')}")
        parser.exit()


def _place(text: str) -> str:
    """The text, not empty; argparse lets an OutputError through, and no InputError."""
    if not text:
        raise OutputError("--out is ''; give the name of a file or a folder.")
    return text


def _order(text: str) -> int | str:
    """An order as a number, or ``"optimal"``."""
    return text if text == "optimal" else int(text)


#: Every argument: its flag, what its value is called (empty: it has none), and what it is.
OPTIONS = {
    "label": ("", "LABEL", "such as eq:Ttilde, fr1, folds, expansion:C"),
    "labels": ("", "LABEL", "such as eq:Ttilde, fr1, folds"),
    "name": ("", "NAME", "such as phase or fric1; without it they are listed"),
    "spec": ("", "SPEC", "a TOML file: drift, grid, quantities, dps"),
    "drift": ("--drift", None, "a ready-made drift"),
    "expr": ("--expr", "A", 'or a formula A(u), e.g. "1/2 - u + b*u**3"'),
    "values": ("--set", "NAME=X", "a parameter's value, may be repeated"),
    "phi": ("--phi", "F", "velocity of u, in u, z and y = eps u"),
    "velocity": ("--velocity", "G", "velocity of z, in the same"),
    "factor": ("--noise", "S", "factor of the noise, in u (%(default)s)"),
    "noise": ("--noise", "NAME", "of an expansion: weak, strong or uniform (weak)"),
    "kappa": ("--kappa", "X", "noise amplitude"),
    "r": ("--r", "X", "escape radius"),
    "eps": ("--eps", "X", "half-width of the switch"),
    "start": ("--start", "X", "starting point (0)"),
    "y": ("--y", "X", "position"),
    "z": ("--z", "X", "z at the start"),
    "case": ("--case", "WORDS", 'of an expansion, such as "start well barrier"'),
    "ends": ("--ends", ("LEFT", "RIGHT"), "in place of -r and r; of occupation both reflect"),
    "interval": ("--interval", ("LEFT", "RIGHT"), "in place of the layer"),
    "reflecting": ("--reflecting", "SIDE", "the end that reflects, left or right"),
    "moment": ("--moment", "N", "of the time, 1 to 20 (%(default)s)"),
    "method": ("--method", "NAME", "how (%(default)s)"),
    "order": ("--order", "N", "of an expansion; of a value also optimal"),
    "rtol": ("--rtol", "X", "relative error allowed, for --method auto or march"),
    "complement": ("--complement", "", "1 minus it"),
    "dps": ("--dps", "N", "digits; of a value float64 where they are left out"),
    "log": ("--log", "", "its natural logarithm"),
    "paths": ("--paths", "N", "of --method simulate (%(default)s)"),
    "seed": ("--seed", "N", "of random numbers (%(default)s)"),
    "quantiles": ("--quantiles", "", "of the time and of z, too"),
    "record": ("--json", "", "as a record, with all that is known"),
    "everything": ("--all", "", "every formula; a document with --latex"),
    "latex": ("--latex", "", "as LaTeX"),
    "steps": ("--steps", "", "with the steps of its derivation"),
    "target": ("--target", "T", "numpy, mpmath, c, javascript or latex"),
    "workers": ("--workers", "N", "processes (%(default)s)"),
    "cluster": ("--cluster", "ADDRESS", "or a dask.distributed scheduler's"),
    "only": ("--only", "NAME", "these stages, not all"),
    "scene": ("--scene", "NAME", "these scenes, not all"),
    "level": ("--level", "NAME", "quick or full (%(default)s)"),
    "quick": ("--quick", "", "fewer scenes and programs"),
    "force": ("--force", "", "make everything again"),
    "out": ("-o --out", "PLACE", "the file or folder to write"),
}
_TOLD: dict[str, dict[str, Any]] = {
    "drift": {"choices": DRIFTS},
    "values": {"action": _Set},
    "order": {"type": _order},
    "only": {"nargs": "+", "action": "extend"},
    "scene": {"nargs": "+", "action": "extend"},
    "out": {"type": _place},
    "ends": {"nargs": 2},
    "interval": {"nargs": 2},
}
#: Of these one may be given.
_EITHER = (("drift", "expr"), ("workers", "cluster"))
_MISSING = inspect.Parameter.empty


class _Parser(argparse.ArgumentParser):
    """A parser that names what is close to a wrong word."""

    def __init__(self, **told: Any) -> None:
        shown = argparse.RawDescriptionHelpFormatter
        super().__init__(allow_abbrev=False, formatter_class=shown, **told)

    def parse_known_args(self, *given: Any, **named: Any) -> Any:
        """Refuse what is left with this command's own usage and options."""
        found, left = super().parse_known_args(*given, **named)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def error(self, message: str) -> NoReturn:
        wrong = re.search(r"(?:invalid choice: '|unrecognized arguments: )([^' ]+)", message)
        choices = re.findall(r"[\w-]+", message.partition("choose from")[2])
        known = choices or [name for action in self._actions for name in action.option_strings]
        near = difflib.get_close_matches(wrong[1], known, 1) if wrong else []
        super().error("; ".join([message, *(f"perhaps you mean {word!r}" for word in near)]))


def _command(below: Any, name: str, doc: str, run: Any, taken: dict[str, Any]) -> Any:
    """The parser of a command, of what `run` takes: names with defaults."""
    about, _, more = inspect.cleandoc(doc).partition("\n\n")
    parser = below.add_parser(name, help=about.rstrip("."), description=about, epilog=more)
    parser.set_defaults(run=run)
    to: dict[str, Any] = {}
    for pair in _EITHER:
        if pair[1] in taken:
            group = parser.add_mutually_exclusive_group(required=taken[pair[1]] is _MISSING)
            to |= dict.fromkeys(pair, group)
    for name, default in taken.items():
        flag, metavar, about = OPTIONS[name]
        told: dict[str, Any] = {"help": about, "metavar": metavar}
        if not flag:
            parser.add_argument(name, nargs={None: "?", (): "*"}.get(default), **told)
            continue
        if metavar == "":
            told = {"help": about, "action": "store_true"}
        elif metavar == "N":
            told["type"] = int
        if default is _MISSING:
            told["required"] = name not in to
        elif default == ():
            told |= {"action": "append", "default": []}
        else:
            told["default"] = default
        to.get(name, parser).add_argument(*flag.split(), dest=name, **told | _TOLD.get(name, {}))
    return parser


def _parser() -> _Parser:
    """The parser of the whole command line."""
    about, _, more = _ABOUT.partition("\n\n")
    whole = _Parser(prog="symasym", description=about, epilog=more)
    about = "print the version and stop"
    whole.add_argument("--version", action=_Version, nargs=0, default=argparse.SUPPRESS, help=about)
    commands = whole.add_subparsers(title="commands", required=True, metavar="COMMAND")
    for run in COMMANDS:
        if run is not numbers.value:
            _command(commands, run.__name__, str(run.__doc__), run, _defaults(run))
            continue
        value = _command(commands, "value", str(run.__doc__), run, {})
        quantities = value.add_subparsers(required=True, metavar="QUANTITY")
        for verb in numbers.QUANTITIES:
            taken: dict[str, Any] = {"drift": _MISSING, "expr": _MISSING, "values": ()}
            taken |= _defaults(getattr(sa, verb)) | {"record": False}
            del taken["full"]
            name, doc = verb.replace("_", "-"), numbers.help_of(verb)
            _command(quantities, name, doc, partial(run, verb), taken)
    return whole


def _defaults(function: Callable[..., object]) -> dict[str, Any]:
    """What a function takes, with defaults; a number's is a text."""
    known = inspect.signature(function).parameters
    return {
        name: "0" if p.default == 0 and name == "start" else p.default for name, p in known.items()
    }


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command line and give its exit status.

    Parameters
    ----------
    argv : sequence of str, optional
        Arguments; those of the process when left out.

    Returns
    -------
    int
        0, or 1 for a derivation or check that fails, 2 after an error that is said in one
        sentence, 130 after an interrupt.
    """
    if argv is None:
        argv = sys.argv[1:]
        # A batch system that stops the job is owed the same tidiness as Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        arguments = vars(_parser().parse_args(_join_negative(argv)))
        return int(arguments.pop("run")(**arguments) or 0)
    except SymasymError as error:
        # A stranger's file may hold what a terminal would obey.
        text = "".join(c if c.isprintable() else ascii(c)[1:-1] for c in str(error))
        print(f"symasym: {text}", file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return _INTERRUPTED


def _join_negative(argv: Sequence[str]) -> list[str]:
    """Write ``--start -1/3`` as ``--start=-1/3``, which argparse would take for an option."""
    joined: list[str] = []
    for word in argv:
        takes_value = joined and re.fullmatch(r"--(?!ends|interval)[a-z]+", joined[-1])
        if takes_value and re.match(r"-[\d.(a-z]", word) and not re.match(r"-[a-z]$", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined
