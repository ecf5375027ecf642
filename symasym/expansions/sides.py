"""T, C and P from the two sides of the start, which are divided into stretches.

A stretch extends from a, its end nearer to the start, to b. With V(a) = 0 its record is

    scale = int e^{lam V},    speed = e^{lam V(b)} int e^{-lam V},    climb = e^{lam V(b)},
    nested = int int e^{lam (V(u) - V(v))} over v between a and u.

With the records of everything left (L) and right (R) of the start,

    T = lam (scale_L nested_R + scale_R nested_L)/(scale_L + scale_R),
    C = scale_R/(scale_L + scale_R),

and P is the share of the layer, one stretch from 1 to -1, in the integral of e^{-lam V}.

The arithmetics are those of `symasym.expansions.arithmetic`, or SymPy's.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import partial, reduce
from typing import Any, NamedTuple

from flint import arb, fmpq

from symasym.base.balls import rational
from symasym.drift.drift import Drift
from symasym.drift.evaluate import pieces
from symasym.expansions.ball_drift import Between

_ONE = Fraction(1)


class Stretch(NamedTuple):
    """The record of a stretch, or of several in a row."""

    scale: Any
    speed: Any
    nested: Any
    climb: Any

    def then(self, other: Stretch) -> Stretch:
        """The record of this stretch followed by another, farther from the start."""
        return Stretch(
            self.scale + self.climb * other.scale,
            self.speed * other.climb + other.speed,
            self.nested + other.nested + self.speed * other.scale,
            self.climb * other.climb,
        )


StretchAt = Callable[[Any], Stretch]


def straight(slope: Any, length: Any, arithmetic: Any) -> Stretch:
    """The record for a constant drift, which is `slope` towards the start."""
    rise, length = slope * length, arithmetic.number(length)
    whole = arithmetic.exprel(rise, 1) * length
    nested = arithmetic.exprel(rise, 2) * length * length
    return Stretch(whole, whole, nested, arithmetic.exp(rise))


def quantity(name: str, sides: Sequence[Stretch], slopes: tuple[Any, Any], lam: Any) -> Any:
    """T, C or 1 - C from both sides, or P or 1 - P from the layer; `slopes` are a- and a+."""
    if name[-1] == "P":
        inside = sides[0]
        outside = 1 / (slopes[0] * lam) + inside.climb / (-slopes[1] * lam)
        return (inside.speed if name == "P" else outside) / (outside + inside.speed)
    left, right = sides
    total = left.scale + right.scale
    if name == "T":
        return (right.scale * left.nested + left.scale * right.nested) * lam / total
    return (right.scale if name == "C" else left.scale) / total


class Sides(NamedTuple):
    """Rows of functions that evaluate the records of each side in an arithmetic; a- and a+."""

    rows: list[list[StretchAt]]
    slopes: tuple[Any, Any]

    def sum(self, name: str, arithmetic: Any) -> Any:
        """The quantity in an arithmetic."""
        sides = [reduce(Stretch.then, (part(arithmetic) for part in row)) for row in self.rows]
        low, high = map(arithmetic.number, self.slopes)
        return quantity(name, sides, (low, high), arithmetic.lam)


def sides_of(
    drift: Drift,
    between: Between,
    name: str,
    layer: Callable[[bool, Fraction, Fraction], list[StretchAt]],
) -> Sides:
    """The sides of the start; for P a single one, the layer.

    ``layer(mirrored, low, high)`` covers [low, high] in the layer for the drift phi(u), or in its
    mirror image for -phi(-u).
    """
    left, _, right = pieces(drift, fmpq(-2), fmpq(2))
    slopes = left.phi(arb(-1)), right.phi(arb(1))
    if name[-1] == "P":
        return Sides([[*layer(True, -_ONE, _ONE)]], slopes)
    rows = []
    for mirrored in (True, False):
        sign = -1 if mirrored else 1
        x, end = sign * between.start, sign * (between.left if mirrored else between.right)
        near, far = (-sign * a for a in slopes[::sign])
        row: list[StretchAt] = []
        if x < -1:
            row.append(partial(straight, near, arb(rational(min(-_ONE, end) - x))))
        if max(x, -_ONE) < min(end, _ONE):
            row += layer(mirrored, max(x, -_ONE), min(end, _ONE))
        if end > 1:
            row.append(partial(straight, far, arb(rational(end - max(x, _ONE)))))
        rows.append(row)
    return Sides(rows, slopes)
