"""One-sided expansions of one drift to any digits: any A, and a start on a zero of A.

The text is that of `symasym.asymptotics.weak_noise.one_sided`; here are the zeros of A, bracketed
between the points where A turns and refined by Newton, A's Taylor coefficients in rational
arithmetic, the refusals where a series' next terms vanish, and the series at a start on a well or
a barrier, whose halves of Gaussians bring log(lam) into the regular part.
"""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from symasym.asymptotics.weak_noise.one_sided import (
    Builder,
    CriticalPoint,
    OneSided,
    endpoint_coefficients,
    endpoint_majorants,
    inverse_coefficients,
    majorants,
)
from symasym.asymptotics.weak_noise.regular_part import panel_integrals, polynomial_primitives
from symasym.asymptotics.weak_noise.series import (
    BEYOND,
    FURTHER,
    ROUNDING,
    Local,
    Majorants,
    Numbers,
    Part,
    Series,
    trimmed,
)
from symasym.base.call_context import mpf_of
from symasym.base.errors import AccuracyError, InputError
from symasym.drift.field.taylor_field import ExactField, to_fraction
from symasym.numbers.arithmetic import Digits, Number
from symasym.numbers.polynomials import bracketed_zero, laurent, power

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

# A at a zero of its slope, below which that point in float64 is not good enough.
_BESIDE = Fraction(1, 10**20)
# Two turning points of A closer than this are one, found twice.
_SAME = Fraction(1, 10**9)
# Taylor coefficients that are looked at before A is taken to be constant.
_FLATTEST = 64

#: Terms (c, p, q) standing for c lam^-p log(lam)^q, by the whole part of their order.
Groups = list[list[tuple[Any, Any, int]]]


def series_of(groups: Groups, unit: mpf, known: dict[float, Majorants | None]) -> Series:
    """The series of terms (c, p, q), known to the relative rounding `unit`.

    `known` are majorants of the parts without logarithms, by their offset: such a part may have
    later terms alone.
    """
    parts: dict[tuple[float, int], list[Any]] = {(offset, 0): [] for offset in known}
    for n, group in enumerate(groups):
        for c, p, q in group:
            row = parts.setdefault((float(p) - n, q), [])
            row += [0.0] * (len(groups) - len(row))
            row[n] += c
    rows = {key: trimmed(c) for key, c in parts.items()}
    found = [(key, row, None if key[1] else known.get(key[0])) for key, row in rows.items()]
    return Series([Part(*key, row, more) for key, row, more in found if row or more], unit)


def both_sides(
    field: ExactField,
    x: Fraction,
    r: Fraction,
    order: int,
    context: MPContext,
    regular: int,
    estimated: bool = True,
) -> tuple[OneSided, OneSided]:
    """The one-sided expansions left of `x`, mirrored, and right of it, out to `r`.

    The regular part is to `regular` digits, or left out for 0. Where the next terms have to give
    the error (`estimated`), zeros of A where they vanish are refused.
    """
    for u in (Fraction(-1), Fraction(1)):
        if not field.value(u):
            raise InputError(
                "a- or a+ is 0, a tangency, where the weak-noise series has no terms; use "
                "method='exact'."
            )
    for u in (-r, r):
        if r < 1 and not field.value(u):
            raise InputError(
                f"r is {float(r):.6g} and A is 0 at u = {float(u):.6g}, where the weak-noise "
                "series of an end has no terms; use method='exact'."
            )
    return _FieldBuilder(field, x, r, order, context, regular, estimated).both_sides()


