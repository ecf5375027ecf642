"""The release of a system whose slow variable is a clock, marched in it.

Where g keeps its sign, z is a clock and the state (u, z) a diffusion in one dimension (see
`symasym.release.slabs`). The density of u is marched away from the start, which gives the laws of
time and z at release; the mean and the variance of the time solve the backward equation

    eps g T_z + phi T_u + (kappa^2/2) T_uu = -1,    eps g v_z + phi v_u + (kappa^2/2) v_uu
        = -kappa^2 T_u^2,    0 at u = -r and r,

marched to the start from a z that the block all but never reaches. What is dropped there is the
chance to reach it times the time left. `backward` and `forward` choose their steps in z (a slab
each) by a slab's share of the answer; `march` asks them twice. The second run has every slab
halved and two degrees more; its difference from the first is the error that is stated.

Laws of the time and of z at release come from densities marched in z. At the end of each stretch of
way z is known, so that the law of z is what is no longer held. The
time at which z comes there depends on the path by the little that u adds to g; of it the mean m and
the variance v are marched with the density, conditional on leaving there, and taken as normal:
t = m(way) + sqrt(v(way)) N. Where g does not depend on u, v is 0 and the law exact.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import hermite_e, legendre

from symasym.base.errors import AccuracyError, InputError
from symasym.base.inputs import FloatArray, IntArray, Numbers, floats
from symasym.release.slabs import Elements, Slab, radau
from symasym.release.system import System

__all__ = [
    "Backward",
    "Forward",
    "Law",
    "Marched",
    "Piecewise",
    "Scene",
    "backward",
    "forward",
    "laws",
    "march",
]


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

    @property
    def sign(self) -> float:
        """The direction in which z goes."""
        return float(np.sign(self.speed(np.array(self.u), self.z, checked=False)))

    def speed(self, u: FloatArray, z: float, checked: bool = True) -> FloatArray:
        """g at z, refused where z is no clock."""
        g = self.system.velocity_at(u, z, self.eps)
        if checked and not (g * self.sign > 0).all():
            away = float(np.ravel(u)[np.argmin(np.abs(g))])
            raise InputError(
                f"the slow variable's velocity has no one sign in |u| < {self.r:g} at z = {z:.6g} "
                f"(its least size is about u = {away:.3g}), so that it is no clock; take r eps "
                "smaller (below 1 for friction), or method='simulate'."
            )
        return g


class Forward(NamedTuple):
    """Densities marched from the start.

    Attributes
    ----------
    way : ndarray, shape (m + 1,)
        The way that z has gone at the slabs' ends.
    held : ndarray, shape (m, n + 1)
        The chance to be held at each slab's beginning and stages.
    left : ndarray, shape (m, n + 1)
        The chance to have left through -r by then.
    flux : ndarray, shape (m, n, 3)
        What leaves at the stages, for each unit of way: probability, and that times the first and
        the second power of the time beyond `clock`.
    clock : ndarray, shape (m, n + 1)
        The time that z takes if u = 0.
    weight : list of ndarray
        At the slabs' ends, the probability at each node.
    """

    way: FloatArray
    held: FloatArray
    left: FloatArray
    flux: FloatArray
    clock: FloatArray
    weight: list[FloatArray]

    @classmethod
    def of(
        cls, way: list[float], rows: list[list[FloatArray]], weight: list[FloatArray]
    ) -> Forward:
        """The forward march from the slabs' `held`, `left`, `flux` and `clock` in turn."""
        held, left, flux, clock = (np.array(row) for row in rows)
        return cls(np.array(way), held, left, flux, clock, weight)


class Backward(NamedTuple):
    """Mean, variance, chance to leave through -r, all from the start; the slabs' lengths."""

    mean: float
    variance: float
    left: float
    reach: float
    steps: FloatArray


@dataclass(frozen=True)
class Marched:
    """A mean with its error, and what came with it."""

    mean: float
    error: float
    variance: float
    left: float
    way: float
    density: Forward


