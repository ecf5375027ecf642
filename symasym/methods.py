"""The table of methods with the quantities of each, and the function `ask` that calls a method.

A method is an entry of `METHODS`. Its module, which is loaded at the first use, provides

``of_scene(scene, request)``
    the `Answer` for one scene in exact numbers, to ``request.digits`` digits;
``of_scenes(scenes, request)``
    in some modules only, the `Answer` for many scenes in float64. In other modules ``of_scene``
    is called for each scene.

`ask` reads the numbers, calls the method, and returns the answer as a float, an array, an mpf or
an `Estimate`. In an array, a scene that the method refuses is nan.
"""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from symasym.base.balls import precision, rounded
from symasym.base.errors import AccuracyError, InputError, RangeError, RegionError, SymasymError
from symasym.base.estimate import Estimate
from symasym.base.inputs import choice, count, digits, flag, shown, within
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    QUANTITIES,
    Answer,
    Request,
    Scenes,
    read,
    require_drift,
    require_sliding,
)

_LARGEST, _SMALLEST = 709.78, -708.39
_BITS = 128  # Arb's precision for arrays
_PROBABILITIES = ("C", "1 - C", "P", "1 - P")


class Method(NamedTuple):
    """An entry of the table of methods.

    For an expansion, `orders` are the default and the highest order; if the series `diverges`, the
    order may be ``"optimal"``. A method that holds `anywhere` admits piecewise drifts, noise that
    depends on u, and any ends, also reflecting ones.
    """

    module: str
    quantities: tuple[str, ...] = tuple(QUANTITIES)
    orders: tuple[int, int] | None = None
    diverges: bool = False
    anywhere: bool = False


#: The methods by their names, in the order in which messages list them.
METHODS = {
    "exact": Method("symasym.exact.floats", (*QUANTITIES, "p_ss"), anywhere=True),
    "paper": Method("symasym.paper"),
    "laplace": Method("symasym.expansions.weak", orders=(2, 20), diverges=True, anywhere=True),
    "uniform": Method("symasym.expansions.uniform", orders=(2, 6)),
    "strong_noise": Method("symasym.expansions.strong_noise", orders=(2, 100)),
    "bound": Method("symasym.exact.balls", ("C", "1 - C")),
    "auto": Method("symasym.plan", anywhere=True),
}


