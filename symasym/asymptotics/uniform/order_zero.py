"""T by the uniform formula of order 0, polynomial A, to any number of digits: closed forms alone.

What `symasym.asymptotics.uniform.pairing_arrays` and `.local_double` do for arrays, for one drift:
zeros to all digits (`symasym.numbers.factors`), differences of the potential, Airy functions and
Dawson's integral. As there, nothing is subtracted that is singular at a coalescence, and the error
is the size of order 1 of each part, found in float64.
"""

from __future__ import annotations

import cmath
import math
from fractions import Fraction
from typing import Any, NamedTuple

from symasym.asymptotics.coalescence.cubic_map import map_coefficients
from symasym.asymptotics.uniform.order_zero_sums import Edge, Fold, Place, View, side_at, tail
from symasym.asymptotics.weak_noise.compose import Sides, time_of
from symasym.asymptotics.weak_noise.series import Value as Pair
from symasym.base.contexts import mpf_of
from symasym.drift.drift import Drift
from symasym.numbers.factors import Factor, Line, Meeting, Pieces, Zero, pieces_of, seen_from
from symasym.numbers.quadratic_factor import Pair as Local
from symasym.numbers.quadratic_factor import mean_of_values, poly, shifted

__all__ = ["Scene", "scene_of"]

_MOST_DEGREE = 12
# As in `symasym.asymptotics.uniform.local_arrays`, `.local_numbers` and `.place_sums`.
_FACTOR, _FADE, _APART = 5, 8, 0.03
# Coefficients beyond these are left to the general path, so that float64 has their powers.
_LARGEST = 1e20
# lam times the height from an end to a well next to it below which its Gaussian is cut off there.
_CUT_OFF = 60


class Scene(NamedTuple):
    """A drift, start and radius, ready for any lam."""

    context: Any
    sides: list[View]
    slack: float
    names: list[str]
    # Of a start at u = -1 or 1, where its two sides' next terms do not cancel.
    kink: tuple[float, float]
    # How far V is from the ends to wells next to them (see `_CUT_OFF`).
    apart: Any

    def time(self, lam: Any) -> tuple[Any, Any] | None:
        """T and its error at this lam; None where these forms do not serve."""
        c = self.context
        if lam * self.apart < _CUT_OFF:
            return None
        left, right = (side_at(side, lam, c) for side in self.sides)
        near, far = self.kink
        start = Pair(c.zero, tail(near / lam**2, far / lam**3))
        sides = Sides(left, right, start, start, True)
        if not sides.sure():
            return None
        found = time_of(sides, lam)
        if not found.value > 0:
            return None
        wrong = 2 * _FACTOR * found.error
        if self.slack < math.inf:
            # What the start or an end cuts off a complex pair.
            wrong += 20 * c.exp(-lam * self.slack) * found.value
        return (found.value, wrong) if wrong < found.value else None


def scene_of(drift: Drift, r: Fraction, x: Fraction, context: Any) -> Scene | None:
    """None where A is no polynomial, or float64 doesn't tell in which order its zeros are."""
    exact = drift.exact_coefficients()
    if exact is None or len(exact) > _MOST_DEGREE + 1:
        return None
    if not 1 / _LARGEST < max(map(abs, exact)) < _LARGEST or abs(x) > _LARGEST:
        return None
    line = Line([float(c) for c in exact], float(x), float(min(r, Fraction(2))))
    if not line.c[-1]:
        return None
    c = [mpf_of(a, context) for a in exact]
    pieces = pieces_of(line, c, context)
    if pieces is None:
        return None
    whole = _Whole(line, c, pieces, x, r, context)
    try:
        sides = [whole.side(side) for side in (-1, 1)]
        kink = whole.next_terms(whole.middle) if abs(x) == 1 else (0.0, 0.0)
    except ArithmeticError:
        return None
    return Scene(context, sides, pieces.slack, whole.names, kink, whole.apart())


