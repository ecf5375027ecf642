"""What the commands share: their parser, its help, and the option ``--set NAME=X``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

from symasym.base.errors import InputError
from symasym.base.inputs import is_name, meant


class Parser(argparse.ArgumentParser):
    """A parser that names what may have been meant, and lists more in its help when asked."""

    #: Texts that stand at the end of the help.
    endings: tuple[Callable[[], str], ...] = ()
    #: Names that its commands go by elsewhere.
    letters: Mapping[str, str] = MappingProxyType({})
    _words: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """What `argparse` returns; the words are kept for `error`."""
        self._words = args or ()
        return super().parse_known_args(args, namespace)

    def format_help(self) -> str:
        """The help, whose endings are made now: they load what they list."""
        self.formatter_class = argparse.RawDescriptionHelpFormatter
        self.epilog = "\n\n".join(ending() for ending in self.endings) or None
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """The usage, and what is wrong with a word that is close to it."""
        if choice := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            known = re.findall(r"[\w-]+", choice[2])
            message += meant(self.letters.get(choice[1], choice[1]), known)
        elif unknown := re.search(r"unrecognized arguments: (-[\w-]+)", message):
            others = (option for option in self._options() if option != unknown[1])
            message += meant(unknown[1], others)
        elif missing := re.search(r"arguments are required: (.*)", message):
            given = {word.partition("=")[0] for word in self._words if word.startswith("--")}
            for option in sorted(given - {*self._options()}):
                message += f"; {option} is no option{meant(option, missing[1].split(', '))}"
        super().error(message)

    def _options(self) -> Iterator[str]:
        """Every option of this parser and of those below it."""
        for action in self._actions:
            yield from action.option_strings
            if isinstance(action, argparse._SubParsersAction):
                for parser in action.choices.values():
                    yield from parser._options()


#: What ``add_subparsers`` returns, to which each command adds its parser.
Commands: TypeAlias = "argparse._SubParsersAction[Parser]"
Run: TypeAlias = Callable[[argparse.Namespace], int | None]


def document(parser: Parser, examples: Iterable[str], *more: Callable[[], str]) -> None:
    """End a command's help with examples, and with what `more` lists."""
    lines = "\n".join(["examples:", *(f"  {line}" for line in examples)])
    parser.endings = (*more, lambda: lines)


def listed(title: str, items: Mapping[str, str]) -> str:
    """A title and lines of two columns."""
    return "\n".join([f"{title}:", *(f"  {name:14}{text}" for name, text in items.items())])


def command(
    commands: Commands, name: str, about: str, run: Run, *examples: str, description: str = ""
) -> Parser:
    """The parser of a command, which `run` carries out; its help says `about`, or more."""
    description = description or f"{about[0].upper()}{about[1:]}."
    parser = commands.add_parser(name, help=about, description=description, allow_abbrev=False)
    document(parser, examples)
    parser.set_defaults(run=run)
    return parser


def takes_patience(parser: argparse.ArgumentParser, seconds: float = 10.0) -> None:
    """Add the option ``--patience SECONDS``, which `main` runs the command under."""
    parser.add_argument(
        "--patience", type=float, default=seconds, metavar="SECONDS",
        help=f"of processor time that it may take, or inf ({seconds:g})",
    )  # fmt: skip


def takes_settings(parser: Parser, about: str) -> None:
    """Add the option ``--set NAME=X``, which may be repeated."""
    parser.add_argument("--set", action="append", default=[], metavar="NAME=X", help=about)


def settings(pairs: Sequence[str]) -> dict[str, str]:
    """The texts of ``NAME=X`` pairs by name.

    Raises
    ------
    InputError
        If a pair is none, or a name is set twice.

    Examples
    --------
    >>> settings(["mu=3", "z0=-0.4"])
    {'mu': '3', 'z0': '-0.4'}
    """
    values: dict[str, str] = {}
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not is_name(name):
            raise InputError(f"--set is {pair!r}; write it as NAME=NUMBER, for example mu=3.")
        if name in values:
            raise InputError(f"{name} is set twice; set it once.")
        values[name] = text
    return values
