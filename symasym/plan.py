"""Which terms of T a scene needs for a tolerance, and the order that suffices; method="auto".

The exact value is cheap, so that the error of every candidate is known, not estimated; what a plan
adds is which terms carry T, for a formula or for many kappa of one drift. ``method="auto"`` takes
the exact value of one scene and of arrays of drifts. For many kappa of one drift it takes an
expansion below the kappa at which a few exact values beside it say that its error is allowed, since
errors grow with kappa.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from mpmath import mpf

from symasym.base.call_context import own_context, patient
from symasym.base.errors import AccuracyError, InputError, RangeError, SymasymError
from symasym.base.estimate import Estimate
from symasym.base.inputs import FloatArray, Number, exact, float_text, is_array, shown
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.expansions.balls import AtLam, resolved
from symasym.methods import answer, as_floats, of_scenes
from symasym.numbers.balls import exact_ball, precision, to_mpf
from symasym.scenes import (
    Answers,
    Request,
    Scene,
    Scenes,
    exponent_bits,
    float_scenes,
    one_scene,
    read_scene,
    require_drift,
    rows_of,
)

__all__ = ["Plan", "Term", "plan"]

_ORDERS = {"laplace": range(9), "uniform": (0,), "strong_noise": (0, 1, 2, 4, 8, 16)}
# Orders for many kappa of one drift, how many these are at least, and the share not bisected.
_MANY_ORDERS, _MANY, _SHARE = (2, 5), 5_000, 50
# Below this, rtol=1e-12 as a float included.
_FLOAT_RTOL = Fraction(999, 10**15)


@dataclass(frozen=True)
class Term:
    """A part of T: its name, whether it is kept, and its size relative to T, with its sign."""

    name: str
    kept: bool
    size: mpf


@dataclass(frozen=True, repr=False)
class Plan:
    """The first method and order whose error is allowed, and the terms that it needs.

    `terms` are T's parts in weak noise, largest first, and empty for other methods; `error` is
    relative, the distance of those that are kept to the exact value; `refused` tells of the methods
    before this one why they do not do; `estimate` is T in this way.
    """

    method: str
    order: int | None
    terms: tuple[Term, ...]
    error: float
    rtol: float
    refused: dict[str, str]
    estimate: Estimate

    def __str__(self) -> str:
        order = "" if self.order is None else f", order {self.order}"
        lines = [f"{self.method}{order}: relative error {self.error:.2g} (known)"]
        for t in self.terms:
            size = t.size.context.nstr(t.size, 2)
            lines.append(f"  {'kept' if t.kept else 'left out':9}{size:>10}  {t.name}")
        return "\n".join([*lines, *(f"  not {n}: {why}" for n, why in self.refused.items())])

    __repr__ = __str__


@patient
def plan(
    drift: Drift, kappa: Number, r: Number, rtol: Number = 1e-6, *, start: Number = 0,
    patience: float | None = None,
) -> Plan:  # fmt: skip
    """The terms of T that this scene needs, and those left out.

    Parameters
    ----------
    drift, kappa, r, start, patience
        One scene, as in `escape_time`.
    rtol : number
        Relative error allowed, between 1e-1000 and 1.

    Examples
    --------
    >>> import symasym as sa
    >>> chosen = sa.plan(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05", 10, rtol=1e-3)
    >>> print(chosen.method, chosen.order, [t.name for t in chosen.terms if t.kept])
    laplace 1 ['well at 0.3969 with barrier at 0.9039']
    """
    require_drift(drift)
    numbers = {"kappa": kappa, "r": r, "start": start}
    if not one_scene(drift, numbers):
        raise InputError("plan is for one scene; give numbers, not arrays.")
    allowed = read_rtol(rtol)
    digits = max(20, len(str(int(1 / allowed))) + 8)
    asked, refused = Request("T", "exact", None, digits, False, True), dict[str, str]()
    true, scene = answer(drift, numbers, asked), read_scene(drift, numbers)
    with own_context(digits + 10) as context:

        def own(x: Any) -> Any:
            return context.make_mpf(x._mpf_)

        known = own(true.value)
        room = context.mpf(allowed.numerator) / allowed.denominator
        for method, orders in _ORDERS.items():
            least = context.inf
            for order in orders:
                terms: tuple[Term, ...] = ()
                try:
                    if method == "laplace":
                        items = [(name, own(x)) for name, x in parts(scene, order, digits)]
                        kept = _kept([x for _, x in items], known, room)
                        value = context.fsum(x for _, x in items[:kept])
                        terms = tuple(
                            Term(name, k < kept, x / known) for k, (name, x) in enumerate(items)
                        )
                    else:
                        other = asked._replace(method=method, order=order, full=False)
                        value = own(answer(drift, numbers, other))
                except SymasymError as refusal:
                    refused[method] = str(refusal)
                    continue
                error = (abs(value - known) + own(true.error)) * (1 + context.eps * 4)
                if error <= room * value:
                    estimate = Estimate(+value, error, true.error_kind, method, order)
                    relative = float(error / value)
                    return Plan(method, order, terms, relative, float(allowed), refused, estimate)
                if error / known > 2 * least:
                    break
                least = min(least, error / known)
            if least < context.inf:
                refused[method] = f"its error is {float(least):.2g} at best"
    return Plan("exact", None, (), float(true.error / known), float(allowed), refused, true)


def parts(scene: Scene, order: int, digits: int) -> list[tuple[str, mpf]]:
    """T to an order in weak noise as named parts, largest first."""
    bits = int(3.4 * digits) + 100 + exponent_bits(scene.drift, scene.lam, scene.r)
    known, found = resolved(scene.drift, scene.r, scene.start, "T", order + 1, bits), []
    with precision(bits):
        at = AtLam(exact_ball(scene.lam), order)
        for side, pair, value in weak.parts(known.points, known.regular, at):
            name = " with ".join(map(str, pair)) if side else "the start's own share"
            name = name or f"the regular part, {'left' if side < 0 else 'right'}"
            found.append((name, to_mpf(value, digits + 10)[0]))
    return sorted(found, key=lambda item: -abs(item[1]))


def _kept(values: list[Any], known: Any, room: Any) -> int:
    """How many of the largest parts are within the error allowed, as a rest of all that are not."""
    total, count = sum(values), len(values)
    while count and abs(total - values[count - 1] - known) <= room * known:
        total -= values[count - 1]
        count -= 1
    return count


def read_rtol(rtol: Number | None) -> Fraction:
    """rtol as an exact number between 1e-1000 and 1."""
    if rtol is None:
        raise InputError('method is "auto", which needs the relative error allowed; give rtol=….')
    allowed = exact("rtol", rtol)
    if not Fraction(1, 10**1000) <= allowed < 1:
        raise InputError(
            f"rtol is {float_text(allowed)}; give a relative error between 1e-1000 and 1."
        )
    return allowed


# -- method="auto" ---------------------------------------------------------------------------------


def automatic(drift: Drift, numbers: dict[str, Any], rtol: Number | None, request: Request) -> Any:
    """The quantity of `request` with a relative error of at most `rtol`."""
    allowed, exactly = read_rtol(rtol), request._replace(method="exact")
    if request.order is not None:
        raise InputError(
            f"order is {shown(request.order)}, but method 'auto' chooses it; leave it out."
        )
    if request.dps is None and allowed < _FLOAT_RTOL:
        raise AccuracyError(
            f"rtol is {float_text(allowed)}, below what float64 gives (1e-12); pass dps=… for more "
            "digits."
        )
    if request.dps is not None or one_scene(drift, numbers):
        return _of_one(drift, numbers, allowed, exactly)
    shared = not drift.shape and not any(is_array(x) for n, x in numbers.items() if n != "kappa")
    if not shared or np.size(numbers["kappa"]) < _MANY:
        return answer(drift, numbers, exactly)
    return _of_many(float_scenes(drift, numbers), allowed, request)


def _of_one(drift: Drift, numbers: dict[str, Any], allowed: Fraction, exactly: Request) -> Any:
    """The proved exact value; an expansion where it fails."""
    try:
        found = answer(drift, numbers, exactly._replace(full=True))
        return found if exactly.full else found.value
    except RangeError:
        raise
    except AccuracyError as error:
        for order in _ORDERS["laplace"]:
            asked = exactly._replace(method="laplace", order=order, full=True)
            try:
                found = answer(drift, numbers, asked)
            except SymasymError:
                break
            relative = found.error if exactly.log else found.error / abs(found.value)
            if relative <= float(allowed):
                return found if exactly.full else found.value
        raise error


def _of_many(scenes: Scenes, allowed: Fraction, request: Request) -> Any:
    """Many kappa of one drift: expansions below a kappa that exact values show, exact beyond."""
    count = len(scenes.lam)
    logs, errors, left, used = np.empty(count), np.empty(count), np.arange(count), list[str]()
    left, most = left[np.argsort(-scenes.lam)], np.log1p(float(allowed)) * (1 - 1e-12)

    def logs_of(rows: Any, method: str, order: int | None = None) -> FloatArray:
        asked = request._replace(method=method, order=order, full=False, log=True)
        return of_scenes(rows_of(scenes, rows), asked).logs

    def allowed_at(row: Any, order: int) -> bool:
        rows = np.array([row])
        return bool(abs(logs_of(rows, "laplace", order) - logs_of(rows, "exact")) <= most / 2)

    for order in _MANY_ORDERS:
        if not left.size or not allowed_at(left[0], order):
            continue
        low, high = 0, len(left)
        while high - low > len(left) // _SHARE + 1:
            middle = (low + high) // 2
            low, high = (middle, high) if allowed_at(left[middle], order) else (low, middle)
        some, left = left[: low + 1], left[low + 1 :]
        logs[some], errors[some] = logs_of(some, "laplace", order), most
        used.append(f"laplace, order {order}")
    if left.size:
        asked = request._replace(method="exact", full=True, log=True)
        found = of_scenes(rows_of(scenes, left), asked)
        logs[left], errors[left] = found.logs, 0.0 if found.errors is None else found.errors
        used.append("exact")
    return as_floats(request, scenes.shape, Answers(logs, errors, "estimate", tuple(used)))
