"""Panels of the arbitrary-precision sweeps: the numbers of `symasym.exact.float_panels`, when
needed.

In a stiff scene most panels only scale what comes in: their own share is
below the last digit. Every panel therefore knows `end`, and bounds on the
rest; its integrals are computed when a sweep asks.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from operator import mul
from typing import TYPE_CHECKING, Any

from symasym.base import call_context
from symasym.base.call_context import mpf_of
from symasym.base.errors import AccuracyError
from symasym.drift.field.taylor_field import ExactField
from symasym.exact.sweep import Deferred, Record
from symasym.generated.mpmath_formulas import (
    constant_nested_down,
    constant_nested_up,
    constant_single,
)
from symasym.numbers.rationals import Rational

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext

_RATIOS = [1.4 * 1.4**k for k in range(14)]
# Exponents of e in float64.
_RANGE = 700
# Taylor terms between two looks at the time.
_TERMS = 4096
#: Taylor terms of a change of the drift, which may be larger than the drift, beyond those of it.
MORE_TERMS = 48


class Numbers:
    """One context's view of rationals."""

    def __init__(self, lam: Fraction, context: MPContext) -> None:
        self.context = context
        self.lam_exact = lam
        self.lam = self.mpf(lam)

    def mpf(self, x: Fraction) -> mpf:
        """A rational rounded to the precision of the context."""
        return mpf_of(x, self.context)

    def exponential(self, rise: Fraction) -> Any:
        """exp(-|rise|) to full relative precision, however large `rise` is."""
        extra = max(0, rise.numerator.bit_length() - rise.denominator.bit_length())
        with self.context.workprec(self.context.prec + extra + 4):
            return self.context.exp(-abs(self.mpf(rise)))


class Panel:
    """An interval, with u running from left to right.

    Attributes
    ----------
    up : bool
        Whether V rises; it says which scaling the other numbers have (`Record`).
    end : mpf
        exp(-lam |V(b) - V(a)|).
    bound : mpf
        ``int_e, int_inverse <= bound``.
    nested_bound : mpf
        ``nested <= nested_bound``.
    rise : Fraction
        lam (V(b) - V(a)).
    drift_at_left : Fraction
        phi(a).
    """

    up: bool
    rise: Fraction
    drift_at_left: Fraction
    end: Any
    bound: Any
    nested_bound: Any

    int_e: Any
    int_inverse: Any
    nested: Any

    def integral(self, field: ExactField) -> Any:
        """The integral over the panel of another drift."""
        raise NotImplementedError

    def record(self, tiny: mpf) -> Record:
        """Its numbers for a sweep, in which a term below `tiny` of the whole is not computed."""
        return Record(
            Deferred(lambda: self.int_e, lambda: self.bound, tiny),
            Deferred(lambda: self.int_inverse, lambda: self.bound, tiny),
            Deferred(lambda: self.nested, lambda: self.nested_bound, tiny),
            1 if self.up else self.end,
            self.end if self.up else 1,
        )


class Constant(Panel):
    """A panel of any width with constant drift."""

    def __init__(self, numbers: Numbers, drift: Fraction, width: Fraction, edge: Fraction) -> None:
        h = numbers.mpf(width)
        x = numbers.lam_exact * drift * width
        self.drift_at_left, self.width, self._edge = drift, width, edge
        self.up, self.rise = x < 0, -x
        self.end, first, second = constant_moments(x, numbers.context)
        self.int_e = self.int_inverse = self.bound = h * first
        self.nested = self.nested_bound = h * h * second

    def integral(self, field: ExactField) -> Any:
        return field.value(self._edge) * self.width


def log_size(x: Fraction) -> float:
    """An upper bound of log |x|, also where x is no float64."""
    if not x:
        return -math.inf
    bits = int(abs(x.numerator).bit_length() - x.denominator.bit_length() + 1)
    return bits * math.log(2)


