"""How much a quantity changes with each of its parameters, by the complex step.

For an analytic Q of real values dQ/dp = Im Q(p + ih)/h + O(h^2), where nothing is subtracted
(Squire and Trapp 1998): both exact engines take complex parameters as they are. In the start x and
the radius r the derivatives are closed forms of the sweeps (eq:Ttilde, eq:C; docs/exact.md).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import acb, arb, fmpq

from symasym.base.balls import precision, to_mpf
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.estimate import IN_WORDS, ErrorKind, with_error
from symasym.base.inputs import FloatArray, Numbers, choice, digits, taken
from symasym.drift.drift import Drift
from symasym.drift.evaluate import Piece, pieces, rational
from symasym.drift.models import Expression
from symasym.drift.sampled import Field
from symasym.drift.scenes import (
    QUANTITIES,
    Scene,
    Scenes,
    float_scenes,
    read_scene,
    require_drift,
    scene_at,
)
from symasym.exact import balls, floats
from symasym.exact.float_panels import Logs
from symasym.methods import require_sliding

__all__ = ["Sensitivity", "sensitivity"]

_MOST_DIGITS, _FLOAT_DIGITS = 1_000, 17
_MOST_BITS = 20_000  # beyond those that the digits take
_RADIUS = 70  # 10^-70 of a parameter survives what a panel's series cancels
_STEP = 1e-40
# An error of p d/dp in float64, beside the largest of the scene or 1, above which it is in doubt.
_ENOUGH = 1e-7
_FACTOR = 4.0  # of errors of derivatives over that of the value, checked against balls


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
            shown = with_error(value, self.error[name])
            condition = self.condition[name]
            if not isinstance(condition, np.ndarray):
                condition = f"{float(condition):.3g}"
            rows.append(f"  {name}: {shown}; {condition}")
        return "\n".join(rows)


def sensitivity(
    drift: Drift,
    kappa: Numbers,
    r: Numbers | None = None,
    *,
    start: Numbers = 0,
    quantity: Literal["T", "C", "1 - C", "P", "1 - P"] = "T",
    dps: int | None = None,
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
        Digits, 1 to 1,000. None: float64, arrays allowed, mostly right to 1e-11.

    Returns
    -------
    Sensitivity
        For each drift parameter and for kappa, r and start. With `dps` each derivative is right to
        so many digits, or places where it is below 1, and proved.

    Notes
    -----
    In float64 the error is an estimate, the value's own error times the largest derivative of the
    scene. Where that is above 1e-7 of the largest ``|p d/dp|`` of the scene or of 1, and for an
    expression of one's own that is no polynomial, the scene is answered in balls.

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
    given = {"kappa": kappa, "r": r, "start": start}
    numbers = taken(quantity, QUANTITIES[quantity].numbers, given)
    if QUANTITIES[quantity].sliding:
        require_sliding(drift)
    if dps is not None:
        dps = digits(dps, _MOST_DIGITS)
        return _in_digits(quantity, read_scene(drift, numbers), dps)
    return _in_floats(quantity, float_scenes(drift, numbers))


# -- in balls --------------------------------------------------------------------------------------


def _proved(quantity: str, scene: Scene, digits: int) -> tuple[Any, dict[str, Any]]:
    """Balls with log(quantity) and its derivatives, right to `digits` digits, or places below 1."""
    numbers = {name: rational(x) for name, x in scene.numbers.items()}
    parameters = {name: rational(x) for name, x in scene.drift.scalars().items()}
    (low, high), kappa = balls.span(quantity, numbers), numbers["kappa"]
    guard = balls.bits_of_way(rational(scene.lam), high)

    def log(working: int, **moved: Any) -> Any:
        """log(quantity), some parameters moved."""
        drift = pieces(scene.drift, low, high, {n: x for n, x in moved.items() if n in parameters})
        noise = moved.get("kappa", arb(kappa))
        return balls.enclosure(quantity, drift, 2 / noise**2, numbers, working, log=True)

    def slope(name: str, x: fmpq, working: int, more: int) -> Any:
        """The complex step, and a bound of what it misses.

        On a box of half width R about x the engine encloses log(quantity) by M and shows it to be
        analytic, so that by Cauchy's estimate h^2 M/R^3 + h^4 M/R^5 + ... is missed. A panel's
        series may cancel 10^52, and exponents move by lam R.
        """
        unit = abs(x) or fmpq(1)
        places = _RADIUS + guard // 3, _RADIUS + guard // 2 + working // 2 + _RADIUS // 2
        with precision(balls.bits(25, 2 * guard + 4 * _RADIUS + more)):
            radius = (arb(unit) * arb(10) ** -places[0]).upper()
            around = arb(0, radius)
            largest = abs(log(25, **{name: acb(arb(x) + around, around)}))
        with precision(balls.bits(working + places[1], guard + more)):
            h = arb(unit) * arb(10) ** -places[1]
            step = log(working + places[1], **{name: acb(arb(x), h)}).imag / h
            return step + arb(0, (2 * h**2 * largest / radius**3).upper())

    def right(ball: arb) -> bool:
        return bool(ball.rad() < arb(10) ** -digits * abs(ball).lower().max(arb(1)))

    more = 0
    while more < _MOST_BITS:
        working = digits + 4 + more // 8
        found = {n: slope(n, x, working, more) for n, x in {**parameters, "kappa": kappa}.items()}
        with precision(balls.bits(working, guard + more)):
            if "r" in numbers:
                found |= _of_ends(quantity, pieces(scene.drift, low, high), numbers, working)
            whole = log(working)
            if all(map(right, found.values())):
                return whole, found
        more = 2 * more + 60
    raise AccuracyError(
        f"log({quantity}) has fewer than {digits} digits of its derivatives right in "
        f"{_MOST_BITS} bits; ask for fewer digits, or move away from where it is not smooth."
    )


def _of_ends(
    quantity: str, drift: list[Piece], numbers: Mapping[str, fmpq], digits: int
) -> dict[str, Any]:
    """d log(quantity)/dr and d log(quantity)/d(start) in balls."""
    r, start, lam = numbers["r"], numbers["start"], arb(2 / numbers["kappa"] ** 2)
    left, right = balls.sides(drift, lam, (-r, r), start, digits)
    far_left = balls.swept(drift, lam, start, r, digits, left)
    far_right = balls.swept(balls.mirrored(drift), lam, -start, r, digits, right)
    (a, (_, wa)), (b, (_, wb)), (far_a, (_, far_wa)), (far_b, (_, far_wb)) = (
        left, right, far_left, far_right,
    )  # fmt: skip
    if quantity == "T":
        time = wa * b + wb * a
        return {"r": (a * far_wa / far_a + b * far_wb / far_b) / time, "start": (wb - wa) / time}
    moved = a / far_a - b / far_b
    if quantity == "C":
        return {"r": moved / b, "start": -1 / b}
    return {"r": -moved / a, "start": 1 / a}


def _in_digits(quantity: str, scene: Scene, dps: int) -> Sensitivity:
    """Derivatives of one scene to so many digits, proved."""
    whole, slopes = _proved(quantity, scene, dps)
    rows = {}
    with precision(balls.bits(dps + 10)):
        for name, x in {**scene.drift.scalars(), **scene.numbers}.items():
            condition = abs(slopes[name] * arb(rational(x)))
            relative = condition / abs(whole) if condition > 0 else condition
            shown = (to_mpf(x, dps)[0] for x in (condition, relative))
            rows[name] = *to_mpf(slopes[name], dps), *shown
    columns: Any = (dict(zip(rows, x, strict=True)) for x in zip(*rows.values(), strict=True))
    slope, error, condition, relative = columns
    return Sensitivity(quantity, slope, error, condition, relative, "bound")


# -- in float64 ------------------------------------------------------------------------------------


def _in_floats(quantity: str, scenes: Scenes) -> Sensitivity:
    """Derivatives of many scenes in float64; in balls where these say little."""
    names = [*scenes.parameters, *scenes.numbers]
    count = len(scenes.lam)
    at = {n: np.broadcast_to(np.float64(x), count) for n, x in scenes.parameters.items()}
    at |= scenes.numbers
    needle = isinstance(scenes.drift.model, Expression) and scenes.drift.model.powers is None
    given = [scenes.given.get(n, 0.0) for n in ("r", "start")]
    if needle or any(not isinstance(x, (int, float, np.ndarray, list, tuple)) for x in given):
        # A needle of dA/dp may lie between the nodes that suffice for A; and beside an end a start
        # that is no float is another one.
        logs, doubt = np.empty(count), np.arange(count)
        slopes, errors = np.empty((2, len(names), count))
    else:
        logs, slopes, errors = _by_floats(quantity, scenes, at)
        unit = np.array([np.where(at[n] == 0, 1.0, np.abs(at[n])) for n in names])
        size = np.maximum(1.0, np.abs(slopes * unit).max(axis=0))
        doubt = np.flatnonzero(~(errors * unit <= _ENOUGH * size).all(axis=0))
    for k in doubt:
        whole, found = _proved(quantity, scene_at(scenes, k), _FLOAT_DIGITS)
        logs[k] = float(whole)
        for j, name in enumerate(names):
            slopes[j, k] = float(found[name].mid())
            errors[j, k] = 2e-16 * abs(slopes[j, k]) + float(found[name].rad())
    if not np.isfinite(slopes).all():
        name = names[np.argwhere(~np.isfinite(slopes))[0][0]]
        raise RangeError(
            f"d log({quantity})/d({name}) is outside the range of float64; pass dps=…."
        )
    errors = np.maximum(errors, 5e-324)  # what float64 takes for 0 is none
    values = np.array([at[n] for n in names])
    with np.errstate(over="ignore", divide="ignore", invalid="ignore"):
        conditions = np.abs(slopes * values)
        relative = np.where(conditions == 0, 0.0, conditions / np.abs(logs))

    def shaped(rows: FloatArray) -> dict[str, Any]:
        """By the name of the parameter, floats or arrays of the answer's shape."""
        each = (x.reshape(scenes.shape) if scenes.shape else x.item() for x in rows)
        return dict(zip(names, each, strict=True))

    slope, error, condition, log_condition = map(shaped, (slopes, errors, conditions, relative))
    return Sensitivity(quantity, slope, error, condition, log_condition, "estimate")


