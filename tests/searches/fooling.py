"""A search for drifts that fool the estimates of weak noise: `python -m tests.searches.fooling`.

The truncation error after N terms is judged by what follows. Here drifts are drawn at random, but
for two coefficients, which are chosen so that the next two terms of one series nearly vanish: that
of a well, of a start (on a zero of A as well), of a kink, of an end r < 1 or of the regular part.
What the others do is felt in later terms alone. With `--analytic` A is such a polynomial and a
multiple of t^m exp(c t^2) or its like, t from where the terms vanish. T, C or 1 - P by Laplace is
compared with the exact one; a scene counts where the claim is an estimate and above rounding.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import partial
from math import factorial
from typing import Any, NamedTuple

import numpy as np
from numpy.polynomial import Polynomial, polynomial

import symasym as sa
from symasym.base.inputs import FloatArray

_DEGREE = 12
_LARGEST = 30
# Of a tail's Taylor series: to rounding in the layer.
_TERMS = 60
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(80)


class Scene(NamedTuple):
    """A quantity, and what it is asked of."""

    quantity: str
    drift: sa.Drift
    r: float = 1.5
    start: float = 0.0


class Tail(NamedTuple):
    """What A has besides a polynomial: a function of t, as text and its Taylor coefficients."""

    text: str
    taylor: FloatArray


class Judged(NamedTuple):
    """True over claimed errors, and the claims, of the scenes that were answered."""

    asked: int
    ratios: FloatArray
    claims: FloatArray


# -- drifts ----------------------------------------------------------------------------------------


class Drawn(NamedTuple):
    """A = sum c_k t^k + tail(t), t = u - centre; c ascends, the tail has its own Taylor series."""

    c: FloatArray
    tail: Tail | None
    centre: float

    def drift(self) -> sa.Drift:
        """The drift."""
        if self.tail is None:
            return sa.polynomial(*_about(self.c, self.centre))
        t = f"(u - ({self.centre!r}))"
        powers = [f"({x!r})*{t}**{k}" for k, x in enumerate(self.c.tolist()) if x]
        return sa.Drift(" + ".join([*powers, self.tail.text.replace("t", t)]))

    def values(self, t: FloatArray) -> FloatArray:
        """A at these t."""
        return polynomial.polyval(t, polynomial.polyadd(self.c, _taylor(self.tail)))


def tail(rng: np.random.Generator, least: int) -> Tail:
    """A multiple of t^m times exp or sin of a power of t, m >= `least`."""
    m, name, power = rng.integers(least, 10), rng.choice(["exp", "sin"]), rng.integers(1, 3)
    front, c = rng.normal() * 10.0 ** rng.uniform(-2, 0), rng.uniform(0.1, 1)
    front, c = float(f"{front:.3g}"), float(f"{c:.3g}")
    taylor = np.zeros(_TERMS)
    for k in range(_TERMS):
        if m + power * k < _TERMS and (name == "exp" or k % 2):
            sign = -1 if name == "sin" and k % 4 == 3 else 1
            taylor[m + power * k] = sign * front * c**k / factorial(k)
    return Tail(f"({front!r})*t**{m}*{name}({c!r}*t**{power})", taylor)


def _taylor(tail: Tail | None, count: int = _TERMS) -> FloatArray:
    """The first Taylor coefficients of a tail, or zeros."""
    return np.zeros(count) if tail is None else tail.taylor[:count]


# -- series whose next two terms nearly vanish -----------------------------------------------------


def at_well(
    order: int, rng: np.random.Generator, centre: float, tail: Tail | None = None, odd: int = 0
) -> Drawn | None:
    """A with a well at `centre`, or None where the draw is of no use.

    V = t^2/2 (1 + sum alpha_j t^j), t = u - centre; A < 0 right of the well and > 0 left of it.
    The next two terms of the whole Gaussian vanish, or with `odd` = 1 those that its halves have
    besides.
    """
    bends = np.arange(3, _DEGREE + 3)
    others = -2 * _taylor(tail, _DEGREE + 2)[2:] / bends
    alpha = _drawn(rng, _DEGREE) + others
    if odd and rng.integers(2):
        alpha[1::2] *= 10.0 ** rng.uniform(-12, -4)
    for i in (2 * order + 2 + odd, 2 * order + 4 + odd):
        if i <= _DEGREE:
            alpha[i - 1] = 0.0
            # Linear in alpha_i, with the factor -(i + 1)/2.
            vanishing = _coefficient(alpha, i) / ((i + 1) / 2)
            alpha[i - 1] = vanishing * (1 + 10.0 ** rng.uniform(-9, -2))
    alpha -= others
    found = Drawn(-np.array([0.0, 2, *bends * alpha]) / 2, tail, centre)
    t = np.linspace(-1 - centre, 1 - centre, 400)
    if (found.values(t) * np.sign(t) >= -1e-3 * np.abs(t)).any():
        return None
    return found if np.abs(alpha).max() <= _LARGEST else None


def at_point(
    order: int, rng: np.random.Generator, centre: float, tail: Tail | None = None
) -> Drawn | None:
    """The same with A of one sign, or in half of the draws any A, and h_k at `centre` vanishing."""
    others = _taylor(tail, _DEGREE + 1)
    c = _drawn(rng, _DEGREE + 1) + others
    c[0] = rng.choice([-1, 1]) * 10.0 ** rng.uniform(-0.5, 0.5)
    for n in (order + 1, order + 2):
        c[n] = 0.0
        # Linear in c_n, with the factor -n! (-1/c_0)^n/c_0^2.
        vanishing = _endpoint(c, n + 1)[n] * (-c[0]) ** n * c[0] ** 2 / factorial(n)
        c[n] = vanishing * (1 + 10.0 ** rng.uniform(-9, -2))
    found, sign = Drawn(c - others, tail, centre), np.sign(c[0])
    values = found.values(np.linspace(-1 - centre, 1 - centre, 400))
    looked_at = values if rng.integers(2) else values[[0, -1]] * np.sign(values[[0, -1]] * c[0])
    if (looked_at * sign < 0.05).any() or np.abs(c).max() > _LARGEST:
        return None
    return found


def between(
    order: int, rng: np.random.Generator, lo: float, hi: float, tail: Tail | None = None
) -> Drawn | None:
    """The same with A > 0 and the integrals of h_k over [lo, hi] vanishing, by Newton."""
    c = rng.normal(size=rng.integers(4, 10))
    c *= 10.0 ** rng.uniform(-1.5, 0.5, len(c))
    u = np.linspace(-1, 1, 300)
    c[0] += 10.0 ** rng.uniform(-1.5, 0.5) - Drawn(c, tail, 0.0).values(u).min()
    free = rng.choice(len(c), 2, replace=False)

    def vanishing(c: FloatArray) -> FloatArray:
        whole = np.trim_zeros(polynomial.polyadd(c, _taylor(tail)), "b")
        rows = _endpoint(whole, order + 3, (lo + hi) / 2 + (hi - lo) / 2 * _NODES)
        return np.array([(_WEIGHTS * row).sum() for row in rows[-2:]])

    for _ in range(30):
        now, slopes = vanishing(c), np.empty((2, 2))
        for k, j in enumerate(free):
            moved = c.copy()
            moved[j] += 1e-6 * max(1, abs(c[j]))
            slopes[:, k] = (vanishing(moved) - now) / (moved[j] - c[j])
        if not np.isfinite(slopes).all() or np.linalg.matrix_rank(slopes) < 2:
            return None
        step = np.linalg.solve(slopes, -now)
        step *= min(1, 0.3 / np.abs(step).max())
        c[free] += step
        if Drawn(c, tail, 0.0).values(u).min() < 0.02 or np.abs(c).max() > _LARGEST:
            return None
        if np.abs(step).max() < 1e-11:
            c[free] *= 1 + 10.0 ** rng.uniform(-10, -2.5, 2)
            return Drawn(c, tail, 0.0)
    return None


def _drawn(rng: np.random.Generator, count: int) -> FloatArray:
    """Coefficients of all sizes, most of them 0."""
    size = 10.0 ** rng.uniform(-4, 0.5, count) * rng.choice([-1, 1], count)
    return np.where(rng.random(count) < 0.4, size, 0.0)


def _about(c: FloatArray, centre: float) -> FloatArray:
    """Coefficients in u from those in u - centre."""
    return Polynomial(c)(Polynomial([-centre, 1.0])).coef


def _endpoint(c: FloatArray, count: int, u: Any = 0.0) -> list[Any]:
    """h_1 = 1/A, h_(k + 1) = -h_k'/A at u, up to h_count, as numerators over A^(2k - 1)."""
    A, top = Polynomial(c), Polynomial([1.0])
    found = []
    for k in range(1, count + 1):
        found.append(top(u) / A(u) ** (2 * k - 1))
        top = (2 * k - 1) * top * A.deriv() - top.deriv() * A
    return found


