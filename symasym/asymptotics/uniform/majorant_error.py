"""What majorants of Laplace's series allow for the error of T and 1 - P away from coalescence.

The uniform series is judged by what its next orders add, which may nearly vanish. Where a well or
a barrier has no other one close by, or the start or an end none, its share of the uniform sum is
Laplace's own series to exponentially small terms, and its majorants
(`symasym.asymptotics.weak_noise.one_sided.majorants`) hold for it. What is closer together has none
here: its own series is singular at the coalescence, and the uniform one is not. A well or a barrier
beside the start or an end has its majorants, since only theirs are singular there.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from symasym.asymptotics.weak_noise.compose import Composed, escape_time
from symasym.asymptotics.weak_noise.one_sided import CriticalPoint, OneSided
from symasym.asymptotics.weak_noise.series import Point, Series
from symasym.numbers.arithmetic import Digits

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

__all__ = ["allowed", "allowed_of_whole"]

# lam times the difference of V at two zeros of A that are apart, and at another point and a zero:
# there the series of the point falls by the inverse of that.
_APART, _FAR = 15, 200
# Of T, by which Laplace's sum may differ from it where it is of use.
_NEAR = 0.1
# Claims over truncation errors, as in `symasym.asymptotics.weak_noise.compose.escape_time`.
_CLAIM = 2
_ZEROS = ("well", "barrier")
#: The side and the rank of a point; those of the start.
_Place = tuple[int, int]
_START = (-1, 0)


def allowed(
    sides: Sequence[OneSided], r: mpf, lam: mpf, order: int, T: mpf, context: MPContext
) -> Any:
    """The relative error of `T` to this order that majorants allow, 0 where they are of no use."""
    alone = _alone(sides, lam)
    errors = []
    for known in (alone, set[_Place]()):
        both = [_with_majorants_of(h, k, known, _START in alone) for k, h in enumerate(sides)]
        at = Point(lam, order, True, None, Digits(context))
        composed = Composed((both[0], both[1]), r, 0.0)
        if not at.value_of(composed.time[0]).value > 0:
            return context.zero
        found = escape_time(composed, at)
        if not abs(context.expm1(found.log - context.log(T))) < _NEAR:
            return context.zero
        errors.append(found.error)
    more = errors[0] - errors[1]
    return more if 0 < more < context.inf else context.zero


def _alone(sides: Sequence[OneSided], lam: mpf) -> set[_Place]:
    """The zeros of A with no other one close by, and the other points with no zero close by."""
    places: list[tuple[_Place, bool, Any]] = [(_START, False, 0 * lam)]
    for k, one in enumerate(sides):
        points = {p.rank: (p.kind in _ZEROS, p.height) for p in one.scale_points}
        points |= {p.rank: (True, -p.height) for p in one.speed_points if p.kind in _ZEROS}
        row = [((k, rank), *points[rank]) for rank in sorted(points)]
        places = places + row if k else row[::-1] + places
    return _apart(places, lam)


def _apart(places: list[tuple[Any, bool, Any]], lam: mpf) -> set[Any]:
    """Those places with no zero of A close by, of (place, whether it is a zero, V) in a row."""
    alone = set()
    for n, (place, is_zero, height) in enumerate(places):
        gap = _APART if is_zero else _FAR
        sides = places[:n][::-1], places[n + 1 :]
        zeros = [next((V for _, zero, V in side if zero), None) for side in sides]
        if all(V is None or lam * abs(V - height) > gap for V in zeros):
            alone.add(place)
    return alone


def allowed_of_whole(
    points: Sequence[CriticalPoint], lam: mpf, order: int, context: MPContext
) -> Any:
    """The error of int e^{-lam V} over the line that majorants allow.

    `points` are those of the integral, and the barriers between them.
    """
    row = sorted(points, key=lambda p: p.u)
    signs = [1 if p.kind == "barrier" else -1 for p in row]
    places = [
        (n, p.kind in _ZEROS, s * p.height) for n, (p, s) in enumerate(zip(row, signs, strict=True))
    ]
    at, total = Point(lam, order, True, None, Digits(context)), context.zero
    for n in _apart(places, lam):
        if signs[n] < 0:
            series = row[n].series
            more = at.series(series).error - at.series(_kept(series, False)).error
            total += more * context.exp(lam * row[n].height)
    return _CLAIM * total


def _with_majorants_of(one: OneSided, k: int, known: set[_Place], start: bool) -> OneSided:
    """The one-sided expansion with the majorants of these points alone.

    Without the series of the start, and the regular part, if that is not apart: these are singular
    where a zero of A comes to it, and T is what a well makes it there.
    """

    def points(of: list[CriticalPoint]) -> list[CriticalPoint]:
        rows = ((p, (k, p.rank) in known) for p in of)
        return [
            p._replace(series=_kept(p.series, kept), onward=_kept(p.onward, kept))
            for p, kept in rows
        ]

    # The regular part's majorants are those of the start and of the end.
    end = (k, max((p.rank for p in one.scale_points), default=0)) in known
    own = one.scale_start, one.speed_start, one.regular_part
    if start:
        keep = _START in known, _START in known, _START in known and end
        own = tuple(map(_kept, own, keep))
    else:
        own = Series([]), Series([]), Series([])
    return one._replace(
        scale_start=own[0],
        speed_start=own[1],
        regular_part=own[2],
        scale_points=points(one.scale_points),
        speed_points=points(one.speed_points),
    )


def _kept(series: Any, majorants: bool) -> Any:
    """The series, with its majorants or without."""
    if majorants or not isinstance(series, Series):
        return series
    return series._replace(parts=[p._replace(majorants=None) for p in series.parts])
