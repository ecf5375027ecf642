"""Which terms of T a scene needs for a tolerance, and the order that suffices; method="auto".

The exact value is cheap, so that the error is known, not estimated; what a plan adds is which terms
carry T, for a formula or for many kappa of one drift. ``method="auto"`` takes the exact value of
one scene and of arrays of drifts. For many kappa of one drift it takes an expansion below the kappa
at which a few exact values beside it say that its error is allowed, since errors grow with kappa.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np
from flint import arb
from mpmath import mpf, nstr

from symasym.base.balls import exact_ball, precision, to_mpf
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray, Number, exact, float_text, is_array, shown
from symasym.drift.drift import Drift
from symasym.expansions import weak
from symasym.expansions.balls import AtLam, doubled, local
from symasym.methods import answer, as_floats, of_scenes
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

_ORDERS = range(9)
# Orders for many kappa of one drift, how many these are at least, and the share not bisected.
_MANY_ORDERS, _MANY, _SHARE = (2, 5), 5_000, 50


@dataclass(frozen=True)
class Term:
    """A part of T: its name, whether it is kept, and its size relative to T, with its sign."""

    name: str
    kept: bool
    size: mpf


@dataclass(frozen=True, repr=False)
class Plan:
    """The first order in weak noise whose error is allowed, else the one of the least error.

    `terms` are T's parts to it, largest first; `value` is the sum of those that are kept, `error`
    its distance to the exact T, relative to that; `suffices` says whether it is allowed.
    """

    order: int
    terms: tuple[Term, ...]
    value: mpf
    error: float
    suffices: bool

    def __str__(self) -> str:
        order = (
            f"order {self.order}" if self.suffices else f"no order suffices, {self.order} is best"
        )
        rows = (
            f"  {'kept' if t.kept else 'left out':9}{nstr(t.size, 2):>10}  {t.name}"
            for t in self.terms
        )
        return "\n".join([f"{order}: relative error {self.error:.2g}", *rows])

    __repr__ = __str__


def plan(drift: Drift, kappa: Number, r: Number, rtol: Number = 1e-6, *, start: Number = 0) -> Plan:
    """The terms of T that this scene needs, and those left out.

    Parameters
    ----------
    drift, kappa, r, start
        One scene, as in `escape_time`.
    rtol : number
        Relative error allowed, between 1e-1000 and 1.

    Examples
    --------
    >>> import symasym as sa
    >>> chosen = sa.plan(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05", 10, rtol=1e-3)
    >>> print(chosen.order, [t.name for t in chosen.terms if t.kept])
    1 ['well at 0.3969 with barrier at 0.9039']
    """
    require_drift(drift)
    numbers, allowed = {"kappa": kappa, "r": r, "start": start}, read_rtol(rtol)
    digits = max(20, len(str(int(1 / allowed))) + 8)
    scene = read_scene(drift, numbers)
    true = answer(drift, numbers, Request("T", "exact", None, digits, False, True))
    with precision(int(3.4 * digits) + 64):
        known, room, plans = arb(true.value), exact_ball(allowed), list[Plan]()
        for order in _ORDERS:
            parts = _parts(scene, order, digits)
            total, kept = sum(x for _, x in parts), len(parts)
            while kept and abs(total - parts[kept - 1][1] - known) <= room * known:
                kept -= 1
                total -= parts[kept][1]
            error = (abs(total - known) + arb(true.error)) / known
            terms = tuple(
                Term(name, k < kept, to_mpf(x / known, digits)[0])
                for k, (name, x) in enumerate(parts)
            )
            value, enough = to_mpf(total, digits)[0], bool(error <= room)
            plans.append(Plan(order, terms, value, float(error.upper()), enough))
            if enough or plans[-1].error > 2 * min(p.error for p in plans):
                break
    return min(plans, key=lambda p: (not p.suffices, p.error))


def _parts(scene: Scene, order: int, digits: int) -> list[tuple[str, Any]]:
    """T to an order in weak noise as named parts, largest first."""

    def found(bits: int) -> list[tuple[str, Any]]:
        known = local(scene.drift, scene.r, scene.start, "T", order + 1, bits)
        at, rows = AtLam(exact_ball(scene.lam), order), []
        for side, pair, value in weak.parts(known.points, known.regular, at):
            name = " with ".join(map(str, pair)) if side else "the start's own share"
            rows.append((name or f"the regular part, {'left' if side < 0 else 'right'}", value))
        return sorted(rows, key=lambda row: -abs(row[1]).mid())

    bits = int(3.4 * digits) + 100 + exponent_bits(scene.drift, scene.lam, scene.r)
    parts: list[tuple[str, Any]] = doubled(found, bits)
    return parts


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
    if request.dps is None and allowed < Fraction(999, 10**15):
        raise AccuracyError(
            f"rtol is {float_text(allowed)}, below what float64 gives (1e-12); pass dps=… for more "
            "digits."
        )
    if request.dps is not None or one_scene(drift, numbers):
        found = answer(drift, numbers, exactly._replace(full=True))
        return found if request.full else found.value
    shared = not drift.shape and not any(is_array(x) for n, x in numbers.items() if n != "kappa")
    if not shared or np.size(numbers["kappa"]) < _MANY:
        return answer(drift, numbers, exactly)
    return _of_many(float_scenes(drift, numbers), np.log1p(float(allowed)), request)


def _of_many(scenes: Scenes, most: float, request: Request) -> Any:
    """Many kappa of one drift: expansions below a kappa that exact values show, exact beyond."""
    left, used = np.argsort(-scenes.lam), list[str]()
    logs, errors = np.empty(len(left)), np.full(len(left), most * (1 - 1e-12))

    def logs_of(rows: Any, method: str, order: int | None = None) -> FloatArray:
        asked = request._replace(method=method, order=order, full=False, log=True)
        return of_scenes(rows_of(scenes, rows), asked).logs

    def allowed_at(k: int, order: int) -> bool:
        row = left[k : k + 1]
        return bool(abs(logs_of(row, "laplace", order) - logs_of(row, "exact")) <= most / 2)

    for order in _MANY_ORDERS:
        if not left.size or not allowed_at(0, order):
            continue
        low, high = 0, len(left)
        while high - low > len(left) // _SHARE + 1:
            middle = (low + high) // 2
            low, high = (middle, high) if allowed_at(middle, order) else (low, middle)
        some, left = left[: low + 1], left[low + 1 :]
        logs[some] = logs_of(some, "laplace", order)
        used.append(f"laplace, order {order}")
    if left.size:
        asked = request._replace(method="exact", full=True, log=True)
        logs[left], errors[left] = of_scenes(rows_of(scenes, left), asked)[:2]
        used.append("exact")
    return as_floats(request, scenes.shape, Answers(logs, errors, "estimate", tuple(used)))
