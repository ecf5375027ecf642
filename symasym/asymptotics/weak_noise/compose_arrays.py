"""T and C in weak noise for many lam at once, in float64, from sights of the two sides.

The composition is that of `symasym.asymptotics.weak_noise.answer`, with the exponents known
beforehand: every sum is a mantissa times e^{lam height} with the largest height of its terms,
so that one exponential a term is enough, and none where it would be 1 or too small to count.
Heights come first; a series is evaluated only where its weight counts.
"""

from __future__ import annotations

from functools import cached_property, partial
from typing import Any

import numpy as np

from symasym.asymptotics.weak_noise.one_sided import (
    ROUNDING,
    Local,
    Numbers,
    Part,
    Series,
    Sight,
    Spot,
    added,
)
from symasym.asymptotics.weak_noise.series import (
    MOST_ROUGH,
    Point,
    Term,
    Value,
    absolute,
    counts,
    higher,
    largest,
    lower,
    plus,
    times,
)
from symasym.base.inputs import FloatArray

# The rank of the end at r.
_END = 1 << 30
#: Rounding of lam, of a product with it, and of an exponential.
ULP = 1.2e-15
# A relative error of a value beyond which nothing is said.
_MOST = 0.4


class _View:
    """One side of the start and r: heights and pairs of places, before lam."""

    def __init__(self, one: Sight, r: Numbers) -> None:
        self.one, self.rising = one, list(one.rising)
        self.straight: Numbers = 0.0
        # Rounding of the end's height, and of every other.
        self.steep = self.rough = one.rough
        if one.beyond is not None:
            u, height, slope = one.beyond
            length = r - u
            self.straight = length / slope
            end = Series([Part(1.0, 0, [-1 / slope])], ROUNDING)
            self.rising.append(Spot(_END, height - slope * length, end, None))
            self.steep = one.rough + ULP * (abs(height) + abs(slope * length))
        self.pairs: list[tuple[Numbers, Spot, Spot, Series | Local]] = []
        taken = {(joint.falling, joint.rising) for joint in one.joint}
        for low in one.falling:
            for high in self.rising:
                if high.rank < low.rank or (low.rank, high.rank) in taken:
                    continue
                beside = high.rank == low.rank
                series = high.onward if beside else high.series
                if series is not None and not (isinstance(series, Series) and not series.parts):
                    # At one and the same place the heights are each other's negatives.
                    height = 0.0 if beside else low.height + high.height
                    self.pairs.append((height, low, high, series))
        self.scale_height = largest([p.height for p in self.rising])
        self.joint = [(j.height, j.local) for j in one.joint if j.local is not None]
        self.nested_height = largest([found[0] for found in (*self.pairs, *self.joint)])


class Views:
    """Both sides, and the start's shares of both together, which all but cancel."""

    def __init__(self, sights: tuple[Sight, Sight], r: Numbers) -> None:
        self.r = r
        self.left, self.right = (_View(one, r) for one in sights)
        self.slack = lower(sights[0].slack, sights[1].slack)
        self.corner = sights[0].corner
        self.rising = added(sights[0].rising_start, sights[1].rising_start)
        self.falling = added(sights[0].falling_start, sights[1].falling_start)
        self.low, self.high = self.left.scale_height, self.right.scale_height
        # The higher and the lower of their two heights, and the double integrals' higher one.
        self.top, self.least = higher(self.low, self.high), lower(self.low, self.high)
        self.nested = higher(self.left.nested_height, self.right.nested_height)


