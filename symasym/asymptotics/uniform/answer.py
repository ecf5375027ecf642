"""Weak noise through the coalescence of wells, barriers and ends: T by uniform approximation.

Laplace's sums (`symasym.asymptotics.weak_noise.compose`) with coalescing critical points taken
together: a well and the barrier next to it, also beyond the coalescence, where they are complex
(`.coalescing_pair`: the canonical Airy form of Chester, Friedman and Ursell), and each of them with
the start and with the ends of the layer (`.truncated_gaussian`: Bleistein). Their own series stay
below the sum, in the places and in the regular part; the singular terms cancel there, for which
digits are added beforehand, so that nothing is lost beside a coalescence. Order 0 of polynomial A
has closed forms in which nothing cancels (`.order_zero`), for arrays and for any number of digits.

At one lam critical points, pairs, truncations and the regular part are added up by `sides_at` and
`whole_at`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.asymptotics.coalescence.cubic_map import truncation as cut_off
from symasym.asymptotics.uniform.coalescing_pair import (
    Airy,
    CanonicalPair,
    LayerPart,
    OneSide,
    airy,
    coalescing_pairs,
    lost_digits,
    parabola,
    place_at,
    windows,
    zeros_of,
)
from symasym.asymptotics.uniform.majorant_error import allowed, allowed_of_whole
from symasym.asymptotics.uniform.order_zero import SAFETY, closed_form
from symasym.asymptotics.uniform.order_zero import escape_time as in_float
from symasym.asymptotics.uniform.pairing_arrays import paired_of
from symasym.asymptotics.uniform.truncated_gaussian import (
    Corrections,
    Truncation,
    Truncations,
    corrections,
    truncations_at,
    truncations_of,
)
from symasym.asymptotics.weak_noise.arrays import logs_of, own_shapes, rounding_of_places
from symasym.asymptotics.weak_noise.compose import (
    Exponential,
    Nodes,
    Side,
    Sides,
    mean_time,
    plain,
    regular_part,
    scale_contributions,
)
from symasym.asymptotics.weak_noise.critical_points import barriers, whole
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.regular_part import require_resolved
from symasym.asymptotics.weak_noise.series import BEYOND, Point, terms
from symasym.base.call_context import kept, mpf_of, own_context, step
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.field.float_field import IntArray
from symasym.drift.field.taylor_field import ExactField
from symasym.numbers.arithmetic import Digits
from symasym.scenes import (
    Answer,
    Answers,
    Request,
    Scene,
    Scenes,
    by_drift,
    rows_of,
    working_digits,
)

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["Member", "corrected", "of_scene", "of_scenes", "sides_at", "whole_at"]

# Of lam, where the next terms are looked at.
_BESIDE = (1, 0.8, 0.64)
DROPPED = ("higher orders of every series, in the error",)
_TERMS = ("wells, barriers, start, ends, kinks and the regular part",)


def of_scene(asked: Scene, request: Request) -> Answer:
    """T, or 1 - P and P; by the method ``"local"`` with the fold's own Airy functions."""
    if request.name[-1] == "P":
        return _occupation(asked, request)
    known = _times(asked.drift, asked.r, asked.start, [asked.numbers["kappa"]], request)
    return _handed(request, *next(known))


