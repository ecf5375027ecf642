"""The zeros of one polynomial drift by itself, to many digits: simple ones, and pairs as factors.

What is alone and what goes together is decided in float64, as for arrays
(`symasym.asymptotics.uniform.pairing_arrays`); Newton's steps then take a zero, and Bairstow's a
pair, to all digits. A pair's middle and its distance squared are analytic in the coefficients, so
that both are as exact at a fold as anywhere.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.numbers.polynomial_roots import refined, zeros_of
from symasym.numbers.polynomials import divided, poly, poly_slope, shifted
from symasym.numbers.quadratic_factor import Pair, pair_of

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

__all__ = ["Factor", "Line", "Coalescence", "Pieces", "Zero", "pieces_of", "seen_from"]

_EPS = 2.3e-16
# As in `symasym.numbers.polynomial_roots` and `symasym.asymptotics.uniform.pairing_arrays`.
_SAME, _ROUGHEST = 1e-6, 1e-10
# |A| at an edge beside its largest term, below which float64 doesn't tell on which side a zero is.
_NEAREST, _NEAREST_END = 1e-7, 1e-11
_MOST_STEPS = 12


class Line(NamedTuple):
    """A's coefficients in float64, and what of the layer is looked at."""

    c: list[float]
    start: float
    r: float

    @property
    def edges(self) -> tuple[float, float, float]:
        """-r, the start and r, each moved to the nearest point of the layer."""
        reach = min(self.r, 1.0)
        return -reach, min(max(self.start, -reach), reach), reach


@dataclass
class Zero:
    """A real zero by itself, with A's slope there."""

    rough: float
    u: Any = None
    slope: Any = None


@dataclass
class Coalescence:
    """A pair that Airy functions take, seen from the start: the turning point, side and factor."""

    point: float
    side: int
    pair: Pair
    members: tuple[int, int] | None
    above: int


@dataclass
class Factor:
    """(u - middle)² - square, and A over it in powers of u - middle; `coalescence` if it is one."""

    rough: tuple[float, float]
    coalescence: Coalescence | None
    middle: Any = None
    square: Any = None
    psi: Any = None


class Pieces(NamedTuple):
    """All of A's zeros; e^{-lam slack} is what complex pairs cost that are left out or cut."""

    zeros: list[Zero]
    factors: list[Factor]
    slack: float


def seen_from(c: list[Any], side: int) -> list[Any]:
    """Taylor coefficients of phi in the mirror for side = -1."""
    return [x * side if j % 2 == 0 else x for j, x in enumerate(c)]


def pieces_of(line: Line, exact: list[Any], context: MPContext) -> Pieces | None:
    """`exact` are A's coefficients in `context`; None where float64 doesn't tell the structure."""
    try:
        return _pieces_of(line, exact, context)
    except ArithmeticError:
        # Multiple zeros, and what overflows.
        return None


def _pieces_of(line: Line, exact: list[Any], context: MPContext) -> Pieces | None:
    """The zeros and factors to all digits; None where float64 does not tell the structure."""
    roots = _Roots.of(line)
    if roots is None:
        return None
    pairs, slack = _pairs(line, roots)
    taken = {k for m in pairs for k in m.members or ()}
    complexes = {m.above: m for m in pairs if m.members is None}
    zeros = [Zero(z) for k, z in enumerate(roots.real) if k not in taken]
    factors = []
    for k, z in enumerate(roots.above):
        factors.append(Factor((z.real, -(z.imag**2)), complexes.get(k)))
    for m in pairs:
        if m.members is not None:
            low, high = (roots.real[k] for k in m.members)
            factors.append(Factor(((low + high) / 2, (high - low) ** 2 / 4), m))
    alone: list[complex] = [complex(z.rough) for z in zeros]
    alone += [z for k, z in enumerate(roots.above) if k not in complexes]
    if any(_roughness(line.c, z, roots) > _ROUGHEST for z in alone):
        return None
    refined = all(_refine(z, exact, context) for z in zeros)
    if not (refined and all(_refine_factor(f, exact, context) for f in factors)):
        return None
    return Pieces(zeros, factors, slack)


# -- in float64 ------------------------------------------------------------------------------------


