"""The methods with what each of them answers, and the one driver of all of them.

A method is a record of `METHODS`. Its module, loaded when the method is first asked, has

``of_scene(scene, request)``
    the `Answer` for one scene in exact numbers, to ``request.digits`` digits;
``of_scenes(scenes, request)``
    in some modules, or in the one that the record names for it: the `Answers` for many scenes in
    float64. Where it is missing, scenes are asked one by one.

`answer` reads the numbers, asks the method, and hands the answer back as a float, an array, an mpf
or an `Estimate`. In an array a scene that a method refuses is nan.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np

from symasym.base.errors import AccuracyError, InputError, RangeError, RegionError, SymasymError
from symasym.base.estimate import ErrorKind, Estimate
from symasym.base.inputs import count, shown
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    QUANTITIES,
    Answer,
    Answers,
    Request,
    Scenes,
    float_scenes,
    one_scene,
    quantity_of,
    read_scene,
    scene_at,
)

__all__ = ["METHODS", "WEAK_NOISE_ORDERS", "Method", "answer", "as_floats", "of_scenes"]

#: Of kappa^2: the order where none is given, and the highest.
WEAK_NOISE_ORDERS = (2, 20)
_LARGEST, _SMALLEST = 709.78, -708.39
_BITS = 128  # of Arb's numbers behind an array
_ALL = tuple(QUANTITIES)
#: Methods for drifts of pieces, noise that depends on u, any ends and reflecting ones.
_EVERYWHERE = ("exact", "laplace")


@dataclass(frozen=True)
class Method:
    """A method of the table.

    Attributes
    ----------
    quantities : tuple of str
        Names of the quantities that it answers.
    module : str
        The module with its steps.
    about : str
        What it gives, in a line.
    orders : tuple of int or None
        Of an expansion: the order that is taken where none is given, and the highest.
    diverges : bool
        The order may be ``"optimal"``.
    arrays : str
        The module for many scenes where it is another one.
    """

    quantities: tuple[str, ...]
    module: str
    about: str
    orders: tuple[int, int] | None = None
    diverges: bool = False
    arrays: str = ""


#: By their names, in the order in which messages list them.
METHODS = {
    "exact": Method(
        (*_ALL, "p_ss"), "symasym.exact.balls", "the integral, nothing dropped",
        arrays="symasym.exact.floats",
    ),
    "paper": Method(_ALL, "symasym.paper", "the paper's own leading order"),
    "laplace": Method(
        _ALL, "symasym.expansions.weak", "weak noise, in powers of kappa^2", WEAK_NOISE_ORDERS,
        diverges=True,
    ),
    "uniform": Method(
        _ALL, "symasym.expansions.uniform",
        "weak noise, also where wells, barriers, the start or an end meet", (2, 6),
    ),
    "strong_noise": Method(
        _ALL, "symasym.expansions.strong_noise", "in powers of 2/kappa^2", (2, 100)
    ),
    "bound": Method(
        ("C", "1 - C"), "symasym.exact.balls", "proved bounds around the exact value"
    ),
}  # fmt: skip


def answer(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The quantity of `request` by its method, which is none of its choosing."""
    request = request._replace(order=_order(request))
    mean = request.name[-1] in "TC" and request.moment == 1
    if request.method not in _EVERYWHERE[: 1 + mean]:
        require_paper(drift, numbers, request)
    if quantity_of(request.name).sliding and drift.model.layered and "left" not in numbers:
        require_sliding(drift)
    one = one_scene(drift, numbers)
    if one and (request.dps is not None or request.full or request.method != "exact"):
        step = importlib.import_module(METHODS[request.method].module).of_scene
        scene = read_scene(drift, numbers, request.reflecting)
        return as_digits(request, step(scene, request))
    if request.dps is not None:
        raise InputError(
            f"dps is {request.dps} for arrays, which are float64; ask for one element at a time."
        )
    scenes = float_scenes(drift, numbers, request.reflecting)
    return as_floats(request, scenes.shape, of_scenes(scenes, request))


def _order(request: Request) -> Any:
    """The order of the request; all of the method's for ``"optimal"``."""
    order, method = request.order, METHODS[request.method]
    if method.orders is None:
        if order is not None:
            raise InputError(
                f"order is {shown(order)}, but method {request.method!r} has none; leave it out."
            )
        return None
    default, most = method.orders
    if method.diverges and isinstance(order, str) and order == "optimal":
        return range(most + 1)
    return default if order is None else count("order", order, 0, most)


def is_usual(drift: Drift, numbers: dict[str, Any], request: Request) -> bool:
    """True for a scene of the paper."""
    other = numbers.keys() & {"left", "low"} or request.moment > 1 or request.reflecting
    return drift.model.plain and not other


def require_paper(drift: Drift, numbers: dict[str, Any], request: Request) -> None:
    """Raise unless the scene is one of the paper: a layer, constant noise, from -r to r."""
    if not is_usual(drift, numbers, request):
        raise RegionError(
            f"method {request.method!r} holds for means in (-r, r), drifts that are constant "
            "outside a layer, and constant noise; use method='exact'."
        )