def _times(
    drift: Drift, r: Fraction, x: Fraction, kappas: list[Fraction], request: Request
) -> Iterator[tuple[Any, Any, tuple[str, ...], Any]]:
    """T, its error, what it is made of and the context, for each kappa; one analysis for all.

    By closed forms at order 0, where these tell.
    """
    # A float beside a zero, as 0.2 is beside 1/5, stands for it.
    near = x.limit_denominator(10**6)
    for zero in (x, *([near] if abs(x) < 1 and float(near) == float(x) else [])):
        if _zeros_at(drift, zero) > 1:
            but = "" if zero == x else f" (start is a float, {zero} but for its rounding)"
            raise InputError(
                f"A has a multiple zero at the start, u = {float_text(x)}{but}, where the uniform "
                "series does not exist; use method='exact'."
            )
    local, order = request.method == "local", request.order
    lam, form, scene = 2 / min(kappas) ** 2, None, None
    digits = request.digits + digits_lost(r, x)
    with own_context(working_digits(digits, drift, lam, r) + 10) as context:
        if order == 0 and not local:
            form = closed_form(drift, r, x, context)
        for kappa in kappas:
            time = form and form.time(mpf_of(2 / kappa**2, context))
            if form is not None and time is not None:
                yield *time, (*form.names, *_TERMS), context
                continue
            if scene is None:
                scene = _analysed(drift, r, x, lam, order, digits, local)
            try:
                value, size = _estimate(scene, 2 / kappa**2, order, float_text(kappa))
            except AccuracyError:
                _refuse_multiple(drift, x)
                raise
            yield value, size, _names(scene.sides, scene.context), scene.context


def _handed(
    request: Request, value: Any, size: Any, names: tuple[str, ...], context: Any
) -> Answer:
    """The answer; for P from 1 - P, whose logarithm has digits of its own."""
    rest, value = value, 1 - value if request.name == "P" else value
    if request.log:
        size = _log_error(value, size, context)
        value = context.log1p(-rest) if request.name == "P" else context.log(value)
    size += abs(value) * context.mpf(10) ** -(request.digits + 5)
    return Answer(value, size, "estimate", names, DROPPED)


def _occupation(asked: Scene, request: Request) -> Answer:
    """1 - P, or P, of one sliding scene, through folds of wells inside the layer."""
    drift, lam, order, complement = asked.drift, asked.lam, request.order, request.complement
    digits = request.digits
    base = working_digits(digits, drift, lam, Fraction(1))
    one = Fraction(1)
    extra, offset = lost_digits(drift, order, base, one)
    with own_context(base + extra) as context:
        field = ExactField(drift, False, context, offset)
        places = whole(field, order, context)
        every = places + barriers(field, order, context)
        stretch = LayerPart(field, -one, -one, one, (-one, one), base, context)
        canonical_pairs = coalescing_pairs(stretch, order, every)
        require_resolved(drift, lam, [float(f.point) for f in canonical_pairs])
        slopes = [abs(field.number(context.mpf(side))) for side in (-1, 1)]
        heights = places[0].height, places[-1].height
        zeros = [p for p in every if p.kind in ("well", "barrier")]
        left, right = (
            truncations_at(field, side * one, -height, zeros, order, base, context)
            for side, height in zip((-1, 1), heights, strict=True)
        )

        def share(number: Any, n: int) -> Any:
            total = whole_at(places, canonical_pairs, number, n, context)
            for sign, truncations in ((1, right), (-1, left)):
                total += sign * corrected(truncations, [], number, n, context).speed
            return outside(number) / total

        def outside(number: Any) -> Any:
            each = zip(slopes, heights, strict=True)
            return sum(context.exp(number * h) / (number * a) for a, h in each)

        def allowed_of(n: int, value: Any) -> Any:
            return value / outside(number) * allowed_of_whole(every, number, n, context)

        number = mpf_of(lam, context)
        canonical_pairs, cost = _apart(canonical_pairs, number, context)
        value, size = _with_error(share, number, order, asked.noise, context, allowed_of)
        size += 10 * cost * value
        if not size < (value if complement else 1 - value):
            raise _too_strong(asked.noise, order)
        wells = [f"well at u = {context.nstr(p.u, 6)}" for p in places if p.kind == "well"]
        return _handed(request, value, size, (*wells, "folds and kinks"), context)


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Order 0 of polynomials in float64 where that is enough; the others one by one."""
    if request.name[-1] == "P":
        raise InputError(
            "arrays have no uniform 1 - P; give one scene at a time, or use method='laplace'."
        )
    drift = scenes.drift
    if request.order == 0 and request.method != "local":
        shapes = own_shapes(drift, scenes.given, scenes)
        logs, errors = logs_of(
            drift, scenes, shapes, (0,), in_float, None, request.full, paired_of, smooth=True
        )
    else:
        logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    rest = np.flatnonzero(~(errors < np.inf))
    if rest.size:
        logs[rest], errors[rest] = _one_by_one(drift, scenes, rest, request)
    return Answers(logs, errors, "estimate", _TERMS, DROPPED)


def _one_by_one(
    drift: Drift, scenes: Scenes, rest: IntArray, request: Request
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift, radius and start; each kappa is then a few sums."""
    given = {name: x[rest] if is_array(x) else x for name, x in scenes.parameters.items()}
    some = rows_of(scenes, rest)._replace(parameters=given)
    logs, errors = np.empty(len(rest)), np.empty(len(rest))
    for one, rows in by_drift(some, some.numbers["r"], some.numbers["start"]):
        r, x = (Fraction(float(some.numbers[name][rows[0]])) for name in ("r", "start"))
        kappas = [Fraction(float(kappa)) for kappa in some.numbers["kappa"][rows]]
        times = _times(one, r, x, kappas, request)
        for row, (value, size, _, context) in zip(rows, times, strict=True):
            logs[row] = float(context.log(value))
            errors[row] = float(_log_error(value, size, context))
    rounding = np.broadcast_to(rounding_of_places(drift, scenes), scenes.lam.shape)
    errors += 4e-16 * (1 + np.abs(logs)) + rounding[rest]
    return logs, errors


