"""The formulas that the derivations emitted, each once.

First those of + - * / and whole powers, for numbers of any one kind; then those in an mpmath
context `ctx`, or with NumPy in its place.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from mpmath import mpf
    from mpmath.ctx_mp import MPContext


class Ratios(Protocol):
    """Numbers of one kind that are added, multiplied and divided, as positive ones may be."""

    def __add__(self, other: Any, /) -> Any: ...
    def __radd__(self, other: Any, /) -> Any: ...
    def __mul__(self, other: Any, /) -> Any: ...
    def __rmul__(self, other: Any, /) -> Any: ...
    def __truediv__(self, other: Any, /) -> Any: ...
    def __rtruediv__(self, other: Any, /) -> Any: ...


class Field(Ratios, Protocol):
    """Numbers of one kind: floats or arrays of them, rationals, mpf, balls, expressions."""

    def __neg__(self) -> Any: ...
    def __sub__(self, other: Any, /) -> Any: ...
    def __rsub__(self, other: Any, /) -> Any: ...
    def __pow__(self, other: int, /) -> Any: ...


def scaled_radius(r: Ratios, eps: Ratios) -> Any:
    """r/eps, the radius in scaled variables (eq:tilder)."""
    return r/eps


def carried(
    lam: Ratios,
    w: Ratios,
    int_e: Ratios,
    int_inverse: Ratios,
    nested: Ratios,
    fall: Ratios,
    climb: Ratios,
    sigma: Ratios,
) -> Any:
    """sigma and w after a panel (panel-step)."""
    return (
        (int_e + climb*sigma)/fall, (fall*w + int_inverse*lam)/(climb + int_e/sigma) +
        lam*nested/(int_e + climb*sigma)
    )


def absorbed(lam: Ratios, int_e: Ratios, nested: Ratios, fall: Ratios) -> Any:
    """sigma and w after a panel that begins at an absorbing end (panel-step)."""
    return int_e/fall, lam*nested/int_e


def saddle_first(V2: Field, V3: Field, V4: Field) -> Any:
    """Coefficient of 1/lam in a well's series; of -V, a barrier's (saddle-series)."""
    return -V4/(8*V2**2) + 5*V3**2/(24*V2**3)


def saddle_second(V2: Field, V3: Field, V4: Field, V5: Field, V6: Field) -> Any:
    """Coefficient of 1/lam^2 in the series of `saddle_first` (saddle-series)."""
    return (
        -V6/(48*V2**3) + 35*V4**2/(384*V2**4) + 385*V3**4/(1152*V2**6) - 35*V4*V3**2/(64*V2**5)
        + 7*V3*V5/(48*V2**4)
    )


def friction_coefficients(mu: Field, alpha: Field, z0: Field) -> Any:
    """Coefficients of A(u) in ascending powers of u (eq:phifric0)."""
    return 1 - z0, -alpha*(1 + mu), 0, alpha*mu


def escape_time_of_sides(w: Ratios, sigma_left: Ratios, sigma_right: Ratios) -> Any:
    """T from sigma on both sides and w, the sum of both (positive-form)."""
    return w/(1/sigma_left + 1/sigma_right)


def density_of_sides(lam: Ratios, w: Ratios) -> Any:
    """p_ss from w, the sum of both sides (positive-density)."""
    return lam/w


def tail_left(a_minus: Ratios) -> Any:
    """w at -1 (positive-density)."""
    return 1/a_minus


def tail_right(a_plus: Ratios) -> Any:
    """w at 1, from the right (positive-density)."""
    return -1/a_plus


def scaled_noise(ctx: MPContext, kappa: mpf, eps: mpf) -> mpf:
    """kappa/sqrt(eps), the noise in scaled variables (eq:tildexykappa)."""
    return kappa/ctx.sqrt(eps)


def potential_left(ctx: MPContext, u: mpf, a_minus: mpf) -> mpf:
    """V(u) for u <= -1 (eq:V2)."""
    return -a_minus*(1 + u)


def potential_right(ctx: MPContext, u: mpf, a_plus: mpf, V1: mpf) -> mpf:
    """V(u) for u >= 1 (eq:V2)."""
    return V1 - a_plus*(-1 + u)


def log_exit_share(ctx: MPContext, sigma_left: mpf, sigma_right: mpf) -> mpf:
    """log C from sigma (positive-form)."""
    return -ctx.log1p(sigma_left/sigma_right)


def log_occupation_share(ctx: MPContext, inside: mpf, outside: mpf) -> mpf:
    """log P from the integrals inside and outside (positive-density)."""
    return -ctx.log1p(outside/inside)


def constant_single(ctx: MPContext, x: mpf) -> mpf:
    """int_e = int_inverse, per width (constant-panel)."""
    return (-ctx.expm1(-x))/x


def constant_nested_down(ctx: MPContext, x: mpf, int_e: mpf) -> mpf:
    """nested where V falls, per width^2 (constant-panel)."""
    return (int_e - ctx.exp(-x))/x


def constant_nested_up(ctx: MPContext, x: mpf, int_e: mpf) -> mpf:
    """nested where V rises, per width^2 (constant-panel)."""
    return (1 - int_e)/x


def constant_drift_time(ctx: MPContext, kappa: mpf, r: mpf, a: mpf) -> mpf:
    """T for a constant drift a (constant-drift)."""
    return r*ctx.tanh(a*r/kappa**2)/a


def constant_drift_exit(ctx: MPContext, kappa: mpf, r: mpf, a: mpf) -> mpf:
    """C for a constant drift a (constant-drift)."""
    return 1/(1 + ctx.exp(2*a*r/kappa**2))


def exit_bound(ctx: MPContext, kappa: mpf, r: mpf, a_minus: mpf, a_plus: mpf) -> mpf:
    """Upper bound on C; its conditions are in sa.formula (C-bound)."""
    return 2*a_minus*(1/a_plus + 2/kappa**2)*ctx.exp(-a_minus*r/kappa**2)


def outer_piece(ctx: MPContext, kappa: mpf, r: mpf, a_plus: mpf) -> mpf:
    """The fourth piece of T, exactly (eq:fourthTerm)."""
    return (-1 + r)/a_plus - kappa**2*(-ctx.expm1(-2*a_plus*(-1 + r)/kappa**2))/(2*a_plus**2)


def strong_noise_time(ctx: MPContext, r: mpf, a_plus: mpf) -> mpf:
    """T for strong noise, leading order (eq:Ttildelarge)."""
    return r/a_plus


def strong_noise_time_next(
    ctx: MPContext, kappa: mpf, r: mpf, a_minus: mpf, a_plus: mpf, V1: mpf
) -> mpf:
    """T for strong noise with its kappa^2 and constant terms (eq:Ttildelarge)."""
    return (
        r/a_plus + kappa**2*(-1/a_plus**2 + 1/(a_minus*a_plus))/2 + (V1 + a_minus +
        a_plus)/(a_minus*a_plus)
    )


def well_term(ctx: MPContext, kappa: mpf, slope_well: mpf, slope_barrier: mpf, barrier: mpf) -> mpf:
    """The well's share of T, leading order (eq:secondTerm)."""
    return 2*ctx.pi*ctx.sqrt(-1/(slope_barrier*slope_well))*ctx.exp(2*barrier/kappa**2)


