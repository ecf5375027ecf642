"""T by the uniform formula of order 0 of one polynomial drift, to any number of digits.

Its zeros are found and put together in float64 (`.structure`); Newton's steps then take a zero, and
a pair as a factor, to all digits. What follows from them is `.order_zero`, its numbers mpf. The
error is the size of order 1 of each part, found in float64.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.uniform.order_zero import (
    Apart,
    OrderZero,
    UniformPoint,
    factor_pair,
    with_left_out,
)
from symasym.asymptotics.uniform.structure import _structure
from symasym.asymptotics.weak_noise.compose import Composed
from symasym.asymptotics.weak_noise.evaluation import escape_time, with_digits
from symasym.asymptotics.weak_noise.one_sided import Builder
from symasym.asymptotics.weak_noise.series import BEYOND, Point
from symasym.base.errors import AccuracyError
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Digits
from symasym.numbers.polynomials import poly, refined, shifted
from symasym.series.quadratic_factor import Pair, seen_from, split_pair

__all__ = ["ClosedForm", "closed_form"]

_MOST_DEGREE = 12
# Coefficients beyond these are left to the general path, so that float64 has their powers.
_LARGEST = 1e20
# |A| at an edge beside its largest term, below which float64 doesn't tell on which side a zero is.
_NEAREST, _NEAREST_END = 1e-7, 1e-11
_MOST_STEPS = 12
# A relative error beyond which nothing is said.
_MOST = 0.4


class ClosedForm(NamedTuple):
    """T of a drift, start and radius, ready for any lam."""

    arithmetic: Digits
    composed: Composed
    names: list[str]

    def time(self, lam: Any) -> tuple[Any, Any] | None:
        """T and its error at this lam; None where these forms do not serve."""
        c, composed = self.arithmetic, self.composed
        at = UniformPoint(Point(lam, 0, True, None, c), composed.r)
        # Sizes of order 1 may be infinite; then they claim nothing.
        with np.errstate(all="ignore"):
            known = with_digits(escape_time, composed, at)
        relative = known.error / known.value if known.sure else c.inf
        if not relative < _MOST:
            return None
        left_out = c.exp(-lam * composed.slack) if composed.slack < math.inf else c.zero
        error = with_left_out(relative / (1 - relative), left_out)
        return (known.value, error * known.value) if error < 1 else None


def closed_form(drift: Drift, r: Fraction, x: Fraction, context: Any) -> ClosedForm | None:
    """None where A is no polynomial, or float64 doesn't tell in which order its zeros are.

    None as well for a start beside a barrier.
    """
    exact = drift.exact_coefficients()
    if exact is None or len(exact) > _MOST_DEGREE + 1:
        return None
    try:
        near, start = [float(a) for a in exact], float(x)
        if not 1 / _LARGEST < max(map(abs, near)) < _LARGEST or abs(start) > _LARGEST:
            return None
        arithmetic = Digits(context)
        # Sizes of order 1 may be infinite; then they claim nothing.
        with np.errstate(all="ignore"):
            one = _of_drift(near, start, exact, x, r, arithmetic)
            if one is None or one.beside_a_barrier():
                return None
            composed = Composed(one.both_sides(), arithmetic.number(r), 0.0)
            return ClosedForm(arithmetic, composed, _names(one))
    except (ArithmeticError, ValueError, AccuracyError):
        # Multiple zeros, and what overflows.
        return None


def _of_drift(
    near: list[float],
    start: float,
    exact: list[Fraction],
    x: Fraction,
    r: Fraction,
    arithmetic: Digits,
) -> OrderZero | None:
    """The structure of one drift, all its numbers with the context's digits.

    `near` and `start` are the coefficients and x in float64.
    """
    radius = float(r) if r < 2 else 2.0
    size, reach = [abs(a) for a in near], min(radius, 1.0)
    start = min(max(start, -reach), reach)
    for u in (-reach, start, reach):
        nearest = _NEAREST_END if abs(u) == 1 else _NEAREST
        if not abs(poly(near, u)) > nearest * poly(size, abs(u)):
            return None
    if not near[-1]:
        return None
    n = len(near)
    lines, rows, psi, x_above, y_above, slack = ([0.0] * k for k in (13, 208, 169, 13, 13, 1))
    owner, counts = [0] * 13, [0, 0]
    count = _structure(
        near, n, start, radius, lines, owner, rows, psi, x_above, y_above, counts, slack
    )
    if count < 0:
        return None
    context, zero = arithmetic.context, arithmetic.zero
    one = _without_zeros([arithmetic.number(a) for a in exact], x, r, arithmetic)
    one.slack = slack[0]
    real = [
        (refined(one.c, arithmetic.number(z), context), -1)
        for z, own in zip(lines[:count], owner, strict=False)
        if own < 0
    ]
    pairs: list[tuple[int, Pair, Any, int]] = []
    for k in range(counts[0]):
        row = rows[16 * k : 16 * k + 16]
        if row[9] > 0:
            # About its middle in float64, from where two steps have all digits.
            point, side = arithmetic.number(row[6] + row[7] * row[0]), int(row[7])
            taylor = seen_from(shifted(one.c, point), side)
            pair = split_pair(taylor, context, square=row[1])
            pairs.append((k, pair, point, side))
            if row[8] >= 0:
                half = arithmetic.sqrt(max(pair.square, zero))
                middle = point + side * pair.middle
                real += [(middle - half, k), (middle + half, k)]
    above = [
        refined(one.c, context.mpc(re, im), context)
        for re, im in list(zip(x_above, y_above, strict=True))[: counts[1]]
    ]
    if any(u is None for u, _ in real) or None in above:
        return None
    real.sort(key=lambda zero: zero[0])
    one.lines, one.zero_rounding = [u for u, _ in real], [0.0] * len(real)
    one.in_float = _in_float(one)
    one.apart = [Apart(factor_pair(one.c, z.real, -(z.imag**2)), z.real, zero) for z in above]
    one.together = []
    for key, (k, pair, point, side) in enumerate(pairs, start=2):
        members = tuple(j for j, (_, own) in enumerate(real) if own == k)
        one.together.append(one.of_pair(key, pair, point, side, members))
    return one.prepared()


def _without_zeros(c: list[Any], x: Fraction, r: Fraction, arithmetic: Digits) -> OrderZero:
    """The scene with these coefficients of A, its zeros left open."""
    one, self = arithmetic.one, OrderZero.__new__(OrderZero)
    self.eps = self.least = 0.0
    self.arithmetic, self.count, self.c, self.degree = arithmetic, 1 + BEYOND, c, len(c) - 1
    self.a_minus, self.a_plus = poly(c, -one), poly(c, one)
    self.start, self.beyond = arithmetic.number(x), r > 1
    reach = min(arithmetic.number(r), one)
    self.edges = [-reach, min(max(self.start, -reach), reach), reach]
    self.v, self.height_size = [-a / k for k, a in enumerate(c, start=1)], arithmetic.zero
    return self


def _in_float(one: OrderZero) -> Builder:
    """The float64 series from which the sizes of order 1 are taken."""
    self = Builder.__new__(Builder)
    self.count, self.degree, self.zero_rounding = one.count, one.degree, one.zero_rounding
    self.c, self.lines, self.edges = (
        [float(x) for x in row] for row in (one.c, one.lines, one.edges)
    )
    self.c_size = [abs(x) for x in self.c]
    return self


def _names(one: OrderZero) -> list[str]:
    """The names of the pairs and ends that are taken together."""
    names = [f"well and barrier about u = {float(p.side * p.point):.6g}" for p in one.together]
    ends = [sign for sign, barrier in one.before_end.items() if barrier is not None]
    return names + [f"barrier before u = {sign}" for sign in ends]
