"""The paper's own leading-order formulas, as printed (``method="paper"``).

T is eq:Ttildesmall with the step eq:S, which is eq:Ttildelarge where there is no well; C the bound
of section 6.2 (C-bound); P the leading term of eq:Plarge2 where that is below 1, else the lower
bound behind eq:Psmall2 (L-bound). None but the bounds claims an error.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of, own_context
from symasym.base.errors import AccuracyError, InputError, RegionError
from symasym.base.estimate import ErrorKind
from symasym.base.inputs import BeyondFloat, FloatArray, IntArray, exact, float_text, is_array
from symasym.drift.drift import Drift
from symasym.generated import mpmath_formulas, numpy_formulas
from symasym.numbers import balls
from symasym.numbers.polynomials import bracketed_zero
from symasym.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    by_drift,
    exponent_bits,
    scene_at,
)

if TYPE_CHECKING:
    from flint import arb
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

    from symasym.drift.field.float_field import Field
    from symasym.drift.field.taylor_field import ExactField


_EXIT_TERMS = ("eq:C, C-bound",)
_EXIT_NOTE = ("C lies between 0 and the value",)


def of_scene(scene: Scene, request: Request) -> Answer:
    """T, C or P of one scene, as the paper has it.

    The paper's assumptions are checked. For T: a crossing region, and no zero of A in (-1, 1) or
    exactly two, a well before a barrier in the direction of the crossing. The well counts if the
    barrier lies beyond the start, u = 0.
    """
    if request.name[-1] == "P":
        return _occupation(scene, request)
    if request.name[-1] == "C":
        return _exit_bound(scene, request)
    _require_start_0(scene.numbers["start"])
    return Answer(_escape_time(scene, request), None, "none")


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """The same for many; each occupation by itself."""
    if request.name[-1] == "C":
        return _exit_bounds(scenes, request)
    if request.name == "T":
        given, read = scenes.given["start"], scenes.numbers["start"]
        starts = read[read != 0][:1] if is_array(given) else [exact("start", given)]
        for start in starts:
            _require_start_0(Fraction(start))
        return Answers(_log_escape_times(scenes), None, "none")
    request = request._replace(log=True, full=False)
    each = (_occupation(scene_at(scenes, row), request) for row in range(len(scenes.lam)))
    return Answers(np.array([float(one.value) for one in each]), None, "none")


def _require_start_0(start: Fraction) -> None:
    """Refuse a start other than 0."""
    if start != 0:
        raise InputError(
            f"start is {float_text(start)}; the paper's formula is for start 0, use method='exact'."
        )


def _refuse_region(*ends: float | Fraction) -> None:
    """The error that the drift of these a- and a+ does not cross."""
    a_minus, a_plus = (float_text(Fraction(a)) for a in ends)
    raise RegionError(
        f"a- = {a_minus} and a+ = {a_plus} are no crossing region, where "
        "the paper gives no escape time; use method='exact'."
    )


def _refuse_zeros(count: int) -> None:
    """The error that A has other zeros than those of one well and one barrier."""
    raise InputError(
        f"A has {count} zeros in (-1, 1), but the paper's formula is for none, or for one well "
        "followed by one barrier; use method='exact'."
    )


def _well_counts(u1: mpf, u2: mpf) -> bool:
    """The paper's condition for its multiplier to be 1: -1 < u1 < u2 < 1 and u2 > 0."""
    return bool(u1 < u2 and u2 > 0)


@dataclass(frozen=True)
class Well:
    """The quantities of eq:Ttildesmall for a drift that crosses, in the direction it goes.

    Attributes
    ----------
    ahead : mpf
        The drift beyond the layer, positive.
    slopes : tuple of mpf
        A' at the well and at the barrier, where the multiplier eq:S is 1.
    barrier : mpf or None
        V(u2) - V(u1); None where it is 0.
    """

    ahead: mpf
    slopes: tuple[mpf, ...] = ()
    barrier: mpf | None = None


def well(drift: Drift, context: MPContext) -> Well:
    """The well before a barrier beyond the start, if there is one, at the context's precision.

    Raises
    ------
    RegionError
        If the drift does not cross.
    InputError
        If A has other zeros than those of one well and one barrier.
    """
    from symasym.drift.field.taylor_field import ExactField

    a_minus, a_plus = drift.ends
    if a_minus * a_plus <= 0:
        _refuse_region(a_minus, a_plus)
    down = a_plus < 0
    points = [p for p in drift.critical_points() if p.multiplicity % 2]
    if down:
        points = points[::-1]
    if len(points) not in (0, 2) or [p.kind for p in points] not in ([], ["well", "barrier"]):
        _refuse_zeros(len(points))
    field = ExactField(drift, down, context)
    ahead = mpf_of(field.value(Fraction(1)), context)
    if points:
        u1, u2 = (field.polish(-p.u if down else p.u) for p in points)
        if _well_counts(u1, u2):
            return Well(ahead, (field.slope(u1), field.slope(u2)), field.potential_rise(u1, u2))
    return Well(ahead)


