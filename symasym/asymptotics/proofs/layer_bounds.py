"""Two-sided bounds of int e^{lam V} over a stretch of the layer, for every lam at once.

The stretch is cut into segments. On each panel of a segment V lies between two parallel lines: with
|V - (h + s t)| <= b for 0 <= t <= w, the integral of e^{lam V} is within a factor e^{lam b} of w
phi_1(lam s w) e^{lam h}, phi_1(x) = (e^x - 1)/x; and where V is monotone it is at most the width,
or 1/(lam |V'|), times the larger of the two ends' values. That is tight while lam V'' width^2 is
small. Where V has its largest values (at an end from which it falls, at a barrier) a window carries
bounds by Laplace's method besides, whose ratio is 1 + O(1/lam); the better of the two counts. See
docs/bounds.md.

All constants are proved in ball arithmetic; finding the windows is not, and need
not be: a peak that is missed costs tightness only.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import flint
import numpy as np

from symasym.base import call_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.numbers.balls import BallOps, exact_ball, precision, profile_of
from symasym.special.exponentials import ball_quotient

if TYPE_CHECKING:
    from flint import arb

_WIDEST = Fraction(1, 32)
_NARROWEST = Fraction(1, 2**16)
_MOST_PANELS = 300
_SAMPLES = 2001
_LOST = 2.0**-64
# Of an upper bound of V, of which exact numbers are made.
_MOST_BITS = 10**6


class Edge(NamedTuple):
    """A peak at an end: V(end), |A| there, sup |A'|/|A|^3 in the window, and the fall across it."""

    height: Any
    slope: Any
    bend: Any
    fall: Any


class Barrier(NamedTuple):
    """V = height - curvature t^2 - cubic t^3 - …, |fourth-order term| <= quartic t^4, |t| <= reach.

    `gap` is the uncertainty of the barrier's position.
    """

    height: Any
    curvature: Any
    cubic: Any
    quartic: Any
    reach: Any
    gap: Any


class Segment(NamedTuple):
    panels: list[LinePanel]
    peak: Edge | Barrier | None


class Layer(NamedTuple):
    """Segments of a stretch, V measured from its beginning, and V at its end."""

    segments: list[Segment]
    end: Any


class _Drift:
    """The drift, or its mirror image, with enclosures of its derivatives."""

    def __init__(self, drift: Drift, mirrored: bool) -> None:
        self._drift, self._sign = drift, -1 if mirrored else 1
        profile = profile_of(drift)
        self.profile = profile.mirrored() if mirrored else profile
        # Of A's Taylor series on a panel; the rest widens V.
        finite, wanted = profile.terms(), 12 + flint.ctx.prec // 6
        self.terms = wanted if finite is None else max(4, min(finite + 1, wanted))

    def floats(self, u: FloatArray) -> Any:
        """A at u in float64."""
        with np.errstate(all="ignore"):
            values = self._sign * self._drift.evaluate_float(self._sign * u)
        return np.broadcast_to(values, u.shape)

    def taylor(self, ball: arb, terms: int) -> list[Any]:
        """Taylor coefficients at any point of the ball `ball`."""
        before = flint.ctx.cap
        flint.ctx.cap = terms
        try:
            line = flint.arb_series([self._sign * ball, self._sign], terms)
            series = self._sign * flint.arb_series(self._drift.evaluate(line, BallOps()), terms)
        except (ZeroDivisionError, ValueError):
            # A divisor that may be 0 in the ball.
            return [flint.arb.nan()] * terms
        finally:
            flint.ctx.cap = before
        coefficients: list[Any] = series.coeffs()
        return coefficients + [flint.arb(0)] * (terms - len(coefficients))


