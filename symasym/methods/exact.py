"""The exact integrals (eq:Ttilde, eq:C, eq:P, eq:pss), nothing dropped.

The integrals over panels are found by three engines (`symasym.exact`): `symasym.exact.floats` in
float64 for many scenes at once, `symasym.exact.digits` to any number of digits,
`symasym.exact.ball_sweep` in balls, whose error is proved. What float64 cannot promise to a
relative 1e-12 is computed with more digits.
"""

from __future__ import annotations

from types import ModuleType
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray, float_text, is_array
from symasym.methods.table import quantity_of
from symasym.numbers import balls
from symasym.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    input_rounding,
    rows_of,
    scene_at,
)

if TYPE_CHECKING:
    from symasym.drift.field.directions import Directions

__all__ = ["ROUNDING", "TOLERANCE", "float_logs", "of_scene", "of_scenes"]

#: Relative error of float64 values (of the logarithm, where that is larger than 1).
TOLERANCE = 1e-12
#: Relative error of a logarithm that more digits gave and float64 rounded.
ROUNDING = 4e-16
_SCENES_AT_ONCE = 4096
# Behind a float64 value that was in doubt.
_FLOAT_DIGITS = 17


def of_scene(scene: Scene, request: Request) -> Answer:
    """The value to the request's digits: proved in balls where that is asked for or faster."""
    from symasym.exact import ball_sweep, digits

    dps = request.digits
    try:
        # Where A is no polynomial, ball arithmetic is the faster way as well as the proved one.
        proved = request.full or scene.drift.exact_coefficients() is None
        if proved and balls.available():
            try:
                enclosure = _value(ball_sweep, scene, request.name, dps + 3, request.log)
                return Answer(*balls.to_mpf(enclosure, dps), "bound", (request.name,))
            except AccuracyError:
                pass
        value = _value(digits, scene, request.name, dps, request.log)
    except RangeError:
        raise
    except OverflowError:
        # Widths and counts of panels are planned in float64.
        numbers = ", ".join(f"{name} = {float_text(x)}" for name, x in scene.numbers.items())
        raise AccuracyError(
            f"{numbers} and the drift make 2 |A|/kappa^2 leave the range of float64 (1e308), in "
            "which the evaluation is planned; rescale the problem."
        ) from None
    with own_context(15) as context:
        error = abs(context.make_mpf(value._mpf_)) * context.mpf(10) ** -dps
    return Answer(value, error, "estimate", (request.name,))


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Logarithms right to `TOLERANCE`, and their errors by running analysis."""
    number = len(scenes.lam)
    if number <= _SCENES_AT_ONCE:
        return Answers(*_logs(scenes, request.name), "estimate", (request.name,))
    logs, errors = np.empty(number), np.empty(number)
    for low in range(0, number, _SCENES_AT_ONCE):
        part = slice(low, low + _SCENES_AT_ONCE)
        parameters = {n: x[part] if is_array(x) else x for n, x in scenes.parameters.items()}
        some = rows_of(scenes, part)._replace(parameters=parameters)
        logs[part], errors[part] = _logs(some, request.name)
    return Answers(logs, errors, "estimate", (request.name,))


def float_logs(scenes: Scenes, name: str, directions: Directions | None = None) -> tuple[Any, Any]:
    """Logarithms in float64 and their errors, however large these are; dual arrays where
    `directions` are given."""
    from symasym.drift.field.float_field import field_of
    from symasym.exact import floats

    quantity = quantity_of(name)
    count = len(scenes.lam)
    numbers: dict[str, Any] = {n: scenes.numbers[n] for n in quantity.numbers if n != "kappa"}
    numbers |= {"complement": quantity.complement} if quantity.has_complement else {}
    with np.errstate(over="ignore", under="ignore", invalid="ignore", divide="ignore"):
        field = field_of(scenes.drift, scenes.parameters, count, directions)
        logs, errors = getattr(floats, quantity.verb)(field, scenes.lam, **numbers)
        return logs, errors + input_rounding(scenes, field.size()[:count])


def _logs(scenes: Scenes, name: str) -> tuple[FloatArray, FloatArray]:
    """Logarithms in float64 and their errors; what is in doubt is evaluated with more digits."""
    from symasym.exact import digits

    logs, errors = float_logs(scenes, name)
    doubtful = ~(errors <= TOLERANCE * np.maximum(1.0, np.abs(logs)))
    for row in np.flatnonzero(doubtful):
        logs[row] = float(_value(digits, scene_at(scenes, row), name, _FLOAT_DIGITS, True))
        errors[row] = ROUNDING * abs(logs[row])
    return logs, errors


def _value(engine: ModuleType, scene: Scene, name: str, dps: int, log: bool) -> Any:
    """The quantity, or its logarithm, by one of the engines that know digits."""
    quantity = quantity_of(name)
    options = {"complement": quantity.complement} if quantity.has_complement else {}
    verb = getattr(engine, quantity.verb)
    return verb(scene.drift, **scene.numbers, dps=dps, log=log, **options)
