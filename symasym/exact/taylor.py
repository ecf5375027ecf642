"""Panel records to any number of digits, by Taylor recurrences in big integers.

The same four numbers as in `symasym.exact.panels`, found without one exponential
per node: 1/e solves m' = lam phi m and N(x) = int e(w)/e(x) dw solves
N' = 1 + lam phi N, whose Taylor coefficients obey short recurrences.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence
from fractions import Fraction
from operator import mul
from typing import Any, NamedTuple

_RATIOS = [1.25 * 1.25**k for k in range(28)]


class Record(NamedTuple):
    """One panel: `up` tells which scaling `near`, `far`, `both` have; `end` = exp(-|rise|)."""

    up: bool
    end: Any
    near: Any
    far: Any
    both: Any


def terms_needed(growth: Sequence[float], bits: float) -> int:
    """Number of Taylor terms that leave less than 2^-bits.

    Cauchy's bound on the coefficients of exp(sum growth[k] s^(k+1)), the
    majorant of both solutions, taken at the best of several radii.
    """
    best = math.inf
    wanted = bits * math.log(2)
    for ratio in _RATIOS:
        power, total = 1.0, 0.0
        for g in growth:
            power *= ratio
            total += g * power
        # the geometric tail of a series with coefficients ratio^-n
        best = min(best, (total + wanted + math.log(ratio / (ratio - 1))) / math.log(ratio))
    return int(best) + 4


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
        return [int(x * denominator) for x in q], denominator
    scale = 1 << bits
    return [(x.numerator * scale) // x.denominator for x in q], scale


def taylor_record(
    q: list[int],
    denominator: int,
    h: Any,
    up: bool,
    end: Any,
    bits: int,
    reach: float,
    context: Any,
) -> Record:
    """Record of a panel on which lam phi h = sum q[k]/denominator s^k, s from 0 to 1.

    Parameters
    ----------
    q, denominator : integers
        Scaled Taylor coefficients of the drift at the panel's left end.
    h : mpf
        Width.
    up, end
        As in `Record`.
    bits : int
        Relative precision wanted.
    reach : float
        Bound on sum |q[k]|/(denominator (k+1)); it sets the guard bits.
    """
    guard = guard_bits(reach)
    one = context_integer(1) << (bits + guard)
    size = [abs(x) / denominator / (k + 1) for k, x in enumerate(q)]
    count = terms_needed(size, bits + guard)
    m_sum, m_integral = _series(q, denominator, one, 0, count)
    n_sum, n_integral = _series(q, denominator, 0, one, count)
    scale = context.mpf(1) / (1 << (bits + guard))
    near, far = n_sum * scale * h, m_integral * scale * h
    both = n_integral * scale * h * h
    if up:
        return Record(True, end, near, far, both)
    # Downwards I = N e(b), and likewise for the others.
    return Record(False, end, near * end, far * end, both * end)


def context_integer(value: int) -> Any:
    """An integer of mpmath's own backend (gmpy2 where it is installed)."""
    from mpmath.libmp import MPZ

    return MPZ(value)


def _series(q: list[int], denominator: int, first: Any, source: Any, count: int) -> tuple[Any, Any]:
    """Sum and integral over [0, 1] of y, where y' = (q/denominator) y + source, y(0) = first."""
    recent = deque([first], maxlen=len(q))
    total, integral = first, first
    step = denominator
    for n in range(1, count):
        new = sum(map(mul, q, recent)) // step
        if n == 1:
            new += source
        step += denominator
        recent.appendleft(new)
        total += new
        integral += new // (n + 1)
    return total, integral


def slow_record(
    phi: list[Any], half: Any, up: bool, end: Any, count: int, rounds: int, context: Any
) -> Record | None:
    """Record of a panel where the integrals live in layers at its ends.

    Parameters
    ----------
    phi : list of mpf
        Coefficients of lam |phi| half in s, u = centre + half s, -1 <= s <= 1.
    half : mpf
        Half the width.
    up, end
        As in `Record`.
    count, rounds : int
        Terms of the Taylor series, and of the slow series t_0 = 1/(lam|phi|),
        t_{k+1} = t_k'/(lam|phi|).

    Returns
    -------
    Record or None
        None if the Taylor series turns out too short.

    Notes
    -----
    The alternating sum of the t_k follows the drift and the plain sum opposes
    it, as in `symasym.exact.panels.slow`.
    """
    bits = context.prec + 32
    one = context_integer(1) << bits
    lead = phi[0]
    ratio = [_fixed(x / lead, bits) for x in phi[1:]]
    while ratio and not ratio[-1]:
        ratio.pop()
    inverse = _fixed(1 / lead, bits)  # lam|phi| half >> 1 in a slow panel
    term = _divide([one] + [0] * (count - 1), ratio, bits)
    m, q, sign = list(term), list(term), 1
    for _ in range(rounds):
        derivative = [(k + 1) * x for k, x in enumerate(term[1:])]
        term = _divide([(x * inverse) >> bits for x in derivative], ratio, bits)
        sign = -sign
        for k, x in enumerate(term):
            q[k] += x
            m[k] += sign * x
    # Each derivative spoils one more of the last coefficients; those before must have died out.
    last = count - rounds - 1
    if max(abs(x) for x in q[last - 6 : last]) >> 24:
        return None
    # All series are in units of 1/(lam|phi| half) at the centre, times half for a length.
    unit = half / lead / (1 << bits)
    m_in, m_out = _ends(m, unit)
    q_in, q_out = _ends(q, unit)
    m_moment, q_moment = m_out - m_in * end, q_in - q_out * end
    if up:
        return Record(True, end, m_moment, q_moment, _integral(m, unit) * half - m_in * q_moment)
    both = q_in * m_moment - end * half * _integral(q, unit)
    return Record(False, end, q_moment, m_moment, both)


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


def _ends(series: list[Any], unit: Any) -> tuple[Any, Any]:
    even, odd = sum(series[::2]), sum(series[1::2])
    return (even - odd) * unit, (even + odd) * unit


def _integral(series: list[Any], unit: Any) -> Any:
    return 2 * sum(x // (2 * k + 1) for k, x in enumerate(series[::2])) * unit


def constant_record(x: Fraction, h: Any, context: Any) -> Record:
    """Record of a panel of any width on which the drift is constant; x = lam a h."""
    if x == 0:
        return Record(False, context.one, h, h, h * h / 2)
    size = abs(x)
    # 1 - e^-x and its second-order twin cancel for small x.
    lost = max(0, 2 * (size.denominator.bit_length() - size.numerator.bit_length()) + 4)
    exponent_bits = max(0, size.numerator.bit_length() - size.denominator.bit_length())
    with context.workprec(context.prec + lost + exponent_bits + 8):
        y = context.mpf(size.numerator) / size.denominator
        end = context.exp(-y)
        first = -context.expm1(-y) / y
        up = x < 0
        second = (y - 1 + end) / y**2 if up else (1 - (1 + y) * end) / y**2
    return Record(up, end, h * first, h * first, h * h * second)
