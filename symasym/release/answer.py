"""`release`: when and where a block that sticks comes free while its slow variable moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from symasym.base.errors import InputError
from symasym.base.estimate import with_error
from symasym.base.inputs import Number, choice, count, exact, positive, shown
from symasym.release.march import Law, Scene, forward, laws, march, mesh
from symasym.release.simulate import Paths, law_of, simulate, step_of
from symasym.release.slabs import Elements
from symasym.release.system import System

__all__ = ["METHODS", "Release", "release"]

#: The methods, and what each computes.
METHODS = {
    "march": "the parabolic equation of (u, z), to rtol",
    "simulate": "Monte Carlo",
}
_MOST_PATHS = 10_000_000


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
        """The laws of the time and of z, from two densities where they are marched."""
        scene, known = self._scene, self._known
        if isinstance(known, Paths):
            return law_of(known.time), law_of(known.z)
        cut = mesh(scene, scene.z + scene.sign * known.way, 1.0, flight=True)
        rough, fine = (
            laws(forward(scene, Elements(cut, degree), 5, tol, 1e-10), scene.z, scene.sign)
            for degree, tol in ((6, 1e-4), (8, 1e-5))
        )
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
    scene.speed(across, z, checked=method == "march")
    for name, of in (("phi", system.phi_at), ("velocity", system.velocity_at)):
        if not np.isfinite(of(across, z, scene.eps)).all():
            raise InputError(
                f"{name} has no value at some |u| < r, z = {z:.6g}; give an expression that has."
            )
    if method == "march":
        if colour:
            raise InputError(f"tau is {colour:g}; coloured noise is for method='simulate'.")
        found = march(scene, read["rtol"])
        left = min(max(found.left, 0.0), 1.0)
        std, sides = found.variance**0.5, (left, 1.0 - left)
        return Release(found.mean, found.error, std, sides, method, (), scene, found)
    h = step_of(scene, colour) if step is None else float(positive("step", exact("step", step)))
    if colour and h > colour / 4:
        raise InputError(f"step is {h:g} and tau {colour:g}; give a step of at most tau/4.")
    number, first = count("paths", paths, 10, _MOST_PATHS), count("seed", seed, 0, 2**62)
    return _simulated(scene, number, h, first, colour)


def _simulated(scene: Scene, paths: int, h: float, seed: int, tau: float) -> Release:
    """The release by Monte Carlo, a fifth of the paths at twice the step for the bias left."""
    sample = simulate(scene, paths, h, seed, tau)
    check = simulate(scene, max(2, paths // 5), 2.0 * h, seed + 1, tau)
    mean, std = float(sample.time.mean()), float(sample.time.std())
    noise, bias = std / paths**0.5, abs(float(check.time.mean()) - mean)
    left = float((sample.side < 0).mean())
    note = (
        f"{paths} paths at step {h:.3g}: standard error {noise:.2g}, at twice the step "
        f"{bias:.2g} away."
    )
    error, sides = 3 * noise + bias, (left, 1.0 - left)
    return Release(mean, error, std, sides, "simulate", (note,), scene, sample)