def _by_floats(
    quantity: str, scenes: Scenes, at: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """log(quantity), its derivatives by every parameter, and their estimated errors."""
    count, stepped = len(scenes.lam), [*scenes.parameters, "kappa"]
    h = [_STEP * np.where(np.abs(at[n]) < 1e-200, 1.0, np.abs(at[n])) for n in stepped]
    moved = {n: np.tile(x, len(stepped)).astype(complex) for n, x in at.items() if n in stepped}
    for k, name in enumerate(stepped):
        moved[name][k * count : (k + 1) * count] += 1j * h[k]
    of = Field(scenes.drift, {n: moved[n] for n in scenes.parameters}, count * len(stepped))
    others = {n: np.tile(x, len(stepped)) for n, x in scenes.numbers.items() if n != "kappa"}
    logs, errors = floats.logs_of(quantity, of, {"kappa": moved["kappa"], **others})
    logs, errors = logs.reshape(-1, count), errors.reshape(-1, count).max(axis=0)
    slopes = logs.imag / np.array(h)
    # An exponent that is off moves all derivatives like the value, at most as the largest of them.
    unit = np.array(h) / _STEP
    largest = np.abs(slopes * unit).max(axis=0)
    errors = _FACTOR * (errors + 1e-15) * (np.abs(slopes) + (1.0 + largest) / unit)
    if "r" in scenes.numbers:
        ends = _of_ends_in_floats(quantity, scenes, at)
        slopes, errors = (np.vstack((x, y)) for x, y in zip((slopes, errors), ends, strict=True))
    return logs[0].real, slopes, errors


def _of_ends_in_floats(
    quantity: str, scenes: Scenes, at: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """The rows of r and of the start, and their errors: with y = 1/sigma and w = lam Q/sigma."""
    rows = np.arange(len(scenes.lam))
    of = Field(scenes.drift, {n: at[n] for n in scenes.parameters}, len(rows))
    r, start = at["r"], at["start"]
    with np.errstate(all="ignore"):
        (ya, yb), (wa, wb) = floats.sides(of, scenes.lam, (-r, r), (start, start), rows)
        (far_ya, far_yb), (far_wa, far_wb) = floats.sides(of, scenes.lam, (-r, r), (r, -r), rows)
        per_w = Logs(-np.logaddexp(wa.log, wb.log), np.maximum(wa.error, wb.error) + 4e-16)
        sigma_a, sigma_b = (Logs(-y.log, y.error) for y in (ya, yb))
        # Of r, the first row, and the start: signs and products of positive numbers.
        terms: Any = {
            "T": [(0, 1, (yb, far_wa, per_w)), (0, 1, (ya, far_wb, per_w)),
                  (1, 1, (ya, wb, per_w)), (1, -1, (yb, wa, per_w))],
            "C": [(0, 1, (yb, far_ya, sigma_a)), (0, -1, (far_yb,)), (1, -1, (yb,))],
            "1 - C": [(0, 1, (ya, far_yb, sigma_b)), (0, -1, (far_ya,)), (1, 1, (ya,))],
        }[quantity]  # fmt: skip
        slopes, errors = np.zeros((2, 2, len(rows)))
        for row, sign, factors in terms:
            value = np.exp(sum(x.log for x in factors))
            slopes[row] += sign * value
            errors[row] += value * (1e-15 + sum(x.error + 2.3e-16 * abs(x.log) for x in factors))
    return slopes, errors
