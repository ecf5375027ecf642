"""Plots of definitions and scalings, from the derivations' own expressions.

Each is drawn beside values that the engines, or a computation of another kind, have of it.
"""

from __future__ import annotations

from typing import Any

import numpy as np

import symasym as sa
from derivations.sections.section4_reduction import REGIONS
from symasym.generated import numpy_formulas as emitted
from website.plotting import pieces
from website.plotting.plots import Picture, Plot
from website.plotting.symbolic import along, of, parts, value

#: Labels with nothing to plot, and why.
NOTHING = {
    "eq:cont": "it is a condition on the fields of any system",
    "eq:scaledSDEx": "it holds the fields of any system; of the friction oscillator they are "
    "eq:phifric0, which is plotted there",
    "eq:reducedSDE": "it puts together what is plotted with eq:phi and noise-amplitude",
}
_OSCILLATOR = "friction, μ = 3, α = 1"


def all_plots() -> tuple[Plot, ...]:
    """Those of this module."""
    return (*_fields(), *_scalings(), *_friction(), *_zeros())


def pictures() -> tuple[Picture, ...]:
    """What has no value to be compared with."""
    return (_regions(), _path(), _stick_slip(), _multiplier())


# -- fields, and what follows from them ------------------------------------------------------------


def _fields() -> list[Plot]:
    above = np.linspace(-3, -0.1, 60)
    u = np.linspace(-2, 2, 161)
    tanh = sa.tanh(1, -1, 5)
    phi = sa.emit("eq:phi", "numpy", drift=tanh).load().phi
    near = np.logspace(-6, -1.5, 60)
    # The friction oscillator above its layer: the field at (r, z) and the one at the surface.
    field = value("eq:osc2", 1, F=lambda y: 1.0)
    return [
        Plot(
            "filippov", "sliding velocity", "a⁻ = 1, g⁻ = 1/2, g⁺ = 2", above, _tangent,
            along(value("filippov"), "a_plus", a_minus=1, g_minus=0.5, g_plus=2), "a⁺",
            logs=False, log_x=False,
        ),
        Plot(
            "eq:scaledSDE", "field across the surface", f"{_OSCILLATOR}, z = -2/5, above the layer",
            near, lambda r: np.log(field(y=r, z=-0.4)),
            lambda r: np.log(value("eq:scaledSDE")(f_0=field(y=0.0, z=-0.4)) + 0 * r),
            "distance from the surface",
        ),
        Plot(
            "noise-amplitude", "amplitude", "b₂ = 1, b₃ = 2", np.linspace(-4, 4, 60), _deviation,
            along(value("noise-amplitude"), "b1", b2=1, b3=2), "b₁", logs=False, log_x=False,
        ),
        Plot(
            "eq:phi", "ϕ", "tanh, a⁻ = 1, a⁺ = -1, b = 5", u,
            lambda u: -np.tanh(5 * np.clip(u, -1, 1)) / np.tanh(5), phi, "u", False, False,
        ),
    ]  # fmt: skip


def _tangent(above: Any) -> Any:
    """The mean of both fields that does not leave the surface, its share by bisection."""
    low, high = np.zeros(len(above)), np.ones(len(above))
    for _ in range(60):
        share = (low + high) / 2
        out = share * above + (1 - share) * 1 > 0
        low, high = np.where(out, share, low), np.where(out, high, share)
    return low * 2 + (1 - low) * 0.5


def _deviation(first: Any) -> Any:
    """The deviation of a sum of three normal variables, by quadrature in all three."""
    x, w = np.polynomial.hermite_e.hermegauss(6)
    w = w / w.sum()
    a, b, c = np.meshgrid(x, x, x, indexing="ij")
    weight = w[:, None, None] * w[:, None] * w
    return np.array([np.sqrt(np.sum(weight * (one * a + b + 2 * c) ** 2)) for one in first])


# -- scalings --------------------------------------------------------------------------------------