def _escape_time(scene: Scene, request: Request) -> mpf:
    """T, or its logarithm, to a few more digits than are asked for."""
    with own_context(request.digits + 15) as context:
        with context.workprec(context.prec + exponent_bits(scene.drift, scene.lam, scene.r)):
            crossing = well(scene.drift, context)
            radius, noise = (mpf_of(scene.numbers[name], context) for name in ("r", "kappa"))
            if crossing.barrier is None:
                total = mpmath_formulas.strong_noise_time(context, radius, crossing.ahead)
            else:
                low, high = crossing.slopes
                total = mpmath_formulas.weak_noise_time(
                    context, noise, radius, crossing.ahead, low, high, crossing.barrier
                )
        return context.log(total) if request.log else total


def _log_escape_times(scenes: Scenes) -> FloatArray:
    """log T of scenes in float64."""
    from symasym.drift.field.float_field import field_of

    drift = scenes.drift
    k, radius = (scenes.numbers[name].reshape(scenes.shape) for name in ("kappa", "r"))
    # The landscape depends on the drift alone: find it once per drift, not per point.
    own = drift.shape
    count = int(np.prod(own, dtype=int))
    values = {
        n: np.broadcast_to(v, own).ravel() if is_array(v) else v for n, v in drift.values.items()
    }
    field = field_of(drift, values, count)
    if np.isnan(field.a_minus + field.a_plus).any():
        raise BeyondFloat("the drift is beyond the range of float64; pass dps=… for it.")
    for bad in np.flatnonzero(np.sign(field.a_minus) * np.sign(field.a_plus) <= 0):
        _refuse_region(field.a_minus[bad % count], field.a_plus[bad % count])
    scene = np.where(field.a_plus[:count] > 0, 0, count) + np.arange(count)
    u1, u2, number = _well_and_barrier(field, scene)
    for bad in number[(number != 0) & (number != 2)]:
        _refuse_zeros(int(bad))
    well = np.flatnonzero((number == 2) & (u2 > 0))
    # Any slopes will do where no well counts.
    low, high, rise = -np.ones(count), np.ones(count), np.full(count, -np.inf)
    if well.size:
        low[well], high[well] = (field.taylor(scene[well], u[well])[0][:, 1] for u in (u1, u2))
        rise[well] = _rise(field, scene[well], u1[well], u2[well])
    well_time = numpy_formulas.log_well_term(k, *(x.reshape(own) for x in (low, high, rise)))
    flight = np.log(numpy_formulas.strong_noise_time(radius, field.a_plus[scene].reshape(own)))
    total: FloatArray = np.logaddexp(well_time, flight)
    return total.ravel()


