"""The release of a system whose slow variable z is monotonic, by a march in z.

Let s be the distance that z has moved. With s as time the state u is a diffusion on a line,

    du = phi/(eps |g|) ds + kappa sigma/sqrt(eps |g|) dW_s.

Let p be the probabilities of the nodes, t the time, C(s) the time of a block that stays at the
start's u, and p1, p2 the probabilities times the first and second moments of t - C there. Then

    p' = A p,    p1' = A p1 + c p,    p2' = A p2 + 2 c p1,    c = 1/(eps |g|) - C',

where A = K^T/(eps |g| W) (Gardiner, Handbook of Stochastic Methods, section 3.6). W has the nodes'
weights, and K is W times phi d/du + (kappa sigma)^2/2 d^2/du^2 by Galerkin's method on
Gauss-Lobatto elements (Karniadakis and Sherwin, Spectral/hp Element Methods, chapter 2). The rows
of K add up to 0, which conserves probability; -r and r absorb, and p there is the probability of
having left. The flux of p, p1 and p2 into -r and r gives the law of z at release and the first two
moments of t - C at each z, hence mean, variance and sides. Given z, the time is taken as normal; if
g does not depend on u it equals C, and the law of the time is exact.

A slab is one step of the Radau IIA method (Hairer and Wanner, Solving ODEs II, section IV.5):
collocation at the zeros of P_n - P_(n-1), of order 2n - 1 and stiffly accurate. Its stages form one
sparse system, factorised once for p, p1 and p2. The contribution of the highest degree to p
controls the steps. A second march halves every slab and raises the elements' degree by two; its
difference from the first is the stated error.
"""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Legendre, legendre

from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray
from symasym.release.system import System, values

_MOST_ELEMENTS, _FINEST = 1500, 6
_MOST = 2_000_000  # the nodes of all slabs together, for which a march takes one to two minutes


class Scene(NamedTuple):
    """The numbers of one release, in float64 and scaled variables."""

    system: System
    kappa: float
    r: float
    eps: float
    u: float
    z: float

    def phi(self, u: FloatArray, z: Any) -> FloatArray:
        return values(self.system.phi, u, z, self.eps)

    def velocity(self, u: FloatArray, z: Any) -> FloatArray:
        return values(self.system.velocity, u, z, self.eps)

    def noise(self, u: FloatArray) -> FloatArray:
        return self.kappa * values(self.system.noise, u)

    @property
    def sign(self) -> float:
        """The direction in which z moves."""
        return float(np.sign(self.velocity(np.array(self.u), self.z)))


def mesh(scene: Scene, way: float, coarse: float) -> FloatArray:
    """Breakpoints of the elements, fine where the solution bends, with sizes scaled by `coarse`.

    Boundary layers at the ends have the width kappa^2/(2 |phi|), the transition over a barrier
    kappa/sqrt(2 |phi_u|), and outside the layer paths that z sends apart, d = eps t^2/2, are
    blurred by kappa sqrt(t), as are packets in flight to r.
    """
    r, across = scene.r, np.linspace(-1.0, 1.0, 201)
    # The least noise makes the thinnest boundary layers.
    kappa = float(scene.noise(across).min())
    z = np.linspace(scene.z, scene.z + scene.sign * way, 9)[:, None]
    ends = np.abs(scene.phi(np.array([-r, r]), z)).max()
    bend = np.abs(np.gradient(scene.phi(across, z), across, axis=1)).max()
    skin = kappa**2 / (2.0 * max(ends, 1e-300))
    width = 2.5 * kappa / np.sqrt(2.0 * max(bend, 1e-300))
    points = [np.array([-r])]
    # Dense towards both ends of a stretch, where the elements are smallest.
    shares = (t := np.linspace(0.0, 1.0, 4001) ** 4) / (t + t[::-1])
    for low, high in pairwise(sorted({-r, r, scene.u, *(x for x in (-1.0, 1.0) if abs(x) < r)})):
        u = low + (high - low) * shares
        away = np.maximum(np.abs(u) - 1.0, 0.0)
        blur = kappa * np.minimum(2.5 * (2.0 * away / scene.eps) ** 0.25, 4.0 * np.sqrt(1.0 + away))
        size = np.minimum(min(width, 0.5) + 0.5 * away, np.maximum(blur, width))
        size = coarse * np.minimum(size, 3.0 * skin + 0.5 * (r - np.abs(u)))
        with np.errstate(divide="ignore", over="ignore"):
            steps = (1.0 / size[1:] + 1.0 / size[:-1]) / 2 * np.diff(u)
        count = np.append(0.0, np.cumsum(steps))
        if not count[-1] + len(points) <= _MOST_ELEMENTS:
            raise AccuracyError(
                f"the march would need {count[-1]:.4g} elements in u or more at kappa = "
                f"{kappa:g}, above {_MOST_ELEMENTS}; take kappa larger, or method 'simulate'."
            )
        parts = np.linspace(0.0, count[-1], max(1, int(np.ceil(count[-1]))) + 1)
        points.append(np.append(np.interp(parts[1:-1], count, u), high))
    return np.concatenate(points)


