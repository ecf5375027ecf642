"""A search for drifts that fool the estimates of weak noise: `python -m tests.searches.fooling`.

The truncation error after N terms is judged by what follows. Here the Taylor coefficients of V at
a well are drawn at random, but those that enter the next terms c_{N+1} and c_{N+2} linearly, which
are chosen so that both nearly vanish; the others are felt in later terms alone. Laplace's 1 - P,
and T from a start beside the well, are compared with the exact ones; a scene counts where the
claim is an estimate and above rounding.
"""

from __future__ import annotations

import argparse
from typing import Any, NamedTuple

import numpy as np

import symasym as sa
from symasym.base.inputs import FloatArray

_DEGREE = 12
_WELL = -0.25
_AT_ONCE = 250


class Judged(NamedTuple):
    """True over claimed errors of the scenes that were answered."""

    asked: int
    ratios: FloatArray


def drifts(count: int, order: int, rng: np.random.Generator, centre: float) -> FloatArray:
    """Ascending coefficients of A for drifts with a well at `centre`, one column each.

    V = t^2/2 (1 + sum alpha_j t^j), t = u - centre; A < 0 right of the well and > 0 left of it.
    """
    found: list[FloatArray] = []
    while len(found) < count:
        alpha = np.zeros(_DEGREE)
        size = 10.0 ** rng.uniform(-4, 0.5, _DEGREE) * rng.choice([-1, 1], _DEGREE)
        used = rng.random(_DEGREE) < 0.4
        alpha[used] = size[used]
        for n in (order + 1, order + 2):
            if 2 * n <= _DEGREE:
                alpha[2 * n - 1] = 0.0
                # Linear in alpha_2n, with the factor -(n + 1/2).
                vanishing = _coefficient(alpha, n) / (n + 0.5)
                alpha[2 * n - 1] = vanishing * (1 + 10.0 ** rng.uniform(-9, -2))
        if np.abs(alpha).max() > 30:
            continue
        slope = -np.array([0.0, 2, *((j + 2) * a for j, a in enumerate(alpha, start=1))]) / 2
        t = np.linspace(-1 - centre, 1 - centre, 400)
        if (np.polynomial.polynomial.polyval(t, slope) * np.sign(t) >= -1e-3 * np.abs(t)).any():
            continue
        about = np.polynomial.Polynomial(slope)(np.polynomial.Polynomial([-centre, 1.0])).coef
        found.append(np.pad(about, (0, _DEGREE + 2 - len(about))))
    return np.array(found).T


def _coefficient(alpha: FloatArray, n: int) -> float:
    """[t^2n] (1 + sum alpha_j t^j)^-(n + 1/2), by the binomial series."""
    inner = np.concatenate(([0.0], alpha))[: 2 * n + 1]
    total, power, factor = 0.0, np.eye(1, 2 * n + 1)[0], 1.0
    for m in range(2 * n + 1):
        total += factor * power[-1]
        power = np.convolve(power, inner)[: 2 * n + 1]
        factor *= (-(n + 0.5) - m) / (m + 1)
    return float(total)


def judged(count: int, seed: int, quantity: str, order: int) -> Judged:
    """True over claimed errors of `count` drifts, for T or for 1 - P."""
    rng = np.random.default_rng(seed)
    centre = 0.0 if quantity == "1 - P" else _WELL
    asked, ratios = 0, []
    while asked < count:
        some = min(_AT_ONCE, count - asked)
        rows = drifts(some, order, rng, centre)
        kappa = 10.0 ** rng.uniform(-1.7, -0.3, some)
        for k in range(some):
            ratio = _ratio(sa.polynomial(*rows[:, k]), kappa[k], quantity, order)
            ratios += [ratio] if ratio is not None else []
        asked += some
    return Judged(asked, np.array(ratios))


def _ratio(drift: sa.Drift, kappa: float, quantity: str, order: int) -> float | None:
    """True over claimed error of one scene; None where it is refused."""
    options: dict[str, Any] = {"log": True}

    def ask(**more: Any) -> Any:
        """The quantity in an array of one, which says estimate."""
        noise = np.array([kappa])
        if quantity == "T":
            return sa.escape_time(drift, noise, 1.5, **options, **more)
        return sa.occupation(drift, noise, complement=True, **options, **more)

    try:
        claimed, exact = ask(method="laplace", order=order, full=True), ask()
    except sa.SymasymError:
        return None
    rounding = 1e-12 * max(1.0, abs(exact[0]))
    wrong = max(0.0, abs(claimed.value[0] - exact[0]) - rounding)
    return float(wrong / claimed.error[0])


def _median(ratios: FloatArray) -> float:
    return float(np.median(ratios)) if len(ratios) else 0.0


def main(arguments: list[str] | None = None) -> int:
    """Print how far the claims of some thousand drifts were wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drifts", type=int, default=1000, help="of each quantity and order")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args(arguments)
    worst = 0.0
    for quantity in ("1 - P", "T"):
        for order in (0, 1, 2):
            result = judged(options.drifts, options.seed, quantity, order)
            most = float(result.ratios.max(initial=0.0))
            worst = max(worst, most)
            print(
                f"{quantity}, order {order}: {len(result.ratios)} of {result.asked} answered, "
                f"true over claimed error: median {_median(result.ratios):.3g}, "
                f"largest {most:.3g}, "
                f"{(result.ratios > 1).sum()} above 1, {(result.ratios > 2).sum()} above 2"
            )
    return int(worst > 2)


if __name__ == "__main__":
    raise SystemExit(main())