def _well_and_barrier(field: Field, scene: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """First two zeros of A inside (-1, 1), and how many there are, for each scene."""
    from symasym.drift.field.float_field import extremes

    marks = extremes(field, scene)
    n = len(scene)
    edges = np.concatenate((np.full((n, 1), -1.0), marks, np.ones((n, 1))), axis=1)
    owner = np.repeat(scene, edges.shape[1])
    values = field.taylor(owner, edges.ravel())[0][:, 0].reshape(edges.shape)
    # A is monotone between neighbouring marks, so a change of sign brackets one zero.
    change = values[:, :-1] * values[:, 1:] < 0
    number = change.sum(axis=1)
    zeros = np.full((n, 2), np.nan)
    for which in range(2):
        rows = np.flatnonzero(number > which)
        if not rows.size:
            continue
        column = np.argmax(np.cumsum(change[rows], axis=1) == which + 1, axis=1)
        lo, hi = edges[rows, column], edges[rows, column + 1]
        zeros[rows, which] = _bracketed(
            partial(_phi_at, field, scene[rows]),
            lo,
            hi,
            values[rows, column] > 0,
        )
    return zeros[:, 0], zeros[:, 1], number


def _phi_at(field: Field, scene: IntArray, u: FloatArray) -> FloatArray:
    """phi of each scene at its own u."""
    result: FloatArray = field.phi(scene, u[:, None])[:, 0]
    return result


def _bracketed(
    function: Callable[[FloatArray], FloatArray],
    lo: FloatArray,
    hi: FloatArray,
    positive_low: np.ndarray[Any, np.dtype[np.bool_]],
) -> FloatArray:
    """The zeros between lo and hi, by bisection; the sign at lo is given."""
    for _ in range(60):
        middle = (lo + hi) / 2
        same = (function(middle) > 0) == positive_low
        lo, hi = np.where(same, middle, lo), np.where(same, hi, middle)
    return (lo + hi) / 2


def _rise(field: Field, scene: IntArray, lo: FloatArray, hi: FloatArray) -> FloatArray:
    """V(hi) - V(lo) by Gauss-Legendre."""
    x, w = np.polynomial.legendre.leggauss(16)
    panels = 8
    offsets = ((np.arange(panels)[:, None] + (x + 1) / 2) / panels).ravel()
    weights = np.tile(w / 2 / panels, panels)
    values = field.phi(scene, lo[:, None] + (hi - lo)[:, None] * offsets)
    result: FloatArray = -(hi - lo) * (values @ weights)
    return result


def _exit_bound(scene: Scene, request: Request) -> Answer:
    """The bound of the paper's section 6.2, 2 a- (1/a+ + 2/kappa^2) e^{-r a-/kappa^2}.

    Of C for a drift to the right, and mirrored of 1 - C for one to the left. What
    the derivation ``C-bound`` needs is checked: start 0, r >= 4, V <= a- r/4 on
    [0, 1] and e^{3 a- r/(2 kappa^2)} >= 4. It lies between 0 and the value, which is
    the error; its logarithm has none.
    """
    log, value = (
        balls.to_mpf(ball, request.digits + 10)[0] for ball in _exit_value(scene, request)
    )
    if request.log:
        return Answer(log, None, "none", _EXIT_TERMS, _EXIT_NOTE)
    # C lies between 0 and the bound: between 0 and twice its middle, whatever that was rounded to.
    return Answer(value, value, "bound", _EXIT_TERMS, _EXIT_NOTE)


def _exit_bounds(scenes: Scenes, request: Request) -> Answers:
    """The same for many, scene by scene."""
    logs = np.empty(len(scenes.lam))
    for one, rows in by_drift(scenes):
        for row in rows:
            scene = scene_at(scenes, row)._replace(drift=one)
            logs[row] = float(_exit_value(scene, request)[0].mid())
    if request.log:
        return Answers(logs, None, "none", _EXIT_TERMS, _EXIT_NOTE)
    # From 0 to twice the value, which is more than what rounding changes in the logarithm.
    errors = np.log(2.0) + 4e-15 * (1 + np.abs(logs))
    return Answers(logs, errors, "bound", _EXIT_TERMS, _EXIT_NOTE)


def _exit_value(scene: Scene, request: Request) -> tuple[arb, arb]:
    """Balls of the bound of eq:C (C-bound) and its logarithm, where its conditions are proved."""
    from symasym.expansions.balls import top_of

    drift, values, complement = scene.drift, scene.numbers, request.complement
    if values["start"] != 0:
        raise InputError(
            f"start is {float_text(values['start'])}; the paper's bound is for start 0, use "
            "method='bound' or 'exact'."
        )
    kappa, r = values["kappa"], values["r"]
    profile = balls.profile_of(drift)
    profile = profile.mirrored() if complement else profile
    exponent = exponent_bits(drift, scene.lam, r)
    with balls.precision(int(request.digits * 3.33) + 90 + exponent):
        a_minus, a_plus = (profile.value(Fraction(side)) for side in (-1, 1))
        if not (a_minus > 0 and a_plus > 0):
            name, sign = ("1 - C", "negative") if complement else ("C", "positive")
            low, high = (float_text(Fraction(a)) for a in drift.ends)
            raise RegionError(
                f"a- = {low} and a+ = {high} are not both {sign}, where alone the paper bounds "
                f"{name}; use method='bound' or 'exact'."
            )
        if r < 4:
            raise InputError(
                f"r is {float_text(r)}; the paper's bound is for r of at least 4, use "
                "method='bound' or 'exact'."
            )
        radius, noise = balls.exact_ball(r), balls.exact_ball(kappa)
        top = top_of(drift, complement, Fraction(0), Fraction(1), -Fraction(1))
        if not top <= a_minus * radius / 4:
            raise InputError(
                f"V reaches {float(top):.6g} between the start and the layer's edge, more than "
                f"a- r/4 = {float((a_minus * radius / 4).mid()):.6g}, where the paper's bound may "
                "fail; use a larger r, or method='bound' or 'exact'."
            )
        if not (3 * a_minus * radius / (2 * noise**2)).exp() >= 4:
            raise InputError(
                f"kappa is {float_text(kappa)}, so that exp(3 a- r/(2 kappa^2)) is below 4, where "
                "the paper's bound may fail; use method='bound' or 'exact'."
            )
        value = mpmath_formulas.exit_bound(balls.BallContext(), noise, radius, a_minus, a_plus)
        return value.log(), value


def _occupation(scene: Scene, request: Request) -> Answer:
    """P, 1 - P or a logarithm: of kind ``"bound"`` where it is one of P, with the error 1 - P."""
    with own_context(request.digits + 15) as context:
        a_minus, a_plus = (mpf_of(Fraction(x), context) for x in scene.drift.ends)
        noise = mpf_of(scene.numbers["kappa"], context)
        share = mpmath_formulas.strong_noise_occupation(context, noise, a_minus, a_plus)
        kind: ErrorKind = "none"
        if share >= 1:
            share, kind = _lower_bound(scene, request.digits, request.full, context)
        value = 1 - share if request.complement else share
        error = 1 - share
        if request.log:
            # log(1 - P) has no lower bound.
            kind = "none" if request.complement else kind
            error, value = -context.log(share), context.log(value)
        if kind == "none":
            return Answer(value, None, kind)
        # What rounding here leaves between the value's other end and the truth.
        error += (1 + abs(value)) * context.mpf(10) ** -(request.digits + 5)
        return Answer(value, error, kind)


def _lower_bound(
    scene: Scene, digits: int, full: bool, context: MPContext
) -> tuple[mpf, ErrorKind]:
    """The unlabelled bound before eq:Psmall2, with the largest L that the drift allows.

    Where the error is asked for, it is a bound if balls show it, and an estimate elsewhere.
    """
    from symasym.drift.field.taylor_field import ExactField

    drift, kappa = scene.drift, scene.numbers["kappa"]
    field = ExactField(drift, False, context)
    top = field.potential_rise(context.mpf(-1), context.mpf(1))
    mirrored = bool(top > 0)
    if mirrored:
        # V(1) > 0: the same in the mirrored variable, whose V at the right end is -V(1).
        field, top = ExactField(drift, True, context), -top
    # A little less than it is found to be, so that V stays below V(1) by more than rounding.
    length = _stays_below(drift, field, context) * (1 - context.mpf(10) ** -(digits + 6))
    # As many digits of 1 - P, which is kappa^2 in size.
    with context.workprec(context.prec + exponent_bits(drift, scene.lam, Fraction(1))):
        a_minus, a_plus = (mpf_of(field.value(Fraction(x)), context) for x in (-1, 1))
        noise = mpf_of(kappa, context)
        share = mpmath_formulas.occupation_bound(context, noise, a_minus, a_plus, length, top)
    if full and _proved(scene, mirrored, exact("L", length), exact("P", share)):
        return share, "bound"
    return share, "estimate"


def _proved(scene: Scene, mirrored: bool, length: Fraction, share: Fraction) -> bool:
    """True if V <= V(1) for 1 - length <= u <= 1, and the bound is at least share^2.

    So is 2 share - 1: claims of P and of log P that reach from 1 to twice as far as `share` hold.
    """
    from symasym.expansions.balls import top_of

    drift, bits = scene.drift, share.denominator.bit_length()
    one = Fraction(1)
    profile = balls.profile_of(drift)
    profile = profile.mirrored() if mirrored else profile
    with balls.precision(128 + 2 * bits):
        if not top_of(drift, mirrored, one - length, one, one) <= 0:
            return False
        top = top_of(drift, mirrored, one, one, -one)
        a_minus, a_plus = profile.value(-one), profile.value(one)
        noise, reach = balls.exact_ball(scene.numbers["kappa"]), balls.exact_ball(length)
        bound = mpmath_formulas.occupation_bound(
            balls.BallContext(), noise, a_minus, a_plus, reach, top
        )
        return bool(bound >= balls.exact_ball(share**2))


def _stays_below(drift: Drift, field: ExactField, context: MPContext) -> mpf:
    """The largest L with V(u) <= V(1) for 1 - L <= u <= 1, where V(1) <= V(-1)."""
    side = -1 if field.mirrored else 1
    barriers = sorted(field.polish(side * p.u) for p in drift.barriers())
    wells = sorted(field.polish(side * p.u) for p in drift.wells())
    one = context.one
    peaks = [-one, *(b for b in barriers if field.potential_rise(b, one) < 0)]
    high = peaks[-1]
    low = min((w for w in wells if w > high), default=None)
    if low is None:
        raise AccuracyError(
            "a well of A is too close to an end to be told from it, so the paper's bound is not "
            "known; rescale the problem."
        )
    # V falls from its highest point left of 1 to this well, and crosses V(1) once.
    if field.potential_rise(high, one) >= 0:
        return one - high

    def fall(u: mpf) -> tuple[mpf, mpf]:
        """V(1) - V(u) and its slope."""
        return field.potential_rise(u, one), field.number(u)

    return one - bracketed_zero(fall, high, low, context)