class Taylor(Panel):
    """A panel whose exponent varies by at most the reach, by Taylor recurrences.

    Parameters
    ----------
    c : list of Fraction
        Taylor coefficients of phi at the left end, in units of the width `h`.
    left : Fraction
    """

    def __init__(self, numbers: Numbers, c: list[Fraction], h: Fraction, left: Fraction) -> None:
        context = numbers.context
        self.left, self.width, self.drift_at_left = left, h, c[0]
        self.q = q = [numbers.lam_exact * h * x for x in c]
        self.rise = rise = -sum((x / (k + 1) for k, x in enumerate(q)), Rational(0))
        size = [abs(float(x)) / (k + 1) for k, x in enumerate(q)]
        reach = sum(size)
        self._numbers, self._h = numbers, numbers.mpf(h)
        self._bits = context.prec + guard_bits(reach)
        self._q, self._denominator = integers(q, self._bits)
        logs = [log_size(x) for x in q] if beyond_floats(len(q)) else []
        self._count = terms_needed(size, self._bits, logs)
        self.up = rise > 0
        self.end = numbers.exponential(rise)
        spread = context.exp(2 * reach)
        self.bound = self._h * spread
        self.nested_bound = self._h * self.bound

    def _solve(self, source: bool) -> tuple[Any, Any]:
        """y(b) and int y, y' = lam phi y + 1 with `source` or 0, in the record's scaling."""
        total, integral = recurrence(self._q, self._denominator, self._bits, self._count, source)
        # Downwards int_e, int_inverse and nested are those of the left end times e(b).
        unit = self._h * self._numbers.context.ldexp(1, -self._bits)
        if not self.up:
            unit *= self.end
        return total * unit, integral * unit

    @cached_property
    def _n(self) -> tuple[Any, Any]:
        """N(b) and int N, N' = 1 + lam phi N, N(a) = 0."""
        return self._solve(True)

    @property
    def int_e(self) -> mpf:
        return self._n[0]

    @cached_property
    def int_inverse(self) -> mpf:
        """int y, y' = lam phi y, y(a) = 1."""
        return self._solve(False)[1]

    @property
    def nested(self) -> mpf:
        return self._n[1] * self._h