def _scalings() -> list[Plot]:
    eps = np.logspace(-4, -1, 60)
    noise = np.logspace(-2, 0, 60)

    def quotient(top: str, root: int) -> Any:
        """log of a number over a root of eps, in long arithmetic."""
        import mpmath

        return lambda eps: np.array(
            [float(mpmath.log(mpmath.mpf(top) / mpmath.root(float(e), root))) for e in eps]
        )

    def rest(kappa: Any) -> Any:
        found = sa.rescale(eps=0.01, kappa=kappa, r=0.1)
        return np.log(found.r / found.kappa**2)

    time = value("eq:TtildetoT")
    drift = sa.friction(3, 1, "-0.4")
    return [
        Plot("eq:tildexykappa", "κ", "κₚ = 3/100", eps,
             quotient("0.03", 2), lambda e: np.log(emitted.scaled_noise(0.03, e)),
             "ε"),
        Plot("eq:tilder", "r", "rₚ = 1/10", eps,
             quotient("0.1", 1), lambda e: np.log(emitted.scaled_radius(0.1, e)), "ε"),
        Plot("eq:eekappar", "r/κ²", "rₚ = 1/10, ε = 1/100; exact: from scaled κ and r",
             noise, rest, lambda k: np.log(value("eq:eekappar")(kappa_phys=k, r_phys=0.1)),
             "κₚ"),
        Plot("eq:TtildetoT", "Tₚ", f"{_OSCILLATOR}, z₀ = -0.4; κₚ = 0.05, rₚ = 0.1",
             np.logspace(-2.5, -1.1, 36), _unscaled,
             lambda eps: np.array([
                 np.log(time(epsilon=e, t_s=1.0)) + sa.escape_time(
                     drift, 0.05 / np.sqrt(e), 0.1 / e, log=True) for e in eps]), "ε"),
        Plot("threshold", "κₚ where Tₚ is 1", f"{_OSCILLATOR}, z₀ = -0.4, r = 10",
             np.logspace(-60, -2, 40), _long, _threshold, "ε"),
    ]  # fmt: skip


def _unscaled(eps: Any) -> Any:
    """log T of the frozen drift by quadrature in y itself, the layer being |y| < eps."""

    def one(e: float) -> float:
        def V(y: Any) -> Any:
            u = y / e
            inside = -1.4 * (u + 1) + 2 * (u**2 - 1) - 3 * (u**4 - 1) / 4
            left, right = -2.4 * (u + 1), -2.8 - 0.4 * (u - 1)
            return e * np.where(u < -1, left, np.where(u > 1, right, inside))

        return float(np.log(pieces.as_printed(V, 2 / 0.05**2, 0.1, e)))

    return np.array([one(float(e)) for e in eps])


def _height() -> float:
    """The barrier of that drift, from its zeros."""
    u = np.sort(np.roots([3, 0, -4, 1.4]))[1:]
    low, high = -1.4 * u + 2 * u**2 - 3 * u**4 / 4
    return float(high - low)


def _threshold(eps: Any) -> Any:
    return np.log(emitted.noise_threshold(eps, -np.log(eps), _height()))


def _long(eps: Any) -> Any:
    """log of the unscaled noise at which eps times the exact T is 1, by bisection."""
    drift = sa.friction(3, 1, "-0.4")
    low, high = np.full(len(eps), np.log(0.02)), np.full(len(eps), np.log(3.0))
    for _ in range(45):
        middle = (low + high) / 2
        long = sa.escape_time(drift, np.exp(middle), 10, log=True) > -np.log(eps)
        low, high = np.where(long, middle, low), np.where(long, high, middle)
    return low + np.log(eps) / 2


# -- the friction oscillator -----------------------------------------------------------------------


