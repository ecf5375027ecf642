"""The command ``symasym``."""

from __future__ import annotations

import argparse
import codecs
import io
import math
import os
import re
import signal
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn, TextIO

from symasym.base.call_context import limited
from symasym.base.errors import SymasymError
from symasym.commands import derive, emit, release, show, table, value, workshop
from symasym.commands.settings import Parser, document
from symasym.drift.ready_made.named import DRIFTS

_BAD_INPUT = 2
_INTERRUPTED = 130
# As of a program that the closed pipe ends: 128 and the signal.
_BROKEN_PIPE = 141


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
        sentence, 130 after an interrupt, 141 where whoever read the output has left.
    """
    if argv is None:
        argv = sys.argv[1:]
        # A batch system that stops the job is owed the same tidiness as Ctrl-C.
        signal.signal(signal.SIGTERM, signal.default_int_handler)
    # Python has None for a stream that was closed, and what is printed there is lost.
    if sys.stderr is None:
        sys.stderr = open(os.devnull, "w")  # noqa: SIM115
    if sys.stdout is None:
        print("symasym: standard output is closed; open it or redirect it.", file=sys.stderr)
        return _BAD_INPUT
    for stream in (sys.stdout, sys.stderr):
        _make_printable(stream)
    try:
        arguments = _parser().parse_args(_join_negative(argv))
        # A command without the option is waited for.
        with limited(getattr(arguments, "patience", math.inf)):
            status = int(arguments.run(arguments) or 0)
        sys.stdout.flush()
    except SymasymError as error:
        print(f"symasym: {_visible(in_options(str(error)))}", file=sys.stderr)
        return _BAD_INPUT
    except KeyboardInterrupt:
        print("symasym: interrupted; every file that was written is whole.", file=sys.stderr)
        return _INTERRUPTED
    except BrokenPipeError:
        # Whoever read the output has left and needs no word.
        _drop_output()
        return _BROKEN_PIPE
    except OSError as error:
        # Files raise OutputError, so this is standard output itself.
        _drop_output()
        print(
            f"symasym: standard output cannot be written ({error.strerror}); "
            "make room or redirect it.",
            file=sys.stderr,
        )
        return _BAD_INPUT
    return status


#: What stands for a sign that the terminal does not have; for any other a question mark.
_PLAIN = {"±": "+-", "κ": "kappa", "λ": "lambda", "φ": "phi", "…": "...", "−": "-", "–": "-",
          "·": "*", "×": "x", "²": "^2", "≤": "<=", "≥": ">=", "≈": "~", "’": "'", "“": '"',
          "”": '"'}  # fmt: skip


def _plainly(error: UnicodeError) -> tuple[str, int]:
    """An encoder's error handler."""
    if not isinstance(error, UnicodeEncodeError):
        raise error
    wrong = error.object[error.start : error.end]
    return "".join(_PLAIN.get(sign, "?") for sign in wrong), error.end


def _make_printable(stream: TextIO) -> None:
    """Let a stream without Unicode print something for each sign."""
    if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
        codecs.register_error("symasym", _plainly)
        stream.reconfigure(errors="symasym")


def _as_command(call: re.Match[str]) -> str:
    """``sa.escape_time(method='uniform')`` as a command."""
    options = [in_options(part) for part in (call[2] or "").split(", ") if "=" in part]
    return " ".join(["symasym value", call[1].replace("_", "-"), *options])


def _as_drift(found: re.Match[str]) -> str:
    """``sa.tanh(steepness=5)``, or ``sa.Drift('1 - b*u').bind(b=3)``, as options."""
    words = f"--drift {found[1]}" if found[1] in DRIFTS else f"--expr {found[1]}"
    for number, part in enumerate((found[2] or "…").split(", ")):
        name, equals, value = part.replace("'", "").rpartition("=")
        if value not in ("", "…"):
            # Without names are a polynomial's coefficients alone.
            words += f" --set {name if equals else f'c{number}'}={value}"
    return words


