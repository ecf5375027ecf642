"""Numbers behind the errata: each function works out both sides at exact inputs."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from derivations.numerics import (
    SLIDING,
    WELL,
    Scene,
    boundary_value,
    outside_share,
    pieces,
    well_integral,
)
from symasym.base.call_context import own_context


@dataclass(frozen=True)
class Evidence:
    """A counterexample: exact inputs, what the print gives, what is true, what was derived.

    `printed`, `true`, `derived` are numbers of one quantity. `true` comes from the definition, or
    from an exact form where the two others are its approximations; `tolerance` is the relative
    error of the derived form at these inputs (it may be asymptotic).
    """

    quantity: str
    inputs: dict[str, str]
    printed: Any
    true: Any
    derived: Any
    tolerance: float = 1e-12

    def holds(self) -> bool:
        """The derived form agrees with the truth, the printed one does not by far."""
        gap = abs(self.derived - self.true)
        near = gap <= self.tolerance * abs(self.true)
        # "not <=" so that a printed formula without a value (nan) counts as far.
        far = not abs(self.printed - self.true) <= max(10 * gap, abs(self.true) / 10**6)
        return bool(near and far)


def friction(z0: str, mu: str = "3") -> Scene:
    return Scene.friction(mu, "1", z0)


def escape(scene: Scene, kappa: str, r: str) -> Any:
    with own_context(40) as ctx:
        return pieces(ctx, scene, ctx.mpf(kappa), ctx.mpf(r)).T


def well_term(ctx: Any, scene: Scene, kappa: Any) -> Any:
    low, high = scene.roots(ctx)
    slopes = -scene.phi(ctx, low, 1) * scene.phi(ctx, high, 1)
    return 2 * ctx.pi / ctx.sqrt(slopes) * ctx.exp(2 * barrier(ctx, scene) / kappa**2)


def barrier(ctx: Any, scene: Scene) -> Any:
    """V(u2) - V(u1)."""
    low, high = scene.roots(ctx)
    return scene.V(ctx, high) - scene.V(ctx, low)


def a_plus() -> Evidence:
    """T is r/a+ to leading order where there is no well."""
    scene = friction("-2/5", "1/2")
    with own_context(40) as ctx:
        true = pieces(ctx, scene, ctx.mpf(1), ctx.mpf(1000)).T
        return Evidence(
            "$T$, leading order $r/a^+$",
            {"mu": "1/2", "alpha": "1", "z0": "-2/5", "kappa": "1", "r": "1000"},
            1000 / ctx.mpf("2.4"),
            true,
            1000 / ctx.mpf("0.4"),
            2e-2,
        )


def amplitude() -> Evidence:
    """Variance of 3 X + 4 Y over the four outcomes of two fair coins, X, Y = 1 or -1."""
    outcomes = [3 * x + 4 * y for x in (-1, 1) for y in (-1, 1)]
    return Evidence(
        r"standard deviation of $B\,dW$ for unit time",
        {"B": "(3, 4)"},
        5**0.5,
        (sum(x * x for x in outcomes) / 4) ** 0.5,
        5.0,
    )


def noise_threshold() -> Evidence:
    """log T falls as kappa grows through the printed threshold."""
    scene = friction("-1/10")
    with own_context(40) as ctx:
        logs = [ctx.log(pieces(ctx, scene, ctx.mpf(k), ctx.mpf(10)).T) for k in ("0.2", "2")]
        low, high = (
            ctx.log(well_term(ctx, scene, ctx.mpf(k)) + 10 / scene.end(ctx, 1))
            for k in ("0.2", "2")
        )
        # The direction as a sign: log T(kappa = 0.2 layer units) against log T(2).
        return Evidence(
            r"sign of $\log T(\kappa_p = 0.02) - \log T(\kappa_p = 0.2)$",
            {"mu": "3", "alpha": "1", "z0": "-1/10", "eps": "1/100", "r_p": "1/10"},
            -1,
            int(ctx.sign(logs[0] - logs[1])),
            int(ctx.sign(low - high)),
        )


def noise_scale() -> Evidence:
    """d log T / d(1/kappa^2) from two small kappa, at eps = 1/50 over that at eps = 1/100."""
    scene = friction("-1/10")
    with own_context(60) as ctx:
        first, second = ctx.mpf("0.004"), ctx.mpf("0.0041")

        def slope(eps: Any) -> Any:
            logs = [ctx.log(well_integral(ctx, scene, k / ctx.sqrt(eps))) for k in (first, second)]
            return (logs[0] - logs[1]) / (1 / first**2 - 1 / second**2)

        return Evidence(
            r"$d\log T/d(1/\kappa_p^2)$, its ratio for $\varepsilon = 1/50$ and $1/100$",
            {"mu": "3", "alpha": "1", "z0": "-1/10", "kappa_p": "0.004 to 0.0041"},
            1,
            slope(ctx.mpf(1) / 50) / slope(ctx.mpf(1) / 100),
            2,
            1e-3,
        )


def threshold_constant() -> Evidence:
    """The noise at which eps T = 1, T scaled: 2/25, for the eps that is 1/T there."""
    scene = friction("-1/10")
    with own_context(40) as ctx:
        size = ctx.log(boundary_value(scene, 0.08, 10)[0])
        return Evidence(
            r"$\kappa_p/\sqrt\varepsilon$ at which $\varepsilon T = 1$",
            {"mu": "3", "alpha": "1", "z0": "-1/10", "eps": "$1/T = 10^{-41.7}$", "r": "10"},
            ctx.sqrt(1 / size),
            0.08,
            ctx.sqrt(2 * barrier(ctx, scene) / size),
            2e-2,
        )


def large_noise_time() -> Evidence:
    """T at large noise, against r/z and r/(-z0)."""
    return Evidence(
        "$T$",
        {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "1", "r": "1000"},
        1000 / -0.4,
        escape(friction("-2/5"), "1", "1000"),
        1000 / 0.4,
        2e-2,
    )


# A(u) = 3 (u + 19/20)(u - 3/5): a- = 0.24, V_max = 1.86 on [0, 1], a+ = 2.34.
STEEP = Scene((Fraction(-171, 100), Fraction(21, 20), Fraction(3)))


def C_hypothesis() -> Evidence:
    """log C where V_max <= r/4 holds, as printed, but V_max <= a- r/4 does not."""
    with own_context(60) as ctx:
        k, r = ctx.mpf("0.2"), ctx.mpf(10)
        found = pieces(ctx, STEEP, k, r)
        am, ap = STEEP.end(ctx, -1), STEEP.end(ctx, 1)
        bound = ctx.log(2 * am * (1 / ap + 2 / k**2)) - r * am / k**2
        _, high = STEEP.roots(ctx)
        top = STEEP.V(ctx, high)
        # Laplace on both sides of the start: what the size of C really is.
        slope = STEEP.phi(ctx, high, 1)
        derived = 2 * (top - am * (r - 1)) / k**2 + ctx.log(
            ctx.sqrt(ctx.pi * k**2 / slope) * 2 * am / k**2
        )
        return Evidence(
            r"$\log C$ (printed: its upper bound)",
            {"A": "3 (u + 19/20)(u - 3/5)", "kappa": "1/5", "r": "10"},
            bound,
            ctx.log(found.C),
            derived,
            0.05,
        )


def any_Delta() -> Evidence:
    """(1 + Delta)/(1 - Delta) <= 1 + 4 Delta fails for Delta = 3/4."""
    D = Fraction(3, 4)
    return Evidence(
        r"$(1 + \Delta)/(1 - \Delta)$ (printed: at most $1 + 4 \Delta$)",
        {"Delta": "3/4"},
        float(1 + 4 * D),
        float((1 + D) / (1 - D)),
        7.0,
    )


def slack_factor() -> Evidence:
    """The quotient of the two bounds of appendix A.2, their integrals as numbers."""
    with own_context(30) as ctx:
        am, ap, k, r, Delta = (ctx.mpf(x) for x in ("1.5", "0.5", "0.9", "7", "0.25"))
        # V = 0 on (-1, 1), so that V_max = 0: one integral from above, the other from below.
        above = 1 + ctx.quad(lambda w: ctx.exp(-2 * ap * w / k**2), [0, 2, ctx.inf])
        grown = ctx.exp(2 * am * r * (1 - Delta) / k**2)
        below = (
            (1 - Delta) * grown * ctx.quad(lambda w: ctx.exp(-2 * am * w / k**2), [0, 2, ctx.inf])
        )
        scale = am * (1 / ap + 2 / k**2) / grown
        return Evidence(
            "factor in front of the bound on $C$",
            {"a-": "3/2", "a+": "1/2", "kappa": "9/10", "r": "7", "Delta": "1/4"},
            5 / ctx.mpf(3),
            above / below / scale,
            4 / ctx.mpf(3),
        )


def exit_point() -> Evidence:
    """Chance of ever reaching -1 against that of leaving through -r; a = kappa = 1, r = 10."""
    with own_context(40) as ctx:
        return Evidence(
            "$C$ (printed: chance of escape through $-1$)",
            {"A": "1", "kappa": "1", "r": "10"},
            (1 - ctx.exp(-20)) / (ctx.exp(2) - ctx.exp(-20)),
            boundary_value(Scene((Fraction(1),)), 1.0, 10)[1],
            1 / (1 + ctx.exp(20)),
            1e-9,
        )


def _measured_order(relative: Any) -> Any:
    with own_context(60) as ctx:
        a, b = (abs(relative(ctx, ctx.mpf(k))) for k in ("0.01", "0.001"))
        return ctx.log(a / b) / ctx.log(10)


def well_order() -> Evidence:
    """The measured order of the correction to the well's term."""
    order = _measured_order(
        lambda ctx, k: well_integral(ctx, WELL, k) / well_term(ctx, WELL, k) - 1
    )
    return Evidence(
        "order of the relative correction",
        {"A": "3 (u + 1/5)(u - 3/5)(u + 2)", "kappa": "0.01, 0.001"},
        1,
        order,
        2,
        1e-2,
    )


