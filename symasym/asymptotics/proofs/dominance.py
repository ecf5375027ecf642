"""Which wells and barriers dominate T in weak noise, and how far below them all else stays.

Decided once for all noise, from bounds of V on each cell (`symasym.asymptotics.proofs.cells`).
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import flint

from symasym.asymptotics.proofs.cells import Cell, Landscape, steepness
from symasym.numbers.balls import NotProved, exact_ball
from symasym.series.taylor_models import SmallTerm, SmallTerms

if TYPE_CHECKING:
    from flint import arb

Key = tuple[tuple[int, int], ...]


def key_of(parts: Sequence[tuple[int, int]]) -> Key:
    """A sum of heights, as label and multiple; label 0 is the height of the start, which is 0."""
    times_of: dict[int, int] = {}
    for label, times in parts:
        if label:
            times_of[label] = times_of.get(label, 0) + times
    return tuple(sorted((label, n) for label, n in times_of.items() if n))


class Labels:
    """Heights of V, measured from the start; equal ones have one label, if that is proved."""

    def __init__(self, origin: Fraction, even: bool) -> None:
        self._origin, self._even = origin, even
        self.heights = [flint.arb(0)]
        self._known: list[tuple[Fraction | None, Fraction | None]] = [(None, Fraction(0))]

    def of(self, height: arb | None, middle: Fraction | None, exact: Fraction | None) -> int:
        """The label of a height measured from V(-1), at `middle`; `exact` where it is rational."""
        if exact is not None:
            exact -= self._origin
            height = exact_ball(exact)
        else:
            height = height - exact_ball(self._origin)
        for label, (known, (point, value)) in enumerate(
            zip(self.heights, self._known, strict=True)
        ):
            if not known.overlaps(height):
                continue
            same = exact == value if exact is not None and value is not None else middle == point
            mirrored = self._even and None not in (point, middle) and _near(point, middle)
            if not (same or mirrored):
                # As good as equal, but not shown to be.
                raise NotProved
            return label
        self.heights.append(height + flint.arb(0))
        self._known.append((middle, exact))
        return len(self.heights) - 1

    def find(self, height: arb) -> int:
        """The label of a height measured from the start, a new one if there is none."""
        for label, known in enumerate(self.heights):
            if known.overlaps(height):
                return label
        self.heights.append(height)
        self._known.append((None, None))
        return len(self.heights) - 1

    def height(self, key: Key) -> Any:
        """The height that the key stands for."""
        return sum((n * self.heights[label] for label, n in key), flint.arb(0))


def _near(a: Fraction | None, b: Fraction | None) -> bool:
    """True where a and -b are as good as equal."""
    return a is not None and b is not None and abs(a + b) < Fraction(1, 10**40)


class LeadingCell(NamedTuple):
    """A cell whose integral is known as a series: its label, and its number."""

    label: int
    cell: int


class Size(NamedTuple):
    """size y^power e^{lam top} bounds int e^{lam V} over some cells."""

    size: Any
    power: int
    top: Any


def below_height(sizes: Sequence[Size], height: arb) -> SmallTerms:
    """The sizes relative to e^{lam height}."""
    return tuple(SmallTerm(s.size, s.power, (height - s.top).lower()) for s in sizes)


class Group(NamedTuple):
    """int e^{lam V} over some cells: those at its largest height, and the others.

    `label` is None where the highest of it is not leading; `others` is relative to its height.
    `top` is V's upper bound, `length` that of the cells; `sizes`, of curved and straight cells,
    bound the whole: see `below_height`.
    """

    label: int | None
    leading: tuple[LeadingCell, ...]
    others: SmallTerms
    top: Any
    sizes: tuple[Size, ...]
    length: Any


class DominantWell(NamedTuple):
    """A well that dominates; what is beyond it, between it and the start, and behind the start."""

    leading: LeadingCell
    beyond: Group
    between: Group
    behind: Group
    key: Key


class Subdominant(NamedTuple):
    """size y^power e^{lam exponent} times integrals over `above`, over that over the cell `under`.

    The integrals are without their own exponentials.
    """

    size: Any
    power: int
    exponent: Any
    under: LeadingCell | None
    above: tuple[Group, ...]


class Leading(NamedTuple):
    """T/lam = sum over the wells, and what is exponentially smaller than that."""

    wells: tuple[DominantWell, ...]
    subdominant: tuple[Subdominant, ...]
    key: Key


class Dominance:
    """Which cells of a landscape dominate, decided in balls."""

    def __init__(self, cut: Landscape, origin: Fraction, even: bool) -> None:
        self.landscape, self.labels = cut, Labels(origin, even)
        self.cells = cut.cells
        base = exact_ball(origin)
        spans = [_span(c) for c in self.cells]
        self.tops = [high - base for _, high in spans]
        self.bottoms = [low - base for low, _ in spans]
        self.sizes = [exact_ball(c.stop - c.start) for c in self.cells]
        self._groups: dict[Any, tuple[set[int], Group]] = {}
        self.high: dict[int, LeadingCell] = {}
        self.low: dict[int, LeadingCell] = {}
        for k, cell in enumerate(self.cells):
            if cell.slope is not None:
                value, point = _straight_top(cell)
                self.high[k] = LeadingCell(self.labels.of(None, point, value), k)
            elif cell.peak is not None:
                p = cell.peak
                made = LeadingCell(self.labels.of(p.height, p.middle, p.exact), k)
                (self.high if p.sign > 0 else self.low)[k] = made

    def group(self, indices: Sequence[int], loose: Sequence[int] = ()) -> Group:
        """The group of these cells; of the loose ones any part may count."""
        everything = [*indices, *loose]
        sizes = self._sizes(everything)
        length = sum((self.sizes[k] for k in everything), flint.arb(0))
        top = flint.arb("-inf")
        for size in sizes:
            top = top.max(size.top)
        heights = {k: self.labels.heights[s.label] for k, s in self.high.items() if k in indices}
        if not heights:
            return Group(None, (), (), top, sizes, length)
        first = self.high[max(heights, key=lambda k: heights[k].mid())]
        at = self.labels.heights[first.label]
        leading = tuple(self.high[k] for k in heights if self.high[k].label == first.label)
        used = {s.cell for s in leading}
        others = below_height(self._sizes([k for k in everything if k not in used]), at)
        if not all(t.gap > 0 for t in others):
            return Group(None, (), (), top, sizes, length)
        return Group(first.label, leading, others, at, sizes, length)

    def _sizes(self, indices: Sequence[int]) -> tuple[Size, ...]:
        """Curved cells are bounded by their lengths, straight ones by lam^-1/|slope|."""
        sizes = []
        for straight in (False, True):
            cells = [k for k in indices if (self.cells[k].slope is not None) == straight]
            size, top = flint.arb(0), flint.arb("-inf")
            for k in cells:
                slope = self.cells[k].slope
                size += self.sizes[k] if slope is None else 1 / exact_ball(abs(slope))
                top = top.max(self.tops[k])
            if cells:
                sizes.append(Size(size.upper(), 2 * straight, top))
        return tuple(sizes)

    def sides(self, k: int) -> tuple[Sequence[int], Sequence[int], Sequence[int], Sequence[int]]:
        """Cells beyond cell k, between it and the start, behind the start, and the start's own."""
        at, inside, n = self.landscape.start_cell, self.landscape.inside, len(self.cells)
        first = at + 1 if inside else at
        own = [at] if inside and k != at else []
        if k >= first:
            return range(k + 1, n), range(first, k), range(at), own
        if k < at:
            return range(k), range(k + 1, at), range(first, n), own
        return range(at), (), range(first, n), own

    def leading(self) -> Leading:
        """The wells that dominate T, and bounds of all else."""
        wells = [w for w in (self._well(s) for s in self.low.values()) if w is not None]
        if not wells:
            raise NotProved
        exponents = [self.labels.height(w.key) for w in wells]
        most = max(range(len(wells)), key=lambda i: exponents[i].mid())
        key = wells[most].key
        main = tuple(w for w in wells if w.key == key)
        cells = {w.leading.cell for w in main}
        subdominant = []
        # Away from the start on both sides, so that what lies outside shrinks.
        at = self.landscape.start_cell
        for k in (*range(at - 1, -1, -1), *range(at, len(self.cells))):
            if k not in cells:
                subdominant.append(self._speed_measure(k))
            subdominant.append(self._nested(k))
        return Leading(main, tuple(subdominant), key)

    def _well(self, leading: LeadingCell) -> DominantWell | None:
        """A well with the three groups it goes with; None where one of them does not lead."""
        beyond, between, behind, own = self.sides(leading.cell)
        a, m, b = self.group(beyond), self.group(between, own), self.group(behind, own)
        key = self.denominator(a, m, b)
        if key is None:
            return None
        label, alone = key
        # What is cancelled by the denominator need not be leading, but it is.
        parts = [(leading.label, -1)]
        for group, cancels in ((a, alone is a), (b, alone is b)):
            if cancels:
                parts.append((label, 1))
            elif group.label is None:
                return None
            else:
                parts.append((group.label, 1))
        return DominantWell(leading, a, m, b, key_of([*parts, (label, -1)]))

    def denominator(self, a: Group, m: Group, b: Group) -> tuple[int, Group | None] | None:
        """The label of what is largest of the three; the group, if it is one of a and b alone."""
        groups = [g for g in (a, m, b) if g.label is not None]
        if not groups:
            return None
        best = max(groups, key=lambda g: g.top.mid())
        label = best.label
        assert label is not None
        same = [g for g in groups if g.label == label]
        alone = best if len(same) == 1 and best is not m else None
        return label, alone

    def _speed_measure(self, k: int) -> Subdominant:
        """int e^{-lam V} over cell k times A B/(A + M + B), from above."""
        beyond, between, behind, own = self.sides(k)
        one, two = self._above(beyond, ()), self._above(behind, own)
        size, height = self._sizes([k])[0][:2], -self.bottoms[k]
        choices = [_over(size, height, None, one), _over(size, height, None, two)]
        choices += [
            _over(size, height - self._height(self.high[j]), self.high[j], one, two)
            for j in between
            if j in self.high
        ]
        return min(choices, key=_exponent)

    def _nested(self, k: int) -> Subdominant:
        """The double integral over cell k times the chance to be on the start's other side."""
        at, inside = self.landscape.start_cell, self.landscape.inside
        size = self.sizes[k] ** 2, 0
        rise = self.tops[k] - self.bottoms[k]
        cell = self.cells[k]
        sign, steep = steepness(cell)
        # To the right of the start e^{lam V} is to the right of e^{-lam V}.
        if sign and (sign < 0) == (k >= at):
            size, rise = (self.sizes[k] / steep, 2), flint.arb(0)
        elif cell.slope is not None:
            size = 1 / steep**2, 4
        choices = [_over(size, rise, None)]
        if not (inside and k == at):
            first = at + 1 if inside else at
            near = range(first, len(self.cells)) if k >= first else range(at)
            far = range(at) if k >= first else range(first, len(self.cells))
            above = self._above(far, [at] if inside else [])
            choices += [
                _over(size, rise - self._height(self.high[j]), self.high[j], above)
                for j in near
                if j in self.high
            ]
        return min(choices, key=_exponent)

    def _height(self, leading: LeadingCell) -> Any:
        """The height of a cell."""
        return self.labels.heights[leading.label]

    def _above(self, indices: Sequence[int], own: Sequence[int]) -> Group:
        """A group that holds these cells, and perhaps more; few are made."""
        leading = tuple(k for k in indices if k in self.high)
        key = leading, tuple(own), bool(indices) and indices[0] < self.landscape.start_cell
        known = self._groups.get(key)
        if known is None or known[1].label is None or not set(indices) <= known[0]:
            known = set(indices), self.group(indices, own)
            self._groups[key] = known
        return known[1]