def _friction() -> list[Plot]:
    u, inside = np.linspace(-2, 2, 161), np.linspace(-1, 1, 121)
    drift = sa.friction(3, 1, "-0.4")
    known = {"alpha": 1, "z0": -0.4}
    force = along(value("eq:forcePerturbed"), "u", alpha=1, mu=3)

    def phi(u: Any) -> Any:
        within = emitted.friction_inside(u, mu=3, **known)
        ends = emitted.friction_left(**known), emitted.friction_right(**known)
        return np.where(u < -1, ends[0], np.where(u > 1, ends[1], within))

    def bent(u: Any) -> Any:
        """A' from A off the real line: no digits are lost."""
        A = along(value("cubic"), "u", mu=3, **known)
        return (A(u + 1e-20j)).imag / 1e-20

    time = np.linspace(0, 1.4, 81)
    return [
        Plot("eq:phifric0", "ϕ", f"{_OSCILLATOR}, z₀ = -0.4", u,
             lambda u: drift.evaluate_float(np.clip(u, -1, 1)), phi, "u", False, False),
        Plot("eq:forcePerturbed", "friction force", _OSCILLATOR, inside,
             lambda u: 1.4 - drift.evaluate_float(u), force, "u", False, False),
        Plot("eq:forcePWC", "z₂", "friction: the largest z that slides",
             np.linspace(0.2, 2, 40), _slides,
             along(value("eq:forcePWC", 1), "alpha"), "α", False, False),
        Plot("cubic", "A(u)", f"{_OSCILLATOR}, z₀ = -0.4", inside,
             drift.evaluate_float, along(value("cubic"), "u", mu=3, **known), "u", False, False),
        Plot("fr1", "ϕ′", _OSCILLATOR, inside, bent,
             lambda u: emitted.friction_slope(u, mu=3, alpha=1), "u", False, False),
        Plot("eq:osc2", "y", f"{_OSCILLATOR}, slipping from (y, z) = (1/2, 0)", time, _slip, _runge,
             "t", False, False),
    ]  # fmt: skip


def _slides(alpha: Any) -> Any:
    """The largest z at which the ends of the layer drive into it, by bisection of the region."""
    low, high = np.ones(len(alpha)), np.full(len(alpha), 4.0)
    for _ in range(50):
        middle = (low + high) / 2
        left, right = sa.friction(3, alpha, middle).ends
        slides = (left > 0) & (right < 0)
        low, high = np.where(slides, middle, low), np.where(slides, high, middle)
    return low


def _slip(time: Any) -> Any:
    """y in closed form where the force is constant: a damped wave about z' = y' = 0."""
    # w = (z, y) less the rest point (-1, 1): w' = M w.
    M = np.array([[0.0, 1.0], [-1.0, -1.0]])
    rates, vectors = np.linalg.eig(M)
    start = np.linalg.solve(vectors, np.array([1.0, -0.5]))
    return np.array([(vectors @ (start * np.exp(rates * t))).real[1] + 1 for t in time])


def _runge(time: Any) -> Any:
    """y by steps of Runge and Kutta's through eq:osc2."""
    rise, slope = (value("eq:osc2", k, F=lambda y: 1.0) for k in (0, 1))

    def field(w: Any) -> Any:
        # Constants of motion have no symbols of both.
        return np.array([rise(y=w[1]), slope(y=w[1], z=w[0])])

    found, w = [0.5], np.array([0.0, 0.5])
    for h in np.diff(time) / 20:
        for _ in range(20):
            w = _step(field, w, h)
        found.append(w[1])
    return np.array(found)


def _step(field: Any, w: Any, h: float) -> Any:
    a = field(w)
    b = field(w + h / 2 * a)
    c = field(w + h / 2 * b)
    return w + h / 6 * (a + 2 * b + 2 * c + field(w + h * c))


def _zeros() -> list[Plot]:
    z0 = np.linspace(-0.77, -0.02, 60)

    def slope(z0: Any) -> Any:
        """A' at the well, of zeros that mpmath finds."""
        import mpmath

        found = []
        for z in z0:
            # An array's members are no plain floats.
            roots = mpmath.polyroots([3, 0, -4, 1 - float(z)], maxsteps=200)
            u = float(sorted(r.real for r in roots)[1])
            found.append(9 * u**2 - 4)
        return np.array(found)

    def product(z0: Any) -> Any:
        u = np.array([np.sort(np.roots([3, 0, -4, 1 - z]).real) for z in z0]).T
        return value("fr2")(alpha=1, mu=3, u1=u[1], u2=u[2], u3=u[0])

    return [Plot("fr2", "ϕ′ at the well", _OSCILLATOR, z0, slope, product, "z₀", False, False)]


# -- pictures --------------------------------------------------------------------------------------


