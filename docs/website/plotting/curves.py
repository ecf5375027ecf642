"""The curves that are plotted: each formula, and the exact value from the engines or elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np

import symasym as sa
from symasym.generated import numpy_formulas as emitted
from website.plotting import pieces
from website.plotting.plots import Curve, Plot

PHYSICAL = "κₚ, with ε = 1/100"


def all_plots() -> tuple[Plot, ...]:
    """Those of all labels that have one, in the order of the paper."""
    return (
        *_closed_forms(),
        *_of_the_force(),
        *_integrals(),
        *_escape(),
        *_pieces(),
        *_sliding(),
        *_unscaled(),
    )


def _each(function: Callable[[float], float]) -> Curve:
    """The logarithm of a function of one number, for an array of them."""
    return lambda x: np.log([function(float(one)) for one in x])


def _verb(verb: str, drift: Any, *rest: Any, **options: Any) -> Curve:
    return lambda kappa: getattr(sa, verb)(drift, kappa, *rest, log=True, **options)


def _log(function: Callable[..., Any], **values: Any) -> Curve:
    return lambda x: np.log(function(x, **values))


def _friction(z0: Any = "-0.4") -> Any:
    return sa.friction(mu=3, alpha=1, z0=z0)


# Of a curve that a function of symasym computes, and the integral that a formula is.
_ENGINE = ("computed by symasym", "as printed, by quadrature")
_OSCILLATOR = "friction, μ = 3, α = 1, z₀ = -0.4"
_LINE = "linear, a⁻ = 1, a⁺ = -1"


def _noise(low: float, high: float, count: int = 60) -> Any:
    return np.logspace(low, high, count)


def _closed_forms() -> list[Plot]:
    drift, values = _friction(), {"alpha": 1, "z0": -0.4}

    def potential(u: Any) -> Any:
        left = emitted.friction_potential_left(u, **values)
        inside = emitted.friction_potential_inside(u, mu=3, **values)
        right = emitted.friction_potential_right(u, **values)
        return np.where(u < -1, left, np.where(u > 1, right, inside))

    def height(gap: Any) -> Any:
        omega = emitted.friction_angle(mu=3, alpha=1, z0=-7 / 9 + gap)
        return np.log(emitted.friction_barrier(omega, mu=3, alpha=1))

    u = np.linspace(-2, 2, 161)
    return [
        Plot("eq:Vfric", "V", _OSCILLATOR, u, _summed(drift), potential, "u", False, False),
        Plot(
            "friction-well", "height of the barrier", "friction, μ = 3, α = 1",
            _noise(-6, -0.2), _each(_barrier), height, "z₀ less its value at the fold, -7/9",
        ),
    ]  # fmt: skip


def _summed(drift: Any) -> Curve:
    """V from -phi by quadrature, kink by kink."""

    def V(u: Any) -> Any:
        stretches = [((-1, min(x, 1)), (1, max(x, 1))) for x in u]
        return np.array([-sum(_area(drift, *ends) for ends in pair) for pair in stretches])

    return V


def _area(function: Curve, a: float, b: float) -> float:
    x, w = pieces.nodes(a, b, 8)
    return float(np.sum(w * function(x)))


def _barrier(gap: float) -> float:
    """V(u2) - V(u1) of the friction drift from its zeros, to 40 digits."""
    import mpmath

    with mpmath.workdps(40):
        a = mpmath.mpf(-7 / 9 + gap) - 1  # A = -a - 4 u + 3 u^3
        zeros = sorted(z.real for z in mpmath.polyroots([3, 0, -4, -a], maxsteps=200))[1:]
        u1, u2 = ((a * u + 2 * u**2 - mpmath.mpf(3) / 4 * u**4) for u in zeros)
        return float(u2 - u1)


def _of_the_force() -> list[Plot]:
    """What is known of the friction force, against zeros found by mpmath."""
    mu = np.geomspace(0.55, 50, 60)

    def turning(m: float) -> float:
        import mpmath

        return max(float(z.real) for z in mpmath.polyroots([-3 * m, 0, 1 + m]))

    def breakaway(m: float) -> float:
        u = turning(m)
        return u + m * (u - u**3)

    return [
        Plot("turning-points", "turning point", "friction", mu,
             lambda mu: np.array([turning(m) for m in mu]),
             emitted.friction_turning_point, "μ", logs=False),
        Plot("beta", "breakaway force", "friction, α = 1", mu,
             lambda mu: np.array([breakaway(m) for m in mu]),
             lambda mu: emitted.friction_breakaway(mu=mu, alpha=1), "μ", logs=False),
        Plot("folds", "z₀ at the fold", "friction, α = 1", mu,
             lambda mu: np.array([1 - breakaway(m) for m in mu]),
             lambda mu: emitted.friction_folds(mu, alpha=1)[0], "μ", logs=False),
    ]  # fmt: skip


def _integrals() -> list[Plot]:
    """What is emitted with its quadrature, against the engines, which have no quadrature."""
    friction, tanh = _friction(), sa.tanh(1, -1, 5)
    names = "tanh, a⁻ = 1, a⁺ = -1, b = 5"
    exit_ = sa.emit("eq:C", "numpy", drift=friction).load()
    share = sa.emit("eq:P", "numpy", drift=tanh).load()
    density = sa.emit("eq:pss", "numpy", drift=tanh).load()

    def layer(kappa: float) -> float:
        return pieces.single(_cubic_potential, -2 / kappa**2, -1, 1)

    def from_layer(kappa: Any) -> Any:
        inside = np.array([layer(k) for k in kappa])
        return np.log(emitted.occupation_from_layer(kappa, 1.5, -1.5, inside, 0))

    V = sa.emit("eq:V", "numpy", drift=tanh).load().V
    u = np.linspace(-2, 2, 161)
    return [
        Plot("eq:V", "V", names, u, _summed(tanh), V, "u", False, False),
        Plot("constant-panel", "∫ e^(-x t) dt from 0 to 1", "a panel of constant drift",
             np.geomspace(0.01, 100, 60),
             _each(lambda x: pieces.single(np.negative, x, 0, 1)), _log(emitted.constant_single),
             "x"),
        Plot("eq:C", "C", _OSCILLATOR, _noise(0, 1.5), _verb("exit_probability", friction, 10),
             lambda k: exit_.log_exit_probability(k, 10), by=_ENGINE),
        Plot("eq:P", "1 - P", names, _noise(-1, 1), _verb("occupation", tanh, complement=True),
             share.log_complement, by=_ENGINE),
        Plot("eq:P2", "P", _CUBIC, _noise(-1, 1), _verb("occupation", _cubic()), from_layer,
             by=_ENGINE),
        Plot("eq:pss", "stationary density", f"{names}, κ = 1/2", u,
             lambda u: np.log(sa.stationary_density(tanh, 0.5, u)),
             lambda u: np.log(density.stationary_density(u, 0.5)), "u", log_x=False,
             by=_ENGINE),
    ]  # fmt: skip


def _escape() -> list[Plot]:
    drift, no_well = _friction(), _friction(-1)
    even = sa.linear(a_minus=1, a_plus=1)
    plain = "friction, μ = 3, α = 1, z₀ = -1 (no well)"
    slopes, height = _well()
    edge = _log(emitted.well_edge, a_plus=0.4, **slopes, barrier=height)
    return [
        Plot("constant-drift", "T", "ϕ = 1, r = 10", _noise(-1, 1), _verb("escape_time", even, 10),
             _log(emitted.constant_drift_time, r=10, a=1)),
        Plot("eq:Ttilde", "T", _OSCILLATOR, _noise(-0.4, 1), _verb("escape_time", drift, 10),
             _each(lambda k: pieces.as_printed(pieces.friction_potential, 2 / k**2, 10)),
             by=_ENGINE),
        Plot("eq:TtildeCzero", "T", _OSCILLATOR, _noise(-0.4, 1),
             _verb("escape_time", drift, 10),
             _each(lambda k: pieces.without_exit(pieces.friction_potential, 2 / k**2, 10))),
        Plot("eq:Ttildesmall", "T", _OSCILLATOR, _noise(-1, 0.3),
             _verb("escape_time", drift, 10), _verb("escape_time", drift, 10, method="paper")),
        Plot("eq:Ttildelarge", "T", f"{plain}, r = 10⁴", _noise(-1, 1.5),
             _verb("escape_time", no_well, 10**4),
             _verb("escape_time", no_well, 10**4, method="paper")),
        Plot("eq:Tsmall", "κ where T is 2r/a⁺", _OSCILLATOR, np.geomspace(30, 10**6, 40),
             partial(_edge, drift), edge, "r, scaled"),
        Plot("C-bound", "C", _OSCILLATOR, _noise(-0.5, 0.2), _verb("exit_probability", drift, 10),
             _verb("exit_probability", drift, 10, method="paper")),
    ]  # fmt: skip


def _well() -> tuple[dict[str, float], float]:
    """A' at the well and at the barrier, and the height between them."""
    points = [float(p.u) for p in _friction().critical_points()]
    slopes = (9 * u**2 - 4 for u in points)
    bottom, top = pieces.friction_potential(np.array(points))
    return dict(zip(("slope_well", "slope_barrier"), slopes, strict=True)), float(top - bottom)


