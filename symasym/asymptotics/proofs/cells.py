"""[-r, r] cut into cells that do not depend on lam: peaks of V, straight stretches, panels.

For `symasym.asymptotics.proofs.enclosures` and `all_noise`. All that is said of a cell is proved in
balls; where the cells lie decides about tightness alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import flint
import sympy

from symasym.asymptotics.laplace.cauchy_disk import Disk, disk
from symasym.asymptotics.laplace.kinks import Piece
from symasym.asymptotics.proofs.layer_bounds import LinePanel
from symasym.asymptotics.weak_noise.critical_points import simple_zeros
from symasym.base import call_context
from symasym.base.call_context import own_context
from symasym.base.errors import SymasymError
from symasym.drift.drift import Drift
from symasym.drift.field.taylor_field import ExactField, to_fraction
from symasym.numbers.balls import NotProved, exact_ball, precision

if TYPE_CHECKING:
    from mpmath import mpf

# Terms behind those of the expansion that are enclosed one by one, the others by Cauchy's estimate.
_EXPLICIT = 4
# Cells between two neighbouring peaks, and panels of a peak's own cell: each loses a factor
# e^{lam x (fall of V over it)}, which has to stay below what the peak itself loses.
_CELLS = 32
_PANELS = 16
_FINEST = 12
# Digits of a peak's position; the proof takes a neighbourhood of 1e-45 of it.
_DIGITS = 80
_LESS = 1 - Fraction(1, 10**9)


class Extremum(NamedTuple):
    """A barrier or an end (sign 1) or a well (-1): V there, and how far V has gone at the edges.

    `middle` is its position, or within 1e-45 of it, and then `exact`, its height, is None.
    """

    sign: int
    height: Any
    disk: Disk
    drops: tuple[Any, ...]
    middle: Fraction
    exact: Fraction | None


class Cell(NamedTuple):
    """A stretch of [-r, r]: with panels and perhaps a peak, or straight with a slope.

    `height` and `exact`: V at the left end of a straight one, measured from V(-1).
    """

    start: Fraction
    stop: Fraction
    panels: tuple[LinePanel, ...]
    peak: Extremum | None
    slope: Fraction | None
    height: Any
    exact: Fraction | None


def steepness(cell: Cell) -> tuple[int, Any]:
    """The sign of V' on a cell where V is monotone, and a lower bound of |V'|; 0 elsewhere."""
    if cell.slope is not None:
        return (-1 if cell.slope > 0 else 1), exact_ball(abs(cell.slope))
    if cell.peak is None and len(cell.panels) == 1 and cell.panels[0].steep > 0:
        return (1 if cell.panels[0].slope > 0 else -1), cell.panels[0].steep
    return 0, None


class Landscape(NamedTuple):
    """The cells, left to right; the start is where cell number `start_cell` begins, or inside it.

    `origin` is V at the start, measured from V(-1).
    """

    cells: tuple[Cell, ...]
    start_cell: int
    inside: bool
    origin: Fraction


class Stationary(NamedTuple):
    """The cells of the layer; |A| and V at u = -1 and 1, from where V is straight."""

    cells: tuple[Cell, ...]
    slopes: tuple[Fraction, Fraction]
    heights: tuple[Fraction, Fraction]


class _Potential:
    """V inside [-1, 1], from V(-1) = 0, exactly and in balls."""

    def __init__(self, coefficients: Sequence[Fraction]) -> None:
        self.x = sympy.Symbol("u")
        coefficients_of_v = [
            Fraction(0),
            *(-Fraction(c) / (k + 1) for k, c in enumerate(coefficients)),
        ]
        coefficients_of_v[0] = -sum(c * (-1) ** k for k, c in enumerate(coefficients_of_v))
        self.exactly = flint.fmpq_poly(
            [flint.fmpq(c.numerator, c.denominator) for c in coefficients_of_v]
        )

    def at(self, u: Fraction) -> Fraction:
        """V(u), exactly."""
        value = self.exactly(flint.fmpq(u.numerator, u.denominator))
        return Fraction(int(value.p), int(value.q))

    def about(self, u: Fraction) -> Any:
        """V in powers of the distance from u: near a zero of A, V's differences are small there."""
        shifted = self.exactly(flint.fmpq_poly([flint.fmpq(u.numerator, u.denominator), 1]))
        near = self.x - _rational(u)
        return sum(
            (sympy.Rational(int(c.p), int(c.q)) * near**k for k, c in enumerate(shifted.coeffs())),
            sympy.Integer(0),
        )

    def panels(self, a: Fraction, b: Fraction, count: int) -> tuple[LinePanel, ...]:
        """Enclosures of V on equal parts of [a, b]."""
        rows, step = [], (b - a) / count
        for k in range(count):
            half = exact_ball(step / 2)
            line = flint.arb_poly([exact_ball(a + step * (k + Fraction(1, 2))), half])
            middle, slope, *rest = flint.arb_poly(self.exactly)(line).coeffs()
            bend = sum((abs(c) for c in rest), flint.arb(0)).upper()
            turn = sum((k * abs(c) for k, c in enumerate(rest, start=2)), flint.arb(0))
            steep = ((abs(slope) - turn) / half).lower().max(flint.arb(0))
            even, odd = middle + sum(rest[::2]), slope + sum(rest[1::2])
            ends = even - odd, even + odd
            rows.append(LinePanel(2 * half, middle - slope, slope / half, bend, ends, steep))
        return tuple(rows)


