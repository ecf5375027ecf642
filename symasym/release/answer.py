"""`release`: the time and place at which a sticking block comes free as its slow variable moves.

Either the march (`symasym.release.march`) or Monte Carlo by the Euler-Maruyama method. Crossings
missed within a step h are compensated to first order in sqrt(h) by a boundary that is nearer by
-zeta(1/2)/sqrt(2 pi) kappa sqrt(h) (Broadie, Glasserman and Kou, Math. Finance 7 (1997) 325; Gobet,
Stochastic Process. Appl. 87 (2000) 167). The remaining error, of order h, is estimated by step 2h.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from symasym.base import inputs
from symasym.base.errors import AccuracyError, InputError
from symasym.base.estimate import with_error
from symasym.base.inputs import FloatArray, Number, Numbers
from symasym.release.march import March, Scene, march
from symasym.release.system import System

Function = Callable[[FloatArray], FloatArray]
_SHIFT = 0.5825971579390106  # -zeta(1/2)/sqrt(2 pi)
# Nodes and weights for a standard normal law, and of laws of two points with skewness -1, 0 and 1.
_NORMAL = np.polynomial.hermite_e.hermegauss(9)
_OTHERS = [
    ((s + np.array([-1, 1]) * (4 + s * s) ** 0.5) / 2, (4 + s * s) ** 0.5 + np.array([s, -s]))
    for s in (-1, 0, 1)
]
_MOST = 2 * 10**9  # random numbers and, at a hundred each, steps of a simulation


@dataclass
class Law:
    """A law on the real line: `mean`, `std`, distribution function, its `error`, quantiles."""

    _of: Function = field(repr=False)
    _ends: Any = field(repr=False)
    mean: float
    std: float
    error: float

    def cdf(self, x: Numbers) -> Any:
        """The probability of values up to x."""
        return np.clip(self._of(inputs.floats("x", x)), 0.0, 1.0)[()]

    def quantile(self, p: Numbers) -> Any:
        """The x at which `cdf` is p, which must lie in (0, 1)."""
        level = inputs.floats("p", p)
        if not ((level > 0.0) & (level < 1.0)).all():
            raise InputError(f"p is {level[()]}; give a probability between 0 and 1.")
        low, high = (np.full(level.shape, end) for end in self._ends)
        for _ in range(60):
            middle = (low + high) / 2
            past = self._of(middle) >= level
            low, high = np.where(past, low, middle), np.where(past, middle, high)
        return high[()]


@dataclass(frozen=True)
class Release:
    """The time of release; ``float(answer)`` is its mean. Everything is in scaled time.

    It has the mean, its absolute error (an estimate), the standard deviation, the probabilities of
    the ``exit`` through -r and through r, and the laws of the time and of z at release.
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
    start: Sequence[Number],
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
        moves by eps g in a unit of scaled time. All are within 1e±75.
    start : pair of numbers
        u, inside (-r, r), and z.
    method : {"march", "simulate"}
        The parabolic equation of (u, z), or Monte Carlo.
    rtol : number
        Relative error allowed, 1e-10 to 0.1, for ``"march"``.
    paths, seed, step, tau
        Of ``"simulate"``: independent paths, seed of the random numbers, step in scaled time, and
        the correlation time of coloured noise (0: white), at least four steps.

    Examples
    --------
    >>> import symasym as sa
    >>> block = sa.oscillator(mu=3, alpha=1)
    >>> answer = sa.release(block, "0.1", 10, eps="0.01", start=(0, "-0.4"))
    >>> print(f"{answer.mean:.4f}, {answer.std:.3f}, {answer.z.quantile(0.5):.3f}")
    51.1044, 3.468, -0.905
    """
    if not isinstance(system, System):
        raise InputError(f"system is {inputs.shown(system)}; give sa.oscillator or a System.")
    inputs.choice("method", method, ("march", "simulate"))
    if len(inputs.sequence("start", start)) != 2:
        raise InputError(f"start is {inputs.shown(start)}; give the pair (u, z).")
    given = {"kappa": kappa, "r": r, "eps": eps}
    noise, radius, width = (float(inputs.within(n, x, 1e-75, 1e75)) for n, x in given.items())
    u, z = (float(inputs.exact(name, x)) for name, x in zip("uz", start, strict=True))
    allowed = float(inputs.within("rtol", rtol, 1e-10, 0.1))
    colour = float(inputs.within("tau", tau, 0, 1e300))
    if abs(u) >= radius:
        raise InputError(f"start's u is {u:g} and r {radius:g}; u must lie inside (-r, r).")
    scene = Scene(system, noise, radius, width, u, z)
    across = radius * np.linspace(-1.0, 1.0, 201)
    if not np.isfinite(scene.phi(across, z) + scene.velocity(across, z)).all():
        raise InputError(f"phi or velocity has no value at some |u| < r, z = {z:.6g}; change it.")
    if method == "march":
        if colour:
            raise InputError(f"tau is {colour:g}; coloured noise is for method 'simulate'.")
        rough, fine, error = march(scene, allowed)
        left = min(max(float(fine.p[0][0]), 0.0), 1.0)
        time, place = _laws(fine, _NORMAL)
        for other in (_laws(rough, _NORMAL), *(_laws(fine, rule) for rule in _OTHERS)):
            for law, off in zip((time, place), other, strict=True):
                x = law.quantile(np.linspace(0.0, 1.0, 402)[1:-1])
                law.error += 2.0 * float(np.abs(law.cdf(x) - off.cdf(x)).max())
        return Release(fine.mean, error, fine.std, (left, 1.0 - left), method, (), time, place)
    # The step resolves phi, the noise and its correlation time.
    bend = np.abs(np.gradient(scene.phi(across / radius, z), across / radius)).max()
    flight = 0.002 * (radius / noise) ** 2
    h = float(min(0.05 / max(bend, 1.0), flight, colour / 8 or 0.05))
    if step is not None:
        h = float(inputs.within("step", step, 1e-300, colour / 4 or 1e300))
    number, seed = inputs.count("paths", paths, 10, 10**7), inputs.count("seed", seed, 0, 2**62)
    times, places, sides = _simulated(scene, number, h, seed, colour)
    check = _simulated(scene, max(2, number // 5), 2.0 * h, seed + 1, colour)[0]
    time, place = _of_sample(times), _of_sample(places)
    spread, bias = time.std / number**0.5, abs(float(check.mean()) - time.mean)
    note = (
        f"{number} paths at step {h:.3g}: standard error {spread:.2g}, at step 2h {bias:.2g} away."
    )
    left, error = float((sides < 0).mean()), 3.0 * spread + bias
    return Release(time.mean, error, time.std, (left, 1.0 - left), method, (note,), time, place)


def _laws(found: March, rule: Any) -> tuple[Law, Law]:
    """The laws of the time and of z.

    At each z the time is taken as normal, of the mean and the variance that left there; the law of
    the time is their mixture, by Gauss and Hermite's rule. Other rules in its place tell what this
    assumption changes.
    """
    from scipy.interpolate import CubicHermiteSpline, PchipInterpolator

    share, z, sign = found.share[:, 0], found.scene.z, found.scene.sign
    sure = share > 1e-9 * share.max()
    late, square = (found.share[sure, 1:] / share[sure, None]).T
    columns = found.way, found.left, found.density, found.clock
    way, left, density, clock = (np.append(0.0, x[sure]) for x in columns)
    time = clock + np.append(0.0, late)
    spread = np.append(0.0, np.sqrt(np.maximum(square - late**2, 0.0)))
    gone = CubicHermiteSpline(way, left, density)
    (nodes, weights), ways = rule, []
    for x in (np.maximum.accumulate(time + k * spread) for k in nodes):
        grows = np.append(True, np.diff(x) > 0.0)
        ways.append((x[grows][-1], PchipInterpolator(x[grows], way[grows])))
    ends, mean = sorted((z, z + sign * way[-1])), float(share @ found.way)
    std = float(share @ (found.way - mean) ** 2) ** 0.5
    of_time = Law(
        lambda x: np.average([gone(of(np.clip(x, 0.0, last))) for last, of in ways], 0, weights),
        (0.0, time[-1] + 5.0 * spread[-1]), found.mean, found.std, 0.0,
    )  # fmt: skip
    of_z = Law(
        lambda x: (sign < 0) + sign * gone(np.clip((x - z) * sign, 0.0, way[-1])),
        ends, z + sign * mean, std, 0.0,
    )  # fmt: skip
    return of_time, of_z


def _of_sample(values: FloatArray) -> Law:
    """The empirical law of a sample."""
    order, n = np.sort(values), len(values)
    mean, std, error = float(order.mean()), float(order.std()), 1.36 / n**0.5
    return Law(lambda x: order.searchsorted(x, "right") / n, order[[0, -1]], mean, std, error)


def _simulated(scene: Scene, paths: int, h: float, seed: int, tau: float) -> FloatArray:
    """Times, z and sides (-1 or 1) at the release of independent paths with steps of h, as rows.

    With `tau` > 0 the noise is Ornstein and Uhlenbeck's of that correlation time, which tends to
    the white one: kappa x dt in place of kappa dW, dx = (-x dt + dW)/tau; h must be far below it.
    """
    normal = np.random.default_rng(seed).standard_normal
    # Paths in coloured noise are smooth, so that no crossing within a step is missed.
    shift = 0.0 if tau else _SHIFT * np.sqrt(h) * float(scene.noise(np.array(scene.r)))
    fresh = np.sqrt(-np.expm1(-2.0 * h / tau) / (2.0 * tau)) if tau else 1.0
    colour = normal(paths) / np.sqrt(2.0 * tau) if tau else np.zeros(paths)
    u, z, index = np.full(paths, scene.u), np.full(paths, scene.z), np.arange(paths)
    found, step, drawn = np.empty((3, paths)), 0, 0
    while u.size:
        step, drawn = step + 1, drawn + u.size + 100
        if drawn > _MOST:
            raise AccuracyError(
                f"{u.size} paths are held after {step} steps of {h:.3g}; "
                "give a longer step or fewer paths, or take method 'march'."
            )
        push = (h * colour if tau else np.sqrt(h) * normal(u.size)) * scene.noise(u)
        if tau:
            colour = np.exp(-h / tau) * colour + fresh * normal(u.size)
        u, z = u + h * scene.phi(u, z) + push, z + h * scene.eps * scene.velocity(u, z)
        gone = np.abs(u) >= scene.r - shift
        found[:, index[gone]] = np.broadcast_arrays(step * h, z[gone], np.sign(u[gone]))
        u, z, colour, index = (x[~gone] for x in (u, z, colour, index))
    return found