def _coefficient(alpha: FloatArray, i: int) -> float:
    """[t^i] (1 + sum alpha_j t^j)^(-(i + 1)/2), by the binomial series."""
    inner = np.concatenate(([0.0], alpha))[: i + 1]
    total, power, factor = 0.0, np.eye(1, i + 1)[0], 1.0
    for m in range(i + 1):
        total += factor * power[-1]
        power = np.convolve(power, inner)[: i + 1]
        factor *= (-(i + 1) / 2 - m) / (m + 1)
    return float(total)


# -- scenes ----------------------------------------------------------------------------------------

Draw = Callable[[int, np.random.Generator, bool], Scene | None]


def _well(
    quantity: str, centre: float, order: int, rng: np.random.Generator, analytic: bool
) -> Scene | None:
    found = at_well(order, rng, centre, tail(rng, 2) if analytic else None)
    return None if found is None else Scene(quantity, found.drift())


def _on_zero(
    quantity: str, sign: int, odd: int, order: int, rng: np.random.Generator, analytic: bool
) -> Scene | None:
    """A start on the well, or with `sign` -1 on the barrier."""
    found = at_well(order, rng, 0.0, tail(rng, 2) if analytic else None, odd)
    if found is None:
        return None
    if sign > 0:
        return Scene(quantity, found.drift())
    return Scene(quantity, sa.Drift(f"-({found.drift().expression()})"), 0.9)


