"""T, C and 1 - P from one-sided expansions: sums of e^{lam height} times series, composed.

With S the integral of e^{lam V} over one side of the start and D that of
e^{lam (V(v) - V(u))} over u < v there (both without what the start itself contributes),

    T = lam (L D_R + R D_L + M)/(L + R),     C = R/(L + R),

where L, R are S with the start's own contribution and M is that of the start to D
(`mean_time`). S is a sum over critical points of e^{lam V}, D one over pairs of them, and of the
regular part.

The same composition runs on numbers and on formal sums of exponentials (`ExponentialSums`). On
numbers it builds an expression (`Node`) whose heights, exponents over lam, are known before lam is:
a sum is a mantissa times e^{lam height} with the largest height of its terms, so that one
exponential a term is enough, and none where it would be 1 or too small to count; a series is
evaluated only where its weight counts.

What is composed is evaluated at lam, with digits or in float64 (`escape_time` and its kin). The
stated error is twice the truncation error that is carried through T and C, and is sure only where
int e^{lam V} is known to half of itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial, reduce
from operator import add
from typing import Any, NamedTuple, Protocol

import numpy as np

from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import (
    MOST_ROUNDING,
    ROUNDING,
    Local,
    Numbers,
    Part,
    Point,
    Series,
    Value,
    added,
    counts,
    higher,
    lower,
    nonzero,
    plus,
    terms,
    times,
)
from symasym.base.inputs import FloatArray
from symasym.generated.formulas import on_the_right, share_of_side, time_of_doubles

#: Rounding of lam, of a product with it, and of an exponential.
ULP = 1.2e-15
# A relative error of a value beyond which nothing is said.
_MOST = 0.4
# The rank of the end at r.
_END = 1 << 30


# -- expressions on numbers ------------------------------------------------------------------------


class Node:
    """An expression with a height: its value at lam is in units of e^{lam height}."""

    height: Numbers = 0.0

    def evaluated(self, at: Point) -> Value:
        """The value at lam, in units of e^{lam height}."""
        raise NotImplementedError

    def __add__(self, other: Node) -> Node:
        return Sum([self, other])

    def __sub__(self, other: Node) -> Node:
        return Sum([self, -other])

    def __mul__(self, other: Node) -> Node:
        return _Product(self, other)

    def __truediv__(self, other: Node) -> Node:
        return _Share(self, other)

    def __neg__(self) -> Node:
        return _Changed(self, Value.__neg__)

    def __abs__(self) -> Node:
        return _Changed(self, Value.__abs__)

    def known(self) -> Node:
        """The same without its error."""
        return _Changed(self, Value.known)

    def wrong(self) -> Node:
        """Its error as a value."""
        return _Changed(self, Value.wrong)


class Exponential(Node):
    """e^{lam height} times a series; `rounding` is the rounding of the height."""

    def __init__(self, height: Numbers, series: Series | Local, rounding: Numbers = 0.0) -> None:
        self.height, self.series, self.rounding = height, series, rounding

    def evaluated(self, at: Point) -> Value:
        return at.series(self.series, self.rounding)


class _Changed(Node):
    def __init__(self, node: Node, change: Callable[[Value], Value]) -> None:
        self.node, self.change, self.height = node, change, node.height
        self._shares: dict[int, _Share] = {}

    def __truediv__(self, other: Node) -> Node:
        # Divided once, however often it is asked for.
        return self._shares.setdefault(id(other), _Share(self, other))

    def evaluated(self, at: Point) -> Value:
        return self.change(at.value_of(self.node))


class _Product(Node):
    def __init__(self, a: Node, b: Node, height: Numbers | None = None) -> None:
        self.a, self.b = a, b
        self.height = plus(a.height, b.height) if height is None else height

    def evaluated(self, at: Point) -> Value:
        return at.value_of(self.a) * at.value_of(self.b)

    def __truediv__(self, other: Node) -> Node:
        return _Product(self.a / other, self.b)


class Sum(Node):
    """A sum in units of its largest term's exponential; the height is at least 0."""

    def __init__(self, terms: list[Node], height: Numbers | None = None) -> None:
        self.terms = terms
        if height is None:
            height = 0.0
            for term in terms:
                height = higher(height, term.height)
        self.height = height

    def evaluated(self, at: Point) -> Value:
        return at.total((t.height - self.height, partial(_value, t)) for t in self.terms)

    def __add__(self, other: Node) -> Node:
        return Sum([*self.terms, other])

    def __truediv__(self, other: Node) -> Node:
        return Sum([term / other for term in self.terms])


