"""Scenes as all methods read them, the quantities, and answers as all methods hand them back.

A scene is a drift phi, the large parameter lam = 2/kappa^2, and the numbers of the quantity asked
for (r and the start of eq:Ttilde and eq:C, the position y of eq:pss). One scene has exact
rationals, scenes that broadcast have float64.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.call_context import float_with_error, own_context, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import (
    FloatArray,
    IntArray,
    count,
    digits,
    exact,
    float_text,
    floats,
    is_array,
    positive,
    shown,
)
from symasym.drift.drift import Drift
from symasym.numbers.trees import MpmathOps

if TYPE_CHECKING:
    from mpmath import mpf


_KAPPA_RANGE = (1e-145, 1e145)
_R_RANGE = (1e-150, 1e152)
# Digits of exponentials stay such that work is short.
_MOST_SIZE = 10_000
_GRID = np.linspace(-1.0, 1.0, 33)


class Scene(NamedTuple):
    """One scene in exact numbers; `numbers` are the verb's own, in its order."""

    drift: Drift
    lam: Fraction
    numbers: dict[str, Fraction]

    @property
    def r(self) -> Fraction:
        """The escape radius."""
        return self.numbers["r"]

    @property
    def start(self) -> Fraction:
        """The starting point."""
        return self.numbers["start"]

    @property
    def noise(self) -> str:
        """kappa, for messages."""
        return float_text(self.numbers["kappa"])


class Scenes(NamedTuple):
    """Scenes in float64, flattened; `shape` is that of the answer."""

    shape: tuple[int, ...]
    lam: FloatArray
    numbers: dict[str, FloatArray]
    parameters: dict[str, Any]
    # What reading a number as a float changed in it, at most.
    moved: dict[str, float]
    drift: Drift
    #: The numbers as the caller wrote them.
    given: dict[str, Any]

    def noise(self, row: int | np.intp) -> str:
        """kappa of one scene, for messages."""
        return f"{self.numbers['kappa'][row]:.6g}"


def require_drift(drift: object, bound: bool = True) -> None:
    """Raise InputError unless `drift` is a Drift, where `bound` with all its parameters given."""
    if not isinstance(drift, Drift):
        raise InputError(f"drift is {shown(drift)}; give a Drift, such as sa.friction(…).")
    if bound:
        drift.require_bound()


def one_scene(drift: Drift, numbers: dict[str, Any]) -> bool:
    """True where nothing is an array."""
    return not drift.shape and not any(is_array(x) for x in numbers.values())


def exact_scene(drift: Drift, numbers: dict[str, Any], dps: int | None) -> dict[str, Fraction]:
    """The numbers as exact rationals, in their ranges; the drift's parameters must be scalars."""
    if dps is not None:
        digits(dps)
        for name, value in numbers.items():
            if is_array(value):
                raise InputError(
                    f"{name} is an array and dps is {dps}; arrays are for float64 (dps=None), "
                    "so pass one value at a time."
                )
    values = {name: exact(name, value) for name, value in numbers.items()}
    drift.scalars()
    for name in ("kappa", "r"):
        if name in values:
            positive(name, values[name])
    if "r" in values and abs(values["start"]) >= values["r"]:
        raise InputError(
            f"start is {float_text(values['start'])} and r is {float_text(values['r'])}; "
            "start must lie inside (-r, r)."
        )
    return values


