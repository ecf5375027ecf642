"""Series in 1/lam with their truncation error, over any arithmetic: float64 arrays, or digits.

A series is a sum of parts lam^-offset log(lam)^logs (c_0 + c_1/lam + ...). Its value to order N has
the terms up to c_N. Its truncation error is judged by the next two, (|c_{N+1}| + |c_{N+2}|/lam)
lam^-(N+1) over 1 - q, where terms fall by a factor q, at most 3/4: an estimate, as such series
diverge (R. B. Dingle, Asymptotic Expansions, 1973, ch. XXI). These two may nearly vanish; the error
is no less than a share of what majorants of the later terms allow
(`symasym.asymptotics.weak_noise.one_sided.majorants`).

Every pass over an array costs about as much as any other, so that passes are what is saved:
powers and exponentials of one array of lam are computed once, the next two terms of a series by
one short Horner scheme, and a factor 1 or a term 0, which are plain numbers, cost nothing.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import cached_property
from itertools import pairwise
from typing import Any, NamedTuple, Protocol

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.numbers.arithmetic import FLOATS, Arithmetic

#: Orders of every series that are computed beyond those that are added up; they tell the error.
BEYOND = 2
#: Terms, and Taylor coefficients of A, behind those that majorants look at.
FURTHER = 8
#: Of a coefficient, and of the sum that is made of it; what cancels in sums of series has it left.
ROUNDING = 1e-15

#: A number of each drift, or one of all.
Numbers = Any


class Majorants(NamedTuple):
    """M_n and L_n for n = 0, 1, ...; M_n as far as it is wanted, L_n further on."""

    full: list[Numbers]
    first_felt: list[Numbers]

    def behind(self, known: int) -> list[Numbers]:
        """Majorants of the coefficients behind the first `known`, of which the first is full."""
        later = self.first_felt[known + 1 : known + 1 + FURTHER]
        return self.full[known : known + 1] + later


class Part(NamedTuple):
    """lam^-offset log(lam)^logs (c[0] + c[1]/lam + ...); coefficients that are missing are 0.

    `majorants` are those of the coefficients, where they are known.
    """

    offset: float
    logs: int
    coefficients: list[Numbers]
    majorants: Majorants | None = None


class Series(NamedTuple):
    """A sum of parts, each known to `rounding`: of its value, or where given of its `terms`."""

    parts: list[Part]
    rounding: Numbers = 0.0
    # Coefficients as large as what cancels in those of the first part.
    size: list[Numbers] | None = None

    @property
    def majorants(self) -> Majorants | None:
        """Majorants of the first part."""
        return self.parts[0].majorants if self.parts else None


class Local(Protocol):
    """A function of lam that is no power series (see `uniform.order_zero_forms`)."""

    def at(self, point: Point) -> tuple[Any, Any]:
        """The value and its error."""


class Valued(Protocol):
    """An expression with a value at lam (`symasym.asymptotics.weak_noise.compose`)."""

    def evaluated(self, at: Point) -> Value:
        """The value at lam."""


def nonzero(x: Numbers) -> bool:
    """True where any entry is not 0."""
    return bool(x.any()) if isinstance(x, np.ndarray) else bool(x)


def terms(series: Series | Local | None) -> bool:
    """True where there is a series, and it has terms."""
    return series is not None and not (isinstance(series, Series) and not series.parts)


def trimmed(coefficients: list[Numbers]) -> list[Numbers]:
    """The coefficients without zeros at the end."""
    kept = list(coefficients)
    while kept and not nonzero(kept[-1]):
        kept.pop()
    return kept


def added(a: Series, b: Series) -> Series:
    """The sum of two series, whose terms may cancel."""
    keys = {(p.offset, p.logs): p.coefficients for p in a.parts}
    known = {(p.offset, p.logs): p.majorants for p in b.parts + a.parts if p.majorants}
    for part in b.parts:
        mine = keys.get((part.offset, part.logs), [])
        width = max(len(mine), len(part.coefficients))
        rows = [row + [0.0] * (width - len(row)) for row in (mine, part.coefficients)]
        keys[part.offset, part.logs] = [x + y for x, y in zip(*rows, strict=True)]
    rounding = higher(a.rounding, b.rounding)
    parts = [
        Part(*key, row, known.get(key)) for key, values in keys.items() if (row := trimmed(values))
    ]
    return Series(parts, rounding, a.size if a.size is not None else b.size)


_MOST_FALL = 0.75
#: Of what the majorants allow. Claims are twice the truncation error.
_SHARE = 0.55
# Of an error, what may be left out.
_LITTLE = 0.01
# Of the series' value: a majorant tells that an error may be large, not that nothing is known.
_MOST_SHARE = 0.5
# Terms before the next two whose ratios count: one of these two may be small by chance.
_LOOK_BACK = 3
# Beyond this a term is below 1e-16 of the rest if its coefficients are no larger; they may be by
# so much, with lam^2 for what the powers of lam make up, and beside a zero of A by far more.
_FAINT = 37.0
_LARGER = 23.0
# Of a product of pairs, and of their errors, over such a product.
_FACTORS = 4
# Rounding of exponents beyond which it is a logarithm's, whatever the weight of its terms.
MOST_ROUNDING = 0.1


def plus(a: Numbers, b: Numbers) -> Any:
    """a + b, at no cost where one of them is plainly 0."""
    if isinstance(b, float) and b == 0:
        return a
    return b if isinstance(a, float) and a == 0 else a + b


def counts(weight: Numbers) -> bool:
    """True where a weight is not plainly 0."""
    return not (isinstance(weight, float) and weight == 0)


def times(a: Numbers, b: Numbers) -> Any:
    """a b, at no cost where one of them is plainly 0 or 1."""
    if isinstance(b, float):
        if b == 0 or b == 1:
            return a if b else 0.0
    elif isinstance(a, float) and (a == 0 or a == 1):
        return b if a else 0.0
    return a * b


def absolute(a: Numbers) -> Any:
    """|a|: mostly, nothing is negative; then it is the same array."""
    return a if isinstance(a, np.ndarray) and a.min() >= 0 else abs(a)


def higher(a: Numbers, b: Numbers) -> Numbers:
    """The larger of two numbers, or of each entry."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.maximum(a, b)
    return max(a, b)