def mesh(scene: Scene, z_end: float, coarse: float, flight: bool = False) -> FloatArray:
    """Breakpoints of the elements: fine where T bends, times `coarse`.

    Boundary layers at the ends have the width kappa^2/(2 |phi|), the transition over a barrier
    kappa/sqrt(2 |phi_u|), and outside the layer paths that z sends apart, d = eps t^2/2, are
    blurred by kappa sqrt(t). Of the density also packets in `flight` to r are resolved.
    """
    system, r, eps = scene.system, scene.r, scene.eps
    factor = system.noise_at(np.linspace(-1.0, 1.0, 201))
    # The least noise makes the finest layers, outside the layer and in it.
    kappa = scene.kappa * float(factor.min())
    z = np.linspace(scene.z, z_end, 9)[:, None]
    ends = np.abs(system.phi_at(np.array([-r, r]), z, eps)).max()
    across = np.linspace(-1.0, 1.0, 201)
    values = system.phi_at(across, z, eps)
    bend = np.abs(np.gradient(values, across, axis=1)).max()
    skin = kappa**2 / (2.0 * max(ends, 1e-300))
    width = 2.5 * kappa / np.sqrt(2.0 * max(bend, 1e-300))

    def size(u: FloatArray) -> FloatArray:
        """Length of an element at u."""
        away = np.maximum(np.abs(u) - 1.0, 0.0)
        blur = 2.5 * kappa * (2.0 * away / eps) ** 0.25
        if flight:
            blur = np.minimum(blur, 4.0 * kappa * np.sqrt(1.0 + away))
        result: FloatArray = coarse * np.minimum.reduce(
            [
                3.0 * skin + 0.5 * (r - np.abs(u)),
                width + 0.5 * away,
                np.maximum(blur, width),
                np.full_like(u, 0.5) + 0.5 * away,
            ]
        )
        return result

    marks = sorted({-r, r, scene.u, *(x for x in (-1.0, 1.0) if abs(x) < r)})
    points = [np.array([-r])]
    for low, high in zip(marks[:-1], marks[1:], strict=True):
        # Dense towards both ends, where the elements are smallest.
        near = np.concatenate([np.geomspace(1e-9, 0.5, 400), np.linspace(0.0, 0.5, 2000)])
        x = low + (high - low) * np.unique(np.concatenate([near, 1.0 - near]))
        with np.errstate(divide="ignore", over="ignore"):
            density = 1.0 / size(x)
            steps = (density[1:] + density[:-1]) / 2 * np.diff(x)
        count = np.concatenate([[0.0], np.cumsum(steps)])
        if not count[-1] <= _MOST_ELEMENTS:
            raise _too_many(float(count[-1]), kappa, r)
        number = max(1, int(np.ceil(count[-1])))
        inner = np.interp(np.linspace(0.0, count[-1], number + 1)[1:-1], count, x)
        points.append(np.append(inner, high))
    result = np.concatenate(points)
    if result.size > _MOST_ELEMENTS:
        raise _too_many(result.size, kappa, r)
    return result


def _too_many(count: float, kappa: float, r: float) -> AccuracyError:
    return AccuracyError(
        f"the march would need {count:.4g} elements in u or more at kappa = {kappa:g}, r = {r:g}, "
        f"and takes at most {_MOST_ELEMENTS}; take kappa larger or r smaller, or method='simulate'."
    )