class _Side:
    """One side of the start; its sums are found when they are first asked for."""

    def __init__(self, view: _View, at: Point) -> None:
        self.view, self.at = view, at

    @cached_property
    def scale(self) -> Value:
        """int e^{lam V} without the start's own share, in units of e^{lam scale_height}."""
        top = self.view.scale_height
        terms = ((p.height - top, partial(self._spot, p.series, p)) for p in self.view.rising)
        return self.at.total(terms)

    @cached_property
    def nested(self) -> Value:
        """The double integral without the start's own share, in its own units."""
        top = self.view.nested_height
        terms: list[Term] = [
            (height - top, partial(self._pair, low, high, series))
            for height, low, high, series in self.view.pairs
        ]
        terms += [(h - top, partial(self.at.series, local)) for h, local in self.view.joint]
        return self.at.total([*terms, (0.0 - top, self._outer)])

    def _pair(self, low: Spot, high: Spot, series: Series | Local) -> Value:
        return self._spot(low.series, low) * self._spot(series, high)

    def _outer(self) -> Value:
        found = self.at.series(self.view.one.outer)
        if not counts(self.view.straight):
            return found
        return found._replace(value=plus(found.value, self.view.straight * self.at.x))

    def _spot(self, series: Series | Local, place: Spot) -> Value:
        view = self.view
        return self.at.series(series, view.steep if place.rank == _END else view.rough)

    @cached_property
    def rising_start(self) -> Value:
        return self.at.series(self.view.one.rising_start)

    @cached_property
    def falling_start(self) -> Value:
        return self.at.series(self.view.one.falling_start)

    @cached_property
    def share(self) -> Any:
        """With the start's own share, in units of the side's own height."""
        weight = self.at.decay(-self.view.scale_height)
        if not counts(weight):
            return self.scale.value
        return plus(self.scale.value, times(self.rising_start.value, weight))

    def rough(self) -> Any:
        """Rounding of the exponents that the errors leave out because it is too large for them."""
        steep = self.view.steep
        if isinstance(steep, float) and steep * self.at.most < MOST_ROUGH:
            return 0.0
        rough = self.at.lam * steep
        return np.where(rough < MOST_ROUGH, 0.0, rough)


class _Sides:
    """Both sides, in units of e^{lam top}, the higher of their two heights."""

    def __init__(self, views: Views, at: Point) -> None:
        self.views, self.at = views, at
        self.left, self.right = _Side(views.left, at), _Side(views.right, at)

    @cached_property
    def total(self) -> Value:
        """int e^{lam V} over both sides."""
        views = self.views
        return self.at.total(
            [
                (views.low - views.top, lambda: self.left.scale),
                (views.high - views.top, lambda: self.right.scale),
                (0.0 - views.top, lambda: self.rising),
            ]
        )

    @cached_property
    def rising(self) -> Value:
        """The start's shares of both sides together, which all but cancel."""
        return self.at.series(self.views.rising)

    @cached_property
    def falling(self) -> Value:
        return self.at.series(self.views.falling)

    @cached_property
    def behind(self) -> Any:
        """The left side's share of the total, in units of its own height."""
        return self._over_total(self.left.share)

    @cached_property
    def ahead(self) -> Any:
        return self._over_total(self.right.share)

    def _over_total(self, share: Any) -> Any:
        if not counts(share):
            return share
        return 1.0 if share is self.total.value else share / self.total.value

    def inside(self, side: _Side, share: Any) -> Value:
        """What lies in one side alone, times the chance of the other."""
        error = times(side.nested.error, absolute(share)) if self.at.errors else None
        return Value(times(side.nested.value, share), None, error)

    @cached_property
    def slopes(self) -> tuple[Any, Any]:
        """Each side's int e^{lam V} times the start's own share of int e^{-lam V}."""
        sides = self.left, self.right
        if self.views.corner:
            one, two = (times(side.share, self.falling.value) for side in sides)
        else:
            one, two = (times(side.scale.value, side.falling_start.value) for side in sides)
        return one, two

    def extra(self) -> Value:
        """What the start's own share adds to T."""
        one, two = self.slopes
        value = times(two, self.behind)
        if not self.views.corner:
            value = plus(value, times(one, self.ahead))
        if not self.at.errors:
            return Value(value, None, None)
        if self.views.corner:
            share = times(absolute(self.right.share), absolute(self.behind))
            return Value(value, None, times(share, self.falling.error))
        wrong: Any = 0.0
        for side, share in ((self.right, self.behind), (self.left, self.ahead)):
            scale = side.scale._replace(size=absolute(side.scale.value))
            cross = side.falling_start * scale
            wrong = plus(wrong, times(cross.error, absolute(share)))
        return Value(value, None, wrong)

    def transfer(self, top: Numbers) -> Any:
        """What errors of both sides' int e^{lam V}, and of the start's, make of T/e^{lam top}."""
        at, views, left, right = self.at, self.views, self.left, self.right
        # The gap between the two sides, in units of e^{lam reach}.
        reach = higher(views.nested, views.top)
        unit = at.decay(reach - views.top - top)
        each = at.decay(reach - views.top - top + views.least)
        if not (counts(unit) or counts(each)):
            return 0.0
        gap: Any = 0.0
        for side, sign in ((right, 1), (left, -1)):
            weight = at.decay(side.view.nested_height - reach)
            if counts(weight):
                gap = gap + sign * times(side.nested.value, weight)
        slopes: list[Any] = []
        for k, height in enumerate((views.low, views.high)):
            weight = at.decay(height - reach)
            slopes.append(times(self.slopes[k], weight) if counts(weight) else 0.0)
        error: Any = 0.0
        if counts(each):
            error = times(abs(times(gap + slopes[1], self.ahead)), left.scale.error)
            wrong = times(abs(times(gap - slopes[0], self.behind)), right.scale.error)
            error = times(plus(error, wrong), each)
        if counts(unit):
            wrong = times(abs(gap + slopes[1] - slopes[0]), right.rising_start.error)
            size = abs(gap) + abs(slopes[0]) + abs(slopes[1])
            error = plus(error, times(plus(wrong, times(size, self.rising.error)), unit))
        return self._over_total(error)

    def sure(self, relative: Any, rounding: Any) -> Any:
        """Of a logarithm; infinite unless the total is known to half of itself."""
        value, _, error = self.total
        known = None
        clear = np.max(error) < 0.5 * value.min()
        if not (clear and relative.min() >= 0 and relative.max() < _MOST):
            known = (error < value * 0.5) & (relative >= 0) & (relative < _MOST)
            relative = np.minimum(relative, 0.9)
        found = 1.0 - relative
        np.divide(relative, found, out=found)
        found += rounding
        found += 8 * ULP
        # A barrier and a well of one side, the other side, and the two sides' sum.
        found = plus(found, 4 * higher(self.left.rough(), self.right.rough()))
        return found if known is None else np.where(known, found, np.inf)


