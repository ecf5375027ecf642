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

from typing import Any, NamedTuple

import numpy as np

from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray
from symasym.release.slabs import Elements, dense, radau
from symasym.release.system import System, values

_MOST_ELEMENTS = 1500
_MOST_SLABS = 3000
_FINEST = 6


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
                f"the slow variable's velocity has no one sign in |u| < {self.r:g} at z = "
                f"{z[row]:.6g} (see u = {u[column]:.3g}), so that it is no clock; take r eps "
                "smaller (below 1 for friction), or method='simulate'."
            )
        return g


class Marched(NamedTuple):
    """What left, at eight places of each slab in turn, and what it comes to."""

    way: FloatArray  # s, that z has gone
    clock: FloatArray  # C(s)
    left: FloatArray  # the chance to have left by then
    share: FloatArray  # quadrature's share of what p, p1 and p2 lose, in three columns
    steps: FloatArray  # the slabs' lengths
    mean: float
    std: float
    exit: float  # the chance to leave through -r
    missing: float  # what the mean misses by what is still held, at most


def mesh(scene: Scene, way: float, coarse: float) -> FloatArray:
    """Breakpoints of the elements: fine where the answer bends, times `coarse`.

    Boundary layers at the ends have the width kappa^2/(2 |phi|), the transition over a barrier
    kappa/sqrt(2 |phi_u|), and outside the layer paths that z sends apart, d = eps t^2/2, are
    blurred by kappa sqrt(t), as are packets in flight to r.
    """
    r, eps = scene.r, scene.eps
    across = np.linspace(-1.0, 1.0, 201)
    # The least noise makes the finest layers, outside the layer and in it.
    kappa = float(scene.noise(across).min())
    z = np.linspace(scene.z, scene.z + scene.sign * way, 9)[:, None]
    ends = np.abs(scene.phi(np.array([-r, r]), z)).max()
    bend = np.abs(np.gradient(scene.phi(across, z), across, axis=1)).max()
    skin = kappa**2 / (2.0 * max(ends, 1e-300))
    width = 2.5 * kappa / np.sqrt(2.0 * max(bend, 1e-300))

    def size(u: FloatArray) -> FloatArray:
        """Length of an element at u."""
        away = np.maximum(np.abs(u) - 1.0, 0.0)
        blur = kappa * np.minimum(2.5 * (2.0 * away / eps) ** 0.25, 4.0 * np.sqrt(1.0 + away))
        near = np.minimum(width, 0.5) + 0.5 * away
        result: FloatArray = coarse * np.minimum.reduce(
            [3.0 * skin + 0.5 * (r - np.abs(u)), near, np.maximum(blur, width)]
        )
        return result

    marks = sorted({-r, r, scene.u, *(x for x in (-1.0, 1.0) if abs(x) < r)})
    # Dense towards both ends, where the elements are smallest.
    half = np.concatenate([[0.0], np.geomspace(1e-9, 0.5, 400), np.linspace(0.0, 0.5, 2000)[1:-1]])
    shares = np.unique(np.concatenate([half, 1.0 - half]))
    points = [np.array([-r])]
    for low, high in zip(marks[:-1], marks[1:], strict=True):
        x = low + (high - low) * shares
        with np.errstate(divide="ignore", over="ignore"):
            density = 1.0 / size(x)
        count = np.append(0.0, np.cumsum((density[1:] + density[:-1]) / 2 * np.diff(x)))
        if not count[-1] + len(points) <= _MOST_ELEMENTS:
            raise AccuracyError(
                f"the march would need {count[-1]:.4g} elements in u or more at kappa = "
                f"{kappa:g}, r = {r:g}, and takes at most {_MOST_ELEMENTS}; take kappa larger or r "
                "smaller, or method='simulate'."
            )
        parts = np.linspace(0.0, count[-1], max(1, int(np.ceil(count[-1]))) + 1)
        points.append(np.append(np.interp(parts[1:-1], count, x), high))
    return np.concatenate(points)