def layer_of(drift: Drift, mirrored: bool, a: Fraction, b: Fraction) -> Layer:
    """The segments of [a, b] inside [-1, 1], at the precision of the moment."""
    field = _Drift(drift, mirrored)
    windows = _windows(field, a, b)
    cuts = sorted({a, b, *(w[0] for w in windows), *(w[1] for w in windows)})
    by_start = {w[0]: w for w in windows}
    top = float(_rough_top(field, a, b))
    segments, height = [], flint.arb(0)
    for left, right in zip(cuts, cuts[1:], strict=False):
        window = by_start.get(left)
        begin = height
        panels, height = _panels(field, left, right, begin, None if window else top)
        peak: Edge | Barrier | None = None
        if window:
            peak = window[2](begin, height)
        segments.append(Segment(panels, peak))
    return Layer(segments, height)


@lru_cache(maxsize=256)
def highest(drift: Drift, mirrored: bool) -> Fraction:
    """An upper bound of max V over [0, 1], V(-1) = 0 (V(1) = 0 and [-1, 0] if mirrored)."""
    with precision(80):
        layer = layer_of(drift, mirrored, Fraction(-1), Fraction(0))
        base = layer.end
        top = base
        for segment in layer_of(drift, mirrored, Fraction(0), Fraction(1)).segments:
            for panel in segment.panels:
                top = top.max(base + panel.span()[1])
        mantissa, exponent = top.upper().man_exp() if top.is_finite() else (0, math.inf)
        if exponent > _MOST_BITS:
            raise AccuracyError(f"V of {drift} has no proved upper bound; use method='exact'.")
        return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)


def below_its_end(layer: Layer) -> bool:
    """True if V <= V(b) on the whole stretch [a, b], proved.

    On a panel V is below a line and its bend; where that is not enough, V is shown to be monotone,
    so that it is largest at one end: |V'| is at least the line's slope less 4 bend/width.
    """
    end = layer.end
    for segment in layer.segments:
        if isinstance(segment.peak, Edge) and (
            segment.peak.height is end or segment.peak.height <= end
        ):
            # A has one sign in the window.
            continue
        for panel in segment.panels:
            line = panel.height.max(panel.height + panel.slope * panel.width) + panel.bend
            steep = panel.width * abs(panel.slope) > 4 * panel.bend
            tops = [panel.ends[0] if panel.slope < 0 else panel.ends[1]] if steep else [line]
            if not all(top is end or top <= end for top in tops):
                return False
    return True


def _rough_top(field: _Drift, a: Fraction, b: Fraction) -> float:
    """max V - V(a) over [a, b] in float64, by trapezoids."""
    u = np.linspace(float(a), float(b), _SAMPLES)
    slope = -field.floats(u)
    with np.errstate(over="ignore", invalid="ignore"):
        steps = (slope[1:] + slope[:-1]) / 2 * np.diff(u)
        return max(0.0, float(np.cumsum(steps).max()))


def _panels(
    field: _Drift, left: Fraction, right: Fraction, height: arb, top: float | None
) -> tuple[list[LinePanel], Any]:
    """Panels of [left, right], short enough not to reach above `top` by bending."""
    count = max(4, int((right - left) / _WIDEST) + 1)
    step = (right - left) / count
    waiting = [(left + k * step, left + (k + 1) * step) for k in reversed(range(count))]
    panels: list[LinePanel] = []
    while waiting:
        call_context.step()
        lo, hi = waiting.pop()
        center, half = (lo + hi) / 2, (hi - lo) / 2
        h = exact_ball(half)
        ball = flint.arb(exact_ball(center), h.abs_upper())
        wide = field.taylor(ball, field.terms + 1)
        bend = wide[1].abs_upper() * h * h / 2
        if half > _NARROWEST:
            gap = 0.0 if top is None else top - float(height.mid()) - float(abs(wide[0]).mid() * h)
            coarse = top is not None and float(bend.mid()) * 8 > gap
            # What A's Taylor series leaves out has to stay below V's own rounding.
            lost = wide[field.terms] * h ** (field.terms + 1)
            coarse = coarse or not abs(lost) < _LOST
            if not bend.is_finite() or (coarse and len(panels) + len(waiting) < _MOST_PANELS):
                waiting += [(center, hi), (lo, center)]
                continue
        local = field.taylor(exact_ball(center), field.terms)
        rest = flint.arb(0, (wide[field.terms] * h ** (field.terms + 1)).abs_upper())
        down = rest + sum((c * (-h) ** (k + 1) / (k + 1) for k, c in enumerate(local)), rest)
        up = sum((c * h ** (k + 1) / (k + 1) for k, c in enumerate(local)), rest)
        middle = height + down  # V(center) - V(lo) = -int A, which is `down` from the centre
        ends = height, middle - up
        zero = flint.arb(0)  # V need not be monotone
        panels.append(LinePanel(2 * h, middle + local[0] * h, -local[0], bend, ends, zero))
        height = ends[1]
    return panels, height


