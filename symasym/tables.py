"""Reference tables: exact values on a grid as JSON lines, CSV and LaTeX (docs/command-line.md).

The lines are written in the order of the grid, so that at any time the file is an initial part of
the complete one; an interrupted run resumes after the last complete line. Each line ends with its
checksum.
"""

from __future__ import annotations

import fcntl
import hashlib
import itertools
import json
import math
import os
import tomllib
from concurrent.futures import Executor
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import IO, Any

from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.estimate import number_text
from symasym.base.files import progress, reference_value, write_bytes
from symasym.base.inputs import choice, count, digits, exact, positive, sequence
from symasym.drift.ready_made import named_drift
from symasym.drift.scenes import QUANTITIES, Request, taken
from symasym.methods import ask

_NUMBERS = ("kappa", "r", "left", "right", "start")
_DRIFT = ("drift", "expr", "layer", "noise", "ito")
_KEYS = (*_DRIFT, *_NUMBERS, "quantities", "dps", "parameters")
_MOST = 10_000_000  # the largest number of values
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded correctly
_BESIDE = ".csv", ".tex"  # what is written beside the JSON lines
_AT_ONCE = 256  # the number of values computed at a time by the executor

Record = dict[str, Any]


def read_spec(path: str | os.PathLike[str]) -> list[Record]:
    """The heads of the lines of a table from its file; an InputError names the file and the key.

    The last axis varies fastest, and all quantities follow each other at each point.
    """
    try:
        with open(path, "rb") as file:
            # Decimals are read as texts, as they stand for exact values.
            return _heads(tomllib.load(file, parse_float=str))
    except (SymasymError, OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        why = getattr(error, "strerror", None) or error
        raise InputError(f"{path} gives no table: {why}") from None


def _heads(given: Record) -> list[Record]:
    of = {n: given[n] for n in _DRIFT if n in given}
    if unknown := given.keys() - set(_KEYS):
        raise InputError(f"it has {', '.join(unknown)}; the keys known are {', '.join(_KEYS)}.")
    own = dict(given.get("parameters", {}))
    numbers = {name: x for name, x in given.items() if name in _NUMBERS}
    axes = {n: [number_text(value) for value in _axis(n, x)] for n, x in (numbers | own).items()}
    wanted = sequence("quantities", given.get("quantities", ["T"]))
    names = dict.fromkeys(choice("quantities", q, QUANTITIES) for q in wanted)
    ends = {"r": ("left", "right")} if axes.keys() & {"left", "right"} else {}
    needs = {q: sum((ends.get(n, (n,)) for n in QUANTITIES[q]), ()) for q in names}
    for name, needed in needs.items():
        taken(name, needed, **{n: axes.get(n) for n in needed})
    count("the number of values", math.prod(map(len, axes.values())) * len(names), 1, _MOST)
    dps = digits(given.get("dps", 50), 10_000 - _GUARD)
    heads = list[Record]()
    for point, name in itertools.product(itertools.product(*axes.values()), names):
        left_out = set(_NUMBERS).difference(needs[name])
        x = {n: text for n, text in zip(axes, point, strict=True) if n not in left_out}
        heads.append({**of, "quantity": name, "x": x, "dps": dps})
    _drift(heads[0]).scalars()
    return heads


def _axis(name: str, given: Any) -> list[Fraction]:
    """The values on an axis, given by a number, a list or a range."""
    if not isinstance(given, dict):
        return [exact(name, x) for x in (given if isinstance(given, list) else [given])]
    low, high = (exact(f"{name}.{end}", given.get(end)) for end in ("from", "to"))
    points = count(f"{name}.points", given.get("points"), 2, _MOST)
    parts = [Fraction(k, points - 1) for k in range(points)]
    if choice(f"{name}.spacing", given.get("spacing", "linear"), ("linear", "log")) == "linear":
        return [low + x * (high - low) for x in parts]
    ratio = float(positive(name, high)) / float(positive(name, low))
    return [low, *(Fraction(f"{float(low) * ratio ** float(x):.6g}") for x in parts[1:-1]), high]


def _drift(head: Record) -> Any:
    values = {n: text for n, text in head["x"].items() if n not in _NUMBERS}
    return named_drift(values, **{n: head[n] for n in _DRIFT if n in head})


def line_of(head: Record) -> bytes:
    """The line with one value and its error, or with the reason why there is no value."""
    name, dps = head["quantity"], head["dps"]
    numbers = {n: text for n, text in head["x"].items() if n in _NUMBERS}
    if "start" in QUANTITIES[name]:
        numbers.setdefault("start", 0)
    try:
        found = ask(_drift(head), numbers, Request(name, dps=dps + _GUARD, full=True))
        record = head | reference_value(head["x"], found, dps)
    except SymasymError as error:
        record = head | {"mid": None, "rad": None, "refused": str(error)}
    return _sealed(json.dumps(record)[:-1].encode())


def _sealed(text: bytes) -> bytes:
    """A complete line from a record without its closing brace; a checksum is added."""
    return text + b', "sum": "' + hashlib.sha256(text).hexdigest()[:16].encode() + b'"}\n'


def write_table(
    heads: list[Record], path: str | os.PathLike[str], executor: Executor | None = None
) -> tuple[list[Record], int]:
    """Write or complete the JSON lines of a table, and its CSV and LaTeX files in the same folder.

    Values are computed by the executor, by default in this process. Returns the records of all
    lines and the number of lines that existed before. Raises OutputError if the existing file is
    not an initial part of this table, if a line of it was changed, or if it cannot be written.
    """
    target, run = Path(path), map if executor is None else executor.map
    if target.suffix in _BESIDE:
        raise InputError(f"{target} would be written twice; give a name such as table.jsonl.")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "a+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            records = _resumed(target, file, heads)
            done = len(records)
            with progress(target.name, len(heads), done) as bar:
                for low in range(done, len(heads), _AT_ONCE):
                    for line in run(line_of, heads[low : low + _AT_ONCE]):
                        file.write(line)
                        file.flush()
                        records.append(json.loads(line))
                        bar.update()
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(
            f"{target} cannot be written ({error.strerror or error}); make room, choose another "
            "place, or wait for another run that is at work on it."
        ) from None
    rows = _rows(records)
    head, *body = (" & ".join(row).replace("_", r"\_") + r" \\" for row in rows)
    tex = [rf"\begin{{tabular}}{{{'l' * len(rows[0])}}}", head, r"\hline", *body, r"\end{tabular}"]
    for kind, lines in zip(_BESIDE, ([",".join(row) for row in rows], tex), strict=True):
        write_bytes(target.with_suffix(kind), "\n".join([*lines, ""]).encode())
    return records, done


def _resumed(target: Path, file: IO[bytes], heads: list[Record]) -> list[Record]:
    """The records of the complete lines of a file; an incomplete last line is removed."""
    file.seek(0)
    lines = list(file)
    last = lines.pop() if lines and not lines[-1].endswith(b"\n") else b""
    for number, line in enumerate([*lines, last]):
        begin = json.dumps(heads[number])[:-1].encode() if number < len(heads) else b""
        if number == len(lines):
            own = begin.startswith(last[: len(begin)]) and (begin or not last)
        else:
            whole = line == _sealed(line.rpartition(b', "sum": "')[0])
            own = whole and begin and line.startswith(begin)
        if not own:
            raise OutputError(
                f"{target}, line {number + 1}, was changed or belongs to another table; it is left "
                "as it is: choose another file, or remove this one."
            )
    file.truncate(sum(map(len, lines)))
    return [json.loads(line) for line in lines]


def _rows(records: list[Record]) -> list[list[str]]:
    """A header, and a row for each point: the inputs, then value, error and decimal logarithm."""
    rows = list[Record]()
    for some in zip(*[iter(records)] * len({r["quantity"] for r in records}), strict=True):
        row = {name: x for record in some for name, x in record["x"].items()}
        for record in some:
            name, mid = record["quantity"], record["mid"]
            log = mid and f"{Decimal(mid).log10():.16g}"
            row |= {name: mid, f"{name}_error": record["rad"], f"log10_{name}": log}
        rows.append(row)
    return [[*rows[0]], *([x or "" for x in row.values()] for row in rows)]
