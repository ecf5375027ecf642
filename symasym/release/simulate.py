"""Monte Carlo of the whole system: Euler and Maruyama's method, its boundary moved inwards.

What paths miss between two looks, every h, is undone to first order in sqrt(h) by a boundary nearer
by -zeta(1/2)/sqrt(2 pi) kappa sqrt(h) (Broadie, Glasserman and Kou, Math. Finance 7 (1997) 325;
Gobet, Stochastic Process. Appl. 87 (2000) 167). What is left is of order h, seen at twice the step.
"""

from __future__ import annotations

import numpy as np

from symasym.base.errors import AccuracyError
from symasym.base.inputs import FloatArray
from symasym.release.march import Scene

_SHIFT = 0.5825971579390106  # -zeta(1/2)/sqrt(2 pi)
_MOST_STEPS, _MOST_DRAWN = 20_000_000, 2 * 10**9


def simulate(scene: Scene, paths: int, h: float, seed: int, tau: float) -> tuple[FloatArray, ...]:
    """Times, z and sides (-1 or 1) at release of independent paths by steps of h.

    With `tau` > 0 the noise is Ornstein and Uhlenbeck's of that correlation time, which tends to
    the white one: kappa x dt in place of kappa dW, dx = (-x dt + dW)/tau; h must be far below it.
    """
    normal = np.random.default_rng(seed).standard_normal
    # Paths in coloured noise are smooth, and are not missed between two looks.
    shift = 0.0 if tau else _SHIFT * np.sqrt(h) * float(scene.noise(np.array(scene.r)))
    fresh = np.sqrt(-np.expm1(-2.0 * h / tau) / (2.0 * tau)) if tau else 1.0
    colour = normal(paths) / np.sqrt(2.0 * tau) if tau else np.zeros(paths)
    u, z, index = np.full(paths, scene.u), np.full(paths, scene.z), np.arange(paths)
    times, ends, sides = (np.empty(paths) for _ in range(3))
    drawn = 0
    for step in range(1, _MOST_STEPS):
        if (drawn := drawn + u.size) > _MOST_DRAWN:
            break
        push = (h * colour if tau else np.sqrt(h) * normal(u.size)) * scene.noise(u)
        if tau:
            colour = np.exp(-h / tau) * colour + fresh * normal(u.size)
        u, z = u + h * scene.phi(u, z) + push, z + h * scene.eps * scene.velocity(u, z)
        gone = np.abs(u) >= scene.r - shift
        if gone.any():
            times[index[gone]], ends[index[gone]] = step * h, z[gone]
            sides[index[gone]] = np.sign(u[gone])
            u, z, colour, index = u[~gone], z[~gone], colour[~gone], index[~gone]
            if not u.size:
                return times, ends, sides
    raise AccuracyError(
        f"{u.size} paths are held after {step} steps of {h:.3g}; "
        "give a longer step or fewer paths, or take method='march'."
    )


def step_of(scene: Scene, tau: float) -> float:
    """A step that follows phi, the noise and its correlation."""
    across = np.linspace(-1.0, 1.0, 201)
    bend = np.abs(np.gradient(scene.phi(across, scene.z), across)).max()
    flight = 0.002 * (scene.r / scene.kappa) ** 2
    return float(min(0.05 / max(bend, 1.0), flight, tau / 8 or 0.05))