class _TwoSides(NamedTuple):
    """A drift, radius and start, seen to both sides."""

    context: Any
    sides: list[OneSide]
    truncations: Truncations
    radius: Any
    local: bool

    def time(self, lam: Any, order: int) -> Any:
        """T at one lam, a number of the context."""
        step()
        args = self.truncations, self.radius, lam, order, self.context
        return lam * mean_time(sides_at(self.sides, *args))


def _analysed(
    drift: Drift, r: Fraction, x: Fraction, lam: Fraction, order: int, digits: int, local: bool
) -> _TwoSides:
    """Both sides of the start to `order` and the next ones, for any lam up to this one."""
    working = working_digits(digits, drift, lam, r)
    context, (sides, truncations) = _sides(drift, r, x, order, working)
    centres = [
        sign * float(f.point) for sign, s in zip((-1, 1), sides, strict=True) for f in s.pairs
    ]
    require_resolved(drift, lam, centres)
    return _TwoSides(context, sides, truncations, mpf_of(r, context), local)


@kept
def _sides(
    context: Any, drift: Drift, r: Fraction, x: Fraction, order: int, digits: int
) -> tuple[list[OneSide], Truncations]:
    """The expansions to both sides, and what tells their truncation errors."""
    x = _beside_zero(drift, x, digits)
    extra, offset = lost_digits(drift, order, digits, x)
    context.dps = digits + extra
    left, right = (ExactField(drift, mirrored, context, offset) for mirrored in (True, False))
    sides = windows((left, right), x, r, order, digits, context)
    both = sides[0].one_sided, sides[1].one_sided
    return sides, truncations_of(right, both, x, r, order, digits, context)


def _beside_zero(drift: Drift, x: Fraction, digits: int) -> Fraction:
    """The start, moved by less than the digits can tell if it is a zero of a polynomial A.

    Of other A it stays there: so many more digits of them would take minutes.
    """
    if not _zeros_at(drift, x):
        return x
    move = Fraction(1, 10 ** (digits + 10))
    return x - move if x > 0 else x + move


def _zeros_at(drift: Drift, x: Fraction) -> int:
    """The multiplicity of x as a zero of a polynomial A: 2 for more than once, 0 unknown."""
    known = drift.exact_coefficients()
    if known is None or abs(x) > 1 or sum((c * x**k for k, c in enumerate(known)), Fraction(0)):
        return 0
    return 1 if sum((k * c * x ** (k - 1) for k, c in enumerate(known) if k), Fraction(0)) else 2