#: A text in quotes is a caller's own, and stays.
_QUOTED = r"""(?<![\w=])(?:'[^']*'|"[^"]*")"""
# How Python says it, and how the command line does.
_AS_OPTIONS: list[tuple[str, str | Callable[[re.Match[str]], str]]] = [
    (
        r"\bsa\.(escape_time|exit_probability|occupation|stationary_density)\b(?:\(([^()]*)\))?",
        _as_command,
    ),
    (r"\bname its variable, as in sa\.Drift\(.*'\)", "write it in u"),
    (rf"\bsa\.({'|'.join(DRIFTS)})\b(?:\(([^()]*)\))?", _as_drift),
    (rf"\bsa\.Drift\(({_QUOTED})\)(?:\.bind\(([^()]*)\))?", _as_drift),
    (r"\bDrift\.general\(\)", "the general drift"),
    (r"\bbind\((\w+=…(?:, \w+=…)*)\)", lambda found: f"--set {found[1].replace(', ', ' --set ')}"),
    (r"\bbind (them|it)\b(?! with)", r"set \1 with --set NAME=X"),
    (r"\bdrift=…", "--drift NAME or --expr A"),
    (r"\bsa\.labels\(\) lists them", "symasym show --all lists them"),
    (r"\b(log|complement)=True\b", r"--\1"),
    (r"\bfull=True\b", "--json"),
    (r"; errors='nan' leaves such elements out", ""),
    (r"\b(dps|order)=(?:n|…)", r"--\1 N"),
    (r"\brtol=…", "--rtol X"),
    (r"\bpatience=…", "--patience SECONDS"),
    (r"\bcase='([^']*)'", r'--case "\1"'),
    (
        r"\bmethod=('\w+'(?:(?:, | or )'\w+')+)",
        lambda found: f"--method {found[1].replace(chr(39), '')}",
    ),
    (r"\b(method|noise|order|dps)='?(\w+)'?", r"--\1 \2"),
    (r"\b(ask for|take|use|call) escape_time\b", r"\1 escape-time"),
]


def in_options(message: str) -> str:
    """A message whose advice is for Python, for the command line; what it quotes stays.

    Examples
    --------
    >>> in_options("mu has no value; set it with bind(mu=…), or pass log=True.")
    'mu has no value; set it with --set mu=…, or pass --log.'
    >>> in_options("'escape_time' is unknown; use sa.escape_time(method='uniform').")
    "'escape_time' is unknown; use symasym value escape-time --method uniform."
    """

    def said(found: re.Match[str]) -> str:
        for pattern, option in _AS_OPTIONS:
            if whole := re.fullmatch(pattern, found[0]):
                return whole.expand(option) if isinstance(option, str) else option(whole)
        return found[0]

    return re.sub("|".join([_QUOTED, *(pattern for pattern, _ in _AS_OPTIONS)]), said, message)


def _visible(message: str) -> str:
    """A message in which what a terminal would obey or hide, from a stranger's file, is spelt."""
    return "".join(
        c if c.isprintable() or c == "\n" else c.encode("unicode_escape").decode() for c in message
    )


def _drop_output() -> None:
    """Send what is still buffered nowhere, or Python fails on it again at exit."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _join_negative(argv: Sequence[str]) -> list[str]:
    """Write ``--start -1/3`` as ``--start=-1/3``, which argparse would take for an option."""
    joined: list[str] = []
    for word in argv:
        takes_value = joined and joined[-1] in {
            *("--start", "--y", "--kappa", "--r", "--expr"),
            *("--z", "--phi", "--velocity", "--noise", "--eps"),
        }
        if takes_value and re.match(r"-[^-]", word):
            joined[-1] += f"={word}"
        else:
            joined.append(word)
    return joined


class _Version(argparse.Action):
    """Look the version up when it is asked for, and not at every start."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from importlib import metadata

        print(f"symasym {metadata.version('symasym')}")
        parser.exit()


def _parser() -> Parser:
    """The parser of the whole command line."""
    parser = Parser(
        prog="symasym",
        description="Escape times and Laplace-type integrals of smoothed switches with noise.",
        allow_abbrev=False,
    )
    parser.add_argument("--version", action=_Version, nargs=0, help="print the version and stop")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")
    document(parser, ("symasym value --help", "symasym show eq:Ttilde"))
    for add_parser in (
        workshop.add_reproduce, value.add_parser, release.add_parser, derive.add_parser,
        show.add_parser, emit.add_parser, workshop.add_figure, table.add_parser,
        workshop.add_verify, workshop.add_report,
    ):  # fmt: skip
        add_parser(commands)
    return parser