class _Path:
    """Matrices of one scene on one mesh, slab by slab."""

    def __init__(self, scene: Scene, elements: Elements, stages: int) -> None:
        self.scene, self.elements, self.rule = scene, elements, radau(stages)
        self.diffusion = scene.kappa**2 / 2 * scene.system.noise_at(elements.u) ** 2

    def capacity(self, z: float) -> FloatArray:
        """eps |g| on the nodes."""
        scene = self.scene
        result: FloatArray = scene.eps * np.abs(scene.speed(self.elements.u, z))
        return result

    def slab(self, z: float, step: float, forward: bool) -> tuple[Slab, FloatArray, FloatArray]:
        """The slab from z on, its G and its K at the stages."""
        scene, elements = self.scene, self.elements
        sign = scene.sign if forward else -scene.sign
        at = z + sign * step * self.rule.nodes
        capacity = np.stack([self.capacity(x) for x in at])
        phi = np.stack([scene.system.phi_at(elements.u, x, scene.eps) for x in at])
        generator = elements.generator(phi, self.diffusion)
        slab = Slab(elements, self.rule, step, self.capacity(z), capacity, generator, forward)
        return slab, capacity, generator

    def start(self) -> tuple[IntArray, ...]:
        """The places (element, node) of the start."""
        return np.nonzero(self.elements.u == self.scene.u)

    def top(self, first: FloatArray, stages: FloatArray) -> FloatArray:
        """Size of what the slab's highest degree adds."""
        result: FloatArray = np.abs(
            self.rule.top[0] * first + np.tensordot(self.rule.top[1:], stages, 1)
        )
        return result


def forward(scene: Scene, elements: Elements, stages: int, tol: float, least: float) -> Forward:
    """The density from the start until less than `least` of it is held."""
    path = _Path(scene, elements, stages)
    rule, weights = path.rule, elements.weights
    place = path.start()
    y = [np.zeros_like(elements.u) for _ in range(3)]
    y[0][place] = 1.0 / (weights * path.capacity(scene.z))[place].sum()
    way, step, held, left, time = [0.0], scene.eps * 1e-3, 1.0, 0.0, 0.0
    rows: list[list[FloatArray]] = [[], [], [], []]
    weight = [weights * path.capacity(scene.z) * y[0]]
    inner = np.ones_like(elements.u)
    inner[0, 0] = inner[-1, -1] = 0.0
    present = 1.0
    while present > least:
        z = scene.z + scene.sign * way[-1]
        slab, capacity, generator = path.slab(z, step, True)
        new = [slab.solve(y[0], np.zeros_like(capacity))]
        mass = weights * capacity * new[0]
        error = float(path.top(weight[-1], mass).sum())
        factor = min(3.0, 0.8 * (tol / max(error, 1e-300)) ** (1.0 / stages))
        if error > 2.0 * tol and step > 1e-12 * (1.0 + abs(z)):
            step *= max(factor, 0.1)
            continue
        if len(way) > _MOST_SLABS:
            raise AccuracyError(
                f"the block is still held with probability {held:.2g} at z = {z:.6g}, after "
                f"{_MOST_SLABS} slabs; start nearer to where it is released."
            )
        alone = np.zeros(1)
        reference = scene.eps * np.abs(
            [scene.speed(alone, z + scene.sign * step * c)[0] for c in rule.nodes]
        )
        ahead = weights * (1.0 - capacity / reference[:, None, None])
        for k in (1, 2):
            new.append(slab.solve(y[k], k * ahead * new[k - 1]))
        ends = np.stack(
            [np.einsum("ka,ka->k", generator[:, 0, :, 0], part[:, 0]) for part in new], axis=-1
        )
        others = np.stack(
            [np.einsum("ka,ka->k", generator[:, -1, :, -1], part[:, -1]) for part in new], axis=-1
        )
        integral = np.linalg.inv(rule.slopes[:, 1:]) * step
        rows[0].append(np.concatenate([[held], mass.sum((1, 2))]))
        rows[1].append(np.concatenate([[left], left + integral @ ends[:, 0]]))
        rows[2].append(ends + others)
        rows[3].append(np.concatenate([[time], time + integral @ (1.0 / reference)]))
        # Absolute values: where a narrow packet is not resolved, waves of both signs go before it.
        present = float(np.abs(mass[-1]).sum())
        held, left, time = rows[0][-1][-1], rows[1][-1][-1], rows[3][-1][-1]
        y = [part[-1] for part in new]
        weight.append(mass[-1])
        way.append(way[-1] + step)
        step *= factor
    return Forward.of(way, rows, weight)


