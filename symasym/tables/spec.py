"""The TOML file that says what a table holds (see docs/tables.md)."""

from __future__ import annotations

import itertools
import math
import os
import re
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import Any, NoReturn

from symasym.base.call_context import limited, mpf_of, own_context, watched
from symasym.base.errors import InputError, SymasymError
from symasym.base.inputs import choice, digits, exact, float_text, meant, positive
from symasym.base.texts import number_text
from symasym.drift.ready_made.named import named_drift
from symasym.scenes import QUANTITIES

__all__ = ["Spec", "read_spec"]

_STATIONARY = {"P", "1 - P"}
_NUMBERS = ("kappa", "r", "start")
_KEYS = ("drift", "expr", "quantities", "dps", *_NUMBERS, "parameters")
_RANGE = ("from", "to", "points", "step", "spacing")
_MOST = 10_000_000
_MOST_VALUES = 100_000
_MOST_PARAMETERS = 1_000
_MOST_BYTES = 10_000_000
# Seconds of processor time to parse it in.
_PATIENCE = 2
_DPS = 50
# Significant digits of the values of a logarithmic range, which no short text gives exactly.
_LOG_DIGITS = 6


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
    axes : tuple of (str, tuple of str)
        Each parameter and number with its values as exact texts, the last one varying fastest.
    """

    drift: str | None
    expr: str | None
    quantities: tuple[str, ...]
    dps: int
    axes: tuple[tuple[str, tuple[str, ...]], ...]

    @property
    def scenes(self) -> int:
        """Number of points of the grid."""
        return math.prod(len(values) for _, values in self.axes)

    def points(self) -> Iterator[dict[str, str]]:
        """The points of the grid, in order."""
        names = [name for name, _ in self.axes]
        for values in itertools.product(*(values for _, values in self.axes)):
            yield dict(zip(names, values, strict=True))


def read_spec(path: str | os.PathLike[str]) -> Spec:
    """Read a spec and check every value in it.

    Raises
    ------
    InputError
        Naming the line and the key.
    """
    try:
        with Path(path).open("rb") as file:
            data = file.read(_MOST_BYTES + 1)
        text = data[:_MOST_BYTES].decode().replace("\r\n", "\n")
    except OSError as error:
        raise InputError(
            f"{path} cannot be read ({error.strerror}); give the path of a TOML file."
        ) from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is no UTF-8 text; give a TOML file.") from None
    if len(data) > _MOST_BYTES:
        raise InputError(f"{path} has more than {_MOST_BYTES:,} bytes; give axes as ranges.")
    return _Reader(str(path), text).spec()


class _Refused(Exception):
    """A key, by its path, and what is wrong with it."""

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


class _Reader:
    def __init__(self, path: str, text: str) -> None:
        self._path, self._text = path, text
        self._data = self._parse()

    def spec(self) -> Spec:
        """The spec; an `InputError` with the line of the key that is wrong."""
        try:
            return self._checked()
        except _Refused as error:
            line = _line_of(self._text, error.key)
            raise InputError(f"{self._path}, line {line}, {error.key}: {error}") from None

    def _parse(self) -> dict[str, Any]:
        """The TOML as a dict, decimals as they were written."""
        try:
            # A decimal stands for what it says, not for the nearest binary number.
            with limited(_PATIENCE, f"give {self._path} fewer keys and values"), watched():
                return tomllib.loads(self._text, parse_float=str)
        except RecursionError:
            raise InputError(
                f"{self._path} has lists or tables too deep in each other; write it as TOML, "
                "KEY = VALUE."
            ) from None
        except ValueError as error:
            if str(error).startswith("Exceeds the limit"):
                raise InputError(
                    f"{self._path} has a whole number of more than 4,300 digits; rescale the "
                    "problem."
                ) from None
            lines = self._text.splitlines() or [""]
            at = re.search(r"\(at line (\d+), column \d+\)", str(error))
            number = int(at[1]) if at else len(lines)
            about = re.sub(r"\s*\(at .*\)$", "", str(error))
            shown = lines[min(number, len(lines)) - 1].strip()[:60]
            raise InputError(
                f"{self._path}, line {number}, {shown!r}: {about}; write it as TOML, KEY = VALUE."
            ) from None

    def _checked(self) -> Spec:
        """The spec, once each of its keys is right."""
        data = self._data
        for key in data:
            if key not in _KEYS:
                near = meant(key, _KEYS)
                raise _Refused(key, f"there is no such key; the keys are {', '.join(_KEYS)}{near}.")
        quantities = self._quantities()
        axes = tuple(self._axes(quantities))
        spec = Spec(self._name("drift"), self._name("expr"), quantities, self._digits(), axes)
        self._check_drift(spec)
        self._check_starts(dict(axes))
        if spec.scenes * len(quantities) > _MOST:
            raise _Refused(
                axes[-1][0],
                f"the grid has {float_text(Fraction(spec.scenes))} points; make tables of at most "
                f"{_MOST}.",
            )
        return spec

    def _name(self, key: str) -> str | None:
        """The text of a key, None where it is missing."""
        given = self._data.get(key)
        if given is not None and not isinstance(given, str):
            raise _Refused(key, f"it is {given!r}; give a text in quotes.")
        return given

    def _digits(self) -> int:
        """The digits of the table."""
        try:
            return digits(self._data.get("dps", _DPS))
        except SymasymError as error:
            raise _Refused("dps", str(error)) from None

    def _quantities(self) -> tuple[str, ...]:
        """The quantities of the table, each once."""
        given = self._data.get("quantities", ["T"])
        known = ", ".join(f'"{name}"' for name in QUANTITIES)
        if not isinstance(given, list) or not given:
            raise _Refused("quantities", f"it is {given!r}; give a list of some of {known}.")
        names: list[str] = []
        for one in given:
            try:
                name = choice("quantity", one, QUANTITIES)
            except InputError:
                text = f"{one!r} is unknown; the quantities are {known}."
                raise _Refused("quantities", text) from None
            if name in names:
                raise _Refused("quantities", f"{name!r} stands there twice; name it once.")
            names.append(name)
        return tuple(names)

    # -- the grid ----------------------------------------------------------------------------

    def _axes(self, quantities: tuple[str, ...]) -> Iterator[tuple[str, tuple[str, ...]]]:
        """Name and values of each axis of the grid."""
        data, escapes = self._data, not set(quantities) <= _STATIONARY
        for key in ("kappa", "r") if escapes else ("kappa",):
            if key not in data:
                raise _Refused(key, "it is missing; give a number, a list or a range.")
        for key, value in data.items():
            if key in _NUMBERS:
                if key != "kappa" and not escapes:
                    raise _Refused(key, f"{', '.join(quantities)} take none; leave it out.")
                yield key, self._values(key, value, positive_only=key != "start")
            elif key == "parameters":
                if not isinstance(value, dict):
                    raise _Refused(key, f"it is {value!r}; give a table, [parameters].")
                if len(value) > _MOST_PARAMETERS:
                    raise _Refused(
                        key, f"it has {len(value)} parameters; give at most {_MOST_PARAMETERS}."
                    )
                for name, inner in value.items():
                    if name in _NUMBERS:
                        raise _Refused(
                            f"{key}.{name}",
                            "the name is taken by a number of the scene; rename the parameter.",
                        )
                    yield name, self._values(f"{key}.{name}", inner)

    def _values(self, key: str, given: object, positive_only: bool = False) -> tuple[str, ...]:
        """The values of an axis as texts: of a range, a list or a single number."""
        name = key.rpartition(".")[2]
        try:
            if isinstance(given, dict):
                texts = tuple(_range(key, given))
            else:
                listed = given if isinstance(given, list) else [given]
                if len(listed) > _MOST_VALUES:
                    raise _Refused(
                        key, f"it has {len(listed)} values; give at most {_MOST_VALUES} on an axis."
                    )
                texts = tuple(_text(name, x) for x in listed)
            if not texts:
                raise _Refused(key, "the list is empty; give at least one number.")
            for text in texts:
                number = exact(name, text)
                if positive_only:
                    positive(name, number)
        except SymasymError as error:
            raise _Refused(key, str(error)) from None
        return texts

    def _check_drift(self, spec: Spec) -> None:
        """Refuse a drift, a formula or parameters that make no drift."""
        if (spec.drift is None) == (spec.expr is None):
            key = "drift" if spec.drift is None else "expr"
            raise _Refused(key, "give either drift, a ready-made one, or expr, a formula.")
        key = "drift" if spec.expr is None else "expr"
        parameters = {name: values for name, values in spec.axes if name not in _NUMBERS}
        # A formula is checked anew for each value, which takes long; the first of all will do here.
        tried = [*parameters.items()] if spec.expr is None else [*parameters.items()][:1]
        for name, values in tried:
            others = {n: v[0] for n, v in parameters.items() if n != name}
            for text in values if spec.expr is None else values[:1]:
                try:
                    named_drift(spec.drift, spec.expr, {**others, name: text})
                except SymasymError as error:
                    self._blame(str(error), f"parameters.{name}", key)
        try:
            first = {name: values[0] for name, values in parameters.items()}
            named_drift(spec.drift, spec.expr, first).require_bound()
        except SymasymError as error:
            raise _Refused(
                "parameters" if "have no value" in str(error) else key, str(error)
            ) from None

    def _blame(self, message: str, parameter: str, drift: str) -> NoReturn:
        """A message that starts with a parameter's name is about that one."""
        names = [f"parameters.{name}" for name in self._data["parameters"]]
        about = [key for key in names if message.startswith(key.removeprefix("parameters.") + " ")]
        formula = message.startswith(("A ", "A=")) or "ready-made" in message
        raise _Refused(about[0] if about else drift if formula else parameter, message)

    def _check_starts(self, axes: dict[str, tuple[str, ...]]) -> None:
        """Refuse a start that is not inside (-r, r) for every r of the grid."""
        if "r" not in axes:
            return
        least = min(exact("r", text) for text in axes["r"])
        for text in axes.get("start", ()):
            if abs(exact("start", text)) >= least:
                raise _Refused(
                    "start",
                    f"{text} is not inside (-r, r) for r = {float_text(least)}; make it smaller.",
                )


