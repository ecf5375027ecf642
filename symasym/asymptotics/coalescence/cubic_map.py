"""Two coalescing critical points mapped to those of a cubic: the canonical Airy form.

For phi with two zeros m ± h beside each other, h² = D of either sign, there are one real zeta and
one analytic change of variable with (Chester, Friedman and Ursell 1957; DLMF 2.4(v), 36.12)

    phi du = (s² - zeta) ds,        u'(s) g(u(s)) = sum_k (p_k + q_k s) (s² - zeta)^k.

zeta > 0: the zeros are real, at s = ± sqrt(zeta); zeta < 0: they are a complex pair. Every p_k and
q_k is analytic in zeta, also through zeta = 0, though the textbook formulas divide by powers of it.
What is done here so that nothing cancels:

- The pair is split off as a factor, phi = (y² - D) psi(y) with y = u - m. Then both critical
  values are explicit sums in D, and zeta = D times a series that starts at psi(0)^(2/3). D is as
  relatively exact as phi at the zero of its slope.
- While the zeros are near, the coefficients come from s as one power series in y, by Newton's
  steps on s³/3 - zeta s = int phi du, which divide by y² - D from the highest power down. Then
  s² - zeta = (y² - D) chi, and by Cauchy's integrals over a circle around both zeros

      p_k = sum_j binom(k + j, j) D^j [y^(2k + 2j + 1)] g s chi^(-k - 1),    q_k without the s,

  analytic in D whether the zeros are two or one.
- Zeros that are farther apart are taken one by one: g u' as a series at each, even and odd parts
  taken. That loses two powers of their distance for each k, which are added to the precision.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.call_context import step
from symasym.base.errors import InputError
from symasym.base.inputs import shown
from symasym.numbers.polynomials import composed, power, product, quotient, reciprocal, shifted
from symasym.series.quadratic_factor import (
    Pair,
    mean_of_psi,
    mean_of_values,
    not_alone,
    numbers,
    split_pair,
)

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

    from symasym.numbers.arithmetic import Number as Element

__all__ = ["cubic_map", "map_coefficients", "truncation"]

# Half the zeros' distance over that to the next singularity, up to which the series in y is taken.
_NEAR = 0.02
_MOST_STEPS = 60


def cubic_map(
    taylor: Sequence[Any],
    count: int,
    context: MPContext,
    *,
    weight: Sequence[Any] | None = None,
) -> tuple[Any, list[tuple[Any, Any]]]:
    """zeta and the coefficients (p_k, q_k) of the cubic map at two coalescing zeros.

    Parameters
    ----------
    taylor : sequence of numbers
        Taylor coefficients c_0, c_1, ... of a real analytic phi about a real point beside the
        pair, best the zero of its slope between them (c_1 = 0), where nothing cancels in the
        pair's distance. What is beyond the last one is taken as zero: the relative error that
        makes is some (h/R)^(n - 2k - 2), R the radius of convergence from the pair's middle.
    count : int
        How many pairs of coefficients, 0 or more.
    context : mpmath context
        Its precision is that of the result.
    weight : sequence, optional
        Taylor coefficients of g about the same point; 1 if left out.

    Returns
    -------
    zeta : mpf
        Positive for real zeros, 0 for one double zero, negative for a complex pair;
        (4/3) |zeta|^(3/2) is the modulus of the integral of phi from one to the other.
    coefficients : list of (p_k, q_k)
        Of g u'(s). s has the direction in which phi du = (s² - zeta) ds holds: that of u if c_2 > 0
        (then p_0 > 0 for g > 0), the opposite one if c_2 < 0 (p_0 < 0).

    Raises
    ------
    InputError
        If there are fewer than three coefficients, or c_2 is zero.
    AccuracyError
        If the pair is not alone: a third zero lies between its two or is as near to it as they are
        to each other, or the Taylor series doesn't reach that far.

    Notes
    -----
    C. Chester, B. Friedman, F. Ursell, Proc. Camb. Phil. Soc. 53 (1957) 599; DLMF 2.4(v).

    Examples
    --------
    u² - z is its own cubic; (u² - z)(1 + u) is not. Both sides of the coalescence:

    >>> from fractions import Fraction
    >>> from symasym.base.call_context import own_context
    >>> with own_context(15) as context:
    ...     print(cubic_map([-2, 0, 1], 1, context))
    ...     for z in (Fraction(1, 10**30), 0, Fraction(-1, 10**30)):
    ...         zeta, ((p0, q0), (p1, q1)) = cubic_map([-z, -z, 1, 1], 2, context)
    ...         print(*(context.nstr(x, 6) for x in (zeta, p0, q0, p1, q1)))
    (mpf('2.0'), [(mpf('1.0'), mpf('0.0'))])
    1.0e-30 1.0 -0.5 0.5625 -0.729167
    0.0 1.0 -0.5 0.5625 -0.729167
    -1.0e-30 1.0 -0.5 0.5625 -0.729167
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 0:
        raise InputError(
            f"count is {shown(count)}; give a whole number of coefficients, 0 or more."
        )
    # What both ways lose: each k divides by two more powers of the radius, or of the distance.
    with context.workdps(context.dps + 12 + 2 * count):
        g = None if weight is None else numbers("weight", weight, context)
        pair = split_pair(taylor, context)
        coefficients = map_coefficients(pair, count, context, g)
    return +pair.zeta, [(+p, +q) for p, q in coefficients]


