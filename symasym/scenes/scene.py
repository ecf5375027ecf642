"""Scenes as all methods read them.

A scene is a drift phi, the large parameter lam = 2/kappa^2, and the numbers of the quantity asked
for (r and the start of eq:Ttilde and eq:C, the position y of eq:pss). One scene has exact
rationals, scenes that broadcast have float64.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.errors import InputError
from symasym.base.inputs import (
    FloatArray,
    IntArray,
    digits,
    exact,
    float_text,
    floats,
    is_array,
    positive,
    shown,
)
from symasym.drift.drift import Drift

if TYPE_CHECKING:
    pass

_KAPPA_RANGE = (1e-145, 1e145)
_R_RANGE = (1e-150, 1e152)
# Of any number: exponents, and digits of exponentials, stay such that work is short.
_MOST_BITS = 3_330


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
    for name, number in (values | drift.scalars()).items():
        if number and abs(_bits(number)) > _MOST_BITS:
            raise InputError(
                f"{name} is {float_text(number)}, beyond 1e±1000; rescale the problem."
            )
    for name in ("kappa", "r"):
        if name in values:
            positive(name, values[name])
    if "r" in values and abs(values["start"]) >= values["r"]:
        raise InputError(
            f"start is {float_text(values['start'])} and r is {float_text(values['r'])}; "
            "start must lie inside (-r, r)."
        )
    return values


def _bits(x: Fraction) -> int:
    """log2 of a number's size, to within 1."""
    return abs(x.numerator).bit_length() - x.denominator.bit_length()


def common_shape(drift: Drift, shapes: dict[str, tuple[int, ...]]) -> tuple[int, ...]:
    """The shape to which the drift's parameters and numbers of these shapes broadcast."""
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
    # A number that all scenes share is not copied for each of them.
    flat = {name: np.broadcast_to(x, shape).reshape(-1) for name, x in arrays.items()}
    for name, (low, high) in (("kappa", _KAPPA_RANGE), ("r", _R_RANGE)):
        if name not in flat:
            continue
        given = arrays[name]
        least = given.min()
        if not least > 0:
            raise InputError(f"{name} is {least:.6g}; it must be greater than 0.")
        if least < low or given.max() > high:
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
        if not is_array(value):
            known = exact(name, value)
            moved[name] = abs(float(known - Fraction(float(arrays[name]))))
    parameters = {
        name: np.broadcast_to(value, shape).ravel() if is_array(value) else value
        for name, value in drift.values.items()
    }
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


def input_rounding(scenes: Scenes, size: FloatArray) -> FloatArray:
    """A bound on the change of a logarithm where exact numbers are read as floats."""
    change = np.zeros_like(scenes.lam)
    # A logarithm changes with a position no faster than lam |phi|, or as one comes close to an
    # absorbing end. The rounding of kappa is counted with that of lam.
    room: Any = np.inf
    if "r" in scenes.numbers:
        room = scenes.numbers["r"] - np.abs(scenes.numbers["start"])
    for name, gap in scenes.moved.items():
        if name != "kappa" and gap:
            change += gap * (scenes.lam * size + 2 / room)
    return change


def working_digits(digits: int, lam: Fraction, r: Fraction) -> int:
    """Digits that leave `digits` right in e^{lam V}."""
    return digits + 2 * len(str(int(lam * (1 + r) + 1))) + 20
