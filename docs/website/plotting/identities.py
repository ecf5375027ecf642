"""Plots of the equations and identities that the results rest on, each by two computations."""

from __future__ import annotations

from functools import cache
from typing import Any

import mpmath
import numpy as np
import sympy
from scipy.special import dawsn

import symasym as sa
from symasym.generated import numpy_formulas as emitted
from website.plotting import collocation, pieces
from website.plotting.plots import Plot
from website.plotting.symbolic import along, of, operator, parts, value

_U = sympy.Symbol("u", real=True)
_RADIUS = 1.0
_NOISE = 0.8
# phi = 1/2 - u for |u| < r = 1: all is smooth there.
_LINE = sympy.Rational(1, 2) - _U
_IN_WORDS = "ϕ = 1/2 - u, r = 1"


def all_plots() -> tuple[Plot, ...]:
    """Those of this module."""
    return (*_fokker_planck(), *_halves(), *_integrals(), *_saddle())


def _line_drift() -> Any:
    return sa.linear(a_minus="3/2", a_plus="-1/2")


def _line_potential(u: Any) -> Any:
    return (u**2 - u) / 2


# -- the Fokker-Planck equation --------------------------------------------------------------------


def _fokker_planck() -> list[Plot]:
    C = sa.exit_probability(_line_drift(), _NOISE, _RADIUS)
    title = f"{_IN_WORDS}, κ = {_NOISE}"
    # Not the ends, where R is 0, nor the start, where the flux jumps.
    u = np.linspace(-0.99, 0.99, 120)
    share = float(sa.exit_probability(sa.linear(1, 1), _NOISE, _RADIUS))

    def closed(u: Any) -> Any:
        """R for phi = 1, by hand."""
        k = 2 / _NOISE**2
        right = (1 - share) * -np.expm1(-k * (1 - u))
        return np.log(np.where(u > 0, right, share * np.expm1(k * (u + 1))))

    def flux(u: Any) -> Any:
        R, slope = _source(_LINE)
        return _NOISE**2 / 2 * slope(u) - (0.5 - u) * R(u)

    def steady(u: Any) -> Any:
        q = collocation.without_flux(_equation("eq:FPE", _LINE), -1.0, 1.0)
        return np.log(q(u) / q(np.array([0.5])))

    return [
        Plot("eq:Ttilde0", "T", f"{_IN_WORDS}; the mass in 300 modes, integrated over time",
             np.logspace(-0.3, 0.7, 24), lambda k: _times(_line_drift(), k), _surviving),
        Plot("eq:odeR", "R", f"ϕ = 1, r = 1, κ = {_NOISE}; solved by collocation", u, closed,
             lambda u: np.log(_source(1)[0](u)), "u", log_x=False),
        Plot("first-integral", "flux of R", f"{title}; R by collocation", u, flux,
             along(value("first-integral"), "u", C=C), "u", False, False),
        Plot("density-R", "R", f"{title}; exact: by collocation", u,
             lambda u: np.log(_source(_LINE)[0](u)), lambda u: _density(u, C), "u", log_x=False),
        Plot("eq:FPE", "steady state", f"{title}, between walls; by collocation",
             u, lambda u: -2 * (_line_potential(u) - _line_potential(0.5)) / _NOISE**2, steady,
             "u", log_x=False),
    ]  # fmt: skip


def _equation(label: str, drift: Any, **known: Any) -> tuple[Any, ...]:
    return operator(label, sympy.sympify(drift), _U, kappa=_NOISE, **known)


@cache
def _source(drift: Any) -> tuple[Any, Any]:
    """R of eq:odeR with the start's unit source, and R'."""
    return collocation.source_at_zero(_equation("eq:odeR", drift, m=1.0), _RADIUS)


def _times(drift: Any, kappa: Any) -> Any:
    return sa.escape_time(drift, kappa, _RADIUS, log=True)


def _density(u: Any, C: float) -> Any:
    """log R by density-R, its integral by Gauss's rule."""
    (e,) = parts("density-R")
    (integral,) = e.atoms(sympy.Integral)
    (v, _, _) = integral.limits[0]
    V = sympy.Function("V")
    inside = of(integral.function.replace(V, _line_potential))
    front = of((e / integral).replace(V, _line_potential))

    def one(low: float) -> float:
        total = 0.0
        for a, b in ((low, max(low, 0.0)), (max(low, 0.0), _RADIUS)):
            x, w = pieces.nodes(a, b, 8)
            total += float(np.sum(w * inside(v=x, C=C, kappa=_NOISE)))
        return float(np.log(front(u=low, kappa=_NOISE) * total))

    assert v.name == "v"
    return np.array([one(float(low)) for low in u])