def _windows(field: _Drift, a: Fraction, b: Fraction) -> list[Any]:
    """(left, right, maker of the peak) of each point where V may be largest."""
    barriers = _rises(field.floats, a, b)
    windows: list[Any] = []
    points = [a, *barriers, b]
    for k, b_hat in enumerate(barriers, start=1):
        before, after = b_hat - points[k - 1], points[k + 1] - b_hat
        room = min(before if k == 1 else before / 2, after if k == len(barriers) else after / 2)
        window = _barrier_window(field, b_hat, room * Fraction(15, 16))
        if window:
            windows.append(window)
    used = sorted((w[0], w[1]) for w in windows)
    first = used[0][0] if used else b
    last = used[-1][1] if used else a
    values = field.profile.value(a), field.profile.value(b)
    # Half of what is free, so that the windows of both ends fit.
    if values[0] > 0:
        window = _edge_window(field, a, (first - a) / 2, 1)
        if window:
            windows.append(window)
    if values[1] < 0:
        window = _edge_window(field, b, (b - last) / 2, -1)
        if window:
            windows.append(window)
    return windows


def _edge_window(field: _Drift, end: Fraction, room: Fraction, side: int) -> Any:
    """A window beside an end that V falls from: Laplace's method with a proved tail bound."""
    slope = abs(field.profile.value(end))
    length = room
    for _ in range(14):
        if length <= 0:
            return None
        bend, parts = flint.arb(0), 16
        for k in range(parts):
            center = end + side * length * Fraction(2 * k + 1, 2 * parts)
            ball = flint.arb(exact_ball(center), exact_ball(length / (2 * parts)).abs_upper())
            value, derivative = field.taylor(ball, 2)
            if not abs(value) > slope / 2:
                break
            bend = bend.max((abs(derivative) / abs(value) ** 3).abs_upper())
        else:
            left, right = (end, end + length) if side > 0 else (end - length, end)

            def made(begin: arb, after: arb, bend: arb = bend) -> Edge:
                """The peak, from V at both ends of the window."""
                high, low = (begin, after) if side > 0 else (after, begin)
                return Edge(high, slope, bend, high - low)

            return left, right, made
        length /= 2
    return None


def _barrier_window(field: _Drift, near: Fraction, room: Fraction) -> Any:
    """A window about a barrier: Laplace's method with proved derivatives."""
    placed = _root(field, near)
    if placed is None:
        return None
    center, gap = placed
    root = flint.arb(exact_ball(center), exact_ball(gap).abs_upper())
    local = field.taylor(root, 3)
    curvature, cubic = local[1] / 2, local[2] / 3
    if not curvature > 0:
        return None
    reach = Fraction(float(room))
    for _ in range(40):
        quartic, parts = flint.arb(0), 16
        for k in range(parts):
            middle = center - reach + reach * Fraction(2 * k + 1, parts)
            ball = flint.arb(exact_ball(middle), exact_ball(reach / parts + gap).abs_upper())
            quartic = quartic.max((field.taylor(ball, 4)[3] / 4).abs_upper())
        r = exact_ball(reach)
        if abs(cubic) * r + quartic * r * r < curvature / 2:
            break
        reach = reach * 3 / 4
    else:
        return None

    def made(begin: arb, after: arb) -> Barrier:
        """The peak, from V at both ends of the window."""
        _, height = _panels(field, center - reach, center, begin, None)
        # V' is 0 at the root: V changes by less than gap^2 |A'| between the centre and there.
        blur = flint.arb(0, (exact_ball(gap) ** 2 * local[1]).abs_upper())
        return Barrier(height + blur, curvature, cubic, quartic, exact_ball(reach), exact_ball(gap))

    return center - reach, center + reach, made


