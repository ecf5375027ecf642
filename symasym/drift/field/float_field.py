"""The drift in float64 for many scenes at once, each to be swept from the left.

The engine only sweeps left to right; a sweep from the right is a sweep of the
mirrored drift -A(-u). Both fields below therefore hold each scene with a sign.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from functools import lru_cache, partial
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symasym.base.call_context import own_context, step
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift, FlatValues
from symasym.numbers.complex_balls import ComplexBall, resolved
from symasym.numbers.float_arrays import DoubleDouble, DoubleDoubleOps, ends_of, shift
from symasym.numbers.polynomials import poly, real_parts

if TYPE_CHECKING:
    from symasym.series.truncated_series import SeriesOps

#: Where the size of A is first looked at.
_GRID = np.cos(np.pi * np.arange(33) / 32)

#: Units of truncated Taylor series, in bits, so that their coefficients fit float64.
_FINEST = 50
#: Taylor series that are kept of one drift.
_MOST_ROWS = 256

IntArray = np.ndarray[Any, np.dtype[np.intp]]


class Field(Protocol):
    """Drift of `len(sign)` scenes; `sign` is -1 for the mirrored ones."""

    sign: FloatArray
    a_minus: FloatArray
    a_plus: FloatArray

    def phi(self, scene: IntArray, u: FloatArray) -> FloatArray:
        """Drift at the points `u`, one row per entry of `scene`."""
        ...

    def size(self) -> FloatArray:
        """A bound on |A| that rounding errors of `phi` are relative to, per scene."""
        ...

    def turning(self, scene: IntArray) -> FloatArray:
        """Real parts of the zeros of A'; rows padded with nan."""
        ...

    def taylor(self, scene: IntArray, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Taylor coefficients at `centre`, each right to about 1e-32 of `size`, and
        the distance up to which their polynomial is right to rounding."""
        ...


def field_of(drift: Drift, values: dict[str, Any], count: int) -> Field:
    """The field of `drift` for `count` scenes and their mirror images.

    That of a polynomial stays beside `values` that the drift keeps (`Drift.flat_values`).
    """
    kept = values if isinstance(values, FlatValues) else None
    if kept is not None and kept.field is not None:
        known: PolynomialField = kept.field
        return known
    pairs = {name: DoubleDouble.of(value) for name, value in values.items()}
    with np.errstate(over="ignore", invalid="ignore"):  # nan beyond 1e300
        coefficients = drift.coefficients(pairs, DoubleDoubleOps())
    if coefficients is None or len(coefficients) > 13:
        shaped = {name: pair.broadcast_to((count,)) for name, pair in pairs.items()}
        return AnalyticField(drift, shaped, count)
    field = PolynomialField([DoubleDouble.of(c) for c in coefficients], count)
    if kept is not None:
        kept.field = field
    return field


def extremes(field: Field, scene: IntArray) -> FloatArray:
    """Zeros of A' and then some inside [-1, 1], sorted, one row per entry of `scene`.

    Between neighbours, and the ends, A is monotone. Rows are padded with 1.
    """
    turning: FloatArray = np.clip(np.nan_to_num(field.turning(scene), nan=1.0), -1.0, 1.0)
    return np.sort(turning, axis=1)


class PolynomialField:
    """A is a polynomial of modest degree."""

    def __init__(self, coefficients: list[DoubleDouble], count: int) -> None:
        self._count, self._pairs = count, coefficients
        self._c = np.empty((len(coefficients), 2 * count))
        for k, pair in enumerate(coefficients):
            self._c[k, :count] = pair.hi
            # Mirror images are -A(-u).
            self._c[k, count:] = pair.hi if k % 2 else -pair.hi
        self.sign = np.repeat((1.0, -1.0), count)
        self._size: FloatArray = np.abs(self._c).sum(axis=0)
        low, high = ends_of(coefficients, count)
        self.a_minus, self.a_plus = np.concatenate((low, -high)), np.concatenate((high, -low))

    def phi(self, scene: IntArray, u: FloatArray) -> FloatArray:
        """Drift at `u`, by Horner's rule."""
        c = self._c[:, scene]
        value: FloatArray = poly(list(c[:, :, None]), u)
        return value

    def size(self) -> FloatArray:
        """Sum of the moduli of the coefficients of A."""
        return self._size

    def turning(self, scene: IntArray) -> FloatArray:
        """Real parts of the zeros of A'."""
        k = np.arange(1, len(self._c))
        return _zeros_of(k * self._c[1:, scene].T) if k.size else np.full((len(scene), 1), np.nan)

    def taylor(self, scene: IntArray, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Taylor coefficients in double-doubles, right at any distance."""
        sign, original = self.sign[scene], scene % self._count
        signs = [sign if k % 2 == 0 else np.ones(len(scene)) for k in range(len(self._pairs))]
        pairs = [
            DoubleDouble(s * c.hi[original], s * c.lo[original])
            for pair, s in zip(self._pairs, signs, strict=True)
            for c in (pair.broadcast_to((self._count,)),)
        ]
        local = shift(pairs, centre)
        return np.array(local).T, np.full(len(scene), np.inf)


def _zeros_of(c: FloatArray) -> FloatArray:
    """Real parts of the zeros of polynomials, ascending powers in rows; padded with nan."""
    degree = c.shape[1] - 1
    zeros = np.full((len(c), max(degree, 1)), np.nan)
    scale = np.abs(c).max(axis=1, keepdims=True)
    c = c / np.where(scale == 0, 1.0, scale)
    # A leading coefficient below rounding sends its zero far outside [-1, 1].
    effective = np.where(np.abs(c) > 1e-300, np.arange(degree + 1), 0).max(axis=1)
    for d in range(1, degree + 1):
        rows = np.flatnonzero(effective == d)
        if rows.size:
            zeros[rows, :d] = real_parts(c[rows, : d + 1].T).T
    return zeros


@dataclass
class _Known:
    """Zeros and extremes of a drift, and its Taylor series by their centres."""

    marks: FloatArray | None
    rows: dict[float, FloatArray]


@lru_cache(maxsize=256)
def _known(formula: object, parameters: bytes) -> _Known:
    """The analysis kept for the drift of this formula and parameters."""
    return _Known(None, {})


class AnalyticField:
    """A is any analytic function; a stiff scene pays for a few Taylor series at 40 digits."""

    ORDER = 16

    def __init__(
        self,
        drift: Drift,
        pairs: dict[str, DoubleDouble],
        count: int,
    ) -> None:
        self._drift, self._pairs = drift, pairs
        self._values = {name: np.tile(p.hi, 2) for name, p in pairs.items()}
        self._count = count
        self.sign = np.repeat((1.0, -1.0), count)
        # Scenes of one drift share its analysis, which costs far more than finding them.
        ordered = [pairs[name] for name in sorted(pairs)]
        numbers = [x for p in ordered for x in (p.hi, p.lo)] or [np.zeros(count)]
        kinds, index = np.unique(np.array(numbers), axis=1, return_inverse=True)
        self._kinds, self._kind = kinds.T, index.ravel()
        everyone = np.arange(2 * count)
        ends = self.phi(everyone, np.tile((-1.0, 1.0), (2 * count, 1)))
        self.a_minus, self.a_plus = ends.T.copy()
        sampled = self.phi(everyone, np.tile(_GRID, (2 * count, 1)))
        self._size: FloatArray = np.abs(sampled).max(axis=1)
        # Outside [-1, 1] an error in the drift is multiplied by lam r: an ulp of the largest
        # number on the way to it, the argument of a sine for instance, would be too much.
        for side, mine, mirrored in (
            (-1, self.a_minus, self.a_plus),
            (1, self.a_plus, self.a_minus),
        ):
            end = DoubleDouble.of(self._end(side)).broadcast_to((count,)).hi
            mine[:count], mirrored[count:] = end, -end

    def _end(self, side: int) -> Any:
        """A(side), exact where it is rational, else in double-doubles."""
        if not self._drift.shape and not self._drift.free:
            return self._drift.ends[side > 0]
        known = self._drift.exact_end(self._pairs, side)
        if known is not None:
            return known
        one = DoubleDouble.of(np.full(self._count, float(side)))
        return self._drift.evaluate_values(one, self._pairs, DoubleDoubleOps())

    def phi(self, scene: IntArray, u: FloatArray) -> FloatArray:
        """Drift at `u`, in double precision as the model writes it."""
        sign = self.sign[scene][:, None]
        values = {name: value[scene][:, None] for name, value in self._values.items()}
        with np.errstate(all="ignore"):
            raw = self._drift.evaluate_float(u * sign, values)
        result: FloatArray = sign * np.broadcast_to(raw, u.shape)
        return result

    def _phi_of_one(self, scene: list[int], u: FloatArray) -> FloatArray:
        result: FloatArray = self.phi(np.array(scene), u[None, :])[0]
        return result

    def _spread_of_one(self, scene: int, centre: FloatArray, radius: FloatArray) -> ComplexBall:
        return self.spread(np.full(len(centre), scene), centre, radius)

    def size(self) -> FloatArray:
        return self._size

    def spread(self, scene: IntArray, centre: FloatArray, radius: FloatArray) -> ComplexBall:
        """Complex balls that hold A on the balls of these centres and radii."""
        sign = self.sign[scene]
        values = {name: value[scene] for name, value in self._values.items()}
        image: ComplexBall = sign * self._drift.spread(sign * centre, radius, values)
        return image

    def turning(self, scene: IntArray) -> FloatArray:
        """Zeros and extremes of A on [-1, 1], by Chebyshev proxies: zeros do no harm."""
        rows = [self._marks_of(int(s)) for s in scene]
        width = max([len(row) for row in rows] + [1])
        return np.array(
            [np.pad(row, (0, width - len(row)), constant_values=np.nan) for row in rows]
        )

    def _known(self, scene: int) -> _Known:
        """The analysis of the drift of a scene that is not mirrored."""
        return _known(self._drift.model, self._kinds[self._kind[scene]].tobytes())

    def _marks_of(self, scene: int) -> FloatArray:
        """Zeros and extremes of one scene, a mirror image's from what it mirrors."""
        from symasym.drift.landscape import float_marks

        original = scene % self._count
        known = self._known(original)
        if known.marks is None:
            known.marks = np.asarray(
                float_marks(
                    partial(self._phi_of_one, [original]), partial(self._spread_of_one, original)
                )
            )
        marks = known.marks
        return marks if self.sign[scene] > 0 else -marks[::-1]

    def taylor(self, scene: IntArray, centre: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Taylor coefficients, from series at 45 digits, and how far they are good."""
        from symasym.series.truncated_series import SeriesOps

        rows, radii = [], []
        with own_context(45) as context:
            ops = SeriesOps(self.ORDER, context)
            powers = np.arange(self.ORDER)
            for s, c in zip(scene, centre, strict=True):
                sign, original = self.sign[s], int(s) % self._count
                known, at = self._known(original).rows, float(sign * c)
                if at not in known:
                    if len(known) > _MOST_ROWS:
                        known.clear()
                    known[at] = self._taylor_of_one(original, at, ops)
                rows.append(sign * known[at] * sign**powers)
                radii.append(_trust(rows[-1]))
        return np.array(rows), self._resolved(scene, centre, np.array(rows), np.array(radii))

    def _taylor_of_one(self, scene: int, centre: float, ops: SeriesOps) -> FloatArray:
        """Taylor coefficients of A, not mirrored, from a series in units of 2^-shift.

        A series's digits are relative to its largest coefficient, so beside a narrow feature
        the unit shrinks until that is not one of the last.
        """
        from symasym.series.truncated_series import TruncatedSeries

        values = {n: ops.rational(self._exact_value(p, scene)) for n, p in self._pairs.items()}
        last = range(self.ORDER - 4, self.ORDER)
        shift = 0
        while True:
            step()
            point = ops.variable(Fraction(centre), Fraction(1, 1 << shift))
            series = self._drift.evaluate_values(point, values, ops)
            scaled = TruncatedSeries.coefficients_of(series, ops)
            lead = ops.context.mag(max(self._size[scene], abs(scaled[0])))
            # What is lost can swamp the first coefficients, never the last ones.
            rate = max(
                [(ops.context.mag(scaled[k]) - lead) / k for k in last if scaled[k]], default=0.0
            )
            if not 3 < rate < np.inf or shift > _FINEST:
                break
            shift += math.ceil(rate)
        return np.array([float(ops.context.ldexp(x, k * shift)) for k, x in enumerate(scaled)])

    def _resolved(
        self, scene: IntArray, centre: FloatArray, rows: FloatArray, radii: FloatArray
    ) -> FloatArray:
        """`radii`, halved until A has nothing within twice of them that the rows do not see."""
        active = np.isfinite(radii) & (radii > 0)
        radii = np.minimum(radii, 2.0)
        while active.any():
            step()
            change = self.spread(scene, centre, 2 * radii).radius
            size = (np.abs(rows) * radii[:, None] ** np.arange(rows.shape[1])).sum(axis=1)
            active &= ~resolved(change, size) & (radii > 1e-14)
            radii = np.where(active, radii / 2, radii)
        return radii

    @staticmethod
    def _exact_value(pair: DoubleDouble, index: int) -> Fraction:
        return Fraction(float(pair.hi[index])) + Fraction(float(pair.lo[index]))


def _trust(row: FloatArray) -> float:
    """Distance up to which the truncated Taylor polynomial is right to rounding.

    The first coefficients may vanish by design (a critical point), so the error
    is held against the larger of the first terms at that distance.
    """
    k = np.arange(8, len(row))
    # Any one of the last coefficients may vanish by chance: what counts is their envelope.
    rate = float(np.max(np.abs(row[k] / (np.abs(row[:4]).max() or 1.0)) ** (1 / k)))
    if rate == 0:
        return np.inf
    t = 0.1 / rate
    for _ in range(60):
        lead = np.max(np.abs(row[:4] * t ** np.arange(4)))
        if lead > 0:
            envelope = np.max((np.abs(row[k]) * t**k / lead) ** (1 / k))
            if envelope ** len(row) < 1e-18:
                return float(t)
        t /= 2
    return 0.0