def _surviving(kappa: Any) -> Any:
    """log of the mass that is left, integrated over time."""
    n = 300
    k = np.arange(1, n + 1) * np.pi / 2
    x, w = pieces.nodes(-1.0, 1.0, 60)
    x, w = x.ravel(), w.ravel()
    sines, cosines = np.sin(np.outer(k, x + 1)), np.cos(np.outer(k, x + 1))
    # p is a sum of sines; the drift's term is integrated by parts.
    push = (k[:, None] * cosines * (w * (0.5 - x))) @ sines.T
    mass = (1 - np.cos(2 * k)) / k
    found = []
    for one in kappa:
        # The integral of e^(L t) over all time is -1/L.
        L = -(one**2) / 2 * np.diag(k**2) + push
        found.append(np.log(mass @ np.linalg.solve(-L, np.sin(k))))
    return np.array(found)


# -- both halves, and what is carried --------------------------------------------------------------


def _halves() -> list[Plot]:
    drift = sa.friction(3, 1, "-0.4")
    noise = np.logspace(-0.4, 1, 40)
    name = "friction, μ = 3, α = 1, z₀ = -0.4"
    V, r = pieces.friction_potential, 10.0
    cubic, u = sa.polynomial(0, -1, 0, "-1/2"), np.linspace(-1, 1, 41)

    def exact(k: Any) -> Any:
        return sa.escape_time(drift, k, 10, log=True)

    def backward(k: float) -> float:
        lam = 2 / k**2
        left, right = pieces.halves(V, lam, r)
        doubles = pieces.without_exit(V, lam, r) / lam, pieces.left_half(V, lam, r) / lam
        known = dict(zip(("I0", "I1", "J0", "J1"), (right, left, *doubles), strict=True))
        return float(value("backward")(kappa=k, **known))

    def doubles(lam: float) -> tuple[float, float]:
        """lam times the double integrals of both sides; left of the start v < u."""
        K_left = pieces.left_half(lambda u: -V(u), lam, r)
        K_right = pieces.triangle(V, lam, 0, 1) + pieces.rectangle(V, lam, (0, 1), (1, r))
        return K_left, K_right + pieces.triangle(V, lam, 1, r)

    def positive(k: float) -> float:
        lam = 2 / k**2
        scale = np.exp(lam * float(V(np.float64(0.0))))
        left, right = pieces.halves(V, lam, r)
        K_left, K_right = doubles(lam)
        w = scale * (K_left / left + K_right / right)
        return float(emitted.escape_time_of_sides(w, left / scale, right / scale))

    def sides(k: float) -> float:
        lam = 2 / k**2
        left, right = pieces.halves(V, lam, r)
        K_left, K_right = doubles(lam)
        known = {"behind": left, "ahead": right, "total": left + right, "speed_start": 0.0}
        return float(value("two-sides")(nested_left=K_left, nested_right=K_right, **known))

    def shape(u: Any) -> Any:
        return u**2 / 2 + u**4 / 8 - 0.625

    def density(u: Any) -> Any:
        lam = 2 / _NOISE**2
        tails = emitted.tail_left(1.5) + emitted.tail_right(-1.5)
        mass = pieces.single(shape, -lam, -1, 1) + tails / lam
        w = lam * np.exp(lam * shape(u)) * mass
        return np.log(emitted.density_of_sides(lam, w))

    return [
        Plot("backward", "T", f"{name}; the integrals by quadrature", noise, exact,
             lambda k: np.log([backward(one) for one in k])),
        Plot("positive-form", "T", f"{name}; the integrals by quadrature", noise, exact,
             lambda k: np.log([positive(one) for one in k])),
        Plot("two-sides", "T", f"{name}; the integrals by quadrature", noise, exact,
             lambda k: np.log([sides(one) for one in k])),
        Plot("positive-density", "stationary density", f"A = -u - u³/2, κ = {_NOISE}", u,
             lambda u: np.log(sa.stationary_density(cubic, _NOISE, u)), density, "u", log_x=False),
        Plot("panel-step", "w", "V = u + u²/4, from 0 to 1, after a start at -1",
             np.logspace(-0.3, 1, 40), _carried_at_once, _carried,
             by=("from -1 at once", "from -1 to 0, then by one panel")),
    ]  # fmt: skip