def _value(node: Node, at: Point) -> Value:
    """The value of a node at lam."""
    return at.value_of(node)


class _Share(Node):
    """One side's part of the total, without error."""

    def __init__(self, part: Node, total: Node) -> None:
        self.part, self.total, self.height = part, total, part.height - total.height

    def evaluated(self, at: Point) -> Value:
        part, total = at.value_of(self.part), at.value_of(self.total)
        value = part.value
        if counts(value):
            value = 1.0 if value is total.value else value / total.value
        return Value(value, None if total.error is None else 0.0)


class ExponentialSums(Protocol):
    """Sums of exponentials in some arithmetic, with +, -, * and / of their own."""

    #: Relative rounding of a coefficient.
    rounding: Any

    def number(self, x: Numbers) -> Any:
        """A number of the expansion in this arithmetic."""

    def exponential(self, height: Numbers, series: Any, rounding: Numbers = 0.0) -> Any:
        """e^{lam height} times the series."""

    def total(self, terms: list[Any]) -> Any:
        """The sum."""


class Nodes:
    """Expressions on numbers."""

    exponential, total = Exponential, Sum

    def __init__(self, rounding: Numbers = ROUNDING) -> None:
        self.rounding = rounding

    def number(self, x: Numbers) -> Any:
        return x


def _total(terms: list[Any]) -> Any:
    """The sum, of nodes as one node."""
    return Sum(terms) if isinstance(terms[0], Node) else reduce(add, terms)


# -- composition -----------------------------------------------------------------------------------


class Side(NamedTuple):
    """S and D of one side without the start's contributions, and those.

    `scale_start` and `speed_start` are those to int e^{lam V} and int e^{-lam V}.
    """

    scale: Any
    nested: Any
    scale_start: Any
    speed_start: Any


@dataclass
class Sides:
    """Both sides, and the start's contributions of both together, which all but cancel."""

    left: Side
    right: Side
    scale_start: Any
    speed_start: Any
    endpoint_product: bool

    @cached_property
    def total(self) -> Any:
        """int e^{lam V} over both sides."""
        return _total([self.left.scale, self.right.scale, self.scale_start])

    def sure(self) -> Any:
        """True where that is known to half of itself; the parts are values here."""
        return self.total.error < self.total.value * 0.5

    @cached_property
    def shares(self) -> tuple[Any, Any]:
        """int e^{lam V} over either side with the start's contribution, its error left out."""
        left, right = (_total([side.scale, side.scale_start]) for side in (self.left, self.right))
        return (left.known(), right.known()) if isinstance(left, Node | Value) else (left, right)


def scale_contributions(
    one: OneSided, r: Numbers, sums: ExponentialSums
) -> list[tuple[CriticalPoint, Any]]:
    """The critical points of e^{lam V} with what they contribute, the end beyond the layer last."""
    points = [
        (p, sums.exponential(p.height, p.series, one.height_rounding)) for p in one.scale_points
    ]
    if one.beyond is not None:
        u, height, slope = (sums.number(x) for x in one.beyond)
        fall = slope * (r - u)
        rounding = one.height_rounding
        if nonzero(rounding):
            rounding = rounding + ULP * (abs(height) + abs(fall))
        series = Series([Part(1.0, 0, [-1 / slope])], sums.rounding)
        end = CriticalPoint(_END, height - fall, series, None, "end")
        points.append((end, sums.exponential(end.height, series, rounding)))
    return points


def regular_part(one: OneSided, r: Numbers, sums: ExponentialSums) -> Any:
    """The regular part of D, in the layer and beyond it."""
    inside = sums.exponential(0.0, one.regular_part)
    if one.beyond is None:
        return inside
    u, _, slope = (sums.number(x) for x in one.beyond)
    return sums.total([inside, sums.exponential(0.0, Series([Part(1.0, 0, [(r - u) / slope])]))])