def backward(
    scene: Scene,
    elements: Elements,
    stages: int,
    far: float,
    steps: FloatArray | None = None,
    weight: tuple[FloatArray, list[FloatArray]] | None = None,
    about: float = np.inf,
    tol: float = 0.0,
) -> Backward:
    """Mean and variance of the time, marched to the start from where z has gone `far`.

    The slabs are `steps`; without them they are chosen such that what their highest degree adds,
    weighed with the chance `weight` to be there, stays below `tol`, relative to what is left to
    wait there, or to `about` where that is less.
    """
    path = _Path(scene, elements, stages)
    weights, place = elements.weights, tuple(p[0] for p in path.start())
    mean, variance = np.zeros_like(elements.u), np.zeros_like(elements.u)
    reach, exits = np.ones_like(elements.u), np.zeros_like(elements.u)
    reach[0, 0] = reach[-1, -1] = 0.0
    exits[0, 0] = 1.0
    made: list[float] = []
    gone, step = far, scene.eps * 0.3
    while gone > 0.0 if steps is None else len(made) < len(steps):
        if steps is not None:
            step = float(steps[len(made)])
        elif step > 0.7 * gone:
            step = gone if step >= gone else gone / 2
        slab, capacity, generator = path.slab(scene.z + scene.sign * gone, step, False)
        new = slab.solve(mean, np.broadcast_to(weights, capacity.shape))
        factor = 1.0
        if steps is None:
            assert weight is not None
            k = np.searchsorted(weight[0], [gone - step, gone])
            share = np.max(weight[1][max(int(k[0]) - 1, 0) : int(k[1]) + 1], axis=0)
            size = max(min(float(new[-1].max()), about), 1e-300)
            error = float((share * path.top(mean, new)).sum()) / size
            factor = min(3.0, 0.8 * (tol / max(error, 1e-300)) ** (1.0 / stages))
            if len(made) >= _MOST_SLABS or step < 1e-7 * scene.eps:
                raise AccuracyError(
                    f"the march to tolerance {tol:.2g} needs more than {_MOST_SLABS} slabs in z, "
                    f"or steps below the rounding of T = {new[-1].max():.3g}; ask for a larger "
                    "rtol."
                )
            if error > 2.0 * tol:
                step *= max(factor, 0.1)
                continue
        slope = np.einsum("mab,kmb->kma", elements.slope, new)
        none = np.zeros_like(capacity)
        variance = slab.solve(variance, weights * 2.0 * path.diffusion * slope**2)[-1]
        reach = slab.solve(reach, none)[-1]
        exits = slab.solve(exits, none, (1.0, 0.0))[-1]
        mean = new[-1]
        made.append(step)
        gone = gone - step if gone - step > 1e-13 * far else 0.0
        step *= factor
    at = [float(f[place]) for f in (mean, variance, exits, reach)]
    return Backward(at[0], at[1], at[2], at[3], np.array(made))


