"""Products of Airy functions and Dawson's integral for float64 arrays, from tables.

Each function is smooth once its exponential is taken out, so that polynomials on short pieces
(and in 1/x³ or 1/x² beyond them) hold it to the last digits. The tables are interpolated at
Chebyshev nodes from mpmath's values, on first use.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from symasym.base.contexts import own_context
from symasym.base.inputs import FloatArray

__all__ = [
    "AiryProducts", "Dawson", "Table", "airy_parts", "airy_products", "dawson", "dawson_parts",
]  # fmt: skip

#: A function of mpmath numbers, with its context.
Exact = Callable[[Any, Any], tuple[Any, ...]]

_DIGITS = 20
# Airy's oscillation and growth over a piece of 1/2 need 13 coefficients up to here.
_AIRY_END = 8.0
_AIRY_PIECES = 32
_TERMS = 13
# From here on e^{(4/3) Z^(3/2)} is taken out of the table and not of its value.
_AIRY_SCALED = 1.0
_DAWSON_END = 6.0
_DAWSON_PIECES = 24
# sqrt(2/3): where the expansion parameter 1/Z^(3/2) is largest.
_FAR_TERMS = 14


class Table(NamedTuple):
    """Several functions on [low, high] as polynomials on pieces of equal length.

    Attributes
    ----------
    coefficients : list of array, shape (terms, pieces)
        One array a function, ascending powers of the distance from the piece's middle, which runs
        from -1 to 1.
    """

    low: float
    high: float
    coefficients: list[FloatArray]

    def __call__(self, x: FloatArray, chosen: Sequence[int] | None = None) -> list[FloatArray]:
        """The functions (all, or those `chosen`) at `x` inside [low, high]."""
        pieces = self.coefficients[0].shape[1]
        place = (x - self.low) * (pieces / (self.high - self.low))
        piece = np.minimum(place.astype(np.intp), pieces - 1)
        t = place
        t -= piece
        t *= 2
        t -= 1
        wanted = self.coefficients if chosen is None else [self.coefficients[k] for k in chosen]
        found = []
        for c in wanted:
            if pieces == 1:
                total = c[-1, 0] * t
                for row in c[-2:0:-1, 0]:
                    total = (total + row) * t
                found.append(total + c[0, 0])
                continue
            total = c[-1].take(piece)
            for row in c[-2::-1]:
                total *= t
                total += row.take(piece)
            found.append(total)
        return found


def _table(f: Exact, low: float, high: float, pieces: int, terms: int) -> Table:
    nodes = np.polynomial.chebyshev.chebpts1(terms)
    width = (high - low) / pieces
    rows: list[list[list[float]]] = []
    with own_context(_DIGITS) as context:
        for k in range(pieces):
            values = []
            for t in nodes.tolist():
                x = context.mpf(low) + width * (k + (1 + context.mpf(t)) / 2)
                values.append([float(y) for y in f(x, context)])
            rows.append([list(column) for column in zip(*values, strict=True)])
    coefficients = []
    for n in range(len(rows[0])):
        kept = np.zeros((terms, pieces))
        for k, row in enumerate(rows):
            fit = np.polynomial.chebyshev.chebfit(nodes, row[n], terms - 1)
            powers = np.polynomial.chebyshev.cheb2poly(fit)
            kept[: len(powers), k] = powers
        coefficients.append(kept)
    return Table(low, high, coefficients)


# -- Airy ----------------------------------------------------------------------------------------


class AiryProducts(NamedTuple):
    """Times e^{-(4/3) Z^(3/2)} where Z > 0, the last two times its root.

    Attributes
    ----------
    squares : Ai² + Bi²
    cross : Ai Ai' + Bi Bi'
    slopes : Ai'² + Bi'²
    bi, bi_slope : Bi and Bi'
    """

    squares: FloatArray
    cross: FloatArray
    slopes: FloatArray
    bi: FloatArray
    bi_slope: FloatArray


def _products(z: Any, c: Any) -> tuple[Any, ...]:
    ai, bi, ai1, bi1 = c.airyai(z), c.airybi(z), c.airyai(z, 1), c.airybi(z, 1)
    fall = c.exp(-2 * z ** c.mpf(1.5) / 3) if z > _AIRY_SCALED else c.one
    found = ai * ai + bi * bi, ai * ai1 + bi * bi1, ai1 * ai1 + bi1 * bi1
    return (*(x * fall**2 for x in found), bi * fall, bi1 * fall)


def _beyond(sign: int) -> Exact:
    """Without their powers of |Z|, in (8/|Z|)^(3/2) from 0 to 1."""

    def found(t: Any, c: Any) -> tuple[Any, ...]:
        size = _AIRY_END / c.cbrt(t) ** 2
        z, root = sign * size, c.sqrt(size)
        ai, bi, ai1, bi1 = c.airyai(z), c.airybi(z), c.airyai(z, 1), c.airybi(z, 1)
        xi = 2 * size * root / 3
        fall = c.exp(-xi) if sign > 0 else c.one
        powers = root, c.one if sign > 0 else size * root, 1 / root
        squares = ai * ai + bi * bi, ai * ai1 + bi * bi1, ai1 * ai1 + bi1 * bi1
        scaled = [x * fall**2 * y for x, y in zip(squares, powers, strict=True)]
        half = c.sqrt(root)
        if sign > 0:
            return (*scaled, bi * fall * half, bi1 * fall / half)
        # Bi + i Ai and its slope, without their turning.
        turn = c.expj(xi + c.pi / 4)
        whole, slope = (bi + 1j * ai) * half * turn**-1, (bi1 + 1j * ai1) / half * turn**-1
        return (*scaled, whole.real, whole.imag, slope.real, slope.imag)

    return found


@lru_cache(maxsize=1)
def airy_parts() -> tuple[Table, Table, Table]:
    """Near 0, in (8/|Z|)^(3/2) below, and above; also what `symasym.emit.kernels.tables` writes."""
    near = _table(_products, -_AIRY_END, _AIRY_END, _AIRY_PIECES, _TERMS)
    below, above = (_table(_beyond(s), 0.0, 1.0, 1, _FAR_TERMS) for s in (-1, 1))
    return near, below, above


def airy_products(z: FloatArray, single: bool = True, double: bool = True) -> AiryProducts:
    """The products at every Z; relative errors are a few units of rounding.

    `single`: Bi and Bi'; `double`: the others. What is not wanted is left empty.
    """
    near, below, above = airy_parts()
    chosen = [k for k in range(5) if (single if k > 2 else double)]
    low, high = float(z.min(initial=np.inf)), float(z.max(initial=-np.inf))
    found = [np.empty(0)] * 5
    if low >= -_AIRY_END and high <= _AIRY_END:
        for k, x in zip(chosen, _near(near, z, low, high, chosen), strict=True):
            found[k] = x
        return AiryProducts(*found)
    for k in chosen:
        found[k] = np.empty_like(z)
    middle = np.abs(z) <= _AIRY_END
    if middle.any():
        part = _near(near, z[middle], -_AIRY_END, _AIRY_END, chosen)
        for k, x in zip(chosen, part, strict=True):
            found[k][middle] = x
    for sign, table in ((-1, below), (1, above)):
        rows = sign * z > _AIRY_END
        if rows.any():
            part = _far(table, sign, np.abs(z[rows]), chosen)
            for k, x in zip(chosen, part, strict=True):
                found[k][rows] = x
    return AiryProducts(*found)


def _near(
    table: Table, z: FloatArray, low: float, high: float, chosen: list[int]
) -> list[FloatArray]:
    found = table(z, chosen)
    if high > 0 and low < _AIRY_SCALED:
        # Where the table has the exponential, it is taken out here.
        part = np.where(z < _AIRY_SCALED, np.maximum(z, 0.0), 0.0)
        fall = np.exp(part * np.sqrt(part) * (-2 / 3))
        twice = fall * fall
        found = [x * (fall if k > 2 else twice) for k, x in zip(chosen, found, strict=True)]
    return found


def _far(table: Table, sign: int, size: FloatArray, chosen: list[int]) -> list[FloatArray]:
    root = np.sqrt(size)
    cube = size * root
    t, half = _AIRY_END**1.5 / cube, np.sqrt(root)
    found: list[FloatArray] = []
    if 0 in chosen:
        squares, cross, slopes = table(t, range(3))
        found += [squares / root, cross if sign > 0 else cross / cube, slopes * root]
    if 3 not in chosen:
        return found
    if sign > 0:
        bi, slope = table(t, (3, 4))
    else:
        turn = cube * (2 / 3) + np.pi / 4
        cosine, sine = np.cos(turn), np.sin(turn)
        real, imaginary, slope_real, slope_imaginary = table(t, range(3, 7))
        bi = real * cosine - imaginary * sine
        slope = slope_real * cosine - slope_imaginary * sine
    return [*found, bi / half, slope * half]


# -- Dawson and the error function -----------------------------------------------------------------


class Dawson(NamedTuple):
    """For x >= 0.

    Attributes
    ----------
    shade : e^{x²} erfc(x)
    value : Dawson's integral F(x)
    area : twice the integral of F from 0 to x
    """

    shade: FloatArray
    value: FloatArray
    area: FloatArray


def _dawsons(x: Any, c: Any) -> tuple[Any, ...]:
    shade = c.exp(x * x) * c.erfc(x)
    value = c.sqrt(c.pi) / 2 * c.exp(-x * x) * c.erfi(x)
    return shade, value, x * x * c.hyp2f2(1, 1, c.mpf(3) / 2, 2, -x * x)


def _dawsons_beyond(t: Any, c: Any) -> tuple[Any, ...]:
    """Without their powers of x, the area without its logarithm, in (6/x)² from 0 to 1."""
    x = _DAWSON_END / c.sqrt(t)
    with c.workdps(2 * _DIGITS):
        shade, value, area = _dawsons(x, c)
        return shade * x, value * x, area - c.log(x) - (c.euler + c.log(4)) / 2


@lru_cache(maxsize=1)
def dawson_parts() -> tuple[Table, Table]:
    """Near 0, and in (6/x)^2 beyond; also what `symasym.emit.kernels.tables` writes."""
    near = _table(_dawsons, 0.0, _DAWSON_END, _DAWSON_PIECES, _TERMS)
    return near, _table(_dawsons_beyond, 0.0, 1.0, 1, _FAR_TERMS)


def dawson(x: FloatArray) -> Dawson:
    """The three functions at every x >= 0."""
    near, beyond = dawson_parts()
    found = np.empty((3, *x.shape))
    rows = x <= _DAWSON_END
    if rows.any():
        found[:, rows] = near(x[rows])
    if not rows.all():
        far = x[~rows]
        shade, value, area = beyond((_DAWSON_END / far) ** 2)
        area = area + np.log(far) + (np.euler_gamma + np.log(4.0)) / 2
        found[:, ~rows] = shade / far, value / far, area
    return Dawson(*found)