def occupation_order() -> Evidence:
    """1 - P at kappa = 0.2: the print's O(kappa^2) scale against the sharp exponential."""
    with own_context(50) as ctx:
        k = ctx.mpf("0.1")
        (low,) = SLIDING.roots(ctx)
        bottom, end = SLIDING.V(ctx, low), SLIDING.V(ctx, ctx.mpf(1))
        sharp = (
            k
            * ctx.sqrt(-SLIDING.phi(ctx, low, 1))
            / (2 * ctx.sqrt(ctx.pi))
            * (
                ctx.exp(2 * bottom / k**2) / SLIDING.end(ctx, -1)
                - ctx.exp(2 * (bottom - end) / k**2) / SLIDING.end(ctx, 1)
            )
        )
        return Evidence(
            r"$\log(1 - P)$ (printed: order $\kappa^2$)",
            {"mu": "1", "alpha": "1", "z0": "1/2", "kappa": "1/10"},
            2 * ctx.log(k),
            ctx.log(outside_share(SLIDING, k, ctx)),
            ctx.log(sharp),
            1e-3,
        )


def near_fold() -> Evidence:
    """T just right of the fold, where the printed prefactor grows without bound."""
    return _by_the_exact_integral("-777/1000", "3", "1/10")


def near_edge() -> Evidence:
    """T with the barrier at the edge u = 1, z0 = -1/10000."""
    return _by_the_exact_integral("-1/10000", "3", "1/10")


