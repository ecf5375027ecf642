"""Derivatives of a quantity with respect to its parameters, by the complex-step method.

For an analytic Q, real on the real axis, dQ/dp = Im Q(p + ih)/h + O(h^2) without cancellation
(W. Squire and G. Trapp, SIAM Rev. 40 (1998) 110); both exact methods admit complex parameters. The
derivatives in the start x and the radius r follow from the sweeps (eq:Ttilde, eq:C; docs/exact.md).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from flint import acb, arb, fmpq

from symasym.base.balls import extra_bits, precision, rational, rounded
from symasym.base.errors import AccuracyError, RangeError
from symasym.base.estimate import IN_WORDS, ErrorKind, with_error
from symasym.base.inputs import FloatArray, Numbers, choice, digits
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.drift.sampled import FloatDrift
from symasym.drift.scenes import (
    QUANTITIES,
    Request,
    Scene,
    Scenes,
    read,
    require_drift,
    require_sliding,
    taken,
)
from symasym.exact import balls, floats

__all__ = ["Sensitivity", "sensitivity"]

_MOST_DIGITS, _FLOAT_DIGITS = 1_000, 17
_MOST_BITS = 20_000  # the most bits in addition to those for the requested digits
_RADIUS = 70  # the relative radius 10^-70 is below the cancellation in a panel's series
_STEP = 1e-40
# The largest accepted error of p d/dp in float64, relative to the scene's largest |p d/dp| or 1.
_ENOUGH = 1e-9
_FACTOR = 4.0  # ratio of the errors of derivatives to that of the value, checked in ball arithmetic


@dataclass(frozen=True)
class Sensitivity:
    """Logarithmic derivatives and condition numbers by the names of the parameters.

    Attributes
    ----------
    quantity : str
    derivative : dict of str to float, mpf or ndarray
        d log(quantity) / d(parameter).
    error : dict of str to float, mpf or ndarray
        Absolute error of `derivative`.
    condition : dict of str to float, mpf or ndarray
        ``|parameter * derivative|``: relative change of the quantity by that of the parameter.
    error_kind : {"bound", "estimate"}
        ``"bound"`` if the errors are proved.
    """

    quantity: str
    derivative: dict[str, Any]
    error: dict[str, Any]
    condition: dict[str, Any]
    error_kind: ErrorKind

    def __str__(self) -> str:
        """One line per parameter: the derivative with its error, and the condition number."""
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
        A drift whose parameters all have values, which may be arrays.
    kappa, r, start : number or array_like
        Scaled numbers as in `escape_time`.
    quantity : {"T", "C", "1 - C", "P", "1 - P"}
        Escape time, exit probability or occupation; P and 1 - P do not depend on `r`.
    dps : int, optional
        The number of digits, 1 to 1,000, for one scene. By default results are float64 numbers or
        arrays, usually correct to 1e-11.

    Returns
    -------
    Sensitivity
        For each drift parameter and for kappa, r and start. With `dps` each derivative is proved
        to be correct to so many digits, or decimal places if its absolute value is below 1.

    Notes
    -----
    In float64 the error is an estimate: that of the value times the largest derivative of the
    scene. If it is above 1e-9 times the largest ``|p d/dp|`` of the scene or 1, and for a drift
    that is neither ready-made nor a polynomial, ball arithmetic is used.

    Examples
    --------
    >>> import symasym as sa
    >>> change = sa.sensitivity(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.1", 10)
    >>> print(f"{change.condition['kappa']:.9g} {change.condition['z0']:.9g}")
    50.8370975 40.04365
    """
    quantity = choice("quantity", quantity, QUANTITIES)
    require_drift(drift)
    numbers = taken(quantity, QUANTITIES[quantity], kappa=kappa, r=r, start=start)
    if quantity[-1] == "P":
        require_sliding(drift)
    scenes, dps = read(drift, numbers), digits(dps, _MOST_DIGITS)
    if dps is None:
        return _in_floats(quantity, scenes)
    scene = scenes.one()
    found, at = _proved(quantity, scene, dps), {**scene.drift.scalars(), **scene.numbers}
    with precision(balls.bits(dps + 10)):
        sizes = (rounded(abs(found[n] * arb(rational(x))), dps)[0] for n, x in at.items())
        columns = *zip(*(rounded(found[n], dps) for n in at), strict=True), sizes
        slopes, errors, conditions = (dict(zip(at, x, strict=True)) for x in columns)
    return Sensitivity(quantity, slopes, errors, conditions, "bound")


def _by_ends(quantity: str, near: Any, far: Any) -> dict[str, list[tuple[int, Any]]]:
    """The terms of d log(quantity)/dr and of d log(quantity)/d(start): signs and positive numbers.

    `near` and `far` are y = 1/eta and w = lam Q/eta of both sweeps, at the start and at the
    opposite end.
    """
    (y, w), (far_y, far_w) = near, far
    if quantity == "T":
        whole = w[0] + w[1]
        return {
            "r": [(1, y[1] * far_w[0] / whole), (1, y[0] * far_w[1] / whole)],
            "start": [(1, y[0] * w[1] / whole), (-1, y[1] * w[0] / whole)],
        }
    a, b, sign = (0, 1, -1) if quantity == "C" else (1, 0, 1)
    return {"r": [(1, y[b] * far_y[a] / y[a]), (-1, far_y[b])], "start": [(sign, y[b])]}


# -- in balls --------------------------------------------------------------------------------------


