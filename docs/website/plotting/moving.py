"""Plots of what is derived of the whole system, beside marching, simulation and a path."""

from __future__ import annotations

from typing import Any

import numpy as np

import symasym as sa
from website.plotting.plots import Picture, Plot
from website.plotting.symbolic import value

BLOCK = sa.oscillator(mu=3, alpha=1)
_OF = "friction, μ = 3, α = 1, r = 10"
#: The first zero of Ai, at which the path w1 = Ai'(-s)/Ai(-s) leaves.
_LEAVES = 2.338107410459767


def all_plots() -> tuple[Plot | Picture, ...]:
    """Those of this module."""
    return (_time(), _order(), _adiabatic(), _frozen(), _delay())


def _mean(kappa: float, z: str, eps: float, **more: Any) -> float:
    """Mean time of release from u = 0."""
    more = {"method": "march", "rtol": "1e-8", **more}
    return sa.release(BLOCK, kappa, 10, eps=eps, start=(0, z), **more).mean


def _each(x: Any, mean: Any) -> Any:
    """The logarithm of a mean for each of the values x."""
    return np.log([mean(float(one)) for one in x])


def _time() -> Picture:
    """The mean, marched, and simulated paths, which solve no equation."""

    def draw(axes: Any) -> None:
        kappa = np.geomspace(0.5, 5, 9)
        axes.plot(kappa, [_mean(k, "-0.4", 0.02, rtol="1e-4") for k in kappa.tolist()])
        for k in kappa[::2].tolist():
            found = sa.release(
                BLOCK, k, 10, eps="0.02", start=(0, "-0.4"), method="simulate", paths=1000, seed=3
            )
            assert found.error is not None
            axes.errorbar(k, found.mean, found.error, fmt="ko", capsize=4)
        axes.set(xscale="log", xlabel="κ, scaled", ylabel="mean time of release", ylim=(0, None))
        axes.set_title(f"{_OF}, ε = 1/50, z = -2/5")

    what = "the marched mean (line) and those of 1,000 paths, with three standard errors"
    return Picture("release-time", what, draw)


def _order() -> Plot:
    frozen, first = (
        _mean(0.5, "-0.4", 1e-9, method=method) for method in ("frozen", "first_order")
    )
    return Plot(
        "release-order", "mean time of release", f"{_OF}, κ = 1/2, z = -2/5",
        np.geomspace(1e-6, 1e-2, 10), lambda eps: _each(eps, lambda e: _mean(0.5, "-0.4", e)),
        lambda eps: np.log(frozen + eps * (first - frozen) / 1e-9), "ε",
    )  # fmt: skip


def _adiabatic() -> Plot:
    marched, stated = (
        sa.release(BLOCK, "0.15", 10, eps="1e-4", start=(0, "-0.5"), method=method, rtol="1e-4")
        for method in ("march", "adiabatic")
    )
    return Plot(
        "release-adiabatic", "chance to be held", f"{_OF}, κ = 0.15, ε = 10⁻⁴, z = -1/2",
        np.linspace(50, 1200, 24), lambda t: 1 - marched.time.cdf(t),
        lambda t: 1 - stated.time.cdf(t), "time, scaled", logs=False, log_x=False,
    )  # fmt: skip


def _frozen() -> Plot:
    h = 1e-4
    left, time, right = sa.escape_time(
        sa.friction(3, 1, z0=-0.5 + h * np.array([-1.0, 0.0, 1.0])), 0.15, 10
    )
    of = value("frozen-time")
    slope = (right - left) / (2 * h)
    return Plot(
        "frozen-time", "mean time of release", f"{_OF}, κ = 0.15, z = -1/2",
        np.geomspace(1e-7, 4e-6, 8),
        lambda eps: _each(eps, lambda e: _mean(0.15, "-0.5", e, rtol="1e-6")),
        lambda eps: np.log(of(epsilon=eps, g=-1.0, T_f=time, Tf_z=slope)), "ε",
    )  # fmt: skip


def _delay() -> Plot:
    # There phi = 6 w^2 + eps t to the leading order.
    unit = value("fold-delay", 1)
    return Plot(
        "fold-delay", "time past the fold", f"{_OF}, no noise: until u = 1",
        np.geomspace(1e-7, 1e-2, 25),
        lambda eps: np.log(_late(eps)), lambda eps: np.log(_LEAVES * unit(epsilon=6 * eps)), "ε",
    )  # fmt: skip


def _late(eps: Any, before: float = 4.0, step: float = 1e-3) -> Any:
    """Time from the fold to u = 1 of paths in their well at first, by Runge and Kutta's method."""
    fast = eps ** (-1 / 3)

    def slope(s: float, u: Any) -> Any:
        """du/ds, s = time/fast."""
        return fast * (1 + 7 / 9 + eps * fast * s - u - 3 * (u - u**3))

    s, u = -before, 2 / 3 - np.sqrt(before * eps * fast / 6)
    late = np.full_like(eps, np.nan)
    while np.isnan(late).any():
        first = slope(s, u)
        second = slope(s + step / 2, u + step / 2 * first)
        third = slope(s + step / 2, u + step / 2 * second)
        fourth = slope(s + step, u + step * third)
        last, u, s = u, u + step / 6 * (first + 2 * (second + third) + fourth), s + step
        gone = np.isnan(late) & (u >= 1)
        late[gone] = s - step * (u[gone] - 1) / (u[gone] - last[gone])
        u = np.minimum(u, 1.0)
    return late * fast