def pairs_of(
    one: OneSided, scale: list[tuple[CriticalPoint, Any]], sums: ExponentialSums
) -> Iterator[tuple[CriticalPoint, CriticalPoint, Any]]:
    """Products of each critical point of e^{-lam V} with those of e^{lam V} from it on."""
    together = {(pair.speed, pair.scale) for pair in one.coalescing}
    kinks = [p for p, _ in scale if terms(p.onward)]
    onward = {p.rank: sums.exponential(p.height, p.onward, one.height_rounding) for p in kinks}
    for low in one.speed_points:
        own = sums.exponential(low.height, low.series, one.height_rounding)
        for high, share in scale:
            if high.rank == low.rank and high.rank in onward:
                beyond = onward[high.rank]
                # At one and the same point the heights are each other's negatives.
                pair = _Product(own, beyond, 0.0) if isinstance(own, Node) else own * beyond
                yield low, high, pair
            elif (
                high.rank > low.rank
                and terms(high.series)
                and (low.rank, high.rank) not in together
            ):
                yield low, high, own * share


def side_of(one: OneSided, r: Numbers, sums: ExponentialSums) -> Side:
    """One side composed, with the end at `r` where that is beyond the layer."""
    scale = scale_contributions(one, r, sums)
    nested = [pair for _, _, pair in pairs_of(one, scale, sums)]
    nested += [sums.exponential(p.height, p.local) for p in one.coalescing if p.local is not None]
    return Side(
        sums.total([share for _, share in scale]),
        sums.total([*nested, regular_part(one, r, sums)]),
        sums.exponential(0.0, one.scale_start),
        sums.exponential(0.0, one.speed_start),
    )


def sides_of(both: tuple[OneSided, OneSided], r: Numbers, sums: ExponentialSums) -> Sides:
    """Both sides composed; what the start contributes to both is added up before it is valued."""
    left, right = both
    scale = added(left.scale_start, right.scale_start)
    speed = added(left.speed_start, right.speed_start)
    return Sides(
        side_of(left, r, sums),
        side_of(right, r, sums),
        sums.exponential(0.0, scale),
        sums.exponential(0.0, speed),
        left.endpoint_product,
    )


def mean_time(sides: Sides) -> Any:
    """T/lam, with the start's own contributions taken out of S and D.

    With l, m the start's contributions to int e^{lam V} and int e^{-lam V} to the right, those to
    the left are -l and -m, so that m drops out, and l from L + R: written so, errors of the two
    series, which are large beside a zero of A, do not count where they cancel (`two-sides`).
    """
    left, right = sides.left, sides.right
    behind, ahead = sides.shares
    if sides.endpoint_product:
        together = on_the_right(ahead, right.nested, sides.speed_start)
        return time_of_doubles(behind, ahead, left.nested, together, sides.total)
    # At a barrier the regular part has the products of the start's own shares.
    below, above = (side.nested + side.speed_start * side.scale for side in (left, right))
    return time_of_doubles(behind, ahead, below, above, sides.total)


def stationary_sums(
    points: list[CriticalPoint], slopes: list[Any], sums: ExponentialSums, rounding: Numbers = 0.0
) -> tuple[Any, Any]:
    """int e^{-lam V} over |u| > 1 and over all u where phi slides, |phi| = `slopes` outside.

    The first of its critical points is the kink at u = -1, the last the one at u = 1; `rounding` is
    that of the heights.
    """
    ends = zip((points[0].height, points[-1].height), slopes, strict=True)
    outside = [
        sums.exponential(height, Series([Part(1.0, 0, [1 / slope])]), rounding)
        for height, slope in ends
    ]
    whole = [sums.exponential(p.height, p.series, rounding) for p in points]
    return sums.total(outside), sums.total(whole)


