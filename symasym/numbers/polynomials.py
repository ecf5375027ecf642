"""Polynomials and truncated power series as lists of their coefficients, and zeros of polynomials.

Ascending coefficients in any arithmetic: floats, the rows of an array (one column a scene),
Fractions, mpf, balls, double-doubles or elements of a SymPy ring or field: what `poly` and its kin
ask of them is + and *. Factors of degree two are in `symasym.series.quadratic_factor`.

All zeros of many polynomials of one degree at once are found in float64: degree 2 by the formula
that does not cancel, 3 by Viete's cosines or Cardano's sum, higher ones as eigenvalues of the
companion matrix; then Newton's steps (W. H. Press et al., Numerical Recipes, sections 5.6 and
9.5), or Ehrlich and Aberth's where zeros of very different sizes are lost (O. Aberth, Math. Comp.
27 (1973) 339). One zero is found to any digits, of any function between two points by Newton's
steps kept in a bracket.

A series is c[0] + c[1] t + ... + c[n - 1] t^(n - 1) + O(t^n). Powers, exponentials and what follows
from them solve a differential equation of first order, y' a = b y, coefficient by coefficient
(J. C. P. Miller's recurrence; P. Henrici, Applied and Computational Complex Analysis 1, section
1.6; Knuth, The Art of Computer Programming 2, section 4.7), so that nothing is composed. Sums of
products of mpf are rounded once, which takes a quarter of the time; coefficients that are exactly
zero, as most of a polynomial's, are passed over.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symasym.base.call_context import step
from symasym.base.inputs import FloatArray
from symasym.generated.formulas import fall_by_powers, manifold_term
from symasym.numbers.arithmetic import Number

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


# Zeros closer than this are not separated well enough for partial fractions.
_CLUSTER = 1e-3
# A leading coefficient below this, beside the largest, moves no zero near the layer.
_NOTHING = 1e-150
# Newton's last step, relative to a zero above 1; a polynomial's value, to the sum of its terms.
_CONVERGED, _ROUNDED = 1e-6, 1e-12
# Steps of Ehrlich and Aberth's method, each of third order where zeros are simple.
_ABERTH = 30
# An imaginary part below this, after Newton's steps, is rounding.
_REAL = 1e-9


def poly(c: Sequence[Any], x: Number) -> Any:
    """The value at `x`, by Horner's rule."""
    if len(c) < 2:
        return 0 * x + c[0] if len(c) else 0 * x
    total = c[-1] * x + c[-2]
    for a in c[-3::-1]:
        total = total * x + a
    return total


def poly_slope(c: Sequence[Any], x: Number) -> Any:
    """The derivative's value at `x`."""
    return poly([k * a for k, a in enumerate(c)][1:], x)


def shifted(c: Sequence[Any], by: Number, count: int | None = None) -> list[Any]:
    """Taylor coefficients at `by`, the first `count` of them, by Horner's rule again and again."""
    work = list(c)
    for lowest in range(len(work) - 1)[:count]:
        for k in range(len(work) - 2, lowest - 1, -1):
            work[k] = work[k] + work[k + 1] * by
    return work[:count]


def divided(c: Sequence[Any], p: Number, q: Number) -> tuple[list[Any], Any, Any]:
    """The quotient by x² + p x + q, and the remainder's coefficients of x and of 1."""
    if len(c) < 3:
        return [], c[1] if len(c) > 1 else 0 * p, c[0] if len(c) else 0 * p
    work = list(c)
    for k in range(len(c) - 3, -1, -1):
        top = work[k + 2]
        work[k + 1] = work[k + 1] - p * top
        work[k] = work[k] - q * top
    return work[2:], work[1], work[0]


# -- zeros -----------------------------------------------------------------------------------------


class Zeros(NamedTuple):
    """Columns of zeros.

    Attributes
    ----------
    values : array, shape (degree, n)
        The real zeros, ascending, then infinities.
    real : array, shape (n,)
        How many are real.
    pairs : list of array, shape (n,)
        The others above the real axis, then infinities.
    apart : array, shape (n,)
        Whether no two of them are close to each other.
    complete : array, shape (n,)
        Whether all of them have been found.
    """

    values: FloatArray
    real: Any
    pairs: list[Any]
    apart: Any
    complete: Any

    def take(self, rows: Any) -> Zeros:
        """Zeros of some of the polynomials, with as many real ones each."""
        real = self.real[rows]
        above = (len(self.values) - int(real[0])) // 2
        pairs = [pair[rows] for pair in self.pairs[:above]]
        return Zeros(self.values[:, rows], real, pairs, self.apart[rows], self.complete[rows])


