"""Two-sided bounds of the exit probability, and the paper's upper bound with its condition."""

from __future__ import annotations

from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.asymptotics.proofs.layer_bounds import Barrier, Edge, Layer, Region, layer_of
from symasym.asymptotics.proofs.panels import Bounds, between_lines
from symasym.base.contexts import mpf_of, own_context
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray, float_text
from symasym.drift.drift import Drift
from symasym.drift.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    by_drift,
    input_rounding,
    rows_of,
    scene_at,
)
from symasym.drift.taylor_field import ExactField
from symasym.numbers.arithmetic import Number
from symasym.numbers.balls import exact_ball, flint_module, precision, profile_of
from symasym.special.exponentials import ball_quotient, log_quotient

if TYPE_CHECKING:
    from flint import arb
    from mpmath.ctx_mp import MPContext

# Bounds further apart say nothing that is worth a number.
_MOST_RATIO = 3
_UNIT = 1e-15
_PAPER_TERMS = ("eq:C, C-bound",)
_PAPER_NOTE = ("C lies between 0 and the value",)
_TERMS = ("lower and upper bound of the integrals on both sides of the start",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """The middle of two bounds of C (or 1 - C), with half their distance as the error."""
    drift, lam, values, digits = scene.drift, scene.lam, scene.numbers, request.digits
    exponent = int(lam * (1 + values["r"]) * 1024)
    bits = int(digits * 3.33) + 80 + 2 * exponent.bit_length()
    flint_module()
    with precision(bits):
        left = _side(drift, True, values["r"], -values["start"], lam)
        right = _side(drift, False, values["r"], values["start"], lam)
        wanted, other = (left, right) if request.complement else (right, left)
        low, high = _probability(wanted[0], other[1]), _probability(wanted[1], other[0])
        if not high < _MOST_RATIO * low:
            raise _too_far(scene.noise)
        if request.log:
            low, high = _log(wanted[0], other[1]), _log(wanted[1], other[0])
        from symasym.numbers import balls

        middle, radius = balls.to_mpf(low.union(high), digits + 10)
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


# -- one scene, in balls ---------------------------------------------------------------------------


def _side(drift: Drift, mirrored: bool, r: Fraction, x: Fraction, lam: Fraction) -> tuple[Any, Any]:
    """Lower and upper bound of int_x^r e^{lam (V - V(x))}."""
    profile = profile_of(drift)
    profile = profile.mirrored() if mirrored else profile
    one, factor = Fraction(1), exact_ball(lam)
    height = low = high = exact_ball(Fraction(0))

    def outer(side: int, length: Fraction) -> Any:
        """The integral over a stretch of constant drift, and what it adds."""
        fall = -profile.value(Fraction(side)) * exact_ball(length)
        first = ball_quotient(factor * fall, 1)
        return (factor * height).exp() * exact_ball(length) * first, height + fall

    if x < -1:
        part, height = outer(-1, -one - x if r > 1 else r - x)
        low, high = low + part, high + part
    if x < 1:
        layer = layer_of(drift, mirrored, max(x, -one), min(r, one))
        scale = (factor * height).exp()
        for region in layer.regions:
            below, above = _region(region, lam)
            low, high = low + scale * below, high + scale * above
        height = height + layer.end
    if r > 1:
        part, height = outer(1, r - max(x, one))
        low, high = low + part, high + part
    return low, high


def _region(region: Region, exactly: Fraction) -> Bounds:
    """int e^{lam V}: by its panels and, where V is largest, by Laplace's method as well."""
    low, high = between_lines(region.panels, exactly, 1)
    lam = exact_ball(exactly)
    peak = region.peak
    if peak is None:
        return Bounds(low, high)
    lead, least, most = _by_laplace(peak, lam, _Balls())
    scale = (lam * peak.height).exp() * lead
    # max and min of balls enclose those of what is in them.
    return Bounds(low.max(scale * least), high.min(scale * most))


def _by_laplace(
    peak: Edge | Barrier, lam: Number, numbers: _Balls | _Floats
) -> tuple[Any, Any, Any]:
    """Laplace's leading term of int e^{lam (V - height)} over a window, and bounds of its share."""
    number, above = numbers.number, numbers.above
    if isinstance(peak, Edge):
        slope, bend = number(peak.slope), above(peak.bend)
        lost = bend * slope / lam
        return 1 / (lam * slope), -numbers.expm1(-lam * number(peak.fall)) - lost, 1 + lost
    c, cubic, quartic = number(peak.curvature), above(abs(peak.cubic)), above(peak.quartic)
    reach, gap = number(peak.reach), above(peak.gap)
    lead = numbers.sqrt(numbers.pi / (lam * c))
    tail = numbers.exp(-lam * c * reach**2) / (lam * c * reach)
    less = c - cubic * reach - quartic * reach**2
    most = (15 * cubic**2 / less + 12 * quartic) / (16 * less**2 * numbers.sqrt(less))
    low = 1 - 3 * quartic / (4 * lam * c**2) - (tail + 2 * gap) / lead
    return lead, low, 1 + numbers.sqrt(c) * most / lam + 2 * gap / lead


class _Balls:
    """What `_by_laplace` asks of numbers; a ball's upper end is the ball's own business."""

    def __init__(self) -> None:
        self.pi = flint_module().arb.pi()

    def number(self, x: Number) -> Any:
        return x

    above = number

    def sqrt(self, x: Number) -> Any:
        return x.sqrt()

    def exp(self, x: Number) -> Any:
        return x.exp()

    def expm1(self, x: Number) -> Any:
        return x.expm1()


class _Floats:
    """The same in float64."""

    pi, number = np.pi, float
    sqrt, exp, expm1 = np.sqrt, np.exp, np.expm1

    @staticmethod
    def above(x: arb) -> float:
        return float(np.nextafter(float(x.upper()), np.inf))


# -- many scenes, in float64 -----------------------------------------------------------------------


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """One analysis of the layer for each drift, radius below 1 and start; vectorised over lam."""
    flint_module()
    r, start = scenes.numbers["r"], scenes.numbers["start"]
    ends = np.minimum(r, 1.0), np.clip(start, -1.0, 1.0)
    logs, errors = np.empty(len(r)), np.empty(len(r))
    steepest = np.zeros(len(r))
    for one, rows in by_drift(scenes, *ends):
        with np.errstate(all="ignore"):
            steepest[rows] = np.abs(one.evaluate_float(np.linspace(-1, 1, 65))).max()
            left, right = (
                _float_side(one, side < 0, r[rows], side * start[rows], scenes.lam[rows])
                for side in (-1, 1)
            )
            wanted, other = (left, right) if request.complement else (right, left)
            # log C = -log(1 + sigma_L/sigma_R); the ends of the one from opposite ends of both.
            ratios = other[[1, 0]] - wanted
            ends_of_log = -np.logaddexp(0.0, ratios[:2])
            rounding = _UNIT * 8 * (8 + np.abs(other).max(axis=0) + np.abs(wanted).max(axis=0))
            rounding = rounding + input_rounding(rows_of(scenes, rows), steepest[rows])
        logs[rows] = ends_of_log.mean(axis=0)
        errors[rows] = (ends_of_log[1] - ends_of_log[0]) / 2 + rounding
    bad = np.flatnonzero(~(errors < np.log(_MOST_RATIO) / 2))
    if bad.size:
        raise _too_far(scenes.noise(bad[0]))
    return Answers(logs, errors, "bound", _TERMS)


def _float_side(
    drift: Drift, mirrored: bool, r: FloatArray, x: FloatArray, lam: FloatArray
) -> FloatArray:
    """Logarithms of both bounds of int_x^r e^{lam (V - V(x))}; r < 1 and x inside are the same."""
    low = max(Fraction(float(np.clip(x[0], -1, 1))), Fraction(-1))
    high = min(Fraction(float(r[0])), Fraction(1))
    sign = -1 if mirrored else 1
    slopes = [sign * float(e) for e in drift.ends[::sign]]
    height = np.zeros_like(lam)
    parts = []

    def outer(a: float, length: FloatArray) -> None:
        """The integral over a stretch of constant drift, and what it adds."""
        nonlocal height
        size = np.maximum(length, 0.0)
        y = -lam * a * size
        parts.append(np.tile(lam * height + np.log(size) + log_quotient(y), (2, 1)))
        height = height - a * size

    outer(slopes[0], np.minimum(-1.0, r) - x)
    if low < high:
        with precision(128):
            layer = layer_of(drift, mirrored, low, high)
            parts.append(_float_layer(layer, lam) + lam * height)
            height = height + float(layer.end)
    outer(slopes[1], (r - np.maximum(x, 1.0)) * (r > 1))
    return (
        np.logaddexp(np.logaddexp(parts[0], parts[1]), parts[-1])
        if len(parts) == 3
        else (np.logaddexp(parts[0], parts[-1]))
    )


def _float_layer(layer: Layer, lam: FloatArray) -> FloatArray:
    """Logarithms of the lower and the upper bound over the layer, V from its beginning."""
    totals = []
    for region in layer.regions:
        panels = [
            (float(p.width), float(p.height), float(p.slope), _Floats.above(p.bend))
            for p in region.panels
        ]
        width, start, slope, bend = np.array(panels).T[:, :, None]
        line = lam * start + np.log(width) + log_quotient(lam * slope * width)
        bounds = [np.logaddexp.reduce(line + s * lam * bend, axis=0) for s in (-1.0, 1.0)]
        if region.peak is not None:
            lead, least, most = _by_laplace(region.peak, lam, _Floats())
            top = lam * float(region.peak.height) + np.log(lead)
            bounds = [
                np.fmax(bounds[0], top + np.log(least)),
                np.fmin(bounds[1], top + np.log(most)),
            ]
        totals.append(np.array(bounds))
    logs: FloatArray = np.logaddexp.reduce(np.array(totals), axis=0)
    return logs


# -- the paper's bound -----------------------------------------------------------------------------


def paper_bound(scene: Scene, request: Request) -> Answer:
    """The bound of the paper's section 6.2, 2 a- (1/a+ + 2/kappa^2) e^{-r a-/kappa^2}.

    Of C for a drift to the right, and mirrored of 1 - C for one to the left. What
    the derivation ``C-bound`` needs is checked: start 0, r >= 4, V <= a- r/4 on
    [0, 1] and e^{3 a- r/(2 kappa^2)} >= 4. It lies between 0 and the value, which is
    the error; its logarithm has none.
    """
    with own_context(request.digits + 15) as context:
        value = _paper_log(scene, request.complement, context)
        if request.log:
            return Answer(value, None, "none", _PAPER_TERMS, _PAPER_NOTE)
        with context.workprec(context.prec + max(0, int(context.mag(value)))):
            value = context.exp(_paper_log(scene, request.complement, context))
        return Answer(value, value, "bound", _PAPER_TERMS, _PAPER_NOTE)


def paper_bounds(scenes: Scenes, request: Request) -> Answers:
    """The same for many: the condition in exact arithmetic, scene by scene."""
    logs = np.empty(len(scenes.lam))
    with own_context(25) as context:
        for one, rows in by_drift(scenes):
            for row in rows:
                scene = scene_at(scenes, row)._replace(drift=one)
                logs[row] = float(_paper_log(scene, request.complement, context))
    if request.log:
        return Answers(logs, None, "none", _PAPER_TERMS, _PAPER_NOTE)
    # As wide as the value itself: from 0 to it.
    errors = np.log(2.0) + 4 * _UNIT * (1 + np.abs(logs))
    return Answers(logs, errors, "bound", _PAPER_TERMS, _PAPER_NOTE)


def _paper_log(scene: Scene, complement: bool, context: MPContext) -> Any:
    """The logarithm of the bound of eq:C (derivation C-bound), where its conditions hold."""
    from symasym.base.errors import InputError, RegionError

    drift, values = scene.drift, scene.numbers
    if values["start"] != 0:
        raise InputError(
            f"start is {float_text(values['start'])}; the paper's bound is for start 0, use "
            "method='bound' or 'exact'."
        )
    field = ExactField(drift, complement, context)
    a_minus, a_plus = (field.value(Fraction(side)) for side in (-1, 1))
    if not (a_minus > 0 and a_plus > 0):
        name, sign = ("1 - C", "negative") if complement else ("C", "positive")
        raise RegionError(
            f"a- = {float(drift.ends[0]):.6g} and a+ = {float(drift.ends[1]):.6g} are not both "
            f"{sign}, where alone the paper bounds {name}; use method='bound' or 'exact'."
        )
    kappa, r = values["kappa"], values["r"]
    if r < 4:
        raise InputError(
            f"r is {float_text(r)}; the paper's bound is for r of at least 4, use method='bound' "
            "or 'exact'."
        )
    top = _highest(drift, complement)
    if not top <= a_minus * r / 4:
        raise InputError(
            f"V reaches {float(top):.6g} between the start and the layer's edge, more than "
            f"a- r/4 = {float_text(a_minus * r / 4)}, where the paper's bound may fail; use a "
            "larger r, or method='bound' or 'exact'."
        )

    def number(x: Fraction) -> Any:
        return mpf_of(x, context)

    rate = number(a_minus * r / kappa**2)
    if not rate * 3 / 2 >= context.log(4):
        raise InputError(
            f"kappa is {float_text(kappa)}, so that exp(3 a- r/(2 kappa^2)) is below 4, where the "
            "paper's bound may fail; use method='bound' or 'exact'."
        )
    return context.log(number(2 * a_minus * (1 / a_plus + 2 / kappa**2))) - rate


@lru_cache(maxsize=256)
def _highest(drift: Drift, mirrored: bool) -> Fraction:
    """An upper bound of max V over [0, 1], V(-1) = 0 (V(1) = 0 and [-1, 0] if mirrored)."""
    flint_module()
    with precision(80):
        layer = layer_of(drift, mirrored, Fraction(-1), Fraction(0))
        base = layer.end
        top = base
        for region in layer_of(drift, mirrored, Fraction(0), Fraction(1)).regions:
            for panel in region.panels:
                end = panel.height + panel.slope * panel.width
                top = top.max(base + panel.height.max(end) + panel.bend)
        mantissa, exponent = top.upper().man_exp()
        return Fraction(int(mantissa)) * Fraction(2) ** int(exponent)