class Slow(Panel):
    """A panel where lam|phi| is so large that the integrals live in layers at its ends.

    Parameters
    ----------
    edges : (centre, t0, t1)
        The panel is [centre + t0, centre + t1].
    terms : (count, rounds)
        Terms of the Taylor and of the slow series.
    least, radius : float
        A lower bound on |phi|; in units of half the width, the radius of a disk that determined the
        terms.
    """

    def __init__(
        self,
        numbers: Numbers,
        field: ExactField,
        edges: tuple[Fraction, Fraction, Fraction],
        terms: tuple[int, int],
        least: float,
        radius: float,
    ) -> None:
        self._numbers, self._field, self.radius = numbers, field, radius
        self.edges = edges
        self.centre, self.t0, self.t1 = edges
        self.half = (self.t1 - self.t0) / 2
        self.count, self.rounds = terms
        self.rise = rise = -numbers.lam_exact * field.integral(*edges, self.count)
        self.up = rise > 0
        # Above 2 prec ln 2 by construction: what a layer leaves at the far end is nothing.
        self.end = numbers.exponential(rise)
        self.bound = 2 / (numbers.lam * least)
        self.nested_bound = numbers.mpf(2 * self.half) * self.bound if self.up else self.bound**2

    @property
    def drift_at_left(self) -> Any:  # type: ignore[override]
        return self._field.value(self.centre + self.t0)

    def integral(self, field: ExactField) -> Any:
        return field.integral(*self.edges, self.count + MORE_TERMS)

    @property
    def cost(self) -> int:
        """Roughly the number of coefficients that `int_e` and `int_inverse` take."""
        return self.rounds**2

    def _lam_phi(self, t: Fraction, count: int) -> list[Any]:
        """Taylor coefficients of lam |phi| half about t, in units of half the width."""
        c = self._field.taylor(self.centre + t, self.half, count)
        scale = self._numbers.lam_exact * self.half * (-1 if self.up else 1)
        return [self._numbers.mpf(scale * x) for x in c] + [self._numbers.context.zero] * (
            count - len(c)
        )

    def _layers(self, t: Fraction) -> tuple[mpf, mpf]:
        """Both solutions at t."""
        half = self._numbers.mpf(self.half)
        for _ in range(4):
            try:
                phi = self._lam_phi(t, self.rounds + 1)
                following, opposing = layers(phi, self._numbers.context)
                return following * half, opposing * half
            except _TooFew:
                self.rounds *= 2
        raise self._slow_convergence()

    @cached_property
    def following(self) -> mpf:
        """The solution that follows the drift, at the right end."""
        return self._layers(self.t1)[0]

    @cached_property
    def _at_left(self) -> tuple[mpf, mpf]:
        """Both solutions at the left end."""
        return self._layers(self.t0)

    @property
    def first(self) -> mpf:
        """The solution that follows the drift, at the left end."""
        return self._at_left[0]

    @property
    def opposing(self) -> mpf:
        """The solution that opposes the drift, at the left end."""
        return self._at_left[1]

    @property
    def int_e(self) -> mpf:
        return self.following if self.up else self.opposing

    @property
    def int_inverse(self) -> mpf:
        return self.opposing if self.up else self.following

    @cached_property
    def nested(self) -> mpf:
        """int N, N' = 1 + lam phi N: downwards the product of both layers; upwards the
        integral of the following solution, less that of the layer at the left end.
        """
        if not self.up:
            return self.opposing * self.following
        # Upwards: the integral of the following solution that starts at zero.
        phi, following, _ = self.inside
        context, half = self._numbers.context, self._numbers.mpf(self.half)
        integral = 2 * sum(x // (2 * k + 1) for k, x in enumerate(following[::2])) / phi
        return half**2 * context.ldexp(integral, -context.prec - 32) - self.first * self.opposing

    @cached_property
    def inside(self) -> tuple[mpf, list[Any], list[Any]]:
        """lam |phi| half in the middle, and in units of half over it the Taylor coefficients of the
        solutions that follow and oppose the drift, fixed point with 32 bits more than the context;
        there are as many as suffice, the last `rounds` of them not complete."""
        bits, count = self._numbers.context.prec + 32, self.count
        for _ in range(4):
            phi = self._lam_phi((self.t0 + self.t1) / 2, count)
            try:
                following, opposing = slow_series(phi, self.rounds, bits)
            except _TooFew:
                self.rounds *= 2
                continue
            # Each derivative spoils one more of the last coefficients; those before must have died
            # out.
            last = count - self.rounds - 1
            if (
                not max(abs(x) for x in following[last - 6 : last] + opposing[last - 6 : last])
                >> 24
            ):
                return phi[0], following, opposing
            count *= 2
        raise self._slow_convergence()

    def _slow_convergence(self) -> AccuracyError:
        return AccuracyError(
            f"the Taylor series of A at u = {float(self.centre + self.t0):.6g} converges too "
            "slowly for the digits asked for; ask for fewer digits."
        )


class _TooFew(Exception):
    """More rounds of the slow series are needed."""


# -- Taylor recurrences in big integers ------------------------------------------------------------


def terms_needed(growth: Sequence[float], bits: float, logs: Sequence[float] = ()) -> int:
    """Number of Taylor terms that leave less than 2^-bits.

    `logs` of `growth` are needed where that may underflow (see `beyond_floats`).

    Cauchy's bound on the coefficients of exp(sum growth[k] s^(k+1)), the
    majorant of both solutions, taken at the best of several radii.
    """
    best = math.inf
    wanted = bits * math.log(2)
    for ratio in _RATIOS:
        total = _majorant(growth, logs, ratio)
        # the geometric tail of a series with coefficients ratio^-n
        best = min(best, (total + wanted + math.log(ratio / (ratio - 1))) / math.log(ratio))
    return int(best) + 4


def beyond_floats(count: int) -> bool:
    """True where so many powers of every ratio of `terms_needed` leave float64's range."""
    return count * math.log(_RATIOS[0]) > _RANGE


def _majorant(growth: Sequence[float], logs: Sequence[float], ratio: float) -> float:
    """sum growth[k] ratio^(k+1)."""
    power, total = 1.0, 0.0
    if len(growth) * math.log(ratio) <= _RANGE:
        for g in growth:
            power *= ratio
            total += g * power
        return total
    if not logs:
        return math.inf
    for k, size in enumerate(logs, start=1):
        exponent = size + k * math.log(ratio)
        total += math.exp(exponent) if exponent < _RANGE else math.inf
    return total


def guard_bits(reach: float) -> int:
    """Bits that rounding can cost on a panel.

    An error of one unit grows at most like the majorant e^reach, while what is
    wanted (N, J, K, scaled by the width) is never below 1/reach^2.
    """
    return int(1.4427 * reach + 3 * math.log2(reach + 2)) + 24


def integers(q: Sequence[Fraction], bits: int) -> tuple[list[int], int]:
    """`q` as integers over one denominator, without the zeros at their end: exact if short, else to
    2^-bits."""
    denominator = math.lcm(*(x.denominator for x in q))
    if denominator.bit_length() < bits // 2:
        whole = [context_integer(x.numerator * (denominator // x.denominator)) for x in q]
    else:
        denominator = context_integer(1) << bits
        # Towards 0, so that what is below the last place is 0.
        sizes = (abs(x.numerator) * denominator // x.denominator for x in q)
        whole = [size if x > 0 else -size for size, x in zip(sizes, q, strict=True)]
    while len(whole) > 1 and not whole[-1]:
        whole.pop()
    return whole, denominator


def recurrence(
    q: list[int], denominator: int, bits: int, count: int, source: bool
) -> tuple[Any, Any]:
    """y(1) and int_0^1 y in units of 2^-bits, for y' = (sum q[k]/denominator s^k) y + source.

    Parameters
    ----------
    q, denominator : integers
        The drift times lam and the width, in powers of s from 0 to 1.
    bits : int
        Bits of the fixed-point numbers behind the point, guard bits included.
    count : int
        Taylor terms.
    source : bool
        False: y(0) = 1 and no source (1/e). True: y(0) = 0 and source 1 (N).
    """
    one = context_integer(1) << bits
    if len(q) <= 4:
        return _short(q, denominator, one, count, source)
    recent = deque([0 * one if source else one], maxlen=len(q))
    total = integral = recent[0]
    step = denominator
    for block in _blocks(1, count):
        for n in block:
            new = sum(map(mul, q, recent)) // step
            if n == 1 and source:
                new += one
            step += denominator
            recent.appendleft(new)
            total += new
            integral += new // (n + 1)
    return total, integral


def _blocks(first: int, end: int) -> Iterator[range]:
    """The numbers from `first` to `end`, in parts after each of which the time is looked at."""
    for at in range(first, end, _TERMS):
        call_context.step()
        yield range(at, min(at + _TERMS, end))


def _short(q: list[int], denominator: int, one: int, count: int, source: bool) -> tuple[Any, Any]:
    """`recurrence` for a cubic drift at most, unrolled: a sum over a deque costs as much again."""
    q0, q1, q2, q3 = [*q, 0, 0, 0][:4]
    b = c = d = 0 * one
    a = 0 * one if source else one
    total = integral = a
    step = denominator
    first = 1
    if source:
        d, c, b, a = c, b, a, one
        total = one
        integral = one // 2
        step += denominator
        first = 2
    for block in _blocks(first + 1, count + 1):
        for n in block:
            a, b, c, d = (q0 * a + q1 * b + q2 * c + q3 * d) // step, a, b, c
            step += denominator
            total += a
            integral += a // n
    return total, integral


def context_integer(value: int) -> Any:
    """An integer of mpmath's own backend (gmpy2 where it is installed)."""
    from mpmath.libmp import MPZ

    return MPZ(value)


def layers(phi: list[Any], context: MPContext) -> tuple[mpf, mpf]:
    """The solutions without layers at one point, M' = 1 - lam|phi| M and Q' = -1 + lam|phi| Q, in
    units of the length that `phi` is scaled by.

    Parameters
    ----------
    phi : list of mpf
        Taylor coefficients of lam |phi| times that length, about the point; one
        more than rounds of the slow series t_0 = 1/(lam|phi|),
        t_{k+1} = t_k'/(lam|phi|).
    """
    bits = context.prec + 32
    terms = [term[0] for term in _slow_terms(phi, len(phi) - 1, bits)]
    _require_small(terms[-1:])
    even, odd, unit = sum(terms[::2]), sum(terms[1::2]), phi[0] * (1 << bits)
    return (even - odd) / unit, (even + odd) / unit


def slow_series(phi: list[Any], rounds: int, bits: int) -> tuple[list[Any], list[Any]]:
    """Taylor coefficients of M and Q (see `layers`) in units of 1/phi[0], fixed point; the last
    `rounds` are not complete."""
    sums = [0] * len(phi), [0] * len(phi)
    for n, term in enumerate(_slow_terms(phi, rounds, bits)):
        total = sums[n % 2]
        for k, x in enumerate(term):
            total[k] += x
    _require_small(term[:1])
    return [a - b for a, b in zip(*sums, strict=True)], [a + b for a, b in zip(*sums, strict=True)]


def _require_small(last: list[Any]) -> None:
    """Raise `_TooFew` unless the last terms, fixed point, are below the last digits."""
    if any(abs(x) >> 28 for x in last):
        raise _TooFew


def slow_moments(phi: list[Any], rounds: int, context: MPContext) -> list[mpf]:
    """J_j, j = 0, 1, ..., the integrals of t^j exp(sum phi[k] t^{k+1}/(k+1)) from -inf to 0.

    J_0 is M of `layers`, and J_{k+1}/(k+1) its derivative by phi[k]. By parts

        sum_k phi[k] J_{j+k} = [j = 0] - j J_{j-1},

    so that J_j = -j g_j/phi[0] J_{j-1}, 1/g_j = 1 + sum_k phi[k]/phi[0] J_{j+k}/J_j, backwards
    from where g = 1 (Olver's algorithm).
    """
    bits = context.prec + 32
    one = context_integer(1) << bits
    ratio = [_fixed(x / phi[0], bits) for x in phi[1:]]
    while ratio and not ratio[-1]:
        ratio.pop()
    inverse = _fixed(1 / phi[0], bits)
    # J_{j+1}/J_j, the last first.
    steps: deque[Any] = deque(maxlen=len(ratio))
    each = []
    for j in range(rounds + 1, -1, -1):
        total = 0
        for r, step in zip(reversed(ratio[: len(steps)]), reversed(steps), strict=True):
            total = (step * (r + total)) >> bits
        g = (one << bits) // (one + total)
        each.append(g)
        steps.appendleft(-((j * inverse * g) >> bits))
    moments = [context.ldexp(each.pop(), -bits) / phi[0]]
    for j in range(1, rounds + 2):
        moments.append(-j * context.ldexp(each.pop(), -bits) / phi[0] * moments[-1])
    return moments


def _slow_terms(phi: list[Any], rounds: int, bits: int) -> Iterator[list[Any]]:
    """Taylor coefficients of t_0 = 1/phi, t_1, ..., in units of 1/phi[0], fixed point."""
    ratio = [_fixed(x / phi[0], bits) for x in phi[1:]]
    while ratio and not ratio[-1]:
        ratio.pop()
    inverse = _fixed(1 / phi[0], bits)
    term = _divide([context_integer(1) << bits] + [0] * (len(phi) - 1), ratio, bits)
    yield term
    for _ in range(rounds):
        derivative = [((k + 1) * x * inverse) >> bits for k, x in enumerate(term[1:])]
        term = _divide(derivative, ratio, bits)
        yield term


def _fixed(x: mpf, bits: int) -> Any:
    """mpf to fixed point."""
    from mpmath.libmp import to_fixed

    return to_fixed(x._mpf_, bits)


def _divide(numerator: list[Any], ratio: list[Any], bits: int) -> list[Any]:
    """Series of numerator/(1 + ratio[0] s + ...), fixed point."""
    recent: deque[Any] = deque(maxlen=max(len(ratio), 1))
    result = []
    for x in numerator:
        new = x - (sum(map(mul, ratio, recent)) >> bits)
        recent.appendleft(new)
        result.append(new)
    return result


def constant_moments(x: Fraction, context: MPContext) -> tuple[Any, Any, Any]:
    """exp(-|x|), and int_e (= int_inverse) and nested per width and width^2, of a constant drift.

    Parameters
    ----------
    x : Fraction
        lam times the drift times the width.
    """
    if x == 0:
        return context.one, context.one, context.one / 2
    size = abs(x)
    # 1 - e^-x and its second-order twin cancel for small x.
    lost = max(0, 2 * (size.denominator.bit_length() - size.numerator.bit_length()) + 4)
    exponent_bits = max(0, size.numerator.bit_length() - size.denominator.bit_length())
    with context.workprec(context.prec + lost + exponent_bits + 8):
        y = mpf_of(size, context)
        end = context.exp(-y)
        first = constant_single(context, y)
        second = (constant_nested_up if x < 0 else constant_nested_down)(context, y, first)
    return end, first, second
