"""How much a quantity changes with each of its parameters, by the complex step.

For an analytic Q of real values dQ/dp = Im Q(p + ih)/h + O(h^2), where nothing is subtracted
(Squire and Trapp 1998): both exact engines take complex parameters as they are. In the start x and
the radius r the derivatives are closed forms of the sweeps (eq:Ttilde, eq:C; docs/exact.md).
"""

from __future__ import annotations

import math
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
from symasym.drift.evaluate import Piece, pieces
from symasym.drift.formula import rational
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
from symasym.exact.float_panels import ULP, Logs
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
        d log(quantity) / d(parameter).
    error : dict of str to float, mpf or ndarray
        Absolute error of `derivative`.
    condition : dict of str to float, mpf or ndarray
        ``|parameter * derivative|``: the relative change of the quantity over the parameter's.
    error_kind : {"bound", "estimate"}
        ``"bound"``: proved.
    """

    quantity: str
    derivative: dict[str, Any]
    error: dict[str, Any]
    condition: dict[str, Any]
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


def _of_ends(quantity: str, near: Any, far: Any, whole: Any) -> list[Any]:
    """The terms of d log(quantity)/dr and d log(quantity)/d(start): a sign, factors, divisors.

    They are y = 1/sigma and w = lam Q/sigma of both sides, at the start and at the other end.
    """
    (y, w), (far_y, far_w) = near, far
    if quantity == "T":
        above = (y[1], far_w[0]), (y[0], far_w[1]), (y[0], w[1]), (y[1], w[0])
        return [
            *zip(("r", "r", "start", "start"), (1, 1, 1, -1), above, [[whole]] * 4, strict=True)
        ]
    a, b, sign = (0, 1, -1) if quantity == "C" else (1, 0, 1)
    return [
        ("r", 1, (y[b], far_y[a]), [y[a]]),
        ("r", -1, [far_y[b]], []),
        ("start", sign, [y[b]], []),
    ]


# -- in balls --------------------------------------------------------------------------------------


def _proved(quantity: str, scene: Scene, digits: int) -> dict[str, Any]:
    """Balls with the derivatives, right to `digits` digits, or places below 1."""
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
                found |= _ends_in_balls(quantity, pieces(scene.drift, low, high), numbers, working)
            if all(map(right, found.values())):
                return found
        more = 2 * more + 60
    raise AccuracyError(
        f"log({quantity}) has fewer than {digits} digits of its derivatives right in "
        f"{_MOST_BITS} bits; ask for fewer digits, or move away from where it is not smooth."
    )


def _ends_in_balls(
    quantity: str, drift: list[Piece], numbers: Mapping[str, fmpq], digits: int
) -> dict[str, Any]:
    """d log(quantity)/dr and d log(quantity)/d(start)."""
    r, start, lam = numbers["r"], numbers["start"], arb(2 / numbers["kappa"] ** 2)
    near: Any = balls.sides(drift, lam, (-r, r), start, digits)
    ways = zip((drift, balls.mirrored(drift)), (start, -start), near, strict=True)
    far: Any = [balls.swept(way, lam, at, r, digits, state) for way, at, state in ways]
    near, far = (
        [[1 / x.eta for x in two], [x.zeta[1] / x.eta for x in two]] for two in (near, far)
    )
    found = {"r": arb(0), "start": arb(0)}
    for name, sign, above, below in _of_ends(quantity, near, far, sum(near[1], arb(0))):
        found[name] += sign * math.prod(above) / math.prod(below)
    return found


def _in_digits(quantity: str, scene: Scene, dps: int) -> Sensitivity:
    """Derivatives of one scene to so many digits, proved."""
    slopes, rows = _proved(quantity, scene, dps), {}
    with precision(balls.bits(dps + 10)):
        for name, x in {**scene.drift.scalars(), **scene.numbers}.items():
            condition = abs(slopes[name] * arb(rational(x)))
            rows[name] = *to_mpf(slopes[name], dps), to_mpf(condition, dps)[0]
    slope, error, condition = (
        dict(zip(rows, x, strict=True)) for x in zip(*rows.values(), strict=True)
    )
    return Sensitivity(quantity, slope, error, condition, "bound")


# -- in float64 ------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def _in_floats(quantity: str, scenes: Scenes) -> Sensitivity:
    """Derivatives of many scenes in float64; in balls where these say little."""
    names, count, model = [*scenes.parameters, *scenes.numbers], len(scenes.lam), scenes.drift.model
    at = {n: np.broadcast_to(np.float64(x), count) for n, x in scenes.parameters.items()}
    at |= scenes.numbers
    values = np.array([at[n] for n in names])
    slopes, errors = _by_floats(quantity, scenes, at)
    unit = np.where(values == 0, 1.0, np.abs(values))
    size = np.maximum(1.0, np.abs(slopes * unit).max(axis=0))
    # A needle of dA/dp may lie between the nodes that suffice for A; and beside an end a start that
    # is no float is another one.
    given = (scenes.given.get(n, 0.0) for n in ("r", "start"))
    closer = not model.name and model.pieces[0].powers is None
    closer |= any(not isinstance(x, (int, float, np.ndarray, list, tuple)) for x in given)
    for k in np.flatnonzero(closer | ~(errors * unit <= _ENOUGH * size).all(axis=0)):
        found = _proved(quantity, scene_at(scenes, k), _FLOAT_DIGITS)
        for j, name in enumerate(names):
            slopes[j, k] = float(found[name].mid())
            errors[j, k] = 2e-16 * abs(slopes[j, k]) + float(found[name].rad())
    if not np.isfinite(slopes).all():
        name = names[np.argwhere(~np.isfinite(slopes))[0][0]]
        raise RangeError(
            f"d log({quantity})/d({name}) is outside the range of float64; pass dps=…."
        )

    def shaped(rows: FloatArray) -> dict[str, Any]:
        """By the name of the parameter, floats or arrays of the answer's shape."""
        each = (x.reshape(scenes.shape) if scenes.shape else x.item() for x in rows)
        return dict(zip(names, each, strict=True))

    errors = np.maximum(errors, 5e-324)  # what float64 takes for 0 is none
    slope, error, condition = map(shaped, (slopes, errors, np.abs(slopes * values)))
    return Sensitivity(quantity, slope, error, condition, "estimate")


