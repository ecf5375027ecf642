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
- p_0 and q_0 follow from psi at the pair, which is again a series in D, by a square root in the
  algebra where s² = zeta.
- The others, while the zeros are near, are Cauchy integrals over a circle in y around both,

      p_k = (1/2πi) ∮ g s dy/(s² - zeta)^(k+1),    q_k = (1/2πi) ∮ g dy/(s² - zeta)^(k+1),

  analytic in D whether the zeros are two or one. The trapezoidal rule converges geometrically;
  half as many points give its error.
- Zeros so far apart that no good circle is left between them and the next singularity are taken
  one by one: g u' as a series at each, even and odd parts taken. That loses less than two digits
  for each k there, which are added to the precision beforehand.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symasym.asymptotics.laplace.watson import perron_coefficients
from symasym.base.errors import InputError
from symasym.base.patience import step
from symasym.numbers.polynomials import poly, poly_slope, shifted
from symasym.series.power_series import composed, power, product
from symasym.series.quadratic_factor import (
    Pair,
    mean_of_values,
    not_alone,
    numbers,
    split_pair,
    tiny,
)

if TYPE_CHECKING:
    from mpmath.ctx_mp import MPContext

    from symasym.numbers.arithmetic import Number as Element

__all__ = ["cubic_map", "map_coefficients"]

# Points on the circle, at most.
_MOST = 4096
# Half the zeros' distance over the circle's radius up to which the circle is taken: beyond it
# needs many points.
_NEAR = 0.4
# phi beside the pair is (y² - D) psi; up to this share of psi(0) psi may change on the circle.
_SHARE = 0.5


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
    >>> from symasym.base.contexts import own_context
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
        raise InputError(f"count is {count!r}; give a whole number of coefficients, 0 or more.")
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
    coefficients = []
    if g is not None:
        g = shifted(g, pair.middle)
    if count:
        coefficients.append(_leading(pair, g, context))
    if count > 1:
        coefficients += _higher(pair, g, count, context)
    # sign = -1: s was counted along u; it has to run against it.
    return [(pair.sign * p, q) for p, q in coefficients]


def _leading(pair: Pair, g: list[Any] | None, context: MPContext) -> tuple[Any, Any]:
    """p_0 + q_0 s = g u' modulo s² - zeta: u'² = 1/(slope psi(slope s)) there."""
    even, odd = poly(pair.psi[0::2], pair.square), poly(pair.psi[1::2], pair.square)
    norm = even**2 - odd**2 * pair.square
    p = context.sqrt((even + context.sqrt(norm)) / (2 * pair.slope * norm))
    q = -odd / (2 * p * norm)
    if g is None:
        return p, q
    a, b = poly(g[0::2], pair.square), pair.slope * poly(g[1::2], pair.square)
    return a * p + b * q * pair.zeta, a * q + b * p


