"""What the commands share: their parser, its help, and the option ``--set NAME=X``."""

from __future__ import annotations

import argparse
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, NoReturn, TypeAlias

from symasym.base.errors import InputError, OutputError
from symasym.base.inputs import is_name, meant


class Parser(argparse.ArgumentParser):
    """A parser that names what may have been meant, and lists more in its help when asked."""

    #: Texts that stand at the end of the help.
    endings: tuple[Callable[[], str], ...] = ()
    #: Names that its commands and options go by elsewhere.
    elsewhere: Mapping[str, str] = MappingProxyType({})
    #: The parsers beside it, whose options may be taken for its own, by name.
    beside: Mapping[str, Parser] = MappingProxyType({})
    _words: Sequence[str] = ()

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:
        """What `argparse` returns; a command refuses unknown words itself, and not the program."""
        self._words = args or ()
        known, unknown = super().parse_known_args(args, namespace)
        if unknown and self._subparsers is None:
            self.error(f"unrecognized arguments: {' '.join(unknown)}")
        return known, unknown

    def format_help(self) -> str:
        """The help, whose endings are made now: they load what they list."""
        self.formatter_class = argparse.RawDescriptionHelpFormatter
        self.epilog = "\n\n".join(ending() for ending in self.endings) or None
        return super().format_help()

    def error(self, message: str) -> NoReturn:
        """The usage, and what is wrong with a word that is close to it."""
        if choice := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            known = re.findall(r"[\w-]+", choice[2])
            message += meant(self.elsewhere.get(choice[1], choice[1]), known)
        elif unknown := re.search(r"unrecognized arguments: .*?(?<!\S)(-[\w-]+)", message):
            message += self._meant(unknown[1])
        elif re.search(r"arguments?.* required", message):
            given = {word.partition("=")[0] for word in self._words}
            for option in sorted(given - {*self._options()}):
                if re.match(r"-{1,2}[a-z]", option) and option[:2] not in self._options():
                    message += f"; {option} is no option{self._meant(option)}"
        super().error(message)

    def _meant(self, option: str) -> str:
        """The end of a sentence about an unknown option: who takes it, or what is close to it."""
        known = self.elsewhere.get(f"--{option.lstrip('-')}", f"--{option.lstrip('-')}")
        takes = [name for name, parser in self.beside.items() if known in parser._options()]
        if takes and known not in self._options():
            return f"; {' and '.join(takes)} take{'s' * (len(takes) == 1)} {known}"
        # Of three letters one that differs makes another word: --eps is not --dps.
        other = {name for name in self._options() if len(name) == len(known) == len("--eps")}
        same = {name for name in other if sorted(name) == sorted(known)}
        return meant(known, (name for name in self._options() if name not in other - same))

    def _options(self) -> list[str]:
        """Its own options."""
        return [name for action in self._actions for name in action.option_strings]


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


def takes_place(parser: argparse.ArgumentParser, about: str, **options: Any) -> None:
    """Add the option ``-o PLACE``, a file's or a folder's name that is not empty."""
    parser.add_argument("-o", "--out", type=_place, help=about, **{"metavar": "FILE", **options})


def _place(text: str) -> str:
    """The text, not empty; argparse lets an OutputError through, and no InputError."""
    if not text:
        raise OutputError("--out is ''; give the name of a file or a folder.")
    return text


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