def _regions() -> Picture:
    table = dict(zip(REGIONS, map(int, parts("regions")), strict=True))
    shades = [[table[a, b] for a in (-1, 1)] for b in (-1, 1)]

    def draw(axes: Any) -> None:
        axes.pcolormesh([-2, 0, 2], [-2, 0, 2], shades, cmap="Greys", vmin=-1, vmax=5)
        for a, b in REGIONS:
            # The engines' name, which the derivation's number stands for.
            name = sa.linear(a, b).region
            axes.text(a, b, f"{name}\n({table[a, b]})", ha="center", va="center")
        axes.set(xlabel="a⁻", ylabel="a⁺", title="regions, by the signs of both drifts")

    return Picture("regions", "the four regions over the signs of a⁻ and a⁺", draw)


def _path() -> Picture:
    """A path of eq:reducedSDEtilde, its drift and noise from there."""
    drift = sa.friction(3, 1, "-0.4")
    inside = value("eq:reducedSDEtilde", 0, phi=lambda u: drift.evaluate_float(np.clip(u, -1, 1)))
    spread = value("eq:reducedSDEtilde", 1)(kappa=0.35)

    def draw(axes: Any) -> None:
        noise, h = np.random.default_rng(5), 0.002
        u, size = [0.0], np.sqrt(2 * spread * h)
        while u[-1] < 3:
            u.append(u[-1] + h * float(inside(u=u[-1])) + size * noise.standard_normal())
        axes.plot(h * np.arange(len(u)), u, "k-", lw=0.7)
        for end in (-1, 1):
            axes.axhline(end, ls="--", color="0.5")
        axes.set(xlabel="t, scaled", ylabel="u", ylim=(-1.3, 3))
        axes.set_title(f"{_OSCILLATOR}, z₀ = -0.4, κ = 0.35")

    what = "a path of the scaled equation, which stays at its well in the layer before it leaves"
    return Picture("eq:reducedSDEtilde", what, draw)


def _stick_slip() -> Picture:
    """Paths of eq:osc3 without and with noise, in the phase plane."""
    eps = 0.01
    force = of(parts("eq:forcePerturbed")[0])

    def friction(y: Any) -> Any:
        return force(u=np.clip(y / eps, -1, 1), alpha=1.0, mu=3.0)

    rise, slope = value("eq:osc3", 0), value("eq:osc3", 1, F=friction)
    # There is no noise on z, and that on y has the amplitude kappa.
    noises = [value("eq:osc3", k) for k in (2, 3)]

    def draw(axes: Any) -> None:
        for kappa, style in ((0.0, "k--"), (0.02, "-")):
            noise, h = np.random.default_rng(3), 5e-4
            size = np.array([float(one(kappa_phys=kappa)) for one in noises])
            push = np.sqrt(h) * size * noise.standard_normal((10000, 1))
            found = [np.array([0.9, 0.5])]
            for dw in push:
                z, y = found[-1]
                field = np.array([rise(y=y), float(slope(y=y, z=z))])
                found.append(found[-1] + h * field + dw)
            axes.plot(*np.array(found).T, style, lw=1.2, label=f"κₚ = {kappa:g}")
        axes.axhspan(-eps, eps, color="0.8")
        axes.legend()
        axes.set(xlabel="z", ylabel="y", title=f"{_OSCILLATOR}, ε = 1/100; the layer in grey")

    what = "the oscillator with and without noise on its force, in the phase plane"
    return Picture("eq:osc3", what, draw)


def _multiplier() -> Picture:
    """The smooth multiplier of eq:S at three noises, and the step it tends to."""
    fold = -7 / 9
    z0 = fold + np.linspace(-0.3, 0.3, 121)

    def draw(axes: Any) -> None:
        for kappa in (0.2, 0.1, 0.05):
            smooth = [sa.stokes_multiplier(sa.friction(3, 1, float(z)), kappa) for z in z0]
            axes.plot(z0, smooth, label=f"κ = {kappa:g}")
        axes.plot([z0[0], fold, fold, z0[-1]], [0, 0, 1, 1], "k--", lw=1, label="step, κ → 0")
        axes.legend()
        axes.set(xlabel="z₀", ylabel="S", title=f"{_OSCILLATOR}: through the fold, z₀ = -7/9")

    what = "the Stokes multiplier through the fold: smooth at each noise, a step in the limit"
    return Picture("eq:S", what, draw)