def _edge(drift: Any, r: Any) -> Any:
    """log of the noise at which the exact T is twice r/a+, by bisection."""
    low, high = np.full(len(r), np.log(0.05)), np.zeros(len(r))
    for _ in range(45):
        middle = (low + high) / 2
        long = sa.escape_time(drift, np.exp(middle), r, log=True) > np.log(2 * r / 0.4)
        low, high = np.where(long, middle, low), np.where(long, high, middle)
    return low


def _pieces() -> list[Plot]:
    """The four pieces of T: each by quadrature, or in closed form, and what is said of it."""
    V, ends = pieces.friction_potential, {"a_minus": 2.4, "a_plus": 0.4}
    slopes, height = _well()
    bottom = float(V(_friction().wells()[0].u))
    outer = _log(emitted.outer_piece, r=10, a_plus=ends["a_plus"])
    strong = _log(emitted.outer_piece, r=10**4, a_plus=ends["a_plus"])

    def first_three(k: float) -> float:
        left, right = (-(10**4), -1), (1, 10**4)
        inner = pieces.rectangle(V, 2 / k**2, left, (0, 1)) + pieces.well_piece(V, 2 / k**2)
        return inner + pieces.rectangle(V, 2 / k**2, (*left, 0, 1), right)

    def third(k: float) -> float:
        return pieces.rectangle(V, 2 / k**2, (-10, -1, 0, 1), (1, 10))

    def third_weak(k: Any) -> Any:
        size = np.sqrt(-np.pi / slopes["slope_well"]) * k / ends["a_plus"]
        return np.log(size) + 2 * (float(V(np.float64(1.0))) - bottom) / k**2

    weak = _noise(-0.75, 0.3)
    large = np.log(10**4 / ends["a_plus"])
    return [
        Plot("first-three", "first three pieces of T", f"{_OSCILLATOR}, r = 10⁴", _noise(0.5, 1.5),
             _each(first_three), _log(lambda k: k**2 / (2 * ends["a_minus"] * ends["a_plus"]))),
        Plot("eq:fourthTerm", "fourth piece of T", f"{_OSCILLATOR}, r = 10⁴", _noise(-1, 1.5),
             strong, lambda k: np.full(len(k), large)),
        Plot("eq:secondTerm", "second piece of T", _OSCILLATOR, weak,
             _each(lambda k: pieces.well_piece(V, 2 / k**2)),
             partial(emitted.log_well_term, **slopes, barrier=height)),
        Plot("eq:fourthTerm2", "fourth piece of T", f"{_OSCILLATOR}, r = 10", _noise(-2, 0.3),
             outer, lambda k: np.full(len(k), np.log(9 / ends["a_plus"]))),
        Plot("other-pieces", "third piece of T", _OSCILLATOR, weak, _each(third), third_weak),
    ]  # fmt: skip


