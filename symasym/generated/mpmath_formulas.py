"""Formulas in an mpmath context `ctx`, at its precision.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import Any


def scaled_noise(ctx: Any, kappa: Any, eps: Any) -> Any:
    """kappa/sqrt(eps), the noise in scaled variables (eq:tildexykappa)."""
    return kappa/ctx.sqrt(eps)


def scaled_radius(ctx: Any, r: Any, eps: Any) -> Any:
    """r/eps, the radius in scaled variables (eq:tilder)."""
    return r/eps


def potential_left(ctx: Any, u: Any, a_minus: Any) -> Any:
    """V(u) for u <= -1 (eq:V2)."""
    return -a_minus*(1 + u)


def potential_right(ctx: Any, u: Any, a_plus: Any, V1: Any) -> Any:
    """V(u) for u >= 1 (eq:V2)."""
    return V1 - a_plus*(-1 + u)


def escape_time_of_halves(ctx: Any, w: Any, sigma_left: Any, sigma_right: Any) -> Any:
    """T from sigma on both sides and w, the sum of both (positive-form)."""
    return w/(1/sigma_left + 1/sigma_right)


def escape_time_of_products(
    ctx: Any, y_left: Any, y_right: Any, sigma_left: Any, sigma_right: Any
) -> Any:
    """T from sigma and y = w sigma on both sides (positive-form)."""
    return (sigma_left*y_right + sigma_right*y_left)/(sigma_left + sigma_right)


def log_escape_parts(
    ctx: Any, log_w_left: Any, log_w_right: Any, log_sigma_left: Any, log_sigma_right: Any
) -> Any:
    """log T is the first of these less the second: log w and log of the rate (positive-form)."""
    return (
        ctx.log(ctx.exp(log_w_left) + ctx.exp(log_w_right)), ctx.log(ctx.exp(-log_sigma_left) +
        ctx.exp(-log_sigma_right))
    )


def exit_share(ctx: Any, sigma_left: Any, sigma_right: Any) -> Any:
    """C from sigma on both sides (positive-form)."""
    return 1/(1 + sigma_left/sigma_right)


def log_exit_share(ctx: Any, sigma_left: Any, sigma_right: Any) -> Any:
    """log C from sigma (positive-form)."""
    return -ctx.log1p(sigma_left/sigma_right)


def log_exit_share_of_logs(ctx: Any, log_sigma_left: Any, log_sigma_right: Any) -> Any:
    """log C from log sigma (positive-form)."""
    return -ctx.log1p(ctx.exp(log_sigma_left - log_sigma_right))


def density_of_halves(ctx: Any, lam: Any, w: Any) -> Any:
    """p_ss from w, the sum of both sides (positive-density)."""
    return lam/w


def occupation_share(ctx: Any, inside: Any, outside: Any) -> Any:
    """P from the integrals inside and outside, in one unit (positive-density)."""
    return 1/(1 + outside/inside)


def log_occupation_share(ctx: Any, inside: Any, outside: Any) -> Any:
    """log P from the integrals inside and outside (positive-density)."""
    return -ctx.log1p(outside/inside)


def log_occupation_share_of_logs(ctx: Any, log_inside: Any, log_outside: Any) -> Any:
    """log P from the logarithms of both integrals (positive-density)."""
    return -ctx.log1p(ctx.exp(log_outside - log_inside))


def tail_left(ctx: Any, a_minus: Any) -> Any:
    """w at -1 (positive-density)."""
    return 1/a_minus


def tail_right(ctx: Any, a_plus: Any) -> Any:
    """w at 1, from the right (positive-density)."""
    return -1/a_plus


def log_tail_left(ctx: Any, a_minus: Any) -> Any:
    """log w at -1 (positive-density)."""
    return -ctx.log(a_minus)


def log_tail_right(ctx: Any, a_plus: Any) -> Any:
    """log w at 1, from the right (positive-density)."""
    return -ctx.log(-a_plus)


def constant_single(ctx: Any, x: Any) -> Any:
    """int_e = int_inverse, per width (constant-panel)."""
    return (-ctx.expm1(-x))/x


def constant_nested_down(ctx: Any, x: Any, int_e: Any) -> Any:
    """nested where V falls, per width^2 (constant-panel)."""
    return (int_e - ctx.exp(-x))/x


def constant_nested_up(ctx: Any, x: Any, int_e: Any) -> Any:
    """nested where V rises, per width^2 (constant-panel)."""
    return (1 - int_e)/x


def carried(
    ctx: Any,
    lam: Any,
    w: Any,
    int_e: Any,
    int_inverse: Any,
    nested: Any,
    fall: Any,
    climb: Any,
    sigma: Any,
) -> Any:
    """sigma and w after a panel (panel-step)."""
    return (
        (int_e + climb*sigma)/fall, (fall*w + int_inverse*lam)/(climb + int_e/sigma) +
        lam*nested/(int_e + climb*sigma)
    )


def absorbed(ctx: Any, lam: Any, int_e: Any, nested: Any, fall: Any) -> Any:
    """sigma and w after a panel that begins at an absorbing end (panel-step)."""
    return int_e/fall, lam*nested/int_e


def constant_drift_time(ctx: Any, kappa: Any, r: Any, a: Any) -> Any:
    """T for a constant drift a (constant-drift)."""
    return r*ctx.tanh(a*r/kappa**2)/a


def constant_drift_exit(ctx: Any, kappa: Any, r: Any, a: Any) -> Any:
    """C for a constant drift a (constant-drift)."""
    return 1/(1 + ctx.exp(2*a*r/kappa**2))


def exit_bound(ctx: Any, kappa: Any, r: Any, a_minus: Any, a_plus: Any) -> Any:
    """Upper bound on C; its conditions are in sa.formula (C-bound)."""
    return 2*a_minus*(1/a_plus + 2/kappa**2)*ctx.exp(-a_minus*r/kappa**2)


def outer_piece(ctx: Any, kappa: Any, r: Any, a_plus: Any) -> Any:
    """The fourth piece of T, exactly (eq:fourthTerm)."""
    return (-1 + r)/a_plus - kappa**2*(-ctx.expm1(-2*a_plus*(-1 + r)/kappa**2))/(2*a_plus**2)


def strong_noise_time(ctx: Any, r: Any, a_plus: Any) -> Any:
    """T for strong noise, leading order (eq:Ttildelarge)."""
    return r/a_plus


def strong_noise_time_next(ctx: Any, kappa: Any, r: Any, a_minus: Any, a_plus: Any, V1: Any) -> Any:
    """T for strong noise with its kappa^2 and constant terms (eq:Ttildelarge)."""
    return (
        r/a_plus + kappa**2*(-1/a_plus**2 + 1/(a_minus*a_plus))/2 + (V1 + a_minus +
        a_plus)/(a_minus*a_plus)
    )


def well_term(ctx: Any, kappa: Any, slope_well: Any, slope_barrier: Any, barrier: Any) -> Any:
    """The well's share of T, leading order (eq:secondTerm)."""
    return 2*ctx.pi*ctx.sqrt(-1/(slope_barrier*slope_well))*ctx.exp(2*barrier/kappa**2)