def _rational(x: Fraction) -> Any:
    """The fraction as SymPy's."""
    return sympy.Rational(int(x.numerator), int(x.denominator))


@lru_cache(maxsize=64)
def landscape(
    coefficients: tuple[Fraction, ...], drift: Drift, r: Fraction, x: Fraction, order: int
) -> Landscape | None:
    """The cells of [-r, r]; None where a peak of V has no proof."""
    with precision(256):
        try:
            return _cut(coefficients, drift, r, x, order)
        except (NotProved, SymasymError, OverflowError, ZeroDivisionError):
            return None


def _cut(
    coefficients: tuple[Fraction, ...], drift: Drift, r: Fraction, x: Fraction, order: int
) -> Landscape:
    """The cells of [-r, r], the peaks of V first."""
    one = Fraction(1)
    layer = _Potential(coefficients)
    lo, hi = max(-r, -one), min(r, one)
    with own_context(_DIGITS) as context:
        field = ExactField(drift, False, context)
        slopes = [field.value(side * one) for side in (-1, 1)]
        if not (field.value(lo) and field.value(hi)):
            raise NotProved
        zeros = simple_zeros(field, lo, hi, context)
        ends = [field.value(lo) > 0, field.value(hi) < 0]
    drafts: list[_Draft] = []
    if ends[0] and r <= 1:
        drafts.append(_draft(layer, 1, lo, "right", (lo, hi), x, order))
    for zero, barrier in zeros:
        sign = 1 if barrier else -1
        if barrier and x == _near(zero):
            # Started at the barrier itself, its two halves count apart.
            drafts += [_draft(layer, 1, x, s, (lo, hi), x, order) for s in ("left", "right")]
        else:
            drafts.append(_draft(layer, sign, zero, "both", (lo, hi), x, order))
    if ends[1] and r <= 1:
        drafts.append(_draft(layer, 1, hi, "left", (lo, hi), x, order))
    cells = _inside(layer, drafts, lo, hi, x)
    if r > 1:
        heights = [Fraction(0), layer.at(one)]
        for side, slope, height in zip((-1, 1), slopes, heights, strict=True):
            a, b = (-r, -one) if side < 0 else (one, r)
            cuts = [a, x, b] if a < x < b else [a, b]
            for left, right in pairwise(cuts):
                V = height - slope * (left - side)
                cells.append(Cell(left, right, (), None, slope, exact_ball(V), V))
    cells.sort(key=lambda c: c.start)
    if any(c.stop != d.start for c, d in pairwise(cells)):
        raise NotProved
    first = next(k for k, c in enumerate(cells) if c.stop > x)
    beside = min(max(x, -one), one)
    origin = layer.at(beside) - (x - beside) * slopes[0 if x < 0 else 1]
    return Landscape(tuple(cells), first, cells[first].start < x, origin)


def _inside(
    layer: _Potential, drafts: list[_Draft], lo: Fraction, hi: Fraction, x: Fraction
) -> list[Cell]:
    """The cells of these peaks, and panels between them, cut at x."""
    cells = [_peak_cell(layer, d) for d in _apart(drafts)]
    edges = [lo, *(e for c in cells for e in (c.start, c.stop)), hi]
    if any(a > b for a, b in pairwise(edges)):
        raise NotProved
    for a, b in zip(edges[::2], edges[1::2], strict=True):
        cuts = [a, x, b] if a < x < b else [a, b]
        for left, right in pairwise(cuts):
            if left < right:
                cells += _between(layer, left, right, [d.height for d in drafts])
    return cells


def _between(layer: _Potential, left: Fraction, right: Fraction, levels: list[Any]) -> list[Cell]:
    """Panels, finer where V is near the height of a peak: which is the higher has to be seen."""
    step, cells = (right - left) / _CELLS, []
    edges = [*(left + k * step for k in range(_CELLS)), right]
    waiting = [(a, b, 0) for a, b in pairwise(edges)]
    while waiting:
        call_context.step()
        a, b, depth = waiting.pop()
        (panel,) = layer.panels(a, b, 1)
        ends = panel.height, panel.height + panel.slope * panel.width
        near = any(not abs(v - level) > 4 * panel.bend for v in ends for level in levels)
        if near and panel.bend > 0 and depth < _FINEST:
            waiting += [(a, (a + b) / 2, depth + 1), ((a + b) / 2, b, depth + 1)]
        else:
            cells.append(Cell(a, b, (panel,), None, None, None, None))
    return cells


