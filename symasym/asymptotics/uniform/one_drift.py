"""T by the uniform formula of order 0 of one polynomial drift, to any number of digits.

Its zeros are found and put together in float64 (`.structure`); Newton's steps then take a zero, and
Bairstow's a pair, to all digits. What follows from them is `.order_zero`, its numbers mpf. The
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
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Arithmetic, Digits
from symasym.numbers.polynomials import divided, poly, refined, shifted
from symasym.series.quadratic_factor import Pair as Local
from symasym.series.quadratic_factor import mean_of_psi, mean_of_values, seen_from

__all__ = ["Scene", "scene_of"]

_MOST_DEGREE = 12
# Coefficients beyond these are left to the general path, so that float64 has their powers.
_LARGEST = 1e20
# |A| at an edge beside its largest term, below which float64 doesn't tell on which side a zero is.
_NEAREST, _NEAREST_END = 1e-7, 1e-11
_MOST_STEPS = 12
# A relative error beyond which nothing is said.
_MOST = 0.4


class Scene(NamedTuple):
    """A drift, start and radius, ready for any lam."""

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


def scene_of(drift: Drift, r: Fraction, x: Fraction, context: Any) -> Scene | None:
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
            return Scene(arithmetic, composed, _names(one))
    except (ArithmeticError, ValueError):
        # Multiple zeros, and what overflows.
        return None


class _Factor(NamedTuple):
    """(u - middle)² - square, what A is over it, and the row of `.structure` if it is taken so."""

    middle: Any
    square: Any
    psi: list[Any]
    row: int | None


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
    c = [arithmetic.number(a) for a in exact]
    real: list[tuple[Any, int | None]] = []
    for z, own in zip(lines[:count], owner, strict=False):
        if own < 0:
            real.append((refined(c, arithmetic.number(z), arithmetic.context), None))
    factors = []
    for k in range(counts[0]):
        row = rows[16 * k : 16 * k + 16]
        if row[9] > 0:
            factors.append(_factor(c, row[6] + row[7] * row[0], row[1], k, arithmetic))
    for re, im in list(zip(x_above, y_above, strict=True))[: counts[1]]:
        factors.append(_factor(c, re, -im * im, None, arithmetic))
    if any(u is None for u, _ in real) or any(f is None for f in factors):
        return None
    known = [f for f in factors if f is not None]
    return _with_factors(c, real, known, (rows, psi, slack[0]), x, r, arithmetic)


def _factor(
    c: list[Any], middle: float, square: float, row: int | None, arithmetic: Digits
) -> _Factor | None:
    """The factor to all digits, by Bairstow's steps for u² + p u + q; None where they fail."""
    context, half = arithmetic.context, arithmetic.number(middle)
    p, q = -2 * half, half * half - arithmetic.number(square)
    least = context.ldexp(1, -context.prec // 2 - 8)
    for _ in range(_MOST_STEPS):
        rest, r1, r0 = divided(c, p, q)
        _, s1, s0 = divided(rest, p, q)
        det = q * s1 * s1 + s0 * (s0 - p * s1)
        if not det:
            return None
        step_p = (s1 * r0 - s0 * r1) / det
        step_q = ((p * s1 - s0) * r0 - q * s1 * r1) / det
        p, q = p - step_p, q - step_q
        if abs(step_p) + abs(step_q) <= least * (1 + abs(p) + abs(q)):
            half = -p / 2
            return _Factor(half, p * p / 4 - q, shifted(divided(c, p, q)[0], half), row)
    return None


def _with_factors(
    c: list[Any],
    real: list[tuple[Any, int | None]],
    factors: list[_Factor],
    found: tuple[list[float], list[float], float],
    x: Fraction,
    r: Fraction,
    arithmetic: Digits,
) -> OrderZero:
    """The scene of these zeros; the pairs' rows, what is left of A there, and the slack."""
    zero, one = arithmetic.zero, arithmetic.one
    rows, psi, slack = found
    self = OrderZero.__new__(OrderZero)
    self.eps = self.least = 0.0
    self.arithmetic, self.count, self.c, self.degree = arithmetic, 1 + BEYOND, c, len(c) - 1
    self.a_minus, self.a_plus = poly(c, -one), poly(c, one)
    self.start, self.beyond = arithmetic.number(x), r > 1
    reach = min(arithmetic.number(r), one)
    self.edges = [-reach, min(max(self.start, -reach), reach), reach]
    self.v, self.height_size = [-a / k for k, a in enumerate(c, start=1)], zero
    for f in factors:
        if f.row is not None and rows[16 * f.row + 8] >= 0:
            half = arithmetic.sqrt(max(f.square, zero))
            real = [*real, (f.middle - half, f.row), (f.middle + half, f.row)]
    real.sort(key=lambda pair: pair[0])
    self.lines = [u for u, _ in real]
    self.zero_rounding = [0.0] * len(real)
    self.in_float = _in_float(self)
    self.slack, self.together, self.apart = slack, [], []
    for f in factors:
        if f.row is None:
            self.apart.append(Apart(factor_pair(c, f.middle, f.square, f.psi), f.middle, zero))
            continue
        members = tuple(k for k, (_, own) in enumerate(real) if own == f.row)
        side, at = int(rows[16 * f.row + 7]), 13 * f.row
        left = psi[at : at + self.degree - 1]
        near = Local(0.0, rows[16 * f.row + 1], left, 1, 0.0, 0.0, 0.0)
        pair = _local(f, side, arithmetic)
        key = 2 + len(self.together)
        self.together.append(self.of_pair(key, pair, f.middle, side, members, near))
    return self.prepared()


def _in_float(one: OrderZero) -> Builder:
    """The float64 series from which the sizes of order 1 are taken."""
    self = Builder.__new__(Builder)
    self.count, self.degree, self.zero_rounding = one.count, one.degree, one.zero_rounding
    self.c, self.lines, self.edges = (
        [float(x) for x in row] for row in (one.c, one.lines, one.edges)
    )
    self.c_size = [abs(x) for x in self.c]
    return self


def _local(factor: _Factor, side: int, arithmetic: Arithmetic) -> Local:
    """The pair as `symasym.asymptotics.coalescence.cubic_map` takes it, seen to that side."""
    psi, square = seen_from(factor.psi, side), factor.square
    sign = 1 if psi[0] > 0 else -1
    psi = [sign * a for a in psi]
    root = arithmetic.cbrt(mean_of_psi(psi, square))
    level = sign * mean_of_values(psi, square)
    return Local(arithmetic.zero, square, psi, sign, square * root * root, 1 / root, level)


def _names(one: OrderZero) -> list[str]:
    """The names of the pairs and ends that are taken together."""
    names = [f"well and barrier about u = {float(p.side * p.point):.6g}" for p in one.together]
    ends = [sign for sign, barrier in one.before_end.items() if barrier is not None]
    return names + [f"barrier before u = {sign}" for sign in ends]
