"""Orbits of the friction oscillator: of Filippov's system in closed form, of the smoothed one.

The block's extension is z and its velocity relative to the belt y, with z' = y - 1 and
y' = 1 - z - y - F(y) (eq:osc2); F is alpha sgn(y) (eq:forcePWC) or smoothed over |y| <= eps
(eq:forcePerturbed). Everything is in float64 and physical units.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.drift.drift import Drift

_OMEGA = np.sqrt(0.75)
# Between two samples the velocity turns by less than a percent of a period.
_SAMPLE = 0.01


@dataclass(frozen=True)
class Piece:
    """A stretch of an orbit of Filippov's system.

    Attributes
    ----------
    kind : str
        ``"slip"`` off the surface y = 0, ``"stick"`` (sliding) on it.
    path : ndarray, shape (n, 2)
        Points (z, y).
    """

    kind: str
    path: FloatArray


def slip(side: int, z: float, y: float, alpha: float, time: FloatArray) -> FloatArray:
    """Points (z, y) after each of these times where F stays alpha (side 1) or -alpha (-1).

    The damped oscillation about the rest point (-side alpha, 1), in closed form.
    """
    x, v = z + side * alpha, y - 1.0
    decay = np.exp(-time / 2)
    cosine, sine = np.cos(_OMEGA * time), np.sin(_OMEGA * time)
    position = decay * (x * cosine + (v + x / 2) / _OMEGA * sine)
    speed = decay * (v * cosine - (x + v / 2) / _OMEGA * sine)
    return np.column_stack([position - side * alpha, speed + 1.0])


def filippov(z: float, y: float, alpha: float, duration: float) -> list[Piece]:
    """The orbit of (z, y) under Coulomb friction by Filippov's convention.

    It crosses the surface y = 0 where both fields point the same way, and
    slides along it at z' = -1 where they oppose each other, up to 1 - alpha.
    """
    pieces: list[Piece] = []
    left = duration
    while left > 1e-9:
        below, above = 1 - z + alpha, 1 - z - alpha
        # At the end of sliding the upper field is tangent, and turns upwards beyond it.
        if y == 0 and below > 0 > above and z > 1 - alpha + 1e-9:
            spent = min(left, z - (1 - alpha))
            pieces.append(Piece("stick", np.array([[z, 0.0], [z - spent, 0.0]])))
            z -= spent
        else:
            side = int(np.sign(y)) or (1 if below > 0 else -1)
            path, spent, landed = _until_surface(side, z, y, alpha, left)
            pieces.append(Piece("slip", path))
            z, y = float(path[-1, 0]), 0.0 if landed else float(path[-1, 1])
        left -= spent
    return pieces


def _until_surface(
    side: int, z: float, y: float, alpha: float, left: float
) -> tuple[FloatArray, float, bool]:
    """The path on one side, the time it took, and whether it came to the surface."""
    time = np.linspace(0.0, left, max(2, int(left / _SAMPLE) + 1))
    path = slip(side, z, y, alpha, time)
    over = np.flatnonzero(side * path[1:, 1] < 0) + 1
    # An orbit that leaves the surface starts on it.
    over = over[over > 1] if y == 0 else over
    if not over.size:
        return path, left, False
    low, high = float(time[over[0] - 1]), float(time[over[0]])
    for _ in range(60):
        middle = (low + high) / 2
        inside = side * slip(side, z, y, alpha, np.array([middle]))[0, 1] > 0
        low, high = (middle, high) if inside else (low, middle)
    end = slip(side, z, y, alpha, np.array([high]))
    end[0, 1] = 0.0
    return np.concatenate([path[: over[0]], end]), high, True


def steps_of(eps: float, stiffness: float, duration: float) -> int:
    """The number of steps of `smoothed`: stable on the slow curve, and smooth to the eye off it."""
    return int(np.ceil(duration / eps * max(6 * stiffness, 40)))


def smoothed(drift: Drift, starts: FloatArray, eps: float, steps: int, h: float) -> FloatArray:
    """Orbits of the smoothed oscillator by Runge and Kutta's method of order 4.

    Parameters
    ----------
    drift : Drift
        The friction drift at z0 = 0; at another extension z it is less by z.
    starts : ndarray, shape (m, 2)
        Points (z, u), u = y/eps.
    eps : float
    steps : int
    h : float
        Time of a step, see `steps_of`.

    Returns
    -------
    ndarray, shape (n, m, 2)
        Points (z, u).
    """
    values = drift.float_values()

    def field(points: FloatArray) -> FloatArray:
        """The velocity (z', u') of the smoothed oscillator in scaled variables."""
        z, u = points[:, 0], points[:, 1]
        across = drift.evaluate_float(np.minimum(np.maximum(u, -1.0), 1.0), values) - z
        return np.column_stack([eps * u - 1.0, across / eps - u])

    points = np.empty((steps + 1, *starts.shape))
    points[0] = now = starts
    for k in range(steps):
        first = field(now)
        second = field(now + h / 2 * first)
        third = field(now + h / 2 * second)
        fourth = field(now + h * third)
        points[k + 1] = now = now + h / 6 * (first + 2 * (second + third) + fourth)
    return points
