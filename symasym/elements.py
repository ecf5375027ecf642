"""Arrays of scenes, so that one element which is refused does not take the others.

Float64 arrays are asked as a whole first. Where that is refused the elements are halved until the
refused ones are alone: with ``errors="raise"`` to name the first of them, with ``errors="nan"`` to
leave it out. With `dps` each element is a scene of its own, in this process or in several.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from symasym.base import executors
from symasym.base.call_context import left, limited
from symasym.base.errors import (
    InputError,
    RegionError,
    SymasymError,
    TimeLimitError,
)
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import IntArray, floats, is_array
from symasym.drift.drift import Drift
from symasym.methods.table import Ask, alone
from symasym.scenes import Request, common_shape

__all__ = ["each"]

# Elements that a process is given at once.
_BATCH = 8
_KINDS: tuple[ErrorKind, ...] = ("none", "estimate", "bound")


def each(
    ask: Ask, drift: Drift, numbers: dict[str, Any], request: Request, workers: int = 1
) -> Any:
    """The answers for all elements of arrays: an array, or an `Estimate` of arrays.

    Parameters
    ----------
    ask : callable
        Gives a float, an mpf, an array or an `Estimate`, as `request` says.
    drift, numbers, request
        As `ask` takes them.
    workers : int
        Processes that share the elements of an array with `dps`.
    """
    if request.dps is not None:
        return _with_digits(ask, _elements(drift, numbers), request, workers)
    try:
        return ask(drift, numbers, request)
    except TimeLimitError:
        raise
    except SymasymError as error:
        if _of_the_question(error, drift, numbers):
            raise
        elements = Elements(drift, numbers)
        if not len(elements):
            raise
        if request.errors == "nan":
            return _spared(ask, elements, request)
        raise _first(ask, elements, request, error) from None


def _of_the_question(error: SymasymError, drift: Drift, numbers: dict[str, Any]) -> bool:
    """True for an error that no element is to blame for: of an option, or of the shapes."""
    if not isinstance(error, InputError) or isinstance(error, RegionError):
        return False
    try:
        _elements(drift, numbers)
    except InputError:
        return True
    arrays = [name for name, x in (numbers | drift.values).items() if is_array(x)]
    return not str(error).startswith(tuple(f"{name} " for name in arrays))


class Elements:
    """The scenes of arrays that broadcast, flat.

    Parameters
    ----------
    drift : Drift
    numbers : dict
        As the caller wrote them.
    """

    def __init__(self, drift: Drift, numbers: dict[str, Any]) -> None:
        self._drift, self._numbers = drift, numbers
        # Texts and exact numbers in a list stay what they are.
        given = {
            name: x if isinstance(x, np.ndarray) else np.array(x, dtype=object)
            for name, x in (drift.values | numbers).items()
            if is_array(x)
        }
        shapes = {name: x.shape for name, x in given.items() if name in numbers}
        self.shape = common_shape(drift, shapes)
        self._flat = {n: np.broadcast_to(x, self.shape).ravel() for n, x in given.items()}

    def __len__(self) -> int:
        return int(np.prod(self.shape))

    def part(self, rows: IntArray | int) -> tuple[Drift, dict[str, Any]]:
        """Drift and numbers of some elements; of a single row they are no arrays."""
        some = {name: x[rows] for name, x in self._flat.items()}
        bound = {name: x for name, x in some.items() if name in self._drift.values}
        drift = self._drift.bind(**bound) if bound else self._drift
        return drift, {name: some.get(name, x) for name, x in self._numbers.items()}


def _elements(drift: Drift, numbers: dict[str, Any]) -> Elements:
    """The elements; an error where an array is none, or where they do not broadcast."""
    for name, x in numbers.items():
        if is_array(x):
            try:
                array = np.asarray(x)
            except ValueError:
                array = np.empty(0)
            if not array.size or array.dtype.kind not in "iufOUS":
                floats(name, x)
    return Elements(drift, numbers)


def _first(ask: Ask, elements: Elements, request: Request, error: SymasymError) -> SymasymError:
    """The error of the first element that is refused, with its index."""
    rows = np.arange(len(elements))
    while len(rows) > 1:
        low = rows[: len(rows) // 2]
        try:
            ask(*elements.part(low), request)
        except TimeLimitError:
            raise
        except SymasymError:
            rows = low
        else:
            rows = rows[len(low) :]
    try:
        ask(*elements.part(rows), request)
    except SymasymError as alone:
        index = ", ".join(map(str, np.unravel_index(rows[0], elements.shape)))
        return type(alone)(
            f"at index ({index}), {str(alone).rstrip('.')}; errors='nan' leaves such elements out."
        )
    return error


def _spared(ask: Ask, elements: Elements, request: Request) -> Any:
    """The answers of those elements that are not refused; nan for the others."""
    parts: list[tuple[IntArray, Any]] = []
    refusals: list[SymasymError] = []
    pending = [np.arange(len(elements))]
    while pending:
        rows = pending.pop()
        try:
            parts.append((rows, ask(*elements.part(rows), request)))
        except TimeLimitError:
            raise
        except SymasymError as error:
            if len(rows) > 1:
                middle = len(rows) // 2
                pending += [rows[:middle], rows[middle:]]
            else:
                refusals.append(error)
    if not parts and all(isinstance(e, InputError) for e in refusals):
        raise refusals[0]
    value, wrong = (np.full(len(elements), np.nan) for _ in range(2))
    for rows, answer in parts:
        value[rows] = answer.value if request.full else answer
        if request.full and answer.error is not None:
            wrong[rows] = answer.error
    shape = elements.shape
    if not request.full:
        return value.reshape(shape)
    return _joined([x for _, x in parts], value.reshape(shape), wrong.reshape(shape), request)


def _joined(estimates: list[Any], value: Any, error: Any, request: Request) -> Estimate:
    """One estimate of all elements; of the weakest kind, with what any of them adds or drops."""
    kinds = {x.error_kind for x in estimates} or {"none"}
    kind = next(k for k in _KINDS if k in kinds)
    terms, dropped = (
        tuple(dict.fromkeys(t for x in estimates for t in getattr(x, name)))
        for name in ("terms", "dropped")
    )
    methods = {x.method for x in estimates} or {request.method}
    orders = {x.order for x in estimates}
    mask = np.array([x != x for x in value.ravel()], dtype=bool).reshape(value.shape)
    return Estimate(
        value,
        None if kind == "none" else error,
        kind,
        methods.pop() if len(methods) == 1 else request.method,
        orders.pop() if len(orders) == 1 else None,
        terms,
        dropped,
        mask,
    )


# -- with digits -----------------------------------------------------------------------------------


def _with_digits(ask: Ask, elements: Elements, request: Request, workers: int) -> Any:
    """Each element to `request.dps` digits, in an array of objects."""
    answers: list[Any] = []
    with executors.local(workers) as executor:
        futures = [
            executor.submit(_batch, ask, [elements.part(int(row)) for row in rows], request, left())
            for rows in _batches(len(elements))
        ]
        for future in futures:
            answers += future.result()
    for row, one in enumerate(answers):
        if isinstance(one, SymasymError):
            index = ", ".join(map(str, np.unravel_index(row, elements.shape)))
            raise type(one)(f"at index ({index}), {one}")
    values = np.empty(len(elements), dtype=object)
    values[:] = [x.value for x in answers] if request.full else answers
    if not request.full:
        return values.reshape(elements.shape)
    wrong = np.empty(len(elements), dtype=object)
    wrong[:] = [x.error for x in answers]
    shape = elements.shape
    known = [x for x in answers if x.mask is None]
    return _joined(known, values.reshape(shape), wrong.reshape(shape), request)


def _batches(count: int) -> Iterator[range]:
    """Rows that are asked for together."""
    for low in range(0, count, _BATCH):
        yield range(low, min(low + _BATCH, count))


def _batch(
    ask: Ask, scenes: list[tuple[Drift, dict[str, Any]]], request: Request, seconds: float
) -> list[Any]:
    """The answers for some scenes, in so many seconds; the first error ends them."""
    answers: list[Any] = []
    with limited(seconds):
        for drift, numbers in scenes:
            try:
                answers.append(alone(ask, drift, numbers, request))
            except SymasymError as error:
                return [*answers, error]
    return answers