def ask(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    """The value of the requested quantity at these numbers; all options are checked here."""
    require_drift(drift, plain=False)
    name, method, order, dps, log, full, moment, reflecting, rtol = request
    choice("method", method, [m for m, row in METHODS.items() if name in row.quantities])
    if method == "auto":
        rtol = within("rtol", 1e-6 if rtol is None else rtol, 1e-12 if dps is None else 1e-300, 0.5)
    elif rtol is not None:
        raise InputError(f"rtol is {shown(rtol)}, which is for method 'auto'; leave it out.")
    count("moment", moment, 1, 20)
    choice("reflecting", reflecting, [None, "left", "right"])
    asked = digits(dps), flag("log", log), flag("full", full), moment, reflecting, rtol
    request = Request(name, method, _orders(method, order), *asked)
    try:
        return _asked(drift, numbers, request)
    except SymasymError:
        raise
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise AccuracyError(
            f"the numbers are too extreme for method {method!r}, or cancel; rescale the problem, "
            "or use another method."
        ) from error


def _orders(method: str, order: Any) -> Sequence[int]:
    """The orders of an expansion to choose from; all orders of the method for ``"optimal"``."""
    row = METHODS[method]
    if row.orders is None:
        if order is not None:
            raise InputError(
                f"order is {shown(order)}, but method {method!r} has none; leave it out, or give "
                "the method of an expansion, such as 'laplace'."
            )
        return ()
    default, most = row.orders
    if row.diverges and isinstance(order, str) and order == "optimal":
        return range(most + 1)
    return (default if order is None else count("order", order, 0, most),)


def _asked(drift: Drift, numbers: dict[str, Any], request: Request) -> Any:
    method, mean = METHODS[request.method], request.moment == 1 and not request.stationary
    # Expansions of higher moments and of stationary quantities exist only for the paper's scenes.
    elsewhere = method.anywhere and (mean or not method.orders)
    if not elsewhere and not is_usual(drift, numbers, request):
        takes = "takes one layer with constant noise, the ends -r and r, and means"
        if method.anywhere:
            takes = "gives means and, for one layer with constant noise, the layer's occupation"
        raise RegionError(f"method {request.method!r} {takes}; use method 'exact'.")
    if request.stationary and drift.model.layered and "left" not in numbers and not drift.shape:
        require_sliding(drift)
    by_floats = request.method in ("exact", "auto") and not request.full
    scenes = read(drift, numbers, request.reflecting)
    if request.dps is not None or not (scenes.shape or by_floats):
        of_scene = importlib.import_module(method.module).of_scene
        return in_digits(request, of_scene(scenes.one(), request))
    return in_floats(request, scenes.shape, of_scenes(scenes, request))


def is_usual(drift: Drift, numbers: dict[str, Any], request: Request) -> bool:
    """True for a scene of the paper: a drift with a layer, constant noise, the interval (-r, r)."""
    other = numbers.keys() & {"left", "low"} or request.moment > 1 or request.reflecting
    return drift.model.plain and not other


def of_scenes(scenes: Scenes, request: Request) -> Answer:
    """The answer of a method for many scenes, independent of the caller's precision in Arb."""
    module: Any = importlib.import_module(METHODS[request.method].module)
    with precision(_BITS):
        if hasattr(module, "of_scenes"):
            found: Answer = module.of_scenes(scenes, request)
            return found
        logs, errors = (np.full(len(scenes.lam), np.nan) for _ in range(2))
        last, why = Answer(logs, "none"), ""
        for row in range(len(logs)):
            try:
                scene = scenes.at(row)
                if request.stationary:
                    require_sliding(scene.drift)
                last = module.of_scene(scene, request)
            except SymasymError as error:
                why = why or str(error)
                continue
            value, off = last.value.mid(), last.value.rad()
            if not request.log:
                value, off = value.log(), (off / value).log1p()
            logs[row] = float(value)
            errors[row] = float(off.upper()) + 2e-16 * abs(logs[row])
        return last._replace(value=logs, error=None if last.kind == "none" else errors, why=why)


# -- answers ---------------------------------------------------------------------------------------


def in_floats(request: Request, shape: tuple[int, ...], answer: Answer) -> Any:
    """The result in the requested form from logarithms and their errors; nan without a value."""
    log, logs, why = request.log, answer.value.reshape(shape), answer.why
    fits = np.isfinite(logs) & (log | (logs >= _SMALLEST) & (logs <= _LARGEST))
    if not fits.all():
        first = float(logs[~fits].flat[0])
        why = why or _misfit(request.name, first)
        if not shape:
            raise AccuracyError(why) if first != first else RangeError(why)
    logs = np.where(fits, logs, np.nan)
    value: Any = logs if log else np.exp(logs)
    error: Any = None
    if answer.error is not None:
        # The logarithm of a value close to 1 may have underflowed.
        error = answer.error.reshape(shape) + 1e-300
        if not log:
            # exp and the product round once more. Elements replaced by nan may have any error.
            with np.errstate(over="ignore"):
                error = value * (np.expm1(error) * (1 + 1e-15) + 4e-16)
    notes: tuple[str, ...] = ()
    if not fits.all():
        index, many = ", ".join(map(str, np.argwhere(~fits)[0])), (~fits).sum()
        more = f" and {many - 1} more" * bool(many > 1)
        notes = (f"no value at index ({index}){more}: {why}",)
    return _as_asked(request, value if shape else float(value), error, answer, notes)


def in_digits(request: Request, answer: Answer) -> Any:
    """The result in the requested form from a ball: a float, or an mpf with its error."""
    ball = answer.value
    value, error = rounded(ball, request.dps)
    if request.dps is None:
        with precision(64):
            size = abs(ball.mid())
            plain = request.log or size == 0
            log = value if plain else float(size.log())
        if not (np.isfinite(log) if plain else _SMALLEST <= log <= _LARGEST):
            raise RangeError(_misfit(request.name, log))
    return _as_asked(request, value, None if answer.kind == "none" else error, answer)


def _as_asked(
    request: Request, value: Any, error: Any, answer: Answer, notes: tuple[str, ...] = ()
) -> Any:
    """The value, or an `Estimate`, with a note if a probability is rounded to 1."""
    if not request.full:
        return value
    if request.name in _PROBABILITIES and not request.log and np.any(value == 1):
        way = "leave complement out for" if request.complement else "complement has"
        notes = (f"{request.name} is 1 to these digits; {way} the rest", *notes)
    method = answer.method or request.method
    return Estimate(value, error, answer.kind, method, answer.order, answer.notes + notes)


def _misfit(name: str, log: float) -> str:
    if log != log:
        return f"{name} has no value by this method; use method 'exact'."
    if not np.isfinite(log):
        return f"log {name} is outside the range of float64; ask for digits (dps)."
    return f"{name} is e^{log:.6g}, outside the range of float64; ask for digits (dps) or its log."
