"""The terms of T that are needed for a tolerance, and the order that suffices; method="auto".

A plan compares partial sums of the weak-noise expansion with the exact value, so that their error
is known and not estimated. ``method="auto"`` gives exact values; for many kappa with one drift it
uses the expansion for all kappa below a threshold, fixed by comparison with exact values at sampled
kappa, as the error of the expansion grows with kappa."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from mpmath import mpf, nstr

from symasym.base.balls import doubled, precision, rational, rounded
from symasym.base.inputs import Number, within
from symasym.drift.drift import Drift
from symasym.drift.scenes import Answer, Request, Scene, Scenes, read, require_drift
from symasym.exact import balls, floats
from symasym.expansions import weak
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.weak import WeakNoise
from symasym.methods import is_usual

# For many kappa with one drift: the order, the least number of kappa, and the sampling stride.
_ORDER, _MANY, _STRIDE = 5, 5_000, 100


class Term(NamedTuple):
    """A term of T: its name, whether it is kept, and its ratio to T."""

    name: str
    kept: bool
    size: mpf


@dataclass(frozen=True, repr=False)
class Plan:
    """The lowest order of the weak-noise expansion whose error is allowed, else the best order.

    `terms` are the terms of T to this order, largest first; `value` is the sum of the kept ones,
    `error` its relative distance to the exact T; `suffices` is True if this error is allowed.
    """

    order: int
    terms: tuple[Term, ...]
    value: mpf
    error: float
    suffices: bool

    def __str__(self) -> str:
        first = "order {}" if self.suffices else "no order suffices, {} is best"
        rows = [f"{first.format(self.order)}: relative error {self.error:.2g}"]
        for name, kept, size in self.terms:
            rows.append(f"  {'kept' if kept else 'left out':9}{nstr(size, 2):>10}  {name}")
        return "\n".join(rows)

    __repr__ = __str__


def plan(drift: Drift, kappa: Number, r: Number, rtol: Number = 1e-6, *, start: Number = 0) -> Plan:
    """The terms of T that are needed in a scene for a tolerance, and those that are not.

    Parameters
    ----------
    drift, kappa, r, start
        One scene, as in `escape_time`.
    rtol : number
        The relative error allowed, at most 1/2.

    Examples
    --------
    >>> import symasym as sa
    >>> chosen = sa.plan(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05", 10, rtol=1e-3)
    >>> print(chosen.order, [t.name for t in chosen.terms if t.kept])
    1 ['well at 0.3969 with barrier at 0.9039']
    """
    require_drift(drift)
    allowed = within("rtol", rtol, 1e-300, 0.5)
    digits = max(20, len(str(int(1 / allowed))) + 8)
    scene = read(drift, {"kappa": kappa, "r": r, "start": start}).one()
    request = Request("T", dps=digits, full=True)
    true = balls.of_scene(scene, request).value

    def parts(order: int, bits: int) -> list[tuple[str, Any]]:
        """The named terms of T to an order of the weak-noise expansion, largest first."""
        known = WeakNoise.of(scene, request, order).known(bits)
        at, rows = InBalls(arb(rational(scene.lam)), order), []
        for side, pair, value in weak.parts(known.points, known.regular, at):
            name = " with ".join(map(str, pair)) if side else "the start's own share"
            rows.append((name or f"the regular part, {'left' if side < 0 else 'right'}", value))
        return sorted(rows, key=lambda row: -abs(row[1]).mid())

    with precision(int(3.4 * digits) + 64):
        room, plans = arb(rational(allowed)), list[Plan]()
        bits = WeakNoise.of(scene, request, 0).bits(scene.lam, digits)
        for order in range(9):
            rows = doubled(partial(parts, order), bits)
            total, kept = sum(x for _, x in rows), len(rows)
            while kept and abs(total - rows[kept - 1][1] - true) <= room * true:
                kept -= 1
                total -= rows[kept][1]
            error = abs(total - true) / true
            sizes = ((name, rounded(x / true, digits)[0]) for name, x in rows)
            terms = tuple(Term(name, k < kept, x) for k, (name, x) in enumerate(sizes))
            value, enough = rounded(total, digits)[0], bool(error <= room)
            plans.append(Plan(order, terms, value, float(error.upper()), enough))
            if enough or plans[-1].error > 2 * min(p.error for p in plans):
                break
    return min(plans, key=lambda p: (not p.suffices, p.error))


def of_scene(scene: Scene, request: Request) -> Answer:
    """The exact value."""
    return balls.of_scene(scene, request)._replace(method="exact")


def of_scenes(scenes: Scenes, request: Request) -> Answer:
    """Exact values; for many kappa with one drift, the expansion below a threshold for kappa."""
    alike = not scenes.drift.shape and scenes.numbers.keys() - scenes.exactly.keys() == {"kappa"}
    usual = is_usual(scenes.drift, scenes.numbers, request)
    if not (alike and usual) or len(scenes.lam) < _MANY:
        return floats.of_scenes(scenes, request)._replace(method="exact")
    rising, most = np.argsort(-scenes.lam), np.log1p(float(request.rtol))

    def expanded(rows: Any) -> Any:
        asked = request._replace(order=(_ORDER,), full=False, log=True)
        return weak.of_scenes(scenes.some(rows), asked).value

    some = rising[::_STRIDE]
    apart = np.abs(expanded(some) - floats.of_scenes(scenes.some(some), request).value)
    # The threshold is the last sample before the first with too large an error.
    known = int(np.argmin(np.append(apart <= most / 2, False)))
    below, above = np.split(rising, [max(0, _STRIDE * (known - 1) + 1)])
    logs, errors = np.empty(len(rising)), np.full(len(rising), most * (1 - 1e-12))
    if below.size:
        logs[below] = expanded(below)
    if above.size:
        exact = floats.of_scenes(scenes.some(above), request)
        logs[above], errors[above] = exact.value, exact.error
    used = (f"laplace, order {_ORDER}",) * bool(below.size) + ("exact",) * bool(above.size)
    return Answer(logs, "estimate", error=errors, notes=used)
