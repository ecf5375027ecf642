"""Formulas in float64, for arrays that broadcast together.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from symasym.base.inputs import Floats


def scaled_noise(kappa: Floats, eps: Floats) -> Any:
    """kappa/sqrt(eps), the noise in scaled variables (eq:tildexykappa)."""
    return kappa/np.sqrt(eps)


def scaled_radius(r: Floats, eps: Floats) -> Any:
    """r/eps, the radius in scaled variables (eq:tilder)."""
    return r/eps


def potential_left(u: Floats, a_minus: Floats) -> Any:
    """V(u) for u <= -1 (eq:V2)."""
    return -a_minus*(1 + u)


def potential_right(u: Floats, a_plus: Floats, V1: Floats) -> Any:
    """V(u) for u >= 1 (eq:V2)."""
    return V1 - a_plus*(-1 + u)


def escape_time_of_halves(w: Floats, sigma_left: Floats, sigma_right: Floats) -> Any:
    """T from sigma on both sides and w, the sum of both (positive-form)."""
    return w/(1/sigma_left + 1/sigma_right)


def exit_share(sigma_left: Floats, sigma_right: Floats) -> Any:
    """C from sigma on both sides (positive-form)."""
    return 1/(1 + sigma_left/sigma_right)


def log_exit_share(sigma_left: Floats, sigma_right: Floats) -> Any:
    """log C from sigma (positive-form)."""
    return -np.log1p(sigma_left/sigma_right)


def density_of_halves(lam: Floats, w: Floats) -> Any:
    """p_ss from w, the sum of both sides (positive-density)."""
    return lam/w


def occupation_share(inside: Floats, outside: Floats) -> Any:
    """P from the integrals inside and outside, in one unit (positive-density)."""
    return 1/(1 + outside/inside)


def log_occupation_share(inside: Floats, outside: Floats) -> Any:
    """log P from the integrals inside and outside (positive-density)."""
    return -np.log1p(outside/inside)


def tail_left(a_minus: Floats) -> Any:
    """w at -1 (positive-density)."""
    return 1/a_minus


def tail_right(a_plus: Floats) -> Any:
    """w at 1, from the right (positive-density)."""
    return -1/a_plus


def constant_single(x: Floats) -> Any:
    """int_e = int_inverse, per width (constant-panel)."""
    return (-np.expm1(-x))/x


def constant_nested_down(x: Floats, int_e: Floats) -> Any:
    """nested where V falls, per width^2 (constant-panel)."""
    return (int_e - np.exp(-x))/x


def constant_nested_up(x: Floats, int_e: Floats) -> Any:
    """nested where V rises, per width^2 (constant-panel)."""
    return (1 - int_e)/x


def carried(
    lam: Floats,
    w: Floats,
    int_e: Floats,
    int_inverse: Floats,
    nested: Floats,
    fall: Floats,
    climb: Floats,
    sigma: Floats,
) -> Any:
    """sigma and w after a panel (panel-step)."""
    return (
        (int_e + climb*sigma)/fall, (fall*w + int_inverse*lam)/(climb + int_e/sigma) +
        lam*nested/(int_e + climb*sigma)
    )


def absorbed(lam: Floats, int_e: Floats, nested: Floats, fall: Floats) -> Any:
    """sigma and w after a panel that begins at an absorbing end (panel-step)."""
    return int_e/fall, lam*nested/int_e


def constant_drift_time(kappa: Floats, r: Floats, a: Floats) -> Any:
    """T for a constant drift a (constant-drift)."""
    return r*np.tanh(a*r/kappa**2)/a


def constant_drift_exit(kappa: Floats, r: Floats, a: Floats) -> Any:
    """C for a constant drift a (constant-drift)."""
    return 1/(1 + np.exp(2*a*r/kappa**2))


def exit_bound(kappa: Floats, r: Floats, a_minus: Floats, a_plus: Floats) -> Any:
    """Upper bound on C; its conditions are in sa.formula (C-bound)."""
    return 2*a_minus*(1/a_plus + 2/kappa**2)*np.exp(-a_minus*r/kappa**2)


def outer_piece(kappa: Floats, r: Floats, a_plus: Floats) -> Any:
    """The fourth piece of T, exactly (eq:fourthTerm)."""
    return (-1 + r)/a_plus - kappa**2*(-np.expm1(-2*a_plus*(-1 + r)/kappa**2))/(2*a_plus**2)


def strong_noise_time(r: Floats, a_plus: Floats) -> Any:
    """T for strong noise, leading order (eq:Ttildelarge)."""
    return r/a_plus


def strong_noise_time_next(
    kappa: Floats, r: Floats, a_minus: Floats, a_plus: Floats, V1: Floats
) -> Any:
    """T for strong noise with its kappa^2 and constant terms (eq:Ttildelarge)."""
    return (
        r/a_plus + kappa**2*(-1/a_plus**2 + 1/(a_minus*a_plus))/2 + (V1 + a_minus +
        a_plus)/(a_minus*a_plus)
    )


def well_term(kappa: Floats, slope_well: Floats, slope_barrier: Floats, barrier: Floats) -> Any:
    """The well's share of T, leading order (eq:secondTerm)."""
    return 2*np.pi*np.sqrt(-1/(slope_barrier*slope_well))*np.exp(2*barrier/kappa**2)


