"""The same escape times by widely used tools, for polynomial drifts and the start 0.

Each peer receives V in closed form, integrals split at -1, 0 and 1, and scaled exponentials.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from symasym.workshop.problems import Problem

_NODES = 32


def of(problem: Problem, quick: bool) -> Iterator[tuple[str, Callable[[], Any]]]:
    """The peers that apply to this scene, by name."""
    kappa, r = Fraction(problem.kappa), Fraction(problem.r)
    c = problem.make().exact_coefficients()
    if problem.start != "0" or r <= 1 or c is None:
        return
    for panels in (8, 16, 64):
        yield f"NumPy Gauss panels, {panels}", partial(by_numpy, c, kappa, r, panels)
    if kappa < Fraction(1, 5):
        return
    yield "mpmath.quad", partial(by_mpmath, c, kappa, r, 15)
    if not quick:
        yield "scipy dblquad", partial(by_scipy, c, kappa, r)
        yield "Arb", partial(by_arb, c, kappa, r, 20)


def _potentials(c: list[Any]) -> list[Callable[[Any], Any]]:
    """V on the left of -1, on [-1, 1] and on the right of 1 as entire functions; and V itself."""

    def value(c: list[Any], u: Any) -> Any:
        total = c[-1]
        for x in c[-2::-1]:
            total = total * u + x
        return total

    v = [0 * c[0], *(-x / (k + 1) for k, x in enumerate(c))]
    v[0] = -value(v, -1)
    low, high, top = value(c, -1), value(c, 1), value(v, 1)
    parts = [lambda u: -low * (u + 1), lambda u: value(v, u), lambda u: top - high * (u - 1)]
    return [*parts, lambda u: parts[0 if u < -1 else 1 if u < 1 else 2](u)]


def _time(lam: Any, single: Any, double: Any) -> Any:
    """eq:Ttilde with eq:C, from the integrals left and right of the start."""
    C = single[1] / (single[0] + single[1])
    return lam * ((1 - C) * double[1] - C * double[0])


def by_mpmath(c: list[Fraction], kappa: Fraction, r: Fraction, dps: int) -> Any:
    """T by nested `mpmath.quad`."""
    from mpmath import mp

    with mp.workdps(dps + 5):
        *_, V = _potentials([mp.convert(x) for x in c])
        lam, R = 2 / mp.convert(kappa) ** 2, mp.convert(r)

        def inner(v: Any) -> Any:
            cuts = [-R, *(x for x in (-1, 1) if x < v), v]
            return mp.quad(lambda u: mp.exp(lam * (V(v) - V(u))), cuts)

        sides = [-R, -1, 0], [0, 1, R]
        single = [mp.quad(lambda v: mp.exp(lam * V(v)), x) for x in sides]
        return _time(lam, single, [mp.quad(inner, x) for x in sides])


def by_scipy(c: list[Fraction], kappa: Fraction, r: Fraction) -> float:
    """T by `scipy.integrate.dblquad`."""
    from scipy.integrate import dblquad, quad

    (*_, V), lam, R = _potentials([float(x) for x in c]), 2 / float(kappa) ** 2, float(r)

    def kernel(u: float, v: float) -> float:
        return float(np.exp(lam * (V(v) - V(u))))

    def double(*cuts: float) -> float:
        return float(sum(
            dblquad(kernel, x, y, lo, partial(min, hi))[0]
            for x, y in pairwise(cuts)
            for lo, hi in ((-R, -1), (-1, 1), (1, R)) if lo < y
        ))  # fmt: skip

    sides = (-R, 0, -1), (0, R, 1)
    single = [quad(lambda v: np.exp(lam * V(v)), a, b, points=[kink])[0] for a, b, kink in sides]
    return float(_time(lam, single, [double(-R, -1, 0), double(0, 1, R)]))


def by_arb(c: list[Fraction], kappa: Fraction, r: Fraction, dps: int) -> Any:
    """T by nested `acb.integral`, which is rigorous."""
    from flint import acb, arb

    from symasym.base.balls import precision, rational, rounded

    with precision(int(3.4 * dps) + 40):
        parts = _potentials([arb(rational(x)) for x in c])
        lam, R, one, zero = arb(rational(2 / kappa**2)), arb(rational(r)), arb(1), arb(0)
        starts = -R, -one, one

        def integral(sign: int, k: int, a: Any, b: Any) -> Any:
            return acb.integral(lambda u, _: (sign * lam * parts[k](u)).exp(), a, b)

        def nested(k: int, a: Any, b: Any) -> Any:
            before = sum((integral(-1, j, starts[j], starts[j + 1]) for j in range(k)), acb(0))

            def outer(v: Any, _: Any) -> Any:
                return (lam * parts[k](v)).exp() * (before + integral(-1, k, starts[k], v))

            return acb.integral(outer, a, b)

        sides = [(0, -R, -one), (1, -one, zero)], [(1, zero, one), (2, one, R)]
        single = [sum((integral(1, *x) for x in side), acb(0)) for side in sides]
        double = [sum((nested(*x) for x in side), acb(0)) for side in sides]
        return rounded(_time(lam, single, double).real, dps)[0]


@np.errstate(all="ignore")  # overflow gives nan
def by_numpy(c: list[Fraction], kappa: Fraction, r: Fraction, panels: int) -> float:
    """T by Gauss panels in float64, with running integrals by one matrix and no logarithms."""
    x, w = np.polynomial.legendre.leggauss(_NODES)
    k = np.arange(_NODES)
    p = np.polynomial.legendre.legvander(x, _NODES)
    running = np.empty((_NODES, _NODES))
    running[:, 0] = x + 1
    running[:, 1:] = (p[:, 2:] - p[:, :-2]) / (2 * k[1:] + 1)
    running = running @ ((k[:, None] + 0.5) * p[:, :_NODES].T * w)
    parts, lam, R = _potentials([float(y) for y in c]), 2 / float(kappa) ** 2, float(r)
    before, single, double = 0.0, [0.0, 0.0], [0.0, 0.0]
    for low, high, V in zip((-R, -1.0, 1.0), (-1.0, 1.0, R), parts[:3], strict=True):
        ends = np.linspace(low, high, 2 * panels + 1)  # 0 among them
        h = (ends[1] - ends[0]) / 2
        for a in ends[:-1]:
            e = np.exp(lam * V(a + h * (x + 1)))
            side = int(a >= 0)
            single[side] += h * (w @ e)
            double[side] += h * (w @ (e * (before + h * (running @ (1 / e)))))
            before += h * (w @ (1 / e))
    return float(_time(lam, single, double))
