"""Scenes as every method reads them, the quantities, and answers as every method gives them.

A scene is a drift phi, the large parameter lam = 2/kappa^2, and the numbers of the quantity asked
for (r and the start of eq:Ttilde and eq:C, or two ends left and right in place of -r and r; the
position y of eq:pss; the interval from low to high whose stationary share is asked for). One scene
has exact rationals; scenes that broadcast have float64.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np
from flint import fmpq

from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import (
    FloatArray,
    IntArray,
    Numbers,
    common_shape,
    exact,
    float_text,
    floats,
    is_array,
    positive,
    sequence,
    shown,
)
from symasym.drift.drift import Drift
from symasym.drift.sampled import flat_values

#: Digits behind a float64 value whose error is part of it.
FLOAT_DIGITS = 20
_ULP = 2.0**-52
# Of float64: squares of kappa and ways of lam stay numbers.
_RANGES = {"kappa": (1e-145, 1e145), "r": (1e-150, 1e152)}


#: Two ends, the left one first.
Ends = tuple[Numbers, Numbers] | list[Numbers]


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
_PAIRS = (("left", "right"), ("low", "high"))
_PLACES = ("left", "low", "start", "high", "right")

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


def ends_of(numbers: Mapping[str, Any]) -> tuple[Any, Any]:
    """Of the interval that is left: -r and r, or as given."""
    if "r" in numbers:
        return -numbers["r"], numbers["r"]
    return numbers["left"], numbers["right"]


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
    def ends(self) -> tuple[Fraction, Fraction]:
        """Of the interval that is left."""
        return ends_of(self.numbers)

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
    drift: Drift
    #: The numbers as the caller wrote them.
    given: dict[str, Any]

    @property
    def ends(self) -> tuple[Any, Any]:
        """Of the intervals that are left."""
        return ends_of(self.numbers)

    def noise(self, row: int | np.intp) -> str:
        """kappa of one scene, for messages."""
        return f"{self.numbers['kappa'][row]:.6g}"


class Request(NamedTuple):
    """What is asked for, apart from the scene itself; `name` is that of the quantity.

    `order` is a range where the best of an expansion's orders is asked for; `dps` is None for
    float64. `moment` k asks for E[tau^k] in place of T = E[tau]; `reflecting` is the end that
    reflects, "left" or "right".
    """

    name: str
    method: str
    order: Any
    dps: int | None
    log: bool
    full: bool
    moment: int = 1
    reflecting: str | None = None

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
    """The answer of a method for many scenes: logarithms and their absolute errors.

    A scene without an answer has nan; `why` is what the first of them is refused with.
    """

    logs: FloatArray
    errors: FloatArray | None
    kind: ErrorKind
    terms: tuple[str, ...] = ()
    dropped: tuple[str, ...] = ()
    why: str = ""


# -- reading ---------------------------------------------------------------------------------------


def require_drift(drift: object, bound: bool = True, plain: bool = True) -> None:
    """Raise unless `drift` is a Drift, where `bound` with all its parameters given, where `plain`
    the paper's: constant outside a layer, with noise that does not depend on u."""
    if not isinstance(drift, Drift):
        raise InputError(f"drift is {shown(drift)}; give a Drift, such as sa.friction(…).")
    if bound:
        drift.require_bound()
    if plain and not drift.model.plain:
        raise RegionError(
            f"{drift!r} has pieces, no layer, or noise of its own, for which there are the exact "
            "values, method='laplace' and exit_law; give a drift that is constant outside [-1, 1]."
        )


def one_scene(drift: Drift, numbers: dict[str, Any]) -> bool:
    """True where nothing is an array."""
    return not drift.shape and not any(is_array(x) for x in numbers.values())


def read_scene(drift: Drift, numbers: dict[str, Any], reflecting: str | None = None) -> Scene:
    """The scene of these numbers, exact and in their ranges."""
    values = {
        name: positive(name, x) if name in _RANGES else exact(name, x)
        for name, x in numbers.items()
    }
    drift.scalars()
    for low, high in _PAIRS:
        if low in values and not values[low] < values[high]:
            raise _reversed(low, high, *map(float_text, (values[low], values[high])))
    scene = Scene(drift, 2 / values["kappa"] ** 2, values)
    if "start" in values:
        left, right = scene.ends
        allowed = {"left": left, "right": right}.get(reflecting or "")
        if not left < scene.start < right and scene.start != allowed:
            raise _outside(*map(float_text, (scene.start, left, right)))
        require_noise(drift, left, right)
    return scene


def require_noise(drift: Drift, low: Any, high: Any) -> None:
    """Raise InputError unless sigma > 0 from `low` to `high`, where no layer has shown it."""
    if drift.model.noise and not drift.model.layered:
        from symasym.drift.expressions import check_noise

        check_noise(
            drift.model.noise, drift.scalars(), *(fmpq(*x.as_integer_ratio()) for x in (low, high))
        )


