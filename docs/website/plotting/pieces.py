"""Integrals of e^(+-lam V) by plain quadrature, for the plots; the engines share none of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

_X, _W = np.polynomial.legendre.leggauss(16)
_PANELS = 250

Potential = Callable[[Any], Any]


def friction_potential(u: Any) -> Any:
    """V of friction with mu = 3, alpha = 1, z0 = -0.4, from the antiderivatives of its parts."""
    z0 = -0.4
    inside = -(1 - z0) * (u + 1) + 2 * (u**2 - 1) - 3 * (u**4 - 1) / 4
    left, right = -(2 - z0) * (u + 1), -2 * (1 - z0) + z0 * (u - 1)
    return np.where(u < -1, left, np.where(u > 1, right, inside))


def nodes(a: float, b: float, panels: int = _PANELS) -> tuple[Any, Any]:
    """Nodes and weights of Gauss-Legendre panels from a to b, a row a panel."""
    edges = np.linspace(a, b, panels + 1)
    middle, half = (edges[1:] + edges[:-1]) / 2, np.diff(edges) / 2
    return middle[:, None] + half[:, None] * _X, half[:, None] * _W


def single(V: Potential, factor: float, a: float, b: float) -> float:
    """The integral of e^(factor V) from a to b, V smooth between them."""
    x, w = nodes(a, b)
    return float(np.sum(w * np.exp(factor * V(x))))


def running(V: Potential, factor: float, a: float, b: float) -> tuple[Any, Any, Any]:
    """(x, w, I): nodes of [a, b], their weights, and the integral from a to each of them."""
    x, w = nodes(a, b)
    whole = np.cumsum(np.sum(w * np.exp(factor * V(x)), axis=1))
    before = np.concatenate([[0.0], whole[:-1]])
    left = np.linspace(a, b, _PANELS + 1)[:-1, None]
    half = (x - left) / 2
    inner = (left + half)[..., None] + half[..., None] * _X
    rest = half * np.sum(_W * np.exp(factor * V(inner)), axis=-1)
    return x, w, before[:, None] + rest


def triangle(V: Potential, lam: float, a: float, b: float) -> float:
    """lam times the integral of e^(lam (V(v) - V(u))) over a < u < v < b."""
    x, w, inside = running(V, -lam, a, b)
    return float(lam * np.sum(w * np.exp(lam * V(x)) * inside))


def rectangle(V: Potential, lam: float, u: tuple[float, ...], v: tuple[float, ...]) -> float:
    """lam times the same over u in one stretch, v in another behind it, each with its kinks."""
    below = sum(single(V, -lam, *ends) for ends in zip(u, u[1:], strict=False))
    return lam * below * sum(single(V, lam, *ends) for ends in zip(v, v[1:], strict=False))


def without_exit(V: Potential, lam: float, r: float, edge: float = 1.0) -> float:
    """The mean escape time from 0 without the terms of C (eq:TtildeCzero): its four pieces.

    The layer ends at `edge` and -`edge`.
    """
    first = rectangle(V, lam, (-r, -edge), (0, edge))
    second = well_piece(V, lam, edge)
    third = rectangle(V, lam, (-r, -edge, 0, edge), (edge, r))
    return first + second + third + triangle(V, lam, edge, r)


def well_piece(V: Potential, lam: float, edge: float = 1.0) -> float:
    """The second piece: -1 < u < v, 0 < v < 1."""
    return rectangle(V, lam, (-edge, 0), (0, edge)) + triangle(V, lam, 0, edge)


def left_half(V: Potential, lam: float, r: float, edge: float = 1.0) -> float:
    """lam times the integral of e^(lam (V(v) - V(u))) over -r < u < v < 0."""
    below = triangle(V, lam, -r, -edge) + rectangle(V, lam, (-r, -edge), (-edge, 0))
    return below + triangle(V, lam, -edge, 0)


def halves(V: Potential, lam: float, r: float, edge: float = 1.0) -> tuple[float, float]:
    """The integrals of e^(lam V) from -r to 0 and from 0 to r."""
    return (
        single(V, lam, -r, -edge) + single(V, lam, -edge, 0),
        single(V, lam, 0, edge) + single(V, lam, edge, r),
    )


def as_printed(V: Potential, lam: float, r: float, edge: float = 1.0) -> float:
    """The mean escape time from 0 with the factor H(v) - C (eq:Ttilde), which changes its sign."""
    left, right = halves(V, lam, r, edge)
    C = right / (left + right)
    return (1 - C) * without_exit(V, lam, r, edge) - C * left_half(V, lam, r, edge)
