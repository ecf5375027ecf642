"""Reference tables: a grid of exact values as JSON lines, made in batches that can be resumed.

The file is written in the order of the grid, whole lines at a time, so that at any moment it
is the beginning of the finished file. A run that was stopped, however, goes on behind the last
whole line.
"""

from __future__ import annotations

import itertools
import json
import math
import os
import re
from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from concurrent.futures import BrokenExecutor, Executor
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symasym.base import progress
from symasym.base.call_context import own_context
from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.executors import Here, result_of
from symasym.base.files import reference_value, versions, write_bytes
from symasym.base.inputs import exact
from symasym.drift.ready_made.named import named_drift
from symasym.quantities import call_named
from symasym.tables.spec import Spec

if TYPE_CHECKING:
    from symasym.drift.drift import Drift


__all__ = ["Outcome", "value_record", "write_table"]

# Digits beyond those printed, so that the last printed one is rounded right.
_GUARD = 5
# What is asked of a worker at once: enough to forget the cost of asking, and little to lose.
_BATCH_DIGITS = 800
_MOST_IN_BATCH = 16
#: Batches that are asked for before the first of them is written.
AHEAD = 64
_LIBRARIES = ("mpmath", "python-flint")
_SECONDS_BETWEEN_LINES = 10.0
_NUMBER = re.compile(r"\d+(\.\d*)?(e[+-]?\d{1,30})?", re.ASCII)
_BEGINNING = b'{"drift": '


@dataclass(frozen=True)
class Outcome:
    """The outcome of a table.

    Attributes
    ----------
    path, csv : Path
        The JSON lines, and the table for plotting.
    values, made, refused : int
        Values of the table, those made in this run, and those that do not exist or could not
        be had, whose lines say why.
    """

    path: Path
    csv: Path
    values: int
    made: int
    refused: int


def value_record(quantity: str, drift: Drift, x: Mapping[str, str], dps: int) -> dict[str, Any]:
    """One value with its error, as it stands in a file (see `reference_value`).

    Parameters
    ----------
    quantity : str
        Of `symasym.scenes.QUANTITIES`.
    drift : Drift
        Bound.
    x : mapping of str to str
        The exact inputs; kappa, r and start are read from it.
    dps : int
        Digits to print.
    """
    # A table is made to wait for.
    given: dict[str, Any] = {"dps": min(dps + _GUARD, 10_000), "full": True, "patience": math.inf}
    estimate = call_named(quantity, drift, x, **given)
    return {"quantity": quantity, **reference_value(x, estimate, dps)}


def lines_of(
    drift: str | None,
    expr: str | None,
    dps: int,
    batch: list[tuple[str, dict[str, str]]],
) -> list[str]:
    """The lines of a batch of quantities and points; what a worker does.

    All have the same keys. A value that is refused becomes a line with the reason, because the
    other ones are wanted.
    """
    lines = []
    made = {"drift": drift, "expr": expr}
    for quantity, x in batch:
        try:
            parameters = {n: v for n, v in x.items() if n not in ("kappa", "r", "start")}
            record = value_record(quantity, named_drift(drift, expr, parameters), x, dps)
            record = {**made, **record, "refused": None}
        except SymasymError as error:
            nothing = dict.fromkeys(("mid", "rad", "error_kind"))
            record = {**made, "quantity": quantity, "x": x, **nothing, "dps": dps, "method": None}
            record |= {"versions": versions(*_LIBRARIES), "refused": str(error)}
        lines.append(json.dumps(record, ensure_ascii=False) + "\n")
    return lines


