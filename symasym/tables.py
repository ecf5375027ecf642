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
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from fractions import Fraction
from functools import partial
from pathlib import Path
from typing import IO, Any, NamedTuple

from symasym.base import progress
from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.files import reference_value, write_bytes
from symasym.base.inputs import choice, digits, exact, sequence
from symasym.base.texts import number_text
from symasym.drift.ready_made import named_drift
from symasym.drift.scenes import QUANTITIES
from symasym.quantities import call_named

__all__ = ["Outcome", "Spec", "read_spec", "write_table"]

_NUMBERS = ("kappa", "r", "start")
_KEYS = (*_NUMBERS, "drift", "expr", "quantities", "dps", "parameters")
_MOST = 10_000_000  # values of a table
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded right
_AT_ONCE = 256  # values that are asked for before the first of them is written


class Spec(NamedTuple):
    """The contents of a table.

    `drift` is the name of a ready-made one, or None where `expr` is its formula; `axes` are the
    numbers and parameters, each with its values as exact texts, the last one varying fastest.
    """

    drift: str | None
    expr: str | None
    quantities: tuple[str, ...]
    dps: int
    axes: dict[str, list[str]]

    def points(self) -> Iterator[dict[str, str]]:
        """The points of the grid, in order."""
        for values in itertools.product(*self.axes.values()):
            yield dict(zip(self.axes, values, strict=True))

    def drift_at(self, x: Mapping[str, str]) -> Any:
        """The drift at a point."""
        values = {name: text for name, text in x.items() if name not in _NUMBERS}
        return named_drift(self.drift, self.expr, values)


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read a spec and check its keys and values; an InputError names the file and the key."""
    try:
        with open(path, "rb") as file:
            # A decimal stands for what it says, not for the nearest binary number.
            return _spec(tomllib.load(file, parse_float=str))
    except SymasymError as error:
        raise InputError(f"{path}: {error}") from None
    except (OSError, ValueError, TypeError, AttributeError, RecursionError) as error:
        told = f"{path} is no spec of a table ({error}); see docs/command-line.md."
        raise InputError(told) from None


def _spec(given: dict[str, Any]) -> Spec:
    """The spec of what a file says."""
    needed = "kappa" in given and ("drift" in given) != ("expr" in given)
    if not (needed and given.keys() <= set(_KEYS)):
        raise InputError(
            f"the keys are {', '.join(given)}; give kappa, either drift or expr, and of "
            f"{', '.join(_KEYS)} what else is needed."
        )
    numbers = {name: given[name] for name in _NUMBERS if name in given}
    axes = {
        name: [number_text(value) for value in _axis(name, x)]
        for name, x in (numbers | given.get("parameters", {})).items()
    }
    wanted = sequence("quantities", given.get("quantities", ["T"]))
    names = tuple(choice("quantities", q, QUANTITIES) for q in wanted)
    spec = Spec(given.get("drift"), given.get("expr"), names, digits(given.get("dps", 50)), axes)
    spec.drift_at(next(spec.points())).scalars()
    if (size := math.prod(map(len, axes.values())) * len(names)) > _MOST:
        raise InputError(f"there are {size:,} values; give at most {_MOST:,}.")
    if wanting := [n for q in names for n in QUANTITIES[q].numbers if n not in (*axes, "start")]:
        raise InputError(f"{', '.join(names)} need {wanting[0]}, which is not given; give it.")
    return spec


def _axis(name: str, given: Any) -> list[Fraction]:
    """The values of one number, a list of them, or a range."""
    if not isinstance(given, dict):
        several = isinstance(given, list) and given
        return [exact(name, x) for x in (given if several else [given])]
    low, high = (exact(f"{name}.{end}", given.get(end)) for end in ("from", "to"))
    if "step" in given:
        step = exact(f"{name}.step", given["step"])
        count, least = (high - low) / step + 1 if step else Fraction(0), 1
    else:
        count, least = exact(f"{name}.points", given.get("points", 0)), 2
    if count.denominator > 1 or not least <= count <= _MOST:
        raise InputError(
            f"{name} has {count} points from {low} to {high}; give a whole number of them, at "
            "least 2, or a step that leads from one end to the other."
        )
    parts = [Fraction(k, max(int(count) - 1, 1)) for k in range(int(count))]
    if choice(f"{name}.spacing", given.get("spacing", "linear"), ("linear", "log")) == "linear":
        return [low + x * (high - low) for x in parts]
    if not 0 < low < high:
        raise InputError(f"{name} is log from {low} to {high}; give ends above 0.")
    between = (float(low) * (float(high) / float(low)) ** float(x) for x in parts[1:-1])
    return [low, *(Fraction(f"{x:.6g}") for x in between), high]


def line_of(spec: Spec, quantity: str, x: Mapping[str, str]) -> bytes:
    """The line of one value, with its error; with a reason where there is none."""
    numbers = {n: x[n] for n in QUANTITIES[quantity].numbers if n in x}
    record = _head(spec, quantity, x)
    try:
        found = call_named(quantity, spec.drift_at(x), numbers, dps=spec.dps + _GUARD, full=True)
        record |= reference_value(record["x"], found, spec.dps)
    except SymasymError as error:
        record |= {"mid": None, "rad": None, "dps": spec.dps, "refused": str(error)}
    text = json.dumps(record)[:-1].encode()
    return text + b', "sum": "' + _sum(text) + b'"}\n'


def _head(spec: Spec, quantity: str, x: Mapping[str, str]) -> dict[str, Any]:
    """What a line says of its value beforehand."""
    what = {"drift": spec.drift} if spec.drift else {"expr": spec.expr}
    used = {n: t for n, t in x.items() if n not in _NUMBERS or n in QUANTITIES[quantity].numbers}
    return {**what, "quantity": quantity, "x": used}


def _sum(text: bytes) -> bytes:
    return hashlib.sha256(text).hexdigest()[:16].encode()


class Outcome(NamedTuple):
    """The files, the number of values, of those made in this run, and of those without a number."""

    files: tuple[Path, ...]
    values: int
    made: int
    refused: int


def write_table(
    spec: Spec,
    path: str | os.PathLike[str],
    *,
    executor: Executor | None = None,
    force: bool = False,
) -> Outcome:
    """Make a table's JSON lines, or what is missing of them; a CSV and a LaTeX file go beside them.

    Values are computed by the executor, here if it is left out; with `force` all of them again.
    An OutputError says that the file is no beginning of this table, a line of it was changed,
    another run is at work on it, or it can't be written.
    """
    target = Path(path)
    files = target, target.with_suffix(".csv"), target.with_suffix(".tex")
    asked = [(q, x) for x in spec.points() for q in spec.quantities]
    run = map if executor is None else executor.map
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "a+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            records = [] if force else _known(target, file, spec, asked)
            file.truncate(0 if force else file.tell())
            done = len(records)
            with progress.stage(target.name, len(asked), done=done) as step:
                for low in range(done, len(asked), _AT_ONCE):
                    some = zip(*asked[low : low + _AT_ONCE], strict=True)
                    for line in run(partial(line_of, spec), *some):
                        file.write(line)
                        file.flush()
                        records.append(json.loads(line))
                        step()
    except BlockingIOError:
        raise OutputError(f"{target} is being written by another run; wait for it.") from None
    except OutputError:
        raise
    except OSError as error:
        raise OutputError(f"{target} cannot be written ({error.strerror or error}).") from None
    rows = _rows(spec, records)
    body = [" & ".join(row).replace("_", r"\_") + r" \\" for row in rows]
    body = [rf"\begin{{tabular}}{{{'l' * len(rows[0])}}}", body[0], r"\hline", *body[1:]]
    lines = [",".join(row) for row in rows], [*body, r"\end{tabular}"]
    for name, text in zip(files[1:], lines, strict=True):
        write_bytes(name, "\n".join([*text, ""]).encode())
    refused = sum(record["mid"] is None for record in records)
    return Outcome(files, len(asked), len(asked) - done, refused)


def _known(target: Path, file: IO[bytes], spec: Spec, asked: list[Any]) -> list[Any]:
    """The records of the whole lines of a file, which is left behind the last of them."""
    file.seek(0)
    found, end = [], 0
    for number, line in enumerate(file):
        if not line.endswith(b"\n"):
            break
        text, _, last = line.rpartition(b', "sum": "')
        record: Any = json.loads(line) if last == _sum(text) + b'"}\n' else {}
        head = _head(spec, *asked[number]) | {"dps": spec.dps} if number < len(asked) else None
        if head is None or not head.items() <= record.items():
            raise OutputError(
                f"{target}, line {number + 1}, was changed or belongs to another table; it is left "
                "as it is: choose another file, or make it anew with --force."
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
            mid = record["mid"]
            row += ["", "", ""] if mid is None else [mid, record["rad"], _log10(mid)]
        rows.append(row)
    return rows


def _log10(text: str) -> str:
    mantissa, _, power = text.lower().partition("e")
    return repr(math.log10(float(mantissa)) + int(power or 0)) if float(mantissa) > 0 else ""
