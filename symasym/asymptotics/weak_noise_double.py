"""T and C in weak noise for many lam at once, in float64, from sights of the two sides.

The composition is that of `symasym.asymptotics.weak_noise`, with the exponents known
beforehand: every sum is a mantissa times e^{lam height} with the largest height of its terms,
so that one exponential a term is enough, and none where it would be 1 or too small to count.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.places import BEYOND
from symasym.asymptotics.sights import Local, Numbers, Part, Series, Sight, Spot
from symasym.inputs import FloatArray

_MOST_FALL = 0.75
# Beyond this, with lam^2 for what the powers of lam make up, a term is below 1e-17 of the rest
# even if its coefficients are 1e9 times larger.
_FAINT = 60.0
# The rank of the end at r.
_END = 1 << 30
#: Rounding of lam, of a product with it, and of an exponential.
ULP = 1.2e-15
# A relative error of a value beyond which nothing is said.
_MOST = 0.4
# Rounding of exponents beyond which it is a logarithm's, whatever the weight of its terms.
_MOST_ROUGH = 0.1


class _Sum(NamedTuple):
    """(value, error) times e^{lam height}; the error is None where it is not asked for."""

    height: Numbers
    value: Any
    error: Any


class _Side(NamedTuple):
    scale: _Sum
    nested: _Sum
    rising: tuple[Any, Any]
    falling: tuple[Any, Any]
    # Rounding of the exponents that the errors leave out because it is too large for them.
    rough: Any


class Point:
    """Powers and exponentials of one array of lam, and what has been found at it."""

    def __init__(self, lam: FloatArray, order: int, errors: bool) -> None:
        self.lam, self.order, self.errors = lam, order, errors
        self.x = 1.0 / lam
        self.least = float(lam.min())
        self.faint = -_FAINT - 2 * abs(float(np.log(lam.max()))) - 2 * abs(np.log(self.least))
        self._powers: dict[float, FloatArray] = {1.0: self.x}
        self._logs: FloatArray | None = None

    def power(self, offset: float) -> FloatArray:
        """lam^-offset."""
        found = self._powers.get(offset)
        if found is None:
            root = np.sqrt(self.x)
            whole = int(offset)
            found = root if offset != whole else np.ones_like(root)
            for _ in range(whole):
                found = found * self.x
            self._powers[offset] = found
        return found

    @property
    def logs(self) -> FloatArray:
        if self._logs is None:
            self._logs = np.log(self.lam)
        return self._logs

    def decay(self, gap: Numbers) -> Any:
        """e^{lam gap} for gap <= 0; plainly 1 where gap is 0, and 0 where nothing is left."""
        if np.ndim(gap) == 0 or gap.size == 1:
            one = float(np.ravel(gap)[0])
            if one == 0:
                return 1.0
            return np.exp(self.lam * one) if one * self.least > self.faint else 0.0
        if not gap.any():
            return 1.0
        exponent = self.lam * gap
        return np.exp(exponent) if exponent.max() > self.faint else 0.0

    # -- series ------------------------------------------------------------------------------

    def series(self, series: Series | Local) -> tuple[Any, Any]:
        """The first order + 1 terms, and the size of the following, with rounding."""
        if not isinstance(series, Series):
            return series.at(self)
        value: Any = 0.0
        near: Any = 0.0
        far: Any = 0.0
        for part in series.parts:
            value = value + self._front(part, self._horner(part.coefficients[: self.order + 1]))
            if self.errors:
                near = near + self._term(part, self.order + 1)
                far = far + self._term(part, self.order + BEYOND)
        if not self.errors:
            return value, None
        near, far = np.abs(near), np.abs(far)
        error: Any = 0.0
        if np.any(near) or np.any(far):
            safe = np.where(near > 0, near, 1.0)
            ratio = np.where(near > 0, np.minimum(far / safe, _MOST_FALL), _MOST_FALL)
            error = (near + far) / (1 - ratio)
        if series.size is not None:
            part = series.parts[0] if series.parts else Part(1.0, 0, [])
            size = self._front(part, self._horner(series.size[: self.order + 1]))
            error = error + series.rounding * size
        elif np.any(series.rounding):
            error = error + series.rounding * np.abs(value)
        return value, error

    def _front(self, part: Part, value: Any) -> Any:
        value = value * self.power(part.offset)
        return value * self.logs**part.logs if part.logs else value

    def _horner(self, coefficients: list[Numbers]) -> Any:
        if not coefficients:
            return 0.0
        total = coefficients[-1]
        if len(coefficients) > 1:
            total = total * self.x
            for c in coefficients[-2:0:-1]:
                total += c
                total *= self.x
            total += coefficients[0]
        return total

    def _term(self, part: Part, n: int) -> Any:
        if n >= len(part.coefficients):
            return 0.0
        return self._front(part, part.coefficients[n] * self.power(float(n)))


def _both(a: tuple[Any, Any], b: tuple[Any, Any], errors: bool) -> tuple[Any, Any]:
    """A product of two series."""
    if not errors:
        return a[0] * b[0], None
    cross = a[1] * (np.abs(b[0]) + b[1]) + np.abs(a[0]) * b[1]
    return a[0] * b[0], cross


def _largest(heights: list[Numbers]) -> Numbers:
    """The largest; 0 is always among them."""
    top: Numbers = 0.0
    for height in heights:
        top = np.maximum(top, height)
    return top


def _summed(terms: list[tuple[Numbers, Any]], at: Point) -> _Sum:
    """Terms (height, how to find it), with 0 among the heights."""
    top = _largest([height for height, _ in terms])
    value: Any = 0.0
    error: Any = 0.0
    for height, find in terms:
        weight = at.decay(height - top)
        if isinstance(weight, float) and weight == 0:
            continue
        found, wrong = find()
        whole = isinstance(weight, float)
        value = value + (found if whole else found * weight)
        if at.errors:
            error = error + (wrong if whole else wrong * weight)
    return _Sum(top, value, error)


def _side(one: Sight, r: Numbers, at: Point) -> _Side:
    known: dict[int, tuple[Any, Any]] = {}

    def found(series: Series | Local) -> tuple[Any, Any]:
        if id(series) not in known:
            known[id(series)] = at.series(series)
        return known[id(series)]

    def spot(series: Series | Local, place: Spot) -> tuple[Any, Any]:
        value, error = found(series)
        if at.errors:
            rounding = at.lam * (one.rough + steep if place.rank == _END else one.rough)
            error = error + np.where(rounding < _MOST_ROUGH, rounding, 0.0) * np.abs(value)
        return value, error

    rising = list(one.rising)
    length: Numbers = 0.0
    steep: Numbers = 0.0
    if one.beyond is not None:
        u, height, slope = one.beyond
        length = r - u
        end = Series([Part(1.0, 0, [-1 / slope])])
        rising.append(Spot(_END, height - slope * length, end, None))
        steep = ULP * (np.abs(height) + np.abs(slope * length))
    scale = [(p.height, lambda p=p: spot(p.series, p)) for p in rising]
    nested: list[tuple[Numbers, Any]] = []
    taken = {(joint.falling, joint.rising) for joint in one.joint}
    for low in one.falling:
        for high in rising:
            if high.rank < low.rank or (low.rank, high.rank) in taken:
                continue
            beside = high.rank == low.rank
            series = high.onward if beside else high.series
            if series is None or (isinstance(series, Series) and not series.parts):
                continue
            nested.append(
                (
                    # At one and the same place the heights are each other's negatives.
                    0.0 if beside else low.height + high.height,
                    lambda s=series, p=low, q=high: _both(spot(p.series, p), spot(s, q), at.errors),
                )
            )

    for joint in one.joint:
        if joint.local is not None:
            nested.append((joint.height, lambda s=joint.local: found(s)))

    def outer() -> tuple[Any, Any]:
        value, error = found(one.outer)
        if one.beyond is not None:
            value = value + (length / one.beyond[2]) * at.x
        return value, error

    nested.append((0.0, outer))
    rough = at.lam * (one.rough + steep)
    return _Side(
        _summed(scale, at),
        _summed(nested, at),
        found(one.rising_start),
        found(one.falling_start),
        np.where(rough < _MOST_ROUGH, 0.0, rough),
    )


class _Sides(NamedTuple):
    """Both sides; `behind`, `ahead` and their sum with the start's shares, and heights."""

    left: _Side
    right: _Side
    rising: Any
    falling: tuple[Any, Any]
    corner: bool
    shares: tuple[Any, Any]
    total: _Sum
    # How far the two scales, and the start, are below the total.
    weights: tuple[Any, Any, Any]