def log_well_term(ctx: Any, kappa: Any, slope_well: Any, slope_barrier: Any, barrier: Any) -> Any:
    """Natural logarithm of `well_term` (eq:secondTerm)."""
    return -ctx.log(-slope_barrier*slope_well)/2 + 2*barrier/kappa**2 + ctx.log(2*ctx.pi)


def saddle_correction(ctx: Any, kappa: Any, V2: Any, V3: Any, V4: Any) -> Any:
    """Relative correction of one saddle from V'', V''', V'''' there (eq:secondTerm)."""
    return kappa**2*(-V4/(8*V2**2) + 5*V3**2/(24*V2**3))/2


def saddle_first(ctx: Any, V2: Any, V3: Any, V4: Any) -> Any:
    """Coefficient of 1/lam in a well's series; of -V, a barrier's (saddle-series)."""
    return -V4/(8*V2**2) + 5*V3**2/(24*V2**3)


def saddle_second(ctx: Any, V2: Any, V3: Any, V4: Any, V5: Any, V6: Any) -> Any:
    """Coefficient of 1/lam^2 in the series of `saddle_first` (saddle-series)."""
    return (
        -V6/(48*V2**3) + 35*V4**2/(384*V2**4) + 385*V3**4/(1152*V2**6) - 35*V4*V3**2/(64*V2**5)
        + 7*V3*V5/(48*V2**4)
    )


