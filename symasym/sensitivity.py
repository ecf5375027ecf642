"""How much a quantity changes with each of its parameters."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from symasym.base.call_context import expect, mpf_of, own_context, patient, to_mpf
from symasym.base.errors import AccuracyError, InputError, RangeError, TimeLimitError
from symasym.base.estimate import IN_WORDS, ErrorKind, with_errors
from symasym.base.inputs import FloatArray, Numbers, choice, digits, exact
from symasym.drift.drift import Drift
from symasym.methods import answer, require_drift_of
from symasym.numbers.trees import MpmathOps
from symasym.scenes import (
    FLOAT_DIGITS,
    QUANTITIES,
    Request,
    Scene,
    Scenes,
    float_scenes,
    read_scene,
    require_drift,
    scene_at,
)

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext
    from numpy.typing import NDArray

__all__ = ["Sensitivity", "sensitivity"]

_ATTEMPTS = 12
_MOST_DIGITS = 10_000
# Error of p d/dp in float64, relative to the largest of a scene or to 1, that more digits are taken
# for.
_ENOUGH = 1e-7
# Values that a derivative is made of.
_NODES = 4
# More than the relative rounding of a division in float64; beyond its range.
_ROUNDING, _LARGEST = 1.2e-16, 2.0**1023


@dataclass(frozen=True)
class Sensitivity:
    """Derivatives and condition numbers by the name of the parameter.

    Attributes
    ----------
    quantity : str
    derivative : dict of str to float, mpf or ndarray
        d log(quantity) / d(parameter), which is also the derivative of the logarithm that
        ``log=True`` gives elsewhere.
    error : dict of str to float, mpf or ndarray
        Absolute error of `derivative`.
    condition : dict of str to float, mpf or ndarray
        Of the quantity: ``|parameter * derivative|``, the relative change of the quantity over that
        of the parameter.
    log_condition : dict of str to float, mpf or ndarray
        Of its logarithm: the same over ``|log(quantity)|``.
    error_kind : {"bound", "estimate"}
        ``"bound"``: proved.
    """

    quantity: str
    derivative: dict[str, Any]
    error: dict[str, Any]
    condition: dict[str, Any]
    log_condition: dict[str, Any]
    error_kind: ErrorKind

    def __str__(self) -> str:
        """A line for each parameter: the derivative with its error, and the condition number."""
        rows = [f"d log({self.quantity})/d(parameter), {IN_WORDS[self.error_kind]}; condition"]
        for name, value in self.derivative.items():
            shown = with_errors(value, self.error[name])
            condition = self.condition[name]
            if not isinstance(condition, np.ndarray):
                condition = f"{float(condition):.3g}"
            rows.append(f"  {name}: {shown}; {condition}")
        return "\n".join(rows)


@patient
def sensitivity(
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    start: Numbers = 0,
    quantity: Literal["T", "C", "1 - C", "P", "1 - P"] = "T",
    dps: int | None = None,
    patience: float | None = None,
) -> Sensitivity:
    """Logarithmic derivatives and condition numbers with respect to every parameter.

    Parameters
    ----------
    drift : Drift
        With a value for each of its parameters; values may be arrays.
    kappa, r, start : number or array_like
        As in `escape_time`, scaled.
    quantity : {"T", "C", "1 - C", "P", "1 - P"}
        Escape time, exit probability, occupation; the last two take no `r`.
    dps : int, optional
        Digits, 1 to 4,000. None: float64, arrays allowed, mostly right to 1e-11.
    patience : float, optional
        Seconds of processor time that it may take, 10 if left out.

    Returns
    -------
    Sensitivity
        For each drift parameter and for kappa, r and start. With `dps` each derivative is right to
        so many digits, or places where it is below 1.

    Raises
    ------
    InputError
        As the quantity itself does.
    AccuracyError
        If the differences do not settle, as where the quantity is not differentiable.

    Notes
    -----
    In float64: forward differentiation of the panels' integrals and of the sweep over them, from
    one set of samples; the error is an estimate, by running analysis of the derivatives' rounding
    and of what the nodes miss of the derivative of A by p. Where it is above 1e-7 (of p times the
    derivative, beside the largest of the scene or 1), it is found with 20 digits as below.

    With `dps`, python-flint and moderate noise: the exact integrals differentiated panel by panel
    in ball arithmetic, and the errors are proved (`error_kind` ``"bound"``).

    Otherwise (``"estimate"``): the sweeps to many digits with numbers that carry their derivatives
    (`symasym.exact.digit_derivatives`), computed with more digits than are claimed. Where a
    derivative of A varies too fast for A's own panels: differences of the exact integrals, central
    or at the end of a parameter's range one-sided, with so many digits that the step is as small as
    the digits asked for need. Two steps h and 2h are extrapolated to h^4; the error claimed is that
    of the *single* step, the difference of the two, which is of order h^2, plus the rounding. This
    takes about four evaluations for each parameter of a scene.

    Examples
    --------
    >>> import symasym as sa
    >>> change = sa.sensitivity(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.1", 10)
    >>> print(f"{change.condition['kappa']:.9g} {change.condition['z0']:.9g}")
    50.8370975 40.04365
    >>> print(f"{change.log_condition['kappa']:.4f}")
    1.9401
    """
    quantity = choice("quantity", quantity, QUANTITIES)
    require_drift(drift)
    numbers = _numbers(quantity, kappa, r, start)
    require_drift_of(quantity, drift)
    if dps is not None:
        most = _MOST_DIGITS * 2 // 5
        dps = digits(dps, most)
        return _in_digits(quantity, read_scene(drift, numbers, dps), dps)
    return _in_floats(quantity, float_scenes(drift, numbers, laplace=False))


def _numbers(quantity: str, kappa: Numbers, r: Numbers | None, start: Numbers) -> dict[str, Any]:
    """The quantity's own numbers; InputError where r is missing or given in vain."""
    given = {"kappa": kappa, "r": r, "start": start}
    takes = QUANTITIES[quantity].numbers
    if ("r" in takes) != (r is not None):
        rule = "is missing; give the escape radius" if r is None else "is given, but unused"
        raise InputError(f"r {rule}: {quantity} depends on {', '.join(takes)}.")
    return {name: given[name] for name in takes}


# -- one scene -------------------------------------------------------------------------------


class _Slope(NamedTuple):
    """A derivative of log(quantity) and its error."""

    value: Any
    error: Any


class _Slopes(NamedTuple):
    """log(quantity), its derivatives, and the values of the parameters there."""

    log: Any
    slopes: dict[str, _Slope]
    values: dict[str, Fraction]


def _log(quantity: str, drift: Drift, numbers: Mapping[str, Fraction], dps: int) -> mpf:
    """The exact integral's logarithm to `dps` digits."""
    return answer(drift, dict(numbers), Request(quantity, "exact", None, dps, True, False))


def _by_differences(quantity: str, scene: Scene, dps: int) -> _Slopes:
    """Derivatives from differences of the exact integrals."""
    drift, numbers = scene.drift, scene.numbers
    at = {**drift.scalars(), **numbers}

    seconds: list[float] = []

    def log_at(name: str, value: Fraction, n: int) -> mpf:
        """The logarithm with another value of one parameter, to n digits."""
        begun = time.thread_time()
        if name in numbers:
            log = _log(quantity, drift, {**numbers, name: value}, n)
        else:
            log = _log(quantity, drift.bind(**{name: value}), numbers, n)
        seconds.append(time.thread_time() - begun)
        if len(seconds) > 1:
            # What is found of a drift makes later values faster.
            rest = _NODES * len(at) - len(seconds)
            expect(min(seconds) * rest, f"{rest} more values for the differences")
        return log

    size = _size(drift, numbers)
    slopes = {
        # At the end of its range a parameter can move one way only.
        name: _slope(
            partial(log_at, name), value, _unit(name, at), _at_an_end(drift, name, value), size, dps
        )
        for name, value in at.items()
    }
    return _Slopes(_log(quantity, drift, numbers, dps), slopes, at)


def _by_balls(quantity: str, scene: Scene, dps: int) -> _Slopes | None:
    """The same, proved; None where balls are missing or take too long."""
    from symasym.exact.balls import derivatives
    from symasym.numbers import balls

    if not balls.available():
        return None
    drift, numbers = scene.drift, scene.numbers
    try:
        if "r" in numbers:
            enclosed = derivatives.log_slopes(quantity, drift, **numbers, dps=dps)
        else:
            enclosed = derivatives.log_slopes_of_occupation(quantity, drift, numbers["kappa"], dps)
    # A derivative of A may be singular where A is not; what is wrong for itself is said later.
    except (AccuracyError, InputError):
        return None
    at = {**drift.scalars(), **numbers}
    slopes = {name: _Slope(*balls.to_mpf(enclosed[name], dps + 10)) for name in at}
    return _Slopes(balls.to_mpf(enclosed[derivatives.LOG], dps + 10)[0], slopes, at)


def _by_digits(quantity: str, scene: Scene, dps: int) -> _Slopes:
    """Derivatives from sweeps that carry them; differences where A's derivatives prevent it."""
    from symasym.exact import digit_derivatives

    drift, numbers = scene.drift, dict(scene.numbers)
    size = _size(drift, numbers)
    try:
        log, found = digit_derivatives.log_slopes(quantity, drift, numbers, dps, size)
    except TimeLimitError:
        raise
    except (AccuracyError, InputError):
        return _by_differences(quantity, scene, dps)
    at = {**drift.scalars(), **numbers}
    with own_context(dps) as context:
        # The sweeps hold more digits; half a unit of the last one that is asked for is claimed.
        half = context.mpf(10) ** -dps / 2
        slopes = {name: _Slope(found[name], half * max(1, abs(found[name]))) for name in at}
    return _Slopes(log, slopes, at)


def _unit(name: str, at: Mapping[str, Fraction]) -> Fraction:
    """A distance within which log(quantity) is taken for smooth, the noise left aside."""
    unit = min(Fraction(1), abs(at[name]) or Fraction(1))
    if name in ("r", "start") and "r" in at:
        unit = min(unit, at["r"] - abs(at["start"]))
    return unit


def _at_an_end(drift: Drift, name: str, value: Fraction) -> bool:
    """True where a drift's parameter is 0 and no less is allowed."""
    if value or name not in drift.parameters:
        return False
    try:
        drift.bind(**{name: Fraction(-1, 2**30)})
    except InputError:
        return True
    return False


def _size(drift: Drift, numbers: Mapping[str, Fraction]) -> int:
    """log10 of how fast the exponents change with a parameter, roughly; never below 0."""
    with own_context(15) as context:
        ops = MpmathOps(context)
        points = (ops.rational(Fraction(k, 4)) for k in range(-4, 5))
        most = exact("A", max(abs(drift.evaluate(u, ops)) for u in points))
    total = (2 / numbers["kappa"] ** 2) * (1 + most) * (1 + numbers.get("r", 0))
    return max(0, (total.numerator.bit_length() - total.denominator.bit_length()) * 3 // 10 + 1)


def _slope(
    log_at: Callable[[Fraction, int], Any],
    value: Fraction,
    unit: Fraction,
    one_sided: bool,
    size: int,
    dps: int,
) -> _Slope:
    """The derivative at `value`, with steps and digits until both of its errors are small.

    The step is 10^-places units, the working precision n digits.
    """
    places = size + dps // 2 + 4
    unit_places = max(0, -_exponent(unit))
    n = dps + places + unit_places + 4
    for _ in range(_ATTEMPTS):
        if n > _MOST_DIGITS:
            break
        h = unit / 10**places
        with own_context(n + 10) as context:
            logs = [context.convert(log_at(x, n)) for x in _nodes(value, h, one_sided)]
            step = mpf_of(h, context)
            single, double = _differences(logs, step, one_sided)
            slope = single + (single - double) / 3
            truncation = abs(single - double)
            # `n` digits of each logarithm, the weights of a difference adding up to 8 at most.
            rounding = 8 * max(1, max(map(abs, logs))) * context.mpf(10) ** -n / step
            allowed = max(1, abs(slope)) * context.mpf(10) ** -dps / 2
            if truncation + rounding <= allowed:
                return _Slope(slope, truncation + rounding)
            # A step smaller by 10 makes the truncation smaller by 100, the rounding larger by 10.
            finer = 0
            if truncation > allowed / 2:
                finer = _lacking(context, truncation, allowed) // 2 + 1
            places += finer
            n += 2 * finer
            if rounding > allowed / 2:
                n += _lacking(context, rounding, allowed) + 1
    raise AccuracyError(
        "the differences of the logarithm do not settle; ask for fewer digits, or move away from "
        "where the quantity is not smooth."
    )


def _nodes(value: Fraction, h: Fraction, one_sided: bool) -> list[Fraction]:
    """The parameter values of the two difference quotients."""
    return [value + k * h for k in ((0, 1, 2, 4) if one_sided else (-2, -1, 1, 2))]


def _differences(logs: list[Any], h: mpf, one_sided: bool) -> tuple[Any, Any]:
    """Two values of the derivative, with errors of order h^2 and (2h)^2."""
    if one_sided:
        here, one, two, four = logs
        return (4 * one - two - 3 * here) / (2 * h), (4 * two - four - 3 * here) / (4 * h)
    below2, below, above, above2 = logs
    return (above - below) / (2 * h), (above2 - below2) / (4 * h)


def _exponent(x: Fraction) -> int:
    """log10, rounded down or one less."""
    return (x.numerator.bit_length() - x.denominator.bit_length() - 1) * 30103 // 100_000


def _lacking(context: MPContext, error: mpf, allowed: mpf) -> int:
    """Digits by which `error` is too large."""
    return int(context.ceil(context.log10(error / allowed))) + 1


# -- as what was asked for -------------------------------------------------------------------


def _in_digits(quantity: str, scene: Scene, dps: int) -> Sensitivity:
    """Derivatives of one scene to so many digits, proved where balls allow it."""
    proved = _by_balls(quantity, scene, dps)
    found = proved or _by_digits(quantity, scene, dps)
    kind: ErrorKind = "bound" if proved else "estimate"
    result = Sensitivity(quantity, {}, {}, {}, {}, kind)
    with own_context(dps + 10) as context:
        log = abs(context.convert(found.log))
        for name, slope in found.slopes.items():
            value = context.convert(slope.value)
            condition = abs(value * mpf_of(found.values[name], context))
            relative = condition and (condition / log if log else context.inf)
            rounded = to_mpf(value, dps)
            # Rounding the value is part of its error, and the error itself is rounded, too.
            error = context.convert(slope.error) + abs(context.convert(rounded) - value)
            result.derivative[name] = rounded
            result.error[name] = to_mpf(error * (1 + context.mpf(2) ** -20), max(dps, 15))
            result.condition[name] = to_mpf(condition, dps)
            result.log_condition[name] = to_mpf(relative, dps)
    return result


def _in_floats(quantity: str, scenes: Scenes) -> Sensitivity:
    """Derivatives of many scenes in float64; by more digits where forward ones say little."""
    from symasym.exact.floats import pieces

    names, *found = zip(*(_by_floats(quantity, some) for some in pieces(scenes)), strict=True)
    logs, slopes, errors, fine = (np.concatenate(parts, axis=-1) for parts in found)
    for k in np.flatnonzero(~fine):
        closer = _by_digits(quantity, scene_at(scenes, k), FLOAT_DIGITS)
        logs[k] = float(closer.log)
        with own_context(FLOAT_DIGITS + 10) as context:
            for j, name in enumerate(names[0]):
                value, error = map(context.convert, closer.slopes[name])
                slopes[j, k] = float(value)
                errors[j, k] = float(error + abs(value - slopes[j, k]))
    beyond = np.argwhere(~(np.abs(slopes) < _LARGEST))
    if beyond.size:
        name = names[0][beyond[0][0]]
        raise RangeError(
            f"d log({quantity})/d({name}) is outside the range of float64; pass dps=…."
        )
    # What float64 takes for 0 is none.
    errors = np.maximum(errors * (1 + 2.0**-20), 5e-324)
    at = {**scenes.parameters, **scenes.numbers}
    values = np.array([np.broadcast_to(np.float64(at[n]), logs.shape) for n in names[0]])
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        conditions = np.abs(slopes * values)
        relative = np.where(conditions == 0, 0.0, conditions / np.abs(logs))

    def shaped(rows: FloatArray) -> dict[str, Any]:
        """By the name of the parameter, floats or arrays of the answer's shape."""
        each = (x.reshape(scenes.shape) if scenes.shape else x.item() for x in rows)
        return dict(zip(names[0], each, strict=True))

    parts = shaped(slopes), shaped(errors), shaped(conditions), shaped(relative)
    return Sensitivity(quantity, *parts, "estimate")


def _by_floats(
    quantity: str, scenes: Scenes
) -> tuple[list[str], FloatArray, FloatArray, FloatArray, NDArray[np.bool_]]:
    """Forward differentiation in float64.

    Returns the parameters' names, log(quantity), its derivatives and their errors (parameters
    first), and where these say something.
    """
    from symasym.drift.field.directions import Directions
    from symasym.exact.floats import float_logs

    moved = scenes.moved.get("start", 0.0)
    directions = Directions(scenes.drift, scenes.parameters, scenes.numbers, moved)
    logs, errors = float_logs(scenes, quantity, directions)
    names = [n.removeprefix("log ") for n in directions.names]
    names += ["start"] if "start" in scenes.numbers else []
    # What counts is the relative change of a parameter, beside that of all.
    with np.errstate(over="ignore"):
        allowed = _ENOUGH * np.maximum(1.0, directions.largest_change(logs.slopes))
        fine = (errors.slopes <= allowed).all(axis=0)
        slopes, off = logs.slopes, errors.slopes + _ROUNDING * np.abs(logs.slopes)
        of_kappa = names.index("kappa")
        for part in (slopes, off):
            part[of_kappa] /= scenes.numbers["kappa"]
    return names, logs.value, slopes, off, fine