def _sides(
    sights: tuple[Sight, Sight], starts: tuple[Series, Series], r: Numbers, at: Point
) -> _Sides:
    left, right = (_side(one, r, at) for one in sights)
    rising, falling = (at.series(series) for series in starts)
    heights = [side.scale.height for side in (left, right)]
    top = np.maximum(*heights)
    weights = [at.decay(h - top) for h in (*heights, 0.0)]
    # Each side with the start's own share, in units of its own height.
    shares = [
        side.scale.value + side.rising[0] * at.decay(-side.scale.height) for side in (left, right)
    ]
    total = left.scale.value * weights[0] + right.scale.value * weights[1] + rising[0] * weights[2]
    error = None
    if at.errors:
        error = left.scale.error * weights[0] + right.scale.error * weights[1]
        error = error + rising[1] * weights[2]
    return _Sides(
        left,
        right,
        rising[1],
        falling,
        sights[0].corner,
        (shares[0], shares[1]),
        _Sum(top, total, error),
        (weights[0], weights[1], weights[2]),
    )


def escape_time(
    sights: tuple[Sight, Sight], starts: tuple[Series, Series], r: Numbers, at: Point
) -> tuple[FloatArray, Any]:
    """log T, and its relative error (None without `at.errors`; infinite where nothing is sure)."""
    sides = _sides(sights, starts, r, at)
    left, right, total = sides.left, sides.right, sides.total
    behind, ahead = sides.shares
    low, high = left.scale.height, right.scale.height
    common = np.minimum(low, high)
    ways = (
        low - total.height + right.nested.height,
        high - total.height + left.nested.height,
        common,
    )
    top = np.maximum(np.maximum(ways[0], ways[1]), ways[2])
    first, second, third = (at.decay(way - top) for way in ways)
    one = right.falling[0] * right.scale.value
    two = left.falling[0] * left.scale.value
    extra = behind * ahead * sides.falling[0] if sides.corner else behind * one + ahead * two
    value = behind * right.nested.value * first + ahead * left.nested.value * second + extra * third
    log = np.log(value / total.value) + at.lam * top + np.log(at.lam)
    if not at.errors:
        return log, None
    if sides.corner:
        wrong = np.abs(behind * ahead) * sides.falling[1]
        slopes = behind * sides.falling[0], ahead * sides.falling[0]
    else:
        wrong = np.abs(behind) * _both(right.falling, right.scale[1:], True)[1]
        wrong = wrong + np.abs(ahead) * _both(left.falling, left.scale[1:], True)[1]
        slopes = two, one
    error = np.abs(behind) * right.nested.error * first
    error = error + np.abs(ahead) * left.nested.error * second + wrong * third
    # The gap between the two sides, in units of e^{lam reach}.
    reach = np.maximum(np.maximum(right.nested.height, left.nested.height), np.maximum(low, high))
    gap = right.nested.value * at.decay(right.nested.height - reach)
    gap = gap - left.nested.value * at.decay(left.nested.height - reach)
    slope = [s * at.decay(h - reach) for s, h in zip(slopes, (low, high), strict=True)]
    unit = at.decay(reach - total.height - top + common)
    each = np.abs(ahead * (gap + slope[1])) * left.scale.error
    each = each + np.abs(behind * (gap - slope[0])) * right.scale.error
    error = error + each / total.value * unit
    unit = at.decay(reach - total.height - top)
    error = error + right.rising[1] * np.abs(gap + slope[1] - slope[0]) * unit
    gap = np.abs(gap) + np.abs(slope[0]) + np.abs(slope[1])
    error = error + sides.rising * gap * unit
    return log, _sure(sides, 2 * error / value, ULP * (np.abs(at.lam * top) + np.abs(log)))