def _proved(quantity: str, scene: Scene, digits: int) -> dict[str, Any]:
    """Balls for the derivatives, correct to `digits` digits, or decimal places if below 1."""
    numbers = {name: rational(x) for name, x in scene.numbers.items()}
    parameters = {name: rational(x) for name, x in scene.drift.scalars().items()}
    (low, high), kappa = balls.span(numbers), numbers["kappa"]
    guard = balls.bits_of_way(rational(scene.lam), high)

    def log(working: int, **moved: Any) -> Any:
        """log(quantity) with changed values of some parameters."""
        drift = pieces(scene.drift, low, high, {n: x for n, x in moved.items() if n in parameters})
        noise = moved.get("kappa", arb(kappa))
        engine = balls.Engine(drift, 2 / noise**2, working)
        return balls.enclosure(engine, Request(quantity, log=True), numbers)

    def slope(name: str, x: fmpq, working: int, more: int) -> Any:
        """The complex-step derivative in a ball that includes a bound on its error.

        A finite enclosure |log(quantity)| <= M over a box of half-width R about x proves that it is
        analytic there; by Cauchy's estimate the error is at most h^2 M/R^3 + h^4 M/R^5 + ... A
        panel's series may cancel 52 digits, and exponents change by lam R.
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

    for more in extra_bits(_MOST_BITS):
        working = digits + 4 + more // 8
        found = {n: slope(n, x, working, more) for n, x in {**parameters, "kappa": kappa}.items()}
        with precision(balls.bits(working, guard + more)):
            if "r" in numbers:
                r, start = numbers["r"], numbers["start"]
                engine = balls.Engine(pieces(scene.drift, low, high), arb(2 / kappa**2), working)
                sides = [engine.sides((-r, r), at) for at in (start, r, -r)]
                far = sides[1][0], sides[2][1]
                ends = ([[1 / x.eta for x in two], [x.zeta[1] / x.eta for x in two]]
                        for two in (sides[0], far))  # fmt: skip
                for name, row in _by_ends(quantity, *ends).items():
                    found[name] = sum((sign * x for sign, x in row), arb(0))
            if all(map(right, found.values())):
                return found
    raise AccuracyError(
        f"log({quantity}) has fewer than {digits} digits of its derivatives right in "
        f"{_MOST_BITS} bits; ask for fewer digits, or move away from where it is not smooth."
    )


# -- in float64 ------------------------------------------------------------------------------------


@np.errstate(all="ignore")
def _in_floats(quantity: str, scenes: Scenes) -> Sensitivity:
    """Derivatives of many scenes in float64, or by balls for scenes with too large an error."""
    count, shape, model = len(scenes.lam), scenes.shape, scenes.drift.model
    names = [*scenes.drift.values, *scenes.numbers]
    given = [*scenes.drift.values.values(), *scenes.numbers.values()]
    values = np.array([np.broadcast_to(np.asarray(x, float), count) for x in given])
    unit = np.where(np.abs(values) < 1e-200, 1.0, np.abs(values))
    slopes, errors = _by_floats(quantity, scenes, values, unit)
    size = np.maximum(1.0, np.abs(slopes * unit).max(axis=0))
    # The nodes that suffice for A may miss a narrow peak of dA/dp. A start near an end must not be
    # rounded to float64.
    closer = not model.name and model.pieces[0].powers is None
    closer |= any(x != float(x) for n, x in scenes.exactly.items() if n != "kappa")
    for k in np.flatnonzero(closer | ~(errors * unit <= _ENOUGH * size).all(axis=0)):
        found = _proved(quantity, scenes.at(k), _FLOAT_DIGITS)
        slopes[:, k], errors[:, k] = zip(*(rounded(found[n], None) for n in names), strict=True)
    if (lost := ~np.isfinite(slopes).all(axis=1)).any():
        raise RangeError(
            f"d log({quantity})/d({names[np.argmax(lost)]}) is outside the range of float64; ask "
            "for digits (dps)."
        )
    rows = slopes, np.maximum(errors, 5e-324), np.abs(slopes * values)
    columns = ([x.reshape(shape) if shape else x.item() for x in row] for row in rows)
    named, off, conditions = (dict(zip(names, x, strict=True)) for x in columns)
    return Sensitivity(quantity, named, off, conditions, "estimate")


def _by_floats(
    quantity: str, scenes: Scenes, values: FloatArray, unit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """The derivatives with respect to every parameter, and their estimated errors."""
    names, count = [*scenes.drift.values, "kappa"], len(scenes.lam)
    many, each = len(names), np.arange(len(names))
    unit = unit[:many]
    moved = np.repeat(values[:many, None], many, axis=1).astype(complex)
    moved[each, each] += 1j * _STEP * unit
    parameters = dict(zip(names, moved.reshape(many, -1), strict=True))
    numbers = {n: np.tile(x, many) for n, x in scenes.numbers.items()}
    numbers["kappa"] = parameters.pop("kappa")
    of = FloatDrift(scenes.drift, parameters, many * count)
    logs = floats.logs_of(Request(quantity), of, numbers)
    slopes, errors = logs.log.imag.reshape(-1, count) / (_STEP * unit), logs.error
    # An error of an exponent changes the derivatives relatively as the value, at most by `largest`.
    largest = np.abs(slopes * unit).max(axis=0)
    off = _FACTOR * (errors.reshape(-1, count).max(axis=0) + 1e-15)
    errors = off * (np.abs(slopes) + (1.0 + largest) / unit)
    if "r" not in numbers:
        return slopes, errors
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    of = FloatDrift(scenes.drift, {}, count)
    ends = (
        [
            [x.rounded() for x in two]
            for two in floats.sides(of, scenes.lam, (-r, r), until, np.arange(count))
        ]
        for until in ((start, start), (r, -r))
    )
    for row in _by_ends(quantity, *ends).values():
        slope = sum(sign * np.exp(x.log) for sign, x in row)
        off = sum(np.exp(x.log) * (x.error + 2e-15) for _, x in row)
        slopes, errors = np.vstack((slopes, slope)), np.vstack((errors, off))
    return slopes, errors
