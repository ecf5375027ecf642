"""The methods with what each of them answers, and the driver of all of them.

A method is a record of this table. Its module, loaded when the method is first asked, has the
steps:

``of_scene(scene, request)``
    the `Answer` for one scene in exact numbers, to ``request.digits`` digits;
``of_scenes(scenes, request)``
    the `Answers` for scenes in float64.

Reading the scene before and handing the answer back after is the one driver's, `answer`.

`each` asks for arrays, so that one element which is refused does not take the others. Float64
arrays are asked as a whole first. Where that is refused, and not for any element, the elements are
halved until the refused ones are alone: with ``errors="raise"`` to name the first of them, with
``errors="nan"`` to leave it out. With `dps` each element is a scene of its own, in this process or
in several.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from symasym.base import executors
from symasym.base.call_context import left, limited
from symasym.base.errors import (
    AccuracyError,
    InputError,
    RegionError,
    SymasymError,
    TimeLimitError,
)
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import (
    IntArray,
    Number,
    exact,
    float_text,
    floats,
    is_array,
    meant,
    shown,
)
from symasym.drift.drift import Drift
from symasym.scenes import (
    QUANTITIES,
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    as_digits,
    as_floats,
    common_shape,
    float_scenes,
    one_scene,
    quantity_of,
    read_order,
    read_scene,
    require_drift,
)

__all__ = [
    "METHODS", "Ask", "Method", "alone", "answer", "each", "require_drift_of", "require_method",
]  # fmt: skip

# Elements that a process is given at once.
_BATCH = 8
# Elements that are asked one by one where all may be refused.
_SAMPLE = 16
_KINDS: tuple[ErrorKind, ...] = ("none", "estimate", "bound")

#: A question about one drift and its numbers.
Ask = Callable[[Drift, dict[str, Any], Request], Any]


@dataclass(frozen=True)
class Method:
    """A method of the table.

    Attributes
    ----------
    name : str
    quantities : tuple of str
        Names of the quantities that it answers.
    module : str
        The module with its steps.
    about : str
        What it gives, in a line.
    orders : tuple of int or None
        Of an expansion: the order that is taken where none is given, and the highest.
    optimal : bool
        The order may be ``"optimal"``: the series diverges.
    in_float : callable
        Of a drift and a request: True where one scene is answered in float64, like many.
    in_floats : str
        The module with the step for many scenes, where it is another one.
    """

    name: str
    quantities: tuple[str, ...]
    module: str
    about: str
    orders: tuple[int, int] | None = None
    optimal: bool = False
    in_float: Callable[[Drift, Request], bool] = lambda drift, request: False
    in_floats: str = ""

    def of_scene(self, scene: Scene, request: Request) -> Answer:
        """The answer for one scene."""
        step = importlib.import_module(self.module).of_scene
        return cast(Answer, step(scene, request))

    def of_scenes(self, scenes: Scenes, request: Request) -> Answers:
        """The answers for many."""
        step = importlib.import_module(self.in_floats or self.module).of_scenes
        return cast(Answers, step(scenes, request))

    def with_order(self, request: Request) -> Request:
        """The request with an order that this method has; with all of them for ``"optimal"``."""
        order = request.order
        if self.orders is None:
            if order is not None:
                raise InputError(
                    f"order is {shown(order)}, but method {self.name!r} has no order; leave it out."
                )
            return request
        if self.optimal and isinstance(order, str) and order == "optimal":
            return request._replace(order=range(self.orders[1] + 1))
        return request._replace(order=read_order(order, *self.orders))


def _without_error(drift: Drift, request: Request) -> bool:
    """True where no error is asked for, which the exact value has from more digits."""
    return not request.full


#: Of kappa^2: the order where none is given, and the highest.
WEAK_NOISE_ORDERS = (2, 20)

_ALL = tuple(QUANTITIES)

#: By their names, in the order in which messages list them.
METHODS = {method.name: method for method in (
    Method("exact", (*_ALL, "p_ss"), "symasym.exact.balls", "the integral, nothing dropped",
           in_float=_without_error, in_floats="symasym.exact.floats"),
    Method("paper", _ALL, "symasym.paper", "the paper's own leading order"),
    Method("laplace", _ALL, "symasym.expansions.answer", "weak noise, in powers of kappa^2",
           WEAK_NOISE_ORDERS, optimal=True),
    Method("uniform", _ALL, "symasym.expansions.uniform",
           "weak noise, also where wells, barriers, the start or an end meet", (2, 6)),
    Method("strong_noise", _ALL, "symasym.expansions.strong_noise", "in powers of 2/kappa^2",
           (2, 100)),
    Method("bound", ("C", "1 - C"), "symasym.expansions.bound",
           "proved bounds around the exact value"),
)}  # fmt: skip


def require_method(request: Request, rtol: Number | None = None) -> None:
    """Raise InputError unless the method answers the quantity, or is ``"auto"``."""
    method = request.method
    if rtol is not None and not (isinstance(method, str) and method == "auto"):
        raise InputError(
            f"rtol is {shown(rtol)}, but method {shown(method)} has its own error; leave it out, "
            "or use method='auto'."
        )
    known = [name for name, m in METHODS.items() if request.name in m.quantities] + ["auto"]
    if not isinstance(method, str) or method not in known:
        raise InputError(
            f"method is {shown(method)}; this quantity has "
            f"{', '.join(map(repr, known))}{meant(method, known)}."
        )


def answer(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The quantity of `request` by its method: a float, an array, an mpf or an `Estimate`.

    One scene is read in exact numbers, arrays and what a method does faster in float64 are read
    as floats.
    """
    method = METHODS[request.method]
    request = method.with_order(request)
    if request.dps is None and (not one_scene(drift, numbers) or method.in_float(drift, request)):
        scenes = float_scenes(drift, numbers)
        return as_floats(request, scenes.shape, method.of_scenes(scenes, request))
    scene = read_scene(drift, numbers, request.dps)
    return as_digits(request, method.of_scene(scene, request))