#: Of lam V, between a well and an end that has nothing of it.
_FAR = 30
#: Distance of the start from a multiple zero that makes it the cause of a refusal.
_NEAR = 1e-2


def _refuse_multiple(drift: Drift, x: Fraction) -> None:
    """Raise AccuracyError where a multiple zero of A lies beside the start."""
    for zero in drift.critical_points():
        if zero.multiplicity > 1 and abs(float(zero.u) - float(x)) < _NEAR:
            raise AccuracyError(
                f"A has a multiple zero at u = {float(zero.u):.6g}, beside the start, where the "
                "uniform series does not hold; use method='exact'."
            )


def _estimate(scene: _TwoSides, lam: Fraction, order: int, kappa: str) -> tuple[Any, Any]:
    """T and its error; that of `local` is its distance from the uniform formula as well."""
    context, number = scene.context, mpf_of(lam, scene.context)
    sides, costs = [], []
    for side in scene.sides:
        canonical_pairs, cost = _apart(side.pairs, number, context)
        sides.append(side._replace(pairs=canonical_pairs))
        costs.append(cost)
    scene = scene._replace(sides=sides)
    both = [side.one_sided for side in scene.sides]

    def allowed_of(n: int, T: Any) -> Any:
        return allowed(both, scene.radius, number, n, T, context)

    value, size = _with_error(scene.time, number, order, kappa, context, allowed_of)
    size += (10 * max(costs) + _beyond_far_ends(both, scene.radius, number, context)) * value
    if not size < value:
        raise _too_strong(kappa, order)
    if scene.local:
        # phi taken as a parabola about each pair: Airy's argument is linear in its height there.
        sides = [s._replace(pairs=[parabola(p, context) for p in s.pairs]) for s in scene.sides]
        local = scene._replace(sides=sides).time(number, 0)
        if not local > 0:
            raise AccuracyError(
                f"kappa is {kappa}, where A is not a parabola about its coalescing zeros, so that "
                "method='local' gives T no sign; use method='uniform' or 'exact'."
            )
        # Away from the fold that may be off by more than itself.
        return local, size + abs(local - value)
    return value, size


def _beyond_far_ends(both: Sequence[OneSided], r: Any, lam: Any, context: Any) -> Any:
    """The relative share of leaving over ends whose own series are of no use at this noise.

    Where the other way out is the likelier one, no difference of orders tells of them. Such an end
    counts as a Gaussian of width (lam |phi'|)^(-1/2).
    """
    share = context.zero
    # A well beside an end is taken together with it.
    wells = [-p.height for one in both for p in one.speed_points if p.kind == "well"]
    for one, other in zip(both, reversed(both), strict=True):
        points = one.scale_points, other.scale_points
        if len(points[0]) != 1 or not points[1]:
            continue
        end, top = points[0][0], max(points[1], key=lambda p: p.height)
        if not (end.series.parts and top.series.parts):  # of a constant A
            continue
        first, highest = (p.series.parts[0] for p in (end, top))
        value, slope = (abs(c) for c in (*first.coefficients, 0, 0)[:2])
        height = end.height
        if one.beyond is not None and one.beyond[2]:
            value = 1 / abs(one.beyond[2])
            height += (r - 1) / value
        if slope > lam * value > 0 and all(lam * abs(end.height - V) > _FAR for V in wells):
            width = value * context.sqrt(value / (lam * slope))
            size = abs(highest.coefficients[0]) * lam**-highest.offset
            share += 2 * size / width * context.exp(lam * min(top.height - height, 0))
    return share


def _apart(
    canonical_pairs: list[CanonicalPair], lam: Any, context: Any
) -> tuple[list[CanonicalPair], Any]:
    """Pairs without complex ones cut through by the start or an end; what either way costs."""
    cut = [cut_off(one.pair.zeta, one.gap, lam, context) for one in canonical_pairs]
    taken = [one for one, (_, out) in zip(canonical_pairs, cut, strict=True) if not out]
    return taken, max((cost for cost, _ in cut), default=context.zero)