def zeros_of(c: FloatArray) -> Zeros:
    """Zeros of the columns of `c`, ascending powers, the last not 0."""
    degree, count = len(c) - 1, c.shape[1]
    if degree == 0:
        every = np.ones(count, bool)
        return Zeros(np.empty((0, count)), np.zeros(count, int), [], every, every)
    with np.errstate(all="ignore"):
        z = _cubic(c) if degree == 3 else _quadratic(c) if degree == 2 else _companion(c)
        z, converged = _polished(c, z)
    size = np.maximum(1.0, np.abs(z))
    is_real = np.abs(z.imag) < _REAL * (1 + np.abs(z))
    complete = converged.all(axis=0)
    apart = complete
    for k in range(degree):
        for j in range(k):
            gap = np.abs(z[k] - z[j])
            apart = apart & (gap > _CLUSTER * np.maximum(size[k], size[j]))
    values = np.sort(np.where(is_real, z.real, np.inf), axis=0)
    real = is_real.sum(axis=0)
    above = ~is_real & (z.imag > 0)
    # As many below the axis as above it.
    complete &= 2 * above.sum(axis=0) + real == degree
    return Zeros(values, real, _chosen(z, above), apart & complete, complete)


def refined(c: Sequence[Any], z: Number, context: MPContext) -> Any:
    """The simple zero near `z` to all digits of the context, None where Newton's steps fail."""
    last, falling = False, list(c[::-1])
    for _ in range(context.prec.bit_length() + 8):
        value, slope = context.polyval(falling, z, derivative=True)
        if not slope:
            return None
        step = value / slope
        z -= step
        if last:
            return z
        # The step after the one that has half of the digits has all of them.
        last = abs(step) <= context.ldexp(1 + abs(z), -context.prec // 2 - 8)
    return None


def bracketed_zero(
    pair: Callable[[Any], Sequence[Any]], lo: mpf, hi: mpf, context: MPContext
) -> mpf:
    """The zero between mpf lo and hi by Newton kept inside a shrinking bracket.

    `pair` gives the value and the slope, of opposite signs at lo and hi.
    """
    low_sign = pair(lo)[0] > 0
    x = (lo + hi) / 2
    # Newton's next step is the square of one this small: beyond the digits.
    enough = context.ldexp(1, -4 * context.prec // 5)
    for _ in range(400):
        value, slope = pair(x)
        if value == 0:
            return x
        if (value > 0) == low_sign:
            lo = x
        else:
            hi = x
        step = value / slope if slope else context.inf
        new = x - step
        # Before the bracket, whose ends are a unit of rounding apart when Newton has come so far.
        if abs(step) < enough:
            return min(max(new, lo), hi)
        if not lo < new < hi:
            new = (lo + hi) / 2
        if abs(new - x) < enough:
            return new
        x = new
    return x


def _chosen(zeros: Any, above: np.ndarray[Any, Any]) -> list[Any]:
    """Zeros above the real axis first, as many as there may be."""
    half = len(zeros) // 2
    if half == 1:
        # Sorting is slow for so few.
        first = np.full(zeros.shape[1], np.inf + 0j)
        for row, chosen in zip(zeros, above, strict=True):
            np.copyto(first, row, where=chosen)
        return [first]
    at = np.argsort(~above, axis=0, kind="stable")
    return list(np.take_along_axis(zeros, at, axis=0)[:half])


def real_parts(c: FloatArray) -> FloatArray:
    """Real parts of all zeros of the columns of `c`, the last not 0, be it ever so small."""
    with np.errstate(all="ignore"):
        zeros = _companion(c, 1e150)
        zeros, _converged = _polished(c, zeros)
    return np.real(zeros)


def float_zeros(c: Sequence[Any]) -> np.ndarray[Any, Any]:
    """Zeros of one polynomial of numbers of any size in float64, complex and sorted.

    Leading coefficients that are nothing beside the others are left out with the zeros that they
    have far outside.
    """
    largest = max((abs(x) for x in c), default=0)
    scaled = np.array([float(x / largest) for x in c]) if largest else np.zeros(0)
    used = np.trim_zeros(np.where(np.abs(scaled) < _NOTHING, 0.0, scaled), "b")[:, None]
    if len(used) < 2:
        return np.zeros(0, dtype=complex)
    with np.errstate(all="ignore"):
        zeros = _companion(used)
        zeros, _converged = _polished(used, zeros)
    return np.sort(zeros[:, 0] + 0j)


def _polished(c: FloatArray, z: np.ndarray[Any, Any]) -> tuple[Any, Any]:
    """Zeros of the columns by Newton's method from near ones, and which of them have converged.

    Those beside a zero that is very much larger may begin anywhere: then by Ehrlich and Aberth's.
    """
    z, converged = _newton(c, z, 3)
    left = np.flatnonzero(~converged.all(axis=0) & np.isfinite(z).all(axis=0))
    if left.size:
        # No two alike, and none real if its partner is not.
        apart = 1e-3 * np.exp(1j * np.arange(1, len(z) + 1))[:, None]
        found = z[:, left] + apart * (1 + np.abs(z[:, left]))
        for _ in range(_ABERTH):
            ratio = _slope_ratio(c[:, left], found)
            between = found[:, None] - found
            between[np.arange(len(z)), np.arange(len(z))] = np.inf
            found = found - ratio / (1 - ratio * (1 / between).sum(axis=1))
        z = z + 0j
        z[:, left], converged[:, left] = _newton(c[:, left], found, 3)
    return z, converged


def _newton(c: FloatArray, z: np.ndarray[Any, Any], count: int) -> tuple[Any, Any]:
    """As many steps of Newton's method, none where it would be large; which have converged."""
    for _ in range(count):
        step = _slope_ratio(c, z)
        error = np.abs(step)
        z = z - np.where(error < 1e-3 * (1 + np.abs(z)), step, 0.0)
    # Within `degree` of Newton's steps there is a zero, so that those far apart are all of them.
    # Of close ones the values tell, which are as small as rounding.
    converged = error < _CONVERGED * np.maximum(1.0, np.abs(z))
    if not converged.all():
        sizes = poly(list(np.abs(c)[:, None]), np.abs(z))
        converged |= (np.abs(poly(list(c[:, None]), z)) < _ROUNDED * sizes) & (sizes < np.inf)
    return z, converged


def _slope_ratio(c: FloatArray, z: np.ndarray[Any, Any]) -> Any:
    """p/p'."""
    value, slope = c[-1] + 0 * z, 0 * z
    for row in c[-2::-1]:
        slope = slope * z + value
        value = value * z + row
    return value / slope


def _companion(c: FloatArray, most: float = np.inf) -> Any:
    """Eigenvalues of the companion matrices, whose entries are clipped at `most`."""
    degree, count = len(c) - 1, c.shape[1]
    if degree == 1:
        return (np.clip(-c[0] / c[1], -most, most) + 0j)[None]
    matrix = np.zeros((count, degree, degree))
    matrix[:, np.arange(1, degree), np.arange(degree - 1)] = 1.0
    last = np.clip(-c[:-1] / c[-1], -most, most)
    fine = np.isfinite(last).all(axis=0)
    matrix[:, :, -1] = np.where(fine, last, 0.0).T
    return np.where(fine, np.linalg.eigvals(matrix).T, np.nan)


def _quadratic(c: FloatArray) -> Any:
    """The zeros for degree 2, by the formula that does not cancel."""
    half, product = c[1] / (-2 * c[2]), c[0] / c[2]
    root = np.sqrt(half * half - product + 0j)
    # The zero without cancellation first, the other from their product.
    first = half + np.where(half < 0, -root, root)
    return np.array([first, np.where(first == 0, 0.0, product / np.where(first == 0, 1, first))])


def _cubic(c: FloatArray) -> Any:
    """Viète's cosines where all are real, Cardano's sum and a quadratic else."""
    b, e, f = c[2] / c[3], c[1] / c[3], c[0] / c[3]
    middle = -b / 3
    p = e - b * b / 3
    q = f + b * (2 * b * b / 27 - e / 3)
    D = q * q / 4 + p * p * p / 27
    size = 2 * np.sqrt(np.maximum(-p / 3, 0.0))
    angle = np.arccos(np.clip(3 * q / np.where(p == 0, 1, p) / np.where(size == 0, 1, size), -1, 1))
    zeros = np.empty((3, len(b)), dtype=complex)
    for k in range(3):
        zeros[k] = middle + size * np.cos((angle - 2 * np.pi * k) / 3)
    one = np.flatnonzero(~(D < 0))
    if one.size:
        p, q = p[one], q[one]
        root = np.cbrt(np.abs(q) / 2 + np.sqrt(np.maximum(D[one], 0.0)))
        t = np.where(q > 0, -1.0, 1.0) * (root - p / (3 * np.where(root == 0, 1, root)))
        zeros[0, one] = t + middle[one]
        imag = np.sqrt(np.maximum(3 * t * t / 4 + p, 0.0))
        zeros[1, one] = middle[one] - t / 2 + 1j * imag
        zeros[2, one] = np.conj(zeros[1, one])
    return zeros


# -- truncated power series ------------------------------------------------------------------------


Coefficients = Sequence[Any]


def dot(a: Coefficients, b: Coefficients) -> Any:
    """The sum of a[k] b[k]."""
    return _sum(list(zip(a, b, strict=True)), 0)


def _sum(pairs: list[tuple[Any, Any]], nothing: Number) -> Any:
    """The sum of all products; `nothing` if there are none."""
    if len(pairs) > 2:
        context = getattr(pairs[0][0], "context", None) or getattr(pairs[0][1], "context", None)
        if context is not None:
            step()
            return context.fdot(pairs)
    if not pairs:
        return nothing
    total = pairs[0][0] * pairs[0][1]
    for x, y in pairs[1:]:
        total = total + x * y
    return total


def _support(c: Coefficients, first: int = 0) -> list[int]:
    """Indices from `first` on whose coefficient is not exactly zero."""
    return [k for k in range(first, len(c)) if isinstance(c[k], np.ndarray) or c[k] != 0]


def product(a: Coefficients, b: Coefficients, count: int | None = None) -> list[Any]:
    """The first `count` coefficients of a b, as many as both determine by default."""
    count = min(len(a), len(b)) if count is None else count
    others = _support(b[:count])
    rows: list[list[tuple[Any, Any]]] = [[] for _ in range(count)]
    for j in _support(a[:count]):
        x = a[j]
        for k in others:
            if j + k >= count:
                break
            rows[j + k].append((x, b[k]))
    nothing = 0 * a[0] * b[0]
    return [_sum(row, nothing) for row in rows]


def quotient(a: Coefficients, b: Coefficients, count: int) -> list[Any]:
    """The first `count` coefficients of a/b, b[0] not zero."""
    inverse, support = 1 / b[0], _support(b[:count], 1)
    rounded_once = hasattr(inverse, "context")
    series: list[Any] = []
    for n in range(count):
        near = [j for j in support if j <= n]
        total: Any = a[n] if n < len(a) else 0
        if near and rounded_once:
            total = total - _sum([(b[j], series[n - j]) for j in near], 0)
        elif near:
            total = total - b[near[0]] * series[n - near[0]]
            for j in near[1:]:
                # In place, now that it is not an entry of a any more.
                total -= b[j] * series[n - j]
        series.append(total * inverse)
    return series


def reciprocal(c: Coefficients) -> list[Any]:
    """As many coefficients of 1/c, c[0] not zero."""
    return quotient([1], c, len(c))


def composed(outer: Coefficients, inner: Coefficients, count: int) -> list[Any]:
    """The first `count` coefficients of outer(inner(t)), inner[0] = 0, by Horner's rule."""
    total = [0 * inner[0]] * count
    for c in reversed(outer):
        total = product(total, inner, count)
        total[0] = total[0] + c
    return total


def power(c: Coefficients, p: Number, q: int, count: int, first: Number) -> list[Any]:
    """The first `count` coefficients of c^(p/q); `first` is c[0]^(p/q).

    p and q are integers, or p an element of the arithmetic and q = 1.
    """
    support, series = _support(c[:count], 1), [first]
    for n in range(1, count):
        pairs = [((p * j - q * (n - j)) * c[j], series[n - j]) for j in support if j <= n]
        series.append(_sum(pairs, 0 * first) / (c[0] * (q * n)))
    return series


def exponential(c: Coefficients, count: int, first: Number) -> list[Any]:
    """The first `count` coefficients of e^c times a constant; `first` is the first."""
    slopes, series = _slopes(c, count), [first]
    for n in range(1, count):
        series.append(_next(slopes, series, n, 0 * first) / n)
    return series


def rotation(
    c: Coefficients, count: int, first: tuple[Any, Any], sign: int
) -> tuple[list[Any], list[Any]]:
    """sin c and cos c (`sign` -1) or sinh c and cosh c (1), from both values at c[0]."""
    slopes, (s, k) = _slopes(c, count), ([value] for value in first)
    for n in range(1, count):
        up, down = (_next(slopes, row, n, 0 * first[0]) / n for row in (k, s))
        s.append(up)
        k.append(sign * down)
    return s, k


def _slopes(c: Coefficients, count: int) -> list[tuple[int, Any]]:
    """The nonzero coefficients of t c', by their powers."""
    return [(j, j * c[j]) for j in _support(c[:count], 1)]


def _next(slopes: list[tuple[int, Any]], known: list[Any], n: int, nothing: Number) -> Any:
    """Coefficient n - 1 of c' times the series that is known to order n - 1."""
    return _sum([(s, known[n - j]) for j, s in slopes if j <= n], nothing)


class Truncated:
    """A power series of `count` coefficients `c`, on which emitted formulas run."""

    def __init__(self, c: Coefficients, count: int) -> None:
        self.c, self.count = c, count

    def __neg__(self) -> Truncated:
        return Truncated([-x for x in self.c], self.count)

    def __sub__(self, other: Truncated) -> Truncated:
        rows = zip(self.c, other.c, strict=True)
        return Truncated([x - y for x, y in rows], self.count)

    def __mul__(self, other: Truncated) -> Truncated:
        return Truncated(product(self.c, other.c, self.count), self.count)

    def __truediv__(self, other: Truncated) -> Truncated:
        return Truncated(quotient(self.c, other.c, self.count), self.count)


def laurent(
    phi: Coefficients, zero: bool, count: int, weight: Coefficients | None = None
) -> Iterator[list[Any]]:
    """The series of h_1 = g/phi, h_(k + 1) = -h_k'/phi, up to h_count; g = 1 without a `weight`.

    Integration by parts of int g e^(±lam V), V' = -phi, leaves the h_k as coefficients of lam^-k;
    with alternating signs they are the slow manifold of M' = g - lam phi M
    (`endpoint-series`). If `zero`, phi[0]
    counts as 0 and the series are those of h_k t^(2k - 1); else each is a coefficient shorter than
    the one before.
    """
    # Divided by phi, which is short where it is a polynomial, not times 1/phi.
    psi = phi[1:] if zero else phi
    count_of = len(psi) if weight is None else min(len(weight), len(psi))
    drift: Any = Truncated(psi, len(psi))
    source: Any = Truncated([1] if weight is None else weight, count_of)
    last = manifold_term(source, drift).c
    yield last
    for k in range(1, count):
        pole = 2 * k - 1 if zero else 0
        fall = [fall_by_powers(j, pole, c) for j, c in enumerate(last)][0 if zero else 1 :]
        source = Truncated(fall, len(fall))
        last = manifold_term(source, drift).c
        yield last


def residues(
    phi: Coefficients, count: int, weight: Coefficients | None = None, outer: Coefficients = (1,)
) -> list[Any]:
    """Residues of outer h_1, ..., outer h_count at a simple zero of phi, h_k those of `laurent`.

    The series are about the zero, phi[0] counts as 0; at least 2 `count` coefficients each.
    """
    rows = laurent(phi, True, count, weight)
    return [product(outer, row, 2 * k + 1)[2 * k] for k, row in enumerate(rows)]