def _by_the_exact_integral(z0: str, mu: str, kappa: str) -> Evidence:
    """T at r = 10: eq:Ttildesmall, the boundary-value problem, and eq:Ttilde."""
    scene = friction(z0, mu)
    with own_context(40) as ctx:
        k, r = ctx.mpf(Fraction(kappa).numerator) / Fraction(kappa).denominator, ctx.mpf(10)
        wells = well_term(ctx, scene, k) if len(scene.roots(ctx)) == 2 else 0
        return Evidence(
            "$T$ (derived: eq:Ttilde)",
            {"mu": mu, "alpha": "1", "z0": z0, "kappa": kappa, "r": "10"},
            wells + r / scene.end(ctx, 1),
            boundary_value(scene, float(Fraction(kappa)), 10)[0],
            pieces(ctx, scene, k, r).T,
            1e-5,
        )


def figures_agree() -> Evidence:
    """A point of figure 7 (ii), kappa_phys = 1/10: r/a+ is eq:Ttildesmall without a well."""
    return _by_the_exact_integral("-1/20", "1/2", "1")


def first_term() -> Evidence:
    """A point with a well at which its term is a small share of T."""
    scene = friction("-7/10")
    with own_context(40) as ctx:
        k, r = ctx.mpf(1), ctx.mpf(10)
        direct = 10 / float(scene.end(ctx, 1))
        return Evidence(
            "$T a^+/r$ (printed: large, derived: eq:Ttilde)",
            {"mu": "3", "alpha": "1", "z0": "-7/10", "kappa": "1", "r": "10"},
            float("inf"),
            boundary_value(scene, 1.0, 10)[0] / direct,
            pieces(ctx, scene, k, r).T / direct,
            1e-5,
        )


# Well at -4/5, barrier at -1/10, V(0) > V(u1): the start lies behind the barrier.
BEHIND = Scene((Fraction(8, 25), Fraction(18, 5), Fraction(4)))
# Roots -0.439 and -0.228, V(0) < V(u1): the same, and no well term at all.
HARMLESS = Scene((Fraction(3, 10), Fraction(2), Fraction(3)))