class _Whole:
    """Both sides of the start."""

    def __init__(
        self, line: Line, c: list[Any], pieces: Pieces, x: Fraction, r: Fraction, context: Any
    ) -> None:
        self.line, self.c, self.pieces, self.context = line, c, pieces, context
        self.v = [-a / (k + 1) for k, a in enumerate(c)]
        self.x = mpf_of(x, context)
        self.r = mpf_of(r, context)
        self.reach = min(self.r, context.one)
        self.middle = min(max(self.x, -self.reach), self.reach)
        self.base = self.potential(self.middle)
        if abs(self.x) > 1:
            # A height of the straight part.
            self.base += (self.middle - self.x) * poly(c, self.middle)
        self.names: list[str] = []

    def potential(self, u: Any) -> Any:
        return poly(self.v, u) * u

    def apart(self) -> Any:
        """The height from an end to a well next to it; 0 where the start lies at a barrier's side.

        There, and between a well and a barrier, the start cuts off a Gaussian, which only the
        general path takes into account. Before a well it makes no such difference.
        """
        zeros = sorted(u for u in self.real() if -self.reach < u < self.reach)
        if abs(self.x) <= 1:
            below = [u for u in zeros if u <= self.x]
            above = zeros[len(below) :]
            climbs = any(self.potential(u) > self.base for u in (*below[-1:], *above[:1]))
            if climbs or (below and above):
                return self.context.zero
        found = [self.context.inf]
        for end, last in ((-self.reach, zeros[:1]), (self.reach, zeros[-1:])):
            falls = (self.potential(end) - self.potential(u) for u in last)
            found += [fall for fall in falls if fall > 0]
        return min(found)

    def real(self) -> list[Any]:
        """Every real zero."""
        found = [zero.u for zero in self.pieces.zeros]
        for factor in self.pieces.factors:
            if factor.square >= 0:
                root = self.context.sqrt(factor.square)
                found += [factor.middle - root, factor.middle + root]
        return found

    def side(self, sign: int) -> View:
        """What lies right of the start, or, in the mirror, left of it."""
        end = sign * self.reach
        x, at = sign * self.x, self.middle
        phi, slope = sign * poly(self.c, at), sign * poly(self.c, end)
        if x >= 1:
            zero = self.context.zero
            return View((1 / phi, 0, 0), [], (zero, 0), None, zero, phi, self.r - x)
        places: list[Any] = []
        outer, order_one = self.outer(sign, end), 0.5 / float(phi) ** 2
        straight = x < -1
        if straight:
            h = self.next_terms(at)
            outer += (-1 - x) / phi
            places.append(Place("kink", self.potential(at) - self.base, 1 / phi, *h))
        start = 1 / phi, *((0, 0) if straight else self.next_terms(at))
        places += self.places(sign)
        height = self.potential(end) - self.base
        last: Any = self.edge(sign, height)
        if last is None:
            order_one += 0.5 / float(slope) ** 2
            last = Place("end", height, 1 / slope, *self.next_terms(end))
        length = max(self.r - 1, self.context.zero)
        return View(start, places, (outer, order_one), last, height, slope, length)

    def next_terms(self, u: Any) -> tuple[float, float]:
        """|h_2| and |h_3|, the next terms of the series of a start, a kink or an end."""
        t = shifted(self.line.c, float(u))[:3] + [0.0, 0.0]
        phi, slope, bend = t[0], t[1], 2 * t[2]
        return abs(slope / phi**3), abs((3 * slope**2 - phi * bend) / phi**5)

    # -- wells, barriers and pairs --------------------------------------------------------------

    def places(self, sign: int) -> list[Any]:
        """Those of one side, from the start on."""
        found: list[tuple[Any, Any]] = []
        for zero in self.pieces.zeros:
            if self.inside(zero.u, sign):
                found.append((sign * zero.u, self.place(zero)))
        for factor in self.pieces.factors:
            if factor.meeting is not None and factor.meeting.side == sign:
                found.append((sign * factor.middle, self.fold(factor, factor.meeting, sign)))
        return [place for _, place in sorted(found, key=lambda pair: pair[0])]

    def inside(self, u: Any, sign: int) -> bool:
        inside = self.middle < u < self.reach if sign > 0 else -self.reach < u < self.middle
        return bool(inside)

    def place(self, zero: Zero) -> Place:
        c = self.context
        weight = c.sqrt(2 * c.pi / abs(zero.slope))
        kind = "barrier" if zero.slope > 0 else "well"
        return Place(kind, self.potential(zero.u) - self.base, weight, *self.ratios(zero.u))

    def ratios(self, u: Any) -> tuple[float, float]:
        """The next two terms of Laplace's series at this zero, over the first."""
        t = shifted(self.line.c, float(u))
        found = []
        for n in (1, 2):
            p, power = 2 * n + 1, [1.0]
            for m in range(1, 2 * n + 1):
                total = 0.0
                for j in range(1, min(m, len(t) - 2) + 1):
                    alpha = 2 * t[j + 1] / ((j + 2) * t[1])
                    total += (p * j + 2 * (m - j)) * alpha * power[m - j]
                power.append(-total / (2 * m))
            scale: float = math.gamma(n + 0.5) / math.gamma(0.5) * (abs(t[1]) / 2) ** -n
            found.append(abs(power[-1] * scale))
        return found[0], found[1]

    def fold(self, factor: Factor, meeting: Meeting, sign: int) -> Fold:
        c, pair = self.context, _local(factor, sign, self.context)
        ((a, b),) = map_coefficients(pair, 1, c, None)
        onward = bool(pair.sign > 0)
        if not onward:
            a, b = -a, -b
        psi = [pair.sign * x for x in pair.psi]
        height = self.potential(factor.middle) - mean_of_values(psi, factor.square) - self.base
        self.names.append(f"well and barrier about u = {meeting.point:.6g}")
        return Fold(height, pair.zeta, a, b, *_next_terms(meeting.pair), onward)

    # -- the end ---------------------------------------------------------------------------------

    def edge(self, sign: int, height: Any) -> Edge | None:
        """The barrier next to the end, if there is one."""
        real = [z for z in self.pieces.zeros if self.inside(z.u, sign)]
        pairs = [
            f
            for f in self.pieces.factors
            if f.meeting and f.meeting.side == sign and f.meeting.members
        ]
        ends = [sign * z.u for z in real] + [sign * f.middle for f in pairs]
        if not ends:
            return None
        c, last = self.context, max(range(len(ends)), key=ends.__getitem__)
        drop: Any = None
        ratio = 0.0
        if last < len(real):
            place, zero = ends[last], real[last]
            if zero.slope < 0:
                return None
            drop = self.drop(sign, zero, real, pairs)
            ratio = self.ratios(zero.u)[0]
        else:
            pair = _local(pairs[last - len(real)], sign, c)
            if pair.sign < 0:
                return None
            place = ends[last] + c.sqrt(max(pair.square, c.zero))
            drop = c.mpf(4) / 3 * max(pair.zeta, c.zero) ** c.mpf(1.5)
            if drop > 1e-20:
                ratio = self.ratios(sign * place)[0]
        psi, gap = shifted(seen_from(self.c, sign), place)[1:], self.reach - place
        self.names.append(f"barrier before u = {sign}")
        return _edge(psi, gap, drop, ratio, height, c)

    def drop(self, sign: int, zero: Zero, real: list[Zero], pairs: list[Factor]) -> Any:
        """V from the barrier `zero` down to the real zero before it, None if there is none."""
        c = self.context
        before = [z.u for z in real if z is not zero]
        for f in pairs:
            root = c.sqrt(max(f.square, c.zero))
            before += [f.middle - root, f.middle + root]
        if not before:
            return None
        nearest = max(before, key=lambda u: sign * u)
        return self.potential(zero.u) - self.potential(nearest)

    # -- the outer part --------------------------------------------------------------------------

    def outer(self, sign: int, end: Any) -> Any:
        """The integral of 1/phi from the start, past all pairs, real part."""
        c, total = self.context, self.context.zero
        if len(self.c) == 1:
            return (end - self.middle) / self.c[0]
        for zero in self.pieces.zeros:
            ratio = (end - zero.u) / (self.middle - zero.u)
            total += c.log(abs(ratio)) / zero.slope
        for factor in self.pieces.factors:
            total += self.share(factor, sign, end)
        return total

    def share(self, factor: Factor, sign: int, end: Any) -> Any:
        c, square = self.context, factor.square
        even, odd = poly(factor.psi[0::2], square), poly(factor.psi[1::2], square)
        norm = even * even - odd * odd * square
        ends = [u - factor.middle for u in (end, self.middle)]
        far, near = (y * y - square for y in ends)
        total = -odd / norm * c.log(abs(far / near)) / 2
        turns = [_turn(square, y, c) for y in ends]
        met = factor.meeting is not None and factor.meeting.side == sign
        if square < 0 and not met and (ends[0] > 0) != (ends[1] > 0):
            # Below the pair, along the real line.
            turns[0] -= c.sign(ends[0]) * c.pi / c.sqrt(-square)
        return total - even / norm * (turns[0] - turns[1])