def march(scene: Scene, rtol: float) -> Marched:
    """The mean time of release to `rtol`, by two resolutions.

    Raises
    ------
    AccuracyError
        If the finest resolution that is tried does not reach `rtol`.
    """
    stages, degree = (4, 6) if rtol > 1e-7 else (5, 8)
    coarse = 1.5
    tol = min(1e-3, 30.0 * rtol**0.6)
    first = Elements(mesh(scene, scene.z, coarse), degree)
    density = forward(scene, first, stages, max(tol, 1e-4), 1e-3 * rtol)
    far = float(density.way[-1])
    # About the mean, which is small beside T elsewhere where the start is next to a way out.
    about = float(np.trapezoid(density.held.ravel(), density.clock.ravel()))
    best, last = np.inf, np.nan
    for _ in range(_FINEST):
        low = Elements(mesh(scene, scene.z + scene.sign * far, coarse), degree)
        high = Elements(low.ends, degree + 2)
        weighed = density.way, [_onto(first, low, w) for w in density.weight]
        rough = backward(scene, low, stages, far, weight=weighed, about=about, tol=tol)
        fine = backward(scene, high, stages, far, np.repeat(rough.steps / 2, 2))
        # What is left to wait for where the march begins is of the order of the time before.
        dropped = abs(fine.reach) * 3.0 * (fine.mean + density.clock[-1, -1])
        # The two may agree by chance; each round divides its errors by some 30.
        apart = np.fmax(abs(fine.mean - rough.mean), abs(fine.mean - last) / 30.0)
        error = apart + dropped + 4e-14 * len(rough.steps) ** 0.5 * fine.mean
        last = fine.mean
        best = min(best, error / fine.mean) if fine.mean > 0 else best
        if fine.mean > 0 and error <= rtol * fine.mean:
            variance = max(fine.variance, 0.0)
            return Marched(fine.mean, float(error), variance, fine.left, far, density)
        tol, coarse, degree = tol / 30.0, coarse * 0.8, degree + 1
    raise AccuracyError(
        f"the march reaches {best:.2g} relative error with {len(low.ends) - 1} elements and "
        f"{len(fine.steps)} slabs, and {rtol:.2g} is asked; ask for a larger rtol."
    )


def _onto(given: Elements, wanted: Elements, weight: FloatArray) -> FloatArray:
    """Probabilities at nodes moved onto those of another mesh, as a weight for errors."""
    if np.array_equal(given.u, wanted.u):
        return np.abs(weight)
    density = np.abs(weight) / given.weights
    order = np.argsort(given.u.ravel(), kind="stable")
    moved = np.interp(wanted.u.ravel(), given.u.ravel()[order], density.ravel()[order])
    result: FloatArray = moved.reshape(wanted.u.shape) * wanted.weights
    return result


# -- laws of the time and of z ---------------------------------------------------------------------


# An interval is cut into so many parts, so often.
_PARTS, _CUTS = 32, 11


class Piecewise:
    """A function that is a polynomial on each slab.

    Parameters
    ----------
    ends : ndarray, shape (m + 1,)
        Of the slabs, increasing.
    values : ndarray, shape (m, n + 1)
        At each slab's beginning and at its n stages.
    """

    def __init__(self, ends: FloatArray, values: FloatArray) -> None:
        n = values.shape[1] - 1
        nodes = np.concatenate([[-1.0], 2.0 * radau(n).nodes - 1.0])
        self._ends = ends
        self._series = np.linalg.inv(legendre.legvander(nodes, n)) @ values.T

    def __call__(self, x: FloatArray) -> FloatArray:
        """Values at x, those at the ends beyond them."""
        ends = self._ends
        x = np.clip(x, ends[0], ends[-1])
        k = np.clip(np.searchsorted(ends, x, side="right") - 1, 0, len(ends) - 2)
        local = 2.0 * (x - ends[k]) / (ends[k + 1] - ends[k]) - 1.0
        result: FloatArray = np.asarray(
            legendre.legval(local, self._series[:, k], tensor=False), dtype=np.float64
        )
        return result


class Law:
    """A law on a line: mean, standard deviation, distribution function and quantiles.

    Attributes
    ----------
    mean, std : float
    error : float
        Of `cdf`, an estimate.
    """

    def __init__(
        self,
        cdf: Callable[[FloatArray], FloatArray],
        low: float,
        high: float,
        mean: float,
        std: float,
        error: float,
    ) -> None:
        self.mean, self.std, self.error = mean, std, error
        self._cdf, self._low, self._high = cdf, low, high

    def cdf(self, x: Numbers) -> Any:
        """The chance to be at most x."""
        at = floats("x", x)
        result = np.clip(self._cdf(at), 0.0, 1.0)
        return float(result) if result.ndim == 0 else result

    def quantile(self, p: Numbers) -> Any:
        """The x at which `cdf` is p, which must lie in (0, 1)."""
        level = floats("p", p)
        if not ((level > 0.0) & (level < 1.0)).all():
            raise InputError(f"p is {level[()]}; give a probability between 0 and 1.")
        crossing = _crossing(
            lambda x: self._cdf(x) >= level[..., None],
            np.full(level.shape, self._low),
            np.full(level.shape, self._high),
        )
        return float(crossing) if crossing.ndim == 0 else crossing

    def __repr__(self) -> str:
        return f"Law(mean={self.mean:.6g}, std={self.std:.3g})"