def _with_error(
    at: Callable[[Any, int], Any],
    lam: Any,
    order: int,
    kappa: str,
    context: Any,
    more: Callable[[int, Any], Any] | None = None,
) -> tuple[Any, Any]:
    """A value of (lam, order) and its error, from what the next orders add.

    `more` is the relative error of an order and its value that majorants allow besides.
    """
    # The next terms may vanish by chance, but not at several lam.
    rows = [[at(lam * s, n) for n in range(order + 1 + BEYOND)] for s in _BESIDE]
    value, size = rows[0][order], context.inf
    for n in range(order + 1):
        relative = max(
            _next_terms(row, n, context) * step ** (n + 1)
            for row, step in zip(rows, _BESIDE, strict=True)
        )
        if more is not None and rows[0][n] > 0:
            relative += more(n, rows[0][n])
        # A lower order may be known better, where noise is strong.
        size = min(size, relative * value + abs(value - rows[0][n]))
    if not (value > 0 and size < value):
        raise _too_strong(kappa, order)
    return value, size


def _too_strong(kappa: str, order: int) -> AccuracyError:
    return AccuracyError(
        f"kappa is {kappa}, where the noise is too strong for the uniform series with "
        f"order={order}: the next terms are as large as the value; give another order, or use "
        "method='exact'."
    )


def _next_terms(found: list[Any], n: int, context: Any) -> Any:
    """Relative truncation error of order n: `SAFETY` times the next two terms, or more."""
    near, far = (abs(found[n + k + 1] - found[n + k]) for k in range(BEYOND))
    fall = min(far / near, context.mpf(3) / 4) if near else context.mpf(3) / 4
    return SAFETY * (near + far) / (1 - fall) / abs(found[n])


def _log_error(value: Any, size: Any, context: Any) -> Any:
    return -context.log1p(-size / value) if size < value else context.inf


def _names(sides: list[OneSide], context: Any) -> tuple[str, ...]:
    found = []
    for sign, side in zip((-1, 1), sides, strict=True):
        for canonical in side.pairs:
            at = sign * mpf_of(canonical.point, context)
            found.append(f"well and barrier about u = {context.nstr(at, 6)}")
    return (*found, *_TERMS)


# -- the sums at one lam ---------------------------------------------------------------------------


@dataclass
class _Contribution:
    """A contribution at one lam; `u` is None for the end at r, `point` for what has no series."""

    u: Any
    value: Any
    onward: Any
    point: CriticalPoint | None


class _SideSum:
    """One side of the start at one lam: its contributions, and what is known of their pairs."""

    def __init__(self, side: OneSide, r: mpf, at: Point) -> None:
        self.one_sided, none = side.one_sided, 0 * at.lam

        def value(height: mpf, series: Any) -> Any:
            return plain(Exponential(height, series), at)[0] + none if terms(series) else none

        scale = [p for p, _ in scale_contributions(side.one_sided, r, Nodes())]
        self.scale_points = [
            _Contribution(p.u, value(p.height, p.series), value(p.height, p.onward), p)
            for p in scale
        ]
        self.speed_points = [
            _Contribution(p.u, value(p.height, p.series), none, p)
            for p in side.one_sided.speed_points
        ]
        self.nested = plain(regular_part(side.one_sided, r, Nodes()), at)[0] + none
        starts = side.one_sided.scale_start, side.one_sided.speed_start
        self.starts = [value(0.0, series) for series in starts]

    def all(self) -> list[_Contribution]:
        """The contributions to both integrals."""
        return self.scale_points + self.speed_points

    def ends(self) -> list[Any]:
        """Ends and kinks of the layer that contribute, in order."""
        kinks = [x.u for x in self.scale_points if x.point and x.point.kind in ("end", "kink")]
        return sorted(u for u in kinks if u is not None)

    def nearest(self) -> _Contribution | None:
        """The well or barrier next to the start."""
        zeros = [x for x in self.all() if x.point and x.point.kind in ("well", "barrier")]
        return min(zeros, key=lambda x: x.u, default=None)

    def correct(self, near: Corrections, start: Corrections, far: Corrections, sign: int) -> None:
        """Corrections at the start and at the ends of the layer; `sign` is -1 in the mirror."""
        ends = self.ends()
        if not ends:
            return
        self.starts[0] += sign * start.scale
        self.starts[1] -= sign * start.speed
        # From a start beyond the layer both of its ends are seen.
        at_ends = [(ends[0], near, 1), (ends[-1], far, -1)][-len(ends) :]
        self.nested += far.regular - (start.regular if len(ends) == 1 else near.regular)
        for u, change, after in at_ends:
            for up in self.scale_points:
                if up.u == u and up.point is not None:
                    up.value += sign * after * change.scale
                    if after > 0:
                        up.onward += sign * change.scale
            for down in self.speed_points:
                if down.u == u:
                    down.value -= sign * after * change.speed

    def side(self) -> Side:
        """S and D of this side, the products of pairs added up."""
        for down in self.speed_points:
            for up in self.scale_points:
                if up.u is None or up.u > down.u:
                    self.nested += down.value * up.value
                elif up.u == down.u:
                    self.nested += down.value * up.onward
        scale = sum((up.value for up in self.scale_points), 0 * self.nested)
        return Side(scale, self.nested, *self.starts)