class Composed:
    """The expressions for T, C and P on numbers, before lam."""

    def __init__(
        self,
        both: tuple[OneSided, OneSided],
        r: Numbers,
        rounding: Numbers = ROUNDING,
    ) -> None:
        self.both, self.r = both, r
        self.exponential_gap = lower(both[0].exponential_gap, both[1].exponential_gap)
        self.nodes = Nodes(rounding)

    @cached_property
    def sides(self) -> Sides:
        """S, D and the start's contributions, of both sides."""
        return sides_of(self.both, self.r, self.nodes)

    @cached_property
    def stationary(self) -> tuple[Node, Node]:
        """int e^{-lam V} over |u| > 1, and over all u, from a start left of the layer."""
        right = self.both[1]
        slopes = [-one.beyond[2] for one in self.both if one.beyond is not None]
        outside, whole = stationary_sums(
            right.speed_points, slopes, self.nodes, right.height_rounding
        )
        return outside, whole

    @cached_property
    def time(self) -> tuple[Node, Node]:
        """T/lam and its error."""
        return time_and_error(self.sides)

    @cached_property
    def probabilities(self) -> tuple[_Probability, _Probability]:
        """Probabilities of leaving on the left and on the right."""
        left, right = self.sides.left, self.sides.right
        behind, ahead = self.sides.shares
        return (
            _probability(self.sides, (right, left), (ahead, behind)),
            _probability(self.sides, (left, right), (behind, ahead)),
        )

    @cached_property
    def height_rounding(self) -> list[Numbers]:
        """The rounding of either side's steepest height."""
        return [
            next((t.rounding for t in reversed(side.scale.terms)), 0.0)
            for side in (self.sides.left, self.sides.right)
        ]


def time_and_error(sides: Sides) -> tuple[Any, Any]:
    """T/lam, and its error: its own and what errors of S and of the start make of it.

    Expressions, or values at one lam, as the sides are.
    """
    left, right, total = sides.left, sides.right, sides.total
    value = mean_time(sides)
    behind, ahead = sides.shares
    if sides.endpoint_product:
        slopes = behind * sides.speed_start, ahead * sides.speed_start
    else:
        slopes = left.speed_start * left.scale, right.speed_start * right.scale
    # How T changes with S on the left, on the right, and with the start's contributions.
    gap = right.nested - left.nested
    errors = [
        value.wrong(),
        left.scale.wrong() * (abs((ahead / total) * (gap + slopes[1])) / total),
        right.scale.wrong() * (abs((behind / total) * (gap - slopes[0])) / total),
        (abs(gap + slopes[1] - slopes[0]) / total) * right.scale_start.wrong(),
        ((abs(gap) + abs(slopes[0]) + abs(slopes[1])) / total) * sides.scale_start.wrong(),
    ]
    error = Sum(errors, value.height) if isinstance(value, Node) else _total(errors)
    return value, error


class _Probability(NamedTuple):
    """One side's share of the total: its part, the other side's, and the part's error."""

    part: Node
    rest: Node
    value: Node
    other: Node
    error: Node


def _probability(sides: Sides, ordered: tuple[Side, Side], shares: tuple[Any, Any]) -> _Probability:
    """One side's share of int e^{lam V}, C on the right (eq:C), and the error of its part."""
    (part, rest), total = ordered, sides.total
    own, other = (share_of_side(share, total) for share in shares)
    errors = [
        part.scale.wrong() * abs(other),
        rest.scale.wrong() * abs(own),
        part.scale_start.wrong(),
        sides.scale_start.wrong(),
    ]
    return _Probability(*shares, own, other, Sum(errors, part.scale.height))


# -- at lam ----------------------------------------------------------------------------------------


class Evaluated(NamedTuple):
    """A quantity at lam: its logarithm, and what its error is made of.

    Attributes
    ----------
    log : number
    error : number or None
        Twice the relative truncation error.
    exponents : number
        Exponents in the logarithm, which rounding is relative to.
    total : Value
        The sum over the critical points in its denominator.
    """

    log: Numbers
    error: Numbers
    exponents: Numbers
    total: Value


