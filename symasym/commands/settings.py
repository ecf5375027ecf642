"""What the commands share: their parser, its help, and the options ``--set`` and ``--out``."""

from __future__ import annotations

import argparse
import difflib
import re
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, NoReturn, TypeAlias

from symasym.base.errors import InputError, OutputError
from symasym.base.inputs import is_name


class Parser(argparse.ArgumentParser):
    """A parser that names a command or option that is close, and ends its help with examples."""

    #: Texts that stand at the end of the help, made when it is asked for.
    endings: tuple[Callable[[], str], ...] = ()

    def format_help(self) -> str:
        self.formatter_class = argparse.RawDescriptionHelpFormatter
        self.epilog = "\n\n".join(ending() for ending in self.endings) or None
        return super().format_help()

    def parse_known_args(self, *given: Any, **named: Any) -> Any:
        """Refuse what is left with this command's own usage and options."""
        found, left = super().parse_known_args(*given, **named)
        if left:
            self.error(f"unrecognized arguments: {' '.join(left)}")
        return found, left

    def error(self, message: str) -> NoReturn:
        known: list[str] = [name for action in self._actions for name in action.option_strings]
        word = re.search(r"unrecognized arguments: (\S+)", message)
        if chosen := re.search(r"invalid choice: '(.*?)' \(choose from (.*)\)", message):
            word, known = chosen, re.findall(r"[\w-]+", chosen[2])
        near = difflib.get_close_matches(word[1], known, 1) if word else []
        super().error(f"{message}; perhaps you mean {near[0]!r}" if near else message)


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
        if not equals or not is_name(name) or name in values:
            raise InputError(f"--set is {pair!r}; give each name once, as NAME=NUMBER.")
        values[name] = text
    return values
