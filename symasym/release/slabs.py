"""Slabs of a parabolic equation in (u, z): Gauss-Lobatto elements in u, Radau IIA in z.

With z as the clock, and s = |z - z(first)| the way it has gone, the block's velocity u solves

    du = phi/(eps |g|) ds + kappa/sqrt(eps |g|) dW_s,

a diffusion in one dimension whose coefficients depend on s. Expectations of it solve the backward
equation, its density the forward one (Gardiner, Handbook of Stochastic Methods, section 3.6):

    eps |g| dT/ds' = phi T_u + D T_uu + source,          s' = -s,
    d(eps |g| y)/ds = -(phi y)_u + (D y)_uu + source,    D = kappa^2/2,

y being the density in u per unit of time, and both 0 at u = -r and r. In u they are discretised by
the Galerkin method on elements with Gauss-Lobatto nodes and weights W (Karniadakis and Sherwin,
Spectral/hp Element Methods, chapter 2); then

    W G dT/ds' = K T + W source,    d(W G y)/ds = K^T y + W source,    G = eps |g|,

so that each is the other's adjoint also after discretisation, and rows of K add to 0: what leaves
through the ends is what the inside loses. In z a slab is one step of Radau's method IIA (Hairer and
Wanner, Solving ODEs II, section IV.5): collocation at the zeros of P_n - P_(n-1), of order 2n - 1
and stiffly accurate. Elements hang together at their ends alone, so the unknowns inside them are
eliminated element by element, all at once, and what remains is block tridiagonal.
"""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import legendre

from symasym.base.inputs import FloatArray

__all__ = ["Elements", "Radau", "Slab", "radau"]


class Radau(NamedTuple):
    """Radau's rule on [0, 1]: its stages, and what it does with values at 0 and at the stages.

    Attributes
    ----------
    nodes : ndarray, shape (n,)
        The stages, the last one is 1.
    slopes : ndarray, shape (n, n + 1)
        Derivatives at the stages of the polynomial through 0 and the stages.
    weights : ndarray, shape (n,)
        Of the quadrature at the stages.
    top : ndarray, shape (n + 1,)
        The Legendre coefficient of degree n of that polynomial.
    """

    nodes: FloatArray
    slopes: FloatArray
    weights: FloatArray
    top: FloatArray


@cache
def radau(n: int) -> Radau:
    """The rule with n stages."""
    leading = np.zeros(n + 1)
    leading[n - 1 :] = -1.0, 1.0
    at = np.sort(legendre.legroots(leading).real)
    at[-1] = 1.0
    powers = np.concatenate([[-1.0], at])
    values = legendre.legvander(powers, n)
    inverse = np.linalg.inv(values)
    slopes = 2.0 * _derivatives(at, n) @ inverse
    through = np.linalg.inv(legendre.legvander(at, n - 1))
    return Radau((at + 1.0) / 2.0, slopes, through[0], inverse[n])


def _derivatives(x: FloatArray, degree: int) -> FloatArray:
    """Derivatives of the Legendre polynomials up to `degree`, a row for each x."""
    unit = np.eye(degree + 1)
    columns = [legendre.legval(x, legendre.legder(unit[k])) for k in range(degree + 1)]
    return np.stack(columns, axis=-1)


class Elements:
    """A mesh of (-r, r): Gauss-Lobatto nodes of one degree between breakpoints.

    Parameters
    ----------
    ends : ndarray, shape (m + 1,)
        Breakpoints in order, -r and r among them.
    degree : int
        Of the polynomials, at least 2.
    """

    def __init__(self, ends: FloatArray, degree: int) -> None:
        inner = np.sort(legendre.legroots(legendre.legder(np.eye(degree + 1)[degree])).real)
        x = np.concatenate([[-1.0], inner, [1.0]])
        self.ends = ends
        half = np.diff(ends)[:, None] / 2.0
        self.u = (ends[:-1, None] + ends[1:, None]) / 2.0 + half * x
        # One number for a node that two elements share.
        self.u[:, 0], self.u[:, -1] = ends[:-1], ends[1:]
        w = 2.0 / (degree * (degree + 1) * legendre.legval(x, np.eye(degree + 1)[degree]) ** 2)
        to_modes = np.linalg.inv(legendre.legvander(x, degree))
        self.weights = half * w
        self._base = _derivatives(x, degree) @ to_modes
        self._across = w[:, None] * self._base
        self._scale = w / half
        self.slope = self._base / half[:, :, None]

    def generator(self, phi: FloatArray, diffusion: FloatArray) -> FloatArray:
        """K: W times phi d/du + D d²/du², of elements, shape (..., m, n, n).

        D is continuous and given at the nodes, shape (m, n); integrating D T'' by parts leaves
        -D' T' beside the drift.
        """
        moved = np.einsum("mab,mb->ma", self.slope, diffusion)
        stretch = np.einsum("ca,mc,cb->mab", self._base, diffusion * self._scale, self._base)
        result: FloatArray = (phi - moved)[..., None] * self._across - stretch
        return result