def _rise(u: Any) -> Any:
    return u + u**2 / 4


def _fall(u: Any) -> Any:
    return -_rise(u)


def _swept(lam: float, end: float) -> tuple[float, float]:
    """sigma and w at `end`, from -1: S/s, and lam s K/S."""
    S = pieces.single(_rise, lam, -1, end)
    s = np.exp(lam * _rise(end))
    # lam times the integral of e^(lam (V(v) - V(u))) over v < u.
    return S / s, s * pieces.triangle(_fall, lam, -1, end) / S


def _carried_at_once(kappa: Any) -> Any:
    return np.log([_swept(2 / k**2, 1.0)[1] for k in kappa])


def _carried(kappa: Any) -> Any:
    found = []
    for k in kappa:
        lam = 2 / k**2
        sigma, w = _swept(lam, 0.0)
        end = np.exp(-lam * _rise(1.0))
        int_e, int_inverse = end * pieces.single(_rise, lam, 0, 1), pieces.single(_rise, -lam, 0, 1)
        nested = pieces.triangle(_fall, lam, 0, 1) / lam
        found.append(emitted.carried(lam, w, int_e, int_inverse, nested, 1, end, sigma)[1])
    return np.log(found)


# -- integrals and their domains -------------------------------------------------------------------


def _integrals() -> list[Plot]:
    noise, tanh = np.logspace(-1, 1, 60), sa.tanh(1, -1, 5)
    u = np.linspace(-2, 2, 161)
    left = value("tails")
    growth = np.linspace(1.05, 6, 40)

    def tail(k: Any) -> Any:
        """The left tail by quadrature, to where nothing is left of it."""
        ends = [-1 - 20 * one**2 / 1.5 for one in k]
        found = [pieces.single(lambda u: -1.5 * (u + 1), -2 / x**2, end, -1)
                 for x, end in zip(k, ends, strict=True)]  # fmt: skip
        return np.log(found)

    return [
        Plot("eq:V2", "V", "tanh, a⁻ = 1, a⁺ = -1, b = 5", u, _tanh_potential,
             lambda u: _by_pieces(tanh, u), "u", False, False),
        Plot("eq:fourPieces", "∫∫ e^(u + v/2)", "the four domains together, in r", growth,
             lambda r: np.log([_whole(one) for one in r]), _four, "r", log_x=False),
        Plot("tails", "left tail", "a⁻ = 3/2", noise, tail,
             lambda k: np.log(left(kappa=k, a_minus=1.5))),
        Plot("pair-products", "J", "weights 1; exact: over t = s(v) - s(u) alone, by quadrature",
             np.linspace(-6, 4, 121), _pair_by_distance, _pair, "Z", log_x=False),
        Plot("airy-form", "∫ e^(λV)", "u' = 1 + s/2 + s³/4, ζ = 1/4; exact: quadrature along rays",
             np.logspace(0, 2.5, 60), _past_pair, _airy_form, "λ"),
        Plot("truncated-gaussian", "∫ e^(-λV)", "t = 1, u' = 1 + t/2; exact: by quadrature",
             np.logspace(0, 2, 40), _up_to_end, _truncated, "λ"),
        Plot("gaussian-step", "both integrals", "V″ at the barrier: -1", np.logspace(-1, 2, 60),
             _gaussians, lambda a: np.log(value("gaussian-step")(A_2=a, A_1=-1.0)),
             "V″ at the well"),
    ]  # fmt: skip


def _tanh_potential(u: Any) -> Any:
    """log cosh, by hand."""

    def inside(x: Any) -> Any:
        return (np.log(np.cosh(5 * x)) - np.log(np.cosh(5))) / (5 * np.tanh(5))

    return np.where(u < -1, -(u + 1), np.where(u > 1, u - 1, inside(np.clip(u, -1, 1))))