# -- elements in u, steps in z ---------------------------------------------------------------------


def _slopes(x: FloatArray, degree: int) -> FloatArray:
    """Derivatives of the Legendre polynomials up to `degree`, a row for each x."""
    return np.stack([Legendre.basis(k).deriv()(x) for k in range(degree + 1)], axis=-1)


@cache
def radau(n: int) -> tuple[Any, ...]:
    """Radau's rule on [0, 1]: its n stages, the last of which is 1; the matrix of integrals from 0
    to the stages; and, from values at 0 and the stages, the matrix of derivatives and the Legendre
    coefficient of the highest degree."""
    at = np.sort((Legendre.basis(n) - Legendre.basis(n - 1)).roots().real)
    at[-1] = 1.0
    inverse = np.linalg.inv(legendre.legvander(np.append(-1.0, at), n))
    slopes = 2.0 * _slopes(at, n) @ inverse
    return (at + 1) / 2, np.linalg.inv(slopes[:, 1:]), slopes, inverse[n]


class March:
    """The density on elements of one degree between `ends`, advanced slab by slab.

    After `finish` there are, at each stage, the distance s (`way`), the time C(s) (`clock`), the
    probability of having `left`, its `density`, and in three columns the quadrature's `share` of
    the losses of p, p1 and p2; the mean and the standard deviation; and p[0] with the exits.
    """

    def __init__(self, scene: Scene, ends: FloatArray, degree: int, stages: int) -> None:
        self.scene, self._sign, self._rule = scene, scene.sign, radau(stages)
        p, m = Legendre.basis(degree), len(ends) - 1
        x = np.concatenate([[-1.0], np.sort(p.deriv().roots().real), [1.0]])
        self._w = 2.0 / (degree * (degree + 1) * p(x) ** 2)
        self._slope = _slopes(x, degree) @ np.linalg.inv(legendre.legvander(x, degree))
        self._half = np.diff(ends)[:, None, None] / 2.0
        self._index = index = np.arange(m)[:, None] * degree + np.arange(degree + 1)
        self.u, self._weights = u, weights = np.empty(m * degree + 1), np.zeros(m * degree + 1)
        u[index] = ends[:-1, None] + self._half[:, 0] * (x + 1.0)
        u[::degree] = ends  # two elements share them
        np.add.at(weights, index, self._half[:, 0] * self._w)
        # The unknowns are ordered by u, with the stages of a node together.
        place = np.broadcast_to(
            (stages * index + np.arange(stages)[:, None, None])[..., None],
            (stages, m, degree + 1, degree + 1),
        )
        every = np.arange(stages * u.size)
        across = np.tile(every.reshape(u.size, stages), stages).ravel()
        rows = np.concatenate([place.swapaxes(2, 3).ravel(), every.repeat(stages)])
        self._places = rows, np.concatenate([place.ravel(), across])
        self.p = [np.where(u == scene.u, 1.0, 0.0), np.zeros_like(u), np.zeros_like(u)]
        self.gone, self.time, self.held = 0.0, 0.0, 1.0
        self.rows: list[tuple[FloatArray, ...]] = []

    def _rates(self, z: FloatArray) -> FloatArray:
        """1/(eps |g|) at all u for each z; an InputError if z is not monotonic."""
        g = self.scene.velocity(self.u, z[:, None]) * self._sign
        if not (g > 0).all():
            row, column = np.unravel_index(np.argmin(g), g.shape)
            raise InputError(
                f"the velocity of z is 0, changes its sign or has no value at z = {z[row]:.6g} and "
                f"u = {self.u[column]:.3g}; make r eps smaller (below 1 for friction), or take "
                "method 'simulate'."
            )
        return np.asarray(1.0 / (self.scene.eps * g))

    def _generators(self, z: FloatArray) -> FloatArray:
        """K of each element for each z; partial integration of D T'' adds -D' T' to phi T'."""
        D = self.scene.noise(self.u)[self._index] ** 2 / 2
        moved = (
            self.scene.phi(self.u, z[:, None])[..., self._index]
            - D @ self._slope.T / self._half[:, 0]
        )
        stretch = np.einsum("ca,mc,cb->mab", self._slope, D * self._w, self._slope) / self._half
        return np.asarray((moved * self._w)[..., None] * self._slope - stretch)

    def advance(self, step: float, most: float = np.inf) -> float:
        """The contribution of the highest degree to p; above `most` the slab is not completed."""
        from scipy.sparse import csc_array
        from scipy.sparse.linalg import splu

        nodes, integral, slopes, top = self._rule
        p, n, way = self.p, len(nodes), self.gone + step * nodes
        z = self.scene.z + self._sign * way
        rates = self._rates(z)
        clock = rates[:, self.u == self.scene.u]
        flow, ahead = rates / self._weights, rates - clock
        for x in (flow, ahead):
            x[:, [0, -1]] = 0.0  # the ends absorb
        moved = (self._generators(z) * flow[:, self._index, None]).ravel()
        if not np.isfinite(moved).all():
            raise InputError(f"phi has no value at some |u| < r near z = {z[-1]:.6g}; change it.")
        data = np.concatenate([-moved, np.tile(slopes[:, 1:].ravel() / step, self.u.size)])
        factors = splu(csc_array((data, self._places)), permc_spec="NATURAL")

        def solve(start: FloatArray, source: FloatArray | float) -> FloatArray:
            right = source - slopes[:, :1] / step * start
            return np.vstack([start, factors.solve(right.T.ravel()).reshape(-1, n).T])

        new = [solve(p[0], 0.0)]
        error = float(np.abs(top @ new[0]).sum())
        if error > most:
            return error
        for k in (1, 2):
            new.append(solve(p[k], k * ahead * new[-1][1:]))
        lost = np.stack([one[:, 0] + one[:, -1] for one in new], axis=1)
        time, density = self.time + step * integral @ clock[:, 0], slopes @ lost / step
        self.rows.append((way, time, lost[1:, 0], density, step * integral[-1]))
        self.p, self.gone, self.time = [one[-1] for one in new], float(way[-1]), float(time[-1])
        # Absolute values, as unresolved packets emit waves of both signs.
        self.held = float(np.abs(self.p[0][1:-1]).sum())
        return error

    def finish(self) -> None:
        """Tables and moments of the release."""
        tables = (np.concatenate(row) for row in zip(*self.rows, strict=True))
        self.way, self.clock, self.left, densities, weights = tables
        self.density, self.share = densities[:, 0], densities * weights[:, None]
        lost, once, twice = self.share.T
        self.mean = float(self.clock @ lost + once.sum())
        off = self.clock - self.mean
        self.std = max(float(off**2 @ lost + 2.0 * off @ once + twice.sum()), 0.0) ** 0.5


