"""Linear differential equations of the second order by collocation at Chebyshev's points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

Coefficient = Callable[[Any], Any]


def points(low: float, high: float, count: int = 26) -> tuple[Any, Any]:
    """Points from low to high, and the matrix that takes the derivative of values there."""
    k = np.arange(count)
    x = -np.cos(np.pi * k / (count - 1))
    c = np.where((k == 0) | (k == count - 1), 2.0, 1.0) * (-1.0) ** k
    gap = x[:, None] - x + np.eye(count)
    D = np.outer(c, 1 / c) / gap
    D -= np.diag(D.sum(axis=1))
    half = (high - low) / 2
    return low + half * (x + 1), D / half


def matrix(coefficients: tuple[Coefficient, ...], x: Any, D: Any) -> Any:
    """a q'' + b q' + c q at the points, from (a, b, c)."""
    a, b, c = (np.broadcast_to(one(x), x.shape) for one in coefficients)
    return a[:, None] * (D @ D) + b[:, None] * D + np.diag(c)


def source_at_zero(coefficients: tuple[Coefficient, ...], r: float, start: float = 0.0) -> Any:
    """q and q' as functions of u where the equation has -delta at `start`, 0 at -r and r."""
    left, right = points(-r, start), points(start, r)
    n = len(left[0])
    A, known = np.zeros((2 * n, 2 * n)), np.zeros(2 * n)
    for (x, D), at in ((left, 0), (right, n)):
        A[at : at + n, at : at + n] = matrix(coefficients, x, D)
    for row in (0, n - 1, n, 2 * n - 1):
        A[row] = 0
    A[0, 0] = A[-1, -1] = 1
    # Continuous, and a q' falls by 1.
    A[n - 1, n - 1], A[n - 1, n] = 1, -1
    a = float(np.broadcast_to(coefficients[0](np.array([start])), 1)[0])
    A[n, n:], A[n, :n] = a * right[1][0], -a * left[1][-1]
    known[n] = -1
    q = np.linalg.solve(A, known)
    sides = (left, q[:n]), (right, q[n:])
    values = [_through(x, y) for (x, _), y in sides]
    slopes = [_through(x, D @ y) for (x, D), y in sides]

    def joined(both: list[Any]) -> Any:
        left, right = both
        return lambda u: np.where(
            u < start, left(np.minimum(u, start)), right(np.maximum(u, start))
        )

    return joined(values), joined(slopes)


def _through(x: Any, y: Any) -> Any:
    """The polynomial through values at Chebyshev's points, by its barycentric form."""
    weights = (-1.0) ** np.arange(len(x))
    weights[[0, -1]] /= 2

    def at(u: Any) -> Any:
        gaps = np.asarray(u)[:, None] - x
        known = np.abs(gaps) < 1e-15
        parts = weights / np.where(known, 1.0, gaps)
        parts = np.where(known.any(axis=1)[:, None], known, parts)
        return parts @ y / parts.sum(axis=1)

    return at


def without_flux(coefficients: tuple[Coefficient, ...], low: float, high: float) -> Any:
    """The steady state between walls as a function of u, up to a factor: the null vector."""
    x, D = points(low, high)
    whole = matrix(coefficients, x, D)
    # The flux, of which the equation is the derivative, is a q' + b q where a is constant.
    a = np.broadcast_to(coefficients[0](x), x.shape)
    b = np.broadcast_to(coefficients[1](x), x.shape)
    flux = a[:, None] * D + np.diag(b)
    whole[0], whole[-1] = flux[0], flux[-1]
    q = np.linalg.svd(whole)[2][-1]
    return _through(x, q * np.sign(q.sum()))