def _text(name: str, given: object) -> str:
    """A number as it was written, once it is known to be one."""
    number = exact(name, given)
    return given.strip() if isinstance(given, str) else number_text(number)


def _range(key: str, given: dict[str, Any]) -> Iterator[str]:
    """The values of ``{from = a, to = b, points = n}`` or ``{from = a, to = b, step = h}``."""
    for name in given:
        if name not in _RANGE:
            raise _Refused(f"{key}.{name}", f"a range has {', '.join(_RANGE)}, and no {name}.")
    for name in ("from", "to"):
        if name not in given:
            raise _Refused(key, f"the range has no {name}; give from, to, and points or step.")
    if ("points" in given) == ("step" in given):
        raise _Refused(key, "a range has either points, how many, or step, how far apart.")
    low, high = (exact(name, given[name]) for name in ("from", "to"))
    if max(x.bit_length() for q in (low, high) for x in (q.numerator, q.denominator)) > 3000:
        raise _Refused(key, "a range that far from 1 has values too long to write; list them.")
    if "step" in given:
        step = exact("step", given["step"])
        if step == 0 or (high - low) / step < 0:
            raise _Refused(key, f"step is {given['step']}, which never gets from {low} to {high}.")
        count = (high - low) // step + 1
    else:
        count, step = _points(key, given["points"]), Fraction(0)
        if count > 1:
            step = (high - low) / (count - 1)
    if count > _MOST_VALUES:
        raise _Refused(
            key,
            f"the range has {float_text(Fraction(count))} values; give at most {_MOST_VALUES} on "
            "an axis.",
        )
    spacing = given.get("spacing", "linear")
    if spacing == "log" and "step" not in given:
        yield from _log_range(key, low, high, count)
    elif spacing == "linear":
        yield from (number_text(low + k * step) for k in range(count))
    else:
        raise _Refused(key, f'spacing is {spacing!r}; give "linear", or with points "log".')


