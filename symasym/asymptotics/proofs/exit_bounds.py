"""Two-sided bounds of the exit probability C.

C = sigma_R/(sigma_L + sigma_R), sigma the integrals of e^{lam (V - V(start))} to the right and to
the left of the start (eq:C). Each is enclosed on the segments of
`symasym.asymptotics.proofs.layer_bounds`: between straight lines, and at a barrier or an end by
Laplace's method with its remainder. One scene is computed in balls; arrays (`of_scenes`) in
intervals of float64 (`symasym.numbers.float_intervals`) from the same segments.
"""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import flint
import numpy as np

from symasym.asymptotics.proofs.layer_bounds import (
    Barrier,
    Bounds,
    Edge,
    Layer,
    Segment,
    between_lines,
    layer_of,
)
from symasym.base.errors import AccuracyError
from symasym.base.inputs import IntArray, exact, is_array
from symasym.drift.drift import Drift
from symasym.numbers.arithmetic import Number
from symasym.numbers.balls import (
    exact_ball,
    precision,
    profile_of,
    to_mpf,
)
from symasym.numbers.float_intervals import Compensated, Intervals, log_sum, stacked
from symasym.scenes import Answer, Answers, Request, Scene, Scenes, by_drift, scene_at
from symasym.special.exponentials import ball_quotient

if TYPE_CHECKING:
    from flint import arb