def weak_noise_time(
    ctx: Any, kappa: Any, r: Any, a_plus: Any, slope_well: Any, slope_barrier: Any, barrier: Any
) -> Any:
    """T for weak noise, with a well (eq:Ttildesmall)."""
    return r/a_plus + 2*ctx.pi*ctx.sqrt(-1/(slope_barrier*slope_well))*ctx.exp(2*barrier/kappa**2)


def well_edge(
    ctx: Any, r: Any, a_plus: Any, slope_well: Any, slope_barrier: Any, barrier: Any
) -> Any:
    """kappa at which both terms of `weak_noise_time` are equal (eq:Tsmall)."""
    return (
        ctx.sqrt(2*barrier) * ctx.sqrt(1/ctx.log(ctx.sqrt(-slope_barrier*slope_well) *
        r/(2*ctx.pi*a_plus)))
    )


def behind_barrier_term(
    ctx: Any, kappa: Any, drift0: Any, slope_well: Any, V0: Any, V_well: Any
) -> Any:
    """The large term of T for a start behind the barrier (eq:S)."""
    return ctx.sqrt(-ctx.pi/slope_well)*kappa*ctx.exp((-2*V_well + 2*V0)/kappa**2)/drift0


def occupation_from_layer(
    ctx: Any, kappa: Any, a_minus: Any, a_plus: Any, layer: Any, V1: Any
) -> Any:
    """P from N, the integral over the layer (eq:P2)."""
    return 1/(1 + (kappa**2/(2*a_minus) - kappa**2*ctx.exp(-2*V1/kappa**2)/(2*a_plus))/layer)


def occupation_bound(ctx: Any, kappa: Any, a_minus: Any, a_plus: Any, L: Any, V1: Any) -> Any:
    """Lower bound on P (L-bound)."""
    return 1/(1 + kappa**2*(-1/a_plus + ctx.exp(2*V1/kappa**2)/a_minus)/(2*L))


def strong_noise_occupation(ctx: Any, kappa: Any, a_minus: Any, a_plus: Any) -> Any:
    """P for strong noise, leading order (eq:Plarge2)."""
    return 4/(kappa**2*(1/a_minus - 1/a_plus))


def weak_noise_outside(
    ctx: Any, kappa: Any, a_minus: Any, a_plus: Any, V1: Any, V_well: Any, curvature: Any
) -> Any:
    """1 - P for weak noise, leading order (eq:Psmall2)."""
    return (
        ctx.sqrt(curvature/ctx.pi)*kappa*(ctx.exp(2*V_well/kappa**2)/a_minus - ctx.exp(2*(V_well
        - V1)/kappa**2)/a_plus)/2
    )


def friction_left(ctx: Any, alpha: Any, z0: Any) -> Any:
    """The friction drift for u <= -1 (a-) (eq:phifric0)."""
    return 1 + alpha - z0


def friction_coefficients(ctx: Any, mu: Any, alpha: Any, z0: Any) -> Any:
    """Coefficients of A(u) in ascending powers of u (eq:phifric0)."""
    return 1 - z0, -alpha*(1 + mu), 0, alpha*mu