def _over(
    bound: tuple[Any, int], exponent: arb, under: LeadingCell | None, *above: Group
) -> Subdominant:
    """A bound divided by one integral and times others."""
    size, power = bound
    for group in above:
        exponent = exponent + group.top
        if group.label is None:
            # By lengths: straight cells of any slope are no longer than that.
            size = size * group.length
    leading = tuple(group for group in above if group.label is not None)
    return Subdominant(size, power, exponent, under, leading)


def _exponent(choice: Subdominant) -> Any:
    """The exponent, to compare with others."""
    return choice.exponent.mid() if choice.exponent.is_finite() else flint.arb("-inf")


def _span(cell: Cell) -> tuple[Any, Any]:
    """V's lower and upper bound on a cell, measured from V(-1)."""
    if cell.slope is not None:
        end = cell.height - exact_ball(cell.slope * (cell.stop - cell.start))
        return cell.height.min(end).lower(), cell.height.max(end).upper()
    lows, highs = zip(*(panel.span() for panel in cell.panels), strict=True)
    low, high = lows[0].lower(), highs[0].upper()
    for down, up in zip(lows[1:], highs[1:], strict=True):
        low, high = low.min(down.lower()), high.max(up.upper())
    if cell.peak is not None:
        if cell.peak.sign > 0:
            high = cell.peak.height.upper()
        else:
            low = cell.peak.height.lower()
    return low, high


def _straight_top(cell: Cell) -> tuple[Fraction, Fraction]:
    """V at the higher end of a straight cell, exactly, and that end."""
    assert cell.slope is not None
    assert cell.exact is not None
    if cell.slope > 0:
        return cell.exact, cell.start
    return cell.exact - cell.slope * (cell.stop - cell.start), cell.stop