def require_sliding(drift: Drift) -> None:
    """Raise unless there is a stationary density."""
    left, right = np.broadcast_arrays(*map(np.asarray, drift.ends))
    wrong = np.flatnonzero(~((left > 0) & (right < 0)).astype(bool))
    if wrong.size:
        a, b = (f"{float(x.flat[wrong[0]]):.6g}" for x in (left, right))
        raise RegionError(
            f"a- = {a} and a+ = {b} make no sliding region (a- > 0 > a+), so there is no "
            "stationary density; ask for escape_time instead."
        )


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The answers of a method for many scenes, whatever Arb's precision is outside."""
    from symasym.base.balls import precision

    method = METHODS[request.method]
    module: Any = importlib.import_module(method.arrays or method.module)
    with precision(_BITS):
        if hasattr(module, "of_scenes"):
            found: Answers = module.of_scenes(scenes, request)
            return found
        return _each(module, scenes, request)


def _each(module: Any, scenes: Scenes, request: Request) -> Answers:
    """The answers of a method that takes one scene at a time."""
    from flint import arb

    logs, errors = (np.full(len(scenes.lam), np.nan) for _ in range(2))
    kind: ErrorKind = "none"
    why, last = "", None
    for row in range(len(logs)):
        try:
            last = module.of_scene(scene_at(scenes, row), request)
        except SymasymError as error:
            why = why or str(error)
            continue
        value, off, kind = last.value, last.error, last.kind
        if not request.log:
            value, off = arb(value).log(), off and (arb(off) / arb(value)).log1p().upper()
        logs[row] = float(value)
        if off is not None:
            errors[row] = float(off) + 2e-16 * abs(logs[row])
    terms, dropped = (last.terms, last.dropped) if last else ((), ())
    return Answers(logs, None if kind == "none" else errors, kind, terms, dropped, why)


# -- answers ---------------------------------------------------------------------------------------


def as_floats(request: Request, shape: tuple[int, ...], answers: Answers) -> Any:
    """Logarithms and their errors as what was asked for; nan where there is no value."""
    name, log, why = request.name, request.log, answers.why
    logs = answers.logs.reshape(shape)
    fits = np.isfinite(logs) & (log | (logs >= _SMALLEST) & (logs <= _LARGEST))
    if not fits.all():
        first = float(logs[~fits].flat[0])
        why = why or _misfit(name, first)
        if not shape:
            raise AccuracyError(why) if first != first else RangeError(why)
    logs = np.where(fits, logs, np.nan)
    value = logs if log else np.exp(logs)
    if not request.full:
        return float(value) if not shape else value
    error: Any = None
    if answers.errors is not None:
        # A logarithm close to 0 may have underflowed.
        error = answers.errors.reshape(shape) + 1e-300
        if not log:
            # exp rounds once more, and so does the product; what is left out may have any error.
            with np.errstate(over="ignore"):
                error = value * (np.expm1(error) * (1 + 1e-15) + 4e-16)
    notes = _notes(request, value)
    if not fits.all():
        index = ", ".join(map(str, np.argwhere(~fits)[0]))
        notes += (f"no value at index ({index}): {why}",)
    return _estimate(request, value, error, answers.kind, answers, notes)


def as_digits(request: Request, answer: Answer) -> Any:
    """A float, or an mpf of so many digits, with its error, as what was asked for."""
    import mpmath
    from mpmath import libmp

    dps, value, error = request.dps, answer.value, answer.error
    if dps is None:
        log = float(value if request.log or not value else mpmath.MPContext().log(abs(value)))
        if not (np.isfinite(log) if request.log or not value else _SMALLEST <= log <= _LARGEST):
            raise RangeError(_misfit(request.name, log))
        rounded: Any = float(value)
        exactly = libmp.from_float(rounded)
    else:
        exactly = libmp.mpf_pos(value._mpf_, libmp.dps_to_prec(dps), "n")
        rounded = mpmath.mp.make_mpf(exactly)
    if not request.full:
        return rounded
    if error is not None:
        # Differences without a precision are exact in libmp; only the sum of the errors rounds.
        shift = libmp.mpf_abs(libmp.mpf_sub(value._mpf_, exactly))
        error = mpmath.mp.make_mpf(libmp.mpf_add(error._mpf_, shift, 53, "u"))
        # What is below the range is flushed to 0.
        error = np.nextafter(float(error), np.inf).item() if dps is None else error
    return _estimate(request, rounded, error, answer.kind, answer, _notes(request, rounded))


def _estimate(
    request: Request,
    value: Any,
    error: Any,
    kind: ErrorKind,
    said: Answer | Answers,
    notes: tuple[str, ...],
) -> Estimate:
    order = getattr(said, "order", None)
    if order is None and not isinstance(request.order, range):
        order = request.order
    return Estimate(value, error, kind, request.method, order, said.terms, said.dropped, notes)


def _misfit(name: str, log: float) -> str:
    if log != log:
        return f"{name} has no value by this method; use method='exact'."
    if not np.isfinite(log):
        return f"log {name} is outside the range of float64; pass log=True with dps=…."
    return f"{name} is e^{log:.6g}, outside the range of float64; pass log=True, or dps=…."


def _notes(request: Request, value: Any) -> tuple[str, ...]:
    """What a reader of a probability that prints 1 should know."""
    if request.log or not quantity_of(request.name).has_complement or not np.any(value == 1):
        return ()
    way = "leave complement out for" if request.complement else "complement=True has"
    return (f"{request.name} is 1 to these digits; {way} the rest",)