def log_well_term(kappa: Floats, slope_well: Floats, slope_barrier: Floats, barrier: Floats) -> Any:
    """Natural logarithm of `well_term` (eq:secondTerm)."""
    return -np.log(-slope_barrier*slope_well)/2 + 2*barrier/kappa**2 + np.log(2*np.pi)


def saddle_correction(kappa: Floats, V2: Floats, V3: Floats, V4: Floats) -> Any:
    """Relative correction of one saddle from V'', V''', V'''' there (eq:secondTerm)."""
    return kappa**2*(-V4/(8*V2**2) + 5*V3**2/(24*V2**3))/2


def saddle_first(V2: Floats, V3: Floats, V4: Floats) -> Any:
    """Coefficient of 1/lam in a well's series; of -V, a barrier's (saddle-series)."""
    return -V4/(8*V2**2) + 5*V3**2/(24*V2**3)


def saddle_second(V2: Floats, V3: Floats, V4: Floats, V5: Floats, V6: Floats) -> Any:
    """Coefficient of 1/lam^2 in the series of `saddle_first` (saddle-series)."""
    return (
        -V6/(48*V2**3) + 35*V4**2/(384*V2**4) + 385*V3**4/(1152*V2**6) - 35*V4*V3**2/(64*V2**5)
        + 7*V3*V5/(48*V2**4)
    )


def manifold_term(source: Floats, drift: Floats) -> Any:
    """h_1 from the weight, h_(k+1) from -h_k': the slow manifold's terms (endpoint-series)."""
    return source/drift


def endpoint_shares(side: Floats, term: Floats) -> Any:
    """A start's coefficients of lam^-k from h_k, side = (-1)^k, to its right (endpoint-series)."""
    return -side*term, -term


def kink_change(left: Floats, right: Floats) -> Any:
    """What stands for h_k at a kink (endpoint-series)."""
    return right - left


def fall_by_powers(index: Floats, power: Floats, term: Floats) -> Any:
    """-h' of term t^(index - power), its coefficient (regular-part)."""
    return term*(power - index)


def finite_part(power: Floats, term: Floats) -> Any:
    """Primitive of term t^-power, the coefficient of t^(1 - power) (regular-part)."""
    return term/(1 - power)


def bend_of_saddle(j: Floats, term: Floats, slope: Floats) -> Any:
    """alpha_j of V - V(z) = -slope t^2/2 (1 + alpha_1 t + ...) (saddle-recurrences)."""
    return 2*term/(slope*(2 + j))


def first_moment() -> Any:
    """int e^(-s^2/2) ds (saddle-recurrences)."""
    return np.sqrt(2*np.pi)


def next_moment(n: Floats, moment: Floats) -> Any:
    """int s^(2n + 2) e^(-s^2/2) ds from that of s^(2n) (saddle-recurrences)."""
    return moment*(1 + 2*n)


def time_of_doubles(
    behind: Floats, ahead: Floats, double_left: Floats, double_right: Floats, total: Floats
) -> Any:
    """T/lam from the single and the double integrals over both sides (two-sides)."""
    return (ahead*double_left + behind*double_right)/total


def on_the_right(ahead: Floats, nested_right: Floats, falling: Floats) -> Any:
    """The double integral on the right with the start's share of both sides (two-sides)."""
    return nested_right + ahead*falling


def pair_norm(even: Floats, odd: Floats, square: Floats) -> Any:
    """The product of psi at both zeros of a pair (airy-form)."""
    return even**2 - square*odd**2


def canonical(slope: Floats, even: Floats, odd: Floats, norm: Floats) -> Any:
    """a and b of u' = a + b s at a pair of zeros, odd counted along s (airy-form)."""
    return (
        np.sqrt(2*(even + np.sqrt(norm))/(norm*slope))/2, -np.sqrt(2*slope/(norm*(even +
        np.sqrt(norm))))*odd/2
    )


