"""Critical points of the integrals of e^{lam V} and e^{-lam V} from a start x on, in weak noise.

Each is a sum over critical points: the maxima of the exponent, with Laplace's series; the start
and the end, with the formal series of an end, whatever the sign of the slope there; and
u = -1 and 1, with the difference of that series' two sides, since A's derivatives jump.
Where the exponent has a minimum nothing is added: the exponentials that the two sides of
the formal series differ by there are those of the maxima.
"""

from __future__ import annotations

from fractions import Fraction
from functools import partial
from typing import TYPE_CHECKING, Any

from symasym.asymptotics.laplace.watson import (
    laplace_coefficients,
    perron_coefficients,
)
from symasym.asymptotics.weak_noise.majorants import FURTHER, Majorants, majorants
from symasym.asymptotics.weak_noise.one_sided import (
    CriticalPoint,
    OneSided,
    add_edge,
    formal_series,
)
from symasym.asymptotics.weak_noise.regular_part import layer_integrals
from symasym.asymptotics.weak_noise.series import BEYOND, Part, Series, trimmed
from symasym.base.contexts import mpf_of
from symasym.base.errors import AccuracyError, InputError
from symasym.drift.landscape import bracketed_zero
from symasym.drift.taylor_field import ExactField, to_fraction
from symasym.numbers.arithmetic import Digits
from symasym.numbers.power_series import laurent, power

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


def series_of(groups: Groups, unit: mpf) -> Series:
    """The series of terms (c, p, q), known to the relative rounding `unit`."""
    parts: dict[tuple[float, int], list[Any]] = {}
    for n, group in enumerate(groups):
        for c, p, q in group:
            row = parts.setdefault((float(p) - n, q), [0.0] * len(groups))
            row[n] += c
    return Series([Part(*key, row) for key, c in parts.items() if (row := trimmed(c))], unit)


def half(
    field: ExactField,
    x: Fraction,
    r: Fraction,
    order: int,
    context: MPContext,
    outer: int,
    estimated: bool = True,
) -> OneSided:
    """The one-sided expansion right of `x`; `r` counts only where below 1.

    The regular part is to `outer` digits. Where the next terms have to give the error
    (`estimated`), zeros of A where they vanish are refused.
    """
    return _Builder(field, order, context, estimated).half(x, r, outer)