def lower(a: Numbers, b: Numbers) -> Numbers:
    """The smaller of two numbers, or of each entry."""
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return np.minimum(a, b)
    return min(a, b)


class Value:
    """A value at every lam and its error, None where no errors are asked for."""

    __slots__ = ("_size", "error", "value")

    def __init__(self, value: Numbers, error: Numbers) -> None:
        self.value, self.error = value, error
        self._size: Any = None

    @property
    def size(self) -> Any:
        """|value|."""
        if self._size is None:
            self._size = absolute(self.value)
        return self._size

    def __add__(self, other: Value) -> Value:
        error = None if self.error is None else plus(self.error, other.error)
        return Value(plus(self.value, other.value), error)

    def __mul__(self, other: Value) -> Value:
        value = times(self.value, other.value)
        if self.error is None:
            return Value(value, None)
        cross: Any = 0.0
        if counts(self.error):
            cross = times(self.error, plus(other.size, other.error))
        if counts(other.error):
            cross = plus(cross, times(self.size, other.error))
        return Value(value, cross)

    def __truediv__(self, other: Value) -> Value:
        """Over a positive value whose own error is left out."""
        error = None if self.error is None else self.error / other.value
        return Value(self.value / other.value, error)

    def __neg__(self) -> Value:
        return Value(-self.value, self.error)

    def __sub__(self, other: Value) -> Value:
        return self + -other

    def __abs__(self) -> Value:
        return Value(self.size, 0.0)

    def known(self) -> Value:
        """The same without its error."""
        return Value(self.value, 0.0 if self.error is not None else None)

    def wrong(self) -> Value:
        """Its error as a value."""
        return Value(self.error, 0.0)


def _leading(part: Part) -> int:
    """The number of its first term."""
    return next((n for n, c in enumerate(part.coefficients) if nonzero(c)), 0)


def _rows(parts: list[Part], count: int) -> Iterator[list[tuple[Part, Numbers]]]:
    """Parts that have a coefficient c_n, with it, for each n < `count`."""
    for n in range(count):
        yield [(p, p.coefficients[n]) for p in parts if n < len(p.coefficients)]


def _ratio(before: Numbers, after: Numbers) -> Any:
    """The ratio of two sizes; infinite over 0."""
    if not (isinstance(before, np.ndarray) or isinstance(after, np.ndarray)):
        return after / before if before else (np.inf if after else 0.0)
    known = before > 0
    return np.where(known, after / np.where(known, before, 1.0), np.where(after > 0, np.inf, 0.0))


class Sizes:
    """How far apart the terms of some series in float64 are, apart from their exponentials.

    A formal series of the start may have coefficients of 1e140 beside a zero of A, and no
    exponential is small then unless it is compared with them.
    """

    def __init__(self, all_series: Iterable[Series]) -> None:
        # Logarithms: each term with its number, the largest of all drifts, and the least first one.
        self._terms: list[tuple[int, float]] = []
        self._first = np.inf
        for part in (part for series in all_series for part in series.parts):
            self._add(part)

    def _add(self, part: Part) -> None:
        """Take up the sizes of the terms of one part."""
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
Term = tuple[Numbers, Callable[["Point"], Value]]