def sides_at(
    sides: list[OneSide],
    truncations: Truncations,
    r: mpf,
    lam: mpf,
    order: int,
    context: MPContext,
    local: Callable[..., Airy] | None = None,
    correction: Callable[..., Corrections] | None = None,
) -> Sides:
    """Both sides of the start at one lam.

    `local` and `correction` are what stands for `airy` and `corrected` where lam is a symbol
    (`symasym.formulas`).
    """
    at = Point(lam, order, False, None, Digits(context))
    sums = [_SideSum(one, r, at) for one in sides]
    members: list[Member] = []
    for k, one in enumerate(sides):
        for canonical in one.pairs:
            parts = (local or airy)(canonical, lam, order, context)
            members += _meet(canonical, parts, k, sums, lam, order, context)
    beside = truncations.start
    if not beside:
        beside = truncations.left if sums[1].ends() else truncations.right
    members = [m for one in members for m in _weighed(one, beside, context)]
    left, start, right = (
        (correction or corrected)(rows, members, lam, order, context) for rows in truncations
    )
    sums[0].correct(right, start, left, -1)
    sums[1].correct(left, start, right, 1)
    low, high = (part.side() for part in sums)
    scale, speed = low.scale_start + high.scale_start, low.speed_start + high.speed_start
    return Sides(low, high, scale, speed, sides[0].one_sided.endpoint_product)


class Member(NamedTuple):
    """A well or barrier of a pair, the share that the sums take for it, and what of that counts.

    The share changes sides as the start passes, and then its truncation is to be of the same size,
    also that of a kink which the start reaches. Any other is of the point's own series, which is
    better where a pair comes to the end.
    """

    u: Any
    value: Any
    weight: Any


def _weighed(member: Member, beside: list[Truncation], context: MPContext) -> list[Member]:
    """The member with its blending weight, where it is next to the start."""
    return [
        member._replace(weight=truncation.weight)
        for truncation in beside
        if _same(member, truncation, context)
    ]


def _same(member: Member, truncation: Truncation, context: MPContext) -> bool:
    """True where the member is the zero of the truncation."""
    return bool(abs(member.u - truncation.zero) <= context.eps**0.75)


