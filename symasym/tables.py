"""Reference tables: the exact values of a grid as JSON lines, CSV and LaTeX (docs/command-line.md).

The lines are written in the order of the grid, so that at any moment the file is the beginning of
the finished one; a run that was stopped, however, goes on behind the last whole line. Each line
ends with a checksum of itself.
"""

from __future__ import annotations

import fcntl
import hashlib
import itertools
import json
import math
import os
import tomllib
from collections.abc import Mapping
from concurrent.futures import Executor
from decimal import Decimal
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import IO, Any, NamedTuple

from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.estimate import number_text
from symasym.base.files import progress, reference_value, write_bytes
from symasym.base.inputs import choice, count, digits, exact, positive, sequence, taken
from symasym.drift.ready_made import named_drift
from symasym.drift.scenes import QUANTITIES
from symasym.quantities import call_named

_NUMBERS = ("kappa", "r", "start")
_KEYS = (*_NUMBERS, "drift", "expr", "quantities", "dps", "parameters")
_MOST = 10_000_000  # values of a table
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded right
_AT_ONCE = 256  # values that are asked for before the first of them is written


class Spec(NamedTuple):
    """The contents of a table.

    `of` is {"drift": the name of a ready-made one} or {"expr": a formula}; `axes` are the numbers
    and parameters, each with its values as exact texts, the last one varying fastest.
    """

    of: dict[str, str]
    quantities: tuple[str, ...]
    dps: int
    axes: dict[str, list[str]]

    def points(self) -> list[dict[str, str]]:
        """The points of the grid, in order."""
        each = itertools.product(*self.axes.values())
        return [dict(zip(self.axes, values, strict=True)) for values in each]

    def drift_at(self, x: Mapping[str, str]) -> Any:
        """The drift at a point."""
        values = {name: text for name, text in x.items() if name not in _NUMBERS}
        return named_drift(self.of.get("drift"), self.of.get("expr"), values)


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read a spec and check its keys and values; an InputError names the file and the key."""
    try:
        with open(path, "rb") as file:
            # A decimal stands for what it says, not for the nearest binary number.
            return _spec(tomllib.load(file, parse_float=str))
    except (SymasymError, OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise InputError(f"{path} is no spec of a table: {error}") from None


def _spec(given: dict[str, Any]) -> Spec:
    """The spec of what a file says."""
    of: dict[str, str] = {n: given[n] for n in ("drift", "expr") if n in given}
    own = given.get("parameters", {})
    unknown = given.keys() - set(_KEYS)
    if len(of) != 1 or unknown or not isinstance(own, dict):
        raise InputError(
            f"{', '.join(unknown) or 'drift or expr, or parameters'} are not as they should be; "
            f"give either drift or expr, parameters as a table, and of the rest {', '.join(_KEYS)}."
        )
    numbers = {name: given[name] for name in _NUMBERS if name in given}
    axes = {
        name: [number_text(value) for value in _axis(name, x)]
        for name, x in (numbers | own).items()
    }
    wanted = sequence("quantities", given.get("quantities", ["T"]))
    names = tuple(choice("quantities", q, QUANTITIES) for q in wanted)
    for name in names:
        taken(name, QUANTITIES[name].numbers, {n: axes.get(n) for n in QUANTITIES[name].numbers})
    count("the number of values", math.prod(map(len, axes.values())) * len(names), 1, _MOST)
    spec = Spec(of, names, digits(given.get("dps", 50), 10_000 - _GUARD), axes)
    spec.drift_at({name: values[0] for name, values in axes.items()}).scalars()
    return spec


def _axis(name: str, given: Any) -> list[Fraction]:
    """The values of one number, a list of them, or a range."""
    if not isinstance(given, dict):
        return [exact(name, x) for x in (given if isinstance(given, list) else [given])]
    low, high = (exact(f"{name}.{end}", given.get(end)) for end in ("from", "to"))
    points = count(f"{name}.points", given.get("points"), 2, _MOST)
    parts = [Fraction(k, points - 1) for k in range(points)]
    if choice(f"{name}.spacing", given.get("spacing", "linear"), ("linear", "log")) == "linear":
        return [low + x * (high - low) for x in parts]
    ratio = float(positive(name, high)) / float(positive(name, low))
    return [low, *(Fraction(f"{float(low) * ratio ** float(x):.6g}") for x in parts[1:-1]), high]


def line_of(spec: Spec, quantity: str, x: Mapping[str, str]) -> bytes:
    """The line of one value, with its error; with a reason where there is none."""
    record = _head(spec, quantity, x)
    try:
        found = call_named(quantity, spec.drift_at(x), x, dps=spec.dps + _GUARD, full=True)
        record |= reference_value(record["x"], found, spec.dps)
    except SymasymError as error:
        record |= {"mid": None, "rad": None, "refused": str(error)}
    return _sealed(json.dumps(record)[:-1].encode())


def _head(spec: Spec, quantity: str, x: Mapping[str, str]) -> dict[str, Any]:
    """What a line says of its value beforehand."""
    used = {n: t for n, t in x.items() if n not in _NUMBERS or n in QUANTITIES[quantity].numbers}
    return {**spec.of, "quantity": quantity, "x": used, "dps": spec.dps}


def _sealed(text: bytes) -> bytes:
    """The line of a record without its last brace: with a checksum instead."""
    return text + b', "sum": "' + hashlib.sha256(text).hexdigest()[:16].encode() + b'"}\n'


def write_table(
    spec: Spec, path: str | os.PathLike[str], executor: Executor | None = None
) -> tuple[list[dict[str, Any]], int]:
    """Make a table's JSON lines, or what is missing of them; CSV and LaTeX files go beside them.

    Values are computed by the executor, here if it is left out. Given are the records of the lines,
    and how many of them were there before. An OutputError says that the file is no beginning of
    this table, that a line of it was changed, or that it can't be written.
    """
    target = Path(path)
    asked = [(q, x) for x in spec.points() for q in spec.quantities]
    run = map if executor is None else executor.map
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "a+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            records = _known(target, file, spec, asked)
            file.truncate()
            done = len(records)
            with progress(target.name, len(asked), done) as bar:
                for low in range(done, len(asked), _AT_ONCE):
                    some = zip(*asked[low : low + _AT_ONCE], strict=True)
                    for line in run(partial(line_of, spec), *some):
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


def _known(target: Path, file: IO[bytes], spec: Spec, asked: list[Any]) -> list[dict[str, Any]]:
    """The records of the whole lines of a file, which is left behind the last of them."""
    file.seek(0)
    found, end = [], 0
    for number, line in enumerate(file):
        if not line.endswith(b"\n"):
            break
        text = line.rpartition(b', "sum": "')[0]
        record: Any = json.loads(line) if line == _sealed(text) else {}
        head = _head(spec, *asked[number]) if number < len(asked) else None
        if head is None or not head.items() <= record.items():
            raise OutputError(
                f"{target}, line {number + 1}, was changed or belongs to another table; it is left "
                "as it is: choose another file, or remove this one."
            )
        found.append(record)
        end += len(line)
    file.seek(end)
    return found


def _rows(spec: Spec, records: list[dict[str, Any]]) -> list[list[str]]:
    """A head, and a row for each point: the inputs, then value, error and decimal logarithm."""
    head = [name for q in spec.quantities for name in (q, f"{q}_error", f"log10_{q}")]
    rows, each = [[*spec.axes, *head]], iter(records)
    for x in spec.points():
        row = [*x.values()]
        for record in itertools.islice(each, len(spec.quantities)):
            mid, rad = record["mid"], record["rad"]
            row += ["", "", ""] if mid is None else [mid, rad, f"{Decimal(mid).log10():.16g}"]
        rows.append(row)
    return rows
