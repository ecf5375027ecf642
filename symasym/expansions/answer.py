"""Weak noise as a method: T, C and P of a scene to an order, with what is left out.

The error of one scene is its distance to the exact value, enclosed in balls. Where that is not
asked for, and in arrays, it is three times the sum of the next three differences of the orders,
an estimate, which counts below half the value. An asymptotic series is best cut off where that
is least (R. B. Dingle, Asymptotic Expansions, 1973, ch. I): order "optimal".
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import pairwise
from typing import Any

from flint import arb

from symasym.base.call_context import own_context
from symasym.base.errors import AccuracyError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.exact import balls as exact
from symasym.expansions.arrays import BITS, NEXT, AtLams, Expanded, of_drifts, orders_of, other
from symasym.expansions.balls import LINE, quantity, resolved, values
from symasym.numbers.balls import precision, to_mpf
from symasym.scenes import Answer, Answers, Request, Scene, Scenes, exponent_bits

DROPPED = ("higher orders of every series, in the error",)
_BOUNDED = ("higher orders of every series, and what is exponentially small, in the bound",)
_TIME = "start, ends, kinks and the regular part"
# Digits up to which the exact value costs no more than some expansions.
_MOST_DIGITS = 300

#: Balls of a quantity to some orders, or of its complement.
Values = Callable[[list[int], bool], list[Any]]


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P, or a complement, to the request's order, any start."""
    name, digits, orders = request.name, request.digits, orders_of(request)
    r, start = LINE if name[-1] == "P" else (scene.r, scene.start)
    bits = _bits(scene, digits, r, start)
    # As many terms as the estimate takes, where it is likely to be needed.
    terms = orders[-1] + 1 + NEXT * (not request.full or len(orders) > 1)

    def to_orders(some: list[int], complement: bool = False) -> list[Any]:
        asked = other(name) if complement else name
        return values(scene.drift, scene.lam, r, start, asked, some, digits + 5, bits, terms)

    found = of_series(scene, request, to_orders, too_strong(scene.noise, orders))
    points = resolved(scene.drift, r, start, name, terms, bits).points
    words = (f"{p.name} at u = {float(p.u):.6g}" for p in points if p.peak)
    kept = (w for w in words if name[-1] != "P" or w.startswith("well"))
    return found._replace(terms=(*sorted(kept), "kinks" if name[-1] == "P" else _TIME))


def _bits(scene: Scene, digits: int, r: Fraction, start: Fraction) -> int:
    """The bits to begin with."""
    bits = int(3.33 * digits) + exponent_bits(scene.drift, scene.lam, r)
    bits += 80 + int(r / (r - abs(start))).bit_length()
    return bits - bits % -64


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same in float64: each drift's series once, then all its kappa."""
    count, sliding = max(orders_of(request)) + NEXT + 1, request.name[-1] == "P"

    def expanded(drift: Drift, r: Fraction, start: Fraction, name: str) -> Expanded:
        r, start = LINE if sliding else (r, start)
        known = resolved(drift, r, start, name, count, BITS)

        def in_floats(lam: FloatArray, order: int) -> Any:
            return quantity(known, name, AtLams(lam, order))

        def in_balls(lam: Fraction, orders: list[int]) -> list[Any]:
            bits = BITS + exponent_bits(drift, lam, r)
            return values(drift, lam, r, start, name, orders, 20, bits - bits % 64)

        return Expanded(in_floats, in_balls)

    logs, errors, why = of_drifts(scenes, request, expanded, too_strong)
    terms = "wells and kinks" if sliding else f"wells, barriers, {_TIME}"
    return Answers(logs, errors, "estimate", (terms,), DROPPED, why)


def _differences(values: Sequence[Any]) -> Any:
    """Three times the sum of the differences."""
    return sum((abs(b - a).upper() for a, b in pairwise(values)), arb(0)) * 3


def of_series(scene: Scene, request: Request, to_orders: Values, refusal: AccuracyError) -> Answer:
    """The best of the request's orders with its error; the refusal where it has none."""
    orders, digits, log = list(orders_of(request)), request.digits, request.log
    proved = _exact(scene, request) if request.full and len(orders) == 1 else None
    with precision(int(3.33 * digits) + 64), own_context(digits + 15) as context:

        def number(x: Any) -> Any:
            return context.make_mpf(to_mpf(x, digits + 10)[0]._mpf_)

        order, estimate = orders[0], None
        if proved is None:
            rows = to_orders([*orders, *range(orders[-1] + 1, orders[-1] + NEXT + 1)], False)
            estimates = [_differences(rows[k : k + NEXT + 1]) for k in range(len(orders))]
            best = estimates.index(min(estimates))
            order, relative = orders[best], estimates[best] / rows[best]
            if 0 < relative < 0.5:
                estimate = number(-(-relative).log1p() if log else estimates[best])
            if request.full or estimate is None:
                proved = _exact(scene, request)
        ball = to_orders([order], False)[0]
        if not ball > 0:
            raise refusal
        if log and ball > 0.5 and request.name != "T":
            ball = (-to_orders([order], True)[0]).log1p()
        elif log:
            ball = ball.log()
        value, error = number(ball), estimate
        kind: ErrorKind = "estimate"
        if proved is not None:
            middle, radius = (context.make_mpf(x._mpf_) for x in (proved.value, proved.error))
            error, kind = abs(value - middle) + radius, proved.kind
        most = max(context.ln2, abs(value) / 10**11) if log else value / 2
        if error is None or not error < most:
            raise refusal
        error += abs(value) * context.mpf(10) ** -(digits + 5)
        return Answer(value, error, kind, (), _BOUNDED if kind == "bound" else DROPPED, order)


def _exact(scene: Scene, request: Request) -> Answer | None:
    """The exact value in a ball; None where it would cost far more than the expansion."""
    if request.digits > _MOST_DIGITS:
        return None
    asked = request._replace(method="exact", order=None, dps=request.digits + 2, full=True)
    with suppress(AccuracyError):
        return exact.of_scene(scene, asked)
    return None


def too_strong(kappa: str, orders: Sequence[int]) -> AccuracyError:
    """The refusal of a scene whose error is as large as its value."""
    single = len(orders) == 1
    tried = f"order={orders[0]}" if single else f"any order to {orders[-1]}"
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong, or a well, a barrier or the start too "
        f"close to another or to an end, for Laplace's method with {tried}: what is left out is as "
        f"large as the value; {'give another order, or ' * single}use method='exact'."
    )
