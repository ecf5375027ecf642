"""Runs the code blocks of README.md and docs/ as tests."""

import contextlib
import doctest
import io
import shlex
import tempfile
from pathlib import Path

from hypothesis import settings
from sybil import Example, Sybil
from sybil.parsers.markdown import CodeBlockParser, PythonCodeBlockParser, SkipParser

from symasym.commands import main as cli

# A busy machine is no failure.
settings.register_profile("symasym", deadline=None)
settings.load_profile("symasym")

_OPTIONS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def keep_file(example: Example) -> None:
    """Keep a block of TOML, named in its first line, for the commands of the page."""
    name = example.parsed.partition("\n")[0].removeprefix("# ").strip()
    assert name.endswith(".toml"), f"the first line of a TOML block is its name, not {name!r}"
    example.namespace.setdefault("files", {})[name] = example.parsed


def run_console(example: Example) -> str | None:
    """Run each ``$ symasym …`` of a console block and compare what it prints."""
    for part in ("\n" + example.parsed).split("\n$ ")[1:]:
        command, _, wanted = part.partition("\n")
        program, *arguments = shlex.split(command)
        assert program == "symasym", f"only symasym is run in console blocks, not {program}"
        printed = io.StringIO()
        with (
            tempfile.TemporaryDirectory() as folder,
            contextlib.chdir(folder),
            contextlib.redirect_stdout(printed),
            contextlib.redirect_stderr(printed),
        ):
            for name, content in example.namespace.get("files", {}).items():
                Path(name).write_text(content)
            cli.main(arguments)
        wanted, got = wanted.strip() + "\n", printed.getvalue().strip() + "\n"
        if not doctest.OutputChecker().check_output(wanted, got, _OPTIONS):
            return f"$ {command}\nshould print:\n{wanted}but printed:\n{got}"
    return None


pytest_collect_file = Sybil(
    parsers=[
        PythonCodeBlockParser(doctest_optionflags=_OPTIONS),
        CodeBlockParser("console", run_console),
        CodeBlockParser("toml", keep_file),
        SkipParser(),
    ],
    patterns=["README.md", "docs/*.md"],
).pytest()
