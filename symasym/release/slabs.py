"""One step of the density's equation: Gauss-Lobatto elements in u, Radau IIA in z.

With s, the way that z has gone, as time, the state u is a diffusion on a line,

    du = phi/(eps |g|) ds + kappa sigma/sqrt(eps |g|) dW_s,

and p, its density times eps |g| W over the nodes' weights W, solves (Gardiner, Handbook of
Stochastic Methods, section 3.6)

    dp/ds = K^T p/(eps |g| W) + source,    K: W times phi d/du + (kappa sigma)^2/2 d^2/du^2.

K is Galerkin's on elements with Gauss-Lobatto nodes (Karniadakis and Sherwin, Spectral/hp Element
Methods, chapter 2). Its rows add to 0, so that probability is kept; the ends -r and r absorb: p
there is the chance to have left. A slab is one step of Radau's method IIA (Hairer and Wanner,
Solving ODEs II, section IV.5): collocation at the zeros of P_n - P_(n-1), of order 2n - 1 and
stiffly accurate. Its stages are one sparse system, factorised once for all right-hand sides.
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Legendre, legendre

from symasym.base.inputs import FloatArray


class Radau(NamedTuple):
    """Radau's rule on [0, 1], of n stages: matrices take values at 0 and the stages."""

    nodes: Any  # the stages; the last one is 1
    slopes: Any  # derivatives at the stages
    integral: Any  # from 0 to the stages, from values at the stages alone
    top: Any  # the Legendre coefficient of degree n
    places: Any  # the stages of the rule that has eight
    filled: Any  # values there
    change: Any  # and what quadrature there has of the change over the slab


@cache
def radau(n: int) -> Radau:
    """The rule with n stages."""
    at, x = _stages(n), _stages(8)
    inverse = np.linalg.inv(legendre.legvander(np.append(-1.0, at), n))
    slopes = 2.0 * _slopes(at, n) @ inverse
    weights = np.linalg.inv(legendre.legvander(x, 7))[0]
    change = 2.0 * weights[:, None] * _slopes(x, n) @ inverse
    filled, integral = legendre.legvander(x, n) @ inverse, np.linalg.inv(slopes[:, 1:])
    return Radau((at + 1) / 2, slopes, integral, inverse[n], (x + 1) / 2, filled, change)


def _stages(n: int) -> FloatArray:
    """Those of n on [-1, 1]."""
    at = np.sort((Legendre.basis(n) - Legendre.basis(n - 1)).roots().real)
    return np.append(at[:-1], 1.0)


def _slopes(x: FloatArray, degree: int) -> FloatArray:
    """Derivatives of the Legendre polynomials up to `degree`, a row for each x."""
    return np.stack([Legendre.basis(k).deriv()(x) for k in range(degree + 1)], axis=-1)


class Elements:
    """A mesh of (-r, r): nodes u in order and their weights W, of one degree between `ends`."""

    def __init__(self, ends: FloatArray, degree: int) -> None:
        p, m = Legendre.basis(degree), len(ends) - 1
        x = np.concatenate([[-1.0], np.sort(p.deriv().roots().real), [1.0]])
        w = 2.0 / (degree * (degree + 1) * p(x) ** 2)
        self._half = np.diff(ends)[:, None, None] / 2.0
        self._index = np.arange(m)[:, None] * degree + np.arange(degree + 1)
        self.u, self.weights = np.empty(m * degree + 1), np.zeros(m * degree + 1)
        self.u[self._index] = ends[:-1, None] + self._half[:, 0] * (x + 1.0)
        # Breakpoints are the nodes that two elements share.
        self.u[::degree] = ends
        np.add.at(self.weights, self._index, self._half[:, 0] * w)
        self._slope = _slopes(x, degree) @ np.linalg.inv(legendre.legvander(x, degree))
        self._w = w

    def generator(self, phi: FloatArray, diffusion: FloatArray) -> FloatArray:
        """K of each element; integrating D T'' by parts leaves -D' T' beside the drift."""
        index, slope, w = self._index, self._slope, self._w
        D = diffusion[index]
        moved = phi[..., index] - D @ slope.T / self._half[:, 0]
        stretch = np.einsum("ca,mc,cb->mab", slope, D * w, slope) / self._half
        return np.asarray((moved * w)[..., None] * slope - stretch)

    def slab(self, rule: Radau, step: float, rates: FloatArray, generators: FloatArray) -> Any:
        """Of a slab with 1/(eps |g|) and K at its stages: p there from p before and a source."""
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        n, size, index = len(rule.nodes), len(self.u), self._index
        flow = rates / self.weights
        flow[:, [0, -1]] = 0.0  # the ends absorb
        # Unknowns in the order of u, the stages of a node together.
        place = n * index + np.arange(n)[:, None, None]
        column = np.broadcast_to(place[..., None], generators.shape)
        every, clock = np.arange(n * size), rule.slopes[:, 1:] / step
        rows = np.concatenate([column.swapaxes(2, 3).ravel(), every.repeat(n)])
        columns = np.concatenate([column.ravel(), np.tile(every.reshape(size, n), n).ravel()])
        moved = (generators * flow[:, index, None]).ravel()
        data = np.concatenate([-moved, np.tile(clock.ravel(), size)])
        factors = splu(csc_array((data, (rows, columns))), permc_spec="NATURAL")
        past = -rule.slopes[:, 0] / step

        def solve(start: FloatArray, source: FloatArray | float) -> FloatArray:
            right = past[:, None] * start + source
            return np.asarray(factors.solve(right.T.ravel()).reshape(size, n).T)

        return solve