def once(
    scene: Scene,
    elements: Elements,
    stages: int,
    tol: float,
    least: float,
    steps: FloatArray | None = None,
) -> Marched:
    """One march, until less than `least` is held or along given `steps`.

    Without `steps` what a slab's highest degree adds to p stays below `tol`.
    """
    rule, eps, u = radau(stages), scene.eps, elements.u
    filled, change = dense(stages)
    diffusion = scene.noise(u) ** 2 / 2
    p = [np.where(u == scene.u, 1.0, 0.0), np.zeros_like(u), np.zeros_like(u)]
    way, step, held, waited = 0.0, eps * 1e-3, 1.0, 0.0
    made: list[float] = []
    rows: list[tuple[FloatArray, ...]] = []
    while held > least if steps is None else len(made) < len(steps):
        if steps is not None:
            step = float(steps[len(made)])
        at = scene.z + scene.sign * (way + step * rule.nodes)
        rates = 1.0 / (eps * scene.speed(u, at))
        clock = 1.0 / (eps * scene.speed(np.zeros(1), at))
        generators = elements.generator(scene.phi(u, at[:, None]), diffusion)
        solve = elements.slab(rule, step, rates, generators)
        new = [solve(p[0], 0.0)]
        if steps is None:
            error = np.abs(rule.top[0] * p[0] + rule.top[1:] @ new[0]).sum()
            factor = float(min(3.0, 0.8 * (tol / max(error, 1e-300)) ** (1.0 / stages)))
            if error > 2.0 * tol and step > 1e-12 * (1.0 + abs(scene.z)):
                step *= max(factor, 0.1)
                continue
            if len(made) > _MOST_SLABS:
                raise AccuracyError(
                    f"the block is still held with probability {held:.2g} at z = {at[-1]:.6g}, "
                    f"after {_MOST_SLABS} slabs; start nearer to where it is released."
                )
        ahead = rates - clock
        ahead[:, [0, -1]] = 0.0
        for k in (1, 2):
            new.append(solve(p[k], k * ahead * new[-1]))
        ends = [np.vstack([old, one])[:, [0, -1]] for old, one in zip(p, new, strict=True)]
        gone = np.sum(ends, axis=2).T
        time = filled @ np.append(waited, waited + step * rule.integral @ clock[:, 0])
        rows.append((way + step * radau(8).nodes, time, filled @ gone[:, 0], change @ gone))
        made.append(step)
        # Absolute values: where a packet is not resolved, waves of both signs go before it.
        held = float(np.abs(new[0][-1, 1:-1]).sum())
        p, way, waited = [one[-1] for one in new], way + step, float(time[-1])
        if steps is None:
            step *= factor
    s, time, left, share = (np.concatenate(row) for row in zip(*rows, strict=True))
    mean = float(time @ share[:, 0] + share[:, 1].sum())
    off = time - mean
    variance = float(off**2 @ share[:, 0] + 2.0 * off @ share[:, 1] + share[:, 2].sum())
    std, missing = max(variance, 0.0) ** 0.5, 3.0 * held * (mean + waited)
    return Marched(s, time, left, share, np.array(made), mean, std, float(p[0][0]), missing)


def march(scene: Scene, rtol: float) -> tuple[Marched, Marched, float]:
    """Two marches and the error of the second one's mean, at most `rtol` times it."""
    stages, degree = (4, 6) if rtol > 1e-7 else (5, 8)
    coarse, tol, least = 1.5, min(1e-3, 30.0 * rtol**0.6), 1e-3 * rtol
    best, last, way = np.inf, np.nan, 0.0
    for _ in range(_FINEST):
        ends = mesh(scene, way, coarse)
        rough = once(scene, Elements(ends, degree), stages, tol, least)
        halves = np.repeat(rough.steps / 2, 2)
        fine = once(scene, Elements(ends, degree + 2), stages, tol, least, halves)
        # The two may agree by chance; each round divides its errors by some 30.
        apart = np.fmax(abs(fine.mean - rough.mean), abs(fine.mean - last) / 30.0)
        error = float(apart + fine.missing + 4e-14 * len(rough.steps) ** 0.5 * fine.mean)
        last, way = fine.mean, float(fine.way[-1])
        best = min(best, error / fine.mean) if fine.mean > 0 else best
        if fine.mean > 0 and error <= rtol * fine.mean:
            return rough, fine, error
        tol, coarse, degree = tol / 30.0, coarse * 0.8, degree + 1
    raise AccuracyError(
        f"the march reaches {best:.2g} relative error with {len(ends) - 1} elements and "
        f"{len(fine.steps)} slabs, and {rtol:.2g} is asked; ask for a larger rtol."
    )