def exit_probability(
    complement: bool,
    sights: tuple[Sight, Sight],
    starts: tuple[Series, Series],
    r: Numbers,
    at: Point,
) -> tuple[FloatArray, Any]:
    """log C or log(1 - C), and its relative error, as `escape_time`."""
    sides = _sides(sights, starts, r, at)
    chosen = 0 if complement else 1
    pair = sides.left, sides.right
    part, rest = pair[chosen], pair[1 - chosen]
    share, other = sides.shares[chosen], sides.shares[1 - chosen]
    rise = at.lam * (rest.scale.height - part.scale.height)
    log = -np.logaddexp(0.0, np.log(other / share) + rise)
    if not at.errors:
        return log, None
    below, total = sides.weights[1 - chosen], sides.total.value
    # In units of the part's own height: what is left out of the part counts by the other's share.
    error = other / total * below * part.scale.error + share / total * below * rest.scale.error
    away = at.decay(-part.scale.height)
    error = error + (part.rising[1] + sides.rising) * away
    rounding = ULP * (other / total * below * np.abs(rise) + np.abs(log))
    return log, _sure(sides, 2 * error / share, rounding)


def _sure(sides: _Sides, relative: Any, rounding: Any) -> Any:
    """Of a logarithm; infinite unless the total is known to half of itself."""
    sure = (sides.total.error < sides.total.value * 0.5) & (relative >= 0) & (relative < _MOST)
    found = relative / (1 - np.minimum(relative, 0.9)) + 8 * ULP + rounding
    # A barrier and a well of one side, the other side, and the two sides' sum.
    found = found + 4 * np.maximum(sides.left.rough, sides.right.rough)
    return np.where(sure, found, np.inf)