_CUBIC = "A = -u - u³/2"


def _cubic() -> Any:
    return sa.polynomial(0, -1, 0, "-1/2")


def _cubic_potential(u: Any) -> Any:
    """V of that drift inside the layer."""
    return u**2 / 2 + u**4 / 8 - 0.625


_WELL = {"V1": 0, "V_well": -0.625, "curvature": 1}


def _sliding() -> list[Plot]:
    line, cubic = sa.linear(a_minus=1, a_plus=-1), _cubic()
    return [
        Plot("eq:Plarge2", "P", _LINE, _noise(0, 2), _verb("occupation", line),
             _log(emitted.strong_noise_occupation, a_minus=1, a_plus=-1)),
        Plot("L-bound", "P", f"{_LINE}: a lower bound", _noise(-0.5, 0.14),
             _verb("occupation", line), _verb("occupation", line, method="paper")),
        Plot("eq:Psmall2", "1 - P", _CUBIC, _noise(-1, 0.3),
             _verb("occupation", cubic, complement=True),
             _log(emitted.weak_noise_outside, a_minus=1.5, a_plus=-1.5, **_WELL)),
    ]  # fmt: skip


def _unscaled() -> list[Plot]:
    """The results of the introduction, in the paper's physical units."""
    eps = 0.01
    line, cubic, no_well = sa.linear(a_minus=1, a_plus=-1), _cubic(), _friction(-1)
    strong, weak, free = (
        sa.emit(label, "numpy", values).load()
        for label, values in (
            ("eq:Plarge", {"a_minus": 1, "a_plus": -1}),
            ("eq:Psmall", {"a_minus": "3/2", "a_plus": "-3/2", "V_1": 0, "V_m": "-5/8", "K_m": 1}),
            ("eq:Tlarge", {"a_plus": 1}),
        )
    )

    def scaled(verb: str, drift: Any, **options: Any) -> Curve:
        return lambda k: getattr(sa, verb)(drift, k / np.sqrt(eps), log=True, **options)

    def time(k: Any) -> Any:
        return np.log(eps) + sa.escape_time(no_well, k / np.sqrt(eps), 100 / eps, log=True)

    return [
        Plot("eq:Plarge", "P", _LINE, _noise(-1, 1), scaled("occupation", line),
             lambda k: np.log(strong.Plarge(eps, k)), PHYSICAL),
        Plot("eq:Psmall", "1 - P", _CUBIC, _noise(-2, -0.7),
             scaled("occupation", cubic, complement=True),
             lambda k: weak.log_Psmall(eps, k), PHYSICAL),
        Plot("eq:Tlarge", "Tₚ", "friction, μ = 3, α = 1, z₀ = -1 (no well), rₚ = 100",
             _noise(-1, 0.5), time, lambda k: np.full(len(k), np.log(free.Tlarge(100))), PHYSICAL),
    ]  # fmt: skip
