"""Numbers behind the errata of running text, captions and lists (see `derivations.evidence`)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

from derivations.evidence import Evidence, escape, friction, well_term
from derivations.numerics import Scene, pieces
from symasym.base.contexts import own_context


def radius_one() -> Evidence:
    """Escape from |u| <= 1 is not escape from |u| < r."""
    scene = friction("-2/5")
    return Evidence(
        "T at r = 10 (printed: escape from |u| <= 1)",
        {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "1", "r": "10"},
        escape(scene, "1", "1"),
        escape(scene, "1", "10"),
        escape(scene, "1", "10"),
    )


def both_ends() -> Evidence:
    """Escape through both ends against first passage to r alone, a = kappa = r = 1."""
    with own_context(40) as ctx:
        return Evidence(
            "T (printed: time to reach r)",
            {"A": "1", "kappa": "1", "r": "1"},
            ctx.one,
            pieces(ctx, Scene((Fraction(1),)), ctx.one, ctx.one).T,
            ctx.tanh(1),
        )


def caption_noise() -> Evidence:
    """log T of fig. 2's mu = 3 curve for unscaled kappa = 0.01 and 0.1, eps = 0.01."""
    scene = friction("-2/5")
    with own_context(40) as ctx:
        true = ctx.log(pieces(ctx, scene, ctx.mpf("0.1"), ctx.mpf(10)).T)
        other = ctx.log(pieces(ctx, scene, ctx.mpf(1), ctx.mpf(10)).T)
        term = ctx.log(well_term(ctx, scene, ctx.mpf("0.1")))
        return Evidence(
            "log T",
            {
                "mu": "3",
                "alpha": "1",
                "z0": "-2/5",
                "eps": "1/100",
                "kappa": "0.01 (text: 0.1)",
                "r": "1/10",
            },
            other,
            true,
            term,
            1e-2,
        )


def count_of_roots() -> Evidence:
    """Critical points inside |u| < 1, greatest number over z0 (exact root counts)."""
    import sympy

    u = sympy.Symbol("u")
    counts = []
    for tenths in range(-40, 60):
        z0 = sympy.Rational(tenths, 13)
        poly = sympy.Poly(1 - z0 - 4 * u + 3 * u**3, u)
        inside = poly.count_roots(-1, 1) - sum(poly.eval(x) == 0 for x in (-1, 1))
        counts.append(int(inside))
    # For |1 - z0| < alpha only the middle branch, else the peak is passed twice or not at all.
    return Evidence(
        "largest number of roots in (-1, 1)",
        {"mu": "3", "alpha": "1", "z0": "k/13, k = -40 ... 59"},
        3,
        max(counts),
        2,
    )


def other_crossing() -> Evidence:
    """z = 5/2 lies in no entry of the list, and crosses with a well."""
    scene = friction("5/2")
    with own_context(30) as ctx:
        same = int(scene.end(ctx, -1) * scene.end(ctx, 1) > 0)
        roots = len(scene.roots(ctx))
        return Evidence(
            "critical points at a crossing point z > 2 (printed: none listed)",
            {"mu": "3", "alpha": "1", "z": "5/2"},
            0,
            same * roots,
            2,
        )


def maximum_not_well() -> Evidence:
    """Second derivative of V(v) - V(u) at (u1, u2) along v: negative, a maximum."""
    scene = friction("-2/5")
    with own_context(30) as ctx:
        low, high = scene.roots(ctx)
        h = ctx.mpf("1e-6")
        f = [scene.V(ctx, high + j * h) for j in (-1, 0, 1)]
        curvature = (f[0] - 2 * f[1] + f[2]) / h**2
        return Evidence(
            "sign of the curvature of V(v) - V(u) at its critical point",
            {"mu": "3", "alpha": "1", "z0": "-2/5"},
            1,
            int(ctx.sign(curvature)),
            int(ctx.sign(-scene.phi(ctx, high, 1))),
        )