def _rises(floats: Callable[[Any], Any], a: Fraction, b: Fraction) -> list[Fraction]:
    """Zeros of A in (a, b) where it rises, by 64-section in float64."""
    u = np.linspace(float(a), float(b), _SAMPLES)
    values = floats(u)
    crossings = np.flatnonzero((values[:-1] < 0) & (values[1:] >= 0))
    zeros = []
    for k in crossings:
        lo, hi = u[k], u[k + 1]
        for _ in range(10):
            inner = np.linspace(lo, hi, 65)
            first = int(np.argmax(floats(inner) >= 0))
            lo, hi = inner[first - 1], inner[first]
        ball = Fraction(float((lo + hi) / 2))
        if a < ball < b:
            zeros.append(ball)
    return zeros


def _root(field: _Drift, near: Fraction) -> tuple[Fraction, Fraction] | None:
    """A point and a distance within which A changes sign, proved; None if it is no simple zero."""
    x, bits = near, flint.ctx.prec // 2
    for _ in range(8):
        value, slope = field.taylor(exact_ball(x), 2)
        if not slope > 0:
            return None
        mantissa, exponent = (value / slope).mid().man_exp()
        step = Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
        x = Fraction(round((x - step) * 2**bits), 2**bits)
    gap = Fraction(8, 2**bits)
    if field.profile.value(x - gap) < 0 and field.profile.value(x + gap) > 0:
        return x, gap
    return None


# -- panels ----------------------------------------------------------------------------------------


class Bounds(NamedTuple):
    """A positive number lies between these two."""

    low: Any
    high: Any

    def __add__(self, other: Bounds) -> Bounds:  # type: ignore[override]
        return Bounds((self.low + other.low).lower(), (self.high + other.high).upper())


class LinePanel(NamedTuple):
    """V within `bend` of the line from `height` with `slope`, on a stretch of this width.

    `ends` are V there; `steep` is a lower bound of |V'|, at least 0.
    """

    width: Any
    height: Any
    slope: Any
    bend: Any
    ends: tuple[Any, Any]
    steep: Any

    def span(self) -> tuple[Any, Any]:
        """V's lower and upper bound."""
        if self.steep > 0:
            return self.ends[0].min(self.ends[1]), self.ends[0].max(self.ends[1])
        far = self.height + self.slope * self.width
        return self.height.min(far) - self.bend, self.height.max(far) + self.bend


def between_lines(panels: Sequence[LinePanel], lam: Fraction, sign: int) -> Bounds:
    """Bounds of int e^{sign lam V} over the panels; a ratio of e^{2 lam bend} on each."""
    number, size = exact_ball(sign * lam), exact_ball(lam)
    low = high = flint.arb(0)
    for p in panels:
        line = p.width * ball_quotient(number * p.slope * p.width, 1) * (number * p.height).exp()
        bend = (size * p.bend).exp()
        least, most = line / bend, line * bend
        if p.steep > 0 and not size * p.bend < 1:
            # Monotone: between the values at its ends.
            first, last = (number * v for v in p.ends)
            least = least.max(p.width * first.min(last).exp())
            most = most.min(p.width.min(1 / (size * p.steep)) * first.max(last).exp())
        low, high = low + least, high + most
    return Bounds(low.lower().max(flint.arb(0)), high.upper())