def map_coefficients(
    pair: Pair, count: int, context: MPContext, g: list[Any] | None
) -> list[tuple[Any, Any]]:
    """(p_k, q_k) of `cubic_map` for a pair that is split off, without guard digits of its own."""
    if g is not None:
        g = shifted(g, pair.middle)
    # sign = -1: s was counted along u; it has to run against it.
    return [(pair.sign * p, q) for p, q in _coefficients(pair, g, count, context)]


def truncation(zeta: Any, gap: Any, lam: Any, context: MPContext) -> tuple[Any, bool]:
    """The relative error where the line ends beside a pair, and True to leave the pair out.

    `gap` is how far V is there from its mean over the pair. Airy functions take the integrals over
    all of the line. Of a complex pair far from the real line the exponentials are small, and the
    regular part has all that counts.
    """
    if zeta >= 0:
        return context.zero, False
    inside = context.exp(-lam * gap)
    outside = context.exp(-lam * 4 * (-zeta) ** context.mpf(1.5) / 3)
    return min(inside, outside), bool(outside < inside)


def _coefficients(
    pair: Pair, g: list[Any] | None, count: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_k and q_k, k < `count`, with s along u."""
    # The rate at which the series of psi and g grow bounds what is singular next from below.
    rates = [context.root(abs(x / pair.psi[0]), j) for j, x in enumerate(pair.psi) if j]
    known = [x for x in g or () if x]
    rates += [context.root(abs(x / known[0]), j) for j, x in enumerate(g or ()) if j and known]
    rate = 2 * max(rates, default=context.zero)
    if not (rate and count):
        front = pair.slope if g is None else pair.slope * g[0]
        return [(front if k == 0 else context.zero, context.zero) for k in range(count)]
    ratio = min(max(rate * context.sqrt(abs(pair.square)), context.eps), 1)
    lost = -context.log10(ratio)
    if ratio <= _NEAR:
        digits = context.dps / lost
        return _around_both(pair, rate, g, count, 2 * count + int(digits) + 8, context)
    with context.workdps(context.dps + int(2 * count * (lost + 1))):
        return _at_each_zero(pair, g, count, context)


def _around_both(
    pair: Pair, rate: Element, g: list[Any] | None, count: int, length: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_k and q_k from so many terms of s as a power series in y."""
    zeta, square, zero = pair.zeta, pair.square, context.zero
    half, m = context.sqrt(abs(square)), 2 * count + 2
    psi = (pair.psi + [zero] * length)[:length]
    # int phi du less the mean of both critical values.
    target = [zero, zero, zero, *(x / (j + 3) for j, x in enumerate(psi))]
    for j, x in enumerate(psi):
        target[j + 1] -= square * x / (j + 1)
    target[0] = -mean_of_values(pair.psi, square)
    s = [zero, 1 / pair.slope, *[zero] * 6]
    # The step after one this small is beyond the digits.
    settled, least = False, context.ldexp(s[1], -3 * context.prec // 4)
    for _ in range(_MOST_STEPS):
        step()
        # Each step doubles the terms that are right.
        s += [zero] * min(len(s), length - len(s))
        w = product(s, s)
        w[0] -= zeta
        chi = _over_factor(w, square)
        if settled:
            break
        w[0] -= 2 * zeta
        off = _over_factor([x / 3 - y for x, y in zip(product(s, w), target, strict=False)], square)
        change = quotient(off, chi, len(off))
        s = [x - y for x, y in zip(s, [*change, zero, zero], strict=True)]
        # What coefficients further on are off by counts by powers of the zeros' distance.
        off = [x * half ** max(0, j - m) / rate ** min(j, m) for j, x in enumerate(change)]
        settled = len(s) == length and max(map(abs, off)) * rate <= least
    else:
        raise not_alone()
    inverse = reciprocal(chi)
    p, q = product(inverse, s), inverse
    if g is not None:
        g = (g + [zero] * length)[:length]
        p, q = product(p, g), product(q, g)
    coefficients = []
    for k in range(count):
        coefficients.append((_residue(p, square, k, context), _residue(q, square, k, context)))
        p, q = product(p, inverse), product(q, inverse)
    return coefficients


def _over_factor(c: list[Any], square: Element) -> list[Any]:
    """The quotient by y² - square, from the highest power down."""
    c = c[2:]
    for j in range(len(c) - 3, -1, -1):
        c[j] = c[j] + square * c[j + 2]
    return c


def _residue(c: list[Any], square: Element, k: int, context: MPContext) -> Any:
    """The integral of the series over (y² - square)^(k + 1), around both zeros, over 2 pi i."""
    rows = enumerate(c[2 * k + 1 :: 2])
    return context.fsum(context.binomial(k + j, j) * square**j * x for j, x in rows)


def _at_each_zero(
    pair: Pair, g: list[Any] | None, count: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_k and q_k from the series of g u' at each of two zeros that are apart.

    By `both_saddles` from Perron's coefficients at s = sqrt(zeta) and s = -sqrt(zeta).
    """
    half = context.sqrt(pair.square)
    root = half * context.cbrt(mean_of_psi(pair.psi, pair.square))
    zero, one = 0 * root, 0 * root + 1
    sides = []
    for side in (1, -1):
        # phi = y (2 side half + y) psi from this zero, integrated: what perron_coefficients reads.
        psi = shifted([x + zero for x in pair.psi], side * half, count)
        psi += [zero] * (count - len(psi))
        slope = [2 * side * half * x + y for x, y in zip(psi, [zero, *psi[:-1]], strict=True)]
        steep = [zero, zero, *(-x / (k + 2) for k, x in enumerate(slope))]
        weight = [one] if g is None else shifted([x + zero for x in g], side * half, count)
        weight += [zero] * (count - len(weight))
        # The branch of u' that p_0 + q_0 s has.
        front = context.sqrt(2 * root / (-2 * side * steep[2]))
        d = perron_coefficients(steep, weight, 2)
        sides.append(slope_by_square(d, side, 1 / root, front, count, one))
    even, odd = both_saddles(sides, 1 / root, one)
    return [((p * root).real, q.real) for p, q in zip(even, odd, strict=True)]


def both_saddles(sides: list[list[Any]], r: Element, one: Element) -> tuple[list[Any], list[Any]]:
    """P/sqrt(zeta) and Q, series in w = s² - zeta, of g u' = P + Q s, from g du/dw at ±sqrt(zeta).

    g du/dw = (P + s Q)/(2 s) at s, and -(P - s Q)/(2 s) at -s; r = 1/sqrt(zeta).
    """
    plus, minus = sides
    odd = [x + y for x, y in zip(plus, minus, strict=True)]
    rise = [x * r ** (2 * k) for k, x in enumerate(_root_series(len(odd), one))]
    return product([x - y for x, y in zip(plus, minus, strict=True)], rise), odd


def slope_by_square(
    d: list[Any], side: int, r: Element, front: Element, count: int, one: Element
) -> list[Any]:
    """g du/dw at the saddle s = side/r, from its reduced coefficients d; w = s² - 1/r².

    front is u' in units of the saddle's own variable v: a t² = v² in the exponent, t = u - u(s).
    """
    # v² = front^-2 y² (1 + y side r/3), y = s - side/r; side y = (sqrt(1 + w r²) - 1)/r.
    roots = _root_series(count + 1, one)
    along = [0 * one, *(x * r ** (2 * k - 1) for k, x in enumerate(roots) if k)]
    stretch = power([one, *(x * r / 3 for x in along[1:])], 1, 2, count + 1, one)
    v = [side * front * x for x in product(along, stretch)]
    return product(composed(d, v, count), [(k + 1) * x for k, x in enumerate(v[1:])])


def _root_series(count: int, one: Element) -> list[Any]:
    """Coefficients of sqrt(1 + w)."""
    return power([one, one], 1, 2, count, one)