def friction_inside(ctx: Any, u: Any, mu: Any, alpha: Any, z0: Any) -> Any:
    """The friction drift A(u) on [-1, 1] (eq:phifric0)."""
    return 1 - z0 - alpha*(u + mu*(u - u**3))


def friction_right(ctx: Any, alpha: Any, z0: Any) -> Any:
    """The friction drift for u >= 1 (a+) (eq:phifric0)."""
    return 1 - z0 - alpha


def friction_slope(ctx: Any, u: Any, mu: Any, alpha: Any) -> Any:
    """A'(u) of the friction drift (fr1)."""
    return -alpha*(1 + mu - 3*mu*u**2)


def friction_potential_left(ctx: Any, u: Any, alpha: Any, z0: Any) -> Any:
    """V(u) for u <= -1 (eq:Vfric)."""
    return (1 + u)*(-1 + z0 - alpha)


def friction_potential_inside(ctx: Any, u: Any, mu: Any, alpha: Any, z0: Any) -> Any:
    """V(u) on [-1, 1] (eq:Vfric)."""
    return (1 + u)*(-1 + z0) + alpha*(1 + mu)*(-1 + u**2)/2 - alpha*mu*(-1 + u**4)/4


def friction_potential_right(ctx: Any, u: Any, alpha: Any, z0: Any) -> Any:
    """V(u) for u >= 1 (eq:Vfric)."""
    return -2 + 2*z0 - (-1 + u)*(1 - z0 - alpha)


def friction_turning_point(ctx: Any, mu: Any) -> Any:
    """u at which the force turns (mu > 1/2) (turning-points)."""
    return ctx.sqrt(3*(1 + mu)/mu)/3


def friction_breakaway(ctx: Any, mu: Any, alpha: Any) -> Any:
    """The largest force, for mu >= 1/2 (beta)."""
    return 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9


def friction_folds(ctx: Any, mu: Any, alpha: Any) -> Any:
    """z0 at both folds, (+) then (-) (folds)."""
    return (
        1 - 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9, 1 + 2*ctx.sqrt(3*(1 + mu)/mu)*alpha*(1 +
        mu)/9
    )


def friction_angle(ctx: Any, mu: Any, alpha: Any, z0: Any) -> Any:
    """omega, a third of arccos((1 - z0)/beta); z0 < 1, mu > 1/2 (friction-well)."""
    return (
        2*ctx.asin(ctx.sqrt(ctx.mpf(1)/2 - 3*ctx.sqrt(3*mu/(1 + mu))*(1 - z0)/(4*alpha*(1 +
        mu))))/3
    )


def friction_slope_well(ctx: Any, omega: Any, mu: Any, alpha: Any) -> Any:
    """A'(u1) at the well (friction-well)."""
    return -2*alpha*(1 + mu)*(-ctx.sin(omega) + ctx.sqrt(3)*ctx.cos(omega))*ctx.sin(omega)


def friction_slope_barrier(ctx: Any, omega: Any, mu: Any, alpha: Any) -> Any:
    """A'(u2) at the barrier (friction-well)."""
    return 2*alpha*(1 + mu)*(ctx.sqrt(3)*ctx.cos(omega) + ctx.sin(omega))*ctx.sin(omega)


def friction_barrier(ctx: Any, omega: Any, mu: Any, alpha: Any) -> Any:
    """V(u2) - V(u1) (friction-well)."""
    return 4*alpha*ctx.sqrt(3)*(1 + mu)**2*ctx.sin(omega)**3*ctx.cos(omega)/(3*mu)


def noise_threshold(ctx: Any, eps: Any, ell: Any, barrier: Any) -> Any:
    """Unscaled kappa below which T is exponentially large; ell = -log eps (threshold)."""
    return ctx.sqrt(2*barrier*eps/ell)