def march(scene: Scene, rtol: float) -> tuple[March, March, float]:
    """Two marches, and the error of the mean by the second one, at most `rtol` times the mean."""
    stages, degree = (4, 6) if rtol > 1e-7 else (5, 8)
    coarse, tol, way, last, nodes = 1.5, min(1e-3, 30.0 * rtol**0.6), 0.0, np.nan, 0
    for _ in range(_FINEST):
        ends = mesh(scene, way, coarse)
        rough, fine = (March(scene, ends, k, stages) for k in (degree, degree + 2))
        step = scene.eps * 1e-3
        while rough.held > 1e-3 * rtol:
            error = rough.advance(step, 2.0 * tol if step > 1e-12 * (1 + abs(scene.z)) else np.inf)
            if rough.gone > fine.gone:
                fine.advance(step / 2)
                fine.advance(step / 2)
            nodes += rough.u.size
            if nodes > _MOST:
                raise AccuracyError(
                    f"after {nodes} nodes the block is still held with probability "
                    f"{min(rough.held, 1):.2g}, when z has gone {rough.gone:.6g}; start nearer to "
                    "its release, or take kappa larger."
                )
            step *= min(3.0, max(0.1, 0.8 * (tol / max(error, 1e-300)) ** (1.0 / stages)))
        rough.finish()
        fine.finish()
        # The two may agree by chance; each round reduces the errors by a factor of about 30.
        apart = np.fmax(abs(fine.mean - rough.mean), abs(fine.mean - last) / 30.0)
        # The remaining time at the end is of the order of the elapsed time.
        missing = 3.0 * fine.held * (fine.mean + fine.time)
        error = float(apart + missing + 4e-14 * len(rough.rows) ** 0.5 * fine.mean)
        if fine.mean > 0 and error <= rtol * fine.mean:
            return rough, fine, error
        last, way = fine.mean, fine.gone
        tol, coarse, degree = tol / 30.0, coarse * 0.8, degree + 1
    raise AccuracyError(
        f"the march gives {fine.mean:.6g} with error {error:.2g} in {len(ends) - 1} elements and "
        f"{len(fine.rows)} slabs, and {rtol:.2g} is asked; ask for a larger rtol."
    )