def log_well_term(
    ctx: MPContext, kappa: mpf, slope_well: mpf, slope_barrier: mpf, barrier: mpf
) -> mpf:
    """Natural logarithm of `well_term` (eq:secondTerm)."""
    return -ctx.log(-slope_barrier*slope_well)/2 + 2*barrier/kappa**2 + ctx.log(2*ctx.pi)


def saddle_correction(ctx: MPContext, kappa: mpf, V2: mpf, V3: mpf, V4: mpf) -> mpf:
    """Relative correction of one saddle from V'', V''', V'''' there (eq:secondTerm)."""
    return kappa**2*(-V4/(8*V2**2) + 5*V3**2/(24*V2**3))/2


def weak_noise_time(
    ctx: MPContext,
    kappa: mpf,
    r: mpf,
    a_plus: mpf,
    slope_well: mpf,
    slope_barrier: mpf,
    barrier: mpf,
) -> mpf:
    """T for weak noise, with a well (eq:Ttildesmall)."""
    return r/a_plus + 2*ctx.pi*ctx.sqrt(-1/(slope_barrier*slope_well))*ctx.exp(2*barrier/kappa**2)


def well_edge(
    ctx: MPContext, r: mpf, a_plus: mpf, slope_well: mpf, slope_barrier: mpf, barrier: mpf
) -> mpf:
    """kappa at which both terms of `weak_noise_time` are equal (eq:Tsmall)."""
    return (
        ctx.sqrt(2*barrier) * ctx.sqrt(1/ctx.log(ctx.sqrt(-slope_barrier*slope_well) *
        r/(2*ctx.pi*a_plus)))
    )


def behind_barrier_term(
    ctx: MPContext, kappa: mpf, drift0: mpf, slope_well: mpf, V0: mpf, V_well: mpf
) -> mpf:
    """The large term of T for a start behind the barrier (eq:S)."""
    return ctx.sqrt(-ctx.pi/slope_well)*kappa*ctx.exp((-2*V_well + 2*V0)/kappa**2)/drift0


def occupation_from_layer(
    ctx: MPContext, kappa: mpf, a_minus: mpf, a_plus: mpf, layer: mpf, V1: mpf
) -> mpf:
    """P from N, the integral over the layer (eq:P2)."""
    return 1/(1 + (kappa**2/(2*a_minus) - kappa**2*ctx.exp(-2*V1/kappa**2)/(2*a_plus))/layer)


def occupation_bound(ctx: MPContext, kappa: mpf, a_minus: mpf, a_plus: mpf, L: mpf, V1: mpf) -> mpf:
    """Lower bound on P (L-bound)."""
    return 1/(1 + kappa**2*(-1/a_plus + ctx.exp(2*V1/kappa**2)/a_minus)/(2*L))


