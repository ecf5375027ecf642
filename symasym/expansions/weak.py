"""Weak noise: T, C and P as sums over the critical points of V, in any arithmetic.

With V' = -phi the scale density is e^{lam V} and the speed density lam e^{-lam V}. For noise that
depends on u, V' = -phi/sigma^2 and they have the weights sigma^(-2 alpha), sigma^(2 alpha - 2).

To all orders int e^{±lam V} is the sum of what the points contribute: a peak (a barrier for +, a
well for -) Laplace's series, an end the formal antiderivative E = e^{lam V} sum h_k (-lam)^-k or
G = e^{-lam V} sum h_k lam^-k, where h_1 = 1/phi and h_{k+1} = -h_k'/phi, and a kink or corner of V
the jump of that antiderivative. Let point p contribute s_p to the integral of e^{lam V} and m_p to
that of e^{-lam V}, and let x be the start. Then, with E = 0 at zeros of phi,

    L(p) = sum_{q<p} s_q + E(p-),   R(p) = sum_{q>p} s_q - E(p+),   S = sum_q s_q,
    C = R(x)/S,     T = lam/S ( R(x) [rho- + sum_{p<x} m_p L(p)] + L(x) [rho+ + sum_{p>x} m_p R(p)]
                                + m_x L(x) R(x) ),      rho± = ± sum lam^-k f.p. int h_k

with Hadamard's finite parts from the start to either end (Green's function of the mean exit time:
Gardiner, Stochastic Methods, 5.5; G(x) cancels between the two sides). If the left end
reflects (a "wall"), L = S -> oo, so that L(p)/S -> 1; a wall has a term m_p, an absorbing end none.

An arithmetic (`symasym.expansions.arithmetic`, or SymPy's) gives `lam`, `log_lam` and
`term(letter, point, height, halves, row)`; SymPy's makes of each term a symbol with that letter,
and by `named(name, value)` of a value a symbol with that name.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache, partial
from typing import Any, NamedTuple

from symasym.drift.drift import Drift
from symasym.expansions import answer
from symasym.expansions.ball_drift import RING, BallDrift, Between
from symasym.series import corner, gaussian, slow

_LETTERS = {"peak": "BW", "edge": "EG", "jump": "EF", "odd": "OU", "other": "QZ"}


class Point(NamedTuple):
    """A critical point u, V(u) - V(start), and the coefficients of its local expansions.

    `peak` has c_n of sum c_n lam^-(n+1/2). If the start is a zero of phi, `odd` holds the odd-order
    terms of the integral over its right half, c_n of sum c_n lam^-(n+1), and `corner` those of the
    double integral. `left` and `right` are the h_k on both sides of an edge. `odd`, `left` and
    `right` are pairs, with the weights of the scale and of the speed density.
    """

    u: Any
    kind: str  # "end", "wall", "kink", "start", "well", "barrier", "start=well", "start=barrier"
    height: Any
    peak: list[Any]
    odd: Any
    corner: Any
    left: Any
    right: Any

    @property
    def name(self) -> str:
        """The kind, whether or not the start lies there."""
        return self.kind.removeprefix("start=")

    def __str__(self) -> str:
        return f"{self.name} at {float(self.u):.4g}"

    def tops(self, sign: int) -> bool:
        """True if e^{sign lam V} has a maximum here."""
        return self.kind.endswith("barrier" if sign > 0 else "well")


def points_of(drift: Any, count: int, ring: Any) -> list[Point]:
    """The critical points of a drift from left to right, with each series to `count` terms.

    The drift, a `BallDrift` or one in symbols, gives their `places`, V as `height`, and the Taylor
    coefficients of phi and of the two weights `around` a zero or on both `sides` of an edge.
    """
    points = []
    for u, kind in drift.places:
        height, word = drift.height(u), kind.removeprefix("start=")
        if word in ("well", "barrier"):
            own, well, around = word != kind, word == "well", drift.around(u, 2 * count + 1)
            peaks = _weighted(gaussian, around, count, ring)
            odd = _weighted(partial(gaussian, step=1), around, count, ring) if own else ()
            double = corner(peaks[well], not well, ring, peaks[not well]) if own else ()
            odd = [row[1::2] for row in odd]
            points.append(Point(u, kind, height, peaks[well], odd, double, (), ()))
        else:
            before, after = drift.sides(u, count)
            left = _weighted(slow, before, count, ring) if before else ()
            right = left if before is after else ()
            if after and not right:
                right = _weighted(slow, after, count, ring)
            points.append(Point(u, kind, height, [], (), (), left, right))
    return points


def _weighted(make: Any, around: Any, count: int, ring: Any) -> list[Any]:
    """A series with the weight of the scale and of the speed density; one object if both are 1."""
    phi, weights = around
    rows = [make(phi, count, ring, weights=[w]) for w in weights]
    return rows or [make(phi, count, ring)] * 2


class Sums:
    """The contribution of each point to int e^{sign lam V}, and E or G on both sides of it."""

    def __init__(self, points: list[Point], sign: int, at: Any) -> None:
        self.at, self.sign = at, sign
        self.whole = [self._whole(p) for p in points]
        self.left, self.right = (
            [self._antiderivative(p, side) for p in points] for side in (-1, 1)
        )

    def _term(self, name: str, p: Point, halves: int, row: list[Any], mark: str = "") -> Any:
        letter = _LETTERS[name][self.sign < 0] + mark
        return self.at.term(letter, p, p.height if self.sign > 0 else -p.height, halves, row)

    def _formal(self, rows: Any) -> list[Any]:
        row = rows[self.sign < 0] if rows else ()
        return [h if self.sign < 0 or k % 2 else -h for k, h in enumerate(row)]

    def _whole(self, p: Point) -> Any:
        left, right = self._formal(p.left), self._formal(p.right)
        if p.peak:
            return self._term("peak", p, 1, p.peak) if p.tops(self.sign) else 0
        if not (left and right):
            counts = (p.kind == "end") == (self.sign > 0)
            return self._term("edge", p, 2, left or [-h for h in right]) if counts else 0
        if p.left is p.right:
            return 0
        return self._term("jump", p, 2, [a - b for a, b in zip(left, right, strict=True)])

    def _antiderivative(self, p: Point, side: int) -> Any:
        if p.odd and p.tops(self.sign):
            half = self._term("peak", p, 1, p.peak) / 2
            return -side * half - self._term("odd", p, 2, p.odd[self.sign < 0])
        if p.odd:
            row = p.odd[self.sign < 0]
            return self._term("other", p, 2, [c * (-1) ** n for n, c in enumerate(row)])
        if p.kind not in ("kink", "start"):
            return 0
        # Both sides are the same unless the start is a kink.
        mark = "s" if p.left is p.right else "lr"[side > 0]
        return self._term("edge", p, 2, self._formal(p.left if side < 0 else p.right), mark)

    def total(self) -> Any:
        """The whole integral."""
        return sum(self.whole)

    def below(self, i: int) -> Any:
        """The integral from the left end to point i."""
        return sum(self.whole[:i]) + self.left[i]

    def above(self, i: int) -> Any:
        """The integral from point i to the right end."""
        return sum(self.whole[i + 1 :]) - self.right[i]


class Shares(NamedTuple):
    """L(x), R(x), S, D- and D+ as sums, m_x in T = lam (R(x) D- + L(x) D+ + m_x L(x) R(x))/S.

    A summand has no points if it is the finite part of its side, else a well and a barrier or edge.
    """

    below: Any
    above: Any
    total: Any
    sides: list[list[tuple[tuple[Point, ...], Any]]]
    own: Any


def shares(points: list[Point], regular: Any, at: Any) -> Shares:
    """The parts of T (eq:Ttilde); `regular` has the finite parts of int h_k on both sides."""
    s, m, x = Sums(points, 1, at), Sums(points, -1, at), start_of(points)
    p, sides = points[x], []
    near: Any = 0
    half: Any = 0
    none = p.height * 0
    if p.odd:
        plain, logs = p.corner
        near = at.term("H", p, none, 2, logs) * at.log_lam + at.term("N", p, none, 2, plain)
        # m_x L(x) R(x) lacks half of the well's peak times E(x+-).
        half = m.whole[x] / 2 * s.right[x] if p.tops(-1) else 0
    absorbs = [q.kind == "end" for q in (points[0], points[-1])]
    row: list[tuple[tuple[Point, ...], Any]]
    for side, sign, outer in ((0, -1, range(x)), (1, 1, range(x + 1, len(points)))):
        if not absorbs[side]:
            row = [((points[i],), m.whole[i]) for i in outer if not _none(m.whole[i])]
            sides.append(row)
            continue
        own = at.term("M" + "-+"[side], p, none, 2, [c * sign for c in regular[side]])
        row = [((), own + near + half * sign)]
        for i in outer:
            others = range(i + 1, len(points)) if side else range(i)
            beyond = [(i, -s.right[i] if side else s.left[i]), *((q, s.whole[q]) for q in others)]
            beyond = [] if _none(m.whole[i]) else [pair for pair in beyond if not _none(pair[1])]
            row += [((points[i], points[q]), m.whole[i] * y) for q, y in beyond]
        sides.append(row)
    below = at.named("L", s.below(x)) if absorbs[0] else 1
    above = at.named("R", s.above(x)) if absorbs[1] else 1
    total = at.named("S", s.total()) if all(absorbs) else 1
    return Shares(below, above, total, sides, m.whole[x])


def escape_time(points: list[Point], regular: Any, at: Any) -> Any:
    """T."""
    of = shares(points, regular, at)
    left, right = (sum(y for _, y in row) for row in of.sides)
    left, right = at.named("D-", left), at.named("D+", right)
    return (of.above * left + of.below * right + of.own * of.below * of.above) * at.lam / of.total


def parts(points: list[Point], regular: Any, at: Any) -> Iterator[tuple[int, Any, Any]]:
    """The summands of T: the side (0 at the start itself), the pair of points, the value."""
    of = shares(points, regular, at)
    for side, chance, row in zip((-1, 1), (of.above, of.below), of.sides, strict=True):
        yield from ((side, pair, chance * y * at.lam / of.total) for pair, y in row)
    if not _none(of.own):
        own = points[start_of(points)]
        yield 0, (own,), of.own * of.below * of.above * at.lam / of.total


def _none(x: Any) -> bool:
    """True for the placeholder 0 of a point that does not contribute."""
    return x.__class__ is int


def start_of(points: list[Point]) -> int:
    """The index of the start."""
    return next(i for i, p in enumerate(points) if p.kind[:5] == "start")


class Coefficients(NamedTuple):
    """The coefficients: critical points, finite parts, and phi at both ends."""

    points: list[Point]
    regular: list[list[Any]]
    slopes: tuple[Any, Any]


def coefficients(of: Any, name: str, count: int, ring: Any) -> Coefficients:
    """The coefficients of the quantity `name`, to `count` terms, of a drift as in `points_of`."""
    points = points_of(of, count, ring)
    if name[-1] == "P":
        points = [p for p in points if p.kind != "end"]
    regular = of.regular(count) if name == "T" else []
    return Coefficients(points, regular, (of.ends[-1], of.ends[1]))


def quantity(name: str, known: Coefficients, at: Any) -> Any:
    """T, C, 1 - C, P or 1 - P."""
    if name == "T":
        return escape_time(known.points, known.regular, at)
    if name[-1] == "C":
        s, x = Sums(known.points, 1, at), start_of(known.points)
        left, right = at.named("L", s.below(x)), at.named("R", s.above(x))
        return (right if name == "C" else left) / at.named("S", s.total())
    # 1 - P (eq:P), the share of |u| > 1 in int e^{-lam V}, in a sliding region.
    ends = (known.points[0], known.slopes[0]), (known.points[-1], -known.slopes[1])
    tails = [at.term("X", p, -p.height, 2, [1 / a]) for p, a in ends]
    outside = sum(tails) / Sums(known.points, -1, at).total()
    return 1 - outside if name == "P" else outside


# -- in balls and floats ---------------------------------------------------------------------------


@lru_cache(maxsize=16)
def local(drift: Drift, between: Between, name: str, count: int, bits: int) -> Coefficients:
    """The coefficients of the quantity `name` to `count` terms, at flint's `bits`."""
    of = BallDrift(drift, between, name == "T", near=name[-1] != "P")
    return coefficients(of, name, count, RING)


class WeakNoise(answer.PartialSums):
    """The expansion in powers of 1/lam."""

    reason = (
        "the noise is too strong for Laplace's method, or two of the wells, barriers, start and "
        "ends are too close together, where in a layer 'uniform' holds"
    )

    def known(self, bits: int) -> Coefficients:
        """The critical points with their series."""
        return local(self.drift, self.between, self.name, self.length, bits)

    def quantity(self, known: Coefficients, arithmetic: Any) -> Any:
        """The sum over the critical points."""
        return quantity(self.name, known, arithmetic)


of_scene, of_scenes = partial(answer.of_scene, WeakNoise), partial(answer.of_scenes, WeakNoise)
