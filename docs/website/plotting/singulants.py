"""The pictures of `docs/laplace.md` and `docs/expansions.md`: singulants, and errors by order."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import sympy
from flint import arb

import symasym as sa
from symasym.base.balls import precision
from symasym.integrals.borel import BITS, approximant, median_sum
from symasym.workshop.figures.style import style

Z0 = "-0.4"
KAPPA = "0.3"
TERMS = 31


def well() -> tuple[list[Any], Any, list[Any], Any]:
    """The well's coefficients, lam, the singulants of the other zeros, and its true integral.

    The quartic V goes on for ever: the real part of the integral from one complex valley over the
    well to another.
    """
    u = sympy.Symbol("u", real=True)
    A = sa.friction(mu=3, alpha=1, z0=Z0).expression()
    zeros = sorted(sympy.Poly(A, u).nroots(60))
    f = sympy.integrate(A, u)
    middles = [(a + b) / 2 for a, b in zip(zeros, zeros[1:], strict=False)]
    expansion = sa.laplace_integral(f, 1, u, *middles, TERMS, dps=60)
    lam = 2 / mpmath.mpf(KAPPA) ** 2
    rise = sympy.lambdify(u, f - f.subs(u, zeros[1]), "mpmath")
    points = [mpmath.mpf(str(z)) for z in zeros]
    turn = mpmath.expjpi(mpmath.mpf(1) / 4)
    path = [points[0] - k * turn for k in (3, 0.5, 0.2, 0)] + [points[1]]
    path += [points[2] + k * turn for k in (0, 0.2, 0.5, 3)]
    truth = mpmath.re(mpmath.quad(lambda z: mpmath.exp(lam * rise(z)), path))
    singulants = [-rise(points[k]) for k in (0, 2)]
    return list(expansion.contributions[0].coefficients), lam, singulants, truth


def draw() -> Any:
    """The Borel plane with singulants and Padé's poles, and both sums' errors by their terms."""
    from matplotlib.figure import Figure

    with mpmath.workdps(60):
        c, lam, singulants, truth = well()
        first = mpmath.mpf(1) / 2
        with precision(BITS):
            known = [arb(mpmath.nstr(a, 60)) for a in c]
            terms = [a / (arb(0.25) + k).gamma() for k, a in enumerate(known)]
            poles = approximant(terms[:21])[1]
        counts = range(1, TERMS + 1, 2)
        sums = [mpmath.fsum(a * lam ** -(first + k) for k, a in enumerate(c[:n])) for n in counts]
        with precision(BITS):
            large = arb(mpmath.nstr(lam, 60))
            found = (median_sum(known[:n], arb(0.5), large) for n in counts)
            medians = [mpmath.mpf(y.str(50, radius=False)) for y in found]
        errors = [[float(abs(y / truth - 1)) for y in row] for row in (sums, medians)]
        where = np.array([complex(p) for p, _ in poles])
    with style():
        figure = Figure(figsize=(7.4, 3.3))
        left, right = figure.subplots(1, 2)
        left.plot(where.real, where.imag, "x", label="Padé's poles (21 terms)")
        left.plot([float(s) for s in singulants], [0, 0], "o", mfc="none", ms=9, label="singulants")
        left.axhline(0, lw=0.5, color="0.6")
        left.set(xlabel=r"Re $t$", ylabel=r"Im $t$", title="(a) Borel plane")
        # All of them are real and positive, from the first singulant to beyond the second.
        left.set(xscale="log", xlim=(0.1, 5), ylim=(-1, 1), yticks=(-1, 0, 1))
        left.minorticks_off()
        left.set_xticks((0.1, 0.2, 0.5, 1, 2, 5), ("0.1", "0.2", "0.5", "1", "2", "5"))
        left.legend(loc="upper right")
        right.semilogy(counts, errors[0], marker=".", label="sum of the terms")
        right.semilogy(counts, errors[1], marker=".", label="median Borel–Padé")
        right.set(
            xlabel="number of terms", ylabel="relative error", title=rf"(b) $\kappa = {KAPPA}$"
        )
        right.legend()
        return figure


def by_order(count: int, orders: range = range(5)) -> tuple[Any, dict[int, Any]]:
    """kappa, and the relative error of T by each order of the weak-noise expansion."""
    drift = sa.friction(mu=3, alpha=1, z0="-0.6")
    kappas = np.geomspace(0.01, 0.2, count)
    exact = [sa.escape_time(drift, x, 10, dps=30) for x in kappas]
    errors = {}
    for order in orders:
        e = sa.expand(drift, "T", order=order)
        row = []
        for x, truth in zip(kappas, exact, strict=True):
            try:
                row.append(float(abs(e.evaluate(x, 10, dps=30) / truth - 1)))
            except sa.AccuracyError:
                row.append(np.nan)
        errors[order] = np.array(row)
    return kappas, errors


def draw_orders(count: int) -> Any:
    """Relative errors of orders 0 to 4 over kappa, with slopes between the two smallest kappa."""
    from matplotlib.figure import Figure

    kappas, errors = by_order(count)
    step = np.log(kappas[1] / kappas[0])
    with style():
        figure = Figure(figsize=(5.2, 3.6))
        axes = figure.subplots()
        for order, row in errors.items():
            slope = np.log(row[1] / row[0]) / step
            # The style has four colours.
            color = f"C{order}" if order < 4 else "black"
            label = f"order {order}: slope {slope:.2f}"
            axes.loglog(kappas, row, color=color, marker=".", label=label)
        axes.set(
            xlabel=r"noise amplitude $\kappa$", ylabel="relative error of $T$", title="$z_0 = -0.6$"
        )
        axes.legend()
        return figure
