"""float64 panel rules: what one short interval does to an escape problem.

With e(x) = exp(lam (V(x) - V(a))) on a panel [a, b], the escape problem needs
e(b), the integrals of e and 1/e, and the double integral of e(w)/e(x) over
w < x. Which scalings of them stay of moderate size depends on the sign of
V(b) - V(a), so a panel is recorded by four numbers per direction:

=========== ============================ ============================
field       down, V(b) <= V(a)           up, V(b) > V(a)
=========== ============================ ============================
rise        lam (V(b) - V(a))            the same
int_e       int e                        int e / e(b)
int_inverse e(b) int 1/e                 int 1/e
nested      e(b) int int e(w)/e(x)       int int e(w)/e(x)
=========== ============================ ============================

All are positive and none grows with lam, so nothing cancels or overflows. The rules take arrays, or
arrays that carry their derivatives (`symasym.numbers.dual_arrays`).
"""

from __future__ import annotations

from functools import cache
from typing import Any, NamedTuple

import numpy as np

from symasym.base.inputs import FloatArray
from symasym.base.patience import step
from symasym.generated.numpy_formulas import (
    constant_nested_down,
    constant_nested_up,
    constant_single,
)
from symasym.numbers.arithmetic import FLOATS
from symasym.numbers.dual_arrays import value_of
from symasym.special.exponentials import quotients

#: Largest lam |V(b) - V(a)| (roughly) of a panel that samples the exponential:
#: beyond it the ratio e^8 of largest to smallest sample costs rounding digits.
REACH = 8.0
#: A slow panel needs lam phi^2/|phi'| above this: nine terms of the slow
#: series then leave (2k-1)!! 400^-k < 1e-16.
SLOWNESS = 400.0
NODES = 16
#: Largest last Legendre coefficient of the samples, relative to their mean.
RESOLUTION = 1e-5
_SLOW_TERMS = 9


class Moments(NamedTuple):
    """The record of a panel (see the module's table); `rise` may be as large as lam."""

    rise: FloatArray
    int_e: FloatArray
    int_inverse: FloatArray
    nested: FloatArray


class Rule(NamedTuple):
    """A quadrature rule on [0, 1]: nodes, weights, and two matrices of the same nodes."""

    nodes: FloatArray
    weights: FloatArray
    integrate: FloatArray  # values -> running integral from 0 at the nodes
    differentiate: FloatArray


@cache
def gauss() -> Rule:
    """Gauss-Legendre. Nested integrals by `integrate` inherit the order 2 n of the outer rule."""
    x, w = np.polynomial.legendre.leggauss(NODES)
    p = np.polynomial.legendre.legvander(x, NODES)
    k = np.arange(NODES)
    to_coefficients = (k[:, None] + 0.5) * p[:, :NODES].T * w
    running = np.empty((NODES, NODES))
    running[:, 0] = x + 1
    running[:, 1:] = (p[:, 2:] - p[:, :-2]) / (2 * k[1:] + 1)
    return Rule((x + 1) / 2, w / 2, running @ to_coefficients / 2, np.empty((0, 0)))