def _by_pieces(drift: Any, u: Any) -> Any:
    def inside(x: float) -> float:
        t, w = pieces.nodes(-1, x, 12)
        return -float(np.sum(w * drift.evaluate_float(t)))

    within = np.array([inside(float(x)) for x in np.clip(u, -1, 1)])
    left = emitted.potential_left(u, a_minus=1)
    right = emitted.potential_right(u, a_plus=-1, V1=inside(1.0))
    return np.where(u < -1, left, np.where(u > 1, right, within))


def _four(r: Any) -> Any:
    """The sum of eq:fourPieces for f = e^u, g = e^(v/2)."""
    f, g = sympy.Function("f"), sympy.Function("g")
    total = sympy.Add(*parts("eq:fourPieces"))
    total = total.replace(f, sympy.exp).replace(g, lambda v: sympy.exp(v / 2)).doit()
    return np.log(of(sympy.simplify(total))(r=r))


def _whole(r: float) -> float:
    """The same over 0 < v < r, -r < u < v: e^u is integrated by hand."""
    v, w = pieces.nodes(0.0, r, 20)
    return float(np.sum(w * np.exp(v / 2) * (np.exp(v) - np.exp(-r))))


def _pair_by_distance(Z: Any) -> Any:
    """J over the distance t = w² of u and v, by the trapezoidal rule."""
    w, step = np.linspace(-4, 4, 321, retstep=True)
    both = np.exp(Z[:, None] * w**2 - w**6 / 12)
    return np.log(np.sqrt(np.pi) * step * both.sum(axis=1))


_AIRY: dict[str, Any] = {
    "airyai": mpmath.airyai,
    "airybi": mpmath.airybi,
    "airyaiprime": lambda x: mpmath.airyai(x, derivative=1),
    "airybiprime": lambda x: mpmath.airybi(x, derivative=1),
}


def _pair(Z: Any) -> Any:
    J = value("pair-products", **_AIRY)
    return np.log([float(J(Z=z)) for z in Z])


def _airy_form(lam: Any) -> Any:
    """At ζ = 1/4, where u' = 1 + s/2 + s³/4 is 1 + (1/2 + ζ/4) s at both zeros."""
    up = value("airy-form", **_AIRY)
    return np.log(
        [float(up(Z=z ** (2 / 3) / 4, a=1.0, b=0.5625, small=z ** (-1 / 3))) for z in lam]
    )


def _past_pair(lam: Any) -> Any:
    """Of e^(λ (ζ s - s³/3)) u' in units of λ^(-1/3): to 0 and on to the mean of both other ends."""
    x, w = (one.ravel() for one in pieces.nodes(0.0, 9.0, 30))
    turn, unit = np.exp(1j * np.pi / 3), lam[:, None] ** (-1 / 3)
    found = 0.0
    for s, slope in ((-x + 0j, 1), (x * turn, turn)):
        weight = unit * (1 - unit * s / 2 - (unit * s) ** 3 / 4)
        found = found + (np.exp(s**3 / 3 - s / (4 * unit**2)) * weight * slope) @ w
    return np.log(found.real)


def _truncated(lam: Any) -> Any:
    """With Dawson's integral by the library."""
    integral = np.sqrt(2 / lam) * dawsn(np.sqrt(lam / 2))
    down = value("truncated-gaussian", 1)
    return np.log(down(lam=lam, peak=1.0, rest=0.5, dawson=integral))


def _up_to_end(lam: Any) -> Any:
    """∫ (1 + s/2) e^(λ(s² - 1)/2) over (0, 1), and the barrier's own end."""
    s, w = (one.ravel() for one in pieces.nodes(0.0, 1.0, 20))
    inside = np.exp(lam[:, None] * (s**2 - 1) / 2) * (1 + s / 2) @ w
    return np.log(inside + np.exp(-lam / 2) / (2 * lam))


def _gaussians(curvature: Any) -> Any:
    """The product of both integrals by the trapezoidal rule, which is exact to rounding."""
    x = np.linspace(-9, 9, 181)
    unit = np.sum(np.exp(-(x**2) / 2)) * (x[1] - x[0])
    found = []
    for a in curvature:
        t = x / np.sqrt(a)
        found.append(unit * np.sum(np.exp(-a * t**2 / 2)) * (t[1] - t[0]))
    return np.log(found)


# -- at the saddle ---------------------------------------------------------------------------------


