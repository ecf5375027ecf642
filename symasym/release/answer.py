"""`release`: when and where a block that sticks comes free while its slow variable moves."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Literal

import numpy as np

from symasym.base.call_context import patient
from symasym.base.errors import AccuracyError, InputError
from symasym.base.estimate import ErrorKind, with_error
from symasym.base.inputs import Number, choice, exact, flag, float_text, positive, shown, to_float
from symasym.quantities import escape_time
from symasym.release.expansions import adiabatic, expanded
from symasym.release.march import Law, Marched, Scene, forward, laws, march, mesh
from symasym.release.simulate import Paths, simulate
from symasym.release.slabs import Elements
from symasym.release.system import System

__all__ = ["METHODS", "Release", "release"]

#: The methods, and what each computes.
METHODS = {
    "auto": "the cheapest of the next three whose stated error is at most rtol",
    "march": "the parabolic equation of (u, z), to rtol",
    "frozen": "the mean escape time with z frozen",
    "first_order": "that and its first correction in eps",
    "adiabatic": "escape at the rate 1/T(z), no error claimed",
    "simulate": "Monte Carlo",
}
# A share of eps T1/T0 beyond which the next order is not small.
_SMALL = 0.1
# Correlation times of coloured noise that are simulated.
_SHORTEST = 1e-12


@dataclass(frozen=True)
class Release:
    """The time of release; ``float(answer)`` is its mean. Everything is in scaled time.

    Attributes
    ----------
    mean : float
    error : float or None
        Absolute error of `mean`.
    error_kind : {"estimate", "none"}
    std : float or None
        Standard deviation of the time.
    exit : tuple of float or None
        Chances of leaving through -r and through r.
    method : str
    notes : tuple of str
        What the answer leaves out.
    """

    mean: float
    error: float | None
    error_kind: ErrorKind
    std: float | None
    exit: tuple[float, float] | None
    method: str
    notes: tuple[str, ...] = ()
    _scene: Scene | None = field(default=None, repr=False, compare=False)
    _known: Any = field(default=None, repr=False, compare=False)

    def __float__(self) -> float:
        return self.mean

    def __str__(self) -> str:
        if self.error is None:
            return f"{self.mean:.6g} (no error claimed, {self.method})"
        text = with_error(self.mean, self.error)
        return f"{text} ({self.error_kind}, {self.method})"

    @cached_property
    def _laws(self) -> tuple[Law, Law]:
        """The laws of the time and of z."""
        scene, known = self._scene, self._known
        if scene is None or known is None:
            raise InputError(
                f"method {self.method!r} gives no law, only the mean; take method='march', "
                "'adiabatic' or 'simulate'."
            )
        if isinstance(known, Paths):
            return _sampled(known.time), _sampled(known.z)
        if not isinstance(known, Marched):
            return laws(known, scene.z, scene.sign)
        # Two densities, on a mesh that resolves a packet in flight.
        low, high = (
            forward(
                scene,
                Elements(mesh(scene, scene.z + scene.sign * known.way, 1.0, flight=True), degree),
                5,
                tol,
                1e-10,
            )
            for degree, tol in ((6, 1e-4), (8, 1e-5))
        )
        rough = laws(low, scene.z, scene.sign)
        fine = laws(high, scene.z, scene.sign)
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


@patient
def release(
    system: System,
    kappa: Number,
    r: Number,
    *,
    eps: Number,
    start: Sequence[Number] = (0, 0),
    method: Literal["auto", "march", "frozen", "first_order", "adiabatic", "simulate"] = "auto",
    rtol: Number = 1e-6,
    full: bool = False,
    paths: int = 10_000,
    seed: int = 0,
    step: Number | None = None,
    workers: int | str | Executor = 1,
    tau: Number = 0,
    patience: float | None = None,
) -> Release:
    """Mean time until ``|u| = r`` while the slow variable z moves (eq:osc3).

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
    method : {"auto", "march", "frozen", "first_order", "adiabatic", "simulate"}
        ``"march"``: the parabolic equation of (u, z), to `rtol`. ``"frozen"``: `escape_time`.
        ``"first_order"``: that and its first correction in eps. ``"adiabatic"``: escape at the
        rate 1/T(z), no error claimed. ``"simulate"``: Monte Carlo. ``"auto"``: the cheapest of the
        first three whose stated relative error is at most `rtol`.
    rtol : number
        Relative error allowed, 1e-10 to 1, for ``"auto"`` and ``"march"``.
    full : bool
        Compute the laws of the time and of z now, where the method has them, in place of when they
        are first asked for.
    paths : int
        Of ``"simulate"``, as the next four: independent paths.
    seed : int
        Seed of the random numbers.
    step : number, optional
        Step in scaled time; in coloured noise at most tau/4.
    workers : int, str or Executor
        Processes of this machine, a dask scheduler's address, or an executor.
    tau : number
        Correlation time of coloured noise, 0 for the white one.
    patience : float, optional
        Seconds of processor time that the march, or a simulation in this process, may take, 10 if
        left out.

    Returns
    -------
    Release

    Raises
    ------
    InputError
        For a value outside its range, and where z is no clock.
    AccuracyError
        Where the method does not reach its error.
    TimeLimitError
        If that would take longer than `patience`.

    Examples
    --------
    >>> import symasym as sa
    >>> block = sa.oscillator(mu=3, alpha=1)
    >>> answer = sa.release(block, "0.1", 10, eps="0.01", start=(0, "-0.4"))
    >>> print(f"{answer.mean:.4f}, {answer.std:.3f}, {answer.z.quantile(0.5):.3f}")
    51.1044, 3.468, -0.905
    """
    if not isinstance(system, System):
        raise InputError(
            f"system is of type {type(system).__name__}; give a System, such as "
            "sa.oscillator(mu=3, alpha=1)."
        )
    method, full = choice("method", method, METHODS), flag("full", full)
    if not isinstance(start, (tuple, list)) or len(start) != 2:
        raise InputError(f"start is {shown(start)}; give the pair (u, z).")
    read = {
        name: positive(name, exact(name, x))
        for name, x in (("kappa", kappa), ("r", r), ("eps", eps), ("rtol", rtol))
    }
    u, z = (exact(name, x) for name, x in zip(("start's u", "start's z"), start, strict=True))
    if abs(u) >= read["r"]:
        raise InputError(
            f"start's u is {float_text(u)}; it must be inside (-r, r), r = {float_text(read['r'])}."
        )
    if not 1e-10 <= read["rtol"] <= 1:
        raise InputError(f"rtol is {float_text(read['rtol'])}; give 1e-10 to 1.")
    noise, radius, width = (to_float(name, read[name]) for name in ("kappa", "r", "eps"))
    scene = Scene(system, noise, radius, width, float(u), float(z))
    across = radius * np.linspace(-1.0, 1.0, 201)
    for name, of in (("phi", system.phi_at), ("velocity", system.velocity_at)):
        if not (finite := np.isfinite(of(across, scene.z, width))).all():
            raise InputError(
                f"{name} has no value at u = {across[~finite][0]:.4g}, z = {scene.z:.6g}; give an "
                f"expression that is finite for all |u| < r."
            )
    if method == "simulate":
        correlation = exact("tau", tau)
        if correlation < 0:
            raise InputError(f"tau is {float_text(correlation)}; it must be at least 0.")
        if 0 < correlation < _SHORTEST:
            raise InputError(
                f"tau is {float_text(correlation)}, of too many steps; give 0 for white noise, or "
                f"at least {_SHORTEST:g}."
            )
        return _simulated(scene, paths, seed, step, workers, float(correlation))
    full = flag("full", full)
    if exact("tau", tau) != 0:
        raise InputError(f"tau is {shown(tau)}; coloured noise is for method='simulate' alone.")
    # z is a clock, or the sentence that says where it is not.
    scene.speed(across, scene.z)
    answer = _BY_METHOD[method](scene, float(read["rtol"]))
    if full and answer._known is not None:
        _ = answer._laws
    return answer


def _marched(scene: Scene, rtol: float) -> Release:
    """The release by the parabolic equation."""
    marched = march(scene, rtol)
    left = min(max(marched.left, 0.0), 1.0)
    std, sides = marched.variance**0.5, (left, 1.0 - left)
    return Release(marched.mean, marched.error, "estimate", std, sides, "march", (), scene, marched)


def _frozen(scene: Scene, rtol: float) -> Release:
    """The release with z frozen."""
    time, first = expanded(scene)
    return _of_order(scene, "frozen", time, abs(first) + 3.0 * first**2 / time, first / time)


def _first_order(scene: Scene, rtol: float) -> Release:
    """The release with z frozen, and its first correction in eps."""
    time, first = expanded(scene)
    if abs(first) > _SMALL * time:
        enough = _SMALL * scene.eps * time / abs(first)
        raise AccuracyError(
            f"the first correction is {first / time:.3g} of T = {time:.6g}, and the next one is "
            f"not small beside it; take method='march', or eps below {enough:.2g}."
        )
    return _of_order(scene, "first_order", time + first, 3.0 * first**2 / time, 0.0)


def _of_order(scene: Scene, name: str, mean: float, error: float, share: float) -> Release:
    """An answer of an expansion in eps."""
    error += 1e-8 * mean
    if not abs(share) <= _SMALL:
        borne = scene.system.drag_time(scene.z, scene.eps)
        note = (
            f"z moves while the block sticks, and changes T by more than {_SMALL:g} of it: T is "
            "not the time of release"
            + (f"; a well has changed by its depth in {borne:.4g}." if np.isfinite(borne) else ".")
        )
        return Release(mean, None, "none", None, None, name, (note,), scene)
    return Release(mean, error, "estimate", None, None, name, (), scene)


def _adiabatic(scene: Scene, rtol: float) -> Release:
    """The release by the rate 1/T(z)."""
    density = adiabatic(scene)
    time, _ = laws(density, scene.z, scene.sign)
    note = "the flight past the fold is taken for a waiting time."
    return Release(time.mean, None, "none", time.std, None, "adiabatic", (note,), scene, density)


def _auto(scene: Scene, rtol: float) -> Release:
    """The cheapest of frozen, first order and march whose stated error will do."""
    # The first correction is of the order of eps T, the error after it of its square.
    if scene.system.noise == 1:
        log_time = escape_time(
            scene.system.frozen(scene.z), scene.kappa, scene.r, start=scene.u, log=True
        )
        if 2.0 * (np.log(scene.eps) + log_time) < np.log(rtol):
            for method in (_frozen, _first_order):
                answer = method(scene, rtol)
                if answer.error is not None and answer.error <= rtol * answer.mean:
                    return answer
    return _marched(scene, rtol)


_BY_METHOD = {
    "auto": _auto,
    "march": _marched,
    "frozen": _frozen,
    "first_order": _first_order,
    "adiabatic": _adiabatic,
}


def _simulated(
    scene: Scene,
    paths: int,
    seed: int,
    step: Number | None,
    workers: int | str | Executor,
    tau: float,
) -> Release:
    """The release by Monte Carlo, a fifth of the paths at twice the step for the bias left."""
    system, kappa, r, eps, u, z = scene
    if step is None:
        across = np.linspace(-1.0, 1.0, 201)
        bend = np.abs(np.gradient(system.phi_at(across, z, eps), across)).max()
        slowest = tau / 8 if tau else 0.05
        h = min(0.05 / max(float(bend), 1e-300), 0.002 * (r / kappa) ** 2, 0.05, slowest)
    else:
        h = float(positive("step", exact("step", step)))
        if tau and h > tau / 4:
            raise InputError(
                f"step is {h:g}, too long for the noise of tau = {tau:g}; leave it out, or give at "
                "most tau/4."
            )
    sample = simulate(system, kappa, r, eps, (u, z), paths, h, seed, workers, tau)
    check = simulate(
        system, kappa, r, eps, (u, z), max(2, paths // 5), 2.0 * h, seed + 1, workers, tau
    )
    mean, std = float(sample.time.mean()), float(sample.time.std())
    noise = std / paths**0.5
    bias = abs(float(check.time.mean()) - mean)
    left = float((sample.side < 0).mean())
    note = (
        f"{paths} paths at step {h:.3g}: standard error {noise:.2g}, at twice the step "
        f"{bias:.2g} away."
    )
    error, sides = 3.0 * noise + bias, (left, 1.0 - left)
    return Release(mean, error, "estimate", std, sides, "simulate", (note,), scene, sample)


def _sampled(values: Any) -> Law:
    """The law of a sample."""
    order = np.sort(values)

    def cdf(x: Any) -> Any:
        return np.searchsorted(order, x, side="right") / order.size

    error = 1.36 / order.size**0.5
    # Squares of long times leave float64.
    unit = max(abs(order[0]), abs(order[-1])) or 1.0
    spread = unit * float((order / unit).std())
    return Law(cdf, order[0], order[-1], float(order.mean()), spread, error)