def _turn(square: Any, y: Any, c: Any) -> Any:
    """artanh(root/y)/root, root² = square, and atan for square < 0."""
    ratio = square / (y * y)
    if abs(ratio) < 1e-6:
        power, total, k = c.one, c.zero, 1
        while abs(power) > c.eps:
            total += power / k
            power, k = power * ratio, k + 2
        return total / y
    root = c.sqrt(abs(square))
    if square < 0:
        return c.atan(root / y) / root
    return c.log(abs((y + root) / (y - root))) / (2 * root)


def _local(factor: Factor, sign: int, context: Any) -> Local:
    """The pair as `symasym.asymptotics.coalescence.cubic_map` takes it, seen to that side."""
    psi, square = seen_from(factor.psi, sign), factor.square
    way = 1 if psi[0] > 0 else -1
    psi = [way * x for x in psi]
    mean = poly([3 * x / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(psi[0::2])], square)
    root = context.cbrt(mean)
    zero = context.zero
    return Local(zero, square, psi, way, square * root * root, 1 / root, zero)


def _next_terms(pair: Local) -> tuple[float, float]:
    """Sizes of a_1 and b_1, from the series at both zeros (`local_numbers`)."""
    square = pair.square if abs(pair.square) > _APART**2 else _APART**2
    mean = poly([3 * x / ((2 * k + 1) * (2 * k + 3)) for k, x in enumerate(pair.psi[0::2])], square)
    if not mean > 0:
        raise OverflowError
    half, root = cmath.sqrt(square), cmath.sqrt(square) * mean ** (1 / 3)
    w = [_series_at(pair.psi, way * half, way * root) for way in (1, -1)]
    b = (w[0][0] - w[1][0]) / (2 * root)
    one, two = (
        3 * w3 / (2 * way * root) - (2 * w2 - b) / (4 * root * root)
        for way, (_, w2, w3) in zip((1, -1), w, strict=True)
    )
    return abs((one + two).real) / 2, abs(((one - two) / (2 * root)).real)