def strong_noise_occupation(ctx: MPContext, kappa: mpf, a_minus: mpf, a_plus: mpf) -> mpf:
    """P for strong noise, leading order (eq:Plarge2)."""
    return 4/(kappa**2*(1/a_minus - 1/a_plus))


def weak_noise_outside(
    ctx: MPContext, kappa: mpf, a_minus: mpf, a_plus: mpf, V1: mpf, V_well: mpf, curvature: mpf
) -> mpf:
    """1 - P for weak noise, leading order (eq:Psmall2)."""
    return (
        ctx.sqrt(curvature/ctx.pi)*kappa*(ctx.exp(2*V_well/kappa**2)/a_minus - ctx.exp(2*(V_well
        - V1)/kappa**2)/a_plus)/2
    )


def friction_left(ctx: MPContext, alpha: mpf, z0: mpf) -> mpf:
    """The friction drift for u <= -1 (a-) (eq:phifric0)."""
    return 1 + alpha - z0


def friction_inside(ctx: MPContext, u: mpf, mu: mpf, alpha: mpf, z0: mpf) -> mpf:
    """The friction drift A(u) on [-1, 1] (eq:phifric0)."""
    return 1 - z0 - alpha*(u + mu*(u - u**3))


def friction_right(ctx: MPContext, alpha: mpf, z0: mpf) -> mpf:
    """The friction drift for u >= 1 (a+) (eq:phifric0)."""
    return 1 - z0 - alpha


def friction_slope(ctx: MPContext, u: mpf, mu: mpf, alpha: mpf) -> mpf:
    """A'(u) of the friction drift (fr1)."""
    return -alpha*(1 + mu - 3*mu*u**2)


def friction_potential_left(ctx: MPContext, u: mpf, alpha: mpf, z0: mpf) -> mpf:
    """V(u) for u <= -1 (eq:Vfric)."""
    return (1 + u)*(-1 + z0 - alpha)


def friction_potential_inside(ctx: MPContext, u: mpf, mu: mpf, alpha: mpf, z0: mpf) -> mpf:
    """V(u) on [-1, 1] (eq:Vfric)."""
    return (1 + u)*(-1 + z0) + alpha*(1 + mu)*(-1 + u**2)/2 - alpha*mu*(-1 + u**4)/4


def friction_potential_right(ctx: MPContext, u: mpf, alpha: mpf, z0: mpf) -> mpf:
    """V(u) for u >= 1 (eq:Vfric)."""
    return -2 + 2*z0 - (-1 + u)*(1 - z0 - alpha)


def friction_turning_point(ctx: MPContext, mu: mpf) -> mpf:
    """u at which the force turns (mu > 1/2) (turning-points)."""
    return ctx.sqrt(3*(1 + mu)/mu)/3


def friction_breakaway(ctx: MPContext, mu: mpf, alpha: mpf) -> mpf:
    """The largest force, for mu >= 1/2 (beta)."""
    return 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9


def friction_folds(ctx: MPContext, mu: mpf, alpha: mpf) -> tuple[mpf, ...]:
    """z0 at both folds, (+) then (-) (folds)."""
    return (
        1 - 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9, 1 + 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 +
        mu)/9
    )


def friction_angle(ctx: MPContext, mu: mpf, alpha: mpf, z0: mpf) -> mpf:
    """omega, a third of arccos((1 - z0)/beta); z0 < 1, mu > 1/2 (friction-well)."""
    return (
        2*ctx.asin(ctx.sqrt(ctx.mpf(1)/2 - 3*ctx.sqrt(3*mu/(1 + mu))*(1 - z0)/(4*alpha*(1 +
        mu))))/3
    )


def friction_slope_well(ctx: MPContext, omega: mpf, mu: mpf, alpha: mpf) -> mpf:
    """A'(u1) at the well (friction-well)."""
    return -2*alpha*(1 + mu)*(-ctx.sin(omega) + ctx.sqrt(3)*ctx.cos(omega))*ctx.sin(omega)


def friction_slope_barrier(ctx: MPContext, omega: mpf, mu: mpf, alpha: mpf) -> mpf:
    """A'(u2) at the barrier (friction-well)."""
    return 2*alpha*(1 + mu)*(ctx.sqrt(3)*ctx.cos(omega) + ctx.sin(omega))*ctx.sin(omega)


def friction_barrier(ctx: MPContext, omega: mpf, mu: mpf, alpha: mpf) -> mpf:
    """V(u2) - V(u1) (friction-well)."""
    return 4*alpha*ctx.sqrt(3)*(1 + mu)**2*ctx.sin(omega)**3*ctx.cos(omega)/(3*mu)


def noise_threshold(ctx: MPContext, eps: mpf, ell: mpf, barrier: mpf) -> mpf:
    """Unscaled kappa below which T is exponentially large; ell = -log eps (threshold)."""
    return ctx.sqrt(2*barrier*eps/ell)
