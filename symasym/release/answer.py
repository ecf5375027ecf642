"""`release`: when and where a block that sticks comes free while its slow variable moves."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from symasym.base.errors import InputError
from symasym.base.estimate import with_error
from symasym.base.inputs import (
    FloatArray,
    Number,
    Numbers,
    choice,
    count,
    exact,
    floats,
    positive,
    shown,
)
from symasym.release.march import Marched, Scene, march
from symasym.release.simulate import simulate, step_of
from symasym.release.system import System

__all__ = ["METHODS", "Law", "Release", "release"]

#: The methods, and what each computes.
METHODS = {
    "march": "the parabolic equation of (u, z), to rtol",
    "simulate": "Monte Carlo",
}
_MOST_PATHS = 10_000_000


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
        of: Callable[[FloatArray], FloatArray],
        ends: tuple[float, float],
        mean: float,
        std: float,
        error: float,
    ) -> None:
        self._of, self._ends, self.mean, self.std, self.error = of, ends, mean, std, error

    def cdf(self, x: Numbers) -> Any:
        """The chance to be at most x."""
        return np.clip(self._of(floats("x", x)), 0.0, 1.0)[()]

    def quantile(self, p: Numbers) -> Any:
        """The x at which `cdf` is p, which must lie in (0, 1)."""
        level = floats("p", p)
        if not ((level > 0.0) & (level < 1.0)).all():
            raise InputError(f"p is {level[()]}; give a probability between 0 and 1.")
        low, high = (np.full(level.shape, end) for end in self._ends)
        for _ in range(60):
            middle = (low + high) / 2
            past = self._of(middle) >= level
            low, high = np.where(past, low, middle), np.where(past, middle, high)
        return high[()]

    def __repr__(self) -> str:
        return f"Law(mean={self.mean:.6g}, std={self.std:.3g})"


def _marched(scene: Scene, found: Marched) -> tuple[Law, Law]:
    """The laws of the time and of z: of normal times given z, by Gauss and Hermite's rule."""
    from scipy.interpolate import PchipInterpolator

    share = found.share[:, 0]
    sure = share > 1e-9 * share.max()
    late, square = (found.share[sure, 1:] / share[sure, None]).T
    way, left, clock = (np.append(0.0, x[sure]) for x in (found.way, found.left, found.clock))
    time = clock + np.append(0.0, late)
    spread = np.append(0.0, np.sqrt(np.maximum(square - late**2, 0.0)))

    def table(x: FloatArray, y: FloatArray) -> Callable[[FloatArray], FloatArray]:
        grows = np.append(True, np.diff(np.maximum.accumulate(x)) > 0.0)
        inner = PchipInterpolator(x[grows], y[grows])
        return lambda at: np.asarray(inner(np.clip(at, x[grows][0], x[grows][-1])))

    normals, weights = np.polynomial.hermite_e.hermegauss(9)
    tables = [table(time + k * spread, left) for k in normals]
    place, sign = table(way, left), scene.sign

    def of_time(x: FloatArray) -> FloatArray:
        return np.asarray(sum(w * t(x) for w, t in zip(weights / weights.sum(), tables, strict=True)))

    def of_z(x: FloatArray) -> FloatArray:
        gone = place((x - scene.z) * sign)
        return gone if sign > 0 else 1.0 - gone

    gone = float(share @ found.way)
    deviation = float(share @ (found.way - gone) ** 2) ** 0.5
    last = float(time[-1] + 5.0 * spread[-1])
    ends = sorted((scene.z, scene.z + sign * float(way[-1])))
    return (
        Law(of_time, (0.0, last), found.mean, found.std, 0.0),
        Law(of_z, (ends[0], ends[1]), scene.z + sign * gone, deviation, 0.0),
    )


def _sampled(values: FloatArray) -> Law:
    """The law of a sample."""
    order = np.sort(values)
    return Law(
        lambda x: np.searchsorted(order, x, side="right") / order.size,
        (order[0], order[-1]),
        float(order.mean()),
        float(order.std()),
        1.36 / order.size**0.5,
    )


@dataclass(frozen=True)
class Release:
    """The time of release; ``float(answer)`` is its mean. Everything is in scaled time.

    Attributes
    ----------
    mean, error : float
        And its absolute error, an estimate.
    std : float
        Standard deviation of the time.
    exit : tuple of float
        Chances of leaving through -r and through r.
    method : str
    notes : tuple of str
    """

    mean: float
    error: float
    std: float
    exit: tuple[float, float]
    method: str
    notes: tuple[str, ...] = ()
    _scene: Any = field(default=None, repr=False, compare=False)
    _known: Any = field(default=None, repr=False, compare=False)

    def __float__(self) -> float:
        return self.mean

    def __str__(self) -> str:
        return f"{with_error(self.mean, self.error)} (estimate, {self.method})"

    @cached_property
    def _laws(self) -> tuple[Law, Law]:
        """The laws of the time and of z, the error of those marched from two resolutions."""
        if self.method == "simulate":
            return _sampled(self._known.time), _sampled(self._known.z)
        rough, fine = (_marched(self._scene, found) for found in self._known)
        for one, other in zip(fine, rough, strict=True):
            x = one.mean + one.std * np.linspace(-4.0, 4.0, 41)
            one.error = float(np.abs(one.cdf(x) - other.cdf(x)).max())
        return fine

    @property
    def time(self) -> Law:
        """The law of the time of release."""
        return self._laws[0]

    @property
    def z(self) -> Law:
        """The law of z at release."""
        return self._laws[1]