def _crossing(above: Callable[[FloatArray], Any], low: FloatArray, high: FloatArray) -> FloatArray:
    """The place where `above`, of points on a last axis, becomes true between `low` and `high`."""
    shares = np.linspace(0.0, 1.0, _PARTS + 1)
    for _ in range(_CUTS):
        points = low[..., None] + (high - low)[..., None] * shares
        past = np.asarray(above(points[..., 1:-1]))
        first = np.where(past.any(-1), np.argmax(past, axis=-1), _PARTS - 1)[..., None]
        low = np.take_along_axis(points, first, -1)[..., 0]
        high = np.take_along_axis(points, first + 1, -1)[..., 0]
    return high


def laws(density: Forward, z: float, sign: float) -> tuple[Law, Law]:
    """The laws of the time and of z at release, from a start at z that moves to `sign`."""
    ends = density.way
    held = Piecewise(ends, density.held)
    clock = Piecewise(ends, density.clock)
    n = density.held.shape[1] - 1
    rule, lengths = radau(n), np.diff(ends)
    stages = ends[:-1, None] + lengths[:, None] * rule.nodes
    share = lengths[:, None] * rule.weights * density.flux[..., 0]
    flux = density.flux
    sure = flux[..., 0] > 1e-9 * flux[..., 0].max()
    safe = np.where(sure, flux[..., 0], 1.0)
    late = np.where(sure, flux[..., 1] / safe, np.nan)
    spread = np.where(sure, np.maximum(flux[..., 2] / safe - late**2, 0.0), np.nan)
    known = stages[sure], late[sure], np.sqrt(spread[sure])

    def arrival(way: FloatArray, normal: float) -> FloatArray:
        """The time at which z has gone this way, `normal` standard deviations late."""
        beyond = np.interp(way, known[0], known[1]) + normal * np.interp(way, known[0], known[2])
        result: FloatArray = clock(way) + beyond
        return result

    normals, weights = hermite_e.hermegauss(9)
    weights = weights / weights.sum()

    def time_cdf(x: FloatArray) -> FloatArray:
        """The chance to have left by the time x."""
        total = np.zeros(x.shape)
        for normal, weight in zip(normals, weights, strict=True):
            way = _crossing(
                lambda way, normal=normal: arrival(way, normal) >= x[..., None],  # type: ignore[misc]
                np.zeros(x.shape),
                np.full(x.shape, ends[-1]),
            )
            total += weight * (1.0 - held(way))
        return total

    def z_cdf(x: FloatArray) -> FloatArray:
        """The chance that z is at most x at release."""
        way = (x - z) * sign
        gone = np.where(way <= 0.0, 0.0, 1.0 - held(way))
        return gone if sign > 0 else 1.0 - gone

    far_time = float(density.clock[-1, -1])
    at_stages = density.clock[:, 1:]
    mean = float((share * at_stages).sum() + (lengths[:, None] * rule.weights * flux[..., 1]).sum())
    beyond = flux[..., 2] + 2.0 * (at_stages - mean) * flux[..., 1]
    square = share * (at_stages - mean) ** 2 + lengths[:, None] * rule.weights * beyond
    gone = float((share * stages).sum())
    deviation = float(np.sqrt(max((share * (stages - gone) ** 2).sum(), 0.0)))
    time = Law(time_cdf, 0.0, 2.0 * far_time, mean, float(np.sqrt(max(square.sum(), 0.0))), 0.0)
    edges = sorted((z, z + sign * float(ends[-1])))
    return time, Law(z_cdf, edges[0], edges[1], z + sign * gone, deviation, 0.0)