def slip_direction() -> Evidence:
    """y = 1/2: velocity of the block less that of the belt, the belt moving at -1."""
    y = Fraction(1, 2)
    block, belt = y - 1, Fraction(-1)
    return Evidence(
        "sign of the slip for y > 0 (left -1, right 1)",
        {"y": "1/2"},
        -1,
        1 if block - belt > 0 else -1,
        1,
    )


def breakaway_gap() -> Evidence:
    """beta at mu = 1/2, where neither printed branch applies (nan)."""
    with own_context(30) as ctx:
        force = [u + (u - u**3) / 2 for u in (ctx.mpf(k) / 1000 for k in range(1001))]
        mu = ctx.mpf(1) / 2
        return Evidence(
            "beta/alpha",
            {"mu": "1/2"},
            ctx.nan,
            max(force),
            2 * (1 + mu) ** 1.5 / (3 * ctx.sqrt(3 * mu)),
            1e-12,
        )


def breakaway_position() -> Evidence:
    """Position of the block at the fold z0 = -7/9, mu = 3: the double root of A."""
    import sympy

    u = sympy.Symbol("u")
    A = sympy.Rational(16, 9) - 4 * u + 3 * u**3
    (double,) = [root for root, count in sympy.roots(A, u).items() if count == 2]
    return Evidence(
        "u of the stuck block at the breakaway point",
        {"mu": "3", "alpha": "1", "z0": "-7/9"},
        0,
        float(double),
        ((1 + 3) / (3 * 3)) ** 0.5,
    )


def second_piece_order() -> Evidence:
    """Measured power of kappa in the second piece, strong noise."""
    from derivations.section6_crossing import strong_pieces

    with own_context(40) as ctx:
        small, large = (strong_pieces(ctx.mpf(k), ctx)[1] for k in ("1e3", "1e4"))
        order = ctx.log(large / small) / ctx.log(10)
        inputs = {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "10^3, 10^4", "r": "kappa^4"}
        return Evidence("power of kappa in the second piece", inputs, 2, order, -2, 1e-4)


def figures_agree() -> Evidence:
    """A point of figure 7 (ii): r/a+, which is eq:Ttildesmall without a well, and T."""
    scene = friction("-1/20", "1/2")
    with own_context(40) as ctx:
        printed = 10 / scene.end(ctx, 1)
    true = escape(scene, "1", "10")
    return Evidence(
        "T on figure 7 (ii) (printed: close to the dotted curve)",
        {"mu": "1/2", "alpha": "1", "z0": "-1/20", "eps": "1/100", "kappa": "1/10", "r": "1/10"},
        printed,
        true,
        true,
    )


def released_by_the_belt() -> Evidence:
    """Mean release time of eq:osc3 from (0, z0), simulated, against that without noise."""
    eps, kappa, r = 0.01, 0.1, 10.0
    return Evidence(
        "scaled mean time until |y| = r (derived: without noise)",
        {
            "mu": "3",
            "alpha": "1",
            "z0": "-2/5",
            "eps": "1/100",
            "kappa": "1/100",
            "r": "1/10",
        },
        escape(friction("-2/5"), "1/10", "10"),
        _oscillator(eps, kappa, r, paths=300),
        _oscillator(eps, 0.0, r, paths=1),
        0.1,
    )


def _oscillator(eps: float, kappa: float, r: float, paths: int, step: float = 0.01) -> float:
    """Mean release time of the oscillator from (0, -2/5), mu = 3, alpha = 1, by Euler-Maruyama."""
    normal = np.random.default_rng(20).standard_normal
    u, z, time = np.zeros(paths), np.full(paths, -0.4), 0.0
    total = 0.0
    while u.size:
        inside = np.clip(u, -1.0, 1.0)
        force = 1 - z - (inside + 3 * (inside - inside**3)) - eps * u
        z = z + step * eps * (eps * u - 1)
        u = u + step * force + kappa * np.sqrt(step) * normal(u.size)
        time += step
        stays = np.abs(u) < r
        total += time * float(np.count_nonzero(~stays))
        u, z = u[stays], z[stays]
    return total / paths