def common_shape(drift: Drift, shapes: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The shape to which the drift's parameters and numbers of these shapes broadcast."""
    if not any(shapes.values()):
        return drift.shape
    try:
        return np.broadcast_shapes(drift.shape, *shapes.values())
    except ValueError:
        given = [f"{name} {shape}" for name, shape in shapes.items() if shape]
        raise InputError(
            f"the shapes do not broadcast (drift {drift.shape}, {', '.join(given)}); "
            "give arrays of shapes that NumPy broadcasts."
        ) from None


def float_scenes(drift: Drift, numbers: dict[str, Any]) -> Scenes:
    """The numbers and the drift's parameters broadcast together, in their ranges."""
    arrays = {name: floats(name, value, copy=False) for name, value in numbers.items()}
    shape = common_shape(drift, {name: x.shape for name, x in arrays.items()})
    size = math.prod(shape)
    # A number that all scenes share is not copied for each of them.
    flat: dict[str, FloatArray] = {
        name: np.broadcast_to(x, shape).reshape(-1)
        if x.ndim
        else np.ndarray(size, float, x, strides=(0,))
        for name, x in arrays.items()
    }
    for name, (low, high) in (("kappa", _KAPPA_RANGE), ("r", _R_RANGE)):
        if name not in flat:
            continue
        given = arrays[name]
        least, most = (given.min(), given.max()) if given.ndim else 2 * (given.item(),)
        if not least > 0:
            raise InputError(f"{name} is {least:.6g}; it must be greater than 0.")
        if least < low or most > high:
            beyond = (given < low) | (given > high)
            raise InputError(
                f"{name} is {given[beyond][0]:.6g}, so that its square is near the end of "
                "the range of float64; pass dps=… for it."
            )
    if "r" in flat and not (np.abs(arrays["start"]) < arrays["r"]).all():
        worst = np.argmax(np.abs(flat["start"]) - flat["r"])
        raise InputError(
            f"start is {flat['start'][worst]:.6g} and r is {flat['r'][worst]:.6g}; "
            "start must lie inside (-r, r)."
        )
    moved = dict.fromkeys(numbers, 0.0)
    for name, value in numbers.items():
        near = arrays[name]
        # Python compares floats with whole numbers exactly.
        if not (is_array(value) or (isinstance(value, (float, int)) and value == float(near))):
            known = exact(name, value)
            moved[name] = abs(float(known - Fraction(float(near))))
    parameters = drift.flat_values(shape)
    lam = flat["kappa"] ** 2
    np.divide(2.0, lam, out=lam)
    return Scenes(shape, lam, flat, parameters, moved, drift, numbers)


def read_scene(drift: Drift, numbers: dict[str, Any], dps: int | None) -> Scene:
    """The scene of these numbers, exact and in their ranges."""
    values = exact_scene(drift, numbers, dps)
    return Scene(drift, 2 / values["kappa"] ** 2, values)


def scene_at(scenes: Scenes, row: int | np.intp) -> Scene:
    """One of the scenes in exact numbers: those of its floats, and what is no array as given."""
    numbers = {
        name: Fraction(float(x[row])) if is_array(scenes.given[name]) else exact(name, given)
        for (name, x), given in zip(scenes.numbers.items(), scenes.given.values(), strict=True)
    }
    return Scene(drift_at(scenes, row), 2 / numbers["kappa"] ** 2, numbers)


def drift_at(scenes: Scenes, row: int | np.intp) -> Drift:
    """The drift of one of the scenes, its parameters scalars."""
    arrays = {name: float(x[row]) for name, x in scenes.parameters.items() if is_array(x)}
    return scenes.drift.bind(**arrays) if arrays else scenes.drift


def by_drift(scenes: Scenes, *others: FloatArray) -> Iterator[tuple[Drift, IntArray]]:
    """Each drift with the rows of its scenes; where `others` are given, these are equal as well."""
    arrays = [x for x in scenes.parameters.values() if is_array(x)]
    keys = np.array([*arrays, *others, np.zeros(len(scenes.lam))]).T
    order, first, count = grouped(np.unique(keys, axis=0, return_inverse=True)[1].ravel())
    for low, number in zip(first, count, strict=True):
        rows = order[low : low + number]
        yield drift_at(scenes, rows[0]), rows


def grouped(index: IntArray) -> tuple[IntArray, IntArray, IntArray]:
    """Rows in the order of their index, where in it a new one begins, and how many rows it has."""
    order = np.argsort(index, kind="stable")
    first = np.flatnonzero(np.diff(index[order], prepend=-1))
    return order, first, np.diff(first, append=len(order))


def rows_of(scenes: Scenes, rows: slice | IntArray | tuple[slice | IntArray, ...]) -> Scenes:
    """Some of the scenes; the shape and the parameters stay those of all."""
    return scenes._replace(
        lam=scenes.lam[rows],
        numbers={name: x[rows] for name, x in scenes.numbers.items()},
    )


def input_rounding(
    scenes: Scenes, size: FloatArray, but: tuple[str, ...] = ("kappa",)
) -> FloatArray | float:
    """A bound on the change of a logarithm where exact numbers, `but` these, are read as floats."""
    # A logarithm changes with a position no faster than lam |phi|, or as one comes close to an
    # absorbing end. The rounding of kappa is counted with that of lam.
    gap = sum(gap for name, gap in scenes.moved.items() if name not in but)
    if not gap:
        return 0.0
    room: Any = np.inf
    if "r" in scenes.numbers:
        room = scenes.numbers["r"] - np.abs(scenes.numbers["start"])
    with np.errstate(over="ignore"):
        change: FloatArray = gap * (scenes.lam * size + 2 / room)
    return change


def working_digits(digits: int, drift: Drift, lam: Fraction, r: Fraction) -> int:
    """Digits that leave `digits` right in e^{lam V}."""
    return digits + 2 * math.ceil(0.30103 * exponent_bits(drift, lam, r)) + 21


def exponent_bits(drift: Drift, lam: Fraction, reach: Fraction) -> int:
    """Bits before the point of lam V, at most, from -reach to reach: 0 or more.

    By |A| at 33 points of [-1, 1], so without a peak between them.
    """
    with np.errstate(all="ignore"):
        sizes = np.abs(np.asarray(drift.evaluate_float(_GRID), dtype=np.float64))
    size = math.frexp(sizes[np.isfinite(sizes)].max(initial=0.0))[1]
    if np.isinf(sizes).any():
        with own_context(FLOAT_DIGITS) as context:
            ops = MpmathOps(context)
            known = [drift.evaluate(context.mpf(x), ops) for x in _GRID]
            size = max([size, *(int(context.mag(x)) for x in known if context.isfinite(x) and x)])
    if size > _MOST_SIZE:
        raise AccuracyError(f"A is beyond 2^{_MOST_SIZE} on [-1, 1]; rescale the problem.")
    longest = 2 * lam * (1 + reach)
    return max(0, size + longest.numerator.bit_length() - longest.denominator.bit_length() + 1)


# -- answers ---------------------------------------------------------------------------------------


_LARGEST, _SMALLEST = 709.78, -708.39

#: Digits behind a float64 value whose error is part of it.
FLOAT_DIGITS = 20


class Quantity(NamedTuple):
    """A quantity: the verb that asks for it, whether its complement is meant, its numbers."""

    verb: str
    complement: bool
    numbers: tuple[str, ...]

    @property
    def has_complement(self) -> bool:
        """True for the probabilities."""
        return self.verb in ("exit_probability", "occupation")

    @property
    def sliding(self) -> bool:
        """True where it exists in a sliding region alone: without a radius nothing is left."""
        return "r" not in self.numbers


_ESCAPE = ("kappa", "r", "start")

#: By their names.
QUANTITIES = {
    "T": Quantity("escape_time", False, _ESCAPE),
    "C": Quantity("exit_probability", False, _ESCAPE),
    "1 - C": Quantity("exit_probability", True, _ESCAPE),
    "P": Quantity("occupation", False, ("kappa",)),
    "1 - P": Quantity("occupation", True, ("kappa",)),
}
_DENSITY = Quantity("stationary_density", False, ("kappa", "y"))


def quantity_of(name: str) -> Quantity:
    """The quantity of that name, the stationary density ``"p_ss"`` among them."""
    return QUANTITIES.get(name, _DENSITY)


class Request(NamedTuple):
    """What is asked for, apart from the scene itself; `name` is that of the quantity.

    `errors` is ``"raise"``, or ``"nan"`` where elements of arrays that are refused become nan.
    """

    name: str
    method: str
    order: Any
    dps: int | None
    log: bool
    full: bool
    errors: str = "raise"

    @property
    def digits(self) -> int:
        """Digits to compute with: behind a float64 value a few more, for the error beside it."""
        return FLOAT_DIGITS if self.dps is None else self.dps

    @property
    def complement(self) -> bool:
        """True for 1 - C and 1 - P."""
        return self.name.startswith("1 - ")


class Answer(NamedTuple):
    """The answer of a method for one scene: the value, or its logarithm where that was asked.

    `order` is that of the expansion where it is not the request's own.
    """

    value: Any
    error: Any
    kind: ErrorKind
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    order: int | None = None


class Answers(NamedTuple):
    """The answer of a method for many scenes: logarithms and their absolute errors."""

    logs: FloatArray
    errors: FloatArray | None
    kind: ErrorKind
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()


def read_order(order: int | str | None, default: int, most: int) -> int:
    """The order of an expansion, a whole number from 0 to `most`."""
    if order is None:
        return default
    if isinstance(order, str) and order == "optimal":
        raise InputError(
            "order is 'optimal', but this series converges for every kappa, so that more terms "
            f"are always better; give a whole number from 0 to {most}."
        )
    return count("order", order, 0, most)


def as_floats(request: Request, shape: tuple[int, ...], answers: Answers) -> Any:
    """Logarithms and their errors as what was asked for."""
    logs = answers.logs.reshape(shape)
    value: Any = logs
    error: Any = None
    if request.full and answers.errors is not None:
        # A logarithm close to 0 may have underflowed.
        error = answers.errors.reshape(shape) + 1e-300
    if request.errors == "raise":
        require_fits(request.name, logs, request.log)
    else:
        logs = value = np.where(_fitting(logs, request.log), logs, np.nan)
    if not request.log:
        value = np.exp(logs)
        if error is not None:
            # exp rounds once more, and so does the product; what is left out may have any error.
            with np.errstate(over="ignore"):
                error = value * (np.expm1(error) * (1 + 1e-15) + 4e-16)
    if value.ndim == 0:
        value, error = float(value), None if error is None else float(error)
    if not request.full:
        return value
    order = None if isinstance(request.order, range) else request.order
    mask = np.isnan(value) if request.errors == "nan" else None
    return Estimate(
        value, error, answers.kind, request.method, order, answers.terms, answers.dropped, mask,
        _notes(request, value),
    )  # fmt: skip


def as_digits(request: Request, answer: Answer) -> Any:
    """An mpf of enough digits, with its error, as what was asked for."""
    import mpmath
    from mpmath import libmp

    dps, value, error = request.dps, answer.value, answer.error
    if dps is not None:
        rounded = to_mpf(value, dps)
    else:
        rounded = float(value)
        if request.log:
            require_fits(request.name, np.asarray(rounded), True)
        else:
            _fits(request.name, value)
    if not request.full:
        return rounded
    total = None
    if error is not None and dps is None:
        rounded, total = float_with_error(value, error)
    elif error is not None:
        # Differences without a precision are exact in libmp; only the sum of the errors rounds.
        shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, rounded._mpf_))
        total = mpmath.mp.make_mpf(libmp.mpf_add(error._mpf_, shift, 53, "u"))
    order = request.order if answer.order is None else answer.order
    return Estimate(
        rounded, total, answer.kind, request.method, order, answer.terms, answer.dropped,
        notes=_notes(request, rounded),
    )  # fmt: skip