def behind_barrier() -> Evidence:
    """T from behind the barrier, where eq:S puts S = 0."""
    with own_context(60) as ctx:
        k, r = ctx.mpf("0.05"), ctx.mpf(10)
        low, _ = BEHIND.roots(ctx)
        term = (
            k
            * ctx.sqrt(-ctx.pi / BEHIND.phi(ctx, low, 1))
            / BEHIND.phi(ctx, ctx.zero)
            * ctx.exp(2 * (BEHIND.V(ctx, ctx.zero) - BEHIND.V(ctx, low)) / k**2)
        )
        ahead = r / BEHIND.end(ctx, 1)
        return Evidence(
            "$T$",
            {"A": "4 (u + 4/5)(u + 1/10)", "kappa": "1/20", "r": "10"},
            ahead,
            pieces(ctx, BEHIND, k, r).T,
            term + ahead,
            0.2,
        )


def harmless_well() -> Evidence:
    """A < 0 on an interval and yet T = O(r): the start is past it."""
    with own_context(60) as ctx:
        k, r = ctx.mpf("0.05"), ctx.mpf(10)
        ahead = r / HARMLESS.end(ctx, 1)
        return Evidence(
            "$T a^+/r$ (printed: without bound)",
            {"A": "3/10 + 2 u + 3 u^2", "kappa": "1/20", "r": "1000"},
            float("inf"),
            pieces(ctx, HARMLESS, k, 100 * r).T / (100 * ahead),
            1,
            2e-2,
        )


def far_radius() -> Evidence:
    """With r/eps large enough the well does not matter, however small kappa is beforehand."""
    scene = friction("-2/5")
    with own_context(60) as ctx:
        k, r = ctx.mpf("0.3"), ctx.mpf(10) ** 12
        return Evidence(
            "$T a^+/r$ (printed: without bound)",
            {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "3/10", "r": "10^12"},
            float("inf"),
            pieces(ctx, scene, k, r).T * scene.end(ctx, 1) / r,
            1,
            1e-3,
        )


def smooth_crossing() -> Evidence:
    """T - r/a+ for A = 3/2 + u/2 in weak noise: a constant, which is O(eps) unscaled."""
    scene = Scene((Fraction(3, 2), Fraction(1, 2)))
    with own_context(40) as ctx:
        true = pieces(ctx, scene, ctx.mpf("0.02"), ctx.mpf(10)).T - ctx.mpf(10) / 2
        return Evidence(
            "$T - r/a^+$ (printed: 0 in the limit)",
            {"A": "3/2 + u/2", "kappa": "1/50", "r": "10"},
            ctx.zero,
            true,
            2 * ctx.log(ctx.mpf(4) / 3) - ctx.mpf(1) / 2,
            1e-2,
        )


def weak_outward_drift() -> Evidence:
    """Constant drifts 1/20 and 1/2 at the same a r: the constants of O(kappa^2/r)."""
    a, b = Fraction(1, 20), Fraction(1, 2)

    def constant(drift: Fraction, r: int) -> float:
        T, _ = boundary_value(Scene((drift,)), 1.0, r)
        return r * abs(1 - float(drift) * T / r)

    return Evidence(
        r"$(1 - T a^+/r)\,r/\kappa^2$ at $a^+ r = 1$, its ratio for $a^+ = 1/20$ and $1/2$",
        {"A": "1/20, 1/2", "kappa": "1", "r": "20, 2"},
        1,
        constant(a, 20) / constant(b, 2),
        float(b / a),
        1e-6,
    )


def comparison_with_sqrt_eps() -> Evidence:
    """kappa = 10 eps and the well not overcome: log T."""
    scene = friction("-2/5")
    with own_context(40) as ctx:
        k = ctx.mpf(1) / 10
        return Evidence(
            r"$\log T$ (printed: Filippov's $r/a^+$; derived: eq:Ttildesmall)",
            {
                "mu": "3",
                "alpha": "1",
                "z0": "-2/5",
                "eps": "10^-4",
                "kappa_p": "10^-3",
                "r_p": "10^-3",
            },
            ctx.log(10 / scene.end(ctx, 1)),
            ctx.log(boundary_value(scene, 0.1, 10)[0]),
            ctx.log(well_term(ctx, scene, k) + 10 / scene.end(ctx, 1)),
            1e-3,
        )


def no_well() -> Evidence:
    """T in weak noise without a well, which eq:Ttildesmall gives as r/a+."""
    scene = friction("-2/5", "1/2")
    with own_context(40) as ctx:
        direct = 10 / float(scene.end(ctx, 1))
        return Evidence(
            "$T a^+/r$ (printed: exponentially large)",
            {"mu": "1/2", "alpha": "1", "z0": "-2/5", "kappa": "1/10", "r": "10"},
            float("inf"),
            boundary_value(scene, 0.1, 10)[0] / direct,
            1,
            0.2,
        )
