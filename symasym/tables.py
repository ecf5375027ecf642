"""Reference tables: the exact values of a grid as JSON lines, CSV and LaTeX (docs/command-line.md).

The lines are written in the order of the grid, so that at any moment the file is the beginning of
the finished one; a run that was stopped, however, goes on behind the last whole line. Each line
ends with a checksum of itself.
"""

from __future__ import annotations

import csv
import fcntl
import hashlib
import io
import itertools
import json
import math
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import IO, Any, NamedTuple

from symasym.base import progress
from symasym.base.errors import InputError, OutputError, SymasymError
from symasym.base.files import reference_value, write_bytes
from symasym.base.inputs import choice, digits, exact
from symasym.base.texts import number_text
from symasym.drift.ready_made.named import named_drift
from symasym.quantities import call_named
from symasym.scenes import QUANTITIES

__all__ = ["Outcome", "Spec", "read_spec", "write_table"]

_KEYS = ("drift", "expr", "quantities", "dps", "kappa", "r", "start", "parameters")
_NUMBERS = ("kappa", "r", "start")
_MOST_BYTES, _MOST = 10_000_000, 10_000_000
_GUARD = 5  # digits beyond those printed, so that the last printed one is rounded right
_AT_ONCE = 256  # values that are asked for before the first of them is written
_SUM = re.compile(rb', "sum": "(\w{16})"}$')


@dataclass(frozen=True)
class Spec:
    """The contents of a table.

    Attributes
    ----------
    drift, expr : str or None
        Name of a ready-made drift, or a formula.
    quantities : tuple of str
        Keys of `symasym.scenes.QUANTITIES`.
    dps : int
    axes : dict of str to tuple of str
        Each number and parameter with its values as exact texts, the last one varying fastest.
    """

    drift: str | None
    expr: str | None
    quantities: tuple[str, ...]
    dps: int
    axes: Mapping[str, tuple[str, ...]]

    def points(self) -> Iterator[dict[str, str]]:
        """The points of the grid, in order."""
        for values in itertools.product(*self.axes.values()):
            yield dict(zip(self.axes, values, strict=True))

    @property
    def size(self) -> int:
        """Number of values."""
        return math.prod(map(len, self.axes.values())) * len(self.quantities)


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read a spec and check its keys and values.

    Raises
    ------
    InputError
        Naming the file and the key.
    """
    try:
        data = Path(path).read_bytes()[:_MOST_BYTES].decode()
        # A decimal stands for what it says, not for the nearest binary number.
        given = tomllib.loads(data, parse_float=str)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path} is no TOML file ({error}); see docs/command-line.md.") from None
    unknown = [key for key in given if key not in _KEYS]
    if unknown or "kappa" not in given or ("drift" in given) == ("expr" in given):
        raise InputError(
            f"{path} has the keys {', '.join(given)}; give kappa, either drift or expr, and of "
            f"{', '.join(_KEYS)} what else is needed."
        )
    name = ""
    try:
        parameters = given.get("parameters", {})
        axes = {}
        for name, x in [*((n, given[n]) for n in _NUMBERS if n in given), *parameters.items()]:
            axes[name] = tuple(number_text(value) for value in _axis(name, x))
        name = "quantities"
        quantities = tuple(choice(name, q, QUANTITIES) for q in given.get(name, ["T"]))
        name = "dps"
        spec = Spec(
            given.get("drift"), given.get("expr"), quantities, digits(given.get("dps", 50)), axes
        )
        name = "parameters"
        first = next(spec.points())
        _drift_of(spec, first).scalars()
        if spec.size > _MOST:
            raise InputError(f"there are {spec.size:,} values; give at most {_MOST:,}.")
        wanting = [
            n for q in quantities for n in QUANTITIES[q].numbers if n not in (*axes, "start")
        ]
        if wanting:
            name = wanting[0]
            raise InputError(f"{', '.join(quantities)} need {name}, which is not given.")
    except (SymasymError, TypeError, AttributeError) as error:
        raise InputError(f"{path}, {name}: {error}") from None
    return spec


def _axis(name: str, given: Any) -> list[Fraction]:
    """The values of one number, a list of them, or a range."""
    if not isinstance(given, dict):
        several = isinstance(given, list) and given
        return [exact(name, x) for x in (given if several else [given])]
    low, high = (exact(f"{name}.{end}", given.get(end)) for end in ("from", "to"))
    if "step" in given:
        step = exact(f"{name}.step", given["step"])
        count = (high - low) / step if step else Fraction(1, 2)
        if count.denominator > 1 or not 0 <= count < _MOST:
            raise InputError(f"step is {step}; give one that leads from {low} to {high}.")
        return [low + k * step for k in range(int(count) + 1)]
    count = exact(f"{name}.points", given.get("points", 0))
    if count.denominator > 1 or not 2 <= count <= _MOST:
        raise InputError(f"points is {count}; give a whole number of at least 2, or a step.")
    parts = [Fraction(k, int(count) - 1) for k in range(int(count))]
    if choice("spacing", given.get("spacing", "linear"), ("linear", "log")) == "linear":
        return [low + x * (high - low) for x in parts]
    if not 0 < low < high:
        raise InputError(f"spacing is log from {low} to {high}; give ends above 0.")
    between = (float(low) * (float(high) / float(low)) ** float(x) for x in parts[1:-1])
    return [low, *(Fraction(f"{x:.6g}") for x in between), high]


# -- values ----------------------------------------------------------------------------------------


def _drift_of(spec: Spec, x: Mapping[str, str]) -> Any:
    values = {name: text for name, text in x.items() if name not in _NUMBERS}
    return named_drift(spec.drift, spec.expr, values)


def line_of(spec: Spec, quantity: str, x: Mapping[str, str]) -> bytes:
    """The line of one value, with its error; with a reason where there is none."""
    what = {"drift": spec.drift} if spec.drift else {"expr": spec.expr}
    numbers = {n: x[n] for n in QUANTITIES[quantity].numbers if n in x}
    inputs = {n: text for n, text in x.items() if n not in _NUMBERS or n in numbers}
    record: dict[str, Any] = {**what, "quantity": quantity}
    try:
        found = call_named(quantity, _drift_of(spec, x), numbers, dps=spec.dps + _GUARD, full=True)
        record |= reference_value(inputs, found, spec.dps)
    except SymasymError as error:
        record |= {"x": inputs, "mid": None, "rad": None, "dps": spec.dps, "refused": str(error)}
    text = json.dumps(record)[:-1].encode()
    return text + b', "sum": "' + hashlib.sha256(text).hexdigest()[:16].encode() + b'"}\n'


def _record(line: bytes) -> dict[str, Any] | None:
    """A line's content; None where its checksum is not its own."""
    found = _SUM.search(line.rstrip(b"\n"))
    if not found or hashlib.sha256(line[: found.start()]).hexdigest()[:16].encode() != found[1]:
        return None
    record: dict[str, Any] = json.loads(line)
    return record


