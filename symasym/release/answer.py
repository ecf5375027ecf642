"""`release`: when and where a block that sticks comes free while its slow variable moves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from symasym.base.errors import InputError
from symasym.base.estimate import with_error
from symasym.base.inputs import (
    Number,
    choice,
    count,
    exact,
    positive,
    sequence,
    shown,
    within,
)
from symasym.release.laws import Law, of_march, of_sample
from symasym.release.march import Scene, march
from symasym.release.simulate import simulate, step_of
from symasym.release.system import System


@dataclass(frozen=True)
class Release:
    """The time of release; ``float(answer)`` is its mean. Everything is in scaled time.

    It has the mean, its absolute error (an estimate) and the standard deviation, the chances to
    ``exit`` through -r and through r, and the laws of the time and of z at release.
    """

    mean: float
    error: float
    std: float
    exit: tuple[float, float]
    method: str
    notes: tuple[str, ...]
    time: Law = field(repr=False, compare=False)
    z: Law = field(repr=False, compare=False)

    def __float__(self) -> float:
        return self.mean

    def __str__(self) -> str:
        return f"{with_error(self.mean, self.error)} (estimate, {self.method})"


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
    kappa, r, eps : number
        Scaled noise amplitude and radius of escape, and the physical half-width of the layer: z
        moves by eps g in a unit of scaled time. All are greater than 0.
    start : pair of numbers
        u, inside (-r, r), and z.
    method : {"march", "simulate"}
        The parabolic equation of (u, z), or Monte Carlo.
    rtol : number
        Relative error allowed, 1e-10 to 0.1, for ``"march"``.
    paths, seed, step, tau
        Of ``"simulate"``: independent paths, seed of the random numbers, step in scaled time, and
        the correlation time of coloured noise (0: white).

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
    choice("method", method, ("march", "simulate"))
    if len(sequence("start", start)) != 2:
        raise InputError(f"start is {shown(start)}; give the pair (u, z).")
    given = {"kappa": kappa, "r": r, "eps": eps}
    noise, radius, width = (float(positive(name, x)) for name, x in given.items())
    u, z = (float(exact(name, x)) for name, x in zip("uz", start, strict=True))
    allowed, colour = float(within("rtol", rtol, 1e-10, 0.1)), float(within("tau", tau, 0, 1e300))
    if abs(u) >= radius:
        raise InputError(f"start's u is {u:g} and r {radius:g}; u must lie inside (-r, r).")
    scene = Scene(system, noise, radius, width, u, z)
    across = radius * np.linspace(-1.0, 1.0, 201)
    if not np.isfinite(scene.phi(across, z) + scene.velocity(across, z)).all():
        raise InputError(
            f"phi or velocity has no value at some |u| < r, z = {z:.6g}; give another."
        )
    if method == "march":
        if colour:
            raise InputError(f"tau is {colour:g}; coloured noise is for method='simulate'.")
        rough, fine, error = march(scene, allowed)
        left = min(max(float(fine.p[0][0]), 0.0), 1.0)
        laws = of_march(rough, fine)
        return Release(fine.mean, error, fine.std, (left, 1.0 - left), method, (), *laws)
    h = step_of(scene, colour) if step is None else float(positive("step", step))
    if colour and h > colour / 4:
        raise InputError(f"step is {h:g} and tau {colour:g}; give a step of at most tau/4.")
    number, first = count("paths", paths, 10, 10_000_000), count("seed", seed, 0, 2**62)
    times, places, sides = simulate(scene, number, h, first, colour)
    check, _, _ = simulate(scene, max(2, number // 5), 2.0 * h, first + 1, colour)
    time, z_law = of_sample(times), of_sample(places)
    noise, bias = time.std / number**0.5, abs(float(check.mean()) - time.mean)
    note = (
        f"{number} paths at step {h:.3g}: standard error {noise:.2g}, at step 2h {bias:.2g} away."
    )
    left, error = float((sides < 0).mean()), 3.0 * noise + bias
    return Release(time.mean, error, time.std, (left, 1.0 - left), method, (note,), time, z_law)
