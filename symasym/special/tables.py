"""Tables of smooth functions for float64 arrays: polynomials on pieces of an interval.

A function is interpolated at Chebyshev nodes of each piece from mpmath's values, on first use. With
what grows or oscillates taken out of it, a dozen coefficients hold it to the last digits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from symasym.base.call_context import own_context
from symasym.base.inputs import FloatArray

__all__ = ["DIGITS", "Exact", "Table", "table_of"]

#: A function of mpmath numbers, with its context.
Exact = Callable[[Any, Any], tuple[Any, ...]]

#: Digits of the values that are interpolated.
DIGITS = 20


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
        t = (x - self.low) * (pieces / (self.high - self.low))
        piece = np.minimum(t.astype(np.intp), pieces - 1)
        t -= piece
        t *= 2
        t -= 1
        wanted = self.coefficients if chosen is None else [self.coefficients[k] for k in chosen]
        values = []
        for c in wanted:
            if pieces == 1:
                total = c[-1, 0] * t
                for row in c[-2:0:-1, 0]:
                    total = (total + row) * t
                values.append(total + c[0, 0])
                continue
            total = c[-1].take(piece)
            for row in c[-2::-1]:
                total *= t
                total += row.take(piece)
            values.append(total)
        return values


def table_of(f: Exact, low: float, high: float, pieces: int, terms: int) -> Table:
    """A table of `f` by interpolation at Chebyshev nodes, `terms` coefficients a piece."""
    nodes = np.polynomial.chebyshev.chebpts1(terms)
    width = (high - low) / pieces
    rows: list[list[list[float]]] = []
    with own_context(DIGITS) as context:
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