def whole(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """Critical points of int e^{-lam V} over the line where it converges, V measured from -1."""
    right = both_sides(field, Fraction(-2), Fraction(2), order, context, 0)[1]
    height = right.speed_points[0].height
    return [p._replace(height=p.height - height) for p in right.speed_points]


def wells_and_barriers(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """All of [-1, 1], left to right, V measured from -1."""
    builder = _FieldBuilder(field, Fraction(-1), Fraction(2), order, context)
    builder.base = context.zero
    scale_points: list[CriticalPoint] = []
    speed_points: list[CriticalPoint] = []
    builder.between(1, scale_points, speed_points)
    return sorted(scale_points + speed_points, key=lambda point: point.u)


def barriers(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """Barriers of [-1, 1], V measured from -1."""
    return [p for p in wells_and_barriers(field, order, context) if p.kind == "barrier"]


def zeros_and_finite_parts(
    field: ExactField, x: Fraction, order: int, context: MPContext, digits: int
) -> tuple[list[Any], dict[int, list[Any]]]:
    """Zeros of A beside the start x; int h_k to its left in the mirror (-1) and its right (1)."""
    builder = _FieldBuilder(field, x, abs(x) + 2, order, context, digits, False)
    return builder.zeros, builder.primitives()


class _FieldBuilder(Builder):
    """One drift, in the digits of a context; `edges` are exact rationals."""

    def __init__(
        self,
        field: ExactField,
        x: Fraction,
        r: Fraction,
        order: int,
        context: MPContext,
        regular: int = 0,
        estimated: bool = True,
    ) -> None:
        self.arithmetic = Digits(context)
        self.field, self.context, self.digits, self.must_tell = field, context, regular, estimated
        self.count, self.degree = order + 1 + BEYOND, 0
        self.height_size = self.height_rounding = 0.0
        self.least = self.unit = 64 * context.eps
        reach = min(r, Fraction(1))
        self.edges = [-reach, min(max(x, -reach), reach), reach]
        self.x, self.beyond = x, r > 1
        self.start = self.arithmetic.number(x)
        self.a_minus, self.a_plus = (
            self.arithmetic.number(field.value(Fraction(side))) for side in (-1, 1)
        )
        self.at_zero = abs(x) < 1 and not field.value(x)
        sides = zip(self.edges[:2], self.edges[1:], strict=True)
        left, right = (simple_zeros(field, lo, hi, context) if lo < hi else [] for lo, hi in sides)
        self.zeros, self.barriers = ([z[k] for z in left + right] for k in (0, 1))
        self.before = len(left)

    # -- the drift --------------------------------------------------------------------------

    def inside(self, sign: int) -> list[int]:
        return list(range(self.before, len(self.zeros)) if sign > 0 else range(self.before)[::-1])

    def barrier(self, k: int) -> bool:
        return bool(self.barriers[k])

    def exact_taylor(self, u: Numbers, count: int) -> list[Fraction]:
        """Taylor coefficients of A at a rational or an mpf; all of them for a polynomial."""
        return self.field.taylor(to_fraction(u) if hasattr(u, "_mpf_") else u, Fraction(1), count)

    def taylor(self, u: Numbers, count: int | None = None) -> list[Any]:
        exact = self.exact_taylor(u, 2 * self.count + 2 if count is None else count)
        return [mpf_of(c, self.context) for c in exact]

    def potential(self, u: Numbers) -> Any:
        lo, hi = (self.arithmetic.number(x) for x in (self.edges[1], u))
        return self.field.potential_rise(lo, hi)

    # -- series -----------------------------------------------------------------------------

    def smooth(self, u: Numbers, value: Numbers = None) -> Series:
        if self.at_zero and u == self.x:
            return Series([])
        taylor = self.taylor(u, self.count + 1 + FURTHER)
        h = endpoint_coefficients(taylor, self.count)
        if not any(h[-BEYOND:]) and any(self.exact_taylor(u, _FLATTEST)[1:]):
            raise self.no_estimate("flat", u)
        known = endpoint_majorants(taylor, self.count)
        return Series([Part(1.0, 0, trimmed(h), known)], self.least)

    def saddle(self, k: int) -> Series:
        taylor = self.taylor(self.zeros[k], 2 * self.count + 2 + FURTHER)
        inverse = inverse_coefficients(taylor, 2 * self.count, 2, self.context.one)
        self.require_estimate(self.zeros[k], abs(taylor[1]), inverse, 2)
        return self.gaussian(inverse, taylor, self.least)

    def no_estimate(self, shape: str, u: Numbers) -> AccuracyError:
        """The refusal of a point where the series' next terms vanish."""
        return AccuracyError(
            f"A is {shape} to order {self.count} at u = {float(u) + 0.0:.6g}, where the series' "
            "next terms vanish and do not tell its error; give another order, or use "
            "method='exact'."
        )

    def require_estimate(self, u: Numbers, slope: mpf, inverse: list[Any], step: int) -> None:
        """Refuse a zero of A where the last of a_0, a_step, ... all but vanish.

        But not where A is straight and has no others.
        """
        c = self.context
        # A zero that is not rational leaves some rounding.
        small = c.ldexp(1, -c.prec // 2)
        after = range(len(inverse) - 2 * BEYOND // step, len(inverse))
        last = {step * n: inverse[n] / inverse[0] ** (step * n + 1) for n in after}
        if not self.must_tell or any(abs(x) > small for x in last.values()):
            return
        more = [abs(mpf_of(x, c)) for x in self.exact_taylor(u, _FLATTEST)[2:]]
        rates = [(x / slope) ** (c.one / j) for j, x in enumerate(more, start=1) if x]
        if rates and all(abs(x) <= small * max(rates) ** n for n, x in last.items()):
            raise self.no_estimate("straight", u)

    # -- the regular part -------------------------------------------------------------------

    def primitives(self) -> Any:
        """The regular part to its own number of digits: int h_k left of the start, and right."""
        c, edges = self.context, self.edges
        if not self.digits:
            return {-1: [], 1: []}
        # Taylor panels take a number of terms that grows with the digits.
        with c.workdps(min(self.digits, c.dps)):
            self.unit = c.eps * 2**24
            rows = polynomial_primitives(self.field, edges, self.count, c)
            if rows is not None:
                return {sign: [row[1 + sign] - row[1] for row in rows] for sign in (-1, 1)}
            shares = {}
            for sign in (-1, 1):
                field = self.field if sign > 0 else self.field.mirror()
                lo, hi = sign * edges[1], sign * edges[1 + sign]
                zeros = [sign * self.zeros[k] for k in self.inside(sign)]
                shares[sign] = (
                    panel_integrals(field, lo, hi, zeros, self.count, c) if lo < hi else []
                )
            return shares

    def regular_part(self, sign: int, extra: Numbers) -> Series:
        groups: Groups = [[] for _ in range(self.count)]
        if self.at_zero:
            self.add_corner(sign, groups)
        if extra:
            groups[0].append((extra, 1, 0))
        for k, value in enumerate(self.regular[sign]):
            groups[k].append((value, k + 1, 0))
        return series_of(groups, self.unit, {1.0: self.behind_regular(sign)} if any(groups) else {})

    # -- a start on a zero of A ---------------------------------------------------------------

    def beginning(self, sign: int) -> tuple[Series, Series, bool]:
        """The start is a well or a barrier: halves of Gaussians, and log(lam) in the regular part.

        With V - V(x) = ±s^2/2 and du = (a_0 + a_1 s + …) ds all integrals are known.
        """
        if not self.at_zero:
            return super().beginning(sign)
        c, taylor, a = self.context, *self.inverse(sign)
        self.require_estimate(self.x, abs(taylor[1]), a, 1)
        peak: Groups = [[] for _ in range(self.count)]
        formal: Groups = [[] for _ in range(self.count)]
        for i, coefficient in enumerate(a):
            exponent = c.mpf(i + 1) / 2
            size = coefficient * c.gamma(exponent) * 2**exponent / 2
            peak[i // 2].append((size, exponent, 0))
            if i % 2:
                formal[i // 2].append(((-1) ** (i // 2 + 1) * size, exponent, 0))
        # Of the whole Gaussian, where what is odd cancels, and of that in its halves.
        about = self.taylor(self.x, 2 * self.count + 2 + FURTHER)
        even, odd = (majorants(about, self.count, self.arithmetic, k) for k in (0, 1))
        own = series_of(peak, self.least, {0.5: even, 1.0: odd})
        other = series_of(formal, self.least, {1.0: odd})
        return (own, other, False) if taylor[1] > 0 else (other, own, True)

    def inverse(self, sign: int) -> tuple[list[Any], list[Any]]:
        """Taylor coefficients of phi at the start as it is seen to that side, and the a_i."""
        # Exact for a polynomial, where rounding would hide a multiple zero.
        taylor = self.taylor(self.x)
        if not taylor[1]:
            raise degenerate(self.x)
        taylor = [t * sign if j % 2 == 0 else t for j, t in enumerate(taylor)]
        return taylor, inverse_coefficients(taylor, 2 * self.count, 1, self.context.one)

    def add_corner(self, sign: int, groups: Groups) -> None:
        """Add the double integrals beside the start, and what its finite part is to change by.

        The finite part of `regular_part` leaves out powers of u - x, `_corner` those of s.
        """
        c = self.context
        taylor, a = self.inverse(sign)
        for i, p in enumerate(a):
            for j, q in enumerate(a[: len(a) - i]):
                if (i + j) // 2 < self.count:
                    groups[(i + j) // 2] += corner_terms(p * q, i, j, bool(taylor[1] > 0), c)
        taylor = [c.zero, *taylor[1:], *[c.zero] * (2 * self.count + 2 - len(taylor))]
        for k, (log, change) in enumerate(finite_part_change(taylor, a, self.count, c.one)):
            groups[k].append((-log * c.log(a[0]) - change, k + 1, 0))


def finite_part_change(
    taylor: list[Any], a: list[Any], count: int, one: Number
) -> Iterator[tuple[Any, Any]]:
    """Excess of int h_k of `regular_part` over that with powers of s left out, k = 1 to `count`.

    As a factor of log(a_0) and the rest; A has these Taylor coefficients at its zero, and
    u - x = a_0 s (1 + alpha_1 s + …).
    """
    alpha = [value / (a[0] * (i + 1)) for i, value in enumerate(a)]
    inverse = one / a[0]
    for k, series in enumerate(laurent(taylor, True, count)):
        top, change = 2 * k, 0 * one
        for j in range(top):
            p = top - j
            change += series[j] * power(alpha, -p, 1, p + 1, one)[p] * inverse**p / -p
        yield series[top], change


def corner_terms(weight: Any, i: int, j: int, barrier: bool, c: Any) -> list[tuple[Any, Any, int]]:
    """Finite part of the double integral of s^i t^j beside a zero of A, 0 < t < s.

    With e^{lam (t^2 - s^2)/2} at a barrier; at a well t > s and the other sign: what the
    whole half of the well counts too much. The Mellin transform in s at its pole, whose
    residue is the logarithm. For a well i and j are exchanged, and the sign changes.
    """
    sign = 1 if barrier else -1
    if not barrier:
        i, j = j, i
    power = c.mpf(i + j + 2) / 2
    unit = sign * weight * c.mpf(2) ** power / 4
    if i % 2 and (j % 2 == 0 or not barrier):
        return []
    if i % 2:
        n, m = (i - 1) // 2, (i + j + 2) // 2
        return [(-unit * (-1) ** (n + m) * c.factorial(n) * c.gamma(c.mpf(j + 1) / 2), power, 0)]
    bottom = c.gamma(c.mpf(1 - i) / 2)
    front = unit * c.gamma(c.mpf(j + 1) / 2) / bottom
    if j % 2:
        return [(front * c.pi / c.sin(c.pi * power), power, 0)]
    front *= (-1) ** ((i + j + 2) // 2)
    # psi(1/2 - m) = psi(1/2 + m), a finite sum (DLMF 5.4.15).
    m = i // 2 if barrier else j // 2
    constant = c.fsum(c.mpf(2) / (2 * k - 1) for k in range(1, m + 1)) - c.euler - c.log(2)
    return [(front * constant, power, 0), (-front, power, 1)]


# -- in float64 ------------------------------------------------------------------------------------


def _float_series(x: Series | Local | None) -> Any:
    """The series in float64; what is no series stays."""
    if not isinstance(x, Series):
        return x
    parts = []
    for offset, logs, coefficients, known in x.parts:
        if known is not None:
            known = Majorants(*([float(c) for c in row] for row in known))
        parts.append(Part(offset, logs, [float(c) for c in coefficients], known))
    return Series(parts, ROUNDING)


def in_float(one: OneSided) -> OneSided:
    """An expansion that was computed with more digits than float64 has, in float64."""
    scale_points, speed_points = (
        [
            p._replace(
                height=float(p.height),
                series=_float_series(p.series),
                onward=_float_series(p.onward),
            )
            for p in points
        ]
        for points in (one.scale_points, one.speed_points)
    )
    return one._replace(
        scale_start=_float_series(one.scale_start),
        speed_start=_float_series(one.speed_start),
        regular_part=_float_series(one.regular_part),
        scale_points=scale_points,
        speed_points=speed_points,
        beyond=one.beyond and tuple(float(x) for x in one.beyond),  # type: ignore[arg-type]
        # Heights cancel each other in pairs of critical points.
        height_rounding=3e-16
        * max([abs(p.height) for p in scale_points + speed_points], default=0.0),
    )


# -- zeros of A, and where it turns ----------------------------------------------------------------


def degenerate(u: Fraction | mpf) -> InputError:
    """The refusal of a multiple zero of A."""
    return InputError(
        f"A has a multiple zero at or beside u = {float(u):.6g}, where this series, for simple "
        "zeros, does not exist; use method='exact'."
    )


def simple_zeros(
    field: ExactField, lo: Fraction, hi: Fraction, context: MPContext
) -> list[tuple[Any, bool]]:
    """The zeros of A in (lo, hi), left to right, and whether each is a barrier.

    Raises
    ------
    InputError
        Where A touches zero.
    """
    marks = [Fraction(x) for x in field.monotone_marks()]
    # Beside a fold a mark in float64 may miss both zeros.
    near = [x for x in marks if lo < x < hi and abs(field.value(x)) < _BESIDE]
    marks = [refined_mark(field, x, context) if x in near else x for x in marks]
    edges = [lo, *sorted(x for x in marks if lo < x < hi), hi]
    values = [field.value(x) for x in edges]
    # At the start itself, what counts is the sign beside it.
    if not values[0]:
        values[0] = field.taylor(lo, Fraction(1), 2)[1]
    if not values[-1]:
        values[-1] = -field.taylor(hi, Fraction(1), 2)[1]
    zeros = []
    for k in range(1, len(edges)):
        low, high = values[k - 1], values[k]
        if not (low and high):
            raise degenerate(edges[k] if low else edges[k - 1])
        if (low > 0) != (high > 0):
            a, b = (mpf_of(e, context) for e in edges[k - 1 : k + 1])
            zeros.append((bracketed_zero(field.value_and_slope, a, b, context), bool(high > 0)))
    return zeros


def refined_mark(field: ExactField, mark: Fraction, context: MPContext) -> Fraction:
    """The zero of phi's slope beside `mark`, to all digits of the context, by Newton."""
    x = mark
    for _ in range(context.prec.bit_length() + 4):
        taylor = field.taylor(x, Fraction(1), 3)
        if len(taylor) < 3 or not taylor[2]:
            return mark
        step = to_fraction(_quotient(taylor[1], 2 * taylor[2], context))
        # A mark is good to some 1e-16, or to half of that beside another.
        if abs(step) > Fraction(1, 1000):
            return mark
        x -= step
        if abs(step) < Fraction(1, 2 ** (context.prec // 2 + 8)):
            break
    return x


def turning_points(
    field: ExactField, lo: Fraction, hi: Fraction, context: MPContext
) -> list[Fraction]:
    """The simple zeros of phi's slope in (lo, hi), left to right, to all digits."""
    points: list[Fraction] = []
    for mark in sorted(map(Fraction, field.monotone_marks())):
        if not lo < mark < hi:
            continue
        x = refined_mark(field, mark, context)
        taylor = field.taylor(x, Fraction(1), 3)
        # Zeros of A are marks, too.
        turns = len(taylor) > 2 and abs(taylor[1]) <= abs(taylor[2]) / 2 ** (context.prec // 3)
        if turns and taylor[2] and lo < x < hi and all(abs(x - y) > _SAME for y in points):
            points.append(x)
    return sorted(points)


def _quotient(a: Fraction | mpf, b: Fraction | mpf, context: MPContext) -> Any:
    """a/b in the context."""
    return mpf_of(a, context) / mpf_of(b, context)
