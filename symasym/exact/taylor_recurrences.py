"""Taylor recurrences in big integers for the integrals of a panel (`symasym.exact.digit_panels`).

No exponential is evaluated at a node: 1/e solves m' = lam phi m and
N(x) = int e(w)/e(x) dw solves N' = 1 + lam phi N, whose Taylor coefficients
obey short recurrences.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator, Sequence
from fractions import Fraction
from operator import mul
from typing import Any

from symasym.base.contexts import mpf_of
from symasym.generated.mpmath_formulas import (
    constant_nested_down,
    constant_nested_up,
    constant_single,
)

_RATIOS = [1.4 * 1.4**k for k in range(14)]
# Exponents of e in float64.
_RANGE = 700


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
    """`q` as integers over one denominator: exact if short, else to 2^-bits."""
    denominator = math.lcm(*(x.denominator for x in q))
    if denominator.bit_length() < bits // 2:
        whole = (x.numerator * (denominator // x.denominator) for x in q)
        return [context_integer(x) for x in whole], denominator
    scale = context_integer(1) << bits
    return [(x.numerator * scale) // x.denominator for x in q], scale


def recurrence(
    q: list[int], denominator: int, bits: int, count: int, source: bool
) -> tuple[Any, Any]:
    """y(1) and int_0^1 y in units of 2^-bits, for y' = (sum q[k]/denominator s^k) y + source.

    Parameters
    ----------
    q, denominator : integers
        The drift times lam and the width, in powers of s from 0 to 1.
    bits : int
        Places of the fixed-point numbers, guard bits included.
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
    for n in range(1, count):
        new = sum(map(mul, q, recent)) // step
        if n == 1 and source:
            new += one
        step += denominator
        recent.appendleft(new)
        total += new
        integral += new // (n + 1)
    return total, integral


def _short(q: list[int], denominator: int, one: Any, count: int, source: bool) -> tuple[Any, Any]:
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
    for n in range(first + 1, count + 1):
        a, b, c, d = (q0 * a + q1 * b + q2 * c + q3 * d) // step, a, b, c
        step += denominator
        total += a
        integral += a // n
    return total, integral


def context_integer(value: int) -> Any:
    """An integer of mpmath's own backend (gmpy2 where it is installed)."""
    from mpmath.libmp import MPZ

    return MPZ(value)


def layer(phi: list[Any], alternate: bool, context: Any) -> Any:
    """A layer-free solution at one point, in units of the length that `phi` is scaled by.

    Parameters
    ----------
    phi : list of mpf
        Taylor coefficients of lam |phi| times that length, about the point; one
        more than rounds of the slow series t_0 = 1/(lam|phi|),
        t_{k+1} = t_k'/(lam|phi|).
    alternate : bool
        True: the alternating sum, M' = 1 - lam|phi| M. False: Q' = -1 + lam|phi| Q.
    """
    bits, total, sign = context.prec + 32, 0, 1
    for term in _slow_terms(phi, len(phi), len(phi) - 1, bits):
        total += sign * term[0]
        sign = -sign if alternate else sign
    return total / phi[0] / (1 << bits)


def slow_integral(phi: list[Any], count: int, rounds: int, alternate: bool, context: Any) -> Any:
    """The integral of a layer-free solution over s from -1 to 1, the panel's half width being 1.

    Parameters
    ----------
    phi : list of mpf
        As in `layer`, about the middle.
    count, rounds : int
        Terms of the Taylor and of the slow series.

    Returns
    -------
    mpf or None
        None if the Taylor series turns out too short.
    """
    bits = context.prec + 32
    total = [0] * count
    sign = 1
    for term in _slow_terms(phi, count, rounds, bits):
        for k, x in enumerate(term):
            total[k] += sign * x
        sign = -sign if alternate else sign
    # Each derivative spoils one more of the last coefficients; those before must have died out.
    last = count - rounds - 1
    if max(abs(x) for x in total[last - 6 : last]) >> 24:
        return None
    return 2 * sum(x // (2 * k + 1) for k, x in enumerate(total[::2])) / phi[0] / (1 << bits)


def _slow_terms(phi: list[Any], count: int, rounds: int, bits: int) -> Iterator[list[Any]]:
    """Taylor coefficients of the t_k, in units of 1/phi[0], fixed point."""
    ratio = [_fixed(x / phi[0], bits) for x in phi[1:]]
    while ratio and not ratio[-1]:
        ratio.pop()
    inverse = _fixed(1 / phi[0], bits)
    one = context_integer(1) << bits
    term = _divide([one] + [0] * (count - 1), ratio, bits)
    yield term
    for _ in range(rounds):
        derivative = [((k + 1) * x * inverse) >> bits for k, x in enumerate(term[1:])]
        term = _divide(derivative, ratio, bits)
        yield term


def _fixed(x: Any, bits: int) -> Any:
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


def constant_moments(x: Fraction, context: Any) -> tuple[Any, Any, Any]:
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