def _notes(request: Request, value: Any) -> tuple[str, ...]:
    """What a reader of a probability that prints 1 should know."""
    if request.log or not quantity_of(request.name).has_complement or not np.any(value == 1):
        return ()
    way = "leave complement out for" if request.complement else "complement=True has"
    return (f"{request.name} is 1 to these digits; {way} the rest",)


def _fits(name: str, value: mpf) -> None:
    """Raise unless `value`, an mpf, is a float."""
    from mpmath import libmp

    if not value:
        return
    size = libmp.to_float(libmp.mpf_log(libmp.mpf_abs(value._mpf_), 53))
    require_fits(name, np.asarray(size), False)


def _fitting(logs: FloatArray, log: bool) -> Any:
    """True where e^logs is a float, or logs with `log`."""
    return np.isfinite(logs) if log else (logs >= _SMALLEST) & (logs <= _LARGEST)


def require_fits(name: str, logs: FloatArray, log: bool) -> None:
    """Raise unless the values e^logs, or their logarithms with `log`, are floats."""
    if not np.isfinite(logs).all():
        raise RangeError(
            f"log {name} is outside the range of float64 itself; pass log=True with dps=…."
        )
    if log:
        return
    extreme = float(logs.max() if logs.max() > _LARGEST else logs.min())
    if not _SMALLEST <= extreme <= _LARGEST:
        raise RangeError(
            f"{name} is e^{extreme:.6g}, outside the range of float64; pass log=True, or dps=…."
        )
