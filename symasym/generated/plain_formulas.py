"""Formulas of + - * / and whole powers, for numbers of any one kind.

Written by ``python -m derivations.emit`` from the checked derivations: do not edit.
"""

# A formatter must not touch what a test compares.
# fmt: off

from __future__ import annotations

from typing import Any, Protocol


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


def escape_time_of_halves(w: Ratios, sigma_left: Ratios, sigma_right: Ratios) -> Any:
    """T from sigma on both sides and w, the sum of both (positive-form)."""
    return w/(1/sigma_left + 1/sigma_right)


def exit_share(sigma_left: Ratios, sigma_right: Ratios) -> Any:
    """C from sigma on both sides (positive-form)."""
    return 1/(1 + sigma_left/sigma_right)


def density_of_halves(lam: Ratios, w: Ratios) -> Any:
    """p_ss from w, the sum of both sides (positive-density)."""
    return lam/w


def occupation_share(inside: Ratios, outside: Ratios) -> Any:
    """P from the integrals inside and outside, in one unit (positive-density)."""
    return 1/(1 + outside/inside)


def tail_left(a_minus: Ratios) -> Any:
    """w at -1 (positive-density)."""
    return 1/a_minus


def tail_right(a_plus: Ratios) -> Any:
    """w at 1, from the right (positive-density)."""
    return -1/a_plus


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


def manifold_term(source: Ratios, drift: Ratios) -> Any:
    """h_1 from the weight, h_(k+1) from -h_k': the slow manifold's terms (endpoint-series)."""
    return source/drift


def endpoint_shares(side: Field, term: Field) -> Any:
    """A start's coefficients of lam^-k from h_k, side = (-1)^k, to its right (endpoint-series)."""
    return -side*term, -term


def kink_change(left: Field, right: Field) -> Any:
    """What stands for h_k at a kink (endpoint-series)."""
    return right - left


def fall_by_powers(index: Field, power: Field, term: Field) -> Any:
    """-h' of term t^(index - power), its coefficient (regular-part)."""
    return term*(power - index)


def finite_part(power: Field, term: Field) -> Any:
    """Primitive of term t^-power, the coefficient of t^(1 - power) (regular-part)."""
    return term/(1 - power)


def next_share_of_line(n: Field, share: Field, square: Field) -> Any:
    """int (y^2 - square)^(-n - 1) over the line from that of the power -n (pair-primitives)."""
    return share*(1 - 2*n)/(2*square*n)


def next_binomial(n: Ratios, i: Ratios, term: Ratios) -> Any:
    """Coefficient i + 1 of (1 - x)^-n from coefficient i (pair-primitives)."""
    return term*(i + n)/(1 + i)


def two_powers_more(lower: Ratios, same: Ratios, square: Ratios) -> Any:
    """int y^(j + 2) W^-n from y^j W^(1 - n) and y^j W^-n, W = y^2 - square (pair-primitives)."""
    return lower + same*square


def fall_beside_pair(index: Field, power: Field, before: Field, after: Field, square: Field) -> Any:
    """-h' of a sum of c_i y^i over (y^2 - square)^power, its coefficient (pair-primitives)."""
    return before*(1 - index + 2*power) + after*square*(1 + index)


def bend_of_saddle(j: Ratios, term: Ratios, slope: Ratios) -> Any:
    """alpha_j of V - V(z) = -slope t^2/2 (1 + alpha_1 t + ...) (saddle-recurrences)."""
    return 2*term/(slope*(2 + j))


def next_moment(n: Ratios, moment: Ratios) -> Any:
    """int s^(2n + 2) e^(-s^2/2) ds from that of s^(2n) (saddle-recurrences)."""
    return moment*(1 + 2*n)


def time_of_doubles(
    behind: Ratios, ahead: Ratios, double_left: Ratios, double_right: Ratios, total: Ratios
) -> Any:
    """T/lam from the single and the double integrals over both sides (two-sides)."""
    return (ahead*double_left + behind*double_right)/total


def on_the_right(ahead: Ratios, nested_right: Ratios, falling: Ratios) -> Any:
    """The double integral on the right with the start's share of both sides (two-sides)."""
    return nested_right + ahead*falling


def share_of_side(ahead: Ratios, total: Ratios) -> Any:
    """C from the integral of e^(lam V) on the right and over both sides (two-sides)."""
    return ahead/total


def next_weight(k: Ratios, zeta: Ratios, p_2: Ratios, q_1: Ratios, q_2: Ratios) -> Any:
    """p_k and q_k of the next order, from q_(k+1), p_(k+2) and q_(k+2) of this one (airy-form)."""
    return q_1*(1 + 2*k) + q_2*zeta*(2 + 2*k), p_2*(2 + 2*k)


def pair_factors(a: Field, b: Field, a_up: Field, b_up: Field) -> Any:
    """Factors of Ai^2 + Bi^2, Ai Ai' + Bi Bi', Ai'^2 + Bi'^2 with both weights (airy-form)."""
    return a*a_up, a*b_up - a_up*b, -b*b_up


def barrier_truncated(
    a: Field, b: Field, a_down: Field, weights: Field, tail: Field, falling: Field, integral: Field
) -> Any:
    """A truncated barrier in both integrals and the regular part (truncated-gaussian)."""
    return a*tail, a_down*falling, integral*weights - a_down*b*falling


def well_truncated(
    a: Field,
    a_down: Field,
    b_down: Field,
    weights: Field,
    tail: Field,
    falling: Field,
    integral: Field,
) -> Any:
    """The same of a well (truncated-gaussian)."""
    return -a_down*falling, -a*tail, -integral*weights - a*b_down*tail


def friction_coefficients(mu: Field, alpha: Field, z0: Field) -> Any:
    """Coefficients of A(u) in ascending powers of u (eq:phifric0)."""
    return 1 - z0, -alpha*(1 + mu), 0, alpha*mu