def require_drift_of(name: str, drift: Drift) -> None:
    """Raise unless the drift is bound, and slides where the quantity `name` needs that."""
    require_drift(drift)
    if not quantity_of(name).sliding:
        return
    ends = [np.asarray(x) for x in drift.ends]
    # Exact ones may be beyond every float.
    wrong = np.asarray(~((ends[0] > 0) & (ends[1] < 0)), dtype=bool)
    if wrong.any():
        first = tuple(np.argwhere(wrong)[0]) if wrong.ndim else ()
        here = [float_text(exact("A", x[first])) for x in ends]
        raise RegionError(
            f"a- = {here[0]} and a+ = {here[1]} make no sliding region (a- > 0 > a+), so "
            "there is no stationary density; ask for escape_time instead."
        )


def alone(ask: Ask, drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The answer for one scene; with ``errors="nan"`` nan where it has none."""
    try:
        return ask(drift, numbers, request)
    except (AccuracyError, RegionError):
        if request.errors == "raise":
            raise
    nan: Any = float("nan")
    if request.dps is not None:
        import mpmath

        nan = mpmath.mp.nan
    return Estimate(nan, nan, "none", request.method, mask=np.True_) if request.full else nan


# -- arrays of scenes ------------------------------------------------------------------------------


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
        try:
            elements = _elements(drift, numbers)
        except InputError as of_all:
            raise of_all from None
        if not len(elements) or _of_the_question(error, ask, elements, request):
            raise
        if request.errors == "nan":
            return _spared(ask, elements, request)
        raise _first(ask, elements, request, error) from None


def _of_the_question(error: SymasymError, ask: Ask, elements: Elements, request: Request) -> bool:
    """True for an error that no element is to blame for: of an option, or of all drifts alike."""
    if not isinstance(error, InputError):
        return False
    return not _names(error, elements) and not _any_answered(ask, elements, request)


def _names(error: SymasymError, elements: Elements) -> bool:
    """True where the text begins with the name of an array."""
    return str(error).startswith(tuple(f"{name} " for name in elements.names))


def _any_answered(ask: Ask, elements: Elements, request: Request) -> bool:
    """True where one of some elements has an answer."""
    count = len(elements)
    some = range(count) if count <= _SAMPLE else np.linspace(0, count - 1, _SAMPLE).astype(int)
    return any(_refusal(ask, elements, request, np.array([row])) is None for row in some)


def _refusal(ask: Ask, elements: Elements, request: Request, rows: IntArray) -> SymasymError | None:
    """What some elements are refused with; None where they have answers."""
    try:
        ask(*elements.part(rows), request)
    except TimeLimitError:
        raise
    except SymasymError as error:
        return error
    return None


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
        self.names = tuple(self._flat)

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


def _first(ask: Ask, elements: Elements, request: Request, of_all: SymasymError) -> SymasymError:
    """The error of the first element that is refused, with its index."""
    rows = np.arange(len(elements))
    while len(rows) > 1:
        low = rows[: len(rows) // 2]
        rows = low if _refusal(ask, elements, request, low) else rows[len(low) :]
    error = _refusal(ask, elements, request, rows)
    if error is None:
        return of_all
    others = rows[0] > 0 or _any_answered(ask, elements, request)
    if not others and isinstance(error, InputError) and not _names(error, elements):
        return error
    return _at(error, elements, rows[0], others)


def _at(error: SymasymError, elements: Elements, row: int, others: bool) -> SymasymError:
    """The error of an element with its index, and how to have the others."""
    index = ", ".join(map(str, np.unravel_index(row, elements.shape)))
    other = "; errors='nan' leaves such elements out" if others else ""
    return type(error)(f"at index ({index}), {str(error).rstrip('.')}{other}.")


def _spared(ask: Ask, elements: Elements, request: Request) -> Any:
    """The answers of those elements that are not refused; nan for the others."""
    parts: list[tuple[IntArray, Any]] = []
    refusals: dict[int, SymasymError] = {}
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
                refusals[int(rows[0])] = error
    if not parts:
        _require_some(refusals)
    value, wrong = (np.full(len(elements), np.nan) for _ in range(2))
    for rows, answer in parts:
        value[rows] = answer.value if request.full else answer
        if request.full and answer.error is not None:
            wrong[rows] = answer.error
    shape = elements.shape
    if not request.full:
        return value.reshape(shape)
    return _joined([x for _, x in parts], value.reshape(shape), wrong.reshape(shape), request)


def _require_some(refusals: dict[int, SymasymError]) -> None:
    """Raise the first error where none of the elements is one that can be asked for."""
    if all(isinstance(e, InputError) for e in refusals.values()):
        raise refusals[min(refusals)]


def _joined(estimates: list[Any], value: Any, error: Any, request: Request) -> Estimate:
    """One estimate of all elements; of the weakest kind, with what any of them adds or drops."""
    kinds = {x.error_kind for x in estimates} or {"none"}
    kind = next(k for k in _KINDS if k in kinds)
    terms, dropped, notes = (
        tuple(dict.fromkeys(t for x in estimates for t in getattr(x, name)))
        for name in ("terms", "dropped", "notes")
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
        notes,
    )


# -- with digits -----------------------------------------------------------------------------------


def _with_digits(ask: Ask, elements: Elements, request: Request, workers: int) -> Any:
    """Each element to `request.dps` digits, in an array of objects."""
    import mpmath

    answers: list[Any] = []
    try:
        with executors.local(workers) as executor:
            futures = [
                executor.submit(
                    _batch, ask, [_scene(elements, row) for row in rows], request, left()
                )
                for rows in _batches(len(elements))
            ]
            for future in futures:
                answers += future.result()
    except BrokenExecutor:
        raise SymasymError(
            f"workers is {workers}, and a process of them ended at once or ran out of memory; in a "
            "script put the call below if __name__ == '__main__':, or leave workers out."
        ) from None
    refusals = {row: one for row, one in enumerate(answers) if isinstance(one, SymasymError)}
    for row, error in refusals.items():
        if isinstance(error, TimeLimitError) or request.errors == "raise":
            raise _at(error, elements, row, row > 0 and not isinstance(error, TimeLimitError))
    known = [one for one in answers if not isinstance(one, SymasymError)]
    if not known and len(elements):
        _require_some(refusals)
    values, wrong = (np.full(len(elements), mpmath.mp.nan, dtype=object) for _ in range(2))
    rows = [row for row in range(len(elements)) if row not in refusals]
    shape = elements.shape
    values[rows] = [x.value for x in known] if request.full else known
    if not request.full:
        return values.reshape(shape)
    wrong[rows] = [x.error for x in known]
    return _joined(known, values.reshape(shape), wrong.reshape(shape), request)


def _batches(count: int) -> Iterator[range]:
    """Rows that are asked for together."""
    for low in range(0, count, _BATCH):
        yield range(low, min(low + _BATCH, count))


#: A drift and its numbers, or what they are refused with.
_Scene = tuple[Drift, dict[str, Any]] | SymasymError


def _scene(elements: Elements, row: int) -> _Scene:
    """One of the elements."""
    try:
        return elements.part(row)
    except SymasymError as error:
        return error


def _batch(ask: Ask, scenes: list[_Scene], request: Request, seconds: float) -> list[Any]:
    """The answers or errors of some scenes, in so many seconds; an error that counts ends them."""
    answers: list[Any] = []
    with limited(seconds):
        for scene in scenes:
            try:
                answers.append(scene if isinstance(scene, SymasymError) else ask(*scene, request))
            except SymasymError as error:
                answers.append(error)
            if isinstance(answers[-1], SymasymError) and (
                isinstance(answers[-1], TimeLimitError) or request.errors == "raise"
            ):
                break
    return answers
