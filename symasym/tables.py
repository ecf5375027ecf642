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
from typing import IO, Any, NamedTuple

from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.estimate import number_text
from symasym.base.files import progress, reference_value, write_bytes
from symasym.base.inputs import choice, count, digits, exact, positive, sequence
from symasym.drift.ready_made import named_drift
from symasym.drift.scenes import QUANTITIES, Request, taken
from symasym.methods import ask

_NUMBERS = ("kappa", "r", "start")
_KEYS = (*_NUMBERS, "drift", "expr", "quantities", "dps", "parameters")
_MOST = 10_000_000  # the largest number of values
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded correctly
_AT_ONCE = 256  # the number of values computed at a time by the executor


class Spec(NamedTuple):
    """The contents of a table.

    `axes` maps numbers and parameters to their values as exact texts, the last axis varying
    fastest; `heads` are the parts of the lines that are known before the values are computed.
    """

    axes: dict[str, list[str]]
    quantities: tuple[str, ...]
    heads: list[dict[str, Any]]


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read and check the specification of a table; an InputError names the file and the key."""
    try:
        with open(path, "rb") as file:
            # Decimals are read as texts, as they stand for exact values.
            return _spec(tomllib.load(file, parse_float=str))
    except (SymasymError, OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is not a valid spec of a table: {error}") from None


def _spec(given: dict[str, Any]) -> Spec:
    """The specification from the contents of its file."""
    of: dict[str, Any] = {n: given[n] for n in ("drift", "expr") if n in given}
    own = given.get("parameters", {})
    unknown = given.keys() - set(_KEYS)
    if len(of) != 1 or unknown or not isinstance(own, dict):
        raise InputError(
            f"{', '.join(unknown) or 'drift or expr, or parameters'}: not valid here; give either "
            f"drift or expr, parameters as a table, and no keys other than {', '.join(_KEYS)}."
        )
    numbers = {name: given[name] for name in _NUMBERS if name in given}
    axes = {n: [number_text(value) for value in _axis(n, x)] for n, x in (numbers | own).items()}
    wanted = sequence("quantities", given.get("quantities", ["T"]))
    names = tuple(choice("quantities", q, QUANTITIES) for q in wanted)
    for name in names:
        taken(name, QUANTITIES[name], **{n: axes.get(n) for n in QUANTITIES[name]})
    count("the number of values", math.prod(map(len, axes.values())) * len(names), 1, _MOST)
    dps = digits(given.get("dps", 50), 10_000 - _GUARD)
    heads: list[dict[str, Any]] = []
    for point, name in itertools.product(itertools.product(*axes.values()), names):
        x = dict(zip(axes, point, strict=True))
        used = {n: x[n] for n in axes if n not in _NUMBERS or n in QUANTITIES[name]}
        heads.append({**of, "quantity": name, "x": used, "dps": dps})
    _drift(heads[0]).scalars()
    return Spec(axes, names, heads)


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


def _drift(head: dict[str, Any]) -> Any:
    values = {n: text for n, text in head["x"].items() if n not in _NUMBERS}
    return named_drift(head.get("drift"), head.get("expr"), values)


def line_of(head: dict[str, Any]) -> bytes:
    """The line with one value and its error, or with the reason why there is no value."""
    name, dps = head["quantity"], head["dps"]
    numbers = {n: head["x"].get(n, 0) for n in QUANTITIES[name]}
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
    spec: Spec, path: str | os.PathLike[str], executor: Executor | None = None
) -> tuple[list[dict[str, Any]], int]:
    """Write or complete the JSON lines of a table, and its CSV and LaTeX files in the same folder.

    Values are computed by the executor, by default in this process. Returns the records of all
    lines and the number of lines that existed before. Raises OutputError if the existing file is
    not an initial part of this table, if a line of it was changed, or if it cannot be written.
    """
    target, heads = Path(path), spec.heads
    run = map if executor is None else executor.map
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "a+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            records = _known(target, file, heads)
            file.truncate()
            done = len(records)
            with progress(target.name, len(heads), done) as bar:
                for low in range(done, len(heads), _AT_ONCE):
                    for line in run(line_of, heads[low : low + _AT_ONCE]):
                        file.write(line)
                        file.flush()
                        records.append(json.loads(line))
                        bar.update()
    except OSError as error:
        raise OutputError(
            f"{target} cannot be written ({error.strerror or error}); make room, choose another "
            "place, or wait for another run that is at work on it."
        ) from None
    rows = _rows(spec, records)
    body = [" & ".join(row).replace("_", r"\_") + r" \\" for row in rows]
    body = [rf"\begin{{tabular}}{{{'l' * len(rows[0])}}}", body[0], r"\hline", *body[1:]]
    lines = {".csv": [",".join(row) for row in rows], ".tex": [*body, r"\end{tabular}"]}
    for kind, text in lines.items():
        write_bytes(target.with_suffix(kind), "\n".join([*text, ""]).encode())
    return records, done


def _known(target: Path, file: IO[bytes], heads: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The records of the complete lines of a file, whose position is then set to their end."""
    file.seek(0)
    found, end = [], 0
    for number, line in enumerate(file):
        if not line.endswith(b"\n"):
            break
        whole = number < len(heads) and line == _sealed(line.rpartition(b', "sum": "')[0])
        record: Any = json.loads(line) if whole else {}
        if not whole or not heads[number].items() <= record.items():
            raise OutputError(
                f"{target}, line {number + 1}, was changed or belongs to another table; it is left "
                "as it is: choose another file, or remove this one."
            )
        found.append(record)
        end += len(line)
    file.seek(end)
    return found


def _rows(spec: Spec, records: list[dict[str, Any]]) -> list[list[str]]:
    """A header, and a row for each point: the inputs, then value, error and decimal logarithm."""
    head = [name for q in spec.quantities for name in (q, f"{q}_error", f"log10_{q}")]
    rows, each = [[*spec.axes, *head]], iter(records)
    for point in itertools.product(*spec.axes.values()):
        row = [*point]
        for record in itertools.islice(each, len(spec.quantities)):
            mid, rad = record["mid"], record["rad"]
            row += ["", "", ""] if mid is None else [mid, rad, f"{Decimal(mid).log10():.16g}"]
        rows.append(row)
    return rows
