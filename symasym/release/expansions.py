"""T with z frozen, its first correction in eps, and the adiabatic law, by the exact engine.

With T = T0 + eps T1 + O(eps^2) the order eps of eps g T_z + phi T_u + (kappa^2/2) T_uu = -1 is
L0 T1 = -(g T0_z + u phi_y T0_u), where L0 is the scalar generator with z frozen and y = 0. -1/L0
is the Green's function G(x, v), the expected time that a path from x spends at v:

    T1(x) = integral of G(x, v) (g T0_z + u phi_y T0_u)(v) dv,
    G(x, v) = lam e^(-lam V(v)) S(min(x, v)) (S(r) - S(max(x, v)))/S(r),    S' = e^(lam V).

The adiabatic law takes escape at each z for a Poisson process of the rate 1/T0(z) (Kramers' theory
of a ramped barrier; Bullerjahn, Sturm and Kroy, Nat. Commun. 5 (2014) 4463): the chance to be held
is exp(-integral dt/T0(z(t))). It is right where T0 is long against the relaxation in the well and
short against the time in which T0 changes; it takes the flight past the fold for a waiting time, so
that it misses how late a block passes the fold, of order eps^(-1/3), and how regularly.
"""

from __future__ import annotations

import numpy as np

from symasym.base.errors import AccuracyError, RangeError
from symasym.base.inputs import FloatArray
from symasym.quantities import escape_time, exit_probability
from symasym.release.march import Forward, Scene, mesh
from symasym.release.slabs import Elements, radau

__all__ = ["adiabatic", "expanded"]

_DEGREE = 8
_STAGES = 8
_MOST = 4000
_LEAST = 1e-12  # of the mass held


def expanded(scene: Scene) -> tuple[float, float]:
    """T0, with z frozen, and eps T1, the first correction to it, at the start."""
    system = scene.system
    elements = Elements(mesh(scene, scene.z, 1.0), _DEGREE)
    u, weights, lam = elements.u, elements.weights, 2.0 / scene.kappa**2
    inner = np.abs(u) < scene.r
    place = tuple(p[0] for p in np.nonzero(u == scene.u))
    # log T0 bends on the scale 1/lam of z.
    delta = min(1e-3, 0.02 * scene.kappa**2)
    shifts = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * delta
    here = system.frozen((scene.z + shifts)[:, None])
    starts = u[inner]
    logs = np.broadcast_to(
        escape_time(here, scene.kappa, scene.r, start=starts[None, :], log=True),
        (shifts.size, starts.size),
    )
    time = np.zeros(u.shape)
    by_z = np.zeros(u.shape)
    # In units of the time at the start, which may be beyond float64 squared.
    at = np.flatnonzero(u[inner] == scene.u)[0]
    unit = float(logs[2, at])
    if unit > np.log(np.finfo(float).max):
        raise RangeError(
            f"T is e^{unit:.6g}, beyond float64; take escape_time with log=True, or method='march'."
        )
    time[inner] = np.exp(logs[2] - unit)
    slope = (logs[0] - 8.0 * logs[1] + 8.0 * logs[3] - logs[4]) / (12.0 * delta)
    by_z[inner] = time[inner] * slope
    by_u = np.einsum("mab,mb->ma", elements.slope, time)
    g = scene.system.velocity_at(u, scene.z, 0.0)
    by_y = scene.system.slope_in_y().phi_at(u, scene.z, 0.0)
    source = g * by_z + u * by_y * by_u
    frozen = system.frozen(scene.z)
    height = lam * frozen.potential_at(u)
    total = height.max() + np.log((weights * np.exp(height - height.max())).sum())
    before = np.zeros(u.shape)
    after = np.zeros(u.shape)
    before[inner], after[inner] = (
        exit_probability(
            frozen, scene.kappa, scene.r, start=u[inner], complement=complement, log=True
        )
        for complement in (True, False)
    )
    ways = np.minimum(before, before[place]) + np.minimum(after, after[place])
    green = np.where(inner, np.exp(np.minimum(np.log(lam) + total - height + ways, 700.0)), 0.0)
    frozen_time = float(np.exp(unit))
    return frozen_time, scene.eps * float((weights * green * source).sum()) * frozen_time


def adiabatic(scene: Scene) -> Forward:
    """The mass held at each z if escape at each is a Poisson process of the rate 1/T0."""
    rule = radau(_STAGES)
    integral = np.linalg.inv(rule.slopes[:, 1:])
    way, gone, clock, step = [0.0], 0.0, 0.0, scene.eps
    rows: list[list[FloatArray]] = [[], [], [], []]
    alone = np.array(scene.u if abs(scene.u) < 1 else 0.0)
    while gone < -np.log(_LEAST):
        if len(way) > _MOST:
            raise AccuracyError(
                f"after {_MOST} steps, at z = {scene.z + scene.sign * way[-1]:.6g}, escape is "
                "still not likely; start nearer to where the block is released."
            )
        nodes = np.concatenate([[0.0], rule.nodes]) * step
        z = scene.z + scene.sign * (way[-1] + nodes)
        here = scene.system.frozen(z)
        logs = escape_time(here, scene.kappa, scene.r, start=scene.u, log=True)
        logs = np.broadcast_to(logs, z.shape)
        if np.ptp(logs) > 1.5 and step > 1e-12:
            step *= max(0.1, 1.2 / float(np.ptp(logs)))
            continue
        speeds = np.array([float(scene.speed(alone, x)) for x in z[1:]])
        slowness = 1.0 / (scene.eps * np.abs(speeds))
        rate = np.exp(-logs[1:]) * slowness
        hazard = gone + step * integral @ rate
        clocks = clock + step * integral @ slowness
        held = np.exp(-np.concatenate([[gone], hazard]))
        flux = np.zeros((_STAGES, 3))
        flux[:, 0] = held[1:] * rate
        rows[0].append(held)
        rows[1].append(0.0 * held)
        rows[2].append(flux)
        rows[3].append(np.concatenate([[clock], clocks]))
        gone, clock = float(hazard[-1]), float(clocks[-1])
        way.append(way[-1] + step)
        step *= 2.0 if hazard[-1] - hazard[0] < 0.7 else 0.8
    return Forward.of(way, rows, [])
