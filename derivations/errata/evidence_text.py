"""Numbers behind the errata of running text, captions and lists (see `evidence` beside it)."""

from __future__ import annotations

from fractions import Fraction

import numpy as np

import symasym as sa
from derivations.errata.evidence import Evidence, escape, friction, well_term
from derivations.numerics import (
    Scene,
    boundary_value,
    integral,
    outside,
    pieces,
    uniform,
    well_integral,
)
from symasym.base.call_context import own_context
from symasym.base.inputs import FloatArray


def radius_one() -> Evidence:
    """Escape from |u| <= 1 is not escape from |u| < r: both boundary-value problems."""
    scene = friction("-2/5")
    return Evidence(
        r"$T$ (printed: from $\lvert u\rvert \le 1$; derived: eq:Ttilde)",
        {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "1", "r": "10"},
        boundary_value(scene, 1.0, 1)[0],
        boundary_value(scene, 1.0, 10)[0],
        escape(scene, "1", "10"),
        1e-6,
    )


def both_ends() -> Evidence:
    """Escape through both ends against first passage to r alone, a = kappa = r = 1."""
    with own_context(40) as ctx:
        return Evidence(
            "$T$ (printed: time to reach $r$)",
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
            r"$\log T$",
            {
                "mu": "3",
                "alpha": "1",
                "z0": "-2/5",
                "eps": "1/100",
                "kappa_p": "0.01 (text: 0.1)",
                "r_p": "1/10",
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
        "largest number of roots in $(-1, 1)$",
        {"mu": "3", "alpha": "1", "z0": "k/13, k from -40 to 59"},
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
            "critical points at a crossing point $z > 2$ (printed: not in the list)",
            {"mu": "3", "alpha": "1", "z": "5/2"},
            float("nan"),
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
            "sign of the curvature of $V(v) - V(u)$ at its critical point",
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
        "sign of the slip for $y > 0$ (left $-1$, right 1)",
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
            r"$\beta/\alpha$",
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
        "$u$ of the stuck block at the breakaway point",
        {"mu": "3", "alpha": "1", "z0": "-7/9"},
        0,
        float(double),
        ((1 + 3) / (3 * 3)) ** 0.5,
    )


def second_piece_order() -> Evidence:
    """Measured power of kappa in the second piece, strong noise."""
    from derivations.sections.section6.crossing import strong_pieces

    with own_context(40) as ctx:
        small, large = (strong_pieces(ctx.mpf(k), ctx)[1] for k in ("1e3", "1e4"))
        order = ctx.log(large / small) / ctx.log(10)
        inputs = {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "10^3, 10^4", "r": r"$\kappa^4$"}
        return Evidence(r"power of $\kappa$ in the second piece", inputs, 2, order, -2, 1e-4)


def released_by_the_belt() -> Evidence:
    """Mean release time of eq:osc3 from (0, z0), marched, against that without noise."""
    block = sa.oscillator(mu=3, alpha=1)
    whole = sa.release(
        block, "1/10", 10, eps="1/100", start=(0, "-2/5"), method="march", rtol="1e-9"
    )
    return Evidence(
        r"mean time until $\lvert u\rvert = r$ (derived: without noise)",
        {
            "mu": "3",
            "alpha": "1",
            "z0": "-2/5",
            "eps": "1/100",
            "kappa_p": "1/100",
            "r_p": "1/10",
        },
        escape(friction("-2/5"), "1/10", "10"),
        whole.mean,
        _without_noise(0.01, 10.0, -0.4),
        0.1,
    )


def _without_noise(eps: float, r: float, z: float, step: float = 1 / 256) -> float:
    """Scaled time until u = r from (0, z), mu = 3 and alpha = 1, by Runge and Kutta's method."""

    def field(at: FloatArray) -> FloatArray:
        """The velocity of (u, z)."""
        inside = min(max(at[0], -1.0), 1.0)
        force = 1 - at[1] - (inside + 3 * (inside - inside**3)) - eps * at[0]
        return np.array([force, eps * (eps * at[0] - 1)])

    state, time = np.array([0.0, z]), 0.0
    while state[0] < r:
        before = state
        first = field(state)
        second = field(state + step / 2 * first)
        third = field(state + step / 2 * second)
        fourth = field(state + step * third)
        state = state + step / 6 * (first + 2 * (second + third) + fourth)
        time += step
    # The path is all but straight within the last step.
    return float(time - step * (state[0] - r) / (state[0] - before[0]))


def example_radius() -> Evidence:
    """kappa/r at the least noise that is strong, kappa = sqrt(eps), with section 7.3's numbers."""
    eps, r = Fraction(1, 100), Fraction(1, 10)
    noise = float(eps) ** 0.5
    # eq:eekappar: scaled r/kappa^2 is r_phys/kappa_phys^2.
    scaled = (r / eps) / 1**2
    return Evidence(
        r"$\kappa_p/r_p$ at $\kappa_p = \sqrt\varepsilon$ (printed: small)",
        {"eps": "1/100", "r_p": "1/10"},
        0,
        noise / float(r),
        1 / (noise * float(scaled)),
    )


def remaining() -> Evidence:
    """Sliding: the chance to be in the layer at late times, and that never to have left it."""
    scene = Scene.friction("1", "1", "1/2")
    first_exit, _ = boundary_value(scene, 1.0, 1)
    with own_context(30) as ctx:
        inside = integral(
            ctx, lambda u: ctx.exp(-2 * scene.V(ctx, u)), uniform(ctx, -1, 1, ctx.mpf(1) / 4)
        )
        derived = inside / (inside + outside(ctx, scene, ctx.one))
    return Evidence(
        r"chance of $\lvert u\rvert \le 1$ at 100 mean times of the first exit (printed: at most, "
        "by Markov)",
        {"mu": "1", "alpha": "1", "z0": "1/2", "kappa": "1"},
        first_exit / (100 * first_exit),
        _long_run(scene),
        derived,
        1e-3,
    )


def _long_run(scene: Scene, step: float = 0.01, far: float = 12.0) -> float:
    """Share of |u| <= 1 in the equilibrium of a random walk with the drift's bias, kappa = 1.

    Steps of sqrt(dt) to the right with probability (1 + phi sqrt(dt))/2: detailed balance.
    """
    size = int(far / step)
    at = [step * k for k in range(-size, size + 1)]
    coefficients = [float(c) for c in scene.coefficients]

    def right(u: float) -> float:
        inside = max(min(u, 1.0), -1.0)
        return (1 + step * sum(c * inside**k for k, c in enumerate(coefficients))) / 2

    weights = [1.0]
    for u, v in zip(at, at[1:], strict=False):
        weights.append(weights[-1] * right(u) / (1 - right(v)))
    # An end of the layer counts half.
    shares = [0.5 if abs(abs(u) - 1) < step / 2 else float(abs(u) < 1) for u in at]
    return sum(w * s for w, s in zip(weights, shares, strict=True)) / sum(weights)


def stuck_block() -> Evidence:
    """A stuck block moves with the belt: its displacement relative to the belt does not change."""
    spring, belt = Fraction(-1), Fraction(-1)  # z and the belt after unit time, y = z' + 1 = 0
    return Evidence(
        "displacement of a stuck block relative to the belt after unit time (printed: $z$)",
        {"y": "0", "z": "0 at the start"},
        spring,
        spring - belt,
        0,
    )


def which_term() -> Evidence:
    """What the neighbourhood of (u1, u2) contributes to T."""
    scene = friction("-2/5")
    with own_context(40) as ctx:
        k = ctx.mpf("0.05")
        return Evidence(
            "contribution of the neighbourhood of $(u_1, u_2)$ to $T$ (printed: second term)",
            {"mu": "3", "alpha": "1", "z0": "-2/5", "kappa": "1/20", "r": "10"},
            10 / scene.end(ctx, 1),
            well_integral(ctx, scene, k),
            well_term(ctx, scene, k),
            1e-2,
        )


def not_enough_for_the_integral() -> Evidence:
    """Two drifts with the a+, u_i and A'(u_i) of fr1 and fr2, and different T."""
    first = friction("-1/2")
    with own_context(30) as ctx:
        low, high = (float(x) for x in first.roots(ctx))
    # Added: (1 - u)(u - u1)^2 (u - u2)^2, which changes none of those numbers.
    bump = np.polynomial.polynomial.polyfromroots([1.0, low, low, high, high])
    inside = [float(c) for c in first.coefficients]
    other = Scene(
        tuple(Fraction(float(c + (inside[k] if k < 4 else 0.0))) for k, c in enumerate(-bump))
    )
    with own_context(30) as ctx:
        times = [pieces(ctx, scene, ctx.mpf("0.5"), ctx.mpf(10)).T for scene in (first, other)]
    direct = [boundary_value(scene, 0.5, 10)[0] for scene in (first, other)]
    return Evidence(
        "$T$ of two drifts with equal $a^+$, $u_i$ and $A'(u_i)$, their ratio (derived: eq:Ttilde)",
        {
            "A": r"$3/2 - 4u + 3u^3$, and with $(1 - u)(u - u_1)^2 (u - u_2)^2$ more",
            "kappa": "1/2",
        },
        1,
        direct[1] / direct[0],
        times[1] / times[0],
        1e-6,
    )


def cubic_without_well() -> Evidence:
    """Zeros of the drift in the layer at mu = 1/2, z0 = -k/10 (exact root counts)."""
    import sympy

    u = sympy.Symbol("u")
    counts = [
        sympy.Poly(1 + sympy.Rational(k, 10) - u - (u - u**3) / 2, u).count_roots(-1, 1)
        for k in range(1, 40)
    ]
    return Evidence(
        "critical points in the layer (printed: a well and a barrier)",
        {"mu": "1/2", "alpha": "1", "z0": "-k/10, k from 1 to 39"},
        2,
        max(counts),
        0,
    )
