"""Weak noise through the coalescence of wells, barriers and ends: T by uniform approximation.

Laplace's sums (`symasym.asymptotics.weak_noise.answer`) with coalescing critical points taken
together: a well and the barrier next to it, also past the canonical where they are a complex pair
(`.coalescing_pair`: the canonical Airy form of Chester, Friedman and Ursell), and each of them with
the start and with the ends of the layer (`.truncated_gaussian`: Bleistein). Their own series stay
below the sum, in the places and in the regular part; the singular terms cancel there, for which
digits are added beforehand, so that nothing is lost beside a coalescence. Order 0 of polynomial A
has closed forms in which nothing cancels (`.order_zero`), for arrays and for any number of digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from fractions import Fraction
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.coalescence.cubic_map import truncation
from symasym.asymptotics.uniform.coalescing_pair import (
    CanonicalPair,
    LayerPart,
    OneSide,
    coalescing_pairs,
    lost_digits,
    parabola,
    seen,
)
from symasym.asymptotics.uniform.one_drift import ClosedForm, closed_form
from symasym.asymptotics.uniform.order_zero import SAFETY
from symasym.asymptotics.uniform.order_zero import escape_time as in_float
from symasym.asymptotics.uniform.pairing_arrays import paired_of
from symasym.asymptotics.uniform.sums import corrected, time_at, whole_at
from symasym.asymptotics.uniform.truncated_gaussian import (
    Truncations,
    truncations_at,
    truncations_of,
)
from symasym.asymptotics.weak_noise.arrays import logs_of, own_shapes, rounding_of_places
from symasym.asymptotics.weak_noise.critical_points import barriers, whole
from symasym.asymptotics.weak_noise.evaluation import DROPPED, require_resolved
from symasym.asymptotics.weak_noise.series import BEYOND
from symasym.base.contexts import kept, mpf_of, own_context
from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray, float_text, is_array
from symasym.drift.drift import Drift
from symasym.drift.field.float_field import IntArray
from symasym.drift.field.taylor_field import ExactField
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

__all__ = ["of_scene", "of_scenes"]

# Of lam, where the next terms are looked at.
_BESIDE = (1, 0.8, 0.64)
_TERMS = ("wells, barriers, start, ends, kinks and the part between",)


def of_scene(asked: Scene, request: Request) -> Answer:
    """T, or 1 - P and P; by the method ``"local"`` with the fold's own Airy functions."""
    if request.name[-1] == "P":
        return _occupation(asked, request)
    local, order, lam = request.method == "local", request.order, asked.lam
    if order == 0 and not local:
        answer = _closed(asked, request)
        if answer is not None:
            return answer
    scene = _analysed(asked.drift, asked.r, asked.start, lam, order, request.digits, local)
    value, size = _estimate(scene, lam, order, asked.noise)
    return _handed(request, value, size, _names(scene.sides, scene.context), scene.context)


def _closed(asked: Scene, request: Request) -> Answer | None:
    """Order 0 by closed forms; None where they don't tell."""
    with _closed_form(asked.drift, asked.r, asked.start, asked.lam, request.digits) as form:
        time = form and form.time(form.arithmetic.number(asked.lam))
        if form is None or time is None:
            return None
        return _handed(request, *time, (*form.names, *_TERMS), form.arithmetic.context)


@contextmanager
def _closed_form(
    drift: Drift, r: Fraction, x: Fraction, lam: Fraction, digits: int
) -> Iterator[ClosedForm | None]:
    """For any lam up to this one."""
    with own_context(working_digits(digits, lam, r) + 10) as context:
        yield closed_form(drift, r, x, context)


def _handed(
    request: Request, value: Any, size: Any, names: tuple[str, ...], context: Any
) -> Answer:
    if request.log:
        size = _log_error(value, size, context)
        value = context.log(value)
    size += abs(value) * context.mpf(10) ** -(request.digits + 5)
    return Answer(value, size, "estimate", names, DROPPED)


def _occupation(asked: Scene, request: Request) -> Answer:
    """1 - P, or P, of one sliding scene, through folds of wells inside the layer."""
    drift, lam, order, complement = asked.drift, asked.lam, request.order, request.complement
    digits = request.digits
    base = working_digits(digits, lam, Fraction(1))
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
                total += sign * corrected(truncations, [], number, n, context).falling
            outside = sum(
                context.exp(number * h) / (number * a) for a, h in zip(slopes, heights, strict=True)
            )
            return outside / total

        number = mpf_of(lam, context)
        canonical_pairs, cost = _apart(canonical_pairs, number, context)
        value, size = _with_error(share, number, order, asked.noise, context)
        size += 10 * cost * value
        if not size < (value if complement else 1 - value):
            raise _too_strong(asked.noise, order)
        if not complement:
            value = 1 - value
        wells = [f"well at u = {context.nstr(p.u, 6)}" for p in places if p.kind == "well"]
        return _handed(request, value, size, (*wells, "folds and kinks"), context)


def of_scenes(scenes: Scenes, request: Request) -> Answers:
    """Order 0 of polynomials in float64 where that is enough; the others one by one."""
    if request.name[-1] == "P":
        raise InputError(
            "arrays have no uniform 1 - P; give one scene at a time, or use method='laplace'."
        )
    drift, local = scenes.drift, request.method == "local"
    if request.order == 0 and not local:
        shapes = own_shapes(drift, scenes.given, scenes)
        logs, errors = logs_of(
            drift, scenes, shapes, (0,), in_float, None, request.full, paired_of, smooth=True
        )
    else:
        logs, errors = np.full(len(scenes.lam), np.nan), np.full(len(scenes.lam), np.inf)
    rest = np.flatnonzero(~(errors < np.inf))
    if rest.size:
        logs[rest], errors[rest] = _one_by_one(drift, scenes, rest, request, local)
    return Answers(logs, errors, "estimate", _TERMS, DROPPED)