@lru_cache(maxsize=64)
def stationary(coefficients: tuple[Fraction, ...], drift: Drift, order: int) -> Stationary | None:
    """The layer for int e^{-lam V}, or None where a well has no proof; the region is sliding."""
    one = Fraction(1)
    with precision(256):
        try:
            layer = _Potential(coefficients)
            with own_context(_DIGITS) as context:
                field = ExactField(drift, False, context)
                slopes = [field.value(side * one) for side in (-1, 1)]
                zeros = simple_zeros(field, -one, one, context)
            wells = [zero for zero, barrier in zeros if not barrier]
            drafts = [_draft(layer, -1, u, "both", (-one, one), one, order) for u in wells]
            cells = _inside(layer, drafts, -one, one, one)
        except (NotProved, SymasymError, OverflowError, ZeroDivisionError):
            return None
    heights = Fraction(0), layer.at(one)
    return Stationary(tuple(cells), (abs(slopes[0]), abs(slopes[1])), heights)


def _near(zero: mpf) -> Fraction:
    """The rational that a zero seems to be; `disk` proves what is made of it."""
    return to_fraction(zero).limit_denominator(10**12)


class _Draft(NamedTuple):
    """A peak and as much around it as its series holds for."""

    sign: int
    middle: Fraction
    height: Any
    disk: Disk
    start: Fraction
    stop: Fraction
    exact: Fraction | None


def _draft(
    layer: _Potential,
    sign: int,
    point: mpf | Fraction,
    side: str,
    ends: tuple[Fraction, Fraction],
    x: Fraction,
    order: int,
) -> _Draft:
    """A peak at `point` with its series, Cauchy's bound of the tail, and how far they hold."""
    exact = _near(point) if hasattr(point, "_mpf_") else point
    slope = layer.exactly.derivative()
    if side == "both" and slope(flint.fmpq(exact.numerator, exact.denominator)) != 0:
        exact = None
    contact = 1 if side != "both" and exact in ends else 2
    lo, hi = (_rational(e) for e in ends)
    middle = to_fraction(point) if exact is None else exact
    piece = Piece(lo, hi, sympy.expand_mul(sign * layer.about(middle)), sympy.Integer(1))
    count = (order + 1 + _EXPLICIT) * contact + 1
    with precision(128 + 12 * count):
        given = point if exact is None else _rational(exact)
        series = disk(piece, layer.x, given, side, contact, sympy.Integer(1), count)
    edges = dict.fromkeys((-1, 1), middle)
    for s, reach, _ in series.sides:
        edge = (ends[0] if s < 0 else ends[1]) if reach is None else middle + s * reach * _LESS
        # The shares of a barrier on both sides of the start must not be mixed.
        edges[s] = x if sign > 0 and min(middle, edge) < x < max(middle, edge) else edge
    height = exact_ball(layer.at(middle))
    if exact is None:
        # By the mean value theorem: V' is tiny as well on the ball where the peak is.
        gap = exact_ball(abs(middle) + 1) * flint.arb(10) ** -45
        around = exact_ball(middle) + flint.arb(0, gap.upper())
        height += flint.arb(0, (abs(flint.arb_poly(slope)(around)) * gap).upper())
    known = None if exact is None else layer.at(middle)
    return _Draft(sign, middle, height, series, edges[-1], edges[1], known)


def _apart(drafts: list[_Draft]) -> list[_Draft]:
    """The peaks without overlaps: where two overlap, either may be cut anywhere between them."""
    apart = list(drafts)
    for k, (a, b) in enumerate(pairwise(drafts)):
        if a.stop > b.start:
            edge = max(b.start, min(a.stop, (a.middle + b.middle) / 2))
            apart[k] = apart[k]._replace(stop=edge)
            apart[k + 1] = apart[k + 1]._replace(start=edge)
    return apart


def _peak_cell(layer: _Potential, draft: _Draft) -> Cell:
    """The cell of a peak, with the falls of V to its edges."""
    drops = []
    for sign, _, _ in draft.disk.sides:
        edge = draft.start if sign < 0 else draft.stop
        drop = draft.sign * (draft.height - exact_ball(layer.at(edge)))
        if not ((edge - draft.middle) * sign > 0 and drop > 0):
            raise NotProved
        drops.append(drop)
    panels = layer.panels(draft.start, draft.stop, _PANELS)
    peak = Extremum(draft.sign, draft.height, draft.disk, tuple(drops), draft.middle, draft.exact)
    return Cell(draft.start, draft.stop, panels, peak, None, None, None)
