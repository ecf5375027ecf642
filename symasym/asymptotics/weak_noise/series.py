"""Series in 1/lam at many lam at once, in float64, each with what it leaves out.

Every pass over an array costs about as much as any other, so that passes are what is saved:
powers and exponentials of one array of lam are found once, the next two terms of a series by
one short Horner scheme, and a factor 1 or a term 0, which are plain numbers, cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symasym.asymptotics.weak_noise.critical_points import BEYOND
from symasym.asymptotics.weak_noise.one_sided import Local, Numbers, Part, Series, Sight
from symasym.base.inputs import FloatArray

_MOST_FALL = 0.75
# Beside the largest term, below which one vanishes.
_ULP = 1e-15
# Terms before the next two whose ratios count: one of these two may be small by chance.
LOOK_BACK = 3
# Beyond this a term is below 1e-16 of the rest if its coefficients are no larger; they may be by
# so much, with lam^2 for what the powers of lam make up, and beside a zero of A by far more.
_FAINT = 37.0
_LARGER = 23.0
# Of a product of pairs, and of their errors, over such a product.
_FACTORS = 4
# Rounding of exponents beyond which it is a logarithm's, whatever the weight of its terms.
MOST_ROUGH = 0.1


def plus(a: Any, b: Any) -> Any:
    if isinstance(b, float) and b == 0:
        return a
    return b if isinstance(a, float) and a == 0 else a + b


def counts(weight: Any) -> bool:
    return not (isinstance(weight, float) and weight == 0)


def times(a: Any, b: Any) -> Any:
    if isinstance(b, float):
        if b == 0 or b == 1:
            return a if b else 0.0
    elif isinstance(a, float) and (a == 0 or a == 1):
        return b if a else 0.0
    return a * b


def absolute(a: Any) -> Any:
    """Mostly, nothing is negative; then it is the same array."""
    return a if isinstance(a, np.ndarray) and a.min() >= 0 else abs(a)


def largest(heights: list[Numbers]) -> Numbers:
    """The largest; 0 is always among them."""
    top: Numbers = 0.0
    for height in heights:
        top = higher(top, height)
    return top


def higher(a: Numbers, b: Numbers) -> Numbers:
    if isinstance(a, float) and isinstance(b, float):
        return max(a, b)
    return np.maximum(a, b)


def lower(a: Numbers, b: Numbers) -> Numbers:
    if isinstance(a, float) and isinstance(b, float):
        return min(a, b)
    return np.minimum(a, b)


class Value(NamedTuple):
    """A sum at every lam and its error; of a series, which products are made of, also |value|.

    Where no errors are asked for both are None.
    """

    value: Any
    size: Any
    error: Any

    def __mul__(self, other: Value) -> Value:  # type: ignore[override]
        value = times(self.value, other.value)
        if self.error is None:
            return Value(value, None, None)
        cross = times(self.error, plus(other.size, other.error))
        return Value(value, None, plus(cross, times(self.size, other.error)))


def _leading(part: Part) -> int:
    """The number of its first term."""
    return next((n for n, c in enumerate(part.coefficients) if np.any(c)), 0)


def _ratio(before: Any, after: Any) -> Any:
    """Of two sizes; infinite over 0."""
    if isinstance(before, float) and isinstance(after, float):
        return after / before if before else (np.inf if after else 0.0)
    known = before > 0
    return np.where(known, after / np.where(known, before, 1.0), np.where(after > 0, np.inf, 0.0))


class Sizes:
    """How far apart the terms of all series of two sights are, apart from their exponentials.

    A formal series of the start may have coefficients of 1e140 beside a zero of A, and no
    exponential is small then unless it is compared with them.
    """

    def __init__(self, sights: tuple[Sight, Sight]) -> None:
        # Logarithms: each term with its number, the largest of all drifts, and the least first one.
        self._terms: list[tuple[int, float]] = []
        self._first = np.inf
        for one in sights:
            spots = one.rising + one.falling
            found = [one.rising_start, one.falling_start, one.outer]
            found += [x for p in spots for x in (p.series, p.onward) if isinstance(x, Series)]
            if one.beyond is not None:
                found.append(Series([Part(1.0, 0, [1 / one.beyond[2]])]))
            for part in (part for series in found for part in series.parts):
                self._add(part)

    def _add(self, part: Part) -> None:
        first = True
        for n, c in enumerate(part.coefficients):
            size = np.abs(c)
            largest = float(size.max())
            if not largest < np.inf:
                self._terms.append((n, np.inf))
            elif largest:
                self._terms.append((n, float(np.log(largest))))
                if first:
                    least = float(size.min()) or float(size[size > 0].min())
                    self._first = min(self._first, float(np.log(least)))
                    first = False

    def spread(self, least: float, order: int) -> float:
        """The largest term over the smallest first one for lam from `least` on, its logarithm.

        Powers of lam that all terms of a series share are left out.
        """
        low, first = float(np.log(least)), min(self._first, 700.0)
        return max((c - n * low - first for n, c in self._terms if n <= order + BEYOND), default=0)


#: A height, at most 0, and how to find what goes with its exponential.
Term = tuple[Numbers, Callable[[], Value]]


class Point:
    """Powers and exponentials of one array of lam, and what has been found at it."""

    def __init__(self, lam: FloatArray, order: int, errors: bool, sizes: Sizes) -> None:
        self.lam, self.order, self.errors = lam, order, errors
        self.x = 1.0 / lam
        self.least, self.most = float(lam.min()), float(lam.max())
        larger = max(_LARGER, _FACTORS * sizes.spread(self.least, order))
        powers = 2 * abs(float(np.log(self.most))) + 2 * abs(float(np.log(self.least)))
        self.faint = -_FAINT - larger - powers
        self._powers: dict[float, FloatArray] = {1.0: self.x}
        self._decays: dict[float, Any] = {}
        self._rough: dict[int, tuple[Any, Any]] = {}
        self._known: dict[int, tuple[Series | Local, Value]] = {}

    def power(self, offset: float) -> FloatArray:
        """lam^-offset."""
        found = self._powers.get(offset)
        if found is None:
            if offset <= 0.5:
                found = np.sqrt(self.x) if offset else np.ones_like(self.x)
            else:
                low = offset % 1 or float(int(offset) // 2)
                found = self.power(low) * self.power(offset - low)
            self._powers[offset] = found
        return found

    @cached_property
    def logs(self) -> FloatArray:
        found: FloatArray = np.log(self.lam)
        return found

    def decay(self, gap: Numbers) -> Any:
        """e^{lam gap} for gap <= 0; plainly 1 where gap is 0, and 0 where nothing is left."""
        if not isinstance(gap, float):
            if gap.size > 1:
                return self._decays_of(gap)
            gap = float(gap.flat[0])
        found = self._decays.get(gap)
        if found is None:
            if gap == 0:
                found = 1.0
            elif not gap * self.least > self.faint:
                found = 0.0
            else:
                found = self.lam * gap
                np.exp(found, out=found)
            self._decays[gap] = found
        return found

    def total(self, terms: Iterable[Term]) -> Value:
        """What terms make together; those too small to count are not evaluated."""
        value: Any = 0.0
        error: Any = 0.0 if self.errors else None
        for height, find in terms:
            weight = self.decay(height)
            if counts(weight):
                found = find()
                value = plus(value, times(found.value, weight))
                if self.errors:
                    error = plus(error, times(found.error, weight))
        return Value(value, None, error)

    def _decays_of(self, gap: FloatArray) -> Any:
        if not gap.any():
            return 1.0
        exponent = self.lam * gap
        return np.exp(exponent, out=exponent) if exponent.max() > self.faint else 0.0

    def _rounding(self, rough: Numbers) -> Any:
        """lam times the rounding of a height, where that is small, else 0."""
        if isinstance(rough, float) and (rough == 0 or rough * self.least >= MOST_ROUGH):
            return 0.0
        # With the number itself, so that its id is not given to another.
        known = self._rough.get(id(rough))
        if known is None:
            found = self.lam * rough
            if not found.max() < MOST_ROUGH:
                found = np.where(found < MOST_ROUGH, found, 0.0)
            known = self._rough[id(rough)] = rough, found
        return known[1]

    # -- series ------------------------------------------------------------------------------

    def series(self, series: Series | Local, rough: Numbers = 0.0) -> Value:
        """The first order + 1 terms; the error is the following and rounding.

        `rough` is that of the height of the exponential that the series goes with.
        """
        known = self._known.get(id(series))
        if known is None:
            known = self._known[id(series)] = series, self._evaluated(series, rough)
        return known[1]

    def _evaluated(self, series: Series | Local, rough: Numbers) -> Value:
        if isinstance(series, Series):
            return self._series(series, rough)
        value, error = series.at(self)
        if not self.errors:
            return Value(value, None, None)
        size = absolute(value)
        return Value(value, size, plus(error, times(size, self._rounding(rough))))

    def _series(self, series: Series, rough: Numbers) -> Value:
        value: Any = 0.0
        for part in series.parts:
            front = self._front(part, self._horner(part.coefficients[: self.order + 1]))
            value = plus(value, front)
        if not self.errors:
            return Value(value, None, None)
        size = absolute(value)
        weight = self._rounding(rough)
        if series.size is None:
            weight = plus(weight, series.rounding)
        error = plus(self._left_out(series.parts), times(size, weight))
        if series.size is not None:
            part = series.parts[0] if series.parts else Part(1.0, 0, [])
            cancels = self._front(part, self._horner(series.size[: self.order + 1]))
            error = plus(error, times(cancels, series.rounding))
        return Value(value, size, error)

    def _front(self, part: Part, value: Any) -> Any:
        if isinstance(value, float) and value == 0:
            return value
        value = value * self.power(part.offset)
        return value * self.logs**part.logs if part.logs else value

    def _horner(self, coefficients: list[Numbers]) -> Any:
        if not coefficients:
            return 0.0
        total = coefficients[-1]
        if len(coefficients) > 1:
            total = total * self.x
            for c in coefficients[-2:0:-1]:
                total += c
                total *= self.x
            total += coefficients[0]
        return total

    def _left_out(self, parts: list[Part]) -> Any:
        """The next two terms over 1 - q where terms fall by a factor q, at most 3/4."""
        if len(parts) == 1 and not parts[0].logs:
            return self._tail(parts[0])
        first = min((_leading(part) for part in parts), default=0)
        last = []
        for n in range(max(first, self.order + 1 - LOOK_BACK), self.order + 1 + BEYOND):
            term: Any = 0.0
            for part in parts:
                term = term + self._term(part, n)
            last.append(abs(term))
        left_out = sum(last[-BEYOND:])
        longest = max((len(part.coefficients) for part in parts), default=0)
        for n in range(self.order + 1 + BEYOND, longest):
            if np.any(left_out > _ULP * last[0]):
                break
            left_out = left_out + abs(sum(self._term(part, n) for part in parts))
        if not np.any(left_out):
            return 0.0
        ratio: Any = 0.0
        for before, after in pairwise(last):
            ratio = higher(ratio, _ratio(before, after))
        return left_out / (1 - np.minimum(ratio, _MOST_FALL))

    def _term(self, part: Part, n: int) -> Any:
        if n >= len(part.coefficients):
            return 0.0
        return self._front(part, part.coefficients[n] * self.power(float(n)))

    def _first_of_later(self, part: Part, near: Any, far: Any) -> tuple[Any, Any]:
        """The next two coefficients, with those further on where these two vanish."""
        first = self.order + 1
        later = part.coefficients[first + BEYOND :]
        if not later:
            return near, far
        x, lead = 1 / self.least, abs(part.coefficients[_leading(part)])
        for n, c in enumerate(later, start=1):
            if np.any(near + far * x > _ULP * lead * x ** (_leading(part) - first)):
                break
            far = far + abs(c) * x**n
        return near, far

    def _tail(self, part: Part) -> Any:
        """The same for one part: its terms are numbers times powers, q one times 1/lam."""
        first = self.order + 1
        if len(part.coefficients) <= first:
            return 0.0
        low = max(min(_leading(part), first), first - LOOK_BACK)
        sizes = [abs(c) for c in part.coefficients[low : first + BEYOND]]
        sizes += [0.0] * (first + BEYOND - low - len(sizes))
        near, far = sizes[-BEYOND:]
        q: Any = 0.0
        for before, after in pairwise(sizes):
            q = higher(q, _ratio(before, after))
        near, far = self._first_of_later(part, near, far)
        least, most = (q, q) if isinstance(q, float) else (float(q.min()), float(q.max()))
        total = self.x * far
        total += near
        if least >= _MOST_FALL * self.most:
            total *= 1 / (1 - _MOST_FALL)
        else:
            rest = self.x * -q
            rest += 1
            if most > _MOST_FALL * self.least:
                np.maximum(rest, 1 - _MOST_FALL, out=rest)
            total /= rest
        total *= self.power(part.offset + first)
        return total