def _meet(
    canonical: CanonicalPair,
    local: Airy,
    k: int,
    sums: list[_SideSum],
    lam: mpf,
    order: int,
    context: MPContext,
) -> list[Member]:
    """Replace the product of the pair's contributions, in the orientation of side k, by its
    canonical form; returns its members."""
    height, own = context.exp(lam * canonical.height), sums[k]
    for n, share in enumerate(canonical.share[: order + 1]):
        own.nested -= share * lam ** -(n + 1)
    if canonical.pair.zeta < 0:
        middle = mpf_of(canonical.point, context)
        own.scale_points.append(_Contribution(middle, local.scale * height, context.zero, None))
        own.speed_points.append(_Contribution(middle, local.speed / height, context.zero, None))
        own.nested += local.both if canonical.onward else context.zero
        return []
    low, high = (_found(u, k, sums) for u in zeros_of(canonical, context))
    (well_side, well), (barrier_side, barrier) = (low, high) if canonical.onward else (high, low)
    barrier.value, well.value = local.scale * height, local.speed / height
    gain = local.both - barrier.value * well.value
    if well_side != barrier_side:
        sums[barrier_side].nested += gain * _beyond(well, barrier, lam, context)
    elif barrier.u > well.u:
        behind, part = sums[1 - well_side].nearest(), context.one
        if sums[well_side].nearest() is well:
            part -= _beyond(well, behind, lam, context)
        sums[well_side].nested += gain * part
    members = ((well_side, well), (barrier_side, barrier))
    return [Member(x.u if side else -x.u, x.value, 0) for side, x in members]


def _found(u: mpf, k: int, sums: list[_SideSum]) -> tuple[int, _Contribution]:
    """The side of the well or barrier at `u` (in the orientation of side k), and its share."""
    for side, at in ((k, u), (1 - k, -u)):
        point = place_at(at, [x.point for x in sums[side].all() if x.point is not None])
        if point is not None:
            return side, next(x for x in sums[side].all() if x.point is point)
    raise AssertionError


def _beyond(well: _Contribution, top: _Contribution | None, lam: mpf, context: MPContext) -> Any:
    """The part of a well's Gaussian at the other side of the start, next to it.

    What a pair has beyond the product of its members is lost as the start passes the well, and
    all of it when the start reaches the barrier behind, `top`.
    """
    assert well.point is not None
    depth = max(well.point.height, context.zero)
    if top is not None and top.point is not None:
        way = abs(top.point.height)
        depth *= (way + depth) / way
    return context.erfc(context.sqrt(lam * depth)) / 2


def corrected(
    truncations: list[Truncation], members: list[Member], lam: mpf, order: int, context: MPContext
) -> Corrections:
    """The corrections of all zeros whose Gaussians one point truncates."""
    shares = [Corrections(*[context.zero] * 3)]
    for truncation in truncations:
        share = None
        for one in members:
            if _same(one, truncation, context):
                sign = -1 if truncation.barrier else 1
                # V is 0 at the start.
                weight = one.weight * context.exp(-((lam * truncation.height) ** 2))
                share = one.value * context.exp(sign * lam * truncation.rise), weight
        shares.append(corrections(truncation, share, lam, order, context))
    return Corrections(*(sum(parts, context.zero) for parts in zip(*shares, strict=True)))


def whole_at(
    points: list[CriticalPoint],
    canonical_pairs: list[CanonicalPair],
    lam: mpf,
    order: int,
    context: MPContext,
    local: Callable[..., Airy] | None = None,
) -> Any:
    """int e^{-lam V} over all u, with Laplace's series at the kinks; `local` as in `sides_at`."""
    at, left_out = Point(lam, order, False, None, Digits(context)), []
    total = context.zero
    for canonical in canonical_pairs:
        parts = (local or airy)(canonical, lam, order, context)
        total += parts.speed * context.exp(-lam * canonical.height)
        if canonical.pair.zeta > 0:
            left_out += [p for u in zeros_of(canonical, context) if (p := place_at(u, points))]
    for point in points:
        if not any(point is p for p in left_out):
            total += plain(Exponential(point.height, point.series), at)[0]
    return total


def digits_lost(r: Fraction, x: Fraction) -> int:
    """Digits that cancel where the way to an end is short: T is as small, its terms are not."""
    share = max(r, Fraction(1)) / (r - abs(x))
    bits = int(share.numerator // share.denominator).bit_length() - 1
    return math.ceil(0.30103 * bits)