def escape_time(composed: Composed, at: Point) -> Evaluated:
    """T (eq:Ttilde)."""
    value, wrong = composed.time
    mean = at.value_of(value).value
    rise = at.lam * value.height if counts(value.height) else 0.0
    log = plus(at.log(mean * at.lam), rise)
    total = at.value_of(composed.sides.total)
    if not at.errors:
        return Evaluated(log, None, None, total)
    error = 2 * (at.value_of(wrong).value / mean)
    return Evaluated(log, error, plus(abs(log), rise), total)


def exit_probability(complement: bool, composed: Composed, at: Point) -> Evaluated:
    """C or 1 - C (eq:C), right where that is tiny and where its complement is."""
    p, c = composed.probabilities[complement], at.arithmetic
    rise = at.lam * (p.rest.height - p.part.height)
    part, rest = at.value_of(p.part).value, at.value_of(p.rest).value
    odds = at.log(rest / part) + rise
    # log(1 + e^odds) without overflow.
    log = -(c.maximum(odds, c.zero) + c.log1p(at.exp(-abs(odds))))
    total = at.value_of(composed.sides.total)
    if not at.errors:
        return Evaluated(log, None, None, total)
    exponents = abs(log)
    below = at.decay(p.other.height)
    if counts(below):
        exponents = exponents + times(at.value_of(p.other).size, below) * abs(rise)
    return Evaluated(log, 2 * (at.value_of(p.error).value / part), exponents, total)


def outside_layer(composed: Composed, at: Point) -> Evaluated:
    """1 - P = int_{|u| > 1} e^{-lam V}/int e^{-lam V} (eq:P)."""
    outside, whole = composed.stationary
    total = at.value_of(whole)
    rise = at.lam * (outside.height - whole.height)
    log = at.log(at.value_of(outside).value / total.value) + rise
    if not at.errors:
        return Evaluated(log, None, None, total)
    return Evaluated(log, 2 * (total.error / total.value), abs(log) + abs(rise), total)


class AtOrder(NamedTuple):
    """An expansion's value at one order and its estimated error, if that is to be trusted."""

    value: Any
    error: Any
    order: int
    sure: bool
    log: Any = None


#: A quantity from its expressions, at lam.
Evaluate = Callable[[Composed, Point], Evaluated]


def with_digits(evaluate: Evaluate, composed: Composed, at: Point) -> AtOrder:
    """The value at one lam; sure where its error and that of its denominator allow it."""
    log, error, _, total = evaluate(composed, at)
    value = at.exp(log)
    sure = 2 * total.error < total.value and value > 0 and 0 <= error < 1
    return AtOrder(value, error * value, at.order, bool(sure), log)


def float_log(evaluate: Evaluate, composed: Composed, at: Point) -> tuple[FloatArray, Any]:
    """The logarithm and its error, None where not asked for.

    Infinite unless the denominator is known to half of itself.
    """
    log, relative, exponents, total = evaluate(composed, at)
    if not at.errors:
        return log, None
    known = None
    clear = np.max(total.error) < 0.5 * np.min(total.value)
    if not (clear and np.min(relative) >= 0 and np.max(relative) < _MOST):
        known = (total.error < total.value * 0.5) & (relative >= 0) & (relative < _MOST)
        relative = np.minimum(relative, 0.9)
    wrong = relative / (1.0 - relative)
    wrong += ULP * (exponents + 8)
    # A barrier and a well of one side, the other side, and the two sides' sum.
    rounding = higher(*(_too_large(at, x) for x in composed.height_rounding))
    wrong = plus(wrong, 4 * rounding)
    return log, wrong if known is None else np.where(known, wrong, np.inf)


def _too_large(at: Point, rounding: Numbers) -> Any:
    """Rounding of the exponents that the errors leave out because it is too large for them."""
    if isinstance(rounding, float) and rounding * at.most < MOST_ROUNDING:
        return 0.0
    moved = at.lam * rounding
    return np.where(moved < MOST_ROUNDING, 0.0, moved)


def plain(node: Node, at: Point) -> tuple[Any, Any]:
    """The value and the error of an expression, the exponential included."""
    scaled, factor = at.value_of(node), at.exp(at.lam * node.height)
    return scaled.value * factor, None if scaled.error is None else scaled.error * factor