def _higher(
    pair: Pair, g: list[Any] | None, count: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_1, q_1, ..., p_(count - 1), q_(count - 1)."""
    radius = _radius(pair, g, context)
    if radius == context.inf:
        return [(0 * pair.zeta, 0 * pair.zeta)] * (count - 1)
    if context.sqrt(abs(pair.square)) <= _NEAR * radius:
        return _around_both(pair, radius, g, count, context)
    return _at_each_zero(pair, g, count, context)


def _at_each_zero(
    pair: Pair, g: list[Any] | None, count: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_k and q_k, k >= 1, from the series of g u' at each of two zeros that are apart.

    By `both_saddles` from Perron's coefficients at s = sqrt(zeta) and s = -sqrt(zeta).
    """
    half, root = context.sqrt(pair.square), context.sqrt(pair.zeta)
    zero, one = 0 * root, 0 * root + 1
    sides = []
    for side in (1, -1):
        # phi = y (2 side half + y) psi from this zero, integrated: what perron_coefficients reads.
        psi = shifted([x + zero for x in pair.psi], side * half)
        psi = (psi + [zero] * count)[:count]
        slope = [2 * side * half * x + y for x, y in zip(psi, [zero, *psi[:-1]], strict=True)]
        steep = [zero, zero, *(-x / (k + 2) for k, x in enumerate(slope))]
        weight = [one] if g is None else shifted([x + zero for x in g], side * half)
        weight = (weight + [zero] * count)[:count]
        # The branch of u' that p_0 + q_0 s has.
        front = context.sqrt(2 * root / (-2 * side * steep[2]))
        d = perron_coefficients(steep, weight, 2)
        sides.append(slope_by_square(d, side, 1 / root, front, count, one))
    even, odd = both_saddles(sides, 1 / root, one)
    return [((p * root).real, q.real) for p, q in zip(even, odd, strict=True)][1:]


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


def _around_both(
    pair: Pair, radius: Element, g: list[Any] | None, count: int, context: MPContext
) -> list[tuple[Any, Any]]:
    """p_k and q_k, k >= 1, as Cauchy integrals of g s/(s² - zeta)^(k+1) and g/(s² - zeta)^(k+1).

    By the trapezoidal rule on a circle around both zeros, of which half the points give the error.
    """
    scale = context.cbrt(pair.psi[0]) * radius
    zeta = pair.zeta / scale**2
    # F - mean of the critical values, in units where the circle and psi(0) are 1.
    powers, psi = 1 + 0 * radius, []
    for x in pair.psi:
        psi.append(x * powers / pair.psi[0])
        powers = powers * radius
    square = pair.square / radius**2
    t = [0 * radius] * (len(psi) + 3)
    for j, x in enumerate(psi):
        t[j + 3] = t[j + 3] + x / (j + 3)
        t[j + 1] = t[j + 1] - square * x / (j + 1)
    t[0] = -mean_of_values(psi, square)
    if g is not None:
        g = [x * radius**j for j, x in enumerate(g)]
    # The integrand is analytic between the pair and some twice the radius where psi halves.
    rate = max(0.35, float(context.sqrt(abs(square))))
    size = min(_MOST, 4 * (int(-context.prec / 3.4 / np.log2(rate)) + 4)) if rate < 1 else _MOST
    while size <= _MOST:
        step()
        sums, lost = _sums(t, zeta, g, count, size, context)
        # The error falls as rho^n for n points: twice as many square it.
        if lost**2 <= tiny(context):
            break
        size += 4 * (size // 8)
    else:
        raise not_alone()
    unscaled = []
    for k, (p, q) in enumerate(sums, start=1):
        factor = radius / scale ** (2 * k + 2)
        unscaled.append((p * factor * scale, q * factor))
    return unscaled


def _radius(pair: Pair, g: list[Any] | None, context: MPContext) -> Any:
    """The radius between the pair and where psi has changed by half, by Newton from above."""
    distance = context.sqrt(abs(pair.square))
    rest = [context.zero, *(abs(x / pair.psi[0]) for x in pair.psi[1:])]

    def bound() -> Any:
        """Cauchy's bound: no root of the series' moduli is nearer."""
        top = max((context.root(x, j) for j, x in enumerate(rest) if j), default=context.zero)
        return 1 / top if top > 0 else context.inf

    if g is not None:
        # The weight's series has a radius, too; what its first terms are is no matter.
        unit = bound()
        if unit == context.inf:
            unit = distance if distance > 0 else context.one
        size = max(abs(x) * unit**j for j, x in enumerate(g[:3]))
        rest += [context.zero] * (len(g) - len(rest))
        for j, x in enumerate(g[1:] if size > 0 else (), start=1):
            rest[j] = max(rest[j], abs(x) / size)
    r = bound()
    if r == context.inf:
        return r
    # From above, on a convex function.
    for _ in range(60):
        slope = poly_slope(rest, r)
        step = (poly(rest, r) - _SHARE) / slope if slope > 0 else context.zero
        r = r - step
        if abs(step) <= 1e-3 * r:
            break
    # A larger circle costs points.
    return max(0.7 * r, context.sqrt(2 * r * distance), 1.1 * distance)


def _sums(
    t: list[Any],
    zeta: Element,
    g: list[Any] | None,
    count: int,
    size: int,
    context: MPContext,
) -> tuple[list[tuple[Any, Any]], Any]:
    """Cauchy integrals for k = 1, ..., and how far half as many points are from them."""
    y, s, weight = _nodes(t, zeta, g, size, context)
    start = []
    for x, v, h in zip(y, s, weight, strict=True):
        start.append((h * x * v, h * x, 1 / (v * v - zeta)))
    means, lost = [], context.zero
    for k in range(1, count):
        both = []
        for which in (0, 1):
            values = [(part[which] * part[2] ** (k + 1)) for part in start]
            both.append(_mean(values))
            lost = max(lost, abs(both[-1] - _mean(values[::2])))
        means.append((both[0], both[1]))
    return means, lost


def _mean(values: list[Any]) -> Element:
    """The mean over the circle, from its upper half with both ends; the lower half is conjugate."""
    inner = sum((v.real for v in values[1:-1]), 0 * values[0].real)
    return (values[0].real + values[-1].real + 2 * inner) / (2 * (len(values) - 1))


def _nodes(
    t: list[Any], zeta: Element, g: list[Any] | None, size: int, context: MPContext
) -> tuple[list[Any], list[Any], list[Any]]:
    """y on the upper half circle, s and g there: s³/3 - zeta s = t(y), continued from y = 1."""
    angles = np.exp(1j * np.pi * np.arange(size // 2 + 1) / (size // 2))
    seeds = _continued([np.float64(x) for x in t], np.float64(zeta), list(angles))
    roots = [context.expjpi(context.mpf(2 * j) / size) for j in range(size)]
    targets = _at_roots(t, roots, context)
    weights = [1] * len(seeds) if g is None else _at_roots(g, roots, context)
    s = []
    for target, seed in zip(targets, seeds, strict=True):
        v = context.mpc(complex(seed))
        # Digits double from float64's on; one step more than needed costs little.
        digits = 12
        while digits < 2 * context.dps:
            step()
            w = v * v - zeta
            v -= (v * (w - zeta * 2) - target * 3) / (3 * w)
            digits *= 2
        s.append(v)
    return roots[: len(s)], s, weights


def _at_roots(c: list[Any], roots: list[Any], context: MPContext) -> list[Any]:
    """The polynomial at the first half of the roots of unity: two scalar products for each."""
    size = len(roots)
    folded = [context.mpf(0)] * min(size, len(c))
    for k, x in enumerate(c):
        folded[k % size] += x
    re, im = [y.real for y in roots], [y.imag for y in roots]
    values = []
    for j in range(size // 2 + 1):
        powers = [j * k % size for k in range(len(folded))]
        parts = (context.fdot(folded, [row[k] for k in powers]) for row in (re, im))
        values.append(context.mpc(*parts))
    return values


def _continued(t: list[Any], zeta: Element, y: list[Any]) -> list[Any]:
    """s(y) in float64: on the real axis the largest root, then from point to point."""
    target = poly(t, y[0])
    v = max(3.0, 3 * np.sqrt(abs(zeta))) + 0j
    for _ in range(60):
        v = v - (v * (v * v / 3 - zeta) - target) / (v * v - zeta)
    roots = [v]
    for j, x in enumerate(y[1:], start=1):
        v = roots[-1] * (roots[-1] / roots[-2] if j > 1 else x)
        target = poly(t, x)
        for _ in range(8):
            v = v - (v * (v * v / 3 - zeta) - target) / (v * v - zeta)
        roots.append(v)
    if not (abs(v.imag) <= 1e-6 * abs(v) and v.real < 0):
        raise not_alone()
    return roots
