"""The one-sided expansion of the integrals of e^{±lam V}: a value that every later stage receives.

Each is a sum over critical points: interior maxima of the exponent with Laplace's series; the
start and the end with the formal series of an endpoint; and the kinks u = -1 and 1 with the
difference of that series' two sides. Numbers are those of one drift with any digits, or float64,
one of a drift or an array over drifts whose critical points come in the same order.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import is_dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.majorants import Majorants
from symasym.asymptotics.weak_noise.series import (
    ROUNDING,
    Local,
    Numbers,
    Part,
    Series,
    higher,
    trimmed,
)
from symasym.base.inputs import FloatArray
from symasym.numbers.arithmetic import Number


class CriticalPoint(NamedTuple):
    """e^{lam height} times a series; `rank` tells the order from the start on.

    `onward` is, at a kink of e^{lam V}, the endpoint series of the integral to its right alone.
    """

    rank: Any
    height: Numbers
    series: Any  # Series | Local
    onward: Any  # Series | Local | None
    kind: str = ""
    u: Any = None


class Joint(NamedTuple):
    """What replaces the product of the shares at two ranks, falling and rising."""

    falling: Any
    rising: Any
    height: Numbers
    local: Local | None


class OneSided(NamedTuple):
    """What lies on one side of the start, seen from it to the right; the end is left out if r > 1.

    Attributes
    ----------
    rising_start, falling_start : Series
        Of e^{lam V} and of e^{-lam V} to the right of the start, V measured from it.
    corner : bool
        Whether their product is part of the double integral, which at a barrier the regular part
        has already.
    rising, falling : list of CriticalPoint
        Beyond the start, of e^{lam V} and of e^{-lam V}; heights are those of the exponent.
    outer : Series
        The regular part (`symasym.asymptotics.weak_noise.regular_part`), in the layer.
    beyond : tuple or None
        (u, V(u), phi) where the straight part beyond the layer begins, which ends at r.
    rough : rounding of every height, 0 where digits are to spare
    joint : pairs of critical points that coalesce
    slack : what that costs, e^{-lam slack} of the value
    """

    rising_start: Series
    falling_start: Series
    corner: bool
    rising: list[CriticalPoint]
    falling: list[CriticalPoint]
    outer: Series
    beyond: tuple[Any, Any, Any] | None
    rough: Numbers = 0.0
    joint: list[Joint] = []
    slack: Numbers = np.inf

    def all_series(self) -> list[Series]:
        """Every power series of this side."""
        points = self.rising + self.falling
        every = [self.rising_start, self.falling_start, self.outer]
        every += [x for p in points for x in (p.series, p.onward) if isinstance(x, Series)]
        if self.beyond is not None:
            every.append(Series([Part(1.0, 0, [1 / self.beyond[2]])]))
        return every


def formal_series(h: Series) -> tuple[Series, Series]:
    """The formal series of int e^{lam V} and int e^{-lam V} to the right of a point.

    From h_k there (`symasym.asymptotics.weak_noise.regular_part`), by repeated integration by
    parts: sigma_{k+1} = sigma_k'/phi for the one, so that its coefficients are (-1)^(k+1) h_k,
    and -h_k for the other.
    """
    row = _row(h)
    rising = [c if k % 2 == 0 else -c for k, c in enumerate(row)]
    return (
        Series([Part(1.0, 0, rising)] if row else [], h.rounding),
        Series([Part(1.0, 0, [-c for c in row])] if row else [], h.rounding),
    )


def _row(series: Series) -> list[Numbers]:
    """The coefficients of h_1, h_2, ... in a series of one part."""
    return series.parts[0].coefficients if series.parts else []


def add_edge(
    rising: list[CriticalPoint],
    falling: list[CriticalPoint],
    rank: int,
    height: Numbers,
    left: Series,
    right: Series | None,
    kind: str = "",
    u: Number = None,
) -> None:
    """Add the contributions of a kink, or of the end where nothing is to the `right`.

    They are the difference of the formal series of its two sides, from h_k on either.
    """
    first, second = _row(left), [] if right is None else _row(right)
    width = max(len(first), len(second))
    first, second = (row + [0.0] * (width - len(row)) for row in (first, second))
    change = trimmed([y - x for x, y in zip(first, second, strict=True)])
    # phi goes on without a jump, so that the first terms of both sides cancel, exactly.
    if right is not None and change:
        change[0] = 0.0
    rough = left.rounding if right is None else higher(left.rounding, right.rounding)
    changes = formal_series(Series([Part(1.0, 0, change)] if change else [], rough))
    onward = None if right is None else formal_series(right)[0]
    rising.append(CriticalPoint(rank, height, changes[0], onward, kind, u))
    falling.append(CriticalPoint(rank, -height, changes[1], None, kind, u))


def _float_series(x: Series | Local | None) -> Any:
    """The series in float64; what is no series stays."""
    if not isinstance(x, Series):
        return x
    parts = [p._replace(coefficients=[float(c) for c in p.coefficients]) for p in x.parts]
    known = x.majorants
    if known is not None:
        known = Majorants(*([float(c) for c in row] for row in known))
    return Series(parts, ROUNDING, majorants=known)


def float_point(p: CriticalPoint) -> CriticalPoint:
    """A critical point that was computed with more digits than float64 has, in float64."""
    return p._replace(
        height=float(p.height), series=_float_series(p.series), onward=_float_series(p.onward)
    )


def in_float(one: OneSided) -> OneSided:
    """An expansion that was computed with more digits than float64 has, in float64."""
    rising, falling = (list(map(float_point, points)) for points in (one.rising, one.falling))
    return one._replace(
        rising_start=_float_series(one.rising_start),
        falling_start=_float_series(one.falling_start),
        outer=_float_series(one.outer),
        rising=rising,
        falling=falling,
        beyond=one.beyond and tuple(float(x) for x in one.beyond),  # type: ignore[arg-type]
        # Heights cancel each other in pairs of critical points.
        rough=3e-16 * max([abs(p.height) for p in rising + falling], default=0.0),
    )


def mapped(value: Any, change: Callable[[FloatArray], Any]) -> Any:
    """The same with `change` made to every array in it."""
    if isinstance(value, np.ndarray):
        return change(value)
    if isinstance(value, list):
        return [mapped(x, change) for x in value]
    if isinstance(value, tuple):
        parts = [mapped(x, change) for x in value]
        return type(value)(*parts) if hasattr(value, "_fields") else tuple(parts)
    if is_dataclass(value) and not isinstance(value, type):
        return replace(value, **{name: mapped(x, change) for name, x in vars(value).items()})
    return value


def first_of(value: Any) -> Any:
    """The same with the arrays' first entries: NumPy is quicker with plain numbers."""
    return mapped(value, lambda x: float(x.ravel()[0]))