def pair_share(side: Floats, even: Floats, odd: Floats, norm: Floats) -> Any:
    """alpha and beta: the pair's share of 1/phi is (alpha + beta y)/(y^2 - square) (airy-form)."""
    return side*even/norm, -odd*side/norm


def over_pair(a: Floats, small: Floats, b: Floats, bi: Floats, bi_slope: Floats) -> Any:
    """int e^(lam V) and int e^(-lam V) over a pair; `small` is lam^(-1/3) (airy-form)."""
    return np.pi*small*(a*bi + b*bi_slope*small), np.pi*small*(a*bi - b*bi_slope*small)


def over_pair_twice(a: Floats, small: Floats, b: Floats, squares: Floats, slopes: Floats) -> Any:
    """The double integral over a pair, from Ai^2 + Bi^2 and Ai'^2 + Bi'^2 (airy-form)."""
    return np.pi**2*small**2*(squares*a**2 - slopes*b**2*small**2)


def end_distance(gap: Floats, area: Floats) -> Any:
    """t at the end of a barrier's Gaussian: t^2/2 = gap^2 area (truncated-gaussian)."""
    return np.sqrt(2*area)*gap


def end_peak(bottom: Floats) -> Any:
    """du/dt at the barrier (truncated-gaussian)."""
    return 1/np.sqrt(bottom)


def end_mean(bottom: Floats, area: Floats) -> Any:
    """The mean of psi before the end: peak/t = 1/(gap mean) (truncated-gaussian)."""
    return np.sqrt(2*area*bottom)


def end_rest(
    bottom: Floats, gap: Floats, first: Floats, second: Floats, value: Floats, mean: Floats
) -> Any:
    """1/phi at the end less peak/t, without its cancellation (truncated-gaussian)."""
    return (first*bottom - gap*second**2 - 2*second*bottom)/(mean*value*(mean + value))


def over_end(
    lam: Floats,
    t: Floats,
    peak: Floats,
    rest: Floats,
    tail: Floats,
    falling: Floats,
    integral: Floats,
) -> Any:
    """int e^(lam V) from the end on, int e^(-lam V) up to it, and both (truncated-gaussian)."""
    return (
        -rest/lam - peak*tail, rest/lam + falling*peak, peak**2*(integral - np.log(t))/lam -
        rest*falling*peak/lam
    )


def weak_noise_time(
    kappa: Floats,
    r: Floats,
    a_plus: Floats,
    slope_well: Floats,
    slope_barrier: Floats,
    barrier: Floats,
) -> Any:
    """T for weak noise, with a well (eq:Ttildesmall)."""
    return r/a_plus + 2*np.pi*np.sqrt(-1/(slope_barrier*slope_well))*np.exp(2*barrier/kappa**2)


def well_edge(
    r: Floats, a_plus: Floats, slope_well: Floats, slope_barrier: Floats, barrier: Floats
) -> Any:
    """kappa at which both terms of `weak_noise_time` are equal (eq:Tsmall)."""
    return (
        np.sqrt(2*barrier) * np.sqrt(1/np.log(np.sqrt(-slope_barrier*slope_well) *
        r/(2*np.pi*a_plus)))
    )


def behind_barrier_term(
    kappa: Floats, drift0: Floats, slope_well: Floats, V0: Floats, V_well: Floats
) -> Any:
    """The large term of T for a start behind the barrier (eq:S)."""
    return np.sqrt(-np.pi/slope_well)*kappa*np.exp((-2*V_well + 2*V0)/kappa**2)/drift0


def occupation_from_layer(
    kappa: Floats, a_minus: Floats, a_plus: Floats, layer: Floats, V1: Floats
) -> Any:
    """P from N, the integral over the layer (eq:P2)."""
    return 1/(1 + (kappa**2/(2*a_minus) - kappa**2*np.exp(-2*V1/kappa**2)/(2*a_plus))/layer)


def occupation_bound(kappa: Floats, a_minus: Floats, a_plus: Floats, L: Floats, V1: Floats) -> Any:
    """Lower bound on P (L-bound)."""
    return 1/(1 + kappa**2*(-1/a_plus + np.exp(2*V1/kappa**2)/a_minus)/(2*L))


def strong_noise_occupation(kappa: Floats, a_minus: Floats, a_plus: Floats) -> Any:
    """P for strong noise, leading order (eq:Plarge2)."""
    return 4/(kappa**2*(1/a_minus - 1/a_plus))