def whole(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """Of int e^{-lam V} over the whole line where it converges, V measured from -1."""
    builder, one = _Builder(field, order, context), Fraction(1)
    ends = [builder.flat(field.value(side * one)) for side in (-1, 1)]
    builder.edge("kink", -one, context.zero, ends[0], builder.smooth(-one))
    builder.layer(-one, one, context.zero, 0)
    height = -builder.drop(-context.one, context.one)
    builder.edge("kink", one, height, builder.smooth(one), ends[1])
    return builder.falling


def barriers(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """Those of [-1, 1], V measured from -1."""
    builder = _Builder(field, order, context)
    builder.layer(Fraction(-1), Fraction(1), context.zero, 0)
    return builder.rising


def wells_and_barriers(field: ExactField, order: int, context: MPContext) -> list[CriticalPoint]:
    """All of [-1, 1], left to right, V measured from -1."""
    builder = _Builder(field, order, context)
    builder.layer(Fraction(-1), Fraction(1), context.zero, 0)
    return sorted(builder.rising + builder.falling, key=lambda point: point.u)


class _Builder:
    def __init__(
        self, field: ExactField, order: int, context: MPContext, estimated: bool = True
    ) -> None:
        self.field, self.context, self.estimated = field, context, estimated
        self.count = order + 1 + BEYOND
        self.rising: list[CriticalPoint] = []
        self.falling: list[CriticalPoint] = []
        self.outer: Groups = [[] for _ in range(self.count)]
        self.least = self.unit = 64 * context.eps
        self.start: tuple[Series, Series, bool]

    def number(self, x: Fraction | mpf | int) -> Any:
        """`x` in the context."""
        return mpf_of(x, self.context)

    def half(self, x: Fraction, r: Fraction, outer: int) -> OneSided:
        """The one-sided expansion right of `x`: start, layer, kinks, end, what is beyond."""
        one, height = Fraction(1), self.context.zero
        a_minus, a_plus = (self.field.value(side * one) for side in (-1, 1))
        if not (a_minus and a_plus):
            raise InputError(
                "a- or a+ is 0, a tangency, where the weak-noise series has no terms; use "
                "method='exact'."
            )
        if r < 1 and not self.field.value(r):
            end = -r if self.field.mirrored else r
            raise InputError(
                f"r is {float(r):.6g} and A is 0 at u = {float(end):.6g}, where the weak-noise "
                "series of an end has no terms; use method='exact'."
            )
        if x >= 1:
            self.start = *formal_series(self.flat(a_plus)), True
            return self.done((self.number(x), height, self.number(a_plus)))
        lo, hi = max(x, -one), min(r, one)
        if x < -1:
            self.start = *formal_series(self.flat(a_minus)), True
            length = self.number(-one - x)
            self.outer[0].append((length / self.number(a_minus), 1, 0))
            height -= length * self.number(a_minus)
            self.edge("kink", lo, height, self.flat(a_minus), self.smooth(lo))
        elif self.field.value(x) == 0:
            self.start = self.start_at_zero(x)
        else:
            self.start = *formal_series(self.smooth(lo)), True
        self.layer(lo, hi, height, outer)
        height -= self.drop(self.number(lo), self.number(hi))
        if r <= 1:
            self.edge("end", hi, height, self.smooth(hi), None)
            return self.done(None)
        self.edge("kink", hi, height, self.smooth(hi), self.flat(a_plus))
        return self.done((self.number(hi), height, self.number(a_plus)))

    def done(self, beyond: tuple[Any, Any, Any] | None) -> OneSided:
        """The expansion, its critical points ranked from the start on."""
        at = sorted({p.u for p in self.rising + self.falling})
        rising, falling = (
            [p._replace(rank=at.index(p.u)) for p in points]
            for points in (self.rising, self.falling)
        )
        outer = series_of(self.outer, self.unit)
        return OneSided(*self.start, rising, falling, outer, beyond)

    def drop(self, lo: mpf, hi: mpf) -> Any:
        """V(lo) - V(hi), in the layer."""
        return -self.field.potential_rise(lo, hi)

    # -- ends and kinks --------------------------------------------------------------------

    def flat(self, a: Fraction) -> Series:
        """h_k beside a straight potential."""
        return Series([Part(1.0, 0, [1 / self.number(a)])], self.least)

    def smooth(self, u: Fraction) -> Series:
        """h_k(u) from inside the layer."""
        taylor = [self.number(c) for c in self.field.taylor(u, Fraction(1), self.count + 1)]
        taylor = (taylor + [self.context.zero] * self.count)[: self.count]
        h = [row[0] for row in laurent(taylor, False, self.count)]
        if not any(h[-BEYOND:]) and any(self.field.taylor(u, Fraction(1), _FLATTEST)[1:]):
            raise self.no_estimate("flat", u)
        return Series([Part(1.0, 0, trimmed(h))], self.least)

    def no_estimate(self, shape: str, u: Fraction) -> AccuracyError:
        """The refusal of a point where the series' next terms vanish."""
        point = (-float(u) if self.field.mirrored else float(u)) + 0.0
        return AccuracyError(
            f"A is {shape} to order {self.count} at u = {point:.6g}, where the series' next terms "
            "vanish and do not tell its error; give another order, or use method='exact'."
        )

    def require_estimate(self, u: Fraction, fall: list[Any], last: dict[int, Any]) -> None:
        """Refuse a zero of A where the `last` terms, by their powers of 1/length, all but vanish.

        But not where A is straight and has no others.
        """
        c = self.context
        # A zero that is not rational leaves some rounding.
        small = c.ldexp(1, -c.prec // 2)
        if not self.estimated or any(abs(x) > small for x in last.values()):
            return
        more = [abs(self.number(x)) for x in self.field.taylor(u, Fraction(1), _FLATTEST)[2:]]
        rates = [(x / abs(2 * fall[2])) ** (c.one / j) for j, x in enumerate(more, start=1) if x]
        if rates and all(abs(x) <= small * max(rates) ** power for power, x in last.items()):
            raise self.no_estimate("straight", u)

    def edge(self, kind: str, u: Fraction, height: mpf, left: Series, right: Series | None) -> None:
        """Both integrals at a point where the drift changes, or ends."""
        add_edge(self.rising, self.falling, 0, height, left, right, kind, self.number(u))

    # -- inside the layer ------------------------------------------------------------------

    def layer(self, lo: Fraction, hi: Fraction, height: mpf, outer: int) -> None:
        """The wells and barriers of [lo, hi] and, where it is wanted, the regular part."""
        zeros = simple_zeros(self.field, lo, hi, self.context)
        if outer:
            points = [u for u, _ in zeros]
            # Taylor panels take a number of terms that grows with the digits.
            with self.context.workdps(min(outer, self.context.dps)):
                self.unit = self.context.eps * 2**24
                integrals = layer_integrals(self.field, lo, hi, points, self.count, self.context)
            for k, value in enumerate(integrals):
                self.outer[k].append((value, k + 1, 0))
        for u, barrier in zeros:
            here = height - self.drop(self.number(lo), u)
            fall = self.fall(to_fraction(u), barrier)
            weight = [self.context.one, *[self.context.zero] * (len(fall) - 1)]
            terms = laplace_coefficients(fall, weight, 2, sides=2)
            last = range(self.count - BEYOND, self.count)
            relative = {2 * n: terms[n] / terms[0] * abs(fall[2]) ** n for n in last}
            self.require_estimate(to_fraction(u), fall, relative)
            kind, points, sign = (
                ("barrier", self.rising, 1) if barrier else ("well", self.falling, -1)
            )
            known = self.majorants(to_fraction(u)) if self.estimated else None
            part = Part(0.5, 0, trimmed(terms[: self.count]))
            series = Series([part], self.least, majorants=known)
            points.append(CriticalPoint(0, sign * here, series, None, kind, u))

    def majorants(self, u: Fraction) -> Majorants:
        """Those of Laplace's coefficients at a zero of A."""
        taylor = self.field.taylor(u, Fraction(1), 2 * self.count + 2 + FURTHER)
        return majorants([self.number(c) for c in taylor], self.count, Digits(self.context))

    def fall(self, u: Fraction, barrier: bool) -> list[Any]:
        """Taylor coefficients of -|V - V(u)| about a zero of A."""
        count = 2 * self.count + 2
        taylor = [self.number(c) for c in self.field.taylor(u, Fraction(1), count)]
        taylor += [self.context.zero] * (count - len(taylor))
        sign = -1 if barrier else 1
        zero = self.context.zero
        return [zero, zero, *(sign * c / (k + 2) for k, c in enumerate(taylor[1:count]))]

    def start_at_zero(self, x: Fraction) -> tuple[Series, Series, bool]:
        """The start is a well or a barrier: halves of Gaussians, and log(lam) in the regular part.

        With V - V(x) = ±s^2/2 and du = (a_0 + a_1 s + …) ds all integrals are known.
        """
        c = self.context
        # Exact for a polynomial, where rounding would hide a multiple zero.
        slope = self.number(self.field.taylor(x, Fraction(1), 2)[1])
        if not slope:
            raise degenerate(x)
        barrier = bool(slope > 0)
        fall = self.fall(x, barrier)
        reduced = perron_coefficients(fall, [c.one, *[c.zero] * (len(fall) - 1)], 2)
        half = c.mpf(1) / 2
        a = [d * abs(slope) ** (-half * (i + 1)) for i, d in enumerate(reduced[: 2 * self.count])]
        last = range(2 * (self.count - BEYOND), 2 * self.count)
        self.require_estimate(x, fall, {i: reduced[i] / reduced[0] for i in last})
        peak: Groups = [[] for _ in range(self.count)]
        formal: Groups = [[] for _ in range(self.count)]
        for i, coefficient in enumerate(a):
            power = half * (i + 1)
            size = coefficient * c.gamma(power) * 2**power / 2
            peak[i // 2].append((size, power, 0))
            if i % 2:
                formal[i // 2].append(((-1) ** (i // 2 + 1) * size, power, 0))
        for i, p in enumerate(a):
            for j, q in enumerate(a[: len(a) - i]):
                group = (i + j) // 2
                if group < self.count:
                    self.outer[group] += _corner(p * q, i, j, barrier, c)
        self.outer_shift(x, a)
        own, other = series_of(peak, self.least), series_of(formal, self.least)
        return (own, other, False) if barrier else (other, own, True)

    def outer_shift(self, x: Fraction, a: list[Any]) -> None:
        """The finite part leaves out powers of u - x; `_corner` those of s. This is the change."""
        c = self.context
        taylor = [self.number(t) for t in self.field.taylor(x, Fraction(1), 2 * self.count + 2)]
        taylor = [c.zero, *taylor[1:]]
        taylor += [c.zero] * (2 * self.count + 2 - len(taylor))
        # u - x = a_0 s (1 + alpha_1 s + …).
        alpha = [value / (a[0] * (i + 1)) for i, value in enumerate(a)]
        for k, series in enumerate(laurent(taylor, True, self.count)):
            top = 2 * k
            change = series[top] * c.log(a[0])
            for j in range(top):
                p = top - j
                constant = power(alpha, -p, 1, p + 1, c.one)[p] * a[0] ** -p
                change += series[j] * constant / -p
            self.outer[k].append((-change, k + 1, 0))


def _corner(weight: mpf, i: int, j: int, barrier: bool, c: MPContext) -> list[tuple[Any, Any, int]]:
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
    constant = c.digamma(c.mpf(1 - i) / 2 if barrier else c.mpf(j + 1) / 2) + c.log(2)
    return [(front * constant, power, 0), (-front, power, 1)]


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
            pair = partial(_value_and_slope, field)
            zeros.append((bracketed_zero(pair, a, b, context), bool(high > 0)))
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


def _value_and_slope(field: ExactField, u: mpf) -> tuple[Any, Any]:
    """A(u) and A'(u)."""
    return field.number(u), field.slope(u)