def _one_by_one(
    drift: Drift, scenes: Scenes, rest: IntArray, request: Request, local: bool
) -> tuple[FloatArray, FloatArray]:
    """One analysis for each drift, radius and start; each kappa is then a few sums."""
    given = {name: x[rest] if is_array(x) else x for name, x in scenes.parameters.items()}
    some = rows_of(scenes, rest)._replace(parameters=given)
    logs, errors = np.empty(len(rest)), np.empty(len(rest))
    for one, rows in by_drift(some, some.numbers["r"], some.numbers["start"]):
        lam = 2 / Fraction(float(some.numbers["kappa"][rows].min())) ** 2
        r, x = (Fraction(float(some.numbers[name][rows[0]])) for name in ("r", "start"))
        kappas = {row: Fraction(float(some.numbers["kappa"][row])) for row in rows.tolist()}

        def keep(row: int, value: Any, size: Any, context: Any) -> None:
            logs[row] = float(context.log(value))
            errors[row] = float(_log_error(value, size, context))

        if request.order == 0 and not local:
            with _closed_form(one, r, x, lam, request.digits) as closed:
                for row in rows.tolist():
                    time = closed and closed.time(closed.arithmetic.number(2 / kappas[row] ** 2))
                    if closed is not None and time is not None:
                        keep(row, time[0], time[1], closed.arithmetic.context)
                        del kappas[row]
        if not kappas:
            continue
        scene = _analysed(one, r, x, lam, request.order, request.digits, local)
        for row, kappa in kappas.items():
            value, size = _estimate(scene, 2 / kappa**2, request.order, float_text(kappa))
            keep(row, value, size, scene.context)
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
        return time_at(self.sides, self.truncations, self.radius, lam, order, self.context)


def _analysed(
    drift: Drift, r: Fraction, x: Fraction, lam: Fraction, order: int, digits: int, local: bool
) -> _TwoSides:
    """For any lam up to this one, to `order` and what tells its error."""
    context, (sides, truncations) = _sides(drift, r, x, order, working_digits(digits, lam, r))
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
    sides = seen((left, right), x, r, order, digits, context)
    halves = sides[0].half, sides[1].half
    return sides, truncations_of(right, halves, x, r, order, digits, context)


def _beside_zero(drift: Drift, x: Fraction, digits: int) -> Fraction:
    """The start, moved by less than the digits can tell if it is a zero of a polynomial A.

    Of other A it stays there: so many more digits of them would take minutes.
    """
    known = drift.exact_coefficients()
    if known is None or abs(x) > 1 or sum((c * x**k for k, c in enumerate(known)), Fraction(0)):
        return x
    move = Fraction(1, 10 ** (digits + 10))
    return x - move if x > 0 else x + move


def _estimate(scene: _TwoSides, lam: Fraction, order: int, kappa: str) -> tuple[Any, Any]:
    """T and its error; that of `local` is its distance from the uniform formula as well."""
    context, number = scene.context, mpf_of(lam, scene.context)
    sides, costs = [], []
    for side in scene.sides:
        canonical_pairs, cost = _apart(side.pairs, number, context)
        sides.append(side._replace(pairs=canonical_pairs))
        costs.append(cost)
    scene = scene._replace(sides=sides)
    value, size = _with_error(scene.time, number, order, kappa, context)
    size += 10 * max(costs) * value
    if not size < value:
        raise _too_strong(kappa, order)
    if scene.local:
        straight = scene._replace(sides=[_straightened(side, context) for side in scene.sides])
        local = straight.time(number, 0)
        # Away from the fold that may be off by more than itself.
        return local, size + abs(local - value)
    return value, size


def _apart(
    canonical_pairs: list[CanonicalPair], lam: Any, context: Any
) -> tuple[list[CanonicalPair], Any]:
    """Without complex pairs that the start or an end cuts through, and what either way costs."""
    cut = [truncation(one.pair.zeta, one.gap, lam, context) for one in canonical_pairs]
    taken = [one for one, (_, out) in zip(canonical_pairs, cut, strict=True) if not out]
    return taken, max((cost for cost, _ in cut), default=context.zero)


def _with_error(
    at: Callable[[Any, int], Any], lam: Any, order: int, kappa: str, context: Any
) -> tuple[Any, Any]:
    """A value of (lam, order) and its error, from what the next orders add."""
    # The next terms may vanish by chance, but not at several lam.
    rows = [[at(lam * s, n) for n in range(order + 1 + BEYOND)] for s in _BESIDE]
    value, size = rows[0][order], context.inf
    for n in range(order + 1):
        relative = max(
            _next_terms(row, n, context) * step ** (n + 1)
            for row, step in zip(rows, _BESIDE, strict=True)
        )
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


def _straightened(side: OneSide, context: Any) -> OneSide:
    """phi taken as a parabola about each pair: Airy's argument is linear in its height there."""
    return side._replace(pairs=[parabola(canonical, context) for canonical in side.pairs])


def _names(sides: list[OneSide], context: Any) -> tuple[str, ...]:
    found = []
    for sign, side in zip((-1, 1), sides, strict=True):
        for canonical in side.pairs:
            at = sign * mpf_of(canonical.point, context)
            found.append(f"well and barrier about u = {context.nstr(at, 6)}")
    return (*found, *_TERMS)