def _saddle() -> list[Plot]:
    well = float(sa.friction(3, 1, "-0.4").wells()[0].u)
    bottom, curvature = float(pieces.friction_potential(np.float64(well))), 4 - 9 * well**2
    place, from_start = value("laplace-substitution"), value("saddle-start")

    def half(lam: Any) -> Any:
        # V = u²/2 + u³/6.
        return np.log(from_start(lam=lam, c_2=1, c_3=1, c_4=0, c_5=0, c_6=0, c_7=0))

    def to_the_right(lam: Any) -> Any:
        def V(u: Any) -> Any:
            return u**2 / 2 + u**3 / 6

        return np.log([pieces.single(V, -x, 0, 6) / np.sqrt(2 * np.pi / x) for x in lam])

    def series(lam: Any) -> Any:
        # V = u²/2 + u⁴/8: the fourth derivative is 3.
        first = emitted.saddle_first(V2=1, V3=0, V4=3)
        second = emitted.saddle_second(V2=1, V3=0, V4=3, V5=0, V6=0)
        return np.log1p(first / lam + second / lam**2)

    def ratio(lam: Any) -> Any:
        def V(u: Any) -> Any:
            return u**2 / 2 + u**4 / 8

        return np.log([pieces.single(V, -x, -6, 6) / np.sqrt(2 * np.pi / x) for x in lam])

    def by_parts(q: Any) -> Any:
        # ∫ e^(-x - q x²/(2λ)) dx over λ: the coefficient of λ^-2.
        x, w = (one.ravel() for one in pieces.nodes(0.0, 60.0))
        return -q / 2 * np.sum(w * x**2 * np.exp(-x))

    def bent(c: Any) -> Any:
        x, w = (one.ravel() for one in pieces.nodes(0.0, 1.0, 2))
        return (w * (x - c[:, None] * x**2)).sum(axis=1) / 0.5 - 1

    def to_infinity(t: Any) -> Any:
        # By x = t/y.
        y, w = (one.ravel() for one in pieces.nodes(0.0, 1.0, 2))
        return np.log([np.sum(w * (one / y) ** -3 * one / y**2) for one in t])

    def beyond_pair(t: Any) -> Any:
        y, w = (one.ravel() for one in pieces.nodes(0.0, 1.0, 2))
        return np.log([np.sum(w * one / (one**2 - y**2)) for one in t])

    start, beside = value("endpoint-series"), value("pair-primitives", 0)
    primitive, bend = value("regular-part", 1), value("saddle-recurrences")
    return [
        # h_2 = q beside 0.
        Plot("endpoint-series", "∫ e^(λV), coefficient of λ^-2", "ϕ = 1 + q u, from u = 0 on",
             np.linspace(-2, 2, 41), by_parts, lambda q: start(side=1, left=0, right=q), "q",
             False, False),
        Plot("regular-part", "-∫ dt/t³",
             "finite part of the integral from 0 to t; exact: by quadrature from t to ∞",
             np.logspace(-1, 1, 41), to_infinity,
             lambda t: np.log(-primitive(power=3, term=1) * t**-2.0), "t"),
        Plot("pair-primitives", "∫ dt/(t² - 1)",
             "from y to ∞ (α = R = 1); exact: by quadrature in y/t",
             np.logspace(0.2, 2, 41), beyond_pair,
             lambda y: np.log(-beside(alpha=1.0, R=1.0, y=y, gap=y - 1)), "y"),
        Plot("saddle-recurrences", "α₁", "ϕ = -t + c t²; exact: 2V(1) - 1 by quadrature",
             np.linspace(-2, 2, 41), bent, lambda c: bend(j=1, term=c, slope=-1.0), "c",
             False, False),
        Plot("saddle-series", "∫ e^(-λV), scaled", "V = u²/2 + u⁴/8; over the leading term",
             np.logspace(0.7, 3, 40), ratio, series, "λ"),
        Plot("saddle-start", "∫ e^(-λV) from u₁ on, scaled",
             "V = u²/2 + u³/6; over the leading term of the whole well",
             np.logspace(0.7, 3, 40), to_the_right, half, "λ"),
        Plot("laplace-substitution", "V at u₁ + κ", "friction, μ = 3, α = 1, z₀ = -0.4: the well",
             np.logspace(-3, -0.4, 40), lambda k: pieces.friction_potential(well + k),
             lambda k: place(V_u1=bottom, c2=curvature, kappa=k, uhat=1.0), logs=False),
    ]  # fmt: skip