@cache
def lobatto() -> Rule:
    """Chebyshev-Lobatto (both ends are nodes) with Clenshaw-Curtis weights."""
    n = NODES
    angle = np.pi * np.arange(n + 1) / n
    x = -np.cos(angle)
    c = np.ones(n + 1)
    c[0] = c[-1] = 2
    c *= (-1.0) ** np.arange(n + 1)
    difference = x[:, None] - x[None, :] + np.eye(n + 1)
    d = np.outer(c, 1 / c) / difference
    d -= np.diag(d.sum(axis=1))
    w = np.ones(n - 1)
    for k in range(1, n // 2):
        w -= 2 * np.cos(2 * k * angle[1:-1]) / (4 * k * k - 1)
    w -= np.cos(n * angle[1:-1]) / (n * n - 1)
    weights = np.concatenate(([1 / (n * n - 1)], 2 * w / n, [1 / (n * n - 1)]))
    return Rule((x + 1) / 2, weights / 2, np.empty((0, 0)), 2 * d)


@cache
def integrated_powers(count: int) -> FloatArray:
    """Row k: x^(k+1)/(k+1) at the Gauss nodes of [0, 1] and, last, at 1."""
    x = np.append(gauss().nodes, 1.0)
    k = np.arange(1, count + 1)[:, None]
    return x**k / k


def exponents_of_series(lam_phi_h: FloatArray) -> FloatArray:
    """lam int phi from the left end to each Gauss node, and to the right end.

    Parameters
    ----------
    lam_phi_h : array of shape (panels, terms)
        Taylor coefficients of lam * phi * h at the left end, in units of the width h.
    """
    result: FloatArray = lam_phi_h @ integrated_powers(lam_phi_h.shape[1])
    return result


def exponents_of_values(lam_phi_h: FloatArray) -> FloatArray:
    """The same from lam * phi * h at the Gauss nodes, shape (panels, NODES)."""
    rule = gauss()
    return np.concatenate(
        (lam_phi_h @ rule.integrate.T, (lam_phi_h @ rule.weights)[:, None]), axis=1
    )


@cache
def _last_coefficients() -> FloatArray:
    """Matrix from values at the Gauss nodes to the last four Legendre coefficients.

    A coefficient c_k of an entire function leaves about c_k^(2 NODES/k) to the rule,
    so the earlier ones may be larger.
    """
    x, w = np.polynomial.legendre.leggauss(NODES)
    k = np.arange(NODES - 4, NODES)
    p = np.polynomial.legendre.legvander(x, NODES - 1)[:, k]
    result: FloatArray = p * w[:, None] * (k + 0.5) * (0.07, 0.3, 1.0, 3.0)
    return result


def tail(values: FloatArray) -> FloatArray:
    """Size of the last Legendre coefficients, from values at the Gauss nodes."""
    result: FloatArray = np.abs(values @ _last_coefficients()) @ np.ones(4)
    return result


def _resolved(values: FloatArray, mean: FloatArray) -> np.ndarray:
    """Panels whose last Legendre coefficients say that the integral is right to rounding."""
    resolved: np.ndarray = tail(values) <= RESOLUTION * mean
    return resolved


def sampled(exponents: FloatArray, h: FloatArray) -> tuple[Moments, np.ndarray]:
    """Panels of width `h` on which the exponential is sampled, and which of them are resolved.

    Parameters
    ----------
    exponents : array of shape (panels, NODES + 1)
        lam int phi from the left end to each node and to the right end.
    h : array of shape (panels,)
    """
    rule = gauss()
    rise = -exponents[:, -1]
    inverse_e = np.exp(exponents[:, :-1])  # 1/e at the nodes
    e = 1.0 / inverse_e  # a division costs less than a second exponential
    up = rise > 0
    end = np.exp(np.where(up, -rise, rise))
    down_end = np.where(up, 1.0, end)
    int_e, int_inverse = e @ rule.weights, inverse_e @ rule.weights
    samples = value_of(e), value_of(inverse_e)
    resolved = _resolved(samples[0], value_of(int_e))
    resolved &= _resolved(samples[1], value_of(int_inverse))
    int_e = int_e * h * np.where(up, end, 1.0)
    int_inverse = int_inverse * h * down_end
    inverse_e *= e @ (rule.integrate * rule.weights[:, None]).T
    # A product with ones is several times faster than a sum over so short an axis.
    nested = (inverse_e @ np.ones(NODES)) * h * h * down_end
    return Moments(rise, int_e, int_inverse, nested), resolved


def slow_terms(lam_phi: FloatArray, h: FloatArray) -> list[FloatArray]:
    """Terms t_0 = 1/(lam|phi|), t_{k+1} = t_k'/(lam|phi|) at the Lobatto nodes.

    Their alternating sum solves M' = 1 - lam|phi| M and their sum solves
    Q' = -1 + lam|phi| Q, the solutions that follow the drift without a layer.
    """
    terms = [1.0 / np.abs(lam_phi)]
    derivative = lobatto().differentiate.T
    for _ in range(1, _SLOW_TERMS):
        terms.append((terms[-1] @ derivative) / h[:, None] * terms[0])
    return terms


def slow(lam_phi: FloatArray, h: FloatArray) -> Moments:
    """Panels on which lam|phi| is so large that integrals live in layers at the ends.

    Parameters
    ----------
    lam_phi : array of shape (panels, NODES + 1)
        lam * phi at the Lobatto nodes, of one sign per panel.
    h : array of shape (panels,)
    """
    rule = lobatto()
    terms = slow_terms(lam_phi, h)
    # The smallest first.
    even: Any = sum(terms[::-2])
    odd: Any = sum(terms[-2::-2])
    m, q = even - odd, even + odd
    rise = -h * (lam_phi @ rule.weights)
    decay = np.exp(-np.abs(rise))
    up = rise > 0
    # Layer at the end where 1/e is largest, and at the one where e is (roles of m and q
    # swap with the direction because the layer must decay away from its end).
    m_in, m_out, q_in, q_out = m[:, 0], m[:, -1], q[:, 0], q[:, -1]
    m_moment = m_out - m_in * decay
    q_moment = q_in - q_out * decay
    both_up = h * (m @ rule.weights) - m_in * q_moment
    both_down = q_in * m_moment - decay * h * (q @ rule.weights)
    return Moments(
        rise,
        np.where(up, m_moment, q_moment),
        np.where(up, q_moment, m_moment),
        np.where(up, both_up, both_down),
    )


def constant(lam_a: FloatArray, h: FloatArray) -> Moments:
    """Panels of any width on which the drift is constant, in closed form.

    Parameters
    ----------
    lam_a, h : arrays of shape (panels,)
        lam times the drift, and the width.
    """
    x = np.abs(lam_a * h)
    small = x < 0.5
    # The closed forms lose digits for small x.
    safe = np.where(small, 1.0, x)
    phi_1, phi_2 = quotients(np.where(small, -x, 0.0), FLOATS)
    first = np.where(small, phi_1, constant_single(safe))
    single = np.where(small, 1.0, first)
    up_form, down_form = constant_nested_up(safe, single), constant_nested_down(safe, single)
    up = lam_a < 0
    second = np.where(
        up, np.where(small, phi_2, up_form), np.where(small, phi_1 - phi_2, down_form)
    )
    return Moments(np.where(up, x, -x), h * first, h * first, h * h * second)


def merge(moments: Moments, k: np.ndarray, count: np.ndarray) -> Moments:
    """Join neighbouring records until one is left of each run.

    Parameters
    ----------
    moments : Moments
        Runs of neighbouring panels, one run after the other.
    k, count : integer arrays of shape (panels,)
        Index of a panel in its run, and the length of that run. A run's
        exponents must stay within the range of float64.
    """
    rise, int_e, int_inverse, nested = moments
    up = rise > 0
    # One scaling for all: integrals of e and 1/e as they stand at the left end.
    shrink = np.exp(np.where(up, rise, -rise))
    grow = np.where(up, shrink, 1.0)
    back = np.where(up, 1.0, shrink)
    e_int, inverse_int, double = int_e * grow, int_inverse * back, nested * back
    while (count > 1).any():
        step()
        left = np.flatnonzero(k % 2 == 0)
        paired = k[left] + 1 < count[left]
        right = np.where(paired, left + 1, left)
        end = np.exp(rise[left])
        joined = np.where(paired, 1.0, 0.0)
        inverse_right = joined * inverse_int[right] / end
        double = double[left] + joined * double[right] + e_int[left] * inverse_right
        e_int = e_int[left] + joined * end * e_int[right]
        inverse_int = inverse_int[left] + inverse_right
        rise = rise[left] + joined * rise[right]
        k, count = k[left] // 2, (count[left] + 1) // 2
    up = rise > 0
    end = np.exp(np.where(up, -rise, rise))
    down_end = np.where(up, 1.0, end)
    return Moments(rise, e_int * np.where(up, end, 1.0), inverse_int * down_end, double * down_end)


def merge_slow(
    scene: np.ndarray, moments: Moments, slow_panel: np.ndarray
) -> tuple[np.ndarray, Moments]:
    """Join neighbouring slow panels of one scene and one direction into one record.

    Returns the index of the first panel of each record, and the records.

    Their exponents exceed 40, so of the joint integrals only the layer at each
    end is left and, upwards, the products of neighbours.
    """
    if not slow_panel.any():
        return np.arange(len(scene)), moments
    rise, int_e, int_inverse, nested = moments
    up = rise > 0
    joins = np.zeros(len(scene), dtype=bool)
    joins[1:] = slow_panel[1:] & slow_panel[:-1] & (scene[1:] == scene[:-1]) & (up[1:] == up[:-1])
    first = np.flatnonzero(~joins)
    last = np.append(first[1:], len(scene)) - 1
    product = np.concatenate(([0.0], np.where(joins[1:], int_e[:-1] * int_inverse[1:], 0.0)))
    summed = np.add.reduceat(nested + product, first)
    single = first == last
    up = up[first]
    return first, Moments(
        np.add.reduceat(rise, first),
        np.where(up, int_e[last], int_e[first]),
        np.where(up, int_inverse[first], int_inverse[last]),
        np.where(up | single, summed, int_e[first] * int_inverse[last]),
    )
