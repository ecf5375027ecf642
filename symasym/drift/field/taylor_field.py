"""The drift in big rationals: Taylor coefficients of phi where an engine asks for them."""

from __future__ import annotations

import math
from fractions import Fraction
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.base.call_context import mpf_of, step
from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift
from symasym.numbers.complex_balls import ComplexBall, ComplexBallOps, resolved
from symasym.numbers.polynomials import float_zeros, poly, shifted
from symasym.numbers.trees import MpmathOps
from symasym.series.truncated_series import SeriesOps, TruncatedSeries

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

_MOST_BITS = 1_000_000
_MOST_EXTRA_BITS = 4096
# A series about a point serves within this part of the disk on which A is bounded.
_WITHIN = 8
# Where a formula is looked at for cancellation; at few points it may cancel exactly.
_PROBES = [Fraction(k, abs(k) + 3) for k in (-31, -17, -10, -5, -2, 1, 4, 7, 14, 23)]
_PLANNING = 32  # coefficients of it that plans see


class ExactField:
    """One scene's drift, or its mirror image -A(-u), at any number of digits.

    Parameters
    ----------
    drift : Drift
        Bound, scalar.
    mirrored : bool
    context : mpmath context
        Precision of what is not rational.
    offset : Fraction
        Added to A (before mirroring), where exactly A has no simple zeros.
    """

    def __init__(
        self, drift: Drift, mirrored: bool, context: MPContext, offset: Fraction = Fraction(0)
    ) -> None:
        self._drift, self._context = drift, context
        self._offset = -offset if mirrored else offset
        self.mirrored = mirrored
        self._sign = -1 if mirrored else 1
        self._about: dict[Fraction, list[Fraction]] = {}
        self._radii: dict[Fraction, Fraction] = {}
        self._extra_bits = 0
        self._edges: dict[tuple[Fraction, Fraction], Fraction] = {}
        known = drift.exact_coefficients()
        self._polynomial = None if known is None else [Fraction(c) for c in known]
        if self._polynomial is not None and mirrored:
            self._polynomial = [c if k % 2 else -c for k, c in enumerate(self._polynomial)]
        if self._polynomial is not None and offset:
            self._polynomial = self._polynomial or [Fraction(0)]
            self._polynomial[0] += Fraction(self._offset)

    @property
    def is_polynomial(self) -> bool:
        """True where A is a polynomial with rational coefficients."""
        return self._polynomial is not None

    def value(self, u: Fraction) -> Fraction:
        """phi(u), to working precision where it is not rational."""
        if self._polynomial is not None:
            return Fraction(poly(self._polynomial, u))
        if abs(u) == 1 and (known := self._drift.end(self._sign * int(u))) is not None:
            return self._sign * known + self._offset
        with self._context.workprec(self._context.prec + self._extra_bits):
            ops = MpmathOps(self._context)
            value = to_fraction(self._drift.evaluate(ops.rational(self._sign * u), ops))
        return self._sign * value + self._offset

    def float_values(self, u: FloatArray) -> FloatArray:
        """phi in float64, for planning."""
        with np.errstate(all="ignore"):
            values: FloatArray = self._sign * self._drift.evaluate_float(self._sign * u)
        return np.broadcast_to(values, u.shape)

    def spread(self, centre: Fraction, radius: Fraction, finest: Fraction = Fraction(1)) -> mpf:
        """A bound on the change of A over this complex ball, maybe infinite; its edges are told
        from what is a part of `finest` away."""
        least = min(radius, finest)
        bits = 64 + max(0, least.denominator.bit_length() - least.numerator.bit_length())
        context = self._context
        with context.workprec(bits):
            ball, ops = _disk(self._sign * centre, radius, context, bits)
            try:
                bound = (self._drift.evaluate(ball, ops) + 0 * ball).radius
            except (ArithmeticError, ValueError):  # mpmath's words for infinity
                return context.inf
            return bound if bound < context.inf else context.inf

    def taylor(self, centre: Fraction, scale: Fraction, order: int) -> list[Fraction]:
        """Coefficients of phi(centre + scale s) in s; all of them for a polynomial."""
        if self._polynomial is not None:
            return [c * scale**k for k, c in enumerate(shifted(self._polynomial, centre))]
        with self._context.workprec(self._context.prec + self._extra_bits):
            about = self._sign * centre, self._sign * scale, order
            line, ops = _line(*about, self._context, self._context.prec)
            series = self._drift.evaluate(line, ops)
        coefficients = [self._sign * c for c in TruncatedSeries.fractions(series, ops)]
        coefficients[0] += self._offset
        return coefficients

    def sharpen(self) -> None:
        """Find Taylor coefficients with more bits from now on."""
        self._extra_bits += 64
        if self._extra_bits > _MOST_EXTRA_BITS:
            raise AccuracyError(
                "A varies too fast or cancels too much inside [-1, 1] for the digits asked for; "
                "ask for fewer digits or write A so that its terms do not cancel."
            )

    def resolve(self) -> None:
        """Take as many more bits from now on as the formula cancels."""
        unit, close = Fraction(1, 1 << (self._context.prec - 8)), self._polynomial is not None
        while not close:
            values = [self.value(u) for u in _PROBES]
            self._extra_bits *= 2
            self.sharpen()
            again = [self.value(u) for u in _PROBES]
            pairs = zip(values, again, strict=True)
            close = all(abs(a - b) <= unit * max(Fraction(1), abs(b)) for a, b in pairs)

    def about_middle(self, centre: Fraction, t0: Fraction, t1: Fraction) -> list[float]:
        """Taylor coefficients of phi about the middle of [centre + t0, centre + t1], in units
        of half its width; floats, for planning."""
        unit = self._radius(centre, t0, t1)
        if unit is None:
            coefficients = self.taylor(centre + (t0 + t1) / 2, (t1 - t0) / 2, 16)
            return [float(c) for c in coefficients]
        # About a zero of A these floats keep their relative precision.
        known = self._about[centre] if self.is_polynomial else self._about[centre][:_PLANNING]
        about = shifted([float(c) for c in known], float((t0 + t1) / 2 / unit))
        half = float((t1 - t0) / 2 / unit)
        return [c * half**k for k, c in enumerate(about)]

    def integral(self, centre: Fraction, t0: Fraction, t1: Fraction, order: int) -> Fraction:
        """int phi over [centre + t0, centre + t1]."""
        unit = self._radius(centre, t0, t1)
        if unit is None:
            half = (t1 - t0) / 2
            c = self.taylor(centre + t0 + half, half, order)
            return 2 * half * sum((x / (k + 1) for k, x in enumerate(c) if k % 2 == 0), Fraction(0))
        return self._primitive(centre, t1, unit) - self._primitive(centre, t0, unit)

    def _primitive(self, centre: Fraction, t: Fraction, unit: Fraction) -> Fraction:
        """int phi over [centre, centre + t]; neighbouring panels share their edges."""
        integral = self._edges.get((centre, t))
        if integral is None:
            c = [x / (k + 1) for k, x in enumerate(self._about[centre])]
            x = t / unit
            if self._polynomial is None and t:
                bits = self._context.prec + 64
                # The terms that are not below 2^-bits.
                c = c[: bits // max(places(x) - 2, 1) + 2]
                with self._context.workprec(bits):
                    mean = poly([mpf_of(a, self._context) for a in c], mpf_of(x, self._context))
                integral = t * to_fraction(mean)
            else:
                integral = t * poly(c, x)
            self._edges[centre, t] = integral
        return integral

    def _radius(self, centre: Fraction, t0: Fraction, t1: Fraction) -> Fraction | None:
        """Unit of `_about[centre]`, the Taylor coefficients that serve from t0 to t1; None if none
        are known to.

        By Cauchy's bound on a disk of that radius, on which A changes by at most 2^20 times its
        largest coefficient, n terms leave less than 2^20 8^-n of that on an eighth of it.
        """
        if self._polynomial is not None:
            if centre not in self._about:
                self._about[centre] = self.taylor(centre, Fraction(1), 0)
            return Fraction(1)
        radius, least = self._radii.get(centre, Fraction(1, 2)), _WITHIN * max(abs(t0), abs(t1))
        while centre not in self._about and radius >= least:
            size = max(map(abs, self.taylor(centre, radius, 8)))
            if self.spread(centre, radius) <= mpf_of(size * (1 << 20), self._context):
                bits = self._context.prec + 64
                self._about[centre] = self.taylor(centre, radius, bits // 3 + 8)
                break
            radius /= 2
        self._radii[centre] = radius
        return radius if radius >= least else None

    def mirror(self) -> ExactField:
        """The field as it is seen in the mirror."""
        offset = -self._offset if self.mirrored else self._offset
        return ExactField(self._drift, not self.mirrored, self._context, offset)

    def value_and_slope(self, u: mpf) -> tuple[mpf, mpf]:
        """phi(u) and phi'(u) for an mpf u in the layer."""
        if self._polynomial is None:
            return self.number(u), self.slope(u)
        falling = [mpf_of(c, self._context) for c in self._polynomial[::-1]]
        value, slope = self._context.polyval(falling, u, derivative=True)
        return value, slope

    def number(self, u: mpf) -> mpf:
        """phi(u) for an mpf u."""
        ops = MpmathOps(self._context)
        value = self._sign * self._drift.evaluate(self._sign * self._context.mpf(u), ops)
        return value + ops.rational(self._offset) if self._offset else value

    def slope(self, u: mpf) -> mpf:
        """phi'(u) for an mpf u inside (-1, 1)."""
        ops = SeriesOps(2, self._context)
        point = ops.variable(self._sign * u)
        # The mirror image changes both the sign of A and that of du.
        return TruncatedSeries.coefficients_of(self._drift.evaluate(point, ops), ops)[1]

    def polish(self, u: mpf) -> mpf:
        """The simple zero of A near the mpf u, by Newton to working precision."""
        x = self._context.mpf(u)
        for _ in range(self._context.prec.bit_length() + 4):
            step = self.number(x) / self.slope(x)
            x -= step
            if abs(step) < self._context.ldexp(1, -self._context.prec // 2 - 8):
                break
        return x

    def potential_rise(self, lo: mpf, hi: mpf) -> mpf:
        """V(hi) - V(lo) for mpf arguments inside [-1, 1]."""
        if self._polynomial is None:
            edges = self._resolved_edges(lo, hi)
            pieces = (self._context.quad(self.number, pair) for pair in pairwise(edges))
            return -self._context.fsum(pieces)
        means = [mpf_of(c / (k + 1), self._context) for k, c in enumerate(self._polynomial)]
        return poly(means, lo) * lo - poly(means, hi) * hi

    def _resolved_edges(self, lo: mpf, hi: mpf) -> list[Any]:
        """[lo, hi] cut so that nothing narrower than a piece hides in it."""
        waiting, edges = [(lo, hi)], [lo]
        while waiting:
            step()
            a, b = waiting.pop()
            middle, width = to_fraction((a + b) / 2), to_fraction(abs(b - a))
            size = max(abs(self.number(x)) for x in (a, (a + b) / 2, b))
            # A piece that small is beyond what the integral's digits can tell.
            if resolved(self.spread(middle, width), size) or places(width) > self._context.prec:
                edges.append(b)
            else:
                waiting += [((a + b) / 2, b), (a, (a + b) / 2)]
        return edges

    def zeros(self, lo: Fraction, hi: Fraction, bits: int = 0) -> list[Fraction]:
        """Zeros of A in (lo, hi), and real parts of zeros close to it, refined by Newton to `bits`
        or working precision."""
        if self._polynomial is not None:
            rough = [float(x.real) for x in float_zeros(self._polynomial) if abs(x.imag) < 0.25]
        else:
            from symasym.drift.landscape import float_marks

            drift = self._drift
            rough = [self._sign * u for u in float_marks(drift.evaluate_float, drift.spread)]
        bits = max(bits, self._context.prec)
        return [self._refined(Fraction(x), bits) for x in rough if lo < x < hi]

    def monotone_marks(self) -> list[float]:
        """Points in float64 between which A is monotone."""
        if self._polynomial is None:
            from symasym.drift.landscape import float_marks

            marks = float_marks(self._drift.evaluate_float, self._drift.spread)
        else:
            roots = float_zeros([k * c for k, c in enumerate(self._polynomial)][1:])
            marks = [self._sign * x for x in roots.real.tolist()]
        return [self._sign * x for x in marks]

    def _refined(self, x: Fraction, bits: int) -> Fraction:
        """The zero of A near x by Newton's method, or x where A' is too small for it."""
        for _ in range(12):
            value, slope = self.taylor(x, Fraction(1), 2)[:2]
            if slope == 0 or abs(value) > abs(slope) / 1000:
                break
            step = dyadic(value / slope, bits)
            if step == 0:
                break
            x -= step
        return x


@lru_cache(maxsize=4)
def _disk(
    centre: Fraction, radius: Fraction, context: MPContext, bits: int
) -> tuple[ComplexBall, ComplexBallOps]:
    """This complex ball, and the arithmetic in which drifts share what they have in common."""
    ops = ComplexBallOps(MpmathOps(context), known={})
    return ops.ball(ops.rational(centre), ops.rational(radius)), ops


@lru_cache(maxsize=4)
def _line(
    centre: Fraction, scale: Fraction, order: int, context: MPContext, bits: int
) -> tuple[TruncatedSeries, SeriesOps]:
    """centre + scale s, and the arithmetic in which drifts share what they have in common there."""
    ops = SeriesOps(order, context, {})
    return ops.variable(centre, scale), ops


def to_fraction(x: mpf) -> Fraction:
    """The exact value of an mpf."""
    sign, mantissa, exponent, _ = x._mpf_
    if not mantissa:
        if exponent:
            raise AccuracyError("A is not finite on [-1, 1]; give an A that is smooth there.")
        return Fraction(0)
    size = exponent + int(mantissa).bit_length()
    if size > _MOST_BITS:
        raise AccuracyError("A is beyond 2^1000000 on [-1, 1]; rescale the problem.")
    if size < -_MOST_BITS:
        return Fraction(0)  # far below the last digit of anything
    numerator = -int(mantissa) if sign else int(mantissa)
    if exponent >= 0:
        return Fraction(numerator << exponent)
    return Fraction(numerator, 1 << -exponent)


def places(x: Fraction) -> int:
    """Binary places before the first significant bit of `x`, which is not 0."""
    return x.denominator.bit_length() - x.numerator.bit_length() + 1 if x else 1 << 30


def dyadic(x: Fraction | float, bits: int) -> Fraction:
    """A short dyadic rational within 2^-bits of `x`, and within 1 of it for negative `bits`."""
    bits = max(bits, 0)
    return Fraction(math.floor(x * (1 << bits) + Fraction(1, 2)), 1 << bits)