def weak_noise_outside(
    kappa: Floats, a_minus: Floats, a_plus: Floats, V1: Floats, V_well: Floats, curvature: Floats
) -> Any:
    """1 - P for weak noise, leading order (eq:Psmall2)."""
    return (
        np.sqrt(curvature/np.pi)*kappa*(np.exp(2*V_well/kappa**2)/a_minus - np.exp(2*(V_well -
        V1)/kappa**2)/a_plus)/2
    )


def friction_left(alpha: Floats, z0: Floats) -> Any:
    """The friction drift for u <= -1 (a-) (eq:phifric0)."""
    return 1 + alpha - z0


def friction_coefficients(mu: Floats, alpha: Floats, z0: Floats) -> Any:
    """Coefficients of A(u) in ascending powers of u (eq:phifric0)."""
    return 1 - z0, -alpha*(1 + mu), 0, alpha*mu


def friction_inside(u: Floats, mu: Floats, alpha: Floats, z0: Floats) -> Any:
    """The friction drift A(u) on [-1, 1] (eq:phifric0)."""
    return 1 - z0 - alpha*(u + mu*(u - u**3))


def friction_right(alpha: Floats, z0: Floats) -> Any:
    """The friction drift for u >= 1 (a+) (eq:phifric0)."""
    return 1 - z0 - alpha


def friction_slope(u: Floats, mu: Floats, alpha: Floats) -> Any:
    """A'(u) of the friction drift (fr1)."""
    return -alpha*(1 + mu - 3*mu*u**2)


def friction_potential_left(u: Floats, alpha: Floats, z0: Floats) -> Any:
    """V(u) for u <= -1 (eq:Vfric)."""
    return (1 + u)*(-1 + z0 - alpha)


def friction_potential_inside(u: Floats, mu: Floats, alpha: Floats, z0: Floats) -> Any:
    """V(u) on [-1, 1] (eq:Vfric)."""
    return (1 + u)*(-1 + z0) + alpha*(1 + mu)*(-1 + u**2)/2 - alpha*mu*(-1 + u**4)/4


def friction_potential_right(u: Floats, alpha: Floats, z0: Floats) -> Any:
    """V(u) for u >= 1 (eq:Vfric)."""
    return -2 + 2*z0 - (-1 + u)*(1 - z0 - alpha)


def friction_turning_point(mu: Floats) -> Any:
    """u at which the force turns (mu > 1/2) (turning-points)."""
    return np.sqrt(3*(1 + mu)/mu)/3


def friction_breakaway(mu: Floats, alpha: Floats) -> Any:
    """The largest force, for mu >= 1/2 (beta)."""
    return 2*np.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9


def friction_folds(mu: Floats, alpha: Floats) -> Any:
    """z0 at both folds, (+) then (-) (folds)."""
    return (
        1 - 2*np.sqrt(3*(1 + mu)/mu)*alpha*(1 + mu)/9, 1 + 2*np.sqrt(3*(1 + mu)/mu)*alpha*(1 +
        mu)/9
    )


def friction_angle(mu: Floats, alpha: Floats, z0: Floats) -> Any:
    """omega, a third of arccos((1 - z0)/beta); z0 < 1, mu > 1/2 (friction-well)."""
    return 2*np.arcsin(np.sqrt(1/2 - 3*np.sqrt(3*mu/(1 + mu))*(1 - z0)/(4*alpha*(1 + mu))))/3


def friction_slope_well(omega: Floats, mu: Floats, alpha: Floats) -> Any:
    """A'(u1) at the well (friction-well)."""
    return -2*alpha*(1 + mu)*(-np.sin(omega) + np.sqrt(3)*np.cos(omega))*np.sin(omega)


def friction_slope_barrier(omega: Floats, mu: Floats, alpha: Floats) -> Any:
    """A'(u2) at the barrier (friction-well)."""
    return 2*alpha*(1 + mu)*(np.sqrt(3)*np.cos(omega) + np.sin(omega))*np.sin(omega)


def friction_barrier(omega: Floats, mu: Floats, alpha: Floats) -> Any:
    """V(u2) - V(u1) (friction-well)."""
    return 4*alpha*np.sqrt(3)*(1 + mu)**2*np.sin(omega)**3*np.cos(omega)/(3*mu)


def noise_threshold(eps: Floats, ell: Floats, barrier: Floats) -> Any:
    """Unscaled kappa below which T is exponentially large; ell = -log eps (threshold)."""
    return np.sqrt(2*barrier*eps/ell)