def pair(name: str, value: Any) -> list[Any]:
    """Two ends, as given."""
    pair = sequence(name, value)
    if len(pair) != 2:
        raise InputError(f"{name} is {shown(value)}; give a pair, the left end and the right one.")
    return pair


def between(kappa: Any, r: Any, ends: Any, start: Any) -> dict[str, Any]:
    """kappa, the ends and the start as they are given."""
    if (r is None) == (ends is None):
        raise InputError(
            f"r is {shown(r)} and ends are {shown(ends)}; give the radius r, or the two ends."
        )
    if ends is None:
        return {"kappa": kappa, "r": r, "start": start}
    left, right = pair("ends", ends)
    return {"kappa": kappa, "left": left, "right": right, "start": start}


def float_scenes(drift: Drift, numbers: dict[str, Any], reflecting: str | None = None) -> Scenes:
    """The numbers and the drift's parameters broadcast together, in their ranges."""
    arrays = {name: floats(name, value, copy=False) for name, value in numbers.items()}
    shapes = {name: x.shape for name, x in arrays.items() if x.ndim}
    shape = common_shape({"drift": drift.shape, **shapes}) if shapes else drift.shape
    # A number that all scenes share is not copied for each of them.
    size = math.prod(shape)
    flat: dict[str, FloatArray] = {
        name: np.broadcast_to(x, shape).reshape(-1)
        if x.ndim
        else np.ndarray(size, float, x, strides=(0,))
        for name, x in arrays.items()
    }
    for name, (low, high) in _RANGES.items():
        if name in arrays:
            least, most = arrays[name].min(), arrays[name].max()
            if not least > 0:
                raise InputError(f"{name} is {least:.6g}; it must be greater than 0.")
            if least < low or most > high:
                raise InputError(
                    f"{name} is {least if least < low else most:.6g}, so that its square is near "
                    "the end of the range of float64; pass dps=… for it."
                )
    for pair in _PAIRS:
        if pair[0] in flat and (wrong := np.flatnonzero(~(flat[pair[0]] < flat[pair[1]]))).size:
            raise _reversed(*pair, *(f"{flat[name][wrong[0]]:.6g}" for name in pair))
    lam = flat["kappa"] ** 2
    np.divide(2.0, lam, out=lam)
    scenes = Scenes(shape, lam, flat, flat_values(drift, shape), drift, numbers)
    if "start" in flat:
        ends = scenes.ends
        below, above = flat["start"] - ends[0], ends[1] - flat["start"]
        inside = (below > 0) & (above > 0) | (
            {"left": below, "right": above}[reflecting] == 0 if reflecting else False
        )
        if (wrong := np.flatnonzero(~inside)).size:
            raise _outside(*(f"{x[wrong[0]]:.6g}" for x in (flat["start"], *ends)))
        if not drift.shape:
            require_noise(drift, ends[0].min(), ends[1].max())
    return scenes


def _outside(start: str, left: str, right: str) -> InputError:
    return InputError(f"start is {start}; it must lie inside ({left}, {right}).")


def _reversed(low: str, high: str, *values: str) -> InputError:
    return InputError(
        f"{low} is {values[0]} and {high} is {values[1]}; give the left end first, then the right."
    )


# -- some of many ----------------------------------------------------------------------------------


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
    index = np.unique(keys, axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(index, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(index[order])) + 1):
        yield drift_at(scenes, rows[0]), rows


def rows_of(scenes: Scenes, rows: slice | IntArray | tuple[slice | IntArray, ...]) -> Scenes:
    """Some of the scenes; the shape and the parameters stay those of all."""
    numbers = {name: x[rows] for name, x in scenes.numbers.items()}
    return scenes._replace(lam=scenes.lam[rows], numbers=numbers)


def moved_places(scenes: Scenes) -> tuple[float, FloatArray | float]:
    """How far places move, all together, that are read as floats, and the least way between two."""
    given = (x for name, x in scenes.given.items() if name != "kappa" and not is_array(x))
    places = [exact("a place", x) for x in given if not isinstance(x, (float, int))]
    places += [x for x in scenes.drift.model.cuts if Fraction(float(x)) != x]
    known = [scenes.numbers[name] for name in _PLACES if name in scenes.numbers]
    if "r" in scenes.numbers:
        known += scenes.ends
    gaps = np.diff(np.sort(known, axis=0), axis=0)
    room = np.where(gaps > 0, gaps, np.inf).min(axis=0, initial=np.inf)
    return sum(abs(float(x)) for x in places) * _ULP, room
