"""Source code as a value: it can be written, and loaded where Python or C can."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from collections.abc import Callable
from os import PathLike
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from symasym.base.errors import InputError, OutputError
from symasym.base.files import write_bytes
from symasym.base.inputs import is_name, meant, shown
from symasym.derivation.code import DIALECTS, Dialect
from symasym.emit.program import TAKEN, Program, Ready
from symasym.emit.targets import to_c, to_javascript, to_latex, to_mpmath, to_numpy, to_python

__all__ = ["Source", "add_target"]

_RENDER: dict[str, Callable[[Program, list[Ready]], str]] = {
    "numpy": to_numpy.render,
    "mpmath": to_mpmath.render,
    "python": to_python.render,
    "javascript": to_javascript.render,
    "latex": to_latex.render,
}
#: What can be emitted; `add_target` adds to it for a process.
TARGETS = ("numpy", "mpmath", "python", "c", "javascript", "latex")

#: Endings of files -> what is written into them; other endings are free.
_PYTHON, _JAVASCRIPT = ("python", "numpy", "mpmath"), ("javascript",)
_ENDINGS = {
    ".c": ("c",), ".h": ("c",), ".py": _PYTHON, ".js": _JAVASCRIPT, ".mjs": _JAVASCRIPT,
    ".tex": ("latex",),
}  # fmt: skip


def add_target(name: str, render: Callable[[Program, list[Ready]], str], dialect: Dialect) -> None:
    """Make a language of your own known to `emit`, for this process.

    Parameters
    ----------
    name : str
        What is given as ``target``; a name that is taken already is replaced unless it is one of
        `TARGETS`.
    render : callable
        From the `Program` and its functions in double precision (a list of `Ready`) to the text of
        the file.
    dialect : Dialect
        How the language writes a call, for `symasym.emit.writing.text`.

    Raises
    ------
    InputError
        If the name is one of `TARGETS`, or no name.

    Notes
    -----
    docs/extending.md adds a language in this way, and runs its files.
    """
    if not is_name(name) or name in TARGETS:
        raise InputError(
            f"target is {shown(name)}; give a name of letters and digits, and none of "
            f"{', '.join(TARGETS)}."
        )
    _RENDER[name], DIALECTS[name] = render, dialect


def check_target(target: str) -> None:
    """Raise InputError for what is none of `TARGETS`, and was not added."""
    if not isinstance(target, str) or (target not in TARGETS and target not in _RENDER):
        known = dict.fromkeys((*TARGETS, *_RENDER))
        # By the ending of their files, too.
        ended = _ENDINGS.get(f".{target}", (target,))[0] if isinstance(target, str) else None
        near = meant(ended, known)
        raise InputError(f"target is {shown(target)}; give one of {', '.join(known)}{near}.")


class Source(str):
    """Emitted source code: a str that knows its language.

    Attributes
    ----------
    target : str
    header : str
        The C header, for ``"c"``; empty else.
    functions : tuple of str
        Names of what it defines; none for ``"latex"``.
    """

    target: str
    header: str
    functions: tuple[str, ...]
    _program: Program
    _ready: list[Ready]

    def write(self, path: str | PathLike[str], *, header: bool = False) -> list[Path]:
        """Write the file, and nothing else unless `header` asks for it; whole files or none.

        Parameters
        ----------
        path : path
        header : bool
            For C: write the header beside it, which the file then includes; a file without
            declares its functions itself.

        Raises
        ------
        InputError
            If the name of a file in C does not end in ``.c``, or another has the ending of another
            language, or there is no header.
        OutputError
            If a file cannot be written.
        """
        place = Path(path)
        if self.target == "c" and place.suffix != ".c":
            raise InputError(f"{shown(str(path))} is to hold C; let its name end in .c.")
        if self.target in TARGETS and self.target not in _ENDINGS.get(place.suffix, TARGETS):
            own = next(ending for ending, kinds in _ENDINGS.items() if self.target in kinds)
            raise InputError(
                f"{shown(str(path))} is to hold {self.target}, and {place.suffix} is for another "
                f"language; let its name end in {own}."
            )
        if not header:
            write_bytes(path, str(self).encode())
            return [place]
        if self.target != "c":
            raise InputError(f"{self.target} has no header; leave header out.")
        text, declarations = to_c.render(self._program, self._ready, place.stem)
        beside = place.with_suffix(".h")
        # The header first: a source whose header is missing would not compile.
        write_bytes(beside, declarations.encode())
        write_bytes(place, text.encode())
        return [place, beside]

    def to(self, target: str) -> Source:
        """The same functions in another language."""
        return rendered(self._program, target)

    def load(self) -> SimpleNamespace:
        """The functions as callables of this process.

        Python targets are run as they are; C is compiled by the system's compiler, its functions
        then take floats and give one, or a tuple.

        Returns
        -------
        types.SimpleNamespace

        Raises
        ------
        InputError
            For JavaScript and LaTeX, or C without a compiler.
        """
        if self.target == "c":
            return _compiled(self._program, self._ready)
        if self.target not in ("numpy", "mpmath", "python"):
            raise InputError(
                f"{self.target} cannot be loaded into Python; write it to a file, or emit "
                '"numpy", "mpmath", "python" or "c".'
            )
        space: dict[str, Any] = {"__name__": self._program.name}
        exec(compile(str(self), f"<emitted {self._program.label}>", "exec"), space)
        return SimpleNamespace(**{name: space[name] for name in self.functions})


#: What an emitted mpmath module calls itself, beside the function `name` and its body `_name`.
_BESIDE = {
    *("digits", "number", "Fraction", "MPContext", "MOST"),
    *("abs", "all", "hasattr", "isinstance", "len", "max", "str", "tuple", "zip"),
}


def rendered(program: Program, target: str) -> Source:
    """The source code of a program."""
    check_target(target)
    # What is written into code is a name, and nothing that ends a line.
    for name in (f.name for f in program.functions):
        if not is_name(name) or name in TAKEN or (target == "mpmath" and name in _BESIDE):
            raise InputError(
                f"name is {shown(name)}; give a name made of letters, digits and _ that no "
                "language has taken."
            )
    functions: list[Ready] = []
    if target != "latex":
        functions = program.in_digits if target == "mpmath" else program.in_doubles
    if target == "c":
        text = to_c.render(program, functions)[0]
        header = to_c.render(program, functions, program.name)[1]
    else:
        text, header = _RENDER[target](program, functions), ""
    source = Source(text)
    source.target, source.header = target, header
    source._program, source._ready = program, functions
    source.functions = tuple(f.name for f in functions)
    return source


def _compiled(program: Program, functions: list[Ready]) -> SimpleNamespace:
    """The functions of a shared library made by the system's C compiler."""
    compiler = to_c.compiler()
    if compiler is None:
        raise InputError(
            "there is no C compiler here (CC, cc, gcc or clang); install one, or emit another "
            "target."
        )
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "emitted.c"
        place.write_text(to_c.render(program, functions)[0])
        library = Path(folder) / "emitted.so"
        command = [compiler, "-std=c99", "-O2", "-fPIC", "-shared", "-o", str(library)]
        done = subprocess.run([*command, str(place), "-lm"], capture_output=True, text=True)
        if done.returncode:
            raise OutputError(f"{compiler} failed: {done.stderr.strip()[:300]}")
        loaded = ctypes.CDLL(str(library))
    called = {f.name: _callable(loaded, f) for f in functions}
    return SimpleNamespace(**called)


def _callable(library: ctypes.CDLL, function: Ready) -> Callable[..., float | tuple[float, ...]]:
    """A function of the library that takes floats and gives one, or a tuple."""
    entry = library[function.name]
    many = function.count > 1
    entry.argtypes = [ctypes.c_double] * len(function.arguments) + (
        [ctypes.POINTER(ctypes.c_double)] if many else []
    )
    entry.restype = None if many else ctypes.c_double

    def call(*arguments: float) -> float | tuple[float, ...]:
        """The value or values of the C function."""
        if not many:
            return float(entry(*arguments))
        out = (ctypes.c_double * function.count)()
        entry(*arguments, out)
        return tuple(out)

    return call