class _Roots(NamedTuple):
    """Ascending, and those above the real line."""

    real: list[float]
    above: list[complex]

    @classmethod
    def of(cls, line: Line) -> _Roots | None:
        """None where some are not found, or an edge is too near."""
        for u in line.edges:
            size = poly([abs(x) for x in line.c], abs(u))
            nearest = _NEAREST_END if abs(u) == 1 else _NEAREST
            if not abs(poly(line.c, u)) > nearest * size:
                return None
        return cls.all_of(line.c)

    @classmethod
    def all_of(cls, c: list[float]) -> _Roots | None:
        """All zeros of a polynomial; None where some were missed."""
        zeros = zeros_of(np.array(c)[:, None])
        if not zeros.complete[0]:
            return None
        real = int(zeros.real[0])
        above = [complex(row[0]) for row in zeros.pairs[: (len(c) - 1 - real) // 2]]
        return cls(zeros.values[:real, 0].tolist(), above)


def _roughness(c: list[float], z: complex, roots: _Roots) -> float:
    """The relative rounding bound of the zero z, in units of its distance to the next."""
    moved = poly([abs(x) for x in c], abs(z)) / abs(poly_slope(c, z))
    near = 1 + abs(z)
    for w in [*roots.real, *roots.above, *(w.conjugate() for w in roots.above)]:
        if w != z:
            near = min(near, abs(z - w))
    rounding: float = _EPS * (1 + moved / near)
    return rounding


def _pairs(line: Line, roots: _Roots) -> tuple[list[Coalescence], float]:
    """The pairs about turning points of A, and the least gap of complex ones left out."""
    if len(line.c) < 3:
        return [], float("inf")
    _, start, reach = line.edges
    slope = _Roots.all_of([k * x for k, x in enumerate(line.c)][1:])
    if slope is None:
        raise OverflowError
    turning = slope.real
    pairs, slack = [], float("inf")
    for point in turning:
        if not (abs(point) < reach and point != start):
            continue
        coalescence = _coalescence(line, roots, point, turning)
        if coalescence is None:
            continue
        if coalescence.pair.zeta < 0:
            room, fall = _room(line, coalescence), 4 / 3 * (-coalescence.pair.zeta) ** 1.5
            slack = min(slack, max(room, fall))
            if fall > room:
                continue
        pairs.append(coalescence)
    # Each real zero goes with the neighbour that it meets first.
    chosen: list[Coalescence] = []
    for m in sorted(pairs, key=lambda m: abs(m.pair.zeta)):
        if all(not set(m.members or ()) & set(other.members or ()) for other in chosen):
            chosen.append(m)
    return chosen, slack


def _coalescence(
    line: Line, roots: _Roots, point: float, turning: list[float]
) -> Coalescence | None:
    """The pair that splits off at `point`, if its zeros are among the known ones."""
    _, start, reach = line.edges
    side = -1 if point < start else 1
    pair = pair_of(seen_from(shifted(line.c, point), side))
    if pair is None:
        return None
    middle = point + side * pair.middle
    low_end, high_end = (start, 1.0) if side > 0 else (-1.0, start)
    for k, (low, high) in enumerate(pairwise(roots.real)):
        if not (low_end < low and high < high_end and max(-low, high) < line.r):
            continue
        if abs(low + high - 2 * middle) + abs((high - low) ** 2 - 4 * pair.square) < _SAME:
            return Coalescence(point, side, pair, (k, k + 1), -1)
    # A complex pair may be found from several turning points, and is the nearest one's.
    nearest = min(abs(u - middle) for u in turning)
    if abs(point - middle) > nearest * (1 + _SAME):
        return None
    for k, z in enumerate(roots.above):
        if abs(z.real - middle) + abs(z.imag**2 + pair.square) < _SAME:
            return Coalescence(point, side, pair, None, k)
    return None


def _room(line: Line, coalescence: Coalescence) -> float:
    """The change of V from a complex pair to the nearest cut of the line."""
    _, start, reach = line.edges
    v = [0.0, *(-x / (k + 1) for k, x in enumerate(line.c))]
    height = poly(v, coalescence.point) - coalescence.pair.level
    end = coalescence.side * reach
    # Beyond the layer phi is another function, and the pair none of its own.
    middle = coalescence.point + coalescence.side * coalescence.pair.middle
    if not min(start, end) < middle < max(start, end):
        return 0.0
    cuts = [start] if abs(line.start) < 1 else []
    cuts += [end] if line.r < 1 else []
    return min((abs(poly(v, u) - height) for u in cuts), default=float("inf"))


# -- to all digits ---------------------------------------------------------------------------------


def _refine(zero: Zero, c: list[Any], context: MPContext) -> bool:
    """Set the zero and the slope at it; False where Newton's steps fail."""
    zero.u = refined(c, context.mpf(zero.rough), context)
    if zero.u is None:
        return False
    zero.slope = poly_slope(c, zero.u)
    return True


def _refine_factor(factor: Factor, c: list[Any], context: MPContext) -> bool:
    """Bairstow's steps for u² + p u + q."""
    middle, square = (context.mpf(x) for x in factor.rough)
    p, q = -2 * middle, middle * middle - square
    least = context.ldexp(1, -context.prec // 2 - 8)
    for _ in range(_MOST_STEPS):
        rest, r1, r0 = divided(c, p, q)
        _, s1, s0 = divided(rest, p, q)
        det = q * s1 * s1 + s0 * (s0 - p * s1)
        if not det:
            return False
        step_p = (s1 * r0 - s0 * r1) / det
        step_q = ((p * s1 - s0) * r0 - q * s1 * r1) / det
        p, q = p - step_p, q - step_q
        if abs(step_p) + abs(step_q) <= least * (1 + abs(p) + abs(q)):
            factor.middle = -p / 2
            factor.square = p * p / 4 - q
            factor.psi = shifted(divided(c, p, q)[0], factor.middle)
            return True
    return False