def _by_floats(
    quantity: str, scenes: Scenes, at: Mapping[str, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    """The derivatives by every parameter, and their estimated errors."""
    count, stepped = len(scenes.lam), [*scenes.parameters, "kappa"]
    unit = np.array([np.where(np.abs(at[n]) < 1e-200, 1.0, np.abs(at[n])) for n in stepped])
    moved = {n: np.tile(x, len(stepped)).astype(complex) for n, x in at.items() if n in stepped}
    for k, name in enumerate(stepped):
        moved[name][k * count : (k + 1) * count] += 1j * _STEP * unit[k]
    of = Field(scenes.drift, {n: moved[n] for n in scenes.parameters}, count * len(stepped))
    others = {n: np.tile(x, len(stepped)) for n, x in scenes.numbers.items() if n != "kappa"}
    logs, errors = floats.logs_of(quantity, of, {"kappa": moved["kappa"], **others})
    slopes, errors = logs.imag.reshape(-1, count) / (_STEP * unit), errors.reshape(-1, count)
    # An exponent that is off moves all derivatives like the value, at most as the largest of them.
    largest = np.abs(slopes * unit).max(axis=0)
    errors = _FACTOR * (errors.max(axis=0) + 1e-15) * (np.abs(slopes) + (1.0 + largest) / unit)
    if "r" not in scenes.numbers:
        return slopes, errors
    rows, r, start = np.arange(count), at["r"], at["start"]
    of = Field(scenes.drift, {n: at[n] for n in scenes.parameters}, count)
    until = (start, start), (r, -r)
    near, far = (floats.sides(of, scenes.lam, (-r, r), x, rows) for x in until)
    wa, wb = near[1]
    whole = Logs(np.logaddexp(wa.log, wb.log), np.maximum(wa.error, wb.error) + 4e-16)
    found = {"r": np.zeros((2, count)), "start": np.zeros((2, count))}
    for name, sign, above, below in _of_ends(quantity, near, far, whole):
        value = np.exp(sum(x.log for x in above) - sum(x.log for x in below))
        lost = sum(x.error + ULP * np.abs(x.log) for x in (*above, *below))
        found[name] += value * sign, value * (1e-15 + lost)
    more = np.stack([*found.values()], axis=1)
    return np.vstack((slopes, more[0])), np.vstack((errors, more[1]))
