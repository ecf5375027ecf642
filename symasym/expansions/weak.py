"""Weak noise: T, C and P as sums over the critical points of V, over any ring.

The scale density is e^{lam V}, the speed density lam e^{-lam V}; noise that depends on u gives both
a weight, sigma^(-2 alpha) and sigma^(2 alpha - 2), and V' = -phi/sigma^2, written -phi here.

int e^{sign lam V} over [a, b] is, to all orders, the sum of what its points contribute: a peak
(barrier for sign 1, well for -1) Laplace's series, an end the formal antiderivative E = e^{lam V}
sum h_k (-x)^k (sign 1) or G = e^{-lam V} sum h_k x^k (sign -1), x = 1/lam, and a kink or a corner
of V the difference of that antiderivative's two sides. With s_p and m_p what point p contributes,

    L(p) = sum_{q<p} s_q + E(p-),   R(p) = sum_{q>p} s_q - E(p+),   S = sum_q s_q   (E = 0 at zeros)
    C = R(x)/S,     T = lam/S ( R(x) [rho- + sum_{p<x} m_p L(p)] + L(x) [rho+ + sum_{p>x} m_p R(p)]
                                + m_x L(x) R(x) ),      rho± = ± sum x^k f.p. int h_k

with x the start, and Hadamard's finite parts from the start to either end. (Green's function of
the mean exit time: Gardiner, Stochastic Methods, 5.5; G(x) cancels between the two sides.) Towards
an end that reflects, a wall, L = S -> oo: L(p)/S is 1, and the wall has an m_p, which an absorbing
end has not.

A ring gives `term(letter, point, height, halves, row)`: lam^(-halves/2) e^(lam height) sum row_n
lam^-n to its order, the letter being a name for it; `lam`, `log_lam`; and `named(name, value)`.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any, NamedTuple

from symasym.series.local import corner, gaussian, slow

_LETTERS = {"peak": "BW", "edge": "EG", "jump": "EF", "odd": "OU", "other": "QZ"}


class Point(NamedTuple):
    """A critical point: its place, V there from the start on, and its local expansions.

    `peak` are c_n lam^-(n+1/2); at a start on a zero `odd` is what its right half has besides half
    of that, c_n lam^-(n+1), and `beside` `corner`; `left` and `right` are h_k on both sides of an
    edge. Those two and `odd` are pairs, with the weight of the scale and of the speed density.
    """

    u: Any
    kind: str  # "end", "wall", "kink", "start", "well", "barrier", "start=well", "start=barrier"
    height: Any
    peak: list[Any]
    odd: Any
    beside: Any
    left: Any
    right: Any

    @property
    def name(self) -> str:
        """What it is, whether the start is there or not."""
        return self.kind.removeprefix("start=")

    def __str__(self) -> str:
        return f"{self.name} at {float(self.u):.4g}"

    def tops(self, sign: int) -> bool:
        """True where e^{sign lam V} has a maximum."""
        return self.kind.endswith("barrier" if sign > 0 else "well")


def points_of(field: Any, count: int, ring: Any) -> list[Point]:
    """The critical points of a drift, left to right, each series to `count` terms.

    `field` has their `places`, `height`, and `around` them, or on both `sides`, the Taylor
    coefficients of phi and the two weights, none where they are 1.
    """
    points = []
    for u, kind in field.places:
        height, word = field.height(u), kind.removeprefix("start=")
        if word in ("well", "barrier"):
            own, well, around = word != kind, word == "well", field.around(u, 2 * count + 1)
            peaks = _weighted(gaussian, around, count, ring)
            odd = _weighted(partial(gaussian, step=1), around, count, ring) if own else ()
            beside = corner(peaks[well], not well, ring, peaks[not well]) if own else ()
            odd = [row[1::2] for row in odd]
            points.append(Point(u, kind, height, peaks[well], odd, beside, (), ()))
        else:
            before, after = field.sides(u, count)
            left = _weighted(slow, before, count, ring) if before else ()
            right = left if before is after else ()
            if after and not right:
                right = _weighted(slow, after, count, ring)
            points.append(Point(u, kind, height, [], (), (), left, right))
    return points


def _weighted(make: Any, around: Any, count: int, ring: Any) -> list[Any]:
    """A series with the weight of the scale and of the speed density, one object if these are 1."""
    phi, weights = around
    rows = [make(phi, count, ring, weights=[w]) for w in weights]
    return rows or [make(phi, count, ring)] * 2


class Sums:
    """What each point contributes to int e^{sign lam V}, and E or G on its two sides."""

    def __init__(self, points: list[Point], sign: int, at: Any) -> None:
        self.at, self.sign = at, sign
        self.whole = [self._whole(p) for p in points]
        self.left, self.right = ([self._beside(p, side) for p in points] for side in (-1, 1))

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

    def _beside(self, p: Point, side: int) -> Any:
        if p.odd and p.tops(self.sign):
            half = self._term("peak", p, 1, p.peak) / 2
            return -side * half - self._term("odd", p, 2, p.odd[self.sign < 0])
        if p.odd:
            row = p.odd[self.sign < 0]
            return self._term("other", p, 2, [c * (-1) ** n for n, c in enumerate(row)])
        if p.kind not in ("kink", "start"):
            return 0
        # At a start that is no kink both sides are the same.
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


def exit_probability(points: list[Point], at: Any, complement: bool = False) -> Any:
    """C (eq:C), or 1 - C."""
    s, x = Sums(points, 1, at), start_of(points)
    left, right = at.named("L", s.below(x)), at.named("R", s.above(x))
    return (left if complement else right) / at.named("S", s.total())


class Shares(NamedTuple):
    """T = lam (R(x) D- + L(x) D+ + m_x L(x) R(x))/S: L(x), R(x), S; D- and D+ in parts; m_x.

    A part is the finite part of one side, with no points, or that of a well with a barrier or edge.
    """

    below: Any
    above: Any
    total: Any
    sides: list[list[tuple[tuple[Point, ...], Any]]]
    own: Any


def shares(points: list[Point], regular: Any, at: Any) -> Shares:
    """What T (eq:Ttilde) is made of; `regular` are the finite parts of int h_k on both sides."""
    s, m, x = Sums(points, 1, at), Sums(points, -1, at), start_of(points)
    p, sides = points[x], []
    near: Any = 0
    half: Any = 0
    none = p.height * 0
    if p.odd:
        plain, logs = p.beside
        near = at.term("H", p, none, 2, logs) * at.log_lam + at.term("N", p, none, 2, plain)
        # At a well half of its peak misses what E is on that side.
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
    """T as a sum of parts: the side of the start (0 for its own), the pair of points, the value."""
    of = shares(points, regular, at)
    for side, chance, row in zip((-1, 1), (of.above, of.below), of.sides, strict=True):
        yield from ((side, pair, chance * y * at.lam / of.total) for pair, y in row)
    if not _none(of.own):
        own = points[start_of(points)]
        yield 0, (own,), of.own * of.below * of.above * at.lam / of.total


def outside_layer(points: list[Point], slopes: tuple[Any, Any], at: Any) -> Any:
    """1 - P (eq:P): int_{|u|>1} e^{-lam V} over int e^{-lam V}; the points are those of [-1, 1]."""
    ends = zip((points[0], points[-1]), slopes, strict=True)
    tails = [at.term("X", p, -p.height, 2, [1 / abs(a)]) for p, a in ends]
    return sum(tails) / Sums(points, -1, at).total()


def _none(x: Any) -> bool:
    """True for a contribution that is not there."""
    return x.__class__ is int


def start_of(points: list[Point]) -> int:
    """The number of the start."""
    return next(i for i, p in enumerate(points) if p.kind[:5] == "start")