class Outcome(NamedTuple):
    """The files, the number of values, of those made in this run, and of those without a number."""

    path: Path
    csv: Path
    tex: Path
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
    """Make a table, or what is missing of it.

    Parameters
    ----------
    spec : Spec
    path : path
        Of the JSON lines; a CSV file and a LaTeX table go beside it.
    executor : concurrent.futures.Executor, optional
        Where the values are computed; here if left out.
    force : bool
        Make everything again.

    Raises
    ------
    OutputError
        If the file is no beginning of this table, a line of it was changed, another run is at
        work on it, or it can't be written.
    """
    target = Path(path)
    beside = target.with_suffix(".csv"), target.with_suffix(".tex")
    asked = [(q, x) for x in spec.points() for q in spec.quantities]
    run = map if executor is None else executor.map
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with open(target, "a+b") as file:
            fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            records = [] if force else _known(target, file, spec, asked)
            file.truncate(0 if force else file.tell())
            done = len(records)
            with progress.stage(target.name, len(asked), done=done, every=10.0) as step:
                for low in range(done, len(asked), _AT_ONCE):
                    some = asked[low : low + _AT_ONCE]
                    specs, quantities, points = [spec] * len(some), *zip(*some, strict=True)
                    for line in run(line_of, specs, quantities, points):
                        file.write(line)
                        file.flush()
                        records.append(_record(line))
                        step()
    except BlockingIOError:
        raise OutputError(f"{target} is being written by another run; wait for it.") from None
    except OSError as error:
        if isinstance(error, OutputError):
            raise
        raise OutputError(f"{target} cannot be written ({error.strerror or error}).") from None
    rows = _rows(spec, [r for r in records if r])
    for name, text in zip(beside, (_csv(rows), _tex(rows)), strict=True):
        write_bytes(name, text.encode())
    refused = sum(r is not None and r["mid"] is None for r in records)
    return Outcome(target, *beside, len(asked), len(asked) - done, refused)


def _known(target: Path, file: IO[bytes], spec: Spec, asked: list[Any]) -> list[Any]:
    """The records of the whole lines of a file, which is left behind the last of them."""
    file.seek(0)
    found, end = [], 0
    for number, line in enumerate(file):
        if not line.endswith(b"\n"):
            break
        record: Any = _record(line)
        quantity, x = asked[number] if number < len(asked) else ("", {})
        same = record and record["quantity"] == quantity and record["dps"] == spec.dps
        if not (same and record["x"].items() <= x.items() and
                (record.get("drift"), record.get("expr")) == (spec.drift, spec.expr)):  # fmt: skip
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
    head = [*spec.axes]
    for q in spec.quantities:
        head += [q, f"{q}_error", f"log10_{q}"]
    rows, each = [head], iter(records)
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


def _csv(rows: list[list[str]]) -> str:
    out = io.StringIO()
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue()


def _tex(rows: list[list[str]]) -> str:
    """The rows as a LaTeX table."""
    body = [" & ".join(x.replace("_", r"\_") for x in row) + r" \\" for row in rows]
    lines = [rf"\begin{{tabular}}{{{'l' * len(rows[0])}}}", body[0], r"\hline", *body[1:]]
    return "\n".join([*lines, r"\end{tabular}", ""])
