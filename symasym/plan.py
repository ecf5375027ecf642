"""Which terms of T a scene needs for a tolerance, and the order that suffices; method="auto".

The exact value is cheap, so that the error is known, not estimated; what a plan adds is which terms
carry T. ``method="auto"`` takes the exact value, but for many kappa of one drift an expansion up to
the kappa at which exact values beside it say that its error is allowed, as errors grow with kappa.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from flint import arb
from mpmath import mpf, nstr

from symasym.base.balls import exact_ball, precision, to_mpf
from symasym.base.inputs import Number, is_array, within
from symasym.drift import scenes
from symasym.drift.drift import Drift
from symasym.drift.formula import rational
from symasym.exact.balls import bits_of_way
from symasym.expansions import weak
from symasym.expansions.arithmetic import InBalls
from symasym.expansions.ball_drift import Between, doubled
from symasym.expansions.weak import local
from symasym.methods import answer, as_floats, is_usual, of_scenes

# The order for many kappa of one drift, how many these are at least, and which of them are tried.
_ORDER, _MANY, _STRIDE = 5, 5_000, 100


class Term(NamedTuple):
    """A part of T: its name, whether it is kept, and its size relative to T, with its sign."""

    name: str
    kept: bool
    size: mpf


@dataclass(frozen=True, repr=False)
class Plan:
    """The first order in weak noise whose error is allowed, else the one of the least error.

    `terms` are T's parts to it, largest first; `value` is the sum of those that are kept, `error`
    its relative distance to the exact T; `suffices` says whether that is allowed.
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
    """The terms of T that this scene needs, and those left out.

    Parameters
    ----------
    drift, kappa, r, start
        One scene, as in `escape_time`.
    rtol : number
        Relative error allowed, at most 1/2.

    Examples
    --------
    >>> import symasym as sa
    >>> chosen = sa.plan(sa.friction(mu=3, alpha=1, z0="-0.4"), "0.05", 10, rtol=1e-3)
    >>> print(chosen.order, [t.name for t in chosen.terms if t.kept])
    1 ['well at 0.3969 with barrier at 0.9039']
    """
    scenes.require_drift(drift)
    numbers = {"kappa": kappa, "r": r, "start": start}
    allowed = within("rtol", rtol, 1e-300, 0.5)
    digits = max(20, len(str(int(1 / allowed))) + 8)
    scene = scenes.read_scene(drift, numbers)
    true = answer(drift, numbers, scenes.Request("T", "exact", None, digits, False, True))
    more = int(3.4 * digits) + 100 + bits_of_way(rational(scene.lam), rational(1 + scene.r)) + 16

    def parts(order: int, bits: int) -> list[tuple[str, Any]]:
        """T to an order in weak noise as named parts, largest first."""
        known = local(drift, Between(*scene.ends, scene.start), "T", order + 1, bits)
        at, rows = InBalls(exact_ball(scene.lam), order), []
        for side, pair, value in weak.parts(known.points, known.regular, at):
            name = " with ".join(map(str, pair)) if side else "the start's own share"
            rows.append((name or f"the regular part, {'left' if side < 0 else 'right'}", value))
        return sorted(rows, key=lambda row: -abs(row[1]).mid())

    with precision(int(3.4 * digits) + 64):
        known, room, plans = arb(true.value), exact_ball(allowed), list[Plan]()
        for order in range(9):
            rows = doubled(partial(parts, order), more)
            total, kept = sum(x for _, x in rows), len(rows)
            while kept and abs(total - rows[kept - 1][1] - known) <= room * known:
                kept -= 1
                total -= rows[kept][1]
            error = (abs(total - known) + arb(true.error)) / known
            sizes = ((name, to_mpf(x / known, digits)[0]) for name, x in rows)
            terms = tuple(Term(name, k < kept, x) for k, (name, x) in enumerate(sizes))
            value, enough = to_mpf(total, digits)[0], bool(error <= room)
            plans.append(Plan(order, terms, value, float(error.upper()), enough))
            if enough or plans[-1].error > 2 * min(p.error for p in plans):
                break
    return min(plans, key=lambda p: (not p.suffices, p.error))


def automatic(drift: Drift, numbers: Any, rtol: Number | None, request: scenes.Request) -> Any:
    """The quantity of `request` with a relative error of at most `rtol`."""
    digits = (request.order, request.dps) != (None, None)  # which the exact value has or refuses
    allowed = within("rtol", rtol, 1e-300 if digits else 1e-12, 0.5)
    shared = not drift.shape and not any(is_array(x) for n, x in numbers.items() if n != "kappa")
    usual = is_usual(drift, numbers, request)
    if digits or not (shared and usual) or np.size(numbers["kappa"]) < _MANY:
        return answer(drift, numbers, request._replace(method="exact"))
    every, most = scenes.float_scenes(drift, numbers), np.log1p(float(allowed))
    rising = np.argsort(-every.lam)

    def found(rows: Any, method: str, order: int | None = None) -> scenes.Answers:
        asked = request._replace(method=method, order=order, full=method == "exact", log=True)
        return of_scenes(scenes.rows_of(every, rows), asked)

    some = rising[::_STRIDE]
    apart = np.abs(found(some, "laplace", _ORDER).logs - found(some, "exact").logs)
    # The expansion up to the last of those before the first that is too far off.
    known = int(np.argmin(np.append(apart <= most / 2, False)))
    below, above = np.split(rising, [max(0, _STRIDE * (known - 1) + 1)])
    logs, errors = np.empty(len(rising)), np.full(len(rising), most * (1 - 1e-12))
    if below.size:
        logs[below] = found(below, "laplace", _ORDER).logs
    if above.size:
        logs[above], errors[above] = found(above, "exact")[:2]
    used = (f"laplace, order {_ORDER}",) * bool(below.size) + ("exact",) * bool(above.size)
    return as_floats(request, every.shape, scenes.Answers(logs, errors, "estimate", used))
