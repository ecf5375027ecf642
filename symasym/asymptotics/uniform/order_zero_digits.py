"""T by the uniform formula of order 0 of one polynomial drift, to any number of digits.

The structure is that of `symasym.asymptotics.uniform.order_zero`, its numbers mpf; the zeros of A
are taken to all digits by `symasym.numbers.factors`. The error is the size of order 1 of each part,
found in float64.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import reduce
from itertools import pairwise
from operator import add
from typing import Any, NamedTuple

from symasym.asymptotics.uniform.order_zero import Apart, OrderZero, factor_pair, with_left_out
from symasym.asymptotics.weak_noise.compose import sides_of, time_of
from symasym.asymptotics.weak_noise.one_sided import Builder, OneSided
from symasym.asymptotics.weak_noise.series import BEYOND, Series, Value
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Arithmetic, Digits
from symasym.numbers.factors import Factor, Line, Pieces, pieces_of, seen_from
from symasym.numbers.polynomials import poly
from symasym.numbers.quadratic_factor import Pair as Local
from symasym.numbers.quadratic_factor import mean_of_values

__all__ = ["Scene", "scene_of"]

_MOST_DEGREE = 12
# Coefficients beyond these are left to the general path, so that float64 has their powers.
_LARGEST = 1e20
# Ratio of two neighbouring terms beyond which a series is taken to have stopped falling.
_MOST_FALL = 0.75
# A relative error beyond which nothing is said.
_MOST = 0.4


class _DigitsPoint:
    """One lam and the numbers made of it, and a ring of `Value` there (`compose.Ring`)."""

    errors = True
    rounding = 0.0

    def __init__(self, lam: Any, r: Any, arithmetic: Digits) -> None:
        self.lam, self.r, self.arithmetic = lam, r, arithmetic
        self.x, self.third = 1 / lam, arithmetic.cbrt(lam)
        self.known: dict[Any, Any] = {}
        self.weights: dict[Any, Any] = {}
        self.root, self.small = arithmetic.sqrt(self.x), float(self.x)

    def number(self, x: Any) -> Any:
        return x

    def total(self, terms: list[Value]) -> Value:
        return reduce(add, terms)

    def leaf(self, height: Any, series: Any, rough: Any = 0.0) -> Value:
        """A series or local integral times e^{lam height}, and what it leaves out."""
        if not isinstance(series, Series):
            pair = Value(*series.at(self))
        elif not series.parts:
            return Value(self.arithmetic.zero, self.arithmetic.zero)
        else:
            (part,) = series.parts
            front = self.x if part.offset == 1 else self.root
            sizes = [abs(float(c)) * self.small**n for n, c in enumerate(part.coefficients)]
            pair = Value(part.coefficients[0] * front, _left_out(sizes) * front)
        if not height:
            return pair
        factor = self.weight(height)
        return Value(pair.value * factor, pair.error * factor)

    def weight(self, height: Any) -> Any:
        """e^{lam height}; one exponential serves both signs."""
        size = abs(height)
        if size not in self.weights:
            self.weights[size] = self.arithmetic.exp(self.lam * size)
        return self.weights[size] if height > 0 else 1 / self.weights[size]


def _left_out(sizes: list[float]) -> float:
    """The sum after the first term: the others over 1 - q, q the largest ratio of neighbours."""
    known = sizes[next((k for k, size in enumerate(sizes) if size), 0) :]
    ratio = max((after / before for before, after in pairwise(known) if before), default=0.0)
    return sum(sizes[1:]) / (1 - min(ratio, _MOST_FALL))


class Scene(NamedTuple):
    """A drift, start and radius, ready for any lam."""

    arithmetic: Digits
    sides: tuple[OneSided, OneSided]
    r: Any
    names: list[str]

    def time(self, lam: Any) -> tuple[Any, Any] | None:
        """T and its error at this lam; None where these forms do not serve."""
        c, point = self.arithmetic, _DigitsPoint(lam, self.r, self.arithmetic)
        sides = sides_of(self.sides, self.r, point)
        if not sides.sure():
            return None
        time = time_of(sides, lam)
        value, error = time.value, time.error
        relative = 2 * error / value if value > 0 else c.inf
        if not relative < _MOST:
            return None
        slack = min(one.slack for one in self.sides)
        left_out = c.exp(-lam * slack) if slack < math.inf else c.zero
        wrong = with_left_out(relative / (1 - relative), left_out)
        return (value, wrong * value) if wrong < 1 else None


def scene_of(drift: Drift, r: Fraction, x: Fraction, context: Any) -> Scene | None:
    """None where A is no polynomial, or float64 doesn't tell in which order its zeros are.

    None as well for a start beside a barrier.
    """
    exact = drift.exact_coefficients()
    if exact is None or len(exact) > _MOST_DEGREE + 1:
        return None
    if not 1 / _LARGEST < max(map(abs, exact)) < _LARGEST or abs(x) > _LARGEST:
        return None
    line = Line([float(c) for c in exact], float(x), float(min(r, Fraction(2))))
    if not line.c[-1]:
        return None
    arithmetic = Digits(context)
    c = [arithmetic.number(a) for a in exact]
    pieces = pieces_of(line, c, context)
    if pieces is None:
        return None
    try:
        one = _of_pieces(c, pieces, x, r, arithmetic)
        if one.beside_a_barrier():
            return None
        return Scene(arithmetic, one.both_sides(), arithmetic.number(r), _names(one))
    except ArithmeticError:
        return None


def _of_pieces(
    c: list[Any], pieces: Pieces, x: Fraction, r: Fraction, arithmetic: Digits
) -> OrderZero:
    """The structure of one drift, all its numbers with the context's digits."""
    zero, one = arithmetic.zero, arithmetic.one
    self = OrderZero.__new__(OrderZero)
    self.arithmetic, self.count, self.c, self.degree = arithmetic, 1 + BEYOND, c, len(c) - 1
    self.a_minus, self.a_plus = poly(c, -one), poly(c, one)
    self.start, self.beyond = arithmetic.number(x), r > 1
    reach = min(arithmetic.number(r), one)
    self.edges = [-reach, min(max(self.start, -reach), reach), reach]
    self.v, self.height_size = [-a / k for k, a in enumerate(c, start=1)], zero
    met = [f for f in pieces.factors if f.coalescence is not None]
    real: list[tuple[Any, Factor | None]] = [(z.u, None) for z in pieces.zeros]
    for f in met:
        if f.coalescence and f.coalescence.members:
            half = arithmetic.sqrt(max(f.square, zero))
            real += [(f.middle - half, f), (f.middle + half, f)]
    real.sort(key=lambda pair: pair[0])
    self.lines = [u for u, _ in real]
    self.rough = [0.0] * len(real)
    self.in_float = _in_float(self)
    self.slack = pieces.slack
    self.together = []
    for key, f in enumerate(met, start=2):
        assert f.coalescence is not None
        members = tuple(k for k, (_, own) in enumerate(real) if own is f)
        side = f.coalescence.side
        pair = _local(f, side, arithmetic)
        self.together.append(self.of_pair(key, pair, f.middle, side, members, f.coalescence.pair))
    self.apart = [
        Apart(factor_pair(c, f.middle, f.square, f.psi), f.middle, zero)
        for f in pieces.factors
        if f.coalescence is None
    ]
    return self.prepared()