def write_table(
    spec: Spec,
    out: str | os.PathLike[str],
    *,
    executor: Executor | None = None,
    force: bool = False,
) -> Outcome:
    """Make the table of `spec`, or what is missing of it.

    Parameters
    ----------
    spec : Spec
        See `symasym.tables.spec.read_spec`.
    out : path
        The JSON lines; the table for plotting gets its name with ``.csv``.
    executor : concurrent.futures.Executor, optional
        Where the values are computed; this thread when left out. The content of the files
        does not depend on it.
    force : bool
        Make everything again.

    Raises
    ------
    InputError
        If the file holds something else.
    OutputError
        If it cannot be written, is being written by another run, or workers are lost; what
        was written stays, and the next run goes on from there.
    """
    path = Path(out)
    if not path.name:
        raise InputError(f"the file is {str(out)!r}; give a name, such as table.jsonl.")
    csv = path.with_suffix(".csv")
    if csv == path:
        raise InputError(f"{path} is the name of the CSV file; end it otherwise, as in .jsonl.")
    total = spec.scenes * len(spec.quantities)
    _require_own(csv, path, spec)
    with _opened(path) as file:
        if force:
            _emptied(file, path)
        done = _kept(file, path, spec)
        missing = itertools.islice(_values(spec), done, None)
        if done < total:
            name = path.name
            with progress.stage(name, total, done=done, every=_SECONDS_BETWEEN_LINES) as step:
                for lines in _in_order(executor or Here(), spec, missing, path):
                    _check_versions(json.loads(lines[0]), "what a worker sent", path)
                    _append(file, "".join(lines).encode(), path)
                    step(len(lines))
        file.seek(0)
        content, refused = _csv(spec, file)
    write_bytes(csv, content)
    return Outcome(path, csv, total, total - done, refused)


def _values(spec: Spec) -> Iterator[tuple[str, dict[str, str]]]:
    """Every line of the table, in order."""
    for x in spec.points():
        for quantity in spec.quantities:
            yield quantity, x