class Point:
    """Powers and exponentials of lam, an array of it or one number, and the values found there.

    Without `sizes` no exponential is left out for being small.
    """

    def __init__(
        self,
        lam: Numbers,
        order: int,
        errors: bool,
        sizes: Sizes | None = None,
        arithmetic: Arithmetic = FLOATS,
    ) -> None:
        self.lam, self.order, self.errors, self.arithmetic = lam, order, errors, arithmetic
        self.x = 1 / lam
        if isinstance(lam, np.ndarray):
            self.least, self.most = float(lam.min()), float(lam.max())
        else:
            self.least = self.most = lam
        self.faint = -np.inf
        if sizes is not None:
            larger = max(_LARGER, _FACTORS * sizes.spread(self.least, order))
            powers = 2 * abs(float(np.log(self.most))) + 2 * abs(float(np.log(self.least)))
            self.faint = -_FAINT - larger - powers
        # Beside the largest term, below which one vanishes.
        self._small = 4 * arithmetic.eps
        self._powers: dict[float, Any] = {1.0: self.x}
        self._decays: dict[Any, Any] = {}
        self._moved: dict[int, tuple[Any, Any]] = {}
        self._values: dict[int, tuple[Any, Value]] = {}

    def value_of(self, node: Valued) -> Value:
        """The value of an expression (`symasym.asymptotics.weak_noise.compose`), found once."""
        known = self._values.get(id(node))
        if known is None:
            known = self._values[id(node)] = node, node.evaluated(self)
        return known[1]

    def power(self, offset: float) -> Any:
        """lam^-offset."""
        known = self._powers.get(offset)
        if known is None:
            if offset <= 0.5:
                known = self.arithmetic.sqrt(self.x) if offset else self.x * 0.0 + 1.0
            else:
                low = offset % 1 or float(int(offset) // 2)
                known = self.power(low) * self.power(offset - low)
            self._powers[offset] = known
        return known

    @cached_property
    def logs(self) -> Any:
        """log(lam)."""
        return self.arithmetic.log(self.lam)

    def decay(self, gap: Numbers) -> Any:
        """e^{lam gap} for gap <= 0; plainly 1 where gap is 0, and 0 where nothing is left."""
        if isinstance(gap, np.ndarray):
            if gap.size > 1:
                return self._decays_of(gap)
            gap = float(gap.flat[0])
        known = self._decays.get(gap)
        if known is None:
            if gap == 0:
                known = 1.0
            elif not gap * self.least > self.faint:
                known = 0.0
            else:
                known = self.exp(self.lam * gap)
            self._decays[gap] = known
        return known

    def exp(self, x: Numbers) -> Any:
        """e^x; an array `x` is overwritten."""
        return np.exp(x, out=x) if isinstance(x, np.ndarray) else self.arithmetic.exp(x)

    def log(self, x: Numbers) -> Any:
        """log(x); an array `x` is overwritten."""
        return np.log(x, out=x) if isinstance(x, np.ndarray) else self.arithmetic.log(x)

    def total(self, terms: Iterable[Term]) -> Value:
        """The sum of terms; those too small to count are not evaluated."""
        value: Any = 0.0
        error: Any = 0.0 if self.errors else None
        for height, find in terms:
            weight = self.decay(height)
            if counts(weight):
                term = find(self)
                value = plus(value, times(term.value, weight))
                if self.errors:
                    error = plus(error, times(term.error, weight))
        return Value(value, error)

    def _decays_of(self, gap: FloatArray) -> Any:
        """The same for a height of each drift."""
        if not gap.any():
            return 1.0
        exponent = self.lam * gap
        return np.exp(exponent, out=exponent) if exponent.max() > self.faint else 0.0

    def _rounding(self, rounding: Numbers) -> Any:
        """lam times the rounding of a height, where that is small, else 0."""
        if isinstance(rounding, float) and (
            rounding == 0 or rounding * self.least >= MOST_ROUNDING
        ):
            return 0.0
        # With the number itself, so that its id is not given to another.
        known = self._moved.get(id(rounding))
        if known is None:
            moved = self.lam * rounding
            if not moved.max() < MOST_ROUNDING:
                moved = np.where(moved < MOST_ROUNDING, moved, 0.0)
            known = self._moved[id(rounding)] = rounding, moved
        return known[1]

    # -- series ------------------------------------------------------------------------------

    def series(self, series: Series | Local, rounding: Numbers = 0.0) -> Value:
        """The first order + 1 terms; the error is that of truncation and rounding.

        `rounding` is the rounding of the height of the exponential that the series goes with.
        """
        if not isinstance(series, Series):
            value, error = series.at(self)
            total = Value(value, error)
            if self.errors:
                total.error = plus(error, times(total.size, self._rounding(rounding)))
            return total
        value = 0.0
        for part in series.parts:
            front = self._front(part, self._horner(part.coefficients[: self.order + 1]))
            value = plus(value, front)
        total = Value(value, None)
        if self.errors:
            weight = self._rounding(rounding)
            if series.size is None:
                weight = plus(weight, series.rounding)
            cut = self._truncation(series.parts)
            for part in series.parts:
                if part.majorants is not None:
                    cut = plus(cut, self._allowed(part, part.majorants, total.size))
            total.error = plus(cut, times(total.size, weight))
            if series.size is not None:
                part = series.parts[0] if series.parts else Part(1.0, 0, [])
                cancels = self._front(part, self._horner(series.size[: self.order + 1]))
                total.error = plus(total.error, times(cancels, series.rounding))
        return total

    def _allowed(self, part: Part, majorants: Majorants, size: Numbers) -> Any:
        """A share of what majorants of the terms behind the next two allow.

        But no more than tells that little is known, since the value is of this `size`.
        """
        first = self.order + 1 + BEYOND
        rows = trimmed(majorants.behind(first))
        if isinstance(self.lam, np.ndarray):
            rows = self._worth_adding(rows, part.coefficients[self.order + 1 : first])
        later = self._horner(rows)
        if isinstance(later, float) and later == 0:
            return later
        # The first terms of both sides of a kink cancel.
        size = higher(size, self._front(part, majorants.full[0]))
        allowed = self._front(part, _SHARE * later * self.power(float(first)))
        return lower(allowed, _MOST_SHARE * size)

    def _worth_adding(self, later: list[Numbers], known: list[Numbers]) -> list[Numbers]:
        """Majorants without those that matter for no lam beside the first, or beside known terms.

        Both are the larger, the smaller lam is.
        """
        x = 1 / np.float64(self.least)
        sizes = [np.max(c) * x**n for n, c in enumerate(later)]
        near = sum(np.min(np.abs(c)) * x**n for n, c in enumerate(known))
        if sum(sizes) * x**BEYOND < _LITTLE * near:
            return []
        while sizes and sizes[-1] * len(later) < _LITTLE * np.min(later[0]):
            sizes.pop()
        return later[: len(sizes)]

    def _front(self, part: Part, value: Numbers) -> Any:
        """The value of a part from that of its bracket: times lam^-offset log(lam)^logs."""
        if isinstance(value, float) and value == 0:
            return value
        value = value * self.power(part.offset)
        return value * self.logs**part.logs if part.logs else value

    def _horner(self, coefficients: list[Numbers]) -> Any:
        """c_0 + c_1/lam + ..., by Horner."""
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

    def _truncation(self, parts: list[Part]) -> Any:
        """The next two terms over 1 - q where terms fall by a factor q, at most 3/4.

        Terms are sizes times powers of 1/lam: of one part without logarithms coefficients, so that
        q is one number times 1/lam.
        """
        first, total, front = self.order + 1, 0.0, 1.0
        parts = [part for part in parts if part.coefficients]
        longest = max((len(part.coefficients) for part in parts), default=0)
        if longest <= first:
            return total
        lead = min(map(_leading, parts))
        low = max(min(lead, first), first - _LOOK_BACK)
        if len(parts) == 1 and not parts[0].logs:
            sizes, front = [abs(c) for c in parts[0].coefficients], self.power(parts[0].offset)
        else:
            sizes = [abs(sum(self._front(p, c) for p, c in row)) for row in _rows(parts, longest)]
        sizes += [0.0] * (first + BEYOND - longest)
        q: Any = 0.0
        for before, after in pairwise(sizes[low : first + BEYOND]):
            q = higher(q, _ratio(before, after))
        near, far = self._first_of_later(sizes, lead)
        least, most = (float(q.min()), float(q.max())) if isinstance(q, np.ndarray) else (q, q)
        total = self.x * far
        total += near
        if least >= _MOST_FALL * self.most:
            total *= 1 / (1 - _MOST_FALL)
        else:
            rest = self.x * -q
            rest += 1
            if most > _MOST_FALL * self.least:
                rest = higher(rest, 1 - _MOST_FALL)
            total /= rest
        total *= times(self.power(float(first)), front)
        return total

    def _first_of_later(self, sizes: list[Numbers], lead: int) -> tuple[Any, Any]:
        """The next two sizes, with those further on where these two vanish."""
        first = self.order + 1
        near, far = sizes[first : first + BEYOND]
        if len(sizes) == first + BEYOND:
            return near, far
        # Infinite where Python's own floats raise.
        x = 1 / (np.float64(self.least) if isinstance(self.least, float) else self.least)
        for n, c in enumerate(sizes[first + BEYOND :], start=1):
            if np.any(near + far * x > self._small * sizes[lead] * x ** (lead - first)):
                break
            far = far + c * x**n
        return near, far