def escape_time(views: Views, at: Point) -> tuple[FloatArray, Any]:
    """log T, and its relative error (None without `at.errors`; infinite where nothing is sure)."""
    sides = _Sides(views, at)
    first = views.low - views.top + views.right.nested_height
    second = views.high - views.top + views.left.nested_height
    top = higher(higher(first, second), views.least)
    found = at.total(
        [
            (first - top, lambda: sides.inside(sides.right, sides.behind)),
            (second - top, lambda: sides.inside(sides.left, sides.ahead)),
            (views.least - top, sides.extra),
        ]
    )
    log = found.value * at.lam
    np.log(log, out=log)
    rise = at.lam * top if counts(top) else 0.0
    log = plus(log, rise)
    if not at.errors:
        return log, None
    relative = plus(found.error, sides.transfer(top)) / found.value
    relative *= 2
    return log, sides.sure(relative, ULP * plus(abs(log), rise))


def exit_probability(complement: bool, views: Views, at: Point) -> tuple[FloatArray, Any]:
    """log C or log(1 - C), and its relative error, as `escape_time`."""
    sides = _Sides(views, at)
    pair = (sides.left, sides.right) if complement else (sides.right, sides.left)
    part, rest = pair
    low, high = part.view.scale_height, rest.view.scale_height
    rise = at.lam * (high - low)
    log = -np.logaddexp(0.0, np.log(rest.share / part.share) + rise)
    if not at.errors:
        return log, None
    # In units of the part's own height: what is left out of the part counts by the other's share.
    below, away = at.decay(high - views.top), at.decay(-low)
    own, other = (sides.behind, sides.ahead) if complement else (sides.ahead, sides.behind)
    own, other = absolute(own), absolute(other)
    error: Any = 0.0
    rounding = abs(log)
    if counts(below):
        other = times(other, below)
        error = times(part.scale.error, other)
        error = plus(error, times(times(rest.scale.error, own), below))
        rounding = rounding + other * abs(rise)
    if counts(away):
        error = plus(error, times(plus(part.rising_start.error, sides.rising.error), away))
    return log, sides.sure(2 * error / part.share, ULP * rounding)