def _point(
    quantity: str, where: str, order: int, rng: np.random.Generator, analytic: bool
) -> Scene | None:
    u = float(rng.choice([-1, 1])) * (1 if where == "kink" else rng.uniform(0.1, 0.9))
    found = at_point(order, rng, u, tail(rng, 1) if analytic else None)
    if found is None:
        return None
    drift = found.drift()
    if where == "start":
        return Scene(quantity, drift, start=u)
    r = abs(u) if where == "end" else 1.5
    return Scene(quantity, drift, r, rng.uniform(-0.9, 0.9) * min(r, 1))


def _regular(order: int, rng: np.random.Generator, analytic: bool) -> Scene | None:
    r = rng.uniform(0.5, 0.95)
    start = rng.uniform(-0.9, 0.3) * r
    found = between(order, rng, start, r, tail(rng, 0) if analytic else None)
    return None if found is None else Scene("T", found.drift(), r, start)


SEARCHES: dict[str, Draw] = {
    "1 - P, well": partial(_well, "1 - P", 0.0),
    "T, well": partial(_well, "T", -0.25),
    **{
        f"{quantity}, {where}": partial(_point, quantity, where)
        for where in ("start", "kink", "end")
        for quantity in ("T", "C", "1 - C")
    },
    "T, regular part": _regular,
    "T, start on a well": partial(_on_zero, "T", 1, 0),
    "T, start on a barrier": partial(_on_zero, "T", -1, 0),
    "T, start on a barrier, odd terms": partial(_on_zero, "T", -1, 1),
    "C, start on a barrier, odd terms": partial(_on_zero, "C", -1, 1),
}


def judged(
    count: int,
    seed: int,
    search: str,
    order: int,
    analytic: bool = False,
    method: str = "laplace",
) -> Judged:
    """True over claimed errors of `count` drifts of one of the `SEARCHES`."""
    rng = np.random.default_rng(seed)
    asked, found = 0, []
    while asked < count:
        scene = SEARCHES[search](order, rng, analytic)
        if scene is not None:
            one = _judged(scene, 10.0 ** rng.uniform(-1.7, -0.2), order, method)
            found += [one] if one is not None else []
            asked += 1
    ratios, claims = np.array(found).reshape(-1, 2).T
    return Judged(asked, ratios, claims)


def _judged(scene: Scene, kappa: float, order: int, method: str) -> tuple[float, float] | None:
    """True over claimed error of one scene, and the claim; None where it is refused."""
    drift, quantity = scene.drift, scene.quantity

    def ask(**more: Any) -> Any:
        """The quantity in an array of one, which says estimate."""
        noise, options = np.array([kappa]), {"log": True, **more}
        if "P" in quantity:
            if method == "uniform":
                # Which has no arrays of it, and no bounds.
                noise = kappa
            return sa.occupation(drift, noise, complement=True, **options)
        options |= {"start": scene.start}
        if quantity == "T":
            return sa.escape_time(drift, noise, scene.r, **options)
        complement = quantity == "1 - C"
        return sa.exit_probability(drift, noise, scene.r, complement=complement, **options)

    try:
        claimed, exact = ask(method=method, order=order, full=True), ask()
    except sa.SymasymError:
        return None
    value, error, exact = (float(np.squeeze(x)) for x in (claimed.value, claimed.error, exact))
    wrong = max(0.0, abs(value - exact) - 1e-12 * max(1.0, abs(exact)))
    return wrong / error, error


def _median(numbers: FloatArray) -> float:
    return float(np.median(numbers)) if len(numbers) else 0.0


def main(arguments: list[str] | None = None) -> int:
    """Print how far the claims of some thousand drifts were wrong."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--drifts", type=int, default=1000, help="of each search and order")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--analytic", action="store_true", help="drifts that are no polynomials")
    parser.add_argument("--method", choices=("laplace", "uniform"), default="laplace")
    options = parser.parse_args(arguments)
    worst = 0.0
    for search in SEARCHES:
        for order in (0, 1, 2):
            result = judged(
                options.drifts, options.seed, search, order, options.analytic, options.method
            )
            most = float(result.ratios.max(initial=0.0))
            worst = max(worst, most)
            print(
                f"{search}, order {order}: {len(result.ratios)} of {result.asked} answered, "
                f"true over claimed error: median {_median(result.ratios):.3g}, "
                f"largest {most:.3g}, "
                f"{(result.ratios > 1).sum()} above 1, {(result.ratios > 2).sum()} above 2; "
                f"claims: median {_median(result.claims):.3g}",
                flush=True,
            )
    return int(worst > 2)


if __name__ == "__main__":
    raise SystemExit(main())