def release(
    system: System,
    kappa: Number,
    r: Number,
    *,
    eps: Number,
    start: Sequence[Number] = (0, 0),
    method: Literal["march", "simulate"] = "march",
    rtol: Number = 1e-6,
    paths: int = 10_000,
    seed: int = 0,
    step: Number | None = None,
    tau: Number = 0,
) -> Release:
    """Mean time until ``|u| = r`` while the slow variable z moves (eq:osc3), with its law.

    Parameters
    ----------
    system : System
        Such as `oscillator`; z's velocity must keep its sign while ``|u| < r``.
    kappa : number
        Scaled noise amplitude, greater than 0.
    r : number
        Scaled radius of escape, greater than 0.
    eps : number
        Physical half-width of the layer, greater than 0: z moves by eps g in a unit of scaled time.
    start : pair of numbers
        u, inside (-r, r), and z.
    method : {"march", "simulate"}
        ``"march"``: the parabolic equation of (u, z). ``"simulate"``: Monte Carlo.
    rtol : number
        Relative error allowed, 1e-10 to 0.1, for ``"march"``.
    paths, seed, step, tau
        Of ``"simulate"``: independent paths, seed of the random numbers, step in scaled time, and
        the correlation time of coloured noise (0: white).

    Returns
    -------
    Release

    Raises
    ------
    InputError
        For a value outside its range, and where z is no clock.
    AccuracyError
        Where the method does not reach its error.

    Examples
    --------
    >>> import symasym as sa
    >>> block = sa.oscillator(mu=3, alpha=1)
    >>> answer = sa.release(block, "0.1", 10, eps="0.01", start=(0, "-0.4"))
    >>> print(f"{answer.mean:.4f}, {answer.std:.3f}, {answer.z.quantile(0.5):.3f}")
    51.1044, 3.468, -0.905
    """
    if not isinstance(system, System):
        raise InputError(f"system is {shown(system)}; give a System, such as sa.oscillator(3, 1).")
    choice("method", method, METHODS)
    if not isinstance(start, (tuple, list)) or len(start) != 2:
        raise InputError(f"start is {shown(start)}; give the pair (u, z).")
    given = {"kappa": kappa, "r": r, "eps": eps, "rtol": rtol}
    read = {name: float(positive(name, exact(name, x))) for name, x in given.items()}
    u, z, colour = (float(exact(n, x)) for n, x in (("u", start[0]), ("z", start[1]), ("tau", tau)))
    if not (abs(u) < read["r"] and 1e-10 <= read["rtol"] <= 0.1 and colour >= 0):
        raise InputError(
            f"start's u is {u:g}, rtol {read['rtol']:g} and tau {colour:g}; give a u inside "
            f"(-r, r), r = {read['r']:g}, an rtol from 1e-10 to 0.1, and a tau of at least 0."
        )
    scene = Scene(system, read["kappa"], read["r"], read["eps"], u, z)
    across = read["r"] * np.linspace(-1.0, 1.0, 201)
    for name, of in (("phi", system.phi_at), ("velocity", system.velocity_at)):
        if not np.isfinite(of(across, z, scene.eps)).all():
            raise InputError(
                f"{name} has no value at some |u| < r, z = {z:.6g}; give an expression that has."
            )
    if method == "march":
        scene.speed(across, np.array([z]))
        if colour:
            raise InputError(f"tau is {colour:g}; coloured noise is for method='simulate'.")
        rough, fine, error = march(scene, read["rtol"])
        left = min(max(fine.exit, 0.0), 1.0)
        sides = left, 1.0 - left
        return Release(fine.mean, error, fine.std, sides, method, (), scene, (rough, fine))
    h = step_of(scene, colour) if step is None else float(positive("step", exact("step", step)))
    if colour and h > colour / 4:
        raise InputError(f"step is {h:g} and tau {colour:g}; give a step of at most tau/4.")
    number, first = count("paths", paths, 10, _MOST_PATHS), count("seed", seed, 0, 2**62)
    sample = simulate(scene, number, h, first, colour)
    check = simulate(scene, max(2, number // 5), 2.0 * h, first + 1, colour)
    mean, std = float(sample.time.mean()), float(sample.time.std())
    noise, bias = std / number**0.5, abs(float(check.time.mean()) - mean)
    note = (
        f"{number} paths at step {h:.3g}: standard error {noise:.2g}, at twice the step "
        f"{bias:.2g} away."
    )
    left = float((sample.side < 0).mean())
    sides, error = (left, 1.0 - left), 3.0 * noise + bias
    return Release(mean, error, std, sides, method, (note,), scene, sample)
