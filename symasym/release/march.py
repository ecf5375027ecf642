"""The release of a system whose slow variable is a clock, marched in it.

Where g keeps its sign, z is a clock and the state u a diffusion on a line (see
`symasym.release.slabs`). With p the chance to be at a node, C(s) the time that z takes over the way
s at u = 0, and p1, p2 that chance times the first and the second power of the time t - C,

    p' = A p,    p1' = A p1 + c p,    p2' = A p2 + 2 c p1,    c = 1/(eps |g|) - C'

are marched from the start until all but nothing is held. What p, p1 and p2 lose through -r and r
is the law of z at release and the first two moments of t - C at each z: hence the mean, the
variance and the sides. Given z, the time is taken as normal; where g does not depend on u it is C,
and the law of the time exact.

Steps in z follow what a slab's highest degree adds to p. A second march has every slab halved and
elements of two degrees more; its difference from the first is the error that is stated.
"""

from __future__ import annotations

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray
from symasym.release.slabs import Elements, radau
from symasym.release.system import System, values

_MOST_ELEMENTS, _MOST_SLABS, _FINEST = 1500, 3000, 6


class Scene(NamedTuple):
    """One question, in float64 and scaled variables."""

    system: System
    kappa: float
    r: float
    eps: float
    u: float
    z: float

    def phi(self, u: FloatArray, z: Any) -> FloatArray:
        """phi at scaled positions u and at z."""
        return values(self.system.phi, u, z, self.eps)

    def velocity(self, u: FloatArray, z: Any) -> FloatArray:
        """g, likewise."""
        return values(self.system.velocity, u, z, self.eps)

    def noise(self, u: FloatArray) -> FloatArray:
        """kappa sigma."""
        return self.kappa * values(self.system.noise, u)

    @property
    def sign(self) -> float:
        """The direction in which z goes."""
        return float(np.sign(self.velocity(np.array(self.u), self.z)))

    def speed(self, u: FloatArray, z: FloatArray) -> FloatArray:
        """|g| at all u for each z, refused where z is no clock."""
        g = self.velocity(u, z[:, None]) * self.sign
        if not (g > 0).all():
            row, column = np.unravel_index(np.argmin(g), g.shape)
            raise InputError(
                f"z = {z[row]:.6g} is no clock, its velocity changes sign by u = {u[column]:.3g}; "
                "take r eps smaller (below 1 for friction), or method='simulate'."
            )
        return g


def mesh(scene: Scene, way: float, coarse: float) -> FloatArray:
    """Breakpoints of the elements: fine where the answer bends, times `coarse`.

    Boundary layers at the ends have the width kappa^2/(2 |phi|), the transition over a barrier
    kappa/sqrt(2 |phi_u|), and outside the layer paths that z sends apart, d = eps t^2/2, are
    blurred by kappa sqrt(t), as are packets in flight to r.
    """
    r, across = scene.r, np.linspace(-1.0, 1.0, 201)
    # The least noise makes the finest layers, outside the layer and in it.
    kappa = float(scene.noise(across).min())
    z = np.linspace(scene.z, scene.z + scene.sign * way, 9)[:, None]
    ends = np.abs(scene.phi(np.array([-r, r]), z)).max()
    bend = np.abs(np.gradient(scene.phi(across, z), across, axis=1)).max()
    skin = kappa**2 / (2.0 * max(ends, 1e-300))
    width = 2.5 * kappa / np.sqrt(2.0 * max(bend, 1e-300))

    def size(u: FloatArray) -> FloatArray:
        away = np.maximum(np.abs(u) - 1.0, 0.0)
        blur = kappa * np.minimum(2.5 * (2.0 * away / scene.eps) ** 0.25, 4.0 * np.sqrt(1.0 + away))
        near = np.minimum(min(width, 0.5) + 0.5 * away, np.maximum(blur, width))
        return np.asarray(coarse * np.minimum(near, 3.0 * skin + 0.5 * (r - np.abs(u))))

    marks = sorted({-r, r, scene.u, *(x for x in (-1.0, 1.0) if abs(x) < r)})
    # Dense towards both ends, where the elements are smallest.
    shares = (t := np.linspace(0.0, 1.0, 4001) ** 4) / (t + t[::-1])
    points = [np.array([-r])]
    for low, high in pairwise(marks):
        x = low + (high - low) * shares
        with np.errstate(divide="ignore", over="ignore"):
            density = 1.0 / size(x)
        count = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(x)))
        if not count[-1] + len(points) <= _MOST_ELEMENTS:
            raise AccuracyError(
                f"the march would need {count[-1]:.4g} elements in u or more at kappa = "
                f"{kappa:g}, above {_MOST_ELEMENTS}; take kappa larger, or method='simulate'."
            )
        parts = np.linspace(0.0, count[-1], max(1, int(np.ceil(count[-1]))) + 1)
        points.append(np.append(np.interp(parts[1:-1], count, x), high))
    return np.concatenate(points)


