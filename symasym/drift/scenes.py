"""The common input and output of all methods: scenes, requests and answers.

A scene is a drift phi, the noise amplitude kappa, with lam = 2/kappa^2, and the other numbers on
which the quantity depends: r and the start (eq:Ttilde, eq:C), or two ends left and right in place
of -r and r; the position y (eq:pss); the interval from low to high for a stationary probability.
The numbers of a single scene are exact rationals, those of scenes that broadcast are float64.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from symasym.base.balls import rational
from symasym.base.errors import InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import (
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
from symasym.drift.expressions import check_noise

#: The decimal digits computed for a float64 value with an error.
FLOAT_DIGITS = 20
#: Two ends, the left one first.
Ends = tuple[Numbers, Numbers] | list[Numbers]
#: The quantities, each with the numbers on which it depends.
QUANTITIES = {
    **dict.fromkeys(("T", "C", "1 - C"), ("kappa", "r", "start")),
    **dict.fromkeys(("P", "1 - P"), ("kappa",)),
}


def ends_of(numbers: Mapping[str, Any]) -> tuple[Any, Any]:
    """The ends of the interval from which the path escapes: -r and r, or the given ones."""
    if "r" in numbers:
        return -numbers["r"], numbers["r"]
    return numbers["left"], numbers["right"]


@dataclass(frozen=True)
class Scene:
    """One scene in exact numbers; `numbers` has those of the quantity in its order."""

    drift: Drift
    numbers: dict[str, Any]

    @cached_property
    def lam(self) -> Any:
        """2/kappa^2."""
        return 2 / self.numbers["kappa"] ** 2

    @property
    def ends(self) -> tuple[Any, Any]:
        """The ends of the interval from which the path escapes."""
        return ends_of(self.numbers)

    @property
    def start(self) -> Any:
        """The starting point."""
        return self.numbers["start"]


@dataclass(frozen=True)
class Scenes(Scene):
    """Scenes in float64: numbers and parameters are arrays with one element per scene.

    `shape` is that of the answer. Parameters that are not arrays are shared by the scenes, as are
    the numbers in `exactly`, whose float64 values are in `numbers`.
    """

    shape: tuple[int, ...]
    exactly: dict[str, Fraction]

    @cached_property
    def lam(self) -> Any:
        """2/kappa^2, infinite where kappa^2 leaves the range of float64."""
        with np.errstate(over="ignore", divide="ignore"):
            return 2 / self.numbers["kappa"] ** 2

    def one(self) -> Scene:
        """The scene, if there is only one; raises InputError otherwise."""
        if self.shape:
            raise InputError(
                f"arrays of shape {self.shape} were given, but digits (dps), laws and plans are of "
                "one scene; give numbers, or ask for each element."
            )
        return self.at(0)

    def at(self, row: int | np.intp) -> Scene:
        """The scene of a row in exact numbers."""
        found = {n: Fraction(float(x[row])) for n, x in self.numbers.items()}
        return Scene(self._drift(row), found | self.exactly)

    def some(self, rows: Any, alike: bool = False) -> Scenes:
        """The scenes of some rows; if `alike`, their drifts are equal, and one is kept."""
        numbers = {n: x[rows] for n, x in self.numbers.items()}
        return Scenes(self._drift(rows[0] if alike else rows), numbers, self.shape, self.exactly)

    def _drift(self, rows: Any) -> Drift:
        arrays = {n: x[rows] for n, x in self.drift.values.items() if is_array(x)}
        return self.drift.bind(**arrays) if arrays else self.drift

    def alike(self) -> Iterator[tuple[IntArray, Scenes]]:
        """Groups of scenes that differ only in kappa: their rows, and the scenes of the group."""
        own = [x for n, x in self.numbers.items() if n not in ("kappa", *self.exactly)]
        own += [x for x in self.drift.values.values() if is_array(x)]
        if not own:
            yield np.arange(len(self.lam)), self
            return
        index = np.unique(np.array(own).T, axis=0, return_inverse=True)[1].ravel()
        order = np.argsort(index, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(index[order])) + 1):
            yield rows, self.some(rows, alike=True)


class Request(NamedTuple):
    """The quantity, called `name`, that is to be computed for a scene, and the options.

    `order` has the orders of an expansion from which the best is chosen; `dps` is None for
    float64. `moment` k stands for E[tau^k] in place of T = E[tau]; `reflecting` is the reflecting
    end, "left" or "right"; `rtol` is the relative error that the method "auto" may have.
    """

    name: str
    method: str = "exact"
    order: Any = None
    dps: int | None = None
    log: bool = False
    full: bool = False
    moment: int = 1
    reflecting: str | None = None
    rtol: Any = None

    @property
    def digits(self) -> int:
        """The digits to compute, which for float64 include a few more for the error."""
        return FLOAT_DIGITS if self.dps is None else self.dps

    @property
    def stationary(self) -> bool:
        """True for P, 1 - P and p_ss, which depend on no start."""
        return self.name in ("P", "1 - P", "p_ss")

    @property
    def complement(self) -> bool:
        """True if the quantity is 1 - C or 1 - P."""
        return self.name.startswith("1 - ")


class Answer(NamedTuple):
    """The answer of a method.

    For one scene, `value` is a ball that encloses the value, or its logarithm if requested; its
    radius is the error. For several, `value` has logarithms and `error` their absolute errors; a
    refused scene has nan, and `why` is the first refusal's message. `order` is that of an
    expansion, None if it differs from scene to scene; `method` is the one used if not that
    requested.
    """

    value: Any
    kind: ErrorKind
    order: int | None = None
    error: Any = None
    why: str = ""
    method: str = ""
    notes: tuple[str, ...] = ()


# -- reading ---------------------------------------------------------------------------------------


def require_drift(drift: object, bound: bool = True, plain: bool = True) -> None:
    """Raise unless `drift` is a Drift; if `bound`, one whose parameters all have values; if
    `plain`, one that is constant outside its layer, with noise that does not depend on u."""
    if not isinstance(drift, Drift):
        raise InputError(f"drift is {shown(drift)}; give a Drift, such as sa.friction(…).")
    if bound:
        drift.require_bound()
    if plain and not drift.model.plain:
        has = "noise that depends on u" if drift.model.layered else "no layer"
        raise RegionError(
            f"{drift!r} has {has}, but this is for one layer with constant noise; take exact "
            "values and their differences, method 'laplace' or the law of the exit time."
        )


def require_sliding(drift: Drift) -> None:
    """Raise RegionError unless the drift is sliding, so that a stationary density exists."""
    left, right = np.broadcast_arrays(*map(np.asarray, drift.ends))
    _require(
        (left > 0) & (right < 0),
        "a- = {left} and a+ = {right} make no sliding region (a- > 0 > a+), so there is no "
        "stationary density; ask for the escape time instead.",
        RegionError, left=left, right=right,
    )  # fmt: skip


def pair(name: str, value: Any) -> list[Any]:
    """A sequence of two ends, not yet converted to numbers."""
    pair = sequence(name, value)
    if len(pair) != 2:
        raise InputError(f"{name} is {shown(value)}; give a pair, the left end and the right one.")
    return pair


def between(kappa: Any, r: Any, ends: Any, start: Any) -> dict[str, Any]:
    """kappa, r or the two ends, and the start, not yet converted to numbers."""
    if (r is None) == (ends is None):
        told = "missing" if r is None else f"{shown(r)} and ends are {shown(ends)}"
        raise InputError(f"r is {told}; give the radius r, or two ends in its place.")
    if ends is None:
        return {"kappa": kappa, "r": r, "start": start}
    left, right = pair("ends", ends)
    return {"kappa": kappa, "left": left, "right": right, "start": start}


def taken(of: str, names: tuple[str, ...], **given: Any) -> dict[str, Any]:
    """The arguments on which `of` depends; all others, except a start, must be None."""
    for name, value in given.items():
        if name != "start" and (name in names) != (value is not None):
            way = "give" if value is None else "leave out"
            raise InputError(f"{of} depends on {', '.join(names)}; {way} {name}.")
    return {name: given[name] for name in names}


def read(drift: Drift, numbers: dict[str, Any], reflecting: str | None = None) -> Scenes:
    """The scenes from numbers and drift, which are checked and broadcast together."""
    exactly = {n: exact(n, x) for n, x in numbers.items() if not is_array(x)}
    arrays = {n: floats(n, x) for n, x in numbers.items() if is_array(x)}
    shape = common_shape({"drift": drift.shape} | {n: x.shape for n, x in arrays.items()})

    def flat(x: Any) -> Any:
        """One element per scene; a number that all scenes share is not copied."""
        return np.broadcast_to(np.asarray(x, float), shape).reshape(-1)

    bound = {n: flat(x) for n, x in drift.values.items() if is_array(x)}
    given = {n: flat(exactly[n] if n in exactly else arrays[n]) for n in numbers}
    scenes = Scenes(drift.bind(**bound) if bound else drift, given, shape, exactly)
    _check(scenes if shape else scenes.one(), reflecting)
    own, A = drift.model.name in ("", "polynomial"), drift.model.pieces[0]
    clipped = own and drift.model.layered and A.expression.has(A.u)
    if clipped and "left" in numbers and np.abs(scenes.ends).max() > 1:
        words = f"outside [-1, 1] {drift!r} is constant; sa.Drift(…, layer=None) is not"
        warnings.warn(words, stacklevel=5)
    return scenes


def _check(scene: Scene, reflecting: str | None) -> None:
    """Raise InputError unless the numbers of a scene, or of scenes, are in their ranges."""
    numbers, drift = scene.numbers, scene.drift
    for name in ("kappa", "r"):
        if name in numbers:
            positive(name, np.min(numbers[name]))
    for low, high in (("left", "right"), ("low", "high")):
        if low in numbers:
            words = f"{low} is {{a}} and {high} is {{b}}; give the left end first, then the right."
            _require(numbers[low] < numbers[high], words, a=numbers[low], b=numbers[high])
    if "start" in numbers:
        left, right = scene.ends
        inside = (left < scene.start) & (scene.start < right)
        if reflecting is not None:
            inside |= scene.start == (left if reflecting == "left" else right)
        words = "start is {start}; it must lie inside ({left}, {right})."
        _require(inside, words, start=scene.start, left=left, right=right)
        # For a drift with a layer this was checked when its parameters were bound.
        if drift.model.noise and not drift.model.layered and not drift.shape:
            span = rational(np.min(left)), rational(np.max(right))
            check_noise(drift.model.noise, drift.scalars(), *span)


def _require(holds: Any, words: str, error: type[InputError] = InputError, **numbers: Any) -> None:
    """Raise unless `holds` everywhere; the message has the first numbers for which it fails."""
    if not np.all(holds):
        row = int(np.argmin(np.ravel(holds)))
        raise error(words.format(**{n: float_text(np.ravel(x)[row]) for n, x in numbers.items()}))