def _series_at(psi: list[float], y: complex, s: complex) -> tuple[complex, complex, complex]:
    """u(s) about a zero: the first three coefficients."""
    c: list[Any] = [*shifted(psi, y), 0, 0]
    f1, f2, f3 = 2 * y * c[0], c[0] + 2 * y * c[1], c[1] + 2 * y * c[2]
    w1 = cmath.sqrt(2 * s / f1)
    w2 = (1 / 3 - f2 * w1**3 / 3) / (f1 * w1)
    w3 = -(f1 * w2**2 / 2 + f2 * w1**2 * w2 + f3 * w1**4 / 4) / (f1 * w1)
    return w1, w2, w3


def _edge(psi: list[Any], gap: Any, drop: Any, ratio: float, height: Any, c: Any) -> Edge:
    """phi = x psi(x) from the barrier on (`local_numbers.edge_of`), `drop` above the last well."""

    def area(x: Any) -> Any:
        return poly([a / (k + 2) for k, a in enumerate(psi)], x)

    keep: Any = c.zero
    keep_next = 0.0
    fall = gap * gap * area(gap)
    t = c.sqrt(2 * fall)
    if drop is not None:
        # As the well comes near the barrier, its own series breaks down, and is faded out.
        rho = _FADE * drop / fall
        keep = (1 + rho) * c.exp(-rho)
        small = float(min(rho, c.mpf(700)))
        keep_next = float(keep) + small**2 / 2 * math.exp(-small)
    end = poly(psi, gap)
    whole = 1 / c.sqrt(psi[0]) if keep < 1 and psi[0] > 0 else c.zero
    peak = whole * (1 - keep)
    # 1/phi there less peak/t, without its cancellation.
    if keep > 0.5:
        rest = 1 / (gap * end) - peak / t
    else:
        mean = c.sqrt(2 * area(gap) * psi[0])
        first = poly([2 * a / (k + 3) for k, a in enumerate(psi[1:])], gap)
        second = poly(psi[1:], gap)
        rest = first * psi[0] - 2 * psi[0] * second - gap * second**2
        rest = rest / (end * mean * (end + mean)) + whole / t * keep
    # Order 1 hardly depends on where the end is, close to the barrier.
    far = max(gap, c.mpf(_APART))
    if not area(far) > 0:
        # A zero just beyond the end: the general path tells its error.
        raise OverflowError
    value, t_far = float(far * poly(psi, far)), float(far * c.sqrt(2 * area(far)))
    bend = float(poly([(k + 1) * a for k, a in enumerate(psi)], far))
    left = ratio * (1 - keep_next)
    next_rest = -bend / value**3 - float(whole) * left / t_far + float(peak) / t_far**3
    return Edge(height, t, peak, rest, abs(left), abs(next_rest))
