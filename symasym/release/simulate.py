"""Monte Carlo of the whole system: Euler and Maruyama's method, its boundary moved inwards.

A path that is looked at every h misses excursions over u = r and back between two looks. To first
order in sqrt(h) that is undone by a boundary nearer by -zeta(1/2)/sqrt(2 pi) kappa sqrt(h), 0.5826
kappa sqrt(h) (Broadie, Glasserman and Kou, Math. Finance 7 (1997) 325; Gobet, Stochastic Process.
Appl. 87 (2000) 167). What bias is left is of order h and is seen from paths at twice the step.
"""

from __future__ import annotations

import warnings
from concurrent.futures import BrokenExecutor, CancelledError, Executor
from typing import Any, NamedTuple

import numpy as np

from symasym.base.call_context import step as keep_to_patience
from symasym.base.errors import AccuracyError, InputError, TimeLimitError
from symasym.base.executors import cluster, local
from symasym.base.inputs import FloatArray, shown
from symasym.release.system import System

__all__ = ["Paths", "simulate"]

#: -zeta(1/2)/sqrt(2 pi)
SHIFT = 0.5825971579390106
_AT_ONCE = 5000
_MOST_STEPS = 20_000_000
_MOST_PATHS = 100_000_000


class Paths(NamedTuple):
    """Times, z and sides (-1 or 1) at release of independent paths, and the steps they took."""

    time: FloatArray
    z: FloatArray
    side: FloatArray
    steps: int


def simulate(
    system: System,
    kappa: float,
    r: float,
    eps: float,
    start: tuple[float, float],
    paths: int,
    h: float,
    seed: int,
    workers: int | str | Executor = 1,
    tau: float = 0.0,
) -> Paths:
    """Independent paths from `start` to release, the same for every number of workers.

    With `tau` > 0 the noise is Ornstein and Uhlenbeck's of that correlation time, which tends to
    the white one: kappa x dt in place of kappa dW, dx = (-x dt + dW)/tau; h must be far below it.

    Raises
    ------
    InputError
        For a seed or a number of paths that is no whole number.
    """
    for name, value, least in (("seed", seed, 0), ("paths", paths, 2)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < least:
            raise InputError(f"{name} is {shown(value)}; give a whole number of at least {least}.")
    if paths > _MOST_PATHS:
        raise InputError(f"paths is {shown(paths)}; give at most {_MOST_PATHS}.")
    counts = [_AT_ONCE] * (paths // _AT_ONCE) + [paths % _AT_ONCE] * (paths % _AT_ONCE > 0)
    seeds = np.random.SeedSequence(seed).spawn(len(counts))
    work = [
        (system, kappa, r, eps, start, n, h, s, tau) for n, s in zip(counts, seeds, strict=True)
    ]
    if isinstance(workers, Executor):
        parts = _through(workers, work)
    elif isinstance(workers, str):
        with cluster(workers) as executor:
            parts = _through(executor, work)
    else:
        if isinstance(workers, bool) or not isinstance(workers, (int, np.integer)) or workers < 1:
            raise InputError(f"workers is {shown(workers)}; give a whole number of at least 1.")
        with local(min(int(workers), len(work))) as executor:
            parts = _through(executor, work)
    time, z, side = (np.concatenate(column) for column in list(zip(*parts, strict=True))[:3])
    return Paths(time, z, side, sum(part.steps for part in parts))


def _through(executor: Executor, work: list[Any]) -> list[Paths]:
    """The parts of the work; what a broken executor leaves undone is done here."""
    parts: list[Paths | None] = [None] * len(work)
    try:
        futures = [executor.submit(_batch, *item) for item in work]
        for k, future in enumerate(futures):
            parts[k] = future.result()
    except TimeLimitError:
        raise
    except (BrokenExecutor, CancelledError, OSError) as error:
        missing = sum(p is None for p in parts)
        warnings.warn(
            f"the executor died ({type(error).__name__}) with {missing} of {len(work)} batches "
            "not done; they are simulated in this process.",
            RuntimeWarning,
            stacklevel=4,
        )
    return [_batch(*item) if p is None else p for p, item in zip(parts, work, strict=True)]


def _batch(
    system: System,
    kappa: float,
    r: float,
    eps: float,
    start: tuple[float, float],
    paths: int,
    h: float,
    seed: np.random.SeedSequence,
    tau: float,
) -> Paths:
    """Paths of one batch."""
    normal = np.random.default_rng(seed).standard_normal
    plain = system.noise == 1
    # Paths in coloured noise are smooth, and are not missed between two looks.
    shift = 0.0 if tau else SHIFT
    kept, fresh = (
        (np.exp(-h / tau), np.sqrt(-np.expm1(-2.0 * h / tau) / (2.0 * tau))) if tau else (0.0, 1.0)
    )
    colour = normal(paths) / np.sqrt(2.0 * tau) if tau else np.zeros(paths)
    inside = r - shift * kappa * np.sqrt(h) * float(system.noise_at(np.array(r)))
    u, z = np.full(paths, start[0]), np.full(paths, start[1])
    times, ends, sides, step, total = [], [], [], 0, 0
    while u.size:
        keep_to_patience()
        if step > _MOST_STEPS:
            raise AccuracyError(
                f"{u.size} of {paths} paths are held after {step} steps of {h:.3g}; the mean is "
                "beyond simulation, take method='march'."
            )
        total += u.size
        step += 1
        if tau:
            push = kappa * h * colour
            colour = kept * colour + fresh * normal(u.size)
        else:
            push = kappa * np.sqrt(h) * normal(u.size)
        if not plain:
            push *= system.noise_at(u)
        moved = u + h * system.phi_at(u, z, eps) + push
        z = z + h * eps * system.velocity_at(u, z, eps)
        u = moved
        gone = np.abs(u) >= inside
        if gone.any():
            times.append(np.full(np.count_nonzero(gone), step * h))
            ends.append(z[gone])
            sides.append(np.sign(u[gone]))
            u, z, colour = u[~gone], z[~gone], colour[~gone]
    return Paths(np.concatenate(times), np.concatenate(ends), np.concatenate(sides), total)