def _in_float(one: OrderZero) -> Builder:
    """The float64 series from which the sizes of order 1 are taken."""
    self = Builder.__new__(Builder)
    self.count, self.degree, self.rough = one.count, one.degree, one.rough
    self.c, self.lines, self.edges = (
        [float(x) for x in row] for row in (one.c, one.lines, one.edges)
    )
    self.c_size = [abs(x) for x in self.c]
    return self


def _local(factor: Factor, side: int, arithmetic: Arithmetic) -> Local:
    """The pair as `symasym.asymptotics.coalescence.cubic_map` takes it, seen to that side."""
    psi, square = seen_from(factor.psi, side), factor.square
    sign = 1 if psi[0] > 0 else -1
    psi = [sign * a for a in psi]
    mean = poly([3 * a / ((2 * k + 1) * (2 * k + 3)) for k, a in enumerate(psi[0::2])], square)
    root = arithmetic.cbrt(mean)
    level = sign * mean_of_values(psi, square)
    return Local(arithmetic.zero, square, psi, sign, square * root * root, 1 / root, level)


def _names(one: OrderZero) -> list[str]:
    """The names of the pairs and ends that are taken together."""
    names = [f"well and barrier about u = {float(p.side * p.point):.6g}" for p in one.together]
    ends = [sign for sign, barrier in one.before_end.items() if barrier is not None]
    return names + [f"barrier before u = {sign}" for sign in ends]