class March:
    """The density on one mesh, marched slab by slab.

    After `finish`: at eight places of each slab the way s, the time `clock` C(s), the chance to
    have `left` by then, and in three columns the quadrature's `share` of what p, p1 and p2 lose;
    the mean and the standard deviation of the time; in p[0] the chances to have left.
    """

    def __init__(self, scene: Scene, elements: Elements, stages: int) -> None:
        self.scene, self.elements, self.rule = scene, elements, radau(stages)
        u = elements.u
        self.p = [np.where(u == scene.u, 1.0, 0.0), np.zeros_like(u), np.zeros_like(u)]
        self.gone, self.time, self.held = 0.0, 0.0, 1.0
        self.rows: list[tuple[FloatArray, ...]] = []
        self._diffusion = scene.noise(u) ** 2 / 2

    def advance(self, step: float, most: float = np.inf) -> float:
        """What a slab's highest degree adds to p; the slab is done unless that is over `most`."""
        scene, elements, p, rule = self.scene, self.elements, self.p, self.rule
        at = scene.z + scene.sign * (self.gone + step * rule.nodes)
        rates = 1.0 / (scene.eps * scene.speed(elements.u, at))
        clock = 1.0 / (scene.eps * scene.speed(np.zeros(1), at))
        generators = elements.generator(scene.phi(elements.u, at[:, None]), self._diffusion)
        solve = elements.slab(rule, step, rates, generators)
        new = [solve(p[0], 0.0)]
        error = float(np.abs(rule.top[0] * p[0] + rule.top[1:] @ new[0]).sum())
        if error > most:
            return error
        ahead = rates - clock
        ahead[:, [0, -1]] = 0.0
        for k in (1, 2):
            new.append(solve(p[k], k * ahead * new[-1]))
        ends = [np.vstack([old, one])[:, [0, -1]] for old, one in zip(p, new, strict=True)]
        lost, way = np.sum(ends, axis=2).T, self.gone + step * rule.places
        time = rule.filled @ np.append(self.time, self.time + step * rule.integral @ clock[:, 0])
        self.rows.append((way, time, rule.filled @ lost[:, 0], rule.change @ lost))
        self.p, self.gone, self.time = [one[-1] for one in new], self.gone + step, float(time[-1])
        # Absolute values: where a packet is not resolved, waves of both signs go before it.
        self.held = float(np.abs(self.p[0][1:-1]).sum())
        return error

    def finish(self) -> None:
        """Tables and moments of what left."""
        tables = (np.concatenate(row) for row in zip(*self.rows, strict=True))
        self.way, self.clock, self.left, self.share = tables
        lost, once, twice = self.share.T
        self.mean = float(self.clock @ lost + once.sum())
        off = self.clock - self.mean
        self.std = max(float(off**2 @ lost + 2.0 * off @ once + twice.sum()), 0.0) ** 0.5


def march(scene: Scene, rtol: float) -> tuple[March, March, float]:
    """Two marches and the error of the second one's mean, at most `rtol` times it."""
    stages, degree = (4, 6) if rtol > 1e-7 else (5, 8)
    coarse, tol, way, last = 1.5, min(1e-3, 30.0 * rtol**0.6), 0.0, np.nan
    for _ in range(_FINEST):
        ends = mesh(scene, way, coarse)
        rough, fine = (March(scene, Elements(ends, k), stages) for k in (degree, degree + 2))
        step = scene.eps * 1e-3
        while rough.held > 1e-3 * rtol:
            error = rough.advance(step, 2.0 * tol if step > 1e-12 * (1 + abs(scene.z)) else np.inf)
            if rough.gone > fine.gone:
                fine.advance(step / 2)
                fine.advance(step / 2)
            if len(rough.rows) > _MOST_SLABS:
                raise AccuracyError(
                    f"the block is still held with probability {rough.held:.2g} when z has gone "
                    f"{rough.gone:.6g}; start nearer to its release."
                )
            step *= min(3.0, max(0.1, 0.8 * (tol / max(error, 1e-300)) ** (1.0 / stages)))
        rough.finish()
        fine.finish()
        # The two may agree by chance; each round divides its errors by some 30.
        apart = np.fmax(abs(fine.mean - rough.mean), abs(fine.mean - last) / 30.0)
        # What is left to wait at the end is of the order of the time before.
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
