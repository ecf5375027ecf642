"""The command ``symasym figure``."""

from __future__ import annotations

import argparse
import inspect
import textwrap
import warnings
from pathlib import Path
from typing import Any

from symasym.base.errors import InputError, SymasymError
from symasym.base.inputs import whole
from symasym.base.texts import meant
from symasym.commands.settings import Commands, command, settings, takes_settings


def add_parser(commands: Commands) -> None:
    """Add the parser of ``figure``."""
    parser = command(
        commands, "figure", "draw one of the paper's figures", run,
        "symasym figure fric1 --set mu=3,1/2 -o fric1.svg", "symasym figure phase",
        description="Draw one of the paper's figures from the model and print its caption. "
        "Without a name, list the figures.",
    )  # fmt: skip
    parser.add_argument("name", nargs="?", metavar="NAME", help="such as phase or fric1")
    takes_settings(parser, "set a parameter; several values are separated by commas")
    files = "a .png, .svg or .pdf file; may be repeated (NAME.png and NAME.svg)"
    parser.add_argument("-o", "--out", action="append", metavar="FILE", help=files)


def run(arguments: argparse.Namespace) -> None:
    """``symasym figure``."""
    from symasym.workshop.figures import FIGURES

    if arguments.name is None:
        for name, draw in FIGURES.items():
            print(f"{name:16} {str(draw.__doc__).partition(chr(10))[0]}")
        return
    if arguments.name not in FIGURES:
        near = meant(arguments.name, FIGURES)
        raise InputError(
            f"{arguments.name} is no figure; the figures are {', '.join(FIGURES)}{near}."
        )
    write(arguments.name, settings(arguments.set), arguments.out)


def write(name: str, values: dict[str, str], out: list[str] | None) -> None:
    """Draw a figure, write its files, and print their names and its caption."""
    from symasym.base.files import write_bytes
    from symasym.workshop.figures import FIGURES, KINDS, encode

    files = [Path(file) for file in out or (f"{name}.png", f"{name}.svg")]
    for file in files:
        if file.suffix[1:] not in KINDS:
            raise InputError(f"{file} has no ending that is drawn; end it in .png, .svg or .pdf.")
    arguments = _read(name, values)
    with warnings.catch_warnings():
        # matplotlib warns where axes have no extent.
        warnings.simplefilter("error", UserWarning)
        try:
            figure = FIGURES[name](**arguments)
        except (UserWarning, ArithmeticError) as error:
            if isinstance(error, SymasymError):
                raise
            given = ", ".join(f"{key} = {text}" for key, text in values.items())
            raise InputError(
                f"{name} cannot be drawn with {given or 'its own values'} ({error}); give values "
                "nearer to 1."
            ) from None
    for file in files:
        write_bytes(file, encode(figure, file.suffix[1:]))
        print(file)
    print(textwrap.fill(str(figure.get_label()), 100))


def _read(name: str, values: dict[str, str]) -> dict[str, Any]:
    """The arguments of a figure's function from their texts."""
    from symasym.workshop.figures import FIGURES

    known = inspect.signature(FIGURES[name]).parameters
    arguments: dict[str, Any] = {}
    for key, text in values.items():
        if key not in known:
            raise InputError(
                f"{key} is no parameter of {name}; its parameters are {', '.join(known)}."
            )
        default = known[key].default
        if isinstance(default, tuple):
            arguments[key] = text.split(",")
        else:
            arguments[key] = whole(key, text) if key == "points" else text
    return arguments
