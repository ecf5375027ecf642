"""T, C and P for weak noise, uniform as wells, barriers, the start and the ends of the layer meet.

Each side of the start is a row of panels in canonical form (`symasym.expansions.canonical`), then
the straight potential beyond the layer. With B = int e^{lam V} and J = int m, m' = 1 - lam phi m,
of both sides,

    T = lam (B_L J_R + B_R J_L)/(B_L + B_R),    C = B_R/(B_L + B_R),

and P is m/E of the one stretch [-1, 1], which is int e^{-lam V}, to the same with both tails. Each
is an expansion in powers of kappa^2. With ``full=True`` its error is the distance to the exact
value in a ball, which costs less than the expansion: proved. Without, it is refused where three
times the sum of the next three differences, of it or of B, is half of the value or more.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache, reduce
from itertools import pairwise
from typing import Any

from flint import arb, ctx, fmpq

from symasym.base.balls import exact_ball, precision, to_mpf
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.drift.scenes import Answer, Request, Scene
from symasym.exact import balls
from symasym.expansions.canonical import Way, straight, ways
from symasym.expansions.coalescence import SHARE, Field, Panel

# Orders beyond the one asked for, of which the error is made, and their weight.
_MORE, _SAFETY = 3, 3
# Digits of a value in float64.
_FLOAT = 14
_KEPT = 16
_ONE = Fraction(1)
_TERMS = ("wells, barriers, the start and the ends of the layer, all that meet taken together",)
_DROPPED = ("higher powers of kappa^2",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """The quantity to an order, of one scene."""
    digits = _FLOAT if request.dps is None else request.dps
    # In steps, so that scenes of about the same noise share an analysis.
    nats = 8.0 * math.ceil((math.log(10) * digits + math.log(2 + scene.lam)) / 8)
    terms, bits = math.ceil(-nats / math.log(SHARE)), int(1.5 * nats) + 40
    with precision(bits):
        ctx.cap = terms
        more = 0 if request.full else _MORE
        rows = _orders(scene, request.name, request.order + more, terms, bits, nats)[-more - 1 :]
        value = rows[0][0].mid()
        known = value > 0
        if request.full and known:
            exact = balls.of_scene(scene, request._replace(method="exact", order=None))
            value = value.log() if request.log else value
            error = abs(value - arb(exact.value)) + arb(exact.error)
            known = error < (arb(2).log() if request.log else value / 2)
        elif known:
            # A ratio hides that its parts diverge.
            gaps = [
                _SAFETY * sum((abs(y - x) for x, y in pairwise(row)), arb(0))
                for row in zip(*rows, strict=True)
            ]
            # Digits are lost in exponentials as large as the value is or small.
            error = gaps[0] + value * (1 + abs(value.log())) * arb(10) ** (1 - digits)
            parts = zip((value, *rows[0][1:]), (error, *gaps[1:]), strict=True)
            known = all(gap < abs(x) / 2 for x, gap in parts)
            if request.log:
                value, error = value.log(), -(-error / value).log1p()
        if not known:
            raise AccuracyError(
                f"kappa is {scene.noise}, where the uniform expansion of {request.name} to order "
                f"{request.order} is not known to be within half its value; give a smaller kappa, "
                "or use method='exact'."
            )
        mid, rad = to_mpf(value, digits + 5)
        error = to_mpf((error + arb(rad)).upper() * (1 + arb(2) ** -50), 20)[0]
    return Answer(mid, error, "bound" if request.full else "estimate", _TERMS, _DROPPED)


def _orders(
    scene: Scene, name: str, order: int, terms: int, bits: int, nats: float
) -> list[tuple[Any, ...]]:
    """The quantity to each order up to this one, and the integrals of which it is made."""
    drift, lam = scene.drift, exact_ball(scene.lam)
    a = _slopes(drift, bits)
    if name[-1] == "P":
        layer = _layer(drift, False, -_ONE, _ONE, order, terms, bits)
        found: list[tuple[Any, ...]] = []
        for w in _joined(layer, [], [], lam, nats, order):
            inside, outside = w.m / w.E, (1 / a[0] - 1 / (a[1] * w.E)) / lam
            found.append(((inside if name == "P" else outside) / (inside + outside), inside))
        return found
    sides = []
    for mirrored in (False, True):
        x = -scene.start if mirrored else scene.start
        near, far = (-a[1], -a[0]) if mirrored else a
        low, high = min(max(x, -_ONE), _ONE), min(scene.r, _ONE)
        before = [(near, min(-_ONE, scene.r) - x)] if x < -1 else []
        after = [(far, scene.r - max(x, _ONE))] if scene.r > 1 else []
        layer = _layer(drift, mirrored, low, high, order, terms, bits) if low < high else []
        sides.append(_joined(layer, before, after, lam, nats, order))
    rows = []
    for p, q in zip(*sides, strict=True):
        share = (q if name == "1 - C" else p).B / (q.B + p.B)
        value = lam * (q.B * p.J + p.B * q.J) / (q.B + p.B) if name == "T" else share
        rows.append((value, p.B, q.B))
    return rows


def _joined(
    layer: list[Panel], before: list[Any], after: list[Any], lam: Any, nats: float, order: int
) -> list[Way]:
    """A side to each order."""
    rows = [ways(one, lam, nats) for one in layer]
    ends = [[straight(a, exact_ball(length), lam) for a, length in x] for x in (before, after)]
    orders = zip(*rows, strict=True) if rows else [()] * (order + 1)
    return [reduce(Way.then, [*ends[0], *row, *ends[1]]) for row in orders]


@lru_cache(maxsize=_KEPT)
def _field(drift: Drift, bits: int) -> Field:
    return Field(pieces(drift, fmpq(-1), fmpq(1))[0].phi)


@lru_cache(maxsize=_KEPT)
def _slopes(drift: Drift, bits: int) -> tuple[Any, Any]:
    """a- and a+."""
    both = pieces(drift, fmpq(-2), fmpq(2))
    return both[0].phi(arb(-1)), both[-1].phi(arb(1))


@lru_cache(maxsize=2 * _KEPT)
def _layer(
    drift: Drift, mirrored: bool, low: Fraction, high: Fraction, order: int, terms: int, bits: int
) -> list[Panel]:
    """The panels of one side of the start, seen from there."""
    field = _field(drift, bits)
    return (field.mirrored() if mirrored else field).panels(
        exact_ball(low), exact_ball(high), order
    )