# Bounds further apart say nothing that is worth a number.
_MOST_RATIO = 3
_FLOAT_BITS = 128
_SCENES_AT_ONCE = 256
# Scenes that have their stretches in common, up to which balls are quicker.
_FEW = 24
_TERMS = ("lower and upper bound of the integrals on both sides of the start",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """The middle of two bounds of C (or 1 - C), with half their distance as the error."""
    drift, lam, values, digits = scene.drift, scene.lam, scene.numbers, request.digits
    exponent = int(lam * (1 + values["r"]) * 1024)
    bits = int(digits * 3.33) + 80 + 2 * exponent.bit_length()
    with precision(bits):
        r, x = values["r"], values["start"]
        left, right = (
            _OneSide(drift, mirrored, r, start).in_balls(r, start, lam)
            for mirrored, start in ((True, -x), (False, x))
        )
        wanted, other = (left, right) if request.complement else (right, left)
        low, high = _probability(wanted[0], other[1]), _probability(wanted[1], other[0])
        if not high < _MOST_RATIO * low:
            raise _too_far(scene.noise)
        if request.log:
            low, high = _log(wanted[0], other[1]), _log(wanted[1], other[0])
        middle, radius = to_mpf(low.union(high), digits + 10)
    return Answer(middle, radius, "bound", _TERMS)


def _probability(part: arb, rest: arb) -> Any:
    """part/(part + rest)."""
    return 1 / (1 + rest / part)


def _log(part: arb, rest: arb) -> Any:
    """Its logarithm."""
    return -(rest / part).log1p()


def _too_far(kappa: str) -> AccuracyError:
    """The refusal where the bounds are too far apart to be worth a number."""
    return AccuracyError(
        f"kappa is {kappa}, where the two bounds are more than a factor {_MOST_RATIO} apart: the "
        "layer's barriers or the start are too close to each other or to an end for this noise; "
        "use method='exact'."
    )


# -- one side of the start -------------------------------------------------------------------------


class _OneSide:
    """What lies right of a start x, or in the mirror left of it: for every lam, and r > 1."""

    def __init__(self, drift: Drift, mirrored: bool, r: Fraction, x: Fraction) -> None:
        one, profile = Fraction(1), profile_of(drift)
        profile = profile.mirrored() if mirrored else profile
        self.slopes = [profile.value(side) for side in (-one, one)]
        #: Whether parts of u < -1, of the layer and of u > 1 lie ahead of the start.
        self.before, self.inside, self.after = x <= -1, x < 1, r >= 1
        self.layer: Layer | None = None
        if self.inside:
            self.layer = layer_of(drift, mirrored, max(x, -one), min(r, one))

    def in_balls(self, r: Fraction, x: Fraction, lam: Fraction) -> tuple[Any, Any]:
        """Lower and upper bound of int_x^r e^{lam (V - V(x))}; r < 1 and |x| < 1 are as before."""
        one, factor = Fraction(1), exact_ball(lam)
        height = low = high = exact_ball(Fraction(0))

        def straight(slope: arb, length: Fraction) -> Any:
            """The integral over a stretch of constant drift, and what it adds."""
            fall = -slope * exact_ball(length)
            first = ball_quotient(factor * fall, 1)
            return (factor * height).exp() * exact_ball(length) * first, height + fall

        if x < -1:
            part, height = straight(self.slopes[0], -one - x)
            low, high = low + part, high + part
        if self.layer is not None:
            scale = (factor * height).exp()
            for segment in self.layer.segments:
                below, above = _of_segment(segment, lam)
                low, high = low + scale * below, high + scale * above
            height = height + self.layer.end
        if r > 1:
            part, height = straight(self.slopes[1], r - max(x, one))
            low, high = low + part, high + part
        return low, high

    def in_floats(self, r: Compensated, x: Compensated, lam: Intervals) -> _LogIntegral:
        """The logarithm of the same for many r, x and lam."""
        height = Compensated.of(0.0)
        parts: list[_LogIntegral] = []

        def straight(slope: arb, length: Compensated) -> None:
            """The integral over a stretch of constant drift, and what it adds."""
            nonlocal height
            fall = Compensated.of(slope) * length
            falls = fall.head >= 0
            # From the higher of its two ends.
            size = fall.where(falls, -fall).interval()
            log = length.interval().log() + (lam * size).log_mean_decay()
            parts.append(_LogIntegral(height.where(falls, height - fall), log))
            height = height - fall

        if self.before:
            straight(self.slopes[0], -x - 1.0)
        if self.layer is not None:
            layer = _float_layer(self.layer, lam)
            parts.append(_LogIntegral(height + layer.height, layer.log))
            height = height + self.layer.end
        if self.after:
            straight(self.slopes[1], r - (1.0 if self.inside else x))
        return _added(parts, lam)


def _of_segment(segment: Segment, exactly: Fraction) -> Bounds:
    """int e^{lam V}: by its panels and, where V is largest, by Laplace's method as well."""
    low, high = between_lines(segment.panels, exactly, 1)
    lam = exact_ball(exactly)
    peak = segment.peak
    if peak is None:
        return Bounds(low, high)
    lead, least, most = _by_laplace(peak, lam, lambda ball: ball)
    scale = (lam * peak.height).exp() * lead
    # max and min of balls enclose those of what is in them; a window may be too wide for this lam.
    least, most = scale * least, scale * most
    low = low.max(least) if least.is_finite() else low
    return Bounds(low, high.min(most) if most.is_finite() else high)


def _by_laplace(
    peak: Edge | Barrier, lam: Number, number: Callable[[arb], Any]
) -> tuple[Any, Any, Any]:
    """Laplace's leading term of int e^{lam (V - height)} over a window, and bounds of its share."""
    if isinstance(peak, Edge):
        slope = number(peak.slope)
        lost = number(peak.bend) * slope / lam
        return 1 / (lam * slope), -(-lam * number(peak.fall)).expm1() - lost, 1 + lost
    c, cubic, quartic = number(peak.curvature), number(abs(peak.cubic)), number(peak.quartic)
    reach, gap = number(peak.reach), number(peak.gap)
    lead = (number(flint.arb.pi()) / (lam * c)).sqrt()
    tail = (-lam * c * reach**2).exp() / (lam * c * reach)
    less = c - cubic * reach - quartic * reach**2
    most = (15 * cubic**2 / less + 12 * quartic) / (16 * less**2 * less.sqrt())
    low = 1 - 3 * quartic / (4 * lam * c**2) - (tail + 2 * gap) / lead
    return lead, low, 1 + c.sqrt() * most / lam + 2 * gap / lead


# -- many scenes, in intervals of float64 ----------------------------------------------------------


class _LogIntegral(NamedTuple):
    """The logarithm of an integral of e^{lam V}: lam height + log."""

    height: Compensated
    log: Intervals


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """One analysis of the layer for each drift, radius below 1 and start; vectorised over lam."""
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    ends = np.minimum(r, 1.0), np.clip(start, -1.0, 1.0)
    logs, errors = np.empty(len(r)), np.empty(len(r))
    for one, rows in by_drift(scenes, *ends):
        with np.errstate(all="ignore"), precision(_FLOAT_BITS):
            numbers = scene_at(scenes, rows[0]).numbers
            sides = [
                _OneSide(one, mirrored, numbers["r"], x)
                for mirrored, x in ((True, -numbers["start"]), (False, numbers["start"]))
            ]
            for some in np.split(rows, range(_SCENES_AT_ONCE, len(rows), _SCENES_AT_ONCE)):
                if len(some) > _FEW:
                    log = _float_log(sides, scenes, some, request.complement)
                else:
                    log = _ball_logs(sides, scenes, some, request.complement)
                logs[some] = (log.low + log.high) / 2
                errors[some] = (log - logs[some]).magnitude()
    bad = np.flatnonzero(~(errors < np.log(_MOST_RATIO) / 2))
    if bad.size:
        raise _too_far(scenes.noise(bad[0]))
    return Answers(logs, errors, "bound", _TERMS)


def _ball_logs(
    sides: list[_OneSide], scenes: Scenes, rows: IntArray, complement: bool
) -> Intervals:
    """The same as `_float_log`, scene by scene in balls: quicker for a few."""
    logs = []
    for row in rows:
        scene = scene_at(scenes, row)
        r, x = scene.numbers["r"], scene.numbers["start"]
        left, right = (
            side.in_balls(r, at, scene.lam) for side, at in zip(sides, (-x, x), strict=True)
        )
        wanted, other = (left, right) if complement else (right, left)
        logs.append(_log(wanted[0], other[1]).union(_log(wanted[1], other[0])))
    found = Intervals.column(logs)
    return Intervals(found.low[:, 0], found.high[:, 0])


def _float_log(
    sides: list[_OneSide], scenes: Scenes, rows: IntArray, complement: bool
) -> Intervals:
    """log C = -log(1 + sigma_L/sigma_R) of scenes whose stretches on both sides are `sides`."""
    kappa, r, start = (_read(scenes, name, rows) for name in ("kappa", "r", "start"))
    lam = 2 / kappa.interval() ** 2
    left, right = (
        side.in_floats(r, x, lam) for side, x in zip(sides, (-start, start), strict=True)
    )
    wanted, other = (left, right) if complement else (right, left)
    # Heights are subtracted before lam multiplies them: most of them may cancel.
    ratio = lam * (other.height - wanted.height).interval() + other.log - wanted.log
    return -ratio.log1p_exp()


def _read(scenes: Scenes, name: str, rows: IntArray) -> Compensated:
    """A number of the scenes: the floats of an array, or exactly what was given for all."""
    given = scenes.given[name]
    if is_array(given):
        return Compensated.of(scenes.numbers[name][rows])
    return Compensated.of(exact(name, given))


def _added(parts: list[_LogIntegral], lam: Intervals) -> _LogIntegral:
    """The sum of integrals, from the height of the largest."""
    base, most = parts[0].height, (lam * parts[0].height.head + parts[0].log).high
    for part in parts[1:]:
        size = (lam * part.height.head + part.log).high
        base, most = part.height.where(size > most, base), np.maximum(size, most)
    logs = [part.log + lam * (part.height - base).interval() for part in parts]
    return _LogIntegral(base, log_sum(stacked(logs)))


def _float_layer(layer: Layer, lam: Intervals) -> _LogIntegral:
    """int e^{lam V} over the layer, V from its beginning."""
    tops, falls = [], []
    for panel in (p for segment in layer.segments for p in segment.panels):
        # From the higher of the line's two ends.
        rise = panel.slope * panel.width
        rises = rise.mid() > 0
        tops.append(panel.height + rise if rises else panel.height)
        falls.append(rise if rises else -rise)
    # Of V itself: the lines may rise above it.
    heights = [r.peak.height for r in layer.segments if r.peak] + [layer.end, 0 * layer.end]
    top = max(heights, key=lambda height: float(height.mid()))
    segments, first = [], 0
    for segment in layer.segments:
        part = slice(first, first := first + len(segment.panels))
        decay = lam * Intervals.column(falls[part])
        line = lam * Intervals.column([height - top for height in tops[part]])
        line += Intervals.column([p.width for p in segment.panels]).log() + decay.log_mean_decay()
        bend = (lam * Intervals.column([p.bend for p in segment.panels])).high
        total = log_sum(line + Intervals(-bend, bend))
        if segment.peak is not None:
            lead, least, most = _by_laplace(segment.peak, lam, Intervals.of)
            above = lam * Intervals.of(segment.peak.height - top) + lead.log()
            total = Intervals(
                np.maximum(total.low, (above + least.log()).low),
                np.minimum(total.high, (above + most.log()).high),
            )
        segments.append(total)
    return _LogIntegral(Compensated.of(top), log_sum(stacked(segments)))