def _in_order(
    executor: Executor, spec: Spec, values: Iterable[tuple[str, dict[str, str]]], path: Path
) -> Iterator[list[str]]:
    """The lines of batch after batch, some of them ahead of time."""
    size = max(1, min(_MOST_IN_BATCH, _BATCH_DIGITS // spec.dps))
    ahead = 1 if isinstance(executor, Here) else AHEAD
    source, waiting = iter(values), deque[Any]()
    try:
        while True:
            while len(waiting) < ahead and (batch := list(itertools.islice(source, size))):
                arguments = (spec.drift, spec.expr, spec.dps, batch)
                waiting.append(executor.submit(lines_of, *arguments))
            if not waiting:
                return
            yield result_of(waiting.popleft(), executor)
    except BrokenExecutor:
        raise OutputError(
            f"a worker process was ended from outside or ran out of memory; {path} is whole, "
            "and the same command goes on from there."
        ) from None
    finally:
        for future in waiting:
            future.cancel()


# -- the file --------------------------------------------------------------------------------


@contextmanager
def _opened(path: Path) -> Iterator[FileIO]:
    """The file for reading and writing, for this run alone."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        # Unbuffered: what was written is in the file, even if this process is killed.
        file = FileIO(os.open(path, os.O_RDWR | os.O_CREAT, 0o666), "r+")
    except OSError as error:
        raise _unwritable(path, error) from None
    with file:
        if not path.is_file():
            raise OutputError(f"{path} is a device, which keeps no table; give the name of a file.")
        try:
            import fcntl
        except ImportError:  # Windows
            pass
        else:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise OutputError(
                    f"{path} is being written by another run; wait for it, or choose another file."
                ) from None
            except OSError:  # a file system without locks
                pass
        yield file


def _emptied(file: FileIO, path: Path) -> None:
    """Nothing is left of an older table; a file that is none is not ours to empty."""
    beginning = file.read(len(_BEGINNING)) or b""
    if not _BEGINNING.startswith(beginning):
        raise InputError(f"{path} is no table; remove it, or choose another file.")
    file.truncate(0)


def _require_own(csv: Path, path: Path, spec: Spec) -> None:
    """Nothing is written over a CSV file without its table, unless it has this one's head."""
    if not csv.is_file() or (path.is_file() and path.stat().st_size):
        return
    head = _head(spec).encode()
    with csv.open("rb") as there:
        if there.read(len(head)) != head:
            raise InputError(
                f"{csv} is there without its table {path}; remove it, or choose another file."
            )


def _append(file: FileIO, data: bytes, path: Path) -> None:
    """All of `data` behind what is there, or nothing."""
    end = file.seek(0, os.SEEK_END)
    try:
        rest = memoryview(data)
        while rest:
            rest = rest[file.write(rest) :]
        os.fsync(file.fileno())
    except BaseException as error:
        with suppress(OSError):
            file.truncate(end)
        if isinstance(error, OSError):
            raise _unwritable(path, error) from None
        raise


def _unwritable(path: Path, error: OSError) -> OutputError:
    """The error of a file that cannot be written, with the system's reason."""
    return OutputError(
        f"{path} cannot be written ({error.strerror or error}); make room or choose another "
        "place, what was there before is untouched."
    )


def _kept(file: FileIO, path: Path, spec: Spec) -> int:
    """The number of values that the file holds already; the rest of a torn last line is cut off."""
    file.seek(0)
    # A file of its own, so that closing the buffer leaves `file` open.
    with open(os.dup(file.fileno()), "rb") as lines:
        end, done, expected = 0, 0, _values(spec)
        for line in lines:
            if not line.endswith(b"\n") and line[: len(_BEGINNING)] == _BEGINNING[: len(line)]:
                break
            _check_line(line, spec, next(expected, None), f"{path}, line {done + 1},", path)
            end, done = end + len(line), done + 1
    file.truncate(end)
    return done


def _check_line(
    line: bytes,
    spec: Spec,
    expected: tuple[str, dict[str, str]] | None,
    where: str,
    path: Path,
) -> None:
    """Refuse a line that is not the value expected there."""
    try:
        record = json.loads(line)
        known = (record["quantity"], record["x"]) == expected
        known &= all(record[key] == getattr(spec, key) for key in ("drift", "expr", "dps"))
        known &= isinstance(record["versions"], dict)
        texts = [record["mid"], record["rad"]]
        known &= texts == [None, None] or all(
            len(x) < spec.dps + 99 and _NUMBER.fullmatch(x) for x in texts
        )
    except (ValueError, KeyError, TypeError, RecursionError):
        known = False
    if not known:
        raise InputError(
            f"{where} is not the value that this spec has there; choose another file, or "
            "--force to make it anew."
        )
    _check_versions(record, where, path)


def _check_versions(record: dict[str, Any], who: str, path: Path) -> None:
    """The same bytes in every run need the same libraries."""
    here = versions(*_LIBRARIES)
    for name in sorted(here | record["versions"]):
        there = record["versions"].get(name)
        if there != here.get(name):
            raise InputError(
                f"{who} was computed with {name} {there or 'missing'}, and here it is "
                f"{here.get(name) or 'missing'}; use the same version to go on with {path}, or "
                "--force to make it anew."
            )


# -- for plotting and data frames ------------------------------------------------------------


def _csv(spec: Spec, lines: Iterable[bytes]) -> tuple[bytes, int]:
    """A row for each point: values, errors and decimal logarithms; how many have none."""
    names = [name for name, _ in spec.axes]
    rows, refused = [_head(spec)], 0
    records = map(json.loads, lines)
    with own_context(25) as context:
        for x in spec.points():
            cells = [_decimal(x[name]) for name in names]
            for _ in spec.quantities:
                record = next(records)
                mid = record["mid"]
                refused += mid is None
                log = "" if mid is None else repr(float(context.log10(context.mpf(mid))))
                cells += [mid or "", record["rad"] or "", log]
            rows.append(",".join(cells))
    return ("\n".join(rows) + "\n").encode(), refused


def _head(spec: Spec) -> str:
    """The first line: axes, and three columns a quantity."""
    short = [quantity.replace(" ", "") for quantity in spec.quantities]
    heads = [head for name in short for head in (name, f"{name}_error", f"log10_{name}")]
    return ",".join([*(name for name, _ in spec.axes), *heads])


def _decimal(text: str) -> str:
    """A number as programs read it: quotients are rounded."""
    return repr(float(exact("x", text))) if "/" in text else text