class Slab:
    """One step in z of `Elements`: the linear system of its stages, eliminated.

    Parameters
    ----------
    elements : Elements
    rule : Radau
    step : float
        The way z goes, > 0.
    first, capacity : ndarray
        G at the slab's beginning, shape (m, n), and at its stages, (stages, m, n).
    generator : ndarray, shape (stages, m, n, n)
        K at the stages.
    forward : bool
        The forward equation, whose matrices are the transposed ones.
    """

    def __init__(
        self,
        elements: Elements,
        rule: Radau,
        step: float,
        first: FloatArray,
        capacity: FloatArray,
        generator: FloatArray,
        forward: bool,
    ) -> None:
        stages, m, n = capacity.shape
        self._stages = stages
        weights = elements.weights
        self._past = (
            -rule.slopes[:, 0, None, None] / step * weights * (first if forward else capacity)
        )
        block = np.zeros((m, stages, n, stages, n))
        places = np.arange(n)
        for i in range(stages):
            for j in range(stages):
                mass = weights * capacity[j if forward else i]
                block[:, i, places, j, places] = rule.slopes[i, j + 1] / step * mass
            block[:, i, :, i, :] -= np.swapaxes(generator[i], -1, -2) if forward else generator[i]
        inside, edges = slice(1, -1), (0, n - 1)
        k, e = stages * (n - 2), 2 * stages
        flat = block[:, :, inside, :, inside].reshape(m, k, k)
        self._inverse = np.linalg.inv(flat)
        out = block[:, :, inside][..., edges].transpose(0, 1, 2, 4, 3).reshape(m, k, e)
        into = block[:, :, edges][..., inside].transpose(0, 2, 1, 3, 4).reshape(m, e, k)
        corner = block[:, :, edges][..., edges].transpose(0, 2, 1, 4, 3).reshape(m, e, e)
        self._reach = self._inverse @ out
        self._into = into
        tied = corner - into @ self._reach
        self._levels = []
        while len(tied) > 1:
            level = _Joined(tied, stages)
            self._levels.append(level)
            tied = level.tied

    def solve(
        self, start: FloatArray, source: FloatArray, ends: tuple[float, float] = (0.0, 0.0)
    ) -> FloatArray:
        """Values at the stages, shape (stages, m, n), from those at the slab's beginning.

        `source` has W in it, and its shape is that of the values; `ends` are the values at
        u = -r and r.
        """
        stages, (m, n) = self._stages, start.shape
        right = self._past * start + source
        k = stages * (n - 2)
        interior = right[:, :, 1:-1].transpose(1, 0, 2).reshape(m, k, 1)
        partly = self._inverse @ interior
        edge = np.concatenate([right[:, :, 0].T, right[:, :, -1].T], axis=1)[..., None]
        edge = edge - self._into @ partly
        rights = [edge]
        for level in self._levels:
            rights.append(level.joined(rights[-1]))
        both = np.repeat(ends, stages)[None, :, None]
        for level, given in zip(reversed(self._levels), reversed(rights[:-1]), strict=True):
            both = level.parted(both, given)
        values = np.empty((stages, m, n))
        inner = (partly - self._reach @ both).reshape(m, stages, n - 2)
        values[:, :, 1:-1] = inner.transpose(1, 0, 2)
        values[:, :, 0], values[:, :, -1] = both[:, :stages, 0].T, both[:, stages:, 0].T
        return values


class _Joined:
    """Neighbours joined in pairs, the values that two of them share eliminated.

    A stretch of elements ties the values x, y at its ends by [[A, B], [C, D]] (x, y) = right-hand
    side, up to what its neighbours add; in pairs the number of stretches is halved, and a last one
    that has no partner is kept.
    """

    def __init__(self, tied: FloatArray, stages: int) -> None:
        pairs = len(tied) // 2
        s, e = slice(0, stages), slice(stages, None)
        left, right = tied[0 : 2 * pairs : 2], tied[1 : 2 * pairs : 2]
        self._stages, self._pairs = stages, pairs
        self._inverse = np.linalg.inv(left[:, e, e] + right[:, s, s])
        self._down = np.concatenate([left[:, e, s], right[:, s, e]], axis=2)
        self._up = np.concatenate([left[:, s, e], right[:, e, s]], axis=1)
        ours = np.zeros_like(left)
        ours[:, s, s], ours[:, e, e] = left[:, s, s], right[:, e, e]
        ours -= self._up @ (self._inverse @ self._down)
        self.tied = np.concatenate([ours, tied[2 * pairs :]])

    def joined(self, given: FloatArray) -> FloatArray:
        """Right-hand sides of the pairs from those of the stretches."""
        s, pairs = self._stages, self._pairs
        left, right = given[0 : 2 * pairs : 2], given[1 : 2 * pairs : 2]
        outer = np.concatenate([left[:, :s], right[:, s:]], axis=1)
        outer = outer - self._up @ (self._inverse @ (left[:, s:] + right[:, :s]))
        return np.concatenate([outer, given[2 * pairs :]])

    def parted(self, both: FloatArray, given: FloatArray) -> FloatArray:
        """Values at the ends of the stretches from those at the ends of the pairs."""
        s, pairs = self._stages, self._pairs
        left, right = given[0 : 2 * pairs : 2], given[1 : 2 * pairs : 2]
        ours = both[:pairs]
        shared = self._inverse @ (left[:, s:] + right[:, :s] - self._down @ ours)
        values = np.empty_like(given)
        values[0 : 2 * pairs : 2] = np.concatenate([ours[:, :s], shared], axis=1)
        values[1 : 2 * pairs : 2] = np.concatenate([shared, ours[:, s:]], axis=1)
        values[2 * pairs :] = both[pairs:]
        return values