def _points(key: str, given: object) -> int:
    """The number of points of a range."""
    if isinstance(given, bool) or not isinstance(given, int) or given < 1:
        raise _Refused(key, f"points is {given!r}; give a whole number of at least 1.")
    return given


def _log_range(key: str, low: Fraction, high: Fraction, count: int) -> Iterator[str]:
    """The values of a logarithmic range, the ends exact."""
    if low <= 0 or high <= 0:
        raise _Refused(key, "a logarithmic range has from and to greater than 0.")
    with own_context(30) as context:
        first, ratio = mpf_of(low, context), high / low
        growth = context.log(mpf_of(ratio, context))
        for k in range(count):
            if k in (0, count - 1):
                yield number_text(high if k else low)
            else:
                value = first * context.exp(growth * k / (count - 1))
                yield str(context.nstr(value, _LOG_DIGITS))


def _line_of(text: str, wanted: str) -> int:
    """The line of the key with this path; of what it would stand in, where it is missing."""
    table, nearest = "", 1
    for number, line in enumerate(text.splitlines(), 1):
        # No pattern here: a stranger's line may be long.
        key, equals, _ = line.partition("=")
        if line.lstrip().startswith("["):
            here = table = _plain(line.partition("]")[0])
        elif equals:
            here = f"{table}.{_plain(key)}" if table else _plain(key)
        else:
            continue
        if here == wanted or here.startswith(f"{wanted}."):
            return number
        if wanted.startswith(f"{here}."):
            nearest = number
    return nearest


def _plain(key: str) -> str:
    """A key without quotes, spaces and the brackets of a table."""
    return re.sub(r"[\"'\s\[]", "", key)
