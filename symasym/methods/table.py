"""The quantities, the methods with what each of them answers, and the driver of all of them.

A method is a record of this table. Its home, a module that is loaded when the method is first
asked, has the steps:

``of_scene(scene, request)``
    the `Answer` for one scene in exact numbers, to ``request.digits`` digits;
``of_scenes(scenes, request)``
    the `Answers` for scenes in float64.

Reading the scene before and handing the answer back after is the one driver's, `answer`.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol, cast

import numpy as np

from symasym.base.errors import AccuracyError, InputError, RegionError
from symasym.base.estimate import Estimate
from symasym.base.inputs import Number, exact, float_text, shown
from symasym.base.texts import meant
from symasym.drift.drift import Drift
from symasym.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    as_digits,
    as_floats,
    float_scenes,
    one_scene,
    read_order,
    read_scene,
    require_drift,
)

__all__ = [
    "METHODS", "QUANTITIES", "Ask", "Method", "Quantity", "alone", "answer", "quantity_of",
    "require_drift_of", "require_method",
]  # fmt: skip


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


#: A question about one drift and its numbers.
Ask = Callable[[Drift, dict[str, Any], Request], Any]


class Home(Protocol):
    """The steps of a method."""

    def of_scene(self, scene: Scene, request: Request) -> Answer:
        """The answer for one scene."""

    def of_scenes(self, scenes: Scenes, request: Request) -> Answers:
        """The answers for many."""


@dataclass(frozen=True)
class Method:
    """A method of the table.

    Attributes
    ----------
    name : str
    quantities : tuple of str
        Names of the quantities that it answers.
    module : str
        Its home.
    about : str
        What it gives, in a line.
    orders : tuple of int or None
        Of an expansion: the order that is taken where none is given, and the highest.
    optimal : bool
        The order may be ``"optimal"``: the series diverges.
    in_float : callable
        Of a drift and a request: True where one scene is answered in float64, like many.
    """

    name: str
    quantities: tuple[str, ...]
    module: str
    about: str
    orders: tuple[int, int] | None = None
    optimal: bool = False
    in_float: Callable[[Drift, Request], bool] = lambda drift, request: False

    @property
    def home(self) -> Home:
        """The module with its steps."""
        return cast(Home, importlib.import_module(self.module))

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
        if self.orders[1] == 0:
            if order is not None and read_order(order, 0, 10**9) != 0:
                raise InputError(
                    f"order is {shown(order)}, but method {self.name!r} is of order 0; leave it "
                    "out, or use method='uniform'."
                )
            return request._replace(order=0)
        return request._replace(order=read_order(order, *self.orders))


def _without_error(drift: Drift, request: Request) -> bool:
    """True where no error is asked for, which the exact value has from more digits."""
    return not request.full


def _unproved(drift: Drift, request: Request) -> bool:
    """True where no error is asked for, or none can be proved."""
    from symasym.numbers import balls

    return not (request.full and balls.available())


#: Of kappa^2: the order where none is given, and the highest.
WEAK_NOISE_ORDERS = (2, 20)

_ALL = tuple(QUANTITIES)
_NOISE = "symasym.asymptotics"

#: By their names, in the order in which messages list them.
METHODS = {method.name: method for method in (
    Method("exact", (*_ALL, "p_ss"), "symasym.methods.exact", "the integral, nothing dropped",
           in_float=_without_error),
    Method("paper", _ALL, "symasym.paper", "the paper's own leading order"),
    Method("laplace", _ALL, "symasym.methods.laplace", "weak noise, in powers of kappa^2",
           WEAK_NOISE_ORDERS, optimal=True),
    Method("local", ("T",), f"{_NOISE}.uniform.answer",
           "weak noise near a fold, to leading order", (0, 0)),
    Method("uniform", ("T", "P", "1 - P"), f"{_NOISE}.uniform.answer",
           "weak noise, also where wells, barriers, the start or an end meet", (2, 6)),
    Method("strong_noise", _ALL, f"{_NOISE}.strong_noise.answer", "in powers of 2/kappa^2",
           (2, 100), in_float=_unproved),
    Method("bound", ("C", "1 - C"), f"{_NOISE}.proofs.exit_bounds",
           "two proved bounds, which close as kappa goes to 0"),
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
        return as_floats(request, scenes.shape, method.home.of_scenes(scenes, request))
    scene = read_scene(drift, numbers, request.dps)
    return as_digits(request, method.home.of_scene(scene, request))


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
